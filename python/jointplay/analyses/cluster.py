"""Work in other processes: the workers of a Dask scheduler, on this machine or on many.

Work is cut into tasks that do not depend on one another. Their answers are taken in the order of the tasks, whoever
computes them and whichever is ready first, so that all that is summed, joined or written of them is the same as on one
machine, bit by bit. A worker whose numbers could differ is refused.
"""

from __future__ import annotations

import functools
import hashlib
import math
import pickle
import platform
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar, cast

import numpy as np

from jointplay import _core
from jointplay.errors import InputError, JointplayError, require
from jointplay.result import Result, version

if TYPE_CHECKING:
    from distributed import Client, Future

    #: a client, or the address of its scheduler
    Scheduler = Client | str

P = ParamSpec("P")
T = TypeVar("T")
KEY = "scheduler"
ENDED = "the scheduler has ended, or cannot be reached any more, or its client is closed"
#: states of a client that asks nothing any more
CLOSED = ("closing", "closed")
#: seconds until a scheduler has to answer
CONNECT = 10
#: seconds without a single worker after which none is expected any more
NOBODY = 60
#: seconds between two looks at the workers while an answer is waited for
LOOK = 1.0
#: tasks that are handed out for every thread of the workers: one at work, one that waits there
AHEAD = 2
#: times that a task is tried
TRIES = 3
#: questions that a worker keeps, with what the core has recorded of their mechanisms
KEPT = 4
#: attribute of a result: how many tasks had to be begun again
RETRIED = "retried"
#: size of a task that Dask warns of; chunks of a large mechanism may have more than its 10 MB
LARGE = {"distributed.admin.large-graph-warning-threshold": "1 GiB"}


class Here:
    """This process as the only worker: one task after the other, each when its answer is asked for."""

    retried = 0
    is_remote = False

    def each(self, function: Callable[..., T], shared: tuple[Any, ...], items: Iterable[Any]) -> Iterator[T]:
        """``function(*shared, item)`` for every item, in their order."""
        return (function(*shared, item) for item in items)


