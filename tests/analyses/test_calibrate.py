"""`calibrate`: planted deviations are found, within standard errors that are right, by every kind of machine.

Independent: truth that is known because it was planted; estimates of another program (scipy's `least_squares` on poses
of `given`, with the same priors); ranks by brute force; finite differences; sums that are known by hand.
"""

import json
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.arms import PUSHED
from helpers.built import DATA, MACHINES, Machine, actual, displaced, readings, specimen
from helpers.calibrated_elsewhere import FIXED, NOISE, by_pybotics, planted_arm
from jointplay.analyses.calibrate import compute, fitter_of
from jointplay.analyses.calibrate.system import combinations
from jointplay.analyses.calibrate.unknowns import unknowns_of
from jointplay.analyses.nominal import at_drives, nominal
from jointplay.analyses.readings import DeviceFrame, ReadingModel
from jointplay.analyses.readings import readings as as_readings
from jointplay.basics import poses
from jointplay.cli import run
from jointplay.result.conclusions import conclude

FITS = json.loads((DATA / "fits.json").read_text())
SEEDS = 6


def names_of(found: Any, wanted: list[str]) -> list[int]:
    """Places of unknowns; a drive that has the name of a dimension is called so."""
    names = found.labels("unknown")
    return [names.index(name if name in names else f"drive {name}") for name in wanted]


@pytest.mark.parametrize(
    ("case", "options"),
    [
        ("four-bar", {"sigma": {"length": 0.001}}),
        ("3-rrr", {"sigma": {"length": 0.001, "angle": 0.001}, "frame": "unknown"}),
    ],
)
def test_it_agrees_with_another_program(case: str, options: dict[str, Any]) -> None:
    """The other program has the frame to first order only, which moves an estimate by a fiftieth of its error."""
    told = FITS[case]
    found = compute(jp.load(DATA / f"{case}.toml"), DATA / f"{case}.csv", **options)
    order = names_of(found, told["parameters"])
    errors = np.array(told["standard_error"])
    assert found.get("standard_error")[order] == pytest.approx(errors, rel=0.01)
    assert np.abs((found.get("estimate")[order] - told["estimate"]) / errors).max() < 0.02
    assert found.attrs["chi_square"] == pytest.approx(told["chi_square"], rel=1e-3)
    assert found.attrs["readings"] == told["readings"]
    assert np.abs((found.get("estimate")[order] - told["truth"]) / errors).max() < 3.5
    assert np.flatnonzero(found.get("left_out")).tolist() == told.get("left_out", [])


@pytest.mark.parametrize("kind", ["five-bar", "6r", "delta"])
def test_a_machine_far_from_its_drawing_has_its_own_standard_errors(kind: str) -> None:
    """Thirty times the tolerances: scipy's `least_squares` on the exact closure has the same estimates and covariance.

    The derivatives of the nominal mechanism give other standard errors there.
    """
    from scipy.optimize import least_squares

    machine = MACHINES[kind]()
    m = machine.m.with_({"joints.*.clearance": None})
    free = {one.name: 30.0 * one.sigma / one.factor for one in unknowns_of(m, {}, ()).unknowns}
    unknowns = unknowns_of(m, free, ())
    every = unknowns.unknowns
    u, rng = m.centre.copy(), np.random.default_rng(0)
    for one in every:
        u[one.parameter] += one.sigma * rng.standard_normal()
    machine = Machine(m, machine.drives, machine.components, machine.sigma)
    table = readings(machine, u, 0)
    found = compute(m, table, sigma=machine.sigma, free=free)

    at, own = at_drives(m, machine.drives), [m.components.index(name) for name in machine.components]
    factors = m.component_factors[own]
    sigma = np.array([machine.sigma["length" if name in "xyz" else "angle"] for name in machine.components]) * factors
    measured = np.column_stack([table[name] for name in machine.components]) * factors

    def missed(x: np.ndarray) -> np.ndarray:
        deviating = m.centre.copy()
        for one, value in zip(every, x, strict=True):
            deviating[one.parameter] = value * one.sigma
        each = (m.core.errors_of(at.drives[k : k + 1], at.poses[k : k + 1], deviating[None]) for k in range(len(at)))
        error = np.concatenate([*each])
        reached = displaced(at.output, error)[:, own]
        away = measured - reached
        if len(own) == 6:
            turned = [poses.quaternion(values[:, 3:]) for values in (measured, reached)]
            away[:, 3:] = poses.rotation_vector(poses.product(turned[0], poses.inverse(turned[1])))
        return np.concatenate([(away / sigma).ravel(), x])

    spread = np.array([one.sigma for one in every])
    start = np.array([u[one.parameter] for one in every]) / spread
    told = least_squares(missed, start, jac="3-point", x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14)
    covariance = np.linalg.inv(told.jac.T @ told.jac) * np.outer(spread, spread)
    errors = np.sqrt(np.diagonal(covariance))
    si = np.array([one.factor for one in every])
    # The other program's differences are exact to some 1e-7 of a singular value.
    assert np.abs((found.get("estimate") * si - told.x * spread) / errors).max() < 1e-4
    assert found.get("standard_error") * si == pytest.approx(errors, rel=1e-5)
    correlated = found.get("covariance") * np.outer(si, si) - covariance
    assert np.abs(correlated / np.outer(errors, errors)).max() < 1e-4
    options: dict[str, Any] = {"frame": "known", "zeroed": (), "sizes": False, "contact": None}
    fitter = fitter_of(unknowns, as_readings(unknowns.m, table, machine.sigma), **options)
    of_drawing = np.sqrt(np.diagonal(fitter.system(np.ones(len(at), dtype=bool)).covariance))
    assert np.abs(of_drawing / errors - 1.0).max() > 0.002


