"""The drawing board: what a page draws and can take hold of, as the server says it.

A page has no mechanism of its own. It gets joints and bodies with their places at the poses that it shows, and sends
back what a person does, with these poses. Places and poses are in units of the file, angles of poses in radians.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from jointplay.analyses.nominal import Nominal
from jointplay.basics import poses as core_poses
from jointplay.file.schema import NotAnExpression, Variables, variables_of
from jointplay.file.schema.keys import Steps
from jointplay.file.schema.tables import UnitsTable
from jointplay.file.schema.values import is_number
from jointplay.model.mechanism import Mechanism
from jointplay.show.viewer import scene

#: axes of a body in those of the drawing: x, y and angle
BodyPose = tuple[float, float, float]
BodyPoses = Mapping[str, BodyPose]
XY = tuple[float, float]
Json = dict[str, Any]

GROUND = "ground"
DRAWN: BodyPose = (0.0, 0.0, 0.0)
#: what is seen of an empty drawing, in millimetres to each side
ROOM = (120.0, 70.0)
#: why a joint is not dragged
LOCKED = "is locked"
#: sections of the file whose properties a page shows
SHOWN = ("drives", "limits", "output", "outputs", "springs", "dimensions", "variables", "costs", "load_cases")
#: the colours of bars that are no bodies of a mechanism yet, on a light and on a dark page
BARE = {"colour": "#6a7075", "dark": "#a8adb2"}


def placed_at(pose: BodyPose, point: XY) -> XY:
    """Where a point of a body is in the drawing."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return pose[0] + c * point[0] - s * point[1], pose[1] + s * point[0] + c * point[1]


def seen_from(pose: BodyPose, point: XY) -> XY:
    """Where a point of the drawing is in the axes of a body."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x, y = point[0] - pose[0], point[1] - pose[1]
    return c * x + s * y, c * y - s * x


def poses_of(m: Mechanism, at: Nominal) -> dict[str, BodyPose]:
    """The poses of all bodies of a mechanism in the plane at a configuration; none of one in space."""
    if m.pose_size == core_poses.SPATIAL:
        return {}
    found: dict[str, BodyPose] = {}
    for name, (x, y, angle) in zip(m.owners, at.poses[0].tolist(), strict=True):
        if math.isfinite(x):
            found.setdefault(name, (x / m.units.length, y / m.units.length, angle))
    return found


def place_on(table: Mapping[str, Any], body: str) -> Any:
    """What a joint of a file says of its place on one of its bodies; None where it does not."""
    if "on" in table:
        own = table["on"].get(body) if isinstance(table["on"], Mapping) else None
        return own.get("at") if isinstance(own, Mapping) else own
    return table.get("at")


def bodies_of(table: Mapping[str, Any]) -> list[str]:
    """The bodies of a joint of a file, the carrier first."""
    found = table.get("on", table.get("bodies", ()))
    return [str(name) for name in found]


def numbers(value: Any, variables: Variables | None = None) -> XY | None:
    """A place in the plane; None where it is none, or an expression, unless the variables in it are given."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        return None
    try:
        found = [variables.number(v) if variables is not None and isinstance(v, str) else v for v in value]
    except NotAnExpression:
        return None
    return (float(found[0]), float(found[1])) if all(map(is_number, found)) else None


def variables_in(raw: Mapping[str, Any]) -> Variables | None:
    """The variables of a file; None where they have no values, which reading it says."""
    try:
        return Variables(*variables_of(raw))
    except NotAnExpression:
        return None


def free_of(raw: Mapping[str, Any]) -> dict[str, list[XY]]:
    """The points of bodies that no joint is at yet, body axes."""
    board = raw.get("board")
    free = board.get("free") if isinstance(board, Mapping) else None
    found = free if isinstance(free, Mapping) else {}
    return {body: [p for p in map(numbers, points) if p is not None] for body, points in found.items()}


def locked_in(raw: Mapping[str, Any]) -> list[str]:
    """The joints that stay where they are when others are dragged."""
    board = raw.get("board")
    return list(board.get("locked", ())) if isinstance(board, Mapping) else []


