"""The tables of the page, as Markdown: what the paper prints on the left, what jointplay computes on the right."""

from collections.abc import Iterable, Sequence

import numpy as np

from . import published, rings
from .exact import Answers, Study
from .published import POSITIONS, Floats


def markdown(header: Sequence[str], body: Iterable[Sequence[str]]) -> str:
    """A Markdown table: first column left, all others right aligned."""
    lines = [header, [":--", *["--:"] * (len(header) - 1)], *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def fixed(value: float, digits: int) -> str:
    """A number for reading: fixed digits, a true minus sign, no negative zero."""
    text = f"{value:.{digits}f}"
    return text.replace("-", "−") if float(text) else text.lstrip("-")


def signed(value: float, digits: int) -> str:
    """A difference: always with its sign, zero without."""
    text = fixed(value, digits)
    return text if value <= 0 or not float(f"{value:.{digits}f}") else "+" + text


def tiny(value: float, bound: float = 1e-9) -> str:
    """A difference that is nothing but rounding, as a bound: its digits would change from machine to machine."""
    return f"< {bound:.0e}".replace("e-0", "e−") if value < bound else f"{value:.1e}"


def pair(x: float, y: float, digits: int = 3) -> str:
    """A point or a displacement."""
    return f"({fixed(x, digits)}, {fixed(y, digits)})"


def common_trajectory(study: Study) -> str:
    """Table 1: the drive angle of the 4R that puts its coupler point on that of the P3R."""
    theta, length = published.column(1, "theta1_deg"), published.column(1, "v_mm")
    return markdown(
        [
            "position",
            "v [mm]",
            "θ₁ printed [°]",
            "θ₁ ours [°]",
            "difference [°]",
            "distance between the two points [mm]",
        ],
        [
            [
                p,
                fixed(length[i], 1),
                fixed(theta[i], 2),
                fixed(study.common_drive[i], 4),
                signed(study.common_drive[i] - theta[i], 4),
                tiny(study.common_mismatch[i]),
            ]
            for i, p in enumerate(POSITIONS)
        ],
    )


def trajectory(answers: Answers, number: int) -> str:
    """Tables 2 and 4: nominal and deviated positions, and the largest error there really is."""
    col = {name: published.column(number, name) for name in ("x_mm", "y_mm", "x_deviated_mm", "y_deviated_mm")}
    drive = f"{'θ₁' if answers.drive_unit == 'deg' else 'v'} [{'°' if answers.drive_unit == 'deg' else 'mm'}]"
    return markdown(
        [
            "position",
            drive,
            "desired, printed [mm]",
            "nominal, ours [mm]",
            "deviated, printed [mm]",
            "printed error [mm]",
            "largest error, exact [mm]",
            "first order [mm]",
            "where it goes: (Δx, Δy) [mm]",
        ],
        [
            [
                p,
                fixed(answers.drives[i], 2),
                pair(col["x_mm"][i], col["y_mm"][i]),
                pair(*answers.nominal[i, :2]),
                pair(col["x_deviated_mm"][i], col["y_deviated_mm"][i]),
                fixed(
                    float(np.hypot(col["x_deviated_mm"][i] - col["x_mm"][i], col["y_deviated_mm"][i] - col["y_mm"][i])),
                    3,
                ),
                f"**{fixed(answers.position[i], 3)}**",
                fixed(answers.position_first_order[i], 3),
                pair(*answers.farthest[i]),
            ]
            for i, p in enumerate(POSITIONS)
        ],
    )


def orientation(answers: Answers, number: int) -> str:
    """Tables 3 and 5: the output angle, the rule behind the printed one, and the largest rotation there really is."""
    printed, deviated = published.column(number, "theta3_deg"), published.column(number, "theta3_deviated_deg")
    rule = published.output_angle(published.column(number - 1, "x_mm"), 1.0)
    return markdown(
        [
            "position",
            "θ₃ printed [°]",
            "θ₃ ours [°]",
            "θ₃′ printed [°]",
            "θ₃′ rule [°]",
            "rule − printed [°]",
            "printed error [°]",
            "largest rotation, exact [°]",
            "first order [°]",
        ],
        [
            [
                p,
                fixed(printed[i], 2),
                fixed(answers.nominal[i, 2], 3),
                fixed(deviated[i], 2),
                fixed(rule[i], 3),
                signed(rule[i] - deviated[i], 3),
                fixed(published.column(number, "error_deg")[i], 2),
                f"**{fixed(answers.rotation[i], 3)}**",
                fixed(answers.rotation_first_order[i], 3),
            ]
            for i, p in enumerate(POSITIONS)
        ],
    )


def cad_nominal(study: Study) -> str:
    """Table 6: nominal poses from the paper's model, its CAD, jointplay and two intersecting circles."""
    body = []
    for row in published.rows(6):
        answers = study.by_name(row["mechanism"])
        i = POSITIONS.index(row["position"])
        x, y, angle = answers.nominal[i]
        circle = rings.nominal(*rings.output_ties(answers.drive_unit, float(answers.drives[i]), 1.0))
        body.append(
            [
                f"{answers.name}, {row['position']}",
                f"({row['x_mm']}, {row['y_mm']}), {row['theta3_deg']}°",
                f"({row['x_cad_mm']}, {row['y_cad_mm']}), {row['theta3_cad_deg']}°",
                f"{pair(x, y, 4)}, {fixed(angle, 3)}°",
                tiny(float(np.hypot(*(circle - [x, y])))),
            ]
        )
    header = ["", "paper, model", "paper, CAD", "ours", "ours − two circles [mm]"]
    return markdown(
        header, [[cell.replace("-", "−") if k < 3 else cell for k, cell in enumerate(line)] for line in body]
    )


def cad_displaced(study: Study) -> str:
    """Table 7: the deviated poses of the paper's CAD, what they contradict, and an extreme pose that closes."""
    body = []
    for row in published.rows(7):
        answers = study.by_name(row["mechanism"])
        i = POSITIONS.index(row["position"])
        arm = np.array([float(row["x_cad_mm"]), float(row["y_cad_mm"])]) - rings.PIVOT
        pose = answers.nominal[i] + answers.toward_x[i]
        body.append(
            [
                f"{answers.name}, {row['position']}",
                f"({row['x_mm']}, {row['y_mm']}), {row['theta3_deg']}°".replace("-", "−"),
                f"({row['x_cad_mm']}, {row['y_cad_mm']}), {row['theta3_cad_deg']}°".replace("-", "−"),
                fixed(float(np.hypot(*arm)), 2),
                fixed(float(np.degrees(np.arctan2(arm[1], arm[0]))), 2),
                f"{pair(pose[0], pose[1])}, {fixed(pose[2], 2)}°",
            ]
        )
    return markdown(
        [
            "",
            "paper, model",
            "paper, CAD",
            "its distance from the rocker pivot [mm]",
            "its direction from the rocker pivot [°]",
            "ours: farthest along +x that closes",
        ],
        body,
    )


def drive_correction(answers: Answers, number: int, radial: float) -> str:
    """Tables 8 to 11: the printed drives, the rule, and the drives that bring the output back."""
    fix = answers.corrections[radial]
    symbol, unit = ("θ₁", "°") if answers.drive_unit == "deg" else ("v", "mm")
    rule = "rule" if answers.drive_unit == "deg" else "cosine theorem at θ₃′"
    return markdown(
        [
            "position",
            f"{symbol} [{unit}]",
            f"printed [{unit}]",
            f"{rule} [{unit}]",
            f"difference [{unit}]",
            f"printed change [{unit}]",
            f"change needed, ours [{unit}]",
            "error, drive held [mm]",
            "error, printed drive [mm]",
            "error, sign reversed [mm]",
            "error, ours [mm]",
        ],
        [
            [
                p,
                fixed(answers.drives[i], 2),
                fixed(fix.printed[i], 2),
                fixed(fix.rule[i], 3),
                signed(fix.rule[i] - fix.printed[i], 3),
                signed(fix.printed[i] - answers.drives[i], 2),
                f"**{signed(fix.ours[i] - answers.drives[i], 3)}**",
                fixed(fix.error_held[i], 3),
                fixed(fix.error_printed[i], 3),
                fixed(fix.error_reversed[i], 3),
                fixed(fix.error_ours[i], 3),
            ]
            for i, p in enumerate(POSITIONS)
        ],
    )


def length_rules() -> str:
    """How far each candidate is from Tables 9 and 11."""
    v, x, y = published.column(1, "v_mm"), published.column(4, "x_mm"), published.column(4, "y_mm")

    def worst(rule: published.LengthRule, number: int, radial: float, upto: int) -> str:
        gap: Floats = rule(v, x, y, radial) - published.column(number, "v_compensated_mm")
        return fixed(float(np.max(np.abs(gap[:upto]))), 3)

    return markdown(
        ["candidate for v′", "Table 9, largest difference [mm]", "Table 11, P1 to P10 [mm]", "Table 11, with P11 [mm]"],
        [
            [name, worst(rule, 9, 1.0, 11), worst(rule, 11, 0.2, 10), worst(rule, 11, 0.2, 11)]
            for name, rule in published.LENGTH_RULES.items()
        ],
    )


def comparison(study: Study) -> str:
    """The two mechanisms side by side, the same radial clearance in every pin."""
    four, other = study.four_bar, study.p3r
    return markdown(
        [
            "position",
            "4R, worst [mm]",
            "P3R, worst [mm]",
            "ratio",
            "4R, worst [°]",
            "P3R, worst [°]",
            "ratio",
            "4R, 95 % [mm]",
            "P3R, 95 % [mm]",
            "4R, loaded [mm]",
            "P3R, loaded [mm]",
        ],
        [
            [
                p,
                fixed(four.position[i], 3),
                fixed(other.position[i], 3),
                fixed(four.position[i] / other.position[i], 2),
                fixed(four.rotation[i], 3),
                fixed(other.rotation[i], 3),
                fixed(four.rotation[i] / other.rotation[i], 2),
                fixed(four.quantile95[i], 2),
                fixed(other.quantile95[i], 2),
                fixed(float(np.hypot(*four.loaded[i, :2])), 3),
                fixed(float(np.hypot(*other.loaded[i, :2])), 3),
            ]
            for i, p in enumerate(POSITIONS)
        ],
    )
