"""Dimensions that are found against closed forms, and against all points of grids."""

import itertools
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from jointplay.analyses.design import compute
from jointplay.analyses.nominal import Interrupted
from jointplay.cli import run

#: threads of linear algebra in this process
BEGUN_WITH = {name: os.environ.get(name) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}

#: play times length, and error of the drive: the worst error of the lever is PLAY / a + 2 a sin(ERROR / 2)
PLAY, ERROR = 1.0, 0.01
SLOPE = 2.0 * np.sin(0.5 * ERROR)


def lever(**more: Any) -> jp.Mechanism:
    """A lever of length a on a pin whose play is PLAY / a, turned by a drive that is off by ERROR."""
    raw = {
        "format": 1,
        "units": {"length": "mm", "angle": "rad", "force": "N"},
        "variables": {"a": 20.0},
        "joints": {
            "J": {
                "type": "revolute",
                "on": {"ground": [0, 0], "arm": [0, 0]},
                "clearance": {"radial": f"{PLAY} / a"},
            }
        },
        "drives": {"turn": {"joint": "J", "values": [0.0, 1.0], "error": ERROR}},
        "output": {"body": "arm", "at": ["a", 0]},
        **more,
    }
    return jp.Mechanism(raw)


def of_lever(a: float) -> float:
    return PLAY / a + SLOPE * a


def test_the_least_worst_error_of_a_lever_by_its_closed_form() -> None:
    found = jp.design(lever(), {"variables.a": [2, 40]}, "worst_position", evaluations=60)
    best = np.sqrt(PLAY / SLOPE)
    # At a minimum the value is known twice as well as the place; places are rounded, too.
    assert found.value_found.item() == pytest.approx(best, abs=1e-2)
    assert found.aim_found.item() == pytest.approx(2.0 * np.sqrt(PLAY * SLOPE), rel=1e-6)
    assert found.aim_before.item() == pytest.approx(of_lever(20.0), rel=1e-6)
    assert found.status.item() == "ok"
    # How flat it is, by the quadratic equation p / a + s a = (1 + loss) 2 sqrt(p s).
    for k, loss in enumerate(found.loss.values):
        root = np.sqrt((1.0 + loss) ** 2 - 1.0)
        expected = best * ((1.0 + loss) + np.array([-root, root]))
        np.testing.assert_allclose(found.tolerated.values[0, k], expected, rtol=0.01)


def test_values_have_no_digits_that_bring_nothing() -> None:
    """On the edge of a largest value some digits more are needed than on its floor, not all of them."""
    m = jp.loads(jp.examples.text("straight-line"))
    found = jp.design(m, {"variables.arm": [120, 130]}, "structural", evaluations=20)
    assert found.value_found.item() == round(found.value_found.item(), 8)
    assert jp.plot.held(found).axes[0].get_xlabel() == "used [%]"


def test_a_limit_that_binds_by_its_closed_form() -> None:
    """The smallest lever whose worst error is 0.3: the smaller root of a quadratic equation."""
    m = lever(limits={"position": 0.3})
    found = jp.design(m, {"variables.a": [2, 40]}, "size", evaluations=60)
    root = (0.3 - np.sqrt(0.09 - 4.0 * PLAY * SLOPE)) / (2.0 * SLOPE)
    assert found.value_found.item() == pytest.approx(root, rel=1e-4)
    assert found.binding.sel(held="limits.position").item()
    assert found.used.sel(held="limits.position").item() <= 1.0
    better = m.with_({"variables.a": found.value_found.item()})
    assert jp.worst(better).limit_met.all()


def test_what_holds_to_first_order_alone_is_not_where_it_ends() -> None:
    """Along a lever its drive moves the end by the second order only: the limit binds at another length."""
    limit, bent = 0.1, 1.0 - np.cos(ERROR)
    turned = {"turn": {"joint": "J", "values": [0.0], "error": ERROR}}
    m = lever(drives=turned, limits={"x": [-limit, limit]})
    found = jp.design(m, {"variables.a": [2, 40]}, "size", evaluations=60)
    root = (limit - np.sqrt(limit**2 - 4.0 * bent * PLAY)) / (2.0 * bent)
    assert found.status.item() == "ok"
    assert found.value_found.item() == pytest.approx(root, rel=1e-4)
    assert found.used.sel(held="limits.x").item() == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(("bounds", "now"), [((8.3, 12.9), 8.3), ((12.7, 15.1), 15.1)])
def test_the_value_of_the_file_may_be_a_bound(bounds: tuple[float, float], now: float) -> None:
    m = lever(variables={"a": now})
    found = jp.design(m, {"variables.a": [*bounds]}, "worst_position", evaluations=20)
    assert found.value_found.item() == pytest.approx(np.clip(np.sqrt(PLAY / SLOPE), *bounds), abs=1e-2)


