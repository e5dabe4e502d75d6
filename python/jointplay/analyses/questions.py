"""The questions that others ask: what computes them, and which options they have."""

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from jointplay.basics.typed import options
from jointplay.questions import QUESTIONS, asked_by, named, require_known
from jointplay.result import Result


def computation(question: str, asker: str) -> Callable[..., Result]:
    """The light form of a question, or a refusal that names those that can be asked."""
    require_known(question, asked_by(asker))
    return named(__package__, f"{question}.{QUESTIONS[question].compute}")


def public(question: str) -> Callable[..., Any]:
    """The function whose arguments are the options of a question."""
    return named(__package__, f"{question}.{QUESTIONS[question].options or question}")


def options_of(question: str) -> tuple[str, ...]:
    """The options of a question."""
    return tuple(inspect.signature(public(question)).parameters)[1:]


def taken(question: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """The options that a question is asked with: those given, and by default those of its function."""
    known = inspect.signature(public(question)).parameters
    return {name: given.get(name, known[name].default) for name in options_of(question)}


def check(question: str, given: Mapping[str, Any], asker: str) -> None:
    """Check a question, and its options as it does.

    Raises
    ------
    InputError
        When it cannot be asked here.
    TypeError
        When it has no such option, or the value is of the wrong type.
    """
    require_known(question, asked_by(asker))
    options(public(question), given, asker)
