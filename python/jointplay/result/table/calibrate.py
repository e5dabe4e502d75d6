"""What readings tell about one machine: its deviations, how they hang together, and what is left of the readings."""

import math
from collections.abc import Iterator

import numpy as np

from jointplay.result import Result

from .fit import chosen_rows
from .layout import NOTHING, Column, ResultTable, fixed, in_one_unit, numbers, words

#: size of a correlation from which on it is shown, and how many are
SHOWN, MOST_PAIRS = 0.9, 12
#: digits of a standard error
DIGITS = 2
#: digits of a size of the file, at most
OWN = 6


def overview(result: Result) -> list[ResultTable]:
    """The tables of `calibrate`."""
    tables = [ResultTable("Deviations and sizes of this machine", tuple(_unknowns(result)), tuple(_notes(result)))]
    if pairs := _pairs(result):
        first, second, value = zip(*pairs, strict=True)
        both = (words("unknown", first, is_key=True), words("with", second), Column("correlation", "", value))
        tables.append(ResultTable("What is determined together rather than by itself", both))
    tables.append(ResultTable("Readings", tuple(_readings(result))))
    if "frame" in result.data:
        axes, units = result.labels("frame_axis"), result.labels("frame_axis_unit")
        found = _with_errors(result.get("frame"), result.get("frame_standard_error"))
        columns = (words("axis", axes, is_key=True), *in_one_unit([Column("found", "", found[0]), found[1]], units))
        tables.append(ResultTable("Ground of the file in the measuring device", columns))
    return tables


def _unknowns(result: Result) -> Iterator[Column]:
    yield words("unknown", result.labels("unknown"), is_key=True)
    errors, sigma = result.get("standard_error"), result.get("prior_sigma")
    found, spread = _with_errors(result.get("estimate"), errors)
    before = tuple(
        fixed(value, _places(min(error, value) if math.isfinite(error) else value)) if math.isfinite(value) else NOTHING
        for value, error in zip(sigma.tolist(), errors.tolist(), strict=True)
    )
    columns = [Column("found", "", found), spread, Column("before\n+-", "", before)]
    yield from in_one_unit(columns, result.labels("unknown_unit"))
    determined = result.get("share_determined")
    yield Column("determined", "%", tuple(f"{100.0 * share:.0f}" for share in determined.tolist()))
    yield Column("key", "", tuple(result.labels("unknown_key")), left=True, spare=4)


def _with_errors(
    values: np.ndarray[tuple[int, ...], np.dtype[np.float64]], errors: np.ndarray[tuple[int, ...], np.dtype[np.float64]]
) -> tuple[tuple[str, ...], Column]:
    """Numbers with as many decimals as their standard errors need, and these."""
    pairs = list(zip(values.tolist(), errors.tolist(), strict=True))
    found = tuple(fixed(value, _places(error)) for value, error in pairs)
    return found, Column("+-", "", tuple(fixed(error, _places(error)) for _, error in pairs))


def _places(error: float) -> int:
    if not math.isfinite(error) or error <= 0.0:
        return 4
    return min(12, max(0, DIGITS - 1 - math.floor(math.log10(error))))


def _pairs(result: Result) -> list[tuple[str, str, str]]:
    covariance, errors = result.get("covariance"), result.get("standard_error")
    names = result.labels("unknown")
    with np.errstate(invalid="ignore"):
        correlation = covariance / np.outer(errors, errors)
    found = [
        (abs(float(correlation[i, j])), names[j], names[i], f"{correlation[i, j]:.3f}")
        for i in range(len(names))
        for j in range(i)
        if abs(correlation[i, j]) > SHOWN
    ]
    found.sort(key=lambda one: -one[0])
    return [one[1:] for one in found[:MOST_PAIRS]]


def _readings(result: Result) -> Iterator[Column]:
    yield words("column", result.labels("channel"), is_key=True)
    used = ~result.get("left_out")
    units = result.labels("channel_unit")
    expected = _rms(result.get("expected")[used])
    columns = []
    for name, head in (("residual_before", "rms\nbefore"), ("residual_after", "rms\nafter")):
        values = _rms(result.get(name)[used])
        places = zip(values.tolist(), expected.tolist(), strict=True)
        columns.append(Column(head, "", tuple(fixed(value, _places(most)) for value, most in places)))
    columns.append(Column("expected", "", tuple(fixed(value, _places(value)) for value in expected.tolist())))
    yield from in_one_unit(columns, units)
    counts = np.isfinite(result.get("measured"))[used].sum(axis=0)
    yield Column("readings", "", tuple(str(count) for count in counts.tolist()))


