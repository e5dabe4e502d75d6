"""What a verdict rests on: which offsets, which sizes, which configurations; and one sentence over all questions."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import jointplay as jp
from helpers import verdict_files as files
from helpers.builders import planar
from jointplay.analyses import sweep
from jointplay.analyses.nominal import Interrupted
from jointplay.cli import run
from jointplay.result import Result, from_dataset, parts
from jointplay.result.conclusions import conclude, decide
from jointplay.result.table import tables
from jointplay.result.verdict import HELD, MISSED, NOT_SHOWN, is_good, of_nodes, outcome, verdict
from jointplay.show.reporting.sections import marked

#: outcomes of a configuration, and whether its numbers are relied on; None where it does not count
OUTCOMES = {
    "ok": True,
    "undetermined": True,
    "strained": True,
    "singular": False,
    "not_assembled": False,
    "other_branch": None,
    "outside_limits": None,
}
FEW = 512


def slide(**limits: object) -> jp.Mechanism:
    return jp.loads(files.SLIDE).with_({f"limits.{name}": value for name, value in limits.items()})


def first(result: object) -> str:
    return conclude(from_dataset(result)).sentences[0].text  # type: ignore[arg-type]


def changed(result: Result, name: str, values: np.ndarray) -> Result:
    return replace(result, data={**result.data, name: replace(result.data[name], values=values)})


def test_the_worst_case_of_what_is_elastic_says_that_it_has_no_loads() -> None:
    """An arm whose deflection was most of its error was told that the limits hold in the worst case, and no more."""
    for name, said in (("arm-with-gearboxes", True), ("serial-6r", False)):
        m = jp.loads(jp.examples.text(name))
        texts = [sentence.text for sentence in conclude(from_dataset(jp.worst(m))).sentences]
        assert ("Deformation under loads is not part of the worst case; `loaded` has it." in texts) == said


def test_a_clamp_that_its_load_presses_to_one_side_has_the_yield_of_that_side() -> None:
    """28 ppm were told, of offsets anywhere; under its load far more of the machines miss the limit."""
    m = slide(y=0.052, probability=0.99)
    result = jp.random(m, FEW)
    alone = {contact: jp.random(m, FEW, contact=contact) for contact in ("scattered", "loaded")}
    for end in ("", "_low", "_high"):
        np.testing.assert_array_equal(result[f"outside{end}"], alone["scattered"][f"outside{end}"])
        np.testing.assert_array_equal(result[f"outside_loaded{end}"], alone["loaded"][f"outside{end}"])
    assert first(result).startswith("Required yield 99 %: missed; ")
    assert " where the load decides the offsets, at configuration " in first(result)
    assert first(result).endswith(" where offsets scatter, at configuration 0 (feed = 0 mm).") or "100 %" in first(
        result
    )
    assert not is_good(from_dataset(result))
    assert first(alone["scattered"]).startswith("Required yield 99 %: ")
    assert "where offsets scatter" in first(alone["scattered"])
    assert "where the load decides" not in first(alone["scattered"])


@pytest.mark.parametrize("contact", ["scattered", "loaded"])
def test_the_file_says_which_offsets_its_yield_is_of(contact: str) -> None:
    m = slide(y=0.052, probability=0.99, contact=contact)
    result = jp.random(m, FEW)
    assert result.attrs["contact"] == contact
    assert "outside_loaded" not in result
    np.testing.assert_array_equal(result.outside, jp.random(m, FEW, contact=contact).outside)
    # What is asked goes before what the file says.
    other = {"scattered": "loaded", "loaded": "scattered"}[contact]
    assert jp.random(m, FEW, contact=other).attrs["contact"] == other


def test_a_mechanism_without_loads_has_the_yield_that_it_had() -> None:
    result = jp.random(jp.loads(files.SLIDE).with_({"loads": None, "limits.y": 0.05, "limits.probability": 0.9}), FEW)
    assert "outside_loaded" not in result
    assert "contact" not in result.attrs
    assert "offsets" not in first(result)


def test_the_load_case_with_the_largest_share_counts() -> None:
    m = jp.loads(jp.examples.text("slider-crank-cases")).with_({"limits.position": 0.15})
    result = jp.random(m, FEW).sel(output="pin")
    each = {case: jp.random(m.only("pin", case), FEW, contact="loaded") for case in m.load_cases}
    for k in range(result.sizes["configuration"]):
        most = max(each, key=lambda case: float(each[case].outside_high[k]))
        assert float(result.outside_loaded[k]) == float(each[most].outside[k])
        case = str(result.outside_loaded_case[k].item())
        assert float(each[case].outside_high[k]) == float(each[most].outside_high[k])


def test_as_many_specimens_are_drawn_under_the_load_as_decide() -> None:
    """Few where the interval is far from the required yield, all where it is in between."""
    alone = {"drives.feed.values": [0]}
    sure = jp.random(slide(y=0.06, probability=0.9).with_(alone), 32_768)
    assert sure.attrs["samples_loaded"] == 16_384
    share = float(jp.random(slide(y=0.0525).with_(alone), 16_384, contact="loaded").outside[0])
    close = jp.random(slide(y=0.0525, probability=1.0 - share).with_(alone), 32_768)
    assert close.attrs["samples_loaded"] == 32_768


def test_more_specimens_are_drawn_where_few_leave_a_yield_open() -> None:
    m = jp.loads(jp.examples.text("slider-crank")).with_({"drives.theta.values": [0, 60, 120], "limits.position": 0.1})
    alone = {count: jp.random(m, count, contact="loaded").outside.values for count in (16_384, 32_768)}
    k = int(np.argmax(alone[16_384]))
    result = jp.random(m.with_({"limits.probability": 1.0 - float(alone[16_384][k])}), 32_768)
    more = result.outside_loaded.values == alone[32_768]
    assert more[k]
    assert not more.all()
    np.testing.assert_array_equal(result.outside_loaded.values, np.where(more, alone[32_768], alone[16_384]))


def test_the_play_that_a_specimen_may_have_decides_under_a_load() -> None:
    """With play in the middle of its limits the error was 0.1319 of 0.15, with the largest 0.2105: limits "hold"."""
    m = slide(y=0.055)
    result = jp.loaded(m)
    for play in ("largest", "smallest"):
        alone = jp.loaded(m, sizes=play)
        reached = result[f"play_{play}"].sel(quantity="y")
        np.testing.assert_allclose(reached.sel(side="low"), alone.error.sel(component="y"), rtol=1e-12)
    assert first(result).startswith("Limit missed with the largest play: y -0.06 mm, 0.005 mm below -0.055 mm")
    assert first(result).endswith("with clearances of middle size -0.05 mm.")
    assert outcome(from_dataset(result)) == MISSED
    held = first(jp.loaded(slide(y=0.07)))
    assert held.startswith("Limits hold with clearances of middle size: ")
    assert held.endswith("with the largest and the smallest play as well.")
    only = jp.loaded(m, sizes="smallest")
    assert first(only).startswith("Limits hold with the smallest play: ")


@pytest.mark.parametrize("question", ["worst", "random"])
def test_rows_that_are_not_known_are_not_held(question: str) -> None:
    """Six of eight configurations were not assembled, and the limits held. Every pattern against a count by hand."""
    m = jp.loads(jp.examples.text("four-bar")).with_({"limits.position": 1.0, "limits.probability": 0.5, "loads": None})
    known = from_dataset(jp.worst(m, starts=2) if question == "worst" else jp.random(m, 64))
    rng = np.random.default_rng(5)
    count = known.sizes["configuration"]
    for _ in range(60):
        some = rng.choice([*OUTCOMES], rng.integers(1, 4))
        status = rng.choice(some, count)
        beyond = rng.random(count) < rng.choice([0.0, 0.3])
        result = changed(known, "status", status)
        if question == "worst":
            margin = np.where(beyond, -0.1, 0.1)[:, None] + 0.0 * known.get("margin")
            margin[:, :-2] = np.nan
            result = changed(changed(result, "margin", margin), "limit_met", ~(margin < 0.0))
        else:
            for end, value in (("", 0.6), ("_low", 0.55), ("_high", 0.65)):
                result = changed(result, f"outside{end}", np.where(beyond, value, value - 0.55))
        reliable = [OUTCOMES[one] for one in status]
        counts = [one is not None for one in reliable]
        if any(bad and one for bad, one in zip(beyond, reliable, strict=True)):
            expected = MISSED
        else:
            expected = HELD if any(counts) and all(one for one in reliable if one is not None) else NOT_SHOWN
        found = verdict(result)
        assert found.outcome == expected, (status, beyond)
        assert ("left out" in found.sentences[0]) == (any(counts) and not all(counts))
        assert is_good(result) == (expected == HELD and bool((status == "ok").all()))
        begins = {HELD: "Limits hold", MISSED: "Limit missed", NOT_SHOWN: "Not shown"}
        if question == "worst":
            assert found.sentences[0].startswith(begins[expected])


def test_an_answer_that_was_interrupted_shows_nothing() -> None:
    result = from_dataset(jp.worst(slide(y=1.0)))
    part = replace(result, attrs={**result.attrs, "incomplete": "interrupted after 3 of 8 configurations"})
    assert (outcome(result), outcome(part)) == (HELD, NOT_SHOWN)


def test_values_of_a_sweep_that_was_interrupted_are_judged() -> None:
    """Ctrl-C after two of three values: both held, and neither was said to."""

    def stop(done: int, _: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as stopped:
        sweep.compute(slide(y=1.0), "limits.y", [1.0, 1.1, 1.2], progress=stop)
    assert conclude(stopped.value.partial).sentences[0].text.startswith("Limits hold at all 2 values")
    assert conclude(stopped.value.partial).sentences[0].text.endswith("; the rest is not computed.")


def test_what_a_correction_leaves_is_judged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A limit that no drive can keep had no verdict and exit code 0."""
    m = jp.loads(jp.examples.text("four-bar"))
    left = float(jp.compensate(m).residual_position.max())
    file = tmp_path / "bar.toml"
    m.with_({"limits.position": 1.01 * left}).write(file)
    assert run(["compensate", str(file)]) == 0
    assert "Limits hold after the correction: position 1 mm" in capsys.readouterr().out
    assert run(["compensate", str(file), "-s", f"limits.position={0.99 * left!r}"]) == 1
    assert "Limit missed after the correction: position 1 mm" in capsys.readouterr().out
    aimed = jp.compensate(m.with_({"limits.position": 1.01 * left}), target=[0.0, 2.0])
    far = np.hypot(*(aimed.residual - aimed.target).sel(component=["x", "y"]).values.T)
    np.testing.assert_allclose(aimed.margin.sel(quantity="position"), 1.01 * left - far, rtol=1e-9)


