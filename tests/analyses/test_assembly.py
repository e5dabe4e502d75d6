"""Assemblies of determinate mechanisms, step by step: against closed forms, finite differences and the finished
mechanism."""

import itertools

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import EXAMPLES, example
from helpers.builders import planar
from jointplay.errors import InputError

B, E_, D = np.array([0.0, 125.0]), np.array([14.0, 0.0]), np.array([212.0, 93.0])
PLAY = 0.5
DYAD = planar()
DYAD.revolute("B", bodies=["ground", "BD"], at=(0, 125), clearance=jp.radial(PLAY))
DYAD.revolute("E", bodies=["ground", "ED"], at=(14, 0), clearance=jp.radial(PLAY))
DYAD.revolute("D", bodies=["BD", "ED"], at=(212, 93), clearance=jp.radial(PLAY))
DYAD.output(body="BD", at="D")
DYAD.dimension("l1", body="BD", between=["B", "D"])
DYAD.dimension("l2", body="ED", between=["E", "D"])
DYAD.assembly(steps=[["BD", "ED"]])


def one_by_one(m: jp.Mechanism) -> jp.Mechanism:
    """Assembled body by body, in the order of the file."""
    return m.with_({"assembly": {"steps": [[body] for k, body in enumerate(m.owners) if is_whole(m, k)]}})


def is_whole(m: jp.Mechanism, body: int) -> bool:
    return m.owners[body] == m.bodies[body] and body not in m.crosses


# --- the dyad --------------------------------------------------------------------------------------------------------


