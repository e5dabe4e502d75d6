"""Random sessions in front of the board: whatever is clicked, dragged and typed, one gets back to where one began."""

import json
import random
import traceback
from pathlib import Path

import pytest

from helpers.browser import Browser, needs_browser
from helpers.studio import DONE, SHIFT, Person, choose, served
from jointplay import examples
from jointplay.show.serving import server as serving

pytestmark = needs_browser

NOTE = "document.getElementById('note').textContent"
KEYS = [*"vbpgstwecdofijrlnhm", "Delete", "Enter", "Escape", "Home", "ArrowUp", "ArrowRight"]
FIELDS = "[...document.querySelectorAll('#inspector input[data-key]')]"
TYPED = ["", "0", "-12,5", "45", "crank = 30", "crank/2", "1e9", "x;y", "1; 2; 3", "J9", "0.1"]
#: actions of a session
LONG = 40


def act(person: Person, rng: random.Random) -> str:
    """One random action; gives what it was."""
    page = person.page

    def place() -> tuple[float, float]:
        joints = page.run(
            "import('./studio.js').then(({ board }) => board.board.joints.filter((one) => one.at).map((one) => one.at))"
        )
        if joints and rng.random() < 0.6:
            x, y = rng.choice(joints)
            if abs(x) < 300 and abs(y) < 200:
                return x, y
        return float(rng.randrange(-100, 101, 20)), float(rng.randrange(-60, 61, 20))

    kind = rng.choice(["key", "key", "click", "click", "click", "drag", "drag", "field", "undo", "redo", "button"])
    told = ""
    if kind == "key":
        told = rng.choice(KEYS)
        page.run("document.activeElement?.blur?.(), 0")
        person.press(told)
    elif kind == "click":
        told = str(place())
        person.click(*json.loads(f"[{told[1:-1]}]"))
    elif kind == "drag":
        a, b = place(), place()
        told = f"{a} {b}"
        person.drag(a, b, rng.choice([0, 0, 0, SHIFT, 1]))
    elif kind == "field":
        count = page.run(f"{FIELDS}.length")
        if count:
            k, text = rng.randrange(count), rng.choice(TYPED)
            told = f"{page.run(f'{FIELDS}[{k}].dataset.key')} = {text}"
            page.run(f"{FIELDS}[{k}].focus(), {FIELDS}[{k}].select(), 0")
            page.ask("Input.insertText", text=text)
            person.press("Enter")
    elif kind == "button":
        buttons = "[...document.querySelectorAll('#inspector button, #missing button, #play button')]"
        count = page.run(f"{buttons}.length")
        if count:
            k = rng.randrange(count)
            told = page.run(f"{buttons}[{k}].textContent")
            page.run(f"{buttons}[{k}].click(), 0")
            person.done()
    else:
        page.run("document.activeElement?.blur?.(), 0")
        person.press("z" if kind == "undo" else "y", 2)
    return f"{kind} {told}"


@pytest.mark.parametrize("seed", range(50))
def test_a_random_session_leads_back_to_its_beginning(
    seed: int, folder: Path, browser: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    slips: list[str] = []
    monkeypatch.setattr(serving.traceback, "print_exc", lambda: slips.append(traceback.format_exc()))
    rng = random.Random(seed)
    begin = rng.choice([{"new": True}, {"new": True}, *({"example": name} for name in ("four-bar", "slider-crank"))])
    with served(folder, "") as server:
        page = browser.page(server.address, width=1280, height=800)
        page.wait("document.querySelectorAll('#open option').length > 20")
        choose(page, begin)
        page.wait("document.body.classList.contains('opened')")
        person = Person(page)
        first = person.text
        if "example" in begin:
            assert first == examples.text(begin["example"])
        done = []
        for _ in range(LONG):
            done.append(act(person, rng))
            assert slips == [], (done, slips)
            note = page.run(NOTE)
            assert "cannot be answered" not in note, done
            assert "Traceback" not in note, done
        page.run("document.activeElement?.blur?.(), 0")
        for _ in range(2 * LONG):
            if page.run("document.getElementById('undo').disabled"):
                break
            page.run("document.getElementById('undo').click(), 0")
            page.wait(DONE)
        assert page.run("document.getElementById('undo').disabled"), done
        assert person.text == first, done
        assert slips == [], (done, slips)
        assert [one for one in page.complaints if '"source": "network"' not in one] == [], done
        page.close()
