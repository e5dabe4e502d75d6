"""Files that a robot names: regular ones in its folder, or below it, and nothing else.

A program that reads them looks for a name in several places: beside the file that has it, beside the first file, and in
the folders that the file gives for meshes and textures. None of these may lead out of the folder, also not by a link.
"""

import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

from jointplay.errors import InputError, one_line, shown
from jointplay.file.toml import MOST_FILES
from jointplay.file.toml import read as read_text

from .xml import parsed

#: attributes that name a file or a folder
FILE, FOLDER = re.compile(r"file\w*"), re.compile(r"\w+dir")
#: elements whose file is a model, or a part of one
MODELS = ("include", "model")
VALID = "files of a robot are regular files in its folder, or in folders of that, named without '..'"


def check(path: Path, what: str) -> None:
    """Refuse a robot that names files which are elsewhere, or none that can be read.

    Parameters
    ----------
    path : Path
        Its first file.
    what : str
        What a file with a part of it should be, for messages.

    Raises
    ------
    InputError
        Naming the file, the element and the name.
    """
    root = Path(os.path.realpath(path)).parent
    trees: dict[Path, Element] = {}
    waiting = [path]
    for part in waiting:
        if part in trees:
            continue
        if len(trees) >= MOST_FILES:
            raise InputError(f"names more than {MOST_FILES} files with parts of it", file=one_line(str(path)))
        name, text = read_text(part, what)
        trees[part] = parsed(text, name)
        for element, value in _named(trees[part], FILE):
            if element.tag in MODELS:
                _refuse_elsewhere(name, element, value)
                found = [place / value for place in {part.parent, path.parent}]
                waiting += [place for place in found if _is_there(place, root, name, element, value)]
    folders = {Path()} | {
        Path(value)
        for part, tree in trees.items()
        for element, value in _named(tree, FOLDER)
        if _refuse_elsewhere(one_line(str(part)), element, value)
    }
    for part, tree in trees.items():
        for element, value in _named(tree, FILE):
            name = one_line(str(part))
            _refuse_elsewhere(name, element, value)
            for beside in {part.parent, path.parent}:
                for folder in folders:
                    for own in {value, Path(value).name}:
                        _is_there(beside / folder / own, root, name, element, value)


def _named(tree: Element, attribute: re.Pattern[str]) -> Iterator[tuple[Element, str]]:
    for element in tree.iter():
        for key, value in element.attrib.items():
            if attribute.fullmatch(key) and value.strip():
                yield element, value.strip()


def _refuse_elsewhere(file: str, element: Element, value: str) -> bool:
    """Refuse a name that leads out of a folder by itself."""
    parts = value.replace("\\", "/").split("/")
    if not parts[0] or ".." in parts or ":" in value or "\0" in value:
        raise InputError(f"{shown(value)} is elsewhere; {VALID}", file=file, key=f"<{element.tag}>")
    return True


def _is_there(place: Path, root: Path, file: str, element: Element, value: str) -> bool:
    """Whether there is a file; it has to be a regular one within the folder."""
    try:
        found = Path(os.path.realpath(place))
        mode = found.stat().st_mode
    except (OSError, ValueError):
        return False
    if not found.is_relative_to(root):
        raise InputError(f"{shown(value)} leads out of the folder; {VALID}", file=file, key=f"<{element.tag}>")
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise InputError(f"{shown(value)} is no regular file; {VALID}", file=file, key=f"<{element.tag}>")
    return stat.S_ISREG(mode)
