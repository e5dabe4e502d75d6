"""W7: cone programs of over-constrained mechanisms, for many configurations, beside Clarabel and cvxpy."""

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness import Contender, Report, Target, interleave, ratio, rows
from jointplay import _core

Array = NDArray[np.float64]
PROGRAMS = 4096
ALONE = 64
MODELLED = 4
PINS = 20
RADIUS = 5e-5
#: a truss over-constrained three times with nine elastic bars, and mechanisms over-constrained many times
SUBJECTS = {"truss": (3, 9), "6": (6, 0), "12": (12, 0), "30": (30, 0)}


class Programs:
    """Programs of 20 pins, and bars, whose numbers are near each other as those of a mechanism's configurations."""

    def __init__(self, equations: int, bars: int) -> None:
        rng = np.random.default_rng(equations)
        width = 2 * PINS + bars
        shape = (PROGRAMS, equations, width)
        self.maps = rng.uniform(-1, 1, shape[1:]) + rng.uniform(-0.2, 0.2, shape)
        self.forces = rng.uniform(-100, 100, width) + rng.uniform(-20, 20, (PROGRAMS, width))
        self.rights = rng.uniform(-1e-5, 1e-5, (PROGRAMS, equations))
        self.bars = bars
        disc, spring = {"clearance": {"disc": {"radius": RADIUS}}}, {"spring": [1e-8]}
        self.blocks = json.dumps([disc] * PINS + [spring] * bars)

    def solve(self, n: int, alone: bool) -> dict[str, Any]:
        """The first programs: eight at a time, or each by itself."""
        return _core.cone_programs("pose", self.blocks, self.maps[:n], self.forces[:n], self.rights[:n], alone)

    def model(self, n: int) -> Array:
        """The first programs with cvxpy, as one writes them: in millimetres, parameters set for each program."""
        import cvxpy as cp

        mm = 1e3
        equations, width = self.maps.shape[1:]
        x = cp.Variable(width)
        a, w, b = cp.Parameter((equations, width)), cp.Parameter(width), cp.Parameter(equations)
        energy = 0.5 * 1e8 / mm**2 * cp.sum_squares(x[2 * PINS :]) if self.bars else 0.0
        pins = [cp.norm(x[2 * k : 2 * k + 2]) <= mm * RADIUS for k in range(PINS)]
        problem = cp.Problem(cp.Minimize(energy - w @ x / mm), [a @ x == b, *pins])
        values = np.empty(n)
        for k in range(n):
            a.value, w.value, b.value = self.maps[k], self.forces[k], mm * self.rights[k]
            values[k] = problem.solve(solver=cp.CLARABEL)
        return values


def measure(rounds: int) -> Report:
    """Measure all subjects."""
    table, targets, alone = [], [], 0
    for name, numbers in SUBJECTS.items():
        p = Programs(*numbers)
        many, each, modelled = p.solve(PROGRAMS, False), p.solve(ALONE, True), p.model(MODELLED)
        alone += int(many["alone"])

        def apart(other: Array, reference: Array = many["value"]) -> str:
            return f"value: {np.max(np.abs(other / reference[: len(other)] - 1)):.0e}"

        contenders = [
            Contender(f"jointplay, {name}", lambda p=p: p.solve(PROGRAMS, False), PROGRAMS, "reference", ours=True),
            Contender(f"Clarabel (Rust), {name}", lambda p=p: p.solve(ALONE, True), ALONE, apart(each["value"])),
            Contender(f"cvxpy with Clarabel, {name}", lambda p=p: p.model(MODELLED), MODELLED, apart(modelled)),
        ]
        seconds = interleave(contenders, rounds)
        table += rows(contenders, seconds, contenders[0].name)
        for other, asked in ((contenders[1], 50), (contenders[2], 1000)):
            measured = ratio(seconds, other.name, contenders[0].name).median
            targets.append(Target(f"W7: {other.name}, against jointplay", asked, at_most=False, measured=measured))
    return Report(
        "W7",
        "Cone programs of over-constrained mechanisms",
        ["program, equations", "ns per program", "at AVX2", "times jointplay's", "agreement"],
        table,
        targets,
        [f"Of {PROGRAMS * len(SUBJECTS):,} programs {alone:,} were solved one at a time."],
    )
