"""Models for MuJoCo in space: joints have their clearances, and at rest the model is where `loaded` says."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import jointplay as jp
from helpers.answers import example
from helpers.builders import spatial
from helpers.oracles.contact import Settling
from helpers.oracles.loops import matrices
from jointplay.cli import run
from jointplay.exchange.contacts import to_mjcf

Floats = NDArray[np.float64]
#: boxes of a ring
FEW, MANY = 60, 360


def pin() -> jp.Builder:
    b = spatial()
    clearance = jp.radial(0.05, axial=0.02, length=20)
    b.revolute("pin", ground={"at": [0, 0, 0], "axis": [0, 0, 1]}, arm=(0, 0, 0), clearance=clearance)
    b.drive("q", joint="pin", values=[10])
    b.output(body="arm", at=(100, 0, 0))
    return b


def guide() -> jp.Builder:
    b = spatial()
    line = {"at": [0, 0, 0], "axis": [1, 0, 0], "side": [0, 1, 0]}
    b.prismatic("guide", ground=line, block=(0, 0, 0), clearance=jp.gap(0.05, length=40, width=20, height=30))
    b.drive("q", joint="guide", values=[25])
    b.output(body="block", at=(50, 0, 0))
    return b


def hold(b: jp.Builder, k: int, foot: Sequence[float], head: Sequence[float]) -> None:
    """Hold the part by a rod between two balls."""
    b.spherical(f"lower{k}", bodies=["ground", f"rod{k}"], at=foot, clearance=jp.radial(0.02))
    b.spherical(f"upper{k}", bodies=[f"rod{k}", "part"], at=head, clearance=jp.radial(0.03))


def plate() -> jp.Builder:
    b = spatial()
    place = {"at": (0, 0, 0), "axis": (0, 0, 1), "side": (1, 0, 0)}
    b.planar("plate", bodies=["ground", "part"], **place, clearance=jp.gap(0.04, size=[60, 40]))
    b.output(body="part", at=(80, 30, 10))
    hold(b, 0, (-120, 0, 20), (-30, 0, 20))
    hold(b, 1, (0, -100, 10), (0, -20, 10))
    hold(b, 2, (60, -100, 10), (60, -20, 10))
    return b


def sleeve() -> jp.Builder:
    b = spatial()
    clearance = jp.radial(0.05, length=50)
    b.cylindrical("sleeve", bodies=["ground", "part"], at=(0, 0, 0), axis=(1, 0, 0), clearance=clearance)
    b.drive("q", joint="sleeve", values=[4])
    b.output(body="part", at=(90, 20, 0))
    hold(b, 0, (40, 100, -20), (40, 30, 0))
    return b


def loaded(b: jp.Builder, load: dict[str, Any]) -> jp.Mechanism:
    b.load(**load)
    return b.mechanism()


def rest(m: jp.Mechanism, configuration: int = 0, pieces: int = MANY) -> Floats:
    """Displacement of the output at rest, in file units."""
    return Settling(to_mjcf(m, configuration, pieces), 1e-9).rest() / m.units.length


def directions() -> list[Floats]:
    """Sixteen in a plane, none along an axis."""
    return [np.array([np.cos(a), np.sin(a)]) for a in 2 * np.pi * (np.arange(16) + 0.4) / 16]


@pytest.mark.parametrize("name", ["rssr", "serial-6r", "3-rrr-spherical"])
def test_the_model_starts_in_its_nominal_pose(name: str) -> None:
    m = example(name)
    for configuration in (0, 5):
        model = Settling(to_mjcf(m, configuration, FEW), 1e-9)
        nominal = m.core.trace(m.drive_values)["poses"][configuration]
        for body, pose in zip(m.bodies, nominal, strict=True):
            assert model.data.body(body).xpos == pytest.approx(pose[:3], abs=1e-10)
            assert model.data.body(body).xmat == pytest.approx(matrices(pose[None])[0].ravel(), abs=1e-10)
        assert all(abs(contact.dist) < 1e-10 for contact in model.data.contact)


def test_a_pin_has_its_clearance_in_every_direction() -> None:
    for k, way in enumerate(directions()):
        push = {"force": [*(10 * way), 10 * (-1) ** k], "at": [0, 0, 0]}
        moved = rest(loaded(pin(), push), pieces=FEW)
        assert np.hypot(*moved[:2]) == pytest.approx(0.05, rel=np.pi**2 / 2 / FEW**2 + 1e-4)
        assert moved[:2] @ way > 0.05 * np.cos(np.pi / FEW) - 1e-5
        assert moved[2] == pytest.approx(0.02 * (-1) ** k, rel=1e-4)


def test_a_slider_has_its_gap_on_every_side() -> None:
    for way in directions():
        moved = rest(loaded(guide(), {"force": [3, *(10 * way)], "at": [0, 0, 0]}))
        assert moved == pytest.approx([0, *(0.05 * np.sign(way))], abs=1e-5)


LOADED: list[tuple[Callable[[], jp.Builder], dict[str, Any]]] = [
    # From one end of the pin to the other, and against a shoulder.
    (pin, {"force": [3, -2, 5]}),
    (pin, {"force": [1, 2, -5], "moment": [300, 900, 0], "at": [0, 0, 0]}),
    # Tilted on two faces, rolled, and both.
    (guide, {"force": [0, 2, 3]}),
    (guide, {"force": [0, 1, 0.7], "moment": [70, 0, 0], "at": [0, 0, 0]}),
    (guide, {"force": [0, 0, 2], "moment": [10, -20, 80]}),
    (plate, {"force": [4, 3, -10], "at": [10, 5, 10]}),
    (plate, {"force": [4, -3, -10]}),
    (sleeve, {"force": [0, -4, -6]}),
    (sleeve, {"force": [2, 3, -9], "at": [-30, 0, 10]}),
]


@pytest.mark.parametrize(("build", "load"), LOADED)
def test_it_comes_to_rest_where_the_load_pushes_it(build: Callable[[], jp.Builder], load: dict[str, Any]) -> None:
    m = loaded(build(), load)
    found = jp.loaded(m)
    assert found.status.values[0] == "ok"
    want = found.error.values[0, :3]
    assert np.linalg.norm(want) > 0.01
    assert rest(m) == pytest.approx(want, abs=0.02 * 0.02)


def test_a_joint_may_name_its_bodies_in_either_order() -> None:
    """Then the first body hangs on the second. Clearance is large, so that the order of turns is seen in the angle."""
    m = loaded(pin(), {"force": [3, -2, 5], "moment": [400, 0, 0]}).with_(
        {
            "drives.q.values": [-10],
            "joints.pin.on": {"arm": {"at": [0, 0, 0], "axis": [0, 0, 1]}, "ground": [0, 0, 0]},
            "joints.pin.clearance.radial": 0.2,
        }
    )
    assert rest(m) == pytest.approx(jp.loaded(m).error.values[0, :3], abs=0.02 * 0.2)


PERFECT = {f"joints.{name}.clearance": None for name in ("crank", "hook", "ball", "rocker")}


def test_joints_without_clearance_close_their_loop() -> None:
    """The ball closes it by an equation; the load moves nothing."""
    m = example("rssr").with_(PERFECT)
    text = to_mjcf(m, 3)
    assert "<connect" in text
    assert "<pair geom1" not in text
    assert rest(m, 3) == pytest.approx(np.zeros(3), abs=1e-5)


@pytest.mark.parametrize("name", ["crank", "hook", "ball", "rocker"])
def test_clearance_in_one_joint_alone(name: str) -> None:
    """The others are joints of MuJoCo; a rocker without clearance hangs on the ground."""
    without = {key: value for key, value in PERFECT.items() if name not in key.split(".")}
    m = example("rssr").with_({**without, "dimensions": None})
    want = jp.loaded(m).error.values[3, :3]
    assert rest(m, 3) == pytest.approx(want, abs=0.02 * 0.02)


def test_a_hinge_without_clearance_closes_a_loop_by_a_carriage() -> None:
    m = example("bennett").with_({f"joints.{name}.clearance": None for name in ("J1", "J2", "J4")})
    closed = m.with_({"joints.J3.clearance": None})
    assert re.findall(r'body name="(.*)/carriage"', to_mjcf(closed, 1)) == ["J4"]
    assert rest(closed, 1) == pytest.approx(np.zeros(3), abs=1e-4)
    assert rest(m, 1) == pytest.approx(jp.loaded(m).error.values[1, :3], abs=0.02 * 0.01)


def test_an_output_seen_from_another_body() -> None:
    m = example("rssr").with_({"output.relative_to": "coupler"})
    want = jp.loaded(m).error.values[3, :3]
    assert rest(m, 3) == pytest.approx(want, abs=0.02 * 0.02)


REFUSED = [
    ("ball-screw", {}, "joints.nut: is a screw, whose thread is no convex piece"),
    ("four-legged-platform", {}, "has elastic bodies"),
    (
        "rssr",
        {"joints.rocker.stiffness": {"radial": 1e4, "axial": 1e4, "tilt": 1e4}},
        "joints.rocker: has a stiffness",
    ),
]


@pytest.mark.parametrize(("name", "changes", "problem"), REFUSED, ids=[name for name, *_ in REFUSED])
def test_what_has_no_solids_is_said_and_nothing_is_written(
    name: str, changes: dict[str, Any], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    example(name).with_(changes).write("m.toml")
    assert run(["export", "m.toml", "-o", "m.xml"]) == 2
    assert problem in capsys.readouterr().err.replace("\n", " ")
    assert not Path("m.xml").exists()
