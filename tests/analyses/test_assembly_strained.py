"""Assemblies that have to be strained: the dead band of a redundant bar, elastic structures, the antenna support."""

import itertools
import math

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from helpers.builders import planar
from jointplay.analyses.assemble.report import place
from jointplay.analyses.assemble.state import Held
from jointplay.analyses.assemble.steps import steps

LENGTH_BD, LENGTH_ED = math.hypot(212, 32), math.hypot(198, 93)
STIFFNESS = {"BD": 4e4, "ED": 3e4, "DF": 2e4}


def pin(name: str, bodies: str, at: str, play: float) -> str:
    clearance = f"clearance = {{ radial = {play} }}\n" if play else ""
    return f'[joints.{name}]\ntype = "revolute"\nbodies = [{bodies}]\nat = [{at}]\n{clearance}'


def bracket(play: float, misfit: float, more: str = "") -> jp.Mechanism:
    """Two bars that meet in D, and DF, which is one too many; all of them elastic, on rigid ground."""
    parts = [
        'format = 1\nunits = { length = "mm", angle = "deg", force = "N" }\n',
        pin("B", '"ground", "BD"', "0, 125", play),
        pin("E", '"ground", "ED"', "14, 0", play),
        pin("F", '"ground", "DF"', "212, 0", play),
        pin("D", '"BD", "ED", "DF"', "212, 93", play),
        '[output]\nbody = "BD"\nat = "D"\n',
        *(f"[bodies.{name}]\nstiffness = {k}\n" for name, k in STIFFNESS.items()),
        f'[dimensions.DF]\nbody = "DF"\nbetween = ["F", "D"]\ndeviation = {misfit}\ntolerance = 0.05\n',
        '[assembly]\nsteps = [["BD", "ED"], ["DF"]]\n',
        more,
    ]
    return jp.loads("".join(parts))


def bar_forces() -> dict[str, float]:
    """Force in every bar for tension 1 in DF, from equilibrium of D."""
    pull = np.array([0.0, -1.0])  # of DF on D
    towards = np.array([[-212 / LENGTH_BD, -198 / LENGTH_ED], [32 / LENGTH_BD, -93 / LENGTH_ED]])
    bd, ed = np.linalg.solve(towards, -pull)
    return {"BD": float(bd), "ED": float(ed), "DF": 1.0}


def dead_band(play: float) -> float:
    """Play that the joints take up along DF: BD in B, ED in E and on BD's pin, DF at both of its ends."""
    s = bar_forces()
    return play * (abs(s["BD"]) + 2 * abs(s["ED"]) + 2)


def stiffness() -> float:
    return 1.0 / sum(s**2 / STIFFNESS[name] for name, s in bar_forces().items())


# --- the redundant bar -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("misfit", [-0.004, -0.0012, 0.0008, 0.002, 0.008])
def test_a_redundant_bar_carries_what_the_play_does_not_take_up(misfit: float) -> None:
    """N = - k sign(g) max(0, |g| - dead band); small misfits, so that the exact pose is the linear one."""
    play = 2e-4
    result = jp.assemble(bracket(play, misfit))
    assert result.kind.values.tolist() == ["connected", "redundant"]
    assert result.redundancy.values.tolist() == [0, 1]
    last, band = result.sel(step=2), dead_band(play)
    assert last.clearance_factor.item() == pytest.approx(abs(misfit) / band, rel=1e-4)
    force = -stiffness() * math.copysign(max(0.0, abs(misfit) - band), misfit)
    # A bar that is too long is squeezed.
    assert last.member_force.sel(member="DF").item() == pytest.approx(force, rel=2e-4, abs=1e-9)
    for name, share in bar_forces().items():
        assert last.member_force.sel(member=name).item() == pytest.approx(share * force, rel=2e-4, abs=1e-9)
        elongation = share * force / STIFFNESS[name]
        assert last.member_elongation.sel(member=name).item() == pytest.approx(elongation, rel=2e-4, abs=1e-12)
    inside = abs(misfit) <= band
    assert last.status == ("undetermined" if inside else "strained")
    touching = set(last.contact.values.tolist()) - {""}
    assert touching == ({"undetermined"} if inside else {"touching"})
    assert bool((last.undetermined_shaft.sel(component=["x", "y"]) > 1e-6).any()) == inside


