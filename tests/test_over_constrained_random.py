"""Random over-constrained planar mechanisms against a cone program on the displacements of all bodies."""

from __future__ import annotations

import math

import numpy as np
import pytest

import jointplay as jp
from oracles.primal import Primal
from oracles.reading import read
from test_over_constrained import RADIAL, random_square

HEAD = 'format = 1\nspace = "planar"\nunits = { length = "mm", angle = "rad", force = "N" }\n'


def platform(seed: int, *, elastic: bool = False, sliders: int = 2, size: float = 1.0) -> tuple[str, dict[str, float]]:
    """A platform on six legs, or on sliders in place of some; three would hold it.

    Returns the text and the stiffness of the legs by the label of their dimension. An elastic leg has a dimension for
    its deviation, which the program below lets give way.
    """
    rng = np.random.default_rng(seed)
    lines, start, stiffness = [HEAD], ["[start]"], {}
    for k in range(6):
        px, py = (float(v) for v in 80 * rng.uniform(-1, 1, 2))
        on_plate = f"plate = [{px!r}, {py!r}]"
        if k < sliders:
            tilt, gap = float(rng.uniform(-3, 3)), float(size * rng.uniform(0.01, 0.04))
            lines.append(
                f'[joints.S{k}]\ntype = "prismatic"\non = {{ ground = {{ at = [{px!r}, {py!r}], axis = {tilt!r} }}, '
                f"shoe{k} = {{ at = [0, 0], axis = 0 }} }}\nclearance = {{ gap = {gap!r}, length = 40 }}"
            )
            start.append(f"shoe{k} = {{ x = {px!r}, y = {py!r}, angle = {tilt!r} }}")
            ends = [(f"P{k}", f"shoe{k} = [0, 0]", on_plate)]
        else:
            x, y = (float(v) for v in np.array([px, py - 150.0]) + 60 * rng.uniform(-1, 1, 2))
            length, angle = float(np.hypot(px - x, py - y)), float(np.arctan2(py - y, px - x))
            start.append(f"leg{k} = {{ x = {x!r}, y = {y!r}, angle = {angle!r} }}")
            ends = [(f"F{k}", f"ground = [{x!r}, {y!r}]", f"leg{k} = [0, 0]")]
            ends.append((f"P{k}", f"leg{k} = [{length!r}, 0]", on_plate))
            lines.append(f'[dimensions.l{k}]\nbody = "leg{k}"\nbetween = ["F{k}", "P{k}"]')
            lines.append(f"deviation = {float(0.06 * size * rng.normal())!r}")
            if elastic:
                stiffness[f"l{k}.length"] = float(rng.uniform(200, 2000))
        for name, first, second in ends:
            lines.append(f'[joints.{name}]\ntype = "revolute"\non = {{ {first}, {second} }}')
            lines.append(f"clearance = {{ radial = {float(size * rng.uniform(0.01, 0.05))!r} }}")
    fx, fy, moment = 100 * rng.normal(size=3)
    lines += [*start, "plate = { x = 0.0, y = 0.0, angle = 0.0 }"]
    lines.append('[output]\nbody = "plate"\nat = [10, 20]')
    lines.append(f"[[loads]]\nforce = [{float(fx)!r}, {float(fy)!r}]\nmoment = {float(30 * moment)!r}")
    return "\n".join(lines) + "\n", stiffness


def mechanism(text: str, stiffness: dict[str, float]) -> jp.Mechanism:
    bodies = "".join(f"[bodies.leg{name[1]}]\nstiffness = {k!r}\n" for name, k in stiffness.items())
    return jp.loads(text + bodies, "platform.toml")


def primal(text: str, stiffness: dict[str, float], size: float = 1.0) -> Primal:
    link = read(text)
    q = link.start
    assert np.abs(link.rows(q, [], dict.fromkeys(link.labels, 0.0))).max() < 1e-9
    return Primal(link, q, [], stiffness, 0.01 * size)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("sliders", [0, 2, 4])
def test_a_rigid_platform_goes_where_the_load_does_most_work(seed: int, sliders: int) -> None:
    text, _ = platform(seed, sliders=sliders)
    found = jp.loaded(mechanism(text, {}), exact=False)
    program = primal(text, {})
    best = program.solve()
    together = found.status[0].item() != "not_assemblable"
    assert together == best.solved
    if not together:
        assert found.clearance_factor[0].item() > 1.0
        return
    assert found.clearance_factor[0].item() < 1.0
    (load,) = mechanism(text, {}).raw["loads"]
    weights = np.array([*load["force"], load["moment"]])
    # The load acts at the output; its own work is what the pose maximises.
    assert found.error.values[0] @ weights == pytest.approx(-best.value, rel=1e-8, abs=1e-9)
    open_ = found.undetermined.values[0]
    size = np.array([0.05, 0.05, 5e-4])
    assert (np.abs(found.error.values[0] - best.error) <= open_ + 1e-5 * size).all()


@pytest.mark.parametrize("seed", range(6))
def test_an_elastic_platform_has_the_least_energy(seed: int) -> None:
    text, stiffness = platform(seed, elastic=True, sliders=0)
    found = jp.loaded(mechanism(text, stiffness), exact=False)
    best = primal(text, stiffness).solve()
    assert best.solved
    want = np.array([best.elongation[f"l{k}.length"] for k in range(6)])
    np.testing.assert_allclose(found.member_elongation.values[0], want, atol=1e-6 * np.abs(want).max())
    np.testing.assert_allclose(
        found.member_force.values[0], want * np.array(list(stiffness.values())), atol=1e-6 * 2000 * np.abs(want).max()
    )
    open_ = found.undetermined.values[0]
    size = np.abs(best.error).max() * np.array([1.0, 1.0, 0.01])
    assert (np.abs(found.error.values[0] - best.error) <= open_ + 1e-5 * size).all()


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_what_the_load_leaves_open_is_what_poses_of_most_work_reach(seed: int) -> None:
    """A bar of a rigid truss that carries nothing turns in its pins; the output sits on one like that or moves on."""
    base = random_square(seed)
    radial = {node: 1.5 * base.factor() * r for node, r in RADIAL.items()}
    truss = random_square(seed, radial=radial)
    for name, bar in zip(truss.names, truss.bars, strict=True):
        node = next(end for end in bar if end in truss.free)
        text = truss.text().replace(f'body = "{truss.carrier("C")}"\nat = "C"', f'body = "{name}"\nat = "{node}"')
        # The load stays where it was.
        text = text.replace("\nforce =", f'\nbody = "{truss.carrier("C")}"\nat = "C"\nforce =')
        found = jp.loaded(jp.loads(text, "truss.toml"), exact=False)
        program = primal(text, {}, 0.1)
        work = -program.solve().value
        for k in range(3):
            low, high = program.extremes(k, work - 1e-9 * abs(work))
            unit = math.degrees(1.0) if k == 2 else 1.0
            reach = found.undetermined.values[0, k] / unit
            middle = found.error.values[0, k] / unit
            # The poses of nearly that work reach a little farther, on discs by the root of what they lack.
            scale = 0.1 if k < 2 else 1e-3
            assert reach == pytest.approx(max(high - middle, middle - low), rel=1e-3, abs=1e-3 * scale)
            assert low - 1e-3 * scale <= middle <= high + 1e-3 * scale
