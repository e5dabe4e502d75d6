"""What one must know to read a table, in words: outcomes, what is open, what was left out."""

from collections.abc import Iterable

import numpy as np

from jointplay.core.compile import LENGTHS
from jointplay.result import Result, rounding
from jointplay.result.conclusions import leaving, off_path, owners, strung, which, without_path

from .indices import notes as of_indices
from .layout import sentence
from .singularities import remarks

OUTCOMES = {
    "not_assembled": "the links cannot reach the commanded pose",
    "singular": "near a singularity: bodies can move although the drives are held, and there is no error",
    "underconstrained": "something can move although the drives are held",
    "undetermined": "no force pushes some joint to one side; `jointplay error -q loaded` names it",
    "strained": "it can only be assembled with strained members",
    "not_assemblable": "the clearances cannot absorb the deviations",
    "other_branch": "behind a singularity: the machine cannot move there from its start",
    "outside_limits": "a drive or a joint would leave its range",
    "jammed": "friction holds it, however hard the drives pull",
}
#: outcomes of specimens that have a pose
COUNTED = ("ok", "undetermined", "strained")
#: parts of a motion below this share of its largest part do not take part in it
TAKES_PART = 0.01
#: as many joints are named one by one
FEW = 6


def notes(result: Result) -> tuple[str, ...]:
    """The notes of a result."""
    return tuple(_notes(result))


def _notes(result: Result) -> Iterable[str]:
    if "incomplete" in result.attrs:
        yield sentence(str(result.attrs["incomplete"]))
    if "held_spins" in result.attrs:
        yield f"Held, because it moves neither the output nor a load: the spin of {result.attrs['held_spins']}."
    if "misfit" in result.attrs and result.attrs["question"] != "solve":
        yield sentence(str(result.attrs["misfit"]))
    status = result.get("status")
    if is_compared := "mechanism" in result.sizes:
        # What its status would mean is not so: nothing was asked of the others there.
        status = np.where(without_path(result), "", status)
    for outcome, meaning in OUTCOMES.items():
        bad = status == outcome
        if not bad.any():
            continue
        where = (
            which(np.flatnonzero(bad).tolist()) if bad.ndim == 1 else f"{int(bad.sum())} of {bad.size} configurations"
        )
        meaning = leaving(result) if outcome == "outside_limits" else meaning
        if outcome == "not_assemblable" and "misfit" in result.attrs:
            meaning = "the clearances cannot absorb what stays open as drawn, with the deviations"
        words = _unpressed(result, bad) or f"{meaning}{_motion(result, outcome, bad)}"
        yield f"{where}: {outcome.replace('_', ' ')}: {words}."
    yield from str(result.attrs.get("failure", "")).splitlines()
    question = result.attrs.get("question")
    if question == "random" and status.ndim == 1:
        yield from _samples(result)
        yield from _interference(result)
        if "sobol_total" in result.data:
            yield from of_indices(result)
    if "offsets_of" in result.attrs:
        yield f"Every clearance and tolerance is where {result.attrs['offsets_of']} has it; --offset gives others."
    elif "admissible" in result.data and status.ndim == 1:
        yield from _outside(result)
    if question == "worst" and "unsettled" in result.data and result.get("unsettled").any():
        where = which(np.flatnonzero(result.get("unsettled")).tolist()) if status.ndim == 1 else "Some configurations"
        yield f"{where}: the search reached its limit of steps; the largest errors found are shown."
    if "some_without_play" in result.attrs:
        counts = "the largest play counts; " if question == "worst" else ""
        yield f"{result.attrs['some_without_play']}: {counts}some or all pairs have interference, and no play."
    if question == "worst" and "correlations_ignored" in result.attrs:
        yield (
            f"{result.attrs['correlations_ignored']}: correlated, but the worst case takes each of them at any of its"
            " limits; `random` knows the correlation."
        )
    if "bounded_at_three_sigma" in result.attrs:
        endless = result.attrs["bounded_at_three_sigma"]
        yield f"{endless}: without limits; the bounds hold up to three standard deviations."
    is_corrected = "correction" in result.data
    if is_corrected or "offsets_of" not in result.attrs:
        yield from sizes_taken(result, "" if is_corrected else "; --sizes takes the largest or the smallest play")
    if question == "loaded" and "undetermined" in result.data and status.ndim == 1:
        yield from _left_open(result)
        yield from _held_elsewhere(result)
    if is_corrected:
        yield from _correction(result)
    if question == "solve" and (status == "singular").any():
        yield "`jointplay singularities` says of which kind, and how far the path is from it."
    if question == "singularities":
        yield from remarks(result)
    if is_compared:
        yield from _mismatch(result)


