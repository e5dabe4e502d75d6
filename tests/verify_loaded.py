"""`loaded` of random mechanisms beside an independent maximisation of the load's work.

`python tests/verify_loaded.py [COUNT] [FIRST]` compares COUNT mechanisms (2,000) from seed FIRST (0) on and prints
a table by the size of the clearances. It ends with 1 where any differs, or where more than a few stay at a maximum
that is not the largest.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np

import jointplay as jp
from cores import on_all_cores
from graphs import graph
from oracles.most_work import MostWork
from oracles.reading import read

#: what is unfelt to first order is left in the middle of its play: it differs from the whole by the play, as a part of
#: the mechanism, times some lever ratios
SECOND_ORDER = 5.0
#: what IPOPT and its two levels of the work know of an extent, as a part of what all play does
KNOWN = 5e-3
#: the same of the largest work and of a decided pose
FOUND = 1e-5
#: verdicts where nothing differs; where the play reaches a singular pose nothing is compared
NO_DIFFERENCE = ("agrees", "not found", "singular")
#: `loaded` finds an equilibrium, which is not always the one with the most work: as a part of all mechanisms
ELSEWHERE, RARE = "more work elsewhere", 0.0025


@dataclass(frozen=True)
class Comparison:
    """What was compared; differences are parts of what all play can do to a component of the output."""

    play: float
    status: str
    undecided: bool
    #: half-widths told and found, by component
    told: np.ndarray
    found: np.ndarray
    #: of a decided pose, from the one found
    apart: float
    #: work that the load could still do, as a part of what it does within the play to first order
    lack: float

    @property
    def limit(self) -> float:
        return KNOWN + (SECOND_ORDER * self.play if self.status == "ok" else 0.0)

    @property
    def off(self) -> float:
        """The most by which a half-width differs, of those that were found."""
        return float(np.nanmax(np.abs(self.told - self.found), initial=0.0))

    @property
    def verdict(self) -> str:
        """What differs first; where the optimiser did not find every end, the others agree."""
        if self.status not in ("ok", "undetermined"):
            return self.status
        if math.isnan(self.lack):
            return "not found"
        slack = SECOND_ORDER * self.play if self.undecided and self.status == "ok" else 0.0
        if self.lack > FOUND + slack:
            return ELSEWHERE
        if self.off > self.limit:
            narrow = self.told.max() <= self.limit
            if narrow or np.nanmax(self.found) <= self.limit:
                return "open, not told" if narrow else "told, not open"
            return "other width"
        if self.status == "ok" and self.apart > 10 * FOUND / min(1.0, 1e-3 + self.play) ** 0.5 + slack:
            return "other pose"
        return "agrees" if np.isfinite(self.found).all() else "not found"


def compare(text: str, starts: int = 2) -> Comparison:
    link = read(text)
    drives = link.configurations[0]
    q = link.nominal(drives)
    search = MostWork(link, q, drives)
    result = jp.loaded(jp.loads(text)).isel(configuration=0)
    unit = np.array([1.0, 1.0, math.radians(1.0)])
    map_, _ = link.sensitivity(q, drives)
    rows = [[list(link.labels).index(label) for label in s.labels] for s in link.sources]
    support = [[float(s.support(map_[k][row])) for s, row in zip(link.sources, rows, strict=True)] for k in range(3)]
    reach = np.array(support).sum(axis=1)
    moves = reach > 1e-9 * np.array([link.length, link.length, 1.0])
    part = np.where(moves, 1.0 / np.where(moves, reach, 1.0), 0.0)
    play = float(search.play) / link.length
    best = next(iter(search.maxima(starts)), None)
    values = dict(zip(result.parameter.values.tolist(), result.offset.values.tolist(), strict=True))
    offsets = {label: values[label] * link.scale(label) for label in link.labels}
    return Comparison(
        play=play,
        status=str(result.status.item()),
        undecided=not bool(result.decided.all()),
        told=result.undetermined.values * unit * part,
        found=search.half_widths(best) * part if best else np.full(3, np.nan),
        apart=float(np.abs((result.error.values * unit - best.error) * part).max()) if best else np.nan,
        lack=(best.work - search.work(offsets)) / search.unit if best else np.nan,
    )


def of_seed(seed: int) -> Comparison:
    return compare(graph(seed))


def main(count: int = 2000, first: int = 0) -> int:
    rows: dict[int, list[Comparison]] = {}
    for seed, found in enumerate(on_all_cores(of_seed, range(first, first + count)), first):
        rows.setdefault(math.floor(math.log10(found.play)), []).append(found)
        if found.verdict not in NO_DIFFERENCE:
            print(f"seed {seed}: {found.verdict}, {found}", flush=True)
    told = (*NO_DIFFERENCE, ELSEWHERE)
    head = ("largest clearance / size", "mechanisms", "undetermined", *told, "half-width off by at most")
    print(f"| {' | '.join(head)} |\n{'|---' * len(head)}|")
    for decade, group in sorted(rows.items()):
        open_ = [c for c in group if c.status == "undetermined"]
        most = max((c.off for c in open_ if c.verdict in NO_DIFFERENCE), default=0.0)
        counts = [len(group), len(open_), *(sum(c.verdict == v for c in group) for v in told)]
        print(f"| 1e{decade} to 1e{decade + 1} | {' | '.join(map(str, counts))} | {100 * most:.2g} % |")
    verdicts = [c.verdict for group in rows.values() for c in group]
    return int(not set(verdicts) <= set(told) or verdicts.count(ELSEWHERE) > RARE * count)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
