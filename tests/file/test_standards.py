"""Tables of standards against formulas, published rows and an independent implementation."""

import itertools
import math

import pressfit
import pytest
from pressfit.tables import GRADES, SHAFT_LETTERS

from jointplay.file.standards import NotInStandard, fit, iso286, iso5753, limits, travel


def limits_of(size: float, text: str) -> tuple[float, float]:
    found = limits(size, text)
    return found.lower, found.upper


def steps(table: list[tuple[float, dict[str, float]]]) -> list[tuple[float, float, dict[str, float]]]:
    """End, geometric mean and values of the steps; the first step is that from 1 mm."""
    starts = [1.0, *(end for end, _ in table)]
    return [(end, math.sqrt(start * end), row) for start, (end, row) in zip(starts, table, strict=False)]


def test_standard_tolerances_are_those_of_the_formula() -> None:
    """IT5 to IT18 are multiples of i = 0.45 D^(1/3) + 0.001 D. The standard rounds them, up to 10 mm coarsely."""
    multiples = (7, 10, 16, 25, 40, 64, 100, 160, 250, 400, 640, 1000, 1600, 2500)
    for end, mean, row in steps(iso286.IT):
        unit = 0.45 * mean ** (1 / 3) + 0.001 * mean
        for grade, multiple in enumerate(multiples, 5):
            assert row[str(grade)] == pytest.approx(multiple * unit, rel=0.16 if end <= 10 else 0.06)


def test_standard_tolerances_grow_with_grade_and_size() -> None:
    rows = [[row[grade] for grade in iso286.GRADES] for _, row in iso286.IT]
    assert all(a < b for row in rows for a, b in itertools.pairwise(row))
    assert all(a <= b for one, other in itertools.pairwise(rows) for a, b in zip(one, other, strict=True))
    # The finest grades have formulas of their own.
    for _, mean, row in steps(iso286.IT)[:8]:
        assert row["01"] == pytest.approx(0.3 + 0.008 * mean, abs=0.15)
        assert row["0"] == pytest.approx(0.5 + 0.012 * mean, abs=0.25)
        assert row["1"] == pytest.approx(0.8 + 0.020 * mean, abs=0.3)


FORMULAS = {
    "a": lambda mean, end, it: 265 + 1.3 * mean if end <= 120 else 3.5 * mean,
    "b": lambda mean, end, it: 140 + 0.85 * mean if end <= 160 else 1.8 * mean,
    "c": lambda mean, end, it: 52 * mean**0.2 if end <= 40 else 95 + 0.8 * mean,
    "d": lambda mean, end, it: 16 * mean**0.44,
    "e": lambda mean, end, it: 11 * mean**0.41,
    "f": lambda mean, end, it: 5.5 * mean**0.41,
    "g": lambda mean, end, it: 2.5 * mean**0.34,
    "k": lambda mean, end, it: 0.6 * mean ** (1 / 3),
    "m": lambda mean, end, it: it["7"] - it["6"],
    "n": lambda mean, end, it: 5 * mean**0.34,
    "t": lambda mean, end, it: it["7"] + 0.63 * mean,
    "u": lambda mean, end, it: it["7"] + mean,
    "v": lambda mean, end, it: it["7"] + 1.25 * mean,
    "x": lambda mean, end, it: it["7"] + 1.6 * mean,
    "y": lambda mean, end, it: it["7"] + 2 * mean,
    "z": lambda mean, end, it: it["7"] + 2.5 * mean,
    "za": lambda mean, end, it: it["8"] + 3.15 * mean,
    "zb": lambda mean, end, it: it["9"] + 4 * mean,
    "zc": lambda mean, end, it: it["10"] + 5 * mean,
}


