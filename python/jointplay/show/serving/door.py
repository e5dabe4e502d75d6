"""The door of the server: one thread accepts connections and reads the heads of requests, workers answer them.

Every program of this machine can connect, whoever runs it. A connection costs no thread before its first line has shown
the token and its head is whole, and none between two requests. What is open at a time, how long a head may be and how
long it may take is bounded.
"""

from __future__ import annotations

import os
import re
import selectors
import socket
import threading
import time
import traceback
from abc import ABC, abstractmethod
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from queue import SimpleQueue

HOST = "127.0.0.1"
#: connections that the system keeps until they are accepted
BACKLOG = 256
#: connections that have not shown the token; where there are more the oldest is closed
MOST_STRANGERS = 128
#: connections that have; where there are more the one that has been silent for longest is closed
MOST_KNOWN = 128
#: requests that are answered at the same time; a browser asks six at a time
MOST_WORKERS = 16
#: bytes of a head
LARGEST_HEAD = 65_536
#: seconds within which a head has to be there, and a client that is refused has to go
HEAD, LEAVING = 10.0, 1.0
#: seconds without a word after which a connection is closed: between requests, and within one
IDLE, SILENCE = 120.0, 30.0
#: seconds after which it is looked for what is late
POLL = 0.5
#: the end of a head
END = re.compile(rb"\r?\n\r?\n")
PIECE = 65_536


def _listening(port: int) -> socket.socket:
    listener = socket.socket()
    try:
        if os.name == "posix":
            # A port is free when the connections of a server before have ended; where this means another thing, not.
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((HOST, port))
        listener.listen(BACKLOG)
        listener.setblocking(False)
    except BaseException:
        listener.close()
        raise
    return listener


@dataclass(eq=False)
class Connection:
    """A connection."""

    socket: socket.socket
    #: when it is closed if nothing comes
    deadline: float
    #: what has come and is not answered yet
    read: bytearray = field(default_factory=bytearray)
    #: whether it has shown the token
    is_known: bool = False
    #: whether it has got its last answer: what still comes is thrown away, because with something unread the system
    #: would take back the answer
    is_leaving: bool = False