def test_one_sentence_decides_over_all_questions() -> None:
    m = slide(position=0.0555, probability=0.5)
    every = {"loaded": jp.loaded(m), "worst": jp.worst(m), "random": jp.random(m, FEW)}
    found = {name: parts(from_dataset(result)) for name, result in every.items()}
    said = decide(found)
    assert said is not None
    assert said.state == MISSED
    assert said.text == (
        "Limits missed: under the load (position 0.06 mm of 0.0555 mm with the largest play); in the worst case"
        f" (position {float(every['worst'].worst_position.max()):.4g} mm of 0.0555 mm). Held: in the required 50 % of"
        " the specimens where offsets scatter and where the load decides the offsets."
    )
    wide = {
        name: parts(from_dataset(ask(slide(position=1.0))))
        for name, ask in (("loaded", jp.loaded), ("worst", jp.worst))
    }
    said = decide(wide)
    assert said is not None
    text = "Limits hold under the load with clearances of any size in their limits and in the worst case."
    assert (said.text, said.state) == (text, HELD)
    assert decide({"worst": wide["worst"]}) is None


def test_a_map_has_a_verdict_on_its_yield() -> None:
    m = slide(y=0.052, probability=0.99)
    result = jp.map(m, "random", {"feed": [0, 10, 20]}, samples=FEW)
    nodes, basis = of_nodes(from_dataset(result)) or ((), "")
    assert nodes.tolist() == [MISSED] * 3
    assert basis == " where offsets scatter and where the load decides the offsets"
    assert first(result) == (
        "The required yield of 99 % is missed at 3 of the 3 nodes with a pose, where offsets scatter and where the"
        " load decides the offsets."
    )
    light = from_dataset(result)
    gone = changed(light, "status", np.array(["not_assembled", "other_branch", "singular"]))
    assert conclude(gone).sentences[0].text.startswith("Not shown: whether the required yield of 99 % is met at 1 of")


