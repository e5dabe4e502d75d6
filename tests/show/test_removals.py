"""What goes with what is taken away on the board: a valid file remains so, or the board says what is missing."""

import random
from pathlib import Path
from typing import Any

import pytest

import jointplay as jp
from helpers.browser import Browser, needs_browser
from helpers.studio import Person, served
from jointplay import examples
from jointplay.errors import InputError
from jointplay.file import document, toml
from jointplay.show.serving import naming
from jointplay.show.serving.board import bodies_of
from jointplay.show.serving.folder import Folder
from jointplay.show.serving.server import Studio

PRESS = examples.text("press")
#: tables that are added to an example
MOST = 12
#: what a mechanism lacks that is not complete after something was taken away
LACKS = (
    "is on no other joint",
    "they place nothing: a joint that carries it is missing",
    "an elastic body reaches from a joint to another joint",
    "give one of",
)
#: what the board leaves to the text
LEFT = ("is in a pattern", "known: ", "whose place is not known here")


def told(text: str, rng: random.Random) -> str:
    """The text with more tables that speak of others by name, as far as it is valid with them."""
    raw = toml.parse(text)
    joints, drives, dimensions = ([*raw.get(key, {})] for key in ("joints", "drives", "dimensions"))
    formula = {"model": "reciprocal", "b": 1, "from": 0.01, "to": 1}
    more: list[tuple[tuple[str | int, ...], Any]] = []
    for name in drives:
        more += [(("limits", "drive_torques", name), 5), (("drives", name, "error"), 0.1), (("costs", name), formula)]
        more += [(("design", "vary", f"drives.{name}.error"), [0.01, 1]), (("grid", name), {"values": [0, 1]})]
    for name in joints:
        more += [(("limits", "reactions", name), 1e6), (("limits", "joints", name), [-1e4, 1e4])]
        more += [(("costs", name), {"choices": [{"size": 0.02, "cost": 4}]}), (("design", "transmission", name), 10)]
        more += [(("design", "vary", f"joints.{name}.clearance.radial"), [0.001, 1])]
    more += [(("costs", name), formula) for name in dimensions]
    if drives:
        dwell = {"of": rng.choice(joints), "drive": drives[0], "from": 1, "to": 2}
        more += [
            (
                ("target",),
                {"function": {"of": "x", "value": f"2 * {drives[0]}"}} if rng.random() < 0.5 else {"dwell": dwell},
            )
        ]
    bodies = dict.fromkeys(body for table in raw.get("joints", {}).values() for body in bodies_of(table))
    more += [(("assembly",), {"steps": [[body] for body in bodies if body != "ground"]})]
    more += [(("correlations",), [{"sources": dimensions[:2], "rank": 0.5}])]
    more += [(("limits", "probability"), 0.9), (("board",), {"locked": joints[:1]})]
    for steps, value in rng.sample(more, min(len(more), MOST)):
        try:
            edited = document.edited(text, steps, value)
            jp.loads(edited)
        except InputError:
            continue
        text = edited
    return text


def removals(page: dict[str, Any]) -> list[dict[str, Any]]:
    """All that the board can take away, make another of, or call otherwise."""
    raw, board = toml.parse(page["text"]), page.get("board") or {}
    found: list[dict[str, Any]] = [{"gesture": "delete", "what": {"body": body}} for body in board.get("bodies", ())]
    for section, kind in (("joints", "joint"), ("drives", "drive"), ("dimensions", "dimension"), ("springs", "spring")):
        for name, own in raw.get(section, {}).items():
            found.append({"gesture": "delete", "what": {kind: name}})
            found.append({"rename": [kind, name, f"{name}_b"]})
            keys = [key for key in ("clearance", "error", "backlash", "tolerance") if key in own]
            found += [{"edits": [[[section, name, key], None]]} for key in keys]
    found += [{"gesture": "delete", "what": {"body": p["body"], "index": p["index"]}} for p in board.get("free", ())]
    found += [{"gesture": "delete", "what": {"load": k}} for k in range(len(raw.get("loads", ())))]
    found += [{"rename": ["body", body, f"{body}_b"]} for body in board.get("bodies", ())]
    found += [{"edits": [[["limits", key], None]]} for key in ("position", "rotation") if key in raw.get("limits", {})]
    return found + ([{"gesture": "delete", "what": {"output": True}}] if "output" in raw else [])


def sources(raw: dict[str, Any]) -> set[str]:
    """The first parts of the names of all sources."""
    return {name for key in ("joints", "drives", "dimensions", "links", "followers") for name in raw.get(key, {})}


