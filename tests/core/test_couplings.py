"""Gears, racks, belts, screws and coupled drives against closed forms, hand calculations and involutes in contact."""

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar, spatial
from helpers.couplings import GROUND, OK, SINGULAR, Machine, pair, planetary
from helpers.lanes import require_lanes_as_one_by_one
from helpers.oracles.trains import Train

TURN = 2 * np.pi
PRESSURE = np.radians(20.0)


def _path(turns, rows):
    return np.linspace(0.0, turns * TURN, rows)[:, None]


def _followed(core, drives):
    """Poses along a path, which `solve` and `trace` agree on."""
    solved, traced = core.trace(drives), core.trace(drives)
    assert (solved["status"] == OK).all()
    assert (traced["status"] == OK).all()
    np.testing.assert_allclose(traced["poses"], solved["poses"], atol=1e-12)
    return traced["poses"]


def _loaded(core, drives, poses=None, **options):
    poses = core.trace(drives)["poses"] if poses is None else poses
    found = core.loaded(drives, poses, **options)
    assert (found["status"] == OK).all()
    return found


# ratios


@pytest.mark.parametrize("teeth", [(20, 40), (97, 101), (12, 180)])
@pytest.mark.parametrize("rows", [12, 400, 3000])
def test_a_gear_pair_keeps_its_teeth_over_many_turns(teeth, rows):
    """Coprime tooth counts leave one tooth for the phase to be wrong by; a step between rows may be five turns."""
    drives = _path(60, rows)
    poses = _followed(pair(teeth).core(), drives)
    np.testing.assert_allclose(poses[:, 1, 2], -drives[:, 0] * teeth[0] / teeth[1], atol=1e-10)


def test_a_ring_turns_the_same_way_as_its_pinion():
    drives = _path(30, 500)
    poses = _followed(pair((30, 90), internal=True).core(), drives)
    np.testing.assert_allclose(poses[:, 1, 2], drives[:, 0] / 3, atol=1e-10)


@pytest.mark.parametrize("crossed", [False, True])
def test_a_belt_keeps_its_ratio_over_many_turns(crossed):
    drives = _path(50, 700)
    poses = _followed(belt(crossed).core(), drives)
    np.testing.assert_allclose(poses[:, 1, 2], (-0.4 if crossed else 0.4) * drives[:, 0], atol=1e-10)


def test_a_rack_moves_by_the_arc_of_its_pinion():
    for above, sign in ((0.02, 1.0), (-0.02, -1.0)):
        drives = _path(5, 700)
        poses = _followed(rack(above).core(), drives)
        np.testing.assert_allclose(poses[:, 1, 0], sign * 0.02 * drives[:, 0], atol=1e-12)


def test_a_screw_moves_by_its_lead():
    for lead in (0.005, -0.0002):
        drives = _path(40, 900)
        poses = _followed(screw(lead).core(), drives)
        np.testing.assert_allclose(poses[:, 1, 2], 0.03 - lead * drives[:, 0] / TURN, atol=1e-12)


@pytest.mark.parametrize("teeth", [(20, 16, 52), (17, 23, 63)])
def test_a_planetary_gear_obeys_willis(teeth):
    """(w_sun - w_arm) / (w_ring - w_arm) = -z_ring / z_sun with the ring at rest; planets turn as it lets them."""
    drives = _path(10, 300)
    core = planetary(teeth=teeth).core()
    poses = _followed(core, drives)
    sun, planet, ring = teeth
    arm = poses[:, 1, 2]
    np.testing.assert_allclose(arm, drives[:, 0] * sun / (sun + ring), atol=1e-10)
    np.testing.assert_allclose(poses[:, 2, 2], arm * (1 - ring / planet), atol=1e-10)


def test_one_drive_moves_several_joints():
    m = Machine(length=0.2)
    m.body(0, 0)
    m.body(0.2, 0)
    first = m.joint("revolute", (GROUND,), (0,))
    second = m.joint("revolute", (0, (0.2, 0)), (1,))
    m.drive(first, also=[(second, -0.5)])
    m.output(1)
    error = m.source("drive", 1e-3, drive=0)
    core = m.core()
    drives = _path(8, 200)
    poses = _followed(core, drives)
    np.testing.assert_allclose(poses[:, 1, 2], 0.5 * drives[:, 0], atol=1e-12)
    # An error of the drive moves both joints, each by its part.
    sensitivity = core.sensitivity(drives[:1], poses[:1])
    np.testing.assert_allclose(sensitivity["source"][0][:, error], sensitivity["drive"][0][:, 0], atol=1e-12)
    np.testing.assert_allclose(sensitivity["drive"][0][2, 0], 0.5, atol=1e-12)
    shift = np.array([[1e-3]])
    found = core.given(drives[:1], poses[:1], shift)["error"][0]
    np.testing.assert_allclose(found, [0.2 * np.cos(1e-3) - 0.2, 0.2 * np.sin(1e-3), 0.5e-3], atol=1e-12)