def test_another_package_calibrates_the_same_arm() -> None:
    """Without priors; kinematics, readings and unknowns of pybotics are by Denavit and Hartenberg."""
    pytest.importorskip("pybotics")
    arm = planted_arm(7)
    free = dict.fromkeys(arm.planted)
    found = compute(arm.m, arm.table, sigma={"length": NOISE}, free=free, fix=(FIXED, *arm.m.drives))
    others, residual, apart = by_pybotics(arm)
    assert apart < 1e-9
    assert np.abs(found.get("residual_after") - residual).max() < 1e-6
    assert found.attrs["chi_square"] == pytest.approx((residual**2).sum() / NOISE**2, rel=1e-8)
    values = np.array([others[name] for name in found.labels("unknown")])
    assert np.abs((found.get("estimate") - values) / found.get("standard_error")).max() < 1e-3


def test_pushing_to_and_fro_tells_sums_of_clearances() -> None:
    """Chains of two bodies that carry one force have one sum of plays; no size is told by itself."""
    told = FITS["five-bar-reversal"]
    m = jp.load(DATA / "five-bar-reversal.toml")
    found = compute(m, DATA / "five-bar-reversal.csv", sigma={"length": 0.002}, sizes=True)
    names = found.labels("unknown")
    groups = [[names[k] for k in np.flatnonzero(row)] for row in found.get("together")]
    assert groups == told["groups"]
    assert found.get("alike").all()
    assert found.get("combination_estimate") == pytest.approx(told["sums"], rel=1e-4)
    assert found.get("combination_standard_error") == pytest.approx(told["standard_error"], rel=1e-3)
    assert not found.get("determined")[names_of(found, list("ABCDE"))].any()
    # The file as built has sizes with these sums, whatever each is.
    built = jp.as_built(m, found)
    sizes = {name: built.value(f"joints.{name}.clearance.radial") for name in "ABCDE"}
    sums = [sum(sizes[name] for name in group) for group in groups]
    assert sums == pytest.approx(told["sums"], rel=1e-4)


def test_a_fit_that_does_not_settle_says_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    """Values far outside of their tolerances, of a machine that amplifies play, were called determined."""
    monkeypatch.setattr("jointplay.analyses.calibrate.fit.MOST_STEPS", 1)
    m = jp.load(DATA / "five-bar-reversal.toml")
    found = compute(m, DATA / "five-bar-reversal.csv", sigma={"length": 0.002}, sizes=True)
    assert found.get("status") == "not_settled"
    (sentence,) = conclude(found).sentences
    assert sentence.is_alarm


@pytest.mark.parametrize(("kind", "seed"), [*product(MACHINES, range(SEEDS))])
def test_planted_deviations_are_found(kind: str, seed: int) -> None:
    """No estimate is farther from the truth than its standard error allows; 4.5 of them is once in 150,000."""
    machine = MACHINES[kind]()
    u = specimen(machine.m, seed)
    found = compute(machine.m, readings(machine, u, seed), sigma=machine.sigma)
    away = _away(machine, found, u)
    assert np.abs(away).max() < 4.5
    assert found.get("status") == "ok"
    assert not found.get("left_out").any()


def _away(machine: Machine, found: Any, u: np.ndarray) -> np.ndarray:
    """Estimates less what was planted, in standard errors."""
    every = unknowns_of(machine.m, {}, ()).unknowns
    truth = np.array([u[one.parameter] / one.factor for one in every])
    return (found.get("estimate") - truth) / found.get("standard_error")


