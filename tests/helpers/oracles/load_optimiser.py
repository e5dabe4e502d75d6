"""Load-determined pose by non-linear optimisation: the load does as much work as the play lets it.

Formula (theory B.3, kept non-linear):

    max over poses q and play d of  sum_k (f_k . p_k(q) + m_k theta_k(q))
    subject to   closure(q, d) = 0,   d_j in C_j,

the stationarity of which in q is the equilibrium of every body, with the multipliers of the closure as the
wrenches in the joints, and in d the contact condition (play on the boundary of C_j, against the reaction).
Tolerances and drive errors stay at their centres: no load moves them.
"""

from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np

from .linkage import Linkage
from .optimiser import Optimiser, Optimum


@dataclass(frozen=True)
class LoadedPose:
    optimum: Optimum
    error: np.ndarray
    """Output pose minus the nominal one: x, y, angle."""
    work: float


def load_pose(link: Linkage, q0: np.ndarray, drives: Any) -> LoadedPose:
    """Poses and play of largest work of the loads; the search starts from the nominal poses q0."""
    play = [s for s in link.sources if s.gives_way]
    start = float(link.work(list(q0), link.centre))
    widest = max((s.play for s in play), default=1e-3 * link.length)
    force = max(max(abs(fx), abs(fy), abs(m) / link.length) for _, fx, fy, m in link.loads)
    search = Optimiser(link, q0, drives, play, lambda q, u: link.work(q, u, casadi) - start, force * widest)
    best = search.maximise()
    error = link.out(best.poses, best.offsets) - link.out(q0, dict.fromkeys(link.labels, 0.0))
    return LoadedPose(best, error, best.value)
