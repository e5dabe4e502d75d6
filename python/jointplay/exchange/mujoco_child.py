"""A program by itself: what MuJoCo makes of a model, as JSON. Its parent bounds the time; it bounds its own memory.

MuJoCo compiles whatever a model asks for, however large, and ends its process where memory ends. It is called with the
model and the file to write to, in a folder for what MuJoCo writes by itself.
"""

import json
import os
import sys
import warnings
from pathlib import Path
from typing import Any

#: bytes that it may take, with some hundred MB of libraries in it
MEMORY = 2_000_000_000
#: parts that are handed on; no robot has as many
MOST_PARTS = 10_000
#: kg and kg m^2 of bodies without a mass
WEIGHTLESS = 1e-12
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
#: what the reader knows of joints and of equality constraints, by the end of their names
JOINTS, EQUALITIES = ("FREE", "BALL", "SLIDE", "HINGE"), ("CONNECT", "WELD", "JOINT")
FLAGS = ("GRAVITY", "LIMIT", "EQUALITY")


class Refused(Exception):
    """What MuJoCo, or we, say against a model."""


def main(model: str, output: str) -> None:
    """Write what is known of a model, or why it is refused."""
    _bound()
    try:
        found = _read(model)
    except Refused as problem:
        found = {"problem": str(problem)}
    except MemoryError:
        found = {"memory": True}
    Path(output).write_text(json.dumps(found), encoding="utf-8")


def _bound() -> None:
    """Have the system refuse more memory, where it can."""
    try:
        import resource
    except ImportError:
        return
    for limit, value in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_CORE, 0)):
        most = resource.getrlimit(limit)[1]
        value = value if most == resource.RLIM_INFINITY else min(value, most)
        resource.setrlimit(limit, (value, value))


def _read(model: str) -> dict[str, Any]:
    import mujoco as mj

    said: list[str] = []
    mj.set_mju_user_warning(said.append)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        compiled, meshless = _compiled(mj, Path(model))
        found = _told(mj, compiled)
    return {**found, "meshless": meshless, "said": [*said, *(str(warning.message) for warning in heard)]}


def _compiled(mj: Any, path: Path) -> tuple[Any, bool]:
    """The model, and whether it is one without its meshes, where their files are missing."""
    # By itself it takes what is no XML for a model of another format.
    wrong = (ValueError, mj.FatalError, mj.UnexpectedError)
    try:
        if path.suffix.lower() == ".xml":
            spec = mj.MjSpec.from_file(str(path))
        else:
            # What it makes of a file depends on its extension. Parts of a text are looked for where it works.
            os.chdir(path.parent)
            spec = mj.MjSpec.from_string(path.read_text(encoding="utf-8-sig"))
    except wrong as error:
        raise Refused(f"MuJoCo cannot read it: {_sentence(error)}") from None
    try:
        return spec.compile(), False
    except wrong:
        pass
    gone = [g for g in spec.geoms if g.type in (mj.mjtGeom.mjGEOM_MESH, mj.mjtGeom.mjGEOM_HFIELD)]
    names = {geom.name for geom in gone if geom.name}
    # What means a shape goes with it.
    for part in [*spec.sensors, *spec.pairs]:
        if {getattr(part, key, "") for key in ("objname", "refname", "geomname1", "geomname2")} & names:
            spec.delete(part)
    for geom in gone:
        spec.delete(geom)
    for shown in (*spec.geoms, *spec.sites):
        shown.material = ""
    for asset in (*spec.skins, *spec.meshes, *spec.hfields, *spec.materials, *spec.textures):
        spec.delete(asset)
    if gone:
        # Bodies of which only a mesh has a mass cannot move without one.
        spec.compiler.boundmass = spec.compiler.boundinertia = WEIGHTLESS
    try:
        return spec.compile(), bool(gone)
    except wrong as error:
        raise Refused(f"MuJoCo cannot compile it: {_sentence(error)}") from None


