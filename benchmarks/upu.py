"""The 3-UPU robot in closed form: in C (upu.c, the limit) and with NumPy; its loops closed by pinocchio."""

import ctypes
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from closed_form import compiled, pointer

Array = NDArray[np.float64]
LEGS = np.arange(3) * 2 * np.pi / 3
OUTWARDS = np.column_stack([np.cos(LEGS), np.sin(LEGS), np.zeros(3)])
PINS = np.column_stack([-np.sin(LEGS), np.cos(LEGS), np.zeros(3)])


@dataclass(frozen=True)
class Robot:
    """Sizes in metres and the load on the platform, in the order of the C structure."""

    base: float
    platform: float
    radial: float
    axial: float
    half_pin: float
    gap: float
    guide_length: float
    guide_width: float
    force: tuple[float, float, float]
    moment: tuple[float, float, float]

    def lengths(self, p: Array) -> Array:
        """Leg lengths at positions of the platform, [row, 3]."""
        return np.linalg.norm(p[:, None] - (self.base - self.platform) * OUTWARDS, axis=2)

    def positions(self, lengths: Array) -> Array:
        """The other way round: the upper of the two points where three spheres meet."""
        d = self.base - self.platform
        a, b, c = lengths.T**2
        x, y = (b + c - 2 * a) / (6 * d), (c - b) / (2 * np.sqrt(3) * d)
        return np.column_stack([x, y, np.sqrt((a + b + c) / 3 - d**2 - x**2 - y**2)])

    def errors(self, lengths: Array) -> Array:
        """Errors under the load to first order, [row, 6]."""
        arms = self.positions(lengths)[:, None] - (self.base - self.platform) * OUTWARDS
        s = arms / lengths[:, :, None]
        cosine = (s * PINS).sum(axis=2)
        sine = np.sqrt(1 - cosine**2)
        n = (s - cosine[:, :, None] * PINS) / sine[:, :, None]
        levers = np.cross(self.platform * OUTWARDS, s)
        load = np.broadcast_to(np.array(self.force)[:, None], (len(s), 3, 1))
        f = -np.linalg.solve(s.transpose(0, 2, 1), load)[:, :, 0]
        couple = self.moment + np.einsum("ki,kij->kj", f, levers)
        q = -np.linalg.solve(n.transpose(0, 2, 1), couple[:, :, None])[:, :, 0] / self.half_pin
        ends = np.hypot(f * sine, q)
        one, other = (np.sqrt(f**2 + q**2 - sign * 2 * f * q * cosine) for sign in (1, -1))
        along = 2 * (self.radial * f * sine**2 / ends + self.axial * np.abs(cosine) * np.sign(f))
        along += self.radial * ((f - q * cosine) / one + (f + q * cosine) / other)
        turn = self.radial * (2 * q / ends + (q - f * cosine) / one + (q + f * cosine) / other) / self.half_pin
        guide = np.maximum(2 * sine / self.guide_width, 2 * np.abs(cosine) / self.guide_length)
        turn += self.gap * np.sign(q) * guide
        w = -np.linalg.solve(n, turn[:, :, None])
        v = -np.linalg.solve(s, along[:, :, None] + levers @ w)
        return np.concatenate([v, w], axis=1)[:, :, 0]


class _Robot(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_double) for name in list(Robot.__dataclass_fields__)[:8]),
        ("force", ctypes.c_double * 3),
        ("moment", ctypes.c_double * 3),
    )


def in_c(robot: Robot) -> Callable[[Array], Array]:
    """upu.c for one robot."""
    library = compiled(Path(__file__).with_name("upu.c"), "upu")
    structure = _Robot(**asdict(robot))

    def solve(lengths: Array) -> Array:
        lengths = np.ascontiguousarray(lengths)
        errors = np.empty((len(lengths), 6))
        library.map(ctypes.byref(structure), ctypes.c_int64(len(lengths)), pointer(lengths), pointer(errors))
        return errors

    return solve


