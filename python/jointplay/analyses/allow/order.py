"""What one orders: the loosest preferred fit, or group of ball bearings, with which the limits hold."""

from collections.abc import Callable, Sequence

from jointplay.model.sizing import GROUPS, Sizing

from .asked import ASSEMBLY, REFUSED, Asked


def loosest(asked: Asked, source: Sizing) -> str:
    """The loosest of the fits or groups for the diameter of a source; none where no one holds, or has no diameter."""
    if source.bearing:
        return _last(asked, GROUPS, source.of_bearing)
    return _last(asked, source.fits(asked.m), source.of_fit)


def why_none(asked: Asked, source: Sizing, fit: str) -> str:
    """Why the loosest fit is none; empty where it is one, or where a fit is no size of the source."""
    if fit or not (source.bearing or source.can_have_fit):
        return ""
    if source.bearing:
        return "no_group_holds"
    if source.fits(asked.m):
        return "no_fit_holds"
    if source.diameter is not None:
        return "not_in_standard"
    # A slider is said by its nominal width, and seldom has a fit.
    return "" if source.measure == "gap" else "no_diameter"


def _last(asked: Asked, names: Sequence[str], changes: Callable[[str], dict[str, object]]) -> str:
    """The last name up to which the limits hold with all of them, from tight to loose.

    Those that are too tight to be assembled are passed over.
    """
    best, low, high = "", 0, len(names)
    while low < high:
        # Where more play never uses less, each look leaves half of the names.
        k = (low + high) // 2 if asked.is_monotone else low
        use = asked.use(changes(names[k]))
        if use.holds:
            best = names[k]
        if use.holds or use.quantity in (ASSEMBLY, REFUSED):
            low = k + 1
        else:
            high = k
    return best