def test_where_the_play_takes_up_the_misfit_the_pose_is_between_what_it_can_be() -> None:
    """The pin in D, over the same misfit with offsets drawn at random and bars of any length in between."""
    play, misfit = 0.3, 0.35
    result = jp.assemble(bracket(play, misfit)).sel(step=2)
    middle = result.error.sel(component=["x", "y"]).values
    half = result.undetermined.sel(component=["x", "y"]).values
    rng = np.random.default_rng(5)
    # D of BD from B within the play, of ED and DF likewise with one more play at D: three rings around B, E, F.
    centres = np.array([[0.0, 125.0], [14.0, 0.0], [212.0, 0.0]])
    radii = np.array([LENGTH_BD, LENGTH_ED, 93.0 + misfit])
    places = np.array([212.0, 93.0]) + middle + rng.uniform(-3, 3, (400_000, 2)) * half
    off = np.abs(np.linalg.norm(places[:, None] - centres, axis=2) - radii)
    found = places[(off <= play * np.array([1, 2, 2])).all(axis=1)] - np.array([212.0, 93.0])
    assert len(found) > 1000
    assert np.all((found.min(axis=0) < middle) & (middle < found.max(axis=0)))
    # The half-width reaches from the pose to the farther end.
    np.testing.assert_allclose(np.abs(found - middle).max(axis=0), half, atol=0.02)


def test_rigid_bars_that_do_not_fit_are_a_status_with_the_factor_that_would_do() -> None:
    play, misfit = 0.02, 0.5
    m = bracket(play, misfit).with_({f"bodies.{name}": None for name in STIFFNESS})
    result = jp.assemble(m)
    assert result.status.values.tolist() == ["undetermined", "not_assemblable"]
    factor = result.clearance_factor.sel(step=2).item()
    assert factor == pytest.approx(misfit / dead_band(play), rel=0.01)
    # With clearances larger by that factor it just goes together.
    for scale, status in ((1.001, "undetermined"), (0.999, "not_assemblable")):
        wider = m.with_({"joints.*.clearance.radial": play * factor * scale})
        assert jp.assemble(wider).status.sel(step=2) == status


def test_probability_of_fit_and_worst_case_of_a_redundant_bar() -> None:
    """The misfit is normal with three sigma to its tolerance."""
    play = 0.006
    m = bracket(play, 0.0)
    band, tolerance = dead_band(play), 0.05
    assert 0.5 * tolerance < band < tolerance
    found = jp.assemble(m, "random", samples=3000, seed=1).sel(step=2)
    sigmas = 3 * band / tolerance
    inside, all_of_it = math.erf(sigmas / math.sqrt(2)), math.erf(3 / math.sqrt(2))
    probability = inside / all_of_it
    spread = 4 * math.sqrt(probability * (1 - probability) / 3000)
    assert found.probability_of_fit.item() == pytest.approx(probability, abs=spread)
    assert int(found.failures.sel(outcome=["ok", "strained"]).sum()) == 3000
    worst = jp.assemble(m, "worst").sel(step=2)
    assert worst.worst_clearance_factor.item() == pytest.approx(tolerance / band, rel=1e-3)
    force = stiffness() * (tolerance - band)
    assert worst.worst_force.sel(member="DF").item() == pytest.approx(force, rel=2e-2)
    assert found.quantile_force.sel(member="DF").max() <= worst.worst_force.sel(member="DF") * (1 + 1e-6)
    assert worst.status == "strained"


# --- elastic structures ----------------------------------------------------------------------------------------------


