"""Two mechanisms on one path: the second one is where the first one's drives have it, not where it passes once more."""

from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers.answers import example
from helpers.builders import planar
from jointplay import cli
from jointplay.analyses.compare import compute
from jointplay.analyses.nominal import follow, nominal
from jointplay.errors import InputError
from jointplay.result import from_dataset
from jointplay.result.conclusions import conclude
from jointplay.result.table import tables
from jointplay.result.table.notes import notes


@pytest.mark.parametrize("name", ["slider-crank", "press", "six-bar", "rssr", "geared-five-bar", "five-bar", "3-upu"])
def test_a_mechanism_beside_itself_has_the_same_errors(name: str) -> None:
    """Some pass a dead centre, behind which another pose has the output at the same place."""
    m = example(name)
    found = jp.compare(m, m, "worst", exact=False).worst_position_first_order.values
    assert np.isfinite(found).all()
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_with_other_lengths_it_stays_beside_the_drives_of_the_first() -> None:
    m = example("slider-crank")
    other = m.with_({"joints.wristpin.on.rod": [161, 0]})
    first = nominal(m)
    # The stroke is the same; only its ends may be out of reach.
    targets = first.output.copy()
    targets[:, 0] += 1e-3
    second = follow(other, targets, ("x",), first.drives)
    reached = second.status == 0
    assert reached.sum() > 0.9 * len(reached)
    assert np.abs(second.drives - first.drives)[reached].max() < 0.05


@pytest.mark.parametrize("question", ["worst", "random", "loaded", "compensate"])
@pytest.mark.parametrize("values", [[30.0, 60.0, 300.0], [300.0, 30.0, 60.0], [60.0, 320.0, 30.0, 300.0]])
def test_where_the_first_has_no_pose_the_second_is_unknown(question: str, values: list[float]) -> None:
    """Whoever commanded a value out of reach was told of errors there of a copy that follows nothing."""
    m = example("four-bar").with_({"drives.theta1.values": values})
    at = nominal(m)
    found = compute(m, m, question, **({"samples": 16} if question == "random" else {}))
    lost = at.status != 0
    assert 0 < lost.sum() < len(values)
    status = found.get("status")
    assert (status[1] == status[0]).all()
    assert (status[1, lost] == "not_assembled").all()
    for name, variable in found.data.items():
        # The target of a correction is what was asked for.
        is_found = variable.dims[:2] == ("mechanism", "configuration") and name != "target"
        if is_found and variable.values.dtype.kind == "f":
            first, second = variable.values
            assert np.isnan(second[lost]).all(), name
            assert second[~lost] == pytest.approx(first[~lost], rel=1e-6, abs=1e-9, nan_ok=True), name


def test_what_has_nothing_to_follow_counts_in_no_verdict_and_is_said() -> None:
    """Whoever compared a file with its copy was told of a limit missed once in one, and twice in the other."""
    m = example("four-bar").with_({"drives.theta1.values": [30.0, 60.0, 300.0], "limits.position": 3.3})
    found = compute(m, m, "worst", names=("a", "b"))
    said = " ".join(sentence.text for sentence in conclude(found).sentences)
    assert "Limit missed: a, at 1 of 3" in said
    assert "Limit missed: b, at 1 of 3" in said
    assert "Not ok in b: 1 of 3 configurations (a has no pose there)." in said
    assert "Configuration 2: b is unknown, because a has no pose there." in notes(found)


def test_of_two_that_are_not_shown_both_are_named() -> None:
    """Whoever read the answer took the second of two for one whose limits hold."""
    m = example("four-bar").with_({"drives.theta1.values": [30.0, 60.0, 300.0], "limits.position": 9.0})
    found = conclude(compute(m, m, "worst", names=("a", "b"))).sentences
    assert found[0].text == "Not shown: whether limits hold in a and b; configuration 2 is unknown."


def variants() -> list[jp.Mechanism]:
    """A press, one with tighter fits, and one with looser ones, whose limit is missed."""
    base = example("press").with_({"drives.angle.count": 3})
    tight = base.with_({"joints.*.clearance.fit": "H6/g5"})
    return [base, tight, base.with_({"joints.*.clearance.fit": "H8/f7", "limits.position": 0.11})]


def test_every_variant_has_the_errors_of_two_files() -> None:
    every = variants()
    found = jp.compare(*every, names=("A", "B", "C"))
    assert found.mechanism.values.tolist() == ["A", "B", "C"]
    for m, name in zip(every[1:], "BC", strict=True):
        pair = jp.compare(every[0], m).isel(mechanism=1)
        for variable in ("worst_position", "drive_value", "mismatch"):
            np.testing.assert_array_equal(found[variable].sel(mechanism=name), pair[variable])
    loaded = jp.compare(*every, "loaded", names=("A", "B", "C"))
    np.testing.assert_array_equal(loaded.error.sel(mechanism="C"), jp.loaded(every[2]).error)
    # A result says what it is of.
    assert [found.attrs[f"mechanism_hash_{letter}"] for letter in "abc"] == [m.hash for m in every]