@pytest.mark.parametrize("kind", ["four-bar", "3-rrr", "delta", "6r"])
def test_derivatives_are_those_of_the_exact_closure(kind: str) -> None:
    """Against central differences of what is read, distances and dials among them, in a frame that is turned."""
    machine = MACHINES[kind]()
    m = machine.m
    joint = m.joints[0]
    table = readings(machine, m.centre, 0)
    count = len(machine.drives)
    table |= {f"distance:output-{joint}": np.ones(count), "dial:output:1 2" + " 2" * (m.pose_size == 7): np.ones(count)}
    own = as_readings(m, table, {**machine.sigma, "length": 0.001})
    model, turn = ReadingModel(m, own), np.array([0.3, -0.2, 0.5]) * (m.pose_size == 7) + [0, 0, 0.1]
    frame = DeviceFrame(turn, np.array([0.1, 0.2, 0.0]))
    steps = np.where(m.parameter_factors == m.units.length, 1e-6, 1e-6 / m.length)
    columns = np.flatnonzero(np.array(m.source_kinds)[m.parameter_source] != "clearance")[:9]
    # A machine that is off by a third of a degree, or a two-hundredth of its length, and one as it is drawn.
    built = m.centre + 5e3 * steps * np.random.default_rng(0).standard_normal(len(steps)) * ~model.is_play
    for u, some_columns in ((built, columns[::4]), (m.centre, columns)):
        read = model.read(u, frame, of_nominal=u is m.centre)
        for k in some_columns:
            by = steps[k] * (np.arange(len(u)) == k)
            both = [model.read(u + sign * by, frame, derivatives=False) for sign in (1, -1)]
            slope = model.compare(both[0].values, both[1]) / (2.0 * steps[k])
            scale = np.abs(read.by_parameter[:, :, k]).max()
            assert np.abs(slope - read.by_parameter[:, :, k]).max() < 1e-5 * scale
    for k in range(6) if m.pose_size == 7 else (0, 1, 5):
        by = 1e-6 * (np.arange(6) == k)
        both = [model.read(m.centre, frame.moved(sign * by)) for sign in (1, -1)]
        slope = model.compare(both[0].values, both[1]) / 2e-6
        assert np.abs(slope - read.by_frame[:, :, k]).max() < 1e-6


@pytest.mark.parametrize(("kind", "rank"), [("six-axes-pose", 27), ("six-axes-position", 26)])
def test_the_number_of_directions_that_an_arm_tells_is_known(kind: str, rank: int) -> None:
    """With an unknown frame, zeros, links and tool: in general 4 R + 6, of an arm with a parallel pair one less.

    The links are those of Denavit and Hartenberg, which cannot say how parallel axes tilt against each other; of a
    position of the tool another three directions are lost in its orientation, of which two are among the zeros.
    """
    machine = MACHINES["6r"]()
    tool = {"body": "tool", "between": ["flange", "output"], "x": 0.1, "y": 0.1, "z": 0.1}
    m = machine.m.with_({"links.tool": tool})
    rng = np.random.default_rng(1)
    drives = machine.drives[np.arange(48) % 24] + 0.1 * rng.standard_normal((48, 6))
    table = {name: np.degrees(drives[:, k]) for k, name in enumerate(m.drives)}
    found = at_drives(m, drives).output / m.component_factors
    columns = m.components if kind.endswith("pose") else m.components[:3]
    table |= {name: found[:, m.components.index(name)] for name in columns}
    result = compute(m, table, sigma=machine.sigma, frame="unknown")
    singular = result.get("singular_value")
    # Six directions of the frame are taken away, which links and zeros of the first axis can make up for.
    own = int((singular > 1e-9 * singular[0]).sum()) + 6
    assert own == rank
    # Brute force: the rank of all derivatives side by side, those of the frame among them.
    own_table = as_readings(m, table, machine.sigma)
    read = ReadingModel(m, own_table).read(m.centre, DeviceFrame.none())
    deviations = np.flatnonzero(np.array(m.source_kinds)[m.parameter_source] != "clearance")
    columns_ = np.concatenate([read.by_parameter[:, :, deviations], read.by_frame], axis=2)
    rows = columns_.reshape(-1, columns_.shape[2])
    scaled = rows / np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    assert np.linalg.matrix_rank(scaled, tol=1e-9 * np.linalg.norm(scaled, 2)) == rank


def test_what_only_acts_together_is_named() -> None:
    """Against columns whose combinations are known by construction."""
    rng = np.random.default_rng(0)
    a, b, c = rng.standard_normal((3, 20))
    columns = np.column_stack([a, b, a, -2.0 * b, np.zeros(20), c, a + b + c])
    found = combinations(columns)
    assert [[k for k, _ in one.parts] for one in found] == [[4], [0, 2], [1, 3], [0, 1, 5, 6]]
    assert [one.alike for one in found] == [False, True, True, False]
    assert [round(v, 9) for _, v in found[2].parts] == [1.0, -2.0]
    null = np.zeros(7)
    for k, value in found[3].parts:
        null[k] = value
    assert np.abs(columns @ null).max() < 1e-12 * np.abs(columns).max() * np.abs(null).max() * 20


