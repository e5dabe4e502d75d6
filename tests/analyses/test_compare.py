"""Two mechanisms on one path: the second one is where the first one's drives have it, not where it passes once more."""

from __future__ import annotations

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from jointplay.analyses.compare import compute
from jointplay.analyses.nominal import follow, nominal
from jointplay.result.conclusions import conclude
from jointplay.result.table.notes import notes


@pytest.mark.parametrize("name", ["slider-crank", "press", "six-bar", "rssr", "geared-five-bar", "five-bar", "3-upu"])
def test_a_mechanism_beside_itself_has_the_same_errors(name: str) -> None:
    """Some pass a dead centre, behind which another pose has the output at the same place."""
    m = example(name)
    found = jp.compare(m, m, "worst", exact=False).worst_position_first_order.values
    assert np.isfinite(found).all()
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_with_other_lengths_it_stays_beside_the_drives_of_the_first() -> None:
    m = example("slider-crank")
    other = m.with_({"joints.wristpin.on.rod": [161, 0]})
    first = nominal(m)
    # The stroke is the same; only its ends may be out of reach.
    targets = first.output.copy()
    targets[:, 0] += 1e-3
    second = follow(other, targets, ("x",), first.drives)
    reached = second.status == 0
    assert reached.sum() > 0.9 * len(reached)
    assert np.abs(second.drives - first.drives)[reached].max() < 0.05


@pytest.mark.parametrize("question", ["worst", "random", "loaded", "compensate"])
@pytest.mark.parametrize("values", [[30.0, 60.0, 300.0], [300.0, 30.0, 60.0], [60.0, 320.0, 30.0, 300.0]])
def test_where_the_first_has_no_pose_the_second_is_unknown(question: str, values: list[float]) -> None:
    """Whoever commanded a value out of reach was told of errors there of a copy that follows nothing."""
    m = example("four-bar").with_({"drives.theta1.values": values})
    at = nominal(m)
    found = compute(m, m, question, **({"samples": 16} if question == "random" else {}))
    lost = at.status != 0
    assert 0 < lost.sum() < len(values)
    status = found.get("status")
    assert (status[1] == status[0]).all()
    assert (status[1, lost] == "not_assembled").all()
    for name, variable in found.data.items():
        # The target of a correction is what was asked for.
        is_found = variable.dims[:2] == ("mechanism", "configuration") and name != "target"
        if is_found and variable.values.dtype.kind == "f":
            first, second = variable.values
            assert np.isnan(second[lost]).all(), name
            assert second[~lost] == pytest.approx(first[~lost], rel=1e-6, abs=1e-9, nan_ok=True), name


def test_what_has_nothing_to_follow_counts_in_no_verdict_and_is_said() -> None:
    """Whoever compared a file with its copy was told of a limit missed once in one, and twice in the other."""
    m = example("four-bar").with_({"drives.theta1.values": [30.0, 60.0, 300.0], "limits.position": 3.3})
    found = compute(m, m, "worst", names=("a", "b"))
    said = " ".join(sentence.text for sentence in conclude(found).sentences)
    assert "Limit missed: a, at 1 of 3" in said
    assert "Limit missed: b, at 1 of 3" in said
    assert "Not ok in b: 1 of 3 configurations (a has no pose there)." in said
    assert "Configuration 2: b is unknown, because a has no pose there." in notes(found)


def test_of_two_that_are_not_shown_both_are_named() -> None:
    """Whoever read the answer took the second of two for one whose limits hold."""
    m = example("four-bar").with_({"drives.theta1.values": [30.0, 60.0, 300.0], "limits.position": 9.0})
    found = conclude(compute(m, m, "worst", names=("a", "b"))).sentences
    assert found[0].text == "Not shown: whether limits hold in a and b; configuration 2 is unknown."
