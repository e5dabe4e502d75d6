"""A run of W3's `loaded` for a profiler, and the profile as a table."""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

REPEATS = 40
#: what a line of the profile is counted as: shared object, symbol (parts of their names), in this order
KINDS = {
    "recorded programs and what is inlined around them": ("_core", "dispatch::"),
    "other parts of the core": ("_core", ""),
    "sine and cosine of the C library": ("libm", ""),
    "copying and setting memory": ("libc", "mem"),
    "the system: fresh pages for the results": ("kernel", ""),
    "everything else": ("", ""),
}


def shares() -> list[list[str]]:
    """Part of the processor time by kind; nothing where `perf` cannot be used."""
    if shutil.which("perf") is None:
        return []
    with tempfile.TemporaryDirectory() as folder:
        data = str(Path(folder) / "perf.data")
        record = ["perf", "record", "--event", "cpu-clock", "--output", data, sys.executable, __file__]
        if subprocess.run(record, capture_output=True, check=False).returncode:
            return []
        report = ["perf", "report", "--input", data, "--stdio", "--no-children", "-F", "overhead,dso,sym", "-t", ";"]
        lines = subprocess.run(report, capture_output=True, text=True, check=True).stdout.splitlines()
    found = dict.fromkeys(KINDS, 0.0)
    for line in lines:
        parts = [part.strip() for part in line.split(";", 2)]
        if len(parts) == 3 and parts[0].endswith("%"):
            kind = next(k for k, (dso, symbol) in KINDS.items() if dso in parts[1] and symbol in parts[2])
            found[kind] += float(parts[0].rstrip("%"))
    return [[kind, f"{share:.0f} %"] for kind, share in found.items()]


def main() -> None:
    """Do the work that is profiled."""
    import jointplay as jp
    import w3_map
    from jointplay import examples

    mechanism = jp.loads(examples.text("3-rrr"))
    drives = w3_map.grid(mechanism.drive_values[0])[: w3_map.BATCH]
    poses = mechanism.core.trace(drives)["poses"]
    for _ in range(REPEATS):
        mechanism.core.loaded(drives, poses)


if __name__ == "__main__":
    main()
