"""Mechanisms that cannot be assembled: what is said of each is true, and the gap is drawn.

A length that is said to close a loop does; a little less does not, whatever the start.
"""

import dataclasses
import re
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

import jointplay as jp
from helpers.rods import RSSR
from jointplay import examples
from jointplay.analyses.failure import Failure, failure
from jointplay.analyses.hints import hints
from jointplay.cli import run
from jointplay.model.mobility.attempt import Cure
from jointplay.model.mobility.closing import Closing, starts


def example(name: str, changes: Mapping[str, object] | None = None) -> jp.Mechanism:
    return jp.loads(examples.text(name)).with_(dict(changes or {}))


#: by what is wrong with them
FILES: dict[str, jp.Mechanism] = {
    "coupler too short": example(
        "four-bar", {"joints.J3.on": {"coupler": [20, 0], "rocker": [150, 0]}, "drives.theta1.values": [22.7, 25.0]}
    ),
    "rod in space too short": RSSR.with_({"joints.ball.on.coupler": [100, 0, 0]}),
    "second loop too short": example("six-bar", {"joints.F.on": {"link": [20, 0], "output_rocker": [70, 0]}}),
    "start forgotten": example("p3r", {"start": None}),
    "start of another shape": example(
        "rssr", {"start.crank.rotation": [3.5, 135.1, -106.8], "start.rocker.rotation": [134.6, -56.5, -23.0]}
    ),
    "drive out of range": example("four-bar", {"drives.theta1": {"joint": "J1", "from": 22.7, "to": 150, "count": 12}}),
    "slider beyond": example(
        "slider-crank", {"joints.guide.on": {"ground": {"at": [0, 190], "axis": [1, 0]}, "slider": [0, 0]}}
    ),
    "gears carry rods that are too short": example(
        "geared-five-bar", {"joints.C.on": {"left_rod": [20, 0], "right_rod": [20, 0]}}
    ),
    "elastic coupler too short": example(
        "four-bar",
        {
            "bodies.coupler": {"stiffness": 1e4},
            "joints.J3.on": {"coupler": [20, 0], "rocker": [150, 0]},
            "drives.theta1.values": [22.7, 25.0],
        },
    ),
}
#: several loops that no single joint would close
SEVERAL = "rods of a delta robot too short"
FILES[SEVERAL] = example(
    "delta-by-hand",
    {
        "path": None,
        "patterns.arm.drives.q.values": [0, 5],
        **{
            f"patterns.arm.joints.wrist{rod}": {
                "type": "spherical",
                "on": {f"rod{rod}": ["x", side, "z - 100"], "platform": ["platform", side, "-height"]},
            }
            for rod, side in (("a", "half"), ("b", "-half"))
        },
    },
)
LOOPS = {
    "coupler too short": ["J1", "J2", "J3", "J4"],
    "rod in space too short": ["crank", "hook", "ball", "rocker"],
    "start forgotten": ["J1", "P", "J2", "J3"],
    "drive out of range": ["J1", "J2", "J3", "J4"],
    "slider beyond": ["main", "crankpin", "wristpin", "guide"],
    "elastic coupler too short": ["J1", "J2", "J3", "J4"],
}


def found(name: str) -> Failure:
    what = failure(FILES[name])
    assert what is not None
    return what


def named(name: str, what: Failure) -> list[str]:
    m = FILES[name]
    inner = {member.joint for member in m.members}
    return [m.joints[k] for k in what.found.loop if k not in inner]


def assembles(m: jp.Mechanism, drives: np.ndarray, near: np.ndarray | None = None) -> bool:
    """Whether the core closes it from any of many starts."""
    closing, guess = Closing(m), np.array(m.core_spec["guess"])
    tried = [guess, *starts(m, guess, 40)]
    if near is not None:
        tried += [*starts(m, near, 20, 0.02), *starts(m, near, 20, 0.2)]
    return any(closing.closed(drives, start) is not None for start in tried)


def with_length(m: jp.Mechanism, cure: Cure, length: float) -> jp.Mechanism:
    """The file with the joint at the end of a length moved along it; lengths in metres."""
    places: dict[str, Any] = {}
    for joint in (cure.start, cure.end):
        place = m.value(f"joints.{joint}.on.{cure.body}")
        places[joint] = np.array(place["at"] if isinstance(place, dict) else place, dtype=float)
    start, end = places[cure.start], places[cure.end]
    moved = (start + (end - start) * length / cure.now).tolist()
    key = f"joints.{cure.end}.on.{cure.body}"
    return m.with_({f"{key}.at" if isinstance(m.value(key), dict) else key: moved})


