"""An assembly as one would follow it in the shop: what to do, what comes of it, and whether it fits."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.compile import LOOSE
from jointplay.result import Result, split, typical, unit_of
from jointplay.result.conclusions import FITS, VERDICTS

from .layout import NOTHING, Column, ResultTable, fixed, numbers, sentence, words

KINDS = {
    "fixed": "fix the link",
    "connected": "connect the links",
    "closing": "close the loop",
    "redundant": "redundant link",
    "loose": "hang it on",
    "redundant and loose": "redundant link, hang it on",
}
ENDS = ("shaft", "bearing")
#: lengths below this many millimetres are given in microns
SMALL = 0.1
MICRONS = 1000.0
#: share of the characteristic length, and force in its unit, that are rounding
NOISE = 1e-10
NO_FORCE = 1e-6
#: decimals to which half-widths are compared
ROUNDED = 9
#: members that carry something from which all are listed
SEVERAL = 2
#: share of the largest slope below which differences of specimens are rounding
NO_SLOPE = 1e-6


def overview(result: Result) -> list[ResultTable]:
    """The sequence, the links that are locked together, and where every joint is in the end."""
    if "kind" not in result.data:
        steps = [Column("step", "", tuple(str(step) for step in result.labels("step")), is_key=True)]
        return [ResultTable(_title(result), (*steps, words("add", result.get("members").tolist()), _verdict(result)))]
    tables = [SEQUENCES[str(result.attrs["assemble"])](result)]
    if "link" in result.coords:
        tables.append(_links(result))
    if result.attrs["assemble"] == "unit":
        tables += _carried(result)
        if _deviations(result) and np.isfinite(result.get("error")[-1]).all():
            tables.append(_adjustment(result))
        tables.append(centres(result, result.labels("step")[-1]))
    return tables


def centres(result: Result, step: int) -> ResultTable:
    """Where the centres of every joint are after a step."""
    joints = np.array(result.labels("joint"), dtype=str)
    there = np.isfinite(result.get("error_shaft", step=step)).any(axis=-1)
    lengths, _ = split(result.labels("component"))
    names = [f"{name}_{end}" for name in ("error", "undetermined") for end in ENDS]
    values = {name: np.stack([result.get(name, step=step, component=c)[there] for c in lengths]) for name in names}
    scale, unit = _scale(unit_of(result, "position"), *values.values())
    columns = [words("joint", joints[there].tolist(), is_key=True)]
    for end in ENDS:
        both = np.concatenate([values[f"error_{end}"], values[f"undetermined_{end}"]]) * scale
        cells = numbers("", unit, both.ravel(), _noise(result) * scale).cells
        rows, count = len(cells) // (2 * len(lengths)), len(lengths)
        is_open = bool((both[count:] > _noise(result) * scale).any())
        for k, name in enumerate(lengths):
            columns.append(Column(f"{end}\n{name}", unit, cells[k * rows : (k + 1) * rows]))
            if is_open:
                columns.append(Column("\n±", unit, cells[(count + k) * rows : (count + k + 1) * rows], spare=1))
    note = (
        "Shaft: centre on the first body of the joint; bearing: on the second. ±: indeterminacy that the loads leave."
    )
    return ResultTable(f"Position errors after step {step}", tuple(columns), (note,))


def _unit(result: Result) -> ResultTable:
    output = (_output(result, "error"), _output(result, "undetermined"))
    error, half, where = _farthest(result, _sizes(result, "error"), _sizes(result, "undetermined"), output)
    scale, unit = _scale(unit_of(result, "position"), error, half)
    noise = _noise(result) * scale
    columns = [*_what(result), _verdict(result), numbers("largest\nerror", unit, error * scale, noise)]
    if (half * scale > noise).any():
        columns.append(numbers("\n±", unit, half * scale, noise))
    columns += [words("of", where), *_forces(result, result.get("member_force")), *_factors(result, "clearance_factor")]
    return ResultTable(_title(result), tuple(columns), (*_notes(result),))


def _worst(result: Result) -> ResultTable:
    errors = np.stack([result.get(f"worst_{end}") for end in ENDS], axis=-1)
    output = result.get("worst_position")
    error, _, where = _farthest(result, errors, np.zeros_like(errors), (output, np.zeros_like(output)))
    scale, unit = _scale(result.data["worst_shaft"].units, error)
    columns = [
        *_what(result),
        _verdict(result),
        numbers("largest\nerror", unit, error * scale, _noise(result) * scale),
        words("of", where),
    ]
    columns += [*_forces(result, result.get("worst_force")), *_factors(result, "worst_clearance_factor")]
    note = "Largest over all clearances and tolerances."
    return ResultTable(_title(result), tuple(columns), (note, *_notes(result)))


def _random(result: Result) -> ResultTable:
    level = typical(result)
    errors = np.stack([result.get(f"quantile_{end}", probability=level) for end in ENDS], axis=-1)
    output = result.get("quantile_position", probability=level)
    error, _, where = _farthest(result, errors, np.zeros_like(errors), (output, np.zeros_like(output)))
    scale, unit = _scale(result.data["quantile_shaft"].units, error)
    columns = [*_what(result), numbers("error\nbelow", unit, error * scale, _noise(result) * scale), words("of", where)]
    columns += _forces(result, result.get("quantile_force", probability=level))
    columns += _factors(result, "quantile_clearance_factor", probability=level)
    shares = result.get("probability_of_fit")
    columns.append(Column("fits without\nstrain", "%", tuple(fixed(100.0 * float(share), 2) for share in shares)))
    units = f"{result.attrs['samples']} specimens, seed {result.attrs['seed']}"
    said = f"{units}; {100 * level:g} % of them are below these values."
    return ResultTable(_title(result), tuple(columns), (said, *_notes(result)))


SEQUENCES: dict[str, Callable[[Result], ResultTable]] = {"unit": _unit, "worst": _worst, "random": _random}


def _title(result: Result) -> str:
    return f"Assembly on '{result.attrs['base']}'"


def _what(result: Result) -> list[Column]:
    return [
        Column("step", "", tuple(str(step) for step in result.labels("step")), is_key=True),
        words("add", [str(cell) for cell in result.get("links").tolist()]),
        words("and", [KINDS.get(kind, kind) for kind in result.get("kind").tolist()]),
    ]


def _verdict(result: Result) -> Column:
    outcomes = result.get("status").tolist()
    alarms = tuple(k for k, outcome in enumerate(outcomes) if outcome not in FITS)
    return replace(words("verdict", [VERDICTS[outcome] for outcome in outcomes]), alarms=alarms)


def _sizes(result: Result, name: str) -> Floats:
    """Sizes of the positions of all centres; shape (step, joint, end)."""
    lengths, _ = split(result.labels("component"))
    parts = [[result.get(f"{name}_{end}", component=c) for c in lengths] for end in ENDS]
    return np.stack([np.linalg.norm(np.stack(part), axis=0) for part in parts], axis=-1)


def _output(result: Result, name: str) -> Floats:
    """Size of the position of the output in every step."""
    lengths, _ = split(result.labels("component"))
    return np.asarray(np.linalg.norm([result.get(name, component=c) for c in lengths], axis=0))


def _farthest(
    result: Result, errors: Floats, halves: Floats, output: tuple[Floats, Floats]
) -> tuple[Floats, Floats, list[str]]:
    """Per step the largest position error of a joint's centre or the output, its half-width, and what that is."""
    names = [f"{joint} {end}" for joint in result.labels("joint") for end in ENDS]
    largest, wide, where = [], [], []
    for k in range(len(errors)):
        # The output comes last, so that an equal joint is named.
        error = np.append(errors[k].ravel(), output[0][k])
        half = np.append(halves[k].ravel(), output[1][k])
        sizes = np.nan_to_num(error, nan=-1.0)
        # Of what is off as far (all of it, where nothing is known to be off) the one with the most play is to watch.
        at = int(np.where(sizes >= sizes.max() - _noise(result), np.nan_to_num(half).round(ROUNDED), -1.0).argmax())
        largest.append(float(error[at]))
        wide.append(float(half[at]))
        where.append([*names, "output"][at] if np.isfinite(error[at]) else NOTHING)
    return np.array(largest), np.array(wide), where


