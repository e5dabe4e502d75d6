"""Whose the scatter of specimens under load is: the load decides every offset, so that only sizes make it scatter."""

from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar

SAMPLES = 4096


def of_seed(seed: int) -> tuple[jp.Mechanism, dict[str, Any]]:
    """A four-bar under load whose sizes scatter, and for every source what freezes it."""
    rng = np.random.default_rng([40, seed])
    radial = rng.uniform(0.06, 0.15, 3).round(4)
    tolerance = rng.uniform(0.01, 0.05, 3).round(4)
    laws = rng.choice(["uniform", "normal"], 3).tolist()
    size = [{"tolerance": t, "size_law": law} for t, law in zip(tolerance, laws, strict=True)]
    b = planar()
    b.revolute("J1", ground=(0, 0), crank=(0, 0), clearance=jp.radial(radial[0], **size[0]))
    b.revolute("J2", crank=(75, 0), coupler=(0, 0), clearance=jp.radial(radial[1], **size[1]))
    b.revolute("J3", coupler=(75, 0), rocker=(150, 0), clearance=jp.diametral(radial[2], **size[2]))
    # Of some specimens the pin is larger than its hole.
    fit = "H7/h6" if seed % 4 == 3 else "H7/f7"
    b.revolute("J4", ground=(-100, 0), rocker=(0, 0), clearance=jp.fit(fit, diameter=80))
    for body, angle in (("crank", 22.7), ("coupler", 129), ("rocker", 35.6)):
        b.start(body, angle=angle)
    b.drive("theta1", joint="J1", values=[round(rng.uniform(35, 60), 3)], error=round(rng.uniform(0, 0.05), 4))
    b.output(body="rocker", at=(150, 0))
    *force, moment = rng.uniform(-10, 10, 3).round(3)
    b.load(force=force, moment=moment)
    b.dimension("l2", body="coupler", between=["J2", "J3"], tolerance=round(rng.uniform(0.01, 0.06), 4))
    freezes = {f"J{k}.size": {f"joints.J{k}.clearance.tolerance": 0.0} for k in (1, 2, 3)}
    freezes |= {"theta1": {"drives.theta1.error": 0.0}, "l2": {"dimensions.l2.tolerance": 0.0}}
    return b.mechanism(), freezes


@pytest.mark.parametrize("seed", range(12))
def test_freezing_a_source_takes_away_its_share(seed: int) -> None:
    """A clearance was told as 12 times what its size is, though the load puts its pin where it is in every specimen:
    all of its scatter is that of the size."""
    m, freezes = of_seed(seed)
    found = jp.random(m, samples=SAMPLES, contact="loaded").isel(configuration=0)
    total = np.diag(found.error_covariance)
    shares = found.contribution
    np.testing.assert_allclose(shares.sum("source"), np.diag(found.error_covariance_first_order), rtol=1e-6)
    # Where a force points changes a little from specimen to specimen.
    offsets = shares.sel(source=found.source_kind == "clearance")
    assert (np.abs(offsets).sum("source") < 2e-3 * total).all()
    for source, change in freezes.items():
        left = jp.random(m.with_(change), samples=SAMPLES, contact="loaded").isel(configuration=0)
        taken = total - np.diag(left.error_covariance)
        assert (np.abs(shares.sel(source=source) - taken) < 0.03 * total).all()


def test_shares_under_load_are_the_contribution_of_loaded() -> None:
    """With small scatter the share of a size is the square of what the clearance does, times that of the size in it."""
    m, _ = of_seed(0)
    pushed = jp.loaded(m).isel(configuration=0)
    drawn = jp.random(m, samples=SAMPLES, contact="loaded").isel(configuration=0)
    core = m.core_spec
    for k in (1, 2):
        joint = f"J{k}"
        radial = core["sources"][list(pushed.source.values).index(joint)]["set"]["disc"]["radius"]
        own = pushed.contribution.sel(source=joint) / (1e3 * radial)
        std = np.sqrt(drawn.contribution.sel(source=f"{joint}.size"))
        # Both components are moved by the same size.
        ratio = (std / np.abs(own)).values
        np.testing.assert_allclose(ratio, ratio[0], rtol=0.02)
