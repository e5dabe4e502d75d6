"""How large every source may be: whether the limits hold, what to tighten, what to order."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from jointplay.basics.arrays import Floats, Texts
from jointplay.result import Result
from jointplay.result.conclusions import EACH_OUTPUT, MOST_NAMES, first_missed, share_of

from .fit import MOST_ROWS
from .layout import DIGITS, NOTHING, Column, ResultTable, decimals, fixed, numbers, some, words

TITLES = {
    "worst": "Largest sizes with which the limits hold in the worst case",
    "loaded": "Largest sizes with which the limits hold under the loads",
    "forces": "Largest sizes with which the limits of forces hold in the worst case",
    "random": "Largest sizes with which the limits hold for {} of the specimens",
}
MEANINGS = {
    "no_effect": "its size changes nothing of what is limited",
    "unlimited": "the limits hold up to the largest size that was tried",
    "not_enough": "the limits are missed with a size of zero as well",
    "needs_play": "the limits hold with the size as it is, and are missed with a size of zero",
    "fixed": "its size cannot be changed here",
}
#: relative rounding of a number
NOISE = 1e-9
#: how numbers are rounded so that they hold
ROUNDED = {"allowed": math.floor, "slack": math.floor, "needed": math.ceil}
#: why no fit is named
WITHOUT_FIT = {
    "no_diameter": "it needs the diameter, such as clearance = { radial = 0.02, diameter = 12 }",
    "not_in_standard": "the standard has none of the preferred fits for its nominal size",
    "no_fit_holds": "the limits do not hold with the tightest of the preferred clearance fits",
    "no_group_holds": "the limits do not hold with the tightest group of bearings",
}


def overview(result: Result) -> list[ResultTable]:
    """The table of `allow`."""
    asked = str(result.attrs["asked"])
    title = TITLES[asked].format(share_of(float(result.attrs.get("probability", 1.0))))
    # Where there are many, those that bring most are shown.
    first = np.argsort(np.nan_to_num(result.get("used_without"), nan=np.inf), kind="stable")[:MOST_ROWS]
    return [ResultTable(title, tuple(_columns(result)), tuple(_notes(result)), rows=tuple(sorted(first.tolist())))]


def _columns(result: Result) -> Iterator[Column]:
    units = np.array(result.labels("source_unit"), dtype=str)
    yield words("source", result.labels("source"), is_key=True)
    yield Column("measure", "", tuple(result.labels("source_measure")), left=True, spare=3)
    yield words("unit", units.tolist())
    told = ["size", "allowed", "slack"]
    if _has_needed(result):
        told.append("needed")
    status = result.get("status").tolist()
    found = np.isin(status, ["ok", "not_enough", "needs_play"])
    # Where no size was found to be too large, what was tried does not decide the decimals.
    held = {name: np.where(found | (name in ("size", "needed")), result.get(name), np.nan) for name in told}
    cells = dict(zip(told, _by_unit(units, held), strict=True))
    allowed = result.get("allowed")
    at_least = [
        f">{allowed[k]:.3g}" if one == "unlimited" else cell
        for k, (one, cell) in enumerate(zip(status, cells["allowed"], strict=True))
    ]
    for name, column in (cells | {"allowed": tuple(at_least)}).items():
        yield Column(name, "", column)
    if "allowed_standard_error" in result.data:
        (column,) = _by_unit(units, {"error": result.get("allowed_standard_error")}, digits=2)
        yield Column("±", "", column, spare=2)
    shares = 100.0 * result.get("used_without")
    yield Column("without it\nused", "%", numbers("", "", shares, digits=3).cells, spare=1)
    if any(result.get("fit").tolist()):
        yield words("fit", [fit or NOTHING for fit in result.get("fit").tolist()])
    yield words("first missed", [_where(result, k) for k in range(result.sizes["source"])])
    if any(one != "ok" for one in status):
        alarms = tuple(k for k, one in enumerate(status) if one == "not_enough")
        yield replace(words("status", [one.replace("_", " ") for one in status]), alarms=alarms)


def _has_needed(result: Result) -> bool:
    """Whether any clearance has to be there; zeros would say of teeth that they fit without play."""
    return "needed" in result.data and bool((result.get("needed") > 0.0).any())


def _by_unit(units: Texts, columns: Mapping[str, Floats], digits: int = DIGITS) -> list[tuple[str, ...]]:
    """Cells of columns with as many decimals as the numbers of one unit need.

    What is allowed is rounded down and what is needed up, so that the numbers in the table still hold.
    """
    cells = np.full((len(columns), len(units)), NOTHING, dtype=object)
    for unit in dict.fromkeys(units.tolist()):
        own = units == unit
        values = {name: column[own] for name, column in columns.items()}
        every = np.concatenate(list(values.values()))
        places = decimals(every, digits)
        for row, (name, column) in zip(cells, values.items(), strict=True):
            row[own] = [fixed(_safe(name, float(value), places), places) for value in column]
    return [tuple(row) for row in cells.tolist()]


def _safe(name: str, value: float, places: int) -> float:
    if name not in ROUNDED or not np.isfinite(value):
        return value
    steps = value * 10.0**places
    # A number that is short in file units is that number.
    return (
        float(round(steps) if abs(steps - round(steps)) < NOISE * abs(steps) else ROUNDED[name](steps)) / 10.0**places
    )


def _where(result: Result, k: int) -> str:
    """``position #10``: what misses its limit first, and at which configuration."""
    if result.get("status")[k] != "ok":
        return NOTHING
    return first_missed(result, "binding", k)


