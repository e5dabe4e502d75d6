"""What is told of a long chain takes as many operations for each joint as that of a short one."""

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

import jointplay as jp
from jointplay.analyses.check import compute
from jointplay.result.table import tables

#: by how much more the operations for each joint of a chain of twice as many may be
MORE = 1.15


def chain(count: int) -> str:
    """Links in a row, each with a drive and a clearance."""
    parts = ['format = 1\nunits = { length = "mm", angle = "deg", force = "N" }']
    for k in range(count):
        before = f"link{k - 1}" if k else "ground"
        parts.append(f'[joints.J{k}]\ntype = "revolute"\nbodies = ["{before}", "link{k}"]\nat = [{10 * k}, 0]')
        parts.append(f'clearance = {{ radial = 0.01 }}\n[drives.q{k}]\njoint = "J{k}"\nvalues = [0]')
    return "\n".join([*parts, f'[output]\nbody = "link{count - 1}"\nat = [{10 * count}, 0]'])


def operations(work: Callable[[], object]) -> int:
    """How many operations of the interpreter some work takes."""
    count = 0

    def seen(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal count
        frame.f_trace_opcodes = True
        count += event == "opcode"
        return seen

    sys.settrace(seen)
    try:
        work()
    finally:
        sys.settrace(None)
    return count


def test_check_of_a_chain_grows_with_its_length() -> None:
    """A chain of 900 joints took more than 20 s: the kinds of all parameters were found anew for every source."""

    def asked(count: int) -> int:
        text = chain(count)
        return operations(lambda: tables(compute(jp.loads(text))))

    asked(3)
    short, long = asked(40), asked(80)
    assert long - short < 2.0 * MORE * (short - asked(20))