# lost motion and reactions


def test_lost_motion_of_a_gear_train_is_the_sum_of_its_backlash_over_the_ratios():
    """Three pairs in a row: each backlash over the pitch radius of its wheel, times the ratios behind it."""
    radii, plays = [(0.01, 0.02), (0.012, 0.03), (0.01, 0.04)], [2e-5, 3e-5, 5e-5]
    m = Machine(length=0.1)
    at, first, wheel, lost = 0.0, None, None, 0.0
    for (r1, r2), play in zip(radii, plays, strict=True):
        pinion = m.body(at, 0)
        if first is None:
            first = m.joint("revolute", (GROUND, (at, 0)), (pinion,))
        else:
            m.joint("fixed", (wheel,), (pinion,))
        at += r1 + r2
        wheel = m.body(at, 0)
        m.joint("revolute", (GROUND, (at, 0)), (wheel,))
        teeth = [round(2000 * r1), round(2000 * r2)]
        gear = m.joint("gear", (pinion,), (wheel,), radii=[r1, r2], teeth=teeth, pressure_angle=float(PRESSURE))
        m.source("clearance", play, joint=gear)
        lost = lost * r1 / r2 + play / r2
    m.drive(first)
    m.output(wheel)
    m.load(wheel, moment=1.0)
    core = m.core()
    drives = _path(1, 3)
    poses = _followed(core, drives)
    np.testing.assert_allclose(_loaded(core, drives, poses)["error"][:, 2], lost, rtol=1e-12)
    worst = core.worst(drives, poses)
    np.testing.assert_allclose(worst["rotation"], lost, rtol=1e-12)
    drawn = core.random(drives[:1], poses[:1], 4000, 1, np.array([0.5]), keep=True)
    assert 0.8 * lost < np.abs(drawn["kept_errors"][:, 2]).max() <= lost * (1 + 1e-12)


@pytest.mark.parametrize("torque", [1.5, -1.5])
@pytest.mark.parametrize("angle", [0.0, 0.7, 3.0])
@pytest.mark.parametrize("exact", [True, False])
def test_tooth_force_and_bearing_reactions_by_hand(torque, angle, exact):
    """The force T / (r cos alpha) acts at the pitch point along the line of action of the flank that carries."""
    m = pair(torque=torque, angle=angle)
    m.source("clearance", 1e-5, joint=2)
    core = m.core()
    found = _loaded(core, np.zeros((1, 1)), exact=exact)["reaction"][0]
    r1, r2 = 0.01, 0.02
    outwards = np.array([np.cos(angle), np.sin(angle)])
    along = np.array([-outwards[1], outwards[0]])
    # The pinion pushes the wheel away, and against the torque at the pitch point, which is on its inner side.
    force = abs(torque) / r2 * np.tan(PRESSURE) * outwards + torque / r2 * along
    assert np.hypot(*force) == pytest.approx(abs(torque) / (r2 * np.cos(PRESSURE)))
    np.testing.assert_allclose(found[2], [*force, -torque], atol=1e-9)
    np.testing.assert_allclose(found[1], [*-force, 0.0], atol=1e-9)
    # On the pinion: its bearing bears the same force, its drive the torque over the ratio.
    np.testing.assert_allclose(found[0], [*force, torque * r1 / r2], atol=1e-9)


@pytest.mark.parametrize("internal", [False, True])
def test_both_flanks_bear_without_play(internal):
    """Without play the radial forces of the two flanks cancel: the force is tangential."""
    m = pair((20, 60), internal=internal, torque=3.0)
    found = _loaded(m.core(), np.zeros((1, 1)))["reaction"][0]
    # The pitch point is 30 mm to the left of the second centre, outside the first wheel or inside the ring.
    np.testing.assert_allclose(found[2], [0.0, 3.0 / 0.03, -3.0], atol=1e-9)


