"""ISO 5753-1: radial internal clearance of deep groove ball bearings with a cylindrical bore, before mounting.

It is the whole travel of one ring against the other, from side to side: the offset of a joint goes to half of it.

Source: ISO 5753-1:2009 for bores up to 200 mm, where the catalogues of makers agree; beyond it they differ. Bores in
mm, clearances in micrometres.
"""

from jointplay.errors import not_known

from .errors import NotInStandard

#: bores are above the first number
SMALLEST = 2.5
#: what a bore may be above the end of a step by rounding of its unit
ROUNDED = 1e-9

#: the end of the step, then the smallest and the largest clearance of the groups 2, N, 3, 4 and 5
_CLEARANCES = """
  6  0  7   2 13   8  23    .   .    .   .
 10  0  7   2 13   8  23   14  29   20  37
 18  0  9   3 18  11  25   18  33   25  45
 24  0 10   5 20  13  28   20  36   28  48
 30  1 11   5 20  13  28   23  41   30  53
 40  1 11   6 20  15  33   28  46   40  64
 50  1 11   6 23  18  36   30  51   45  73
 65  1 15   8 28  23  43   38  61   55  90
 80  1 15  10 30  25  51   46  71   65 105
100  1 18  12 36  30  58   53  84   75 120
120  2 20  15 41  36  66   61  97   90 140
140  2 23  18 48  41  81   71 114  105 160
160  2 23  18 53  46  91   81 130  120 180
180  2 25  20 61  53 102   91 147  135 200
200  2 30  25 71  63 117  107 163  150 230
"""

#: how a file names the groups, with the column of each
GROUPS = {"C2": 0, "2": 0, "CN": 1, "N": 1, "C3": 2, "3": 2, "C4": 3, "4": 3, "C5": 4, "5": 4}
#: clearances of each step: its end, and the numbers in pairs
STEPS = [(float(end), values) for end, *values in (line.split() for line in _CLEARANCES.strip().splitlines())]


def travel(bore: float, group: str) -> tuple[float, float]:
    """Smallest and largest travel of one ring against the other, in micrometres.

    Parameters
    ----------
    bore : float
        Diameter of the bore in mm.
    group : str
        C2, CN, C3, C4 or C5, also without the C.

    Raises
    ------
    NotInStandard
        When there is no such group, or none for this bore.

    Examples
    --------
    >>> travel(25, "C3")
    (13.0, 28.0)
    """
    if group not in GROUPS:
        raise NotInStandard(not_known(group, "a group of ISO 5753-1", [name for name in GROUPS if name[0] == "C"]))
    largest = STEPS[-1][0]
    if not SMALLEST < bore <= largest * (1.0 + ROUNDED):
        raise NotInStandard(
            f"ISO 5753-1 is known here for bores above {SMALLEST:g} up to {largest:g} mm, not for {bore:.6g} mm; beyond"
            " it, give the clearance of the maker's catalogue: diametral and tolerance"
        )
    values = next(values for end, values in STEPS if bore <= end * (1.0 + ROUNDED))
    least, most = values[2 * GROUPS[group] : 2 * GROUPS[group] + 2]
    if least == ".":
        raise NotInStandard(f"ISO 5753-1 has no group {group} for a bore of {bore:.6g} mm; known there: C2, CN, C3")
    return float(least), float(most)
