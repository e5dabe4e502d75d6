"""ISO 286: limits of the sizes of holes and shafts, up to 500 mm.

IT = upper - lower deviation, by grade and size; D is the fundamental deviation of the letter, by size

shaft  a..h    upper = -D                  hole  A..H    lower = D
       j       lower = D                         J       upper = D
       js      -IT/2, +IT/2                      JS      -IT/2, +IT/2
       k..zc   lower = D                         K..ZC   upper = -D + delta

delta = IT of the grade - IT of the grade before: over 3 mm, for K, M and N up to IT8 and for P to ZC up to IT7; else 0.
It makes the fit of H7 with p6 the same as that of P7 with h6. Exceptions are in `_upper_of_hole` and `_refuse_small`.

Source: ISO 286-1:2010 (IT1 to IT18, fundamental deviations), ISO 286-1:1988 (IT01, IT0), as reprinted in handbooks and
catalogues. Sizes in mm, deviations in micrometres.
"""

import re
from dataclasses import dataclass

from jointplay.errors import SHOWN, shown

from .errors import NotInStandard

LARGEST = 500.0
#: what a size may be above the end of a step by rounding of its unit
ROUNDED = 1e-9

#: standard tolerances by the end of the step and the grade
_TOLERANCES = """
end  01   0   1   2   3  4  5  6  7  8   9  10  11  12  13   14   15   16   17   18
  3 0.3 0.5 0.8 1.2   2  3  4  6 10 14  25  40  60 100 140  250  400  600 1000 1400
  6 0.4 0.6   1 1.5 2.5  4  5  8 12 18  30  48  75 120 180  300  480  750 1200 1800
 10 0.4 0.6   1 1.5 2.5  4  6  9 15 22  36  58  90 150 220  360  580  900 1500 2200
 18 0.5 0.8 1.2   2   3  5  8 11 18 27  43  70 110 180 270  430  700 1100 1800 2700
 30 0.6   1 1.5 2.5   4  6  9 13 21 33  52  84 130 210 330  520  840 1300 2100 3300
 50 0.6   1 1.5 2.5   4  7 11 16 25 39  62 100 160 250 390  620 1000 1600 2500 3900
 80 0.8 1.2   2   3   5  8 13 19 30 46  74 120 190 300 460  740 1200 1900 3000 4600
120   1 1.5 2.5   4   6 10 15 22 35 54  87 140 220 350 540  870 1400 2200 3500 5400
180 1.2   2 3.5   5   8 12 18 25 40 63 100 160 250 400 630 1000 1600 2500 4000 6300
250   2   3 4.5   7  10 14 20 29 46 72 115 185 290 460 720 1150 1850 2900 4600 7200
315 2.5   4   6   8  12 16 23 32 52 81 130 210 320 520 810 1300 2100 3200 5200 8100
400   3   5   7   9  13 18 25 36 57 89 140 230 360 570 890 1400 2300 3600 5700 8900
500   4   6   8  10  15 20 27 40 63 97 155 250 400 630 970 1550 2500 4000 6300 9700
"""

