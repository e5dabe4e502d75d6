"""Documents of FreeCAD: a zip archive with `Document.xml`, which has all objects and their properties, and shapes.

The archive is read in bounded time and memory: how long it is, how many members it has and how long each of them may
become are bounded before anything is unpacked. Members are never written to a disk, so that their names do not matter.
"""

import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from jointplay.basics.poses import matrix
from jointplay.errors import InputError, one_line, shown
from jointplay.file import toml

from .skeleton import Frame
from .xml import Reading, parsed

#: bytes of an archive, of its list of members, and of a member that is unpacked
LARGEST_ARCHIVE, LARGEST_LIST, LARGEST_MEMBER = 500_000_000, 4_000_000, 20_000_000
#: bytes of all members of all documents of an assembly that are unpacked
LARGEST_TOGETHER = 100_000_000
#: the record at the end of an archive: signature, counts and sizes; what follows it is a comment
END, END_SIZE, LONGEST_COMMENT = b"PK\x05\x06", 22, 1 << 16
#: the record before it in archives that are larger than 4 GB
LARGER = b"PK\x06\x07"
LARGER_SIZE = 20
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
DOCUMENT = "Document.xml"
#: properties that are kept of an object
KEPT = re.compile(
    r"Label|Visibility|Placement[12]?|Shape|Group|LinkedObject|LinkTransform|Scale(Vector)?|ElementCount|Rigid|ObjectToGround|JointType|Reference[12]"
    r"|Suppressed|Activated|Distance2?|Angle|(Enable)?(Length|Angle)(Min|Max)"
)
#: metres per unit of the format
MM = 1e-3
#: how long a quaternion is that is not zero
SMALL = 1e-9
ELEMENT = re.compile(r"(Edge|Face|Vertex)[0-9]{1,9}")


@dataclass(frozen=True)
class Reference:
    """What a link of a joint names."""

    #: the object that the path begins at
    root: str
    #: names of the objects below it
    path: tuple[str, ...]
    #: ``Edge17``, ``Face3``, ``Vertex2``, or nothing for the axes of the object itself
    element: str


@dataclass(frozen=True)
class DocumentItem:
    """An object of a document."""

    #: its name inside of the document
    name: str
    #: its type, such as ``Part::Feature``
    kind: str
    #: what messages call it
    place: str
    label: str
    reading: Reading = field(repr=False)
    #: elements by name
    properties: Mapping[str, Element] = field(repr=False)

    def value(self, name: str, tag: str) -> str | None:
        """The attribute `value` of the element in a property; None where the object has none."""
        found = self.properties[name].find(tag) if name in self.properties else None
        return None if found is None else found.get("value")

    def number(self, name: str) -> float:
        """A number; zero where there is none."""
        text = self.value(name, "Float")
        return self.reading.number(text, 0.0, self.place, name)

    def holds(self, name: str, default: bool = False) -> bool:
        """Whether something is so."""
        text = self.value(name, "Bool")
        return default if text is None else text.strip().lower() == "true"

    def choice(self, name: str) -> str:
        """The word that an enumeration has; nothing where there is none. Lists differ between versions."""
        if name not in self.properties:
            return ""
        words = [word.get("value") or "" for word in self.properties[name].iter("Enum")]
        text = self.value(name, "Integer") or ""
        if not (text.isascii() and text.isdigit() and len(text) < 4 and int(text) < len(words)):
            raise self.reading.refuse(f"{shown(text)} is no place in its list of {len(words)} words", self.place, name)
        return words[int(text)]

    def links(self, name: str) -> list[str]:
        """Names of the objects that a list of links, or one link, names."""
        found = self.properties[name].iter("Link") if name in self.properties else ()
        return [link.get("value") or "" for link in found if link.get("value")]

    def linked(self) -> tuple[str, str] | None:
        """The file, or nothing for this one, and the object that an `App::Link` shows."""
        found = self.properties["LinkedObject"].find("XLink") if "LinkedObject" in self.properties else None
        if found is None or not found.get("name"):
            return None
        return (found.get("file") or "").strip(), found.get("name") or ""

    def reference(self, name: str) -> Reference | None:
        """What a joint is attached to."""
        found = self.properties[name].find("XLink") if name in self.properties else None
        if found is None or not found.get("name"):
            return None
        first = found.find("Sub")
        sub = (found.get("sub") if first is None else first.get("value")) or ""
        *path, last = sub.split(".")
        if last and ELEMENT.fullmatch(last) is None:
            # Without a dot at its end it is an object, too.
            path, last = [*path, last], ""
        return Reference(found.get("name") or "", tuple(part for part in path if part), last)

    def scales(self) -> list[float]:
        """By what a link shows another size than what it leads to: one number, and one for each axis."""
        text = self.value("Scale", "Float")
        found = [self.reading.number(text, 1.0, self.place, "Scale")]
        vector = self.properties["ScaleVector"].find("PropertyVector") if "ScaleVector" in self.properties else None
        if vector is not None:
            ends = (vector.get(f"value{axis}") for axis in "XYZ")
            found += [self.reading.number(end, 1.0, self.place, "ScaleVector") for end in ends]
        return found

    def frame(self, name: str) -> Frame:
        """A placement: position in m and rotation; none where there is none."""
        found = self.properties[name].find("PropertyPlacement") if name in self.properties else None
        if found is None:
            return Frame()
        x = [self.reading.number(found.get(key), 0.0, self.place, name, key) for key in ("Px", "Py", "Pz")]
        # The real part is the last one.
        q = [self.reading.number(found.get(f"Q{k}"), float(k == 3), self.place, name) for k in (3, 0, 1, 2)]
        length = float(np.linalg.norm(q))
        if length < SMALL:
            raise self.reading.refuse("its quaternion is zero", self.place, name)
        turn = matrix(np.concatenate([np.zeros(3), np.array(q) / length]))
        return Frame(np.array(x) * MM, turn)


