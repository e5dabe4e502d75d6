"""A drawing of the displaced mechanism, to be measured in a program for CAD as paper 1 does."""

from pathlib import Path

import numpy as np
import pytest

import jointplay as jp

ezdxf = pytest.importorskip("ezdxf")
OFFSETS = {"J3": [0.5, 0.2]}


def test_the_drawing_has_pins_and_output_where_the_offsets_put_them(tmp_path: Path) -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    jp.export(m, tmp_path / "moved.dxf", configuration=4, offsets=OFFSETS)
    space = ezdxf.readfile(tmp_path / "moved.dxf").modelspace()
    found = jp.given(m, OFFSETS).isel(configuration=4)
    actual = (found.nominal + found.error).sel(component=["x", "y"]).values
    (point,) = space.query("POINT")
    np.testing.assert_allclose([point.dxf.location.x, point.dxf.location.y], actual, atol=1e-9)
    pins = np.array([[circle.dxf.center.x, circle.dxf.center.y] for circle in space.query("CIRCLE")])
    apart = np.linalg.norm(pins[:, None] - pins[None], axis=2)
    # Seven of the pins are in the middle of their holes, that of J3 is off by its offset.
    assert np.isclose(apart, np.hypot(0.5, 0.2), atol=1e-9).sum() == 2
    assert (np.isclose(apart, 0.0, atol=1e-9).sum() - len(pins)) == 6


def test_lengths_that_are_off_are_drawn(tmp_path: Path) -> None:
    m = jp.loads(jp.examples.text("four-bar")).with_(
        {"dimensions": {"l2": {"body": "coupler", "between": ["J2", "J3"], "tolerance": 0.5}}}
    )
    jp.export(m, tmp_path / "long.dxf", deviations={"l2": 0.5})
    space = ezdxf.readfile(tmp_path / "long.dxf").modelspace()
    circles = [circle.dxf for circle in space.query("CIRCLE") if circle.dxf.layer == "coupler"]
    pins = [np.array([circle.center.x, circle.center.y]) for circle in circles]
    assert np.linalg.norm(pins[1] - pins[0]) == pytest.approx(75.5, abs=1e-9)


def test_a_model_for_dynamics_has_no_offsets(tmp_path: Path) -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    with pytest.raises(jp.InputError, match=r"offsets are drawn in a \.dxf"):
        jp.export(m, tmp_path / "moved.xml", offsets=OFFSETS)
    with pytest.raises(jp.InputError, match="cannot be assembled with these offsets"):
        jp.export(m, tmp_path / "moved.dxf", offsets={"J3": [500.0, 0.0]})
