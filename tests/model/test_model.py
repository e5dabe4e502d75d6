"""A mechanism in numbers, and changed copies of it."""

import pickle

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar
from jointplay import examples
from jointplay.errors import InputError
from jointplay.model.mechanism import changed, loads
from jointplay.model.mobility import require_determinate

FOUR_BAR = examples.text("four-bar")
TEXTS = {name: examples.text(name) for name in examples.names()}


def test_the_four_bar_in_numbers() -> None:
    m = loads(FOUR_BAR)
    assert m.bodies == ("crank", "coupler", "rocker")
    assert m.joints == ("J1", "J2", "J3", "J4")
    assert m.sources == ("J1", "J2", "J3", "J4", "l2", "theta1")
    assert m.parameters == (*(f"J{k}.{c}" for k in (1, 2, 3, 4) for c in "xy"), "l2.length", "theta1.value")
    assert m.parameter_source.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 5]
    assert m.length == pytest.approx(0.0875)  # the median of 75, 75, 100 and 150 mm
    assert m.has_loads
    assert m.drive_values is not None
    np.testing.assert_allclose(m.drive_values[0], np.deg2rad([22.7]))
    np.testing.assert_allclose(m.component_factors, [1e-3, 1e-3, np.pi / 180])


def test_the_core_has_the_same_parameters() -> None:
    for text in TEXTS.values():
        m = loads(text)
        assert [f"{m.sources[s]}.{c}" for s, c in m.core.parameters] == list(m.parameters)
        assert [s for s, _ in m.core.parameters] == m.parameter_source.tolist()


def test_a_mechanism_cannot_be_changed() -> None:
    m = loads(FOUR_BAR)
    with pytest.raises(AttributeError):
        m.raw = {}  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        m.centre[0] = 1.0
    m.spec()["joints"].clear()
    m.value("joints.J1.on")["ground"][0] = 7
    assert m == loads(FOUR_BAR)


def test_it_survives_a_pickle_and_tells_what_it_is() -> None:
    m = loads(FOUR_BAR, "four-bar.toml")
    again = pickle.loads(pickle.dumps(m))
    assert (again, hash(again), again.file) == (m, hash(m), m.file)
    assert "3 bodies, 4 joints, 1 drive, 6 sources, 11 configurations" in repr(m)
    assert "\n" not in repr(m)
    error = InputError("problem", file="f", key="k")
    assert str(pickle.loads(pickle.dumps(error))) == str(error) == "f: k: problem"


def test_a_pin_that_carries_three_bodies_is_two_joints() -> None:
    text = FOUR_BAR.replace("rocker = [150, 0] }", "rocker = [150, 0], pusher = [0, 0] }").replace(
        "[start]",
        '[joints.P]\ntype = "prismatic"\non = { ground = { at = [0, 50], axis = 90 }, slide = [0, 0] }\n'
        '[joints.Q]\ntype = "revolute"\non = { pusher = [60, 0], slide = [0, 0] }\n[start]',
    )
    m = loads(text)
    assert m.joints == ("J1", "J2", "J3/rocker", "J3/pusher", "J4", "P", "Q")
    assert {"J3/rocker.x", "J3/pusher.y"} <= set(m.parameters)
    points = [joint["first"] for joint in m.spec()["joints"][2:4]]
    assert points[0] == points[1], "the first body carries the pin once"
    require_determinate(m)


def test_sources_keep_apart_by_name() -> None:
    m = loads(FOUR_BAR.replace("[drives.theta1]", "[drives.J1]"))
    assert m.sources[-1] == "drive J1"
    assert m.parameters[-1] == "drive J1.value"


MIXED = planar()
MIXED.revolute("A", bodies=["ground", "bar"], at=(0, 0), clearance=jp.radial(0.1))
MIXED.revolute("B", bodies=["bar", "next"], at=(100, 0), clearance=jp.diametral(0.3, law="boundary"))
MIXED.revolute("C", bodies=["next", "last"], at=(200, 0))
MIXED.drive("a", joint="A", values=(0, 5))
MIXED.drive("b", joint="B", from_=0, to=10, count=2)
MIXED.drive("c", joint="C", values=(0, 5))
MIXED.output(body="last", at=(300, 0))