#: fundamental deviations by the end of the step; of j and J by grade; a point where the standard has none
_CLEAR = """
end    a   b   c cd   d   e ef  f fg  g  j5  j6  j7 j8 J6 J7 J8
  3  270 140  60 34  20  14 10  6  4  2  -2  -2  -4 -6  2  4  6
  6  270 140  70 46  30  20 14 10  6  4  -2  -2  -4  .  5  6 10
 10  280 150  80 56  40  25 18 13  8  5  -2  -2  -5  .  5  8 12
 14  290 150  95  .  50  32  . 16  .  6  -3  -3  -6  .  6 10 15
 18  290 150  95  .  50  32  . 16  .  6  -3  -3  -6  .  6 10 15
 24  300 160 110  .  65  40  . 20  .  7  -4  -4  -8  .  8 12 20
 30  300 160 110  .  65  40  . 20  .  7  -4  -4  -8  .  8 12 20
 40  310 170 120  .  80  50  . 25  .  9  -5  -5 -10  . 10 14 24
 50  320 180 130  .  80  50  . 25  .  9  -5  -5 -10  . 10 14 24
 65  340 190 140  . 100  60  . 30  . 10  -7  -7 -12  . 13 18 28
 80  360 200 150  . 100  60  . 30  . 10  -7  -7 -12  . 13 18 28
100  380 220 170  . 120  72  . 36  . 12  -9  -9 -15  . 16 22 34
120  410 240 180  . 120  72  . 36  . 12  -9  -9 -15  . 16 22 34
140  460 260 200  . 145  85  . 43  . 14 -11 -11 -18  . 18 26 41
160  520 280 210  . 145  85  . 43  . 14 -11 -11 -18  . 18 26 41
180  580 310 230  . 145  85  . 43  . 14 -11 -11 -18  . 18 26 41
200  660 340 240  . 170 100  . 50  . 15 -13 -13 -21  . 22 30 47
225  740 380 260  . 170 100  . 50  . 15 -13 -13 -21  . 22 30 47
250  820 420 280  . 170 100  . 50  . 15 -13 -13 -21  . 22 30 47
280  920 480 300  . 190 110  . 56  . 17 -16 -16 -26  . 25 36 55
315 1050 540 330  . 190 110  . 56  . 17 -16 -16 -26  . 25 36 55
355 1200 600 360  . 210 125  . 62  . 18 -18 -18 -28  . 29 39 60
400 1350 680 400  . 210 125  . 62  . 18 -18 -18 -28  . 29 39 60
450 1500 760 440  . 230 135  . 68  . 20 -20 -20 -32  . 33 43 66
500 1650 840 480  . 230 135  . 68  . 20 -20 -20 -32  . 33 43 66
"""
_TIGHT = """
end k  m  n  p   r   s   t   u   v   x    y    z   za   zb   zc
  3 0  2  4  6  10  14   .  18   .  20    .   26   32   40   60
  6 1  4  8 12  15  19   .  23   .  28    .   35   42   50   80
 10 1  6 10 15  19  23   .  28   .  34    .   42   52   67   97
 14 1  7 12 18  23  28   .  33   .  40    .   50   64   90  130
 18 1  7 12 18  23  28   .  33  39  45    .   60   77  108  150
 24 2  8 15 22  28  35   .  41  47  54   63   73   98  136  188
 30 2  8 15 22  28  35  41  48  55  64   75   88  118  160  218
 40 2  9 17 26  34  43  48  60  68  80   94  112  148  200  274
 50 2  9 17 26  34  43  54  70  81  97  114  136  180  242  325
 65 2 11 20 32  41  53  66  87 102 122  144  172  226  300  405
 80 2 11 20 32  43  59  75 102 120 146  174  210  274  360  480
100 3 13 23 37  51  71  91 124 146 178  214  258  335  445  585
120 3 13 23 37  54  79 104 144 172 210  254  310  400  525  690
140 3 15 27 43  63  92 122 170 202 248  300  365  470  620  800
160 3 15 27 43  65 100 134 190 228 280  340  415  535  700  900
180 3 15 27 43  68 108 146 210 252 310  380  465  600  780 1000
200 4 17 31 50  77 122 166 236 284 350  425  520  670  880 1150
225 4 17 31 50  80 130 180 258 310 385  470  575  740  960 1250
250 4 17 31 50  84 140 196 284 340 425  520  640  820 1050 1350
280 4 20 34 56  94 158 218 315 385 475  580  710  920 1200 1550
315 4 20 34 56  98 170 240 350 425 525  650  790 1000 1300 1700
355 4 21 37 62 108 190 268 390 475 590  730  900 1150 1500 1900
400 4 21 37 62 114 208 294 435 530 660  820 1000 1300 1650 2100
450 5 23 40 68 126 232 330 490 595 740  920 1100 1450 1850 2400
500 5 23 40 68 132 252 360 540 660 820 1000 1250 1600 2100 2600
"""


def _table(text: str) -> list[tuple[float, dict[str, float]]]:
    """The steps of a table: the end of each, and its values by the heads of the columns."""
    (_, *heads), *rows = (line.split() for line in text.strip().splitlines())
    values = ((end, zip(heads, row, strict=True)) for end, *row in rows)
    return [(float(end), {head: float(value) for head, value in row if value != "."}) for end, row in values]


IT = _table(_TOLERANCES)
DEVIATIONS = [(end, clear | tight) for (end, clear), (_, tight) in zip(_table(_CLEAR), _table(_TIGHT), strict=True)]

GRADES = tuple(IT[0][1])
SHAFTS = tuple("a b c cd d e ef f fg g h j js k m n p r s t u v x y z za zb zc".split())  # noqa: SIM905
HOLES = tuple(letter.upper() for letter in SHAFTS)
CLASS = re.compile(r"([A-Za-z]{1,3})(01|0|1[0-8]|[1-9])")


@dataclass(frozen=True)
class SizeLimits:
    """Limits of a size, as deviations from the nominal size."""

    #: `lower`, `upper`: in micrometres
    lower: float
    upper: float


def parse(text: str) -> tuple[str, str]:
    """Letter and grade of a tolerance class.

    Raises
    ------
    NotInStandard
        When it is none of ISO 286.

    Examples
    --------
    >>> parse("js6")
    ('js', '6')
    """
    found = CLASS.fullmatch(text) if len(text) <= SHOWN else None
    if found is None:
        raise NotInStandard(f"{shown(text)} is not a tolerance class such as H7 or g6, with a grade of 01, 0, 1 to 18")
    letter, grade = found.groups()
    is_hole = letter[0].isupper()
    known = HOLES if is_hole else SHAFTS
    if letter not in known:
        what = "hole" if is_hole else "shaft"
        raise NotInStandard(f"{shown(text)}: {letter} is no {what} of ISO 286-1; known: {', '.join(known)}")
    allowed = {"j": ("5", "6", "7", "8"), "J": ("6", "7", "8")}.get(letter)
    if allowed is not None and grade not in allowed:
        raise NotInStandard(f"{shown(text)}: ISO 286-1 has {letter} with the grades {', '.join(allowed)} only")
    return letter, grade


