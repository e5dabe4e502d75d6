"""Shapes in the text format of Open CASCADE: which of their edges and faces are lines, circles, planes and cylinders.

A file has lists of locations, curves and surfaces, and shapes made of shapes: a face lies on a surface, and is bounded
by wires of edges, which lie on curves. The last shape in the list has the number 1. `Edge17` is the edge that is met as
the seventeenth when the shapes are gone through from the outermost one inward, in their order, those that are met again
left out.

It is read here and not by a kernel: what matters is a small part of the format, a kernel is 400 MB of machine code,
and no machine code should read what a stranger sends. The format is described at
https://dev.opencascade.org/doc/overview/html/specification__brep_format.html. A cylinder is a hole where the material
of its part is outside of it: where its face is reversed, or else its axes are left-handed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property, partial

import numpy as np

from .fcstd import MM
from .skeleton import Vector

#: versions that have the same lists
HEADER = re.compile(r"(?m)^CASCADE Topology V[13],")
SECTION = r"(?m)^{} ([0-9]{{1,8}})$"
#: shapes that are met in one part; far more than a drawing has, and what makes an end of shapes made of shapes
MOST_MET = 300_000
#: curves inside one another, and locations of which one is the product
DEEPEST, LONGEST_CHAIN = 20, 200
#: numbers of curves and surfaces of fixed length by their type
CURVES = {1: 6, 2: 13, 3: 14, 4: 13, 5: 14}
SURFACES = {1: 12, 2: 13, 3: 14, 4: 13, 5: 14}
#: larger than any number of a file: kernels write 2e100 for lines without an end
ENDLESS = 1e101
#: the same of curves in the parameters of a surface, and curves in space by their type
FLAT = {1: 4, 2: 7, 3: 8, 4: 7, 5: 8}
SPACE = {1: "line", 2: "circle", 3: "ellipse"}
NAMES = {"Edge": {1: "line", 2: "circle"}, "Face": {1: "plane", 2: "cylinder", 3: "cone", 4: "sphere", 5: "torus"}}
#: a location: elementary ones with their powers, so that two that are equal are seen to be
_Chain = tuple[tuple[int, int], ...]
#: shapes that are looked for, and those that lie inside of them
KINDS = {"Face": "Fa", "Edge": "Ed", "Vertex": "Ve"}
ORDER = ("Co", "CS", "So", "Sh", "Fa", "Wi", "Ed", "Ve")
#: how far rounding may keep the axes of a location from being across one another
RIGID = 1e-6
FLAGS = re.compile(r"[01]{7}")
SUBSHAPE = re.compile(r"[-+ie][0-9]{1,9}")


class Unreadable(ValueError):
    """A shape that is damaged, or of another version."""


@dataclass(frozen=True)
class ShapeElement:
    """A face, edge or vertex; lengths in m, in the axes of the part."""

    #: ``line``, ``circle``, ``plane``, ``cylinder``, ``cone``, ``sphere``, ``torus``, ``point``, or ``other``
    kind: str
    #: a point of it: its centre, or one on its axis
    at: Vector
    #: unit vector along it, or across it; zero where it has none
    axis: Vector
    #: of circles, cylinders and spheres
    radius: float = 0.0
    #: whether material is outside of a cylinder or sphere
    is_hole: bool = False
    #: of a cylinder: from where to where it goes along its axis, counted from `at`
    extent: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class _OnSurface:
    """A curve of an edge on a surface, and the second one of a seam; numbers are zero of that in space."""

    curve: int
    second: int
    surface: int
    location: int
    ends: tuple[float, float]


@dataclass(frozen=True)
class _Raw:
    """A shape of the list: its type, curve, surface or point with its location, and what it is made of."""

    kind: str
    geometry: int
    location: int
    point: tuple[float, ...]
    inner: tuple[tuple[str, int, int], ...]
    traces: tuple[_OnSurface, ...]


@dataclass(frozen=True)
class Trace:
    """An edge of a face."""

    #: type and numbers of its curve in the parameters of the surface
    curve: tuple[int, tuple[float, ...]] | None
    #: from where to where on the curve
    ends: tuple[float, float]
    #: whether the face is on its right
    is_reversed: bool
    #: kind and numbers of its curve in space, where it has none on the surface
    drawn: tuple[str, tuple[float, ...]] | None
    #: where that curve is
    matrix: np.ndarray


@dataclass(frozen=True)
class Plotted:
    """A spline in the parameters of a surface."""

    degree: int
    poles: np.ndarray
    weights: np.ndarray
    knots: tuple[float, ...]
    counts: tuple[int, ...]

    @classmethod
    def of(cls, numbers: tuple[float, ...]) -> Plotted:
        """That of the numbers of a curve of type 7."""
        rational, degree, count = (int(number) for number in numbers[:3])
        width = 2 + bool(rational)
        poles = np.reshape(numbers[3 : 3 + count * width], (count, width))
        knots = numbers[3 + count * width :]
        weights = poles[:, 2] if rational else np.ones(count)
        return cls(degree, poles[:, :2], weights, tuple(knots[::2]), tuple(int(number) for number in knots[1::2]))


@dataclass(frozen=True)
class Met:
    """A shape as it is met: its number, where it is, and whether it is turned inside out."""

    number: int
    where: _Chain
    is_reversed: bool


class _Tokens:
    """Words of a section, in turn."""

    def __init__(self, text: str) -> None:
        self.words = text.split()
        self.at = 0

    def word(self) -> str:
        if self.at >= len(self.words):
            raise Unreadable("it ends too early")
        self.at += 1
        return self.words[self.at - 1]

    def number(self) -> float:
        found = float(self.word())
        if not abs(found) <= ENDLESS:
            raise Unreadable("a number is too large, or none")
        return found

    def whole(self) -> int:
        return int(self.word())

    def pair(self) -> tuple[float, float]:
        return self.number(), self.number()

    def several(self, count: int) -> tuple[float, ...]:
        if not 0 <= count <= len(self.words) - self.at:
            raise Unreadable("it ends too early")
        return tuple(self.number() for _ in range(count))


class PartShape:
    """The shape of one part.

    Parameters
    ----------
    text : str
        The file.

    Raises
    ------
    Unreadable
        When it is damaged.
    """

    def __init__(self, text: str) -> None:
        if HEADER.search(text[:500]) is None:
            raise Unreadable("it is of a version that is not read")
        try:
            self.matrices, self.locations = self._locations(*_section(text, "Locations", "Curve2ds"))
            self.flat = self._each(partial(_curve, size=2), *_section(text, "Curve2ds", "Curves"))
            self.curves = self._each(_curve, *_section(text, "Curves", "Polygon3D"))
            self.surfaces = self._each(_surface, *_section(text, "Surfaces", "Triangulations"))
            self.shapes, self.root = self._shapes(*_section(text, "TShapes", None))
        except (ValueError, OverflowError, IndexError, KeyError) as error:
            raise Unreadable(str(error)) from None

    @staticmethod
    def _each(read, tokens: _Tokens, count: int) -> list[tuple[int, tuple[float, ...]]]:  # type: ignore[no-untyped-def]
        return [read(tokens, 0) for _ in range(count)]

    @staticmethod
    def _locations(tokens: _Tokens, count: int) -> tuple[list[np.ndarray], list[_Chain]]:
        """Matrices of the elementary locations, and every location as a product of their powers."""
        matrices = [np.eye(4)]
        chains: list[_Chain] = [()]
        for number in range(1, count + 1):
            kind = tokens.whole()
            matrix = np.eye(4)
            chain: _Chain = ()
            if kind == 1:
                matrix[:3] = np.reshape(tokens.several(12), (3, 4))
                chain = ((number, 1),)
            elif kind == 2:
                while (part := tokens.whole()) != 0:
                    if not 0 < part < len(chains):
                        raise Unreadable("a location is made of one that is not there")
                    # What comes later is farther out.
                    chain = _composed(_powered(chains[part], tokens.whole()), chain)
            else:
                raise Unreadable(f"{kind} is no kind of location")
            if not np.abs(matrix[:3, :3] @ matrix[:3, :3].T - np.eye(3)).max() <= RIGID:
                raise Unreadable("a location turns nothing that is rigid")
            matrices.append(matrix)
            chains.append(chain)
        return matrices, chains

    def _shapes(self, tokens: _Tokens, count: int) -> tuple[dict[int, _Raw], tuple[str, int, int]]:
        found: dict[int, _Raw] = {}
        for number in range(count, 0, -1):
            kind = tokens.word()
            geometry, location, point, traces = _geometry(kind, tokens)
            if FLAGS.fullmatch(tokens.word()) is None:
                raise Unreadable(f"shape {number} is damaged")
            inner = []
            while (word := tokens.word()) != "*":
                inner.append(_subshape(word, tokens))
            # What a shape is made of is listed before it: nothing is inside of itself.
            if any(part not in found for _, part, _ in inner):
                raise Unreadable(f"shape {number} is made of one that is not there")
            found[number] = _Raw(kind, geometry, location, point, tuple(inner), traces)
        root = _subshape(tokens.word(), tokens)
        if root[1] not in found:
            raise Unreadable("the outermost shape is not there")
        return found, root

    # --- what is met ------------------------------------------------------------------------------------------------

    @cached_property
    def _met(self) -> dict[str, list[Met]]:
        """Faces, edges and vertices in their order."""
        return {name: list(self._inside(kind)) for name, kind in KINDS.items()}

    def _inside(self, wanted: str, start: Met | None = None) -> Iterator[Met]:
        """Shapes of a type inside of one, or of the whole; each once."""
        sign, number, _ = self.root
        # Where the whole part is is its placement, which is no matter of its own axes.
        waiting = [start or Met(number, (), sign == "-")]
        seen: set[tuple[int, _Chain]] = set()
        for _ in range(MOST_MET):
            if not waiting:
                return
            here = waiting.pop()
            raw = self.shapes[here.number]
            if raw.kind == wanted:
                if (key := (here.number, here.where)) not in seen:
                    seen.add(key)
                    yield here
            elif ORDER.index(raw.kind) < ORDER.index(wanted):
                waiting += [
                    Met(part, _composed(here.where, self._location(location)), here.is_reversed != (sign == "-"))
                    for sign, part, location in reversed(raw.inner)
                ]
        raise Unreadable(f"it is made of more than {MOST_MET} shapes")

    def _location(self, number: int) -> _Chain:
        if not 0 <= number < len(self.locations):
            raise Unreadable("a location is not there")
        return self.locations[number]

    def _matrix(self, where: _Chain, last: int) -> np.ndarray:
        found = np.eye(4)
        for number, power in _composed(where, self._location(last)):
            found = found @ np.linalg.matrix_power(self.matrices[number], power)
        return found

    def element(self, name: str) -> ShapeElement | None:
        """What ``Edge17`` or ``Face3`` is; None where the shape has no such element."""
        kind = name.rstrip("0123456789")
        place = int(name[len(kind) :] or 0) - 1
        every = self._met.get(kind, [])
        return self._element(kind, every[place]) if 0 <= place < len(every) else None

    @cache  # noqa: B019 - as long as the import
    def round_faces(self, kind: str) -> list[ShapeElement]:
        """All faces that are part of a ``cylinder`` or of a ``sphere``."""
        return [self._element("Face", met) for met in self._met["Face"] if self._kind("Face", met) == kind]

    # --- what its volume is made of ---------------------------------------------------------------------------------

    def faces(self) -> list[Met]:
        """All faces."""
        return self._met["Face"]

    def somewhere(self) -> Vector:
        """A point in the middle of its vertices, mm."""
        corners = [self._element("Vertex", met).at for met in self._met["Vertex"]]
        return np.mean(corners, axis=0) / MM if corners else np.zeros(3)

    def surface_of(self, face: Met) -> tuple[str, tuple[float, ...], np.ndarray]:
        """Kind and numbers of the surface of a face, and where it is."""
        raw = self.shapes[face.number]
        kind = self._kind("Face", face)
        numbers = self.surfaces[raw.geometry - 1][1] if kind != "other" else ()
        return kind, numbers, self._matrix(face.where, raw.location)

    def boundary(self, face: Met) -> Iterator[Trace]:
        """The edges of a face, those of a seam twice."""
        raw = self.shapes[face.number]
        found = False
        for wire_sign, wire, wire_place in raw.inner:
            if self.shapes[wire].kind != "Wi":
                continue
            for sign, number, place in self.shapes[wire].inner:
                edge = self.shapes[number]
                if sign not in "+-" or edge.kind != "Ed":
                    continue
                found = True
                where = _composed(self._location(wire_place), self._location(place))
                yield self._trace(raw, face, edge, where, (sign == "-") != (wire_sign == "-"))
        if not found:
            raise Unreadable("a face has no edges")

    def _trace(self, face: _Raw, met: Met, edge: _Raw, where: _Chain, is_reversed: bool) -> Trace:
        # The place of the surface as the edge sees it.
        seen = _composed(_powered(where, -1), self._location(face.location))
        on = [one for one in edge.traces if one.surface == face.geometry]
        on = on if len(on) < 2 else [one for one in on if self._location(one.location) == seen]
        if on:
            number = on[0].second if is_reversed and on[0].second else on[0].curve
            if not 0 < number <= len(self.flat):
                raise Unreadable("a curve is not there")
            return Trace(self.flat[number - 1], on[0].ends, is_reversed, None, np.eye(4))
        in_space = next((one for one in edge.traces if not one.surface), None)
        if in_space is None or not 0 < edge.geometry <= len(self.curves):
            return Trace(None, (0.0, 0.0), is_reversed, None, np.eye(4))
        kind, numbers = self.curves[edge.geometry - 1]
        matrix = self._matrix(_composed(met.where, where), edge.location)
        return Trace(None, in_space.ends, is_reversed, (SPACE.get(kind, "other"), numbers), matrix)

    def _kind(self, kind: str, met: Met) -> str:
        listed, number = self.surfaces if kind == "Face" else self.curves, self.shapes[met.number].geometry
        return NAMES[kind].get(listed[number - 1][0], "other") if 0 < number <= len(listed) else "other"

    def _element(self, kind: str, met: Met) -> ShapeElement:
        raw = self.shapes[met.number]
        matrix = self._matrix(met.where, raw.location)
        if kind == "Vertex":
            return ShapeElement("point", _moved(matrix, raw.point), np.zeros(3))
        name = self._kind(kind, met)
        if name == "other":
            return ShapeElement(name, np.zeros(3), np.zeros(3))
        _, x = (self.surfaces if kind == "Face" else self.curves)[raw.geometry - 1]
        at, axis = _moved(matrix, x[:3]), matrix[:3, :3] @ np.array(x[3:6])
        length = float(np.linalg.norm(axis))
        if not length > 0.0:
            raise Unreadable("an axis is no direction")
        axis = axis / length
        radius = x[12] * MM if len(x) > 12 and name in ("circle", "cylinder", "sphere") else 0.0
        if name not in ("cylinder", "sphere"):
            return ShapeElement(name, at, axis, radius)
        own = matrix[:3, :3] @ np.array([x[6:9], x[9:12], x[3:6]]).T
        is_hole = met.is_reversed != bool(np.linalg.det(own) < 0)
        corners = [self._element("Vertex", corner).at for corner in self._inside("Ve", met)]
        along = [float(axis @ (corner - at)) for corner in corners] or [0.0]
        return ShapeElement(name, at, axis, radius, is_hole, (min(along), max(along)))


def _composed(outer: _Chain, inner: _Chain) -> _Chain:
    """The product of two locations; powers of one location beside one another become one."""
    found = list(outer)
    for number, power in inner:
        if found and found[-1][0] == number:
            power += found.pop()[1]
        if power:
            found.append((number, power))
    if len(found) > LONGEST_CHAIN or any(abs(power) > LONGEST_CHAIN for _, power in found):
        raise Unreadable("locations are made of one another without end")
    return tuple(found)


def _powered(chain: _Chain, power: int) -> _Chain:
    if abs(power) > DEEPEST:
        raise Unreadable(f"{power} is too high a power of a location")
    found: _Chain = ()
    for _ in range(abs(power)):
        found = _composed(found, chain if power > 0 else tuple((number, -own) for number, own in reversed(chain)))
    return found


def _moved(matrix: np.ndarray, point: tuple[float, ...]) -> Vector:
    found = (matrix[:3, :3] @ np.array(point) + matrix[:3, 3]) * MM
    if not np.isfinite(found).all():
        raise Unreadable("a place is no number")
    return np.asarray(found)


def _section(text: str, name: str, following: str | None) -> tuple[_Tokens, int]:
    """Words of a list, and how many entries it has."""
    begin = re.search(SECTION.format(name), text)
    end = None if following is None else re.search(SECTION.format(following), text)
    if begin is None or (following is not None and end is None):
        raise Unreadable(f"it has no list of {name}")
    words = _Tokens(text[begin.end() : len(text) if end is None else end.start()])
    count = int(begin[1])
    if count > len(words.words):
        raise Unreadable(f"its list of {name} is shorter than it says")
    return words, count


def _subshape(word: str, tokens: _Tokens) -> tuple[str, int, int]:
    if SUBSHAPE.fullmatch(word) is None:
        raise Unreadable("a shape is damaged")
    return word[0], int(word[1:]), tokens.whole()


def _geometry(kind: str, tokens: _Tokens) -> tuple[int, int, tuple[float, ...], tuple[_OnSurface, ...]]:
    """Number of the curve or surface of a shape, its location, the point of a vertex, and the curves of an edge."""
    geometry = location = 0
    point: tuple[float, ...] = ()
    traces: list[_OnSurface] = []
    if kind == "Ve":
        point = tokens.several(4)[1:]
        while tokens.several(1) and (way := tokens.whole()) != 0:
            # On a curve, on a curve of a surface, on a surface; with a location each.
            tokens.several({1: 1, 2: 2, 3: 2}[way] + 1)
    elif kind == "Ed":
        tokens.several(4)
        while (way := tokens.whole()) != 0:
            if way == 1:
                geometry, location = tokens.whole(), tokens.whole()
                traces.append(_OnSurface(0, 0, 0, 0, tokens.pair()))
            elif way in (2, 3):
                first, second = tokens.whole(), 0
                if way == 3:
                    # The number of the second curve and the continuity stand in one word, 2CN.
                    word = tokens.word()
                    second = int(word.split("C")[0])
                    if word.isdigit():
                        tokens.word()
                traces.append(_OnSurface(first, second, tokens.whole(), tokens.whole(), tokens.pair()))
            elif way == 4:
                tokens.word()
                tokens.several(4)
            else:
                tokens.several({5: 2, 6: 3, 7: 4}[way])
    elif kind == "Fa":
        tokens.several(2)
        geometry, location = tokens.whole(), tokens.whole()
        if tokens.at < len(tokens.words) and tokens.words[tokens.at] == "2":
            tokens.several(2)
    elif kind not in ORDER:
        raise Unreadable("a shape is of no kind")
    return geometry, location, point, tuple(traces)


def _curve(tokens: _Tokens, depth: int, size: int = 3) -> tuple[int, tuple[float, ...]]:
    """Type and numbers of a curve in space, or in the plane of parameters; those of a trimmed one are its basis'."""
    if depth > DEEPEST:
        raise Unreadable("curves are inside one another without end")
    kind = tokens.whole()
    fixed = CURVES if size == 3 else FLAT
    if kind in fixed:
        return kind, tokens.several(fixed[kind])
    if kind == 6:
        rational, degree = tokens.whole(), tokens.whole()
        poles = tokens.several((degree + 1) * (size + bool(rational)))
        return 7, (rational, degree, degree + 1, *poles, 0.0, degree + 1, 1.0, degree + 1)
    if kind == 7:
        rational, periodic, degree, count, knots = (tokens.whole() for _ in range(5))
        numbers = tokens.several(count * (size + bool(rational)) + 2 * knots)
        return (0, ()) if periodic else (7, (rational, degree, count, *numbers))
    if kind == 8:
        tokens.several(2)
        return _curve(tokens, depth + 1, size)
    if kind == 9:
        tokens.several(4 if size == 3 else 1)
        _curve(tokens, depth + 1, size)
        return 0, ()
    raise Unreadable(f"{kind} is no kind of curve")


def _surface(tokens: _Tokens, depth: int) -> tuple[int, tuple[float, ...]]:
    """Type and numbers of a surface; those of a trimmed one are its basis'."""
    if depth > DEEPEST:
        raise Unreadable("surfaces are inside one another without end")
    kind = tokens.whole()
    if kind in SURFACES:
        return kind, tokens.several(SURFACES[kind])
    if kind in (6, 7):
        tokens.several(3 if kind == 6 else 6)
        _curve(tokens, depth + 1)
    elif kind == 8:
        u_rational, v_rational, u, v = (tokens.whole() for _ in range(4))
        tokens.several((u + 1) * (v + 1) * (3 + bool(u_rational or v_rational)))
    elif kind == 9:
        u_rational, v_rational, *_, u, v, u_knots, v_knots = (tokens.whole() for _ in range(10))
        tokens.several(u * v * (3 + bool(u_rational or v_rational)) + 2 * (u_knots + v_knots))
    elif kind == 10:
        tokens.several(4)
        return _surface(tokens, depth + 1)
    elif kind == 11:
        tokens.several(1)
        _surface(tokens, depth + 1)
    else:
        raise Unreadable(f"{kind} is no kind of surface")
    return 0, ()
