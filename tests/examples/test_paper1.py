"""Paper 1: the printed tables follow the published rule, the exact figures do not, and the page says what is computed.

Jaiswal, Dsouza, Jawale, Jha, Kumar and Singh, "Error estimation and compensation in 4R and P3R closed-chain mechanisms
due to joint clearance: a comparative study". The tables, the rule and the study live in examples/papers/paper1.
"""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

PAPERS = Path(__file__).resolve().parents[2] / "examples" / "papers"
sys.path.insert(0, str(PAPERS))

from paper1 import exact, figures, page, published, rings  # noqa: E402

P = {name: i for i, name in enumerate(published.POSITIONS)}
ENDS_AND_MIDDLE = [P["P1"], P["P6"], P["P11"]]


@pytest.fixture(scope="module")
def study() -> exact.Study:
    return exact.study()


# --- the published rule against the printed tables -------------------------------------------------------------------


@pytest.mark.parametrize("table", [2, 4])
def test_every_deviated_point_is_the_nominal_one_shifted_by_two_radial_links(table: int) -> None:
    x, y = published.displaced_point(published.column(table, "x_mm"), published.column(table, "y_mm"), 1.0)
    np.testing.assert_allclose(x, published.column(table, "x_deviated_mm"), atol=1e-9)
    np.testing.assert_allclose(y, published.column(table, "y_deviated_mm"), atol=1e-9)


@pytest.mark.parametrize("table", [3, 5])
def test_the_cosine_form_gives_the_printed_angles(table: int) -> None:
    x = published.column(table - 1, "x_mm")
    deviated = published.column(table, "theta3_deviated_deg")
    np.testing.assert_allclose(published.output_angle(x, 1.0), deviated, rtol=0, atol=0.0125)
    printed = published.column(table, "theta3_deg") - deviated
    np.testing.assert_allclose(printed, published.column(table, "error_deg"), atol=1e-9)


def test_the_sine_form_printed_as_its_equal_gives_no_rotation() -> None:
    angle = published.output_angle_from_sine(published.column(2, "y_mm"))
    np.testing.assert_allclose(angle, published.column(3, "theta3_deg"), rtol=0, atol=0.0125)


@pytest.mark.parametrize(("table", "radial", "misprints"), [(8, 1.0, ["P7"]), (10, 0.2, [])])
def test_the_drive_of_the_4r_aims_at_the_displaced_point(table: int, radial: float, misprints: list[str]) -> None:
    target = published.displaced_point(published.column(2, "x_mm"), published.column(2, "y_mm"), radial)
    gap = published.drive_angle(*target) - published.column(table, "theta1_compensated_deg")
    good = [i for name, i in P.items() if name not in misprints]
    np.testing.assert_allclose(gap[good], 0.0, atol=0.017)
    for name in misprints:
        assert gap[P[name]] == pytest.approx(0.152, abs=0.001)


def test_table_8_p7_is_a_misprint_of_54_07() -> None:
    target = published.displaced_point(published.column(2, "x_mm"), published.column(2, "y_mm"), 1.0)
    assert published.drive_angle(*target)[P["P7"]] == pytest.approx(54.07, abs=0.005)
    assert published.column(8, "theta1_compensated_deg")[P["P7"]] == 53.92


@pytest.mark.parametrize(("table", "radial", "closest"), [(9, 1.0, 0.098), (11, 0.2, 0.077)])
def test_no_candidate_gives_the_printed_lengths_of_the_p3r(table: int, radial: float, closest: float) -> None:
    v, x, y = published.column(1, "v_mm"), published.column(4, "x_mm"), published.column(4, "y_mm")
    printed = published.column(table, "v_compensated_mm")
    rows = slice(0, 10) if table == 11 else slice(None)
    gaps = [np.max(np.abs(rule(v, x, y, radial) - printed)[rows]) for rule in published.LENGTH_RULES.values()]
    assert min(gaps) == pytest.approx(closest, abs=0.001)


def test_no_smooth_rule_gives_tables_9_and_11() -> None:
    rounding = 0.005
    assert published.distance_from_smooth(published.column(9, "v_compensated_mm")) > 2 * rounding
    table11 = published.column(11, "v_compensated_mm")
    assert published.distance_from_smooth(table11) > 7 * rounding
    assert published.distance_from_smooth(table11[:-1]) > 1.8 * rounding
    assert published.distance_from_smooth(published.column(10, "theta1_compensated_deg")) < rounding
    assert published.distance_from_smooth(published.column(5, "theta3_deviated_deg")) < rounding


# --- reach, by circles alone -----------------------------------------------------------------------------------------


def test_the_displaced_point_is_out_of_reach_of_the_rocker_except_at_p11() -> None:
    theta = published.column(1, "theta1_deg")
    possible, distance = [], []
    for angle in theta:
        region = rings.output_ties("deg", float(angle), 1.0)
        point = rings.nominal(*region) + np.array([2.0, 0.0])
        possible.append(rings.admits(point, *region))
        distance.append(float(np.hypot(*(point - rings.PIVOT))))
    assert possible == [False] * 10 + [True]
    assert (distance[0], distance[-1]) == (pytest.approx(151.63, abs=0.005), pytest.approx(150.96, abs=0.005))


