"""Paths and drive values from tables beside the file."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp

FOUR_BAR = jp.examples.text("four-bar")
DRIVE = FOUR_BAR[FOUR_BAR.index("[drives.theta1]") : FOUR_BAR.index("[output]")]
FIVE_BAR = jp.examples.text("five-bar")
# The table of the path.
PATH = re.search(r"^\[path\]\n(?:\w.*\n)+", FIVE_BAR, re.MULTILINE)[0]  # type: ignore[index]


def load(folder: Path, text: str, table: str, name: str = "motion.csv") -> jp.Mechanism:
    (folder / name).write_text(table, encoding="utf-8")
    (folder / "m.toml").write_text(text, encoding="utf-8")
    return jp.load(folder / "m.toml")


def driven(rest: str = 'csv = "motion.csv"') -> str:
    return FOUR_BAR.replace(DRIVE, f'[drives.theta1]\njoint = "J1"\n{rest}\n\n')


def on_a_path(rest: str = 'csv = "motion.csv"') -> str:
    return FIVE_BAR.replace(PATH, f"[path]\n{rest}\n")


@pytest.mark.parametrize(
    "table",
    [
        "theta1\n30\n40.5\n50\n",
        "time,theta1 [deg],note\n0,30,\n1,40.5,a\n\n2,50,\n",
        "n;theta1 (deg)\n1;30\n2;40.5\n3;50\n",
        "\ufefftheta1[ deg ]\n3e1\n 40.5 \n50",
    ],
)
def test_drive_values_are_those_of_a_column(table: str, tmp_path: Path) -> None:
    m = load(tmp_path, driven(), table)
    assert m.value("drives.theta1.values") == [30.0, 40.5, 50.0]
    assert m == jp.loads(driven("values = [30, 40.5, 50]"))


def test_another_column_and_another_unit(tmp_path: Path) -> None:
    table = "a [rad];b\n0.5;1\n0.75;2\n"
    m = load(tmp_path, driven('csv = "motion.csv"\ncolumn = "a"'), table)
    np.testing.assert_allclose(m.value("drives.theta1.values"), np.rad2deg([0.5, 0.75]), rtol=1e-15)
    # The whole name of the column serves as well.
    assert load(tmp_path, driven('csv = "motion.csv"\ncolumn = "a [rad]"'), table) == m


def test_a_path_has_the_columns_of_its_components(tmp_path: Path) -> None:
    m = jp.loads(FIVE_BAR)
    xs, ys = m.value("path.x"), m.value("path.y")
    table = "t,x [m],y [cm],z\n" + "".join(f"0,{x / 1000!r},{y / 10!r},7\n" for x, y in zip(xs, ys, strict=True))
    read = load(tmp_path, on_a_path(), table)
    np.testing.assert_allclose(read.value("path.x"), xs, rtol=1e-14)
    np.testing.assert_allclose(read.value("path.y"), ys, rtol=1e-14)
    # The unit of the file leaves every digit as it is.
    table = "x [mm],y\n" + "".join(f"{x!r},{y!r}\n" for x, y in zip(xs, ys, strict=True))
    assert load(tmp_path, on_a_path(), table) == m


def test_a_travel_is_a_length_and_a_drive_of_a_pattern_has_a_table_too(tmp_path: Path) -> None:
    text = """
        format = 1
        space = "planar"
        units = { length = "in", angle = "deg", force = "N" }
        output = { body = "slide_2" }
        [patterns.p]
        count = 2
        about = { point = [0, 0], angle = 90 }
        [patterns.p.joints.guide]
        type = "prismatic"
        on = { ground = { at = [0, 0], axis = 0 }, slide = [0, 0] }
        [patterns.p.drives.q]
        joint = "guide"
        csv = "motion.csv"
        """
    m = load(tmp_path, text, "q [mm]\n25.4\n50.8\n")
    np.testing.assert_allclose(m.value("patterns.p.drives.q.values"), [1.0, 2.0], rtol=1e-15)
    np.testing.assert_allclose(jp.solve(m).nominal.sel(component="y"), [1.0, 2.0], rtol=1e-12)
    with pytest.raises(jp.InputError, match=r'the unit of column "q \[deg\]": \'deg\' is not a unit of a length'):
        load(tmp_path, text, "q [deg]\n1\n")


def test_the_file_goes_on_naming_its_table(tmp_path: Path) -> None:
    m = load(tmp_path, driven(), "theta1\n30\n40\n")
    better = m.with_({"joints.J1.clearance.radial": 0.25})
    better.write(tmp_path / "better.toml")
    text = (tmp_path / "better.toml").read_text(encoding="utf-8")
    assert 'csv = "motion.csv"' in text
    assert jp.load(tmp_path / "better.toml") == better
    # Where the table is not, and where its values have changed, they are written.
    (tmp_path / "elsewhere").mkdir()
    for changed, path in (
        (m, tmp_path / "elsewhere" / "m.toml"),
        (m.with_({"drives.theta1.values": [1, 2]}), path_of(tmp_path)),
    ):
        changed.write(path)
        text = path.read_text(encoding="utf-8")
        assert "csv" not in text
        assert jp.load(path) == changed


def path_of(folder: Path) -> Path:
    return folder / "other.toml"


@pytest.mark.parametrize(
    ("text", "table", "says"),
    [
        (driven('csv = "other.csv"'), "", r"drives\.theta1\.csv: there is no file \"other\.csv\" in the same folder"),
        (driven("csv = 3"), "", r"drives\.theta1\.csv: 3 is not the name of a file"),
        (driven('csv = "../motion.csv"'), "", "is not the name of a file in the same folder"),
        (driven(), "phi\n1\n", r"motion\.csv: drives\.theta1\.column: 'theta1' is not a column of its first row"),
        (driven('csv = "motion.csv"\ncolumn = 2'), "a\n1\n", r"drives\.theta1\.column: '2' is not a column"),
        (driven(), "theta1\n1\nx\n", 'row 3, column "theta1": a number is needed, not "x"'),
        (driven(), "theta1,b\n1,2\n,3\n", 'row 3, column "theta1": a number is needed, not ""'),
        (driven(), "theta1\n", 'column "theta1" has no values'),
        (driven(), "theta1 [mm]\n1\n", r"'mm' is not a unit of an angle; .*deg, rad"),
        (driven('csv = "motion.csv"\nvalues = [1]'), "theta1\n1\n", "give either csv, or values; not both"),
        (driven('csv = "motion.csv"\nfrom = 1'), "theta1\n1\n", "give either csv, or from; not both"),
        (driven('values = [1]\ncolumn = "a"'), "", "'column' goes with csv"),
        (on_a_path(), "a,b\n1,2\n", r"motion\.csv: path\.csv: the first row has none of x, y, angle, but a, b"),
        (on_a_path(), "x,y\n1\n", 'row 2, column "y": a number is needed, not ""'),
        (on_a_path('csv = "motion.csv"\nx = [1]'), "x\n1\n", "path: give either csv, or x; not both"),
        (on_a_path(), "x,y,y\n1,2,3\n", 'the first row has "y" more than once'),
    ],
)
def test_what_is_wrong_is_named(text: str, table: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(jp.InputError, match=says):
        load(tmp_path, text, table)


@pytest.mark.parametrize("text", [driven(), on_a_path()])
def test_a_table_is_read_with_its_file(text: str) -> None:
    with pytest.raises(
        jp.InputError, match=re.escape("not in a text or a change; write it in the file, or its values")
    ):
        jp.loads(text)


def test_values_in_the_unit_of_the_file_are_those_that_were_typed(tmp_path: Path) -> None:
    digits = "0.1000000000000000055"
    m = load(tmp_path, driven(), f"theta1 [deg]\n{digits}\n{math.pi!r}\n")
    assert m.value("drives.theta1.values") == [float(digits), math.pi]
