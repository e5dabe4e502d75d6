"""`random`: how the error scatters from specimen to specimen.

First order: covariance = sum over sources of A_s Sigma_s A_s'. Beside it a seeded Monte Carlo on the non-linear
closure. In an over-constrained mechanism offsets scatter under the condition of compatibility, A delta = b of the
specimen; specimens whose clearances cannot fulfil it are strained, or cannot be assembled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NotRequired, cast

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.cluster import Here, Workers, with_workers
from jointplay.basics.arrays import Floats, Ints
from jointplay.basics.typed import typed
from jointplay.core.answers import Random
from jointplay.core.compile import LOOSE
from jointplay.errors import InputError, in_range, listed, not_known, shown
from jointplay.model.mechanism import Mechanism
from jointplay.questions import SAMPLES
from jointplay.result import ROUNDING, STATUSES, Result, ResultBuilder, axes_of, to_dataset

from . import pressed
from .capability import LEVELS
from .indices import indices as find_indices
from .indices import require_determinate_scatter
from .loaded import require_loads
from .nominal import ON_CLOSURE, Interrupted, Nominal, Progress, batched, finished, nominal, report
from .recorded import recorded
from .running import add_contact, motion_of, speeds
from .scatter import REPLICATES, add_assembly, add_distribution, add_indices, add_moments, add_shares, add_yields
from .several import of_each, share
from .tails import require_rare, search_rare
from .yields import within_limits

if TYPE_CHECKING:
    import xarray as xr

    from jointplay.analyses.cluster import Scheduler

PROBABILITIES = (0.5, 0.9, 0.95, 0.99, 0.999)
LAWS = ("uniform", "boundary", "normal")
SCATTERED, LOADED = CONTACTS = ("scattered", "loaded")
SAMPLINGS = ("sobol", "plain")
MOST_SAMPLES = 10**12
MOST_PROBABILITIES = 1000
#: with specimens that are kept, which are chosen among all
MOST_AMONG = 2**22
#: more than any machine has cores
MOST_THREADS = 1024


@typed
def random(
    m: Mechanism,
    samples: int = SAMPLES,
    seed: int = 0,
    law: str | None = None,
    *,
    contact: str | None = None,
    sampling: str = "sobol",
    probabilities: Sequence[float] = PROBABILITIES,
    indices: bool = False,
    threads: int = 0,
    rare: bool = False,
    keep: int = 0,
    keep_outside: bool = False,
    scheduler: Scheduler | None = None,
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
    contact : {"scattered", "loaded"}, optional
        Whether clearances scatter by their laws, or the load of the file decides where they are in every specimen, so
        that only tolerances and drive errors scatter. If left out: what `limits.contact` of the file says; where it
        says nothing they scatter, and of a file with limits and loads the shares outside are found both ways.
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
        determinate mechanism with limits. Under a load it takes a hundred times as long.
    keep : int
        How many specimens of each configuration are part of the result: the first ones.
    keep_outside : bool
        Whether these are the first ones that are beyond a limit or have no pose.
    scheduler : distributed.Client or str, optional
        A Dask client, or the address of a scheduler, whose workers are asked in place of this process, configuration by
        configuration. The result has the same bits; the attribute `retried` says how many tasks had to be begun again,
        if any.

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
        (predicted capability by quantiles) with `_standard_error`. Where both contacts count, `outside_loaded`,
        `outside_loaded_low` and `outside_loaded_high` as well: the share where the load decides the offsets of the same
        specimens, of several load cases that with the largest share, `outside_loaded_case`. It is counted in the first
        16,384 specimens at configurations where these decide whether a required yield is met, elsewhere in all (the
        most are the attribute `samples_loaded`);
        with `rare`, `outside_loaded_method` says how it was found. Of a machine that runs `contact_loaded`: whether
        contact follows there; where it is not asked beside another one, `contact_rate`, `contact` and `transit_time`
        as of `loaded`.
        The attribute `contact` says how all other variables were found, where the file has loads.

        Of a determinate mechanism whose offsets scatter: `repeatability` of the output point (ISO 9283) with
        `_standard_error`; over all configurations `yield_path` (share of the specimens that keep to the limits at
        each, with offsets drawn anew at each; it falls with the number of configurations) and `yield_specimen` (share
        of those that keep to them wherever the play lies), with `_low` and `_high`.

        With `keep`, over `specimen` as well: `specimen_error`, `specimen_offset` (value of every parameter; `given`
        reproduces the error from it), `specimen_status` and `specimen_number` (which of the samples it is; -1 where
        there are no more). In the same order for all configurations, unless `keep_outside` selects.

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
        shall be at their boundary, where they cannot be compatible; when `indices` are asked for of an over-constrained
        mechanism or with offsets that the load decides, or rare specimens are to be searched for of an over-constrained
        mechanism; when specimens outside are to be kept of a file without limits; when the scheduler does not answer,
        or a worker is not like this process.

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
            keep=keep,
            keep_outside=keep_outside,
            scheduler=scheduler,
        )
    )


@recorded
@with_workers
def compute(
    m: Mechanism,
    samples: int = SAMPLES,
    seed: int = 0,
    law: str | None = None,
    *,
    contact: str | None = None,
    sampling: str = "sobol",
    probabilities: Sequence[float] = PROBABILITIES,
    indices: bool = False,
    threads: int = 0,
    rare: bool = False,
    keep: int = 0,
    keep_outside: bool = False,
    at: Nominal | None = None,
    progress: Progress | None = None,
    path: bool = True,
    follows: bool = True,
    few: int = pressed.FEW,
    scheduler: Any = None,
) -> Result:
    """The light form of `random`.

    `path` asks for what is of all configurations together or of one specimen, `follows` for whether contact follows
    the reactions of a machine that runs, `few` says how many specimens are drawn under loads at first.
    """
    if rare:
        require_rare(m)
    both = contact is None and pressed.counts_too(m)
    own = contact or m.limits.contact or SCATTERED
    common: dict[str, Any] = {"sampling": sampling, "threads": threads, "rare": rare, "scheduler": scheduler}
    common["follows"] = follows
    whole = 1 + len(pressed.cases(m)) if both else 1
    result = _of_contact(
        m,
        samples,
        seed,
        law,
        contact=own,
        probabilities=probabilities,
        indices=indices,
        at=at,
        progress=None if progress is None else share(progress, 0, whole),
        path=path,
        kept=_kept(m, samples, keep, keep_outside),
        **common,
    )
    if m.has_loads:
        result = replace(result, attrs={**result.attrs, "contact": own})
    if not both:
        return result

    def ask(part: Mechanism, place: Nominal | None, count: int, tell: Progress | None) -> Result:
        return _of_contact(part, count, seed, law, contact=LOADED, at=place, progress=tell, path=False, **common)

    try:
        return pressed.beside(result, m, pressed.in_cases(m, at, samples, ask, progress, few))
    except KeyboardInterrupt:
        words = "interrupted before the shares outside under the load"
        raise Interrupted(replace(result, attrs={**result.attrs, "incomplete": words})) from None


@of_each(lambda given: given["contact"] == LOADED)
def _of_contact(
    m: Mechanism,
    samples: int,
    seed: int,
    law: str | None = None,
    *,
    contact: str,
    sampling: str,
    probabilities: Sequence[float] = (),
    indices: bool = False,
    threads: int = 0,
    rare: bool = False,
    at: Nominal | None = None,
    progress: Progress | None = None,
    path: bool = True,
    follows: bool = True,
    kept: tuple[int, bool] = (0, False),
    scheduler: Any = None,
) -> Result:
    """The scatter where clearances scatter, or where the load decides where they are."""
    workers: Here | Workers = scheduler
    levels = checked(samples, seed, law, probabilities, sampling)
    # Numbers of numpy overflow where seeds are made of it.
    samples, seed = int(samples), int(seed)
    in_range(threads, "threads", "a number of threads", 0, MOST_THREADS)
    is_loaded = _is_loaded(m, contact)
    if indices:
        require_determinate_scatter(m, is_loaded)
    at = (at or nominal(m)).with_errors
    motion = motion_of(m, at) if is_loaded else None
    if not is_loaded:
        _require_room(m, law, at)
    limits = m.limits.bounds(m.quantities)
    # What is rounding is beyond no limit.
    slack = ROUNDING * np.array([m.length if kind == "length" else 1.0 for kind in axes_of(m)["quantity"].kinds])
    widened = limits + np.outer(slack, (-1.0, 1.0))
    more = np.concatenate([levels, LEVELS]) if m.limits.errors else levels

    drawn = samples
    draws = _Draws(m, samples, seed, more, widened, law, threads, sampling, is_loaded, *kept)
    # One configuration a call, so that the bar moves.
    answers = workers.each(_Draws.scatter, (draws,), ((k, at.at(k)) for k in range(len(at))))

    def run(_: slice) -> DrawnAndKept:
        nonlocal drawn
        if drawn < samples:
            raise KeyboardInterrupt
        found = next(answers)
        drawn = int(found["failures"].sum())
        return found

    found, done = batched(len(at), 1, run, progress)
    count, at = len(at), at.first(done)
    how = f"samples, {ON_CLOSURE}"
    builder = report(m, "random", at, obtained=how, samples=samples, seed=seed, law=law or "as in the file")
    builder.attrs["sampling"] = points(m, samples, law, sampling)
    if is_loaded:
        builder.attrs |= {"contact": contact, **speeds(m)}
    if motion is not None and follows:
        add_contact(m, builder, at, motion.first(done))
    add_moments(builder, found)
    add_distribution(builder, found, levels, m)
    add_shares(builder, found, limits, samples, len(levels), sampling)
    if kept[0]:
        _add_specimens(builder, found)
    if "clearance_factor" in found:
        add_assembly(builder, found, len(levels), m)
    builder.status(at.worse(found["status"]))
    whole = done == count and drawn == samples
    waiting = "rare specimens were searched for at all configurations"
    try:
        if rare and drawn == samples:
            search_rare(builder, m, at, found["outside"] * samples, seed, law, widened, is_loaded, workers)
        waiting = "the Sobol' indices"
        if indices and whole:
            add_indices(builder, find_indices(m, at, samples, seed, law, sampling, slack, workers))
        waiting = "the yields over all configurations"
        # Where nothing is off there is nothing to draw.
        if path and whole and not is_loaded and m.core.isostatic and m.parameters:
            add_yields(builder, m, at, samples, seed, law, widened, workers)
    except KeyboardInterrupt:
        builder.attrs["incomplete"] = f"interrupted before {waiting}"
        raise Interrupted(builder.result()) from None
    unfinished = f", the last with {drawn:,} of {samples:,} samples" if drawn < samples else ""
    return finished(builder, done, count, unfinished)


class DrawnAndKept(Random):
    """The core's answer, with the numbers of the specimens that are kept."""

    kept_number: NotRequired[Ints]