@pytest.mark.parametrize("letter", FORMULAS)
def test_fundamental_deviations_are_those_of_the_formulas(letter: str) -> None:
    """The formulas of ISO 286-1, annex: D is the mean of the step; a value that is off is a slip of the keyboard."""
    ends = [0.0, *(end for end, _ in iso286.IT)]
    for end, mean, row in steps(iso286.DEVIATIONS):
        if letter not in row or (letter in ("m", "n", "t", "u", "v", "x", "z", "za", "zb", "zc") and end <= 18):
            continue  # experience has decided the small sizes
        if letter in ("d", "e", "f", "g", "k", "n"):
            k = next(k for k, main in enumerate(ends) if main >= end)
            mean = math.sqrt(max(ends[k - 1], 1.0) * ends[k])
        it = next(values for main, values in iso286.IT if end <= main)
        wide = {"c": 0.16, "t": 0.09}.get(letter, 0.05)
        assert row[letter] == pytest.approx(FORMULAS[letter](mean, end, it), rel=wide, abs=1.05)


def test_fundamental_deviations_between_their_neighbours() -> None:
    """cd, ef, fg are geometric means, p is IT7 and up to 5 more, r the mean of p and s, s follows from IT8 or IT7."""
    for end, mean, row in steps(iso286.DEVIATIONS):
        it = next(values for main, values in iso286.IT if end <= main)
        for letter, one, other in (("cd", "c", "d"), ("ef", "e", "f"), ("fg", "f", "g"), ("r", "p", "s")):
            if letter in row and end > 3:
                assert row[letter] == pytest.approx(math.sqrt(row[one] * row[other]), rel=0.03, abs=1.05)
        assert -4 <= row["p"] - it["7"] <= 5
        assert 0 <= row["s"] - it["8"] <= 4 if end <= 50 else abs(row["s"] - it["7"] - 0.4 * mean) <= 4


def test_fits_of_basic_holes_as_pressfit_has_them() -> None:
    for size in (*(end for end, _ in iso286.DEVIATIONS), 1.0, 2.2, 7.0, 33.3, 77.0, 199.0, 400.1):
        for grade, letter in itertools.product(GRADES, SHAFT_LETTERS):
            theirs = pressfit.fit(f"{size} H{grade}/{letter}{grade}")
            assert limits_of(size, f"H{grade}") == (theirs.hole_ei_um, theirs.hole_es_um)
            assert limits_of(size, f"{letter}{grade}") == (theirs.shaft_ei_um, theirs.shaft_es_um)


#: published limits (lower, upper): tables of mould makers, ISO 286-2 with its corrigendum of 2006
PUBLISHED = """
5    J6 -3 5     J7 -6 6     J8 -8 10    K6 -6 2     K7 -9 3     K8 -13 5    M6 -9 -1    M7 -12 0    M8 -16 2
5    N6 -13 -5   N7 -16 -4   N8 -20 -2   R7 -23 -11
8    J6 -4 5     J7 -7 8     J8 -10 12   K6 -7 2     K7 -10 5    K8 -16 6    M6 -12 -3   M7 -15 0    M8 -21 1
8    N6 -16 -7   N7 -19 -4   N8 -25 -3   R7 -28 -13
20   J6 -5 8     J7 -9 12    J8 -13 20   K6 -11 2    K7 -15 6    K8 -23 10   M6 -17 -4   M7 -21 0    M8 -29 4
20   N6 -24 -11  N7 -28 -7   N8 -36 -3   R7 -41 -20  JS6 -6.5 6.5            P6 -31 -18  P7 -35 -14  P8 -55 -22
45   K6 -13 3    K7 -18 7    K8 -27 12   M6 -20 -4   M7 -25 0    M8 -34 5    N6 -28 -12  N7 -33 -8   N8 -42 -3
70   K6 -15 4    K7 -21 9    K8 -32 14   M6 -24 -5   M7 -30 0    M8 -41 5    N6 -33 -14  N7 -39 -9   N8 -50 -4
130  K6 -21 4    K7 -28 12   K8 -43 20   M6 -33 -8   M7 -40 0    M8 -55 8    N6 -45 -20  N7 -52 -12  N8 -67 -4
130  R7 -88 -48  P6 -61 -36  P7 -68 -28  P8 -106 -43
210  K6 -24 5    K7 -33 13   K8 -50 22   M6 -37 -8   M7 -46 0    M8 -63 9    N6 -51 -22  N7 -60 -14  N8 -77 -5
300  K6 -27 5    K7 -36 16   K8 -56 25   M6 -41 -9   M7 -52 0    M8 -72 9    N6 -57 -25  N7 -66 -14  N8 -86 -5
390  K6 -29 7    K7 -40 17   K8 -61 28   M6 -46 -10  M7 -57 0    M8 -78 11   N6 -62 -26  N7 -73 -16  N8 -94 -5
340  A13 1200 2090           P7 -98 -41  R6 -133 -97
100  E8 72 126   R10 -191 -51
25   R10 -112 -28            j5 -4 5     j6 -4 9     j7 -8 13    k5 2 11     js7 -10.5 10.5
300  f9 -186 -56 j6 -16 16   j7 -26 26
"""


