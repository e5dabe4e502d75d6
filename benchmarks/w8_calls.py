"""W8: sixteen calls of `random` with one configuration beside one call with sixteen, and the labelled result.

Whoever sweeps over a size, or shows the progress, asks for one configuration after the other. The programs are recorded
once for all of them; what a call still needs is the plan of the elimination and the numbers of the equations.
"""

from collections.abc import Callable
from pathlib import Path

import jointplay as jp
from harness import Contender, Report, Spread, Target, interleave, ratio
from jointplay import _core
from jointplay.analyses.nominal import Nominal, nominal
from jointplay.analyses.random import compute
from jointplay.result import to_dataset
from scatter import LEVELS

CALLS = 16
SAMPLES = (10_000, 100_000)
HERE = Path(__file__).parent


def mechanisms() -> dict[str, jp.Mechanism]:
    """One in the plane and one in space, in sixteen configurations."""
    robot = {"path.x": [4 * k for k in range(CALLS)], "path.y": [0] * CALLS, "path.z": [400] * CALLS}
    return {
        "four-bar": jp.load(HERE / "four-bar.toml").with_(
            {"drives.theta1.values": [30.0 + 2 * k for k in range(CALLS)]}
        ),
        "3-UPU": jp.loads(jp.examples.text("3-upu")).with_(robot),
    }


def asked(m: jp.Mechanism, at: Nominal, samples: int, each: int) -> Callable[[], object]:
    """All configurations, so many a call."""

    def run() -> None:
        for k in range(0, len(at), each):
            part = slice(k, k + each)
            m.core.random(at.drives[part], at.poses[part], samples, 1, LEVELS, None, None)

    return run


def measure(rounds: int) -> Report:
    """Interleave one call and sixteen."""
    rows, targets = [], []
    for name, m in mechanisms().items():
        at = nominal(m)
        for samples in SAMPLES:
            together, apart = asked(m, at, samples, CALLS), asked(m, at, samples, 1)
            before = _core.recordings()[0]
            seconds = interleave([Contender("one", together, 1), Contender("sixteen", apart, 1)], rounds)
            against = ratio(seconds, "sixteen", "one")
            recorded = _core.recordings()[0] - before
            words = [Spread.of(seconds[k]).text(1e3) for k in ("one", "sixteen")]
            rows.append([name, f"{samples:,}", *words, against.text(), str(recorded)])
            what = f"W8: sixteen calls against one, {name}, {samples:,} samples"
            targets.append(Target(what, 1.1, True, against.median))
    m = mechanisms()["four-bar"]
    found = compute(m, 64)
    labelled = [Contender("labelled", lambda: [to_dataset(found) for _ in range(100)], 100)]
    label = Spread.of(interleave(labelled, rounds)["labelled"])
    targets.append(Target("W8: a dataset of `random`, four-bar, ms", 1.0, True, 1e3 * label.median))
    header = ["mechanism", "samples", "one call, ms", "sixteen calls, ms", "ratio", "programs recorded"]
    return Report("W8", "One configuration after the other", header, rows, targets)
