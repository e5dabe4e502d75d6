"""Laws of single numbers and their correlation: against scipy's distributions, and first order against samples."""

import itertools
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

import jointplay as jp
from jointplay.errors import InputError

SAMPLES = 20_000


def text(l2: str = "", l3: str = "", more: str = "") -> str:
    dimensions = "".join(
        f'[dimensions.{name}]\nbody = "{body}"\nbetween = ["{a}", "{b}"]\n{keys}\n'
        for name, body, a, b, keys in (("l2", "coupler", "J2", "J3", l2), ("l3", "rocker", "J4", "J3", l3))
        if keys
    )
    plain = jp.examples.text("four-bar").partition("[dimensions.l2]")[0]
    return f"{plain}\n{dimensions}{more}"


def drawn(m: jp.Mechanism, *names: str, samples: int = SAMPLES) -> Any:
    """Specimens of some sources of one number, in units of the file."""
    columns = [m.parameters.index(next(p for p in m.parameters if p.rpartition(".")[0] == name)) for name in names]
    return m.core.specimens(samples, 5)[:, columns] / m.parameter_factors[columns]


def gain_of(m: jp.Mechanism, name: str) -> Any:
    """What the output moves by per unit of a dimension, to first order."""
    one, none = (jp.given(m, {f"{name}.length": size}).error_first_order.values for size in (0.1, 0.0))
    return (one - none) / 0.1


class Drifting:
    """Normal about a mean that is uniform, by sums over many means."""

    def __init__(self, mean: float, sigma: float, drift: float) -> None:
        nodes, weights = np.polynomial.legendre.leggauss(40)
        self.parts = [(w / 2, stats.norm(mean + drift * x, sigma)) for x, w in zip(nodes, weights, strict=True)]

    def cdf(self, x: Any) -> Any:
        return sum(w * part.cdf(x) for w, part in self.parts)

    def mean(self) -> float:
        return float(sum(w * part.mean() for w, part in self.parts))

    def var(self) -> float:
        return float(sum(w * (part.var() + (part.mean() - self.mean()) ** 2) for w, part in self.parts))


#: what is written, and the law that it is; the tolerance is from -0.1 to 0.3
LAWS: dict[str, Any] = {
    '"triangular"': stats.triang(0.5, -0.1, 0.4),
    "{ triangular = 0.0 }": stats.triang(0.25, -0.1, 0.4),
    "{ triangular = 0.3 }": stats.triang(1.0, -0.1, 0.4),
    "{ beta = [2, 5] }": stats.beta(2, 5, -0.1, 0.4),
    "{ beta = [0.5, 0.5] }": stats.beta(0.5, 0.5, -0.1, 0.4),
    "{ beta = [300, 200] }": stats.beta(300, 200, -0.1, 0.4),
    "{ pert = 0.0 }": stats.beta(2, 4, -0.1, 0.4),
    "{ normal = {} }": stats.truncnorm(-3, 3, 0.1, 0.2 / 3),
    "{ normal = { sigma = 0.2 } }": stats.truncnorm(-1, 1, 0.1, 0.2),
    "{ normal = { shift = 1.5 } }": stats.truncnorm(-4.5, 1.5, 0.2, 0.2 / 3),
    "{ normal = { cpk = 1.25, sorted = false } }": stats.norm(0.1, 0.2 / 3.75),
    "{ normal = { cpk = 1.0, shift = -1.5, sorted = false } }": stats.norm(0.1 - 1.5 * 0.2 / 4.5, 0.2 / 4.5),
    "{ normal = { cpk = 1.0, drift = 2.0, sorted = false } }": Drifting(0.1, 0.2 / 3, 0.4 / 3),
}


@pytest.mark.parametrize("law", LAWS)
def test_specimens_have_the_law_that_is_written(law: str) -> None:
    m = jp.loads(text(f"tolerance = {{ plus = 0.3, minus = 0.1 }}\nlaw = {law}"))
    values = drawn(m, "l2")[:, 0]
    assert stats.kstest(values, LAWS[law].cdf).pvalue > 1e-3
    if "sorted" not in law:
        assert values.min() >= -0.1 - 1e-12
        assert values.max() <= 0.3 + 1e-12


