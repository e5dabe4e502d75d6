"""Which joints are worn: planted sizes, the reference case, readings that do not fit."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.stats import t

import jointplay as jp
from helpers.arms import PUSHED
from jointplay import Mechanism, examples
from jointplay.cli import run

DATA = Path(__file__).parent.parent / "data" / "calibrate"
FILE, TABLE = DATA / "five-bar-reversal.toml", DATA / "five-bar-reversal.csv"
SIGMA = {"length": 0.002}


def pushed(
    m: Mechanism, columns: list[str], *, seed: int | None = None, sigma: float = 0.001
) -> dict[str, list[object]]:
    """Readings of a machine in all load cases at all configurations."""
    found = jp.loaded(m)
    table: dict[str, list[object]] = {"configuration": [], "load_case": []} | {name: [] for name in columns}
    for case in found.load_case.values.tolist():
        own = found.sel(load_case=case)
        table["configuration"] += range(own.sizes["configuration"])
        table["load_case"] += [case] * own.sizes["configuration"]
        for name in columns:
            table[name] += (own.nominal + own.error).sel(component=name).values.tolist()
    return table


def groups(found: xr.Dataset) -> list[tuple[str, ...]]:
    return [tuple(found.clearance.values[row != 0.0].tolist()) for row in found.part.values]


def test_the_reference_case() -> None:
    """Sums by an independent program: two groups, and no single size."""
    reference = json.loads((DATA / "fits.json").read_text())["five-bar-reversal"]
    # The other program has no deviations.
    exact = jp.load(FILE).with_({"dimensions": None, "drives.left.error": None, "drives.right.error": None})
    found = jp.diagnose(exact, TABLE, sigma=SIGMA)
    assert groups(found) == [tuple(group) for group in reference["groups"]]
    assert found.attrs["rank"] == 2
    np.testing.assert_allclose(found.group_size, reference["sums"], rtol=1e-6)
    np.testing.assert_allclose(found.group_standard_error, reference["standard_error"], rtol=1e-6)
    assert found.attrs["p_value"] > 0.01


def test_a_load_elsewhere_determines_more() -> None:
    """A force on the coupler itself presses its two joints in different directions."""
    text = examples.text("four-bar")
    ends = {"push": [{"force": [0, 300]}], "pull": [{"force": [0, -300]}]}
    between = [{"body": "coupler", "at": [20, 10], "force": [200, 50]}]
    more = ends | {"on": between, "back": [{**between[0], "force": [-200, -50]}]}
    m = jp.loads(text).with_({"loads": None, "gravity": None, "tolerances": None})
    ranks = [
        jp.diagnose(m.with_({"load_cases": cases}), pushed(m.with_({"load_cases": cases}), ["x", "y"]), sigma=SIGMA)
        for cases in (ends, more)
    ]
    assert ranks[0].attrs["rank"] < ranks[1].attrs["rank"]


@pytest.mark.parametrize("name", ["five-bar", "slider-crank", "four-bar", "arm-with-gearboxes"])
def test_planted_sizes(name: str) -> None:
    """Readings of a worn machine, on the exact closure and with other lengths, give its sums back."""
    drawn = jp.loads(examples.text(name))
    force = [60, -100] if drawn.pose_size == 3 else [60, -100, 30]
    cases = {"push": [{"force": force}], "pull": [{"force": [-one for one in force]}]}
    # Of a sum the single sizes are not known, and what they change beside it is not taken for a length that is off.
    m = drawn.with_({"loads": None, "gravity": None, "load_cases": cases, "dimensions": None})
    from jointplay.analyses.calibrate.unknowns import is_play
    from jointplay.model.sizing import sizings

    base, sources = sizings(m)
    own = [one for one in sources if is_play(base, one)]
    changes: dict[str, object] = {}
    for k, one in enumerate(own):
        changes |= one.resized(one.size * (1.3 + 0.1 * k))
    columns = list(base.components[: len(force)])
    built = base.with_(changes)
    found = jp.diagnose(base, pushed(built, columns), sigma={"length": 0.001})
    known = found.state.values != "not determined"
    assert known.any()
    factors = 1.3 + 0.1 * np.arange(len(own))
    truth = found.part.values @ (factors * 0.5 * (found.size_lowest + found.size_highest).values)
    np.testing.assert_allclose(found.group_size.values[known], truth[known], rtol=1e-6)
    # Fits scatter, so that what is larger by a third may still be as the file says.
    assert "tight" not in found.state
    assert name == "arm-with-gearboxes" or (found.state.values[known] == "worn").all()


def test_the_rank_by_brute_force() -> None:
    """Singular values of differences of `loaded`, size by size."""
    m = jp.load(FILE)
    base = pushed(m, ["x", "y"])
    columns = []
    for joint in "ABCDE":
        bigger = pushed(m.with_({f"joints.{joint}.clearance.radial": 0.0200001}), ["x", "y"])
        columns.append(np.concatenate([np.subtract(bigger[name], base[name]) for name in ("x", "y")]).astype(float))
    singular = np.linalg.svd(np.column_stack(columns), compute_uv=False)
    found = jp.diagnose(m, base, sigma=SIGMA)
    assert int((singular > 1e-3 * singular[0]).sum()) == found.attrs["rank"] == 2


@pytest.mark.parametrize("repeats", [0, 10])
def test_intervals_cover(repeats: int) -> None:
    """95 % of the sums are within so many standard errors: more where few repeated readings say how exact they are."""
    m = jp.load(FILE)
    true, inside = pushed(m, ["x", "y"]), []
    rows = [*range(len(true["x"])), *range(repeats)]
    again = {name: [values[row] for row in rows] for name, values in true.items()} | {"approach": rows}
    for seed in range(20):
        rng = np.random.default_rng(seed)
        noisy = {name: np.add(again[name], 0.001 * rng.standard_normal(len(rows))) for name in ("x", "y")}
        found = jp.diagnose(m, again | noisy, sigma="auto" if repeats else {"length": 0.001})
        factor = float(t.ppf(0.975, repeats)) if repeats else 1.96
        assert found.attrs["coverage_factor"] == pytest.approx(factor)
        inside += (np.abs(found.group_size - found.group_lowest) < factor * found.group_standard_error).values.tolist()
    # Three standard deviations of the share of 40 sums, or of 20 scatters that were found, each for two sums.
    assert abs(np.mean(inside) - 0.95) < 3.0 * np.sqrt(0.95 * 0.05 / (20 if repeats else 40))


def test_deviations_and_zeros_drop_out() -> None:
    """Lengths and the zero of a dial are the same in both directions."""
    m = jp.load(FILE)
    other = pushed(m.with_({"dimensions.left.deviation": 0.05, "drives.left.deviation": 0.1}), ["x", "y"])
    other["x"] = [float(value) + 3.0 for value in other["x"]]  # type: ignore[arg-type]
    found = jp.diagnose(m, other, sigma=SIGMA)
    np.testing.assert_allclose(found.group_size, [0.04, 0.06], rtol=2e-3)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_machine_within_its_tolerances_is_not_worn(sign: float) -> None:
    """What lengths and the drive were off by was told as wear: of one clearance a third of its size, six errors."""
    m = jp.load(DATA / "rocker-in-space.toml")
    off = {f"dimensions.l{k}.deviation": sign * value for k, value in enumerate((-0.02, 0.03, -0.03, 0.02))}
    found = jp.diagnose(m, pushed(m.with_(off), ["x", "y", "z"]), sigma={"length": 0.003})
    assert found.attrs["rank"] == 4
    # Without noise: what a length does to the play is found with the length.
    assert (np.abs(found.group_size - found.group_lowest) < 0.5 * found.group_standard_error).all()
    assert not np.isin(found.state, ["worn", "tight"]).any()


def test_a_wrong_row_is_found(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    rows = list(csv.reader(TABLE.read_text().splitlines()))
    rows[17][3] = str(float(rows[17][3]) + 0.03)
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("".join(",".join(row) + "\n" for row in rows))
    assert run(["diagnose", str(FILE), "--reversal", str(wrong), "--sigma", "length=0.002"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "Rows left out: they do not fit: 18." in out
    assert "A + B is worn: 0.04" in out


def test_it_says_what_is_worn(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["diagnose", str(FILE), "--reversal", str(TABLE), "--sigma", "length=0.002"]
    assert run(asked) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert (
        out.index("A + B is worn: 0.04202 +- 0.00019 mm, 0.04 by the file; these readings do not show which of them.")
        > 0
    )
    resized = [f"joints.{joint}.clearance={{ radial = 0.021, tolerance = 0.002 }}" for joint in "ABCDE"]
    assert run([*asked, *(part for one in resized for part in ("--set", one))]) == 0
    assert "Every clearance that is determined is within the file's limits." in " ".join(
        capsys.readouterr().out.split()
    )
    # Ten times more exact than they are.
    assert run([*asked[:-1], "length=0.0002"]) == 1
    assert "Not shown: which joints are worn; the readings do not fit" in " ".join(capsys.readouterr().out.split())


def test_a_size_of_the_file_has_its_own_digits() -> None:
    """It was rounded as coarsely as readings found it: 0.040 for 0.041236."""
    m = jp.load(FILE).with_({"joints.A.clearance.radial": 0.021236})
    table = jp.table(jp.diagnose(m, TABLE, sigma={"length": 0.02}))
    whole = table.loc["Clearances of this machine"]
    row = whole[whole.clearances.astype(str).str.startswith("A")].iloc[0]
    ends = [row[name] for name in whole.columns if "by the file" in name]
    assert ends == [0.041236, 0.041236]


def test_readings_that_would_not_show_wear_show_none(capsys: pytest.CaptureFixture[str]) -> None:
    """With noise as large as all play, the play of no joint is said to be that of the file."""
    asked = ["diagnose", str(FILE), "--reversal", str(TABLE), "--sigma"]
    assert run([*asked, "length=0.5"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "Not shown: whether A + B is worn: 0.04" in out
    assert "twice as much would not be seen" in out
    assert "Every clearance" not in out
    assert run([*asked, "length=0.02"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "No clearance that is determined is found to be worn; least is known of" in out


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"configuration": [0, 1], "x": [0.0, 1.0]}, "nothing moves the joints through their play"),
        ({"configuration": [0, 1], "load_case": ["px", "mx"], "x": [0.0, 1.0]}, "no place is read twice"),
        (
            {"configuration": [0, 0], "load_case": ["px", "up"], "x": [0.0, 1.0]},
            'row 2, column "load_case": .up. is not a load case',
        ),
        ({"configuration": [0, 0], "load_case": ["px", "mx"], "z": [0.0, 1.0]}, "'z' is no drive"),
    ],
)
def test_what_is_refused(table: dict[str, list[object]], message: str) -> None:
    with pytest.raises(jp.InputError, match=message):
        jp.diagnose(jp.load(FILE), table, sigma={"length": 0.002})


def test_a_machine_without_play_is_refused() -> None:
    rigid = jp.load(FILE).with_({f"joints.{joint}.clearance": None for joint in "ABCDE"})
    with pytest.raises(jp.InputError, match="no joint has a clearance"):
        jp.diagnose(rigid, TABLE, sigma=SIGMA)


#: an arm whose driven joints lag
LAGGING = jp.Builder(space="planar", units={"length": "mm", "angle": "deg"})
LAGGING.revolute("shoulder", ground=(0, 0), upper=(0, 0), clearance=jp.radial(0.01))
LAGGING.revolute("elbow", upper=(300, 0), lower=(0, 0))
LAGGING.drive("q1", joint="shoulder", values=(10, 40, 80), error=0.01, backlash=0.05)
LAGGING.drive("q2", joint="elbow", values=(60, 20, 90), backlash={"plus": 0.04, "minus": 0.02})
LAGGING.dimension("upper", body="upper", between=["shoulder", "elbow"], tolerance=0.1)
LAGGING.output(body="lower", at=(200, 0))


class TestBothSides:
    """Readings with the drives coming from either side: the driven coordinates lag by half of the lost motion."""

    def table(self, m: Mechanism, sizes: dict[str, tuple[float, float]], noise: float = 0.0) -> dict[str, list[object]]:
        """By the direct kinematics of two links."""
        rows: dict[str, list[object]] = {name: [] for name in ("configuration", "side", "x", "y")}
        rng = np.random.default_rng(2)
        for k, (q1, q2) in enumerate(zip(m.data.drives["q1"].values, m.data.drives["q2"].values, strict=True)):
            for side, index in (("forward", 0), ("backward", 1)):
                first = np.deg2rad(q1 + sizes["q1"][index])
                second = first + np.deg2rad(q2 + sizes["q2"][index])
                rows["configuration"].append(k)
                rows["side"].append(side)
                for name, along in (("x", np.cos), ("y", np.sin)):
                    rows[name].append(float(300 * along(first) + 200 * along(second) + noise * rng.standard_normal()))
        return rows

    def test_backlash_of_drives(self) -> None:
        m = LAGGING.mechanism()
        new = self.table(m, {"q1": (-0.025, 0.025), "q2": (-0.02, 0.04)})
        found = jp.diagnose(m, new, sigma={"length": 0.05})
        assert groups(found)[-2:] == [("q1.backlash",), ("q2.backlash",)]
        np.testing.assert_allclose(found.group_size[-2:], [0.05, 0.06], rtol=1e-3)
        worn = self.table(m, {"q1": (-0.025, 0.025), "q2": (-0.04, 0.08)})
        found = jp.diagnose(m, worn, sigma={"length": 0.002})
        assert found.state.values[-2:].tolist() == ["as in the file", "worn"]
        np.testing.assert_allclose(found.group_size[-2:], [0.05, 0.12], rtol=1e-3)

    def test_a_clearance_does_not_change_sides_by_itself(self) -> None:
        m = LAGGING.mechanism()
        found = jp.diagnose(m, self.table(m, {"q1": (-0.025, 0.025), "q2": (-0.02, 0.04)}), sigma={"length": 0.05})
        assert found.state.values[groups(found).index(("shoulder",))] == "not determined"

    def test_a_calibration_knows_the_side(self) -> None:
        """Backlash that is taken up is no scatter: of readings from one side the lag is known."""
        m = LAGGING.mechanism().with_({"joints.shoulder.clearance": None})
        true = self.table(m, {"q1": (-0.025 + 0.006, 0.025 + 0.006), "q2": (-0.02, 0.04)})
        forward = {name: values[::2] for name, values in true.items()}
        found = jp.calibrate(m, forward, sigma={"length": 1e-4})
        assert found.estimate.sel(unknown="q1").item() == pytest.approx(0.006, abs=2e-5)
        sizes = jp.calibrate(m, true, sigma={"length": 1e-4}, sizes=True)
        np.testing.assert_allclose(sizes.estimate.sel(unknown=["q1.backlash", "q2.backlash"]), [0.05, 0.06], rtol=1e-3)


@pytest.mark.parametrize("size", [0.015, 0.004, -0.004, -0.01])
def test_a_size_is_half_of_what_the_pin_moves_even_where_noise_makes_that_negative(size: float) -> None:
    x = [100.0 + size, 100.0 - size]
    table = {"configuration": [0, 0], "load_case": ["push", "pull"], "x [mm]": x, "y [mm]": [0, 0]}
    found = jp.diagnose(PUSHED, table, sigma={"length": 0.02})
    assert found.group_size.item() == pytest.approx(size, abs=1e-6)
    assert found.group_standard_error.item() == pytest.approx(0.02 / np.sqrt(2.0), rel=1e-6)


@pytest.mark.parametrize("sum_", [0.11, 0.08, 0.041])
def test_a_sum_is_found_though_the_smaller_size_of_it_ends_at_zero(sum_: float) -> None:
    chain = PUSHED.with_(
        {
            "joints.J.clearance.radial": 0.001,
            "joints.K": {"type": "revolute", "on": {"arm": [100, 0], "hand": [0, 0]}, "clearance": {"radial": 0.1}},
            "drives.p": {"joint": "K", "values": [0, 0]},
            "drives.q.values": [0, 0],
            "output.body": "hand",
        }
    )
    x = [200.0 + sum_, 200.0 - sum_]
    table = {"configuration": [0, 0], "load_case": ["push", "pull"], "x [mm]": x, "y [mm]": [0, 0]}
    found = jp.diagnose(chain, table, sigma={"length": 0.001})
    assert found.group_size.item() == pytest.approx(sum_, abs=1e-6)
    assert found.residual_after.values == pytest.approx(0.0, abs=1e-6)
