"""The output and its point, and the loads with their points: those of the file, weights, and what inertia does.

The force of a mass m whose centre has the acceleration a is m (g - a), and the moment about it -(I w' + w x I w).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.basics.units import Units
from jointplay.core.spec import LoadSpec, OutputSpec
from jointplay.errors import listed, not_known
from jointplay.file.schema import BodyTable, LoadTable, MechanismFile, OutputTable, along_the_path

from .drives import Commands
from .frames import vector
from .graph import GROUND, ORIGIN, Graph

RELATIVE = "output.relative_to"
#: axes of the loaded body itself
BODY = "body"


@dataclass(frozen=True)
class Inertial:
    """A body that its inertia loads while it moves."""

    #: its name
    body: str
    #: the number of its weight among the loads, at its centre of mass, to which the forces of inertia are added
    load: int
    mass: float
    #: of its moments of inertia about the centre, body axes
    matrix: Floats


@dataclass
class Loads:
    """Loads and weights, and what inertia loads."""

    #: those of the first configuration, as the core wants them
    first: list[LoadSpec] = field(default_factory=list)
    #: loads of all configurations by the number of the load; of those that change along the path
    along: dict[int, list[LoadSpec]] = field(default_factory=dict)
    #: what inertia loads while the drives move; nothing where they are at rest
    inertial: list[Inertial] = field(default_factory=list)

    @property
    def vary(self) -> bool:
        """Whether they are others from configuration to configuration."""
        return bool(self.along or self.inertial)

    def at(self, configuration: int) -> list[LoadSpec]:
        """Those of a configuration."""
        return [self.along[k][configuration] if k in self.along else load for k, load in enumerate(self.first)]

    @property
    def are_any(self) -> bool:
        """Whether any force or moment acts."""
        if self.inertial:
            return True
        every = [*self.first, *(load for loads in self.along.values() for load in loads)]
        return any(any(load["force"]) or any(load["moment"]) for load in every)

    def take_axes(self, data: MechanismFile, graph: Graph) -> None:
        """Bind followers to their bodies, once elastic ones are in pieces."""
        for k, table in enumerate(data.loads):
            if table.axes in (None, GROUND):
                continue
            of_own = table.axes == BODY
            body = graph.points[self.first[k]["point"]].body if of_own else graph.bodies.index(table.axes or "")
            for load in (self.first[k], *self.along.get(k, ())):
                load["axes"] = body


def compile_output(output: OutputTable, graph: Graph) -> OutputSpec:
    """The output as the core wants it."""
    if output.body == GROUND:
        raise graph.refuse(f"'{GROUND}' does not move; the output is on a moving body", "output.body")
    told: OutputSpec = {"point": place(graph, output.body, output.at, "output.body", "output.at")}
    if output.relative_to is not None:
        if output.relative_to == GROUND:
            raise graph.refuse(f"'{GROUND}' is what an output is measured against if this is left out", RELATIVE)
        if output.relative_to == output.body:
            problem = f"'{output.body}' carries the output itself and sees no error of it; name another body"
            raise graph.refuse(problem, RELATIVE)
        told["relative_to"] = graph.body_index(output.relative_to, RELATIVE)
    return told


def places_of_outputs(data: MechanismFile, graph: Graph, output: int) -> dict[str, tuple[str, int]]:
    """What dimensions may call an output: body and point by name. The points of others exist where a dimension ends."""
    if not data.outputs:
        return {"output": (data.output.body, output)} if data.output else {}
    joints = {joint.pin for joint in graph.joints} | {joint.name for joint in graph.joints}
    for name in data.outputs:
        if name in joints or name in ("output", GROUND):
            what = "the name of a joint" if name in joints else "a word with a meaning of its own in the file"
            raise graph.refuse(f"'{name}' is {what}; give the output another one", f"outputs.{name}")
    ends = {end for dimension in data.dimensions.values() for end in dimension.between}
    found = {}
    for name, other in data.outputs.items():
        if other is data.output:
            found[name] = (other.body, output)
        elif name in ends:
            found[name] = (other.body, place(graph, other.body, other.at, f"outputs.{name}.body", f"outputs.{name}.at"))
    for name, dimension in data.dimensions.items():
        if "output" in dimension.between:
            problem = f"which of the outputs is meant? Name one of {listed(data.outputs)}"
            raise graph.refuse(problem, f"dimensions.{name}.between")
    return found


def place(graph: Graph, body: str, at: Sequence[float] | str, body_key: str, key: str) -> int:
    """Index of a point that the file gives by its coordinates or by a joint."""
    index = graph.body_index(body, body_key)
    if isinstance(at, str):
        return graph.joint_point(body, at, key)
    return graph.add_point(index, tuple(at))


def compile_loads(data: MechanismFile, graph: Graph, commands: Commands, output: int) -> Loads:
    """Loads and weights as the core wants them, in SI."""
    assert data.output is not None
    loads = Loads()
    for k, load in enumerate(data.loads):
        key = f"loads.{k}"
        if data.outputs and load.body is None:
            # Left out it would be another one with every output.
            raise graph.refuse(f"'body' is missing (the loaded body; the outputs are {listed(data.outputs)})", key)
        body = load.body or data.output.body
        if body == GROUND:
            raise graph.refuse(f"'{GROUND}' does not move; a load acts on a moving body", f"{key}.body")
        if load.axes not in (None, GROUND, BODY, *graph.bodies):
            raise graph.refuse(not_known(str(load.axes), "axes", [GROUND, BODY, *graph.bodies]), f"{key}.axes")
        if load.at is not None:
            point = place(graph, body, load.at, f"{key}.body", f"{key}.at")
        elif body == data.output.body and not data.outputs:
            point = output
        else:
            point = place(graph, body, ORIGIN, f"{key}.body", f"{key}.at")
        given = {name: _along(data, graph, commands, load, name, key) for name in ("force", "moment")}
        count = max(map(len, given.values()))
        forces, moments = (values * count if len(values) == 1 else values for values in given.values())
        every = [_wrench(force, moment, graph.units, point) for force, moment in zip(forces, moments, strict=True)]
        loads.first.append(every[0])
        if count > 1:
            loads.along[k] = every
    _add_weights(data, graph, commands, loads)
    return loads


def _along(
    data: MechanismFile, graph: Graph, commands: Commands, load: LoadTable, name: str, key: str
) -> list[tuple[float, ...]]:
    """The vectors of a force or moment: a single one, or as many as there are configurations."""
    value = getattr(load, name)
    is_vector = name == "force" or data.space == "spatial"
    along = along_the_path(value, is_vector)
    if along is None:
        return [tuple(value) if isinstance(value, tuple) else () if value is None else (value,)]
    key = f"{key}.{name}"
    if data.grid is not None:
        raise graph.refuse("a list has a value per configuration; with a [grid] there is one for all nodes", key)
    targets = commands.values if commands.values is not None else commands.targets
    count = 0 if targets is None else len(targets)
    if len(along) != count:
        configurations = f"{count} configuration{'s' * (count != 1)}"
        raise graph.refuse(f"{len(along)} values for {configurations}; one for each is needed, or one for all", key)
    return [tuple(one) if is_vector else (one,) for one in along]


def _wrench(force: tuple[float, ...], moment: tuple[float, ...], units: Units, point: int) -> LoadSpec:
    # A moment in the plane is about the axis that points out of it.
    about = moment if len(moment) != 1 else (0.0, 0.0, *moment)
    return {"point": point, "force": list(vector(force, units.force)), "moment": list(vector(about, units.moment))}


def _add_weights(data: MechanismFile, graph: Graph, commands: Commands, loads: Loads) -> None:
    """Add the weights; where drives move, also of bodies without one, whose inertia acts in their place."""
    heavy = {name: body for name, body in data.bodies.items() if body.mass > 0.0}
    if any(data.gravity) and not heavy:
        raise graph.refuse("no body has a mass: [bodies.NAME] with mass in kg and centre", "gravity")
    if commands.motion is not None:
        heavy = {name: body for name, body in data.bodies.items() if body.mass > 0.0 or body.rotational_inertia}
    elif not any(data.gravity):
        return
    for name, body in heavy.items():
        index = graph.bodies.index(name)
        if commands.motion is not None:
            matrix = inertia_matrix(body) * graph.units.length**2
            loads.inertial.append(Inertial(name, len(loads.first), body.mass, matrix))
        told: LoadSpec = {
            "point": graph.add_point(index, body.centre),
            "force": list(vector(data.gravity, body.mass)),
            "moment": [0.0, 0.0, 0.0],
        }
        loads.first.append(told)


def inertia_matrix(body: BodyTable) -> Floats:
    """Matrix of the moments of inertia of a body, in units of the file, about its centre of mass in body axes.

    In the plane there is that about the axis which points out of it.
    """
    given = body.rotational_inertia
    xx, yy, zz, xy, xz, yz = given if isinstance(given, tuple) else (0.0, 0.0, given or 0.0, 0.0, 0.0, 0.0)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
