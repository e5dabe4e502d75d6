"""The questions that sweeps, comparisons and maps ask again and again."""

from __future__ import annotations

from collections.abc import Callable

from jointplay.errors import InputError, not_known
from jointplay.result import Result

from . import given, loaded, random, solve, worst

COMPUTE: dict[str, Callable[..., Result]] = {
    "loaded": loaded.compute,
    "worst": worst.compute,
    "random": random.compute,
    "given": given.compute,
    "solve": solve.compute,
}


def computation(question: str, known: tuple[str, ...]) -> Callable[..., Result]:
    """The light form of a question, or a refusal that names the known ones."""
    if question not in known:
        raise InputError(not_known(str(question), "a question that can be asked here", known), key="question")
    return COMPUTE[question]
