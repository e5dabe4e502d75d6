"""The corrections of two mechanisms on one path, and of one with several clearances (figures 24 and 25 of paper 1)."""

import numpy as np
import pytest

import jointplay as jp

R = 1.0


def both() -> tuple[jp.Mechanism, jp.Mechanism]:
    p3r, four = (jp.loads(jp.examples.text(name), name) for name in ("p3r", "four-bar"))
    return p3r, four.with_({"drives.theta1.values": np.degrees(crank_of(p3r)).tolist()})


def crank_of(p3r: jp.Mechanism) -> np.ndarray:
    """Crank angles of the 75-75-150-100 four-bar on the path of the slider-driven one, by two circles."""
    x, y = jp.solve(p3r).nominal.sel(component=["x", "y"]).values.T
    reach = np.hypot(x, y)
    return np.arctan2(y, x) - np.arccos(reach / 150.0)


@pytest.mark.parametrize("options", [{"corrects": "given"}, {"corrects": "given", "target": [2.0 * R, 0.0]}])
def test_a_comparison_has_the_corrections_of_each(options: dict[str, object]) -> None:
    p3r, four = both()
    result = jp.compare(p3r, four, "compensate", names=("p3r", "4r"), **options)
    for m, name, drive in ((p3r, "p3r", "v"), (four, "4r", "theta1")):
        own = jp.compensate(m, "given", target=options.get("target"))  # type: ignore[arg-type]
        # The crank angles are found in two ways.
        np.testing.assert_allclose(result.correction.sel(mechanism=name, drive=drive), own.correction[:, 0], atol=1e-6)
        other = {"v": "theta1", "theta1": "v"}[drive]
        assert np.isnan(result.correction.sel(mechanism=name, drive=other)).all()


def test_the_inverse_kinematics_of_the_displaced_point_is_that_by_hand() -> None:
    """The drive is where the law of cosines puts it for the nominal point shifted by 2 r, as far as one drive can."""
    p3r, _ = both()
    result = jp.compare(p3r, p3r, "compensate", names=("a", "b"), corrects="given", target=[2.0 * R, 0.0])
    x, y = jp.solve(p3r).nominal.sel(component=["x", "y"]).values.T
    # On the circle of the rocker about (-100, 0) the point nearest to the displaced one.
    angle = np.arctan2(y, x + 2.0 * R + 100.0)
    v = np.hypot(150.0 * np.cos(angle) - 100.0, 150.0 * np.sin(angle))
    np.testing.assert_allclose(result.drive_corrected.sel(mechanism="a", drive="v"), v, rtol=1e-9)


def test_a_sweep_has_the_correction_of_every_clearance() -> None:
    four = jp.loads(jp.examples.text("four-bar"))
    swept = jp.sweep(four, "joints.*.clearance.radial", [0.2, 1.0], "compensate", corrects="given")
    for k, r in enumerate((0.2, 1.0)):
        own = jp.compensate(four.with_({"joints.*.clearance.radial": r}), "given")
        np.testing.assert_array_equal(swept.correction[k], own.correction)


def test_without_offsets_the_largest_error_is_corrected() -> None:
    four = jp.loads(jp.examples.text("four-bar"))
    result = jp.compensate(four, "given")
    worst = jp.worst(four)
    before = np.linalg.norm(result.error.sel(component=["x", "y"]), axis=1)
    np.testing.assert_allclose(before, worst.worst_position, rtol=1e-12)
    assert result.attrs["offsets_of"] == "the largest position error"
    assert (result.residual_position.values < before).all()
