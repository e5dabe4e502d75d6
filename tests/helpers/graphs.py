"""Random planar mechanisms of any graph, under one load, as the text of their files.

An open chain, or a closed one with a drive for every degree of freedom, to whose bodies dyads are added: two
links and three joints, or a link with a pin and a slot, which leave the freedom as it is. Points lie anywhere, and
the load and the output are each on any body.
"""

import math

import numpy as np

from helpers.layouts import GROUND, Layout
from helpers.oracles.reading import read
from helpers.strategies import WELL_CONDITIONED, is_well_conditioned

KINDS = ("revolute", "prismatic", "pin_in_slot")


class Graph(Layout):
    """A layout that joins bodies at random places."""

    def any_joint(self, first: str, second: str, kind: str) -> int:
        axis = None if kind == "revolute" else float(self.rng.uniform(-math.pi, math.pi))
        return self.joint(kind, self.point(0.7, 0.7, 0.8), first, second, axis=axis)

    def any_kind(self, slots: bool = True) -> str:
        kind = str(self.rng.choice(KINDS, p=(0.65, 0.2, 0.15)))
        return "revolute" if kind == "pin_in_slot" and not slots else kind

    def chain(self, n: int, closed: bool) -> list[str]:
        """Bodies one after the other from the ground, the last one joined to it again if closed."""
        bodies = [f"b{k + 1}" for k in range(n)]
        pairs = list(zip([GROUND, *bodies], [*bodies, GROUND] if closed else bodies, strict=False))
        joints = [self.any_joint(a, b, self.any_kind(closed)) for a, b in pairs]
        freedom = sum(2 if self.joints[j]["kind"] == "pin_in_slot" else 1 for j in joints) - 3 * closed
        driven = self.rng.permutation(joints)[:freedom]
        for j in driven:
            self.drive(f"q{j}", int(j), 0.0)
        return bodies if len(driven) == freedom else []

    def dyad(self, bodies: list[str]) -> None:
        first, second = (str(b) for b in self.rng.choice([GROUND, *bodies], 2, replace=False))
        if self.rng.random() < 0.2:
            one = f"b{len(bodies) + 1}"
            self.any_joint(first, one, "revolute")
            self.any_joint(one, second, "pin_in_slot")
            bodies.append(one)
            return
        one, other = f"b{len(bodies) + 1}", f"b{len(bodies) + 2}"
        for a, b in ((first, one), (one, other), (other, second)):
            self.any_joint(a, b, self.any_kind(slots=False))
        bodies += [one, other]


def graph(seed: int, play: float | None = None, *, lost: bool = False) -> str:
    """The file of a random mechanism with one load and one configuration; the same seed gives the same file.

    The largest clearance is `play` of the size, by default anything from 0.01 % to 10 %. Half of the drives have lost
    motion, if asked.
    """
    rng = np.random.default_rng([2026, seed])
    while True:
        size = float(10 ** rng.uniform(-4, -1)) if play is None else play
        m = Graph(rng, size, tolerances=False)
        m.lost = m.lost if lost else None
        shape = rng.integers(3)
        bodies = m.chain(int(rng.integers(1, 4)), False) if shape == 0 else m.chain(int(rng.integers(2, 5)), True)
        for _ in range(int(rng.integers(1, 3)) if shape == 2 else 0):
            if bodies:
                m.dyad(bodies)
        if not bodies or not m.drives:
            continue
        m.output = (str(rng.choice(bodies)), m.point(0.7, 0.7, 0.8))
        m.load(str(rng.choice(bodies)), m.point(0.7, 0.7, 0.8), moment=bool(rng.random() < 0.3))
        text = m.text((0.0,))
        if is_well_conditioned(read(text), WELL_CONDITIONED):
            return text
