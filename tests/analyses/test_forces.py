"""Forces of drives and joints in mechanisms with play, against closed forms, brute force and the core's own statics."""

import numpy as np
import pytest

import jointplay as jp
from helpers.builders import planar
from jointplay.analyses import loaded
from jointplay.analyses.forces.statics import Balances
from jointplay.analyses.nominal import nominal

FORCE, CRANK, ROD, PLAY, TOLERANCE = 400.0, 50.0, 150.0, 0.2, 0.1
ANGLES = np.array([20.0, 70.0, 130.0])

CRANK_DRIVE = planar()
CRANK_DRIVE.revolute("main", ground=(0, 0), crank=(0, 0))
CRANK_DRIVE.revolute("pin", crank=(CRANK, 0), rod=(0, 0), clearance=jp.radial(PLAY))
CRANK_DRIVE.revolute("wrist", rod=(ROD, 0), piston=(0, 0))
CRANK_DRIVE.prismatic("guide", ground={"at": [0, 0], "axis": [1, 0]}, piston=(0, 0))
CRANK_DRIVE.start("crank", angle=20)
CRANK_DRIVE.start("rod", angle=-7)
CRANK_DRIVE.drive("theta", joint="main", values=ANGLES)
CRANK_DRIVE.dimension("rod", body="rod", between=["pin", "wrist"], tolerance=TOLERANCE)
CRANK_DRIVE.output(body="piston")
CRANK_DRIVE.load(body="piston", force=(-FORCE, 0))


def torque(angle, x=0.0, y=0.0, longer=0.0):
    """What the crank has to give: F dX/dtheta with the crank pin's far side at A = (r cos + x, r sin + y).

    X = A_x + sqrt(l^2 - A_y^2); x and y are held in ground axes.
    """
    rod = ROD + longer
    height = CRANK * np.sin(angle) + y
    return FORCE * CRANK * (-np.sin(angle) - height * np.cos(angle) / np.sqrt(rod**2 - height**2))


def brute_force(play, tolerance=TOLERANCE):
    """The largest moment of the crank in any of its configurations."""
    offsets = play * np.sin(np.linspace(0.0, 2.0 * np.pi, 721))
    every = [torque(angle, 0.0, offsets, end) for angle in np.radians(ANGLES) for end in (-tolerance, tolerance)]
    return np.abs(every).max()


def mechanism(**changes):
    return CRANK_DRIVE.mechanism().with_(changes)


def test_the_torque_of_a_crank_is_that_of_its_closed_form():
    m, angles = mechanism(), np.radians(ANGLES)
    result = jp.forces(m, "given", offsets={"pin": [0.15, -0.1], "rod": 0.05}, of=["drives.theta"])
    # Newton's method leaves 1e-13 of the length.
    assert np.allclose(result.nominal_force[:, 0], torque(angles), rtol=1e-9)
    assert np.allclose(result.force[:, 0], torque(angles, 0.15, -0.1, 0.05), rtol=1e-9)
    slope = (torque(angles, 0.15e-3, -0.1e-3, 0.05e-3) - torque(angles, -0.15e-3, 0.1e-3, -0.05e-3)) / 2e-3
    assert np.allclose(result.force_first_order[:, 0], torque(angles) + slope, rtol=1e-8)
    assert np.allclose(result.contribution.sum("source")[:, 0], slope, rtol=1e-5)
    assert str(result.quantity_unit[0].item()) == "N mm"


@pytest.mark.parametrize("question", ["worst", "random", "loaded", "given"])
def test_without_play_forces_are_those_of_the_closed_form(question):
    """A file as it is imported, before clearances are written: there was a traceback."""
    m = mechanism(**{"joints.pin.clearance": None, "dimensions": None})
    result = jp.forces(m, question, of=["drives.theta"])
    found = result.force.values.reshape(len(ANGLES), -1)
    assert np.allclose(found, torque(np.radians(ANGLES))[:, None], rtol=1e-9)


