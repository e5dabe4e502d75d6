"""Drawings of Linkage: closed forms of published drawings along a turn, and what is refused.

Coordinates are those of the files of https://github.com/bodysoda2022/practical, and of one example of the program.
"""

import contextlib
import random
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.commands import refused
from helpers.geometry import meeting
from jointplay.cli import run

#: mm of the unit of the files
UNIT = 25.4 / 96
INPUT = 'anchor="true" input="true"'
LIMITS = '<slidelimit id="3"/><slidelimit id="4"/>'


def drawing(connectors: dict[int, tuple[complex, str]], links: list[str], more: str = "") -> str:
    """The text of a drawing; each link is its connectors with blanks."""
    lines = []
    for own, (at, keys) in connectors.items():
        keys, _, within = keys.partition("|")
        lines.append(f'<connector id="{own}" layer="16" x="{at.real}" y="{at.imag}" {keys}>{within}</connector>')
    for own, link in enumerate(links):
        held = "".join(f'<connector id="{one}"/>' for one in link.split())
        lines.append(f'<Link id="{own}" layer="16" solid="true">{held}</Link>')
    return '<linkage2>\n\t<program units="Millimeters"/>\n' + "\n".join(lines) + f"{more}\n</linkage2>\n"


FOUR_BAR = {
    7: (18.897638 - 188.976378j, f'{INPUT} rpm="30.000000"'),
    10: (283.464567 - 188.976378j, 'anchor="true"'),
    12: (85.069606 - 95.062677j, 'draw="true"'),
    2: (332.493731 - 18.720315j, ""),
    0: (85.069606 - 95.062677j, 'draw="true"'),
    3: (332.493731 - 18.720315j, ""),
}
PICK_AND_PLACE = {
    1: (132.283465 + 37.795276j, f'{INPUT} rpm="0.000000"'),
    5: (237.604987 + 132.283465j, ""),
    6: (151.181102 + 170.078740j, ""),
    7: (160.675165 + 232.269717j, ""),
    8: (10.102299 + 132.283465j, 'draw="true"'),
    10: (188.976378 + 132.283465j, ""),
    0: (237.604913 + 37.795276j, f'{INPUT} rpm="15.000000"'),
    3: (181.078740 + 31.795276j, 'anchor="true"'),
}
SLIDING_CRANK = {
    1: (-191.181102 - 10j, f'{INPUT} rpm="-15.000000"'),
    2: (-188.976378 + 44.401890j, 'draw="true"'),
    3: (-48.335009 - 21.691118j, 'anchor="true"'),
    4: (216.210284 - 18.307622j, 'anchor="true"'),
    6: (82.674893 - 20.015520j, f'slider="true"|{LIMITS}'),
}
#: an example of the program: a slot that turns about its first end, in which the crank has a pin
TURNING_SLOT = {
    0: (505.5 - 266.5j, 'anchor="true"'),
    1: (505.5 - 126j, ""),
    2: (461 - 266.5j, f'{INPUT} rpm="3.5"'),
    3: (505.5 - 204j, 'slider="true"|<slidelimit id="0"/><slidelimit id="1"/>'),
}
CRANK = drawing(SLIDING_CRANK, ["1 2", "3 4", "6 2"])


def moved(text: str, **options: Any) -> np.ndarray:
    """The output as a complex number, in the unit of the files."""
    Path("a.linkage2").write_text(text, encoding="utf-8")
    return np.asarray(jp.solve(jp.read("a.linkage2", **options))["nominal"])[:, :2] @ [1, 1j] / UNIT


def turned(point: complex, about: complex, degrees: np.ndarray) -> np.ndarray:
    return about + (point - about) * np.exp(1j * np.radians(degrees))


