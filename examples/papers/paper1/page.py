"""The documentation page: a template with every number filled in from the study."""

from pathlib import Path
from string import Template

import numpy as np

from . import published, rings, tables
from .exact import Answers, Study
from .published import POSITIONS, Floats
from .tables import fixed, signed, tiny

TEMPLATE = Path(__file__).parent / "page.md"
RADIAL = 1.0


def positions(chosen: list[bool]) -> str:
    """Positions in words: `P1`, `P1 to P10`, `P1 to P3 and P9`, `no position`, `every position`."""
    if all(chosen):
        return "every position"
    if not any(chosen):
        return "no position"
    edges = np.flatnonzero(np.diff([0, *map(int, chosen), 0]))
    runs = [
        POSITIONS[a] if b == a + 1 else f"{POSITIONS[a]} to {POSITIONS[b - 1]}"
        for a, b in zip(edges[::2], edges[1::2], strict=True)
    ]
    return " and ".join([", ".join(runs[:-1]), runs[-1]] if len(runs) > 1 else runs)


def _drives(answers: Answers) -> list[tuple[str, float]]:
    return [(answers.drive_unit, float(drive)) for drive in answers.drives]


def farthest(answers: Answers) -> Floats:
    """Largest position error by the two rings alone, in mm."""
    return np.array([rings.farthest(*rings.output_ties(*drive, RADIAL)) for drive in _drives(answers)])


def transmission_angles(answers: Answers) -> Floats:
    """Angle between rocker and driving link at the coupler joint, folded to at most 90 degrees."""
    result = []
    for drive, home in zip(_drives(answers), answers.nominal[:, :2], strict=True):
        rocker, driving = (tie.centre - home for tie in rings.output_ties(*drive, RADIAL))
        sine = rocker[0] * driving[1] - rocker[1] * driving[0]
        result.append(np.degrees(np.arctan2(abs(sine), abs(rocker @ driving))))
    return np.array(result)


def right_angle_error(plays: int) -> float:
    """First-order largest position error if rocker and driving link met at a right angle, in mm."""
    return float(RADIAL * np.hypot(1, plays))


def right_angle_rotation(plays: int) -> float:
    """The same for the rotation of the rocker, in degrees."""
    return float(np.degrees((1 + plays) * RADIAL / published.ROCKER))


def rule_values(study: Study) -> dict[str, str]:
    """How far the published rule and the nominal poses are from the printed tables."""
    x, y = published.column(2, "x_mm"), published.column(2, "y_mm")
    table8 = published.column(8, "theta1_compensated_deg")
    p7 = POSITIONS.index("P7")
    rule8 = published.drive_angle(*published.displaced_point(x, y, 1.0))
    rule10 = published.drive_angle(*published.displaced_point(x, y, 0.2))
    printed = {
        study.four_bar.name: np.column_stack([x, y]),
        study.p3r.name: np.column_stack([published.column(4, "x_mm"), published.column(4, "y_mm")]),
    }
    nominal = max(float(np.max(np.abs(a.nominal[:, :2] - printed[a.name]))) for a in (study.four_bar, study.p3r))
    mended = table8.copy()
    mended[p7] = round(float(rule8[p7]), 2)

    v, x3, y3 = published.column(1, "v_mm"), published.column(4, "x_mm"), published.column(4, "y_mm")
    smooth = [published.distance_from_smooth(rule(v, x3, y3, 1.0)) for rule in published.LENGTH_RULES.values()]
    smooth.remove(max(smooth))  # the printed inverse, which has a pole at P6

    def angle_gap(number: int) -> float:
        rule = published.output_angle(published.column(number - 1, "x_mm"), 1.0)
        return float(np.max(np.abs(rule - published.column(number, "theta3_deviated_deg"))))

    return {
        "table1_max": fixed(float(np.max(np.abs(study.common_drive - published.column(1, "theta1_deg")))), 3),
        "p1_common": fixed(float(study.common_drive[0]), 2),
        "path_gap": fixed(float(np.max(np.hypot(*(study.four_bar.nominal - study.p3r.nominal)[:, :2].T))), 3),
        "orientation_gap": fixed(
            float(np.max(np.abs(published.column(3, "error_deg") - published.column(5, "error_deg")))), 2
        ),
        "ik_low": fixed(study.inverse_kinematics.max(), 2),
        "ik_high": fixed(study.inverse_kinematics.min(), 2),
        "nominal_max": fixed(nominal, 4),
        "table3_max": fixed(angle_gap(3), 3),
        "table5_max": fixed(angle_gap(5), 3),
        "table8_max": fixed(float(np.max(np.abs(np.delete(rule8 - table8, p7)))), 3),
        "table10_max": fixed(float(np.max(np.abs(rule10 - published.column(10, "theta1_compensated_deg")))), 3),
        "sine_p1": fixed(float(published.output_angle_from_sine(y)[0]), 2),
        "p7_rule": fixed(float(rule8[p7]), 2),
        "smooth_8": fixed(published.distance_from_smooth(mended), 3),
        "smooth_rules": fixed(max(smooth), 3),
        "smooth_9": fixed(published.distance_from_smooth(published.column(9, "v_compensated_mm")), 3),
        "smooth_10": fixed(published.distance_from_smooth(published.column(10, "theta1_compensated_deg")), 3),
        "smooth_11": fixed(published.distance_from_smooth(published.column(11, "v_compensated_mm")[:-1]), 3),
    }


