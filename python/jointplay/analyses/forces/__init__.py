"""`forces`: what play and tolerances make of the forces of the drives and of the reactions at the joints.

force(u) on the exact closure, see `statics`, at offsets u: given, where the load pushes the joints, random, or the ones
that make it least and largest, see `extremes`. To first order force = nominal force + slope . u.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.analyses.loaded import loads_of, require_loads
from jointplay.analyses.nominal import (
    ON_CLOSURE,
    SINGULAR,
    Nominal,
    Progress,
    batched,
    finished,
    nominal,
    report,
    without_singular,
)
from jointplay.analyses.offsets import Offsets, parameters
from jointplay.analyses.questions import options_of
from jointplay.analyses.recorded import recorded
from jointplay.analyses.several import of_each
from jointplay.basics import confidence
from jointplay.basics.arrays import Floats, Ints
from jointplay.basics.typed import typed
from jointplay.errors import InputError, in_range, listed, shown
from jointplay.model.gaps import attributes
from jointplay.model.mechanism import Mechanism
from jointplay.questions import asked_by, require_known
from jointplay.result import ROUNDING, Labels, Result, ResultBuilder, to_dataset
from jointplay.result.verdict import room

from .extremes import extremes
from .statics import Balances, chosen

if TYPE_CHECKING:
    import xarray as xr

SAMPLES, MOST_SAMPLES = 4096, 10**7
#: of the specimens between the ends that are told where nobody says how many
PROBABILITY = 0.9973
#: configurations at a time
TOGETHER = 16


@typed
def forces(
    m: Mechanism,
    question: str = "worst",
    *,
    of: str | Sequence[str] | None = None,
    offsets: Offsets | xr.DataArray | xr.Dataset | None = None,
    deviations: Mapping[str, Any] | None = None,
    samples: int = SAMPLES,
    seed: int = 0,
    probability: float | None = None,
) -> xr.Dataset:
    """Find what play and tolerances make of drive forces and of reactions, and judge them by the limits of the file.

    Parameters
    ----------
    m : Mechanism
        Determinate, with loads.
    question : {"worst", "loaded", "random", "given"}
        At which offsets: those within clearances and tolerances that make a force least and largest; where the load
        pushes every joint; of random specimens, whose offsets scatter; or at `offsets`.
    of : str or sequence of str, optional
        Which forces: ``drives.theta1`` is the moment or force of a drive along its coordinate, ``joints.J1`` the size
        of the reaction force at a joint. All of them if left out.
    offsets, deviations : optional
        given: as of `given`.
    samples, seed : int
        random: how many specimens, and which.
    probability : float, optional
        random: the share of the specimens that has to keep to the limits, and that lies between the two values of
        `force`, as many below as above; that of the file if left out, else 0.9973, with which no share is required.

    Returns
    -------
    xarray.Dataset
        Over `configuration` and `quantity`, which are the forces: `nominal_force`; `force`, of worst and random the
        lowest and the highest over `side`; `force_first_order` (not of random); `contribution` per source (parts of the
        difference from the nominal force, to first order; of random parts of the variance); `limit`, `limit_met`,
        `margin`, and with limits `limit_used` (1 is the limit), the largest of which is `used`. Of given and loaded
        `offset`; of worst `worst_offset` (what attains each, to be given to `given` or `forces`) and `unsettled`
        (ascents that reached their number of steps); of random `force_mean`, `force_std`, `force_std_first_order`,
        `failures` (share of the specimens without a regular pose) and, with limits, `outside` and `outside_quantity`
        (share of the specimens beyond), with `outside_low` and `outside_high`, the ends of the 95 % confidence
        interval. `nominal`, `status`.

        Forces are those of equilibrium without friction. Those of worst are found by local search from several starts;
        the least size of a reaction that may vanish to some thousandths of its range.

    Raises
    ------
    InputError
        When nothing loads the mechanism; when it is over-constrained or elastic, so that its pose does not decide its
        forces; when there is no such force, question, share or number of samples.

    Examples
    --------
    >>> import jointplay as jp
    >>> press = jp.loads(jp.examples.text("slider-crank"))
    >>> torque = jp.forces(press, of=["drives.theta"])
    >>> torque.nominal_force[3].values.round(1), torque.force[3].values.round(1)
    (array([-19986.8]), array([[-20008.9, -19964.3]]))
    """
    return to_dataset(
        compute(
            m,
            question,
            of=of,
            offsets=offsets,
            deviations=deviations,
            samples=samples,
            seed=seed,
            probability=probability,
        )
    )


@recorded
def compute(
    m: Mechanism,
    question: str = "worst",
    *,
    of: str | Sequence[str] | None = None,
    offsets: Offsets | xr.DataArray | xr.Dataset | None = None,
    deviations: Mapping[str, Any] | None = None,
    samples: int = SAMPLES,
    seed: int = 0,
    probability: float | None = None,
    at: Nominal | None = None,
    progress: Progress | None = None,
) -> Result:
    """The light form of `forces`."""
    require_known(question, asked_by("forces"))
    for name, value in (("offsets", offsets), ("deviations", deviations)):
        if value is not None and name not in options_of(question):
            owners = [one for one in asked_by("forces") if name in options_of(one)]
            raise InputError(f"goes with the question {listed(owners)}, not with {question}", key=name)
    if probability is not None and question != "random":
        raise InputError(f"goes with the question random; {question} has no shares", key="probability")
    if probability is not None and not 0.0 < probability < 1.0:
        raise InputError(f"a share between 0 and 1 is needed, not {shown(probability)}", key="probability")
    in_range(samples, "samples", "a number of specimens", 2, MOST_SAMPLES)
    # No force depends on which point is the output.
    one = m.only(output=m.outputs[0]) if m.outputs else m
    return _of_case(
        one,
        question,
        of=None if of is None else (of,) if isinstance(of, str) else tuple(of),
        offsets=offsets,
        deviations=deviations,
        samples=int(samples),
        seed=int(seed),
        probability=probability,
        at=at,
        progress=progress,
    )


@typed
def limited(m: Mechanism, *, of: str | Sequence[str] | None = None) -> xr.Dataset:
    """What `allow`, maps and sweeps ask: forces in the worst case, of a file that limits some."""
    return to_dataset(compute_limited(m, of=of))


def compute_limited(
    m: Mechanism,
    *,
    of: str | Sequence[str] | None = None,
    at: Nominal | None = None,
    progress: Progress | None = None,
) -> Result:
    """The light form of `limited`."""
    if not m.limits.forces:
        problem = "the file limits no force: say [limits] with drive_torques or reactions"
        raise InputError(problem, file=m.file, key="limits")
    return compute(m, of=of, at=at, progress=progress)


def is_judged(m: Mechanism) -> bool:
    """Whether the file limits forces, and they can be found."""
    return bool(m.limits.forces) and m.has_loads and m.core.isostatic


def check(m: Mechanism) -> None:
    """Refuse a mechanism whose pose does not decide its forces, or on which nothing acts."""
    if not m.core.isostatic:
        problem = (
            "redundant or elastic members share the forces, and no pose decides how: `forces` is of determinate"
            " rigid mechanisms; `loaded` has the reactions of this one"
        )
        raise InputError(problem, file=m.file, key="joints")
    require_loads(m)


@of_each(lambda _: True, check)
def _of_case(
    m: Mechanism,
    question: str,
    *,
    of: tuple[str, ...] | None,
    offsets: Any,
    deviations: Mapping[str, Any] | None,
    samples: int,
    seed: int,
    probability: float | None,
    at: Nominal | None = None,
    progress: Progress | None = None,
) -> Result:
    """The forces in one load case."""
    check(m)
    at = (at or nominal(m)).with_errors
    balances = Balances(m, at, loads_of(m, at))
    asked = _Asked(balances, chosen(balances.named.labels, of, m.file), question)
    match question:
        case "worst":
            return asked.worst(progress)
        case "random":
            return asked.random(samples, seed, probability, progress)
        case "loaded":
            return asked.loaded()
        case _:
            u = parameters(m, len(at), {} if offsets is None else offsets, deviations or {})
            return asked.at_offsets(u, at.status, "Newton's method")


class _Asked:
    """Some forces of a mechanism in one load case."""

    def __init__(self, balances: Balances, columns: Ints, question: str) -> None:
        self.balances, self.columns, self.question = balances, columns, question
        self.m, self.at = balances.m, balances.at
        named = balances.named
        self.named = Labels(*(tuple(np.array(part)[columns].tolist()) for part in (named.labels, named.kinds)))

    @property
    def every(self) -> Ints:
        """All configurations."""
        return np.arange(len(self.at))

    def at_offsets(self, u: Floats, status: Any, how: str) -> Result:
        """Forces at one vector of offsets for every configuration."""
        slopes = self.balances.slopes(self.every, self.balances.zero)[:, self.columns]
        parts = slopes * u[:, None]
        builder, nominal_force = self._begun(len(self.at), f"{how}, {ON_CLOSURE}", **attributes(self.m))
        dims = ("configuration", "quantity")
        force = self.balances.forces(self.every, u)[:, self.columns]
        builder.add("force", dims, force, "force with these offsets", "quantity")
        first = nominal_force + parts.sum(axis=2)
        builder.add("force_first_order", dims, first, "force to first order", "quantity")
        self._blame(builder, parts, "part of the source in the difference from the nominal force, to first order")
        builder.add("offset", ("configuration", "parameter"), u, "offset of the parameter", "parameter")
        self._judge(builder, force, force)
        lost = np.isnan(force).any(axis=1)
        builder.status(np.where(lost & (status == 0), SINGULAR, status))
        return builder.result()

    def loaded(self) -> Result:
        """Forces where the load pushes every joint."""
        found = without_singular(
            self.m.core.loaded(self.at.drives, self.at.poses, True, True, False, loads=self.balances.loads)
        )
        how = "steps until offsets and reactions agree"
        return self.at_offsets(found["offset"], self.at.worse(found["status"]), how)

    def worst(self, progress: Progress | None) -> Result:
        """The least and the largest forces."""

        def run(part: slice) -> dict[str, Any]:
            found = extremes(self.balances, self.every[part], self.columns)
            lost = np.isnan(found.force).any(axis=(1, 2))
            return {**vars(found), "status": np.where(lost, SINGULAR, 0)}

        found, done = batched(len(self.at), TOGETHER, run, progress)
        how = f"steps of Frank and Wolfe from the best of several starts, {ON_CLOSURE}"
        builder, _ = self._begun(done, how)
        dims = ("configuration", "quantity", "side")
        builder.add("force", dims, found["force"], "lowest and highest force", "quantity")
        words = "lowest and highest force to first order"
        builder.add("force_first_order", dims, found["first_order"], words, "quantity")
        self._blame(
            builder, found["parts"], "part of the source in the difference from the nominal force, to first order"
        )
        words = "offsets that attain the force"
        builder.add("worst_offset", (*dims, "parameter"), found["offset"], words, "parameter")
        builder.add("unsettled", "configuration", found["unsettled"], "ascents that reached their number of steps")
        self._judge(builder, *np.moveaxis(found["force"], -1, 0))
        builder.status(self.at.first(done).worse(found["status"]))
        return finished(builder, done, len(self.at))

    def random(self, samples: int, seed: int, probability: float | None, progress: Progress | None) -> Result:
        """Forces of random specimens."""
        m, columns = self.m, self.columns
        drawn = m.core.specimens(samples, seed, None, "plain")
        _, covariance = m.core.parameter_moments()
        required = m.limits.probability if probability is None else probability
        share = PROBABILITY if math.isnan(required) else required
        low, high = self._bounds().T

        def run(part: slice) -> dict[str, Any]:
            (k,) = self.every[part]
            force = self.balances.forces(np.full(samples, k), drawn)[:, columns]
            known = np.asarray(np.isfinite(force).all(axis=1))
            slopes = self.balances.slopes(self.every[part], self.balances.zero[:1])[0, columns]
            slack = ROUNDING * np.abs(force).max(axis=0, initial=0.0, where=known[:, None])
            beyond = (force < low - slack) | (force > high + slack) | ~known[:, None]
            own = force[known] if known.any() else np.full((1, len(columns)), np.nan)
            ends = np.quantile(own, [(1.0 - share) / 2.0, (1.0 + share) / 2.0], axis=0).T
            row = {
                "force": ends,
                "mean": own.mean(axis=0),
                "std": own.std(axis=0),
                "parts": slopes * (slopes @ covariance),
                "failures": np.array(1.0 - known.mean()),
                "count": np.array(beyond.any(axis=1).sum()),
                "each": beyond.mean(axis=0),
            }
            return {**{name: values[None] for name, values in row.items()}, "status": self.at.status[part]}

        found, done = batched(len(self.at), 1, run, progress)
        builder, _ = self._begun(done, f"samples, {ON_CLOSURE}", samples=samples, seed=seed, probability=share)
        dims = ("configuration", "quantity")
        words = f"lowest and highest force, between which {100 * share:g} % of the specimens lie"
        builder.add("force", (*dims, "side"), found["force"], words, "quantity")
        builder.add("force_mean", dims, found["mean"], "mean of the force", "quantity")
        builder.add("force_std", dims, found["std"], "standard deviation of the force", "quantity")
        std = np.sqrt(found["parts"].sum(axis=2))
        builder.add("force_std_first_order", dims, std, "standard deviation of the force to first order", "quantity")
        self._blame(builder, found["parts"], "part of the source in the variance of the force, to first order", power=2)
        builder.add("failures", "configuration", found["failures"], "share of the specimens without a regular pose")
        self._judge(builder, *np.moveaxis(found["force"], -1, 0))
        unknown = np.asarray(found["failures"] == 1.0)
        if np.isfinite(self._bounds()).any():
            if not math.isnan(required):
                builder.attrs["required_yield"] = required
            count = np.where(unknown, np.nan, found["count"])
            ends = confidence.of_counts(count, np.array(float(samples)))
            for name, values in (("outside", count / samples), ("outside_low", ends[0]), ("outside_high", ends[1])):
                words = "share of the specimens beyond a limit, or without a regular pose"
                builder.add(name, "configuration", values, words + ", end of the interval" * (name != "outside"))
            each = np.where(np.isfinite(self._bounds()).any(axis=1) & ~unknown[:, None], found["each"], np.nan)
            builder.add("outside_quantity", dims, each, "share of the specimens beyond the limits of the force")
        builder.status(found["status"])
        return finished(builder, done, len(self.at))

    def _begun(self, done: int, how: str, **attrs: str | int | float) -> tuple[ResultBuilder, Floats]:
        """A result with the nominal forces of the first configurations."""
        builder = report(self.m, "forces", self.at.first(done), asked=self.question, obtained=how, **attrs)
        builder.axes["quantity"] = self.named
        force = self.balances.nominal()[:done, self.columns]
        builder.add("nominal_force", ("configuration", "quantity"), force, "force without play", "quantity")
        return builder, force

    def _blame(self, builder: ResultBuilder, parts: Floats, words: str, power: int = 1) -> None:
        """Add parts of the parameters, which are last, as those of the sources."""
        owners = self.m.parameter_source[:, None] == np.arange(len(self.m.sources))
        dims = (
            ("configuration", "quantity", "side", "source")
            if parts.ndim == 4
            else ("configuration", "quantity", "source")
        )
        builder.add("contribution", dims, parts @ owners.astype(float), words, "quantity", power)

    def _bounds(self) -> Floats:
        """Lowest and highest acceptable force, infinite where there is none, shape (force, side)."""
        every, free = self.m.limits.forces, (-math.inf, math.inf)
        return np.array([every.get(name, free) for name in self.named.labels])

    def _judge(self, builder: ResultBuilder, lowest: Floats, highest: Floats) -> None:
        """Add the limits, and whether and by how much they are kept."""
        bounds = self._bounds()
        margin = room(bounds, lowest, highest)
        limited = np.isfinite(bounds).any(axis=1)
        slack = ROUNDING * np.abs(np.where(np.isfinite(bounds), bounds, 0.0)).max(axis=1)
        dims = ("configuration", "quantity")
        words = "lowest and highest acceptable force"
        builder.add("limit", ("quantity", "side"), np.where(np.isfinite(bounds), bounds, np.nan), words, "quantity")
        builder.add("limit_met", dims, ~limited | (margin >= -slack), "whether the force keeps to its limits")
        words = "how far the force is from its limits, negative where it is beyond one"
        builder.add("margin", dims, margin, words, "quantity")
        if limited.any():
            each = _used(bounds, lowest, highest)
            builder.add("limit_used", dims, each, "part of the limits that is used; 1 is the limit")
            words = "used part of a force limit"
            builder.add("used", "configuration", each[:, limited].max(axis=1), words)


def _used(bounds: Floats, lowest: Floats, highest: Floats) -> Floats:
    """What forces use of their limits, of two of them from the middle on; nan where there is none."""
    low, high = bounds.T
    # Reactions have no lowest value, and count from zero.
    middle = np.add(low, high, out=np.zeros_like(high), where=np.isfinite(low)) / 2.0
    far, half = np.maximum(highest - middle, middle - lowest), high - middle
    # Limits of nothing are kept by nothing else.
    parts = np.where(half > 0.0, far / np.where(half > 0.0, half, 1.0), np.where(far > 0.0, np.inf, far))
    return np.where(np.isfinite(high), parts, np.nan)
