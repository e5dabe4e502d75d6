"""How near a configuration is to a singularity, and in which way it gives.

With J = [A; D] the length-scaled closure Jacobian, rows of the joints above rows of the drives, N an orthonormal basis
of the motions that the joints allow (the null space of A), and E the twist of the output:

    constraint   smallest singular value of A      zero where the joints no longer constrain a motion
    actuation    smallest singular value of D N    zero where the joints allow a motion without the drives
    output       smallest singular value of E N    zero where the mechanism moves and the output does not
    closure      smallest singular value of J      zero where one of the first two is, and never larger than either

because |det J| = (product of the singular values of A) x |det D N|. In the words of Gosselin and Angeles (1990) the
output's singularities are those of the first kind and the drives' those of the second; constraint singularities are
those of Zlatanov, Bonev and Gosselin (2002).
"""

from collections.abc import Sequence

import numpy as np

from jointplay.basics.arrays import Floats
from jointplay.core.answers import Nearness
from jointplay.core.compile import LENGTHS
from jointplay.model.mechanism import Mechanism

KINDS = ("constraint", "actuation", "output")
#: entries of the Jacobians of a chunk, and its configurations, at most, so that progress shows and Ctrl-C loses little
ENTRIES, MOST = 1_300_000, 256


class Scaled:
    """Jacobians of a mechanism with lengths divided by a characteristic one.

    Parameters
    ----------
    m : Mechanism
    length : float
        Characteristic length, metres.
    """

    def __init__(self, m: Mechanism, length: float) -> None:
        self.m = m
        self.length = length
        lengths = np.isin(m.components, LENGTHS)
        #: SI per scaled unit of a twist's components
        self.units = np.where(lengths, length, 1.0)
        self.positions = np.flatnonzero(lengths)

    @property
    def chunk(self) -> int:
        """Configurations that are judged at once."""
        unknowns = len(self.units) * len(self.m.bodies)
        return int(np.clip(ENTRIES // max(1, unknowns) ** 2, 1, MOST))

    def sign(self, pose: Floats) -> float:
        """Sign of the determinant of the closure Jacobian at one pose of all bodies."""
        return float(self.closure(pose[None])[1][0])

    def closure(self, at: Floats) -> tuple[Floats, Floats]:
        """Smallest singular value of the closure Jacobian and sign of its determinant."""
        found = self.m.core.nearness(np.ascontiguousarray(at), self.length, [], details=False)
        return found["closure"], found["sign"]

    def measure(self, at: Floats, components: Sequence[int]) -> Nearness:
        """Judge assembled configurations.

        Parameters
        ----------
        at : ndarray
            Poses, shape (configuration, body, coordinate).
        components : sequence of int
            The components of the output's twist that count.
        """
        return self.m.core.nearness(np.ascontiguousarray(at), self.length, list(components))


def kind(values: Floats, limit: float) -> str:
    """The kinds of singularity that a configuration is at, else the one that it is nearest to.

    Examples
    --------
    >>> kind(np.array([1e-9, 0.2, 1e-12]), 1e-4)
    'constraint, output'
    >>> kind(np.array([0.3, 0.2, 0.5]), 1e-4)
    'actuation'
    """
    if not np.isfinite(values).any():
        return ""
    at = np.flatnonzero(values < limit)
    return ", ".join(KINDS[k] for k in (at if at.size else [int(np.nanargmin(values))]))
