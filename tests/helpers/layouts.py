"""Layouts of planar mechanisms with random proportions, in one assembled configuration, and the files they
make.

Every mechanism is laid out in ground axes (joint points, directions of guides); the bodies then get frames
at random and the file is written in body axes. So the start is assembled by construction, whatever the
graph.
"""

import cmath
import math
from collections.abc import Callable
from typing import Any

import numpy as np

GROUND = "ground"


class Layout:
    """A mechanism in its reference configuration; points are complex numbers, angles radians."""

    def __init__(self, rng: np.random.Generator, play: float, tolerances: bool, spread: float = 1.0) -> None:
        self.rng, self.play, self.tolerances, self.spread = rng, play, tolerances, spread
        self.frames: dict[str, tuple[complex, float]] = {GROUND: (0j, 0.0)}
        self.joints: list[dict[str, Any]] = []
        self.drives: list[tuple[str, int, float]] = []
        self.dimensions: list[tuple[str, str, str, str]] = []
        self.loads: list[tuple[str, complex, complex, float]] = []
        self.output: tuple[str, complex] = (GROUND, 0j)
        self.size = rng.uniform(40, 150)
        # Of its own, so that the layout is the same without lost motion in its drives; nothing where they have none.
        self.lost: np.random.Generator | None = rng.spawn(1)[0]

    def point(self, x: float, y: float, spread: float = 0.15) -> complex:
        """Around (x, y), in units of the mechanism's size; further from there, the larger the layout's own spread."""
        dx, dy = self.spread * self.rng.uniform(-spread, spread, 2)
        return complex(x + dx, y + dy) * self.size

    def frame(self, body: str) -> tuple[complex, float]:
        if body not in self.frames:
            origin = self.point(0, 0, 1.0)
            self.frames[body] = (origin, float(self.rng.uniform(-math.pi, math.pi)))
        return self.frames[body]

    def local(self, body: str, p: complex) -> complex:
        origin, angle = self.frame(body)
        return (p - origin) * cmath.exp(-1j * angle)

    def joint(self, kind: str, at: complex, *bodies: str, axis: float | None = None) -> int:
        """Bodies in their order, the second one's point at `at`; the first's somewhere along a guide."""
        first_at = at
        if kind in ("prismatic", "pin_in_slot"):
            first_at = at - self.rng.uniform(-0.6, 0.6) * self.size * cmath.exp(1j * axis)
        # The first joint always has play, so that no mechanism is without any.
        loose = self.rng.random() < 0.85 or not self.joints
        clearance = self.size * self.play * self.rng.uniform(0.3, 1.0) if loose else None
        self.joints.append(
            {
                "kind": kind,
                "bodies": bodies,
                "at": at,
                "first_at": first_at,
                "axis": axis,
                "clearance": clearance,
            }
        )
        return len(self.joints) - 1

    def drive(self, name: str, joint: int, step: float) -> None:
        self.drives.append((name, joint, step))

    def dimension(self, name: str, body: str, start: int, end: int | str) -> None:
        if self.tolerances:
            self.dimensions.append((name, body, f"J{start + 1}", end if isinstance(end, str) else f"J{end + 1}"))

    def load(self, body: str, at: complex, moment: bool = True) -> None:
        force = self.rng.uniform(5, 20) * cmath.exp(1j * self.rng.uniform(-math.pi, math.pi))
        arm = self.rng.uniform(-0.3, 0.3) * self.size if moment else 0.0
        self.loads.append((body, at, force, abs(force) * arm))

    # -- the file -----------------------------------------------------

    def coordinate(self, j: dict[str, Any]) -> float:
        if j["kind"] == "revolute":
            return self.frame(j["bodies"][1])[1] - self.frame(j["bodies"][0])[1]
        return ((j["at"] - j["first_at"]) * cmath.exp(-1j * j["axis"])).real

    def placement(self, j: dict[str, Any], body: str, at: complex) -> str:
        p = self.local(body, at)
        if j["kind"] == "revolute" or (j["kind"] == "pin_in_slot" and body != j["bodies"][0]):
            return f"[{p.real!r}, {p.imag!r}]"
        e = cmath.exp(1j * ((j["axis"] or 0.0) - self.frame(body)[1]))
        return f"{{ at = [{p.real!r}, {p.imag!r}], axis = [{e.real!r}, {e.imag!r}] }}"

    def clearance(self, j: dict[str, Any]) -> str | None:
        c, kind = j["clearance"], j["kind"]
        if kind == "fixed":
            tolerance = math.degrees(self.play) * float(self.rng.uniform(0.2, 0.6))
            return f"angle = {{ tolerance = {tolerance!r} }}"
        if c is None:
            return None
        c = float(c)
        if kind == "prismatic":
            length = self.size * float(self.rng.uniform(0.4, 0.9))
            return f"clearance = {{ gap = {c * 0.3!r}, length = {length!r} }}"
        if kind == "pin_in_slot":
            return f"clearance = {{ gap = {c!r} }}"
        return f"clearance = {{ radial = {c!r} }}"

    def backlash(self, size: float) -> list[str]:
        """The line of a drive, if it has lost motion: on both sides or on one."""
        if not self.play or self.lost is None:
            return []
        width, form = float(self.lost.uniform(0.1, 0.5) * self.play * size), self.lost.random()
        if form < 0.5:
            return []
        return [f"backlash = {width!r}" if form < 0.8 else f"backlash = {{ plus = {width!r}, minus = 0 }}"]

    def text(self, offsets: tuple[float, ...]) -> str:
        """The file, with drive values at the reference plus `offsets` of each drive's own step."""
        lines = [
            "format = 1",
            'space = "planar"',
            'units = { length = "mm", angle = "deg", force = "N" }',
            "",
        ]
        for i, j in enumerate(self.joints):
            places = []
            for k, body in enumerate(j["bodies"]):
                at = j["first_at"] if k == 0 else j["at"]
                places.append(f"{body} = {self.placement(j, body, at)}")
            lines += [f"[joints.J{i + 1}]", f'type = "{j["kind"]}"', f"on = {{ {', '.join(places)} }}"]
            clearance = self.clearance(j)
            lines += ([clearance] if clearance else []) + [""]
        lines += ["[start]"]
        for body, (origin, angle) in self.frames.items():
            if body != GROUND:
                x, y = origin.real, origin.imag
                lines += [f"{body} = {{ x = {x!r}, y = {y!r}, angle = {math.degrees(angle)!r} }}"]
        for name, joint, step in self.drives:
            j = self.joints[joint]
            value = self.coordinate(j)
            angular = j["kind"] == "revolute"
            values = [value + step * o for o in offsets]
            values = [math.degrees(v) for v in values] if angular else values
            lines += [
                "",
                f"[drives.{name}]",
                f'joint = "J{joint + 1}"',
                f"values = {[float(v) for v in values]!r}",
            ]
            if self.tolerances and self.rng.random() < 0.5:
                lines += [f"error = {float(0.2 * self.play * (60 if angular else self.size))!r}"]
            lines += self.backlash(60 if angular else self.size)
        for name, body, start, end in self.dimensions:
            tolerance = float(self.size * self.play * self.rng.uniform(0.1, 0.5))
            lines += ["", f"[dimensions.{name}]", f'body = "{body}"', f'between = ["{start}", "{end}"]']
            lines += [f"tolerance = {tolerance!r}"]
        body, p = self.output[0], self.local(*self.output)
        lines += ["", "[output]", f'body = "{body}"', f"at = [{p.real!r}, {p.imag!r}]"]
        for body, at, force, moment in self.loads:
            p = self.local(body, at)
            lines += ["", "[[loads]]", f'body = "{body}"', f"at = [{p.real!r}, {p.imag!r}]"]
            lines += [f"force = [{force.real!r}, {force.imag!r}]", f"moment = {float(moment)!r}"]
        return "\n".join(lines) + "\n"


