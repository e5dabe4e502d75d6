"""`python -m helpers.fuzz --seconds 600 --seed 1`: cases with a limit on time and memory; one case with `--case`."""

import argparse
import itertools
import os
import resource
import selectors
import signal
import subprocess
import sys
import time
from pathlib import Path

from . import cases

#: address space of a worker
MEMORY = 6_000_000_000
#: kinds that take long are tried only as often as this
RARE = {"store": 20, "stop": 20, "raw": 3, "structured": 3}
#: seconds after which a worker that waits for something is ended
PATIENCE = 900
#: cases after which a worker is replaced
LIFE = 300


class Worker:
    """A process that runs cases one after the other; a crash or a hang ends it and not us."""

    def __init__(self, limit: float) -> None:
        self.limit, self.done = limit, LIFE
        #: files that were read, so that a question saw them, and all
        self.read, self.files = 0, 0
        self.process: subprocess.Popen[str] | None = None

    def run(self, kind: str, number: int) -> str:
        """Nothing, or what is wrong."""
        if self.process is None or self.done >= LIFE:
            self.close()
            self.process = subprocess.Popen(
                [sys.executable, "-m", "helpers.fuzz.cases"],
                cwd=Path(__file__).parents[2],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                preexec_fn=_limits,
            )
            self.done = 0
        self.done += 1
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(f"{kind} {number} {self.limit}\n")
        self.process.stdin.flush()
        with selectors.DefaultSelector() as ready:
            ready.register(self.process.stdout, selectors.EVENT_READ)
            if not ready.select(PATIENCE):
                self.close()
                return f"no answer after {PATIENCE} s, and it does nothing"
        answer = self.process.stdout.readline()
        if not answer:
            code = self.process.wait()
            self.close()
            if code == -signal.SIGPROF:
                return f"no answer after {self.limit:g} s of work"
            return f"the process died: {signal.Signals(-code).name if code < 0 else code}"
        self.files += answer[0] != "-"
        self.read += answer[0] == "r"
        return answer[1:].strip().replace("\\n", "\n").replace("\\\\", "\\")

    def close(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
            self.process = None


def _limits() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.nice(5)


def search(seconds: float, seed: int, limit: float, kinds: list[str]) -> int:
    """Run cases for some time, say what is found, and count it."""
    worker, end, found = Worker(limit), time.monotonic() + seconds, 0
    counts = dict.fromkeys(kinds, 0)
    try:
        for number in itertools.count(seed * 1_000_000):
            for kind in kinds:
                if number % RARE.get(kind, 1):
                    continue
                if time.monotonic() > end:
                    share = f"{worker.read / max(worker.files, 1):.0%} of {worker.files} files were read"
                    print(f"{sum(counts.values())} cases ({counts}); {share}; {found} found", flush=True)  # noqa: T201
                    return found
                counts[kind] += 1
                if problem := worker.run(kind, number):
                    found += 1
                    print(f"--case {kind} {number}: {problem}\n", flush=True)  # noqa: T201
    finally:
        worker.close()
    raise AssertionError


def main() -> None:
    """Read the options, search or run one case."""
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limit", type=float, default=60.0, help="seconds of work that a case may take")
    parser.add_argument("--kinds", nargs="+", choices=cases.KINDS, default=list(cases.KINDS))
    parser.add_argument("--case", nargs=2, metavar=("KIND", "NUMBER"))
    options = parser.parse_args()
    if options.case:
        problem = cases.case(options.case[0], int(options.case[1]))
        sys.exit(problem or "nothing is wrong")
    sys.exit(1 if search(options.seconds, options.seed, options.limit, options.kinds) else 0)


if __name__ == "__main__":
    main()
