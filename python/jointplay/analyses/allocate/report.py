"""What was found, as a result: sizes, costs, what binds, and the changes of the file that make it so."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jointplay.analyses.beside import with_forces
from jointplay.analyses.nominal import Nominal
from jointplay.analyses.nominal import report as started
from jointplay.model.mechanism import Mechanism
from jointplay.result import Attribute, Result, ResultBuilder, Variable, first_largest
from jointplay.result.verdict import PLAY_ALONE

from .items import Item
from .looks import Limit, merged
from .plans import Outcome, Plans
from .scatter import Scatter, YieldLook
from .worst_case import WorstLook

#: by how much a limit is loosened for its shadow price, as a share of it
STEP = 0.01
#: share of the largest used part from which a limit binds
BINDS = 0.999
#: outcomes with sizes whose limits hold
FOUND = ("ok", "unfinished")
BARE = re.compile(r"[A-Za-z0-9_-]+")


@dataclass
class Allocated:
    """What is told."""

    #: `m`, `base`: as asked, and with its patterns written out
    m: Mechanism
    base: Mechanism
    items: Sequence[Item]
    #: sources that have no cost
    without: Sequence[str]
    limits: Sequence[Limit]
    at: Nominal
    #: who looks at plans
    search: Plans
    attributes: dict[str, Attribute]
    #: what was found
    outcome: Outcome | None = None
    #: what it saves to loosen each limit
    prices: list[float] = field(default_factory=list)
    curve: list[tuple[float, Outcome]] = field(default_factory=list)
    #: what is to be said of the limits of forces
    forces: Mapping[str, Variable] = field(default_factory=dict)


def report(answer: Allocated) -> Result:
    """The result."""
    outcome = answer.outcome
    assert outcome is not None
    builder = _begun(answer)
    items = answer.items
    cost = [item.price(value) for item, value in zip(items, outcome.values, strict=True)]
    sizes = [item.size(value) for item, value in zip(items, outcome.values, strict=True)]
    _add(builder, "size", sizes, "size that is allocated", sized=True)
    _add(builder, "cost", cost, "what it costs")
    words = [item.word(value) for item, value in zip(items, outcome.values, strict=True)]
    builder.data["choice"] = Variable(("source",), np.array(words, dtype=str), "", "fit, or group of bearings")
    _total(builder, "total_cost", float(sum(cost)), "what all sources with a cost cost")
    _total(builder, "first_order_bound", outcome.bound, "least cost to first order; no bound of the exact closure")
    _limits(builder, answer, outcome)
    if answer.curve:
        factors = np.array([factor for factor, _ in answer.curve])
        builder.labels("limit", factors, "factor on all limits")
        costs = [o.cost if o.status in FOUND else math.nan for _, o in answer.curve]
        builder.data["curve_cost"] = Variable(("limit",), np.array(costs), "", "least total cost")
        statuses = np.array([o.status for _, o in answer.curve], dtype=str)
        builder.data["curve_status"] = Variable(("limit",), statuses, "", "what the cost is")
    builder.data["status"] = Variable((), np.array(outcome.status), "", "outcome")
    if outcome.status in FOUND:
        if outcome.values == answer.search.cheapest:
            builder.attrs["cheapest"] = 1
        builder.attrs["changes"] = "\n".join(lines(items, outcome.values))
    before = answer.search.before
    if before is not None and before in answer.search.looks:
        holds = answer.search.looks[before].holds(np.ones(len(answer.limits)))
        builder.attrs["before"] = "holds" if holds else "missed"
    return with_forces(builder.result(), answer.forces)


def unassembled(answer: Allocated, status: str, configurations: Sequence[int]) -> Result:
    """The result where a configuration has no pose."""
    builder = _begun(answer)
    builder.data["status"] = Variable((), np.array(status), "", "outcome")
    builder.attrs["without_pose"] = ", ".join(map(str, configurations))
    return builder.result()


def _begun(answer: Allocated) -> ResultBuilder:
    """Names and units of the sources, and what is known before anything is found."""
    builder = started(answer.base, "allocate", answer.at, **answer.attributes)
    del builder.data["nominal"]
    if builder.data.pop("structural_deviation", None) is not None:
        builder.attrs[PLAY_ALONE] = 1
    builder.coords.clear()
    items = answer.items
    builder.labels("source", [item.name for item in items], "source with a cost")
    units = ["K" if item.sizing.kind == "temperature" else builder.name(item.sizing.kind) for item in items]
    for name, values, words in (
        ("source_unit", units, "unit along source"),
        ("source_measure", [item.sizing.measure for item in items], "what its size is"),
        ("source_key", [item.sizing.key for item in items], "where the file has its size"),
    ):
        builder.coords[name] = Variable(("source",), np.array(values, dtype=str), "", words)
    before = [item.before for item in items]
    costs = [math.nan if value is None else item.price(value) for item, value in zip(items, before, strict=True)]
    _add(builder, "size_before", [item.sizing.size for item in items], "size in the file", sized=True)
    _add(builder, "cost_before", costs, "what the size in the file costs; unknown where it has no cost")
    _total(builder, "total_cost_before", float(sum(costs)), "what the sizes in the file cost")
    if answer.without:
        builder.attrs["without_cost"] = ", ".join(answer.without)
    return builder


def _add(builder: ResultBuilder, name: str, values: Sequence[float], words: str, *, sized: bool = False) -> None:
    units = builder.coords["source_unit"].values.tolist()
    unit = "" if not sized else units[0] if len(set(units)) == 1 else "see source_unit"
    builder.data[name] = Variable(("source",), np.array(values, dtype=np.float64), unit, words)


def _total(builder: ResultBuilder, name: str, value: float, words: str) -> None:
    builder.data[name] = Variable((), np.array(value), "", words)


def _limits(builder: ResultBuilder, answer: Allocated, outcome: Outcome) -> None:
    """The limits by name, what is used of them, and what each of them costs."""
    kinds = ["length" if limit.quantity in (*"xyz", "position") else "angle" for limit in answer.limits]
    factors = np.array([builder.factor(kind) for kind in kinds])
    builder.labels("limited", [limit.words for limit in answer.limits], "what is limited")
    builder.coords["limited_unit"] = Variable(
        ("limited",), np.array([builder.name(kind) for kind in kinds]), "", "unit along limited"
    )
    unit = builder.name(kinds[0]) if len(set(kinds)) == 1 else "see limited_unit"
    values = np.array([limit.value for limit in answer.limits]) / factors
    builder.data["limit_value"] = Variable(("limited",), values, unit, "limit, to its side")
    used = outcome.look.used
    per = ("limited", "configuration")
    builder.data["used"] = Variable(per, used, "", "error / limit; of a yield the share that it needs of the limit")
    builder.data["binding"] = Variable(per, used >= BINDS * used.max(), "", "whether it uses as much as any limit does")
    most = np.unravel_index(int(first_largest(used.reshape(-1))), used.shape)
    if isinstance(outcome.look, YieldLook):
        _by_yield(builder, answer, outcome.look)
    elif isinstance(outcome.look, WorstLook) and answer.limits[int(most[0])].quantity == "position":
        words = "direction of the largest position error where it uses most of its limit"
        builder.add("binding_direction", "axis", outcome.look.direction[most], words)
    if answer.prices:
        steps = values * STEP
        prices = np.array(answer.prices) / steps
        words = "what it saves to loosen the limit by shadow_step, per unit of the limit"
        builder.data["shadow_price"] = Variable(("limited",), prices, f"1/{unit}" if " " not in unit else "", words)
        builder.data["shadow_step"] = Variable(("limited",), steps, unit, "by how much the limit is loosened")


def _by_yield(builder: ResultBuilder, answer: Allocated, look: YieldLook) -> None:
    """What a yield has beside what is used."""
    assert isinstance(answer.search.looking, Scatter)
    names = np.array([" ".join(filter(None, (one.contact, one.load_case))) for one in answer.search.looking.assumed])
    words = "contact, and load case, with which most of the limit is used"
    builder.data["decided_by"] = Variable(("limited", "configuration"), names[look.by.argmax(axis=0)], "", words)
    words = "share of the specimens of a configuration that cannot be assembled, the largest"
    _total(builder, "not_assembled", float(look.not_assembled.max()), words)


def lines(items: Sequence[Item], values: Sequence[float]) -> list[str]:
    """The changes of the file, ``KEY=VALUE``, as `--set` takes them."""
    return [f"{key}={written(value)}" for key, value in merged(items, values).items()]


def written(value: Any) -> str:
    """A value as the file would write it in one line.

    Examples
    --------
    >>> written({"fit": "H7/g6", "diameter": 12.0})
    '{ fit = "H7/g6", diameter = 12.0 }'
    """
    if isinstance(value, Mapping):
        pairs = (f"{key if BARE.fullmatch(key) else json.dumps(key)} = {written(one)}" for key, one in value.items())
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(written, value)) + "]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value)
