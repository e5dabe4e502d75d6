"""Drawings of PMKS+: published positions, closed forms along a turn, units, and what is refused."""

import contextlib
import random
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest

import jointplay as jp
from helpers.commands import refused
from helpers.geometry import meeting
from jointplay.basics.foreign import EXTENSIONS
from jointplay.cli import run
from jointplay.exchange.registry import READERS

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
HOST = "https://app.pmksplus.com/?"
#: templates of the program, as its repository freezes them
TEMPLATES = {
    "four-bar": "0P.TY.K,0.101.MA,A,0mv,0VU,0.GB,B,0e_,E6,0.GC,C,l1,WW,0.KD,D,qD,0Pk,0..YRAB,AB,Fe,Fe,0ix,08i,c5cae9,"
    "A,B,,.YRBC,BC,Fe,Fe,32,NJ,303e9f,B,C,,.YRCD,CD,Fe,Fe,nd,3P,0d125a,C,D,,...JBq",
    "Watt I": "0P.TY.K,0.101.MA,A,0Qh,0Kn,0.GB,B,0e1,9i,0.GC,C,bT,LF,0.GD,D,0G5,tZ,0.GE,E,V5,1_z,0.GF,F,1mM,1Gv,0"
    ".KG,G,1rt,0ey,0..YRAB,AB,Fe,Fe,0XM,05Z,c5cae9,A,B,,.YRBCD,BCD,Fe,Fe,06D,Sr,303e9f,B,C,D,,"
    ".YRDE,DE,Fe,Fe,7W,1RG,0d125a,D,E,,.YREF,EF,Fe,Fe,17j,1dx,B2DFDB,E,F,,.YRFCG,FCG,Fe,Fe,1PE,KQ,26A69A,F,C,G,,...JAp",
    "Watt II": "0P.TY.K,0.101.MA,A,0Vf,0Vd,0.GB,B,0mZ,08A,0.GC,C,06Y,LC,0.GD,D,1MR,J2,0.KE,E,rw,0j2,0.GF,F,2ic,ID,0"
    ".KG,G,2lk,0Zt,0..YRAB,AB,Fe,Fe,0e6,0Ju,c5cae9,A,B,,.YRBC,BC,Fe,Fe,0RY,6X,303e9f,B,C,,"
    ".YRCDE,CDE,Fe,Fe,ic,01d,0d125a,C,D,E,,.YRDF,DF,Fe,Fe,21X,Id,B2DFDB,D,F,,.YRFG,FG,Fe,Fe,2kA,08r,26A69A,F,G,,...JBm",
    "Stephenson III": "0P.TY.K,0.101.MA,A,0YP,0ce,0.GB,B,0cQ,0FI,0.GC,C,lC,1-,0.KD,D,ow,0U1,0.GE,E,033,D-,0"
    ".GF,F,Dc,nj,0.KG,G,1M0,GJ,0..YRAB,AB,Fe,Fe,0aP,0Qz,c5cae9,A,B,,.YRBCE,BCE,Fe,Fe,1w,E,303e9f,B,C,E,,"
    ".YRCD,CD,Fe,Fe,n3,0E1,0d125a,C,D,,.YREF,EF,Fe,Fe,5H,Vs,B2DFDB,E,F,,.YRFG,FG,Fe,Fe,np,X0,26A69A,F,G,,...JBe",
    "slider-crank": "0P.TY.K,0.101.MA,A,0mA,0c,0.GB,B,0Yt,bK,0.GC,C,il,H-,0.LD,D,il,H-,0..YRAB,AB,Fe,Fe,0fW,IN,c5cae9,"
    "A,B,,.YRBC,BC,Fe,Fe,4y,Rf,303e9f,B,C,,.YPCD,CD,Fe,0,0,0,,C,D,,...JAe",
}
#: how points follow from others: where two circles meet, or on a plate with two of them
FOLLOWING = {
    "four-bar": ["C BD"],
    "Watt I": ["C BG", "D=BC", "F=CG", "E DF"],
    "Watt II": ["C BE", "D=CE", "F DG"],
    "Stephenson III": ["C BD", "E=BC", "F EG"],
}
#: of the README of PMKS+, which its authors compared with MATLAB
SIX_BAR = (
    "0P.SS.K,0.101.MA,A,0wS,0bg,0.GB,B,0gW,EE,0.GC,C,Oi,6k,0.GD,D,03m,_g,0.GE,E,1FO,1I_,0.GF,F,1-C,qM,0.KG,G,1oO,0ss,0."
    ".YRAB,AB,Fe,Fe,0oU,0Bk,c5cae9,A,B,,.YRBCD,BCD,Fe,Fe,07C,Rt,303e9f,B,C,D,,.YRDE,DE,Fe,Fe,bq,18q,0d125a,D,E,,"
    ".YREF,EF,Fe,Fe,1dI,13g,B2DFDB,E,F,,.YRFCG,FCG,Fe,Fe,1Om,1Q,26A69A,F,C,G,,...JGp"
)
#: cm, for the input turned by 1, 5, -1 and -5 degrees
PUBLISHED = {
    "C": [
        (1.50571068, 0.319522125),
        (1.072453296, -0.437645825),
        (1.649271316, 0.529063777),
        (1.891985979, 0.849800888),
    ],
    "E": [
        (5.052715348, 5.478070103),
        (4.833273855, 6.201513998),
        (5.102088403, 5.134517759),
        (5.130591284, 4.163530929),
    ],
}
#: a compound of two welded links, with its own mass and a force
WELDED = (
    "0P.TY.K,0.1010.6A,A,0,0,0.0B,B,Fe,Fe,0.OC,C,VG,7q,0.0D,D,ku,Fe,0.4E,E,_W,0,0..YRAB,AB,Fe,1a,0,0,0d125a,A,B,,"
    ".YRBCD,BCD,1nI,5t,VG,Bk,26a69a,B,C,D,,BC,CD.NRBC,BC,Fe,1a,0,0,303e9f,B,C,,.NRCD,CD,Fe,1a,0,0,c5cae9,C,D,,"
    ".YRDE,DE,Fe,1a,0,0,0d125a,D,E,,..2F,BCD,Offset load,VG,Bk,VG,03w,2SG..JBb"
)
SLIDER = TEMPLATES["slider-crank"]