def test_two_drives_of_one_axis_are_a_sum() -> None:
    """A zero of the motor and the angle at which the next joint sits turn the same arm."""
    raw = {
        "format": 1,
        "units": {"length": "mm", "angle": "deg", "force": "N"},
        "joints": {
            "A": {"type": "revolute", "on": {"ground": [0, 0], "arm": [0, 0]}},
            "B": {"type": "fixed", "on": {"arm": [100, 0], "tool": [0, 0]}, "angle": {"tolerance": 0.1}},
        },
        "drives": {"q": {"joint": "A", "from": 0, "to": 90, "count": 5, "error": 0.1}},
        "output": {"body": "tool"},
    }
    m = jp.Mechanism(raw)
    table = {"q": np.degrees(nominal(m).drives[:, 0]), "angle": np.degrees(nominal(m).output[:, 2]) + 0.05}
    found = compute(m, table, sigma={"angle": 0.001})
    names = [found.labels("unknown")[k] for k in np.flatnonzero(found.get("together")[0])]
    assert names == ["B", "q"]
    assert found.get("together")[0] == pytest.approx([1.0, 1.0])
    assert found.get("combination_estimate")[0] == pytest.approx(0.05, abs=1e-4)


def test_a_wrong_row_is_found_out() -> None:
    machine = MACHINES["four-bar"]()
    u = specimen(machine.m, 1)
    table = readings(machine, u, 1)
    clean = compute(machine.m, table, sigma=machine.sigma)
    table["x"] = table["x"].copy()
    table["x"][7] += 0.1
    found = compute(machine.m, table, sigma=machine.sigma)
    assert np.flatnonzero(found.get("left_out")).tolist() == [7]
    # What the others say of the row is what they would say without it.
    assert found.get("residual_after")[7, 0] == pytest.approx(0.1 + clean.get("residual_without")[7, 0], abs=2e-3)
    assert np.abs((found.get("estimate") - clean.get("estimate")) / clean.get("standard_error")).max() < 1.0


def test_more_wrong_rows_than_a_tenth_are_not_left_out() -> None:
    machine = MACHINES["four-bar"]()
    table = readings(machine, specimen(machine.m, 2), 2)
    table["x"] = table["x"] + 0.05 * (np.arange(24) % 6 == 0)
    found = compute(machine.m, table, sigma=machine.sigma)
    assert found.get("status") == "many_missed"
    assert not found.get("left_out").any()
    # What does not fit determines nothing: the answer began with "4 of 4 deviations are determined".
    assert conclude(found).sentences[0].is_alarm


def test_the_load_has_to_be_said() -> None:
    """Play that a load presses to one side is no scatter: read so, deviations are found; else the fit is too good."""
    m = MACHINES["five-bar"]().m.with_({"loads": [{"force": [3, -15]}]})
    machine = Machine(m, nominal(m).drives, ("x", "y"), {"length": 0.001})
    u = specimen(m, 5)
    at = nominal(m)
    sources = [
        s.as_spec if s.kind == "clearance" else {**s.as_spec, "centre": u[m.parameter_source == k].tolist()}
        for k, s in enumerate(m.compiled_sources)
    ]
    pressed = m.varied(sources=sources).loaded(at.drives, at.poses)
    places = displaced(at.output, pressed["error"])
    noise = np.random.default_rng(3).standard_normal((len(places), 2)) * 1e-6
    table: dict[str, Any] = {name: np.degrees(at.drives[:, k]) for k, name in enumerate(m.drives)}
    table |= {name: (places[:, k] + noise[:, k]) * 1e3 for k, name in enumerate("xy")}
    said = compute(m, table, sigma=machine.sigma)
    assert said.attrs["contact"] == "loaded"
    assert np.abs(_away(machine, said, u)).max() < 4.5
    assert 0.001 < said.attrs["p_value"] < 0.999
    unsaid = compute(m, table, sigma=machine.sigma, contact="scattered")
    assert unsaid.attrs["p_value"] > 0.999


def test_friction_counts_where_the_side_is_said() -> None:
    """A slider-crank whose pin rubs comes from both sides: planted deviations are found as `loaded` has it there."""
    m = jp.loads(jp.examples.text("slider-crank")).with_(
        {"joints.wristpin.friction": {"coefficient": 0.2, "diameter": 20}}
    )
    m = m.with_({"drives.theta.count": 7})
    planted = {"drives.theta.deviation": 0.03, "dimensions.rod.deviation": -0.02}
    built, rng = m.with_(planted), np.random.default_rng(2)
    table: dict[str, Any] = {name: [] for name in ("configuration", "side", "x", "y", "angle")}
    for side in ("forward", "backward"):
        there = jp.loaded(built, approach=side)
        places = (there.nominal + there.error).values + 1e-4 * rng.standard_normal((7, 3))
        for row in zip(range(7), [side] * 7, *places.T, strict=True):
            for name, value in zip(table, row, strict=True):
                table[name].append(value)
    found = compute(m, table, sigma={"length": 1e-4, "angle": 1e-4}, fix=("stroke",))
    assert found.labels("unknown") == ["rod", "theta"]
    assert np.abs((found.get("estimate") - [-0.02, 0.03]) / found.get("standard_error")).max() < 4.5
    assert 1e-3 < found.attrs["p_value"] < 1.0 - 1e-3
    # From rising drive values the crank comes forward along this path.
    rising = {name: values[:7] for name, values in table.items() if name != "configuration"}
    rising["theta"] = np.degrees(nominal(m).drives[:, 0]).tolist()
    own = ReadingModel(m, as_readings(m, rising, {"length": 1e-4, "angle": 1e-4}))
    forward = ReadingModel(m, as_readings(m, {k: v[:7] for k, v in table.items()}, {"length": 1e-4, "angle": 1e-4}))
    assert np.abs(own.read(m.centre).values - forward.read(m.centre).values).max() < 1e-12
    # Readings without a side are of a mechanism that has settled, and these do not fit it.
    settled = compute(m, {**table, "side": [""] * 14}, sigma={"length": 1e-4, "angle": 1e-4}, fix=("stroke",))
    assert settled.get("status") != "ok"


