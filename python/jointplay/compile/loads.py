"""The output point, and the loads with their points."""

from __future__ import annotations

from typing import Any

from jointplay.schema import MechanismFile

from .graph import GROUND, Graph


def output_point(data: MechanismFile, graph: Graph) -> int:
    """Index of the output point."""
    output = data.output
    if output.body == GROUND:
        raise graph.refuse(f"'{GROUND}' does not move; the output is on a moving body", "output.body")
    return _point(graph, output.body, output.at, "output")


def _point(graph: Graph, body: str, at: tuple[float, float] | str, key: str) -> int:
    index = graph.body_index(body, f"{key}.body")
    if isinstance(at, str):
        return graph.joint_point(body, at, f"{key}.at")
    return graph.add_point(index, at)


def compile_loads(data: MechanismFile, graph: Graph, output: int) -> list[dict[str, Any]]:
    """Loads and weights as the core wants them, in SI and ground axes."""
    loads: list[dict[str, Any]] = []
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
            point = _point(graph, body, (0.0, 0.0), key)
        fx, fy = load.force or (0.0, 0.0)
        loads.append(_load(point, fx * graph.units.force, fy * graph.units.force, load.moment * graph.units.moment))
    return loads + _weights(data, graph)


def _weights(data: MechanismFile, graph: Graph) -> list[dict[str, Any]]:
    gx, gy = data.gravity
    if not (gx or gy):
        return []
    heavy = {name: body for name, body in data.bodies.items() if body.mass > 0.0}
    if not heavy:
        raise graph.refuse("no body has a mass: [bodies.NAME] with mass in kg and centre", "gravity")
    return [
        _load(graph.add_point(graph.bodies.index(name), body.centre), body.mass * gx, body.mass * gy, 0.0)
        for name, body in heavy.items()
    ]


def _load(point: int, fx: float, fy: float, moment: float) -> dict[str, Any]:
    return {"point": point, "force": [fx, fy, 0.0], "moment": [0.0, 0.0, moment]}