@pytest.mark.parametrize("name", FILES)
def test_what_stays_open_is_said_of_every_file(name: str) -> None:
    what = found(name)
    assert any("cannot be assembled" in sentence for sentence in what.words)
    if name in LOOPS:
        assert what.found.is_loop
        assert sorted(named(name, what)) == sorted(LOOPS[name])
        order = named(name, what)
        expected = [{a, b} for a, b in pairwise([*LOOPS[name], LOOPS[name][0]])]
        assert all({a, b} in expected for a, b in pairwise([*order, order[0]]))
    assert jp.solve(FILES[name]).attrs["failure"] == "\n".join(what.words)
    assert jp.check(FILES[name]).attrs["failure"] == "\n".join(what.words)


#: where only a start is reported, because no minimum near the start of the file has a single open joint
ALL_OPEN = "start of another shape"
ONE_OPEN = [name for name in FILES if name not in (ALL_OPEN, SEVERAL)]


def test_without_a_single_open_joint_only_the_start_is_reported() -> None:
    what = found(ALL_OPEN)
    assert what.found.joint < 0
    assert what.found.start is not None
    assert not any("open by" in sentence for sentence in what.words)


def test_joints_that_are_open_together_are_named_by_their_gaps() -> None:
    """Of rods that are all too short nothing was reported, and nothing could be drawn."""
    m, what = FILES[SEVERAL], found(SEVERAL)
    gaps = m.core.gaps(what.found.drives, what.found.poses)
    joints = np.array([joint for joint, _ in m.core.rows])
    turns = np.array(Closing(m).units == 1.0)
    assert what.found.joint < 0
    assert len(what.found.open) > 1
    for joint, gap, turn in what.found.open:
        own = (joints == joint) & (np.arange(len(gaps)) < Closing(m).joint_rows)
        assert np.linalg.norm(gaps[own & ~turns]) == pytest.approx(gap, rel=1e-9, abs=1e-12)
        assert np.linalg.norm(gaps[own & turns]) == pytest.approx(turn, rel=1e-9, abs=1e-12)
    # It is a minimum of the squared gaps: the poses count to second order only.
    closing = Closing(m)
    scaled = gaps / closing.units
    jacobian = m.core.jacobian(what.found.poses) / closing.units[:, None] * closing.unknowns
    assert np.abs(jacobian.T @ scaled).max() < 1e-4 * np.linalg.norm(scaled)
    largest = m.joints[what.found.open[0][0]]
    assert any(f"several joints are open together: '{largest}' by" in sentence for sentence in what.words)


def test_large_mechanisms_are_looked_at_too() -> None:
    """Of more than 60 unknowns nothing was reported."""
    count, short = 13, 80.0
    cranks = {f"c{k}": {"angle": 60} for k in range(count)}
    joints: dict[str, Any] = {
        f"A{k}": {"type": "revolute", "on": {"ground": [120 * k, 0], f"c{k}": [0, 0]}} for k in range(count)
    }
    for k in range(count - 1):
        length = 120 - short * (k == 6)
        joints[f"B{k}"] = {"type": "revolute", "on": {f"c{k}": [50 + k % 2, 0], f"r{k}": [0, 0]}}
        joints[f"C{k}"] = {"type": "revolute", "on": {f"r{k}": [length, 0], f"c{k + 1}": [50, 0]}}
    m = jp.Mechanism(
        {
            "format": 1,
            "units": {"length": "mm", "angle": "deg", "force": "N"},
            "joints": joints,
            "start": {**cranks, **{f"r{k}": {"angle": 0} for k in range(count - 1)}},
            "drives": {"q": {"joint": "A0", "values": [60]}},
            "output": {"body": f"c{count - 1}", "at": [50, 0]},
        }
    )
    assert 3 * len(m.bodies) > 60
    what = failure(m)
    assert what is not None
    assert what.found.joint >= 0
    assert "is open by" in " ".join(what.words)


