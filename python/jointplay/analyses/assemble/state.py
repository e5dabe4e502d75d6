"""The state of a part: where every joint's two centres are, where every clearance is, and what every joint transmits.

Every centre is the output of the part once, so that the core says of it what it says of any output: the exact error
under the loads, and the half-width of the indeterminacy that the loads leave.
"""

from dataclasses import dataclass
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from jointplay import _core
from jointplay.basics.arrays import Floats
from jointplay.core.answers import Given, Loaded
from jointplay.core.compile import LOOSE
from jointplay.core.sets import beyond
from jointplay.core.spec import ENDS, Changes, End, JointSpec
from jointplay.model.gaps import clearance_of
from jointplay.model.mechanism import Mechanism
from jointplay.result import STATUSES

from .forces import Members
from .part import rigid
from .steps import Step

#: outcomes from the least to the most serious
SERIOUS = ("ok", "undetermined", "underconstrained", "strained", "not_assemblable", "singular", "not_assembled")
#: share of the characteristic length within which a clearance is taken up
TOUCHING = 1e-7


@dataclass(frozen=True, eq=False)
class State:
    """A part with its deviations, under its loads; SI, indexed as in the whole mechanism, nan where nothing is yet."""

    #: `shaft`, `bearing`: error of the centre on the first and on the second body of every joint, with the rotation of
    #: that body; shape (joint, component)
    shaft: Floats
    bearing: Floats
    #: `shaft_open`, `bearing_open`: half-width of its indeterminacy under the loads
    shaft_open: Floats
    bearing_open: Floats
    #: `error`, `error_open`: the same of the output
    error: Floats
    error_open: Floats
    #: offset of every clearance, and the known deviations; shape (parameter,)
    offset: Floats
    #: whether the loads decide where a source is; shape (source,)
    decided: NDArray[np.bool_]
    #: on the second body of every joint; shape (joint, wrench)
    reaction: Floats
    #: `force`, `elongation`: of every member
    force: Floats
    elongation: Floats
    #: clearance scale factor required for assembly of the rigid bodies
    clearance_factor: float
    status: str


class Held:
    """A part whose freedoms are held, ready to be asked about any of its points."""

    def __init__(self, step: Step) -> None:
        self.part = step.part
        self.changes = step.freedom.holding(step.part)
        self.free = step.freedom.mobility > 0
        self.redundant = step.freedom.redundancy > 0
        self.drives = self.part.commands(self.core(), len(self.changes["drives"]))
        self.poses = np.ascontiguousarray(self.part.poses[None])

    def core(self, output: int | None = None, **changes: Unpack[Changes]) -> _core.Mechanism:
        """The part in the core, with a point as output and other changes of its specification."""
        return self.part.core(output, **(self.changes | changes))

    @property
    def rigid_joints(self) -> list[JointSpec]:
        """The joints without any compliance, for what does not depend on forces."""
        return [rigid(joint) for joint in self.changes["joints"]]

    @property
    def is_rigid(self) -> bool:
        """Whether no joint has any compliance."""
        return all("compliance" not in joint for joint in self.part.spec["joints"])

    def loaded(self, output: int | None = None, *, details: bool = True, **changes: Unpack[Changes]) -> Loaded:
        """What the core says of the part under its loads; without details of the error of the output alone."""
        return self.core(output, **changes).loaded(self.drives, self.poses, offset=details, details=details)

    def status(self, *answers: Given | Loaded) -> str:
        """The most serious outcome of some answers."""
        outcomes = [str(STATUSES[answer["status"][0]]) for answer in answers]
        return max([*outcomes, "underconstrained" if self.free else "ok"], key=SERIOUS.index)

    def centres(self) -> dict[int, dict[End, int]]:
        """The points of the joints of the file whose bodies are there, by the joint's index in the whole mechanism.

        A joint that is not closed yet has one of its ends: where the next member will find it.
        """
        m, there = self.part.m, {point: k for k, point in enumerate(self.part.points)}
        inner = {member.joint for member in m.members}
        ends = {
            k: {end: there[point] for end, point in zip(ENDS, points, strict=True) if point in there}
            for k, points in enumerate(m.joint_points)
            if k not in inner
        }
        return {k: found for k, found in ends.items() if found}

    def points(self) -> list[int]:
        """The points of the joints of the file and the output, each once."""
        centres = {point for ends in self.centres().values() for point in ends.values()}
        return sorted(centres if self.output is None else centres | {self.output})

    @property
    def output(self) -> int | None:
        """The output point, where its body is there and is not the base."""
        m = self.part.m
        there = m.points[m.output_point].body in self.part.bodies
        return int(self.part.spec["output"]["point"]) if there else None


def state(step: Step, members: Members) -> State:
    """Solve what is assembled after a step."""
    held = Held(step)
    part, m = held.part, held.part.m
    centres, output = held.centres(), held.output
    # What all of the part does is the same for every point.
    answers = {point: held.loaded(point, details=k == 0) for k, point in enumerate(held.points())}
    joints, size = len(m.joints), len(m.components)
    found = np.full((2, 2, joints, size), np.nan)
    for k, ends in centres.items():
        for end, point in ends.items():
            found[:, ENDS.index(end), k] = _error(answers[point])
    error, error_open = np.full((2, size), np.nan) if output is None else _error(answers[output])
    # Where nothing is there but the base, the core still says what nothing does.
    answer = next(iter(answers.values()), None) or held.loaded()
    core = held.core()
    return State(
        shaft=found[0, 0],
        bearing=found[0, 1],
        shaft_open=found[1, 0],
        bearing_open=found[1, 1],
        error=error,
        error_open=error_open,
        offset=spread(part.parameters, answer["offset"], len(m.parameters)),
        decided=spread(part.sources, answer["decided"], len(m.sources)) == 1.0,
        reaction=spread(part.joints, answer["reaction"], joints),
        force=members.forces(part, core, answer["reaction"], answer.get("force")),
        elongation=members.elongations(part, core, answer),
        clearance_factor=float(answer["clearance_factor"][0]) if "clearance_factor" in answer else 0.0,
        status=held.status(*answers.values()),
    )


def contact(m: Mechanism, found: State) -> list[str]:
    """Of every source whether it is taken up.

    ``touching``, ``open``, ``undetermined`` where the loads do not decide; empty for what is no clearance or not there.
    """
    words = []
    for s, kind in enumerate(m.source_kinds):
        offset = found.offset[m.parameter_source == s]
        if kind not in LOOSE or np.isnan(offset).any():
            words.append("")
        elif not found.decided[s]:
            words.append("undetermined")
        else:
            shape, size = clearance_of(m, s)
            away = beyond(shape, size, offset[None])[0]
            words.append("touching" if away > -TOUCHING * m.length else "open")
    return words


def _error(answer: Loaded) -> tuple[Floats, Floats]:
    return answer["error"][0], answer["undetermined"][0]


def spread(places: Any, values: Any, count: int) -> Floats:
    """Entries of the part at their places among those of the whole mechanism."""
    # What holds a freedom comes last in the core and has no place in the mechanism.
    values = np.asarray(values[0], dtype=np.float64)[: len(places)]
    whole = np.full((count, *values.shape[1:]), np.nan)
    whole[list(places)] = values
    return whole
