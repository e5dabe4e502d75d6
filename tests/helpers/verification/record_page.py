"""The published figures among the numbers of the page of verification."""

from typing import Any

import numpy as np

from .record import Figure, cases, figures

#: digits beyond those printed
MORE = 2


def numbers() -> dict[str, list[Any]]:
    """The cases with their sources, and a row for every figure."""
    sources = [
        {"case": case.name, **{key: case.raw[key] for key in ("title", "source", "place", "read")}}
        for case in cases().values()
    ]
    return {"sources": sources, "published": [row(figure) for figure in figures()]}


def row(figure: Figure) -> dict[str, Any]:
    """What the page says of one figure; of several numbers the one that differs most."""
    k = int(np.argmax(np.abs(figure.jointplay - figure.printed)))
    digits = figure.decimals + MORE
    return {
        "case": figure.case.name,
        "figure": figure.what,
        "unit": figure.raw["unit"],
        "numbers": figure.printed.size,
        "printed": figure.texts[k],
        "method": "" if figure.method is None else f"{figure.method[k]:.{digits}f}",
        "jointplay": f"{figure.jointplay[k]:.{digits}f}",
        "difference": float(f"{figure.off(figure.jointplay):.2g}"),
        "tolerance": figure.tolerance,
        "agrees": figure.found,
        "remark": figure.remark,
    }
