//! The normal equations of eight programs: symmetric, one number of each program in every place.
//!
//! Sums go side by side, several rows or columns at a time, so that none waits for another and a number that was read
//! is used more than once.

use crate::cone::lanes::vector::V;

/// A pivot smaller than this part of its diagonal element belongs to an equation that others imply.
const LOST: V = V::splat(1e-15);

/// `e x`, row by row; rows are `stride` apart and as long as x.
#[inline(always)]
pub(super) fn times(e: &[V], stride: usize, x: &[V], mut out: impl FnMut(usize, V)) {
    let s = e.len().div_ceil(stride.max(1));
    let n = x.len();
    let row = |i: usize| &e[i * stride..][..n];
    let mut i = 0;
    while i + 4 <= s {
        let [a, b, c, d] = [row(i), row(i + 1), row(i + 2), row(i + 3)];
        let mut sums = [V::ZERO; 8];
        let mut k = 0;
        while k + 2 <= n {
            for (at, row) in [a, b, c, d].into_iter().enumerate() {
                sums[2 * at] = row[k].times_plus(x[k], sums[2 * at]);
                sums[2 * at + 1] = row[k + 1].times_plus(x[k + 1], sums[2 * at + 1]);
            }
            k += 2;
        }
        if k < n {
            for (at, row) in [a, b, c, d].into_iter().enumerate() {
                sums[2 * at] = row[k].times_plus(x[k], sums[2 * at]);
            }
        }
        for at in 0..4 {
            out(i + at, sums[2 * at] + sums[2 * at + 1]);
        }
        i += 4;
    }
    while i < s {
        out(i, crate::cone::lanes::vector::dot(row(i), x));
        i += 1;
    }
}

/// Adds `e' y` to out, or takes it away.
#[inline(always)]
pub(super) fn add_transposed(e: &[V], y: &[V], out: &mut [V]) {
    let n = out.len();
    let mut k = 0;
    while k + 8 <= n {
        let mut sums = [V::ZERO; 8];
        sums.copy_from_slice(&out[k..k + 8]);
        for (row, y) in e.chunks_exact(n).zip(y) {
            let row = &row[k..k + 8];
            for at in 0..8 {
                sums[at] = row[at].times_plus(*y, sums[at]);
            }
        }
        out[k..k + 8].copy_from_slice(&sums);
        k += 8;
    }
    while k < n {
        let mut sum = out[k];
        for (row, y) in e.chunks_exact(n).zip(y) {
            sum = row[k].times_plus(*y, sum);
        }
        out[k] = sum;
        k += 1;
    }
}

/// Where the rows of a lower triangle begin that are stored one after the other.
#[inline(always)]
pub(super) const fn triangle(i: usize) -> usize {
    i * (i + 1) / 2
}

/// The rows of the normal equations from row i on that belong to these rows of `e H^-1`, two columns at a time. Every
/// sum has a name, since the compiler keeps an array of so many in memory.
macro_rules! block {
    ($n:ident, $g:ident, $e:ident, $i:ident, $out:ident, $($at:literal $row:ident $a:ident $b:ident),+) => {{
        $(let $row = &$g[$at * $n..][..$n];)+
        let last = $i + [$($at),+].len() - 1;
        for j in (0..=last).step_by(2) {
            // Where there is no second column, the first is summed up twice.
            let second = (j + 1).min(last);
            let (e0, e1) = (&$e[j * $n..][..$n], &$e[second * $n..][..$n]);
            $(let (mut $a, mut $b) = (V::ZERO, V::ZERO);)+
            for k in 0..$n {
                let (x, y) = (e0[k], e1[k]);
                $($a = $row[k].times_plus(x, $a);
                $b = $row[k].times_plus(y, $b);)+
            }
            $(let row = $i + $at;
            for (column, sum) in [(j, $a), (second, $b)] {
                if column <= row {
                    $out[triangle(row) + column] = sum;
                }
            })+
        }
    }};
}

/// Rows of the normal equations that are summed up together, at most.
pub(super) const ROWS: usize = 6;