def test_the_largest_torque_is_that_of_brute_force():
    result = jp.forces(mechanism(), of=["drives.theta"])
    assert not result.unsettled.any()
    turns = np.linspace(0.0, 2.0 * np.pi, 721)
    for k, angle in enumerate(np.radians(ANGLES)):
        every = [torque(angle, 0.0, PLAY * np.sin(turns), longer) for longer in (-TOLERANCE, 0.0, TOLERANCE)]
        # The disc is looked at in half degrees, of which the largest is off by the square of a quarter.
        assert np.allclose(result.force[k, 0], [np.min(every), np.max(every)], rtol=1e-7)
    again = jp.forces(
        mechanism(), "given", offsets=result.worst_offset.sel(quantity="drives.theta", side="high"), of=["drives.theta"]
    )
    assert np.allclose(again.force[:, 0], result.force[:, 0, 1], rtol=1e-12)


def test_the_reaction_of_a_guide_is_that_of_the_rod():
    m, angles = mechanism(), np.radians(ANGLES)
    result = jp.forces(m, "given", offsets={"pin": [0.0, 0.2]}, of=["joints.guide", "joints.wrist"])
    sine = (CRANK * np.sin(angles) + 0.2) / ROD
    cosine = np.sqrt(1.0 - sine**2)
    assert np.allclose(result.force, np.stack([FORCE * sine / cosine, FORCE / cosine], axis=1), rtol=1e-9)


def test_under_the_load_forces_are_those_of_loaded():
    # Its pin lies to the side of the rod: as if the rod were longer or shorter.
    m, angles = mechanism(), np.radians(ANGLES)
    result, known = jp.forces(m, "loaded"), jp.loaded(m)
    assert np.allclose(result.force.sel(quantity="drives.theta"), known.drive_torque[:, 0], rtol=1e-12)
    sizes = np.linalg.norm(known.reaction.sel(wrench=["fx", "fy"]), axis=-1)
    assert np.allclose(result.force[:, 1:], sizes, rtol=1e-9)
    assert np.allclose(result.force[:, 0], torque(angles, longer=-PLAY), rtol=1e-9)


def test_specimens_scatter_as_their_closed_form():
    m = mechanism()
    result = jp.forces(m, "random", samples=2000, of=["drives.theta"], probability=0.9)
    drawn = jp.random(m, samples=2000, sampling="plain", keep=2000, contact="scattered")
    u = drawn.specimen_offset.isel(configuration=1)
    each = torque(
        np.radians(ANGLES[1]), u.sel(parameter="pin.x"), u.sel(parameter="pin.y"), u.sel(parameter="rod.length")
    )
    assert np.isclose(result.force_mean[1, 0], each.mean(), rtol=1e-9)
    assert np.isclose(result.force_std[1, 0], each.std(), rtol=1e-6)
    assert np.allclose(result.force[1, 0], np.quantile(each, [0.05, 0.95]), rtol=1e-9)
    # 2000 specimens know a standard deviation to 2 %.
    assert np.allclose(result.force_std_first_order, result.force_std, rtol=0.08)
    assert np.allclose(result.contribution.sum("source"), result.force_std_first_order**2, rtol=1e-9)


def limited(**limits):
    return mechanism(**{f"limits.{name.replace('__', '.')}": value for name, value in limits.items()})


def test_limits_are_judged_and_the_source_to_tighten_is_named():
    m = limited(drive_torques__theta=21_000, reactions__guide=134.0)
    largest = jp.forces(m)
    told = jp.table(largest)
    high = largest.force.sel(quantity="drives.theta", side="low").min().item()
    assert high < -21_000
    assert np.isclose(largest.margin.min("configuration").sel(quantity="drives.theta"), 21_000 + high)
    assert not largest.limit_met.sel(quantity="drives.theta").all()
    assert largest.limit_met.sel(quantity="joints.guide").all()
    assert largest.limit_met.sel(quantity="joints.main").all()
    assert np.isnan(largest.margin.sel(quantity="joints.main")).all()
    assert told is not None
    outside = jp.forces(m, "random", samples=500, probability=0.9)
    each = outside.force.sel(quantity="drives.theta", side="low") < -21_000
    assert ((outside.outside > 0.05) | ~each).all()
    assert outside.attrs["required_yield"] == 0.9


def test_verdicts_say_which_force_and_why():
    from jointplay.analyses.forces import compute
    from jointplay.result.verdict import verdict

    missed = verdict(compute(limited(reactions__guide=130.0)))
    assert missed.outcome == "missed"
    assert missed.sentences[0].startswith("Limit missed: joints.guide")
    assert "to tighten first: pin" in missed.sentences[0]
    held = verdict(compute(limited(drive_torques__theta=[-30_000, 0])))
    assert held.outcome == "held"
    assert "drives.theta" in held.sentences[0]
    assert verdict(compute(mechanism())).outcome == ""


