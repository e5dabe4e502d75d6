"""Assemblies of FreeCAD: joints hold what the solver of FreeCAD says that they hold, in the saved placements."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jointplay as jp
from helpers.freecad import Document, Floats, Pose, cylinder, pose, random_pose, shape
from jointplay.basics import poses
from jointplay.cli import run
from jointplay.exchange.options import Options
from jointplay.exchange.reading import imported
from jointplay.model.mechanism import loads
from jointplay.model.mobility import examine

#: mm and radians: numbers of a file have 12 decimals of a millimetre or of a direction
ROUNDING = 1e-9
ELEMENTS = {"plane": "Face2", "sphere": "Face3", "cylinder": "Face1", "line": "Edge3", "circle": "Edge4", "point": "Vertex3"}
SHAPE = shape(cylinder(3.0, 0.0, 10.0), "plane", "sphere", "line", "circle", "point")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def away(one: Pose, other: Pose) -> Floats:
    return one.at - other.at


def across(one: Pose, other: Pose) -> Floats:
    """From the axis of one to the origin of the other."""
    apart = other.at - one.at
    return np.asarray(apart - one.z * (one.z @ apart))


def parallel(one: Pose, other: Pose) -> Floats:
    return np.cross(one.z, other.z)


def height(one: Pose, other: Pose) -> float:
    return float(abs(one.z @ (other.at - one.at)))


#: JointType, elements, values, where the second frame is in the first one, how many components are locked, and what is
#: zero. Constraints are those of OndselSolver.
Held = tuple[str, tuple[str, str], dict[str, float], Pose, int, Callable[[Pose, Pose], object]]
BEYOND = pose(3, 0, 0, about=(0, 0, 40))
HELD: dict[str, Held] = {
    "revolute": ("Revolute", ("", ""), {}, pose(about=(0, 0, 40)), 5, lambda a, b: [*away(a, b), *parallel(a, b)]),
    "reversed": ("Revolute", ("", ""), {}, pose(about=(180, 0, 0)), 5, lambda a, b: [*away(a, b), *parallel(a, b)]),
    "cylindrical": ("Cylindrical", ("", ""), {}, pose(0, 0, 7, about=(0, 0, 40)), 4, lambda a, b: [*across(a, b), *parallel(a, b)]),
    "slider": ("Slider", ("", ""), {}, pose(0, 0, 7), 5, lambda a, b: [*across(a, b), *(a.turn.inv() * b.turn).as_rotvec()]),
    "ball": ("Ball", ("", ""), {}, pose(about=(10, 50, 40)), 3, away),
    "parallel": ("Parallel", ("", ""), {}, pose(4, 5, 6, about=(0, 0, 40)), 2, parallel),
    "against": ("Parallel", ("", ""), {}, pose(4, 5, 6, about=(0, 180, 0)), 2, parallel),
    "perpendicular": ("Perpendicular", ("", ""), {}, pose(4, 5, 6, about=(90, 0, 0)), 1, lambda a, b: a.z @ b.z),
    "angle": ("Angle", ("", ""), {"Distance": 30.0}, pose(4, 5, 6, about=(0, 30, 0)), 1, lambda a, b: a.z @ b.z - np.cos(np.pi / 6)),
    "angle zero": ("Angle", ("", ""), {"Distance": 0.0}, pose(4, 5, 6), 2, parallel),
    "points": ("Distance", ("point", "point"), {"Distance": 7.0}, pose(2, 3, 6), 1, lambda a, b: np.linalg.norm(away(a, b)) - 7),
    "one point": ("Distance", ("point", "point"), {"Distance": 0.0}, pose(about=(10, 50, 40)), 3, away),
    "spheres": ("Distance", ("sphere", "sphere"), {"Distance": 3.0}, pose(2, 3, 6), 1, lambda a, b: np.linalg.norm(away(a, b)) - 7),
    "sphere, point": ("Distance", ("point", "sphere"), {"Distance": 5.0}, pose(2, 3, 6), 1, lambda a, b: np.linalg.norm(away(a, b)) - 7),
    "lines": ("Distance", ("line", "line"), {"Distance": 5.0}, pose(3, 4, 9), 3, lambda a, b: [*parallel(a, b), np.linalg.norm(across(a, b)) - 5]),
    "one line": ("Distance", ("line", "line"), {"Distance": 0.0}, pose(0, 0, 9), 4, lambda a, b: [*parallel(a, b), *across(a, b)]),
    "line, circle": ("Distance", ("line", "circle"), {"Distance": 2.5}, pose(3, 4, 9), 3, lambda a, b: [*parallel(a, b), np.linalg.norm(across(a, b)) - 5]),
    "cylinders": ("Distance", ("cylinder", "cylinder"), {"Distance": 4.0}, pose(6, 8, 9), 3, lambda a, b: [*parallel(a, b), np.linalg.norm(across(a, b)) - 10]),
    "cylinder, point": ("Distance", ("cylinder", "point"), {"Distance": 2.0}, pose(3, 4, 9), 1, lambda a, b: np.linalg.norm(across(a, b)) - 5),
    "point on line": ("Distance", ("point", "line"), {"Distance": 0.0}, pose(about=(0, 30, 0)) @ pose(0, 0, 0), 2, lambda a, b: across(b, a)),
    "cylinder, sphere": ("Distance", ("cylinder", "sphere"), {"Distance": 5.0}, pose(6, 8, 9), 1, lambda a, b: np.linalg.norm(across(a, b)) - 10),
    "planes": ("Distance", ("plane", "plane"), {"Distance": 4.0}, pose(7, 8, -4, about=(0, 180, 0)), 3, lambda a, b: [*parallel(a, b), height(a, b) - 4]),
    "plane, circle": ("Distance", ("plane", "circle"), {"Distance": 4.0}, pose(7, 8, 4), 3, lambda a, b: [*parallel(a, b), height(a, b) - 4]),
    "plane, point": ("Distance", ("point", "plane"), {"Distance": 4.0}, pose(7, 8, 4).inverse(), 1, lambda a, b: height(b, a) - 4),
    "plane, sphere": ("Distance", ("plane", "sphere"), {"Distance": 4.0}, pose(7, 8, 6, about=(9, 9, 9)), 1, lambda a, b: height(a, b) - 6),
    "plane, cylinder": ("Distance", ("plane", "cylinder"), {"Distance": 1.0}, pose(7, 8, -4, about=(90, 0, 0)), 2, lambda a, b: [a.z @ b.z, height(a, b) - 4]),
    "plane, line": ("Distance", ("plane", "line"), {"Distance": 4.0}, pose(7, 8, 4, about=(0, 90, 0)), 2, lambda a, b: [a.z @ b.z, height(a, b) - 4]),
    "circle, point": ("Distance", ("circle", "point"), {"Distance": 4.0}, pose(7, 8, 4), 1, lambda a, b: height(a, b) - 4),
}  # fmt: skip


def element(word: str) -> str:
    return ELEMENTS.get(word, "")


@pytest.mark.parametrize("case", HELD)
def test_a_joint_holds_what_the_solver_of_freecad_holds(case: str) -> None:
    """As many components, and in poses that are far from the drawing what the constraint says is zero."""
    kind, sides, values, where, locked, zero = HELD[case]
    generator = np.random.default_rng(sorted(HELD).index(case))
    first, second = random_pose(generator), random_pose(generator)
    base = random_pose(generator)
    document = Document(placement=random_pose(generator))
    document.part("base", base, SHAPE)
    document.part("part", base @ first @ where @ second.inverse(), SHAPE)
    document.ground("base")
    document.joint("J", kind, (f"base.{element(sides[0])}", first), (f"part.{element(sides[1])}", second), **values)
    found = imported(document.write("a.FCStd"), Options(output="part"))
    mobility = examine(found.mechanism)
    assert mobility.degrees_of_freedom == 6 - locked
    assert mobility.misfit is None
    # As drawn, and from somewhere else.
    drawn = first @ where @ second.inverse()
    for near in (drawn, drawn @ pose(4, -3, 2, about=(20, 10, -15))):
        rotation = near.turn.as_rotvec(degrees=True).tolist()
        x, y, z = near.at
        start = f"[start]\npart = {{ x = {x:.17g}, y = {y:.17g}, z = {z:.17g}, rotation = {rotation} }}\n"
        kept = [part for part in found.text.split("\n\n") if not part.startswith(("[drives", "[start"))]
        m = loads("\n\n".join([*kept, start]), "a.toml")
        put = m.core.assemble(np.empty(0))
        assert put["converged"]
        own = put["poses"][m.bodies.index("part")]
        is_at = Pose(own[:3] * 1e3, Rotation.from_matrix(poses.matrix(own)))
        assert np.abs(zero(first, is_at @ second)).max() < 1e-7


def test_a_slider_crank_is_where_a_hand_says(tmp_path: Path) -> None:
    """Crank 15, rod 50, in four positions; the assembly is saved tilted, as one is that its solver could not solve."""
    tilted = pose(about=(0, 1.2, 0))
    angle = np.radians(28.0)
    wrist = 15 * np.cos(angle) - np.sqrt(50**2 - (15 * np.sin(angle)) ** 2)
    document = Document()
    document.part("Base", pose())
    document.part("Crank", pose(120, 0, 11) @ tilted @ pose(about=(0, 0, 28.0)))
    rod = np.degrees(np.arctan2(-15 * np.sin(angle), wrist - 15 * np.cos(angle)))
    document.part("Rod", pose(120, 0, 15) @ tilted @ pose(15 * np.cos(angle), 15 * np.sin(angle), 0, about=(0, 0, rod)))
    document.part("Slider", pose(120, 0, 10) @ tilted @ pose(wrist, 0, 0))
    document.ground("Base")
    along = Rotation.from_rotvec([0, -90, 0], degrees=True)
    document.joint("Guide", "Slider", ("Slider.", Pose(np.array([-56.0, 0, 6]), along)), ("Base.", Pose(np.array([25.0, 0, 17]), along)))
    document.joint("Main", "Revolute", ("Base.", pose(120, 0, 15)), ("Crank.", pose(0, 0, 4)))
    document.joint("Pin", "Revolute", ("Rod.", pose(0, 0, 4)), ("Crank.", pose(15, 0, 8)))
    document.joint("Wrist", "Revolute", ("Rod.", pose(50, 0, 5)), ("Slider.", pose(0, 0, 12)))
    m = jp.read(document.write("a.FCStd"), planar=True, drives={"Main": [0, 60, 145, 250]}, output="Slider")
    assert m.drive_values is not None
    traced = m.core.trace(np.ascontiguousarray(m.drive_values))["poses"]
    for turn, found in zip(np.radians([0, 60, 145, 250]), traced[:, m.bodies.index("Slider")], strict=True):
        by_hand = 120 + 15 * np.cos(turn) - np.sqrt(50**2 - (15 * np.sin(turn)) ** 2)
        assert found * [1e3, 1e3, 1] == pytest.approx([by_hand, 0, 0], abs=ROUNDING)
