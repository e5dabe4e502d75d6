"""The comparisons of the examples on random mechanisms."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

import jointplay as jp
from helpers.layouts import KINDS
from helpers.oracles import loops
from helpers.oracles.optimiser import NoOptimumError
from helpers.strategies import mechanism
from helpers.structures import KINDS as STRUCTURES
from helpers.structures import Structure

from . import elastic, first_order, monte_carlo, planar, spatial
from .subject import OK, Check, Found, Subject

#: comparisons that take long, on fewer mechanisms
SLOW = (planar.by_optimiser, monte_carlo.deviations)


@dataclass(frozen=True)
class Family:
    """A generator of random mechanisms: `draw(seed)`."""

    name: str
    what: str
    draw: Callable[[int], Subject]
    count: int
    #: of these, mechanisms for comparisons that take long
    few: int
    checks: tuple[Check, ...]


@dataclass(frozen=True)
class RandomRow:
    family: Family
    check: Check
    mechanisms: int
    found: Found


def linkage(seed: int) -> Subject:
    kind = list(KINDS)[seed % len(KINDS)]
    return Subject.of(f"{kind} {seed}", jp.loads(mechanism(kind, 100 + seed // len(KINDS))))


def spatial_loop(seed: int) -> Subject:
    return _regular(loops.loop, seed)


def platform(seed: int) -> Subject:
    return _regular(loops.platform, seed)


def elastic_structure(kind: Structure) -> Callable[[int], Subject]:
    return lambda seed: Subject.of(f"{kind.__name__} {seed}", jp.Mechanism(kind(seed)))


def _regular(make: Callable[[int, float], dict[str, Any]], seed: int) -> Subject:
    """The first mechanism from a seed on, in steps of a thousand, that can be assembled off its reference."""
    for k in range(100):
        spec = make(seed + 1000 * k, 1e-5)
        drives = np.full((1, len(spec["drives"])), 2e-3)
        s = Subject.of_spec(f"{make.__name__} {seed + 1000 * k}", spec, drives)
        if s.core.trace(drives)["status"][0] == OK:
            return s
    raise AssertionError("no drawing is regular")


PLANAR = (*planar.CHECKS, *monte_carlo.CHECKS, *first_order.CHECKS)
SPATIAL = (*spatial.CHECKS, *first_order.CHECKS)
ELASTIC = tuple(elastic.CHECKS)
FAMILIES = (
    Family(
        "planar linkages",
        "12 kinds with clearances up to 0.4 % of their size (`tests/helpers/layouts.py`)",
        linkage,
        120,
        12,
        PLANAR,
    ),
    Family(
        "loops in space",
        "seven hinges and slides, any axes (`tests/helpers/oracles/loops.py`)",
        spatial_loop,
        60,
        60,
        SPATIAL,
    ),
    Family(
        "platforms in space",
        "six legs with joints of every kind (`tests/helpers/oracles/loops.py`)",
        platform,
        8,
        8,
        SPATIAL,
    ),
    *(
        Family(
            name, f"over-constrained, {what} (`tests/helpers/structures.py`)", elastic_structure(kind), 12, 12, ELASTIC
        )
        for name, (what, kind) in STRUCTURES.items()
    ),
)


def rows(families: tuple[Family, ...] = FAMILIES) -> Iterator[RandomRow]:
    for family in families:
        drawn = [family.draw(seed) for seed in range(family.count)]
        for check in family.checks:
            some = [s for s in drawn[: family.few if check.compare in SLOW else None] if check.applies(s)]
            found, lost = [], 0
            for s in some:
                try:
                    part = check.compare(s)
                    # Nothing is compared of a mechanism whose clearances reach a singular pose.
                    found += [part] if part.numbers else []
                except NoOptimumError:
                    lost += 1
            if found:
                other = sum(bool(part.remark) for part in found)
                words = [f"{other} mechanisms with more work at another pose in some configuration"] if other else []
                words += [f"in {lost} mechanisms the optimiser came to no maximum"] if lost else []
                yield RandomRow(family, check, len(found), Found.all(found, "; ".join(words)))
