"""`allocate`: the cheapest sizes with which the limits hold.

minimise   sum over sources of cost(size)
subject to error <= limit, of every limited quantity in every configuration

in the exact worst case, or for a required share of the specimens. The costs are those of the file, `[costs]`; what has
none keeps its size.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from jointplay.analyses.beside import judged
from jointplay.analyses.contacts import contacts
from jointplay.analyses.nominal import OK, Interrupted, Nominal, Progress, nominal
from jointplay.analyses.recorded import recorded
from jointplay.analyses.worst import MOST_STARTS
from jointplay.basics.typed import Need, goes_with, typed
from jointplay.errors import InputError, in_range, shown
from jointplay.model.mechanism import Mechanism
from jointplay.model.sizing import sizings
from jointplay.questions import asked_by, require_known
from jointplay.result import STATUSES, Result, to_dataset

from .items import DIGITS, items_of
from .looks import limits_of, merged
from .report import FOUND, STEP, Allocated, report, unassembled
from .required import Required
from .sampled import SampledSearch
from .scatter import Scatter
from .search import AllocateSearch
from .worst_case import WorstCase

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["SAMPLES", "allocate", "compute"]

#: specimens of each configuration that decide on a yield
SAMPLES = 32_768
MOST_SAMPLES = 1_000_000
#: points of a curve, and by how much a limit can be multiplied there
MOST_POINTS, MOST_TIMES = 200, 1e6
#: beyond them the closure is rounding
MOST_DIGITS = 12


@typed
@goes_with(Need("question", "random", or_with="probability"), "samples", "seed")
def allocate(
    m: Mechanism,
    question: str | None = None,
    *,
    probability: float | None = None,
    curve: Sequence[float] = (),
    contact: str | None = None,
    digits: int = DIGITS,
    starts: int = 24,
    samples: int = SAMPLES,
    seed: int = 0,
) -> xr.Dataset:
    """Find the cheapest sizes with which the limits hold, and which can be ordered.

    Parameters
    ----------
    m : Mechanism
        With limits of the error and costs of sources.
    question : {"worst", "random"}, optional
        In which the limits have to hold, at every configuration: in the exact worst case (default, if no probability
        is given), or for a share of the specimens.
    probability : float, optional
        random: the share of the specimens that has to keep to all limits of an output, at every configuration and with
        a confidence of 97.5 %; that of the file if left out.
    curve : sequence of float
        Factors on all limits, for each of which the least cost is found, too.
    contact : {"scattered", "loaded"}, optional
        random: whether clearances scatter by their laws, or the load decides where they are. Left out, the one that the
        file names; where it has loads and names none, the yield is reached both ways.
    digits : int
        Significant digits of sizes by formula, which are rounded down.
    starts : int
        worst: as of `worst`.
    samples, seed : int
        random: specimens of each configuration.

    Returns
    -------
    xarray.Dataset
        Over `source` (those with a cost), in units of the file (`source_unit`): `size_before`, `size` (of a clearance
        the largest play, as the file measures it), `choice` (the fit, or group of bearings), `cost` and `cost_before`
        (nan where the size in the file has no cost). `total_cost`, `total_cost_before`; `first_order_bound`: what no
        sizes can cost less than, to first order, which is no bound of the exact closure.

        Over `limited`, every limit by its name: `limit_value`, `shadow_price` (what it saves, per unit of the limit, to
        loosen it by `shadow_step`, both sides of a component together), and over `configuration` `used` (error / limit)
        and `binding` (where as much of a limit is used as anywhere). `binding_direction`: of the largest position error
        where it uses most. Of `random` `decided_by`: with which contact, and in which load case, most of the limit is
        used.

        Over `limit`, the factors of `curve`: `curve_cost`, `curve_status`. Where the file limits forces,
        `forces_outcome` with these sizes, as of `compare`.

        `status` is ``ok``; ``infeasible``: no sizes were found with which the limits hold, and the tightest ones are
        given, which miss them; ``unfinished``: the sizes hold, but there may be cheaper ones; or the status of a
        configuration that cannot be assembled, and nothing was looked for. Where sizes were found, the attribute
        `changes` has the changed values, one `KEY=VALUE` a line. The sizes in the file are looked at as well: where
        their limits hold, nothing dearer is given.

    Raises
    ------
    InputError
        When the file has no limits or no costs, a cost does not fit to its source, or the mechanism is over-constrained
        or elastic.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar"))
    >>> costs = {"choices": [{"size": 0.1, "cost": 5}, {"size": 0.2, "cost": 3}, {"size": 0.4, "cost": 2}]}
    >>> m = m.with_({"limits.position": 1.0, "costs": {"J*": costs}})
    >>> jp.allocate(m).size.values
    array([0.2, 0.2, 0.2, 0.4])
    """
    return to_dataset(
        compute(
            m,
            question,
            probability=probability,
            curve=curve,
            contact=contact,
            digits=digits,
            starts=starts,
            samples=samples,
            seed=seed,
        )
    )


@recorded
def compute(
    m: Mechanism,
    question: str | None = None,
    *,
    probability: float | None = None,
    curve: Sequence[float] = (),
    contact: str | None = None,
    digits: int = DIGITS,
    starts: int = 24,
    samples: int = SAMPLES,
    seed: int = 0,
    progress: Progress | None = None,
) -> Result:
    """The light form of `allocate`."""
    asked, share = _asked(m, question, probability)
    if asked == "worst" and contact is not None:
        raise InputError("goes with the question random; in the worst case offsets are anywhere", key="contact")
    factors = _checked(curve, starts, samples, seed, digits)
    if asked == "random" and not Required(samples, share).is_possible:
        problem = f"{samples} are too few to know that a share of {share:g} keeps to the limits; more are needed"
        raise InputError(problem, key="samples")
    assumed = contacts(m, contact) if asked == "random" else ()
    # Load cases count for the forces.
    whole = sizings(m)[0]
    m = m if "loaded" in assumed else m.without_load_cases()
    base, items, without = items_of(m, digits)
    if not base.core.isostatic or base.core.deformations:
        problem = (
            "least-cost sizes are found where the first-order error is a sum over the sources; here compatibility or"
            " elastic bodies make it less than that: `sweep` and `allow` answer for one source at a time"
        )
        raise InputError(problem, file=m.file, key="costs")
    limits = limits_of(base)
    attributes: dict[str, str | int | float] = {"asked": asked}
    if any(item.is_formula for item in items):
        attributes["digits"] = digits
    search: AllocateSearch | SampledSearch
    places: list[Nominal]
    if asked == "random":
        attributes |= {"probability": share, "samples": samples, "seed": seed}
        if m.has_loads:
            attributes["contact"] = ", ".join(assumed)
        scatter = Scatter(base, items, limits, samples, seed, share, assumed)
        places = scatter.places
        search = SampledSearch(items, scatter, progress, least=min([1.0, *factors]))
    else:
        at = {output: nominal(base.only(output)) for output in base.outputs or (None,)}
        places = list(at.values())
        search = AllocateSearch(items, WorstCase(base, items, limits, at, starts), progress)
    answer = Allocated(m, base, items, without, limits, places[0], search, attributes)
    bad = np.max([np.where(place.counts, place.status, OK) for place in places], axis=0)
    if not any(place.counts.any() for place in places):
        raise InputError(
            "the machine can stand at no configuration; `jointplay solve` says why", file=m.file, key="drives"
        )
    if bad.any():
        return unassembled(answer, str(STATUSES[bad.max()]), np.flatnonzero(bad).tolist())
    ones = np.ones(len(limits))
    try:
        outcome = answer.outcome = search.run(ones)
        if outcome.status in FOUND:
            # Both sides of a limit are loosened together.
            alike = [(one.output, one.quantity) for one in limits]
            prices = {one: search.saving(outcome, np.array([other == one for other in alike]), STEP) for one in alike}
            answer.prices = [prices[one] for one in alike]
        for factor in factors:
            answer.curve.append((factor, search.run(ones * factor)))
        if outcome.status in FOUND:
            answer.forces = judged(whole.with_(merged(items, outcome.values)))
    except KeyboardInterrupt:
        if answer.outcome is None:
            answer.outcome = search.best(ones, "unfinished", whole=True)
            if answer.outcome is None:
                raise KeyboardInterrupt from None
        answer.attributes["incomplete"] = "interrupted; the sizes hold, but there may be cheaper ones"
        if answer.outcome.status == "ok":
            answer.attributes["incomplete"] = f"interrupted after {len(answer.curve)} of {len(factors)} points"
        raise Interrupted(report(answer)) from None
    return report(answer)


def _asked(m: Mechanism, question: str | None, probability: float | None) -> tuple[str, float]:
    """The question and the required share."""
    if question is not None:
        require_known(question, asked_by("allocate"))
    asked = question or ("worst" if probability is None else "random")
    if asked == "worst":
        if probability is not None:
            raise InputError("goes with the question random; the worst case has no shares", key="probability")
        return asked, 1.0
    share = m.limits.probability if probability is None else probability
    if probability is None and math.isnan(share):
        problem = "say which share of the specimens keeps to the limits, such as 0.9973, here or in the file's [limits]"
        raise InputError(problem, key="probability")
    if not 0.0 < share < 1.0:
        raise InputError(f"a number between 0 and 1 is needed, not {shown(share)}", key="probability")
    return asked, share


def _checked(curve: Sequence[float], starts: int, samples: int, seed: int, digits: int) -> list[float]:
    in_range(starts, "starts", "a number of starts", 1, MOST_STARTS)
    in_range(samples, "samples", "a number of samples", 2, MOST_SAMPLES)
    in_range(seed, "seed", "a seed", 0, 2**64 - 1)
    in_range(digits, "digits", "a number of digits", 1, MOST_DIGITS)
    factors = [float(factor) for factor in curve]
    if len(factors) > MOST_POINTS:
        raise InputError(f"up to {MOST_POINTS} factors are possible, not {len(factors)}", key="curve")
    for factor in factors:
        if not 1.0 / MOST_TIMES <= factor <= MOST_TIMES:
            raise InputError(f"a factor on the limits is a positive number, not {shown(factor)}", key="curve")
    return factors
