"""Elastic bodies and joints: what the file says of them, in the numbers that the core reads.

The compliance of a piece of a member is held against the beam equation, integrated along it in ground axes; whole
members against textbook formulas.
"""

import json
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import jointplay as jp
from helpers.answers import refusal, require_refused
from helpers.builders import planar
from helpers.oracles.beam import HEAD, INERTIA, MEMBER, SPATIAL, TORSION, E, G, beam, pin
from jointplay import _core
from jointplay.analyses.check import compute
from jointplay.analyses.singularities import compute as compute_singularities
from jointplay.errors import InputError
from jointplay.result.table import tables

Array = NDArray[np.float64]


def compliance(m: jp.Mechanism, joint: str) -> Array:
    given = np.array(m.core_spec["joints"][m.joints.index(joint)]["compliance"])
    size = round(len(given) ** 0.5)
    return given.reshape(size, size)


# -- members ----------------------------------------------------------------------------------------------------------


def cantilever(*loads: str) -> jp.Mechanism:
    text = HEAD + pin("root", "ground = { at = [10, 20], axis = 30 }, beam = [0, 0]", kind="fixed")
    text += '[output]\nbody = "beam"\nat = [300, 0]\n' + "".join(f"[[loads]]\n{load}\n" for load in loads)
    return jp.loads(text + MEMBER + f"inertia = {INERTIA}\n")


def tip(m: jp.Mechanism, along: dict[str, tuple[float, float]]) -> Array:
    """Deflection across and rotation of the last piece of a cantilever along its x axis under forces across it."""
    total = np.zeros(2)
    end = max(at for at, _ in along.values())
    for member in m.members:
        joint = m.core_spec["joints"][member.joint]
        at = m.core_spec["points"][joint["first"]]["at"][0]
        beyond = [(x, force) for x, force in along.values() if x >= at - 1e-12]
        wrench = np.array([sum(f for _, f in beyond), sum((x - at) * f for x, f in beyond)])
        v, turn = compliance(m, m.joints[member.joint])[1:, 1:] @ wrench
        total += [v + (end - at) * turn, turn]
    return total


def test_the_tip_of_a_cantilever() -> None:
    m = cantilever("force = [0, -10]")
    assert [member.name for member in m.members] == ["beam"]
    rigidity, length = E * 1e6 * INERTIA * 1e-12, 0.3
    expected = [-10 * length**3 / (3 * rigidity), -10 * length**2 / (2 * rigidity)]
    np.testing.assert_allclose(tip(m, {"output": (length, -10.0)}), expected, rtol=1e-12)


def test_a_load_along_a_member_is_where_it_acts() -> None:
    """A force at 100 mm of 300: it deflects the tip by F a^2 (3 L - a) / 6EI."""
    m = cantilever("at = [100, 0]\nforce = [0, -10]")
    assert m.bodies == ("beam", "beam.load0", "beam.output")
    assert [member.between for member in m.members] == [("root", "load0"), ("load0", "output")]
    rigidity, a, length = E * 1e6 * INERTIA * 1e-12, 0.1, 0.3
    expected = [-10 * a**2 * (3 * length - a) / (6 * rigidity), -10 * a**2 / (2 * rigidity)]
    np.testing.assert_allclose(tip(m, {"load": (a, -10.0), "output": (length, 0.0)}), expected, rtol=1e-12)


def test_a_piece_in_the_plane_is_a_beam() -> None:
    m = cantilever()
    found = compliance(m, "beam.root-output")
    x, y, z = np.eye(3)
    for k, wrench in enumerate(([1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0, 0, 0, 0, 1])):
        moved = beam(x, y, 0.3, np.array(wrench, dtype=float), (INERTIA, INERTIA))
        np.testing.assert_allclose(found[:, k], [moved[0], moved[1], moved[5]], rtol=1e-12, atol=1e-20)
    assert z @ np.cross(x, y) == 1


