"""The mechanism file: every kind of mistake is met by one line that says where it is and what would be valid."""

# ruff: noqa: E501 (one mistake a line)
from pathlib import Path

import pytest

from helpers.answers import refusal, require_refused
from jointplay import examples
from jointplay.errors import InputError, nearest
from jointplay.model.mechanism import load, loads

FOUR_BAR = examples.text("four-bar")
TEXTS = {name: examples.text(name) for name in examples.names()}

PLAY = "clearance = { radial = 1.0 }"
ON = "on   = { ground = [0, 0], crank = [0, 0] }"
VALUES = "values = [22.7, 28.16, 33.46, 38.67, 43.83, 48.98, 54.17, 59.43, 64.83, 70.45, 76.39]"
PATH = TEXTS["five-bar"][TEXTS["five-bar"].index("[path]\n") :].partition("\n\n")[0]
TOLERANCE = "tolerance = 0.0 "
KNOWN_TOP = (
    "Known: assembly, board, bodies, correlations, costs, design, dimensions, document, drives, expansion, followers, format, friction, gravity, grid, include, joints, limits,"
    " links, load_cases, loads"
)

#: example, what stands there, what is written instead, key of the message, what else it says
MISTAKES: dict[str, tuple[str, str, str, str, str]] = {
    # -- keys
    "unknown key": ("four-bar", PLAY, "clearance = { radail = 1 }", "joints.J1.clearance", "did you mean 'radial'? Known: bearing, bore, d"),
    "unknown section": ("four-bar", "[output]", "[outptu]", "", "'outptu' is not a key here; did you mean 'output'? " + KNOWN_TOP),
    "unknown key of a joint": ("four-bar", PLAY, "clearence = 1", "joints.J1", "did you mean 'clearance'?"),
    "unknown key of units": ("four-bar", 'angle = "deg", f', 'angel = "deg", f', "units", "did you mean 'angle'?"),
    "unknown key of a start": ("four-bar", "rocker = { angle", "rocker = { angel", "start.rocker", "did you mean 'angle'?"),
    "unknown key of a drive": ("four-bar", "error  =", "eror =", "drives.theta1", "did you mean 'error'?"),
    "unknown key of the output": ("four-bar", "at   = [150", "att = [150", "output", "did you mean 'at'?"),
    "unknown key of a load": ("four-bar", "moment = 0", "momment = 0", "loads.0", "did you mean 'moment'?"),
    "unknown key of a dimension": ("four-bar", TOLERANCE, "tolerence = 1 ", "dimensions.l2", "did you mean 'tolerance'?"),
    "unknown key of a tolerance": ("four-bar", TOLERANCE, "tolerance = { plu = 1 }", "dimensions.l2.tolerance", "'plus'?"),
    "unknown key of a placement": ("p3r", "axis = [1, 0]", "axes = [1, 0]", "joints.P.on.cylinder", "did you mean 'axis'?"),
    "unknown key of a body": ("slider-crank", "mass = 0.9", "mas = 1", "bodies.crank", "did you mean 'mass'?"),
    "unknown key of a path": ("five-bar", "[path]\nx", "[path]\nX", "path", "did you mean 'x'?"),
    "unknown key of limits": ("slider-crank", "position = 0.2", "positon = 1", "limits", "did you mean 'position'?"),
    "no format": ("four-bar", "format = 1", "", "", "'format' is missing"),
    "no units": ("four-bar", 'units  = { length = "mm", angle = "deg", force = "N" }', "", "", "'units' is missing (such as"),
    "no output": ("p3r", '[output]\nbody = "rocker"\nat   = [150, 0]', "", "", "'output' is missing (the point whose error"),
    "no type": ("four-bar", 'type = "revolute"\n', "", "joints.J1", "'type' is missing (one of revolute, prismatic"),
    "misspelt type": ("four-bar", "type =", "tpye =", "joints.J1", "is it 'tpye'?"),
    "a name with a dot": ("four-bar", "[joints.J1]", '[joints."J.1"]', "joints", '"J.1" is not a name'),
    "an empty name": ("four-bar", "[joints.J1]", '[joints.""]', "joints", '"" is not a name'),
    # -- clearances
    "clearance as a number": ("four-bar", PLAY, "clearance = 1", "joints.J1.clearance", "{ radial = 0.02 } (hole radius - pin"),
    "clearance without a word": ("four-bar", PLAY, "clearance = {}", "joints.J1.clearance", "radial (hole radius - pin radius) or"),
    "clearance twice": ("four-bar", PLAY, "clearance = {radial=1,diametral=2}", "joints.J1.clearance", "radial or diametral, not both"),
    "negative clearance": ("four-bar", PLAY, "clearance = {radial=-1}", "joints.J1.clearance.radial", "must not be negative: -1"),
    "NaN": ("four-bar", PLAY, "clearance = {radial=nan}", "joints.J1.clearance.radial", "a finite number is needed, not nan"),
    "infinite": ("four-bar", PLAY, "clearance = {radial=inf}", "joints.J1.clearance.radial", "a finite number is needed, not inf"),
    "huge": ("four-bar", PLAY, "clearance = {radial=1e300}", "joints.J1.clearance.radial", "must be at most 1000000000000: 1e+300"),
    "text for a number": ("four-bar", PLAY, 'clearance = {radial="1"}', "joints.J1.clearance.radial", 'a number is needed, not "1"'),
    "boolean for a number": ("four-bar", PLAY, "clearance = {radial=true}", "joints.J1.clearance.radial", "a number is needed, not true"),
    "a guide's clearance on a pin": ("four-bar", PLAY, "clearance = {gap=1}", "joints.J1.clearance", "'gap' is not a key here; known: bearing, bore, d"),
    "a pin's clearance on a guide": ("slider-crank", "{ gap = 0.03, length = 60 }", "{ radial = 1 }", "joints.guide.clearance", "gap"),
    "guide of no length": ("slider-crank", "length = 60", "length = 0", "joints.guide.clearance.length", "must be greater than zero: 0"),
    "guide without length": ("slider-crank", ", length = 60", "", "joints.guide.clearance", "'length' is missing (length of the slider"),
    "unknown law": ("four-bar", PLAY, 'clearance = {radial=1,law="normla"}', "joints.J1.clearance.law", "did you mean 'normal'? Known: un"),
    # -- joints and bodies
    "unknown joint type": ("four-bar", '"revolute"', '"revolut"', "joints.J1", "did you mean 'revolute'? Known: revolute, prismatic"),
    "spatial joint": ("four-bar", '"revolute"', '"spherical"', "joints.J1", "is a joint in space; in the plane there are revolute"),
    "joint type as number": ("four-bar", '"revolute"', "1", "joints.J1", "type = 1 is not a joint"),
    "joint as a number": ("four-bar", "[joints.J1]", "[joints]\nJ0 = 3\n[joints.J1]", "joints.J0", "a table such as { type"),
    "unknown body": ("four-bar", "coupler = [75", "copler = [75", "joints.J3", "'copler' is on no other joint; did you mean 'coupler'?"),
    "one body": ("four-bar", ON, "on = { crank = [0, 0] }", "joints.J1", "connects two bodies or more, not crank"),
    "the same body twice": ("four-bar", ON, 'bodies = ["a", "a"]\nat = [0, 0]', "joints.J1", "different bodies, not a, a"),
    "bodies without a place": ("four-bar", ON, 'bodies = ["ground", "crank"]', "joints.J1", "'at' is missing"),
    "no bodies": ("four-bar", ON, "", "joints.J1", "on = { BODY = [x, y], BODY = [x, y] }, or bodies and at"),
    "both ways": ("four-bar", ON, ON + "\nat = [0, 0]", "joints.J1", "go with `bodies`"),
    "one coordinate": ("four-bar", "ground = [0, 0]", "ground = [0]", "joints.J1.on.ground", "two values are needed, not [0]"),
    "three coordinates": ("four-bar", "ground = [0, 0]", "ground = [0, 0, 0]", "joints.J1.on.ground", "2 values are needed, not [0, 0, 0]"),
    "a number for a place": ("four-bar", "ground = [0, 0]", "ground = 0", "joints.J1.on.ground", "[x, y] or { at = [x, y]"),
    "axis on a pin": ("four-bar", "ground = [0, 0]", "ground = { at = [0, 0], axis = [1, 0] }", "joints.J1", "has no axis"),
    "guide without axis": ("p3r", "{ at = [0, 0], axis = [1, 0] }", "[0, 0]", "joints.P", "cylinder = { at = [x, y], axis = [ux, uy] }"),
    "axis of no direction": ("p3r", "axis = [1, 0]", "axis = [0, 0]", "joints.P.on.cylinder.axis", "[0, 0] has no direction"),
    "axis as text": ("p3r", "axis = [1, 0]", 'axis = "x"', "joints.P.on.cylinder.axis", "a direction [ux, uy] or an angle"),
    "joint called output": ("four-bar", "[joints.J1]", "[joints.output]", "joints.output", "rename the joint"),
    "disconnected": ("four-bar", "[start]", '[joints.X]\ntype = "revolute"\non = { p = [0, 0], q = [0, 0] }\n[start]', "joints", "'p', 'q'"),
    "ground as a start": ("four-bar", "rocker = { angle", "ground = { angle", "start.ground", "'ground' is fixed; leave it out"),
    "start of an unknown body": ("four-bar", "rocker = { a", "rokcer = { a", "start.rokcer", "did you mean 'rocker'?"),
    "start as a number": ("four-bar", "rocker = { angle = 35.6 }", "rocker = 35.6", "start.rocker", "{ x = 0, y = 0, angle = 30 } is needed, not 35.6"),
    "mass of an unknown body": ("slider-crank", "[bodies.rod]", "[bodies.rood]", "bodies.rood", "did you mean 'rod'?"),
    "negative mass": ("slider-crank", "mass = 0.9", "mass = -0.9", "bodies.crank.mass", "must not be negative: -0.9"),
    "gravity without mass": ("four-bar", "space ", "gravity = [0, -9.81]\nspace ", "gravity", "[bodies.NAME] with mass in kg"),
    # -- drives and paths
    "drive on an unknown joint": ("four-bar", 'joint  = "J1"', 'joint = "J7"', "drives.theta1.joint", "'J7' is not a joint; known: J1, J2"),
    "drive on a fixed joint": ("serial-2r", '"elbow"\nfrom', '"mount"\nfrom', "drives.q2.joint", "is a fixed joint and has no coordinate to drive"),
    "drive without values": ("four-bar", VALUES, "", "drives.theta1", "values = [...], or from, to and count, or a [path]"),
    "drive with no values": ("four-bar", VALUES, "values = []", "drives.theta1.values", "the list is empty"),
    "drive value as text": ("four-bar", "values = [22.7", 'values = ["a"', "drives.theta1.values.0", 'a number is needed, not "a"'),
    "drive value NaN": ("four-bar", "28.16", "nan", "drives.theta1.values.1", "a finite number is needed, not nan"),
    "drive with count and values": ("p3r", "count = 11", "count = 11\nvalues = [1]", "drives.v", "either values, or from, to and count"),
    "drive without count": ("p3r", "count = 11", "", "drives.v", "from, to and count belong together; missing: count"),
    "fractional count": ("p3r", "count = 11", "count = 11.0", "drives.v.count", "a whole number is needed, not 11.0"),
    "count of one": ("p3r", "count = 11", "count = 1", "drives.v.count", "must be at least 2: 1"),
    "count beyond reason": ("p3r", "count = 11", "count = 99999999999", "drives.v.count", "must be at most 1000000: 99999999999"),
    "unequal drives": ("serial-2r", "count = 13", "count = 12", "drives.q1", "as many values each (or a single one that is held); here: q1 12, q2 13"),
    "joint driven twice": ("serial-2r", 'joint = "elbow"', 'joint = "shoulder"', "drives.q2.joint", "'shoulder' is already driven by 'q1'"),
    "values and a path": ("four-bar", "[output]", "[path]\nx = [1]\n[output]", "drives.theta1", "here are both"),
    "uneven path": ("five-bar", "x = [-60, ", "x = [", "path", "need as many values each; here: x 8, y 9"),
    "empty path": ("five-bar", PATH, "[path]", "path", "at least one of x, y, angle"),
    "drive out of its limits": ("serial-2r", "q1 = [-10, 120]", "q1 = [-10, 50]", "drives.q1", "80 is outside limits.drives.q1 = [-10.0, 50.0]"),
    "no drive": ("p3r", '[drives.v]\njoint = "P"\nfrom  = 90\nto    = 135\ncount = 11\n', "", "drives", "drive one of J1, P, J2, J3"),
    "two drives on one motion": ("p3r", "[output]", '[drives.w]\njoint = "J3"\nvalues = [30]\n[output]', "drives", "'v' and 'w' command the same motion"),
    # -- output, loads, dimensions, limits
    "output on an unknown body": ("four-bar", 'body = "rocker"', 'body = "roker"', "output.body", "did you mean 'rocker'?"),
    "output on the ground": ("four-bar", 'body = "rocker"', 'body = "ground"', "output.body", "'ground' does not move"),
    "output at a joint elsewhere": ("four-bar", "at   = [150, 0]", 'at = "J2"', "output.at", "'J2' is not a joint on 'rocker'; known: J3, J4"),
    "output at a number": ("four-bar", "at   = [150, 0]", "at = 3", "output.at", "a point [x, y] or the name of a joint"),
    "load on the ground": ("four-bar", "force = [0", 'body = "ground"\nforce = [0', "loads.0.body", "a load acts on a moving body"),
    "load on an unknown body": ("six-bar", 'body  = "coupler"', 'body = "cupler"', "loads.1.body", "did you mean 'coupler'?"),
    "load without force": ("p3r", "force = [0, -10]", "", "loads.0", "a load needs a force [fx, fy] or a moment"),
    "force as a number": ("p3r", "force = [0, -10]", "force = 10", "loads.0.force", "a list in brackets is needed, not 10"),
    "loads as a table": ("p3r", "[[loads]]", "[loads]", "loads", "a list in brackets is needed"),
    "dimension of another body": ("four-bar", 'body = "coupler"', 'body = "crank"', "dimensions.l2.between.1", "'J3' is not a joint on 'crank'"),
    "dimension of an unknown body": ("four-bar", 'body = "coupler"', 'body = "copler"', "dimensions.l2.body", "did you mean 'coupler'?"),
    "dimension to one point": ("four-bar", '["J2", "J3"]', '["J2"]', "dimensions.l2.between", 'two values are needed, not ["J2"]'),
    "dimension of no length": ("four-bar", '["J2", "J3"]', '["J2", "J2"]', "dimensions.l2.between", "are at the same point of 'coupler'"),
    "dimension to a foreign output": ("four-bar", '["J2", "J3"]', '["J2", "output"]', "dimensions.l2.between.1", "the output is on 'rocker'"),
    "dimension named like a joint": ("four-bar", "[dimensions.l2]", "[dimensions.J3]", "dimensions.J3", "is the name of a joint"),
    "negative tolerance": ("four-bar", TOLERANCE, "tolerance = -1 ", "dimensions.l2.tolerance", "must not be negative: -1"),
    "half a tolerance": ("four-bar", TOLERANCE, "tolerance = { plus = 1 } ", "dimensions.l2.tolerance", "either plus and minus, or sigma alone"),
    "tolerance as text": ("four-bar", TOLERANCE, 'tolerance = "H7" ', "dimensions.l2.tolerance", "{ sigma = 0.02 } is needed, not"),
    "sigma with a law": ("four-bar", TOLERANCE, 'law = "uniform"\ntolerance = { sigma = 1 } ', "dimensions.l2", "leave out law"),
    "negative limit": ("slider-crank", "position = 0.2", "position = -1", "limits.position", "must not be negative"),
    "limit of an unknown drive": ("serial-2r", "drives = { q1", "drives = { q3", "limits.drives.q3", "'q3' is not a drive"),
    "limits the wrong way round": ("serial-2r", "[-10, 120]", "[120, -10]", "limits.drives.q1", "[lowest, highest], not [120.0, -10.0]"),
    # -- the file as a whole
    "another format": ("four-bar", "format = 1", "format = 2", "format", "this version reads format = 1, not 2"),
    "format as boolean": ("four-bar", "format = 1", "format = true", "format", "format = 1, not true"),
    "neither plane nor space": ("four-bar", '"planar"', '"spacial"', "space", "did you mean 'spatial'? Known: planar, spatial"),
    "a planar file in space": ("four-bar", '"planar"', '"spatial"', "joints.J1.on.ground", "three values are needed, not [0, 0]"),
    "a key of space": ("four-bar", PLAY, "clearance = { radial = 1.0, axial = 1 }", "joints.J1.clearance", "'axial' is a key in space (space"),
    "a side in the plane": ("p3r", "axis = [1, 0]", "side = [1, 0]", "joints.P.on.cylinder", "'side' is a key in space"),
    "wrong unit": ("four-bar", '"mm"', '"inch"', "units.length", '"inch" is not valid here; did you mean'),
    "wrong unit of force": ("four-bar", '"N"', '"kg"', "units.force", '"kg" is not valid here; did you mean'),
    "title as a number": ("p3r", 'title  = "P3R linkage, linear drive (Jaiswal et al.)"', "title = 3", "title", "a text in quotes is needed, not 3"),
    "not TOML": ("four-bar", "format = 1", "format == 1", "", "line 6, column 9: is not TOML: "),
    "a key twice": ("four-bar", "format = 1", "format = 1\nformat = 1", "", "is not TOML: "),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named_with_its_place_and_what_is_valid(mistake: str) -> None:
    example, old, new, key, said = MISTAKES[mistake]
    require_refused(TEXTS[example], old, new, key, said)


def test_ground_is_the_name_of_the_fixed_body() -> None:
    assert "no joint is on 'ground'" in refusal(FOUR_BAR.replace("ground = ", "base = "))
    assert "'grond' is a body like any other" in refusal(FOUR_BAR.replace("ground = ", "grond = "))


def test_a_pin_of_three_bodies_must_be_named_with_its_rider() -> None:
    text = FOUR_BAR.replace("rocker = [150, 0] }", "rocker = [150, 0], pusher = [0, 0] }")
    text = text.replace('joint  = "J1"', 'joint = "J3"')
    assert "'J3' consists of several joints; name one of J3/rocker, J3/pusher" in refusal(text)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty"),
        (b"  \n\t\n", "is empty"),
        (b"\x7fELF\x02\x01\x01\x00\x00", "is a binary file"),
        ("format = 1".encode("utf-16"), "is UTF-16 text; save it as UTF-8"),
        (b'format = 1\ntitle = "M\xfcller"', "line 2: is not UTF-8 text (byte 0xfc)"),
        (b"format = 1" + b" " * 9_000_000, "is longer than 8 MB"),
        (b"x = " + b"[" * 100_000, "nested more than 20 deep"),
        (b"format = " + b"1" * 5000, "a number has thousands of digits"),
    ],
)
def test_what_is_not_a_mechanism_file(tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "m.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"m\.toml: ") as caught:
        load(path)
    assert said in str(caught.value)


def test_what_is_not_a_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"missing\.toml: there is no such file"):
        load(tmp_path / "missing.toml")
    with pytest.raises(InputError, match="this is a folder"):
        load(tmp_path)
    with pytest.raises(InputError, match="cannot be read"):
        load("nul\0byte")


def test_a_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text(FOUR_BAR, encoding="utf-8-sig")
    assert load(path) == loads(FOUR_BAR)


@pytest.mark.parametrize(
    ("word", "known", "meant"),
    [
        ("radail", ["radial", "diametral"], "radial"),
        ("X", ["x", "y"], "x"),
        ("J7", ["J1", "J2"], None),
        ("z", ["x", "y"], None),
        ("forearm_left", ["forearm_right", "upper"], "forearm_right"),
        ("", ["x"], None),
        ("x", [], None),
    ],
)
def test_the_nearest_known_name(word: str, known: list[str], meant: str | None) -> None:
    assert nearest(word, known) == meant
