"""Where the clearances of a specimen are, when a yield is asked for.

    scattered   anywhere in its set, by its law
    loaded      where the load presses it

Where loads act and the file names neither, a yield has to be reached both ways: which of them the machine does is not
known, and either can be the smaller one.
"""

from dataclasses import dataclass

from jointplay.errors import InputError, not_known
from jointplay.model.mechanism import Mechanism

from .loaded import require_loads
from .random import CONTACTS


def contacts(m: Mechanism, given: str | None = None) -> tuple[str, ...]:
    """The assumptions by which a yield is judged.

    Parameters
    ----------
    given : {"scattered", "loaded"}, optional
        The one that is asked for; that of the file if left out, and both where the file has loads and names none.
    """
    if given is not None and given not in CONTACTS:
        raise InputError(not_known(given, "a contact", CONTACTS), key="contact")
    named = given or m.limits.contact
    found = (str(named),) if named in CONTACTS else CONTACTS if m.has_loads else CONTACTS[:1]
    if found == ("loaded",):
        for part in m.every_part:
            require_loads(part)
    return found


@dataclass(frozen=True)
class Assumed:
    """A mechanism with one output, and where its clearances are."""

    contact: str
    #: empty where the file has none, or where loads do not matter
    load_case: str
    part: Mechanism

    @property
    def is_loaded(self) -> bool:
        """Whether the load decides."""
        return self.contact == "loaded"


def assumptions(m: Mechanism, found: tuple[str, ...]) -> list[Assumed]:
    """The parts of a mechanism under each of the assumptions, in the order of outputs and load cases."""
    every = []
    for contact in found:
        whole = m if contact == "loaded" else m.without_load_cases()
        # Of several load cases one may have no load.
        parts = [part for part in whole.every_part if contact != "loaded" or part.has_loads or found == ("loaded",)]
        every += [Assumed(contact, part.of[1], part) for part in parts]
    return every