@dataclass(frozen=True)
class _Draws:
    """What is drawn at every configuration, with the same random numbers."""

    m: Mechanism
    samples: int
    seed: int
    probabilities: Floats
    limits: Floats
    law: str | None
    threads: int
    sampling: str
    is_loaded: bool
    keep: int = 0
    keep_outside: bool = False

    def scatter(self, place: tuple[int, Nominal]) -> DrawnAndKept:
        """The scatter at a configuration with this number; after Ctrl-C that of the samples until then."""
        k, at = place
        own = self.m.running_under(k, at.drives, at.poses) if self.is_loaded else self.m
        found = own.core.random(
            at.drives,
            at.poses,
            self.samples,
            self.seed,
            self.probabilities,
            self.limits,
            self.law,
            self.threads,
            loaded=self.is_loaded,
            partly=True,
            sampling=self.sampling,
            keep=self.keep > 0,
        )
        return self._only_kept(found) if self.keep else cast("DrawnAndKept", found)

    def _only_kept(self, found: Random) -> DrawnAndKept:
        """The same with the specimens that are kept, along a dimension behind the configuration."""
        errors, status = found["kept_errors"], found["kept_status"]
        chosen = np.arange(len(errors))
        if self.keep_outside:
            chosen = chosen[~within_limits(self.m, errors, self.limits)]
        chosen = chosen[: self.keep]
        number = np.full(self.keep, -1)
        number[: len(chosen)] = chosen
        there = number >= 0
        return {
            **found,
            "kept_number": number[None],
            "kept_errors": np.where(there[:, None], errors[number], np.nan)[None],
            "kept_parameters": np.where(there[:, None], found["kept_parameters"][number], np.nan)[None],
            "kept_status": np.where(there, status[number], 0).astype(status.dtype)[None],
        }


