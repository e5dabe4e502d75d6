"""A map in a few lines: status of its nodes, size of the error and where it is largest, shares of the sources."""

from typing import Literal

import numpy as np

from jointplay.basics.arrays import Flags
from jointplay.result import UNREACHABLE, Result, figures, quantity
from jointplay.result.conclusions import shares_over_nodes
from jointplay.result.verdict import READABLE

from .layout import NOTHING, Column, ResultTable, commands, numbers, sentence, words
from .notes import OUTCOMES, sizes_taken

SHARES = (0.5, 0.9, 0.99)
#: sources that are listed
MOST_SOURCES = 12


def overview(result: Result) -> list[ResultTable]:
    """The tables of a map."""
    axes = str(result.attrs["grid"]).split(", ")
    tables = [_outcomes(result, axes)]
    good = np.isin(result.get("status"), READABLE)
    if good.any():
        tables.append(_sizes(result, axes, good))
        if "contribution" in result.data and "position" in figures(result):
            tables.append(_shares(result, good))
    return tables


def _outcomes(result: Result, axes: list[str]) -> ResultTable:
    status = result.get("status")
    found, counts = np.unique(status, return_counts=True)
    order = np.argsort(-counts, kind="stable")
    names = [str(found[k]).replace("_", " ") or "not computed" for k in order]
    shares = tuple(f"{100 * counts[k] / status.size:.1f}" for k in order)
    columns = (
        words("status", names, is_key=True),
        Column("nodes", "", tuple(str(counts[k]) for k in order)),
        Column("share", "%", shares),
    )
    shape = " × ".join(str(n) for n in status.shape)
    notes = [sentence(str(result.attrs["incomplete"]))] if "incomplete" in result.attrs else []
    if "contact_change" in result.data and (changes := int(result.get("contact_change").any(axis=-1).sum())):
        notes.append(f"At {changes} nodes a contact changes sides on the way to a next node: the error may jump there.")
    notes += [f"{name.replace('_', ' ').capitalize()}: {OUTCOMES[name]}." for name in UNREACHABLE if name in found]
    if "limit_met" in result.data:
        beyond = ~result.get("limit_met").astype(bool) & np.isin(status, READABLE)[..., None]
        for name, count in zip(
            result.labels("quantity"), beyond.reshape(-1, beyond.shape[-1]).sum(axis=0), strict=True
        ):
            if count:
                notes.append(f"At {count} nodes the {name} is beyond its limit.")
    notes += sizes_taken(result)
    return ResultTable(f"Map over {', '.join(axes)}: {shape} nodes", columns, tuple(notes))


def _sizes(result: Result, axes: list[str], good: Flags) -> ResultTable:
    """Quantiles of every quantity over the nodes, its extreme, and where that is."""
    found = {name: quantity(result, name) for name in figures(result)}
    rows = []
    for name, variable in found.items():
        # Of nearness to singularity the smallest is the worst.
        sign = -1.0 if name == "singular_value" else 1.0
        bad = np.where(good, sign * variable.values, -np.inf)
        # Between a number and one without end, as of what is used of a limit of nothing, there is none.
        method: Literal["linear", "higher"] = "linear" if np.isfinite(bad[good]).all() else "higher"
        quantiles = np.abs(np.quantile(bad[good], SHARES, method=method))
        rows.append((variable, quantiles, np.unravel_index(np.argmax(bad), bad.shape)))
    columns = [
        words("quantity", [v.long_name for v, _, _ in rows], is_key=True),
        words("unit", [v.units or NOTHING for v, _, _ in rows]),
    ]
    for k, share in enumerate(SHARES):
        header = "median" if share == 0.5 else f"{100 * share:.0f} %"
        columns.append(_mixed(header, [float(quantiles[k]) for _, quantiles, _ in rows]))
    extreme = "smallest" if "singular_value" in found else "largest"
    columns.append(_mixed(extreme, [float(v.values[at]) for v, _, at in rows]))
    for k, axis in enumerate(axes):
        along = result.coords[axis]
        columns.append(commands(f"at {axis}", along.units, [along.values[at[k]] for _, _, at in rows]))
    note = "Quantiles are over the nodes: half of them, 90 % and 99 % of them are better."
    return ResultTable("How far off, and where", tuple(columns), (note,))


def _mixed(header: str, values: list[float]) -> Column:
    """Numbers of different units under each other: each with digits of its own."""
    return Column(header, "", tuple(numbers("", "", [value]).cells[0] for value in values))


def _shares(result: Result, good: Flags) -> ResultTable:
    """Shares of the sources in the error of all nodes together, which counts a node by the size of its error."""
    causes, found = shares_over_nodes(result, good)
    shares = {which: parts / parts.sum() for which, parts in found.items() if parts.sum() > 0.0}
    order = np.argsort(-next(iter(shares.values()), np.zeros(len(causes))), kind="stable")[:MOST_SOURCES]
    columns = [words("source", [causes[k] for k in order], is_key=True)]
    for which, share in shares.items():
        columns.append(Column(which, "%", tuple(f"{100 * share[k]:.1f}" for k in order)))
    more = len(causes) - len(order)
    notes = (f"{more} more sources have smaller shares.",) if more else ()
    return ResultTable("To blame, over all nodes", tuple(columns), notes)