def test_a_bound_with_many_digits_is_kept() -> None:
    found = jp.design(lever(), {"variables.a": [12.345651, 40]}, "worst_position", evaluations=40)
    assert found.value_found.item() == 12.345651
    assert found.at_bound.item() == "lowest"


def test_a_weighted_sum_by_its_closed_form() -> None:
    """The box is that of the pin and both tips: a (1, sin 1) large."""
    diagonal = np.hypot(1.0, np.sin(1.0))
    found = jp.design(lever(), {"variables.a": [2, 40]}, {"worst_position": 1.0, "size": 0.02}, evaluations=60)
    assert found.value_found.item() == pytest.approx(np.sqrt(PLAY / (SLOPE + 0.02 * diagonal)), abs=1e-2)
    assert found.aim_found.sel(aim="size").item() == pytest.approx(diagonal * found.value_found.item(), rel=1e-6)


def test_a_front_lies_on_its_curve() -> None:
    found = jp.design(lever(), {"variables.a": [2, 40]}, ["worst_position", "size"], evaluations=40, points=7)
    a = found.front_value.values[:, 0]
    np.testing.assert_allclose(found.front_aim.sel(aim="worst_position"), of_lever(a), rtol=1e-6)
    # From the shortest lever to that with the least error, in equal steps of the size.
    assert a.min() == pytest.approx(2.0, rel=1e-3)
    assert a.max() == pytest.approx(np.sqrt(PLAY / SLOPE), rel=5e-3)
    steps = np.diff(np.sort(found.front_aim.sel(aim="size").values))
    assert len(a) == 7
    np.testing.assert_allclose(steps, steps.mean(), rtol=0.02)
    assert found.front_aim.values.tolist() == sorted(found.front_aim.values.tolist())


def test_a_front_along_a_limit_that_binds_otherwise_than_to_first_order() -> None:
    """The play c / a takes what the turn leaves of the limit: c = a (limit - a bent); the torque falls with c."""
    limit, bent = 0.1, 1.0 - np.cos(ERROR)
    m = lever(
        variables={"a": 20.0, "c": 1.0},
        joints={
            "J": {"type": "revolute", "on": {"ground": [0, 0], "arm": [0, 0]}, "clearance": {"radial": "c / a"}},
        },
        drives={"turn": {"joint": "J", "values": [0.0], "error": ERROR}},
        loads=[{"force": [0, 1], "at": ["40 - 10 * c", 0]}],
        limits={"x": [-limit, limit]},
    )
    vary = {"variables.a": [5, 40], "variables.c": [0.2, 3]}
    found = jp.design(m, vary, ["size", "drive_force"], evaluations=60, points=5)
    a, c = found.front_value.values.T
    assert len(a) == 5
    np.testing.assert_allclose(c, a * (limit - a * bent), rtol=1e-4)


def test_a_load_that_leaves_play_open_makes_no_error_small() -> None:
    """A load along a guide presses no corner of it; it may be at each, as it is pressed to one by a load beside it."""
    gap, length, reach, pin = 0.02, 30.0, 50.0, 0.02
    guide = {"on": {"arm": {"at": [100, 0], "axis": [1, 0]}, "rod": {"at": [0, 0], "axis": [1, 0]}}}
    m = lever(
        units={"length": "mm", "angle": "deg", "force": "N"},
        variables={"beside": 10.0},
        joints={
            "J": {"type": "revolute", "on": {"ground": [0, 0], "arm": [0, 0]}, "clearance": {"radial": pin}},
            "guide": {"type": "prismatic", "clearance": {"gap": gap, "length": length}, **guide},
        },
        drives={"turn": {"joint": "J", "values": [0.0]}, "reach": {"joint": "guide", "values": [10.0]}},
        output={"body": "rod", "at": [reach, 0]},
        loads=[{"force": [-10, 0], "at": [reach, "beside"]}],
    )
    found = jp.design(m, {"variables.beside": {"values": [-10, 0, 10]}}, "loaded_position", evaluations=20)
    tilted = gap / (0.5 * length)
    assert found.aim_found.item() == pytest.approx(np.hypot(pin, reach * np.sin(tilted)), rel=1e-3)
    turned = jp.design(m, {"variables.beside": {"values": [-10, 0, 10]}}, "loaded_rotation", evaluations=20)
    assert turned.aim_found.item() == pytest.approx(np.degrees(tilted), rel=1e-3)


