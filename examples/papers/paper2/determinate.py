"""The determinate structure in the order of figure 14, vertex by vertex with equations (6), (7) and (13) to (16).

Every step connects two links from two bases. With matrices on the offsets of the pins beside the deviations:

    delta = lambda_1 (dl_1, dl_2) + lambda_2 delta_1 + lambda_3 delta_2                            (7)

An offset in a base moves the link as the base itself would; where a bar rides on the pin at the vertex, the offset acts
along that bar. The triangle on the inner panel is from then on a closed-chain link A1D2, and its length is off by what
D is off along AD.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

import jointplay as jp

from . import published
from .published import CLEARANCE, PLACES, Floats

#: the centres that are drawn on the body that carries their pin, by the step that brings them
CENTRES = {1: ("E", "F", "D/ED"), 2: ("A", "B"), 3: ("I",)}


@dataclass(frozen=True)
class Off:
    """How far a place is off: by the deviations (mm), and by the offset of every pin."""

    error: Floats
    by_play: Mapping[str, Floats] = field(default_factory=dict)

    def with_play(self, pin: str) -> Off:
        """The end of a bar that rides on a pin here, or carries it."""
        return Off(self.error, {**self.by_play, pin: np.eye(2)})

    @property
    def open(self) -> Floats:
        """How far the play reaches along each axis, to both sides."""
        rows = [np.linalg.norm(matrix, axis=1) for matrix in self.by_play.values()]
        return np.asarray(CLEARANCE * np.sum(rows, axis=0)) if rows else np.zeros(2)

    def along(self, direction: Floats) -> tuple[float, float]:
        """The same along a direction: by the deviations, and how far the play reaches."""
        reach = sum(float(np.linalg.norm(direction @ matrix)) for matrix in self.by_play.values())
        return float(direction @ self.error), CLEARANCE * reach


def vertex(at: str, bases: Mapping[str, Off], lengths: Mapping[str, float], rider: str = "", pin: str = "") -> Off:
    """The vertex of two bars from two bases, by name of place and deviation of length; one may ride on a pin there."""
    (a, b), ends = bases, list(bases.values())
    by_length, *by_base = published.at_vertex(PLACES[a], PLACES[b], PLACES[at])
    error = by_length @ [lengths[a], lengths[b]] + sum(m @ end.error for m, end in zip(by_base, ends, strict=True))
    play: dict[str, Floats] = {}
    for matrix, end in zip(by_base, ends, strict=True):
        for name, own in end.by_play.items():
            # A pin that both bases depend on moves both of them.
            play[name] = play.get(name, np.zeros((2, 2))) + matrix @ own
    if pin:
        bar = PLACES[at] - PLACES[rider]
        play[pin] = np.outer(by_length[:, [a, b].index(rider)], bar / np.linalg.norm(bar))
    return Off(np.asarray(error), play)


def by_formulas() -> dict[str, Off]:
    """Errors of the vertices on the inner panel, in the order of figure 14."""
    dl = {bar: deviation for bar, (_, deviation) in published.lengths().items()}
    along = np.array([1.0, 0.0])
    a, e, f = Off(np.zeros(2)), Off(dl["AE"] * along), Off(dl["AF"] * along)
    # DF carries the pin in D, and ED, BD and DI ride on it; the cabin those in A and B; the outer panel that in I.
    d = vertex("D", {"E": e.with_play("E"), "F": f.with_play("F_DF")}, {"E": dl["ED"], "F": dl["DF"]}, "E", "D/ED")
    b = vertex("B", {"A": a.with_play("A"), "D": d.with_play("D/BD")}, {"A": dl["AB"], "D": dl["BD"]}, "D", "B")
    i = vertex("I", {"D": d.with_play("D/DI"), "F": f.with_play("F")}, {"D": dl["DI"], "F": dl["FI"]}, "D", "I")
    return {"E": e, "F": f, "D/ED": d, "A": a.with_play("A"), "B": b, "I": i}


def closed_chain(d: Off) -> tuple[float, float, float]:
    """The closed-chain link A1D2 by formulas: length, what it is off, and how far the play of its pins reaches."""
    size = float(np.linalg.norm(PLACES["D"]))
    return size, *d.along(PLACES["D"] / size)


def on_the_cabin(link: float) -> dict[str, Floats]:
    """Errors in the cabin's axes, of D by the links A1D2 and BD, then of F and of I; deviations alone."""
    dl = {bar: deviation for bar, (_, deviation) in published.lengths().items()}
    a, b = Off(np.zeros(2)), Off(np.array([0.0, dl["AB"]]))
    d = vertex("D", {"A": a, "B": b}, {"A": link, "B": dl["BD"]})
    f = vertex("F", {"A": a, "D": d}, {"A": dl["AF"], "D": dl["DF"]})
    i = vertex("I", {"D": d, "F": f}, {"D": dl["DI"], "F": dl["FI"]})
    return {"D": d.error, "F": f.error, "I": i.error}


