"""Models for MuJoCo: clearances are gaps between solids, and at rest the model is where `loaded` says."""

import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import jointplay as jp
from helpers.builders import planar
from helpers.commands import refused
from jointplay.cli import run
from jointplay.exchange.contact_model import PIECES
from jointplay.exchange.contacts import to_mjcf

Floats = NDArray[np.float64]
#: part of a clearance: a corner of a ring is up to a degree beside the load, so that a pin is pi / 180 of its clearance
#: aside; two pins add up
CLOSE = 0.03


def example(name: str, **changes: Any) -> jp.Mechanism:
    return jp.loads(jp.examples.text(name)).with_(changes)


class Model:
    """An exported mechanism in MuJoCo."""

    def __init__(self, m: jp.Mechanism, configuration: int) -> None:
        self.m, self.configuration = m, configuration
        self.model = mujoco.MjModel.from_xml_string(to_mjcf(m, configuration))
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.start = self.output()

    def output(self) -> Floats:
        found: Floats = self.data.sensor("output").data[:2].copy()
        return found

    def settle(self, steps: int) -> Floats:
        """Displacement of the output, in file units."""
        for _ in range(steps):
            mujoco.mj_step(self.model, self.data)
        return (self.output() - self.start) / self.m.units.length

    def offsets(self) -> dict[str, float]:
        """How far each pin is from the middle of its hole, m."""
        spec = self.m.core_spec

        def place(number: int) -> Floats:
            point = spec["points"][number]
            at = np.array(point["at"])
            if point["body"] < 0:
                return at
            body = self.data.body(self.m.bodies[point["body"]])
            return np.asarray(body.xpos + body.xmat.reshape(3, 3) @ at)

        joints = zip(self.m.joints, spec["joints"], strict=True)
        return {name: float(np.linalg.norm(place(j["second"]) - place(j["first"]))) for name, j in joints}


def test_an_exported_mechanism_starts_in_its_nominal_pose() -> None:
    m = example("four-bar")
    for configuration, nominal in enumerate(jp.solve(m).nominal.values):
        if configuration % 5 == 0:
            model = Model(m, configuration)
            assert model.start / m.units.length == pytest.approx(nominal[:2], abs=1e-9)
            assert max(model.offsets().values()) < 1e-12


@pytest.mark.parametrize(
    ("name", "configuration", "clearance", "steps", "changes"),
    [
        ("four-bar", 0, 0.05, 1500, {"joints.*.clearance.radial": 0.05}),
        ("four-bar", 7, 0.001, 1500, {"joints.*.clearance.radial": 0.001}),
        # A guide in which the slider tilts from corner to corner, or lies on one side, where it is pushed gently.
        ("slider-crank", 0, 0.03, 1500, {}),
        ("slider-crank", 3, 0.03, 4000, {}),
        # Weights, and two drives.
        ("serial-2r", 2, 0.01, 1500, {}),
        ("3-rrr", 0, 0.01, 1500, {}),
    ],
)
def test_it_comes_to_rest_where_the_load_pushes_it(
    name: str, configuration: int, clearance: float, steps: int, changes: dict[str, Any]
) -> None:
    m = jp.loads(jp.examples.text(name)).with_(changes)
    want = jp.loaded(m).error.values[configuration, :2]
    model = Model(m, configuration)
    found = model.settle(steps)
    assert np.linalg.norm(want) > 0.5 * clearance
    assert found == pytest.approx(want, abs=CLOSE * clearance)
    # No pin is deeper in its hole than the corners of the ring are.
    for joint, offset in model.offsets().items():
        if m.joint_kinds[m.joints.index(joint)] == "revolute":
            play = m.value(f"joints.{joint}.clearance.radial") * m.units.length
            assert offset < play * (1 + np.pi**2 / 2 / PIECES**2 + 1e-4)


def test_loads_that_turn_with_a_body_and_springs_are_there() -> None:
    """A follower pushes along its rod, and a spring pulls the crank back."""
    changes = {
        "joints.*.clearance.radial": 0.05,
        "loads": [{"force": [3, -8], "axes": "body"}, {"body": "crank", "moment": 120}],
        "springs.s": {
            "on": {"ground": [-150, 50], "coupler": [20, 5]},
            "stiffness": 0.2,
            "free_length": 40,
            "preload": 1,
        },
    }
    m = example("four-bar", **changes)
    for configuration in (0, 6):
        want = jp.loaded(m).error.values[configuration, :2]
        assert Model(m, configuration).settle(2500) == pytest.approx(want, abs=CLOSE * 0.05)


