"""One sheet for what the command was asked."""

from __future__ import annotations

import io
import os
import warnings
from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from jointplay import files
from jointplay.errors import InputError, listed
from jointplay.gaps import clearance_of
from jointplay.model import Mechanism
from jointplay.result import Result, parts
from jointplay.result import size as size_of
from jointplay.typed import typed

from .allocate import allocate, cost_curve
from .allow import allow
from .assembly import assembly
from .bars import AROUND, BAR
from .figures import blame, error, histogram, sweep
from .linkage import mechanism, projection
from .style import STYLE, escape_texts, round_factor

EXTENSIONS = (".png", ".svg", ".pdf")
#: how large, as a share of the mechanism, an exaggerated error is drawn
VISIBLE = 0.08


@typed
def check_path(path: Path, more: tuple[str, ...] = ()) -> None:
    """Refuse a path that no drawing can be written to; `more` extensions are known where it is asked.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() not in EXTENSIONS:
        raise InputError(f"drawings are written as {', '.join((*EXTENSIONS, *more))}", file=os.fspath(path))
    files.require_writable(path)


@typed
def draw(m: Mechanism, results: Mapping[str, Result], path: Path) -> None:
    """Draw results of one mechanism on a sheet and write it.

    Parameters
    ----------
    results : mapping
        By the name of what was asked.
    path : Path
        Ending in `.png`, `.svg` or `.pdf`.
    """
    check_path(path)
    with mpl.rc_context(STYLE):
        figure = sheet(m, results)
        put(figure, path)


def put(figure: Figure, path: Path) -> None:
    """Write a drawing."""
    kind = path.suffix.lower().removeprefix(".")
    content = io.BytesIO()
    escape_texts(figure)
    # Without a date the same drawing is the same file.
    with warnings.catch_warnings():
        # A box for a letter says as much.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        figure.savefig(content, format=kind, dpi=160, metadata={"Date": None} if kind == "svg" else None)
    files.put(content.getbuffer(), path)


def sheet(m: Mechanism, results: Mapping[str, Result]) -> Figure:
    """The figure of `draw`."""
    several = [parts(result) for result in results.values()]
    if any(heading for part in several for heading, _ in part):
        return _first_of_several(m, results, max(several, key=len))
    first = next(iter(results.values()))
    if "sweep" in first.attrs:
        return _sweep(first)
    if "assemble" in results:
        return assembly(m, first)
    if "allocate" in results:
        return _allocated(first)
    if "allow" in results:
        return _allowed(first)
    if "solve" in results:
        figure = Figure(figsize=(8.4, 5.5))
        # What cannot be assembled is what one asks about.
        bad = ~np.isfinite(first.get("nominal")).all(axis=1)
        shown = int(bad.argmax()) if "failure" in first.attrs else _drawable(first)
        mechanism(m, shown, axes=figure.add_subplot(projection=projection(m)))
        return figure
    if "compare" in results or "compensate" in results:
        figure = Figure(figsize=(10.0, 4.2))
        for k, quantity in enumerate(("position", "rotation")):
            error(first, quantity, axes=figure.add_subplot(1, 2, k + 1))
        figure.suptitle(str(first.attrs["title"]), fontsize=10)
        return figure
    return _errors(m, results)


def _first_of_several(m: Mechanism, results: Mapping[str, Result], found: list[tuple[str, Result]]) -> Figure:
    """The sheet of the first output and load case, with a line that says what else there is."""
    own = {name: parts(result)[0][1] for name, result in results.items()}
    figure = sheet(m.only(*(next(iter(names), None) for names in (m.outputs, m.load_cases))), own)
    # What does not depend on the loads has no load case.
    cases = m.load_cases[1:] if any("load_case" in result.sizes for result in results.values()) else ()
    others = [("outputs", m.outputs[1:], "--output-point"), ("load cases", cases, "--load-case")]
    also = "; ".join(f"other {word} ({option}): {listed(names)}" for word, names, option in others if names)
    heading = found[0][0]
    figure.supxlabel("; ".join(filter(None, (heading, also))), x=0.01, ha="left", fontsize=7)
    return figure


def _sweep(result: Result) -> Figure:
    # A surface over a single configuration has no width.
    columns = 2 if result.sizes["configuration"] > 1 else 1
    figure = Figure(figsize=(5.0 * columns, 7.6))
    for k, quantity in enumerate(("position", "rotation")):
        sweep(result, quantity, axes=figure.add_subplot(2, columns, columns * k + 1))
        if columns > 1:
            sweep(result, quantity, surface=True, axes=figure.add_subplot(2, columns, columns * k + 2))
    figure.suptitle(str(result.attrs["title"]), fontsize=10)
    return figure


def _allocated(result: Result) -> Figure:
    """Sizes before and after, a panel for each unit, and the curve of the cost."""
    units = list(dict.fromkeys(result.labels("source_unit")))
    heights = [AROUND + BAR * result.labels("source_unit").count(unit) for unit in units]
    heights += [3.2] if "curve_cost" in result.data else []
    figure = Figure(figsize=(8.0, sum(heights)))
    panels = np.atleast_1d(figure.subplots(len(heights), 1, height_ratios=heights))
    for unit, axes in zip(units, panels, strict=False):
        allocate(result, unit, axes=axes)
    if "curve_cost" in result.data:
        cost_curve(result, axes=panels[-1])
    figure.suptitle(str(result.attrs["title"]), fontsize=10)
    return figure


def _allowed(result: Result) -> Figure:
    """Sizes beside allowed ones, a panel for each unit."""
    units = list(dict.fromkeys(result.labels("source_unit")))
    counts = [result.labels("source_unit").count(unit) for unit in units]
    figure = Figure(figsize=(8.0, sum(AROUND + BAR * count for count in counts)))
    panels = np.atleast_1d(figure.subplots(len(units), 1, height_ratios=[AROUND + BAR * count for count in counts]))
    for unit, axes in zip(units, panels, strict=True):
        allow(result, unit, axes=axes)
    figure.suptitle(str(result.attrs["title"]), fontsize=10)
    return figure


def _errors(m: Mechanism, results: Mapping[str, Result]) -> Figure:
    """The mechanism, error against configuration, blame, and the histogram where there is one."""
    main = next(results[name] for name in ("worst", "loaded", "given", "random") if name in results)
    figure = Figure(figsize=(13.0, 8.4))
    shown = _drawable(main)
    pushed = results.get("loaded") or results.get("given")
    axes = figure.add_subplot(2, 2, 1, projection=projection(m))
    mechanism(m, shown, exaggerate=_exaggeration(m, pushed, shown), result=pushed, axes=axes)
    # What is given by the worst case lies on its curve, where it is drawn.
    curves = {name: result for name, result in results.items() if "offsets_of" not in result.attrs}
    error(curves or results, axes=figure.add_subplot(2, 2, 2))
    blame(main, axes=figure.add_subplot(2, 2, 3))
    if "random" in results:
        histogram(results["random"], "position", shown, axes=figure.add_subplot(2, 2, 4))
    else:
        blame(main, "rotation", axes=figure.add_subplot(2, 2, 4))
    return figure


def _drawable(result: Result) -> int:
    """The first configuration that is assembled."""
    good = np.isfinite(result.get("nominal")).all(axis=1)
    if not good.any():
        raise InputError("no configuration is assembled, so there is nothing to draw")
    return int(good.argmax())


def _exaggeration(m: Mechanism, pushed: Result | None, shown: int) -> float:
    """A round factor that makes clearances and errors visible."""
    pins = [k for k, s in enumerate(m.core_spec["sources"]) if s["kind"] == "clearance" and "disc" in s["set"]]
    radii = [clearance_of(m, k)[1]["radius"] for k in pins]
    size = max(radii, default=0.0) / m.units.length
    if pushed is not None:
        size = max(size, float(np.nan_to_num(size_of(pushed, "error", "position")[shown])) / 2.0)
    if size == 0.0:
        return 0.0
    return round_factor(VISIBLE * m.length / m.units.length / size)
