"""Random mechanisms of every planar kind with wide clearances: 0.1 to 10 % of their size, each drawn by itself.

Joints stand anywhere in a square, guides point anywhere, bodies have frames of their own, and the bodies of a joint
come in any order. The mechanism is assembled where it is laid out; layouts near a singular one are drawn again.
"""

import cmath
import itertools
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from helpers.oracles.reading import read

GROUND = "ground"
#: kinds as loops or chains of joints in their order: R turns, P slides, S is a pin in a slot; a small letter is driven
LOOPS = (
    "rRRR RrRR rRRP RRRp rRPR RRpR RpRP rPRP pRPR RRPr rPPR pRRR rSR rSP RsR rRSr rPSr rRRRr rRRPr pRRRp rPRRr rRPRp"
)
CHAINS = "rr rp pr pp rrr ppr prp rpp ppp rrp prr pppp rprp"
#: legs of a platform; all legs of one robot are alike
LEGS = "rRR RpR pRR RRp rPR RrR"
#: a loop, and a dyad from its third body to the ground
SIX_BARS = "rRRR+RRR rRRR+RRP rRRP+RRR RpRR+RPR"
FAMILIES = {"loop": LOOPS, "chain": CHAINS, "platform": LEGS, "six-bar": SIX_BARS}
KINDS = tuple(f"{family} {shape}" for family, shapes in FAMILIES.items() for shape in shapes.split())
#: the smallest singular value of the length-scaled Jacobian
LEAST = 0.05
NAMES = {"r": "revolute", "p": "prismatic", "s": "pin_in_slot"}