def test_the_largest_play_that_a_torque_allows_is_that_of_its_closed_form():
    from scipy.optimize import brentq

    limit = 1.01 * brute_force(PLAY)
    result = jp.allow(limited(drive_torques__theta=limit), "forces")
    found = result.sel(source="pin")
    assert np.isclose(found.allowed, brentq(lambda play: brute_force(play) - limit, 0.0, 5.0), rtol=3e-4)
    assert found.binding_quantity.item() == "drives.theta"
    assert np.isclose(result.used, 1.0 / 1.01, rtol=1e-6)
    with pytest.raises(jp.InputError, match=r"no limits of forces.*drive_torques, reactions"):
        jp.allow(mechanism(), "forces")


def sentence(result):
    from jointplay.result import from_dataset
    from jointplay.result.conclusions import conclude

    return next(one for one in conclude(from_dataset(result)).sentences if "imits of forces" in one.text)


def test_what_is_compared_is_judged_for_forces_too():
    most = brute_force(PLAY)
    tight, loose, none = (mechanism(**{"limits.position": 5.0}) for _ in range(3))
    tight = tight.with_({"limits.drive_torques.theta": 0.999 * most})
    loose = loose.with_({"limits.drive_torques.theta": most / 0.9})
    # Of the last one nothing is said, and the first is the one that everything else is taken from.
    result = jp.compare(none, tight, loose, names=["none", "tight", "loose"])
    assert result.forces_outcome.values.tolist() == ["", "missed", "held"]
    assert np.allclose(result.forces_used[1:], [1.0 / 0.999, 0.9], rtol=1e-6)
    assert "forces_apart" not in jp.compare(tight, none).attrs
    assert "forces_used" not in jp.compare(none, none.with_({"limits.position": 1.0})).data_vars
    assert sentence(result).text == (
        "The limits of forces are missed in the worst case in tight: drives.theta uses 100.1 % of its limit,"
        " at configuration 1."
    )


def test_limits_hold_in_compared_mechanisms_only_where_those_of_forces_do():
    """It said `Limits hold in both` above what forces miss."""
    from jointplay.result import from_dataset
    from jointplay.result.conclusions import conclude
    from jointplay.result.table import tables

    most = brute_force(PLAY)
    loose = mechanism(**{"limits.position": 5.0, "limits.drive_torques.theta": most / 0.9})
    tight, idle = loose.with_({"limits.drive_torques.theta": 0.999 * most}), loose.with_({"loads": []})

    def said(*mechanisms):
        result = from_dataset(jp.compare(*mechanisms, names=["a", "b", "c"][: len(mechanisms)]))
        return conclude(result).sentences[0], result

    assert said(loose, loose)[0].text == "Limits hold in both."
    both, _ = said(tight, loose)
    assert both.text == "Limits of errors hold in both; those of forces are missed in a."
    assert (both.state, both.is_alarm) == ("missed", True)
    every, result = said(tight, loose, idle)
    assert every.text == (
        "Limits of errors hold in all 3; those of forces are missed in a and are not shown to hold in c."
    )
    first = next(table for table in tables(result) if table.columns[0].cells[0].startswith("limits"))
    assert [column.cells[:2] for column in first.columns] == [
        ("limits of errors", "limits of forces"),
        *(("held", outcome) for outcome in ("missed", "held", "not shown")),
    ]


def test_of_several_load_cases_the_worst_one_is_named():
    cases = {name: [{"body": "piston", "force": [-part * FORCE, 0]}] for name, part in (("more", 1.0), ("less", 0.5))}
    m = mechanism(**{"loads": [], "load_cases": cases, "limits.drive_torques.theta": 0.999 * brute_force(PLAY)})
    for changes in ({}, {"load_cases": dict(reversed(cases.items()))}):
        one = m.with_(changes)
        result = jp.compare(one, one, names=["a", "b"])
        assert result.forces_load_case.values.tolist() == ["more", "more"]
        assert np.allclose(result.forces_used, 1.0 / 0.999, rtol=1e-6)
        assert sentence(result).text.endswith("at configuration 1 of load case more.")


