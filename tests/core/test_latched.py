"""Latched hinges, whose angle is held and whose pin keeps its play; and the antenna support, whose panels have them."""

import numpy as np
import pytest
from scipy.optimize import fsolve

import jointplay as jp
from helpers.builders import planar, spatial
from jointplay.errors import InputError


def arm(clearance: dict[str, float]) -> jp.Mechanism:
    b = planar()
    latch = {"at": [5, 6], "axis": 30}
    b.fixed("latch", ground=latch, arm=(0, 0), clearance=clearance, angle={"tolerance": 0.1, "deviation": 0.05})
    b.output(body="arm", at=(100, 0))
    b.load(force=(0, -10))
    return b.mechanism()


ARM = arm({"radial": 0.2})


def test_the_pin_has_its_play_in_the_axes_of_the_joint() -> None:
    m = ARM
    assert m.sources == ("latch", "latch.lock")
    assert m.source_kinds == ("clearance", "angle")
    assert m.parameters == ("latch.along", "latch.normal", "latch.lock.angle")
    moved = jp.given(m, {"latch": [0.1, 0.05], "latch.lock": 0}).error.values[0]
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    np.testing.assert_allclose(moved, [0.1 * c - 0.05 * s, 0.1 * s + 0.05 * c, 0], atol=1e-12)


def test_the_load_pushes_it_and_the_latch_holds_the_moment() -> None:
    m = ARM
    found = jp.loaded(m)
    x, y, angle = found.error.values[0]
    turn, tilt = np.deg2rad(30), np.deg2rad(0.05)
    tip = 100 * np.array([np.cos(turn + tilt) - np.cos(turn), np.sin(turn + tilt) - np.sin(turn)])
    np.testing.assert_allclose([x, y, angle], [tip[0], tip[1] - 0.2, 0.05], atol=1e-9)
    assert found.reaction.sel(joint="latch", wrench="fy").item() == pytest.approx(10)
    arm = 0.1 * np.cos(turn + tilt)
    assert found.reaction.sel(joint="latch", wrench="moment").item() == pytest.approx(10 * arm * 1e3, rel=1e-2)


def test_its_worst_and_its_scatter() -> None:
    m = ARM.with_({"joints.latch.angle": None})
    assert jp.worst(m).worst_position.item() == pytest.approx(0.2, abs=1e-9)
    assert jp.worst(m).worst_rotation.item() == pytest.approx(0.0, abs=1e-12)
    # Uniform in a disc of radius r: r^2 / 4 along every axis.
    covariance = jp.random(m, samples=1000).error_covariance_first_order.values[0]
    np.testing.assert_allclose(covariance[:2, :2], 0.2**2 / 4 * np.eye(2), atol=1e-12)


def test_a_latched_hinge_is_drawn(tmp_path: object) -> None:
    from jointplay.plot import mechanism

    m = ARM
    found = jp.loaded(m)
    figure = mechanism(m, result=found, exaggerate=10)
    (pin,) = [line for line in figure.axes[0].lines if line.get_label() == "pin in its clearance"]
    # Straight down from the hinge, ten times 0.2 mm, in ground axes.
    np.testing.assert_allclose([*pin.get_xdata(), *pin.get_ydata()], [5, 6 - 2], atol=1e-6)


@pytest.mark.parametrize("clearance", [{"gap": 1}, {"radial": 1, "axial": 1}])
def test_its_clearance_is_that_of_a_pin(clearance: dict[str, float]) -> None:
    with pytest.raises(InputError, match=r"joints\.latch\.clearance"):
        arm(clearance)


def test_in_space_a_locked_joint_has_no_play() -> None:
    b = spatial()
    latch = {"at": [5, 6, 0], "axis": [1, 0, 0]}
    b.fixed("latch", ground=latch, arm=(0, 0, 0), clearance={"radial": 0.2}, angle={"tolerance": 0.1})
    b.output(body="arm", at=(100, 0, 0))
    with pytest.raises(InputError, match="'clearance' is not a key here"):
        b.mechanism()


# -- the antenna support ----------------------------------------------------------------------------------------------

DEVIATIONS = {"AB": 0.94, "AE": -0.35, "AF": 1.10, "FI": -1.26, "BD": 1.03, "ED": 0.94, "DF": -0.75, "DI": -0.86}
NOMINAL = {"A": (0, 0), "B": (0, 125), "E": (14, 0), "F": (212, 0), "I": (422, 0), "D": (212, 93)}
LENGTHS = {name: np.hypot(*np.subtract(NOMINAL[name[0]], NOMINAL[name[1]])) for name in DEVIATIONS}


def tip(lengths: dict[str, float]) -> np.ndarray:
    """Where I is when all pins are perfect, from the lengths: circles about points."""

    def gaps(unknown: np.ndarray) -> list[float]:
        turn, dx, dy, ix, iy = unknown
        along, d, i = np.array([np.cos(turn), np.sin(turn)]), np.array([dx, dy]), np.array([ix, iy])
        b, e, f = np.array([0, lengths["AB"]]), lengths["AE"] * along, lengths["AF"] * along
        ends = {"BD": b - d, "ED": e - d, "DF": d - f, "FI": f - i, "DI": d - i}
        return [float(np.hypot(*end)) - lengths[name] for name, end in ends.items()]

    found, *_ = fsolve(gaps, [0, *NOMINAL["D"], *NOMINAL["I"]], xtol=1e-14, full_output=True)
    # Its own word is up to the last bits where it is asked for that many; the lengths are not.
    assert np.abs(gaps(found)).max() < 64 * np.finfo(float).eps * max(lengths.values())
    return np.asarray(found[3:])


