"""`loaded`: where the load pushes every joint.

Loads are those of the file, weights, and where drives have speeds the forces of inertia, see `running`. Without
friction (with it see `friction`) every offset is the support point of its clearance along the reaction that the joint
transmits. On the exact closure this is a condition on the offsets y and the forces s(y) along them, with P the
projection onto the sets:

    y = P(y + t s(y)),   t > 0

The work of the loads is not maximised: for a moment with a fixed direction in space it has no maximum. Where these
equations hold at several places, the work from one to another tells which is given. Over-constrained and elastic
mechanisms need a cone program; its multipliers of compatibility are the coefficients of the self-stresses.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointplay.analyses import friction
from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.core.answers import Loaded
from jointplay.core.compile import DriveMotion
from jointplay.errors import InputError
from jointplay.model.gaps import attributes, core_with
from jointplay.model.inertia import Kinematics, acting
from jointplay.model.mechanism import Mechanism
from jointplay.result import STATUSES, Result, ResultBuilder, to_dataset
from jointplay.result.verdict import PLAYS, READABLE, add_play, judge, of_sizes, reached

from .nominal import (
    ON_CLOSURE,
    TO_FIRST_ORDER,
    Nominal,
    Progress,
    batched,
    finished,
    nominal,
    report,
    without_singular,
)
from .recorded import recorded
from .running import add_contact, add_drives, add_motion, motion_of, moving, speeds
from .several import of_each, share

if TYPE_CHECKING:
    import xarray as xr


#: configurations per call of the core: enough for its threads, few enough for a bar to move
BATCH = 2048
#: an offset is at an end of its lost motion within this part of the width; cone programs end about there
AT_END = 1e-6


@typed
def loaded(
    m: Mechanism,
    *,
    exact: bool = True,
    details: bool = True,
    sizes: str = "middle",
    approach: str | None = None,
) -> xr.Dataset:
    """Find the pose error where the loads take up the clearances.

    Parameters
    ----------
    m : Mechanism
        With loads, springs or gravity.
    exact : bool
        Whether offsets and reactions are found on the exact closure. If not, everything is given to first order at the
        nominal pose, several times faster: `error` then is `error_first_order`, and reactions are those at the nominal
        pose.
    details : bool
        Whether more is returned than `error`, `undetermined`, `iterations`, `equilibria`, `status` and, of an
        over-constrained mechanism, `clearance_factor`. For very many configurations the rest takes most of the time
        and the memory.
    sizes : {"middle", "largest", "smallest"}
        Which sizes clearances have that scatter: in the middle of their limits, or those with the largest or the
        smallest play.
    approach : {"forward", "backward", "rest"}, optional
        From which side each configuration is reached: friction counts, and the joints slide as in the nominal motion in
        this direction of the path. At rest: all poses in which friction can hold the mechanism. Without friction if
        left out.

    Returns
    -------
    xarray.Dataset
        Over `configuration`: `error`, `error_first_order`, `undetermined` (half-width of the indeterminacy that the
        load leaves), `undetermined_contribution` (per source), `decided` (whether the load determines the offset of the
        source), `reaction` (force and moment on the second body of every joint, at the joint, ground axes), `offset`
        (value of every parameter), `drive_torque` (moment or force of every drive on the second body of its joint,
        along its coordinate), `drive_flank` (1 or -1: at the upper or lower end of its lost motion, 0 at neither),
        `contribution` (per source; they add up to the first-order error), `iterations`
        (until offsets and reactions agreed), `equilibria` (places found where the load may hold the mechanism, of which
        the one with the most work is given), `nominal`, `status`. Where sizes of clearances scatter, and those in the
        middle are asked for, `play_largest` and `play_smallest` (lowest and highest value of every quantity with the
        largest and the smallest play), by which the limits are judged as well.

        A mechanism whose drives have speeds has as well: `velocity` and `acceleration` of the output at its nominal
        motion, in ground axes, `time` (since the first configuration, where drive values say it), of a determinate
        mechanism, per round clearance, `contact_rate` (how fast its reaction turns beside the pendulum of the play),
        `contact` (``follows``, ``may be lost`` or ``lost``) and `transit_time` (the least in which the pin crosses its
        play), and with details `body_velocity`, `body_acceleration`, `drive_speed`, `motor_torque` (with that which
        accelerates the rotor) and `drive_power`. Inertia is among the loads; attributes `speeds` and `inertia`.

        With an approach: `reversal` (error coming forward minus error coming backward), `efficiency` (power that comes
        out over power that goes in, negative where the load cannot drive the motor), `friction_share` (per joint),
        `drive_torque_other` (coming from the other side), `jam_joint` and `jam_coefficient` (the joint that takes most
        of the power where the mechanism jams, and its coefficient from which it does).

        At rest, beside the pose without friction: `friction_low` and `friction_high` (ends of every component of the
        error), `friction_position` and `friction_rotation` (largest sizes), `drive_torque_low` and `drive_torque_high`.
        A local search finds them; that there is no pose farther away is not proved.

        An over-constrained or elastic mechanism has as well: `clearance_factor` (clearance scale factor
        required for assembly of the rigid bodies), `prestress` (reactions without any load), `lack_of_fit` (largest
        misfit of the nominal mechanism), `duality_gap` (upper bound of the distance from the optimum of the last cone
        program), `deformation` (of every elastic joint), `contribution_elastic` (contribution of its compliance to the
        first-order error; all of them together are the contribution of the load), and of elastic bodies `member_force`
        (tension positive) and `member_elongation`. A reaction is nan where rigid joints without clearance share the
        load and nothing determines the shares.

    Raises
    ------
    InputError
        When nothing loads the mechanism; with an approach, when nothing rubs, or its friction is not computed.

    Examples
    --------
    >>> import jointplay as jp
    >>> result = jp.loaded(jp.loads(jp.examples.text("four-bar")))
    >>> result.error.sel(component=["x", "y"])[0].values.round(4)
    array([ 0.9505, -3.1031])
    """
    return to_dataset(compute(m, exact=exact, details=details, sizes=sizes, approach=approach))


@recorded
@of_each(lambda _: True)
def compute(
    m: Mechanism,
    *,
    exact: bool = True,
    details: bool = True,
    sizes: str = "middle",
    approach: str | None = None,
    offset: bool = False,
    plays: bool = True,
    follows: bool = True,
    at: Nominal | None = None,
    progress: Progress | None = None,
) -> Result:
    """The light form of `loaded`.

    `offset` asks for the offsets without the other details, `plays` for what quantities with limits reach with the
    largest and the smallest play, where sizes scatter and those in the middle are asked for, `follows` for whether
    contact follows the reactions of a machine that runs.
    """
    require_loads(m)
    if approach is not None:
        friction.require(m, approach, exact=exact)
    at = (at or nominal(m)).with_errors
    count, drives, poses = len(at), at.drives, at.poses
    motion = motion_of(m, at)
    bodies = moving(m, at, motion)
    loads = acting_on(m, at, bodies)
    rubs = approach is not None
    plays &= sizes == "middle" and "size" in m.source_kinds and bool(m.limits.errors)
    core, parts = core_with(m, sizes), 1 + len(PLAYS) * plays

    def run(part: slice) -> Loaded:
        own, every = None if loads is None else loads[part], details or rubs
        return core.loaded(drives[part], poses[part], exact, offset or every, every, partly=True, loads=own)

    found, done = batched(count, BATCH, run, None if progress is None else share(progress, 0, parts))
    found, at = without_singular(found), at.first(done)
    pressing = None if loads is None else loads[:done]
    asked = friction.setting(m, at, motion, found, sizes, pressing) if approach is not None else None
    sides = friction.both(asked) if asked is not None and approach in friction.SIDES else {}
    if approach in sides:
        found = sides[approach].found
    pose = ("configuration", "component")
    how = "" if m.core.isostatic else "cone programs, "
    how += f"steps until offsets and reactions agree, {ON_CLOSURE}" if exact else TO_FIRST_ORDER
    builder = report(m, "loaded", at, obtained=how, **attributes(m, sizes), **speeds(m), **friction.told(m, approach))
    words = "error of the output, actual - nominal" + ("" if exact else ", to first order")
    builder.add("error", pose, found["error"], words, "component")
    builder.add(
        "undetermined", pose, found["undetermined"], "half-width of the indeterminacy that the load leaves", "component"
    )
    if asked is not None and approach in sides:
        friction.add(builder, sides, approach, details=details)
    elif asked is not None:
        friction.add_rest(builder, friction.held(asked))
    if motion is not None and bodies is not None:
        motion = motion.first(done)
        add_motion(m, builder, motion, bodies.first(done), details=details)
    if offset or details:
        builder.add("offset", ("configuration", "parameter"), found["offset"], "offset of the parameter", "parameter")
    if details:
        _details(builder, found)
        _drives(m, builder, found)
    if motion is not None and details:
        add_drives(m, builder, motion, found["drive_force"])
    if motion is not None and follows:
        add_contact(m, builder, at, motion)
    builder.add("iterations", "configuration", found["iterations"], "steps until contact had converged")
    if not m.core.isostatic:
        words = "clearance scale factor required for assembly of the rigid bodies"
        builder.add("clearance_factor", "configuration", found["clearance_factor"], words)
        if details:
            _strain(m, builder, found)
    words = "places found where the load may hold the mechanism; the one with the most work is given"
    builder.add("equilibria", "configuration", found["equilibria"], words)
    judge(builder)
    unfinished = ""
    if plays:
        unfinished = _plays(m, builder, at, motion, pressing, exact=exact, approach=approach)
        if progress is not None:
            progress(parts, parts)
    builder.status(at.worse(found["status"]))
    return finished(builder, done, count, unfinished)


def _plays(
    m: Mechanism,
    builder: ResultBuilder,
    at: Nominal,
    motion: DriveMotion | None,
    loads: Floats | None,
    *,
    exact: bool,
    approach: str | None,
) -> str:
    """Add what quantities reach with the largest and the smallest play; in words what Ctrl-C has left out of it."""
    unfinished = ""
    for play in PLAYS:
        lowest, highest = np.full((2, len(at), len(m.quantities)), np.nan)
        rubs = approach is not None
        found = core_with(m, play).loaded(at.drives, at.poses, exact, rubs, rubs, partly=True, loads=loads)
        done = len(found["status"])
        half, every = found["undetermined"], [found]
        if approach is None:
            ends = reached([found["error"]], half, m.components)
        else:
            asked = friction.setting(m, at.first(done), motion, found, play, None if loads is None else loads[:done])
            if approach in friction.SIDES:
                # The limits hold from whichever side the machine comes.
                every = [side.found for side in friction.both(asked).values()]
                half = np.max([side["undetermined"] for side in every], axis=0)
                ends = reached([side["error"] for side in every], half, m.components)
            else:
                held = friction.held(asked)
                ends = of_sizes(held.low, held.high, held.position, held.rotation)
        known = np.all([np.isin(STATUSES[at.first(done).worse(of["status"])], READABLE) for of in every], axis=0)
        lowest[:done][known], highest[:done][known] = (end[known] for end in ends)
        add_play(builder, play, lowest, highest)
        if done < len(at):
            unfinished = f", and after {done} of them with the {play} play"
    return unfinished


def acting_on(m: Mechanism, at: Nominal, bodies: Kinematics | None) -> Floats | None:
    """Loads of all configurations with the forces of inertia; None where they are the same everywhere."""
    return acting(m, bodies, range(len(at))) if m.loads.vary else None


def loads_of(m: Mechanism, at: Nominal) -> Floats | None:
    """The same where how the bodies move is not asked for."""
    return acting_on(m, at, moving(m, at, motion_of(m, at)))


def _details(builder: ResultBuilder, found: Loaded) -> None:
    """What every joint and every source does."""
    words = "error to first order"
    builder.add("error_first_order", ("configuration", "component"), found["error_first_order"], words, "component")
    builder.add(
        "undetermined_contribution",
        ("configuration", "source", "component"),
        found["undetermined_contribution"],
        "contribution of the source to the indeterminacy",
        "component",
    )
    words = "whether the load determines the offset"
    builder.add("decided", ("configuration", "source"), found["decided"], words)
    builder.add(
        "reaction",
        ("configuration", "joint", "wrench"),
        found["reaction"],
        "force and moment on the second body of the joint",
        "wrench",
    )
    builder.add(
        "contribution",
        ("configuration", "source", "component"),
        found["contribution"],
        "contribution of the source to the first-order error",
        "component",
    )


def _drives(m: Mechanism, builder: ResultBuilder, found: Loaded) -> None:
    """What every drive does, and at which end of its lost motion it is."""
    each = ("configuration", "drive")
    words = "moment or force of the drive on the second body of its joint, along its coordinate"
    builder.add("drive_torque", each, found["drive_force"], words, "work:drive")
    if "backlash" in m.source_kinds:
        words = "end of the lost motion at which the load holds the drive: 1 the upper, -1 the lower, 0 neither"
        builder.add("drive_flank", each, _flanks(m, found["offset"]), words)


def _flanks(m: Mechanism, offset: Floats) -> NDArray[np.int64]:
    """Ends of the lost motions; of a drive of several joints that which all of its gearboxes are at, if it is one."""
    # Two columns per drive: whether each end is taken by all.
    at_end = np.zeros((len(offset), len(m.drives), 2), dtype=bool)
    seen: set[int] = set()
    for s in np.flatnonzero(np.array(m.source_kinds) == "backlash"):
        source, sides = m.compiled_sources[s].spec, m.compiled_sources[s].limits
        if "drive" not in source or sides is None:  # of a follower
            continue
        drive, (low, high) = source["drive"], sides
        width = high - low
        at = offset[:, int(np.flatnonzero(m.parameter_source == s)[0])]
        if not width:
            continue
        ends = np.abs(at[:, None] - [high, low]) <= AT_END * width
        if dict(m.drive_moves[drive])[source["joint"]] < 0.0:
            ends = ends[:, ::-1]
        at_end[:, drive] = ends & at_end[:, drive] if drive in seen else ends
        seen.add(drive)
    taken: NDArray[np.int64] = at_end[..., 0].astype(np.int64) - at_end[..., 1]
    return taken


def _strain(m: Mechanism, builder: ResultBuilder, found: Loaded) -> None:
    """The further results of over-constrained and elastic mechanisms."""
    words = "reaction without any load"
    builder.add("prestress", ("configuration", "joint", "wrench"), found["prestress"], words, "wrench")
    words = "largest misfit of the nominal mechanism, angles at its characteristic length"
    builder.add("lack_of_fit", "configuration", found["lack_of_fit"], words, "length")
    builder.add("duality_gap", "configuration", found["gap"], "relative duality gap of the last cone program")
    if not m.core.deformations:
        return
    words = "elastic deformation of the joint"
    builder.add("deformation", ("configuration", "elastic"), found["deformation"], words, "elastic")
    dims = ("configuration", "joint", "component")
    words = "contribution of the joint's compliance to the first-order error"
    builder.add("contribution_elastic", dims, found["contribution_elastic"], words, "component")
    if m.members:
        forces, deformations = m.core.rows, m.core.deformations
        along = [forces.index((member.joint, "along")) for member in m.members]
        words = "force of the member, tension positive"
        builder.add("member_force", ("configuration", "member"), found["force"][:, along], words, "force")
        elongation = np.zeros((len(found["force"]), len(along)))
        for k, member in enumerate(m.members):
            # A member that only bends keeps its length.
            if (member.joint, "along") in deformations:
                elongation[:, k] = found["deformation"][:, deformations.index((member.joint, "along"))]
        words = "elastic elongation of the member"
        builder.add("member_elongation", ("configuration", "member"), elongation, words, "length")


def require_loads(m: Mechanism, otherwise: str = "") -> None:
    """Refuse a mechanism on which nothing acts; redundant members may load each other.

    Parameters
    ----------
    otherwise : str
        What may be asked instead.
    """
    if not m.has_loads and m.core.isostatic:
        where = f" in load case '{m.of[1]}'" if m.of[1] else ""
        what = "[[loads]] with a force or a moment, [springs.NAME], or gravity and masses"
        problem = f"nothing loads the mechanism{where}: add {what}{otherwise}"
        raise InputError(problem, file=m.file, key="loads")
