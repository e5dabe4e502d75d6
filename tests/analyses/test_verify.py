"""Whether a measured machine keeps to its limits: risks by sampling, figures of the standards by their words."""

import numpy as np
import pytest
from scipy.stats import chi2, norm

import jointplay as jp
from jointplay import Mechanism, examples
from jointplay.cli import run
from jointplay.result import from_dataset
from jointplay.result.conclusions import conclude


def machine(**limits: object) -> Mechanism:
    m = jp.loads(examples.text("five-bar")).with_({"loads": None, "load_cases": None, "limits": None})
    return m.with_({f"limits.{name}": value for name, value in limits.items()})


def table(
    m: Mechanism, places: list[int], errors: list[tuple[float, float]], **more: list[object]
) -> dict[str, object]:
    drawn = jp.solve(m).nominal
    found: dict[str, object] = {"configuration": places, "approach": list(range(len(places)))}
    for k, name in enumerate(("x", "y")):
        found[name] = drawn.sel(component=name).values[places] + np.array(errors)[:, k]
    return found | more


def test_a_risk_is_how_often_the_true_value_is_beyond() -> None:
    """Against a million true values around each reading."""
    m = machine(position=0.1, x=[-0.02, 0.09])
    errors = [(0.06, 0.05), (0.08, 0.055), (0.0, 0.0), (-0.018, 0.02), (0.095, 0.0)]
    found = jp.verify(m, table(m, [0, 1, 2, 3, 4], errors), sigma={"length": 0.005})
    rng = np.random.default_rng(0)
    for visit, error in enumerate(errors):
        true = np.array(error) + 0.005 * rng.standard_normal((1_000_000, 2))
        beyond = {
            "position": (np.linalg.norm(true, axis=1) > 0.1).mean(),
            "x": ((true[:, 0] > 0.09) | (true[:, 0] < -0.02)).mean(),
        }
        for name, share in beyond.items():
            spread = np.sqrt(share * (1.0 - share) / len(true))
            assert float(found.risk[visit].sel(limited=name)) == pytest.approx(share, abs=4.5 * spread + 1e-6)
    assert found.status.item() == "undecided"
    assert found.total_risk.item() == pytest.approx(min(found.risk.sum().item(), 1.0))


def test_noise_in_all_directions_counts() -> None:
    """Near the middle of a sphere every direction leads beyond it; across the error one that is read worse."""
    m = jp.loads(jp.examples.text("delta")).with_({"limits": {"position": 1.0}, "loads": None})
    at = jp.solve(m).nominal
    read: dict[str, object] = {"configuration": [0, 1], "approach": [0, 1]}
    for name, away in zip("xyz", ([0.0, 0.3], [0.0, 0.8], [0.0, 0.0]), strict=True):
        read[name] = at.sel(component=name).values[:2] * m.units.length * 1e3 + away
        read[f"sigma_{name}"] = [0.3, {"x": 0.02, "y": 0.01, "z": 0.4}[name]]
    risks = jp.verify(m, read).risk.sel(limited="position").values
    assert risks[0] == pytest.approx(chi2.sf(1.0 / 0.09, 3), rel=1e-6)
    true = np.array([0.3, 0.8, 0.0]) + np.random.default_rng(1).standard_normal((1_000_000, 3)) * [0.02, 0.01, 0.4]
    assert risks[1] == pytest.approx((np.linalg.norm(true, axis=1) > 1.0).mean(), abs=2e-3)


@pytest.mark.parametrize("turned", [0.06, -0.06])
def test_a_rotation_in_the_plane_has_two_sides(turned: float) -> None:
    m = machine(rotation=0.05)
    angles = jp.solve(m).nominal.sel(component="angle").values[[0, 1]] + [turned, 0.0]
    found = jp.verify(m, {"configuration": [0, 1], "angle": angles}, sigma={"angle": 0.02})
    assert found.used[0].item() == pytest.approx(1.2, rel=1e-9)
    assert found.risk[0].item() == pytest.approx(norm.cdf(0.5) + norm.cdf(-5.5), rel=1e-9)
    assert found.risk[1].item() == pytest.approx(2.0 * norm.cdf(-2.5), rel=1e-9)
    sure = jp.verify(m, {"configuration": [0, 1], "angle": angles}, sigma={"angle": 0.0001})
    assert sure.status.item() == "rejected"


