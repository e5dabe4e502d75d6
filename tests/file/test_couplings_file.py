"""Gears, racks, belts, screws and motors of several joints in the mechanism file: keys, messages, closed forms."""

# ruff: noqa: E501 (one mistake a line)
import copy
import functools
import itertools
import math
import re
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import jointplay as jp
from helpers import couplings
from helpers.answers import require_refused
from helpers.builders import planar, spatial
from jointplay import examples
from jointplay.analyses.map.contact import Contacts
from jointplay.cli import run
from jointplay.errors import InputError
from jointplay.file.schema import json_schema

UNITS = 'units = { length = "mm", angle = "deg", force = "N" }\n'
PLANE = f"format = 1\n{UNITS}"
SPACE = f'format = 1\nspace = "spatial"\n{UNITS}'
SHAPES = ("gear", "rack", "belt")

PAIR = """
[joints.A]
type = "revolute"
on = { ground = [0, 0], pinion = [0, 0] }
[joints.B]
type = "revolute"
on = { ground = [30, 0], wheel = [0, 0] }
[joints.G]
type = "gear"
on = { pinion = [0, 0], wheel = [0, 0] }
teeth = [20, 40]
module = 1
clearance = { backlash = 0.1 }
[drives.M]
joint = "A"
values = [0, 100, 720]
[output]
body = "wheel"
at = [20, 0]
[[loads]]
moment = 5
"""
RACK = """
[joints.S]
type = "prismatic"
on = { ground = { at = [0, 0], axis = [1, 0] }, bar = [0, 0] }
[joints.P]
type = "revolute"
on = { ground = [0, 20], pinion = [0, 0] }
[joints.R]
type = "rack"
on = { bar = { at = [0, 0], axis = [1, 0] }, pinion = [0, 0] }
module = 2
teeth = 20
clearance = { backlash = 0.1 }
[drives.M]
joint = "P"
values = [0, 100, 720]
[output]
body = "bar"
[[loads]]
force = [10, 0]
"""
BELT = """
[joints.A]
type = "revolute"
on = { ground = [0, 0], motor = [0, 0] }
[joints.B]
type = "revolute"
on = { ground = [100, 0], arm = [0, 0] }
[joints.T]
type = "belt"
on = { motor = [0, 0], arm = [0, 0] }
radii = [10, 30]
clearance = { slack = [0.1, 0.2] }
[drives.M]
joint = "A"
values = [0, 100, 720]
[output]
body = "arm"
at = [30, 0]
[[loads]]
moment = 5
"""
SCREW = """
[joints.W]
type = "revolute"
bodies = ["ground", "spindle"]
at = [0, 0, 0]
axis = [0, 0, 1]
[joints.S]
type = "screw"
bodies = ["spindle", "nut"]
at = [0, 0, 0]
axis = [0, 0, 1]
lead = 5
clearance = { axial = 0.02 }
[joints.P]
type = "prismatic"
bodies = ["ground", "nut"]
at = [0, 0, 0]
axis = [0, 0, 1]
[drives.M]
joint = "W"
values = [0, 100, 1080]
[output]
body = "nut"
[[loads]]
force = [0, 0, -10]
"""
SPATIAL_PAIR = """
[joints.A]
type = "revolute"
bodies = ["ground", "pinion"]
at = [0, 0, 0]
axis = [0, 0, 1]
[joints.B]
type = "revolute"
bodies = ["ground", "wheel"]
at = [30, 0, 0]
axis = [0, 0, 1]
[joints.G]
type = "gear"
bodies = ["pinion", "wheel"]
at = [[0, 0, 0], [30, 0, 0]]
axis = [0, 0, 1]
teeth = [20, 40]
module = 1
clearance = { backlash = 0.1 }
[drives.M]
joint = "A"
values = [0, 100, 720]
[output]
body = "wheel"
at = [20, 0, 0]
[[loads]]
moment = [0, 0, 5]
"""
MOTOR = """
[joints.A]
type = "revolute"
on = { ground = [0, 0], arm = [0, 0] }
[joints.B]
type = "revolute"
on = { arm = [100, 0], hand = [0, 0] }
[drives.M]
joints = { A = 1.0, B = -0.5 }
values = [0, 20, 40]
error = 0.1
[output]
body = "hand"
at = [50, 0]
[[loads]]
force = [0, 5]
"""
VALIDATOR = jsonschema.Draft202012Validator(json_schema())
#: what the JSON Schema refuses as the program does
REFUSED: dict[str, dict[str, Any]] = {
    "gear": {
        "joints.G.radii": [10, 20],
        "joints.G.teeth": [20, 0],
        "joints.G.clearance": {"backlash": 1, "backlash_angle": 1},
        "joints.G.runout": {"wheel": -1},
        "joints.G.lead": 5,
    },
    "rack": {"joints.R.radius": 20, "joints.R.marks": {"bar": 0, "pinion": 0}},
    "belt": {"joints.T.clearance.slack": [1], "joints.T.pitch": 3},
    "screw": {"joints.S.lead": "5", "joints.S.runout": {"nut": 1}},
    "spatial gear": {"joints.G.at": [0, 0, 0]},
    "motor": {"drives.M.joint": "A", "drives.M.joints": {"A": "1"}},
}
TEXTS = {
    "gear": PLANE + PAIR,
    "rack": PLANE + RACK,
    "belt": PLANE + BELT,
    "screw": SPACE + SCREW,
    "spatial gear": SPACE + SPATIAL_PAIR,
    "motor": PLANE + MOTOR,
}


def load(name: str, **changes: Any) -> jp.Mechanism:
    return jp.loads(TEXTS[name]).with_({key.replace("__", "."): value for key, value in changes.items()})


def degrees(length: float, radius: float) -> float:
    return math.degrees(length / radius)


def turn(result: Any, name: str) -> np.ndarray:
    """The turn of the output, in degrees."""
    component = "angle" if "angle" in result.component else "rz"
    return np.asarray(result[name].sel(component=component).values)


# -- what the file says is what the core gets


@pytest.mark.parametrize("internal", [False, True])
def test_a_pair_from_a_file_is_the_pair_that_the_core_was_tested_with(internal: bool) -> None:
    r"""Every number of it, to the last digit that units leave: poses, offsets, the error under load."""
    apart, inner = (10, "internal = true") if internal else (30, "")
    text = TEXTS["gear"].replace("[30, 0]", f"[{apart}, 0]").replace("module = 1", f"module = 1\n{inner}")
    m = jp.loads(text)
    machine = couplings.pair(internal=internal, torque=0.005)
    machine.source("clearance", 0.05e-3, joint=2)
    machine.length = m.length
    core = machine.core()
    drives = np.radians([[0.0], [100.0], [720.0]])
    solved = core.trace(drives)
    assert np.allclose(jp.solve(m).pose.values[..., 2], np.degrees(solved["poses"][..., 2]), atol=1e-10)
    expected = core.loaded(drives, solved["poses"])
    found = jp.loaded(m)
    assert np.allclose(found.offset.values, 1e3 * expected["offset"], atol=1e-12)
    assert np.allclose(turn(found, "error"), np.degrees(expected["error"][:, 2]), atol=1e-10)


