"""Drawings of PMKS+, whose links hold the whole mechanism behind a question mark, and whose files are that text.

    booleans . scale . speed,frame . units . joint. joint. .. link. .. force. .. selection and check character

Each joint, link and force is a list with commas, whose first field begins with flags. A number is written with the
base 64 and 0 for a minus sign, and counts thousandths where it is no whole one. A link is a body; one that is welded of
others comes with these, and has the mass of all.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from string import ascii_lowercase, ascii_uppercase, digits
from typing import NoReturn
from urllib.parse import unquote

import numpy as np

from jointplay.basics.foreign import LINK
from jointplay.basics.units import FORCES, LENGTHS
from jointplay.errors import InputError, in_range, listed, not_known, shown
from jointplay.file import toml

from .options import Options
from .pins import choose_output, pins, require_connected, said_of_speed
from .skeleton import (
    GROUND,
    STANDARD_GRAVITY,
    AppliedForce,
    Attachment,
    Body,
    Frame,
    Joint,
    Skeleton,
    Vector,
    free,
    free_names,
)

#: what a link is called in messages and in the file
LINK_NAME = "link of PMKS+"
#: characters, as the program reads them
LONGEST = 1 << 20
#: joints, links and forces, each
MOST_RECORDS = 1000
DIGITS = f"{digits}{ascii_uppercase}{ascii_lowercase}_-"
NUMBER = re.compile(r"[\w-]{1,11}", re.ASCII)
#: the check character is the length modulo the number of these
CHECKS = DIGITS[:62]
#: kg, and kg m^2, by the unit of length: lb and lb in^2, g and kg cm^2, kg and kg m^2
POUND = 0.45359237
UNITS = (
    (LENGTHS["in"], POUND, POUND * LENGTHS["in"] ** 2),
    (LENGTHS["cm"], 1e-3, LENGTHS["cm"] ** 2),
    (LENGTHS["m"], 1.0, 1.0),
)
FORCE_UNITS = (FORCES["lbf"], FORCES["N"])
#: flags of links that are bodies, and of those that others are welded of
ROOTS, PARTS = "YAMG0123", "Namg4567"


@dataclass(frozen=True)
class DrawnJoint:
    """A joint record; the angle is that of its guide, rad."""

    name: str
    at: Vector
    angle: float
    slides: bool
    is_input: bool
    is_grounded: bool
    is_traced: bool


@dataclass(frozen=True)
class DrawnLink:
    """A link record; `parts` are those that it is welded of."""

    name: str
    is_root: bool
    is_piston: bool
    mass: float
    inertia: float
    centre: Vector
    joints: tuple[str, ...]
    parts: tuple[str, ...]


@dataclass(frozen=True)
class SharedDrawing:
    """What a text holds. Joints and links are by their identifiers, numbers in SI units."""

    joints: Mapping[str, DrawnJoint]
    links: Mapping[str, DrawnLink]
    forces: tuple[tuple[str, AppliedForce], ...]
    speed: int
    is_clockwise: bool
    has_gravity: bool


def read(path: Path, options: Options) -> Skeleton:
    """The mechanism of a file that PMKS+ saved, or that has a link in it.

    Raises
    ------
    InputError
        When it is no such text, or has what the mechanism file has not.
    """
    _, text = toml.read(path, "drawing of PMKS+")
    found = LINK.search(text)
    return linked(found[0], options, path.stem) if found else _skeleton(_drawing(text.strip()), options, path.stem)


def linked(link: str, options: Options, title: str = "PMKS+") -> Skeleton:
    """The mechanism of a link; nothing is fetched.

    Raises
    ------
    InputError
        As `read` does.
    """
    _, mark, text = link.partition("?")
    if not mark:
        raise InputError("has no drawing behind a '?', as links of PMKS+ have: https://app.pmksplus.com/?0P.TY.K,0...")
    return _skeleton(_drawing(unquote(text)), options, title)


# --- the text -------------------------------------------------------------------------------------------------------


def _drawing(text: str) -> SharedDrawing:
    in_range(len(text), "", "a length that is read", 2, LONGEST)
    if text.startswith("pmks") or "*" in text:
        raise InputError("is of a coming version of PMKS+, whose format may still change; links of PMKS+ 2 are read")
    if text[1] == "=":
        raise InputError("is of an early PMKS+, whose links begin with '?j='; links of PMKS+ 2 are read")
    # The program counts as UTF-16 does.
    length = len(text.encode("utf-16-le", "surrogatepass")) // 2 - 1
    if text[-1] != CHECKS[length % len(CHECKS)]:
        raise InputError("its last character does not fit its length: a part is missing; copy or save it again")
    sections = iter(text[:-1].split("."))
    flags, scale, numbers, units = (next(sections, "") for _ in range(4))
    if not re.fullmatch("[012][01][01][0-3]?", units):
        _refuse("units", "digits for inch, cm or m, degrees or radians, lbf or N are needed, such as 101", units)
    joints, links, forces = (_records(sections, what) for what in ("joints", "links", "forces"))
    if len(scale.split(",")) > 1 or len([*sections]) > 1:
        raise InputError("is of a development version of PMKS+, which is not read; links of PMKS+ 2 are read")
    bits = _digits(flags, "settings")
    length_unit, mass_unit, inertia_unit = UNITS[int(units[0])]
    return SharedDrawing(
        joints=dict(_joint(fields, length_unit) for fields in joints),
        links=dict(_link(fields, length_unit, mass_unit, inertia_unit) for fields in links),
        forces=tuple(_force(fields, length_unit, FORCE_UNITS[int(units[2])]) for fields in forces),
        speed=_digits(numbers.split(",")[0], "settings"),
        is_clockwise=bool(bits & 1),
        has_gravity=bool(bits & 2),
    )


def _records(sections: Iterator[str], what: str) -> list[list[str]]:
    """The fields of the records up to the next empty section."""
    found: list[list[str]] = []
    for section in sections:
        if not section:
            break
        found.append(section.split(","))
    else:
        if what != "forces":
            raise InputError("its text ends before they do; copy or save it again", key=what)
    in_range(len(found), what, "a number of them that is read", 0, MOST_RECORDS)
    flags = 2 if what == "links" else 1
    twice = [name for name, count in Counter(fields[0][flags:] for fields in found).items() if count > 1]
    if twice:
        raise InputError(f"are there more than once: {listed(twice)}", key=what)
    return found


def _refuse(key: str, problem: str, value: object) -> NoReturn:
    raise InputError(f"{problem}, not {shown(value)}", key=key)


def _digits(text: str, key: str) -> int:
    if not NUMBER.fullmatch(text):
        _refuse(key, "a number with digits of PMKS+ is needed", text)
    total = 0
    for digit in text:
        total = total * len(DIGITS) + DIGITS.index(digit)
    return total


def _numbers(texts: Sequence[str], key: str) -> list[float]:
    return [_digits(text, key) / (-1000 if text[0] == "0" else 1000) for text in texts]


def _joint(fields: list[str], unit: float) -> tuple[str, DrawnJoint]:
    own = fields[0][1:]
    key = f"joints.{own}"
    bits = _digits(fields[0][:1], key)
    if len(fields) != 5 or bits > 31:
        raise InputError("is a joint of a development version of PMKS+; joints of PMKS+ 2 have five fields", key=key)
    x, y, angle = _numbers(fields[2:], key)
    slides, is_input, is_grounded, is_welded, is_traced = (bool(bits >> place & 1) for place in range(5))
    if slides and (is_welded or not is_grounded):
        raise InputError("slides on a link, or is welded: only sliders on the ground are read", key=key)
    joint = DrawnJoint(fields[1] or own, np.array([x, y, 0.0]) * unit, angle, slides, is_input, is_grounded, is_traced)
    return own, joint


def _link(fields: list[str], unit: float, mass_unit: float, inertia_unit: float) -> tuple[str, DrawnLink]:
    flags, own = fields[0][:2], fields[0][2:]
    key = f"links.{own}"
    if len(fields) < 9 or "" not in fields[7:] or flags[:1] not in ROOTS + PARTS or flags[1:] not in ("R", "P"):
        _refuse(key, "a link of PMKS+ is needed, such as YRAB,AB,Fe,Fe,0ix,08i,c5cae9,A,B,,", ",".join(fields))
    mass, inertia, x, y = _numbers(fields[2:6], key)
    end = fields.index("", 7)
    link = DrawnLink(
        name=fields[1] or own,
        is_root=flags[0] in ROOTS,
        is_piston=flags[1] == "P",
        mass=mass * mass_unit,
        inertia=inertia * inertia_unit,
        centre=np.array([x, y, 0.0]) * unit,
        joints=tuple(fields[7:end]),
        parts=tuple(part for part in fields[end:] if part),
    )
    return own, link


def _force(fields: list[str], unit: float, force_unit: float) -> tuple[str, AppliedForce]:
    """The link and the force on it, at the start of its arrow; an arrow that is drawn inward points the other way."""
    own = fields[0][1:]
    key = f"forces.{own}"
    if len(fields) != 8:
        _refuse(key, "a force of PMKS+ with eight fields is needed", ",".join(fields))
    bits = _digits(fields[0][:1], key)
    x, y, end_x, end_y, size = _numbers(fields[3:], key)
    along = np.array([end_x - x, end_y - y, 0.0])
    length = float(np.linalg.norm(along))
    if not length:
        raise InputError("its arrow has no length, and with it no direction", key=key)
    force = along / length * size * force_unit * (1.0 if bits & 2 else -1.0)
    return fields[1], AppliedForce("", np.array([x, y, 0.0]) * unit, force, is_follower=bool(bits & 1))


# --- the mechanism --------------------------------------------------------------------------------------------------


def _skeleton(drawing: SharedDrawing, options: Options, title: str) -> Skeleton:
    joints, links = drawing.joints, drawing.links
    body_of = _bodies(drawing)
    held = {own: _held(own, drawing) for own, link in links.items() if link.is_root}
    names = free_names({own: links[own].name for own in held}, [GROUND])
    called = free_names({own: joint.name for own, joint in joints.items()}, [GROUND])
    found: list[Joint] = []
    frames: dict[str, tuple[str, Frame]] = {}
    traced: list[str] = []
    for own, joint in joints.items():
        on = [link for link in held if own in held[link]]
        made = [*_made(called[own], joint, [names[link] for link in on], [links[link] for link in on])]
        if joint.is_input and not any(one.is_driven for one in made):
            raise InputError("is an input, but does not join exactly two links", key=f"joints.{own}")
        in_range(len(found) + len(made), "joints", "a number of pins that is read", 0, MOST_RECORDS)
        found += [replace(one, name=free(one.name, {other.name for other in found})) for one in made]
        if on and (joint.slides or not joint.is_grounded) and names[on[-1]] != options.ground:
            frames[called[own]] = (names[on[-1]], Frame(joint.at))
            traced += [called[own]] * joint.is_traced
    require_connected(names.values(), GROUND, found, "links")
    turning = [joint.name for joint in joints.values() if joint.is_input and not joint.slides]
    notes = [said_of_speed(turning, drawing.speed, drawing.is_clockwise)] if turning else []
    if options.output is None:
        notes += choose_output(frames, traced, found)
    return Skeleton(
        title=title,
        bodies={GROUND: Body(), **{names[own]: _body(links[own], joints) for own in held}},
        joints=tuple(found),
        space="planar",
        frames=frames,
        has_origins=False,
        gravity=(0.0, STANDARD_GRAVITY[2], 0.0) if drawing.has_gravity else (0.0, 0.0, 0.0),
        forces=tuple(force.on(names[_on(link, body_of)]) for link, force in drawing.forces),
        notes=tuple(notes),
    )


def _bodies(drawing: SharedDrawing) -> dict[str, str]:
    """The root link of every link."""
    body_of: dict[str, str] = {own: own for own, link in drawing.links.items() if link.is_root}
    for own, link in drawing.links.items():
        for part in link.parts:
            if part not in drawing.links or part in body_of or not link.is_root:
                problem = "is no part of one welded link alone" if part in drawing.links else "is no link"
                raise InputError(f"'{part}' {problem}", key=f"links.{own}")
            body_of[part] = own
    loose = [own for own in drawing.links if own not in body_of]
    if loose:
        raise InputError(f"are parts of no welded link: {listed(loose)}", key="links")
    return body_of


def _held(own: str, drawing: SharedDrawing) -> dict[str, None]:
    """The joints of a body, by their identifiers."""
    link = drawing.links[own]
    held = dict.fromkeys(joint for one in (own, *link.parts) for joint in drawing.links[one].joints)
    for joint in held:
        if joint not in drawing.joints:
            raise InputError(not_known(joint, "a joint", drawing.joints), key=f"links.{own}")
    return held


def _made(name: str, joint: DrawnJoint, bodies: list[str], links: list[DrawnLink]) -> Iterator[Joint]:
    """The joint of the mechanism file; a slider is a body of its own, which the next link turns on."""
    if not joint.slides:
        around = [GROUND, *bodies] if joint.is_grounded else bodies
        yield from pins(name, around, joint.at, joint.is_input and len(around) == 2)
        return
    if len(links) != 1 or not links[0].is_piston:
        raise InputError("has no slider of its own, which PMKS+ draws there; add it anew", key=f"joints.{name}")
    along = np.array([np.cos(joint.angle), np.sin(joint.angle), 0.0])
    yield Joint(name, "prismatic", (GROUND, bodies[0]), Attachment(joint.at, along), is_driven=joint.is_input)


def _body(link: DrawnLink, joints: Mapping[str, DrawnJoint]) -> Body:
    # PMKS+ writes no centre of a slider, which is at its pin; of a flat body two moments add up to the third.
    centre = joints[link.joints[0]].at if link.is_piston and link.joints else link.centre
    return Body(mass=link.mass, centre=centre, inertia=np.diag([0.5, 0.5, 1.0]) * link.inertia)


def _on(link: str, body_of: Mapping[str, str]) -> str:
    if link not in body_of:
        raise InputError(not_known(link, "a link", body_of), key="forces")
    return body_of[link]