def test_maps_and_sweeps_name_the_load_case_that_uses_most_of_a_limit():
    """Both miss it at as many places; the first one of the file was named."""
    from jointplay.result import from_dataset
    from jointplay.result.conclusions import conclude

    cases = {name: [{"body": "piston", "force": [-part * FORCE, 0]}] for name, part in (("less", 0.5), ("more", 1.0))}
    m = limited(drive_torques__theta=1.0).with_({"loads": [], "load_cases": cases})
    key, angles = "joints.pin.clearance.radial", {"theta": ANGLES.tolist()}
    by = {"limits.drive_torques.theta": [1.0, 2.0]}
    mapped, swept = jp.map(m, "forces", angles), jp.sweep(m, key, [0.1, 0.2], "forces")
    assert np.allclose(mapped.used.max("theta").sel(load_case="more") / 2.0, mapped.used.max("theta")[0], rtol=0.1)
    for result in (mapped, swept, jp.sweep(m, key, [0.1, 0.2], "forces", by=by)):
        assert (
            conclude(from_dataset(result))
            .sentences[0]
            .text.startswith("Load case more, the worst of 2 by their limits: ")
        )


def test_maps_name_the_output_that_uses_most_of_a_limit_of_errors():
    from jointplay.result import from_dataset
    from jointplay.result.conclusions import conclude

    ends = {"a": {"body": "rod", "at": [0, 0]}, "b": {"body": "piston", "at": [0, 0]}}
    m = mechanism(**{"output": None, "outputs": ends, "limits.position": 1e-9})
    result = jp.map(m, "worst", {"theta": ANGLES.tolist()})
    worst = result.worst_position.max("theta")
    assert worst.sel(output="b") > worst.sel(output="a") > 0.01
    assert conclude(from_dataset(result)).sentences[0].text.startswith("Output b, ")


def test_sizes_that_are_chosen_and_that_wear_are_judged_for_forces_too(tmp_path, capsys):
    from jointplay.cli import run

    most, path = brute_force(0.1, 2.5), tmp_path / "crank.toml"
    costs = {"pin": {"choices": [{"size": 0.1, "cost": 1}]}, "rod": {"choices": [{"size": 2.5, "cost": 1}]}}
    m = limited(drive_torques__theta=1.001 * most, position=5.0).with_({"costs": costs})
    chosen = jp.allocate(m)
    assert chosen["size"].values.tolist() == [0.1, 2.5]
    assert np.isclose(chosen.forces_used, 1.0 / 1.001, rtol=1e-6)
    m.with_({"limits.drive_torques.theta": 0.999 * most}).write(path)
    assert run(["allocate", str(path)]) == 1
    assert "limits of forces are missed in the worst case with these sizes" in " ".join(capsys.readouterr().out.split())
    worn = limited(drive_torques__theta=30_000, position=1.0).with_({"joints.pin.wear": {"rate": 1e-6, "length": 10}})
    result = jp.life(worn)
    assert np.isclose(result.forces_used, brute_force(result.size_worn.item()) / 30_000, rtol=1e-6)
    assert result.size_worn > 2.0 * PLAY
    limit = 1.001 * brute_force(PLAY)
    worn.with_({"limits.drive_torques.theta": limit}).write(path)
    assert run(["life", str(path)]) == 1
    assert jp.life(jp.load(path)).forces_outcome == "missed"


@pytest.mark.parametrize("question", ["worst", "forces"])
def test_a_workspace_ends_where_the_torque_of_a_drive_does(question):
    """Of a weight at the tool the shoulder bears x + d cos(q1), with the upper arm longer by d."""
    longer, weight, torque_ = 8.0, 10.0, 4000.0
    m = jp.loads(jp.examples.text("serial-2r")).with_(
        {
            "gravity": [0, 0],
            "bodies": {},
            "loads": [{"force": [0, -weight]}],
            "dimensions.forearm": None,
            "joints.mount.angle": None,
            "dimensions.upper.tolerance": longer,
            "drives.q1.error": 0,
            "drives.q2.error": 0,
            "limits": {"position": 1e3, "drives": {"q2": [-150, 0]}, "drive_torques": {"q1": torque_}},
        }
    )
    grid = {"x": np.linspace(340.0, 420.0, 5).tolist(), "y": np.linspace(-60.0, 60.0, 5).tolist()}
    result = jp.workspace(m, grid, question=question)
    assert result.forces_outcome == "held"
    ends = result.vertex.values[result.vertex_bound.values == "limits.drive_torques.q1"]
    assert len(ends) > 5
    upper, turn = 300.0, np.radians(-15.0)
    fore = np.hypot(250.0 + 80.0 * np.cos(turn), 80.0 * np.sin(turn))
    far = np.linalg.norm(ends, axis=1)
    lift = np.arccos((upper**2 + far**2 - fore**2) / (2.0 * upper * far))
    shoulder = np.arctan2(ends[:, 1], ends[:, 0]) + lift
    assert np.allclose(ends[:, 0] + longer * np.cos(shoulder), torque_ / weight, atol=2.0 * result.attrs["tolerance"])
    assert (ends[:, 0] < torque_ / weight - 1.0).all()


