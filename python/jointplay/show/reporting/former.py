"""A former report of the same mechanism, and what has changed since: keys of the file, verdicts and largest errors.

Every page carries what a later one is compared by: its mechanism as text, and a record in its head.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from html import escape, unescape
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from jointplay.errors import InputError, shown
from jointplay.file import toml
from jointplay.model.mechanism import ASIDE
from jointplay.questions import QUESTIONS
from jointplay.result import figures, quantity
from jointplay.result.table import Column, ResultTable
from jointplay.result.table.layout import NOTHING, change, words
from jointplay.result.verdict import verdict

from .answers import JUDGED, Answers

#: bytes of a page that is read; those of reports have one or two million
MOST = 100_000_000
NAME = "jointplay-report"
RECORD = re.compile(rf'<meta name="{NAME}" content="([^"]*)">')
FILE = re.compile(r"<pre[^>]*>(.*?)</pre>", re.DOTALL)


@dataclass(frozen=True)
class Judgement:
    """The answer to a question about an output in a load case, with its largest errors by quantity."""

    label: str
    outcome: str
    largest: dict[str, tuple[float, str]]


@dataclass(frozen=True)
class Record:
    """What a page says of itself."""

    hash: str
    revision: str
    date: str
    judgements: list[Judgement]


@dataclass(frozen=True)
class Former:
    """A former report."""

    #: of its file
    name: str
    #: its mechanism
    raw: Mapping[str, Any]
    #: None where it is of a version that wrote none
    record: Record | None


def record_of(answers: Answers, date: str) -> Record:
    """The record of a page."""
    judgements = []
    for chapter in answers.chapters:
        for question in JUDGED:
            for heading, part in chapter.parts(question):
                label = ", ".join(filter(None, (chapter.output, QUESTIONS[question].label, heading)))
                largest = {}
                for name in figures(part):
                    values = quantity(part, name)
                    known = np.abs(values.values[np.isfinite(values.values)])
                    if known.size:
                        largest[name] = (float(known.max()), values.units)
                judgements.append(Judgement(label, verdict(part).outcome, largest))
    document = answers.m.data.document
    return Record(answers.m.hash, document.revision if document else "", date, judgements)


def in_head(record: Record) -> str:
    """The record as an element in the head of a page."""
    return f'<meta name="{NAME}" content="{escape(json.dumps(asdict(record)), quote=True)}">'


def read(path: Path) -> Former:
    """A former report.

    Raises
    ------
    InputError
        When it cannot be read, or is none.
    """
    problem = "is no report; --against takes the .html that `jointplay report` has written"
    try:
        with path.open("rb") as file:
            text = file.read(MOST).decode(errors="replace")
    except FileNotFoundError:
        raise InputError("there is no such file", file=str(path)) from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=str(path)) from None
    pages = FILE.findall(text)
    if not pages:
        raise InputError(problem, file=str(path))
    try:
        raw = toml.parse(unescape(pages[-1]), file=str(path))
    except InputError:
        raise InputError(problem, file=str(path)) from None
    found = RECORD.search(text)
    try:
        record = TypeAdapter(Record).validate_json(unescape(found[1]), strict=True) if found else None
    except ValidationError:
        raise InputError("is a report whose record is damaged", file=str(path)) from None
    return Former(path.name, raw, record)


def changed_keys(before: Mapping[str, Any], now: Mapping[str, Any]) -> ResultTable | None:
    """The keys of the file that differ; None where there are none."""
    old, new = (dict(_leaves({k: v for k, v in raw.items() if k not in ASIDE})) for raw in (before, now))
    keys = [key for key in {**old, **new} if old.get(key) != new.get(key)]
    if not keys:
        return None
    befores, nows = ([shown(side[key]) if key in side else NOTHING for key in keys] for side in (old, new))
    columns = (words("key", keys, is_key=True), words("before", befores), words("now", nows))
    return ResultTable("Keys of the file", columns)


def _leaves(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """The values of a file by dotted key: lists of plain values are one."""
    steps: Iterator[tuple[object, Any]] | None = None
    if isinstance(value, Mapping):
        steps = iter(value.items())
    elif isinstance(value, list) and any(isinstance(one, Mapping) for one in value):
        steps = iter(enumerate(value))
    if steps is None:
        yield key, value
        return
    for step, one in steps:
        yield from _leaves(one, f"{key}.{step}".lstrip("."))


def changed_answers(before: Record, now: Record) -> ResultTable:
    """Verdicts and largest errors, before and now."""
    old, new = ({one.label: one for one in record.judgements} for record in (before, now))
    labels = [*dict.fromkeys((*new, *old))]
    sides = [[side.get(label) for label in labels] for side in (old, new)]
    columns = [words("question", labels, is_key=True)]
    for name, side in zip(("before", "now"), sides, strict=True):
        columns.append(words(f"verdict\n{name}", [(one.outcome if one else "") or NOTHING for one in side]))
    for name in dict.fromkeys(name for side in sides for one in side if one for name in one.largest):
        values = [[one.largest.get(name) if one else None for one in side] for side in sides]
        for word, column in zip(("before", "now"), values, strict=True):
            cells = tuple(f"{one[0]:.4g} {one[1]}" if one else NOTHING for one in column)
            columns.append(Column(f"{name}\n{word}", "", cells))
        cells = tuple(_change(a, b) for a, b in zip(*values, strict=True))
        columns.append(Column(f"{name}\nchange", "", cells))
    return ResultTable("Verdicts and largest errors", tuple(columns))


def _change(before: tuple[float, str] | None, now: tuple[float, str] | None) -> str:
    if before is None or now is None or before[1] != now[1]:
        return NOTHING
    return change(before[0], now[0]) if before[0] else NOTHING
