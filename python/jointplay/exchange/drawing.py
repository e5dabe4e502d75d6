"""What a drawing in DXF has on its layers: points, guides, marked points and words, in metres."""

import logging
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from jointplay.errors import InputError, listed, require

from .skeleton import Matrix, Vector

#: what reads and writes DXF, and comes without types
Entity = Any
#: what ezdxf raises, besides its own errors, where a file is damaged
DAMAGED = (ArithmeticError, AttributeError, LookupError, StopIteration, TypeError, ValueError)
#: metres of a unit of the drawing by its number in $INSUNITS
METRES = {
    1: 0.0254, 2: 0.3048, 4: 1e-3, 5: 1e-2, 6: 1.0, 7: 1e3, 8: 2.54e-8, 9: 2.54e-5, 10: 0.9144, 13: 1e-6, 14: 0.1,
}  # fmt: skip
MILLIMETRES = 4
#: layers that every drawing has, and that are no body
USUAL = "0"
NO_BODY = (USUAL, "defpoints")
#: layers whose names begin so are no bodies
NOTES = "_"
#: the text at the point that is the output
OUTPUT = "output"
#: names of line types that begin so are those of centre lines
CENTRE_LINES = ("CENTER", "CENTRE", "DASHDOT", "ISO04")
#: the largest coordinate, in units of the drawing
LARGEST = 1e12
#: how far a point may be off the plane, in units of the drawing
FLAT = 1e-6


@dataclass(frozen=True, eq=False)
class Guide:
    """A construction line or a centre line: ``at + t * along`` for t between low and high."""

    layer: str
    at: Vector
    along: Vector
    low: float
    high: float

    def ends(self) -> list[Vector]:
        """Where it ends."""
        return [self.at + t * self.along for t in (self.low, self.high) if np.isfinite(t)]

    def distance(self, point: Vector) -> float:
        """How far a point is off the line; infinite beyond its ends."""
        t = float((point - self.at) @ self.along)
        slack = 1e-9 * max(1.0, abs(t))
        inside = self.low - slack <= t <= self.high + slack
        return float(np.linalg.norm(point - self.at - t * self.along)) if inside else np.inf


@dataclass
class Drawing:
    """What the layers have."""

    #: layers with something that makes a body, in the order of the drawing
    layers: list[str] = field(default_factory=list)
    #: ``(layer, points)``: ends of a line, corners of a polyline, the centre of a circle
    shapes: list[tuple[str, list[Vector]]] = field(default_factory=list)
    #: ``(layer, point)`` of POINT entities
    marks: list[tuple[str, Vector]] = field(default_factory=list)
    guides: list[Guide] = field(default_factory=list)
    #: ``(text, point)``
    words: list[tuple[str, Vector]] = field(default_factory=list)
    #: what was left out
    notes: list[str] = field(default_factory=list)

    @property
    def ends(self) -> list[tuple[str, Vector]]:
        """``(layer, point)`` of all points of shapes."""
        return [(layer, at) for layer, points in self.shapes for at in points]


def drawing(path: Path) -> Drawing:
    """What the model space of a drawing has.

    Raises
    ------
    InputError
        When it is no DXF, or is not flat; when ezdxf is not installed.
    """
    document = _document(path)
    try:
        return _contents(document)
    except (ezdxf().DXFError, *DAMAGED) as error:
        raise InputError(f"is a damaged DXF: {error}") from None


def tree(places: Sequence[Vector] | Matrix) -> Any:
    """What finds the neighbours of points."""
    from scipy.spatial import KDTree

    return KDTree(np.reshape(places, (-1, 3)))


def _contents(document: Any) -> Drawing:
    # The layer that every drawing has counts where there is no other.
    found, usual = Drawing(), Drawing()
    unit = _unit(document, found)
    left_out, on_usual = Counter[tuple[str, str]](), Counter[tuple[str, str]]()
    hidden: list[str] = []
    names: dict[str, str] = {}
    for entity in document.modelspace():
        layer = names.setdefault(entity.dxf.layer.lower(), entity.dxf.layer)
        if _is_hidden(document, layer):
            hidden.append(layer)
        elif entity.dxftype() in ("TEXT", "MTEXT"):
            found.words.append((_text(entity), _point(entity, entity.dxf.insert, unit)))
        elif layer.startswith(NOTES):
            continue
        elif layer == USUAL and _add(usual, document, entity, layer, unit):
            on_usual[entity.dxftype(), layer] += 1
        elif layer.lower() in NO_BODY or not _add(found, document, entity, layer, unit):
            left_out[entity.dxftype(), layer] += 1
    if found.layers:
        left_out += on_usual
    else:
        found = replace(usual, words=found.words, notes=found.notes)
    if hidden:
        found.notes.append(f"Layers that are off or frozen are left out: {listed(dict.fromkeys(hidden))}.")
    if left_out:
        said = [f"{count} {kind} on layer '{layer}'" for (kind, layer), count in left_out.items()]
        found.notes.append(f"Left out: {', '.join(said)}.")
    return found


