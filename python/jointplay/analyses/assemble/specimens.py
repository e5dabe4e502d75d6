"""Many specimens of one part: where the centres of its joints are, and what its members carry.

centre of a specimen = R(pose) (at + sum of the deviations that move it) + position(pose)

In a determinate part the forces are those of statics, whatever the deviations are. The deformation under the
loads is the same in all specimens to first order, and is added to the displacement by the offsets.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.core.compile import LOOSE
from jointplay.core.compile.coordinates import on_body
from jointplay.core.spec import ENDS
from jointplay.result import STATUSES

from .forces import Members
from .part import GROUND, Part
from .state import Held

#: rounding of the factor on the clearances
FITS = 1.0 + 1e-9


@dataclass(frozen=True, eq=False)
class StepSpecimens:
    """Specimens after a step; SI, indexed as in the whole mechanism, nan where nothing is yet or a specimen failed."""

    #: size of the position error of the centre on the first and on the second body of every joint; shape (end, joint,
    #: unit)
    centres: Floats
    #: error of the output; shape (unit, component)
    output: Floats
    #: size of the position error of every point of the part that was asked; shape (unit,)
    points: dict[int, Floats]
    #: of every member; shape (member, unit)
    force: Floats
    #: shape (unit,)
    clearance_factor: Floats
    #: shape (unit,)
    status: NDArray[np.str_]

    @property
    def fits(self) -> NDArray[np.bool_]:
        """Which specimens can be assembled without strain."""
        failed = np.isin(self.status, ["not_assembled", "singular", "not_assemblable"])
        return np.asarray(~failed & (self.clearance_factor <= FITS))


def solve(held: Held, members: Members, u: Floats) -> StepSpecimens:
    """Solve specimens with offsets and deviations u of the whole mechanism; its shape is (specimen, parameter).

    In an over-constrained part only the deviations of u count. Offsets follow from deviations, elasticity and loads;
    indeterminate offsets are in their middle. Otherwise all of u counts, and the deformation under the loads.
    """
    part = held.part
    m, count = part.m, len(u)
    own = np.ascontiguousarray(u[:, part.parameters])
    if held.redundant:
        core = held.core()
        found = core.loaded_specimens(held.drives, held.poses, np.where(_clearances(part), 0.0, own))
        each = ((found["reaction"][[n]], found["force"][[n]]) for n in range(count))
        force = np.array([members.forces(part, core, *shares) for shares in each]).T
        factor, own = found["clearance_factor"], found["offset"]
        placed, status = found["poses"], found["status"]
    else:
        core = held.core(joints=held.rigid_joints)
        given = core.given(held.drives.repeat(count, 0), held.poses.repeat(count, 0), own)
        placed, status = given["poses"], given["status"]
        core = held.core()
        under_load = core.loaded(held.drives, held.poses, True)
        force = members.forces(part, core, under_load["reaction"], under_load.get("force"))
        force = np.repeat(force[:, None], count, 1)
        factor = np.zeros(count)
    by_loads = {point: bent(held, point) for point in held.points()}
    errors = {point: _moved(held, point, placed, own) + by[: part.lengths] for point, by in by_loads.items()}
    sizes = {point: np.asarray(np.linalg.norm(error, axis=1)) for point, error in errors.items()}
    centres = np.full((2, len(m.joints), count), np.nan)
    for k, ends in held.centres().items():
        for end, point in ends.items():
            centres[ENDS.index(end), k] = sizes[point]
    output = np.full((count, len(m.components)), np.nan)
    if held.output is not None:
        body = part.spec["points"][held.output]["body"]
        there, nominal = poses.components(placed[:, body]), poses.components(part.poses[body])
        output = poses.difference(there, np.broadcast_to(nominal, there.shape))
        output += by_loads[held.output]
        output[:, : part.lengths] = errors[held.output]
    return StepSpecimens(centres, output, sizes, force, factor, STATUSES[status])


def bent(held: Held, point: int) -> Floats:
    """Deformation of a determinate part under loads: error of a point minus its error with rigid bodies."""
    if held.redundant or held.is_rigid:
        return np.zeros(len(held.part.m.components))
    elastic, rigid = held.loaded(point), held.loaded(point, joints=held.rigid_joints)
    return np.asarray(elastic["error"][0] - rigid["error"][0])


def bent_at_most(held: Held, u: Floats) -> dict[int, float]:
    """Largest displacement of every point by the deformation under loads, over specimens that fit without strain.

    In a determinate part it is the same for all specimens. In an over-constrained part each specimen that fits is
    solved as it is and with rigid bodies, both under the loads.
    """
    part = held.part
    if not held.redundant:
        return {point: float(np.linalg.norm(bent(held, point)[: part.lengths])) for point in held.points()}
    if held.is_rigid or not any(part.spec[name] for name in ("loads", "springs", "torsions")):
        return dict.fromkeys(held.points(), 0.0)
    known = np.where(_clearances(part), 0.0, u[:, part.parameters])
    ways = [
        core.loaded_specimens(held.drives, held.poses, known)
        for core in (held.core(), held.core(joints=held.rigid_joints))
    ]
    fits = np.all([(way["clearance_factor"] <= FITS) & np.isfinite(way["poses"]).all((1, 2)) for way in ways], axis=0)
    moved = {point: [_moved(held, point, way["poses"], way["offset"])[fits] for way in ways] for point in held.points()}
    return {
        point: float(np.linalg.norm(elastic - rigid, axis=1).max(initial=0.0))
        for point, (elastic, rigid) in moved.items()
    }


def _clearances(part: Part) -> NDArray[np.bool_]:
    """Which parameters of a part are offsets of clearances."""
    m = part.m
    return np.array([m.source_kinds[int(s)] in LOOSE for s in m.parameter_source])[part.parameters]


def _moved(held: Held, point: int, placed: Floats, u: Floats) -> Floats:
    """Position error of a point of specimens whose bodies are at given poses; shape (specimen, axis)."""
    spec, part = held.part.spec, held.part
    body, at = spec["points"][point]["body"], spec["points"][point]["at"]
    nominal = poses.place(_pose(part.poses, body), at)
    pose = _pose(placed.swapaxes(0, 1), body)
    actual = poses.position(pose) + (poses.matrix(pose) @ on_body(spec, point, u)[..., None])[..., 0]
    return np.asarray((actual - nominal)[:, : part.lengths])


def _pose(of: Floats, body: int) -> Floats:
    return poses.ground(of.shape[-1]) if body == GROUND else of[body]