# -- kinds of mechanisms ------------------------------------------


def open_chain(m: Layout) -> None:
    n = int(m.rng.integers(2, 5))
    at, body = m.point(0, 0), GROUND
    previous = None
    for k in range(n):
        link = f"link{k + 1}"
        if k and m.rng.random() < 0.3:
            axis = m.rng.uniform(-math.pi, math.pi)
            j = m.joint("prismatic", at, body, link, axis=axis)
            m.drive(f"d{k + 1}", j, 0.1 * m.size)
        else:
            j = m.joint("revolute", at, body, link)
            m.drive(f"q{k + 1}", j, 0.2)
            if previous is not None and m.joints[previous]["kind"] == "revolute":
                m.dimension(f"l{k}", body, previous, j)
        previous, body = j, link
        at = at + m.size * m.rng.uniform(0.5, 1.0) * cmath.exp(1j * m.rng.uniform(-math.pi, math.pi))
    m.output = (body, at)
    m.load(body, at)


def _loop(m: Layout) -> tuple[list[complex], list[int]]:
    A, B, C, D = m.point(0, 0), m.point(0.1, 0.6), m.point(1.1, 1.0), m.point(1.1, 0)
    j = [m.joint("revolute", A, GROUND, "crank"), m.joint("revolute", B, "crank", "coupler")]
    j += [m.joint("revolute", C, "coupler", "rocker"), m.joint("revolute", D, GROUND, "rocker")]
    m.drive("theta1", j[0], 0.15)
    m.dimension("l2", "coupler", j[1], j[2])
    m.dimension("l3", "rocker", j[3], j[2])
    return [A, B, C, D], j


