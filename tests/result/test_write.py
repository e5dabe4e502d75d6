"""Results as files: nothing lost, nothing half written."""

import csv
import json
import stat
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import jointplay as jp
from jointplay.cli import run

BAD = [22.7, 180.0, 60.0]


def four_bar(**changes: Any) -> jp.Mechanism:
    return jp.loads(jp.examples.text("four-bar"), "four-bar.toml").with_(changes)


def answers() -> dict[str, xr.Dataset]:
    """One result of every shape, one of them with a configuration that is not assembled."""
    m = four_bar()
    broken = m.with_({"drives.theta1.values": BAD})
    other = jp.loads(jp.examples.text("p3r"), "p3r.toml")
    return {
        "check": jp.check(m),
        "solve": jp.solve(broken),
        "given": jp.given(m, {"J1": [0.5, 0.0]}),
        "loaded": jp.loaded(broken),
        "worst": jp.worst(broken),
        "random": jp.random(broken, samples=1000),
        "compensate": jp.compensate(broken),
        "compare": jp.compare(m, other, "loaded"),
        "sweep": jp.sweep(m, "joints.*.clearance.radial", [0.1, 1.0], "loaded"),
    }


ANSWERS = answers()


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.parametrize("name", ANSWERS)
class TestEveryResult:
    def test_netcdf_gives_back_what_was_written(self, name: str, tmp_path: Path) -> None:
        path = tmp_path / "result.nc"
        jp.save(ANSWERS[name], path)
        with xr.open_dataset(path, engine="h5netcdf") as back:
            back.load()
        result = ANSWERS[name]
        assert set(back.variables) == set(result.variables)
        assert back.attrs == result.attrs
        for key, variable in result.variables.items():
            assert back[key].attrs == variable.attrs, key
            if variable.dtype.kind == "U":
                assert back[key].values.tolist() == variable.values.tolist()
            else:
                np.testing.assert_array_equal(back[key].values, variable.values)

    def test_zarr_gives_back_what_was_written(self, name: str, tmp_path: Path) -> None:
        path = tmp_path / "result.zarr"
        for _ in range(2):  # what is there already is replaced
            jp.save(ANSWERS[name], path)
        with xr.open_zarr(path, chunks=None) as back:
            back.load()
        xr.testing.assert_identical(back, ANSWERS[name])
        assert [file.name for file in tmp_path.iterdir()] == ["result.zarr"]

    def test_json_gives_back_what_was_written(self, name: str, tmp_path: Path) -> None:
        path = tmp_path / "result.json"
        jp.save(ANSWERS[name], path)
        content = json.loads(path.read_text(encoding="utf-8"), parse_constant=lambda word: pytest.fail(word))
        back, result = xr.Dataset.from_dict(content), ANSWERS[name]
        assert set(back.variables) == set(result.variables)
        for key, variable in result.variables.items():
            assert back[key].dims == variable.dims
            assert back[key].attrs == variable.attrs
            if variable.dtype.kind == "f":
                np.testing.assert_array_equal(back[key].values.astype(float), variable.values)
            else:
                assert back[key].values.tolist() == variable.values.tolist()

    def test_csv_has_a_row_per_value(self, name: str, tmp_path: Path) -> None:
        path = tmp_path / "result.csv"
        jp.save(ANSWERS[name], path)
        rows, result = table(path), ANSWERS[name]
        assert len(rows) == sum(array.size for array in result.data_vars.values())
        assert len({len(row) for row in rows}) == 1
        assert not any(None in row or "nan" in row.values() for row in rows)