@pytest.mark.parametrize("torque", [2.0, -2.0])
@pytest.mark.parametrize("exact", [True, False])
def test_play_in_one_bearing_turns_the_wheel_by_hand(torque, exact):
    """The wheel yields along the line of action by its bearing's play s: it turns by s / (r cos alpha) more."""
    play, slack = 3e-5, 5e-5
    m = pair(torque=torque)
    m.source("clearance", {"disc": {"radius": play}}, joint=1)
    m.source("clearance", slack, joint=2)
    core = m.core()
    error = _loaded(core, np.zeros((1, 1)), exact=exact)["error"][0]
    sign = np.sign(torque)
    shift = play * np.array([np.sin(PRESSURE), sign * np.cos(PRESSURE)])
    # The line of action turns with the line of centres, by the play over the distance.
    np.testing.assert_allclose(error[:2], shift, atol=play * play / 0.03 * 2)
    turned = sign * (slack + play / np.cos(PRESSURE)) / 0.02
    np.testing.assert_allclose(error[2], turned, atol=play * play / 0.03 / 0.02 * 2)


def test_a_rack_in_loose_bearings_by_hand():
    """Pinion bearing and guide give way along the line of action, the rack moves by backlash and both."""
    m = rack(0.02)
    m.load(1, force=(3.0, 0.0))
    m.source("clearance", 4e-5, joint=2)
    m.source("clearance", {"disc": {"radius": 2e-5}}, joint=0)
    m.source("clearance", {"diamond": {"gap": 1e-5, "half_length": 0.03}}, joint=1)
    found = _loaded(m.core(), np.zeros((1, 1)))
    apart = 4e-5 + 2e-5 / np.cos(PRESSURE) + 1e-5 * np.tan(PRESSURE)
    np.testing.assert_allclose(found["error"][0], [apart, -1e-5, 0.0], atol=1e-15)
    np.testing.assert_allclose(found["reaction"][0][0], [-3.0, -3.0 * np.tan(PRESSURE), -3.0 * 0.02], atol=1e-9)


@pytest.mark.parametrize("crossed", [False, True])
def test_the_strand_of_a_belt_pulls_its_pulleys_together(crossed):
    """Half a newton metre on a pulley of 50 mm is ten newtons along the strand that is common to both pulleys."""
    m = belt(crossed)
    m.load(1, moment=0.5)
    m.source("clearance", (-4e-5, 1e-5), joint=2)
    found = _loaded(m.core(), np.zeros((1, 1)))
    sine = (0.05 + (0.02 if crossed else -0.02)) / 0.2
    strand = 10 * np.array([-np.sqrt(1 - sine * sine), sine])
    np.testing.assert_allclose(found["reaction"][0][2], [*strand, -0.5], atol=1e-9)
    np.testing.assert_allclose(found["reaction"][0][1], [*-strand, 0.0], atol=1e-9)
    # A pulley that runs ahead of an open belt is behind by the belt's arc, which is counted on the first pulley.
    slack = 1e-5 if crossed else 4e-5
    np.testing.assert_allclose(found["error"][0], [0.0, 0.0, slack / 0.05], atol=1e-15)


# involutes


def _involute(angle):
    return np.tan(angle) - angle


def _extreme(function, low, high):
    """The least value of a function of one minimum, by ever finer grids."""
    for _ in range(12):
        at = np.linspace(low, high, 401)
        k = int(np.argmin(function(at)))
        low, high = at[max(k - 1, 0)], at[min(k + 1, 400)]
    return float(np.min(function(at)))


def _flank_limit(r1, r2, play, distance, turned, internal):
    """How far wheel 2 turns until its flank touches that of wheel 1: no point of one flank may pass the other.

    A tooth of wheel 1 points along x, turned by an angle, in a gap of wheel 2; both teeth fill half of a pitch but for
    the play on each side of the gap. The wheel 2 has its centre at x = distance, or a ring at -distance.
    """
    quarter = 0.25 * TURN * 0.0005
    base1, base2 = r1 * np.cos(PRESSURE), r2 * np.cos(PRESSURE)
    centre = -distance if internal else distance

    def limit(radius):
        polar = turned + quarter / r1 + _involute(PRESSURE) - _involute(np.arccos(base1 / radius))
        x, y = radius * np.cos(polar) - centre, radius * np.sin(polar)
        far = np.hypot(x, y)
        gap = (quarter + play) / r2
        if internal:
            return gap - np.arctan2(y, x) - _involute(np.arccos(base2 / far)) + _involute(PRESSURE)
        return np.arctan2(y, x) % TURN - np.pi + gap + _involute(np.arccos(base2 / far)) - _involute(PRESSURE)

    return _extreme(limit, max(base1, r1 - 0.0006) * (1 + 1e-9), r1 + 0.0006)


