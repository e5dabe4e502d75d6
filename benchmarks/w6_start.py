"""W6: the whole command `jointplay error four-bar.toml` from a cold start, beside starting NumPy and SciPy.

Every start is a fresh interpreter; its files are in the page cache of the system, its byte code is compiled.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from harness import Report, Spread, Target, processor_seconds

IMPORT = "import numpy, scipy.optimize"
COMMAND, BASELINE = "`jointplay error four-bar.toml`", f'`python -c "{IMPORT}"`'

#: what the command needs of other projects; the names are of the modules that are slow to import
NEEDED = "import numpy, pydantic.main, rich.console, typer"
LIBRARIES = f'`python -c "{NEEDED}"`'


def measure(rounds: int) -> Report:
    """Interleave the two commands."""
    program = str(Path(sys.executable).with_name("jointplay"))
    calls = {
        COMMAND: [program, "error", "four-bar.toml"],
        BASELINE: [sys.executable, "-c", IMPORT],
        LIBRARIES: [sys.executable, "-c", NEEDED],
        "`python -c pass`": [sys.executable, "-c", "pass"],
    }
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program, "new", "four-bar"], cwd=folder, check=True, capture_output=True)
        for turn in range(2 * rounds + 1):
            for name, call in calls.items():
                taken, code, _ = processor_seconds(call, folder)
                assert code == 0, name
                if turn:  # the first one fills the caches
                    seconds[name].append(taken)
    against = {n: Spread.of([a / b for a, b in zip(s, seconds[BASELINE], strict=True)]) for n, s in seconds.items()}
    return Report(
        "W6",
        "Cold start to the printed answer",
        ["command", "ms of processor time", "times the import of NumPy and SciPy"],
        [[name, Spread.of(s).text(1e3), against[name].text()] for name, s in seconds.items()],
        [Target("W6: the whole command against importing numpy and scipy.optimize", 2, True, against[COMMAND].median)],
    )
