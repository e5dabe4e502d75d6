"""Planar platforms on more legs and sliders than hold them, and the same as cone programs."""

import numpy as np

import jointplay as jp
from helpers.oracles.primal import Primal
from helpers.oracles.reading import read

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
