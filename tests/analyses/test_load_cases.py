"""Load cases: what is said of each is what a file with these loads alone says, to the bit; and their envelope."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import refusal
from helpers.several import Raw, alone, assert_same, raw_of, together
from jointplay.cli import run
from jointplay.errors import InputError

EXAMPLES = ("slider-crank", "3-rrr", "rssr", "x-braced-square", "redundant-bar", "four-legged-platform")
QUESTIONS: dict[str, Any] = {
    "loaded": jp.loaded,
    "random under load": lambda m: jp.random(m, samples=300, contact="loaded"),
    "compensate": jp.compensate,
}


def cases_of(raw: Raw) -> Raw:
    """The loads of a file, the opposite ones, and others across them at half the size."""

    def turned(load: Raw, how: str) -> Raw:
        force = load.get("force", [0.0, 0.0])
        opposite = [-f for f in force]
        return load | {"force": opposite if how == "back" else [0.5 * f for f in [opposite[1], force[0], *force[2:]]]}

    return {
        how: [turned(load, how) if how != "on" else load for load in raw["loads"]] for how in ("on", "back", "across")
    }


def whole_of(name: str, *, common: bool = False) -> Raw:
    raw = raw_of(name)
    cases = cases_of(raw)
    if not common:
        del raw["loads"]
    return raw | {"load_cases": cases}


@pytest.mark.parametrize("question", QUESTIONS)
@pytest.mark.parametrize("name", EXAMPLES)
def test_load_cases_are_several_files(name: str, question: str) -> None:
    whole, ask = whole_of(name), QUESTIONS[question]
    m = jp.Mechanism(whole)
    if question == "compensate" and not m.drives:
        pytest.skip("a structure has no drives")
    found = ask(m)
    assert found.load_case.values.tolist() == ["on", "back", "across"]
    assert "load_case" not in found.nominal.dims
    for case in whole["load_cases"]:
        assert_same(found.sel(load_case=case), ask(jp.Mechanism(alone(whole, load_case=case))))


def test_common_loads_act_in_every_case() -> None:
    whole = whole_of("slider-crank", common=True)
    found = jp.loaded(jp.Mechanism(whole))
    for case in whole["load_cases"]:
        single = alone(whole, load_case=case)
        assert len(single["loads"]) == 2
        assert_same(found.sel(load_case=case), jp.loaded(jp.Mechanism(single)))


@pytest.mark.parametrize(
    "ask", [jp.solve, lambda m: jp.worst(m, starts=4), lambda m: jp.random(m, samples=500), jp.given]
)
@pytest.mark.parametrize("name", ["slider-crank", "x-braced-square"])
def test_what_does_not_depend_on_loads_has_no_load_case(name: str, ask: Any) -> None:
    whole = whole_of(name)
    found = ask(jp.Mechanism(whole))
    assert "load_case" not in found.dims
    assert_same(found, ask(jp.Mechanism(alone(whole))))


def test_outputs_and_load_cases_together() -> None:
    whole = whole_of("slider-crank")
    whole = together(
        whole, {"face": whole["output"], "lever": {"body": "rod", "at": [80, 20], "relative_to": "slider"}}
    )
    found = jp.loaded(jp.Mechanism(whole))
    assert found.error.dims == ("output", "load_case", "configuration", "component")
    for output in whole["outputs"]:
        for case in whole["load_cases"]:
            assert_same(found.sel(output=output, load_case=case), jp.loaded(jp.Mechanism(alone(whole, output, case))))


@pytest.mark.parametrize("name", ["slider-crank", "rssr"])
def test_the_envelope_has_the_largest_errors_and_their_cases(name: str) -> None:
    found = jp.loaded(jp.Mechanism(whole_of(name)))
    lengths = [c for c in found.component.values.tolist() if c in "xyz"]
    sizes = {
        "position": np.sqrt((found.error.sel(component=lengths) ** 2).sum("component")),
        "rotation": np.sqrt((found.error.drop_sel(component=lengths) ** 2).sum("component")),
    }
    for quantity, size in sizes.items():
        np.testing.assert_allclose(found[f"envelope_{quantity}"], size.max("load_case"), rtol=1e-15)
        for k, case in enumerate(found[f"envelope_{quantity}_case"].values.tolist()):
            assert size.sel(load_case=case)[k].item() == pytest.approx(size[:, k].max().item(), rel=1e-15)
    for side, extreme in (("low", found.error.min("load_case")), ("high", found.error.max("load_case"))):
        np.testing.assert_array_equal(found.envelope_component.sel(side=side), extreme)
    case = found.envelope_component_case.sel(side="low", component="x")[0].item()
    assert (
        found.error.sel(load_case=case, component="x")[0] == found.envelope_component.sel(side="low", component="x")[0]
    )


def test_where_a_case_is_unknown_so_is_the_envelope() -> None:
    """A drive value that the links cannot reach."""
    whole = whole_of("four-bar")
    whole["drives"]["theta1"] = {"joint": "J1", "values": [60, 1e3]}
    whole["start"]["crank"]["angle"] = 60
    whole["joints"]["J4"]["on"]["ground"] = [330, 0]
    found = jp.loaded(jp.Mechanism(whole))
    bad = (found.status != "ok").any("load_case").values
    assert np.isnan(found.envelope_position.values[bad]).all()
    assert (found.envelope_position_case.values[bad] == "").all()


def test_points_of_loads_on_elastic_bodies_are_those_of_the_case() -> None:
    """A load in the middle of an elastic bar divides it in this case only."""
    raw = raw_of("x-braced-square")
    body = next(name for name, entry in raw["bodies"].items() if {"stiffness", "E"} & set(entry))
    del raw["loads"]
    whole = raw | {
        "load_cases": {
            "end": [{"body": raw["output"]["body"], "at": raw["output"]["at"], "force": [50, -100]}],
            "middle": [{"body": body, "at": [31, 0], "force": [5, -10]}],
        }
    }
    found = jp.loaded(jp.Mechanism(whole))
    for case in whole["load_cases"]:
        assert_same(found.sel(load_case=case), jp.loaded(jp.Mechanism(alone(whole, load_case=case))))


def test_sweeps_and_maps_go_through_every_load_case(tmp_path: Path) -> None:
    whole = whole_of("slider-crank")
    m = jp.Mechanism(whole)
    swept = jp.sweep(m, "load_cases.back.0.force.0", [100.0, 200.0], "loaded")
    assert swept.error.dims[:3] == ("load_cases_back_0_force_0", "load_case", "configuration")
    mapped = jp.map(m, grid={"theta": [20, 40, 60]}, path=tmp_path / "m.zarr")
    for case in whole["load_cases"]:
        single = jp.map(jp.Mechanism(alone(whole, load_case=case)), grid={"theta": [20, 40, 60]})
        assert_same(
            mapped.sel(load_case=case)[["error", "offset", "contact_change"]],
            single[["error", "offset", "contact_change"]],
        )


def test_a_map_of_other_loads_is_another_map(tmp_path: Path) -> None:
    m = jp.Mechanism(whole_of("slider-crank"))
    grid = {"theta": [20, 40]}
    jp.map(m, grid=grid, path=tmp_path / "m.zarr").close()
    with pytest.raises(InputError, match="holds something else than this map"):
        jp.map(m.with_({"load_cases.back.0.force": [1.0, 0.0]}), grid=grid, path=tmp_path / "m.zarr")


def test_an_assembly_is_followed_in_every_load_case() -> None:
    whole = whole_of("four-bar") | {"assembly": {"steps": [["crank"], ["coupler", "rocker"]]}}
    found = jp.assemble(jp.Mechanism(whole))
    for case in whole["load_cases"]:
        assert_same(found.sel(load_case=case), jp.assemble(jp.Mechanism(alone(whole, load_case=case))))


MISTAKES = {
    "empty": ("load_cases = { idle = [] }", "load_cases.idle has no loads"),
    "no list": ("[load_cases.lift]\nforce = [0, -1]", "load_cases.lift: a list in brackets is needed"),
    "nothing": ("[[load_cases.lift]]\nbody = 'crank'", "load_cases.lift.0: a load needs a force [fx, fy] or a moment"),
    "unknown body": (
        "[[load_cases.lift]]\nbody = 'crnk'\nforce = [0, 1]",
        "load_cases.lift.0.body: 'crnk' is not a body",
    ),
    "second case": (
        "[[load_cases.a]]\nmoment = 1\n[[load_cases.b]]\nmoment = 1\n[[load_cases.b]]\nat = 'J9'\nmoment = 1",
        "load_cases.b.1.at: 'J9' is not a joint on 'rocker'",
    ),
    "unknown key": (
        "[[load_cases.a]]\nforc = [0, 1]",
        "load_cases.a.0: 'forc' is not a key here; did you mean 'force'?",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named(mistake: str) -> None:
    text = jp.examples.text("four-bar")
    head, _, rest = text.partition("[[loads]]")
    rest = rest[rest.index("\n[") :] if "\n[" in rest else ""
    added, said = MISTAKES[mistake]
    body = f"{head}{rest}"
    if added.startswith("load_cases ="):
        body = body.replace("\n[joints", f"\n{added}\n[joints", 1)
        added = ""
    body = body.replace("gravity", "# gravity")
    assert said in refusal(f"{body}\n{added}\n")


def test_a_case_that_nothing_loads_is_named_by_the_question() -> None:
    whole = whole_of("four-bar") | {"gravity": [0, 0]}
    whole["load_cases"]["idle"] = [{"force": [0.0, 0.0]}]
    with pytest.raises(InputError, match="nothing loads the mechanism in load case 'idle'"):
        jp.loaded(jp.Mechanism(whole))


def test_the_command_has_a_table_for_each_case_and_the_envelope(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    text = jp.examples.text("slider-crank").replace("[[loads]]", "[[load_cases.press]]")
    file = tmp_path / "m.toml"
    file.write_text(f"{text}\n[[load_cases.pull]]\nforce = [90, 0]\n", encoding="utf-8")
    assert run(["error", str(file), "-q", "loaded"]) == 0
    out = capsys.readouterr().out
    for heading in (
        "Load case press: Loaded",
        "Load case pull: Loaded",
        "Envelope: the largest errors over the load cases",
    ):
        assert heading in out
    assert max(map(len, out.splitlines())) <= 80
    assert run(["error", str(file), "-q", "loaded", "--load-case", "pull"]) == 0
    assert "Envelope" not in capsys.readouterr().out
    assert run(["error", str(file), "--load-case", "pul"]) == 2
    assert "'pul' is not one of the load cases; did you mean 'pull'?" in capsys.readouterr().err
    for kind in ("csv", "json", "nc", "zarr"):
        assert run(["error", str(file), "--samples", "200", "-o", str(tmp_path / f"m.{kind}")]) == 0
