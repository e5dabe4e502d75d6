"""Questions asked of the workers of a Dask scheduler: the same bits, whatever becomes of the workers."""

import logging
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from functools import partial
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from helpers import answers
from jointplay import _core
from jointplay.analyses import cluster
from jointplay.analyses.map import Stopped, compute, open_map, store
from jointplay.cli import run
from jointplay.result import to_dataset

GRID = {"x": {"from": -120, "to": 120, "count": 21}, "y": {"from": -120, "to": 120, "count": 21}, "angle": 0}
AXES = ["-g", "x=-120:120:21", "-g", "y=-120:120:21", "-g", "angle=0"]
#: what is attempted again is no difference
same = partial(answers.same, own=("fingerprint", "retried"))


def local(count: int = 2) -> Any:
    from distributed import LocalCluster

    return LocalCluster(
        n_workers=count,
        threads_per_worker=1,
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        silence_logs=logging.CRITICAL,
    )


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with local() as two:
        yield two.scheduler_address


@pytest.fixture
def client(address: str) -> Iterator[Any]:
    from distributed import Client

    with Client(address, set_as_default=False) as connected:
        connected.wait_for_workers(2)
        yield connected


@pytest.fixture
def m() -> jp.Mechanism:
    return jp.loads(jp.examples.text("3-rrr"))


# --- the same bits ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("question", "name"), [*product(["loaded", "worst", "random", "given", "solve"], [None, "map.zarr"])]
)
def test_a_map_is_that_of_one_process(
    question: str, name: str | None, client: Any, m: jp.Mechanism, tmp_path: Path
) -> None:
    options = {"samples": 64} if question == "random" else {}
    path = name and tmp_path / name
    with jp.map(m, question, GRID, chunk=64, path=path, scheduler=client, **options) as made:
        same(jp.map(m, question, GRID, chunk=64, **options), made)
        assert "retried" not in made.attrs
    assert not list(tmp_path.glob("*/.journal"))


def test_a_map_as_netcdf_is_that_of_one_process(client: Any, m: jp.Mechanism, tmp_path: Path) -> None:
    with jp.map(m, grid=GRID, chunk=64, details=False, path=tmp_path / "map.nc", scheduler=client) as made:
        same(jp.map(m, grid=GRID, chunk=64, details=False), made)


def test_a_map_with_outputs_and_load_cases_is_that_of_one_process(client: Any) -> None:
    """The part of the mechanism that leads is another one than that which is asked."""
    m = jp.loads(jp.examples.text("slider-crank-cases"))
    grid = {m.drives[0]: {"from": 10, "to": 50, "count": 9}}
    same(jp.map(m, grid=grid, chunk=2), jp.map(m, grid=grid, chunk=2, scheduler=client))


@pytest.mark.parametrize("contact", ["scattered", "loaded"])
def test_random_is_that_of_one_process(contact: str, client: Any) -> None:
    m = jp.loads(jp.examples.text("four-bar")).with_({"limits.position": 1.2})
    options: dict[str, Any] = {"samples": 4096, "contact": contact, "rare": True}
    if contact == "scattered":
        options |= {"indices": True}
    same(jp.random(m, **options), jp.random(m, **options, scheduler=client))


def test_random_of_an_over_constrained_mechanism_is_that_of_one_process(client: Any) -> None:
    m = jp.loads(jp.examples.text("x-braced-square"))
    same(jp.random(m, samples=512), jp.random(m, samples=512, scheduler=client))


def test_a_sweep_is_that_of_one_process(client: Any) -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    key, values = "joints.*.clearance.radial", np.linspace(0.1, 1.0, 7)
    for options in ({}, {"by": {"dimensions.l2.tolerance": [0.01, 0.02, 0.05]}}):
        same(jp.sweep(m, key, values, **options), jp.sweep(m, key, values, **options, scheduler=client))