def _forces(result: Result, forces: Floats) -> list[Column]:
    """The largest force of a member, where there is any; shape of `forces` (step, member)."""
    sizes = np.abs(np.nan_to_num(forces))
    if not (sizes > NO_FORCE).any():
        return []
    rows, names = sizes.argmax(axis=1), result.labels("member")
    values = forces[np.arange(len(rows)), rows]
    unit = next(v.units for name, v in result.data.items() if name.endswith("_force"))
    where = [names[k] if abs(v) > NO_FORCE else NOTHING for k, v in zip(rows, values, strict=True)]
    return [numbers("largest\nforce", unit, values, NO_FORCE), words("in", where)]


def _carried(result: Result) -> list[ResultTable]:
    """What every member carries after every step, where several carry something."""
    forces = result.get("member_force")
    carry = np.flatnonzero((np.abs(np.nan_to_num(forces)) > NO_FORCE).any(axis=0))
    if len(carry) < SEVERAL:
        return []
    unit, steps = result.data["member_force"].units, result.labels("step")
    cells = numbers("", unit, forces[:, carry].ravel(), NO_FORCE).cells
    columns = [words("member", [result.labels("member")[k] for k in carry], is_key=True)]
    for k, step in enumerate(steps):
        columns.append(Column(f"step {step}", unit, cells[k * len(carry) : (k + 1) * len(carry)]))
    return [ResultTable("Forces along the members, tension positive", tuple(columns))]