def _rms(
    values: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    known = np.isfinite(values)
    count = np.maximum(known.sum(axis=0), 1)
    return np.asarray(np.sqrt((np.where(known, values, 0.0) ** 2).sum(axis=0) / count))


def _notes(result: Result) -> Iterator[str]:
    yield "found: value of this machine; +-: its standard error; before: standard deviation that the file allows."
    yield "determined: part of that variance which the readings take away."
    contact = str(result.attrs["contact"])
    if contact == "loaded":
        yield "Play lies where the loads press it."
    elif contact == "scattered":
        yield "Play scatters from approach to approach by its laws."
    else:
        yield "Play lies where loads press it in rows with a load, and scatters in the others."


def of_plan(result: Result) -> list[ResultTable]:
    """The table of `plan`."""
    count = len(result.get("gain"))
    columns = [words("reading", [str(k + 1) for k in range(count)], is_key=True)]
    numbers_ = result.get("configuration")
    if (numbers_ >= 0).all():
        columns.append(Column("configuration", "", tuple(map(str, numbers_.tolist()))))
    values = result.get("drive_value")
    if values.shape[1]:
        units = result.labels("drive_unit")
        columns += [numbers(name, units[k], values[:, k]) for k, name in enumerate(result.labels("drive"))]
    if "load_case" in result.data:
        columns.append(words("load case", result.get("load_case").tolist()))
    columns.append(Column("takes away", "%", tuple(f"{100.0 * gain:.1f}" for gain in result.get("gain").tolist())))
    columns.append(numbers("left", result.unit("position_after"), result.get("position_after")))
    note = "takes away: part of the error that is left by the readings before; left: rms of the position on the path."
    return [ResultTable("What to read next", tuple(columns), (note,))]


def of_diagnose(result: Result) -> list[ResultTable]:
    """The tables of `diagnose`."""
    parts, names = result.get("part"), result.labels("clearance")
    own = [[names[k] for k in np.flatnonzero(row).tolist()] for row in parts]
    found, spread = _with_errors(result.get("group_size"), result.get("group_standard_error"))
    ends = []
    for name in ("lowest", "highest"):
        # A size of the file is exact, however coarsely readings find it.
        values = result.get(f"group_{name}").tolist()
        cells = tuple(f"{value:.{OWN}g}" if math.isfinite(value) else NOTHING for value in values)
        ends.append(Column(f"{name}\nby the file", "", cells))
    columns = [
        words("clearances", [" + ".join(group) for group in own], is_key=True),
        *in_one_unit([Column("found", "", found), spread, *ends], result.labels("group_unit")),
        words("state", result.get("state").tolist()),
    ]
    note = "found: sum of the sizes, as the file measures them; +-: its standard error."
    return [ResultTable("Clearances of this machine", tuple(columns), (note,)), _columns_read(result)]


def _columns_read(result: Result) -> ResultTable:
    """How far readings are from what places have in common."""
    units = result.labels("channel_unit")
    columns = []
    for name, head in (("residual_before", "rms\nbefore"), ("residual_after", "rms\nafter")):
        values = _rms(result.get(name))
        columns.append(Column(head, "", tuple(fixed(value, _places(0.1 * value)) for value in values.tolist())))
    whole = (words("column", result.labels("channel"), is_key=True), *in_one_unit(columns, units))
    return ResultTable("Readings", whole)


def of_verify(result: Result) -> list[ResultTable]:
    """The table of `verify`."""
    places = words("row", [str(row) for row in result.labels("place")], is_key=True)
    columns = [places, Column("visits", "", tuple(map(str, result.get("visits").tolist())))]
    if "accuracy" in result.data:
        for k, point in enumerate(result.labels("point")):
            of = "" if point == "output" else f"{point}\n"
            names = ("accuracy", "repeatability")
            columns += [numbers(f"{of}{name}", result.unit(name), result.get(name)[:, k]) for name in names]
    figures = [*result.get("accuracy").T] if "accuracy" in result.data else []
    rows = chosen_rows(len(result.get("visits")), figures)
    return [ResultTable("Places, by their first row", tuple(columns), rows=rows)]
