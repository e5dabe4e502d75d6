"""The determinate structure in the order of figure 14, vertex by vertex with equations (6), (7) and (13) to (16).

Every step connects two links. With the bases' errors, and the play of all pins, as matrices on their offsets:

    delta = lambda_1 (dl_1, dl_2) + lambda_2 delta_1 + lambda_3 delta_2                            (7)

A pin that a bar rides on acts along that bar only. The triangle on the inner panel is a closed-chain link A1D2 for the
rest: its length changes by what D moves along AD.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

import jointplay as jp

from . import published
from .published import CLEARANCE, PLACES, Floats

#: what each step brings, on which of its bodies it is drawn, and by which dimension
LINKS = ("ED", "DF", "AB", "BD", "DI", "FI")


@dataclass(frozen=True)
class Off:
    """How far a place is off: by the deviations, and by the offset of every pin with play; mm."""

    error: Floats
    by_play: Mapping[str, Floats] = field(default_factory=dict)

    def loose(self, pin: str) -> Off:
        """The place of a rider's end on a pin here."""
        return Off(self.error, {**self.by_play, pin: np.eye(2)})

    @property
    def open(self) -> Floats:
        """How far the play reaches along each axis, to both sides."""
        rows = (np.linalg.norm(matrix, axis=1) for matrix in self.by_play.values())
        return np.asarray(CLEARANCE * sum(rows, start=np.zeros(2)))

    def along(self, direction: Floats) -> tuple[float, float]:
        """The same along a direction: by the deviations, and how far the play reaches."""
        reach = sum(float(np.linalg.norm(direction @ matrix)) for matrix in self.by_play.values())
        return float(direction @ self.error), CLEARANCE * reach


def vertex(at: str, bars: tuple[str, str], bases: tuple[Off, Off], rides: tuple[int, str], dl: tuple[float, float]) -> Off:
    """The vertex of two bars, each from its base to `at`; one of them rides there on a pin that the other carries."""
    places = [PLACES[bar.replace(at, "")] for bar in bars]
    lengths, *ends = published.at_vertex(*places, PLACES[at])
    bar, pin = rides
    along = (PLACES[at] - places[bar]) / np.linalg.norm(PLACES[at] - places[bar])
    error = lengths @ dl + sum(matrix @ base.error for matrix, base in zip(ends, bases, strict=True))
    play = {
        name: matrix @ own for matrix, base in zip(ends, bases, strict=True) for name, own in base.by_play.items()
    }
    # What bases share moves both of them.
    shared = set(bases[0].by_play) & set(bases[1].by_play)
    play |= {name: sum(m @ b.by_play[name] for m, b in zip(ends, bases, strict=True)) for name in shared}
    return Off(error, {**play, pin: np.outer(lengths[:, bar], along)})