@pytest.mark.parametrize("internal", [False, True])
@pytest.mark.parametrize("apart", [0.0, 8e-5, -3e-5])
@pytest.mark.parametrize("aside", [0.0, 6e-5])
@pytest.mark.parametrize("turned", [0.0, 0.013])
def test_wheels_turn_as_far_as_involute_flanks_let_them(internal, apart, aside, turned):
    """The angles at either end of the play, for a wheel off its place, are those of two involutes in contact."""
    z1, z2 = (40, 100) if internal else (40, 60)
    r1, r2, play = 0.0005 * z1, 0.0005 * z2, 5e-5
    nominal = r2 - r1 if internal else r1 + r2
    # A ring's centre lies behind the pinion.
    m = pair((z1, z2), internal=internal, angle=np.pi if internal else 0.0)
    offset = m.source("clearance", {"disc": {"radius": 2e-4}}, joint=1)
    backlash = m.source("clearance", play, joint=2)
    core = m.core()
    drives = np.array([[turned]])
    start = core.trace(np.array([[0.0], [turned]]))["poses"][1:]
    told = []
    for side in (play, -play):
        u = np.zeros((1, 3))
        u[0, offset : offset + 2], u[0, backlash] = (-apart if internal else apart, aside), side
        found = core.given(drives, start, u)
        assert found["status"][0] == OK
        told.append(found["poses"][0, 1, 2])
    x, y = (nominal + apart), (-aside if internal else aside)
    distance, bearing = np.hypot(x, y), np.arctan2(y, x)
    # The flank on one side stops a wheel that turns this way and a ring that turns the other way.
    way = -1 if internal else 1
    limits = [
        way * side * _flank_limit(r1, r2, play, distance, side * (turned - bearing), internal) + bearing
        for side in (1, -1)
    ]
    np.testing.assert_allclose(sorted(told), sorted(limits), atol=1e-9)


# over-constrained


@pytest.mark.parametrize("torque", [1.0, -1.0])
def test_planets_share_the_load_by_their_backlash(torque):
    """Three planets are two too many: with bearings at rest the one of the least backlash carries alone, a sun that
    floats lets all carry alike, and the mean of their backlash is lost."""
    drives = _path(1, 4)
    plays = (1e-5, 2e-5, 3e-5)
    ratio = 20 / 72
    m = planetary(torque=torque, plays=plays)
    core = m.core()
    assert len(core.rows) == 17
    assert not core.isostatic
    found = _loaded(core, drives)
    np.testing.assert_allclose(found["error"][:, 2], torque * ratio * 1e-5 / 0.01, rtol=1e-9)
    forces = np.hypot(*found["reaction"][:, [3, 6, 9], :2].transpose(2, 0, 1))
    # Torque of the arm over its radius, the half of it on each mesh.
    np.testing.assert_allclose(forces[:, 0], 0.5 / 0.018 / np.cos(PRESSURE), rtol=1e-7)
    np.testing.assert_allclose(forces[:, 1:], 0.0, atol=1e-5)
    core = planetary(torque=torque, plays=plays, floating=1e-4).core()
    found = _loaded(core, drives)
    forces = np.hypot(*found["reaction"][:, [3, 6, 9], :2].transpose(2, 0, 1))
    np.testing.assert_allclose(forces, 0.5 / 0.018 / np.cos(PRESSURE) / 3, rtol=5e-3)
    np.testing.assert_allclose(found["error"][:, 2], torque * ratio * 2e-5 / 0.01, rtol=1e-3)


def _loose_planetary(radius, play):
    m = planetary(torque=1.0)
    for k, joint in enumerate(m.joints):
        if joint["kind"] == "gear":
            m.source("clearance", play, joint=k)
        else:
            m.source("clearance", {"disc": {"radius": radius}}, joint=k)
    return m


def test_specimens_of_a_planetary_gear_are_solved_side_by_side():
    """What play counts where flanks have moved was not recorded, so that every specimen took the plain solver."""
    core = _loose_planetary(1e-5, 3e-5).core()
    drives = np.zeros((1, 1))
    poses = core.trace(drives)["poses"]
    for loaded in (False, True):
        drawn = core.random(drives, poses, 200, 3, np.array([0.5]), keep=True, loaded=loaded)
        assert drawn["fallbacks"][0] == 0
        u = drawn["kept_parameters"]
        given = core.given(np.repeat(drives, 200, 0), np.repeat(poses, 200, 0), u)
        np.testing.assert_allclose(given["error"], drawn["kept_errors"], atol=1e-12)