def _sentence(error: Exception) -> str:
    """What MuJoCo says in several lines, in one."""
    return ", ".join(line.strip() for line in str(error).splitlines() if line.strip())


def _told(mj: Any, model: Any) -> dict[str, Any]:
    for number, what in ((model.nbody, "bodies"), (model.nsite, "sites"), (model.neq, "equality constraints")):
        if number > MOST_PARTS:
            raise Refused(f"has {number} {what}; up to {MOST_PARTS} are read")
    kinds = {int(getattr(mj.mjtJoint, f"mjJNT_{kind}")): kind for kind in JOINTS}
    equalities = {int(getattr(mj.mjtEq, f"mjEQ_{kind}")): kind for kind in EQUALITIES}
    flags = {flag: bool(model.opt.disableflags & getattr(mj.mjtDisableBit, f"mjDSBL_{flag}")) for flag in FLAGS}
    joints = [
        {
            "name": model.joint(j).name,
            "kind": kinds[int(model.jnt_type[j])],
            "body": int(model.jnt_bodyid[j]),
            "zero": float(model.qpos0[model.jnt_qposadr[j]]),
            "limited": bool(model.jnt_limited[j]),
            "range": model.jnt_range[j].tolist(),
            "stiffness": float(model.jnt_stiffness[j]),
            "rest": float(model.qpos_spring[model.jnt_qposadr[j]]),
        }
        for j in range(model.njnt)
    ]
    laws = [
        {
            "name": model.equality(k).name,
            "kind": equalities.get(int(model.eq_type[k]), ""),
            "active": bool(model.eq_active0[k]) and not flags["EQUALITY"],
            "on_sites": int(model.eq_objtype[k]) == int(mj.mjtObj.mjOBJ_SITE),
            "ends": [int(model.eq_obj1id[k]), int(model.eq_obj2id[k])],
            "data": model.eq_data[k].tolist(),
        }
        for k in range(model.neq)
    ]
    driven = sorted(set(_driven(mj, model)))
    for k, law in enumerate(laws):
        if int(model.eq_type[k]) == int(mj.mjtEq.mjEQ_TENDON):
            law |= _coupled(mj, model, law, driven)
    held = _held(joints, laws)
    data = mj.MjData(model)
    for j, value in held.items():
        data.qpos[model.jnt_qposadr[j]] = value
    mj.mj_kinematics(model, data)
    for j, joint in enumerate(joints):
        joint |= {"at": data.xanchor[j].tolist(), "axis": data.xaxis[j].tolist(), "held": held.get(j)}
    return {
        "title": bytes(model.names).split(b"\0", 1)[0].decode("utf-8", "replace"),
        "bodies": [
            {
                "name": model.body(k).name if k else "",
                "parent": int(model.body_parentid[k]),
                "mass": float(model.body_mass[k]) if model.body_mass[k] > WEIGHTLESS else 0.0,
                "centre": model.body_ipos[k].tolist(),
                "moments": (model.body_inertia[k] * (model.body_mass[k] > WEIGHTLESS)).tolist(),
                "moments_turned": model.body_iquat[k].tolist(),
                "at": data.xpos[k].tolist(),
                "axes": data.xmat[k].reshape(3, 3).tolist(),
                "moved": int(model.body_mocapid[k]) >= 0,
            }
            for k in range(model.nbody)
        ],
        "joints": joints,
        "sites": [
            {
                "name": model.site(k).name,
                "body": int(model.site_bodyid[k]),
                "at": data.site_xpos[k].tolist(),
                "axes": data.site_xmat[k].reshape(3, 3).tolist(),
            }
            for k in range(model.nsite)
        ],
        "equalities": laws,
        "driven": driven,
        "gravity": [0.0, 0.0, 0.0] if flags["GRAVITY"] else model.opt.gravity.tolist(),
        "limits": not flags["LIMIT"],
        "left_out": list(_left_out(model, kinds)),
    }


