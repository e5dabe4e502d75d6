"""Several outputs in one file: what is said of each is what a file with this output alone says, to the bit."""

import copy
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import refusal
from helpers.several import alone, assert_same, raw_of, together
from jointplay.cli import run
from jointplay.errors import InputError

#: in the plane, in space, over-constrained, elastic; a second output of each
SECOND: dict[str, dict[str, Any]] = {
    "slider-crank": {"body": "rod", "at": [80, 20], "relative_to": "slider", "limits": {"position": 0.01}},
    "3-rrr": {"body": "proximal_a"},
    "rssr": {"body": "crank", "at": [10, 0, 5], "relative_to": "rocker"},
    "x-braced-square": {"body": "top", "at": [10, 0]},
    "redundant-bar": {"body": "bar", "at": [5, 0]},
    "four-legged-platform": {"body": "platform", "at": [10, 0, 0]},
}
QUESTIONS: dict[str, Any] = {
    "solve": jp.solve,
    "loaded": jp.loaded,
    "loaded to first order": lambda m: jp.loaded(m, exact=False),
    "worst": lambda m: jp.worst(m, starts=4),
    "random": lambda m: jp.random(m, samples=1000),
    "random under load": lambda m: jp.random(m, samples=300, contact="loaded"),
    "given": jp.given,
}


def _bodies(name: str) -> list[str]:
    m = jp.loads(jp.examples.text(name))
    return list(dict.fromkeys(owner for owner in m.owners if "." not in owner))


def whole_of(name: str) -> dict[str, Any]:
    raw = raw_of(name)
    second = copy.deepcopy(SECOND[name])
    bodies = _bodies(name)
    if second["body"] not in bodies:
        second["body"] = next(body for body in bodies if body != raw["output"]["body"])
    if "relative_to" in second and second["relative_to"] not in bodies:
        second["relative_to"] = next(body for body in bodies if body != second["body"])
    return together(raw, {"first": raw["output"], "second": second})


@pytest.mark.parametrize("question", QUESTIONS)
@pytest.mark.parametrize("name", SECOND)
def test_several_outputs_are_several_files(name: str, question: str) -> None:
    whole, ask = whole_of(name), QUESTIONS[question]
    together_ = ask(jp.Mechanism(whole))
    assert together_.output.values.tolist() == ["first", "second"]
    for output in whole["outputs"]:
        assert_same(together_.sel(output=output), ask(jp.Mechanism(alone(whole, output))))


@pytest.mark.parametrize("ask", [jp.compensate, jp.singularities, lambda m: jp.map(m, grid={"theta": [20, 40, 60]})])
def test_further_questions_of_several_outputs(ask: Any) -> None:
    whole = whole_of("slider-crank")
    found = ask(jp.Mechanism(whole))
    for output in whole["outputs"]:
        assert_same(found.sel(output=output), ask(jp.Mechanism(alone(whole, output))))


def test_one_entry_has_the_dimension_and_one_output_has_none() -> None:
    raw = raw_of("four-bar")
    several = jp.Mechanism(together(raw, {"tip": raw["output"]}))
    assert jp.worst(several, starts=4).worst_position.dims == ("output", "configuration")
    assert jp.worst(jp.Mechanism(raw), starts=4).worst_position.dims == ("configuration",)
    assert jp.worst(several.only(output="tip"), starts=4).worst_position.dims == ("configuration",)


def test_limits_of_one_output_stand_in_it_and_the_others_have_those_of_the_file() -> None:
    whole = whole_of("slider-crank")
    result = jp.random(jp.Mechanism(whole), samples=500)
    assert result.limit.sel(quantity="position", side="high").values.tolist() == [0.2, 0.01]
    assert result.limit.sel(quantity="rotation", side="high").values.tolist() == [0.08, 0.08]
    assert (result.outside.sel(output="second") > result.outside.sel(output="first")).any()