def test_commands_ask_workers(address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("m.toml").write_text(jp.examples.text("3-rrr"), encoding="utf-8")
    with_workers = ["--scheduler", address]
    for command in (
        ["map", "m.toml", *AXES, "--chunk", "100"],
        ["error", "m.toml", "-q", "random", "--samples", "256"],
        ["sweep", "m.toml", "-s", "joints.*.clearance.radial=0.01:0.02:3"],
    ):
        here, there = f"{command[0]}-here.zarr", f"{command[0]}-there.zarr"
        assert run([*command, "-o", here]) == run([*command, "-o", there, *with_workers])
        with xr.open_zarr(here, chunks=None) as ours, xr.open_zarr(there, chunks=None) as theirs:
            same(ours, theirs)


def test_a_mechanism_is_the_same_in_another_process() -> None:
    """A part of one with outputs and load cases was another part when it came back."""
    import pickle

    m = jp.loads(jp.examples.text("slider-crank-cases"))
    for part in (m, m.first, *m.every_part, m.without_load_cases()):
        copy = pickle.loads(pickle.dumps(part))
        assert (copy.of, copy.outputs, copy.load_cases, copy.spec()) == (
            *(part.of, part.outputs, part.load_cases, part.spec()),
        )


# --- workers that fail -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["map.zarr", None])
def test_a_worker_that_is_killed_in_the_middle_changes_nothing(
    name: str | None, m: jp.Mechanism, tmp_path: Path
) -> None:
    from distributed import Client

    path = name and tmp_path / name
    with local() as two, Client(two, set_as_default=False) as client:
        client.wait_for_workers(2)
        (worker, pid), *_ = client.run(os.getpid).items()
        killed = threading.Event()

        def kill() -> None:
            """It stands still, so that it is soon asked for a task, or for an answer that it has, and gives none."""
            for _ in range(60):
                if client.processing().get(worker):
                    break
                time.sleep(0.05)
            os.kill(pid, signal.SIGKILL)
            killed.set()

        killer = threading.Thread(target=kill)

        def told(done: int, total: int) -> None:
            if done >= 5 and killer.ident is None:
                os.kill(pid, signal.SIGSTOP)
                killer.start()

        made = compute(m, "worst", GRID, chunk=16, path=path, scheduler=client, progress=told)
        killer.join()
    with to_dataset(made) if made is not None else open_map(path) as whole:
        same(jp.map(m, "worst", GRID, chunk=16), whole)
        assert killed.is_set()
        assert whole.attrs["retried"] >= 1


def _fails_at_first(folder: Path, item: int) -> int:
    if item == 3 and not (folder / "tried").exists():
        (folder / "tried").touch()
        raise OSError("once")
    return 10 * item


def _fails(item: int) -> int:
    raise OSError(28, f"no room for {item}")


def test_a_task_that_fails_is_begun_again_a_few_times(client: Any, tmp_path: Path) -> None:
    with cluster.connected(client) as workers:
        assert list(workers.each(_fails_at_first, (tmp_path,), range(8))) == [10 * item for item in range(8)]
        assert workers.retried == 1
    with cluster.connected(client) as workers:
        with pytest.raises(OSError, match="no room for 0"):
            list(workers.each(_fails, (), range(8)))
        assert workers.retried == cluster.TRIES - 1


def _ends(item: int) -> None:
    os._exit(1)


def test_a_task_that_ends_its_workers_is_given_up() -> None:
    import dask.config
    from distributed import Client

    said = r"2 workers ended while they computed the same task, the last of them tcp://127"
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        local() as two,
        Client(two, set_as_default=False) as client,
        pytest.raises(jp.InputError, match=said),
        cluster.connected(client) as workers,
    ):
        list(workers.each(_ends, (), range(1)))


def test_what_is_wrong_with_the_input_is_said_as_in_one_process(client: Any, tmp_path: Path) -> None:
    m = jp.loads(jp.examples.text("four-bar"))
    with pytest.raises(jp.InputError, match=r"joints\.J1\.clearance\.radial") as here:
        jp.sweep(m, "joints.J1.clearance.radial", [0.1, -1.0])
    with pytest.raises(jp.InputError) as there:
        jp.sweep(m, "joints.J1.clearance.radial", [0.1, -1.0], scheduler=client)
    assert str(here.value) == str(there.value)


# --- stopped and continued -------------------------------------------------------------------------------------------