@pytest.mark.parametrize("name", ONE_OPEN)
def test_every_joint_but_the_open_one_is_closed_in_the_attempt(name: str) -> None:
    m, what = FILES[name], found(name).found
    gaps = m.core.gaps(what.drives, what.poses)
    joints = np.array([joint for joint, _ in m.core.rows])
    own = (joints == what.joint) & (np.arange(len(gaps)) < Closing(m).joint_rows)
    turns = np.array(Closing(m).units == 1.0)
    assert np.linalg.norm(gaps[own & ~turns]) == pytest.approx(what.gap, rel=1e-6)
    # The others are held by a heavy weight, not exactly.
    assert np.abs(gaps[~own]).max() < 2e-4 * max(what.gap, m.length * what.turn)


@pytest.mark.parametrize("name", FILES)
def test_lengths_that_are_said_to_close_a_loop_do_and_a_little_less_does_not(name: str) -> None:
    m, what = FILES[name], found(name).found
    for cure in what.cures:
        near, far = (cure.low, cure.high) if cure.low > cure.now else (cure.high, cure.low)
        slack = 2e-3 * abs(near - cure.now)
        sign = 1.0 if near > cure.now else -1.0
        assert assembles(with_length(m, cure, near + sign * 1e-5 * m.length), what.drives, what.poses), cure
        assert not assembles(with_length(m, cure, near - sign * slack), what.drives, what.poses), cure
        assert assembles(with_length(m, cure, far), what.drives, what.poses), cure
        if 2e-5 * m.length < far < 3.99 * max(cure.now, m.length):
            assert not assembles(with_length(m, cure, far + sign * 0.02 * m.length), what.drives, what.poses), cure


def test_lengths_of_a_four_bar_are_those_of_the_triangle_inequality() -> None:
    """With the crank held, coupler and rocker reach a distance d when |a - b| <= d <= a + b."""
    what = found("coupler too short").found
    crank = 75.0 * np.array([np.cos(what.drives[0]), np.sin(what.drives[0])])
    d = float(np.linalg.norm(crank - [-100.0, 0.0]))
    assert what.gap == pytest.approx(1e-3 * (d - 170.0), rel=1e-5)
    cures = {cure.body: cure for cure in what.cures}
    # The lower limit has room of 1e-5 of the size, the upper one is found by bisection of its last step.
    assert cures["coupler"].low * 1e3 == pytest.approx(d - 150.0, abs=3e-3)
    assert cures["coupler"].high * 1e3 == pytest.approx(d + 150.0, abs=0.2)
    assert cures["rocker"].low * 1e3 == pytest.approx(d - 20.0, abs=3e-3)
    assert cures["rocker"].high * 1e3 == pytest.approx(d + 20.0, abs=0.2)


def test_the_range_of_a_drive_is_that_of_the_closed_form() -> None:
    """d^2 = 75^2 + 100^2 + 2 75 100 cos(theta) >= (150 - 75)^2."""
    what = found("drive out of range")
    limit = np.degrees(np.arccos((75.0**2 - 75.0**2 - 100.0**2) / (2 * 75.0 * 100.0)))
    assert what.found.reach is not None
    np.testing.assert_allclose(np.degrees(what.found.reach), [-limit, limit], atol=1e-4)
    assert what.found.limit is not None
    assert np.degrees(what.found.limit[0]) == pytest.approx(limit, abs=1e-4)
    assert what.words[0] == "Configurations 10 to 11 (of 0 to 11) cannot be assembled: beyond theta1 = 131.8 deg."


@pytest.mark.parametrize("name", ["start forgotten", "start of another shape"])
def test_a_start_that_is_said_to_work_can_be_pasted(name: str) -> None:
    m, what = FILES[name], found(name)
    lines = what.words[what.words.index("[start]") :]
    pasted = "\n".join(line for line in lines if line == "[start]" or re.match(r"\S+ = \{", line))
    cleared = m.with_({"start": None})
    import tomllib

    better = cleared.with_({"start": tomllib.loads(pasted)["start"]})
    assert np.isfinite(better.core.trace(np.ascontiguousarray(m.drive_values[:1]))["poses"]).all()
    assert not what.found.cures or m.data.start


def test_a_loop_that_closes_is_not_named() -> None:
    """The crank and rocker of the six-bar close; only the dyad behind them is too short to reach."""
    m, what = FILES["second loop too short"], found("second loop too short")
    assert m.joints[what.found.joint] in ("E", "F", "G")


