"""The studio among strangers: every user of the machine can connect to it, and read its command lines."""

import os
import re
import signal
import socket
import stat
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

import jointplay as jp
from helpers.processes import working
from helpers.studio import running
from jointplay.show.serving import door
from jointplay.show.serving.folder import Folder
from jointplay.show.serving.replies import HEADERS
from jointplay.show.serving.server import Server, Studio

HOST = "Host: 127.0.0.1:1\r\n"


@pytest.fixture
def idle(tmp_path: Path) -> Iterator[Server]:
    """A server that listens, and does not serve yet."""
    (tmp_path / "four-bar.toml").write_text(jp.examples.text("four-bar"))
    with Server(Studio(Folder(tmp_path), "four-bar.toml")) as server:
        yield server


@pytest.fixture
def server(idle: Server) -> Iterator[Server]:
    with running(idle) as one:
        yield one


def connected(server: Server, sent: str = "") -> socket.socket:
    own = socket.create_connection(("127.0.0.1", server.port), timeout=20)
    own.sendall(sent.encode("latin-1"))
    return own


def everything(own: socket.socket) -> str:
    """What comes until the other side ends."""
    pieces = []
    with closing(own):
        while piece := own.recv(65536):
            pieces.append(piece)
    return b"".join(pieces).decode()


def good(server: Server, name: str = "", *, last: bool = True) -> str:
    """A request of a page."""
    return f"GET /{server.token}/{name} HTTP/1.1\r\n{HOST}{'Connection: close' if last else 'X: y'}\r\n\r\n"


def test_sixty_clients_at_once_are_all_answered(idle: Server) -> None:
    """13 of them were reset: the system kept five that were not accepted yet."""
    clients = [connected(idle, good(idle, "charts.js")) for _ in range(60)]
    with running(idle):
        assert all(everything(one).startswith("HTTP/1.1 200 OK\r\n") for one in clients)


