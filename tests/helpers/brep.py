"""Shapes in the text format of Open CASCADE, written from what they are made of, in mm."""

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
#: an arc of a line around something: centre, radius, and from where to where, counter-clockwise in degrees
Arc = tuple[tuple[float, float], float, float, float]


def words(*numbers: Any) -> str:
    return " ".join(f"{number:.17g}" for number in np.concatenate([np.ravel(one) for one in numbers]))


class BrepText:
    """A text on its way. Shapes name others by ``@NUMBER``, with a sign in front."""

    def __init__(self) -> None:
        self.flat: list[str] = []
        self.curves: list[str] = []
        self.surfaces: list[str] = []
        self.shapes: list[str] = []

    def add(self, text: str, flags: str, made_of: Sequence[str] = ()) -> int:
        """A shape that is made of others, and its number."""
        self.shapes.append(f"{text}\n\n{flags}\n{' '.join(f'{one} 0' for one in made_of)} *")
        return len(self.shapes) - 1

    def vertex(self, at: Floats) -> int:
        """A point."""
        return self.add(f"Ve\n1e-07\n{words(at)}\n0 0", "0101101")

    def edge(
        self, curve: str, ends: Sequence[int], reach: str = "0 1", on: Sequence[tuple[int, Sequence[str]]] = ()
    ) -> int:
        """A piece of a curve in space, if there is one, and of one or two curves each on surfaces, by their numbers."""
        lines = []
        if curve:
            self.curves.append(curve)
            lines.append(f"1  {len(self.curves)} 0 {reach}\n")
        for surface, own in on:
            self.flat += own
            last = len(self.flat)
            which = f"2  {last}" if len(own) == 1 else f"3  {last - 1} {last}CN"
            lines.append(f"{which} {surface} 0 {reach}\n")
        return self.add(f"Ed\n 1e-07 1 1 0\n{''.join(lines)}0", "0101000", [f"+@{end}" for end in ends])

    def surface(self, text: str) -> int:
        """A surface, and its number."""
        self.surfaces.append(text)
        return len(self.surfaces)

    def face(self, surface: int, wires: Sequence[Sequence[str]]) -> int:
        """A part of a surface within edges."""
        inner = [f"+@{self.add('Wi', '0101100', wire)}" for wire in wires if wire]
        return self.add(f"Fa\n0  1e-07 {surface} 0", "0111000", inner)

    def text(self, inside: Sequence[str]) -> str:
        """The whole: a compound."""
        whole = self.add("Co", "1100000", inside)
        text = "\n".join(self.shapes) + f"\n+@{whole} 0"
        count = len(self.shapes)
        for number in reversed(range(count)):
            text = text.replace(f"@{number} ", f"{count - number} ")
        lists = [("Locations", []), ("Curve2ds", self.flat), ("Curves", self.curves), ("Polygon3D", [])]
        lists += [("PolygonOnTriangulations", []), ("Surfaces", self.surfaces), ("Triangulations", [])]
        head = "".join(f"{name} {len(entries)}\n" + "".join(f"{one}\n" for one in entries) for name, entries in lists)
        return f"\nCASCADE Topology V1, (c) Matra-Datavision\n{head}\nTShapes {count}\n{text}\n"

    # --- what is made of these ----------------------------------------------------------------------------------------

    def patch(self, surface: str, corners: Sequence[tuple[float, float]]) -> int:
        """A face whose edges are straight in the parameters of its surface."""
        number = self.surface(surface)
        wire = []
        for one, other in zip(corners, [*corners[1:], corners[0]], strict=True):
            way = np.subtract(other, one)
            length = float(np.hypot(*way))
            edge = self.edge("", (), words(0, length), [(number, [f"1 {words(one, way / length)}"])])
            wire.append(f"+@{edge}")
        return self.face(number, [wire])

    def prism(
        self,
        axes: Floats,
        at: Floats,
        line: Sequence[tuple[float, float] | Arc],
        low: float,
        high: float,
        holes: Sequence[tuple[tuple[float, float], float]] = (),
    ) -> int:
        """A solid along z of axes, the columns of a matrix: within a line of corners and arcs, but for round holes."""
        x, y, z = axes.T
        height = high - low

        def place(point: Floats, up: float) -> Floats:
            return np.asarray(at + axes @ [*point, up])

        def frame(point: Floats, up: float) -> str:
            return words(place(point, up), z, x, y)

        faces, below, above = [], [], []
        for own, is_hole in ((line, False), *(([(centre, radius, 0.0, 360.0)], True) for centre, radius in holes)):
            segments = segments_of(own)
            surfaces = []
            for start, end, arc in segments:
                along = (end - start) / (np.hypot(*(end - start)) or 1.0)
                side = axes[:, :2] @ along
                flat = f"1 {words(place(start, low), np.cross(side, z), side, z)}"
                surfaces.append(
                    self.surface(flat if arc is None else f"2 {frame(np.array(arc[0]), low)} {arc[1]:.17g}")
                )
            corners = [(self.vertex(place(start, low)), self.vertex(place(start, high))) for start, _, _ in segments]
            sides = []
            for k, (start, _, arc) in enumerate(segments):
                ends_here = [(surfaces[k - 1], segments[k - 1][2], 3), (surfaces[k], arc, 2)]
                curves: dict[int, list[str]] = {}
                for surface, one, which in ends_here:
                    if one is not None:
                        curves.setdefault(surface, []).append(f"1 {words(np.radians(one[which]), 0, 0, 1)}")
                sides.append(
                    self.edge(f"1 {words(place(start, low), z)}", corners[k], words(0, height), [*curves.items()])
                )
            rims = []
            for k, (start, end, arc) in enumerate(segments):
                both = []
                for up, level in ((low, 0), (high, 1)):
                    ends = corners[k][level], corners[(k + 1) % len(segments)][level]
                    if arc is None:
                        along = axes[:, :2] @ (end - start)
                        length = float(np.linalg.norm(along))
                        both.append(self.edge(f"1 {words(place(start, up), along / length)}", ends, words(0, length)))
                    else:
                        reach = words(np.radians(arc[2:]))
                        on = [(surfaces[k], [f"1 {words(0, up - low, 1, 0)}"])]
                        curve = f"2 {frame(np.array(arc[0]), up)} {arc[1]:.17g}"
                        both.append(self.edge(curve, ends, reach, on))
                rims.append(both)
            for k, both in enumerate(rims):
                around = [f"+@{both[0]}", f"+@{sides[(k + 1) % len(sides)]}", f"-@{both[1]}", f"-@{sides[k]}"]
                faces.append(("-" if is_hole else "+") + f"@{self.face(surfaces[k], [around])}")
            sign = "-" if is_hole else "+"
            below.append([f"{sign}@{one}" for one, _ in rims])
            above.append([f"{sign}@{other}" for _, other in rims])
        middle = np.zeros(2)
        faces.append(f"-@{self.face(self.surface(f'1 {frame(middle, low)}'), below)}")
        faces.append(f"+@{self.face(self.surface(f'1 {frame(middle, high)}'), above)}")
        shell = self.add("Sh", "1111100", faces)
        return self.add("So", "1100000", [f"+@{shell}"])


def segments_of(line: Sequence[tuple[float, float] | Arc]) -> list[tuple[Floats, Floats, Arc | None]]:
    """The arcs of a closed line and the straight pieces between: start, end, arc."""
    found: list[tuple[Floats, Floats, Arc | None]] = []
    ends = []
    for one in line:
        if len(one) == 2:
            ends.append((np.array(one, dtype=float), np.array(one, dtype=float), None))
        else:
            turn = np.radians(one[2:])
            begin, end = (np.array(one[0]) + one[1] * np.array([np.cos(t), np.sin(t)]) for t in turn)
            ends.append((begin, end, one))
    for (begin, end, arc), (following, _, _) in zip(ends, [*ends[1:], ends[0]], strict=True):
        if arc is not None:
            found.append((begin, end, arc))
        if np.hypot(*(following - end)) > 1e-9:
            found.append((end, following, None))
    return found


def damaged(text: str, generator: np.random.Generator) -> Iterator[str]:
    """A text in which a word is another one or gone, a hundred times."""
    words = list(re.finditer(r"\S+", text))
    for number in generator.integers(20, len(words), 25).tolist():
        for new in ("", "7", "-1e60", "nan"):
            yield text[: words[number].start()] + new + text[words[number].end() :]