/// Rows from row i on of the lower triangle of `e H^-1 e'`, for these rows g of `e H^-1`.
#[inline(always)]
pub(super) fn products(n: usize, g: &[V], e: &[V], i: usize, out: &mut [V]) {
    match g.len() / n {
        1 => block!(n, g, e, i, out, 0 g0 a0 b0),
        2 => block!(n, g, e, i, out, 0 g0 a0 b0, 1 g1 a1 b1),
        3 => block!(n, g, e, i, out, 0 g0 a0 b0, 1 g1 a1 b1, 2 g2 a2 b2),
        4 => block!(n, g, e, i, out, 0 g0 a0 b0, 1 g1 a1 b1, 2 g2 a2 b2, 3 g3 a3 b3),
        5 => block!(n, g, e, i, out, 0 g0 a0 b0, 1 g1 a1 b1, 2 g2 a2 b2, 3 g3 a3 b3, 4 g4 a4 b4),
        _ => block!(n, g, e, i, out, 0 g0 a0 b0, 1 g1 a1 b1, 2 g2 a2 b2, 3 g3 a3 b3, 4 g4 a4 b4, 5 g5 a5 b5),
    }
}

/// Factors a lower triangle in place: it becomes `L` with the inverses of its diagonal. Equations that
/// others imply get no step. Two columns at a time, with twice as much memory as there are equations.
#[inline(always)]
pub(super) fn factor(s: usize, m: &mut [V], memory: &mut [V]) {
    let mut j = 0;
    while j < s {
        let two = j + 1 < s;
        let (first, second) = memory.split_at_mut(s);
        let (a, b) = (&mut first[..j], &mut second[..j]);
        a.copy_from_slice(&m[triangle(j)..triangle(j) + j]);
        let next = if two { j + 1 } else { j };
        b.copy_from_slice(&m[triangle(next)..triangle(next) + j]);
        let diagonals = [m[triangle(j) + j], m[triangle(next) + next]];
        let mut i = j;
        while i < s {
            let rows: [usize; 4] = std::array::from_fn(|at| triangle((i + at).min(s - 1)));
            let mut sums = [[V::ZERO; 2]; 4];
            let above = rows.map(|row| &m[row..][..j]);
            for k in 0..j {
                for (sums, row) in sums.iter_mut().zip(above) {
                    sums[0] = row[k].times_plus(a[k], sums[0]);
                    sums[1] = row[k].times_plus(b[k], sums[1]);
                }
            }
            for (at, (sums, row)) in sums.iter().zip(rows).enumerate() {
                if i + at < s {
                    m[row + j] = m[row + j] - sums[0];
                    if two && i + at > j {
                        m[row + j + 1] = m[row + j + 1] - sums[1];
                    }
                }
            }
            i += 4;
        }
        let inverse = inverse_root(m[triangle(j) + j], diagonals[0]);
        m[triangle(j) + j] = inverse;
        if two {
            let below = m[triangle(next) + j] * inverse;
            m[triangle(next) + j] = below;
            let pivot = below.times_from(below, m[triangle(next) + next]);
            let second = inverse_root(pivot, diagonals[1]);
            m[triangle(next) + next] = second;
            for i in j + 2..s {
                let row = &mut m[triangle(i) + j..triangle(i) + j + 2];
                row[0] = row[0] * inverse;
                row[1] = below.times_from(row[0], row[1]) * second;
            }
        }
        j += 2;
    }
}

/// The inverse root of a pivot; nothing where the equation is implied by others.
#[inline(always)]
fn inverse_root(pivot: V, diagonal: V) -> V {
    V::ZERO.where_else(pivot.below(LOST * diagonal), V::ONE / pivot.sqrt())
}

/// Solves `L L' x = b` in place.
#[inline(always)]
pub(super) fn solve(s: usize, m: &[V], x: &mut [V]) {
    for i in 0..s {
        let value = x[i] * m[triangle(i) + i];
        x[i] = value;
        for j in i + 1..s {
            x[j] = m[triangle(j) + i].times_from(value, x[j]);
        }
    }
    for i in (0..s).rev() {
        let value = x[i] * m[triangle(i) + i];
        x[i] = value;
        for (x, m) in x.iter_mut().zip(&m[triangle(i)..triangle(i) + i]) {
            *x = m.times_from(value, *x);
        }
    }
}
