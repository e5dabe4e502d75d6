"""The questions of the paper, answered by jointplay on the bundled `four-bar` and `p3r` mechanisms.

Everything here goes through the public functions. `Study` holds plain arrays, in mm and degrees, over the eleven
positions.
"""

from dataclasses import dataclass

import numpy as np
import xarray as xr

import jointplay as jp

from . import published
from .published import Floats

RADII = np.linspace(0.0, 1.0, 11)
SAMPLES = 100_000
GUIDE = {"gap": 0.05, "length": 60.0}
EVERY_PIN = "joints.*.clearance.radial"


@dataclass(frozen=True)
class Correction:
    """Drives at one radial clearance, and the position error each leaves with the play that takes the output to +x."""

    printed: Floats
    rule: Floats
    ours: Floats
    error_held: Floats
    error_printed: Floats
    error_reversed: Floats
    error_ours: Floats


@dataclass(frozen=True)
class Answers:
    """One mechanism along the path. The plain fields are for r = 1 mm; first dimension: position (or `radii`)."""

    name: str
    drive_unit: str
    drives: Floats
    nominal: Floats
    position: Floats
    position_first_order: Floats
    rotation: Floats
    rotation_first_order: Floats
    farthest: Floats
    toward_x: Floats
    loaded: Floats
    loaded_correction: Floats
    loaded_residual: Floats
    quantile95: Floats
    radii: Floats
    position_by_radius: Floats
    rotation_by_radius: Floats
    corrections: dict[float, Correction]


@dataclass(frozen=True)
class Study:
    """Both mechanisms, and what is asked of one of them only.

    `common_drive` is the 4R's drive solved on the path of the P3R, `inverse_kinematics` the change of its drive that
    aims a perfect 4R at the displaced point of 1 mm, `p3r_with_guide_gap` the largest position error with play in the
    guide too, `turned_position` and `turned_rotation` the largest errors of the P3R on the same path with its actuator
    pivot at `turned_pivot`, whence it pushes along the path in the middle.
    """

    four_bar: Answers
    p3r: Answers
    common_drive: Floats
    common_mismatch: Floats
    inverse_kinematics: Floats
    p3r_with_guide_gap: Floats
    turned_position: Floats
    turned_rotation: Floats
    turned_pivot: tuple[float, float]
    samples: int

    def by_name(self, name: str) -> Answers:
        """The answers of the mechanism that the paper calls `4R` or `P3R`."""
        return {answers.name: answers for answers in (self.four_bar, self.p3r)}[name]


def study() -> Study:
    """Ask everything that the page tells. Takes a few seconds."""
    four, other = (jp.loads(jp.examples.text(name), name) for name in ("four-bar", "p3r"))
    common = jp.compare(other, four, names=("P3R", "4R")).sel(mechanism="4R")
    nominal = published.column(2, "x_mm"), published.column(2, "y_mm")
    length_at_output_angle = list(published.LENGTH_RULES.values())[1]
    printed = {
        "4R": {r: published.column(table, "theta1_compensated_deg") for r, table in ((1.0, 8), (0.2, 10))},
        "P3R": {r: published.column(table, "v_compensated_mm") for r, table in ((1.0, 9), (0.2, 11))},
    }
    v, x, y = published.column(1, "v_mm"), published.column(4, "x_mm"), published.column(4, "y_mm")
    rule = {
        "4R": {r: published.drive_angle(*published.displaced_point(*nominal, r)) for r in (1.0, 0.2)},
        "P3R": {r: length_at_output_angle(v, x, y, r) for r in (1.0, 0.2)},
    }
    turned, pivot = _turned(other)
    return Study(
        four_bar=_answers(four, "4R", printed["4R"], rule["4R"]),
        p3r=_answers(other, "P3R", printed["P3R"], rule["P3R"]),
        common_drive=common.drive_value.sel(drive="theta1").values,
        common_mismatch=np.hypot(*common.mismatch.sel(component=["x", "y"]).values.T),
        inverse_kinematics=jp.compensate(four, "given", target=[2.0, 0.0]).correction.values[:, 0],
        p3r_with_guide_gap=jp.worst(other.with_({"joints.P.clearance": GUIDE})).worst_position.values,
        turned_position=turned.worst_position.values,
        turned_rotation=turned.worst_rotation.values,
        turned_pivot=pivot,
        samples=SAMPLES,
    )


