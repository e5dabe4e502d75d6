"""Springs between bodies: the pose under them has the least energy, found by an independent optimiser."""

import itertools
from itertools import product
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example, refusal
from helpers.builders import planar, spatial
from helpers.oracles.forces import SprungLinkage
from helpers.oracles.linkage import Point
from helpers.oracles.load_optimiser import load_pose
from helpers.oracles.reading import read
from helpers.strategies import mechanism, turn

KINDS = ["four_bar", "slider_crank", "five_bar", "three_rrr", "watt"]


def sprung(kind: str, seed: int) -> tuple[SprungLinkage, jp.Mechanism]:
    """A random mechanism with two springs and a torsion spring."""
    text = mechanism(kind, seed, tolerances=False, configurations=3)
    link, rng = read(text), np.random.default_rng(seed)
    body = link.output.body
    size, force = link.length, max(max(abs(fx), abs(fy)) for _, fx, fy, _ in link.loads)
    first = Point("ground", tuple((size * rng.uniform(-1, 1, 2)).tolist()))
    ends = [Point(body, tuple((size * rng.uniform(-0.3, 0.3, 2)).tolist())) for _ in range(2)]
    low = Point("ground", tuple((size * rng.uniform(-1, 1, 2)).tolist()))
    joint = next(k for k, j in enumerate(link.joints) if j.kind == "revolute")
    springs = [
        (first, ends[0], 3 * force / size, 0.4 * size, 0.0),
        (low, ends[1], force / size, 1.2 * size, 0.3 * force),
    ]
    turned = float(link.coordinate(list(link.nominal(link.configurations[0])), joint, link.centre))
    torsions = [(joint, 0.4 * force * size, turned - 0.7, 0.1 * force * size)]
    tables: dict[str, Any] = {
        f"s{k}": {
            "on": {a.body: list(a.at), b.body: list(b.at)},
            "stiffness": stiffness,
            "free_length": free,
            "preload": preload,
        }
        for k, (a, b, stiffness, free, preload) in enumerate(springs)
    }
    degree = np.pi / 180 if link.degrees else 1.0
    tables["turning"] = {
        "joint": link.joints[joint].name,
        "stiffness": torsions[0][1] * degree,
        "free_angle": torsions[0][2] / degree,
        "preload": torsions[0][3],
    }
    return SprungLinkage.of(link, springs=springs, torsions=torsions), jp.loads(text).with_({"springs": tables})


@pytest.mark.parametrize(("kind", "seed"), [*product(KINDS, range(3))])
def test_the_pose_has_the_least_energy(kind: str, seed: int) -> None:
    """Against the largest work of loads less energy of springs over all poses and offsets (IPOPT)."""
    link, m = sprung(kind, seed)
    result = jp.loaded(m)
    for k, q in enumerate(link.follow()):
        if result.status[k].item() != "ok":
            continue
        best = load_pose(link, q, link.configurations[k])
        error = result.error[k].values
        np.testing.assert_allclose(error[:2], best.error[:2], rtol=0, atol=1e-7 * link.length)
        assert abs(turn(error[2], np.rad2deg(best.error[2]))) < 1e-6
    assert (result.status == "ok").any()


def test_lanes_know_springs_as_the_plain_solver_does() -> None:
    for kind, seed in itertools.product(["four_bar", "slider_crank"], range(2)):
        _, m = sprung(kind, seed)
        (name,) = m.drives
        low, high = (float(jp.solve(m)[name][k]) for k in (0, -1))
        values = np.linspace(low, high, 130).tolist()
        many, few = (
            jp.loaded(m.with_({f"drives.{name}": {"joint": m.joints[m.drive_joints[0]], "values": v}}))
            for v in (values, values[::13])
        )
        size = float(np.abs(few.error).max())
        np.testing.assert_allclose(many.error[::13], few.error, rtol=0, atol=1e-10 * size)
        np.testing.assert_allclose(many.reaction[::13], few.reaction, rtol=1e-8, atol=1e-7)


