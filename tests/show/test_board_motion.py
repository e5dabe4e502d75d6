"""Animations that a page asks for: what `animate` writes, with progress, an end, and a reason where there is none."""

import base64
import io
from pathlib import Path

import pytest
from PIL import Image

from helpers.browser import needs_browser
from helpers.studio import Person
from jointplay.errors import InputError
from jointplay.plot import animation, movies
from jointplay.show.serving.folder import Folder
from jointplay.show.serving.server import Studio
from jointplay.show.serving.session import Cancelled

NOTE = "document.getElementById('note').textContent"


def test_a_film_without_its_program_and_other_kinds_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    studio = Studio(Folder(tmp_path))
    page = studio.open({"example": "four-bar"})
    monkeypatch.setattr(movies, "TOOL", "no-such-program")
    with pytest.raises(InputError, match=r"^an \.mp4 needs ffmpeg, which is not found"):
        studio.animation({"page": page["page"], "kind": ".mp4", "number": "1"})
    with pytest.raises(InputError, match="is not a kind of animation"):
        studio.animation({"page": page["page"], "kind": ".avi", "number": "1"})
    empty = studio.open({"new": True})
    with pytest.raises(InputError, match="not complete yet"):
        studio.animation({"page": empty["page"], "kind": ".gif", "number": "1"})


def test_an_animation_that_is_given_up_ends(tmp_path: Path) -> None:
    studio = Studio(Folder(tmp_path))
    page = studio.open({"example": "four-bar"})
    assert studio.frames({"number": "1"}) == {"done": 0, "count": 0}
    # Also before it has begun.
    studio.frames({"number": "1", "stop": True})
    with pytest.raises(Cancelled):
        studio.animation({"page": page["page"], "kind": ".gif", "number": "1"})


@needs_browser
def test_a_page_saves_the_mechanism_in_motion(person: Person, monkeypatch: pytest.MonkeyPatch) -> None:
    # As many as the file has configurations, and some between them.
    monkeypatch.setattr(animation, "FRAMES", 13)
    page = person.page
    page.run("window.kept = null, URL.createObjectURL = (blob) => ((window.kept = blob), 'data:,')")
    page.run(
        "window.seen = [], new MutationObserver(() => window.seen.push(document.getElementById('note').textContent))"
        ".observe(document.getElementById('note'), { childList: true }), 0"
    )
    person.pick("#animation", ".gif")
    page.wait("window.kept")
    page.wait(f"{NOTE} === 'the animation is saved where the browser saves files'")
    assert page.run("window.seen.some((words) => /^animation: \\d+ %/.test(words))")
    assert page.run("document.getElementById('stop').hidden")
    letters = "String.fromCharCode(...bytes.subarray(k, k + 30000))"
    content = page.run(
        "window.kept.arrayBuffer().then((all) => { const bytes = new Uint8Array(all); let text = '';"
        f" for (let k = 0; k < bytes.length; k += 30000) text += {letters}; return btoa(text); }})"
    )
    with Image.open(io.BytesIO(base64.b64decode(content))) as found:
        assert found.format == "GIF"
        assert found.n_frames == 13
    page.run("window.seen = [], 0")
    person.pick("#animation", ".gif")
    page.wait("window.seen.some((words) => /^animation: \\d+ %/.test(words))")
    page.click("#stop")
    page.wait(f"{NOTE} === 'the animation was stopped'")
