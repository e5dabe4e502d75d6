"""Results as tidy tables: every value once, with the labels that it has in the dataset."""

import itertools
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import jointplay as jp
from helpers.answers import example
from jointplay.result import Result, Variable

ASKED = {
    "worst": lambda: jp.worst(example("four-bar")),
    "loaded": lambda: jp.loaded(example("3-upu")),
    "random": lambda: jp.random(example("four-bar"), samples=500),
    "load cases": lambda: jp.loaded(example("slider-crank-cases")),
    "sweep": lambda: jp.sweep(example("four-bar"), "joints.*.clearance.radial", [0.1, 0.2]),
    "check": lambda: jp.check(example("four-bar")),
    "assemble": lambda: jp.assemble(example("antenna-support")),
}


@pytest.mark.parametrize("asked", ASKED)
def test_every_value_of_the_dataset_stands_in_one_row_with_its_labels(asked: str) -> None:
    """Compared with the dataset by name, label by label."""
    dataset = ASKED[asked]()
    table = jp.frame(dataset)
    assert len(table) == sum(array.size for array in dataset.data_vars.values())
    for name, array in dataset.data_vars.items():
        own = table[table.variable == name]
        assert len(own) == array.size
        dims = [str(dim) for dim in array.dims]
        labels = [dataset[dim].values.tolist() if dim in dataset.coords else range(dataset.sizes[dim]) for dim in dims]
        wanted = dict(zip(itertools.product(*labels), array.values.reshape(-1).tolist(), strict=True))
        told = own.text if array.dtype.kind in "UO" else own.value
        found = dict(zip(zip(*(own[dim] for dim in dims), strict=True) if dims else [()], told, strict=True))
        assert found.keys() == wanted.keys()
        for key, value in wanted.items():
            empty = (isinstance(value, float) and math.isnan(value)) or value == ""
            assert pd.isna(found[key]) if empty else found[key] == value, (name, key)
        others = {*table.columns} - {"variable", "value", "text", "unit"}
        for other in others:
            is_label = other in dims or (other in dataset.coords and {*dataset[other].dims} <= {*dims})
            assert own[other].isna().all() != (is_label and dataset[other].size > 0) or other not in dataset.coords


def test_units_are_those_of_the_file() -> None:
    """Lengths in mm and angles in degrees, also where one variable has both, and their products."""
    table = jp.frame(jp.random(example("four-bar"), samples=100))
    std = table[(table.variable == "error_std") & (table.configuration == 0)].set_index("component").unit
    assert dict(std) == {"x": "mm", "y": "mm", "angle": "deg"}
    pairs = table[(table.variable == "error_covariance") & (table.configuration == 0)]
    units = pairs.set_index(["component", "component_other"]).unit
    assert (units["x", "y"], units["x", "angle"], units["angle", "angle"]) == ("mm mm", "mm deg", "deg deg")


def test_a_drive_called_like_a_column_keeps_its_values() -> None:
    """A drive may be called `value`; its column is then `drive_value`."""
    coords = {"value": Variable(("configuration",), np.array([10.0, 20.0]))}
    found = jp.frame(Result(coords, {"error": Variable(("configuration",), np.array([1.0, 2.0]), "mm")}))
    assert found.drive_value.tolist() == [10.0, 20.0]
    assert found.value.tolist() == [1.0, 2.0]


def test_a_result_with_nothing_in_it_is_an_empty_table() -> None:
    assert jp.frame(xr.Dataset()).columns.tolist() == ["variable", "value", "text", "unit"]
    assert len(jp.frame(xr.Dataset())) == 0


@pytest.mark.parametrize(("kind", "read"), [("parquet", pd.read_parquet), ("xlsx", pd.read_excel)])
def test_files_have_the_rows_of_the_frame(tmp_path: Path, kind: str, read) -> None:  # type: ignore[no-untyped-def]
    """Read back with pandas."""
    pytest.importorskip({"parquet": "pyarrow", "xlsx": "openpyxl"}[kind])
    result = jp.worst(example("four-bar"))
    path = tmp_path / f"r.{kind}"
    jp.save(result, path)
    sheet = {"sheet_name": "worst"} if kind == "xlsx" else {}
    found, wanted = read(path, **sheet), jp.frame(result)
    assert found.columns.tolist() == wanted.columns.tolist()
    # Excel has fifteen to sixteen digits.
    rtol = 1e-15 if kind == "xlsx" else 0.0
    np.testing.assert_allclose(found.value.to_numpy(float), wanted.value.to_numpy(float), rtol=rtol, atol=0)
    assert found.variable.astype(str).tolist() == wanted.variable.astype(str).tolist()
    assert found.unit.fillna("").astype(str).tolist() == wanted.unit.astype(object).fillna("").astype(str).tolist()
    assert found.configuration.isna().tolist() == wanted.configuration.isna().tolist()


@pytest.mark.parametrize(("kind", "module"), [("parquet", "pyarrow"), ("xlsx", "openpyxl")])
def test_what_is_not_installed_is_named(tmp_path: Path, kind: str, module: str) -> None:
    """Without the packages there is one message, exit code 2 and no file."""
    code = f"import sys; sys.modules['{module}'] = sys.modules['fastparquet'] = None; from jointplay.cli import run; "
    (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"), encoding="utf-8")
    code += f"sys.exit(run(['error', 'm.toml', '-q', 'worst', '-o', 'r.{kind}']))"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "pip install 'jointplay[tables]'" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / f"r.{kind}").exists()
