"""The sizes of a mechanism as a list to order by: parts of every source, how they are given, limits and cost."""

from collections.abc import Iterator
from dataclasses import dataclass

from jointplay.analyses.allocate.items import items_of
from jointplay.core.compile import described
from jointplay.errors import InputError, listed
from jointplay.file.schema import SizedClearance
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import Sizing, sizings
from jointplay.result.table import Column, ResultTable, decimals
from jointplay.result.table.layout import NOTHING, fixed, in_one_unit, words

#: significant digits of limits
DIGITS = 6


@dataclass(frozen=True)
class _Row:
    """One part of a source; what is of the source as a whole stands in its first row."""

    source: str
    part: str
    given: str
    nominal: str
    low: str
    high: str
    unit: str


def table(m: Mechanism) -> ResultTable | None:
    """The list; None where nothing has a size."""
    base, sources = sizings(m)
    if not sources:
        return None
    rows: list[_Row] = []
    costs: list[str] = []
    prices, notes = _prices(m)
    places = decimals([*prices.values()])
    for source in sources:
        own = [*_rows(base, source)]
        rows += own
        costs += [fixed(prices[source.name], places) if source.name in prices else NOTHING, *[""] * (len(own) - 1)]
    heads = {"nominal": "nominal", "low": "lower\nlimit", "high": "upper\nlimit"}
    limits = [Column(head, "", tuple(getattr(row, name) for row in rows)) for name, head in heads.items()]
    columns = (
        words("source", [row.source for row in rows], is_key=True),
        words("part", [row.part for row in rows]),
        words("given as", [row.given for row in rows]),
        *in_one_unit(limits, [row.unit for row in rows]),
        *([Column("cost", "", tuple(costs))] if prices else []),
    )
    return ResultTable("Sizes to order", columns, (*_about_limits(rows), *notes))


def _rows(m: Mechanism, source: Sizing) -> Iterator[_Row]:
    unit = str(getattr(m.units, f"{source.kind}_name"))
    joint = source.key.removeprefix("joints.").removesuffix(".clearance")
    play = getattr(m.data.joints.get(joint), "clearance", None)
    given = described(play) if isinstance(play, SizedClearance) else ""
    for k, part in enumerate(source.parts):
        nominal, low, high = (value / m.units.length for value in (part.nominal, part.low, part.high))
        sized = nominal != 0.0
        whose, how = (source.name, given) if k == 0 else ("", "")
        told = f"{nominal:.{DIGITS}g}" if sized else NOTHING
        yield _Row(whose, part.name, how, told, _limit(low, sized), _limit(high, sized), unit)
    if source.limits is not None:
        lowest, highest = (_limit(end, True) for end in source.limits)
        yield _Row(source.name, source.measure, "", NOTHING, lowest, highest, unit)
    elif not source.parts:
        yield _Row(source.name, source.measure, "", f"{source.size:.{DIGITS}g}", NOTHING, NOTHING, unit)


def _limit(value: float, is_from_nominal: bool) -> str:
    return f"{value:{'+' if is_from_nominal and value else ''}.{DIGITS}g}"


def _about_limits(rows: list[_Row]) -> tuple[str, ...]:
    signed = any(row.low[:1] in "+-" for row in rows if row.low)
    return ("Limits with a sign count from the nominal size.",) if signed else ()


def _prices(m: Mechanism) -> tuple[dict[str, float], tuple[str, ...]]:
    """What the sizes of the file cost, by source, and what is to be said of that."""
    if not m.data.costs:
        return {}, ()
    try:
        _, items, without = items_of(m)
    except InputError as problem:
        return {}, (f"Costs are not shown: {problem.problem}.",)
    prices = {item.name: item.price(item.before) for item in items if item.before is not None}
    beside = [item.name for item in items if item.before is None]
    notes = [f"The costs of the file are not of the present size of {listed(beside)}."] if beside else []
    if prices:
        total = sum(prices.values())
        unpriced = [*without, *beside]
        rest = f", without {listed(unpriced)}" if unpriced else ""
        notes.append(f"All together cost {fixed(total, decimals([total]))}{rest}.")
    return prices, tuple(notes)
