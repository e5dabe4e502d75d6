"""What to read next: against the fit that would be made of it, and against all choices there are."""

import itertools
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from jointplay import Mechanism
from jointplay.analyses import plan as planning
from jointplay.cli import run

DATA = Path(__file__).parent.parent / "data" / "calibrate"


def sigma(columns: list[str]) -> dict[str, float]:
    return dict.fromkeys(columns, 0.001)


def machine(name: str, **changes: object) -> Mechanism:
    return jp.load(DATA / f"{name}.toml").with_({"load_cases": None, **changes})


def nominal_table(m: Mechanism, places: list[int], columns: list[str]) -> dict[str, object]:
    """Readings of the machine as drawn, each an approach of its own."""
    drawn = jp.solve(m)
    table: dict[str, object] = {"configuration": places, "approach": list(range(len(places)))}
    return table | {name: drawn.nominal.sel(component=name).values[places] for name in columns}


def left(m: Mechanism, places: list[int], columns: list[str], **options: object) -> float:
    """What a fit of these readings would leave, by `calibrate`."""
    return float(jp.calibrate(m, nominal_table(m, places, columns), sigma=sigma(columns), **options).position_after)


@pytest.mark.parametrize(
    ("name", "columns", "options"),
    [
        ("four-bar", ["x", "y"], {}),
        ("3-rrr", ["x", "y", "angle"], {}),
        ("3-rrr", ["x", "y"], {"frame": "unknown"}),
        ("five-bar-reversal", ["x"], {"zeroed": ["x"]}),
        ("four-bar", ["x", "y"], {"free": ["coupler"]}),
    ],
)
def test_a_fit_of_what_is_planned_leaves_as_much(name: str, columns: list[str], options: dict[str, object]) -> None:
    m = machine(name)
    found = jp.plan(m, 6, columns=columns, sigma=sigma(columns), **options)  # type: ignore[arg-type]
    places = found.configuration.values.tolist()
    # What has no prior counts as known to 1e4 of what all rows together leave.
    assert float(found.position_after[-1]) == pytest.approx(left(m, places, columns, **options), rel=1e-6)
    assert (np.diff(found.position_after) <= 0.0).all()
    assert float(found.position_after[-1]) <= float(found.position_evenly)


@pytest.mark.parametrize(("name", "columns"), [("four-bar", ["x", "y"]), ("five-bar-reversal", ["y"])])
def test_no_other_choice_is_better(name: str, columns: list[str]) -> None:
    """All pairs and triples of every fourth configuration, by `calibrate`."""
    whole = machine(name)
    at = jp.solve(whole)
    values = {f"drives.{drive}.values": at[drive].values[::4].tolist() for drive in whole.drives}
    few = whole.with_({"path": None} | values)
    rows = range(len(at.status[::4]))
    for count in (1, 2, 3):
        best = min(left(few, [*places], columns) for places in itertools.combinations_with_replacement(rows, count))
        found = jp.plan(few, count, columns=columns, sigma=sigma(columns))
        assert float(found.position_after[-1]) == pytest.approx(best, rel=1e-9)


def test_readings_that_are_there_count() -> None:
    m, columns = machine("four-bar"), ["x", "y"]
    there = [0, 5]
    found = jp.plan(m, 3, columns=columns, sigma=sigma(columns), measured=nominal_table(m, there, columns))
    assert float(found.position_before) == pytest.approx(left(m, there, columns), rel=1e-9)
    both = [*there, *found.configuration.values.tolist()]
    assert float(found.position_after[-1]) == pytest.approx(left(m, both, columns), rel=1e-9)


def test_a_load_case_that_tells_sizes_is_chosen() -> None:
    """Where nothing presses the play, no reading tells how large it is."""
    m = jp.load(DATA / "five-bar-reversal.toml")
    found = planning.compute(m, 4, columns=("x", "y"), sigma={"length": 0.001})
    assert set(found.get("load_case")) <= {"", *m.load_cases}
    assert int(found.attrs["rows"]) == 25 * 5
    # Play that scatters is worse than play that lies where it is known to lie.
    assert "" not in set(found.get("load_case"))


