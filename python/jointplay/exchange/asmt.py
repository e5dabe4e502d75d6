"""Assemblies of OndselSolver (`.asmt`), the solver of FreeCAD, which exports them: text that is indented by tabs.

A line is a word, and the lines below it that are indented by one tab more are what it holds. Parts have points, which
have markers; a joint names two markers, I and J, by `/ASSEMBLY/PART/MARKER`, and says of the frame J what it is in I.
Motions are formulas in the time, in rad and the unit of length. What follows `TimeSeries` is what the solver found.

The format has no units. Where it has the gravity of the earth in m/s^2 its lengths are m, and else mm, as in FreeCAD;
FreeCAD writes the same mass and moments for every part, and no gravity.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from jointplay.errors import InputError, in_range, listed, not_known, shown
from jointplay.file import toml
from jointplay.file.schema.expressions import NotAnExpression, Variables

from .assembling import AssemblyDraft, JointEnd
from .constraints import Chain, at_a_distance, at_an_angle
from .fcstd import MM
from .options import Options
from .skeleton import Body, Frame, Joint, Matrix, Skeleton, free
from .xml import Reading

#: lines before the results, and how far they are indented; the samples of the solver have 3,000 and 11
MOST_LINES, DEEPEST = 200_000, 30
#: parts, joints, motions and limits
MOST_ENTRIES = 1000
#: joints as the mechanism file has them
KINDS = {
    "FixedJoint": "fixed",
    "RevoluteJoint": "revolute",
    "CylindricalJoint": "cylindrical",
    "TranslationalJoint": "prismatic",
    "SphericalJoint": "spherical",
}
#: directions at an angle: rad
ANGLES = {"ParallelAxesJoint": 0.0, "PerpendicularJoint": math.pi / 2}
#: rods as distances of points and axes, planes at an offset
RODS = {"SphSphJoint": "points", "CylSphJoint": "line and point", "RevCylJoint": "lines"}
PLANES = {"PlanarJoint": "planes", "LineInPlaneJoint": "plane and line", "PointInPlaneJoint": "plane and point"}
OTHERS = (
    *("AngleJoint", "UniversalJoint", "PointInLineJoint", "NoRotationJoint", "RevRevJoint"),
    *("GearJoint", "RackPinionJoint", "ScrewJoint"),
)
TYPES = (*KINDS, *ANGLES, *RODS, *PLANES, *OTHERS)
#: what a motion or limit of a type acts on, and its formula
ACTING = {"RotationalMotion": ("revolute", "RotationZ"), "TranslationalMotion": ("prismatic", "TranslationZ")}
LIMITS = {"RotationLimit": ("revolute",), "TranslationLimit": ("prismatic", "cylindrical")}
#: gravity in m/s^2 of a file whose lengths are m
EARTH = (9.0, 11.0)
MARKERS = ("MarkerI", "MarkerJ")
#: instants at which motions are read
MOST_INSTANTS = 101
#: how far the solver may leave a matrix from being a rotation
RIGID = 1e-4
#: the formulas of the solver as those of the mechanism file: 2.0d is a double
DOUBLE, POWER, ARC = re.compile(r"(?<=[0-9.])d\b"), re.compile(r"\^"), re.compile(r"\barc(?=tan|sin|cos)")


@dataclass
class AsmtLine:
    """A word with what it holds."""

    word: str
    number: int
    inner: list[AsmtLine] = field(default_factory=list)


def read(path: Path, options: Options) -> Skeleton:  # noqa: ARG001 - all formats are called alike
    """An assembly.

    Raises
    ------
    InputError
        When it is damaged, or has a joint that is not read.
    """
    name, text = toml.read(path, "assembly of OndselSolver")
    return _Solved(Reading(name), _assembly(text, name)).skeleton()


def _assembly(text: str, file: str) -> AsmtLine:
    """The tree of the assembly; the first line of a file says which program wrote it."""
    top = AsmtLine("", 0)
    open_lines = [top]
    # Only as many lines as are read are made.
    for number, line in enumerate(re.finditer(r"[^\r\n]+", text), 1):
        word = line[0].lstrip("\t")
        depth = len(line[0]) - len(word)
        if depth == 0 and word.startswith("TimeSeries"):
            break
        if number > MOST_LINES:
            raise InputError(f"has more than {MOST_LINES} lines before its results", file=file)
        if not word.strip():
            continue
        if depth > min(len(open_lines) - 1, DEEPEST):
            raise InputError(f"line {number} is indented by more tabs than what it belongs to", file=file)
        del open_lines[depth + 1 :]
        open_lines[-1].inner.append(AsmtLine(word.strip(), number))
        open_lines.append(open_lines[-1].inner[-1])
    found = next((line for line in top.inner if line.word == "Assembly"), None)
    if found is None:
        raise InputError("is no assembly of OndselSolver: it has no line 'Assembly'", file=file)
    return found


class _Solved(AssemblyDraft):
    """One assembly on its way to a skeleton."""

    def __init__(self, reading: Reading, top: AsmtLine) -> None:
        super().__init__()
        self.reading = reading
        self.top = top
        # It follows the joints: without it some of them may be missing.
        gravity = self._one(top, "ConstantGravity")
        if gravity is None:
            raise reading.refuse("ends too early: it has no line 'ConstantGravity', which follows the joints")
        self.gravity = self._numbers(gravity, 3, "ConstantGravity")
        self.unit = 1.0 if EARTH[0] < float(np.linalg.norm(self.gravity)) < EARTH[1] else MM
        self.has_masses = bool(self.gravity.any())
        #: body and frame of every marker, by the name that joints use
        self.markers: dict[str, tuple[str, Frame]] = {}
        #: what motors do with joints, and their ranges, by the line of the joint
        self.driven: dict[int, tuple[float, ...] | None] = {}
        self.limits: dict[int, tuple[float, float]] = {}

    # --- values ------------------------------------------------------------------------------------------------------

    @staticmethod
    def _one(line: AsmtLine, word: str) -> AsmtLine | None:
        return next((inner for inner in line.inner if inner.word == word), None)

    def _every(self, line: AsmtLine, *words: str) -> list[AsmtLine]:
        """What the lists inside of one another hold."""
        for word in words:
            found = self._one(line, word)
            if found is None:
                return []
            line = found
        return line.inner

    def _entries(self, *words: str) -> list[AsmtLine]:
        """What a list of the assembly holds, which is not longer than that of any machine."""
        found = self._every(self.top, *words)
        in_range(len(found), "", f"a number of {words[-1].lower()} that is read", 0, MOST_ENTRIES)
        return found

    def _text(self, line: AsmtLine, word: str) -> str:
        """The text that a line holds; nothing where it has none."""
        inner = self._every(line, word)
        return inner[0].word if inner else ""

    def _name(self, line: AsmtLine) -> str:
        name = self._text(line, "Name")
        if not name:
            raise self.reading.refuse(f"line {line.number}: {line.word} needs a Name")
        return name

    def _numbers(self, line: AsmtLine, count: int, place: str, row: int = 0) -> np.ndarray:
        if row >= len(line.inner):
            raise self.reading.refuse(f"line {line.number}: '{line.word}' holds too few lines", place)
        return self.reading.numbers(line.inner[row].word, count, place, f"line {line.inner[row].number}")

    def _number(self, line: AsmtLine, word: str, place: str) -> float:
        """A number; zero where there is none."""
        found = self._one(line, word)
        return 0.0 if found is None else float(self._numbers(found, 1, place)[0])

    def _frame(self, line: AsmtLine, place: str) -> Frame:
        position, matrix = self._one(line, "Position3D"), self._one(line, "RotationMatrix")
        at = np.zeros(3) if position is None else self._numbers(position, 3, place) * self.unit
        return Frame(at, np.eye(3) if matrix is None else self._rotation(matrix, place))

    def _rotation(self, line: AsmtLine, place: str) -> Matrix:
        axes = np.array([self._numbers(line, 3, place, row) for row in range(3)])
        if not (np.abs(axes @ axes.T - np.eye(3)).max() < RIGID and np.linalg.det(axes) > 0.0):
            raise self.reading.refuse(f"line {line.number}: the matrix is no rotation", place)
        left, _, right = np.linalg.svd(axes)
        return np.asarray(left @ right)

    # --- parts -------------------------------------------------------------------------------------------------------

    def _with_markers(self, name: str, body: str, line: AsmtLine, place: str) -> None:
        for point in self._every(line, "RefPoints"):
            inside = self.bodies[body].frame @ self._frame(point, place)
            for marker in self._every(point, "Markers"):
                self.markers[f"{name}/{self._name(marker)}"] = body, inside @ self._frame(marker, place)

    def _massive(self, line: AsmtLine, frame: Frame, place: str) -> Body:
        """A part with its mass, where masses mean something."""
        marker = self._one(line, "PrincipalMassMarker")
        if marker is None or not self.has_masses:
            return Body(frame)
        mass = self._number(marker, "Mass", place)
        own = frame @ self._frame(marker, place)
        moments = self._one(marker, "MomentOfInertias")
        diagonal = np.zeros(3) if moments is None else self._numbers(moments, 3, place)
        if mass < 0.0:
            raise self.reading.refuse(f"a mass is positive, not {mass:g}", place)
        if not mass:
            return Body(frame)
        return Body(frame, mass, own.at, own.axes @ np.diag(diagonal * self.unit**2) @ own.axes.T)

    def skeleton(self) -> Skeleton:
        """All of it."""
        name = self._name(self.top)
        base = _short(name)
        self.bodies[base] = Body(self._frame(self.top, f"assembly '{name}'"))
        self._with_markers(f"/{name}", base, self.top, f"assembly '{name}'")
        for part in self._entries("Parts"):
            called = self._name(part)
            place = f"part '{called}'"
            body = free(_short(called), self.bodies)
            self.bodies[body] = self._massive(part, self._frame(part, place), place)
            self._with_markers(f"/{name}/{called}", body, part, place)
        length = "m" if self.unit == 1.0 else "mm"
        masses = "" if self.has_masses else ", and its masses are left out, because it has no gravity"
        self.notes.append(f"The format has no units: its lengths are read as {length}{masses}.")
        joints = [*self._joints(name)]
        if not joints:
            raise self.reading.refuse("has no joints between its parts")
        if self._every(self.top, "ForceTorques"):
            self.notes.append("Forces and torques are left out.")
        x, y, z = (float(g) for g in self.gravity * self.unit)
        return self.closed(base, joints, base, (x, y, z))

    # --- joints ------------------------------------------------------------------------------------------------------

    def _joints(self, assembly: str) -> Iterator[Joint]:
        lines = self._entries("ConstraintSets", "Joints")
        names = [self._text(line, "Name") or line.word for line in lines]
        by_name = {f"/{assembly}/{name}": line for name, line in zip(names, lines, strict=True)}
        self._moved(by_name)
        self._bounded(by_name)
        taken: set[str] = set()
        for called, line in zip(names, lines, strict=True):
            name = free(_short(called), taken)
            taken.add(name)
            place = f"joint '{called}'"
            if line.word not in TYPES:
                raise self.reading.refuse(not_known(line.word, "a joint that is read", TYPES), place)
            ends = [self._end(line, word, place) for word in MARKERS]
            if ends[0].part == ends[1].part:
                self.notes.append(f"A joint within one part is left out: {name}.")
                continue
            first, *further = self._made(name, line, ends[0], ends[1], place)
            number = line.number
            yield replace(
                first, limits=self.limits.get(number), is_driven=number in self.driven, motion=self.driven.get(number)
            )
            for joint in further:
                yield replace(joint, name=free(joint.name, taken))
                taken.add(joint.name)

    def _end(self, line: AsmtLine, word: str, place: str) -> JointEnd:
        named = self._text(line, word)
        if named not in self.markers:
            raise self.reading.refuse(f"names {shown(named)}, which is no marker of the file", place, word)
        return JointEnd(*self.markers[named])

    def _made(self, name: str, line: AsmtLine, one: JointEnd, other: JointEnd, place: str) -> Sequence[Joint]:
        kind = line.word
        chain = Chain(name, one.part, other.part, self.between)
        if kind in KINDS:
            return [self.plain(name, KINDS[kind], one, other)]
        if kind in ANGLES or kind == "AngleJoint":
            angle = ANGLES[kind] if kind in ANGLES else self._number(line, "theIzJz", place)
            return at_an_angle(chain, one.line, other.line, angle)
        if kind in RODS:
            distance = abs(self._number(line, "distanceIJ", place)) * self.unit
            return at_a_distance(chain, RODS[kind], one.line, other.line, distance)
        if kind in PLANES:
            # On this side of the plane, wherever it is drawn.
            level = one.frame.at + self._number(line, "offset", place) * self.unit * one.axis
            return at_a_distance(chain, PLANES[kind], (level, one.axis), other.line, 0.0)
        if kind == "PointInLineJoint":
            return at_a_distance(chain, "line and point", one.line, other.line, 0.0)
        if kind == "UniversalJoint":
            return chain.then("revolute", *one.line).last("revolute", one.frame.at, other.frame.at, other.axis)
        if kind == "NoRotationJoint":
            x, y, z = one.frame.axes.T
            return (
                chain.then("prismatic", other.frame.at, x)
                .then("prismatic", other.frame.at, y)
                .last("prismatic", other.frame.at, other.frame.at, z)
            )
        if kind == "RevRevJoint":
            distance = abs(self._number(line, "distanceIJ", place)) * self.unit
            *_, last = at_a_distance(chain, "lines", one.line, other.line, distance)
            # The second pin is as high as the first one, and does not slide.
            return [*chain.joints[:-1], replace(last, kind="revolute", coordinate=0.0)]
        if kind == "GearJoint":
            radii = self._number(line, "radiusI", place), self._number(line, "radiusJ", place)
            if not all(radii):
                raise self.reading.refuse("a radius is zero", place)
            is_belt = radii[0] * radii[1] < 0.0
            sizes = abs(radii[0]) * self.unit, abs(radii[1]) * self.unit
            return [self.wheels(name, one, other, sizes, is_belt, place)]
        if kind == "RackPinionJoint":
            radius = self._number(line, "pitchRadius", place) * self.unit
            if not radius:
                raise self.reading.refuse("its radius is zero", place, "pitchRadius")
            return [self.rack(name, one.part, other, one.axis, one.frame.axes[:, 0], radius)]
        lead = self._number(line, "pitch", place) * self.unit
        if not lead:
            raise self.reading.refuse("its pitch is zero", place, "pitch")
        return [self.screw(name, one, other, lead)]

    # --- what moves --------------------------------------------------------------------------------------------------

    def _acted(self, line: AsmtLine, by_name: Mapping[str, AsmtLine]) -> tuple[int, str]:
        """AsmtLine and kind of the joint that a motion or limit names, or that has its markers."""
        named = self._text(line, "MotionJoint")
        pair = [self._text(line, word) for word in MARKERS]
        for name, joint in by_name.items():
            if name == named if named else [self._text(joint, word) for word in MARKERS] == pair:
                return joint.number, KINDS.get(joint.word, "")
        return 0, ""

    def _moved(self, by_name: Mapping[str, AsmtLine]) -> None:
        """Which joints motions drive, and through which values."""
        unread, others = [], []
        instants = self._instants()
        for line in self._entries("ConstraintSets", "Motions"):
            number, acted = self._acted(line, by_name)
            kind, word = ACTING.get(line.word, ("", ""))
            if not number or acted != kind:
                others.append(self._name(line))
                continue
            scale = 1.0 if kind == "revolute" else self.unit
            formula = self._text(line, word)
            try:
                values = tuple(scale * _value(formula, time) for time in instants)
                self.driven[number] = values if max(values) > min(values) else values[:1]
            except NotAnExpression:
                self.driven[number] = None
                unread.append(self._name(line))
        if unread:
            self.notes.append(f"Formulas of these motions are not read, and their joints are driven: {listed(unread)}.")
        if others:
            self.notes.append(f"These motions are left out: {listed(others)}.")

    def _instants(self) -> list[float]:
        found = self._one(self.top, "SimulationParameters")
        if found is None:
            return [0.0]
        start, end, step = (self._number(found, word, "SimulationParameters") for word in ("tstart", "tend", "hout"))
        if not (end > start and step > 0.0):
            return [start]
        count = min(math.floor((end - start) / step + 0.5) + 1, MOST_INSTANTS)
        return [float(time) for time in np.linspace(start, end, max(count, 2))]

    def _bounded(self, by_name: Mapping[str, AsmtLine]) -> None:
        """The ranges of joints."""
        others = []
        for line in self._entries("ConstraintSets", "Limits"):
            name = self._name(line)
            number, acted = self._acted(line, by_name)
            if not number or acted not in LIMITS.get(line.word, ()):
                others.append(name)
                continue
            unit = 1.0 if acted == "revolute" else self.unit
            try:
                limit = unit * _value(self._text(line, "Limit"), 0.0)
            except NotAnExpression as error:
                raise self.reading.refuse(str(error), f"limit '{name}'", "Limit") from None
            low, high = self.limits.get(number, (-math.inf, math.inf))
            is_least = self._text(line, "Type") == "=>"
            self.limits[number] = (max(low, limit), high) if is_least else (low, min(high, limit))
        if others:
            self.notes.append(f"Limits of what these joints do not measure are left out: {listed(others)}.")


def _short(name: str) -> str:
    """The name of an object of FreeCAD without that of its document.

    Examples
    --------
    >>> _short("pump#Crank"), _short("Part1")
    ('Crank', 'Part1')
    """
    return name.rpartition("#")[2] or name


def _value(formula: str, time: float) -> float:
    """A formula of the solver at a time, in its units."""
    text = ARC.sub("a", POWER.sub("**", DOUBLE.sub("", formula)))
    return Variables({"time": time}, 1.0).number(text)