def test_the_best_is_named_with_what_it_is_better_by() -> None:
    every = variants()
    result = compute(*every[:2], others=every[2:], names=("A", "B", "C"))
    tops = [float(jp.worst(m).worst_position.max()) for m in every]
    said = [sentence.text for sentence in conclude(result).sentences]
    assert said[:2] == ["Limits hold in A and B.", "Limit missed: C, at 3 of 3 configurations."]
    least = f"largest position error {tops[1]:.4g} mm, {100 * (1 - tops[1] / tops[0]):.3g} % below A"
    # The guide alone turns the ram, and is the same in all.
    assert said[2] == f"B is best: {least}."
    first, _ = tables(result)
    cells = {column.name: column.cells for column in first.columns}
    assert cells[""][:2] == ("limits", "largest position, mm")
    assert cells["C"][0] == "missed"
    assert cells["C"][2] == f"{100 * (tops[2] / tops[0] - 1):+.3g} %"
    # Two alike have no best.
    alike = conclude(compute(every[0], every[0])).sentences
    assert not any("best" in sentence.text for sentence in alike)


def test_what_a_load_leaves_open_makes_none_the_best() -> None:
    """A load along a guide leaves it at any corner, one beside it presses it to one: neither is better."""
    at = {"arm": {"at": [100, 0], "axis": [1, 0]}, "rod": {"at": [0, 0], "axis": [1, 0]}}
    raw = {
        "format": 1,
        "units": {"length": "mm", "angle": "deg", "force": "N"},
        "joints": {
            "A": {"type": "revolute", "on": {"ground": [0, 0], "arm": [0, 0]}},
            "S": {"type": "prismatic", "on": at, "clearance": {"gap": 0.02, "length": 30}},
        },
        "drives": {"q": {"joint": "A", "values": [0]}, "s": {"joint": "S", "values": [10]}},
        "output": {"body": "rod", "at": [50, 0]},
        "loads": [{"force": [-10, 0], "at": [50, 10]}],
    }
    beside = jp.Mechanism(raw)
    along = beside.with_({"loads.0.at": [50, 0]})
    loose = along.with_({"joints.S.clearance.gap": 0.05})
    for other, text in (
        (along, ""),
        (loose, "A is best: largest position error, with what the load leaves open, 0.06667 mm, 60 % below B;"),
    ):
        said = [one.text for one in conclude(compute(beside, other, "loaded", names=("A", "B"))).sentences]
        assert [one[: len(text)] for one in said if "is best" in one] == [text] * bool(text)


def test_what_leaves_the_path_is_told_of_the_best() -> None:
    result = compute(example("four-bar"), example("slider-crank"))
    (best,) = (s.text for s in conclude(result).sentences if "is best" in s.text)
    off = float(np.hypot(*result.get("mismatch")[1, :, :2].T).max()) * 1.0
    assert best.startswith(
        f"slider-crank, which leaves the path by up to {off:.4g} mm, is best: largest position error"
    )


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        (("worst", "A"), TypeError, "one text behind the mechanisms"),
        (("random", "worst"), TypeError, "one text behind the mechanisms"),
        ((1,), TypeError, "'more' is a Mechanism or text"),
        ((), InputError, "3 mechanisms need 3 names, not 2"),
    ],
)
def test_other_arguments_are_refused(arguments: tuple[object, ...], error: type[Exception], said: str) -> None:
    m = example("four-bar")
    with pytest.raises(error, match=said):
        jp.compare(m, m, m, *arguments, names=("a", "b"))


def test_the_command_takes_many_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, m in zip("abc", variants(), strict=True):
        m.write(Path(f"{name}.toml"))
    files = ["a.toml", "b.toml", "c.toml"]
    assert cli.run(["compare", *files]) == 0
    assert "b is best: largest position error" in " ".join(capsys.readouterr().out.split())
    assert cli.run(["compare", *files, "-o", "all.csv"]) == 0
    assert sorted(path.name for path in tmp_path.glob("all.csv*")) == [
        "all.csv",
        *(f"all.csv.{letter}.toml" for letter in "abc"),
    ]
    assert jp.load("all.csv") == jp.load("a.toml")


def test_rounding_is_no_rotation():
    """A sweep and a comparison told a largest rotation of 1e-15 degrees where `error` said that there is none."""
    b = planar()
    b.revolute("pivot", ground=(0, 0), arm=(0, 0), clearance={"radial": 0.05})
    b.drive("q", joint="pivot", values=[0, 45, 90])
    b.output(body="arm", at=(200, 0))
    m = b.mechanism()
    swept = jp.sweep(m, "joints.pivot.clearance.radial", [0.01, 0.05])
    for result in (swept, jp.compare(m, m)):
        assert "otation" not in " ".join(s.text for s in conclude(from_dataset(result)).sentences)
