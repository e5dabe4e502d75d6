"""Paper 2: what the page says of the printed numbers, from closed forms, finite differences and the engine."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp

PAPERS = Path(__file__).resolve().parents[2] / "examples" / "papers"
sys.path.insert(0, str(PAPERS))

from paper2 import determinate, figures, fixed, page, published  # noqa: E402
from paper2 import study as asked  # noqa: E402
from paper2.published import PLACES, TURN  # noqa: E402


@pytest.fixture(scope="module")
def study() -> asked.Study:
    return asked.study()


def vertex(bd: float, ed: float, b: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Where two circles meet, above the line of their centres."""
    base = e - b
    size = np.linalg.norm(base)
    along = (bd**2 - ed**2 + size**2) / (2 * size)
    unit = base / size
    return b + along * unit + np.sqrt(bd**2 - along**2) * np.array([-unit[1], unit[0]])


def test_the_engine_gives_the_jacobians_of_two_circles_by_differences(study: asked.Study) -> None:
    own = [np.linalg.norm(PLACES["D"] - PLACES[base]) for base in "BE"]
    b, e, h = PLACES["B"], PLACES["E"], 1e-4
    np.testing.assert_allclose(vertex(*own, b, e), PLACES["D"], atol=1e-9)

    def slope(change: list[np.ndarray]) -> np.ndarray:
        ends = [
            vertex(own[0] + s * change[0], own[1] + s * change[1], b + s * change[2], e + s * change[3])
            for s in (h, -h)
        ]
        return (ends[0] - ends[1]) / (2 * h)

    none, x, y = np.zeros(2), np.array([1.0, 0.0]), np.array([0.0, 1.0])
    changes = [
        ([1.0, 0.0, none, none], [0.0, 1.0, none, none]),
        ([0.0, 0.0, x, none], [0.0, 0.0, y, none]),
        ([0.0, 0.0, none, x], [0.0, 0.0, none, y]),
    ]
    for matrix, columns in zip(study.jacobians, changes, strict=True):
        expected = np.stack([slope(list(column)) for column in columns], axis=1)
        np.testing.assert_allclose(matrix, expected, atol=1e-7)


def test_the_formulas_are_right_in_axes_that_run_down_the_cabin(study: asked.Study) -> None:
    turned = [TURN @ study.jacobians[0], *(TURN @ matrix @ TURN.T for matrix in study.jacobians[1:])]
    for formula, matrix in zip(published.formulas(*published.angles()), turned, strict=True):
        np.testing.assert_allclose(formula, matrix, atol=1e-9)


def test_the_printed_jacobians_have_one_angle_ten_degrees_off_and_one_sign(study: asked.Study) -> None:
    b, c, alpha = published.angles()
    assert b + c + alpha == pytest.approx(180.0)
    assert published.angle_used() - b == pytest.approx(10.0, abs=0.05)
    slipped = published.formulas(published.angle_used(), c, alpha)
    slipped[1][1, 0] *= -1
    for printed, formula in zip(published.jacobians(), slipped, strict=True):
        np.testing.assert_allclose(printed, formula, atol=2e-3)
    # Both bases moved alike move the vertex with them.
    np.testing.assert_allclose(study.jacobians[1] + study.jacobians[2], np.eye(2), atol=1e-9)
    assert np.abs(published.jacobians()[1] + published.jacobians()[2] - np.eye(2)).max() > 0.2


def test_contact_forces_are_the_transposed_jacobians_and_in_equilibrium(study: asked.Study) -> None:
    for k, force in asked.directions().items():
        for joint, matrix in zip("BE", study.jacobians[1:], strict=True):
            np.testing.assert_allclose(study.contact[k][joint], matrix.T @ force, atol=1e-7)
        np.testing.assert_allclose(study.contact[k]["B"] + study.contact[k]["E"], force, atol=1e-9)
    first, second = published.contact_forces(1), published.contact_forces(2)
    for joint in "BE":
        np.testing.assert_allclose(first[joint], study.contact[1][joint], atol=6e-4)
    np.testing.assert_allclose(first["B"] + first["E"], first["D"], atol=1e-9)
    # DF is upright and takes nothing of x; the digits printed leave 0.01 at most.
    assert abs(second["B"][0] + second["E"][0]) - abs(second["D"][0]) > 0.05


