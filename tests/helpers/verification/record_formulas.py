"""What the published cases compare: the methods of their sources, and answers of jointplay that take several steps.

A case names these functions by `by`; lengths are in mm and angles in degrees where a name says nothing else.
"""

import csv
import sys
import tomllib
from functools import cache
from pathlib import Path

import numpy as np

import jointplay as jp
from jointplay.file.standards import limits, travel
from jointplay.file.standards.iso286 import GRADES

from .subject import Array

FOLDER = Path(__file__).resolve().parents[2] / "published"
sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "examples" / "papers"))

from paper1 import published as paper1  # noqa: E402
from paper2 import page as support_page  # noqa: E402
from paper2 import published as paper2  # noqa: E402
from paper2 import study as support  # noqa: E402


@cache
def rows(path: Path) -> list[dict[str, str]]:
    """The rows of a table, as text."""
    text = path.read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


# --- the four-bar and the slider-driven linkage of Jaiswal et al. ----------------------------------------------------


def common_drive() -> Array:
    """The crank angles at which the 4R is where the P3R is, by jointplay."""
    p3r, four_bar = (jp.loads(jp.examples.text(name)) for name in ("p3r", "four-bar"))
    both = jp.compare(p3r, four_bar, names=("P3R", "4R"))
    return np.asarray(both.drive_value.sel(mechanism="4R", drive="theta1").values)


def shift_of_the_rule(radial: float) -> Array:
    """The rule moves the coupler joint by twice the radial clearance, everywhere."""
    return np.full(len(paper1.POSITIONS), 2.0 * radial)


def angle_of_the_rule(table: int, radial: float) -> Array:
    """The rule's displaced output angle, from the printed points of a table."""
    return paper1.output_angle(paper1.column(table, "x_mm"), radial)


def turn_of_the_rule(table: int, radial: float) -> Array:
    """The printed output angle less the rule's displaced one."""
    return paper1.column(table + 1, "theta3_deg") - angle_of_the_rule(table, radial)


def drive_of_the_rule(radial: float) -> Array:
    """The crank angle that the rule's inverse kinematics give for the displaced point."""
    points = paper1.displaced_point(paper1.column(2, "x_mm"), paper1.column(2, "y_mm"), radial)
    return paper1.drive_angle(*points)


def needed_drive(example: str, radial: float) -> Array:
    """The drive that brings the output back from where the clearances take it farthest along +x; by jointplay."""
    m = jp.loads(jp.examples.text(example)).with_({"joints.*.clearance.radial": radial})
    play = jp.worst(m).worst_offset.sel(extreme="x high")
    return np.asarray(jp.compensate(m, "given", play).drive_corrected.values[:, 0])


# --- the support structure of Zhao et al. ----------------------------------------------------------------------------


def bar_lengths(bars: list[str]) -> Array:
    """Distances of the joints that the bundled example has the bars between."""
    data = support.support().data
    ends = [[np.array(data.joints[end].at) for end in data.dimensions[bar].between] for bar in bars]
    return np.array([np.linalg.norm(far - near) for near, far in ends])


def jacobians() -> Array:
    """Of the vertex D by the lengths of BD and ED, by B and by E, x down the cabin, row by row; by jointplay."""
    by_lengths, *by_bases = (paper2.TURN @ matrix for matrix in support.jacobians())
    return np.concatenate([by_lengths.ravel(), *((matrix @ paper2.TURN.T).ravel() for matrix in by_bases)])


def jacobians_with_the_slip() -> Array:
    """The same by the formulas (13) to (15), with the angle that the printed numbers have been computed with."""
    _, gamma, alpha = paper2.angles()
    return np.concatenate([matrix.ravel() for matrix in paper2.formulas(paper2.angle_used(), gamma, alpha)])


def contact_forces(force: int) -> Array:
    """On the bases B and E, x and y, for a unit force on D along DF (1) or DI (2), by jointplay."""
    found = support.contact(support.directions()[force])
    return np.concatenate([found["B"], found["E"]])


def endpoints() -> Array:
    """Errors x, y of the endpoints of Table 3, in the middle of what the clearances leave open; by jointplay."""
    last = jp.assemble(support.support()).isel(step=-1).sel(component=["x", "y"])
    return np.concatenate(
        [last[f"error_{end}"].sel(joint=joint).values for joint, end in support_page.CENTRES.values()]
    )


# --- the one-way clutch ----------------------------------------------------------------------------------------------


def contact_angle(hub: float, roller: float, ring: float) -> Array:
    """Of a roller between the flat of a hub and a ring, from their diameters, by jointplay, in radians."""
    data = tomllib.loads((FOLDER / "one-way-clutch.toml").read_text(encoding="utf-8"))["mechanism"]
    above, away = (hub + roller) / 2.0, (ring - roller) / 2.0
    m = jp.Mechanism(data).with_({"joints.centre.on.arm": [0, away], "joints.flat.on.ground.at": [0, above]})
    return np.radians(jp.solve(m).nominal.sel(component="angle").values)


# --- arms ------------------------------------------------------------------------------------------------------------


def tip_of_arm(length: float, arc_seconds: float) -> Array:
    """How far the end of an arm moves when its drive is off by an angle, by jointplay."""
    m = jp.Mechanism(
        {
            "format": 1,
            "units": {"length": "mm", "angle": "deg", "force": "N"},
            "joints": {"pivot": {"type": "revolute", "on": {"ground": [0, 0], "arm": [0, 0]}}},
            "drives": {"pivot": {"joint": "pivot", "values": [0], "error": arc_seconds / 3600.0}},
            "output": {"body": "arm", "at": [length, 0]},
        }
    )
    return np.asarray(jp.worst(m).worst_position.values)


def abbe_rule(offset: float, arc_seconds: float) -> Array:
    """The error of a length at an offset, with 5e-6 for an arc second."""
    return np.array([offset * 5e-6 * arc_seconds])


# --- tables of standards ---------------------------------------------------------------------------------------------


def deviations(size: float, classes: list[str]) -> Array:
    """Upper and lower deviation of each tolerance class at a size, mm, by jointplay's tables."""
    found = [limits(size, each) for each in classes]
    return np.array([value / 1000.0 for each in found for value in (each.upper, each.lower)])


def clearances(size: float, hole: str, shaft: str) -> Array:
    """Largest and smallest clearance of a fit, mm; negative for an interference."""
    outer, inner = limits(size, hole), limits(size, shaft)
    return np.array([outer.upper - inner.lower, outer.lower - inner.upper]) / 1000.0


def standard_tolerances() -> Array:
    """Width of the shaft h of every grade at the end of every step of sizes, micrometres, by jointplay's tables."""
    return np.array([-limits(end, f"h{grade}").lower for end in _ends("iso286-tolerances.csv") for grade in GRADES])


def bearing_clearances(groups: list[str]) -> Array:
    """Least and greatest clearance of the groups at the end of every step of bores, micrometres."""
    return np.array([value for end in _ends("ball-bearings.csv") for group in groups for value in travel(end, group)])


def _ends(table: str) -> list[float]:
    return [float(row["incl_mm"]) for row in rows(FOLDER / table)]
