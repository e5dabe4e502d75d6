"""The output and its point, and the loads with their points."""

from __future__ import annotations

from collections.abc import Sequence

from jointplay.errors import listed
from jointplay.schema import LoadTable, MechanismFile, OutputTable
from jointplay.spec import LoadSpec, OutputSpec
from jointplay.units import Units

from .frames import vector
from .graph import GROUND, ORIGIN, Graph

RELATIVE = "output.relative_to"


def compile_output(output: OutputTable, graph: Graph) -> OutputSpec:
    """The output as the core wants it."""
    if output.body == GROUND:
        raise graph.refuse(f"'{GROUND}' does not move; the output is on a moving body", "output.body")
    told: OutputSpec = {"point": _point(graph, output.body, output.at, "output")}
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
    ends = {place for dimension in data.dimensions.values() for place in dimension.between}
    found = {}
    for name, other in data.outputs.items():
        if other is data.output:
            found[name] = (other.body, output)
        elif name in ends:
            found[name] = (other.body, _point(graph, other.body, other.at, f"outputs.{name}"))
    for name, dimension in data.dimensions.items():
        if "output" in dimension.between:
            problem = f"which of the outputs is meant? Name one of {listed(data.outputs)}"
            raise graph.refuse(problem, f"dimensions.{name}.between")
    return found


def _point(graph: Graph, body: str, at: Sequence[float] | str, key: str) -> int:
    index = graph.body_index(body, f"{key}.body")
    if isinstance(at, str):
        return graph.joint_point(body, at, f"{key}.at")
    return graph.add_point(index, tuple(at))


def compile_loads(data: MechanismFile, graph: Graph, output: int) -> list[LoadSpec]:
    """Loads and weights as the core wants them, in SI and ground axes."""
    assert data.output is not None
    loads: list[LoadSpec] = []
    for k, load in enumerate(data.loads):
        key = f"loads.{k}"
        if data.outputs and load.body is None:
            # Left out it would be another one with every output.
            raise graph.refuse(f"'body' is missing (the loaded body; the outputs are {listed(data.outputs)})", key)
        body = load.body or data.output.body
        if body == GROUND:
            raise graph.refuse(f"'{GROUND}' does not move; a load acts on a moving body", f"{key}.body")
        if load.at is not None:
            point = _point(graph, body, load.at, key)
        elif body == data.output.body and not data.outputs:
            point = output
        else:
            point = _point(graph, body, ORIGIN, key)
        loads.append(_wrench(load, graph.units, point))
    return loads + _weights(data, graph)


def _wrench(load: LoadTable, units: Units, point: int) -> LoadSpec:
    force = vector(load.force or (), units.force)
    # A moment in the plane is about the axis that points out of it.
    about = load.moment if isinstance(load.moment, tuple) else (0.0, 0.0, load.moment)
    return {"point": point, "force": list(force), "moment": list(vector(about, units.moment))}


def _weights(data: MechanismFile, graph: Graph) -> list[LoadSpec]:
    if not any(data.gravity):
        return []
    heavy = {name: body for name, body in data.bodies.items() if body.mass > 0.0}
    if not heavy:
        raise graph.refuse("no body has a mass: [bodies.NAME] with mass in kg and centre", "gravity")
    return [
        {
            "point": graph.add_point(graph.bodies.index(name), body.centre),
            "force": list(vector(data.gravity, body.mass)),
            "moment": [0.0, 0.0, 0.0],
        }
        for name, body in heavy.items()
    ]
