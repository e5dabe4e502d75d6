"""Names in results: all of them are reached as attributes of a dataset, and none is lost to a drive that has it."""

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
from helpers.answers import EXAMPLES, OVER_CONSTRAINED, example
from jointplay.analyses.map import open_map
from jointplay.questions import asked_by
from jointplay.result import coordinate_names, from_dataset, merge, to_dataset
from jointplay.result.names import HIDING, LATER

QUESTIONS = ("solve", "given", "loaded", "worst", "random", "check")
LIMITS = {"limits.position": 1.0, "limits.rotation": 1.0}
STEPS = {"assembly.steps": [["crank"], ["coupler", "rocker"]]}
#: drives with names of variables, of dimensions, of attributes, of xarray's own, of Python's; first one of each kind
AWKWARD = [
    *("error", "component", "grid", "size", "lambda", "theta", "q-1"),
    *("nominal", "status", "worst_position", "drive_error", "drive_value", "drive_nominal", "drive_unit"),
    *("configuration", "source", "joint", "probability", "drive"),
    *("title", "length", "question", "drives", "incomplete"),
    *("mean", "values", "T", "_x"),
    "x",
]


def ask(question: str, m: jp.Mechanism) -> xr.Dataset:
    return getattr(jp, question)(m, **options_of(question, m))


def mapped(question: str, m: jp.Mechanism, grid: dict[str, Any], **options: Any) -> xr.Dataset:
    if question == "structural" and not m.has_target:
        at = [0.0] * (2 if m.pose_size == 3 else 3)
        m = m.with_({"target": {"points": [at, [1.0, *at[1:]]], "timed": False}})
    if question == "forces":
        m = m.with_({f"limits.drive_torques.{m.drives[0]}": 1e9})
    return jp.map(m, question, grid, **options_of(question, m), **options)


def options_of(question: str, m: jp.Mechanism) -> dict[str, Any]:
    known = {"random": {"samples": 20}, "given": {"offsets": {m.parameters[0]: 1e-6}}, "worst": {"starts": 2}}
    return known.get(question, {})


def hidden(result: xr.Dataset) -> set[str]:
    """The names in a result by which nothing of it is reached as an attribute."""
    names = {str(name) for name in (*result.variables, *result.dims)}
    over = {str(name) for name in (*result.coords, *result.dims)}
    lost = {name for name in names if hasattr(xr.Dataset, name) or not name.isidentifier() or keyword.iskeyword(name)}
    # A variable of the result has its coordinates as attributes, too.
    return lost | {name for name in over if hasattr(xr.DataArray, name)} | (names & {str(key) for key in result.attrs})


@pytest.mark.parametrize("name", [*OVER_CONSTRAINED, *EXAMPLES])
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
        assert not hidden(jp.assemble(m, question, **({"samples": 50} if question == "random" else {})))
    assert not hidden(jp.assemble(example("antenna-support"), "worst"))
    assert not hidden(jp.compare(m, example("p3r"), "loaded"))
    assert not hidden(jp.sweep(m, "joints.J1.clearance.radial", [0.5, 1.0], "loaded"))
    for question in asked_by("map"):
        assert not hidden(mapped(question, m, {"theta1": [30, 40]}))
    assert not hidden(jp.map(example("five-bar"), "loaded", {"x": [-40, 0], "y": [150, 190]}))


def test_what_the_moments_of_the_scatter_are_called() -> None:
    found = jp.random(example("four-bar"), samples=100)
    for name in ("mean", "std", "covariance"):
        assert {f"error_{name}", f"error_{name}_first_order"} <= set(found.data_vars)
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


@functools.cache
def usually(question: str) -> xr.Dataset:
    """The answer where the drive has its own name."""
    return ask(question, driven("theta1"))


@functools.cache
def usually_mapped(question: str) -> xr.Dataset:
    return mapped(question, driven("theta1"), {"theta1": [30, 40, 50]})


def same_but_for_the_drive(found: xr.Dataset, usual: xr.Dataset, drive: str) -> None:
    """Nothing is missing, and the drive is there: under its name, or as `drive_NAME`."""
    (called,), (theirs,) = from_dataset(found).drives, from_dataset(usual).drives
    assert called in (drive, f"drive_{drive}", f"drive_drive_{drive}")
    others = {str(name) for name in (*usual.variables, *usual.dims, *usual.attrs, "configuration", *LATER)} - {theirs}
    of_xarray = hasattr(xr.Dataset, drive) or hasattr(xr.DataArray, drive) or drive.startswith("_")
    assert (called == drive) is not (drive in others or of_xarray or keyword.iskeyword(drive))
    np.testing.assert_allclose(found[called], usual[theirs])
    assert not hidden(found) - {"q-1"}
    assert {str(v) for v in found.variables} - {called} == {str(v) for v in usual.variables} - {theirs}
    for name, values in usual.data_vars.items():
        np.testing.assert_array_equal(found[name].values, values.values)


