"""Options that belong to questions: what is typed for a question that is not asked is refused, as in Python."""

from __future__ import annotations

import inspect
from collections.abc import Sequence

from jointplay.errors import InputError, listed

from .printing import printed

#: options that are called otherwise than the arguments of the questions
CALLED = {"offset": "offsets", "first_order": "exact"}


def refuse_unheard(asked: Sequence[str], own: Sequence[str] = ()) -> None:
    """Refuse options of questions that are not asked.

    Parameters
    ----------
    asked : sequence of str
        The questions.
    own : sequence of str
        Options that the command itself hears, whatever is asked.

    Raises
    ------
    InputError
        Naming the first such option and the questions that have it.
    """
    typed = [name for name in printed().typed if name not in own]
    if not typed:
        return
    from jointplay.analyses.questions import PUBLIC

    for name in typed:
        argument = CALLED.get(name, name)
        owners = [question for question, f in PUBLIC.items() if argument in inspect.signature(f).parameters]
        if owners and not {*owners} & {*asked}:
            raise InputError(
                f"is an option of {listed(owners)}; asked: {listed(asked)}", key=f"--{name.replace('_', '-')}"
            )
