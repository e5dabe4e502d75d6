"""Maps on disk that were damaged, are worked on by another run, or have no room: one line, never a wrong map."""

import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers.processes import COMMAND
from jointplay.analyses.map import Stopped, compute
from jointplay.analyses.map.store.lock import Lock
from jointplay.basics.files import remove_folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="limits and signals")
GRID = {"x": np.linspace(-60, 60, 5), "y": [150.0, 180.0, 190.0]}
ANEW = r"--overwrite \(overwrite=True\) makes it anew"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("five-bar.toml").write_text(jp.examples.text("five-bar"), encoding="utf-8")
    return tmp_path


def five_bar() -> jp.Mechanism:
    return jp.load("five-bar.toml")


def ask(name: str = "map.zarr", **options: object) -> None:
    jp.map(five_bar(), grid=GRID, path=name, chunk=2, **options).close()


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A map that is complete, and one that was stopped after two chunks."""
    folder = tmp_path_factory.mktemp("maps")
    m = jp.loads(jp.examples.text("five-bar"), "five-bar.toml")

    def stop(step: int, total: int) -> None:
        if step == 2:
            raise KeyboardInterrupt

    jp.map(m, grid=GRID, path=folder / "complete.zarr", chunk=2).close()
    with pytest.raises(Stopped):
        compute(m, grid=GRID, path=folder / "stopped.zarr", chunk=2, progress=stop)
    return {"complete": folder / "complete.zarr", "stopped": folder / "stopped.zarr"}


def empty(path: Path) -> None:
    path.write_bytes(b"")


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-3])


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))


def files(group: Path, pattern: str) -> list[Path]:
    found = sorted(path for path in group.glob(pattern) if path.is_file())
    assert found, pattern
    return found


DAMAGE: dict[str, Callable[[Path], None]] = {"delete": Path.unlink, "empty": empty, "truncate": truncate, "flip": flip}
PARTS = ["error/*.0", "status/*.*", "contact_change/.zarray", "x/.zarray", "y/0", ".zgroup"]
PLACES = {
    "stopped": [".journal/[0-9]*.npz", ".journal/position", ".journal/static", *PARTS],
    "complete": [".zmetadata", *PARTS],
}


class TestDamage:
    @pytest.mark.parametrize("which", PLACES)
    def test_a_damaged_map_is_refused_and_made_anew_on_demand(self, kept: dict[str, Path], which: str) -> None:
        """Every part and every damage is refused, and after each kind of damage the map is made anew."""
        kinds, anew = list(DAMAGE), list(DAMAGE)
        for part in PLACES[which]:
            for how in kinds[:2]:
                shutil.rmtree("map.zarr", ignore_errors=True)
                shutil.copytree(kept[which], "map.zarr")
                DAMAGE[how](files(Path("map.zarr"), part)[0])
                with pytest.raises(jp.InputError, match=f"map.zarr: is damaged: .*; {ANEW}"):
                    ask()
            if how in anew:
                ask(overwrite=True)
                ask()
                anew.remove(how)
            kinds = [*kinds[1:], kinds[0]]

    def test_a_copy_of_a_complete_map_is_taken_as_it_is(self, kept: dict[str, Path]) -> None:
        shutil.copytree(kept["complete"], "map.zarr")
        ask()

    @pytest.mark.parametrize("part", [".journal", "status", "error"])
    def test_a_folder_that_is_gone(self, kept: dict[str, Path], part: str) -> None:
        for name in ("stopped", "complete"):
            shutil.copytree(kept[name], f"{name}.zarr")
            if part == ".journal" and name == "complete":
                continue
            shutil.rmtree(Path(f"{name}.zarr", part))
            with pytest.raises(jp.InputError, match=f"{name}.zarr: is damaged"):
                ask(f"{name}.zarr")

    @pytest.mark.parametrize("how", ["delete", "empty", "truncate"])
    def test_a_map_without_its_attributes_is_something_else(self, kept: dict[str, Path], how: str) -> None:
        for name, group in kept.items():
            shutil.copytree(group, f"{name}.zarr")
            DAMAGE[how](Path(f"{name}.zarr", ".zattrs"))
            with pytest.raises(jp.InputError, match="holds something else than this map"):
                ask(f"{name}.zarr")


def test_two_runs_do_not_work_on_one_map(folder: Path) -> None:
    for name in ("map.zarr", "map.nc"):
        lock = Lock(folder / name)
        with pytest.raises(jp.InputError, match=f"{name}: another run works on it"):
            ask(name)
        lock.release()
        ask(name)
    assert {path.name for path in folder.iterdir()} == {"five-bar.toml", "map.zarr", "map.nc"}


def test_a_lock_ends_with_the_process_that_had_it(folder: Path) -> None:
    lock = "from jointplay.analyses.map.store.lock import Lock; Lock(pathlib.Path('map.zarr'))"
    code = f"import os, pathlib; {lock}; os._exit(9)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 9
    assert (folder / ".map.zarr.lock").exists()
    ask()


def limited(size: int) -> Callable[[], None]:
    def limit() -> None:
        # Python does not notice that its byte code is cut off, and the next command would read it.
        os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return limit


@pytest.mark.parametrize(("size", "name"), [*product([300, 2_000, 20_000], ["map.zarr", "map.nc"])])
def test_a_map_on_a_full_disk_ends_with_one_line_and_can_be_taken_up(size: int, name: str) -> None:
    """HDF5 brought down the process, Zarr gave a traceback."""
    line = [*COMMAND, "map", "five-bar.toml", "-g", "x=-60:60:9", "-g", "y=150:190:9", "--chunk", "32", "-o", name]
    full = subprocess.run(line, capture_output=True, text=True, preexec_fn=limited(size))
    if full.returncode != 0:
        assert full.returncode == 2
        assert full.stderr.startswith(f"error: {name}: cannot be written: File too large")
        assert full.stderr.count("\n") == 1
        assert not Path(name).exists() or name.endswith(".zarr")
    else:
        assert size == 20_000
    assert subprocess.run(line, capture_output=True, text=True).returncode == 0
    assert {path.name for path in Path().iterdir()} == {"five-bar.toml", name}
    grid = {"x": np.linspace(-60, 60, 9), "y": np.linspace(150, 190, 9)}
    with jp.map(five_bar(), grid=grid, path=name, chunk=32) as made:
        assert (made.status == "ok").all()


def test_a_folder_is_removed_although_something_else_tidies_it_up(tmp_path: Path) -> None:
    """Of a map on a full disk it was reported that a file was missing: threads that failed removed theirs meanwhile."""
    for _ in range(20):
        room = tmp_path / "room"
        room.mkdir()
        files = [room / f"{k}.partial" for k in range(200)]
        for file in files:
            file.touch()
        with ThreadPoolExecutor(1) as pool:
            tidied = pool.submit(lambda files=files: [file.unlink(missing_ok=True) for file in files])
            remove_folder(room)
            tidied.result()
        assert not room.exists()


def test_a_link_to_a_map_stays_a_link(folder: Path) -> None:
    (folder / "elsewhere").mkdir()
    for name in ("map.zarr", "map.nc"):
        Path(name).symlink_to(f"elsewhere/{name}")
        ask(name)
        ask(name)
        assert Path(name).is_symlink()
        assert Path("elsewhere", name).exists()
    assert {path.name for path in Path("elsewhere").iterdir()} == {"map.nc", "map.zarr"}