@pytest.mark.parametrize(("side", "inertia"), [("", "1067"), ("side = [0.3, 2, 1]\n", "[1067, 300]")])
def test_a_piece_in_space_is_a_beam(side: str, inertia: str) -> None:
    text = SPATIAL + pin("A", "ground = [10, 20, 30], beam = [1, 2, 3]", kind="spherical")
    text += pin("B", "ground = [110, 220, 80], beam = [101, 202, 53]", kind="spherical")
    text += '[output]\nbody = "beam"\nat = "B"\n' + MEMBER
    m = jp.loads(text + f"inertia = {inertia}\nG = {G}\ntorsion = {TORSION}\n" + side)
    joint = m.core_spec["joints"][m.members[0].joint]
    axis, across = np.array(joint["axis_first"]), np.array(joint["side_first"])
    np.testing.assert_allclose(axis, np.array([100, 200, 50]) / np.linalg.norm([100, 200, 50]), rtol=1e-14)
    assert abs(axis @ across) < 1e-15
    frame = np.array([axis, across, np.cross(axis, across)])
    inertias = (INERTIA, 300.0) if side else (INERTIA, INERTIA)
    found = compliance(m, "beam.A-B")
    for k in range(6):
        wrench = np.zeros(6)
        wrench[3 * (k // 3) : 3 * (k // 3) + 3] = frame[k % 3]
        moved = beam(axis, across, m.members[0].length, wrench, inertias)
        expected = np.concatenate([frame @ moved[:3], frame @ moved[3:]])
        np.testing.assert_allclose(found[:, k], expected, rtol=1e-11, atol=1e-14 * float(np.abs(moved).max()))
    np.testing.assert_array_equal(found, found.T)
    assert np.linalg.eigvalsh(found).min() > 0


def test_what_is_left_out_is_rigid() -> None:
    text = SPATIAL + pin("A", "ground = [0, 0, 0], rod = [0, 0, 0]", kind="spherical")
    text += pin("B", "ground = [100, 0, 0], rod = [100, 0, 0]", kind="spherical")
    text += '[output]\nbody = "rod"\n[bodies.rod]\nstiffness = 5e4\n'
    found = compliance(jp.loads(text), "rod.A-B")
    expected = np.zeros((6, 6))
    expected[0, 0] = 1 / 5e7
    np.testing.assert_allclose(found, expected, rtol=1e-14)  # some products of matrices


CHAIN = (
    HEAD
    + pin("A", "ground = [0, 0], bar = [50, 50]")
    + pin("C", "bar = [80, 90], c = [0, 0]")
    + pin("B", "bar = [20, 10], b = [0, 0]")
    + pin("K", "ground = [100, 0], c = [10, 0]")
    + pin("L", "ground = [0, 100], b = [10, 0]")
)


def test_joints_along_a_member_share_its_stiffness() -> None:
    """Three pins on one line: two springs in a row, as stiff together as the whole."""
    m = jp.loads(CHAIN + '[output]\nbody = "bar"\n[bodies.bar]\nstiffness = 1000\n[start]\nbar = { angle = 20 }\n')
    # The output at the body's origin lies beside the axis; its foot is one more place.
    assert [member.name for member in m.members] == ["bar.C-A", "bar.A-B", "bar.B-output"]
    lengths = [member.length for member in m.members]
    np.testing.assert_allclose(lengths[:2], [0.05, 0.05], rtol=1e-14)
    gives = [compliance(m, m.joints[member.joint])[0, 0] for member in m.members]
    np.testing.assert_allclose(gives[:2], [0.5e-6, 0.5e-6], rtol=1e-12)
    np.testing.assert_allclose(gives[2], 1e-6 * lengths[2] / 0.1, rtol=1e-12)
    # The first joint of the file keeps the name of the body.
    places = {name: m.core_spec["points"][m.core_spec["joints"][k]["first"]]["body"] for k, name in enumerate(m.joints)}
    assert m.bodies == ("bar", "c", "b", "bar.C", "bar.B", "bar.output")
    assert m.bodies[places["C"]] == "bar.C"
    assert m.bodies[m.core_spec["points"][m.core_spec["joints"][0]["second"]]["body"]] == "bar"


UNITS = [("mm", "N", 1e-3, 1.0), ("m", "kN", 1.0, 1e3), ("in", "lbf", 0.0254, 4.4482216152605)]


@pytest.mark.parametrize(("length", "force", "metre", "newton"), UNITS)
def test_the_same_member_in_other_units(length: str, force: str, metre: float, newton: float) -> None:
    def units(value: float, forces: int, lengths: int) -> float:
        return value / newton**forces / metre**lengths

    text = f'format = 1\nspace = "spatial"\nunits = {{ length = "{length}", angle = "rad", force = "{force}" }}\n'
    at = units(0.4, 0, 1)
    stiff = f"stiffness = {{ radial = {units(5e6, 1, -1)}, axial = {units(2e6, 1, -1)}, tilt = {units(300.0, 1, 1)} }}"
    on = "ground = { at = [0, 0, 0], axis = [0, 0, 1] }, beam = [0, 0, 0]"
    text += pin("A", on, stiff)
    text += pin("B", f"ground = [{at}, 0, 0], beam = [{at}, 0, 0]", kind="spherical")
    text += f'[output]\nbody = "beam"\n[bodies.beam]\nE = {units(2.1e11, 1, -2)}\narea = {units(8e-5, 0, 2)}\n'
    text += f"inertia = {units(1e-9, 0, 4)}\nG = {units(8e10, 1, -2)}\ntorsion = {units(2e-9, 0, 4)}\n"
    m = jp.loads(text)
    np.testing.assert_allclose(np.diag(compliance(m, "A")), [5e-7, 2e-7, 2e-7, 1 / 300, 1 / 300], rtol=1e-12)
    bent = 0.4**3 / (3 * 2.1e11 * 1e-9)
    turned = 0.4 / (2.1e11 * 1e-9)
    expected = [0.4 / (2.1e11 * 8e-5), bent, bent, 0.4 / (8e10 * 2e-9), turned, turned]
    np.testing.assert_allclose(np.diag(compliance(m, "beam.A-B")), expected, rtol=1e-12)


# -- joints -----------------------------------------------------------------------------------------------------------

JOINTS: list[tuple[str, str, str, dict[str, float]]] = [
    ("", "revolute", "radial = 2", {"x": 2, "y": 2}),
    ("", "prismatic", "normal = 2, tilt = 5", {"normal": 2, "angle": 5}),
    ("", "pin_in_slot", "normal = 2", {"normal": 2}),
    ("", "fixed", "along = 1, normal = 2, tilt = 5", {"along": 1, "normal": 2, "angle": 5}),
    (
        "spatial",
        "revolute",
        "radial = 2, axial = 3, tilt = [5, 7]",
        {"along": 3, "side": 2, "normal": 2, "tilt_side": 5, "tilt_normal": 7},
    ),
    ("spatial", "cylindrical", "radial = 2, tilt = 5", {"side": 2, "normal": 2, "tilt_side": 5, "tilt_normal": 5}),
    (
        "spatial",
        "prismatic",
        "side = 1, normal = 2, roll = 4, tilt = [5, 7]",
        {"side": 1, "normal": 2, "roll": 4, "tilt_side": 5, "tilt_normal": 7},
    ),
    ("spatial", "spherical", "radial = 2", {"x": 2, "y": 2, "z": 2}),
    ("spatial", "planar", "along = 2, tilt = [5, 7]", {"along": 2, "tilt_side": 5, "tilt_normal": 7}),
    (
        "spatial",
        "fixed",
        "along = 1, side = 2, normal = 3, roll = 4, tilt = [5, 7]",
        {"along": 1, "side": 2, "normal": 3, "roll": 4, "tilt_side": 5, "tilt_normal": 7},
    ),
]
TURNS = ("angle", "roll", "tilt_side", "tilt_normal")


def jointed(space: str, kind: str, more: str) -> jp.Mechanism:
    zero = "[0, 0, 0]" if space else "[0, 0]"
    axis = "" if kind in ("spherical",) or (not space and kind == "revolute") else ", axis = [1, 0, 0]"
    axis = axis if space else axis.replace("1, 0, 0", "1, 0")
    text = (SPATIAL if space else HEAD) + pin("J", f"ground = {{ at = {zero}{axis} }}, body = {zero}", more, kind)
    return jp.loads(text + '[output]\nbody = "body"\n')


@pytest.mark.parametrize(("space", "kind", "given", "expected"), JOINTS)
def test_every_direction_that_a_joint_holds(space: str, kind: str, given: str, expected: dict[str, float]) -> None:
    """The compliance is in the order of the core's own rows, whose names tell what each is."""
    m = jointed(space, kind, f"stiffness = {{ {given} }}")
    rows = [component for joint, component in m.core.rows if joint == 0]
    units = {component: 180 / np.pi * 1e-3 if component in TURNS else 1e3 for component in rows}
    wanted = np.diag([1 / (expected[component] * units[component]) for component in rows])
    np.testing.assert_allclose(compliance(m, "J"), wanted, rtol=1e-14)


def test_both_pins_of_a_universal_joint_give() -> None:
    text = SPATIAL + '[joints.U]\ntype = "universal"\nbodies = ["ground", "arm"]\nat = [0, 0, 0]\n'
    text += 'axes = [[1, 0, 0], [0, 1, 0]]\nstiffness = { radial = 4 }\n[output]\nbody = "arm"\n'
    m = jp.loads(text)
    for name in ("U.first", "U.second"):
        np.testing.assert_allclose(compliance(m, name), np.diag([0, 1 / 4e3, 1 / 4e3, 0, 0]), rtol=1e-14)


def test_rigid_joints_say_nothing() -> None:
    m = jointed("", "revolute", "")
    assert "compliance" not in m.core_spec["joints"][0]
    assert m.members == ()
    assert m.owners == m.bodies


# -- the pieces change nothing else -----------------------------------------------------------------------------------


def four_bar(**coupler: float) -> jp.Builder:
    b = planar()
    b.revolute("A", ground=(0, 0), crank=(0, 0), clearance=jp.radial(0.1))
    b.revolute("B", crank=(40, 0), coupler=(5, 3), clearance=jp.radial(0.2))
    b.revolute("C", coupler=(95, 33), rocker=(60, 0), clearance=jp.radial(0.15))
    b.revolute("D", ground=(90, -10), rocker=(0, 0), clearance=jp.radial(0.1))
    for body, angle in (("crank", 70), ("coupler", -15), ("rocker", 80)):
        b.start(body, angle=angle)
    b.drive("q", joint="A", values=[70, 80])
    b.output(body="coupler", at=(50, 60))
    b.load(force=(3, -10))
    b.load(body="coupler", at=(20, -5), moment=40)
    b.dimension("coupler", body="coupler", between=["B", "C"], deviation=0.3)
    b.dimension("tip", body="coupler", between=["C", "output"], deviation=-0.2)
    if coupler:
        b.body("coupler", **coupler)
    return b


def stripped(m: jp.Mechanism) -> _core.Mechanism:
    """The mechanism with its pieces, but rigid."""
    spec = m.spec()
    for joint in spec["joints"]:
        joint.pop("compliance", None)
    return _core.Mechanism(json.dumps(spec))


def test_pieces_that_do_not_give_are_the_body() -> None:
    """Poses, errors and reactions of a four-bar, its coupler whole and in pieces, with loads and output beside it."""
    rigid = four_bar().mechanism()
    m = four_bar(stiffness=1e3).mechanism()
    assert m.bodies == ("crank", "coupler", "rocker", "coupler.load1", "coupler.output", "coupler.C")
    core = stripped(m)
    drives: Any = m.drive_values
    answers = []
    for this in (core, rigid.core):
        solved = this.trace(drives)
        answers.append((solved, this.loaded(drives, solved["poses"]), this.worst(drives, solved["poses"], starts=4)))
    pieces, whole = answers
    np.testing.assert_allclose(pieces[0]["output"], whole[0]["output"], rtol=0, atol=1e-12)
    for k in (3, 4, 5):
        np.testing.assert_allclose(pieces[0]["poses"][:, k], whole[0]["poses"][:, 1], rtol=0, atol=1e-12)
    joints = len(rigid.joints)
    np.testing.assert_allclose(pieces[1]["error"], whole[1]["error"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(pieces[1]["reaction"][:, :joints], whole[1]["reaction"], rtol=1e-6, atol=1e-9)
    for name in whole[2]:
        if "position" in name or "rotation" in name:
            np.testing.assert_allclose(pieces[2][name], whole[2][name], rtol=1e-6, atol=1e-9)


def test_people_see_their_own_names() -> None:
    elastic = four_bar(stiffness=1e3).mechanism()
    m = elastic.with_({"drives": None})
    assert "1 motion is free: 'crank', 'coupler' and 'rocker' move together" in jp.check(m).attrs["mobility"]
    joints, members, *_, start = tables(compute(elastic))
    assert joints.title == "3 bodies, 4 joints"
    assert [column.cells for column in joints.columns[2:4]] == [
        ("ground", "crank", "coupler", "ground"),
        ("crank", "coupler", "rocker", "rocker"),
    ]
    assert members.title == "3 elastic members"
    assert start.columns[0].cells == ("crank", "coupler", "rocker")
    assert "3 bodies, 4 joints" in repr(elastic)
    told = jp.solve(elastic)
    assert told.owner.values.tolist() == ["crank", "coupler", "rocker", "coupler", "coupler", "coupler"]
    # The crank and the coupler in line with each other; of the coupler all pieces move.
    stretched = elastic.with_({"drives.q.values": [100]})
    said = str([table.notes for table in tables(compute_singularities(stretched))])
    assert "move together" in said
    assert "coupler." not in said


def test_a_member_stays_what_it_is_in_a_copy() -> None:
    m = four_bar(stiffness=1e3).mechanism()
    assert len(m.members) == 3
    assert m.with_({"bodies.coupler.stiffness": None}).members == ()


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("bodies.coupler.stiffness", "N/mm"),
        ("bodies.coupler.E", "N/mm^2"),
        ("bodies.coupler.area", "mm^2"),
        ("bodies.coupler.inertia", "mm^4"),
        ("bodies.coupler.mass", "kg"),
        ("joints.B.stiffness.radial", "N/mm"),
        ("joints.clamp.stiffness.tilt", "N mm/deg"),
    ],
)
def test_a_sweep_says_what_unit_a_value_has(key: str, unit: str) -> None:
    b = four_bar(E=1e5, area=10, inertia=100)
    b.fixed("clamp", rocker=(10, 10), tool=(0, 0), stiffness={"tilt": 500})
    m = b.mechanism()
    if key.endswith(".stiffness"):
        m = m.with_({"bodies.coupler.area": None})
    assert jp.sweep(m, key, [1000, 2000], question="solve")[key.rpartition(".")[2]].attrs["units"] == unit


# -- mistakes ---------------------------------------------------------------------------------------------------------

BAR = HEAD + pin("A", "ground = [0, 0], bar = [0, 0]", "GIVES") + pin("B", "ground = [9, 0], bar = [9, 0]")
BAR += '[output]\nbody = "bar"\n[bodies.bar]\nSAYS\n'
ROD = SPATIAL + pin("A", "ground = { at = [0, 0, 0], axis = [0, 0, 1] }, bar = [0, 0, 0]", "GIVES")
ROD += (
    pin("B", "ground = [9, 0, 0], bar = [9, 0, 0]", kind="spherical") + '[output]\nbody = "bar"\n[bodies.bar]\nSAYS\n'
)

#: file, what stands in the body, in the joint, key of the message, what else it says
MISTAKES: list[tuple[str, str, str, str, str]] = [
    (BAR, "stifness = 1", "", "bodies.bar", "'stifness' is not a key here; did you mean 'stiffness'?"),
    (BAR, "stiffness = 0", "", "bodies.bar.stiffness", "must be greater than zero: 0"),
    (BAR, 'stiffness = "soft"', "", "bodies.bar.stiffness", 'a number is needed, not "soft"'),
    (BAR, "stiffness = 1\nE = 1\narea = 1", "", "bodies.bar", "either stiffness, or E and area; not both"),
    (
        BAR,
        "area = 1\ninertia = 2",
        "",
        "bodies.bar",
        "'E' is missing (modulus of elasticity, which area and",
    ),
    (BAR, "E = 1", "", "bodies.bar", "E alone makes nothing elastic; it needs area"),
    (BAR, "E = 1\ninertia = [1, 2]", "", "bodies.bar.inertia", "a number is needed, not [1, 2]"),
    (BAR, "G = 1", "", "bodies.bar", "'G' is a key in space"),
    (ROD, "torsion = 1", "", "bodies.bar", "'G' is missing (shear modulus, which torsion needs)"),
    (ROD, "G = 1", "", "bodies.bar", "G alone makes nothing elastic"),
    (
        ROD,
        "stiffness = 1\nside = [0, 0, 1]",
        "",
        "bodies.bar",
        "side is the direction to which two inertias refer; there is no inertia",
    ),
    (ROD, "E = 1\ninertia = 1\nside = [1, 0, 0]", "", "bodies.bar.side", "lies along the member; a side is across it"),
    (
        ROD,
        "E = 1\ninertia = [1, 2, 3]",
        "",
        "bodies.bar.inertia",
        "moments of inertia of the mass are rotational_inertia",
    ),
    (BAR, "", "stiffness = 5", "joints.A.stiffness", "a table such as { radial = 5e4 } is needed, not 5"),
    (BAR, "", "stiffness = {}", "joints.A.stiffness", "say what gives: one or more of radial"),
    (BAR, "", "stiffness = { radail = 1 }", "joints.A.stiffness", "did you mean 'radial'?"),
    (BAR, "", "stiffness = { axial = 1 }", "joints.A.stiffness", "'axial' is a key in space"),
    (BAR, "", "stiffness = { radial = -1 }", "joints.A.stiffness.radial", "must be greater than zero: -1"),
    (ROD, "", "stiffness = { tilt = [1] }", "joints.A.stiffness.tilt", "two values are needed, not [1]"),
    (ROD, "", "stiffness = { tilt = [1, 0] }", "joints.A.stiffness.tilt.1", "must be greater than zero: 0"),
]


@pytest.mark.parametrize(("text", "body", "joint", "key", "said"), MISTAKES)
def test_a_mistake_is_named(text: str, body: str, joint: str, key: str, said: str) -> None:
    require_refused(text.replace("GIVES", joint), "SAYS", body, key, said)


def test_an_angular_body_is_to_be_split() -> None:
    text = CHAIN.replace("[20, 10]", "[20, 11]") + '[output]\nbody = "c"\n[bodies.bar]\nstiffness = 1\n'
    assert refusal(text) == (
        "file.toml: bodies.bar: an elastic body is a straight member, but B is not on the line through 'A' and 'C'; "
        "split the body and lock its straight parts together with fixed joints"
    )


def test_a_member_needs_a_length() -> None:
    text = HEAD + pin("A", "ground = [0, 0], bar = [5, 5]") + '[output]\nbody = "bar"\nat = "A"\n'
    with pytest.raises(InputError, match=r"bodies\.bar: .* this has no length"):
        jp.loads(text + "[bodies.bar]\nstiffness = 1\n", "file.toml")
