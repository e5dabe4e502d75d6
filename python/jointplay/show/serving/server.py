"""The server: this machine only, and only for those who know the token in the address.

Every address begins with the token, so that neither another user of the machine nor a page of another origin can guess
it. A request is refused (403) as well if its `Host` is not this machine by name, which is how a foreign name that leads
here (DNS rebinding) is noticed, or if its `Origin` is another page than ours. Every answer, refusals among them, has
the same headers.
"""

import base64
import hmac
import io
import json
import os
import re
import secrets
import shlex
import tempfile
import threading
import traceback
from collections import OrderedDict, deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from importlib.resources import files
from pathlib import Path
from typing import Any

from jointplay import examples
from jointplay.basics.units import LENGTHS
from jointplay.errors import InputError, JointplayError, not_known, one_line, shown
from jointplay.exchange.drafting import to_dxf
from jointplay.exchange.reading import read
from jointplay.file import document, toml
from jointplay.model.sizing import plays
from jointplay.plot.animation import animate
from jointplay.show import viewer
from jointplay.show.reporting import answers as reports
from jointplay.show.reporting.page import PageLook
from jointplay.show.reporting.page import page as report

from . import drafts, gestures, leaving, naming
from .answers import STAGES, now, opened, settled
from .board import BodyPose, Json, outlines
from .door import HOST, PIECE, Connection, Door
from .drafts import Draft
from .folder import Folder, Opened
from .hand import Edit, number_of, with_tables
from .mailing import mailed
from .replies import reply
from .session import FARTHEST, Cancelled, PageQuestion, Session, placed
from .templates import TEMPLATES, template

#: names of this machine that a browser may have been given
NAMES = ("127.0.0.1", "localhost")
#: bytes of a request; a mechanism file is not longer
LARGEST = 8_500_000
#: digits of the length of a request
DIGITS = 9
#: drawings and linkages that are opened, too: texts in the plane that name no other files
FOREIGN = (".dxf", ".pmks", ".pyslvs", ".linkage2", ".json")
#: names that a file can have everywhere
PLAIN = re.compile(r"[\w ()-]{1,80}")
#: pages whose mechanisms are kept; of further ones the oldest has to be opened again
MOST_PAGES = 64
VERSIONS = ("HTTP/1.0", "HTTP/1.1")
#: what is said with a refusal
REFUSED = {403: "refused: open the address that `jointplay studio` printed"}
#: kinds of animations, and what browsers call them
MOVING = {".gif": "image/gif", ".html": "text/html", ".mp4": "video/mp4"}
HTML, CSS, JS, JSON = "text/html", "text/css", "text/javascript", "application/json"


