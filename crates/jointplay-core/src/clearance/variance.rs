//! Variances of the laws of scatter on the sets at unit scale.

use std::f64::consts::{PI, SQRT_2};

use crate::clearance::draw::SIGMAS;
use crate::clearance::law::Law;

/// Variance of one coordinate on the unit disc (two coordinates) or the unit ball (three).
#[must_use]
pub fn round_variance(law: Law, size: usize) -> f64 {
    let n = size as f64;
    match law {
        Law::Uniform => 1.0 / (n + 2.0),
        Law::Boundary => 1.0 / n,
        Law::Normal if size == 2 => {
            // Rayleigh radius truncated at `SIGMAS`: E[R^2] = 2 s^2 (1 - k e^-k / (1 - e^-k)), k = SIGMAS^2 / 2.
            let k = 0.5 * SIGMAS * SIGMAS;
            (1.0 - k * (-k).exp() / -(-k).exp_m1()) / (SIGMAS * SIGMAS)
        }
        Law::Normal => {
            // Maxwell radius truncated at `SIGMAS`: probabilities of chi-square with 5 and 3 degrees of freedom.
            let (all, edge) = (inside(SIGMAS), 2.0 * SIGMAS * density(SIGMAS));
            (all - edge * (1.0 + SIGMAS * SIGMAS / 3.0)) / (all - edge) / (SIGMAS * SIGMAS)
        }
        Law::Gauss => 1.0 / (SIGMAS * SIGMAS),
    }
}

/// Variance of one coordinate on the unit diamond.
#[must_use]
pub fn diamond_variance(law: Law) -> f64 {
    match law {
        Law::Uniform => 1.0 / 6.0,
        Law::Boundary => 1.0 / 3.0,
        Law::Normal => 0.5 * truncated_variance(SQRT_2 / SIGMAS),
        Law::Gauss => 1.0 / (SIGMAS * SIGMAS),
    }
}

/// Variance on the interval from -1 to 1.
#[must_use]
pub fn interval_variance(law: Law) -> f64 {
    match law {
        Law::Uniform => 1.0 / 3.0,
        Law::Boundary => 1.0,
        Law::Normal => truncated_variance(1.0 / SIGMAS),
        Law::Gauss => 1.0 / (SIGMAS * SIGMAS),
    }
}

/// Variance of a centred normal number of standard deviation `sigma` truncated to [-1, 1].
fn truncated_variance(sigma: f64) -> f64 {
    let k = 1.0 / sigma;
    sigma * sigma * (1.0 - 2.0 * k * density(k) / inside(k))
}

/// Probabilities that the largest of 3, 4 and 5 uniform numbers is distributed like the distance from
/// the end of the axis of a uniform point of tapered squares, at unit scale.
///
/// At the distance t the squares' areas multiply to a density `t^2 (1 - k + k t)^2`, with k the lesser
/// taper (zero where there is one square): powers of t, each of which is the density of a largest one.
#[must_use]
pub fn tapered_orders(tapers: &[f64]) -> [f64; 3] {
    let k = if tapers.len() > 1 { tapers[0].min(tapers[1]) } else { 0.0 };
    let orders = [(1.0 - k) * (1.0 - k) / 3.0, 2.0 * k * (1.0 - k) / 4.0, k * k / 5.0];
    let sum: f64 = orders.iter().sum();
    orders.map(|order| order / sum)
}

/// Variances of the coordinate along the axis of tapered squares, and of those along the diagonals of
/// each square, at unit scale.
#[must_use]
pub fn tapered_variances(law: Law, tapers: &[f64]) -> (f64, [f64; 2]) {
    match law {
        Law::Uniform => uniform_tapered_variances(tapers),
        Law::Boundary => {
            // A uniform point is one on the boundary times an independent factor g with the density
            // n g^(n-1), whose mean square is n / (n + 2).
            let n = (1 + 2 * tapers.len()) as f64;
            let (along, across) = uniform_tapered_variances(tapers);
            (along * (n + 2.0) / n, across.map(|v| v * (n + 2.0) / n))
        }
        Law::Normal => normal_tapered_variances(tapers),
        Law::Gauss => (1.0 / (SIGMAS * SIGMAS), [1.0 / (SIGMAS * SIGMAS); 2]),
    }
}

fn uniform_tapered_variances(tapers: &[f64]) -> (f64, [f64; 2]) {
    let (mut along, mut across) = (0.0, [0.0; 2]);
    for (order, weight) in [3.0, 4.0, 5.0].into_iter().zip(tapered_orders(tapers)) {
        let (mean, square) = (order / (order + 1.0), order / (order + 2.0));
        along += weight * (1.0 - 2.0 * mean + square);
        for (variance, g) in across.iter_mut().zip(tapers) {
            *variance += weight * ((1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - g) * mean + g * g * square) / 6.0;
        }
    }
    (along, across)
}