def turned(roll: float, tilt_side: float, tilt_normal: float) -> Array:
    """Axes of a joint's second body in those of its first, turned by its play."""
    x = np.array([np.sqrt(1 - tilt_side**2 - tilt_normal**2), tilt_normal, -tilt_side])
    y = np.array([0.0, np.cos(roll), np.sin(roll)])
    y[0] = -(x @ y) / x[0]
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def in_pinocchio(spec: dict[str, Any], poses: Array, lengths: Array) -> Callable[[Array], Array]:
    """Three chains of four revolute joints, closed at the platform sample by sample; plays enter as placements.

    `poses` are those of all bodies at the nominal configuration; a row of offsets goes joint by joint, as in jointplay.
    """
    import pinocchio as pin

    points, joints = spec["points"], spec["joints"]

    def frame(joint: dict[str, Any], end: str) -> Any:
        x, y = np.array(joint[f"axis_{end}"]), np.array(joint[f"side_{end}"])
        return pin.SE3(np.column_stack([x, y, np.cross(x, y)]), np.array(points[joint[end]]["at"]))

    def body(joint: dict[str, Any], end: str) -> Any:
        b = points[joint[end]]["body"]
        return pin.SE3(pin.Quaternion(*poses[b, 3:]).matrix(), poses[b, :3]) if b >= 0 else pin.SE3.Identity()

    ends = [(frame(joint, "first"), frame(joint, "second").inverse()) for joint in joints]
    model, start, tips = pin.Model(), [], []
    place = [pin.SE3.Identity()] * len(joints)
    for k, joint in enumerate(joints):
        parent = 0 if k % 5 == 0 else model.njoints - 1
        if joint["kind"] == "prismatic":
            continue
        model.addJoint(parent, pin.JointModelRX(), pin.SE3.Identity(), str(k))
        relative = (body(joint, "first") * ends[k][0]).inverse() * body(joint, "second") * ends[k][1].inverse()
        start.append(np.arctan2(relative.rotation[2, 1], relative.rotation[1, 1]))
        if k % 5 == 4:
            tips.append(model.njoints - 1)
    q0, data = np.array(start), model.createData()
    output = np.array(points[spec["output"]["point"]]["at"])
    top = body(joints[-1], "second")
    nominal = top.act(output)

    def chain(u: Array) -> None:
        """Put the plays of a sample into the placements."""
        number = 1
        for k, joint in enumerate(joints):
            d = u[5 * k : 5 * k + 5]
            if joint["kind"] == "prismatic":
                slid = pin.SE3(turned(*d[2:]), np.array([lengths[k // 5], d[0], d[1]]))
                place[k] = place[k - 1] * ends[k][0] * slid * ends[k][1]
                continue
            before = pin.SE3.Identity() if k % 5 == 0 else place[k - 1]
            play = pin.SE3(turned(0.0, d[3], d[4]), d[:3])
            model.jointPlacements[number] = before * ends[k][0] * play
            place[k], number = ends[k][1], number + 1

    def moves(joint: int, offset: Any) -> Array:
        local = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL)
        return offset.inverse().action @ local

    def solve(offsets: Array) -> Array:
        out = np.empty((len(offsets), 6))
        for i, u in enumerate(offsets):
            chain(u)
            q = q0.copy()
            for _ in range(8):
                pin.computeJointJacobians(model, data, q)
                frames = [data.oMi[j] * place[5 * leg + 4] for leg, j in enumerate(tips)]
                slopes = [moves(j, place[5 * leg + 4]) for leg, j in enumerate(tips)]
                gaps = [frames[0].inverse() * frames[leg] for leg in (1, 2)]
                system = np.concatenate(
                    [slopes[leg + 1] - gap.inverse().action @ slopes[0] for leg, gap in enumerate(gaps)]
                )
                step = np.linalg.solve(system, np.concatenate([pin.log6(gap).vector for gap in gaps]))
                q -= step
                if np.abs(step).max() < 1e-9:
                    break
            pin.forwardKinematics(model, data, q)
            reached = data.oMi[tips[0]] * place[4]
            out[i, :3] = reached.act(output) - nominal
            out[i, 3:] = pin.log3(reached.rotation @ top.rotation.T)
        return out

    return solve
