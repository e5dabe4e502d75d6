"""Outlines of bodies on drawings and pages move as their bodies do, errors magnified."""

import numpy as np
import pytest
from matplotlib.axes import Axes

import jointplay as jp
from helpers.answers import example
from jointplay import plot
from jointplay.analyses.nominal import nominal
from jointplay.plot import animation
from jointplay.plot.style import Style, using
from jointplay.show.viewer import DisplacedScene, scene

#: of the coupler: a plate and a hole in it, both counter-clockwise, and a nut in the hole
PLATE, HOLE, NUT = ([[x, y] for x, y in ((-s, -s), (100 + s, -s), (100 + s, s), (-s, s))] for s in (20.0, 10.0, 5.0))
TIMES = 30.0


def plated() -> jp.Mechanism:
    return example("four-bar").with_({"bodies.coupler.outline": [PLATE, HOLE, NUT], "bodies.ground.outline": [PLATE]})


def placed(pose: np.ndarray, corners: list[list[float]]) -> np.ndarray:
    """Corners in mm, where a pose in SI puts them."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return 1e3 * pose[:2] + np.array(corners) @ np.array([[c, s], [-s, c]])


def lines_of(axes: Axes) -> list[list[np.ndarray]]:
    """Closed lines of every outline that is drawn, the ground first."""
    drawn = [patch.get_path() for patch in axes.patches if patch.get_zorder() == 0.6]
    return [[line[:-1] for line in path.to_polygons(closed_only=True)] for path in drawn]


def same(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether corners are the same, wherever a line begins and whichever way it goes."""
    near = np.linalg.norm(one[:, None] - other[None], axis=2).argmin(axis=1)
    return sorted(near) == [*range(len(other))] and bool(np.allclose(one, other[near], atol=1e-6))


def area(line: np.ndarray) -> float:
    x, y = line.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def test_a_drawing_has_them_where_the_bodies_are() -> None:
    m = plated()
    at = nominal(m)
    body = m.bodies.index("coupler")
    for k in (0, len(at) - 1):
        ground, coupler = lines_of(plot.mechanism(m, k).axes[0])
        assert same(ground[0], np.array(PLATE))
        for line, corners in zip(coupler, (PLATE, HOLE, NUT), strict=True):
            assert same(line, placed(at.poses[k, body], corners))
        # Whatever fills by the winding number, such as PDF, leaves the hole empty.
        assert [np.sign(area(line)) for line in coupler] == [1, -1, 1]
    assert lines_of(plot.mechanism(example("four-bar"), 0).axes[0]) == []


def test_errors_are_magnified_as_those_of_bodies() -> None:
    m = plated()
    motion = animation.motion_of(m, 5, TIMES)
    body = m.bodies.index("coupler")
    limits = []
    for k in (0, 3):
        with using(Style(width=60, dpi=60)):
            axes = animation.frame(motion, k).axes[0]
        moved = motion.moved_at(k)
        assert moved is not None
        here, there = (placed(poses[body], PLATE) for poses in (motion.at.poses[k], moved[0]))
        ground, coupler = lines_of(axes)
        assert same(coupler[0], here + TIMES * (there - here))
        assert same(ground[0], np.array(PLATE))
        # All of it is within the picture.
        for (low, high), values in zip((axes.get_xlim(), axes.get_ylim()), here.T, strict=True):
            assert low < values.min() < values.max() < high
        limits.append((axes.get_xlim(), axes.get_ylim()))
    assert limits[0] == limits[1]


def test_pages_have_them_by_three_corners_that_move() -> None:
    """Whatever is drawn of the three, nominal or magnified, the page draws of all."""
    m = plated()
    at = nominal(m)
    motion = animation.motion_of(m, len(at), TIMES)
    assert motion.moved is not None
    drawn = scene(m, at, displaced=[DisplacedScene("under load", motion.moved.poses, motion.moved.points)])
    places, moves = (np.array(found, dtype=float) for found in (drawn["places"], drawn["states"][0]["moves"]))
    outlines = [shape for shape in drawn["shapes"] if shape["kind"] == "outline"]
    assert [shape["name"] for shape in outlines] == ["ground", "coupler"]
    body = m.bodies.index("coupler")
    three = outlines[1]["points"]
    for k in (0, len(at) - 1):
        for line, corners in zip(outlines[1]["lines"], (PLATE, HOLE, NUT), strict=True):
            here, there = (placed(poses[body], corners) for poses in (at.poses[k], motion.moved.poses[k]))
            for start, right, up, wanted in (
                (*places[k, three], here),
                (*(places[k, three] + TIMES * moves[k, three]), here + TIMES * (there - here)),
            ):
                own = np.array(line)
                found = start + own[:, :1] * (right - start) + own[:, 1:] * (up - start)
                # Places are rounded to 1e-5 of the mechanism, parts of the way to four decimals.
                assert np.abs(found - wanted).max() < 2e-4 * drawn["extent"]


@pytest.mark.parametrize("name", ["redundant-bar"])
def test_a_piece_of_an_elastic_body_has_none(name: str) -> None:
    m = example(name)
    elastic = next(body for body in m.bodies if m.owners.count(body) > 1)
    drawn = m.with_({f"bodies.{elastic}.outline": [PLATE]})
    assert len(lines_of(plot.mechanism(drawn, 0).axes[0])) == 1