def test_dimensions_end_at_one_of_the_outputs_and_all_see_the_same_specimens() -> None:
    raw = raw_of("slider-crank")
    whole = together(raw, {"face": raw["output"], "lever": {"body": "rod", "at": [80, 20]}})
    whole["dimensions"]["arm"] = {"body": "rod", "between": ["crankpin", "lever"], "tolerance": 0.1}
    m = jp.Mechanism(whole)
    result = jp.random(m, samples=1000)
    arm = result.contribution.sel(source="arm")
    assert (arm.sel(output="face") == 0).all()
    assert (arm.sel(output="lever", component=["x", "y"]).sum("component") > 0).all()
    parts = [m.only(output=name).core.specimens(5, 3) for name in m.outputs]
    np.testing.assert_array_equal(*parts)


def test_the_path_is_that_of_the_leading_output() -> None:
    """The drives are solved for the output that leads; the others are asked at these drive values."""
    raw = raw_of("five-bar")
    other = next(body for body in _bodies("five-bar") if body != raw["output"]["body"])
    solved = jp.solve(jp.Mechanism(raw))
    for drive in raw["drives"].values():
        for key in ("values", "from", "to", "count"):
            drive.pop(key, None)
    x, y = solved.nominal.sel(component=["x", "y"]).values.T
    raw["path"] = {"x": x.tolist(), "y": y.tolist()}
    for first in (0, 1):
        outputs = [("tip", raw["output"] | {"leads": True}), ("arm", {"body": other})]
        whole = together(raw, dict(outputs[::-1] if first else outputs))
        result = jp.solve(jp.Mechanism(whole))
        np.testing.assert_allclose(result.nominal.sel(output="tip"), solved.nominal, rtol=0, atol=1e-9)
        assert_same(jp.loaded(jp.Mechanism(whole)).sel(output="tip"), jp.loaded(jp.Mechanism(raw)))
    del whole["outputs"]["tip"]["leads"]
    with pytest.raises(InputError, match=r"which output has the \[path\]\? Say leads = true"):
        jp.Mechanism(whole)


def test_a_map_of_positions_is_that_of_the_leading_output() -> None:
    raw = raw_of("five-bar")
    other = next(body for body in _bodies("five-bar") if body != raw["output"]["body"])
    grid = {"x": [-20, 0, 20], "y": [150, 170]}
    del raw["path"]
    raw["grid"] = {name: {"values": values} for name, values in grid.items()}
    whole = together(raw, {"arm": {"body": other}, "tip": raw["output"]})
    with pytest.raises(InputError, match=r"which output is meant\? Say leads = true in one of .*: arm, tip"):
        jp.map(jp.Mechanism(whole), grid=grid)
    whole["outputs"]["tip"]["leads"] = True
    found = jp.map(jp.Mechanism(whole), grid=grid)
    assert found.error.dims == ("x", "y", "output", "component")
    np.testing.assert_array_equal(found.error.sel(output="tip"), jp.map(jp.Mechanism(raw), grid=grid).error)
    at = found.isel(x=0, y=1)
    drives = {f"drives.{name}.values": [at[name].item()] for name in at.attrs["drives"].split(", ")}
    alone_ = jp.loaded(jp.Mechanism(alone(whole, "arm")).with_({**drives, "grid": None}))
    np.testing.assert_allclose(at.error.sel(output="arm"), alone_.error[0], rtol=0, atol=1e-9)


def test_a_map_with_several_outputs_is_written_in_chunks_and_taken_up(tmp_path: Path) -> None:
    m = jp.Mechanism(whole_of("slider-crank"))
    grid = {"theta": {"from": 20, "to": 80, "count": 7}}
    expected = jp.map(m, grid=grid)
    for name in ("m.zarr", "m.nc"):
        for _ in range(2):
            found = jp.map(m, grid=grid, path=tmp_path / name, chunk=3)
            np.testing.assert_array_equal(found.error, expected.error)
            found.close()


