"""Shares of specimens outside the limits where hardly any specimen is outside.

Each way beyond a limit (`ways`) is searched by itself (`subset`), and a specimen that is outside in N of the ways that
were found counts in each of them by 1 / N:

    P(outside) = sum over ways w of P(f_w > 0) E[1 / N | f_w > 0]

A way is left out where the worst case excludes it. Where specimens were brought below the least share without reaching
the limit, the share is below that. Where they do not move on, or bounded laws end before the limit, the search knows
nothing, and what counting leaves open is added to the interval. A search whose interval has nothing in common with that
of the counted specimens is not believed: the share is theirs. Either may be wrong, and the interval holds both.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.cluster import Here, Workers
from jointplay.basics import confidence
from jointplay.basics.arrays import Floats
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.result import ResultBuilder
from jointplay.result.verdict import COUNTED

from .nominal import Nominal
from .subset import MOVES, PILOT, PLAIN_PILOT, REPLICATES, SECOND, Climb, Specimens, ascend, climb, going_on
from .ways import NO_POSE, Reach, Way, ways_apart, ways_out

#: specimens outside below which their share is not counted but searched for
FEWEST = 1000
#: specimens solved for all ways of a configuration together, and at least for each; the choice of levels takes more
SAMPLES, SAMPLES_EACH = 400_000, 100_000
#: random specimens that the search begins with
PLAIN = 2**17
#: numbers drawn for those that are counted where the search knows nothing, and the most of these specimens
NUMBERS, COUNTED_MOST = 2**24, 2**20
#: specimens drawn at a time, which bounds the memory
CHUNK = 2**15
#: what is said of a share below the least that is searched for: it is below
NEGLIGIBLE = 1e-12
#: level of the interval of logarithms, which have tails heavier than Student's t: it holds 95 % and more
LEVEL = 0.98
#: relative standard error above which replicates disagree
DISAGREE = 0.3
#: keeps the random numbers apart from those of other analyses with the same seed
APART = 0x7A11
SEARCHED, EXCLUDED = "by subset simulation", "excluded by the worst case"
PARTLY = "by subset simulation, by counting where it did not get to the limit"
NEGLECTED, NOT_FOUND = "by subset simulation, which found none", "by counting: the search did not get to the limit"
UNCERTAIN = "by counting: the replicates of subset simulation disagree"
REFUTED = "by counting, which subset simulation contradicts"
#: all of them; chunks of a map have the room of the longest one
METHODS = np.array(["", COUNTED, SEARCHED, EXCLUDED, PARTLY, NEGLECTED, NOT_FOUND, UNCERTAIN, REFUTED])


@dataclass(frozen=True)
class Tail:
    """A share outside the limits, of all (first) and of every limited quantity, with standard error and interval."""

    share: Floats
    error: Floats
    low: Floats
    high: Floats
    method: str


def tail(
    m: Mechanism,
    drives: Floats,
    poses: Floats,
    seed: int,
    law: str | None,
    limits: Floats,
    is_loaded: bool = False,
) -> Tail:
    """The share of the specimens outside the limits at one configuration of a determinate mechanism.

    With `is_loaded` the loads of the mechanism decide where the offsets are; they are within their sets, so that the
    worst case excludes the same.
    """
    specimens = Specimens(m, drives, poses, law, is_loaded)
    limited = np.flatnonzero(np.isfinite(limits).any(axis=1)).tolist()
    nothing = np.zeros(1 + len(limited))
    ways = ways_out(m, limits)
    if not specimens.scatter:
        errors = specimens.errors(m.centre[None])
        apart = bool(np.isnan(errors).any())
        out = [apart or any(way.is_out(errors)[0] for way in ways if way.quantity == q) for q in limited]
        is_out = np.array([any(out), *out], dtype=float)
        return Tail(is_out, nothing, is_out, is_out, COUNTED)
    reach = Reach(m, drives, poses, law)
    open_ways = [way for way in (*ways, *ways_apart(m)) if not reach.excludes(way)]
    if not open_ways:
        return Tail(nothing, nothing, nothing, nothing, EXCLUDED)
    first, second, third = np.random.SeedSequence([seed, APART]).spawn(3)
    known = _sorted(specimens, open_ways, reach, first)
    shares, plain = _shares(specimens, known, limited, second)
    rest = _counted_rest(specimens, known, limited, third) if known.rest else None
    return _joined(known, limited, shares, plain, rest)


def _tail_at(
    m: Mechanism, seed: int, law: str | None, limits: Floats, is_loaded: bool, place: tuple[int, Nominal]
) -> Tail:
    """That of a configuration with this number."""
    k, at = place
    own = m.running_under(k, at.drives, at.poses) if is_loaded else m
    return tail(own, at.drives, at.poses, seed, law, limits, is_loaded)


def _generator(seed: np.random.SeedSequence) -> np.random.Generator:
    """The quickest of NumPy's generators: half of the work is normal numbers."""
    return np.random.Generator(np.random.SFC64(seed))


