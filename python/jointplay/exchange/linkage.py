"""Drawings of Linkage (`.linkage2`), the program of David Rector: connectors, and links that hold them.

    <linkage2> <connector id x y anchor input rpm/> .. <Link id> <connector id/> .. </Link> .. </linkage2>

Coordinates are in 1/96 inch, whichever unit the program shows, and y points up. A link with two anchors is of the
ground, and a slider is on the line between two connectors of another link.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from string import ascii_lowercase, ascii_uppercase
from xml.etree.ElementTree import Element

import numpy as np

from jointplay.basics.units import LENGTHS
from jointplay.errors import in_range, listed, not_known, shown

from .options import Options
from .pins import OUTPUT, choose_output, connected, pins, said_of_speed
from .shaping import legal
from .skeleton import GROUND, Attachment, Body, Frame, Joint, Skeleton, Vector, free_names
from .xml import Reading, parse, refuse_twice

UNIT = LENGTHS["in"] / 96
#: connectors and links, each
MOST_ELEMENTS = 1000
#: what the program calls connectors without a name
LETTERS = ascii_uppercase + ascii_lowercase
#: bits of layers that are for drawing; without any layer it is the mechanism's
DRAWING_LAYERS = 0xF
#: how far a slider may be off its line, by its length; the files have six decimals
OFF_LINE = 1e-3
#: attributes of links that are not read, and what each makes of a link
OTHER_LINKS = {"gear": "a gear", "actuator": "an actuator", "fastenlink": "fastened", "fastenconnector": "fastened"}


@dataclass(frozen=True)
class Connector:
    """A point of links. `limits` are the connectors between which it slides."""

    name: str
    at: Vector
    is_anchor: bool
    is_input: bool
    is_traced: bool
    speed: float
    limits: tuple[str, ...]


@dataclass(frozen=True)
class ConnectedLink:
    """A link with its connectors, by their identifiers."""

    name: str
    connectors: tuple[str, ...]


def read(path: Path, options: Options) -> Skeleton:
    """The mechanism of a drawing.

    Raises
    ------
    InputError
        When it is no such drawing, or has what the mechanism file has not.
    """
    root = parse(path, "linkage2", "Linkage")
    reading = Reading(str(path))
    connectors = _connectors(reading, [*_of_mechanism(root, "connector")])
    links = _links(reading, [*_of_mechanism(root, "Link", "element")], connectors)
    names = free_names({str(k): link.name for k, link in enumerate(links)}, [GROUND, OUTPUT]).values()
    called = free_names({own: one.name for own, one in connectors.items()}, [GROUND, *names])
    bodies = {GROUND: [own for own, one in connectors.items() if one.is_anchor]}
    for name, link in zip(names, links, strict=True):
        is_fixed = sum(connectors[own].is_anchor for own in link.connectors) > 1
        bodies.setdefault(GROUND if is_fixed else name, []).extend(link.connectors)
    on: dict[str, dict[str, None]] = {own: {} for own in connectors}
    for body, held in bodies.items():
        for own in held:
            on[own][body] = None
    drawn = [joint for own in connectors for joint in _joints(reading, own, called[own], connectors, on)]
    in_range(len(drawn), "", "a number of joints that is read", 0, MOST_ELEMENTS)
    inside = connected(GROUND, drawn)
    joints = [joint for joint in drawn if joint.bodies[0] in inside]
    notes = [
        said_of_speed([called[own]], f"{abs(one.speed):g}", is_clockwise=one.speed >= 0)
        for own, one in connectors.items()
        if one.is_input
    ]
    apart = [body for body in bodies if body not in inside]
    if apart:
        notes.append(f"Nothing joins these links with the ground, and they are left out: {listed(apart)}.")
    frames: dict[str, tuple[str, Frame]] = {}
    for own, one in connectors.items():
        moving = [body for body in on[own] if body in inside and body not in (GROUND, options.ground)]
        if moving and not one.is_anchor:
            frames[called[own]] = (moving[-1], Frame(one.at))
    traced = [called[own] for own, one in connectors.items() if one.is_traced and called[own] in frames]
    if options.output is None:
        notes += choose_output(frames, traced, joints)
    return Skeleton(
        title=path.stem,
        bodies={body: Body() for body in bodies if body in inside},
        joints=tuple(joints),
        space="planar",
        frames=frames,
        has_origins=False,
        gravity=(0.0, 0.0, 0.0),
        notes=tuple(notes),
    )


def _of_mechanism(root: Element, *tags: str) -> Iterator[Element]:
    """Elements that are no drawing and no measurement."""
    for element in root:
        layer = element.get("layer", "").strip()
        is_drawn = layer.isdecimal() and 0 < int(layer[:10]) <= DRAWING_LAYERS
        if element.tag in tags and not is_drawn and element.get("measurementelement") != "true":
            yield element


def _identified(reading: Reading, elements: list[Element], what: str) -> list[tuple[str, Element]]:
    in_range(len(elements), what, "a number of them that is read", 0, MOST_ELEMENTS)
    own = [element.get("id", "").strip() for element in elements]
    for one in own:
        if not one.isdecimal() or len(one) > 9:
            raise reading.refuse(f"whole numbers are needed as their ids, not {shown(one)}", what)
    return list(zip(own, elements, strict=True))


def _named(element: Element) -> str:
    name = element.get("name", "")
    return legal(name) if name.strip() else ""


def _connectors(reading: Reading, elements: list[Element]) -> dict[str, Connector]:
    found = {}
    identified = _identified(reading, elements, "connectors")
    refuse_twice(reading, [own for own, _ in identified], "connectors")
    for own, element in identified:
        turns, letter = divmod(int(own), len(LETTERS))
        name = _named(element) or f"{LETTERS[letter]}{turns or ''}"
        place = f"connector '{name}'"
        x, y = (reading.number(element.get(word, ""), 0.0, place, word) for word in "xy")
        slides = element.get("slider") == "true"
        limits = tuple(limit.get("id", "").strip() for limit in element.iter("slidelimit")) if slides else ()
        if slides and len(limits) != 2:
            raise reading.refuse(f"needs two connectors as limits, not {listed(limits) or 'none'}", place)
        if slides and reading.number(element.get("slideradius"), 0.0, place, "slideradius"):
            raise reading.refuse("slides on an arc; sliders on straight lines are read", place)
        if element.get("fastenlink") or element.get("fastenconnector") or element.get("fasten"):
            raise reading.refuse("is fastened; unfasten it, or add it to the link", place)
        found[own] = Connector(
            name=name,
            at=np.array([x, y, 0.0]) * UNIT,
            is_anchor=element.get("anchor") == "true",
            is_input=element.get("input") == "true",
            is_traced=element.get("draw") == "true",
            speed=reading.number(element.get("rpm"), 0.0, place, "rpm"),
            limits=limits,
        )
    return found


def _links(reading: Reading, elements: list[Element], connectors: Mapping[str, Connector]) -> list[ConnectedLink]:
    found = []
    for own, element in _identified(reading, elements, "links"):
        name = _named(element) or f"link_{int(own) + 1}"
        place = f"link '{name}'"
        other = [said for word, said in OTHER_LINKS.items() if element.get(word, "false") != "false"]
        if other:
            raise reading.refuse(f"is {other[0]}; gears, actuators and fastened links are not read", place)
        held = dict.fromkeys(one.get("id", "").strip() for one in element.iter("connector"))
        for one in held:
            if one not in connectors:
                raise reading.refuse(not_known(one, "the id of a connector", connectors), place)
        # As in the program, one connector makes no link.
        if len(held) > 1:
            found.append(ConnectedLink(name, tuple(held)))
    return found


def _joints(
    reading: Reading, own: str, name: str, connectors: Mapping[str, Connector], on: Mapping[str, Mapping[str, None]]
) -> Iterator[Joint]:
    """The joints of a connector; further links turn on the pin of the first."""
    one, place = connectors[own], f"connector '{name}'"
    if one.is_input and (not one.is_anchor or one.limits or len(on[own]) != 2):
        raise reading.refuse("is an input, but is no anchor of one moving link", place)
    if not one.limits:
        yield from pins(name, [*on[own]], one.at, one.is_input)
        return
    if not {*one.limits} <= connectors.keys():
        known = [f"'{limit}'" for limit in one.limits if limit not in connectors]
        raise reading.refuse(f"slides between connectors of which there is no {listed(known)}", place)
    start, end = (connectors[limit].at for limit in one.limits)
    guides = [body for body in on[one.limits[0]] if body in on[one.limits[1]]]
    along, length = end - start, float(np.linalg.norm(end - start))
    if not guides or not length:
        raise reading.refuse("slides between connectors that no link has at two places", place)
    along /= length
    at = start + along * ((one.at - start) @ along)
    if np.linalg.norm(one.at - at) > OFF_LINE * length:
        raise reading.refuse("is off the line on which it slides", place)
    sliding = [body for body in on[own] if body != guides[0]]
    if sliding:
        yield Joint(name, "pin_in_slot", (guides[0], sliding[0]), Attachment(at, along))
        yield from pins(f"{name}_pin", sliding, at)