@pytest.mark.parametrize(("x", "status"), [(0.02, "accepted"), (0.3, "rejected")])
def test_a_position_that_was_read_in_part_is_no_position_that_holds(x: float, status: str) -> None:
    """One component that is beyond the limit alone rejects; one that is not shows nothing."""
    m = machine(position=0.1)
    columns = table(m, [0, 1, 2], [(0.01, 0.0), (x, 0.0), (0.0, 0.01)])
    columns["y"] = [*np.asarray(columns["y"])[:1].tolist(), None, *np.asarray(columns["y"])[2:].tolist()]
    found = jp.verify(m, columns, sigma={"length": 0.001})
    assert found.status.item() == status
    assert found.judged.values[:, 0].tolist() == [True, False, True]
    said = conclude(from_dataset(found)).sentences[0].text
    assert ("in 2 of 3 readings" in said) == (status == "accepted")
    assert ("position uses 300 % of its limit in row 2" in said) == (status == "rejected")


@pytest.mark.parametrize(("x", "status"), [(0.05, "accepted"), (0.0999, "undecided"), (0.15, "rejected")])
def test_what_becomes_of_limits(x: float, status: str) -> None:
    m = machine(position=0.1)
    assert jp.verify(m, table(m, [0, 5], [(x, 0.0), (0.0, 0.01)]), sigma={"length": 0.001}).status.item() == status


def test_readings_of_one_approach_are_averaged() -> None:
    m = machine(position=0.1)
    one = jp.verify(m, table(m, [3] * 4, [(0.09, 0.0)] * 4, approach=[1] * 4), sigma={"length": 0.01})
    mean = jp.verify(m, table(m, [3], [(0.09, 0.0)]), sigma={"length": 0.005})
    assert one.total_risk.item() == pytest.approx(mean.total_risk.item(), rel=1e-12)
    assert one.sizes["visit"] == 1


def test_corrected_drives_are_judged_by_what_was_commanded() -> None:
    """Readings at drive values that were corrected are compared with the pose of the configuration."""
    m = machine(position=0.1)
    built = m.with_({"dimensions.left_rod.deviation": 0.2})
    fixed = jp.compensate(built, "given", deviations={})
    for drives, status in (("error", "rejected"), ("residual", "accepted")):
        reached = fixed[drives].sel(component=["x", "y"]).values
        found = jp.verify(m, table(m, list(range(len(reached))), reached.tolist()), sigma={"length": 0.001})
        assert np.abs(found.error).max().item() == pytest.approx(np.abs(reached).max(), abs=1e-9)
        assert found.status.item() == status


def test_figures_of_iso_9283() -> None:
    m, rng = machine(), np.random.default_rng(3)
    places = [2] * 30 + [7] * 30
    errors = np.concatenate([rng.normal([0.03, 0.01], 0.004, (30, 2)), rng.normal([-0.02, 0.04], 0.002, (30, 2))])
    found = jp.verify(m, table(m, places, errors.tolist()), sigma={"length": 0.001})
    assert found.status.item() == "no_limit"
    for k, own in enumerate((errors[:30], errors[30:])):
        middle = own.mean(axis=0)
        assert found.accuracy[k].item() == pytest.approx(float(np.hypot(*middle)), abs=1e-9)
        away = [float(np.hypot(*(one - middle))) for one in own]
        mean = sum(away) / 30
        spread = (sum((one - mean) ** 2 for one in away) / 29) ** 0.5
        assert found.repeatability[k].item() == pytest.approx(mean + 3.0 * spread, abs=1e-9)


def test_the_best_fit_of_a_frame() -> None:
    """A path that is turned and shifted has no error but for what is added to single places."""
    m = machine()
    drawn = jp.solve(m).nominal.sel(component=["x", "y"]).values[:8]
    angle, bump = np.radians(0.3), np.zeros((8, 2))
    bump[3] = [0.02, -0.01]
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    reached = drawn @ turn.T + [0.4, -0.2] + bump
    found = jp.verify(m, table(m, [*range(8)], (reached - drawn).tolist()), sigma={"length": 0.001})
    assert found.position_rms.item() == pytest.approx(np.sqrt(((reached - drawn) ** 2).sum(axis=1).mean()), abs=1e-9)
    # By first order: what is left of the bump when two shifts and a turn are taken away.
    frame = np.zeros((16, 3))
    frame[0::2, 0] = frame[1::2, 1] = 1.0
    frame[:, 2] = (drawn @ turn.T @ [[0.0, 1.0], [-1.0, 0.0]]).ravel()
    left = bump.ravel() - frame @ np.linalg.lstsq(frame, bump.ravel(), rcond=None)[0]
    assert found.best_fit_rms.item() == pytest.approx(np.sqrt((left**2).sum() / 8), rel=1e-3)
    few = jp.verify(m, table(m, [0, 1], [(0.1, 0.0), (0.0, 0.1)]), sigma={"length": 0.001})
    assert np.isnan(few.best_fit_rms.item())


