"""W3: a map of the errors under load of a 3-RRR robot over 10^6 configurations.

    J x = du            closure to first order: bodies' displacements x, plays du
    J^T l = w           statics: the load w on the bodies, the forces l in the joints
    du = r l / |l|      every pin is pushed across its play along the force it transmits

is what the peers compute: the error to first order at the nominal pose. jointplay gives it, too, and beside it the
error on the exact closure, the reactions, every pin's position and share, and what the load leaves undecided.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

import closed_form
import jointplay as jp
import w1_fourbar
from harness import Contender, Report, Target, interleave, narrower, number, ratio, rows, scaling
from jointplay import examples
from revolute import CHUNK, Revolute, revolute
from scatter import problem

Array = NDArray[np.float64]
PER_DRIVE, MAPPED = 100, 40
REACH = np.radians(6)
#: configurations whose results are in memory at a time
BATCH = 1 << 15
OK = 0  # status
MAP = "jointplay, `jp.map`: ways from node to node and limits as well"
STACKED, POSES = "NumPy, stacked 21 × 21, poses given", "NumPy, stacked 21 × 21, poses and statics"


class Statics:
    """Error to first order under a load on the output, at given poses."""

    def __init__(self, model: Revolute, load: Array, radius: float) -> None:
        self.model, self.load, self.radius = model, load, radius

    def stacked(self, poses: Array, drives: Array) -> Array:
        """All unknowns of all bodies: two systems per configuration."""
        model = self.model
        none = np.zeros((len(poses), 2 * model.joints))
        at = np.broadcast_to(model.at, (len(poses), *model.at.shape))
        jacobian = model.system(poses, at, none, drives)[1]
        body = slice(3 * model.body[model.output], 3 * model.body[model.output] + 3)
        load = np.zeros((len(poses), model.size, 1))
        load[:, body, 0] = self.load
        force = np.linalg.solve(jacobian.transpose(0, 2, 1), load)[:, : 2 * model.joints, 0]
        force = force.reshape(len(poses), model.joints, 2)
        play = np.zeros((len(poses), model.size, 1))
        play[:, : 2 * model.joints, 0] = (self.radius * force / np.hypot(*force.T).T[:, :, None]).reshape(
            len(poses), -1
        )
        return np.linalg.solve(jacobian, play)[:, body, 0]

    def with_poses(self, drives: Array) -> Array:
        """Nominal poses by Newton's method, then the same."""
        return self.stacked(self.model.nominal_poses(drives), drives)

    def by_hand(self, poses: Array) -> Array:
        """Reduce it by hand to the platform: every leg carries a force along its lower link, across three pins."""
        model = self.model
        legs = [(model.body[model.first[k]], model.body[model.second[k]], k) for k in (2, 5, 8)]
        system = np.empty((len(poses), 3, 3))
        for row, (lower, platform, k) in enumerate(legs):
            c, s = np.cos(poses[:, lower, 2]), np.sin(poses[:, lower, 2])
            x, y = model.at[model.second[k]]
            cp, sp = np.cos(poses[:, platform, 2]), np.sin(poses[:, platform, 2])
            rx, ry = cp * x - sp * y, sp * x + cp * y
            system[:, row] = np.stack([c, s, rx * s - ry * c], axis=1)
        load = np.broadcast_to(self.load[:, None], (len(poses), 3, 1))
        force = np.linalg.solve(system.transpose(0, 2, 1), load)
        return np.linalg.solve(system, 3 * self.radius * np.sign(force))[:, :, 0]


def in_chunks(solve: Callable[..., Array], *arrays: Array) -> Array:
    """Chunk by chunk, so that the stacked matrices stay in the cache."""
    return np.concatenate([solve(*(a[k : k + CHUNK] for a in arrays)) for k in range(0, len(arrays[0]), CHUNK)])


def one_by_one(solve: Callable[..., Array], *arrays: Array) -> Array:
    """One configuration at a time."""
    return np.concatenate([solve(*(a[k : k + 1] for a in arrays)) for k in range(len(arrays[0]))])


def grid(middle: Array) -> Array:
    """All combinations of three drives' values, back and forth, so that neighbours follow one another."""
    steps = np.linspace(-REACH, REACH, PER_DRIVE)
    i, j, k = np.indices((PER_DRIVE,) * 3)
    j = np.where(i % 2, PER_DRIVE - 1 - j, j)
    k = np.where((i + j) % 2, PER_DRIVE - 1 - k, k)
    return middle + np.stack([steps[i.ravel()], steps[j.ravel()], steps[k.ravel()]], axis=1)