def test_a_grid_has_places_too() -> None:
    columns = ["x"]
    path = machine("five-bar-reversal")
    grid = path.with_({"path": None, "grid": {"x": [-60, 0, 60], "y": [150, 190, 225]}})
    nodes = {"x": np.repeat([-60, 0, 60], 3).tolist(), "y": [150, 190, 225] * 3}
    found = jp.plan(grid, 3, columns="x", sigma=sigma(columns))
    same = jp.plan(path.with_({"path.x": nodes["x"], "path.y": nodes["y"]}), 3, columns="x", sigma=sigma(columns))
    assert (found.configuration == -1).all()
    np.testing.assert_allclose(found.drive_value, same.drive_value, rtol=1e-9)
    np.testing.assert_allclose(found.position_after, same.position_after, rtol=1e-9)


def test_more_readings_of_the_same_do_not_help() -> None:
    """With one dial on a link that has one tolerance, a second reading of many brings little: the first says it."""
    m = machine("four-bar")
    found = jp.plan(m, 12, columns=["x", "y"], sigma={"length": 1e-6})
    enough = int(found.enough)
    assert (found.gain[:enough] >= planning.HELPS).all()
    assert enough == 12 or float(found.gain[enough]) < planning.HELPS


def test_the_table_to_fill_in_is_read_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(DATA / "five-bar-reversal.toml")
    table = tmp_path / "readings.csv"
    asked = ["plan", file, "-n", "5", "--columns", "x,y", "--sigma", "length=0.001"]
    assert run([*asked, "-o", str(table)]) == 0
    assert "5 readings of x, y leave" in capsys.readouterr().out
    head, *lines = table.read_text().splitlines()
    assert head == "left [deg],right [deg],load_case,x [mm],y [mm]"
    assert len(lines) == 5
    # An empty cell is nothing that was read.
    assert run(["calibrate", file, "--measured", str(table), "--sigma", "length=0.001"]) == 2
    assert "no cell of a measured column has a value" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--columns", "x,z"], "columns: 'z' is not something that is measured; known: x, y, angle"),
        (["--columns", "x", "--sigma", "angle=1"], "sigma: the standard deviation of the readings of 'x' is missing"),
        (["--sigma", "length=1,angle=1", "--zeroed", "q"], "zeroed: 'q' is not a measured column"),
        (["--sigma", "length=1,angle=1", "--free", "nothing"], "nothing"),
        (["--sigma", "length=1,angle=1", "--sizes"], "sizes follow from readings under loads"),
        (["--columns", "x,x"], 'columns: "x" is there twice'),
        (["--sigma", "length=1,angle=1", "--free", "theta", "--fix", "theta"], "theta would be free and held"),
        (["-n", "5000"], "count"),
    ],
)
def test_what_is_refused(options: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["plan", str(DATA / "four-bar.toml"), *options]) == 2
    assert message in capsys.readouterr().err


def test_a_mechanism_without_drives_is_read_where_it_stands(tmp_path: Path) -> None:
    """Its table of drive values was asked for, and the command ended in a traceback."""
    path, out = tmp_path / "m.toml", tmp_path / "to-read.csv"
    path.write_text(jp.examples.text("x-braced-square"), encoding="utf-8")
    assert run(["plan", str(path), "-n", "2", "--columns", "x,y", "--sigma", "length=0.01", "-o", str(out)]) == 0
    assert out.read_text(encoding="utf-8").splitlines() == ["x [mm],y [mm]", ",", ","]


def test_a_component_that_is_called_as_a_drive_is_that_of_the_output(tmp_path: Path) -> None:
    """A drive of the name angle made a table with two columns of one name."""
    path, out = tmp_path / "m.toml", tmp_path / "to-read.csv"
    path.write_text(jp.examples.text("press"), encoding="utf-8")
    sizes = ["--sigma", "length=0.01,output.angle=0.01"]
    assert run(["plan", str(path), "-n", "2", *sizes, "-o", str(out)]) == 0
    assert out.read_text(encoding="utf-8").splitlines()[0] == "angle [deg],x [mm],y [mm],output.angle [deg]"
