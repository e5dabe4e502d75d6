"""The region of the output's error: extents in closed form, against `worst`, and against specimens of all sets."""

import numpy as np
import pytest

import jointplay as jp
from jointplay import examples
from jointplay.analyses.nominal import nominal
from jointplay.analyses.offsets import admissible
from jointplay.analyses.region import around
from jointplay.errors import InputError

CRANK = """
format = 1
space = "planar"
units = { length = "mm", angle = "deg" }
joints.J = { type = "revolute", on = { ground = [0, 0], crank = [0, 0] }, clearance = { radial = 0.1 } }
drives.theta = { joint = "J", values = [0, 30, 90] }
output = { body = "crank", at = [50, 0] }
"""


def test_a_pin_in_its_hole_reaches_as_far_in_every_direction() -> None:
    """A driven crank does not turn by its play, so that the output goes wherever the pin goes: a disc."""
    result = jp.region(jp.loads(CRANK))
    assert result.region.sizes == {"configuration": 3, "direction": 72, "axis": 2}
    # Newton's method stops at 1e-12 of the mechanism's length.
    np.testing.assert_allclose(result.extent, 0.1, atol=1e-10)
    wanted = 0.1 * np.broadcast_to(result.region_direction, result.region.shape)
    np.testing.assert_allclose(result.region, wanted, atol=1e-9)


@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "geared-five-bar", "x-braced-square", "redundant-bar"])
def test_along_the_axes_it_is_as_far_as_the_worst_components(name: str) -> None:
    m = jp.loads(examples.text(name)).first
    result, worst = jp.region(m, directions=4), jp.worst(m)
    sides = worst.worst_component.sel(component=["x", "y"])
    for direction, (axis, side) in enumerate([(0, "high"), (1, "high"), (0, "low"), (1, "low")]):
        wanted = np.abs(sides.sel(side=side)[:, axis])
        # Ascents stop where the value hardly rises, and have what others have met: rotations are not looked for here.
        np.testing.assert_allclose(result.extent[:, direction], wanted, rtol=1e-6)
        first_order = worst.worst_component_first_order.sel(component=["x", "y"], side=side)[:, axis]
        np.testing.assert_allclose(result.extent_first_order[:, direction], np.abs(first_order), rtol=1e-7)


def inside(m: jp.Mechanism, specimens: np.ndarray) -> np.ndarray:
    """Specimens whose deviations lie within the three sigma that count in the worst case."""
    return specimens[admissible(m, specimens).all(axis=1)]


@pytest.mark.parametrize("name", ["four-bar", "3-upu", "six-bar", "excavator", "serial-2r"])
def test_no_specimen_is_outside_and_the_farthest_is_the_worst(name: str) -> None:
    m = jp.loads(examples.text(name)).first
    result, worst = jp.region(m), jp.worst(m)
    at = nominal(m)
    specimens = inside(m, m.core.specimens(20_000, 5, "boundary"))
    axes = result.sizes["axis"]
    d = result.region_direction.values
    for k in range(min(2, len(at))):
        extent = result.extent[k].values
        np.testing.assert_allclose(np.sum(d * result.region[k].values, axis=1), extent, rtol=1e-9)
        assert extent.max() <= worst.worst_position[k] * (1.0 + 1e-9)
        # Between two directions the farthest point is nearer to one of them than half of their angle, 2.5 degrees in
        # the plane; in space points of the spiral are no farther apart than 0.3.
        assert extent.max() >= worst.worst_position[k] * (0.999 if axes == 2 else 0.97)
        count = len(specimens)
        assert count > 1_000
        drives, poses = np.tile(at.drives[k], (count, 1)), np.tile(at.poses[k], (count, 1, 1))
        errors = m.core.given(drives, poses, specimens)["error"][:, :axes] / m.units.length
        assert (errors @ d.T <= extent * (1.0 + 1e-9)).all()


def test_directions_are_spread_evenly() -> None:
    """The mean of the dyads of unit vectors spread evenly is the identity over the number of axes."""
    for axes in (2, 3):
        d = around(axes, 300)
        np.testing.assert_allclose(np.linalg.norm(d, axis=1), 1.0, rtol=1e-12)
        np.testing.assert_allclose(d.T @ d / 300, np.eye(axes) / axes, atol=0.01)


def test_several_outputs_stand_side_by_side() -> None:
    m = jp.loads(examples.text("slider-crank-cases"))
    result = jp.region(m, directions=8)
    for name in m.outputs:
        alone = jp.region(m.only(name, None).first, directions=8)
        np.testing.assert_array_equal(result.extent.sel(output=name), alone.extent)


def test_a_number_of_directions_is_one() -> None:
    with pytest.raises(InputError, match="directions: 2 is not a number of directions; 3 to 10000 are possible"):
        jp.region(jp.loads(CRANK), directions=2)
