"""Where a command writes: full disks, links, pipes, devices, standard streams; and what it writes of a hostile text."""

import os
import resource
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import jointplay as jp
from helpers.processes import COMMAND
from jointplay.cli import run

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="limits, links and devices")
RESULTS = ["r.nc", "r.zarr", "r.csv", "r.json"]
SOLVE = ["solve", "m.toml"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("m.toml").write_text(jp.examples.text("four-bar"), encoding="utf-8")
    return tmp_path


def command(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*COMMAND, *arguments], **{"capture_output": True, "text": True, **options})  # type: ignore[call-overload]


def full_disk() -> None:
    # Python does not notice that its byte code is cut off, and the next command would read it.
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000, 1_000))


def refused(done: subprocess.CompletedProcess[str], part: str) -> None:
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    assert part in done.stderr


@pytest.mark.parametrize(
    "line",
    [
        *(f"solve m.toml -o {name}" for name in RESULTS),
        *(f"solve m.toml --plot d.{kind}" for kind in ("png", "svg", "pdf")),
        "map m.toml -g theta1=20:60:3 --plot d.html",
        "new 3-upu -o new.toml",
        "schema -o schema.json",
    ],
)
def test_a_full_disk_is_one_line_and_leaves_nothing(folder: Path, line: str) -> None:
    """HDF5 brought down the process (segmentation fault) when it closed a file that it could not write."""
    before = {path.name for path in folder.iterdir()}
    refused(command(*line.split(), preexec_fn=full_disk), f"{line.split()[-1]}: cannot be written: File too large")
    assert {path.name for path in folder.iterdir()} == before


@pytest.mark.parametrize("name", RESULTS)
def test_a_symbolic_link_stays_and_what_it_leads_to_is_replaced(folder: Path, name: str) -> None:
    (folder / "elsewhere").mkdir()
    Path(name).symlink_to(f"elsewhere/{name}")
    for _ in range(2):  # at first it leads to nothing
        assert run([*SOLVE, "-o", name]) == 0
        assert Path(name).is_symlink()
    assert [path.name for path in Path("elsewhere").iterdir()] == [name]
    Path("lost.csv").symlink_to("nowhere/r.csv")
    Path("round.csv").symlink_to("round.csv")
    for link, part in (("lost.csv", "there is no folder '"), ("round.csv", "cannot be written: ")):
        refused(command(*SOLVE, "-o", link), part)
        assert Path(link).is_symlink()


@pytest.mark.parametrize("name", ["r.nc", "r.csv", "r.json"])
def test_a_pipe_is_written_to(name: str) -> None:
    os.mkfifo(name)
    read: list[bytes] = []
    reader = threading.Thread(target=lambda: read.append(Path(name).read_bytes()), daemon=True)
    reader.start()
    assert run([*SOLVE, "-o", name]) == 0
    reader.join(60)
    assert stat.S_ISFIFO(Path(name).stat().st_mode)
    assert run([*SOLVE, "-o", f"file.{name}"]) == 0
    assert len(read[0]) == Path(f"file.{name}").stat().st_size


def test_a_device_is_written_to(folder: Path) -> None:
    """`-o` on a link to /dev/full, as the superuser, replaced the device by a file."""
    try:
        os.mknod("full.csv", 0o666 | stat.S_IFCHR, os.makedev(1, 7))
        Path("full.csv").open("wb").close()
    except PermissionError:
        pytest.skip("only the superuser makes devices")
    refused(command(*SOLVE, "-o", "full.csv"), "full.csv: cannot be written: No space left on device")
    assert stat.S_ISCHR(Path("full.csv").stat().st_mode)


def test_neither_a_folder_nor_a_pipe_takes_a_zarr_group(folder: Path) -> None:
    os.mkfifo("pipe.zarr")
    Path("file.zarr").write_text("mine", encoding="utf-8")
    Path("folder.csv").mkdir()
    for name in ("pipe.zarr", "file.zarr", "folder.csv"):
        refused(command(*SOLVE, "-o", name), f"{name}: is ")
    assert Path("file.zarr").read_text(encoding="utf-8") == "mine"


