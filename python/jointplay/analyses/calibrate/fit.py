"""The fit: Gauss and Newton's method on the exact closure.

Its steps are those of the derivatives of the nominal mechanism, which cost next to nothing. Where they have led, the
derivatives of the mechanism as built take over: with them the fit ends, and from them standard errors follow.

A row that all others miss by more than its errors allow is left out. To find it, a fit in which large residuals count
less comes first, because a wrong row draws the usual one towards itself.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses.readings import FRAME_COLUMNS, DeviceFrame, Predicted, ReadingModel, Readings, nearest_frame
from jointplay.basics.arrays import Flags, Floats
from jointplay.basics.progress import TellStep, counting
from jointplay.errors import InputError, listed

from .system import System, weights
from .unknowns import Unknowns

#: steps of a fit, and the size of the last one, as a part of the standard errors; where random specimens say what is
#: read, steps stay as large as their noise makes them
MOST_STEPS, LAST, LAST_OF_SPECIMENS = 60, 1e-4, 2e-3
#: how often derivatives are found anew, and the part of a standard error by which the fit moves then at the last
ROUNDS, NEAR = 4, 0.01
#: probability that any of the rows that are right is taken for a wrong one
WRONG = 0.01
#: part of the rows that may be left out
MOST_LEFT_OUT = 0.1
#: how often rows are looked for that are wrong
LOOKS = 5
#: part of what is known of a number of the file by which derivatives by it are found, and the least part of it
STEP, SMALLEST = 0.02, 1e-3
#: the same part of a size in the file
SIZE_STEP = 0.1
#: how often the mechanism is asked what is read, about
EXPECTED = 30
#: cells times unknowns that are fitted at once
MOST_NUMBERS = 40_000_000


@dataclass(frozen=True, eq=False)
class FitState:
    """All that is fitted."""

    #: the unknowns of the mechanism, SI
    x: Floats
    #: of the measuring device; None where it is known
    frame: DeviceFrame | None
    #: reading of every column, SI, where the machine says zero
    zeros: Floats
    #: whether measured places say roughly where the frame is
    frame_found: bool = False


@dataclass(frozen=True, eq=False)
class Linearised:
    """Derivatives of all cells by all that is fitted, shape (row, channel, unknown), and the covariance of the play."""

    jacobian: Floats
    play: Floats


@dataclass(frozen=True, eq=False)
class FitOutcome:
    """What came out."""

    state: FitState
    about: Linearised
    system: System
    #: rows that were not left out
    used: Flags
    #: of all rows, SI, shape (row, channel)
    residual: Floats
    #: of the cells that were used
    whitened: Floats
    converged: bool
    #: whether so many rows are missed by the others that none is left out
    many_wrong: bool = False


class Fitter:
    """Fits the readings of a table.

    Parameters
    ----------
    unknowns : Unknowns
    readings : Readings
    frame : bool
        Whether the frame of the measuring device is unknown.
    zeroed : tuple of int
        Columns that count from an unknown zero.
    scattered : bool
        Whether the play scatters although something loads the mechanism.
    progress : callable, optional
    """

    def __init__(
        self,
        unknowns: Unknowns,
        readings: Readings,
        *,
        frame: bool,
        zeroed: tuple[int, ...],
        scattered: bool,
        progress: TellStep | None = None,
    ) -> None:
        self.step = counting(progress, EXPECTED)
        self.unknowns, self.readings, self.zeroed, self.scattered = unknowns, readings, zeroed, scattered
        self.model = ReadingModel(unknowns.m, readings, scattered=scattered)
        self.calls = 0
        self.sizes = [k for k, one in enumerate(unknowns.unknowns) if one.sizing is not None]
        self.numbers = [k for k, one in enumerate(unknowns.unknowns) if one.of_file and one.sizing is None]
        self.mean = np.array([one.mean for one in unknowns.unknowns])
        self.frame_columns = FRAME_COLUMNS[self.model.axes] if frame else ()
        near = self._frame() if frame else None
        zeros = np.zeros(len(readings.channels))
        self.start = FitState(
            self.mean.copy(), near or (DeviceFrame.none() if frame else None), zeros, near is not None
        )
        self.first = self.model.read(unknowns.of_parameters(self.mean), self.start.frame)
        cells = int(readings.given.sum())
        if cells * self.width > MOST_NUMBERS:
            problem = f"{cells:,} readings of {self.width} unknowns are too many to be fitted at once"
            raise InputError(problem, file=readings.sheet.name)

    @property
    def width(self) -> int:
        """How many numbers are fitted."""
        return len(self.unknowns) + len(self.frame_columns) + len(self.zeroed)

    @property
    def scale(self) -> Floats:
        """Standard deviations of the priors; infinite of what has none."""
        own = [one.sigma for one in self.unknowns.unknowns]
        return np.array([*own, *[np.inf] * (self.width - len(own))])

    def names(self) -> list[str]:
        """What is fitted, by name."""
        axes = ("x", "y", "rotation") if self.model.axes == 2 else ("x", "y", "z", "rx", "ry", "rz")
        own = [one.name for one in self.unknowns.unknowns]
        frame = [f"frame {axis}" for axis in axes[: len(self.frame_columns)]]
        return [*own, *frame, *(f"zero of {self.readings.channels[k].name}" for k in self.zeroed)]

    def system(self, used: Flags, about: Linearised | None = None, before: System | None = None) -> System:
        """The equations of some rows, of the nominal mechanism if nothing else is said."""
        about = about or self.nominal
        own = weights(self.readings, about.play, used)
        return System(own, about.jacobian[own.rows, own.columns], self.scale, self._correlation(), before)

    def fit(self, used: Flags) -> FitOutcome:
        """Fit some rows, without those that are wrong."""
        return self._as_built(self._without_wrong(used))

    def _without_wrong(self, used: Flags) -> FitOutcome:
        found = self._fit(used)
        if not self._wrong(found).size:
            return found
        rows = int(used.sum())
        without = used.copy()
        # A first look that wrong rows draw less towards themselves.
        look = self._fit(used, robust=True)
        for _ in range(LOOKS):
            wrong = self._wrong(look)
            back = self._right(look, used & ~without)
            if not wrong.size and not back.size:
                return look
            without[wrong], without[back] = False, True
            if rows - int(without.sum()) > MOST_LEFT_OUT * rows:
                return replace(found, many_wrong=True)
            look = self._fit(without)
        return look

    def _fit(self, used: Flags, *, robust: bool = False) -> FitOutcome:
        """The fit with the derivatives of the nominal mechanism."""
        system = self.system(used)
        self.require_determined(system)
        return self._settled(self.start, self.nominal, system, used, robust=robust)[0]

    def _as_built(self, found: FitOutcome) -> FitOutcome:
        """The fit with the derivatives of the mechanism as built."""
        for _ in range(ROUNDS if found.converged else 0):
            about = self._linearised(found.state)
            system = self.system(found.used, about, found.system)
            many_wrong = found.many_wrong
            found, moved = self._settled(found.state, about, system, found.used)
            found = replace(found, many_wrong=many_wrong)
            if moved <= NEAR or not found.converged:
                break
        return found

    def _settled(
        self, start: FitState, about: Linearised, system: System, used: Flags, *, robust: bool = False
    ) -> tuple[FitOutcome, float]:
        """Steps with fixed derivatives until they are small, and how far they lead, in standard errors."""
        state, converged = start, False
        errors = np.sqrt(np.diagonal(system.covariance))
        determined = errors > 0.0
        known = system.known[: len(self.unknowns)]
        # Where an unknown has no prior, nothing draws it anywhere.
        sigma = self.scale[: len(self.unknowns)][known]
        last = LAST_OF_SPECIMENS if any(load.fits_together for load in self.model.loads) else LAST
        way = np.zeros(self.width)
        for _ in range(MOST_STEPS):
            residual = self.residual(state)
            whitened = system.weights.whitened(residual[system.weights.rows, system.weights.columns])
            away = (state.x - self.mean)[known] / sigma
            lowest = {k: -float(state.x[k]) for k in self.sizes}
            step = system.step(whitened, away, system.huber(whitened) if robust else None, lowest)
            if not np.isfinite(step).all():
                break
            state, way = self._moved(state, step), way + step
            if float((np.abs(step[determined]) / errors[determined]).max(initial=0.0)) <= last:
                converged = True
                break
        residual = self.residual(state)
        whitened = system.weights.whitened(residual[system.weights.rows, system.weights.columns])
        found = FitOutcome(state, about, system, used.copy(), residual, whitened, converged)
        return found, float((np.abs(way[determined]) / errors[determined]).max(initial=0.0))

    def residual(self, state: FitState) -> Floats:
        """What was measured less what is read, SI, shape (row, channel)."""
        read = self.read(state)
        return self.model.compare(self.readings.values - state.zeros, read)

    def read(self, state: FitState) -> Predicted:
        """What is read, without derivatives."""
        self.calls += 1
        return self._read(state.x, state.frame)

    def _read(self, x: Floats, frame: DeviceFrame | None) -> Predicted:
        self.step()
        return self._model(x).read(self.unknowns.of_parameters(x), frame, derivatives=False)

    def _model(self, x: Floats) -> ReadingModel:
        """What says what is read with sizes and other numbers of the file as x has them."""
        if not (self.sizes or self.numbers) or np.array_equal(x, self.mean):
            return self.model
        try:
            m = self.unknowns.m.with_(self.unknowns.changes(x))
        except InputError as error:
            names = listed(self.unknowns.unknowns[k].name for k in (*self.sizes, *self.numbers))
            problem = f"the readings hardly determine {names}, which leave what is possible ({error.problem})"
            raise InputError(f"{problem}: fix some, or measure under other loads", file=error.file) from None
        return ReadingModel(m, self.readings, scattered=self.scattered)

    def _moved(self, state: FitState, step: Floats) -> FitState:
        count = len(self.unknowns)
        frame = state.frame
        if frame is not None:
            by = np.zeros(6)
            by[list(self.frame_columns)] = step[count : count + len(self.frame_columns)]
            frame = frame.moved(by)
        zeros = state.zeros.copy()
        zeros[list(self.zeroed)] += step[count + len(self.frame_columns) :]
        x = state.x + step[:count]
        x[self.sizes] = np.maximum(x[self.sizes], 0.0)
        # A stiffness, or a mass, keeps its sign.
        smallest = SMALLEST * self.mean[self.numbers]
        x[self.numbers] = np.where(x[self.numbers] * smallest < smallest**2, smallest, x[self.numbers])
        return FitState(x, frame, zeros)

    @cached_property
    def nominal(self) -> Linearised:
        """The linearisation of the nominal mechanism."""
        frame = self.start.frame
        jacobian = self._jacobian(self.start, self.first)
        if self.sizes:
            m, every = self.unknowns.m, self.unknowns.unknowns
            sources = [
                [m.sources.index(name) for name in one.sizing.sources] for one in every if one.sizing is not None
            ]
            jacobian[:, :, self.sizes] = self.model.by_size(sources, frame) / self.mean[self.sizes]
        return Linearised(jacobian, self.model.play(self.first, frame))

    def _linearised(self, state: FitState) -> Linearised:
        """That of the mechanism as built."""
        model = self._model(state.x)
        read = model.read(self.unknowns.of_parameters(state.x), state.frame, of_nominal=False)
        jacobian = self._jacobian(state, read)
        for k in self.sizes:
            jacobian[:, :, k] = self._by_number(state, k, SIZE_STEP * self.mean[k])
        return Linearised(jacobian, model.play(read, state.frame))

    def _jacobian(self, state: FitState, read: Predicted) -> Floats:
        """Derivatives by all but sizes of clearances."""
        every, count = self.unknowns.unknowns, len(self.unknowns)
        parts = np.zeros((len(self.readings), len(self.readings.channels), self.width))
        for k, one in enumerate(every):
            if not one.of_file:
                parts[:, :, k] = read.by_parameter[:, :, one.parameter]
        for k in self.numbers:
            size = every[k].sigma if np.isfinite(every[k].sigma) else abs(self.mean[k]) or 1.0
            parts[:, :, k] = self._by_number(state, k, STEP * size)
        parts[:, :, count : count + len(self.frame_columns)] = read.by_frame[:, :, list(self.frame_columns)]
        for k, channel in enumerate(self.zeroed):
            parts[:, channel, count + len(self.frame_columns) + k] = 1.0
        return parts

    def _by_number(self, state: FitState, k: int, step: float) -> Floats:
        """Derivatives by a number of the file, by differences; a size does not go below zero."""
        middle = max(float(state.x[k]), step) if k in self.sizes else float(state.x[k])
        ways = []
        for sign in (1.0, -1.0):
            x = state.x.copy()
            x[k] = middle + sign * step
            ways.append(self._read(x, state.frame))
        return self.model.compare(ways[0].values, ways[1]) / (2.0 * step)

    def _correlation(self) -> Floats:
        known = np.isfinite(self.scale[: len(self.unknowns)])
        return np.asarray(self.unknowns.correlation[np.ix_(known, known)])

    def require_determined(self, system: System) -> None:
        """Refuse what has no prior and no reading tells; of sizes combinations are determined."""
        undetermined = system.flat[1]
        if not undetermined.size:
            return
        flat = np.flatnonzero(~system.known)
        others = [k for k, place in enumerate(flat.tolist()) if place not in self.sizes]
        open_ = [self.names()[flat[k]] for k in others if np.linalg.norm(undetermined[k]) > 1e-6]
        if open_:
            problem = f"no reading tells {listed(open_)}, or not one of them by itself, and nothing is known beforehand"
            where = "give them a tolerance or a standard deviation, or measure more"
            raise InputError(f"{problem}: {where}", file=self.readings.sheet.name)

    def _wrong(self, fit: FitOutcome) -> NDArray[np.int64]:
        """Rows that all others miss by more than their errors allow."""
        from scipy.special import chdtrc

        missed = fit.system.missed(fit.whitened)
        rare = chdtrc(missed.count, missed.distance) < WRONG / max(int(fit.used.sum()), 1)
        return np.asarray(missed.rows[rare])

    def _right(self, fit: FitOutcome, left_out: Flags) -> NDArray[np.int64]:
        """Rows that were left out and that the fit predicts well enough."""
        from scipy.special import chdtrc

        rows = np.flatnonzero(left_out)
        if not rows.size:
            return rows
        distance, count = self.predicted(fit, left_out)
        return np.asarray(rows[chdtrc(count, distance) >= WRONG / len(self.readings)])

    def predicted(self, fit: FitOutcome, rows: Flags) -> tuple[Floats, NDArray[np.int64]]:
        """How far rows that were not used are from what the fit says, squared, by their covariance; and their cells."""
        own = weights(self.readings, fit.about.play, rows)
        jacobian = fit.about.jacobian[own.rows, own.columns]
        residual = fit.residual[own.rows, own.columns]
        distance: list[float] = []
        count: list[int] = []
        for row in np.flatnonzero(rows).tolist():
            places = np.flatnonzero(own.rows == row)
            columns = own.columns[places]
            covariance = fit.about.play[row][np.ix_(columns, columns)] + np.diag(self.readings.sigma[row, columns] ** 2)
            covariance = covariance + jacobian[places] @ fit.system.covariance @ jacobian[places].T
            distance.append(float(residual[places] @ np.linalg.solve(covariance, residual[places])))
            count.append(len(places))
        return np.array(distance), np.array(count)

    def _frame(self) -> DeviceFrame | None:
        """A frame to start from: that which brings measured places nearest to those of the nominal mechanism."""
        read = self.model.read(self.unknowns.of_parameters(self.mean), None, derivatives=False)
        seen, own = [], []
        axes = self.model.axes
        for point in self.model.points:
            columns = [
                k
                for axis in range(axes)
                for k, channel in enumerate(self.readings.channels)
                if channel.form == "component" and channel.points[0] == point and channel.component == axis
            ]
            if len(columns) == axes:
                rows = self.readings.given[:, columns].all(axis=1)
                seen.append(self.readings.values[rows][:, columns])
                own.append(read.values[rows][:, columns])
        measured, nominal = (np.concatenate(parts) if parts else np.zeros((0, axes)) for parts in (seen, own))
        return nearest_frame(nominal, measured) if len(measured) > axes else None
