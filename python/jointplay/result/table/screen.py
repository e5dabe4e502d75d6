"""What is printed of the results of one command: the answers first, then the tables."""

from collections.abc import Mapping
from dataclasses import replace

from jointplay.result import Result, parts
from jointplay.result.conclusions import Sentence, conclude, decide

from .layout import ResultTable
from .questions import tables
from .render import Answer

#: sentences of one answer that stand in front of everything
MOST = 3


def screen(results: Mapping[str, Result]) -> tuple[list[Answer], list[ResultTable]]:
    """The answers and the tables of the results, by question.

    Of several questions the verdict over all comes first; each has its answer in front, with what says that something
    is not ok; the other sentences stand above its table. What holds whatever is asked is said once.
    """
    answers, shown, said = [], [], set[Sentence]()
    if (whole := decide({name: parts(result) for name, result in results.items()})) is not None:
        answers.append(Answer("all", (whole,)))
    for name, result in results.items():
        sentences = [s for s in conclude(result).sentences if s not in said]
        said.update(s for s in sentences if s.is_common)
        in_front = sentences if len(results) == 1 else [s for s in sentences if s.is_answer or s.is_alarm]
        top = in_front[:MOST]
        answers.append(Answer(name if len(results) > 1 else "", tuple(top)))
        found = tables(result)
        if found and len(parts(result)) == 1:
            rest = [s for s in sentences if s not in top]
            found[0] = replace(found[0], lead=(*rest, *found[0].lead))
        shown += found
    return answers, shown
