"""Every page that is written says to the browser that it fetches, sends and runs nothing but what is in it."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

import jointplay as jp
from jointplay.basics import pages
from jointplay.cli import run

ROOT = Path(jp.__file__).parent


def command(*words: str) -> Callable[[], str]:
    """A page that a command writes as ``page.html``."""

    def written() -> str:
        Path("m.toml").write_text(jp.examples.text("five-bar"), encoding="utf-8")
        assert run([*words]) in (0, 1)
        return Path("page.html").read_text(encoding="utf-8")

    return written


MAP = ("map", "m.toml", "-g", "x=-20:20:3", "--no-details", "--first-order", "-o", "m.nc", "--plot", "page.html")
PAGES = {
    "report": command("report", "m.toml", "--samples", "64", "-o", "page.html"),
    "animate": command("animate", "m.toml", "-o", "page.html", "--frames", "2", "--size", "60mm"),
    "map": command(*MAP[:4], "-g", "y=180", *MAP[4:]),
    "a map in three axes": command("map", "m.toml", "-g", "x=-20:20:3", "-g", "y=170:190:3", *MAP[4:]),
    "a drawing in a notebook": lambda: jp.view(jp.loads(jp.examples.text("four-bar"))).html,
}


@pytest.mark.parametrize("name", PAGES)
def test_a_page_may_do_nothing_but_show_itself(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Pages of `animate` and of maps had no policy: whatever a script in them had been told, it could have sent it."""
    pytest.importorskip("plotly")
    monkeypatch.chdir(tmp_path)
    text = PAGES[name]()
    head = text[: text.index("</head>")]
    policy = re.findall(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">', text)
    assert policy == [pages.POLICY]
    # Before anything that it is about.
    assert not re.search("<(script|style|title|link|img)", head[: head.index("Content-Security-Policy")])
    assert "default-src 'none'" in policy[0]
    assert "connect-src" not in policy[0]
    assert "http" not in policy[0]


def test_pages_begin_in_one_place() -> None:
    """A page that is put together elsewhere would have no policy."""
    found = [path.name for path in ROOT.rglob("*.py") if re.search("(?i)<!doctype html|<html", path.read_text("utf-8"))]
    assert found == ["pages.py"]
