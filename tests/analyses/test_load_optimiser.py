"""The load-determined pose against an optimiser (casadi, IPOPT), reactions against equilibrium and hand
statics."""

import math
from itertools import product

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar
from helpers.layouts import KINDS
from helpers.oracles import brute
from helpers.oracles.linkage import Linkage
from helpers.oracles.load_optimiser import load_pose
from helpers.oracles.most_work import MostWork
from helpers.oracles.reading import read
from helpers.oracles.statics import imbalance, passive_parts
from helpers.strategies import four_bar_text, given_offsets, mechanism, random_four_bar, turn

SEEDS = range(4)


def loads_of(link: Linkage) -> float:
    return max(math.hypot(fx, fy) for _, fx, fy, _ in link.loads)


def played(link: Linkage, result, k: int) -> dict[str, float]:
    """Offsets of the result at configuration k, by label, in the oracle's units."""
    offsets = result.offset.isel(configuration=k)
    values = dict(zip(offsets.parameter.values.tolist(), offsets.values.tolist(), strict=True))
    return {label: values[label] * link.scale(label) for label in link.labels}


def floats(link: Linkage, result, k: int) -> bool:
    """Whether a joint with play transmits nothing at configuration k."""
    reactions = result.reaction.isel(configuration=k)
    joints = [s.name for s in link.sources if s.gives_way and s.name in result.joint]
    sizes = [float(np.hypot(*reactions.sel(joint=j).values[:2])) for j in joints]
    return min(sizes, default=1.0) < 1e-7 * loads_of(link)


@pytest.mark.parametrize(("kind", "seed"), [*product(KINDS, SEEDS)])
def test_loaded_is_the_pose_of_largest_work(kind: str, seed: int) -> None:
    """Non-linear: the work of the load over all poses with pins in their holes and guides in their gaps."""
    text = mechanism(kind, seed, tolerances=False)
    link, result = read(text), jp.loaded(jp.loads(text))
    for k, q in enumerate(link.follow()):
        # A pin floats where its reaction passes through zero within the play; the output may be decided all the same.
        if floats(link, result, k):
            search = MostWork(link, q, link.configurations[k])
            widths = search.half_widths(search.maxima(2)[0]) * [1, 1, math.degrees(1)]
            found = np.isfinite(widths)
            assert found.any()
            np.testing.assert_allclose(result.undetermined[k][found], widths[found], rtol=0.02, atol=1e-4 * link.length)
            assert result.status[k].item() == ("undetermined" if result.undetermined[k].max() > 0 else "ok")
        else:
            assert result.status[k].item() == "ok"
            assert (result.undetermined[k] == 0).all()
        best = load_pose(link, q, link.configurations[k])
        error = result.error[k].values
        np.testing.assert_allclose(error[:2], best.error[:2], rtol=0, atol=1e-7 * link.length)
        assert abs(turn(error[2], math.degrees(best.error[2]))) < 1e-6
        # No play inside the sets does more work, found by chance or by design.
        u = played(link, result, k)
        done = link.work(list(link.solve(q, link.configurations[k], u)[0]), u)
        assert done >= best.work + link.work(list(q), link.centre) - 1e-7 * loads_of(link) * link.length


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", ["four_bar", "slider_crank", "triple_pin", "three_rrr"])
def test_no_random_play_does_more_work(kind: str, seed: int) -> None:
    text = mechanism(kind, seed, tolerances=False, configurations=1)
    link, result = read(text), jp.loaded(jp.loads(text))
    q, drives = link.nominal(link.configurations[0]), link.configurations[0]
    u = played(link, result, 0)
    done = link.work(list(link.solve(q, drives, u)[0]), u)
    rng = np.random.default_rng(seed)
    sample = np.concatenate([brute.draw(link, rng, 2000), brute.vertices(link, rng, 2000)])
    poses, good = link.solve(np.broadcast_to(q, (len(sample), q.size)), drives, sample)
    work = link.work([poses[:, i] for i in range(q.size)], link.as_dict(sample))
    assert good.all()
    assert work.max() <= done + 1e-9 * loads_of(link) * link.length


