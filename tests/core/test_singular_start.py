"""Inverse kinematics of a mechanism drawn in a singular pose: the output leads out of it, where drives do not."""

import numpy as np

import jointplay as jp
from helpers.builders import planar

#: a five-bar whose two upper links are drawn in one line: the joint between them can go up or down
STRETCHED = planar()
STRETCHED.revolute("A", ground=(0, 0), left=(0, 0))
STRETCHED.revolute("B", left=(100, 0), low=(0, 0))
STRETCHED.revolute("C", low=(100, 0), high=(0, 0))
STRETCHED.revolute("D", high=(100, 0), right=(100, 0))
STRETCHED.revolute("E", ground=(200, 0), right=(0, 0))
STRETCHED.start("left", angle=90)
STRETCHED.start("low", angle=0)
STRETCHED.start("high", angle=0)
STRETCHED.start("right", angle=90)
STRETCHED.drive("a", joint="A")
STRETCHED.drive("b", joint="E")
STRETCHED.path(x=[100], y=[100])
STRETCHED.output(body="low", at=(100, 0))


def arms(x: float, y: float) -> tuple[float, float]:
    """Angles of the two arms of 100 mm, elbows outwards, from the triangles over the output."""
    reach = np.hypot([x, 200 - x], y)
    elbow = np.degrees(np.arccos(reach / 200))
    left, right = np.degrees(np.arctan2(y, [x, 200 - x]))
    return left + elbow[0], 180 - right - elbow[1]


def test_targets_on_either_side_are_reached_from_the_stretched_pose() -> None:
    for places in ([(100, 120), (100, 150), (110, 150)], [(100, 80), (95, 60)]):
        x, y = zip(*places, strict=True)
        result = jp.solve(STRETCHED.mechanism().with_({"path": {"x": list(x), "y": list(y)}}))
        assert (result.status == "ok").all()
        np.testing.assert_allclose(result.nominal[:, :2], places, rtol=0, atol=1e-9)
        np.testing.assert_allclose(
            np.stack([result.a, result.b], axis=1), [arms(*place) for place in places], rtol=0, atol=1e-9
        )


def test_the_stretched_pose_itself_is_singular_and_stops_nothing() -> None:
    result = jp.solve(STRETCHED.mechanism().with_({"path": {"x": [100, 100], "y": [100, 120]}}))
    assert result.status.values.tolist() == ["singular", "ok"]
    np.testing.assert_allclose([result.a[0], result.b[0]], 90.0, rtol=0, atol=1e-9)
