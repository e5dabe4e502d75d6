"""Elastic mechanisms beside finite elements for frames, without clearances and with them; both are of first order."""

import json
from functools import cache, partial

import numpy as np

import jointplay as jp
from helpers.oracles.frames import Frame, Loaded, Place, is_known
from jointplay import _core

from .subject import Array, Check, Found, Subject

MM = 1e3
#: what moves by less than this part of the mechanism's size is still
STILL = 1e-6


def is_frame(s: Subject) -> bool:
    return s.mechanism is not None and is_known(s.mechanism.raw)


def is_loose_frame(s: Subject) -> bool:
    return is_frame(s) and any(source["kind"] == "clearance" for source in s.spec["sources"])


def displaced(s: Subject, clearances: bool) -> Found:
    """The output, as far as the load decides where it is."""
    units, axes = _components(s)
    ours = _ours(s, clearances)
    theirs = _theirs(s, clearances).output[axes]
    gap = np.abs(ours["error"][0] * units - theirs) - ours["undetermined"][0] * units
    size, lengths = MM * s.size, units == MM
    moved = max(np.abs(theirs[lengths]).max(), size * np.abs(theirs[~lengths]).max(), STILL * size)
    return Found.of(np.maximum(gap, 0.0), 0.0, np.where(lengths, moved, moved / size))


def forces(s: Subject, clearances: bool) -> Found:
    """In all joints, and along all pieces of elastic bodies."""
    units, axes = _components(s)
    m, frame = _mechanism(s), _frame(s)
    ours, theirs = _ours(s, clearances)["reaction"][0], _theirs(s, clearances)
    largest = max(np.linalg.norm(wrench[:3]) for wrench in theirs.reactions.values())
    levers = np.where(units == MM, 1.0, MM)
    parts = []
    for name, own in zip(m.joints, ours, strict=True):
        # A universal joint is two pins in the core.
        wrench = theirs.reactions.get(name.removesuffix(".first").removesuffix(".second"))
        if wrench is not None:
            parts.append(Found.of(own * levers, wrench[axes], largest * np.where(units == MM, 1.0, MM * s.size)))
    for member in m.members:
        places = frozenset(_place(frame, member.body, end) for end in member.between)
        along = np.array(m.core_spec["joints"][member.joint]["axis_first"])[: np.sum(units == MM)]
        tension = -along @ ours[member.joint][: len(along)]
        parts.append(Found.of(tension, theirs.tensions[member.body, places], largest))
    return Found.all(parts)


def _mechanism(s: Subject) -> jp.Mechanism:
    assert s.mechanism is not None
    return s.mechanism


def _frame(s: Subject) -> Frame:
    return Frame(_mechanism(s).raw)


@cache
def _theirs(s: Subject, clearances: bool) -> Loaded:
    return _frame(s).solve(clearances)


def _components(s: Subject) -> tuple[Array, list[int]]:
    """Of the core's components, what makes them those of the frame, and which these are."""
    return (np.array([MM, MM, 1.0]), [0, 1, 5]) if s.planar else (np.repeat([MM, 1.0], 3), list(range(6)))


def _ours(s: Subject, clearances: bool) -> dict[str, Array]:
    sources = [source for source in s.spec["sources"] if clearances or source["kind"] != "clearance"]
    return _core.Mechanism(json.dumps(s.spec | {"sources": sources})).loaded(*s.one(0), False)


def _place(frame: Frame, body: str, end: str) -> Place:
    """Where a piece ends: at a joint, at the output, at a load."""
    if end == "output":
        return frame.output[1]
    if end in frame.joints:
        return frame.joints[end][1]
    return frame.loads()[int(end.removeprefix("load"))][1]


CHECKS = [
    Check(
        figure,
        f"Pynite, {'contacts by Clarabel' if clearances else 'without clearance'}",
        ("PyNiteFEA", "clarabel") if clearances else ("PyNiteFEA",),
        unit,
        1e-6,
        "rigid bodies are stiff elements, extrapolated",
        is_loose_frame if clearances else is_frame,
        partial(compare, clearances=clearances),
    )
    for figure, unit, compare in (
        ("loaded pose, first order", "of the value", displaced),
        ("reactions, first order", "of the largest force", forces),
    )
    for clearances in (False, True)
]