def test_an_unknown_frame_is_found_however_far_it_is() -> None:
    machine = MACHINES["delta"]()
    m = machine.m
    u = specimen(m, 4)
    table = readings(machine, u, 4)
    turn, shift = np.array([0.5, 1.2, -2.0]), np.array([300.0, -50.0, 900.0])
    places = np.column_stack([table[axis] for axis in "xyz"]) @ poses.turned_by(turn).T + shift
    table |= dict(zip("xyz", places.T, strict=True))
    found = compute(m, table, sigma=machine.sigma, frame="unknown")
    assert np.abs(_away(machine, found, u)).max() < 4.5
    away = np.concatenate([shift - found.get("frame")[:3], np.degrees(turn) - found.get("frame")[3:]])
    assert np.abs(away / found.get("frame_standard_error")).max() < 4.5
    with pytest.raises(jp.InputError, match="axes of its own"):
        compute(m, table, sigma=machine.sigma)


@pytest.mark.parametrize("kind", ["3-rrr", "delta"])
def test_what_the_best_fit_of_a_frame_leaves(kind: str) -> None:
    """Against exact paths of machines that are drawn from what the readings leave open, each fitted by Procrustes.

    The frame of the device is unknown, so that the absolute place is lost.
    """
    from scipy.spatial.transform import Rotation

    machine = MACHINES[kind]()
    m = machine.m.with_({"joints.*.clearance": None})
    machine = Machine(m, machine.drives, machine.components, machine.sigma)
    u = specimen(m, 3)
    found = compute(m, readings(machine, u, 3), sigma=machine.sigma, frame="unknown")
    every = unknowns_of(m, {}, ()).unknowns
    si, columns = np.array([one.factor for one in every]), [one.parameter for one in every]
    fitted = m.centre.copy()
    fitted[columns] = found.get("fitted") * si
    at, rng = nominal(m), np.random.default_rng(0)
    axes = sum(name in "xyz" for name in m.components)
    drawn = np.tile(fitted, (200, 1))
    drawn[:, columns] = rng.multivariate_normal(fitted[columns], found.get("covariance") * np.outer(si, si), 200)

    def path(rows: np.ndarray) -> np.ndarray:
        each = [m.core.errors_of(at.drives[k : k + 1], at.poses[k : k + 1], rows) for k in range(len(at))]
        return at.output[:, None, :axes] + np.array(each)[:, :, :axes]

    middle, squares = path(fitted[None])[:, 0], np.zeros(2)
    for own in np.moveaxis(path(drawn), 1, 0):
        padded = [np.pad(places - places.mean(axis=0), ((0, 0), (0, 3 - axes))) for places in (own, middle)]
        turn = Rotation.align_vectors(*padded)[0]
        squares += [
            ((own - middle) ** 2).sum(axis=1).mean(),
            ((padded[0] - turn.apply(padded[1])) ** 2).sum(axis=1).mean(),
        ]
    absolute, best = np.sqrt(squares / 200) / m.units.length
    # Standard deviations of 200 machines are known to a twentieth.
    assert float(found.get("position_after")) == pytest.approx(absolute, rel=0.2)
    assert float(found.get("best_fit_after")) == pytest.approx(best, rel=0.2)
    assert best < 0.6 * absolute
    assert "after the best fit of its frame" in " ".join(sentence.text for sentence in conclude(found).sentences)


