"""Random assemblies in the plane: nodes on two bars each, some bars more than needed, tolerances everywhere.

Deviations of the ground move the pins that are on it, so that centres on the base are off, too. Bars may be elastic, a
node may be loaded, and the base may be a bar.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: of so many places for a node one is taken
PLACES = 5


def assembly(seed: int) -> str:
    """The file of a random assembly."""
    rng = np.random.default_rng(seed)
    play = 10 ** rng.uniform(-2.5, -0.3)
    tolerance = play * 10 ** rng.uniform(-1.0, 0.7)
    grounded, free, surplus = int(rng.integers(2, 4)), int(rng.integers(1, 3)), int(rng.integers(1, 3))
    nodes = {f"G{k}": np.array([100.0 * k, 0.0]) + rng.uniform(-15, 15, 2) for k in range(grounded)}
    bars: list[tuple[str, str]] = []
    steps: list[list[str]] = []
    for k in range(free):
        a, b = (str(name) for name in rng.choice([*nodes][-3:], 2, replace=False))
        nodes[f"N{k}"] = place_of_node(rng, k, 100.0 * (grounded - 1), nodes[a], nodes[b])
        bars += [(a, f"N{k}"), (b, f"N{k}")]
        steps.append([f"{a}N{k}", f"{b}N{k}"])
    names = [*nodes]
    others = [(a, b) for i, a in enumerate(names) for b in names[i + 1 :] if {(a, b), (b, a)}.isdisjoint(bars)]
    rng.shuffle(others)
    if rng.random() < 0.4:
        # A bar between two places of the ground.
        others.sort(key=lambda bar: bar != ("G0", "G1"))
    more = others[:surplus]
    bars += more
    steps += [[a + b] for a, b in more]

    lines = ["format = 1", 'units = { length = "mm", angle = "deg", force = "N" }']
    for node, at in nodes.items():
        bodies = [*(["ground"] if node.startswith("G") else []), *(a + b for a, b in bars if node in (a, b))]
        if len(bodies) > 1:
            lines += [f"[joints.{node}]", 'type = "revolute"', f"bodies = {listed(bodies)}", f"at = {at.tolist()}"]
            lines += [f"clearance = {{ radial = {play * rng.uniform(0.3, 1.0)} }}"] if rng.random() < 0.9 else []
    used = {node for bar in bars for node in bar}
    lengths = [(a + b, a + b, a, b) for a, b in bars if rng.random() < 0.6]
    lengths += [(f"g{k}", "ground", "G0", f"G{k}") for k in range(1, grounded) if {"G0", f"G{k}"} <= used]
    for name, body, start, end in lengths:
        lines += [f"[dimensions.{name}]", f'body = "{body}"', f'between = ["{start}", "{end}"]']
        lines += [f"tolerance = {tolerance * rng.uniform(0.3, 1.0)}"]
    carriers = [bar for bar in bars if bar[1].startswith("N")]
    a, b = carriers[int(rng.integers(len(carriers)))]
    lines += ["[output]", f'body = "{a}{b}"', f'at = "{b}"']
    if rng.random() < 0.5:
        for a, b in more:
            lines += [f"[bodies.{a}{b}]", f"stiffness = {10 ** rng.uniform(2.0, 4.5)}"]
    if rng.random() < 0.5:
        lines += ["[[loads]]", f"force = {rng.uniform(-20, 20, 2).tolist()}"]
    base = "ground"
    if rng.random() < 0.3:
        base, steps[0][0] = steps[0][0], "ground"
    lines += ["[assembly]", f'base = "{base}"', f"steps = [{', '.join(map(listed, steps))}]"]
    return "\n".join(lines) + "\n"


def place_of_node(rng: np.random.Generator, number: int, width: float, a: Floats, b: Floats) -> Floats:
    """Of some places above the others the one whose two bars are nearest to a right angle."""
    places = np.stack([rng.uniform(0, width, PLACES), 80.0 * (number + 1) + rng.uniform(-20, 20, PLACES)], axis=-1)
    u, v = places - a, places - b
    sines = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / np.linalg.norm(u, axis=1) / np.linalg.norm(v, axis=1)
    return np.asarray(places[sines.argmax()])


def listed(names: list[str]) -> str:
    """Names as a list of TOML."""
    return "[" + ", ".join(f'"{name}"' for name in names) + "]"
