"""Results as tables for reading."""

from jointplay.result.conclusions import VERDICTS

from .layout import Column, ResultTable, decimals, numbers
from .questions import tables
from .render import Answer, Console, show, show_names
from .screen import screen

__all__ = [
    "VERDICTS",
    "Answer",
    "Column",
    "Console",
    "ResultTable",
    "decimals",
    "numbers",
    "screen",
    "show",
    "show_names",
    "tables",
]
