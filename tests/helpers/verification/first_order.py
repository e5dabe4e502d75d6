"""What follows from sensitivities: they come from a closure of their own, sets and variances from their definitions."""

from typing import Any

import numpy as np

from helpers.geometry import unit_vectors
from helpers.oracles import statistics, variances
from helpers.oracles.cones import DIRECTIONS, TRANSLATIONS, Linearised
from helpers.oracles.core_spec import MM, columns, unit
from helpers.oracles.sets import Source
from helpers.oracles.supports import support

from . import coupled, spatial
from .monte_carlo import LAWS
from .subject import Array, Check, Found, Subject

MANY = 40_000
#: displacements below this part of what rotations do at the size of the mechanism are as good as zero, and the reverse
ZERO = 1e-4


def is_known(s: Subject) -> bool:
    return s.determinate and (s.is_linkage or coupled.is_coupled(s) or spatial.is_known(s))


def slopes(s: Subject, k: int) -> Array:
    """Displacement of the output per parameter, [3 or 6, parameter], without those of sizes, which are zero."""
    if s.is_linkage:
        return _of_linkage(s, k)
    if s.planar:
        train, nominal = coupled.at(s, k)
        return np.asarray(train.gradient(train.output, nominal, s.at.drives[k], np.zeros(train.n_parameters)).T)
    return _in_space(s, k)


def _of_linkage(s: Subject, k: int) -> Array:
    link, q, drives = s.linkage(k)
    found = np.zeros((3, sum(len(source["centre"]) for source in s.spec["sources"])))
    own, _ = link.sensitivity(q, drives)
    where = columns(s.spec)
    for label, column in zip(link.labels, own.T, strict=True):
        found[:, where[label]] = column * unit(link, label) / [MM, MM, 1.0]
    return found


def _in_space(s: Subject, k: int) -> Array:
    """From the relative velocities at the joints: all that is locked or driven is given, the twists follow."""
    closure = Linearised(s.spec, s.at.poses[k])
    matrix, n = np.vstack([closure.rows, closure.driven]), len(closure.locked)
    right, direct = [], []
    for source in s.spec["sources"]:
        own = np.zeros((len(source["centre"]), len(matrix)))
        shift = np.zeros((len(source["centre"]), 6))
        if source["kind"] == "clearance":
            rows = [i for i, (joint, _) in enumerate(closure.locked) if joint == source["joint"]]
            own[range(len(rows)), rows] = 1.0
        elif source["kind"] == "angle":
            own[0, closure.locked.index((source["joint"], "roll"))] = 1.0
        elif source["kind"] == "drive":
            own[0, n + source["drive"]] = 1.0
        else:
            own[0], shift[0] = _longer(closure, s, source)
        right.append(own)
        direct.append(shift)
    # What the output does not show, as the turn of a rod about its own line, is not decided.
    twists = np.linalg.lstsq(matrix, np.concatenate(right).T, rcond=1e-10)[0]
    return np.asarray(closure.output() @ twists + np.concatenate(direct).T)


def _longer(closure: Linearised, s: Subject, source: dict[str, Any]) -> tuple[Array, Array]:
    """What a longer dimension asks of the joints at its end, and the shift of an output there."""
    (_, start), (_, end) = (closure.place(source[key]) for key in ("from", "to"))
    along = (end - start) / np.linalg.norm(end - start)
    moved = {source["to"], *source.get("together", [])}
    asked = np.zeros(len(closure.rows) + len(closure.driven))
    for row, (j, name) in enumerate([*closure.locked, *closure.drives]):
        joint = s.spec["joints"][j]
        sign = (joint["first"] in moved) - (joint["second"] in moved)
        if sign and name in TRANSLATIONS:
            asked[row] = sign * closure.axes[j][DIRECTIONS[name]] @ along
    output = np.concatenate([along, np.zeros(3)]) if s.spec["output"]["point"] in moved else np.zeros(6)
    return asked, output


def supports(s: Subject, k: int, w: Array) -> Array:
    """The largest w . parameters over all sets, [direction]; planar sets are those at the largest clearance."""
    if not s.planar:
        return support(s.spec, w)
    total = np.zeros(len(w))
    for kind, part in _sets(s, k):
        total += kind.support(w[:, part].T) + w[:, part] @ np.array(kind.centre)
    return total


def _sets(s: Subject, k: int, widest: bool = True) -> list[tuple[Source, Any]]:
    """Planar sources in the units of the core, and where their parameters are."""
    if s.coupled:
        return coupled.sets(s)
    link, _, _ = s.linkage(k, widest)
    where, found = columns(s.spec), []
    for x in link.sources:
        factor = unit(link, x.labels[0])
        size = tuple(v / (MM if x.kind == "diamond" else factor) for v in x.size)
        centre = tuple(v / factor for v in x.centre)
        found.append((Source(x.name, x.kind, x.labels, size, centre), [where[label] for label in x.labels]))
    return found


