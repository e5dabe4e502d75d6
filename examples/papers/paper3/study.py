"""The questions of the page at single poses, answered by jointplay, and the closed form beside them.

Everything of the general engine goes through the public functions. Errors are in mm and degrees, as in the file.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import jointplay as jp

from .closed_form import Floats, Legs, Upu
from .robot import GUIDES, PINS, POSITION, ROTATION, at, radians, robot, sizes_of

#: in N and N mm, on the middle of the platform
FORCE, MOMENT = (30.0, -20.0, -100.0), (1000.0, 2000.0, -500.0)
WEIGHT = (0.0, 0.0, -100.0)
HOME, ASIDE = (0.0, 0.0, 400.0), (50.0, -30.0, 400.0)
#: parts of the example's clearances
SHRUNK = (1.0, 0.5, 0.25, 0.125)
#: multiples of the example's values
CLEARANCES: Mapping[str, tuple[str, ...]] = {
    "radial": tuple(f"{pin}.radial" for pin in PINS),
    "axial": tuple(f"{pin}.axial" for pin in PINS),
    "gap": tuple(f"{guide}.gap" for guide in GUIDES),
}
LENGTHS: Mapping[str, tuple[str, ...]] = {
    "pin_length": tuple(f"{pin}.length" for pin in PINS),
    "guide_length": tuple(f"{guide}.length" for guide in GUIDES),
    "guide_width": tuple(f"{guide}.width" for guide in GUIDES),
}
FACTORS = {"clearances": np.linspace(0.0, 3.0, 13), "lengths": np.linspace(0.4, 2.5, 15)}
RATIOS, HEIGHTS = np.linspace(0.05, 0.65, 13), np.linspace(150.0, 800.0, 14)
SAMPLES = 200_000
RANDOM_ROBOTS, RANDOM_POSES = 6, 20


@dataclass(frozen=True)
class Pose:
    """One pose under one load. Errors: x, y, z, rx, ry, rz; `closed_form` and first order in mm and degrees."""

    position: Floats
    force: Floats
    moment: Floats
    lengths: Floats
    along: Floats
    couple: Floats
    along_closed: Floats
    couple_closed: Floats
    exact: Floats
    first_order: Floats
    closed_form: Floats
    undetermined: Floats
    status: str


@dataclass(frozen=True)
class Worst:
    """Largest displacement (mm) and rotation (degrees) at one pose; parts of the joints by name."""

    exact: tuple[float, float]
    first_order: tuple[float, float]
    bound: tuple[float, float]
    closed_form: tuple[float, float]
    parts: tuple[dict[str, float], dict[str, float]]


@dataclass(frozen=True)
class Compensation:
    """What the legs are told instead, and what that leaves."""

    nominal: Floats
    correction: Floats
    before: Floats
    residual: Floats
    iterations: int


@dataclass(frozen=True)
class Scatter:
    """Monte Carlo on the exact closure; quantiles and histograms of displacement and rotation."""

    std: Floats
    std_first_order: Floats
    correlation: Floats
    quantiles: dict[float, tuple[float, float]]
    largest: tuple[float, float]
    counts: Floats
    edges: Floats
    failures: int


@dataclass(frozen=True)
class Study:
    """All that the page tells of single poses. `swept` holds displacement and rotation over the multiples of a size."""

    poses: tuple[Pose, Pose]
    gap_of_closed_form: float
    shrinking: Floats
    silent: Floats
    parts: dict[str, Floats]
    worst: tuple[Worst, Worst]
    compensation: Compensation
    swept: dict[str, tuple[Floats, Floats, Floats, Floats]]
    by_ratio: tuple[Floats, Floats, Floats, Floats]
    by_height: tuple[Floats, Floats, Floats, Floats]
    scatter: Scatter


def study() -> Study:
    """Ask everything but the maps. Takes some seconds."""
    m = robot()
    aside = at(m, ASIDE, FORCE, MOMENT)
    return Study(
        poses=(_pose(m, HOME, WEIGHT, (0, 0, 0)), _pose(m, ASIDE, FORCE, MOMENT)),
        gap_of_closed_form=_gap_of_closed_form(),
        shrinking=_shrinking(aside),
        silent=_silent(aside),
        parts=_parts(aside),
        worst=_worst(at(m, [HOME, ASIDE], FORCE, MOMENT)),
        compensation=_compensation(aside),
        swept={
            name: _swept(aside, keys, getattr(Upu(), name), FACTORS[group])
            for group, sizes in (("clearances", CLEARANCES), ("lengths", LENGTHS))
            for name, keys in sizes.items()
        },
        by_ratio=_series([at(robot(platform_radius=300 * ratio), ASIDE, FORCE, MOMENT) for ratio in RATIOS]),
        by_height=_series([at(robot(height=z), [*ASIDE[:2], z], FORCE, MOMENT) for z in HEIGHTS]),
        scatter=_scatter(aside),
    )


def transmitted(result: Any, position: Any) -> tuple[Floats, Floats]:
    """Force along and couple of the legs on the platform, from the reactions in its pins."""
    legs = Legs(Upu(), np.asarray(position, dtype=float))
    reaction = result.reaction.isel(configuration=0).sel(joint=[f"top{k}.second" for k in (1, 2, 3)])
    force = reaction.sel(wrench=["fx", "fy", "fz"]).values
    moment = reaction.sel(wrench=["mx", "my", "mz"]).values
    return (force * legs.s).sum(axis=-1), (moment * legs.n).sum(axis=-1)


def _pose(m: jp.Mechanism, position: Any, force: Any, moment: Any) -> Pose:
    result = jp.loaded(at(m, position, force, moment))
    along, couple = transmitted(result, position)
    closed = Upu().error(position, force, moment)
    along_closed, couple_closed = Legs(Upu(), np.array(position)).transmitted(force, moment)
    return Pose(
        position=np.array(position),
        force=np.array(force),
        moment=np.array(moment),
        lengths=np.array([result[drive].item() for drive in m.drives]),
        along=along,
        couple=couple,
        along_closed=along_closed,
        couple_closed=couple_closed,
        exact=result.error.values[0],
        first_order=result.error_first_order.values[0],
        closed_form=np.concatenate([closed[:3], np.degrees(closed[3:])]),
        undetermined=result.undetermined.values[0],
        status=result.status.item(),
    )


def _gap_of_closed_form() -> float:
    """Largest difference of the closed form from the general engine, relative, over random robots, poses and loads."""
    rng = np.random.default_rng(3)
    gaps = []
    for _ in range(RANDOM_ROBOTS):
        usual = Upu()
        sizes = {name: value * rng.uniform(0.6, 1.4) for name, value in vars(usual).items()}
        # Play small enough for the exact closure, which `loaded` solves as well, to stay on its branch.
        sizes |= {name: 0.1 * sizes[name] for name in ("radial", "axial", "gap")}
        sizes["platform_radius"] = sizes["base_radius"] * rng.uniform(0.3, 0.6)
        mine = Upu(**sizes)
        turn, out = rng.uniform(0, 2 * np.pi, RANDOM_POSES), rng.uniform(0.1, 1.2, RANDOM_POSES) * mine.difference
        positions = np.column_stack([out * np.cos(turn), out * np.sin(turn), rng.uniform(300, 500, RANDOM_POSES)])
        force, moment = rng.uniform(-100, 100, 3), rng.uniform(-3000, 3000, 3)
        first_order = radians(jp.loaded(at(robot(**sizes), positions, force, moment)).error_first_order.values)
        closed = mine.error(positions, force, moment)
        for part in (slice(0, 3), slice(3, 6)):
            difference = np.linalg.norm((first_order - closed)[:, part], axis=-1)
            gaps.append(np.max(difference / np.linalg.norm(closed[:, part], axis=-1)))
    return float(np.max(gaps))


def _shrinking(m: jp.Mechanism) -> Floats:
    """Largest play turn (degrees) and relative distance of first order from the exact closure as clearances shrink."""
    rows = []
    for part in SHRUNK:
        keys = {key: part * getattr(Upu(), name) for name, several in CLEARANCES.items() for key in several}
        result = jp.loaded(m.with_(keys))
        exact, first = radians(result.error.values[0]), radians(result.error_first_order.values[0])
        distances = (np.linalg.norm((exact - first)[p]) / np.linalg.norm(exact[p]) for p in (slice(0, 3), slice(3, 6)))
        rows.append([np.degrees(np.linalg.norm(exact[3:])), *distances])
    return np.array(rows)


def _silent(m: jp.Mechanism) -> Floats:
    """Error, and the same to first order (mm), of all axial play of the pins on the legs together."""
    on_legs = [f"{pin}.along" for k in (1, 2, 3) for pin in (f"base{k}.second", f"top{k}.first")]
    result = jp.given(m, dict.fromkeys(on_legs, Upu().axial))
    errors = (result.error, result.error_first_order)
    return np.array([np.linalg.norm(error.sel(component=POSITION).values) for error in errors])


def _parts(m: jp.Mechanism) -> dict[str, Floats]:
    """What every joint adds to the size of the displacement and of the rotation, to first order."""
    result = jp.loaded(m).isel(configuration=0)
    parts = []
    for components in (POSITION, ROTATION):
        error = result.error_first_order.sel(component=components)
        parts.append((result.contribution.sel(component=components) * error).sum("component") / np.linalg.norm(error))
    return {str(name): np.array([p.sel(source=name).item() for p in parts]) for name in result.source.values}


def _worst(m: jp.Mechanism) -> tuple[Worst, Worst]:
    every = jp.worst(m)

    def one(i: int, position: Any) -> Worst:
        result = every.isel(configuration=i)
        displacement, rotation = Upu().largest(position)

        def both(suffix: str) -> tuple[float, float]:
            return result[f"worst_position{suffix}"].item(), result[f"worst_rotation{suffix}"].item()

        def parts(extreme: str) -> dict[str, float]:
            part = result.contribution.sel(extreme=extreme)
            return {str(name): part.sel(source=name).item() for name in part.source.values}

        return Worst(
            exact=both(""),
            first_order=both("_first_order"),
            bound=both("_first_order_bound"),
            closed_form=(displacement, float(np.degrees(rotation))),
            parts=(parts("position"), parts("rotation")),
        )

    return one(0, HOME), one(1, ASIDE)


def _compensation(m: jp.Mechanism) -> Compensation:
    result = jp.compensate(m).isel(configuration=0)
    return Compensation(
        nominal=result.drive_nominal.values,
        correction=result.correction.values,
        before=result.error.values,
        residual=result.residual.values,
        iterations=result.iterations.item(),
    )


def _series(robots: list[jp.Mechanism]) -> tuple[Floats, Floats, Floats, Floats]:
    results = [jp.loaded(m) for m in robots]
    exact, first = (np.concatenate([r[name].values for r in results]) for name in ("error", "error_first_order"))
    return *sizes_of(exact), *sizes_of(first)


def _swept(
    m: jp.Mechanism, keys: tuple[str, ...], usual: float, factors: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    result = jp.sweep(m, keys, usual * factors, "loaded", name="size").isel(configuration=0)
    components = result.transpose("size", ...)
    return *sizes_of(components.error.values), *sizes_of(components.error_first_order.values)


def _scatter(m: jp.Mechanism) -> Scatter:
    result = jp.random(m, samples=SAMPLES, seed=1).isel(configuration=0)
    pair = ["position", "rotation"]
    std = result.error_std.values
    quantile = result.error_quantile.sel(quantity=pair)
    largest = result.largest.sel(quantity=pair).values
    failed = SAMPLES - result.failures.sel(outcome="ok").item()
    return Scatter(
        std=std,
        std_first_order=result.error_std_first_order.values,
        correlation=result.error_covariance.values / np.outer(std, std),
        quantiles={float(p): tuple(quantile.sel(probability=p).values) for p in quantile.probability.values},
        largest=(float(largest[0]), float(largest[1])),
        counts=result.histogram.sel(quantity=pair).values,
        edges=result.edge.sel(quantity=pair).values,
        failures=int(failed),
    )