def test_a_four_bar_with_a_link_that_nothing_joins(capsys: pytest.CaptureFixture[str]) -> None:
    text = drawing(FOUR_BAR, ["12 7", "7 10", "2 12", "2 10", "3 0"])
    at = {own: point for own, (point, _) in FOUR_BAR.items()}
    turns = np.array([0.0, -20, -40, -60])
    pin = turned(at[12], at[7], turns)
    np.testing.assert_allclose(moved(text, drives={"H": turns.tolist()}), pin, atol=1e-9)
    coupler = meeting(pin, at[10], (at[12], at[10], at[2]))
    np.testing.assert_allclose(moved(text, drives={"H": turns.tolist()}, output="C"), coupler, atol=1e-9)
    assert run(["import", "a.linkage2", "--clearance", "revolute={radial=0.05}", "--drives", "H=0:-60:4"]) == 0
    said = " ".join(Path("a.toml").read_text(encoding="utf-8").replace("\n#", "").split())
    assert "Nothing joins these links with the ground, and they are left out: link_5." in said
    assert "H turns at 30 rpm clockwise, against the values of its drive; the speed is left out." in said
    assert "The output is M; --output-point names another joint." in said
    assert run(["error", "a.toml"]) == 0
    assert not capsys.readouterr().err.startswith("error")


def test_two_inputs_move_the_point_of_a_link_with_three_connectors() -> None:
    """Whatever the unit is that the program shows, beside drawings, measurements, and a pin that is traced, too."""
    more = '<Link id="9" layer="1"><connector id="1"/><connector id="9"/></Link><connector id="9" layer="1" x="?"/>'
    more += '<Link id="9" measurementelement="true"><connector id="7"/><connector id="3"/></Link>'
    traced = PICK_AND_PLACE | {10: (PICK_AND_PLACE[10][0], 'draw="true"')}
    text = drawing(traced, ["1 6", "6 10", "5 7", "6 7 8", "10 3", "0 5"], more).replace("Millim", "Inches")
    at = {own: point for own, (point, _) in PICK_AND_PLACE.items()}
    one, other = np.array([0.0, 8, 8, -5]), np.array([0.0, 0, 6, 9])
    found = moved(text, drives={"B": one.tolist(), "A": other.tolist()})
    shoulder, elbow = turned(at[6], at[1], one), turned(at[5], at[0], other)
    third = meeting(shoulder, elbow, (at[6], at[5], at[7]))
    expected = shoulder + (third - shoulder) * (at[8] - at[6]) / (at[7] - at[6])
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_crank_moves_a_slider_along_a_line() -> None:
    at = {own: point for own, (point, _) in SLIDING_CRANK.items()}
    turns = np.arange(0.0, 361, 45)
    pin = turned(at[2], at[1], turns)
    along = (at[4] - at[3]) / abs(at[4] - at[3])
    seen, drawn = (pin - at[3]) / along, (at[6] - at[2]) / along
    expected = at[3] + along * (seen.real + np.sqrt(abs(drawn) ** 2 - seen.imag**2))
    # The slider of the file is on its line but for the six decimals of the file.
    np.testing.assert_allclose(moved(CRANK, output="G", drives={"B": turns.tolist()}), expected, atol=2e-6)


def test_a_slot_turns_with_its_link() -> None:
    """Its end is in the direction of the pin of the crank."""
    at = {own: point for own, (point, _) in TURNING_SLOT.items()}
    turns = np.array([0.0, 15, -30, -60])
    pin = turned(at[3], at[2], turns)
    expected = at[0] + abs(at[1] - at[0]) * (pin - at[0]) / abs(pin - at[0])
    found = moved(drawing(TURNING_SLOT, ["0 1", "2 3"]), output="B", drives={"C": turns.tolist()})
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_slider_that_two_links_share_is_a_pin_of_theirs() -> None:
    """The second link trails it to an anchor, and without the first crank it moves the slider all the same."""
    more = SLIDING_CRANK | {8: (90 + 60j, ""), 9: (140 + 70j, f"{INPUT} rpm='1'")}
    at = {own: point for own, (point, _) in more.items()}
    text = drawing(more | {1: (at[1], 'anchor="true"')}, ["1 2", "3 4", "6 2", "6 8", "8 9"])
    turns = np.array([0.0, 4, 8])
    slider = moved(text, output="G", drives={"J": turns.tolist()})
    assert np.abs(slider - turned(at[8], at[9], turns)) == pytest.approx(abs(at[6] - at[8]), abs=2e-6)
    assert ((slider - at[3]) / (at[4] - at[3])).imag == pytest.approx(0, abs=1e-8)


