"""The state of a part: where every joint's two centres are, where every clearance is, and what every joint transmits.

Every centre is the output of the part once, so that the core says of it what it says of any output: the exact error
under the loads, and the half-width of what the loads do not decide.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay import _core
from jointplay.model import Mechanism
from jointplay.result import STATUSES

from jointplay.analyses.offsets import beyond
from .part import Floats
from .steps import Step

ENDS = ("first", "second")
#: outcomes from the least to the most serious
SERIOUS = ("ok", "undetermined", "underconstrained", "strained", "not_assemblable", "singular", "not_assembled")
#: share of the characteristic length within which a clearance is taken up
TOUCHING = 1e-7


@dataclass(frozen=True, eq=False)
class State:
    """A part with its deviations, under its loads; SI, indexed as in the whole mechanism, nan where nothing is yet.

    Attributes
    ----------
    shaft, bearing : ndarray
        Error of the centre on the first and on the second body of every joint, with the rotation of that body; shape
        (joint, component).
    shaft_open, bearing_open : ndarray
        Half-width of what the loads do not decide of it.
    error, error_open : ndarray
        The same of the output.
    slopes : ndarray
        Error of the output per offset, to first order; shape (component, parameter). Where the part is
        over-constrained, offsets depend on one another and there are none.
    offset : ndarray
        Offset of every clearance, and the known deviations; shape (parameter,).
    decided : ndarray of bool
        Whether the loads decide where a source is; shape (source,).
    reaction : ndarray
        On the second body of every joint; shape (joint, wrench).
    clearance_factor : float
        Smallest factor on the clearances with which the part goes together without strain.
    status : str
    """

    shaft: Floats
    bearing: Floats
    shaft_open: Floats
    bearing_open: Floats
    error: Floats
    error_open: Floats
    slopes: Floats
    offset: Floats
    decided: NDArray[np.bool_]
    reaction: Floats
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

    def core(self, output: int | None = None, **changes: Any) -> _core.Mechanism:
        """The part in the core, with a point as output."""
        return self.part.core(output, **self.changes, **changes)

    def points(self) -> list[int]:
        """The centres of all joints and the output, each once."""
        spec = self.part.spec
        centres = {joint[end] for joint in spec["joints"] for end in ENDS}
        return sorted(centres | ({spec["output"]["point"]} if self.has_output else set()))

    @property
    def has_output(self) -> bool:
        """Whether the body of the output is there and is not the base."""
        spec = self.part.m.core_spec
        return int(spec["points"][spec["output"]["point"]]["body"]) in self.part.bodies


def state(step: Step) -> State:
    """Solve what is assembled after a step."""
    held = Held(step)
    part, m = held.part, held.part.m
    answers = {point: held.core(point).loaded(held.drives, held.poses, True) for point in held.points()}
    joints, size = len(m.joints), len(m.components)
    centres = np.full((2, 2, joints, size), np.nan)
    for k, joint in enumerate(part.spec["joints"]):
        for end, side in enumerate(ENDS):
            found = answers[joint[side]]
            centres[:, end, part.joints[k]] = found["error"][0], found["undetermined"][0]
    error = np.full((2, size), np.nan)
    if held.has_output:
        found = answers[part.spec["output"]["point"]]
        error[:] = found["error"][0], found["undetermined"][0]
    (shaft, bearing), (shaft_open, bearing_open) = centres
    any_answer = next(iter(answers.values()), None)
    codes = [str(STATUSES[answer["status"][0]]) for answer in answers.values()]
    return State(
        shaft=shaft,
        bearing=bearing,
        shaft_open=shaft_open,
        bearing_open=bearing_open,
        error=error[0],
        error_open=error[1],
        slopes=_slopes(held),
        offset=_spread(part.parameters, any_answer, "offset", len(m.parameters)),
        decided=_spread(part.sources, any_answer, "decided", len(m.sources)) == 1.0,
        reaction=_spread(part.joints, any_answer, "reaction", joints),
        clearance_factor=_factor(any_answer),
        status=max([*codes, "underconstrained" if held.free else "ok"], key=SERIOUS.index),
    )


def _slopes(held: Held) -> Floats:
    """Error of the output per offset of every parameter of the whole mechanism."""
    m = held.part.m
    slopes = np.full((len(m.components), len(m.parameters)), np.nan)
    if held.has_output and not held.redundant:
        core = held.core(held.part.spec["output"]["point"])
        slopes[:, held.part.parameters] = core.sensitivity(held.drives, held.poses)["source"][0]
    return slopes


def contact(m: Mechanism, found: State) -> list[str]:
    """Of every source whether it is taken up.

    ``touching``, ``open``, ``undetermined`` where the loads do not decide; empty for what is no clearance or not there.
    """
    words = []
    for s, kind in enumerate(m.source_kinds):
        offset = found.offset[m.parameter_source == s]
        if kind != "clearance" or np.isnan(offset).any():
            words.append("")
        elif not found.decided[s]:
            words.append("undetermined")
        else:
            ((shape, size),) = m.core_spec["sources"][s]["set"].items()
            away = beyond(shape, size, offset[None])[0]
            words.append("touching" if away > -TOUCHING * m.length else "open")
    return words


def _spread(places: Any, answer: dict[str, Any] | None, name: str, count: int) -> Floats:
    """What the core says of the entries of the part, at their places among those of the whole mechanism."""
    if answer is None:
        return np.full(count, np.nan)
    # What holds a freedom comes last in the core and has no place in the mechanism.
    values = np.asarray(answer[name][0], dtype=np.float64)[: len(places)]
    whole = np.full((count, *values.shape[1:]), np.nan)
    whole[list(places)] = values
    return whole


def _factor(answer: dict[str, Any] | None) -> float:
    if answer is None or "clearance_factor" not in answer:
        return 0.0
    return float(answer["clearance_factor"][0])
