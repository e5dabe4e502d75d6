"""How far nominal configurations are from what the output ought to do.

points    p_k - q_k; without timing p - the nearest point of the polyline
line      (p - a) - t (t . (p - a)), t its direction
circle    p - the nearest point of the circle
function  q - f(drives); dwell: q - constant

A line or circle that is fitted, and the constant of a dwell, have the least largest distance: in the plane the line in
the middle of the narrowest strip, one side of which lies on an edge of the convex hull of the points; else by
sequential quadratic programming, min t with the distance of every point at most t, from the least-squares fit and, of a
circle, from the narrowest rings around some of the points.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from jointplay.basics.arrays import Flags, Floats
from jointplay.core.compile import LENGTHS, Ideal
from jointplay.errors import InputError
from jointplay.file.schema import NotAnExpression
from jointplay.model.mechanism import Mechanism

TURN = 2.0 * np.pi
#: points that are off a line by a smaller part of their spread lie on it
STRAIGHT = 1e-13
#: of the search for a circle and for a line in space
STEPS, EXACT = 200, 1e-15
#: flatter arcs are lines
FLAT = 1e-10
#: points whose rings are tried, rings from which the search for a circle goes on, and how far they are apart, in radii
SOME, RINGS, APART = 16, 2, 0.2


@dataclass(frozen=True)
class Strays:
    """Nominal less ideal."""

    #: structural error of every configuration, SI, not negative; nan where nothing is asked or nothing is known
    size: Floats
    #: of the output's pose, shape (configuration, component), nan where nothing is asked; None of a joint
    component: Floats | None
    #: what was fitted, in words and units of the file
    fitted: str = ""


def compared(m: Mechanism) -> tuple[str, str]:
    """The coordinate that a target is of, empty where it is of positions, and its kind, ``length`` or ``angle``."""
    wanted = None if m.ideal is None else m.ideal.wanted
    if wanted is None:
        return "", "length"
    if wanted.component is not None:
        name = m.components[wanted.component]
        return name, "length" if name in LENGTHS else "angle"
    assert wanted.joint is not None
    return m.joints[wanted.joint], m.coordinate_kind(wanted.joint)


def strays(m: Mechanism, drives: Floats, placed: Floats, output: Floats, whole: Flags) -> Strays | None:
    """How far all configurations of a path are from the target; None where the file has none.

    Parameters
    ----------
    drives, placed, output : ndarray
        Drive values, poses of all bodies, poses of the output, SI.
    whole : ndarray of bool
        Where the machine can stand, which alone counts in a fit.

    Raises
    ------
    InputError
        When an expression has no value somewhere, or there are other points than configurations.
    """
    ideal = m.ideal
    if ideal is None:
        return None
    if ideal.wanted is not None:
        return _of_coordinate(m, ideal, drives, placed, output, whole)
    axes = [k for k, name in enumerate(m.components) if name in LENGTHS]
    component = np.full(output.shape, np.nan)
    points = output[:, axes]
    known = whole & np.isfinite(points).all(axis=1)
    fitted = ""
    if known.any():
        off, fitted = _off_curve(m, ideal, points, known)
        # Positions come first in a pose.
        component[known, : len(axes)] = off
    return Strays(np.linalg.norm(component[:, axes], axis=1), component, fitted)


def _off_curve(m: Mechanism, ideal: Ideal, every: Floats, known: Flags) -> tuple[Floats, str]:
    points = every[known]
    unit = m.units.length
    match ideal.kind:
        case "points" if ideal.timed:
            if len(ideal.points) != len(every):
                problem = f"there are {len(ideal.points)} points and {len(every)} configurations"
                raise InputError(problem, file=m.file, key="target.points")
            return points - ideal.points[known], ""
        case "points":
            return _off_polyline(points, ideal.points), ""
        case "line":
            through, direction = (
                best_line(points) if ideal.fit else (ideal.points[0], ideal.points[1] - ideal.points[0])
            )
            direction = direction / np.linalg.norm(direction)
            away = points - through
            words = f"line through {_shown(through / unit)} along {_shown(direction)}" if ideal.fit else ""
            return away - np.outer(away @ direction, direction), words
        case _:
            centre, radius = best_circle(points) if ideal.fit else (ideal.points[0], ideal.radius)
            away = points - centre
            axis = np.array(ideal.axis) / np.linalg.norm(ideal.axis) if ideal.axis else np.zeros(points.shape[1])
            flat = away - np.outer(away @ axis, axis)
            size = np.linalg.norm(flat, axis=1)
            # From the centre every direction is as near.
            ray = np.where(size[:, None] > 0.0, flat / np.where(size > 0.0, size, 1.0)[:, None], np.eye(len(axis))[0])
            words = f"circle about {_shown(centre / unit)} with radius {radius / unit:.6g}" if ideal.fit else ""
            return away - radius * ray, words


def _shown(vector: Floats) -> str:
    return f"[{', '.join(f'{value:.6g}' for value in vector)}]"


def _off_polyline(points: Floats, corners: Floats) -> Floats:
    """From the nearest point of a polyline."""
    best, off = np.full(len(points), np.inf), np.zeros_like(points)
    for start, end in pairwise(corners):
        along = end - start
        size = float(along @ along)
        part = np.clip((points - start) @ along / size, 0.0, 1.0) if size else np.zeros(len(points))
        away = points - start - part[:, None] * along
        nearer = (far := np.linalg.norm(away, axis=1)) < best
        best[nearer], off[nearer] = far[nearer], away[nearer]
    return off


def _of_coordinate(m: Mechanism, ideal: Ideal, drives: Floats, placed: Floats, output: Floats, whole: Flags) -> Strays:
    wanted = ideal.wanted
    assert wanted is not None
    if wanted.component is not None:
        value = output[:, wanted.component]
    else:
        assert wanted.joint is not None
        value = m.coordinate(wanted.joint, placed)
    turns = compared(m)[1] == "angle"
    known = whole & np.isfinite(value)
    off = np.full(len(value), np.nan)
    fitted = ""
    if ideal.kind == "function":
        off[known] = value[known] - _expected(m, ideal, drives[known])
        if turns:
            off -= TURN * np.round(off / TURN)
    else:
        if wanted.span is not None and wanted.drive is not None:
            low, high = wanted.span
            slack = 1e-9 * (high - low)
            known &= (drives[:, wanted.drive] >= low - slack) & (drives[:, wanted.drive] <= high + slack)
        if known.any():
            here = np.unwrap(value[known]) if turns else value[known]
            constant = wanted.value
            if constant is None:
                constant = 0.5 * float(here.min() + here.max())
                fitted = f"{constant / wanted.factor:.6g}"
            rest = here - constant
            off[known] = rest - TURN * np.round(rest[0] / TURN) if turns else rest
    if wanted.component is None:
        return Strays(np.abs(off), None, fitted)
    component = np.full(output.shape, np.nan)
    component[:, wanted.component] = off
    return Strays(np.abs(off), component, fitted)


def _expected(m: Mechanism, ideal: Ideal, drives: Floats) -> Floats:
    """What a function asks for, SI; nan beyond the ends of a table."""
    wanted = ideal.wanted
    assert wanted is not None
    if wanted.expression is not None:
        try:
            return ideal.expected(m.drives, drives / m.drive_factors)
        except NotAnExpression as problem:
            raise InputError(str(problem), file=m.file, key="target.function.value") from None
    from scipy.interpolate import CubicSpline

    assert wanted.drive is not None
    where = drives[:, wanted.drive]
    slack = 1e-9 * (wanted.at[-1] - wanted.at[0])
    inside = (where >= wanted.at[0] - slack) & (where <= wanted.at[-1] + slack)
    spline = CubicSpline(wanted.at, wanted.values, bc_type="natural")
    return np.where(inside, spline(np.clip(where, wanted.at[0], wanted.at[-1])), np.nan)


def best_line(points: Floats) -> tuple[Floats, Floats]:
    """A point and the direction of the line with the least largest distance from points.

    Examples
    --------
    >>> through, direction = best_line(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]]))
    >>> through[1].item(), abs(direction).round(12).tolist()
    (0.5, [1.0, 0.0])
    """
    middle = points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(points - middle, full_matrices=True)
    if len(points) <= 2 or sizes[1] <= STRAIGHT * sizes[0]:
        return middle, axes[0]
    if points.shape[1] == 2:
        return _middle_of_strip(points)

    # Shifts and slopes across the fit by least squares, in parts of the largest distance of a point.
    scale = float(np.abs(points - middle).max())

    def line(x: Floats) -> tuple[Floats, Floats]:
        along = axes[0] + x[2:] @ axes[1:]
        return middle + scale * x[:2] @ axes[1:], along / np.linalg.norm(along)

    def off(x: Floats) -> Floats:
        through, along = line(x)
        away = (points - through) / scale
        return away - np.outer(away @ along, along)

    return line(_least_largest(off, np.zeros(4)))


def _middle_of_strip(points: Floats) -> tuple[Floats, Floats]:
    """The line in the middle of the narrowest strip that has all points in it, in the plane."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners = points[ConvexHull(points).vertices]
    except QhullError:
        middle = points.mean(axis=0)
        return middle, np.linalg.svd(points - middle)[2][0]
    edges = np.roll(corners, -1, axis=0) - corners
    edges /= np.linalg.norm(edges, axis=1)[:, None]
    normals = np.column_stack([-edges[:, 1], edges[:, 0]])
    away = normals @ corners.T - np.sum(normals * corners, axis=1)[:, None]
    best = int((away.max(axis=1) - away.min(axis=1)).argmin())
    return corners[best] + 0.5 * (away[best].max() + away[best].min()) * normals[best], edges[best]


