"""Names in results: all of them are reached as attributes of a dataset, and none is lost to a drive that has it."""

from __future__ import annotations

import csv
import functools
import keyword
import pkgutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import jointplay as jp
from answers import EXAMPLES, OVER_CONSTRAINED, example
from jointplay.analyses.map import QUESTIONS as MAPPED
from jointplay.analyses.map import open_map
from jointplay.result import Result, coordinate_names, from_dataset, merge, to_dataset
from jointplay.result.names import HIDING

QUESTIONS = ("solve", "given", "loaded", "worst", "random", "check")
LIMITS = {"limits.position": 1.0, "limits.rotation": 1.0}
STEPS = {"assembly.steps": [["crank"], ["coupler", "rocker"]]}
#: drives with names of variables, of dimensions, of attributes, of xarray's own, of Python's
AWKWARD = (
    "error nominal status configuration component source joint probability title length question drives grid incomplete mean size"
    " values x theta lambda drive drive_error drive_value drive_nominal drive_unit worst_position T _x q-1"
).split()


def ask(question: str, m: jp.Mechanism, **options: Any) -> xr.Dataset:
    more = {"random": {"samples": 20}, "given": {"offsets": {m.parameters[0]: 1e-6}}, "worst": {"starts": 2}}
    return getattr(jp, question)(m, **more.get(question, {}), **options)


def hidden(result: xr.Dataset) -> set[str]:
    """The names in a result by which nothing of it is reached as an attribute."""
    names = {str(name) for name in (*result.variables, *result.dims)}
    over = {str(name) for name in (*result.coords, *result.dims)}
    lost = {name for name in names if hasattr(xr.Dataset, name) or not name.isidentifier() or keyword.iskeyword(name)}
    # A variable of the result has its coordinates as attributes, too.
    return lost | {name for name in over if hasattr(xr.DataArray, name)} | (names & {str(key) for key in result.attrs})


def one_configuration(name: str) -> jp.Mechanism:
    m = example(name)
    at = {f"drives.{drive}.values": v for drive, v in zip(m.drives, np.transpose(jp_values(m)), strict=True)}
    return m.with_({**{key: [float(v[0])] for key, v in at.items()}, **LIMITS}) if at and m.targets is None else m


def jp_values(m: jp.Mechanism) -> np.ndarray:
    solved = jp.solve(m)
    return np.stack([solved[name].values for name in solved.attrs.get("drives", "").split(", ") if name], axis=-1)


@pytest.mark.parametrize("name", [*EXAMPLES, *OVER_CONSTRAINED])
def test_no_name_in_a_result_is_hidden_by_xarray(name: str) -> None:
    """`result.mean` was xarray's method, not the mean error."""
    m = example(name)
    for question in QUESTIONS:
        if question == "loaded" and not m.has_loads:
            continue
        assert not hidden(ask(question, m)), question
    if name in EXAMPLES:
        assert not hidden(jp.singularities(m))
        if m.has_loads:
            assert not hidden(jp.compensate(m))


def test_no_name_of_the_other_commands_is_hidden_by_xarray() -> None:
    m = example("four-bar").with_(STEPS)
    for question in ("unit", "worst", "random"):
        assert not hidden(jp.assemble(m, question, samples=50))
    assert not hidden(jp.assemble(example("antenna-support"), "worst"))
    assert not hidden(jp.compare(m, example("p3r"), "loaded"))
    for word in ("clearance.radial", "clearance"):
        values = [0.5, 1.0] if word.endswith("radial") else None
        if values:
            assert not hidden(jp.sweep(m, f"joints.J1.{word}", values, "loaded"))
    for question in MAPPED:
        assert not hidden(ask_map(m, question, {"theta1": [30, 40]}))
    assert not hidden(jp.map(example("five-bar"), "loaded", {"x": [-40, 0], "y": [150, 190]}))


def ask_map(m: jp.Mechanism, question: str, grid: dict[str, Any], **options: Any) -> xr.Dataset:
    more: dict[str, Any] = {"random": {"samples": 20}, "given": {"offsets": {m.parameters[0]: 1e-6}}, "worst": {"starts": 2}}
    return jp.map(m, question, grid, **more.get(question, {}), **options)


def test_what_the_moments_of_the_scatter_are_called() -> None:
    found = jp.random(example("four-bar"), samples=100)
    for name in ("mean", "std", "covariance"):
        assert f"error_{name}" in found and f"error_{name}_first_order" in found and name not in found
    assert found.error_quantile.dims == ("configuration", "probability", "quantity")
    assembled = jp.assemble(example("four-bar").with_(STEPS), "random", samples=100)
    assert assembled.error_mean.dims == assembled.error_std.dims == ("step", "component")


