"""What a verdict is, and which configurations it is over."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointplay.basics.arrays import Array
from jointplay.result import Result, counted

from .words import configurations, left_out

HELD, MISSED, NOT_SHOWN = "held", "missed", "not shown"
#: by which outcomes are compared: the larger, the worse; nothing is said where there is nothing to keep to
RANK = {"": 0, HELD: 1, NOT_SHOWN: 2, MISSED: 3}
#: outcomes of configurations that have a pose whose numbers can be read
READABLE = ("ok", "undetermined", "strained")
#: outcomes of configurations whose numbers, if there are any, cannot be relied on
UNRELIABLE = ("not_assembled", "singular", "underconstrained", "")
#: where contact does not follow the reaction, or may not: the numbers there are those of another place
LOOSE = ("lost", "may be lost")


@dataclass(frozen=True)
class Verdict:
    """What is to be said of a result and of its limits."""

    #: the answer first; none where the file has no limits
    sentences: tuple[str, ...] = ()
    #: for every configuration what it misses, ``""`` where it keeps to all limits
    marks: tuple[str, ...] = ()
    #: ``held``, ``missed`` or ``not shown``; empty where there is nothing to keep to
    outcome: str = ""
    #: how many of the sentences, from the first, are the answer
    answers: int = 1
    #: how many of the sentences, from the first, say what is missed
    alarms: int = 0
    #: largest share of a limit that is used, more than one where it is missed; of `random` the share outside
    used: float = 0.0
    #: the quantities whose errors the sentences name
    named: tuple[str, ...] = ()
    #: what it rests on, such as `` with clearances of middle size``
    basis: str = ""
    #: what decides, in few words; nothing where limits hold
    gist: str = ""

    @property
    def missed(self) -> bool:
        """Whether a limit is missed, or a required yield."""
        return self.outcome == MISSED


@dataclass(frozen=True)
class Rows:
    """The configurations that a verdict is over."""

    #: where the machine can stand
    counts: Array
    #: those of them whose numbers can be relied on
    known: Array
    #: whether all of them have been computed
    is_whole: bool
    #: whether numbers are not known because contact may be lost
    is_loose: bool = False

    @classmethod
    def of(cls, result: Result) -> Rows:
        """Those of a result of one output in one load case."""
        status = result.get("status")
        counts = counted(status)
        found = cls(counts, counts & ~np.isin(status, UNRELIABLE), "incomplete" not in result.attrs)
        return found.following(result.get("contact").T) if "contact" in result.data else found

    def but(self, known: Array) -> Rows:
        """The same where other numbers have to be known as well."""
        return replace(self, known=self.known & known)

    def following(self, contact: Array) -> Rows:
        """The same where contact has to follow the reactions, by the words for that, the last axis configurations."""
        loose = self.known & np.isin(contact, LOOSE).reshape(-1, len(self.known)).any(axis=0)
        return replace(self.but(~loose), is_loose=self.is_loose or bool(loose.any()))

    @property
    def unknown(self) -> list[int]:
        """The configurations that count and are not known."""
        return np.flatnonzero(self.counts & ~self.known).tolist()

    @property
    def are_all_known(self) -> bool:
        """Whether something counts, and all that does is known."""
        return self.is_whole and bool(self.counts.any()) and not self.unknown

    def why(self) -> str:
        """Why nothing is shown, in words."""
        if not self.counts.any():
            return "the machine cannot be at any configuration"
        if self.unknown:
            if self.is_loose:
                return f"contact may be lost near {configurations(self.unknown)}"
            many = len(self.unknown) > 1
            return f"{configurations(self.unknown)} {'are' if many else 'is'} unknown"
        return "" if self.is_whole else "not all configurations are computed"

    def left_out(self) -> str:
        """What is left out, as the end of a sentence."""
        return left_out(np.flatnonzero(~self.counts).tolist()) if self.counts.any() else ""


def worst_of(outcomes: list[str]) -> str:
    """The worst of some outcomes; none where there are none.

    Examples
    --------
    >>> worst_of(["held", "not shown", ""])
    'not shown'
    """
    return max(outcomes, key=RANK.__getitem__, default="")
