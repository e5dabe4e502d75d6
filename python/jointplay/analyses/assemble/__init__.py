"""`assemble`: the precision of an assembly, step by step.

After every step what is assembled is a mechanism of its own: the bodies that are there, on the base. It is solved with
the deviations of the built specimen and with clearances taken up under its loads; freedoms that are left are held at
their nominal values. Nothing is carried over from one step to the next: without friction loads and elasticity determine
the pose, whatever the order of assembly.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from jointplay.analyses.nominal import Progress
from jointplay.analyses.random import PROBABILITIES
from jointplay.analyses.recorded import recorded
from jointplay.analyses.several import of_each
from jointplay.basics.typed import Need, goes_with, typed
from jointplay.errors import InputError, in_range
from jointplay.model.mechanism import Mechanism
from jointplay.questions import asked_by, require_known
from jointplay.result import Result, to_dataset

from . import scatter, unit, worst
from .order import best_order
from .report import place, unassembled
from .steps import order

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["SAMPLES", "assemble", "best_order", "compute"]

#: specimens that a question about scatter draws
SAMPLES = 2_000
MOST_SAMPLES = 1_000_000


@typed
@goes_with(Need("question", "random"), "samples", "seed", "law", "sampling", "probabilities")
def assemble(
    m: Mechanism,
    question: str = "unit",
    *,
    configuration: int = 0,
    samples: int = SAMPLES,
    seed: int = 0,
    law: str | None = None,
    sampling: str = "sobol",
    probabilities: Sequence[float] = PROBABILITIES,
) -> xr.Dataset:
    """Follow an assembly step by step.

    Parameters
    ----------
    m : Mechanism
        With an order of assembly.
    question : {"unit", "worst", "random"}
        One built specimen with its known deviations, the worst case over all tolerances, or the scatter over random
        specimens.
    configuration : int
        At which of its configurations it is assembled.
    samples, seed, law, sampling, probabilities
        Of random specimens, see `random`. The same specimens go through all steps.

    Returns
    -------
    xarray.Dataset
        Over `step`: `kind` (``fixed``, ``connected``, ``closing``, ``redundant``, ``loose``, ``redundant and loose``),
        `members`, `links`, `mobility` and `redundancy` of what is assembled, `held` (what is free and therefore held at
        its nominal place), `status`. What is not there yet is nan.

        For the specimen: `error_shaft` and `error_bearing` (of the centre on the first and on the second body of every
        joint), `undetermined_shaft` and `undetermined_bearing` (half-width of the indeterminacy that the loads
        leave),
        `error` and `undetermined` of the output, `sensitivity` of the output (per parameter), `clearance_offset`,
        `contact` (per source), `reaction`, `member_force` (tension positive), `member_elongation`, `clearance_factor`
        (clearance scale factor required for assembly of the rigid bodies).

        For the worst: `worst_shaft`, `worst_bearing`, `worst_position` of the output, `worst_force`,
        `worst_clearance_factor`. For random specimens: quantiles of the same, `error_mean` and `error_std` of the
        output, `probability_of_fit` (share of the specimens that can be assembled without strain), `failures`.

        Links that are locked to one another are one: `link_nominal`, `link_actual`, `link_shortest` and
        `link_longest` are its lengths between its joints.

    Raises
    ------
    InputError
        When the file has no order of assembly.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("four-bar"))
    >>> m = m.with_({"assembly.steps": [["crank"], ["coupler", "rocker"]]})
    >>> jp.assemble(m).kind.values.tolist()
    ['fixed', 'connected']
    """
    options = {"configuration": configuration, "samples": samples, "seed": seed, "law": law, "sampling": sampling}
    return to_dataset(compute(m, question, **options, probabilities=probabilities))  # type: ignore[arg-type]


def _check_output(m: Mechanism) -> None:
    """Refuse an output that another body measures."""
    if m.seen_from is not None:
        key = f"outputs.{m.of[0]}.relative_to" if m.of[0] else "output.relative_to"
        others = (
            "choose another output (--output-point, Mechanism.only), or leave it out" if m.of[0] else "leave it out"
        )
        raise InputError(f"the errors of an assembly refer to its base; {others}", file=m.file, key=key)


@recorded
@of_each(lambda _: True, check=_check_output)
def compute(
    m: Mechanism,
    question: str = "unit",
    *,
    configuration: int = 0,
    samples: int = SAMPLES,
    seed: int = 0,
    law: str | None = None,
    sampling: str = "sobol",
    probabilities: Sequence[float] = PROBABILITIES,
    progress: Progress | None = None,
) -> Result:
    """The light form of `assemble`."""
    require_known(question, ("unit", *asked_by("assemble")), "a question about an assembly")
    order(m)
    # Specimens are solved all at once.
    in_range(samples, "samples", "a number of samples", 2, MOST_SAMPLES)
    at = place(m, configuration)
    if not at.is_assembled:
        return unassembled(m, at, question)
    m = m.at_rest_under(configuration)
    if question == "random":
        return scatter.compute(m, at, samples, seed, law, probabilities, sampling, progress)
    if question == "worst":
        return worst.compute(m, at, progress)
    return unit.compute(m, at, progress)
