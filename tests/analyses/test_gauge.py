"""A distance as the output: a gauge without mass between two points, as the page on the file has it."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import jointplay as jp

PAGE = Path(__file__).parents[2] / "docs" / "file-format.md"
START = "\n[start.barrel]\nangle = 60\n[start.rod]\nangle = 60\nx = 80\ny = 100\n"


def four_bar(*, gauge):
    """The bundled four-bar with tolerances; with a gauge from the ground to its rocker, or with the rocker's output."""
    text = jp.examples.text("four-bar").replace("radial = 1.0", "radial = 0.3")
    head, _, rest = text.partition("[output]")
    _, _, rest = rest.partition("\n\n")
    if gauge:
        page = PAGE.read_text(encoding="utf-8")
        part = page[page.index("[joints.near]") : page.index("```", page.index("[joints.near]"))]
        return jp.loads(
            f"{head}{START}{part}\n{rest}".replace("[[loads]]\n", '[[loads]]\nbody = "rocker"\nat = "J3"\n')
        )
    return jp.loads(text)


def distances(result):
    x, y = (result.nominal + result.error).sel(component=["x", "y"]).values.T
    before = np.hypot(result.nominal.sel(component="x"), result.nominal.sel(component="y") + 50)
    return np.hypot(x, y + 50) - before


@pytest.mark.parametrize("question", ["given", "loaded"])
def test_distance_of_one_pose(question):
    offsets = ({"J1": [0.2, -0.1], "J3": [0.1, 0.25], "J4": [-0.2, 0.1]},) if question == "given" else ()
    ask = getattr(jp, question)
    gauge, plain = ask(four_bar(gauge=True), *offsets), ask(four_bar(gauge=False), *offsets)
    assert_allclose(gauge.error.sel(component="x"), distances(plain), atol=1e-9)
    assert_allclose(gauge.error.sel(component=["y", "angle"]), 0.0, atol=1e-9)
    assert np.abs(gauge.error.sel(component="x")).max() > 0.1


def test_worst_distance():
    """No random offsets change it more; at those of an extreme the plain mechanism has the same change."""
    gauge, plain = four_bar(gauge=True), four_bar(gauge=False)
    worst = jp.worst(gauge)
    ends = worst.worst_component.sel(component="x")
    for side in ("low", "high"):
        offsets = worst.worst_offset.sel(extreme=f"x {side}")
        at = jp.given(plain, {name: offsets.sel(parameter=name).values for name in offsets.parameter.values})
        assert_allclose(ends.sel(side=side), distances(at), atol=1e-9)
    rng = np.random.default_rng(3)
    for _ in range(40):
        angles = rng.uniform(0.0, 2.0 * np.pi, 4)
        offsets = {f"J{k + 1}": 0.3 * np.array([np.cos(a), np.sin(a)]) for k, a in enumerate(angles)}
        change = distances(jp.given(plain, offsets))
        assert (change >= ends.sel(side="low").values - 1e-9).all()
        assert (change <= ends.sel(side="high").values + 1e-9).all()
