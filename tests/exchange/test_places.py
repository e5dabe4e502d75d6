"""Tables of places, put back into the assembly that they come from by the macro of the documentation."""

from __future__ import annotations

import csv
import sys
from io import StringIO
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jointplay as jp
from helpers.commands import refused
from helpers.freecad import Document, Pose, pose
from jointplay.cli import run

MACRO = Path(__file__).resolve().parents[2] / "docs" / "cad" / "places.FCMacro"
ALONG = Rotation.from_rotvec([0, -90, 0], degrees=True)
#: of both pins of the rod, mm
RADIAL = 0.05
#: where a joint is on its first and on its second part
JOINTS = {
    "Main": ("Base", pose(20, 0, 15), "Crank", pose(0, 0, 4)),
    "Pin": ("Rod_1", pose(0, 0, 4), "Crank", pose(15, 0, 8)),
    "Wrist": ("Rod_1", pose(50, 0, 5), "Slider", pose(0, 0, 12)),
}


def drawn() -> dict[str, Pose]:
    """A crank of 15 at 28 degrees, a rod of 50, all closed, on a base that is not at the origin."""
    angle = np.radians(28.0)
    wrist = 15 * np.cos(angle) - np.sqrt(50**2 - (15 * np.sin(angle)) ** 2)
    rod = np.degrees(np.arctan2(-15 * np.sin(angle), wrist - 15 * np.cos(angle)))
    base = pose(3, 4, 5, about=(0, 0, 30))
    return {
        "Base": base,
        "Crank": base @ pose(20, 0, 11, about=(0, 0, 28)),
        "Rod_1": base @ pose(20 + 15 * np.cos(angle), 15 * np.sin(angle), 15, about=(0, 0, rod)),
        "Slider": base @ pose(20 + wrist, 0, 8),
    }


def saved() -> Path:
    document = Document()
    for name, placed in drawn().items():
        document.part(name, placed)
    document.ground("Base")
    for name, (one, first, other, second) in JOINTS.items():
        document.joint(name, "Revolute", (f"{one}.", first), (f"{other}.", second))
    guide = Pose(np.array([0.0, 0, 8]), ALONG), Pose(np.zeros(3), ALONG)
    document.joint("Guide", "Slider", ("Base.", guide[0]), ("Slider.", guide[1]))
    return document.write("a.FCStd")


class Placement:
    """Of FreeCAD, as far as the macro needs it."""

    def __init__(self, at: Any = (0.0, 0.0, 0.0), turn: Any = (0.0, 0.0, 0.0, 1.0)) -> None:
        self.pose = Pose(np.array(at, dtype=float), Rotation.from_quat(turn))

    @classmethod
    def of(cls, placed: Pose) -> Placement:
        return cls(placed.at, placed.turn.as_quat())

    def __mul__(self, other: Placement) -> Placement:
        return Placement.of(self.pose @ other.pose)

    def inverse(self) -> Placement:
        return Placement.of(self.pose.inverse())


def put_back(table: str, configuration: int, monkeypatch: pytest.MonkeyPatch) -> dict[str, Pose]:
    """Where the macro puts the parts."""
    labels = {name: name.replace("_", " ") for name in drawn()}
    items = {
        labels[name]: SimpleNamespace(Label=labels[name], TypeId="Part::Feature", Placement=Placement.of(placed))
        for name, placed in drawn().items()
    }
    module = ModuleType("FreeCAD")
    document = SimpleNamespace(
        Objects=list(items.values()),
        getObjectsByLabel=lambda label: [items[label]],
        openTransaction=lambda _: None,
        commitTransaction=lambda: None,
    )
    vars(module).update(Placement=Placement, Vector=lambda *x: x, Rotation=lambda *q: q, ActiveDocument=document)
    monkeypatch.setitem(sys.modules, "FreeCAD", module)
    text = MACRO.read_text(encoding="utf-8")
    text = text.replace('TABLE = "places.csv"', f'TABLE = "{table}"')
    exec(text.replace('CONFIGURATION = "0"', f'CONFIGURATION = "{configuration}"'), {"__name__": "macro"})
    return {name: items[label].Placement.pose for name, label in labels.items()}


def gaps(placed: dict[str, Pose]) -> dict[str, float]:
    """How far the pins are out of the middle of their holes, mm, across their axes."""
    found = {}
    for name, (one, first, other, second) in JOINTS.items():
        apart = (placed[one] @ first).inverse() @ (placed[other] @ second)
        found[name] = float(np.hypot(*apart.at[:2]))
        assert abs(apart.at[2]) < 1e-9
    return found