@pytest.mark.parametrize("free", [-95, -60, 100, 195])
def test_lanes_know_deflections_up_to_half_a_turn(free: float) -> None:
    """On lanes an angle is found by halving its tangent; the plain solver has the arc tangent."""
    m = example("four-bar", springs={"t": {"joint": "J1", "stiffness": 4, "free_angle": free}})
    values = np.linspace(22, 76, 130).tolist()
    many, few = (jp.loaded(m.with_({"drives.theta1.values": v})) for v in (values, values[::13]))
    assert (many.status == "ok").all()
    np.testing.assert_allclose(many.reaction[::13], few.reaction, rtol=1e-9, atol=1e-9)
    crank = few.reaction.sel(joint="J1", wrench="moment")
    # The drive of the crank holds the torsion spring, whatever else it holds.
    without = jp.loaded(m.with_({"drives.theta1.values": values[::13], "springs.t.stiffness": 0}))
    turned = few.theta1 - free
    np.testing.assert_allclose(crank - without.reaction.sel(joint="J1", wrench="moment"), 4 * turned, rtol=1e-9)


ARM = """
format = 1
units = { length = "mm", angle = "deg", force = "N" }
[joints.J1]
type = "revolute"
on = { ground = [0, 0], arm = [0, 0] }
clearance = { radial = 1.0 }
[drives.q]
joint = "J1"
values = [0, 30]
[output]
body = "arm"
at = [100, 0]
[springs.s]
on = { ground = [0.3, 0.2], arm = [0, 0] }
stiffness = 2
free_length = 0
"""


def test_a_pin_floats_where_its_springs_balance() -> None:
    """The pin touches nothing: it is where the spring has no force, and the joint transmits none."""
    found = jp.loaded(jp.loads(ARM))
    assert (found.status == "ok").all()
    np.testing.assert_allclose(found.offset, [[0.3, 0.2]] * 2, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.reaction, 0, atol=1e-9)
    assert (found.undetermined == 0).all()


def test_two_springs_in_balance_determine_the_middle() -> None:
    """A pin between two springs, in balance where it nominally is, was called undetermined: nothing pushes it there."""
    m = jp.loads(ARM).with_({"springs.s.on.ground": [5, 0], "springs.t": {}} | {"springs.t": BALANCE})
    found = jp.loaded(m)
    np.testing.assert_allclose(found.offset, 0, atol=1e-12)
    assert (found.status == "ok").all()
    assert (found.undetermined == 0).all()


BALANCE = {"on": {"ground": [-5, 0], "arm": [0, 0]}, "stiffness": 2, "free_length": 0}


def test_a_spring_in_space_by_hand() -> None:
    """An arm on a ball joint with play hangs on a spring: the play follows the sum of weight and spring force."""
    b = spatial()
    b.prismatic("J", ground={"at": (0, 0, 0), "axis": (1, 0, 0)}, slider={"at": (0, 0, 0), "axis": (1, 0, 0)})
    b.fixed("B", slider=(0, 0, 0), arm=(0, 0, 0), stiffness={"along": 100, "side": 100, "normal": 100})
    b.drive("q", joint="J", values=(0, 10))
    b.output(body="arm", at=(0, 0, 0))
    b.spring("s", ground=(30, 40, 0), arm=(0, 0, 0), stiffness=150, free_length=20)
    m = b.mechanism()
    found = jp.loaded(m)
    assert (found.status == "ok").all()
    for k, x in enumerate((0.0, 10.0)):
        d = found.error[k, :3].values
        apart = np.array([30, 40, 0]) - [x, 0, 0] - d
        length = np.linalg.norm(apart)
        # The joint's springs carry what the spring pulls.
        np.testing.assert_allclose(100 * d, 150 * (length - 20) * apart / length, rtol=1e-7, atol=1e-7)