def test_redundant_teeth_overlap_no_more_than_others():
    """In which meshes teeth overlap was asked of the constraints that hold the mechanism, not of the redundant ones: a
    third of the specimens that were counted as assembled had a planet whose teeth pass through those of the ring. Now
    offsets are drawn under the condition that no teeth overlap."""
    m = _loose_planetary(1e-4, 3e-5)
    core, train = m.core(), Train(m)
    drives = np.zeros((1, 1))
    poses = core.trace(drives)["poses"]
    drawn = core.random(drives, poses, 400, 3, np.array([0.5]), keep=True)
    u, assembled = drawn["kept_parameters"], drawn["kept_status"] == OK
    assert assembled.all()
    given = core.given(np.repeat(drives, 400, 0), np.repeat(poses, 400, 0), u)
    np.testing.assert_array_equal(given["status"][assembled], OK)
    assert train.overlap(given["poses"], u)[assembled].min() >= 0.0
    worst = core.worst(drives, poses)
    assert worst["status"][0] == SINGULAR
    at = worst["offset"][0]
    given = core.given(np.repeat(drives, len(at), 0), np.repeat(poses, len(at), 0), at)
    assert train.overlap(given["poses"], at).min() >= -1e-9


def test_a_ball_screw_with_a_guided_nut_is_over_constrained():
    """The guide holds four components that the screw holds, too; load along the axis goes through the thread."""
    m = screw(0.005)
    m.loads.append({"point": m.point(1), "force": [0.0, 0.0, -50.0], "moment": [0.0] * 3})
    m.source("clearance", {"journal": {"radius": 2e-5, "half_length": 0.01, "axial": 1e-5}}, joint=2)
    core = m.core()
    found = _loaded(core, _path(2, 5))
    np.testing.assert_allclose(found["error"][:, 2], -1e-5, rtol=1e-9)
    np.testing.assert_allclose(found["reaction"][:, 0, 2], 50.0, rtol=1e-6)
    np.testing.assert_allclose(found["reaction"][:, 0, 5], -50.0 * 0.005 / TURN, rtol=1e-6)


# errors, stiffness and jams


def test_ratio_error_and_run_out_by_hand():
    """A transmission error turns the wheel by itself over r; a centre off by e turns it by e / r across the line of
    centres, and not at all along it while the teeth are in the middle of their play."""
    m = pair()
    backlash = m.source("clearance", 1e-6, joint=2)
    ratio = m.source("ratio", 1e-5, joint=2)
    runout = m.runout(2, 3e-5, second=True)
    core = m.core()
    told = core.sensitivity(np.zeros((1, 1)), core.trace(np.zeros((1, 1)))["poses"])["source"][0]
    np.testing.assert_allclose(told[:2], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.abs(told[2, [backlash, ratio]]), 1 / 0.02, rtol=1e-9)
    # The bearing holds the body: the centre of its teeth goes up with the run-out, and pinion and wheel roll on it.
    np.testing.assert_allclose(np.abs(told[2, runout : runout + 2]), [0.0, 1 / 0.02], atol=1e-9)
    # On a flank the centre distance counts, too: by the tangent of the pressure angle.
    u = np.zeros((2, 4))
    u[:, backlash] = 1e-6
    u[1, runout] = 3e-7
    turned = core.given(np.zeros((2, 1)), core.trace(np.zeros((2, 1)))["poses"], u)["error"][:, 2]
    assert abs(turned[1] - turned[0]) == pytest.approx(3e-7 * np.tan(PRESSURE) / 0.02, rel=5e-3)


@pytest.mark.parametrize("play", [0.0, 1e-5])
def test_an_elastic_mesh_yields_beyond_its_play(play):
    """A hundred newtons on 1e-8 m/N; the force stays on the line of action, however far the teeth bend."""
    m = pair(torque=2.0)
    m.joints[2]["compliance"] = [1e-8]
    if play:
        m.source("clearance", play, joint=2)
    found = _loaded(m.core(), np.zeros((1, 1)))
    assert found["error"][0, 2] == pytest.approx((play + 1e-6) / 0.02, rel=1e-9)
    radial = 100.0 * np.tan(PRESSURE) if play else 0.0
    np.testing.assert_allclose(found["reaction"][0][2], [radial, 100.0, -2.0], atol=1e-6)


