"""What is drawn of a mechanism, as shapes through points whose places follow from the poses of the bodies.

Shapes are lists of numbers of points. They stay the same in every configuration, and so does the order of the points:
a displaced mechanism is the same shapes at other places, and anything between is drawn by interpolation.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.spec import AXIS_ON, ENDS, SIDE_ON, End, JointSpec
from jointplay.model.gaps import clearance_of
from jointplay.model.mechanism import Mechanism
from jointplay.plot import couplings, springs
from jointplay.plot.bodies import body_colour, drawn_outline, outline
from jointplay.plot.plan import SLIDER
from jointplay.plot.sketch import AXIS, SLIDING
from jointplay.plot.style import THEMES

#: a shape as the page reads it
Shape = dict[str, Any]


class Stand(NamedTuple):
    """Poses of all bodies, the ground last, and where points are on their bodies, (configuration, point, 3), SI."""

    poses: Floats
    points: Floats


#: places of some points by how all bodies stand: (configuration, point, 3), in units of the file
Places = Callable[[Stand], Floats]

#: decimals of the corners of an outline, as parts of its size
FINE = 4
#: points of a circle
ROUND = 72
#: how the pins of a universal joint are called
PINS = (".first", ".second")


class Geometry:
    """The shapes of a mechanism and the places of their points.

    Parameters
    ----------
    m : Mechanism
    reference : ndarray
        Poses of all bodies that say which outline a body has, shape (body, pose), SI.

    Attributes
    ----------
    shapes : list of dict
        ``kind``, ``points`` (numbers) and what else the kind needs.
    extent : float
        Size of the mechanism in the reference poses, in units of the file.
    """

    def __init__(self, m: Mechanism, reference: Floats) -> None:
        self.m, self.spec = m, m.core_spec
        self.planar = m.pose_size != poses.SPATIAL
        self.shapes: list[Shape] = []
        self._parts: list[Places] = []
        self._count = 0
        #: of couplings the points where they act
        self._meshes: dict[int, int] = {}
        self._add(self._of_points, len(self.spec["points"]))
        start = self.places(reference[None])[0]
        self.extent = float(np.ptp(start, axis=0).max()) or 1.0
        self._bodies(start)
        self._joints()
        self._springs()
        output = self.spec["output"]["point"]
        self.shapes.append({"kind": "output", "points": [output]})
        self._names(self.places(reference[None])[0])

    def places(self, at: Floats, on_bodies: Floats | None = None) -> Floats:
        """Where all points are.

        Parameters
        ----------
        at : ndarray
            Poses of all bodies, shape (configuration, body, pose), SI.
        on_bodies : ndarray, optional
            Where the points of the specification are on their bodies, shape (configuration, point, 3), SI, body axes;
            where the specification has them if left out.

        Returns
        -------
        ndarray
            Shape (configuration, point, 3), in units of the file, ground axes.
        """
        ground = np.broadcast_to(poses.ground(self.m.pose_size), (len(at), 1, self.m.pose_size))
        if on_bodies is None:
            own = [point["at"] for point in self.spec["points"]]
            on_bodies = np.broadcast_to(own, (len(at), len(own), 3))
        stand = Stand(np.concatenate([at, ground], axis=1), on_bodies)
        return np.concatenate([part(stand) for part in self._parts], axis=1)

    def _add(self, part: Places, count: int) -> list[int]:
        """Points that follow from the poses; gives their numbers."""
        first = self._count
        self._parts.append(part)
        self._count += count
        return list(range(first, self._count))

    def _of_points(self, at: Stand) -> Floats:
        points = self.spec["points"]
        return np.stack([self._place(at, k) for k in range(len(points))], axis=1)

    def _place(self, at: Stand, index: int) -> Floats:
        body = at.poses[:, self.spec["points"][index]["body"]]
        turned = (poses.matrix(body) @ at.points[:, index, :, None])[..., 0]
        return np.asarray(poses.position(body) + turned) / self.m.units.length

    def _vector(self, at: Stand, joint: JointSpec, end: End, key: str) -> Floats:
        """A direction that a body of a joint carries, ground axes."""
        body = self.spec["points"][joint[end]]["body"]
        vector: Any = joint[key]  # type: ignore[literal-required]
        turned: Floats = poses.matrix(at.poses[:, body]) @ np.asarray(vector, dtype=float)
        return turned

    def _bodies(self, start: Floats) -> None:
        used = sorted({joint[end] for joint in self.spec["joints"] for end in ("first", "second")})
        output = self.spec["output"]["point"]
        for body, name in [(-1, "ground"), *enumerate(self.m.bodies)]:
            self._contour(body, name)
            mine = [k for k in used if self.spec["points"][k]["body"] == body]
            # In space a plate has its joints as corners, and may carry the output anywhere.
            if self.spec["points"][output]["body"] == body and (self.planar or len(mine) < 3):
                mine.append(output)
            order = _outline(start[mine], self.extent)
            if not order or (body == -1 and self.planar):
                continue
            shape = {"kind": "body", "name": name if body == -1 else self.m.owners[body]}
            points = [mine[k] for k in order]
            self.shapes.append({**shape, "points": points, **self._tint(body), "ground": body == -1})

    def _contour(self, body: int, name: str) -> None:
        """The outline of a body that the file has: its corners as parts of the way along two sides of a rectangle.

        Three corners of the rectangle move with the body, and with them all that is drawn, also magnified.
        """
        lines = drawn_outline(self.m, body)
        if not lines:
            return
        every = np.concatenate(lines)
        low, size = every.min(axis=0), np.maximum(np.ptp(every, axis=0), np.finfo(float).tiny)
        frame = low + np.array([[0.0, 0.0, 0.0], [size[0], 0.0, 0.0], [0.0, size[1], 0.0]])

        def corners(at: Stand) -> Floats:
            here = at.poses[:, body]
            turned = frame @ np.swapaxes(poses.matrix(here), 1, 2)
            return np.asarray(poses.position(here)[:, None] + turned) / self.m.units.length

        own = [np.round((line - low)[:, :2] / size[:2], FINE).tolist() for line in lines]
        shape = {"kind": "outline", "name": name, "points": self._add(corners, 3), "lines": own}
        self.shapes.append({**shape, **self._tint(body)})

    def _tint(self, body: int) -> dict[str, str]:
        """The colours of a body on a light and on a dark page."""
        # Not in a style in use: its settings are matplotlib's, for which a thread that draws makes others wait.
        return {key: body_colour(self.m, body, THEMES[name]) for key, name in (("colour", "light"), ("dark", "dark"))}

    def _tint_of(self, point: int) -> dict[str, str]:
        return self._tint(self.spec["points"][point]["body"])

    def _joints(self) -> None:
        inner = {member.joint for member in self.m.members}
        for k, joint in enumerate(self.spec["joints"]):
            if k in inner or "follows" in joint:
                continue
            if "coupling" in joint and joint["kind"] != "screw":
                self._coupling(joint)
                (self._meshes[k],) = self._add(self._mesh(joint), 1)
            elif self.planar:
                self._planar(joint)
            else:
                self._spatial(joint)
        for number, own, _ in self.m.round_plays if self.planar else ():
            radius = clearance_of(self.m, number)[1]["radius"] / self.m.units.length
            point = self.spec["joints"][own]["first"]
            self.shapes.append({"kind": "play", "points": [point], "radius": radius})

    def _planar(self, joint: JointSpec) -> None:
        kind, first, second = joint["kind"], joint["first"], joint["second"]
        if self.spec["points"][first]["body"] == -1 and kind in ("revolute", "fixed"):
            self.shapes.append({"kind": "support", "points": [first]})
        if kind in ("prismatic", "pin_in_slot"):
            self._guide(joint, box=kind == "prismatic")
        if kind in ("revolute", "pin_in_slot"):
            self.shapes.append({"kind": "pin", "points": [second]})
        elif kind == "fixed":
            self.shapes.append({"kind": "cross", "points": [second]})

    def _guide(self, joint: JointSpec, *, box: bool) -> None:
        size = SLIDER * self.extent

        def line(at: Stand) -> Floats:
            along = self._vector(at, joint, "first", "axis_first")
            first, second = self._place(at, joint["first"]), self._place(at, joint["second"])
            reach = np.sum((second - first) * along, axis=1, keepdims=True)
            far = reach + np.where(reach < 0.0, -1.5, 1.5) * size
            return np.stack([first - np.where(reach < 0.0, -1.0, 1.0) * size * along, first + far * along], axis=1)

        def corners(at: Stand) -> Floats:
            along = self._vector(at, joint, "first", "axis_first")
            across = np.stack([-along[:, 1], along[:, 0], along[:, 2]], axis=1)
            middle = self._place(at, joint["second"])
            signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
            return np.stack([middle + a * size * along + b * 0.5 * size * across for a, b in signs], axis=1)

        self.shapes.append({"kind": "guide", "points": self._add(line, 2), **self._tint_of(joint["first"])})
        if box:
            self.shapes.append({"kind": "box", "points": self._add(corners, 4), **self._tint_of(joint["second"])})

    def _spatial(self, joint: JointSpec) -> None:
        if joint["kind"] in ("spherical", "fixed"):
            kind = "ball" if joint["kind"] == "spherical" else "cross"
            self.shapes.append({"kind": kind, "points": [joint["second"]]})
            return

        def ends(at: Stand) -> Floats:
            along = AXIS * self.extent * self._vector(at, joint, "first", AXIS_ON["first"])
            middle = self._place(at, joint["second"])
            return np.stack([middle - along, middle + along], axis=1)

        slides = joint["kind"] in SLIDING
        if slides or joint["kind"] == "screw":
            points = [joint["first"], joint["second"]]
            end: End = "second" if slides else "first"
            self.shapes.append({"kind": "strut", "points": points, **self._tint_of(joint[end])})
        self.shapes.append({"kind": "axis", "points": self._add(ends, 2), "slides": slides})

    def _coupling(self, joint: JointSpec) -> None:
        radii = [abs(radius) / self.m.units.length for radius in joint["coupling"]["radii"]]
        turns = 2.0 * np.pi * np.arange(ROUND + 1) / ROUND

        def frame(at: Stand, end: End) -> tuple[Floats, Floats]:
            """Two directions in the plane of a wheel."""
            if self.planar:
                side = poses.matrix(at.poses[:, self.spec["points"][joint[end]]["body"]])[..., 0]
                return side, np.stack([-side[:, 1], side[:, 0], side[:, 2]], axis=1)
            axis, side = (self._vector(at, joint, end, keys[end]) for keys in (AXIS_ON, SIDE_ON))
            return side, np.cross(axis, side)

        def rim(at: Stand, end: End, radius: float) -> Floats:
            side, other = frame(at, end)
            ring = np.cos(turns)[:, None] * side[:, None] + np.sin(turns)[:, None] * other[:, None]
            middle = self._place(at, joint[end])[:, None]
            # The rim begins where the spoke ends, which shows how the wheel is turned.
            return np.concatenate([middle, middle + radius * ring], axis=1)

        def pitch_line(at: Stand) -> Floats:
            along = frame(at, "first")[0]
            if self.planar:
                along = self._vector(at, joint, "first", "axis_first")
            first, second = self._place(at, joint["first"]), self._place(at, joint["second"])
            foot = first + np.sum((second - first) * along, axis=1, keepdims=True) * along
            return np.stack([foot - 1.6 * radii[0] * along, foot + 1.6 * radii[0] * along], axis=1)

        for end, radius in zip(("first", "second"), radii, strict=True):
            tint = self._tint_of(joint[end])  # type: ignore[literal-required]
            if joint["kind"] == "rack" and end == "first":
                self.shapes.append({"kind": "guide", "points": self._add(pitch_line, 2), **tint})
                continue
            wheel = self._add(lambda at, end=end, radius=radius: rim(at, end, radius), ROUND + 2)  # type: ignore[misc]
            self.shapes.append({"kind": "wheel", "points": wheel, **tint})
        if joint["kind"] == "belt":
            self._strands(joint, (radii[0], radii[1]))

    def _mesh(self, joint: JointSpec) -> Places:
        """Where a coupling acts."""
        key = "axis_first" if self.planar else SIDE_ON["first"]

        def point(at: Stand) -> Floats:
            ends = self._place(at, joint["first"]), self._place(at, joint["second"])
            along = self._vector(at, joint, "first", key)
            first, second = (self._vector(at, joint, end, AXIS_ON[end]) for end in ENDS)
            unit = self.m.units.length
            found = [
                couplings.contact(joint, (ends[0][k], ends[1][k]), along[k], unit, (first[k], second[k]))
                for k in range(len(at.poses))
            ]
            return np.stack(found)[:, None]

        return point

    def _strands(self, joint: JointSpec, radii: tuple[float, float]) -> None:
        def both(at: Stand) -> Floats:
            found = []
            first, second = self._place(at, joint["first"]), self._place(at, joint["second"])
            normal = None if self.planar else self._vector(at, joint, "first", AXIS_ON["first"])
            for k in range(len(at.poses)):
                axis = np.array([0.0, 0.0, 1.0]) if normal is None else normal[k]
                across = np.cross(axis, second[k] - first[k])
                across = across / (float(np.linalg.norm(across)) or 1.0)
                lines = couplings.strands(first[k], second[k], across, radii, bool(joint["coupling"]["crossed"]))
                found.append(np.concatenate(lines) if lines else np.full((4, 3), np.nan))
            return np.stack(found)

        points = self._add(both, 4)
        for strand in (points[:2], points[2:]):
            self.shapes.append({"kind": "strand", "points": strand, **self._tint(-1)})

    def _springs(self) -> None:
        def zigzag(first: int, second: int) -> Places:
            def line(at: Stand) -> Floats:
                a, b = self._place(at, first), self._place(at, second)
                axes = 2 if self.planar else 3
                lines = [springs.zigzag(a[k, :axes], b[k, :axes], self.extent) for k in range(len(at.poses))]
                return np.stack([np.pad(points, ((0, 0), (0, 3 - axes))) for points in lines])

            return line

        def spiral(joint: JointSpec) -> Places:
            def line(at: Stand) -> Floats:
                middle = self._place(at, joint["second"])
                if self.planar:
                    x, y = (np.broadcast_to(np.eye(3)[k], middle.shape) for k in (0, 1))
                else:
                    axis, x = (self._vector(at, joint, "first", keys["first"]) for keys in (AXIS_ON, SIDE_ON))
                    y = np.cross(axis, x)
                return np.stack([springs.spiral(middle[k], x[k], y[k], self.extent) for k in range(len(at.poses))])

            return line

        for spring in self.spec["springs"]:
            points = self._add(zigzag(spring["first"], spring["second"]), springs.POINTS)
            self.shapes.append({"kind": "spring", "points": points})
        for torsion in self.spec["torsions"]:
            points = self._add(spiral(self.spec["joints"][torsion["joint"]]), 80)
            self.shapes.append({"kind": "spring", "points": points})

    def _names(self, start: Floats) -> None:
        """Names of the joints; those at one place in one label."""
        inner = {member.joint for member in self.m.members}
        at: dict[tuple[float, ...], tuple[int, dict[str, None]]] = {}
        for k, (name, joint) in enumerate(zip(self.m.joints, self.spec["joints"], strict=True)):
            if k not in inner:
                point = self._meshes.get(k, joint["second"])
                place = tuple(np.round(start[point] / self.extent, 3).tolist())
                at.setdefault(place, (point, {}))[1][name.split("/")[0]] = None
        for point, found in at.values():
            # A universal joint has two pins and one name.
            names = dict.fromkeys(
                _whole(name) if {_whole(name) + end for end in PINS} <= set(found) else name for name in found
            )
            self.shapes.append({"kind": "name", "points": [point], "text": ", ".join(names)})


def _whole(name: str) -> str:
    return name.rpartition(".")[0]


def _outline(points: Floats, extent: float) -> list[int]:
    """Numbers of the points that are corners of a body's outline, in turn; of a body on one line its ends."""
    if not len(points):
        return []
    _, first = np.unique(np.round(points / extent, 6), axis=0, return_index=True)
    kept = np.sort(first)
    if len(kept) < 3:
        return [int(k) for k in kept]
    corners = outline(points[kept], 1e-6 * extent)
    # That of an area ends where it began.
    corners = corners[:-1] if len(corners) > 2 else corners
    return [int(kept[np.abs(points[kept] - corner).sum(axis=1).argmin()]) for corner in corners]
