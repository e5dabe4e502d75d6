"""The command `map`: what it prints, refuses and draws."""

from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import distance
from jointplay import examples
from jointplay.cli import run
from jointplay.cli.arguments import gridded


@pytest.fixture
def say(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Run a command line in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    for name in ("3-rrr", "five-bar"):
        Path(f"{name}.toml").write_text(jp.examples.text(name), encoding="utf-8")

    def command(line: str) -> tuple[int, str, str]:
        code = run(line.split())
        return code, *capsys.readouterr()

    return command


def row(text: str, first: str) -> list[str]:
    """The cells of the row that begins with some words."""
    line = next(line for line in text.splitlines() if line.strip().startswith(first))
    return line.strip().removeprefix(first).split()


class TestSummary:
    def test_counts_sizes_and_places(self, say) -> None:
        code, out, _ = say("map 3-rrr.toml -g x=-120:120:25 -g y=-120:120:25 -g angle=0")
        grid = {"x": {"from": -120, "to": 120, "count": 25}, "y": {"from": -120, "to": 120, "count": 25}, "angle": 0}
        result = jp.map(jp.load("3-rrr.toml"), grid=grid)
        assert code == 1
        assert "Map over x, y: 25 × 25 nodes" in out
        good = (result.status == "ok").values
        assert row(out, "ok") == [str(good.sum()), f"{100 * good.mean():.1f}"]
        size = np.where(good, distance(result.error), np.nan)
        at = np.unravel_index(np.nanargmax(size), size.shape)
        unit, *sizes, x, y = row(out, "position error")
        expected = [*np.nanquantile(size, [0.5, 0.9, 0.99]), np.nanmax(size)]
        np.testing.assert_allclose([float(s) for s in sizes], expected, rtol=1e-3)
        assert (unit, float(x), float(y)) == ("mm", result.x[at[0]], result.y[at[1]])
        changes = int(result.contact_change.any("across").sum())
        assert f"At {changes} nodes a contact changes sides" in out

    def test_shares_add_up_to_the_whole(self, say) -> None:
        _, out, _ = say("map five-bar.toml -g x=-60:60:7 -g y=150,170,190")
        result = jp.map(jp.load("five-bar.toml"), grid={"x": np.linspace(-60, 60, 7), "y": [150.0, 170.0, 190.0]})
        parts = result.contribution.sel(component=["x", "y"])
        share = (parts * parts.sum("source")).sum(["x", "y", "component"])
        share = 100 * share / share.sum()
        assert float(share.sum()) == pytest.approx(100)
        for source in ("A", "B", "C", "D", "E"):
            assert float(row(out, source)[0]) == pytest.approx(float(share.sel(source=source)), abs=0.051)

    def test_without_details_nobody_is_blamed(self, say) -> None:
        code, out, _ = say("map five-bar.toml -g x=-60:60:7 -g y=150,170,190 --no-details")
        whole = say("map five-bar.toml -g x=-60:60:7 -g y=150,170,190")[1]
        assert code == 0
        tables = [text[text.index("Map over") :] for text in (out, whole)]
        assert tables[1].startswith(tables[0].rstrip())
        assert "To blame" in whole
        assert "to blame, over all nodes: " in " ".join(whole.split())
        assert "to blame" not in out.lower()

    def test_every_question(self, say) -> None:
        for question, figure in (
            ("worst", "largest position error"),
            ("random --samples 200 --law boundary", "position, 95 % of the specimens below"),
            ("given --offset A=0.02,0", "position error"),
            ("solve", "smallest singular value"),
        ):
            code, out, _ = say(f"map five-bar.toml -g left=120:150:4 -g right=40 -q {question}")
            assert code == 0
            assert figure in out

    def test_the_grid_of_the_file_and_in_its_place_that_of_the_line(self, say) -> None:
        with Path("five-bar.toml").open("a", encoding="utf-8") as file:
            file.write("\n[grid]\nx = { from = -60, to = 60, count = 5 }\ny = [150, 170]\n")
        assert "Map over x, y: 5 × 2 nodes" in say("map five-bar.toml")[1]
        assert "Map over x, y: 3 × 2 nodes" in say("map five-bar.toml --set grid.x.count=3")[1]
        assert "Map over left: 2 nodes" in say("map five-bar.toml -g left=120,130 -g right=40")[1]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("map five-bar.toml", "grid: say what is mapped"),
        ("map five-bar.toml -g x=1:2", '--grid x: "1:2" is not from:to:count'),
        ("map five-bar.toml -g x=1:2:1", "--grid x: 1 values; 2 to 100000 are possible"),
        ("map five-bar.toml -g x=1,b", '--grid x: "1,b" is not from:to:count, 1,2,5 or a number'),
        ("map five-bar.toml -g x=b", '--grid x: "b" is not a number'),
        ("map five-bar.toml -g x=1 -g x=2", "--grid: x is given twice"),
        ("map five-bar.toml -g x=1,2 -g y=150 -o a.csv", "a.csv: a map is written as .zarr or .nc"),
        ("map five-bar.toml -g x=1,2 -g y=150 --plot a.jpg", "a.jpg: drawings are written as .png, .svg, .pdf, .html"),
        ("map five-bar.toml -g x=1,2 -g y=150 --variable error.x", "--variable: says what is drawn; --plot says where"),
        (
            "map five-bar.toml -g x=-40:40:5 -g y=150,180 --plot a.svg -o a.zarr --variable eror.x",
            "'eror' is not a variable of this result; did you mean 'error'",
        ),
        (
            "map five-bar.toml -g x=-40:40:5 -g y=150,180 --plot a.svg -o a.zarr --variable error.z",
            "'z' is not a label of error along component",
        ),
    ],
)
def test_what_is_refused(say, line: str, said: str) -> None:
    code, out, error = say(line)
    assert code == 2
    assert out == ""
    assert said in error
    # What is refused is refused before the work.
    assert not Path("a.zarr").exists()


def test_maps_say_which_sizes_they_take(say) -> None:
    """A map looked as if it were of all sizes that the fits allow."""
    Path("fits.toml").write_text(examples.text("four-bar-fits"))
    _, out, _ = say("map fits.toml -q loaded -g theta1=30,40")
    assert "Sizes of clearances: in the middle of their limits." in out
    _, out, _ = say("map fits.toml -q worst -g theta1=30,40")
    assert "Sizes of clearances" not in out


def test_drawings_of_a_map_on_disk(say) -> None:
    pytest.importorskip("plotly")
    for plot in ("a.png", "a.html"):
        code, out, error = say(
            f"map five-bar.toml -g x=-60:60:7 -g y=150:190:5 -o a.zarr --plot {plot} --variable error.y"
        )
        assert (code, out, error) == (0, "", "")
        assert Path(plot).stat().st_size > 10_000


def test_ranges_on_the_line_are_symmetric() -> None:
    values = gridded({"x": "-0.3:0.3:7"})["x"]
    assert isinstance(values, list)
    assert values == [-v for v in reversed(values)]
