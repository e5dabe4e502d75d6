"""What a mechanism says that instruments read, with its derivatives and the scatter of its play.

    h(u) = channel(pose of its points at the drive values of the row, on the exact loop closure)

Where something loads the mechanism, every clearance is where the load presses it. Without any load the play scatters
by its laws, independently from approach to approach: its covariance is that of first order, and of an over-constrained
mechanism that of specimens whose offsets are compatible.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointplay import _core
from jointplay.analyses import friction
from jointplay.analyses.nominal import Nominal, at_drives, carried
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.answers import Given, Loaded, Random
from jointplay.core.compile import LENGTHS, LOOSE
from jointplay.core.sets import BOUNDS
from jointplay.core.spec import Changes, SourceSpec
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import require_determinate
from jointplay.result import STATUSES
from jointplay.result.verdict import READABLE

from .channels import DISTANCE, OUTPUT, Channel, Poses
from .differences import errors_of, slopes_at, steps_of
from .frames import DeviceFrame, by_frame_of
from .table import Readings

#: specimens from which the covariance of the play of an over-constrained mechanism is estimated
SPECIMENS = 512
#: step of a difference where the file has no tolerance, in radians and parts of the mechanism's length
STEP = 1e-5
#: part of the mechanism's length within which two points are at one place
TOGETHER = 1e-9
#: part of a tolerance that stands for none, where only the play is to scatter
NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class Predicted:
    """What would be read, SI."""

    #: shape (row, channel)
    values: Floats
    #: derivatives by all parameters, shape (row, channel, parameter)
    by_parameter: Floats
    #: by small displacements of the frame, shape (row, channel, 6)
    by_frame: Floats
    #: variance that a load leaves, shape (row, channel, channel)
    indeterminacy: Floats


class ReadingModel:
    """The readings of one table as a mechanism says them.

    Parameters
    ----------
    m : Mechanism
    readings : Readings
    scattered : bool
        Whether the play scatters although something loads the mechanism.

    Raises
    ------
    InputError
        When the mechanism cannot stand where a row says, or a point of a column is on no body that moves.
    """

    def __init__(self, m: Mechanism, readings: Readings, *, scattered: bool = False) -> None:
        require_determinate(m.first, over_constrained=True)
        self.m, self.readings = m, readings
        self.axes = sum(component in LENGTHS for component in m.components)
        self.points = tuple(dict.fromkeys(point for channel in readings.channels for point in channel.points))
        self.is_play = np.array([m.source_kinds[int(s)] in LOOSE for s in m.parameter_source], dtype=bool)
        # Rows of one place and load are asked once.
        loads = [*zip(readings.cases, readings.sides.tolist(), strict=True)]
        came = readings.ways * np.abs(readings.sides)[:, None]
        keys = [(load, row.tobytes()) for load, row in zip(loads, np.hstack([readings.drives, came]), strict=True)]
        places: dict[tuple[tuple[str, int], bytes], int] = {}
        for key in keys:
            places.setdefault(key, len(places))
        self.station = np.array([places[key] for key in keys])
        first = np.array([int(np.flatnonzero(self.station == k)[0]) for k in range(len(places))])
        drives = readings.drives[first]
        stations: dict[tuple[str, int], list[int]] = {}
        for k, row in enumerate(first.tolist()):
            stations.setdefault(loads[row], []).append(k)
        self.loads = [_Load(m, *load, np.array(own), scattered) for load, own in stations.items()]
        for load in self.loads:
            load.stand(drives[load.stations], came[first][load.stations], self.points)
            for k in np.flatnonzero(load.at.status != 0)[:1].tolist():
                row, status = int(first[load.stations[k]]), STATUSES[load.at.status[k]].replace("_", " ")
                raise readings.sheet.refuse(f"at these drive values the mechanism of the file is {status}", row=row)
        self._require_apart(first)

    def _require_apart(self, first: NDArray[np.int64]) -> None:
        """A distance of nothing has no direction, and no derivative."""
        at = self._nominal()
        for channel in self.readings.channels:
            if channel.form != DISTANCE:
                continue
            together = np.flatnonzero(channel.value(at, self.axes) <= TOGETHER * self.m.length)
            if together.size:
                both = " and ".join(channel.points)
                problem = f"{both} are at one place here; a distance is read between places that are apart"
                raise self.readings.sheet.refuse(problem, channel.name, int(first[together[0]]))

    @property
    def is_loaded(self) -> bool:
        """Whether a load decides where all clearances are."""
        return all(load.acts for load in self.loads)

    def read(
        self, u: Floats, frame: DeviceFrame | None = None, *, derivatives: bool = True, of_nominal: bool = True
    ) -> Predicted:
        """What would be read with the parameters u, SI.

        Parameters
        ----------
        derivatives : bool
            Whether they are wanted.
        of_nominal : bool
            Whether they are those of the nominal mechanism, which cost next to nothing; else those at u. What friction
            does to contacts is found where derivatives are.

        Raises
        ------
        InputError
            When the mechanism with these has no pose in some row.
        """
        for load in self.loads:
            load.rub(u, anew=derivatives)
        found = self._poses(u)
        values = self._channels(found, frame)
        width = len(self.readings.channels)
        empty = np.zeros((len(values), width, 0))
        if not derivatives:
            return Predicted(values, empty, empty, np.zeros((len(values), width, width)))
        by_parameter, by_frame, open_ = self._derivatives(found, frame, None if of_nominal else u)
        return Predicted(values, by_parameter, by_frame, open_)

    def commanded(self) -> Predicted:
        """What would be read of the nominal mechanism, without any deviation, load or play; no derivatives."""
        values = self._channels(self._nominal(), None)
        empty = np.zeros((*values.shape, 0))
        return Predicted(values, empty, empty, np.zeros((*values.shape, values.shape[1])))

    def by_size(self, sizes: Sequence[Sequence[int]], frame: DeviceFrame | None = None) -> Floats:
        """Derivatives by relative changes of clearances that loads press, shape (row, channel, size).

        Parameters
        ----------
        sizes : sequence
            Of every size the sources that have it, by index.
        """
        count = int(self.station.max()) + 1
        moves = {point: np.zeros((count, len(self.m.components), len(sizes))) for point in self.points}
        for load in self.loads:
            for point in self.points:
                parts = load.contributions(point)
                for k, sources in enumerate(sizes):
                    moves[point][load.stations, :, k] = parts[:, list(sources)].sum(axis=1)
        at_station = self._by_moves(moves, self._slopes(self._nominal(), frame))
        return np.asarray(at_station[self.station])

    def play(self, read: Predicted, frame: DeviceFrame | None = None) -> Floats:
        """Covariance of what play and drives add to the readings of a row, shape (row, channel, channel)."""
        width = len(self.readings.channels)
        at_station = np.zeros((int(self.station.max()) + 1, width, width))
        first = np.array([int(np.flatnonzero(self.station == k)[0]) for k in range(len(at_station))])
        for load in self.loads:
            if load.acts or not self.is_play.any():
                continue
            if not load.fits_together:
                slopes: Floats = read.by_parameter[first[load.stations]][:, :, self.is_play]
                at_station[load.stations] = np.einsum("scp,pq,sdq->scd", slopes, self._scatter(load)[1], slopes)
            else:
                at_station[load.stations] = self._of_specimens(load)
        found = at_station[self.station] + read.indeterminacy
        sigma = self.readings.drive_sigma
        if sigma.any():
            slopes = self._by_drives(frame)[self.station] * sigma[:, None, :]
            found = found + np.einsum("rcd,red->rce", slopes, slopes)
        return np.asarray(found)

    def _by_drives(self, frame: DeviceFrame | None) -> Floats:
        """Derivatives of what is read by the drives, shape (station, channel, drive)."""
        size = (int(self.station.max()) + 1, len(self.m.components), len(self.m.drives))
        moves = {point: np.zeros(size) for point in self.points}
        for load in self.loads:
            for point in self.points:
                moves[point][load.stations] = load.by_drives(point)
        return self._by_moves(moves, self._slopes(self._nominal(), frame))

    def _scatter(self, load: _Load) -> tuple[Floats, Floats]:
        """Mean and covariance of the offsets of all clearances."""
        mean, covariance = load.part.core.parameter_moments()
        return mean[self.is_play], covariance[np.ix_(self.is_play, self.is_play)]

    def compare(self, measured: Floats, read: Predicted) -> Floats:
        """Measured less read: angles within half a turn, rotations in space as the rotation from one to the other."""
        apart = measured - read.values
        channels = self.readings.channels
        for k, channel in enumerate(channels):
            if channel.kind == "angle" and len(self.m.components) != 2 * self.axes:
                apart[:, k] = (apart[:, k] + np.pi) % (2.0 * np.pi) - np.pi
        for columns in self._rotations:
            turns = [poses.quaternion(values[:, columns]) for values in (np.nan_to_num(measured), read.values)]
            apart[:, columns] = poses.rotation_vector(poses.product(turns[0], poses.inverse(turns[1])))
        apart[~np.isfinite(measured)] = np.nan
        return apart

    @cached_property
    def _rotations(self) -> list[list[int]]:
        """The columns of every rotation in space."""
        if len(self.m.components) != 6:
            return []
        found: dict[str, list[int]] = {}
        order = sorted(range(len(self.readings.channels)), key=lambda k: self.readings.channels[k].component)
        for k in order:
            channel = self.readings.channels[k]
            if channel.form == "component" and channel.component >= self.axes:
                found.setdefault(channel.points[0], []).append(k)
        return list(found.values())

    def _poses(self, u: Floats) -> dict[str, Floats]:
        """Actual poses of all points at all stations, as results have them."""
        count = int(self.station.max()) + 1
        found = {point: np.full((count, len(self.m.components)), np.nan) for point in self.points}
        for load in self.loads:
            for point in self.points:
                found[point][load.stations] = load.poses(point, self._with_play(load, u))
        lost = np.flatnonzero([not np.isfinite(found[point][k]).all() for k in range(count) for point in self.points])
        if lost.size:
            row = int(np.flatnonzero(self.station == lost[0] // len(self.points))[0])
            raise self.readings.sheet.refuse("the mechanism with the fitted deviations has no pose here", row=row)
        return found

    def _with_play(self, load: _Load, u: Floats) -> Floats:
        """Parameters with the play where it is on average, or where the side holds it."""
        given = u.copy()
        if not load.acts and not load.fits_together:
            given[self.is_play] += self._scatter(load)[0] + load.held[self.is_play]
        return given

    def _channels(self, at: Poses, frame: DeviceFrame | None) -> Floats:
        """What is read at poses of the points; distances, and dials on the ground, know of no frame."""
        framed = {point: self._framed(pose, frame) for point, pose in at.items()}
        columns = [
            channel.value(self._seen(channel, framed if channel.form == "component" else at), self.axes)
            for channel in self.readings.channels
        ]
        values: Floats = np.column_stack(columns)[self.station]
        return values

    def _seen(self, channel: Channel, at: Poses) -> Poses:
        return {point: at[point] for point in channel.points}

    def _framed(self, pose: Floats, frame: DeviceFrame | None) -> Floats:
        """Poses in the axes of the measuring device."""
        if frame is None:
            return pose
        moved = pose.copy()
        moved[:, : self.axes] = frame.places(pose[:, : self.axes])
        if self.axes == 2:
            moved[:, 2] += frame.turn[2]
        else:
            both = poses.product(poses.quaternion(frame.turn), poses.quaternion(pose[:, 3:]))
            moved[:, 3:] = poses.rotation_vector(both)
        return moved

    def _derivatives(self, at: Poses, frame: DeviceFrame | None, u: Floats | None) -> tuple[Floats, Floats, Floats]:
        """Derivatives by parameters, at u or of the nominal mechanism, and by the frame; variance that loads leave."""
        count, size = int(self.station.max()) + 1, len(self.m.components)
        width = len(self.readings.channels)
        moves = {point: np.zeros((count, size, len(self.m.parameters))) for point in self.points}
        loose = {point: np.zeros((count, size)) for point in self.points}
        for load in self.loads:
            for point in self.points:
                loose[point][load.stations] = load.undetermined[point]
                by_parameter = load.slopes(point) if u is None else load.slopes_at(point, self._with_play(load, u))
                moves[point][load.stations] = by_parameter
        slopes = self._slopes(at, frame)
        open_ = np.zeros((count, width, width))
        for point, own in slopes.items():
            # Evenly distributed over twice the half-width.
            open_ += np.einsum("skc,sc,slc->skl", own, loose[point] ** 2 / 3.0, own)
        by_frame = np.zeros((count, width, 6))
        if frame is not None:
            framed = {point: self._framed(pose, frame) for point, pose in at.items()}
            for k, channel in enumerate(self.readings.channels):
                if channel.form == "component":
                    (slope,) = channel.slopes(self._seen(channel, framed), self.axes).values()
                    moved = by_frame_of(framed[channel.points[0]], self.axes)
                    by_frame[:, k] = np.einsum("sc,scf->sf", slope, moved)
        return self._by_moves(moves, slopes)[self.station], by_frame[self.station], open_[self.station]

    def _slopes(self, at: Poses, frame: DeviceFrame | None) -> dict[str, Floats]:
        """Derivatives of what is read by displacements of each point, shape (station, channel, component)."""
        count, width, size = int(self.station.max()) + 1, len(self.readings.channels), len(self.m.components)
        turned = _turned(frame, size)
        found = {point: np.zeros((count, width, size)) for point in self.points}
        for k, channel in enumerate(self.readings.channels):
            for point, slope in channel.slopes(self._seen(channel, at), self.axes).items():
                found[point][:, k] = slope @ turned if channel.form == "component" else slope
        return found

    def _by_moves(self, moves: Mapping[str, Floats], slopes: Mapping[str, Floats]) -> Floats:
        """What moves of the points do to what is read, shape (station, channel, ...)."""
        return np.asarray(sum(slopes[point] @ moves[point] for point in self.points))

    def _nominal(self) -> dict[str, Floats]:
        count = int(self.station.max()) + 1
        found = {point: np.zeros((count, len(self.m.components))) for point in self.points}
        for load in self.loads:
            for point in self.points:
                found[point][load.stations] = load.nominal[point]
        return found

    def _of_specimens(self, load: _Load) -> Floats:
        """Covariance of the play where offsets have to be compatible, at the stations of a load."""
        at = {point: load.nominal[point] for point in self.points}
        slopes = [channel.slopes(self._seen(channel, at), self.axes) for channel in self.readings.channels]
        errors = {point: load.specimens(point) for point in self.points}
        found = np.zeros((len(load.stations), len(slopes), len(slopes)))
        for k in range(len(load.stations)):
            read = np.stack(
                [sum(errors[point][k] @ slope[k] for point, slope in own.items()) for own in slopes], axis=-1
            )
            read = read[np.isfinite(read).all(axis=1)]
            found[k] = np.cov(read, rowvar=False).reshape(found.shape[1:]) if len(read) > 1 else 0.0
        return found


def _turned(frame: DeviceFrame | None, size: int) -> Floats:
    """What turns displacements of a pose into the axes of a frame."""
    turned = np.eye(size)
    if frame is not None:
        turn = poses.turned_by(frame.turn)
        axes = 2 if size == 3 else 3
        turned[:axes, :axes] = turn[:axes, :axes]
        if size == 6:
            turned[3:, 3:] = turn
    return turned


class _Load:
    """A mechanism in one load case, at some stations."""

    at: Nominal
    ways: Floats
    nominal: dict[str, Floats]
    undetermined: dict[str, Floats]

    def __init__(self, m: Mechanism, case: str, side: int, stations: NDArray[np.int64], scattered: bool) -> None:
        whole = m.only(load_case=case) if case else m.without_load_cases()
        parts = {name: whole.only(output=name) for name in whole.outputs} or {OUTPUT: whole.first}
        self.acts = whole.first.has_loads and not scattered
        #: from which side joints slide that rub; empty where none does
        self.slides = next((name for name, sign in friction.SIDES.items() if sign == side), "")
        if not (self.acts and friction.rubs(whole)):
            self.slides = ""
        if self.slides:
            friction.require(whole.first, self.slides, exact=True)
        ends = {} if self.slides else _ends(whole, side)
        self.parts = {name: part.held(ends) if ends else part for name, part in parts.items()}
        self.part = next(iter(self.parts.values()))
        #: whether offsets scatter that have to be compatible, so that what is read is their mean
        loose = any(kind in LOOSE for kind in self.part.source_kinds)
        self.fits_together = loose and not self.acts and not self.part.core.isostatic
        if self.part.loads.vary and self.acts:
            problem = "loads that change along the path belong to configurations of the file; give load cases"
            raise InputError(problem, file=m.file, key="loads")
        self.stations = stations
        #: of every parameter where the side holds it
        self.held = np.zeros(len(whole.parameters))
        for source, end in ends.items():
            self.held[whole.parameter_source == source] = end
        self._ends = ends
        self._cores: dict[str, _core.Mechanism] = {}
        #: what friction adds to the errors of a point, and how far it leaves them open
        self._friction: dict[str, tuple[Floats, Floats]] = {}

    @property
    def moves_play(self) -> bool:
        """Whether it is known where some of the play is taken up."""
        return self.acts or bool(self._ends)

    def stand(self, drives: Floats, ways: Floats, points: tuple[str, ...]) -> None:
        """Solve the nominal mechanism at drive values, one row for each station, to which drives moved so forward."""
        self.ways = ways
        self.at = at_drives(self.part, drives)
        lost = np.flatnonzero(self.at.status != 0)
        if lost.size and lost.size < len(drives):
            self.at = self._from_nearby(drives, lost)
        self.nominal, self.undetermined = {}, {}
        for point in points:
            self.nominal[point] = poses.components(self._core(point).output(self._placed(point)))
            self.undetermined[point] = np.zeros_like(self.nominal[point])

    def _from_nearby(self, drives: Floats, lost: NDArray[np.int64]) -> Nominal:
        """Where the way from row to row does not lead, go from the nearest row that stands."""
        at = self.at
        found = {name: getattr(at, name).copy() for name in ("poses", "output", "status")}
        good = np.flatnonzero(at.status == 0)
        scale = np.maximum(np.ptp(drives, axis=0), 1e-12)
        for k in lost.tolist():
            near = good[np.argmin(np.abs((drives[good] - drives[k]) / scale).max(axis=1))]
            way = self.part.core.trace(np.ascontiguousarray(drives[[k]]), at.poses[near])
            for name, values in found.items():
                values[k] = way[name][0]  # type: ignore[literal-required]
        return Nominal(drives, found["poses"], found["output"], found["status"])

    def poses(self, point: str, u: Floats) -> Floats:
        """Actual poses of a point with the parameters u."""
        error, self.undetermined[point] = self._errors(point, u)
        return _displaced(self.nominal[point], error)

    def _errors(self, point: str, u: Floats) -> tuple[Floats, Floats]:
        """Errors of a point with the parameters u, and how far the load leaves them open."""
        drives, placed = self.at.drives, self._placed(point)
        if self.fits_together:
            return self._specimens(point, u)["mean"], np.zeros_like(self.nominal[point])
        found: Given | Loaded
        if not self.acts:
            rows = np.ascontiguousarray(np.broadcast_to(u, (len(drives), len(u))))
            found = self._core(point).given(drives, placed, rows)
            open_ = np.zeros_like(found["error"])
        else:
            found = self._varied(point, {"sources": self._at(point, u)}).loaded(drives, placed, True, False, False)
            open_ = np.nan_to_num(found["undetermined"])
        error = _known(found)
        if self.slides:
            more, open_ = self._friction[point]
            error = error + more
        return error, open_

    def rub(self, u: Floats, *, anew: bool) -> None:
        """Find what friction adds where joints slide: for deviations nearby it is the same, and takes long to find."""
        for point in self.nominal if self.slides and (anew or not self._friction) else ():
            slides, without = self._sliding(point, u)
            self._friction[point] = _known(slides) - _known(without), np.nan_to_num(slides["undetermined"])

    def _sliding(self, point: str, u: Floats) -> tuple[Loaded, Loaded]:
        """Where the load presses the joints that slide, with friction and without; in the columns of `loaded`."""
        owner, placed = self._owner(point), self._placed(point)
        loose = np.isin(np.array(owner.source_kinds)[owner.parameter_source], LOOSE)
        watched = None if point in self.parts else self.part.joint_points[self.part.joints.index(point)][0]
        m = owner.deviating(np.where(loose, owner.centre, u), watched)
        found = m.core.loaded(self.at.drives, placed, True, True, True)
        asked = friction.setting(m, replace(self.at, poses=placed), None, found, "middle", None)
        return friction.sliding(replace(asked, speeds=self.ways), self.slides).found, found

    def slopes(self, point: str) -> Floats:
        """Derivatives of the pose of a point by all parameters, shape (station, component, parameter)."""
        core = self._core(point)
        if self.fits_together:
            return self._differences(point)
        if self.acts and not core.isostatic:
            return np.nan_to_num(core.jacobians(self.at.drives, self._placed(point))["parameter"])
        return core.sensitivity(self.at.drives, self._placed(point))["source"]

    def slopes_at(self, point: str, u: Floats) -> Floats:
        """The same with the parameters u: on the exact closure, with contacts where they are there."""
        if self.fits_together:
            return self._differences(point, u)
        steps = steps_of(self.part)
        if self.acts:
            # Where the play is, the load decides.
            steps[[self.part.source_kinds[int(s)] in LOOSE for s in self.part.parameter_source]] = 0.0

        def errors(rows: Floats) -> Floats:
            if self.acts or not self.part.core.isostatic:
                return np.array([self._errors(point, row)[0] for row in rows])
            return errors_of(self._core(point), self.at.drives, self._placed(point), rows)

        return slopes_at(errors, u, steps, self.slopes(point))

    def _differences(self, point: str, about: Floats | None = None) -> Floats:
        """The same of the mean of specimens, by differences with the same random numbers."""
        m = self.part
        found = np.zeros((*self.nominal[point].shape, len(m.parameters)))
        spread = np.sqrt(np.diagonal(m.core.parameter_moments()[1]))
        for k in range(len(m.parameters)):
            if m.source_kinds[int(m.parameter_source[k])] in LOOSE:
                continue
            step = spread[k] or STEP * (m.length if m.parameter_factors[k] == m.units.length else 1.0)
            sides = []
            for sign in (1.0, -1.0):
                u = (m.centre if about is None else about).copy()
                u[k] += sign * step
                sides.append(self._specimens(point, u)["mean"])
            found[:, :, k] = np.nan_to_num((sides[0] - sides[1]) / (2.0 * step))
        return found

    def by_drives(self, point: str) -> Floats:
        """Derivatives of the pose of a point by the drives, shape (station, component, drive)."""
        core = self._core(point)
        if self.acts and not core.isostatic:
            return np.nan_to_num(core.jacobians(self.at.drives, self._placed(point))["drive"])
        return core.sensitivity(self.at.drives, self._placed(point))["drive"]

    def contributions(self, point: str) -> Floats:
        """What every source does where the load presses it, or the side holds it; (station, source, component)."""
        found = np.zeros((len(self.stations), len(self.part.sources), len(self.part.components)))
        if self.acts:
            if self.slides:
                pressed = self._sliding(point, self.part.centre)[0]
            else:
                pressed = self._core(point).loaded(self.at.drives, self._placed(point), False, False, True)
            found = np.nan_to_num(pressed["contribution"])
        if self._ends:
            slopes = self.slopes(point)
            for source, end in self._ends.items():
                found[:, source] = slopes[:, :, self.part.parameter_source == source].sum(axis=2) * end
        return found

    def specimens(self, point: str) -> Floats:
        """Errors of specimens of which only the play scatters, shape (station, specimen, component)."""
        kept = self._specimens(point, self.part.centre)["kept_errors"]
        return kept.reshape(len(self.stations), SPECIMENS, -1)

    def _specimens(self, point: str, u: Floats) -> Random:
        """What specimens do whose deviations are those of u, so that only their play scatters."""
        sources = [source if source["kind"] in LOOSE else _without_tolerance(source) for source in self._at(point, u)]
        core = self._varied(point, {"sources": sources, "correlations": []})
        return core.random(self.at.drives, self._placed(point), SPECIMENS, 0, np.array([0.5]), keep=True)

    def _owner(self, point: str) -> Mechanism:
        return self.parts.get(point, self.part)

    def _varied(self, point: str, changes: Changes) -> _core.Mechanism:
        """The mechanism in the core with other parts, and with a point of a joint as the output where it is one."""
        if point in self.parts:
            return self.parts[point].varied(**changes)
        place, _ = self.part.joint_points[self.part.joints.index(point)]
        return self.part.watching(place, **changes)

    def _core(self, point: str) -> _core.Mechanism:
        if point not in self._cores:
            self._cores[point] = self._owner(point).core if point in self.parts else self._varied(point, {})
        return self._cores[point]

    def _placed(self, point: str) -> Floats:
        """Nominal poses of the bodies, those of the mechanism that has the point."""
        owner = self._owner(point)
        return self.at.poses if owner is self.part else carried(self.at, self.part, owner).poses

    def _at(self, point: str, u: Floats) -> list[SourceSpec]:
        """All sources with their known deviations as u has them; where clearances are, the load decides."""
        owner = self._owner(point)
        return [
            source.as_spec
            if source.kind in LOOSE
            else {**source.as_spec, "centre": u[owner.parameter_source == k].tolist()}
            for k, source in enumerate(owner.compiled_sources)
        ]


def _known(found: Given | Loaded) -> Floats:
    """Errors where there are any."""
    return np.where(np.isin(STATUSES[found["status"]], READABLE)[:, None], found["error"], np.nan)


def _ends(m: Mechanism, side: int) -> dict[int, float]:
    """Where drives that came from one side have their backlash, by its source: behind where they were going."""
    found = {}
    for k, source in enumerate(m.compiled_sources):
        if side and source.kind == "backlash":
            found[k] = float(source.size["low" if side > 0 else "high"])
    return found


def _without_tolerance(source: SourceSpec) -> SourceSpec:
    """The same source where it hardly scatters."""
    shape, size = next(iter(source["set"].items()))
    small = {key: value * (NOTHING if key in BOUNDS else 1.0) for key, value in size.items()}
    return {**source, "set": {shape: small}, "law": "uniform"}


def _displaced(nominal: Floats, error: Floats) -> Floats:
    """Poses after errors, both as results have them."""
    if nominal.shape[-1] != 6:
        return np.asarray(nominal + error)
    turned = poses.product(poses.quaternion(error[:, 3:]), poses.quaternion(nominal[:, 3:]))
    return np.concatenate([nominal[:, :3] + error[:, :3], poses.rotation_vector(turned)], axis=-1)