def test_distances_and_dials_that_count_from_an_unknown_zero() -> None:
    """A ball bar from a pin of the ground to the tool, and a dial at the tool, computed here from exact poses."""
    machine = MACHINES["five-bar"]()
    m = machine.m
    u = specimen(m, 6)
    places = actual(m, machine.drives, u, 60)[:, :2]
    rng = np.random.default_rng(6)
    # The pin A of the ground is at (-45, 0), and no deviation moves it: the base moves E.
    bar = np.linalg.norm(places - [-0.045, 0.0], axis=1) + 2e-6 * rng.standard_normal(len(places))
    dial = places @ [0.6, 0.8] + 2e-6 * rng.standard_normal(len(places))
    table: dict[str, Any] = {name: np.degrees(machine.drives[:, k]) for k, name in enumerate(m.drives)}
    table |= {"distance:A-output [um]": bar * 1e6, "dial:output:0.6 0.8 [mm]": (dial - dial[0]) * 1e3}
    name = "dial:output:0.6 0.8"
    found = compute(m, table, sigma={"length": 0.002}, zeroed=(name,))
    assert np.abs(_away(machine, found, u)).max() < 4.5
    zero, error = (float(found.get(one)[1]) for one in ("zero", "zero_standard_error"))
    assert abs(zero + dial[0] * 1e3) < 4.5 * error
    assert found.get("share_determined").max() > 0.9


def test_readings_of_one_approach_share_their_play() -> None:
    """Ten readings without moving in between tell hardly more than one: the play is that of one approach."""
    machine = MACHINES["four-bar"]()
    u = specimen(machine.m, 8)
    single = readings(machine, u, 8)
    rng = np.random.default_rng(8)
    rows = np.repeat(np.arange(24), 10)
    table = {name: np.asarray(column)[rows] for name, column in single.items()}
    for name in ("x", "y"):
        table[name] = table[name] + 1e-4 * rng.standard_normal(240)
    together = compute(machine.m, {**table, "approach": rows}, sigma={"length": 1e-4})
    once = compute(machine.m, single, sigma={"length": 1e-4})
    apart = compute(machine.m, {**table, "approach": np.arange(240)}, sigma={"length": 1e-4})
    errors = [one.get("standard_error")[0] for one in (once, together, apart)]
    assert 0.95 < errors[1] / errors[0] <= 1.0
    assert errors[2] < 0.5 * errors[0]
    # Their scatter within an approach is the noise.
    automatic = compute(machine.m, {**table, "approach": rows}, sigma="auto")
    assert automatic.get("standard_error") == pytest.approx(together.get("standard_error"), rel=0.05)


def test_rows_that_are_held_out_are_predicted() -> None:
    machine = MACHINES["3-rrr"]()
    u = specimen(machine.m, 3)
    found = compute(machine.m, readings(machine, u, 3), sigma=machine.sigma, hold_out=0.2, seed=1)
    assert found.get("held_out").sum() == 6
    free = found.attrs["held_out_degrees_of_freedom"]
    assert free == 18
    # Within 4.5 standard deviations of a chi square.
    assert abs(float(found.attrs["held_out_chi_square"]) - 18.0) < 4.5 * 6.0


@pytest.mark.parametrize("kind", ["four-bar", "delta", "6r"])
def test_the_file_as_built_is_this_machine(kind: str) -> None:
    """Its nominal error is what was found; what is left open scatters in `random` as the covariance says."""
    machine = MACHINES[kind]()
    m = machine.m
    found = compute(m, readings(machine, specimen(m, 9), 9), sigma=machine.sigma)
    built = jp.as_built(m, found)
    deviations = dict(zip(found.labels("unknown"), found.get("estimate").tolist(), strict=True))
    given = jp.given(built)
    wanted = jp.given(m, deviations=deviations)
    # Estimates are written with three digits of their standard error.
    assert np.abs(given.error.values - wanted.error.values).max() < 0.02 * float(found.get("position_after"))
    left = jp.as_built(m, found, posterior=True)
    scatter = jp.random(left.with_({"joints.*.clearance": None}), samples=64, law=None)
    for name, part in (("x", 0), ("y", 1)):
        assert scatter.error_std_first_order.sel(component=name).values == pytest.approx(
            found.get("output_after")[:, part], rel=0.15
        )


@pytest.mark.parametrize("posterior", [False, True])
def test_copies_of_a_pattern_have_deviations_of_their_own(posterior: bool) -> None:
    """The pattern stays, with a table of values, and is the machine that was found."""
    machine = MACHINES["3-rrr"]()
    m = machine.m
    found = compute(m, readings(machine, specimen(m, 2), 2), sigma=machine.sigma)
    built = jp.as_built(m, found, posterior=posterior)
    text = built.text("built.toml")
    assert "[patterns.leg]" in text
    assert 'deviation = "Lu_deviation"' in text
    known = dict(zip(found.labels("unknown"), found.get("estimate").tolist(), strict=True))
    assert built.value("patterns.leg.values.Lu_deviation") == pytest.approx(
        [known[f"Lu_{k}"] for k in (1, 2, 3)], abs=1e-4
    )
    deviations = dict(zip(built.parameters, built.centre / built.parameter_factors, strict=True))
    for k in (1, 2, 3):
        assert deviations[f"q_{k}.value"] == pytest.approx(known[f"q_{k}"], abs=1e-4)
    if posterior:
        scatter = jp.random(built.with_({"patterns.leg.joints.*.clearance": None}), samples=64)
        left = scatter.error_std_first_order.values
        assert left == pytest.approx(found.get("output_after"), rel=0.05)