def test_the_bound_of_the_worst_says_that_it_is_of_the_linear_figure() -> None:
    found = jp.worst(example("four-bar"))
    for size in ("position", "rotation"):
        assert (found[f"worst_{size}_first_order_bound"] >= found[f"worst_{size}_first_order"]).all()
        assert f"worst_{size}_bound" not in found
    # It is none of the exact one.
    assert (found.worst_position_first_order_bound < found.worst_position).any()


def test_every_attribute_of_xarray_is_known() -> None:
    """Names must not depend on whether xarray is imported, so they are written down; a new version may have more."""
    own = {name for kind in (xr.Dataset, xr.DataArray) for name in dir(kind) if not name.startswith("_")}
    assert own <= HIDING, "add these to HIDING"


def test_no_public_function_has_the_name_of_a_module() -> None:
    """`jp.map` must be the function whatever was imported before it."""
    modules = {module.name for module in pkgutil.iter_modules(jp.__path__)}
    functions = {name for name in jp.__all__ if callable(getattr(jp, name))}
    assert not functions & modules


# -- drives


@functools.cache
def driven(drive: str) -> jp.Mechanism:
    text = jp.examples.text("four-bar").replace("drives.theta1", f'drives."{drive}"')
    m = jp.loads(text, "named.toml").with_(LIMITS | STEPS)
    return m.with_({f"drives.{drive}.values": [30.0, 40.0], f"drives.{drive}.error": 0.1, "limits.joints.J4": [0, 90]})


def same_but_for_the_drive(found: xr.Dataset, usual: xr.Dataset, drive: str) -> None:
    """Nothing is missing, and the drive is there: under its name, or as `drive_NAME`."""
    light = from_dataset(found)
    (called,) = light.drives
    assert called.removesuffix(drive) in ("", "drive_", "drive_drive_")
    assert (called == drive) == (coordinate_names([drive], set(found.variables) - {drive} | set(found.attrs)) == [drive])
    (theirs,) = from_dataset(usual).drives
    np.testing.assert_allclose(found[called], usual[theirs])
    if called.isidentifier():
        assert getattr(found, called).identical(found[called])
        assert not hidden(found) - {called} or drive == "q-1"
    assert called.isidentifier() is drive.isidentifier() or called.startswith("drive_")
    assert {str(v) for v in found.variables} - {called} == {str(v) for v in usual.variables} - {theirs}
    for name, values in usual.data_vars.items():
        assert name in found.data_vars
        if values.dtype.kind == "f":
            np.testing.assert_array_equal(found[name].values, values.values)


@pytest.mark.parametrize("drive", AWKWARD)
def test_a_drive_may_have_any_name_in_every_question(drive: str, tmp_path: Path) -> None:
    """A drive called `error` was refused, one called `limit` lost its own name to nothing, one called `mean` was hidden."""
    m, usual = driven(drive), driven("theta1")
    for question in ("solve", "loaded", "worst", "random", "compensate", "singularities"):
        found, expected = ask(question, m), ask(question, usual)
        same_but_for_the_drive(found, expected, drive)
        jp.save(found, tmp_path / "r.csv")
        header = next(csv.reader((tmp_path / "r.csv").open(encoding="utf-8")))
        assert len(header) == len(set(header)), "no two columns have one name"
        (called,) = from_dataset(found).drives
        assert f"{called} [deg]" in header
    jp.save(found, tmp_path / "r.nc")
    with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf") as read:
        np.testing.assert_allclose(read[called], found[called])


@pytest.mark.parametrize("drive", AWKWARD)
def test_a_drive_may_have_any_name_in_maps(drive: str, tmp_path: Path) -> None:
    m, usual = driven(drive), driven("theta1")
    for question in MAPPED:
        found = ask_map(m, question, {drive: [30, 40, 50]})
        same_but_for_the_drive(found, ask_map(usual, question, {"theta1": [30, 40, 50]}), drive)
        assert found.sizes[found.attrs["grid"]] == 3
        assert found.attrs["grid"] == found.attrs["drives"]
    for file in ("m.zarr", "m.nc"):
        ask_map(m, "loaded", {drive: [30, 40, 50]}, path=tmp_path / file, chunk=2)
        with open_map(tmp_path / file) as stored:
            same_but_for_the_drive(stored.load(), ask_map(usual, "loaded", {"theta1": [30, 40, 50]}), drive)