def test_the_region_lies_in_both_rings_and_its_corners_on_them() -> None:
    region = rings.output_ties("mm", 112.5, 0.7)
    home = rings.nominal(*region)
    assert all(rings.admits(home + 0.999 * (point - home), *region) for point in rings.outline(*region))
    assert not any(rings.admits(home + 1.001 * (point - home), *region) for point in rings.corners(*region))


# --- the exact figures -----------------------------------------------------------------------------------------------


def test_the_common_path_of_table_1(study: exact.Study) -> None:
    # cut after two digits, P1 after one
    cut = np.floor(study.common_drive * 100) / 100
    np.testing.assert_allclose(cut[1:], published.column(1, "theta1_deg")[1:], rtol=0, atol=1e-9)
    assert study.common_drive[0] == pytest.approx(22.72, abs=0.005)
    assert np.max(study.common_mismatch) < 1e-9


def test_exact_worst_case_of_the_4r(study: exact.Study) -> None:
    four = study.four_bar
    np.testing.assert_allclose(four.position[ENDS_AND_MIDDLE], [3.245, 3.297, 3.848], atol=5e-4)
    np.testing.assert_allclose(four.position_first_order[ENDS_AND_MIDDLE], [3.2239, 3.2953, 3.8385], atol=5e-5)
    np.testing.assert_allclose(four.rotation[ENDS_AND_MIDDLE], [1.532, 1.541, 1.668], atol=5e-4)


def test_first_order_is_the_parallelogram_of_the_two_rings(study: exact.Study) -> None:
    for answers, plays in ((study.four_bar, 3), (study.p3r, 2)):
        angle = np.radians(page.transmission_angles(answers))
        corner = np.sqrt(1 + plays**2 + 2 * plays * np.cos(angle)) / np.sin(angle)
        np.testing.assert_allclose(answers.position_first_order, corner, rtol=1e-9)
        turn = np.degrees((1 + plays) / (published.ROCKER * np.sin(angle)))
        np.testing.assert_allclose(answers.rotation_first_order, turn, rtol=1e-9)


def test_load_determined_error_of_the_4r(study: exact.Study) -> None:
    expected = [[0.9505, -3.1031], [1.4962, -2.6909], [1.9960, -2.2475]]
    np.testing.assert_allclose(study.four_bar.loaded[ENDS_AND_MIDDLE, :2], expected, atol=5e-5)


@pytest.mark.parametrize("name", ["4R", "P3R"])
def test_the_worst_case_is_the_farthest_corner_of_two_rings(study: exact.Study, name: str) -> None:
    answers = study.by_name(name)
    np.testing.assert_allclose(answers.position, page.farthest(answers), rtol=0, atol=1e-7)


@pytest.mark.parametrize("name", ["4R", "P3R"])
def test_the_worst_pose_lies_where_the_rings_allow(study: exact.Study, name: str) -> None:
    answers = study.by_name(name)
    for i, drive in enumerate(answers.drives):
        region = rings.output_ties(answers.drive_unit, float(drive), 1.0 + 1e-9)
        for error in (answers.farthest[i], answers.toward_x[i, :2]):
            assert rings.admits(answers.nominal[i, :2] + error, *region)


def test_the_largest_rotation_does_not_fall_along_the_path(study: exact.Study) -> None:
    printed = published.column(3, "error_deg")
    assert np.all(np.diff(printed) < 0)
    assert study.four_bar.rotation[-1] > study.four_bar.rotation[0]


def test_the_4r_is_the_more_robust_one_at_every_position(study: exact.Study) -> None:
    assert np.all(study.four_bar.position < study.p3r.position)
    assert np.all(study.four_bar.rotation < study.p3r.rotation)


def test_the_p3r_with_its_actuator_turned_is_better_than_the_4r(study: exact.Study) -> None:
    assert np.all(study.turned_position < study.four_bar.position)
    assert np.all(study.turned_rotation < study.four_bar.rotation)


def test_play_in_the_guide_of_the_p3r_is_taken_up_by_its_pivot(study: exact.Study) -> None:
    np.testing.assert_allclose(study.p3r_with_guide_gap, study.p3r.position, rtol=0, atol=1e-9)


@pytest.mark.parametrize("radial", [1.0, 0.2])
@pytest.mark.parametrize("name", ["4R", "P3R"])
def test_the_needed_correction_keeps_its_sign_and_beats_the_printed_one(
    study: exact.Study, name: str, radial: float
) -> None:
    answers = study.by_name(name)
    fix = answers.corrections[radial]
    assert np.all(fix.ours > answers.drives)
    for other in (fix.error_held, fix.error_printed, fix.error_reversed):
        assert np.all(fix.error_ours <= other + 1e-9)


# --- the page --------------------------------------------------------------------------------------------------------


def test_the_page_has_every_number_and_a_place_for_every_figure(study: exact.Study) -> None:
    text = page.render(study)
    assert not re.search(r"\$[a-z]|\bnan\b", text)
    assert set(re.findall(r"\(img/([^)]+)\)", text)) == {f"paper-1-{name}.svg" for name in figures.FIGURES}