class Door(ABC):
    """Accepts connections at a port of this machine.

    Parameters
    ----------
    port : int
        0 for any that is free.

    Raises
    ------
    OSError, OverflowError
        When the port is taken, or is none.
    """

    def __init__(self, port: int = 0) -> None:
        self._listener = _listening(port)
        self.port: int = self._listener.getsockname()[1]
        self._knocks, self._knocked = socket.socketpair()
        self._selector = selectors.DefaultSelector()
        for one in (self._knocks, self._knocked):
            one.setblocking(False)
        self._selector.register(self._listener, selectors.EVENT_READ, self._accept)
        self._selector.register(self._knocked, selectors.EVENT_READ, self._take_back)
        #: connections that something is awaited from, the most silent one first
        self._waiting: dict[Connection, None] = {}
        self._asked: SimpleQueue[tuple[Connection, bytes]] = SimpleQueue()
        self._answered: deque[tuple[Connection, bool]] = deque()
        self._workers = self._busy = 0
        self._stopping, self._stopped = False, threading.Event()

    @abstractmethod
    def refusal(self, line: bytes) -> bytes:
        """The answer to a request that is refused by its first line; empty where it is not."""

    @abstractmethod
    def said(self, code: int) -> bytes:
        """The answer to what cannot be answered: 431, too long a head; 503, too many requests."""

    @abstractmethod
    def answer(self, connection: Connection, head: bytes) -> bool:
        """Answer a request, in a thread of its own; whether the connection goes on."""

    def __enter__(self) -> Door:
        return self

    def __exit__(self, *_: object) -> None:
        for connection in [*self._waiting]:
            self._close(connection)
        self._selector.close()
        for one in (self._listener, self._knocks, self._knocked):
            one.close()

    def serve_forever(self) -> None:
        """Serve until `shutdown`, or an exception such as Ctrl-C."""
        try:
            while not self._stopping:
                for key, _ in self._selector.select(POLL):
                    if isinstance(key.data, Connection):
                        self._read(key.data)
                    else:
                        key.data()
                now = time.monotonic()
                for connection in [one for one in self._waiting if one.deadline < now]:
                    self._close(connection)
        finally:
            self._stopped.set()

    def shutdown(self) -> None:
        """End what another thread serves."""
        self._stopping = True
        self._knock()
        self._stopped.wait()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                own, _ = self._listener.accept()
                # An answer would wait for the receipt of its head.
                own.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._make_room(MOST_STRANGERS, is_known=False)
                self._await(Connection(own, time.monotonic() + HEAD))

    def _make_room(self, most: int, *, is_known: bool) -> None:
        """Close the most silent one of too many."""
        alike = [one for one in self._waiting if one.is_known is is_known]
        if len(alike) >= most:
            self._close(alike[0])

    def _await(self, connection: Connection) -> None:
        connection.socket.setblocking(False)
        self._waiting[connection] = None
        self._selector.register(connection.socket, selectors.EVENT_READ, connection)

    def _forget(self, connection: Connection) -> None:
        del self._waiting[connection]
        self._selector.unregister(connection.socket)

    def _close(self, connection: Connection) -> None:
        self._forget(connection)
        connection.socket.close()

    def _read(self, connection: Connection) -> None:
        """What has come."""
        if connection not in self._waiting:
            return
        try:
            piece = connection.socket.recv(PIECE)
        except BlockingIOError:
            return
        except OSError:
            piece = b""
        if not piece:
            self._close(connection)
        elif not connection.is_leaving:
            connection.read += piece
            self._look(connection)

    def _look(self, connection: Connection) -> None:
        """Refuse a request by its first line, or have it answered when its head is whole."""
        read = connection.read
        if not connection.is_known and b"\n" in read:
            if refusal := self.refusal(bytes(read[: read.index(b"\n")])):
                return self._refuse(connection, refusal)
            connection.is_known = True
        end = END.search(read)
        if end is not None and connection.is_known:
            if self._busy >= MOST_KNOWN:
                return self._refuse(connection, self.said(503))
            self._forget(connection)
            connection.socket.settimeout(SILENCE)
            head = bytes(read[: end.end()])
            del read[: end.end()]
            return self._ask(connection, head)
        if end is not None or len(read) > LARGEST_HEAD:
            return self._refuse(connection, self.said(431))
        return None

    def _refuse(self, connection: Connection, answer: bytes) -> None:
        with suppress(OSError):
            connection.socket.send(answer)
        self._let_go(connection)

    def _let_go(self, connection: Connection) -> None:
        """Say that nothing more is answered, and wait a moment for the client to go."""
        connection.is_leaving, connection.is_known = True, False
        connection.deadline = time.monotonic() + LEAVING
        try:
            connection.socket.shutdown(socket.SHUT_WR)
        except OSError:
            self._close(connection)

    def _ask(self, connection: Connection, head: bytes) -> None:
        self._asked.put((connection, head))
        self._busy += 1
        if self._workers < min(self._busy, MOST_WORKERS):
            self._workers += 1
            threading.Thread(target=self._work, daemon=True).start()

    def _work(self) -> None:
        while True:
            connection, head = self._asked.get()
            goes_on = False
            try:
                goes_on = self.answer(connection, head)
            except OSError:
                # Pages may go away in the middle of an answer.
                pass
            except Exception:  # noqa: BLE001
                # A slip of ours takes no worker with it.
                traceback.print_exc()
            self._answered.append((connection, goes_on))
            self._knock()

    def _knock(self) -> None:
        # When it cannot take more it knocks already; when it is closed nobody hears.
        with suppress(OSError):
            self._knocks.send(b"\0")

    def _take_back(self) -> None:
        """Connections whose requests are answered."""
        with suppress(BlockingIOError):
            self._knocked.recv(PIECE)
        while self._answered:
            connection, goes_on = self._answered.popleft()
            self._busy -= 1
            self._make_room(MOST_KNOWN, is_known=True)
            connection.deadline = time.monotonic() + IDLE
            self._await(connection)
            if not goes_on:
                self._let_go(connection)
            elif connection.read:
                self._look(connection)
