"""Limits of forces in the studio: its verdict is that of `error`, found when the sliders rest."""

from pathlib import Path

import pytest

import jointplay as jp
from helpers.browser import Browser, needs_browser
from helpers.studio import EXACT, Person, put, served
from jointplay import examples
from jointplay.analyses import beside
from jointplay.file import document, toml
from jointplay.result import FORCES_JUDGED
from jointplay.show.serving.folder import Folder
from jointplay.show.serving.server import Studio

NOTE = "document.getElementById('note').textContent"


def limited(reaction: float) -> str:
    return document.edited(examples.text("four-bar"), ("limits", "reactions"), {"J1": reaction})


@pytest.mark.parametrize(("reaction", "outcome"), [(1000.0, "held"), (1.0, "missed")])
def test_limits_of_forces_are_judged_as_they_are_beside_errors(reaction: float, outcome: str, tmp_path: Path) -> None:
    text = limited(reaction)
    studio = Studio(Folder(tmp_path))
    page = studio.open({"text": text, "name": "m.toml"})
    assert page["forces"]
    told = studio.settled({"page": page["page"], "drives": page["begin"], "samples": 0})["forces"]
    assert told["outcome"] == outcome == str(beside.judged(jp.loads(text))[FORCES_JUDGED].values)
    most = jp.forces(jp.loads(text))["force"].sel(quantity="joints.J1", side="high").max()
    cells = {c["head"]: c["cells"] for c in told["tables"][-1]["columns"]}
    joints = cells[""]
    assert float(cells["with play most [N]"][joints.index("J1")]) == pytest.approx(float(most), rel=1e-3)
    assert told["rests"]


@needs_browser
def test_the_verdict_of_forces_stands_in_the_line_and_follows_a_load(folder: Path, browser: Browser) -> None:
    (folder / "m.toml").write_text(limited(100.0))
    with served(folder, "m.toml") as server:
        page = browser.page(server.address, width=1280, height=800)
        page.wait("document.querySelector('#line [data-question=forces].held')")
        assert page.run("document.querySelectorAll('#verdict table.forces').length") == 2
        put(page, "loads.0.force.1", "-5000")
        page.wait("document.querySelector('#line [data-question=forces].missed')")
        page.wait(EXACT)
        assert "forces in the worst case" in page.text("#verdict")
        assert page.text("#verdict p").startswith("✗ Limits missed: ")
        assert "reactions" in page.text("#verdict") or "joints.J1" in page.text("#verdict")


def test_the_page_judges_forces_itself_and_says_where(tmp_path: Path) -> None:
    studio = Studio(Folder(tmp_path))
    for text, is_said in [(limited(1000.0), True), (examples.text("four-bar"), False)]:
        page = studio.open({"text": text, "name": "m.toml"})
        asked = {"page": page["page"], "drives": page["begin"]}
        for told in (studio.now(asked), studio.settled({**asked, "samples": 0})):
            for here in told["here"].values():
                said = [one["text"] for one in here["sentences"]]
                assert any("the last line has their verdict" in one for one in said) == is_said
                assert not any("do not count" in one for one in said)
            assert not any("of forces" in one["text"] for path in told["path"].values() for one in path["sentences"])


def test_a_limit_of_forces_is_a_limit(tmp_path: Path) -> None:
    text = examples.text("four-bar")
    studio = Studio(Folder(tmp_path))
    bare = document.edited(text, ("limits", "position"), None)
    found = [studio.open({"text": one, "name": "m.toml"})["board"]["missing"] for one in (text, bare)]
    assert [len(one) for one in found] == [0, 1]
    forces = document.edited(bare, ("limits", "drive_torques"), {"theta1": 5.0})
    assert studio.open({"text": forces, "name": "m.toml"})["board"]["missing"] == []


