"""What the drives are commanded: their values, or the path of the output from which they are solved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay.errors import listed, shown
from jointplay.schema import MechanismFile

from .graph import CompiledJoint, Graph

#: components of a pose, and which of them are lengths; the others are angles
COMPONENTS = {"planar": ("x", "y", "angle"), "spatial": ("x", "y", "z", "rx", "ry", "rz")}
LENGTHS = ("x", "y", "z")


@dataclass(frozen=True)
class Commands:
    """Drives in SI units.

    Parameters
    ----------
    names : tuple of str
    joints : tuple of int
        Index of the driven joint.
    factors : ndarray
        SI per file unit of each drive.
    values : ndarray or None
        Commanded values, shape (configuration, drive); None when a path or the nodes of a grid decide them.
    targets : ndarray or None
        Poses asked of the output, shape (configuration, component), nan where nothing is asked.
    target_components : tuple of str
        The components that are asked.
    """

    names: tuple[str, ...]
    joints: tuple[int, ...]
    factors: NDArray[np.float64]
    values: NDArray[np.float64] | None
    targets: NDArray[np.float64] | None
    target_components: tuple[str, ...]


def coordinate_factor(graph: Graph, joint: CompiledJoint) -> float:
    """SI per file unit of a joint's coordinate."""
    return graph.units.angle if joint.is_angular else graph.units.length


def compile_drives(data: MechanismFile, graph: Graph) -> Commands:
    """Check the drives against the joints and bring them to SI."""
    joints: list[int] = []
    for name, drive in data.drives.items():
        index = graph.joint_index(drive.joint, f"drives.{name}.joint")
        if not graph.joints[index].can_be_driven:
            free = listed(j.name for j in graph.joints if j.can_be_driven)
            kind = graph.joints[index].kind
            problem = f"'{drive.joint}' is a {kind} joint and has no coordinate to drive; joints that have one: {free}"
            raise graph.refuse(problem, f"drives.{name}.joint")
        if index in joints:
            other = list(data.drives)[joints.index(index)]
            raise graph.refuse(f"'{drive.joint}' is already driven by '{other}'", f"drives.{name}.joint")
        joints.append(index)
    factors = np.array([coordinate_factor(graph, graph.joints[j]) for j in joints], dtype=np.float64)
    # With a grid drives may be left without values; then there is nothing but a map to ask for.
    mapped_only = data.grid is not None and not all(drive.is_commanded for drive in data.drives.values())
    values = None if data.path is not None or mapped_only else _values(data, graph) * factors
    targets, asked = _targets(data, graph)
    return Commands(tuple(data.drives), tuple(joints), factors, values, targets, asked)


def _values(data: MechanismFile, graph: Graph) -> NDArray[np.float64]:
    """Drive values in file units, value by value; a single value is repeated."""
    commands = {name: drive.commands for name, drive in data.drives.items()}
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
    columns = [np.broadcast_to(np.array(values, dtype=np.float64), (count,)) for values in commands.values()]
    return np.stack(columns, axis=1) if columns else np.zeros((count, 0))


def _check_ranges(data: MechanismFile, graph: Graph, commands: dict[str, tuple[float, ...]]) -> None:
    for name, (low, high) in data.limits.drives.items():
        for k, value in enumerate(commands.get(name, ())):
            if not low <= value <= high:
                key = f"drives.{name}.values.{k}" if data.drives[name].values is not None else f"drives.{name}"
                problem = f"{value:g} is outside limits.drives.{name} = {shown([low, high])}"
                raise graph.refuse(problem, key)


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
