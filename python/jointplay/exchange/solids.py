"""Volume, centre and moments of inertia of a shape, from its faces.

With the divergence theorem every integral over the volume is one of the flux of a field F through the faces, S(u, v):

    flux = integral over the face of F(S) . (S_u x S_v) du dv

and with Green's theorem that is an integral around the edges, whose curves u(t), v(t) the format has for every face:

    flux = integral of G(u, v) dv,   G(u, v) = integral of F(S) . (S_u x S_v) from u0 to u

Both are done by Gauss-Legendre points, which are exact to rounding for lines and circles on planes, cylinders, cones,
spheres and tori. Three fields have the volume as their flux: x along x, y along y, z along z. Where the faces do not
close, or one is read wrongly, they differ; so do the areas that they see from both sides, which cancel.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .brep import Met, PartShape, Plotted, Trace, Unreadable
from .fcstd import MM
from .skeleton import Matrix, Vector

#: points of an integral: of a whole circle, whose functions have five waves at most; of a piece of a spline
ROUND, PIECE = 48, 16
#: smooth pieces of the edges of a shape; each takes about a millisecond
MOST_PIECES = 20_000
#: by how much the three volumes may differ, as a part of them; edges of kernels are that exact
CLOSED = 1e-5
#: mm from where to where an edge has to move along v to count
STILL = 1e-12
#: a curve in the parameters of a surface: points and tangents at values of its own parameter
Plane2 = Callable[[Vector], tuple[Matrix, Matrix]]


@dataclass(frozen=True)
class SolidPart:
    """What a body has of its shape: lengths in m, in its own axes."""

    volume: float
    centre: Vector
    #: moments of inertia about the centre for a density of 1 kg/m^3: m^5
    inertia: Matrix


def solid(shape: PartShape) -> SolidPart:
    """The volume of a shape with its centre and moments of inertia.

    Raises
    ------
    Unreadable
        When a face or an edge is of another kind than those above, or the faces do not close.
    """
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            return _solid(shape)
    except (ValueError, OverflowError, IndexError, KeyError, FloatingPointError) as error:
        raise Unreadable(str(error)) from None


def _solid(shape: PartShape) -> SolidPart:
    start = shape.somewhere()
    flux, pieces = np.zeros((5, 3)), 0
    for face in shape.faces():
        own = np.zeros((5, 3))
        sign = -1.0 if face.is_reversed else 1.0
        patch = Patch(shape, face, start)
        for trace in shape.boundary(face):
            curve = curve_of(patch, trace)
            pieces += len(curve[1])
            if pieces > MOST_PIECES:
                raise Unreadable(f"its edges have more than {MOST_PIECES} pieces")
            own += -patch.along(*curve) if trace.is_reversed else patch.along(*curve)
        flux += sign * own
    area, volumes, first, second, products = flux
    volume = float(volumes.mean())
    if not (volume > 0.0 and np.abs(volumes - volume).max() <= CLOSED * volume):
        raise Unreadable("its faces do not close")
    if np.abs(area).max() > CLOSED * volume ** (2 / 3):
        raise Unreadable("its faces do not close")
    centre = first / volume
    xy, yz, zx = products
    moments = np.array([[0.0, xy, zx], [xy, 0.0, yz], [zx, yz, 0.0]]) + np.diag(second)
    about = moments - volume * np.outer(centre, centre)
    inertia = np.trace(about) * np.eye(3) - about
    return SolidPart(volume * MM**3, (centre + start) * MM, inertia * MM**5)


class Patch:
    """The surface of a face, mm."""

    def __init__(self, shape: PartShape, face: Met, start: Vector) -> None:
        self.kind, numbers, self.matrix = shape.surface_of(face)
        if self.kind not in ("plane", "cylinder", "cone", "sphere", "torus"):
            raise Unreadable("a face is of a kind that has no volume here")
        self.start = start
        self.at, self.axis, self.x, self.y = np.reshape(numbers[:12], (4, 3))
        self.sizes = numbers[12:]
        self.first: float | None = None

    def along(self, curve: Plane2, pieces: list[tuple[float, float]], count: int) -> Matrix:
        """What an edge adds to the fluxes: area, volume, first, second moments and products, by axis."""
        found = np.zeros((5, 3))
        nodes, weights = np.polynomial.legendre.leggauss(count)
        for low, high in pieces:
            half = (high - low) / 2
            points, tangents = curve(low + half * (nodes + 1.0))
            if self.first is None:
                self.first = float(points[0, 0])
            if np.abs(tangents[:, 1]).max() > STILL:
                inner = self._inner(points)
                found += np.einsum("n,nij->ij", half * weights * tangents[:, 1], inner)
        return found

    def places(self, u: Matrix, v: Matrix) -> Matrix:
        """Points at parameters, in the axes of the part."""
        return np.asarray(self._surface(u[..., None], v[..., None])[0] @ self.matrix[:3, :3].T + self.matrix[:3, 3])

    def _inner(self, points: Matrix) -> Matrix:
        """G at points of an edge, shape (point, field, axis)."""
        assert self.first is not None
        nodes, weights = np.polynomial.legendre.leggauss(ROUND)
        half = (points[:, 0] - self.first) / 2
        u = self.first + half[:, None] * (nodes + 1.0)
        v = np.broadcast_to(points[:, 1:], u.shape)
        return np.asarray(np.einsum("p,n,pnij->pij", half, weights, self._fields(u, v)))

    def _fields(self, u: Matrix, v: Matrix) -> Matrix:
        place, along_u, along_v = self._surface(u[..., None], v[..., None])
        turn = self.matrix[:3, :3].T
        p = place @ turn + self.matrix[:3, 3] - self.start
        n = np.cross(along_u @ turn, along_v @ turn)
        following = np.roll(p, -1, axis=-1)
        return np.stack([n, p * n, p**2 / 2 * n, p**3 / 3 * n, p**2 / 2 * following * n], axis=-2)

    def _surface(self, u: Matrix, v: Matrix) -> tuple[Matrix, Matrix, Matrix]:
        """Points and both tangents."""
        if self.kind == "plane":
            zero = np.zeros(np.broadcast_shapes(u.shape, v.shape))
            return self.at + u * self.x + v * self.y, self.x + zero, self.y + zero
        out, around = np.cos(u) * self.x + np.sin(u) * self.y, np.cos(u) * self.y - np.sin(u) * self.x
        if self.kind in ("cylinder", "cone"):
            slope = self.sizes[1] if self.kind == "cone" else 0.0
            radius, along = self.sizes[0] + v * math.sin(slope), math.sin(slope) * out + math.cos(slope) * self.axis
            return self.at + radius * out + v * math.cos(slope) * self.axis, radius * around, along
        ring, tube = (0.0, self.sizes[0]) if self.kind == "sphere" else self.sizes[:2]
        radius = ring + tube * np.cos(v)
        along = tube * (np.cos(v) * self.axis - np.sin(v) * out)
        return self.at + radius * out + tube * np.sin(v) * self.axis, radius * around, along


def curve_of(patch: Patch, trace: Trace) -> tuple[Plane2, list[tuple[float, float]], int]:
    """The curve of an edge on a surface, the pieces on which it is smooth, and how many points each needs."""
    low, high = trace.ends
    if trace.curve is None:
        if patch.kind != "plane" or trace.drawn is None:
            raise Unreadable("an edge has no curve on its face")
        flat = np.array([patch.x, patch.y])
        back = np.linalg.inv(patch.matrix) @ trace.matrix

        def seen(point: Vector, is_place: bool) -> Vector:
            moved = back[:3, :3] @ point + (back[:3, 3] - patch.at if is_place else 0.0)
            return np.asarray(flat @ moved)

        centre, *ways = np.reshape(trace.drawn[1][: 3 * (len(trace.drawn[1]) // 3)], (-1, 3))
        if trace.drawn[0] == "line":
            return _line(seen(centre, True), seen(ways[0], False)), [(low, high)], PIECE
        if trace.drawn[0] not in ("circle", "ellipse"):
            raise Unreadable("an edge has no curve on its face")
        _, x, y = (seen(way, False) for way in ways)
        return _oval(seen(centre, True), trace.drawn[1][12] * x, trace.drawn[1][-1] * y), _arcs(low, high), ROUND
    kind, numbers = trace.curve
    if kind == 1:
        return _line(np.array(numbers[:2]), np.array(numbers[2:4])), [(low, high)], PIECE
    if kind in (2, 3):
        centre, x, y = np.reshape(numbers[:6], (3, 2))
        return _oval(centre, numbers[6] * x, numbers[-1] * y), _arcs(low, high), ROUND
    if kind == 7:
        return _spline(numbers, low, high)
    raise Unreadable("an edge is of a kind that has no volume here")


def _line(at: Vector, along: Vector) -> Plane2:
    return lambda t: (at + np.multiply.outer(t, along), np.broadcast_to(along, (len(t), 2)))


def _oval(centre: Vector, x: Vector, y: Vector) -> Plane2:
    def found(t: Vector) -> tuple[Matrix, Matrix]:
        c, s = np.cos(t)[:, None], np.sin(t)[:, None]
        return centre + c * x + s * y, c * y - s * x

    return found


def _arcs(low: float, high: float) -> list[tuple[float, float]]:
    """Pieces of no more than a whole turn."""
    if not abs(high - low) <= 2 * math.tau:
        raise Unreadable("an arc is longer than two turns")
    return [(low, high)]


def _spline(numbers: tuple[float, ...], low: float, high: float) -> tuple[Plane2, list[tuple[float, float]], int]:
    """A spline, also a rational one; its pieces lie between its knots."""
    from scipy.interpolate import BSpline

    plotted = Plotted.of(numbers)
    knots = np.array(plotted.knots)
    every = np.repeat(knots, plotted.counts)
    if len(every) != len(plotted.poles) + plotted.degree + 1 or not (np.diff(knots) > 0.0).all():
        raise Unreadable("the knots of a spline do not fit its poles")
    weights = plotted.weights[:, None]
    whole = BSpline(every, np.hstack([plotted.poles * weights, weights]), plotted.degree)
    slope = whole.derivative()

    def found(t: Vector) -> tuple[Matrix, Matrix]:
        point, rate = whole(t), slope(t)
        place = point[:, :2] / point[:, 2:]
        return place, (rate[:, :2] - place * rate[:, 2:]) / point[:, 2:]

    inside = [float(knot) for knot in knots if low < knot < high]
    ends = [low, *inside, high]
    return found, list(pairwise(ends)), PIECE
