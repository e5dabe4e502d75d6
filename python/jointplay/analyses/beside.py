"""Limits of forces beside a question of errors, which does not judge them itself.

Mechanisms that are compared, sizes that were chosen and clearances that have worn are asked for their forces in the
worst case. The result has what is used of a limit at most, where, or why that is not known.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from jointplay.analyses.forces import check, compute
from jointplay.analyses.nominal import Nominal, within_another
from jointplay.basics.arrays import Floats
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism
from jointplay.result import FORCES_APART, FORCES_JUDGED, Result, Variable, counted, first_largest, parts
from jointplay.result.verdict import NOT_SHOWN, RANK, verdict


def judged(*mechanisms: Mechanism, at: Nominal | None = None) -> dict[str, Variable]:
    """What is to be said of the limits of forces, as variables of a result; nothing where the file has none.

    Parameters
    ----------
    *mechanisms : Mechanism
        The whole one, or its parts in all load cases.
    at : Nominal, optional
        Their configurations.
    """
    if not mechanisms[0].limits.forces:
        return {}
    try:
        with within_another():
            every = [(m, part) for m in mechanisms for _, part in parts(compute(m, at=at))]
    except InputError as problem:
        return said(NOT_SHOWN, unknown=problem.problem)
    own, used, m, part = max(
        ((verdict(part), _used(part), m, part) for m, part in every),
        key=lambda one: (RANK[one[0].outcome], one[1].max()),
    )
    unknown = own.gist if own.outcome == NOT_SHOWN else ""
    place = int(first_largest(used))
    if used[place] == -math.inf:
        return said(own.outcome, unknown=unknown)
    shares = np.nan_to_num(part.get("limit_used")[place], nan=-math.inf, posinf=math.inf)
    force = str(part.labels("quantity")[int(shares.argmax())])
    case = str(part.get("load_case")) if "load_case" in part.coords else m.of[1]
    return said(own.outcome, float(used[place]), force, place, case, unknown)


def why_not(m: Mechanism) -> str:
    """Why the forces of a mechanism cannot be judged; empty where they can."""
    try:
        for part in m.every_part:
            check(part)
    except InputError as problem:
        return problem.problem
    return ""


def with_forces(result: Result, found: Mapping[str, Variable]) -> Result:
    """A result with what is to be said of the limits of forces, if there is anything."""
    attrs = {name: value for name, value in result.attrs.items() if name != FORCES_APART or not found}
    return replace(result, data={**result.data, **found}, attrs=attrs)


def said(
    outcome: str, used: float = math.nan, force: str = "", place: int = -1, load_case: str = "", unknown: str = ""
) -> dict[str, Variable]:
    """The variables by which results tell of the limits of forces."""
    values = {
        FORCES_JUDGED: (outcome, "whether the limits of forces hold in the worst case: held, missed or not shown"),
        "forces_used": (used, "largest part of a limit of forces that is used"),
        "forces_quantity": (force, "of which force"),
        "forces_configuration": (place, "at which configuration; -1 where it is not known"),
        "forces_load_case": (load_case, "in which load case"),
        "forces_unknown": (unknown, "why it is not known whether they hold"),
    }
    return {name: Variable((), np.array(value), "", words) for name, (value, words) in values.items()}


def _used(part: Result) -> Floats:
    """What every configuration uses at most; nothing where it is not known or does not count."""
    used = np.nan_to_num(part.get("used"), nan=-math.inf, posinf=math.inf)
    return np.where(counted(part.get("status")), used, -math.inf)
