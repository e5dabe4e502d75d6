"""Which joints are driven: as many as the mechanism has free motions, independent of one another.

The motions N of the mechanism without drives are those that `check` counts, in a pose beside the drawing, which may be
a special one. Joints are taken in turn while the rates of their coordinates, rows c, are independent in c N. In a tree
they always are.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from jointplay.errors import InputError, listed, not_known
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import Probe, Sample, generic, motors

from .skeleton import GROUND, Joint, Skeleton, Vector

#: kinds with one coordinate
ANGULAR, LINEAR = ("revolute", "screw"), ("prismatic", "cylindrical", "pin_in_slot")
#: largest part of a motion, of length 1, that counts as none
SMALL = 1e-3


def choose(skeleton: Skeleton, wanted: Iterable[str] | None, draft: Callable[[], Mechanism]) -> tuple[str, ...]:
    """The driven joints.

    Parameters
    ----------
    wanted : iterable of str or None
        Names that were asked for; None for a choice of ours: joints with a motor first, then those that a spring
        holds, then those that are nearest to the ground.
    draft : callable
        The mechanism with drives for joints that others follow only, as far as there are loops.

    Raises
    ------
    InputError
        When a name is no joint that can be driven, or a drive is redundant.
    """
    joints = {joint.name: joint for joint in skeleton.joints}
    can = [name for name, joint in joints.items() if joint.kind in (*ANGULAR, *LINEAR) and not leader_of(joint)]
    if wanted is None:
        far = distances(skeleton)
        near = {name: min(far.get(body, len(far)) for body in joints[name].bodies) for name in can}
        # What follows a joint does so by its drive.
        leaders = {leader_of(joint) for joint in joints.values()}
        order = sorted(
            can,
            key=lambda name: (not joints[name].is_driven, not joints[name].spring, name not in leaders, near[name]),
        )
    else:
        order = list(wanted)
        for name in order:
            _check(name, joints, can)
    if not has_loops(skeleton):
        return tuple(name for name in can if name in order)
    beside, drawn = _spaces(draft())
    taken: list[str] = []
    if wanted is None:
        # At a dead centre of the drawing another joint is the better one.
        taken += [name for name in order if _take(name, beside, drawn)]
    for name in order:
        if name not in taken and _take(name, beside):
            taken.append(name)
        elif name not in taken and wanted is not None:
            others = f"what {listed(taken)} already move" if taken else "nothing: the joint cannot move"
            raise InputError(f"the drive of '{name}' is redundant: it would move {others}", key="drives")
    return tuple(name for name in can if name in taken)


def leader_of(joint: Joint) -> str | None:
    """The joint whose coordinate it follows, if it does."""
    leading = joint.follows or joint.curve
    return leading and leading[0]


def has_loops(skeleton: Skeleton) -> bool:
    """Whether there are more joints than a tree has."""
    return len(skeleton.joints) > len(skeleton.bodies) - 1


@dataclass
class _Space:
    """Motions, and how they move every coordinate."""

    #: of every joint with a coordinate
    rates: Mapping[str, Vector]
    #: joints that have been taken
    count: int = 0

    def __post_init__(self) -> None:
        sizes = [len(rate) for rate in self.rates.values()]
        # Orthonormal, in the first rows: what the joints that are taken move.
        self._taken = np.zeros((max(sizes, default=0),) * 2)

    def rest(self, name: str) -> Vector:
        """How the motions that no joint has been taken for move a coordinate."""
        rate, taken = self.rates[name], self._taken[: self.count]
        # Once more, because rounding leaves a part.
        for _ in range(2):
            rate = rate - (taken @ rate) @ taken
        return rate

    def take(self, rest: Vector) -> None:
        """Take a joint for what it moves of the rest."""
        self._taken[self.count] = rest / np.linalg.norm(rest)
        self.count += 1


def _spaces(m: Mechanism) -> tuple[_Space, _Space]:
    """The free motions beside the drawing, and in it to first order."""
    probe = Probe(m)

    def space(sample: Sample) -> _Space:
        ties, _ = motors(m, sample.rates[probe.driven], m.length)
        rates = sample.rates @ sample.motions(ties)
        names = [m.joints[joint] for joint in probe.drivable]
        return _Space(dict(zip(names, rates, strict=True)))

    return space(generic(probe, away=True).sample), space(next(probe.samples()))


def _take(name: str, *spaces: _Space) -> bool:
    """Take a joint where it moves something that none of those before moves, in every space; say whether it does."""
    rests = [space.rest(name) for space in spaces]
    if min(float(np.linalg.norm(rest)) for rest in rests) <= SMALL:
        return False
    for space, rest in zip(spaces, rests, strict=True):
        space.take(rest)
    return True


def _check(name: str, joints: Mapping[str, Joint], can: list[str]) -> None:
    """Refuse what cannot be driven."""
    if name not in can:
        leader = leader_of(joints[name]) if name in joints else None
        if leader:
            raise InputError(f"'{name}' follows '{leader}', which can be driven", key="drives")
        raise InputError(not_known(name, "a joint that can be driven", can), key="drives")


def distances(skeleton: Skeleton) -> dict[str, int]:
    """How many joints away from the ground every body is; what hangs on nothing is not there."""
    far = {GROUND: 0}
    for _, one, other, _ in spanning(skeleton):
        far[other] = far[one] + 1
    return far


def spanning(skeleton: Skeleton, base: str = GROUND) -> Iterator[tuple[Joint, str, str, float]]:
    """Joints of the spanning tree with the fewest joints to every body, outward from the ground or another body.

    Yields
    ------
    tuple
        The joint, its inner and its outer body, and 1 where the outer one is its second body, else -1.
    """
    at: dict[str, list[tuple[Joint, str, str, float]]] = {}
    for joint in skeleton.joints:
        first, second = joint.bodies
        at.setdefault(first, []).append((joint, first, second, 1.0))
        at.setdefault(second, []).append((joint, second, first, -1.0))
    reached, waiting = {base}, [base]
    for body in waiting:
        for step in at.get(body, ()):
            if step[2] not in reached:
                reached.add(step[2])
                waiting.append(step[2])
                yield step
