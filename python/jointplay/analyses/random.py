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

from jointplay import confidence
from jointplay.answers import Random
from jointplay.errors import InputError, in_range, listed, not_known, shown
from jointplay.model import Mechanism
from jointplay.result import SIDES, STATUSES, Builder, Result, Variable, axes_of, to_dataset
from jointplay.typed import typed
from jointplay.verdict import ROUNDING, add_limits

from .capability import LEVELS, capability
from .indices import Indices, groups, require_determinate_scatter
from .indices import indices as find_indices
from .loaded import require_loads
from .nominal import Floats, Interrupted, Nominal, Progress, batched, finished, nominal, report
from .several import of_each
from .tails import require_rare, search_rare
from .yields import Yields, repeatability, yields

if TYPE_CHECKING:
    import xarray as xr

PROBABILITIES = (0.5, 0.9, 0.95, 0.99, 0.999)
LAWS = ("uniform", "boundary", "normal")
CONTACTS = ("scattered", "loaded")
SAMPLINGS = ("sobol", "plain")
#: a power of two, of which scrambled Sobol points are best
SAMPLES = 131_072
#: independent sets of Sobol points
REPLICATES = 16
MOST_SAMPLES = 10**12
MOST_PROBABILITIES = 1000
#: more than any machine has cores
MOST_THREADS = 1024


@typed
def random(
    m: Mechanism,
    samples: int = SAMPLES,
    seed: int = 0,
    law: str | None = None,
    *,
    contact: str = "scattered",
    sampling: str = "sobol",
    probabilities: Sequence[float] = PROBABILITIES,
    indices: bool = False,
    threads: int = 0,
    rare: bool = False,
) -> xr.Dataset:
    """Find how the error scatters from specimen to specimen.

    Parameters
    ----------
    m : Mechanism
    samples : int
        Random specimens per configuration; with Sobol points a power of two is best. Every configuration gets the same
        random numbers, so that a difference between configurations is not noise.
    seed : int
        Of the random numbers; the result is bit-identical for any number of threads.
    law : {"uniform", "boundary", "normal"}, optional
        How every clearance scatters, in place of its own law in the file: uniform in its set, on its boundary, or
        normal with three sigma to the boundary.
    contact : {"scattered", "loaded"}
        Whether clearances scatter by their laws, or the load of the file decides where they are in every specimen, so
        that only tolerances and drive errors scatter.
    sampling : {"sobol", "plain"}
        Scrambled Sobol points, which fill the space of all deviations and offsets evenly, in 16 independent replicates;
        or pseudo-random numbers.
    probabilities : sequence of float
        Of the quantiles.
    indices : bool
        Whether to find Sobol' indices as well, of a determinate mechanism whose offsets scatter: at most 16,384 points,
        solved once for every source and twice more.
    threads : int
        0 for all cores.
    rare : bool
        Search for specimens outside the limits, by subset simulation, where fewer than 1000 of the samples are: of a
        determinate mechanism with limits whose clearances scatter.

    Returns
    -------
    xarray.Dataset
        Over `configuration`: `error_mean`, `error_std`, `error_covariance` (also with `_first_order`), `error_quantile`
        and `largest` (of every component, position, rotation; quantiles are known within `quantile_resolution`),
        `histogram` with `edge`, `failures` (samples by outcome; no sample is dropped silently, and those that the load
        leaves `undetermined` are included), `interference` (where sizes of clearances scatter: share of the specimens,
        per source, in which a pair has none), `contribution` (variance per source; they add up to the first-order
        one), `nominal`, `status`. `error_mean_standard_error`, `error_std_standard_error` and
        `error_quantile_standard_error` are what the samples leave open: by the differences of the replicates, or of
        plain samples. The attribute `sampling` says which points were taken, and of which sources they are
        pseudo-random.

        Of the limits of the file, nan where there are none: `limit`, `outside` (share of the specimens beyond any of
        them or without a pose) and `outside_quantity` (of each), with `_standard_error`, and `_low` and `_high`, the
        ends of the 95 % confidence interval; with `rare`, `outside_method`: how the share was found; `cp`, `cpk`
        (predicted capability by quantiles) with `_standard_error`.

        Of a determinate mechanism whose offsets scatter: `repeatability` of the output point (ISO 9283) with
        `_standard_error`; over all configurations `yield_path` (share of the specimens that keep to the limits at
        each, with offsets drawn anew at each; it falls with the number of configurations) and `yield_specimen` (share
        of those that keep to them wherever the play lies), with `_low` and `_high`.

        With `indices`: `sobol_first` and `sobol_total` of every source and quantity, on the exact closure: the share of
        the variance that the source has alone, and with all that it does together with others, each with
        `_standard_error`. Of a clearance whose sizes scatter the source is where its pin lies within the play; sources
        that are correlated are one group, of which each has the index. `sobol_left_out` is the share of the points of
        which a specimen has no pose.

        An over-constrained mechanism, or an elastic one under load, has as well: `clearance_factor_quantile` (of the
        clearance scale factor required for assembly without strain), `not_assemblable` (share of the specimens that
        cannot be assembled), `strained` (share of those that can only be assembled under strain),
        `contribution_elastic` (of the compliance of every joint), and of elastic bodies `member_force_quantile`
        (tension positive). A source may make the scatter smaller: then its contribution is negative.

    Raises
    ------
    InputError
        When nothing loads a mechanism whose contact is to be loaded, or clearances that compatibility ties to others
        shall be at their boundary, where they cannot be compatible; when `indices` are asked for, or rare specimens are
        to be searched for, of an over-constrained mechanism or with offsets that the load decides.

    Examples
    --------
    >>> import jointplay as jp
    >>> result = jp.random(jp.loads(jp.examples.text("four-bar")), samples=200_000)
    >>> result.error_std.sel(component="angle")[4].item()  # doctest: +ELLIPSIS
    0.38...
    """
    return to_dataset(
        compute(
            m,
            samples,
            seed,
            law,
            contact=contact,
            sampling=sampling,
            probabilities=probabilities,
            indices=indices,
            threads=threads,
            rare=rare,
        )
    )