def _factors(result: Result, name: str, **at: float) -> list[Column]:
    """By how much the clearances would have to be larger, where something is redundant."""
    redundant = result.get("redundancy") > 0
    if not redundant.any():
        return []
    pairs = zip(result.get(name, **at), redundant, strict=True)
    return [Column("clearances\ntimes", "", tuple(fixed(float(f), 3) if r else NOTHING for f, r in pairs))]


def _links(result: Result) -> ResultTable:
    unit = result.data["link_nominal"].units
    keys = ("nominal", "actual", "shortest", "longest")
    every = numbers("", unit, np.concatenate([result.get(f"link_{key}") for key in keys]), digits=7).cells
    count = len(every) // len(keys)
    columns = [Column(key, unit, every[k * count : (k + 1) * count]) for k, key in enumerate(keys)]
    note = (
        "Actual: with the known deviations, clearances in their middle; shortest and longest: over all that can be off."
    )
    return ResultTable(
        "Members locked into one link", (words("link", result.labels("link"), is_key=True), *columns), (note,)
    )


def _deviations(result: Result) -> list[int]:
    """The parameters that are no clearances: what one could adjust."""
    kinds = dict(zip(result.labels("source"), result.coords["source_kind"].values.tolist(), strict=True))
    return [k for k, owner in enumerate(result.coords["parameter_source"].values.tolist()) if kinds[owner] not in LOOSE]


def _adjustment(result: Result) -> ResultTable:
    """What to adjust: by how much every deviation moves the output in the end, the largest effect first."""
    last, rows = result.labels("step")[-1], _deviations(result)
    lengths, _ = split(result.labels("component"))
    slopes = np.stack([result.get("sensitivity", step=last, component=c)[rows] for c in lengths])
    order = np.argsort(-np.nan_to_num(np.linalg.norm(slopes, axis=0)), kind="stable").tolist()
    cells = numbers("", "", slopes[:, order].ravel(), NO_SLOPE * float(np.nanmax(np.abs(slopes), initial=0.0))).cells
    names, units = (result.coords[f"parameter_{key}"].values.tolist() for key in ("source", "unit"))
    columns = [
        words("deviation", [names[rows[k]] for k in order], is_key=True),
        words("per", [units[rows[k]] for k in order]),
        *(
            Column(f"moves\n{c}", unit_of(result, "position"), cells[i * len(rows) : (i + 1) * len(rows)])
            for i, c in enumerate(lengths)
        ),
    ]
    return ResultTable(f"What to adjust: the output after step {last}", tuple(columns))


def _notes(result: Result) -> list[str]:
    said = [sentence(str(result.attrs["incomplete"]))] if "incomplete" in result.attrs else []
    for step, held in zip(result.labels("step"), result.get("held").tolist(), strict=True):
        if held:
            said.append(f"Step {step} leaves something free: held at its nominal place: {held}.")
    statuses = result.get("status").tolist()
    if {"undetermined", "underconstrained"} & set(statuses) and result.attrs["assemble"] == "unit":
        said.append("±: largest indeterminacy; no force pushes these clearances to one side.")
    if (result.get("redundancy") > 0).any():
        said.append("Clearances times: clearance scale factor required for assembly without strain.")
    return said


def _scale(unit: str, *values: Floats) -> tuple[float, str]:
    """Microns where millimetres would all be small."""
    sizes = np.concatenate([np.abs(v[np.isfinite(v)]).ravel() for v in values])
    if unit == "mm" and sizes.size and 0.0 < sizes.max() < SMALL:
        return MICRONS, "µm"
    return 1.0, unit


def _noise(result: Result) -> float:
    return NOISE * float(result.attrs["length"])
