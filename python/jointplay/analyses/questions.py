"""The questions that sweeps, comparisons and maps ask again and again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from jointplay.errors import InputError, not_known
from jointplay.result import Result
from jointplay.typed import options

from . import given, loaded, random, solve, worst

COMPUTE: dict[str, Callable[..., Result]] = {
    "loaded": loaded.compute,
    "worst": worst.compute,
    "random": random.compute,
    "given": given.compute,
    "solve": solve.compute,
}
PUBLIC: dict[str, Callable[..., Any]] = {
    "loaded": loaded.loaded,
    "worst": worst.worst,
    "random": random.random,
    "given": given.given,
    "solve": solve.solve,
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
