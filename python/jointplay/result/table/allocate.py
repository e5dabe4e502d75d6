"""The cheapest sizes: what each source gets, what it costs, what binds, and what a limit costs."""

from collections.abc import Iterator

import numpy as np

from jointplay.errors import listed
from jointplay.result import Result, first_largest
from jointplay.result.conclusions import EACH_OUTPUT

from .layout import Column, ResultTable, numbers, words

QUESTIONS = {"worst": "in the worst case", "random": "for {:.6g} % of the specimens"}
#: outcomes with sizes whose limits hold
FOUND = ("ok", "unfinished")
#: differences of costs that are none
SAME = 5e-4


def overview(result: Result) -> list[ResultTable]:
    """The tables of `allocate`."""
    asked = QUESTIONS[str(result.attrs["asked"])].format(100.0 * float(result.attrs.get("probability", 1.0)))
    if "size" not in result.data:
        title = "Sources with a cost; nothing was looked for"
    elif str(result.get("status")) in FOUND:
        title = f"Cheapest sizes with which the limits hold {asked}"
    else:
        title = f"The tightest sizes, which do not hold the limits {asked}"
    if "size" not in result.data:
        return [ResultTable(title, tuple(_columns(result)))]
    found = [ResultTable(title, tuple(_columns(result)), tuple(_notes(result)))]
    found.append(ResultTable("Limits", tuple(_limits(result)), tuple(_about_limits(result))))
    if "curve_cost" in result.data:
        columns = [
            numbers("limits times", "", result.labels("limit")),
            numbers("cost", "", result.get("curve_cost"), digits=5),
        ]
        status = result.get("curve_status").tolist()
        if any(s != "ok" for s in status):
            columns.append(words("status", status))
        found.append(ResultTable("Least cost by the limits", tuple(columns)))
    return found


def _columns(result: Result) -> Iterator[Column]:
    units = np.array(result.labels("source_unit"), dtype=str)
    yield words("source", result.labels("source"), is_key=True)
    yield Column("measure", "", tuple(result.labels("source_measure")), left=True, spare=3)
    yield words("unit", units.tolist())
    told = [name for name in ("size_before", "size") if name in result.data]
    cells = {name: np.empty(len(units), dtype=object) for name in told}
    for unit in dict.fromkeys(units.tolist()):
        own = units == unit
        together = numbers("", "", np.concatenate([result.get(name)[own] for name in told])).cells
        for k, name in enumerate(told):
            cells[name][own] = together[k * int(own.sum()) : (k + 1) * int(own.sum())]
    for name in told:
        yield Column("before" if name == "size_before" else name, "", tuple(cells[name]))
    if "choice" in result.data and any(result.get("choice").tolist()):
        yield words("choice", result.get("choice").tolist())
    for name, header in (("cost_before", "cost before"), ("cost", "cost")):
        if name in result.data:
            yield numbers(header, "", result.get(name))


def _limits(result: Result) -> Iterator[Column]:
    used = result.get("used")
    units = result.labels("limited_unit")
    yield words("limit", result.labels("limited"), is_key=True)
    yield words("unit", units)
    yield Column("value", "", tuple(f"{value:.6g}" for value in result.get("limit_value")))
    yield numbers("used", "%", 100.0 * used.max(axis=1))
    yield Column("at #", "", tuple(map(str, first_largest(used).tolist())))
    if "shadow_price" in result.data:
        steps, prices = result.get("shadow_step"), result.get("shadow_price")
        yield Column("loosened by", "", tuple(f"{step:.3g}" for step in steps))
        yield numbers("saves", "", prices * steps)


def _about_limits(result: Result) -> Iterator[str]:
    if "shadow_price" in result.data:
        yield "saves: what it saves to loosen this limit alone by so much, with exact / first order as found here."


def _notes(result: Result) -> Iterator[str]:
    if "incomplete" in result.attrs:
        yield f"{str(result.attrs['incomplete']).capitalize()}."
    bound, cost = float(result.get("first_order_bound")), float(result.get("total_cost"))
    if np.isfinite(bound):
        off = (cost - bound) / (abs(cost) or 1.0)
        side = "below" if off > 0.0 else "above"
        over = "the same" if abs(off) < SAME else f"{100.0 * abs(off):.2g} % {side}"
        yield f"To first order the least cost is {bound:.5g}, {over}; on the exact closure it is no bound."
    if "samples" in result.attrs:
        yield f"The yield is that of {int(result.attrs['samples']):,} random specimens of each configuration."
        if any(" of output " in name for name in result.labels("limited")):
            yield EACH_OUTPUT
    if "digits" in result.attrs and str(result.get("status")) in FOUND:
        yield f"Sizes by formula are rounded down to {int(result.attrs['digits'])} digits, and hold as they stand here."
    if "without_cost" in result.attrs:
        yield f"Without a cost, and left as they are: {listed(str(result.attrs['without_cost']).split(', '))}."
