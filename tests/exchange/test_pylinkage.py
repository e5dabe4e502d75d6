"""Linkages of pylinkage: their points along a turn of the crank are where pylinkage has them."""

import contextlib
import json
import math
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pylinkage
import pytest
from pylinkage.actuators import Crank
from pylinkage.components import Ground
from pylinkage.dyads import FixedDyad, RRRDyad, to_mechanism
from pylinkage.mechanism import MechanismBuilder, mechanism_to_json

import jointplay as jp

#: rad per step of pylinkage
STEP = math.tau / 36
COUNT = 36
TURN = [math.degrees(STEP * k) for k in range(1, COUNT + 1)]


def four_bar() -> Any:
    return (
        MechanismBuilder("four-bar")
        .add_ground_link("ground", ports={"O1": (0, 0), "O2": (40, 0)})
        .add_driver_link("crank", length=10, motor_port="O1", omega=STEP, initial_angle=0.3)
        .add_link("coupler", length=35)
        .add_link("rocker", length=30)
        .connect("crank.tip", "coupler.0")
        .connect("coupler.1", "rocker.0")
        .connect("rocker.1", "ground.O2")
        .add_point_tracker("P", ref_port1="crank.tip", ref_port2="coupler.1", distance=17.5, angle=0.5)
        .build()
    )


def slider_crank() -> Any:
    return (
        MechanismBuilder("slider-crank")
        .add_ground_link("ground", ports={"O": (0, 0)})
        .add_driver_link("crank", length=10, motor_port="O", omega=STEP)
        .add_link("rod", length=35)
        .add_slide_axis("rail", through=(0, 2), direction=(3, 1))
        .connect("crank.tip", "rod.0")
        .connect_prismatic("rod.1", "rail")
        .build()
    )


def six_bar() -> Any:
    """A four-bar with a plate as its coupler, which a further dyad hangs on."""
    first, second, third = Ground(0, 0, name="A"), Ground(40, 0, name="D"), Ground(20, 60, name="G")
    crank = Crank(anchor=first, radius=10, angular_velocity=STEP, name="B")
    rocker = RRRDyad(anchor1=crank.output, anchor2=second, distance1=35, distance2=30, name="C")
    plate = FixedDyad(anchor1=crank.output, anchor2=rocker, distance=20, angle=0.7, name="E")
    last = RRRDyad(anchor1=plate, anchor2=third, distance1=30, distance2=30, name="F")
    return pylinkage.Linkage([first, second, third, crank, rocker, plate, last], name="six-bar")


def points(linkage: Any, index: int) -> np.ndarray[Any, Any]:
    """A point of a linkage along a turn of its crank, by pylinkage."""
    return np.array([coordinates[index] for coordinates in linkage.step(iterations=COUNT)])


def saved(mechanism: Any, folder: Path) -> Path:
    path = folder / "linkage.json"
    mechanism_to_json(mechanism, path)
    return path


def followed(path: Path, drive: str, output: str | None) -> np.ndarray[Any, Any]:
    m = jp.read(path, drives={drive: TURN}, output=output)
    result = jp.solve(m)
    assert (result.status == "ok").all()
    return np.asarray(result.nominal.sel(component=["x", "y"]))


def test_a_four_bar_and_its_tracker_go_the_same_way(tmp_path: Path) -> None:
    linkage = four_bar()
    path = saved(linkage, tmp_path)
    index = [joint.id for joint in linkage.joints].index("P")
    expected = points(linkage, index)
    np.testing.assert_allclose(followed(path, "crank_motor_ground_O1", None), expected, atol=1e-8)
    # The motor is the drive where nothing else is asked for.
    assert jp.read(path).drives == ("crank_motor_ground_O1",)


def test_a_pin_on_a_slide_axis_is_one_in_a_slot(tmp_path: Path) -> None:
    linkage = slider_crank()
    path = saved(linkage, tmp_path)
    index = [joint.id for joint in linkage.joints].index("rod.1")
    expected = points(linkage, index)
    np.testing.assert_allclose(followed(path, "crank_motor_ground_O", "rod.1"), expected, atol=1e-8)
    assert jp.read(path, output="rod.1").value("joints.rod_1.type") == "pin_in_slot"


