"""Panels on a sheet: in columns on a wide one, below each other on one that is as narrow as a column of a page."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from matplotlib.axes import Axes

from jointplay.errors import InputError

from .style import INCH, NARROW, Style, StyledFigure, current
from .ticks import subplot

#: width of a panel, the least it has beside others, and what titles, legends and labels take of its height, inches
WIDTH, LEAST, AROUND = 6.2, 3.2, 1.0
#: the same of the height of a drawing, whose legend has an entry for each body
KEYS = 2.0
#: part of that which is needed, and the least height of axes, inches, where the height of a sheet is given
SQUEEZED, LOW = 0.75, 0.4


@dataclass(frozen=True)
class Panel:
    """A part of a sheet."""

    #: draws into axes
    draw: Callable[[Axes], object]
    #: of a panel of the usual width, inches
    height: float = 4.2
    #: usual width, inches
    width: float = WIDTH
    #: what titles, legends and labels take of the height, inches
    around: float = AROUND

    def height_at(self, width: float) -> float:
        """Height at another width: labels and legends stay as they are."""
        return self.around + max(self.height - self.around, 0.5) * min(1.0, width / self.width)


def columns_of(style: Style, width: float) -> int:
    """How many panels of a width (inches) stand beside each other at most."""
    if style.width is None:
        return 99
    return 1 if style.width < NARROW else max(1, int(style.width / INCH / width))


def lay_out(panels: Sequence[Panel], columns: int = 2) -> StyledFigure:
    """Draw panels on one sheet, row by row."""
    style = current()
    columns = min(columns, len(panels), columns_of(style, LEAST))
    # One panel too many gives the first one, the drawing, a row of its own.
    rest = len(panels) % columns if len(panels) > columns else 0
    rows = [panels[:rest]] * (rest > 0) + [panels[k : k + columns] for k in range(rest, len(panels), columns)]
    whole = columns * max(panel.width for panel in panels) if style.width is None else style.width / INCH
    heights = [max(panel.height_at(whole / len(row)) for panel in row) for row in rows]
    # The heights are those of panels of this width already.
    figure = replace(style, width=None, font_size=style.font_size_used).figure(whole, sum(heights))
    if style.height is not None:
        least = INCH * sum(SQUEEZED * max(panel.around for panel in row) + LOW for row in rows)
        if len(rows) > 1 and style.height < least:
            less = "leave the height out, or draw one panel"
            raise InputError(
                f"{style.height:g} mm are too low for {len(panels)} panels: {least:.0f} mm; {less}", key="size"
            )
        figure.set_figheight(style.height / INCH)
    figure.style = style
    grid = figure.add_gridspec(len(rows), columns, height_ratios=heights)
    for k, row in enumerate(rows):
        for column, panel in enumerate(row):
            panel.draw(subplot(figure, grid[k, :] if len(row) < columns else grid[k, column]))
    figure.finish()
    return figure
