"""The drawing board: edits of a file, what they leave as it was, and what a person does on the page."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import jointplay as jp
from helpers.browser import Browser, Page, needs_browser
from helpers.studio import EXACT, SHIFT, Person, choose, number, put
from jointplay import examples
from jointplay.analyses.nominal import Nominal
from jointplay.errors import InputError
from jointplay.file import document, toml
from jointplay.show.serving import answers, drafts, gestures, naming, templates
from jointplay.show.serving.folder import Folder
from jointplay.show.serving.server import Studio

FOUR_BAR = examples.text("four-bar")
PLANAR = [name for name in examples.names() if jp.loads(examples.text(name)).raw.get("space") == "planar"]
DRAWN = [name for name in PLANAR if "patterns" not in jp.loads(examples.text(name)).raw]


# --- edits -----------------------------------------------------------------------------------------------------------


def test_an_edit_touches_its_line_and_nothing_else() -> None:
    steps = ("joints", "J2", "clearance")
    text = document.edited(FOUR_BAR, steps, {"fit": "H7/g6", "diameter": 12})
    before, after = FOUR_BAR.splitlines(), text.splitlines()
    assert len(before) == len(after)
    changed = [k for k, (a, b) in enumerate(zip(before, after, strict=True)) if a != b]
    assert [after[k] for k in changed] == ['clearance = {fit = "H7/g6", diameter = 12}']
    assert document.edited(text, (*steps, "diameter"), 16) == text.replace("12}", "16}")


@pytest.mark.parametrize("name", examples.names())
def test_tables_that_come_and_go_leave_the_comments_of_others(name: str) -> None:
    text = examples.text(name)
    joint = {"type": "revolute", "bodies": ["ground", "new"], "at": [0, 0]}
    more = document.edited(text, ("joints", "new_joint"), joint)
    assert toml.parse(more)["joints"]["new_joint"] == joint
    assert [line for line in text.splitlines() if line not in more.splitlines()] == []
    less = document.edited(more, ("joints", "new_joint"), None)
    assert toml.parse(less) == toml.parse(text)
    assert [line for line in text.splitlines() if line.strip()] == [line for line in less.splitlines() if line.strip()]


def test_a_line_is_that_of_its_key() -> None:
    lines = FOUR_BAR.splitlines()
    for key, words in [
        ("joints.J3.clearance.radial", "clearance"),
        ("limits.position", "position"),
        ("title", "title"),
    ]:
        assert lines[document.line_of(FOUR_BAR, key) - 1].startswith(words)
    assert lines[document.line_of(FOUR_BAR, "drives.theta1.speed") - 1] == "[drives.theta1]"


@pytest.mark.parametrize("name", DRAWN)
def test_what_is_renamed_is_the_same_mechanism(name: str) -> None:
    """Under every joint and every body of the file, with the names of sources that follow from them."""
    text = examples.text(name)
    m = jp.loads(text)
    others = [(kind, name) for kind, section in naming.KINDS.items() for name in [*m.raw.get(section, {})][:1]]
    for kind, old in [*others, ("body", m.owners[0])]:
        wanted = naming.renamed(m.raw, kind, old, "other_name")
        again = document.renamed(text, wanted, old, "other_name")
        assert len(again.splitlines()) == len(text.splitlines())
        other = jp.loads(again)
        np.testing.assert_array_equal(other.core_spec["guess"], m.core_spec["guess"])
        assert len(other.sources) == len(m.sources)
        assert [s.replace("other_name", old) for s in other.sources] == [*m.sources]


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("drive", {"limits": {"drives": {"a": [0, 9]}, "drive_torques": {"a": 5}}, "grid": {"a": [0, 9], "x": 3}}),
        ("drive", {"target": {"function": {"of": "angle", "value": "2 * a - max(a, 1)"}}}),
        ("drive", {"outputs": {"tip": {"target": {"dwell": {"of": "x", "drive": "a"}}}}}),
        ("drive", {"correlations": [{"sources": ["a", "J1"], "rank": 0.5}], "costs": {"a": {"a": 1}}}),
        ("drive", {"design": {"vary": {"drives.a.error": [1, 2]}}}),
        ("dimension", {"costs": {"a": {"b": 1}}, "design": {"vary": {"dimensions.a.tolerance": [1, 2]}}}),
        ("spring", {"design": {"vary": {"springs.a.stiffness": [1, 2]}}}),
    ],
)
def test_all_that_speaks_of_a_name_speaks_of_the_other_one(kind: str, told: dict[str, Any]) -> None:
    """And what else has the name keeps it: here a body, and a key of the file itself."""
    own = {naming.KINDS[kind]: {"a": {"from": 1}}, **told}
    others = {"joints": {"J1": {"on": {"a": [0, 0]}}}, "output": {"body": "a"}}
    wanted = json.loads(re.sub(r"\ba\b", "motor", json.dumps(own)))
    # Of a cost its constant part.
    wanted = {**wanted, **({"costs": {"motor": told["costs"]["a"]}} if "costs" in told else {})}
    assert naming.renamed({**own, **others}, kind, "a", "motor") == {**wanted, **others}


def test_a_gesture_that_leaves_no_valid_file_is_refused_and_the_board_stays(tmp_path: Path) -> None:
    studio = Studio(Folder(tmp_path))
    page = studio.open({"example": "four-bar"})["page"]
    with pytest.raises(InputError, match="too many drives: 'theta1' and 'drive1' command the same motion"):
        studio.edit({"page": page, "gesture": "drive", "joint": "J2"})
    assert studio.now({"page": page, "drives": [40.0]})["here"]
    # A typed text is the person's, with what is wrong in it.
    assert studio.edit({"page": page, "text": FOUR_BAR.replace('"J1"', '"J7"')})["problem"]


def places(m: jp.Mechanism, at: np.ndarray) -> dict[str, np.ndarray]:
    """Where every joint is on its first body and on its second, file units."""
    found = {}
    for name, ends in zip(m.joints, m.joint_points, strict=True):
        for end, point in zip("ab", ends, strict=True):
            body, local = m.points[point].body, np.array(m.points[point].at[:2])
            x, y, angle = (0.0, 0.0, 0.0) if body == -1 else at[body]
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            found[f"{name} {end}"] = (np.array([x, y]) + turn @ local) / m.units.length
    return found


def standing(text: str, k: int) -> tuple[jp.Mechanism, np.ndarray, np.ndarray, dict[str, tuple[float, float, float]]]:
    """A mechanism at a configuration of its path: its drives, poses, and the bodies as the page shows them, in mm."""
    m, session = jp.loads(text), drafts.read(text, "m.toml").session
    assert session is not None
    poses = session.path.poses[k]
    shown = {n: (x / 1e-3, y / 1e-3, angle) for n, (x, y, angle) in zip(m.bodies, poses.tolist(), strict=True)}
    return m, session.path.drives[k], poses, shown


def test_a_dragged_joint_goes_where_it_is_dragged_and_all_others_stay() -> None:
    """In the four-bar, whose bodies have axes of their own, at any configuration."""
    for k in (0, 5):
        m, drives, poses, shown = standing(FOUR_BAR, k)
        edits, _ = gestures.edits(m.raw, shown, {"gesture": "move", "at": {"joint": "J2"}, "to": [90, 40]})
        text = FOUR_BAR
        for steps, value in edits:
            text = document.edited(text, steps, value)
        before, after = places(m, poses), places(jp.loads(text), poses)
        assert before.keys() == after.keys()
        for name, place in after.items():
            np.testing.assert_allclose(place, [90, 40] if name.startswith("J2") else before[name], atol=1e-7)
        # And this is a configuration of the changed mechanism at the same drive value.
        moved = jp.loads(text).with_({"drives.theta1.values": [float(drives[0] / np.pi * 180.0)]})
        angles = dict(zip(m.bodies, poses[:, 2], strict=True))
        start = {f"start.{body}": {"angle": float(np.degrees(angle))} for body, angle in angles.items()}
        np.testing.assert_allclose(jp.solve(moved.with_(start)).nominal[0, :2], before["J3 a"], atol=1e-6)


def test_bars_that_keep_their_lengths_take_along_what_they_carry() -> None:
    """In the four-bar, whose bodies have axes of their own, at a configuration of its path; crank and coupler turn."""
    m, _, poses, shown = standing(FOUR_BAR, 5)
    text = document.edited(FOUR_BAR, ("output",), {"body": "coupler", "at": [30, 10]})
    text = document.edited(text, ("bodies", "coupler"), {"mass": 1, "centre": [75, 5]})
    raw = toml.parse(text)
    before = places(m, poses)
    goal = before["J1 a"] + [40, 90]
    told = {"gesture": "move", "at": {"joint": "J2"}, "to": [*goal], "keeps": "lengths"}
    for steps, value in gestures.edits(raw, shown, told)[0]:
        text = document.edited(text, steps, value)
    changed = toml.parse(text)
    after = places(jp.loads(text), poses)

    def size(at: dict[str, np.ndarray], one: str, other: str) -> float:
        return float(np.linalg.norm(at[f"{one} a"] - at[f"{other} a"]))

    for one, other in [("J1", "J2"), ("J2", "J3")]:
        assert size(after, one, other) == pytest.approx(size(before, one, other), abs=1e-7)
    assert size(after, "J3", "J4") != pytest.approx(size(before, "J3", "J4"), abs=1)
    for name in ("J1", "J4"):
        np.testing.assert_allclose(after[f"{name} a"], before[f"{name} a"], atol=1e-7)
    aim = (goal - before["J1 a"]) / np.linalg.norm(goal - before["J1 a"])
    np.testing.assert_allclose(after["J2 a"], before["J1 a"] + size(before, "J1", "J2") * aim, atol=1e-7)
    # Distances of what the coupler carries from its pins are those before.
    for old, new in [((30, 10), changed["output"]["at"]), ((75, 5), changed["bodies"]["coupler"]["centre"])]:
        for pin in ("J2", "J3"):
            own, now = (one["joints"][pin]["on"]["coupler"] for one in (raw, changed))
            assert math.dist(new, now) == pytest.approx(math.dist(old, own), abs=1e-7)


def test_a_slider_stays_in_its_guide_where_a_rod_keeps_its_length() -> None:
    kept = {"gesture": "move", "at": {"joint": "J1"}, "keeps": "lengths"}
    joints = toml.parse(draft(*SLIDER_CRANK, {**kept, "to": [30, 40]}))["joints"]
    # The crank of 50 and the rod of 130, as 5-12-13: x = 30 + sqrt(130^2 - 40^2).
    assert joints["J1"]["at"] == [30, 40]
    for name in ("J3", "J4"):
        np.testing.assert_allclose(joints[name]["at"], [30 + np.sqrt(130**2 - 40**2), 0], atol=1e-6)
    # A crank of 50 on a locked pin of the slider: two lengths hold it.
    with pytest.raises(InputError, match="the lengths to J2, J3 hold 'J1' where it is"):
        draft(*SLIDER_CRANK, {"gesture": "lock", "at": {"joint": "J3"}}, {**kept, "to": [30, 40]})


def test_the_transmission_angle_is_that_of_the_triangle_and_a_dead_centre_is_signed() -> None:
    """A four-bar of 30, 60, 60 and 90, whose rod and rocker are in line where the crank points away from its pin."""
    for (x, y), is_dead in [((0, 30), False), ((-30, 0), True)]:
        middle = np.array([x + 90, y]) / 2
        up = np.array([y, 90 - x]) / math.hypot(90 - x, y)
        top = middle + up * math.sqrt(max(60**2 - math.dist(middle, (90, 0)) ** 2, 0))
        ends = [{"at": [0, 0]}, {"at": [x, y]}, {"at": [*top]}, {"at": [90, 0]}]
        told = [
            {"gesture": "bar", "from": ends[0], "to": ends[1]},
            {"gesture": "bar", "from": {"body": "bar1", "index": 1}, "to": ends[2]},
            {"gesture": "bar", "from": {"body": "bar2", "index": 0}, "to": ends[3]},
            {"gesture": "ground", "at": {"body": "bar1", "index": 0}},
            {"gesture": "ground", "at": {"body": "bar3", "index": 0}},
            {"gesture": "drive", "joint": "J3"},
            {"gesture": "output", "at": {"joint": "J2"}},
        ]
        m = jp.loads(draft(*told))
        poses = np.zeros((1, len(m.bodies), 3))
        at = Nominal(np.zeros((1, 1)), poses, m.core.output(poses), np.zeros(1, dtype=np.uint8))
        found = answers.transmission(m, at)
        # By the law of cosines: the angle between rod and rocker, or what is left to a straight one.
        cosine = (60**2 + 60**2 - math.dist((x, y), (90, 0)) ** 2) / (2 * 60 * 60)
        assert found is not None
        assert found["alarm"] == is_dead
        assert found["text"].endswith(f"Transmission angle {math.degrees(math.acos(abs(cosine))):.1f}° at J2")


def draft(*told: dict[str, Any], text: str = drafts.EMPTY) -> str:
    """The text after gestures at the poses of the drawing."""
    for one in told:
        for steps, value in gestures.edits(toml.parse(text), {}, one)[0]:
            text = document.edited(text, steps, value)
    return text


SLIDER_CRANK = (
    {"gesture": "bar", "from": {"at": [0, 0]}, "to": {"at": [0, 50]}},
    {"gesture": "bar", "from": {"body": "bar1", "index": 1}, "to": {"at": [120, 0]}},
    {"gesture": "ground", "at": {"body": "bar1", "index": 0}},
    {"gesture": "slider", "at": {"body": "bar2", "index": 0}, "angle": 0},
    {"gesture": "drive", "joint": "J2"},
    {"gesture": "output", "at": {"joint": "J3"}},
)


def test_a_slider_crank_that_is_drawn_moves_as_one() -> None:
    text = draft(*SLIDER_CRANK)
    m = jp.loads(text)
    found = jp.solve(m)
    # The crank of 50 and the rod of 130: x = -50 sin + sqrt(130^2 - (50 cos)^2).
    turned = np.radians(np.linspace(-20, 20, 9))
    x = -50 * np.sin(turned) + np.sqrt(130**2 - (50 * np.cos(turned)) ** 2)
    np.testing.assert_allclose(found.nominal[:, 0], x, atol=1e-9)
    assert "board" not in m.raw


def test_what_is_missing_is_said_until_there_is_an_answer() -> None:
    said = []
    for count in range(len(SLIDER_CRANK) + 1):
        found = drafts.read(draft(*SLIDER_CRANK[:count]), "m.toml")
        assert found.problem is None
        assert (found.session is not None) == (count == len(SLIDER_CRANK))
        said.append(found.missing[0]["text"])
    assert said == [
        "There is no joint yet: draw a bar, or begin with a template.",
        "There is no joint yet: join a bar to the ground or to another bar.",
        "Nothing holds bar1, bar2 to the ground: put a pin on it.",
        "2 motions have no drive: drive J2?",
        "One motion has no drive: drive J2?",
        "There is no output yet: which point matters?",
        "There is no clearance and no tolerance yet: nothing is off.",
    ]


def test_a_joint_that_is_deleted_takes_its_drive_and_leaves_the_ends_of_bars() -> None:
    raw = toml.parse(draft(*SLIDER_CRANK, {"gesture": "delete", "what": {"joint": "J2"}}))
    assert "drives" not in raw
    assert raw["board"]["free"] == {"bar1": [[0, 0]]}
    raw = toml.parse(draft(*SLIDER_CRANK, {"gesture": "delete", "what": {"body": "bar2"}}))
    assert [*raw["joints"]] == ["J2", "J4"]
    assert "bar2" not in json.dumps(raw["joints"])


def test_a_guide_that_is_dragged_keeps_its_coordinate() -> None:
    text = examples.text("slider-crank")
    m, _, poses, shown = standing(text, 3)
    for steps, value in gestures.edits(m.raw, shown, {"gesture": "move", "at": {"joint": "guide"}, "to": [10, 0]})[0]:
        text = document.edited(text, steps, value)
    before, after = places(m, poses), places(jp.loads(text), poses)
    for end in "ab":
        np.testing.assert_allclose(after[f"guide {end}"] - before[f"guide {end}"], [10, 0], atol=1e-7)


@pytest.mark.parametrize("name", PLANAR[::5])
def test_whatever_is_done_leaves_a_text_that_can_be_read_and_drawn(name: str) -> None:
    random = np.random.default_rng(5)
    text, count = examples.text(name), 0
    for _ in range(12):
        raw = toml.parse(text)
        board = drafts.read(text, "m.toml").board({})
        refs = [{"joint": joint["name"]} for joint in board["joints"]]
        refs += [{"body": one["body"], "index": one["index"]} for one in board["free"]]
        refs += [{"body": body, "at": [float(v) for v in random.integers(-99, 99, 2)]} for body in board["bodies"]]
        one, other = (refs[k] if refs else {"at": [0, 0]} for k in random.integers(0, max(len(refs), 1), 2))
        gesture = str(random.choice([*gestures.GESTURES]))
        to = [float(v) for v in random.integers(-99, 99, 2)]
        told = {"gesture": gesture, "at": one, "from": one, "to": to, "what": one, "angle": 15.0, **one}
        told |= {"to": other} if gesture == "bar" else {}
        try:
            edits, _ = gestures.edits(raw, board["poses"], told)
        except InputError:
            continue
        for steps, value in edits:
            text = document.edited(text, steps, value)
        count += 1
        json.dumps(drafts.read(text, "m.toml").board(board["poses"]), allow_nan=False)
    assert count


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({"gesture": "fly"}, "is not something that the board can do"),
        ({"gesture": "bar", "from": {"at": [0, 0]}, "to": {"at": [0, 0]}}, "both ends of the bar are at one place"),
        ({"gesture": "bar", "from": {"at": [0, 0]}, "to": {"at": [0, "x"]}}, "is not a place"),
        ({"gesture": "bar"}, "this is not what the page asks"),
        ({"gesture": "bar", "from": 3, "to": []}, "this is not what the page asks"),
        ({"gesture": "move", "at": {"joint": "J9"}, "to": [0, 0]}, "'J9' is not a joint"),
        ({"gesture": "move", "at": {"body": "crank", "index": 5}, "to": [0, 0]}, "is not there any more"),
        ({"gesture": "drive", "joint": "J1"}, "'J1' has a drive already"),
        ({"gesture": "ground", "at": {"joint": "J1"}}, "'J1' is on 'ground' already"),
        ({"gesture": "length", "from": "J1", "to": "J2", "value": -1}, "is not a length"),
        ({"gesture": "delete", "what": {}}, "nothing that could be deleted"),
        ({"gesture": "delete", "what": {"load": 7}}, "is not there any more"),
        ({"gesture": "delete", "what": {"load": 0, "case": "lift"}}, "is not there any more"),
        ({"gesture": "gear", "from": {"joint": "J1"}, "to": {"at": [0, 0]}}, "wheels turn about pins"),
        ({"gesture": "gear", "from": {"joint": "J1"}, "to": {"joint": "J1"}}, "carry the same body"),
        ({"gesture": "teeth", "joint": "J1", "teeth": [20, 30]}, "is no gear pair"),
        ({"gesture": "spring", "from": {"at": [0, 0]}, "to": {"at": [9, 0]}}, "are on one body"),
        ({"gesture": "dimension", "from": {"joint": "J1"}, "to": {"joint": "J3"}}, "no body has both 'J1' and 'J3'"),
        ({"gesture": "dimension", "from": {"joint": "J2"}, "to": {"joint": "J3"}}, "have a dimension already"),
        ({"gesture": "lock", "at": {"body": "crank"}}, "'' is not a joint"),
        ({"gesture": "duplicate", "body": "crown"}, "has no two points"),
        ({"gesture": "case", "load": 3, "from": "", "to": "lift"}, "is not there any more"),
        (
            {"gesture": "move", "at": {"joint": "J2"}, "to": ["2 * size", 0]},
            "neither a number nor a variable",
        ),
        ({"gesture": "move", "at": {"joint": "J2"}, "to": ["2 * 40", 0]}, "in the axes of its bodies"),
    ],
)
def test_what_cannot_be_drawn_is_said_in_one_line(told: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        gestures.edits(toml.parse(FOUR_BAR), {}, told)


@pytest.mark.parametrize(
    "told",
    [
        {"edits": 3},
        {"edits": [[]]},
        {"edits": [[["joints", 1.5], 2]]},
        {"edits": [[[], 2]]},
        {"edits": [[["joints", "J1", 7], 2]]},
        {"edits": [[["title", "x"], 2]]},
        {"poses": {"crank": [1]}},
        {"poses": {"crank": [1, 2, float("nan")]}},
        {"rename": ["joint", "J1", "a b"]},
        {"rename": ["joint", "J1", "J2"]},
        {"rename": ["body", "ground", "frame"]},
        {"rename": ["joint"]},
    ],
)
def test_edits_that_no_page_of_ours_sends_are_refused(told: dict[str, Any], tmp_path: Path) -> None:
    studio = Studio(Folder(tmp_path))
    page = studio.open({"example": "four-bar"})["page"]
    with pytest.raises(InputError):
        studio.edit({"page": page, **told})
    assert studio.now({"page": page, "drives": [40.0]})["here"]


def test_a_fit_is_one_of_the_standard_and_its_slider_steps_through_fits(tmp_path: Path) -> None:
    studio = Studio(Folder(tmp_path))
    page = studio.open({"example": "four-bar-fits"})
    # ISO 286 for 12 mm: H7 is 0 to 18, g6 -17 to -6 micrometres.
    told = {name: (least, most) for name, least, most in studio.fits({"page": page["page"], "diameter": 12})["fits"]}
    assert told["H7/g6"] == pytest.approx((0.006, 0.035))
    knob = page["knobs"][0]
    names = [fit for fit, _, _ in knob["fits"]]
    assert names[int(knob["value"])] == "H8/f7"
    values = {knob["key"]: float(names.index("H7/h6"))}
    text = studio.text({"page": page["page"], "values": values})["text"]
    head, mark, rest = examples.text("four-bar-fits").partition("[joints.J1]")
    assert text == head + mark + rest.replace("H8/f7", "H7/h6", 1)


def test_sentence_and_table_agree_at_a_dead_centre(tmp_path: Path) -> None:
    """The sentence had what the load leaves open, and the table had not."""
    studio = Studio(Folder(tmp_path))
    text = draft(*SLIDER_CRANK, {"gesture": "load", "at": {"joint": "J3"}, "force": [0, -10]})
    for joint in ("J1", "J2", "J3"):
        text = document.edited(text, ("joints", joint, "clearance"), {"radial": 0.1})
    text = document.edited(text, ("limits", "position"), 0.2)
    page = studio.open({"text": text, "name": "m.toml"})
    found = studio.now({"page": page["page"], "drives": [0.0], "question": "loaded"})["here"]["loaded"]
    assert found["status"] == "undetermined"
    most = found["position"]["most"]
    assert most > found["position"]["value"]
    assert any(f"{most:.4g} mm" in sentence["text"] for sentence in found["sentences"])


def test_a_weld_has_no_price() -> None:
    text = examples.text("press")
    assert "main" in toml.parse(text)["costs"]
    for steps, value in gestures.edits(toml.parse(text), {}, {"gesture": "weld", "at": {"joint": "main"}})[0]:
        text = document.edited(text, steps, value)
    assert "main" not in toml.parse(text)["costs"]


def test_a_weld_of_bodies_that_are_turned_keeps_them_as_they_are_shown() -> None:
    """In the four-bar J2 is welded at a configuration of the path: the bodies stay turned as they are there."""
    _, _, poses, shown = standing(FOUR_BAR, 5)
    text = FOUR_BAR
    for told in ({"gesture": "weld", "at": {"joint": "J2"}}, {"gesture": "delete", "what": {"joint": "J4"}}):
        for steps, value in gestures.edits(toml.parse(text), shown, told)[0]:
            text = document.edited(text, steps, value)
    text = document.edited(text, ("output", "body"), "coupler")
    text = document.edited(text, ("output", "at"), [75, 0])
    text = document.edited(text, ("joints", "J3"), None)
    for section in ("dimensions", "board", "start"):
        text = document.edited(text, (section,), None)
    first, last = jp.solve(jp.loads(text)).nominal[[0, -1], 2]
    # Crank and coupler turn as one, from 22.7 to 76.39 degrees.
    turned = np.degrees(poses[1, 2] - poses[0, 2])
    np.testing.assert_allclose([first, last], np.array([22.7, 76.39]) + turned, atol=1e-6)


def test_locks_come_and_go_without_a_trace() -> None:
    text = FOUR_BAR
    for _ in range(2):
        for steps, value in gestures.edits(toml.parse(text), {}, {"gesture": "lock", "at": {"joint": "J2"}})[0]:
            text = document.edited(text, steps, value)
    assert toml.parse(text) == toml.parse(FOUR_BAR)
    assert [line for line in FOUR_BAR.splitlines() if line not in text.splitlines()] == []


def test_a_pin_that_gets_a_third_body_keeps_its_drive_and_spring_and_gives_it_back() -> None:
    """The drive of a pin of two bodies was of no joint any more when a bar was drawn to it."""
    third = {"gesture": "bar", "from": {"joint": "J1"}, "to": {"at": [0, -30]}}
    text = draft({"gesture": "spring", "joint": "J1"}, third, text=FOUR_BAR)
    raw = toml.parse(text)
    assert (raw["drives"]["theta1"]["joint"], raw["springs"]["spring1"]["joint"]) == ("J1/crank", "J1/crank")
    assert drafts.read(text, "m.toml").problem is None
    # The new bar is driven as well, and goes with its drive.
    more = draft({"gesture": "drive", "joint": "J1"}, text=text)
    assert toml.parse(more)["drives"]["drive1"]["joint"] == "J1/bar1"
    back = draft({"gesture": "delete", "what": {"body": "bar1"}}, text=more)
    assert toml.parse(back)["drives"] == toml.parse(FOUR_BAR)["drives"]
    assert toml.parse(back)["springs"]["spring1"]["joint"] == "J1"
    gone = toml.parse(draft({"gesture": "delete", "what": {"joint": "J1"}}, text=more))
    assert "drives" not in gone
    assert "springs" not in gone


def test_the_templates_move() -> None:
    for name in templates.TEMPLATES:
        found = jp.solve(jp.loads(templates.template(name)))
        assert set(found.status.values) == {"ok"}
    with pytest.raises(InputError, match="'wat' is not a template"):
        templates.template("wat")


def test_the_film_of_a_drawing_is_small_and_has_its_steps() -> None:
    path = Path(__file__).parents[2] / "docs" / "drawn.gif"
    assert path.stat().st_size < 400_000
    with Image.open(path) as film:
        assert film.n_frames >= 20


# --- what a person does ----------------------------------------------------------------------------------------------


#: the line that never leaves the screen
LINE = "document.querySelector('#line').innerText"


@needs_browser
class TestAPerson:
    def test_draws_a_four_bar_from_nothing_to_a_verdict_and_takes_all_of_it_back(self, drawer: Person) -> None:
        page = drawer.page
        drawer.judge()
        assert drawer.actions < 40
        assert "worst case: held" in page.run(LINE)
        m = jp.loads(drawer.text)
        assert m.value("joints.*.clearance.fit") == "H8/f7"
        assert m.value("limits.position") == 0.2
        assert len(m.joints) == 4
        # Back to the empty page, and forth again.
        text = drawer.text
        count = 0
        while not page.run("document.getElementById('undo').disabled"):
            drawer.press("z", 2)
            count += 1
        assert drawer.text == drafts.EMPTY
        assert page.run("document.body.dataset.saved") == "true"
        for _ in range(count):
            drawer.press("y", 2)
        assert drawer.text == text

    def test_types_length_and_angle_of_a_bar_with_a_comma(self, drawer: Person) -> None:
        drawer.use("b", (0, 0))
        drawer.page.run("document.getElementById('typed').focus()")
        drawer.page.ask("Input.insertText", text="42,5<90")
        drawer.press("Enter")
        assert toml.parse(drawer.text)["board"]["free"] == {"bar1": [[0, 0], [0, 42.5]]}

    def test_draws_by_touch(self, drawer: Person) -> None:
        drawer.press("b")
        for start, end in [((-40, 0), (0, 0)), ((0, 0), (40, 20))]:
            a, b = drawer.pixel(*start), drawer.pixel(*end)
            way = [
                {"x": p + (q - p) * part, "y": r + (s - r) * part}
                for part in (0.5, 1.0)
                for p, q, r, s in [(a[0], b[0], a[1], b[1])]
            ]
            drawer.page.ask("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": a[0], "y": a[1]}])
            for place in way:
                drawer.page.ask("Input.dispatchTouchEvent", type="touchMove", touchPoints=[place])
            drawer.page.ask("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
            drawer.done()
        raw = toml.parse(drawer.text)
        assert raw["joints"] == {"J1": {"type": "revolute", "bodies": ["bar1", "bar2"], "at": [0, 0]}}
        assert raw["board"]["free"] == {"bar1": [[-40, 0]], "bar2": [[40, 20]]}

    def test_begins_with_a_template_and_draws_on_it(self, newcomer: Person) -> None:
        """A second rod on a slider-crank that has axes of its own in every body."""
        find = "(one) => one.textContent.startsWith('slider-crankSlider')"
        newcomer.page.run(f"[...document.querySelectorAll('#start button')].find({find}).click()")
        newcomer.page.wait("document.body.classList.contains('opened') && document.body.dataset.shown > 0")
        text = newcomer.text
        point = "board.board.joints.find(({ name }) => name === 'crankpin').point"
        pin = newcomer.page.run(f"import('./studio.js').then(({{ board }}) => board.viewer.scene.places[0][{point}])")
        newcomer.use("b", pin, (150, 90))
        raw = toml.parse(newcomer.text)
        assert [*raw["joints"]["crankpin"]["on"]] == ["crank", "rod", "bar1"]
        np.testing.assert_allclose(raw["joints"]["crankpin"]["on"]["bar1"], pin, atol=1e-3)
        assert raw["joints"]["crankpin"]["on"]["crank"] == [50, 0]
        assert [line for line in text.splitlines() if line not in newcomer.text.splitlines()] == [
            "on   = { crank = [50, 0], rod = [0, 0] }"
        ]

    def test_chooses_a_fit_which_stays_one(self, person: Person) -> None:
        choose(person.page, {"file": "four-bar-fits.toml"})
        person.page.wait("document.querySelector('[data-name=\"joints.J1.clearance\"] output')")
        slider = "document.querySelector('[data-name=\"joints.J2.clearance\"] input')"
        told = "document.querySelector('[data-name=\"joints.J2.clearance\"] output').textContent"
        person.page.run(f"{slider}.value = 0, {slider}.dispatchEvent(new Event('input')), 0")
        person.page.run(f"{slider}.dispatchEvent(new Event('change')), 0")
        assert person.page.run(told) == "H6/h5: 0 to 0.019"
        person.press("s", 2)
        person.page.wait("document.getElementById('note').textContent.startsWith('saved')")
        own = examples.text("four-bar-fits")
        head, mark, rest = own.partition("[joints.J2]")
        folder = Path(person.page.run("document.querySelector('#open optgroup').label"))
        assert (folder / "four-bar-fits.toml").read_text() == head + mark + rest.replace("H8/f7", "H6/h5", 1)

    def test_drags_a_joint_and_undoes_it(self, person: Person) -> None:
        x, y = 75 * np.cos(np.radians(48.98)), 75 * np.sin(np.radians(48.98))
        person.drag((x, y), (70, 70))
        # Other joints stay where they are; the drawing is in the file, in the axes of each body.
        m = jp.loads(person.text)
        assert m.value("joints.J2.on")["crank"] != [75, 0]
        assert np.linalg.norm(m.value("joints.J2.on")["crank"]) == pytest.approx(np.hypot(70, 70), abs=2.0)
        person.press("z", 2)
        assert person.text == FOUR_BAR

    def test_moves_the_mechanism_with_shift_and_changes_nothing(self, person: Person) -> None:
        x, y = 75 * np.cos(np.radians(48.98)), 75 * np.sin(np.radians(48.98))
        person.drag((x, y), (75 * np.cos(np.radians(30)), 75 * np.sin(np.radians(30))), SHIFT)
        angle = float(person.page.run(f"{number('theta1')}.value"))
        assert angle == pytest.approx(30.0, abs=2.0)
        assert person.text == FOUR_BAR
        assert person.page.run("document.body.dataset.saved") == "true"

    def test_deletes_a_joint_by_keys_alone(self, person: Person) -> None:
        person.pick("#parts", '{"joint":"J3"}')
        person.page.run("document.querySelector('#drawing svg').focus()")
        person.press("Delete")
        assert "J3" not in toml.parse(person.text)["joints"]
        assert "motions have no drive" in person.page.run(LINE)
        person.press("z", 2)
        assert person.text == FOUR_BAR

    def test_renames_a_body_everywhere(self, person: Person) -> None:
        person.pick("#parts", '{"body":"rocker"}')
        field = "document.querySelector('#inspector .field input')"
        person.page.run(f"{field}.value = 'swing', {field}.dispatchEvent(new Event('change')), 0")
        person.done()
        assert person.text == FOUR_BAR.replace("{ coupler = [75, 0], rocker", "{ coupler = [75, 0], swing").replace(
            "rocker = [0, 0]", "swing = [0, 0]"
        ).replace("rocker = { angle", "swing = { angle").replace('"rocker"', '"swing"')

    def test_is_asked_before_anything_is_lost_and_finds_it_again(self, person: Person, browser: Browser) -> None:
        page = person.page
        person.fill("limits.position", "3.5")
        changed = person.text
        choose(page, {"example": "five-bar"})
        page.wait("document.getElementById('ask').open")
        person.tap("#ask [value=stay]")
        assert person.text == changed
        # A page that was closed without an answer.
        address = page.run("location.href")
        closed = browser.page(address, width=1280, height=800)
        closed.wait(EXACT)
        assert closed.run("document.querySelector('#left button')") is None, "the page with the changes is open"
        put(closed, "joints.J2.clearance", "0.7")
        closed.wait(EXACT)
        closed.run(f"{number('joints.J2.clearance')}.dispatchEvent(new Event('change')), 0")
        closed.close()
        other = browser.page(address, width=1280, height=800)
        other.wait("document.querySelector('#left button')")
        # Another answer does not take the offer away.
        put(other, "joints.J3.clearance", "0.6")
        other.wait(EXACT)
        other.click("#left button")
        other.wait(f"Number({number('joints.J2.clearance')}.value) === 0.7")
        choose(page, {"example": "five-bar"})
        page.wait("document.getElementById('ask').open")
        person.tap("#ask [value=lose]")
        page.wait("document.getElementById('name').value === 'five-bar.toml'")

    def test_loses_nothing_where_another_page_saves_the_same_file(self, person: Person, browser: Browser) -> None:
        """Changes of the second page that were kept went when the first one saved."""
        page = browser.page(person.page.run("location.href"), width=1280, height=800)
        page.wait("document.body.dataset.shown > 0")
        person = Person(page)
        address = page.run("location.href")
        second = browser.page(address, width=1280, height=800)
        second.wait("document.body.dataset.shown > 0")
        another = Person(second)
        another.fill("limits.position", "3.25")
        person.fill("limits.position", "3.75")
        person.press("s", 2)
        page.wait("document.body.dataset.saved === 'true'")
        second.close()

        def again(before: Page) -> Page:
            before.close()
            page = browser.page(address, width=1280, height=800)
            page.wait("document.querySelectorAll('#left p').length === 1")
            return page

        page = again(page)
        assert "position = 3.75" in Person(page).text
        page.click("#left button")
        page.wait("document.getElementById('text').value.includes('position = 3.25')")
        page.wait("document.querySelectorAll('#left p').length === 0")
        # Taken and not saved, it is kept by the page that took it.
        page = again(page)
        page.click("#left p button:nth-of-type(2)")
        page.wait("document.querySelectorAll('#left p').length === 0")
        kept = "Object.keys(localStorage).filter((key) => key.startsWith('jointplay.unsaved '))"
        assert page.run(kept) == []

    def test_sees_that_values_are_not_valid(self, person: Person) -> None:
        page = person.page
        put(page, "joints.J2.clearance", "-1")
        page.wait("document.body.classList.contains('stale')")
        assert page.text("#note").startswith("J2 radial: ")
        assert "joints.J2.clearance" in page.text("#note")
        assert float(page.run("getComputedStyle(document.querySelector('#drawing svg')).opacity")) < 0.5
        put(page, "joints.J2.clearance", "0,5")
        page.wait("!document.body.classList.contains('stale')")
        assert page.text("#note") == ""
        person.fill("limits.position", "-2")
        page.wait("document.body.classList.contains('stale')")
        assert "limits.position" in page.text("#note")
        person.press("z", 2)
        page.wait("!document.body.classList.contains('stale')")

    def test_types_in_the_text_and_is_led_to_the_line_of_an_error(self, person: Person) -> None:
        page = person.page
        person.tap("#file summary")

        def write(text: str) -> None:
            area = "document.getElementById('text')"
            page.run(f"{area}.value = {json.dumps(text)}, {area}.dispatchEvent(new Event('change')), 0")

        write(FOUR_BAR.replace("radial = 1.0", "radius = 1.0", 1))
        page.wait("document.getElementById('wrong').textContent")
        line = next(k for k, one in enumerate(FOUR_BAR.splitlines(), 1) if one.startswith("clearance"))
        assert page.text("#wrong").startswith(f"line {line}: ")
        assert "four-bar.toml: joints.J1.clearance" in page.text("#wrong")
        write(FOUR_BAR.replace("position = 4.0", "position = 1.0", 1))
        page.wait("document.querySelector('#line .missed')")
        assert page.run("document.querySelector('#inspector [data-key=\"limits.position\"]').value") == "1"

    def test_keeps_a_variant_and_compares(self, person: Person) -> None:
        page = person.page
        page.wait(EXACT)
        person.tap("#variants summary")
        person.tap("#keep")
        put(page, "joints.J2.clearance", "0.2")
        page.wait(EXACT)
        person.tap("#keep")
        rows = page.run(
            "[...document.querySelectorAll('#variants tbody tr')]"
            ".map((row) => [...row.cells].map((cell) => cell.textContent))"
        )
        worst = next(row for row in rows if row[0] == "worst case, position")
        first, second, present = (float(cell.split()[0]) for cell in worst[1:])
        assert first > second == present > 0.0
        person.tap("#variants thead input[type=checkbox]")
        assert page.run("document.querySelectorAll('.jp-other').length") > 0

    def test_saves_the_drawing_as_a_picture(self, person: Person) -> None:
        made = (
            "Promise.all([import('./studio.js'), import('./export.js')])"
            ".then(([{ board }, { exported }]) => exported(board.viewer.svg, '%s')).then((blob) => blob.%s)"
        )
        svg = person.page.run(made % ("svg", "text()"))
        assert svg.startswith("<svg")
        assert "jp-body" in svg
        size = person.page.run(
            made % ("png", "slice(0, 24).arrayBuffer()") + ".then((bytes) => [...new Uint8Array(bytes)])"
        )
        assert bytes(size[:8]) == b"\x89PNG\r\n\x1a\n"
        assert int.from_bytes(bytes(size[16:20]), "big") == 1600

    def test_has_names_for_everything_and_room_at_800_pixels(self, person: Person) -> None:
        page = person.page
        # With as many properties as there are.
        person.use("c", person.where("J2"), (-60, 80))
        person.pick("#parts", '{"joint":"J2"}')
        size = {"width": 800, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        page.ask("Emulation.setDeviceMetricsOverride", **size)
        assert page.run("document.documentElement.scrollWidth") <= 800
        fields = "[...document.querySelectorAll('button, input:not([hidden]), select, textarea')]"
        is_unnamed = "(one) => !one.textContent.trim() && !one.labels?.length && !one.ariaLabel"
        unnamed = f"{fields}.filter({is_unnamed}).map((one) => one.outerHTML)"
        assert page.run(unnamed) == []
        # Of several tools one is pressed, by its key.
        person.press("g")
        assert page.run("[...document.querySelectorAll('[aria-pressed=true]')].map((one) => one.dataset.tool)") == [
            "ground"
        ]
        box = page.run(
            "(({ bottom }) => [bottom, innerHeight])(document.getElementById('line').getBoundingClientRect())"
        )
        assert box[0] == box[1]


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("serial-2r", {"drive": "q1"}),
        ("four-bar", {"joint": "J1"}),
        ("rssr", {"joint": "crank"}),
        ("press", {"body": "rod"}),
    ],
)
def test_what_is_deleted_leaves_no_reference_behind(name: str, what: dict[str, Any]) -> None:
    """Ranges, springs and loads of what went were left; in space no joint could be deleted."""
    text = jp.examples.text(name, {"limits.drives": "{ q1 = [-400, 400] }"} if name == "serial-2r" else {})
    poses = drafts.read(text, name).board({})["poses"]
    edits, _ = gestures.edits(toml.parse(text), poses, {"gesture": "delete", "what": what})
    for steps, value in edits:
        text = document.edited(text, steps, value)
    (gone,) = what.values()
    assert f'"{gone}"' not in "\n".join(line.partition("#")[0] for line in text.splitlines())
    problem = drafts.read(text, name).problem
    assert problem is None or gone not in problem["text"]


def deleted(raw: dict[str, Any], body: str) -> tuple[dict[tuple[Any, ...], Any], list[str]]:
    edits, notes = gestures.edits(raw, {}, {"gesture": "delete", "what": {"body": body}})
    return dict(edits), notes


def test_an_order_of_assembly_and_a_load_case_lose_a_body() -> None:
    case = {"rest": [{"body": "coupler", "force": [0, 1]}], "push": [{"body": "rocker", "force": [0, 1]}]}
    raw = {**toml.parse(FOUR_BAR), "assembly": {"steps": [["crank"], ["coupler", "rocker"]]}, "load_cases": case}
    edits, notes = deleted(raw, "coupler")
    assert edits[("assembly", "steps")] == [["crank"], ["rocker"]]
    assert edits[("load_cases", "rest")] is None
    assert "The load case rest had no other load and went with it." in notes
    edits, notes = deleted({**raw, "assembly": {"base": "coupler", "steps": [["crank"]]}}, "coupler")
    assert edits[("assembly",)] is None
    assert "The order of assembly went with it." in notes


def test_what_is_designed_is_renamed() -> None:
    keys = {"joints.J3.on.coupler.0": {"from": 1, "to": 2}, "links.coupler.length": {"from": 1, "to": 2}}
    raw = {**toml.parse(FOUR_BAR), "design": {"vary": keys, "transmission": {"J3": 40}}}
    design = naming.renamed(raw, "joint", "J3", "P")["design"]
    assert [*design["vary"]] == ["joints.P.on.coupler.0", "links.coupler.length"]
    assert design["transmission"] == {"P": 40}
    design = naming.renamed(raw, "body", "coupler", "bar")["design"]
    assert [*design["vary"]] == ["joints.J3.on.bar.0", "links.bar.length"]


@pytest.mark.parametrize("text", ["[joints.A]\nbodies = 3", "joints.A = 3", "drives = 3", "[board.free]\nbar1 = 3"])
def test_half_typed_text_has_a_problem_and_no_crash(text: str) -> None:
    assert drafts.read(f"format = 1\n{text}\n", "a.toml").problem is not None


def test_a_new_table_has_the_line_ends_of_the_file() -> None:
    text = document.edited("format = 1\r\n", ("joints", "A"), {"type": "revolute", "at": [0, 0]})
    assert "\n" not in text.replace("\r\n", "")
