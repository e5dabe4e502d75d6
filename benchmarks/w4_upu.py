"""W4: the error under load of a 3-UPU robot over its workspace, and its scatter at one pose.

The limit is the closed form of this robot's error to first order (upu.c). jointplay solves the general model of 13
bodies and 15 joints, and gives the error on the exact closure, reactions, plays and shares, too.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

import closed_form
import jointplay as jp
import w1_fourbar
from harness import Contender, Report, Target, interleave, narrower, ratio, rows, scaling
from jointplay import examples
from revolute import CHUNK
from scatter import problem
from upu import Robot, in_c, in_pinocchio
from w3_map import MAP

Array = NDArray[np.float64]
PER_AXIS = 40
#: half the edges of the box of positions, metres, and its middle
HALF, MIDDLE = np.array([0.06, 0.06, 0.05]), np.array([0.0, 0.0, 0.4])
LOAD = {"force": [30.0, -20.0, -100.0], "moment": [1000.0, 2000.0, -500.0]}
#: the pose whose scatter is asked for
POSE = np.array([0.05, -0.03, 0.4])
SAMPLES, PIN_SAMPLES = 1 << 20, 1 << 9
LEVELS = np.array([0.5, 0.9, 0.99])
BATCH = 1 << 15
OK = 0  # status
GIVEN, WHOLE, SIX = "jointplay, poses given", "jointplay, poses and statics", "jointplay, 6-UPS, poses and statics"
LINEAR = "jointplay, poses and statics to first order"
IN_C, STACKED, SINGLE = "closed form in C", "closed form with NumPy", "closed form with NumPy, one by one"
SCATTER, PINOCCHIO = "jointplay, Monte Carlo", "pinocchio, closure of every sample"


def grid() -> Array:
    """Positions, back and forth, so that neighbours follow one another."""
    steps = np.linspace(-1, 1, PER_AXIS)
    i, j, k = np.indices((PER_AXIS,) * 3)
    j = np.where(i % 2, PER_AXIS - 1 - j, j)
    k = np.where((i + j) % 2, PER_AXIS - 1 - k, k)
    return MIDDLE + HALF * np.stack([steps[i.ravel()], steps[j.ravel()], steps[k.ravel()]], axis=1)


def six_legs(m: jp.Mechanism, positions: Array) -> Array:
    """Leg lengths of the 6-UPS, drawn assembled at the middle of the box, its platform moved and not turned."""
    points, joints = m.spec()["points"], dict(zip(m.joints, m.spec()["joints"], strict=True))
    ends = [(joints[f"base{k}.first"]["first"], joints[f"ball{k}"]["second"]) for k in range(1, 7)]
    spans = np.array([np.subtract(points[head]["at"], points[foot]["at"]) for foot, head in ends])
    return np.asarray(np.linalg.norm(spans + (positions - MIDDLE)[:, None], axis=2))


def robot(m: jp.Mechanism) -> Robot:
    """The sizes of the bundled example, which is written from them."""
    size = {key: float(value) * 1e-3 for key, value in examples.parameters("3-upu").items() if key != "layout"}
    return Robot(
        size["base_radius"],
        size["platform_radius"],
        size["radial"],
        size["axial"],
        size["pin_length"] / 2,
        size["gap"],
        size["guide_length"],
        size["guide_width"],
        tuple(m.spec()["loads"][0]["force"]),
        tuple(m.spec()["loads"][0]["moment"]),
    )


def mapped(core: Any, drives: Array) -> None:
    """Poses and statics of all rows, a batch in memory at a time."""
    for k in range(0, len(drives), BATCH):
        part = drives[k : k + BATCH]
        core.loaded(part, core.trace(part)["poses"])


def linear(core: Any, drives: Array) -> Array:
    """Errors of all rows to first order, what is undetermined and status, without anything else."""
    poses = core.trace(drives)["poses"]
    found: Array = core.loaded(drives, poses, exact=False, offset=False, details=False)["error"]
    return found


def measure(rounds: int) -> Report:
    """Measure map and scatter, then jointplay on two cores."""
    m = jp.loads(examples.text("3-upu")).with_({"loads.0": LOAD})
    six = jp.loads(examples.text("stewart-gough")).with_({"loads.0": LOAD})
    core, closed = m.core, robot(m)
    c = in_c(closed)
    positions = grid()
    drives, drives_six = closed.lengths(positions), six_legs(six, positions)
    poses = core.trace(drives)["poses"]
    found = core.loaded(drives, poses)
    decided = np.flatnonzero(found["status"] == OK)
    first = found["error_first_order"]
    scale = np.abs(first[decided]).max(axis=0)
    many, few = decided[: 1 << 14], decided[: 1 << 10]

    def told(errors: Array, chosen: Array) -> str:
        return f"first order: {(np.abs(errors - first[chosen]) / scale).max():.0e}"

    def stacked(lengths: Array) -> Array:
        return np.concatenate([closed.errors(lengths[k : k + CHUNK]) for k in range(0, len(lengths), CHUNK)])

    def one_by_one(lengths: Array) -> Array:
        return np.concatenate([closed.errors(lengths[k : k + 1]) for k in range(len(lengths))])

    def pushed() -> None:
        for k in range(0, len(drives), BATCH):
            core.loaded(drives[k : k + BATCH], poses[k : k + BATCH])

    at = core.inverse(np.array([[*POSE, 0, 0, 0]]), np.array([1.0, 1, 1, 0, 0, 0]), m.start_drives)

    lengths = dict(zip(m.drives, (at["drives"][0] * 1e3).tolist(), strict=True))
    at_pose = m.with_({"path": None, **{f"drives.{name}.values": [value] for name, value in lengths.items()}})
    ends = zip("xyz", MIDDLE - HALF, MIDDLE + HALF, strict=True)
    axes = {name: 1e3 * np.linspace(low, high, PER_AXIS) for name, low, high in ends}
    shown = jp.map(m, grid=axes).error.sel(component=["x", "y", "z"]).values.reshape(-1, 3) * 1e-3
    nodes = np.stack(np.meshgrid(*axes.values(), indexing="ij"), axis=-1).reshape(-1, 3) * 1e-3
    legs = closed.lengths(nodes)
    same = core.loaded(legs, core.trace(legs)["poses"])["error"][:, :3]
    off = np.nanmax(np.abs(shown - same)) / np.nanmax(np.abs(same))

    drawn = core.random(at["drives"], at["poses"], PIN_SAMPLES, 1, LEVELS, None, None, 1, True)
    offsets, errors = drawn["kept_parameters"], drawn["kept_errors"]
    closure = in_pinocchio(m.spec(), at["poses"][0], at["drives"][0])
    apart = (np.abs(closure(offsets) - errors) / np.abs(errors).max(axis=0)).max()
    statuses = six.core.loaded(drives_six[:BATCH], six.core.trace(drives_six[:BATCH])["poses"])["status"]
    plain = [
        Contender(GIVEN, pushed, len(drives), "reference", ours=True),
        Contender(WHOLE, lambda: mapped(core, drives), len(drives), "the same numbers", ours=True),
        Contender(MAP, lambda: jp.map(m, grid=axes), len(drives), f"exact closure: {off:.0e}", ours=True),
        Contender(
            LINEAR, lambda: linear(core, drives), len(drives), told(linear(core, drives)[decided], decided), ours=True
        ),
        Contender(
            SIX,
            lambda: mapped(six.core, drives_six),
            len(drives_six),
            f"{(statuses == OK).mean():.0%} decided",
            ours=True,
        ),
        Contender(IN_C, lambda: c(drives), len(drives), told(c(drives[decided]), decided)),
        Contender(STACKED, lambda: stacked(drives[many]), len(many), told(stacked(drives[many]), many)),
        Contender(SINGLE, lambda: one_by_one(drives[few]), len(few), told(one_by_one(drives[few]), few)),
    ]
    samples = [
        Contender(SCATTER, lambda: jp.random(at_pose, SAMPLES, contact="scattered"), SAMPLES, "reference", ours=True),
        Contender(PINOCCHIO, lambda: closure(offsets), PIN_SAMPLES, f"exact closure: {apart:.0e}"),
    ]
    rounds = min(rounds, 5)
    seconds = interleave([*plain, *samples], rounds)
    control = closed_form.InC(problem(jp.load(str(w1_fourbar.FILE))))

    def against(name: str, other: str) -> float:
        return ratio(seconds, name, other).median

    return Report(
        "W4",
        "Errors under load of a 3-UPU robot over its workspace, and their scatter at one pose",
        ["program", "ns per configuration or sample", "at AVX2", "times jointplay's", "agreement"],
        rows(plain, seconds, GIVEN) + rows(samples, seconds, SCATTER),
        [
            narrower("W4", seconds, plain[0]),
            narrower("W4", seconds, samples[0]),
            Target(f"W4: {LINEAR}, against {IN_C}", 8, True, against(LINEAR, IN_C)),
            Target(f"W4: {STACKED}, against {LINEAR}", 10, False, against(STACKED, LINEAR)),
            Target(f"W4: {SINGLE}, against {LINEAR}", 1000, False, against(SINGLE, LINEAR)),
            Target("W4: a 6-UPS against a 3-UPU, twice the legs", 2, True, against(SIX, WHOLE)),
            Target(f"W4: {PINOCCHIO}, against jointplay", 500, False, against(PINOCCHIO, SCATTER)),
            scaling("W4", lambda _: mapped(core, drives), control.in_threads(8 * w1_fourbar.SAMPLES), rounds),
        ],
        [
            f"{len(decided):,} of {len(drives):,} configurations are decided; NumPy solves {len(many):,} of them, one "
            f"by one {len(few):,}. The closed forms give the error to first order and nothing else."
        ],
    )