def test_a_star_reaches_what_is_written_in_other_words() -> None:
    """Somebody who widened all clearances left those written as diameters as they were."""
    m = MIXED.mechanism()
    wider, reached = changed(m, {"joints.*.clearance.radial": 0.2, "drives.*.values": [5]})
    assert wider.value("joints.A.clearance") == {"radial": 0.2}
    assert wider.value("joints.B.clearance") == {"radial": 0.2, "law": "boundary"}
    assert wider.value("drives.b") == {"joint": "B", "values": [5]}
    assert reached == [
        "joints.*.clearance.radial: 2 of 3 joints; 1 converted from diametral",
        "drives.*.values: 3 of 3 drives; 1 converted from from, to, count",
    ]
    assert wider == m.with_({"joints.*.clearance.radial": 0.2, "drives.*.values": [5]})
    # The other way round, and nothing to convert the second time.
    both, reached = changed(wider, {"joints.*.clearance.diametral": 0.4, "joints.*.clearance.law": "normal"})
    assert both.value("joints.*.clearance.diametral") == 0.4
    assert reached == [
        "joints.*.clearance.diametral: 2 of 3 joints; 2 converted from radial",
        "joints.*.clearance.law: 1 of 3 joints",
    ]


def test_a_value_is_converted_where_it_is_written_in_the_other_word() -> None:
    m = MIXED.mechanism()
    assert m.value("joints.B.clearance.radial") == 0.15
    with pytest.raises(InputError, match="the values that it matches differ"):
        m.value("joints.*.clearance.radial")
    assert m.with_({"joints.A.clearance.radial": 0.15}).value("joints.*.clearance.radial") == 0.15


def test_diametral_is_twice_radial() -> None:
    one, other = loads(FOUR_BAR), loads(FOUR_BAR.replace("radial = 1.0", "diametral = 2.0"))
    assert one.spec() == other.spec()


def test_the_ways_to_write_a_tolerance() -> None:
    m = loads(FOUR_BAR)
    for tolerance, interval, law in (
        (0.3, (-0.3e-3, 0.3e-3), "normal"),
        ({"plus": 0.2, "minus": 0.1}, (-0.1e-3, 0.2e-3), "normal"),
        ({"sigma": 0.02}, (-0.06e-3, 0.06e-3), "gauss"),
    ):
        source = m.with_({"dimensions.l2.tolerance": tolerance}).spec()["sources"][4]
        assert source["law"] == law
        assert (source["set"]["interval"]["low"], source["set"]["interval"]["high"]) == pytest.approx(interval)
    changed = m.with_({"dimensions.l2.deviation": -0.4, "dimensions.l2.law": "uniform"})
    assert changed.spec()["sources"][4]["law"] == "uniform"
    assert changed.centre[8] == pytest.approx(-0.4e-3)


def test_bodies_drawn_assembled_are_placed_once() -> None:
    """`bodies`, `at`, `axis` in one reference configuration is the same mechanism as places on bodies at the origin."""
    apart = TEXTS["p3r"]
    m = loads(apart.replace("on   = { cylinder = { at = [0, 0], axis = [1, 0] }, rod = [0, 0] }",
                            'bodies = ["cylinder", "rod"]\nat = [0, 0]\naxis = 0'))  # fmt: skip
    assert m.spec() == loads(apart).spec()


def test_a_mounting_angle_is_that_of_the_second_body() -> None:
    m = loads(TEXTS["serial-2r"])
    assert m.drive_values is not None
    output = m.core.trace(m.drive_values)["output"]
    np.testing.assert_allclose(output[:, 2], m.drive_values.sum(axis=1) - np.deg2rad(15), atol=1e-12)


def test_weights_are_forces_at_mass_centres() -> None:
    loads_ = loads(TEXTS["serial-2r"]).spec()["loads"]
    assert [load["force"][1] for load in loads_] == pytest.approx([12, -2.4 * 9.81, -1.5 * 9.81, -0.4 * 9.81])


def test_equal_steps_end_exactly() -> None:
    values = (
        loads(TEXTS["p3r"])
        .with_({"drives.v.from": 0.1, "drives.v.to": 0.7, "drives.v.count": 7})
        .data.drives["v"]
        .commands
    )
    assert values == pytest.approx(np.linspace(0.1, 0.7, 7))
    assert values[-1] == 0.7


