"""How an assembly scatters from specimen to specimen: the same seeded specimens go through all steps.

Probability that a step can be assembled without strain = share of the specimens whose clearances take up the misfit
(clearance factor up to one).
"""

from collections.abc import Callable, Sequence

import numpy as np

from jointplay import _core
from jointplay.analyses.nominal import Progress
from jointplay.analyses.random import checked, points
from jointplay.basics.arrays import Floats
from jointplay.core.compile import LENGTHS
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result

from .forces import Members
from .report import Configuration, each, finished, report
from .specimens import solve
from .state import Held
from .steps import steps


def compute(
    m: Mechanism,
    at: Configuration,
    samples: int,
    seed: int,
    law: str | None,
    probabilities: Sequence[float],
    sampling: str,
    progress: Progress | None = None,
) -> Result:
    """Quantiles over random specimens after every step."""
    levels = checked(samples, seed, law, probabilities, sampling)
    every, members = list(steps(m, at.poses)), Members(m)
    u = m.core.specimens(samples, seed, law, sampling)
    solved = each(every, lambda step: solve(Held(step), members, u), progress)
    taken = every[: len(solved)]

    builder = report(m, taken, at, "random")
    builder.attrs |= {"samples": samples, "seed": seed, "law": law or "as in the file"}
    builder.attrs["sampling"] = points(m, samples, law, sampling)
    builder.labels("probability", levels, "share of the specimens below the quantile")
    centres = np.stack([_quantiles(specimens.centres, levels) for specimens in solved])
    for k, (end, body) in enumerate((("shaft", "first"), ("bearing", "second"))):
        words = f"quantile of the position error of the centre on the {body} body of the joint"
        dims = ("step", "joint", "probability")
        builder.add(f"quantile_{end}", dims, centres[:, k], words, "length")
    lengths = sum(component in LENGTHS for component in m.components)
    sizes = np.stack(
        [_quantiles(np.linalg.norm(specimens.output[:, :lengths], axis=1), levels) for specimens in solved]
    )
    builder.add(
        "quantile_position", ("step", "probability"), sizes, "quantile of the output's position error", "length"
    )
    ok = [np.isfinite(specimens.output).all(axis=1) for specimens in solved]
    moments = {
        name: np.stack([_moment(specimens.output[good], of) for specimens, good in zip(solved, ok, strict=True)])
        for name, of in (("mean", np.mean), ("std", np.std))
    }
    builder.add("error_mean", ("step", "component"), moments["mean"], "mean error of the output", "component")
    builder.add("error_std", ("step", "component"), moments["std"], "standard deviation of it", "component")
    builder.labels("member", members.names, "link between two points")
    forces = np.stack([_quantiles(np.abs(specimens.force), levels) for specimens in solved])
    builder.add(
        "quantile_force", ("step", "member", "probability"), forces, "quantile of the size of the force", "force"
    )
    factors = np.stack([_quantiles(specimens.clearance_factor, levels) for specimens in solved])
    words = "quantile of the clearance scale factor required for assembly of the rigid bodies"
    builder.add("quantile_clearance_factor", ("step", "probability"), factors, words)
    fits = np.array([specimens.fits.mean() for specimens in solved])
    builder.add("probability_of_fit", "step", fits, "share of the specimens that can be assembled without strain")
    outcomes = [[int((specimens.status == name).sum()) for name in _core.STATUSES] for specimens in solved]
    builder.add("failures", ("step", "outcome"), np.array(outcomes, dtype=np.int64), "specimens by outcome")
    held = np.array(["underconstrained" if step.freedom.mobility else "ok" for step in taken], dtype=str)
    builder.add("status", "step", held, "outcome")
    return finished(builder, len(every))


def _quantiles(values: Floats, levels: Floats) -> Floats:
    """Quantiles along the last axis of the specimens that could be solved; nan where none could."""
    flat = values.reshape(-1, values.shape[-1])
    rows = [np.quantile(row[np.isfinite(row)], levels) if np.isfinite(row).any() else levels * np.nan for row in flat]
    return np.reshape(rows, (*values.shape[:-1], len(levels)))


def _moment(errors: Floats, of: Callable[..., Floats]) -> Floats:
    return np.full(errors.shape[1], np.nan) if not len(errors) else of(errors, axis=0)
