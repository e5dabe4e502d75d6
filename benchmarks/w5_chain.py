"""W5: a chain of four-bar loops. What a loop costs must not grow with their number, neither time nor memory."""

import subprocess
import sys
import time
from typing import Any

import numpy as np

import jointplay as jp
from harness import Contender, Report, Spread, Target, interleave, number
from scatter import LEVELS

SIZES = (1, 10, 100, 1000)
SAMPLES = 1 << 14
CONFIGURATIONS = 64
JOINT = '[joints.{name}]\ntype = "revolute"\non = {{ {first}, {second} }}\nclearance = {{ radial = 0.01 }}'


def chain(loops: int) -> str:
    """Cranks of 50 mm on pivots 100 mm apart, each coupled with the next; the first driven, the couplers loaded."""
    cranks = [
        (
            JOINT.format(name=f"G{k}", first=f"ground = [{100 * k}, 0]", second=f"c{k} = [0, 0]"),
            f"c{k} = {{ x = {100 * k}, y = 0, angle = 60 }}",
        )
        for k in range(loops + 1)
    ]
    couplers = [
        (
            JOINT.format(name=f"A{k}", first=f"c{k} = [50, 0]", second=f"p{k} = [0, 0]")
            + "\n"
            + JOINT.format(name=f"B{k}", first=f"p{k} = [100, 0]", second=f"c{k + 1} = [50, 0]"),
            f"p{k} = {{ x = {100 * k + 25}, y = 43.3, angle = 0 }}",
        )
        for k in range(loops)
    ]
    joints, start = zip(*cranks, *couplers, strict=True)
    return "\n".join(
        [
            'format = 1\nspace = "planar"\nunits = { length = "mm", angle = "deg", force = "N" }',
            *joints,
            "[start]",
            *start,
            f'[drives.q]\njoint = "G0"\nfrom = 60\nto = 62\ncount = {CONFIGURATIONS}',
            f'[output]\nbody = "c{loops}"\nat = [50, 0]',
            *(f'[[loads]]\nbody = "p{k}"\nat = [40, 0]\nforce = [3, -10]' for k in range(loops)),
        ]
    )


class Chain:
    """A chain of a given number of loops in the core."""

    def __init__(self, loops: int) -> None:
        mechanism = jp.loads(chain(loops))
        self.loops, self.core = loops, mechanism.core
        self.drives = np.ascontiguousarray(mechanism.drive_values)
        self.poses = self.core.trace(self.drives)["poses"]

    def random(self) -> dict[str, Any]:
        """A Monte Carlo of one configuration."""
        return self.core.random(self.drives[:1], self.poses[:1], SAMPLES, 1, LEVELS, None, None, 1)

    def loaded(self) -> dict[str, Any]:
        """Where the load pushes it, for all configurations."""
        return self.core.loaded(self.drives, self.poses)

    def agreement(self) -> str:
        """Say what the batch engine left to the plain solver, and compare the first order with the exact closure."""
        drawn, pushed = self.random(), self.loaded()
        spread = np.sqrt(drawn["covariance"][0, 0, 0] / drawn["covariance_first_order"][0, 0, 0])
        left = int(drawn["fallbacks"].sum()), int(pushed["fallbacks"])
        return f"{left[0]} samples, {left[1]} configurations, {spread:.3f}"


def peak(loops: int) -> float:
    """Peak memory (MiB) of a fresh process that reads a chain and draws its samples."""
    # Not getrusage: what it calls the peak is inherited from the parent.
    code = (
        f"import sys; sys.path[:] = {sys.path!r}\n"
        f"import w5_chain; w5_chain.Chain({loops}).random()\n"
        "print(next(line for line in open('/proc/self/status') if line.startswith('VmHWM')).split()[1])"
    )
    out = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    return int(out) / 1024


def measure(rounds: int) -> Report:
    """Measure chains of all lengths."""
    chains, reading = [], []
    for loops in SIZES:
        begin = time.process_time()
        chains.append(Chain(loops))
        reading.append((time.process_time() - begin) / loops)
    drawn = interleave([Contender(str(c.loops), c.random, SAMPLES * c.loops) for c in chains], rounds)
    pushed = interleave([Contender(str(c.loops), c.loaded, CONFIGURATIONS * c.loops) for c in chains], min(rounds, 3))
    memory = {loops: peak(loops) for loops in SIZES}
    rows = [
        [
            number(c.loops),
            Spread.of(drawn[str(c.loops)]).text(1e9),
            Spread.of(pushed[str(c.loops)]).text(1e9),
            number(once * 1e3),
            number(memory[c.loops]),
            c.agreement(),
        ]
        for c, once in zip(chains, reading, strict=True)
    ]

    def growth(seconds: dict[str, list[float]]) -> float:
        return Spread.of([a / b for a, b in zip(seconds["1000"], seconds["10"], strict=True)]).median

    more = (memory[1000] - memory[1]) / (memory[100] - memory[1]) * (100 - 1) / (1000 - 1)
    return Report(
        "W5",
        "A chain of four-bar loops",
        [
            "loops",
            "`random`, ns per sample and loop",
            "`loaded`, ns per configuration and loop",
            "reading and first solution, ms per loop",
            "peak memory, MiB",
            "outcome",
        ],
        rows,
        [
            Target("W5: `random`, per loop, 1000 loops against 10", 2, True, growth(drawn)),
            Target("W5: `loaded`, per loop, 1000 loops against 10", 2, True, growth(pushed)),
            Target("W5: memory per further loop, up to 1000 loops against up to 100", 2, True, more),
        ],
    )