@pytest.mark.parametrize("law", LAWS)
def test_first_order_has_mean_and_variance_of_the_law(law: str) -> None:
    """Of two laws of one dimension the contributions are as their variances, and the means differ by theirs."""
    keys = "tolerance = { plus = 0.3, minus = 0.1 }\nlaw = "
    ours, uniform = (jp.random(jp.loads(text(keys + word)), samples=100) for word in (law, '"uniform"'))
    scale = (ours.contribution / uniform.contribution).sel(source="l2").values
    np.testing.assert_allclose(scale, LAWS[law].var() / (0.4**2 / 12), rtol=2e-6)
    gain = gain_of(jp.loads(text(keys + law)), "l2")
    means = (ours.error_mean_first_order - uniform.error_mean_first_order).values
    np.testing.assert_allclose(means, gain * (LAWS[law].mean() - 0.1), rtol=2e-6, atol=1e-9)


def test_the_laws_of_before_are_what_they_were() -> None:
    """`normal` is drawn and summed as it was, and a process that just fits its limits is the same law."""
    keys = "tolerance = 0.2\nlaw = "
    names, tables = (jp.random(jp.loads(text(keys + law)), samples=100) for law in ('"normal"', "{ normal = {} }"))
    np.testing.assert_allclose(names.contribution, tables.contribution, rtol=1e-8)


def test_worst_takes_the_limits_whatever_the_law() -> None:
    keys = "tolerance = 0.2\nlaw = "
    results = [
        jp.worst(jp.loads(text(keys + law))) for law in ('"uniform"', "{ pert = 0.1 }", "{ normal = { cpk = 2 } }")
    ]
    for other in results[1:]:
        np.testing.assert_array_equal(other.worst_component, results[0].worst_component)


def test_drive_errors_angles_and_sizes_have_laws_too() -> None:
    more = re.sub("error  = 0.0", "error = 0.2\nlaw = { pert = 0.1 }", text(), count=1)
    more = re.sub(
        r"clearance = \{[^}]*\}",
        "clearance = { hole = { diameter = 12.02, tolerance = 0.01, law = { beta = [2, 3] } },"
        ' pin = { diameter = 11.98, tolerance = 0.01, law = "triangular" } }',
        more,
        count=1,
    )
    m = jp.loads(more)
    names = [name for name, kind in zip(m.sources, m.source_kinds, strict=True) if kind in ("drive", "size")]
    hole, pin, drive = drawn(m, *names).T
    assert stats.kstest(drive, stats.beta(4, 2, -0.2, 0.4).cdf).pvalue > 1e-3
    assert stats.kstest(hole, stats.beta(2, 3, -0.01, 0.02).cdf).pvalue > 1e-3
    assert stats.kstest(pin, stats.triang(0.5, -0.01, 0.02).cdf).pvalue > 1e-3


def csv(folder: Path, content: str, law: str, tolerance: str = "") -> Path:
    (folder / "lot.csv").write_text(content, encoding="utf-8")
    file = folder / "m.toml"
    file.write_text(text(f"{tolerance}\nlaw = {law}"), encoding="utf-8")
    return file


LOT = "number;d;note\n1;12.01;\n2;12.04;good\n3;;lost\n4;12.02;\n5;12.11;\n"