def _kept(m: Mechanism, samples: int, keep: int, keep_outside: bool) -> tuple[int, bool]:
    """How many specimens are kept, and which, after a look at what was asked."""
    in_range(keep, "keep", "a number of specimens", 0, samples)
    if keep:
        in_range(samples, "samples", "a number of samples of which some are kept", 2, MOST_AMONG)
    if keep_outside and not keep:
        raise InputError("says which specimens are kept; keep says how many", key="keep_outside")
    if keep_outside and not any(part.limits.errors for part in m.every_part):
        raise InputError("there is no limit to be outside of: say [limits]", file=m.file, key="keep_outside")
    return int(keep), keep_outside


def _add_specimens(builder: ResultBuilder, found: DrawnAndKept) -> None:
    """Add the specimens that were kept."""
    count = found["kept_errors"].shape[1]
    builder.labels("specimen", np.arange(count), "number among the specimens that are kept")
    per = ("configuration", "specimen")
    words = "which of the samples the specimen is; -1: there are no more"
    builder.add("specimen_number", per, found["kept_number"], words)
    builder.add("specimen_error", (*per, "component"), found["kept_errors"], "error of the specimen", "component")
    words = "value of the parameter in the specimen"
    builder.add("specimen_offset", (*per, "parameter"), found["kept_parameters"], words, "parameter")
    outcomes = np.where(found["kept_number"] < 0, "", STATUSES[found["kept_status"]])
    builder.add("specimen_status", per, outcomes, "outcome of the specimen; empty: none")


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
    if contact == LOADED:
        require_loads(m)
    return contact == LOADED


def _require_room(m: Mechanism, law: str | None, at: Nominal) -> None:
    """Refuse clearances at their boundary where they must be compatible with others."""
    laws = [law or source.spec["law"] for source in m.compiled_sources]
    kinds = zip(laws, m.source_kinds, strict=True)
    if not any(law == "boundary" and kind in LOOSE for law, kind in kinds):
        return
    tied = [s for s in m.core.tied(at.drives, at.poses) if laws[s] == "boundary"]
    if tied:
        names = listed(m.sources[s] for s in tied)
        problem = (
            f"law 'boundary' is not possible for {names}: these clearances must fulfil compatibility in an"
            " over-constrained mechanism; valid there: uniform, normal"
        )
        raise InputError(problem, file=m.file, key="law")