def test_without_play_the_final_state_of_an_elastic_structure_does_not_depend_on_the_order() -> None:
    m = bracket(0.0, 0.03, "[[loads]]\nforce = [4, -20]\n")
    ends = []
    for order in itertools.permutations([["BD"], ["ED"], ["DF"]]):
        result = jp.assemble(m.with_({"assembly.steps": list(order)}))
        ends.append((result.isel(step=-1), result.kind.values.tolist()))
        assert result.status[-1] == "strained"
    assert len({tuple(kinds) for _, kinds in ends}) > 1
    for last, _ in ends[1:]:
        np.testing.assert_allclose(last.member_force, ends[0][0].member_force, rtol=1e-9)
        np.testing.assert_allclose(last.error, ends[0][0].error, rtol=1e-9, atol=1e-12)
    # The same by direct stiffness, to first order: K u = f + forces of the misfit in DF.
    units = {"BD": [212 / LENGTH_BD, -32 / LENGTH_BD], "ED": [198 / LENGTH_ED, 93 / LENGTH_ED], "DF": [0.0, 1.0]}
    matrix = sum(k * np.outer(units[name], units[name]) for name, k in STIFFNESS.items())
    u = np.linalg.solve(matrix, np.array([4, -20]) + STIFFNESS["DF"] * 0.03 * np.array(units["DF"]))
    np.testing.assert_allclose(ends[0][0].error.sel(component=["x", "y"]), u, rtol=5e-3)
    force = STIFFNESS["DF"] * (u @ units["DF"] - 0.03)
    assert ends[0][0].member_force.sel(member="DF").item() == pytest.approx(force, rel=5e-3)


def test_loads_act_while_it_is_assembled() -> None:
    m = bracket(0.0, 0.0, "[[loads]]\nforce = [0, -100]\n")
    result = jp.assemble(m)
    s = bar_forces()
    # Without DF both bars carry all of it: they do what tension 100 in DF would ask of them.
    for name in ("BD", "ED"):
        assert result.member_force.sel(step=1, member=name).item() == pytest.approx(100 * s[name], rel=1e-2)
    carried = result.member_force.sel(step=2)
    assert abs(carried.sel(member="BD")) < abs(result.member_force.sel(step=1, member="BD"))
    lift = carried.sel(member="BD").item() / s["BD"] - carried.sel(member="DF").item()
    assert lift == pytest.approx(100, rel=1e-2)


# --- the antenna support ---------------------------------------------------------------------------------------------


def test_the_antenna_support_goes_together_as_published() -> None:
    result = jp.assemble(example("antenna-support"))
    assert result.kind.values.tolist() == ["fixed", "connected", "redundant", "fixed", "redundant"]
    assert result.links.values.tolist() == ["AF", "BD, ED", "DF", "FI", "DI"]
    assert result.redundancy.values.tolist() == [0, 0, 1, 1, 2]
    assert not result.mobility.any()
    # Adding members never makes it easier: what fitted has to fit together with the rest.
    assert np.all(np.diff(result.clearance_factor) >= -1e-9)


def test_the_determinate_antenna_support_is_connected_on_its_inner_panel_two_links_at_a_time() -> None:
    """In the published order (figure 14) nothing hangs and nothing has to be held."""
    m = jp.loads(jp.examples.text("antenna-support", {"locked": "false"}))
    result = jp.assemble(m)
    assert result.attrs["base"] == "AF"
    assert result.links.values.tolist() == ["DF, ED", "BD, ground", "DI, FI"]
    assert result.kind.values.tolist() == ["connected"] * 3
    assert not result.held.values.any()
    assert not result.redundancy.any()
    assert not result.mobility.any()


