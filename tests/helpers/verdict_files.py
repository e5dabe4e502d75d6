"""Mechanism files whose limits hold, are missed narrowly, or are unknown somewhere, and what is to be said of them.

Every file is a bundled example or one written here, with a few configurations, and with limits that are set beside what
the numbers of its results reach. What is expected is found here from those numbers, value by value, and from closed
forms; the code of the verdicts has no part in it.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import jointplay as jp

#: specimens, so few that as many are drawn under the load
SAMPLES = 2048
#: bundled examples in the plane and in space, determinate, over-constrained and elastic, with and without loads
EXAMPLES = (
    *("four-bar", "four-bar-fits", "p3r", "slider-crank", "slider-crank-cases", "five-bar", "six-bar", "serial-2r"),
    *("press", "belt-arm", "rack-slider", "redundant-bar", "rssr"),
)
#: an arm on one pin, pressed down by a load: everything about it is known in closed form
ARM = """
format = 1
title = "Arm on a pin"
units = { length = "mm", angle = "deg", force = "N" }
[joints]
pin = { type = "revolute", on = { ground = [0, 0], arm = [0, 0] }, clearance = { radial = 0.05 } }
[drives]
swing = { joint = "pin", values = [-20, 0, 20], error = 0.02 }
[output]
body = "arm"
at = [200, 0]
[[loads]]
force = [0, -20]
"""
#: a slide that a load holds against one side of its guide, whose play scatters
SLIDE = """
format = 1
title = "Slide in a guide"
units = { length = "mm", angle = "deg", force = "N" }
[joints.guide]
type = "prismatic"
on = { ground = { at = [0, 0], axis = [1, 0] }, slide = [0, 0] }
clearance = { slot = { width = 20, tolerance = 0.01 }, slider = { width = 19.9, tolerance = 0.01 }, length = 60 }
[drives]
feed = { joint = "guide", values = [0, 10, 20], error = 0.01 }
[output]
body = "slide"
at = [0, 0]
[[loads]]
force = [0, -5]
"""
OWN = {"arm": ARM, "slide": SLIDE}
BASES = (*EXAMPLES, *OWN)
#: what becomes of the limits: they hold, are missed by a little, are held where known, are missed where known
KINDS = ("holds", "narrow", "unknown", "both")
HELD, MISSED, NOT_SHOWN = "held", "missed", "not shown"
READABLE = ("ok", "undetermined", "strained")
#: by how much a limit is above or below what is reached
NEAR = 0.01


@dataclass(frozen=True)
class File:
    """A file, and what it is about."""

    name: str
    kind: str
    m: jp.Mechanism

    @property
    def required(self) -> float | None:
        return self.m.raw["limits"].get("probability")


def base(name: str) -> jp.Mechanism:
    """A mechanism with three configurations at most, without limits."""
    m = jp.loads(OWN[name] if name in OWN else jp.examples.text(name), f"{name}.toml")
    changes: dict[str, Any] = {"limits": None, **{f"outputs.{output}.limits": None for output in m.outputs}}
    solved = jp.solve(_alone(m))
    count = solved.sizes["configuration"]
    chosen = np.unique(np.linspace(0, count - 1, min(count, 3)).round().astype(int))
    for drive, table in m.raw.get("drives", {}).items():
        values = solved[drive].values[chosen].tolist()
        if "loads" in m.raw and any(
            isinstance(v, list) and v and isinstance(v[0], list) for v in m.raw["loads"][0].values()
        ):
            continue
        left = {key: value for key, value in table.items() if key not in ("from", "to", "count", "values")}
        changes[f"drives.{drive}"] = {**left, "values": values}
    if "path" in m.raw:
        changes["path"] = None
    if "grid" in m.raw:
        changes["grid"] = None
    return m.with_(changes)


def _alone(m: jp.Mechanism) -> jp.Mechanism:
    """With its first output, in its first load case."""
    return m.only(*(next(iter(names), None) for names in (m.outputs, m.load_cases)))


def of_base(name: str, number: int) -> Iterator[File]:
    """The four files of a mechanism: which limits they have is decided by its numbers."""
    m = base(name)
    near = jp.solve(_alone(m)).singular_value.values
    values = np.unique(near[np.isfinite(near)])
    # Poses nearer to a singular one than this are singular.
    singular = float(values[: (len(values) + 1) // 2].max() * (1.0 + 1e-9)) if len(values) else 0.0
    every = _reached(m, loaded=bool(m.has_loads and number % 2))
    for k, kind in enumerate(KINDS):
        counts = every[near > singular] if kind == "both" and (near > singular).any() else every
        factor = 1.0 - NEAR if kind in ("narrow", "both") else 1.0 + NEAR
        changes: dict[str, Any] = {"limits.position": float(counts.max()) * factor}
        if kind in ("unknown", "both"):
            changes["limits.singular_value"] = singular
        if (number + k) % 3:
            changes["limits.probability"] = (0.5, 0.9, 0.99)[(number + k) % 3]
        if m.has_loads and (number + k) % 4 == 3:
            changes["limits.contact"] = ("scattered", "loaded")[number % 2]
        yield File(name, kind, m.with_(changes))


def _reached(m: jp.Mechanism, *, loaded: bool) -> np.ndarray:
    """The largest position error at every configuration: under the load with any play, or in the worst case."""
    if not loaded:
        found = jp.worst(m).worst_position
        return np.asarray(found.max([dim for dim in found.dims if dim != "configuration"]))
    sizes = []
    for which in ("largest", "smallest", "middle"):
        result = jp.loaded(m, sizes=which)
        size = _size(result.error, result.undetermined)
        sizes.append(np.asarray(size.max([dim for dim in size.dims if dim != "configuration"])))
    return np.max(sizes, axis=0)


# --- what is expected -----------------------------------------------------------------------------------------------


def outcome(file: File, question: str) -> str:
    """What becomes of the limits in a question: from its numbers, one by one."""
    if question == "random":
        return _of_shares(file)
    m = file.m
    limit = float(m.raw["limits"]["position"])
    if question == "worst":
        found = jp.worst(m)
        return _of_sizes([(found.status, found.worst_position)], limit)
    if question == "compensate":
        found = jp.compensate(m)
        return _of_sizes([(found.status, _size(found.residual, found.get("residual_undetermined")))], limit)
    each = [jp.loaded(m, sizes=sizes) for sizes in ("middle", "largest", "smallest")]
    return _of_sizes([(found.status, _size(found.error, found.undetermined)) for found in each], limit)


def _size(error: xr.DataArray, half: xr.DataArray | None) -> xr.DataArray:
    """How large a position error is at most, what is left open included."""
    far = abs(error) + (0.0 if half is None else half)
    lengths = [name for name in error.component.values if name in ("x", "y", "z")]
    return np.sqrt((far.sel(component=lengths) ** 2).sum("component", skipna=False))


def _of_sizes(found: list[tuple[xr.DataArray, xr.DataArray]], limit: float) -> str:
    missed = unknown = False
    for status, size in found:
        for outcome_, value in zip(
            status.values.reshape(-1), size.transpose(*status.dims).values.reshape(-1), strict=True
        ):
            if outcome_ not in READABLE or math.isnan(value):
                unknown = True
            elif value > limit * (1.0 + 1e-9) + 1e-9:
                missed = True
    return MISSED if missed else NOT_SHOWN if unknown else HELD


def shares(file: File) -> list[xr.Dataset]:
    """The scatter by every assumption that counts."""
    m, own = file.m, file.m.raw["limits"].get("contact")
    contacts = [own] if own else ["scattered", "loaded"] if m.has_loads else ["scattered"]
    return [jp.random(m, SAMPLES, contact=contact) for contact in contacts]


def _of_shares(file: File) -> str:
    if file.required is None:
        return ""
    missed = unknown = False
    for found in shares(file):
        low, high = found.outside_low.values, found.outside_high.values
        status = np.broadcast_to(found.status.values, low.shape)
        for k in np.ndindex(low.shape):
            if status[k] not in READABLE or math.isnan(low[k]):
                unknown = True
            elif 1.0 - low[k] < file.required:
                missed = True
            elif 1.0 - high[k] < file.required:
                unknown = True
    return MISSED if missed else NOT_SHOWN if unknown else HELD


def whole(outcomes: list[str]) -> str:
    """Over several questions."""
    return next((one for one in (MISSED, NOT_SHOWN, HELD) if one in outcomes), "")


#: the first words of a sentence by what it says
FIRST = {
    HELD: "(?:limits hold|the limits hold)",
    MISSED: "(?:limits? missed|(?:the )?limits are missed)",
    NOT_SHOWN: "not shown",
}


def says(text: str) -> str:
    """What a first sentence says, read by its words."""
    # Of several outputs and load cases the worst is named in front.
    words = re.sub(r"^output [^:]*: ", "", text.strip().lower())
    words = re.sub(r"^load case [^:]*: ", "", words)
    if found := re.match(r"(?:the )?required yield(?: of)? [0-9.]+ %:? (?:is )?(met|missed|not shown)", words):
        return {"met": HELD}.get(found.group(1), found.group(1))
    return next((outcome_ for outcome_, first in FIRST.items() if re.match(first, words)), "")


def is_good(statuses: list[xr.DataArray]) -> bool:
    """Whether every configuration is ok."""
    return all(bool((status == "ok").all()) for status in statuses)


def write(file: File, folder: Path) -> Path:
    """The file on disk."""
    path = folder / f"{file.name}-{file.kind}.toml"
    file.m.write(path)
    return path


# --- what the commands say ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Asked:
    """A command, and what it has to say and to return; `says` is None where it does not judge."""

    command: str
    arguments: tuple[str, ...]
    says: str | None
    code: int


def asked(file: File, path: Path, *, report: bool) -> Iterator[Asked]:
    """Every command on a file; the report, which takes longest, where it is wanted."""
    m, name = file.m, str(path)
    questions = ["worst", "random", *(["loaded"] if m.has_loads else [])]
    few = ("--samples", str(SAMPLES))
    found = {question: outcome(file, question) for question in questions}
    ok = {"worst": jp.worst(m).status, "random": jp.random(m, 16, contact=_own(file)).status}
    ok |= {"loaded": jp.loaded(m).status} if m.has_loads else {}
    good = {question: is_good([ok[question]]) for question in questions}

    def code(outcomes: list[str], oks: list[bool]) -> int:
        return 0 if all(oks) and set(outcomes) <= {"", HELD} else 1

    for question in questions:
        options = few if question == "random" else ()
        first = found[question] if found[question] else None
        arguments = ("error", name, "-q", question, *options)
        yield Asked(f"error -q {question}", arguments, first, code([found[question]], [good[question]]))
    every = [found[question] for question in questions]
    yield Asked("error", ("error", name, *few), whole(every), code(every, list(good.values())))
    if report:
        page = ("report", name, *few, "-o", f"{name}.html")
        yield Asked("report", page, whole(every), code(every, list(good.values())))
    if m.has_loads and m.drives:
        judged = outcome(file, "compensate")
        good_ = is_good([jp.compensate(m).status])
        yield Asked("compensate", ("compensate", name), judged, code([judged], [good_]))
    worst, are_ok = found["worst"], good["worst"]
    limit = float(m.raw["limits"]["position"])
    # Twice the limit holds wherever something is known.
    is_known = bool(np.isin(ok["worst"], READABLE).all())
    values = [worst, HELD if is_known else NOT_SHOWN]
    sweep = ("sweep", name, "-s", f"limits.position={limit!r},{2 * limit!r}", "-q", "worst")
    yield Asked("sweep", sweep, whole(values), 0 if are_ok else 1)
    yield Asked("compare", ("compare", name, name, "-q", "worst"), worst, 0 if are_ok else 1)
    # Without any pose to start from there is nothing that could be larger.
    if (ok["worst"] == "ok").any():
        arguments = ("allow", name, "-q", "worst", "--tolerance", "0.1")
        yield Asked("allow", arguments, worst, code([worst], [are_ok]))
    yield from _maps(file, name, ok["worst"], worst)
    yield Asked("check", ("check", name), None, 0)
    yield Asked("solve", ("solve", name), None, 0 if is_good([jp.solve(m).status]) else 1)


def _own(file: File) -> str:
    """Where clearances are where both assumptions count."""
    return str(file.m.raw["limits"].get("contact", "scattered"))


def _maps(file: File, name: str, status: xr.DataArray, worst: str) -> Iterator[Asked]:
    """Over the configurations of the only drive, each of them a node."""
    if len(file.m.drives) != 1:
        return
    (drive,) = file.m.drives
    values = sorted(file.m.raw["drives"][drive]["values"])
    if len(values) < 2 or np.ptp(np.diff(values)) > 1e-6:
        return
    grid = f"{drive}={values[0]!r}:{values[-1]!r}:{len(values)}"
    code = 0 if is_good([status]) else 1
    yield Asked("map -q worst", ("map", name, "-g", grid, "-q", "worst"), worst, code)
    if file.required is not None:
        arguments = ("map", name, "-g", grid, "-q", "random", "--samples", str(SAMPLES))
        yield Asked("map -q random", arguments, _of_shares(file), code)


def first_sentence(printed: str) -> str:
    """The first sentence that a command prints on lines of any length."""
    lines = [line for line in printed.splitlines()[1:] if line.strip()]
    return re.sub(r"^all +", "", lines[0].strip()) if lines else ""


def first_of_page(page: str) -> str:
    """The verdict that a report begins with, without its mark."""
    found = re.search(r'<p class="answer">(?:<strong[^>]*>[^<]*</strong>)? ?([^<]*)</p>', page)
    return found.group(1) if found else ""
