"""URDF: a tree of links; the frame of a joint is that of its child link, and the drawing has all coordinates zero.

The format is described at https://wiki.ros.org/urdf/XML. It is read here and not by a library: the part that matters is
links, joints, origins and masses, and the libraries that read it bring meshes with them.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree.ElementTree import Element

from jointplay.errors import listed, not_known

from .options import Options
from .rotations import from_rpy
from .skeleton import Attachment, Body, Frame, Joint, Skeleton
from .xml import Reading, counts, parse, refuse_twice

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
    *("transmission", "transmissions", "safety_controller", "safety controllers", "calibration", "calibrations"),
    *("sensor", "sensors", "gazebo", "entries for Gazebo"),
)


def read(path: Path, options: Options) -> Skeleton:  # noqa: ARG001 - all formats are called alike
    """A robot in URDF.

    Raises
    ------
    InputError
        When the file is not a tree of links that has one root.
    """
    reading = Reading(str(path))
    robot = parse(path, "robot", "URDF")
    if any(element.tag.startswith("xacro:") for element in robot.iter()):
        raise reading.refuse("has macros of xacro; `xacro FILE > robot.urdf` writes the URDF of it")
    links = {reading.name(link): link for link in robot.findall("link")}
    refuse_twice(reading, [reading.name(link) for link in robot.findall("link")], "links")
    joints = list(robot.findall("joint"))
    refuse_twice(reading, [reading.name(joint) for joint in joints], "joints")
    if not links:
        raise reading.refuse("has no <link>")
    frames, root = _frames(reading, links, joints)
    bodies = {name: _body(reading, name, link, frames[name]) for name, link in links.items()}
    driven = {element.get("name") for element in robot.findall("transmission/joint")}
    floating = [reading.name(joint) for joint in joints if joint.get("type") == FLOATING]
    left_out = list(counts(robot, *LEFT_OUT))
    notes = [f"Left out: {', '.join(left_out)}."] if left_out else []
    if floating:
        notes.append(f"Floating joints are held where they are drawn: {listed(floating)}.")
    return Skeleton(
        title=(robot.get("name") or path.stem).strip(),
        bodies=bodies,
        joints=tuple(_joint(reading, joint, frames, driven) for joint in joints),
        ground=root,
        notes=tuple(notes),
    )


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


def _frames(reading: Reading, links: Mapping[str, Element], joints: list[Element]) -> tuple[dict[str, Frame], str]:
    """Frames of all links in that of the root, and the root."""
    above: dict[str, tuple[str, Element]] = {}
    for joint in joints:
        parent, child = _ends(reading, joint, links)
        if child in above:
            other = above[child][1].get("name")
            problem = (
                f"link '{child}' is already the child of joint '{other}', and URDF has no loops; leave this joint out "
                "and name it with --loop"
            )
            raise reading.refuse(problem, f"joint '{joint.get('name')}'")
        above[child] = (parent, joint)
    roots = [name for name in links if name not in above]
    if len(roots) != 1:
        what = f"several links without a parent: {listed(roots)}" if roots else "no link without a parent"
        raise reading.refuse(f"has {what}; one root is needed that all others hang on")
    frames = {roots[0]: Frame()}
    below: dict[str, list[str]] = {}
    for child, (parent, _) in above.items():
        below.setdefault(parent, []).append(child)
    waiting = [roots[0]]
    while waiting:
        parent = waiting.pop()
        for child in below.get(parent, ()):
            joint = above[child][1]
            frames[child] = frames[parent] @ _origin(reading, joint, f"joint '{joint.get('name')}'")
            waiting.append(child)
    apart = [name for name in links if name not in frames]
    if apart:
        raise reading.refuse(f"links hang on one another in a circle: {listed(apart)}")
    return frames, roots[0]


def _origin(reading: Reading, element: Element | None, *places: str) -> Frame:
    origin = None if element is None else element.find("origin")
    if origin is None:
        return Frame()
    where = (*places, "<origin>")
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
    centre = _origin(reading, inertial, place).at
    return Body(frame, kilograms, frame.point(centre))


def _joint(reading: Reading, joint: Element, frames: Mapping[str, Frame], driven: set[str | None]) -> Joint:
    name = reading.name(joint)
    place = f"joint '{name}'"
    written = joint.get("type") or ""
    if written not in (*KINDS, FLOATING):
        raise reading.refuse(not_known(written, "a type of joint", (*KINDS, FLOATING)), place)
    kind = KINDS.get(written, "fixed")
    parent, child = (joint.find(tag).get("link").strip() for tag in ("parent", "child"))  # type: ignore[union-attr]
    frame = frames[child]
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
        is_driven=name in driven,
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