def dyad_jacobians() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of D by the lengths of BD and ED, by B and by E: u_k . dD = dl_k + u_k . dP_k along both links."""
    u = np.array([(D - B) / np.linalg.norm(D - B), (D - E_) / np.linalg.norm(D - E_)])
    inverse = np.linalg.inv(u)
    return inverse, np.outer(inverse[:, 0], u[0]), np.outer(inverse[:, 1], u[1])


def test_the_jacobians_of_the_dyad_are_those_of_two_circles() -> None:
    result = jp.assemble(DYAD.mechanism())
    slopes = result.sensitivity.sel(step=1, component=["x", "y"])
    lengths, by_b, by_e = dyad_jacobians()
    np.testing.assert_allclose(slopes.sel(parameter=["l1.length", "l2.length"]), lengths, atol=1e-9)
    # A clearance offset moves the link on its base as much as the base would.
    np.testing.assert_allclose(slopes.sel(parameter=["B.x", "B.y"]), by_b, atol=1e-9)
    np.testing.assert_allclose(slopes.sel(parameter=["E.x", "E.y"]), by_e, atol=1e-9)
    np.testing.assert_allclose(by_b + by_e, np.eye(2), atol=1e-12)
    np.testing.assert_allclose(lengths, [[0.765, 0.269], [-1.629, 1.780]], atol=6e-4)


@pytest.mark.parametrize("name", ["l1", "l2"])
def test_the_jacobians_of_the_dyad_are_differences_of_built_units(name: str) -> None:
    m, step = DYAD.mechanism(), 1e-3
    ends = [jp.assemble(m.with_({f"dimensions.{name}.deviation": s})).error[0].values for s in (step, -step)]
    slope = jp.assemble(m).sensitivity.sel(step=1, parameter=f"{name}.length")
    np.testing.assert_allclose(slope, (ends[0] - ends[1]) / (2 * step), rtol=1e-6)


def test_what_play_leaves_open_in_an_unloaded_dyad() -> None:
    result = jp.assemble(DYAD.mechanism()).isel(step=0)
    _, by_b, by_e = dyad_jacobians()
    # The pin is on BD: it moves with the play in B, that in E, and that between the links, which acts as E does.
    half = PLAY * (np.linalg.norm(by_b, axis=1) + 2 * np.linalg.norm(by_e, axis=1))
    np.testing.assert_allclose(result.undetermined_shaft.sel(joint="D", component=["x", "y"]), half, rtol=1e-3)
    assert result.status == "undetermined"
    assert set(result.contact.sel(source=["B", "E", "D"]).values.tolist()) == {"undetermined"}
    np.testing.assert_allclose(result.error_shaft, 0.0, atol=1e-9)


def test_a_load_takes_the_play_up_as_virtual_work_says() -> None:
    force = np.array([3.0, -7.0])
    m = DYAD.mechanism().with_({"loads": [{"force": force.tolist()}]})
    result = jp.assemble(m.with_({"joints.*.clearance.radial": 1e-3})).isel(step=0)
    assert result.status == "ok"
    assert set(result.contact.sel(source=["B", "E", "D"]).values.tolist()) == {"touching"}
    # Tension in both links from the load on D; every joint gives its play along the force it transmits.
    lengths, _, _ = dyad_jacobians()
    tension = lengths.T @ force
    np.testing.assert_allclose(result.member_force.sel(member=["BD", "ED"]), tension, rtol=1e-4)
    work = 1e-3 * (abs(tension[0]) + 2 * abs(tension[1]))
    assert result.error.sel(component=["x", "y"]).values @ force == pytest.approx(work, rel=1e-4)


# --- every mechanism -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_last_step_is_the_finished_mechanism(name: str) -> None:
    m = one_by_one(example(name))
    result, finished = jp.assemble(m), jp.solve(m)
    last = result.isel(step=-1)
    assert last.mobility == 0
    assert last.redundancy == 0
    np.testing.assert_allclose(last.nominal, finished.nominal[0])
    if m.has_loads:
        # Nothing runs while it is assembled.
        still = m if m.motion is None else m.with_({f"drives.{drive}.speed": 0 for drive in m.drives})
        loaded = jp.loaded(still).isel(configuration=0)
        np.testing.assert_allclose(last.error, loaded.error, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(last.undetermined, loaded.undetermined, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(last.reaction, loaded.reaction, rtol=1e-6, atol=1e-6)
    # Every freedom that a step leaves is taken away by a later one.
    changes = np.diff(np.concatenate([[0], result.mobility.values]))
    assert changes.sum() == 0


@pytest.mark.parametrize("seed", range(3))
def test_any_order_and_any_base_end_in_the_same_shape(seed: int) -> None:
    """Distances between the centres of the joints depend on neither: unloaded, clearances stay in their middle."""
    rng = np.random.default_rng(seed)
    m = example("3-rrr").with_({"loads": None, "joints.*.clearance.radial": 0.2})
    deviations = {f"dimensions.{name}.deviation": rng.uniform(-0.3, 0.3) for name in m.data.dimensions}
    m = m.with_(deviations)
    names = ["ground", *m.bodies]
    shapes = []
    for base in (names[0], names[1 + seed]):
        rest = [name for name in names if name != base]
        rng.shuffle(rest)
        cuts = sorted(rng.choice(np.arange(1, len(rest)), 2, replace=False).tolist())
        steps = [rest[a:b] for a, b in zip([0, *cuts], [*cuts, len(rest)], strict=True)]
        result = jp.assemble(m.with_({"assembly": {"base": base, "steps": steps}}))
        nominal = centres_of(m)
        assert result.error_shaft.isel(step=-1).notnull().all()
        actual = nominal + result.error_shaft.isel(step=-1).sel(component=["x", "y"]).values
        shapes.append([np.linalg.norm(a - b) for a, b in itertools.combinations(actual, 2)])
    np.testing.assert_allclose(shapes[0], shapes[1], rtol=1e-9)


def centres_of(m: jp.Mechanism) -> np.ndarray:
    """Nominal places of the first centres of all joints, in file units."""
    from jointplay.analyses.nominal import nominal
    from jointplay.basics import poses

    placed = np.vstack([nominal(m).poses[0], np.zeros(3)])
    spec = m.core_spec
    points = [spec["points"][joint["first"]] for joint in spec["joints"]]
    return np.array([poses.place(placed[p["body"]], p["at"])[:2] for p in points]) / m.units.length


def test_a_turned_base_is_refused_where_other_angles_go_by_its_own() -> None:
    """The motor would stand elsewhere than the shoulder, with which it turns: half a turn away, and called ok."""
    m = example("belt-arm")
    order = {"assembly": {"base": "upper", "steps": [["ground", "pulley", "forearm"]]}}
    with pytest.raises(InputError, match=r"assembly\.base: its angle in the drawing .* \"ground\""):
        jp.assemble(m.with_(order))
    order["assembly"] = {"base": "ground", "steps": [["upper", "pulley", "forearm"]]}
    assert jp.assemble(m.with_(order)).status.values.tolist() == ["ok"]


@pytest.mark.parametrize("seed", range(16))
def test_whatever_the_order_every_step_has_an_outcome(seed: int) -> None:
    rng = np.random.default_rng(seed)
    m = example(str(rng.choice(jp.examples.names())))
    names = ["ground", *(m.bodies[k] for k in range(len(m.bodies)) if is_whole(m, k))]
    base = str(rng.choice(names))
    rest = [name for name in names if name != base]
    rng.shuffle(rest)
    cuts = np.flatnonzero(rng.random(len(rest) - 1) < 0.6) + 1
    steps = [rest[a:b] for a, b in zip([0, *cuts], [*cuts, len(rest)], strict=True)]
    asked = m.with_({"assembly": {"base": base, "steps": steps}})
    try:
        result = jp.assemble(asked)
    except InputError as refused:
        if refused.key != "assembly.base":
            raise
        return
    fine = {"ok", "undetermined", "underconstrained", "strained"}
    # Part of a machine may be singular where the whole is not.
    assert set(result.status.values.tolist()[:-1]) <= {*fine, "singular"}
    assert result.status.values[-1] in fine
    # Held is what is free, and in the end nothing is.
    assert ((result.held != "") == (result.mobility > 0)).all()
    assert result.mobility[-1] == 0
    there = result.error_shaft.isel(component=0).notnull().sum(dim="joint")
    assert (there.diff("step") >= 0).all()


# --- what the steps are ----------------------------------------------------------------------------------------------


def kinds(m: jp.Mechanism, steps: list[list[str]], base: str = "ground") -> list[str]:
    return jp.assemble(m.with_({"assembly": {"base": base, "steps": steps}})).kind.values.tolist()


def test_a_single_link_two_links_and_many() -> None:
    m = example("four-bar")
    assert kinds(m, [["crank"], ["coupler", "rocker"]]) == ["fixed", "connected"]
    assert kinds(m, [["crank", "coupler", "rocker"]]) == ["connected"]


def test_what_hangs_is_held_at_its_nominal_place() -> None:
    m = example("four-bar").with_({"assembly.steps": [["rocker"], ["coupler"], ["crank"]], "loads": None})
    result = jp.assemble(m)
    assert result.kind.values.tolist() == ["loose", "loose", "closing"]
    assert result.mobility.values.tolist() == [1, 2, 0]
    assert result.held.values.tolist() == ["J4", "J3, J4", ""]
    assert result.status.values.tolist() == ["underconstrained", "underconstrained", "undetermined"]
    # Held at J4, the far end of the rocker has the play of its pin and nothing more.
    assert result.error_shaft.sel(step=1, joint="J4", component="x") == 0
    clearance = m.value("joints.J4.clearance.radial")
    assert result.undetermined_bearing.sel(step=1, joint="J4", component="x") == pytest.approx(clearance)


def test_a_body_that_is_on_nothing_is_held_as_a_whole() -> None:
    m = example("four-bar").with_({"assembly.steps": [["coupler"], ["crank", "rocker"]]})
    result = jp.assemble(m)
    assert result.mobility.values.tolist() == [3, 0]
    assert result.held.values.tolist() == ["coupler", ""]
    assert result.kind.values.tolist() == ["loose", "closing"]


def test_the_ground_is_a_member_of_an_assembly_on_something_else() -> None:
    m = example("four-bar").with_({"loads": None})
    result = jp.assemble(m.with_({"assembly": {"base": "coupler", "steps": [["crank"], ["rocker", "ground"]]}}))
    assert result.kind.values.tolist() == ["loose", "closing"]
    assert result.attrs["base"] == "coupler"
    # The base stays where it nominally is.
    np.testing.assert_allclose(result.error_shaft.sel(step=2, joint="J3"), 0.0, atol=1e-12)


def test_crosses_of_universal_joints_come_with_the_second_of_their_bodies() -> None:
    result = jp.assemble(one_by_one(example("3-upu")))
    assert result.members.values.tolist()[0] == "lower1"
    # Two turns about the base's universal joint; the leg's length is driven.
    assert result.mobility.values[0] == 2
    assert result.mobility.values[-1] == 0


# --- members that are locked together --------------------------------------------------------------------------------


def chain(lengths: list[float], angles: list[float], play: float, wander: float) -> jp.Mechanism:
    """Bars in a row whose joints are locked by drives, between the ground and a slider on the x axis."""
    text = ['format = 1\nunits = { length = "mm", angle = "deg", force = "N" }']
    names = [f"bar{k}" for k in range(len(lengths))]
    text.append('[joints.start]\ntype = "revolute"\non = { ground = [0, 0], bar0 = [0, 0] }')
    for k, angle in enumerate(angles):
        a, b = names[k], names[k + 1]
        text.append(f'[joints.k{k}]\ntype = "revolute"\non = {{ {a} = [{lengths[k]}, 0], {b} = [0, 0] }}')
        text.append(f"clearance = {{ radial = {play} }}")
        text.append(f'[drives.q{k}]\njoint = "k{k}"\nvalues = [{angle}]\nerror = {wander}')
    text.append(f'[joints.end]\ntype = "revolute"\non = {{ slider = [0, 0], {names[-1]} = [{lengths[-1]}, 0] }}')
    text.append('[joints.guide]\ntype = "prismatic"\non = { ground = { at = [0, 0], axis = 0 }, slider = [0, 0] }')
    text.append('[output]\nbody = "slider"')
    heading = np.cumsum([0.0, *angles])
    far = sum(length * np.exp(1j * np.radians(h)) for length, h in zip(lengths, heading, strict=True))
    text.append("[start]")
    text += [f"{name} = {{ angle = {h - np.degrees(np.angle(far))} }}" for name, h in zip(names, heading, strict=True)]
    text.append(f"slider = {{ x = {abs(far)}, y = 0, angle = 0 }}")
    text.append(f"[assembly]\nsteps = [{names}, ['slider']]")
    return jp.loads("\n".join(text))


def span(lengths: list[float], angles: np.ndarray) -> np.ndarray:
    """Distance between the ends of bars without play."""
    heading = np.cumsum(np.concatenate([np.zeros((*angles.shape[:-1], 1)), angles], axis=-1), axis=-1)
    return np.abs((np.array(lengths) * np.exp(1j * np.radians(heading))).sum(axis=-1))


@pytest.mark.parametrize(
    ("lengths", "angles"),
    [
        ([46.5, 46.5], [0.0]),
        ([100.0, 60.0], [70.0]),
        ([80.0, 50.0, 40.0], [30.0, -50.0]),
        ([60.0, 60.0, 60.0], [0.0, 0.0]),
    ],
)
def test_locked_links_are_as_short_and_as_long_as_brute_force_says(lengths: list[float], angles: list[float]) -> None:
    play, wander = 0.5, 4.0
    result = jp.assemble(chain(lengths, angles, play, wander))
    assert result.links.values.tolist()[0] == "+".join(f"bar{k}" for k in range(len(lengths)))
    grid = np.array(list(itertools.product(np.linspace(-wander, wander, 161), repeat=len(angles))))
    every = span(lengths, np.array(angles) + grid)
    # The offset of every pin may point anywhere, whatever the angles.
    reach = play * len(angles)
    assert result.link_nominal.item() == pytest.approx(span(lengths, np.array(angles)))
    assert result.link_shortest.item() == pytest.approx(every.min() - reach, rel=1e-6)
    assert result.link_longest.item() == pytest.approx(every.max() + reach, rel=1e-6)


def test_with_known_angles_only_the_play_makes_a_locked_link_longer_or_shorter() -> None:
    """|l1 + ... + ln| -+ (n - 1) r."""
    result = jp.assemble(chain([80.0, 50.0, 40.0], [30.0, -50.0], 0.5, 0.0))
    length = span([80.0, 50.0, 40.0], np.array([30.0, -50.0]))
    assert result.link_shortest.item() == pytest.approx(length - 1.0, abs=1e-9)
    assert result.link_longest.item() == pytest.approx(length + 1.0, abs=1e-9)


# --- tolerances ------------------------------------------------------------------------------------------------------


def test_worst_and_scatter_of_the_last_step_are_those_of_the_mechanism() -> None:
    m = example("four-bar").with_(
        {"drives.theta1.values": [43.83], "assembly.steps": [["crank"], ["coupler", "rocker"]]}
    )
    worst = jp.assemble(m, "worst")
    assert worst.worst_position[-1].item() == pytest.approx(jp.worst(m).worst_position[0].item(), rel=1e-9)
    found, finished = jp.assemble(m, "random", samples=4000, seed=3), jp.random(m, samples=4000, seed=3)
    np.testing.assert_allclose(found.error_std[-1], finished.error_std[0], rtol=1e-3)
    assert found.probability_of_fit.values.tolist() == [1.0, 1.0]
    assert int(found.failures.sel(step=2, outcome="ok")) == 4000
    assert found.quantile_shaft.max() <= worst.worst_shaft.max()


def test_the_same_units_go_through_all_steps_whatever_the_threads() -> None:
    m = DYAD.mechanism().with_({"dimensions.l1.tolerance": 0.1})
    a, b = (jp.assemble(m, "random", samples=300, seed=8) for _ in range(2))
    assert a.identical(b)


def test_scatter_of_the_dyad_is_its_first_order() -> None:
    m = DYAD.mechanism().with_({"joints.*.clearance.radial": 0.01, "dimensions.l1.tolerance": 0.03})
    found = jp.assemble(m, "random", samples=40_000)
    slopes = jp.assemble(m).sensitivity.sel(step=1, component=["x", "y"])
    # Normal and cut at three sigma: 0.9733 of the variance; uniform in a disc: r^2 / 4.
    variance = 0.9733 * 0.01**2 * slopes.sel(parameter="l1.length").values ** 2
    for joint in "BED":
        variance = variance + 0.01**2 / 4 * (slopes.sel(parameter=[f"{joint}.x", f"{joint}.y"]).values ** 2).sum(axis=1)
    np.testing.assert_allclose(found.error_std[0, :2], np.sqrt(variance), rtol=0.02)


# --- bad input -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("assembly", "message"),
    [
        ({"steps": [["crank"], ["coupler", "roker"]]}, "assembly.steps.1.1: 'roker' is not a body .* 'rocker'"),
        ({"base": "grund", "steps": [["crank"]]}, "assembly.base: 'grund' is not a body .* 'ground'"),
        ({"steps": [["crank"], ["crank", "coupler", "rocker"]]}, "assembly.steps.1.0: 'crank' is added already"),
        ({"steps": [["ground"]]}, "assembly.steps.0.0: 'ground' is the base"),
        ({"steps": [["crank", "coupler"]]}, "assembly.steps: every body is added once; missing: 'rocker'"),
        ({"base": "crank", "steps": [["coupler", "rocker"]]}, "missing: 'ground'"),
        ({"steps": ["crank"]}, "assembly.steps.0: a list in brackets is needed"),
        ({"steps": [[]]}, "assembly.steps.0: the list is empty"),
        ({"steps": []}, "assembly.steps: the list is empty"),
        ({"base": "ground"}, "assembly: 'steps' is missing"),
        ({"order": [["crank"]], "steps": [["crank"]]}, "'order' is not a key here"),
    ],
)
def test_what_is_wrong_with_an_order_is_said_in_one_line(assembly: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        example("four-bar").with_({"assembly": assembly})


def test_an_order_is_needed_and_a_configuration_that_exists() -> None:
    m = example("four-bar")
    with pytest.raises(InputError, match="the order of assembly is missing"):
        jp.assemble(m)
    m = m.with_({"assembly.steps": [["crank", "coupler", "rocker"]]})
    with pytest.raises(InputError, match="there is no configuration 11; they go from 0 to 10"):
        jp.assemble(m, configuration=11)
    with pytest.raises(InputError, match="'wurst' is not a question about an assembly; did you mean 'worst'"):
        jp.assemble(m, "wurst")


def test_what_cannot_be_closed_is_a_status() -> None:
    m = example("four-bar").with_({"drives.theta1.values": [170.0], "assembly.steps": [["crank", "coupler", "rocker"]]})
    for question in ("unit", "worst", "random"):
        assert jp.assemble(m, question).status.values.tolist() == ["not_assembled"]


# --- ends where the next member will come -----------------------------------------------------------------------------

BRACKET = planar()
BRACKET.fixed("A", bodies=["ground", "panel"], at=(0, 0), angle={"deviation": 0.05})
BRACKET.revolute("B", bodies=["panel", "outer"], at=(200, 0), clearance=jp.radial(0.02))
BRACKET.drive("hinge", joint="B", values=[0])
BRACKET.dimension("length", body="panel", between=["A", "B"], tolerance=0.1, deviation=0.03)
BRACKET.output(body="outer", at=(300, 0))
BRACKET.assembly(steps=[["panel"], ["outer"]])


def test_the_free_end_of_a_link_is_told_before_the_next_one_is_there() -> None:
    m = BRACKET.mechanism()
    angle = np.radians(0.05)
    end = 200.03 * np.array([np.cos(angle), np.sin(angle)]) - [200.0, 0.0]
    unit = jp.assemble(m)
    found = unit.error_shaft.sel(step=1, joint="B")
    np.testing.assert_allclose(found.sel(component=["x", "y"]), end, atol=1e-12)
    assert found.sel(component="angle").item() == pytest.approx(0.05)
    # The other half of the joint comes with its body.
    assert unit.error_bearing.sel(step=1, joint="B").isnull().all()
    assert unit.error_bearing.sel(step=2, joint="B").notnull().all()
    worst, scatter = jp.assemble(m, "worst"), jp.assemble(m, "random", samples=500)
    far = 200.13 * np.array([np.cos(angle), np.sin(angle)]) - [200.0, 0.0]
    assert worst.worst_shaft.sel(step=1, joint="B").item() == pytest.approx(np.hypot(*far), rel=1e-9)
    largest = scatter.quantile_shaft.sel(step=1, joint="B", probability=0.999).item()
    assert np.hypot(*end) < largest <= np.hypot(*far)


def test_steps_without_a_load_are_assembled_at_once() -> None:
    """The load stands on the outer panel, so that nothing acts in the first steps. What forces change is then a ratio
    of nothing to nothing, whose singular values were looked for without end."""
    m = jp.loads(jp.examples.text("antenna-support", {"locked": "false", "elastic": "redundant", "radial": "0.5"}))
    assert set(jp.assemble(m).status.values.tolist()) <= {"ok", "undetermined"}
