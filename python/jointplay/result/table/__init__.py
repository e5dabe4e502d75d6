"""Results as tables for reading."""

from jointplay.result.conclusions import VERDICTS

from .documents import KINDS, blocks, document, heading, is_printed
from .layout import Column, ResultTable, decimals, numbers
from .questions import tables
from .render import Answer, Console, show, show_names
from .screen import screen

__all__ = [
    "KINDS",
    "VERDICTS",
    "Answer",
    "Column",
    "Console",
    "ResultTable",
    "blocks",
    "decimals",
    "document",
    "heading",
    "is_printed",
    "numbers",
    "screen",
    "show",
    "show_names",
    "tables",
]
