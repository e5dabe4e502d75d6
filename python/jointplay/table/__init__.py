"""Results as tables for reading."""

from .layout import Column, Table, decimals, numbers
from .questions import tables
from .render import show

__all__ = ["Column", "Table", "decimals", "numbers", "show", "tables"]
