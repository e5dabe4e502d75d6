"""Elastic mechanisms without play against Pynite, a finite-element program for frames."""

import numpy as np
import pytest
from Pynite import FEModel3D

import jointplay as jp
from helpers.builders import planar
from helpers.oracles.beam import AREA, INERTIA, E
from helpers.oracles.truss import Truss, square

#: the finite elements are fully three-dimensional: what bends and twists out of the plane is held at the nodes
CASE = "Combo 1"
BARS = ("AD", "DC", "BC", "AC", "BD")


def in_the_plane(model: FEModel3D, node: str, *, held: bool, turns: bool) -> None:
    model.def_support(node, held, held, True, True, True, held or not turns)


def finite_elements(truss: Truss) -> FEModel3D:
    """Bars on pins; a bar that is too long by g pushes its nodes apart by k g and then carries k g less."""
    model = FEModel3D()
    model.add_material("steel", E, E / 2.6, 0.3, 0.0)
    for node, (x, y) in truss.nodes.items():
        model.add_node(node, x, y, 0.0)
        in_the_plane(model, node, held=node in truss.fixed, turns=False)
    push = {node: np.zeros(2) for node in truss.nodes}
    for name, (a, b) in zip(truss.names, truss.bars, strict=True):
        length = float(np.linalg.norm(truss.vector((a, b))))
        stiffness = truss.stiffness[name]
        model.add_section(name, stiffness * length / E, 1.0, 1.0, 1.0)
        model.add_member(name, a, b, "steel", name)
        model.def_releases(name, Ryi=True, Rzi=True, Ryj=True, Rzj=True)
        apart = stiffness * truss.deviation.get(name, 0.0) * truss.vector((a, b)) / length
        push[a] -= apart
        push[b] += apart
    push[truss.loaded] += truss.load
    for node, (x, y) in push.items():
        model.add_node_load(node, "FX", x)
        model.add_node_load(node, "FY", y)
    model.analyze_linear()
    return model


@pytest.mark.parametrize("seed", range(6))
def test_a_strained_truss(seed: int) -> None:
    rng = np.random.default_rng(seed)
    deviation = {name: float(d) for name, d in zip(BARS, 0.1 * rng.normal(size=5), strict=True)}
    stiffness = {name: float(k) for name, k in zip(BARS, rng.uniform(500, 5000, 5), strict=True)}
    truss = square(deviation=deviation, stiffness=stiffness, load=(30.0, -80.0), loaded="C")
    model = finite_elements(truss)
    found = jp.loaded(jp.loads(truss.text(), "truss.toml"), exact=False)
    moved = found.error_first_order.sel(component=["x", "y"]).values[0]
    node = model.nodes["C"]
    np.testing.assert_allclose(moved, [node.DX[CASE], node.DY[CASE]], rtol=1e-9)
    for name in BARS:
        # Pynite has compression positive.
        tension = -model.members[name].axial(0.0, CASE) - stiffness[name] * deviation[name]
        assert found.member_force.sel(member=name).item() == pytest.approx(tension, rel=1e-9)


def test_a_portal_frame_clamped_at_both_feet() -> None:
    b = planar()
    b.fixed("A", bodies=["ground", "left"], at=(0, 0))
    b.fixed("B", bodies=["left", "beam"], at=(0, 200))
    b.fixed("C", bodies=["beam", "right"], at=(300, 200))
    b.fixed("D", bodies=["right", "ground"], at=(300, -50))
    for name in ("left", "beam", "right"):
        b.body(name, E=E, area=AREA, inertia=INERTIA)
    b.output(body="beam", at=(120, 200))
    b.load(force=(40, -25), moment=300)
    m = b.mechanism()
    assert jp.check(m).attrs["redundancy"] == 3
    model = FEModel3D()
    model.add_material("steel", E, E / 2.6, 0.3, 0.0)
    model.add_section("beam", AREA, INERTIA, INERTIA, INERTIA)
    places = {"A": (0.0, 0.0), "B": (0.0, 200.0), "P": (120.0, 200.0), "C": (300.0, 200.0), "D": (300.0, -50.0)}
    for node, (x, y) in places.items():
        model.add_node(node, x, y, 0.0)
        in_the_plane(model, node, held=node in "AD", turns=True)
    for a, b in ("AB", "BP", "PC", "CD"):
        model.add_member(a + b, a, b, "steel", "beam")
    for direction, size in (("FX", 40.0), ("FY", -25.0), ("MZ", 300.0)):
        model.add_node_load("P", direction, size)
    model.analyze_linear()
    found = jp.loaded(m, exact=False)
    x, y, angle = found.error_first_order.values[0]
    node = model.nodes["P"]
    np.testing.assert_allclose([x, y, np.deg2rad(angle)], [node.DX[CASE], node.DY[CASE], node.RZ[CASE]], rtol=1e-9)
    foot = model.nodes["A"]
    expected = [foot.RxnFX[CASE], foot.RxnFY[CASE], foot.RxnMZ[CASE]]
    # The reaction acts on the second body, as the ground does on the foot.
    np.testing.assert_allclose(found.reaction.sel(joint="A").values[0], expected, rtol=1e-8)
