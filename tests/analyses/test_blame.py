"""Parts of the sources in first-order figures of over-constrained and elastic mechanisms.

A first-order figure is homogeneous of degree one in all sizes, deviations and compliances, so that it is the sum of
each times its derivative (Euler). The derivatives are taken here by differences of the figure itself.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import jointplay as jp
from helpers.answers import example
from helpers.builders import planar
from helpers.oracles.loops import LOCKED
from helpers.oracles.truss import Truss
from helpers.platforms import mechanism, platform
from helpers.stacks import stack
from helpers.trusses import random_truss
from jointplay import _core
from jointplay.analyses.nominal import nominal
from jointplay.cli import run
from jointplay.result import blame, from_dataset

Array = NDArray[np.float64]
Spec = dict[str, Any]
#: what of a set is a size that clearance makes larger
SIZES = {"radius", "gap", "axial", "low", "high"}


class Case:
    """A mechanism as the core reads it, in its only configuration."""

    def __init__(self, spec: Spec, drives: Array | None = None, poses: Array | None = None) -> None:
        self.spec = spec
        self.drives = np.zeros((1, 0)) if drives is None else drives[:1]
        self.poses = self.core(spec).trace(self.drives)["poses"] if poses is None else poses[:1]

    @classmethod
    def of(cls, m: jp.Mechanism) -> Case:
        at = nominal(m)
        return cls(m.spec(), at.drives, at.poses)

    @staticmethod
    def core(spec: Spec) -> _core.Mechanism:
        return _core.Mechanism(json.dumps(spec))

    def loaded(self, spec: Spec) -> tuple[Array, Array, Array]:
        """The error, and the parts of sources and of joints, each (figure, cause)."""
        found = self.core(spec).loaded(self.drives, self.poses, False)
        parts = (found[name][0].T for name in ("contribution", "contribution_elastic"))
        return found["error_first_order"][0], *parts

    def worst(self, spec: Spec) -> tuple[Array, Array, Array]:
        """The same of all extremes."""
        found = self.core(spec).worst(self.drives, self.poses, 1)
        sizes = [found["position_first_order"], found["rotation_first_order"]]
        figures = np.concatenate([*sizes, found["component_first_order"].ravel()])
        return figures, found["contribution"][0], found["contribution_elastic"][0]

    def causes(self) -> list[tuple[str, int]]:
        """Sources, and joints that give way."""
        elastic = [k for k, joint in enumerate(self.spec["joints"]) if "compliance" in joint]
        return [("source", k) for k in range(len(self.spec["sources"]))] + [("joint", k) for k in elastic]

    def grown(self, cause: tuple[str, int], factor: float) -> Spec:
        """With a clearance and its deviation, or a compliance, larger."""
        spec, (kind, k) = copy.deepcopy(self.spec), cause
        if kind == "joint":
            spec["joints"][k]["compliance"] = [factor * f for f in spec["joints"][k]["compliance"]]
            return spec
        source = spec["sources"][k]
        source["centre"] = [factor * c for c in source["centre"]]
        for size in source["set"].values():
            size.update({name: factor * v for name, v in size.items() if name in SIZES})
        return spec

    def check(self, ask: Callable[[Spec], tuple[Array, Array, Array]], units: Array, within: float) -> int:
        """Parts are what figures gain by growth, and add up; gives the number of causes without any effect."""
        figures, sources, joints = ask(self.spec)
        np.testing.assert_allclose((sources.sum(axis=1) + joints.sum(axis=1)) / units, figures / units, atol=1e-9)
        without = 0
        for cause in self.causes():
            part = (sources if cause[0] == "source" else joints)[:, cause[1]]
            misses = []
            # Figures bend over a long step, and a short one shows the rounding of their programs.
            for step in (1e-3, 3e-4, 1e-4):
                more, less = (ask(self.grown(cause, 1 + sign * step))[0] for sign in (1, -1))
                gain = (more - less) / (2 * step)
                misses.append(np.abs((part - gain) / units).max())
                if misses[-1] < within:
                    break
            assert min(misses) < within, (cause, misses)
            if (np.abs(gain) < 1e-9 * units).all():
                without += 1
                assert (np.abs(part) < 1e-8 * units).all(), cause
        return without


def sizes(error: Array) -> Array:
    """The size of the position for every translation, that of the turn for every rotation."""
    n = 2 if len(error) == 3 else 3
    return np.repeat([np.abs(error[:n]).max(), np.abs(error[n:]).max()], [n, len(error) - n])


def elastic_stack(seed: int) -> Spec:
    """Bodies held by more joints than they need, all of them elastic."""
    spec, rng = stack(seed), np.random.default_rng([9, seed])
    for joint in spec["joints"]:
        n = len(LOCKED[joint["kind"]])
        turns = [name.startswith(("tilt", "roll")) for name in LOCKED[joint["kind"]]]
        unit = np.where(turns, 3e-3, 3e-4)
        root = unit[:, None] * rng.normal(size=(n, n))
        joint["compliance"] = (root @ root.T).ravel().tolist()
    return spec


@pytest.mark.parametrize("elastic", [False, True], ids=["rigid", "elastic"])
@pytest.mark.parametrize("sliders", [0, 2, 4])
@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_parts_of_a_loaded_platform_are_what_its_error_gains_by_growth(seed: int, sliders: int, elastic: bool) -> None:
    text, stiffness = platform(seed, elastic=elastic, sliders=sliders)
    case = Case.of(mechanism(text, stiffness))
    error = case.loaded(case.spec)[0]
    if np.isnan(error).all():
        return
    without = case.check(case.loaded, sizes(error), 1e-5)
    # A rigid platform rests on three of its legs: whatever the others measure is no matter.
    assert elastic or without >= 6


@pytest.mark.parametrize(("made", "seed"), [*product([stack], range(6)), *product([elastic_stack], range(4))])
def test_parts_of_loaded_bodies_in_space(made: Callable[[int], Spec], seed: int) -> None:
    case = Case(made(seed))
    case.check(case.loaded, sizes(case.loaded(case.spec)[0]), 1e-3)


@pytest.mark.parametrize("sliders", [0, 3])
@pytest.mark.parametrize("seed", [0, 1, 3])
def test_parts_of_the_worst_of_a_platform(seed: int, sliders: int) -> None:
    case = Case.of(mechanism(platform(seed, sliders=sliders)[0], {}))
    case.check(case.worst, np.abs(case.worst(case.spec)[0]), 1e-5)


def test_parts_of_the_worst_of_bodies_in_space() -> None:
    case = Case(stack(0))
    case.check(case.worst, np.abs(case.worst(case.spec)[0]), 1e-4)


@pytest.mark.parametrize("seed", range(2))
def test_parts_of_the_worst_of_strained_units(seed: int) -> None:
    """Members have parts, too, which add up to nothing: no load bends them."""
    tolerances = {name: 0.02 * (1 + 0.1 * k) for k, name in enumerate(("AD", "BC", "BD"))}
    case = Case.of(random_truss("square", seed, 0.004, tolerances)[1])
    figures, _, joints = case.worst(case.spec)
    case.check(case.worst, np.abs(figures), 1e-4)
    np.testing.assert_allclose(joints.sum(axis=1) / figures, 0.0, atol=1e-6)


def shuffled(spec: Spec, seed: int) -> tuple[Spec, list[int]]:
    """The same mechanism with bodies and joints in another order, and where the joints have gone."""
    rng = np.random.default_rng(seed)
    bodies = [int(k) for k in rng.permutation(spec["n_bodies"])]
    joints = [int(k) for k in rng.permutation(len(spec["joints"]))]
    spec = copy.deepcopy(spec)
    for point in spec["points"]:
        point["body"] = -1 if point["body"] < 0 else bodies.index(point["body"])
    spec["guess"] = [spec["guess"][k] for k in bodies]
    spec["joints"] = [spec["joints"][k] for k in joints]
    for entry in [*spec["sources"], *spec["drives"]]:
        if "joint" in entry:
            entry["joint"] = joints.index(entry["joint"])
    return spec, joints


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["rigid", "elastic", "space", "elastic space"])
def test_the_order_of_bodies_and_joints_in_the_file_is_no_matter(kind: str, seed: int) -> None:
    if "space" in kind:
        case = Case(elastic_stack(seed) if "elastic" in kind else stack(seed))
    else:
        case = Case.of(mechanism(*platform(3, elastic=kind == "elastic")))
    spec, joints = shuffled(case.spec, seed)
    other = Case(spec)
    for question in ("loaded", "worst") if kind in ("rigid", "space") and seed == 0 else ("loaded",):
        figures, sources, elastic = getattr(case, question)(case.spec)
        again, sources_again, elastic_again = getattr(other, question)(spec)
        units = sizes(figures) if question == "loaded" else np.abs(figures)
        np.testing.assert_allclose(again / units, figures / units, atol=1e-6)
        np.testing.assert_allclose(sources_again / units[:, None], sources / units[:, None], atol=1e-5)
        np.testing.assert_allclose(elastic_again / units[:, None], elastic[:, joints] / units[:, None], atol=1e-5)


def test_what_play_takes_up_is_not_to_blame() -> None:
    """The support of an antenna: its output does not feel the length of the member BD, which got more than half."""
    parts = jp.loaded(example("antenna-support")).contribution.sel(component="y")[0]
    wanted = {"A": -0.4903, "F": -0.4903, "A.lock": 0.3683, "F.lock": -0.1833}
    for source in parts.source.values:
        assert parts.sel(source=source).item() == pytest.approx(wanted.get(source, 0.0), abs=5e-5), source


def test_the_pin_that_stops_a_redundant_bar_is_to_blame() -> None:
    worst = from_dataset(jp.worst(example("redundant-bar")))
    names, share = blame(worst).largest("position", 0) or ([], 0.0)
    assert names == ["Q"]
    assert share == pytest.approx(1.0, abs=1e-6)


def test_the_joints_of_a_bennett_linkage() -> None:
    parts = jp.worst(example("bennett")).contribution.sel(extreme="position")[0]
    np.testing.assert_allclose(parts / parts.sum(), [0.63, 0.16, 0.07, 0.13], atol=0.006)


@pytest.mark.parametrize("ratio", [1.0, 1e-3, 1e-6])
def test_a_soft_bar_beside_a_stiff_one_is_hardly_to_blame(ratio: float) -> None:
    """Two bars in line with a node between them, which is where the stiff one wants it."""
    k = {"AB": 5000.0, "BC": 5000.0 * ratio, "DB": 3000.0}
    nodes = {"A": (0.0, 0.0), "B": (100.0, 0.0), "C": (200.0, 0.0), "D": (100.0, -100.0)}
    bars = (("A", "B"), ("B", "C"), ("D", "B"))
    deviation = {"AB": 0.02, "BC": 0.03}
    truss = Truss(nodes, ("A", "C", "D"), bars, {}, deviation, k, (0.0, 0.0), "B")
    found = jp.loaded(jp.loads(truss.text(), "bars.toml"), exact=False)
    parts = found.contribution.sel(component="x")[0]
    share = ratio / (1 + ratio)
    assert found.error_first_order.sel(component="x")[0].item() == pytest.approx(0.02 * (1 - share) - 0.03 * share)
    assert parts.sel(source="long_AB").item() == pytest.approx(0.02 * (1 - share), rel=1e-9)
    assert parts.sel(source="long_BC").item() == pytest.approx(-0.03 * share, rel=1e-6)


def test_the_load_on_an_elastic_member_is_a_cause_of_its_own(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    """A rod that hangs on a pin and stretches: half of its error is the pin's, half the load's."""
    b = planar()
    b.fixed("top", ground={"at": [0, 0], "axis": [1, 0]}, hook=(0, 0))
    b.revolute("pin", hook=(0, 0), rod=(0, 0), clearance=jp.radial(0.1))
    b.prismatic("guide", ground={"at": [0, -100], "axis": [0, 1]}, rod={"at": [0, -100], "axis": [0, 1]})
    b.body("rod", stiffness=100)
    b.output(body="rod", at=(0, -100))
    b.load(force=(0, -10))
    b.start("rod", x=0, y=0, angle=0)
    file = tmp_path / "rod.toml"
    file.write_text(b.text())
    result = jp.loaded(jp.load(file))
    assert result.contribution.sel(source="pin", component="y")[0].item() == pytest.approx(-0.1)
    assert result.contribution_elastic.sel(component="y").sum("joint")[0].item() == pytest.approx(-0.1)
    found = blame(from_dataset(result))
    np.testing.assert_allclose(found.position[0], [0.5, 0.5], rtol=1e-9)
    assert run(["error", str(file), "-q", "loaded"]) == 0
    assert "pin, load 50 % each" in capsys.readouterr().out


def test_given_offsets_of_an_elastic_mechanism_share_its_error() -> None:
    m = mechanism(*platform(0, elastic=True))
    rng = np.random.default_rng(5)
    spec = m.spec()
    offsets = {name: 1e-3 * rng.normal() for name in m.parameters}
    found = jp.given(m, offsets)
    np.testing.assert_allclose(found.contribution.sum("source"), found.error_first_order, atol=1e-12)
    assert len(spec["sources"]) == found.sizes["source"]
    for name in list(m.parameters)[:6]:
        step = 1e-4
        more, less = (jp.given(m, {**offsets, name: offsets[name] + sign * step}) for sign in (1, -1))
        slope = (more.error_first_order - less.error_first_order)[0] / (2 * step)
        gain = (more.contribution - less.contribution).sum("source")[0] / (2 * step)
        np.testing.assert_allclose(slope, gain, atol=1e-9)


@pytest.mark.parametrize("contact", ["scattered", "loaded"])
@pytest.mark.parametrize("elastic", [False, True], ids=["rigid", "elastic"])
def test_parts_of_a_scatter_add_up(elastic: bool, contact: str) -> None:
    m = mechanism(*platform(0, elastic=elastic))
    m = m.with_({f"dimensions.{name}.tolerance": 0.02 for name in m.raw["dimensions"]})
    found = jp.random(m, samples=500, contact=contact).isel(configuration=0)
    total = found.contribution.sum("source")
    if elastic:
        total = total + found.contribution_elastic.sum("joint")
    np.testing.assert_allclose(total, found.error_std_first_order**2, rtol=1e-9)


def test_lengths_share_the_scatter_of_elastic_bars_by_stiffness() -> None:
    """The node between two bars is off by the mean of their errors, weighted by stiffness; so are their parts."""
    k = {"AB": 5000.0, "BC": 1000.0, "DB": 3000.0}
    nodes = {"A": (0.0, 0.0), "B": (100.0, 0.0), "C": (200.0, 0.0), "D": (100.0, -100.0)}
    truss = Truss(
        nodes, ("A", "C", "D"), (("A", "B"), ("B", "C"), ("D", "B")), {}, {"AB": 1e-9, "BC": 1e-9}, k, loaded="B"
    )
    off = {"tolerance": 0.02, "law": "uniform"}
    m = jp.loads(truss.text())
    m = m.with_({f"dimensions.long_{name}.{key}": v for name in ("AB", "BC") for key, v in off.items()})
    found = jp.random(m, samples=100_000).isel(configuration=0).sel(component="x")
    each = 0.02**2 / 3 * np.array([5 / 6, 1 / 6]) ** 2
    np.testing.assert_allclose(found.contribution.sel(source=["long_AB", "long_BC"]), each, rtol=0.03)
