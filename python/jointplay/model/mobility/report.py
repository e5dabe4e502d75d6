"""What an attempt to assemble a mechanism found, in sentences and units of the file."""

import json
import math
import re
from collections.abc import Iterator, Sequence

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.compile import ANGULAR
from jointplay.model.mechanism import Mechanism

from .attempt import Attempt, Cure

#: lengths, and joints that are open together, that are named
MOST_CURES = 3
#: joints that are named of those that cannot all close
MOST_NAMES = 12
#: significant digits
DIGITS = 4


def sentences(m: Mechanism, found: Attempt, missing: Sequence[int], count: int) -> list[str]:
    """What is known of configurations that cannot be assembled.

    Parameters
    ----------
    missing : sequence of int
        The configurations that cannot be assembled.
    count : int
        How many there are.
    """
    return list(_sentences(m, found, missing, count))


def _sentences(m: Mechanism, found: Attempt, missing: Sequence[int], count: int) -> Iterator[str]:
    beyond = "" if found.limit is None else f": beyond {_values(m, found.limit)}"
    yield f"{_which(missing, count)} cannot be assembled{beyond}."
    if found.start is not None:
        cause = "Was another start meant? With" if m.data.start else "No start is given. With"
        yield f"{cause} this one the first configuration can be assembled:"
        yield from _pasted(found.start)
    if not found.open:
        return
    inner = {member.joint for member in m.members}
    names = [m.joints[k] for k in found.loop if k not in inner]
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES and not found.is_loop else ""
    names = names if found.is_loop else names[:MOST_NAMES]
    at = f" at {_values(m, found.drives)}" if len(m.drives) else ""
    together = f"These joints cannot all close{at}: {', '.join(names)}{more}."
    yield f"The loop {', '.join(names)} stays open{at}." if found.is_loop else together
    if found.joint < 0:
        largest = ", ".join(f"'{m.joints[k]}' by {_size(m, gap, turn)}" for k, gap, turn in found.open[:MOST_CURES])
        others = len(found.open) - MOST_CURES
        less = f", and {others} more" if others > 0 else ""
        yield f"In the nearest attempt found, several joints are open together: {largest}{less}."
        return
    open_ = _size(m, found.gap, found.turn)
    joint = m.joints[found.joint]
    yield f"In the nearest attempt found, where every other joint is closed, '{joint}' is open by {open_}."
    if found.cures:
        lengths = "; or ".join(_length(m, cure) for cure in found.cures[:MOST_CURES])
        yield f"The loop closes{at} if one length is changed: {lengths}."
    elif found.is_loop and (found.start is None or m.data.start):
        yield "No single length of the loop was found that closes it."
    if found.reach is not None:
        yield from _range(m, found.reach)


def _which(missing: Sequence[int], count: int) -> str:
    if count == 1:
        return "The configuration"
    if len(missing) == count:
        return f"All {count} configurations"
    ends = [k for k in missing if k - 1 not in missing], [k for k in missing if k + 1 not in missing]
    runs = [str(a) if a == b else f"{a} to {b}" for a, b in zip(*ends, strict=True)]
    some = ", ".join(runs[:MOST_CURES]) + (", ..." if len(runs) > MOST_CURES else "")
    return f"Configuration{'s' * (len(missing) > 1)} {some} (of 0 to {count - 1})"


def _size(m: Mechanism, gap: float, turn: float) -> str:
    """By how much a joint is open; what is little beside the rest is not named."""
    least = 1e-3 * max(turn * m.length, gap)
    parts = [f"{gap / m.units.length:.{DIGITS}g} {m.units.length_name}"] if gap > least else []
    parts += [f"{turn / m.units.angle:.{DIGITS}g} {m.units.angle_name}"] if turn * m.length > least else []
    return " and ".join(parts)


def _values(m: Mechanism, values: Floats) -> str:
    parts = zip(m.drives, values / m.drive_factors, m.drive_joints, strict=True)
    return ", ".join(f"{name} = {value:.{DIGITS}g} {_unit(m, joint)}" for name, value, joint in parts)


def _unit(m: Mechanism, joint: int) -> str:
    return m.units.angle_name if m.joint_kinds[joint] in ANGULAR else m.units.length_name


def _length(m: Mechanism, cure: Cure) -> str:
    """A range, rounded into itself."""
    low, high, now = (value / m.units.length for value in (cure.low, cure.high, cure.now))
    unit = m.units.length_name
    limits = f"between {_rounded(low, math.ceil)} and {_rounded(high, math.floor)}"
    return f"'{cure.body}' from {cure.start} to {cure.end} {limits} {unit} (now {now:.{DIGITS + 2}g})"


def _rounded(value: float, way: object) -> str:
    step = 10.0 ** (math.floor(math.log10(max(abs(value), 1e-9))) - DIGITS)
    assert callable(way)
    return f"{way(value / step) * step:.{DIGITS + 1}g}"


def _range(m: Mechanism, reach: tuple[float, float]) -> Iterator[str]:
    low, high = (value / float(m.drive_factors[0]) for value in reach)
    name, unit = m.drives[0], _unit(m, m.drive_joints[0])
    low, high = min(low, high), max(low, high)
    if np.isinf([low, high]).all():
        return
    limits = [f"from {_rounded(low, math.ceil)}"] if math.isfinite(low) else []
    if math.isfinite(high):
        limits.append(f"{'' if limits else 'up '}to {_rounded(high, math.floor)}")
    yield f"With the lengths of the file it can be assembled for {name} {' '.join(limits)} {unit}."


def _pasted(start: dict[str, dict[str, object]]) -> Iterator[str]:
    """Lines of a file."""
    yield "[start]"
    for body, table in start.items():
        name = body if re.fullmatch(r"[A-Za-z0-9_-]+", body) else json.dumps(body, ensure_ascii=False)
        yield f"{name} = {{ {', '.join(f'{key} = {value}' for key, value in table.items())} }}"
