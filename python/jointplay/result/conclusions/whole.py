"""The verdict for a whole file: one sentence over all questions that were asked."""

from collections.abc import Mapping, Sequence

import numpy as np

from jointplay.questions import QUESTIONS
from jointplay.result import FORCES_APART, Result, counted
from jointplay.result.verdict import HELD, MISSED, NOT_SHOWN, RANK, Verdict, left_out, percent, verdict

from .wear import judged as asked_words
from .words import Sentence, strung

#: the results of a question, of every output and load case, each with its heading
NamedResults = Sequence[tuple[str, Result]]


def decide(answers: Mapping[str, NamedResults]) -> Sentence | None:
    """Whether limits hold in all questions that were asked together, and what this rests on.

    Parameters
    ----------
    answers : mapping
        By question; see `jointplay.result.parts`.

    Returns
    -------
    Sentence or None
        None where fewer than two questions were asked, or none of them has limits to keep to.
    """
    if len(answers) < 2:
        return None
    told: dict[str, list[str]] = {MISSED: [], NOT_SHOWN: [], HELD: []}
    for question, parts in answers.items():
        if QUESTIONS[question].judged and parts:
            heading, part, found = max(_judged(parts), key=lambda one: (RANK[one[2].outcome], one[2].used))
            if found.outcome:
                told[found.outcome].append(rests(question, part, found, heading))
    if any(FORCES_APART in part.attrs for parts in answers.values() for _, part in parts) and not answers.get("forces"):
        told[NOT_SHOWN].append(f"{QUESTIONS['forces'].judged} (`forces` judges them, or says why it cannot)")
    missed, unknown, held = told.values()
    out = _left_out(answers)
    if missed:
        rest = f" Held: {strung(held)}." if held else ""
        rest += f" Not shown: {'; '.join(unknown)}." if unknown else ""
        return Sentence(f"Limits missed: {'; '.join(missed)}{out}.{rest}", True, True, state=MISSED)
    if unknown:
        rest = f"; they hold {strung(held)}" if held else ""
        return Sentence(f"Not shown: whether limits hold {'; '.join(unknown)}{rest}{out}.", True, True, state=NOT_SHOWN)
    return Sentence(f"Limits hold {strung(held)}{out}.", is_answer=True, state=HELD) if held else None


def _left_out(answers: Mapping[str, NamedResults]) -> str:
    """Configurations at which the machine cannot be, as the end of a sentence."""
    every = [counted(part.get("status")) for parts in answers.values() for _, part in parts]
    out = sorted({k for counts in every if counts.any() for k in np.flatnonzero(~counts).tolist()})
    return left_out(out)


def _judged(parts: NamedResults) -> list[tuple[str, Result, Verdict]]:
    return [(heading, part, verdict(part)) for heading, part in parts]


def rests(question: str, part: Result, found: Verdict, heading: str = "") -> str:
    """What a verdict rests on, and where limits do not hold what decides it."""
    share = float(part.attrs.get("required_yield", float("nan")))
    words = f"{QUESTIONS[question].judged.format(percent(share))}{found.basis}"
    if question == "forces":
        words += f" {asked_words(part)}"
    if not found.gist:
        return words
    where = f"{heading[:1].lower()}{heading[1:]}: " if heading else ""
    return f"{words} ({where}{found.gist})"