@dataclass(frozen=True)
class _Known:
    """What became of the ways: found, with their levels; left to counting; with a share below the least."""

    found: dict[Way, Climb]
    rest: list[Way]
    small: list[Way]

    def parts(self, errors: Floats, limited: Sequence[int]) -> dict[Way, Floats]:
        """What specimens count in each of the ways that were found, for all quantities and for every limited one."""
        outs = {way: way.is_out(errors)[:, None] * _touched([way], limited) for way in self.found}
        often = np.maximum(sum(outs.values(), np.zeros((len(errors), 1 + len(limited)))), 1.0)
        return {way: (out / often).mean(axis=0) for way, out in outs.items()}


@dataclass(frozen=True)
class _Counts:
    """Specimens outside, of all quantities (first) and of every limited one, and how many there were."""

    outside: Floats
    samples: int


def _sorted(specimens: Specimens, ways: Sequence[Way], reach: Reach, seed: np.random.SeedSequence) -> _Known:
    """Look for levels along every way."""
    own, *seeds = seed.spawn(1 + len(ways))
    z, errors = specimens.drawn(PLAIN_PILOT, _generator(own))
    found: dict[Way, Climb] = {}
    rest: list[Way] = []
    small: list[Way] = []
    for way, one in zip(ways, seeds, strict=True):
        rng = _generator(one)
        got = climb(specimens, way, z, errors, PILOT, rng)
        if got.is_stalled:
            got = climb(specimens, way, z, errors, SECOND * PILOT, rng)
        if got.is_there:
            found[way] = got
        else:
            (rest if got.is_stalled or reach.ends_before(way) else small).append(way)
    # All ways to have no pose find the same specimens: the one that does so best is enough.
    best = max((way for way in found if way.quantity == NO_POSE), key=lambda way: found[way].share, default=None)
    if best is None:
        return _Known(found, rest, small)
    found = {way: got for way, got in found.items() if way.quantity != NO_POSE or way == best}
    return _Known(found, *([way for way in ways if way.quantity != NO_POSE] for ways in (rest, small)))


def _touched(ways: Iterable[Way], limited: Sequence[int]) -> NDArray[np.bool_]:
    """Which shares these ways are a part of: that of all quantities, and those of their own; no pose is beyond all."""
    touched = np.zeros(1 + len(limited), dtype=bool)
    for way in ways:
        touched |= [True, *(way.quantity in (q, NO_POSE) for q in limited)]
    return touched