@needs_browser
def test_limits_of_forces_are_typed_changed_and_deleted(person: Person) -> None:
    page, text = person.page, person.text
    person.fill("limits.reactions.J1", "1000")
    assert toml.parse(person.text)["limits"] == {"position": 4.0, "reactions": {"J1": 1000}}
    page.wait("document.querySelector('#line [data-question=forces].held')")
    person.fill("limits.reactions.J1", "1,5")
    page.wait("document.querySelector('#line [data-question=forces].missed')")
    person.fill("limits.drive_torques.theta1", "-5e4; 8e4")
    person.fill("limits.reactions.J2", "peak = 120")
    raw = toml.parse(person.text)
    assert raw["limits"]["drive_torques"] == {"theta1": [-50000, 80000]}
    assert (raw["limits"]["reactions"], raw["variables"]) == ({"J1": 1.5, "J2": "peak"}, {"peak": 120})
    page.wait(f"{EXACT} && document.querySelectorAll('#verdict table.forces').length")
    person.fill("limits.drive_torques.theta1", "-60000; 8e4")
    assert toml.parse(person.text)["limits"]["drive_torques"] == {"theta1": [-60000, 80000]}
    limits = person.text
    # What is no limit is refused with its field named, and what the file refuses is said and undone.
    for key, typed, words in [
        ("reactions.J1", "much", "reaction at J1: 'much' is not a number"),
        ("drive_torques.theta1", "1; 2; 3", "moment of theta1: '1; 2; 3' is not a lowest and a highest value"),
        ("reactions.J1", "1; 2", "reaction at J1: '1; 2' is not a number"),
        ("reactions.J1", 9999 * "x", f"reaction at J1: '{60 * 'x'}…' is not a number"),
        ("drive_torques.theta1", "<b>", "moment of theta1: '<b>' is not a number"),
    ]:
        person.fill(f"limits.{key}", typed)
        assert page.run(NOTE).startswith(words)
        assert len(page.run(NOTE)) < 250
        assert person.text == limits
        person.fill(f"limits.{key}", str({"reactions.J1": 1.5}.get(key, "-60000; 80000")))
    for key, typed, words in [
        ("reactions.J1", "-1", "limits.reactions.J1"),
        ("drive_torques.theta1", "8; -5", "a range is [lowest, highest]"),
        # A value of the pair has the field of both.
        ("drive_torques.theta1", "-8; 1e308", "limits.drive_torques.theta1.1: must be at most"),
    ]:
        person.fill(f"limits.{key}", typed)
        assert words in page.run(NOTE)
        assert page.run(f"document.querySelector('#inspector [data-key=\"limits.{key}\"]').ariaInvalid") == "true"
        person.press("z", 2)
        assert person.text == limits
    for key in ("reactions.J1", "reactions.J2", "drive_torques.theta1"):
        person.fill(f"limits.{key}", "")
    assert {**toml.parse(person.text), "variables": {}} == {**toml.parse(text), "variables": {}}
    page.wait("!document.querySelector('#line [data-question=forces]')")
    while not page.run("document.getElementById('undo').disabled"):
        person.press("z", 2)
    assert person.text == text


@needs_browser
def test_a_limit_of_a_force_is_entered_by_keys_and_has_a_name(person: Person) -> None:
    person.tab("document.activeElement.dataset.key === 'limits.reactions.J3'")
    person.type("250")
    person.press("Enter")
    assert toml.parse(person.text)["limits"]["reactions"] == {"J3": 250}
    every = person.page.ask("Accessibility.getFullAXTree")["nodes"]
    fields = [one["name"]["value"] for one in every if one.get("role", {}).get("value") == "textbox"]
    assert fields.count("reaction at J3") == 1
    assert fields.count("moment of theta1") == 1
    # A joint that goes takes its limit along, and a joint with another name its limit.
    person.pick("#parts", '{"joint":"J3"}')
    person.fill("joint.J3.name", "top")
    assert toml.parse(person.text)["limits"]["reactions"] == {"top": 250}


@needs_browser
def test_of_many_joints_the_chosen_one_has_a_limit(folder: Path, browser: Browser) -> None:
    bars = "".join(
        f'[joints.p{k}]\ntype = "revolute"\nbodies = ["b{k}", "b{k + 1}"]\nat = [{10 * k}, 0]\n' for k in range(14)
    )
    drives = "".join(f'[drives.d{k}]\njoint = "p{k}"\nvalues = [0, 5]\n' for k in range(14))
    head = 'format = 1\ntitle = "arm"\nspace = "planar"\nunits = { length = "mm", angle = "deg", force = "N" }\n'
    text = f'{head}[output]\nbody = "b14"\nat = [10, 0]\n{bars}{drives}'.replace('"b0"', '"ground"')
    (folder / "arm.toml").write_text(text)
    with served(folder, "arm.toml") as server:
        page = browser.page(server.address, width=1280, height=800)
        page.wait("document.body.dataset.shown > 0")
        arm = Person(page)
        every = "[...document.querySelectorAll('#inspector [data-key^=\"limits.reactions\"]')]"
        fields = f"{every}.map((one) => one.dataset.key)"
        assert page.run(fields) == []
        arm.pick("#parts", '{"joint":"p9"}')
        assert page.run(fields) == ["limits.reactions.p9"]
        arm.fill("limits.reactions.p9", "40")
        arm.pick("#parts", '{"joint":"p3"}')
        assert page.run(fields) == ["limits.reactions.p3", "limits.reactions.p9"]
