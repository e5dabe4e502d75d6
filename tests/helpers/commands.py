"""The command, as tests call it."""

from pathlib import Path

import pytest

from jointplay.cli import run


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """What is said of a command that is refused: one line, and nothing is written."""
    before = sorted(Path().iterdir())
    capsys.readouterr()
    assert run([*words]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("error: ")
    assert said.err.count("\n") == 1
    assert sorted(Path().iterdir()) == before
    return said.err