def test_what_is_freed_has_no_prior_and_what_is_fixed_stays() -> None:
    machine = MACHINES["four-bar"]()
    m = machine.m.with_({"drives.theta.error": None, "dimensions.crank.tolerance": None})
    at = at_drives(m, machine.drives)
    error = jp.given(machine.m, deviations={"theta": 3.0, "crank": 0.4}).error.values[:, :2]
    table = {"theta": np.degrees(machine.drives[:, 0])}
    table |= {name: at.output[:, k] * 1e3 + error[:, k] for k, name in enumerate("xy")}
    found = compute(m, table, sigma={"length": 0.01}, free={"theta": None, "dimensions.crank": 2.0}, fix=("r*",))
    assert found.labels("unknown") == ["crank", "coupler", "theta"]
    known = dict(zip(found.labels("unknown"), found.get("estimate").tolist(), strict=True))
    assert known["theta"] == pytest.approx(3.0, abs=0.01)
    assert known["crank"] == pytest.approx(0.4, abs=0.01)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x": lambda x: x / 25.4}, "in in, not mm|are in in"),
        ({"x": lambda x: -x}, "x has the other sign"),
        ({"theta": np.radians}, "drive values are in rad, not deg"),
        ({"x": lambda x: 1.1 * x + np.arange(24)}, "is it this machine"),
    ],
)
def test_a_slip_in_a_column_is_named_and_another_machine_refused(change: dict[str, Any], message: str) -> None:
    machine = MACHINES["four-bar"]()
    table = readings(machine, machine.m.centre, 0)
    table |= {name: slip(table[name]) for name, slip in change.items()}
    with pytest.raises(jp.InputError, match=message):
        compute(machine.m, table, sigma=machine.sigma)


def test_stiffnesses_are_found_where_loads_tell_them() -> None:
    """An arm of two drives that wind up, measured without a load and with two; planted numbers are found."""
    raw: dict[str, Any] = {
        "format": 1,
        "units": {"length": "mm", "angle": "deg", "force": "N"},
        "joints": {
            "A": {"type": "revolute", "on": {"ground": [0, 0], "arm": [0, 0]}},
            "B": {"type": "revolute", "on": {"arm": [200, 0], "tip": [0, 0]}},
        },
        "drives": {
            "q": {"joint": "A", "values": [0, 20, 40, 60, 80], "stiffness": 1000.0, "error": 0.1},
            "p": {"joint": "B", "values": [0], "stiffness": 900.0, "error": 0.1},
        },
        "output": {"body": "tip", "at": [100, 0]},
        "load_cases": {
            "down": [{"body": "tip", "at": [100, 0], "force": [0, -100]}],
            "side": [{"body": "tip", "at": [100, 0], "force": [100, 0]}],
        },
    }
    m = jp.Mechanism(raw)
    planted = {"drives.q.stiffness": 1100.0, "drives.p.stiffness": 1000.0}
    zeros = {"drives.q.deviation": 0.03, "drives.p.deviation": -0.05}
    built = m.with_({**planted, **zeros})
    noise, table = np.random.default_rng(0), {name: [] for name in ("q", "p", "x", "y", "load_case")}
    for case in ("", "down", "side"):
        part = built.only(load_case=case) if case else built.without_load_cases()
        there = jp.loaded(part) if case else jp.given(part)
        places = (there.nominal + there.error).values[:, :2] + 0.002 * noise.standard_normal((5, 2))
        for q, (x, y) in zip((0, 20, 40, 60, 80), places.tolist(), strict=True):
            for name, value in zip(table, (q, 0.0, x, y, case), strict=True):
                table[name].append(value)
    free = {"drives.q.stiffness": None, "drives.p.stiffness": 200.0}
    found = compute(m, table, sigma={"length": 0.002}, free=free)
    truth = [0.03, -0.05, 1100.0, 1000.0]
    assert np.abs((found.get("estimate") - truth) / found.get("standard_error")).max() < 4.5
    assert found.get("standard_error")[2:].max() < 2.0
    assert jp.as_built(m, found).value("drives.q.stiffness") == pytest.approx(1100.0, abs=2.0)


