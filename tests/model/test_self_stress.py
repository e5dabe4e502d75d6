"""Self-stresses: one for every redundant constraint, in equilibrium without a load, through the members one expects."""

import json
import math

import numpy as np
import pytest
from numpy.typing import NDArray

import jointplay as jp
from helpers.answers import OVER_CONSTRAINED, example
from jointplay import _core
from jointplay.analyses.check import compute
from jointplay.basics import poses
from jointplay.model import mobility
from jointplay.model.mobility import SelfStress, examine
from jointplay.model.mobility.self_stress import sparse_basis
from jointplay.result.table import tables

Array = NDArray[np.float64]


def where(m: jp.Mechanism) -> Array:
    """Poses of all bodies where the joints close near the guess."""
    return np.asarray(
        _core.Mechanism(json.dumps(m.spec() | {"drives": [], "sources": []})).assemble(np.zeros(0))["poses"]
    )


def unbalanced(m: jp.Mechanism, stress: SelfStress) -> float:
    """The largest force or moment (over the mechanism's length) that is left on any body, moments about the origin."""
    size = 3 if len(m.components) == 6 else 2
    at = where(m)
    left = np.zeros((len(m.bodies), 6))
    for joint, reaction in zip(m.core_spec["joints"], stress.reactions, strict=True):
        ends = [m.core_spec["points"][joint[end]] for end in ("first", "second")]
        point = ends[1]["at"] if ends[1]["body"] < 0 else poses.place(at[ends[1]["body"]], ends[1]["at"])
        force, moment = np.zeros(3), np.zeros(3)
        force[:size], moment[-len(reaction) + size :] = reaction[:size], reaction[size:]
        wrench = np.concatenate([force, (moment + np.cross(point, force)) / m.length])
        for end, sign in zip(ends, (-1, 1), strict=True):
            if end["body"] >= 0:
                left[end["body"]] += sign * wrench
    return float(np.abs(left).max())


def plate(pins: int) -> str:
    """The file of a plate on so many pins: all of their constraints but three are redundant."""
    around = [(f"P{k}", 2.0 * math.pi * k / pins) for k in range(pins)]
    joints = "".join(
        f'[joints.{name}]\ntype = "revolute"\nbodies = ["ground", "plate"]\n'
        f"at = [{100.0 * math.cos(a)}, {100.0 * math.sin(a)}]\nclearance = {{ radial = 0.05 }}\n"
        for name, a in around
    )
    units = 'format = 1\nunits = { length = "mm", angle = "deg", force = "N" }\n'
    rest = '[output]\nbody = "plate"\nat = [0, 0]\n[[loads]]\nforce = [10, -20]\n[assembly]\nsteps = [["plate"]]\n'
    return units + joints + rest


def test_only_who_reads_self_stresses_waits_for_them(monkeypatch: pytest.MonkeyPatch) -> None:
    m = jp.loads(plate(22))
    asked = []
    monkeypatch.setattr(mobility, "self_stresses", lambda *_: asked.append(True) or [])
    assert jp.assemble(m).redundancy.values.tolist() == [41]
    jp.loaded(m)
    assert not asked
    assert examine(m).joint_redundancy == 41
    examine(m).self_stresses  # noqa: B018
    assert asked


