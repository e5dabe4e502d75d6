"""SDF: links and joints of models, in frames that name one another; a child link may have several parents.

The semantics of frames are those of SDFormat 1.7 and later, http://sdformat.org/tutorials?tut=pose_frame_semantics:
a pose is given in the frame that `relative_to` names, else links and nested models in their model, frames in the one
they are attached to, joints in their child. Up to version 1.4 axes of joints are in the axes of the model; later in
those of the joint, unless `use_parent_model_frame` or `expressed_in` says otherwise.

It is read here and not by a library: the bindings of libsdformat are no wheels, and other packages bring meshes along.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from jointplay.basics.poses import matrix
from jointplay.errors import listed, not_known, shown

from .options import Options
from .rotations import from_rpy
from .skeleton import STANDARD_GRAVITY, Attachment, Body, Frame, Joint, Matrix, Skeleton, Vector, fixed, floating, free
from .xml import DEEPEST, MOMENTS, Reading, counts, parse

#: int() takes other digits, too, and refuses very many
VERSION = re.compile(r"[0-9]{1,4}(\.[0-9]{1,4}){0,3}")
WORLD = "world"
MODEL = "__model__"
SEPARATOR = "::"
#: type of SDF: kind of the mechanism file
KINDS = {
    "revolute": "revolute",
    "continuous": "revolute",
    "gearbox": "revolute",
    "prismatic": "prismatic",
    "fixed": "fixed",
    "ball": "spherical",
    "screw": "screw",
}
#: types that are two pins in series
DOUBLE = ("universal", "revolute2")
LEFT_OUT = (
    *(
        "visual",
        "visual shapes",
        "collision",
        "collision shapes",
        "dynamics",
        "entries of friction, damping and springs",
    ),
    *("sensor", "sensors", "plugin", "plugins", "light", "lights", "actor", "actors"),
)


@dataclass(frozen=True)
class _Named:
    """A link, joint, frame or model."""

    element: Element
    #: names in it begin with this: "" in the only model of a file, ``arm::`` in a model `arm` inside it
    scope: str
    #: name of the frame in which it is if it does not say
    default: str
    #: what it moves with; empty for a link
    carrier: str = ""


def read(path: Path, options: Options) -> Skeleton:
    """A model in SDF, or all models of a world.

    Raises
    ------
    InputError
        When the file has no model, or a frame is not known.
    """
    return _File(Reading(str(path)), parse(path, "sdf", "SDF")).skeleton(path.stem, options.ground)


class _File:
    """One file on its way to a skeleton."""

    def __init__(self, reading: Reading, root: Element) -> None:
        self.reading, self.root = reading, root
        version = (root.get("version") or "1.7").strip()
        if VERSION.fullmatch(version) is None:
            raise reading.refuse(f"{shown(version)} is no version of SDF, such as 1.7", "version")
        self.version = tuple(map(int, version.split(".")))
        #: links, joints, frames and models by their whole names
        self.named: dict[str, _Named] = {}
        self.links: list[str] = []
        self.joints: list[str] = []
        self.static: list[str] = []
        self.placed: dict[str, Frame] = {WORLD: Frame()}
        self.notes: list[str] = []
        worlds = root.findall("world")
        if len(worlds) > 1:
            raise reading.refuse(f"has {len(worlds)} worlds; one is read", "<world>")
        models = [*root.findall("model"), *root.findall("world/model")]
        if not models:
            raise reading.refuse("has no <model>")
        for include in root.iter("include"):
            uri = (include.findtext("uri") or "").strip()
            raise reading.refuse(f"includes '{uri}', which is not read; put that model into this file", "<include>")
        # A joint of the world calls links by their models, even if there is one only.
        shared = [element for world in worlds for tag in ("joint", "frame") for element in world.findall(tag)]
        is_alone = len(models) == 1 and not shared
        for model in models:
            self._collect(model, "" if is_alone else f"{reading.name(model)}{SEPARATOR}", WORLD)
        for world in worlds:
            self._members(world, "", WORLD)

    def _collect(self, model: Element, scope: str, above: str) -> None:
        """Name what is in a model."""
        if model.get("placement_frame"):
            raise self.reading.refuse("placement_frame is not read; give the pose of the model", f"model '{scope}'")
        own = scope + MODEL
        self.named[own] = _Named(model, scope, above)
        if (model.findtext("static") or "").strip() in ("true", "1"):
            self.static.append(own)
        for link in model.findall("link"):
            self._name(link, scope, _Named(link, scope, own), self.links)
        self._members(model, scope, own)
        for inner in model.findall("model"):
            name = self.reading.name(inner)
            self._collect(inner, f"{scope}{name}{SEPARATOR}", own)

    def _members(self, above: Element, scope: str, own: str) -> None:
        """Name the joints and frames of a model or of the world."""
        for joint in above.findall("joint"):
            child = self._end(joint, scope, "child")
            self._name(joint, scope, _Named(joint, scope, child, child), self.joints)
        for frame in above.findall("frame"):
            carrier = (frame.get("attached_to") or "").strip()
            on = scope + carrier if carrier else own
            self._name(frame, scope, _Named(frame, scope, on, on), [])

    def _name(self, element: Element, scope: str, named: _Named, listed_in: list[str]) -> None:
        name = scope + self.reading.name(element)
        if name in (scope + WORLD, scope + MODEL):
            raise self.reading.refuse("the format keeps this name for itself", f"{element.tag} '{name}'")
        if name in self.named:
            raise self.reading.refuse("is named twice", f"{element.tag} '{name}'")
        self.named[name] = named
        listed_in.append(name)

    def _end(self, joint: Element, scope: str, tag: str) -> str:
        """Whole name of the parent or the child of a joint."""
        # Before 1.7 the name stood in an element inside.
        name = (joint.findtext(tag) or joint.findtext(f"{tag}/link") or "").strip()
        if not name:
            raise self.reading.refuse(f"<{tag}> is missing", f"joint '{joint.get('name')}'")
        return WORLD if name == WORLD else scope + name

    # --- frames -----------------------------------------------------------------------------------------------------

    def _known(self, name: str, *places: str) -> str:
        """A whole name; that of a model stands for its frame."""
        for candidate in (name, f"{name}{SEPARATOR}{MODEL}"):
            if candidate in self.named or candidate == WORLD:
                return candidate
        raise self.reading.refuse(not_known(name, "a frame", [WORLD, *self.named]), *places)

    def _frame(self, name: str, asking: tuple[str, ...] = ()) -> Frame:
        """Where a frame is in the drawing."""
        name = self._known(name, *asking[-1:])
        if name in asking:
            raise self.reading.refuse(f"frames are given in one another in a circle: {listed(asking)}", name)
        if len(asking) > DEEPEST:
            raise self.reading.refuse(f"frames are given in one another more than {DEEPEST} deep", f"'{name}'")
        if name not in self.placed:
            self.placed[name] = self._placed(name, (*asking, name))
        return self.placed[name]

    def _placed(self, name: str, asking: tuple[str, ...]) -> Frame:
        named = self.named[name]
        pose = named.element.find("pose")
        # Models stand in the scope around them.
        scope = named.scope
        if named.element.tag == "model":
            scope = SEPARATOR.join([*named.scope.split(SEPARATOR)[:-2], ""])
        relative = "" if pose is None else (pose.get("relative_to") or pose.get("frame") or "").strip()
        base = self._frame(scope + relative if relative and relative != WORLD else relative or named.default, asking)
        return base @ self._pose(pose, name)

    def _pose(self, pose: Element | None, name: str) -> Frame:
        text = "" if pose is None else (pose.text or "").strip()
        if pose is None or not text:
            return Frame()
        if pose.get("rotation_format") == "quat_xyzw":
            x = self.reading.numbers(text, 7, f"'{name}'", "<pose>")
            return Frame(x[:3], self._turned(x[[6, 3, 4, 5]], name))
        x = self.reading.numbers(text, 6, f"'{name}'", "<pose>")
        unit = math.pi / 180 if pose.get("degrees") in ("true", "1") else 1.0
        return Frame(x[:3], from_rpy(x[3:] * unit))

    def _turned(self, q: Vector, name: str) -> Matrix:
        """Rotation matrix of a quaternion of any length but zero."""
        length = float(np.linalg.norm(q))
        if length < 1e-9:
            raise self.reading.refuse("its quaternion is zero", f"'{name}'", "<pose>")
        return matrix(np.concatenate([np.zeros(3), q / length]))

    def _link(self, name: str, *places: str) -> str:
        """The link that something moves with."""
        for _ in range(len(self.named) + 1):
            name = self._known(name, *places)
            if name == WORLD or name in self.links:
                return name
            named = self.named[name]
            if named.element.tag == "model":
                inside = [link for link in self.links if link.startswith(named.scope)]
                if not inside:
                    raise self.reading.refuse(f"'{name}' has no link", *places)
                wanted = named.element.get("canonical_link")
                name = named.scope + wanted if wanted else inside[0]
            else:
                name = named.carrier
        raise self.reading.refuse("is attached to itself", *places)

    # --- bodies and joints ------------------------------------------------------------------------------------------

    def skeleton(self, stem: str, ground: str | None) -> Skeleton:
        """All of it."""
        bodies = {WORLD: Body()} | {name: self._body(name) for name in self.links}
        joints: list[Joint] = []
        for name in self.joints:
            joints += self._joint(name, bodies)
        for own in self.static:
            scope = self.named[own].scope
            joints += [fixed(WORLD, link) for link in self.links if link.startswith(scope)]
        held = [group[0] for group in floating(bodies, joints, WORLD) if ground not in group]
        if held:
            self.notes.append(f"Nothing holds these links to the world, so that they are held: {listed(held)}.")
        joints += [fixed(WORLD, link) for link in held]
        if not any(WORLD in joint.bodies for joint in joints):
            del bodies[WORLD]
        frames = {
            name: (self._link(name), self._frame(name))
            for name, named in self.named.items()
            if named.element.tag == "frame" and self._link(name) in bodies
        }
        left_out = list(counts(self.root, *LEFT_OUT))
        notes = [f"Left out: {', '.join(left_out)}."] if left_out else []
        shapes = [name for name in self.links if self.named[name].element.find("inertial[@auto='true']") is not None]
        if shapes:
            notes.append(f"Masses that follow from collision shapes are left out: {listed(shapes)}.")
        gravity = self.root.findtext("world/gravity")
        gx, gy, gz = map(float, self.reading.vector(gravity, STANDARD_GRAVITY, "world", "<gravity>"))
        return Skeleton(
            title=next(iter(self.named.values())).element.get("name") or stem,
            bodies=bodies,
            joints=tuple(joints),
            ground=WORLD if WORLD in bodies else self.links[0],
            frames=frames,
            gravity=(gx, gy, gz),
            notes=(*notes, *self.notes),
        )

    def _body(self, name: str) -> Body:
        frame = self._frame(name)
        inertial = self.named[name].element.find("inertial")
        if inertial is None or inertial.get("auto") == "true":
            return Body(frame)
        place = f"link '{name}'"
        mass = self.reading.number(inertial.findtext("mass"), 1.0, place, "<mass>")
        own = frame @ self._pose(inertial.find("pose"), place)
        # For moments that are not written SDF has 1 kg m^2, which is nobody's wish.
        moments = {name: inertial.findtext(f"inertia/{name}") for name in MOMENTS}
        matrix = self.reading.inertia(moments, place, "<inertia>")
        return Body(frame, mass, own.at, own.axes @ matrix @ own.axes.T)

    def _joint(self, name: str, bodies: dict[str, Body]) -> Iterator[Joint]:
        named = self.named[name]
        element, place = named.element, f"joint '{name}'"
        written = element.get("type") or ""
        if written not in (*KINDS, *DOUBLE):
            raise self.reading.refuse(not_known(written, "a type of joint", (*KINDS, *DOUBLE)), place)
        ends = [self._end(element, named.scope, tag) for tag in ("parent", "child")]
        one, other = (self._link(end, place) for end in ends)
        frame = self._frame(name)
        if written == "gearbox":
            self.notes.append(f"The ratio of the gearbox '{name}' is left out.")
        if written in DOUBLE:
            cross = free(f"{name}-cross", bodies)
            bodies[cross] = Body(frame)
            first, second = (free(f"{name}-{which}", self.joints) for which in ("first", "second"))
            yield self._pin(first, (one, cross), frame, element.find("axis"), named, "revolute")
            yield self._pin(second, (cross, other), frame, element.find("axis2"), named, "revolute")
        elif written in ("fixed", "ball"):
            yield Joint(name, KINDS[written], (one, other), Attachment(frame.at))
        else:
            yield self._pin(name, (one, other), frame, element.find("axis"), named, KINDS[written])

    def _pin(
        self, name: str, bodies: tuple[str, str], frame: Frame, axis: Element | None, named: _Named, kind: str
    ) -> Joint:
        place = f"joint '{name}'"
        if axis is None:
            raise self.reading.refuse(f"<axis> is missing, which a {kind} joint needs", place)
        low = self.reading.number(_finite(axis.findtext("limit/lower")), -math.inf, place, "<lower>")
        high = self.reading.number(_finite(axis.findtext("limit/upper")), math.inf, place, "<upper>")
        return Joint(
            name=name,
            kind=kind,
            bodies=bodies,
            place=Attachment(frame.at, self._axis(axis, frame, named, place)),
            limits=(low, high),
            follows=self._follows(axis, named.scope, place),
            lead=self._lead(named.element, place) if kind == "screw" else 0.0,
        )

    def _axis(self, axis: Element, frame: Frame, named: _Named, place: str) -> Vector:
        xyz = axis.find("xyz")
        along = self.reading.axis(None if xyz is None else xyz.text, (0.0, 0.0, 1.0), place, "<xyz>")
        expressed = "" if xyz is None else (xyz.get("expressed_in") or "").strip()
        in_model = (axis.findtext("use_parent_model_frame") or "").strip() in ("true", "1")
        if expressed:
            frame = self._frame(WORLD if expressed == WORLD else named.scope + expressed, (place,))
        elif in_model or self.version < (1, 5):
            frame = self._frame(named.scope + MODEL)
        return np.asarray(frame.axes @ along)

    def _follows(self, axis: Element, scope: str, place: str) -> tuple[str, float, float] | None:
        mimic = axis.find("mimic")
        if mimic is None:
            return None
        factor = self.reading.number(mimic.findtext("multiplier"), 1.0, place, "<mimic>")
        offset = self.reading.number(mimic.findtext("offset"), 0.0, place, "<mimic>")
        reference = self.reading.number(mimic.findtext("reference"), 0.0, place, "<mimic>")
        return scope + (mimic.get("joint") or ""), factor, offset - factor * reference

    def _lead(self, joint: Element, place: str) -> float:
        """Travel for one turn. The older key is in rad/m, and positive for a left-hand thread."""
        lead = self.reading.number(joint.findtext("screw_thread_pitch"), 0.0, place, "<screw_thread_pitch>")
        older = self.reading.number(joint.findtext("thread_pitch"), 0.0, place, "<thread_pitch>")
        if not lead and not older:
            raise self.reading.refuse("<screw_thread_pitch> is needed", place)
        return lead or -2 * math.pi / older


def _finite(text: str | None) -> str | None:
    """A limit; those that are infinite are none."""
    try:
        return None if text is None or not math.isfinite(float(text)) else text
    except ValueError:
        return text
