"""Interleaved measurements: A B C A B C ..., so that whatever else the machine does hits every contender alike.

What one core does is timed by the processor time of this process (user and system), which other processes do not
change; what two cores do, and whole programs, by the clock on the wall.
"""

from __future__ import annotations

import contextlib
import gc
import os
import resource
import statistics
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from jointplay import _core

CORES = sorted(os.sched_getaffinity(0))
#: what two threads that share nothing gain on two cores that nobody else uses, at least
FREE = 1.9


@dataclass(frozen=True)
class Contender:
    """One program to be measured."""

    name: str
    #: does `amount` units of work. What it gives is not used.
    run: Callable[[], object]
    #: samples or configurations of one call
    amount: int
    #: how far its numbers are from those of the reference, in words
    agreement: str = ""
    #: whether it is jointplay, which is measured with the registers of AVX2, too
    ours: bool = False

    def narrow(self) -> Contender:
        """The same with the registers of AVX2."""

        def run() -> None:
            widest = _core.simd()
            _core.simd("avx2")
            try:
                self.run()
            finally:
                _core.simd(widest)

        return Contender(f"{self.name}, AVX2", run, self.amount)


@dataclass(frozen=True)
class Spread:
    """A quantity over the rounds: median and extremes."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Of the values of all rounds."""
        return cls(statistics.median(values), min(values), max(values))

    def text(self, unit: float = 1.0) -> str:
        """Median (lowest to highest), in a unit."""
        return f"{number(self.median * unit)} ({number(self.low * unit)}–{number(self.high * unit)})"


@dataclass(frozen=True)
class Target:
    """A ratio that was asked for, and what this run measured; `void` says why the run cannot tell."""

    what: str
    asked: float
    at_most: bool
    measured: float
    void: str = ""

    @property
    def verdict(self) -> str:
        """Whether this run reaches it."""
        if self.measured <= self.asked if self.at_most else self.measured >= self.asked:
            return "reached"
        return self.void or "**not reached**"


@dataclass
class Report:
    """What one workload found: tables of words and the targets."""

    name: str
    title: str
    header: list[str]
    rows: list[list[str]]
    targets: list[Target]
    notes: list[str] = field(default_factory=list)


def number(value: float) -> str:
    """Three digits, thousands apart."""
    if value >= 1000:
        digits = 2 - len(str(int(value))) + 1
        return f"{round(value, digits):,.0f}"
    return f"{value:.3g}"


def interleave(
    contenders: Sequence[Contender], rounds: int, clock: Callable[[], float] = time.process_time
) -> dict[str, list[float]]:
    """Run every contender once to warm up, then all of them in turn; seconds per unit of work, round by round."""
    every = [one for c in contenders for one in ([c, c.narrow()] if c.ours else [c])]
    seconds: dict[str, list[float]] = {c.name: [] for c in every}
    for contender in every:
        contender.run()
    for _ in range(rounds):
        for contender in every:
            gc.collect()
            begin = clock()
            contender.run()
            seconds[contender.name].append((clock() - begin) / contender.amount)
    return seconds


def ratio(seconds: dict[str, list[float]], name: str, reference: str) -> Spread:
    """How many times longer one contender takes than another, round by round."""
    return Spread.of([a / b for a, b in zip(seconds[name], seconds[reference], strict=True)])


def rows(contenders: Sequence[Contender], seconds: dict[str, list[float]], reference: str) -> list[list[str]]:
    """A table's rows: name, time of a unit of work in ns, that at AVX2, ratio to the reference, agreement."""
    found = []
    for c in contenders:
        times = [Spread.of(seconds[name]).text(1e9) if name in seconds else "" for name in (c.name, c.narrow().name)]
        found.append([c.name, *times, ratio(seconds, c.name, reference).text(), c.agreement])
    return found


def narrower(workload: str, seconds: dict[str, list[float]], contender: Contender) -> Target:
    """How many times longer jointplay takes with the registers of AVX2 than with the widest of this machine."""
    measured = ratio(seconds, contender.narrow().name, contender.name).median
    return Target(f"{workload}: {contender.name} at AVX2 against {_core.simd()}", 1.6, True, measured)


def processor_seconds(call: list[str], folder: str) -> tuple[float, int, str]:
    """Processor time of a program in a process of its own, with all its threads, its exit code, and its stderr."""
    # Byte code is written in the first round, even where the shell forbids it: pip compiles what it installs.
    compiled = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    compiled.setdefault("PYTHONPYCACHEPREFIX", str(Path(folder) / "compiled"))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(call, cwd=folder, env=compiled, check=False, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.returncode, done.stderr


def tie(count: int) -> None:
    """Tie all threads of this process to the first `count` cores."""
    for task in Path("/proc/self/task").iterdir():
        with contextlib.suppress(ProcessLookupError):  # a thread that has just ended
            os.sched_setaffinity(int(task.name), CORES[:count])


def scaling(name: str, work: Callable[[int], object], control: Callable[[int], object], rounds: int) -> Target:
    """Compare one core with two, interleaved with a control that shares nothing between its two threads.

    Both callables take a number of threads; the control does as much work in every thread.
    """
    found: dict[tuple[str, int], list[float]] = {}
    kinds = (("work", work), ("control", control))
    for turn in range(rounds + 1):
        for cores in (1, 2):
            tie(cores)
            for kind, run in kinds:
                begin = time.perf_counter()
                run(cores)
                if turn:  # the first one warms up
                    found.setdefault((kind, cores), []).append(time.perf_counter() - begin)
    tie(1)
    gained = Spread.of([a / b for a, b in zip(found["work", 1], found["work", 2], strict=True)])
    allowed = Spread.of([2 * a / b for a, b in zip(found["control", 1], found["control", 2], strict=True)])
    what = f"{name} on two cores against one: {gained.text()} ×, independent work in the same rounds {allowed.text()} ×"
    busy = "" if allowed.median >= FREE else "not known: other work on the machine"
    return Target(what, 1.8, at_most=False, measured=gained.median, void=busy)