def four_bar(m: Layout) -> None:
    points, _ = _loop(m)
    if m.rng.random() < 0.5:
        m.output = ("coupler", m.point(0.7, 1.3))
    else:
        m.output = ("rocker", points[2])
    m.load(*m.output)


def slider_crank(m: Layout) -> None:
    A, B, C = m.point(0, 0), m.point(0.2, 0.5, 0.1), m.point(1.4, 0.1)
    axis = m.rng.uniform(-0.25, 0.25)
    j = [m.joint("revolute", A, GROUND, "crank"), m.joint("revolute", B, "crank", "rod")]
    j += [m.joint("revolute", C, "rod", "slider")]
    guide = m.joint("prismatic", C + m.point(0, 0, 0.1), GROUND, "slider", axis=axis)
    m.drive("theta", j[0], 0.15)
    m.dimension("rod", "rod", j[1], j[2])
    m.output = ("slider", C + m.point(0.1, 0.1, 0.1))
    m.load(*m.output)
    assert guide == 3


def inverted_slider(m: Layout) -> None:
    """A rod driven along its guide in a swinging body pushes an arm; its guide, askew, is side-loaded."""
    _cylinder(m, m.rng.uniform(0.1, 0.3) * m.rng.choice([-1, 1]))


def _cylinder(m: Layout, askew: float) -> None:
    A, B, D = m.point(0, 0), m.point(0.9, 0.5), m.point(1.0, -0.2)
    axis = cmath.phase(B - A) + askew
    m.joint("revolute", A, GROUND, "cylinder")
    j = m.joint("prismatic", A + 0.6 * (B - A), "cylinder", "rod", axis=axis)
    m.joint("revolute", B, "rod", "arm")
    m.joint("revolute", D, GROUND, "arm")
    m.drive("stroke", j, 0.08 * m.size)
    m.output = ("arm", m.point(1.3, 0.9))
    m.load(*m.output)


def cylinder(m: Layout) -> None:
    """A hydraulic cylinder between two pins: its guide's play acts to second order only."""
    _cylinder(m, 0.0)


def five_bar(m: Layout) -> None:
    A, B, C, D, E = m.point(0, 0), m.point(-0.3, 0.6), m.point(0.5, 1.2), m.point(1.3, 0.6), m.point(1.0, 0)
    j = [m.joint("revolute", A, GROUND, "left"), m.joint("revolute", B, "left", "left_rod")]
    j += [m.joint("revolute", C, "left_rod", "right_rod")]
    j += [m.joint("revolute", D, "right", "right_rod"), m.joint("revolute", E, GROUND, "right")]
    m.drive("left", j[0], 0.12)
    m.drive("right", j[4], 0.1)
    m.dimension("rod", "left_rod", j[1], j[2])
    m.output = ("left_rod", C)
    m.load(*m.output)


def three_rrr(m: Layout) -> None:
    turn = m.rng.uniform(-0.25, 0.25)
    for k in range(3):
        e = cmath.exp(1j * (math.tau * k / 3 + math.pi / 2))
        base, tip = 1.6 * m.size * e, 0.5 * m.size * e * cmath.exp(1j * (turn + 0.5))
        elbow = (base + tip) / 2 - 0.55 * m.size * 1j * e * m.rng.uniform(0.9, 1.1)
        j = m.joint("revolute", base, GROUND, f"upper{k}")
        m.joint("revolute", elbow, f"upper{k}", f"lower{k}")
        m.joint("revolute", tip, f"lower{k}", "platform")
        m.drive(f"q{k}", j, 0.06)
        m.dimension(f"l{k}", f"lower{k}", j + 1, j + 2)
    m.output = ("platform", m.point(0, 0, 0.2))
    m.load(*m.output)


