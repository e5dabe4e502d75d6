"""Forces of drives and joints where a mechanism is displaced, as functions of the offsets.

With the closure r(x, u, q) = 0 and what loads and springs do along the motions, W(x), the multipliers l(u) are those of
the displaced pose x(u):

    J(x)^T l = W(x)
    drive d: -sum c_r l_r over the rows r that it commands
    joint j: |sum J_r^T l_r| over its rows r, along its second body

so that a drive gives what its motion takes from the loads, F . dx/dq_d, without friction. Their derivatives by the
offsets are central differences on the exact closure.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointplay.analyses.nominal import OK, Nominal
from jointplay.basics.arrays import Floats, Ints
from jointplay.core.compile import LENGTHS
from jointplay.errors import InputError, not_known
from jointplay.model.inertia import acting
from jointplay.model.mechanism import Mechanism
from jointplay.result import BELONGS, Labels, axes_of

#: numbers of Jacobians at a time, which bounds the memory
NUMBERS = 4_000_000
#: differences of offsets: parts of the mechanism's length, radians, kelvin
STEP = {"length": 1e-5, "angle": 1e-5, "temperature": 1.0}


@dataclass(frozen=True)
class Balances:
    """Statics of a determinate mechanism near its nominal configurations."""

    #: in one load case
    m: Mechanism
    at: Nominal
    #: force and moment of every load, SI, shape (configuration, load, 6); None where they are the same in all
    loads: Floats | None

    @cached_property
    def named(self) -> Labels:
        """The forces: ``drives.NAME`` along its coordinate, ``joints.NAME`` the size of the reaction."""
        m = self.m
        kinds = (*(BELONGS["work"][m.coordinate_kind(joint)] for joint in m.drive_joints), *["force"] * len(m.joints))
        return Labels((*(f"drives.{name}" for name in m.drives), *(f"joints.{name}" for name in m.joints)), kinds)

    @cached_property
    def wrenches(self) -> Floats:
        """Of all configurations, one load after the other."""
        found = acting(self.m, None, [0]) if self.loads is None else self.loads
        return np.ascontiguousarray(np.broadcast_to(found.reshape(len(found), -1), (len(self.at), found[0].size)))

    @property
    def zero(self) -> Floats:
        """No offset and no deviation, in every configuration."""
        return np.zeros((len(self.at), len(self.m.parameters)))

    def nominal(self) -> Floats:
        """Forces of the nominal mechanism, SI, shape (configuration, force)."""
        return self._at_poses(np.arange(len(self.at)), self.at.poses, self.zero)

    def forces(self, which: Ints, u: Floats) -> Floats:
        """Forces at offsets, SI, shape (case, force); nan where there is no regular pose.

        Parameters
        ----------
        which : ndarray of int
            The configuration of every case.
        u : ndarray
            Values of all parameters, shape (case, parameter).
        """
        size = max(NUMBERS // max(len(self.m.core.rows) ** 2, 1), 1)
        starts = range(0, max(len(u), 1), size)
        return np.concatenate([self._forces(which[k : k + size], u[k : k + size]) for k in starts])

    def slopes(self, which: Ints, u: Floats) -> Floats:
        """Derivatives of the forces by all parameters at offsets, shape (case, force, parameter)."""
        count = len(self._steps)
        ends = []
        for sign in (1.0, -1.0):
            moved = (u[:, None] + sign * np.diag(self._steps)).reshape(len(u) * count, count)
            ends.append(self.forces(np.repeat(which, count), moved).reshape(len(u), count, len(self.named.labels)))
        return np.swapaxes((ends[0] - ends[1]) / (2.0 * self._steps[:, None]), 1, 2)

    @cached_property
    def _steps(self) -> Floats:
        kinds = axes_of(self.m)["parameter"].kinds
        return np.array([STEP[kind] * (self.m.length if kind == "length" else 1.0) for kind in kinds])

    def _forces(self, which: Ints, u: Floats) -> Floats:
        drives, nominal, u = self.at.drives[which], self.at.poses[which], np.ascontiguousarray(u)
        found = self.m.core.given(drives, nominal, u)
        placed = np.array(found["poses"])
        placed[found["status"] != OK] = np.nan
        return self._at_poses(which, placed, u)

    def _at_poses(self, which: Ints, placed: Floats, u: Floats) -> Floats:
        known = np.isfinite(placed).all(axis=(1, 2)) & np.isfinite(u).all(axis=1)
        forces = np.full((len(placed), len(self.named.labels)), np.nan)
        if not known.any():
            return forces
        which = which[known]
        own = np.ascontiguousarray(placed[known]), np.ascontiguousarray(u[known])
        balance = self.m.core.balance(self.at.drives[which], *own, self.wrenches[which])
        jacobian = balance["jacobian"]
        # Reactions have the sign that the joint pushes its second body with.
        pushed = -np.linalg.solve(np.swapaxes(jacobian, 1, 2), balance["loads"][..., None])[..., 0]
        drives = pushed @ self._commanded.T
        pushes = [
            np.linalg.norm(np.einsum("nr,nrk->nk", pushed[:, rows], jacobian[:, rows][..., columns]), axis=1)
            for rows, columns in self._of_joints
        ]
        forces[known] = np.column_stack([drives, *pushes])
        return forces

    @cached_property
    def _commanded(self) -> Floats:
        """How much every row counts in every drive, shape (drive, row)."""
        m, rows = self.m, self.m.core.rows
        found = np.zeros((len(m.drives), len(rows)))
        for k, moves in enumerate(m.drive_moves):
            for joint, coefficient in moves:
                component = "angle" if m.coordinate_kind(joint) == "angle" else "along"
                found[k, rows.index((joint, component))] = coefficient
        return found

    @cached_property
    def _of_joints(self) -> list[tuple[Ints, Ints]]:
        """Of every joint its rows, and the columns of the translations of its second body, or of its first."""
        m = self.m
        owners = np.array([joint for joint, _ in m.core.rows])
        width = len(m.components)
        lengths = np.flatnonzero([name in LENGTHS for name in m.components])
        bodies = [[m.points[p].body for p in reversed(points)] for points in m.joint_points]
        carried = [next(body for body in pair if body >= 0) for pair in bodies]
        return [(np.flatnonzero(owners == joint), width * body + lengths) for joint, body in enumerate(carried)]


def chosen(named: Sequence[str], of: tuple[str, ...] | None, file: str) -> Ints:
    """Places of some forces; all of them where nothing is named."""
    if of is None:
        return np.arange(len(named))
    if not of:
        raise InputError("name at least one force, such as drives.theta1 or joints.J1", file=file, key="of")
    for name in of:
        if name not in named:
            raise InputError(not_known(name, "a force", named), file=file, key="of")
    return np.array([named.index(name) for name in of])
