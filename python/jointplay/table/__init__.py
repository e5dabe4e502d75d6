"""Results as tables for reading."""

from .assembly import VERDICTS
from .layout import Column, Table, decimals, numbers
from .questions import tables
from .render import Console, show

__all__ = ["VERDICTS", "Column", "Console", "Table", "decimals", "numbers", "show", "tables"]
