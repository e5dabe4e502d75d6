"""`loaded` of random mechanisms beside an independent maximisation of the load's work.

`python tests/verify_loaded.py [COUNT] [FIRST]` compares COUNT mechanisms (3,000) from seed FIRST (0) on: three quarters
of them linkages in the plane with pins, guides and slots, the others trains with gears, loops in space with journals
and guides, and platforms with plates and balls. It prints a table of the linkages by the size of the clearances, writes
one of all kinds into docs/checks.md, and ends with 1 where any differs, or where more than a few stay at a place that
is not the one with the most work.
"""

import json
import math
import sys
from dataclasses import dataclass

import numpy as np

import jointplay as jp
from helpers import pages, trains
from helpers.cores import on_all_cores
from helpers.graphs import graph
from helpers.oracles import loops
from helpers.oracles.more_work import Press
from helpers.oracles.most_work import MostWork
from helpers.oracles.reading import read
from jointplay import _core

#: what is unfelt to first order is left in the middle of its play: it differs from the whole by the play, as a part of
#: the mechanism, times some lever ratios
SECOND_ORDER = 5.0
#: what IPOPT and its two levels of the work know of an extent, as a part of what all play does
KNOWN = 5e-3
#: the same of the largest work and of a decided pose
FOUND = 1e-5
OK = _core.STATUSES.index("ok")
#: what has a pose
POSED = ("ok", "undetermined")
#: verdicts where nothing differs; where the play reaches a singular pose nothing is compared
NO_DIFFERENCE = ("agrees", "not found", "singular")
#: `loaded` finds an equilibrium, which is not always the one with the most work: as a part of all mechanisms
ELSEWHERE, RARE = "more work elsewhere", 0.002
#: kinds of mechanisms beside linkages in the plane, and which part of all they are
BESIDE = {"trains with gears": "train", "loops in space": "loop", "platforms": "platform"}
PART = 12
#: starts of the search for more work
STARTS = 12


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
    #: places that `loaded` has seen
    equilibria: int

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
        if self.status not in POSED:
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
    status = str(result.status.item())
    best = next(iter(search.maxima(starts)), None) if status in POSED else None
    values = dict(zip(result.parameter.values.tolist(), result.offset.values.tolist(), strict=True))
    offsets = {label: values[label] * link.scale(label) for label in link.labels}
    return Comparison(
        play=play,
        status=status,
        undecided=not bool(result.decided.all()),
        told=result.undetermined.values * unit * part,
        found=search.half_widths(best) * part if best else np.full(3, np.nan),
        apart=float(np.abs((result.error.values * unit - best.error) * part).max()) if best else np.nan,
        lack=(best.work - search.work(offsets)) / search.unit if best else np.nan,
        equilibria=int(result.equilibria),
    )


def beside(kind: str, seed: int) -> tuple[float, int] | None:
    """What `loaded` lacks of the most work, as a part of what the load does within the play, and how many places it has
    seen: of a train, a loop in space or a platform under one force on its output. What nothing pushes where the load
    holds it stays in the middle. Nothing where there is no play or no pose."""
    rng = np.random.default_rng([34, seed])
    if kind == "train":
        machine, start = trains.drawn(10_000 + seed, parts=1 + seed % 2)
        spec, drives = machine.spec(), np.array([[start]])
        force = np.array([*rng.normal(0, 10, 2), rng.normal(0, 0.1)])
        push = {"force": [*force[:2], 0.0], "moment": [0.0, 0.0, force[2]]}
    else:
        make = loops.loop if kind == "loop" else loops.platform
        spec = make(20_000 + seed, float(10 ** rng.uniform(-5, -3)))
        drives = np.zeros((1, len(spec["drives"])))
        force = np.array([*(100 * rng.normal(size=3)), 0.0, 0.0, 0.0])
        push = {"force": force[:3].tolist(), "moment": [0.0] * 3}
    spec["loads"] = [{"point": spec["output"]["point"], **push}]
    core = _core.Mechanism(json.dumps(spec))
    solved = core.trace(drives)
    poses = np.asarray(solved["poses"])
    if solved["status"][0] != OK or not any(source["kind"] == "clearance" for source in spec["sources"]):
        return None
    found = core.loaded(drives, poses)
    if found["status"][0] != OK:
        return None
    press = Press(core, spec, drives, poses, force)
    most, unit = press.most(STARTS, seed, press.silent(np.asarray(found["offset"])[0]))
    done = float(np.asarray(found["error"])[0] @ force)
    return (most - done) / unit if unit > 0.0 else 0.0, int(found["equilibria"][0])


def of_seed(seed: int) -> Comparison:
    return compare(graph(seed))


def of_other(case: tuple[str, int]) -> tuple[float, int] | None:
    return beside(*case)


def main(count: int = 3000, first: int = 0) -> int:
    rows: dict[int, list[Comparison]] = {}
    others = count // PART
    count -= len(BESIDE) * others
    table = []
    for name, kind in BESIDE.items():
        found = list(on_all_cores(of_other, [(kind, seed) for seed in range(first, first + others)]))
        posed = [one for one in found if one is not None]
        more = [(seed, one) for seed, one in enumerate(found, first) if one is not None and one[0] > FOUND]
        if more:
            print(f"{name}: more work elsewhere in {more}", flush=True)
        table.append((name, others, len(posed), sum(one[1] > 1 for one in posed), len(more)))
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
    linkages = [c for group in rows.values() for c in group]
    verdicts = [c.verdict for c in linkages]
    posed = [c for c in linkages if c.status in POSED]
    several = sum(c.equilibria > 1 for c in posed)
    table.insert(0, ("linkages in the plane", count, len(posed), several, verdicts.count(ELSEWHERE)))
    table.append(("all", *(sum(row[k] for row in table) for k in range(1, 5))))
    header = ("mechanisms", "how many", "with a pose", "several places seen", ELSEWHERE)
    pages.put_table("equilibria", header, table)
    return int(not set(verdicts) <= set(told) or table[-1][4] > RARE * table[-1][1])


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