@of_each(lambda given: given["contact"] == "loaded")
def compute(
    m: Mechanism,
    samples: int = SAMPLES,
    seed: int = 0,
    law: str | None = None,
    *,
    contact: str = "scattered",
    sampling: str = "sobol",
    probabilities: Sequence[float] = PROBABILITIES,
    indices: bool = False,
    threads: int = 0,
    rare: bool = False,
    at: Nominal | None = None,
    progress: Progress | None = None,
    path: bool = True,
) -> Result:
    """The light form of `random`; `path` asks for what is of all configurations together or of one specimen."""
    levels = checked(samples, seed, law, probabilities, sampling)
    # Numbers of numpy overflow where seeds are made of it.
    samples, seed = int(samples), int(seed)
    in_range(threads, "threads", "a number of threads", 0, MOST_THREADS)
    is_loaded = _is_loaded(m, contact)
    if indices:
        require_determinate_scatter(m, is_loaded)
    if rare:
        require_rare(m, is_loaded)
    at = at or nominal(m)
    if not is_loaded:
        _require_room(m, law, at)
    drives, poses, limits = at.drives, at.poses, m.limits.bounds(m.quantities)
    # What is rounding is beyond no limit.
    slack = ROUNDING * np.array([m.length if kind == "length" else 1.0 for kind in axes_of(m)["quantity"].kinds])
    widened = limits + np.outer(slack, (-1.0, 1.0))
    more = np.concatenate([levels, LEVELS]) if m.limits.errors else levels

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
            more,
            widened,
            law,
            threads,
            loaded=is_loaded,
            partly=True,
            sampling=sampling,
        )
        drawn = int(found["failures"].sum())
        return found

    found, done = batched(len(at), 1, run, progress)
    at = at.first(done)
    builder = report(m, "random", at, samples=samples, seed=seed, law=law or "as in the file")
    builder.attrs["sampling"] = points(m, samples, law, sampling)
    if is_loaded:
        builder.attrs["contact"] = contact
    _moments(builder, found)
    _distribution(builder, found, levels, m)
    _limits(builder, found, limits, samples, len(levels), sampling)
    if "clearance_factor" in found:
        _assembly(builder, found, len(levels), m)
    builder.status(at.worse(found["status"]))
    whole = done == len(drives) and drawn == samples
    waiting = "rare specimens were searched for at all configurations"
    try:
        if rare and drawn == samples:
            search_rare(builder, m, at, found["outside"] * samples, seed, law, widened)
        waiting = "the Sobol' indices"
        if indices and whole:
            _indices(builder, find_indices(m, at, samples, seed, law, sampling, slack))
        waiting = "the yields over all configurations"
        # Where nothing is off there is nothing to draw.
        if path and whole and not is_loaded and m.core.isostatic and m.parameters:
            _of_path(builder, m, at, samples, seed, law, widened)
    except KeyboardInterrupt:
        builder.attrs["incomplete"] = f"interrupted before {waiting}"
        raise Interrupted(builder.result()) from None
    unfinished = f", the last with {drawn:,} of {samples:,} samples" if drawn < samples else ""
    return finished(builder, done, len(drives), unfinished)


