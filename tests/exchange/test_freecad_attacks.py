"""Archives that are damaged, or made to do harm: to read other files, to take all memory, or never to end."""

import io
import os
import struct
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers.commands import refused
from helpers.freecad import Document, cylinder, links, pose, shape
from jointplay.cli import run
from jointplay.exchange import brep, fcstd
from jointplay.exchange.brep import PartShape, Unreadable
from jointplay.exchange.options import Options
from jointplay.exchange.reading import imported

FOUND = shape(cylinder(4, 0, 9, True))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")


def assembly() -> Document:
    document = Document()
    document.part("base", pose(), FOUND)
    document.part("arm", pose(), FOUND)
    document.ground("base")
    document.joint("J", "Revolute", ("base.Edge1", pose()), ("arm.Edge1", pose()))
    return document


def soon_refused(problem: str, capsys: pytest.CaptureFixture[str]) -> None:
    start = time.monotonic()
    assert problem in refused(capsys, "import", "a.FCStd")
    assert time.monotonic() - start < 40


def said_of(name: str) -> str:
    return " ".join(imported(Path(name), Options()).notes)


def with_text(text: str | bytes) -> None:
    with zipfile.ZipFile("a.FCStd", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("Document.xml", text)


def packed(*, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", method) as archive:
        archive.writestr("Document.xml", assembly().xml())
    return stream.getvalue()


TEXTS: dict[str, tuple[str | bytes, str]] = {
    "not XML": ("<Document", "is not XML"),
    "another root": ("<robot/>", "has the root element <robot>"),
    "entities": ("<!DOCTYPE d [<!ENTITY a 'b'>]><Document>&a;</Document>", "has a document type"),
    "depth": ("<Document>" + "<a>" * 10_000, "nested more than"),
    "number": ("<Document>" + "<a/>" * 500_001, "more than 500000 elements"),
    "UTF-16": ("<Document/>".encode("utf-16"), "UTF-16"),
    "latin": ("<Document>\xe4</Document>".encode("latin-1"), "is not UTF-8"),
    "nothing": ("<Document/>", "has no object that is an assembly"),
    "size": ("<Document>" + " " * 21_000_000, "becomes too long when it is unpacked"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_a_document_that_is_none_is_refused(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    text, problem = TEXTS[name]
    with_text(text)
    soon_refused(problem, capsys)


def test_a_file_that_is_no_archive_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    for content in (b"", b"PK", b"x" * 100_000, packed()[:-30], packed()[40:], b"PK\x05\x06" + b"\xff" * 18):
        Path("a.FCStd").write_bytes(content)
        soon_refused("", capsys)
    Path("a.FCStd").unlink()
    soon_refused("there is no such file", capsys)
    Path("a.FCStd").mkdir()
    soon_refused("folder", capsys)


def test_an_archive_with_too_many_members_is_not_listed(capsys: pytest.CaptureFixture[str]) -> None:
    """A list of members takes far more memory than the archive is long."""
    content = packed()
    at = content.rindex(b"PK\x05\x06")
    Path("a.FCStd").write_bytes(content[: at + 12] + struct.pack("<L", 5_000_000) + content[at + 16 :])
    soon_refused("too many members", capsys)


def test_bombs_do_not_go_off(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """A member that becomes a thousand times as long, one that is packed otherwise, and many shapes together."""
    with_text(b"\0" * 60_000_000)
    soon_refused("becomes too long", capsys)
    for method in (zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA):
        Path("a.FCStd").write_bytes(packed(method=method))
        soon_refused("packed in a way", capsys)
    monkeypatch.setattr(fcstd, "LARGEST_TOGETHER", 9000)
    assembly().write("a.FCStd", {"base.Shape.brp": FOUND + "\n" * 9000})
    assert "Shapes that cannot be read, so that no pins and holes are: base." in said_of("a.FCStd")
    # One that becomes longer than it says.
    content = Path("a.FCStd").read_bytes().replace(struct.pack("<L", len(FOUND) + 9000), struct.pack("<L", 100))
    Path("a.FCStd").write_bytes(content)
    assert run(["import", "a.FCStd"]) in (0, 2)
    capsys.readouterr()
    Path("a.toml").unlink(missing_ok=True)
    monkeypatch.setattr(fcstd, "LARGEST_TOGETHER", 900)
    soon_refused("becomes too long", capsys)


def test_names_of_members_lead_nowhere() -> None:
    """Nothing is unpacked to the disk, and a shape is a member of its archive."""
    document = assembly()
    outside = Path("..", "outside.Shape.brp")
    outside.write_text(FOUND)
    name = str(outside.resolve())
    document.objects = [(a, b, c.replace("base.Shape.brp", name)) for a, b, c in document.objects]
    document.write("a.FCStd", {"../../escaped.brp": "x", "/escaped.brp": "x", "arm.Shape.brp/../x": "x"})
    assert jp.read("a.FCStd").joints == ("J",)
    assert not list(Path("..").rglob("escaped*"))


@pytest.mark.parametrize(
    "name", ["../b.FCStd", "leads-out.FCStd", "sub/b.FCStd", "{}", "C:b.FCStd", "pipe.FCStd", "a\\b"]
)
def test_other_documents_are_in_the_folder_or_are_not_read(name: str) -> None:
    """A pipe was waited for without end, and files elsewhere are nobody's business."""
    other = Document()
    other.assembly = False
    other.body("Body", pose(), FOUND)
    other.write("../b.FCStd")
    Path("leads-out.FCStd").symlink_to("../b.FCStd")
    Path("sub").symlink_to("..")
    os.mkfifo("pipe.FCStd")
    document = assembly()
    document.link("far", "Body", pose(), file=name.format(Path("../b.FCStd").resolve()))
    document.joint("K", "Ball", ("far.Pad.Edge1", pose()), ("arm.", pose()))
    with pytest.raises(jp.InputError, match=r'names "Pad", which is in ".*no file in this folder'):
        jp.read(document.write("a.FCStd"))


def test_links_in_a_circle_end() -> None:
    document = assembly()
    document.link("one", "two")
    document.link("two", "one")
    document.joint("K", "Ball", ("one.", pose()), ("arm.", pose()))
    with pytest.raises(jp.InputError, match="links lead to one another in a circle"):
        jp.read(document.write("a.FCStd"))
    # Groups in one another are gone through once.
    document = assembly()
    for one, two in (("G", "H"), ("H", "G")):
        document.add(one, "App::DocumentObjectGroup", links("Group", [two]))
    document.group.append("G")
    assert jp.read(document.write("a.FCStd")).joints == ("J",)


def test_shapes_made_of_shapes_end() -> None:
    """Each of forty shapes holds the one before it twice: a million million edges."""
    lines = ["Ve\n1e-7\n0 0 0\n0 0\n\n0101101\n*"]
    lines += [f"Co\n\n1100000\n+{42 - k} 0 +{42 - k} 0 *" for k in range(1, 41)]
    empty = "".join(f"{name} 0\n" for name in ("Curve2ds", "Curves", "Polygon3D", "Surfaces", "Triangulations"))
    body = "\n".join(lines)
    made = PartShape(f"\nCASCADE Topology V1, x\nLocations 0\n{empty}\nTShapes 41\n{body}\n+1 0\n")
    start = time.monotonic()
    with pytest.raises(Unreadable, match="more than"):
        made.element("Edge1")
    assert time.monotonic() - start < 40
    many = f"Locations 200\n{' '.join(['1 1 0 0 0 0 1 0 0 0 0 1 0'] + [f'2 {k} 20 {k} 20 0' for k in range(1, 200)])}\n"
    with pytest.raises(Unreadable):
        PartShape(f"\nCASCADE Topology V1, x\n{many}{empty}\nTShapes 41\n{body}\n+1 0\n")
    assert brep.MOST_MET < 1_000_000


def test_damaged_archives_and_shapes_end_with_a_message(capsys: pytest.CaptureFixture[str]) -> None:
    """Bytes changed, cut out and doubled: it is read, or one line says why not."""
    generator = np.random.default_rng(7)
    document = assembly()
    texts = {"Document.xml": document.xml().encode(), "base.Shape.brp": FOUND.encode(), "arm.Shape.brp": FOUND.encode()}
    for trial in range(60):
        members = dict(texts)
        if trial % 3:
            name = ("Document.xml", "base.Shape.brp")[trial % 2]
            members[name] = damaged(members[name], generator)
        with zipfile.ZipFile("a.FCStd", "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in members.items():
                archive.writestr(name, content)
        if not trial % 3:
            Path("a.FCStd").write_bytes(damaged(Path("a.FCStd").read_bytes(), generator))
        code = run(["import", "a.FCStd", "--force"])
        said = capsys.readouterr().err
        assert code in (0, 2)
        assert code == 0 or said.count("\n") == 1


def damaged(content: bytes, generator: np.random.Generator) -> bytes:
    at, length = generator.integers(len(content)), generator.integers(1, 40)
    kind = generator.integers(4)
    piece = content[at : at + length]
    if kind == 0:
        piece = generator.bytes(len(piece))
    elif kind == 1:
        piece = b""
    elif kind == 2:
        piece = piece * 2
    else:
        # Numbers that none should be.
        piece = (b"1e999", b"-1", b"nan", b"999999999", b"0", b"+7 0")[generator.integers(6)]
    return content[:at] + piece + content[at + length :]
