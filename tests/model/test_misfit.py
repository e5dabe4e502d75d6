"""Parts that are not drawn to fit: what stays open, what would close it, and that it counts as a deviation.

Numbers are drawn in, so that the answer is known by construction.
"""

import re

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar
from jointplay.model.mobility import examine

THREE_CRANKS = planar()
THREE_CRANKS.revolute("A", ground=(0, 0), a=(0, 0), clearance=jp.radial(0.02))
THREE_CRANKS.revolute("B", ground=(200, 0), b=(0, 0), clearance=jp.radial(0.02))
THREE_CRANKS.revolute("C", ground=(400, 0), c=(0, 0), clearance=jp.radial(0.02))
THREE_CRANKS.revolute("A1", a=(0, 100), coupler=(0, 0), clearance=jp.radial(0.02))
THREE_CRANKS.revolute("B1", b=(0, 100), coupler=(200, 0), clearance=jp.radial(0.02))
THREE_CRANKS.revolute("C1", c=(0, 100), coupler=(400, 0), clearance=jp.radial(0.02))
THREE_CRANKS.drive("crank", joint="A", values=(-30, 20, 60))
THREE_CRANKS.output(body="coupler", at=(200, 0))
THREE_CRANKS.load(force=(0, -100))


def example(name: str) -> jp.Mechanism:
    return jp.loads(jp.examples.text(name))


def told(m: jp.Mechanism) -> str:
    return str(jp.check(m).attrs["misfit"])


class TestABarThatIsDrawnTooLong:
    """Between two pins of a rigid frame, 200 mm apart."""

    bar = example("redundant-bar").with_({"dimensions.length.deviation": 0.0, "joints.Q.on.bar": [200.25, 0.0]})

    def test_it_is_told_and_by_how_much(self) -> None:
        found = jp.check(self.bar)
        assert found.attrs["misfit"] == (
            "as drawn, joints stay open where all others are closed: 'bar' by 0.25 mm; "
            "it closes with 'bar' 0.25 mm shorter from P to Q"
        )
        assert found.attrs["assembled"] == 0
        assert found.attrs["decided"] == 1
        assert found.gap.max().item() == pytest.approx(0.25, rel=1e-9)

    def test_it_is_squeezed_as_by_a_deviation(self) -> None:
        as_deviation = example("redundant-bar")  # 0.25 mm, too
        drawn, built = jp.loaded(self.bar), jp.loaded(as_deviation)
        assert drawn.status.values.tolist() == built.status.values.tolist() == ["strained"]
        np.testing.assert_allclose(drawn.member_force, built.member_force, rtol=1e-9)

    def test_what_fits_has_nothing_to_tell(self) -> None:
        found = jp.check(example("redundant-bar"))
        assert "misfit" not in found.attrs
        assert "gap" not in found
        assert found.attrs["assembled"] == 1


def test_the_length_of_a_truss_that_is_wrong_is_among_the_few_that_close_it() -> None:
    square = example("x-braced-square").with_({"dimensions.AC.deviation": 0.0})
    text = jp.examples.text("x-braced-square")
    # AC in axes of its own, 0.6 mm shorter than the diagonal.
    long = 100.0 * np.sqrt(2.0) - 0.6
    text = text.replace(
        'bodies = ["ground", "AC", "DA"]\nat     = [0, 0]', "on = { ground = [0, 0], AC = [0, 0], DA = [0, 0] }"
    ).replace(
        'bodies = ["BC", "CD", "AC"]\nat     = [100, 100]',
        f"on = {{ BC = [100, 100], CD = [100, 100], AC = [{long}, 0] }}\n",
    )
    m = jp.loads(text + "\n[start]\nAC = { angle = 45 }\n").with_({"dimensions.AC.deviation": 0.0})
    assert "misfit" not in jp.check(square).attrs
    assert examine(m).is_decided
    (change,) = re.findall(r"'AC' ([\d.]+) mm longer from A/AC to C/AC", told(m))
    assert float(change) == pytest.approx(0.6, rel=1e-2)  # to first order: BD could as well be longer
    built = square.with_({"dimensions.AC.deviation": -0.6})
    found, known = jp.loaded(m), jp.loaded(built)
    assert found.status.item() == known.status.item() == "strained"
    for member in ("AC", "BD", "BC"):
        # The directions of the bars are not quite the same.
        assert found.member_force.sel(member=member).item() == pytest.approx(
            known.member_force.sel(member=member).item(), rel=1e-2
        )


class TestADriveThatAMisfitLocks:
    """A third crank whose hole in the coupler is 0.03 mm off: with perfect joints nothing could move."""

    m = THREE_CRANKS.mechanism()
    drawn = m.with_({"joints.C1.on.coupler": [400.03, 0.0]})

    def test_the_drive_is_not_blamed(self) -> None:
        mobility = examine(self.drawn)
        assert mobility.is_decided
        assert (mobility.degrees_of_freedom, mobility.joint_redundancy, mobility.drive_redundancy) == (1, 1, 0)
        # In all positions only lengths of the coupler close it: that from A1 to C1, or half of it as seen from B1.
        assert re.search(r"'coupler' 0\.0\d+ mm shorter from A1 to C1", told(self.drawn))
        assert "'b'" not in told(self.drawn)

    def test_errors_are_those_of_the_deviation(self) -> None:
        length = {"body": "coupler", "between": ["A1", "C1"], "deviation": 0.03}
        built = jp.loaded(self.m.with_({"dimensions.l": length}))
        np.testing.assert_allclose(jp.loaded(self.drawn).error, built.error, atol=1e-7)

    def test_two_drives_for_one_motion_are_still_too_many(self) -> None:
        second = {"drives.b": {"joint": "B", "values": [-30, 20, 60]}}
        for m in (self.m, self.drawn):
            assert examine(m.with_(second)).drive_redundancy == 1