@pytest.mark.parametrize("drive", ["x", "error", "across", "mean", "y"])
def test_a_drive_may_have_any_name_on_a_grid_of_the_output(drive: str) -> None:
    """A drive `x` and the axis `x` of the grid are two things."""
    text = jp.examples.text("five-bar").replace("theta1", drive)
    found = jp.map(jp.loads(text), "loaded", {"x": [-40, 0], "angle" if drive == "angle" else "y": [150, 190]})
    expected = jp.map(example("five-bar"), "loaded", {"x": [-40, 0], "y": [150, 190]})
    assert f"drive_{drive}" in found.attrs["drives"]
    np.testing.assert_array_equal(found[f"drive_{drive}"], expected.theta1)
    np.testing.assert_array_equal(found.error, expected.error)


@pytest.mark.parametrize("drive", AWKWARD)
def test_a_drive_may_have_any_name_in_sweeps_and_comparisons(drive: str) -> None:
    m, usual = driven(drive), driven("theta1")
    key, values = "joints.J1.clearance.radial", [0.5, 1.0]
    for name in (None, drive, "mean"):
        swept = jp.sweep(m, key, values, "loaded", name=name)
        dim = swept.attrs["sweep"]
        assert swept[dim].dims == (dim,) and swept.sizes[dim] == 2
        np.testing.assert_array_equal(swept.error, jp.sweep(usual, key, values, "loaded").error)
        assert not hidden(swept) - {"q-1"}
    compared = jp.compare(m, example("p3r"), "loaded")
    assert not hidden(compared)
    np.testing.assert_array_equal(compared.error, jp.compare(usual, example("p3r"), "loaded").error)


@pytest.mark.parametrize("drive", [*AWKWARD, "loaded_error", "random_status", "error_mean"])
def test_a_drive_has_one_name_in_several_questions_put_together(drive: str) -> None:
    m = driven(drive)
    parts = {question: from_dataset(ask(question, m)) for question in ("worst", "loaded", "random")}
    merged = merge(parts)
    (called,) = merged.drives
    assert called.endswith(drive)
    found = to_dataset(merged)
    np.testing.assert_allclose(found[called], [30.0, 40.0])
    assert not [name for name, v in found.coords.items() if v.attrs.get("long_name", "").startswith("value of") and name != called]
    assert "loaded_error" in found.data_vars and "random_error_mean" in found.data_vars
    assert not hidden(found) - {"q-1"}


@functools.cache
def names_of_results() -> tuple[str, ...]:
    m = driven("theta1")
    results = [ask(q, m) for q in (*QUESTIONS, "compensate", "singularities")] + [ask_map(m, "loaded", {"theta1": [30, 40]})]
    return tuple(sorted({str(n) for r in results for n in (*r.variables, *r.dims, *r.attrs)} | {"theta"}))


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_no_variable_is_lost_to_drives_with_names_of_results(data: st.DataObject) -> None:
    """Two drives with names drawn from those of all results, also with `drive_` before them."""
    prefixed = st.builds("{}{}".format, st.sampled_from(["", "", "drive_", "drive_drive_"]), st.sampled_from(names_of_results()))
    drives = data.draw(st.lists(prefixed, min_size=2, max_size=2, unique=True))
    text = jp.examples.text("serial-2r")
    for old, new in zip(("q1", "q2"), ("\0", "\1"), strict=True):
        text = text.replace(f"drives.{old}", f"drives.{new}").replace(f"{old} = [", f"{new} = [")
    for mark, name in zip(("\0", "\1"), drives, strict=True):
        text = text.replace(mark, name)
    m, usual = jp.loads(text, "named.toml"), example("serial-2r")
    question = data.draw(st.sampled_from([q for q in ("solve", "worst", "random", "loaded", "singularities")]))
    if question == "loaded" and not m.has_loads:
        question = "solve"
    found, expected = ask(question, m), ask(question, usual)
    called = list(from_dataset(found).drives)
    assert len(called) == 2
    for name, own, theirs in zip(called, drives, ("q1", "q2"), strict=True):
        assert name.endswith(own)
        np.testing.assert_array_equal(found[name], expected[theirs])
    assert {str(v) for v in found.variables} - set(called) == {str(v) for v in expected.variables} - {"q1", "q2"}
    assert not hidden(found)


@given(
    own=st.lists(st.sampled_from(["a", "error", "drive_error", "mean", "drive_mean", "drive_drive_error"]), max_size=4),
    taken=st.sets(st.sampled_from(["error", "drive_error", "drive_mean", "b"])),
)
def test_names_of_drives_are_free_and_different(own: list[str], taken: set[str]) -> None:
    names = coordinate_names(own, taken)
    assert len(set(names)) == len(names) == len(own)
    assert not set(names) & (taken | HIDING)
    assert all(name.endswith(mine) for name, mine in zip(names, own, strict=True))
    # Asked again of the names that it gave, it changes nothing.
    assert coordinate_names(names, taken) == names
