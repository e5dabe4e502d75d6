"""Whether a value that `worst` attains is ever above its bound, and how far the bounds are above the values.

    python tests/verify_certificate.py                        10,000 planar and 1,000 spatial mechanisms
    python tests/verify_certificate.py --planar 90 --spatial 0
    python tests/verify_certificate.py --examples             the table of bundled examples in docs/checks.md
    python tests/verify_certificate.py --map                  that of the 3-UPU over positions, by its clearances

Planar mechanisms are those of `wide`, with clearances of 0.1 to 10 % of their size, and of 0.1 to 1 % for every
other one. Spatial ones are the loops and platforms of `oracles.loops`, with clearances of 1 to 100 micrometres on some
300 mm.
"""

import argparse
import sys
import time
from collections import Counter
from functools import partial

import numpy as np

import jointplay as jp
from helpers.bounds import Bounded, bounded, of_spec
from helpers.cores import on_all_cores
from helpers.oracles import loops
from helpers.wide import KINDS, mechanism
from jointplay.analyses.certificate import REASONS
from jointplay.analyses.nominal import nominal

#: of the gaps of all bounds, these quantiles are told
LEVELS = (0.5, 0.9, 0.99)
#: of the joints of the 3-UPU, micrometres
CLEARANCES = (1, 2, 5, 10)


def planar(number: int, parts: int) -> Bounded:
    most = 0.01 if number % 2 else 0.1
    m = jp.loads(mechanism(KINDS[number % len(KINDS)], 1000 + number // len(KINDS), most=most))
    at = nominal(m)
    return bounded(m.core, at.drives, at.poses, parts)


def spatial(number: int, parts: int) -> Bounded:
    make = loops.platform if number % 4 == 0 else loops.loop
    return of_spec(make(number, 10.0 ** np.random.default_rng(number).uniform(-6, -4)), parts, 4)


def examples(parts: int) -> None:
    """Prints the gaps of every bundled determinate example, with the time of the bounds beside that of `worst`."""
    print(
        "| example | configurations | with bounds | position | rotation | components | parts | time / time of `worst` |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name in jp.examples.names():
        m = jp.loads(jp.examples.text(name))
        if not m.core.isostatic:
            continue
        at = nominal(m)
        begin = time.process_time()
        m.core.worst(at.drives, at.poses)
        middle = time.process_time()
        found = bounded(m.core, at.drives, at.poses, parts)
        worst, both = middle - begin, time.process_time() - middle
        cells = [name, str(len(at)), str(int(found.certified.sum()))]
        gaps = found.gaps[found.certified]
        largest = [gaps[:, part].max(initial=0.0) for part in (slice(0, 1), slice(1, 2), slice(2, None))]
        cells += [f"{100 * gap:.2g} %" if len(gaps) else "" for gap in largest]
        print("| " + " | ".join([*cells, str(found.parts), f"{(both - worst) / worst:.0f}"]) + " |", flush=True)
        for reason in sorted(set(found.reasons) - {0}):
            print(f"<!-- {name}: {REASONS[reason]} -->")


def robot(parts: int) -> None:
    """Prints the gaps of the 3-UPU over positions, by its clearances, and draws them to the folder it is run in."""
    print("| clearance, um | nodes | with bounds | position: median, largest | rotation: median, largest |")
    print("|---|---|---|---|---|")
    places = np.linspace(-100.0, 100.0, 5).tolist()
    grid = {"x": places, "y": places, "z": 400.0}
    for micrometres in CLEARANCES:
        size = 1e-3 * micrometres
        sizes = {"radial": size, "axial": 2.0 * size, "gap": size}
        m = jp.loads(jp.examples.text("3-upu")).with_({f"joints.*.clearance.{k}": v for k, v in sizes.items()})
        found = jp.map(m, "worst", grid, certify=True, parts=parts)
        certified = found.certified.values
        cells = [str(micrometres), str(certified.size), str(int(certified.sum()))]
        for which in ("position", "rotation"):
            gaps = found[f"worst_{which}_gap"].values[certified]
            cells.append(f"{100 * np.median(gaps):.2g} %, {100 * gaps.max():.2g} %" if len(gaps) else "")
        print("| " + " | ".join(cells) + " |", flush=True)
        jp.plot.map(found, variable="worst_position_gap").savefig(f"3-upu-{micrometres}-um.png")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--planar", type=int, default=10_000, metavar="MECHANISMS")
    parser.add_argument("--spatial", type=int, default=1_000, metavar="MECHANISMS")
    parser.add_argument("--parts", type=int, default=40, metavar="N")
    parser.add_argument("--examples", action="store_true")
    parser.add_argument("--map", action="store_true")
    options = parser.parse_args()
    if options.examples:
        examples(100)
        return 0
    if options.map:
        robot(options.parts)
        return 0
    excluded = 0
    for name, ask, count in (("planar", planar, options.planar), ("spatial", spatial, options.spatial)):
        gaps, reasons, begin = [], Counter[str](), time.perf_counter()
        for number, found in enumerate(on_all_cores(partial(ask, parts=options.parts), range(count))):
            reasons.update(REASONS[reason] for reason in found.reasons)
            gaps += found.gaps[found.certified].ravel().tolist()
            if found.excluded:
                excluded += 1
                print(f"{name} {number}: a value is above its bound: {found.attained} {found.bounds}")
        if not gaps:
            continue
        seconds = time.perf_counter() - begin
        quantiles = ", ".join(
            f"{100 * q:g} %: {value:.2g}" for q, value in zip(LEVELS, np.quantile(gaps, LEVELS), strict=True)
        )
        print(f"{name}: {count} mechanisms, {reasons['']} with bounds, {len(gaps)} of them, {seconds:.0f} s")
        print(f"  gaps below: {quantiles}; largest {max(gaps):.2g}")
        for reason, number in reasons.items():
            if reason:
                print(f"  {number}: {reason}")
    print(f"{excluded} mechanisms with a value above its bound")
    return 1 if excluded else 0


if __name__ == "__main__":
    sys.exit(main())
