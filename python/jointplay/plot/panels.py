"""The panels of sheets: a sheet is a table of them, and declarations of questions name the sheet."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from jointplay.basics import poses
from jointplay.errors import InputError
from jointplay.model.gaps import clearance_of
from jointplay.model.mechanism import Mechanism
from jointplay.questions import QUESTIONS, asked_by
from jointplay.result import SIZES, Result, figures
from jointplay.result import size as size_of

from .allocate import allocate, cost_curve
from .allow import allow
from .bars import AROUND, BAR
from .calibrate import REMAINING, RESIDUALS, calibrate
from .cloud import cloud
from .corrections import correction
from .design import front, held
from .figures import blame, error, histogram, limits_of, size_behind, worst_of
from .layout import KEYS, Panel
from .life import AGEING, life
from .linkage import VIEWS, mechanism
from .paths import displaced_path
from .singular import KINDS, distance, nearness
from .structural import structural
from .sweeps import sweep
from .words import automatic
from .workspace import planes, workspace

if TYPE_CHECKING:
    from .sheet import Drawn

#: how large, as a share of the mechanism, an exaggerated error is drawn
VISIBLE = 0.1
#: poses that are drawn light between the first and the last one
BETWEEN = 8
#: measured columns whose residuals are drawn
MOST_CHANNELS = 6
#: what sweeps compare answers by
SWEPT = tuple(dict.fromkeys(name for question in asked_by("sweep") for name in QUESTIONS[question].figures))
#: the panel of how the chosen quantity scatters; those of others have their name behind it
HISTOGRAM = "histogram"
#: panels with the sources of each size
SOURCES = ("sources", "sources-rotation")


@dataclass(frozen=True)
class Sheet:
    """What a sheet is made of: the results by the name of what was asked; before the work there are none."""

    m: Mechanism
    asked: list[str]
    results: Mapping[str, Result]
    choice: Drawn

    @cached_property
    def first(self) -> Result:
        """The first result."""
        return next(iter(self.results.values()))

    @cached_property
    def pushed(self) -> Result | None:
        """The first result that says where the mechanism is."""
        return next((result for result in self.results.values() if "error" in result.data), None)

    @cached_property
    def main(self) -> Result:
        """The result whose shares are drawn."""
        return self.results.get("worst") or self.pushed or self.first

    @property
    def quantity(self) -> str:
        """The quantity that is chosen."""
        return self.choice.quantity or "position"


def _assembled(result: Result) -> NDArray[np.intp]:
    """The configurations that are assembled, of which there has to be one."""
    there = np.flatnonzero(np.isfinite(result.get("nominal")).all(axis=-1))
    if not len(there):
        raise InputError("no configuration is assembled, so there is nothing to draw")
    return there


@dataclass(frozen=True)
class PanelEntry:
    """Panels of one sort: their names, and what makes the one of a name, None where the results have nothing for it.

    Names that only the results say are None before the work.
    """

    names: tuple[str, ...] | Callable[[Sheet], Iterable[str] | None]
    make: Callable[[Sheet, str], Panel | None]

    def of(self, sheet: Sheet) -> Iterable[str] | None:
        """The names of the panels of a sheet."""
        return self.names if isinstance(self.names, tuple) else self.names(sheet)


@dataclass(frozen=True)
class Kind:
    """A sort of sheet: its panels in their order, and how they stand."""

    entries: tuple[PanelEntry, ...] = ()
    #: as many stand beside each other
    columns: int = 2
    #: as many belong together, and stand in one row where there are no others
    row: int = 0
    #: whether components can be drawn, and not only sizes
    has_components: bool = True


def kind_of(asked: Iterable[str]) -> Kind:
    """The sort of sheet for what is asked."""
    first = next(iter(asked))
    return SHEETS.get(QUESTIONS[first].sheet if first in QUESTIONS else first, Kind())


def _into(drawing: Callable[..., object], *args: Any, **options: Any) -> Callable[[Axes], object]:
    """A drawing that waits for its axes."""
    return lambda axes: drawing(*args, axes=axes, **options)


def _size(sheet: Sheet, name: str) -> Panel | None:
    """Errors over the configurations; a component has the panel of the size that it belongs to."""
    quantity = sheet.choice.quantity or name
    if name != size_behind(quantity):
        return None
    # What is given by the worst case lies on its curve, where it is drawn.
    errors = {key: result for key, result in sheet.results.items() if "structural_error" not in result.data}
    kept = {key: result for key, result in errors.items() if "offsets_of" not in result.attrs} or errors
    is_named = len(kept) > 1 or kind_of(kept) is SHEETS["errors"]
    return Panel(_into(error, kept if is_named else {"": next(iter(kept.values()))}, quantity))


def _is_shown(sheet: Sheet, panel: str, quantity: str) -> bool:
    """Whether a quantity that is drawn where it has a limit has the panel of a name."""
    has_limit = bool(limits_of([*sheet.results.values()], quantity))
    return panel == sheet.choice.panel or (not sheet.choice.quantity and has_limit)


def _component(sheet: Sheet, name: str) -> Panel | None:
    """Errors of a component over the configurations, where it has a limit or is asked for."""
    if not _is_shown(sheet, name, name):
        return None
    return _size(replace(sheet, choice=replace(sheet.choice, quantity=name)), size_behind(name))


def _units(sheet: Sheet) -> dict[str, str | None]:
    """The units of the corrections of drives, each with the name of its panel."""
    if "correction" not in sheet.first.data:
        return {}
    units = list(dict.fromkeys(sheet.first.labels("drive_unit"))) if "drive_unit" in sheet.first.coords else []
    angle = sheet.m.units.angle_name
    named = {f"correction-{'angle' if unit == angle else 'length'}": unit for unit in units}
    return {**named} if len(units) > 1 else {"correction": None}


def _corrections(sheet: Sheet) -> Iterable[str]:
    return _units(sheet) if sheet.results else ("correction", "correction-length", "correction-angle")


def _correction(sheet: Sheet, name: str) -> Panel:
    return Panel(_into(correction, sheet.first, _units(sheet)[name]))


def _swept(sheet: Sheet, name: str) -> Panel | None:
    quantity, _, surface = name.partition("-")
    # One that is chosen and that there is not is refused where it is drawn.
    if sheet.choice.quantity not in (None, quantity) or quantity not in (*figures(sheet.first), sheet.choice.quantity):
        return None
    # A surface over a single configuration has no width.
    if surface and (sheet.first.sizes["configuration"] == 1 or "sweep_by" in sheet.first.attrs):
        return None
    return Panel(_into(sweep, sheet.first, quantity, surface=bool(surface)), 4.0)


def _of_units(drawing: Callable[..., Figure]) -> PanelEntry:
    """Sizes of sources, a panel for each unit."""

    def names(sheet: Sheet) -> Iterable[str] | None:
        return dict.fromkeys(sheet.first.labels("source_unit")) if sheet.results else None

    def make(sheet: Sheet, unit: str) -> Panel:
        count = sheet.first.labels("source_unit").count(unit)
        return Panel(_into(drawing, sheet.first, unit), AROUND + BAR * count, 7.0)

    return PanelEntry(names, make)


def _cost(sheet: Sheet, _: str) -> Panel | None:
    return Panel(_into(cost_curve, sheet.first)) if "curve_cost" in sheet.first.data else None


def _front(sheet: Sheet, _: str) -> Panel | None:
    return Panel(_into(front, sheet.first)) if "front_aim" in sheet.first.data else None


def _held(sheet: Sheet, _: str) -> Panel:
    """What is used of everything that has to hold."""
    return Panel(_into(held, sheet.first), AROUND + BAR * sheet.first.sizes["held"])


def _aged(sheet: Sheet, name: str) -> Panel | None:
    """What grows with the age."""
    return Panel(_into(life, sheet.first, name)) if name in sheet.first.data else None


def _planes(sheet: Sheet) -> Iterable[str] | None:
    """A section for every plane of the axes."""
    return planes(sheet.first) if sheet.results else None


def _plane(sheet: Sheet, name: str, *, axes: Axes) -> None:
    """A section; of several one has the legend."""
    workspace(sheet.first, name, axes=axes)
    own = axes.get_legend()
    if own is not None and sheet.choice.panel is None and name != planes(sheet.first)[0]:
        own.remove()


def _residual_names(sheet: Sheet) -> Iterable[str] | None:
    """A panel of residuals for every measured column, and one of the error that is left."""
    if not sheet.results:
        return None
    columns = sheet.first.labels("channel")[:MOST_CHANNELS]
    return (*(f"{RESIDUALS}-{name}" for name in columns), REMAINING)


def _calibrated(sheet: Sheet, name: str) -> Panel:
    panel, _, channel = name.partition("-")
    return Panel(_into(calibrate, sheet.first, panel, channel or None))


def _drawings(sheet: Sheet) -> Iterable[str]:
    """The views of a mechanism in the order of a drawing: top above front, side beside it."""
    return ("top", "solid", "front", "side") if sheet.m.pose_size == poses.SPATIAL else ("mechanism",)


def _poses(sheet: Sheet, name: str) -> Panel:
    """The first pose, with others behind it and the last one before them."""
    shown, others = sheet.choice.configuration, []
    if shown is None and "failure" in sheet.first.attrs:
        # What cannot be assembled is what one asks about.
        shown = int(np.isfinite(sheet.first.get("nominal")).all(axis=1).argmin())
    elif shown is None:
        there = _assembled(sheet.first)
        shown, last = int(there[0]), len(there) - 1
        others = there[np.unique(np.linspace(1, last, min(BETWEEN, last)).round().astype(int))].tolist()
    view, is_alone = name if name in VIEWS else None, sheet.choice.panel is not None
    return Panel(_into(_view, sheet.m, shown, others, view, is_alone), 5.4, around=KEYS)


def _view(m: Mechanism, shown: int, others: list[int], view: str | None, is_alone: bool, *, axes: Axes) -> None:
    """A configuration, others light behind it and the last of them as strong; of several views one has the legend."""
    mechanism(m, shown, behind=others[:-1], beside=others[-1:], view=view, axes=axes)
    if view is not None and not is_alone:
        legend = axes.get_legend()
        axes.set_title("" if view == "solid" else view, pad=6.0)
        if view != "solid" and legend is not None:
            legend.remove()


def _nearest(sheet: Sheet, _: str) -> Panel | None:
    """The mechanism where it is nearest to a singularity."""
    values = np.min([sheet.first.get(f"{kind}_singular_value") for kind in KINDS], axis=0)
    if not np.isfinite(values).any():
        return None
    shown = int(np.nanargmin(values)) if sheet.choice.configuration is None else sheet.choice.configuration
    return Panel(_into(_view, sheet.m, shown, [], None, True), 5.0, around=KEYS)


def _distance(sheet: Sheet, _: str) -> Panel | None:
    found = sheet.first
    is_known = "singularity_distance" in found.data and np.isfinite(found.get("singularity_distance")).any()
    return Panel(_into(distance, found)) if is_known else None


def _at_worst(sheet: Sheet, _: str) -> Panel:
    """The mechanism at its worst."""
    chosen, there = sheet.choice.configuration, _assembled(sheet.main)
    shown = worst_of(sheet.main, sheet.quantity) if chosen is None else chosen
    shown = shown if shown in there or chosen is not None else int(there[0])
    times = exaggeration(sheet.m, sheet.pushed, shown)
    return Panel(_into(mechanism, sheet.m, shown, exaggerate=times, result=sheet.pushed), 5.0, around=KEYS)


def _sources(sheet: Sheet, name: str) -> Panel | None:
    """What the error is made of."""
    size = dict(zip(SOURCES, SIZES, strict=True))[name]
    is_chosen = sheet.choice.quantity is None or size == size_behind(sheet.quantity)
    return Panel(_into(blame, sheet.main, size)) if is_chosen else None


def _scattered(sheet: Sheet) -> Iterable[str]:
    others = (f"{HISTOGRAM}-{name}" for name in (SIZES[1], *sheet.m.components))
    return (HISTOGRAM, *others) if "random" in sheet.asked else ()


def _histogram(sheet: Sheet, panel: str) -> Panel | None:
    """How the chosen quantity scatters, and others that have a limit or are asked for."""
    _, _, name = panel.partition("-")
    if name and not _is_shown(sheet, panel, name):
        return None
    return Panel(_into(histogram, sheet.results["random"], name or sheet.quantity, sheet.choice.configuration))


def _kept(sheet: Sheet, _: str) -> Panel | None:
    """Specimens that were kept."""
    found = sheet.results.get("random")
    if found is None or "specimen_error" not in found.data:
        return None
    return Panel(_into(cloud, found, sheet.choice.configuration), 4.2)


def _compared(sheet: Sheet) -> Iterable[str]:
    return ("structural",) if "structural" in sheet.asked else ()


def _structural(sheet: Sheet, _: str) -> Panel:
    return Panel(_into(structural, sheet.results["structural"]))


def _path(sheet: Sheet, name: str) -> Panel | None:
    """The displaced path, where it is asked for."""
    return Panel(_into(displaced_path, sheet.results), 5.0) if sheet.choice.panel == name else None


_ERRORS = PanelEntry(SIZES, _size)
_CORRECTIONS = PanelEntry(_corrections, _correction)
#: every panel of every sheet; declarations of questions name the sheet
SHEETS: Mapping[str, Kind] = {
    "errors": Kind(
        (
            PanelEntry(("mechanism",), _at_worst),
            _ERRORS,
            PanelEntry(lambda sheet: sheet.m.components, _component),
            PanelEntry(SOURCES, _sources),
            PanelEntry(_scattered, _histogram),
            PanelEntry(lambda sheet: ("cloud",) if "random" in sheet.asked else (), _kept),
            PanelEntry(_compared, _structural),
            PanelEntry(("path",), _path),
        )
    ),
    "structural": Kind((PanelEntry(_compared, _structural),), has_components=False),
    "poses": Kind((PanelEntry(_drawings, _poses),)),
    "sweep": Kind(
        (PanelEntry(tuple(name + end for name in SWEPT for end in ("", "-surface")), _swept),), has_components=False
    ),
    "pairs": Kind((PanelEntry(SWEPT, _swept),), has_components=False),
    "corrections": Kind((_ERRORS, _CORRECTIONS), row=3),
    "comparison": Kind((_ERRORS, _CORRECTIONS)),
    "nearness": Kind(
        (
            PanelEntry(("mechanism",), _nearest),
            PanelEntry(("nearness",), lambda sheet, _: Panel(_into(nearness, sheet.first))),
            PanelEntry(("distance",), _distance),
        )
    ),
    "allowed": Kind((_of_units(allow),), columns=1),
    "calibrated": Kind((PanelEntry(_residual_names, _calibrated),), has_components=False),
    "life": Kind((PanelEntry(AGEING, _aged),), has_components=False),
    "workspace": Kind(
        (PanelEntry(_planes, lambda sheet, name: Panel(_into(_plane, sheet, name), 5.0, around=KEYS)),),
        has_components=False,
    ),
    "designed": Kind((PanelEntry(("front",), _front), PanelEntry(("held",), _held)), columns=1, has_components=False),
    "allocated": Kind((_of_units(allocate), PanelEntry(("cost",), _cost)), columns=1),
}


def exaggeration(m: Mechanism, pushed: Result | None, shown: int) -> float:
    """A round factor that makes clearances and errors visible."""
    found = [clearance_of(m, k)[1] for k, kind in enumerate(m.source_kinds) if kind == "clearance"]
    radii = [size.get("radius", size.get("gap", 0.0)) for size in found]
    size = max(radii, default=0.0) / m.units.length
    if pushed is not None:
        size = max(size, float(np.nan_to_num(size_of(pushed, "error", "position")[shown])) / 2.0)
    return automatic(VISIBLE * m.length / m.units.length, size)
