"""The words of verdicts: places, shares, limits, and what to blame."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from jointplay.result import (
    HIGHER,
    LOAD,
    SIZES,
    Result,
    blame,
    commanded,
    in_words,
    largest,
    parts_by_cause,
    rounding,
    share_of,
    shares,
    split,
)

if TYPE_CHECKING:
    pass

#: significant digits of what a sentence names
DIGITS = 4
#: drives whose values are named beside the number of a configuration
FEW = 2
#: as many configurations are named one by one
MOST = 8


def shown(result: Result, value: float, unit: str) -> str:
    """A length or an angle with its unit; what is rounding is nothing."""
    return f"{value if abs(value) > rounding(result, unit) else 0.0:.{DIGITS}g} {unit}".rstrip()


def place(result: Result, at: int) -> str:
    """``configuration 3 (theta = 40 deg)``."""
    drives = result.drives
    if not 0 < len(drives) <= FEW:
        return f"configuration {at}"
    told = (f"{name} = {commanded(drive, at):g} {drive.units}".rstrip() for name, drive in drives.items())
    return f"configuration {at} ({', '.join(told)})"


def there(result: Result, at: int) -> str:
    """`` at configuration 3 (theta = 40 deg)``; nothing where there is only one."""
    return f" at {place(result, at)}" if result.sizes.get("configuration", 1) > 1 else ""


def configurations(places: Sequence[int]) -> str:
    """``configurations 1, 3``."""
    if len(places) > MOST:
        return f"{len(places)} configurations (the first is {places[0]})"
    return f"configuration{'s' * (len(places) > 1)} {', '.join(map(str, places))}"


def left_out(places: Sequence[int]) -> str:
    """Which configurations are left out, as the end of a sentence; nothing where none are."""
    return f"; left out: {configurations(places)}, where the machine cannot be" if places else ""


def cause(result: Result, quantity: str, side: str, at: int) -> tuple[list[str], float] | None:
    """The sources with the largest share in a quantity, and that share; None where nothing is known of it.

    Parameters
    ----------
    side : {"low", "high"}
        The end of a component.
    at : int
        The configuration.
    """
    if "contribution" not in result.data:
        return None
    dims = result.data["contribution"].dims
    if "quantity" in dims:
        parts = result.get("contribution", quantity=quantity, **({"side": side} if "side" in dims else {}))[at]
        return largest(tuple(result.labels("source")), shares(parts[None])[0])
    if quantity in SIZES:
        return blame(result).largest(quantity, at)
    if "extreme" in dims:
        causes = tuple(result.labels("source"))
        values = result.get("contribution", extreme=f"{quantity} {side}")[at]
    else:
        causes, every = parts_by_cause(result)
        values = every[at, :, result.labels("component").index(quantity)]
    return share_of(result, causes, values, quantity, side, at)


def _cause_where_open(result: Result, quantity: str, side: str, at: int) -> tuple[list[str], float] | None:
    """The same where sources that the load leaves open are as far as they can be that way."""
    if not {"contribution", "undetermined_contribution"} <= set(result.data):
        return None
    causes, every = parts_by_cause(result)
    parts, components = every[at].copy(), result.labels("component")
    error = parts.sum(axis=0)
    signs = np.where(error < 0.0, -1.0, 1.0) if quantity in SIZES else {"low": -1.0, "high": 1.0}[side]
    widths = result.get("undetermined_contribution")[at]
    parts[: len(widths)] += signs * widths
    chosen = split(components)[SIZES.index(quantity)] if quantity in SIZES else [quantity]
    parts = parts[:, [components.index(name) for name in chosen]]
    return largest(causes, shares((parts @ parts.sum(axis=0))[None])[0])


#: what is said before a source whose size makes the most of a value
TIGHTEN = "; to tighten first"


def caused(result: Result, quantity: str, side: str, at: int, head: str, *, is_open: bool = False) -> str:
    """The end of a sentence that says what the cause is, behind a mark and some words such as ``; to blame``.

    Where a value `is_open`, sources that the load leaves open are as far as they can be its way.
    """
    found = (_cause_where_open if is_open else cause)(result, quantity, side, at)
    if found is None:
        return ""
    sources, share = found
    if sources == [LOAD]:
        return f"{head[0]} most of it is the deformation under the load, {100 * share:.0f} %"
    if sources == [HIGHER]:
        told = 100.0 * (1.0 - share)
        return f"{head[0]} first order explains {f'only {told:.0f} %' if told >= 0.5 else 'nothing'} of it"
    # Correlations take back what they add: the parts of all sources are the whole.
    back = (
        ", which correlated sources take back in part" if share > 1.0 and result.attrs["question"] == "random" else ""
    )
    if head == TIGHTEN:
        known = str(result.attrs.get("known_deviations", "")).split(", ")
        sized = [source for source in sources if source not in known]
        if not sized:
            return f"; to correct first: {in_words(sources, share)}, known and without a tolerance"
        sources = sized
    return f"{head}: {in_words(sources, share)}{back}"


def limits_in_words(result: Result) -> str:
    """``position 0.3 mm or x from -0.1 to 0.2 mm``."""
    told = []
    for name, (low, high) in zip(result.labels("quantity"), result.get("limit").tolist(), strict=True):
        unit = result.unit("limit", quantity=name)
        if low == low and high == high:
            told.append(f"{name} from {low:g} to {high:g} {unit}")
        elif low == low or high == high:
            told.append(f"{name} {high if high == high else low:g} {unit}")
    return " or ".join(told)


def percent(share: float) -> str:
    """A share in per cent, ppm or ppb, with the digits that tell it from nothing, or from all.

    Examples
    --------
    >>> [percent(share) for share in (0.0134, 0.00012, 2e-9, 0.9973, 0.999998, 0.0, 1.0)]
    ['1.34 %', '120 ppm', '2 ppb', '99.73 %', '99.9998 %', '0 %', '100 %']
    """
    if 0.0 < share < 1e-7:
        return f"{1e9 * share:.3g} ppb"
    if 0.0 < share < 1e-3:
        return f"{1e6 * share:.3g} ppm"
    if 0.99 < share < 1.0:
        digits = 1 - math.floor(math.log10(100.0 * (1.0 - share)))
        return f"{100.0 * share:.{min(digits, 10)}f}".rstrip("0").rstrip(".") + " %"
    return f"{100.0 * share:.3g} %"


def rounded(result: Result) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """What of every quantity is rounding, in the units of the result."""
    return np.array([rounding(result, result.unit("limit", quantity=name)) for name in result.labels("quantity")])
