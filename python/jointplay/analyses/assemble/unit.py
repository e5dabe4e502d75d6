"""One built specimen, whose deviations are known."""

import numpy as np

from jointplay.analyses.nominal import Progress
from jointplay.basics.arrays import Floats
from jointplay.core.compile import LOOSE
from jointplay.model.mechanism import Mechanism
from jointplay.result import Result, axes_of

from .forces import Members
from .report import Configuration, each, finished, report
from .specimens import solve
from .state import Held, contact, state
from .steps import Step, steps

#: half the difference of two specimens for a derivative, as a share of the characteristic length or in radians
DIFFERENCE = 1e-6
CENTRES = ("step", "joint", "component")


def compute(m: Mechanism, at: Configuration, progress: Progress | None = None) -> Result:
    """The state of the specimen after every step."""
    every, members = list(steps(m, at.poses)), Members(m)
    states = each(every, lambda step: state(step, members), progress)
    taken = every[: len(states)]

    def over(name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return np.array([getattr(found, name) for found in states])

    builder = report(m, taken, at, "unit")
    for end, body in (("shaft", "first"), ("bearing", "second")):
        words = f"of the centre on the {body} body of the joint"
        builder.add(f"error_{end}", CENTRES, over(end), f"error {words}, actual - nominal", "component")
        open_words = f"half-width {words} of the indeterminacy that the loads leave"
        builder.add(f"undetermined_{end}", CENTRES, over(f"{end}_open"), open_words, "component")
    builder.add("error", CENTRES[::2], over("error"), "error of the output, actual - nominal", "component")
    builder.add(
        "undetermined",
        CENTRES[::2],
        over("error_open"),
        "half-width of the indeterminacy that the loads leave",
        "component",
    )
    per = np.array([slopes(step, members) for step in taken]) * m.parameter_factors / m.component_factors[:, None]
    words = "error of the output per offset of the parameter, in their units"
    builder.add("sensitivity", ("step", "component", "parameter"), per, words)
    builder.add("clearance_offset", ("step", "parameter"), over("offset"), "offset of the parameter", "parameter")
    touching = np.array([contact(m, found) for found in states], dtype=str)
    builder.add("contact", ("step", "source"), touching, "whether the clearance is taken up")
    wrench = "force and moment on the second body of the joint"
    builder.add("reaction", ("step", "joint", "wrench"), over("reaction"), wrench, "wrench")
    builder.labels("member", members.names, "link between two points")
    builder.add("member_force", ("step", "member"), over("force"), "force along the member, tension positive", "force")
    builder.add("member_elongation", ("step", "member"), over("elongation"), "elastic elongation", "length")
    factor = "clearance scale factor required for assembly of the rigid bodies"
    builder.add("clearance_factor", "step", over("clearance_factor"), factor)
    builder.add("status", "step", np.array([found.status for found in states], dtype=str), "outcome")
    return finished(builder, len(every))


def slopes(step: Step, members: Members) -> Floats:
    """Error of the output per offset of every parameter, SI; shape (component, parameter).

    Where the part is over-constrained, deviations only have a slope, as differences between specimens: clearances are
    where these and the loads put them.
    """
    held = Held(step)
    m, part = step.part.m, step.part
    found = np.full((len(m.components), len(m.parameters)), np.nan)
    if held.output is None:
        return found
    if not held.redundant:
        core = held.core(joints=held.rigid_joints)
        found[:, part.parameters] = core.sensitivity(held.drives, held.poses)["source"][0]
        return found
    own = [int(p) for p in part.parameters if m.source_kinds[int(m.parameter_source[p])] not in LOOSE]
    away = DIFFERENCE * np.where(np.array(axes_of(m)["parameter"].kinds)[own] == "angle", 1.0, m.length)
    u = np.repeat(m.centre[None], 2 * len(own), 0)
    for k, (p, size) in enumerate(zip(own, away, strict=True)):
        u[2 * k : 2 * k + 2, p] += [size, -size]
    output = solve(held, members, u).output
    found[:, own] = ((output[::2] - output[1::2]) / (2.0 * away[:, None])).T
    return found