def _own(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


#: ECMAScript of the page, beside that of the drawing
MODULES = (
    *("studio.js", "board.js", "charts.js", "export.js", "history.js", "inspector.js", "numbers.js"),
    *("picture.js", "play.js", "sliders.js", "tour.js", "variants.js", "whole.js"),
)
#: what a page is made of
PARTS: dict[str, tuple[str, Callable[[], str]]] = {
    "": (HTML, lambda: _own("page.html")),
    **{name: (JS, partial(_own, name)) for name in MODULES},
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
        self._pages: OrderedDict[str, tuple[Draft, Opened]] = OrderedDict()
        #: states that pages have left, which they may ask about once more
        self._replaced: deque[str] = deque(maxlen=MOST_PAGES)
        #: frames of animations that are being made, done and all of them, and those that are given up
        self._frames: dict[str, tuple[int, int]] = {}
        self._stopped: deque[str] = deque(maxlen=MOST_PAGES)
        self._animating = threading.Lock()
        self.answers: dict[str, Callable[[Json], Json]] = {
            "choices": self.choices,
            "open": self.open,
            "edit": self.edit,
            "fits": self.fits,
            "now": self.now,
            "settled": self.settled,
            "save": self.save,
            "text": self.text,
            "report": self.report,
            "page": self.page,
            "picture": self.picture,
            "dxf": self.dxf,
            "animation": self.animation,
            "frames": self.frames,
        }

    def choices(self, _told: Json) -> Json:
        """What can be opened."""
        bundled = [{"name": name, "title": examples.title(name)} for name in examples.names()]
        own = {"first": self.first, "folder": str(self.folder.path), "files": self.folder.names()}
        return {**own, "examples": bundled, "templates": [*TEMPLATES]}

    def _chosen(self, told: Json) -> Opened:
        if "new" in told:
            return Opened(drafts.EMPTY, "drawing.toml")
        if "template" in told:
            name = str(told["template"])
            return Opened(template(name), f"{name}.toml")
        if "example" in told:
            name = str(told["example"])
            return Opened(examples.text(name), f"{name}.toml")
        if "text" in told:
            name, text = one_line(str(told.get("name", ""))), str(told["text"])
            kind = Path(name).suffix.lower()
            return Opened(_imported(text, name), f"{Path(name).stem}.toml") if kind in FOREIGN else Opened(text, name)
        return self.folder.open(str(told.get("file", self.first)))

    def picture(self, told: Json) -> Json:
        """The bodies of what could be opened, as lines; none in space."""
        found = self._chosen(told)
        in_space = toml.parse(found.content).get("space") == "spatial"
        return {"lines": [] if in_space else outlines(self._read(found.content, found).board({})["scene"])}

    def open(self, told: Json) -> Json:
        """Open a mechanism for a page; the page calls it by the number that it gets."""
        found = self._chosen(told)
        draft = self._read(found.content, found)
        if draft.problem is not None:
            raise InputError(draft.problem["text"])
        return self._shown(draft, found, {})

    def _read(self, text: str, found: Opened) -> Draft:
        return drafts.read(text, found.title, self.folder.place(found.name) if found.name else "")

    def _shown(self, draft: Draft, found: Opened, before: Mapping[str, BodyPose]) -> Json:
        """A state of a mechanism under a number of its own, and all that a page shows of it."""
        number = secrets.token_urlsafe(12)
        self._keep(number, draft, found)
        told = {"page": number, "file": found.name, "name": found.title, "text": draft.text, "problem": draft.problem}
        if draft.problem is not None:
            return told
        answers = {} if draft.session is None else opened(draft.session)
        return {**told, **answers, "board": draft.board(before)}

    def edit(self, told: Json) -> Json:
        """Another state of a mechanism: its text with sliders at their values, another text, or after a gesture."""
        draft, found = self._page(told)
        text = str(told["text"]) if "text" in told else self._text(draft, found, told)
        before = _poses(told)
        notes: list[str] = []
        if "rename" in told:
            kind, old, new = _three(told["rename"])
            try:
                wanted = naming.renamed(toml.parse(text), kind, old, new)
            except (KeyError, TypeError, AttributeError, IndexError):
                # In a half typed text, what should be a table may be something else.
                raise InputError("mend the text first", key="rename") from None
            text = document.renamed(text, wanted, old, new)
            before = {new if (kind, body) == ("body", old) else body: pose for body, pose in before.items()}
        for steps, value in _edits(told):
            # Tables that nothing else is in go with a value.
            text = document.edited(text, with_tables(toml.parse(text), steps) if value is None else steps, value)
        if "gesture" in told:
            # Units may be those of a part that is included.
            shared = {key: draft.raw[key] for key in toml.SHARED if key in draft.raw}
            more, notes = gestures.edits({**shared, **toml.parse(text)}, before, told)
            for steps, value in more:
                text = document.edited(text, steps, value)
        after = self._read(text, found)
        if "text" not in told:
            after, gone = self._left(after, draft, found)
            notes += gone
        # What is taken away, and what is tried while something is wrong already, may be steps to something valid.
        is_whole = "rename" in told or told.get("gesture", "delete") != "delete"
        if is_whole and draft.problem is None and after.problem is not None:
            raise InputError(after.problem["text"])
        shown = self._shown(after, found, before)
        with self._lock:
            self._pages.pop(str(told["page"]), None)
            self._replaced.append(str(told["page"]))
        return {**shown, "notes": notes}

    def _left(self, after: Draft, before: Draft, found: Opened) -> tuple[Draft, list[str]]:
        """What is left of a text when what spoke of things that are gone has gone with them, and what that was."""
        text, notes = leaving.without_sources(after.text, before.raw)
        after = self._read(text, found) if notes or text != after.text else after
        for _ in range(leaving.MOST):
            if after.problem is None or (before.problem and before.problem["key"] == after.problem["key"]):
                break
            text, more = leaving.without_refused(after.text, after.problem["key"], before.raw)
            if not more:
                break
            after, notes = self._read(text, found), [*notes, *more]
        return after, notes

    def fits(self, told: Json) -> Json:
        """The preferred fits of a diameter, with their least and largest play, in units of the file."""
        draft, _ = self._page(told)
        value = number_of(told.get("diameter"), "a diameter")
        units = draft.raw.get("units")
        length = units.get("length") if isinstance(units, Mapping) else None
        unit = LENGTHS.get(str(length), LENGTHS["mm"])
        return {"fits": plays(value, unit, str(told.get("fit", "")))}

    def _keep(self, number: str, draft: Draft, found: Opened) -> None:
        with self._lock:
            self._pages[number] = draft, found
            while len(self._pages) > MOST_PAGES:
                self._pages.popitem(last=False)

    def _page(self, told: Json) -> tuple[Draft, Opened]:
        number = str(told.get("page", ""))
        with self._lock:
            if number in self._replaced:
                raise Cancelled
            if number not in self._pages:
                raise InputError("the server does not have this page any more; open the mechanism again")
            self._pages.move_to_end(number)
            return self._pages[number]

    def _session(self, told: Json) -> Session:
        draft, _ = self._page(told)
        if draft.session is None:
            raise InputError("the mechanism is not complete yet")
        return draft.session

    def now(self, told: Json) -> Json:
        session = self._session(told)
        asked = PageQuestion.of(told)
        return now(session, asked, session.begin(asked))

    def settled(self, told: Json) -> Json:
        session = self._session(told)
        asked, samples = PageQuestion.of(told), told.get("samples", 0)
        if samples not in (0, *STAGES):
            raise InputError(f"{shown(samples)} is not a number of specimens that the page asks for", key="samples")
        return settled(session, asked, samples, session.begin(asked))

    def save(self, told: Json) -> Json:
        """Write the text with the values of the sliders. The page goes on with it under the same number."""
        draft, found = self._page(told)
        saved = self.folder.save(found, self._text(draft, found, told), str(told.get("name") or found.name))
        self._keep(str(told["page"]), draft, saved)
        return {"file": saved.name, "files": self.folder.names()}

    def text(self, told: Json) -> Json:
        """The file with the values of the sliders."""
        draft, found = self._page(told)
        return {"text": self._text(draft, found, told)}

    def _text(self, draft: Draft, found: Opened, told: Json) -> str:
        values = PageQuestion.of(told).values
        if not values or draft.session is None:
            return draft.text
        place = self.folder.path / (found.name or "drawing.toml")
        return draft.session.changed(values).text(place)

    def report(self, told: Json) -> Json:
        """A report on the mechanism with the values of the sliders."""
        session, (_, found) = self._session(told), self._page(told)
        values = PageQuestion.of(told).values
        name = found.name or "FILE"
        # With sliders moved, or another text, it is the file that the page prints.
        is_own = found.name and not values and self._page(told)[0].text == found.content
        command = shlex.join(["jointplay", "report", name if is_own else "FILE"])
        return {"html": report(reports.ask(session.changed(values), None, 0), PageLook(command))}

    def page(self, told: Json) -> Json:
        """A page with the mechanism to play with, its verdict and its file, which needs no server."""
        session, (draft, found) = self._session(told), self._page(told)
        m = session.changed(PageQuestion.of(told).values)
        return {"html": mailed(m, self._text(draft, found, told))}

    def animation(self, told: Json) -> Json:
        """The mechanism in motion with the values of the sliders, as a file of one of the kinds of `animate`."""
        session, asked = self._session(told), PageQuestion.of(told)
        kind, number = str(told.get("kind")), str(told.get("number"))
        if kind not in MOVING:
            raise InputError(not_known(kind, "a kind of animation", MOVING), key="kind")
        m = session.mechanism(asked)

        def progress(done: int, count: int) -> None:
            self._frames[number] = done, count
            if number in self._stopped:
                raise Cancelled

        # One after the other: they need all of the machine.
        with self._animating, tempfile.TemporaryDirectory() as folder:
            place = Path(folder) / f"animation{kind}"
            try:
                animate(m, place, progress=progress)
                content = place.read_bytes()
            except InputError as problem:
                # The place is ours.
                raise InputError(problem.problem, key=problem.key) from None
            finally:
                self._frames.pop(number, None)
        return {"kind": MOVING[kind], "content": base64.b64encode(content).decode()}

    def frames(self, told: Json) -> Json:
        """How far an animation is; it ends if the page gives it up."""
        number = str(told.get("number"))
        if told.get("stop"):
            self._stopped.append(number)
        done, count = self._frames.get(number, (0, 0))
        return {"done": done, "count": count}

    def dxf(self, told: Json) -> Json:
        """The drawing for a CAD program, in the configuration that is nearest to what the page shows."""
        session, asked = self._session(told), PageQuestion.of(told)
        m = session.changed(asked.values).first
        return {"dxf": to_dxf(m, placed(m, session.along(m), asked.drives)[1])}


def _imported(text: str, name: str) -> str:
    """The mechanism file of a drawing or linkage of another program, which has its name as a title."""
    with tempfile.TemporaryDirectory() as folder:
        stem = Path(name).stem
        place = Path(folder) / f"{stem if PLAIN.fullmatch(stem) else 'linkage'}{Path(name).suffix.lower()}"
        place.write_text(text, encoding="utf-8")
        try:
            return read(place).written
        except InputError as problem:
            # The place is ours.
            raise InputError(str(problem).replace(str(place), name)) from None


def _three(told: Any) -> list[str]:
    """What is renamed: of which kind it is, its name, and the new one."""
    if not isinstance(told, list) or len(told) != 3 or told[0] not in naming.KINDS:
        raise InputError("this is not what the page asks", key="rename")
    return [str(one) for one in told]


def _poses(told: Json) -> dict[str, BodyPose]:
    """The poses of bodies that a page shows."""
    poses = told.get("poses", {})
    try:
        found = {str(body): tuple(map(float, pose)) for body, pose in dict(poses).items()}
    except (TypeError, ValueError, OverflowError):
        raise InputError("this is not what the page asks", key="poses") from None
    if not all(len(pose) == len("xyz") and all(abs(v) <= FARTHEST for v in pose) for pose in found.values()):
        raise InputError("this is not what the page asks", key="poses")
    return found  # type: ignore[return-value]


def _edits(told: Json) -> list[Edit]:
    """Places and values that a page sends."""
    found: list[Edit] = []
    edits = told.get("edits", [])
    entries: list[Any] = edits if isinstance(edits, list) else [None]
    for entry in entries:
        is_edit = isinstance(entry, list) and len(entry) == 2 and isinstance(entry[0], list) and entry[0]
        if not is_edit or not all(isinstance(step, str | int) for step in entry[0]):
            raise InputError("this is not what the page asks", key="edits")
        toml.check_plain(entry[1], key=".".join(map(str, entry[0])))
        found.append((tuple(entry[0]), entry[1]))
    return found


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
        return self._send(code, JSON, told)

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

    def _answer(self, answer: Callable[[Json], Json], content: bytes) -> tuple[int, str]:
        try:
            told = json.loads(content)
            if not isinstance(told, dict):
                raise InputError("this is not what the page asks")
            return 200, json.dumps(answer(told), allow_nan=False)
        except Cancelled:
            return 200, json.dumps({"cancelled": True})
        except (JointplayError, ValueError, ArithmeticError, RecursionError, MemoryError) as problem:
            message = str(problem) if isinstance(problem, JointplayError) else "this cannot be answered"
            return 400, json.dumps({"error": message})
        except Exception:  # noqa: BLE001
            # A slip of ours: who started the server sees it, and the page goes on.
            traceback.print_exc()
            return 500, json.dumps({"error": "this cannot be answered"})

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