def test_ctrl_c_leaves_a_map_that_goes_on_anywhere(client: Any, m: jp.Mechanism, tmp_path: Path) -> None:
    path = tmp_path / "map.zarr"

    def interrupt(done: int, total: int) -> None:
        if done == 12:
            raise KeyboardInterrupt

    with pytest.raises(Stopped, match="interrupted after 12 of 36 chunks, which are kept"):
        compute(m, grid=GRID, chunk=16, path=path, scheduler=client, progress=interrupt)
    # Workers that are still at work write no more.
    assert not (path / ".journal" / "run").exists()
    steps: list[int] = []
    compute(m, grid=GRID, chunk=16, path=path, progress=lambda done, total: steps.append(done))
    assert steps[0] == 12
    with open_map(path) as whole:
        same(jp.map(m, grid=GRID, chunk=16), whole)


def test_chunks_that_wait_for_another_time_are_all_known_after_a_kill(m: jp.Mechanism, tmp_path: Path) -> None:
    """Workers change several chunks at once; whichever is written when the run is killed is no damage."""
    path, grid = tmp_path / "map.zarr", {"x": np.linspace(-100, 100, 9), "y": 20, "angle": 0}
    opened: list[store.ChunkStore] = []

    class Killed(BaseException):
        pass

    def ending(self: store.ChunkStore, attributes: Any) -> None:
        for number in (2, 5):
            self.announce(number)
        writer = self.writer()
        assert writer is not None
        writer.replace("error", (slice(2, 3),), np.full((1, 3), 7.0))
        opened.append(self)
        raise Killed

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(store.ChunkStore, "finish", ending)
        with pytest.raises(Killed):
            jp.map(m, grid=grid, path=path, chunk=1)
    resumed = store.open_store(path, opened[0].plan, overwrite=False)
    try:
        assert resumed.resume(range(9)) == opened[0].position
    finally:
        resumed.close()


# --- what is refused -------------------------------------------------------------------------------------------------


def _is_another(version: str | None, dask_worker: Any) -> None:
    """Let a worker have another version of jointplay; with None its own again."""
    cluster.identity.cache_clear()
    if version is not None:
        cluster.identity()["jointplay"] = version


def test_a_worker_of_another_version_is_refused(client: Any, m: jp.Mechanism) -> None:
    worker = sorted(client.nthreads())[1]
    said = rf"scheduler: worker {worker} has jointplay 0\.0\.9 \(here {cluster.identity()['jointplay']}\); its numbers"
    client.run(_is_another, "0.0.9", workers=[worker])
    try:
        with pytest.raises(jp.InputError, match=said):
            jp.map(m, grid=GRID, chunk=16, scheduler=client)
    finally:
        client.run(_is_another, None)
    with cluster.connected(client) as workers:
        # One that comes later.
        client.run(_is_another, "0.0.9", workers=[worker])
        try:
            with pytest.raises(jp.InputError, match=said):
                list(workers.each(abs, (), range(50)))
        finally:
            client.run(_is_another, None)


def test_the_c_library_and_what_it_gives_count() -> None:
    ours = cluster.identity()
    assert ours["the C library"].split()[-1][0].isdigit()
    theirs = ours | {"the C library": "glibc 2.17", "elementary functions": "0"}
    said = rf"has the C library glibc 2\.17 \(here {ours['the C library']}\), elementary functions 0 \(here"
    with pytest.raises(jp.InputError, match=said):
        cluster._require_same(theirs, ours, "tcp://10.0.0.1:1")


def _sees_nothing(name: str, dask_worker: Any) -> None:
    from jointplay.analyses.map.store import writer

    writer.RUN = name


def test_a_folder_that_workers_do_not_see_is_refused(client: Any, m: jp.Mechanism, tmp_path: Path) -> None:
    client.run(_sees_nothing, "nothing")
    try:
        said = r"map\.zarr: is not seen by a worker on .*; a map goes to a folder that all machines share"
        with pytest.raises(jp.InputError, match=said):
            jp.map(m, grid=GRID, chunk=16, path=tmp_path / "map.zarr", scheduler=client)
    finally:
        client.run(_sees_nothing, "run")
    with jp.map(m, grid=GRID, chunk=16, path=tmp_path / "map.zarr", scheduler=client) as whole:
        same(jp.map(m, grid=GRID, chunk=16), whole)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("tcp://127.0.0.1:1", "no Dask scheduler answers at tcp://127.0.0.1:1 within 0.3 seconds"),
        ("nowhere", "'nowhere' is not an address such as tcp://HOST:8786"),
        ("tls://127.0.0.1:1", "certificates are missing in the configuration of Dask: TLS expects"),
    ],
)
def test_an_address_without_a_scheduler_is_refused(
    wrong: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cluster, "CONNECT", 0.3)
    Path("m.toml").write_text(jp.examples.text("3-rrr"), encoding="utf-8")
    assert run(["map", "m.toml", *AXES, "-o", "map.zarr", "--scheduler", wrong]) == 2
    assert f"error: scheduler: {said}" in capsys.readouterr().err
    assert sorted(path.name for path in Path().iterdir()) == ["m.toml"]


