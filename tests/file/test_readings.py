"""Tables of readings as instruments and spreadsheets write them, and what is said of bad ones."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jointplay as jp
from helpers.built import DATA
from jointplay.analyses.readings import Readings, readings
from jointplay.cli import run
from jointplay.file.readings import sheet

GOOD = "theta [deg],x [mm],y [mm]\n0,70.5,59.7\n15,77.7,64.8\n30,78.6,70.6\n"
SIGMA = {"length": 0.001}


def table(text: str, folder: Path, m: jp.Mechanism | None = None, sigma: Any = SIGMA) -> Readings:
    path = folder / "readings.csv"
    path.write_text(text, encoding="utf-8")
    return readings(m or jp.load(DATA / "four-bar.toml"), path, sigma)


@pytest.mark.parametrize(
    "text",
    [
        GOOD,
        GOOD.replace(",", "\t"),
        GOOD.replace(",", ";").replace(".", ","),
        GOOD.replace("mm", "\N{MICRO SIGN}m").replace("70.5", "70500").replace("59.7", "59700").replace("77.7", "77700")
        .replace("64.8", "64800").replace("78.6", "78600").replace("70.6", "70600"),
        GOOD.replace("[deg]", "(\N{DEGREE SIGN})"),
        "\N{ZERO WIDTH NO-BREAK SPACE}" + GOOD.replace("\n", "\r\n"),
        GOOD.replace("\n", ",note\n").replace("theta [deg],x [mm],y [mm],note", "theta [deg],x [mm],y [mm],#by"),
        GOOD.replace(" [deg]", "").replace(" [mm]", ""),
    ],
    ids=["commas", "tabs", "decimal commas", "micrometres", "brackets", "windows", "notes", "units of the file"],
)  # fmt: skip
def test_one_table_in_many_spellings(text: str, tmp_path: Path) -> None:
    found = table(text, tmp_path)
    assert found.lines == [2, 3, 4]
    assert np.degrees(found.drives[:, 0]) == pytest.approx([0, 15, 30])
    assert found.values == pytest.approx(np.array([[70.5, 59.7], [77.7, 64.8], [78.6, 70.6]]) * 1e-3)
    assert found.sigma == pytest.approx(np.full((3, 2), 1e-6))


def test_empty_cells_were_not_read(tmp_path: Path) -> None:
    found = table(GOOD.replace("77.7", "").replace("70.5,59.7", ","), tmp_path)
    assert found.lines == [3, 4]
    assert found.given.tolist() == [[False, True], [True, True]]


def test_columns_of_python_are_a_table_as_well() -> None:
    found = sheet({"theta": np.array([0.0, 1.0]), "x [mm]": [1.0, float("nan")]})
    assert found.numbers("theta") == [0.0, 1.0]
    assert found.columns["x"].unit == "mm"
    assert np.isnan(found.numbers("x")[1])


def test_standard_deviations_come_from_the_table_first(tmp_path: Path) -> None:
    text = GOOD.replace("y [mm]", "y [mm],sigma_y [um]").replace(".7\n", ".7,5\n").replace(".8\n", ".8,6\n")
    found = table(text.replace(".6\n", ".6,7\n"), tmp_path, sigma={"length": 0.001, "y": 3.0})
    assert found.sigma[:, 1] == pytest.approx([5e-6, 6e-6, 7e-6])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x [mm]": "xx [mm]"}, "column \"xx\": 'xx' is no drive and nothing that is measured; did you mean 'x'"),
        ({"theta": "theat"}, "did you mean 'theta'"),
        ({"x [mm]": "x [kg]"}, "'kg' is not a unit of a length"),
        ({"70.5": "nan"}, "row 2, column \"x\": \"nan\" is no reading"),
        ({"70.5": "inf"}, "row 2, column \"x\": \"inf\" is no reading"),
        ({"70.5": "1e308"}, "row 2, column \"x\": \"1e308\" is no reading"),
        ({"77.7": "77.\f7"}, "row 3, column \"x\": a number is needed"),
        ({"77.7": "seven"}, "row 3, column \"x\": a number is needed, not \"seven\""),
        ({"15,": ","}, "row 3, column \"theta\": is empty"),
        ({"y [mm]": "x [mm]"}, "has \"x\" more than once"),
        ({"y [mm]": "load_case"}, "is not a load case of the file"),
        ({"15,77.7,64.8": "0,70.5,59.7"}, "row 3: is the same as row 2"),
        ({"x [mm]": "distance:J1-J9"}, "'J9' is not an output or a joint; known: output, J1"),
        ({"x [mm]": "distance:J1"}, "distance:POINT-POINT"),
        ({"x [mm]": "dial:J3:q"}, "\"q\" is no direction"),
        ({"x [mm]": "dial:J3"}, "dial:POINT:DIRECTION"),
        ({GOOD: "theta [deg],x [mm]\n"}, "has no readings"),
        ({GOOD: ""}, "has no readings"),
        ({"15,": "15,2,"}, "row 3 has 4 values for 3 columns"),
        ({"x [mm],y [mm]": "load_case,approach"}, "nothing is measured"),
    ],
)  # fmt: skip
def test_a_bad_table_gets_one_message(change: Mapping[str, str], message: str, tmp_path: Path) -> None:
    text = GOOD
    for before, after in change.items():
        assert before in text
        text = text.replace(before, after)
    with pytest.raises(jp.InputError) as problem:
        table(text, tmp_path)
    assert message in str(problem.value)
    assert "readings.csv" in str(problem.value)


@pytest.mark.parametrize("name", ["a" + " " * 60_000 + "b", "[" * 60_000, "(" * 60_000 + "]"])
def test_names_of_columns_are_read_in_bounded_time(name: str, tmp_path: Path) -> None:
    """A cell full of blanks or brackets in the first row took minutes."""
    with pytest.raises(jp.InputError, match="nothing that is measured"):
        table(GOOD.replace("x [mm]", name), tmp_path)


def test_a_standard_deviation_whose_square_is_no_number_is_none(tmp_path: Path) -> None:
    text = GOOD.replace("y [mm]\n", "y [mm],sigma_x [mm]\n").replace(".7\n", ".7,1e-320\n")
    with pytest.raises(jp.InputError, match='row 2, column "sigma_x": a standard deviation is larger'):
        table(text, tmp_path)


def test_a_distance_of_nothing_is_refused(tmp_path: Path) -> None:
    """Its derivative is none, and calibrate ended in a traceback."""
    file = tmp_path / "m.toml"
    file.write_text(jp.examples.text("five-bar"), encoding="utf-8")
    m = jp.load(file)
    path = _written("configuration,distance:C-output\n0,0.001\n1,0\n", tmp_path)
    with pytest.raises(jp.InputError, match='row 2, column "distance:C-output": C and output are at one place'):
        jp.calibrate(m, path, sigma=SIGMA)


def test_standard_deviations_too_far_apart_are_refused(tmp_path: Path) -> None:
    m = jp.load(DATA / "four-bar.toml")
    sigma = {"theta": 1e12, "length": 1e-3}
    with pytest.raises(jp.InputError, match=r"row 2: standard deviations .* too far apart"):
        jp.calibrate(m, _written(GOOD, tmp_path), sigma=sigma, free={"theta": 1.0})


def test_drives_out_of_their_limits_are_refused(tmp_path: Path) -> None:
    m = jp.load(DATA / "four-bar.toml").with_({"drives.theta.values": [0, 10], "limits.drives.theta": [-5, 20]})
    with pytest.raises(jp.InputError, match=r"row 4, column \"theta\": 30 deg is outside limits.drives.theta"):
        table(GOOD, tmp_path, m)


def test_a_place_where_the_machine_cannot_stand_names_its_row(tmp_path: Path) -> None:
    m = jp.load(DATA / "five-bar-reversal.toml")
    text = "left [deg],right [deg],x [mm],y [mm]\n150,80,0,150\n180,0,0,150\n"
    with pytest.raises(jp.InputError, match="row 3: at these drive values the mechanism of the file is not assembled"):
        jp.calibrate(m, _written(text, tmp_path), sigma=SIGMA)


@pytest.mark.parametrize(
    ("sigma", "message"),
    [
        (None, "the standard deviation of the readings of 'x' is missing"),
        ({"z": 1.0}, "'z' is not a measured column; known: x, y, length"),
        ({"length": 1.0, "z": 1.0}, "'z' is not a measured column"),
        ({"x": 0.0, "y": 1.0}, "0 is no standard deviation"),
        ("automatic", "neither 'auto' nor numbers by name"),
        ("auto", "0 repeated readings of one approach"),
    ],
)
def test_how_exact_readings_are_has_to_be_said(sigma: Any, message: str, tmp_path: Path) -> None:
    with pytest.raises(jp.InputError, match=message):
        table(GOOD, tmp_path, sigma=sigma)


def test_readings_of_one_approach_are_of_one_place(tmp_path: Path) -> None:
    text = GOOD.replace("y [mm]\n", "y [mm],approach\n").replace(".7\n", ".7,1\n").replace(".8\n", ".8,1\n")
    with pytest.raises(jp.InputError, match='row 3, column "approach": approach 1 began in row 2 at another place'):
        table(text.replace(".6\n", ".6,\n"), tmp_path)


def test_a_table_that_is_too_long_is_refused_at_once(tmp_path: Path) -> None:
    rows = "".join(f"{k / 100},1,2\n" for k in range(20_001))
    with pytest.raises(jp.InputError, match="has 20,001 rows; at most 20,000"):
        table(GOOD[: GOOD.index("0,70")] + rows, tmp_path)


def test_bad_input_ends_a_command_with_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _written(GOOD.replace("70.5", "nan"), tmp_path)
    out = tmp_path / "built.toml"
    assert (
        run(
            ["calibrate", str(DATA / "four-bar.toml"), "--measured", str(path), "--sigma", "length=0.1", "-o", str(out)]
        )
        == 2
    )
    said = capsys.readouterr()
    assert len(said.err.splitlines()) == 1
    assert not said.out
    assert not out.exists()


def _written(text: str, folder: Path) -> Path:
    path = folder / "readings.csv"
    path.write_text(text, encoding="utf-8")
    return path