CANTILEVER = planar()
CANTILEVER.fixed("A", ground=(0, 0), beam=(0, 0))
CANTILEVER.body("beam", E=210000, area=80, inertia=1067)
CANTILEVER.output(body="beam", at=(500, 0))
CANTILEVER.load(force=(0, -100))
CANTILEVER.spring("s", ground=(500, 300), beam=(500, 0), stiffness=1, free_length=300)


@pytest.mark.parametrize("ratio", [0.01, 0.5, 3.0, 200.0])
def test_a_spring_stiffer_than_the_beam_it_holds(ratio: float) -> None:
    """Beam and spring share the load as their stiffnesses.

    With forces that were constant in every program the tip went to the far side of the spring.
    """
    beam = 3 * 210000 * 1067 / 500**3
    m = CANTILEVER.mechanism().with_({"springs.s.stiffness": ratio * beam})
    found = jp.loaded(m)
    assert found.status.item() == "ok"
    np.testing.assert_allclose(found.error.sel(component="y").item(), -100 / (beam * (1 + ratio)), rtol=1e-6)
    drawn = jp.random(
        m.with_({"dimensions": {"d": {"body": "beam", "between": ["A", "output"], "tolerance": 0.1}}}),
        samples=200,
        contact="loaded",
    )
    assert drawn.failures.sel(outcome="ok").item() == 200
    np.testing.assert_allclose(drawn.error_mean.sel(component="y").item(), -100 / (beam * (1 + ratio)), rtol=1e-3)


def test_springs_load_an_over_constrained_mechanism() -> None:
    """A spring of no stiffness is the dead load along its line: the same reactions on a bar between two pins."""
    bar = example("redundant-bar", loads=[])
    pulled = bar.with_({"springs.s": {"on": {"ground": [200, 500], "bar": "Q"}, "stiffness": 0, "free_length": 0}})
    pulled = pulled.with_({"springs.s.preload": 40})
    found, dead = jp.loaded(pulled), jp.loaded(bar.with_({"loads": [{"force": [0, 40]}]}))
    np.testing.assert_allclose(found.reaction, dead.reaction, rtol=1e-3, atol=0.05)
    assert found.status.values.tolist() == dead.status.values.tolist()


def test_an_assembly_has_its_springs_as_soon_as_both_bodies_are_there() -> None:
    steps = {"base": "ground", "steps": [["crank"], ["coupler", "rocker"]]}
    spring = {"on": {"ground": [0, 200], "rocker": "J3"}, "stiffness": 2, "free_length": 30}
    m = example("four-bar", assembly=steps, loads=[], drives__theta1__values=[40])
    found, loaded = jp.assemble(m.with_({"springs.s": spring})), jp.loaded(m.with_({"springs.s": spring}))
    np.testing.assert_allclose(found.error[-1], loaded.error[0], rtol=0, atol=1e-9)
    assert np.isnan(found.error[0]).all()


def test_check_and_pictures_show_springs() -> None:
    springs = {"s": {"on": {"ground": [0, 200], "rocker": "J3"}, "stiffness": 2, "free_length": 30}}
    springs["t"] = {"joint": "J1", "stiffness": 1.5}
    m = example("four-bar", springs=springs)
    found = jp.check(m)
    assert found.spring.values.tolist() == ["s", "t"]
    assert found.spring_on.values.tolist() == ["ground, rocker", "about J1"]
    assert found.spring_stiffness.values.tolist() == [2, 1.5]
    assert found.spring_unit.values.tolist() == ["N/mm", "N mm/deg"]
    plot = pytest.importorskip("jointplay.plot")
    for drawn in (m, example("serial-6r", springs={"t": {"joint": "elbow", "stiffness": 3}})):
        labels = plot.mechanism(drawn).axes[0].get_legend_handles_labels()[1]
        assert "spring" in labels


