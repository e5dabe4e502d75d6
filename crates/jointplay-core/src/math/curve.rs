//! A curve that is a polynomial, or one between any two neighbouring knots, twice differentiable where these meet.
//!
//! Between the knots `x_k` and `x_(k+1)` it is `c_0 + c_1 s + c_2 s^2 + ...` with `s = x - x_k`. A single polynomial goes on
//! beyond its knots; several go straight on beyond the first and the last knot.

use std::ops::{Add, Mul};

use serde::Deserialize;

/// Pieces that cost less together than to solve a closure without a recording.
const SHORT: usize = 120;

/// See the module.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "CurveSpec")]
pub struct Curve {
    knots: Vec<f64>,
    pieces: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CurveSpec {
    knots: Vec<f64>,
    pieces: Vec<Vec<f64>>,
}

impl TryFrom<CurveSpec> for Curve {
    type Error = &'static str;

    fn try_from(CurveSpec { knots, pieces }: CurveSpec) -> Result<Self, &'static str> {
        let finite = knots.iter().chain(pieces.iter().flatten()).all(|x| x.is_finite());
        if pieces.is_empty() || knots.len() != pieces.len() + 1 || pieces.iter().any(Vec::is_empty) || !finite {
            return Err("a curve needs one polynomial between any two neighbouring knots");
        }
        if knots.windows(2).any(|ends| ends[0] >= ends[1]) {
            return Err("the knots of a curve increase");
        }
        Ok(Self { knots, pieces })
    }
}

/// The derivative of some order of a polynomial, by Horner's rule, in any numbers.
pub(crate) fn polynomial<S: Copy + Add<Output = S> + Mul<Output = S>>(
    coefficients: &[f64],
    s: S,
    order: usize,
    constant: impl Fn(f64) -> S,
) -> S {
    let factor = |k: usize| (k - order + 1..=k).map(|j| j as f64).product::<f64>();
    let terms = (order..coefficients.len()).rev();
    terms.fold(constant(0.0), |sum, k| sum * s + constant(factor(k)) * constant(coefficients[k]))
}

impl Curve {
    /// Whether it is one polynomial.
    pub(crate) fn is_polynomial(&self) -> bool {
        self.pieces.len() == 1
    }

    /// Whether it has so few pieces that all of them can be computed at once.
    pub(crate) fn is_short(&self) -> bool {
        self.pieces.len() <= SHORT
    }

    /// Its derivative of some order.
    pub(crate) fn at(&self, x: f64, order: usize) -> f64 {
        let at = |coefficients: &[f64], s: f64, order: usize| polynomial(coefficients, s, order, |c| c);
        let last = self.pieces.len() - 1;
        let k = self.knots[1..=last].partition_point(|knot| *knot <= x);
        let (from, to) = (self.knots[k], self.knots[k + 1]);
        let inside = if self.is_polynomial() { x } else { x.clamp(self.knots[0], self.knots[last + 1]) };
        if inside.total_cmp(&x).is_eq() {
            return at(&self.pieces[k], x - from, order);
        }
        let end = if x < from { 0.0 } else { to - from };
        let slope = at(&self.pieces[k], end, 1);
        match order {
            0 => at(&self.pieces[k], end, 0) + slope * (x - inside),
            1 => slope,
            _ => 0.0,
        }
    }

    /// The knots.
    pub(crate) fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// The coefficients between one knot and the next.
    pub(crate) fn piece(&self, k: usize) -> &[f64] {
        &self.pieces[k]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Continuous with its first two derivatives at 0 and 1.
    fn three_pieces() -> Curve {
        let knots = vec![-1.0, 0.0, 1.0, 3.0];
        let pieces = vec![vec![0.5, 1.0, -0.3], vec![1.2, 0.4, -0.3, 0.7], vec![2.0, 1.9, 1.8, -0.4]];
        Curve::try_from(CurveSpec { knots, pieces }).unwrap()
    }

    #[test]
    fn slopes_are_differences_on_both_sides_of_every_knot() {
        let (curve, h) = (three_pieces(), 1e-6);
        for x in [-2.0, -1.0, -0.4, 0.0, 0.6, 1.0, 2.9, 3.0, 5.0] {
            let difference = (curve.at(x + h, 0) - curve.at(x - h, 0)) / (2.0 * h);
            assert!((curve.at(x, 1) - difference).abs() < 1e-5, "{x}");
        }
        let difference = (curve.at(0.5 + h, 1) - curve.at(0.5 - h, 1)) / (2.0 * h);
        assert!((curve.at(0.5, 2) - difference).abs() < 1e-8);
    }

    #[test]
    fn what_is_no_curve_is_refused() {
        let told = |knots: &[f64], pieces: Vec<Vec<f64>>| Curve::try_from(CurveSpec { knots: knots.to_vec(), pieces });
        assert!(told(&[0.0, 1.0], vec![vec![1.0]]).is_ok());
        assert!(told(&[0.0], vec![]).is_err());
        assert!(told(&[0.0, 0.0], vec![vec![1.0]]).is_err());
        assert!(told(&[0.0, 1.0], vec![vec![f64::NAN]]).is_err());
    }
}
