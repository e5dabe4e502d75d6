//! The normal equations of eight programs: symmetric, one number of each program in every place.

use super::vector::{V, dot};

/// A pivot smaller than this part of its diagonal element belongs to an equation that others imply.
const LOST: V = V::splat(1e-15);

/// Lower triangle of `g e' + add`, row by row.
#[inline(always)]
pub(super) fn products(n: usize, g: &[V], e: &[V], add: &[V], out: &mut [V]) {
    let s = g.len() / n.max(1);
    let mut i = 0;
    // Two rows by two columns at a time: every number read is used twice.
    while i + 1 < s {
        let (g0, g1) = (&g[i * n..(i + 1) * n], &g[(i + 1) * n..(i + 2) * n]);
        let mut j = 0;
        while j <= i {
            let (e0, e1) = (&e[j * n..(j + 1) * n], &e[(j + 1) * n..(j + 2) * n]);
            let mut sums = [V::ZERO; 4];
            for k in 0..n {
                sums[0] = g0[k].times_plus(e0[k], sums[0]);
                sums[1] = g0[k].times_plus(e1[k], sums[1]);
                sums[2] = g1[k].times_plus(e0[k], sums[2]);
                sums[3] = g1[k].times_plus(e1[k], sums[3]);
            }
            // Beyond the diagonal a number is written that nobody reads.
            out[i * s + j] = sums[0];
            out[i * s + j + 1] = sums[1];
            out[(i + 1) * s + j] = sums[2];
            out[(i + 1) * s + j + 1] = sums[3];
            j += 2;
        }
        i += 2;
    }
    if i < s {
        let row = &g[i * n..(i + 1) * n];
        for j in 0..=i {
            out[i * s + j] = dot(row, &e[j * n..(j + 1) * n]);
        }
    }
    for (out, add) in out.iter_mut().zip(add) {
        *out = *out + *add;
    }
}

/// Factors in place: the lower triangle becomes `L` with the inverses of its diagonal. Equations that
/// others imply get no step.
#[inline(always)]
pub(super) fn factor(s: usize, m: &mut [V]) {
    for i in 0..s {
        let (above, rest) = m.split_at_mut(i * s);
        let row = &mut rest[..=i];
        for j in 0..i {
            let other = &above[j * s..=j * s + j];
            let sum = row[j] - dot(&row[..j], &other[..j]);
            row[j] = sum * other[j];
        }
        let pivot = row[i] - dot(&row[..i], &row[..i]);
        let lost = pivot.below(LOST * row[i]);
        row[i] = V::ZERO.where_else(lost, V::ONE / pivot.sqrt());
    }
}

/// Solves `L L' x = b` in place.
#[inline(always)]
pub(super) fn solve(s: usize, m: &[V], x: &mut [V]) {
    for i in 0..s {
        let sum = x[i] - dot(&m[i * s..i * s + i], &x[..i]);
        x[i] = sum * m[i * s + i];
    }
    for i in (0..s).rev() {
        let value = x[i] * m[i * s + i];
        x[i] = value;
        for j in 0..i {
            x[j] = m[i * s + j].times_from(value, x[j]);
        }
    }
}
