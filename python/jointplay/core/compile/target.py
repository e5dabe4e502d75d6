"""What the output ought to do ideally, in numbers: SI and radians, names as indices."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.errors import listed, not_known
from jointplay.file.schema import MechanismFile, NotAnExpression, TargetDwell, TargetFunction, TargetTable, Variables
from jointplay.file.schema.expressions import is_variable

from .drives import LENGTHS, Commands, coordinate_factor
from .graph import Graph


@dataclass(frozen=True)
class Wanted:
    """A coordinate that ought to have some value."""

    #: which of the output's pose
    component: int | None
    #: else the joint whose coordinate it is
    joint: int | None
    #: SI per unit of the file
    factor: float
    #: the drive of a table or of a range
    drive: int | None = None
    #: in the drives, in units of the file
    expression: str | None = None
    #: `at`, `values`: of a table, SI; empty where there is none
    at: tuple[float, ...] = ()
    values: tuple[float, ...] = ()
    #: of a dwell, SI; None for the middle between its ends
    value: float | None = None
    #: range of the drive, SI; None for the whole path
    span: tuple[float, float] | None = None


@dataclass(frozen=True)
class Ideal:
    """What the output ought to do."""

    #: {"points", "line", "circle", "function", "dwell"}
    kind: str
    #: largest acceptable structural error, SI; infinite where none is given
    tolerance: float
    #: whether the line or the circle is the one that fits best
    fit: bool
    #: whether points belong to configurations
    timed: bool
    #: points, those of a line, or the centre of a circle, shape (point, axis)
    points: Floats
    #: of a circle
    radius: float
    #: of a circle in space
    axis: tuple[float, ...]
    #: of a function and a dwell
    wanted: Wanted | None
    #: values of the file's variables, for expressions
    variables: Mapping[str, object]
    #: the file's unit of angles in radians
    angle: float

    @property
    def is_of_path(self) -> bool:
        """Whether it compares a path as a whole: something is fitted to it, or every configuration has a point."""
        if self.kind == "points":
            return self.timed
        return self.fit or (self.kind == "dwell" and self.wanted is not None and self.wanted.value is None)

    def expected(self, names: tuple[str, ...], drives: Floats) -> Floats:
        """Values of the expression, SI, at drive values in units of the file, shape (configuration, drive).

        Raises
        ------
        NotAnExpression
            When it has no value.
        """
        assert self.wanted is not None
        assert self.wanted.expression is not None
        known = dict(self.variables)
        rows = (Variables({**known, **dict(zip(names, row, strict=True))}, self.angle) for row in drives.tolist())
        return self.wanted.factor * np.array([row.number(self.wanted.expression) for row in rows])


def compile_target(data: MechanismFile, graph: Graph, commands: Commands, components: tuple[str, ...]) -> Ideal | None:
    """Bring the target of the output to numbers.

    Raises
    ------
    InputError
        When a name means nothing, or there are other points than configurations.
    """
    given = data.target
    if given is None:
        return None
    length = graph.units.length
    points, radius, axis, fit, wanted = np.empty((0, 0)), np.nan, (), False, None
    factor = length
    if given.points is not None:
        points = length * np.array(given.points)
        _check_count(given, commands, graph)
    elif given.line is not None:
        fit = given.line.fit
        points = np.empty((0, 0)) if fit else length * _ends(given.line, graph)
    elif given.circle is not None:
        fit = getattr(given.circle, "fit", False)
        if not fit:
            assert given.circle.radius is not None
            points, radius = length * np.array([given.circle.centre]), length * given.circle.radius
            axis = getattr(given.circle, "axis", ())
    else:
        about = given.function or given.dwell
        assert about is not None
        wanted = _wanted(about, given.kind, data, graph, commands, components)
        factor = wanted.factor
    tolerance = np.inf if given.tolerance is None else factor * given.tolerance
    ideal = Ideal(
        given.kind, tolerance, fit, given.timed, points, radius, axis, wanted, data.variables, graph.units.angle
    )
    if wanted is not None and wanted.expression is not None:
        _check_expression(ideal, data, graph, commands)
    return ideal


def _check_count(given: TargetTable, commands: Commands, graph: Graph) -> None:
    values = commands.values if commands.values is not None else commands.targets
    assert given.points is not None
    if given.timed and values is not None and len(values) != len(given.points):
        problem = (
            f"there are {len(given.points)} points and {len(values)} configurations; each has its own, or timed = false"
            " takes the nearest point of the polyline through them"
        )
        raise graph.refuse(problem, "target.points")


def _ends(line: object, graph: Graph) -> Floats:
    """Two points of a line, in units of the file, that lie far enough apart to say its direction."""
    through, to, direction = (getattr(line, key) for key in ("through", "to", "direction"))
    if to is not None:
        direction = np.subtract(to, through)
    elif isinstance(direction, float):
        direction = (np.cos(direction * graph.units.angle), np.sin(direction * graph.units.angle))
    apart = max(1.0, np.abs(through).max()) / np.abs(direction).max()
    return np.array([through, np.add(through, apart * np.array(direction))])


def _wanted(
    about: TargetFunction | TargetDwell,
    key: str,
    data: MechanismFile,
    graph: Graph,
    commands: Commands,
    components: tuple[str, ...],
) -> Wanted:
    component = joint = None
    if about.of in components:
        component = components.index(about.of)
        factor = graph.units.length if about.of in LENGTHS else graph.units.angle
    elif about.of in data.joints or about.of in {one.name for one in graph.joints}:
        joint = graph.joint_index(about.of, f"target.{key}.of")
        if not graph.joints[joint].can_be_driven:
            problem = f"'{about.of}' is a {graph.joints[joint].kind} joint and has no coordinate"
            raise graph.refuse(problem, f"target.{key}.of")
        factor = coordinate_factor(graph, graph.joints[joint])
    else:
        known = [*components, *data.joints]
        raise graph.refuse(not_known(about.of, "a component of the output or a joint", known), f"target.{key}.of")
    is_by_drive = about.at is not None if isinstance(about, TargetFunction) else about.from_ is not None
    drive = _drive(about.drive, key, data, graph) if is_by_drive else None
    of_drive = 1.0 if drive is None else float(commands.factors[drive])
    if isinstance(about, TargetFunction):
        at = tuple(of_drive * value for value in about.at or ())
        values = tuple(factor * value for value in about.values or ())
        expression = None if about.value is None else str(about.value)
        return Wanted(component, joint, factor, drive, expression, at, values)
    span = None if about.from_ is None or about.to is None else (of_drive * about.from_, of_drive * about.to)
    value = None if about.value is None else factor * about.value
    return Wanted(component, joint, factor, drive, value=value, span=span)


def _drive(name: str | None, key: str, data: MechanismFile, graph: Graph) -> int:
    names = [*data.drives]
    if name is None and len(names) == 1:
        return 0
    if name is None:
        raise graph.refuse(f"say which drive is meant: {listed(names)}", f"target.{key}.drive")
    if name not in names:
        raise graph.refuse(not_known(name, "a drive", names), f"target.{key}.drive")
    return names.index(name)


def _check_expression(ideal: Ideal, data: MechanismFile, graph: Graph, commands: Commands) -> None:
    """Refuse names that have two meanings, and an expression without a value at the first configuration."""
    key = "target.function.value"
    for name in data.drives:
        if name in data.variables:
            raise graph.refuse(f"'{name}' is a variable and a drive; give one of them another name", key)
        if not is_variable(name):
            problem = f"the drive '{name}' cannot stand in an expression; name it with letters, digits and _"
            raise graph.refuse(problem, key)
    if commands.values is None:
        return
    try:
        ideal.expected(tuple(data.drives), commands.values[:1] / commands.factors)
    except NotAnExpression as problem:
        raise graph.refuse(str(problem), key) from None
