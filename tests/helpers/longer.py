"""Tests that are repeated over seeds, mechanisms or sizes: some in every run, the others in `make verify`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import pytest


def in_turn(kinds: Iterable[Any], others: Sequence[Any]) -> list[tuple[Any, Any]]:
    """All pairs; first each kind once, with the others in turn."""
    pairs = [(place, kind, k) for place, kind in enumerate(kinds) for k in range(len(others))]
    pairs.sort(key=lambda pair: (pair[2] - pair[0]) % len(others))
    return [(kind, others[k]) for _, kind, k in pairs]


def some(values: Sequence[Any], few: int) -> list[Any]:
    """Parameters of a test.

    Parameters
    ----------
    values : sequence
        Those of the whole test; tuples for several parameters.
    few : int
        How many of the first ones every run has. The others are marked `long`, which `tests/verify_long.py` runs.
    """
    rest = (pytest.param(*(one if isinstance(one, tuple) else (one,)), marks=pytest.mark.long) for one in values[few:])
    return [*values[:few], *rest]