def test_what_a_coupling_says_of_itself_reaches_the_core() -> None:
    m = load(
        "gear",
        joints__G__pressure_angle=25,
        joints__G__marks={"pinion": 9, "wheel": [-1, 0]},
        joints__G__module=None,
        joints__G__radii=[10, 20],
    )
    told = m.spec()["joints"][2]["coupling"]
    assert told["radii"] == [0.01, 0.02]
    assert told["teeth"] == [20, 40]
    assert told["pressure_angle"] == pytest.approx(math.radians(25))
    assert told["marks"] == pytest.approx([math.radians(9), math.pi])
    assert load("gear").spec()["joints"][2]["coupling"]["pressure_angle"] == pytest.approx(math.radians(20))
    told = load("belt", joints__T__distance=101, joints__T__crossed=True).spec()["joints"][2]["coupling"]
    assert told == {"radii": [0.01, 0.03], "teeth": [1, 3], "crossed": True, "distance": 0.101}
    chain = load("belt", joints__T__radii=None, joints__T__teeth=[15, 45], joints__T__pitch=6)
    told = chain.spec()["joints"][2]["coupling"]
    assert told["radii"][0] == pytest.approx(15 * 6e-3 / (2 * math.pi))
    assert load("screw").spec()["joints"][1]["coupling"] == {"lead": 0.005}
    assert load("rack").spec()["joints"][2]["coupling"]["radii"][0] == 0.02


def test_sources_and_parameters_have_names_and_units() -> None:
    m = load(
        "gear", joints__G__ratio_error=0.01, joints__G__runout={"wheel": {"tolerance": 0.02, "deviation": [0.01, 0]}}
    )
    assert m.sources == ("G", "G.ratio", "G.runout.wheel")
    assert m.source_kinds == ("clearance", "ratio", "runout")
    assert m.parameters == ("G.flank", "G.ratio.length", "G.runout.wheel.x", "G.runout.wheel.y")
    assert m.centre.tolist() == [0.0, 0.0, 1e-5, 0.0]
    assert set(jp.loaded(m).parameter_unit.values) == {"mm"}
    assert jp.check(m)["size"].values.tolist() == pytest.approx([0.05, 0.01, 0.02])
    assert load("belt").parameters == ("T.strand",)
    assert load("screw").parameters[0] == "S.along"
    assert load("spatial gear", joints__G__runout={"pinion": 0.02}).parameters[1:] == (
        "G.runout.pinion.side",
        "G.runout.pinion.normal",
    )


def test_backlash_as_an_angle_is_that_of_the_second_body() -> None:
    m = load("gear", joints__G__clearance={"backlash_angle": degrees(0.1, 20)})
    assert m.spec()["sources"][0]["set"]["interval"]["high"] == pytest.approx(0.05e-3)
    rack = load("rack", joints__R__clearance={"backlash_angle": degrees(0.1, 20)})
    assert rack.spec()["sources"][0]["set"]["interval"]["low"] == pytest.approx(-0.05e-3)


@pytest.mark.parametrize("backlash", ["1e-300", "1e-20", "1e-12", "1e-9"])
@pytest.mark.parametrize("name", ["gear", "rack"])
def test_a_trace_of_backlash_is_none(name: str, backlash: str) -> None:
    """Whether flanks pass through each other was decided by the rounding of a pose: some configurations were
    `singular`."""
    m = jp.loads(TEXTS[name].replace("backlash = 0.1", f"backlash = {backlash}"))
    for question in (jp.loaded, jp.worst):
        result = question(m)
        assert (result.status == "ok").all()
    assert np.abs(result.worst_position).max() <= 2 * float(backlash)


def test_keys_with_and_without_a_wildcard() -> None:
    m = load("gear")
    wider = m.with_({"joints.*.clearance.backlash": 0.2})
    assert wider.value("joints.G.clearance.backlash") == 0.2
    as_angle = m.with_({"joints.*.clearance.backlash_angle": 0.3})
    assert as_angle.raw["joints"]["G"]["clearance"] == {"backlash_angle": 0.3}
    assert as_angle.with_({"joints.*.clearance.backlash": 0.1}) == m
    assert m.with_({"joints.G.radii": [10, 20]}).raw["joints"]["G"].keys() & {"module", "radii"} == {"radii"}
    assert load("motor").with_({"drives.M.joint": "A"}).raw["drives"]["M"].get("joints") is None


@pytest.mark.parametrize(
    ("name", "key", "values", "unit"),
    [
        ("gear", "joints.G.clearance.backlash", [0.0, 0.1], "mm"),
        ("gear", "joints.G.clearance.backlash_angle", [0.0, 0.1], "deg"),
        ("gear", "joints.G.ratio_error", [0.0, 0.1], "mm"),
        ("gear", "joints.G.runout.wheel.tolerance", [0.0, 0.1], "mm"),
        ("gear", "joints.G.pressure_angle", [15.0, 20.0], "deg"),
        ("belt", "joints.T.clearance.slack", [0.0, 0.1], "mm"),
        ("screw", "joints.S.clearance.axial", [0.0, 0.1], "mm"),
        ("screw", "joints.S.lead", [2.0, 5.0], "mm"),
        ("motor", "drives.M.joints.B", [-0.5, 0.5], ""),
    ],
)
def test_sweeps_know_the_units(name: str, key: str, values: list[float], unit: str) -> None:
    swept = jp.sweep(load(name), key, values, "loaded", name="along")
    assert (swept.status == "ok").all()
    assert swept["along"].attrs.get("units", "") == unit


@pytest.mark.parametrize("name", TEXTS)
def test_every_question_works_on_it(name: str, tmp_path: Any) -> None:
    m = load(name)
    assert jp.check(m).attrs["decided"] == 1
    assert jp.check(m).attrs["degrees_of_freedom"] == 1
    for question in (jp.solve, jp.loaded, jp.worst, jp.compensate):
        result = question(m)
        assert (result.status == "ok").all(), question.__name__
    if name != "screw":  # its nut is guided more than once
        assert (jp.singularities(m).status == "ok").all()
    assert (jp.random(m, samples=200).status == "ok").all()
    jp.save(jp.loaded(m), tmp_path / "m.json")
    assert (jp.compare(m, m.with_({})).status == "ok").all()
    mapped = jp.map(m.with_({"grid": {"M": {"from": 0, "to": 90, "count": 4}}}), "loaded")
    assert (mapped.status == "ok").all()


