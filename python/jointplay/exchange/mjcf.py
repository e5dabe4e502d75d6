"""MJCF, as MuJoCo compiles it: with includes, defaults and units of angles; the drawing is the reference pose `qpos0`.

Several joints on one body are joints in series, outermost first, with massless bodies between them. Loops are closed by
equality constraints: `connect` is a ball, `weld` fixes, `joint` couples coordinates.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointplay.errors import InputError, listed, one_line

from .options import Options
from .skeleton import Body, Frame, Joint, Place, Skeleton, fixed, floating, free
from .xml import parse

if TYPE_CHECKING:
    import mujoco

#: the fixed body
WORLD = "world"
NEEDED = "MJCF is read by MuJoCo; install it with: pip install 'jointplay[robots]'"
#: how far a weld may be off the reference pose
OFF = 1e-6
#: what is left out: attribute of the model with the number, singular, plural
LEFT_OUT = (
    *(("ngeom", "shape", "shapes"), ("nmesh", "mesh", "meshes"), ("nu", "actuator", "actuators")),
    *(
        ("nsensor", "sensor", "sensors"),
        ("ntendon", "tendon", "tendons"),
        ("nflex", "flexible body", "flexible bodies"),
    ),
    *(("npair", "contact pair", "contact pairs"), ("nkey", "keyframe", "keyframes")),
)


def read(path: Path, options: Options) -> Skeleton:  # noqa: ARG001 - all formats are called alike
    """A model in MJCF.

    Raises
    ------
    InputError
        When MuJoCo is not installed or refuses the file.
    """
    # What is no XML is said as of any other file.
    parse(path, "mujoco", "MJCF")
    name = one_line(str(path))
    try:
        import mujoco
    except ImportError:
        raise InputError(NEEDED, file=name) from None
    with _warnings(mujoco) as said:
        model, notes = _compiled(mujoco, path, name)
    return _Reading(
        mujoco, name, path.stem, model, [*notes, *(f"MuJoCo: {one_line(line)}" for line in said)]
    ).skeleton()


@contextmanager
def _warnings(mj: Any) -> Iterator[list[str]]:
    """What MuJoCo warns of, by Python or by itself, in which case it would write a file of its own."""
    said: list[str] = []
    before = mj.get_mju_user_warning()
    mj.set_mju_user_warning(said.append)
    try:
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            yield said
        said += [str(warning.message) for warning in heard]
    finally:
        mj.set_mju_user_warning(before)


def _compiled(mj: Any, path: Path, name: str) -> tuple[Any, list[str]]:
    """The model; without its meshes where their files are missing."""
    try:
        spec = mj.MjSpec.from_file(str(path))
    except ValueError as error:
        raise InputError(f"MuJoCo cannot read it: {_sentence(error)}", file=name) from None
    try:
        return spec.compile(), []
    except ValueError as error:
        first = error
    for geom in [g for g in spec.geoms if g.type in (mj.mjtGeom.mjGEOM_MESH, mj.mjtGeom.mjGEOM_HFIELD)]:
        spec.delete(geom)
    for asset in (*spec.skins, *spec.meshes, *spec.hfields, *spec.materials, *spec.textures):
        spec.delete(asset)
    try:
        return spec.compile(), ["Files of meshes are missing: masses that follow from them are missing as well."]
    except ValueError:
        raise InputError(f"MuJoCo cannot compile it: {_sentence(first)}", file=name) from None


def _sentence(error: Exception) -> str:
    """What MuJoCo says in several lines, in one."""
    return one_line(", ".join(line.strip() for line in str(error).splitlines() if line.strip()))


def _all_named(names: list[str], word: str) -> list[str]:
    """The names, and for things without one the word with their number, which no other thing is called."""
    found = list(names)
    for k, name in enumerate(names):
        if not name:
            found[k] = free(f"{word}{k}", names)
    return found


class _Reading:
    """One model on its way to a skeleton."""

    def __init__(self, mj: Any, file: str, stem: str, model: mujoco.MjModel, notes: list[str]) -> None:
        self.mj, self.file, self.stem, self.model = mj, file, stem, model
        self.notes = notes
        self.data = mj.MjData(model)
        mj.mj_kinematics(model, self.data)
        self.names = _all_named([WORLD, *(model.body(k).name for k in range(1, model.nbody))], "body")
        self.joint_names = _all_named([model.joint(k).name for k in range(model.njnt)], "joint")
        self.driven = set(self._driven())

    def skeleton(self) -> Skeleton:
        """All of it."""
        model = self.model
        bodies: dict[str, Body] = {WORLD: Body()}
        joints: list[Joint] = []
        for k in range(1, model.nbody):
            frame = self._frame(k)
            centre = frame.point(model.body_ipos[k])
            first, number = model.body_jntadr[k], model.body_jntnum[k]
            own = [j for j in range(first, first + number) if model.jnt_type[j] != self.mj.mjtJoint.mjJNT_FREE]
            chain = [self.names[model.body_parentid[k]]]
            for j in own[:-1]:
                chain.append(free(f"{self.names[k]}-{self.joint_names[j]}", {*self.names, *bodies, *chain}))
            chain.append(self.names[k])
            bodies |= {between: Body(frame) for between in chain[1:-1]}
            bodies[self.names[k]] = Body(frame, float(model.body_mass[k]), centre)
            for j, one, other in zip(own, chain, chain[1:], strict=False):
                joints.append(self._joint(j, one, other))
            if not number:
                joints.append(fixed(chain[0], self.names[k]))
        joints = list(self._constrained(joints))
        held = [group[0] for group in floating(bodies, joints, WORLD)]
        joints += [fixed(WORLD, name) for name in held]
        if held:
            self.notes.append(f"Free joints are left out, so that these bodies are held: {listed(held)}.")
        counted = [(getattr(model, attribute), one, several) for attribute, one, several in LEFT_OUT]
        left_out = [f"{number} {several if number > 1 else one}" for number, one, several in counted if number]
        if (model.dof_damping > 0).any() or (model.dof_frictionloss > 0).any():
            left_out.append("damping and friction")
        if (model.jnt_stiffness > 0).any():
            left_out.append("springs of joints")
        if (model.jnt_limited.astype(bool) & (model.jnt_type == self.mj.mjtJoint.mjJNT_BALL)).any():
            left_out.append("limits of ball joints")
        if model.body_gravcomp.any():
            left_out.append("compensation of gravity")
        if left_out:
            self.notes.insert(0, f"Left out: {', '.join(left_out)}.")
        moved = [self.names[k] for k in range(1, model.nbody) if model.body_mocapid[k] >= 0]
        if moved:
            self.notes.append(f"Bodies that a program moves (mocap) are held: {listed(moved)}.")
        is_light = self._is_disabled("GRAVITY")
        gx, gy, gz = (0.0, 0.0, 0.0) if is_light else map(float, model.opt.gravity)
        return Skeleton(
            title=str(self._title() or self.stem),
            bodies=bodies,
            joints=tuple(joints),
            ground=WORLD,
            frames={name: (body, frame) for name, body, frame in self._sites() if name not in bodies},
            gravity=(gx, gy, gz),
            notes=tuple(self.notes),
        )

    def _is_disabled(self, what: str) -> bool:
        """Whether a flag of the model switches something off."""
        return bool(self.model.opt.disableflags & getattr(self.mj.mjtDisableBit, f"mjDSBL_{what}"))

    def _is_limited(self, j: int) -> bool:
        return bool(self.model.jnt_limited[j]) and not self._is_disabled("LIMIT")

    def _title(self) -> str:
        return str(bytes(self.model.names).split(b"\0", 1)[0].decode("utf-8", "replace"))

    def _frame(self, body: int) -> Frame:
        return Frame(self.data.xpos[body].copy(), self.data.xmat[body].reshape(3, 3).copy())

    def _sites(self) -> Iterator[tuple[str, str, Frame]]:
        for k in range(self.model.nsite):
            name = self.model.site(k).name
            if name:
                frame = Frame(self.data.site_xpos[k].copy(), self.data.site_xmat[k].reshape(3, 3).copy())
                yield name, self.names[self.model.site_bodyid[k]], frame

    def _driven(self) -> Iterator[str]:
        """Joints with a motor; a tendon drives the first of its joints."""
        model, trn = self.model, self.mj.mjtTrn
        for kind, (target, _) in zip(model.actuator_trntype, model.actuator_trnid, strict=True):
            # Numbers of NumPy are compared from their side: enumerations of MuJoCo only know their own.
            if kind == trn.mjTRN_JOINT or kind == trn.mjTRN_JOINTINPARENT:
                yield self.joint_names[target]
            elif kind == trn.mjTRN_TENDON:
                first = model.tendon_adr[target]
                if model.wrap_type[first] == self.mj.mjtWrap.mjWRAP_JOINT:
                    yield self.joint_names[model.wrap_objid[first]]

    def _joint(self, j: int, one: str, other: str) -> Joint:
        model, kinds = self.model, self.mj.mjtJoint
        name, kind = self.joint_names[j], model.jnt_type[j]
        at = self.data.xanchor[j].copy()
        if kind == kinds.mjJNT_BALL:
            return Joint(name, "spherical", (one, other), Place(at))
        low, high = map(float, model.jnt_range[j])
        return Joint(
            name=name,
            kind="revolute" if kind == kinds.mjJNT_HINGE else "prismatic",
            bodies=(one, other),
            place=Place(at, self.data.xaxis[j].copy()),
            coordinate=float(model.qpos0[model.jnt_qposadr[j]]),
            limits=(low, high) if self._is_limited(j) else None,
            is_driven=name in self.driven,
        )

    # --- equality constraints ---------------------------------------------------------------------------------------

    def _constrained(self, joints: list[Joint]) -> Iterator[Joint]:
        """The joints with what equality constraints add: laws, and joints that close loops."""
        model, kinds = self.model, self.mj.mjtEq
        laws: dict[str, tuple[str, float, float]] = {}
        closing: list[Joint] = []
        ignored = []
        for k in range(model.neq):
            # A joint may have the same name.
            name = free(model.equality(k).name or f"equality{k}", {*self.joint_names, *(one.name for one in closing)})
            kind = model.eq_type[k]
            if not model.eq_active0[k] or self._is_disabled("EQUALITY"):
                ignored.append(f"{name} (not active)")
            elif kind == kinds.mjEQ_CONNECT:
                closing.append(self._connect(k, name))
            elif kind == kinds.mjEQ_WELD:
                closing.append(self._weld(k, name))
            elif kind == kinds.mjEQ_JOINT and model.eq_obj2id[k] >= 0 and self._is_ratio(k):
                follower, leader = model.eq_obj1id[k], model.eq_obj2id[k]
                zero, ahead = (float(model.qpos0[model.jnt_qposadr[j]]) for j in (follower, leader))
                offset, factor = map(float, model.eq_data[k][:2])
                laws[self.joint_names[follower]] = self.joint_names[leader], factor, zero + offset - factor * ahead
            else:
                ignored.append(name)
        if ignored:
            self.notes.append(f"Equality constraints that are left out: {listed(ignored)}.")
        for joint in joints:
            yield replace(joint, follows=laws.get(joint.name))
        yield from closing

    def _is_ratio(self, k: int) -> bool:
        """Whether a polynomial of one joint in another one has no powers, and a factor."""
        factor, *powers = self.model.eq_data[k][1:5]
        return bool(factor) and not any(powers)

    def _ends(self, k: int) -> tuple[tuple[int, Frame], tuple[int, Frame]]:
        """The two bodies, or the sites that are named instead, with their frames."""
        model = self.model
        found = []
        for number in (model.eq_obj1id[k], model.eq_obj2id[k]):
            if model.eq_objtype[k] == self.mj.mjtObj.mjOBJ_SITE:
                frame = Frame(self.data.site_xpos[number].copy(), self.data.site_xmat[number].reshape(3, 3).copy())
                found.append((int(model.site_bodyid[number]), frame))
            else:
                found.append((int(number), self._frame(number)))
        return found[0], found[1]

    def _connect(self, k: int, name: str) -> Joint:
        (one, first), (other, second) = self._ends(k)
        places = [Place(first.at), Place(second.at)]
        if self.model.eq_objtype[k] == self.mj.mjtObj.mjOBJ_BODY:
            anchors = self.model.eq_data[k]
            places = [Place(first.point(anchors[:3])), Place(second.point(anchors[3:6]))]
        is_closed = np.abs(places[0].at - places[1].at).max() < OFF
        bodies = (self.names[one], self.names[other])
        return Joint(name, "spherical", bodies, places[0], None if is_closed else places[1])

    def _weld(self, k: int, name: str) -> Joint:
        (one, first), (other, second) = self._ends(k)
        wanted = first
        if self.model.eq_objtype[k] == self.mj.mjtObj.mjOBJ_BODY:
            # The anchor is in axes of the second body; where it is on the first one follows from the relative pose.
            anchor, at, turn = np.split(self.model.eq_data[k][:10], (3, 6))
            matrix = np.zeros(9)
            self.mj.mju_quat2Mat(matrix, turn)
            axes = matrix.reshape(3, 3)
            wanted = first @ Frame(at - axes @ anchor, axes)
        if np.abs(wanted.at - second.at).max() > OFF or np.abs(wanted.axes - second.axes).max() > OFF:
            problem = "holds its bodies in another pose than the reference pose; make the two agree"
            raise InputError(problem, file=self.file, key=f"weld '{name}'")
        return Joint(name, "fixed", (self.names[one], self.names[other]), Place(first.at))
