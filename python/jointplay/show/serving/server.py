"""The server: this machine only, and only for those who know the token in the address.

Every address begins with the token, so that neither another user of the machine nor a page of another origin can guess
it. A request is refused (403) as well if its `Host` is not this machine by name, which is how a foreign name that leads
here (DNS rebinding) is noticed, or if its `Origin` is another page than ours. Every answer, refusals among them, has
the same headers.
"""

from __future__ import annotations

import hmac
import io
import json
import os
import secrets
import shlex
import threading
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from importlib.resources import files
from pathlib import Path
from typing import Any

from jointplay import examples
from jointplay.errors import InputError, JointplayError, shown
from jointplay.show import viewer
from jointplay.show.reporting import answers as reports
from jointplay.show.reporting.page import page as report

from .answers import STAGES, Json, now, opened, settled
from .door import HOST, PIECE, Connection, Door
from .folder import Folder, Opened, example, from_text
from .replies import reply
from .session import Cancelled, PageQuestion, Session

#: names of this machine that a browser may have been given
NAMES = ("127.0.0.1", "localhost")
#: bytes of a request; a mechanism file is not longer
LARGEST = 8_500_000
#: digits of the length of a request
DIGITS = 9
#: pages whose mechanisms are kept; of further ones the oldest has to be opened again
MOST_PAGES = 64
VERSIONS = ("HTTP/1.0", "HTTP/1.1")
#: what is said with a refusal
REFUSED = {403: "refused: open the address that `jointplay studio` printed"}
HTML, CSS, JS, JSON = "text/html", "text/css", "text/javascript", "application/json"