def test_a_catalogue() -> None:
    sizes = [4.0, 7.0, 9.0, 12.5, 16.0, 30.0]
    found = jp.design(lever(), {"variables.a": {"values": sizes}}, "worst_position", evaluations=50)
    assert found.value_found.item() == min(sizes, key=of_lever)
    stepped = jp.design(lever(), {"variables.a": {"from": 3, "to": 30, "step": 1.5}}, "worst_position", evaluations=60)
    assert stepped.value_found.item() == min(np.arange(3.0, 31.0, 1.5), key=of_lever)


BRUTE: Mapping[str, tuple[str, Mapping[str, Sequence[float]], int]] = {
    "four-bar": ("worst_position", {"joints.J4.on.ground.0": (-115, -90)}, 26),
    "slider-crank": ("worst_position", {"joints.wristpin.on.rod.0": (90, 200)}, 23),
    "p3r": ("worst_position", {"joints.J3.on.ground.0": (-200, -100), "joints.J3.on.ground.1": (-100, 0)}, 6),
    "serial-2r": ("worst_position", {}, 5),
}


@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "p3r", "serial-2r"])
def test_no_point_of_a_grid_is_better(name: str) -> None:
    aim, vary, count = BRUTE[name]
    m = jp.loads(jp.examples.text(name))
    vary = vary or {"output.at.0": (m.value("output.at.0") * 0.5, m.value("output.at.0") * 1.5)}
    found = jp.design(m, dict(vary), aim, evaluations=60)
    axes = [np.linspace(*ends, count) for ends in vary.values()]
    best = np.inf
    for values in itertools.product(*axes):
        worst = jp.worst(m.with_(dict(zip(vary, values, strict=True))), starts=4)
        if (worst.status == "ok").all():
            best = min(best, worst.worst_position.max().item())
    assert found.aim_found.item() <= best * (1.0 + 1e-4)
    exact = jp.worst(m.with_(dict(zip(vary, found.value_found.values.tolist(), strict=True))))
    assert found.aim_found.item() == pytest.approx(exact.worst_position.max().item(), rel=1e-9)
    assert found.aim_found.item() <= found.aim_before.item()


def priced(**changes: Any) -> jp.Mechanism:
    costs = {"J*": {"model": "reciprocal", "b": 1.0, "from": 0.001, "to": 5.0}}
    m = jp.loads(jp.examples.text("four-bar"))
    return m.with_({"limits.position": 1.0, "drives.theta1.values": [76.39], "costs": costs, **changes})


