"""Mechanisms of Pyslvs: closed forms along a turn, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers.commands import refused

FOUR_BAR = """
mechanism: M[J[R, color[Green], P[0.0, 0.0], L[ground, link_0]],  # a comment
  J[R, P[10, 0], L[link_0, link_1]], J[R, color[(1, 2, 3)], P[40, 30], L[link_1, link_2]],
  J[R, P[40, 0], L[ground, link_2]], J[R, P[25, 20], L[link_1]], ]
"""
SLIDER = "M[J[R, P[0, 0], L[ground, a]], J[R, P[0, 15], L[a, b]], J[{kind}, A[0], P[20, 0], L[ground, {on}]]{more}]"


def test_a_four_bar_keeps_its_lengths_along_its_path() -> None:
    """The tracked point is as far from both pins of the coupler as it is drawn, and the pins are on their circles."""
    Path("a.pyslvs").write_text(FOUR_BAR, encoding="utf-8")
    turns = np.linspace(0, 300, 7)
    m = jp.read("a.pyslvs", drives={"Point0": turns.tolist()})
    found = np.asarray(jp.solve(m)["nominal"])[:, :2]
    crank = 10 * np.array([np.cos(np.radians(turns)), np.sin(np.radians(turns))]).T
    assert np.linalg.norm(found - crank, axis=1) == pytest.approx(np.hypot(15, 20), abs=1e-9)
    # The other pin of the coupler is at 30, 30 from the first one, of which the tracked point is at 15, 20.
    ratio = complex(30, 30) / complex(15, 20)
    other = crank @ [1, 1j] + ratio * ((found - crank) @ [1, 1j])
    assert np.abs(other - 40) == pytest.approx(30, abs=1e-9)


@pytest.mark.parametrize(("kind", "on", "more"), [("RP", "b", ""), ("P", "c", ", J[R, P[20, 0], L[b, c]]")])
def test_sliders_are_where_a_hand_says(kind: str, on: str, more: str) -> None:
    """Crank 15, rod 25: x = 15 cos a + sqrt(25^2 - 15^2 sin^2 a)."""
    Path("a.pyslvs").write_text(SLIDER.format(kind=kind, on=on, more=more), encoding="utf-8")
    point = "Point2" if kind == "RP" else "Point3"
    m = jp.read("a.pyslvs", drives={"Point0": [0, -30, -60, -90]}, output=point)
    a = np.radians(90 - np.array([0, 30, 60, 90]))
    found = np.asarray(jp.solve(m)["nominal"])[:, :2]
    assert found[:, 0] == pytest.approx(15 * np.cos(a) + np.sqrt(625 - 225 * np.sin(a) ** 2), abs=1e-9)
    assert found[:, 1] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("M[", "N[", "has no mechanism of Pyslvs"),
        ("J[R, P[10, 0]", "J[Q, P[10, 0]", "is no joint of Pyslvs"),
        ("P[10, 0]", "P[10, inf]", "2 numbers"),
        ("J[R, P[10, 0]", "J[RP, P[10, 0]", "needs the angle"),
        ("ground", "frame", "no link called ground"),
        ("L[link_1]], ]", "L[link_1]], J[R, P[1, 1], L[link_7]]]", "nothing joins"),
        ("L[link_1]], ]", "L[link_1]], " + "J[R, P[1, 1], L[link_1]]," * 1000 + "]", "a number of points"),
        ("L[link_1]], ]", "", "is no joint of Pyslvs"),
    ],
)
def test_what_is_no_mechanism_is_refused(old: str, new: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.pyslvs").write_text(FOUR_BAR.replace(old, new), encoding="utf-8")
    message = refused(capsys, "import", "a.pyslvs")
    assert message.startswith("error: a.pyslvs: ")
    assert said in message
