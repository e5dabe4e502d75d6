"""A browser, a folder with mechanisms, and somebody in front of a studio."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from helpers.browser import Browser, opened
from helpers.studio import Person, choose, served
from jointplay import examples


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with opened(tmp_path_factory.mktemp("profile")) as running:
        yield running


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("four-bar", "four-bar-fits"):
        (tmp_path / f"{name}.toml").write_text(examples.text(name))
    return tmp_path


@contextmanager
def somebody(folder: Path, browser: Browser, first: str) -> Iterator[Person]:
    with served(folder, first) as server:
        page = browser.page(server.address, width=1280, height=800)
        yield Person(page)
        # Values that are refused are no complaint.
        assert [one for one in page.complaints if '"source": "network"' not in one] == []


@pytest.fixture
def person(folder: Path, browser: Browser) -> Iterator[Person]:
    """Somebody in front of the four-bar."""
    with somebody(folder, browser, "four-bar.toml") as one:
        one.page.wait("document.body.dataset.shown > 0")
        yield one


@pytest.fixture
def newcomer(folder: Path, browser: Browser) -> Iterator[Person]:
    """Somebody in front of a studio in which nothing is open yet."""
    with somebody(folder, browser, "") as one:
        one.page.wait("document.querySelectorAll('#start button').length > 20")
        yield one


@pytest.fixture
def drawer(folder: Path, browser: Browser) -> Iterator[Person]:
    """Somebody in front of an empty drawing."""
    with somebody(folder, browser, "") as one:
        one.page.wait("document.querySelectorAll('#open option').length > 20")
        choose(one.page, {"new": True})
        one.page.wait("document.body.classList.contains('draft')")
        yield one
