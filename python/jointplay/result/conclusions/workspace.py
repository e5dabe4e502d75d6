"""The answer of `workspace`: how large the region is, what bounds it, and the largest disc and box in it."""

import math
from collections.abc import Iterator

from jointplay.result import Result

from .sizes import share_of
from .words import Conclusion, Sentence, say

#: what bounds a region, by the word in the result
BOUNDS = {
    "not_assembled": "reach (beyond it the links cannot be assembled)",
    "singular": "a singularity",
    "not_shown": "where it is not shown that the limits hold",
    "edge": "the edge of the grid",
}
#: what bounds a smaller part is not named
LEAST = 0.005
#: parts of a boundary that are named
MOST = 8
GROUPS = {"drives": "stroke", "joints": "range", "limits": "limit"}
ENDS = {"low": "lower end", "high": "upper end"}


def of_workspace(result: Result) -> Conclusion:
    """The size, what bounds it, disc and box, and under which conditions that holds."""
    return Conclusion((*_answer(result), *_conditions(result)))


def bound_words(word: str) -> str:
    """What bounds a region, in words.

    Examples
    --------
    >>> bound_words("drives.q1.high"), bound_words("limits.position")
    ('stroke of q1 (upper end)', 'limit of position')
    """
    group, _, rest = word.partition(".")
    if group not in GROUPS:
        return BOUNDS[word]
    if group == "limits":
        return f"limit of {rest}"
    name, _, side = rest.rpartition(".")
    return f"{GROUPS[group]} of {name} ({ENDS[side]})"


def with_error(value: float, error: float, unit: str) -> str:
    """A number with its uncertainty, both to the second digit of this; two digits where it is not known.

    Examples
    --------
    >>> with_error(12345.678, 21.3, "mm^2"), with_error(23546.1, 3575.2, "mm^2"), with_error(1.23456, 0.0, "mm")
    ('12,346 ± 21 mm^2', '23,500 ± 3,600 mm^2', '1.235 mm')
    >>> with_error(26.02, math.nan, "mm")
    'roughly 26 mm'
    """
    if error <= 1e-9 * abs(value) or value == 0.0:
        return say(value, unit)
    shown = (value, error) if math.isfinite(error) else (value,)
    places = 1 - math.floor(math.log10(abs(shown[-1])))
    numbers = " ± ".join(f"{round(one, places):,.{max(0, places)}f}" for one in shown)
    return f"{numbers} {unit}" if len(shown) == 2 else f"roughly {numbers} {unit}"


def _answer(result: Result) -> Iterator[Sentence]:
    if str(result.get("status")) == "empty":
        yield Sentence("There is no workspace: at no node of the grid does everything hold.", is_alarm=True)
        return
    flat = len(result.labels("along")) == 2
    size, error = (float(result.get(name)) for name in ("size", "size_error"))
    shares = dict(zip(result.labels("bound"), result.get("share").tolist(), strict=True))
    is_open = shares.get("not_shown", 0.0) >= LEAST
    yield Sentence(
        f"The workspace{', as far as it is shown,' * is_open} has {'an area' if flat else 'a volume'} of"
        f" {with_error(size, error, result.unit('size'))}."
    )
    named = [f"{bound_words(word)} {share_of(share, 2)}" for word, share in shares.items() if share >= LEAST]
    more = f", and {len(named) - MOST} more" if len(named) > MOST else ""
    shown = " More specimens show more of it." if is_open and result.attrs.get("asked") == "random" else ""
    yield Sentence(f"Bounded by: {', '.join(named[:MOST])}{more}.{shown}")
    if str(result.attrs.get("centre", "")) == "outside":
        yield Sentence(f"The centre {_place(result, 'disc_centre')} is not in it.", is_alarm=True)
        return
    unit = result.unit("disc_radius")
    radius, error = (float(result.get(name)) for name in ("disc_radius", "disc_radius_error"))
    where = "there" if "centre" in result.attrs else "in it"
    ball = (
        f"The largest {'disc' if flat else 'ball'} {where} has a radius of {with_error(radius, error, unit)},"
        f" about {_place(result, 'disc_centre')}"
    )
    sides = " × ".join(f"{side:.4g}" for side in (result.get("box_high") - result.get("box_low")).tolist())
    size, error = (float(result.get(name)) for name in ("box_size", "box_size_error"))
    yield Sentence(
        f"{ball}; the largest box along the axes that was found has {sides} {unit}"
        f" ({with_error(size, error, result.unit('box_size'))})."
    )


def _place(result: Result, name: str) -> str:
    """``(x, y) = (1, 2) mm``."""
    place = result.get(name)
    # The largest coordinate has four digits.
    digits = 3 - math.floor(math.log10(max(float(abs(place).max()), 1e-12)))
    values = ", ".join(f"{round(value, digits) + 0.0:.6g}" for value in place.tolist())
    return f"({', '.join(result.labels('along'))}) = ({values}) {result.unit(name)}"


def _conditions(result: Result) -> Iterator[Sentence]:
    attrs = result.attrs
    unit = result.unit("disc_radius")
    if not attrs["ranges"]:
        yield Sentence(
            "No drive and no joint has a range in the file, so that only assembly and singularities bound it."
        )
    if "edge" in result.labels("bound"):
        yield Sentence("It reaches the edge of the grid, and may go on there.")
    if "start" in attrs:
        yield Sentence("The start of the file is not in it; it is the region nearest to the start.", is_alarm=True)
    if attrs["apart"]:
        words = "nodes hold as well, but hang together with it only through what is outside; they do not count"
        yield Sentence(f"{attrs['apart']} {words}.")
    if int(attrs.get("orientations", 1)) > 1:
        words = f"At every position each of {attrs['orientations']} orientations is possible"
        yield Sentence(f"{words} ({attrs['orientation']}); between them nothing was looked at.")
    elif "orientation" in attrs:
        yield Sentence(f"The output has one orientation: {attrs['orientation']}.")
    if "held" in attrs:
        yield Sentence(f"Held: {attrs['held']}.")
    spacing, tolerance = (say(float(attrs[name]), unit) for name in ("spacing", "tolerance"))
    yield Sentence(
        f"Nodes are {spacing} apart: narrower islands, holes and necks can be missed. Between nodes the boundary is"
        f" found to {tolerance}; ± is the difference from every second node."
    )