class TestRelative:
    """The error of an output against another body, in the axes of that body."""

    @pytest.mark.parametrize("name", ["slider-crank", "rssr"])
    def test_the_error_is_the_change_of_the_pose_seen_from_that_body(self, name: str) -> None:
        raw = alone(whole_of(name), "second")
        m = jp.Mechanism(raw)
        offsets = jp.worst(m, starts=4).worst_offset.sel(extreme="position")
        found, before = jp.given(m, offsets), jp.solve(m).pose
        ends = [self.seen(m, pose.values, raw["output"]) for pose in (found.pose, before)]
        for k in range(len(found.configuration)):
            (place, turn), (place0, turn0) = ends[0][k], ends[1][k]
            size = len(place)
            np.testing.assert_allclose(found.error[k, :size], place - place0, rtol=0, atol=1e-9)
            assert self.angle(turn @ turn0.T) == pytest.approx(np.linalg.norm(found.error[k, size:]), abs=1e-7)

    @staticmethod
    def seen(m: jp.Mechanism, pose: np.ndarray, output: dict[str, Any]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Place and rotation of the output, seen from the body against which it is measured, by hand."""
        own, other = m.bodies.index(output["body"]), m.bodies.index(output["relative_to"])
        size = 2 if m.data.space == "planar" else 3

        def rotation(turn: np.ndarray) -> np.ndarray:
            if size == 2:
                c, s = np.cos(np.radians(turn[0])), np.sin(np.radians(turn[0]))
                return np.array([[c, -s], [s, c]])
            angle = np.radians(np.linalg.norm(turn))
            x, y, z = turn / max(np.linalg.norm(turn), 1e-300)
            cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross

        ends = []
        for row in pose:
            turn, back = rotation(row[own, size:]), rotation(row[other, size:]).T
            ends.append((back @ (row[own, :size] + turn @ output["at"] - row[other, :size]), back @ turn))
        return ends

    @staticmethod
    def angle(turn: np.ndarray) -> float:
        if len(turn) == 2:
            return float(np.degrees(abs(np.arctan2(turn[1, 0], turn[0, 0]))))
        sine = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
        return float(np.degrees(np.arcsin(np.linalg.norm(sine))))

    @pytest.mark.parametrize("name", ["slider-crank", "rssr"])
    def test_every_extreme_and_every_load_is_reproduced_by_its_offsets(self, name: str) -> None:
        m = jp.Mechanism(alone(whole_of(name), "second"))
        worst, loaded = jp.worst(m), jp.loaded(m)
        size = sum(c in "xyz" for c in m.components)
        error = jp.given(m, worst.worst_offset.sel(extreme="position")).error
        np.testing.assert_allclose(np.linalg.norm(error[:, :size], axis=1), worst.worst_position, rtol=1e-9)
        error = jp.given(m, worst.worst_offset.sel(extreme=f"{m.components[-1]} high")).error
        np.testing.assert_allclose(error[:, -1], worst.worst_component[:, -1, 1], rtol=1e-7)
        np.testing.assert_allclose(jp.given(m, loaded).error, loaded.error, rtol=0, atol=1e-8)
        drawn = jp.random(m, samples=20_000)
        assert (drawn.largest.sel(quantity="position") <= worst.worst_position * (1 + 1e-9)).all()
        np.testing.assert_allclose(drawn.error_std, drawn.error_std_first_order, rtol=0.05)

    @pytest.mark.parametrize("name", ["slider-crank", "rssr"])
    def test_first_order_is_the_slope_of_the_exact_error(self, name: str) -> None:
        m = jp.Mechanism(alone(whole_of(name), "second"))
        for parameter in m.parameters:
            found = [jp.given(m, {parameter: sign * 1e-4}) for sign in (1, -1)]
            slope, expected = (
                (a - b) / 2e-4 for a, b in zip(*((f.error_first_order, f.error) for f in found), strict=True)
            )
            np.testing.assert_allclose(slope, expected, rtol=0, atol=1e-6 * max(1.0, float(np.abs(expected).max())))

    @pytest.mark.parametrize("name", ["slider-crank", "3-rrr", "x-braced-square"])
    def test_it_follows_from_the_errors_of_the_point_and_of_the_body_against_the_ground(self, name: str) -> None:
        """On determinate, over-constrained and elastic mechanisms, under load and at random."""
        raw = raw_of(name)
        bodies = _bodies(name)
        point, other = raw["output"], next(body for body in bodies if body != raw["output"]["body"])
        outputs = {"point": point, "frame": {"body": other}, "seen": point | {"relative_to": other}}
        found = jp.loaded(jp.Mechanism(together(raw, outputs)))
        if (found.undetermined != 0).any():
            pytest.skip("what the load leaves open is in the middle for every output by itself")

        def seen(pose: Any) -> np.ndarray:
            (x, y, angle), (x0, y0, angle0) = (pose.sel(output=name).values.T for name in ("point", "frame"))
            c, s = np.cos(np.radians(angle0)), np.sin(np.radians(angle0))
            return np.stack([c * (x - x0) + s * (y - y0), c * (y - y0) - s * (x - x0), angle - angle0], axis=-1)

        expected = seen(found.nominal + found.error) - seen(found.nominal)
        np.testing.assert_allclose(found.error.sel(output="seen"), expected, rtol=0, atol=1e-8)

    def test_jaws_that_move_alike_have_no_error_against_each_other(self) -> None:
        """Two points of bodies that are locked to each other: all play is in front of both."""
        raw = raw_of("four-bar")
        raw["joints"]["weld"] = {"type": "fixed", "on": {raw["output"]["body"]: [0, 0], "jaw": [0, 0]}}
        raw["output"] = {"body": "jaw", "at": [5, 5], "relative_to": raw["output"]["body"]}
        assert np.abs(jp.loaded(jp.Mechanism(raw)).error).max() < 1e-12

    def test_an_assembly_is_followed_against_its_base(self) -> None:
        raw = raw_of("four-bar") | {"assembly": {"steps": [["crank"], ["coupler", "rocker"]]}}
        raw["output"]["relative_to"] = "coupler"
        with pytest.raises(
            InputError, match=r"output\.relative_to: the errors of an assembly refer to its base; leave"
        ):
            jp.assemble(jp.Mechanism(raw))
        # Of several outputs the message names the one that is meant, whichever comes first.
        seen = raw.pop("output")
        raw["outputs"] = {"tip": {"body": "rocker"}, "seen": seen}
        m = jp.Mechanism(raw)
        with pytest.raises(InputError, match=r"outputs\.seen\.relative_to: .*; choose another output \(--output-point"):
            jp.assemble(m)
        assert jp.assemble(m.only(output="tip")).sizes["step"] == 2


def test_an_assembly_has_several_outputs() -> None:
    raw = raw_of("four-bar") | {"assembly": {"steps": [["crank"], ["coupler", "rocker"]]}}
    whole = together(raw, {"tip": raw["output"], "middle": {"body": "coupler"}})
    found = jp.assemble(jp.Mechanism(whole))
    for output in whole["outputs"]:
        assert_same(found.sel(output=output), jp.assemble(jp.Mechanism(alone(whole, output))))


def test_a_chosen_output_stays_chosen() -> None:
    m = jp.Mechanism(whole_of("slider-crank")).only(output="second")
    again = pickle.loads(pickle.dumps(m))
    assert again == m
    assert again.outputs == ()
    assert m != jp.Mechanism(whole_of("slider-crank"))
    assert m.with_({"joints.main.clearance.radial": 0.1}).core_spec["output"] == m.core_spec["output"]


def test_two_mechanisms_are_compared_output_by_output() -> None:
    # The slider is in one place at two angles of the crank; these are in the same half turn.
    m = jp.Mechanism(whole_of("slider-crank")).with_({"drives.theta.values": [20, 60]})
    other = m.with_({"joints.*.clearance.radial": 0.05})
    found = jp.compare(m, other, "loaded", names=("a", "b"))
    expected = jp.loaded(other).error.sel(output="second")
    # The drives are solved from the path, not given.
    np.testing.assert_allclose(found.error.sel(mechanism="b", output="second"), expected, rtol=0, atol=1e-10)
    with pytest.raises(InputError, match="the same outputs"):
        jp.compare(m, other.only(output="first"))


MISTAKES: dict[str, tuple[str, str]] = {
    "both forms": ("[output]\nbody = 'rocker'\n[outputs.a]\nbody = 'rocker'", "give [output], or [outputs.NAME]"),
    "neither": ("", "'output' is missing (the point whose error is asked"),
    "unknown body": ("[outputs.a]\nbody = 'rockr'", "outputs.a.body: 'rockr' is not a body of any joint; did you mean"),
    "on the ground": ("[outputs.a]\nbody = 'ground'", "outputs.a.body: 'ground' does not move"),
    "second one wrong": (
        "[outputs.a]\nbody = 'rocker'\n[outputs.b]\nbody = 'crank'\nat = 'J7'",
        "outputs.b.at: 'J7' is not a joint on 'crank'",
    ),
    "relative to itself": (
        "[outputs.a]\nbody = 'rocker'\nrelative_to = 'rocker'",
        "outputs.a.relative_to: 'rocker' carries the output itself",
    ),
    "relative to the ground": (
        "[output]\nbody = 'rocker'\nrelative_to = 'ground'",
        "output.relative_to: 'ground' is what an output is measured against if this is left out",
    ),
    "relative to nothing": (
        "[output]\nbody = 'rocker'\nrelative_to = 'rockr'",
        "output.relative_to: 'rockr' is not a body of any joint; did you mean 'rocker'?",
    ),
    "name of a joint": (
        "[outputs.J1]\nbody = 'rocker'",
        "outputs.J1: 'J1' is the name of a joint; give the output another",
    ),
    "reserved name": (
        "[outputs.output]\nbody = 'rocker'",
        "outputs.output: 'output' is a word with a meaning of its own",
    ),
    "limits of one in output": (
        "[output]\nbody = 'rocker'\nlimits = { position = 1 }",
        "output: 'limits' is a key of one of several [outputs.NAME]",
    ),
    "limits twice": (
        "[outputs.a]\nbody = 'rocker'\nlimits = { position = 1 }\n[limits]\nposition = 2",
        "limits.position holds for no output",
    ),
    "unknown key": (
        "[outputs.a]\nbody = 'rocker'\nrelative = 'crank'",
        "outputs.a: 'relative' is not a key here; did you mean",
    ),
    "two lead": (
        "[outputs.a]\nbody = 'rocker'\nleads = true\n[outputs.b]\nbody = 'crank'\nleads = true",
        "one output leads",
    ),
    "load on no body": (
        "[outputs.a]\nbody = 'rocker'\n[[loads]]\nforce = [1, 0]",
        "loads.0: 'body' is missing (the loaded body; the outputs are a)",
    ),
    "which output": (
        "[outputs.a]\nbody = 'rocker'\n[dimensions.d]\nbody = 'rocker'\nbetween = ['J4', 'output']",
        "dimensions.d.between: which of the outputs is meant? Name one of a",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named(mistake: str) -> None:
    text = jp.examples.text("four-bar")
    for table in ("output", "loads", "limits"):
        text = re.sub(rf"(?ms)^\[+{table}\]+.*?(?=^\[|\Z)", "", text)
    added, said = MISTAKES[mistake]
    assert said in refusal(f"{text}\n{added}\n")


def test_the_command_speaks_of_each_output(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: Any
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    text = jp.examples.text("slider-crank").replace("[output]", "[outputs.face]")
    text = text.replace("[[loads]]", "[outputs.lever]\nbody = 'rod'\n\n[[loads]]\nbody = 'slider'\nat = [25, 8]")
    file = tmp_path / "m.toml"
    file.write_text(text, encoding="utf-8")
    assert run(["error", str(file), "-q", "loaded", "--plot", str(tmp_path / "m.png")]) == 0
    out = capsys.readouterr().out
    assert "Output face: Loaded" in out
    assert "Output lever: Loaded" in out
    assert max(map(len, out.splitlines())) <= 80
    assert run(["error", str(file), "-q", "loaded", "--output-point", "lever"]) == 0
    assert "Output" not in capsys.readouterr().out
    assert run(["error", str(file), "--output-point", "levr"]) == 2
    assert "'levr' is not one of the outputs; did you mean 'lever'?" in capsys.readouterr().err
    assert run(["solve", str(file), "-o", str(tmp_path / "m.csv")]) == 0
    rows = (tmp_path / "m.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0].startswith("variable,output,configuration,")
    assert sum(row.startswith("status,") for row in rows) == 2 * 23
