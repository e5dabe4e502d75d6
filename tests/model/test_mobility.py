"""Freedoms and redundancies by rank, told by name."""

import tomllib

import numpy as np
import pytest

from helpers.answers import EXAMPLES, refusal
from jointplay import examples
from jointplay.errors import InputError
from jointplay.model.mechanism import Mechanism, loads
from jointplay.model.mobility import Mobility, Probe, examine, require_determinate

HEAD = 'format = 1\nunits = { length = "mm", angle = "deg", force = "N" }\n'


def pins(*joints: str) -> str:
    """Pin joints A, B, ... from the text of their `on` tables."""
    return "".join(
        f'[joints.{name}]\ntype = "revolute"\non = {{ {on} }}\n' for name, on in zip("ABCDEFGHIJ", joints, strict=False)
    )


def drive(name: str, joint: str, value: float = 0.0) -> str:
    return f'[drives.{name}]\njoint = "{joint}"\nvalues = [{value}]\n'


def output(body: str) -> str:
    return f'[output]\nbody = "{body}"\n'


PARALLELOGRAM = pins(
    "ground = [0, 0], left = [0, 0]",
    "left = [50, 0], coupler = [0, 0]",
    "ground = [100, 0], right = [0, 0]",
    "right = [50, 0], coupler = [100, 0]",
)
#: a third crank, parallel to the others: it holds what is held already, and yet all can move
THIRD_CRANK = (
    PARALLELOGRAM + '[joints.E]\ntype = "revolute"\non = { ground = [40, 0], middle = [0, 0] }\n'
    '[joints.F]\ntype = "revolute"\non = { middle = [50, 0], coupler = [40, 0] }\n'
)
UPRIGHT = "[start]\nleft = { angle = 60 }\nright = { angle = 60 }\nmiddle = { angle = 60 }\n"


def four_bar(text: str = "") -> str:
    start = "[start]\nleft = { angle = 60 }\nright = { angle = 60 }\n"
    return HEAD + PARALLELOGRAM + start + output("coupler") + text


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_are_driven_just_once(name: str) -> None:
    m = loads(examples.text(name))
    mobility = examine(m)
    assert mobility.is_determinate
    assert mobility.assembled
    assert mobility.degrees_of_freedom == mobility.drives == len(m.drives)
    require_determinate(m)


def test_too_few_drives_tell_what_is_free_and_what_could_be_driven() -> None:
    found = refusal(four_bar())
    assert found == (
        "file.toml: drives: too few drives: 1 motion is free: 'left', 'coupler' and 'right' move together; "
        "drive one of A, B, C, D"
    )


def test_an_undriven_arm_is_named_alone() -> None:
    arm = '[joints.X]\ntype = "revolute"\non = { coupler = [20, 20], arm = [0, 0] }\n'
    assert refusal(four_bar(arm + drive("q", "A", 60))).endswith("1 motion is free: 'arm' turns; drive X")


def test_an_undriven_slider_slides() -> None:
    slider = '[joints.X]\ntype = "prismatic"\non = { coupler = { at = [0, 0], axis = [1, 0] }, slider = [0, 0] }\n'
    assert refusal(four_bar(slider + drive("q", "A", 60))).endswith("1 motion is free: 'slider' slides; drive X")


def test_an_open_chain_has_a_motion_for_every_pin() -> None:
    chain = pins("ground = [0, 0], a = [0, 0]", "a = [50, 0], b = [0, 0]", "b = [50, 0], c = [0, 0]")
    mobility = examine(loads(HEAD + chain + output("c") + drive("q", "B")))
    assert (mobility.degrees_of_freedom, len(mobility.motions)) == (3, 2)
    assert [motion.joints for motion in mobility.motions] == [("A",), ("C",)]
    assert [motion.bodies for motion in mobility.motions] == [("a", "b", "c"), ("c",)]
    assert "3 degrees of freedom, 1 drive; too few drives: 2 motions are free" in mobility.words


def test_a_pin_in_a_slot_can_be_free_without_a_coordinate() -> None:
    """Nothing drives the turning of a body that hangs on a driven slot pin alone."""
    slot = '[joints.S]\ntype = "pin_in_slot"\non = { ground = { at = [0, 0], axis = [1, 0] }, bar = [0, 0] }\n'
    found = refusal(HEAD + slot + output("bar") + drive("s", "S", 10))
    assert found.endswith("1 motion is free: 'bar' turns and no joint's coordinate drives it")


