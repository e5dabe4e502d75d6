"""`worst`: the largest error that the clearances and tolerances allow, and the offsets that attain it.

first order   max |A u| over u in C, by support functions
exact         max g(output(closure(u)) - output(nominal)) over u in C, by ascent from many starts; then from the
              best point, with one source at a time moved within its set, until nothing increases

In an over-constrained mechanism only compatible offsets count. In an elastic one specimens that have to be strained
count as well, each at its pose of least energy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from jointplay.basics.typed import Need, goes_with, typed
from jointplay.core.answers import Worst
from jointplay.errors import InputError, in_range
from jointplay.model.gaps import tight
from jointplay.model.mechanism import Mechanism
from jointplay.questions import PARTS
from jointplay.result import Result, to_dataset
from jointplay.result.verdict import judge

from .certificate import MOST_PARTS, add_bounds, certified
from .nominal import ON_CLOSURE, TO_FIRST_ORDER, Nominal, Progress, batched, finished, nominal, report, without_singular
from .recorded import recorded
from .several import of_each

if TYPE_CHECKING:
    import xarray as xr

#: configurations per call of the core: enough for its threads, few enough to answer Ctrl-C
BATCH = 16
#: starts of the search where nobody says it; and far more than ever find anything new
STARTS = 24
MOST_STARTS = 10_000


@typed
@goes_with(Need("certify", True), "parts")
@goes_with(Need("exact", True), "starts")
def worst(
    m: Mechanism, *, starts: int = STARTS, exact: bool = True, certify: bool = False, parts: int = PARTS
) -> xr.Dataset:
    """Find the largest pose errors that clearances and tolerances allow.

    Parameters
    ----------
    m : Mechanism
    starts : int
        Where ascents start: for position and rotation from the first-order support points along this many directions
        and from half as many random corners of all sets, for an end of a component from its first-order optimum and
        from a quarter as many random corners. From the best points the search goes on by itself.
    exact : bool
        Whether the extremes are found on the exact closure. If not, everything is given to first order, many times
        faster for a determinate mechanism without meshing flanks: `worst_position` then is
        `worst_position_first_order`, without upper bounds.
    certify : bool
        Whether the extremes get upper bounds that hold for all offsets in the sets, on the exact closure, rounding
        included. Sets of tolerances with the distribution `normal` end at three standard deviations, and so do the
        bounds. For statically determinate mechanisms.
    parts : int
        With `certify`: how many parts of the sets may be looked at for each bound. The more, the closer a bound that
        is not close yet; bounds depend neither on time nor on threads.

    Returns
    -------
    xarray.Dataset
        Over `configuration`: `worst_position` (largest displacement of the output point), `worst_rotation` (largest
        turn), `worst_component` (lowest and highest error of each component), each also with `_first_order`;
        `worst_direction` (unit vector of the largest displacement), `worst_offset` (value of every parameter at each
        extreme; `given` reproduces the extreme from it), `contribution` (per source, to the first-order value of each
        extreme; they add up to it), `unsettled` (number of extremes whose ascent reached its limit of steps: the
        largest value met is given), `nominal`, `status`. Where members are elastic, specimens that can only be
        assembled under strain count as well (`strained`), each at its pose of least energy, and `contribution_elastic`
        (per joint) is the contribution of its compliance; these add up to zero. Loads do not count: `loaded` gives the
        deformation under a load. With `certify` also `worst_position_certified`, `worst_rotation_certified`,
        `worst_component_certified` (no offsets in the sets make larger errors), `worst_position_gap`,
        `worst_rotation_gap` (by which part the bound is above the value), `certified` (whether there are bounds),
        `certified_reason` (why not), `certified_assembly` (whether it is proved that the mechanism can be assembled
        for all offsets in the sets, in one pose each, without a singular one), `certified_parts`.

    Raises
    ------
    InputError
        When starts or parts are out of range or asked for without `exact` and `certify`, or `certify` without `exact`.

    Examples
    --------
    >>> import jointplay as jp
    >>> result = jp.worst(jp.loads(jp.examples.text("four-bar")))
    >>> result.worst_position[[0, 5, 10]].values.round(3)
    array([3.245, 3.297, 3.848])

    No offsets make more than this:

    >>> sure = jp.worst(jp.loads(jp.examples.text("four-bar")), certify=True)
    >>> sure.worst_position_certified[[0, 5, 10]].values.round(3)
    array([3.245, 3.297, 3.848])
    """
    return to_dataset(compute(m, starts=starts, exact=exact, certify=certify, parts=parts))


@recorded
@of_each(lambda _: False)
def compute(
    m: Mechanism,
    *,
    starts: int = STARTS,
    exact: bool = True,
    certify: bool = False,
    parts: int = PARTS,
    at: Nominal | None = None,
    progress: Progress | None = None,
) -> Result:
    """The light form of `worst`."""
    in_range(starts, "starts", "a number of starts", 1, MOST_STARTS)
    if certify:
        in_range(parts, "parts", "a number of parts", 1, MOST_PARTS)
    if certify and not exact:
        raise InputError("bounds are those of the exact closure: certify needs exact", key="certify")
    at = (at or nominal(m)).with_errors
    drives, poses = at.drives, at.poses

    def run(part: slice) -> Worst:
        found = m.core.worst(drives[part], poses[part], starts if exact else 0, partly=True)
        if certify:
            found = certified(m, drives[part], poses[part], found, parts)
        return without_singular(found) if exact else found

    found, done = batched(len(at), BATCH, run, progress)
    at = at.first(done)
    proved = "proved upper bounds where certified" if certify else "not certified: a search can only be too small"
    how = f"ascents from {starts} starts, {ON_CLOSURE}; {proved}" if exact else TO_FIRST_ORDER
    builder = report(m, "worst", at, obtained=how, starts=starts)
    if some := tight(m):
        builder.attrs["some_without_play"] = ", ".join(some)
    if groups := m.data.correlations:
        names = (name for group in groups for name in group.sources)
        builder.attrs["correlations_ignored"] = ", ".join(names)
    sides = ("configuration", "component", "side")
    whole = found["position"], found["rotation"], found["component"]
    linear = found["position_first_order"], found["rotation_first_order"], found["component_first_order"]
    for (position, rotation, component), suffix, words in (
        (whole, "", "" if exact else ", to first order"),
        (linear, "_first_order", ", to first order"),
    ):
        builder.add(f"worst_position{suffix}", "configuration", position, f"largest position error{words}", "length")
        builder.add(f"worst_rotation{suffix}", "configuration", rotation, f"largest rotation{words}", "angle")
        words = f"lowest and highest error of the component{words}"
        builder.add(f"worst_component{suffix}", sides, component, words, "component")
    bounds = ("position", "length", found["position_bound"]), ("rotation", "angle", found["rotation_bound"])
    for name, kind, bound in bounds:
        words = f"upper bound of the largest {name} error to first order"
        builder.add(f"worst_{name}_first_order_bound", "configuration", bound, words, kind)
    words = "direction of the largest position error"
    builder.add("worst_direction", ("configuration", "axis"), found["direction"], words)
    words = "offset of the parameter at the extreme"
    builder.add("worst_offset", ("configuration", "extreme", "parameter"), found["offset"], words, "parameter")
    words = "contribution of the source to the first-order extreme"
    builder.add("contribution", ("configuration", "extreme", "source"), found["contribution"], words, "extreme")
    if m.core.deformations:
        words = "contribution of the joint's compliance to the first-order extreme"
        dims = ("configuration", "extreme", "joint")
        builder.add("contribution_elastic", dims, found["contribution_elastic"], words, "extreme")
    words = "extremes whose ascent reached its limit of steps"
    builder.add("unsettled", "configuration", found["unsettled"], words)
    if certify:
        add_bounds(builder, found)
    judge(builder)
    builder.status(at.worse(found["status"]))
    return finished(builder, done, len(drives))
