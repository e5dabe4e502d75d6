"""The program behind `allocate`: published optima, optimality conditions, and brute force over all choices."""

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import nnls

from jointplay.analyses.allocate.program import Formula, Plan, Prices, Program

#: Shaft and housing: K. W. Chase, Tolerance allocation methods for designers, ADCATS report 99-6, Brigham Young
#: University, 1999: gap = -A + B - C + D - E + F - G within 0.015 inch, cost 1 + B / t^k of the shaft, two bearing
#: sleeves and the housing; ring A and bearings C, G are bought. The optimum is that of these numbers, by its
#: optimality conditions below. The tables of the report were not at hand: these numbers, and 0.00254, 0.001736,
#: 0.002498 for the worst case, are recalled.
B = (0.15997, 0.07202, 0.12576, 0.07202)
K = (0.43899, 0.46823, 0.46537, 0.46823)
#: share of a range, or of a limit, within which an end or a row counts as reached: the barrier leaves that much
NEAR = 1e-4
BOUGHT = (0.0015, 0.0025, 0.0025)


def reciprocal(b: float, k: float, low: float, high: float, power: int = 1, a: float = 1.0) -> Formula:
    """The cost a + b / t^k of a variable z = t^power."""
    q = k / power
    return Formula(
        low**power,
        high**power,
        lambda z: a + b * z**-q,
        lambda z: -b * q * z ** (-q - 1.0),
        lambda z: b * q * (q + 1.0) * z ** (-q - 2.0),
    )


def off(formulas: list[Formula], rows: np.ndarray, right: np.ndarray, plan: Plan) -> float:
    """How far the optimality conditions are from holding, relative to the slopes: active rows and ends push back."""
    z = np.array(plan.values)
    slopes = np.array([f.slope(v) for f, v in zip(formulas, plan.values, strict=True)])
    spans = np.array([f.high - f.low for f in formulas])
    ends = np.eye(len(z))
    active = [row for row, b in zip(rows, right, strict=True) if b - row @ z <= NEAR * max(1.0, abs(b))]
    active += [ends[k] for k, f in enumerate(formulas) if f.high - z[k] <= NEAR * spans[k]]
    active += [-ends[k] for k, f in enumerate(formulas) if z[k] - f.low <= NEAR * spans[k]]
    # In shares of the slopes, so that each of them counts alike.
    size = np.abs(slopes)
    pushes = np.array(active).T / size[:, None] if active else np.zeros((len(z), 1))
    return float(nnls(pushes, -slopes / size)[1])


@pytest.mark.parametrize(
    ("power", "sizes", "cost"),
    [(1, (0.0025369, 0.0017342, 0.0024946), 11.0778), (2, (0.0081139, 0.0063816, 0.0079338), 8.0536)],
)
def test_the_shaft_and_housing_of_chase_have_their_optimum(power, sizes, cost):
    """Worst case, and root sum of squares; the sizes are flat about the optimum, the cost is not."""
    room = 0.015**power - sum(t**power for t in BOUGHT)
    formulas = [reciprocal(b, k, 1e-4, 0.02, power) for b, k in zip(B, K, strict=True)]
    rows, right = np.ones((1, 4)) / room, np.ones(1)
    plan = Program(formulas).solve(rows, right)
    assert plan is not None
    found = [v ** (1.0 / power) for v in plan.values]
    # The published sizes have rounding of their own in the fourth digit; sleeves D and F are alike.
    assert found[0] == pytest.approx(sizes[0], rel=2e-4)
    assert found[1] == pytest.approx(sizes[1], rel=2e-4)
    assert found[3] == pytest.approx(found[1], rel=1e-9)
    assert found[2] == pytest.approx(sizes[2], rel=2e-4)
    assert plan.cost == pytest.approx(cost, abs=5e-5)
    assert plan.bound == pytest.approx(plan.cost, rel=1e-9)
    # Equal multipliers: slope / share of the row.
    multipliers = [f.slope(v) for f, v in zip(formulas, plan.values, strict=True)]
    assert multipliers == pytest.approx([multipliers[0]] * 4, rel=1e-6)


