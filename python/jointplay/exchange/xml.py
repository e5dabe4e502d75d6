"""XML, read in bounded time: no document types, and with them no entities; nesting, size and number are bounded."""

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np

from jointplay.errors import InputError, listed, shown
from jointplay.file import toml

from .bounds import LARGEST
from .skeleton import Matrix, Vector

#: elements inside one another; no robot comes near it
DEEPEST = 200
#: elements of a file; each takes some hundred bytes
MOST_ELEMENTS = 500_000
#: names of the moments of inertia of a link
MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def parse(path: Path, root: str, what: str) -> Element:
    """The root element of a file.

    Parameters
    ----------
    root : str
        Its tag.
    what : str
        What the file should be, for messages.

    Raises
    ------
    InputError
        When the file cannot be read, is not XML, or has another root.
    """
    name, text = toml.read(path, f"{what} file")
    tree = parsed(text, name)
    if tree.tag != root:
        raise InputError(f"has the root element <{tree.tag}>; a {what} file has <{root}>", file=name)
    return tree


def parsed(text: str, name: str) -> Element:
    """The root element of a text; the name is for messages.

    Raises
    ------
    InputError
        When it is not XML.
    """
    builder = TreeBuilder()
    # Text has been decoded; what the file says of its encoding no longer holds.
    parser = expat.ParserCreate("utf-8")
    depth = count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth += 1
        count += 1
        if count > MOST_ELEMENTS:
            raise InputError(f"has more than {MOST_ELEMENTS} elements", file=name)
        if depth > DEEPEST:
            raise InputError(f"elements are nested more than {DEEPEST} deep", file=name)
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_: object) -> None:
        raise InputError("has a document type (<!DOCTYPE>), which no file that is read here needs", file=name)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(text.encode(), True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise InputError(f"line {error.lineno}, column {error.offset + 1}: is not XML: {reason}", file=name) from None
    return builder.close()


class Reading:
    """Values of elements, with messages that say where they stand.

    Parameters
    ----------
    file : str
        Name of the file in messages.
    """

    def __init__(self, file: str) -> None:
        self.file = file

    def refuse(self, problem: str, *places: str) -> InputError:
        """The error for something at a place in the file, such as ``link 'arm'``, ``joint 'elbow'``."""
        return InputError(problem, file=self.file, key=" ".join(place for place in places if place))

    def name(self, element: Element, *places: str) -> str:
        """The attribute `name`."""
        name = (element.get("name") or "").strip()
        if not name:
            raise self.refuse(f"<{element.tag}> needs a name", *places)
        return name

    def number(self, text: str | None, default: float, *places: str) -> float:
        """A number of an attribute or element; the default where there is none."""
        return default if text is None else float(self.numbers(text, 1, *places)[0])

    def vector(self, text: str | None, default: tuple[float, float, float], *places: str) -> Vector:
        """Three numbers with blanks between them; the default where there is none."""
        return np.array(default) if text is None or not text.strip() else self.numbers(text, 3, *places)

    def numbers(self, text: str, count: int, *places: str) -> Vector:
        """As many finite numbers, with blanks between them."""
        try:
            # Python reads 1_0 as ten.
            found = np.array([float(word.replace("_", "?")) for word in text.split()])
        except ValueError:
            found = np.empty(0)
        if len(found) != count or not np.isfinite(found).all():
            wanted = "a number is" if count == 1 else f"{count} numbers with blanks between them are"
            raise self.refuse(f"{wanted} needed, not {shown(text.strip())}", *places)
        if np.abs(found).max() > LARGEST:
            raise self.refuse(f"numbers are at most {LARGEST:g} in size, not {shown(text.strip())}", *places)
        return found

    def inertia(self, moments: Mapping[str, str | None], *places: str) -> Matrix:
        """The matrix of moments of inertia of their texts by name; those that are not there are zero."""
        xx, xy, xz, yy, yz, zz = (self.number(moments.get(name), 0.0, *places, name) for name in MOMENTS)
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def axis(self, text: str | None, default: tuple[float, float, float], *places: str) -> Vector:
        """A direction as a unit vector."""
        found = self.vector(text, default, *places)
        length = float(np.linalg.norm(found))
        if length < 1e-9:
            raise self.refuse(f"{shown(text)} is no direction", *places)
        return np.asarray(found / length)


def counts(root: Element, *tags: str) -> Iterator[str]:
    """``3 meshes`` for every kind of element that the file has somewhere: ``("mesh", "meshes")`` pairs in a row."""
    for singular, plural in zip(tags[::2], tags[1::2], strict=True):
        number = sum(1 for _ in root.iter(singular))
        if number:
            yield f"{number} {plural if number > 1 else singular}"


def refuse_twice(reading: Reading, names: list[str], what: str) -> None:
    """Refuse a name that two elements have."""
    twice = sorted(name for name, count in Counter(names).items() if count > 1)
    if twice:
        raise reading.refuse(f"{what} named twice: {listed(twice)}")
