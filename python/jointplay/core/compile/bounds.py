"""How large the numbers of a mechanism may be beside one another.

clearance, tolerance, deviation of a length <= size of the mechanism
                            of an angle  <= one turn; of an axis or a link <= a quarter of a turn
                            of an angle  <= one turn
                            of the temperature <= HOTTEST
lever arm                                <= LARGEST_RATIO x characteristic length

What is beyond is a slip of the keyboard. The motions of a mechanism are counted by singular values of its Jacobian, in
which a lever arm stands beside the characteristic length: beyond the ratio the shorter lengths are lost in rounding.
"""

import math

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.sets import furthest
from jointplay.file.schema import MechanismFile

from .drives import LENGTHS, Commands
from .graph import TURNS, Graph
from .source import CompiledSource

#: from a pin of ten micrometres to a boom of ten metres
LARGEST_RATIO = 1e6
TURN = 2.0 * math.pi
#: the most that an axis or a link may be off its direction, and sources that may be off by a whole turn
QUARTER = 0.25 * TURN
WHOLE_TURNS = ("angle", "drive", "backlash")
#: kelvin; no mechanism is as hot
HOTTEST = 5000.0


def check_sizes(
    data: MechanismFile, graph: Graph, guess: Floats, commands: Commands, sources: list[CompiledSource], length: float
) -> None:
    """Refuse numbers that make no sense beside the others.

    Raises
    ------
    InputError
        The message names the key, the value and the limit.
    """
    unit, name = graph.units.length, graph.units.length_name
    for joint in graph.joints:
        if joint.pin not in data.joints:
            continue  # between pieces of an elastic body, which lie between its joints
        arm = max(math.hypot(*graph.points[point].at) for point in (joint.first, joint.second))
        if arm > LARGEST_RATIO * length:
            problem = (
                f"lies {arm / unit:.4g} {name} from the origin of a body, more than {LARGEST_RATIO:.0e} times the"
                f" {length / unit:.4g} {name} that bodies measure here; lengths that differ so much cannot be compared"
            )
            raise graph.refuse(problem, f"joints.{joint.pin}")
    size = _size(graph, guess, commands)
    for source in sources:
        if source.kind == "thermal":
            _check_growth(graph, source)
            continue
        angular = _turns(source, commands, graph)
        limit = (TURN if source.kind in WHOLE_TURNS else QUARTER) if angular else size
        # What has no size itself has nothing to compare with.
        if limit > 0.0 and (off := _off(source)) > limit:
            factor = source.factors[0]
            what = (
                {TURN: "a full turn", QUARTER: "a quarter of a turn"}[limit] if angular else "the size of the mechanism"
            )
            word = graph.units.angle_name if angular else name
            problem = f"is off by up to {off / factor:.4g} {word}, more than {what}, {limit / factor:.4g} {word}"
            raise graph.refuse(problem, _key(data, graph, source))


def _check_growth(graph: Graph, source: CompiledSource) -> None:
    if (off := _off(source)) > HOTTEST:
        raise graph.refuse(f"is off by up to {off:.4g} K, more than {HOTTEST:g} K", "temperature")


def _off(source: CompiledSource) -> float:
    """The largest displacement that a source allows or has."""
    return max(furthest(source.size), *map(abs, source.centre))


def _size(graph: Graph, guess: Floats, commands: Commands) -> float:
    """The largest distance in the mechanism along an axis, in metres: of bodies, between them, or of a travel."""
    places: dict[int, list[tuple[float, ...]]] = {}
    for point in graph.points:
        places.setdefault(point.body, []).append(point.at)
    sizes = [max(max(at) - min(at) for at in zip(*body, strict=True)) for body in places.values()]
    # Wherever the mechanism is drawn.
    sizes.append(float(np.ptp(graph.placed(guess), axis=0).max()))
    if commands.values is not None:
        linear = [k for k, joint in enumerate(commands.joints) if not graph.joints[joint].is_angular]
        sizes.append(float(np.abs(commands.values[:, linear]).max(initial=0.0)))
    if commands.targets is not None:
        lengths = commands.targets[:, : len(LENGTHS)] if commands.targets.shape[1] > 3 else commands.targets[:, :2]
        known = lengths[np.isfinite(lengths).all(axis=1)]
        sizes.append(float(np.ptp(known, axis=0).max()) if len(known) else 0.0)
    return float(max(sizes))


def _turns(source: CompiledSource, commands: Commands, graph: Graph) -> bool:
    if "drive" in source.spec:
        return bool(graph.joints[source.spec.get("joint", commands.joints[source.spec["drive"]])].is_angular)
    return source.components[0] in TURNS


def _key(data: MechanismFile, graph: Graph, source: CompiledSource) -> str:
    if source.key:
        return source.key
    match source.kind:
        case "clearance" | "size":
            return f"joints.{graph.joints[source.spec['joint']].pin}.clearance"
        case "angle":
            return f"joints.{graph.joints[source.spec['joint']].pin}.angle"
        case "ratio":
            return f"joints.{graph.joints[source.spec['joint']].pin}.ratio_error"
        case "runout":
            return f"joints.{source.name}"
        case "drive":
            return f"drives.{list(data.drives)[source.spec['drive']]}.error"
        case _:
            return f"dimensions.{source.name}"