def triangle() -> jp.Mechanism:
    """The closed-chain link between A, held at the origin, and D, on a slider along the x axis."""
    c, s = PLACES["D"] / np.linalg.norm(PLACES["D"])
    a, e, f, d = ((np.array([[c, s], [-s, c]]) @ PLACES[name]).tolist() for name in "AEFD")
    deviation = {bar: deviation for bar, (_, deviation) in published.lengths().items()}
    pins = {"E": ("AF", "ED", e), "F": ("AF", "DF", f), "D": ("DF", "ED", d)}
    b = jp.Builder(space="planar", units={"length": "mm", "angle": "deg", "force": "N"})
    b.revolute("A", bodies=["ground", "AF"], at=a)
    b.revolute("end", bodies=["DF", "slider"], at=d)
    b.prismatic("guide", bodies=["ground", "slider"], at=d, axis=(1, 0))
    b.output(body="slider", at=d)
    for name, (first, second, at) in pins.items():
        b.revolute(name, bodies=[first, second], at=at, clearance=jp.radial(CLEARANCE))
    between = {"AE": ("AF", "A", "E"), "AF": ("AF", "A", "F"), "ED": ("ED", "E", "D"), "DF": ("DF", "F", "D")}
    for bar, (body, *ends) in between.items():
        b.dimension(bar, body=body, between=ends, deviation=deviation[bar])
    return b.mechanism()


@dataclass(frozen=True)
class Determinate:
    """The structure with free hinges."""

    #: its steps
    unit: xr.Dataset
    #: errors of its vertices by the formulas, by joint
    formulas: dict[str, Off]
    #: of the closed-chain link A1D2 by formulas: length, what it is off, and how far the play reaches
    link: tuple[float, float, float]
    #: the same by jointplay, with the play to either side: what it is off, the least and the most
    link_exact: tuple[float, float, float]
    #: errors of D, F and I in the cabin's axes: by formulas, by jointplay
    cabin: dict[str, tuple[Floats, Floats]]


def determinate(m: jp.Mechanism) -> Determinate:
    """Ask everything of the structure with free hinges."""
    formulas, link = by_formulas(), triangle()
    length = closed_chain(formulas["D/ED"])
    low, high = jp.worst(link).worst_component.isel(configuration=0).sel(component="x").values
    bodies = {"D": "DF", "F": "AF", "I": "FI"}
    exact = {name: jp.given(m.with_({"output": {"body": body, "at": name}})) for name, body in bodies.items()}
    placed = {name: np.asarray(found.error.values[0, :2]) for name, found in exact.items()}
    return Determinate(
        unit=jp.assemble(m),
        formulas=formulas,
        link=length,
        link_exact=(float(jp.given(link).error.values[0, 0]), float(low), float(high)),
        cabin={name: (error, placed[name]) for name, error in on_the_cabin(length[1]).items()},
    )
