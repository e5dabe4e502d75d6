"""`check`: what a mechanism is made of, how it can move, and whether it can be assembled."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from jointplay.basics import poses
from jointplay.basics.arrays import Floats
from jointplay.basics.typed import typed
from jointplay.core.compile import LENGTHS, described
from jointplay.core.sets import furthest
from jointplay.model.gaps import ROUNDED, clearance_of, scattering
from jointplay.model.mechanism import Mechanism
from jointplay.model.mobility import SelfStress, examine, held_spins, misfit_words, spin_words
from jointplay.result import Result, ResultBuilder, Variable, axes_of, to_dataset
from jointplay.result.verdict import add_limits, limits_in_words, percent

from .failure import failure
from .hints import hints
from .recorded import recorded

if TYPE_CHECKING:
    import xarray as xr


@typed
def check(m: Mechanism) -> xr.Dataset:
    """Examine a mechanism without asking for its error.

    Parameters
    ----------
    m : Mechanism
        Any, also with too few or too many drives.

    Returns
    -------
    xarray.Dataset
        Over `joint` its kind and bodies (`joint_kind`, `first_body`, `second_body`); over `body` where the file says it
        is (`guess`); over `source` its `size`; over `drive` its `driven_joint`. Where sizes scatter, over `clearance`:
        `play` (least and most travel from side to side, negative with interference) and `play_given` (how it is given).
        Where bodies are elastic, over `member`: `member_joint`, `member_length`, `member_stiffness` (along it). Where
        there are springs, over `spring`: `spring_on`, `spring_stiffness`. Where constraints are redundant, over
        `number`: `self_stress` (reactions that need no load, the largest force 1) and `self_stress_members` (what they
        run through). Where parts are not drawn to fit, `gap` over `joint` (how far it stays open in nominal poses) and
        the attribute `misfit` (a sentence: what would close it). Where a rod between two balls can spin about itself,
        over `spin`: `spin_words` (which bodies, about which line); such spins move neither an output nor a load, are
        held and do not count as freedoms. Attributes: `degrees_of_freedom`, `redundancy` (how many constraints are
        redundant), `mobility` (a sentence), `determinate` (whether the drives decide every pose just once), `decided`
        (once or more, with no drive too many), `assembled` (whether the mechanism can be assembled near the start, with
        its first drive values), as 0 or 1; `outputs` and `load_cases` (names, where the file has several); where
        configurations cannot be assembled, `failure` (sentences: which loop stays open, at which joint and by how much,
        and what would close it); where numbers look as if others were meant, `hints`.

    Examples
    --------
    >>> import jointplay as jp
    >>> jp.check(jp.loads(jp.examples.text("five-bar"))).attrs["mobility"]
    '2 degrees of freedom, 2 drives'
    """
    return to_dataset(compute(m))


@recorded
def compute(m: Mechanism) -> Result:
    """The light form of `check`."""
    # A spin that is held under some loads and turned by those of a case is a free motion in this case.
    part = next((part for part in m.every_part if any(spin.load is not None for spin in part.spins)), m)
    mobility = examine(part)
    if mobility.is_decided:
        failed = failure(part)
    else:
        # With a drive too many or too few only the first configuration says something.
        first = (m.start_drives[None] if m.drive_values is None else m.drive_values)[:1]
        nowhere = np.full((1, len(m.bodies), m.pose_size), np.nan)
        failed = None if mobility.assembled or mobility.open else failure(part, first, nowhere)
    builder = ResultBuilder(
        m,
        "check",
        degrees_of_freedom=mobility.degrees_of_freedom,
        redundancy=mobility.joint_redundancy,
        mobility=mobility.words,
        determinate=int(mobility.is_determinate),
        decided=int(mobility.is_decided),
        assembled=int(mobility.assembled and (failed is None or failed.first > 0)),
    )
    if failed is not None:
        builder.attrs["failure"] = "\n".join(failed.words)
    looks = hints(m)
    if looks:
        builder.attrs["hints"] = "\n".join(looks)
    if mobility.misfit is not None:
        builder.attrs["misfit"] = misfit_words(m, mobility.misfit)
        inner = {member.joint: member.name for member in m.members}
        gaps = [mobility.misfit.gaps.get(inner.get(k, joint), (0.0, 0.0)) for k, joint in enumerate(m.joints)]
        builder.add("gap", "joint", np.array([gap for gap, _ in gaps]), "how far the joint stays open", "length")
    names = ("ground", *m.owners)
    ends = [[names[bodies[end] + 1] for bodies in m.joint_bodies] for end in (0, 1)]
    builder.add("joint_kind", "joint", np.array(m.joint_kinds, dtype=str), "type of the joint")
    builder.add("first_body", "joint", np.array(ends[0], dtype=str), "body that carries the joint")
    builder.add("second_body", "joint", np.array(ends[1], dtype=str), "body that rides on it")
    guess = poses.components(m.guess)
    builder.add("guess", ("body", "component"), guess, "pose of the body at the start", "component")
    driven = np.array([", ".join(m.joints[joint] for joint, _ in moves) for moves in m.drive_moves], dtype=str)
    builder.add("driven_joint", "drive", driven, "joint that the drive commands, of a motor all that it moves")
    _members(m, builder)
    _springs(m, builder)
    _self_stresses(m, builder, mobility.self_stresses)
    _spins(part, builder)
    if m.sources:
        sizes, units = _sizes(m)
        builder.add("size", "source", sizes, "largest offset: radius, gap or larger tolerance")
        builder.coords["source_unit"] = Variable(("source",), np.array(units, dtype=str), "", "unit along source")
    _plays(m, builder)
    values = m.drive_values if m.drive_values is not None else m.targets
    builder.attrs["configurations"] = 0 if values is None else len(values)
    if known := _limits(m):
        builder.attrs["limits"] = "\n".join(known)
    for name, several in (("outputs", m.outputs), ("load_cases", m.load_cases)):
        if several:
            builder.attrs[name] = ", ".join(several)
    return builder.result()


def _limits(m: Mechanism) -> list[str]:
    """The acceptable errors of every output that has some."""
    found = []
    for name in m.outputs or (None,):
        part = m.only(name, next(iter(m.load_cases), None))
        if part.limits.errors:
            builder = ResultBuilder(part, "check")
            add_limits(builder)
            limits = limits_in_words(Result(builder.coords, builder.data))
            found.append(f"{name}: {limits}" if name else limits)
    if np.isfinite(m.limits.probability):
        each = ", of each output by itself" if m.outputs else ""
        share = percent(m.limits.probability)
        found.append(f"{share} of the specimens have to keep to them at every configuration{each}")
    return found


def _members(m: Mechanism, builder: ResultBuilder) -> None:
    if not m.members:
        return
    joints = [m.joints[member.joint] for member in m.members]
    builder.add("member_joint", "member", np.array(joints, dtype=str), "joint that gives as the member does")
    lengths = np.array([member.length for member in m.members])
    builder.add("member_length", "member", lengths, "length of the member", "length")
    compliances = (m.compliance(member.joint) for member in m.members)
    stretch = np.array([own[0, 0] for own in compliances if own is not None])
    stiffness = np.divide(1.0, stretch, out=np.full(len(stretch), np.inf), where=stretch > 0.0)
    builder.add("member_stiffness", "member", stiffness, "stiffness along the member", "stiffness")


def _springs(m: Mechanism, builder: ResultBuilder) -> None:
    if not m.data.springs:
        return
    springs = m.data.springs.values()
    on = [", ".join(spring.on) if spring.on is not None else f"about {spring.joint}" for spring in springs]
    builder.labels("spring", np.array(list(m.data.springs), dtype=str), "name of the spring")
    builder.add("spring_on", "spring", np.array(on, dtype=str), "bodies that the spring is on, or its joint")
    units = [m.units.turning_stiffness_name if spring.on is None else m.units.stiffness_name for spring in springs]
    stiffness = np.array([spring.stiffness for spring in springs])
    builder.add("spring_stiffness", "spring", stiffness, "stiffness of the spring, in its own unit")
    builder.coords["spring_unit"] = Variable(("spring",), np.array(units, dtype=str), "", "unit along spring")


def _self_stresses(m: Mechanism, builder: ResultBuilder, found: Sequence[SelfStress]) -> None:
    if not found:
        return
    builder.labels("number", np.arange(1, len(found) + 1), "number of the self-stress")
    forces = sum(component in LENGTHS for component in m.components)
    # One of the file's units of force where there is a force, and as much moment where there is none.
    scales = [m.units.force if stress.reactions[:, :forces].any() else m.units.moment for stress in found]
    reactions = np.array([scale * stress.reactions for scale, stress in zip(scales, found, strict=True)])
    builder.add("self_stress", ("number", "joint", "wrench"), reactions, "reactions without a load", "wrench")
    words = np.array([stress.words for stress in found], dtype=str)
    builder.add("self_stress_members", "number", words, "bodies that the self-stress runs through")


def _spins(m: Mechanism, builder: ResultBuilder) -> None:
    words = [spin_words(m, spin) for spin in held_spins(m)]
    if words:
        builder.labels("spin", np.arange(1, len(words) + 1), "number of the spin")
        builder.add("spin_words", "spin", np.array(words, dtype=str), "what spins, and is held, about which line")


def _plays(m: Mechanism, builder: ResultBuilder) -> None:
    """The clearances whose size scatters: what makes them, and the travel from side to side that this allows."""
    found = scattering(m)
    if not found:
        return
    names = [m.sources[k] for k in found]
    builder.labels("clearance", np.array(names, dtype=str), "clearance whose size scatters")
    travel = 2.0 * np.array([*found.values()])
    # A play of zero is neither play nor interference.
    travel[np.abs(travel) <= 2.0 * ROUNDED * m.length] = 0.0
    words = "least and most travel from side to side; negative where hole and pin have interference"
    builder.add("play", ("clearance", "side"), travel, words, "length")
    # A pin with several bodies, or a universal joint, stands once in the file.
    joints = [m.data.joints[name.partition("/")[0].partition(".")[0]] for name in names]
    given = [described(getattr(joint, "clearance", None)) for joint in joints]
    builder.add("play_given", "clearance", np.array(given, dtype=str), "how it is given")


def _sizes(m: Mechanism) -> tuple[Floats, list[str]]:
    """The size of every source's set in units of the file, and those units."""
    sizes: list[float] = []
    units: list[str] = []
    kinds, columns = axes_of(m)["parameter"].kinds, np.unique(m.parameter_source, return_index=True)[1]
    for s, first in enumerate(columns.tolist()):
        _, size = clearance_of(m, s)
        sizes.append(furthest(size) / float(m.parameter_factors[first]))
        units.append(str(getattr(m.units, f"{kinds[first]}_name")))
    return np.array(sizes), units
