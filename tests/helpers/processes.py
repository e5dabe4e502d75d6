"""The command, and answers, as processes of their own."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

COMMAND = [sys.executable, "-m", "jointplay"]
#: all numbers of an answer as one
DIGEST = """
import hashlib, sys, jointplay as jp
out = hashlib.sha256()
result = jp.random(jp.loads(sys.stdin.read()), samples=int(sys.argv[1]), seed=7)
for name in sorted(result.data_vars):
    values = result[name].values
    out.update(values.tobytes() if values.dtype.kind in "fiu" else str(values.tolist()).encode())
print(out.hexdigest())
"""


def _listen() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def working(arguments: list[str], folder: Path | None = None) -> Iterator[subprocess.Popen[str]]:
    """The command at work; it does not outlive its test.

    It listens to Ctrl-C, which a shell takes from the tests, and so from their children, when it runs them in the
    background.
    """
    pipe = subprocess.PIPE
    process = subprocess.Popen(
        [*COMMAND, *arguments], cwd=folder, stdout=pipe, stderr=pipe, text=True, preexec_fn=_listen
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()


def worked(process: subprocess.Popen[str], seconds: float, *, ends: bool = False) -> None:
    """Wait until a process has computed for so long, which on a busy machine is not so long after its start.

    It may have ended before, if that is said.
    """
    stat = Path(f"/proc/{process.pid}/stat")
    if not stat.exists():
        time.sleep(2 * seconds)
        return
    limit = time.monotonic() + 120
    while process.poll() is None and time.monotonic() < limit:
        fields = stat.read_text().rpartition(")")[2].split()
        if (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") > seconds:
            return
        time.sleep(0.02)
    assert ends, "it ended or did not get going"


def digests(text: str, samples: int) -> set[str]:
    """What random specimens of a file answer with one and more threads, and every width of registers."""
    found = set()
    for threads, width in (("1", "plain"), ("2", "avx2"), ("7", "avx512")):
        environment = {**os.environ, "RAYON_NUM_THREADS": threads, "JOINTPLAY_WIDTH": width}
        command = [sys.executable, "-c", DIGEST, str(samples)]
        run = subprocess.run(command, input=text, env=environment, capture_output=True, text=True, check=True)
        found.add(run.stdout.strip())
    assert all(found)
    return found
