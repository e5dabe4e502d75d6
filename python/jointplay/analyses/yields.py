"""Yields over all configurations, and the repeatability of one specimen.

yield_path       share of the specimens that keep to the limits at every configuration, offsets drawn anew at each
yield_specimen   share of the specimens that keep to them at every configuration wherever the play lies: for drawn sizes
                 and deviations d the worst offsets u count, max over u in C(d) of the error
repeatability    mean + 3 standard deviations of the distance of the output from its barycentre (ISO 9283): offsets are
                 drawn, sizes and deviations are where they are known to be

The worst offsets of a specimen are those of the first order, u = argmax w . A u: of a component at its support points,
of a size by ascent, w = A u / |A u|, from the best of a fan of directions. The error at these offsets is the exact one.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from jointplay.analyses.cluster import Here, Workers
from jointplay.basics.arrays import Flags, Floats
from jointplay.core.compile import LENGTHS
from jointplay.model.mechanism import Mechanism

from .nominal import Nominal

#: specimens drawn for a yield over the path, for one wherever the play lies, and offsets for a repeatability
PATH, SPECIMENS, REPEATS = 100_000, 4_000, 4_000
#: specimens at a time, which bounds the memory
CHUNK = 2_000
#: steps of the ascent
STEPS = 4
#: directions in the plane that an ascent may start from
FAN = 12
#: shares are counted, and parts of the specimens are taken: both want specimens that do not depend on one another
PLAIN = "plain"
#: random offsets of configuration k have the seed of the specimens plus this and k
STRIDE = 0x9E37_79B9_7F4A_7C15


@dataclass(frozen=True)
class Yields:
    """Specimens within all limits, and how many there were."""

    path: int
    path_samples: int
    specimen: int
    specimen_samples: int


def yields(
    m: Mechanism,
    at: Nominal,
    samples: int,
    seed: int,
    law: str | None,
    limits: Floats,
    workers: Here | Workers,
) -> Yields:
    """The yields of a determinate mechanism over its configurations.

    Parameters
    ----------
    limits : ndarray
        Lowest and highest acceptable value of every quantity, infinite where there is none, shape (quantity, 2).
    workers : Here or Workers
        Who looks at the specimens of a path, configuration by configuration.
    """
    specimens = _Specimens(m, min(samples, PATH), seed, law, limits)
    path = np.ones(specimens.count, dtype=bool)
    count = min(samples, SPECIMENS)
    few = specimens.drawn[:count]
    if _are_alike(m, few):
        few = few[:1]
    anywhere = np.ones(len(few), dtype=bool)
    for k, inside in enumerate(workers.each(_Specimens.within, (specimens,), ((k, at.at(k)) for k in range(len(at))))):
        path &= inside
        drives, poses = at.drives[k : k + 1], at.poses[k : k + 1]
        slopes = m.core.sensitivity(drives, poses)["source"][0]
        shift = m.core.given(drives, poses, m.centre[None])["error_first_order"][0] - slopes @ m.centre
        # Those that are out already are not looked at again.
        left = np.flatnonzero(anywhere)
        for part in np.array_split(left, max(1, len(left) // CHUNK)) if left.size else ():
            for u in _worst_offsets(m, few[part], slopes, shift, limits):
                anywhere[part] &= within_limits(m, m.core.errors_of(drives, poses, u), limits)
    return Yields(int(path.sum()), len(path), int(anywhere.sum()) * (count // len(few)), count)


def _are_alike(m: Mechanism, drawn: Floats) -> bool:
    """Whether specimens differ in their offsets only: then one stands for all wherever the play lies."""
    centred = m.core.with_offsets_of(drawn, np.tile(m.centre, (len(drawn), 1)))
    return bool((centred == centred[0]).all())


@dataclass(frozen=True)
class _Specimens:
    """The same specimens at all configurations, with offsets drawn anew at each."""

    m: Mechanism
    count: int
    seed: int
    law: str | None
    limits: Floats

    def __reduce__(self) -> tuple[object, ...]:
        # Who gets them draws them anew, which is quicker.
        return (_Specimens, (self.m, self.count, self.seed, self.law, self.limits))

    @cached_property
    def drawn(self) -> Floats:
        return self.m.core.specimens(self.count, self.seed, self.law, PLAIN)

    def within(self, place: tuple[int, Nominal]) -> Flags:
        """Which of them keep to the limits at a configuration with this number."""
        k, at = place
        seed = _seed(self.seed, k)
        return self.m.core.within_redrawn(at.drives, at.poses, self.drawn, seed, self.limits, self.law)


def repeatability(m: Mechanism, at: Nominal, samples: int, seed: int, law: str | None) -> tuple[Floats, Floats]:
    """Repeatability of the output point at every configuration, and its standard error."""
    count = min(samples, REPEATS)
    offsets = m.core.specimens(count, seed, law, PLAIN)
    u = m.core.with_offsets_of(np.tile(m.centre, (count, 1)), offsets)
    lengths = [name in LENGTHS for name in m.components]
    found = [
        _spread(m.core.errors_of(at.drives[k : k + 1], at.poses[k : k + 1], u)[:, lengths]) for k in range(len(at))
    ]
    values, errors = np.array(found).reshape(-1, 2).T
    return values, errors


def _spread(places: Floats) -> tuple[float, float]:
    places = places[np.isfinite(places).all(axis=1)]
    if len(places) < 2:
        return np.nan, np.nan
    distance = size_of(places - places.mean(axis=0))
    mean, std = distance.mean(), distance.std(ddof=1)
    # What every distance adds to the sum of mean and three deviations.
    influence = distance + (1.5 * ((distance - mean) ** 2) / std if std > 0.0 else 0.0)
    return float(mean + 3.0 * std), float(influence.std() / np.sqrt(len(distance)))


def _seed(seed: int, k: int) -> int:
    return int((seed + STRIDE + k) % 2**64)


def with_sizes(m: Mechanism, errors: Floats) -> Floats:
    """Errors by component with their sizes, position and rotation, behind them."""
    return np.column_stack([_quantity(m, errors, k) for k in range(len(m.quantities))])


def _quantity(m: Mechanism, errors: Floats, k: int) -> Floats:
    """A column of `with_sizes`."""
    components = len(m.components)
    return errors[:, k] if k < components else size_of(errors[:, rows_of(m)[k - components]])


def rows_of(m: Mechanism) -> tuple[list[int], list[int]]:
    """The components of the position and of the rotation, whose sizes follow the components in this order."""
    lengths, angles = (
        [k for k, name in enumerate(m.components) if (name in LENGTHS) == which] for which in (True, False)
    )
    return lengths, angles


def size_of(rows: Floats) -> Floats:
    """Length of every row."""
    # `numpy.linalg.norm` takes many times as long for short rows.
    sizes: Floats = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    return sizes


def within_limits(m: Mechanism, errors: Floats, limits: Floats) -> Flags:
    """Whether every error keeps to all limits; an error that is nan does not."""
    inside: Flags = np.logical_and.reduce([np.isfinite(column) for column in errors.T])
    # Most quantities have no limit, and specimens are many.
    for k in np.flatnonzero(np.isfinite(limits).any(axis=1)).tolist():
        column, (low, high) = _quantity(m, errors, k), limits[k]
        inside &= (column >= low) & (column <= high)
    return inside


def _worst_offsets(m: Mechanism, drawn: Floats, slopes: Floats, shift: Floats, limits: Floats) -> Iterator[Floats]:
    """Parameters of every specimen with the offsets that bring it farthest towards each limit in turn, first order."""
    components = list(m.components)
    for k, (low, high) in enumerate(limits[: len(components)]):
        for sign, limit in ((1.0, high), (-1.0, low)):
            if np.isfinite(limit):
                yield m.core.at_supports(drawn, np.broadcast_to(sign * slopes[k], drawn.shape).copy())
    for rows, limit in zip(rows_of(m), limits[len(components) :, 1], strict=True):
        if np.isfinite(limit):
            yield _farthest(m, drawn, slopes[rows], shift[rows])


def _farthest(m: Mechanism, drawn: Floats, slopes: Floats, shift: Floats) -> Floats:
    """Parameters at which the first-order size of some components is largest, specimen by specimen."""
    best, size = drawn @ slopes.T + shift, np.full(len(drawn), -np.inf)
    fan = _fan(len(slopes)) @ slopes
    if "size" in m.source_kinds:
        every = (m.core.at_supports(drawn, np.tile(way, (len(drawn), 1))) @ slopes.T + shift for way in fan)
    else:
        # All specimens have the same clearances.
        built = m.core.with_offsets_of(drawn, np.tile(m.centre, (len(drawn), 1)))
        moves = (m.core.at_supports(np.tile(drawn[0], (len(fan), 1)), fan) - built[0]) @ slopes.T
        every = (built @ slopes.T + shift + move for move in moves)
    for error in every:
        reached = size_of(error)
        better = reached > size
        best[better], size[better] = error[better], reached[better]
    for _ in range(STEPS):
        # The size grows along the error itself: a convex function lies above its tangents.
        u = m.core.at_supports(drawn, best @ slopes)
        best = u @ slopes.T + shift
    return u


def _fan(size: int) -> Floats:
    """Directions to both sides; in the plane around, in space towards the faces, edges and corners of a cube."""
    if size == 1:
        return np.array([[1.0], [-1.0]])
    if size == 2:
        angles = 2.0 * np.pi * np.arange(FAN) / FAN
        return np.column_stack([np.cos(angles), np.sin(angles)])
    grid = np.array([point for point in product((-1.0, 0.0, 1.0), repeat=size) if any(point)])
    directions: Floats = grid / np.linalg.norm(grid, axis=1, keepdims=True)
    return directions
