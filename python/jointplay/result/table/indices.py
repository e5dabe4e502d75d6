"""Sobol' indices in the table of `random`: the largest of them, and where the first order is not enough."""

from collections.abc import Iterable

import numpy as np

from jointplay.errors import listed
from jointplay.result import Result, in_words

from .layout import NOTHING

#: indices and shares that differ by no more standard errors than this, and this, are alike
ERRORS, ALIKE = 3.0, 0.01


def largest(result: Result, quantity: str) -> list[str]:
    """At every configuration the sources with the largest total index, those that their standard errors do not part."""
    sources = result.labels("source")
    totals = result.get("sobol_total", quantity=quantity)
    errors = result.get("sobol_total_standard_error", quantity=quantity)
    cells = []
    for total, error in zip(totals, errors, strict=True):
        if not len(total) or not np.isfinite(total).any():
            cells.append(NOTHING)
            continue
        top = int(np.nanargmax(total))
        apart = ERRORS * np.nan_to_num(np.hypot(error, error[top]))
        alike = [name for name, is_so in zip(sources, total >= total[top] - apart, strict=True) if is_so]
        cells.append(in_words(alike, float(total[top])))
    return cells


def notes(result: Result) -> Iterable[str]:
    """Where a total index is larger than the first-order share, what was left out, and what is one group."""
    groups = [str(group) for group in result.coords["sobol_group"].values.tolist()]
    for group in dict.fromkeys(g for g in groups if groups.count(g) > 1):
        yield f"{group}: correlated, and one group in the Sobol' indices."
    left_out = float(np.nanmax(result.get("sobol_left_out"), initial=0.0))
    if left_out > 0.0:
        yield f"Up to {100 * left_out:.2g} % of the points are left out of the Sobol' indices: a specimen has no pose."
    found = [line for component in result.labels("component") for line in _beyond(result, component, groups)]
    if not found and np.isfinite(result.get("sobol_total")).any():
        yield (
            "Sobol' indices: no total index of a component is larger than the first-order share of its source; the"
            " first order is enough."
        )
    yield from found


def _beyond(result: Result, component: str, groups: list[str]) -> Iterable[str]:
    """The sources of which the first order says too little."""
    variance = np.square(result.get("error_std_first_order", component=component))
    own = result.get("contribution", component=component)
    together = np.array([[one == other for other in groups] for one in groups], dtype=float).reshape(len(groups), -1)
    known = variance > 0.0
    share = np.divide(own @ together, variance[:, None], out=np.full(own.shape, np.nan), where=known[:, None])
    total = result.get("sobol_total", quantity=component)
    error = np.nan_to_num(result.get("sobol_total_standard_error", quantity=component))
    excess = np.nan_to_num(total - share - ERRORS * error, nan=-np.inf)
    beyond = excess > ALIKE
    if not beyond.any():
        return
    k, s = np.unravel_index(int(np.argmax(excess)), excess.shape)
    sources = result.labels("source")
    names = [name for name, is_so in zip(sources, beyond.any(axis=0).tolist(), strict=True) if is_so]
    yield (
        f"The first order is not enough for {component} and {listed(names)}: the total index of {sources[s]} is"
        f" {100 * total[k, s]:.3g} % at configuration {k}, its first-order share {100 * share[k, s]:.3g} %."
    )
