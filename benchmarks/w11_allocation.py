"""W11: least-cost sizes: twelve sources of five grades each over eleven configurations, at three limits."""

import time

import numpy as np

import jointplay as jp
from harness import Report, Spread, Target
from jointplay.model.sizing import sizings

GRADES = np.geomspace(0.005, 0.1, 5)
#: where the limit lies between the errors of the finest grades and of the coarsest ones
SHARES = (0.15, 0.3, 0.5)


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


def measure(rounds: int) -> Report:
    """Allocate at every limit in turn, round after round."""
    m = mechanism()
    sources = sizings(m)[1]
    low, high = (
        float(jp.worst(m.with_({k: v for s in sources for k, v in s.resized(size).items()})).worst_position.max())
        for size in GRADES[[0, -1]].tolist()
    )
    jp.allocate(m.with_({"limits.position": high}))
    limited = [m.with_({"limits.position": low + s * (high - low), "limits.rotation": 5.0}) for s in SHARES]
    seconds: list[list[float]] = [[] for _ in SHARES]
    for _ in range(rounds):
        for one, spent in zip(limited, seconds, strict=True):
            began = time.process_time()
            jp.allocate(one)
            spent.append(time.process_time() - began)
    rows = []
    for share, one, spent in zip(SHARES, limited, seconds, strict=True):
        found = jp.allocate(one)
        cost, bound = float(found.total_cost), float(found.first_order_bound)
        rows.append([f"{100 * share:.0f} %", Spread.of(spent).text(), f"{cost:.2f}", f"{bound:.2f}"])
    longest = max(Spread.of(spent).median for spent in seconds)
    target = Target(f"W11: {len(sources)} sources, seconds", 10, True, longest)
    header = ["limit between finest and coarsest", "s", "cost", "first-order bound"]
    return Report("W11", "Least-cost sizes", header, rows, [target])
