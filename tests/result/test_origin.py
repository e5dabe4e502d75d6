"""A result found in a folder weeks later says which mechanism it is of, and can be asked again."""

import json
from pathlib import Path

import pytest
import xarray as xr

import jointplay as jp
from jointplay.cli import run

FORMATS = (".nc", ".zarr", ".json", ".parquet", ".xlsx", ".csv")
CHANGE = {"joints.J1.clearance.radial": 0.5}


def four_bar() -> jp.Mechanism:
    return jp.loads(jp.examples.text("four-bar")).with_(CHANGE)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_result_in_a_file_gives_its_mechanism_back(tmp_path: Path, suffix: str) -> None:
    m = four_bar()
    path = tmp_path / f"worst{suffix}"
    jp.save(jp.worst(m), path)
    back = jp.load(path)
    assert back == m
    assert back.hash == m.hash != jp.loads(jp.examples.text("four-bar")).hash


@pytest.mark.parametrize("name", jp.examples.names())
def test_the_complete_text_of_every_example_is_the_mechanism(name: str) -> None:
    m = jp.loads(jp.examples.text(name))
    for one in (m, m.with_({"title": "changed"})):
        assert jp.loads(one.complete_text) == one
        assert jp.loads(one.complete_text).hash == one.hash


def test_parts_and_tables_of_other_files_are_in_the_text(tmp_path: Path) -> None:
    """The file alone does not say what the machine was when its leg stands in another one, which changes next week."""
    (tmp_path / "leg.toml").write_text('[joints.J2]\ntype = "revolute"\non = { arm = [50, 0], tool = [0, 0] }\n')
    (tmp_path / "angles.csv").write_text("q,p\n0,10\n30,20\n")
    (tmp_path / "arm.toml").write_text(
        'format = 1\nunits = { length = "mm", angle = "deg", force = "N" }\ninclude = ["leg.toml"]\n'
        '[joints.J1]\ntype = "revolute"\non = { ground = [0, 0], arm = [0, 0] }\nclearance = { radial = 0.1 }\n'
        '[drives.q]\njoint = "J1"\ncsv = "angles.csv"\n'
        '[drives.p]\njoint = "J2"\ncsv = "angles.csv"\n'
        '[output]\nbody = "tool"\nat = [30, 0]\n'
    )
    m = jp.load(tmp_path / "arm.toml")
    jp.save(jp.worst(m), tmp_path / "worst.json")
    for part in ("leg.toml", "angles.csv", "arm.toml"):
        (tmp_path / part).unlink()
    again = jp.load(tmp_path / "worst.json")
    assert again == m
    assert again.drive_values is not None
    assert again.drive_values.shape == (2, 2)


def test_what_is_typed_is_in_what_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`--set` stood nowhere in the file that was written."""
    monkeypatch.chdir(tmp_path)
    Path("four-bar.toml").write_text(jp.examples.text("four-bar"))
    typed = ["-s", "joints.J1.clearance.radial=0.5", "--samples", "512", "--seed", "7", "-o", "set.nc"]
    run(["error", "four-bar.toml", "-q", "worst", "-q", "random", *typed])
    with xr.open_dataset("set.nc", engine="h5netcdf") as found:
        options = json.loads(found.attrs["options"])
        assert options["random"]["seed"] == 7
        assert options["random"]["samples"] == 512
        assert options["worst"]["starts"] > 0
        assert found.attrs["created"].count("-") == 2
    assert jp.load("set.nc") == four_bar()
    # The same result is asked again from the file itself.
    assert run(["error", "set.nc", "-q", "worst"]) == 0


def test_a_part_of_a_mechanism_carries_the_whole() -> None:
    m = jp.loads(jp.examples.text("slider-crank-cases")).with_({"title": "changed"})
    parts = [m.first, *(m.only(load_case=name) for name in m.load_cases), *(m.only(output=name) for name in m.outputs)]
    for part in parts:
        assert jp.loads(jp.solve(part).attrs["mechanism"]) == m


def test_a_comparison_carries_both(tmp_path: Path) -> None:
    a, b = jp.loads(jp.examples.text("four-bar")), four_bar()
    result = jp.compare(a, b, names=("before", "after"))
    assert result.attrs["mechanism_hash_a"] == a.hash
    assert jp.loads(result.attrs["mechanism_b"]) == b
    for suffix in FORMATS:
        jp.save(result, tmp_path / f"both{suffix}")
        assert jp.load(tmp_path / f"both{suffix}") == a
    assert jp.load(tmp_path / "both.csv.b.toml") == b


@pytest.mark.parametrize("suffix", [".zarr", ".nc"])
def test_a_map_that_is_written_in_chunks_carries_its_grid(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"map{suffix}"
    m = jp.loads(jp.examples.text("five-bar"))
    jp.map(m, "worst", {"x": [-10, 0, 10], "y": [180, 190]}, path=path, chunk=2)
    back = jp.load(path)
    assert back.grid is not None
    assert back.grid.shape == (3, 2)
    assert json.loads(xr.open_dataset(path, engine="h5netcdf" if suffix == ".nc" else "zarr").attrs["options"])[
        "starts"
    ]


def test_a_sweep_has_the_seed_that_was_left_out() -> None:
    result = jp.sweep(four_bar(), "joints.J2.clearance.radial", [0.1, 0.2], "random", samples=256)
    assert json.loads(result.attrs["options"]) | {"seed": 0, "samples": 256} == json.loads(result.attrs["options"])


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("old.json", '{"attrs": {}}', "does not say which mechanism"),
        ("broken.json", "{", "cannot be read as a result"),
        ("broken.nc", "no", "cannot be read as a result"),
        ("alone.csv", "variable,value\n", "does not say which mechanism"),
    ],
)
def test_what_carries_no_mechanism_is_refused(tmp_path: Path, name: str, content: str, said: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(jp.InputError, match=said):
        jp.load(tmp_path / name)


def test_a_long_line_of_a_mechanism_comes_back_from_a_sheet(tmp_path: Path) -> None:
    """A cell holds 32,767 letters; a table of values that is written out has more in a line."""
    values = [round(20 + 0.001 * k, 3) for k in range(9000)]
    m = four_bar().with_({"drives.theta1.values": values})
    jp.save(jp.check(m), tmp_path / "check.xlsx")
    assert jp.load(tmp_path / "check.xlsx") == m
