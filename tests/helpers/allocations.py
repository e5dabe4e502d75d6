"""Random problems of least cost with a required yield, and their optimum by trying plans one by one.

Mechanisms of every planar kind of `wide`, two to five of their sources with a price: choices, a reciprocal cost, or
both. The plans are judged by the public answer of `random`: the upper end of the interval of the share outside.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

import jointplay as jp
from helpers.wide import KINDS, mechanism
from jointplay.analyses.random import compute
from jointplay.model.sizing import sizings

#: the smallest number of specimens with which 99 % can be shown
SAMPLES = 4096
LAWS = ("uniform", "boundary", "normal")
#: sizes by formula that are tried, from one end to the other
SIZES = 40


@dataclass(frozen=True)
class Problem:
    """A mechanism with limits and costs, and where its clearances are."""

    m: jp.Mechanism
    contact: str
    kind: str

    def outside(self, changes: dict[str, object], contact: str | None = None) -> float:
        """The share that may be outside, as `random` says it: the upper end of its interval, the largest."""
        found = compute(
            self.m.with_(changes),
            SAMPLES,
            contact=contact or self.contact,
            probabilities=(),
            path=False,
        )
        return float(found.get("outside_high").max())

    def holds(self, changes: dict[str, object]) -> bool:
        return self.outside(changes) <= 1.0 - self.m.limits.probability


def problem(seed: int, formulas: int = 0) -> Problem:
    """A problem whose limits some plans hold and others miss; `formulas` of its sources have a reciprocal cost."""
    for attempt in itertools.count():
        rng = np.random.default_rng([seed, formulas, attempt])
        kind = str(rng.choice(KINDS))
        found = _drawn(rng, kind, int(rng.integers(1000)), formulas)
        if found is not None:
            return found
    raise AssertionError


def _drawn(rng: np.random.Generator, kind: str, number: int, formulas: int) -> Problem | None:
    m = jp.loads(mechanism(kind, number, least=1e-4, most=float(rng.choice([1e-3, 1e-2]))))
    body = str(m.raw["output"]["body"])
    m = m.with_({"loads": [{"body": body, "force": rng.normal(size=2).tolist(), "moment": float(20.0 * rng.normal())}]})
    for name in m.raw["joints"]:
        if "clearance" in m.raw["joints"][name]:
            m = m.with_({f"joints.{name}.clearance.law": str(rng.choice(LAWS))})
    for name in m.raw.get("dimensions", {}):
        m = m.with_({f"dimensions.{name}.law": str(rng.choice(["uniform", "normal"]))})
    sources = [one for one in sizings(m)[1] if one.size > 0.0 and not one.fixed]
    if len(sources) < max(2, formulas):
        return None
    chosen = rng.permutation(len(sources))[: int(rng.integers(max(2, formulas), 6))]
    costs: dict[str, object] = {}
    for place, k in enumerate(chosen.tolist()):
        size, dear = sources[k].size, float(np.exp(rng.uniform(0.0, 2.0)))
        if place < formulas:
            costs[sources[k].name] = {"model": "reciprocal", "b": dear * size, "from": 0.3 * size, "to": 3.0 * size}
            continue
        factors = rng.uniform(0.2, 0.8) * np.cumprod(rng.uniform(1.1, 2.2, int(rng.integers(2, 5))))
        prices = np.round(dear / factors ** rng.uniform(0.5, 1.5), 2)
        pairs = zip(factors.tolist(), prices.tolist(), strict=True)
        costs[sources[k].name] = {"choices": [{"size": float(f"{f * size:.3g}"), "cost": c} for f, c in pairs]}
    contact = str(rng.choice(["scattered", "loaded"]))
    quantity = str(rng.choice(["position", "x", "y", "angle"]))
    probability = float(rng.choice([0.9, 0.95, 0.99]))
    m = m.with_({"costs": costs, f"limits.{quantity}": 1.0, "limits.probability": probability})
    base = Problem(m, contact, kind)
    needed = [_quantile(base, changes, quantity, probability) for changes in _ends(m)]
    if not all(map(math.isfinite, needed)) or not needed[1] > 1.02 * needed[0]:
        return None
    limit = needed[0] + rng.uniform(0.1, 0.9) * (needed[1] - needed[0])
    return Problem(m.with_({f"limits.{quantity}": float(f"{limit:.4g}")}), contact, kind)


def _ends(m: jp.Mechanism) -> tuple[dict[str, object], dict[str, object]]:
    """All priced sources at their tightest, and at their loosest."""
    ends: tuple[dict[str, object], dict[str, object]] = ({}, {})
    for one, sizes, _ in _priced(m):
        for end, size in zip(ends, (sizes[0], sizes[-1]), strict=True):
            end.update(one.resized(size))
    return ends


def _priced(m: jp.Mechanism):
    """Every priced source with its sizes, from tight to loose, of a formula some of its range; and its cost."""
    for one in sizings(m)[1]:
        cost = m.data.costs.get(one.name)
        if cost is None:
            continue
        if cost.choices is not None:
            yield one, [choice.size for choice in cost.choices], cost
        else:
            yield one, np.geomspace(cost.from_, cost.to, SIZES).tolist(), cost


def _quantile(at: Problem, changes: dict[str, object], quantity: str, probability: float) -> float:
    """About the error that as many specimens exceed as may."""
    found = compute(
        at.m.with_(changes), SAMPLES, contact=at.contact, probabilities=(1.0 - probability, probability), path=False
    )
    if not np.isin(found.get("status"), ["ok", "undetermined"]).all():
        return math.nan
    values = found.get("error_quantile", quantity=quantity)
    return float(np.abs(values).max())


def cheaper(at: Problem, cost: float) -> float:
    """The cost of the cheapest plan that holds and costs less; the given cost where there is none.

    All choices are tried with all of some sizes by formula; the last of these has the size that costs a thousandth less
    in total, and where that holds, the largest one that holds.
    """
    priced = sorted(_priced(at.m), key=lambda one: one[2].choices is None)
    *others, last = priced
    options = [list(zip(sizes, map(_price(table), sizes), strict=True)) for _, sizes, table in others]
    plans = [
        (math.fsum(price for _, price in plan), dict(_changes(others, plan)))
        for plan in itertools.product(*(pairs for pairs in options))
    ]
    source, sizes, table = last
    price = _price(table)
    for paid, changes in sorted(plans, key=lambda one: one[0]):
        if table.choices is not None:
            for size in reversed(sizes):
                if paid + price(size) < cost * (1.0 - 1e-9) and at.holds(changes | source.resized(size)):
                    cost = paid + price(size)
            continue
        left = 0.999 * cost - paid - (table.a or 0.0)
        size = max(table.from_, table.b / left) if left > 0.0 else math.inf
        if size > table.to or not at.holds(changes | source.resized(size)):
            continue
        low, high = size, table.to
        for _ in range(12):
            middle = math.sqrt(low * high)
            low, high = (middle, high) if at.holds(changes | source.resized(middle)) else (low, middle)
        cost = paid + price(low)
    return cost


def _changes(others, plan):
    """The changes of the file that a plan makes."""
    for (one, _, _), (size, _) in zip(others, plan, strict=True):
        yield from one.resized(size).items()


def _price(table):
    """The price of a size."""
    if table.choices is None:
        return table.at
    return {choice.size: choice.cost for choice in table.choices}.__getitem__