#: of what stays open
RED = "#d00000"


@pytest.mark.parametrize("name", [*ONE_OPEN, SEVERAL])
def test_the_gap_is_drawn_in_red(name: str, tmp_path: Path) -> None:
    from jointplay import plot

    m, what = FILES[name], found(name).found
    figure = plot.mechanism(m, what.configuration)
    red = [line for line in figure.axes[0].get_lines() if mpl.colors.to_hex(line.get_color()) == RED]
    assert red
    if what.joint < 0:
        assert len(red) == len(what.open)
        return
    assert m.joints[what.joint] in str(red[-1].get_label())
    if what.turn == 0.0 and m.pose_size == 3:
        ends = red[-1].get_xydata()
        assert np.linalg.norm(np.diff(ends, axis=0)) == pytest.approx(what.gap / m.units.length, rel=1e-3)


def test_the_command_says_it_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "short.toml"
    text = examples.text("four-bar").replace("coupler = [75, 0], rocker", "coupler = [20, 0], rocker")
    file.write_text(text)
    for command in (["check", str(file)], ["solve", str(file)], ["error", str(file), "-q", "worst"]):
        assert run(command) == 1
        assert "The loop J1, J2, J3, J4 stays open at theta1 = 22.7 deg." in capsys.readouterr().out
    drawing = tmp_path / "short.png"
    assert run(["solve", str(file), "--plot", str(drawing)]) == 1
    assert drawing.stat().st_size > 10_000


def test_bodies_whose_names_look_alike_may_be_one() -> None:
    text = examples.text("four-bar").replace("coupler", "rod1")
    slip = text.replace("{ rod1 = [75, 0], rocker", "{ rodl = [75, 0], rocker")
    slip = slip[: slip.index("[dimensions")] if "[dimensions" in slip else slip
    slip = "\n".join(line for line in slip.splitlines() if not line.startswith("rod1 ="))
    with pytest.raises(
        jp.InputError, match=r"did you mean '(rod1|rodl)'\? '(rod1|rodl)' is on one joint as well: are they one body"
    ):
        jp.loads(slip)


def test_hints_where_another_unit_was_meant() -> None:
    text = examples.text("four-bar")
    assert hints(jp.loads(text)) == []
    in_radians = jp.loads(text.replace('angle = "deg"', 'angle = "rad"')).with_({"start.crank.angle": 360})
    assert "looks like degrees" in hints(in_radians)[0]
    radians = {"start.crank.angle": 0.396, "start.coupler.angle": 2.25, "start.rocker.angle": 0.62}
    assert "look like radians" in hints(jp.loads(text).with_(radians))[0]
    large = hints(jp.loads(text).with_({"joints.J2.clearance": {"radial": 8}}))
    assert large == ["The radial clearance of J2 is 8 mm, above a tenth of a link (75 mm): is it in another unit?"]
    assert "stiffer than any material" in hints(jp.loads(text).with_({"bodies.coupler": {"E": 210e9, "area": 50}}))[0]
    places = {"J2": {"crank": [0.075, 0], "coupler": [0, 0]}, "J3": {"coupler": [0.075, 0], "rocker": [0.15, 0]}}
    small = {f"joints.{name}.on": on for name, on in places.items()} | {
        "joints.J4.on": {"ground": [-0.1, 0], "rocker": [0, 0]},
        "joints.*.clearance": {"radial": 0.0001},
        "output.at": [0.15, 0],
    }
    assert "lengths look like metres" in hints(jp.loads(text).with_(small))[0]


@pytest.mark.parametrize("name", examples.names())
def test_no_example_has_a_hint(name: str) -> None:
    assert hints(jp.loads(examples.text(name))) == []


def test_a_mechanism_that_assembles_has_no_failure() -> None:
    assert failure(example("four-bar")) is None
    assert "failure" not in jp.check(example("delta")).attrs


def test_an_attempt_is_the_same_each_time() -> None:
    one, other = (found("rod in space too short").found for _ in range(2))
    assert [getattr(one, f.name) for f in dataclasses.fields(one) if f.name not in ("drives", "poses", "limit")] == [
        getattr(other, f.name) for f in dataclasses.fields(other) if f.name not in ("drives", "poses", "limit")
    ]
    assert (one.poses == other.poses).all()