def changed(payload: str, old: str, new: str) -> str:
    """A payload with a change, and the check character that goes with its length."""
    assert payload.count(old) == 1
    text = payload[:-1].replace(old, new)
    return text + DIGITS[len(text.encode("utf-16-le")) // 2 % 62]


def decoded(payload: str) -> dict[str, complex]:
    """Points of the joint records, cm."""

    def number(text: str) -> float:
        size = sum(DIGITS.index(digit) * 64**place for place, digit in enumerate(reversed(text)))
        return (-size if text.startswith("0") else size) / 1000

    records = [record.split(",") for record in payload.split("..")[0].split(".")[4:]]
    return {name: complex(number(x), number(y)) for _, name, x, y, _ in records}


@pytest.mark.parametrize("name", TEMPLATES)
def test_points_of_the_templates_are_where_closed_forms_say(name: str) -> None:
    """Over a whole turn, which begins where the link is drawn."""
    payload = TEMPLATES[name]
    drawn = decoded(payload)
    turns = np.arange(0, 361, 15)
    m = jp.read(HOST + payload, drives={"A": turns.tolist()})
    result = jp.solve(m)
    found = np.asarray(result["nominal"])[:, :2] @ [0.1, 0.1j]
    expected = []
    for turn in turns:
        at = drawn | {"B": drawn["A"] + (drawn["B"] - drawn["A"]) * np.exp(1j * np.radians(turn))}
        for point, how, one, other in FOLLOWING.get(name, ()):
            three = drawn[one], drawn[other], drawn[point]
            if how == " ":
                at[point] = meeting(at[one], at[other], three)
            else:
                at[point] = at[one] + (at[other] - at[one]) * (three[2] - three[0]) / (three[1] - three[0])
        if name == "slider-crank":
            across = drawn["C"].imag - at["B"].imag
            at["C"] = at["B"] + np.sqrt(abs(drawn["C"] - drawn["B"]) ** 2 - across**2) + 1j * across
        # The last traced point that moves; the joint of the slider is traced, too, and is at the same place.
        expected.append(at["F" if "F" in at else "C"])
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert m.drives == ("A",)


@pytest.mark.parametrize("point", PUBLISHED)
def test_a_six_bar_goes_where_its_authors_have_published(point: str) -> None:
    m = jp.read(HOST + SIX_BAR, output=point, drives={"A": [1, 5, -1, -5]})
    # Nine decimals are published.
    found = np.asarray(jp.solve(m)["nominal"])[:, :2] / 10
    np.testing.assert_allclose(found, PUBLISHED[point], rtol=0, atol=2e-9)


def test_welded_links_are_one_body_with_the_mass_of_the_whole() -> None:
    m = jp.read(HOST + WELDED)
    assert m.bodies == ("AB", "BCD", "DE")
    # 7.25 g, 0.375 kg cm^2, and 10 N downward
    body = m.value("bodies.BCD")
    assert body == {"mass": 0.00725, "centre": [20, 7.5], "rotational_inertia": pytest.approx(37.5)}
    assert m.value("loads") == [{"body": "BCD", "at": [20, 7.5], "force": [0, -10]}]
    # What only a part holds is held by the whole.
    assert jp.read(HOST + changed(WELDED, "26a69a,B,C,D,", "26a69a,B,C,")).joints == m.joints


def test_units_and_sides_of_forces() -> None:
    """Inches, pounds and a force of pounds that turns with its body, against its arrow; gravity where its flag is."""
    payload = changed(changed(WELDED, ".1010.", ".0000."), ".2F,BCD", ".1F,CD")
    m = jp.read(HOST + "0R" + payload[2:])
    body = m.value("bodies.BCD")
    assert body["mass"] == pytest.approx(0.00725 / 0.001 * 0.45359237)
    assert body["centre"] == pytest.approx([50.8, 19.05])
    assert body["rotational_inertia"] == pytest.approx(0.375 * 0.45359237 * 25.4**2)
    (load,) = m.value("loads")
    assert load["force"] == pytest.approx([0, 10 * 4.4482216152605])
    assert (load["body"], load["axes"], m.value("gravity")) == ("BCD", "body", [0, -9.81])


def test_a_crank_holds_the_force_on_a_slider_by_a_torque() -> None:
    """Virtual work: what 1 N to the right on the slider asks of the crank is minus what it moves per turn, in mm."""
    force = changed(SLIDER, "C,D,,...JA", "C,D,,..2F1,BC,F1,il,H-,-il,H-,Fe..JA")
    m = jp.read(HOST + force, drives={"A": [-0.01, 0, 0.01]}, output="C")
    x = np.asarray(jp.solve(m)["nominal"])[:, 0]
    # 1 g at the pin; the text has no centre.
    assert m.value("bodies.CD") == {"mass": 0.001, "centre": [28.63, 11.51]}
    torque = jp.forces(m, "loaded", of=["drives.A"]).force.values[1, 0]
    # The difference is of the second order: (2e-4)^2.
    assert torque == pytest.approx(-(x[2] - x[0]) / np.radians(0.02), rel=1e-6)


def test_pins_of_three_links_and_names_that_are_there_twice() -> None:
    """B also holds a link to the ground, whose other pin has the name that the second pin of B would have."""
    more = "..YRBE,AB,Fe,Fe,0,0,c5cae9,B,E,,.YRAB"
    payload = changed(changed(TEMPLATES["four-bar"], "..YRAB", more), "0Pk,0.", "0Pk,0.4E,B_2,Fe,Fe,0.")
    m = jp.read(HOST + changed(payload, ",A,0mv", ",ground,0mv"))
    assert m.bodies == ("AB_", "AB", "BC", "CD")
    assert {"ground_", "B", "B_2", "B_2_"} < {*m.joints}


def test_files_and_links_on_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    payload = changed(TEMPLATES["four-bar"], "YRAB,AB", "YRAB,the crank \N{HAMMER AND WRENCH}")
    Path("a.pmks").write_text(payload + "\n", encoding="utf-8")
    link = HOST + quote(payload, safe=",.-_")
    Path("b.url").write_text(f"[InternetShortcut]\r\nURL={link}\r\n", encoding="utf-8")
    texts = []
    for place, name in (("a.pmks", "a"), ("b.url", "b"), (link, "pmks")):
        assert run(["import", place, "--clearance", "revolute={radial=0.05}", "--drives", "A=0:-90:3"]) == 0
        texts.append(Path(f"{name}.toml").read_text(encoding="utf-8").split("space ")[1])
    assert texts[0] == texts[1] == texts[2]
    assert "the_crank_\N{HAMMER AND WRENCH}" in texts[0]
    said = capsys.readouterr()
    assert "A turns at 20 rpm clockwise, against the values of its drive; the speed is left out." in said.out + said.err
    assert run(["error", "pmks.toml"]) == 0


def test_a_link_as_browsers_show_it_is_read_and_others_are_led_there(capsys: pytest.CaptureFixture[str]) -> None:
    link = HOST + TEMPLATES["four-bar"]
    short = link.removeprefix("https://")
    assert jp.read(short).raw == jp.read(link).raw
    for place in (link, short, "drawing.url"):
        assert "`jointplay import FILE` reads it" in refused(capsys, "error", place)


def test_what_is_imported_is_known_where_nothing_is_imported() -> None:
    assert {*READERS} == {*EXTENSIONS, ".json"}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("A,0mA", "A,0?A", 'joints.A: a number with digits of PMKS+ is needed, not "0?A"'),
        ("A,0mA", "A,0mA0000000000", "a number with digits"),
        (".101.", ".301.", "units: digits for inch, cm or m"),
        ("0..YRAB", "0.YRAB", "joints.RAB: is a joint of a development version"),
        (".MA,A,", ".MA,A,Q,0,0,0,", "joints.A: is a joint of a development version"),
        (".MA", ".MB", "joints: are there more than once: B"),
        (".LD,D", ".9D,D", "joints.D: slides on a link, or is welded"),
        (".LD,D", ".jD,D", "joints.D: is a joint of a development version"),
        ("YPCD", "YRCD", "joints.D: has no slider of its own"),
        ("YRBC", "XRBC", "links.BC: a link of PMKS+ is needed"),
        ("B,C,,.", "B,C.", "links.BC: a link of PMKS+ is needed"),
        ("B,C,,.", "B,Q,,.", "links.BC: 'Q' is not a joint"),
        ("B,C,,.", "B,C,,Q.", "links.BC: 'Q' is no link"),
        ("B,C,,.", "B,C,,BC.", "links.BC: 'BC' is no part of one welded link alone"),
        ("YRBC", "NRBC", "links: are parts of no welded link: BC"),
        ("YRAB,AB,Fe,Fe,0fW,IN,c5cae9,A,B,,.", "", "joints.A: is an input, but does not join exactly two links"),
        ("0..YRAB", "0.0Q,Q,1,1,0..YRQ,Q,1,1,1,1,,Q,,.YRAB", "links: nothing joins these links with the ground: Q"),
        ("...JA", "..2F1,Q,F1,1,1,1,2,Fe..JA", "forces: 'Q' is not a link"),
        ("...JA", "..2F1,AB,F1,1,1,1,1,Fe..JA", "forces.F1: its arrow has no length"),
        ("...JA", "...JA.LA", "is of a development version"),
        ("...JA", "", "links: its text ends before they do"),
        (".TY.", ".TY,1.", "is of a development version"),
    ],
)
def test_what_is_no_drawing_is_refused(old: str, new: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    message = refused(capsys, "import", HOST + changed(SLIDER, old, new))
    assert message.startswith("error: link of PMKS+: ")
    assert said in message


@pytest.mark.parametrize(
    ("link", "said"),
    [
        ("https://app.pmksplus.com/", "has no drawing behind a '?'"),
        (HOST, "0 is not a length that is read"),
        (HOST + SLIDER.replace("YRAB", "YRA"), "its last character does not fit its length"),
        (HOST + "j=A,1.4,0.485,AB,R,t,0,0.1,t,%0A&l=", "is of an early PMKS+"),
        (HOST + "pmks2:00000000.e30", "is of a coming version of PMKS+"),
        (HOST + SLIDER + "*A1b2C3", "is of a coming version of PMKS+"),
        (HOST + "a" * (1 << 21), "is not a length that is read"),
    ],
)
def test_other_links_are_refused(link: str, said: str) -> None:
    with pytest.raises(jp.InputError, match=r"^link of PMKS\+: ") as refused:
        jp.read(link)
    assert said in str(refused.value)


@pytest.mark.parametrize("seed", range(4))
def test_damaged_drawings_are_read_or_refused(seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(25):
        payload = [*rng.choice([WELDED, SLIDER, SIX_BAR])[:-1]]
        for _ in range(rng.choice((1, 1, 2, 5))):
            place = rng.randrange(len(payload))
            payload[place : place + rng.choice((0, 1, 1, 9))] = rng.choice(
                ["", "0", "-", ".", ",", "Y", "_", "A", "é", "\0"]
            )
        text = "".join(payload)
        # Any other error fails the test.
        with contextlib.suppress(jp.InputError):
            jp.read(HOST + text + DIGITS[len(text) % 62])


def test_no_force_acts_on_the_link_that_is_the_ground() -> None:
    assert jp.read(HOST + WELDED, ground="AB").value("loads")[0]["body"] == "BCD"
    assert "loads" not in jp.read(HOST + WELDED, ground="BCD").raw