def _notes(result: Result) -> Iterator[str]:
    if "incomplete" in result.attrs:
        yield f"{str(result.attrs['incomplete']).capitalize()}."
    status = result.get("status")
    names = np.array(result.labels("source"), dtype=str)
    for outcome, meaning in MEANINGS.items():
        if (status == outcome).any():
            yield f"{outcome.replace('_', ' ')}: {meaning} ({some(names[status == outcome].tolist())})."
    yield from _too_small(result)
    if _has_needed(result):
        yield "needed: the smallest size with which all specimens can be assembled without strain."
    elif (
        "needed" in result.data
        and not np.isfinite(result.get("needed")).any()
        and any(key.endswith("clearance") for key in result.labels("source_key"))
    ):
        yield "Whatever size one clearance has, some specimens cannot be assembled without strain."
    if "without_pose" in result.attrs:
        yield f"Configuration {result.attrs['without_pose']}: no error as drawn; not counted."
    if "samples" in result.attrs:
        if "used_output" in result.data:
            yield EACH_OUTPUT
        count = int(result.attrs["samples"])
        yield f"Sizes are found from {count:,} random specimens per configuration; ± is their standard error."
    if not np.isin(status, ["not_enough", "needs_play"]).all():
        for why, words in WITHOUT_FIT.items():
            if unnamed := names[result.get("without_fit") == why].tolist():
                yield f"No fit is named for {some(unnamed)}: {words}."
    if "samples" in result.attrs:
        return
    yield f"Sizes are exact to a relative tolerance of {float(result.attrs['tolerance']):g}."


def _too_small(result: Result) -> Iterator[str]:
    """Sizes below the one that is there with which limits are missed, or that cannot be assembled."""
    sizes, found = result.get("too_small"), result.get("smallest")
    below = np.flatnonzero(np.isfinite(sizes)).tolist()
    for k in below[:MOST_NAMES]:
        name, unit, lost = (
            result.labels("source")[k],
            result.labels("source_unit")[k],
            result.get("too_small_not_assembled")[k],
        )
        if lost > 0.0 and "samples" in result.attrs:
            what = f"{share_of(float(lost), 2)} of the specimens cannot be assembled"
        else:
            what = "the mechanism cannot be assembled" if lost > 0.0 else "the limits are missed"
        yield f"{name}: {what} at {sizes[k]:.3g} {unit}; the limits hold from {_up(float(found[k]))} {unit} on."
    if len(below) > MOST_NAMES:
        yield f"So it is with {some([result.labels('source')[k] for k in below[MOST_NAMES:]])}."


def _up(value: float) -> str:
    """Three digits of a number, rounded up."""
    places = 2 - math.floor(math.log10(value))
    return f"{math.ceil(value * 10.0**places * (1.0 - NOISE)) / 10.0**places:.3g}"
