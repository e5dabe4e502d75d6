"""What drawings say: titles, legends, labels of axes."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator
from numpy.typing import NDArray

from jointplay.errors import InputError, listed, not_known, shown
from jointplay.result import SEVERAL, Result, Variable, commanded, from_dataset, split, unit_of

from .measure import extent_of
from .style import AGAINST, current

if TYPE_CHECKING:
    import xarray as xr

#: letters of a name in a running text, and of one for which there is no room
LONGEST, SHORTEST = 32, 8
#: a value in a text, such as "theta = 40 deg", and a blank at which no line ends
VALUE, FIRM = re.compile(r" = ([-+.e\d]+) (?=\S)"), "\u00a0"
#: height of a line, as a share of the size of letters
HIGH = 1.35
#: what a legend needs beside the words of an entry, as a share of the size of letters
KEY = 3.9
#: what the labels of the vertical axis take of the width, and gaps, points
BESIDE = 46.0
#: share of the height of a figure that its axes have at least
HEIGHT = 0.8
#: as far as errors can be exaggerated
MOST_TIMES = 1e12
#: plans that are longer than this times their width are narrow strips
STRIP = 3.0


def room(axes: Axes) -> float:
    """About how wide axes will be when they are laid out, points."""
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    spec = axes.get_subplotspec()
    share = 1.0
    if spec is not None:
        columns = spec.get_gridspec().ncols
        share = (spec.colspan.stop - spec.colspan.start) / columns
    whole = 72.0 * figure.get_figwidth()
    return max(whole * share - BESIDE, 40.0)


def width_of(text: str, size: float) -> float:
    """How wide a text is with letters of a size, points."""
    return extent_of(text, size)[0]


def wrapped(text: str, wide: float, size: float) -> str:
    """A text in lines that fit."""
    whole = width_of(text, size)
    if whole <= wide:
        return text
    letters = max(12, int(0.95 * len(text) * wide / whole))
    # A value stays with its name and its unit, where a line has room for them.
    kept = VALUE.sub(f"{FIRM}={FIRM}\\1{FIRM}", text)
    kept = kept if max(map(len, kept.split(" "))) <= letters else text
    return "\n".join(textwrap.wrap(kept, letters)).replace(FIRM, " ")


def brief(name: str, most: int = LONGEST) -> str:
    """A name in at most so many letters, of its beginning and its end.

    Examples
    --------
    >>> brief("main_bearing_of_the_crank_at_the_left", 16)
    'main_bear…e_left'
    """
    head = 3 * most // 5
    return name if len(name) <= most else f"{name[:head]}…{name[len(name) - (most - head - 1) :]}"


def fitted(text: str, wide: float, size: float) -> str:
    """A text with letters of a size that fits, or its beginning and its end."""
    most = len(text)
    while most > SHORTEST and width_of(brief(text, most), size) > wide:
        most -= 1
    return brief(text, most)


def title(axes: Axes, text: str) -> None:
    """Title of axes, in as many lines as it needs, where the style has titles."""
    if not current().title:
        return
    axes.set_title(wrapped(text, room(axes), float(mpl.rcParams["axes.titlesize"])))


def headline(figure: Figure, text: str) -> None:
    """Title of a figure, where the style has titles."""
    if not current().title:
        return
    size = float(mpl.rcParams["axes.titlesize"])
    figure.suptitle(wrapped(text, 72.0 * figure.get_figwidth(), size), fontsize=size)


def beside(high: float, text: str) -> str:
    """What stands along the height of a figure, in inches, in as many lines as it needs."""
    return wrapped(text, HEIGHT * 72.0 * high, float(mpl.rcParams["axes.labelsize"]))


def legend(axes: Axes, entries: tuple[Sequence[Any], Sequence[str]] | None = None, wide: float | None = None) -> float:
    """A legend, each label once: where the style says, else above the axes, in as many columns as there is room for.

    Axes that have something beside them say how wide they are, in points. Returns the height above the axes, points.
    """
    handles, labels = axes.get_legend_handles_labels() if entries is None else entries
    unique = dict(zip(labels, handles, strict=True))
    size, wide = float(mpl.rcParams["legend.fontsize"]), wide or room(axes)
    texts = [fitted(label, wide - size * KEY, size) for label in unique]
    place: Any = current().legend
    if not unique or place == "none":
        return 0.0
    if place != "above":
        axes.legend(unique.values(), texts, loc=place, handlelength=2.2, labelspacing=0.25)
        return 0.0
    columns = _columns([size * KEY + width_of(text, size) for text in texts], wide)
    rows = math.ceil(len(unique) / columns)
    axes.legend(
        unique.values(), texts, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderpad=0.2,
        borderaxespad=0.0, handlelength=2.2, handletextpad=0.5, columnspacing=1.0, labelspacing=0.25,
    )  # fmt: skip
    text = axes.get_title("left")
    if text:
        axes.set_title(text, pad=rows * HIGH * size + 6.0)
    return rows * HIGH * size


def _columns(widths: Sequence[float], wide: float) -> int:
    """In how many columns entries have room, each column as wide as its widest entry.

    Examples
    --------
    >>> _columns([10.0, 50.0, 10.0, 10.0], 75.0)
    2
    """
    for columns in range(len(widths), 1, -1):
        if sum(max(part) for part in np.array_split(np.array(widths), columns)) <= wide:
            # Rows that are as full as each other need fewer columns.
            return math.ceil(len(widths) / math.ceil(len(widths) / columns))
    return 1


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


def check_exaggeration(factor: float | None) -> None:
    """Refuse a factor on errors that takes them out of any drawing."""
    if factor is not None and not 0.0 <= factor <= MOST_TIMES:
        raise InputError(f"is a number from 0 to {MOST_TIMES:.0e}, not {shown(factor)}", key="exaggerate")


def along(result: Result) -> tuple[Any, str]:
    """What configurations are drawn against: as the style says, else the value of the only drive, else their number.

    Raises
    ------
    InputError
        When the style names a drive that there is not, or the time of a machine that does not run.
    """
    drives = {name: drive for name, drive in result.drives.items() if drive.dims == ("configuration",)}
    chosen = current().against
    if not chosen and len(result.drives) == len(drives) == 1:
        (chosen,) = drives
    if chosen in drives:
        return drives[chosen].values, labelled(brief(chosen), drives[chosen].units)
    if chosen == "length" and "nominal" in result.data:
        lengths = split(result.labels("component"))[0]
        steps = np.diff(np.stack([result.get("nominal", component=name) for name in lengths], axis=1), axis=0)
        values = np.concatenate([[0.0], np.nan_to_num(np.linalg.norm(steps, axis=1)).cumsum()])
        return values, labelled("length of the path", unit_of(result, "position"))
    if chosen == "time" and "time" in result.data:
        return result.get("time"), labelled("time", result.unit("time"))
    if chosen and chosen != "configuration":
        has = {"configuration": True, "length": "nominal" in result.data, "time": "time" in result.data}
        known = [*drives, *(name for name in AGAINST if has[name])]
        raise InputError(not_known(chosen, "what configurations are drawn against", known), key="against")
    return result.coords["configuration"].values, "configuration"


def whole_numbers(axis: Axis, words: str, count: int) -> None:
    """An axis along which configurations are counted has no marks between them."""
    if words == "configuration":
        axis.set_major_locator(FixedLocator([0]) if count == 1 else MaxNLocator(integer=True))


def of_unit(
    names: Sequence[str], units: Sequence[str], unit: str | None, what: str
) -> tuple[NDArray[np.bool_], list[str], str]:
    """Which of several have a unit, their names, and the unit: that of the first one if none is named.

    Raises
    ------
    InputError
        When none has it: "'N' is not the unit of a source".
    """
    unit = units[0] if unit is None else unit
    if unit not in units:
        raise InputError(not_known(unit, f"the unit of a {what}", list(dict.fromkeys(units))), key="unit")
    own = np.array([one == unit for one in units])
    return own, [name for name, kept in zip(names, own, strict=True) if kept], unit


def which(result: Result, configuration: int) -> str:
    """A configuration in words: its number, and the value of the only drive."""
    said = f"configuration {configuration}"
    drives = [*result.drives.items()]
    if len(drives) != 1 or drives[0][1].dims != ("configuration",):
        return said
    ((name, drive),) = drives
    return f"{said}, {brief(name)} = {commanded(drive, configuration):.6g} {drive.units}".rstrip()


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


def automatic(extent: float, size: float) -> float:
    """The round factor that makes an error of a size about as large as an extent, as far as errors can be exaggerated.

    Examples
    --------
    >>> automatic(8.0, 0.1), automatic(8.0, 1e-320), automatic(8.0, 0.0)
    (50.0, 1000000000000.0, 0.0)
    """
    # The quotient is no number where the size is one of the smallest that there are.
    return round_factor(MOST_TIMES if extent > MOST_TIMES * size else extent / size) if size > 0.0 else 0.0


def is_plan(across: Variable, up: Variable) -> bool:
    """Whether both axes of a map have the same scale: with the same unit, unless that leaves a narrow strip."""
    sides = [float(np.ptp(side.values)) for side in (across, up)]
    return across.units == up.units and max(sides) <= STRIP * min(sides)