def test_the_rights_of_what_is_replaced_are_kept() -> None:
    Path("r.csv").touch(0o640)
    Path("r.csv").chmod(0o640)
    assert run([*SOLVE, "-o", "r.csv"]) == 0
    assert stat.S_IMODE(Path("r.csv").stat().st_mode) == 0o640


@pytest.mark.parametrize("option", ["-o", "--plot"])
def test_a_name_that_is_too_long(option: str) -> None:
    kind = "csv" if option == "-o" else "svg"
    refused(command(*SOLVE, option, f"{'n' * 300}.{kind}"), "File name too long")
    assert run([*SOLVE, option, f"{'n' * 250}.{kind}"]) == 0


def test_a_name_with_a_zero_byte(folder: Path) -> None:
    with pytest.raises(jp.InputError, match="is not the name of a file"):
        jp.save(jp.solve(jp.load("m.toml")), "a\0.csv")


def test_a_file_whose_name_is_not_utf_8(folder: Path) -> None:
    name = os.fsdecode(b"m\xff.toml")
    Path("m.toml").rename(name)
    Path(name).write_text(Path(name).read_text().replace("title  =", "#"), encoding="utf-8")
    assert run(["solve", name]) == 0
    for out in RESULTS:
        assert run(["solve", name, "-o", out]) == 0


# --- standard streams ------------------------------------------------------------------------------------------------


def test_a_full_standard_output_is_one_line() -> None:
    with Path("/dev/full").open("w") as full:
        for line in (SOLVE, ["schema"], ["new"], ["--help"], ["--version"]):
            refused(command(*line, capture_output=False, stdout=full, stderr=subprocess.PIPE), "No space left")


@pytest.mark.parametrize("closed", ["1", "2", "0 1 2"])
def test_closed_streams(closed: str) -> None:
    def shut() -> None:
        for handle in map(int, closed.split()):
            os.close(handle)

    streams = {"capture_output": False, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    done = command(*SOLVE, preexec_fn=shut, **streams)
    assert done.returncode == (2 if "1" in closed else 0)
    assert done.stderr == (
        "error: the standard output cannot be written: Bad file descriptor\n" if closed == "1" else ""
    )
    assert command(*SOLVE, "-o", "r.nc", preexec_fn=shut, **streams).returncode == 0
    assert "r.nc" in os.listdir()  # noqa: PTH208


@pytest.mark.parametrize("line", ["error m.toml --samples 100", "schema", "new", "--help"])
def test_a_reader_that_has_left_is_no_configuration_that_is_not_ok(line: str) -> None:
    """Exit code 1 said so."""
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "w") as pipe:
        done = command(*line.split(), capture_output=False, stdout=pipe, stderr=subprocess.PIPE)
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252"])
def test_letters_that_the_terminal_lacks_are_replaced(encoding: str) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    for line in (SOLVE, ["error", "m.toml", "--samples", "100"], ["check", "m.toml"]):
        done = command(*line, "--set", "title='漢字 Ω'", env=environment, encoding=encoding)
        assert done.returncode == 0
        assert "??" in done.stdout
    assert command("solve", "漢.toml", env=environment, encoding=encoding).returncode == 2


def test_escape_sequences_do_not_reach_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    joint = 'joints."J\\u009b31m"'
    text = jp.examples.text("four-bar").replace("joints.J1", joint).replace('"J1"', '"J\\u009b31m"')
    text = text.replace("title  =", 'title = "a\\u001b[31m\\u202eb\\n\\u0007" #')
    Path("m.toml").write_text(text, encoding="utf-8")
    for line in (
        "check",
        "solve",
        "error --samples 100",
        "compensate",
        "singularities",
        "error --samples 100 --offset q=1",
    ):
        run([*line.split(), "m.toml"])
        out, err = capsys.readouterr()
        assert out or err
        assert not set(out + err) & set("\x1b\x9b\u202e\x07")
    assert run(["error", "m.toml", "--samples", "100", "--plot", "d.svg"]) == 0
    assert not set(Path("d.svg").read_text(encoding="utf-8")) & set("\x1b\x07")
