"""The file of a mechanism in space: what it may say, and one line for every kind of mistake."""

# ruff: noqa: E501 (one mistake a line)
from typing import Any

import numpy as np
import pytest

from helpers.answers import refusal, require_refused
from jointplay import examples
from jointplay.model.mechanism import loads

TEXTS = {name: examples.text(name) for name in ("3-upu", "rssr", "serial-6r")}
PINS = "clearance = { radial = 0.01, axial = 0.02, length = 40 }"
GUIDE = "clearance = { gap = 0.01, length = 80, width = 30 }"
BASE_1 = "axes   = [[0, 1, 0], [0.936329177569, 0, 0.351123441588]]"

#: example, what stands there, what is written instead, key of the message, what else it says
MISTAKES: dict[str, tuple[str, str, str, str, str]] = {
    # -- keys of the plane
    "an angle as a start": ("rssr", "rotation = [20, 0, 0]", "angle = 20", "start.rocker", "'angle' is a key in the plane (space"),
    "an angle as a target": ("3-upu", "[path]\n", "[path]\nangle = [0, 0]\n", "path", "'angle' is a key in the plane"),
    "pin in slot": ("3-upu", '"prismatic"', '"pin_in_slot"', "joints.leg1", "is a joint in the plane; in space there are revolute, prismatic, cyl"),
    "misspelt type": ("3-upu", '"universal"', '"universl"', "joints.base1", "did you mean 'universal'?"),
    "two coordinates": ("rssr", "coupler = [176, 0, 0]", "coupler = [176, 0]", "joints.ball.on.coupler", "three values are needed, not [176, 0]"),
    "one coordinate": ("rssr", "coupler = [176, 0, 0]", "coupler = [176]", "joints.ball.on.coupler", "three values are needed, not [176]"),
    "four coordinates": ("rssr", "coupler = [176, 0, 0]", "coupler = [1, 2, 3, 4]", "joints.ball.on.coupler", "3 values are needed, not [1, 2, 3, 4]"),
    "an angle as an axis": ("rssr", "crank   = { at = [30, 0, 0], axis = [0, 0, 1] }", "crank = { at = [30, 0, 0], axis = 90 }", "joints.hook.on.crank.axis", "a direction [ux, uy, uz] is needed, not 90"),
    "a moment as a number": ("3-upu", "moment = [0, 0, 0] ", "moment = 5 ", "loads.0.moment", "a list in brackets is needed, not 5"),
    "a force in the plane": ("3-upu", "force  = [0, 0, -100]", "force = [0, -100]", "loads.0.force", "three values are needed, not [0, -100]"),
    "a load of nothing": ("rssr", "force = [2, 5, -10]", "", "loads.0", "a load needs a force [fx, fy, fz] or a moment [mx, my, mz]"),
    "output at two numbers": ("3-upu", "at   = [0, 0, 400]", "at = [0, 0]", "output.at", "a point [x, y, z] or the name of a joint"),
    "gravity in the plane": ("serial-6r", "gravity = [0, 0, -9.81]", "gravity = [0, -9.81]", "gravity", "three values are needed"),
    # -- axes and sides
    "no axis": ("3-upu", "axes   = [[0, 1, 0], [0.936329177569, 0, 0.351123441588]]", "", "joints.base1", "'axes' is missing"),
    "one axis": ("3-upu", BASE_1, "axes = [[0, 1, 0]]", "joints.base1.axes", "two values are needed"),
    "axis for axes": ("3-upu", BASE_1, "axis = [0, 1, 0]", "joints.base1", "a universal joint has two pins: axes ="),
    "skew pins": ("3-upu", BASE_1, "axes = [[0, 1, 0], [0, 1, 1]]", "joints.base1", "at right angles; as drawn, these axes are at 45 deg"),
    "a pin without axis": ("rssr", "coupler = { at = [0, 0, 0], axis = [0, 1, 0] }", "coupler = [0, 0, 0]", "joints.hook", "each body needs the axis of its pin: coupler = { at = [x, y, z], axis"),
    "revolute without axis": ("serial-6r", "axis   = [0, 0, 1]\n", "", "joints.waist", "its first body needs an axis: axis, beside `at`"),
    "no direction": ("serial-6r", "axis   = [0, 0, 1]\n", "axis = [0, 0, 0]\n", "joints.waist.axis", "[0, 0, 0] has no direction; write [0, 0, 1]"),
    "a side along the axis": ("rssr", "rocker = { at = [0, 0, 0], axis = [1, 0, 0], side = [0, 0, 1] }", "rocker = { at = [0, 0, 0], axis = [1, 0, 0], side = [2, 0, 0] }", "joints.rocker.on.rocker.side", "lies along the axis; a side is across it"),
    "an axis on a ball": ("rssr", "coupler = [176, 0, 0]", "coupler = { at = [0, 0, 0], axis = [0, 0, 1] }", "joints.ball", "a spherical joint has no axis; take it from 'coupler'"),
    "a universal joint of three bodies": ("3-upu", 'bodies = ["ground", "lower1"]', 'bodies = ["ground", "lower1", "lower2"]', "joints.base1", "connects two bodies, not ground, lower1, lower2"),
    "axis beside on": ("rssr", 'type = "spherical"', 'type = "spherical"\naxis = [0, 0, 1]', "joints.ball", "at, axis and side at this place go with `bodies`"),
    # -- clearances
    "clearance without a word": ("3-upu", PINS, "clearance = { length = 40 }", "joints.base1.clearance", "radial (hole radius - pin radius) or diametral"),
    "a pin of unknown length": ("3-upu", PINS, "clearance = { radial = 0.01 }", "joints.base1.clearance", "'length' is missing (length of the pin inside its hole"),
    "a guide of unknown width": ("3-upu", GUIDE, "clearance = { gap = 0.01, length = 80 }", "joints.leg1.clearance", "'width' is missing (size of its section along"),
    "axial play of a ball": ("rssr", "clearance = { radial = 0.02 }", "clearance = { radial = 0.02, axial = 1 }", "joints.ball.clearance", "'axial' is not a key here; "),
    "negative axial play": ("3-upu", PINS, PINS.replace("axial = 0.02", "axial = -1"), "joints.base1.clearance.axial", "must not be negative: -1"),
    # -- drives, paths, starts
    "driving a ball": ("rssr", 'joint = "crank"\nfrom', 'joint = "ball"\nfrom', "drives.theta.joint", "'ball' is a spherical joint and has no coordinate to drive; joints that have one: crank, hook.first, hook.second, rocker"),
    "driving a universal joint": ("rssr", 'joint = "crank"\nfrom', 'joint = "hook"\nfrom', "drives.theta.joint", "'hook' consists of several joints; name one of hook.first, hook.second"),
    "half a rotation": ("3-upu", "[path]\n", "[path]\nrx = [0, 0]\n", "path", "rx, ry and rz are one rotation and belong together; here: rx"),
    "uneven path": ("3-upu", "x = [0, 50]", "x = [0]", "path", "need as many values each; here: x 1, y 2, z 2"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named_with_its_place_and_what_is_valid(mistake: str) -> None:
    example, old, new, key, said = MISTAKES[mistake]
    require_refused(TEXTS[example], old, new, key, said)


def test_over_constraint_is_named_and_refused() -> None:
    found = refusal(examples.text("sarrus"))
    assert "over-constrained: 1 constraint is redundant, among a1.tilt_normal" in found


def test_sizes_and_keys_of_the_file_can_both_be_set() -> None:
    settings = {"platform_radius": "100", "layout": "snu", "loads.0.force": "[1, 2, 3]", "title": "Mine"}
    text = examples.text("3-upu", settings)
    assert "--set platform_radius=100 " in text
    assert "--set layout=snu" in text
    m = loads(text)
    assert (m.title, m.value("loads.0.force")) == ("Mine", [1, 2, 3])
    assert m.value("joints.top1.at") == [150, -30, 400]  # drawn beside the axis
    assert m.value("joints.base1.axes")[0] == [1, 0, 0]


def test_what_may_be_left_out() -> None:
    """A pin without radial play needs no length, and a square guide no height."""
    m = loads(TEXTS["3-upu"]).with_({"joints.base1.clearance": {"radial": 0.0, "axial": 0.1}})
    sets: list[dict[str, Any]] = [source["set"] for source in m.core_spec["sources"]]
    assert sets[0]["journal"]["radius"] == 0.0
    assert sets[0]["journal"]["half_length"] > 0.0
    assert sets[2] == {"guide": {"gap": 1e-5, "half_length": 0.04, "half_width": 0.015, "half_height": 0.015}}


def test_the_snu_layout_is_answered_beside_its_axis() -> None:
    """det N grows with the square of the distance from the axis, where the constraints are singular."""
    m = loads(examples.text("3-upu", {"layout": "snu"}))
    assert m.targets is not None
    solved = m.core.inverse(m.targets, np.array([1.0, 1, 1, 0, 0, 0]), m.start_drives)
    assert (solved["status"] == 0).all()
    far, near = m.core.measure(solved["drives"], solved["poses"])["singular_value"][:2]
    assert near < 0.6 * far
