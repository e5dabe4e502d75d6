"""The output point, and the loads with their points."""

from __future__ import annotations

from collections.abc import Sequence

from jointplay.schema import LoadTable, MechanismFile
from jointplay.spec import LoadSpec
from jointplay.units import Units

from .frames import vector
from .graph import GROUND, ORIGIN, Graph


def output_point(data: MechanismFile, graph: Graph) -> int:
    """Index of the output point."""
    output = data.output
    if output.body == GROUND:
        raise graph.refuse(f"'{GROUND}' does not move; the output is on a moving body", "output.body")
    return _point(graph, output.body, output.at, "output")


def _point(graph: Graph, body: str, at: Sequence[float] | str, key: str) -> int:
    index = graph.body_index(body, f"{key}.body")
    if isinstance(at, str):
        return graph.joint_point(body, at, f"{key}.at")
    return graph.add_point(index, tuple(at))


def compile_loads(data: MechanismFile, graph: Graph, output: int) -> list[LoadSpec]:
    """Loads and weights as the core wants them, in SI and ground axes."""
    loads: list[LoadSpec] = []
    for k, load in enumerate(data.loads):
        key = f"loads.{k}"
        body = load.body or data.output.body
        if body == GROUND:
            raise graph.refuse(f"'{GROUND}' does not move; a load acts on a moving body", f"{key}.body")
        if load.at is not None:
            point = _point(graph, body, load.at, key)
        elif body == data.output.body:
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
