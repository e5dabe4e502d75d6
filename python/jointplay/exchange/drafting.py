"""The drawing of a mechanism in DXF, by the conventions by which `dxf` reads skeletons.

Every body is a layer with its outline; pins are circles on the layers of both bodies, guides centre lines. The output
is a POINT with its name. Its path, and what else is no body, is on layers whose names begin with an underscore.
"""

import re
from collections.abc import Iterable, Mapping
from io import StringIO
from typing import Any

import numpy as np

from jointplay.analyses.displaced import at_parameters
from jointplay.analyses.nominal import nominal
from jointplay.analyses.offsets import parameters
from jointplay.basics import poses
from jointplay.core.spec import AXIS_ON, ENDS, End, JointSpec, PointSpec
from jointplay.errors import InputError, in_range
from jointplay.model.mechanism import Mechanism

from .drawing import NO_BODY, NOTES, OUTPUT, ezdxf
from .skeleton import GROUND, Matrix, Vector

#: offsets and deviations by name
GivenErrors = tuple[Mapping[str, Any], Mapping[str, Any]]
#: numbers of units in $INSUNITS
UNITS = {"mm": 4, "cm": 5, "m": 6, "um": 13, "in": 1}
#: sizes on the drawing, as parts of its extent
PIN, LETTER, SLIDER = 0.01, 0.02, 0.04
#: how far the guide reaches beyond its slider
BEYOND = 2.0
#: layers of names and of the path of the output
NAMES, PATH = f"{NOTES}names", f"{NOTES}path"
#: what a layer cannot have in its name
FORBIDDEN = str.maketrans(dict.fromkeys('<>/\\":;?*|=`,', "_"))
GREY, COLOURS = 8, 6
#: what stands behind the name of a pin with several bodies, and of a joint with a part of its own
PIECES = re.compile(r"[/.]")
#: how names of guides are turned, degrees, to keep clear of those of pins
DOWN = -45.0
SLIDING = ("prismatic", "pin_in_slot")


def to_dxf(m: Mechanism, configuration: int = 0, given: GivenErrors | None = None) -> str:
    """The drawing of a mechanism in one of its configurations.

    Parameters
    ----------
    configuration : int
        Which, counted from 0.
    given : pair of mappings, optional
        Offsets and deviations by name, as for `given`: the mechanism is drawn where they displace it.

    Returns
    -------
    str
        DXF, in the unit of length of the mechanism file.

    Raises
    ------
    InputError
        When there is no such configuration, or it cannot be assembled (with these offsets).
    JointplayError
        When ezdxf is not installed.
    """
    library = ezdxf()
    at = nominal(m)
    in_range(configuration, "configuration", "the number of a configuration", 0, len(at) - 1)
    if not np.isfinite(at.poses[configuration]).all():
        raise InputError(f"configuration {configuration} cannot be assembled", file=m.file)
    displaced = at_parameters(m, at.at(configuration), parameters(m, 1, *(given or ({}, {}))))
    there = displaced.poses[0] if given is not None else at.poses[configuration]
    if not np.isfinite(there).all():
        raise InputError(f"configuration {configuration} cannot be assembled with these offsets", file=m.file)
    document = library.new("R2010", setup=True)
    document.header["$INSUNITS"] = UNITS[m.units.length_name]
    layers = _layers([GROUND, *dict.fromkeys(m.owners)])
    for number, layer in enumerate(layers.values()):
        document.layers.add(layer, color=number % COLOURS + 1)
    for layer in (NAMES, PATH):
        document.layers.add(layer, color=GREY)
    sheet = _Sheet(m, there, displaced.points[0], document.modelspace(), layers)
    sheet.joints()
    for name in m.outputs or (None,):
        part = m.only(output=name)
        on_its_body = part.on_body(part.output_point, parameters(part, 1, *(given or ({}, {}))))[0]
        sheet.output(part.core_spec["points"][part.output_point], on_its_body, name or OUTPUT, at.poses)
    sheet.bodies()
    stream = StringIO()
    document.write(stream)
    return stream.getvalue()


def _layers(names: Iterable[str]) -> dict[str, str]:
    """The layer of every body: case does not count there, and some names have a meaning."""
    taken = {*NO_BODY}
    found = {}
    for name in names:
        wanted = name.translate(FORBIDDEN)
        layer = wanted = f"body{wanted}" if wanted.startswith(NOTES) else wanted
        number = 1
        while layer.lower() in taken:
            number += 1
            layer = f"{wanted}_{number}"
        taken.add(layer.lower())
        found[name] = layer
    return found


