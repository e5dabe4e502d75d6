"""URDF: a tree of links; the frame of a joint is that of its child link, and the drawing has all coordinates zero.

The format is described at https://wiki.ros.org/urdf/XML. It is read here and not by a library: the part that matters is
links, joints, origins and masses, and the libraries that read it bring meshes with them.

The format knows of no loops, but files have them. The first joint of a link says where it is; every further one of
which it is the child too closes a loop, and sits on both of its links where its parent has it in the drawing. Other
programs add elements, which are read as well: `<loop_joint>` of Isaac Sim; links ``closing_NAME_1`` and
``closing_NAME_2`` of onshape-to-robot, which coincide; joints of SDF, and detachable joints, in `<gazebo>`.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from jointplay.errors import listed, not_known

from .options import Options
from .rotations import from_rpy
from .skeleton import Attachment, Body, Frame, Joint, Skeleton, Vector, fixed, free
from .xml import MOMENTS, Reading, counts, parse, refuse_twice

#: type of URDF: kind of the mechanism file
KINDS = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "fixed": "fixed",
    "planar": "planar",
}
#: held where it is drawn
FLOATING = "floating"
#: what is left out, in singular and plural
LEFT_OUT = (
    *("visual", "visual shapes", "collision", "collision shapes", "dynamics", "entries of friction and damping"),
    *("safety_controller", "safety controllers", "calibration", "calibrations"),
    *("sensor", "sensors"),
)
#: joints that close loops: type of Isaac Sim or SDF: kind of the mechanism file, and whether it has an axis
CLOSING = {
    **dict.fromkeys(("revolute", "continuous"), ("revolute", True)),
    "prismatic": ("prismatic", True),
    **dict.fromkeys(("spherical", "ball"), ("spherical", False)),
    "fixed": ("fixed", False),
}
#: links of which two with one name coincide
COINCIDE = re.compile(r"(closing_.+)_[12]")


def read(path: Path, options: Options) -> Skeleton:  # noqa: ARG001 - all formats are called alike
    """A robot in URDF.

    Raises
    ------
    InputError
        When the file is not a tree of links that has one root.
    """
    return described(Reading(str(path)), parse(path, "robot", "URDF"), path.stem)


def described(reading: Reading, robot: Element, stem: str) -> Skeleton:
    """What an element `robot` says.

    Raises
    ------
    InputError
        When it is not a tree of links that has one root.
    """
    if any(element.tag.startswith("xacro:") for element in robot.iter()):
        raise reading.refuse("has macros of xacro; `xacro FILE > robot.urdf` writes the URDF of it")
    links = {reading.name(link): link for link in robot.findall("link")}
    refuse_twice(reading, [reading.name(link) for link in robot.findall("link")], "links")
    joints = list(robot.findall("joint"))
    refuse_twice(reading, [reading.name(joint) for joint in joints], "joints")
    if not links:
        raise reading.refuse("has no <link>")
    frames, root, closing = _frames(reading, links, joints)
    bodies = {name: _body(reading, name, link, frames[name]) for name, link in links.items()}
    motors = _motors(reading, robot)
    floating = [reading.name(joint) for joint in joints if joint.get("type") == FLOATING]
    left_out = list(counts(robot, *LEFT_OUT))
    gazebo = sum(not all(map(_is_joint, element)) for element in robot.findall("gazebo") if len(element))
    if gazebo:
        left_out.append(f"{gazebo} {'entries' if gazebo > 1 else 'entry'} for Gazebo")
    notes = [f"Left out: {', '.join(left_out)}."] if left_out else []
    if floating:
        notes.append(f"Floating joints are held where they are drawn: {listed(floating)}.")
    if closing:
        said = listed(f"{joint.get('name')} of {_ends(reading, joint, links)[1]}" for joint in closing)
        notes.append(f"These joints have a child that hangs on another joint, and close loops: {said}.")
    made = [_joint(reading, joint, _parted(reading, joint, links, frames), motors) for joint in joints]
    for joint in (added := [*_loop_joints(reading, robot, frames), *_gazebo_joints(reading, robot, frames)]):
        made.append(replace(joint, name=free(joint.name, {one.name for one in made})))
    if added:
        notes.append(f"Joints of other programs close loops: {listed(joint.name for joint in added)}.")
    for joint in (coinciding := _coinciding(frames)):
        made.append(replace(joint, name=free(joint.name, {one.name for one in made})))
    if coinciding:
        names = listed(joint.name for joint in coinciding)
        notes.append(f"Links that coincide close loops, as balls, because nothing says how they turn: {names}.")
    attached, elsewhere = _detachable(reading, robot, frames)
    made += attached
    if attached:
        notes.append(f"Detachable joints hold these links: {listed(joint.bodies[1] for joint in attached)}.")
    if elsewhere:
        notes.append(f"Detachable joints to other models are left out: {listed(elsewhere)}.")
    reduced = [f"{joint.name} {joint.reduction:g}" for joint in made if joint.reduction]
    if reduced:
        notes.append(
            f"Reductions of transmissions are named at the drives, which count at the joints: {listed(reduced)}."
        )
    several = [reading.name(element) for element in robot.iter("transmission") if len(element.findall("joint")) > 1]
    if several:
        notes.append(f"Transmissions of several joints are left out, each of which is driven: {listed(several)}.")
    return Skeleton(
        title=(robot.get("name") or stem).strip(),
        bodies=bodies,
        joints=tuple(made),
        ground=root,
        notes=tuple(notes),
    )


# --- motors ---------------------------------------------------------------------------------------------------------


def _motors(reading: Reading, robot: Element) -> dict[str, float]:
    """Joints with a motor, with the turns of the motor for one of the joint; 0 where the file does not say."""
    found = {
        (element.get("name") or "").strip(): 0.0 for element in robot.findall("ros2_control/joint[command_interface]")
    }
    for element in robot.iter("transmission"):
        ends = element.findall("joint")
        for end in ends:
            name = (end.get("name") or "").strip()
            place = f"transmission '{element.get('name')}'"
            ratios = [
                reading.number(ratio.text, 0.0, place, f"<{ratio.tag}>")
                for part in (end, *element.findall("actuator"))
                for ratio in (*part.findall("mechanicalReduction"), *part.findall("mechanical_reduction"))
            ]
            # Of several joints it is a matrix.
            ratio = float(np.prod(ratios)) if ratios and len(ends) == 1 else 0.0
            found[name] = ratio if ratio != 1.0 else 0.0
    return found


# --- the tree -------------------------------------------------------------------------------------------------------


def _ends(reading: Reading, joint: Element, links: Mapping[str, Element]) -> tuple[str, str]:
    """Names of the parent and the child link."""
    place = f"joint '{joint.get('name')}'"
    found = []
    for tag in ("parent", "child"):
        element = joint.find(tag)
        link = "" if element is None else (element.get("link") or "").strip()
        if not link:
            raise reading.refuse(f'<{tag} link="..."> is missing', place)
        if link not in links:
            raise reading.refuse(not_known(link, "a link", links), place, f"<{tag}>")
        found.append(link)
    return found[0], found[1]


def _frames(
    reading: Reading, links: Mapping[str, Element], joints: list[Element]
) -> tuple[dict[str, Frame], str, list[Element]]:
    """Frames of all links in that of the root, the root, and joints whose child another joint carries."""
    ends = {reading.name(joint): _ends(reading, joint, links) for joint in joints}
    above: dict[str, str] = {}
    for name, (_, child) in ends.items():
        above.setdefault(child, name)
    roots = [name for name in links if name not in above]
    if len(roots) != 1:
        what = f"several links without a parent: {listed(roots)}" if roots else "no link without a parent"
        raise reading.refuse(f"has {what}; one root is needed that all others hang on")
    frames = {roots[0]: Frame()}
    tree: set[str] = set()

    def place(candidates: Iterable[Element], *, once: bool = False) -> bool:
        """Place links that hang on placed ones; say whether there was one."""
        grown = False
        for joint in candidates:
            name = reading.name(joint)
            parent, child = ends[name]
            if parent in frames and child not in frames:
                frames[child] = frames[parent] @ _origin(reading, joint, f"joint '{name}'")
                tree.add(name)
                grown = True
                if once:
                    break
        return grown

    first = [joint for joint in joints if above[ends[reading.name(joint)][1]] == reading.name(joint)]
    # Where the first joint of a link hangs on what it carries, another one has to carry it.
    while place(first) or place(joints, once=True):
        pass
    apart = [name for name in links if name not in frames]
    if apart:
        raise reading.refuse(f"links hang on one another in a circle: {listed(apart)}")
    return frames, roots[0], [joint for joint in joints if reading.name(joint) not in tree]


def _parted(reading: Reading, joint: Element, links: Mapping[str, Element], frames: Mapping[str, Frame]) -> Frame:
    """Frame of a joint: where its parent has it."""
    parent, _ = _ends(reading, joint, links)
    return frames[parent] @ _origin(reading, joint, f"joint '{joint.get('name')}'")


def _origin(reading: Reading, element: Element | None, *places: str) -> Frame:
    origin = None if element is None else element.find("origin")
    return Frame() if origin is None else _pose(reading, origin, *places, "<origin>")


def _pose(reading: Reading, origin: Element, *where: str) -> Frame:
    rpy = reading.vector(origin.get("rpy"), (0.0, 0.0, 0.0), *where)
    return Frame(reading.vector(origin.get("xyz"), (0.0, 0.0, 0.0), *where), from_rpy(rpy))


def _body(reading: Reading, name: str, link: Element, frame: Frame) -> Body:
    inertial = link.find("inertial")
    if inertial is None:
        return Body(frame)
    place = f"link '{name}'"
    mass = inertial.find("mass")
    if mass is not None and mass.get("value") is None:
        raise reading.refuse("its value is missing: <mass value=...>", place, "<mass>")
    kilograms = reading.number(None if mass is None else mass.get("value"), 0.0, place, "<mass>")
    own = _origin(reading, inertial, place)
    inertia = inertial.find("inertia")
    moments = {} if inertia is None else inertia.attrib
    matrix = reading.inertia({name: moments.get(name) for name in MOMENTS}, place, "<inertia>")
    turn = frame.axes @ own.axes
    return Body(frame, kilograms, frame.point(own.at), turn @ matrix @ turn.T)


def _joint(reading: Reading, joint: Element, frame: Frame, motors: Mapping[str, float]) -> Joint:
    name = reading.name(joint)
    place = f"joint '{name}'"
    written = joint.get("type") or ""
    if written not in (*KINDS, FLOATING):
        raise reading.refuse(not_known(written, "a type of joint", (*KINDS, FLOATING)), place)
    kind = KINDS.get(written, "fixed")
    parent, child = (joint.find(tag).get("link").strip() for tag in ("parent", "child"))  # type: ignore[union-attr]
    axis = None
    if kind != "fixed":
        element = joint.find("axis")
        along = reading.axis(None if element is None else element.get("xyz"), (1.0, 0.0, 0.0), place, "<axis>")
        axis = frame.axes @ along
    return Joint(
        name=name,
        kind=kind,
        bodies=(parent, child),
        place=Attachment(frame.at, axis),
        limits=_limits(reading, joint, place) if written in ("revolute", "prismatic") else None,
        is_driven=name in motors,
        reduction=motors.get(name, 0.0),
        follows=_follows(reading, joint, place),
    )


def _limits(reading: Reading, joint: Element, place: str) -> tuple[float, float] | None:
    limit = joint.find("limit")
    if limit is None:
        return None
    low = reading.number(limit.get("lower"), 0.0, place, "<limit>")
    high = reading.number(limit.get("upper"), 0.0, place, "<limit>")
    # Without either, both are zero by default: the file says efforts only.
    return (low, high) if low or high else None


def _follows(reading: Reading, joint: Element, place: str) -> tuple[str, float, float] | None:
    mimic = joint.find("mimic")
    if mimic is None:
        return None
    leader = (mimic.get("joint") or "").strip()
    factor = reading.number(mimic.get("multiplier"), 1.0, place, "<mimic>")
    return leader, factor, reading.number(mimic.get("offset"), 0.0, place, "<mimic>")


# --- loops of other programs ----------------------------------------------------------------------------------------


def _loop_joints(reading: Reading, robot: Element, frames: Mapping[str, Frame]) -> Iterator[Joint]:
    """Those of Isaac Sim, with a place on each of two links. In its documentation both are called `link1`."""
    for element in robot.findall("loop_joint"):
        name = reading.name(element)
        place = f"loop_joint '{name}'"
        ends = [*element.findall("link1"), *element.findall("link2")]
        if len(ends) != 2:
            raise reading.refuse("needs two links: <link1 link=...> and <link2 link=...>", place)
        one, other = ((end.get("link") or "").strip() for end in ends)
        kind, axis = _closing(reading, element, place)
        first, second = (
            Attachment(pose.at, None if axis is None else pose.axes @ axis)
            for pose in (
                _known(reading, link, frames, place) @ _pose(reading, end, place)
                for link, end in zip((one, other), ends, strict=True)
            )
        )
        yield Joint(name, kind, (one, other), first, second)


def _gazebo_joints(reading: Reading, robot: Element, frames: Mapping[str, Frame]) -> Iterator[Joint]:
    """Joints of SDF: drawn closed, in the frame of their child."""
    for element in robot.findall("gazebo/joint"):
        name = reading.name(element)
        place = f"<gazebo> joint '{name}'"
        one, other = (element.findtext(tag, "").strip() for tag in ("parent", "child"))
        _known(reading, one, frames, place)
        frame = _known(reading, other, frames, place)
        if pose := element.findtext("pose", "").strip():
            x = reading.numbers(pose, 6, place, "<pose>")
            frame = frame @ Frame(x[:3], from_rpy(x[3:]))
        kind, axis = _closing(reading, element, place)
        if axis is not None and element.findtext("axis/use_parent_model_frame", "").strip() not in ("1", "true"):
            axis = frame.axes @ axis
        yield Joint(name, kind, (one, other), Attachment(frame.at, axis))


def _is_joint(element: Element) -> bool:
    """Whether an entry for Gazebo is a joint of SDF or a detachable one, which are read."""
    return element.tag == "joint" or (element.tag == "plugin" and "DetachableJoint" in (element.get("name") or ""))


def _detachable(reading: Reading, robot: Element, frames: Mapping[str, Frame]) -> tuple[list[Joint], list[str]]:
    """Detachable joints of Gazebo within the robot, and what they hold elsewhere."""
    attached, elsewhere = [], []
    for plugin in robot.findall("gazebo/plugin"):
        if not _is_joint(plugin):
            continue
        one, model, other = (plugin.findtext(tag, "").strip() for tag in ("parent_link", "child_model", "child_link"))
        place = f"<gazebo> detachable joint of '{one}'"
        _known(reading, one, frames, place)
        if model in ("", "__model__", robot.get("name")):
            _known(reading, other, frames, place)
            attached.append(fixed(one, other))
        else:
            elsewhere.append(f"{model} on {one}")
    return attached, elsewhere


def _coinciding(frames: Mapping[str, Frame]) -> list[Joint]:
    """Balls between links that coincide."""
    names = [match[1] for link in frames if (match := COINCIDE.fullmatch(link))]
    return [
        Joint(name, "spherical", (one, other), Attachment(frames[one].at), Attachment(frames[other].at))
        for name in dict.fromkeys(names)
        if (one := f"{name}_1") in frames and (other := f"{name}_2") in frames
    ]


def _known(reading: Reading, link: str, frames: Mapping[str, Frame], place: str) -> Frame:
    if link not in frames:
        raise reading.refuse(not_known(link, "a link", frames), place)
    return frames[link]


def _closing(reading: Reading, element: Element, place: str) -> tuple[str, Vector | None]:
    """Kind and axis of a joint that closes a loop."""
    written = element.get("type") or ""
    if written not in CLOSING:
        raise reading.refuse(not_known(written, "a joint that closes a loop", CLOSING), place)
    kind, has_axis = CLOSING[written]
    if not has_axis:
        return kind, None
    axis = element.find("axis")
    given = None if axis is None else axis.get("xyz") or axis.findtext("xyz")
    if given is None:
        raise reading.refuse(f"<axis> is missing, which a {kind} joint needs", place)
    return kind, reading.axis(given, (1.0, 0.0, 0.0), place, "<axis>")