def test_measured_values_are_interpolated(tmp_path: Path) -> None:
    m = jp.load(csv(tmp_path, LOT, '{ csv = "lot.csv", column = "d", nominal = 12 }'))
    values = np.sort(drawn(m, "l2")[:, 0])
    lot = np.array([0.01, 0.02, 0.04, 0.11])
    share = np.interp(values, lot, np.linspace(0, 1, 4))
    assert stats.kstest(share, "uniform").pvalue > 1e-3
    # Limits are those of the lot, zero included.
    assert m.core_spec["sources"][m.sources.index("l2")]["set"]["interval"]["low"] == 0.0
    ours = jp.random(m, samples=100)
    uniform = jp.random(jp.loads(text('tolerance = { plus = 0.11, minus = 0 }\nlaw = "uniform"')), samples=100)
    second = np.mean([(a * a + a * b + b * b) / 3 for a, b in itertools.pairwise(lot)])
    variance = second - ((lot[1:] + lot[:-1]) / 2).mean() ** 2
    scale = (ours.contribution / uniform.contribution).sel(source="l2").values
    np.testing.assert_allclose(scale, variance / (0.11**2 / 12), rtol=1e-9)
    # What was read stays with the mechanism.
    again = m.with_({"dimensions.l2.law.nominal": 12.01})
    assert drawn(again, "l2").min() == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize(
    ("content", "law", "tolerance", "says"),
    [
        (LOT, '{ csv = "other.csv", column = "d" }', "", 'no file "other.csv" in the same folder'),
        (LOT, '{ csv = "../lot.csv", column = "d" }', "", "not the name of a file in the same folder"),
        (LOT, '{ csv = "lot.csv" }', "", "'column' is missing"),
        (LOT, '{ csv = "lot.csv", column = "D" }', "", "'D' is not a column of its first row"),
        (LOT, '{ csv = "lot.csv", column = "note" }', "", 'row 3, column "note": a number is needed, not "good"'),
        ("d\n1\n", '{ csv = "lot.csv", column = "d" }', "", "fewer than two values"),
        ("d,d\n1,2\n", '{ csv = "lot.csv", column = "d" }', "", "more than once"),
        ("", '{ csv = "lot.csv", column = "d" }', "", "not a column"),
        (LOT, '{ csv = "lot.csv", column = "d", nominal = 12 }', "tolerance = 0.1", "12.11 is beyond the limits"),
    ],
)
def test_what_is_wrong_with_measured_values_is_said(
    tmp_path: Path, content: str, law: str, tolerance: str, says: str
) -> None:
    with pytest.raises(InputError, match=re.escape(says)):
        jp.load(csv(tmp_path, content, law, tolerance))


@pytest.mark.parametrize(
    ("law", "says"),
    [
        ('"gaussian"', '"gaussian" is not valid here'),
        ("3", "not valid here"),
        ("{ triangular = 0.9 }", "triangular = 0.9, the likeliest value, is not within the limits, from -0.2 to 0.2"),
        ("{ pert = -0.3 }", "pert = -0.3"),
        ("{ beta = [1, 0] }", "must be at least 0.1: 0"),
        ("{ beta = [1] }", "two values are needed"),
        ("{ beta = [1, 2], pert = 0 }", "here: beta and pert"),
        ("{}", "here: none"),
        ("{ trianguler = 0 }", "did you mean 'triangular'?"),
        ("{ normal = { sigma = 0.1, cpk = 1 } }", "give sigma or cpk, not both"),
        ("{ normal = { shift = 7 } }", "must be at most 6: 7"),
        ("{ normal = { sigma = 1e-9 } }", "does not fit to limits"),
        ('{ csv = "lot.csv", column = "d" }', "not in a text or a change"),
        ("{ measured = [0.1] }", "two or more values are needed"),
        ("{ pert = 0.1, nominal = 3 }", "'nominal' goes with measured values"),
    ],
)
def test_laws_that_are_none_are_refused(law: str, says: str) -> None:
    with pytest.raises(InputError, match=re.escape(says)) as error:
        jp.loads(text(f"tolerance = 0.2\nlaw = {law}"))
    assert "dimensions.l2" in str(error.value)


def test_sigma_is_a_law_already() -> None:
    with pytest.raises(InputError, match="sigma already says how it scatters"):
        jp.loads(text("tolerance = { sigma = 0.2 }\nlaw = { pert = 0.1 }"))


def test_the_numbers_of_a_law_are_expressions_and_are_swept() -> None:
    content = text("tolerance = 0.2\nlaw = { pert = 't / 2' }", more="[variables]\nt = 0.1\n")
    m = jp.loads(content)
    assert m.data.dimensions["l2"].law.pert == 0.05
    assert m.with_({"dimensions.l2.law.pert": 0.2}).data.dimensions["l2"].law.pert == 0.2


# --- correlation