def points(m: Mechanism, samples: int, law: str | None, sampling: str) -> str:
    """Which points are taken."""
    if sampling == "plain":
        return "pseudo-random"
    replicates = min(samples, REPLICATES)
    least, left = divmod(samples, replicates)
    sizes = f"{least:,}" if not left else f"{least:,} or {least + 1:,}"
    words = f"scrambled Sobol points, {replicates} independent replicates of {sizes}"
    rest = m.core.pseudo_random(law)
    return f"{words}; pseudo-random: {listed(m.sources[s] for s in rest)}" if rest else words


def checked(
    samples: int, seed: int, law: str | None, probabilities: Sequence[float], sampling: str
) -> NDArray[np.float64]:
    """The probabilities as an array, after a look at everything that was asked."""
    in_range(samples, "samples", "a number of samples", 2, MOST_SAMPLES)
    in_range(seed, "seed", "a seed", 0, 2**64 - 1)
    if law is not None and law not in LAWS:
        raise InputError(not_known(law, "a law", LAWS), key="law")
    if sampling not in SAMPLINGS:
        raise InputError(not_known(sampling, "a sampling", SAMPLINGS), key="sampling")
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
    for name, of in (("mean", "mean error"), ("std", "standard deviation of the error")):
        errors = found[f"{name}_standard_error"]  # type: ignore[literal-required]
        builder.add(f"error_{name}_standard_error", pose, errors, f"standard error of the {of}", "component")
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
    values = found["quantile"][:, : len(levels)]
    builder.add("error_quantile", quantile, values, "quantile of the error", "quantity")
    values = found["quantile_standard_error"][:, : len(levels)]
    words = "standard error of the quantile"
    builder.add("error_quantile_standard_error", quantile, values, words, "quantity")
    resolution = found["quantile_resolution"]
    builder.add("quantile_resolution", per, resolution, "width within which the quantile is known", "quantity")
    builder.add("largest", per, found["largest"], "largest size met", "quantity")
    builder.add("histogram", (*per, "bin"), found["histogram"].astype(np.int64), "specimens in the bin")
    builder.add("edge", (*per, "bin_edge"), found["edges"], "edges of the bins", "quantity")
    if "size" in m.source_kinds:
        words = "share of the specimens in which hole and pin have interference, and no play"
        builder.add("interference", ("configuration", "source"), found["interference"], words)
    failures = found["failures"].astype(np.int64)
    builder.add("failures", ("configuration", "outcome"), failures, "specimens by outcome")