def test_a_plate_made_of_bars_is_one_body(tmp_path: Path) -> None:
    """pylinkage holds the third point of a plate with two bars; they would have pins in the corners."""
    linkage = six_bar()
    path = saved(to_mechanism(linkage), tmp_path)
    expected = points(linkage, 6)
    np.testing.assert_allclose(followed(path, "A", "F"), expected, atol=1e-8)
    m = jp.read(path, output="F", clearance={"revolute": {"radial": 0.1}})
    assert set(m.bodies) == {"B_driver", "C_link2", "C_link1", "F_link2", "F_link1"}
    assert set(m.sources) == {*"ADGBCEF"}
    m.write(tmp_path / "six-bar.toml")
    text = (tmp_path / "six-bar.toml").read_text(encoding="utf-8")
    assert "These links hold one another and are one body: C_link1, E_link1, E_link2." in text
    assert "pylinkage has no units: its lengths are read as mm." in text
    assert jp.worst(m).status.values.tolist() == ["ok"]


def changed(folder: Path, change: Any) -> Path:
    path = saved(four_bar(), folder)
    data = json.loads(path.read_text(encoding="utf-8"))
    # pylinkage writes joints in the order of a set, the tracker last.
    change(data)
    path.write_text(json.dumps(data), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.pop("links"), "is no linkage of pylinkage: its mechanism_to_json writes 'joints' and 'links'"),
        (lambda d: d.update(links={}), r"links: a list of tables is needed, not \{\}"),
        (lambda d: d["joints"].append(d["joints"][0]), r"joints: are there more than once: [\w.]+"),
        (lambda d: d["joints"][1].update(position=[None, None]), r"position: two numbers are needed, \[x, y\]"),
        (lambda d: d["joints"][1].update(type="cam"), r"joints\.[\w.]+\.type: 'cam' is not known here"),
        (lambda d: d["joints"][4].update(ref_joint1_id="Q"), r"joints\.P\.ref_joint1_id: 'Q' is not known here"),
        (lambda d: d["links"][2]["joints"].append("Q"), r"links\.coupler\.joints: 'Q' is not known here"),
        (lambda d: d["links"].pop(0), "links: has no link of type 'ground'"),
        (lambda d: d["joints"].pop(4), r"output: which point is it\? Name one of [\w.]+, "),
        (lambda d: d["links"].append({"id": "loose"}), "links: nothing joins these links with the ground: loose"),
    ],
)
def test_what_is_wrong_is_named(change: Any, message: str, tmp_path: Path) -> None:
    with pytest.raises(jp.InputError, match=rf"linkage\.json: .*{message}"):
        jp.read(changed(tmp_path, change))


def places(node: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Places of a tree, from the top."""
    inside = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in inside:
        yield (*above, key)
        yield from places(value, (*above, key))


def test_a_damaged_linkage_is_read_or_refused(tmp_path: Path) -> None:
    text = saved(four_bar(), tmp_path).read_text(encoding="utf-8")
    path = tmp_path / "damaged.json"
    rng = random.Random(0)
    odd = [None, {}, [], "x", 1e308, -1, True, math.nan, [1, 2], ["x"], "ground", "tracker", "prismatic", 0]
    for _ in range(300):
        data = json.loads(text)
        *above, last = rng.choice([*places(data)])
        here = data
        for step in above:
            here = here[step]
        here[last] = rng.choice(odd)
        path.write_text(json.dumps(data), encoding="utf-8")
        # Any other error fails the test.
        with contextlib.suppress(jp.InputError):
            jp.read(path)


@pytest.mark.parametrize("content", ["", "[]", "{", "[" * 100_000, "\x00"])
def test_other_files_are_no_linkages(content: str, tmp_path: Path) -> None:
    path = tmp_path / "no.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(jp.InputError, match=r"no\.json: is "):
        jp.read(path)