class _Sheet:
    """The model space of a drawing."""

    def __init__(self, m: Mechanism, pose: Matrix, points: Matrix, space: Any, layers: Mapping[str, str]) -> None:
        self.m, self.space, self.layers = m, space, layers
        self.spec = m.core_spec
        self.is_flat = self.spec["space"] == "planar"
        self.pose = np.vstack([pose, poses.ground(m.pose_size)])
        bodies = [point["body"] for point in self.spec["points"]]
        self.places = np.array([self.at(body, on) for body, on in zip(bodies, points, strict=True)])
        self.words: list[tuple[str, Vector]] = []
        #: what the outline of every body goes through
        self.corners: dict[str, list[Vector]] = {}
        self.extent = float(np.ptp(self.places, axis=0).max()) or 1.0
        #: joints, those between pieces of one elastic body apart
        self.shown = [
            (PIECES.split(name)[0], joint)
            for name, joint in zip(m.joints, self.spec["joints"], strict=True)
            if self.owner(joint["first"]) != self.owner(joint["second"]) and "follows" not in joint
        ]

    def at(self, body: int, on_body: Vector) -> Vector:
        """Where a point of a body is, in the unit of the file."""
        return np.asarray(poses.place(self.pose[body], on_body) / self.m.units.length)

    def owner(self, point: int) -> str:
        """The body of the file that has a point of the specification."""
        return self.owner_of(self.spec["points"][point])

    def owner_of(self, point: PointSpec) -> str:
        """The body of the file that has a point."""
        return GROUND if point["body"] == -1 else self.m.owners[point["body"]]

    def bodies(self) -> None:
        """The outline of every body: through its joints and the output."""
        for owner, places in self.corners.items():
            corners = _different(places, 1e-9 * self.extent)
            if len(corners) > 1:
                self.line(_in_turn(np.array(corners)), self.layers[owner], close=len(corners) > 2)

    def joints(self) -> None:
        """Pins as circles on both bodies, guides as centre lines, wheels as their pitch circles; names."""
        for name, joint in self.shown:
            place = self.places[joint["second"]]
            radii = joint.get("coupling", {}).get("radii", [])
            sliding = joint["kind"] in SLIDING
            for k, end in enumerate(ENDS):
                point = joint[end]
                self.corners.setdefault(self.owner(point), []).append(self.places[point])
                if sliding and (end == "first" or joint["kind"] == "prismatic"):
                    self.guide(joint, place, end)
                    continue
                radius = radii[k] / self.m.units.length if k < len(radii) else PIN * self.extent
                self.circle(joint, end, radius)
            if joint["kind"] == "prismatic":
                # A slider often has a pin in its middle, whose name is there.
                self.word(name, place + SLIDER * self.extent * self.axis(joint, "first"), DOWN)
            else:
                self.word(name, place)

    def axis(self, joint: JointSpec, end: End) -> Vector:
        """The direction of a joint in ground axes."""
        body = self.spec["points"][joint[end]]["body"]
        turned = poses.matrix(self.pose[body]) @ np.array(joint[AXIS_ON[end]])
        return np.asarray(turned / np.linalg.norm(turned))

    def guide(self, joint: JointSpec, place: Vector, end: End) -> None:
        """A centre line through a slider; that of the carrier reaches beyond it."""
        half = SLIDER * self.extent * (BEYOND if end == "first" else 1.0) * self.axis(joint, "first")
        look = {"layer": self.layers[self.owner(joint[end])], "linetype": "CENTER"}
        self.space.add_line(place - half, place + half, dxfattribs=look)
        arm = place - self.places[joint["first"]]
        if end == "first" and np.linalg.norm(arm) > np.linalg.norm(half):
            # What carries the guide reaches up to it.
            near = place - half if arm @ half > 0 else place + half
            self.line(np.array([self.places[joint["first"]], near]), look["layer"])

    def circle(self, joint: JointSpec, end: End, radius: float) -> None:
        """A pin or a wheel across its axis."""
        place = self.places[joint[end]]
        look: dict[str, Any] = {"layer": self.layers[self.owner(joint[end])]}
        if not self.is_flat:
            # Circles stand in a plane of their own.
            normal = tuple(self.axis(joint, end))
            place, look = ezdxf().math.OCS(normal).from_wcs(tuple(place)), look | {"extrusion": normal}
        self.space.add_circle(place, radius, dxfattribs=look)

    def output(self, point: PointSpec, on_body: Vector, name: str, path: Vector) -> None:
        """The output point with its name, and its nominal path."""
        place, owner = self.at(point["body"], on_body), self.owner_of(point)
        self.corners.setdefault(owner, []).append(place)
        self.space.add_point(tuple(place), dxfattribs={"layer": self.layers[owner]})
        self.word(name, place)
        places = poses.place(path[:, point["body"]], point["at"]) / self.m.units.length
        known = places[np.isfinite(places).all(axis=1)]
        if len(known) > 1:
            self.line(known, PATH)

    def line(self, places: Matrix, layer: str, *, close: bool = False) -> None:
        """A line through places."""
        look = {"close": close, "dxfattribs": {"layer": layer}}
        if self.is_flat:
            self.space.add_lwpolyline([tuple(place[:2]) for place in places], **look)
        else:
            self.space.add_polyline3d([tuple(place) for place in places], **look)

    def word(self, text: str, place: Vector, angle: float = 0.0) -> None:
        """A text that begins at a place, once."""
        if any(text == other and np.allclose(place, where) for other, where in self.words):
            return
        self.words.append((text, place))
        look = {"layer": NAMES, "height": LETTER * self.extent, "rotation": angle}
        self.space.add_text(text, dxfattribs=look).set_placement(tuple(place))


def _different(places: Iterable[Vector], near: float) -> list[Vector]:
    """Places, each once."""
    found: list[Vector] = []
    for place in places:
        if all(np.linalg.norm(place - other) > near for other in found):
            found.append(place)
    return found


def _in_turn(corners: Matrix) -> Matrix:
    """The corners of an outline in the order of their angle about the middle; those on one line from end to end."""
    centred = corners - corners.mean(axis=0)
    _, sizes, axes = np.linalg.svd(centred, full_matrices=False)
    flat = centred @ axes[:2].T
    if sizes[1] < 1e-9 * sizes[0]:
        return np.asarray(corners[np.argsort(flat[:, 0])[[0, -1]]])
    return np.asarray(corners[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))])
