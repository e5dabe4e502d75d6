"""What is printed, and the formulas of the paper, with the geometry that follows from its Table 1.

Two links AC and BD meet in E, their bases A and B are a line at the angle eps from the x axis; alpha, beta, gamma are
the angles of the triangle at E, B and A. With b = beta - eps and c = gamma + eps:

    lambda_1 = 1/sin alpha [[sin b, -sin c], [cos b, cos c]]                     by the two lengths      (13)
    lambda_2 = 1/sin alpha [[sin b cos c, sin b sin c], [cos b cos c, cos b sin c]]        by A          (14)
    lambda_3 = 1/sin alpha [[cos b sin c, -sin b sin c], [-cos b cos c, sin b cos c]]      by B          (15)

The signs of (15) are those of the printed numbers.
"""

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

DATA = Path(__file__).parent / "data"
CLEARANCE = 0.5
#: from Table 1: A is the origin, x along the panels, y along the cabin
PLACES = {
    "A": np.array([0.0, 0.0]),
    "B": np.array([0.0, 125.0]),
    "E": np.array([14.0, 0.0]),
    "F": np.array([212.0, 0.0]),
    "I": np.array([422.0, 0.0]),
    "D": np.array([212.0, 93.0]),
}
#: axes in which x runs down the cabin and y along the panel, in terms of the ones above
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def rows(name: str) -> list[dict[str, str]]:
    """The rows of a data file, as text."""
    text = (DATA / f"{name}.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def lengths() -> dict[str, tuple[float, float]]:
    """Table 1: length and deviation of every bar, mm."""
    return {row["bar"]: (float(row["length_mm"]), float(row["deviation_mm"])) for row in rows("table-01")}


def errors() -> dict[str, Floats]:
    """Table 3: position errors, mm."""
    return {row["endpoint"]: np.array([float(row["x_mm"]), float(row["y_mm"])]) for row in rows("table-03")}


def jacobians() -> list[Floats]:
    """Equations (38) to (40)."""
    return [
        np.array([[float(row["xx"]), float(row["xy"])], [float(row["yx"]), float(row["yy"])]])
        for row in rows("equations-38-40")
    ]


def contact_forces(force: int) -> dict[str, Floats]:
    """Equations (41), for a force along DF, or (42), for one along DI: the diagonal of every joint's matrix."""
    chosen = [row for row in rows("equations-41-42") if int(row["force"]) == force]
    return {row["joint"]: np.array([float(row["x"]), float(row["y"])]) for row in chosen}


def angles() -> tuple[float, float, float]:
    """The angles beta - eps, gamma + eps and alpha of the triangle B, E, D, with x down the cabin, in degrees.

    BD leans by gamma + eps from the x axis, ED by 180 degrees less beta - eps.
    """
    leans = [_lean(PLACES["D"] - PLACES[base]) for base in ("B", "E")]
    return 180.0 - leans[1], leans[0], leans[1] - leans[0]


def _lean(link: Floats) -> float:
    x, y = TURN @ link
    return float(np.degrees(np.arctan2(y, x)))


def at_vertex(a: Floats, b: Floats, e: Floats) -> list[Floats]:
    """Equations (13) to (15) for the vertex e of two links on the bases a and b, in the axes of these places."""
    c, lean = (float(np.degrees(np.arctan2(*(e - base)[::-1]))) for base in (a, b))
    return formulas(180.0 - lean, c, lean - c)


def turned_end(length: float, phi: float, theta: float) -> Floats:
    """What the last term of equation (5) says that an error theta of the angle phi (radians) does to a link's end."""
    middle = phi + theta / 2.0
    return length * theta * np.array([np.copysign(np.sin(middle), theta), np.cos(middle)])


def formulas(b: float, c: float, alpha: float) -> list[Floats]:
    """Equations (13) to (15) for angles in degrees."""
    (sb, sc), (cb, cc) = np.sin(np.radians([b, c])), np.cos(np.radians([b, c]))
    scale = 1.0 / np.sin(np.radians(alpha))
    first = [[sb, -sc], [cb, cc]]
    second = [[sb * cc, sb * sc], [cb * cc, cb * sc]]
    third = [[cb * sc, -sb * sc], [-cb * cc, sb * cc]]
    return [scale * np.array(matrix) for matrix in (first, second, third)]


def angle_used() -> float:
    """The angle beta - eps that the first column of the printed lambda_1 has, in degrees."""
    column = jacobians()[0][:, 0]
    return float(np.degrees(np.arctan2(column[0], column[1])))


def locked_length(vectors: Floats, clearance: float) -> tuple[float, float]:
    """Equation (37): shortest and longest length of bars in a row, locked at known angles."""
    length = float(np.linalg.norm(np.sum(vectors, axis=0)))
    return length - (len(vectors) - 1) * clearance, length + (len(vectors) - 1) * clearance
