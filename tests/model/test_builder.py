"""Mechanisms written in Python: they are those of the file, with its messages, and editors know the methods."""

import copy
import inspect
import re
import subprocess
import sys
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jedi
import numpy as np
import pandas as pd
import pytest
import xarray as xr

import jointplay as jp
from helpers import signatures
from jointplay import examples
from jointplay.file.schema import json_schema
from jointplay.model.builder.build import Pattern

ROOT = Path(__file__).resolve().parents[2]
UNITS: Any = {"length": "mm", "angle": "deg", "force": "N"}
#: the method of each section whose entries have names
METHODS = {**signatures.NAMED, "correlations": "correlation"}


def as_parameters(table: Mapping[str, Any]) -> dict[str, Any]:
    return {"from_" if key == "from" else key: value for key, value in table.items()}


def write_parts(b: Any, tables: Mapping[str, Any]) -> None:
    """The sections that a mechanism and a pattern have in common."""
    for name, joint in tables.get("joints", {}).items():
        own = {key: value for key, value in joint.items() if key not in ("type", "on")}
        on = joint.get("on", {})
        # Bodies are parameters, unless one has the name of another parameter.
        known = inspect.signature(getattr(b, joint["type"])).parameters
        apart = {key: value for key, value in on.items() if key not in known}
        getattr(b, joint["type"])(name, **own, **(apart if len(apart) == len(on) else {"on": on}))
    for section, method in METHODS.items():
        for name, table in tables.get(section, {}).items() if section != "correlations" else ():
            getattr(b, method)(name, **as_parameters(table))
    for load in tables.get("loads", ()):
        b.load(**load)
    if "limits" in tables:
        b.limits(**tables["limits"])


def rebuilt(raw: Mapping[str, Any]) -> jp.Builder:
    """A builder that has been called once for every entry of a file."""
    head = ("space", "units", "title", "gravity", "temperature", "expansion", "friction")
    b = jp.Builder(**{"space": "planar"} | {key: raw[key] for key in head if key in raw})
    b.variables(**raw.get("variables", {}))
    for name, pattern in raw.get("patterns", {}).items():
        own = {key: pattern[key] for key in ("count", "about", "values", "shared") if key in pattern}
        write_parts(b.pattern(name, **own), pattern)
    write_parts(b, raw)
    for section in ("path", "assembly", "target", "design", "document"):
        if section in raw:
            getattr(b, section)(**raw[section])
    if "output" in raw:
        b.output(**raw["output"])
    for name, output in raw.get("outputs", {}).items():
        b.output(name, **output)
    for case, loads in raw.get("load_cases", {}).items():
        for load in loads or [{}]:
            b.load(case, **load)
    for correlation in raw.get("correlations", ()):
        b.correlation(**correlation)
    if "grid" in raw:
        b.grid(**raw["grid"])
    return b


def arm() -> jp.Builder:
    b = jp.Builder(space="planar", units=UNITS)
    b.revolute("J1", ground=(0, 0), crank=(0, 0), clearance=jp.radial(0.05))
    b.drive("theta", joint="J1", from_=0, to=90, count=4)
    b.output(body="crank", at=(100, 0))
    return b


def test_the_methods_are_those_of_the_schema() -> None:
    for path, text in signatures.files().items():
        assert path.read_text(encoding="utf-8") == text, "python tests/helpers/signatures.py writes it again"


def test_every_section_of_the_file_has_its_method() -> None:
    known = {*signatures.NAMED, *signatures.SINGLE, *signatures.LISTED, *signatures.BY_HAND, *signatures.OF_FILES}
    known |= {"joints", *signatures.BESIDE, *signatures.BESIDE.values()}
    for name in ("PlanarFile", "SpatialFile"):
        assert set(json_schema()["$defs"][name]["properties"]) == known
    inside = {"count", "about", "values", "shared", "joints", "limits", "loads", *signatures.NAMED} - {"costs"}
    for name in ("PlanarPattern", "SpatialPattern"):
        assert set(json_schema()["$defs"][name]["properties"]) == inside


@pytest.mark.parametrize("name", examples.names())
def test_an_example_written_in_python_is_that_of_its_file(name: str) -> None:
    m = jp.loads(examples.text(name))
    b = rebuilt(m.raw)
    assert b.mechanism() == m
    assert b.mechanism().spec() == m.spec()
    assert jp.loads(b.text()) == m
    # The programs that a user writes say tuples and arrays.
    assert rebuilt(in_arrays(dict(m.raw))).mechanism().spec() == m.spec()


def in_arrays(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: in_arrays(v) for key, v in value.items()}
    if isinstance(value, list) and value and all(type(v) in (int, float) for v in value):
        return np.array(value)
    if isinstance(value, list):
        return tuple(map(in_arrays, value))
    return np.float64(value) if type(value) is float else value


