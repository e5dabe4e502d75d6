"""What the drives are commanded, their values or the path of the output from which they are solved; how they give.

How they move in time is said in `motion`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay.errors import listed, shown
from jointplay.file.schema import Coupling, Drive, MechanismFile

from .compliance import flat
from .graph import CompiledJoint, Graph
from .motion import Clock, DriveMotion, clock_of, compile_motion, derivatives

#: components of a pose, and which of them are lengths; the others are angles
COMPONENTS = {"planar": ("x", "y", "angle"), "spatial": ("x", "y", "z", "rx", "ry", "rz")}
LENGTHS = ("x", "y", "z")
#: turns of a drive that are followed from one configuration to the next
MOST_TURNS = 1000

#: indices of the joints that one drive moves, each with its coefficient
Moves = tuple[tuple[int, float], ...]


@dataclass(frozen=True)
class Commands:
    """Drives in SI units."""

    names: tuple[str, ...]
    #: index of the driven joint, of a motor that moves several the first
    joints: tuple[int, ...]
    #: of every drive all joints that it moves, each with its coefficient: coordinate over value of the drive, SI
    moves: tuple[Moves, ...]
    #: SI per file unit of each drive
    factors: NDArray[np.float64]
    #: commanded values, shape (configuration, drive); None when a path or the nodes of a grid decide them
    values: NDArray[np.float64] | None
    #: poses asked of the output, shape (configuration, component), nan where nothing is asked
    targets: NDArray[np.float64] | None
    #: the components that are asked
    target_components: tuple[str, ...]
    #: speeds and accelerations; None where every drive is at rest
    motion: DriveMotion | None

    def first_values(self, data: MechanismFile) -> dict[int, float]:
        """Coordinates of the driven joints in the first configuration, SI, by the index of the joint.

        None where couplings mesh as they start: which teeth do must not depend on what is commanded.
        """
        if self.values is None or any(isinstance(joint, Coupling) for joint in data.joints.values()):
            return {}
        # Of several drives of one joint the first one says where it is.
        values = [*zip(self.moves, map(float, self.values[0]), strict=True)][::-1]
        return {joint: coefficient * value for moves, value in values for joint, coefficient in moves}


def coordinate_factor(graph: Graph, joint: CompiledJoint) -> float:
    """SI per file unit of a joint's coordinate."""
    return graph.units.angle if joint.is_angular else graph.units.length


def compliance_of(graph: Graph, drive: Drive, moves: Moves) -> tuple[float, ...] | None:
    """Compliance of a drive over the coordinates that it moves, SI, row by row; None where it is rigid."""
    given, units = drive.stiffnesses, graph.units
    if not given:
        return None
    gives = []
    for (joint, _), name in zip(moves, drive.moves, strict=True):
        unit = units.turning_stiffness if graph.joints[joint].is_angular else units.stiffness
        gives.append(1.0 / (given[name] * unit) if name in given else 0.0)
    return flat(np.diag(gives))


def compile_drives(data: MechanismFile, graph: Graph) -> Commands:
    """Check the drives against the joints and bring them to SI."""
    driver: dict[int, list[str]] = {}
    moves: list[Moves] = []
    for name, drive in data.drives.items():
        indices = [_driven(graph, data.drives, name, joint, driver) for joint in drive.moves]
        units = [coordinate_factor(graph, graph.joints[index]) for index in indices]
        ratios = [unit / units[0] for unit in units]
        coefficients = [ratio * c for ratio, c in zip(ratios, drive.moves.values(), strict=True)]
        moves.append(tuple(zip(indices, coefficients, strict=True)))
    joints = [moved[0][0] for moved in moves]
    factors = np.array([coordinate_factor(graph, graph.joints[j]) for j in joints], dtype=np.float64)
    # With a grid drives may be left without values; then there is nothing but a map to ask for.
    mapped_only = data.grid is not None and not all(drive.is_commanded for drive in data.drives.values())
    clock = clock_of(data, graph)
    values = None if data.path is not None or mapped_only else _values(data, graph, clock) * factors
    turning = [graph.joints[joint].is_angular for joint in joints]
    motion = compile_motion(data, graph, values, factors, clock, turning)
    targets, asked = _targets(data, graph)
    return Commands(tuple(data.drives), tuple(joints), tuple(moves), factors, values, targets, asked, motion)


