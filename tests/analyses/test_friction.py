"""The sliding state with friction: against numbers by hand, an independent program, and forces at points of contact."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import jointplay as jp
from helpers.builders import spatial
from helpers.graphs import graph
from helpers.machines import PAPER, drawer, four_bar, lever, wedge
from helpers.rubbing import RSSP, SLIDER_CRANK, contacts, powers, with_friction
from jointplay import examples
from jointplay.analyses.displaced import at_offsets
from jointplay.analyses.friction.laws import contacts as of_joints
from jointplay.analyses.nominal import nominal
from jointplay.basics import poses
from jointplay.cli import run
from jointplay.model.inertia import kinematics


@pytest.mark.parametrize(
    ("approach", "x", "torque"),
    [
        ("forward", [-0.08074864, -0.07779778, -0.07491610], [-3628.24407, -7375.18904, -5469.24482]),
        ("backward", [-0.08036635, -0.07749702, -0.08377731], [-5211.37594, -9213.64924, -6841.65592]),
        (None, [-0.08089179, -0.07799368, -0.07568259], [-4403.89181, -8232.42773, -6123.10525]),
    ],
)
def test_slider_crank_as_an_independent_program_has_it(approach, x, torque):
    """At 120 deg backward friction tilts the slider; without it and forward the slider lies on one face."""
    result = jp.loaded(SLIDER_CRANK, approach=approach)
    assert_allclose(result.error.sel(component="x"), x, atol=6e-9)
    assert_allclose(result.drive_torque[:, 0], torque, atol=6e-6)
    tilts = [True, False, approach == "backward"]
    assert_allclose(result.error.sel(component="angle"), np.where(tilts, -0.05729578, 0.0), atol=6e-9)
    assert_allclose(result.error.sel(component="y"), np.where(tilts, -0.04998999, -0.03), atol=6e-9)


def test_efficiency_and_reversal():
    forward, backward = (jp.loaded(SLIDER_CRANK, approach=side) for side in ("forward", "backward"))
    # Forward the load drives, backward the motor works.
    assert_allclose(forward.efficiency[0], 3628.24407 / 4403.89181, rtol=1e-8)
    assert_allclose(backward.efficiency[0], 4403.89181 / 5211.37594, rtol=1e-8)
    assert_allclose(forward.reversal.sel(component="x"), [-0.00038229, -0.00030076, 0.00886121], atol=6e-9)
    assert_allclose(forward.reversal, forward.error - backward.error, atol=1e-15)
    assert_allclose(backward.reversal, forward.reversal, atol=0.0)
    assert_allclose(forward.drive_torque_other, backward.drive_torque, atol=0.0)
    assert_allclose(forward.friction_share.sum("joint"), 1.0)


@pytest.mark.parametrize("holes", ["second", "first"])
def test_it_counts_which_body_has_the_hole(holes):
    """The reversal error changes its sign when pin and hole change places."""
    m = four_bar(holes=holes)
    expected = np.array([pair[holes == "first"] for pair in PAPER.values()])
    # Exchanged, the drive counts the other way, and the path is the same.
    for k, side in enumerate(("forward", "backward")):
        result = jp.loaded(m, approach=side)
        assert_allclose(result.error.sel(component="angle"), expected[:, k], atol=6e-7)


@pytest.mark.parametrize("radial", [0.0, 0.5])
@pytest.mark.parametrize("torque", [0.0, 7.0])
def test_friction_circle_of_a_lever(radial, torque):
    """The hole is in the lever: the force of the pin touches the circle about its centre."""
    mu = 0.2
    m = lever(radial, mu, torque)
    circle = 20.0 * math.sin(math.atan(mu))
    for side, sign in (("forward", 1.0), ("backward", -1.0)):
        result = jp.loaded(m, approach=side).isel(configuration=0)
        assert_allclose(result.drive_torque[0], 50.0 * 100.0 + sign * (50.0 * circle + torque), rtol=1e-13)
        turn = -math.pi / 2 + sign * math.atan(mu)
        where = [radial * math.cos(turn), radial * math.sin(turn)]
        assert_allclose(result.error.sel(component=["x", "y"]), where, atol=1e-13)


@pytest.mark.parametrize("mu", [0.05, 0.2, 0.39])
def test_a_drawer_that_is_pushed_beside_its_line(mu):
    """P = F / (1 - 2 mu e / L), and with the load there in place of the hand P = F (1 + 2 mu e / L), without tilt."""
    pushed = jp.loaded(drawer(mu, push=100, load=0), approach="forward")
    assert_allclose(pushed.drive_torque, 10.0 / (1.0 - 2.0 * mu * 100.0 / 80.0), rtol=1e-6)
    loaded = jp.loaded(drawer(mu, push=0, load=100), approach="forward")
    assert_allclose(loaded.drive_torque, 10.0 * (1.0 + 2.0 * mu * 100.0 / 80.0), rtol=1e-6)


@pytest.mark.parametrize("mu", [0.41, 0.6, 3.0])
def test_a_drawer_jams_where_its_guide_is_shorter_than_twice_mu_times_the_lever(mu):
    """From mu = L / (2 e) = 0.4 on, however far beyond; with the load beside the line it never does."""
    result = jp.loaded(drawer(mu, push=100, load=0), approach="forward")
    assert (result.status == "jammed").all()
    assert (result.jam_joint == "guide").all()
    assert_allclose(result.jam_coefficient, 0.4, rtol=1e-4)
    assert np.isnan(result.error).all()
    free = jp.loaded(drawer(mu, push=0, load=100), approach="forward")
    assert (free.status == "ok").all()


@pytest.mark.parametrize(
    ("mu", "raises", "lowers"),
    [(0.05, 48.1800931, 25.4435696), (0.1, 61.0910265, 15.0857574), (0.15, 75.5239157, 5.1330967)],
)
def test_wedge(mu, raises, lowers):
    """W (tan(a + phi) + mu) / (1 - mu tan(a + phi)); driven to the left, a face that rises to the right lifts."""
    m = wedge(20.0, mu)
    down, up = (float(jp.loaded(m, approach=side).drive_torque[0, 0]) for side in ("forward", "backward"))
    assert_allclose([-up, -down], [raises, lowers], rtol=1e-8)


@pytest.mark.parametrize(("seed", "sign"), [(seed, sign) for seed in range(60) for sign in (1.0, -1.0)])
def test_forces_at_points_of_contact_balance_every_body(seed, sign):
    m = with_friction(jp.loads(graph(seed)), seed)
    status = str(jp.loaded(m, approach="forward" if sign > 0.0 else "backward").status[0])
    if status not in ("ok", "undetermined"):
        return
    found = contacts(m, sign)
    assert found.unbalanced < 1e-11
    assert_allclose(found.ratio, 0.0, atol=1e-9)
    assert_allclose(found.along, -1.0, atol=1e-6)
    if status == "ok":
        assert_allclose(found.pulling, 0.0, atol=1e-7)


@pytest.mark.parametrize("seed", [*range(40)])
def test_little_friction_changes_in_proportion(seed):
    m = with_friction(jp.loads(graph(seed, 1e-3)), seed)
    names = [f"joints.{name}.friction.coefficient" for name in m.raw["joints"]]
    without = jp.loaded(m)
    if without.status != "ok":
        return
    changes = []
    for part in (1e-5, 2e-5):
        result = jp.loaded(m.with_({name: part * m.value(name) for name in names}), approach="forward")
        assert result.status == "ok"
        changes.append((result.error - without.error).values / part)
    scale = np.abs(changes[0]).max() + 1e-6 * m.length / m.units.length
    assert_allclose(changes[1], changes[0], atol=1e-3 * scale)


def test_lost_motion_of_a_drive_is_at_the_end_where_the_load_with_friction_presses():
    m = SLIDER_CRANK.with_({"drives.q.backlash": 0.2, "drives.q.values": [30.0]})
    plain = SLIDER_CRANK.with_({"drives.q.values": [30.1]})
    both = [jp.loaded(one, approach="forward") for one in (m, plain)]
    shift = both[1].nominal - jp.loaded(m).nominal.values
    assert_allclose(both[0].error, both[1].error + shift, atol=2e-8)


def test_the_path_says_what_is_forward():
    back = SLIDER_CRANK.with_({"drives.q.values": [120, 75, 30]})
    here, there = jp.loaded(SLIDER_CRANK, approach="forward"), jp.loaded(back, approach="backward")
    assert_allclose(here.error, there.error[::-1], atol=1e-12)
    moving = SLIDER_CRANK.with_({"drives.q.speed": -1.0})
    assert_allclose(jp.loaded(moving, approach="backward").error, here.error, atol=1e-12)


def test_limits_are_judged_from_both_sides():
    m = SLIDER_CRANK.with_({"limits.position": 0.0952})
    forward = jp.loaded(m, approach="forward")
    assert not forward.limit_met.sel(quantity="position")[2]
    assert jp.loaded(m).limit_met.all()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"joints.*.friction": None}, "no joint has `friction`"),
        ({"joints.wrist.friction": {"coefficient": 0.1}}, "joints.wrist: friction: 'diameter' is missing"),
        ({"joints.wrist.friction": {"diameter": 10}}, "say what holds it back"),
        ({"joints.wrist.clearance": {"bearing": "CN", "bore": 20}}, "the balls of a bearing roll"),
        ({"joints.guide.type": "fixed", "joints.guide.clearance": None}, "nothing slides in a fixed joint"),
        ({"joints.wrist.stiffness": {"radial": 1e4}}, "elastic or over-constrained"),
    ],
)
def test_what_is_refused(changes, words):
    with pytest.raises(jp.InputError) as told:
        jp.loaded(SLIDER_CRANK.with_(changes), approach="forward")
    assert words in str(told.value)


def test_commands_ask_for_a_direction(tmp_path, capsys):
    SLIDER_CRANK.write(tmp_path / "crank.toml")
    file = str(tmp_path / "crank.toml")
    assert run(["error", file, "-q", "loaded", "--approach", "backward"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Coming from the other side, the output differs by up to 0.02187 mm at configuration 2" in said
    assert run(["error", file, "-q", "loaded"]) == 0
    assert "Without friction; `--approach forward` counts that of the file." in capsys.readouterr().out
    changes = "joints.shaft.friction.torque=0:300:2"
    assert run(["sweep", file, "--set", changes, "-q", "loaded", "--approach", "forward"]) == 0
    assert "N mm" in capsys.readouterr().out
    assert run(["error", file, "-q", "worst", "--approach", "forward"]) == 2


def test_unknown_direction():
    with pytest.raises(jp.InputError, match="sideways"):
        jp.loaded(SLIDER_CRANK, approach="sideways")


SPATIAL_LEVER = spatial()
SPATIAL_LEVER.revolute(
    "pin",
    ground={"at": (0, 0, 0), "axis": (0, 0, 1), "side": (1, 0, 0)},
    lever={"at": (0, 0, 0), "axis": (0, 0, 1), "side": (1, 0, 0)},
    clearance=jp.radial(0.5, axial=0.1, length=60),
    friction={"coefficient": 0.2, "diameter": 40, "collar": (40, 60), "torque": 3},
)
SPATIAL_LEVER.drive("q", joint="pin", values=[0])
SPATIAL_LEVER.output(body="lever", at=(100, 0, 0))
SPATIAL_LEVER.load(at=(100, 0, 0), force=(0, -50, 0))
SPATIAL_LEVER.load(at=(0, 0, 0), force=(0, 0, -30))


def test_friction_circle_and_collar_of_a_lever_in_space():
    """Both ends share the load, and the collar has the lever of a pressure that is the same all over."""
    m = SPATIAL_LEVER.mechanism()
    mu, lever = 0.2, 2.0 / 3.0 * (30.0**3 - 20.0**3) / (30.0**2 - 20.0**2)
    friction = 50.0 * 20.0 * math.sin(math.atan(mu)) + mu * 30.0 * lever + 3.0
    for side, sign in (("forward", 1.0), ("backward", -1.0)):
        result = jp.loaded(m, approach=side).isel(configuration=0)
        assert_allclose(result.drive_torque[0], 5000.0 + sign * friction, rtol=1e-9)
        turn = -math.pi / 2 + sign * math.atan(mu)
        where = [0.5 * math.cos(turn), 0.5 * math.sin(turn), -0.1]
        assert_allclose(result.error.sel(component=["x", "y", "z"]), where, atol=1e-9)


def rail(**load: Any) -> jp.Mechanism:
    b = spatial()
    place = {"at": [0, 0, 0], "axis": [1, 0, 0], "side": [0, 1, 0]}
    b.prismatic(
        "rail",
        ground=place,
        slider=place,
        clearance=jp.gap(1e-7, length=80, width=30, height=20),
        friction={"coefficient": 0.15, "force": 2},
    )
    b.drive("q", joint="rail", values=[10])
    b.output(body="slider")
    b.load(**load)
    return b.mechanism()


@pytest.mark.parametrize(
    ("y", "z", "fy", "fz"), [(100.0, 0.0, 0.0, 0.0), (50.0, 70.0, 0.0, 0.0), (0.0, 0.0, 40.0, -7.0)]
)
def test_slider_in_space(y, z, fy, fz):
    """Each pair of faces bears max(|F|, 2 |M| / L), where friction at the faces has no moment of its own."""
    result = jp.loaded(rail(at=(0, y, z), force=(-10, fy, fz)), approach="forward").isel(configuration=0)
    if fy:
        # Friction at the faces tilts the slider about its middle, not enough to lift an end.
        assert_allclose(result.drive_torque[0], 10.0 + 2.0 + 0.15 * (abs(fy) + abs(fz)), rtol=1e-6)
    else:
        assert_allclose(result.drive_torque[0], 10.0 + 2.0 + 0.15 * 2.0 * 10.0 * (y + z) / 80.0, rtol=1e-6)


@pytest.mark.parametrize(("across", "half"), [(0, 15.0), (1, 10.0)])
def test_friction_at_the_faces_of_a_slider_tilts_it(across, half):
    """Pressed beyond its end, F x +- mu F h is borne at both ends, h from the middle to the face."""
    pressed = [0.0, 0.0, 0.0]
    pressed[1 + across] = 40.0
    m = rail(at=(60.0, 0.0, 0.0), force=pressed)
    for side, sign in (("forward", 1.0), ("backward", -1.0)):
        borne = 2.0 * 40.0 * (60.0 + sign * 0.15 * half) / 80.0
        torque = float(jp.loaded(m, approach=side).drive_torque[0, 0])
        assert_allclose(torque, sign * (2.0 + 0.15 * borne), rtol=1e-6)


@pytest.mark.parametrize(("moment", "gap"), [(500.0, 0.03), (-500.0, 0.03), (500.0, None), (8.0, 0.03)])
def test_slider_that_a_moment_about_its_axis_rolls(moment, gap):
    """The faces that F presses bear F h of it along their edges; the rest rolls it onto those of the longer lever."""
    sizes = {"length": 80, "width": 30, "height": 20}
    clearance = {"gap": gap, **sizes} if gap else None
    rubs = {"coefficient": 0.15, "force": 2, **sizes}
    m = rail(force=(-10, 1, 0), moment=(moment, 0, 0))
    m = m.with_({"joints.rail.clearance": clearance, "joints.rail.friction": rubs})
    # Friction at the ends of edges tilts the slider, so that its other faces press as well.
    upright = 0.0
    for _ in range(60):
        upright = 2.0 * 0.15 * 10.0 * min(abs(moment) / (10.0 + 15.0 * upright), 1.0) / 80.0
    more = max(abs(moment) - 10.0 - 15.0 * upright, 0.0) / 15.0
    for side, sign in (("forward", 1.0), ("backward", -1.0)):
        result = jp.loaded(m, approach=side).isel(configuration=0)
        assert_allclose(result.drive_torque[0], 10.0 + sign * (2.0 + 0.15 * (1.0 + upright + more)), rtol=1e-6)
        # The drive pushes on, and the load against, where a gap of 0.03 mm displaces the slider.
        roll = math.copysign(math.degrees(gap / 15.0), moment) if gap and more else 0.0
        assert_allclose(result.error.sel(component="rx"), roll, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_offsets_of_a_slider_are_where_their_force_does_most_work(seed):
    """y less the nearest offsets v is a force whose work is the largest on v: c max(rolled, not rolled)."""
    rng = np.random.default_rng([11, seed])
    height, width = rng.uniform(5.0, 40.0, 2)
    sizes = {"gap": 0.5, "length": 80, "width": width, "height": height}
    m = rail(force=(-10, 1, 0)).with_({"joints.rail.clearance": sizes})
    (slider,) = of_joints(m, m.centre)
    y = rng.normal(size=(2000, 5)) * 10.0 ** rng.uniform(-1.0, 1.0, (2000, 1)) * 5e-4
    v = slider.nearest(y, 1.0)
    h, w = height / 2e3, width / 2e3
    turn = np.abs(v[:, 4]) / m.length
    assert (np.abs(v[:, :2]) <= 5e-4 - h * turn[:, None] + 1e-15).all()
    assert (np.abs(v[:, 2:4]) <= 5e-4 - w * turn[:, None] + 1e-15).all()
    force = y - v
    a, b, moment = np.abs(force[:, :2]).sum(axis=1), np.abs(force[:, 2:4]).sum(axis=1), np.abs(force[:, 4]) * m.length
    most = 5e-4 * (a + b + np.maximum(moment - h * a - w * b, 0.0) / max(h, w))
    assert_allclose((force * v).sum(axis=1), most, atol=1e-12 * 5e-4)
    assert (moment > h * a + w * b).mean() > 0.05


@pytest.mark.parametrize("side", ["forward", "backward"])
def test_power_where_legs_roll_in_their_guides(side):
    """By equilibrium, and by what friction does at the speeds of the joints."""
    m = jp.loads(jp.examples.text("3-upu"))
    universal = {name for name, joint in m.raw["joints"].items() if joint["type"] == "universal"}
    m = m.with_({f"joints.{name}.friction": {"torque": 50} if name in universal else 0.1 for name in m.raw["joints"]})
    taken, lost = powers(m, side)
    assert taken.max() > 0.0
    # Speeds are those of the nominal poses, without the play.
    assert_allclose(taken, lost, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("side", ["forward", "backward"])
def test_balls_touch_at_points_whose_forces_balance_the_rod(side):
    """Friction is against the sliding there; both forces have one line, so that they cannot spin the rod."""
    m = RSSP
    result = jp.loaded(m, approach=side)
    at = nominal(m)
    placed = at_offsets(m, at, result.offset.values)
    sign = 1.0 if side == "forward" else -1.0
    twists = kinematics(m, at.drives, at.poses, np.full((2, len(at), 1), [[[sign]], [[0.0]]])).velocity[..., 3:]
    rod = m.bodies.index("rod")
    for k in range(len(at)):
        points, lines = [], []
        for name in ("A", "B"):
            joint = m.joints.index(name)
            ends = [m.points[p] for p in m.joint_points[joint]]
            p1, p2 = (poses.place(placed.poses[k, end.body], end.at) * 1e3 for end in ends)
            u = (p2 - p1) / np.linalg.norm(p2 - p1)
            assert_allclose(np.linalg.norm(p2 - p1), 0.015, rtol=1e-9)
            force, moment = np.split(result.reaction.values[k, joint], 2)
            contact = -9.0 * u
            assert_allclose(moment, np.cross(contact, force), atol=1e-9 * np.linalg.norm(force))
            normal = -float(force @ u)
            tangent = force + normal * u
            assert normal > 0.0
            assert_allclose(np.linalg.norm(tangent), 0.1 * normal, rtol=1e-9)
            # With the spin of a rod that turns by the mean of its neighbours.
            w = [twists[k, end.body] for end in ends]
            line = poses.matrix(at.poses[k, rod])[:, 0]
            spin = line @ twists[k, m.bodies.index("crank")] / 2.0
            w[0 if name == "B" else 1] = w[0 if name == "B" else 1] + (spin - line @ twists[k, rod]) * line
            speed = np.cross(w[1] - w[0], contact)
            speed -= (speed @ u) * u
            assert_allclose(tangent @ speed, -np.linalg.norm(tangent) * np.linalg.norm(speed), rtol=1e-9)
            points.append(p2 + contact)
            lines.append(force)
        # The rod bears both forces and nothing else.
        assert_allclose(lines[0], lines[1], atol=1e-9 * np.linalg.norm(lines[0]))
        arm = np.cross(points[1] - points[0], lines[0])
        assert_allclose(arm, 0.0, atol=1e-9 * 120.0 * np.linalg.norm(lines[0]))


def test_the_largest_play_is_judged_from_both_sides():
    """With the play of one side only, a limit could hold that the machine misses coming from the other."""
    m = jp.loads(jp.examples.text("four-bar-fits"))
    changes = {f"joints.{name}.friction": {"coefficient": 0.2} for name in m.raw["joints"]}
    m = m.with_({**changes, "drives": {"theta1": {"joint": "J1", "values": [30.0, 60.0]}}})
    result = jp.loaded(m, approach="forward")
    for play in ("largest", "smallest"):
        both = [jp.loaded(m, approach=side, sizes=play).error for side in ("forward", "backward")]
        assert np.abs(both[0] - both[1]).max() > 1e-4
        for side, end in (("low", np.minimum), ("high", np.maximum)):
            found = result[f"play_{play}"].sel(side=side, quantity=list(m.components))
            assert_allclose(found, end(*(error.values for error in both)), rtol=1e-12)


def test_a_coefficient_for_the_file() -> None:
    """Joints that name none take that of the file; one that has its own keeps it, and a ball bearing rolls."""
    text = examples.text("five-bar-friction")
    each = jp.loads(text)
    none = each.with_({f"joints.{name}.friction.coefficient": None for name in "ABCD"} | {"friction": 0.15})
    same = [jp.loaded(m, approach="forward") for m in (each, none)]
    np.testing.assert_array_equal(same[0].error, same[1].error)
    np.testing.assert_array_equal(same[0].reversal, same[1].reversal)
    twice = jp.loaded(none.with_({"friction": 0.3}), approach="forward")
    assert (abs(twice.reversal) > abs(same[0].reversal)).any()
    rolls = none.with_({"joints.A.friction": None, "joints.A.clearance": {"bearing": "C3", "bore": 20}})
    assert rolls.data.joints["A"].rubs is None
    with pytest.raises(jp.InputError, match=r"joints\.A: friction: 'diameter' is missing"):
        none.with_({"joints.A.friction": None})


def test_a_plate_is_refused():
    """It tilts in two directions between the same faces: which of its corners touch is not decided by its offsets."""
    b = spatial()
    for k, (low, middle) in enumerate(
        [([-120, 0, 20], [-30, 0, 20]), ([0, -90, 10], [0, -20, 10]), ([60, -90, 9], [60, -20, 9])]
    ):
        b.spherical(f"lower{k}", bodies=["ground", f"rod{k}"], at=low)
        b.spherical(f"upper{k}", bodies=[f"rod{k}", "part"], at=middle)
    plate = jp.gap(0.04, size=[60, 40])
    b.planar("plate", bodies=["ground", "part"], at=(0, 0, 0), axis=(0, 0, 1), clearance=plate)
    b.output(body="part", at=(80, 30, 10))
    b.load(force=(1, 2, -30))
    m = b.mechanism().with_({"joints.lower0.friction": {"coefficient": 0.1, "diameter": 10}})
    with pytest.raises(jp.InputError, match=r"joints\.plate\.clearance: friction is not computed .* of a planar joint"):
        jp.loaded(m, approach="rest")
