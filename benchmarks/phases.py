"""Where the time of a Monte Carlo goes: drawing, solving, counting; from Criterion's medians (`make bench-core`)."""

import functools
import json
import time
from collections.abc import Callable
from pathlib import Path

import closed_form
import jointplay as jp
import profile_w3
import w1_fourbar
import w2_tenbar
from harness import Report, number
from scatter import problem
from tables import table

CRITERION = Path(__file__).parent.parent / "target" / "criterion" / "phases"
#: of one run of a phase in crates/jointplay-core/benches/phases.rs
RUN = 1 << 13
SAMPLES = 1 << 20


def _criterion(name: str) -> float:
    """Seconds per sample."""
    estimates = json.loads((CRITERION / name / "new" / "estimates.json").read_text(encoding="utf-8"))
    return float(estimates["median"]["point_estimate"]) * 1e-9 / RUN


def _fastest(run: Callable[[], object], rounds: int) -> float:
    """Seconds per sample."""
    taken = []
    for _ in range(rounds):
        begin = time.process_time()
        run()
        taken.append((time.process_time() - begin) / SAMPLES)
    return min(taken)


def measure(rounds: int) -> Report:
    """Put the phases of jointplay and of the limit side by side."""
    operations = json.loads((closed_form.BUILD / "operations.json").read_text(encoding="utf-8"))
    rows = []
    for name, file in (("W1", w1_fourbar.FILE), ("W2", w2_tenbar.FILE)):
        whole = _fastest(functools.partial(problem(jp.load(str(file))).random, SAMPLES), rounds)
        upto = [_criterion(f"{name} draw"), _criterion(f"{name} draw and solve"), whole]
        first, step, output = operations[name]
        rows.append([f"{name}, jointplay", *_steps(upto), f"{first} + {step} per further step + {output}"])
    limit = closed_form.InC(problem(jp.load(str(w1_fourbar.FILE))))
    upto = [_fastest(functools.partial(limit.monte_carlo, SAMPLES, k), rounds) for k in (1, 2, 3)]
    rows.insert(1, ["W1, C by hand", *_steps(upto), ""])
    header = ["ns per sample", "drawing", "solving", "counting", "recorded operations of the solution"]
    profile = profile_w3.shares()
    notes = ["W3, `loaded` at given poses, by `perf`:\n\n" + table(["part", "share"], profile)] if profile else []
    return Report("phases", "Where the time goes", header, rows, [], notes)


def _steps(upto: list[float]) -> list[str]:
    return [number(1e9 * max(b - a, 0.0)) for a, b in zip([0.0, *upto[:-1]], upto, strict=True)]
