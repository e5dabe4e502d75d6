"""Forces for reading: a row for each drive and each joint, over all configurations."""

from collections.abc import Iterator

import numpy as np

from jointplay.result import Result, blamed_for, in_words
from jointplay.result.conclusions.forces import change
from jointplay.result.verdict import cause, ends

from .layout import NOTHING, Column, ResultTable, numbers, words

#: what rows are about, by the word in front of their names
TITLES = {"drives": "Forces of the drives", "joints": "Reactions at the joints"}


def overview(result: Result) -> list[ResultTable]:
    """A table for the drives of each unit, and one for the joints."""
    kinds = [(name.partition(".")[0], result.unit("force", quantity=name)) for name in result.labels("quantity")]
    found = []
    for kind, unit in dict.fromkeys(kinds):
        rows = [k for k, one in enumerate(kinds) if one == (kind, unit)]
        found.append(ResultTable(TITLES[kind], tuple(_columns(result, rows, unit))))
    return [*found[:-1], ResultTable(found[-1].title, found[-1].columns, tuple(_notes(result)))] if found else []


def _columns(result: Result, rows: list[int], unit: str) -> Iterator[Column]:
    names = [str(result.labels("quantity")[k]) for k in rows]
    yield words("", [name.partition(".")[2] for name in names], is_key=True)
    nominal, (lowest, highest) = result.get("nominal_force")[:, rows], [end[:, rows] for end in ends(result)]
    four = [_over(nominal, np.min), _over(nominal, np.max), _over(lowest, np.min), _over(highest, np.max)]
    cells = numbers("", unit, np.concatenate(four)).cells
    heads = ("nominal\nleast", "nominal\nmost", "with play\nleast", "with play\nmost")
    for k, head in enumerate(heads):
        yield Column(head, unit, cells[k * len(rows) : (k + 1) * len(rows)], spare=2 if k < 2 else 0)
    changes = [change(result, name) for name in names]
    yield numbers("largest\nchange", unit, np.array([np.nan if one is None else one.size for one in changes]), digits=3)
    if result.sizes["configuration"] > 1:
        yield Column("change\nat #", "", tuple(NOTHING if one is None else str(one.at) for one in changes), spare=1)
    blamed = []
    for name, one in zip(names, changes, strict=True):
        found = None if one is None or not one.size else cause(result, name, one.side, one.at)
        blamed.append(NOTHING if found is None else in_words(*found))
    yield words(blamed_for(result), blamed)
    limit = result.get("limit")[rows]
    if np.isfinite(limit).any():
        met = result.get("limit_met")[:, rows].all(axis=0)
        told = [_limit(low, high) for low, high in limit.tolist()]
        yield Column("limit", unit, tuple(told), alarms=tuple(np.flatnonzero(~met).tolist()))


def _limit(low: float, high: float) -> str:
    if low == low:
        return f"±{high:g}" if low == -high else f"{low:g} to {high:g}"
    return f"{high:g}" if high == high else NOTHING


def _over(values: np.ndarray, of: object) -> np.ndarray:
    """The least or most of every column over the configurations where it is known."""
    known = np.isfinite(values)
    filled = np.where(known, values, np.inf if of is np.min else -np.inf)
    found = filled.min(axis=0) if of is np.min else filled.max(axis=0)
    return np.where(known.any(axis=0), found, np.nan)


def _notes(result: Result) -> Iterator[str]:
    if "incomplete" in result.attrs:
        yield f"{str(result.attrs['incomplete']).capitalize()}."
    yield "Of equilibrium without friction; a reaction is the size of the force at the joint."
    match str(result.attrs["asked"]):
        case "worst":
            yield "Offsets may be anywhere within clearances and tolerances; a local search finds the extremes."
        case "random":
            share = 100 * float(result.attrs["probability"])
            yield f"With play: between least and most are {share:g} % of the specimens."
