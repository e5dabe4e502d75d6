"""Outlines of bodies in a file: what is valid, and that they are nothing but drawn."""

from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from helpers.builders import planar
from jointplay.file.schema.bodies import MOST_CORNERS, MOST_LINES

SQUARE = [[0, 0], [50, 0], [50, 20], [0, 20]]


@pytest.mark.parametrize(
    ("outline", "said"),
    [
        ([SQUARE[:2]], "outline.0: at least 3 needed"),
        (SQUARE, "outline: closed lines are needed, each a list of corners: [[[0, 0], [50, 0], [50, 20]]]"),
        ([[*SQUARE, [0, float("nan")]]], "outline.0.4.1: a finite number is needed, not nan"),
        ([[*SQUARE, [0, 1e13]]], "outline.0.4.1: must be at most 1000000000000"),
        ([[*SQUARE, [0, 0, 0]]], "outline.0.4: 2 values are needed"),
        ([], "outline: the list is empty"),
        ("part.csv", "outline: a list in brackets is needed"),
        ([SQUARE * MOST_CORNERS], f"outline.0: at most {MOST_CORNERS} values are possible, not [[0, 0], [50, 0]"),
        ([SQUARE] * (MOST_LINES + 1), f"outline: at most {MOST_LINES} values are possible, not [[[0, 0], [50"),
    ],
)
def test_what_is_no_outline_is_refused(outline: Any, said: str) -> None:
    with pytest.raises(jp.InputError) as refused:
        example("four-bar").with_({"bodies.crank.outline": outline})
    assert f"bodies.crank.{said}" in str(refused.value)


def test_in_space_there_is_none() -> None:
    m = example("rssr")
    with pytest.raises(jp.InputError, match="'outline' is a key in the plane"):
        m.with_({f"bodies.{m.bodies[0]}.outline": [SQUARE]})


def test_an_outline_changes_no_answer_and_no_hash() -> None:
    """Of a body with a mass, of one without a table, of the ground, and of one in a pattern."""
    for m in (example("four-bar"), example("four-bar", bodies__crank__mass=2)):
        drawn = m.with_({f"bodies.{name}.outline": [SQUARE] for name in ("crank", "coupler", "ground")})
        assert drawn.hash == m.hash
        assert drawn != m
        assert dict(drawn.core_spec) == dict(m.core_spec)
        np.testing.assert_array_equal(jp.worst(drawn).worst_position, jp.worst(m).worst_position)
    assert m.hash != example("four-bar").hash
    m = example("excavator")
    drawn = m.with_({"patterns.cylinder.bodies.tube.outline": [SQUARE]})
    assert drawn.hash == m.hash
    assert drawn.data.bodies["tube_3"].outline == ((*map(tuple, SQUARE),),)


DRAWN_ASSEMBLED = """
format = 1
space = "planar"
title = "two copies"
units = { length = "mm", angle = "deg", force = "N" }
[patterns.arm]
count = 3
about = { point = [0, 0] }
[patterns.arm.joints.pin]
type = "revolute"
bodies = ["ground", "rod"]
at = [50, 0]
clearance = { radial = 0.5 }
[patterns.arm.joints.tip]
type = "revolute"
bodies = ["rod", "end"]
at = [150, 0]
clearance = { radial = 0.5 }
[patterns.arm.bodies.rod]
mass = 1
centre = [100, 0]
outline = [[[40, -10], [160, -10], [160, 10], [40, 20]]]
[patterns.arm.drives.q]
joint = "pin"
values = [0, 20]
[patterns.arm.drives.r]
joint = "tip"
values = [0, 20]
[output]
body = "end_3"
at = [150, 0]
"""


def test_it_turns_with_the_copy_of_a_body_that_is_drawn_assembled() -> None:
    bodies = jp.loads(DRAWN_ASSEMBLED).data.bodies
    first, second, _ = (np.array(vars(bodies[f"rod_{k}"])["outline"][0]) @ [1.0, 1j] for k in (1, 2, 3))
    np.testing.assert_allclose(second, first * np.exp(2j * np.pi / 3.0), atol=1e-9)


def test_it_is_written_by_the_builder_and_read_again() -> None:
    build = planar()
    build.revolute("J1", ground=(0, 0), arm=(0, 0))
    build.drive("q", joint="J1", values=[30])
    build.output(body="arm", at=(50, 0))
    build.body("arm", outline=[SQUARE])
    m = build.mechanism()
    assert m.value("bodies.arm.outline") == [SQUARE]
    assert jp.loads(m.text("new.toml")) == m
