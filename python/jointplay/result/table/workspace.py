"""What bounds a workspace, and where disc and box are."""

import numpy as np

from jointplay.result import Result
from jointplay.result.conclusions.workspace import bound_words

from .layout import ResultTable, numbers, words


def overview(result: Result) -> list[ResultTable]:
    """The tables of `workspace`."""
    shares = result.get("share")
    bounds = ResultTable(
        "What bounds it",
        (
            words("bound", [bound_words(word) for word in result.labels("bound")], is_key=True),
            numbers("of the\nboundary", "%", 100.0 * shares, digits=3),
        ),
    )
    names = ("disc_centre", "box_low", "box_high")
    values = np.array([result.get(name) for name in names])
    ball = "disc" if values.shape[1] == 2 else "ball"
    unit = result.unit("disc_centre")
    inscribed = ResultTable(
        "Largest in it" if "centre" not in result.attrs else "Largest about the centre",
        (
            words("", [f"centre of the {ball}", "box from", "box to"], is_key=True),
            *(numbers(name, unit, values[:, k]) for k, name in enumerate(result.labels("along"))),
        ),
    )
    return [table for table, there in ((bounds, len(shares)), (inscribed, np.isfinite(values).any())) if there]
