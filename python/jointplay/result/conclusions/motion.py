"""The answers about a motion: `solve`, `singularities` and `compensate`."""

from collections.abc import Iterator

import numpy as np

from jointplay.basics.arrays import Array
from jointplay.core.compile import LENGTHS
from jointplay.result import Result, rounding, unit_of
from jointplay.result.verdict import RANK, there, verdict

from .errors import judged_in
from .running import of_running
from .words import Conclusion, Sentence, farthest, of_statuses, owners, plural, say

#: what is said of each kind of singularity
KINDS = {
    "constraint": "The joints hold least",
    "actuation": "The drives hold least",
    "output": "The output follows least",
}
#: parts of a motion below this share of its largest part are not named
NAMED = 0.05
#: singular values below it are no more than zero
NO_VALUE = 1e-12
#: as many bodies are named one by one
FEW = 4


def of_solve(result: Result) -> Conclusion:
    """Whether every configuration has a pose, and which one is nearest to a singular one."""
    sentences = [*of_statuses(result)]
    values, count = result.get("singular_value"), result.sizes["configuration"]
    if "misfit" in result.attrs:
        misfit = str(result.attrs["misfit"])
        sentences.append(Sentence(f"{misfit[0].upper()}{misfit[1:]}.", is_alarm=True))
    if not sentences:
        sentences.append(Sentence("It has a pose." if count == 1 else f"All {count} configurations have a pose."))
    nearest = farthest(-values, result.get("status"))
    if nearest is not None and count > 1:
        text = f"Nearest to a singular one: smallest singular value {values[nearest]:.3g}{there(result, nearest)}."
        sentences.append(Sentence(text))
    elif nearest is not None:
        sentences.append(Sentence(f"Its smallest singular value is {values[nearest]:.3g}; 0 is a singular pose."))
    sentences += _off_path(result)
    return Conclusion(tuple(sentences), (float(sentences[0].is_alarm), -float(np.nanmin(values, initial=np.inf))))


def _off_path(result: Result) -> Iterator[Sentence]:
    if "mismatch" not in result.data:
        return
    off = np.nan_to_num(result.get("mismatch"))
    lengths = [name in LENGTHS for name in result.labels("component")]
    farthest_off = float(np.abs(off[:, lengths]).max(initial=0.0))
    unit = unit_of(result, "position")
    if farthest_off > 1e4 * rounding(result, unit):
        yield Sentence(f"The output leaves its path by up to {say(farthest_off, unit)}.", is_alarm=True)


def of_singularities(result: Result) -> Conclusion:
    """Whether a configuration is singular, which one is nearest to it, what moves there, and how far away it is."""
    sentences = [*of_statuses(result)]
    every = {name: result.get(f"{name}_singular_value") for name in KINDS}
    known = {name: values for name, values in every.items() if np.isfinite(values).any()}
    if known:
        kind = min(known, key=lambda name: float(np.nanmin(known[name])))
        k = int(np.nanargmin(known[kind]))
        value = known[kind][k] if known[kind][k] > NO_VALUE else 0.0
        head = "Nearest to a singularity" if result.sizes["configuration"] > 1 else "Nearness to a singularity"
        moves = motion(result, kind, k)
        sentences.append(Sentence(f"{head}: {kind} value {value:.3g}{there(result, k)}. There {moves}."))
    sentences += _distance(result)
    least = min((float(np.nanmin(values)) for values in known.values()), default=np.inf)
    return Conclusion(tuple(sentences), (-least,))


def _distance(result: Result) -> Iterator[Sentence]:
    if "singularity_distance" not in result.data or len(distance := result.get("singularity_distance")) < 2:
        return
    if np.isfinite(distance).any():
        k = int(np.nanargmin(distance))
        away, kind = say(distance[k], result.unit("singularity_distance")), result.get("singularity_kind")[k]
        nearest = "on the path there is one" if distance[k] <= 0.0 else f"the nearest one on the path is {away} away"
        yield Sentence(f"{nearest[0].upper()}{nearest[1:]}, of kind {kind}, seen from configuration {k}.")
    elif np.isinf(distance[~np.isnan(distance)]).all():
        yield Sentence("The path between the configurations meets no singularity of joints and drives.")


def motion(result: Result, name: str, configuration: int) -> str:
    """Which bodies move where a singular value of a kind is small, and what the output does, in words."""
    bodies = _parts(result, result.get(f"{name}_motion")[configuration])
    largest = float(bodies.max())
    those = [k for k, part in enumerate(bodies.max(axis=1).tolist()) if part > NAMED * largest]
    moving = list(dict.fromkeys(owners(result)[k] for k in those))
    named = moving if len(moving) <= FEW else [*moving[: FEW - 1], f"{len(moving) - FEW + 1} more"]
    turns, shifts = _parts(result, result.get(f"{name}_twist")[configuration][None])[0][::-1]
    does = {(False, False): "does not move", (True, False): "turns", (False, True): "moves"}
    output = does.get((turns > NAMED * largest, shifts > NAMED * largest), "moves and turns")
    if len(moving) == 1:
        shift, turn = bodies[those[0]]
        return f"{moving[0]} {'turns' if turn > NAMED * shift else 'slides'}, the output {output}"
    return f"{', '.join(named[:-1])} and {named[-1]} move together, the output {output}"