def ezdxf() -> Any:
    """The library.

    Raises
    ------
    InputError
        When it is not installed.
    """
    require("ezdxf", "dxf", "DXF")
    import ezdxf

    return ezdxf


def _document(path: Path) -> Any:
    library = ezdxf()
    # What it has to say of a damaged file is in the message.
    logging.getLogger("ezdxf").addHandler(logging.NullHandler())
    try:
        return library.readfile(path)
    except FileNotFoundError:
        raise InputError("there is no such file") from None
    except IsADirectoryError:
        raise InputError("this is a folder, not a drawing") from None
    except UnicodeDecodeError:
        raise InputError("is no DXF: it is not text") from None
    except (OSError, library.DXFError, *DAMAGED) as error:
        raise InputError(f"is no DXF: {str(error) or 'it ends too early'}") from None


def _unit(document: Any, found: Drawing) -> float:
    number = int(document.header.get("$INSUNITS", 0))
    if number == 0:
        found.notes.append("The drawing does not say its unit ($INSUNITS): its numbers are read as mm.")
        number = MILLIMETRES
    if number not in METRES:
        known = ", ".join(map(str, METRES))
        raise InputError(f"{number} is no unit that is read; known: {known} (4 is mm, 1 inches)", key="$INSUNITS")
    return METRES[number]


def _is_hidden(document: Any, layer: str) -> bool:
    if layer not in document.layers:
        return False
    found = document.layers.get(layer)
    return bool(found.is_off() or found.is_frozen())


def _text(entity: Entity) -> str:
    words = entity.plain_text() if entity.dxftype() == "MTEXT" else entity.dxf.text
    return " ".join(words.split())


def _add(found: Drawing, document: Any, entity: Entity, layer: str, unit: float) -> bool:
    """Take an entity in; False where it says nothing of a skeleton."""
    kind = entity.dxftype()
    if kind in ("XLINE", "RAY") or (kind == "LINE" and _is_centre_line(document, entity)):
        found.guides.append(_guide(entity, layer, unit))
    elif kind == "POINT":
        found.marks.append((layer, _point(entity, entity.dxf.location, unit)))
    else:
        ends = [*_ends(entity)]
        if not ends:
            return False
        found.shapes.append((layer, [_point(entity, end, unit) for end in ends]))
    if layer not in found.layers:
        found.layers.append(layer)
    return True


def _ends(entity: Entity) -> Iterator[Any]:
    kind = entity.dxftype()
    if kind == "LINE":
        yield from (entity.dxf.start, entity.dxf.end)
    elif kind == "LWPOLYLINE" or (kind == "POLYLINE" and (entity.is_2d_polyline or entity.is_3d_polyline)):
        points = [*(entity.vertices_in_wcs() if kind == "LWPOLYLINE" else entity.points_in_wcs())]
        yield from points
        if entity.is_closed:
            yield from points[:1]
    elif kind == "CIRCLE":
        # Circles stand in a plane of their own, which may be seen from behind.
        yield entity.ocs().to_wcs(entity.dxf.center)


def _guide(entity: Entity, layer: str, unit: float) -> Guide:
    start = _point(entity, entity.dxf.start, unit)
    if entity.dxftype() == "LINE":
        end = _point(entity, entity.dxf.end, unit)
        length = float(np.linalg.norm(end - start))
        if not length:
            raise InputError("is a centre line without length", key=_named(entity))
        return Guide(layer, start, (end - start) / length, 0.0, length)
    along = np.array(tuple(entity.dxf.unit_vector))
    return Guide(layer, start, along, -np.inf if entity.dxftype() == "XLINE" else 0.0, np.inf)


def _is_centre_line(document: Any, entity: Entity) -> bool:
    name = entity.dxf.linetype
    if name.upper() == "BYLAYER" and entity.dxf.layer in document.layers:
        name = document.layers.get(entity.dxf.layer).dxf.linetype
    return bool(name.upper().startswith(CENTRE_LINES))


def _point(entity: Entity, point: Any, unit: float) -> Vector:
    x, y, z = point
    if not max(abs(x), abs(y), abs(z)) <= LARGEST:
        raise InputError(f"its coordinates are beyond {LARGEST:g}", key=_named(entity))
    if abs(z) > FLAT:
        raise InputError(f"is not in the plane: z = {z:.6g}", key=_named(entity))
    return np.array([x * unit, y * unit, 0.0])


def _named(entity: Entity) -> str:
    """What an entity is called in messages."""
    return f"{entity.dxftype()} #{entity.dxf.handle} on layer '{entity.dxf.layer}'"