def _driven(graph: Graph, drives: Mapping[str, Drive], name: str, joint: str, driver: dict[int, list[str]]) -> int:
    """Index of a joint that a drive moves, which another one may only where both give way."""
    drive = drives[name]
    key = f"drives.{name}.joint" if drive.joint is not None else f"drives.{name}.joints.{joint}"
    index = graph.joint_index(joint, key)
    if not graph.joints[index].can_be_driven:
        free = listed(j.name for j in graph.joints if j.can_be_driven)
        kind = graph.joints[index].kind
        problem = f"'{joint}' is a {kind} joint and has no coordinate to drive; joints that have one: {free}"
        raise graph.refuse(problem, key)
    others = driver.setdefault(index, [])
    rigid = [other for other in (*others, name) if joint not in drives[other].stiffnesses]
    if others and rigid:
        without = f"{listed(rigid)} {'has' if len(rigid) == 1 else 'have'} none"
        problem = (
            f"'{joint}' is already driven by '{others[0]}'; both can drive it where each has a stiffness, and {without}"
        )
        raise graph.refuse(problem, key)
    others.append(name)
    return index


def _values(data: MechanismFile, graph: Graph, clock: Clock | None) -> NDArray[np.float64]:
    """Drive values in file units, value by value; a single value is repeated."""
    commands = {
        name: drive.commands if clock is None or drive.motion is None else tuple(derivatives(drive, clock)[0].tolist())
        for name, drive in data.drives.items()
    }
    for name, values in commands.items():
        if not values:
            problem = "say what it does: values = [...], or from, to and count, or a [path] for the output"
            raise graph.refuse(problem, f"drives.{name}")
    count = max((len(values) for values in commands.values()), default=1)
    odd = [name for name, values in commands.items() if len(values) not in (1, count)]
    if odd:
        counts = ", ".join(f"{name} {len(values)}" for name, values in commands.items())
        problem = f"drives run together and need as many values each (or a single one that is held); here: {counts}"
        raise graph.refuse(problem, f"drives.{odd[0]}")
    _check_ranges(data, graph, commands)
    _check_turns(data, graph, commands)
    columns = [np.broadcast_to(np.array(values, dtype=np.float64), (count,)) for values in commands.values()]
    return np.stack(columns, axis=1) if columns else np.zeros((count, 0))


def _check_ranges(data: MechanismFile, graph: Graph, commands: dict[str, tuple[float, ...]]) -> None:
    for name, (low, high) in data.limits.drives.items():
        for k, value in enumerate(commands.get(name, ())):
            if not low <= value <= high:
                key = f"drives.{name}.values.{k}" if data.drives[name].values is not None else f"drives.{name}"
                problem = f"{value:g} is outside limits.drives.{name} = {shown([low, high])}"
                raise graph.refuse(problem, key)


def _check_turns(data: MechanismFile, graph: Graph, commands: dict[str, tuple[float, ...]]) -> None:
    # With couplings the start is followed, too: they mesh as the joints start, where drives are zero.
    start = [0.0] if any(isinstance(joint, Coupling) for joint in data.joints.values()) else []
    for name, values in commands.items():
        joint = graph.joints[graph.joint_index(next(iter(data.drives[name].moves)), f"drives.{name}")]
        if not joint.is_angular:
            continue
        turns = np.abs(np.diff([*start, *values])) * graph.units.angle / (2.0 * np.pi)
        if turns.size and turns.max() > MOST_TURNS:
            problem = (
                f"from one configuration to the next, or from zero to the first, it turns {turns.max():,.0f} times; "
                f"at most {MOST_TURNS} turns are followed"
            )
            raise graph.refuse(problem, f"drives.{name}")


def _targets(data: MechanismFile, graph: Graph) -> tuple[NDArray[np.float64] | None, tuple[str, ...]]:
    if data.path is None:
        return None, ()
    if not data.drives:
        raise graph.refuse("a path needs drives that follow it: [drives.NAME] with a joint", "path")
    for name, drive in data.drives.items():
        if drive.is_commanded:
            problem = "either the drives have values or the output has a [path]; here are both"
            raise graph.refuse(problem, f"drives.{name}")
    asked = data.path.asked
    components = COMPONENTS[data.space]
    count = len(next(iter(asked.values())))
    targets = np.full((count, len(components)), np.nan)
    for component, values in asked.items():
        factor = graph.units.length if component in LENGTHS else graph.units.angle
        targets[:, components.index(component)] = np.array(values) * factor
    return targets, tuple(asked)