def test_the_play_of_a_joint_does_the_work_of_its_force(study: asked.Study) -> None:
    by_engine, by_diagonal = study.along
    size = np.linalg.norm(study.contact[1]["B"])
    assert by_engine == pytest.approx(published.CLEARANCE * size, rel=1e-4)
    assert by_diagonal < 0.05 * by_engine


def test_a_folding_link_by_the_formula_and_by_the_engine(study: asked.Study) -> None:
    half = published.lengths()["BD"][0] / 2
    low, high = published.locked_length(np.array([[half, 0.0]] * 2), published.CLEARANCE)
    assert study.links[:2] == pytest.approx((low, high), abs=1e-6)
    bent = 2 * half * np.cos(np.radians(asked.LOCKED) / 2) - published.CLEARANCE
    assert study.links[2] == pytest.approx(bent, abs=1e-6)


def test_the_steps_are_those_of_the_paper(study: asked.Study) -> None:
    assert study.unit.kind.values.tolist() == ["fixed", "connected", "redundant", "fixed", "redundant"]
    freely = study.freely.unit
    assert freely.links.values.tolist() == ["DF, ED", "BD, ground", "DI, FI"]
    assert freely.kind.values.tolist() == ["connected"] * 3
    assert not freely.mobility.any()


def test_the_end_of_a_fixed_link_goes_across_it_and_not_where_equation_5_has_it(study: asked.Study) -> None:
    found = study.fixed
    for by_hand, by_engine in (found.near, found.straight):
        np.testing.assert_allclose(by_engine, by_hand, atol=1e-9)
    for theta in fixed.THETAS:
        np.testing.assert_allclose(found.exact[theta], found.across[theta], atol=1e-9)
        assert found.longer(found.exact, theta) == pytest.approx(0.0, abs=1e-9)
    # Printed, the link keeps its length to second order when it is turned clockwise, and not the other way.
    assert abs(found.longer(found.printed, -1.0)) < 1e-5
    turn, phi = np.radians(1.0), np.radians(fixed.PHI)
    assert found.longer(found.printed, 1.0) == pytest.approx(fixed.LENGTH * turn * np.sin(2 * phi + turn), rel=2e-2)


def test_the_play_of_a_joint_is_not_shared_by_halves(study: asked.Study) -> None:
    """Links on held bases take their bearings along; D's two centres turn with BD about B and with ED about E."""
    for joint, (shaft, bearing) in study.centres.items():
        apart = bearing - shaft
        assert np.linalg.norm(apart) == pytest.approx(published.CLEARANCE, rel=1e-4)
        if joint in "BE":
            np.testing.assert_allclose(shaft, 0.0, atol=1e-9)
            # Along the force on the base, but for the sign that (20) gives it.
            force = study.contact[1][joint]
            np.testing.assert_allclose(apart / published.CLEARANCE, force / np.linalg.norm(force), atol=1e-3)
    shaft, bearing = study.centres["D/ED"]
    assert shaft @ (PLACES["D"] - PLACES["B"]) == pytest.approx(0.0, abs=0.1)
    assert bearing @ (PLACES["D"] - PLACES["E"]) == pytest.approx(0.0, abs=0.1)


def test_figure_1_is_told_by_which_joints_are_locked(study: asked.Study) -> None:
    kinds = {letter: loop.unit.kind.values.tolist() for letter, loop in study.loops.items()}
    assert kinds == {
        "a": ["fixed", "fixed", "connected"],
        "b": ["connected"],
        "c": ["fixed", "connected"],
        "d": ["fixed", "fixed", "connected", "redundant"],
    }
    for loop in study.loops.values():
        assert not loop.unit.mobility[-1]


def test_every_step_of_the_determinate_structure_is_what_its_vertices_say(study: asked.Study) -> None:
    """Deviations of 1 mm on links of 100 mm: the formulas hold to a hundredth of a millimetre; the play of 7 mm that
    I collects turns its range by a degree: they are good to a tenth of a millimetre there."""
    found = study.freely
    for step, names in determinate.CENTRES.items():
        here = found.unit.sel(step=step, component=["x", "y"])
        for name in names:
            at, by_formulas = here.sel(joint=name), found.formulas[name]
            np.testing.assert_allclose(at.error_shaft, by_formulas.error, atol=1e-2)
            np.testing.assert_allclose(
                at.undetermined_shaft, by_formulas.open, atol=1e-2 + 1.5e-2 * by_formulas.open.max()
            )
    # Small deviations and play are the first order.
    for name, (by_formulas, exact) in found.cabin.items():
        np.testing.assert_allclose(exact, by_formulas, atol=1e-2, err_msg=name)


