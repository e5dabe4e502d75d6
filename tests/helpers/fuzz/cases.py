"""One case: what is asked, and whether the answer is one that may be given."""

import contextlib
import io
import os
import re
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

from helpers import processes
from jointplay.cli import run
from jointplay.errors import JointplayError
from jointplay.model.mechanism import load

from . import asking, files, lines, valid

#: exit codes that mean something
CODES = (0, 1, 2, 130, 141, 143)
HOSTILE = {*map(chr, range(32)), *map(chr, range(127, 160)), "\u202e"} - {"\n"}
LEFT = (".jointplay-", ".part", ".new", ".lock", ".partial")
#: on stderr of what is done: what a key with a `*` reached
REACHED = re.compile(r"(?:[^\n]*: \d+ of \d+ [^\n]*\n)*")
#: whether the last file was read, so that a question saw it; None where a case has no file of its own
was_read: list[bool | None] = [None]


@contextlib.contextmanager
def room() -> Iterator[Path]:
    """A folder of its own with files, links, a pipe that nobody writes to and, for the superuser, a full device."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="fuzz-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        for example in ("four-bar", "p3r"):
            (folder / f"{example}.toml").write_text(files.TEXTS[example], encoding="utf-8")
        for made in ("folder.csv", "folder.zarr", "folder.svg", "elsewhere"):
            (folder / made).mkdir()
        (folder / "link.csv").symlink_to("elsewhere/r.csv")
        (folder / "lost.nc").symlink_to("nowhere/r.nc")
        (folder / "round.json").symlink_to("round.json")
        with contextlib.suppress(OSError, AttributeError):
            for full in ("full.csv", "full.nc", "full.svg"):
                os.mknod(folder / full, 0o020666, os.makedev(1, 7))
        os.chdir(folder)
        try:
            yield folder
        finally:
            os.chdir(before)


def asked(arguments: list[str], folder: Path) -> str:
    """Run a command. Nothing, or what is wrong with its answer."""
    return answered(arguments, folder)[1]


def answered(arguments: list[str], folder: Path) -> tuple[int, str]:
    """Run a command. Its exit code, and nothing, or what is wrong with its answer."""
    before = {path.relative_to(folder) for path in folder.rglob("*")}
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="surrogateescape") for _ in range(2))
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("always")
            code = run(arguments)
    except BaseException as error:  # noqa: BLE001
        # Also what is no Exception: a panic of the core.
        return -1, f"{type(error).__name__} leaves the command\n{traceback.format_exc()}"
    said = [stream.detach().getvalue().decode("utf-8", "replace") for stream in (out, err)]  # type: ignore[attr-defined]
    return code, judged(code, *said, folder, before)


def judged(code: int, out: str, err: str, folder: Path, before: set[Path]) -> str:
    """What is wrong with an answer."""
    if code not in CODES:
        return f"exit code {code}\n{err}"
    for word in ("Traceback", "panicked", "Warning:"):
        if word in out + err:
            return f"{word!r} is printed\n{err}"
    if HOSTILE & set(out + err):
        return f"{sorted(HOSTILE & set(out + err))} is printed"
    new = {path.relative_to(folder) for path in folder.rglob("*")} - before
    if left := [str(path) for path in new if any(word in str(path) for word in LEFT)]:
        return f"left behind: {left}"
    if code in (0, 1) and not REACHED.fullmatch(err):
        return f"exit code {code}, yet it says\n{err}"
    if code == 2:
        if not (err.startswith("error: ") and err.count("\n") == 1 and len(err) < 3000):
            return f"not one message:\n{err[:3000]}"
        if "not enough memory" in err:
            return err
    return ""


def _file(content: Callable[[Random], bytes]) -> Callable[[Random, Path], str]:
    def case(random: Random, folder: Path) -> str:
        (folder / "m.toml").write_bytes(content(random))
        with contextlib.suppress(JointplayError):
            raw = dict(load("m.toml").raw)
            was_read[0] = True
            draw = random.random()
            if draw < 0.1:
                return _plainly(lambda: asking.studio(random, folder))
            words = asking.readings(random, folder) if draw < 0.18 else asking.line(random, raw)
            problem = asked(words, folder)
            return problem and f"{words}: {problem}"
        was_read[0] = False
        return asked(["check", "m.toml"], folder)

    return case


def _plainly(ask: Callable[[], str]) -> str:
    """What is wrong with an answer that no command gives."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return ask()
    except BaseException as error:  # noqa: BLE001
        return f"{type(error).__name__} leaves the studio\n{traceback.format_exc()}"


def line(random: Random, folder: Path) -> str:
    """A random command."""
    example = random.choice(
        ["four-bar", "four-bar", "five-bar", "slider-crank", "redundant-bar", "serial-6r", "x-braced-square"]
    )
    (folder / "m.toml").write_text(files.TEXTS[example], encoding="utf-8")
    words = lines.line(random)
    if any("\0" in word for word in words):
        return ""
    problem = asked(words, folder)
    return problem and f"{example} as m.toml, {words}: {problem}"


