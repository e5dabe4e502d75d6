"""General Newton solvers of the same closure: Numba, JAX, scipy. Dense, as one writes them in an afternoon."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from revolute import LAST, STEPS, Revolute
from scatter import BINS, Problem

Array = NDArray[np.float64]


class InNumba:
    """One sample at a time, compiled: draw, Newton with an elimination written out, count."""

    def __init__(self, model: Revolute, p: Problem) -> None:
        import numba

        jit = numba.njit(cache=False, fastmath=True)
        eliminate, draw = jit(_eliminate), jit(_draw)
        newton = jit(_make_newton(eliminate))
        self._solve = jit(_make_solve(newton))
        self._monte_carlo = jit(_make_monte_carlo(draw, newton))
        self._model = (
            model.body, model.at, model.first, model.second, model.driven, model.moved, model.direction,
            model.output, model.nominal, model.drives, model.nominal_output,
        )  # fmt: skip
        self._sets = (np.array([kind == "disc" for kind, _ in p.sets]), np.array([size for _, size in p.sets]))
        self._edges = p.edges

    def solve(self, offsets: Array) -> Array:
        """Errors of given offsets."""
        found: Array = self._solve(self._model, offsets)
        return found

    def monte_carlo(self, samples: int) -> dict[str, Array]:
        """Draw, solve and count."""
        found = self._monte_carlo(self._model, self._sets, self._edges, samples)
        return dict(zip(("sum", "product", "largest", "bins"), found, strict=True))


def _eliminate(a: Array, b: Array) -> None:
    """Solve a x = b in place, pivots chosen by column."""
    n = len(b)
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if best != k:
            for j in range(k, n):
                a[k, j], a[best, j] = a[best, j], a[k, j]
            b[k], b[best] = b[best], b[k]
        inverse = 1.0 / a[k, k]
        for i in range(k + 1, n):
            if a[i, k] != 0.0:
                factor = a[i, k] * inverse
                for j in range(k + 1, n):
                    a[i, j] -= factor * a[k, j]
                b[i] -= factor * b[k]
    for k in range(n - 1, -1, -1):
        total = b[k]
        for j in range(k + 1, n):
            total -= a[k, j] * b[j]
        b[k] = total / a[k, k]


def _make_newton(eliminate: Any) -> Any:
    def newton(model: Any, u: Array, at: Array, poses: Array, a: Array, b: Array, error: Array) -> None:
        body, place, first, second, driven, moved, direction, output, nominal, drives, reference = model
        joints = len(first)
        at[:] = place
        for k in range(len(moved)):
            at[moved[k], 0] += u[2 * joints + k] * direction[k, 0]
            at[moved[k], 1] += u[2 * joints + k] * direction[k, 1]
        poses[:] = nominal
        for _ in range(STEPS):
            a[:] = 0.0
            for k in range(joints):
                b[2 * k], b[2 * k + 1] = -u[2 * k], -u[2 * k + 1]
                for side in range(2):
                    point = second[k] if side == 1 else first[k]
                    sign = 1.0 if side == 1 else -1.0
                    on = body[point]
                    x, y = at[point, 0], at[point, 1]
                    if on >= 0:
                        c, s = math.cos(poses[on, 2]), math.sin(poses[on, 2])
                        rx, ry = c * x - s * y, s * x + c * y
                        a[2 * k, 3 * on], a[2 * k + 1, 3 * on + 1] = sign, sign
                        a[2 * k, 3 * on + 2], a[2 * k + 1, 3 * on + 2] = -sign * ry, sign * rx
                        x, y = poses[on, 0] + rx, poses[on, 1] + ry
                    b[2 * k] += sign * x
                    b[2 * k + 1] += sign * y
            for d in range(len(driven)):
                row = 2 * joints + d
                one, two = body[first[driven[d]]], body[second[driven[d]]]
                b[row] = poses[two, 2] - drives[d]
                a[row, 3 * two + 2] = 1.0
                if one >= 0:
                    b[row] -= poses[one, 2]
                    a[row, 3 * one + 2] = -1.0
            eliminate(a, b)
            size = 0.0
            for i in range(len(b)):
                poses[i // 3, i % 3] -= b[i]
                size = max(size, abs(b[i]))
            if size < LAST:
                break
        on = body[output]
        c, s = math.cos(poses[on, 2]), math.sin(poses[on, 2])
        error[0] = poses[on, 0] + c * at[output, 0] - s * at[output, 1] - reference[0]
        error[1] = poses[on, 1] + s * at[output, 0] + c * at[output, 1] - reference[1]
        error[2] = poses[on, 2] - reference[2]

    return newton


def _make_solve(newton: Any) -> Any:
    def solve(model: Any, offsets: Array) -> Array:
        size = 3 * len(model[8])
        at, poses, a, b = model[1].copy(), model[8].copy(), np.zeros((size, size)), np.zeros(size)
        errors = np.empty((len(offsets), 3))
        for i in range(len(offsets)):
            newton(model, offsets[i], at, poses, a, b, errors[i])
        return errors

    return solve


def _draw(sets: Any, u: Array) -> None:
    discs, sizes = sets
    k = 0
    for i in range(len(sizes)):
        if discs[i]:
            radius, angle = sizes[i] * math.sqrt(np.random.random()), 2 * math.pi * np.random.random()  # noqa: NPY002
            u[k], u[k + 1] = radius * math.cos(angle), radius * math.sin(angle)
            k += 2
        else:
            value = np.random.normal()  # noqa: NPY002
            while abs(value) > 3:
                value = np.random.normal()  # noqa: NPY002
            u[k] = value * sizes[i] / 3
            k += 1


def _make_monte_carlo(draw: Any, newton: Any) -> Any:
    def monte_carlo(model: Any, sets: Any, edges: Array, samples: int) -> Any:
        size = 3 * len(model[8])
        at, poses, a, b = model[1].copy(), model[8].copy(), np.zeros((size, size)), np.zeros(size)
        u, error = np.zeros(2 * len(sets[1])), np.zeros(5)
        total, product, largest = np.zeros(3), np.zeros((3, 3)), np.zeros(5)
        bins = np.zeros((5, BINS), dtype=np.int64)
        for _ in range(samples):
            draw(sets, u)
            newton(model, u, at, poses, a, b, error)
            error[3] = math.sqrt(error[0] * error[0] + error[1] * error[1])
            error[4] = abs(error[2])
            for i in range(3):
                total[i] += error[i]
                for j in range(3):
                    product[i, j] += error[i] * error[j]
            for k in range(5):
                place = (error[k] - edges[k, 0]) / (edges[k, 1] - edges[k, 0]) * BINS
                bins[k, min(max(int(place), 0), BINS - 1)] += 1
                largest[k] = max(largest[k], abs(error[k]))
        return total, product, largest, bins

    return monte_carlo


def in_jax(model: Revolute, batch: int) -> Callable[[Array], Array]:
    """`vmap` of Newton's method with `jnp.linalg.solve`, compiled for batches of one size."""
    import jax
    import jax.numpy as jnp

    moved, direction, joints = model.moved, jnp.array(model.direction), model.joints

    def place(poses: Any, at: Any, point: int) -> Any:
        body = int(model.body[point])
        if body < 0:
            return at[point]
        x, y, t = poses[3 * body], poses[3 * body + 1], poses[3 * body + 2]
        c, s = jnp.cos(t), jnp.sin(t)
        return jnp.array([x + c * at[point, 0] - s * at[point, 1], y + s * at[point, 0] + c * at[point, 1]])

    def angle(poses: Any, point: int) -> Any:
        body = int(model.body[point])
        return poses[3 * body + 2] if body >= 0 else 0.0

    def residual(poses: Any, at: Any, u: Any) -> Any:
        pairs = list(zip(model.first, model.second, strict=True))
        rows = [place(poses, at, b) - place(poses, at, a) - u[2 * k : 2 * k + 2] for k, (a, b) in enumerate(pairs)]
        angles = [angle(poses, pairs[k][1]) - angle(poses, pairs[k][0]) for k in model.driven]
        return jnp.concatenate([*rows, jnp.array(angles) - model.drives])

    def solve(u: Any) -> Any:
        at = jnp.array(model.at).at[moved].add(u[2 * joints : 2 * joints + len(moved), None] * direction)
        poses = jnp.array(model.nominal).ravel()
        for _ in range(4):  # quadratic: enough for every sample here
            poses = poses - jnp.linalg.solve(jax.jacfwd(residual)(poses, at, u), residual(poses, at, u))
        return jnp.append(place(poses, at, model.output), angle(poses, model.output)) - model.nominal_output

    run = jax.jit(jax.vmap(solve))

    def errors(u: Array) -> Array:
        whole = [np.resize(u[k : k + batch], (batch, u.shape[1])) for k in range(0, len(u), batch)]
        return np.concatenate([np.asarray(run(part)) for part in whole])[: len(u)]

    return errors


def in_scipy(model: Revolute) -> Callable[[Array], Array]:
    """`scipy.optimize.root` for every sample, started at the nominal pose, with the exact Jacobian."""
    from scipy.optimize import root

    def errors(u: Array) -> Array:
        out = np.empty((len(u), 3))
        for i in range(len(u)):
            row = u[i : i + 1]
            at = model.points(row)

            def system(x: Array, at: Array = at, row: Array = row) -> tuple[Array, Array]:
                residual, jacobian = model.system(x.reshape(1, -1, 3), at, row)
                return residual[0], jacobian[0]

            found = root(system, model.nominal.ravel(), jac=True, tol=1e-12)
            out[i] = model.error(found.x.reshape(1, -1, 3), at)[0]
        return out

    return errors