def _parts(result: Result, twists: Array) -> Array:
    """Largest shift, in characteristic lengths, and largest turn, in radians, of each twist."""
    lengths = np.isin(result.labels("component"), LENGTHS)
    units = result.coords["component_unit"].values.tolist()
    degrees = np.array([np.pi / 180 if unit == "deg" else 1.0 for unit in units])
    sizes = np.abs(twists) * degrees
    shift = sizes[..., lengths].max(axis=-1) / float(result.attrs["length"])
    return np.stack([shift, sizes[..., ~lengths].max(axis=-1)], axis=-1)


def _why_left(result: Result, which: str, configuration: int) -> str:
    """Why a corrected size is not zero at a configuration; nothing of one that is not corrected."""
    if "one_table" in result.attrs:
        return "; one table for all load cases leaves the rest"
    weighs_both = float(result.attrs["weight_position"]) > 0.0 and float(result.attrs["weight_rotation"]) > 0.0
    if not weighs_both and float(result.attrs[f"weight_{which}"]) == 0.0:
        return ""
    held = result.get("at_limit").astype(bool) & np.isfinite(result.get("correction"))
    drive = "no drive within its range" if held[configuration].any() else "no drive"
    rest = f"; {drive} can remove the rest{' of both' if weighs_both else ''}"
    idle = _inside_play(result, configuration)
    return f"{rest}: inside its play {idle} does not act" if idle else rest


def _inside_play(result: Result, configuration: int) -> str:
    """The drives that do not act at a configuration."""
    inside = result.get("inside_play")[configuration] if "inside_play" in result.data else ()
    return " and ".join(d for d, idle in zip(result.labels("drive"), inside, strict=False) if idle)


def of_compensate(result: Result) -> Conclusion:
    """Whether what is left keeps to the limits, what the corrected drives remove, and what no drive can."""
    status, found = result.get("status"), verdict(result)
    sentences, left = [], []
    for which, words in (("position", "position error"), ("rotation", "rotation")):
        before, after = result.get(f"error_{which}"), result.get(f"residual_{which}")
        unit = unit_of(result, which)
        first, last = farthest(before, status), farthest(after, status)
        if first is None or last is None or before[first] <= rounding(result, unit):
            continue
        shown = after[last] if after[last] > rounding(result, unit) else 0.0
        left.append(float(shown))
        text = f"Largest {words}: {say(before[first], unit)} before and {say(shown, unit)} after the correction"
        rest = there(result, last) + _why_left(result, which, last) if shown else ""
        sentences.append(Sentence(f"{text}{rest}."))
    change = largest_change(result)
    sentences += [Sentence(f"Largest change{change}.")] if change else []
    if "one_table" in result.attrs:
        sentences.append(Sentence("The drive values are the same in all load cases; the largest error is made least."))
    sentences += _between_rows(result)
    severity = (float(RANK[found.outcome]), found.used, *left)
    return Conclusion((*judged_in(found), *of_statuses(result), *sentences, *of_running(result)), severity)


def _between_rows(result: Result) -> list[Sentence]:
    """Where straight lines between the rows of the table leave clearly more than is left at the rows."""
    if "between_position" not in result.data:
        return []
    status, between, unit = result.get("status"), result.get("between_position"), unit_of(result, "position")
    k, most = farthest(between, status), farthest(left := result.get("residual_position"), status)
    if k is None or most is None or between[k] <= max(1.01 * left[most], rounding(result, unit)):
        return []
    text = f"Between the rows of the table, on straight lines, up to {say(between[k], unit)} of position error are left"
    return [Sentence(f"{text}, after the row{there(result, k)}.")]


def largest_change(result: Result) -> str:
    """`` of 2 drives: theta by 0.6 deg at configuration 3``; nothing where none is known."""
    changes = [_change(result, drive) for drive in result.labels("drive")]
    known = [change for change in changes if change is not None]
    if not any(change[1] for change in known):
        return ""
    drive, value, unit, k = max(known, key=lambda change: abs(change[1]))
    more = f" of {plural(len(known), 'drive')}" if len(known) > 1 else ""
    return f"{more}: {drive} by {say(value, unit)}{there(result, k)}"


def _change(result: Result, drive: str) -> tuple[str, float, str, int] | None:
    values = result.get("correction", drive=drive)
    k = farthest(np.abs(values), result.get("status"))
    return None if k is None else (drive, float(values[k]), result.unit("correction", drive=drive), k)