BAD = {
    "a clearance below zero": ("four-bar", ("joints", "J1", "clearance"), {"radial": -1}),
    "a clearance that is not said": ("four-bar", ("joints", "J2", "clearance"), {"radil": 1}),
    "a number that is a text": ("four-bar", ("drives", "theta1", "values"), ["a", 3]),
    "a joint that is not there": ("four-bar", ("drives", "theta1", "joint"), "J9"),
    "a point of three numbers": ("four-bar", ("joints", "J3", "on", "coupler"), [1, 2, 3]),
    "a force that is no number": ("four-bar", ("loads",), [{"force": [0, float("nan")]}]),
    "a body that is not there": ("four-bar", ("output", "body"), "roker"),
    "a key of space": ("four-bar", ("start", "crank"), {"rotation": [0, 0, 1]}),
    "a limit below zero": ("four-bar", ("limits",), {"position": -1}),
    "one body": ("four-bar", ("joints", "J2", "on"), {"crank": [75, 0]}),
    "a unit": ("four-bar", ("units", "length"), "mile"),
    "a variable": ("four-bar", ("variables",), {"a": "b +"}),
    "a joint of a pattern": ("", ("joints",), {"A": {"type": "revolute", "on": {"ground": [0, 0]}}}),
}


def changed(name: str, place: tuple[str, ...], value: object) -> dict[str, Any]:
    """The tables of an example with another value; without a name, in the pattern of one that has some."""
    name = name or next(name for name in examples.names() if "[patterns." in examples.text(name))
    raw = copy.deepcopy(dict(jp.loads(examples.text(name)).raw))
    here = next(iter(raw["patterns"].values())) if "patterns" in raw else raw
    for step in place[:-1]:
        here = here[step]
    here[place[-1]] = value
    return raw


@pytest.mark.parametrize("what", BAD)
def test_messages_are_those_of_the_file(what: str) -> None:
    raw = changed(*BAD[what])
    with pytest.raises(jp.InputError) as of_file:
        jp.Mechanism(raw)
    with pytest.raises(jp.InputError) as of_builder:
        rebuilt(raw).mechanism()
    assert (of_builder.value.key, of_builder.value.problem) == (of_file.value.key, of_file.value.problem)
    # The line that wrote it stands where the name of the file would.
    assert re.fullmatch(r".*test_builder\.py:\d+", of_builder.value.file)


def test_a_message_names_the_line_of_the_call() -> None:
    b = arm()
    line = inspect.currentframe().f_lineno + 1  # type: ignore[union-attr]
    b.revolute("J2", crank=(100, 0), rod=(0, 0), clearance=jp.radial(-0.1))
    with pytest.raises(jp.InputError, match=rf"test_builder\.py:{line}: joints\.J2\.clearance\.radial: .*-0\.1"):
        b.mechanism()


def test_nobody_is_to_blame_for_what_has_not_been_written() -> None:
    with pytest.raises(jp.InputError, match="<builder>: 'joints' is missing"):
        jp.Builder(space="planar", units=UNITS).mechanism()


def test_an_entry_is_written_once() -> None:
    b = arm()
    with pytest.raises(jp.InputError, match=r"joints\.J1: is given again; first in .*test_builder\.py:\d+"):
        b.revolute("J1", ground=(0, 0), crank=(0, 0))
    with pytest.raises(jp.InputError, match="output: is given again"):
        b.output(body="crank")
    with pytest.raises(TypeError, match="a name in joints is text, not 1"):
        b.revolute(1, ground=(0, 0), crank=(0, 0))  # type: ignore[arg-type]


def test_a_slip_in_a_parameter_is_refused_like_a_key_of_the_file() -> None:
    b = arm()
    b.revolute("J2", crank=(100, 0), rod=(0, 0), clearence=jp.radial(0.1))  # type: ignore[arg-type]
    with pytest.raises(jp.InputError, match=r"joints\.J2: 'clearence' is not a key here; did you mean 'clearance'"):
        b.mechanism()


def test_columns_of_tables_are_lists_and_what_has_no_order_is_none() -> None:
    """A generator was read once, and the mechanism could not be changed after that."""
    b = arm()
    b.revolute("J2", crank=pd.Series([100.0, 0.0]), rod=xr.DataArray([0.0, 0.0]))  # type: ignore[arg-type]
    b.drive("q2", joint="J2", values=pd.Series([5.0]))  # type: ignore[arg-type]
    assert b.mechanism().value("joints.J2.on.crank") == [100, 0]
    assert b.mechanism().value("drives.q2.values") == [5]
    for values in ({1.0}, (x for x in [1.0]), {1.0: 2}.keys()):
        b = arm()
        b.revolute("J2", crank=(100, 0), rod=(0, 0))
        b.drive("q2", joint="J2", values=values)  # type: ignore[arg-type]
        with pytest.raises(
            jp.InputError, match=r"test_builder\.py:\d+: drives\.q2\.values: a list in brackets is needed"
        ):
            b.mechanism()


def test_a_body_may_have_the_name_of_a_parameter() -> None:
    b = jp.Builder(space="planar", units=UNITS)
    b.revolute("J1", on={"ground": (0, 0), "at": (0, 0)})
    b.revolute("J2", on={"at": (100, 0)}, rod=(0, 0))
    b.drive("q", joint="J1", values=[0])
    b.drive("p", joint="J2", values=[0])
    b.output(body="rod")
    assert b.mechanism().bodies == ("at", "rod")
    b.revolute("J3", on={"rod": (9, 0)}, rod=(9, 0), tip=(0, 0))
    with pytest.raises(jp.InputError, match=r"joints\.J3: 'rod' is not a key here"):
        b.mechanism()