def watt(m: Layout) -> None:
    """Four-bar with a dyad from its rocker to ground (Watt II: the ternary links are adjacent)."""
    (_, _, C, D), j = _loop(m)
    E, F, G = D + 0.9 * (C - D) * cmath.exp(-0.5j), m.point(2.2, 0.9), m.point(2.4, 0)
    j += [m.joint("revolute", E, "rocker", "link"), m.joint("revolute", F, "link", "last")]
    j += [m.joint("revolute", G, GROUND, "last")]
    m.dimension("l5", "link", j[4], j[5])
    m.output = ("last", F)
    m.load("last", F)
    m.load("coupler", C, moment=False)


def stephenson(m: Layout) -> None:
    """Four-bar with a dyad from its coupler point to ground (Stephenson III)."""
    _, j = _loop(m)
    E, F, G = m.point(0.6, 1.5), m.point(1.5, 1.9), m.point(2.1, 1.0)
    j += [m.joint("revolute", E, "coupler", "link"), m.joint("revolute", F, "link", "last")]
    j += [m.joint("revolute", G, GROUND, "last")]
    m.dimension("l5", "last", j[6], j[5])
    m.output = ("link", m.point(1.1, 2.0))
    m.load(*m.output)


def scotch_yoke(m: Layout) -> None:
    A, B = m.point(0, 0), m.point(0.5, 0.5, 0.1)
    axis = m.rng.uniform(-0.1, 0.1)
    j = m.joint("revolute", A, GROUND, "crank")
    m.joint("pin_in_slot", B, "yoke", "crank", axis=axis + math.pi / 2 + m.rng.uniform(-0.2, 0.2))
    m.joint("prismatic", m.point(1, 0), GROUND, "yoke", axis=axis)
    m.drive("theta", j, 0.15)
    m.output = ("yoke", m.point(1.5, 0))
    m.load(*m.output)


def quick_return(m: Layout) -> None:
    A, B, D = m.point(0, 0), m.point(0.5, 0.2, 0.1), m.point(0, -0.9)
    j = m.joint("revolute", A, GROUND, "crank")
    m.joint("pin_in_slot", B, "arm", "crank", axis=cmath.phase(B - D) + m.rng.uniform(-0.1, 0.1))
    m.joint("revolute", D, GROUND, "arm")
    m.drive("theta", j, 0.15)
    m.output = ("arm", D + 1.8 * (B - D))
    m.load(*m.output)


def welded(m: Layout) -> None:
    """A four-bar whose rocker is two bodies, locked together with an angle tolerance."""
    A, B, C, D = m.point(0, 0), m.point(0.1, 0.6), m.point(1.1, 1.0), m.point(1.1, 0)
    j = m.joint("revolute", A, GROUND, "crank")
    m.joint("revolute", B, "crank", "coupler")
    m.joint("revolute", C, "coupler", "rocker")
    m.joint("revolute", D, GROUND, "foot")
    m.joint("fixed", (C + D) / 2, "foot", "rocker", axis=m.rng.uniform(-math.pi, math.pi))
    m.drive("theta", j, 0.15)
    m.output = ("rocker", m.point(1.4, 1.2))
    m.load(*m.output)


def triple_pin(m: Layout) -> None:
    """A four-bar whose pin C carries a third link, which pushes a slider."""
    A, B, C, D = m.point(0, 0), m.point(0.1, 0.6), m.point(1.1, 1.0), m.point(1.1, 0)
    j = m.joint("revolute", A, GROUND, "crank")
    m.joint("revolute", B, "crank", "coupler")
    m.joint("revolute", C, "coupler", "rocker", "push")
    m.joint("revolute", D, GROUND, "rocker")
    E = m.point(2.3, 0.9)
    m.joint("revolute", E, "push", "slider")
    m.joint("prismatic", E, GROUND, "slider", axis=m.rng.uniform(-0.3, 0.3))
    m.drive("theta", j, 0.12)
    m.output = ("slider", E)
    m.load(*m.output)
    m.load("push", C)


KINDS: dict[str, Callable[[Layout], None]] = {
    build.__name__: build
    for build in (
        open_chain,
        four_bar,
        slider_crank,
        inverted_slider,
        five_bar,
        three_rrr,
        watt,
        stephenson,
        scotch_yoke,
        quick_return,
        welded,
        triple_pin,
    )
}
#: mechanisms with sources that have no first-order effect at all: legitimate, but apart from the others
DEGENERATE: dict[str, Callable[[Layout], None]] = {"cylinder": cylinder}
