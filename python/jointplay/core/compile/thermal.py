"""Thermal growth: a source that moves every point of the bodies that expand.

    point   p -> p (1 + alpha T)                                      body axes, about the origin of the body
    play    r -> r + (alpha_hole - alpha_pin) T diameter / 2

T is the difference from the temperature at which the lengths of the file hold. The error is against the mechanism
there, so that growth is a known deviation of the points; a tolerance of T scatters all of them together. Directions
stay what they are: a body that is warm all over keeps its shape.
"""

from dataclasses import dataclass

from jointplay.core.spec import GrowthSpec
from jointplay.errors import InputError
from jointplay.file.schema import Coupling, MechanismFile, RadialClearance

from .graph import GROUND, GROUND_INDEX, Graph


@dataclass(frozen=True)
class Growth:
    """What the bodies do by a kelvin."""

    #: how far the temperature is from the one of the file, in kelvin
    difference: float
    #: whether it has a tolerance
    scatters: bool
    #: coefficient of thermal expansion by index of the body, ground among them
    coefficients: dict[int, float]

    def moves(self, graph: Graph) -> list[GrowthSpec]:
        """How far every point goes by a kelvin, in the axes of its body."""
        rates = [(k, point.at, self.coefficients[point.body]) for k, point in enumerate(graph.points)]
        return [{"point": k, "rate": [alpha * x for x in at]} for k, at, alpha in rates if alpha and any(at)]

    def of_play(self, data: MechanismFile, graph: Graph, index: int) -> float:
        """By how much the radius of a joint's play grows, in metres; the hole is on its second body.

        Raises
        ------
        InputError
            When the growth scatters.
        """
        joint = graph.joints[index]
        play = getattr(data.joints[joint.pin], "clearance", None)
        if not isinstance(play, RadialClearance):
            return 0.0
        diameter = play.diameter if play.hole is None else play.hole.diameter
        if diameter is None:
            return 0.0
        pin, hole = (self.coefficients[graph.points[end].body] for end in (joint.first, joint.second))
        if self.scatters and pin != hole:
            problem = (
                "the clearance changes with a temperature that has a tolerance; leave out the tolerance and sweep"
                " temperature, or give the clearance at the middle temperature without diameter"
            )
            raise graph.refuse(problem, f"joints.{joint.pin}.clearance")
        return (hole - pin) * self.difference * diameter / 2.0 * graph.units.length

    def too_tight(self, graph: Graph, index: int, radius: float) -> InputError:
        """The error for a pin that has become larger than its hole."""
        unit = graph.units
        problem = (
            f"at {self.difference:+g} K the pin has become larger than its hole: radial clearance"
            f" {radius / unit.length:.4g} {unit.length_name}"
        )
        return graph.refuse(problem, f"joints.{graph.joints[index].pin}.clearance")


def growth(data: MechanismFile, graph: Graph, owners: tuple[int, ...]) -> Growth | None:
    """What temperature does; None where the file has none. `owners` are the bodies of further pieces of elastic ones.

    Raises
    ------
    InputError
        When no body has a coefficient, or wheels would have to grow.
    """
    if data.temperature is None:
        return None
    own = {name: body.expansion for name, body in data.bodies.items() if body.expansion is not None}
    if data.expansion is None and not own:
        problem = "no body expands: expansion = 12e-6 (1/K) for all of them, or one in [bodies.NAME]"
        raise graph.refuse(problem, "temperature")
    general = data.expansion or 0.0
    of = [own.get(name, general) for name in graph.bodies]
    coefficients = {GROUND_INDEX: own.get(GROUND, general), **dict(enumerate([*of, *(of[body] for body in owners)]))}
    for joint in graph.joints:
        bodies = [graph.points[end].body for end in (joint.first, joint.second)]
        if isinstance(data.joints.get(joint.pin), Coupling) and any(coefficients[body] for body in bodies):
            name = next(graph.bodies[b] if b != GROUND_INDEX else GROUND for b in bodies if coefficients[b])
            problem = f"the thermal growth of wheels and threads is not computed; '{name}' needs expansion = 0"
            raise graph.refuse(problem, f"joints.{joint.pin}")
    return Growth(data.temperature.deviation, data.temperature.tolerance is not None, coefficients)