def test_half_requests_without_the_token_hold_no_threads_and_end(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    """150 of them held 150 threads for two minutes each."""
    monkeypatch.setattr(door, "HEAD", 1.5)
    before = threading.active_count()
    begun = time.monotonic()
    halves = [connected(server, text) for text in ("", "GET /", "G" * 3000) for _ in range(50)]
    assert everything(connected(server, good(server))).startswith("HTTP/1.1 200 OK\r\n")
    assert threading.active_count() <= before + 1
    for one in halves:
        try:
            assert everything(one) == ""
        except ConnectionResetError:
            # Of those that were closed to make room.
            continue
    assert time.monotonic() - begun < 10.0


def test_who_is_silent_makes_room_for_who_comes(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(door, "MOST_STRANGERS", 5)
    silent = [connected(server) for _ in range(8)]
    assert everything(connected(server, good(server))).startswith("HTTP/1.1 200 OK\r\n")
    for one in silent[:3]:
        assert everything(one) == ""
    # Those that came last may still speak.
    silent[-1].sendall(good(server).encode())
    assert everything(silent[-1]).startswith("HTTP/1.1 200 OK\r\n")
    for one in silent[3:-1]:
        one.close()


@pytest.mark.parametrize(
    ("sent", "code"),
    [
        # What has no token is refused by its first line, whose end is awaited and no more.
        ("GET / HTTP/1.1\r\n", 403),
        ("GET /{other}/ HTTP/1.1\r\n", 403),
        ("POST /{other}/open HTTP/1.1\r\n", 403),
        ("GET /{token}/\r\n", 400),
        ("GET /{token}/ HTTP/3.0\r\n", 400),
        ("\r\n", 400),
        ("\x16\x03\x01\x02\n", 400),
        ("X" * 70_000, 431),
        ("GET /{token}/ HTTP/1.1\r\nX: " + "y" * 70_000, 431),
        # What has it, and its answers by the library among them.
        ("GET /{token}/ HTTP/1.1\r\nHost: elsewhere:1\r\n\r\n", 403),
        ("GET /{token}/nothing HTTP/1.1\r\n" + HOST + "\r\n", 404),
        ("PUT /{token}/ HTTP/1.1\r\n" + HOST + "\r\n", 501),
        ("OPTIONS /{token}/ HTTP/1.1\r\n" + HOST + "\r\n", 501),
        ("get /{token}/ HTTP/1.1\r\n" + HOST + "\r\n", 501),
        ("GET /{token}/ HTTP/1.1\r\n" + HOST + "".join(f"X{k}: y\r\n" for k in range(200)) + "\r\n", 431),
        ("POST /{token}/open HTTP/1.1\r\n" + HOST + "Content-Length: 99999999\r\n\r\n", 413),
        ("POST /{token}/open HTTP/1.1\r\n" + HOST + "Transfer-Encoding: chunked\r\nContent-Length: 2\r\n\r\n{{}}", 413),
        ("POST /{token}/open HTTP/1.1\r\n" + HOST + "Content-Length: 1\r\n\r\n{{", 400),
        ("GET /{token}/studio.js HTTP/1.1\r\n" + HOST + "\r\n", 200),
        ("GET /{token}/ HTTP/1.0\r\n" + HOST + "\r\n", 200),
    ],
)
def test_every_answer_has_the_headers(server: Server, sent: str, code: int) -> None:
    """Answers that the library of Python makes itself, such as 501, had none of them."""
    with closing(connected(server, sent.format(token=server.token, other="a" * len(server.token)))) as own:
        answer = own.recv(1 << 20).decode()
    head = answer.partition("\r\n\r\n")[0]
    assert head.startswith(f"HTTP/1.1 {code} ")
    for name, value in HEADERS.items():
        assert head.count(f"\r\n{name}: {value}") == 1
    assert server.token not in answer


def test_requests_follow_one_another_on_one_connection(server: Server) -> None:
    """In pieces, together, and with a body that is asked for first; no thread waits between them."""
    post = f"POST /{server.token}/choices HTTP/1.1\r\n{HOST}Content-Length: 2\r\n"
    together = good(server, "nothing", last=False) + post + "\r\n{}" + good(server, "charts.js", last=False)
    own = connected(server, together)
    for piece in (post[:40], post[40:], "Expect: 100-continue\r\n", "\r\n", "{", "}", good(server)):
        time.sleep(0.05)
        own.sendall(piece.encode())
    assert re.findall(r"HTTP/1\.1 (\d+)", everything(own)) == ["404", "200", "200", "100", "200", "200"]


def test_no_more_is_answered_at_a_time_than_there_are_workers(idle: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(door, "MOST_WORKERS", 3)
    at_work, most, lock = [0], [0], threading.Lock()

    def slow(_: object) -> dict[str, object]:
        with lock:
            at_work[0] += 1
            most[0] = max(most[0], at_work[0])
        time.sleep(0.05)
        with lock:
            at_work[0] -= 1
        return {}

    idle.studio.answers["choices"] = slow
    head = f"POST /{idle.token}/choices HTTP/1.1\r\n{HOST}Connection: close\r\nContent-Length: 2\r\n\r\n"
    with running(idle):
        clients = [connected(idle, head + "{}") for _ in range(12)]
        assert all(everything(one).startswith("HTTP/1.1 200 ") for one in clients)
    assert most == [3]


def test_a_slip_in_an_answer_takes_no_worker_with_it(server: Server, capsys: pytest.CaptureFixture[str]) -> None:
    def slip(_: object) -> dict[str, object]:
        raise KeyError("slip")

    server.studio.answers["choices"] = slip
    head = f"POST /{server.token}/choices HTTP/1.1\r\n{HOST}Connection: close\r\nContent-Length: 2\r\n\r\n{{}}"
    for _ in range(door.MOST_WORKERS + 2):
        found = everything(connected(server, head))
        assert found.startswith("HTTP/1.1 500 ")
        assert "this cannot be answered" in found
    assert everything(connected(server, good(server))).startswith("HTTP/1.1 200 ")
    assert "KeyError: 'slip'" in capsys.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="signals and modes of files")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 0), (signal.SIGTERM, 0)])
def test_the_token_is_on_no_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals, code: int
) -> None:
    """The browser got the address as its argument, which every user of the machine can read."""
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"))
    browser, told = tmp_path / "browser", tmp_path / "told"
    browser.write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" > {told}.new\nmv {told}.new {told}\n')
    browser.chmod(0o755)
    monkeypatch.setenv("BROWSER", f"{browser} %s")
    with working(["studio", "m.toml"], tmp_path) as process:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        end = time.monotonic() + 60
        while not told.exists() and time.monotonic() < end:
            time.sleep(0.02)
        (given,) = told.read_text().splitlines()
        page = Path(given.removeprefix("file://"))
        token = address.split("/")[3]
        assert token not in given
        assert f'location.replace("{address}")' in page.read_text()
        assert stat.S_IMODE(page.stat().st_mode) == 0o600
        assert stat.S_IMODE(page.parent.stat().st_mode) == 0o700
        assert page.stat().st_uid == os.getuid()
        process.send_signal(number)
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (code, "")
    assert not page.parent.exists()