@pytest.mark.parametrize("name", OVER_CONSTRAINED)
class TestExample:
    def test_there_is_one_for_every_redundant_constraint(self, name: str) -> None:
        found = examine(example(name))
        assert found.assembled
        assert found.is_decided
        assert not found.is_determinate
        assert len(found.self_stresses) == found.joint_redundancy > 0
        together = np.array([stress.reactions.ravel() for stress in found.self_stresses])
        assert np.linalg.matrix_rank(together, tol=1e-6 * np.abs(together).max()) == found.joint_redundancy

    def test_every_body_is_in_equilibrium(self, name: str) -> None:
        m = example(name)
        for stress in examine(m).self_stresses:
            # Reactions are of size one: of forces, or of moments where there are none.
            size = max(np.abs(stress.reactions[:, : len(m.components) // 2 + 1]).max(), 1.0 / m.length)
            assert unbalanced(m, stress) < 1e-8 * size

    def test_nothing_else_carries_it(self, name: str) -> None:
        m = example(name)
        for stress in examine(m).self_stresses:
            inner = {member.joint for member in m.members}
            loaded = [k for k in range(len(m.joints)) if np.abs(stress.reactions[k]).max() > 0 and k not in inner]
            assert {m.joints[k] for k in loaded} == set(stress.joints)


def test_a_square_with_two_diagonals() -> None:
    """Forces as 1 in the sides and as the square root of two in the diagonals, against them."""
    m = example("x-braced-square")
    (stress,) = examine(m).self_stresses
    assert set(stress.bodies) == set(stress.elastic) == {"BC", "CD", "DA", "AC", "BD"}
    assert stress.words == "AC, DA, BC, BD and CD (all elastic)"
    forces = {name: np.linalg.norm(reaction[:2]) for name, reaction in zip(m.joints, stress.reactions, strict=True)}
    tension = {member.name: forces[m.joints[member.joint]] for member in m.members}
    assert tension["AC"] == pytest.approx(tension["BD"])
    for side in ("BC", "CD", "DA"):
        assert tension["AC"] / tension[side] == pytest.approx(math.sqrt(2))


def test_a_rigid_square_is_told_to_be_rigid() -> None:
    m = example("x-braced-square").with_({"bodies": None})
    (stress,) = examine(m).self_stresses
    assert stress.elastic == ()
    assert stress.words == "AC, DA, BC, BD and CD (all rigid)"


def test_an_elastic_bearing_takes_part_only_where_it_gives() -> None:
    """The bar lies along x: a guide that is soft across it is as good as rigid."""
    m = example("redundant-bar").with_({"bodies": None, "joints.P.stiffness": {"radial": 100}})
    (stress,) = examine(m).self_stresses
    assert stress.elastic == ("P",)
    assert stress.words == "bar (P gives)"
    text = 'format = 1\nunits = { length = "mm", angle = "deg", force = "N" }\n[joints.A]\ntype = "fixed"\n'
    text += 'on = { ground = [0, 0], bar = [0, 0] }\nstiffness = { normal = 100 }\n[joints.B]\ntype = "pin_in_slot"\n'
    text += 'on = { ground = { at = [50, 0], axis = [0, 1] }, bar = [50, 0] }\n[output]\nbody = "bar"\n'
    (stress,) = examine(jp.loads(text)).self_stresses
    assert stress.words == "bar (all rigid)"


def test_those_through_the_same_members_are_told_together() -> None:
    *_, start = tables(compute(example("bennett")))
    assert "Self-stresses 1, 2, 3 run through crank, coupler and rocker (all rigid)." in start.notes
    *_, start = tables(compute(example("antenna-support")))
    assert start.notes[:2] == (
        "Self-stress 1 runs through AF, BD, ED and DF (DF gives).",
        "Self-stress 2 runs through AF, BD, ED, FI and DI (DI gives).",
    )


# -- the antenna ------------------------------------------------------------------------------------------------------

#: the structure with every bar it unfolds from: joints, with the bars that meet there
PLACES = {
    "A": (0, 0), "B": (0, 125), "E": (14, 0), "F": (212, 0), "I": (422, 0), "D": (212, 93),
    "C": (106, 109), "G": (212, 46.5), "H": (317, 46.5),
}  # fmt: skip
BARS = ("AF", "FI", "BC", "CD", "ED", "FG", "GD", "IH", "HD")
PINS = (
    ("A", "", "AF"), ("B", "", "BC"), ("C", "BC", "CD"), ("E", "AF", "ED"), ("D", "CD", "ED"), ("D", "CD", "GD"),
    ("D", "CD", "HD"), ("F", "AF", "FI"), ("F", "AF", "FG"), ("G", "FG", "GD"), ("I", "FI", "IH"), ("H", "IH", "HD"),
)  # fmt: skip
LATCHES = {"A": ("", "AF"), "F": ("AF", "FI"), "C": ("BC", "CD"), "G": ("FG", "GD"), "H": ("IH", "HD")}


def counted(latched: str) -> tuple[int, int]:
    """Degrees of freedom and redundant constraints, from the places alone: two rows for a pin, one for a latch."""
    rows = []
    for place, *bars in PINS:
        x, y = PLACES[place]
        for row in ([1.0, 0.0, -y], [0.0, 1.0, x]):
            rows.append(np.zeros(3 * len(BARS)))
            for bar, sign in zip(bars, (-1, 1), strict=True):
                if bar:
                    rows[-1][3 * BARS.index(bar) : 3 * BARS.index(bar) + 3] = sign * np.array(row)
    for place in latched:
        rows.append(np.zeros(3 * len(BARS)))
        for bar, sign in zip(LATCHES[place], (-1, 1), strict=True):
            if bar:
                rows[-1][3 * BARS.index(bar) + 2] = 100.0 * sign
    rank = int(np.linalg.matrix_rank(np.array(rows)))
    return 3 * len(BARS) - rank, len(rows) - rank


def test_the_antenna_support_has_as_many_freedoms_and_latches_as_published() -> None:
    """Zhao et al.: 5 constraints on 3 degrees of freedom."""
    assert counted("") == (3, 0)
    assert counted("AFCGH") == (0, 5 - 3)
    assert counted("CGH") == (0, 0)


@pytest.mark.parametrize(("locked", "latches"), [("true", "AFCGH"), ("false", "CGH")])
@pytest.mark.parametrize("elastic", ["none", "DF", "redundant"])
def test_both_forms_of_the_antenna_support(locked: str, latches: str, elastic: str) -> None:
    found = examine(jp.loads(jp.examples.text("antenna-support", {"locked": locked, "elastic": elastic})))
    assert found.assembled
    assert (found.degrees_of_freedom, found.joint_redundancy) == counted(latches)


def test_the_self_stresses_of_the_antenna_support() -> None:
    """One for each link that is one too many, as soon as its panel is latched."""
    inner, outer = examine(example("antenna-support")).self_stresses
    assert inner.words == "AF, BD, ED and DF (DF gives)"
    assert inner.joints == ("A", "B", "E", "F_DF", "D/ED", "D/DF")
    assert outer.words == "AF, BD, ED, FI and DI (DI gives)"
    assert outer.joints == ("A", "B", "E", "F", "D/ED", "D/DI", "I")


# -- the basis --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
def test_a_hidden_sparse_basis_is_found(seed: int) -> None:
    """Vectors of few groups each, mixed: what comes out has as few, and the same span."""
    rng = np.random.default_rng(seed)
    groups = np.repeat(np.arange(10), 2)
    parts = [(0, 1, 2), (2, 3, 4, 5), (5, 6, 7), (0, 8, 9)]
    hidden = np.zeros((20, 4))
    for k, part in enumerate(parts):
        rows = np.isin(groups, part)
        hidden[rows, k] = rng.normal(size=int(rows.sum()))
    mixed = np.linalg.qr(hidden @ rng.normal(size=(4, 4)))[0]
    found = sparse_basis(mixed, groups)
    assert sorted(tuple(np.unique(groups[column != 0])) for column in found.T) == sorted(parts)
    assert np.linalg.matrix_rank(np.column_stack([found, hidden]), tol=1e-9) == 4
