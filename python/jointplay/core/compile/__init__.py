"""From the data of a file to the numbers of a mechanism: indices, SI units and radians.

Everything that one part of the file says about another is checked here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats
from jointplay.basics.units import Units
from jointplay.core.sets import SETS, SHIFTS_ACROSS, TILTS
from jointplay.core.spec import ENDS, CouplingSpec, DriveSpec, FollowerSpec, JointSpec, LoadSpec, Spec, SpringSpec
from jointplay.errors import InputError, not_known
from jointplay.file.schema import Bounds, MechanismFile, PlanarFile, SpatialFile

from .assembly import AssemblyOrder, compile_assembly
from .bounds import LARGEST_RATIO, check_sizes
from .coordinates import RelativePose, coordinate, on_body, relative
from .correlations import compile_correlations
from .costs import check_costs
from .couplings import compile_couplings
from .drives import COMPONENTS, LENGTHS, Commands, Moves, compile_drives, compliance_of, coordinate_factor
from .followers import add_followers, compile_followers
from .graph import ANGULAR, DRIVABLE, TURNS, CompiledJoint, Graph, Point
from .grid import Grid, compile_grid
from .loads import Loads, compile_loads, compile_output, inertia_matrix, places_of_outputs
from .members import Member, split
from .motion import DriveMotion
from .sizes import described
from .source import LOOSE, CompiledSource
from .sources import compile_sources
from .spatial_start import spatial_start
from .spins import Spin, find_spins
from .springs import compile_springs
from .start import planar_start
from .target import Ideal, compile_target

__all__ = [
    "ANGULAR",
    "DRIVABLE",
    "FORCE_LIMITS",
    "LARGEST_RATIO",
    "LENGTHS",
    "LOOSE",
    "SHIFTS_ACROSS",
    "TILTS",
    "TURNS",
    "AssemblyOrder",
    "Compiled",
    "CompiledSource",
    "DriveMotion",
    "Grid",
    "Ideal",
    "Limits",
    "Loads",
    "Member",
    "Spin",
    "compile_file",
    "coordinate",
    "described",
    "inertia_matrix",
    "limit_key",
]

#: by the word in front of the name of a force, the key of `[limits]` that limits it
FORCE_LIMITS = {"drives": "drive_torques", "joints": "reactions"}
#: below this (metres) a mechanism has no size of its own
SMALLEST_LENGTH = 1e-12

T = TypeVar("T", bound=np.generic)
Interval = tuple[float, float]


@dataclass(frozen=True)
class Limits:
    """What is acceptable, in SI and radians."""

    #: lowest and highest acceptable value of the components of the error, of `position` and of `rotation`, infinite
    #: where one side has no limit; those without any are left out
    errors: Mapping[str, Interval]
    #: share of the specimens that must keep to the limits; nan where the file asks for none
    probability: float
    #: where clearances are in these specimens, ``scattered`` or ``loaded``; empty where the file does not say
    contact: str
    #: smallest acceptable singular value of the length-scaled Jacobian
    singular_value: float
    #: `drives`, `joints`: ranges (lowest, highest) by name
    drives: Mapping[str, Interval]
    joints: Mapping[str, Interval]
    #: lowest and highest acceptable moment or force of drives, by name
    drive_torques: Mapping[str, Interval]
    #: the same of the sizes of reaction forces, by joint; the lowest is infinite
    reactions: Mapping[str, Interval]

    def __reduce__(self) -> tuple[object, ...]:
        # Read-only views cannot be pickled.
        return (Limits, tuple(dict(v) if isinstance(v, Mapping) else v for v in vars(self).values()))

    def bounds(self, quantities: Sequence[str]) -> Floats:
        """Lowest and highest acceptable value of quantities, a row each."""
        free = (-math.inf, math.inf)
        return np.array([self.errors.get(name, free) for name in quantities])

    @property
    def forces(self) -> dict[str, Interval]:
        """Those of forces, as `forces` calls them."""
        every = {kind: getattr(self, key) for kind, key in FORCE_LIMITS.items()}
        return {f"{kind}.{name}": pair for kind, pairs in every.items() for name, pair in pairs.items()}


def limit_key(name: str) -> str:
    """Where the file limits a quantity of the error, or a force.

    Examples
    --------
    >>> limit_key("position"), limit_key("drives.theta")
    ('limits.position', 'limits.drive_torques.theta')
    """
    kind, _, of = name.partition(".")
    return f"limits.{FORCE_LIMITS[kind]}.{of}" if of else f"limits.{name}"


@dataclass(frozen=True, eq=False, repr=False)
class Compiled:
    """A mechanism in numbers. SI and radians, except where a factor says how to get there."""

    #: name for messages
    file: str
    #: the checked file
    data: MechanismFile
    #: units of the file
    units: Units
    #: `bodies`, `joints`: names; a pin with several riders counts as several joints, ``PIN/RIDER``. An elastic body has
    #: a further piece, ``BODY.JOINT``, for everything that sits along it, and a joint, ``BODY.FROM-TO``, between
    #: neighbours.
    bodies: tuple[str, ...]
    #: the body of the file that each of the bodies is, or is a piece of
    owners: tuple[str, ...]
    #: indices of the bodies that are crosses of universal joints
    crosses: frozenset[int]
    #: the elastic parts of bodies, and which joint gives as they do
    members: tuple[Member, ...]
    #: turns of bodies about a line that move nothing of interest, held unless a load turns them
    spins: tuple[Spin, ...]
    joints: tuple[str, ...]
    #: type of each joint
    joint_kinds: tuple[str, ...]
    #: poses of all bodies at the start
    guess: Floats
    #: all points of bodies that something refers to; the ground is body -1
    points: tuple[Point, ...]
    #: the points of every joint on its first and on its second body
    joint_points: tuple[tuple[int, int], ...]
    #: the point whose error is asked
    output_point: int
    #: the body against which the output is measured; None if it is the ground
    seen_from: int | None
    #: names of what can be off
    sources: tuple[str, ...]
    #: ``clearance``, ``size``, ``angle``, ``ratio``, ``runout``, ``position``, ``direction``, ``dimension``, ``link``,
    #: ``drive``, ``backlash`` or ``thermal``
    source_kinds: tuple[str, ...]
    #: the sources in numbers
    compiled_sources: tuple[CompiledSource, ...]
    #: names of the drives
    drives: tuple[str, ...]
    #: index of the joint that each drive commands, of a motor that moves several the first
    drive_joints: tuple[int, ...]
    #: of every drive all joints that it moves, each with its coefficient: coordinate over value of the drive, SI
    drive_moves: tuple[Moves, ...]
    #: label of every entry of the vector u of all offsets, such as ``J1.x``
    parameters: tuple[str, ...]
    #: SI per file unit of every entry of u
    parameter_factors: Floats
    #: source of every entry of u
    parameter_source: NDArray[np.int64]
    #: known deviations: where u is when nothing is off
    centre: Floats
    #: components of a pose
    components: tuple[str, ...]
    #: SI per file unit of the components of a pose
    component_factors: Floats
    #: how many numbers a body's pose has in the core: in space it has a quaternion
    pose_size: int
    #: SI per file unit of every drive
    drive_factors: Floats
    #: commanded values, shape (configuration, drive); None when a path is followed
    drive_values: Floats | None
    #: speeds and accelerations of the drives; None where every drive is at rest
    motion: DriveMotion | None
    #: of every drive, reduced to its value: kg m^2, or kg where the value is a length
    rotor_inertia: Floats
    #: drive values at the start guess, from which a path is approached
    start_drives: Floats
    #: output poses asked by a path, shape (configuration, component), nan where nothing is asked
    targets: Floats | None
    #: components that the path asks for
    target_components: tuple[str, ...]
    #: what is mapped
    grid: Grid | None
    #: what is acceptable
    limits: Limits
    #: what the output ought to do
    ideal: Ideal | None
    #: in which order it is assembled
    assembly: AssemblyOrder | None
    #: what acts in each configuration
    loads: Loads
    #: whether any force, moment or spring acts
    has_loads: bool
    #: characteristic length, by which angles and lengths are compared; never zero
    length: float
    #: the mechanism as the core reads it
    core_spec: Spec

    @property
    def quantities(self) -> tuple[str, ...]:
        """The components of an error, then its two sizes."""
        return (*self.components, "position", "rotation")

    @cached_property
    def joint_bodies(self) -> tuple[tuple[int, int], ...]:
        """The first and the second body of every joint; the ground is -1."""
        return tuple((self.points[first].body, self.points[second].body) for first, second in self.joint_points)

    @property
    def round_plays(self) -> list[tuple[int, int, float]]:
        """Source, joint and radius of the clearances that are the same in every direction."""
        own = [(k, source) for k, source in enumerate(self.compiled_sources) if source.kind == "clearance"]
        return [(k, one.spec["joint"], one.size["radius"]) for k, one in own if SETS[one.shape].is_round]

    @cached_property
    def sizes_of_joints(self) -> dict[int, list[tuple[int, float]]]:
        """Of every joint the sizes that make its clearance: the parameter of each, and its factor."""
        found: dict[int, list[tuple[int, float]]] = {}
        first = np.unique(self.parameter_source, return_index=True)[1].tolist()
        for k, source in enumerate(self.compiled_sources):
            for part in (source.spec, *source.spec.get("also", ())) if source.kind == "size" else ():
                found.setdefault(part["joint"], []).append((first[k], float(part["factor"])))
        return found

    def compliance(self, joint: int) -> Floats | None:
        """Displacement per force of the directions that a joint holds, SI; None where it is rigid."""
        given = self.core_spec["joints"][joint].get("compliance")
        size = math.isqrt(len(given or ()))
        return None if given is None else np.reshape(given, (size, size))

    def gives_way(self, drive: int) -> tuple[bool, ...]:
        """Whether a drive winds up towards each of the joints that it moves."""
        size = len(self.drive_moves[drive])
        compliance = self.core_spec["drives"][drive].get("compliance", [0.0] * size**2)
        return tuple(c > 0.0 for c in compliance[:: size + 1])

    @property
    def correlated(self) -> list[list[int]]:
        """Sources that scatter together, by index."""
        return [sorted(entry["sources"]) for entry in self.core_spec["correlations"]]

    @property
    def springs(self) -> list[SpringSpec]:
        """The springs between two points."""
        return self.core_spec["springs"]

    def coordinate(self, joint: int, poses: Floats) -> Floats:
        """Coordinate of a joint at poses of all bodies, SI.

        Parameters
        ----------
        poses : ndarray
            Shape (..., body, pose).
        """
        return coordinate(self.core_spec, joint, poses)

    def relative(self, joint: int, poses: Floats) -> RelativePose:
        """How the second body of a joint is seen from the first, SI.

        Parameters
        ----------
        poses : ndarray
            Shape (..., body, pose).
        """
        return relative(self.core_spec, joint, poses)

    def on_body(self, point: int, u: Floats) -> Floats:
        """Where a point is on its body, body axes; shape (specimen, axis).

        Parameters
        ----------
        u : ndarray
            All parameters, shape (specimen, parameter).
        """
        return on_body(self.core_spec, point, u)

    def coordinate_kind(self, joint: int) -> str:
        """Whether the coordinate of a joint is an ``angle`` or a ``length``."""
        follows = self.core_spec["joints"][joint].get("follows")
        own = joint if follows is None else follows["of"]
        return "angle" if self.joint_kinds[own] in ANGULAR else "length"

    def driven_joint(self, source: int) -> int:
        """The joint in which a source of a drive shows."""
        own = self.compiled_sources[source].spec
        return own["joint"] if "joint" in own else self.drive_joints[own["drive"]]


def compile_file(data: MechanismFile, file: str, output: str = "", load_case: str = "") -> Compiled:
    """Compile the checked data of a file.

    Parameters
    ----------
    data : MechanismFile
        The data.
    file : str
        Name of the file, for messages.
    output, load_case : str
        Which of several outputs and of the load cases it is about; empty where the file has none, and without a load
        case only the loads of every case act.

    Raises
    ------
    InputError
        When a name means nothing, bodies are not connected, or parts of the file contradict each other.
    """
    # What stands in the place of [output] and at the end of [[loads]] has another key in the file.
    common = len(data.loads)

    def key_of_load(number: int) -> str:
        of_case = load_case and number >= common
        return f"load_cases.{load_case}.{number - common}" if of_case else f"loads.{number}"

    try:
        return _compiled(data.only(output, load_case), file, key_of_load)
    except InputError as error:
        head, *rest = error.key.split(".")
        if output and head in ("output", "target"):
            own = [head] if head == "target" else []
            raise InputError(error.problem, file=file, key=".".join(["outputs", output, *own, *rest])) from None
        if head == "loads" and rest:
            key = ".".join([key_of_load(int(rest[0])), *rest[1:]])
            raise InputError(error.problem, file=file, key=key) from None
        raise


def _compiled(data: MechanismFile, file: str, key_of_load: Callable[[int], str]) -> Compiled:
    assert data.output is not None
    units = Units(data.units.length, data.units.angle, data.units.force, data.units.turning_speed or "")
    graph = Graph(data, units, file)
    add_followers(data, graph)
    commands = compile_drives(data, graph)
    output = compile_output(data.output, graph)
    outputs = places_of_outputs(data, graph, output["point"])
    loads = compile_loads(data, graph, commands, output["point"])
    springs, torsions = compile_springs(data, graph, commands)
    guess = _guess(data, graph, commands)
    length = _length(graph, guess)
    labels = {point: name for name, (_, point) in outputs.items()} | {output["point"]: "output"}
    pieces = split(data, graph, {**labels, **_loaded(data, loads, springs, output["point"])})
    loads.take_axes(data, graph)
    guess = pieces.guess(guess)
    asked = [data.output, *data.outputs.values()]
    watched = {name for each in asked for name in (each.body, each.relative_to)}
    acting = _acting(data, loads, springs, key_of_load)
    inertias = {
        graph.points[loads.first[one.load]["point"]].body: (f"bodies.{one.body}.rotational_inertia", one.matrix)
        for one in loads.inertial
    }
    outputs_of = {k for k, name in enumerate(graph.bodies) if name in watched}
    spins = find_spins(graph, guess, outputs_of, acting, inertias)
    held = {spin.joints[0]: spin for spin in spins if spin.load is None}
    couplings = compile_couplings(data, graph, guess)
    followers = compile_followers(data, graph, commands)
    sources = compile_sources(data, graph, commands, outputs, length, pieces.owners)
    check_sizes(data, graph, guess, commands, sources, length)
    check_costs(data, graph, sources)
    limits = _limits(data, graph, commands)
    components = COMPONENTS[data.space]
    component_factors = _fixed([units.length if c in LENGTHS else units.angle for c in components])
    spec: Spec = {
        "space": data.space,
        "n_bodies": len(guess),
        "guess": guess.tolist(),
        "length": length,
        "singular_value": limits.singular_value,
        "points": [{"body": p.body, "at": list(p.at)} for p in graph.points],
        "joints": [
            _joint_spec(joint, data.space, couplings.get(k), followers.get(k), held.get(k))
            for k, joint in enumerate(graph.joints)
        ],
        "drives": [
            _drive_spec(moves, compliance_of(graph, drive, moves))
            for moves, drive in zip(commands.moves, data.drives.values(), strict=True)
        ],
        "output": output,
        "loads": loads.first,
        "springs": springs,
        "torsions": torsions,
        "displacements": graph.displacements,
        "sources": [s.as_spec for s in sources],
        "correlations": compile_correlations(data, graph, sources),
    }
    return Compiled(
        file=file,
        data=data,
        units=units,
        bodies=(*graph.bodies, *pieces.bodies),
        owners=(*graph.bodies, *(graph.bodies[body] for body in pieces.owners)),
        crosses=frozenset(graph.crosses),
        members=pieces.members,
        spins=tuple(spins),
        joints=tuple(joint.name for joint in graph.joints),
        joint_kinds=tuple(joint.kind for joint in graph.joints),
        guess=_frozen(guess),
        points=tuple(graph.points),
        joint_points=tuple((joint.first, joint.second) for joint in graph.joints),
        output_point=output["point"],
        seen_from=output.get("relative_to"),
        sources=tuple(source.name for source in sources),
        source_kinds=tuple(source.kind for source in sources),
        compiled_sources=tuple(sources),
        drives=commands.names,
        drive_joints=commands.joints,
        drive_moves=commands.moves,
        parameters=tuple(f"{source.name}.{component}" for source in sources for component in source.components),
        parameter_factors=_fixed([factor for source in sources for factor in source.factors]),
        parameter_source=_frozen(
            np.array([k for k, source in enumerate(sources) for _ in source.components], dtype=np.int64)
        ),
        centre=_fixed([value for source in sources for value in source.centre]),
        components=components,
        component_factors=component_factors,
        pose_size=guess.shape[1],
        drive_factors=_frozen(commands.factors),
        drive_values=None if commands.values is None else _frozen(commands.values),
        motion=commands.motion,
        rotor_inertia=_fixed(
            [
                drive.rotor_inertia * (units.length**2 if graph.joints[joint].is_angular else 1.0)
                for drive, joint in zip(data.drives.values(), commands.joints, strict=True)
            ]
        ),
        start_drives=_fixed([float(coordinate(spec, moves[0][0], guess)) / moves[0][1] for moves in commands.moves]),
        targets=None if commands.targets is None else _frozen(commands.targets),
        target_components=commands.target_components,
        grid=compile_grid(data, commands, components, component_factors, file),
        limits=limits,
        ideal=compile_target(data, graph, commands, components),
        assembly=compile_assembly(data, graph),
        loads=loads,
        has_loads=loads.are_any or any(s["stiffness"] or s["preload"] for s in (*springs, *torsions)),
        length=length,
        core_spec=cast("Spec", MappingProxyType(spec)),
    )


def _loaded(data: MechanismFile, loads: Loads, springs: list[SpringSpec], output: int) -> dict[int, str]:
    """What the points are where loads and springs act, beside the output."""
    names = _of_loads(data, loads, "load{}".format, "centre")
    named = {load["point"]: name for load, name in zip(loads.first, names, strict=True)}
    ends = {spring[end]: name for name, spring in _named(data, springs) for end in ENDS}
    return {point: name for point, name in {**ends, **named}.items() if point != output}


def _acting(
    data: MechanismFile, loads: Loads, springs: list[SpringSpec], key_of_load: Callable[[int], str]
) -> list[tuple[str, LoadSpec]]:
    """What acts on the bodies in some configuration, by its key in the file; of springs and inertia any force."""
    keys = _of_loads(data, loads, key_of_load, "its weight")
    acting = [(key, load) for k, key in enumerate(keys) for load in loads.along.get(k, (loads.first[k],))]
    acting += [
        (f"bodies.{one.body}.centre", {**loads.first[one.load], "force": [1.0, 0.0, 0.0]})
        for one in loads.inertial
        if one.mass > 0.0
    ]
    for name, spring in _named(data, springs):
        acting += [
            (f"springs.{name}", {"point": spring[end], "force": [1.0, 0.0, 0.0], "moment": [0.0, 0.0, 0.0]})
            for end in ENDS
        ]
    return acting


def _of_loads(data: MechanismFile, loads: Loads, numbered: Callable[[int], str], weight: str) -> list[str]:
    """A word for every load by its number in the file, and for the weights that follow them."""
    given = len(data.loads)
    return [numbered(k) for k in range(given)] + [weight] * (len(loads.first) - given)


def _named(data: MechanismFile, springs: list[SpringSpec]) -> Iterator[tuple[str, SpringSpec]]:
    """The springs between points with their names."""
    return zip((name for name, spring in data.springs.items() if spring.on is not None), springs, strict=True)


def _length(graph: Graph, guess: Floats) -> float:
    """Characteristic length in metres: median size of the bodies, else how far points are apart, else a file unit."""
    largest = graph.span()
    if largest < SMALLEST_LENGTH:
        placed = graph.placed(guess)
        largest = float(np.linalg.norm(placed - placed[0], axis=1).max())
        # What rounding leaves far from the origin is no distance.
        largest = largest if largest > SMALLEST_LENGTH * float(np.abs(placed).max()) else 0.0
    return largest if largest >= SMALLEST_LENGTH else graph.units.length


def _guess(data: MechanismFile, graph: Graph, commands: Commands) -> Floats:
    if isinstance(data, SpatialFile):
        return spatial_start(data, graph, commands)
    assert isinstance(data, PlanarFile)
    return planar_start(data, graph, commands)


def _limits(data: MechanismFile, graph: Graph, commands: Commands) -> Limits:
    units, given = graph.units, data.limits
    for key in ("drives", "drive_torques"):
        for name in getattr(given, key):
            if name not in data.drives:
                raise graph.refuse(not_known(name, "a drive", data.drives), f"limits.{key}.{name}")

    def scaled(pair: Interval, joint: int) -> Interval:
        factor = coordinate_factor(graph, graph.joints[joint])
        return (pair[0] * factor, pair[1] * factor)

    errors: dict[str, Interval] = {}
    for name in given.words():
        limit, factor = getattr(given, name), units.length if name in (*LENGTHS, "position") else units.angle
        if isinstance(limit, Bounds):
            low, high = -math.inf if limit.low is None else limit.low, math.inf if limit.high is None else limit.high
            errors[name] = (low * factor, high * factor)
        elif limit is not None:
            errors[name] = (-math.inf, limit * factor)
    driven = dict(zip(data.drives, commands.joints, strict=True))
    joints = {name: graph.joint_index(name, f"limits.joints.{name}") for name in given.joints}
    for name, index in joints.items():
        if not graph.joints[index].can_be_driven:
            problem = f"'{name}' is a {graph.joints[index].kind} joint and has no coordinate to limit"
            raise graph.refuse(problem, f"limits.joints.{name}")
    for name in given.reactions:
        graph.joint_index(name, f"limits.reactions.{name}")

    def of_drive(name: str, pair: Interval) -> Interval:
        factor = units.moment if graph.joints[driven[name]].is_angular else units.force
        return (pair[0] * factor, pair[1] * factor)

    return Limits(
        errors=MappingProxyType(errors),
        probability=math.nan if given.probability is None else given.probability,
        contact=given.contact or "",
        singular_value=given.singular_value,
        drives=MappingProxyType({name: scaled(pair, driven[name]) for name, pair in given.drives.items()}),
        joints=MappingProxyType({name: scaled(pair, joints[name]) for name, pair in given.joints.items()}),
        drive_torques=MappingProxyType({name: of_drive(name, pair) for name, pair in given.drive_torques.items()}),
        reactions=MappingProxyType({name: (-math.inf, v * units.force) for name, v in given.reactions.items()}),
    )


def _drive_spec(moves: Moves, compliance: tuple[float, ...] | None) -> DriveSpec:
    (joint, coefficient), *others = moves
    told: DriveSpec = {"joint": joint}
    if coefficient != 1.0:
        told["coefficient"] = coefficient
    if others:
        told["also"] = [{"joint": k, "coefficient": c} for k, c in others]
    if compliance is not None:
        told["compliance"] = list(compliance)
    return told


def _joint_spec(
    joint: CompiledJoint,
    space: str,
    coupling: CouplingSpec | None,
    follows: FollowerSpec | None,
    spin: Spin | None,
) -> JointSpec:
    told: JointSpec = {
        "kind": joint.kind,
        "first": joint.first,
        "second": joint.second,
        "axis_first": list(joint.axis_first),
        "axis_second": list(joint.axis_second),
    }
    if space == "spatial":
        told["side_first"], told["side_second"] = list(joint.side_first), list(joint.side_second)
    if joint.compliance is not None:
        told["compliance"] = list(joint.compliance)
    if coupling is not None:
        told["coupling"] = coupling
    if follows is not None:
        told["follows"] = follows
    if spin is not None:
        (told["axis_first"], told["side_first"]), (told["axis_second"], told["side_second"]) = (
            (list(axis), list(side)) for axis, side in spin.frames
        )
        told["settled"] = True
        if joint.compliance is not None:
            # The row that holds the spin carries nothing, so that it cannot give.
            size = round(len(joint.compliance) ** 0.5)
            told["compliance"] = np.pad(np.reshape(joint.compliance, (size, size)), (0, 1)).ravel().tolist()
    return told


def _fixed(values: list[float]) -> Floats:
    return _frozen(np.array(values, dtype=np.float64))


def _frozen(array: NDArray[T]) -> NDArray[T]:
    array.flags.writeable = False
    return array
