"""What of a result is worth reading: for every question its table."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.questions import QUESTIONS, Question, named
from jointplay.result import (
    FORCES_JUDGED,
    Result,
    blame,
    blamed_for,
    figure,
    figures,
    first_largest,
    in_words,
    parts,
    rounding,
    size,
    split,
    unit_of,
)
from jointplay.result.conclusions import (
    BOUND_DIGITS,
    beyond,
    conclude,
    each,
    farthest,
    judged,
    name_of,
    quantile,
    rounded_up,
)
from jointplay.result.verdict import LOOSE, limits_in_words, verdict

from .fit import chosen_rows
from .indices import largest
from .layout import NOTHING, Column, ResultTable, change, commands, missed, numbers, statuses, words
from .map import overview as map_overview
from .notes import notes
from .pairs import overview as pairs_overview

#: shares below which all of a column are shown in ppm
RARE = 1e-3


def tables(result: Result) -> list[ResultTable]:
    """The tables of a result, by the question in its attributes."""
    several = parts(result)
    if len(several) > 1 or several[0][0]:
        blocks = [_headed(heading, k, table, part) for heading, part in several for k, table in enumerate(tables(part))]
        return [*blocks, *_envelopes(result)]
    question = _question(result)
    if "mechanism" in result.sizes:
        sizes = [values for name in figures(result) for values in figure(result, name)[0]]
        many = result.sizes["mechanism"] > 2
        title = "Configuration by configuration" if many else question.title
        whole = ResultTable(title, _compare(result), notes(result), rows=_rows(result, *sizes))
        return [_beside(result, question.title), whole] if many else [whole]
    if "sweep_by" in result.attrs:
        return pairs_overview(result, question.title)
    if "sweep" in result.attrs:
        return _sweep(result)
    if "grid" in result.attrs:
        return map_overview(result)
    if question.overview:
        return list(named(__package__, question.overview)(result))
    columns = [*_where(result), *named(__package__, question.table)(result)]
    outcomes = result.get("status").tolist()
    if any(outcome != "ok" for outcome in outcomes):
        columns.append(statuses("status", outcomes))
    marks = verdict(result).marks
    if any(marks):
        columns.append(missed("beyond limit", marks))
    return [ResultTable(question.title, tuple(columns), notes(result), rows=_rows(result, *_sizes(result)))]


def _headed(heading: str, number: int, table: ResultTable, part: Result) -> ResultTable:
    """A table of one output in one load case; the first one has the answer."""
    lead = () if number else conclude(part).sentences
    return replace(table, title=f"{heading}: {table.title}", lead=lead)


def _envelopes(result: Result) -> list[ResultTable]:
    """Of every output the largest errors over the load cases, configuration by configuration."""
    if "envelope_position" not in result.data or "configuration" not in result.data["envelope_position"].dims:
        return []
    outputs = enumerate(result.labels("output")) if "output" in result.sizes else [(None, "")]
    return [
        table
        for k, name in outputs
        for table in _envelope(result if k is None else result.isel("output", k), f"Output {name}: " if name else "")
    ]


def _envelope(result: Result, heading: str) -> list[ResultTable]:
    if "sweep" in result.attrs or "mechanism" in result.sizes:
        return []
    drives = [commands(name, drive.units, drive.values) for name, drive in result.drives.items()]
    columns = [_numbered(result), *drives]
    for word in ("position", "rotation"):
        columns.append(_figures(result, f"envelope_{word}", word))
        columns.append(
            words(f"{word}\nin case", [case or NOTHING for case in result.get(f"envelope_{word}_case").tolist()])
        )
    for part in _components(result):
        unit = result.unit("envelope_component", component=part[0])
        ends = {
            f"{c}\n{s}": result.get("envelope_component", component=c, side=s) for c in part for s in ("low", "high")
        }
        cells = numbers("", unit, np.concatenate(list(ends.values())), rounding(result, unit)).cells
        count = len(cells) // len(ends)
        columns += [Column(n, unit, cells[k * count : (k + 1) * count], spare=1) for k, n in enumerate(ends)]
    sizes = [result.get(f"envelope_{word}") for word in ("position", "rotation")]
    rows = chosen_rows(result.sizes["configuration"], sizes)
    return [ResultTable(f"{heading}Envelope: the largest errors over the load cases", tuple(columns), rows=rows)]


def _question(result: Result) -> Question:
    return QUESTIONS[str(result.attrs["question"])]


def _rows(result: Result, *sizes: Floats) -> tuple[int, ...]:
    """The configurations to show where there are many: those with the largest figures, and what is not ok."""
    count = result.sizes["configuration"]
    status = result.get("status").reshape(-1, count)
    marks = ["" if (column == "ok").all() else str(column[column != "ok"][0]) for column in status.T]
    return chosen_rows(count, sizes, marks)


def _sizes(result: Result) -> list[Floats]:
    """The figures by which configurations are compared: errors, else a nearness to singularity."""
    return [(-1.0 if name == "singular_value" else 1.0) * figure(result, name)[0] for name in figures(result)]


def _figures(result: Result, name: str, header: str, **at: object) -> Column:
    unit = result.unit(name, **at)
    return numbers(header, unit, result.get(name, **at), rounding(result, unit))


def together(
    result: Result,
    name: str,
    components: list[str],
    suffix: str,
    digits: int = 4,
    extra: dict[str, Floats] | None = None,
) -> list[Column]:
    """Components of one unit, with the same decimals."""
    unit = result.unit(name, component=components[0])
    parts = {f"{c}{suffix}": result.get(name, component=c) for c in components} | (extra or {})
    cells = numbers("", unit, np.concatenate(list(parts.values())), rounding(result, unit), digits).cells
    count = len(cells) // len(parts)
    return [Column(header, unit, cells[k * count : (k + 1) * count]) for k, header in enumerate(parts)]


def _numbered(result: Result) -> Column:
    return Column("#", "", tuple(str(k) for k in range(result.sizes["configuration"])), is_key=True)


def _where(result: Result) -> list[Column]:
    drives = [replace(commands(name, d.units, d.values), is_key=True) for name, d in result.drives.items()]
    # One drive says where it is; the values of several ones can be looked up by their number.
    if len(drives) > 1:
        drives = [replace(drive, spare=4) for drive in drives]
    return [_numbered(result), *drives]


def _blamed(result: Result, which: str) -> Column:
    shares = blame(result)
    # What is rounding has no cause.
    least = rounding(result, unit_of(result, which))
    if "error" in result.data:
        real = size(result, "error", which) > least
    elif f"worst_{which}" in result.data:
        real = np.abs(result.get(f"worst_{which}")) > least
    else:
        real = np.ones(len(shares.position), bool)
    cells = []
    for k in range(len(result.get("status"))):
        found = shares.largest(which, k) if real[k] else None
        cells.append(NOTHING if found is None else in_words(*found))
    return replace(words(blamed_for(result), cells), unit=f"for {which}")


def _components(result: Result) -> tuple[list[str], list[str]]:
    """Lengths and angles of the poses."""
    return split(result.labels("component"))


def of_solve(result: Result) -> list[Column]:
    """Where the output is, and how near every configuration is to a singular one."""
    lengths, angles = _components(result)
    columns = [*together(result, "nominal", lengths, "", 6), *together(result, "nominal", angles, "", 6)]
    columns.append(numbers("singular value", "", result.get("singular_value"), digits=3))
    if "mismatch" in result.data:
        asked = [c for c in result.labels("component") if np.isfinite(result.get("mismatch", component=c)).any()]
        columns += [_figures(result, "mismatch", f"{c} off path", component=c) for c in asked]
    return columns


def of_error(result: Result) -> list[Column]:
    """The components of an error, its sizes and what is to blame."""
    lengths, angles = _components(result)
    columns = together(result, "error", lengths, "", extra={"distance": size(result, "error", "position")})
    columns.append(_blamed(result, "position"))
    if len(angles) == 1:
        columns.append(_figures(result, "error", angles[0], component=angles[0]))
    else:
        turns = together(result, "error", angles, "", extra={"turn": size(result, "error", "rotation")})
        columns += [replace(column, spare=0 if column.name == "turn" else 2) for column in turns]
    return [*columns, replace(_blamed(result, "rotation"), spare=1), *_contact(result)]


def of_structural(result: Result) -> list[Column]:
    """How far every configuration is from the target, and its components."""
    columns = []
    if "structural_deviation" in result.data:
        asked = [
            c for c in result.labels("component") if np.isfinite(result.get("structural_deviation", component=c)).any()
        ]
        columns = [
            column for part in split(asked) if part for column in together(result, "structural_deviation", part, "")
        ]
    unit = result.unit("structural_error")
    return [*columns, numbers("structural error", unit, result.get("structural_error"), rounding(result, unit))]


def _contact(result: Result) -> list[Column]:
    """Where contact does not follow the reactions of a machine that runs."""
    if "contact" not in result.data:
        return []
    names, states = np.array(result.labels("source")), result.get("contact")
    cells = []
    for row in states:
        state = next((state for state in LOOSE if (row == state).any()), "")
        cells.append(f"{state}: {', '.join(names[row == state].tolist())}" if state else NOTHING)
    return [words("contact", cells)] if any(cell != NOTHING for cell in cells) else []


def of_worst(result: Result) -> list[Column]:
    """The largest errors, to first order and on the exact closure, with their bounds."""
    return [
        _figures(result, "worst_position", "position"),
        *_bound(result, "position"),
        replace(_figures(result, "worst_position_first_order", "position\nfirst order"), spare=2),
        _blamed(result, "position"),
        _figures(result, "worst_rotation", "rotation"),
        *_bound(result, "rotation"),
        replace(_figures(result, "worst_rotation_first_order", "rotation\nfirst order"), spare=2),
        replace(_blamed(result, "rotation"), spare=1),
    ]


def _bound(result: Result, which: str) -> list[Column]:
    """The bound of an error, and by how much it is above the value."""
    if "certified" not in result.data:
        return []
    unit = result.unit(f"worst_{which}_certified")
    bounds = rounded_up(result.get(f"worst_{which}_certified"))
    gap = numbers(f"{which}\ngap", "%", 100 * result.get(f"worst_{which}_gap"), digits=2)
    return [numbers(f"{which}\nbound", unit, bounds, rounding(result, unit), BOUND_DIGITS), gap]


def of_random(result: Result) -> list[Column]:
    """How errors scatter, and how many specimens are outside the limits."""
    length, angle = unit_of(result, "position"), unit_of(result, "rotation")
    spread = [column for part in _components(result) for column in together(result, "error_std", part, " std")]
    columns = [replace(column, spare=3, legend="std: standard deviation.") for column in spread]
    for share, spare in ((0.5, 2), (0.95, 0), (0.99, 2)):
        values = quantile(result, "position", share)
        columns.append(replace(numbers(f"{100 * share:g} %", length, values, rounding(result, length), 3), spare=spare))
    columns += [_blamed(result, "position"), *_indices(result, "position")]
    columns.append(numbers("95 % turn", angle, quantile(result, "rotation", 0.95), rounding(result, angle), 3))
    columns += [replace(column, spare=1) for column in (_blamed(result, "rotation"), *_indices(result, "rotation"))]
    if np.isfinite(result.get("outside")).any():
        columns += _outside(result)
    if "repeatability" in result.data:
        columns.append(replace(_figures(result, "repeatability", "repeatability"), spare=3))
    for outcome, header in (("strained", "strained"), ("not_assemblable", "not assemblable")):
        if outcome in result.data and result.get(outcome).any():
            columns.append(numbers(header, "%", 100 * result.get(outcome), digits=3))
    return columns


def _indices(result: Result, which: str) -> list[Column]:
    if "sobol_total" not in result.data:
        return []
    return [replace(words("total index", largest(result, which)), unit=f"for {which}")]


def _outside(result: Result) -> list[Column]:
    """Shares beyond the limits with their confidence intervals, and the least capability."""
    low, high = result.get("outside_low"), result.get("outside_high")
    tops = [result.get(name) for name in ("outside_high", "outside_loaded_high") if name in result.data]
    unit, factor = ("%", 1e2) if np.nanmax(tops) >= RARE else ("ppm", 1e6)
    ends = zip((factor * low).tolist(), (factor * high).tolist(), strict=True)
    intervals = [NOTHING if a != a else f"{_rough(a)} to {_rough(b)}" for a, b in ends]
    columns = [
        _shares(result, "outside", "outside", (unit, factor)),
        Column("95 % confidence", unit, tuple(intervals), spare=3),
    ]
    if "outside_loaded" in result.data and np.isfinite(result.get("outside_loaded")).any():
        pressed = _shares(result, "outside_loaded", "outside\nunder load", (unit, factor))
        columns.append(replace(pressed, legend="Under load: the load decides the offsets."))
    cpk = result.get("cpk")
    if np.isfinite(cpk).any():
        least = np.where(np.isfinite(cpk), cpk, np.inf).min(axis=1)
        least = np.where(np.isfinite(least), least, np.nan)
        columns.append(replace(numbers("Cpk", "", least, digits=3), spare=2, legend="Cpk: the least of all limits."))
    words = f"Outside: share of the specimens beyond {limits_in_words(result)}, or without a pose."
    return [replace(column, legend=words) if column.name == "outside" else column for column in columns]


def _shares(result: Result, name: str, header: str, unit: tuple[str, float]) -> Column:
    """Shares; those that are searched for have digits of their own, however far apart they are."""
    values = unit[1] * result.get(name)
    if f"{name}_method" not in result.data:
        return numbers(header, unit[0], values, digits=3)
    return Column(header, unit[0], tuple(NOTHING if part != part else f"{part:.3g}" for part in values.tolist()))


def _rough(value: float) -> str:
    """A number with two digits, and no exponent where it has few places."""
    return f"{float(f'{value:.2g}'):g}"


def of_compensate(result: Result) -> list[Column]:
    """The corrected drives, and what is left of the error."""
    columns = []
    for name, unit in zip(result.labels("drive"), result.coords["drive_unit"].values.tolist(), strict=True):
        corrected, change = result.get("drive_corrected", drive=name), result.get("correction", drive=name)
        change_column = numbers(f"{name}\nchange", unit, change, rounding(result, unit))
        places = len(change_column.cells[0].partition(".")[2]) if change_column.cells else 0
        cells = tuple(f"{v:.{places}f}" if np.isfinite(v) else NOTHING for v in corrected)
        columns += [Column(f"{name} corrected", unit, cells), change_column]
    length, angle = unit_of(result, "position"), unit_of(result, "rotation")
    columns.append(numbers("position\nerror", length, result.get("error_position"), rounding(result, length)))
    columns.append(numbers("position\nleft", length, result.get("residual_position"), rounding(result, length)))
    columns.append(numbers("rotation\nerror", angle, result.get("error_rotation"), rounding(result, angle)))
    columns.append(numbers("rotation\nleft", angle, result.get("residual_rotation"), rounding(result, angle)))
    return columns


def _compare(result: Result) -> tuple[Column, ...]:
    names = result.labels("mechanism")
    columns = [_numbered(result)]
    for label in names:
        # A structure has no drives.
        units = result.coords["drive_unit"].values.tolist() if "drive_unit" in result.coords else []
        for drive, unit in zip(result.labels("drive") if units else [], units, strict=True):
            values = result.get("drive_value", mechanism=label, drive=drive)
            if np.isfinite(values).any():
                columns.append(replace(commands(f"{label}\n{drive}", unit, values), spare=1))
    if "correction" in result.data:
        columns += _corrections_of_both(result)
    for short in figures(result):
        values, unit = figure(result, short)
        cells = numbers("", unit, values.reshape(-1), rounding(result, unit)).cells
        count = values.shape[1]
        for k, label in enumerate(names):
            columns.append(Column(f"{label}\n{short}", unit, cells[k * count : (k + 1) * count]))
        if len(names) == 2:
            small = np.abs(values[0]) <= rounding(result, unit)
            ratio = np.divide(values[1], values[0], out=np.full(count, np.nan), where=~small)
            columns.append(numbers(f"{short}\nratio", "", ratio, digits=3))
    if any(map(any, found := beyond(result))):
        # A mechanism without limits has nothing to be beyond.
        columns += [missed(f"{label}\nbeyond limit", own) for label, own in zip(names, found, strict=True) if own]
    outcomes = result.get("status")
    for k, label in enumerate(names):
        if (outcomes[k] != "ok").any():
            columns.append(statuses(f"{label}\nstatus", outcomes[k].tolist()))
    return tuple(columns)


def _beside(result: Result, title: str) -> ResultTable:
    """A column for each of several mechanisms: verdict, largest errors, where and why, and what the first has."""
    names = result.labels("mechanism")
    verdicts = judged(result)
    rows: dict[str, list[str]] = {}
    if any(found.outcome for found in verdicts):
        rows["limits of errors" if FORCES_JUDGED in result.data else "limits"] = [
            found.outcome or NOTHING for found in verdicts
        ]
    if FORCES_JUDGED in result.data:
        rows["limits of forces"] = [one or NOTHING for one in result.get(FORCES_JUDGED).tolist()]
    for short in figures(result):
        values, unit = figure(result, short)
        places = [farthest(row, part.get("status")) for row, part in zip(values, each(result), strict=True)]
        tops = [float("nan") if k is None else float(row[k]) for row, k in zip(values, places, strict=True)]
        rows[f"largest {short}, {unit}"] = [*numbers("", unit, tops, rounding(result, unit)).cells]
        if tops[0] > rounding(result, unit):
            rows[f"{short}, beside {names[0]}"] = [
                "" if top != top or not k else change(tops[0], top) for k, top in enumerate(tops)
            ]
        rows[f"{short}, configuration"] = [NOTHING if k is None else str(k) for k in places]
    bad = (result.get("status") != "ok").sum(axis=1).tolist()
    if any(bad):
        rows["not ok"] = [*map(str, bad)]
    columns = [words("", [*rows], is_key=True)]
    columns += [Column(name, "", tuple(cells[k] for cells in rows.values())) for k, name in enumerate(names)]
    return ResultTable(title, tuple(columns))


def _corrections_of_both(result: Result) -> Iterator[Column]:
    """What each mechanism of a comparison changes of its own drives."""
    units = result.coords["drive_unit"].values.tolist() if "drive_unit" in result.coords else []
    for label in result.labels("mechanism"):
        for drive, unit in zip(result.labels("drive"), units, strict=True):
            values = result.get("correction", mechanism=label, drive=drive)
            if np.isfinite(values).any():
                yield numbers(f"{label}\n{drive} change", unit, values, rounding(result, unit))


def _sweep(result: Result) -> list[ResultTable]:
    """One row per value: smallest, mean and largest figure over the configurations, and where it is largest."""
    dim = str(result.attrs["sweep"])
    along, name = result.coords[dim], name_of(result, dim)
    if along.values.dtype.kind in "fiu":
        first = commands(name, along.units, along.values)
    else:
        first = words(name, [str(v) for v in along.values.tolist()])
    columns = [replace(first, is_key=True)]
    worst = []
    for name in figures(result):
        values, unit = figure(result, name)
        values = np.abs(values)
        known = np.isfinite(values).sum(axis=1) > 0
        safe = np.where(np.isfinite(values), values, -np.inf)
        spread = [np.where(known, _over(values, f), np.nan) for f in (np.nanmin, np.nanmean, np.nanmax)]
        cells = numbers("", unit, np.concatenate(spread), rounding(result, unit)).cells
        count = len(values)
        short = name.replace("_", " ")
        worst.append(spread[-1])
        for k, word in enumerate(("least", "mean", "largest")):
            part = cells[k * count : (k + 1) * count]
            columns.append(Column(f"{short}\n{word}", unit, part, spare=0 if word == "largest" else 1))
        places = [str(k) if ok else NOTHING for k, ok in zip(first_largest(safe).tolist(), known.tolist(), strict=True)]
        columns.append(Column(f"{short}\nat #", "", tuple(places)))
    if any(map(any, found := beyond(result))):
        counts = [sum(map(bool, marks)) for marks in found]
        columns.append(_counted("beyond limit", counts))
    if "contact" in result.data:
        loose = np.isin(result.get("contact"), LOOSE).any(axis=2).sum(axis=1)
        if loose.any():
            columns.append(_counted("contact may\nbe lost", loose.tolist()))
    bad = (result.get("status") != "ok").sum(axis=1)
    if bad.any():
        columns.append(_counted("not ok", bad.tolist()))
    count = result.sizes["configuration"]
    over = f"over {count} configuration{'s' * (count != 1)}, by {along.long_name or dim}"
    rows = chosen_rows(len(along.values), worst)
    return [ResultTable(f"{_question(result).title} {over}", tuple(columns), notes(result), rows=rows)]


def _counted(name: str, counts: list[int]) -> Column:
    """How many configurations are not as they should be; any stands out."""
    return Column(name, "", tuple(map(str, counts)), alarms=tuple(k for k, n in enumerate(counts) if n))


def _over(values: Floats, statistic: Callable[..., Floats]) -> Floats:
    """A statistic of every row; nan for rows without a number, without a warning."""
    rows = [statistic(row[np.isfinite(row)]) if np.isfinite(row).any() else np.nan for row in values]
    return np.array(rows)
