"""Configurations of over-constrained mechanisms side by side: each is what it is alone."""

from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar
from jointplay.analyses.nominal import nominal


def cranks() -> jp.Builder:
    """Three parallel cranks on a rod, the third longer than the pins can take up in some places."""
    b = planar(title="Parallel cranks")
    for k, (x, y) in enumerate([(0, 0), (100, 0), (40, 30)], start=1):
        b.revolute(f"A{k}", on={"ground": [x, y], f"c{k}": [0, 0]}, clearance=jp.radial(0.03))
        b.revolute(f"B{k}", on={f"c{k}": [50, 0], "rod": [x, y]}, clearance=jp.radial(0.03))
        b.start(f"c{k}", angle=57)
    b.dimension("c3", body="c3", between=["A3", "B3"], deviation=0.13)
    b.drive("t", joint="A1", from_=30, to=150, count=77)
    b.output(body="rod", at=(50, 50))
    b.load(force=(3, -20))
    return b


def mechanism(name: str) -> jp.Mechanism:
    match name:
        case "cranks":
            return cranks().mechanism()
        case "elastic cranks":
            elastic = {f"bodies.c{k}": {"E": 210000, "area": 20, "inertia": 50} for k in (1, 2, 3)}
            return cranks().mechanism().with_(elastic)
        case _:
            return jp.loads(jp.examples.text(name))


def rows(m: jp.Mechanism) -> tuple[np.ndarray, np.ndarray]:
    """Some more configurations than are solved together, two of them not assembled."""
    at = nominal(m)
    n = 70 if len(at.drives) < 70 else len(at.drives)
    drives, poses = np.resize(at.drives, (n, at.drives.shape[1])), np.resize(at.poses, (n, *at.poses.shape[1:])).copy()
    poses[[3, 69]] = np.nan
    return drives, poses


def assert_same(together: dict[str, Any], alone: dict[str, Any], row: int, part: float) -> None:
    for key, value in together.items():
        # Gaps are rounding themselves, and so is when a sequence stands still that is only as exact as Clarabel.
        rounding = ("gap",) if part <= 1e-10 else ("gap", "iterations")
        if not isinstance(value, np.ndarray) or key in rounding:
            continue
        one = alone[key][0]
        if key == "residual":
            # What is left is rounding of a closed loop, in characteristic lengths, or there is no pose in both.
            np.testing.assert_allclose(value[row], one, rtol=0, atol=1e-14, err_msg=f"{key} {row}")
            continue
        if key == "iterations":
            # The last change is rounding in one of them, and hardly more than that in the other.
            assert abs(int(value[row]) - int(one)) <= 1, row
            continue
        size = np.nanmax(np.abs(value.astype(float)), initial=0.0, where=np.isfinite(value.astype(float)))
        # Programs that are solved together may be scaled by each other's rounding; 1e-18 m of play is nothing.
        np.testing.assert_allclose(value[row], one, rtol=0, atol=part * max(size, 1e-8), err_msg=f"{key} {row}")


#: Where Newton's method does not take a program to the last digits, it is as exact as Clarabel leaves it.
PARTS = {"bennett": 1e-6}
NAMES = ("cranks", "elastic cranks", "sarrus", "bennett", "antenna-support", "x-braced-square", "four-legged-platform")


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("name", NAMES)
def test_loaded_together_is_loaded_alone(name: str, exact: bool) -> None:
    m = mechanism(name)
    drives, poses = rows(m)
    if exact and name in PARTS:
        # The last digits of its poses tell which of its programs are degenerate.
        poses = poses + 1e-14 * np.cos(np.arange(poses.size)).reshape(poses.shape)
    together = m.core.loaded(drives, poses, exact)
    # Where Clarabel decides, that is counted; elsewhere it decides no more than alone: of programs that are degenerate.
    if exact and name in PARTS:
        assert together["fallbacks"] > 0
    elif together["fallbacks"] > 0:
        singles = [(drives[k : k + 1], poses[k : k + 1]) for k in range(len(drives))]
        assert together["fallbacks"] <= sum(m.core.loaded(*single, exact)["fallbacks"] for single in singles)
    for row in [0, 1, 2, 3, 7, 8, 31, 63, 64, 65, 69]:
        alone = m.core.loaded(drives[row : row + 1], poses[row : row + 1], exact)
        assert_same(together, alone, row, PARTS.get(name, 1e-10))


@pytest.mark.parametrize("name", NAMES)
def test_given_together_is_given_alone(name: str) -> None:
    m = mechanism(name)
    drives, poses = rows(m)
    u = m.centre + 1e-5 * np.sin(np.arange(len(drives) * len(m.centre))).reshape(len(drives), -1)
    together = m.core.given(drives, poses, u)
    for row in [0, 3, 8, 63, 64, 69]:
        alone = m.core.given(drives[row : row + 1], poses[row : row + 1], u[row : row + 1])
        assert_same(together, alone, row, 1e-10)


def test_every_status_is_among_them() -> None:
    found: set[str] = set()
    for name in NAMES:
        m = mechanism(name)
        status = m.core.loaded(*rows(m))["status"]
        found |= {jp.loaded(m).status.values[0]} | {_core_status(s) for s in np.unique(status)}
    assert found >= {"ok", "strained", "undetermined", "not_assemblable", "not_assembled"}


def _core_status(number: int) -> str:
    from jointplay import _core

    return _core.STATUSES[number]


def test_axial_play_that_no_load_decides() -> None:
    # Three hinges in a row may each shift by 0.02 mm to both sides along their axes, and take the table along.
    result = jp.loaded(jp.loads(jp.examples.text("sarrus")))
    y = result.undetermined.sel(component="y").values
    np.testing.assert_allclose(y, 0.06, rtol=1e-6)
    parts = result.undetermined_contribution.sel(component="y", source=["a1", "a2", "a3"]).values
    np.testing.assert_allclose(parts, 0.02, rtol=1e-6)