#: commands that take a while, which a signal comes into
LONG = [
    ["error", "m.toml", "-q", "random", "--samples", "30000000"],
    ["error", "m.toml", "--samples", "3000000", "-o", "r.nc", "--plot", "d.svg"],
    ["sweep", "m.toml", "-s", "joints.J1.clearance.radial=0:1:30", "-q", "random", "--samples", "100000"],
    ["map", "m.toml", "-g", "theta1=20:60:200", "-q", "worst", "-o", "map.zarr", "--chunk", "10"],
    ["compare", "m.toml", "m.toml", "-q", "random", "--samples", "3000000"],
    ["allow", "m.toml", "-q", "random"],
    ["allow", "m.toml", "-q", "loaded"],
    ["life", "m.toml", "-q", "random", "-s", "joints.J3.wear.growth=1e-6"],
    ["allocate", "press.toml", "-q", "random"],
    ["report", "m.toml", "-o", "page.html"],
    ["animate", "m.toml", "-o", "a.gif"],
    ["assemble", "m.toml"],
    ["compensate", "m.toml"],
    ["singularities", "m.toml"],
    ["export", "m.toml", "-o", "model.xml"],
]


def stop(random: Random, folder: Path) -> str:
    """Ctrl-C, or a signal that asks for an end, at any moment: what is done is told, and nothing half is left."""
    (folder / "m.toml").write_text(files.TEXTS["four-bar"], encoding="utf-8")
    (folder / "press.toml").write_text(files.TEXTS["press"], encoding="utf-8")
    before = {path.relative_to(folder) for path in folder.rglob("*")}
    words, number = random.choice(LONG), random.choice([signal.SIGINT, signal.SIGINT, signal.SIGTERM])
    with processes.working(words, folder) as process:
        processes.worked(process, random.uniform(0.1, 4.0), ends=True)
        process.send_signal(number)
        out, err = process.communicate()
    if process.returncode < 0 or "_run_module_as_main" in err:
        # The interpreter had not come to the command yet.
        return ""
    problem = judged(process.returncode, out, "" if process.returncode >= 128 else err, folder, before)
    problem = problem or (err if "Traceback" in err or "Exception ignored" in err else "")
    return problem and f"{words}, {signal.Signals(number).name}: {problem}"


MAPPED = ["map", "m.toml", "-g", "x=-60:60:5", "-g", "y=150,180,190", "--chunk", "2", "--no-details", "-o", "map.zarr"]


def store(random: Random, folder: Path) -> str:
    """A map, complete or not, with a damaged file: it is refused, or made as it would have been."""
    from jointplay.analyses.map import compute, open_map

    (folder / "m.toml").write_text(files.TEXTS["five-bar"], encoding="utf-8")
    axes = {"x": [-60.0, -30.0, 0.0, 30.0, 60.0], "y": [150.0, 180.0, 190.0]}
    m, stop = load("m.toml"), random.randrange(12)

    def progress(step: int, total: int) -> None:
        if step == stop:
            raise KeyboardInterrupt

    with contextlib.suppress(KeyboardInterrupt):
        compute(m, grid=axes, path="map.zarr", chunk=2, details=False, progress=progress)
    group = folder / "map.zarr"
    for _ in range(random.choice([1, 1, 2]) if group.exists() else 0):
        every = sorted(path for path in group.rglob("*") if path.is_file())
        _damage(random, random.choice(every)) if every else None
    code, problem = answered(MAPPED, folder)
    if not problem and code == 2 and random.random() < 0.5:
        code, problem = answered([*MAPPED, "--overwrite"], folder)
        problem = problem or ("" if code != 2 else "not even --overwrite helps")
    if problem or code == 2:
        return problem
    whole = compute(m, grid=axes, chunk=2, details=False)
    with open_map("map.zarr") as made:
        for name, variable in whole.data.items():  # type: ignore[union-attr]
            if made[name].values.tobytes() != variable.values.astype(made[name].dtype).tobytes():
                return f"{name} is not what it would have been, and nothing is said of it"
    return ""


def _damage(random: Random, path: Path) -> None:
    content = bytearray(path.read_bytes())
    at = random.randrange(len(content) + 1)
    match random.choice(["delete", "empty", "cut", "flip", "put", "folder", "other"]):
        case "delete":
            path.unlink()
        case "empty":
            path.write_bytes(b"")
        case "cut":
            path.write_bytes(content[:at])
        case "flip" if at < len(content):
            content[at] ^= 1 << random.randrange(8)
            path.write_bytes(content)
        case "put":
            path.write_bytes(content[:at] + random.randbytes(random.randrange(20)) + content[at:])
        case "folder" if path.parent.name != "map.zarr":
            shutil.rmtree(path.parent)
        case "other":
            path.write_bytes(random.choice([b"[]", b"{}", b"null", b"[1, 5]", b"0", b'"x"', b"[" * 5000]))


KINDS: dict[str, Callable[[Random, Path], str]] = {
    "raw": _file(files.raw),
    "structured": _file(files.structured),
    "valid": _file(valid.valid),
    "line": line,
    "store": store,
    "stop": stop,
}


def case(kind: str, number: int) -> str:
    """Run a case. Nothing, or what is wrong."""
    was_read[0] = None
    with room() as folder:
        return KINDS[kind](Random(f"{kind} {number}"), folder)


if __name__ == "__main__":
    # The worker: a kind and a number come in, what is wrong goes out. What a case prints is its own.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    for request in sys.stdin:
        kind, number, limit = request.split()
        # Time of the processor, so that it does not count what else the machine has to do. The default is to die.
        signal.setitimer(signal.ITIMER_PROF, float(limit))
        problem = case(kind, int(number))
        signal.setitimer(signal.ITIMER_PROF, 0)
        answers.write({None: "-", True: "r", False: "n"}[was_read[0]])
        answers.write(problem.replace("\\", "\\\\").replace("\n", "\\n").encode("utf-8", "replace").decode() + "\n")
        answers.flush()
