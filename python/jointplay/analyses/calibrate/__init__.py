"""`calibrate`: the deviations of one built machine, from readings at known drive values.

    reading = h(drives, load; deviations) + frame + play + noise

with the statistics of the file as priors, h on the exact loop closure, and the play by its covariance, or where a load
presses it. See `system` for the equations, `fit` for the steps, `unknowns` for the priors.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.nominal import Nominal, Progress, at_drives, nominal
from jointplay.analyses.readings import FRAME_COLUMNS, Readings, by_frame_of, readings, require_whole
from jointplay.analyses.readings.differences import errors_of, slopes_at, steps_of
from jointplay.analyses.recorded import recorded
from jointplay.basics.arrays import Flags, Floats
from jointplay.basics.typed import typed
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError, in_range, not_known, shown
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, ResultBuilder, Variable, to_dataset
from jointplay.result.build import Labels

from .fit import FitOutcome, Fitter
from .misread import require_own
from .system import OF_DIFFERENCES, Combination, combinations
from .unknowns import Unknowns, unknowns_of
from .written import as_built

__all__ = ["as_built", "calibrate", "compute", "holds"]

if TYPE_CHECKING:
    import xarray as xr

KNOWN, UNKNOWN = FRAMES = ("known", "unknown")
SCATTERED, LOADED = CONTACTS = ("scattered", "loaded")
#: probability of a larger, or of a smaller, sum of squares from which on the fit is doubted
DOUBT = 1e-3
#: share of the rows that may be held out
MOST_HELD_OUT = 0.5
#: specimens, and configurations, from which the size of the error that is left is taken
SPECIMENS, CONFIGURATIONS = 2000, 100
#: how often the error that is left is not exceeded
LEVEL = 0.95


@typed
def calibrate(
    m: Mechanism,
    measured: str | os.PathLike[str] | Mapping[str, Any] | Any,
    *,
    sigma: str | Mapping[str, float] | None = None,
    free: Mapping[str, Any] | Sequence[str] | None = None,
    fix: Sequence[str] | None = None,
    frame: str = KNOWN,
    zeroed: Sequence[str] | None = None,
    sizes: bool = False,
    contact: str | None = None,
    hold_out: float = 0.0,
    seed: int = 0,
) -> xr.Dataset:
    """Find the deviations of one built machine from readings at known drive values.

    Parameters
    ----------
    m : Mechanism
        With tolerances: they say what is unknown, and how far from nominal it may be.
    measured : path or mapping
        A table, or columns by name: drive values, or `configuration`; what was measured, such as ``x [mm]``,
        ``jaw.y [um]``, ``distance:A-B`` or ``dial:tip:z``; perhaps `load_case`, `approach`, ``sigma_x``.
    sigma : mapping or "auto", optional
        Standard deviations of single readings in units of the file, by column, component, ``length`` or ``angle``; or
        those of readings that are repeated within an approach. Not needed where the table has them.
    free : mapping or sequence of str, optional
        What is unknown although it has no tolerance, or whatever its tolerance is: a standard deviation in units of the
        file by name, key or pattern with ``*``, None for no prior.
    fix : sequence of str, optional
        What is held as the file has it.
    frame : {"known", "unknown"}
        Whether the measuring device has the ground axes of the file, or axes of its own that are found as well.
    zeroed : sequence of str, optional
        Columns that count from an unknown zero, such as a dial that was set to zero at the first reading.
    sizes : bool
        Whether the sizes of clearances and backlash are found as well, from readings under loads.
    contact : {"scattered", "loaded"}, optional
        Whether the play scatters from approach to approach, or lies where the loads of the file press it; loaded if
        left out, where something loads the mechanism in the row.
    hold_out : float
        Share of the rows that is not fitted, but predicted.
    seed : int
        Of the choice of these rows.

    Returns
    -------
    xarray.Dataset
        Over `unknown`, the deviations and sizes: `estimate`, `standard_error`, `fitted` (the same where only sums are
        determined: values that fit), `prior_mean`, `prior_sigma`, `share_determined` (part of its prior variance that
        the readings take away), `determined` (whether it is known by itself), `within_tolerance`, and the coordinate
        `unknown_key`, where the file has it; `covariance` over pairs. Over `reading`, labelled by the row of the table,
        and `channel`: `measured`, `residual_before`, `residual_after`, `residual_without` (from what all other readings
        predict), `expected` (standard deviation of noise and play); `left_out` and `held_out`. Over `direction`:
        `singular_value` of the equations scaled by the priors: above one the readings tell more than the tolerances.
        Over `combination` and `unknown`, where some only act together: `together`, the coefficients of what only acts
        together, with `alike` (whether this sum is determined; if not, it changes no reading), `combination_estimate`
        and `combination_standard_error`. Over `configuration` and `component`, and `each_output` where there are
        several: `output_before` and `output_after`, the standard deviation of the output's error that unknowns cause.
        `position_before`, `position_after`, `position_after_95`, over the path; `best_fit_before` and `best_fit_after`
        are what the best fit of a frame, for every output, leaves of the first two. `frame` and `zero`, with standard
        errors, where they are unknown. `status` is ``ok``, ``doubtful`` (the readings do not fit), ``many_missed``
        (more than a tenth of the rows do not) or ``not_settled``; the attributes `chi_square`, `degrees_of_freedom` and
        `p_value` say how well they fit.

    Raises
    ------
    InputError
        When a column, a unit or a value is not valid; when the readings are far from anything that the file allows;
        when nothing tells an unknown without a prior.

    Examples
    --------
    >>> import jointplay as jp
    >>> m = jp.loads(jp.examples.text("five-bar")).with_({"loads": None, "load_cases": None})
    >>> built = jp.given(m, deviations={"left": 0.02, "left_rod": 0.015})
    >>> places = (built.nominal + built.error).sel(component=["x", "y"])
    >>> table = {name: built[name].values for name in built.attrs["drives"].split(", ")}
    >>> table |= {name: places.sel(component=name).values for name in ("x", "y")}
    >>> found = jp.calibrate(m, table, sigma={"length": 0.001})
    >>> "left" in found.unknown
    True
    """
    return to_dataset(
        compute(
            m,
            measured,
            sigma=sigma,
            free=freed(free),
            fix=several(fix),
            frame=frame,
            zeroed=several(zeroed),
            sizes=sizes,
            contact=contact,
            hold_out=hold_out,
            seed=seed,
        )
    )


def several(names: Sequence[str] | None) -> tuple[str, ...]:
    """Names, of which there may be a single one."""
    return (names,) if isinstance(names, str) else tuple(names or ())


def freed(free: Any) -> dict[str, float | None]:
    """Standard deviations by name of what is to be free; None for no prior."""
    if free is None:
        return {}
    if isinstance(free, str):
        return {free: None}
    if not isinstance(free, Mapping):
        return dict.fromkeys(map(str, free))
    for name, value in free.items():
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise InputError(
                f"{shown(value)} is no standard deviation; None says that there is none", key=f"free {name}"
            )
    return dict(free)


@recorded
def compute(
    m: Mechanism,
    measured: Any,
    *,
    sigma: Any = None,
    free: Mapping[str, float | None] | None = None,
    fix: tuple[str, ...] = (),
    frame: str = KNOWN,
    zeroed: tuple[str, ...] = (),
    sizes: bool = False,
    contact: str | None = None,
    hold_out: float = 0.0,
    seed: int = 0,
    progress: Progress | None = None,
) -> Result:
    """The light form of `calibrate`."""
    in_range(seed, "seed", "a seed", 0, 2**64 - 1)
    if not 0.0 <= hold_out <= MOST_HELD_OUT:
        raise InputError(f"{hold_out:g} is not a share of the readings from 0 to {MOST_HELD_OUT:g}", key="hold_out")
    require_whole(m)
    unknowns = unknowns_of(m, free or {}, fix, sizes=sizes)
    table = readings(unknowns.m, measured, sigma)
    options: dict[str, Any] = {"frame": frame, "zeroed": zeroed, "sizes": sizes, "contact": contact}
    fitter = fitter_of(unknowns, table, **options, progress=progress)
    require_own(fitter)
    held = _held_out(len(table), hold_out, seed)
    found = fitter.fit(~held)
    return _Report(m, fitter, found, held).result(frame, contact)


def fitter_of(
    unknowns: Unknowns,
    table: Readings,
    *,
    frame: str,
    zeroed: tuple[str, ...],
    sizes: bool,
    contact: str | None,
    progress: Progress | None = None,
) -> Fitter:
    """What fits a table, with the options of `calibrate`."""
    for value, key, known in ((frame, "frame", FRAMES), (contact or LOADED, "contact", CONTACTS)):
        if value not in known:
            raise InputError(not_known(value, f"a choice of {key}", known), key=key)
    columns = _zeroed(table, zeroed)
    is_unknown, scattered = frame == UNKNOWN, contact == SCATTERED
    fitter = Fitter(unknowns, table, frame=is_unknown, zeroed=columns, scattered=scattered, progress=progress)
    _require_load(fitter, contact, sizes=sizes)
    return fitter


def holds(result: Result) -> bool:
    """Whether the fit can be relied on."""
    return str(result.get("status")) == "ok"


def _zeroed(table: Readings, names: tuple[str, ...]) -> tuple[int, ...]:
    known = [channel.name for channel in table.channels]
    for name in names:
        if name not in known:
            raise InputError(not_known(name, "a measured column", known), key="zeroed")
    return tuple(sorted({known.index(name) for name in names}))


def _require_load(fitter: Fitter, contact: str | None, *, sizes: bool) -> None:
    """Refuse what needs loads where there are none."""
    m = fitter.unknowns.m
    any_acts = any(load.acts for load in fitter.model.loads)
    if contact == LOADED and not any_acts:
        raise InputError("nothing loads the mechanism in any row", file=m.file, key="contact")
    if sizes and not any(load.moves_play for load in fitter.model.loads):
        problem = "sizes follow from readings under loads, or from both sides: a column 'load_case' or 'side'"
        raise InputError(problem, file=m.file, key="sizes")


def _held_out(count: int, share: float, seed: int) -> Flags:
    held = np.zeros(count, dtype=bool)
    chosen = np.random.default_rng(seed).permutation(count)[: round(share * count)]
    held[chosen] = True
    return held


@dataclass(frozen=True, eq=False)
class _Report:
    """What a fit says."""

    m: Mechanism
    fitter: Fitter
    fit: FitOutcome
    held: Flags

    @property
    def unknowns(self) -> Unknowns:
        """What was unknown."""
        return self.fitter.unknowns

    def result(self, frame: str, contact: str | None) -> Result:
        fitter, every = self.fitter, self.unknowns.unknowns
        load = contact or (LOADED if fitter.model.is_loaded else "by row" if self._some_loaded() else SCATTERED)
        builder = ResultBuilder(self.m, "calibrate", frame=frame, contact=load)
        builder.axes["unknown"] = Labels(tuple(one.name for one in every), tuple(one.kind for one in every))
        builder.axes["unknown_other"] = builder.axes["unknown"]
        builder.axes["channel"] = fitter.readings.axis
        builder.attrs |= self._quality()
        self._add_unknowns(builder)
        self._add_readings(builder)
        self._add_combinations(builder)
        self._add_frame(builder)
        self._add_output(builder)
        builder.data["status"] = Variable((), np.array(self._status(builder)), "", "whether the fit can be relied on")
        return builder.result()

    def _status(self, builder: ResultBuilder) -> str:
        if not self.fit.converged:
            return "not_settled"
        if self.fit.many_wrong:
            return "many_missed"
        return "doubtful" if float(builder.attrs["p_value"]) < DOUBT else "ok"

    def _some_loaded(self) -> bool:
        return any(load.acts for load in self.fitter.model.loads)

    @property
    def _away(self) -> Floats:
        """How far the unknowns are from the middle of their priors, in standard deviations; zero without a prior."""
        sigma = self.fitter.scale[: len(self.unknowns)]
        return np.where(np.isfinite(sigma), (self.fit.state.x - self.fitter.mean) / sigma, 0.0)

    def _quality(self) -> dict[str, str | int | float]:
        from scipy.special import chdtrc

        system, fit = self.fit.system, self.fit
        away = self._away[system.known[: len(self.unknowns)]]
        prior = system.inverse @ away
        chi = float(fit.whitened @ fit.whitened + prior @ prior)
        free = len(fit.whitened) - system.flats
        attrs: dict[str, str | int | float] = {
            "readings": len(fit.whitened),
            "rows": int(fit.used.sum()),
            "chi_square": chi,
            "degrees_of_freedom": free,
            "p_value": float(chdtrc(free, chi)) if free > 0 else 1.0,
            "measured": self.fitter.readings.sheet.name,
        }
        if self.held.any():
            distance, count = self.fitter.predicted(fit, self.held)
            attrs["held_out_chi_square"] = float(distance.sum())
            attrs["held_out_degrees_of_freedom"] = int(count.sum())
        return attrs

    def _add_unknowns(self, builder: ResultBuilder) -> None:
        every, system = self.unknowns.unknowns, self.fit.system
        count = len(every)
        covariance = system.covariance[:count, :count].copy()
        determined = system.is_determined[:count]
        covariance[~determined], covariance[:, ~determined] = np.nan, np.nan
        errors = np.sqrt(np.diagonal(covariance))
        sigma = np.array([one.sigma for one in every])
        estimate = np.where(determined, self.fit.state.x, np.nan)
        for name, values, words in (
            ("estimate", estimate, "deviation or size of this machine"),
            ("fitted", self.fit.state.x, "one of the values that fit, where it is not determined by itself"),
            ("standard_error", errors, "standard error of the estimate"),
            ("prior_mean", self.fitter.mean, "middle of what the file allows"),
            ("prior_sigma", sigma, "standard deviation before any reading; infinite where nothing is known"),
        ):
            builder.add(name, "unknown", values, words, "unknown")
        share = np.where(np.isfinite(sigma), 1.0 - (errors / sigma) ** 2, 1.0)
        builder.add(
            "share_determined",
            "unknown",
            np.where(determined, share, 0.0),
            "part of its prior variance that readings take",
        )
        builder.add("within_tolerance", "unknown", self._within(), "whether it is within the tolerance of the file")
        builder.add("determined", "unknown", determined, "whether it is known by itself")
        builder.add("covariance", ("unknown", "unknown_other"), covariance, "covariance", ("unknown", "unknown_other"))
        keys = np.array([one.key for one in every], dtype=str)
        builder.coords["unknown_key"] = Variable(("unknown",), keys, "", "where the file has it")

    def _within(self) -> Flags:
        """Which deviations are within the limits of the file; what has none is within them."""
        m, within = self.unknowns.m, np.ones(len(self.unknowns), dtype=bool)
        for k, one in enumerate(self.unknowns.unknowns):
            if not one.of_file and np.isfinite(one.sigma):
                limits = m.compiled_sources[int(m.parameter_source[one.parameter])].limits
                if limits is not None and limits[1] > limits[0]:
                    away = self.fit.state.x[k] - m.centre[one.parameter]
                    within[k] = limits[0] <= away <= limits[1]
        return within

    def _add_readings(self, builder: ResultBuilder) -> None:
        fitter, fit = self.fitter, self.fit
        own = fitter.readings
        builder.labels("reading", own.lines, "row of the table")
        each = ("reading", "channel")
        before = fitter.model.compare(own.values, fitter.first)
        without = np.full(own.values.shape, np.nan)
        cells = fit.system.weights
        without[cells.rows, cells.columns] = fit.system.missed(fit.whitened).cells
        # What was not fitted was predicted.
        without[~fit.used] = fit.residual[~fit.used]
        expected = np.sqrt(own.sigma**2 + np.diagonal(fit.about.play, axis1=1, axis2=2))
        for name, values, words in (
            ("measured", own.values, "what was read"),
            ("residual_before", before, "measured less nominal"),
            ("residual_after", fit.residual, "measured less what the fit says"),
            ("residual_without", without, "measured less what all other readings predict"),
            ("expected", np.where(own.given, expected, np.nan), "standard deviation by noise and play"),
        ):
            builder.add(name, each, values, words, "channel")
        left_out = ~fit.used & ~self.held
        builder.add("left_out", "reading", left_out, "whether the row is left out because all others miss it")
        builder.add("held_out", "reading", self.held, "whether the row was held out and predicted")

    def _add_combinations(self, builder: ResultBuilder) -> None:
        """What only acts together: deviations with a prior by the equations scaled by them, sizes as they are."""
        system, every = self.fit.system, self.unknowns.unknowns
        count = len(every)
        known = np.flatnonzero(system.known[:count])
        equations = system.without_flat()
        singular = np.linalg.svd(equations, compute_uv=False) if equations.size else np.zeros(0)
        whole = np.zeros(len(known))
        whole[: len(singular)] = singular[: len(known)]
        builder.add("singular_value", "direction", whole, "singular value of the equations scaled by the priors")
        exact = OF_DIFFERENCES
        found = [_renamed(one, known, system.scale) for one in combinations(equations, exact)] if equations.size else []
        sizes = np.array(self.fitter.sizes, dtype=int)
        if sizes.size:
            columns = system.a[:, sizes] / system.scale[sizes]
            found += [_renamed(one, sizes, None) for one in combinations(columns, exact)]
        if not found:
            return
        parts = np.zeros((len(found), count))
        for row, one in enumerate(found):
            head = every[one.parts[0][0]].factor
            for k, coefficient in one.parts:
                parts[row, k] = (
                    coefficient * every[k].factor / head if one.alike else coefficient * head / every[k].factor
                )
        builder.add("together", ("combination", "unknown"), parts, "coefficients of what acts together")
        alike = np.array([one.alike for one in found], dtype=bool)
        builder.add("alike", "combination", alike, "whether this sum is determined; if not, it changes no reading")
        self._add_sums(builder, parts)

    def _add_sums(self, builder: ResultBuilder, parts: Floats) -> None:
        """Sums in the unit of their first unknown."""
        every = self.unknowns.unknowns
        factors = np.array([one.factor for one in every])
        covariance = self.fit.system.covariance[: len(every), : len(every)] / np.outer(factors, factors)
        values = parts @ (self.fit.state.x / factors)
        errors = np.sqrt(np.maximum(np.einsum("ck,kl,cl->c", parts, covariance, parts), 0.0))
        names = [builder.name(every[int(np.flatnonzero(row)[0])].kind) for row in parts]
        builder.labels("combination", np.arange(len(parts)), "number of what acts together, from 0")
        builder.coords["combination_unit"] = Variable(("combination",), np.array(names, dtype=str), "", "unit")
        for name, own, words in (
            ("combination_estimate", values, "sum of what acts together"),
            ("combination_standard_error", errors, "standard error of this sum"),
        ):
            builder.data[name] = Variable(("combination",), own, "see combination_unit", words)

    def _add_frame(self, builder: ResultBuilder) -> None:
        fitter, state = self.fitter, self.fit.state
        errors = np.sqrt(np.diagonal(self.fit.system.covariance))[len(self.unknowns) :]
        columns = fitter.frame_columns
        if state.frame is not None:
            names = fitter.names()[len(self.unknowns) :][: len(columns)]
            kinds = tuple("length" if column < 3 else "angle" for column in columns)
            builder.axes["frame_axis"] = Labels(tuple(name.removeprefix("frame ") for name in names), kinds)
            values = np.concatenate([state.frame.shift, state.frame.turn])[list(columns)]
            words = "the ground of the file in the axes of the measuring device: place and rotation vector"
            builder.add("frame", "frame_axis", values, words, "frame_axis")
            builder.add("frame_standard_error", "frame_axis", errors[: len(columns)], "standard error", "frame_axis")
        if fitter.zeroed:
            values, own = np.full((2, len(fitter.readings.channels)), np.nan)
            values[list(fitter.zeroed)] = state.zeros[list(fitter.zeroed)]
            own[list(fitter.zeroed)] = errors[len(columns) :]
            builder.add("zero", "channel", values, "what the column reads at zero", "channel")
            builder.add("zero_standard_error", "channel", own, "standard error of the zero", "channel")

    def _add_output(self, builder: ResultBuilder) -> None:
        """Standard deviation of the error of every output that the deviations cause, along the path."""
        base = self.unknowns.m.without_load_cases()
        places = [k for k, one in enumerate(self.unknowns.unknowns) if not one.of_file]
        columns = [self.unknowns.unknowns[k].parameter for k in places]
        after = self.fit.system.covariance[np.ix_(places, places)]
        known = np.isfinite(self.fitter.scale[places])
        scale = np.where(known, self.fitter.scale[places], np.nan)
        before = self.unknowns.correlation[np.ix_(places, places)] * np.outer(scale, scale)
        rng = np.random.default_rng(0)
        values, vectors = np.linalg.eigh(after)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        drawn = rng.standard_normal((SPECIMENS, len(places))) @ root.T
        stds: list[tuple[Floats, Floats]] = []
        sizes: list[tuple[float, ...]] = []
        for name in base.outputs or (None,):
            part = base.only(output=name)
            at = self._path(part)
            by_drawing = part.core.sensitivity(at.drives, at.with_errors.poses)["source"]
            slopes = self._as_built(part, at, by_drawing)[:, :, columns]
            stds.append((_std(by_drawing[:, :, columns], before), _std(slopes, after)))
            lengths = [k for k, component in enumerate(part.components) if component in LENGTHS]
            good = np.flatnonzero(np.isfinite(slopes).all(axis=(1, 2)))
            chosen = good[np.unique(np.linspace(0, len(good) - 1, min(len(good), CONFIGURATIONS)).astype(int))]
            errors = np.einsum("kcp,sp->skc", slopes[chosen][:, lengths], drawn)
            largest = float(np.quantile(np.linalg.norm(errors, axis=-1), LEVEL)) if len(chosen) else np.nan
            rms = [float(np.sqrt(np.mean((std[good][:, lengths] ** 2).sum(axis=1)))) for std in stds[-1]]
            frames = by_frame_of(at.output[good], len(lengths))[:, lengths][:, :, FRAME_COLUMNS[len(lengths)]]
            of_each = ((by_drawing[:, :, columns], before), (slopes, after))
            best = [_without_frame(own[good][:, lengths], frames, covariance) for own, covariance in of_each]
            sizes.append((rms[0], rms[1], largest, *best))
        several = bool(base.outputs)
        if several:
            builder.labels("each_output", base.outputs, "output")
        dims = ("each_output", "configuration", "component") if several else ("configuration", "component")
        of = ("each_output",) if several else ()
        for k, (name, words) in enumerate((("before", "before any reading"), ("after", "with what the readings say"))):
            own = np.stack([pair[k] for pair in stds])
            text = f"standard deviation of the output's error that deviations cause, {words}"
            builder.add(f"output_{name}", dims, own if several else own[0], text, "component")
        for k, (name, words) in enumerate(
            (
                ("position_before", "rms of the position over the path, before any reading"),
                ("position_after", "rms of the position over the path, with what the readings say"),
                ("position_after_95", "what 95 % of the positions do not exceed, with what the readings say"),
                ("best_fit_before", "rms of the position after the best fit of the path's frame, before any reading"),
                ("best_fit_after", "rms of the position after the best fit of the path's frame, with the readings"),
            )
        ):
            every = np.array([size[k] for size in sizes])
            builder.add(name, of, every if several else every[0], words, "length")

    def _as_built(self, part: Mechanism, at: Nominal, of_nominal: Floats) -> Floats:
        """Derivatives of the output by the parameters of the machine as it was built."""
        if not part.core.isostatic:
            return of_nominal
        u = self.unknowns.of_parameters(self.fit.state.x)
        steps = steps_of(part)
        steps[~np.isin(np.arange(len(steps)), [one.parameter for one in self.unknowns.unknowns])] = 0.0
        good = np.flatnonzero(np.isfinite(of_nominal).all(axis=(1, 2)))
        found = of_nominal.copy()
        found[good] = slopes_at(
            lambda rows: errors_of(part.core, at.drives[good], at.poses[good], rows), u, steps, of_nominal[good]
        )
        return found

    def _path(self, part: Mechanism) -> Nominal:
        try:
            return nominal(part)
        except InputError:
            # A file with a grid has no path; the readings say where the machine works.
            return at_drives(part, np.unique(self.fitter.readings.drives, axis=0))


def _std(slopes: Floats, covariance: Floats) -> Floats:
    """Standard deviation of every component, shape (configuration, component)."""
    return np.asarray(np.sqrt(np.maximum(np.einsum("kcp,pq,kcq->kc", slopes, covariance, slopes), 0.0)))


def _without_frame(slopes: Floats, frames: Floats, covariance: Floats) -> float:
    """Root of the mean square of positions, by derivatives of shape (configuration, axis, unknown), after the best fit.

    Parameters
    ----------
    frames : ndarray
        How the positions move with their frame, shape (configuration, axis, displacement).
    """
    # Where nothing is unknown there is no size that would follow from the others.
    flat, moved = (each.reshape(each.shape[0] * each.shape[1], each.shape[2]) for each in (slopes, frames))
    moved = moved / np.maximum(np.linalg.norm(moved, axis=0), 1e-300)
    left = flat - moved @ np.linalg.lstsq(moved, flat, rcond=None)[0]
    return float(np.sqrt(max(np.einsum("ap,pq,aq->", left, covariance, left), 0.0) / max(len(slopes), 1)))


def _renamed(found: Combination, places: NDArray[np.int64], scale: Floats | None) -> Combination:
    """A combination by the numbers of the unknowns, with coefficients of their values in SI."""
    parts = []
    for k, coefficient in found.parts:
        place = int(places[k])
        if scale is not None:
            # Of a sum that is determined the coefficients are those of the columns; else they are a step in each.
            coefficient *= 1.0 / scale[place] if found.alike else scale[place]
        parts.append((place, float(coefficient)))
    if found.alike:
        parts = [(place, coefficient / parts[0][1]) for place, coefficient in parts]
    return Combination(tuple(parts), found.alike)
