"""On which side every clearance is in contact, and between which nodes of a map that changes.

Every clearance has one or more places of contact. A round one (the pin in its hole, each end of a long pin, an axial
shoulder, a slot) changes sides where the direction of its offset turns by 90 degrees or more from one node to the
next, as it does where the reaction passes through zero. One with flat faces (a slider in its guide) changes where it
goes to another corner of its set. An offset that the load leaves open is a state of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointplay.basics.arrays import Floats
from jointplay.core.compile import LOOSE
from jointplay.core.sets import SETS, Condition
from jointplay.model.gaps import clearance_of
from jointplay.model.mechanism import Mechanism

#: a share of the clearance: below it a round contact has no direction
CENTRAL = 1e-6
#: a share of the clearance: corners of a flat set are farther apart
CORNER = 0.25


@dataclass(frozen=True)
class ContactPlace:
    """A place of contact: it is where ``map @ offset`` is, as a share of the clearance."""

    columns: NDArray[np.int64]
    centre: Floats
    map: Floats
    round: bool


class Contacts:
    """The places of contact of a mechanism."""

    def __init__(self, m: Mechanism) -> None:
        places: list[ContactPlace] = []
        for number, source in enumerate(m.compiled_sources):
            if source.kind not in LOOSE:
                continue
            columns = np.flatnonzero(m.parameter_source == number)
            shape, size = clearance_of(m, number)
            # The slack of a belt may differ from side to side.
            middle = 0.5 * sum(source.limits or ())
            for is_round, rows in _places(SETS[shape].conditions(size)):
                # A set of size zero leaves nothing to turn.
                matrix = np.nan_to_num(rows, nan=0.0, posinf=0.0, neginf=0.0)
                places.append(ContactPlace(columns, np.array(source.centre) + middle, matrix, is_round))
        places.sort(key=lambda place: place.round)
        sizes = [len(place.map) for place in places]
        first = np.cumsum([0, *sizes])
        #: shares of the clearances at all places from offsets in file units: matrix and what it gives in the centre
        self._map = np.zeros((len(m.parameters), first[-1]))
        self._centre = np.zeros(first[-1])
        #: sums over the components of every round place
        self._sums = np.zeros((first[-1], len(places)))
        for k, place in enumerate(places):
            components = slice(first[k], first[k + 1])
            self._map[place.columns, components] = place.map.T * m.parameter_factors[place.columns, None]
            self._centre[components] = place.map @ place.centre
            self._sums[components, k] = 1.0
        flat = sum(not place.round for place in places)
        self._flat, self._sums = first[flat], self._sums[:, flat:]

    def states(self, offsets: Floats) -> Floats:
        """Where the contacts are, as shares of the clearances; nan at nodes that have no offset.

        Parameters
        ----------
        offsets : ndarray
            In file units, shape (..., parameter).
        """
        return np.asarray(offsets @ self._map - self._centre)

    def change(self, before: Floats, after: Floats) -> NDArray[np.bool_]:
        """Whether some contact changes from a node to its neighbour; a node without an offset has no contact.

        Parameters
        ----------
        before, after : ndarray
            States, shape (..., component of a contact).
        """
        # Comparisons with nan are false.
        changed = (np.abs(before - after)[..., : self._flat] > CORNER).any(axis=-1)
        turned = (before * after) @ self._sums <= 0.0
        there, then = ((state * state) @ self._sums > CENTRAL**2 for state in (before, after))
        changed |= np.where(there & then, turned, there != then).any(axis=-1)
        known = np.isfinite(before).all(axis=-1) & np.isfinite(after).all(axis=-1)
        return np.asarray(changed & known)


def _places(conditions: Sequence[Condition]) -> list[tuple[bool, Floats]]:
    """Of each place of contact of a set whether it is round, and the matrix to shares of the clearance."""
    with np.errstate(divide="ignore", invalid="ignore"):
        found = [
            (True, one.rows / np.float64(one.high if len(one.rows) > 1 else 0.5 * (one.high - one.low)))
            for one in conditions
            if not one.is_flat
        ]
        if flat := [one for one in conditions if one.is_flat]:
            # Where several pairs of faces bound a component, that which bounds it most.
            rows = np.diag(np.max([np.abs(one.rows[0]) for one in flat], axis=0))
            found.append((False, rows / np.float64(flat[0].high)))
    return found