def test_the_path_is_in_si_with_gaps_where_nothing_is_asked() -> None:
    m = loads(TEXTS["five-bar"])
    assert m.drive_values is None
    assert m.targets is not None
    assert m.target_components == ("x", "y")
    np.testing.assert_allclose(m.targets[0], [-0.06, 0.19, np.nan])
    assert len(m.start_drives) == 2


def test_what_the_start_leaves_out_follows_from_the_joints() -> None:
    guess = np.array(loads(FOUR_BAR).spec()["guess"])
    tip = 75e-3 * np.array([np.cos(np.deg2rad(22.7)), np.sin(np.deg2rad(22.7))])
    np.testing.assert_allclose(guess[1, :2], tip)
    np.testing.assert_allclose(guess[2], [-0.1, 0.0, np.deg2rad(35.6)])


# -- changed copies ----------------------------------------------------------------------------------------------


def test_values_are_changed_by_dotted_key() -> None:
    m = loads(FOUR_BAR, "four-bar.toml")
    other = m.with_({"joints.*.clearance.radial": np.float64(0.2), "loads.0.force": np.array([1.0, 2.0])}, title="new")
    assert other.value("joints.*.clearance.radial") == 0.2
    assert other.value("loads.*.force") == [1.0, 2.0]
    assert (other.title, other.file) == ("new", "four-bar.toml")
    assert m.value("joints.J1.clearance.radial") == 1.0
    assert m.with_() == m
    assert m.with_({"joints.J1.clearance": None}).sources[0] == "J2"
    assert m.with_({"limits.position": 0.5}).limits.errors["position"][1] == pytest.approx(0.5e-3)
    assert m.with_({"start.crank.angle": 30}).value("start.crank") == {"angle": 30}


def test_a_value_replaces_its_other_way_of_writing() -> None:
    held = loads(TEXTS["p3r"]).with_({"drives.v.values": [100.0]})
    assert held.value("drives.v") == {"joint": "P", "values": [100.0]}
    assert loads(FOUR_BAR).with_({"joints.J1.clearance.diametral": 1}).value("joints.J1.clearance") == {"diametral": 1}


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("joints.J1.clearance.radail", 1, "joints.J1.clearance: 'radail' is not a key here; did you mean 'radial'?"),
        ("joints.J9.clearance.radial", 1, "joints.J9.clearance.radial: 'J9' is not a joint; known: J1"),
        ("followers.cam.backlash", 1, "followers.cam.backlash: 'cam' is not a follower; known: none"),
        ("springs.s.stiffness", 1, "springs.s.stiffness: 's' is not a spring; known: none"),
        ("outputs.tip.at", [1, 2], "outputs.tip.at: 'tip' is not an output; known: none"),
        ("jonts.*.clearance.radial", 1, "the * matches nothing: 'jonts' is not given; did you mean 'joints'?"),
        ("joints.*.clearance.gap", 1, "the * matches nothing: 'gap' is not given in joints.*.clearance; known: radial"),
        ("dimensions.*.law", 1, "'law' is not given in dimensions.*; known:"),
        ("gravity.*", 1, "the * matches nothing: 'gravity' is not given"),
        ("joints..J1", 1, '"joints..J1" is not a dotted key'),
        ("loads.1.force", [1, 2], '"1" is not an index into a list of 1'),
        ("format.a", 1, "format is 1 and has no 'a' below it"),
        ("joints.J1.clearance.radial", float("nan"), "joints.J1.clearance.radial: a finite number is needed, not nan"),
        ("joints.J1.clearance.radial", object(), "joints.J1.clearance.radial: a number is needed"),
        ("drives.theta1.values", [], "drives.theta1.values: the list is empty"),
        ("joints", None, "'joints' is missing"),
    ],
)
def test_a_change_is_checked_like_a_file(key: str, value: object, said: str) -> None:
    with pytest.raises(InputError) as caught:
        loads(FOUR_BAR, "four-bar.toml").with_({key: value})
    assert said in str(caught.value)


def test_a_value_that_is_not_there() -> None:
    m = loads(FOUR_BAR)
    with pytest.raises(InputError, match=r"'radail' is not given in joints\.J1\.clearance; did you mean 'radial'"):
        m.value("joints.J1.clearance.radail")
    with pytest.raises(InputError, match="values that it matches differ"):
        m.value("joints.*.on")
