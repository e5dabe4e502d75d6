"""What the results of `random` have of specimens: moments, quantiles, shares beyond limits, yields."""

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.cluster import Here, Workers
from jointplay.basics import confidence
from jointplay.basics.arrays import Floats
from jointplay.core.answers import Random
from jointplay.model.mechanism import Mechanism
from jointplay.result import SIDES, STATUSES, ResultBuilder, Variable
from jointplay.result.verdict import add_limits

from .capability import capability
from .indices import Indices, groups
from .nominal import Nominal
from .yields import Yields, repeatability, yields

#: independent sets of Sobol points
REPLICATES = 16


def add_moments(builder: ResultBuilder, found: Random) -> None:
    """Mean, standard deviation and covariance, exact and to first order, with the contribution of every source."""
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


def add_distribution(builder: ResultBuilder, found: Random, levels: NDArray[np.float64], m: Mechanism) -> None:
    """Quantiles, histograms, extremes, interferences and outcomes."""
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
    builder.add("histogram", (*per, "bin"), found["histogram"], "specimens in the bin")
    builder.add("edge", (*per, "bin_edge"), found["edges"], "edges of the bins", "quantity")
    if "size" in m.source_kinds:
        words = "share of the specimens in which hole and pin have interference, and no play"
        builder.add("interference", ("configuration", "source"), found["interference"], words)
    builder.add("failures", ("configuration", "outcome"), found["failures"], "specimens by outcome")


def add_shares(builder: ResultBuilder, found: Random, limits: Floats, samples: int, count: int, sampling: str) -> None:
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


def add_yields(
    builder: ResultBuilder,
    m: Mechanism,
    at: Nominal,
    samples: int,
    seed: int,
    law: str | None,
    limits: Floats,
    workers: Here | Workers,
) -> None:
    """Yields over all configurations, and the repeatability at each."""
    value, error = repeatability(m, at, samples, seed, law)
    words = "repeatability: mean and three standard deviations of the distance from the barycentre"
    builder.add("repeatability", "configuration", value, words, "length")
    words = "standard error of the repeatability"
    builder.add("repeatability_standard_error", "configuration", error, words, "length")
    known = m.limits.errors and np.isfinite(at.poses).all()
    found = yields(m, at, samples, seed, law, limits, workers) if known else Yields(0, 0, 0, 0)
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


def add_indices(builder: ResultBuilder, found: list[Indices]) -> None:
    """Sobol\' indices of every source."""
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


def add_assembly(builder: ResultBuilder, found: Random, count: int, m: Mechanism) -> None:
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
