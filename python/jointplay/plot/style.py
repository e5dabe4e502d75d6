"""What all drawings have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text

from jointplay import poses
from jointplay.errors import InputError, listed, one_line, shown
from jointplay.result import SEVERAL, Result, from_dataset

if TYPE_CHECKING:
    import xarray as xr

    from jointplay.analyses.nominal import Nominal
    from jointplay.model import Mechanism

Floats = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
#: Okabe and Ito, ordered so that neighbours differ in lightness as well
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7", "#F0E442", "#000000")
#: what is left of a colour when all colours have been used
PALER = 0.5
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
DASHES = ("-", "--", "-.", ":", "-", "--", "-.", ":")
HATCHES = ("", "///", "...", "\\\\\\", "xxx", "++", "ooo", "---")
GREY = "#6b6b6b"
#: how a limit is drawn
LIMIT: dict[str, Any] = {"color": "black", "linewidth": 1.2, "linestyle": (0, (6, 2))}
#: what stays open
OPEN: dict[str, Any] = {
    "color": "red", "linewidth": 2.4, "linestyle": (0, (2, 1)), "marker": "o", "markersize": 12,
    "markerfacecolor": "none", "markeredgewidth": 2.0, "zorder": 10,
}  # fmt: skip
#: plans that are longer than this times their width are narrow strips
STRIP = 3.0
#: as far as errors can be exaggerated
MOST_TIMES = 1e12
STYLE: Any = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.markersize": 4,
    "figure.constrained_layout.use": True,
    "svg.hashsalt": "jointplay",
    # A title may have two dollar signs in it.
    "text.parse_math": False,
}


def body_colour(m: Mechanism, body: int) -> str:
    """The colour of a body, by its index; that of a piece of an elastic body is its body's."""
    if body == -1:
        return GREY
    # Further bodies have the same colours, paler each time, so that no two entries of a legend look the same.
    turn, colour = divmod(m.bodies.index(m.owners[body]), len(COLOURS))
    red, green, blue = (1.0 - PALER**turn * (1.0 - part) for part in to_rgb(COLOURS[colour]))
    return to_hex((red, green, blue))


def point_colour(m: Mechanism, point: int) -> str:
    """The colour of the body that carries a point of the core's specification."""
    return body_colour(m, m.core_spec["points"][point]["body"])


def light(result: Result | xr.Dataset) -> Result:
    """The light form of a result, whichever it came in."""
    return result if isinstance(result, Result) else from_dataset(result)


def single(result: Result | xr.Dataset) -> Result:
    """The light form of a result of one output in one load case.

    Raises
    ------
    InputError
        When it is of several.
    """
    found = light(result)
    for dim in SEVERAL:
        if dim in found.sizes:
            labels = found.labels(dim)
            problem = f"has several, of which one is drawn: result.sel({dim}={labels[0]!r}); there are {listed(labels)}"
            raise InputError(problem, key=dim)
    return found


def on_ground(m: Mechanism, at: Floats, error: Floats) -> Floats:
    """An error of the output's position in ground axes; `at` are the poses of all bodies."""
    other = m.core_spec["output"].get("relative_to")
    if other is None:
        return error
    turned: Floats = poses.matrix(at[other])[: len(error), : len(error)] @ error
    return turned


def path_of_output(m: Mechanism, at: Nominal) -> Floats:
    """The place of the output point in every configuration, ground axes, metres; three coordinates."""
    point = m.core_spec["points"][m.core_spec["output"]["point"]]
    return poses.place(at.poses[:, point["body"]], point["at"])


def canvas(
    axes: Axes | None, width: float = 6.0, height: float = 4.0, projection: str | None = None
) -> tuple[Figure, Axes]:
    """The figure and axes to draw in: those given, or new ones."""
    if axes is not None:
        figure = axes.get_figure()
        assert isinstance(figure, Figure)
        return figure, axes
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        return figure, figure.add_subplot(projection=projection)


def is_plan(value: xr.DataArray) -> bool:
    """Whether both axes of a map have the same scale: with the same unit, unless that leaves a narrow strip."""
    across, up = (value[dim] for dim in value.dims[:2])
    sides = [float(np.ptp(side.values)) for side in (across, up)]
    return bool(across.attrs["units"] == up.attrs["units"]) and max(sides) <= STRIP * min(sides)


def check_exaggeration(factor: float | None) -> None:
    """Refuse a factor on errors that takes them out of any drawing."""
    if factor is not None and not 0.0 <= factor <= MOST_TIMES:
        raise InputError(f"is a number from 0 to {MOST_TIMES:.0e}, not {shown(factor)}", key="exaggerate")


def series(number: int) -> dict[str, Any]:
    """Colour, marker and dash of a series."""
    k = number % len(COLOURS)
    return {"color": COLOURS[k], "marker": MARKERS[k], "linestyle": DASHES[k]}


def along(result: Result) -> tuple[Any, str]:
    """What configurations are drawn against: the value of the only drive, else their number."""
    drives = result.drives
    if len(drives) == 1:
        name, drive = next(iter(drives.items()))
        if drive.dims == ("configuration",):
            return drive.values, labelled(name, drive.units)
    return result.coords["configuration"].values, "configuration"


def escape_texts(figure: Figure) -> None:
    """Escape in all texts what a reader of the file could obey; files of drawings are read by other programs, too."""
    for text in figure.findobj(Text):
        text.set_text("\n".join(map(one_line, text.get_text().split("\n"))))


def labelled(name: str, unit: str) -> str:
    """A label with its unit."""
    return f"{name} [{unit}]" if unit else name


def round_factor(factor: float) -> float:
    """The largest of 1, 2, 5, 10, 20, ... that is not above a factor; 1 for smaller ones.

    Examples
    --------
    >>> round_factor(370)
    200.0
    """
    if factor < 1.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(factor))
    return float(power * max(step for step in (1, 2, 5) if step * power <= factor))
