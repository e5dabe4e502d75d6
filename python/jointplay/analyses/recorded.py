"""Every result says what it is of: the outermost question that was asked puts it there."""

import functools
import inspect
from collections.abc import Callable
from dataclasses import replace
from typing import ParamSpec

from jointplay.basics.progress import watched
from jointplay.result import Origin, Result

from .nominal import Interrupted

P = ParamSpec("P")
#: arguments on which no number depends, or that are the mechanisms themselves
NO_OPTIONS = frozenset(
    ("m", "a", "b", "others", "at", "offset", "options", "plays", "progress", "scheduler", "threads")
)


def recorded(compute: Callable[P, Result]) -> Callable[P, Result]:
    """Let the results of a question carry the mechanism and the options that they are of."""
    signature = inspect.signature(compute)
    compute = watched(compute)

    @functools.wraps(compute)
    def asked(*args: P.args, **kwargs: P.kwargs) -> Result:
        bound = signature.bind(*args, **kwargs)
        bound.apply_defaults()
        options = {**bound.arguments, **bound.arguments.get("options", {})}
        options = {name: value for name, value in options.items() if name not in NO_OPTIONS}
        mechanisms = tuple(bound.arguments[name] for name in ("m", "a", "b") if name in bound.arguments)
        mechanisms += tuple(bound.arguments.get("others", ()))

        def of(result: Result) -> Result:
            # What was asked for it knows the options that were left out here.
            inner = result.origin.options if result.origin is not None else {}
            return replace(result, origin=Origin(mechanisms, {**inner, **options}))

        try:
            return of(compute(*args, **kwargs))
        except Interrupted as stopped:
            raise Interrupted(of(stopped.partial)) from None

    return asked
