"""Least-cost sizes: twelve sources of five grades each over eleven configurations, at three limits.

Run with jointplay installed: ``python benchmarks/allocation.py``. It prints processor time, cost and first-order bound.
"""

from __future__ import annotations

import time

import numpy as np

import jointplay as jp
from jointplay.sizing import sizings

GRADES = np.geomspace(0.005, 0.1, 5)


def mechanism() -> jp.Mechanism:
    """The bundled six-bar with two more lengths that have tolerances, and prices that are drawn."""
    m = jp.loads(jp.examples.text("six-bar")).with_(
        {
            "drives.theta.count": 11,
            "limits": None,
            "dimensions.crank": {"body": "crank", "between": ["A", "B"], "tolerance": 0.05},
            "dimensions.rocker": {"body": "rocker", "between": ["D", "C"], "tolerance": 0.05},
        }
    )
    rng = np.random.default_rng(0)

    def prices() -> list[dict[str, float]]:
        drawn = np.sort(rng.uniform(1.0, 20.0, len(GRADES)))[::-1]
        return [{"size": float(size), "cost": float(cost)} for size, cost in zip(GRADES, drawn, strict=True)]

    return m.with_({"costs": {source.name: {"choices": prices()} for source in sizings(m)[1]}})


def main() -> None:
    """Measure."""
    m = mechanism()
    sources = sizings(m)[1]
    low, high = (
        float(jp.worst(m.with_({k: v for s in sources for k, v in s.resized(size).items()})).worst_position.max())
        for size in GRADES[[0, -1]].tolist()
    )
    jp.allocate(m.with_({"limits.position": high}))
    for share in (0.15, 0.3, 0.5):
        limited = m.with_({"limits.position": low + share * (high - low), "limits.rotation": 5.0})
        began = time.process_time()
        found = jp.allocate(limited)
        spent = time.process_time() - began
        cost, bound = float(found.total_cost), float(found.first_order_bound)
        print(f"{len(sources)} sources, limit {share:g}: {spent:.2f} s, cost {cost:.2f}, first order {bound:.2f}")


if __name__ == "__main__":
    main()