def test_the_determinate_form_answers_all_four_questions() -> None:
    m = jp.loads(jp.examples.text("antenna-support", {"locked": "false"}))
    for answer in (jp.given(m), jp.loaded(m), jp.worst(m), jp.random(m, samples=500)):
        assert answer.status.values.tolist() == ["ok"]


def test_the_published_deviations_move_the_tip_as_its_triangles_do() -> None:
    m = jp.loads(jp.examples.text("antenna-support", {"locked": "false"}))
    assert {name: m.value(f"dimensions.{name}.deviation") for name in DEVIATIONS} == DEVIATIONS
    built = tip({name: LENGTHS[name] + DEVIATIONS[name] for name in DEVIATIONS})
    np.testing.assert_allclose(jp.given(m).error.values[0, :2], built - NOMINAL["I"], atol=1e-9)


def test_the_published_jacobian_of_the_dyad() -> None:
    """How D follows the lengths of BD and ED when the inner panel is latched, as its geometry tells (rows x, y)."""
    m = jp.loads(
        jp.examples.text("antenna-support", {"radial": "0", "angle_a": "0", "angle_f": "0", "elastic": "none"})
    )
    # The dyad alone: without DF, DI and the outer panel.
    removed = dict.fromkeys(("joints.F", "joints.F_DF", "joints.I", "dimensions.FI", "dimensions.DF", "assembly"))
    m = m.with_({
        **removed, "dimensions.DI": None, "dimensions.AF": None, "joints.D.bodies": ["BD", "ED"],
        "output": {"body": "BD", "at": "D"}, "loads": [{"force": [1, 0]}],
    })  # fmt: skip
    step = 1e-4
    columns = []
    for name in ("BD", "ED"):
        ends = [
            jp.given(m, deviations={"BD": 0, "ED": 0, "AB": 0, "AE": 0, name: sign * step}).error.values[0, :2]
            for sign in (1, -1)
        ]
        columns.append((ends[0] - ends[1]) / (2 * step))
    np.testing.assert_allclose(np.array(columns).T, [[0.765, 0.269], [-1.629, 1.780]], atol=6e-4)


def test_the_locked_form_is_held_by_its_latches() -> None:
    """Wide play takes up all that is off; hardly any of it leaves the redundant links strained."""
    wide = jp.loaded(jp.loads(jp.examples.text("antenna-support")))
    assert wide.status.values.tolist() == ["ok"]
    factor = wide.clearance_factor.item()
    assert factor < 1
    narrow = jp.loaded(jp.loads(jp.examples.text("antenna-support", {"radial": str(0.5 * 0.9 * factor)})))
    assert narrow.status.values.tolist() == ["strained"]
    assert narrow.clearance_factor.item() == pytest.approx(1 / 0.9, rel=1e-3)
    assert np.abs(narrow.member_force.values).max() > 1
    rigid = jp.loads(jp.examples.text("antenna-support", {"radial": str(0.5 * 0.9 * factor), "elastic": "none"}))
    assert jp.loaded(rigid).status.values.tolist() == ["not_assemblable"]


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"locked": "1"}, "antenna-support: locked: true or false is needed, not 1"),
        ({"elastic": "BD"}, "'BD' is not known here; known: redundant, DF, DI, none"),
        ({"stiffness": "0"}, "stiffness: a number, more than 0, is needed, not 0"),
        ({"angle_a": "wide"}, 'angle_a: a number is needed, not "wide"'),
    ],
)
def test_what_it_is_written_from_is_checked(settings: dict[str, str], said: str) -> None:
    with pytest.raises(InputError) as caught:
        jp.examples.text("antenna-support", settings)
    assert said in str(caught.value)


def test_its_file_says_how_it_was_written() -> None:
    text = jp.examples.text("antenna-support", {"locked": "false", "angle_f": "-0.2"})
    assert "--set locked=false --set elastic=redundant" in text
    assert "--set angle_f=-0.2" in text


def test_the_latches_alone_carry_a_load_that_the_play_of_the_links_lets_through() -> None:
    """Both pins are pushed along the load; panels, deviations and latched angles add up as in a chain."""
    found = jp.loaded(jp.loads(jp.examples.text("antenna-support")))
    np.testing.assert_allclose(found.member_force, 0, atol=1e-6)
    push = 0.5 * np.array([2, -10]) / np.hypot(2, 10)
    along = [np.array([np.cos(turn), np.sin(turn)]) for turn in np.deg2rad([0.05, 0.05 - 0.05])]
    tip = 2 * push + (212 + 1.10) * along[0] + (210 - 1.26) * along[1]
    np.testing.assert_allclose(found.error.values[0, :2], tip - NOMINAL["I"], atol=1e-6)