@pytest.mark.parametrize("seed", range(40))
def test_random_sizes_by_formula_fulfil_the_optimality_conditions(seed):
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, 10)), int(rng.integers(1, 30))
    power = int(rng.integers(1, 3))
    formulas = []
    for _ in range(n):
        low = 10.0 ** rng.uniform(-3.0, -1.0)
        formulas.append(
            reciprocal(
                10.0 ** rng.uniform(-2, 1), rng.uniform(0.3, 2.0), low, low * 10.0 ** rng.uniform(0.3, 2.0), power
            )
        )
    low, high = (np.array([getattr(f, end) for f in formulas]) for end in ("low", "high"))
    rows = rng.random((m, n)) * (rng.random((m, n)) < 0.8)
    right = rows @ low + rng.uniform(0.05, 0.9, m) * (rows @ (high - low))
    scale = np.where(right > 0.0, right, 1.0)
    rows, right = rows / scale[:, None], right / scale
    plan = Program(formulas).solve(rows, right)
    assert plan is not None
    z = np.array(plan.values)
    assert (rows @ z <= right + 1e-12).all()
    assert ((z >= low) & (z <= high)).all()
    # The dual bound is found apart from the primal optimum, by halving.
    assert plan.bound <= plan.cost <= plan.bound + 1e-7 * (1.0 + abs(plan.cost))
    assert off(formulas, rows, right, plan) < 1e-3


def test_tighter_ends_that_miss_a_row_have_no_plan():
    assert Program([reciprocal(1.0, 1.0, 0.2, 1.0)]).solve(np.ones((1, 1)), np.array([0.1])) is None


@pytest.mark.parametrize("seed", range(15))
def test_choices_and_formulas_together_are_as_cheap_as_all_choices_tried(seed, capfd):
    """HiGHS wrote lines of its own to the terminal where it rounded whole numbers; nothing is written now."""
    rng = np.random.default_rng(100 + seed)
    n_formulas, n_choices, m = int(rng.integers(0, 5)), int(rng.integers(1, 4)), int(rng.integers(1, 25))
    decisions: list[Formula | Prices] = []
    for _ in range(n_formulas):
        low = 10.0 ** rng.uniform(-3, -1)
        decisions.append(
            reciprocal(10.0 ** rng.uniform(-2, 1), rng.uniform(0.4, 2), low, low * 10.0 ** rng.uniform(0.5, 2.5))
        )
    sizes = []
    for _ in range(n_choices):
        sizes.append(np.sort(10.0 ** rng.uniform(-3, -0.5, 4)))
        decisions.append(Prices(tuple(np.sort(rng.uniform(0, 30, 4))[::-1])))
    weights = rng.random((m, n_formulas + n_choices))
    rows = np.hstack([weights[:, :n_formulas], *(weights[:, [n_formulas + k]] * s for k, s in enumerate(sizes))])
    small = weights @ np.array([*(d.low for d in decisions if isinstance(d, Formula)), *(s[0] for s in sizes)])
    big = weights @ np.array([*(d.high for d in decisions if isinstance(d, Formula)), *(s[-1] for s in sizes)])
    limit = small + rng.uniform(0.05, 0.6) * (big - small)
    rows, right = rows / limit[:, None], np.ones(m)
    program = Program(decisions)
    plan = program.solve(rows, right)
    assert plan is not None
    each = []
    for choice in itertools.product(range(4), repeat=n_choices):
        found = program._sizes({n_formulas + k: c for k, c in enumerate(choice)}, rows, right)
        taken = sum(rows[:, program.places[n_formulas + k].start + c] for k, c in enumerate(choice))
        if found is not None and (n_formulas or (taken <= right + 1e-9).all()):
            each.append(found.cost)
    # Tolerance of HiGHS on rows, 1e-6 over the damping.
    assert plan.cost == pytest.approx(min(each), rel=1e-4)
    assert math.isclose(plan.bound, plan.cost, rel_tol=1e-4)
    assert capfd.readouterr().out == ""