@pytest.mark.parametrize(("kind", "seed"), [*product(KINDS, SEEDS)])
def test_reactions_hold_every_body_in_equilibrium(kind: str, seed: int) -> None:
    """Free-body diagrams at the deviated pose; pins carry no moment; the play is against the reaction."""
    text = mechanism(kind, seed)
    link, result = read(text), jp.loaded(jp.loads(text))
    force = loads_of(link)
    for k, q0 in enumerate(link.follow()):
        u = played(link, result, k)
        drives = link.configurations[k]
        q, good = link.solve(q0, drives, u)
        assert good
        order = [j.name for j in link.joints]
        reactions = result.reaction.isel(configuration=k).sel(joint=order).values
        tolerance = 1e-8 * max(force, float(np.abs(reactions[:, :2]).max()))
        left = imbalance(link, q, u, reactions)
        assert np.abs(left[:, :2]).max() < tolerance
        assert np.abs(left[:, 2]).max() < tolerance * link.length
        assert np.abs(passive_parts(link, q, reactions)).max(initial=0.0) < tolerance * link.length
        for source in link.sources:
            if source.kind != "disc":
                continue
            offset = np.array([u[label] for label in source.labels])
            reaction = reactions[order.index(source.name), :2]
            if np.linalg.norm(reaction) < 1e-7 * force:
                continue  # it floats
            pressed = -source.size[0] * reaction / np.linalg.norm(reaction)
            np.testing.assert_allclose(offset, pressed, rtol=0, atol=1e-6 * source.size[0])


@pytest.mark.parametrize("seed", SEEDS)
def test_four_bar_by_hand(seed: int) -> None:
    """A force on the rocker pin, no clearance: coupler and rocker are two-force members along their lines."""
    fb, theta = random_four_bar(seed)
    start = tuple(math.degrees(a) for a in (theta, fb.coupler_angle(theta), fb.rocker_angle(theta)))
    load = "[[loads]]\nforce = [3.0, -7.0]\n"
    text = four_bar_text(fb.l1, fb.l2, fb.l3, fb.D.real, [math.degrees(theta)], start=start, extra=load)
    result = jp.loaded(jp.loads(text)).isel(configuration=0)
    coupler, rocker = np.exp(1j * fb.coupler_angle(theta)), np.exp(1j * fb.rocker_angle(theta))
    # The pin carries coupler force c e_c and rocker force b e_b: c e_c + b e_b + load = 0.
    columns = [[coupler.real, rocker.real], [coupler.imag, rocker.imag]]
    c, b = np.linalg.solve(columns, [-3.0, 7.0])
    torque = -(np.conj(fb.crank_pin(theta)) * (-c * coupler)).imag  # of the drive, on the crank
    expected = {
        "J3": (c * coupler.real, c * coupler.imag, 0.0),  # on the rocker
        "J2": (c * coupler.real, c * coupler.imag, 0.0),  # on the coupler, passed on
        "J4": (b * rocker.real, b * rocker.imag, 0.0),  # on the rocker, from the ground
        "J1": (c * coupler.real, c * coupler.imag, torque),  # on the crank
    }
    for joint, reaction in expected.items():
        np.testing.assert_allclose(result.reaction.sel(joint=joint), reaction, rtol=0, atol=1e-7)
    np.testing.assert_allclose(result.error, 0.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("force", "moment", "expected"),
    [
        (10.0, 0.0, (0.1, 0.0)),  # pressed flat against one side
        (-10.0, 199.0, (-0.1, 0.0)),  # |M| < |F| L/2: still flat
        (-10.0, 201.0, (0.0, 0.1 / 20)),  # |M| > |F| L/2: tilted on two corners
        (0.0, -5.0, (0.0, -0.1 / 20)),
    ],
)
def test_a_slider_shifts_or_tilts_in_its_guide(force: float, moment: float, expected: tuple[float, float]) -> None:
    """The diamond |d_n| + (L/2)|angle| <= c by hand: the load takes the slider to its best corner."""
    b = planar()
    line = {"at": [0, 0], "axis": [1, 0]}
    b.prismatic("P", ground=line, slider=line, clearance=jp.gap(0.1, length=40))
    b.drive("x", joint="P", values=[50.0])
    b.output(body="slider", at=(0, 0))
    b.load(force=(0.0, force), moment=moment)
    result = jp.loaded(b.mechanism()).isel(configuration=0)
    assert result.status.item() == "ok"
    np.testing.assert_allclose(result.error[:2], [0.0, expected[0]], rtol=0, atol=1e-12)
    assert result.error[2].item() == pytest.approx(math.degrees(expected[1]), abs=1e-10)
    np.testing.assert_allclose(result.reaction.sel(joint="P"), [0.0, -force, -moment], rtol=0, atol=1e-9)