def test_teeth_that_jam_cannot_be_assembled():
    """A bearing with more play than the backlash leaves room for: samples in which teeth would overlap are counted."""
    radius, slack = 2e-4, 1e-5
    m = pair(torque=1.0)
    m.source("clearance", {"disc": {"radius": radius}}, joint=1)
    m.source("clearance", slack, joint=2)
    core = m.core()
    drives, poses = np.zeros((1, 1)), core.trace(np.zeros((1, 1)))["poses"]
    drawn = core.random(drives, poses, 2000, 3, np.array([0.5]), keep=True)
    closer = -drawn["kept_parameters"][:, 0]
    # To first order the room is backlash over the tangent of the pressure angle.
    jams = closer > slack / np.tan(PRESSURE)
    doubtful = np.abs(closer - slack / np.tan(PRESSURE)) < 1e-6
    np.testing.assert_array_equal((drawn["kept_status"] != OK)[~doubtful], jams[~doubtful])
    given = core.given(np.repeat(drives, 2000, 0), np.repeat(poses, 2000, 0), drawn["kept_parameters"])
    np.testing.assert_array_equal(given["status"], drawn["kept_status"])


def test_worst_case_to_first_order_knows_the_flank():
    """Bearing play counts by one over the cosine of the pressure angle, in the linear figure as in the exact one."""
    m = pair()
    m.source("clearance", {"disc": {"radius": 1e-7}}, joint=1)
    m.source("clearance", 2e-7, joint=2)
    core = m.core()
    worst = core.worst(np.zeros((1, 1)), core.trace(np.zeros((1, 1)))["poses"])
    turned = (2e-7 + 1e-7 / np.cos(PRESSURE)) / 0.02
    for name in ("rotation", "rotation_first_order"):
        np.testing.assert_allclose(worst[name], turned, rtol=1e-4)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"teeth": [20, 41]}, "ratio of its tooth counts"),
        ({"radii": [0.01, -0.02]}, "positive pitch radii"),
        ({"pressure_angle": 1.6}, "pressure angle"),
        ({"module": 2}, "module"),
    ],
)
def test_a_coupling_that_is_told_wrongly_is_refused(change, told):
    m = pair()
    m.joints[2]["coupling"] |= change
    with pytest.raises(ValueError, match=told):
        m.core()
    m = pair()
    m.source("clearance", 1e-2, joint=2)
    with pytest.raises(ValueError, match="gap between two teeth"):
        m.core()


# lanes against plain


def _random_train(seed):
    """Wheels on loose bearings, joined by gears, rings and belts without a pattern, and a rack at the end."""
    chance = np.random.default_rng(seed)
    m = Machine(length=0.1)
    at, before, joined = np.zeros(2), None, []
    for k in range(chance.integers(2, 5)):
        kind = chance.choice(["gear", "ring", "belt", "crossed"]) if k else None
        z1, z2 = (int(z) for z in chance.integers(15, 40, 2))
        z2 += z1 if kind == "ring" else 0
        r1, r2 = 0.0005 * z1, 0.0005 * z2
        apart = {"gear": r1 + r2, "ring": r2 - r1, None: 0.0}.get(kind, 2.5 * (r1 + r2))
        angle = chance.uniform(0, TURN)
        at = at + apart * np.array([np.cos(angle), np.sin(angle)])
        wheel = m.body(*at)
        joined.append(m.joint("revolute", (GROUND, at), (wheel,)))
        if chance.random() < 0.7:
            m.source("clearance", {"disc": {"radius": chance.uniform(1e-6, 2e-5)}}, joint=joined[-1])
        if kind:
            told = {"radii": [r1, r2], "teeth": [z1, z2], "pressure_angle": float(chance.uniform(0.2, 0.45))}
            told |= {"internal": True} if kind == "ring" else {"crossed": True} if kind == "crossed" else {}
            mesh = m.joint("gear" if kind in ("gear", "ring") else "belt", (before,), (wheel,), **told)
            m.source("clearance", (-chance.uniform(2e-5, 6e-5), chance.uniform(2e-5, 6e-5)), joint=mesh)
            m.source("ratio", 1e-6, joint=mesh)
            m.runout(mesh, 2e-6, second=bool(chance.integers(2)))
        before = wheel
    m.drive(joined[0])
    radius = float(chance.uniform(0.01, 0.03))
    slider = m.body(*(at - [0.0, radius]))
    m.joint("prismatic", (GROUND, at - [0.0, radius]), (slider,))
    mesh = m.joint("rack", (slider,), (before,), radii=[radius, 0.0], pressure_angle=float(PRESSURE))
    m.source("clearance", 3e-5, joint=mesh)
    m.output(slider, (0.01, 0.0))
    m.load(slider, (0.01, 0.0), force=tuple(chance.uniform(-10, 10, 2)))
    m.load(before, moment=float(chance.uniform(-1, 1)))
    return m.core()