def fit(text: str) -> tuple[str, str]:
    """The classes of hole and shaft of a fit.

    Raises
    ------
    NotInStandard
        When it is no fit.

    Examples
    --------
    >>> fit("H7/g6")
    ('H7', 'g6')
    """
    hole, slash, shaft = (part.strip() for part in text.partition("/"))
    if not (hole and slash and shaft):
        raise NotInStandard(f"{shown(text)} is not a fit; write the class of the hole and that of the shaft: H7/g6")
    if parse(hole)[0].islower() or parse(shaft)[0].isupper():
        raise NotInStandard(f"{shown(text)}: the hole, in upper case, comes first, then the shaft in lower case: H7/g6")
    return hole, shaft


def limits(size: float, text: str) -> SizeLimits:
    """Limits of a hole or a shaft.

    Parameters
    ----------
    size : float
        Nominal size in mm.
    text : str
        Tolerance class, upper case for a hole.

    Raises
    ------
    NotInStandard
        When the standard has no such class, or not for this size.

    Examples
    --------
    >>> limits(12, "H7"), limits(12, "g6"), limits(30, "K7")
    (SizeLimits(lower=0.0, upper=18.0), SizeLimits(lower=-17.0, upper=-6.0), SizeLimits(lower=-15.0, upper=6.0))
    """
    letter, grade = parse(text)
    if not 0.0 < size <= LARGEST * (1.0 + ROUNDED):
        raise NotInStandard(f"ISO 286 is known here for sizes above 0 up to {LARGEST:g} mm, not for {size:.6g} mm")
    _refuse_small(size, letter, grade, text)
    width = _row(IT, size)[grade]
    if letter in ("js", "JS"):
        return SizeLimits(-width / 2.0, width / 2.0)
    if letter in ("j", "J"):
        return _from(letter, _deviation(size, f"{letter}{grade}", text), width)
    if letter in ("h", "H"):
        return _from(letter, 0.0, width)
    deviation = _deviation(size, letter.lower(), text)
    if letter.lower() < "h":
        return _from(letter, deviation if letter.isupper() else -deviation, width)
    if letter.islower():
        # k is away from the nominal size for the grades of transition fits only.
        return _from(letter, 0.0 if letter == "k" and grade not in ("4", "5", "6", "7") else deviation, width)
    return _from(letter, _upper_of_hole(size, letter, grade, deviation, text), width)


def _from(letter: str, fundamental: float, width: float) -> SizeLimits:
    """Limits from the fundamental deviation, which is the one that is nearer to the nominal size."""
    is_lower = (letter.lower() > "h") == letter.islower()
    return SizeLimits(fundamental, fundamental + width) if is_lower else SizeLimits(fundamental - width, fundamental)


def _upper_of_hole(size: float, letter: str, grade: str, deviation: float, text: str) -> float:
    """Fundamental deviation of the holes K to ZC."""
    number = -1 if grade == "01" else int(grade)
    is_small = size <= 3.0 * (1.0 + ROUNDED)
    if number > (8 if letter in ("K", "M", "N") else 7):
        if letter == "K" and not is_small:
            raise NotInStandard(f"{shown(text)}: ISO 286-1 has K above grade 8 up to 3 mm only, not for {size:.6g} mm")
        return 0.0 if letter == "N" and not is_small else -deviation
    if letter == "M" and number == 6 and 250.0 * (1.0 + ROUNDED) < size <= 315.0 * (1.0 + ROUNDED):
        return -9.0
    if is_small:
        return -deviation
    if number < 3:
        raise NotInStandard(f"{shown(text)}: above 3 mm ISO 286-1 has the holes K to ZC from grade 3 on")
    widths = _row(IT, size)
    return -deviation + widths[grade] - widths[str(number - 1)]


def _refuse_small(size: float, letter: str, grade: str, text: str) -> None:
    """What the standard leaves out up to 1 mm."""
    if size > 1.0 + ROUNDED:
        return
    if letter in ("a", "A", "b", "B") or (letter == "N" and grade not in GRADES[:10]):
        raise NotInStandard(f"{shown(text)} is not used up to 1 mm (ISO 286-1); here the size is {size:.6g} mm")
    if grade in GRADES[15:]:
        raise NotInStandard(f"{shown(text)}: grades 14 to 18 are not used up to 1 mm (ISO 286-1); here: {size:.6g} mm")


def _deviation(size: float, letter: str, text: str) -> float:
    row = _row(DEVIATIONS, size)
    if letter not in row:
        raise NotInStandard(f"{shown(text)} is not in ISO 286-1 for {size:.6g} mm")
    return row[letter]


def _row(table: list[tuple[float, dict[str, float]]], size: float) -> dict[str, float]:
    """The values of the step that a size lies in."""
    return next(values for end, values in table if size <= end * (1.0 + ROUNDED))
