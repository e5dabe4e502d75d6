"""Where the parts of an assembly are, as a table that a macro of FreeCAD puts back: displaced, and magnified.

A row is a part in a configuration: the values of the drives, the position x, y, z in mm, and the quaternion qx, qy, qz,
qw, both in the axes of the ground. The rows of the configuration `start` are where the file has its bodies, which is
the drawing of an import; bodies without one have the axes of the ground there. A displacement is magnified from the
nominal pose of its configuration: the shift of the origin and the rotation vector, each times the factor.
"""

import csv
from collections.abc import Iterator
from io import StringIO

import numpy as np

from jointplay.analyses import worst
from jointplay.analyses.displaced import at_offsets, at_parameters, under_load
from jointplay.analyses.nominal import Nominal, nominal, report
from jointplay.analyses.offsets import parameters
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.errors import InputError, listed, not_known
from jointplay.model.mechanism import Mechanism

from .drafting import GivenErrors
from .fcstd import MM

#: what displaces the mechanism besides given offsets
DISPLACED = ("worst", "loaded")
PLACE, TURN = ("x", "y", "z"), ("qx", "qy", "qz", "qw")
START = "start"
MOST_TIMES = 1e6


def to_placements(m: Mechanism, given: GivenErrors | None, question: str | None, magnify: float) -> str:
    """The table, CSV.

    Parameters
    ----------
    given : pair of mappings, optional
        Offsets and deviations by name, as for `given`.
    question : {"worst", "loaded"}, optional
        What displaces the mechanism: the offsets of the largest position error, or the loads.
    magnify : float
        Factor on the displacements.

    Raises
    ------
    InputError
        When a configuration cannot be assembled, or a body bends, and has no one place.
    """
    if question is not None and question not in DISPLACED:
        raise InputError(not_known(question, "a question that places are written for", DISPLACED), key="question")
    if question is not None and given is not None:
        raise InputError("offsets are given, or found by a question, not both", key="question")
    if not 0.0 <= magnify <= MOST_TIMES:
        raise InputError(f"a factor from 0 to {MOST_TIMES:g} is needed, not {magnify:g}", key="magnify")
    if bending := [name for name in dict.fromkeys(m.owners) if m.owners.count(name) > 1]:
        raise InputError(f"bodies that bend have no one place: {listed(bending)}", file=m.file)
    at = nominal(m)
    _require(m, at.poses, "cannot be assembled")
    moved = at.poses if question is None and given is None else _displaced(m, at, given, question)
    twists = poses.difference(poses.components(moved), poses.components(at.poses))
    return _table(m, at, poses.moved(at.poses, magnify * twists, np.zeros(3)))


def _displaced(m: Mechanism, at: Nominal, given: GivenErrors | None, question: str | None) -> Floats:
    if question == "worst":
        found = at_offsets(m, at, worst.compute(m, at=at).get("worst_offset", extreme="position"))
    elif question == "loaded":
        found = under_load(m, at)
    else:
        found = at_parameters(m, at, parameters(m, len(at), *(given or ({}, {}))))
    _require(m, found.poses, f"has no places in '{question}'" if question else "cannot be assembled with these offsets")
    return found.poses


def _require(m: Mechanism, every: Floats, problem: str) -> None:
    """Refuse a configuration without poses."""
    missing = np.flatnonzero(~np.isfinite(every).all(axis=(1, 2)))
    if len(missing):
        raise InputError(f"configuration {missing[0]} {problem}", file=m.file)


def _table(m: Mechanism, at: Nominal, every: Floats) -> str:
    drives = report(m, "", at).result().drives
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    driven = [f"{name} [{found.units}]" for name, found in drives.items()]
    writer.writerow(["configuration", *driven, "part", *PLACE, *TURN])
    for body, pose in enumerate(m.start_poses):
        if m.owners[body] in m.raw.get("start", {}):
            writer.writerow([START, *("" for _ in drives), m.owners[body], *_placed(pose)])
    for k, placed in enumerate(every):
        values = [f"{found.values[k]:.12g}" for found in drives.values()]
        for body, pose in enumerate(placed):
            writer.writerow([k, *values, m.owners[body], *_placed(pose)])
    return stream.getvalue()


def _placed(pose: Floats) -> Iterator[str]:
    w, x, y, z = poses.from_axes(poses.matrix(pose))
    for number in (*(poses.position(pose) / MM), x, y, z, w):
        yield f"{number + 0.0:.15g}"
