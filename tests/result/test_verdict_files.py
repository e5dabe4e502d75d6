"""First sentences and exit codes against the numbers: some of the sixty files of `verify_verdicts`."""

import math
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers import verdict_files as files
from verify_verdicts import WIDE, answered

#: a base and what becomes of its limits
SOME = [
    ("arm", "holds"),
    ("slide", "narrow"),
    ("slide", "both"),
    ("five-bar", "unknown"),
    ("five-bar", "both"),
    ("rack-slider", "both"),
    ("redundant-bar", "narrow"),
]


@pytest.mark.parametrize(("name", "kind"), SOME)
def test_every_command_says_what_its_numbers_say(
    name: str, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A verdict that the numbers do not bear out was signed by its reader."""
    monkeypatch.setenv("COLUMNS", WIDE)
    every = files.of_base(name, files.BASES.index(name))
    file = next(file for file in every if file.kind == kind)
    path = files.write(file, tmp_path)
    for one in files.asked(file, path, report=False):
        said, code = answered(one.arguments)
        first = files.first_sentence(said)
        assert one.says is None or files.says(first) == one.says, (one.command, first)
        assert code == one.code, (one.command, first)


def test_the_numbers_of_the_arm_are_those_of_its_closed_form() -> None:
    """A radial play r and a turn by e at the length l: r + 2 l sin(e / 2) at most, and r under a load."""
    m = jp.loads(files.ARM)
    turn = math.radians(0.02)
    np.testing.assert_allclose(jp.worst(m).worst_position, 0.05 + 2.0 * 200.0 * math.sin(turn / 2.0), rtol=1e-9)
    loaded = jp.loaded(m)
    np.testing.assert_allclose(np.hypot(*loaded.error.values.T[:2]), 0.05, rtol=1e-9)


def test_the_yields_of_the_slide_are_those_of_its_law() -> None:
    """Widths normal with three sigma at 0.01 mm: under the load the slide is off by half of their difference."""
    m = jp.loads(files.SLIDE).with_({"limits.y": 0.052, "limits.probability": 0.9, "drives.feed.values": [0]})
    result = jp.random(m, 16_384)
    # Twice the play is 0.1 mm and the difference of two normal deviations.
    sigma = math.sqrt(2.0) * 0.01 / 3.0 / 2.0
    outside = 0.5 * math.erfc((0.052 - 0.05) / sigma / math.sqrt(2.0))
    low, high = float(result.outside_loaded_low[0]), float(result.outside_loaded_high[0])
    # Truncation at three sigma moves less than the interval is wide.
    assert low - 2e-3 < outside < high + 2e-3
    assert float(result.outside[0]) < 0.5 * outside