def test_each_of_two_mechanisms_keeps_to_its_own_yield() -> None:
    """Both were judged by the share that the first one asks for."""
    strict, easy = slide(y=0.052, probability=0.99, contact="loaded"), slide(y=0.052, probability=0.2, contact="loaded")
    compared = jp.compare(easy, strict, "random", names=("easy", "strict"), samples=FEW)
    said = [one.text for one in conclude(from_dataset(compared)).sentences[:2]]
    assert said[0].startswith("Limits hold in easy where the load")
    assert said[1] == "Limit missed: strict, at 3 of 3 configurations."
    swept = jp.sweep(easy, "limits.probability", [0.2, 0.99], "random", samples=FEW)
    assert " missed at 1 of 2 values, first at limits.probability = 0.99" in first(swept)


def test_a_sweep_of_shares_without_a_required_yield_has_no_verdict() -> None:
    """It said that limits hold at all values, and nobody had said how many may be outside."""
    swept = jp.sweep(slide(y=0.05), "limits.y", [0.001, 0.002], "random", samples=FEW)
    assert "Limits hold" not in " ".join(one.text for one in conclude(from_dataset(swept)).sentences)


def test_a_press_fit_is_said_to_be_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`check` had no word of interference."""
    text = jp.examples.text("four-bar-fits").replace('fit = "H8/f7"', 'fit = "H7/p6"', 1)
    m = jp.loads(text)
    play = jp.check(m).play[0].values
    assert play[0] < 0.0
    assert play[1] <= 0.0
    said = " ".join(sentence.text for sentence in conclude(from_dataset(jp.check(m))).sentences)
    assert f"always has interference, {abs(play[1]):.4g} mm to {-play[0]:.4g} mm" in said
    assert "taken as a joint without play" in said
    partly = m.with_({"joints.J1.clearance.fit": "H7/k6"})
    low, high = jp.check(partly).play[0].values
    said = " ".join(sentence.text for sentence in conclude(from_dataset(jp.check(partly))).sentences)
    assert f"goes from {-low:.4g} mm interference to {high:.4g} mm play" in said
    assert any("no play" in note for note in tables(from_dataset(jp.loaded(m)))[0].notes)
    assert "interference" not in " ".join(
        s.text for s in conclude(from_dataset(jp.check(jp.loads(files.SLIDE)))).sentences
    )


def test_a_single_configuration_is_not_numbered() -> None:
    """The studio showed "0.1488 mm above 0.08 mm,; to tighten first"."""
    m = jp.loads(jp.examples.text("four-bar-fits")).with_({"drives.theta1": {"joint": "J1", "values": [40]}})
    for sentence in conclude(from_dataset(jp.worst(m))).sentences:
        assert ",;" not in sentence.text
        assert "configuration" not in sentence.text


def test_what_the_load_leaves_open_stands_beside_the_number_of_the_table() -> None:
    m = jp.loads(jp.examples.text("press")).with_({"drives.angle": {"joint": "main", "values": [180]}})
    result = jp.loaded(m)
    plain = float(np.hypot(*result.error[0].values[:2]))
    assert f"({plain:.4g} mm and what the load leaves open)" in first(result)


def test_marks_and_words_of_a_report_agree() -> None:
    """A red "missed" stood beside the words "not shown, more specimens decide"."""
    m = slide(y=0.0525, contact="loaded")
    share = float(jp.random(m, FEW).outside[0])
    found = verdict(from_dataset(jp.random(m.with_({"limits.probability": 1.0 - share}), FEW)))
    assert found.sentences[0].startswith(
        f"Required yield {100 * (1.0 - share):.3g} %: not shown, more specimens decide;"
    )
    assert marked(found.outcome) == '<strong class="not-shown">? not shown</strong>'
    assert not any(found.marks)
    assert [marked(one) for one in ("", HELD, MISSED)] == [
        "",
        '<strong class="held">✓ held</strong>',
        '<strong class="missed">✗ missed</strong>',
    ]


def test_rows_where_the_machine_cannot_be_are_named_wherever_limits_are_said_to_hold(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Sizes were said to hold the limits of a robot, and nothing told that half of its path is out of its strokes."""
    path = tmp_path / "robot.toml"
    path.write_text(jp.examples.text("3-upu"))
    changed = [str(path), "--set", "limits.drives.l1=[420, 440]"]
    for command in (["allow", *changed, "-q", "worst"], ["error", *changed, "-q", "worst", "-q", "loaded"]):
        run(command)
        first = " ".join(capsys.readouterr().out.split())
        assert (
            "left out: configuration 1, where the machine cannot be" in first.split("All sizes")[0].split("loaded ")[0]
        )


