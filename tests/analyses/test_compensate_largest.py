"""Corrections that make the largest error least: of the worst case, and of all load cases with one table."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize, minimize_scalar

import jointplay as jp
from helpers.answers import example
from helpers.builders import planar
from jointplay.analyses import compensate
from jointplay.result import from_dataset
from jointplay.result.conclusions import conclude

SLIDER = planar()
SLIDER.prismatic("guide", bodies=["ground", "carriage"], at=(0, 0), axis=(1, 0))
SLIDER.revolute("pin", carriage=(0, 0), arm=(0, 0), clearance=jp.radial(0.3))
SLIDER.drive("s", joint="guide", values=(10, 20), backlash={"plus": 0.5, "minus": 0.1})
SLIDER.drive("q", joint="pin", values=(0, 0))
SLIDER.output(body="arm")
SLIDER.load("left", force=(-7, 0))
SLIDER.load("right", force=(5, 0))
SLIDER.load("down", force=(0, -3))


def worst_with(m: jp.Mechanism, k: int, corrected: np.ndarray) -> float:
    """The largest position error of one configuration, with the correction as known deviations of the drives."""
    nominal = jp.solve(m)
    changes: dict[str, object] = {}
    for name, value in zip(m.drives, corrected, strict=True):
        at = nominal[name].values[k] if name in nominal.coords else None
        changes |= {f"drives.{name}.values": [float(at)], f"drives.{name}.deviation": float(value)}
    return float(jp.worst(m.with_(changes)).worst_position[0])


def test_a_one_sided_play_is_halved():
    """The carriage stands from 0.1 mm behind to 0.5 mm ahead of its command: 0.2 mm less leaves 0.3 mm to each side."""
    result = jp.compensate(SLIDER.mechanism(), "worst")
    half = (0.5 + 0.1) / 2
    assert_allclose(result.correction.sel(drive="s"), -0.2, rtol=1e-6)
    assert_allclose(result.residual_position, half + 0.3, rtol=1e-7)
    assert_allclose(result.error_position, 0.5 + 0.3, rtol=1e-9)
    assert_allclose(result.residual_component.sel(component="x"), [[-half - 0.3, half + 0.3]] * 2, rtol=1e-6)
    assert result.settled.all()


@pytest.mark.parametrize(("name", "place"), [("p3r", 0), ("slider-crank", 2)])
def test_no_other_value_of_a_drive_leaves_less(name, place):
    m = example(name)
    result = jp.compensate(m, "worst")
    correction = result.correction[place, 0].item()
    reach = 3.0 * abs(correction)
    best = minimize_scalar(
        lambda d: worst_with(m, place, np.array([d])),
        bounds=(-reach, reach),
        method="bounded",
        options={"xatol": 1e-9 * reach},
    )
    assert_allclose(result.residual_position[place], best.fun, rtol=1e-6)
    assert_allclose(worst_with(m, place, result.correction[place].values), result.residual_position[place], rtol=1e-9)
    assert best.fun < 0.995 * result.error_position[place]


def test_no_other_values_of_two_drives_leave_less():
    m = example("serial-2r").with_({"drives.q1.backlash": {"plus": 0.4, "minus": 0.0}})
    result = jp.compensate(m, "worst", weights=(1.0, 0.0))
    start = result.correction[3].values
    best = minimize(
        lambda d: worst_with(m, 3, d),
        start * 1.05 + 1e-3,
        method="Nelder-Mead",
        options={"xatol": 1e-6, "fatol": 1e-8},
    )
    assert result.residual_position[3] <= best.fun * (1.0 + 1e-6)
    assert_allclose(result.residual_position[3], best.fun, rtol=1e-5)
    assert result.residual_position[3] < 0.9 * result.error_position[3]


def test_neither_size_grows_where_nobody_weighs_them():
    result = jp.compensate(example("3-rrr"), "worst")
    assert (result.residual_position <= result.error_position).all()
    assert (result.residual_rotation <= result.error_rotation).all()


def test_a_stroke_holds_the_drive():
    m = SLIDER.mechanism().with_({"limits.drives": {"s": [9.95, 30]}})
    result = jp.compensate(m, "worst")
    assert_allclose(result.drive_corrected.sel(drive="s"), [9.95, 19.8], rtol=1e-6)
    assert result.at_limit.sel(drive="s").values.tolist() == [True, False]
    assert_allclose(result.residual_position, [0.3 + 0.5 - 0.05, 0.6], rtol=1e-6)


def test_one_table_lies_between_the_load_cases():
    """The loads push the pin by 0.3 mm, and the drive to its ends: x from -0.4 to 0.8 mm."""
    m = SLIDER.mechanism()
    own, one = jp.compensate(m, weights=(1.0, 0.0)), jp.compensate(m, weights=(1.0, 0.0), one_table=True)
    assert one.residual_position.dims == own.residual_position.dims
    corrected = one.drive_corrected.sel(drive="s").values
    assert (corrected == corrected[0]).all()
    assert_allclose(one.correction.sel(drive="s"), -0.2, rtol=1e-6)
    assert_allclose(one.residual_position.max("load_case"), 0.6, rtol=1e-6)
    assert_allclose(own.residual_position.sel(load_case=["left", "right"]), 0.0, atol=1e-9)


def test_one_table_by_brute_force():
    m = jp.loads(jp.examples.text("slider-crank-cases")).only("face")
    one = jp.compensate(m, one_table=True)
    (drive,) = m.drives

    def largest(d: float) -> float:
        changes = {f"drives.{drive}.values": [float(one[drive][k])], f"drives.{drive}.deviation": d}
        return float(np.hypot(*jp.loaded(m.with_(changes)).error[:, 0, :2].values.T).max())

    k = 7
    best = minimize_scalar(largest, bounds=(-0.05, 0.05), method="bounded", options={"xatol": 1e-10})
    assert_allclose(one.residual_position[:, k].max(), best.fun, rtol=1e-6)


@pytest.mark.parametrize("question", ["loaded", "worst"])
def test_what_is_left_between_the_rows(question):
    m = example("four-bar").with_({"drives.theta1.values": [20, 45, 80]})
    result = jp.compensate(m, question)
    middle = (result.theta1.values[:-1] + result.theta1.values[1:]) / 2
    corrected = (result.drive_corrected.values[:-1, 0] + result.drive_corrected.values[1:, 0]) / 2
    for k in (0, 1):
        changes = {"drives.theta1.values": [middle[k]], "drives.theta1.deviation": corrected[k] - middle[k]}
        there = m.with_(changes)
        found = jp.worst(there).worst_position if question == "worst" else np.hypot(*jp.loaded(there).error[:, :2].T)
        assert_allclose(result.between_position[k], float(found[0]), rtol=1e-6)
    assert np.isnan(result.between_position[2])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"question": "worst", "target": (0, 0)}, "target: the largest error is made least, and has no target"),
        (
            {"question": "worst", "offsets": {"pin": [0.1, 0]}},
            "offsets: offsets are given; ask for the question 'given'",
        ),
        (
            {"question": "given", "one_table": True},
            "one_table: one table is for all load cases of the question 'loaded'",
        ),
    ],
)
def test_refused(options, words):
    with pytest.raises(jp.InputError, match=words):
        jp.compensate(SLIDER.mechanism(), **options)


def test_one_table_needs_load_cases():
    with pytest.raises(jp.InputError, match="the file has no load cases"):
        jp.compensate(example("four-bar"), one_table=True)


@pytest.mark.parametrize(
    ("options", "words", "never"),
    [
        # A drive of its own would leave nothing in two of the cases.
        ({"one_table": True, "weights": (1.0, 0.0)}, "one table for all load cases leaves the rest", "no drive"),
        ({"question": "worst", "weights": (1.0, 0.0)}, "no drive can remove the rest.", "of both"),
        ({"question": "worst", "weights": (1.0, 2.0)}, "no drive can remove the rest of both.", "one table"),
    ],
)
def test_what_is_left_has_its_true_reason(options, words, never):
    text = " ".join(s.text for s in conclude(from_dataset(jp.compensate(SLIDER.mechanism(), **options))).sentences)
    assert words in text
    assert never not in text


def test_a_size_that_is_not_corrected_has_no_reason():
    """One drive corrects the position of a four-bar; it could remove its rotation."""
    result = jp.compensate(example("four-bar"), "worst")
    (turn,) = (s.text for s in conclude(from_dataset(result)).sentences if s.text.startswith("Largest rotation"))
    assert result.residual_rotation.max() > 0.0
    assert "no drive" not in turn


def test_a_range_is_named_where_it_holds_the_drive():
    m = example("four-bar")
    free = jp.compensate(m)
    at = free.theta1.values
    held = jp.compensate(m.with_({"limits.drives.theta1": [float(at.min()), float(at.max())]}))
    text = " ".join(s.text for s in conclude(from_dataset(held)).sentences)
    k = int(held.residual_position.values.argmax())
    assert ("no drive within its range" in text) == bool(held.at_limit[k].any())
    assert held.at_limit.any()


def test_without_loads_nothing_is_said_to_be_left_open_by_a_load() -> None:
    b = planar()
    b.revolute("pivot", ground=(0, 0), arm=(0, 0), clearance={"radial": 0.1})
    b.drive("q", joint="pivot", values=[30])
    b.output(body="arm", at=(200, 0))
    b.limits(x=[-0.05, 0.05])
    (first, *_) = conclude(compensate.compute(b.mechanism(), "worst")).sentences
    assert "Limit missed" in first.text
    assert "load" not in first.text