def _coupled(mj: Any, model: Any, law: dict[str, Any], driven: list[int]) -> dict[str, Any]:
    """A law of tendons along joints as that of a joint, where it ties two coordinates or holds one.

    With q from the reference pose, a_i q_i of the first tendon are in sum the offset, and the factor times those of the
    second one.
    """
    offset, factor, *powers = law["data"][:5]
    weights: dict[int, float] = {}
    for tendon, part in zip(law["ends"], (1.0, -factor), strict=True):
        for wrap in (
            range(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon]) if tendon >= 0 else ()
        ):
            if int(model.wrap_type[wrap]) != int(mj.mjtWrap.mjWRAP_JOINT):
                return {}
            joint = int(model.wrap_objid[wrap])
            weights[joint] = weights.get(joint, 0.0) + part * float(model.wrap_prm[wrap])
    tied = sorted((joint for joint, weight in weights.items() if weight), key=lambda joint: joint in driven)
    if len(tied) not in (1, 2) or (law["ends"][1] >= 0 and any(powers)):
        return {}
    first, second = tied[0], tied[1] if len(tied) == 2 else -1
    slope = -weights[second] / weights[first] if second >= 0 else 0.0
    return {"kind": "JOINT", "ends": [first, second], "data": [offset / weights[first], slope, 0.0, 0.0, 0.0]}


def _held(joints: list[dict[str, Any]], laws: list[dict[str, Any]]) -> dict[int, float]:
    """Joints whose coordinate equality constraints hold: alone, or together with one that is held."""
    polynomials = [(*law["ends"], law["data"][:5]) for law in laws if law["active"] and law["kind"] == "JOINT"]
    held: dict[int, float] = {}
    while True:
        known = len(held)
        for one, other, (offset, *powers) in polynomials:
            zero = joints[one]["zero"]
            if one not in held and (other < 0 or not any(powers)):
                held[one] = zero + offset
            elif one not in held and other in held:
                far = held[other] - joints[other]["zero"]
                held[one] = zero + offset + sum(power * far ** (k + 1) for k, power in enumerate(powers))
            elif one in held and other >= 0 and other not in held and powers[0] and not any(powers[1:]):
                held[other] = joints[other]["zero"] + (held[one] - zero - offset) / powers[0]
        if len(held) == known:
            return held


def _driven(mj: Any, model: Any) -> list[int]:
    """Joints with a motor; a tendon drives the first of its joints."""
    trn, found = mj.mjtTrn, []
    for kind, (target, _) in zip(model.actuator_trntype, model.actuator_trnid, strict=True):
        # Numbers of NumPy are compared from their side: enumerations of MuJoCo only know their own.
        if kind == trn.mjTRN_JOINT or kind == trn.mjTRN_JOINTINPARENT:
            found.append(int(target))
        elif kind == trn.mjTRN_TENDON:
            first = model.tendon_adr[target]
            if model.wrap_type[first] == mj.mjtWrap.mjWRAP_JOINT:
                found.append(int(model.wrap_objid[first]))
    return found


def _left_out(model: Any, kinds: dict[int, str]) -> list[str]:
    counted = [(int(getattr(model, attribute)), one, several) for attribute, one, several in LEFT_OUT]
    found = [f"{number} {several if number > 1 else one}" for number, one, several in counted if number]
    if (model.dof_damping > 0).any() or (model.dof_frictionloss > 0).any():
        found.append("damping and friction")
    if (model.dof_armature > 0).any():
        found.append("armature")
    turning = [kinds[int(kind)] in ("BALL", "FREE") for kind in model.jnt_type]
    if ((model.jnt_stiffness > 0) & turning).any():
        found.append("springs of ball and free joints")
    ball = [kinds[int(kind)] == "BALL" for kind in model.jnt_type]
    if (model.jnt_limited.astype(bool) & ball).any():
        found.append("limits of ball joints")
    if model.body_gravcomp.any():
        found.append("compensation of gravity")
    return found


if __name__ == "__main__":
    main(*sys.argv[1:])