def loads_of(raw: Mapping[str, Any]) -> Iterator[tuple[Steps, str, Mapping[str, Any]]]:
    """The loads of a file that stand in lists: where, in which load case (empty: in all), and what each says."""
    for k, own in enumerate(raw.get("loads", ())):
        yield ("loads", k), "", own
    for name, loads in raw.get("load_cases", {}).items():
        if isinstance(loads, list):
            for k, own in enumerate(loads):
                yield ("load_cases", name, k), name, own


def _joints(raw: Mapping[str, Any], m: Mechanism | None, poses: BodyPoses) -> Iterator[Json]:
    """The joints of a file with all that the page shows of them."""
    own = raw.get("joints", {})
    compiled = {} if m is None else dict(m.data.joints)
    drives = {str(t.get("joint")).split("/")[0]: d for d, t in raw.get("drives", {}).items() if isinstance(t, Mapping)}
    variables = variables_in(raw)
    locked = locked_in(raw)
    points: dict[str, int] = {}
    for k, name in enumerate(() if m is None else m.joints):
        # Of a universal joint there are two pins, of several bodies on one pin several joints.
        for whole in (name.split("/")[0], name.rpartition(".")[0]):
            points.setdefault(whole, m.joint_points[k][0])  # type: ignore[union-attr]
    for name in dict.fromkeys((*own, *compiled)):
        table = own.get(name, {})
        bodies = list(compiled[name].names) if name in compiled else bodies_of(table)
        at, fixed = None, ""
        if m is None or m.pose_size != core_poses.SPATIAL:
            first = bodies[0] if bodies else GROUND
            place = (
                compiled[name].placements[first].at if name in compiled else numbers(place_on(table, first), variables)
            )
            at = None if place is None else placed_at(poses.get(first, DRAWN), (float(place[0]), float(place[1])))
        if name not in own:
            fixed = "is a copy of a pattern, or in another file"
        elif name in locked:
            fixed = LOCKED
        yield {
            "name": name,
            "kind": table.get("type", compiled[name].kind if name in compiled else ""),
            "bodies": bodies,
            "at": at,
            "point": points.get(name),
            "drawn": "on" not in table,
            "written": table.get("at"),
            "locked": name in locked,
            **{key: table[key] for key in ("teeth", "radii") if key in table},
            "axis": _axis(table, bodies[0] if bodies else GROUND, poses, variables),
            "clearance": table.get("clearance"),
            "drive": drives.get(name),
            "fixed": fixed,
        }


def _axis(table: Mapping[str, Any], first: str, poses: BodyPoses, variables: Variables | None) -> XY | None:
    """The direction in the drawing along which a joint slides, of length one; None where it does not."""
    on = table.get("on")
    own = on.get(first) if isinstance(on, Mapping) else table
    axis = numbers(own.get("axis"), variables) if isinstance(own, Mapping) else None
    if table.get("type") not in ("prismatic", "pin_in_slot") or axis is None or not math.hypot(*axis):
        return None
    angle = poses.get(first, DRAWN)[2] if isinstance(on, Mapping) else 0.0
    x, y = placed_at((0.0, 0.0, angle), axis)
    return x / math.hypot(*axis), y / math.hypot(*axis)


def sketch(joints: list[Json]) -> Json:
    """The drawing of what is no mechanism yet: joints, and bodies as lines between them."""
    places: list[Any] = [[0.0, 0.0]]
    shapes: list[Json] = []
    on: dict[str, list[int]] = {}
    for joint in joints:
        if joint["at"] is None:
            continue
        k = len(places)
        places.append(list(joint["at"]))
        joint["point"] = k
        for body in joint["bodies"]:
            on.setdefault(body, []).append(k)
        if GROUND in joint["bodies"]:
            shapes.append({"kind": "support", "points": [k]})
        shapes.append({"kind": "cross" if joint["kind"] == "fixed" else "pin", "points": [k]})
        shapes.append({"kind": "name", "points": [k], "text": joint["name"]})
    for body, points in on.items():
        if body != GROUND and len(points) > 1:
            shapes.append({"kind": "body", "name": body, "points": points, "ground": False, **BARE})
    extent = max((abs(v) for place in places for v in place), default=0.0) or ROOM[0]
    frame = [[-ROOM[0], -ROOM[1]], list(ROOM)] if len(places) == 1 else []
    return {
        "axes": 2,
        "unit": "",
        "extent": extent,
        "shapes": shapes,
        "output": 0,
        "relative": False,
        "places": [places],
        "path": [],
        "states": [],
        "region": None,
        "cloud": None,
        "limit": None,
        "factor": 1.0,
        "texts": [],
        "frame": frame,
    }