def published() -> list[tuple[float, str, float, float]]:
    lines = (line.split() for line in PUBLISHED.strip().splitlines())
    groups = ((float(size), *values[k : k + 3]) for size, *values in lines for k in range(0, len(values), 3))
    return [(size, text, float(lower), float(upper)) for size, text, lower, upper in groups]


def test_published_limits() -> None:
    assert len(published()) > 100
    for size, text, lower, upper in published():
        assert limits_of(size, text) == (lower, upper), (size, text)


@pytest.mark.parametrize(
    ("size", "text", "expected"),
    [
        # delta for K, M and N up to IT8, and for P to ZC up to IT7, over 3 mm
        (30.0, "N8", (-36.0, -3.0)),
        (30.0, "N9", (-52.0, 0.0)),
        (30.0, "P7", (-35.0, -14.0)),
        (30.0, "P8", (-55.0, -22.0)),
        (30.0, "ZC7", (-231.0, -210.0)),
        (30.0, "ZC8", (-251.0, -218.0)),
        (30.0, "M9", (-60.0, -8.0)),
        (3.0, "K6", (-6.0, 0.0)),
        (3.0, "M7", (-12.0, -2.0)),
        (3.0, "N9", (-29.0, -4.0)),
        (3.0, "P7", (-16.0, -6.0)),
        # M6 over 250 to 315 mm: -9 and not -11
        (250.0, "M6", (-37.0, -8.0)),
        (250.1, "M6", (-41.0, -9.0)),
        (315.0, "M6", (-41.0, -9.0)),
        (315.1, "M6", (-46.0, -10.0)),
        # K above grade 8 up to 3 mm only
        (3.0, "K9", (-25.0, 0.0)),
        # k is away from the nominal size for the grades 4 to 7 only
        (30.0, "k3", (0.0, 4.0)),
        (30.0, "k4", (2.0, 8.0)),
        (30.0, "k7", (2.0, 23.0)),
        (30.0, "k8", (0.0, 33.0)),
        # j by grade; j8 up to 3 mm
        (3.0, "j8", (-6.0, 8.0)),
        # two steps meet: a size belongs to the step that it ends
        (18.0, "u6", (33.0, 44.0)),
        (18.001, "u6", (41.0, 54.0)),
        (10.0, "cd7", (-71.0, -56.0)),
        (0.8, "c11", (-120.0, -60.0)),
        (500.0, "zc18", (2600.0, 12300.0)),
        (12.0, "H01", (0.0, 0.5)),
    ],
)
def test_special_rules(size: float, text: str, expected: tuple[float, float]) -> None:
    assert limits_of(size, text) == expected