def reach_values(study: Study) -> dict[str, str]:
    """Where the displaced point can be, and the largest errors there really are."""
    values: dict[str, str] = {}
    for short, answers in (("4r", study.four_bar), ("p3r", study.p3r)):
        drives = _drives(answers)
        displaced = answers.nominal[:, :2] + [2.0 * RADIAL, 0.0]
        on_rocker = [rings.output_ties(*drive, RADIAL) for drive in drives]
        on_coupler = [rings.other_pin_ties(*drive, RADIAL) for drive in drives]
        coupler_side = np.array([rings.farthest(*ties) for ties in on_coupler])
        angles = transmission_angles(answers)
        values |= {
            f"unreachable_{short}": positions(
                [not rings.admits(p, *t) for p, t in zip(displaced, on_rocker, strict=True)]
            ),
            f"reachable_coupler_{short}": positions(
                [rings.admits(p, *t) for p, t in zip(displaced, on_coupler, strict=True)]
            ),
            f"coupler_{short}_low": fixed(coupler_side.min(), 3),
            f"coupler_{short}_high": fixed(coupler_side.max(), 3),
            f"worst_{short}_low": fixed(answers.position.min(), 3),
            f"worst_{short}_high": fixed(answers.position.max(), 3),
            f"trans_{short}_low": fixed(angles.min(), 1),
            f"trans_{short}_high": fixed(angles.max(), 1),
        }
    four = study.four_bar
    for name in ("P1", "P6", "P11"):
        i = POSITIONS.index(name)
        values |= {
            f"worst_4r_{name.lower()}": fixed(four.position[i], 3),
            f"worst_4r_{name.lower()}_first": fixed(four.position_first_order[i], 3),
            f"rot_4r_{name.lower()}": fixed(four.rotation[i], 3),
            f"pivot_{name.lower()}": fixed(
                float(np.hypot(*(four.nominal[i, :2] + [2.0 * RADIAL, 0.0] - rings.PIVOT))), 2
            ),
        }
    return values | {
        "rings_4r_p1": fixed(float(farthest(four)[0]), 3),
        "rings_gap": tiny(max(float(np.max(np.abs(a.position - farthest(a)))) for a in (four, study.p3r))),
    }


def comparison_values(study: Study) -> dict[str, str]:
    """What the two mechanisms have to say against each other."""
    four, other = study.four_bar, study.p3r
    gain = 100.0 * (1.0 - four.position / other.position)
    gain_rotation = 100.0 * (1.0 - four.rotation / other.rotation)
    load4, load3 = (np.hypot(*a.loaded[:, :2].T) for a in (four, other))
    jump = int(np.argmax(-np.diff(load3)))
    fix4, fix3 = four.corrections[RADIAL], other.corrections[RADIAL]

    def stroke(answers: Answers, drives: Floats) -> str:
        return fixed(float(100.0 * np.max(np.abs(drives - answers.drives)) / np.ptp(answers.drives)), 1)

    return {
        "robust_low": fixed(gain.min(), 0),
        "robust_high": fixed(gain.max(), 0),
        "robust_rot_low": fixed(gain_rotation.min(), 0),
        "robust_rot_high": fixed(gain_rotation.max(), 0),
        "fix_worse_4r": positions(list(fix4.error_printed > fix4.error_held)),
        "fix_worse_p3r": positions(list(fix3.error_printed > fix3.error_held)),
        "fix_reversed_worse_4r": positions(list(fix4.error_reversed > fix4.error_held)),
        "fix_reversed_worse_p3r": positions(list(fix3.error_reversed > fix3.error_held)),
        "guide_extra": tiny(float(np.max(np.abs(study.p3r_with_guide_gap - other.position))), 1e-6),
        "load_p3r_less": positions(list(load3 < load4)),
        "load_before": POSITIONS[jump],
        "load_after": POSITIONS[jump + 1],
        "load_from": fixed(load3[jump], 2),
        "load_to": fixed(load3[jump + 1], 2),
        "load_fix_low": signed(four.loaded_correction.min(), 2),
        "load_fix_high": signed(four.loaded_correction.max(), 2),
        "load_left": fixed(four.loaded_residual.max(), 3),
        "turned_x": fixed(study.turned_pivot[0], 1),
        "turned_y": fixed(study.turned_pivot[1], 1),
        "turned_low": fixed(study.turned_position.min(), 2),
        "turned_high": fixed(study.turned_position.max(), 2),
        "turned_rot_low": fixed(study.turned_rotation.min(), 2),
        "turned_rot_high": fixed(study.turned_rotation.max(), 2),
        "right_4r": fixed(right_angle_error(3), 2),
        "right_p3r": fixed(right_angle_error(2), 2),
        "right_rot_4r": fixed(right_angle_rotation(3), 2),
        "right_rot_p3r": fixed(right_angle_rotation(2), 2),
        "stroke_4r": stroke(four, fix4.ours),
        "stroke_p3r": stroke(other, fix3.ours),
        "samples": f"{study.samples:,}".replace(",", " "),
    }


def render(study: Study) -> str:
    """The whole page. A placeholder without a value is an error, so that no sentence stands without its number."""
    four, other = study.four_bar, study.p3r
    blocks = {
        "table1": tables.common_trajectory(study),
        "table2": tables.trajectory(four, 2),
        "table3": tables.orientation(four, 3),
        "table4": tables.trajectory(other, 4),
        "table5": tables.orientation(other, 5),
        "table6": tables.cad_nominal(study),
        "table7": tables.cad_displaced(study),
        "table8": tables.drive_correction(four, 8, 1.0),
        "table9": tables.drive_correction(other, 9, 1.0),
        "table10": tables.drive_correction(four, 10, 0.2),
        "table11": tables.drive_correction(other, 11, 0.2),
        "length_rules": tables.length_rules(),
        "comparison": tables.comparison(study),
    }
    text = Template(TEMPLATE.read_text(encoding="utf-8"))
    return text.substitute(blocks | rule_values(study) | reach_values(study) | comparison_values(study))
