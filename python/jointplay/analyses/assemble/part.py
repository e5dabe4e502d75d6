"""What is assembled so far, as a mechanism of its own on the base.

A part has the bodies that are there, the joints between any two of them, the drives of these joints, and the sources
and loads on them. The base is where it nominally is; the ground, when it is not the base, is a body like any other.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Unpack, cast

import numpy as np
from numpy.typing import NDArray

from jointplay import _core
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.compile import LENGTHS
from jointplay.core.spec import (
    AXIS_ON,
    ENDS,
    SIDE_ON,
    Changes,
    CorrelationSpec,
    DisplacementSpec,
    DriveSpec,
    GapSpec,
    GrowthSpec,
    JointSpec,
    LoadSpec,
    PointSpec,
    SourceSpec,
    Spec,
)
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism, in_core

GROUND = -1


def rigid(joint: JointSpec) -> JointSpec:
    """A joint without compliance."""
    own = joint.copy()
    own.pop("compliance", None)
    return own


@dataclass(frozen=True, eq=False)
class Part:
    """A mechanism cut out of another one."""

    #: the whole mechanism
    m: Mechanism
    #: the body that does not move; -1 is the ground
    base: int
    #: `bodies`, `points`, `joints`, `drives`, `sources`: what is there, by its index in the whole mechanism, in the
    #: order of the core; the base is not among the bodies
    bodies: tuple[int, ...]
    points: tuple[int, ...]
    joints: tuple[int, ...]
    drives: tuple[int, ...]
    sources: tuple[int, ...]
    #: index in the whole mechanism of every entry of the vector of offsets
    parameters: NDArray[np.int64]
    #: nominal poses of all bodies of the whole mechanism and, last, of the ground
    nominal: Floats
    #: the part as the core reads it. Its output is arbitrary, see `core`.
    spec: Spec

    @cached_property
    def driven(self) -> tuple[int, ...]:
        """Index of every joint that a drive commands, among the joints of the part."""
        return tuple(move["joint"] for drive in self.spec["drives"] for move in (drive, *drive.get("also", ())))

    @property
    def lengths(self) -> int:
        """Directions of the plane or of space."""
        return sum(component in LENGTHS for component in self.m.components)

    def core(self, output: int | None = None, **changes: Unpack[Changes]) -> _core.Mechanism:
        """The part in the compiled core, with one of its points as output and other changes of its specification."""
        point = self.spec["output"] if output is None else {"point": output}
        return in_core(cast("Spec", {**self.spec, "output": point, **changes}))

    def commands(self, core: _core.Mechanism, count: int) -> Floats:
        """Values of so many drives at which the nominal poses are."""
        return core.drive_values(self.poses[None], np.zeros(count))

    @property
    def poses(self) -> Floats:
        """Nominal poses of the bodies of the part, in the order of the core."""
        return np.ascontiguousarray(self.nominal[list(self.bodies)])


def cut(m: Mechanism, nominal: Floats, base: int, assembled: Iterable[int], *, attached: bool = True) -> Part:
    """The part of a mechanism that some of its bodies make.

    Parameters
    ----------
    nominal : ndarray
        Nominal poses of all bodies, SI, ground axes; shape (body, pose).
    base : int
        The body that does not move.
    assembled : iterable of int
        The bodies that are there, the base among them or not. The pieces of an elastic body come with it, the cross of
        a universal joint with the second of its bodies.
    attached : bool
        Whether the joints on the base count; if not, the part hangs on nothing.
    """
    spec = m.spec()
    there = _with_crosses(spec, _with_pieces(m, {*assembled, base}), m)
    bodies = tuple(sorted(there - {base}))
    index = {base: GROUND, **{body: k for k, body in enumerate(bodies)}}
    every = np.vstack([nominal, poses.ground(nominal.shape[-1])])  # the ground has index -1
    turn = poses.matrix(every[base])

    def body_of(point: int) -> int:
        return int(spec["points"][point]["body"])

    def placed(point: PointSpec) -> PointSpec:
        at = poses.place(every[base], point["at"]).tolist() if point["body"] == base != GROUND else point["at"]
        return {"body": index[point["body"]], "at": at}

    points = [k for k in range(len(spec["points"])) if body_of(k) in index]
    renumbered = {point: k for k, point in enumerate(points)}

    def renamed(joint: JointSpec) -> JointSpec:
        own = joint.copy()
        for end in ENDS:
            if body_of(joint[end]) == base != GROUND:
                for axis in (AXIS_ON[end], SIDE_ON[end]):
                    if axis in joint:
                        own[axis] = (turn @ joint[axis]).tolist()
            own[end] = renumbered[joint[end]]
        if "follows" in joint:
            law = joint["follows"]
            own["follows"] = law | {"of": joints.index(law["of"]), "leader": joints.index(law["leader"])}
        return own

    def turned(point: int, vectors: Sequence[Any]) -> list[Any]:
        # In the axes of the point's body, which for the base are those of the ground.
        ways = np.array(vectors) @ turn.T if body_of(point) == base != GROUND else np.array(vectors)
        return cast("list[Any]", ways.tolist())

    joined = index if attached else set(bodies)
    joints = [k for k, j in enumerate(spec["joints"]) if {body_of(j["first"]), body_of(j["second"])} <= set(joined)]
    # A coordinate whose leader comes later is free until then.
    joints = [k for k in joints if _is_led(spec["joints"][k], joints)]
    driving = [_drive(drive, joints) for drive in spec["drives"]]
    drives = [k for k, drive in enumerate(driving) if drive is not None]
    displacements = [k for k, one in enumerate(spec["displacements"]) if one["points"][0] in renumbered]

    def belongs(source: SourceSpec) -> bool:
        match source["kind"]:
            case "drive" | "backlash":
                return source["drive"] in drives and all(joint in joints for joint in _joints_of(source))
            case "dimension":
                return source["to"] in renumbered
            case "place":
                return source["displacement"] in displacements
            case "growth":
                return any(move["point"] in renumbered for move in source["moves"])
        return any(joint in joints for joint in _joints_of(source))

    def placed_displacement(one: DisplacementSpec) -> DisplacementSpec:
        at = placed({"body": body_of(one["points"][0]), "at": one["about"]})["at"]
        return {"points": [renumbered[point] for point in one["points"]], "about": at}

    def renamed_source(source: SourceSpec) -> SourceSpec:
        match source["kind"]:
            case "drive" | "backlash":
                moved = source | {"drive": drives.index(source["drive"])}
                return _on_joints(moved, joints) if "joint" in source else moved
            case "dimension":
                together = [renumbered[point] for point in source.get("together", ())]
                ends = {"from": renumbered[source["from"]], "to": renumbered[source["to"]]}
                return cast("SourceSpec", source | ends | {"together": together})
            case "place":
                number = source["displacement"]
                ways = turned(spec["displacements"][number]["points"][0], source["ways"])
                return source | {"displacement": displacements.index(number), "ways": ways}
            case "growth":
                moves = [
                    GrowthSpec(point=renumbered[move["point"]], rate=turned(move["point"], move["rate"]))
                    for move in source["moves"]
                    if move["point"] in renumbered
                ]
                return source | {"moves": moves}
        return _on_joints(source, joints)

    sources = [k for k, source in enumerate(spec["sources"]) if belongs(source)]
    own = spec | {
        "n_bodies": len(bodies),
        "guess": every[list(bodies)].tolist(),
        "points": [placed(spec["points"][k]) for k in points],
        "joints": [renamed(spec["joints"][k]) for k in joints],
        "drives": [drive for drive in driving if drive is not None],
        "displacements": [placed_displacement(spec["displacements"][k]) for k in displacements],
        "sources": [renamed_source(spec["sources"][k]) for k in sources],
        "correlations": [
            group for group in (_left(group, sources) for group in spec["correlations"]) if group["sources"]
        ],
        "loads": [
            _in_axes(load, every, index) | {"point": renumbered[load["point"]]}
            for load in spec["loads"]
            if body_of(load["point"]) in index and body_of(load["point"]) not in (base, GROUND)
        ],
        "springs": [
            spring | {"first": renumbered[spring["first"]], "second": renumbered[spring["second"]]}
            for spring in spec["springs"]
            if all(spring[end] in renumbered for end in ENDS)
        ],
        "torsions": [
            spring | {"joint": joints.index(spring["joint"])}
            for spring in spec["torsions"]
            if spring["joint"] in joints
        ],
        "output": {"point": renumbered.get(spec["output"]["point"], 0)},
    }
    parameters = np.flatnonzero(np.isin(m.parameter_source, sources))
    return Part(m, base, bodies, tuple(points), tuple(joints), tuple(drives), tuple(sources), parameters, every, own)


def require_unturned(m: Mechanism, nominal: Floats, base: int) -> None:
    """Refuse a base whose axes, which are those of the ground then, change an angle by which something else goes.

    In the plane a pin has no direction from which its angle counts, so that it counts from the axes of its bodies.
    """
    if base == GROUND or m.pose_size == poses.SPATIAL or not nominal[base, 2]:
        return
    spec = m.spec()
    pins = {
        k
        for k, joint in enumerate(spec["joints"])
        if joint["kind"] == "revolute" and base in [spec["points"][joint[end]]["body"] for end in ENDS]
    }
    by_drive = (move["joint"] for drive in spec["drives"] if "also" in drive for move in (drive, *drive["also"]))
    laws = (joint["follows"] for joint in spec["joints"] if "follows" in joint)
    by_law = (k for law in laws for k in (law["of"], law["leader"]))
    turned = sorted(pins & {*by_drive, *by_law, *(spring["joint"] for spring in spec["torsions"])})
    if turned:
        problem = (
            f"its angle in the drawing changes that of {m.joints[turned[0]]}, by which a drive of several joints,"
            ' a follower or a spring goes; take another base, such as "ground"'
        )
        raise InputError(problem, file=m.file, key="assembly.base")


def _in_axes(load: LoadSpec, every: Floats, index: Mapping[int, int]) -> LoadSpec:
    """A load in the axes of a body of the part; of one that is not there, or does not move, as it nominally is."""
    if "axes" not in load or index.get(load["axes"], GROUND) != GROUND:
        return load | {"axes": index[load["axes"]]} if "axes" in load else load
    turn = poses.matrix(every[load["axes"]])
    force, moment = ((turn @ load[name]).tolist() for name in ("force", "moment"))
    return {"point": load["point"], "force": force, "moment": moment}


def _left(group: CorrelationSpec, sources: list[int]) -> CorrelationSpec:
    """What is left of correlated sources where only some are there."""
    left = [k for k, source in enumerate(group["sources"]) if source in sources]
    there = [sources.index(group["sources"][k]) for k in left]
    return {"sources": there, "factor": [group["factor"][k] for k in left]}


def _with_pieces(m: Mechanism, there: set[int]) -> set[int]:
    """The bodies with the pieces of those that are elastic."""
    names = {m.bodies[body] for body in there if body != GROUND}
    return there | {k for k, owner in enumerate(m.owners) if owner in names}


def _with_crosses(spec: Spec, there: set[int], m: Mechanism) -> set[int]:
    """The bodies with the crosses of those universal joints whose bodies are both there."""
    beside: dict[int, set[int]] = {}
    for joint in spec["joints"]:
        ends = [spec["points"][joint[end]]["body"] for end in ("first", "second")]
        for body, other in (ends, ends[::-1]):
            if body in m.crosses:
                beside.setdefault(body, set()).add(other)
    return there | {cross for cross, bodies in beside.items() if bodies <= there}


def _drive(drive: DriveSpec, joints: list[int]) -> DriveSpec | None:
    """A drive of what is there, renumbered; a motor may move joints that come later. None where it moves nothing."""
    own = {key: value for key, value in drive.items() if key not in ("also", "compliance")}
    moves: list[Any] = [own, *drive.get("also", ())]
    there = [k for k, move in enumerate(moves) if move["joint"] in joints]
    if not there:
        return None
    first, *others = (moves[k] | {"joint": joints.index(moves[k]["joint"])} for k in there)
    if others:
        first["also"] = others
    if "compliance" in drive:
        first["compliance"] = np.reshape(drive["compliance"], (len(moves), -1))[np.ix_(there, there)].ravel().tolist()
    return cast("DriveSpec", first)


def _is_led(joint: JointSpec, joints: list[int]) -> bool:
    """Whether a joint is no follower, or its leader is there as well."""
    return "follows" not in joint or {joint["follows"]["of"], joint["follows"]["leader"]} <= {*joints}


def _joints_of(source: SourceSpec) -> list[int]:
    """The joints that a source names; the size of a pin with several bodies has several."""
    own = [source["joint"]] if "joint" in source else []
    return [*own, *(part["joint"] for part in source.get("also", ()))]


def _on_joints(source: SourceSpec, joints: list[int]) -> SourceSpec:
    """A source on joints, those that are there renumbered."""
    if source["kind"] != "size":
        return source | {"joint": joints.index(source["joint"])}
    parts: list[GapSpec] = [{"joint": source["joint"], "factor": source["factor"]}, *source.get("also", ())]
    there: list[GapSpec] = [
        {"joint": joints.index(part["joint"]), "factor": part["factor"]} for part in parts if part["joint"] in joints
    ]
    return source | cast("SourceSpec", {**there[0], "also": there[1:]})