def test_the_places_close_the_drawing_within_its_clearances(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the worst case both pins of the rod are at the rim of their holes; ten times as far where it is magnified."""
    m = jp.read(
        saved(),
        planar=True,
        output="Slider",
        drives={"Main": [28.0, 60.0]},
        clearance={"Pin": {"radial": RADIAL}, "Wrist": {"radial": RADIAL}},
    )
    jp.export(m, "nominal.csv")
    jp.export(m, "worst.csv", question="worst")
    jp.export(m, "tenfold.csv", question="worst", magnify=10.0)
    here = put_back("nominal.csv", 0, monkeypatch)
    for name, placed in drawn().items():
        assert here[name].at == pytest.approx(placed.at, abs=1e-9)
        assert (here[name].turn * placed.turn.inv()).magnitude() < 1e-9
    for configuration in (0, 1):
        assert max(gaps(put_back("nominal.csv", configuration, monkeypatch)).values()) < 1e-9
        moved = put_back("worst.csv", configuration, monkeypatch)
        found = gaps(moved)
        assert found["Main"] < 1e-9
        assert [found["Pin"], found["Wrist"]] == pytest.approx([RADIAL, RADIAL], abs=1e-7)
        # The slider is off by what the question says.
        nominal = put_back("nominal.csv", configuration, monkeypatch)["Slider"]
        off = float(np.linalg.norm(moved["Slider"].at - nominal.at))
        worst = float(jp.worst(m).worst_position[configuration])
        assert off == pytest.approx(worst, abs=1e-7)
        far = put_back("tenfold.csv", configuration, monkeypatch)["Slider"]
        assert np.linalg.norm(far.at - nominal.at) == pytest.approx(10 * off, abs=1e-9)


def test_an_arm_in_space_goes_back_to_its_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tree starts where it is drawn as well; the sleeve of `given` offsets is moved along them."""
    placed = drawn()
    document = Document()
    for name in ("Base", "Crank"):
        document.part(name, placed[name])
    document.ground("Base")
    one, first, other, second = JOINTS["Main"]
    document.joint("Main", "Revolute", (f"{one}.", first), (f"{other}.", second))
    clearance = {"radial": RADIAL, "axial": 0.1, "length": 10}
    m = jp.read(document.write("b.FCStd"), output="Crank", drives={"Main": [28.0]}, clearance={"Main": clearance})
    jp.export(m, "nominal.csv")
    jp.export(m, "given.csv", offsets={"Main.side": 0.03})
    there = put_back("nominal.csv", 0, monkeypatch)["Crank"]
    assert there.at == pytest.approx(placed["Crank"].at, abs=1e-9)
    assert (there.turn * placed["Crank"].turn.inv()).magnitude() < 1e-9
    moved = put_back("given.csv", 0, monkeypatch)["Crank"]
    assert np.linalg.norm(moved.at - there.at) == pytest.approx(0.03, abs=1e-9)


def rows_of(table: str, part: str) -> list[dict[str, str]]:
    rows = csv.DictReader(StringIO(Path(table).read_text(encoding="utf-8")))
    return [row for row in rows if row["part"] == part and row["configuration"] != "start"]


def test_loads_displace_as_they_do_in_loaded() -> None:
    """The slider, whose centre is the output: its error in `loaded`."""
    m = jp.loads(jp.examples.text("slider-crank")).with_({"loads": [{"body": "slider", "force": [0, -10]}]})
    jp.export(m, "loaded.csv", question="loaded")
    jp.export(m, "nominal.csv")
    loaded, nominal = (
        np.array([[float(row["x"]), float(row["y"])] for row in rows_of(table, "slider")])
        for table in ("loaded.csv", "nominal.csv")
    )
    assert [float(row["theta [deg]"]) for row in rows_of("nominal.csv", "slider")[:2]] == [15.0, 30.0]
    error = np.asarray(jp.loaded(m).error)
    arm = np.array(m.value("output.at")) if "at" in m.raw["output"] else np.zeros(2)
    turned = np.radians(error[:, 2:]) * np.array([-arm[1], arm[0]])
    assert np.abs(error).max() > 1e-3
    assert np.abs(loaded - nominal + turned - error[:, :2]).max() < 1e-4 * np.abs(error).max()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-o", "a.csv", "-q", "best"], "--question: 'best' is not a question"),
        (["-o", "a.csv", "-c", "1"], "--configuration: a table has all configurations"),
        (["-o", "a.dxf", "-q", "worst"], "--question: is of tables of places"),
        (["-o", "a.xml", "--magnify", "2"], "--magnify: is of tables of places"),
        (["-o", "a.csv", "--magnify", "-2"], "--magnify: a factor from 0"),
        (["-o", "a.csv", "--magnify", "nan"], "--magnify: a factor from 0"),
        (["-o", "a.csv", "-q", "worst", "--offset", "A=0.1,0"], "not both"),
    ],
)
def test_what_a_table_does_not_have_is_refused(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["new", "slider-crank"]) == 0
    assert said in refused(capsys, "export", "slider-crank.toml", *arguments)
