"""The table "felt": what a user waits for. Whole commands on every bundled example, each in a process of its own.

python benchmarks/felt.py report press 3-rrr        single commands and examples, printed with what takes most of each

Every start is a fresh interpreter; its files are in the page cache of the system, its byte code is compiled. Times are
of the processor, with all threads. Where they go is sampled on the same clock, which adds a few per cent: a sample
counts for the package whose code is running. What is called from Python shows as one long sample, and is the core's.
"""

import json
import signal
import statistics
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from types import FrameType

import jointplay as jp
from harness import Report, Spread, Target, processor_seconds
from w6_start import BASELINE, IMPORT

COMMANDS = ("check", "error", "allow", "report", "map")
#: nodes of a drive where a file has no grid to be mapped
NODES = 15
#: starts of the program that imports NumPy and SciPy, the first of which is not counted
STARTS = 6
#: seconds between samples, and the length of one in which no line of Python was run
TICK, LONG = 0.002, 0.008
#: parts of paths, and what is theirs; the first in which a frame is, from the innermost one on, counts
PLACES = (
    ("importlib", "imports"),
    ("matplotlib", "figures"),
    ("jointplay/plot", "figures"),
    ("pydantic", "file"),
    ("jointplay/analyses", "questions"),
    ("jointplay/file", "file"),
    ("jointplay/core", "file"),
    ("jointplay/model", "file"),
    ("jointplay/show", "page"),
    ("jointplay/result", "results"),
    ("jointplay/cli", "command line"),
    ("typer", "command line"),
    ("rich", "command line"),
)
#: exit codes of a command that has answered
ANSWERED = (0, 1)
#: most that a report may take, as times the import of NumPy and SciPy: where that takes 0.3 s, 3 and 6 s
IMPORTS = {"planar": 10.0, "spatial": 20.0}


def call(command: str, name: str, folder: str) -> list[str]:
    """What is typed for a command and an example, whose file is in a folder."""
    file = f"{name}.toml"
    if command == "report":
        return [command, file, "-o", f"{name}.html"]
    return [command, file, *(grid(Path(folder, file)) if command == "map" else [])]


def grid(path: Path) -> list[str]:
    """Options for a grid over the range of the first two drives, where the file has none."""
    m = jp.load(path)
    if "grid" in m.raw or not m.drives:
        return []
    known = jp.solve(m)
    found: list[str] = []
    for name, coordinate in zip(m.drives, known.attrs["drives"].split(", "), strict=True):
        values = known[coordinate].values
        low, high = float(values.min()), float(values.max())
        several = high > low and sum(":" in one for one in found) < 2
        found += ["-g", f"{name}={low!r}:{high!r}:{NODES}" if several else f"{name}={float(values[0])!r}"]
    return found


def sampled(arguments: list[str]) -> None:
    """Run a command; seconds of its parts go to stderr, largest first."""
    parts: Counter[str] = Counter()
    last = time.process_time()

    def sample(_: int, frame: FrameType | None) -> None:
        nonlocal last
        now = time.process_time()
        spent, last = now - last, now
        is_importing = False
        place = ""
        inner = frame
        while frame is not None:
            file = frame.f_code.co_filename
            is_importing |= "importlib" in file and frame.f_code.co_name == "_find_and_load"
            place = place or next((words for mark, words in PLACES if mark in file), "")
            frame = frame.f_back
        of_core = spent > LONG and inner is not None and "jointplay" in inner.f_code.co_filename
        parts["imports" if is_importing else "core" if of_core else place or "other"] += spent

    signal.signal(signal.SIGPROF, sample)
    signal.setitimer(signal.ITIMER_PROF, TICK, TICK)
    sys.argv = ["jointplay", *arguments]
    from jointplay.cli import run

    code = run(arguments)
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    # What was before the first sample starts the interpreter.
    parts["imports"] += max(time.process_time() - sum(parts.values()), 0.0)
    sys.stdout.flush()
    sys.stderr.write(f"\n{json.dumps(parts.most_common())}\n")
    sys.exit(code)


def measured(command: str, name: str, folder: str) -> tuple[float, int, Counter[str]]:
    """Processor seconds of a command, its exit code, and the seconds of its parts."""
    child = [sys.executable, __file__, "--child", *call(command, name, folder)]
    seconds, code, told = processor_seconds(child, folder)
    parts = dict(json.loads(told.strip().splitlines()[-1])) if code in ANSWERED else {}
    return seconds, code, Counter(parts)


def write(folder: str) -> None:
    """Write all examples, and let byte code be compiled."""
    for name in jp.examples.names():
        Path(folder, f"{name}.toml").write_text(jp.examples.text(name), encoding="utf-8")
    for command in COMMANDS:
        measured(command, "four-bar", folder)


def words(parts: Counter[str]) -> str:
    """The three largest parts."""
    return ", ".join(f"{name} {100 * spent / sum(parts.values()):.0f} %" for name, spent in parts.most_common(3))


def line(command: str, name: str, seconds: float, code: int, parts: Counter[str]) -> str:
    """What was measured of a command and an example."""
    return f"{command:8}{name:24}{seconds:8.2f} s  exit {code}  {words(parts) if parts else 'refused'}"


def measure(_: int) -> Report:
    """Measure all commands on all examples, each once."""
    rows, targets = [], []
    with tempfile.TemporaryDirectory() as folder:
        write(folder)
        imports = [processor_seconds([sys.executable, "-c", IMPORT], folder)[0] for _ in range(STARTS)]
        for command in COMMANDS:
            seconds: dict[str, float] = {}
            parts: Counter[str] = Counter()
            for name in jp.examples.names():
                taken, code, own = measured(command, name, folder)
                print(line(command, name, taken, code, own), file=sys.stderr, flush=True)
                if code in ANSWERED:
                    seconds[name] = taken
                    parts.update(own)
            slowest = max(seconds, key=lambda name: seconds[name])
            rows.append([f"`{command}`", Spread.of([*seconds.values()]).text(), slowest, words(parts)])
            if command == "report":
                targets = _targets(seconds, statistics.median(imports[1:]))
    header = ["command", "s", "slowest", "largest parts"]
    return Report("felt", "Whole commands on every bundled example", header, rows, targets)


def _targets(seconds: dict[str, float], imports: float) -> list[Target]:
    spaces: dict[str, list[float]] = {}
    for name, taken in seconds.items():
        spaces.setdefault(jp.loads(jp.examples.text(name)).raw.get("space", "planar"), []).append(taken)
    return [
        Target(f"felt: `report`, {space}, times {BASELINE}", IMPORTS[space], True, max(every) / imports)
        for space, every in spaces.items()
    ]


def main(command: str, names: list[str]) -> None:
    """Print single measurements."""
    with tempfile.TemporaryDirectory() as folder:
        write(folder)
        for name in names or jp.examples.names():
            seconds, code, parts = measured(command, name, folder)
            print(line(command, name, seconds, code, parts), flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "--child":
        sampled(sys.argv[2:])
    else:
        main(sys.argv[1], sys.argv[2:])
