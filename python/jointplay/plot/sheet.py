"""One sheet for what a command was asked, panel by panel."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jointplay import poses
from jointplay.errors import InputError, listed, not_known
from jointplay.gaps import clearance_of
from jointplay.model import Mechanism
from jointplay.result import Result, parts
from jointplay.result import size as size_of
from jointplay.typed import typed

from .allocate import allocate, cost_curve
from .allow import allow
from .assembly import assembly
from .bars import AROUND, BAR
from .corrections import correction
from .figures import SIZES, blame, error, histogram, size_behind, worst_of
from .layout import KEYS, Panel, lay_out
from .linkage import VIEWS, mechanism
from .paths import displaced_path
from .put import check_path, put
from .singular import KINDS, distance, nearness
from .style import USUAL_STYLE, Style, using
from .sweeps import sweep
from .words import headline, round_factor

#: how large, as a share of the mechanism, an exaggerated error is drawn
VISIBLE = 0.1
#: poses that are drawn light between the first and the last one
BETWEEN = 8
#: questions that `error` asks, the one first whose shares are drawn
ASKED = ("worst", "loaded", "given", "random")
#: panels with the sources of each size
SOURCES = ("sources", "sources-rotation")
#: a panel that is drawn where it is asked for
PATH = "path"


@dataclass(frozen=True)
class Choice:
    """What of a result is drawn.

    Parameters
    ----------
    panel : str, optional
        One panel of the sheet alone.
    configuration : int, optional
        At which mechanism and histogram are drawn; the worst one if left out.
    quantity : str, optional
        ``position``, ``rotation`` or a component; position and rotation if left out.
    style : Style
    """

    panel: str | None = None
    configuration: int | None = None
    quantity: str | None = None
    style: Style = USUAL_STYLE

    def check(self, m: Mechanism, asked: Iterable[str]) -> None:
        """Refuse before the work what cannot be drawn.

        Raises
        ------
        InputError
            Naming what would be valid.
        """
        asked = list(asked)
        # A sweep compares sizes.
        known = SIZES if {"sweep", "pairs"} & {*asked} else (*SIZES, *m.components)
        if self.quantity is not None and self.quantity not in known:
            raise InputError(not_known(self.quantity, "a quantity", known), key="quantity")
        names = panel_names(m, asked)
        if self.panel is not None and names and self.panel not in names:
            raise InputError(not_known(self.panel, "a panel", names), key="panel")
        values = m.targets if m.drive_values is None else m.drive_values
        if self.configuration is not None and values is not None and not 0 <= self.configuration < len(values):
            problem = f"there is no configuration {self.configuration}; they go from 0 to {len(values) - 1}"
            raise InputError(problem, file=m.file, key="configuration")


def panel_names(m: Mechanism, asked: list[str]) -> tuple[str, ...]:
    """The panels of a sheet; none where they have the names of what is found, such as steps."""
    if "solve" in asked:
        return tuple(_drawings(m)) if m.pose_size == poses.SPATIAL else ("mechanism",)
    if "sweep" in asked:
        return ("position", "position-surface", "rotation", "rotation-surface")
    if "pairs" in asked:
        return SIZES
    if {"compensate", "compare"} & {*asked}:
        return ("position", "rotation", "correction", "correction-length", "correction-angle")
    if "singularities" in asked:
        return ("mechanism", "nearness", "distance")
    if set(asked) <= set(ASKED):
        return ("mechanism", *SIZES, *SOURCES, *(("histogram",) if "random" in asked else ()), PATH)
    return ()


@typed
def draw(m: Mechanism, results: Mapping[str, Result], path: Path, choice: Choice | None = None) -> None:
    """Draw results of one mechanism on a sheet and write it.

    Parameters
    ----------
    m : Mechanism
    results : mapping
        By the name of what was asked.
    path : Path
        Ending in `.png`, `.svg` or `.pdf`.
    choice : Choice, optional
    """
    check_path(path)
    choice = choice or Choice()
    with using(choice.style):
        put(sheet(m, results, choice), path, next(iter(results.values())))


def sheet(m: Mechanism, results: Mapping[str, Result], choice: Choice | None = None) -> Figure:
    """The figure of `draw`."""
    choice = choice or Choice()
    with using(choice.style):
        several = [parts(result) for result in results.values()]
        if any(heading for part in several for heading, _ in part):
            return _first_of_several(m, results, max(several, key=len), choice)
        first = next(iter(results.values()))
        if "assemble" in results:
            return assembly(m, first, step=choice.panel)
        panels = _panels(m, results, choice)
        if choice.panel is not None:
            if choice.panel not in panels:
                raise InputError(not_known(choice.panel, "a panel of this sheet", panels), key="panel")
            return lay_out([panels[choice.panel]])
        # As many beside each other as belong together.
        columns = (
            1 if {"allow", "allocate"} & set(results) else 3 if len(panels) == 3 and "compensate" in results else 2
        )
        figure = lay_out(list(panels.values()), columns)
        if "mechanism" not in panels:
            headline(figure, str(first.attrs["title"]))
    return figure


def _first_of_several(
    m: Mechanism, results: Mapping[str, Result], found: list[tuple[str, Result]], choice: Choice
) -> Figure:
    """The sheet of the first output and load case, with a line that says what else there is."""
    own = {name: parts(result)[0][1] for name, result in results.items()}
    figure = sheet(m.only(*(next(iter(names), None) for names in (m.outputs, m.load_cases))), own, choice)
    if choice.panel is not None:
        return figure
    # What does not depend on the loads has no load case.
    cases = m.load_cases[1:] if any("load_case" in result.sizes for result in results.values()) else ()
    others = [("outputs", m.outputs[1:], "--output-point"), ("load cases", cases, "--load-case")]
    also = "; ".join(f"other {word} ({option}): {listed(names)}" for word, names, option in others if names)
    heading = found[0][0]
    small = choice.style.font_size_used - 2.0
    figure.supxlabel("; ".join(filter(None, (heading, also))), x=0.01, ha="left", fontsize=small)
    return figure


def _panels(m: Mechanism, results: Mapping[str, Result], choice: Choice) -> dict[str, Panel]:
    """What there is to draw, by the name of the panel."""
    first = next(iter(results.values()))
    if "sweep" in first.attrs:
        return _sweep(first, choice)
    if "allocate" in results:
        return _units(first, allocate) | (
            {"cost": Panel(lambda axes: cost_curve(first, axes=axes))} if "curve_cost" in first.data else {}
        )
    if "allow" in results:
        return _units(first, allow)
    if "solve" in results:
        return _solve(m, first, choice)
    if "singularities" in results:
        return _singularities(m, first, choice)
    if "compensate" in results:
        return _sizes(results, choice) | _corrections(m, first)
    if "compare" in results:
        return _sizes(results, choice) | (_corrections(m, first) if "correction" in first.data else {})
    return _errors(m, results, choice)


def _quantities(choice: Choice) -> tuple[str, ...]:
    return SIZES if choice.quantity is None else (choice.quantity,)


def _sizes(results: Mapping[str, Result], choice: Choice) -> dict[str, Panel]:
    """Errors over the configurations; a component has the panel of the size that it belongs to."""
    # What is given by the worst case lies on its curve, where it is drawn.
    kept = {name: result for name, result in results.items() if "offsets_of" not in result.attrs} or results
    named = kept if len(kept) > 1 or next(iter(kept)) in ASKED else {"": next(iter(kept.values()))}
    return {
        size_behind(quantity): Panel(lambda axes, quantity=quantity: error(named, quantity, axes=axes))  # type: ignore[misc]
        for quantity in _quantities(choice)
    }


def _corrections(m: Mechanism, result: Result) -> dict[str, Panel]:
    """The corrections of the drives, a panel for each unit."""
    units = list(dict.fromkeys(result.labels("drive_unit"))) if "drive_unit" in result.coords else [None]
    if len(units) == 1:
        return {"correction": Panel(lambda axes: correction(result, axes=axes))}
    return {
        f"correction-{'angle' if unit == m.units.angle_name else 'length'}": Panel(partial(_correction, result, unit))
        for unit in units
    }


def _correction(result: Result, unit: str | None, axes: Axes) -> None:
    correction(result, unit, axes=axes)


def _sweep(result: Result, choice: Choice) -> dict[str, Panel]:
    found = {}
    for quantity in _quantities(choice):
        found[quantity] = Panel(partial(_swept, result, quantity, False), 4.0)
        # A surface over a single configuration has no width.
        if result.sizes["configuration"] > 1 and "sweep_by" not in result.attrs:
            found[f"{quantity}-surface"] = Panel(partial(_swept, result, quantity, True), 4.0)
    return found


def _swept(result: Result, quantity: str, surface: bool, axes: Axes) -> None:
    sweep(result, quantity, surface=surface, axes=axes)


def _units(result: Result, drawing: Callable[..., Figure]) -> dict[str, Panel]:
    """Sizes of sources, a panel for each unit."""
    units = result.labels("source_unit")
    return {
        unit: Panel(partial(_pairs, drawing, result, unit), AROUND + BAR * units.count(unit), 7.0)
        for unit in dict.fromkeys(units)
    }


def _pairs(drawing: Callable[..., Figure], result: Result, unit: str, axes: Axes) -> None:
    drawing(result, unit, axes=axes)


def _drawings(m: Mechanism) -> list[str]:
    """The views of a mechanism in the order of a drawing: top above front, side beside it."""
    return ["top", "solid", "front", "side"] if m.pose_size == poses.SPATIAL else ["mechanism"]


def _solve(m: Mechanism, result: Result, choice: Choice) -> dict[str, Panel]:
    """The first pose, with others behind it and the last one before them."""
    good = np.isfinite(result.get("nominal")).all(axis=1)
    others: list[int] = []
    # What cannot be assembled is what one asks about.
    if choice.configuration is not None:
        shown = choice.configuration
    elif "failure" in result.attrs:
        shown = int((~good).argmax())
    else:
        there = np.flatnonzero(good)
        if not len(there):
            raise InputError("no configuration is assembled, so there is nothing to draw")
        shown = int(there[0])
        picks = np.unique(np.linspace(1, len(there) - 1, min(BETWEEN, len(there) - 1)).round().astype(int))
        others = [int(there[k]) for k in picks] if len(there) > 1 else []
    alone = choice.panel is not None
    return {
        name: Panel(partial(_view, m, shown, others, name if name in VIEWS else None, alone), 5.4, around=KEYS)
        for name in _drawings(m)
    }


def _view(m: Mechanism, shown: int, others: list[int], view: str | None, alone: bool, axes: Axes) -> None:
    """A configuration, others light behind it and the last of them as strong; of several views one has the legend."""
    mechanism(m, shown, behind=others[:-1], beside=others[-1:], view=view, axes=axes)
    if view is not None and not alone:
        legend = axes.get_legend()
        axes.set_title("" if view == "solid" else view, pad=6.0)
        if view != "solid" and legend is not None:
            legend.remove()


def _singularities(m: Mechanism, result: Result, choice: Choice) -> dict[str, Panel]:
    """Nearness and distance, and the mechanism where it is nearest."""
    found = {}
    values = np.min([result.get(f"{kind}_singular_value") for kind in KINDS], axis=0)
    if np.isfinite(values).any():
        shown = int(np.nanargmin(values)) if choice.configuration is None else choice.configuration
        found["mechanism"] = Panel(partial(_view, m, shown, [], None, True), 5.0, around=KEYS)
    found["nearness"] = Panel(lambda axes: nearness(result, axes=axes))
    if "singularity_distance" in result.data and np.isfinite(result.get("singularity_distance")).any():
        found["distance"] = Panel(lambda axes: distance(result, axes=axes))
    return found


def _errors(m: Mechanism, results: Mapping[str, Result], choice: Choice) -> dict[str, Panel]:
    """The mechanism at its worst, errors against the configuration, their sources, and how they scatter."""
    main = next(results[name] for name in ASKED if name in results)
    quantity = choice.quantity or "position"
    pushed = results.get("loaded") or results.get("given")
    good = np.atleast_1d(np.isfinite(main.get("nominal")).all(axis=1))
    if not good.any():
        raise InputError("no configuration is assembled, so there is nothing to draw")
    shown = worst_of(main, quantity) if choice.configuration is None else choice.configuration
    shown = shown if good[shown] or choice.configuration is not None else int(good.argmax())
    times = exaggeration(m, pushed, shown)
    found = {
        "mechanism": Panel(
            lambda axes: mechanism(m, shown, exaggerate=times, result=pushed, axes=axes), 5.0, around=KEYS
        )
    }
    found |= _sizes(results, choice)
    for name, size in zip(SOURCES, SIZES, strict=True):
        if choice.quantity is None or size == size_behind(quantity):
            found[name] = Panel(partial(_blame, main, size))
    if choice.panel == PATH:
        found[PATH] = Panel(lambda axes: displaced_path(results, axes=axes), 5.0)
    if "random" in results:
        found["histogram"] = Panel(lambda axes: histogram(results["random"], quantity, choice.configuration, axes=axes))
    return found


def _blame(result: Result, size: str, axes: Axes) -> None:
    blame(result, size, axes=axes)


def exaggeration(m: Mechanism, pushed: Result | None, shown: int) -> float:
    """A round factor that makes clearances and errors visible."""
    kinds = ("disc", "ball", "journal", "sleeve", "guide", "diamond")
    found = [clearance_of(m, k) for k, s in enumerate(m.core_spec["sources"]) if s["kind"] == "clearance"]
    radii = [size.get("radius", size.get("gap", 0.0)) for name, size in found if name in kinds]
    size = max(radii, default=0.0) / m.units.length
    if pushed is not None:
        size = max(size, float(np.nan_to_num(size_of(pushed, "error", "position")[shown])) / 2.0)
    if size == 0.0:
        return 0.0
    return round_factor(VISIBLE * m.length / m.units.length / size)
