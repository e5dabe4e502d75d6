"""Sweeps over two things: every pair is what a mechanism with both values says, in numbers, words, tables, figures."""

import shlex
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import QuadMesh

import jointplay as jp
from helpers.answers import example
from jointplay.analyses import sweep
from jointplay.analyses.nominal import Interrupted
from jointplay.cli import run
from jointplay.errors import InputError
from jointplay.result import from_dataset
from jointplay.result.conclusions import conclude
from jointplay.result.table import tables

FIRST, SECOND = "joints.J1.clearance.radial", "joints.J3.clearance.radial"
ONE, OTHER = [0.2, 0.9, 1.6], [0.2, 1.4]
DIM = "joints_J3_clearance_radial"


@pytest.fixture(scope="module")
def swept():
    return jp.sweep(example("four-bar"), FIRST, ONE, by={SECOND: OTHER})


def tops(swept):
    return swept.worst_position.max("configuration")


def test_every_pair_is_a_mechanism_with_both_values(swept):
    assert swept.worst_position.dims == (DIM, "radial", "configuration")
    assert swept.attrs["sweep"] == "radial"
    assert swept.attrs["sweep_by"] == DIM
    assert swept[DIM].attrs["units"] == "mm"
    for a in ONE:
        for b in OTHER:
            alone = jp.worst(example("four-bar").with_({FIRST: a, SECOND: b}))
            np.testing.assert_array_equal(swept.worst_position.sel({"radial": a, DIM: b}), alone.worst_position)
            np.testing.assert_array_equal(swept.status.sel({"radial": a, DIM: b}), alone.status)


def test_the_answer_names_the_best_and_the_worst_pair_and_counts_the_missed_ones(swept):
    said = [sentence.text for sentence in conclude(from_dataset(swept)).sentences]
    missed = int((tops(swept) > 4.0).sum())
    assert 0 < missed < tops(swept).size
    assert said[0] == f"Limits are missed at {missed} of 6 pairs of values."
    low, high = tops(swept).min().item(), tops(swept).max().item()
    assert f"{low:.4g} mm with radial = 0.2 mm, {DIM} = 0.2 mm" in said[1]
    assert f"{high:.4g} mm with radial = 1.6 mm, {DIM} = 1.4 mm" in said[1]
    assert "to blame: J1" in said[1]


def test_the_table_has_a_row_and_a_column_for_each_value(swept):
    table = tables(from_dataset(swept))[0]
    assert [column.name for column in table.columns] == ["radial", "0.2 mm", "1.4 mm"]
    for column, value in zip(table.columns[1:], OTHER, strict=True):
        np.testing.assert_allclose([float(cell) for cell in column.cells], tops(swept).sel({DIM: value}), atol=6e-4)
        assert list(column.alarms) == np.flatnonzero(tops(swept).sel({DIM: value}) > 4.0).tolist()


def test_the_figure_has_the_largest_errors_with_lines_of_equal_error_and_the_limit(swept):
    (axes, *_) = jp.plot.sweep(swept).axes
    # The keys as the file has them: "radial" alone would not say of which joint.
    assert (axes.get_xlabel(), axes.get_ylabel()) == tuple(
        f"joints.{joint}.clearance.radial [mm]" for joint in ("J1", "J3")
    )
    (mesh,) = (part for part in axes.collections if isinstance(part, QuadMesh))
    np.testing.assert_allclose(mesh.get_array(), tops(swept))
    # The limit of 4 mm, apart from the lines of equal error.
    assert [4.0] in [part.levels.tolist() for part in axes.collections if hasattr(part, "levels")]
    assert axes.texts
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["limit"]


def test_words_are_values_too():
    m = example("press")
    found = jp.sweep(
        m, "joints.main.clearance.fit", ["H7/f7", "H9/d9"], by={"joints.guide.clearance.gap": [0.01, 0.02]}
    )
    (axes, *_) = jp.plot.sweep(found).axes
    assert [text.get_text() for text in axes.get_xticklabels()] == ["H7/f7", "H9/d9"]
    assert "fit = H9/d9, gap = 0.02 mm" in conclude(from_dataset(found)).sentences[1].text
    # A row for each pair and configuration in long form.
    frame = jp.frame(found)
    assert len(frame[frame.variable == "worst_position"]) == found.worst_position.size


