"""`read`: a mechanism from a foreign format, by way of the text of its mechanism file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from jointplay.analyses.check import compute
from jointplay.basics.foreign import is_link
from jointplay.basics.typed import typed
from jointplay.errors import InputError, in_range, listed, not_known, shown
from jointplay.file.schema.kinds import PLANAR, SPATIAL
from jointplay.file.schema.values import is_finite
from jointplay.model.mechanism import Mechanism, loads
from jointplay.model.mobility import Mobility, examine, misfit_words

from .bounds import require_bounded
from .driving import choose, distances, has_loops
from .looping import with_loops
from .lost import settled, with_backlash, with_lost_motion
from .options import Options
from .pairing import EQUAL
from .pins import OUTPUT
from .planar import projected
from .pmks import LINK_NAME, linked
from .registry import reader
from .shaping import bounded, grounded, joint_called, leading, link_called, merged, renamed
from .silhouettes import outlined
from .skeleton import GROUND, Skeleton, Vector, is_of_a_body, noted
from .writing import EXAMPLE, sized, text, unit_of

#: more joints than any robot has; the time to choose drives grows with their square
MOST_JOINTS = 1000


@dataclass(frozen=True)
class Imported:
    """What an import gives."""

    #: the mechanism file
    text: str
    #: what it says
    mechanism: Mechanism
    #: what was left out, one sentence each
    notes: tuple[str, ...]


@typed
def read(
    path: str | os.PathLike[str],
    *,
    output: str | None = None,
    drives: Sequence[str] | Mapping[str, object] | None = None,
    clearance: Mapping[str, object] | None = None,
    planar: bool = False,
    loops: Mapping[str, object] | None = None,
    ground: str | None = None,
    backlash: Mapping[str, object] | None = None,
    keep_joints: bool = False,
    fit: str | None = None,
    density: float | Mapping[str, float] | None = None,
    within: float = 0.0,
) -> Mechanism:
    """Read a mechanism from a foreign format.

    Lengths become mm, angles degrees. `Mechanism.write` writes the file with comments, which name what was left out and
    say where clearances can be written.

    Parameters
    ----------
    path : path-like
        A robot in URDF (`.urdf`; `.xacro` needs the program xacro), SDF (`.sdf`) or MJCF (`.mjcf`; needs the extra
        `robots`); `.xml` may be any of them.
        An assembly of FreeCAD 1.0 or later (`.FCStd`), also as its solver has it (`.asmt`). A skeleton in DXF (`.dxf`;
        needs the extra `dxf`), or a linkage of pylinkage (`.json`), Pyslvs (`.pyslvs`), Linkage (`.linkage2`) or PMKS+
        (`.pmks`), also as its link: `"https://app.pmksplus.com/?0P..."`, from which nothing is fetched.
    output : str, optional
        The link, body or site whose origin is the output; in a drawing or linkage a point or a joint. If left out, what
        is called output, or the body that most joints separate from the ground.
    drives : sequence of str or mapping, optional
        The joints that are driven, or their values: one or a list of them, in degrees or mm. If left out, as many
        joints are driven as there are free motions: joints with a motor first, then those nearest to the ground.
    clearance : mapping, optional
        Clearance tables of the mechanism file by the name of a joint, or by the kind of joint for all others:
        ``{"revolute": {"radial": 0.02, "axial": 0.02, "length": 30}}``.
    planar : bool, optional
        Whether to see the mechanism along its pins, as one in the plane.
    loops : mapping, optional
        Joints that close loops, where the format has none (URDF), by name:
        ``{"type": "revolute", "on": {"rod_end": {"at": [0, 0, 0], "axis": [0, 0, 1]}, "rocker": [80, 0, 0]}}`` with
        points in mm, in the axes of each link. Joints that it moves in place of a law, such as `mimic`, are named by
        ``"instead": ["finger"]``.
    ground : str, optional
        The link that is fixed; the root of the file or its world if left out.
    backlash : mapping, optional
        Lost motion of drives, from flank to flank or as ``{"plus": 0.2, "minus": 0}``, by the name of a joint or by the
        kind of joint for all others that drives move: ``{"revolute": {"angle": 0.1}, "prismatic": {"travel": 0.05}}``.
    keep_joints : bool, optional
        Whether a second joint on the axis of another one, without a motor and with a small range or a spring, stays a
        joint. If not, it is lost motion or wind-up of the drive of the other one.
    fit : str, optional
        Fit of ISO 286, such as ``"H7/g6"``, of all pins of an assembly that are drawn with the diameter of their holes.
        Pins that are drawn smaller have the clearance of the drawing.
    density : float or mapping, optional
        Of the parts of an assembly in kg/m^3, or by the name of a part: their masses, centres and moments of inertia
        are those of their shapes.
    within : float, optional
        Points of a drawing in DXF coincide where they are at most so far apart, mm; a ten-thousandth of its size if
        that is more.

    Returns
    -------
    Mechanism

    Raises
    ------
    InputError
        When the file cannot be read, a name is not in it, or its loops cannot be closed.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import jointplay as jp
    >>> robot = '''<robot name="pendulum"><link name="base"/>
    ...   <link name="arm"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/></inertial></link>
    ...   <joint name="pin" type="continuous"><parent link="base"/><child link="arm"/>
    ...     <origin xyz="0 0 1"/><axis xyz="0 1 0"/></joint></robot>'''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "pendulum.urdf")
    ...     written = path.write_text(robot)
    ...     m = jp.read(path, output="arm", drives={"pin": [0, 45]}, clearance={"pin": {"radial": 0.02, "length": 30}})
    >>> m.sources, m.value("joints.pin.on.ground.at")
    (('pin',), [0, 0, 1000])
    """
    asked = drives if isinstance(drives, Mapping) else dict.fromkeys(drives or ())
    dense = density if isinstance(density, Mapping) else {} if density is None else {"": density}
    options = Options(
        output,
        asked or None,
        clearance or {},
        planar,
        loops or {},
        ground,
        backlash or {},
        keep_joints,
        fit,
        dense,
        within,
    )
    return imported(path, options).mechanism


def imported(path: str | os.PathLike[str], options: Options) -> Imported:
    """The mechanism file of a foreign one, or of a link."""
    place = os.fspath(path)
    try:
        return _imported(place, options)
    except InputError as error:
        file = LINK_NAME if is_link(place) else place
        raise error if error.file else InputError(error.problem, file=file, key=error.key) from None


def _imported(place: str, options: Options) -> Imported:
    path = Path(place)
    if options.density and path.suffix.lower() != ".fcstd":
        raise InputError("is of assemblies with shapes, .FCStd", key="density")
    if is_link(place):
        skeleton, source = linked(place, options), LINK_NAME
    else:
        skeleton, source = reader(path)(path, options), path.name
    in_range(len(skeleton.joints), "", "a number of joints that is read", 0, MOST_JOINTS)
    require_bounded(skeleton)
    skeleton = _with_sound_inertia(skeleton)
    if options.ground is not None:
        skeleton = grounded(skeleton, options.ground)
    skeleton = bounded(merged(with_loops(renamed(skeleton), options.loops)))
    skeleton = leading(skeleton if options.keep_joints else with_lost_motion(skeleton))
    if len(skeleton.bodies) < 2:
        raise InputError("has no joint that lets something move")
    drives = _drives(skeleton, options)
    if options.planar:
        skeleton = outlined(merged(projected(skeleton, drives or ())))
    output = _output(skeleton, options.output)
    leaders = {joint.follows[0]: None for joint in skeleton.joints if joint.follows}

    def draft() -> Mechanism:
        return loads(text(skeleton, source, leaders, output, {}), source)

    chosen = choose(skeleton, drives, draft)
    loose = [joint.name for joint in skeleton.joints if joint.follows and joint.follows[0] not in chosen]
    if loose:
        skeleton = noted(skeleton, f"These joints follow joints without a drive, which is left out: {listed(loose)}.")
    values = {name: drives[name] if drives else None for name in chosen}
    if drives is None:
        values |= {
            joint.name: [value / unit_of(joint) for value in joint.motion]
            for joint in skeleton.joints
            if joint.motion and joint.name in chosen
        }
    moved = [joint.name for joint in skeleton.joints if (joint.follows[0] if joint.follows else joint.name) in chosen]
    skeleton, values = settled(with_backlash(skeleton, options.backlash, moved), values)
    clearance, options_of = _clearances(skeleton, options.clearance)
    skeleton, clearance, options_of = _drawn(skeleton, clearance, options_of, options.fit)
    written = text(skeleton, source, values, output, clearance)
    try:
        m = loads(written, source)
    except InputError as error:
        raise _as_asked(error, options_of) from None
    mobility = examine(m)
    if has_loops(skeleton):
        _check_closed(m, mobility)
    remarks = (*mobility.problems, *mobility.remarks)
    if mobility.misfit is not None:
        remarks = (*remarks, misfit_words(m, mobility.misfit))
    if remarks:
        skeleton = noted(skeleton, *(f"{remark[0].upper()}{remark[1:]}." for remark in remarks))
        written = text(skeleton, source, values, output, clearance)
        m = loads(written, source)
    return Imported(written, m, skeleton.notes)


def _with_sound_inertia(skeleton: Skeleton) -> Skeleton:
    """The same without moments of inertia that no body can have, as files of robots have them."""
    odd = [name for name, body in skeleton.bodies.items() if not is_of_a_body(body.inertia)]
    if not odd:
        return skeleton
    bodies = {
        name: replace(body, inertia=np.zeros((3, 3))) if name in odd else body for name, body in skeleton.bodies.items()
    }
    words = f"Moments of inertia that no body can have are left out: {listed(odd)}."
    return noted(replace(skeleton, bodies=bodies), words)


def _drives(skeleton: Skeleton, options: Options) -> dict[str, list[float] | None] | None:
    if options.drives is None:
        return None
    found: dict[str, list[float] | None] = {}
    for name, given in options.drives.items():
        values: list[Any] = list(given) if isinstance(given, list | tuple) else [given]
        if given is not None and not all(is_finite(value) for value in values):
            raise InputError(f"a number or a list of them is needed, not {shown(given)}", key=f"drives {name}")
        found[joint_called(skeleton, name)] = None if given is None else [float(value) for value in values]
    return found


def _output(skeleton: Skeleton, wanted: str | None) -> tuple[str, Vector]:
    """Body and point of the output, in the drawing."""
    origins = {name: body for name, body in skeleton.bodies.items() if skeleton.has_origins and not body.is_between}
    frames = {name: (name, body.frame) for name, body in origins.items() if name != GROUND} | dict(skeleton.frames)
    if wanted is None and OUTPUT in skeleton.frames:
        wanted = OUTPUT
    if wanted is None:
        if not frames:
            raise InputError("has no point that moves, which could be the output")
        far = distances(skeleton)
        body, frame = frames[max(frames, key=lambda name: far.get(frames[name][0], 0) if name in origins else -1)]
        return body, frame.at
    name = link_called(skeleton, wanted)
    if name not in frames:
        what = "a link" if skeleton.has_origins else "a point or a joint"
        raise InputError(not_known(wanted, what, frames), key="output")
    body, frame = frames[name]
    if body == GROUND:
        raise InputError(f"'{wanted}' is fixed to the ground and has no error", key="output")
    return body, frame.at


def _clearances(skeleton: Skeleton, given: Mapping[str, object]) -> tuple[dict[str, Mapping[str, Any]], dict[str, str]]:
    """Clearances by joint, and the word of the option that gave each."""
    joints = {joint.name: joint for joint in skeleton.joints}
    kinds = {joint.kind for joint in skeleton.joints}
    found: dict[str, Mapping[str, Any]] = {}
    asked: dict[str, str] = {}
    # What is said of one joint counts more than what is said of its kind.
    for word, table in sorted(given.items(), key=lambda item: joint_called(skeleton, item[0]) in joints):
        key = f"clearance {word}"
        if not isinstance(table, Mapping):
            raise InputError("a table is needed, such as { radial = 0.02 }", key=key)
        if joint_called(skeleton, word) in joints:
            names = [joint_called(skeleton, word)]
        elif word in kinds:
            names = [name for name, joint in joints.items() if joint.kind == word]
        elif word in {**PLANAR, **SPATIAL}:
            raise InputError(f"there is no {word} joint here; there are {', '.join(sorted(kinds))}", key=key)
        else:
            raise InputError(not_known(word, "a joint or a kind of joint", [*kinds, *joints]), key=key)
        found |= dict.fromkeys(names, table)
        asked |= dict.fromkeys(names, key)
    return found, asked


def _drawn(
    skeleton: Skeleton, clearance: Mapping[str, Mapping[str, Any]], options_of: Mapping[str, str], fit: str | None
) -> tuple[Skeleton, dict[str, Mapping[str, Any]], dict[str, str]]:
    """With the clearances that the drawing has, and the fit of those that it has not."""
    found, asked = dict(clearance), dict(options_of)
    alike: list[str] = []
    larger: list[str] = []
    for joint in skeleton.joints:
        drawn = sized(skeleton, joint, None)
        if joint.sizes is None or drawn is None or joint.name in clearance:
            continue
        play = joint.sizes.hole - joint.sizes.pin
        if play > EQUAL:
            found[joint.name] = drawn
        elif play < -EQUAL:
            larger.append(joint.name)
        elif fit is not None:
            found[joint.name] = sized(skeleton, joint, fit) or {}
            asked[joint.name] = "fit"
        else:
            alike.append(joint.name)
    if fit is not None and not any(key == "fit" for key in asked.values()):
        raise InputError("no joint here has a pin that is drawn with the diameter of its hole", key="fit")
    notes = []
    pins = [
        joint.name for joint in skeleton.joints if joint.kind == "revolute" and "length" in found.get(joint.name, ())
    ]
    if pins := [name for name in pins if name not in clearance]:
        notes.append(f"Play along these pins is not read; write `axial` where there is some: {listed(pins)}.")
    if alike:
        notes.append(
            f"Pins and holes of these joints are drawn with one diameter; --fit {EXAMPLE} gives them a clearance:"
            f" {listed(alike)}."
        )
    if larger:
        notes.append(f"Pins of these joints are drawn larger than their holes, and get no clearance: {listed(larger)}.")
    return noted(skeleton, *notes), found, asked


def _as_asked(error: InputError, options_of: Mapping[str, str]) -> InputError:
    """The error of the file that would be written, with the option that brought it there."""
    parts = error.key.split(".")
    if parts[0] == "joints" and len(parts) > 1 and options_of.get(parts[1]) == "fit":
        return InputError(error.problem, key=f"fit {parts[1]}")
    if parts[0] == "joints" and len(parts) > 2 and parts[2] == "clearance" and parts[1] in options_of:
        return InputError(error.problem, key=".".join([options_of[parts[1]], *parts[3:]]))
    if parts[0] == "drives":
        return InputError(error.problem, key="drives" + "".join(f" {part}" for part in parts[1:2]))
    return error


def _check_closed(m: Mechanism, mobility: Mobility) -> None:
    """Refuse loops that cannot be closed with the first values of the drives."""
    if mobility.assembled and (mobility.motions or not m.drives):
        # Drives are missing, and joints are closed without them.
        return
    assert m.drive_values is not None
    first = np.ascontiguousarray(m.drive_values[:1])
    # A special pose is closed, too, but nothing is solved there.
    if not np.isfinite(m.core.trace(first)["poses"]).all() and not m.core.assemble(first[0])["converged"]:
        reason = str(compute(m).attrs.get("failure", "")).replace("\n", " ")
        raise InputError(f"its loops cannot be closed. {reason}".rstrip())
