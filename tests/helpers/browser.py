"""A browser that tests drive by its debugging pipe, as a person would: pages, clicks, drags, and what they see.

Chromium takes commands as JSON with a zero byte behind each, on file descriptor 3, and answers on 4 (Chrome DevTools
protocol), so that no library and no port are needed.
"""

from __future__ import annotations

import base64
import json
import os
import shlex
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from jointplay.show.reporting.printing import BROWSERS

BROWSER = next(filter(None, map(shutil.which, BROWSERS)), None)
needs_browser = pytest.mark.skipif(
    BROWSER is None and "JOINTPLAY_NEEDS_BROWSER" not in os.environ, reason="no Chromium, Chrome or Edge is installed"
)
#: seconds after which something that is waited for does not come any more
PATIENCE = 60.0


class Browser:
    """A browser without a window."""

    def __init__(self, read: int, write: int) -> None:
        self._read, self._write = read, write
        self._rest = b""
        self._count = 0
        self.events: list[dict[str, Any]] = []

    def ask(self, method: str, session: str | None = None, **params: Any) -> dict[str, Any]:
        """The answer to a command."""
        self._count += 1
        number = self._count
        told = {"id": number, "method": method, "params": params} | ({"sessionId": session} if session else {})
        os.write(self._write, json.dumps(told).encode() + b"\0")
        while True:
            found = self._next()
            if found.get("id") == number:
                assert "error" not in found, found
                return dict(found["result"])
            self.events.append(found)

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            more = os.read(self._read, 1 << 20)
            assert more, "the browser has ended"
            self._rest += more
        message, _, self._rest = self._rest.partition(b"\0")
        return dict(json.loads(message))

    def page(self, address: str, width: int = 1440, height: int = 900) -> Page:
        """A new page at an address."""
        target = self.ask("Target.createTarget", url="about:blank", newWindow=True)["targetId"]
        session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, session)
        for domain in ("Page", "Runtime", "Log", "Network"):
            page.ask(f"{domain}.enable")
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        page.ask("Emulation.setDeviceMetricsOverride", **size)
        page.ask("Page.navigate", url=address)
        page.wait("document.readyState === 'complete'")
        return page


class Page:
    """A page of a browser."""

    def __init__(self, browser: Browser, session: str) -> None:
        self.browser, self.session = browser, session

    def ask(self, method: str, **params: Any) -> dict[str, Any]:
        """The answer to a command to this page."""
        return self.browser.ask(method, self.session, **params)

    def run(self, expression: str) -> Any:
        """The value of an expression in the page, awaited."""
        found = self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def close(self) -> None:
        """Close the page as a browser does that ends: without a question."""
        target = self.ask("Target.getTargetInfo")["targetInfo"]["targetId"]
        self.browser.ask("Target.closeTarget", targetId=target)

    def wait(self, condition: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if self.run(f"Boolean({condition})"):
                return
            time.sleep(0.02)
        raise AssertionError(f"never true: {condition}\n{self.run('document.body.innerText')}")

    def text(self, selector: str) -> str:
        """What stands in an element."""
        return str(self.run(f"document.querySelector({json.dumps(selector)}).innerText"))

    def middle(self, selector: str) -> tuple[float, float, float]:
        """Where an element is: middle, and its width."""
        element = f"document.querySelector({json.dumps(selector)})"
        self.run(f"{element}.scrollIntoView({{block: 'center'}})")
        box = (
            f"(({{x, y, width, height}}) => [x + width / 2, y + height / 2, width])({element}.getBoundingClientRect())"
        )
        x, y, width = self.run(box)
        return x, y, width

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Press, move or release the mouse."""
        pressed = {"button": "left", "buttons": 0 if kind == "mouseReleased" else 1, "clickCount": 1}
        self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, **pressed)

    def click(self, selector: str) -> None:
        """Click on an element."""
        x, y, _ = self.middle(selector)
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 8) -> None:
        """Drag something along a line."""
        self.mouse("mousePressed", *start)
        for k in range(1, steps + 1):
            self.mouse("mouseMoved", *(a + (b - a) * k / steps for a, b in zip(start, end, strict=True)))
        self.mouse("mouseReleased", *end)

    def screenshot(self, path: Path) -> None:
        """A picture of the whole page."""
        found = self.ask("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(found["data"]))

    @property
    def complaints(self) -> list[str]:
        """What the page has complained of so far."""
        self.run("0")
        mine = [event for event in self.browser.events if event.get("sessionId") == self.session]
        kinds = ("Runtime.exceptionThrown", "Log.entryAdded")
        return [json.dumps(event["params"]) for event in mine if event["method"] in kinds]

    @property
    def addresses(self) -> list[str]:
        """What the page has asked for so far."""
        self.run("0")
        mine = [event for event in self.browser.events if event.get("sessionId") == self.session]
        return [e["params"]["request"]["url"] for e in mine if e["method"] == "Network.requestWillBeSent"]


@contextmanager
def opened(profile: Path) -> Iterator[Browser]:
    """A browser with an empty profile, which ends with the block."""
    assert BROWSER is not None
    mine, its = os.pipe(), os.pipe()
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", f"--user-data-dir={profile}"]
    # The shell puts the pipes where the browser looks for them.
    command = f"exec {shlex.join([BROWSER, *options])} 3<&{its[0]} 4>&{mine[1]}"
    process = subprocess.Popen(["bash", "-c", command], pass_fds=(its[0], mine[1]), stderr=subprocess.DEVNULL)
    os.close(its[0])
    os.close(mine[1])
    browser = Browser(mine[0], its[1])
    try:
        yield browser
        browser.ask("Browser.close")
    finally:
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        os.close(mine[0])
        os.close(its[1])
