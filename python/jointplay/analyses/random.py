"""`random`: how the error scatters from specimen to specimen.

First order: covariance = sum over sources of A_s Sigma_s A_s'. Beside it a seeded Monte Carlo on the non-linear
closure. In an over-constrained mechanism offsets scatter under the condition of compatibility, A delta = b of the
specimen; specimens whose clearances cannot fulfil it are strained, or cannot be assembled.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointplay.answers import Random
from jointplay.errors import InputError, in_range, listed, not_known, shown
from jointplay.model import Mechanism
from jointplay.result import STATUSES, Builder, Result, to_dataset
from jointplay.typed import typed

from .loaded import require_loads
from .nominal import Nominal, Progress, batched, finished, nominal, report
from .several import of_each

if TYPE_CHECKING:
    import xarray as xr

PROBABILITIES = (0.5, 0.9, 0.95, 0.99, 0.999)
LAWS = ("uniform", "boundary", "normal")
CONTACTS = ("scattered", "loaded")
MOST_SAMPLES = 10**12
MOST_PROBABILITIES = 1000
#: more than any machine has cores
MOST_THREADS = 1024


@typed
def random(
    m: Mechanism,
    samples: int = 100_000,
    seed: int = 0,
    law: str | None = None,
    *,
    contact: str = "scattered",
    probabilities: Sequence[float] = PROBABILITIES,
    threads: int = 0,
) -> xr.Dataset:
    """Find how the error scatters from specimen to specimen.

    Parameters
    ----------
    m : Mechanism
    samples : int
        Random specimens per configuration. Every configuration gets the same random numbers, so that a difference
        between configurations is not noise.
    seed : int
        Of the random numbers; the result is bit-identical for any number of threads.
    law : {"uniform", "boundary", "normal"}, optional
        How every clearance scatters, in place of its own law in the file: uniform in its set, on its boundary, or
        normal with three sigma to the boundary.
    contact : {"scattered", "loaded"}
        Whether clearances scatter by their laws, or the load of the file decides where they are in every specimen, so
        that only tolerances and drive errors scatter.
    probabilities : sequence of float
        Of the quantiles.
    threads : int
        0 for all cores.

    Returns
    -------
    xarray.Dataset
        Over `configuration`: `error_mean`, `error_std`, `error_covariance` (also with `_first_order`), `error_quantile`
        and `largest` (of every component, position, rotation; quantiles are known within `quantile_resolution`),
        `histogram` with `edge`, `outside` (share beyond the limits of the file), `failures` (samples by outcome; no
        sample is dropped silently, and those that the load leaves `undetermined` are included), `interference` (where
        sizes of clearances scatter: share of the specimens, per source, in which a pair has none), `contribution`
        (variance per source; they add up to the first-order one), `nominal`, `status`.

        An over-constrained mechanism, or an elastic one under load, has as well: `clearance_factor_quantile` (of the
        clearance scale factor required for assembly without strain), `not_assemblable` (share of the specimens that
        cannot be assembled), `strained` (share of those that can only be assembled under strain),
        `contribution_elastic` (of the compliance of every joint), and of elastic bodies `member_force_quantile`
        (tension positive). A source may make the scatter smaller: then its contribution is negative.

    Raises
    ------
    InputError
        When nothing loads a mechanism whose contact is to be loaded, or clearances that compatibility ties to others
        shall be at their boundary, where they cannot be compatible.

    Examples
    --------
    >>> import jointplay as jp
    >>> result = jp.random(jp.loads(jp.examples.text("four-bar")), samples=200_000)
    >>> result.error_std.sel(component="angle")[4].item()  # doctest: +ELLIPSIS
    0.38...
    """
    return to_dataset(compute(m, samples, seed, law, contact=contact, probabilities=probabilities, threads=threads))


@of_each(lambda given: given["contact"] == "loaded")
def compute(
    m: Mechanism,
    samples: int = 100_000,
    seed: int = 0,
    law: str | None = None,
    *,
    contact: str = "scattered",
    probabilities: Sequence[float] = PROBABILITIES,
    threads: int = 0,
    at: Nominal | None = None,
    progress: Progress | None = None,
) -> Result:
    """The light form of `random`."""
    levels = checked(samples, seed, law, probabilities)
    in_range(threads, "threads", "a number of threads", 0, MOST_THREADS)
    is_loaded = _is_loaded(m, contact)
    at = at or nominal(m)
    if not is_loaded:
        _require_room(m, law, at)
    drives, poses, limits = at.drives, at.poses, m.limits

    drawn = samples

    def run(part: slice) -> Random:
        # One configuration a call, so that the bar moves.
        nonlocal drawn
        if drawn < samples:
            raise KeyboardInterrupt
        found = (m.under_loads_of(part.start) if is_loaded else m).core.random(
            drives[part],
            poses[part],
            samples,
            seed,
            levels,
            limits.position,
            limits.rotation,
            law,
            threads,
            loaded=is_loaded,
            partly=True,
        )
        drawn = int(found["failures"].sum())
        return found

    found, done = batched(len(at), 1, run, progress)
    at = at.first(done)
    builder = report(m, "random", at, samples=samples, seed=seed, law=law or "as in the file")
    if is_loaded:
        builder.attrs["contact"] = contact
    _moments(builder, found)
    _distribution(builder, found, levels, m)
    if "clearance_factor" in found:
        _assembly(builder, found, m)
    builder.status(at.worse(found["status"]))
    unfinished = f", the last with {drawn:,} of {samples:,} samples" if drawn < samples else ""
    return finished(builder, done, len(drives), unfinished)


def checked(samples: int, seed: int, law: str | None, probabilities: Sequence[float]) -> NDArray[np.float64]:
    """The probabilities as an array, after a look at everything that was asked."""
    in_range(samples, "samples", "a number of samples", 2, MOST_SAMPLES)
    in_range(seed, "seed", "a seed", 0, 2**64 - 1)
    if law is not None and law not in LAWS:
        raise InputError(not_known(law, "a law", LAWS), key="law")
    levels = np.array(probabilities, dtype=np.float64)
    if levels.ndim != 1 or len(levels) > MOST_PROBABILITIES or not ((levels > 0) & (levels < 1)).all():
        problem = f"up to {MOST_PROBABILITIES} numbers between 0 and 1 are needed, not {shown(levels.tolist())}"
        raise InputError(problem, key="probabilities")
    return levels


def _is_loaded(m: Mechanism, contact: str) -> bool:
    if contact not in CONTACTS:
        raise InputError(not_known(contact, "a contact", CONTACTS), key="contact")
    if contact == "loaded":
        require_loads(m)
    return contact == "loaded"


def _require_room(m: Mechanism, law: str | None, at: Nominal) -> None:
    """Refuse clearances at their boundary where they must be compatible with others."""
    laws = [law or source["law"] for source in m.core_spec["sources"]]
    kinds = zip(laws, m.source_kinds, strict=True)
    if not any(law == "boundary" and kind == "clearance" for law, kind in kinds):
        return
    tied = [s for s in m.core.tied(at.drives, at.poses) if laws[s] == "boundary"]
    if tied:
        names = listed(m.sources[s] for s in tied)
        problem = (
            f"law 'boundary' is not possible for {names}: these clearances must fulfil compatibility in an"
            " over-constrained mechanism; valid there: uniform, normal"
        )
        raise InputError(problem, file=m.file, key="law")


def _moments(builder: Builder, found: Random) -> None:
    pose, square = ("configuration", "component"), ("configuration", "component", "component_other")
    exact, linear = (found["mean"], found["covariance"]), (found["mean_first_order"], found["covariance_first_order"])
    for (mean, covariance), suffix, words in ((exact, "", ""), (linear, "_first_order", ", to first order")):
        std = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        builder.add(f"error_mean{suffix}", pose, mean, f"mean error{words}", "component")
        builder.add(f"error_std{suffix}", pose, std, f"standard deviation of the error{words}", "component")
        words = f"covariance of the error{words}"
        builder.add(f"error_covariance{suffix}", square, covariance, words, ("component", "component_other"))
    words = "contribution of the source to the first-order variance"
    parts = ("configuration", "source", "component")
    builder.add("contribution", parts, found["contribution"], words, "component", power=2)


def _distribution(builder: Builder, found: Random, levels: NDArray[np.float64], m: Mechanism) -> None:
    per = ("configuration", "quantity")
    builder.labels("probability", levels, "share of the specimens below the quantile")
    quantile = ("configuration", "probability", "quantity")
    builder.add("error_quantile", quantile, found["quantile"], "quantile of the error", "quantity")
    resolution = found["quantile_resolution"]
    builder.add("quantile_resolution", per, resolution, "width within which the quantile is known", "quantity")
    builder.add("largest", per, found["largest"], "largest size met", "quantity")
    builder.add("histogram", (*per, "bin"), found["histogram"].astype(np.int64), "specimens in the bin")
    builder.add("edge", (*per, "bin_edge"), found["edges"], "edges of the bins", "quantity")
    builder.add("outside", "configuration", found["outside"], "share of the specimens beyond the limits")
    if "size" in m.source_kinds:
        words = "share of the specimens in which hole and pin have interference, and no play"
        builder.add("interference", ("configuration", "source"), found["interference"], words)
    failures = found["failures"].astype(np.int64)
    builder.add("failures", ("configuration", "outcome"), failures, "specimens by outcome")
    if not np.isnan(m.limits.position):
        builder.attrs["limit_position"] = m.limits.position / builder.units.length
    if not np.isnan(m.limits.rotation):
        builder.attrs["limit_rotation"] = m.limits.rotation / builder.units.angle


def _assembly(builder: Builder, found: Random, m: Mechanism) -> None:
    """The further results of over-constrained and elastic mechanisms."""
    words = "clearance scale factor required for assembly without strain, quantile"
    builder.add("clearance_factor_quantile", ("configuration", "probability"), found["clearance_factor"], words)
    for outcome, words in (("not_assemblable", "cannot be assembled"), ("strained", "are strained without any load")):
        share = found["failures"][:, STATUSES.tolist().index(outcome)] / found["failures"].sum(axis=1)
        builder.add(outcome, "configuration", share, f"share of the specimens that {words}")
    if not m.core.deformations:
        return
    words = "contribution of the joint's compliance to the first-order variance"
    parts = ("configuration", "joint", "component")
    builder.add("contribution_elastic", parts, found["contribution_elastic"], words, "component", power=2)
    if m.members:
        along = [m.core.elastic_rows.index((member.joint, "along")) for member in m.members]
        words = "force of the member, tension positive, quantile"
        forces = ("configuration", "probability", "member")
        builder.add("member_force_quantile", forces, found["force"][..., along], words, "force")
