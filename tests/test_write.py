"""Results as files: nothing lost, nothing half written."""

from __future__ import annotations

import csv
import io
import json
import stat
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import jointplay as jp
from jointplay import write
from jointplay.result import from_dataset

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

    def test_csv_has_a_row_per_configuration_and_a_number_per_cell(self, name: str, tmp_path: Path) -> None:
        path = tmp_path / "result.csv"
        jp.save(ANSWERS[name], path)
        rows, result = table(path), ANSWERS[name]
        dims = [dim for dim in ("radial", "mechanism", "configuration") if dim in result.sizes]
        expected = int(np.prod([result.sizes[dim] for dim in dims])) if dims else result.sizes["joint"]
        assert len(rows) == expected
        assert len({len(row) for row in rows}) == 1
        assert not any(None in row or "nan" in row.values() for row in rows)


class TestCsv:
    def test_every_number_is_where_its_header_says(self, tmp_path: Path) -> None:
        result = jp.worst(four_bar())
        jp.save(result, tmp_path / "w.csv")
        rows = table(tmp_path / "w.csv")
        for k, row in enumerate(rows):
            at = result.isel(configuration=k)
            assert row["configuration"] == str(k)
            assert float(row["theta1 [deg]"]) == at.theta1.item()
            assert float(row["worst_position [mm]"]) == at.worst_position.item()
            assert float(row["worst_rotation [deg]"]) == at.worst_rotation.item()
            low = at.worst_component.sel(component="angle", side="low").item()
            assert float(row["worst_component.angle.low [deg]"]) == low
            offset = at.worst_offset.sel(extreme="rotation", parameter="J3.y").item()
            assert float(row["worst_offset.rotation.J3.y [mm]"]) == offset
            part = at.contribution.sel(extreme="rotation", source="J2").item()
            assert float(row["contribution.rotation.J2 [deg]"]) == part
            assert row["status"] == "ok"

    def test_units_of_products_and_squares(self, tmp_path: Path) -> None:
        jp.save(jp.random(four_bar(), samples=1000), tmp_path / "r.csv")
        header = table(tmp_path / "r.csv")[0]
        assert "error_covariance.x.angle [mm deg]" in header
        assert "contribution.J1.angle [deg^2]" in header
        assert "error_quantile.0.95.position [mm]" in header
        assert "failures.ok" in header
        assert not any(name.startswith(("histogram", "edge")) for name in header)

    def test_units_of_reactions(self, tmp_path: Path) -> None:
        jp.save(jp.loaded(four_bar()), tmp_path / "l.csv")
        header = table(tmp_path / "l.csv")[0]
        assert {"reaction.J1.fx [N]", "reaction.J1.moment [N mm]", "error.angle [deg]"} <= set(header)

    def test_nothing_stands_for_what_is_not_a_number(self, tmp_path: Path) -> None:
        jp.save(ANSWERS["worst"], tmp_path / "w.csv")
        rows = table(tmp_path / "w.csv")
        assert [row["status"] for row in rows] == ["ok", "not_assembled", "ok"]
        assert rows[1]["worst_position [mm]"] == ""
        assert float(rows[1]["theta1 [deg]"]) == pytest.approx(180.0)

    def test_steps_of_a_sweep_are_told_apart(self, tmp_path: Path) -> None:
        jp.save(ANSWERS["sweep"], tmp_path / "s.csv")
        rows = table(tmp_path / "s.csv")
        assert [row["radial [mm]"] for row in rows] == ["0.1"] * 11 + ["1.0"] * 11
        x = [float(row["error.x [mm]"]) for row in rows]
        np.testing.assert_array_equal(x, ANSWERS["sweep"].error.sel(component="x").values.reshape(-1))

    def test_it_reads_as_a_table_in_other_programs(self) -> None:
        pandas = pytest.importorskip("pandas")
        frame = pandas.read_csv(io.StringIO(write.to_csv(from_dataset(ANSWERS["loaded"]))))
        assert frame["error.y [mm]"].dtype.kind == "f"
        np.testing.assert_allclose(frame["error.y [mm]"], ANSWERS["loaded"].error.sel(component="y"), rtol=0, atol=0)


class TestWriting:
    def test_an_existing_file_is_replaced_at_once(self, tmp_path: Path) -> None:
        path = tmp_path / "r.csv"
        path.write_text("old")
        jp.save(ANSWERS["given"], path)
        assert "error.x [mm]" in path.read_text()
        assert [p.name for p in tmp_path.iterdir()] == ["r.csv"]

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
                "'.xls' is not an extension that can be written; known: .nc, .zarr, .csv, .json, .parquet, .xlsx",
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
        assert (tmp_path / "R.CSV").read_text().startswith("configuration,")
