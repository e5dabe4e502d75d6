"""The search for rare specimens beside chains and loops whose shares outside the limits are known.

`python tests/verify_rare.py [COUNT] [FIRST]` searches in COUNT files (200) from seed FIRST (0) on and writes the table
of docs/checks.md where all of 200 or more were asked. It ends with 1 where more than 5 % of the intervals exclude the
share, or where any says that nothing is outside while 1 ppm or more is.
"""

import sys
from dataclasses import dataclass

import numpy as np

import jointplay as jp
from helpers.cores import on_all_cores
from helpers.oracles.rare import KINDS, PRESSED, Case, case, loop_case
from helpers.pages import put_table

#: loops with play besides, the specimens by which their shares are known, and chains under a load
LOOPS, SAMPLES, LOADED = 20, 5_000_000, 10
LOOP = "loop"
#: a share of the specimens that must not be overlooked
SEEN = 1e-6
#: part of the intervals that may exclude the share
EXCLUDE = 0.05
#: files from which on a table is one to publish
WHOLE = 200
#: how files are named in the table
WORDS = {
    "plain": "sliders along x and y",
    "disc": "with clearance in a pin",
    "askew": "with a slider that runs askew",
    "tied": "with correlated drives",
    "arm": "with an arm, not linear",
    PRESSED: "with a pin that a load presses to one side",
    LOOP: "loops with play, counted by NumPy",
}


@dataclass(frozen=True)
class Found:
    """What was found in a file beside the share that is outside, of all quantities and of each."""

    seed: int
    known: Case
    method: str
    shares: np.ndarray
    outside: np.ndarray
    low: np.ndarray
    high: np.ndarray
    #: ends of the interval of counting alone
    counted: tuple[float, float]

    @property
    def holds(self) -> np.ndarray:
        """Whether intervals hold the share."""
        part = self.known.known
        return (self.low <= self.shares * (1.0 + part)) & (self.shares * (1.0 - part) <= self.high)

    @property
    def overlooks(self) -> bool:
        """Whether it says that nothing is outside, or too little to speak of, and something is."""
        return bool(self.shares[0] >= SEEN and self.high[0] < SEEN)

    @property
    def contradicts(self) -> bool:
        """Whether the interval has nothing in common with that of counting."""
        return bool(self.low[0] > self.counted[1] or self.high[0] < self.counted[0])


def find(known: Case, seed: int) -> Found:
    """Search in a file whose share is known."""
    m = jp.loads(known.text)
    counted = jp.random(m, seed=seed, probabilities=()).isel(configuration=0)
    rare = jp.random(m, seed=seed, probabilities=(), rare=True).isel(configuration=0)
    names = list(known.quantities)

    def of(end: str) -> np.ndarray:
        every = rare[f"outside_quantity{end}"].sel(quantity=names).values
        return np.append(float(rare[f"outside{end}"]), every)

    return Found(
        seed,
        known,
        str(rare.outside_method.item()),
        np.array([known.outside, *known.quantities.values()]),
        *map(of, ("", "_low", "_high")),
        (float(counted.outside_low), float(counted.outside_high)),
    )


def rows(found: list[Found]) -> list[list[object]]:
    """A row for each kind of file, and one for all."""
    table = []
    for kind in (*KINDS, PRESSED, LOOP, None):
        some = [one for one in found if kind in (one.known.kind, None)]
        inside = [one for one in some if one.shares[0] > 0.0 and one.outside[0] > 0.0]
        ratio = [abs(one.outside[0] / one.shares[0] - 1.0) for one in inside]
        width = [one.high[0] / one.low[0] for one in inside if one.low[0] > 0.0]
        every = np.concatenate([one.holds[1:] for one in some]) if some else np.zeros(0, bool)
        table.append(
            [
                "all" if kind is None else WORDS[kind],
                len(some),
                sum(not one.holds[0] for one in some),
                f"{np.count_nonzero(~every)} of {len(every)}",
                sum(one.overlooks for one in some),
                sum(one.contradicts for one in some),
                f"{100.0 * np.median(ratio):.1f} %" if ratio else "",
                f"{np.median(width):.2f}" if width else "",
            ]
        )
    return table


HEADER = (
    "files",
    "number",
    "intervals that exclude the share",
    "the same of single quantities",
    "1 ppm or more overlooked",
    "intervals apart from counting",
    "median deviation",
    "median of upper by lower end",
)


def found_at(place: tuple[int, str]) -> Found:
    """What is found in the file of a seed and a kind; kinds of chains take turns where it is left out."""
    seed, kind = place
    return find(loop_case(seed, SAMPLES) if kind == LOOP else case(seed, kind), seed)


def main(count: int = WHOLE, first: int = 0) -> int:
    found = []
    places = [(seed, "") for seed in range(first, first + count)]
    if count >= WHOLE:
        places += [(seed, PRESSED) for seed in range(LOADED)] + [(seed, LOOP) for seed in range(LOOPS)]
    for one in on_all_cores(found_at, places):
        found.append(one)
        if not one.holds.all() or one.overlooks or one.contradicts:
            pairs = zip(one.shares, one.outside, one.low, one.high, strict=True)
            told = "; ".join(f"{s:.4g}: {o:.4g} ({a:.4g} to {b:.4g})" for s, o, a, b in pairs)
            print(f"seed {one.seed}, {one.known.kind}, {one.method}: {told}", flush=True)
    table = rows(found)
    for row in (HEADER, *table):
        print(" | ".join(map(str, row)))
    if count >= WHOLE:
        put_table("rare", HEADER, table)
    exclude = sum(not one.holds[0] for one in found)
    return int(exclude > EXCLUDE * len(found) or any(one.overlooks or one.contradicts for one in found))


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
