"""Counts and lists in sentences."""

from collections.abc import Sequence


def count(number: int, what: str) -> str:
    """``1 drive``, ``2 drives``."""
    return f"{number} {what}{'s' * (number != 1)}"


def joined(names: Sequence[str]) -> str:
    """``a, b and c``."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else "nothing"
