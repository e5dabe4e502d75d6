"""A mechanism in motion: over its configurations, with the error so many times as large.

Light behind it stands the nominal mechanism; the loaded one is in front of it, every point p drawn at

    p_nominal + times (p_loaded - p_nominal),

and around the output lies the region that its clearances and tolerances allow, as many times as large.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Polygon

from jointplay.analyses import region
from jointplay.analyses.displaced import Displaced, shifts, under_load
from jointplay.analyses.nominal import Nominal, Progress, at_drives, nominal, report
from jointplay.basics import files, poses
from jointplay.basics.arrays import Floats
from jointplay.basics.progress import watched
from jointplay.basics.typed import typed
from jointplay.errors import InputError, in_range
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, commanded

from .bodies import on_ground, outline, path_of_output
from .linkage import kind_of
from .movies import MOVIES, Picture, check_tool
from .scene import Scene, Sight, drawn_points, places, wheels
from .style import Style, as_style, theme, using
from .words import automatic, check_exaggeration, headline, legend

#: frames of a short path, and the most of any
FRAMES, MOST_FRAMES = 48, 2000
#: frames in a second, and the most of them
FPS, MOST_FPS = 12, 60
#: dots per inch where nothing is said; animations are looked at on a screen
DPI = 100
#: directions along which the region is looked for, in the plane and in space
AROUND = {3: 48, 6: 60}
#: how large, as a share of the drawing, the largest error is drawn
VISIBLE = 0.08
#: drives that a title names
FEW = 3
#: how far a wheel reaches from its middle, in radii
CORNERS = np.vstack([np.eye(3), -np.eye(3)])
#: room around the mechanism, as a share of it
MARGIN = 0.06


@typed
@watched
def animate(
    m: Mechanism,
    path: str | PathLike[str],
    *,
    exaggerate: float | None = None,
    frames: int | None = None,
    fps: int = FPS,
    view: str | None = None,
    style: Style | str | None = None,
    progress: Progress | None = None,
) -> None:
    """Show a mechanism in motion: loaded, with the region in which its output can be.

    Parameters
    ----------
    m : Mechanism
        With drive values or a path; of several outputs and load cases the first one.
    path : str or path
        Ending in `.html` (a page that needs no network), `.gif`, or `.mp4`, which needs ffmpeg.
    exaggerate : float, optional
        Factor on errors and clearances; if left out, a round number that makes them visible.
    frames : int, optional
        Configurations between those of the file are interpolated along the drives until there are as many. If left
        out, 48, or those of the file if they are more.
    fps : int
        Frames per second.
    view : {"solid", "front", "top", "side"}, optional
        Of a mechanism in space.
    style : Style or {"light", "dark", "print"}, optional
    progress : callable, optional
        Called with the steps done and all steps: two for every frame, its region and its picture.

    Raises
    ------
    InputError
        When the file cannot be written, ffmpeg is missing, or an option is not valid.
    """
    place = Path(fspath(path))
    check_movie(place)
    check_exaggeration(exaggerate)
    in_range(fps, "fps", "a number of frames per second", 1, MOST_FPS)
    if frames is not None:
        in_range(frames, "frames", "a number of frames", 2, MOST_FRAMES)
    part = m.only(*(next(iter(names), None) for names in (m.outputs, m.load_cases)))
    kind_of(part, view)
    look = Style(dpi=DPI) if style is None else as_style(style)

    def found(done: int, count: int) -> None:
        if progress is not None:
            progress(done, 2 * count)

    motion = motion_of(part, frames, exaggerate, found)
    count = len(motion.at)

    def pictures() -> Iterator[Picture]:
        for k in range(count):
            with using(look):
                yield _picture(motion, k, view)
            if progress is not None:
                progress(count + k + 1, 2 * count)

    with files.replacing(files.require_writable(place)) as new:
        MOVIES[place.suffix.lower()](pictures(), fps, new, m.title)


def check_movie(path: Path) -> None:
    """Refuse a path that no animation can be written to, and one that needs a program that is not there.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() not in MOVIES:
        raise InputError(f"animations are written as {', '.join(MOVIES)}", file=fspath(path))
    check_tool(path)
    files.require_writable(path)


@dataclass(frozen=True)
class Motion:
    """What is shown frame by frame."""

    m: Mechanism
    #: the frames' configurations
    at: Nominal
    #: their drive values
    result: Result
    #: the mechanism under the load
    moved: Displaced | None
    #: errors of the output's position on the boundary of what is possible, (frame, direction, axis), file units
    region: Floats
    #: factor on the errors
    times: float

    def moved_at(self, k: int) -> tuple[Floats, Floats] | None:
        """Poses of the bodies of a frame under the load, and places on them; None where they are not known."""
        if self.moved is None or not np.isfinite(self.moved.poses[k]).all():
            return None
        return self.moved.poses[k], self.moved.points[k]

    @cached_property
    def reach(self) -> Floats:
        """All that is drawn in any frame, as points in file units."""
        ground = poses.ground(self.m.pose_size)
        every: list[Floats] = []
        for k in np.flatnonzero(np.isfinite(self.at.poses).all(axis=(1, 2))).tolist():
            at = np.vstack([self.at.poses[k], ground])
            own = places(self.m, at)
            every.append(drawn_points(self.m, at))
            every += [own[point] + radius * CORNERS for point, radius in wheels(self.m)]
            moved = self.moved_at(k)
            if moved is not None:
                there = places(self.m, np.vstack([moved[0], ground]), moved[1])
                every.append(own + self.times * (there - own))
        return np.vstack(every)


