"""`jointplay assemble`: what it prints, writes and draws; and the best order, by brute force over all of them."""

import csv
import itertools
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg

import jointplay as jp
from helpers.answers import example
from jointplay.cli import run
from jointplay.errors import InputError
from jointplay.plot.assembly import assembly, outline
from jointplay.plot.solid import OBLIQUE

LEGS = [["lower1"], ["lower2"], ["lower3"], ["upper1"], ["upper2"], ["upper3", "platform"]]
ORDER = 'assembly.steps=[["crank"],["coupler","rocker"]]'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("four-bar", "antenna-support", "redundant-bar", "3-upu"):
        Path(f"{name}.toml").write_text(jp.examples.text(name), encoding="utf-8")
    return tmp_path


def test_the_sequence_is_printed_as_one_would_follow_it(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["assemble", "antenna-support.toml"]) == 1
    out = capsys.readouterr().out
    lines = [line.split() for line in out.splitlines() if line.strip()[:1].isdigit()]
    assert [line[0] for line in lines[:5]] == ["1", "2", "3", "4", "5"]
    assert "connect the links" in out
    assert "redundant link" in out
    assert "What to adjust" in out
    assert "Position errors after step 5" in out
    assert "with play" in out


def test_small_errors_are_told_in_microns(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small = ["-s", "joints.*.clearance.radial=0.002", "-s", ORDER]
    assert run(["assemble", "four-bar.toml", *small]) == 1
    assert "µm" in capsys.readouterr().out
    assert run(["assemble", "four-bar.toml", "-s", ORDER]) == 1
    assert "µm" not in capsys.readouterr().out


def test_what_does_not_fit_is_said_with_the_factor(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rigid = ["-s", 'assembly.steps=[["bar"]]', "-s", "bodies={}"]
    assert run(["assemble", "redundant-bar.toml", *rigid]) == 1
    out = capsys.readouterr().out
    assert "does not fit" in out
    assert "1.250" in out


def few(question: str, samples: int) -> list[str]:
    """Few specimens, of the question that has some."""
    return ["--samples", str(samples)] if question == "random" else []


@pytest.mark.parametrize("question", ["unit", "worst", "random"])
def test_every_question_is_printed_written_and_drawn(
    folder: Path, capsys: pytest.CaptureFixture[str], question: str
) -> None:
    command = ["assemble", "antenna-support.toml", "-q", question, *few(question, 20)]
    tolerance = ["-s", "dimensions.DF.tolerance=0.1"]
    codes = {run([*command, *tolerance]) for _ in range(1)}
    assert codes <= {0, 1}
    assert "Assembly on 'ground'" in capsys.readouterr().out
    for name in ("steps.nc", "steps.csv", "steps.json"):
        assert run([*command, *tolerance, "-o", name]) in (0, 1)
    with xr.open_dataset("steps.nc") as written:
        assert written.step.values.tolist() == [1, 2, 3, 4, 5]
        assert written.attrs["assemble"] == question
    head, *rows = csv.reader(Path("steps.csv").read_text(encoding="utf-8").splitlines())
    steps = {row[head.index("step")] for row in rows if row[0] == "status" or row[0] == "probability_of_fit"}
    assert steps == {"1", "2", "3", "4", "5"}
    assert run([*command, *tolerance, "--plot", "steps.svg"]) in (0, 1)
    assert Path("steps.svg").read_text(encoding="utf-8").count("axes_") >= 5


def test_a_mechanism_in_space_is_drawn(folder: Path) -> None:
    bodies = [name for name in example("3-upu").bodies if "." not in name]
    steps = f"assembly.steps={[[name] for name in bodies]}".replace("'", '"')
    assert run(["assemble", "3-upu.toml", "-s", steps, "--plot", "upu.png"]) == 1
    assert Path("upu.png").stat().st_size > 10_000


def test_panels_in_space_are_solid_drawings_whose_names_keep_apart(folder: Path) -> None:
    m = example("four-legged-platform")
    m = m.with_(
        {"assembly": {"base": "ground", "steps": [["mast"], ["leg1"], ["leg2", "leg3"], ["platform"], ["leg4"]]}}
    )
    figure = assembly(m, jp.assemble(m))
    FigureCanvasAgg(figure).draw()
    known, seen = {name.split("/")[0].partition(".")[0] for name in m.joints}, set()
    for axes in figure.axes:
        assert axes.name == "rectilinear"
        names = [text for text in axes.texts if text.get_text() in known]
        seen |= {text.get_text() for text in names}
        boxes = [text.get_window_extent() for text in names]
        assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
        assert all(figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1 for box in boxes)
    assert {"foot1", "foot2", "foot3", "foot4", "slide", "top1", "top4"} <= seen
    # Every step shows more surfaces than the one before.
    counts = [len(axes.collections[0].get_paths()) for axes in figure.axes]
    assert counts == sorted(counts)
    assert counts[0] < counts[-1]


def test_a_half_of_a_telescope_is_seen_before_the_other_half_is_there() -> None:
    m = example("3-upu").with_({"assembly": {"base": "ground", "steps": LEGS}})
    figure = assembly(m, jp.assemble(m))
    counts = [len(axes.collections[0].get_paths()) for axes in figure.axes]
    assert all(a < b for a, b in itertools.pairwise(counts))


def test_what_is_open_in_space_is_the_outline_of_its_ellipsoid() -> None:
    """Compared with the hull of points all over it."""
    m = example("3-upu").with_({"assembly": {"base": "ground", "steps": LEGS}})
    result = jp.assemble(m)
    axes = assembly(m, result, step="6", exaggerate=20.0).axes[0]
    joint = m.joints.index("top1.first")
    error, half = (
        np.array([result[f"{name}_shaft"].sel(step=6, component=c).values[joint] for c in "xyz"])
        for name in ("error", "undetermined")
    )
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(200_000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    around = OBLIQUE.flat(20.0 * half * ball)
    widths = sorted((np.ptp(around[:, 0]), np.ptp(around[:, 1])))
    found = [sorted(np.ptp(patch.get_xy(), axis=0)) for patch in axes.patches]
    assert any(np.allclose(one, widths, rtol=5e-3) for one in found)
    assert np.isfinite(error).all()


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ([], "the order of assembly is missing"),
        (["-s", 'assembly.steps=[["krank"]]'], "did you mean 'crank'"),
        (["-s", ORDER, "-c", "99"], "there is no configuration 99"),
        (["-s", ORDER, "-o", "steps.txt"], "'.txt' is not an extension"),
        (["-s", ORDER, "-q", "wurst"], "wurst"),
        (["-s", ORDER, "-q", "random", "--samples", "1"], "1 is not a number of samples"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], problem: str
) -> None:
    assert run(["assemble", "four-bar.toml", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert problem in error
    assert error.count("\n") == 1


@pytest.mark.parametrize("question", ["unit", "worst", "random"])
def test_after_ctrl_c_the_steps_that_are_done_are_told(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, question: str
) -> None:
    from jointplay.analyses.assemble import state

    made = state.Held.__init__

    def third_time(self: state.Held, step: object) -> None:
        if getattr(step, "members", None) == ("DF",):
            raise KeyboardInterrupt
        made(self, step)  # type: ignore[arg-type]

    monkeypatch.setattr(state.Held, "__init__", third_time)
    assert run(["assemble", "antenna-support.toml", "-q", question, *few(question, 10)]) == 130
    out = capsys.readouterr().out
    assert "Interrupted after 2 of 5 steps." in out
    assert "BD, ED" in out


# --- the best order --------------------------------------------------------------------------------------------------


def on_its_way(result: xr.Dataset) -> tuple[int, float]:
    """Freedoms held, and the largest force of a member."""
    return int(result.mobility.sum()), round(float(np.nan_to_num(np.abs(result.member_force)).max()), 6)


def test_the_best_order_is_the_best_of_all_orders() -> None:
    m = example("antenna-support").with_({"joints.*.clearance.radial": 0.05, "loads": None})
    steps = [["AF", "FI"], ["BD", "ED"], ["DF"], ["DI"]]
    every = {}
    for order in itertools.permutations(steps):
        every[str(order)] = on_its_way(jp.assemble(m.with_({"assembly.steps": list(order)})))
    found = jp.best_order(m.with_({"assembly.steps": steps}))
    best = min(every.values())
    assert on_its_way(jp.assemble(found)) == pytest.approx(best, rel=1e-6)
    assert max(every.values()) > best


def test_the_order_of_the_file_stays_where_none_is_better() -> None:
    m = example("antenna-support")
    assert jp.best_order(m).value("assembly.steps") == m.value("assembly.steps")


def test_the_best_order_by_error_and_what_it_refuses(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(
        ["assemble", "four-bar.toml", "--best", "error", "-s", 'assembly.steps=[["rocker"],["coupler"],["crank"]]']
    )
    first = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("    1 "))
    assert first.split()[1] == "crank"
    with pytest.raises(InputError, match="'forces' is not a criterion; did you mean 'force'"):
        jp.best_order(example("antenna-support"), "forces")
    bodies = [name for name in example("stewart-gough").bodies if "." not in name]
    m = example("stewart-gough").with_({"assembly.steps": [[name] for name in bodies]})
    with pytest.raises(InputError, match="too many orders"):
        jp.best_order(m)


def test_a_drawing_says_what_a_step_is_in_each_of_the_questions() -> None:
    m = jp.loads(jp.examples.text("antenna-support")).with_({"dimensions.DF.tolerance": 2.0})
    unit = assembly(m, jp.assemble(m))
    assert [panel.get_title(loc="left") for panel in unit.axes][4] == "5: DI: fits, with play"
    written = [text.get_text() for text in unit.axes[1].texts]
    assert {"B", "E", "D"} <= set(written)  # of the links that are new
    assert "I" not in written
    scatter = jp.assemble(m, "random", samples=200)
    share = 100.0 * scatter.probability_of_fit.values[2]
    assert assembly(m, scatter).axes[2].get_title(loc="left") == f"3: DF: {share:.3g} % fit without strain"


@pytest.mark.parametrize(
    ("points", "corners"),
    [
        ([[0, 0], [2, 2], [1, 1]], 2),  # on one line
        ([[0, 0], [4, 0], [2, 1], [0, 4], [4, 4]], 4),  # one of them inside
        ([[0, 0, 1], [4, 0, 1], [2, 2, 1], [0, 4, 1], [4, 4, 1]], 4),
    ],
)
def test_the_outline_of_a_body_goes_around_its_points(points: list[list[float]], corners: int) -> None:
    found = outline(np.array(points, dtype=float), 1e-9)
    assert len({tuple(point) for point in found.tolist()}) == corners
    # A notch would make the way around longer.
    length = np.linalg.norm(np.diff(found, axis=0), axis=1).sum()
    assert length == pytest.approx(2.0**1.5 if corners == 2 else 16.0)
