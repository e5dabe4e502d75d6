"""Maps on disk: the same numbers, whatever happens on the way, in bounded memory."""

import functools
import json
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from helpers.answers import same
from helpers.processes import working
from jointplay.analyses.map import Stopped, compute, open_map
from jointplay.analyses.map.store.checks import sealed
from jointplay.cli import run

GRID = {"x": {"from": -120, "to": 120, "count": 25}, "y": {"from": -120, "to": 120, "count": 25}, "angle": 0}
AXES = ["-g", "x=-120:120:25", "-g", "y=-120:120:25", "-g", "angle=0"]
FORMATS = ["map.zarr", "map.nc"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("3-rrr", "five-bar"):
        Path(f"{name}.toml").write_text(jp.examples.text(name), encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("name", FORMATS)
class TestFiles:
    @pytest.mark.parametrize("question", ["loaded", "worst", "solve"])
    def test_hold_what_the_map_in_memory_holds(self, name: str, question: str) -> None:
        m = jp.load("five-bar.toml")
        grid = {"x": np.linspace(-150, 150, 7), "y": [120.0, 150.0, 400.0]}
        with jp.map(m, question, grid, path=name, chunk=8) as written:
            same(jp.map(m, question, grid, chunk=8), written)
        left = {path.name for path in Path().iterdir()} - {"3-rrr.toml", "five-bar.toml", name}
        assert not left

    def test_without_details_are_another_map(self, name: str) -> None:
        m = jp.load("five-bar.toml")
        grid = {"x": np.linspace(-150, 150, 7), "y": [120.0, 150.0, 400.0]}
        with jp.map(m, grid=grid, path=name, chunk=8, details=False) as written:
            same(jp.map(m, grid=grid, chunk=8, details=False), written)
        with pytest.raises(jp.InputError, match="something else"):
            jp.map(m, grid=grid, path=name, chunk=8)

    def test_are_not_made_twice(self, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
        m = jp.load("3-rrr.toml")
        jp.map(m, grid=GRID, path=name).close()
        monkeypatch.setattr("jointplay.analyses.map.Work", None)
        jp.map(m, grid=GRID, path=name).close()

    def test_of_something_else_are_kept(self, name: str) -> None:
        m = jp.load("five-bar.toml")
        grid = {"x": [0.0, 10.0], "y": 180.0}
        jp.map(m, grid=grid, path=name).close()
        for other, question in ((m.with_({"loads.0.force": [1, 0]}), "loaded"), (m, "worst")):
            with pytest.raises(jp.InputError, match=f"{name}: holds something else than this map; --overwrite"):
                jp.map(other, question, grid, path=name)
            with jp.map(other, question, grid, path=name, overwrite=True) as replaced:
                same(jp.map(other, question, grid), replaced)
            shutil.rmtree(name) if Path(name).is_dir() else Path(name).unlink()
            jp.map(m, grid=grid, path=name).close()

    def test_that_are_no_maps_are_kept(self, name: str) -> None:
        if name.endswith(".zarr"):
            Path(name).mkdir()
            Path(name, "notes.txt").write_text("mine", encoding="utf-8")
        else:
            Path(name).write_text("mine", encoding="utf-8")
        with pytest.raises(jp.InputError, match="holds something else"):
            jp.map(jp.load("five-bar.toml"), grid={"x": [0.0, 10.0], "y": 180.0}, path=name)
        assert Path(name, "notes.txt").exists() or Path(name).read_text(encoding="utf-8") == "mine"


@functools.cache
def of_three_legs() -> xr.Dataset:
    """The map in memory that many are compared with."""
    return jp.map(jp.loads(jp.examples.text("3-rrr"), "3-rrr.toml"), grid=GRID, chunk=16)


def test_paths_that_cannot_be_written_are_refused_before_the_work() -> None:
    m, grid = jp.load("five-bar.toml"), {"x": [0.0, 10.0], "y": 180.0}
    with pytest.raises(jp.InputError, match=r"a map is written as \.zarr or \.nc"):
        jp.map(m, grid=grid, path="map.csv")
    with pytest.raises(jp.InputError, match="there is no folder 'nowhere'"):
        jp.map(m, grid=grid, path="nowhere/map.nc")


# --- interrupted -----------------------------------------------------------------------------------------------------


@contextmanager
def mapping(name: str) -> Iterator[subprocess.Popen[str]]:
    """The command at work on a map of 49 chunks, after some of them."""
    with working(["map", "3-rrr.toml", *AXES, "--chunk", "16", "-o", name]) as process:
        group = Path(name if name.endswith(".zarr") else f".{name}.part")
        limit = time.monotonic() + 60
        while done(group) < 5:
            assert time.monotonic() < limit, "no chunk was done in a minute"
            assert process.poll() is None, process.communicate()
            time.sleep(0.002)
        yield process


def done(group: Path) -> int:
    try:
        number, count = json.loads(sealed(group / ".journal" / "position"))
    except FileNotFoundError:
        return 0
    return count if number == 1 else 10**6


@pytest.mark.parametrize("name", FORMATS)
def test_a_run_that_is_killed_is_taken_up_and_ends_as_one_that_was_not(name: str) -> None:
    m = jp.load("3-rrr.toml")
    with mapping(name) as killed:
        killed.send_signal(signal.SIGKILL)
        killed.communicate()
    assert killed.returncode == -signal.SIGKILL
    group = Path(name if name.endswith(".zarr") else f".{name}.part")
    kept = done(group)
    assert 5 <= kept < 49, "it was not killed in the middle"
    entries = {path.name: path.stat().st_mtime_ns for path in (group / ".journal").glob("*.npz")}
    assert len(entries) >= kept
    steps: list[int] = []
    compute(m, grid=GRID, path=name, chunk=16, progress=lambda step, total: steps.append(step))
    assert steps == list(range(kept, 49)), "what was done is not done again"
    with open_map(name) as resumed:
        same(of_three_legs(), resumed)
    assert not list(Path().glob(".map*"))


class Killed(BaseException):
    """Ends a run at a chosen place, as a signal could."""


#: where a run ends; a file of netCDF is made of a finished group, so that only the last ends are its own
ENDS = ("put", "replace", "advance", "clean", "begin", "record", "finish")
PLACES = [("clean", "map.nc"), *((where, "map.zarr") for where in ENDS), *((where, "map.nc") for where in ENDS)]


@pytest.mark.parametrize(("where", "name"), list(dict.fromkeys(PLACES)))
def test_wherever_a_run_ends_it_can_be_taken_up(where: str, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from jointplay.analyses.map.store import ChunkStore

    m, grid = jp.load("five-bar.toml"), {"x": np.linspace(-60, 60, 5), "y": [150.0, 180.0, 190.0]}
    chunk = 2
    if where == "replace":  # contacts have to change sides between chunks
        m, grid, chunk = jp.load("3-rrr.toml"), {"x": np.linspace(-100, 100, 9), "y": 20, "angle": 0}, 1
    expected = jp.map(m, grid=grid, chunk=chunk)
    for after in (False, True):
        path = f"{after}-{name}"
        original, calls = getattr(ChunkStore, where), []

        def ending(self: ChunkStore, *args: object, original=original, calls=calls, after=after) -> None:
            calls.append(args)
            last = len(calls) == (1 if where in ("replace", "finish", "clean") else 3)
            if after or not last:
                original(self, *args)
            if last:
                raise Killed

        with monkeypatch.context() as patch:
            patch.setattr(ChunkStore, where, ending)
            with pytest.raises(Killed):
                jp.map(m, grid=grid, path=path, chunk=chunk)
        with jp.map(m, grid=grid, path=path, chunk=chunk) as resumed:
            same(expected, resumed)


def test_a_chunk_that_was_joined_with_its_neighbours_but_not_recorded_is_no_damage(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A run that was killed between the two ended as a complete map that was refused as damaged ever after."""
    from jointplay.analyses.map.store import Writer

    m, grid = jp.load("3-rrr.toml"), {"x": np.linspace(-100, 100, 9), "y": 20, "angle": 0}

    def ending(self: Writer, *args: object, original=Writer.replace) -> None:
        original(self, *args)
        raise Killed

    with monkeypatch.context() as patch:
        patch.setattr(Writer, "replace", ending)
        with pytest.raises(Killed):
            jp.map(m, grid=grid, path="map.zarr", chunk=1)
    for _ in range(2):
        with jp.map(m, grid=grid, path="map.zarr", chunk=1) as whole:
            same(jp.map(m, grid=grid, chunk=1), whole)


def test_a_map_that_is_not_complete_can_be_read_and_says_so() -> None:
    m = jp.load("3-rrr.toml")

    def interrupt(step: int, total: int) -> None:
        if step == 20:
            raise KeyboardInterrupt

    with pytest.raises(Stopped, match="interrupted after 20 of 49 chunks, which are kept; the same command continues"):
        compute(m, grid=GRID, path="map.zarr", chunk=16, progress=interrupt)
    with open_map("map.zarr") as part:
        assert part.attrs["incomplete"]
        assert int((part.status != "").sum()) >= 20
    with jp.map(m, grid=GRID, path="map.zarr", chunk=16) as whole:
        assert "incomplete" not in whole.attrs
        same(of_three_legs(), whole)


def test_ctrl_c_keeps_what_is_done_and_says_how_it_goes_on() -> None:
    with mapping("map.zarr") as stopped:
        stopped.send_signal(signal.SIGINT)
        _, said = stopped.communicate(timeout=60)
    assert stopped.returncode == 130
    assert "of 49 chunks, which are kept; the same command continues from there" in said
    assert run(["map", "3-rrr.toml", *AXES, "--chunk", "16", "-o", "map.zarr"]) == 1
    with open_map("map.zarr") as resumed:
        same(of_three_legs(), resumed)


# --- memory ----------------------------------------------------------------------------------------------------------

PEAK = """
import resource, sys
import jointplay as jp
m = jp.load("five-bar.toml")
grid = {"x": {"from": -60, "to": 60, "count": int(sys.argv[1])}, "y": {"from": 150, "to": 190, "count": 300}}
jp.map(m, grid=grid, path=sys.argv[2], chunk=8000).close()
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
"""


@pytest.mark.parametrize("name", FORMATS)
def test_memory_is_that_of_a_chunk_however_many_there_are(name: str) -> None:
    def peak(count: int) -> int:
        arguments = [sys.executable, "-c", PEAK, str(count), f"{count}.{name}"]
        return int(subprocess.run(arguments, capture_output=True, text=True, check=True).stdout)

    small, large = peak(30), peak(500)
    nodes = (500 - 30) * 300
    with open_map(f"30.{name}") as part:
        whole = nodes * part.nbytes / (30 * 300)
    # The larger map has twice what its run may use more.
    assert whole > 75e6
    assert large - small < whole / 2
