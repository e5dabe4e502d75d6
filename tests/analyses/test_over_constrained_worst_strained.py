"""The worst case where deviations have to be strained: trusses against a dense search with another program.

To first order a bar of an elastic truss with play is a spring with a dead band, as long as its loose ends have play:

    energy(u) = sum over the bars of  k / 2 max(0, |n . (u_b - u_a) - g| - loose)^2

and a unit is where its energy is least; of several such places a small load picks the farthest.
"""

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

import jointplay as jp
from helpers.answers import example
from helpers.oracles.truss import Truss, square
from helpers.trusses import random_truss, tower
from jointplay.analyses.nominal import nominal

Array = NDArray[np.float64]
SMALL = 1e-6


def displacement(truss: Truss, off: dict[str, float], load: Array) -> Array:
    """Of the output's node, where a unit with other lengths has the least energy under a small load."""
    b, loose = truss.compatibility(), truss.loose()
    k = np.array([truss.stiffness[name] for name in truss.names])
    g = truss.gaps() + np.array([off.get(name, 0.0) for name in truss.names])
    at = 2 * truss.free.index(truss.loaded)
    force = np.zeros(b.shape[1])
    force[at : at + 2] = load
    u = np.zeros(b.shape[1])
    # Newton's method on a function that is quadratic piece by piece, held where nothing pushes.
    hold = 1e-9 * k.max()
    for _ in range(200):
        stretch = b @ u - g
        tension = k * np.sign(stretch) * np.maximum(0.0, np.abs(stretch) - loose)
        gradient = b.T @ tension - force
        hessian = b.T @ ((k * (np.abs(stretch) > loose))[:, None] * b) + hold * np.eye(len(u))
        step = np.linalg.solve(hessian, -gradient)

        def energy(u: Array) -> float:
            over = np.maximum(0.0, np.abs(b @ u - g) - loose)
            return float(0.5 * k @ over**2 - force @ u)

        part = 1.0
        while energy(u + part * step) > energy(u) + 1e-4 * part * float(gradient @ step) and part > 1e-10:
            part *= 0.5
        u = u + part * step
        if np.abs(part * step).max() < 1e-12:
            break
    return np.asarray(u[at : at + 2])


def strained(truss: Truss, off: dict[str, float]) -> bool:
    lengths = {name: truss.deviation[name] + off.get(name, 0.0) for name in truss.names}
    return Truss(**{**vars(truss), "deviation": lengths}).factor() > 1.0


SCALE = 0.02


