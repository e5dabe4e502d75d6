"""Robots in SDF whose freedoms are known by construction, drawn exactly or with few digits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class Pin:
    """A joint of a type of SDF between two links, where it is and along what."""

    name: str
    kind: str
    ends: tuple[str, str]
    at: Floats
    axes: tuple[Floats, ...] = ()


@dataclass(frozen=True)
class Robot:
    """Joints, and how many freedoms and redundant constraints they have away from special poses."""

    kind: str
    pins: tuple[Pin, ...]
    freedoms: int
    redundant: int
    #: the same where it is seen along its pins; None where it has no plane
    flat_redundant: int | None = None

    @property
    def output(self) -> str:
        """A link that no spin moves."""
        return next(end for pin in self.pins for end in pin.ends if end not in ("world", "rod"))

    def sdf(self) -> str:
        """All links have the axes of the model."""
        links = dict.fromkeys(end for pin in self.pins for end in pin.ends if end != "world")
        parts = [f'<link name="{link}"/>' for link in links]
        for pin in self.pins:
            axes = "".join(
                f"<{tag}><xyz expressed_in='__model__'>{_numbers(axis)}</xyz></{tag}>"
                for tag, axis in zip(("axis", "axis2"), pin.axes, strict=False)
            )
            pose = f'<pose relative_to="__model__">{_numbers(pin.at)} 0 0 0</pose>'
            parts.append(
                f'<joint name="{pin.name}" type="{pin.kind}">{pose}'
                f"<parent>{pin.ends[0]}</parent><child>{pin.ends[1]}</child>{axes}</joint>"
            )
        return f'<sdf version="1.9"><model name="m">{"".join(parts)}</model></sdf>'

    def turned(self, rotation: Floats) -> Robot:
        pins = [
            replace(pin, at=rotation @ pin.at, axes=tuple(rotation @ axis for axis in pin.axes)) for pin in self.pins
        ]
        return replace(self, pins=tuple(pins))

    def drawn_with(self, noise: float, rng: np.random.Generator) -> Robot:
        """With places and directions that are off by a share of the size."""

        def pin(old: Pin) -> Pin:
            axes = tuple(axis + noise * rng.uniform(-1, 1, 3) for axis in old.axes)
            if len(axes) == 2:
                # The pins of a cross are at right angles.
                axes = (axes[0], axes[1] - axes[0] * (axes[0] @ axes[1]) / (axes[0] @ axes[0]))
            return replace(old, at=old.at + noise * rng.uniform(-1, 1, 3), axes=axes)

        return replace(self, pins=tuple(map(pin, self.pins))) if noise else self

    def with_arms(self, count: int, rng: np.random.Generator) -> Robot:
        """With further links that hang on one of it each."""
        links = sorted({end for pin in self.pins for end in pin.ends} - {"rod"})
        arms = tuple(
            Pin(f"to_{arm}", "revolute", (str(rng.choice(links)), arm), rng.uniform(-0.5, 0.5, 3), (_axis(rng),))
            for arm in ("finger", "wing")[:count]
        )
        flat = None if count else self.flat_redundant
        return replace(self, pins=(*self.pins, *arms), freedoms=self.freedoms + count, flat_redundant=flat)


def _numbers(values: Floats) -> str:
    return " ".join(f"{value:.17g}" for value in values)


def _axis(rng: np.random.Generator) -> Floats:
    axis = rng.normal(size=3)
    return np.asarray(axis / np.linalg.norm(axis))


def rotation(rng: np.random.Generator) -> Floats:
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return np.asarray(q * np.linalg.det(q))


def _chain(names: list[str], places: list[Floats], axes: list[Floats] | None = None) -> list[Pin]:
    """Pins of one loop: the world, the links and the world again."""
    return [
        Pin(f"{a}-{b}", "revolute", (a, b), at, (Y if axes is None else axes[k],))
        for k, (a, b, at) in enumerate(zip(["world", *names], [*names, "world"], places, strict=True))
    ]


def _flat(*points: tuple[float, float]) -> list[Floats]:
    return [np.array([x, 0.0, z]) for x, z in points]


def four_bar(rng: np.random.Generator) -> Robot:
    a, b, c, d = (float(value) for value in rng.uniform(0.2, 0.5, 4))
    places = _flat((0, 0), (0.3 * a, a), (1 + 0.2 * b, 0.5 + b), (1 + c, 0.1 * d))
    return Robot("four-bar", tuple(_chain(["crank", "coupler", "rocker"], places)), 1, 3, 0)


def five_bar(rng: np.random.Generator) -> Robot:
    a, b = (float(value) for value in rng.uniform(0.2, 0.4, 2))
    places = _flat((0, 0), (-a, 0.3), (0.4, 0.9), (0.9 + b, 0.4), (0.8, 0))
    return Robot("five-bar", tuple(_chain(["a", "b", "c", "d"], places)), 2, 3, 0)


def slider_crank(rng: np.random.Generator) -> Robot:
    a = float(rng.uniform(0.2, 0.4))
    pins = _chain(["crank", "coupler", "slider"], _flat((0, 0), (0.1, a), (1, 0.1), (1, 0.1)))
    last = replace(pins[-1], kind="prismatic", axes=(X,))
    return Robot("slider-crank", (*pins[:-1], last), 1, 3, 0)


def flat_parallelogram(rng: np.random.Generator) -> Robot:
    """All links on one line: there two motions meet."""
    a, b = (float(value) for value in rng.uniform(0.3, 0.6, 2))
    pins = _chain(["left", "coupler", "right"], _flat((0, 0), (a, 0), (a + b, 0), (b, 0)))
    return Robot("flat parallelogram", tuple(pins), 1, 3, 0)


def three_cranks(rng: np.random.Generator) -> Robot:
    a, b, c, h = (float(value) for value in rng.uniform(0.3, 0.6, 4))
    pins = _chain(["left", "coupler", "right"], _flat((0, 0), (h, a), (h + b + c, a), (b + c, 0)))
    foot, head = _flat((b, 0), (b + h, a))
    more = (
        Pin("E", "revolute", ("world", "middle"), foot, (Y,)),
        Pin("F", "revolute", ("middle", "coupler"), head, (Y,)),
    )
    return Robot("three cranks", (*pins, *more), 1, 7, 1)


def spherical(rng: np.random.Generator) -> Robot:
    """Four axes through one point."""
    axes = [_axis(rng) for _ in range(4)]
    places = [0.4 * axis for axis in axes]
    return Robot("spherical", tuple(_chain(["a", "b", "c"], places, axes)), 1, 3)


def rssr(rng: np.random.Generator) -> Robot:
    """The rod spins about itself, which moves nothing and is held."""
    one, other = np.array([0.2, 0, 0.3]), np.array([0.8, 0.4, 0.5]) + 0.1 * rng.uniform(-1, 1, 3)
    pins = (
        Pin("A", "revolute", ("world", "crank"), np.zeros(3), (Y,)),
        Pin("B", "ball", ("crank", "rod"), one),
        Pin("C", "ball", ("rocker", "rod"), other),
        Pin("D", "revolute", ("world", "rocker"), np.array([1.0, 0.0, 0.0]), (_axis(rng),)),
    )
    return Robot("RSSR", pins, 1, 0)


def closed_legs(rng: np.random.Generator, lift: float | None = None) -> Robot:
    """Two legs with universal joints at the knees and one toe: level where nothing is lifted, a special pose."""
    lift = float(rng.choice([0.0, 1e-7, 1e-6, 1e-5])) if lift is None else lift
    thigh, rod = 0.5, np.hypot(0.5, 1.0)
    x, z = thigh * np.cos(lift), -thigh * np.sin(lift)
    toe = z - np.sqrt(rod**2 - x**2)
    pins = (
        Pin("ml", "revolute", ("world", "ul"), np.zeros(3), (Y,)),
        Pin("mr", "revolute", ("world", "ur"), np.array([0, 0.1, 0]), (Y,)),
        Pin("kl", "universal", ("ul", "ll"), np.array([x, 0, z]), (Y, X)),
        Pin("kr", "universal", ("ur", "lr"), np.array([-x, 0.1, z]), (Y, X)),
        Pin("toe", "revolute", ("ll", "lr"), np.array([0, 0.05, toe]), (Y,)),
    )
    return Robot("closed legs", pins, 2, 1)


KINDS: tuple[Any, ...] = (
    *(four_bar, five_bar, slider_crank, flat_parallelogram, three_cranks, spherical, rssr, closed_legs),
)
NOISES = (0.0, 1e-7, 1e-6, 1e-5)


def robot(seed: int, noise: float) -> tuple[Robot, np.random.Generator]:
    """One of them, turned in space, perhaps with arms on it, drawn with a share of noise."""
    rng = np.random.default_rng(seed)
    made = KINDS[seed % len(KINDS)](rng).with_arms(int(rng.integers(0, 3)), rng).turned(rotation(rng))
    return made.drawn_with(noise, rng), rng
