"""Springs between points, and about joints."""

from jointplay.core.spec import SpringSpec, TorsionSpec
from jointplay.file.schema import MechanismFile

from .drives import Commands
from .graph import Graph
from .loads import place

#: a torsion spring is deflected by less than half a turn
HALF_TURN = 3.141592653589793


def compile_springs(
    data: MechanismFile, graph: Graph, commands: Commands
) -> tuple[list[SpringSpec], list[TorsionSpec]]:
    """Springs and torsion springs as the core wants them, in SI; each in the order of the file."""
    springs: list[SpringSpec] = []
    torsions: list[TorsionSpec] = []
    units = graph.units
    for name, spring in data.springs.items():
        key = f"springs.{name}"
        if spring.on is None:
            torsions.append(_torsion(data, graph, commands, name))
            continue
        first, second = (
            place(graph, body, at, f"{key}.on", f"{key}.on.{body}")  # type: ignore[arg-type]
            for body, at in spring.on.items()
        )
        springs.append(
            {
                "first": first,
                "second": second,
                "stiffness": spring.stiffness * units.stiffness,
                "free_length": (spring.free_length or 0.0) * units.length,
                "preload": spring.preload * units.force,
            }
        )
    return springs, torsions


def _torsion(data: MechanismFile, graph: Graph, commands: Commands, name: str) -> TorsionSpec:
    spring, units, key = data.springs[name], graph.units, f"springs.{name}"
    joint = graph.joint_index(spring.joint or "", f"{key}.joint")
    if not graph.joints[joint].is_angular:
        kind = graph.joints[joint].kind
        problem = f"'{spring.joint}' is a {kind} joint; a torsion spring is on a joint whose coordinate is an angle"
        raise graph.refuse(problem, f"{key}.joint")
    free = (spring.free_angle or 0.0) * units.angle
    for k, moves in enumerate(commands.moves if commands.values is not None else ()):
        for driven, coefficient in moves:
            off = abs(coefficient * commands.values[:, k] - free).max() if driven == joint else 0.0  # type: ignore[index]
            if off >= HALF_TURN:
                problem = (
                    f"drive '{commands.names[k]}' takes '{spring.joint}' {off / units.angle:.6g} {units.angle_name}"
                    " away from it; half a turn is too far: give an angle nearby, and the moment there as preload"
                )
                raise graph.refuse(problem, f"{key}.free_angle")
    return {
        "joint": joint,
        "stiffness": spring.stiffness * units.turning_stiffness,
        "free_angle": free,
        "preload": spring.preload * units.moment,
    }