@pytest.mark.parametrize("pulls", [True, False])
def test_a_load_along_the_rocker(pulls: bool) -> None:
    """The coupler carries nothing. A rocker that is pulled hangs in line with the load and takes the coupler along;
    one that is pushed may fall to either side, as far as the play of the coupler lets it."""
    fb, theta = random_four_bar(3)
    start = tuple(math.degrees(a) for a in (theta, fb.coupler_angle(theta), fb.rocker_angle(theta)))
    e = np.exp(1j * fb.rocker_angle(theta)) * (1 if pulls else -1)
    load = f"[[loads]]\nforce = [{float(10 * e.real)!r}, {float(10 * e.imag)!r}]\n"
    text = four_bar_text(fb.l1, fb.l2, fb.l3, fb.D.real, [math.degrees(theta)], (0.5,) * 4, start=start, extra=load)
    link, m = read(text), jp.loads(text)
    first, result = (jp.loaded(m, exact=exact).isel(configuration=0) for exact in (False, True))
    # To first order the rocker turns within +-1.5 mm of coupler play (three joints) either way.
    source, _ = link.sensitivity(link.nominal(link.configurations[0]), link.configurations[0])
    loose = sum(np.hypot(source[:, 2 * k], source[:, 2 * k + 1]) * 0.5 for k in range(3))
    loose[2] = math.degrees(loose[2])
    assert first.status.item() == "undetermined"
    np.testing.assert_allclose(first.undetermined, loose, rtol=1e-9, atol=1e-9)
    if pulls:
        assert result.status.item() == "ok"
        assert (result.undetermined == 0).all()
        # In line with the load, by the play of its own pin: the coupler's pins have no say.
        np.testing.assert_allclose(result.error[:2], [0.5 * e.real, 0.5 * e.imag], rtol=0, atol=1e-7)
        assert result.error[2].item() == pytest.approx(0.0, abs=1e-7)
        assert result.decided.sel(source=["J1", "J2", "J3"]).sum() == 0
    else:
        assert result.status.item() == "undetermined"
        np.testing.assert_allclose(result.undetermined, loose, rtol=2e-2, atol=1e-6)