def sizes_taken(result: Result, other: str = "") -> Iterable[str]:
    """Which sizes clearances have that scatter; `other` says how to take other ones."""
    if "sizes" in result.attrs:
        which = str(result.attrs["sizes"])
        middle = f"in the middle of their limits{other}"
        yield f"Sizes of clearances: {middle if which == 'middle' else f'those of the {which} play'}."


def _unpressed(result: Result, bad: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> str:
    """The joints that no force pushes to one side, where the load leaves the output open."""
    if not (result.get("status")[bad] == "undetermined").all() or "undetermined_contribution" not in result.data:
        return ""
    if bad.ndim > 1:
        return ""
    parts = result.get("undetermined_contribution")[bad].max(axis=0)
    least = [rounding(result, unit) for unit in result.coords["component_unit"].values.tolist()]
    names = [name for name, row in zip(result.labels("source"), parts, strict=True) if (row > least).any()]
    if not names:
        return ""
    listed = ", ".join(names) if len(names) <= FEW else f"{', '.join(names[: FEW - 1])} and {len(names) - FEW + 1} more"
    return f"no force pushes {listed} to one side, so that the load does not determine the offset there"


def _left_open(result: Result) -> Iterable[str]:
    """How far the load leaves the output open."""
    half = result.get("undetermined")
    parts = []
    for k, name in enumerate(result.labels("component")):
        unit = result.unit("undetermined", component=name)
        largest = float(np.nanmax(half[:, k], initial=0.0))
        if largest > rounding(result, unit):
            parts.append(f"{name} ±{largest:.4g} {unit}")
    if parts:
        at_most = " at most" if len(half) > 1 else ""
        yield f"The load leaves open{at_most}: {', '.join(parts)}; -o writes all of it (`undetermined`)."


def _held_elsewhere(result: Result) -> Iterable[str]:
    """Where the load can hold the mechanism at other places, too."""
    several = np.flatnonzero(result.get("equilibria") > 1)
    # What the load leaves open says so itself.
    several = several[result.get("status")[several] == "ok"]
    if several.size:
        most = int(result.get("equilibria")[several].max())
        at = f"{most} places" if most == 2 else f"up to {most} places"
        where = which(several.tolist())
        yield f"{where}: the load can hold the mechanism at {at}; it does the most work at the one given."


def _motion(result: Result, outcome: str, bad: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> str:
    """The bodies of the singular motion, where the result has it."""
    if outcome != "singular" or "singular_motion" not in result.data or bad.ndim > 1:
        return ""
    motion = np.abs(result.get("singular_motion")[bad])
    lengths = np.isin(result.labels("component"), LENGTHS)
    shift = motion[..., lengths].max(axis=-1) / float(result.attrs["length"])
    parts = np.maximum(shift, motion[..., ~lengths].max(axis=-1))
    moving = (parts > TAKES_PART * parts.max(axis=1, keepdims=True)).any(axis=0)
    names = dict.fromkeys(name for name, moves in zip(owners(result), moving.tolist(), strict=True) if moves)
    return f" (what moves: {', '.join(names)})" if names else ""


def _interference(result: Result) -> Iterable[str]:
    if "interference" not in result.data:
        return
    shares = np.nan_to_num(result.get("interference")).max(axis=0)
    for name, share in zip(result.labels("source"), shares.tolist(), strict=True):
        if share > 0.0:
            # Not 1e+02, and not 100 where some have play.
            percent = "all" if share == 1.0 else f"{min(100.0 * share, 99.9):.3g} %"
            yield f"{name}: {percent} of the pairs have interference, and no play."


def _samples(result: Result) -> Iterable[str]:
    samples = int(result.attrs["samples"])
    law = result.attrs.get("law")
    how = "" if law == "as in the file" else f", clearances {law}"
    if result.attrs.get("contact") == "loaded":
        how = ", clearances where the load pushes them"
    yield f"{samples} specimens per configuration, seed {result.attrs['seed']}{how}."
    has_none = result.attrs.get("contact") == "loaded" or {"yield_path", "incomplete"} & {*result.data, *result.attrs}
    if np.isfinite(result.get("limit")).any() and not has_none:
        yield "Yields over all configurations are of determinate mechanisms only, and left out here."
    # Where there is no error, nothing has been drawn.
    assembled = ~np.isin(result.get("status"), ("not_assembled", "singular", "other_branch", "outside_limits"))
    for outcome in result.labels("outcome"):
        counts = result.get("failures", outcome=outcome)[assembled]
        if outcome != "ok" and counts.any():
            share = 100 * counts.max() / samples
            most = f"{'up to ' * (len(assembled) > 1)}{share:.3g} %{' of a configuration' * (len(assembled) > 1)}"
            words = f"{int(counts.sum())} were {outcome.replace('_', ' ')}, {most}"
            counted = "included in the results" if outcome in COUNTED else "not included in the results"
            yield f"{words}; {counted}."
    if "clearance_factor_quantile" in result.data:
        yield from _factor(result)


def _factor(result: Result) -> Iterable[str]:
    """What the clearances would have to be."""
    levels = result.labels("probability")
    most = result.get("clearance_factor_quantile").max(axis=0)
    share = levels.index(max(levels))
    if np.isinf(most[share]):
        yield (
            "Some specimens cannot be assembled without strain, however large the clearances: "
            "their redundant constraints have none."
        )
    elif most[share] > 0:
        words = (
            f"{100 * levels[share]:g} % of the specimens can be assembled without strain"
            f" with the clearances multiplied by {most[share]:.3g}"
        )
        yield f"{words}."


def _outside(result: Result) -> Iterable[str]:
    inside = result.get("admissible")
    for k, source in enumerate(result.labels("source")):
        if not inside[:, k].all():
            yield f"{source}: the offset is larger than the file allows; the error is that of the given offset."


def _correction(result: Result) -> Iterable[str]:
    what = "position"
    if float(result.attrs["weight_rotation"]) > 0.0:
        weights = f"{result.attrs['weight_position']:g} : {result.attrs['weight_rotation']:g} per radian"
        what = f"position and rotation, weighted {weights}"
    if "one_table" in result.attrs:
        yield f"The drives are corrected for {what}, in all load cases at once; left: what this table leaves here."
    elif result.attrs["corrects"] == "worst":
        yield f"The drives make the largest error of all offsets least, by {what}; left: what no drive can remove."
    else:
        yield f"The drives are corrected for {what}; left: what no drive can remove."
    # Of two mechanisms each has drives that the other one has not.
    held = result.get("at_limit").astype(bool) & np.isfinite(result.get("correction"))
    limited = [drive for k, drive in enumerate(result.labels("drive")) if held[..., k].any()]
    if limited:
        yield f"Held by the range in the file: {', '.join(limited)}."
    unsettled = ~result.get("settled") & np.isfinite(result.get("residual_position"))
    if unsettled.any():
        places = which(np.flatnonzero(unsettled).tolist())
        why = (
            "the search ended before its end"
            if result.attrs["corrects"] == "worst"
            else ("contact alternates between two sides as the drives change")
        )
        yield f"{places}: {why}; the best values found are shown."


def _mismatch(result: Result) -> Iterable[str]:
    first, *others = result.labels("mechanism")
    lost = np.flatnonzero(without_path(result)[1]).tolist()
    if lost:
        verb = "is" if len(others) == 1 else "are"
        yield f"{which(lost)}: {strung(others)} {verb} unknown, because {first} has no pose there."
    for other in others:
        if off := off_path(result, other):
            yield f"{other} {off}."