def test_a_mechanism_does_not_change_with_its_builder() -> None:
    point = [100.0, 0.0]
    b = arm()
    b.load("parked")
    b.load(force=(0, -10))
    b.revolute("J2", crank=point, rod=(0, 0))
    point[0] = 50.0
    b.drive("q", joint="J2", values=np.linspace(0, 30, 4))
    m = b.mechanism()
    b.revolute("J3", rod=(20, 0), tip=(0, 0))
    b.tables()["joints"].clear()
    assert m.joints == ("J1", "J2")
    assert m.value("joints.J2.on.crank") == [100.0, 0.0]
    assert m.load_cases == ("parked",)
    assert m.value("drives.q.values") == [0.0, 10.0, 20.0, 30.0]
    assert list(b.tables()["joints"]) == ["J1", "J2", "J3"]


def test_a_pattern_has_the_parts_that_are_repeated() -> None:
    b = jp.Builder(space="planar", units=UNITS)
    leg = b.pattern("leg", count=3, about={"point": (0, 0)}, shared=["plate"])
    assert isinstance(leg, Pattern)
    leg.revolute("A", ground=(100, 0), crank=(0, 0), clearance=jp.radial(0.02))
    leg.revolute("B", crank=(60, 0), rod=(0, 0))
    leg.revolute("C", rod=(60, 0), plate=(30, 0))
    leg.start("crank", angle=90)
    leg.drive("q", joint="A", values=[120])
    leg.limits(joints={"A": (0, 170)})
    b.start("plate", x=0, y=0, angle=0)
    b.output(body="plate")
    m = b.mechanism()
    assert m.drives == ("q_1", "q_2", "q_3")
    assert m.sources == ("A_1", "A_2", "A_3")


@pytest.mark.parametrize(
    ("short", "long"),
    [
        (jp.radial(0.02, axial=0.05, length=30), {"radial": 0.02, "axial": 0.05, "length": 30}),
        (jp.diametral(0.04, tolerance=0.01), {"diametral": 0.04, "tolerance": 0.01}),
        (jp.gap(0.02, length=40, width=20), {"gap": 0.02, "length": 40, "width": 20}),
        (jp.fit("H7/g6", diameter=12), {"fit": "H7/g6", "diameter": 12}),
        (jp.bearing("C3", bore=25), {"bearing": "C3", "bore": 25}),
        (jp.backlash(0.1), {"backlash": 0.1}),
    ],
)
def test_clearances_in_short(short: Mapping[str, Any], long: Mapping[str, Any]) -> None:
    assert short == long


def types(program: str, folder: Path) -> list[str]:
    """What mypy has to say about a program."""
    path = folder / "program.py"
    path.write_text(textwrap.dedent(program), encoding="utf-8")
    # As the project itself is checked, so that what it remembers of the package is used.
    run = [sys.executable, "-m", "mypy", "--no-error-summary", str(path)]
    return subprocess.run(run, capture_output=True, text=True, check=False, cwd=ROOT).stdout.splitlines()


TYPED = """
    import numpy as np
    import jointplay as jp

    angles = np.linspace(0, 90, 4)
    b = jp.Builder(space="planar", units={"length": "mm", "angle": "deg", "force": "N"})
    b.revolute("J1", ground=(0, 0), crank=np.zeros(2), clearance=jp.radial(0.05))
    b.revolute("J2", crank=[angles[3], 0], rod={"at": (0, 0)}, clearance={"radial": "2 * a", "law": "boundary"})
    b.prismatic("J3", rod=(0, 0), slider={"at": (1, 2), "axis": (1, 0)}, clearance=jp.gap(0.1, length=10))
    b.drive("theta", joint="J1", values=angles, error={"sigma": 0.1})
    m: jp.Mechanism = b.mechanism()
    """


def test_a_type_checker_follows(tmp_path: Path) -> None:
    wrong = """
    b.revolute("J4", rod=(0, 0), slider=(0, 0), clearance={"radil": 0.05})
    b.revolute("J5", rod=(0, 0), slider=(0, 0), clearence=jp.radial(0.05))
    b.drive("q", joint="J2", form=3)
    jp.bearing("C9")
    """
    program = TYPED.rstrip() + wrong
    last = len(program.rstrip().splitlines())
    refused = {int(line.split(":")[1]) for line in types(program, tmp_path) if ": error: " in line}
    assert refused == set(range(last - 3, last + 1))


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ('b.revolute("J4", cl', "clearance="),
        ("b.pri", "prismatic"),
        ('b.drive("q", fr', "from_="),
        ('b.pattern("leg", count=3).sph', "spherical"),
        ("jp.Bui", "Builder"),
    ],
)
def test_an_editor_completes(line: str, offered: str) -> None:
    program = f'import jointplay as jp\nb = jp.Builder(space="planar", units={{}})\n{line}'
    assert offered in [found.name_with_symbols for found in jedi.Script(program).complete()]