class Workers:
    """The workers of a scheduler.

    Parameters
    ----------
    client : distributed.Client

    Attributes
    ----------
    retried : int
        Tasks that had to be begun again, because they or their workers failed.

    Raises
    ------
    InputError
        When a worker is not like this process.
    """

    is_remote = True

    def __init__(self, client: Client) -> None:
        self.client, self.retried = client, 0
        self._run, self._count = uuid.uuid4().hex, 0
        #: tasks whose answers are not here yet
        self._pending: dict[Any, Future[Any]] = {}
        self._threads, self._looked = 0, -math.inf
        self._seen = time.monotonic()
        try:
            # It reads what it hands out.
            client.run_on_scheduler(identity)
            identities = client.run(identity, on_error="return")
        except ImportError as error:
            problem = f"the scheduler at {self._address()} needs jointplay in its environment, too: {error}"
            raise InputError(problem, key=KEY) from None
        except OSError:
            raise InputError(ENDED, key=KEY) from None
        for worker, found in identities.items():
            if isinstance(found, Exception):
                raise InputError(f"worker {worker} needs jointplay in its environment: {found}", key=KEY)
            _require_same(found, identity(), worker)
        client.subscribe_topic("all", self._told)

    def close(self) -> None:
        """Nothing more will be asked, and nobody waits for what was."""
        if self.client.status not in CLOSED:
            self.client.unsubscribe_topic("all")
            self.client.cancel(list(self._pending.values()))
        self._pending.clear()

    def each(self, function: Callable[..., T], shared: tuple[Any, ...], items: Iterable[Any]) -> Iterator[T]:
        """``function(*shared, item)`` for every item, in their order.

        Items are made while workers compute, ahead of the answers by as many as keep all threads busy. What is
        `shared` a worker unpacks once.

        Raises
        ------
        InputError
            When a worker is not like this process, when there is none, or when workers end again and again.
        """
        task = pickle.dumps((function, shared))
        waiting: deque[tuple[Future[T], bytes]] = deque()
        for item in items:
            content = pickle.dumps(item)
            waiting.append((self._begun(task, content), content))
            while len(waiting) > self._ahead():
                yield self._first(waiting, task)
        while waiting:
            yield self._first(waiting, task)

    def _begun(self, task: bytes, item: bytes) -> Future[Any]:
        if self.client.status in CLOSED:
            raise InputError(ENDED, key=KEY)
        self._count += 1
        key = f"jointplay-{self._run}-{self._count}"
        future = self.client.submit(_answered, identity(), task, item, key=key, pure=False)
        self._pending[key] = future
        return future

    def _first(self, waiting: deque[tuple[Future[T], bytes]], task: bytes) -> T:
        """The answer to the first task that waits; one that fails is begun again."""
        for tried in range(1, TRIES + 1):
            future, item = waiting[0]
            try:
                answer = self._answer(future)
            except Exception as error:
                del self._pending[future.key]
                if isinstance(error, JointplayError) or tried == TRIES:
                    raise
                self.retried += 1
                waiting[0] = (self._begun(task, item), item)
            else:
                del self._pending[future.key]
                waiting.popleft()
                return answer
        raise AssertionError("the last try returns or raises")

    def _answer(self, future: Future[T]) -> T:
        from distributed import CancelledError, KilledWorker, wait

        try:
            while True:
                try:
                    with self.client.as_current():
                        wait([future], timeout=LOOK)
                except TimeoutError:
                    self._look()
                else:
                    return future.result()
        except KilledWorker as error:
            count, last = error.allowed_failures + 1, error.last_worker.address
            problem = f"{count} workers ended while they computed the same task, the last of them {last}; their memory"
            raise InputError(f"{problem} or their logs may say why", key=KEY) from None
        except CancelledError:
            raise InputError(ENDED, key=KEY) from None

    def _ahead(self) -> int:
        """Tasks that may wait for their answers; workers come and go."""
        if time.monotonic() > self._looked + LOOK:
            self._look()
        return max(AHEAD * self._threads, 1)

    def _look(self) -> None:
        """See how many threads there are.

        Raises
        ------
        InputError
            When there has been none for a while.
        """
        try:
            self._threads, self._looked = sum(self.client.nthreads().values()), time.monotonic()
        except OSError:
            raise InputError(ENDED, key=KEY) from None
        if self._threads:
            self._seen = self._looked
        if self._looked > self._seen + NOBODY:
            raise InputError(f"{self._address()} has had no workers for {NOBODY} seconds", key=KEY)

    def _address(self) -> str:
        return str(self.client.scheduler_info()["address"])

    def _told(self, event: tuple[float, Any]) -> None:
        """Count the tasks that a worker has taken with it; the scheduler hands them to others."""
        told = event[1]
        if isinstance(told, dict) and told.get("action") == "remove-worker":
            lost = {*told["processing-tasks"], *told["lost-computed-tasks"]}
            self.retried += sum(key in self._pending for key in lost)


@contextmanager
def connected(scheduler: Scheduler | Here | Workers | None) -> Iterator[Here | Workers]:
    """The workers of a scheduler; without one this process.

    Raises
    ------
    InputError
        When Dask is not installed, the scheduler does not answer, or one of its workers is refused.
    """
    if scheduler is None:
        yield Here()
        return
    if isinstance(scheduler, Here | Workers):
        yield scheduler
        return
    require("distributed", "cluster", "a Dask scheduler")
    import logging

    import dask.config
    from distributed.utils import silence_logging_cmgr

    with ExitStack() as opened:
        if isinstance(scheduler, str):
            # What becomes of workers is counted, and what ends the work is said once.
            opened.enter_context(silence_logging_cmgr(logging.CRITICAL))
            client = opened.enter_context(_client(scheduler))
        else:
            client = scheduler
        if client.asynchronous:
            raise InputError("the client is asynchronous; Client(..., asynchronous=False) is needed", key=KEY)
        if client.status in CLOSED:
            raise InputError(f"the client is {client.status}; an open one is needed", key=KEY)
        opened.enter_context(dask.config.set(LARGE))
        yield opened.enter_context(closing(Workers(client)))


