"""Every question about random linkages with couplings, against poses that strings around base circles give."""

import functools

import numpy as np
import pytest

from helpers.couplings import OK
from helpers.oracles.sets import Source
from helpers.oracles.trains import Train
from helpers.trains import TURN, drawn

SEEDS = range(24)
#: samples that are held against the independent closure
SAMPLES = 60


class Case:
    """A drawn machine with its core, its independent closure and a nominal pose near the start."""

    def __init__(self, seed: int, **scales: float):
        machine, start = drawn(seed, **scales)
        self.machine, self.core, self.train = machine, machine.core(), Train(machine)
        self.path = np.array([[start + 0.02]])
        traced = self.core.trace(self.path)
        self.poses = traced["poses"]
        self.train.follow(self.path)
        closed, _ = self.train.close(self.poses, self.path, np.zeros(self.train.n_parameters))
        assert traced["status"][0] == OK
        assert np.abs(closed - self.poses).max() < 1e-10
        self.nominal = closed[0]
        self.sets = []
        for number, told in enumerate(machine.sources):
            kind, sizes = next(iter(told["set"].items()))
            self.sets.append(Source(str(number), kind, (), tuple(sizes.values()), tuple(told["centre"])))

    def error(self, poses):
        return self.train.output(poses) - self.train.output(self.nominal)

    def closed(self, u):
        """Independent poses at offsets, and whether these can be assembled; without those that hardly can or cannot."""
        many = len(u)
        poses, closes = self.train.close(np.repeat(self.nominal[None], many, 0), np.repeat(self.path, many, 0), u)
        gap = self.train.overlap(poses, u)
        return poses, gap >= 0, closes & (np.abs(gap) > 1e-9)

    def given(self, u):
        return self.core.given(np.repeat(self.path, len(u), 0), np.repeat(self.poses, len(u), 0), u)

    def parts(self, values):
        """Sources with their sets and their own values."""
        starts = zip(self.machine.sources, self.sets, self.train.first, strict=True)
        return [(told, kind, values[..., k : k + len(told["centre"])]) for told, kind, k in starts]


@functools.lru_cache(maxsize=4)
def _case(seed: int) -> Case:
    """Plays small, usual and so large that many samples jam; where a drawing is near a singular pose, another one."""
    for k in range(99):
        scales = [{"play": 0.05}, {"play": 0.3, "flanks": 2.0}, {"play": 1.0, "flanks": 0.7}][seed % 3]
        machine, start = drawn(seed + 1000 * k, **scales)
        train = Train(machine)
        jacobian = train.jacobian(train.start, np.array([start]), np.zeros(train.n_parameters))
        rows = np.abs(jacobian).max(axis=1, keepdims=True)
        if machine.sources and np.linalg.svd(jacobian / rows, compute_uv=False)[-1] > 5e-3:
            return Case(seed + 1000 * k, **scales)
    raise AssertionError("no drawing is regular")


@pytest.mark.parametrize("seed", SEEDS)
def test_samples_are_where_strings_close_them(seed):
    """Poses and jams of samples, on lanes and one by one."""
    case = _case(seed)
    drawn = case.core.random(case.path, case.poses, SAMPLES, seed, np.array([0.5]), keep=True)
    u = drawn["kept_parameters"]
    poses, fits, sure = case.closed(u)
    np.testing.assert_array_equal((drawn["kept_status"] == OK)[sure], fits[sure])
    kept = sure & fits
    np.testing.assert_allclose(drawn["kept_errors"][kept], case.error(poses)[kept], atol=1e-9)
    given = case.given(u)
    np.testing.assert_array_equal(given["status"], drawn["kept_status"])
    np.testing.assert_allclose(given["error"][kept], drawn["kept_errors"][kept], atol=1e-11)


