"""Skeletons in DXF: one layer for each body, or all bodies on one (`bars`); what coincides is joined.

* A layer is a body; the layer ``ground`` is fixed.
* Where ends of lines, corners of polylines, centres of circles or points of several layers coincide, there is a pin.
* A construction line (XLINE, RAY) or a centre line is a guide of its layer. A pin of another layer on it slides along
  it as in a slot; where two layers have guides along one another, one body slides in the other.
* A POINT is a point that can be the output. A text at a pin or at a point is its name.
* Layers whose names begin with an underscore are no bodies.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointplay.errors import InputError, listed

from .bars import body_by_body
from .drawing import OUTPUT, Drawing, Guide, drawing, tree
from .options import Options
from .pins import connected, pins
from .skeleton import GROUND, Attachment, Body, Frame, Joint, Skeleton, Vector

#: what coincides, and what nearly does and is named, by the size of the drawing
COINCIDENT, NEAR = 1e-4, 1e-3


@dataclass(frozen=True)
class Spot:
    """A place of the drawing where layers have a point."""

    at: Vector
    layers: tuple[str, ...]
    is_mark: bool


def read(path: Path, options: Options) -> Skeleton:
    """A skeleton in DXF.

    Raises
    ------
    InputError
        When there is no ground, nothing is joined, or the output is not clear.
    """
    found = drawing(path)
    size = _size(found)
    if not (np.isfinite(options.within) and options.within >= 0.0):
        raise InputError(f"is a distance in mm, not {options.within:g}", key="within")
    reach = max(COINCIDENT * size, options.within * 1e-3)
    if len(found.layers) == 1:
        found = body_by_body(found, options.ground or GROUND, reach)
    layers = _ordered(found.layers, options.ground)
    spots = [*_spots(found, layers, reach)]
    names = {layer: GROUND if layer.lower() == GROUND else layer for layer in layers}
    used: set[str] = set()
    joints = [*_joints(found, spots, layers, reach, used)]
    notes = [*found.notes, *_near(spots, NEAR * size)]
    inside = connected(layers[0], joints)
    alone = [layer for layer in layers if layer not in inside]
    apart = [layer for layer in alone if any(layer in joint.bodies for joint in joints)]
    if not joints:
        raise InputError("nothing is joined: bodies are joined where points of their layers coincide")
    if apart:
        raise InputError(f"nothing joins these layers with the ground: {listed(apart)}")
    if alone:
        notes.append(f"Layers that touch no other one are left out: {listed(alone)}.")
    points = {name: (body, at) for name, (body, at) in _points(found, names, reach, used).items() if body in inside}
    if options.output is None and OUTPUT not in points:
        raise InputError(_which_output(points), key="output")
    unused = [text for text, _ in found.words if text not in used]
    if unused:
        notes.append(f"Texts that are at no pin and at no point are left out: {listed(unused)}.")
    frames = {joint.name: (names[joint.bodies[1]], Frame(joint.place.at)) for joint in joints}
    frames |= {name: (names[body], Frame(at)) for name, (body, at) in points.items()}
    return Skeleton(
        title=path.stem,
        bodies={names[layer]: Body() for layer in layers if layer in inside},
        joints=tuple(_renamed(joint, names) for joint in joints),
        space="planar",
        ground=names[layers[0]],
        frames=frames,
        has_origins=False,
        gravity=(0.0, 0.0, 0.0),
        notes=tuple(notes),
    )


def _renamed(joint: Joint, names: dict[str, str]) -> Joint:
    first, second = joint.bodies
    return Joint(joint.name, joint.kind, (names[first], names[second]), joint.place)


def _ordered(layers: list[str], ground: str | None) -> list[str]:
    """The layers, the fixed one first, which carries the pins that others turn on."""
    wanted = (ground or GROUND).lower()
    fixed = [layer for layer in layers if layer.lower() == wanted]
    if not fixed:
        known = f"; layers with lines or points: {listed(layers)}" if layers else ""
        if ground is None:
            raise InputError(f"has no layer '{GROUND}' for what is fixed; say which layer is{known}", key="ground")
        raise InputError(f"'{ground}' is no layer with lines or points{known}", key="ground")
    return [*fixed, *(layer for layer in layers if layer not in fixed)]


def _size(found: Drawing) -> float:
    points = np.array([at for _, at in (*found.ends, *found.marks)])
    return float(np.ptp(points, axis=0).max()) if len(points) else 0.0


def _spots(found: Drawing, layers: list[str], tolerance: float) -> Iterator[Spot]:
    """Points that coincide, each place once, with its layers in their order."""
    every = [*((layer, at, False) for layer, at in found.ends), *((layer, at, True) for layer, at in found.marks)]
    if not every:
        return
    places = np.array([at for _, at, _ in every])
    taken: set[int] = set()
    for k, around in enumerate(tree(places).query_ball_point(places, tolerance)):
        if k in taken:
            continue
        here = [j for j in around if j not in taken]
        taken.update(here)
        has = {every[j][0] for j in here}
        yield Spot(places[k], tuple(layer for layer in layers if layer in has), all(every[j][2] for j in here))


def _joints(found: Drawing, spots: list[Spot], layers: list[str], reach: float, used: set[str]) -> Iterator[Joint]:
    taken: set[str] = set()

    def name(places: Iterable[Vector], *bodies: str) -> str:
        """The first text at these places that is no joint's yet, or the names of the bodies."""
        words = [word for at in places for word in _words(found, at, reach) if word != OUTPUT]
        wanted = next((word for word in words if word not in taken), "-".join(bodies))
        used.add(wanted)
        own, number = wanted, 1
        while own in taken:
            number += 1
            own = f"{wanted}_{number}"
        taken.add(own)
        return own

    for spot in spots:
        if len(spot.layers) > 1:
            yield from pins(name([spot.at], *spot.layers), spot.layers, spot.at)
    sliding = []
    for first, second, at in _slides(found.guides, layers, reach):
        sliding.append((first, second))
        place = Attachment(at, first.along)
        # A pin may be in the middle of a slider, and has its text there.
        own = name([*second.ends(), at], first.layer, second.layer)
        yield Joint(own, "prismatic", (first.layer, second.layer), place)
    for guide in found.guides:
        for spot in spots:
            # What slides along it is held already, and a guide that slides is no slot for others.
            held = any((one is guide and other.layer in spot.layers) or other is guide for one, other in sliding)
            if spot.is_mark or held or guide.layer in spot.layers or guide.distance(spot.at) > reach:
                continue
            body = spot.layers[0]
            place = Attachment(spot.at, guide.along)
            yield Joint(name([spot.at], guide.layer, body), "pin_in_slot", (guide.layer, body), place)