def pair(ranks: str, l2: str = 'law = "uniform"', l3: str = "law = { pert = -0.1 }") -> jp.Mechanism:
    more = f'[[correlations]]\nsources = ["l2", "l3"]\n{ranks}\n'
    return jp.loads(text(f"tolerance = 0.2\n{l2}", f"tolerance = 0.2\n{l3}", more))


@pytest.mark.parametrize("rank", [-1.0, -0.7, 0.0, 0.4, 0.95, 1.0])
def test_specimens_have_the_rank_correlation(rank: float) -> None:
    a, b = drawn(pair(f"rank = {rank}"), "l2", "l3").T
    # The standard deviation of a sampled rank correlation is below 1 / sqrt(n).
    assert abs(stats.spearmanr(a, b).statistic - rank) < 5 * (1 - rank * rank + 1e-9) / math.sqrt(SAMPLES)
    assert stats.kstest(a, stats.uniform(-0.2, 0.4).cdf).pvalue > 1e-3
    assert stats.kstest(b, stats.beta(2, 4, -0.2, 0.4).cdf).pvalue > 1e-3


def covariance(first: Any, second: Any, rank: float) -> float:
    """Of two laws in a Gaussian copula, by Hoeffding's formula: the integral of the copula less the product."""
    rho = 2 * math.sin(math.pi * rank / 6)
    low, high = (law.ppf([1e-12, 1 - 1e-12]) for law in (first, second))
    nodes, weights = np.polynomial.legendre.leggauss(80)
    x = (low[1] + low[0]) / 2 + (low[1] - low[0]) / 2 * nodes
    y = (high[1] + high[0]) / 2 + (high[1] - high[0]) / 2 * nodes
    joint = stats.multivariate_normal([0, 0], [[1, rho], [rho, 1]])
    u, v = stats.norm.ppf(first.cdf(x)), stats.norm.ppf(second.cdf(y))
    both = joint.cdf(np.stack(np.broadcast_arrays(u[:, None], v[None]), axis=-1))
    part = both - first.cdf(x)[:, None] * second.cdf(y)[None]
    return float(weights @ part @ weights) * (low[1] - low[0]) / 2 * (high[1] - high[0]) / 2


@pytest.mark.parametrize("rank", [-0.7, 0.4, 0.9])
def test_contributions_are_covariances_with_the_whole(rank: float) -> None:
    m, alone = pair(f"rank = {rank}"), pair("rank = 0")
    ours, other = jp.random(m, samples=100), jp.random(alone, samples=100)
    np.testing.assert_allclose(ours.contribution.sum("source"), ours.error_std_first_order**2, rtol=1e-9, atol=1e-20)
    gains = [gain_of(m, name) for name in ("l2", "l3")]
    expected = gains[0] * gains[1] * covariance(stats.uniform(-0.2, 0.4), stats.beta(2, 4, -0.2, 0.4), rank)
    for name in ("l2", "l3"):
        added = (ours.contribution - other.contribution).sel(source=name).values
        np.testing.assert_allclose(added, expected, rtol=2e-4, atol=1e-12)


def test_first_order_covariance_is_that_of_the_samples() -> None:
    m = pair("rank = 0.8")
    result = jp.random(m, samples=200_000)
    np.testing.assert_allclose(result.error_std, result.error_std_first_order, rtol=0.03)


def test_three_holes_of_one_reamer_are_equally_large() -> None:
    """A rank correlation of 1 is a matrix of ones, whose eigenvalues but one are zero up to rounding."""
    sized = text()
    fit = 'clearance = { fit = "H7/g6", diameter = 12 }'
    sized = re.sub(r"clearance = \{[^}]*\}", fit, sized)
    holes = ["J1.hole", "J2.hole", "J3.hole"]
    m = jp.loads(sized + f"\n[[correlations]]\nsources = {holes}\nrank = 1.0\n")
    values = drawn(m, *holes, samples=1000)
    np.testing.assert_allclose(values[:, 1:], values[:, [0, 0]], rtol=1e-9, atol=1e-15)
    result = jp.random(m, samples=1000)
    np.testing.assert_allclose(result.contribution.sum("source"), result.error_std_first_order**2, rtol=1e-9)