@pytest.mark.parametrize(
    ("size", "text", "message"),
    [
        (12.0, "q6", "q is no shaft of ISO 286-1; known: a, b, c, cd"),
        (12.0, "Q7", "Q is no hole"),
        (12.0, "H19", "not a tolerance class"),
        (12.0, "7H", "not a tolerance class"),
        (12.0, "j4", "j with the grades 5, 6, 7, 8 only"),
        (12.0, "j9", "j with the grades"),
        (12.0, "J5", "J with the grades 6, 7, 8 only"),
        (12.0, "j8", "is not in ISO 286-1 for 12 mm"),
        (12.0, "cd7", "is not in ISO 286-1 for 12 mm"),
        (24.0, "t6", "is not in ISO 286-1 for 24 mm"),
        (14.0, "v6", "is not in ISO 286-1 for 14 mm"),
        (18.0, "y6", "is not in ISO 286-1 for 18 mm"),
        (12.0, "K9", "K above grade 8 up to 3 mm only"),
        (12.0, "P2", "from grade 3 on"),
        (1.0, "a11", "not used up to 1 mm"),
        (1.0, "B11", "not used up to 1 mm"),
        (1.0, "N9", "not used up to 1 mm"),
        (1.0, "h14", "grades 14 to 18 are not used up to 1 mm"),
        (500.1, "H7", "up to 500 mm, not for 500.1 mm"),
        (0.0, "H7", "above 0"),
        (math.nan, "H7", "above 0"),
    ],
)
def test_what_the_standard_leaves_out(size: float, text: str, message: str) -> None:
    with pytest.raises(NotInStandard, match=message):
        limits(size, text)


def test_hole_and_shaft_basis_are_the_same_fit() -> None:
    """What delta is for: H7/p6 = P7/h6, H8/n7 = N8/h7, over 3 mm, with M6 over 250 to 315 mm as the exception."""
    grades = [str(grade) for grade in range(3, 9)]
    for end, row in iso286.DEVIATIONS[1:]:
        for letter, (finer, coarser) in itertools.product(row, itertools.pairwise(grades)):
            above_seven = letter not in ("k", "m", "n") and coarser == "8"
            one_grade_only = letter == "k" and finer not in ("4", "5", "6", "7")
            if letter in ("j5", "j6", "j7", "j8", "J6", "J7", "J8") or above_seven or one_grade_only:
                continue
            if letter == "m" and coarser == "6" and 250 < end <= 315:
                continue
            hole, shaft = limits(end, f"H{coarser}"), limits(end, f"{letter}{finer}")
            other_hole, other_shaft = limits(end, f"{letter.upper()}{coarser}"), limits(end, f"h{finer}")
            if letter < "h":
                assert hole.lower - shaft.upper == other_hole.lower - other_shaft.upper
            else:
                assert hole.upper - shaft.lower == other_hole.upper - other_shaft.lower


@pytest.mark.parametrize("text", ["g6/H7", "H7", "H7/", "/g6", "H7/G6", "h7/g6", "H7/g6/k6", "", "H7-g6", "H7/q6"])
def test_what_is_no_fit(text: str) -> None:
    with pytest.raises(NotInStandard):
        fit(text)


def test_clearance_of_ball_bearings_of_catalogues() -> None:
    """Rows as catalogues of several makers have them, and what all rows have in common."""
    assert [travel(10.0, group) for group in ("C2", "CN", "C3", "C4", "C5")] == [
        (0.0, 7.0), (2.0, 13.0), (8.0, 23.0), (14.0, 29.0), (20.0, 37.0),
    ]  # fmt: skip
    assert travel(25.0, "C3") == (13.0, 28.0)
    assert travel(50.0, "N") == travel(50.0, "CN") == (6.0, 23.0)
    assert travel(100.0, "C4") == (53.0, 84.0)
    assert travel(200.0, "C5") == (150.0, 230.0)
    for _, values in iso5753.STEPS:
        known = [float(value) for value in values if value != "."]
        assert known[0::2] == sorted(known[0::2])
        assert known[1::2] == sorted(known[1::2])
        assert all(least < most for least, most in zip(known[0::2], known[1::2], strict=True))
        # Neighbouring groups overlap.
        assert all(most >= least for most, least in zip(known[1::2], known[2::2], strict=False))


@pytest.mark.parametrize(
    ("bore", "group", "message"),
    [
        (25.0, "C6", "not a group of ISO 5753-1"),
        (2.5, "CN", "above 2.5 up to 200 mm"),
        (201.0, "CN", "maker's catalogue"),
        (5.0, "C4", "no group C4 for a bore of 5 mm"),
    ],
)
def test_bearings_that_the_standard_leaves_out(bore: float, group: str, message: str) -> None:
    with pytest.raises(NotInStandard, match=message):
        travel(bore, group)
