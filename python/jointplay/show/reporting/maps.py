"""The map of a report: the error over the grid of the file, with slices where it has three axes."""

import numpy as np
from matplotlib.figure import Figure

from jointplay import plot
from jointplay.model.mechanism import Mechanism
from jointplay.plot.ticks import subplot
from jointplay.result import Result, parts, quantity
from jointplay.result.conclusions import conclude
from jointplay.result.table import tables
from jointplay.result.table.html import folded, paragraphs, table

from .figures import blank, numbers, picture

#: of a map with two axes, inches
SIZE = (5.2, 4.0)
#: variables whose numbers the page has
KEPT = (
    *("error", "undetermined", "worst_position", "worst_rotation"),
    *("limit", "limit_met", "status", "contact_change"),
)


def content(m: Mechanism, result: Result) -> str:
    """What the section says and shows."""
    lead = paragraphs([sentence.text for sentence in conclude(result).sentences])
    several = [_picture(heading, part) for heading, part in parts(result)]
    others = folded("The same of other outputs and load cases", "".join(several[1:])) if several[1:] else ""
    blocks = "".join(table(found, title=True) for found in tables(result))
    return lead + several[0] + others + folded("Tables", blocks) + paragraphs(_notes(m, result), "note")


def _notes(m: Mechanism, result: Result) -> list[str]:
    assert m.grid is not None
    own = tuple(result.sizes[name] for name in str(result.attrs["grid"]).split(", "))
    if own == m.grid.shape:
        return []
    whole, shown = (" × ".join(map(str, shape)) for shape in (m.grid.shape, own))
    return [f"The grid of the file has {whole} nodes; {shown} of them are shown here, `jointplay map` computes all."]


def _picture(heading: str, part: Result) -> str:
    figures = [_drawn(part, name) for name in ("position", "rotation") if _is_something(part, name)]
    question = "under load" if part.attrs["question"] == "loaded" else "largest possible error"
    lead = f"Error over the grid of the file, {question}"
    said = ", ".join(filter(None, (lead, heading)))
    return picture(figures or [_drawn(part, "position")], f"{said}.", {"map.csv": numbers(part, KEPT)})


def _is_something(part: Result, name: str) -> bool:
    return bool(np.nan_to_num(quantity(part, name).values).any())


def _drawn(part: Result, name: str) -> Figure:
    if len(str(part.attrs["grid"]).split(", ")) > 2:
        return plot.map(part, name)
    figure = blank(*SIZE)
    plot.map(part, name, axes=subplot(figure))
    return figure
