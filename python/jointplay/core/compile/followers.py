"""Followers in numbers: the curve of the following coordinate over the leading one.

Through the points of a table goes a cubic spline, twice differentiable, whose ends have no curvature (natural), no
slope (clamped), or the same slope and curvature (periodic). A periodic table is written three times, one turn after the
other, so that no seam is near.
"""

import itertools
import math
from collections.abc import Iterator

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.sets import between
from jointplay.core.spec import CurveSpec, FollowerSpec, SourcePart
from jointplay.errors import listed
from jointplay.file.schema import Follower, MechanismFile

from .drives import Commands, coordinate_factor
from .graph import CompiledJoint, Graph
from .source import CompiledSource, interval

#: part of a turn by which a table that goes over one may miss it, and of what a table goes over that is no distance
ROUNDED = 1e-9


def add_followers(data: MechanismFile, graph: Graph) -> None:
    """Puts the followers behind the joints of the file, each between the bodies of the joint that follows.

    Raises
    ------
    InputError
        When a joint has no coordinate, or is commanded otherwise.
    """
    commanded = {joint: f"drive '{name}'" for name, drive in data.drives.items() for joint in drive.moves}
    for name, entry in data.followers.items():
        key = f"followers.{name}"
        if name in data.joints or any(joint.name == name for joint in graph.joints):
            raise graph.refuse(f"'{name}' is the name of a joint; give the follower another one", key)
        if name in data.drives:
            # Both could have a source NAME.backlash.
            raise graph.refuse(f"'{name}' is the name of a drive; give the follower another one", key)
        own, leader = (graph.joints[_joint(graph, word, f"{key}.{at}")] for word, at in _joints(entry))
        if entry.joint in commanded:
            raise graph.refuse(f"{commanded[entry.joint]} commands '{entry.joint}' already", f"{key}.joint")
        commanded[entry.joint] = f"follower '{name}'"
        _check_table(graph, entry, own, leader, key)
        unit = graph.units.turning_stiffness if own.is_angular else graph.units.stiffness
        gives = None if entry.stiffness is None else (1.0 / (entry.stiffness * unit),)
        ends = (own.first, own.second, own.axis_first, own.axis_second, own.side_first, own.side_second)
        graph.joints.append(CompiledJoint(name, name, "follower", *ends, gives, places=False))


def compile_followers(data: MechanismFile, graph: Graph, commands: Commands) -> dict[int, FollowerSpec]:
    """What the core is told of every follower, by the index of its joint.

    Raises
    ------
    InputError
        When a drive turns the leading joint to where its angle begins again.
    """
    found: dict[int, FollowerSpec] = {}
    for name, entry in data.followers.items():
        of, leader = (graph.joint_index(word, f"followers.{name}.{at}") for word, at in _joints(entry))
        factors = [coordinate_factor(graph, graph.joints[k]) for k in (leader, of)]
        curve, middle = _curve(entry, factors[0], factors[1])
        if graph.joints[leader].is_angular and entry.ends != "periodic":
            _check_turn(graph, commands, leader, middle, f"followers.{name}")
        told: FollowerSpec = {"of": of, "leader": leader, "curve": curve, "middle": middle}
        found[graph.joint_index(name, f"followers.{name}")] = told
    return found


def of_followers(data: MechanismFile, graph: Graph) -> Iterator[CompiledSource]:
    """Lost motion and errors of followers."""
    for name, entry in data.followers.items():
        index = graph.joint_index(name, f"followers.{name}")
        own = graph.joints[graph.joint_index(entry.joint, f"followers.{name}.joint")]
        factor = coordinate_factor(graph, own)
        component = ("angle",) if own.is_angular else ("along",)
        if entry.backlash is not None:
            spec: SourcePart = {
                "joint": index,
                "set": between(-entry.backlash.minus * factor, entry.backlash.plus * factor),
                "law": entry.backlash_law,
            }
            at = f"followers.{name}.backlash"
            yield CompiledSource(
                f"{name}.backlash", "backlash", component, (factor,), (0.0,), spec | {"kind": "clearance"}, at
            )
        if entry.error is not None or entry.deviation:
            part = interval(entry.error, entry.law or "uniform", factor) | {"joint": index}
            known = (entry.deviation * factor,)
            yield CompiledSource(f"{name}.error", "ratio", component, (factor,), known, part, f"followers.{name}.error")


def _joints(entry: Follower) -> tuple[tuple[str, str], tuple[str, str]]:
    return (entry.joint, "joint"), (entry.follows, "follows")


def _joint(graph: Graph, name: str, key: str) -> int:
    index = graph.joint_index(name, key)
    joint = graph.joints[index]
    if not joint.can_be_driven:
        known = listed(other.name for other in graph.joints if other.can_be_driven)
        raise graph.refuse(
            f"'{name}' is a {joint.kind} joint and has no coordinate; joints that have one: {known}", key
        )
    return index