def test_of_two_outputs_and_scatter_each_has_its_own(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("m.toml").write_text(jp.examples.text("slider-crank-cases"), encoding="utf-8")
    line = "sweep m.toml -q random --samples 64 -s drives.theta.error=0,0.1 --by joints.guide.clearance.gap=0.01,0.05"
    assert run(shlex.split(line)) == 0
    said = capsys.readouterr().out
    assert "Output face: Random" in said
    assert "Output pin: Random" in said


def test_the_command_draws_and_refuses(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("m.toml").write_text(jp.examples.text("four-bar"), encoding="utf-8")
    assert run(shlex.split(f"sweep m.toml -s {FIRST}=0.2:1:2 --by {SECOND}=0.2,1 --plot p.png --size 85mm")) == 0
    assert Path("p.png").stat().st_size > 1000
    for option, message in (
        (f"{SECOND}=0.2", "--by: say what is swept: --by KEY=from:to:count"),
        ("joints.J9.clearance.radial=0.2,1", "'J9' is not a joint"),
        (SECOND, "--by"),
        (f"{SECOND}=0.2,1 --plot q.png --panel position-surface", "--panel: 'position-surface' is not a panel"),
        (f"{SECOND}=0.2,1 --plot q.png --quantity x", "--quantity: 'x' is not a quantity"),
    ):
        capsys.readouterr()
        assert run(shlex.split(f"sweep m.toml -s {FIRST}=0.2:1:2 --by {option}")) == 2
        assert message in capsys.readouterr().err
    with pytest.raises(InputError, match="by: takes one key"):
        jp.sweep(example("four-bar"), FIRST, ONE, by={})


def test_what_is_done_when_it_is_interrupted_is_given():
    def stop(done: int, total: int) -> None:
        assert total == 6
        if done == 4:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as stopped:
        sweep.compute(example("four-bar"), FIRST, ONE, by={SECOND: OTHER}, progress=stop)
    partial = stopped.value.partial
    assert partial.sizes[DIM] == 1
    assert partial.attrs["incomplete"] == f"interrupted after 1 of 2 values of {SECOND}"
    assert tables(partial)


def test_a_second_key_whose_values_are_replaced_is_refused():
    m, every = example("four-bar"), "joints.*.clearance.radial"
    for key, second in ((every, SECOND), (FIRST, FIRST)):
        with pytest.raises(InputError, match="replaced by those of"):
            jp.sweep(m, key, [0.1, 0.2], by={second: [0.1, 0.3]})
    # The other way round each value is used.
    swept = jp.sweep(m, SECOND, [0.1, 0.2], by={every: [0.1, 0.3]})
    assert len(np.unique(tops(swept).values.round(9))) == 4


def test_pairs_are_bounded_together():
    with pytest.raises(InputError, match="more than 100000 pairs"):
        jp.sweep(example("four-bar"), FIRST, [0.1] * 400, by={SECOND: [0.1] * 400})


def test_a_second_key_has_a_list_of_values():
    with pytest.raises(
        TypeError, match=r"'by' is a mapping with names as keys, each with a sequence of values or None, not"
    ):
        jp.sweep(example("four-bar"), FIRST, ONE, by={SECOND: 0.1})


def test_one_second_key_is_swept(tmp_path, capsys):
    (tmp_path / "m.toml").write_text(example("four-bar").text("m.toml"))
    call = [
        "sweep",
        str(tmp_path / "m.toml"),
        "--set",
        f"{FIRST}=1,2",
        "--by",
        f"{SECOND}=1,2",
        "--by",
        "loads.0.force.0=1,2",
    ]
    assert run(call) == 2
    assert "--by: one second key can be swept, here are 2" in capsys.readouterr().err