def outlines(drawn: Json) -> list[list[XY]]:
    """The bodies of a drawing in the plane as lines."""
    if drawn["axes"] != len("xy"):
        return []
    places = drawn["places"][0]
    lines = [[places[k] for k in s["points"]] for s in drawn["shapes"] if s["kind"] == "body" and not s["ground"]]
    return [line for line in lines if len(line) > 1 and not any(None in place for place in line)]


def with_bars(drawn: Json, raw: Mapping[str, Any], poses: BodyPoses, joints: list[Json]) -> Json:
    """A drawing with the points that no joint is at yet, and the bars to them.

    Their places follow from the poses, so that they move with their bodies.
    """
    places, shapes = list(drawn["places"][0]), list(drawn["shapes"])
    for body, points in free_of(raw).items():
        mine = [joint["point"] for joint in joints if body in joint["bodies"] and joint["point"] is not None]
        tint = next((s for s in shapes if s.get("name") == body and "colour" in s), BARE)
        for point in points:
            places.append(list(placed_at(poses.get(body, DRAWN), point)))
            mine.append(len(places) - 1)
            shapes.append({"kind": "free", "points": mine[-1:]})
            if len(mine) > 1:
                line = {"kind": "body", "name": body, "points": [mine[0], mine[-1]], "ground": False}
                shapes.append({**line, "colour": tint["colour"], "dark": tint["dark"]})
    if len(places) == len(drawn["places"][0]):
        return drawn
    states = [
        {**state, "moves": [[*state["moves"][0], *[[0.0] * drawn["axes"]] * (len(places) - len(state["moves"][0]))]]}
        for state in drawn["states"]
    ]
    return {**drawn, "places": [places], "shapes": shapes, "states": states}


def on_board(m: Mechanism, at: Nominal, drawn: Json) -> Json:
    """A drawing of a mechanism with the bars of its board."""
    if not free_of(m.raw):
        return drawn
    poses = poses_of(m, at)
    return with_bars(drawn, m.raw, poses, list(_joints(m.raw, m, poses)))


def told(raw: Mapping[str, Any], m: Mechanism | None, at: Nominal | None, before: BodyPoses) -> Json:
    """What a page draws and can take hold of.

    Parameters
    ----------
    raw : mapping
        The tables of the file.
    m : Mechanism or None
        What they make; None as long as they make none.
    at : Nominal or None
        The configuration that is shown.
    before : mapping
        The poses of bodies that are not known otherwise.
    """
    poses = {**before, **({} if m is None or at is None else poses_of(m, at))}
    joints = list(_joints(raw, m, poses))
    is_planar = raw.get("space", "planar") == "planar"
    drawn = sketch(joints) if m is None or at is None else scene(m, at)
    free = free_of(raw)
    every = [b for joint in joints for b in joint["bodies"]]
    return {
        "planar": is_planar,
        "units": {**UnitsTable.model_validate({}).model_dump(exclude_none=True), **raw.get("units", {})},
        "joints": joints,
        "bodies": [body for body in dict.fromkeys((*every, *free)) if body != GROUND],
        "free": [
            {"body": body, "index": k, "at": placed_at(poses.get(body, DRAWN), point)}
            for body, points in free.items()
            for k, point in enumerate(points)
        ],
        "poses": poses,
        **{key: raw.get(key, {}) for key in SHOWN},
        "loads": [{"at": steps, "case": name, "load": own} for steps, name, own in loads_of(raw)],
        "target": raw.get("target"),
        "scene": with_bars(drawn, raw, poses, joints) if is_planar else drawn,
    }