def test_a_workspace_says_why_forces_do_not_bound_it():
    m = jp.loads(jp.examples.text("serial-2r")).with_({"gravity": [0, 0], "bodies": {}, "loads": []})
    m = m.with_({"limits.position": 1e3, "limits.drive_torques.q1": 1.0})
    grid = {"x": [340.0, 380.0, 420.0], "y": [-60.0, 0.0, 60.0]}
    assert sentence(jp.workspace(m, grid, question="worst")).text.startswith(
        "Not shown: whether the limits of forces hold in the worst case everywhere in it; nothing loads"
    )
    assert "do not count here" in sentence(jp.workspace(m, grid)).text


def test_what_does_not_judge_forces_says_so(tmp_path, capsys):
    from jointplay.cli import run

    path = tmp_path / "crank.toml"
    limited(drive_torques__theta=1.0, position=5.0).write(path)
    apart = "Limits of forces do not count here"

    def said(*arguments):
        code = run([*arguments, str(path)])
        return code, " ".join(capsys.readouterr().out.split())

    code, text = said("error", "-q", "worst")
    assert code == 0
    assert apart in text
    assert apart in said("allow")[1]
    code, text = said("error")
    assert code == 1
    assert "all Limits missed: for forces in the worst case (drives.theta" in text
    assert "Held: under the load and in the worst case" in text
    # Where no pose decides the forces, or nothing acts, nothing is known of them.
    limited(drive_torques__theta=1.0, position=5.0).with_({"loads": []}).write(path)
    code, text = said("error")
    assert code == 1
    assert "all Not shown: whether limits hold for forces" in text
    page = tmp_path / "page.html"
    assert run(["report", str(path), "-o", str(page)]) == 1
    assert "Not shown: whether limits hold for forces" in page.read_text(encoding="utf-8")
    capsys.readouterr()
    jp.loads(jp.examples.text("redundant-bar")).with_({"limits.position": 1e3, "limits.reactions.P": 1.0}).write(path)
    code, text = said("error")
    assert code == 1
    assert "all Not shown: whether limits hold for forces" in text


def test_maps_and_sweeps_show_what_is_used_of_a_limit():
    m = limited(drive_torques__theta=21_000)
    swept = jp.sweep(m, "joints.pin.clearance.radial", [0.0, 5.0], "forces")
    for value, used in zip([0.0, 5.0], swept.used.values, strict=True):
        turns = np.linspace(0.0, 2.0 * np.pi, 721)
        for angle, one in zip(np.radians(ANGLES), used, strict=True):
            every = [torque(angle, 0.0, value * np.sin(turns), longer) for longer in (-TOLERANCE, TOLERANCE)]
            assert np.isclose(one, np.abs(every).max() / 21_000, rtol=1e-6)
    mapped = jp.map(m, "forces", {"theta": ANGLES.tolist()})
    assert np.allclose(mapped.used, jp.forces(m).used, rtol=1e-9)
    assert (mapped.limit_met.all("quantity") == (mapped.used <= 1.0)).all()
    with pytest.raises(jp.InputError, match="limits no force"):
        jp.map(mechanism(), "forces", {"theta": [20, 30]})
    with pytest.raises(jp.InputError, match="limits no force"):
        jp.sweep(mechanism(), "joints.pin.clearance.radial", [0.1], "forces")