@pytest.mark.parametrize("name", examples.names())
def test_whatever_is_taken_away_the_file_is_valid_or_says_what_is_missing(name: str, tmp_path: Path) -> None:
    studio = Studio(Folder(tmp_path))
    rng = random.Random(name)
    page = studio.open({"text": told(examples.text(name), rng), "name": "m.toml"})
    for _ in range(5):
        ways = removals(page)
        if not ways:
            break
        way = rng.choice(ways)
        refused, after = "", page
        try:
            after = studio.edit({"page": page["page"], "poses": (page.get("board") or {}).get("poses", {}), **way})
        except InputError as problem:
            refused = str(problem)
        assert not refused or any(words in refused for words in (*LEFT, *LACKS)), (way, refused)
        if after["problem"]:
            assert any(words in after["problem"]["text"] for words in LACKS), (way, after["problem"]["text"])
            break
        raw = toml.parse(after["text"])
        known = sources(raw)
        own = [one for one in raw.get("costs", {}) if "patterns" not in raw]
        own += [one for entry in raw.get("correlations", ()) for one in entry["sources"]]
        assert [one for one in own if one.split(".")[0].split("/")[0] not in known] == []
        page = after


@pytest.mark.parametrize("play", [None, {"fit": "H7/g6", "diameter": 12}])
def test_a_price_goes_with_its_clearance(play: Any, tmp_path: Path) -> None:
    """None left a price behind that made the file invalid; a fit left prices of sizes."""
    studio = Studio(Folder(tmp_path))
    text = document.edited(examples.text("four-bar"), ("costs", "J2"), {"choices": [{"size": 0.1, "cost": 3}]})
    text = document.edited(text, ("limits", "reactions"), {"J2": 100})
    page = studio.open({"text": text, "name": "m.toml"})
    after = studio.edit({"page": page["page"], "edits": [[["joints", "J2", "clearance"], play]]})
    assert after["problem"] is None
    assert after["notes"] == ["costs.J2 went with it."]
    raw = toml.parse(after["text"])
    assert "costs" not in raw
    assert raw["limits"]["reactions"] == {"J2": 100}
    # And what was typed is refused as it was before.
    wrong = studio.edit({"page": after["page"], "edits": [[["costs", "J9"], {"choices": [{"size": 1, "cost": 1}]}]]})
    assert "'J9' is not a source" in wrong["problem"]["text"]


def test_names_within_names_are_renamed() -> None:
    """A joint of several on its pin, J1/rod, was left by what speaks of it when the joint or the body was renamed."""
    raw = {
        "joints": {
            "J": {"type": "revolute", "bodies": ["ground", "a", "b"], "at": [0, 0]},
            "K": {"bodies": ["a", "b"]},
        },
        "drives": {"d": {"joint": "J/a"}, "m": {"joints": {"J/b": 1, "K": 2}, "backlash": {"K": 1}}},
        "limits": {"reactions": {"J/a": 1, "K": 2}},
        "costs": {"J/a": {}, "K.runout.a": {}, "m.backlash.K": {}, "a": {}},
        "target": {"dwell": {"of": "K"}},
    }
    other = naming.renamed(raw, "joint", "J", "pin")
    assert other["drives"]["d"] == {"joint": "pin/a"}
    assert other["drives"]["m"]["joints"] == {"pin/b": 1, "K": 2}
    assert other["limits"]["reactions"] == {"pin/a": 1, "K": 2}
    assert [*other["costs"]] == ["pin/a", "K.runout.a", "m.backlash.K", "a"]
    other = naming.renamed(raw, "body", "a", "arm")
    assert other["drives"]["d"] == {"joint": "J/arm"}
    assert other["limits"]["reactions"] == {"J/arm": 1, "K": 2}
    assert [*other["costs"]] == ["J/arm", "K.runout.arm", "m.backlash.K", "a"]
    other = naming.renamed(raw, "joint", "K", "L")
    assert [*other["costs"]] == ["J/a", "L.runout.a", "m.backlash.L", "a"]
    assert other["target"] == {"dwell": {"of": "L"}}


@needs_browser
def test_a_clearance_and_its_price_come_back_together(folder: Path, browser: Browser) -> None:
    (folder / "press.toml").write_text(PRESS)
    assert "main" in toml.parse(PRESS)["costs"]
    with served(folder, "press.toml") as server:
        page = browser.page(server.address, width=1280, height=800)
        page.wait("document.body.dataset.shown > 0")
        drawer = Person(page)
        drawer.pick("#parts", '{"joint":"main"}')
        drawer.pick("#way", "none")
        raw = toml.parse(drawer.text)
        assert "clearance" not in raw["joints"]["main"]
        assert "main" not in raw["costs"]
        assert "costs.main went with it." in page.run("document.getElementById('note').textContent")
        assert not page.run("document.body.classList.contains('stale')")
        drawer.press("z", 2)
        assert drawer.text == PRESS