def test_with_little_off_the_determinate_structure_is_its_first_order() -> None:
    share = 1e-3
    bars = {f"dimensions.{bar}.deviation": share * deviation for bar, (_, deviation) in published.lengths().items()}
    m = asked.support(locked=False).with_({**bars, "joints.*.clearance.radial": share * published.CLEARANCE})
    unit, formulas = jp.assemble(m), determinate.by_formulas()
    for step, names in determinate.CENTRES.items():
        for name in names:
            at = unit.sel(step=step, joint=name, component=["x", "y"])
            np.testing.assert_allclose(at.error_shaft / share, formulas[name].error, atol=2e-5)
            np.testing.assert_allclose(at.undetermined_shaft / share, formulas[name].open, atol=2e-4)


def test_the_closed_chain_link_is_as_long_as_brute_force_says(study: asked.Study) -> None:
    """The triangle over the inner panel: D where two circles meet, over offsets on the edge of the play."""
    length, off, reach = study.freely.link
    exact, least, most = study.freely.link_exact
    bars = published.lengths()
    e, f = PLACES["E"] + [bars["AE"][1], 0.0], PLACES["F"] + [bars["AF"][1], 0.0]
    ed, df = (
        float(np.linalg.norm(PLACES["D"] - PLACES[base])) + bars[bar][1] for base, bar in (("E", "ED"), ("F", "DF"))
    )

    def far(offsets: np.ndarray) -> float:
        return float(np.linalg.norm(vertex(ed + offsets[4], df, e + offsets[:2], f + offsets[2:4]))) - length

    assert far(np.zeros(5)) == pytest.approx(exact, abs=1e-6)
    assert off == pytest.approx(exact, abs=2e-3)
    r = published.CLEARANCE
    turns = np.linspace(0.0, 2.0 * np.pi, 73)
    rings = [(r * np.cos(a), r * np.sin(a)) for a in turns]
    tried = [far(np.array([*at_e, *at_f, d])) for at_e in rings for at_f in rings for d in (-r, r)]
    assert (min(tried), max(tried)) == pytest.approx((least, most), abs=2e-3)
    assert least <= min(tried) + 1e-6
    assert max(tried) - 1e-6 <= most
    assert (most - least) / 2.0 == pytest.approx(reach, rel=1e-2)


def test_with_the_clearance_that_a_step_needs_it_just_fits(study: asked.Study) -> None:
    for scale, fits in ((1.01, True), (0.99, False)):
        m = asked.support().with_({"joints.*.clearance.radial": float(scale * study.needed[-1])})
        assert (jp.assemble(m).status[-1].item() != "strained") == fits
    # Forces fall with the play and end where the dead band begins.
    inside = study.clearances >= study.needed[-1]
    for forces in study.forces.values():
        np.testing.assert_allclose(forces[inside], 0.0, atol=1e-6)
        assert np.all(np.abs(forces[~inside]) > 1.0)


def test_what_the_page_finds_in_table_3() -> None:
    errors = published.errors()
    apart = {name: float(np.linalg.norm(errors[f"{name}1"] - errors[name])) for name in page.PAIRS}
    assert apart["A"] == pytest.approx(published.CLEARANCE, abs=1e-3)
    assert all(apart[name] > 2 * published.CLEARANCE - 1e-3 for name in "BDE")
    mirrored = errors["F1"] - errors["F"] * [1.0, -1.0]
    assert np.linalg.norm(mirrored) == pytest.approx(published.CLEARANCE, abs=1e-3)


def test_random_units_are_within_the_worst_case(study: asked.Study) -> None:
    largest = study.scatter.quantile_clearance_factor.max(dim="probability")
    assert np.all(largest <= study.worst.worst_clearance_factor + 1e-9)


def test_the_page_has_every_number_and_a_place_for_every_figure(study: asked.Study) -> None:
    text = page.render(study)
    assert not re.search(r"\$[a-z]|\bnan\b", text)
    assert set(re.findall(r"\(img/([^)]+)\)", text)) == set(figures.FIGURES)