@pytest.mark.filterwarnings("error")
def test_maps_and_sweeps_of_a_limit_of_nothing_are_without_warnings():
    """Quantiles and the ends of colours were taken of numbers without end."""
    from jointplay.result import from_dataset
    from jointplay.result.table.map import overview

    m = limited(drive_torques__theta=0.0)
    sizes = overview(from_dataset(jp.map(m, "forces", {"theta": [20, 30]})))[-1]
    cells = {column.name: column.cells for column in sizes.columns}
    assert cells["median"] == cells["largest"]
    jp.plot.sweep(jp.sweep(m, "joints.pin.clearance.radial", [0.1, 0.2], "forces"), surface=True)


def test_a_figure_of_swept_forces_has_what_is_used_and_the_limit(tmp_path, capsys):
    from jointplay.cli import run

    key, values = "joints.pin.clearance.radial", [0.0, 1.0, 5.0]
    swept = jp.sweep(limited(drive_torques__theta=21_000), key, values, "forces")
    (axes,) = jp.plot.sweep(swept).axes
    *curves, limit = axes.lines
    assert np.array_equal([one.get_ydata() for one in curves], swept.used.T)
    assert list(limit.get_ydata()) == [1.0, 1.0]
    with pytest.raises(jp.InputError, match="'position' is not a quantity; known: used"):
        jp.plot.sweep(swept, "position")
    # A second key ended in a traceback.
    path, figure = tmp_path / "crank.toml", tmp_path / "figure.svg"
    limited(drive_torques__theta=21_000).write(path)
    for more in ([], ["--by", "dimensions.rod.tolerance=0,2"]):
        assert run(["sweep", str(path), "-q", "forces", "--set", f"{key}=0,1", *more, "--plot", str(figure)]) == 0
        assert figure.exists()
        figure.unlink()
    assert "radial = 1 mm, tolerance = 2 mm" in " ".join(capsys.readouterr().out.split())


def test_a_design_keeps_to_limits_of_forces():
    aside = mechanism(**{"joints.guide.on.ground.at": [0, 20], "limits.position": 5.0})
    vary, aim = {"joints.guide.on.ground.at.1": [-20, 20]}, "size"
    free = jp.design(aside, vary, aim, evaluations=40)
    limit = jp.forces(aside.with_({"joints.guide.on.ground.at": [0, 5]}), of=["drives.theta"]).force
    limit = float(np.abs(limit).max())
    found = jp.design(aside.with_({"limits.drive_torques.theta": limit}), vary, aim, evaluations=40)
    assert "limits.drive_torques.theta" in found.held.values
    assert "limits.drive_torques.theta" not in free.held.values
    kept = aside.with_({"joints.guide.on.ground.at": [0, found.value_found.item()]})
    assert np.abs(jp.forces(kept, of=["drives.theta"]).force).max() <= limit * (1.0 + 1e-6)


EXAMPLES = ("press", "press-running", "excavator", "rssr", "3-upu", "geared-five-bar", "belt-arm", "delta-by-hand")


@pytest.mark.parametrize("name", EXAMPLES)
def test_forces_at_given_offsets_are_the_core_statics(name):
    m = jp.loads(jp.examples.text(name))
    at = nominal(m).with_errors.first(2)
    loads = loaded.loads_of(m, at)
    found = m.core.loaded(at.drives, at.poses, True, True, True, loads=loads)
    forces = Balances(m, at, loads).forces(np.arange(len(at)), found["offset"])
    lengths = 2 if len(m.components) == 3 else 3
    reactions = np.linalg.norm(found["reaction"][..., :lengths], axis=-1)
    largest = max(reactions.max(), np.abs(found["drive_force"]).max())
    assert np.allclose(forces, np.column_stack([found["drive_force"], reactions]), atol=1e-12 * largest)


def work(m, name, step, offsets):
    """Work of the output's load while one drive goes to both sides by a step, per unit of the step; no gravity."""
    ends = []
    for sign in (1.0, -1.0):
        values = (m.drive_values[0] / m.drive_factors).tolist()
        values[m.drives.index(name)] += sign * step
        moved = m.with_({f"drives.{drive}.values": [value] for drive, value in zip(m.drives, values, strict=True)})
        found = jp.given(moved, offsets)
        ends.append((found.nominal + found.error)[0].values)
    return (ends[0] - ends[1]) / (2.0 * step)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("name", ["four-bar", "3-rrr"])