@pytest.mark.parametrize("seed", SEEDS)
def test_sensitivities_are_differences_of_strings(seed):
    case = _case(seed)
    train = case.train
    told = case.core.sensitivity(case.path, case.poses)["source"][0]
    differences = train.gradient(train.output, case.nominal, case.path[0], np.zeros(train.n_parameters)).T
    np.testing.assert_allclose(told, differences, atol=1e-6 * np.abs(told).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_a_load_presses_every_offset_against_its_end_and_is_in_balance(seed):
    """Every offset does the most work of its set; reactions and loads add up to nothing on every body, and the force
    of a flank is tangent to both base circles."""
    case = _case(seed)
    train, machine = case.train, case.machine
    found = case.core.loaded(case.path, case.poses)
    if found["status"][0] != OK:
        # Where the load presses teeth together that the bearings let come too near.
        assert seed % 3 == 2
        return
    u = found["offset"][0]
    poses, fits, _ = case.closed(u[None])
    assert fits[0]
    np.testing.assert_allclose(found["error"][0], case.error(poses[0]), atol=1e-8)
    slope = train.gradient(train.work, poses[0], case.path[0], u)
    pairs = zip(case.parts(slope), case.parts(u), strict=True)
    clearances = [(s, own, at) for (told, s, own), (_, _, at) in pairs if told["kind"] == "clearance"]
    scale = sum(s.support(own) for s, own, _ in clearances)
    for s, own, at in clearances:
        assert own @ (at - s.centre) == pytest.approx(s.support(own), abs=1e-6 * scale)
    reaction = found["reaction"][0]
    _balance(train, machine, poses[0], u, reaction)


def _balance(train, machine, pose, u, reaction):
    largest = np.abs(reaction[:, :2]).max()
    net = np.zeros((train.n + 1, 3))
    for k, joint in enumerate(machine.joints):
        (x1, y1), (x2, y2) = (train.place(k, second, pose, u) for second in (False, True))
        fx, fy, moment = reaction[k]
        bodies = (machine.points[joint[end]]["body"] for end in ("first", "second"))
        for body, way in zip(bodies, (-1, 1), strict=True):
            net[body] += way * np.array([fx, fy, moment + x2 * fy - y2 * fx])
        force = np.hypot(fx, fy)
        if joint["kind"] == "gear" and train.play(k)[1] and force > 1e-6 * largest:
            about_first = moment + (x2 - x1) * fy - (y2 - y1) * fx
            base = np.array(joint["coupling"]["radii"]) * np.cos(joint["coupling"]["pressure_angle"])
            np.testing.assert_allclose(np.abs([about_first, moment]) / force, base, rtol=1e-8)
    for load in machine.loads:
        x, y = train.carried(machine.points[load["point"]], pose)
        fx, fy, _ = load["force"]
        net[machine.points[load["point"]]["body"]] += fx, fy, load["moment"][2] + x * fy - y * fx
    np.testing.assert_allclose(net[:-1] / [1, 1, machine.length], 0.0, atol=1e-7 * largest)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_corner_is_worse_than_the_worst_case(seed):
    """Corners of all sets together, none beyond what is reported; the reported offsets attain it."""
    case = _case(seed)
    chance = np.random.default_rng(seed)
    u = np.tile(case.train.centre, (200, 1))
    for _, s, at in case.parts(u):
        corners = s.corners()
        at[:] = corners[chance.integers(len(corners), size=200)]
    poses, fits, sure = case.closed(u)
    told = case.core.worst(case.path, case.poses)
    errors = case.error(poses)[sure & fits]
    for name, most in (("position", np.hypot(*errors[:, :2].T)), ("rotation", np.abs(errors[:, 2]))):
        assert np.all(most <= told[name][0] * (1 + 1e-9) + 1e-12)
    attained, fits, _ = case.closed(told["offset"][0][:1])
    assert fits[0]
    assert np.hypot(*case.error(attained[0])[:2]) == pytest.approx(told["position"][0], abs=1e-9)


@pytest.mark.parametrize("seed", [398, 416, 428, 473, 481])
def test_the_first_order_knows_the_flanks_of_both_opposite_directions(seed):
    """With teeth in the middle of their play the error is as large in two opposite directions. On the flanks that each
    of them closes it is not: only one was looked at, and the figure was up to 22 per cent below the worst case."""
    case = Case(seed, play=0.01)
    worst = case.core.worst(case.path, case.poses)
    assert worst["position_first_order"][0] == pytest.approx(worst["position"][0], rel=2e-3)
    assert worst["position_bound"][0] >= worst["position_first_order"][0]


@pytest.mark.parametrize("seed", [701, 706])
def test_a_path_of_a_turn_is_followed_tooth_by_tooth(seed):
    """The poses at the end of a path in five rows are those of short steps, up to whole turns of a body."""
    machine, start = drawn(seed, play=0.05, parts=2 + seed % 2)
    path = (start + np.linspace(0.0, TURN + 1.0, 5))[:, None]
    traced = machine.core().trace(path)
    assert (traced["status"] == OK).all()
    away = np.abs(traced["poses"] - Train(machine).follow(path, most=0.06))
    away[..., 2] = np.abs(away[..., 2] / TURN - np.round(away[..., 2] / TURN)) * TURN
    assert away.max() < 1e-9