def _shares(
    specimens: Specimens, known: _Known, limited: Sequence[int], seed: np.random.SeedSequence
) -> tuple[Floats, _Counts]:
    """The shares beyond any limit and those of every quantity, by replicate, and what was counted on the way."""
    own, *seeds = seed.spawn(1 + len(known.found))
    rng = _generator(own)
    shares = np.zeros((REPLICATES, 1 + len(limited)))
    plain = np.zeros(1 + len(limited))
    climbing = {way: got.levels for way, got in known.found.items() if got.levels}
    each = max(SAMPLES // max(len(climbing), 1), SAMPLES_EACH) // specimens.fewer
    count = PLAIN // (REPLICATES * specimens.fewer)
    counts = {way: each // (REPLICATES * MOVES * len(levels)) for way, levels in climbing.items()}
    starts: dict[Way, list[tuple[float, Floats, Floats]]] = {way: [] for way in climbing}
    every = (*known.found, *known.rest, *known.small)

    for r in range(REPLICATES):
        z, errors = specimens.drawn(count, rng)
        plain += _outside(every, errors, limited).sum(axis=0)
        for way, part in known.parts(errors, limited).items():
            if way not in climbing:
                shares[r] += part
                continue
            alive = way.beyond(errors) > climbing[way][0][0]
            chosen = going_on(alive, counts[way], rng)
            starts[way].append((float(alive.mean()), z[chosen], errors[chosen]))
    for way, one in zip(known.found, seeds, strict=True):
        if way not in climbing:
            continue
        z, errors = (np.concatenate([start[k] for start in starts[way]]) for k in (1, 2))
        share, errors = ascend(specimens, way, climbing[way], z, errors, _generator(one))
        for r, last in enumerate(errors.reshape(REPLICATES, counts[way], -1)):
            shares[r] += starts[way][r][0] * share[r] * known.parts(last, limited)[way]
    return shares, _Counts(plain, REPLICATES * count)


def _outside(ways: Sequence[Way], errors: Floats, limited: Sequence[int]) -> NDArray[np.bool_]:
    """Which specimens are outside in any of these ways, and in those of every limited quantity."""
    out = np.zeros((len(errors), 1 + len(limited)), dtype=bool)
    for way in ways:
        out |= way.is_out(errors)[:, None] & _touched([way], limited)
    return out


def _counted_rest(specimens: Specimens, known: _Known, limited: Sequence[int], seed: np.random.SeedSequence) -> _Counts:
    """Specimens that are outside in ways that the search knows nothing of, and in no other one."""
    rng = _generator(seed)
    counts, drawn = np.zeros(1 + len(limited)), 0
    most = min(max(NUMBERS // specimens.scores, PLAIN), COUNTED_MOST) // specimens.fewer
    while drawn < most:
        _, errors = specimens.drawn(CHUNK, rng)
        drawn += CHUNK
        counts += (_outside(known.rest, errors, limited) & ~_outside(list(known.found), errors, limited)).sum(axis=0)
    return _Counts(counts, drawn)


def _joined(known: _Known, limited: Sequence[int], shares: Floats, plain: _Counts, rest: _Counts | None) -> Tail:
    """What was found by search, what was counted and what is negligible, together."""
    is_found = _touched(known.found, limited)
    searched, agree = _estimate(shares, plain)
    share, error, low, high = (np.where(is_found, part, 0.0) for part in searched)
    error[~is_found & (_touched(known.rest, limited) | _touched(known.small, limited))] = np.nan
    high += NEGLIGIBLE * _touched(known.small, limited)
    if rest is not None:
        left = _touched(known.rest, limited)
        below, above = confidence.of_counts(rest.outside, np.full(len(high), float(rest.samples)))
        share += rest.outside / rest.samples
        low += np.where(left, below, 0.0)
        high += np.where(left, above, 0.0)
    method = NEGLECTED if rest is None else NOT_FOUND
    if is_found[0]:
        method = (SEARCHED if rest is None else PARTLY) if agree[0] else UNCERTAIN
    # A quantity is beyond its limits at most as often as all together.
    high = np.maximum(np.minimum(high, high[0]), share)
    return Tail(share, error, low, np.minimum(high, 1.0), method)


def _estimate(shares: Floats, plain: _Counts) -> tuple[tuple[Floats, Floats, Floats, Floats], NDArray[np.bool_]]:
    """Of the shares in independent replicates, a row each: mean, standard error, interval, and whether they agree.

    Shares are positive, so the interval is one of logarithms. Where they disagree it is that of the counted specimens.
    """
    mean = shares.mean(axis=0)
    error = shares.std(axis=0, ddof=1) / math.sqrt(len(shares))
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(mean > 0.0, error / mean, np.inf)
        factor = np.exp(np.minimum(confidence.student(len(shares) - 1, LEVEL) * relative, 700.0))
    agree = relative <= DISAGREE
    below, above = confidence.of_counts(plain.outside, np.full(len(mean), float(plain.samples)))
    low = np.where(agree, mean / factor, np.minimum(below, mean))
    high = np.where(agree, mean * factor, np.maximum(above, mean))
    return (mean, error, low, high), agree


def _with_counts(found: Tail, counted: Tail) -> Tail:
    """What was searched for; the counted share where the two intervals have nothing in common, with both of them."""
    apart = (found.low > counted.high) | (found.high < counted.low)
    share, error = (np.where(apart, *pair) for pair in ((counted.share, found.share), (counted.error, found.error)))
    low = np.where(apart, np.minimum(counted.low, found.low), found.low)
    high = np.where(apart, np.maximum(counted.high, found.high), found.high)
    return Tail(share, error, low, high, REFUTED if apart[0] else found.method)


def require_rare(m: Mechanism) -> None:
    """Refuse the search for rare specimens where it is not possible, or where nothing says which they are."""
    if not all(part.core.isostatic for part in m.every_part):
        problem = "rare specimens are searched for in determinate mechanisms; this one is over-constrained or elastic"
        raise InputError(problem, file=m.file, key="rare")
    if not any(part.limits.errors for part in m.every_part):
        raise InputError(
            "rare specimens are those outside the limits, and the file has none", file=m.file, key="limits"
        )


def search_rare(
    builder: ResultBuilder,
    m: Mechanism,
    at: Nominal,
    counts: Floats,
    seed: int,
    law: str | None,
    limits: Floats,
    is_loaded: bool,
    workers: Here | Workers,
) -> None:
    """Put the shares of rare specimens in the place of the counted ones, and say how each was found.

    Parameters
    ----------
    counts : ndarray
        Specimens outside among those drawn, by configuration.
    workers : Here or Workers
        Who searches, configuration by configuration.
    """
    methods = np.full(len(at), COUNTED, dtype=METHODS.dtype)
    ends = (("", "share"), ("_standard_error", "error"), ("_low", "low"), ("_high", "high"))
    names = [f"outside{of}{end}" for of in ("", "_quantity") for end, _ in ends]
    values = {name: builder.data[name].values.copy() for name in names}
    limited = np.isfinite(limits).any(axis=1)
    rare = np.flatnonzero((counts < FEWEST) & np.isfinite(at.poses).all(axis=(1, 2))).tolist()
    tails = workers.each(_tail_at, (m, seed, law, limits, is_loaded), ((k, at.at(k)) for k in rare))
    for k, searched in zip(rare, tails, strict=True):
        counted = {
            attribute: np.append(values[f"outside{end}"][k], values[f"outside_quantity{end}"][k, limited])
            for end, attribute in ends
        }
        found = _with_counts(searched, Tail(**counted, method=COUNTED))
        methods[k] = found.method
        for end, attribute in ends:
            value = getattr(found, attribute)
            values[f"outside{end}"][k], values[f"outside_quantity{end}"][k, limited] = value[0], value[1:]
    for name, array in values.items():
        builder.data[name] = replace(builder.data[name], values=array)
    methods[np.isnan(values["outside"])] = ""
    builder.add("outside_method", "configuration", methods, "how the share outside the limits was found")