def _check_table(graph: Graph, entry: Follower, own: CompiledJoint, leader: CompiledJoint, key: str) -> None:
    """Refuse a table that does not fit an angle, or has a place twice."""
    if entry.at is None or entry.values is None:
        return
    unit, name = graph.units.angle, graph.units.angle_name
    turn = math.tau / unit
    span = entry.at[-1] - entry.at[0]
    least = ROUNDED * (turn if leader.is_angular else span)
    for one, other in itertools.pairwise(entry.at):
        if other - one < least:
            raise graph.refuse(f"{one:g} and {other:g} are the same place; leave one of them out", f"{key}.at")
    if entry.ends != "periodic":
        if leader.is_angular and span >= turn:
            raise graph.refuse(
                f'at goes over {span:g} {name}, a full turn or more: ends = "periodic" with a table of one turn',
                f"{key}.at",
            )
        return
    if not leader.is_angular:
        raise graph.refuse(f"'{leader.name}' does not turn; what is periodic follows an angle", f"{key}.ends")
    if abs(span - turn) > ROUNDED * turn:
        raise graph.refuse(f"at goes over {span:g} {name}; a periodic table goes over {turn:.10g} {name}", f"{key}.at")
    rise = entry.values[-1] - entry.values[0]
    size = max(map(abs, entry.values))
    turns = round(rise / turn) if own.is_angular else 0
    if abs(rise - turns * turn) > ROUNDED * max(size, turn if own.is_angular else 0.0):
        more = " (or by full turns more)" if own.is_angular else ""
        raise graph.refuse(
            f"the last value, {entry.values[-1]:g}, is that of the first point{more}: {entry.values[0]:g}",
            f"{key}.values",
        )


def _check_turn(graph: Graph, commands: Commands, leader: int, middle: float, key: str) -> None:
    """Refuse drive values on both sides of half a turn from the middle of a curve, where it would jump."""
    for drive, (name, moves) in enumerate(zip(commands.names, commands.moves, strict=True)):
        for joint, coefficient in moves:
            if joint != leader or commands.values is None:
                continue
            angles = coefficient * commands.values[:, drive]
            turns = np.floor((angles - middle) / math.tau + 0.5)
            if turns.min() < turns.max():
                unit, word = graph.units.angle, graph.units.angle_name
                at = (middle + math.pi * (2.0 * turns.min() + 1.0)) / unit
                raise graph.refuse(
                    f"drive '{name}' turns '{graph.joints[leader].name}' past {at:.6g} {word}, half a turn from the"
                    " middle of the curve, where the angle begins again; give another origin, or a periodic table",
                    key,
                )


def _curve(entry: Follower, x_unit: float, y_unit: float) -> tuple[CurveSpec, float]:
    """The curve in SI and the middle of its table."""
    if entry.polynomial is not None:
        coefficients = [c * y_unit / x_unit**k for k, c in enumerate(entry.polynomial)]
        origin = entry.origin * x_unit
        return {"knots": [origin, origin + 1.0], "pieces": [coefficients]}, origin
    x, y = (np.array(values) * unit for values, unit in ((entry.at, x_unit), (entry.values, y_unit)))
    middle = 0.5 * float(x[0] + x[-1])
    pieces = spline(x, y, entry.ends)
    if entry.ends == "periodic":
        rise = np.array([[float(y[-1] - y[0]), 0.0, 0.0, 0.0]])
        pieces = np.concatenate([pieces - rise, pieces, pieces + rise])
        x = np.concatenate([x[:-1] - math.tau, x[:-1], x + math.tau])
    return {"knots": x.tolist(), "pieces": pieces.tolist()}, middle


def spline(x: Floats, y: Floats, ends: str) -> Floats:
    """Coefficients of the cubic spline through some points, between any two of them.

    Examples
    --------
    >>> spline(np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0, 6.0]), "natural").tolist()
    [[0.0, 2.0, 0.0, 0.0], [2.0, 2.0, 0.0, 0.0]]
    """
    from scipy.interpolate import CubicSpline

    # What is periodic is the rest beside the rise of a coordinate that turns with the leading one.
    rise = (y[-1] - y[0]) / (x[-1] - x[0]) if ends == "periodic" else 0.0
    rest = y - rise * (x - x[0])
    if ends == "periodic":
        rest[-1] = rest[0]
    pieces = CubicSpline(x, rest, bc_type=ends).c[::-1].T.copy()
    pieces[:, 0] = y[:-1]
    pieces[:, 1] += rise
    return np.asarray(pieces, dtype=np.float64)