@pytest.mark.parametrize("seed", range(12))
def test_lanes_answer_as_one_by_one(seed):
    """Path, load to both orders, samples and worst case of random trains; nothing is left to the plain solver."""
    core = _random_train(seed)
    drives = _path(3, 130)
    require_lanes_as_one_by_one(core, drives, _followed(core, drives))


@pytest.mark.parametrize("seed", range(6))
def test_sensitivities_are_differences(seed):
    core = _random_train(seed)
    drives = np.full((1, 1), 0.3)
    poses = core.trace(drives)["poses"]
    told = core.sensitivity(drives, poses)["source"][0]
    step = 1e-7
    for p in range(told.shape[1]):
        u = np.zeros((2, told.shape[1]))
        u[:, p] = step, -step
        ends = core.given(np.repeat(drives, 2, 0), np.repeat(poses, 2, 0), u)["error"]
        np.testing.assert_allclose(told[:, p], (ends[0] - ends[1]) / (2 * step), atol=1e-7 * np.abs(told).max())


@pytest.mark.parametrize("part", [0.2, 0.22, 0.249])
def test_teeth_with_wide_play_stay_in_their_gap_on_lanes(part):
    """Newton's method took the tangent of the phase for the phase, which vanishes half a tooth away, too: with play of
    0.4 pitches and more the worst case and a third of the samples were there, three to six times too large."""
    m = pair((20, 41))
    play = part * np.pi * 1e-3
    m.source("clearance", play, joint=2)
    m.source("clearance", {"disc": {"radius": 2e-6}}, joint=1)
    core = m.core()
    drives = np.zeros((1, 1))
    poses = core.trace(drives)["poses"]
    most = (play + 1.01 * 2e-6 / np.cos(PRESSURE)) / 0.0205
    worst = core.worst(drives, poses)["rotation"][0]
    assert play / 0.0205 < worst < most
    drawn = core.random(drives, poses, 1000, 3, np.array([0.5]), keep=True)
    assert (drawn["kept_status"] == OK).all()
    assert np.abs(drawn["kept_errors"][:, 2]).max() <= worst * (1 + 1e-12)


def test_wheels_in_space_on_lanes_and_alone():
    """Two wheels on pins with axial play in space, pushed across and along: all components agree."""
    m = Machine("spatial", length=0.03)
    m.body(0, 0, 0)
    m.body(0.03, 0, 0)
    bearings = [m.joint("revolute", (GROUND,), (0,)), m.joint("revolute", (GROUND, (0.03, 0, 0)), (1,))]
    gear = m.joint("gear", (0,), (1,), radii=[0.01, 0.02], teeth=[20, 40], pressure_angle=float(PRESSURE))
    m.drive(bearings[0])
    m.output(1, (0, 0.01, 0))
    m.load(1, moment=2.0)
    m.load(1, (0, 0, 0.002), force=(1.0, 2.0))
    m.loads[-1]["force"][2] = 3.0
    for bearing in bearings:
        m.source("clearance", {"journal": {"radius": 2e-5, "half_length": 0.01, "axial": 1e-5}}, joint=bearing)
    m.source("clearance", 5e-5, joint=gear)
    m.runout(gear, 1e-5, second=False)
    core = m.core()
    drives = _path(3, 100)
    poses = _followed(core, drives)
    together = core.loaded(drives, poses)
    assert together["fallbacks"] == 0
    assert (together["status"] == OK).all()
    for k in (0, 50):
        alone = core.loaded(drives[k : k + 1], poses[k : k + 1])
        np.testing.assert_allclose(together["error"][k], alone["error"][0], atol=1e-12)
        np.testing.assert_allclose(together["reaction"][k], alone["reaction"][0], atol=1e-9)
    force = together["reaction"][0, gear, :3]
    assert np.hypot(*force[:2]) == pytest.approx(2.0 / 0.02 / np.cos(PRESSURE), rel=1e-3)
    drawn = core.random(drives[:1], poses[:1], 640, 7, np.array([0.5]), keep=True)
    u = drawn["kept_parameters"]
    given = core.given(np.repeat(drives[:1], 640, 0), np.repeat(poses[:1], 640, 0), u)
    np.testing.assert_allclose(drawn["kept_errors"], given["error"], atol=1e-12)