def test_too_many_drives_are_named() -> None:
    found = refusal(four_bar(drive("p", "A", 60) + drive("q", "C", 60)))
    assert "drives: too many drives: 'p' and 'q' command the same motion; take away 1 of them" in found


def pairs(count: int, stiffness: str = "") -> str:
    """Parallelograms side by side, each with drives on both of its cranks."""
    text = four_bar(drive("p", "A", 60) + stiffness + drive("q", "C", 60) + stiffness)
    for section in ("joints", "drives", "start"):
        text = text.replace(f"[{section}", f"[patterns.linkage.{section}")
    return f"{text}[patterns.linkage]\ncount = {count}\n".replace('"coupler"', '"coupler_1"')


def test_drives_of_several_linkages_are_redundant_each_with_its_own() -> None:
    """Six drives in three pairs were told as sharing one motion, of which three could be taken away."""
    pair = "'p_{0}' and 'q_{0}' command the same motion; take away 1 of them"
    told = "; ".join(pair.format(k) for k in (1, 2, 3))
    found = refusal(pairs(3))
    assert found == f"file.toml: drives: too many drives: {told}; drives share a motion where each has a stiffness"
    shared = "; ".join(f"'p_{k}' and 'q_{k}' share a motion by their stiffness" for k in (1, 2, 3))
    m = loads(pairs(3, "stiffness = 1e4\n"))
    assert examine(m).words == f"3 degrees of freedom, 6 drives; {shared}"
    with pytest.raises(
        InputError, match=r"'p_3' and 'q_3' share a motion by their stiffness, which this .* drive each by"
    ):
        require_determinate(m)


def test_only_the_pair_without_stiffness_is_too_many() -> None:
    m = loads(pairs(2, "stiffness = 1e4\n")).with_({"drives.s": {"joint": "B_2", "values": [-60]}})
    mobility = examine(m)
    assert mobility.drive_redundancy == 3
    assert mobility.problems == (
        "too many drives: 's', 'p_2' and 'q_2' command the same motion; take away 2 of them; drives share a motion"
        " where each has a stiffness",
    )
    assert "'p_1' and 'q_1' share a motion by their stiffness" in mobility.words


def test_a_drive_on_what_cannot_move() -> None:
    triangle = pins("ground = [0, 0], a = [0, 0]", "a = [50, 0], b = [0, 0]", "ground = [60, 0], b = [50, 0]")
    start = "[start]\na = { angle = 53 }\nb = { angle = -53 }\n"
    require_determinate(loads(HEAD + triangle + start + output("a")))
    found = refusal(HEAD + triangle + start + output("a") + drive("q", "A", 53))
    assert "'q' commands a joint that cannot move; take it away" in found


def test_a_redundant_crank_is_over_constrained_and_still_moves() -> None:
    mobility = examine(loads(HEAD + THIRD_CRANK + UPRIGHT + output("coupler") + drive("q", "A", 60)))
    assert mobility.degrees_of_freedom == 1
    assert (mobility.joint_redundancy, mobility.drive_redundancy, mobility.motions) == (1, 0, ())
    # The dependence is among the pins of the three cranks; at least one component of each pin takes part.
    assert {row[0] for row in mobility.redundant_constraints} == set("ABCDEF")
    found = refusal(HEAD + THIRD_CRANK + UPRIGHT + output("coupler") + drive("q", "A", 60))
    assert "over-constrained: 1 constraint is redundant, among A.x" in found


def test_two_guides_side_by_side_hold_twice() -> None:
    guides = "".join(
        f'[joints.{name}]\ntype = "prismatic"\n'
        f"on = {{ ground = {{ at = [0, {y}], axis = [1, 0] }}, table = [0, {y}] }}\n"
        for name, y in (("P", 0), ("Q", 40))
    )
    mobility = examine(loads(HEAD + guides + output("table") + drive("s", "P", 10)))
    assert (mobility.degrees_of_freedom, mobility.joint_redundancy) == (1, 2)
    assert set(mobility.redundant_constraints) == {"P.normal", "P.angle", "Q.normal", "Q.angle"}