def test_a_drive_gives_what_its_motion_takes_from_the_load(name, seed):
    rng = np.random.default_rng(seed)
    m = jp.loads(jp.examples.text(name))
    force, moment = rng.normal(size=2).tolist(), rng.normal()
    m = m.with_({"loads": [{"force": force, "moment": moment}], "gravity": [0.0, 0.0]})
    drives = {drive: m.data.drives[drive] for drive in m.drives}
    row = rng.integers(len(m.drive_values))
    m = m.with_(
        {
            f"drives.{drive}": {"joint": one.joint, "values": [np.degrees(m.drive_values[row, k]).item()]}
            for k, (drive, one) in enumerate(drives.items())
        }
    )
    u = m.core.specimens(1, seed, "boundary", "plain")[0] / m.parameter_factors
    found = jp.forces(m, "given", offsets=u)
    for drive in m.drives:
        dx, dy, turn = work(m, drive, 0.02, u)
        # A degree of the drive is pi / 180, and the turn of the output is in degrees.
        want = (force[0] * dx + force[1] * dy) * 180.0 / np.pi + moment * turn
        assert np.isclose(found.force.sel(quantity=f"drives.{drive}")[0], -want, rtol=1e-5, atol=1e-5)


def test_no_random_offsets_of_a_six_bar_go_beyond_its_worst_forces():
    m = jp.loads(jp.examples.text("six-bar"))
    m = m.with_({f"drives.{name}.values": [40] for name in m.drives})
    result = jp.forces(m)
    at = nominal(m).with_errors
    drawn = m.core.specimens(4000, 1, "boundary", "plain")
    many = Balances(m, at, None).forces(np.zeros(4000, dtype=np.int64), drawn)
    factor = np.array([1e-3 if unit == "N mm" else 1.0 for unit in result.quantity_unit.values])
    low, high = (result.force[0].sel(side=side).values * factor for side in ("low", "high"))
    room = 1e-9 * np.abs(high).max()
    assert (many.min(axis=0) >= low - room).all()
    assert (many.max(axis=0) <= high + room).all()
    # Random offsets come near; a wrong sign or unit does not.
    assert (many.max(axis=0) - high >= -0.5 * (high - low)).all()


def test_offsets_that_count_by_their_products_are_found():
    """A ratio error and a motor's angle have no slope alone: ascents stood still where both were nothing."""
    m = jp.loads(jp.examples.text("rack-slider"))
    result = jp.forces(m, of=["drives.motor"])
    at = nominal(m).with_errors
    drawn = m.core.specimens(1000, 7, "boundary", "plain")
    for k in (0, len(at) - 1):
        many = Balances(m, at, None).forces(np.full(1000, k), drawn)[:, 0] / m.units.moment
        assert many.max() <= result.force[k, 0, 1] * (1.0 + 1e-9)
        assert many.min() >= result.force[k, 0, 0] * (1.0 - 1e-9)
        assert result.force[k, 0, 1] > result.force_first_order[k, 0, 1]


@pytest.mark.parametrize(
    ("changes", "arguments", "words"),
    [
        ({}, {"question": "region"}, "question"),
        ({}, {"of": ["drives.phi"]}, "of.*drives.phi.*drives.theta"),
        ({}, {"offsets": {"pin": [0, 0]}}, "goes with the question given"),
        ({}, {"probability": 0.9}, "goes with the question random"),
        ({"loads": []}, {}, "nothing loads the mechanism"),
    ],
)
def test_what_cannot_be_asked_is_refused(changes, arguments, words):
    with pytest.raises(jp.InputError, match=words):
        jp.forces(mechanism(**changes), **arguments)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("drive_torques.phi", 5, "phi.*theta"),
        ("drive_torques.theta", -5, "0 or more"),
        ("drive_torques.theta", [5, -5], "lowest, highest"),
        ("drive_torques.theta", "much", "a number for both sides, or .lowest, highest., is needed"),
        ("reactions.nut", 5, "nut.*main"),
    ],
)
def test_limits_of_forces_are_checked(key, value, words):
    with pytest.raises(jp.InputError, match=words):
        mechanism(**{f"limits.{key}": value})


def test_redundant_members_are_refused():
    with pytest.raises(jp.InputError, match="no pose decides how"):
        jp.forces(jp.loads(jp.examples.text("redundant-bar")))