# the machines of these tests


def belt(crossed):
    m = Machine(length=0.2)
    m.body(0, 0)
    m.body(0.2, 0)
    m.joint("revolute", (GROUND,), (0,))
    m.joint("revolute", (GROUND, (0.2, 0)), (1,))
    m.joint("belt", (0,), (1,), radii=[0.02, 0.05], teeth=[20, 50], crossed=crossed)
    m.drive(0)
    m.output(1)
    return m


def rack(above):
    """A rack that slides along x below its pinion, or above."""
    m = Machine(length=0.1)
    m.body(0, above)
    m.body(0, 0)
    m.joint("revolute", (GROUND, (0, above)), (0,))
    m.joint("prismatic", (GROUND,), (1,))
    m.joint("rack", (1,), (0,), radii=[0.02, 0.0], pressure_angle=float(PRESSURE))
    m.drive(0)
    m.output(1)
    return m


def screw(lead):
    m = Machine("spatial", length=0.1)
    m.body(0, 0, 0)
    m.body(0, 0, 0.03)
    m.joint("revolute", (GROUND,), (0,))
    m.joint("prismatic", (GROUND, (0.05, 0, 0.03)), (1, (0.05, 0, 0)))
    m.joint("screw", (0,), (1, (0, 0, -0.03)), lead=lead)
    m.drive(0)
    m.output(1)
    return m


def arm(stages: str) -> jp.Mechanism:
    """Three links in space about axes across each other, driven in their joints or by two pairs of wheels each."""
    b, inner = spatial(), "ground"
    axes, turns = ([0, 0, 1], [0, 1, 0], [1, 0, 0]), ([0, 50, -40, 3], [10, 70, -25, 12], [0, -60, 80, -5])
    for k, (axis, values) in enumerate(zip(axes, turns, strict=True), start=1):
        at, aside = np.array([100.0 * k, 0, 50 * k]), np.roll(axis, 1)
        b.revolute(f"J{k}", bodies=[inner, f"link{k}"], at=at, axis=axis)
        if stages == "geared":
            far, near = at + 120 * aside, at + 70 * aside
            b.revolute(f"R{k}", bodies=[inner, f"rotor{k}"], at=far, axis=axis)
            b.revolute(f"S{k}", bodies=[inner, f"shaft{k}"], at=near, axis=axis)
            for name, bodies, places, teeth in (
                ("G", [f"rotor{k}", f"shaft{k}"], [far, near], [20, 80]),
                ("H", [f"shaft{k}", f"link{k}"], [near, at], [20, 120]),
            ):
                b.gear(f"{name}{k}", bodies=bodies, at=places, axis=axis, teeth=teeth, module=1)
            b.drive(f"q{k}", joint=f"R{k}", values=24 * np.array(values))
        else:
            b.drive(f"q{k}", joint=f"J{k}", values=values)
        inner = f"link{k}"
    b.output(body="link3", at=(450, 20, 150))
    return b.mechanism()


def test_an_arm_driven_by_trains_of_wheels_is_where_one_driven_in_its_joints_is():
    """A motor makes nine turns from one configuration to the next, in steps that no tooth would survive on its own."""
    geared, direct = (jp.solve(arm(stages)) for stages in ("geared", "direct"))
    np.testing.assert_allclose(geared.nominal, direct.nominal, atol=1e-8)


def test_a_motor_behind_two_drives_that_share_a_plate_keeps_count_of_its_turns():
    """The second of those drives has no row of its own, and took the place of the motor's."""
    b = planar()
    b.revolute("plate", ground=(0, 0), plate=(0, 0))
    b.revolute("R", plate=(20, 0), rotor=(0, 0))
    b.revolute("W", plate=(80, 0), wheel=(0, 0))
    b.gear("G", rotor=(0, 0), wheel=(0, 0), teeth=[20, 40], module=2)
    b.drive("a", joint="plate", values=[0, 20, 5], stiffness=1e5)
    b.drive("b", joint="plate", values=[0, 20, 5], stiffness=1e5)
    b.drive("motor", joint="R", values=[0, 2000, -1500])
    b.output(body="wheel", at=(0, 0))
    pose = jp.loaded(b.mechanism())
    np.testing.assert_allclose(pose.nominal[:, 2], [0, 20 - 1000, 5 + 750], atol=1e-8)
