"""Maps of parallel robots beside their determinants by hand, for `test_branches.py` and `verify_branches.py`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import jointplay as jp
from helpers.oracles import branches
from helpers.oracles.branches import Floats, Robot

DATA = Path(__file__).parents[1] / "data"


@dataclass(frozen=True)
class Case:
    """A map, and the robot by hand."""

    #: what the table calls it
    name: str
    m: jp.Mechanism
    robot: Robot
    #: of the map
    grid: dict[str, Any]

    @property
    def axes(self) -> int:
        """How many it has."""
        return sum(isinstance(values, dict) for values in self.grid.values())


def span(low: float, high: float, count: int) -> dict[str, float]:
    return {"from": low, "to": high, "count": count}


def cases(finer: int) -> list[Case]:
    """Grids of 4 (finer = 1) or more steps along every axis, coarse ones first."""

    def n(count: int) -> int:
        return count * finer + 1

    def example(name: str) -> jp.Mechanism:
        return jp.loads(jp.examples.text(name))

    tool = jp.load(DATA / "five-bar-behind-singularity.toml")
    y = 230.0 * np.sin(np.radians(80)) + np.sqrt(230.0**2 - (137.5 - 230 * np.cos(np.radians(80))) ** 2)
    robot = branches.five_bar(137.5, 230.0, 230.0, (0.0, float(y)))
    own = branches.five_bar(45.0, 110.0, 150.0, (0.0, 190.0))
    upu, delta, stewart = branches.three_upu(), branches.delta(), branches.stewart_gough()
    rrr, level = branches.three_rrr(), {"rx": 0, "ry": 0, "rz": 0}

    def over(**axes: tuple[float, float, int] | float) -> dict[str, Any]:
        return {k: span(v[0], v[1], n(v[2])) if isinstance(v, tuple) else v for k, v in axes.items()}

    table = (
        ("five-bar, x and y", tool, robot, over(x=(-300, 300, 14), y=(-20, 400, 11))),
        ("five-bar, along y", tool, robot, over(x=0, y=(100, 372, 17))),
        ("five-bar of the examples", example("five-bar"), own, over(x=(-200, 200, 10), y=(-50, 250, 8))),
        ("3-RRR, x and y", example("3-rrr"), rrr, over(x=(-150, 150, 8), y=(-150, 150, 8), angle=0)),
        ("3-RRR, x, y and angle", example("3-rrr"), rrr, over(x=(-120, 120, 4), y=(-120, 120, 4), angle=(-60, 60, 4))),
        ("3-UPU, x and y", example("3-upu"), upu, over(x=(-400, 400, 6), y=(-400, 400, 6), z=400)),
        ("3-UPU, x, y and z", example("3-upu"), upu, over(x=(-400, 400, 3), y=(-350, 350, 3), z=(250, 550, 2))),
        ("delta, x, y and z", example("delta"), delta, over(x=(-300, 300, 3), y=(-300, 300, 3), z=(-650, -150, 4))),
        (
            "Stewart-Gough, x, y and z",
            example("stewart-gough"),
            stewart,
            over(x=(-300, 300, 2), y=(-300, 300, 2), z=(150, 600, 3), **level),
        ),
        (
            "Stewart-Gough, rolled by 40 deg",
            example("stewart-gough"),
            stewart,
            over(x=(-500, 500, 3), z=(20, 500, 3), y=0, **{**level, "rx": 40}),
        ),
    )
    return [Case(*row) for row in table]


@dataclass(frozen=True)
class Compared:
    """What a map says beside the robot by hand."""

    #: `nodes`, `ok`, `other`: all nodes, those that are reached, and those behind a singular pose
    nodes: int
    ok: int
    other: int
    #: nodes that are `ok` and have the other sign, or a pose in which the platform is turned that should not be
    wrong: int
    #: nodes that a fine path reaches, not beside its end, and that are not `ok`
    refused: int
    #: the largest error of the equations by hand at nodes that have a pose: it is the same robot
    open: float


def compare(case: Case, finer: int, **options: Any) -> Compared:
    """A map beside the robot by hand."""
    result = jp.map(case.m, "solve", case.grid, **options)
    status = result.status.values
    planar = case.m.data.space == "planar"
    components = (["x", "y", "angle"] if planar else ["x", "y", "z", "rx", "ry", "rz"])[: len(case.robot.start)]
    units = np.array([180 / np.pi if name in ("angle", "rx", "ry", "rz") else 1.0 for name in components])
    pose: Floats = result.nominal.sel(component=components).values / units
    drives = np.stack([result[name].values for name in case.m.drives], -1)
    turns = [case.m.joint_kinds[k] != "prismatic" for k in case.m.drive_joints]
    drives = np.where(turns, np.radians(drives), drives)
    sign = case.robot.sign(pose, drives)
    there = np.isfinite(pose).all(-1)
    lacks = np.abs(case.robot.constraints(pose, drives))[there].max() / case.robot.size
    ok = status == "ok"
    held = case.robot.start.copy()
    axes = []
    for name, values in case.grid.items():
        k = components.index(name)
        if isinstance(values, dict):
            axes.append((k, result[name].values / units[k]))
        else:
            held[k] = values / units[k]
    axes.sort()
    turned = np.zeros_like(ok)
    if len(components) == 6:
        turned = there & (np.linalg.norm(pose[..., 3:] - held[3:], axis=-1) > 1e-6)
    reached, clear = case.robot.reached([values for _, values in axes], held, [k for k, _ in axes], finer)
    order = [str(name) for name in result.status.dims]
    reached, clear = (
        np.transpose(a, [[components[k] for k, _ in axes].index(name) for name in order]) for a in (reached, clear)
    )
    return Compared(
        status.size, int(ok.sum()), int((status == "other_branch").sum()),
        int((ok & ((sign <= 0) | turned)).sum()), int((reached & clear & ~ok).sum()), float(lacks),
    )  # fmt: skip