def test_drives_that_do_not_come_back_to_the_same_place() -> None:
    """`error` of a drive is that of its zero; how it scatters from approach to approach is a standard deviation."""
    machine = MACHINES["four-bar"]()
    m = machine.m.with_({"joints.*.clearance": None})
    away, unsaid = [], []
    for seed in range(6):
        u = specimen(m, seed)
        rng = np.random.default_rng([5, seed])
        off = machine.drives + np.radians(0.05) * rng.standard_normal(machine.drives.shape)
        places = actual(m, off, u, seed)[:, :2] + 1e-6 * rng.standard_normal((24, 2))
        table: dict[str, Any] = {"theta": np.degrees(machine.drives[:, 0])}
        table |= {name: places[:, k] * 1e3 for k, name in enumerate("xy")}
        found = compute(m, table, sigma={"length": 0.001, "theta": 0.05})
        away.append(_away(Machine(m, machine.drives, ("x", "y"), {}), found, u))
        unsaid.append(compute(m, table, sigma={"length": 0.001}).get("status"))
    assert np.abs(away).max() < 4.5
    # 24 numbers of size one.
    assert 0.5 < np.sqrt(np.mean(np.square(away))) < 1.5
    assert {"doubtful", "many_missed"} >= {*map(str, unsaid)}


def test_a_play_of_nothing_is_not_less_than_nothing() -> None:
    """Readings with noise of pins without play: sizes stay at zero, and the fit settles there."""
    m = jp.load(DATA / "five-bar-reversal.toml")
    tight = m.with_({"joints.*.clearance.radial": 1e-9})
    noise, table = np.random.default_rng(4), {name: [] for name in ("left", "right", "load_case", "x", "y")}
    for case in m.load_cases:
        there = jp.loaded(tight.only(load_case=case), details=False)
        places = (there.nominal + there.error).values[:, :2] + 0.002 * noise.standard_normal((25, 2))
        for row in zip(there.left.values, there.right.values, [case] * 25, *places.T, strict=True):
            for name, value in zip(table, row, strict=True):
                table[name].append(value)
    found = compute(m, table, sigma={"length": 0.002}, sizes=True)
    sizes = found.get("fitted")[names_of(found, list("ABCDE"))]
    assert sizes.min() >= 0.0
    # A sum is zero, or as far above as its standard error lets it be.
    assert sizes[:2].sum() < 4.5 * found.get("combination_standard_error")[0]
    assert found.get("status") == "ok"


def test_the_command_writes_the_machine_and_says_whether_readings_fit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib")
    out, figure = tmp_path / "built.toml", tmp_path / "fit.svg"
    words = ["calibrate", str(DATA / "four-bar.toml"), "--measured", str(DATA / "four-bar.csv")]
    more = ["-o", str(out), "--plot", str(figure)]
    assert run([*words, "--sigma", "length=0.001", *more]) == 0
    said = capsys.readouterr()
    assert "4 of 4 deviations are determined (less than half of the variance is left)" in said.out
    assert not said.err
    built, drawn = jp.load(out), (DATA / "four-bar.toml").read_text(encoding="utf-8")
    assert built.value("drives.theta.deviation") == pytest.approx(-0.029859)
    # What has not changed stays as it was typed.
    kept = [line for line in drawn.splitlines() if not line.startswith("title")]
    assert [line for line in out.read_text(encoding="utf-8").splitlines() if line in kept] == kept
    assert figure.read_text(encoding="utf-8").rstrip().endswith("</svg>")
    # What cannot be written is said alone, before any answer, and nothing that is read is replaced.
    table = tmp_path / "readings.csv"
    table.write_bytes((DATA / "four-bar.csv").read_bytes())
    own = ["calibrate", str(out), "--measured", str(table), "--sigma", "length=0.001", "-o"]
    for place, message in (
        ("fit.pdf", "known: .toml, .nc"),
        (str(out), "is a file that is read"),
        (str(table), "is a file that is read"),
    ):
        assert run([*own, place]) == 2
        refused = capsys.readouterr()
        assert message in refused.err
        assert not refused.out
    assert table.read_bytes() == (DATA / "four-bar.csv").read_bytes()
    assert run([*words, "--sigma", "component=0.001"]) == 2
    assert "'component' is not a measured column; known: x, y, length" in capsys.readouterr().err
    assert run(words) == 2
    assert "is missing: give x=VALUE or length=VALUE, a column 'sigma_x'" in capsys.readouterr().err
    # Without play the readings scatter more than their noise lets them.
    tight = ["-s", "joints.*.clearance.radial=0"]
    assert run([*words, "--sigma", "length=0.001", *tight]) == 1
    assert "p = " in capsys.readouterr().out


def test_sizes_are_found_where_nothing_else_is_unknown() -> None:
    cos, sin = np.cos(np.radians([0.0, 0.0, 1.0, 1.0])), np.sin(np.radians([0.0, 0.0, 1.0, 1.0]))
    sides = 0.02 * np.array([1.0, -1.0, 1.0, -1.0])
    x, y = (100.0 * cos + sides).tolist(), (100.0 * sin).tolist()
    table = {"configuration": [0, 0, 1, 1], "load_case": ["push", "pull"] * 2, "x [mm]": x, "y [mm]": y}
    found = jp.calibrate(PUSHED, table, sigma={"length": 1e-4}, sizes=True, frame="known")
    assert found.fitted.values == pytest.approx([0.02], abs=1e-3)
    assert found.output_after.values == pytest.approx(0.0, abs=1e-12)
