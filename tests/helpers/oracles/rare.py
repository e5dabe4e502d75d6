"""Mechanisms whose shares of specimens outside the limits are known: sliders in a row and an arm at their end.

Drive errors X_i of the sliders, with directions d_i, those a_j of the pins of the arm, the offset v of a pin in its
hole and an output at p on the arm give

    error = sum_i d_i X_i + v + (R(a) - 1) p,    a = sum_j a_j

All are independent but for what is common to several components: v, a where p is not 0, a slider that runs askew, two
drives that are correlated. Given its value the errors along x and y and the angle are independent sums of numbers whose
distribution is convolved on a grid. Shares are sums over the grid of what is small, never 1 minus something.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import signal, special, stats

Floats = NDArray[np.float64]

#: cells of a sum, of what is common to several components, and of one component where another one depends on it
CELLS, COMMON, ACROSS = 16_000, 1_200, 400
#: a share that is none
NOTHING = 1e-13
#: specimens drawn at a time
PART = 1_000_000
#: points of a disc, around and outwards
DISC = (120, 40)
#: standard deviations after which a normal number ends
ENDLESS = 9.5


@dataclass(frozen=True)
class Law:
    """The law of one number, with its bounds (infinite where there are none), and what the file says of it."""

    text: str
    #: kind and numbers
    of: tuple[str, tuple[float, ...]]
    low: float
    high: float

    @property
    def is_bounded(self) -> bool:
        return math.isfinite(self.high)

    @property
    def ends(self) -> tuple[float, float]:
        """Bounds of the grid."""
        if self.is_bounded:
            return self.low, self.high
        return -ENDLESS * self.of[1][0], ENDLESS * self.of[1][0]

    def below(self, x: Floats) -> Floats:
        """Share below x."""
        kind, numbers = self.of
        if kind == "gauss":
            found: Floats = special.ndtr(x / numbers[0])
            return found
        if kind == "measured":
            return np.interp(x, numbers, np.linspace(0.0, 1.0, len(numbers)))
        u = np.clip((x - self.low) / (self.high - self.low), 0.0, 1.0)
        if kind == "uniform":
            return u
        if kind == "normal":
            return (special.ndtr(6.0 * u - 3.0) - special.ndtr(-3.0)) / (1.0 - 2.0 * special.ndtr(-3.0))
        if kind == "triangular":
            return np.where(u < 0.5, 2.0 * u * u, 1.0 - 2.0 * (1.0 - u) ** 2)
        shares: Floats = special.betainc(*numbers, u)
        return shares

    def above(self, x: Floats) -> Floats:
        """Share above x."""
        return self.below(-x) if self.of[0] == "gauss" else 1.0 - self.below(x)


def random_law(rng: np.random.Generator, size: float, *, unbounded: float = 0.4) -> Law:
    """A law of about this size, without bounds with this probability."""
    if rng.random() < unbounded:
        sigma = _short(size / 3.0)
        return Law(f"{{ sigma = {sigma} }}", ("gauss", (sigma,)), -math.inf, math.inf)
    plus = minus = _short(size)
    kind = rng.choice(["uniform", "normal", "triangular", "beta", "measured"])
    if kind == "measured":
        values = np.sort([_short(x) for x in size * rng.uniform(-1.0, 1.0, int(rng.integers(3, 12)))])
        values = np.concatenate([[-plus], values, [plus]])
        law = f"{{ measured = {values.tolist()} }}"
        return Law(f"{plus}\nlaw = {law}", ("measured", tuple(values.tolist())), -minus, plus)
    if rng.random() < 0.3:
        minus = _short(size * rng.uniform(0.0, 1.0)) or 0.0
    numbers: tuple[float, ...] = ()
    law = f'"{kind}"'
    if kind == "beta":
        numbers = tuple(float(x) for x in rng.integers(1, 5, 2))
        law = f"{{ beta = [{numbers[0]:g}, {numbers[1]:g}] }}"
    return Law(f"{{ plus = {plus}, minus = {minus} }}\nlaw = {law}", (str(kind), numbers), -minus, plus)


def _short(x: float) -> float:
    return float(f"{x:.3g}")


class Sum:
    """A sum of independent numbers: masses of cells of equal width."""

    def __init__(self, laws: list[Law], cells: int = CELLS) -> None:
        self.laws = laws
        ends = np.array([law.ends for law in laws]).reshape(-1, 2)
        self.low, self.high = ends.sum(axis=0).tolist()
        self.width = (self.high - self.low) / cells
        if not laws:
            self.centres, self.masses = np.zeros(1), np.ones(1)
            return
        masses, first = np.ones(1), 0.0
        for law, (low, high) in zip(laws, ends.tolist(), strict=True):
            # An odd number of cells over the law.
            count = max(1, math.ceil((high - low) / self.width))
            begin = 0.5 * (low + high) - 0.5 * count * self.width
            own = np.diff(law.below(begin + self.width * np.arange(count + 1)))
            masses = np.maximum(signal.fftconvolve(masses, own), 0.0)
            first += begin + 0.5 * self.width
        self.masses = masses
        self.centres = first + self.width * np.arange(len(masses))
        edges = first + self.width * (np.arange(len(masses) + 1) - 0.5)
        self._edges = edges
        self._below = np.concatenate([[0.0], np.cumsum(masses)])
        self._above = np.concatenate([np.cumsum(masses[::-1])[::-1], [0.0]])

    @property
    def is_bounded(self) -> bool:
        return all(law.is_bounded for law in self.laws)

    def below(self, x: Floats) -> Floats:
        """Share below x."""
        if not self.laws:
            return (x > 0.0).astype(float)
        if len(self.laws) == 1:
            # To the last digit, however near to its end.
            return self.laws[0].below(x)
        return np.interp(x, self._edges, self._below)

    def above(self, x: Floats) -> Floats:
        """Share above x."""
        if not self.laws:
            return (x < 0.0).astype(float)
        if len(self.laws) == 1:
            # To the last digit, however near to its end.
            return self.laws[0].above(x)
        return np.interp(x, self._edges, self._above)

    def outside(self, low: Floats, high: Floats) -> Floats:
        """Share outside an interval, all of it where the interval is empty."""
        return np.where(low < high, self.below(low) + self.above(high), 1.0)

    def coarse(self, cells: int) -> tuple[Floats, Floats]:
        """Middles and masses of so many cells."""
        if len(self.masses) <= cells:
            return self.centres, self.masses
        step = math.ceil(len(self.masses) / cells)
        pad = -len(self.masses) % step
        masses = np.pad(self.masses, (0, pad)).reshape(-1, step)
        places = np.pad(self.centres, (0, pad)).reshape(-1, step)
        total = masses.sum(axis=1)
        kept = total > 0.0
        return (masses * places).sum(axis=1)[kept] / total[kept], total[kept]


@dataclass
class Limits:
    """What is acceptable, mm and degrees."""

    x: tuple[float, float] = (-math.inf, math.inf)
    y: tuple[float, float] = (-math.inf, math.inf)
    angle: tuple[float, float] = (-math.inf, math.inf)
    position: float = math.inf
    rotation: float = math.inf

    def given(self) -> list[tuple[str, Any]]:
        """Those that there are, by name."""
        return [(name, value) for name, value in vars(self).items() if np.isfinite(value).any()]

    def text(self) -> str:
        lines = ["[limits]"]
        for name, value in self.given():
            if isinstance(value, tuple):
                ends = zip(("low", "high"), value, strict=True)
                value = f"{{ {', '.join(f'{key} = {end!r}' for key, end in ends if math.isfinite(end))} }}"
            lines.append(f"{name} = {value}")
        return "\n".join(lines)


@dataclass
class Chain:
    """A row of sliders with an arm at the end."""

    x: list[Law]
    y: list[Law]
    angle: list[Law]
    #: radius and law of the offset of the arm's pin
    disc: tuple[float, str] | None = None
    #: direction of a force at the arm's pin, degrees, which presses the pin to the edge of its disc
    load: float | None = None
    #: a slider with its direction, degrees
    askew: tuple[Law, float] | None = None
    #: two rows whose first drives are correlated and normal, and the rank correlation
    tied: tuple[str, str, float] | None = None
    #: where the output is on the arm
    at: tuple[float, float] = (0.0, 0.0)
    limits: Limits = field(default_factory=Limits)
    #: what is common and the sums, by the fineness of their grids
    _known: dict[float, tuple[Floats, Floats, dict[str, Sum]]] = field(default_factory=dict)

    def text(self) -> str:
        """The mechanism file."""
        joints, drives, body = [], [], "ground"
        rows = [(f"x{k}", 0.0, law) for k, law in enumerate(self.x)]
        rows += [(f"y{k}", 90.0, law) for k, law in enumerate(self.y)]
        if self.askew is not None:
            rows.append(("z0", self.askew[1], self.askew[0]))
        for name, direction, law in rows:
            on = f"{body} = {{ at = [0, 0], axis = {direction} }}, s{name} = {{ at = [0, 0], axis = {direction} }}"
            joints.append(f'[joints.P{name}]\ntype = "prismatic"\non = {{ {on} }}')
            drives.append(f'[drives.{name}]\njoint = "P{name}"\nvalues = [10]\nerror = {law.text}')
            body = f"s{name}"
        pins: list[Law | None] = list(self.angle) or [None]
        for k, turn in enumerate(pins):
            joints.append(f'[joints.R{k}]\ntype = "revolute"\non = {{ {body} = [0, 0], a{k} = [0, 0] }}')
            if k == 0 and self.disc is not None:
                joints.append(f'clearance = {{ radial = {self.disc[0]}, law = "{self.disc[1]}" }}')
            error = "" if turn is None else f"\nerror = {turn.text}"
            drives.append(f'[drives.a{k}]\njoint = "R{k}"\nvalues = [0]{error}')
            body = f"a{k}"
        parts = [
            'format = 1\nunits = { length = "mm", angle = "deg" }',
            *joints,
            *drives,
            f'[output]\nbody = "{body}"\nat = [{self.at[0]}, {self.at[1]}]',
        ]
        if self.load is not None:
            force = [round(100.0 * f(math.radians(self.load)), 6) for f in (math.cos, math.sin)]
            parts.append(f'[[loads]]\nbody = "{body}"\nat = [0, 0]\nforce = {force}')
        if self.tied is not None:
            first, second, rank = self.tied
            names = f'["{first[0]}0", "{second[0]}{int(first == second)}"]'
            parts.append(f"[[correlations]]\nsources = {names}\nrank = {rank}")
        contact = [] if self.load is None else ['contact = "loaded"']
        return "\n".join([*parts, self.limits.text(), *contact]) + "\n"

    def outside(self, limits: Limits | None = None, fine: float = 1.0) -> float:
        """The share of the specimens outside."""
        limits = self.limits if limits is None else limits
        if fine not in self._known:
            self._known[fine] = self._common(fine)
        weights, (dx, dy, da), sums = self._known[fine]
        box = [(limits.x[0] - dx, limits.x[1] - dx), (limits.y[0] - dy, limits.y[1] - dy)]
        if math.isfinite(limits.position):
            middles, masses = sums["x"].coarse(round(fine * ACROSS))
            across = np.zeros(len(weights))
            for middle, mass in zip(middles.tolist(), masses.tolist(), strict=True):
                root = np.sqrt(np.maximum(limits.position**2 - (middle + dx) ** 2, 0.0))
                low, high = np.maximum(box[1][0], -root - dy), np.minimum(box[1][1], root - dy)
                gone = (np.abs(middle + dx) >= limits.position) | (middle < box[0][0]) | (middle > box[0][1])
                across += mass * np.where(gone, 1.0, sums["y"].outside(low, high))
        else:
            one, other = (sums[name].outside(*ends) for name, ends in zip("xy", box, strict=True))
            across = one + other - one * other
        low, high = max(limits.angle[0], -limits.rotation), min(limits.angle[1], limits.rotation)
        turned = sums["angle"].outside(low - da, high - da)
        return float(weights @ (across + turned - across * turned))

    def _common(self, fine: float) -> tuple[Floats, Floats, dict[str, Sum]]:
        """Weights and moves of what is common to several components, and the sums that are left."""
        weights, moves, rows = self._moved(fine)
        return weights, moves, {name: Sum(laws, round(fine * CELLS)) for name, laws in rows.items()}

    def _moved(self, fine: float) -> tuple[Floats, Floats, dict[str, list[Law]]]:
        rows = {"x": list(self.x), "y": list(self.y), "angle": list(self.angle)}
        count = round(fine * COMMON)
        if self.disc is not None and self.load is not None:
            radius, a = self.disc[0], math.radians(self.load)
            return np.ones(1), np.array([[radius * math.cos(a)], [radius * math.sin(a)], [0.0]]), rows
        if self.disc is not None:
            return *_of_disc(*self.disc, fine), rows
        if self.askew is not None:
            law, direction = self.askew
            places, masses = Sum([law], count).coarse(count)
            x, y = math.cos(math.radians(direction)), math.sin(math.radians(direction))
            return masses, np.array([x * places, y * places, 0.0 * places]), rows
        if self.tied is not None:
            first, second, rank = self.tied
            rho = 2.0 * math.sin(math.pi * rank / 6.0)
            places = np.linspace(-ENDLESS, ENDLESS, count)
            masses = stats.norm.pdf(places) * (places[1] - places[0])
            moves = np.zeros((3, count))
            for name, k, sign in ((first, 0, 1.0), (second, int(first == second), math.copysign(1.0, rho))):
                sigma = rows[name][k].of[1][0]
                moves["xya".index(name[0])] += sign * sigma * math.sqrt(abs(rho)) * places
                rest = sigma * math.sqrt(1.0 - abs(rho))
                rows[name][k] = Law("", ("gauss", (rest,)), -math.inf, math.inf)
            return masses, moves, rows
        if any(self.at):
            places, masses = Sum(self.angle, count).coarse(count)
            a = np.radians(places)
            px, py = self.at
            moves = [px * (np.cos(a) - 1.0) - py * np.sin(a), px * np.sin(a) + py * (np.cos(a) - 1.0), places]
            return masses, np.array(moves), {**rows, "angle": []}
        return np.ones(1), np.zeros((3, 1)), rows


def _of_disc(radius: float, law: str, fine: float) -> tuple[Floats, Floats]:
    """Points of a disc and their weights."""
    around = round(fine * DISC[0])
    angles = 2.0 * np.pi * (np.arange(around) + 0.5) / around
    if law == "boundary":
        r, w = np.array([radius]), np.ones(1)
    else:
        nodes, own = np.polynomial.legendre.leggauss(round(fine * DISC[1]))
        share, w = 0.5 * (nodes + 1.0), 0.5 * own
        if law == "uniform":
            r = radius * np.sqrt(share)
        else:
            # Normal with three standard deviations to the boundary, cut off there.
            r = radius / 3.0 * np.sqrt(-2.0 * np.log1p(-share * (1.0 - math.exp(-4.5))))
    weights = np.outer(w, np.full(around, 1.0 / around)).ravel()
    x, y = np.outer(r, np.cos(angles)).ravel(), np.outer(r, np.sin(angles)).ravel()
    return weights, np.array([x, y, 0.0 * x])


#: kinds of chains in a family, in turn
KINDS = ("plain", "disc", "askew", "tied", "arm")
#: that of chains whose pin is pressed to one side by a load
PRESSED = "pressed"


@dataclass(frozen=True)
class Case:
    """A file and the share that is outside."""

    kind: str
    text: str
    outside: float
    #: of every limited quantity by itself
    quantities: dict[str, float]
    #: what the shares are known to, as a part of them
    known: float = 0.005


def case(seed: int, kind: str = "") -> Case:
    """A random one; the share is from 1e-9 to 1e-2, or nothing at all is outside. Kinds take turns if left out."""
    kind = kind or KINDS[seed % len(KINDS)]
    for attempt in range(100):
        rng = np.random.default_rng([seed, attempt])
        chain = _random_chain(kind, rng)
        if not _with_limits(chain, rng):
            continue
        single = {name: Limits(**{name: value}) for name, value in chain.limits.given()}
        rough, fine = (
            [chain.outside(limits, grid) for limits in (chain.limits, *single.values())] for grid in (1.0, 1.5)
        )
        # Nearer to the end of a sum than its cells are wide nothing is known.
        known = all(abs(a - b) <= 4e-3 * b or a == b or max(a, b) < NOTHING for a, b in zip(rough, fine, strict=True))
        # All together are outside as often as any by itself.
        known = known and fine[0] >= (1.0 - 4e-3) * max(fine[1:])
        if known and (1e-9 <= fine[0] <= 1e-2 or fine[0] < NOTHING):
            return Case(kind, chain.text(), fine[0], dict(zip(single, fine[1:], strict=True)))
    raise ValueError(f"no case for seed {seed}")


def _random_chain(kind: str, rng: np.random.Generator) -> Chain:
    unbounded = rng.choice([0.0, 0.4, 1.0], p=[0.25, 0.5, 0.25])

    def laws(least: int, most: int, size: float) -> list[Law]:
        sizes = size * 10.0 ** rng.uniform(-1.0, 0.0, int(rng.integers(least, most + 1)))
        return [random_law(rng, one, unbounded=unbounded) for one in sizes]

    x, y, angle = laws(1, 4, 0.1), laws(int(kind in ("disc", "arm", PRESSED)), 3, 0.1), laws(0, 2, 0.5)
    chain = Chain(x, y, angle)
    if kind in ("disc", PRESSED):
        chain.load = float(rng.integers(360)) if kind == PRESSED else None
        chain.disc = _short(0.1 * 10.0 ** rng.uniform(-1.0, 0.0)), str(rng.choice(["uniform", "boundary", "normal"]))
    elif kind == "askew":
        chain.askew = random_law(rng, 0.1, unbounded=unbounded), float(rng.integers(-85, 86))
    elif kind == "tied":
        rows = {"x": chain.x, "y": chain.y, "angle": chain.angle}
        first, second = str(rng.choice(["x", "y"])), str(rng.choice(["x", "y", "angle"]))
        for name in {first, second}:
            while len(rows[name]) < 1 + (first == second):
                rows[name].append(random_law(rng, 0.05, unbounded=1.0))
        for name, k in ((first, 0), (second, int(first == second))):
            rows[name][k] = random_law(rng, 0.06 if name != "angle" else 0.3, unbounded=1.0)
        chain.tied = first, second, round(float(rng.uniform(-0.9, 0.9)), 2)
    elif kind == "arm":
        if not chain.angle:
            chain.angle.append(random_law(rng, 1.0, unbounded=unbounded))
        chain.at = float(rng.integers(5, 80)), float(rng.integers(-20, 20))
    return chain


def _with_limits(chain: Chain, rng: np.random.Generator) -> bool:
    """Give a chain two to four limits: some are missed by a share that is drawn, some cannot be reached."""
    names = ["x", "y", "angle", "rotation", "position"]
    chosen = rng.permutation(names)[: int(rng.integers(2, 5))].tolist()
    top = rng.uniform(-8.8, -2.3)
    for k, name in enumerate(chosen):
        kind = rng.choice(["rare", "edge", "never"], p=[0.6, 0.2, 0.2]) if k else "rare"
        share = 10.0 ** (top - rng.uniform(0.0, 2.0) * (k > 0))
        sides = (0, 1) if rng.random() < 0.6 else (int(rng.integers(2)),)
        bound = _bound(chain, name, sides, kind, share, rng)
        if bound is None:
            return False
        if name in ("position", "rotation"):
            setattr(chain.limits, name, bound)
        else:
            setattr(chain.limits, name, (-bound if 0 in sides else -math.inf, bound if 1 in sides else math.inf))
    return True


def _bound(
    chain: Chain, name: str, sides: tuple[int, ...], kind: str, share: float, rng: np.random.Generator
) -> float | None:
    """A bound that this share of the specimens is beyond; or at the end of what is reached, or beyond it."""

    def outside(bound: float) -> float:
        pair = (-bound if 0 in sides else -math.inf, bound if 1 in sides else math.inf)
        return chain.outside(Limits(**{name: bound if name in ("position", "rotation") else pair}), 0.4)

    # What is outside nowhere, then the bound between.
    low, high = 0.0, 1e-3
    while outside(high) > 0.0 and high < 1e3:
        high *= 2.0
    if outside(1e-9) <= share:
        # It does not scatter, or to the other side only.
        return _short(float(high * rng.uniform(0.5, 2.0)))
    target = share if kind == "rare" else 0.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if outside(middle) > target else (low, middle)
    if kind == "never":
        high *= float(rng.choice([1.003, 1.02, 1.3, 2.0]))
    return float(f"{high:.6g}") if kind == "rare" else float(f"{high:.9g}")


@dataclass(frozen=True)
class Loop:
    """A crank, a rod and a slider with play in all pins; the output is the rod at its crank pin.

    With offsets v of the pins the rod's end is at p = r (cos t, sin t) + v_1 + v_2, and its direction follows from the
    height of the other end: sin w = -(p_y + v_3y) / l.
    """

    crank: float
    rod: float
    #: degrees
    turn: float
    play: tuple[float, float, float]
    drive: float
    length: float
    limits: Limits

    def text(self) -> str:
        """The mechanism file."""
        pins = ("ground = [0, 0], crank = [0, 0]", f"crank = [{self.crank}, 0], rod = [0, 0]")
        pins = (*pins, f"rod = [{self.rod}, 0], slider = [0, 0]")
        rise = -math.degrees(math.asin(self.crank * math.sin(math.radians(self.turn)) / self.rod))
        joints = [
            f'[joints.J{k}]\ntype = "revolute"\non = {{ {on} }}\nclearance = {{ radial = {play} }}'
            for k, (on, play) in enumerate(zip(pins, self.play, strict=True))
        ]
        return "\n".join(
            [
                'format = 1\nunits = { length = "mm", angle = "deg" }',
                *joints,
                '[joints.guide]\ntype = "prismatic"\non = { ground = { at = [0, 0], axis = 0 }, slider = [0, 0] }',
                f'[drives.turn]\njoint = "J0"\nvalues = [{self.turn}]\nerror = {{ sigma = {self.drive} }}',
                '[dimensions.rod]\nbody = "rod"\nbetween = ["J1", "J2"]',
                f"tolerance = {{ sigma = {self.length} }}",
                f"[start]\ncrank = {{ angle = {self.turn} }}\nrod = {{ angle = {rise} }}",
                '[output]\nbody = "rod"\nat = [0, 0]',
                self.limits.text(),
            ]
        )

    def errors(self, count: int, rng: np.random.Generator) -> Floats:
        """Errors along x and y, mm, and of the direction, degrees, of so many specimens."""
        moves = []
        for play in self.play:
            r, a = play * np.sqrt(rng.random(count)), 2.0 * np.pi * rng.random(count)
            moves.append([r * np.cos(a), r * np.sin(a)])
        first, second, third = np.array(moves)
        t = np.radians(self.turn + self.drive * rng.standard_normal(count))
        rod = self.rod + self.length * rng.standard_normal(count)
        end = self.crank * np.array([np.cos(t), np.sin(t)]) + first + second
        turn = math.radians(self.turn)
        there = self.crank * np.array([math.cos(turn), math.sin(turn)])
        w = -np.arcsin((end[1] + third[1]) / rod) + math.asin(there[1] / self.rod)
        return np.array([*(end - there[:, None]), np.degrees(w)])

    def outside(self, errors: Floats) -> tuple[float, dict[str, float]]:
        """The share of such specimens outside, of all quantities and of each."""
        values = {"position": np.hypot(errors[0], errors[1]), "rotation": np.abs(errors[2])}
        values |= dict(zip(("x", "y", "angle"), errors, strict=True))
        out = {}
        for name, limit in self.limits.given():
            low, high = limit if isinstance(limit, tuple) else (-math.inf, limit)
            out[name] = (values[name] < low) | (values[name] > high)
        return float(np.any(list(out.values()), axis=0).mean()), {name: float(one.mean()) for name, one in out.items()}


def loop_case(seed: int, samples: int, share: float = 3e-4) -> Case:
    """A random loop with two limits, of which each is missed by about this share, counted in so many specimens."""
    rng = np.random.default_rng([seed, 1])
    crank, rod, turn = float(rng.integers(30, 60)), float(rng.integers(90, 200)), float(rng.integers(20, 160))
    play = tuple(_short(0.1 * x) for x in rng.random(3))
    loop = Loop(crank, rod, turn, play, _short(0.02 * rng.random()), _short(0.05 * rng.random()), Limits())
    errors = loop.errors(400_000, rng)
    names = rng.permutation(["x", "y", "angle"])[:2]
    bounds = {name: np.quantile(errors["xya".index(name[0])], [share / 2.0, 1.0 - share / 2.0]) for name in names}
    limits = Limits(**{name: (_short(low), _short(high)) for name, (low, high) in bounds.items()})
    loop = Loop(crank, rod, turn, play, loop.drive, loop.length, limits)
    parts = [loop.outside(loop.errors(PART, rng)) for _ in range(max(1, samples // PART))]
    outside = float(np.mean([one for one, _ in parts]))
    alone = {name: float(np.mean([each[name] for _, each in parts])) for name, _ in limits.given()}
    # Three standard deviations of what was counted.
    known = 3.0 / math.sqrt(max(1.0, len(parts) * PART * min(alone.values())))
    return Case("loop", loop.text(), outside, alone, known)