@pytest.mark.parametrize("drive", [*AWKWARD])
def test_a_drive_may_have_any_name_in_every_question(drive: str, tmp_path: Path) -> None:
    """A drive called `error` was refused, and one called `size` was hidden."""
    m = driven(drive)
    for question in ("solve", "loaded", "worst", "random", "compensate", "singularities"):
        found = ask(question, m)
        same_but_for_the_drive(found, usually(question), drive)
        jp.save(found, tmp_path / "r.csv")
        header = next(csv.reader((tmp_path / "r.csv").read_text(encoding="utf-8").splitlines()))
        assert len(header) == len(set(header)), "no two columns have one name"
        (called,) = from_dataset(found).drives
        assert called in header
    jp.save(found, tmp_path / "r.nc")
    with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf") as read:
        np.testing.assert_allclose(read[called], found[called])


@pytest.mark.parametrize("drive", AWKWARD)
def test_a_drive_may_have_any_name_in_maps(drive: str) -> None:
    m = driven(drive)
    for question in asked_by("map"):
        found = mapped(question, m, {drive: [30, 40, 50]})
        same_but_for_the_drive(found, usually_mapped(question), drive)
        assert found.sizes[found.attrs["grid"]] == 3
        assert found.attrs["grid"] == found.attrs["drives"]


@pytest.mark.parametrize("drive", AWKWARD)
def test_a_drive_may_have_any_name_in_files_of_maps(drive: str, tmp_path: Path) -> None:
    m = driven(drive)
    for file in ("m.zarr", "m.nc"):
        mapped("loaded", m, {drive: [30, 40, 50]}, path=tmp_path / file, chunk=2)
        with open_map(tmp_path / file) as stored:
            same_but_for_the_drive(stored.load(), usually_mapped("loaded"), drive)


@pytest.mark.parametrize("drive", ["error", "across", "mean", "component", "grid", "angle", "left"])
def test_a_drive_may_have_any_name_on_a_grid_of_the_output(drive: str) -> None:
    grid = {"x": [-40, 0], "y": [150, 190]}
    expected = jp.map(example("five-bar"), "loaded", grid)
    text = jp.examples.text("five-bar").replace("drives.left", f"drives.{drive}")
    found = jp.map(jp.loads(text), "loaded", grid)
    called = drive if drive in ("angle", "left") else f"drive_{drive}"
    np.testing.assert_array_equal(found[called], expected.left)
    np.testing.assert_array_equal(found.error, expected.error)


SWEPT = "joints.J1.clearance.radial", [0.5, 1.0]


@functools.cache
def swept_usually() -> xr.Dataset:
    return jp.sweep(driven("theta1"), *SWEPT, "loaded")


@functools.cache
def compared_usually() -> xr.Dataset:
    return jp.compare(driven("theta1"), example("p3r"), "loaded")


@pytest.mark.parametrize("drive", AWKWARD)
def test_a_drive_may_have_any_name_in_sweeps_and_comparisons(drive: str) -> None:
    m = driven(drive)
    key, values = SWEPT
    for name in (None, drive, "mean"):
        swept = jp.sweep(m, key, values, "loaded", name=name)
        dim = swept.attrs["sweep"]
        assert swept[dim].values.tolist() == values
        np.testing.assert_array_equal(swept.error, swept_usually().error)
        assert not hidden(swept) - {"q-1", str(name), *swept.attrs}
    compared = jp.compare(m, example("p3r"), "loaded")
    assert not hidden(compared)
    np.testing.assert_array_equal(compared.error, compared_usually().error)


@pytest.mark.parametrize("drive", [*AWKWARD, "loaded_error", "random_status", "error_mean"])
def test_a_drive_has_one_name_in_several_questions_put_together(drive: str) -> None:
    m = driven(drive)
    parts = {question: from_dataset(ask(question, m)) for question in ("worst", "loaded", "random")}
    merged = merge(parts)
    (called,) = merged.drives
    assert called.endswith(drive)
    found = to_dataset(merged)
    np.testing.assert_allclose(found[called], [30.0, 40.0])
    assert [name for name, v in found.coords.items() if v.attrs.get("long_name", "").startswith("value of")] == [called]
    assert {"loaded_error", "random_error_mean"} <= set(found.data_vars)
    assert not hidden(found) - {"q-1"}


@functools.cache
def names_of_results() -> tuple[str, ...]:
    m = driven("theta1")
    results = [ask(question, m) for question in (*QUESTIONS, "compensate", "singularities")]
    results.append(mapped("loaded", m, {"theta1": [30, 40]}))
    return tuple(sorted({str(n) for r in results for n in (*r.variables, *r.dims, *r.attrs)} | {"theta"}))


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_no_variable_is_lost_to_drives_with_names_of_results(data: st.DataObject) -> None:
    """Two drives with names drawn from those of all results, also with `drive_` before them."""
    before = st.sampled_from(["", "", "drive_", "drive_drive_"])
    prefixed = st.builds("{}{}".format, before, st.sampled_from(names_of_results()))
    drives = data.draw(st.lists(prefixed, min_size=2, max_size=2, unique=True))
    text = jp.examples.text("serial-2r")
    for old, new in zip(("q1", "q2"), drives, strict=True):
        text = text.replace(f"drives.{old}", f'drives."{new}"').replace(f"{old} = [", f'"{new}" = [')
    question = data.draw(st.sampled_from(["solve", "worst", "random", "loaded", "singularities"]))
    found, expected = ask(question, jp.loads(text)), ask(question, example("serial-2r"))
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
