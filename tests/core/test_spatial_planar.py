"""A planar linkage told in space, all pins along z, gives the planar answers.

Four pins along z hold the linkage in its plane three times too often. A slide along z and a universal joint with pins
along x and y inside the coupler give that way, and nothing in the plane. Pins so long that they cannot tilt play in a
disc.
"""

import math

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from helpers import builders

PLANAR, SPATIAL = ["x", "y", "angle"], ["x", "y", "rz"]
OUT_OF_PLANE = ["z", "rx", "ry"]
DRIVES = [22.7, 43.83, 76.39]
PLAY = {"J1": 0.3, "J2": 0.5, "J3": 0.4, "J4": 0.6}
LOAD = {"force": [4.0, -10.0], "moment": 300.0}


def planar() -> jp.Mechanism:
    m = jp.loads(jp.examples.text("four-bar"))
    radii = {f"joints.{name}.clearance.radial": radius for name, radius in PLAY.items()}
    return m.with_({**radii, "drives.theta1.values": DRIVES, "loads.0": LOAD, "dimensions": None})


def spatial(kind: str = "split", factor: float = 1.0) -> jp.Mechanism:
    """The same linkage with its coupler split or on a ball; the play of its pins is multiplied by a factor."""
    b, zero = builders.spatial(), (0, 0, 0)

    def pin(name: str, **on: tuple[float, float, float]) -> None:
        ends = {body: {"at": at, "axis": [0, 0, 1], "side": [1, 0, 0]} for body, at in on.items()}
        b.revolute(name, on=ends, clearance=jp.radial(factor * PLAY[name], axial=0, length=1e9))

    pin("J1", ground=zero, crank=zero)
    pin("J4", ground=(-100, 0, 0), rocker=zero)
    if kind == "split":
        # Inside the coupler: free to give way across the plane.
        pin("J2", crank=(75, 0, 0), coupler=zero)
        pin("J3", end=(75, 0, 0), rocker=(150, 0, 0))
        middle = (37.5, 0, 0)
        slide = {"at": middle, "axis": [0, 0, 1], "side": [1, 0, 0]}
        b.prismatic("slide", coupler=slide, middle=slide)
        b.universal("hook", middle={"at": middle, "axis": [1, 0, 0]}, end={"at": middle, "axis": [0, 1, 0]})
    else:
        # Or a ball at one end of the coupler and a second pin, across it, at the other.
        pin("J2", crank=(75, 0, 0), cross=zero)
        across = {"at": zero, "axis": [0, 1, 0], "side": [1, 0, 0]}
        b.revolute("across", cross=across, coupler=across)
        b.spherical("J3", coupler=(75, 0, 0), rocker=(150, 0, 0), clearance=jp.radial(0.4))
    for body in ("coupler", "middle", "end") if kind == "split" else ("cross", "coupler"):
        b.start(body, rotation=[0, 0, 129])
    b.start("crank", rotation=[0, 0, 22.7])
    b.start("rocker", rotation=[0, 0, 35.6])
    b.drive("theta1", joint="J1", values=DRIVES)
    b.output(body="rocker", at=(150, 0, 0))
    b.load(force=[*LOAD["force"], 0], moment=[0, 0, LOAD["moment"]])
    return b.mechanism()


def same(space: xr.DataArray, plane: xr.DataArray, size: float = 100.0) -> None:
    """In-plane components agree, the others vanish; `size` in millimetres, of what rounding is compared with."""
    got, want = space.sel(component=SPATIAL), plane.sel(component=PLANAR)
    np.testing.assert_allclose(got.values, want.values, rtol=0, atol=1e-9 * size)
    np.testing.assert_allclose(space.sel(component=OUT_OF_PLANE).values, 0.0, atol=1e-9 * size)


@pytest.mark.parametrize("kind", ["split", "ball"])
def test_nominal_poses(kind: str) -> None:
    same(jp.solve(spatial(kind)).nominal, jp.solve(planar()).nominal)


@pytest.mark.parametrize("kind", ["split", "ball"])
def test_loaded(kind: str) -> None:
    space, plane = jp.loaded(spatial(kind)), jp.loaded(planar())
    assert (space.status == plane.status).all()
    for name in ("error", "error_first_order", "undetermined"):
        same(space[name], plane[name])
    got = space.reaction.sel(joint=list(PLAY), wrench=["fx", "fy", "mz"])
    want = plane.reaction.sel(joint=list(PLAY), wrench=["fx", "fy", "moment"])
    np.testing.assert_allclose(got.values, want.values, rtol=0, atol=1e-8)


@pytest.mark.parametrize("kind", ["split", "ball"])
def test_worst(kind: str) -> None:
    """Play across the plane does not help: a ball that leaves it loses more of its reach than the coupler shortens."""
    space, plane = jp.worst(spatial(kind)), jp.worst(planar())
    for suffix in ("", "_first_order"):
        got = space[f"worst_component{suffix}"].sel(component=SPATIAL)
        np.testing.assert_allclose(got, plane[f"worst_component{suffix}"].sel(component=PLANAR), rtol=1e-9)
        for name in ("worst_position", "worst_rotation"):
            np.testing.assert_allclose(space[name + suffix], plane[name + suffix], rtol=1e-9)


def test_given() -> None:
    """The same units in both. In space the offset of a pin is told along axes that lie on its first body."""
    space, plane = spatial(), planar()
    rng = np.random.default_rng(3)
    for _ in range(20):
        radii, angles = np.sqrt(rng.uniform(0, 1, 4)), rng.uniform(0, 2 * np.pi, 4)
        play = {
            name: radius * s * np.array([np.cos(a), np.sin(a)])
            for (name, radius), s, a in zip(PLAY.items(), radii, angles, strict=True)
        }
        want = jp.given(plane, {f"{name}.{axis}": p[k] for name, p in play.items() for k, axis in enumerate("xy")})
        turned = {"J1": np.zeros(3), "J4": np.zeros(3)}
        for name, body in (("J2", "crank"), ("J3", "coupler")):
            turned[name] = np.radians(want.pose.sel(body=body, component="angle").values)
        offsets = {}
        for name, (x, y) in play.items():
            c, s = np.cos(turned[name]), np.sin(turned[name])
            offsets |= {f"{name}.side": c * x + s * y, f"{name}.normal": c * y - s * x}
        same(jp.given(space, offsets).error, want.error)


def test_covariance() -> None:
    """Both ends of a pin scatter on their own, so that its middle has half the variance of a point of the disc."""
    space, plane = jp.random(spatial(factor=math.sqrt(2)), samples=100), jp.random(planar(), samples=100)
    got = space.error_covariance_first_order.sel(component=SPATIAL, component_other=SPATIAL)
    np.testing.assert_allclose(got, plane.error_covariance_first_order, rtol=1e-9, atol=1e-12)