/// By quadrature along the axis: across it the squares' coordinates are independent truncated normal
/// numbers.
fn normal_tapered_variances(tapers: &[f64]) -> (f64, [f64; 2]) {
    // Gauss-Legendre with five points: nodes on [-1, 1] and weights.
    const RULE: [(f64, f64); 3] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    // Panels of an eighth of a standard deviation leave less than 1e-14.
    const PANELS: u32 = 24;
    let half = 0.5 * SIGMAS / f64::from(PANELS);
    let (mut sum, mut along, mut across) = (0.0, 0.0, [0.0; 2]);
    for panel in 0..PANELS {
        for (node, weight) in RULE.into_iter().flat_map(|(x, w)| [(x, w), (-x, w)]) {
            // The middle node comes twice.
            let weight = if node == 0.0 { 0.5 * weight } else { weight };
            let z = half * (f64::from(2 * panel + 1) + node);
            // Half the diagonal of a square as standard deviations of its sides' coordinates.
            let cut = |g: &f64| (SIGMAS - g * z) / SQRT_2;
            let all = tapers.iter().map(|g| inside(cut(g)).powi(2)).product::<f64>() * weight * density(z);
            sum += all;
            along += all * z * z;
            for (variance, k) in across.iter_mut().zip(tapers.iter().map(cut)) {
                *variance += all * (1.0 - 2.0 * k * density(k) / inside(k));
            }
        }
    }
    let scale = 1.0 / (sum * SIGMAS * SIGMAS);
    (along * scale, across.map(|v| v * scale))
}

/// Density of a standard normal number.
fn density(k: f64) -> f64 {
    (-0.5 * k * k).exp() / (2.0 * PI).sqrt()
}

/// Probability that a standard normal number lies within +-k, by its everywhere convergent series
/// (A&S 26.2.11: 2 phi(k) (k + k^3/3 + k^5/15 + ...)).
fn inside(k: f64) -> f64 {
    let (mut term, mut sum, mut odd) = (k, k, 1.0);
    while term > 1e-18 * sum {
        odd += 2.0;
        term *= k * k / odd;
        sum += term;
    }
    2.0 * sum * density(k)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral from 0 to 1 by Simpson's rule, fine enough for rounding to be all that is left.
    fn simpson(f: impl Fn(f64) -> f64) -> f64 {
        let at = |i: i32| f(f64::from(i) / 2000.0) * f64::from([2, 4][i as usize % 2]);
        ((0..=2000).map(at).sum::<f64>() - f(0.0) - f(1.0)) / 6000.0
    }

    #[test]
    fn truncated_normal_radii_agree_with_quadrature() {
        for size in [2, 3] {
            // Three standard deviations to 1.
            let density = |r: f64| r.powi(size - 1) * (-4.5 * r * r).exp();
            let square = simpson(|r| density(r) * r * r) / simpson(density);
            let variance = round_variance(Law::Normal, size as usize);
            assert!((variance - square / f64::from(size)).abs() < 1e-12);
        }
    }

    #[test]
    fn the_tapered_laws_agree_with_integrals_known_in_closed_form() {
        // The octahedron's moments do not depend on which of its diagonals is called the axis.
        for law in [Law::Uniform, Law::Boundary, Law::Normal, Law::Gauss] {
            let (along, [across, _]) = tapered_variances(law, &[1.0]);
            assert!((along - across).abs() < 1e-14, "{law:?} {along} {across}");
        }
        // Uniform in the octahedron: E[x^2] = 2 / (4 5); pyramids over a product of squares: 2 / (6 7).
        assert!((tapered_variances(Law::Uniform, &[1.0]).0 - 0.1).abs() < 1e-15);
        assert!((tapered_variances(Law::Uniform, &[1.0, 1.0]).0 - 1.0 / 21.0).abs() < 1e-15);
        // Between the two: the area of the squares at every height, by quadrature.
        let k = 0.6;
        let area = |x: f64| ((1.0 - x) * (1.0 - k * x)).powi(2);
        let all = simpson(area);
        let (along, across) = tapered_variances(Law::Uniform, &[k, 1.0]);
        assert!((along - simpson(|x| area(x) * x * x) / all).abs() < 1e-12);
        assert!((across[0] - simpson(|x| area(x) * (1.0 - k * x).powi(2) / 6.0) / all).abs() < 1e-12);
        assert!((across[1] - simpson(|x| area(x) * (1.0 - x).powi(2) / 6.0) / all).abs() < 1e-12);
        // A square that does not taper is a diamond of its own, and the other with the axis an octahedron.
        for law in [Law::Uniform, Law::Normal] {
            let (along, across) = tapered_variances(law, &[1.0, 0.0]);
            assert!((along - tapered_variances(law, &[1.0]).0).abs() < 1e-14);
            assert!((across[0] - along).abs() < 1e-14);
            assert!((across[1] - diamond_variance(law)).abs() < 1e-14);
        }
    }
}
