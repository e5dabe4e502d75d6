"""Options that belong to questions: commands get them here, and refuse those of a question that is not asked."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

from jointplay.errors import InputError, listed
from jointplay.questions import asked_by

from . import answer
from .options import OF_QUESTIONS, Command, choice, exchanged, option_of
from .printing import printed

if TYPE_CHECKING:
    from jointplay.model.mechanism import Mechanism

#: options that are called or written otherwise than the arguments of the questions
WRITTEN: dict[str, tuple[str, Callable[[Mechanism, Any], Any]]] = {
    "offset": ("offsets", answer.offsets),
    "target": ("target", answer.target),
    "first_order": ("exact", lambda _, value: not value),
}


@dataclass(frozen=True)
class GivenOptions:
    """Options of questions that a command has, as they were typed or left out."""

    asker: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)

    def of(self, m: Mechanism, question: str = "") -> dict[str, Any]:
        """Those that a question has, as its arguments; without a question all. What has no value is left out."""
        from jointplay.analyses.questions import options_of

        found = {}
        for name, value in self.values.items():
            argument, read = WRITTEN.get(name, (name, lambda _, value: _plain(value)))
            if not question or argument in options_of(question):
                found[argument] = read(m, value)
        return {name: value for name, value in found.items() if value is not None}

    def refuse_unheard(self, *asked: str) -> None:
        """Refuse what was typed for questions that are not asked, or without the option that it counts with."""
        typed = [name for name in printed().typed if name in self.values]
        if not typed:
            return
        from jointplay.analyses.questions import options_of, public
        from jointplay.basics.typed import needs_of

        for name in typed:
            argument, _ = WRITTEN.get(name, (name, None))
            owners = [question for question in asked_by(self.asker) if argument in options_of(question)]
            if not {*owners} & {*asked}:
                problem = f"is an option of {listed(owners)}; asked: {listed(asked)}"
                raise InputError(problem, key=_written(name))
            for question in {*owners} & {*asked}:
                need = needs_of(public(question)).get(argument)
                if need is not None and _plain(self.values.get(need.other, need.value)) != need.value:
                    raise InputError(f"goes with {_written(need.other)}", key=_written(name))


#: what commands are given that are called without any
NO_OPTIONS = GivenOptions()


def _written(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _plain(value: Any) -> Any:
    return value.value if isinstance(value, Enum) else value


def asks(
    asker: str,
    words: str,
    default: str | None,
    *names: str,
    own: Sequence[str] = (),
    several: bool = False,
    **left_out: Any,
) -> Callable[[Command], Command]:
    """Give a command `--question` and options of questions, which it gets as its parameters `question` and `options`.

    Where one question is asked, options of others are refused. `names` are the options in the order of the help, with
    what is taken in `left_out` where it differs from other commands. `own` is what only this command asks; without a
    `default` it finds the question.
    """
    kind: Any = choice(*own, *asked_by(asker))
    kind = list[kind] if several else kind
    option = option_of(kind if default else kind | None, "--question", "-q", help=words)
    added = {name: (OF_QUESTIONS[name][0], left_out.get(name, OF_QUESTIONS[name][1])) for name in names}

    def extended(command: Command) -> Command:
        @functools.wraps(command)
        def run(*, question: Any, **values: Any) -> int:
            options = GivenOptions(asker, {name: values.pop(name) for name in names})
            if several:
                return command(question=[*map(_plain, question or ())], options=options, **values)
            if question is not None:
                options.refuse_unheard(_plain(question))
            heard = {"options": options} if names else {}
            return command(question=_plain(question), **heard, **values)

        return exchanged(run, command, {"question": {"question": (option, default)}, "options": added})

    return extended