def test_the_cheapest_sizes_are_found_with_every_dimension() -> None:
    """Whatever the sizes in the file are, which miss the limits."""
    m, key = priced(), "joints.J4.on.ground.0"
    found = jp.design(m, {key: [-130, -100]}, "cost", evaluations=16)
    grid = [jp.allocate(m.with_({key: x}), digits=12).total_cost.item() for x in (-130.0, -115.0, -110.0, -100.0)]
    assert found.aim_found.item() <= min(grid) * 1.01
    assert found.aim_before.item() == pytest.approx(grid[-1], rel=1e-9)
    assert found.aim_found.item() < grid[-1]
    again = jp.allocate(m.with_({key: found.value_found.item()}), digits=12)
    assert found.aim_found.item() == pytest.approx(again.total_cost.item(), rel=1e-9)
    assert found.status.item() == "ok"
    # Limits that no sizes hold are no design.
    none = jp.design(priced(**{"limits.position": 1e-4}), {key: [-130, -100]}, "cost", evaluations=4)
    assert none.status.item() == "infeasible"
    assert none.used.sel(held="limits").item() > 1.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"costs": None}, "costs: no source has a cost"),
        ({"limits": None}, "limits: no limit of the error"),
        ({"design.question": "loaded"}, "design.question: cost: sizes are chosen for the worst case"),
    ],
)
def test_a_cost_needs_costs_and_limits(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(jp.InputError, match=words):
        jp.design(priced(**changes), {"joints.J4.on.ground.0": [-130, -70]}, "cost", evaluations=4)


def test_the_pivot_of_the_slider_driven_linkage() -> None:
    """Within 100 mm of where it is, another pivot takes 4.436 mm to 2.504 mm or less."""
    vary = {"joints.J3.on.ground.0": [-200, 0], "joints.J3.on.ground.1": [-100, 100]}
    found = jp.design(jp.loads(jp.examples.text("p3r")), vary, "worst_position", evaluations=150)
    assert found.aim_before.item() == pytest.approx(4.436, abs=1e-3)
    assert found.aim_found.item() <= 2.51


def test_a_straight_line_is_straighter() -> None:
    m = jp.loads(jp.examples.text("straight-line"))
    found = jp.design(m, aim="structural", evaluations=100)
    points = jp.solve(m.with_(dict(zip(found.variable.values, found.value_found.values.tolist(), strict=True))))
    x, y = points.nominal.sel(component=["x", "y"]).values.T
    angles = np.linspace(-0.05, 0.05, 2001)
    brute = 0.5 * np.ptp(np.outer(x, -np.sin(angles)) + np.outer(y, np.cos(angles)), axis=0).min()
    assert found.aim_found.item() == pytest.approx(brute, rel=0.02)
    assert found.aim_found.item() < 0.5 * found.aim_before.item()


def test_transmission_angles_by_the_law_of_cosines() -> None:
    m = jp.loads(jp.examples.text("four-bar")).with_({"design.transmission": {"J3": 30}})
    found = jp.design(m, {"joints.J4.on.ground.0": [-101, -100]}, "worst_position", evaluations=5)
    theta = np.radians(m.with_({}).value("drives.theta1.values"))
    across = np.hypot(75.0 * np.cos(theta) + 100.0, 75.0 * np.sin(theta))
    angle = np.degrees(np.arccos((75.0**2 + 150.0**2 - across**2) / (2.0 * 75.0 * 150.0)))
    acute = np.minimum(angle, 180.0 - angle)
    assert found.used_before.sel(held="design.transmission.J3").item() == pytest.approx(30.0 / acute.min(), rel=1e-9)


def test_ranges_and_tolerance_are_used_as_they_say() -> None:
    m = jp.loads(jp.examples.text("p3r"))
    solved = jp.solve(m)
    travel = solved.coordinate.sel(joint="J3").values
    low, high = travel.min() - 5.0, travel.max() + 10.0
    target = {"circle": {"centre": [-100, 0], "radius": 149.9}, "tolerance": 0.4}
    m = m.with_({"limits.joints": {"J3": [low, high]}, "target": target})
    found = jp.design(m, {"joints.J3.on.ground.0": [-101, -100]}, "structural", evaluations=5)
    used = np.abs(travel - 0.5 * (low + high)).max() / (0.5 * (high - low))
    assert found.used_before.sel(held="limits.joints.J3").item() == pytest.approx(used, rel=1e-9)
    assert found.used_before.sel(held="target.tolerance").item() == pytest.approx(0.25, rel=1e-6)


def test_the_seed_decides() -> None:
    m = jp.loads(jp.examples.text("p3r"))
    vary = {"joints.J3.on.ground.0": [-200, 0]}
    one, again, other = (jp.design(m, vary, "worst_position", evaluations=60, seed=seed) for seed in (3, 3, 4))
    assert one.identical(again.assign_attrs(created=one.attrs.get("created"))) or one.equals(again)
    assert other.aim_found.item() == pytest.approx(one.aim_found.item(), rel=1e-4)


def test_nothing_that_holds_says_what_is_missed_least() -> None:
    m = lever(limits={"position": 0.1})
    found = jp.design(m, {"variables.a": [2, 40]}, "size", evaluations=60)
    assert found.status.item() == "infeasible"
    assert "changes" not in found.attrs
    assert found.used.sel(held="limits.position").item() == pytest.approx(2.0 * np.sqrt(PLAY * SLOPE) / 0.1, rel=1e-2)


def test_what_cannot_be_assembled_is_led_out_of() -> None:
    """At first hardly anything in the box has a pose: the links are too short."""
    m = jp.loads(jp.examples.text("four-bar"))
    vary = {"joints.J3.on.coupler.0": [5, 80], "joints.J4.on.ground.0": [-100, -99]}
    found = jp.design(m.with_({"joints.J3.on.coupler": [10, 0]}), vary, "worst_position", evaluations=60)
    assert found.status.item() == "ok"
    assert np.isnan(found.aim_before.item())
    nothing = jp.design(m, {"joints.J3.on.coupler.0": [5, 10]}, "worst_position", evaluations=30)
    assert nothing.status.item() == "infeasible"
    assert nothing.used.sel(held="assembly").item() > 1.0


def test_any_number_of_processes_finds_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    # Clusters of other tests leave these behind; linear algebra with another number of threads has other last digits.
    for name, value in BEGUN_WITH.items():
        monkeypatch.delenv(name, raising=False)
        if value is not None:
            monkeypatch.setenv(name, value)
    module = sys.modules[compute.__module__]
    monkeypatch.setattr(module, "WORTH", 0.0)
    m = jp.loads(jp.examples.text("p3r"))
    vary = {"joints.J3.on.ground.0": [-200, 0], "joints.J3.on.ground.1": [-50, 50]}
    found = []
    for count in (1, 3):
        monkeypatch.setattr(module, "cores", lambda count=count: count)
        found.append(jp.design(m, vary, "worst_position", evaluations=20))
    alone, several = found
    assert several.attrs["attempts"] == alone.attrs["attempts"]
    assert all(several[name].identical(values) for name, values in alone.data_vars.items())


def test_ctrl_c_keeps_the_best() -> None:
    def stop(done: int, _total: int) -> None:
        if done == 40:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as stopped:
        compute(lever(), {"variables.a": [2, 40]}, "worst_position", progress=stop)
    partial = stopped.value.partial
    assert "40 attempts" in str(partial.attrs["incomplete"])
    assert float(partial.get("aim_found")[0]) == pytest.approx(2.0 * np.sqrt(PLAY * SLOPE), rel=0.1)
    assert partial.attrs["changes"]


@pytest.mark.parametrize(
    ("vary", "aim", "words"),
    [
        ({}, "worst_position", r"design\.vary: nothing may vary"),
        ({"variables.b": [1, 2]}, "worst_position", r"'b'.*a"),
        ({"joints.K.on.ground.0": [1, 2]}, "worst_position", r"'K'.*J"),
        ({"output.body": [1, 2]}, "worst_position", r"output\.body: .*number"),
        ({"variables.a": [2, 1]}, "worst_position", r"design\.vary\.variables\.a: bounds are \[lowest, highest\]"),
        ({"variables.a": [1, 2]}, None, r"design\.aim: say what is to be small"),
        ({"variables.a": [1, 2]}, "worst", r"design\.aim.*worst_position"),
        ({"variables.a": [1, 2]}, ["size", "outside", "drive_force"], r"design\.aim: one aim, or two .*of 3 a sum"),
        ({"variables.a": [1, 2]}, "structural", r"design\.aim: structural needs a \[target\]"),
        ({"variables.a": [1, 2]}, "loaded_position", r"design\.aim: loaded_position: nothing loads"),
        ({"variables.a": [1, 2]}, "outside", r"design\.aim: outside.*\[limits\]"),
        ({"variables.a": [1, 2]}, {"sise": 1}, r"design: weights: 'sise'.*size"),
    ],
)
def test_bad_input_names_key_and_remedy(vary: dict[str, Any], aim: Any, words: str) -> None:
    with pytest.raises(jp.InputError, match=words):
        jp.design(lever(), vary, aim)


def test_the_command_writes_the_file_with_new_values(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("p3r.toml").write_text(jp.examples.text("p3r"), encoding="utf-8")
    line = ["design", "p3r.toml", "--vary", "joints.J3.on.ground.0=-200:0", "--aim", "worst_position"]
    assert run([*line, "--evaluations", "40", "-o", "new.toml"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    before, after = (Path(name).read_text(encoding="utf-8").splitlines() for name in ("p3r.toml", "new.toml"))
    changed = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert len(changed) == 1
    assert "4.436 mm" in out
    largest = jp.worst(jp.load("new.toml")).worst_position.max().item()
    assert f"{largest:.4g} mm" in out
    assert run([*line, "--evaluations", "20", "-s", "limits.position=0.1", "-o", "none.toml"]) == 1
    assert "misses limits.position by" in " ".join(capsys.readouterr().out.split())
    assert not Path("none.toml").exists()
    assert run(["design", "p3r.toml", "--aim", "worst_position"]) == 2
    assert "design.vary" in capsys.readouterr().err
    assert run([*line[:3], "joints.J3.on.ground.0=5", *line[4:]]) == 2
    assert "from:to" in capsys.readouterr().err
    assert run([*line, "-o", "p3r.toml"]) == 2
    assert "p3r.toml: --output: is a file that is read" in capsys.readouterr().err


def test_an_interrupted_command_writes_the_best_design(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("p3r.toml").write_text(jp.examples.text("p3r"), encoding="utf-8")

    def asked(m: jp.Mechanism, *, progress: Any, **options: Any) -> Any:
        def stop(done: int, total: int) -> None:
            if done == 20:
                raise KeyboardInterrupt

        return compute(m, progress=stop, **options)

    monkeypatch.setattr("jointplay.analyses.design.compute", asked)
    line = ["design", "p3r.toml", "--vary", "joints.J3.on.ground.0=-200:0", "--aim", "worst_position"]
    assert run([*line, "-o", "new.toml"]) == 130
    said = " ".join(capsys.readouterr().out.split())
    assert "Interrupted after 20 attempts" in said
    assert f"{jp.worst(jp.load('new.toml')).worst_position.max().item():.4g} mm" in said