class Budget:
    """How many bytes of an assembly may still be unpacked."""

    def __init__(self) -> None:
        self.left = LARGEST_TOGETHER


class Archive:
    """One document.

    Parameters
    ----------
    path : Path
    budget : Budget
        Of the whole assembly.

    Raises
    ------
    InputError
        When it is no archive with a document of FreeCAD in it, or a larger one than is read.
    """

    def __init__(self, path: Path, budget: Budget) -> None:
        self.path, self.budget = path, budget
        self.file = one_line(str(path))
        self.reading = Reading(self.file)
        #: how long they say that they become, by name
        self.members: dict[str, int] = self._opened(
            lambda archive: {info.filename: info.file_size for info in archive.infolist()}
        )
        if DOCUMENT not in self.members:
            raise InputError(f"has no {DOCUMENT}, which documents of FreeCAD have", file=self.file)
        self.items = self._items(parsed(self.text(DOCUMENT), f"{self.file}: {DOCUMENT}"))

    def _opened(self, use: Callable[[zipfile.ZipFile], Any]) -> Any:
        """What is read of the archive."""
        try:
            with self.path.open("rb") as stream:
                self._check(stream)
                with zipfile.ZipFile(stream) as archive:
                    return use(archive)
        except FileNotFoundError:
            raise InputError("there is no such file", file=self.file) from None
        except IsADirectoryError:
            raise InputError("this is a folder, not a document of FreeCAD", file=self.file) from None
        except (zipfile.BadZipFile, zlib.error, struct.error, EOFError, RuntimeError, NotImplementedError) as error:
            reason = one_line(str(error)) or "it ends too early"
            raise InputError(f"is a damaged archive: {reason}", file=self.file) from None
        except (OSError, ValueError, UnicodeError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise InputError(f"cannot be read: {one_line(reason)}", file=self.file) from None

    def _check(self, stream: Any) -> None:
        """Refuse what would take too much memory before its members are listed."""
        size = stream.seek(0, 2)
        if size > LARGEST_ARCHIVE:
            raise InputError(f"is longer than {LARGEST_ARCHIVE // 1_000_000} MB", file=self.file)
        stream.seek(max(0, size - END_SIZE - LONGEST_COMMENT - LARGER_SIZE))
        tail = stream.read()
        at = tail.rfind(END)
        if at < 0 or len(tail) < at + END_SIZE:
            raise InputError("is no zip archive, which documents of FreeCAD are", file=self.file)
        (length,) = struct.unpack_from("<L", tail, at + 12)
        if length > LARGEST_LIST or LARGER in tail[max(0, at - LARGER_SIZE) : at]:
            raise InputError("is an archive with too many members", file=self.file)
        stream.seek(0)

    def text(self, member: str) -> str:
        """The text of a member.

        Raises
        ------
        InputError
            When it is damaged, or becomes too long.
        """
        most = min(LARGEST_MEMBER, self.budget.left)

        def use(archive: zipfile.ZipFile) -> bytes:
            info = archive.getinfo(member)
            if info.compress_type not in METHODS:
                raise InputError("is packed in a way that documents of FreeCAD are not", file=self.file, key=member)
            with archive.open(info) as stream:
                return stream.read(most + 1)

        content: bytes = self._opened(use)
        if len(content) > most:
            much = f"more than {LARGEST_MEMBER // 1_000_000} MB, or {LARGEST_TOGETHER // 1_000_000} MB with all others"
            raise InputError(f"becomes too long when it is unpacked: {much}", file=self.file, key=member)
        self.budget.left -= len(content)
        return toml.decoded(content, f"{self.file}: {member}", "document of FreeCAD")

    def _items(self, root: Element) -> dict[str, DocumentItem]:
        if root.tag != "Document":
            problem = f"{DOCUMENT} has the root element <{root.tag}>; that of FreeCAD has <Document>"
            raise InputError(problem, file=self.file)
        kinds = {element.get("name") or "": element.get("type") or "" for element in root.iterfind("Objects/Object")}
        return {item.name: item for item in self._read(root, kinds)}

    def _read(self, root: Element, kinds: Mapping[str, str]) -> Iterator[DocumentItem]:
        for element in root.iterfind("ObjectData/Object"):
            name = element.get("name") or ""
            every = ((found.get("name") or "", found) for found in element.iterfind("Properties/Property"))
            properties = {key: found for key, found in every if KEPT.fullmatch(key)}
            label = properties["Label"].find("String") if "Label" in properties else None
            called = ((label.get("value") if label is not None else "") or "").strip() or name
            place = f"'{one_line(called)}'"
            yield DocumentItem(name, kinds.get(name, ""), place, called, self.reading, properties)

    def shape(self, item: DocumentItem) -> str | None:
        """The text of the shape of an object; None where it is longer than is read.

        Raises
        ------
        InputError
            When it is damaged, or becomes longer than it says.
        """
        member = shape_member(item)
        if member.endswith(".bin") or self.members.get(member, 0) > min(LARGEST_MEMBER, self.budget.left):
            return None
        return self.text(member) if member in self.members else ""


def shape_member(item: DocumentItem) -> str:
    """Name of the member that has the shape of an object; nothing where it has none."""
    part = item.properties["Shape"].find("Part") if "Shape" in item.properties else None
    found = "" if part is None else part.get("file") or ""
    return found if found.endswith((".brp", ".bin")) else ""