def test_a_rod_slides_through_a_pin_on_the_ground() -> None:
    """Its end is in the direction of the anchor, seen from the pin of the crank."""
    at = {0: 0j, 1: 20 + 10j, 2: 140 - 20j, 3: 100 - 10j}
    keys = [f"{INPUT} rpm='1'", "", "", 'anchor="true" slider="true"|<slidelimit id="1"/><slidelimit id="2"/>']
    text = drawing({own: (at[own], keys[own]) for own in at}, ["0 1", "1 2", "3"])
    turns = np.array([0.0, 20, -30])
    pin = turned(at[1], at[0], turns)
    expected = pin + abs(at[2] - at[1]) * (at[3] - pin) / abs(at[3] - pin)
    np.testing.assert_allclose(moved(text, output="C", drives={"A": turns.tolist()}), expected, atol=1e-9)


def test_links_with_like_names_and_connectors_with_the_same_name() -> None:
    """A second crank on a pin of its own was taken for the first one with a slip of the pen."""
    more = {30: (300 + 0j, f"{INPUT} name='a/b'"), 31: (340 + 0j, 'name="P"'), 32: (350 + 0j, 'name="P"')}
    text = drawing(SLIDING_CRANK | more, ["1 2", "3 4", "6 2", "30 31 32"])
    for own, name in (("0", "crank"), ("3", "cranck")):
        text = text.replace(f'<Link id="{own}"', f'<Link id="{own}" name="{name}"')
    Path("a.linkage2").write_text(text, encoding="utf-8")
    m = jp.read("a.linkage2", output="C")
    assert m.bodies == ("crank", "link_3", "cranck")
    assert m.drives == ("B", "a_b")
    assert jp.read("a.linkage2", output="P_").value("output.at") == pytest.approx([350 * UNIT, 0])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<linkage2>", "<!DOCTYPE a><linkage2>", "has a document type"),
        ("linkage2>", "mujoco>", "has the root element <mujoco>; a Linkage file has <linkage2>"),
        ('<Link id="2" ', '<Link id="2" gear="true" ', "link 'link_3': is a gear; gears, actuators and fastened links"),
        ('<Link id="2" ', '<Link id="2" actuator="true" throw="9" ', "link 'link_3': is an actuator;"),
        ('<Link id="2" ', '<Link id="2" fastenlink="0" ', "link 'link_3': is fastened;"),
        ('<connector id="2" l', '<connector id="2" fastenlink="0" l', "connector 'C': is fastened; unfasten it"),
        ('slider="true"', 'slider="true" slideradius="-40"', "connector 'G': slides on an arc"),
        ('<slidelimit id="4"/>', "", "connector 'G': needs two connectors as limits, not 3"),
        (
            '<slidelimit id="4"/>',
            '<slidelimit id="9"/>',
            "connector 'G': slides between connectors of which there is no '9'",
        ),
        (LIMITS, "", "connector 'G': needs two connectors as limits, not none"),
        ('<slidelimit id="4"/>', "<slidelimit/>", "connector 'G': slides between connectors of which there is no ''"),
        ('<slidelimit id="4"/>', '<slidelimit id="3"/>', "slides between connectors that no link has at two places"),
        ('<slidelimit id="4"/>', '<slidelimit id="6"/>', "slides between connectors that no link has at two places"),
        ('y="-20.01552"', 'y="-21"', "connector 'G': is off the line on which it slides"),
        ('y="-20.01552"', 'y="1_0"', "connector 'G' y: a number is needed"),
        (' y="-20.01552"', "", "connector 'G' y: a number is needed"),
        ('id="6" l', 'id="2" l', "connectors named twice: 2"),
        ('id="6" l', 'id="x" l', 'connectors: whole numbers are needed as their ids, not "x"'),
        ('id="6"/>', 'id="9"/>', "link 'link_3': '9' is not the id of a connector"),
        ('rpm="-15.000000"', 'rpm="fast"', "connector 'B' rpm: a number is needed"),
        ('draw="true"', 'input="true"', "connector 'C': is an input, but is no anchor of one moving link"),
        ("</linkage2>", '<Link id="3"><connector id="1"/><connector id="6"/></Link></linkage2>', "of one moving link"),
        ("</linkage2>", '<connector id="7" x="0" y="0"/>' * 1001 + "</linkage2>", "connectors: 1006 is not a number"),
        ('anchor="true"', "", "connector 'B': is an input"),
    ],
)
def test_what_is_no_such_drawing_is_refused(old: str, new: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert old in CRANK
    Path("a.linkage2").write_text(CRANK.replace(old, new), encoding="utf-8")
    message = refused(capsys, "import", "a.linkage2")
    assert message.startswith("error: a.linkage2: ")
    assert said in message


@pytest.mark.parametrize("seed", range(4))
def test_damaged_drawings_are_read_or_refused(seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(25):
        text = [*CRANK]
        for _ in range(rng.choice((1, 1, 2, 5))):
            place = rng.randrange(len(text))
            text[place : place + rng.choice((0, 1, 1, 9))] = rng.choice(["", "0", "-", ".", '"', "<", "1", "e9", "é"])
        Path("a.linkage2").write_text("".join(text), encoding="utf-8")
        # Any other error fails the test.
        with contextlib.suppress(jp.InputError):
            jp.read("a.linkage2")


@pytest.mark.parametrize(
    "word", ["output", "ground", "<script>alert(1)</script>", '"]\n[limits]', "a.b/c*d", "n" * 9999]
)
def test_names_that_mean_something_here_are_those_of_other_things(word: str) -> None:
    """A link called output was taken for the point of that name, which ended in a KeyError; such a pin was refused."""
    said = word.translate({ord(one): f"&#{ord(one)};" for one in '<>"&\n'})
    text = drawing(FOUR_BAR, ["12 7", "7 10", "2 12", "2 10"])
    for named in (
        text.replace('<Link id="2"', f'<Link id="2" name="{said}"').replace(
            '<Link id="3"', f'<Link id="3" name="{said}"'
        ),
        text.replace('<connector id="2" layer', f'<connector id="2" name="{said}" layer'),
    ):
        Path("a.linkage2").write_text(named, encoding="utf-8")
        m = jp.read("a.linkage2", clearance={"revolute": {"radial": 0.05}})
        assert len(m.joints) == 4
        assert np.isfinite(jp.worst(m)["worst_position"]).all()
        assert max(map(len, (*m.bodies, *m.joints))) <= 100
    # The pin of this name is the output.
    if word == "output":
        assert m.value("output.at") == pytest.approx(m.value("joints.output_2.at"))


def test_a_long_chain_is_read_in_bounded_time() -> None:
    """Of a chain of a thousand bars as many joints are driven; to choose them took some minutes."""
    count = 400
    ends = {0: f"{INPUT} rpm='1'", count - 1: 'anchor="true"'}
    pins = {k: (10.0 * k + 20j * (k % 7), ends.get(k, "")) for k in range(count)}
    Path("a.linkage2").write_text(drawing(pins, [f"{k} {k + 1}" for k in range(count - 1)]), encoding="utf-8")
    begin = time.process_time()
    m = jp.read("a.linkage2")
    assert time.process_time() - begin < 30.0
    # A closed chain in the plane has as many free motions as joints but three.
    assert len(m.drives) == count - 3
