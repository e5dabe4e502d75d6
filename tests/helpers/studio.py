"""A studio that tests serve, and a person in front of its page: who clicks, drags and types, and counts it."""

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

from helpers.browser import Page
from jointplay.show.serving import answers
from jointplay.show.serving.folder import Folder
from jointplay.show.serving.server import Server, Studio

#: that what is shown is of the newest position, and that it is exact
NEWEST = "document.body.dataset.serial === document.body.dataset.shown"
EXACT = f"document.body.dataset.state === 'exact' && {NEWEST}"
#: that everything that was asked of the board is done
DONE = "!document.body.dataset.busy"
SHIFT = 8


@contextmanager
def running(server: Server) -> Iterator[Server]:
    """A server at work, until the block ends."""
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        thread.join()


@contextmanager
def served(folder: Path, first: str = "four-bar.toml", patience: float = 0.0) -> Iterator[Server]:
    """A studio of a folder, until the block ends; of random specimens it asks only as many as the patience allows."""
    patched = mock.patch.object(answers, "PATIENCE", patience)
    with patched, Server(Studio(Folder(folder), first)) as server, running(server):
        yield server


def number(name: str) -> str:
    """The number beside a slider, as an expression."""
    return f"document.querySelector(\"[data-name='{name}'] input[inputmode=decimal]\")"


def put(page: Page, name: str, value: float | str) -> None:
    """Type a value beside a slider."""
    page.run(f"{number(name)}.value = '{value}', {number(name)}.dispatchEvent(new Event('input')), 0")


def choose(page: Page, what: dict[str, str | bool]) -> None:
    """Open a file or an example."""
    chosen = json.dumps(json.dumps(what, separators=(",", ":")))
    select = "document.getElementById('open')"
    page.run(f"{select}.value = {chosen}, {select}.dispatchEvent(new Event('input')), 0")


class Person:
    """Somebody who draws.

    Attributes
    ----------
    actions : int
        Clicks, drags, keys and fields so far.
    seen : callable
        Called after each of them.
    """

    def __init__(self, page: Page, seen: Callable[[], object] = lambda: None) -> None:
        self.page = page
        self.actions = 0
        self.seen = seen

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Where a place of the drawing is on the screen."""
        seen = f"board.viewer.project([{x}, {y}]).map((v) => v * board.viewer.svg.getBoundingClientRect().width / 800)"
        at = "((box, [x, y]) => [box.left + x, box.top + y])"
        page = "board.viewer.svg.getBoundingClientRect()"
        right, down = self.page.run(f"import('./studio.js').then(({{ board }}) => {at}({page}, {seen}))")
        return right, down

    def where(self, joint: str) -> tuple[float, float]:
        """Where a joint is shown in the drawing."""
        point = f"board.viewer.seen[board.board.joints.find(({{ name }}) => name === {json.dumps(joint)}).point]"
        x, y = self.page.run(f"import('./studio.js').then(({{ board }}) => {point})")
        return x, y

    def drag(self, start: tuple[float, float], end: tuple[float, float], modifiers: int = 0) -> None:
        """Drag from one place of the drawing to another one."""
        self.page.run("document.querySelector('#drawing svg').scrollIntoView({block: 'center'})")
        a, b = self.pixel(*start), self.pixel(*end)
        ways = (
            [a] if start == end else [tuple(p + (q - p) * k / 4 for p, q in zip(a, b, strict=True)) for k in range(5)]
        )
        for kind, (x, y) in [("mouseMoved", a), ("mousePressed", a), *(("mouseMoved", w) for w in ways[1:])]:  # type: ignore[misc]
            self._mouse(kind, x, y, modifiers, held=kind != "mouseMoved" or (x, y) != a)
        self._mouse("mouseReleased", *b, modifiers, held=False)
        self.done()

    def _mouse(self, kind: str, x: float, y: float, modifiers: int, *, held: bool) -> None:
        told = {"button": "left" if kind != "mouseMoved" or held else "none", "buttons": int(held), "clickCount": 1}
        self.page.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, modifiers=modifiers, **told)

    def click(self, x: float, y: float) -> None:
        """Click on a place of the drawing."""
        self.drag((x, y), (x, y))

    def press(self, key: str, modifiers: int = 0) -> None:
        """Press a key; 2 is with Ctrl."""
        # Without a text Enter is no key for a field.
        text = {"Enter": "\r"}.get(key, key if len(key) == 1 and modifiers != 2 else "")
        named = {"Delete": 46, "Enter": 13, "Home": 36, "Tab": 9, "ArrowUp": 38, "ArrowRight": 39}
        code = named.get(key, ord(key[0].upper()))
        told = {"key": key, "modifiers": modifiers, "windowsVirtualKeyCode": code}
        self.page.ask("Input.dispatchKeyEvent", type="keyDown", text=text, **told)
        self.page.ask("Input.dispatchKeyEvent", type="keyUp", **told)
        self.done()

    def use(self, tool: str, *places: tuple[float, float]) -> None:
        """Choose a tool by its key, and click on places of the drawing with it."""
        self.press(tool)
        for place in places:
            self.click(*place)

    def type(self, text: str) -> None:
        """Type into the field that has the focus."""
        self.page.ask("Input.insertText", text=text)

    def tab(self, until: str) -> None:
        """Press Tab until the focus is where it is wanted."""
        for _ in range(100):
            if self.page.run(until):
                return
            self.press("Tab")
        raise AssertionError(f"Tab never leads there: {until}")

    def tap(self, selector: str) -> None:
        """Click on an element."""
        self.page.click(selector)
        self.done()

    def fill(self, key: str, text: str) -> None:
        """Type into a field of the properties, and leave it."""
        field = f"document.querySelector('#inspector [data-key={json.dumps(key)}]')"
        self.page.run(f"{field}.focus(), {field}.select(), 0")
        self.page.ask("Input.insertText", text=text)
        self.press("Enter")

    def pick(self, selector: str, value: str) -> None:
        """Choose from a list."""
        select = f"document.querySelector({json.dumps(selector)})"
        self.page.wait(f"{select} && [...{select}.options].some(({{ value }}) => value === {json.dumps(value)})")
        self.page.run(f"{select}.value = {json.dumps(value)}, {select}.dispatchEvent(new Event('input')), 0")
        self.done()

    def done(self) -> None:
        """One more action, and all that it asked for."""
        self.actions += 1
        self.page.wait(DONE)
        self.seen()

    @property
    def text(self) -> str:
        """The text of the file as the page has it."""
        return str(self.page.run("document.getElementById('text').value"))

    def draw(self) -> None:
        """A four-bar from nothing, without clearances and limits."""
        self.use("b", (-60, -40), (-30, 0), (-30, 0), (50, 30), (50, 30), (40, -40))
        self.use("g", (-60, -40), (40, -40))
        self.use("d", (-60, -40))
        self.use("o", (50, 30))
        self.use("f", (50, 30))

    def judge(self) -> None:
        """The same four-bar with fits in its pins and a limit, up to its verdict."""
        self.draw()
        self.press("a", 2)
        self.pick("#way", "fit")
        self.fill("diameter", "12")
        self.pick("#fit", "H8/f7")
        self.fill("limits.position", "0,2")
        self.page.wait("document.querySelector('#line .held')")