def _client(address: str) -> Client:
    from distributed import Client
    from distributed.comm.addressing import get_address_host_port

    try:
        get_address_host_port(address)
    except ValueError as error:
        raise InputError(f"'{address}' is not an address such as tcp://HOST:8786: {error}", key=KEY) from None
    try:
        # A client that cannot be made waits, too, before it ends.
        kind = _kind(address)
        if kind != "Scheduler":
            raise InputError(f"{address} is the address of a {kind.lower()}; that of its scheduler is needed", key=KEY)
        return Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, TimeoutError):
        problem = f"no Dask scheduler answers at {address} within {CONNECT} seconds; 'dask scheduler' starts one"
        raise InputError(problem, key=KEY) from None
    except TypeError as error:
        raise InputError(f"certificates are missing in the configuration of Dask: {error}", key=KEY) from None


def _kind(address: str) -> str:
    """What answers at an address: "Scheduler", "Worker", "Nanny"."""
    import asyncio

    from distributed.core import rpc
    from distributed.security import Security
    from distributed.utils import LoopRunner

    async def asked() -> dict[str, Any]:
        certificates = Security().get_connection_args("client")
        async with rpc(address, timeout=CONNECT, connection_args=certificates) as there:
            return dict(await asyncio.wait_for(there.identity(), CONNECT))

    runner = LoopRunner(asynchronous=False)
    runner.start()
    try:
        return str(runner.run_sync(asked)["type"])
    finally:
        runner.stop()


def with_workers(compute: Callable[P, Result]) -> Callable[P, Result]:
    """Let a computation that is given workers as its `scheduler` be given what `connected` takes.

    Its result says how many tasks had to be begun again, if any.
    """

    @functools.wraps(compute)
    def asked(*args: P.args, **kwargs: P.kwargs) -> Result:
        with connected(cast("Any", kwargs.get("scheduler"))) as workers:
            kwargs["scheduler"] = workers
            found = compute(*args, **kwargs)
        return replace(found, attrs={**found.attrs, RETRIED: workers.retried}) if workers.retried else found

    return asked


@functools.cache
def identity() -> dict[str, str]:
    """What the bits of numbers depend on beside the question: versions, and what elementary functions give.

    The C library and NumPy choose their instructions by the processor, too.
    """
    library = " ".join(filter(None, platform.libc_ver())) or f"{platform.system()} {platform.release()}"
    values = [f(x) for x in np.linspace(-9.7, 9.7, 997).tolist() for f in (math.sin, math.cos, math.atan, math.exp)]
    values += [f(x) for x in np.geomspace(1e-9, 1e9, 997).tolist() for f in (math.log, math.tan, math.sqrt, math.cbrt)]
    matrix = np.array(values).reshape(8, -1)
    digest = hashlib.sha256(matrix.tobytes() + (matrix @ matrix.T).tobytes()).hexdigest()
    return {
        "jointplay": version(),
        "numpy": np.__version__,
        "the C library": library,
        "a processor": platform.machine(),
        "elementary functions": digest[:8],
    }


def _require_same(theirs: dict[str, str], ours: dict[str, str], worker: str) -> None:
    """Refuse a worker whose numbers may differ from those of the process that asks.

    Raises
    ------
    InputError
        The message names the worker and both versions.
    """
    other = [name for name in ours if theirs.get(name) != ours[name]]
    if other:
        has = ", ".join(f"{name} {theirs.get(name)} (here {ours[name]})" for name in other)
        raise InputError(f"worker {worker} has {has}; its numbers may differ in the last bits", key=KEY)


@functools.lru_cache(KEPT)
def _unpacked(task: bytes) -> tuple[Callable[..., Any], tuple[Any, ...]]:
    return cast("tuple[Callable[..., Any], tuple[Any, ...]]", pickle.loads(task))


def _answered(asked_by: dict[str, str], task: bytes, item: bytes) -> Any:
    """What a worker does for a task, on as many threads as it is said to have."""
    from distributed import get_worker

    worker = get_worker()
    # A worker may have come later than the others.
    _require_same(identity(), asked_by, worker.address)
    _core.share_threads(worker.state.nthreads)
    function, shared = _unpacked(task)
    return function(*shared, pickle.loads(item))