def test_the_last_step_of_the_antenna_support_is_the_finished_structure() -> None:
    m = example("antenna-support")
    last, finished = jp.assemble(m).isel(step=-1), jp.loaded(m).isel(configuration=0)
    np.testing.assert_allclose(last.error, finished.error, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(last.member_force.sel(member=["DF", "DI"]), finished.member_force, rtol=1e-6, atol=1e-6)
    assert last.clearance_factor.item() == pytest.approx(finished.clearance_factor.item(), rel=1e-6)


def test_the_worst_of_a_strained_step_is_that_of_the_worst_unit() -> None:
    m = bracket(0.006, 0.0).with_({"dimensions.DF.tolerance": 0.2})
    last = jp.assemble(m, "worst").isel(step=-1)
    assert last.status == "strained"
    largest = 0.0
    for misfit in np.linspace(-0.2, 0.2, 9):
        unit = jp.assemble(m.with_({"dimensions.DF.deviation": float(misfit), "dimensions.DF.tolerance": None}))
        moved = np.linalg.norm(unit.isel(step=-1).error_shaft.sel(component=["x", "y"]), axis=-1)
        here = ~np.isnan(moved)
        assert (moved[here] <= last.worst_shaft.values[here] * (1 + 1e-6)).all()
        largest = max(largest, float(np.nanmax(moved)))
    assert largest == pytest.approx(float(last.worst_shaft.max()), rel=1e-4)


def test_where_all_units_fit_the_worst_is_that_of_the_finished_structure() -> None:
    m = example("antenna-support").with_(
        {"loads": None, "dimensions.DF.tolerance": 0.3, "dimensions.BD.tolerance": 0.2}
    )
    last = jp.assemble(m, "worst").isel(step=-1)
    assert last.worst_clearance_factor < 1
    assert last.worst_position.item() == pytest.approx(jp.worst(m).worst_position[0].item(), rel=1e-6)
    # A unit with its own deviations is not beyond it, wherever its play takes it.
    unit = jp.assemble(m).isel(step=-1)
    assert np.hypot(*unit.error.sel(component=["x", "y"])) <= last.worst_position


@pytest.mark.parametrize("question", ["unit", "worst", "random"])
def test_perfect_parts_without_play_go_together_without_anything(question: str) -> None:
    m = example("antenna-support")
    nothing = {f"joints.{name}.{key}": None for name in m.data.joints for key in ("clearance", "angle")}
    few = {"samples": 5} if question == "random" else {}
    result = jp.assemble(m.with_({"dimensions": None, "loads": None} | nothing), question, **few)
    assert set(result.status.values.tolist()) == {"ok"}
    for name in ("error_shaft", "worst_shaft", "quantile_shaft", "member_force", "worst_force", "quantile_force"):
        if name in result:
            np.testing.assert_allclose(result[name].fillna(0.0), 0.0, atol=1e-6)


def test_what_a_load_bends_is_there_in_all_questions() -> None:
    # A cantilever of two beams, 300 mm and 200 mm, under 5 N across its end: F l^3 / (3 E I), whatever is off.
    section = {"E": 210000.0, "area": 60.0, "inertia": 500.0}
    b = planar()
    b.fixed("wall", bodies=["ground", "inner"], at=(0, 0), angle={"tolerance": 0.01})
    b.fixed("seam", bodies=["inner", "outer"], at=(300, 0))
    b.output(body="outer", at=(500, 0))
    b.load(force=(0, -5))
    b.assembly(steps=[["inner"], ["outer"]])
    m = b.mechanism().with_({"bodies": {"inner": section, "outer": section}})
    down = 5.0 * 500.0**3 / (3.0 * 210000.0 * 500.0)
    at_seam = 5.0 * 300.0**2 * (3.0 * 500.0 - 300.0) / (6.0 * 210000.0 * 500.0)
    unit, worst = jp.assemble(m), jp.assemble(m, "worst")
    scatter = jp.assemble(m, "random", samples=400)
    tilt = np.radians(0.01)
    assert unit.error.sel(step=2, component="y").item() == pytest.approx(-down, rel=1e-3)
    assert scatter.error_mean.sel(step=2, component="y").item() == pytest.approx(-down, rel=1e-2)
    assert worst.worst_position.sel(step=2).item() == pytest.approx(down + 500.0 * tilt, rel=1e-3)
    assert worst.worst_shaft.sel(step=2, joint="seam").item() == pytest.approx(at_seam + 300.0 * tilt, rel=1e-3)
    # Nothing bends before the end is there that the load acts on.
    assert worst.worst_shaft.sel(step=1, joint="seam").item() == pytest.approx(300.0 * tilt, rel=1e-6)


@pytest.mark.parametrize("options", [{}, {"locked": "false", "elastic": "redundant", "radial": "0.5"}])
def test_errors_without_details_are_those_with_them(options: dict[str, str]) -> None:
    m = jp.loads(jp.examples.text("antenna-support", options))
    at = place(m, 0)
    (*_, step) = steps(m, at.poses)
    held = Held(step)
    for point in held.points():
        full, bare = held.loaded(point), held.loaded(point, details=False)
        assert "undetermined_contribution" not in bare
        for name in ("error", "undetermined", "status"):
            assert full[name].tobytes() == bare[name].tobytes()
