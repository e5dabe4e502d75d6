"""Loads in body axes, and loads that change along the path."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jointplay as jp
from helpers.answers import example, refusal


def turned(force: list[float], angle: float) -> list[float]:
    c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    return [c * force[0] - s * force[1], s * force[0] + c * force[1]]


@pytest.mark.parametrize(("body", "axes"), [("coupler", "body"), ("coupler", "rocker"), ("rocker", "body")])
def test_a_follower_is_the_load_turned_by_the_exact_pose(body: str, axes: str) -> None:
    """The same reactions and errors as under a load in ground axes along where the body really points."""
    load = {"body": body, "at": [40, 15], "force": [3, -10], "moment": 25}
    m = example("four-bar", loads=[load | {"axes": axes}])
    found = jp.loaded(m)
    carrier = body if axes == "body" else axes
    for k in (0, 5, 10):
        offsets = found.offset[k].values
        one = m.with_({"drives.theta1.values": [found.theta1[k].item()]})
        seen = one.with_({"output": {"body": carrier, "at": [0, 0]}, "loads": []})
        pose = jp.given(seen, offsets=offsets)
        angle = float((pose.nominal + pose.error).sel(component="angle")[0])
        dead = jp.loaded(one.with_({"loads": [load | {"force": turned(load["force"], angle)}]}))
        np.testing.assert_allclose(found.reaction[k], dead.reaction[0], rtol=0, atol=1e-8)
        np.testing.assert_allclose(found.error[k], dead.error[0], rtol=0, atol=1e-10)


def test_lanes_follow_as_the_plain_solver_does() -> None:
    """200 configurations are solved on lanes, 5 of them alone by the plain solver."""
    values = np.linspace(20, 80, 200).tolist()
    m = example("four-bar", loads=[{"body": "coupler", "at": [20, 9], "force": [3, -10], "axes": "body"}])
    many = jp.loaded(m.with_({"drives.theta1.values": values}))
    few = jp.loaded(m.with_({"drives.theta1.values": values[::40]}))
    np.testing.assert_allclose(many.error[::40], few.error, rtol=0, atol=1e-11)
    np.testing.assert_allclose(many.reaction[::40], few.reaction, rtol=0, atol=1e-8)


def test_a_follower_in_space_turns_with_its_body() -> None:
    """The load on an arm in space, given in its own axes, is that in ground axes at each exact pose."""
    m = example("serial-6r", loads=[{"force": [1, 2, -30], "moment": [50, -20, 10], "axes": "body"}])
    m = m.with_({f"joints.{name}.clearance": None for name in m.raw["joints"] if name != "J2"})
    found = jp.loaded(m)
    for k in range(len(found.configuration)):
        nominal, error = (
            Rotation.from_rotvec(np.deg2rad(found[name][k].sel(component=["rx", "ry", "rz"])))
            for name in ("nominal", "error")
        )
        turn = error * nominal
        force, moment = (turn.apply(m.value(f"loads.0.{name}")).tolist() for name in ("force", "moment"))
        dead = jp.loaded(m.with_({"loads": [{"force": force, "moment": moment}]}))
        np.testing.assert_allclose(found.reaction[k], dead.reaction[k], rtol=1e-8, atol=1e-6)
        np.testing.assert_allclose(found.error[k], dead.error[k], rtol=0, atol=1e-9)


FORCES = [[0, -10], [5, -12], [8, 3]]
MOMENTS = [0, 300, -200]


def along_the_path() -> tuple[jp.Mechanism, list[jp.Mechanism]]:
    """A four-bar whose load has a value per configuration, and one mechanism for each of these."""
    m = example("four-bar", drives__theta1__values=[25, 40, 55])
    m = m.with_({"loads": [{"force": FORCES, "moment": MOMENTS}, {"body": "coupler", "force": [1, -1]}]})
    one = lambda k: {"loads": [{"force": FORCES[k], "moment": MOMENTS[k]}, {"body": "coupler", "force": [1, -1]}]}  # noqa: E731
    return m, [m.with_(one(k)) for k in range(3)]


def test_loads_along_the_path_are_one_file_per_configuration() -> None:
    m, each = along_the_path()
    for exact in (True, False):
        found = jp.loaded(m, exact=exact)
        for k, other in enumerate(each):
            alone = jp.loaded(other, exact=exact)
            for name in ("error", "reaction", "offset", "contribution", "undetermined"):
                np.testing.assert_allclose(found[name][k], alone[name][k], rtol=1e-11, atol=1e-11)


def test_random_and_compensate_take_the_load_of_their_configuration() -> None:
    m, last = (one.with_({"dimensions.l2.tolerance": 0.05}) for one in (along_the_path()[0], along_the_path()[1][2]))
    drawn, alone = (jp.random(one, samples=500, contact="loaded") for one in (m, last))
    np.testing.assert_allclose(drawn.error_mean[2], alone.error_mean[2], rtol=1e-11)
    np.testing.assert_allclose(drawn.error_std[2], alone.error_std[2], rtol=1e-9)
    corrected, alone = jp.compensate(m), jp.compensate(last)
    np.testing.assert_allclose(corrected.drive_corrected[2], alone.drive_corrected[2], rtol=1e-11)


def test_an_assembly_takes_the_load_of_its_configuration() -> None:
    m, each = along_the_path()
    steps = {"assembly": {"base": "ground", "steps": [["crank"], ["coupler", "rocker"]]}}
    found, alone = (jp.assemble(one.with_(steps), configuration=2) for one in (m, each[2]))
    np.testing.assert_array_equal(found.error_shaft, alone.error_shaft)
    other = jp.assemble(each[0].with_(steps), configuration=2)
    assert np.nanmax(np.abs(other.error_shaft - found.error_shaft)) > 0.1


def test_an_over_constrained_mechanism_has_loads_along_its_path() -> None:
    m = example("bennett")
    count = len(jp.solve(m).configuration)
    forces = [[5.0, float(k), -20.0] for k in range(count)]
    found = jp.loaded(m.with_({"loads.0.force": forces}))
    alone = jp.loaded(m.with_({"loads.0.force": forces[-1]}))
    np.testing.assert_allclose(found.error[-1], alone.error[-1], rtol=0, atol=1e-9)
    assert "clearance_factor" in found


@pytest.mark.parametrize(
    ("load", "told"),
    [
        ("force = [[0, -10], [0, -12]]", "loads.0.force: 2 values for 1 configuration; one for each is needed"),
        ("moment = [1, 2, 3]", "loads.0.moment: 3 values for 1 configuration; one for each is needed"),
        ("moment = []", "loads.0.moment: the list is empty; at least one value is needed"),
        ('force = [[0, "x"]]', 'loads.0.force.0.1: a number is needed, not "x"'),
        ("force = [[0, 1, 2]]", "loads.0.force.0: 2 values are needed, not [0, 1, 2]"),
        ('force = [0, 1]\naxes = "crnk"', "loads.0.axes: 'crnk' is not axes; did you mean 'crank'?"),
        ("force = [0, 1]\naxes = 3", "loads.0.axes: a text in quotes is needed, not 3"),
    ],
)
def test_what_is_said_of_a_load_that_does_not_do(load: str, told: str) -> None:
    said = refusal(
        f"""
        format = 1
        units = {{ length = "mm", angle = "deg", force = "N" }}
        [joints.J]
        type = "revolute"
        on = {{ ground = [0, 0], crank = [0, 0] }}
        [drives.q]
        joint = "J"
        values = [10]
        [output]
        body = "crank"
        at = [50, 0]
        [[loads]]
        {load}
        """
    )
    assert said.startswith(f"file.toml: {told}"), said


MAPPED = """
format = 1
units = { length = "mm", angle = "deg", force = "N" }
[joints]
J = { type = "revolute", on = { ground = [0, 0], crank = [0, 0] } }
[drives]
q = { joint = "J", values = [10, 20] }
[grid]
q = { from = 0, to = 90, count = 4 }
[output]
body = "crank"
at = [50, 0]
[[loads]]
force = [[0, -1], [0, -2]]
"""


def test_a_grid_has_one_load_for_all_nodes() -> None:
    said = refusal(MAPPED)
    assert "loads.0.force: a list has a value per configuration; with a [grid] there is one for all nodes" in said


def test_expressions_stand_in_lists_of_loads() -> None:
    m = example("four-bar", variables={"f": 5}).with_(
        {"drives.theta1.values": [25, 40], "loads.0.moment": ["2 * f", "f"]}
    )
    m = m.with_({"loads.0.force": [[0, "-f"], ["f", 0]]})
    assert m.data.loads[0].force == ((0, -5), (5, 0))
    assert m.data.loads[0].moment == (10, 5)