def motion_of(m: Mechanism, frames: int | None, exaggerate: float | None, progress: Progress | None = None) -> Motion:
    """The frames' configurations, the poses under the load, and the factor on the errors.

    Of the region of every frame `progress` is told.
    """
    at = _refined(m, frames)
    if not np.isfinite(at.poses).all(axis=(1, 2)).any():
        raise InputError("no configuration can be assembled, so there is nothing to show", file=m.file)
    moved = None
    if m.has_loads:
        moved = under_load(m, at)
    around = region.compute(m, at=at, directions=AROUND[len(m.components)], progress=progress).get("region")
    if exaggerate is None:
        exaggerate = automatic(VISIBLE * _extent(m, at), _largest(m, at, moved, around))
    return Motion(m, at, report(m, "", at).result(), moved, around, exaggerate)


def _refined(m: Mechanism, frames: int | None) -> Nominal:
    """The configurations of the file, and others between them along the drives until there are as many as asked."""
    at = nominal(m)
    wanted = max(FRAMES, len(at)) if frames is None else frames
    # Loads that are given configuration by configuration are not known between them.
    if len(at) < 2 or m.loads.vary or (frames is None and len(at) >= FRAMES):
        return at
    here = np.linspace(0.0, len(at) - 1.0, wanted)
    own = np.arange(len(at))
    drives = np.stack([np.interp(here, own, at.drives[:, d]) for d in range(at.drives.shape[1])], axis=1)
    return at_drives(m, drives)


def _extent(m: Mechanism, at: Nominal) -> float:
    """How large the mechanism is with the path of its output, metres."""
    first = int(np.isfinite(at.poses).all(axis=(1, 2)).argmax())
    own = places(m, np.vstack([at.poses[first], poses.ground(m.pose_size)])) * m.units.length
    path = path_of_output(m, at)
    return float(np.ptp(np.vstack([own, path[np.isfinite(path).all(axis=1)]]), axis=0).max())


def _largest(m: Mechanism, at: Nominal, moved: Displaced | None, around: Floats) -> float:
    """The largest error of any frame, metres."""
    sizes = [m.units.length * float(np.nanmax(np.linalg.norm(around, axis=-1), initial=0.0))]
    if moved is not None:
        sizes.append(m.units.length * float(np.nanmax(shifts(m, at, moved), initial=0.0)))
    return max(sizes)


def _picture(motion: Motion, k: int, view: str | None) -> Picture:
    """One frame as red, green and blue dots."""
    figure = frame(motion, k, view)
    # matplotlib has no types here.
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3]


def frame(motion: Motion, k: int, view: str | None = None) -> Any:
    """The figure of one frame, in the style in use."""
    m, at = motion.m, motion.at
    direction, drawing = kind_of(m, view)
    with using(None) as style:
        figure = style.figure(7.0, 5.6)
        axes = figure.add_subplot()
        if not np.isfinite(at.poses[k]).all():
            # The frame before stays in the eye; an empty one says what is the matter.
            axes.annotate("cannot be assembled", (0.5, 0.5), xycoords="axes fraction", ha="center", color=theme().alarm)
            axes.set_axis_off()
        else:
            moved = motion.moved_at(k)
            scene = drawing(m, at, k, axes, direction, moved, motion.times)
            # Marks are as large in every frame.
            first = int(np.isfinite(at.poses).all(axis=(1, 2)).argmax())
            scene.extent = drawing(m, at, first, axes, direction).extent
            if moved is not None:
                drawing(m, at, k, axes, direction).ghost()
            if len(at) > 1:
                scene.trace()
            scene.bodies()
            scene.joints()
            scene.output()
            scene.springs()
            _region(motion, k, scene, direction)
            scene.frame(_limits(motion, direction))
        times = f"errors {motion.times:g} times as large" if motion.times else "no errors"
        headline(figure, "; ".join(filter(None, (m.title, _drives(motion.result, k), times))))
        legend(axes)
    return figure


def _drives(result: Result, k: int) -> str:
    """The drives of a frame in words, the first few of many."""
    named = list(result.drives.items())[:FEW]
    return ", ".join(f"{name} = {commanded(drive, k):.4g} {drive.units}".rstrip() for name, drive in named)


def _region(motion: Motion, k: int, scene: Scene, view: Sight) -> None:
    """Where the output can be."""
    m = motion.m
    own = motion.region[k][np.isfinite(motion.region[k]).all(axis=1)]
    if not motion.times or len(own) < 3 or not np.ptp(own, axis=0).max() > 0.0:
        return
    errors = np.zeros((len(own), 3))
    errors[:, : own.shape[1]] = own
    errors = np.array([on_ground(m, scene.poses, error) for error in errors])
    middle = places(m, scene.poses)[m.output_point]
    corners = outline(view.flat(middle + motion.times * errors), 0.0)
    colours = theme().colours
    look: dict[str, Any] = {
        "facecolor": colours[1 % len(colours)],
        "edgecolor": colours[3 % len(colours)],
        "alpha": 0.4,
    }
    scene.axes.add_patch(Polygon(corners, closed=True, label="where the output can be", zorder=6, **look))


def _limits(motion: Motion, view: Sight) -> tuple[Floats, Floats]:
    """The lower left and the upper right corner of all frames."""
    flat = view.flat(motion.reach)
    # The region reaches as far around the output as the largest error is drawn.
    room = (MARGIN + VISIBLE * (motion.times > 0.0)) * float(np.ptp(flat, axis=0).max())
    return flat.min(axis=0) - room, flat.max(axis=0) + room