#: a slider-crank that is stretched at 150 mm
STRETCHED = planar()
STRETCHED.revolute("A", ground=(0, 0), c=(0, 0), clearance=jp.radial(0.01))
STRETCHED.revolute("B", c=(50, 0), r=(0, 0), clearance=jp.radial(0.01))
STRETCHED.revolute("C", r=(100, 0), s=(0, 0))
STRETCHED.prismatic("P", ground={"at": (0, 0), "axis": 0}, s={"at": (0, 0), "axis": 0})
STRETCHED.drive("d", joint="P", values=(120, 150))
STRETCHED.start("c", angle=30)
STRETCHED.start("r", angle=-20)
STRETCHED.output(body="c", at=(50, 0))
STRETCHED.limits(position=5)


def test_a_singular_row_is_called_so_by_all_questions(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """A stretched linkage was said not to be assembled, and its specimens, too."""
    path = tmp_path / "stretched.toml"
    path.write_text(STRETCHED.text())
    run(["allow", str(path), "-q", "worst"])
    assert "Not shown: whether the limits hold; configuration 1 is singular." in capsys.readouterr().out
    run(["error", str(path), "-q", "random", "--samples", "2000", "--all"])
    assert "not assembled" not in capsys.readouterr().out


def test_a_map_says_the_share_outside_where_no_yield_is_required(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """With limits alone the shares at the nodes were computed, and told nowhere."""
    path = tmp_path / "four-bar.toml"
    path.write_text(jp.examples.text("four-bar"))
    grid = ["-g", "theta1=30:60:2", "--set", "limits.position=1.5", "--samples", "2000"]
    run(["map", str(path), *grid, "-q", "random"])
    told = " ".join(capsys.readouterr().out.split())
    m = jp.load(path).with_({"limits.position": 1.5})
    share = float(jp.map(m, "random", {"theta1": [30, 60]}, samples=2000).outside.max())
    assert share > 0.0
    assert f"at most {100 * share:.3g} % of the specimens at theta1 = " in told
