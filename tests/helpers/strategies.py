"""Random assembled planar mechanisms as the text of their files, and hypothesis strategies over them.

Layouts whose length-scaled Jacobian has a small singular value anywhere on their short path are drawn
again, unless asked for.
"""

import cmath
import math
from typing import Any

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from helpers.layouts import DEGENERATE, KINDS, Layout
from helpers.oracles.fourbar import FourBar
from helpers.oracles.linkage import Linkage
from helpers.oracles.reading import read

#: what the smallest singular value of an accepted layout must exceed, at every configuration
WELL_CONDITIONED = 1e-3


def mechanism(
    kind: str,
    seed: int,
    *,
    play: float = 0.004,
    tolerances: bool = True,
    configurations: int = 3,
    well_conditioned: float = WELL_CONDITIONED,
) -> str:
    """The file of a random mechanism of one kind; the same arguments give the same file.

    Parameters
    ----------
    play : float
        Largest clearance as a share of the mechanism's size. The layout does not depend on it, so that two
        values give the same mechanism with clearances in proportion.
    tolerances : bool
        Dimensions, drives and fixed joints get tolerances as well.
    configurations : int
        Number of drive values, on a short path through the reference configuration.
    well_conditioned : float
        Smallest singular value that every configuration must exceed.
    """
    kinds = KINDS | DEGENERATE
    rng = np.random.default_rng([list(kinds).index(kind), seed])
    offsets = tuple(float(o) for o in np.linspace(-1, 1, configurations)) if configurations > 1 else (0.0,)
    for _ in range(200):
        layout = Layout(rng, play, tolerances)
        kinds[kind](layout)
        text = layout.text(offsets)
        if is_well_conditioned(read(text), well_conditioned):
            return text
    raise AssertionError(f"no well-conditioned {kind} in 200 draws from seed {seed}")


def is_well_conditioned(link: Linkage, least: float) -> bool:
    """Whether the mechanism follows its path and stays clear of singularities."""
    try:
        path = link.follow(4)
    except (ArithmeticError, np.linalg.LinAlgError):
        return False
    values = zip(path, link.configurations, strict=True)
    return min(link.smallest_singular_value(q, v) for q, v in values) > least


#: kinds whose points alone, when they move, bring the mechanism as near a singularity as one likes
NEAR_SINGULAR = ("four_bar", "inverted_slider", "five_bar", "watt", "stephenson", "welded", "triple_pin")


def near_singular(kind: str, seed: int, least: float, **options: Any) -> str:
    """The file of a random mechanism with `least` as its smallest singular value; the same arguments give the same.

    The points of a random layout move away from their usual places until the singular value, which changes its sign
    with the determinant, is that small. Clearances are in proportion to the distance to the singularity, which is the
    square of the singular value, so that they do not reach it.

    Parameters
    ----------
    options
        As in :func:`mechanism`: `play` is the share of that distance, `tolerances` as there.
    """
    play, tolerances = options.pop("play", 0.02) * least**2, options.pop("tolerances", True)

    def distance(attempt: int, spread: float) -> tuple[float, str]:
        layout = Layout(np.random.default_rng([list(KINDS).index(kind), seed, attempt]), play, tolerances, spread)
        KINDS[kind](layout)
        text = layout.text((0.0,), **options)
        link = read(text)
        sign = np.linalg.slogdet(link.jacobian(link.start, link.configurations[0]))[0]
        return sign * link.smallest_singular_value(link.start, link.configurations[0]), text

    for attempt in range(20):
        side = math.copysign(1.0, distance(attempt, 1.0)[0])
        spreads = np.geomspace(1.0, 8.0, 20)
        beyond = next((k for k, s in enumerate(spreads) if side * distance(attempt, s)[0] < least), 0)
        if not beyond:
            continue
        low, high = (float(s) for s in spreads[beyond - 1 : beyond + 1])
        for _ in range(60):
            middle = (low + high) / 2
            value, text = distance(attempt, middle)
            if 1.0 <= side * value / least <= 1.05:
                return text
            low, high = (middle, high) if side * value > least else (low, middle)
    raise AssertionError(f"no {kind} so near a singularity in 20 draws from seed {seed}")


def searching(examples: int) -> settings:
    """So many examples, the same ones in every run, however long each takes."""
    slow = [HealthCheck.too_slow, HealthCheck.data_too_large]
    return settings(max_examples=examples, deadline=None, derandomize=True, suppress_health_check=slow)