@pytest.mark.parametrize("seed", range(16))
def test_a_pushed_rocker_is_open_only_if_it_can_rest_on_either_side(seed: int) -> None:
    """The work has a minimum between the ends of the coupler's play, or it grows all the way to one of them. With a
    minimum both ends are stable, whichever has more work; without one there is a single place."""
    rng = np.random.default_rng([7, seed])
    fb, theta = random_four_bar(seed)
    start = tuple(math.degrees(a) for a in (theta, fb.coupler_angle(theta), fb.rocker_angle(theta)))
    e = -np.exp(1j * fb.rocker_angle(theta))
    load = f"[[loads]]\nforce = [{float(10 * e.real)!r}, {float(10 * e.imag)!r}]\n"
    play = tuple(float(c) for c in 0.02 * 10 ** rng.uniform(0, [1.0, 1.0, 1.0, 2.0]))
    text = four_bar_text(fb.l1, fb.l2, fb.l3, fb.D.real, [math.degrees(theta)], play, start=start, extra=load)
    link, result = read(text), jp.loaded(jp.loads(text))
    q, drives = link.nominal(link.configurations[0]), link.configurations[0]
    search = MostWork(link, q, drives)
    told = np.array([played(link, result, 0)[label] for label in link.labels])
    turn_by = link.sensitivity(q, drives)[0][2]

    def turned(part: float) -> np.ndarray:
        """The coupler's three pins at a part of what turns the rocker as far as it goes."""
        u = told.copy()
        for pin in range(3):
            row = turn_by[2 * pin : 2 * pin + 2]
            u[2 * pin : 2 * pin + 2] = part * play[pin] * row / np.hypot(*row)
        return u

    work = {part: search.work(turned(part)) for part in (-1.0, -0.99, 0.99, 1.0)}
    stable = [work[-1.0] > work[-0.99], work[1.0] > work[0.99]]
    assert any(stable)
    if all(stable):
        assert result.status.item() == "undetermined"
        half = np.abs(search.error(turned(1.0)) - search.error(turned(-1.0))) / 2 * [1, 1, math.degrees(1)]
        np.testing.assert_allclose(result.undetermined[0], half, rtol=2e-2, atol=1e-5)
    else:
        assert result.status.item() == "ok"
        assert (result.undetermined == 0).all()
        assert search.work(told) >= max(work.values()) - 1e-9 * search.unit


@pytest.mark.parametrize("seed", SEEDS)
def test_the_guide_of_a_two_force_cylinder_is_undetermined(seed: int) -> None:
    """Nothing presses the rod against the side of its guide, nor does the output feel where it is; pins are pressed."""
    text = mechanism("cylinder", seed, tolerances=False, configurations=1)
    link, result = read(text), jp.loaded(jp.loads(text))
    guide = next((s for s in link.sources if s.kind == "diamond"), None)
    if guide is None:
        pytest.skip("this guide has no gap")
    assert result.status.item() == "ok"
    undecided = [
        str(s) for s, decided in zip(result.source.values, result.decided[0].values, strict=True) if not decided
    ]
    assert undecided == [guide.labels[0].split(".")[0]]
    u = played(link, result, 0)
    assert guide.inside(np.array([u[label] for label in guide.labels]), 1e-12)
    for source in link.sources:
        if source.kind == "disc":
            assert np.hypot(*(u[label] for label in source.labels)) == pytest.approx(source.size[0], rel=1e-9)


def test_offsets_of_loaded_reproduce_its_error() -> None:
    text = mechanism("stephenson", 3, tolerances=False)
    link, m = read(text), jp.loads(text)
    result = jp.loaded(m)
    for k in range(result.sizes["configuration"]):
        again = jp.given(m, given_offsets(link, played(link, result, k)))
        np.testing.assert_allclose(again.error[k, :2], result.error[k, :2], rtol=0, atol=1e-10 * link.length)


@pytest.mark.parametrize("kind", KINDS)
def test_shares_of_the_sources_add_up(kind: str) -> None:
    result = jp.loaded(jp.loads(mechanism(kind, 1)))
    total = result.contribution.sum("source").transpose(*result.error_first_order.dims)
    np.testing.assert_allclose(total, result.error_first_order, rtol=0, atol=1e-10)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", ["five_bar", "three_rrr"])
def test_corrected_drives_bring_the_loaded_output_back(kind: str, seed: int) -> None:
    """At the corrected drives the optimiser's loaded pose has the nominal output: all of it, or its position."""
    text = mechanism(kind, seed, tolerances=False)
    link, result = read(text), jp.compensate(jp.loads(text), "loaded")
    kept = min(len(link.drives), 3)
    for k, q in enumerate(link.follow()):
        drives = np.deg2rad(result.drive_corrected[k].values)
        best = load_pose(link, link.nominal(drives, q), drives)
        zero = dict.fromkeys(link.labels, 0.0)
        left = link.out(best.optimum.poses, best.optimum.offsets) - link.out(q, zero)
        assert np.abs(left[:kept]).max() < 1e-7 * link.length