def measure(rounds: int) -> Report:
    """Measure all programs, then jointplay on two cores."""
    mechanism = jp.loads(examples.text("3-rrr"))
    core, model = mechanism.core, revolute(mechanism)
    (load,) = mechanism.spec()["loads"]
    radius = float(mechanism.value("joints.*.clearance.radial")) * 1e-3
    statics = Statics(model, np.array([*load["force"][:2], load["moment"][2]]), radius)
    middle = mechanism.drive_values[0]
    drives = grid(middle)
    traced = core.trace(drives)
    poses = traced["poses"]

    def pushed() -> None:
        for k in range(0, len(drives), BATCH):
            core.loaded(drives[k : k + BATCH], poses[k : k + BATCH])

    def whole() -> None:
        for k in range(0, len(drives), BATCH):
            part = drives[k : k + BATCH]
            core.loaded(part, core.trace(part)["poses"])

    angles = {n: np.linspace(-REACH, REACH, MAPPED) + at for n, at in zip(mechanism.drives, middle, strict=True)}
    degrees = {name: np.degrees(values) for name, values in angles.items()}
    nodes = np.stack(np.meshgrid(*angles.values(), indexing="ij"), axis=-1).reshape(-1, len(angles))
    shown = jp.map(mechanism, grid=degrees).error.values.reshape(len(nodes), -1) * [1e-3, 1e-3, np.radians(1.0)]
    same = core.loaded(nodes, core.trace(nodes)["poses"])["error"]
    apart = np.nanmax(np.abs(shown - same) / np.nanmax(np.abs(same), axis=0))

    found = core.loaded(drives, poses)
    decided = np.flatnonzero(found["status"] == OK)
    many = np.random.default_rng(1).choice(decided, 1 << 13, replace=False)
    few, mine = many[: 1 << 10], found["error_first_order"]
    scale = np.abs(mine[many]).max(axis=0)
    both = np.abs(found["error"][many] - mine[many]) / scale

    def peer(name: str, run: Callable[[Array], Array], chosen: Array) -> Contender:
        difference = (np.abs(run(chosen) - mine[chosen]) / scale).max()
        return Contender(name, lambda: run(chosen), len(chosen), f"first order: {difference:.0e}")

    contenders = [
        Contender("jointplay, poses given", pushed, len(drives), "reference", ours=True),
        Contender("jointplay, poses and statics", whole, len(drives), "the same numbers", ours=True),
        Contender(MAP, lambda: jp.map(mechanism, grid=degrees), len(nodes), f"exact closure: {apart:.0e}", ours=True),
        peer(STACKED, lambda k: in_chunks(statics.stacked, poses[k], drives[k]), many),
        peer(POSES, lambda k: in_chunks(statics.with_poses, drives[k]), many),
        peer("NumPy, reduced by hand to 3 × 3, poses given", lambda k: in_chunks(statics.by_hand, poses[k]), many),
        peer("NumPy, one by one, poses given", lambda k: one_by_one(statics.stacked, poses[k], drives[k]), few),
        peer("NumPy, one by one, poses and statics", lambda k: one_by_one(statics.with_poses, drives[k]), few),
    ]
    rounds = min(rounds, 5)
    seconds = interleave(contenders, rounds)
    first, second = (c.name for c in contenders[:2])
    control = closed_form.InC(problem(jp.load(str(w1_fourbar.FILE))))
    return Report(
        "W3",
        "Errors under load of a 3-RRR robot over its workspace",
        ["program", "ns per configuration", "at AVX2", "times jointplay's, poses given", "agreement"],
        rows(contenders, seconds, first),
        [
            narrower("W3", seconds, contenders[0]),
            Target(f"W3: {STACKED}, against jointplay", 20, False, ratio(seconds, STACKED, first).median),
            Target(f"W3: {POSES}, against jointplay", 20, False, ratio(seconds, POSES, second).median),
            scaling("W3", lambda _: whole(), control.in_threads(8 * w1_fourbar.SAMPLES), rounds),
        ],
        [
            f"{len(decided):,} of {len(drives):,} configurations are decided; the peers solve {len(many):,} of them, "
            f"one by one {len(few):,}. The exact closure, which jointplay gives beside the first order, differs from "
            f"it by up to {number(both.max() * 100)} % of the largest error of a component."
        ],
    )