def test_figures_of_iso_230_2() -> None:
    """The positions of a table from both sides, by the words of the standard in plain loops."""
    m, rng = machine(), np.random.default_rng(5)
    places, sides, errors = [], [], []
    for place, middle in ((0, 0.01), (4, 0.03), (8, -0.02)):
        for side, sign in (("forward", 1.0), ("backward", -1.0)):
            for _ in range(5):
                places.append(place)
                sides.append(side)
                errors.append((middle + 0.004 * sign + 0.001 * rng.standard_normal(), 0.0))
    found = jp.verify(m, table(m, places, errors, side=sides), sigma={"length": 0.001})
    own = np.array([x for x, _ in errors]).reshape(3, 2, 5)
    mean, std = own.mean(axis=2), own.std(axis=2, ddof=1)
    reversal = [up - down for up, down in mean]
    repeat = [
        max(2 * up + 2 * down + abs(b), 4 * up, 4 * down) for (up, down), b in zip(std.tolist(), reversal, strict=True)
    ]
    both = mean.mean(axis=1)
    expected = {
        "reversal": max(map(abs, reversal)),
        "bidirectional_repeatability": max(repeat),
        "systematic_deviation": mean.max() - mean.min(),
        "mean_deviation": both.max() - both.min(),
        "bidirectional_accuracy": (mean + 2 * std).max() - (mean - 2 * std).min(),
    }
    for name, value in expected.items():
        assert found[name].sel(channel="x").item() == pytest.approx(value, abs=1e-9), name


def test_what_is_said(capsys: pytest.CaptureFixture[str], tmp_path: object) -> None:
    from pathlib import Path

    folder = Path(str(tmp_path))
    m = machine(position=0.1, rotation=0.05)
    m.write(folder / "five-bar.toml")
    columns = table(m, [0, 0, 4, 4], [(0.05, 0.0), (0.052, 0.0), (0.02, 0.01), (0.021, 0.01)])
    names = list(columns)
    rows = zip(*(np.asarray(values).tolist() for values in columns.values()), strict=True)
    readings = folder / "readings.csv"
    readings.write_text(",".join(names) + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    asked = ["verify", str(folder / "five-bar.toml"), "--measured", str(readings), "--sigma", "length=0.002"]
    assert run(asked) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "Accepted: the limits hold in all 4 readings, with a risk of less than 1 ppb that one is missed" in out
    assert "Not judged, because it is not read: rotation." in out
    assert "AP 0.051 mm" in out
    assert run([*asked, "--set", "limits.position=0.04"]) == 1
    assert "Rejected: position uses 130 % of its limit in row 3." in " ".join(capsys.readouterr().out.split())
    assert run([*asked, "--risk", "0.9"]) == 2
    assert "risk: 0.9 is no risk between 0 and 0.5" in capsys.readouterr().err
    assert run([*asked, "--set", "limits.position=none"]) in (1, 2)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"side": ["up", "up"]}, 'column "side": .up. is not a side; known: forward, backward'),
        ({"x": [None, None], "y": [None, None]}, "no cell of a measured column has a value"),
    ],
)
def test_what_is_refused(more: dict[str, list[object]], message: str) -> None:
    m = machine(position=0.1)
    with pytest.raises(jp.InputError, match=message):
        jp.verify(m, table(m, [0, 1], [(0.0, 0.0), (0.1, 0.0)]) | more, sigma={"length": 0.002})


def test_a_limit_that_is_not_read_is_refused() -> None:
    m = machine(angle=[-0.1, 0.1])
    with pytest.raises(jp.InputError, match="nothing is read that has a limit: angle"):
        jp.verify(m, table(m, [0], [(0.0, 0.0)]), sigma={"length": 0.002})
