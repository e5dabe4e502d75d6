"""Limits of forces in the studio: its verdict is that of `error`, found when the sliders rest."""

from __future__ import annotations

from pathlib import Path

import pytest

import jointplay as jp
from helpers.browser import Browser, needs_browser
from helpers.studio import EXACT, put, served
from jointplay import examples
from jointplay.analyses import beside
from jointplay.file import document
from jointplay.result import FORCES_JUDGED
from jointplay.show.serving.folder import Folder
from jointplay.show.serving.server import Studio


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