@dataclass
class Wide:
    """A mechanism where it is laid out; points are complex numbers, angles radians."""

    rng: np.random.Generator
    least: float = 1e-3
    most: float = 0.1
    shuffled: bool = True
    size: float = 100.0
    frames: dict[str, tuple[complex, float]] = field(default_factory=lambda: {GROUND: (0j, 0.0)})
    joints: list[dict[str, Any]] = field(default_factory=list)
    drives: list[str] = field(default_factory=list)

    def point(self) -> complex:
        return complex(*self.rng.uniform(-self.size, self.size, 2))

    def play(self) -> float:
        """A part of the size, any order of magnitude as likely as another."""
        return self.size * float(np.exp(self.rng.uniform(math.log(self.least), math.log(self.most))))

    def joint(self, kind: str, first: str, second: str) -> None:
        for body in (first, second):
            if body not in self.frames:
                self.frames[body] = (self.point(), float(self.rng.uniform(-math.pi, math.pi)))
        bodies = [first, second]
        if self.shuffled and self.rng.random() < 0.5:
            bodies.reverse()
        name, type_ = f"J{len(self.joints) + 1}", NAMES[kind.lower()]
        at, along = self.point(), cmath.exp(1j * self.rng.uniform(-math.pi, math.pi))
        start = at if type_ == "revolute" else at - self.rng.uniform(-0.6, 0.6) * self.size * along
        play = self.play() if self.rng.random() < 0.9 or not self.joints else None
        if type_ == "prismatic" and play is not None:
            clearance = f"gap = {0.5 * play!r}, length = {self.size * self.rng.uniform(0.2, 1.0)!r}"
        elif play is not None:
            clearance = f"{'gap' if type_ == 'pin_in_slot' else 'radial'} = {play!r}"
        else:
            clearance = ""
        self.joints.append(
            {"name": name, "type": type_, "bodies": bodies, "places": [start, at], "along": along, "play": clearance}
        )
        if kind.islower():
            self.drives.append(name)

    def chain(self, kinds: str, bodies: list[str]) -> None:
        for kind, pair in zip(kinds, itertools.pairwise(bodies), strict=True):
            self.joint(kind, *pair)

    def local(self, body: str, point: complex) -> str:
        origin, angle = self.frames[body]
        p = (point - origin) * cmath.exp(-1j * angle)
        return f"[{p.real!r}, {p.imag!r}]"

    def value(self, joint: dict[str, Any]) -> float:
        """The coordinate of a driven joint: degrees or lengths."""
        if joint["type"] == "revolute":
            first, second = (self.frames[body][1] for body in joint["bodies"])
            return math.degrees(second - first)
        start, end = joint["places"]
        return float(((end - start) / joint["along"]).real)

    def text(self, body: str) -> str:
        lines = ["format = 1", 'units = { length = "mm", angle = "deg", force = "N" }']
        for j in self.joints:
            places = []
            for k, (b, at) in enumerate(zip(j["bodies"], j["places"], strict=True)):
                place = self.local(b, at)
                if j["type"] == "prismatic" or (j["type"] == "pin_in_slot" and k == 0):
                    axis = math.degrees(cmath.phase(j["along"]) - self.frames[b][1])
                    place = f"{{ at = {place}, axis = {axis!r} }}"
                places.append(f"{b} = {place}")
            lines += [f"[joints.{j['name']}]", f'type = "{j["type"]}"', f"on = {{ {', '.join(places)} }}"]
            lines += [f"clearance = {{ {j['play']} }}"] if j["play"] else []
        lines += ["[start]"]
        for b, (origin, angle) in self.frames.items():
            if b != GROUND:
                lines += [f"{b} = {{ x = {origin.real!r}, y = {origin.imag!r}, angle = {math.degrees(angle)!r} }}"]
        for d, name in enumerate(self.drives):
            j = next(j for j in self.joints if j["name"] == name)
            lines += [f"[drives.q{d}]", f'joint = "{name}"', f"values = [{self.value(j)!r}]"]
            if self.rng.random() < 0.5:
                error = 0.5 * self.play()
                lines += [f"error = {error if j['type'] == 'prismatic' else math.degrees(error / self.size)!r}"]
        lines += self.dimensions()
        return "\n".join([*lines, "[output]", f'body = "{body}"', f"at = {self.local(body, self.point())}"]) + "\n"

    def dimensions(self) -> list[str]:
        """Tolerances of some bodies' lengths between two of their pins."""
        lines: list[str] = []
        for body in self.frames:
            pins = [j["name"] for j in self.joints if body in j["bodies"] and j["type"] == "revolute"]
            if body == GROUND or len(pins) < 2 or self.rng.random() < 0.5:
                continue
            plus, minus = 0.5 * self.play(), 0.5 * self.play()
            lines += [f"[dimensions.l_{body}]", f'body = "{body}"', f'between = ["{pins[0]}", "{pins[1]}"]']
            lines += [f"tolerance = {{ plus = {plus!r}, minus = {minus!r} }}"]
            lines += [f"deviation = {self.rng.uniform(-0.5 * minus, 0.5 * plus)!r}"] if self.rng.random() < 0.3 else []
        return lines


def lay_out(m: Wide, kind: str) -> str:
    """The joints of a kind of mechanism; the file."""
    family, shape = kind.split()
    if family == "chain":
        bodies = [GROUND, *"abcd"[: len(shape)]]
        m.chain(shape, bodies)
        output = bodies[-1]
    elif family == "platform":
        for leg in range(3):
            m.chain(shape, [GROUND, f"l{leg}", f"r{leg}", "p"])
        output = "p"
    else:
        loop, _, dyad = shape.partition("+")
        bodies = [GROUND, *"abcd"[: len(loop) - 1], GROUND]
        m.chain(loop, bodies)
        m.chain(dyad, ["b", "e", "f", GROUND] if dyad else [GROUND])
        output = str(m.rng.choice([*bodies[1:-1], *("ef" if dyad else "")]))
    return m.text(output)


def mechanism(kind: str, seed: int, **options: Any) -> str:
    """The file of a random mechanism of a kind; the same arguments give the same file."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    for _ in range(500):
        text = lay_out(Wide(rng, size=float(rng.uniform(50, 150)), **options), kind)
        link = read(text)
        values = link.configurations[0]
        q = link.nominal(values)
        if link.smallest_singular_value(q, values) > LEAST:
            return text
    raise AssertionError(f"no regular {kind} in 500 draws from seed {seed}")