def test_hole_and_pin_that_are_selected_to_fit_have_less_play_to_scatter() -> None:
    """Large pins to large holes: the variance of the gap falls, and with it what its sizes contribute."""
    sized = re.sub(r"clearance = \{[^}]*\}", 'clearance = { fit = "H7/f7", diameter = 12 }', text(), count=1)
    name = re.search(r"\[joints\.(\w+)\]", sized).group(1)
    both = f'[[correlations]]\nsources = ["{name}.hole", "{name}.pin"]\nrank = '
    parts = {}
    for rank in (0.0, 0.9, 1.0):
        result = jp.random(jp.loads(sized + "\n" + both + str(rank)), samples=1000).isel(configuration=0)
        parts[rank] = result.contribution.sel(source=[f"{name}.hole", f"{name}.pin"]).sum("source").values
        np.testing.assert_allclose(result.contribution.sum("source"), result.error_std_first_order**2, rtol=1e-9)
    assert (parts[0.9] < 0.2 * parts[0.0]).all()
    np.testing.assert_allclose(parts[1.0] / parts[0.0], 0.0, atol=1e-6)


def test_worst_says_that_it_ignores_correlations() -> None:
    m = pair("rank = 0.9")
    result, alone = jp.worst(m), jp.worst(pair("rank = 0"))
    assert result.attrs["correlations_ignored"] == "l2, l3"
    np.testing.assert_array_equal(result.worst_component, alone.worst_component)


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        ('sources = ["l2"]\nrank = 1', 'sources: at least two values are needed, not ["l2"]'),
        ('sources = ["l2", "l2"]\nrank = 1', "'l2' is named twice"),
        ('sources = ["l2", "l9"]\nrank = 1', "'l9' is not a source"),
        ('sources = ["l2", "J1"]\nrank = 1', "'J1' is not a single number"),
        ('sources = ["l2", "l3"]', "give rank, or the matrix ranks"),
        ('sources = ["l2", "l3"]\nrank = 1.5', "at most 1"),
        ('sources = ["l2", "l3"]\nranks = [[1, 0.5]]', "needs 2 rows of 2 numbers"),
        ('sources = ["l2", "l3"]\nranks = [[1, 0.5], [0.4, 1]]', "the matrix is symmetric"),
        ('sources = ["l2", "l3"]\nranks = [[0.9, 0.5], [0.5, 1]]', "rank correlation 1 with itself"),
    ],
)
def test_correlations_of_nothing_are_refused(entry: str, says: str) -> None:
    with pytest.raises(InputError, match=re.escape(says)):
        jp.loads(text("tolerance = 0.2", "tolerance = 0.2", f"[[correlations]]\n{entry}\n"))


def test_a_matrix_that_no_numbers_have_is_refused_by_the_names_of_the_sources() -> None:
    """Two that follow a third cannot be opposite to each other; the fourth has nothing to do with it."""
    ranks = "[[1, 0.9, 0.9, 0], [0.9, 1, -0.9, 0], [0.9, -0.9, 1, 0], [0, 0, 0, 1]]"
    sized = re.sub(r"clearance = \{[^}]*\}", 'clearance = { fit = "H7/g6", diameter = 12 }', text())
    entry = f'\n[[correlations]]\nsources = ["J1.hole", "J2.hole", "J3.hole", "J4.hole"]\nranks = {ranks}\n'
    with pytest.raises(InputError, match=r"J1\.hole, J2\.hole, J3\.hole has a negative eigenvalue") as error:
        jp.loads(sized + entry)
    assert "J4.hole" not in str(error.value)
    assert "correlations.0.ranks" in str(error.value)


def test_the_numbers_do_not_depend_on_threads() -> None:
    m = pair("rank = 0.9")
    one, two = (jp.random(m, samples=30_000, threads=threads) for threads in (1, 2))
    assert one.drop_attrs().identical(two.drop_attrs())


def test_the_covariance_here_is_right() -> None:
    """The oracle against the closed form of normal numbers."""
    rank = 0.4
    rho = 2 * math.sin(math.pi * rank / 6)
    assert covariance(stats.norm(0, 1), stats.norm(0, 2), rank) == pytest.approx(2 * rho, rel=1e-4)