def derivatives(s: Subject) -> Found:
    """By all parameters that scatter, beside the largest one of a displacement or a rotation."""
    parts = []
    for k in s.few:
        theirs, ours = slopes(s, k), s.core.sensitivity(*s.one(k))["source"][0]
        if s.is_linkage:
            some = [column for _, part in _sets(s, k) for column in part]
            theirs, ours = theirs[:, some], ours[:, some]
        parts.append(Found.of(ours, theirs, _largest(s, theirs)[:, None]))
    return Found.all(parts)


def _largest(s: Subject, values: Array) -> Array:
    """Of each component of the output the largest of its kind: of displacements or of rotations."""
    groups = np.split(np.abs(values), [_lengths(s)])
    return np.repeat(_scales(s, *(group.max() for group in groups)), [len(group) for group in groups])


def _scales(s: Subject, length: float, angle: float) -> Array:
    """What displacements and rotations are compared with; one that is zero beside the other counts as a part of it."""
    return np.array([max(length, ZERO * angle * s.size), max(angle, ZERO * length / s.size)])


def _lengths(s: Subject) -> int:
    """How many components of the output are lengths."""
    return 2 if s.planar else 3


def ends(s: Subject) -> Found:
    """Both ends of every component, from support functions."""
    parts = []
    for k in s.few:
        own = slopes(s, k)
        found = s.core.worst(*s.one(k), 1)["component_first_order"][0]
        theirs = np.stack([-supports(s, k, -own), supports(s, k, own)], axis=-1)
        parts.append(Found.of(found, theirs, _largest(s, theirs)[:, None]))
    return Found.all(parts)


def farthest(s: Subject) -> Found:
    """Largest displacement and rotation, by supports along very many directions."""
    parts = []
    for k in s.few:
        found, largest = s.core.worst(*s.one(k), 1), []
        for rows in np.split(slopes(s, k), [_lengths(s)]):
            directions = np.array_split(_directions(len(rows)), 2)
            largest.append(max(supports(s, k, some @ rows).max() for some in directions))
        ours = [found["position_first_order"][0], found["rotation_first_order"][0]]
        parts.append(Found.of(ours, largest, _scales(s, *largest)))
    return Found.all(parts)


def _directions(size: int) -> Array:
    """Unit vectors, spread evenly: both signs, around a circle, or along a spiral over the sphere."""
    if size == 1:
        return np.array([[1.0], [-1.0]])
    if size == 3:
        return unit_vectors(MANY)
    turn = 2 * np.pi * (np.arange(MANY) + 0.5) / MANY
    return np.column_stack([np.cos(turn), np.sin(turn)])


def covariances(s: Subject) -> Found:
    parts = []
    for k in s.few:
        own = slopes(s, k)
        spread = np.zeros(own.shape[1])
        if s.planar:
            laws = [source["law"] for source in s.spec["sources"]]
            firsts = np.cumsum([0] + [len(source["centre"]) for source in s.spec["sources"]])
            for kind, part in _sets(s, k, widest=False):
                columns_ = np.arange(own.shape[1])[part]
                number = int(np.searchsorted(firsts, columns_[0], side="right")) - 1
                spread[columns_] = statistics.variance(kind, laws[number])
        else:
            spread = np.concatenate([variances.variance(source) for source in s.spec["sources"]])
        theirs = np.sqrt(np.diagonal((own * spread) @ own.T))
        ours = np.sqrt(np.diagonal(s.core.random(*s.one(k), 64, 1, np.array([0.5]))["covariance_first_order"][0]))
        parts.append(Found.of(ours, theirs, _largest(s, theirs)))
    return Found.all(parts)


def has_flat_sets(s: Subject) -> bool:
    """Whether the errors are linear in the offsets: the play of flanks is not, the first order knows which carries."""
    return is_known(s) and not s.coupled


def has_variances(s: Subject) -> bool:
    """Whether the variances of all laws are known."""
    laws = {(next(iter(x["set"])), x["law"]) for x in s.spec["sources"]}
    plain = {("interval", "uniform"), ("interval", "normal"), ("diamond", "uniform")}
    plain |= {("disc", law) for law in LAWS} if s.planar else {(kind, "uniform") for kind in spatial.SETS}
    return is_known(s) and not s.has_sizes and laws <= plain


CHECKS = [
    Check(
        "sensitivities",
        "linearised closures",
        ("numpy",),
        "of the largest one",
        1e-6,
        "differences where there are couplings",
        is_known,
        derivatives,
    ),
    Check(
        "worst case, first order",
        "support functions",
        ("numpy",),
        "of the largest one",
        1e-9,
        "the numbers of both are exact to rounding",
        has_flat_sets,
        ends,
    ),
    Check(
        "worst case, first order",
        "support functions, 40,000 directions",
        ("numpy",),
        "of the value",
        1e-3,
        "the directions are up to a degree apart",
        has_flat_sets,
        farthest,
    ),
    Check(
        "standard deviation, first order",
        "elementary integrals",
        ("numpy",),
        "of the largest one",
        1e-6,
        "differences where there are couplings",
        has_variances,
        covariances,
    ),
]