def _turned(m: jp.Mechanism) -> tuple[xr.Dataset, tuple[float, float]]:
    """The worst case of the P3R on its own path, its actuator at a right angle to the rocker in the middle of it."""
    x, y, angle = jp.solve(m).nominal.values[len(published.POSITIONS) // 2]
    forward = np.array([-np.sin(np.radians(angle)), np.cos(np.radians(angle))])
    length = published.column(1, "v_mm")[len(published.POSITIONS) // 2]
    pivot = np.round(np.array([x, y]) - length * forward, 1)
    tilt = float(np.degrees(np.arctan2(y - pivot[1], x - pivot[0])))
    moved = m.with_({"joints.J1.on.ground": pivot, "start.cylinder.angle": tilt})
    result = jp.compare(m, moved, names=("P3R", "turned")).sel(mechanism="turned")
    return result, (float(pivot[0]), float(pivot[1]))


def _answers(m: jp.Mechanism, name: str, printed: dict[float, Floats], rule: dict[float, Floats]) -> Answers:
    worst, loaded = jp.worst(m), jp.loaded(m)
    by_radius = jp.sweep(m, EVERY_PIN, RADII, question="worst")
    against_load = jp.compensate(m)
    scatter = jp.random(m, samples=SAMPLES, seed=1)
    highest = jp.given(m, worst.worst_offset.sel(extreme="position")).error
    toward_x = jp.given(m, worst.worst_offset.sel(extreme="x high")).error
    return Answers(
        name=name,
        drive_unit={"4R": "deg", "P3R": "mm"}[name],
        drives=worst[m.drives[0]].values,
        nominal=worst.nominal.values,
        position=worst.worst_position.values,
        position_first_order=worst.worst_position_first_order.values,
        rotation=worst.worst_rotation.values,
        rotation_first_order=worst.worst_rotation_first_order.values,
        farthest=highest.values[:, :2],
        toward_x=toward_x.values,
        loaded=loaded.error.values,
        loaded_correction=against_load.correction.values[:, 0],
        loaded_residual=against_load.residual_position.values,
        quantile95=scatter.error_quantile.sel(probability=0.95, quantity="position").values,
        radii=RADII,
        position_by_radius=by_radius.worst_position.transpose(..., "configuration").values,
        rotation_by_radius=by_radius.worst_rotation.transpose(..., "configuration").values,
        corrections={r: _correction(m.with_({EVERY_PIN: r}), printed[r], rule[r]) for r in printed},
    )


def _correction(m: jp.Mechanism, printed: Floats, rule: Floats) -> Correction:
    play = jp.worst(m).worst_offset.sel(extreme="x high")
    mended = jp.compensate(m, "given", play)
    held = mended.drive_nominal.values[:, 0]
    return Correction(
        printed=printed,
        rule=rule,
        ours=mended.drive_corrected.values[:, 0],
        error_held=_error_at(m, held, play.values),
        error_printed=_error_at(m, printed, play.values),
        error_reversed=_error_at(m, 2.0 * held - printed, play.values),
        error_ours=mended.residual_position.values,
    )


def _error_at(m: jp.Mechanism, drives: Floats, play: Floats) -> Floats:
    """Distance of the output from its nominal place, the drives moved to other values and the play where it was."""
    key = f"drives.{m.drives[0]}"
    moved = m.with_({f"{key}.from": None, f"{key}.to": None, f"{key}.count": None, f"{key}.values": drives})
    there = jp.given(moved, play)
    away = (there.nominal + there.error - jp.solve(m).nominal).values
    distance: Floats = np.hypot(away[:, 0], away[:, 1])
    return distance