def _slides(guides: list[Guide], layers: list[str], tolerance: float) -> Iterator[tuple[Guide, Guide, Vector]]:
    """Guides of two layers that lie along one another, the carrier first, and the middle of the slider.

    The carrier is the ground, or else has the longer line.
    """
    ordered = sorted(guides, key=lambda guide: (guide.layer != layers[0], guide.low - guide.high))
    for k, first in enumerate(ordered):
        for second in ordered[k + 1 :]:
            if first.layer == second.layer:
                continue
            t = float((second.at - first.at) @ first.along)
            off = np.linalg.norm(second.at - first.at - t * first.along)
            parallel = np.linalg.norm(np.cross(first.along, second.along)) < COINCIDENT
            sense = 1.0 if first.along @ second.along > 0 else -1.0
            low, high = sorted((t + sense * second.low, t + sense * second.high))
            overlap = min(first.high, high) - max(first.low, low)
            if off <= tolerance and parallel and overlap > tolerance:
                yield first, second, np.mean(ends, axis=0) if len(ends := second.ends()) == 2 else second.at


def _words(found: Drawing, at: Vector, tolerance: float) -> list[str]:
    """The texts at a point."""
    return [text for text, where in found.words if text and np.linalg.norm(where - at) <= tolerance]


def _points(found: Drawing, names: dict[str, str], tolerance: float, used: set[str]) -> dict[str, tuple[str, Vector]]:
    """The marked points by name: that of their text, or of their layer."""
    points: dict[str, tuple[str, Vector]] = {}
    for layer, at in found.marks:
        words = _words(found, at, tolerance)
        is_output = OUTPUT in words or (len(found.marks) == 1 and not words)
        wanted = OUTPUT if is_output else words[0] if words else f"{names[layer]}-point"
        used.add(wanted)
        number, name = 1, wanted
        while name in points:
            number += 1
            name = f"{wanted}_{number}"
        points[name] = (layer, at)
    if len(points) == 1:
        points.setdefault(OUTPUT, *points.values())
    return points


def _which_output(points: dict[str, tuple[str, Vector]]) -> str:
    if points:
        return f"which point is it? Name one of {listed(points)}, or write the text '{OUTPUT}' at one"
    return "there is none: draw a POINT on the layer of the body that carries it, or name a joint"


def _near(spots: list[Spot], reach: float) -> Iterator[str]:
    """Places that nearly coincide and are not joined; for some layers the first."""
    if not spots:
        return
    said = set()
    for k, j in sorted(tree([spot.at for spot in spots]).query_pairs(reach)):
        one, other = spots[k], spots[j]
        layers = tuple(dict.fromkeys((*one.layers, *other.layers)))
        if {*one.layers} != {*other.layers} and layers not in said:
            said.add(layers)
            where = ", ".join(f"{x * 1e3:.6g}" for x in one.at[:2])
            apart = f"{np.linalg.norm(one.at - other.at) * 1e3:.3g} mm apart at ({where})"
            yield f"Points of the layers {listed(layers)} are {apart} and not joined; --within joins them."