@pytest.mark.parametrize(("shape", "seed"), [("square", 0), ("tower", 0), ("square", 1), ("square", 2), ("tower", 1)])
def test_no_unit_of_a_dense_search_is_farther_off_and_some_are_as_far(shape: str, seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    names = square().names if shape == "square" else tower().names
    chosen = rng.choice(names, 3, replace=False).tolist()
    tolerances = {name: float(SCALE * rng.uniform(0.5, 1.5)) for name in chosen}
    truss, m = random_truss(shape, seed, 0.2 * SCALE, tolerances)
    worst = jp.worst(m)
    assert worst.status[0].item() == "strained"
    k = max(truss.stiffness.values())
    ways = [
        SMALL * SCALE * k * np.array([math.cos(a), math.sin(a)]) for a in np.linspace(0, math.tau, 8, endpoint=False)
    ]

    def farthest(lengths: Array) -> float:
        off = dict(zip(chosen, lengths.tolist(), strict=True))
        return max(float(np.hypot(*displacement(truss, off, way))) for way in ways)

    grid = [np.linspace(-tolerances[name], tolerances[name], 5) for name in chosen]
    units = [np.array(u) for u in itertools.product(*grid)]
    units = [u for u in units if strained(truss, dict(zip(chosen, u.tolist(), strict=True)))]
    sizes = [farthest(u) for u in units]
    best = units[int(np.argmax(sizes))]
    bounds = [(-tolerances[name], tolerances[name]) for name in chosen]
    refined = minimize(lambda u: -farthest(u), best, bounds=bounds, method="Nelder-Mead", options={"maxfev": 60})
    largest = max(*sizes, -float(refined.fun))
    found = worst.worst_position_first_order[0].item()
    assert largest <= found * (1 + 1e-4)
    together = jp.worst(m.with_({f"bodies.{name}.stiffness": None for name in truss.names}))
    rigid = together.worst_position_first_order[0].item()
    assert found == pytest.approx(max(largest, 0.0 if math.isnan(rigid) else rigid), rel=1e-3)
    assert found <= worst.worst_position_first_order_bound[0].item()
    assert worst.worst_position[0].item() == pytest.approx(found, rel=5e-3)


def test_without_play_the_extremes_are_sums_over_the_tolerances() -> None:
    """Direct stiffness: the displacement is linear in the lengths, so that each tolerance adds its own part."""
    truss, _ = random_truss("tower", 3, 0.0, {})
    truss = Truss(**{**vars(truss), "radial": {}})
    tolerances = {name: 1e-4 * (k + 1) for k, name in enumerate(("AD", "CE", "DE"))}
    m = jp.loads(truss.text(), "truss.toml")
    worst = jp.worst(m.with_({f"dimensions.long_{name}.tolerance": t for name, t in tolerances.items()}))
    assert worst.status[0].item() == "strained"
    at = 2 * truss.free.index(truss.loaded)

    def moved(off: dict[str, float]) -> Array:
        lengths = {name: truss.deviation[name] + off.get(name, 0.0) for name in truss.names}
        return Truss(**{**vars(truss), "deviation": lengths}).direct_stiffness()[0][at : at + 2]

    middle = moved({})
    parts = np.abs([moved({name: t}) - middle for name, t in tolerances.items()]).sum(axis=0)
    found = worst.worst_component_first_order.sel(component=["x", "y"]).values[0]
    np.testing.assert_allclose(found, np.stack([middle - parts, middle + parts], axis=1), rtol=1e-6)
    corners = itertools.product(*[(-t, t) for t in tolerances.values()])
    largest = max(float(np.hypot(*moved(dict(zip(tolerances, c, strict=True))))) for c in corners)
    assert worst.worst_position_first_order[0].item() == pytest.approx(largest, rel=1e-6)
    # What sources and deformations add makes up the figure.
    added = worst.contribution.sum("source") + worst.contribution_elastic.sum("joint")
    assert added.sel(extreme="x high")[0].item() == pytest.approx(found[0, 1], rel=1e-6)
    assert added.sel(extreme="position")[0].item() == pytest.approx(largest, rel=1e-6)


@pytest.mark.parametrize("name", ["x-braced-square", "four-legged-platform"])
def test_certificates_of_strained_extremes_are_admissible_and_give_them(name: str) -> None:
    m = example(name)
    worst = jp.worst(m)
    assert worst.status[0].item() == "strained"
    lengths = [c for c in worst.component.values if c in ("x", "y", "z")]
    for extreme in worst.extreme.values:
        given = jp.given(m, worst.worst_offset.sel(extreme=extreme, drop=True))
        assert given.admissible.values.all()
        if extreme == "position":
            size = float(np.linalg.norm(given.error.sel(component=lengths)))
            assert size == pytest.approx(worst.worst_position[0].item(), rel=1e-9)
        elif " " in extreme:
            component, side = extreme.split()
            wanted = worst.worst_component.sel(component=component, side=side)[0].item()
            assert given.error.sel(component=component)[0].item() == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_every_corner_of_a_platform_in_space_is_within_the_worst() -> None:
    m = example("four-legged-platform")
    worst = jp.worst(m)
    core, at = m.core, nominal(m)
    tolerances = [s for s, kind in enumerate(m.source_kinds) if kind == "dimension"]
    ends = [tuple(m.core_spec["sources"][s]["set"]["interval"][end] for end in ("low", "high")) for s in tolerances]
    assert all(low < high for low, high in ends)
    units = np.repeat(m.centre[None], 2 ** len(ends), 0)
    for unit, corner in zip(units, itertools.product(*ends), strict=True):
        for s, off in zip(tolerances, corner, strict=True):
            unit[m.parameter_source == s] += off
    still = jp.loads(jp.examples.text("four-legged-platform").split("[[loads]]")[0]).core
    found = still.loaded_specimens(at.drives, at.poses, units)
    apart = found["clearance_factor"] > 1.0
    assert apart.any()
    rows = np.flatnonzero(apart)
    errors = core.given(at.drives.repeat(len(rows), 0), at.poses.repeat(len(rows), 0), found["offset"][rows])["error"]
    low, high = core.worst(at.drives, at.poses, 24)["component"][0].T
    slack = 1e-9 + 1e-6 * np.abs(high - low)
    assert (low - slack <= errors).all()
    assert (errors <= high + slack).all()
    assert np.linalg.norm(errors[:, :3], axis=1).max() <= 1e-3 * worst.worst_position[0].item() * (1 + 1e-6)


def test_loads_do_not_count() -> None:
    truss, m = random_truss("square", 1, 0.2 * SCALE, {"AC": SCALE})
    heavy = jp.loads(Truss(**{**vars(truss), "load": (200.0, -400.0)}).text(), "truss.toml")
    loaded = jp.worst(heavy.with_({"dimensions.long_AC.tolerance": SCALE}))
    np.testing.assert_allclose(loaded.worst_component, jp.worst(m).worst_component, rtol=1e-12)


def test_a_bar_that_never_fits_has_a_worst_case_all_the_same() -> None:
    """Every unit is squeezed; pinned at both ends, the bar goes where both pins are at the far sides of their play."""
    m = example("redundant-bar").with_({"dimensions.length.deviation": 0.6})
    worst = jp.worst(m)
    assert worst.status[0].item() == "strained"
    x = worst.worst_component.sel(component="x").values[0]
    # 0.3 to 0.9 too long between pins with 0.1 each: Q is pushed to the far side of its hole, always.
    np.testing.assert_allclose(x, [0.1, 0.1], rtol=1e-6)
    assert abs(worst.worst_component.sel(component="y").values).max() < 1e-5
    rigid = m.with_({"bodies.bar.stiffness": None})
    assert jp.worst(rigid).status[0].item() == "not_assemblable"


def test_a_specimen_that_first_order_takes_for_near_is_found() -> None:
    """A plate on four bars: at one corner of the tolerances it goes twice as far as to first order."""
    bars = {
        "k0": ([29, -59], [33, 18], 17600, 0.22, (1.36, 0.41)),
        "k1": ([17, 77], [20, 18], 8000, 0.0, (1.19, 0.21)),
        "k2": ([-5, -97], [-25, -32], 39300, 0.46, None),
        "k3": ([-83, -45], [-8, 16], 1100, 0.42, (0.55, 0.14)),
    }
    text = """
        format = 1
        units = { length = "mm", angle = "deg", force = "N" }
        output = { body = "plate", at = [-15, 63] }
    """
    corner: dict[str, object] = {}
    for name, (foot, head, stiffness, radial, ends) in bars.items():
        play = f", clearance = {{ radial = {radial} }}" if radial else ""
        text += f"""
        bodies.{name}.stiffness = {stiffness}
        joints.A{name} = {{ type = "revolute", bodies = ["ground", "{name}"], at = {foot}{play} }}
        joints.B{name} = {{ type = "revolute", bodies = ["{name}", "plate"], at = {head} }}
        """
        if ends is not None:
            between = f'body = "{name}", between = ["A{name}", "B{name}"]'
            text += f"dimensions.l{name} = {{ {between}, tolerance = {{ plus = {ends[0]}, minus = {ends[1]} }} }}\n"
            corner |= {f"dimensions.l{name}.tolerance": None, f"dimensions.l{name}.deviation": ends[0]}
    m = jp.loads(text)
    there = jp.worst(m.with_(corner))
    assert there.worst_position.item() > 1.5 * there.worst_position_first_order.item()
    assert jp.worst(m).worst_position.item() >= there.worst_position.item() * (1.0 - 1e-9)
