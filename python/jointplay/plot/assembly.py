"""An assembly, a drawing for every step: what is there, what is new, how far off it is, and what is strained."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from jointplay.analyses.nominal import Nominal, nominal
from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.core.spec import ENDS
from jointplay.errors import InputError, not_known
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result
from jointplay.result.table import VERDICTS

from .bodies import outline, put_outline
from .layout import LEAST, columns_of
from .names import write as write_names
from .scene import PLAN, contour, drawn_points, places, written
from .solid import OBLIQUE, Solid
from .style import INCH, Style, StyledFigure, current, theme, using
from .words import automatic, check_exaggeration, headline, light, title

if TYPE_CHECKING:
    import xarray as xr

#: how large, as a share of the mechanism, an exaggerated error is drawn
VISIBLE = 0.08
#: forces below this share of the largest one of any step are not written
WORTH_SAYING = 1e-3
COLUMNS = 3
#: of a panel in inches, and what title and labels take of its height
WIDTH, LABELS = 4.6, 0.9
#: inches that the title of the figure takes
TITLE = 0.35
#: room around the mechanism, as a share of it
MARGIN = 0.15
#: places for a force along its member, in turn, off the middle, where members cross; and how far apart two of them are
ALONG, APART = (0.36, 0.64, 0.5, 0.22, 0.78), 0.12
#: corners of what is drawn round
ROUND = 49
#: points nearer to a line than this share of the mechanism are on it
STRAIGHT = 1e-6
#: which colours new members, tension, compression and what is open have
NEW, TENSION, COMPRESSION, OPEN = 2, 3, 0, 1
#: the variable that says how far off a centre can be, in each of the questions
REACH = {
    which: [f"{name}_{end}" for end in ("shaft", "bearing")]
    for which, name in (("worst", "worst"), ("random", "quantile"))
}


@typed
def assembly(
    m: Mechanism,
    result: Result | xr.Dataset,
    *,
    exaggerate: float | None = None,
    step: str | None = None,
    style: Style | str | None = None,
) -> Figure:
    """Draw an assembly, a panel for every step.

    New members are thick and have the names of their joints. Members under tension are red with solid lines, members
    under compression blue with dashed lines, with their force. For one specimen, arrows are the errors of the joint
    centres on the first bodies (on the second, if only that is assembled), with the indeterminacy around them. For the
    worst case and random specimens, circles are the largest errors, or the quantiles of the largest probability.

    Parameters
    ----------
    m : Mechanism
    result : Dataset
        Of `assemble`.
    exaggerate : float, optional
        Factor on the drawn errors; if left out, a round number that makes them visible.
    step : str, optional
        Only this one.
    style : Style or {"light", "dark", "print"}, optional
    """
    check_exaggeration(exaggerate)
    part = light(result)
    if part.attrs.get("question") != "assemble":
        raise InputError("is not the result of an assembly", key="result")
    if "kind" not in part.data:
        raise InputError("cannot be assembled even with perfect parts, so there is nothing to draw", file=m.file)
    steps = [str(name) for name in part.labels("step")]
    if step is not None and step not in steps:
        raise InputError(not_known(step, "a step", steps), key="step")
    shown = list(range(len(steps))) if step is None else [steps.index(step)]
    drawing = _Drawing(m, part, exaggerate)
    with using(style) as chosen:
        columns = min(COLUMNS, len(shown), columns_of(chosen, LEAST))
        rows = -(-len(shown) // columns)
        width = WIDTH if chosen.width is None else chosen.width / INCH / columns
        whole = (width * columns, TITLE + drawing.height(width) * rows)
        figure = replace(chosen, width=None).figure(*whole) if chosen.height is None else chosen.figure(*whole)
        for place_, k in enumerate(shown):
            drawing.step(k, figure.add_subplot(rows, columns, place_ + 1), figure)
        note = f"errors {drawing.exaggerate:g} times as large" if drawing.exaggerate else "no errors"
        headline(figure, f"{part.attrs['title'] or part.attrs['file']} ({note})")
        figure.finish()
    return figure


def colour_of(which: int) -> str:
    """One of the colours of the style."""
    colours = theme().colours
    return colours[which % len(colours)]


class _Parts(Solid):
    """The parts of a step in space, in the colours of what is there and what is new."""

    def __init__(self, m: Mechanism, at: Nominal, axes: Axes, colours: Mapping[int, str]) -> None:
        super().__init__(m, at, 0, axes, OBLIQUE)
        self.tints = {-1: theme().grey, **colours}

    def is_there(self, body: int) -> bool:
        """Whether a body is assembled."""
        return body in self.tints

    def tint(self, body: int) -> str:
        """The colour of a body."""
        return self.tints[body]


class _Drawing:
    """The panels, in file units."""

    def __init__(self, m: Mechanism, result: Result, exaggerate: float | None) -> None:
        self.m, self.result = m, result
        self.size = 3 if m.pose_size == poses.SPATIAL else 2
        at, number = nominal(m), int(result.attrs["at_configuration"])
        self.at = at.at(number)
        self.view = OBLIQUE if self.size == 3 else PLAN
        self.poses = np.vstack([at.poses[number], poses.ground(m.pose_size)])
        self.places = places(m, self.poses)
        self.extent = float(np.ptp(self.places, axis=0).max()) or 1.0
        self.members = [str(cell).split(", ") for cell in result.get("members").tolist()]
        largest = max((float(np.nanmax(np.abs(v), initial=0.0)) for v in self._errors()), default=0.0)
        self.exaggerate = automatic(VISIBLE * self.extent, largest) if exaggerate is None else exaggerate

    def height(self, panel: float) -> float:
        """Height of a panel of a width that has no empty space beside the mechanism."""
        width, height = np.ptp(self.view.flat(drawn_points(self.m, self.poses)), axis=0) + 2.0 * MARGIN * self.extent
        return LABELS + (panel - LABELS) * float(height / width)

    def _errors(self) -> list[Floats]:
        which = str(self.result.attrs["assemble"])
        if which in REACH:
            return [self.result.get(name) for name in REACH[which]]
        axes = self.result.labels("component")[: self.size]
        names = [f"{name}_{end}" for name in ("error", "undetermined") for end in ("shaft", "bearing")]
        return [self.result.get(name, component=c) for name in names for c in axes]

    def step(self, k: int, axes: Axes, figure: StyledFigure) -> None:
        """The panel of a step."""
        before = {str(self.result.attrs["base"]), *(name for step in self.members[:k] for name in step)}
        new = set(self.members[k])
        if self.size == 3:
            self._solid(axes, before, new)
        else:
            for body, name in [(-1, "ground"), *enumerate(self.m.owners)]:
                if name in before | new:
                    self._body(axes, body, name in new)
        self._forces(axes, k)
        for joint in range(len(self.m.joints)):
            self._centre(axes, k, joint)
        verdict = VERDICTS[str(self.result.get("status")[k])]
        if "probability_of_fit" in self.result.data:
            verdict = f"{100.0 * float(self.result.get('probability_of_fit')[k]):.3g} % fit without strain"
        # What is locked together is written as one, as it is handled.
        title(axes, f"{self.result.labels('step')[k]}: {self.result.get('links')[k]}: {verdict}")
        # Names keep clear of what is around them when that has its place.
        figure.late.append(lambda: self._names(axes, new))

    def _limits(self) -> tuple[Floats, Floats]:
        """The same place in every panel."""
        flat = self.view.flat(drawn_points(self.m, self.poses))
        return flat.min(axis=0) - MARGIN * self.extent, flat.max(axis=0) + MARGIN * self.extent

    def _solid(self, axes: Axes, before: set[str], new: set[str]) -> None:
        """The parts of a mechanism in space."""
        owners = enumerate(self.m.owners)
        colours = {
            body: colour_of(NEW) if name in new else theme().grey for body, name in owners if name in before | new
        }
        parts = _Parts(self.m, self.at, axes, colours)
        parts.bodies()
        parts.joints()
        parts.frame(self._limits())

    def _body(self, axes: Axes, body: int, new: bool) -> None:
        """A body in the plane, in axes with equal scales."""
        (left, low), (right, high) = self._limits()
        unit = self.m.units.length_name
        colour, width = (colour_of(NEW), 3.0) if new else (theme().grey, 1.6)
        put_outline(axes, [self.view.flat(line) for line in contour(self.m, self.poses, body)], colour)
        axes.set(xlim=(left, right), ylim=(low, high), xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")
        axes.set_aspect("equal")
        used = {*(point for points in self.m.joint_points for point in points), self.m.output_point}
        corners = self.places[[k for k in sorted(used) if self.m.points[k].body == body]]
        around = self.view.flat(outline(corners, STRAIGHT * self.extent))
        if body == -1:
            axes.plot(*self.view.flat(corners).T, marker="s", markersize=6, linestyle="none", color=theme().grey)
            axes.plot(*around.T, linestyle=":", color=theme().grey)
            return
        axes.plot(*around.T, color=colour, linewidth=width, solid_capstyle="round", zorder=2)

    def _names(self, axes: Axes, new: set[str]) -> None:
        """The names of the joints that new members bring, a pin by its own."""
        inner = {member.joint for member in self.m.members}
        found: dict[tuple[float, ...], dict[str, None]] = {}
        for k, bodies in enumerate(self.m.joint_bodies):
            owners = {self.m.owners[body] if body >= 0 else "ground" for body in bodies}
            if k not in inner and owners & new:
                x, y = np.round(self.view.flat(self.places[self.m.joint_points[k][0]]) / self.extent, 3) * self.extent
                found.setdefault((float(x), float(y)), {})[written(self.m, k)] = None
        axes.apply_aspect()
        joined = {place: ", ".join(names) for place, names in found.items()}
        write_names(axes, joined, np.array(list(found)).reshape(-1, 2))

    def _forces(self, axes: Any, k: int) -> None:
        """The members that carry force, over their bodies."""
        if "member_force" not in self.result.data:
            return
        forces = self.result.get("member_force")
        floor = WORTH_SAYING * float(np.nanmax(np.abs(forces), initial=0.0))
        unit = self.result.data["member_force"].units
        taken: list[Floats] = []
        for name, force in zip(self.result.labels("member"), forces[k], strict=True):
            ends = self._ends(str(name))
            if not abs(force) > max(floor, 1e-6) or ends is None:
                continue
            style: dict[str, Any] = (
                {"color": colour_of(TENSION), "linestyle": "-"}
                if force > 0
                else {"color": colour_of(COMPRESSION), "linestyle": "--"}
            )
            axes.plot(*self.view.flat(ends).T, linewidth=2.2, zorder=3 if self.size == 2 else 5, **style)
            box = {"facecolor": theme().paper, "edgecolor": "none", "alpha": 0.9, "pad": 0.5}
            places = [ends[0] + share * (ends[1] - ends[0]) for share in ALONG]
            free = (at for at in places if all(np.linalg.norm(at - other) > APART * self.extent for other in taken))
            taken.append(next(free, places[0]))
            axes.text(
                *self.view.flat(taken[-1]),
                f"{float(f'{force:.3g}'):g} {unit}",
                color=style["color"],
                fontsize=current().font_size_used - 1.0,
                ha="center",
                va="center",
                bbox=box,
                zorder=7,
            )

    def _ends(self, member: str) -> Floats | None:
        """The two ends of a member, which is a body or the elastic part of one."""
        for part in self.m.members:
            if part.name == member:
                bodies = [*self.m.joint_bodies[part.joint]]
                break
        else:
            bodies = [self.m.bodies.index(member)]
        inner = {own.joint for own in self.m.members}
        used = [point for k, points in enumerate(self.m.joint_points) if k not in inner for point in points]
        if sum(self.m.owners[part] == self.m.owners[bodies[0]] for part in range(len(self.m.owners))) > len(ENDS):
            # Pieces in between have the output or a load on them.
            used += [self.m.output_point, *(load["point"] for load in self.m.loads.first)]
        used = [point for point in used if self.m.points[point].body in bodies]
        places = np.unique(self.places[sorted(set(used))], axis=0)
        return places if len(places) == 2 else None

    def _centre(self, axes: Axes, k: int, joint: int) -> None:
        """A joint's centre with its error, or with how far off it can be."""
        at = self.places[self.m.joint_points[joint][0]]
        which = str(self.result.attrs["assemble"])
        if which in REACH:
            # The last of the probabilities is the largest.
            found = (float(np.ravel(self.result.get(name)[k, joint])[-1]) for name in REACH[which])
            reach = next(filter(np.isfinite, found), 0.0)
            self._around(axes, at, np.full(self.size, reach))
            return
        components = self.result.labels("component")[: self.size]
        step = self.result.labels("step")[k]
        for end in ("shaft", "bearing"):  # the bearing where the pin is not there yet
            error, half = (
                np.array([self.result.get(f"{name}_{end}", step=step, component=c)[joint] for c in components])
                for name in ("error", "undetermined")
            )
            if np.isfinite(error).all():
                break
        else:
            return
        moved = at + self.exaggerate * np.pad(error, (0, 3 - self.size))
        axes.plot(*self.view.flat(np.stack([at, moved])).T, color=theme().ink, linewidth=1.0, zorder=8)
        axes.plot(*self.view.flat(moved[None]).T, marker="o", markersize=3, color=theme().ink, zorder=9)
        self._around(axes, moved, half)

    def _around(self, axes: Axes, at: Floats, half: Floats) -> None:
        """What is open about a place: an ellipse or ellipsoid with these half-widths along the axes, as it is seen."""
        wide = self.exaggerate * np.maximum(np.pad(half, (0, 3 - self.size)), 0.0)
        if wide.max() <= 1e-3 * self.extent:
            return
        # Seen along a direction, an ellipsoid with these axes ends where |A^T u| is, with A the axes on the drawing.
        axes_seen = self.view.flat(np.diag(wide)).T
        turns = np.linspace(0.0, 2.0 * np.pi, ROUND)
        rim = np.column_stack([np.cos(turns), np.sin(turns)])
        reach = rim @ axes_seen @ axes_seen.T / np.maximum(np.linalg.norm(rim @ axes_seen, axis=1), 1e-300)[:, None]
        corners = self.view.flat(at) + reach
        below, above = (1, 4) if self.size == 2 else (6, 6)
        axes.add_patch(Polygon(corners, closed=True, facecolor=colour_of(OPEN), alpha=0.25, zorder=below))
        look = {"fill": False, "edgecolor": colour_of(OPEN), "linewidth": 0.8}
        axes.add_patch(Polygon(corners, closed=True, zorder=above, **look))
