"""Where a function of one number ends, changes its sign or is smallest, in few values of it.

Every value costs the closure of a mechanism, and one beyond the end of an assembly branch costs most. So both searches
go where the values so far say, and halve (or take the golden section) where that does not pay.
"""

import math
from collections.abc import Callable

#: an edge is known to this part of the bracket that it is searched in: to the last digits of a double
EDGE = 2.0**-50
#: a lowest place is known to this part, half of the digits: beyond that a minimum is flat
LOWEST = 2.0**-31
#: values in which a bracket has to become half as wide or the lowest value a quarter, or the bracket is halved
PATIENCE = 3
#: values after which it is halved in any case
GUESSES = 50
#: the first guess is taken to be this part of the way off that it went
FIRST = 0.1
#: the smaller part of the golden section
GOLDEN = (3.0 - math.sqrt(5.0)) / 2.0


def edge(
    height: Callable[[float], float],
    near: float,
    far: float,
    at_near: float,
    at_far: float = math.nan,
    zero: float = 0.0,
) -> float:
    """Find the last place, from one end of a bracket, where a function is positive.

    A straight line through the last two values says where it ends. The function is asked a little on this side of that
    place, by as much as the last two guesses differ.

    Parameters
    ----------
    height : callable
        The function; not a number where it is not defined, which counts as not positive.
    near, far : float
        Ends of the bracket.
    at_near, at_far : float
        Values there, the first positive, the second not.
    zero : float
        A value of this size is zero, and its place is taken.

    Returns
    -------
    float
        The last place at which the function was found positive, `near` itself if there is no other; or the first one
        at which it was found zero.

    Examples
    --------
    >>> round(edge(lambda x: 2 - x**2, 0, 2, 2, -2), 12)
    1.414213562373
    >>> round(edge(lambda x: 3 - x if x < 3 else math.nan, 0, 10, 3), 12)
    3.0
    """
    smallest = EDGE * abs(far - near)
    known = [(x, y) for x, y in ((far, at_far), (near, at_near)) if math.isfinite(y)]
    before, tries, count = math.nan, 0, 0
    wide, low = abs(far - near), at_near
    while abs(far - near) > smallest:
        trial = 0.5 * (near + far)
        guess = _straight(known)
        if known[-1][0] == near and abs(guess - near) <= smallest:
            break
        if guess != before and tries < PATIENCE and count < GUESSES and min(near, far) < guess < max(near, far):
            off = abs(guess - known[-1][0]) * FIRST if math.isnan(before) else abs(guess - before)
            beside = guess - math.copysign(max(off, 0.5 * smallest), far - near)
            if min(near, far) < beside < max(near, far):
                trial = beside
            before = guess
        if trial in (near, far):
            break
        value = height(trial)
        if abs(value) <= zero:
            return trial
        if value > 0.0:
            near = trial
        else:
            far = trial
        if math.isfinite(value):
            known = [known[-1], (trial, value)]
        tries, count = tries + 1, count + 1
        if abs(far - near) <= 0.5 * wide or abs(value) <= 0.25 * low:
            wide, low, tries = abs(far - near), min(low, abs(value)), 0
    return near


def _straight(known: list[tuple[float, float]]) -> float:
    """Where the line through two points is zero; not a number where there is none."""
    if len(known) < 2 or known[0][1] == known[1][1]:
        return math.nan
    (a, at_a), (b, at_b) = known
    return a - at_a * (b - a) / (at_b - at_a)


def minimum(height: Callable[[float], float], low: float, high: float) -> float:
    """Find where a function with one minimum in a bracket is smallest.

    Brent's method (Algorithms for Minimization without Derivatives, 1973, chapter 5): a parabola through the three
    lowest values, and the golden section where its steps do not become smaller.

    Parameters
    ----------
    height : callable
        The function.
    low, high : float
        Ends of the bracket.

    Returns
    -------
    float
        The place of the smallest value found.

    Examples
    --------
    >>> round(minimum(lambda x: (x - 0.3) ** 2, 0, 1), 9)
    0.3
    """
    tolerance = LOWEST * abs(high - low)
    best = second = third = low + GOLDEN * (high - low)
    at_best = at_second = at_third = height(best)
    step = before = 0.0
    while max(high - best, best - low) > 2.0 * tolerance:
        middle = 0.5 * (low + high)
        last, before = before, step
        step = _to_vertex((best, at_best), (second, at_second), (third, at_third))
        if not (abs(step) < 0.5 * abs(last) and low < best + step < high):
            before = high - best if best < middle else low - best
            step = GOLDEN * before
        elif min(best + step - low, high - best - step) < 2.0 * tolerance:
            step = math.copysign(tolerance, middle - best)
        trial = best + math.copysign(max(abs(step), tolerance), step)
        value = height(trial)
        if value <= at_best:
            low, high = (best, high) if trial >= best else (low, best)
            third, at_third, second, at_second, best, at_best = second, at_second, best, at_best, trial, value
            continue
        low, high = (trial, high) if trial < best else (low, trial)
        if value <= at_second or second == best:
            third, at_third, second, at_second = second, at_second, trial, value
        elif value <= at_third or third in (best, second):
            third, at_third = trial, value
    return best


def _to_vertex(best: tuple[float, float], second: tuple[float, float], third: tuple[float, float]) -> float:
    """The way from the best of three points to the vertex of the parabola; infinite where there is none."""
    r = (best[0] - second[0]) * (best[1] - third[1])
    q = (best[0] - third[0]) * (best[1] - second[1])
    below = 2.0 * (q - r)
    return math.inf if below == 0.0 else -((best[0] - third[0]) * q - (best[0] - second[0]) * r) / below
