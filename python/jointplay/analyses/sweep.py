"""`sweep`: a question asked again for every value of something in the file, or of two things."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.analyses.cluster import Here, Workers, with_workers
from jointplay.basics.typed import typed
from jointplay.core.compile import ANGULAR
from jointplay.errors import InputError, shown
from jointplay.file.schema import NotAnExpression, Variables, variables_of
from jointplay.model.mechanism import Mechanism, changed
from jointplay.result import Result, Variable, coordinate_names, stack, to_dataset

from .nominal import Interrupted, Progress
from .questions import check, computation
from .recorded import recorded

if TYPE_CHECKING:
    import xarray as xr

    from jointplay.analyses.cluster import Scheduler

#: more than anybody waits for
MOST_VALUES = 100_000
LENGTHS = frozenset(
    {
        *("radial", "diametral", "axial", "gap", "length", "width", "height", "size", "position", "x", "y", "z", "at"),
        *("backlash", "slack", "module", "radii", "radius", "pitch", "lead", "distance", "ratio_error"),
    }
)
#: a result, and of every key with a ``*`` what it reached
SweepAnswer = tuple[Result, list[str]]
ANGLES = frozenset({"rotation", "angle", "rx", "ry", "rz", "backlash_angle", "pressure_angle"})


@typed
def sweep(
    m: Mechanism,
    key: str | Sequence[str],
    values: Iterable[float | str],
    question: str = "worst",
    *,
    name: str | None = None,
    by: Mapping[str, Iterable[float | str]] | None = None,
    scheduler: Scheduler | None = None,
    **options: Any,
) -> xr.Dataset:
    """Ask a question for every value of something in the file, or for every pair of values of two things.

    Parameters
    ----------
    m : Mechanism
    key : str or sequence of str
        Dotted key, ``*`` for every entry that has the rest of it: ``joints.*.clearance.radial``. Several keys get the
        same value.
    values : iterable of float or str
        In the units of the file; expressions in its variables may be among them.
    question : str
        Such as ``worst``; `jointplay sweep --help` lists all that can be asked.
    name : str, optional
        Of the new dimension; the last word of the key if left out, or the whole key where the results have that word.
    by : mapping, optional
        A second key with its values, ``{"dimensions.l2.tolerance": [0.01, 0.02]}``: the question is asked for each of
        them with each of the values of `key`.
    scheduler : distributed.Client or str, optional
        A Dask client, or the address of a scheduler, whose workers are asked in place of this process, value by value.
        The result has the same bits; the attribute `retried` says how many tasks had to be begun again, if any.
    **options
        Of the question, such as ``samples`` or ``offsets``; of ``compensate`` as in `compare`.

    Returns
    -------
    xarray.Dataset
        The variables of the question with a new leading dimension, its coordinate the values; with `by` two, that of
        the second key first. The attribute ``reached`` says of every key with a ``*`` what it reached.

    Raises
    ------
    InputError
        When a key or value is not valid, or a value changes how many configurations or sources there are; when the
        scheduler does not answer, or a worker is not like this process.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar"))
    >>> result = jp.sweep(m, "joints.*.clearance.radial", [0.2, 1.0])
    >>> result.worst_position[:, 0].values.round(3)
    array([0.646, 3.245])
    >>> both = jp.sweep(m, "joints.J1.clearance.radial", [0.2, 1.0], by={"joints.J3.clearance.radial": [0.1, 0.2, 0.3]})
    >>> both.worst_position.isel(configuration=0).round(3).values
    array([[1.7  , 2.399],
           [1.782, 2.491],
           [1.867, 2.583]])
    """
    return to_dataset(compute(m, key, values, question, name=name, by=by, scheduler=scheduler, **options))


@recorded
@with_workers
def compute(
    m: Mechanism,
    key: str | Sequence[str],
    values: Iterable[float | str],
    question: str = "worst",
    *,
    name: str | None = None,
    by: Mapping[str, Iterable[float | str]] | None = None,
    progress: Progress | None = None,
    scheduler: Any = None,
    **options: Any,
) -> Result:
    """The light form of `sweep`."""
    check(question, options, "sweep")
    keys, values = (key,) if isinstance(key, str) else tuple(key), list(islice(values, MOST_VALUES + 1))
    workers: Here | Workers = scheduler
    ask = partial(workers.each, _asked, (keys, question, options))
    if by is not None:
        return _over_pairs(m, keys, values, ask, name, by, progress)
    steps = _checked(m, keys, values)
    return _over_values(m, keys, steps, ask((m, value) for value in steps), name, progress)


def _asked(
    keys: tuple[str, ...], question: str, options: Mapping[str, Any], item: tuple[Mechanism, float | str]
) -> SweepAnswer:
    """The answer of a mechanism with a value at the keys."""
    m, value = item
    copy, reached = changed(m, dict.fromkeys(keys, value))
    return computation(question, "sweep")(copy, **options), reached


def _over_values(
    m: Mechanism,
    keys: tuple[str, ...],
    steps: list[float | str],
    answers: Iterator[SweepAnswer],
    name: str | None,
    progress: Progress | None,
) -> Result:
    """The sweep of the next answers, one for every value."""
    labels = _labels(m, keys[0], steps)
    results: list[Result] = []
    reached: list[str] = []
    try:
        for value, (result, reached_here) in zip(steps, answers, strict=False):
            if results:
                _check_shape(m, keys[0], value, results[0], result)
            results.append(result)
            reached = reached_here
            if progress is not None:
                progress(len(results), len(steps))
    except KeyboardInterrupt:
        if not results:
            # Part of one value is no sweep.
            raise KeyboardInterrupt from None
    swept = _stacked(m, keys, labels[: len(results)], name, results, reached)
    if len(results) < len(steps):
        incomplete = f"interrupted after {len(results)} of {len(steps)} values"
        raise Interrupted(Result(swept.coords, swept.data, {**swept.attrs, "incomplete": incomplete}))
    return swept


def _over_pairs(
    m: Mechanism,
    keys: tuple[str, ...],
    values: list[float | str],
    ask: Callable[[Iterable[tuple[Mechanism, float | str]]], Iterator[SweepAnswer]],
    name: str | None,
    by: Mapping[str, Iterable[float | str]],
    progress: Progress | None,
) -> Result:
    """A sweep for every value of a second key."""
    if len(by) != 1:
        raise InputError("takes one key with its values", file=m.file, key="by")
    ((second, others),) = by.items()
    steps = _checked(m, (second,), others)
    if len(values) * len(steps) > MOST_VALUES:
        raise InputError(f"more than {MOST_VALUES} pairs of values", file=m.file, key="by")
    _require_both(m, keys, values, second, steps)
    values = _checked(m, keys, values)
    copies: dict[int, tuple[Mechanism, list[str]]] = {}

    def copy_of(row: int) -> tuple[Mechanism, list[str]]:
        # Those who are asked may be rows ahead of the answers.
        if row not in copies:
            copies[row] = changed(m, {second: steps[row]})
        return copies[row]

    answers = ask((copy_of(row)[0], value) for row in range(len(steps)) for value in values)
    labels = _labels(m, second, steps)
    rows: list[Result] = []
    reached: list[str] = []
    try:
        for value in steps:
            copy, reached = copy_of(len(rows))
            begun = len(rows) * len(values)

            def told(done: int, _: int, begun: int = begun) -> None:
                if progress is not None:
                    progress(begun + done, len(steps) * len(values))

            row = _over_values(copy, keys, values, answers, name, told)
            del copies[len(rows)]
            if rows:
                _check_shape(m, second, value, rows[0], row)
            rows.append(row)
    except KeyboardInterrupt:
        if not rows:
            raise KeyboardInterrupt from None
    swept = _stacked(m, (second,), labels[: len(rows)], None, rows, reached, "sweep_by")
    if len(rows) < len(steps):
        incomplete = f"interrupted after {len(rows)} of {len(steps)} values of {second}"
        raise Interrupted(Result(swept.coords, swept.data, {**swept.attrs, "incomplete": incomplete}))
    return swept


def _require_both(
    m: Mechanism, keys: tuple[str, ...], values: list[float | str], second: str, others: list[float | str]
) -> None:
    """Refuse a second key whose values the swept one replaces."""
    if not (keys and values):
        return
    before = [m, *(changed(m, {second: other})[0] for other in (others[0], others[-1]))]
    after = [changed(copy, dict.fromkeys(keys, values[0]))[0] for copy in before]
    if any(copy.raw != m.raw for copy in before) and all(copy.raw == after[0].raw for copy in after):
        problem = f"its values are replaced by those of {keys[0]}; exchange the two keys"
        raise InputError(problem, file=m.file, key=second)


def _checked(m: Mechanism, keys: tuple[str, ...], values: Iterable[float | str]) -> list[float | str]:
    if not keys:
        raise InputError("name at least one key of the file", file=m.file, key="sweep")
    steps = [value.item() if isinstance(value, np.generic) else value for value in islice(values, MOST_VALUES + 1)]
    if not 1 <= len(steps) <= MOST_VALUES:
        few = "needs at least one value"
        raise InputError(f"more than {MOST_VALUES} values" if steps else few, file=m.file, key=keys[0])
    for value in steps:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise InputError(f"values are numbers, expressions or words, not {shown(value)}", file=m.file, key=keys[0])
    return steps


def _labels(m: Mechanism, key: str, steps: list[float | str]) -> list[float | str]:
    """The values as the new dimension has them: expressions among numbers are numbers, too.

    Raises
    ------
    InputError
        When words are among the numbers.
    """
    if len({isinstance(value, str) for value in steps}) < 2:
        return steps
    variables = Variables(*variables_of(m.raw))
    try:
        return [variables.number(value) if isinstance(value, str) else value for value in steps]
    except NotAnExpression as problem:
        raise InputError(f"values are all numbers or all words; {problem}", file=m.file, key=key) from None


def _check_shape(m: Mechanism, key: str, value: object, first: Result, result: Result) -> None:
    for dim, size in first.sizes.items():
        if result.sizes.get(dim) != size or (dim in first.coords and result.labels(dim) != first.labels(dim)):
            problem = (
                f"with {shown(value)} the results have another {dim} than before, so they cannot stand side by side"
            )
            raise InputError(problem, file=m.file, key=key)


def _stacked(
    m: Mechanism,
    keys: tuple[str, ...],
    steps: list[float | str],
    name: str | None,
    results: list[Result],
    reached: list[str],
    attribute: str = "sweep",
) -> Result:
    first = results[0]
    taken = {*first.coords, *first.data, *first.sizes}
    if name and name not in taken:
        dim = name
    else:
        word = keys[0].rpartition(".")[2]
        if name or word.isdigit() or coordinate_names([word], taken) != [word]:
            word = keys[0].replace(".*", "").replace(".", "_")
        (dim,) = coordinate_names([word], taken, "sweep_")
    along = Variable((dim,), np.array(steps), _unit(m, keys[0]), ", ".join(keys))
    every = [*filter(None, str(first.attrs.get("reached", "")).split("\n")), *reached]
    attrs = {attribute: dim} | ({"reached": "\n".join(every)} if every else {})
    return stack(results, along, {**first.attrs, **attrs})


def _unit(m: Mechanism, key: str) -> str:
    """Unit of a value of the file; none where it is a word, a count or not known."""
    parts = key.split(".")
    if parts[0] == "patterns" and len(parts) > 3:
        parts = parts[2:]
    words = [part for part in parts if not part.isdigit()]
    if parts[0] == "gravity":
        return "m/s^2"
    if "stiffness" in parts and parts[0] not in ("springs", "drives"):
        return m.units.turning_stiffness_name if words[-1] in ("roll", "tilt") else m.units.stiffness_name
    if parts[0] == "joints" and "friction" in parts[2:]:
        own = {"torque": m.units.moment_name, "force": m.units.force_name, "flank_angle": m.units.angle_name}
        return own.get(words[-1], "" if words[-1] in ("coefficient", "friction") else m.units.length_name)
    if parts[0] in ("temperature", "expansion") or words[-1] == "expansion":
        return {"temperature": "K", "deviation": "K", "tolerance": "K", "plus": "K", "minus": "K", "sigma": "K"}.get(
            words[-1], "1/K" if words[-1] == "expansion" else ""
        )
    if parts[0] == "springs":
        return _unit_of_spring(m, parts[1], words[-1])
    if parts[0] == "bodies":
        return _unit_of_body(m, words[-1])
    if parts[0] in ("loads", "load_cases"):
        return {"force": m.units.force_name, "moment": m.units.moment_name}.get(words[-1], m.units.length_name)
    if parts[0] == "dimensions" and words[-1] not in ("law", "body", "between"):
        return m.units.length_name
    if (parts[0] == "joints" and {"position", "direction"} & set(parts)) or parts[0] == "links":
        return _unit_of_place(m, parts, words)
    if parts[0] == "joints" and {"ratio_error", "runout"} & set(parts):
        return m.units.length_name if words[-1] != "law" else ""
    if parts[0] == "drives" and words[-1] in ("duration", "times"):
        return m.units.time_name
    wordless = ("law", "backlash_law", "count", "joint", "motion", "ramp")
    if parts[0] == "drives" and words[-1] not in wordless and "joints" not in parts:
        return _unit_of_drive(m, parts)
    if words[-1] in ANGLES or (parts[0] == "joints" and "angle" in parts):
        return m.units.angle_name if words[-1] != "law" else ""
    return m.units.length_name if words[-1] in LENGTHS else ""


def _unit_of_drive(m: Mechanism, parts: list[str]) -> str:
    """Unit of a value of a drive, which is that of the joint that it moves, or of the joint that is named."""
    moved = [
        m.joint_kinds[joint]
        for drive, moves in zip(m.drives, m.drive_moves, strict=True)
        if parts[1] in ("*", drive, drive.rpartition("_")[0])
        for joint, _ in ([move for move in moves if m.joints[move[0]] in parts[3:]] or moves[:1])
    ]
    of_angle, of_length = {
        "stiffness": (m.units.turning_stiffness_name, m.units.stiffness_name),
        "speed": (m.units.turning_speed_name, m.units.speed_name),
        "acceleration": (m.units.angular_acceleration_name, m.units.acceleration_name),
        "rotor_inertia": (f"kg {m.units.length_name}^2", "kg"),
    }.get(parts[2] if len(parts) > 2 else "", (m.units.angle_name, m.units.length_name))
    units = {of_angle if kind in ANGULAR else of_length for kind in moved}
    return units.pop() if len(units) == 1 else ""


def _unit_of_place(m: Mechanism, parts: list[str], words: list[str]) -> str:
    """Unit of a deviation of a place, a direction or a link."""
    if words[-1] in ("law", "spherical", "body", "between"):
        return ""
    if words[-1] in ("diameter", "length"):
        return m.units.length_name
    turns = {"rx", "ry", "rz", "angle", "alpha", "theta"} & set(parts) if parts[0] == "links" else "direction" in parts
    return m.units.angle_name if turns else m.units.length_name


def _unit_of_spring(m: Mechanism, name: str, word: str) -> str:
    kinds = {spring.on is None for key, spring in m.data.springs.items() if name in ("*", key)}
    turning = kinds == {True}
    if len(kinds) != 1:
        return ""
    straight = {"stiffness": m.units.stiffness_name, "preload": m.units.force_name}
    about = {
        "stiffness": m.units.turning_stiffness_name,
        "preload": m.units.moment_name,
        "free_angle": m.units.angle_name,
    }
    return about.get(word, "") if turning else straight.get(word, m.units.length_name)


def _unit_of_body(m: Mechanism, word: str) -> str:
    length = m.units.length_name
    modulus = f"{m.units.force_name}/{length}^2"
    powers = {"area": f"{length}^2", "inertia": f"{length}^4", "torsion": f"{length}^4"}
    powers["rotational_inertia"] = f"kg {length}^2"
    return {"mass": "kg", "E": modulus, "G": modulus, "side": "", **powers}.get(word, length)