def test_one_constraint_too_many_and_one_too_few() -> None:
    """Rows and unknowns balance, and yet one body is loose and another held twice."""
    arm = '[joints.X]\ntype = "revolute"\non = { coupler = [20, 20], arm = [0, 0] }\n'
    found = refusal(HEAD + THIRD_CRANK + arm + UPRIGHT + output("arm") + drive("q", "A", 60))
    assert "'arm' turns; drive X" in found
    assert "over-constrained" in found


# -- not to be fooled --------------------------------------------------------------------------------------------


def flat_parallelogram(text: str = "") -> str:
    return HEAD + PARALLELOGRAM + output("coupler") + drive("q", "A") + text


def test_a_singular_first_configuration_is_no_freedom() -> None:
    """All links of the parallelogram on one line: there two motions meet, elsewhere there is one."""
    mobility = examine(loads(flat_parallelogram()))
    assert mobility.assembled
    assert mobility.degrees_of_freedom == 1
    assert mobility.is_determinate
    require_determinate(loads(flat_parallelogram()))


def test_a_dead_centre_is_no_freedom() -> None:
    """A slider that drives a crank cannot turn it at the dead centre; the drive is sound all the same."""
    text = HEAD + pins(
        "ground = [0, 0], crank = [0, 0]", "crank = [40, 0], rod = [0, 0]", "rod = [100, 0], slider = [0, 0]"
    )
    text += '[joints.P]\ntype = "prismatic"\non = { ground = { at = [0, 0], axis = [1, 0] }, slider = [0, 0] }\n'
    m = loads(text + output("slider") + drive("s", "P", 140.0))
    assert np.linalg.matrix_rank(m.core.jacobian(np.array(m.spec()["guess"])), tol=1e-9) < 9
    assert examine(m).is_determinate
    require_determinate(m)


def test_drive_values_out_of_reach_are_not_a_mistake_of_the_file() -> None:
    """The links do not reach: that is the outcome not_assembled of an analysis, whatever the rank there."""
    m = loads(examples.text("p3r", {"drives.v.from": "900", "drives.v.to": "1350"}))
    require_determinate(m)


def test_links_that_never_meet_are_not_a_mistake_of_the_file() -> None:
    links = pins(
        "ground = [0, 0], a = [0, 0]",
        "a = [10, 0], b = [0, 0]",
        "b = [10, 0], c = [10, 0]",
        "ground = [500, 0], c = [0, 0]",
    )
    text = HEAD + links + output("b")
    mobility = examine(loads(text + drive("q", "A")))
    assert not mobility.assembled
    require_determinate(loads(text + drive("q", "A")))
    # Without a drive the rows do not even balance: that is a mistake wherever the links are.
    assert "too few drives" in refusal(text)


def test_the_start_may_be_far_off() -> None:
    m = loads(examples.text("six-bar", {"start.link.angle": "40", "start.output_rocker.angle": "20"}))
    assert examine(m).words == "1 degree of freedom, 1 drive"


def test_the_figures_do_not_depend_on_the_size_of_the_machine() -> None:
    """Lengths against angles: the same machine in micrometres and in metres has the same freedoms."""
    found: list[Mobility] = []
    for unit in ("um", "m"):
        found += [examine(loads(four_bar(drive("q", "A", 60)).replace('"mm"', f'"{unit}"')))]
    assert found[0] == found[1]
    assert found[0].is_determinate


def test_a_pose_in_which_a_belt_has_no_direction_counts_for_nothing() -> None:
    """Its pulleys meet where the loops close, and the singular values of what is no number do not exist."""
    raw = {**tomllib.loads(examples.text("five-bar"))}
    del raw["start"]
    on = {"left_rod": [0, 0], "right": [110, 0]}
    raw["joints"]["T"] = {"type": "belt", "on": on, "radii": [10, 20], "distance": 100}
    assert "'left' and 'right' command the same motion" in examine(Mechanism(raw)).words
    probe = Probe(Mechanism(raw))
    nowhere = np.full_like(probe.m.guess, np.nan)
    sample = probe.at(nowhere)
    assert (sample.residual, sample.counts, sample.assembled) == (np.inf, False, False)
    assert sample.freedoms(sample.rates) >= 0
