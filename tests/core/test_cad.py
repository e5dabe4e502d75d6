"""Nominal and deviated positions against a CAD sketch solver (SolveSpace), to 1e-8 mm."""

import math
from itertools import product

import numpy as np
import pytest

import jointplay as jp
from helpers.layouts import KINDS
from helpers.oracles import brute, sketch
from helpers.oracles.fourbar import paper_four_bar
from helpers.oracles.linkage import Linkage
from helpers.oracles.reading import read
from helpers.strategies import PAPER_ANGLES, given_offsets, mechanism, paper_text, turn

MILLIMETRES = 1e-8
DEGREES = 1e-8


def agree(ours: np.ndarray, drawn: np.ndarray) -> None:
    """Output poses (x, y in mm, angle in degrees) against the sketch's (angle in radians)."""
    np.testing.assert_allclose(ours[:2], drawn[:2], rtol=0, atol=MILLIMETRES)
    assert abs(turn(ours[2], math.degrees(drawn[2]))) < DEGREES


def play(link: Linkage, seed: int) -> dict[str, float]:
    """Random offsets of every clearance and dimension, drives exact."""
    u = brute.draw(link, np.random.default_rng(seed), 1, boundary=bool(seed % 2))[0]
    return {k: (0.0 if k.endswith(".value") else float(v)) for k, v in zip(link.labels, u, strict=True)}


def require_drawn(text: str, seed: int) -> None:
    """All poses of a file, without play and with random offsets, are those of a sketch."""
    mechanism_, link = jp.loads(text), read(text)
    u = play(link, seed)
    nominal = jp.solve(mechanism_).nominal.values
    error = jp.given(mechanism_, given_offsets(link, u)).error.values
    for k, q in enumerate(link.follow()):
        drives = link.configurations[k]
        agree(nominal[k], sketch.output_pose(link, q, drives))
        agree(nominal[k] + error[k], sketch.output_pose(link, q, drives, u))


def test_the_sketch_draws_the_paper_s_four_bar() -> None:
    """Two independent checks against each other: the sketch and the circles."""
    link, theta = read(paper_text()), math.radians(PAPER_ANGLES[3])
    d = [0.3 + 0.4j, -0.5 + 0.1j, 0.2 - 0.9j, 0.7 + 0.7j]
    u = {f"J{k + 1}.{c}": v for k, z in enumerate(d) for c, v in (("x", z.real), ("y", z.imag))}
    pose = sketch.output_pose(link, link.follow()[3], [theta], u)
    pin = paper_four_bar().rocker_pin(theta, d)
    np.testing.assert_allclose(pose[:2], [pin.real, pin.imag], rtol=0, atol=MILLIMETRES)


def test_paper_four_bar_with_radial_links() -> None:
    """The paper's own check: radial links in a CAD sketch, here in random directions at every position."""
    require_drawn(paper_text(), 1)


@pytest.mark.parametrize(("kind", "seed"), [*product(KINDS, range(3))])
def test_random_mechanisms_drawn_in_a_sketch(kind: str, seed: int) -> None:
    require_drawn(mechanism(kind, seed), seed)