def _limits(builder: Builder, found: Random, limits: Floats, samples: int, count: int, sampling: str) -> None:
    """Shares beyond the limits with confidence intervals and standard errors, and capabilities.

    The quantiles that these need come after `count` others.
    """
    per = ("configuration", "quantity")
    add_limits(builder)
    drawn = found["failures"].sum(axis=1).astype(float)
    replicates = min(samples, REPLICATES) if sampling == "sobol" else 1
    words = "share of the specimens beyond the limits"
    shares = (
        ("outside", "configuration", found["outside"], found["outside_standard_error"], words),
        (
            "outside_quantity",
            per,
            found["outside_quantity"],
            found["outside_quantity_standard_error"],
            f"{words} of the quantity",
        ),
    )
    for name, dims, share, errors, words in shares:
        builder.add(name, dims, share, words)
        builder.add(f"{name}_standard_error", dims, errors, f"{words}, standard error")
        total = np.broadcast_to(drawn if dims == "configuration" else drawn[:, None], share.shape)
        ends = (
            confidence.of_errors(share, errors, replicates, total)
            if replicates > 1
            else confidence.of_counts(share * total, total)
        )
        for end, values in zip(SIDES, ends, strict=True):
            side = "lower" if end == "low" else "upper"
            builder.add(f"{name}_{end}", dims, values, f"{words}, {side} end of the 95 % confidence interval")
    known = None
    if builder.m.limits.errors:
        quantiles, errors = (found[name][:, count:] for name in ("quantile", "quantile_standard_error"))
        known = capability(limits, quantiles, errors, found["quantile_resolution"], samples)
    nothing = np.full(found["outside_quantity"].shape, np.nan)
    for name, words in (("cp", "capability Cp"), ("cpk", "capability Cpk")):
        builder.add(name, per, nothing if known is None else getattr(known, name), words)
        error = nothing if known is None else getattr(known, f"{name}_error")
        builder.add(f"{name}_standard_error", per, error, f"standard error of {name}")
    if np.isfinite(builder.m.limits.probability):
        builder.attrs["required_yield"] = builder.m.limits.probability


def _of_path(
    builder: Builder, m: Mechanism, at: Nominal, samples: int, seed: int, law: str | None, limits: Floats
) -> None:
    """Yields over all configurations, and the repeatability at each."""
    value, error = repeatability(m, at, samples, seed, law)
    words = "repeatability: mean and three standard deviations of the distance from the barycentre"
    builder.add("repeatability", "configuration", value, words, "length")
    words = "standard error of the repeatability"
    builder.add("repeatability_standard_error", "configuration", error, words, "length")
    known = m.limits.errors and np.isfinite(at.poses).all()
    found = yields(m, at, samples, seed, law, limits) if known else Yields(0, 0, 0, 0)
    for name, inside, count, words in (
        ("yield_path", found.path, found.path_samples, "offsets drawn anew at each"),
        ("yield_specimen", found.specimen, found.specimen_samples, "wherever the play lies"),
    ):
        share = np.array(inside / count if count else np.nan)
        words = f"share of the specimens within the limits at all configurations, {words}"
        builder.add(name, (), share, words)
        ends = confidence.of_counts(np.array(inside if count else np.nan), np.array(float(count)))
        for side, end in zip(SIDES, ends, strict=True):
            which = "lower" if side == "low" else "upper"
            builder.add(f"{name}_{side}", (), end, f"{words}, {which} end of the 95 % confidence interval")


def _indices(builder: Builder, found: list[Indices]) -> None:
    per = ("configuration", "source", "quantity")
    for name, words in (("first", "alone"), ("total", "and of all that it does together with others")):
        words = f"Sobol' index: share of the source in the variance, {words}"
        builder.add(f"sobol_{name}", per, np.array([getattr(of, name) for of in found]), words)
        errors = np.array([getattr(of, f"{name}_error") for of in found])
        builder.add(f"sobol_{name}_standard_error", per, errors, f"standard error of sobol_{name}")
    words = "share of the points that the indices leave out, because a specimen has no pose"
    builder.add("sobol_left_out", "configuration", np.array([of.left_out for of in found]), words)
    sources = builder.m.sources
    named = {s: ", ".join(sources[other] for other in group) for group in groups(builder.m) for s in group}
    labels = np.array([named[s] for s in range(len(sources))], dtype=str)
    builder.coords["sobol_group"] = Variable(("source",), labels, "", "sources that are drawn together")


def _assembly(builder: Builder, found: Random, count: int, m: Mechanism) -> None:
    """The further results of over-constrained and elastic mechanisms; `count` quantiles are asked for."""
    words = "clearance scale factor required for assembly without strain, quantile"
    factor = found["clearance_factor"][:, :count]
    builder.add("clearance_factor_quantile", ("configuration", "probability"), factor, words)
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
        builder.add("member_force_quantile", forces, found["force"][:, :count, along], words, "force")
