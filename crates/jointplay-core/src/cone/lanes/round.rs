//! The cone of second order: scaling, steps and targets of unit discs and balls.

use crate::cone::lanes::vector::{V, dot_few};

/// Keeps a quotient finite; everything here is near one.
const TINY: V = V::splat(1e-200);

/// So many of the first numbers, without a question at each of them whether it is there.
#[inline(always)]
fn first<const N: usize>(x: &[V]) -> &[V; N] {
    x.first_chunk().expect("arrays are as long as the layout says")
}

#[inline(always)]
fn first_mut<const N: usize>(x: &mut [V]) -> &mut [V; N] {
    x.first_chunk_mut().expect("arrays are as long as the layout says")
}

/// The inverse root of `x0^2 - |x1|^2`, the root, and what [`limit_round`] needs.
#[inline(always)]
fn hyperbolic<const K: usize, const N: usize>(x: &[V; N], per: &mut [V]) -> (V, V) {
    let per = first_mut::<2>(per);
    let square = x[0].times_plus(x[0], -dot_few(&x[1..=K], &x[1..=K]));
    let size = square.max(TINY).sqrt();
    per[0] = V::ONE / size;
    per[1] = V::ONE / per[0].times_plus(x[0], V::ONE);
    (per[0], size)
}

/// Data: w, 1/eta^2, eta^2, 1/(2 w0^2 - 1), eta, 1/eta, 1/(1 + w0), `1/(x0^2 - |x1|^2)` of `x = W l`,
/// and the upper triangle of `H^-1`.
#[inline(always)]
pub(super) fn scale_round<const K: usize, const N: usize>(
    [s, l]: [&[V]; 2],
    [for_s, for_l]: [&mut [V]; 2],
    data: &mut [V],
) {
    let (s, l) = (first::<N>(s), first::<N>(l));
    let data = &mut data[..K + 8 + K * (K + 1) / 2];
    let ((inv_s, size_s), (inv_l, size_l)) = (hyperbolic::<K, N>(s, for_s), hyperbolic::<K, N>(l, for_l));
    let along = dot_few(&s[..=K], &l[..=K]) * (inv_s * inv_l);
    let half = V::splat(0.5);
    let per_twice = half / half.times_plus(along, half).sqrt();
    let (part_s, part_l) = (per_twice * inv_s, per_twice * inv_l);
    let mut square = V::ZERO;
    for k in 1..=K {
        data[k] = s[k].times_plus(part_s, -(l[k] * part_l));
        square = data[k].times_plus(data[k], square);
    }
    // On the hyperboloid, whatever rounding did.
    data[0] = (V::ONE + square).sqrt();
    data[K + 1] = size_l * inv_s;
    data[K + 2] = size_s * inv_l;
    data[K + 3] = V::ONE / (V::ONE + square + square);
    data[K + 4] = data[K + 2].sqrt();
    data[K + 5] = data[K + 4] * data[K + 1];
    data[K + 6] = V::ONE / (V::ONE + data[0]);
    data[K + 7] = inv_s * inv_l;
    let shrink = V::splat(2.0) * data[K + 2] * data[K + 3];
    let mut at = K + 8;
    for i in 1..=K {
        data[at] = (shrink * data[i]).times_from(data[i], data[K + 2]);
        at += 1;
        for j in i + 1..=K {
            data[at] = -(shrink * data[i] * data[j]);
            at += 1;
        }
    }
}

/// `H^-1 = eta^2 (1 - 2 w1 w1' / (1 + 2 |w1|^2))`, the upper triangle row by row; six numbers, or three of a disc.
#[inline(always)]
pub(super) fn inverse_matrix<const K: usize>(data: &[V]) -> [V; 6] {
    let mut matrix = [V::ZERO; 6];
    let count = K * (K + 1) / 2;
    matrix[..count].copy_from_slice(&data[K + 8..K + 8 + count]);
    matrix
}

/// That matrix times x.
#[inline(always)]
pub(super) fn inverse_round<const K: usize>(m: &[V; 6], x: &[V], out: &mut [V]) {
    if K == 2 {
        out[0] = m[0].times_plus(x[0], m[1] * x[1]);
        out[1] = m[1].times_plus(x[0], m[2] * x[1]);
    } else {
        out[0] = m[0].times_plus(x[0], m[1].times_plus(x[1], m[2] * x[2]));
        out[1] = m[1].times_plus(x[0], m[3].times_plus(x[1], m[4] * x[2]));
        out[2] = m[2].times_plus(x[0], m[4].times_plus(x[1], m[5] * x[2]));
    }
}

/// That matrix from the right, on rows of n coordinates, of which the body's begin at `from`.
#[inline(always)]
pub(super) fn round_rows<const K: usize>(data: &[V], n: usize, from: usize, e: &[V], g: &mut [V]) {
    let matrix = inverse_matrix::<K>(data);
    for (e, g) in e.chunks_exact(n).zip(g.chunks_exact_mut(n)) {
        inverse_round::<K>(&matrix, &e[from..from + K], &mut g[from..from + K]);
    }
}

