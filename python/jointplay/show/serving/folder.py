"""The files that a page may open and save: mechanisms in one folder, by their plain names.

The folder is that of the file with which the command was started, or where it was started without one. A page names
files in it and no others: no folder, no link that leads out of it, nothing hidden, nothing but `.toml`.
"""

import os
from dataclasses import dataclass
from pathlib import Path

from jointplay.basics import files
from jointplay.errors import InputError, one_line, shown
from jointplay.file import toml

EXTENSION = ".toml"
#: as many files are offered
MOST_NAMES = 500


@dataclass(frozen=True)
class Opened:
    """A text and where it is from."""

    #: when it was opened or saved
    content: str
    #: its name in messages
    title: str
    #: its file in the folder; empty where it is an example or comes from the page
    name: str = ""


class Folder:
    """A folder with mechanism files.

    Parameters
    ----------
    path : path-like
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(os.path.realpath(path))

    def names(self) -> list[str]:
        """The files that can be opened."""
        try:
            found = sorted(entry.name for entry in self.path.iterdir() if _is_plain(entry.name) and self._is_own(entry))
        except OSError:
            return []
        return found[:MOST_NAMES]

    def _is_own(self, place: Path) -> bool:
        """Whether a file that is there is in the folder, and not what a link leads to elsewhere."""
        return place.is_file() and Path(os.path.realpath(place)).parent == self.path

    def place(self, name: str) -> Path:
        """Where a file of the folder is, or would be.

        Raises
        ------
        InputError
            When the name is not that of a mechanism file in the folder.
        """
        place = self.path / name if _is_plain(name) else None
        if place is None or (os.path.lexists(place) and not self._is_own(place)):
            problem = f"{shown(name)} is not the name of a {EXTENSION} file in the folder {one_line(str(self.path))}"
            raise InputError(problem)
        return place

    def open(self, name: str) -> Opened:
        """A file of the folder.

        Raises
        ------
        InputError
            When it cannot be read.
        """
        place = self.place(name)
        title, content = toml.read(place)
        return Opened(content, title, name)

    def save(self, opened: Opened, text: str, name: str) -> Opened:
        """Write a text to a file of the folder.

        Parameters
        ----------
        opened : Opened
            What it was made of. Its own file is replaced if nobody else has changed it; other files are not.
        """
        place = self.place(name)
        if os.path.lexists(place):
            if name != opened.name:
                raise InputError("is there already; choose another name", file=name)
            if toml.read(place)[1] != opened.content:
                raise InputError("has been changed by somebody else; open it again, or choose another name", file=name)
        files.put(text.encode(), place)
        return Opened(toml.read(place)[1], os.fspath(place), name)


def _is_plain(name: str) -> bool:
    """Whether a name is one of a mechanism file without a folder."""
    plain = name.isprintable() and not any(mark in name for mark in "/\\:\0")
    return plain and not name.startswith(".") and name.lower().endswith(EXTENSION) and len(name) > len(EXTENSION)