def mechanisms(kinds: tuple[str, ...] = tuple(KINDS), **options: Any) -> st.SearchStrategy[str]:
    """Hypothesis: files of random assembled mechanisms of these kinds."""
    return st.builds(lambda kind, seed: mechanism(kind, seed, **options), st.sampled_from(kinds), st.integers(0, 2**20))


def four_bar_text(
    l1: float,
    l2: float,
    l3: float,
    ground: float,
    values: list[float],
    radii: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
    *,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    body: str = "rocker",
    at: tuple[float, float] | str | None = None,
    extra: str = "",
    drive_error: float = 0.0,
) -> str:
    """A four-bar with pivots (0, 0) and (ground, 0), links along their x axes; start angles in degrees."""
    # numpy's floats print as more than a number
    l1, l2, l3, ground, *start = (float(v) for v in (l1, l2, l3, ground, *start))
    clearance = [f"clearance = {{ radial = {float(r)!r} }}" if r else "" for r in radii]
    at = (l3, 0.0) if at is None else at
    place = repr(at) if isinstance(at, str) else [float(v) for v in at]
    pin = l1 * cmath.exp(1j * math.radians(start[0]))
    return f"""
format = 1
space = "planar"
units = {{ length = "mm", angle = "deg", force = "N" }}
[joints.J1]
type = "revolute"
on = {{ ground = [0, 0], crank = [0, 0] }}
{clearance[0]}
[joints.J2]
type = "revolute"
on = {{ crank = [{l1!r}, 0], coupler = [0, 0] }}
{clearance[1]}
[joints.J3]
type = "revolute"
on = {{ coupler = [{l2!r}, 0], rocker = [{l3!r}, 0] }}
{clearance[2]}
[joints.J4]
type = "revolute"
on = {{ ground = [{ground!r}, 0], rocker = [0, 0] }}
{clearance[3]}
[start]
crank = {{ angle = {start[0]!r} }}
coupler = {{ x = {pin.real!r}, y = {pin.imag!r}, angle = {start[1]!r} }}
rocker = {{ x = {ground!r}, angle = {start[2]!r} }}
[drives.theta1]
joint = "J1"
values = {[float(v) for v in values]!r}
error = {drive_error!r}
[output]
body = "{body}"
at = {place}
{extra}
"""


#: the eleven crank angles of the 4R of Jaiswal et al., in degrees
PAPER_ANGLES = [22.7, 28.16, 33.46, 38.67, 43.83, 48.98, 54.17, 59.43, 64.83, 70.45, 76.39]
#: where its bodies are at the first of them, roughly
PAPER_GUESS = (22.7, 129.0, 35.6)


def paper_text(radial: float = 1.0, loads: str = "", start: tuple[float, float, float] = PAPER_GUESS) -> str:
    """The 4R of Jaiswal et al. with one radial clearance in all four joints."""
    return four_bar_text(75, 75, 150, -100, PAPER_ANGLES, (radial,) * 4, start=start, extra=loads)


def random_four_bar(seed: int) -> tuple[FourBar, float]:
    """A closed-form four-bar with pivots on the x axis, at a crank angle of healthy transmission angle."""
    rng = np.random.default_rng([4, seed])
    while True:
        l1, l2, l3, ground = rng.uniform(40, 160, 4)
        theta = rng.uniform(-math.pi, math.pi)
        diagonal = abs(l1 * cmath.exp(1j * theta) - ground)
        cosine = (l2**2 + l3**2 - diagonal**2) / (2 * l2 * l3)
        if abs(cosine) < math.cos(math.radians(40)) and diagonal > 40:
            branch = int(rng.choice([-1, 1]))
            return FourBar(float(l1), float(l2), float(l3), 0j, complex(ground), branch), float(theta)


def turn(a: Any, b: Any = 0.0) -> np.ndarray:
    """Difference of two angles in degrees, without whole turns."""
    return (np.asarray(a) - np.asarray(b) + 180.0) % 360.0 - 180.0


def given_offsets(link: Linkage, u: dict[str, float]) -> dict[str, Any]:
    """Offsets by source, in the file's units, from values by label in the oracle's; only sources named."""
    offsets: dict[str, Any] = {}
    for s in link.sources:
        if any(label in u for label in s.labels):
            values = [u.get(label, 0.0) / link.scale(label) for label in s.labels]
            offsets[s.name] = values if len(values) > 1 else values[0]
    return offsets
