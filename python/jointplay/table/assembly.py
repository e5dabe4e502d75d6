"""An assembly as one would follow it in the shop: what to do, what comes of it, and whether it fits."""

from __future__ import annotations

import numpy as np

from jointplay.result import Result, split, unit_of

from .layout import NOTHING, Column, Table, fixed, numbers, words

KINDS = {
    "fixed": "fix the link",
    "connected": "connect the links",
    "closing": "close the loop",
    "redundant": "insert a redundant link",
    "loose": "hang it on",
    "redundant and loose": "insert a redundant link, hang it on",
}
VERDICTS = {
    "ok": "fits",
    "undetermined": "fits, with play",
    "underconstrained": "fits, has to be held",
    "strained": "fits under strain",
    "not_assemblable": "does not fit",
    "singular": "singular",
    "not_assembled": "cannot be closed",
}
#: lengths below this many millimetres are told in microns
SMALL = 0.1
MICRONS = 1000.0
#: characters of a list of members before it is broken
LINE = 30
#: shares of the characteristic length, and forces in their unit, that are rounding
NOISE = 1e-10

Floats = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def overview(result: Result) -> list[Table]:
    """The sequence, and where every joint is in the end."""
    steps = result.labels("step")
    tables = [_sequence(result)]
    return tables + [centres(result, steps[-1])]


def centres(result: Result, step: int) -> Table:
    """Where the centres of every joint are after a step."""
    joints = np.array(result.labels("joint"), dtype=str)
    there = np.isfinite(result.get("error_shaft", step=step)).any(axis=-1)
    lengths, _ = split(result.labels("component"))
    values = {
        name: np.stack([result.get(name, step=step, component=c)[there] for c in lengths])
        for name in ("error_shaft", "error_bearing", "undetermined_shaft", "undetermined_bearing")
    }
    scale, unit = _scale(unit_of(result, "position"), *values.values())
    columns = [words("joint", joints[there].tolist())]
    for end in ("shaft", "bearing"):
        both = np.concatenate([values[f"error_{end}"], values[f"undetermined_{end}"]]) * scale
        cells = numbers("", unit, both.ravel(), _noise(result) * scale).cells
        rows, count = len(cells) // (2 * len(lengths)), len(lengths)
        open_ = bool((both[count:] > _noise(result) * scale).any())
        for k, name in enumerate(lengths):
            own = cells[k * rows : (k + 1) * rows]
            columns.append(Column(f"{end}\n{name}", unit, own))
            if open_:
                half = cells[(count + k) * rows : (count + k + 1) * rows]
                columns.append(Column("\n±", unit, half, spare=1))
    note = "Shaft: centre on the first body of the joint; bearing: on the second. ±: what the loads leave open."
    return Table(f"Position errors after step {step}", tuple(columns), (note,))


def _sequence(result: Result) -> Table:
    error, half, where = _largest(result)
    scale, unit = _scale(unit_of(result, "position"), error, half)
    noise = _noise(result) * scale
    columns = [
        Column("step", "", tuple(str(step) for step in result.labels("step"))),
        words("add", [str(cell) for cell in result.get("links").tolist()]),
        words("and", [KINDS.get(kind, kind) for kind in result.get("kind").tolist()]),
        numbers("largest\nerror", unit, error * scale, noise),
        words("of", where),
    ]
    if (half * scale > noise).any():
        columns.insert(4, numbers("\n±", unit, half * scale, noise))
    columns += _strain(result)
    columns.append(words("verdict", [VERDICTS[status] for status in result.get("status").tolist()]))
    return Table(f"Assembly on '{result.attrs['base']}'", tuple(columns), tuple(_notes(result)))


def _largest(result: Result) -> tuple[Floats, Floats, list[str]]:
    """Per step the largest position error of a joint's centre, its half-width, and which joint that is."""
    lengths, _ = split(result.labels("component"))

    def sizes(name: str) -> Floats:
        ends = [
            np.linalg.norm(np.stack([result.get(f"{name}_{end}", component=c) for c in lengths]), axis=0)
            for end in ("shaft", "bearing")
        ]
        return np.stack(ends, axis=-1)

    errors, halves = sizes("error"), sizes("undetermined")
    names = result.labels("joint")
    largest, open_, where = [], [], []
    for error, half in zip(errors, halves, strict=True):
        # Where nothing is known to be off, the joint with the most play is the one to watch.
        rank = np.nan_to_num(error, nan=-1.0) + 1e-6 * np.nan_to_num(half)
        joint, end = np.unravel_index(int(rank.argmax()), rank.shape) if rank.size else (0, 0)
        known = rank.size and np.isfinite(error[joint, end])
        largest.append(error[joint, end] if known else np.nan)
        open_.append(half[joint, end] if known else np.nan)
        where.append(f"{names[joint]} {('shaft', 'bearing')[end]}" if known else NOTHING)
    return np.array(largest), np.array(open_), where


def _strain(result: Result) -> list[Column]:
    """The largest force of a member, and by how much the clearances would have to be larger."""
    columns = []
    forces = result.get("member_force")
    unit = result.data["member_force"].units
    names = result.labels("member")
    if forces.size and (np.abs(np.nan_to_num(forces)) > NOISE).any():
        rows = np.abs(np.nan_to_num(forces)).argmax(axis=1)
        values = forces[np.arange(len(rows)), rows]
        columns.append(numbers("largest\nforce", unit, values, NOISE))
        columns.append(words("in", [names[k] if np.isfinite(v) else NOTHING for k, v in zip(rows, values, strict=True)]))
    if (result.get("redundancy") > 0).any():
        redundant = result.get("redundancy") > 0
        factors = result.get("clearance_factor")
        cells = tuple(fixed(float(f), 3) if r else NOTHING for f, r in zip(factors, redundant, strict=True))
        columns.append(Column("clearances\ntimes", "", cells))
    return columns


def _notes(result: Result) -> list[str]:
    said = []
    for step, held in zip(result.labels("step"), result.get("held").tolist(), strict=True):
        if held:
            said.append(f"Step {step} leaves something free: held at its nominal place: {held}.")
    statuses = result.get("status").tolist()
    if "undetermined" in statuses or "underconstrained" in statuses:
        said.append("±: half-width of what the play leaves open; nothing pushes the clearances to one side.")
    if (result.get("redundancy") > 0).any():
        said.append("Clearances times: the smallest factor on all clearances with which it goes together without strain.")
    return said


def _scale(unit: str, *values: Floats) -> tuple[float, str]:
    """Microns where millimetres would all be small."""
    sizes = np.concatenate([np.abs(v[np.isfinite(v)]).ravel() for v in values])
    if unit == "mm" and sizes.size and 0.0 < sizes.max() < SMALL:
        return MICRONS, "µm"
    return 1.0, unit


def _noise(result: Result) -> float:
    return NOISE * float(result.attrs["length"])
