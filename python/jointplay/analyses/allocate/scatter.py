"""A required yield as a question of allocation.

At a plan specimens are drawn, closed exactly, and each gets the largest share of a limit that its error uses:

    used    the share that as many specimens exceed as may, for the required yield to hold

No law is assumed. The same random numbers are drawn for all plans, so that plans differ by their sizes alone. Where
offsets may scatter or be decided by the load, the yield has to hold both ways.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointplay.analyses.contacts import Assumed, assumptions
from jointplay.analyses.nominal import Nominal
from jointplay.analyses.several import places_of
from jointplay.basics.arrays import Flags, Floats
from jointplay.model.mechanism import Mechanism
from jointplay.result import split

from .items import Item
from .looks import Limit, Look, merged
from .required import Required


@dataclass(frozen=True)
class YieldLook(Look):
    """A look at a plan by its specimens, or by some of them so far."""

    #: the share of a limit, of whichever it is, that as many specimens exceed as may: shape (assumption,
    #: configuration); nan where nobody has looked
    quantile: Floats
    #: `used` under every assumption, zero where nobody has looked, shape (assumption, limit, configuration)
    by: Floats
    #: share of the specimens that cannot be assembled, shape (assumption, configuration)
    not_assembled: Floats

    @property
    def is_whole(self) -> bool:
        """Whether all specimens were looked at."""
        return not np.isnan(self.quantile).any()


class Scatter:
    """Looks at plans by the scatter of the error.

    Parameters
    ----------
    m : Mechanism
        With its patterns written out.
    items : sequence of Item
    limits : sequence of Limit
    samples, seed : int
    probability : float
        The required yield, in every configuration.
    contacts : tuple of str
        Where the clearances are.
    """

    def __init__(
        self,
        m: Mechanism,
        items: Sequence[Item],
        limits: Sequence[Limit],
        samples: int,
        seed: int,
        probability: float,
        contacts: tuple[str, ...],
    ) -> None:
        self.m, self.items, self.limits, self.contacts = m, items, limits, contacts
        self.required, self.seed = Required(samples, probability), seed
        self.labels = self.required.labels()
        self.assumed = assumptions(m, contacts)
        self.places = places_of([one.part for one in self.assumed])

    def look(self, values: Sequence[float], known: YieldLook | None = None, far: Flags | None = None) -> YieldLook:
        """What a plan brings.

        Parameters
        ----------
        known : YieldLook, optional
            What was found of the plan before.
        far : ndarray of bool, optional
            Assumptions and configurations that are left out, because they use little of the limits.
        """
        assumed = self.changed(values)
        shape = len(assumed), len(self.places[0])
        by, status = np.zeros((shape[0], len(self.limits), shape[1])), np.zeros(shape[1], np.uint8)
        quantile, lost = np.full(shape, np.nan), np.zeros(shape)
        # Where the machine cannot stand nothing is used of any limit.
        quantile[:, ~np.all([place.counts for place in self.places], axis=0)] = 0.0
        if known is not None:
            by[:], status[:], quantile[:], lost[:] = known.by, known.status, known.quantile, known.not_assembled
        for a, c in np.argwhere(np.isnan(quantile) if far is None else np.isnan(quantile) & ~far).tolist():
            one, rows = assumed[a], self.rows_of(assumed[a])
            errors, outcome = self.drawn(one, self.places[a], c)[1:]
            status[c] = max(status[c], outcome)
            shares = np.stack([share(one.part, errors, self.limits[row]) for row in rows])
            # A specimen that cannot be assembled keeps to no limit, and is lost once, whichever limits it misses.
            failed = ~np.isfinite(shares).all(axis=0)
            shares[:, failed] = np.inf
            lost[a, c] = failed.mean()
            quantile[a, c] = self.required.last(shares.max(axis=0), self.labels)
            own = np.array([self.required.last(row, self.labels) for row in shares])
            # What is used is known of all limits together, and shared out by what each of them uses alone.
            most = own.max()
            by[a, rows, c] = quantile[a, c] * (own / most if 0.0 < most < np.inf else np.ones_like(own))
        return YieldLook(by.max(axis=0), status, quantile, by, lost)

    def with_samples(self, samples: int) -> Scatter:
        """The same with another number of specimens."""
        required = self.required
        return Scatter(self.m, self.items, self.limits, samples, self.seed, required.probability, self.contacts)

    def changed(self, values: Sequence[float]) -> list[Assumed]:
        """The mechanism with a plan, under each of the assumptions."""
        return assumptions(self.m.with_(merged(self.items, values)), self.contacts)

    def rows_of(self, one: Assumed) -> list[int]:
        """The limits of the output of a part."""
        output = one.part.of[0] if self.m.outputs else None
        return [k for k, limit in enumerate(self.limits) if limit.output == output]

    def drawn(self, one: Assumed, at: Nominal, c: int) -> tuple[Floats, Floats, int]:
        """Parameters and errors of the specimens at a configuration, and its status."""
        here = at.drives[c : c + 1], at.poses[c : c + 1]
        found = one.part.running_under(c, *here).core.random(
            *here,
            self.required.samples,
            self.seed,
            np.array([0.5]),
            keep=True,
            loaded=one.is_loaded,
            sampling="sobol",
        )
        status = int(at.worse(found["status"], slice(c, c + 1))[0])
        return found["kept_parameters"], found["kept_errors"], status


def share(m: Mechanism, errors: Floats, limit: Limit) -> Floats:
    """How much of a limit every error uses; the last axis is the component."""
    n = len(split(list(m.components))[0])
    if limit.quantity in ("position", "rotation"):
        part = errors[..., :n] if limit.quantity == "position" else errors[..., n:]
        return np.asarray(np.linalg.norm(part, axis=-1) / limit.value)
    sign = -1.0 if limit.side == "low" else 1.0
    return np.asarray(sign * errors[..., m.components.index(limit.quantity)] / limit.value)