/// `2 w0 w1 / (2 w0^2 - 1)`: where the coordinates go with the first slack.
#[inline(always)]
pub(super) fn towards(size: usize, data: &[V], out: &mut [V]) {
    let along = (data[0] + data[0]) * data[size + 3];
    for k in 0..size {
        out[k] = along * data[1 + k];
    }
}

#[inline(always)]
pub(super) fn target_round<const K: usize, const N: usize>(
    data: &[V],
    s: &[V],
    l: &[V],
    ds: &[V],
    centre: V,
    u: &mut [V],
) {
    let data = &data[..K + 8];
    let (s, l, ds, u) = (first::<N>(s), first::<N>(l), first::<N>(ds), first_mut::<N>(u));
    let (eta, per_eta, per_one) = (data[K + 4], data[K + 5], data[K + 6]);
    // W l and W^-1 ds.
    let mut scaled = [V::ZERO; 4];
    let mut step = [V::ZERO; 4];
    let (along_l, along_s) = (dot_few(&data[1..=K], &l[1..=K]), dot_few(&data[1..=K], &ds[1..=K]));
    scaled[0] = eta * data[0].times_plus(l[0], along_l);
    step[0] = per_eta * data[0].times_plus(ds[0], -along_s);
    let (part_l, part_s) = (along_l.times_plus(per_one, l[0]), along_s.times_plus(per_one, -ds[0]));
    for k in 1..=K {
        scaled[k] = eta * data[k].times_plus(part_l, l[k]);
        step[k] = per_eta * data[k].times_plus(part_s, ds[k]);
    }
    // sigma mu e + (W^-1 ds) o (W l + W^-1 ds), since W dl = -W l - W^-1 ds.
    let mut other = [V::ZERO; 4];
    for k in 0..=K {
        other[k] = scaled[k] + step[k];
    }
    let mut right = [V::ZERO; 4];
    right[0] = centre + dot_few(&step[..=K], &other[..=K]);
    for k in 1..=K {
        right[k] = step[0].times_plus(other[k], other[0] * step[k]);
    }
    // Divided by W l.
    let along = dot_few(&scaled[1..=K], &right[1..=K]);
    let first = scaled[0].times_plus(right[0], -along) * data[K + 7];
    let per = V::ONE / scaled[0];
    let mut quotient = [V::ZERO; 4];
    quotient[0] = first;
    for k in 1..=K {
        quotient[k] = per * first.times_from(scaled[k], right[k]);
    }
    // W of it, less s.
    let along = dot_few(&data[1..=K], &quotient[1..=K]);
    u[0] = eta.times_plus(data[0].times_plus(first, along), -s[0]);
    let part = along.times_plus(per_one, first);
    for k in 1..=K {
        u[k] = eta.times_plus(data[k].times_plus(part, quotient[k]), -s[k]);
    }
}

/// Steps and the inverse of the longest one, see [`super::cones::Cone::step`].
///
/// The multipliers' step `W^-2 (u - ds)` has to fulfil `G' dl = force`, and this equation gives it directly:
/// `W^-2 ds` would be the difference of large numbers near the boundary, whose rounding would be left in the equation.
#[inline(always)]
pub(super) fn step_round<const K: usize, const N: usize>(
    radius: V,
    data: &[V],
    [target, force, approach, follow]: [&[V]; 4],
    factor: V,
    [s, inv_s, l, inv_l]: [&[V]; 4],
    [dp, ds, dl]: [&mut [V]; 3],
) -> V {
    let data = &data[..K + 8 + K * (K + 1) / 2];
    let (force, approach, follow) = (first::<K>(force), first::<K>(approach), first::<K>(follow));
    let (dp, ds, dl) = (first_mut::<K>(dp), first_mut::<N>(ds), first_mut::<N>(dl));
    inverse_round::<K>(&inverse_matrix::<K>(data), force, dp);
    let mut along = [V::ZERO; K];
    towards(K, data, &mut along);
    ds[0] = radius * factor;
    dl[0] = (data[K + 1] * data[K + 3]).times_plus(target[0] - ds[0], dot_few(&along, force));
    for k in 0..K {
        dp[k] = follow[k].times_plus(factor, dp[k] + approach[k]);
        ds[1 + k] = dp[k];
        dl[1 + k] = -force[k];
    }
    let limit_s = limit_round::<K, N>(first(s), first(inv_s), ds);
    limit_round::<K, N>(first(l), first(inv_l), dl).max(limit_s)
}

/// The inverse of the longest step inside the cone.
#[inline(always)]
fn limit_round<const K: usize, const N: usize>(x: &[V; N], [per, per_more]: &[V; 2], dx: &[V; N]) -> V {
    let product = x[0].times_plus(dx[0], -dot_few(&x[1..=K], &dx[1..=K])) * *per;
    let part = (product + dx[0]) * *per_more * *per;
    let mut square = V::ZERO;
    for k in 1..=K {
        let rest = part.times_from(x[k], dx[k]);
        square = rest.times_plus(rest, square);
    }
    *per * (square.sqrt() - product)
}