def best_circle(points: Floats) -> tuple[Floats, float]:
    """Centre and radius of the circle with the least largest distance from points in the plane.

    Raises
    ------
    InputError
        When the points lie on a line, to which no circle is nearest.
    """
    middle = points.mean(axis=0)
    scale = float(np.abs(points - middle).max()) or 1.0
    local = (points - middle) / scale
    solution, _, rank, _ = np.linalg.lstsq(
        np.column_stack([2.0 * local, np.ones(len(local))]), np.sum(local**2, axis=1), rcond=FLAT
    )
    if rank < 3:
        raise InputError("the output moves on a straight line, to which no circle is nearest", key="target.circle")
    start = np.array([*solution[:2], np.sqrt(solution[2] + solution[:2] @ solution[:2])])

    def off(x: Floats) -> Floats:
        return np.asarray(np.linalg.norm(local - x[:2], axis=1) - x[2])

    def largest(x: Floats) -> float:
        return float(np.abs(off(x)).max())

    found = start
    if largest(start) > STRAIGHT:
        # Several circles may each be narrower than their neighbours.
        found = min((_least_largest(off, one) for one in (start, *_rings(local))), key=largest)
    return middle + scale * found[:2], scale * float(found[2])


def _rings(points: Floats) -> Floats:
    """Centres and radii in the middle of the narrowest rings around some of the points.

    A ring narrower than its neighbours has two points on each side (Rivlin 1979): its centre is as far from both
    points of two pairs. All pairs are tried.
    """
    some = points[np.unique(np.linspace(0, len(points) - 1, SOME).round().astype(int))]
    pairs = np.array([*combinations(range(len(some)), 2)])
    across = 2.0 * (some[pairs[:, 1]] - some[pairs[:, 0]])
    right = np.sum(some[pairs[:, 1]] ** 2 - some[pairs[:, 0]] ** 2, axis=1)
    a, b = np.array([*combinations(range(len(pairs)), 2)]).T
    turned = across[a, 0] * across[b, 1] - across[a, 1] * across[b, 0]
    meet = np.abs(turned) > FLAT
    a, b, turned = a[meet], b[meet], turned[meet]
    x = (right[a] * across[b, 1] - right[b] * across[a, 1]) / turned
    y = (across[a, 0] * right[b] - across[b, 0] * right[a]) / turned
    away = np.hypot(some[:, 0] - x[:, None], some[:, 1] - y[:, None])
    low, high = away.min(axis=1), away.max(axis=1)
    circles = np.column_stack([x, y, 0.5 * (low + high)])[np.argsort(high - low)]
    found: list[Floats] = []
    for one in circles:
        # Rings of the same valley lead to the same one.
        if all(np.linalg.norm(one - other) > APART * other[2] for other in found):
            found.append(one)
        if len(found) == RINGS:
            break
    return np.array(found).reshape(-1, 3)