@pytest.mark.parametrize("name", ["four-bar", "stewart-gough"])
def test_a_spring_whose_ends_meet_is_drawn_everywhere(name: str) -> None:
    """The report and the studio ended in a traceback, a plot showed nothing: a line without length."""
    from jointplay.plot.springs import POINTS, WIDTH
    from jointplay.show.serving.answers import opened
    from jointplay.show.serving.session import Session

    plot = pytest.importorskip("jointplay.plot")
    m = example(name)
    at = jp.solve(m).nominal[0].values.tolist()[: 2 if name == "four-bar" else 3]
    output = m.data.output
    assert output is not None
    # The ends meet in the first configuration of several.
    m = m.with_({"springs": {"s": {"on": {"ground": at, output.body: output.at}, "stiffness": 1, "free_length": 0}}})
    told = opened(Session(m))["scene"]
    (points,) = (shape["points"] for shape in told["shapes"] if shape["kind"] == "spring")
    assert len(points) == POINTS
    for k, places in enumerate(np.array(told["places"], dtype=float)):
        size = np.ptp(places[points], axis=0).max()
        assert size > 0.5 * WIDTH * told["extent"]
        assert k or size < 1.01 * WIDTH * told["extent"]
    assert '"kind":"spring"' in jp.view(m).html
    drawn = plot.mechanism(m).axes[0]
    (line,) = (line for line in drawn.lines if line.get_label() == "spring")
    assert np.ptp(np.array(line.get_xydata(), dtype=float), axis=0).max() > 0.5 * WIDTH * told["extent"]


ON, ABOUT, FREE = "on = { %s }\nstiffness = 1\n", 'joint = "%s"\nstiffness = 1\n', "free_length = 3\n"


@pytest.mark.parametrize(
    ("spring", "told"),
    [
        ("stiffness = 1", "springs.s: say where it acts: on = { BODY = point, BODY = point }, or joint"),
        (ON % "ground = [0, 0]" + FREE, "springs.s: a spring is on two bodies; on has 1"),
        (ON % "ground = [0, 0], arm = [0, 0]", "springs.s: 'free_length' is missing"),
        (ON % "ground = [0, 0], am = [0, 0]" + FREE, "springs.s.on: 'am' is not a body"),
        (ON % 'ground = "J2", arm = [0, 0]' + FREE, "springs.s.on.ground: 'J2' is not a joint on"),
        (ON % "ground = [0], arm = [0, 0]" + FREE, "springs.s.on.ground: a point [x, y] or the name"),
        (ABOUT % "J2", "springs.s.joint: 'J2' is not a joint; did you mean 'J1'?"),
        (ABOUT.replace("= 1", "= -1") % "J1", "springs.s.stiffness: must not be negative: -1"),
        (ABOUT % "J1" + FREE, "springs.s: free_length is for a spring between two points"),
        (ABOUT % "J1" + "free_angle = 300", "springs.s.free_angle: drive 'q' takes 'J1' 300 deg away from it"),
        (ABOUT % "J1" + "stifness = 1", "springs.s: 'stifness' is not a key here; did you mean 'stiffness'?"),
    ],
)
def test_what_is_said_of_a_spring_that_does_not_do(spring: str, told: str) -> None:
    said = refusal(ARM[: ARM.index("[springs.s]")] + "[springs.s]\n" + spring)
    assert said.startswith(f"file.toml: {told}"), said


def test_nothing_else_loads_a_mechanism_with_a_spring() -> None:
    m = jp.loads(ARM).with_({"springs.s.stiffness": 0})
    assert not m.has_loads
    with pytest.raises(jp.InputError, match=r"nothing loads the mechanism: add \[\[loads\]\].*\[springs.NAME\]"):
        jp.loaded(m)


def test_random_specimens_of_a_platform_on_a_spring() -> None:
    """Rigid specimens took programs of all their joints, a second for each, and did not settle."""
    m = example("stewart-gough")
    spring = {"on": {"ground": [10, 0, -300], m.data.output.body: [5, 0, 3]}, "stiffness": 0.1, "free_length": 10}
    drawn = jp.random(m.with_({"springs": {"s": spring}}), samples=20, contact="loaded")
    assert (drawn.failures.sel(outcome="ok") == 20).all()
