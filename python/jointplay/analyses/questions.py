"""The questions that sweeps, comparisons and maps ask again and again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointplay.errors import InputError, not_known
from jointplay.model import Mechanism
from jointplay.result import Result
from jointplay.typed import options

from . import compensate, given, loaded, random, solve, worst
from .nominal import Nominal


def corrected(
    m: Mechanism,
    *,
    corrects: str | None = None,
    weights: tuple[float, float] | None = None,
    target: Sequence[float] | NDArray[np.float64] | None = None,
) -> Result:
    """`compensate` as others ask it: of the error under the load where there is one."""
    return _corrected(m, corrects=corrects, weights=weights, target=target)


def _corrected(m: Mechanism, *, corrects: str | None = None, at: Nominal | None = None, **options: Any) -> Result:
    known = "loaded" if m.has_loads and options.get("target") is None else "given"
    return compensate.compute(m, corrects or known, at=at, **options)


COMPUTE: dict[str, Callable[..., Result]] = {
    "loaded": loaded.compute,
    "worst": worst.compute,
    "random": random.compute,
    "given": given.compute,
    "solve": solve.compute,
    "compensate": _corrected,
}
PUBLIC: dict[str, Callable[..., Any]] = {
    "loaded": loaded.loaded,
    "worst": worst.worst,
    "random": random.random,
    "given": given.given,
    "solve": solve.solve,
    "compensate": corrected,
}


def computation(question: str, known: tuple[str, ...]) -> Callable[..., Result]:
    """The light form of a question, or a refusal that names the known ones."""
    if question not in known:
        raise InputError(not_known(str(question), "a question that can be asked here", known), key="question")
    return COMPUTE[question]


def check_options(question: str, given: Mapping[str, Any], asked_by: str) -> None:
    """Check the options of a question as the question does.

    Raises
    ------
    TypeError
        When it has no such option, or the value is of the wrong type.
    """
    options(PUBLIC[question], given, asked_by)