def _least_largest(off: Callable[[Floats], Floats], start: Floats) -> Floats:
    """Where the largest size of some rows is least, from a start nearby.

    Parameters
    ----------
    off : callable
        Signed distances, or vectors in rows.
    """
    from scipy.optimize import approx_fprime, minimize

    def rows(x: Floats) -> Floats:
        found = off(x)
        return found[:, None] if found.ndim == 1 else found

    def largest(x: Floats) -> float:
        return float(np.linalg.norm(rows(x), axis=1).max())

    first = largest(start)
    slopes = approx_fprime(start, lambda x: rows(x).ravel(), np.sqrt(np.finfo(float).eps) * np.abs(start).clip(1.0))
    # Coordinates that move the rows equally far, in parts of the largest distance.
    across = first * np.linalg.pinv(np.linalg.qr(slopes)[1]) * np.sqrt(len(rows(start)))

    def spare(z: Floats) -> Floats:
        here = rows(start + across @ z[:-1]) / first
        if here.shape[1] == 1:
            return np.concatenate([z[-1] - here[:, 0], z[-1] + here[:, 0]])
        return np.asarray(z[-1] ** 2 - np.sum(here**2, axis=1))

    gradient = np.append(np.zeros(len(start)), 1.0)
    found = minimize(
        lambda z: z[-1],
        gradient,
        jac=lambda _: gradient,
        constraints=[{"type": "ineq", "fun": spare}],
        method="SLSQP",
        options={"maxiter": STEPS, "ftol": EXACT},
    )
    better = start + across @ found.x[:-1]
    return better if largest(better) < first else start
