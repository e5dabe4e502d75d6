"""Who answers for a mechanism file as a document: what reports print in their heads; questions do not read it."""

import datetime
from typing import Annotated, ClassVar

from pydantic import AfterValidator, BeforeValidator, Field

from jointplay.errors import one_line, shown

from .values import Table, is_number, problem

#: letters of an entry: more is a text, and no entry of a title block
MOST_LETTERS = 200


def _line(value: str) -> str:
    if len(value) > MOST_LETTERS:
        raise problem(f"must have at most {MOST_LETTERS} letters, not {len(value)}")
    if one_line(value) != value:
        raise problem(f"one line without control characters is needed, not {shown(one_line(value))}")
    return value


def _text(value: object) -> object:
    """A number and a date of TOML as they are written: without quotes they are no texts."""
    return str(value) if is_number(value) or type(value) is datetime.date else value


EntryLine = Annotated[str, BeforeValidator(_text, json_schema_input_type=str), AfterValidator(_line)]


class TitleBlock(Table):
    """What reports print in their heads, and whose signatures they ask for; questions do not read it."""

    example: ClassVar[str] = '{ author = "A. Meier", revision = "B", date = "2026-11-28" }'

    title: EntryLine = Field("", description="title of the report; that of the mechanism if left out")
    author: EntryLine = Field("", description="who wrote it")
    revision: EntryLine = Field("", description="its revision, such as B")
    date: EntryLine = Field("", description="its date; that of the day if left out")
    checked_by: EntryLine = Field("", description="who checked it")
    approved_by: EntryLine = Field("", description="who approved it")