def _own(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


#: what a page is made of
PARTS: dict[str, tuple[str, Callable[[], str]]] = {
    "": (HTML, lambda: _own("page.html")),
    "studio.js": (JS, lambda: _own("studio.js")),
    "charts.js": (JS, lambda: _own("charts.js")),
    "viewer.js": (JS, viewer.script),
    "studio.css": (CSS, lambda: viewer.style() + _own("studio.css")),
}


class Studio:
    """What the pages ask, by name.

    Parameters
    ----------
    folder : Folder
        Of the files that may be opened and saved.
    first : str
        The file that a page begins with; empty where it begins with a choice.
    """

    def __init__(self, folder: Folder, first: str = "") -> None:
        self.folder = folder
        self.first = first
        self._lock = threading.Lock()
        self._pages: OrderedDict[str, tuple[Session, Opened]] = OrderedDict()
        self.answers: dict[str, Callable[[Json], Json]] = {
            "choices": self.choices,
            "open": self.open,
            "now": self.now,
            "settled": self.settled,
            "save": self.save,
            "text": self.text,
            "report": self.report,
        }

    def choices(self, _told: Json) -> Json:
        """What can be opened."""
        bundled = [{"name": name, "title": examples.title(name)} for name in examples.names()]
        return {"first": self.first, "folder": str(self.folder.path), "files": self.folder.names(), "examples": bundled}

    def open(self, told: Json) -> Json:
        """Open a mechanism for a page; the page calls it by the number that it gets."""
        if "example" in told:
            found = example(str(told["example"]))
        elif "text" in told:
            found = from_text(str(told["text"]), str(told.get("name", "")))
        else:
            found = self.folder.open(str(told.get("file", self.first)))
        session = Session(found.m)
        begin = opened(session)
        number = secrets.token_urlsafe(12)
        self._keep(number, session, found)
        return {"page": number, "file": found.name, "name": found.m.file, **begin}

    def _keep(self, number: str, session: Session, found: Opened) -> None:
        with self._lock:
            self._pages[number] = session, found
            while len(self._pages) > MOST_PAGES:
                self._pages.popitem(last=False)

    def _page(self, told: Json) -> tuple[Session, Opened]:
        number = str(told.get("page", ""))
        with self._lock:
            if number not in self._pages:
                raise InputError("the server does not have this page any more; open the mechanism again")
            self._pages.move_to_end(number)
            return self._pages[number]

    def now(self, told: Json) -> Json:
        session, _ = self._page(told)
        asked = PageQuestion.of(told)
        return now(session, asked, session.begin(asked))

    def settled(self, told: Json) -> Json:
        session, _ = self._page(told)
        asked, samples = PageQuestion.of(told), told.get("samples", 0)
        if samples not in (0, *STAGES):
            raise InputError(f"{shown(samples)} is not a number of specimens that the page asks for", key="samples")
        return settled(session, asked, samples, session.begin(asked))

    def save(self, told: Json) -> Json:
        """Write the mechanism with the values of the sliders. The page goes on with it under the same number."""
        session, found = self._page(told)
        m = session.changed(PageQuestion.of(told).values)
        saved = self.folder.save(found, m, str(told.get("name") or found.name))
        self._keep(str(told["page"]), session, saved)
        return {"file": saved.name, "files": self.folder.names()}

    def text(self, told: Json) -> Json:
        """The file with the values of the sliders."""
        session, _ = self._page(told)
        m = session.changed(PageQuestion.of(told).values)
        return {"text": m.text(m.file)}

    def report(self, told: Json) -> Json:
        """A report on the mechanism with the values of the sliders."""
        session, found = self._page(told)
        values = PageQuestion.of(told).values
        name = found.name or "FILE"
        # With sliders moved it is the file that the page prints.
        command = shlex.join(["jointplay", "report", "FILE" if values else name])
        return {"html": report(reports.ask(session.changed(values), reports.SAMPLES, 0), command)}


class Server(Door):
    """The server of a studio.

    Parameters
    ----------
    studio : Studio
    port : int
        0 for any that is free.

    Raises
    ------
    OSError, OverflowError
        When the port is taken, or is none.
    """

    def __init__(self, studio: Studio, port: int = 0) -> None:
        self.studio = studio
        self.token = secrets.token_urlsafe(24)
        super().__init__(port)

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://{HOST}:{self.port}/{self.token}/"

    def name_in(self, path: str) -> str | None:
        """What is asked for, behind the token; None without it."""
        token, mark, name = path.split("?")[0].removeprefix("/").partition("/")
        return name if hmac.compare_digest(token.encode(), self.token.encode()) and mark else None

    def refusal(self, line: bytes) -> bytes:
        words = line.decode("latin-1").split()
        if len(words) != 3 or words[2] not in VERSIONS:
            return self.said(400)
        return self.said(403) if self.name_in(words[1]) is None else b""

    def said(self, code: int) -> bytes:
        return reply(code, "text/plain", REFUSED.get(code, HTTPStatus(code).phrase), closes=True)

    def answer(self, connection: Connection, head: bytes) -> bool:
        handler = Handler(self, connection, head)
        handler.handle_one_request()
        return not handler.close_connection


class Handler(BaseHTTPRequestHandler):
    """A request of a page, whose head is there."""

    server: Server  # type: ignore[assignment]
    protocol_version = default_request_version = "HTTP/1.1"

    def __init__(self, server: Server, asked: Connection, head: bytes) -> None:
        # That of the library serves a connection until its end.
        self.server, self.asked = server, asked
        self.rfile, self.wfile = io.BytesIO(head), io.BytesIO()
        self.close_connection = True

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing is printed of requests."""

    def do_GET(self) -> None:
        """A part of the page."""
        name = self._name()
        if name is None:
            return self.send_error(403)
        if self.headers.get("Content-Length", "0") != "0":
            # What follows is not read, so that the connection cannot go on.
            self.close_connection = True
        if name not in PARTS:
            return self._send(404, JSON, json.dumps({"error": "there is nothing here"}))
        kind, make = PARTS[name]
        return self._send(200, kind, make())

    def do_POST(self) -> None:
        """An answer to a page."""
        name = self._name()
        if name is None:
            return self.send_error(403)
        length = self.headers.get("Content-Length", "")
        is_number = length.isascii() and length.isdigit() and len(length) <= DIGITS
        if not is_number or int(length) > LARGEST or "Transfer-Encoding" in self.headers:
            self.close_connection = True
            return self._send(413, JSON, json.dumps({"error": "this is too long for a mechanism file"}))
        content = self._content(int(length))
        if name not in self.server.studio.answers:
            return self._send(404, JSON, json.dumps({"error": "there is nothing here"}))
        code, told = self._answer(self.server.studio.answers[name], content)
        return self._send(code, JSON, json.dumps(told, allow_nan=False))

    def _content(self, length: int) -> bytes:
        """What follows the head."""
        read = self.asked.read
        while len(read) < length:
            piece = self.asked.socket.recv(min(length - len(read), PIECE))
            if not piece:
                raise ConnectionError
            read += piece
        content = bytes(read[:length])
        del read[:length]
        return content

    def _answer(self, answer: Callable[[Json], Json], content: bytes) -> tuple[int, Json]:
        try:
            told = json.loads(content)
            if not isinstance(told, dict):
                raise InputError("this is not what the page asks")
            return 200, answer(told)
        except Cancelled:
            return 200, {"cancelled": True}
        except (JointplayError, ValueError, ArithmeticError, RecursionError, MemoryError) as problem:
            message = str(problem) if isinstance(problem, JointplayError) else "this cannot be answered"
            return 400, {"error": message}

    def _name(self) -> str | None:
        """What is asked for; None if the request is not one of our pages'."""
        host = self.headers.get("Host", "")
        is_ours = host.rpartition(":")[0] in NAMES and self.headers.get("Origin") in (None, f"http://{host}")
        return self.server.name_in(self.path) if is_ours else None

    def handle_expect_100(self) -> bool:
        self.asked.socket.sendall(b"HTTP/1.1 100 Continue\r\n\r\n")
        return True

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:  # noqa: ARG002
        """A refusal, also of what the library does not take."""
        self.close_connection = True
        self.asked.socket.sendall(self.server.said(code))

    def _send(self, code: int, kind: str, text: str) -> None:
        self.asked.socket.sendall(reply(code, kind, text, closes=self.close_connection))


def serve(file: str | None, port: int, said: Callable[[str], None]) -> None:
    """Serve until Ctrl-C.

    Parameters
    ----------
    file : str or None
        The mechanism that pages begin with.
    port : int
        0 for any that is free.
    said : callable
        Called with the address when the server listens.

    Raises
    ------
    InputError
        When the port is taken, or there is no such file.
    """
    place = None if file is None else Path(os.path.realpath(file))
    if place is not None and not place.is_file():
        problem = "this is no mechanism file" if place.exists() else "there is no such file"
        raise InputError(f"{problem}; `jointplay studio` alone begins with an example", file=str(file))
    folder = Folder(Path() if place is None else place.parent)
    name = "" if place is None else folder.place(place.name).name
    try:
        server = Server(Studio(folder, name), port)
    except (OSError, OverflowError) as problem:
        reason = getattr(problem, "strerror", None) or str(problem)
        raise InputError(f"port {port} cannot be used: {reason}", key="--port") from None
    with server, suppress(KeyboardInterrupt):
        said(server.address)
        server.serve_forever()