@pytest.mark.parametrize("name", TEXTS)
def test_the_terminal_shows_it(name: str, tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.toml"
    path.write_text(TEXTS[name])
    assert run(["check", str(path)]) == 0
    said = capsys.readouterr().out
    assert "1 degree of freedom, 1 drive" in said
    assert run(["error", str(path), "--samples", "200"]) == 0
    if name == "gear":
        assert run(["error", str(path), "-q", "loaded", "--set", "joints.*.clearance.backlash=0.3"]) == 0
        assert f"{degrees(0.15, 20):.4f}" in capsys.readouterr().out


@pytest.mark.parametrize("name", TEXTS)
def test_the_json_schema_takes_it(name: str) -> None:
    data = tomllib.loads(TEXTS[name])
    VALIDATOR.validate(data)
    for path, value in REFUSED.get(name, {}).items():
        changed = copy.deepcopy(data)
        *above, last = path.split(".")
        table = functools.reduce(lambda here, key: here[key], above, changed)
        table[last] = value
        assert not VALIDATOR.is_valid(changed), path


def test_slack_on_one_side_has_contact_on_both_strands() -> None:
    """The strand that starts taut is in contact at an offset of zero; a map counted it as open."""
    contacts = Contacts(load("belt", joints__T__clearance={"slack": [0, 0.2]}))
    taut, other = contacts.states(np.array([[0.0], [0.2]]))
    assert (taut, other) == (pytest.approx([-1.0]), pytest.approx([1.0]))
    assert contacts.change(taut, other)


# -- closed forms


@pytest.mark.parametrize("name", ["gear", "spatial gear"])
def test_a_wheel_turns_by_the_ratio_and_loses_its_backlash(name: str) -> None:
    m = load(name)
    result = jp.solve(m)
    angles = [0.0, -50.0, -360.0]
    if name == "gear":
        assert np.allclose(turn(result, "nominal"), angles, atol=1e-9)
    assert np.allclose(result.coordinate.sel(joint="B").values[:2], angles[:2], atol=1e-9)
    lost = degrees(0.05, 20)
    assert np.allclose(turn(jp.loaded(m), "error"), lost, atol=1e-9)
    worst = jp.worst(m)
    component = "angle" if name == "gear" else "rz"
    assert np.allclose(worst.worst_component.sel(component=component).values, [[-lost, lost]] * 3, atol=1e-9)


def test_a_rack_goes_by_the_roll_of_its_pinion() -> None:
    m = load("rack")
    result = jp.solve(m)
    way = result.nominal.sel(component="x").values
    assert np.allclose(way, 20.0 * np.radians([0.0, 100.0, 720.0]), atol=1e-9)
    assert np.allclose(jp.loaded(m).error.sel(component="x").values, 0.05, atol=1e-12)
    back = m.with_({"loads.0.force": [-10, 0]})
    assert np.allclose(jp.loaded(back).error.sel(component="x").values, -0.05, atol=1e-12)


@pytest.mark.parametrize("crossed", [False, True])
def test_a_belt_turns_its_pulleys_and_has_slack_by_side(crossed: bool) -> None:
    m = load("belt", joints__T__crossed=crossed)
    sense = -1.0 if crossed else 1.0
    assert np.allclose(turn(jp.solve(m), "nominal"), sense * np.array([0.0, 100.0, 720.0]) / 3.0, atol=1e-9)
    there = turn(jp.loaded(m), "error")
    back = turn(jp.loaded(m.with_({"loads.0.moment": -5.0})), "error")
    found = sorted([abs(float(there[0])), abs(float(back[0]))])
    assert found == pytest.approx([degrees(0.1, 30), degrees(0.2, 30)], abs=1e-9)
    assert there[0] > 0.0 > back[0]


def test_a_screw_goes_its_lead_and_loses_its_axial_play() -> None:
    m = load("screw")
    result = jp.solve(m)
    assert np.allclose(result.nominal.sel(component="z").values, -5.0 * np.array([0.0, 100.0, 1080.0]) / 360.0)
    assert np.allclose(result.coordinate.sel(joint="S").values, [0.0, -100.0, -1080.0]), "whole turns count"
    assert np.allclose(jp.loaded(m).error.sel(component="z").values, -0.02, atol=1e-12)
    driven = m.with_({"drives.M.joint": "S"})
    assert np.allclose(jp.solve(driven).coordinate.sel(joint="P").values, 5.0 * np.array([0.0, 100.0, 1080.0]) / 360.0)
    left = m.with_({"joints.S.lead": -5.0})
    assert jp.solve(left).nominal.sel(component="z").values[1] > 0.0


@pytest.mark.parametrize(
    ("name", "key", "force", "radius"),
    [("gear", "flank", 5 / 20, 20), ("belt", "strand", 5 / 30, 30), ("spatial gear", "flank", 5 / 20, 20)],
)
def test_what_bends_under_a_force_at_the_rim_turns_the_wheel_further(
    name: str, key: str, force: float, radius: float
) -> None:
    joint = "T" if name == "belt" else "G"
    rigid, elastic = load(name), load(name, **{f"joints__{joint}__stiffness": {key: 100.0}})
    more = turn(jp.loaded(elastic), "error") - turn(jp.loaded(rigid), "error")
    assert np.allclose(more, degrees(force / 100.0, radius), rtol=1e-3)


def test_what_bends_under_a_force_along_a_rack_or_screw_moves_it_further() -> None:
    rack = load("rack", joints__R__stiffness={"flank": 100.0})
    assert np.allclose(jp.loaded(rack).error.sel(component="x").values, 0.05 + 0.1, atol=1e-9)
    screw = load("screw", joints__S__stiffness={"axial": 100.0})
    assert np.allclose(jp.loaded(screw).error.sel(component="z").values, -0.02 - 0.1, atol=1e-9)


def planetary(planets: int, *, sun: int = 20, planet: int = 16, ring_turns: bool = False) -> jp.Builder:
    ring, a = sun + 2 * planet, (sun + planet) / 2
    b = planar()
    b.revolute("C", ground=(0, 0), carrier=(0, 0))
    b.revolute("A", ground=(0, 0), sun=(0, 0))
    outer = "ring" if ring_turns else "ground"
    if ring_turns:
        b.revolute("O", ground=(0, 0), ring=(0, 0))
    mesh = {"module": 1, "clearance": jp.backlash(0.1)}
    for k in range(planets):
        x, y = a * math.cos(2 * math.pi * k / planets), a * math.sin(2 * math.pi * k / planets)
        body = f"planet{k}"
        b.revolute(f"P{k}", on={"carrier": [x, y], body: [0, 0]})
        b.gear(f"S{k}", on={"sun": [0, 0], body: [0, 0]}, teeth=[sun, planet], **mesh)
        b.gear(f"R{k}", on={body: [0, 0], outer: [0, 0]}, teeth=[planet, ring], internal=True, **mesh)
    b.drive("sun", joint="A", values=[0, 90, 360])
    if ring_turns:
        b.drive("ring", joint="O", values=[0, -30, 100])
    b.output(body="carrier", at=(18, 0))
    b.load(moment=-100)
    return b


def joint(name: str, kind: str, **keys: object) -> str:
    return f'[joints.{name}]\ntype = "{kind}"\n' + "".join(f"{key} = {value}\n" for key, value in keys.items())


@pytest.mark.parametrize("planets", [1, 3])
def test_a_planetary_gear_follows_willis(planets: int) -> None:
    m = planetary(planets).mechanism()
    sun, ring = 20, 52
    assert np.allclose(turn(jp.solve(m), "nominal"), np.array([0.0, 90.0, 360.0]) * sun / (sun + ring), atol=1e-8)
    assert jp.check(m).attrs["redundancy"] == planets - 1
    # Both meshes of a planet lose half their backlash: together at the sun and the ring, over both radii.
    lost = -degrees(0.05 + 0.05, 10 + 26)
    loaded = jp.loaded(m)
    assert (loaded.status == "ok").all()
    assert np.allclose(turn(loaded, "error"), lost, atol=1e-6)


def test_a_planetary_gear_adds_sun_and_ring() -> None:
    m = planetary(1, ring_turns=True).mechanism()
    turned = (20 * np.array([0.0, 90.0, 360.0]) + 52 * np.array([0.0, -30.0, 100.0])) / 72
    assert np.allclose(turn(jp.solve(m), "nominal"), turned, atol=1e-8)
    assert jp.check(m).attrs["degrees_of_freedom"] == 2


@pytest.mark.parametrize("ring_turns", [False, True])
@pytest.mark.parametrize(("sun", "planets"), [(20, 3), (20, 4), (21, 2), (21, 3), (22, 3), (20, 5)])
def test_planets_are_where_their_teeth_meet_sun_and_ring(sun: int, planets: int, ring_turns: bool) -> None:
    """Equally spaced planets need a sum of sun and ring that their number divides. Every mesh alone was taken to fit as
    it started, so that a gear was computed that nobody can assemble."""
    b = planetary(planets, sun=sun, ring_turns=ring_turns)
    if (sun + sun + 32) % planets == 0:
        assert (jp.solve(b.mechanism()).status == "ok").all()
        return
    with pytest.raises(
        InputError, match=r"joints\.R1: the teeth of 'planet1' and '(ring|ground)' miss each other by 0\.[34]"
    ):
        b.mechanism()


def test_marks_tell_where_the_teeth_of_a_loop_are() -> None:
    """A mark that is half a tooth off at the last mesh of a loop is refused."""
    m = planetary(2).mechanism()
    assert m.with_({"joints.R1.marks": {"planet1": 0, "ground": 0}})
    with pytest.raises(InputError, match=r"miss each other by 0\.5 of a tooth"):
        m.with_({"joints.R1.marks": {"planet1": 0, "ground": 180.0 / 52}})


def test_redundant_meshes_are_named_by_their_flanks() -> None:
    mobility = jp.model.mobility.examine(planetary(3).mechanism())
    assert {name.rpartition(".")[2] for name in mobility.redundant_constraints if name[0] in "SR"} == {"flank"}


def train(
    teeth: list[int], angles: list[float], backlash: list[float], play: float = 0.0, turns: float = 90.0
) -> jp.Mechanism:
    """Wheels in a row on bearings of the ground, each meshing with the next."""
    b, at = planar(), 0j
    for k, z in enumerate(teeth):
        if k:
            at += (teeth[k - 1] + z) / 2 * complex(math.cos(angles[k - 1]), math.sin(angles[k - 1]))
        clearance = jp.radial(play) if play else None
        b.revolute(f"J{k}", on={"ground": [at.real, at.imag], f"w{k}": [0, 0]}, clearance=clearance)
    for k, pair in enumerate(itertools.pairwise(teeth)):
        on = {f"w{k}": [0, 0], f"w{k + 1}": [0, 0]}
        b.gear(f"G{k}", on=on, teeth=pair, module=1, clearance=jp.backlash(backlash[k]))
    b.drive("M", joint="J0", values=[0, turns])
    b.output(body=f"w{len(teeth) - 1}", at=(teeth[-1] / 2, 0))
    b.load(moment=50)
    return b.mechanism()


def test_the_lost_motion_of_a_train_is_the_sum_of_its_backlashes_over_the_ratios() -> None:
    teeth, backlash = [20, 40, 16, 48], [0.05, 0.08, 0.1]
    m = train(teeth, [0.3, -0.4, 1.0], backlash)
    # In a row, a length at one pitch circle is the same length at the next.
    lost = degrees(sum(backlash) / 2, 24)
    assert np.allclose(turn(jp.loaded(m), "error"), lost, atol=1e-9)
    assert np.allclose(jp.worst(m).worst_rotation.values, lost, atol=1e-9)
    assert np.allclose(turn(jp.solve(m), "nominal"), [0.0, -90.0 * 20 / 48], atol=1e-9)


@pytest.mark.parametrize(("share", "status"), [(0.2, "singular"), (0.97, "singular"), (1.03, "ok"), (3.0, "ok")])
def test_a_load_that_presses_wheels_together_jams_their_teeth_if_the_backlash_is_too_small(
    share: float, status: str
) -> None:
    """Backlash of 0.001 mm beside bearings with 0.01 mm: the forces of one flank bring the centres nearer than the teeth
    allow, so that both flanks would carry, whose shares nothing tells."""
    play, alpha, along = 0.01, math.radians(20), np.array([math.cos(1), math.sin(1)])
    # Statics: 50 N mm at a radius of 6 mm. Without backlash only the tangential force of the outer meshes is known.
    tangential = 50 / 6
    inner = tangential * (np.array([along[1], -along[0]]) + math.tan(alpha) * along)
    bearing = inner - np.array([0, tangential])
    nearer = -2 * play * float(bearing @ along) / float(np.linalg.norm(bearing))
    least = 2 * nearer * math.tan(alpha)
    assert least == pytest.approx(0.0043, abs=1e-4)
    found = jp.loaded(train([12] * 4, [0, 1, 0], [0, share * least, 0], play, 0))
    assert (found.status == status).all()
    if status == "ok":
        places = [found.offset.sel(parameter=[f"J{k}.x", f"J{k}.y"]).values[0] for k in (1, 2)]
        assert -(places[1] - places[0]) @ along == pytest.approx(nearer, rel=0.01)


trains = st.integers(2, 4).flatmap(
    lambda n: st.tuples(
        st.lists(st.integers(12, 60), min_size=n, max_size=n),
        st.lists(st.floats(-1.2, 1.2), min_size=n - 1, max_size=n - 1),
        st.lists(st.integers(0, 200).map(lambda k: k / 1000), min_size=n - 1, max_size=n - 1),
        st.sampled_from([0.0, 0.01, 0.05]),
        st.floats(-200.0, 200.0),
    )
)


@settings(max_examples=25, deadline=None)
@given(trains)
def test_given_reproduces_the_offsets_of_other_questions_on_any_train(drawn: tuple[Any, ...]) -> None:
    m = train(*drawn)
    loaded, worst = jp.loaded(m), jp.worst(m)
    _, _, backlash, play, _ = drawn
    if any(0 < b < 4 * play * math.tan(math.radians(20)) for b in backlash):
        # Two bearings may bring the centres nearer than the teeth allow.
        assert set(loaded.status.values) <= {"ok", "singular"}
        return
    assert (loaded.status == "ok").all()
    assert np.isfinite(loaded.error.values).all()
    again = jp.given(m, loaded.offset)
    assert np.allclose(again.error.values, loaded.error.values, atol=1e-9)
    assert again.admissible.all()
    assert np.isfinite(worst.worst_position.values).all()
    offset = worst.worst_offset.sel(extreme="rotation").drop_vars("extreme")
    again = jp.given(m, offset)
    assert np.allclose(np.abs(turn(again, "error")), worst.worst_rotation.values, atol=1e-8)


def floating(**guide: Any) -> jp.Mechanism:
    """A spindle in a bearing with play, whose nut moves a stage along a guide."""
    b, up = spatial(), (0, 0, 1)
    bearing = jp.radial(0.01, axial=0.005, length=20)
    b.revolute("bearing", bodies=["ground", "spindle"], at=(0, 0, 0), axis=up, clearance=bearing)
    b.prismatic("guide", bodies=["ground", "stage"], at=(50, 0, 100), axis=up, **guide)
    b.revolute("nut_bearing", bodies=["stage", "nut"], at=(0, 0, 100), axis=up)
    thread = jp.radial(0.02, axial=0.01, length=30)
    b.screw("thread", bodies=["spindle", "nut"], at=(0, 0, 100), axis=up, lead=5, clearance=thread)
    b.drive("motor", joints={"bearing": 1, "nut_bearing": -1}, values=[0, 180, 720])
    b.output(body="stage", at=(0, 0, 100))
    b.load(body="stage", at=(0, 0, 100), force=(0, 0, -100))
    return b.mechanism()


def test_a_spindle_that_floats_leaves_its_stage_determined() -> None:
    """Nothing centres the spindle in its bearing and nut, and the stage does not feel where it is. It never came to
    rest, so that the status was `undetermined` with a half-width of zero."""
    result = jp.loaded(floating(clearance=jp.gap(0.01, length=40, width=30, height=30)))
    assert (result.status == "ok").all()
    assert not result.undetermined.values.any()
    assert not result.decided.sel(source="bearing").any()
    # Bearing and thread give way along the axis; their torque turns the guide, which is 50 mm away.
    assert np.allclose(result.error.sel(component="z"), -0.015, atol=1e-3)
    # A guide of 30 mm turns by its gap over half its width.
    assert np.allclose(np.abs(result.error.sel(component="rz")), degrees(0.01, 15), atol=1e-6)


def test_a_rotation_of_nothing_is_nobodys_fault(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    """The stage of a rigid guide cannot turn; the thread was to blame for 258 per cent of the rounding."""
    path = tmp_path / "stage.toml"
    floating().write(path)
    assert run(["error", str(path), "-q", "worst"]) == 0
    said = capsys.readouterr().out
    rows = [line for line in said.splitlines() if re.match(r" +\d .*67 %", line)]
    assert len(rows) == 3
    assert "No rotation at any configuration." in said
    assert all(row.count("%") == 1 for row in rows)


# -- motors


def test_a_motor_moves_its_joints_by_their_coefficients() -> None:
    m = load("motor")
    assert np.allclose(jp.solve(m).coordinate.values, np.outer([0.0, 20.0, 40.0], [1.0, -0.5]), atol=1e-9)
    # The motor is off by 0.1 deg, the hand by half of it.
    worst = jp.worst(m).worst_rotation.values
    assert np.allclose(worst, 0.05, atol=1e-9)
    assert jp.given(m, deviations={"M": 0.1}).error.sel(component="angle").values == pytest.approx([0.05] * 3)
    assert jp.check(m).driven_joint.item() == "A, B"


def test_a_motor_may_turn_one_joint_and_slide_another() -> None:
    text = PLANE + joint("A", "revolute", on="{ ground = [0, 0], arm = [0, 0] }")
    text += joint("S", "prismatic", on="{ arm = { at = [0, 0], axis = [1, 0] }, rod = [0, 0] }")
    text += '[drives.M]\njoints = { A = 1, S = 0.5 }\nvalues = [0, 90]\n[output]\nbody = "rod"\n'
    m = jp.loads(text)
    assert np.allclose(jp.solve(m).coordinate.values, [[0.0, 0.0], [90.0, 45.0]], atol=1e-9)
    assert jp.solve(m).M.attrs["units"] == "deg"
    # The first joint says whether the motor's values are angles or lengths.
    other = jp.loads(text.replace("A = 1, S = 0.5", "S = 0.5, A = 1"))
    assert np.allclose(jp.solve(other).coordinate.values, [[0.0, 0.0], [90.0, 45.0]], atol=1e-9)
    assert jp.solve(other).M.attrs["units"] == "mm"


def test_a_path_is_followed_by_a_motor() -> None:
    m = load("motor", drives__M__values=None, path={"angle": [5.0, 10.0]})
    result = jp.solve(m)
    assert np.allclose(result.M.values, [10.0, 20.0], atol=1e-6)
    assert np.allclose(result.coordinate.values, [[10.0, -5.0], [20.0, -10.0]], atol=1e-6)


def test_a_motor_is_held_while_its_mechanism_is_assembled() -> None:
    m = load("motor", assembly={"steps": [["arm"], ["hand"]]}, joints__B__clearance={"radial": 0.02})
    found = jp.assemble(m)
    assert (found.status == "ok").all()
    assert found.mobility.values.tolist() == [0, 0]


def test_a_motor_on_joints_that_gears_tie_already_is_one_too_many() -> None:
    fitting = load("gear", drives__M={"joints": {"A": 1.0, "B": -0.5}, "values": [0.0, 10.0]})
    assert (
        "'M' commands joints that others tie to each other already; drive one of them"
        in jp.check(fitting).attrs["mobility"]
    )


# -- assembly


def test_a_gear_is_assembled_like_any_other_joint() -> None:
    m = load("gear", assembly={"steps": [["pinion"], ["wheel"]]}, joints__G__runout={"wheel": 0.02})
    for question in ("unit", "worst", "random"):
        assert (jp.assemble(m, question).status == "ok").all()
    turned = load("gear", assembly={"base": "wheel", "steps": [["pinion"], ["ground"]]}, loads__0__body="pinion")
    # Only teeth hold the pinion until the frame comes: one of its three freedoms.
    assert jp.assemble(turned).mobility.values.tolist() == [2, 0]


# -- the start


def test_teeth_mesh_as_they_start_whatever_is_commanded() -> None:
    m = load("spatial gear", drives__M__values=[30.0, 40.0])
    assert np.allclose(jp.solve(m).coordinate.sel(joint="B").values, [-15.0, -20.0])
    text = (
        TEXTS["spatial gear"]
        .replace("at = [[0, 0, 0], [30, 0, 0]]", "")
        .replace(
            'bodies = ["pinion", "wheel"]', "on = { pinion = { at = [0, 0, 0], axis = [0, 0, 1] }, wheel = [30, 0, 0] }"
        )
    )
    text = text.replace("axis = [0, 0, 1]\nteeth", "teeth")
    assert np.allclose(jp.solve(jp.loads(text)).coordinate.sel(joint="B").values[:2], [0.0, -50.0])


def test_marks_say_where_the_teeth_mesh() -> None:
    """With the wheel marked half a tooth on, it stands half a tooth off where the pinion is at zero."""
    marked = load("gear", joints__G__marks={"pinion": 0.0, "wheel": 4.5})
    assert abs(turn(jp.solve(marked), "nominal")[0]) == pytest.approx(4.5)


def test_a_wheel_counts_for_the_size_of_a_mechanism() -> None:
    m = planetary(1).mechanism()
    assert m.length == pytest.approx(0.02, rel=0.9)
    assert m.length > 0.01


# -- mistakes

MISTAKES: dict[str, tuple[str, str, str, str, str]] = {
    "neither module nor radii": ("gear", "module = 1", "", "joints.G", "module (pitch diameter over tooth count) or radii"),
    "module and radii": ("gear", "module = 1", "module = 1\nradii = [10, 20]", "joints.G", "(pitch radii), not both"),
    "no teeth": ("gear", "teeth = [20, 40]", "", "joints.G", "'teeth' is missing (tooth counts"),
    "one tooth count": ("gear", "[20, 40]", "[20]", "joints.G.teeth", "two values are needed, not [20]"),
    "no tooth": ("gear", "[20, 40]", "[0, 40]", "joints.G.teeth.0", "must be at least 1: 0"),
    "half a tooth": ("gear", "[20, 40]", "[20.5, 40]", "joints.G.teeth.0", "a whole number is needed, not 20.5"),
    "too many teeth": ("gear", "[20, 40]", "[20, 40000]", "joints.G.teeth.1", "must be at most 10000: 40000"),
    "module of zero": ("gear", "module = 1", "module = 0", "joints.G.module", "must be greater than zero: 0"),
    "radii in another ratio": ("gear", "module = 1", "radii = [10, 21]", "joints.G", "the second is 20, not 21"),
    "a small ring": ("gear", "teeth = [20, 40]", "internal = true\nteeth = [40, 20]", "joints.G", "'wheel' has 20 and 'pinion' 40"),
    "a ring like the planet": ("gear", "teeth = [20, 40]", "internal = true\nteeth = [20, 20]", "joints.G", "the second body is the ring"),
    "internal as a word": ("gear", "module = 1", 'module = 1\ninternal = "yes"', "joints.G.internal", 'true or false is needed, not "yes"'),
    "three wheels": ("gear", "on = { pinion = [0, 0], wheel = [0, 0] }", "on = { a = [0, 0], b = [0, 0], wheel = [0, 0] }", "joints.G", "a gear joint connects two bodies, not a, b, wheel"),
    "an axis in the plane": ("gear", "on = { pinion = [0, 0],", "on = { pinion = { at = [0, 0], axis = [1, 0] },", "joints.G", "a gear joint in the plane has no axis; take it from 'pinion'"),
    "a steep flank": ("gear", "module = 1", "module = 1\npressure_angle = 90", "joints.G.pressure_angle", "is at most 45 deg, beyond which teeth have no tips; not 90"),
    "a flank that is hardly one": ("rack", "module = 2", "module = 2\npressure_angle = 89.999", "joints.R.pressure_angle", "is at most 45 deg"),
    "run-out beyond the teeth": ("gear", "module = 1", "module = 1\nrunout = { wheel = { tolerance = 2, deviation = [0.3, 0.4] } }", "joints.G.runout.wheel", "off its centre by up to 2.5 mm, more than the height of its teeth, 2.25 mm"),
    "run-out beyond a pulley": ("belt", "radii =", "runout = { arm = 31 }\nradii =", "joints.T.runout.arm", "by up to 31 mm, more than its pitch radius, 30 mm"),
    "a bearing askew": ("spatial gear", "axis = [0, 0, 1]", "axis = [0, 1, 1]", "joints.G", "teeth of 'pinion' are about [0, 0, 1] through [0, 0, 0], and it turns in 'A' about [0, 0.707107, 0.707107]"),
    "backlash twice": ("gear", "{ backlash = 0.1 }", "{ backlash = 0.1, backlash_angle = 1 }", "joints.G.clearance", "(an angle of the second body), not both"),
    "no backlash": ("gear", "{ backlash = 0.1 }", "{}", "joints.G.clearance", "give backlash (an arc at the pitch circle"),
    "a number for backlash": ("gear", "{ backlash = 0.1 }", "0.1", "joints.G.clearance", "{ backlash = 0.1 } (arc at the pitch circle"),
    "backlash that scatters": ("gear", "{ backlash = 0.1 }", "{ backlash = 0.1, tolerance = 0.01 }", "joints.G.clearance", "the size of a coupling's play does not scatter; give its largest value"),
    "radial play of teeth": ("gear", "{ backlash = 0.1 }", "{ radial = 0.1 }", "joints.G.clearance", "'radial' is not a key here"),
    "negative backlash": ("gear", "backlash = 0.1", "backlash = -0.1", "joints.G.clearance.backlash", "must not be negative: -0.1"),
    "backlash of half a tooth": ("gear", "backlash = 0.1", "backlash = 1.6", "joints.G.clearance", "1.6 mm of backlash is half of 3.142 mm or more"),
    "an elastic mesh": ("gear", "module = 1", "module = 1\nstiffness = { normal = 1 }", "joints.G.stiffness", "'normal' is not a key here; known: flank"),
    "run-out of a stranger": ("gear", "module = 1", "module = 1\nrunout = { weel = 0.1 }", "joints.G", "runout: 'weel' is not a wheel of this joint; did you mean 'wheel'?"),
    "run-out of a rack": ("rack", "module = 2", "module = 2\nrunout = { bar = 0.1 }", "joints.R", "runout: 'bar' is not a wheel of this joint; known: pinion"),
    "run-out in two directions": ("gear", "module = 1", "module = 1\nrunout = { wheel = [1, 2] }", "joints.G.runout.wheel", "0.02 or { tolerance = 0.02, deviation = [0, 0] } is needed"),
    "run-out misspelt": ("gear", "module = 1", "module = 1\nrunout = { wheel = { toleranc = 1 } }", "joints.G.runout.wheel", "did you mean 'tolerance'?"),
    "ratio error as text": ("gear", "module = 1", 'module = 1\nratio_error = "small"', "joints.G.ratio_error", "0.01 or { tolerance = 0.01"),
    "ratio error without bound": ("gear", "module = 1", "module = 1\nratio_error = 1e3", "joints.G.ratio_error", "more than the size of the mechanism"),
    "one mark": ("gear", "module = 1", "module = 1\nmarks = { wheel = 3 }", "joints.G", "marks is a direction on each of the two bodies: { pinion = ..., wheel = ... }"),
    "wheels too far apart": ("gear", "[30, 0]", "[40, 0]", "joints.G", "'pinion' and 'wheel' are 40 mm apart; with pitch radii of 10 and 20 mm they mesh at 30 mm"),
    "teeth that overlap": ("gear", "[30, 0]", "[29.8, 0]", "joints.G", "they mesh at 30 mm, and here their teeth overlap: more than 0.1"),
    "a driven mesh": ("gear", 'joint = "A"', 'joint = "G"', "drives.M.joint", "'G' is a gear joint and has no coordinate to drive; joints that have one: A, B"),
    "a limited mesh": ("gear", "[[loads]]", "[limits]\njoints = { G = [0, 1] }\n[[loads]]", "limits.joints.G", "'G' is a gear joint and has no coordinate to limit"),
    "a wheel without a bearing": ("gear", 'type = "revolute"\non = { ground = [30, 0], wheel = [0, 0] }', 'type = "revolute"\non = { ground = [30, 0], other = [0, 0] }', "joints", "only gears, racks or belts connect 'wheel' to the rest"),
    "two points without two places": ("gear", "on = { pinion = [0, 0], wheel = [0, 0] }", 'bodies = ["pinion", "wheel"]\nat = [0, 0]', "joints.G.at.0", "a list in brackets is needed, not 0"),
    "no places": ("gear", "on = { pinion = [0, 0], wheel = [0, 0] }", 'bodies = ["pinion", "wheel"]', "joints.G", "a point for each of the two bodies, [[x, y], [x, y]]"),
    "screw in the plane": ("gear", 'type = "gear"', 'type = "screw"', "joints.G", '"screw" is a joint in space; in the plane there are revolute'),
    "rack without an axis": ("rack", "bar = { at = [0, 0], axis = [1, 0] }, pinion", "bar = [0, 0], pinion", "joints.R", "its first body needs an axis: bar = { at = [x, y], axis"),
    "pinion with an axis": ("rack", "pinion = [0, 0] }\nmodule", "pinion = { at = [0, 0], axis = 1 } }\nmodule", "joints.R", "take it from the pinion on 'pinion'"),
    "rack without a size": ("rack", "module = 2\n", "", "joints.R", "radius (pitch radius) or module with teeth"),
    "rack with two sizes": ("rack", "module = 2\n", "module = 2\nradius = 20\n", "joints.R", "module with teeth, not both"),
    "rack with a module alone": ("rack", "teeth = 20\n", "", "joints.R", "'teeth' is missing (tooth count of the pinion"),
    "rack too far away": ("rack", "ground = [0, 20]", "ground = [0, 60]", "joints.R", "starts 60 mm from the pitch line of the rack; its pitch radius is 20 mm"),
    "a rack whose teeth overlap": ("rack", "ground = { at = [0, 0], axis", "ground = { at = [0, 1], axis", "joints.R", "a guide holds the centre of 'pinion' 19 mm from the pitch line of the rack; with a pitch radius of 20 mm their teeth overlap: more than 0.7279 mm"),
    "a rack whose teeth overlap on its bar": ("rack", "bar = { at = [0, 0], axis = [1, 0] }, pinion", "bar = { at = [3, 1], axis = [-1, 0] }, pinion", "joints.R", "19 mm from the pitch line of the rack"),
    "belt without a size": ("belt", "radii = [10, 30]", "", "joints.T", "radii = [first, second] (pitch radii) or pitch with teeth"),
    "belt with two sizes": ("belt", "radii = [10, 30]", "radii = [10, 30]\npitch = 3", "joints.T", "pitch with teeth, not both"),
    "belt with a pitch alone": ("belt", "radii = [10, 30]", "pitch = 3", "joints.T", "'teeth' is missing (tooth counts of both pulleys"),
    "belt of no ratio": ("belt", "radii = [10, 30]", "radii = [10, 31.41592653589793]", "joints.T", "are in no ratio of whole numbers up to 1000"),
    "belt in another ratio": ("belt", "radii = [10, 30]", "radii = [10, 30]\nteeth = [10, 31]", "joints.T", "the second is 31, not 30"),
    "negative slack": ("belt", "slack = [0.1, 0.2]", "slack = [-0.1, 0.2]", "joints.T.clearance.slack.0", "must not be negative: -0.1"),
    "no slack": ("belt", "{ slack = [0.1, 0.2] }", "{}", "joints.T.clearance", "'slack' is missing (travel at the rim to either side"),
    "slack of half a turn": ("belt", "slack = [0.1, 0.2]", "slack = 20", "joints.T.clearance", "40 mm of slack to both sides is half of 62.83 mm or more"),
    "pulleys in each other": ("belt", "[100, 0]", "[15, 0]", "joints.T", "are 15 mm apart at the start; a belt around both needs more than 20 mm"),
    "a short belt": ("belt", "radii = [10, 30]", "radii = [10, 30]\ndistance = 15", "joints.T.distance", "are 15 mm apart; a belt around both needs more than 20 mm"),
    "no lead": ("screw", "lead = 5", "", "joints.S", "'lead' is missing (travel of the second body"),
    "lead of zero": ("screw", "lead = 5", "lead = 0", "joints.S", "lead = 0 moves nothing"),
    "screw without length": ("screw", "{ axial = 0.02 }", "{ radial = 0.02 }", "joints.S.clearance", "'length' is missing (length of the pin inside its hole"),
    "screw with two radii": ("screw", "{ axial = 0.02 }", "{ radial = 0.02, diametral = 0.04, length = 10 }", "joints.S.clearance", "radial or diametral, not both"),
    "axial play of a quarter of the lead": ("screw", "axial = 0.02", "axial = 1.25", "joints.S.clearance", "1.25 mm to each side is a quarter of the lead of 5 mm"),
    "an elastic screw": ("screw", "lead = 5", "lead = 5\nstiffness = {}", "joints.S.stiffness", "say what gives: one or more of radial, tilt, axial"),
    "gear in space without an axis": ("spatial gear", "axis = [0, 0, 1]\nteeth", "teeth", "joints.G", "its first body needs an axis: axis, beside `at`"),
    "bevel gears": ("spatial gear", 'bodies = ["pinion", "wheel"]\nat = [[0, 0, 0], [30, 0, 0]]\naxis = [0, 0, 1]', "on = { pinion = { at = [0, 0, 0], axis = [0, 0, 1] }, wheel = { at = [30, 0, 0], axis = [0, 1, 0] } }", "joints.G", "at the start they are 90 deg apart"),
    "axes against each other": ("spatial gear", 'bodies = ["pinion", "wheel"]\nat = [[0, 0, 0], [30, 0, 0]]\naxis = [0, 0, 1]', "on = { pinion = { at = [0, 0, 0], axis = [0, 0, 1] }, wheel = { at = [30, 0, 0], axis = [0, 0, -1] } }", "joints.G", "180 deg apart; turn the axis of one of them round"),
    "a rack in space without a side": ("spatial gear", 'type = "gear"\nbodies = ["pinion", "wheel"]\nat = [[0, 0, 0], [30, 0, 0]]\naxis = [0, 0, 1]\nteeth = [20, 40]\nmodule = 1', 'type = "rack"\nbodies = ["pinion", "wheel"]\nat = [[0, 0, 0], [30, 0, 0]]\naxis = [0, 0, 1]\nradius = 30', "joints.G", "side is missing: side, beside `at`"),
    "a drive of nothing": ("motor", "joints = { A = 1.0, B = -0.5 }", "", "drives.M", "'joint' is missing (the joint whose coordinate"),
    "a drive of no joint": ("motor", "joints = { A = 1.0, B = -0.5 }", "joints = {}", "drives.M", "joints is empty"),
    "a drive twice": ("motor", "joints = {", 'joint = "A"\njoints = {', "drives.M", "give joint, or joints with the coefficient of each; not both"),
    "a coefficient of zero": ("motor", "B = -0.5", "B = 0", "drives.M", "joints.B = 0 moves nothing"),
    "a coefficient as text": ("motor", "B = -0.5", 'B = "-0.5"', "drives.M.joints.B", 'a number is needed, not "-0.5"'),
    "a motor on an unknown joint": ("motor", "B = -0.5", "C = -0.5", "drives.M.joints.C", "'C' is not a joint; known: A, B"),
    "a joint that two drives move": ("motor", "[output]", '[drives.N]\njoint = "B"\nvalues = [1]\n[output]', "drives.N.joint", "'B' is already driven by 'M'"),
    "a dimension that parts a wheel from its bearing": ("gear", "[output]", 'runout = 1\n[output]', "drives.M", "'runout' is not a key here"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named_with_its_place_and_what_is_valid(mistake: str) -> None:
    example, old, new, key, said = MISTAKES[mistake]
    require_refused(TEXTS[example], old, new, key, said)


def test_a_dimension_moves_a_wheel_that_runs_out_with_its_bearing() -> None:
    """A file was refused because the wheel of such a bearing has a place of its own."""
    pin = joint("D", "pin_in_slot", on="{ wheel = { at = [15, 0], axis = 0 }, slider = [0, 0] }")
    pin += joint("E", "prismatic", on="{ ground = { at = [45, 0], axis = 90 }, slider = [0, 0] }")
    text = TEXTS["gear"].replace("[drives.M]", f"{pin}[drives.M]")
    length = '[dimensions.l]\nbody = "wheel"\nbetween = ["D", "B"]\ntolerance = 0.01\ndeviation = 0.004\n'
    plain = jp.loads(text + length)
    wobbling = jp.loads(text.replace("module = 1", "module = 1\nrunout = { wheel = 0.0 }") + length)
    assert wobbling.sources[-1] == "l"
    np.testing.assert_allclose(jp.given(wobbling).error, jp.given(plain).error, rtol=0, atol=1e-12)


GEAR_ON_SLIDER = (
    '[joints.mesh]\ntype = "gear"\non = { crank = [0, 0], slider = [0, 0] }\nteeth = [20, 20]\nradii = [40, 40]\n'
)


@pytest.mark.parametrize("kind", ["gear", "belt"])
@pytest.mark.parametrize(
    ("example", "on", "told"),
    [
        ("slider-crank", "crank = [0, 0], slider = [0, 0]", "start.slider"),
        ("slider-crank", "slider = [0, 0], ground = [0, 0]", "start.slider"),
        ("press", "crank = [0, 0], ram = [0, 0]", "start.ram"),
    ],
)
def test_wheels_on_one_place_in_the_start_are_refused(
    example: str, on: str, told: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A pair between crank and slider, whose guide begins at the crank's centre, ended in a traceback."""
    sizes = "teeth = [20, 20]\n" if kind == "gear" else "distance = 120\n"
    mesh = f'\n[joints.mesh]\ntype = "{kind}"\non = {{ {on} }}\n{sizes}radii = [40, 40]\n'
    file = tmp_path / "m.toml"
    file.write_text(examples.text(example) + mesh)
    assert run(["error", str(file)]) == 2
    said = capsys.readouterr().err
    assert ": joints.mesh: the centres of " in said
    assert f"are at one place in the start, where a {kind} has no direction; say with x and y in {told} " in said


def test_a_wheel_whose_start_is_told_is_answered_for() -> None:
    text = examples.text("slider-crank") + GEAR_ON_SLIDER
    m = jp.loads(text.replace("[start]\n", "[start]\nslider = { x = 200 }\n"))
    with pytest.raises(InputError, match="'theta' commands a joint that cannot move"):
        jp.loaded(m)


def test_pulleys_on_one_pin_have_no_belt() -> None:
    belt = '\n[joints.T]\ntype = "belt"\non = { rod = [160, 0], slider = [0, 0] }\nradii = [10, 20]\n'
    with pytest.raises(InputError, match=r"joints\.T: the centres of .* are at one place in every pose"):
        jp.loads(examples.text("slider-crank").replace("\n[start]\n", "\n[start]\nslider = { x = 200 }\n") + belt)
