"""The five-bar of the paper's figure 1: four ways to assemble one loop.

Five bars in a loop have two freedoms; two joints that are locked take them away. Bars that are locked together are one
link, so that which joints these are decides what the steps are.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

import jointplay as jp

from .published import Floats

#: chosen here, mm: the figure has no lengths
PLACES = {"A": (0.0, 0.0), "B": (200.0, 0.0), "C": (250.0, 150.0), "D": (100.0, 240.0), "E": (-50.0, 150.0)}
BARS = ("AE", "BC", "CD", "DE")
PLAY = 0.1
#: the redundant bar from the middle of BC to the middle of DE, and by how much it is too long
REDUNDANT, LONGER = ("BC", "DE"), 0.2


@dataclass(frozen=True)
class Way:
    """Which joints are locked, and what is added one after the other."""

    words: str
    locked: tuple[str, str]
    steps: tuple[tuple[str, ...], ...]


WAYS: Mapping[str, Way] = {
    "a": Way("both locked joints at the base", ("A", "B"), (("AE",), ("BC",), ("CD", "DE"))),
    "b": Way("both away from the base", ("C", "E"), (("AE", "DE", "BC", "CD"),)),
    "c": Way("one at the base, one away from it", ("A", "C"), (("AE",), ("BC", "CD", "DE"))),
    "d": Way("as (a), and a redundant bar KM", ("A", "B"), (("AE",), ("BC",), ("CD", "DE"), ("KM",))),
}


@dataclass(frozen=True)
class Loop:
    """A way with what comes out."""

    way: Way
    #: `unit`, `worst`: the steps with perfect parts (but for the bar KM), and the worst over the play
    unit: xr.Dataset
    worst: xr.Dataset


def middle(bar: str) -> Floats:
    """The middle of a bar."""
    return np.mean([PLACES[end] for end in bar], axis=0)


def mechanism(way: Way) -> jp.Mechanism:
    """The loop, with as much play in locked joints as in the others."""
    parts = ['format = 1\nunits = { length = "mm", angle = "deg", force = "N" }\n']

    def joint(name: str, bodies: tuple[str, ...], at: tuple[float, ...], kind: str = "revolute") -> None:
        names = ", ".join(f'"{body}"' for body in bodies)
        parts.append(f'[joints.{name}]\ntype = "{kind}"\nbodies = [{names}]\nat = [{at[0]}, {at[1]}]\n')
        parts.append(f"clearance = {{ radial = {PLAY} }}\n")

    for name, at in PLACES.items():
        bodies = tuple(bar for bar in BARS if name in bar)
        kind = "fixed" if name in way.locked else "revolute"
        joint(name, ("ground", *bodies) if len(bodies) == 1 else bodies, at, kind)
    if ("KM",) in way.steps:
        for name, bar in zip("KM", REDUNDANT, strict=True):
            joint(name, (bar, "KM"), tuple(middle(bar)))
        parts.append(f'[dimensions.KM]\nbody = "KM"\nbetween = ["K", "M"]\ndeviation = {LONGER}\n')
    parts.append('[output]\nbody = "DE"\nat = "D"\n[assembly]\nsteps = [')
    parts.append(", ".join("[" + ", ".join(f'"{body}"' for body in step) + "]" for step in way.steps) + "]\n")
    return jp.loads("".join(parts), "five-bar-loop.toml")


def loops() -> dict[str, Loop]:
    """All four ways, by their letter in the figure."""
    found = {}
    for letter, way in WAYS.items():
        m = mechanism(way)
        found[letter] = Loop(way, jp.assemble(m), jp.assemble(m, "worst"))
    return found