def test_pins_without_clearance_and_latched_ones() -> None:
    """A hinge that is locked keeps its angle, and its pin its play."""
    text = planar(gravity=(0, -9.81))
    text.revolute("A", ground=(0, 0), arm=(0, 0))
    text.fixed("B", arm={"at": (200, 0), "axis": 30}, tool=(0, 0), clearance=jp.radial(0.1))
    text.fixed("C", tool=(40, 0), tip=(0, 0))
    text.drive("q", joint="A", values=(10, 50))
    text.body("tip", mass=2, centre=(10, 5))
    text.output(body="tip", at=(80, 0))
    m = text.mechanism()
    want = jp.loaded(m).error.values[1, :2]
    assert want == pytest.approx([0, -0.1], abs=1e-6)
    assert Model(m, 1).settle(1500) == pytest.approx(want, abs=CLOSE * 0.1)


def test_moments_of_inertia_are_those_of_the_file() -> None:
    """In the plane that about its normal, in space all of them; a slim rod gets a little about its line."""
    changes = {"bodies.rod.rotational_inertia": 900, "bodies.rod.mass": 2}
    model = mujoco.MjModel.from_xml_string(to_mjcf(example("slider-crank").with_(changes), 0))
    rod = model.body("rod")
    assert rod.inertia == pytest.approx(900e-6)
    m = example("rssr").with_({"bodies.rocker": {"mass": 1, "rotational_inertia": [400, 500, 600, 50, 0, 0]}})
    rocker = mujoco.MjModel.from_xml_string(to_mjcf(m, 0)).body("rocker")
    assert np.sort(rocker.inertia) == pytest.approx(
        1e-6 * np.linalg.eigvalsh([[400, 50, 0], [50, 500, 0], [0, 0, 600]])
    )


def test_drive_values_may_come_from_a_path() -> None:
    m = example("five-bar")
    assert Model(m, 4).start / m.units.length == pytest.approx(jp.solve(m).nominal.values[4, :2], abs=1e-9)


def test_titles_of_all_kinds_are_in_the_model() -> None:
    title = 'a "title" <with> \x01 -- & more'
    model = mujoco.MjModel.from_xml_string(to_mjcf(example("four-bar", title=title)))
    assert model.names.startswith(b'a "title" <with> \\x01 -- & more\x00')


def test_a_body_without_a_mass_has_no_weight() -> None:
    m = example("four-bar", gravity=[0, -9.81], **{"bodies.rocker.mass": 1.0})
    model = Model(m, 0).model
    assert model.body_mass[1:] == pytest.approx([0.785 * 0.075, 0.785 * 0.075, 1.0], rel=1e-9)
    assert list(model.body_gravcomp[1:]) == [1, 1, 0]


REFUSED = [
    (
        "four-bar",
        {
            "dimensions": None,
            "joints.J2.on": {"crank": [75, 0], "world": [0, 0]},
            "joints.J3.on": {"world": [75, 0], "rocker": [150, 0]},
            "start": None,
        },
        "has a body 'world'",
    ),
    ("rack-slider", {}, "joints.mesh: is a rack, whose flanks are no convex pieces"),
    ("redundant-bar", {}, "has elastic bodies"),
    ("slider-crank-cases", {}, "has several outputs or load cases; name one of them"),
    (
        "four-bar",
        {"drives.theta1.values": [0, 900]},
        "--configuration: 5 is not the number of a configuration; 0 to 1 are",
    ),
]


@pytest.mark.parametrize(("name", "changes", "problem"), REFUSED, ids=[name for name, *_ in REFUSED])
def test_what_cannot_be_exported_is_said_and_nothing_is_written(
    name: str, changes: dict[str, Any], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    example(name, **changes).write("m.toml")
    assert re.search(problem, refused(capsys, "export", "m.toml", "-o", "m.xml", "-c", "5"))


def test_formats_that_are_written_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example("four-bar").write("m.toml")
    said = {}
    for name in ("m.step", "m.csv", "m.xml"):
        run(["export", "m.toml", "-o", name])
        said[name] = "".join(capsys.readouterr())
    assert "'.step' is not the extension of a format that is written; known: .xml, .mjcf" in said["m.step"]
    assert said["m.csv"] == "wrote m.csv\n"
    assert said["m.xml"] == "wrote m.xml\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.csv", "m.toml", "m.xml"]