class TestCsv:
    def test_every_number_is_beside_its_labels(self, tmp_path: Path) -> None:
        result = jp.worst(four_bar())
        jp.save(result, tmp_path / "w.csv")
        rows = table(tmp_path / "w.csv")
        for row in (row for row in rows if row["variable"] == "worst_component"):
            at = {"configuration": int(row["configuration"]), "component": row["component"], "side": row["side"]}
            assert float(row["value"]) == result.worst_component.sel(at).item()
            assert float(row["theta1"]) == result.theta1.values[at["configuration"]]
            assert row["unit"] == ("deg" if row["component"] == "angle" else "mm")
            assert row["source"] == row["text"] == ""
        assert [row["text"] for row in rows if row["variable"] == "status"] == ["ok"] * 11

    def test_nothing_stands_for_what_is_not_a_number(self, tmp_path: Path) -> None:
        jp.save(ANSWERS["worst"], tmp_path / "w.csv")
        rows = table(tmp_path / "w.csv")
        assert [row["text"] for row in rows if row["variable"] == "status"] == ["ok", "not_assembled", "ok"]
        bad = next(row for row in rows if row["variable"] == "worst_position" and row["configuration"] == "1")
        assert bad["value"] == ""
        assert float(bad["theta1"]) == pytest.approx(180.0)

    def test_steps_of_a_sweep_are_distinguished(self, tmp_path: Path) -> None:
        jp.save(ANSWERS["sweep"], tmp_path / "s.csv")
        rows = [row for row in table(tmp_path / "s.csv") if row["variable"] == "error" and row["component"] == "x"]
        assert [row["radial"] for row in rows] == ["0.1"] * 11 + ["1.0"] * 11
        x = [float(row["value"]) for row in rows]
        np.testing.assert_array_equal(x, ANSWERS["sweep"].error.sel(component="x").values.reshape(-1))

    @pytest.mark.parametrize(("dialect", "between", "point"), [("comma", ",", "."), ("semicolon", ";", ",")])
    @pytest.mark.parametrize("name", ANSWERS)
    def test_pandas_reads_the_frame_back_in_every_dialect(
        self, name: str, dialect: str, between: str, point: str, tmp_path: Path
    ) -> None:
        """Numbers, labels and texts are those of the table that was never a file."""
        path = tmp_path / "r.csv"
        jp.save(ANSWERS[name], path, csv_dialect=dialect)
        strings = {"text": str, "unit": str}
        options: dict[str, Any] = {"sep": between, "decimal": point, "dtype": strings}
        back = pd.read_csv(path, keep_default_na=False, na_values={"value": [""]}, **options)
        frame = jp.frame(ANSWERS[name])
        assert back.columns.tolist() == frame.columns.tolist()
        assert back.value.dtype.kind == "f"
        # The quick reader of pandas may miss the last digit, and some digits before version 3.1.
        np.testing.assert_allclose(back.value.to_numpy(float), frame.value.to_numpy(float), rtol=1e-12, atol=0)
        for label in ("variable", "text", "unit"):
            assert back[label].astype(str).tolist() == frame[label].astype(object).fillna("").astype(str).tolist()
        if "theta1" in frame:
            numbers = pd.to_numeric(back.theta1.astype(str).str.replace(",", "."))
            np.testing.assert_allclose(numbers.to_numpy(float), frame.theta1.to_numpy(float), rtol=4e-16, atol=0)

    def test_another_dialect_is_refused_before_anything_is_written(self, tmp_path: Path) -> None:
        with pytest.raises(jp.InputError, match="'tab' is not a dialect"):
            jp.save(ANSWERS["given"], tmp_path / "r.csv", csv_dialect="tab")
        assert list(tmp_path.iterdir()) == []

    def test_the_command_writes_the_dialect(self, tmp_path: Path) -> None:
        (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"), encoding="utf-8")
        line = ["solve", str(tmp_path / "m.toml"), "-o", str(tmp_path / "r.csv"), "--csv-dialect", "semicolon"]
        assert run(line) == 0
        jp.save(jp.solve(four_bar()), tmp_path / "same.csv", csv_dialect="semicolon")
        assert (tmp_path / "r.csv").read_text() == (tmp_path / "same.csv").read_text()
        assert ";22,7;" in (tmp_path / "r.csv").read_text()

    @pytest.mark.parametrize("output", [[], ["-o", "r.json"]])
    def test_a_dialect_of_nothing_is_refused(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str], output: list[str]
    ) -> None:
        (tmp_path / "m.toml").write_text(jp.examples.text("four-bar"), encoding="utf-8")
        for command in ("check", "solve", "error"):
            assert run([command, str(tmp_path / "m.toml"), *output, "--csv-dialect", "semicolon"]) == 2
            assert capsys.readouterr().err == (
                "error: --csv-dialect: says how a .csv is written; -o NAME.csv says where it goes\n"
            )


class TestWriting:
    def test_an_existing_file_is_replaced_at_once(self, tmp_path: Path) -> None:
        path = tmp_path / "r.csv"
        path.write_text("old")
        jp.save(ANSWERS["given"], path)
        assert path.read_text().startswith("variable,configuration,")
        assert sorted(p.name for p in tmp_path.iterdir()) == ["r.csv", "r.csv.toml"]

    @pytest.mark.parametrize("problem", [OSError(28, "No space left on device"), KeyboardInterrupt(), RuntimeError()])
    @pytest.mark.parametrize("name", ["r.nc", "r.csv", "r.json"])
    def test_a_failure_leaves_what_was_there(
        self, name: str, problem: BaseException, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def fail(handle: int) -> None:
            raise problem

        path = tmp_path / name
        path.write_text("old")
        monkeypatch.setattr("os.fsync", fail)
        with pytest.raises(jp.InputError if isinstance(problem, OSError) else type(problem)):
            jp.save(ANSWERS["given"], path)
        assert path.read_text() == "old"
        assert [p.name for p in tmp_path.iterdir()] == [path.name]

    def test_it_is_as_readable_as_any_new_file(self, tmp_path: Path) -> None:
        plain = tmp_path / "plain"
        plain.touch()
        jp.save(ANSWERS["given"], tmp_path / "r.json")
        modes = [stat.S_IMODE(p.stat().st_mode) for p in (plain, tmp_path / "r.json")]
        assert modes[0] == modes[1]

    @pytest.mark.parametrize(
        ("name", "part"),
        [
            (
                "r.xls",
                "'.xls' is not an extension that can be written; known: .nc, .zarr, .csv, .json, .parquet, .xlsx, .md,"
                " .tex, .html",
            ),
            ("r", "has no extension"),
            ("nowhere/r.nc", "there is no folder"),
            ("folder.nc", "is a folder"),
            ("folder.zarr", "is a folder and no Zarr group, so that it is not replaced"),
        ],
    )
    def test_what_cannot_be_written_is_said(self, name: str, part: str, tmp_path: Path) -> None:
        for folder in ("folder.nc", "folder.zarr"):
            (tmp_path / folder).mkdir()
        with pytest.raises(jp.InputError) as refusal:
            jp.save(ANSWERS["given"], tmp_path / name)
        assert part in str(refusal.value)

    def test_extensions_may_be_in_capitals(self, tmp_path: Path) -> None:
        jp.save(ANSWERS["given"], tmp_path / "R.CSV")
        assert (tmp_path / "R.CSV").read_text().startswith("variable,configuration,")
