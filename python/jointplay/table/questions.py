"""What of a result is worth reading: for every question its table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from jointplay.result import TYPICAL, Result, blame, in_words, parts, size, split, unit_of
from jointplay.verdict import verdict

from .allocate import overview as allocate_overview
from .allow import overview as allow_overview
from .assembly import overview as assembly_overview
from .check import overview
from .indices import largest
from .layout import NOTHING, Column, Table, commands, numbers, words
from .map import overview as map_overview
from .notes import notes
from .singularities import columns as singularities

#: longer motions are shown in part; files hold all of them
MOST_ROWS = 60
#: shares of the characteristic length, and radians in degrees, that are rounding
NOISE = 1e-10
#: shares below which all of a column are shown in ppm
RARE = 1e-3

Floats = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def tables(result: Result) -> list[Table]:
    """The tables of a result, by the question in its attributes."""
    several = parts(result)
    if len(several) > 1 or several[0][0]:
        blocks = [replace(t, title=f"{heading}: {t.title}") for heading, part in several for t in tables(part)]
        return [*blocks, *_envelopes(result)]
    if "mechanism" in result.sizes:
        return [Table(TITLES[_question(result)], _compare(result), notes(result))]
    if "sweep" in result.attrs:
        return _sweep(result)
    if "grid" in result.attrs:
        return map_overview(result)
    question = _question(result)
    if question == "check":
        return overview(result)
    if question == "allocate":
        return allocate_overview(result)
    if question == "allow":
        return allow_overview(result)
    if question == "assemble":
        return assembly_overview(result)
    columns = [*_where(result), *COLUMNS[question](result)]
    if any(status != "ok" for status in result.get("status").tolist()):
        columns.append(words("status", [s.replace("_", " ") for s in result.get("status").tolist()]))
    found = verdict(result)
    if any(found.marks):
        columns.append(words("beyond limit", [mark or NOTHING for mark in found.marks]))
    shown = _rows(result, question)
    more = len(result.get("status")) - len(shown)
    extra = (f"{more} more configurations are not shown; -o writes them all.",) if more else ()
    table = Table(TITLES[question], tuple(_only(c, shown) for c in columns), (*notes(result), *extra))
    return [replace(table, lead=found.sentences)]


def _envelopes(result: Result) -> list[Table]:
    """Of every output the largest errors over the load cases, configuration by configuration."""
    if "envelope_position" not in result.data or "configuration" not in result.data["envelope_position"].dims:
        return []
    outputs = enumerate(result.labels("output")) if "output" in result.sizes else [(None, "")]
    return [
        table
        for k, name in outputs
        for table in _envelope(result if k is None else result.isel("output", k), f"Output {name}: " if name else "")
    ]


def _envelope(result: Result, heading: str) -> list[Table]:
    if "sweep" in result.attrs or "mechanism" in result.sizes:
        return []
    drives = [commands(name, drive.units, drive.values) for name, drive in result.drives.items()]
    columns = [Column("#", "", tuple(str(k) for k in range(result.sizes["configuration"]))), *drives]
    for word in ("position", "rotation"):
        columns.append(_figures(result, f"envelope_{word}", word))
        columns.append(words("in case", [case or NOTHING for case in result.get(f"envelope_{word}_case").tolist()]))
    for part in _components(result):
        unit = result.unit("envelope_component", component=part[0])
        ends = {
            f"{c}\n{s}": result.get("envelope_component", component=c, side=s) for c in part for s in ("low", "high")
        }
        cells = numbers("", unit, np.concatenate(list(ends.values())), noise(result, unit)).cells
        count = len(cells) // len(ends)
        columns += [Column(n, unit, cells[k * count : (k + 1) * count], spare=1) for k, n in enumerate(ends)]
    rows = _chosen_rows(result.get("envelope_position"))
    more = result.sizes["configuration"] - len(rows)
    extra = (f"{more} more configurations are not shown; -o writes them all.",) if more else ()
    title = f"{heading}Envelope: the largest errors over the load cases"
    return [Table(title, tuple(_only(c, rows) for c in columns), extra)]


def _question(result: Result) -> str:
    return str(result.attrs["question"])


def _rows(result: Result, question: str) -> list[int]:
    """All configurations, or some evenly spaced and the worst of them."""
    if len(result.get("status")) <= MOST_ROWS:
        return list(range(len(result.get("status"))))
    return _chosen_rows(_size(result, question))


def _chosen_rows(figure: Floats) -> list[int]:
    count = len(figure)
    if count <= MOST_ROWS:
        return list(range(count))
    rows = set(np.linspace(0, count - 1, MOST_ROWS).round().astype(int).tolist())
    if np.isfinite(figure).any():
        rows.add(int(np.nanargmax(figure)))
    return sorted(rows)


def _only(column: Column, rows: list[int]) -> Column:
    return replace(column, cells=tuple(column.cells[k] for k in rows))


def _size(result: Result, question: str) -> Floats:
    """The figure by which configurations are compared: a position error, else a nearness to singularity."""
    if question == "worst":
        return result.get("worst_position")
    if question == "random":
        return _quantile(result, "position", TYPICAL)
    if question in ("solve", "singularities"):
        return -result.get("singular_value")
    return size(result, "error", "position")


def _quantile(result: Result, quantity: str, probability: float) -> Floats:
    levels = result.labels("probability")
    nearest = min(levels, key=lambda level: abs(level - probability))
    return result.get("error_quantile", probability=nearest, quantity=quantity)


def noise(result: Result, unit: str) -> float:
    """What of a length or an angle is rounding, in its unit."""
    if unit == "rad":
        return NOISE
    return NOISE * (57.3 if unit == "deg" else float(result.attrs.get("length", 0.0)))


def _figures(result: Result, name: str, header: str, **at: object) -> Column:
    unit = result.unit(name, **at)
    return numbers(header, unit, result.get(name, **at), noise(result, unit))


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
    cells = numbers("", unit, np.concatenate(list(parts.values())), noise(result, unit), digits).cells
    count = len(cells) // len(parts)
    return [Column(header, unit, cells[k * count : (k + 1) * count]) for k, header in enumerate(parts)]


def _where(result: Result) -> list[Column]:
    count = len(result.get("status"))
    drives = [commands(name, drive.units, drive.values) for name, drive in result.drives.items()]
    return [Column("#", "", tuple(str(k) for k in range(count))), *drives]


def _blamed(result: Result, which: str, header: str = "to blame") -> Column:
    shares = blame(result)
    # What is rounding has no cause.
    rounding = noise(result, unit_of(result, which))
    if "error" in result.data:
        real = size(result, "error", which) > rounding
    elif f"worst_{which}" in result.data:
        real = np.abs(result.get(f"worst_{which}")) > rounding
    else:
        real = np.ones(len(shares.position), bool)
    cells = []
    for k in range(len(result.get("status"))):
        found = shares.largest(which, k) if real[k] else None
        cells.append(NOTHING if found is None else in_words(*found))
    return replace(words(header, cells), unit=f"for {which}")


def _components(result: Result) -> tuple[list[str], list[str]]:
    """Lengths and angles of the poses."""
    return split(result.labels("component"))


def _solve(result: Result) -> list[Column]:
    lengths, angles = _components(result)
    columns = [*together(result, "nominal", lengths, "", 6), *together(result, "nominal", angles, "", 6)]
    columns.append(numbers("singular value", "", result.get("singular_value"), digits=3))
    if "mismatch" in result.data:
        asked = [c for c in result.labels("component") if np.isfinite(result.get("mismatch", component=c)).any()]
        columns += [_figures(result, "mismatch", f"{c} off path", component=c) for c in asked]
    return columns


def _error(result: Result) -> list[Column]:
    lengths, angles = _components(result)
    columns = together(result, "error", lengths, "", extra={"distance": size(result, "error", "position")})
    columns.append(_blamed(result, "position"))
    if len(angles) == 1:
        columns.append(_figures(result, "error", angles[0], component=angles[0]))
    else:
        turns = together(result, "error", angles, "", extra={"turn": size(result, "error", "rotation")})
        columns += [replace(column, spare=0 if column.name == "turn" else 2) for column in turns]
    return [*columns, replace(_blamed(result, "rotation"), spare=1)]


def _loaded(result: Result) -> list[Column]:
    columns = _error(result)
    for c in result.labels("component"):
        rounding = noise(result, result.unit("undetermined", component=c))
        if (result.get("undetermined", component=c) > rounding).any():
            columns.append(_figures(result, "undetermined", f"{c} open ±", component=c))
    return columns


def _worst(result: Result) -> list[Column]:
    return [
        _figures(result, "worst_position", "position"),
        replace(_figures(result, "worst_position_first_order", "first order"), spare=2),
        _blamed(result, "position"),
        _figures(result, "worst_rotation", "rotation"),
        replace(_figures(result, "worst_rotation_first_order", "first order"), spare=2),
        replace(_blamed(result, "rotation"), spare=1),
    ]


def _random(result: Result) -> list[Column]:
    length, angle = unit_of(result, "position"), unit_of(result, "rotation")
    spread = [column for part in _components(result) for column in together(result, "error_std", part, " std")]
    columns = [replace(column, spare=3) for column in spread]
    for share, spare in ((0.5, 2), (0.95, 0), (0.99, 2)):
        values = _quantile(result, "position", share)
        columns.append(replace(numbers(f"{100 * share:g} %", length, values, noise(result, length), 3), spare=spare))
    columns += [_blamed(result, "position"), *_indices(result, "position")]
    columns.append(numbers("95 % turn", angle, _quantile(result, "rotation", 0.95), noise(result, angle), 3))
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
    share, low, high = (result.get(name) for name in ("outside", "outside_low", "outside_high"))
    unit, factor = ("%", 1e2) if np.nanmax(high) >= RARE else ("ppm", 1e6)
    ends = zip((factor * low).tolist(), (factor * high).tolist(), strict=True)
    intervals = [NOTHING if a != a else f"{a:.2g} to {b:.2g}" for a, b in ends]
    # Shares that are searched for have digits of their own, however far apart they are.
    searched = tuple(NOTHING if part != part else f"{part:.3g}" for part in (factor * share).tolist())
    columns = [
        Column("outside", unit, searched)
        if "outside_method" in result.data
        else numbers("outside", unit, factor * share, digits=3),
        Column("95 % confidence", unit, tuple(intervals), spare=3),
    ]
    cpk = result.get("cpk")
    if np.isfinite(cpk).any():
        least = np.where(np.isfinite(cpk), cpk, np.inf).min(axis=1)
        columns.append(replace(numbers("Cpk", "", np.where(np.isfinite(least), least, np.nan), digits=3), spare=2))
    return columns


def _compensate(result: Result) -> list[Column]:
    columns = []
    for name, unit in zip(result.labels("drive"), result.coords["drive_unit"].values.tolist(), strict=True):
        corrected, change = result.get("drive_corrected", drive=name), result.get("correction", drive=name)
        change_column = numbers("change", unit, change, noise(result, unit))
        places = len(change_column.cells[0].partition(".")[2]) if change_column.cells else 0
        cells = tuple(f"{v:.{places}f}" if np.isfinite(v) else NOTHING for v in corrected)
        columns += [Column(f"{name} corrected", unit, cells), change_column]
    length, angle = unit_of(result, "position"), unit_of(result, "rotation")
    columns.append(numbers("error", length, size(result, "error", "position"), noise(result, length)))
    columns.append(numbers("left", length, result.get("residual_position"), noise(result, length)))
    columns.append(numbers("turn", angle, size(result, "error", "rotation"), noise(result, angle)))
    columns.append(numbers("left", angle, result.get("residual_rotation"), noise(result, angle)))
    return columns


def _figure_names(question: str) -> list[tuple[str, dict[str, object], str]]:
    """The figures that sweeps and comparisons show: variable, labels, words."""
    if question == "worst":
        return [("worst_position", {}, "largest position error"), ("worst_rotation", {}, "largest rotation")]
    if question == "random":
        at: dict[str, object] = {"quantity": "position"}
        return [
            ("error_quantile", at, "95 % position error"),
            ("error_quantile", {"quantity": "rotation"}, "95 % rotation"),
        ]
    if question == "solve":
        return [("singular_value", {}, "smallest singular value")]
    return [("error", {"size": "position"}, "position error"), ("error", {"size": "rotation"}, "rotation")]


def _figure(result: Result, name: str, at: dict[str, object]) -> tuple[Floats, str]:
    if name == "error":
        quantity = str(at["size"])
        return size(result, "error", quantity), unit_of(result, quantity)
    if name == "error_quantile":
        quantity = str(at["quantity"])
        return _quantile(result, quantity, TYPICAL), result.unit(name, quantity=quantity)
    return result.get(name, **at), result.unit(name, **at)


def _beyond(result: Result) -> list[tuple[str, ...]]:
    """For every mechanism of a comparison, or value of a sweep, what each configuration misses."""
    dim = "mechanism" if "mechanism" in result.sizes else str(result.attrs["sweep"])
    attrs = {key: value for key, value in result.attrs.items() if key != "sweep"}
    found = (result.isel(dim, k) for k in range(result.sizes[dim]))
    return [verdict(Result(part.coords, part.data, attrs)).marks for part in found]


def _compare(result: Result) -> tuple[Column, ...]:
    first, second = result.labels("mechanism")
    columns = [Column("#", "", tuple(str(k) for k in range(result.sizes["configuration"])))]
    for label in (first, second):
        # A structure has no drives.
        units = result.coords["drive_unit"].values.tolist() if "drive_unit" in result.coords else []
        for drive, unit in zip(result.labels("drive") if units else [], units, strict=True):
            values = result.get("drive_value", mechanism=label, drive=drive)
            if np.isfinite(values).any():
                columns.append(commands(f"{label}\n{drive}", unit, values))
    for name, at, what in _figure_names(_question(result)):
        values, unit = _figure(result, name, at)
        short = "position" if "position" in what else "rotation"
        cells = numbers("", unit, values.reshape(-1), noise(result, unit)).cells
        count = values.shape[1]
        columns += [Column(f"{first}\n{short}", unit, cells[:count]), Column(f"{second}\n{short}", unit, cells[count:])]
        small = np.abs(values[0]) <= noise(result, unit)
        ratio = np.divide(values[1], values[0], out=np.full(count, np.nan), where=~small)
        columns.append(numbers("ratio", "", ratio, digits=3))
    if any(map(any, beyond := _beyond(result))):
        for k, label in enumerate((first, second)):
            columns.append(words(f"{label}\nbeyond limit", [mark or NOTHING for mark in beyond[k]]))
    statuses = result.get("status")
    for k, label in enumerate((first, second)):
        if (statuses[k] != "ok").any():
            columns.append(words(f"{label}\nstatus", [s.replace("_", " ") for s in statuses[k].tolist()]))
    return tuple(columns)


def _sweep(result: Result) -> list[Table]:
    """One row per value: smallest, mean and largest figure over the configurations, and where it is largest."""
    dim, question = str(result.attrs["sweep"]), _question(result)
    along = result.coords[dim]
    if along.values.dtype.kind in "fiu":
        first = commands(dim, along.units, along.values)
    else:
        first = words(dim, [str(v) for v in along.values.tolist()])
    columns = [first]
    for name, at, what in _figure_names(question):
        values, unit = _figure(result, name, at)
        values = np.abs(values)
        known = np.isfinite(values).sum(axis=1) > 0
        safe = np.where(np.isfinite(values), values, -np.inf)
        spread = [np.where(known, _over(values, f), np.nan) for f in (np.nanmin, np.nanmean, np.nanmax)]
        cells = numbers("", unit, np.concatenate(spread), noise(result, unit)).cells
        count = len(values)
        short = "position" if "position" in what else "rotation" if "rotation" in what else "singular value"
        for k, word in enumerate(("least", "mean", "largest")):
            part = cells[k * count : (k + 1) * count]
            columns.append(Column(f"{short}\n{word}", unit, part, spare=0 if word == "largest" else 1))
        places = [str(k) if ok else NOTHING for k, ok in zip(safe.argmax(axis=1).tolist(), known.tolist(), strict=True)]
        columns.append(Column("\nat #", "", tuple(places)))
    if any(map(any, beyond := _beyond(result))):
        counts = [sum(map(bool, marks)) for marks in beyond]
        columns.append(Column("beyond limit", "", tuple(str(count) for count in counts)))
    bad = (result.get("status") != "ok").sum(axis=1)
    if bad.any():
        columns.append(Column("not ok", "", tuple(str(n) for n in bad.tolist())))
    count = result.sizes["configuration"]
    over = f"over {count} configuration{'s' * (count != 1)}, by {along.long_name or dim}"
    return [Table(f"{TITLES[question]} {over}", tuple(columns), notes(result))]


def _over(values: Floats, statistic: Callable[..., Floats]) -> Floats:
    """A statistic of every row; nan for rows without a number, without a warning."""
    rows = [statistic(row[np.isfinite(row)]) if np.isfinite(row).any() else np.nan for row in values]
    return np.array(rows)


TITLES = {
    "solve": "Nominal output",
    "given": "Given offsets: error of the output",
    "loaded": "Loaded: where the load pushes the output",
    "worst": "Worst case: the largest error that the clearances and tolerances allow",
    "random": "Random: scatter of the error from specimen to specimen",
    "compensate": "Compensation: drives corrected",
    "singularities": "Singularities: the smallest singular values, and how far away along the path",
}
COLUMNS: dict[str, Callable[[Result], list[Column]]] = {
    "solve": _solve,
    "given": _error,
    "loaded": _loaded,
    "worst": _worst,
    "random": _random,
    "compensate": _compensate,
    "singularities": singularities,
}