def test_a_worker_is_no_scheduler(client: Any, m: jp.Mechanism) -> None:
    """Dask's client waited 20 seconds after its error, and then had another one."""
    worker = next(iter(client.scheduler_info()["workers"]))
    with pytest.raises(jp.InputError, match=f"scheduler: {worker} is the address of a worker; that of its scheduler"):
        jp.map(m, grid=GRID, scheduler=worker)


def test_what_listens_and_does_not_answer_is_no_scheduler(m: jp.Mechanism, monkeypatch: pytest.MonkeyPatch) -> None:
    """A server of another kind waits for more."""
    monkeypatch.setattr(cluster, "CONNECT", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(
            jp.InputError, match=f"scheduler: no Dask scheduler answers at {address} within 0.3 seconds"
        ):
            jp.map(m, grid=GRID, scheduler=address)


def test_a_client_that_is_closed_before_or_in_the_middle_is_named(address: str, m: jp.Mechanism) -> None:
    """Closing what is closed had an error of its own, of the kind that prints a traceback."""
    from distributed import Client

    closed = Client(address, set_as_default=False)

    def items() -> Iterator[int]:
        yield 1
        closed.close()
        yield 2

    with (
        pytest.raises(jp.InputError, match=r"scheduler: the scheduler has ended, .* or its client is closed"),
        cluster.connected(closed) as workers,
    ):
        list(workers.each(abs, (), items()))
    with pytest.raises(jp.InputError, match="scheduler: the client is closed; an open one is needed"):
        jp.map(m, grid=GRID, scheduler=closed)


def test_a_scheduler_without_workers_is_waited_for_a_while(m: jp.Mechanism, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "NOBODY", 0.5)
    with local(0) as none, pytest.raises(jp.InputError, match=r"tcp://.* has had no workers for 0\.5 seconds"):
        jp.map(m, grid=GRID, scheduler=none.scheduler_address)


def test_what_is_no_scheduler_is_a_wrong_type(m: jp.Mechanism) -> None:
    with pytest.raises(TypeError, match=r"map\(\): 'scheduler' is a Dask client or the address of a scheduler"):
        jp.map(m, grid=GRID, scheduler=8786)


# --- threads ---------------------------------------------------------------------------------------------------------


def _listens(is_listening: bool, dask_worker: Any) -> None:
    """Let a worker write down on how many threads it is to work."""
    cluster._core = SimpleNamespace(share_threads=_counts.append) if is_listening else _core


_counts: list[int] = []


def _count(item: int) -> int:
    return _counts[-1]


def test_tasks_share_the_threads_of_their_worker(client: Any) -> None:
    client.run(_listens, True)
    try:
        with cluster.connected(client) as workers:
            assert list(workers.each(_count, (), range(4))) == [1, 1, 1, 1]
    finally:
        client.run(_listens, False)


COUNT = """
import threading
import time
from pathlib import Path
import jointplay as jp
from jointplay import _core

def threads(): return len(list(Path("/proc/self/task").iterdir()))
def work(): jp.worst(jp.loads(jp.examples.text("four-bar")))
def beside():
    thread = threading.Thread(target=work); thread.start(); thread.join()

jp.loads(jp.examples.text("four-bar")); work()
before = threads()
for count in (5, 3):
    _core.share_threads(count)
    beside()
    limit = time.monotonic() + 60
    # Those of before end by themselves.
    while threads() - before != count and time.monotonic() < limit:
        time.sleep(0.01)
    print(threads() - before)
"""


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="needs /proc")
def test_a_worker_works_on_as_many_threads_as_it_is_said_to_have() -> None:
    done = subprocess.run([sys.executable, "-c", COUNT], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["5", "3"]
