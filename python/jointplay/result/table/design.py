"""Dimensions: what each value becomes, how far it may move, what is used of everything that has to hold, the front."""

from collections.abc import Iterator

import numpy as np

from jointplay.result import Result

from .layout import NOTHING, Column, ResultTable, numbers, words


def overview(result: Result) -> list[ResultTable]:
    """The tables of `design`."""
    found = str(result.get("status")) == "ok"
    title = "Values that are found" if found else "Values of the nearest attempt, which does not hold everything"
    tables = [ResultTable(title, tuple(_values(result)), tuple(_notes(result)))]
    if "front_aim" in result.data:
        tables.append(ResultTable("Designs of which none is better in both", tuple(_front(result))))
    else:
        tables.append(ResultTable("What is to be small", tuple(_aims(result))))
    tables.append(ResultTable("What has to hold", tuple(_held(result))))
    return tables


def _values(result: Result) -> Iterator[Column]:
    yield words("value", result.labels("variable"), is_key=True)
    for name, header in (("value_before", "before"), ("value_found", "found"), ("lowest", "from"), ("highest", "to")):
        yield Column(header, "", tuple(f"{value:.7g}" for value in result.get(name)))
    if any(result.get("at_bound").tolist()):
        yield words("at bound", [bound or NOTHING for bound in result.get("at_bound").tolist()])
    if "tolerated" in result.data:
        for k, loss in enumerate(result.coords["loss"].values.tolist()):
            ends = result.get("tolerated")[:, k]
            cells = [f"{low:.5g} to {high:.5g}" if np.isfinite(low) else NOTHING for low, high in ends.tolist()]
            yield Column(f"for {100 * loss:g} % more", "", tuple(cells), spare=1 + k)


def _aims(result: Result) -> Iterator[Column]:
    yield words("aim", result.labels("aim"), is_key=True)
    yield words("unit", result.coords["aim_unit"].values.tolist())
    for name, header in (("aim_before", "before"), ("aim_found", "found"), ("aim_weight", "weight")):
        if name in result.data:
            values = result.get(name).tolist()
            yield Column(header, "", tuple(f"{value:.5g}" if np.isfinite(value) else NOTHING for value in values))


def _front(result: Result) -> Iterator[Column]:
    yield Column("#", "", tuple(map(str, result.coords["front"].values.tolist())), is_key=True)
    units = result.coords["aim_unit"].values.tolist()
    for k, name in enumerate(result.labels("aim")):
        yield numbers(name, units[k], result.get("front_aim")[:, k])
    for k, name in enumerate(result.labels("variable")):
        yield Column(name, "", tuple(f"{value:.6g}" for value in result.get("front_value")[:, k]), spare=1)


def _held(result: Result) -> Iterator[Column]:
    yield words("limit", result.labels("held"), is_key=True)
    for name, header in (("used_before", "used before"), ("used", "used")):
        values = (100.0 * result.get(name)).tolist()
        yield Column(header, "%", tuple(f"{value:.5g}" if np.isfinite(value) else NOTHING for value in values))
    yield words("binds", ["yes" if one else NOTHING for one in result.get("binding").astype(bool).tolist()])


def _notes(result: Result) -> Iterator[str]:
    if "incomplete" in result.attrs:
        yield f"{str(result.attrs['incomplete']).capitalize()}."
    yield f"{int(result.attrs['attempts']):,} attempts, seed {int(result.attrs['seed'])}; judged on the exact closure."
    if "tolerated" in result.data:
        yield "for 1 % more: how far a value may move alone, to first order of the error, within all limits."
