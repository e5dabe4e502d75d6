"""What conclusions are made of: sentences, of which some say that something is wrong, and the words for places."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Array
from jointplay.errors import listed
from jointplay.result import Result, first_largest, size, unit_of
from jointplay.result.verdict import READABLE

OUTSIDE = "outside_limits"
#: as many configurations are named one by one
FEW = 8
#: digits of an upper bound
BOUND_DIGITS = 5


@dataclass(frozen=True)
class Sentence:
    """A sentence of an answer."""

    text: str
    #: whether it says that a limit is missed, or that a configuration or a step is not ok
    is_alarm: bool = False
    #: whether it stands in front where several questions are asked, as sentences of alarm do
    is_answer: bool = False
    #: whether it holds whatever is asked, so that it is said once for all questions
    is_common: bool = False
    #: of a verdict: ``held``, ``missed`` or ``not shown``
    state: str = ""
    #: whether it says that the machine cannot stand somewhere, so that it comes before what is said of the rest
    is_first: bool = False


@dataclass(frozen=True)
class Conclusion:
    """The answer to a question."""

    #: the most important one first
    sentences: tuple[Sentence, ...]
    #: by which the answers for several outputs and load cases are compared: the larger, the worse
    severity: tuple[float, ...] = ()


def say(value: float, unit: str = "") -> str:
    """A number with four digits and its unit."""
    return f"{value:.4g} {unit}".rstrip()


def rounded_up(values: Array) -> Array:
    """Numbers with few digits that are not below the given ones."""
    sizes = np.abs(values[np.isfinite(values)])
    largest = float(sizes.max(initial=0.0))
    if largest == 0.0:
        return values
    scale = 10.0 ** (BOUND_DIGITS - 1 - math.floor(math.log10(largest)))
    up: Array = np.ceil(values * scale) / scale
    return up


def plural(count: int, one: str, more: str = "") -> str:
    """``1 configuration``, ``2 configurations``."""
    return f"{count} {one if count == 1 else more or one + 's'}"


def strung(names: Sequence[str]) -> str:
    """``in the worst case, under the load and in the required 99 % of the specimens``."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def which(places: Sequence[int]) -> str:
    """``Configurations 1, 3``."""
    if len(places) > FEW:
        return f"{len(places)} configurations (the first is {places[0]})"
    return f"Configuration{'s' * (len(places) > 1)} {', '.join(map(str, places))}"


def of_statuses(result: Result) -> Iterator[Sentence]:
    """Which configurations are not ok."""
    status = result.get("status")
    if (status == "ok").all():
        return
    total, found = status.size, []
    for outcome in dict.fromkeys(status[status != "ok"].reshape(-1).tolist()):
        places = np.flatnonzero(status == outcome).tolist()
        told = [", ".join(map(str, places))] if len(places) <= FEW and 1 < total != len(places) else []
        told += [leaving(result)] if outcome == OUTSIDE else []
        named = f" ({'; '.join(told)})" if told else ""
        found.append(f"{len(places) if len(places) < total else 'all'} {outcome.replace('_', ' ')}{named}")
    of = plural(total, "configuration")
    text = f"Status of the configuration: {found[0][4:]}." if total == 1 else f"Not ok of {of}: {', '.join(found)}."
    yield Sentence(text, is_alarm=True, is_common=True, is_first=OUTSIDE in status)


def leaving(result: Result) -> str:
    """``l1 and l2 leave their ranges``: what keeps the machine from standing at some configurations."""
    names = sorted({*result.get("leaves_range").reshape(-1).tolist()} - {""})
    named = listed(names) if len(names) <= FEW else f"{len(names)} drives and joints"
    return f"{named} {'leaves its range' if len(names) == 1 else 'leave their ranges'}"


def without_path(result: Result) -> NDArray[np.bool_]:
    """Where the other mechanisms of a comparison have no pose to follow because the first one has none.

    Returns
    -------
    ndarray of bool
        Shape (mechanism, configuration); never true for the first.
    """
    first = np.isnan(result.get("nominal")[0]).any(axis=-1)
    return np.stack([np.zeros_like(first), *[first] * (result.sizes["mechanism"] - 1)])


def off_path(result: Result, name: str) -> str:
    """By how much a mechanism of a comparison leaves the path of the first; nothing where it keeps to it."""
    distance = size(result, "mismatch", "position", mechanism=name)
    largest = float(np.nanmax(distance, initial=0.0))
    if largest <= 1e-6 * float(result.attrs.get("length", 1.0)):
        return ""
    return f"leaves the path by up to {say(largest, unit_of(result, 'position'))}"


def owners(result: Result) -> list[str]:
    """For every body the one of the file: pieces of an elastic one are called as it is."""
    return result.labels("owner" if "owner" in result.coords else "body")


def farthest(values: Array, status: Array) -> int | None:
    """Where a value is largest among configurations whose numbers can be read: the first one, to rounding."""
    known = np.isfinite(values) & np.isin(status, READABLE)
    if not known.any():
        return None
    return int(first_largest(np.where(known, values, -np.inf)))
