"""The worst of an assembly is not exceeded by any of its units, at no step and no joint."""

import math

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from helpers.assemblies import assembly
from helpers.builders import planar

GROUND_BAR = planar()
GROUND_BAR.revolute("A", bodies=["ground", "bar"], at=(0, 0), clearance=jp.radial(0.5))
GROUND_BAR.revolute("B", bodies=["ground", "bar"], at=(100, 0), clearance=jp.radial(0.5))
GROUND_BAR.dimension("AB", body="ground", between=["A", "B"], tolerance=0.2)
GROUND_BAR.output(body="bar", at="B")
GROUND_BAR.assembly(steps=[["bar"]])


def test_a_pin_of_the_base_is_off_by_the_tolerance_of_its_place() -> None:
    """A bar on two pins of the ground: the step is redundant and no unit is strained, and the pin in B was said to be
    where it should be."""
    m = GROUND_BAR.mechanism()
    step = jp.assemble(m, "worst").isel(step=0)
    assert (step.kind, step.status) == ("redundant", "ok")
    np.testing.assert_allclose(step.worst_shaft, [0.0, 0.2], atol=1e-9)
    # The end in A is not quite on the x axis in the farthest unit.
    np.testing.assert_allclose(step.worst_bearing, [0.5, largest_of_the_far_end()], atol=1e-5)


def largest_of_the_far_end() -> float:
    """The end in A is off by x = -0.5, the pin in B by -0.2; the end in B is off by x and what leaning takes of it, and
    by as much of y as the play allows: (|x| - 0.2)^2 + y^2 = 0.5^2."""
    x = 0.5
    for _ in range(4):
        y = math.sqrt(0.5**2 - (x - 0.2) ** 2)
        x = 0.5 + 100.0 - math.sqrt(100.0**2 - y**2)
    return math.hypot(x, y)


def test_what_a_load_stretches_of_a_bar_that_fits_is_in_the_worst() -> None:
    """The bar is pushed to the right: in A the play stops it after 0.5 mm, its end in B goes on until the pin there,
    0.2 mm too far to the right, stops it, too. Nothing is strained without the load: the stretching was left out."""
    m = GROUND_BAR.mechanism().with_({"bodies.bar.stiffness": 100.0, "loads": [{"force": [30.0, 0.0]}]})
    unit = jp.assemble(m.with_({"dimensions.AB.deviation": 0.2, "dimensions.AB.tolerance": None})).isel(step=0)
    assert float(unit.error_bearing.sel(joint="B", component="x")) == pytest.approx(0.7, abs=1e-6)
    step = jp.assemble(m, "worst").isel(step=0)
    assert step.status == "ok"
    assert step.worst_bearing.sel(joint="B") >= 0.7 - 1e-6
    # At most what rigid bars can do, and all that the load could stretch.
    assert step.worst_bearing.sel(joint="B") <= largest_of_the_far_end() + 0.3 + 1e-5


def test_the_antenna_support_keeps_the_tolerance_of_its_cabin_through_all_steps() -> None:
    """The pin in B is on the cabin, which is the base: it is off by 0.2 mm whatever is built on it."""
    m = example("antenna-support").with_({"dimensions.AB.tolerance": 0.2, "dimensions.AB.deviation": 0.0})
    found = jp.assemble(m, "worst")
    np.testing.assert_allclose(found.worst_shaft.sel(joint="B"), 0.2, atol=1e-9)
    assert found.status.values.tolist() == ["ok"] * 5


@pytest.mark.parametrize("seed", range(12))
def test_no_unit_is_farther_off_than_the_worst(seed: int) -> None:
    m = jp.loads(assembly(seed))
    worst = jp.assemble(m, "worst")
    solved = worst.status != "not_assemblable"
    scatter = jp.assemble(m, "random", samples=200, seed=seed, probabilities=[1.0 - 1e-9]).isel(probability=0)
    unit = jp.assemble(built(m, np.random.default_rng(seed)))
    assert (scatter.quantile_clearance_factor <= worst.worst_clearance_factor + 1e-9).all()
    for end in ("shaft", "bearing"):
        most = worst[f"worst_{end}"]
        assert most.notnull().where(solved & scatter[f"quantile_{end}"].notnull(), True).all()
        # What no unit of a rigid step can be is not known.
        limit = most.where(solved, np.inf) * (1.0 + 1e-6) + 1e-9
        size = np.sqrt((unit[f"error_{end}"].sel(component=["x", "y"]) ** 2).sum("component", skipna=False))
        for off in (scatter[f"quantile_{end}"], size):
            assert ((off <= limit) | off.isnull()).all(), (end, off.values, most.values)


def built(m: jp.Mechanism, rng: np.random.Generator) -> jp.Mechanism:
    """One unit within the tolerances, as likely at their ends as between them."""
    deviations: dict[str, object] = {}
    for name in m.data.dimensions:
        share = rng.choice([-1.0, 1.0, rng.uniform(-1.0, 1.0)])
        deviations[f"dimensions.{name}.deviation"] = share * m.value(f"dimensions.{name}.tolerance")
        deviations[f"dimensions.{name}.tolerance"] = None
    return m.with_(deviations)
