//! A curve that is a polynomial, or one between any two neighbouring knots, twice differentiable where these meet.
//!
//! Between the knots x_k and x_(k+1) it is `c_0 + c_1 s + c_2 s^2 + ...` with `s = x - x_k`. A single polynomial goes on
//! beyond its knots; several go straight on beyond the first and the last knot.

use serde::Deserialize;

use crate::math::interval::Interval;
use crate::math::real::Real;

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

/// The derivative of some order of a polynomial, by Horner's rule.
fn polynomial<S: Real>(coefficients: &[f64], s: S, order: usize) -> S {
    let factor = |k: usize| (k - order + 1..=k).map(|j| j as f64).product::<f64>();
    let terms = (order..coefficients.len()).rev();
    terms.fold(S::from_f64(0.0), |sum, k| sum * s + S::from_f64(factor(k) * coefficients[k]))
}

impl Curve {
    /// Whether it is one polynomial.
    pub(crate) fn is_polynomial(&self) -> bool {
        self.pieces.len() == 1
    }

    /// Its derivative of some order.
    pub(crate) fn at(&self, x: f64, order: usize) -> f64 {
        let last = self.pieces.len() - 1;
        let k = self.knots[1..=last].partition_point(|knot| *knot <= x);
        let (from, to) = (self.knots[k], self.knots[k + 1]);
        let inside = if self.is_polynomial() { x } else { x.clamp(self.knots[0], self.knots[last + 1]) };
        if inside.total_cmp(&x).is_eq() {
            return polynomial(&self.pieces[k], x - from, order);
        }
        let end = if x < from { 0.0 } else { to - from };
        let slope = polynomial(&self.pieces[k], end, 1);
        match order {
            0 => polynomial(&self.pieces[k], end, 0) + slope * (x - inside),
            1 => slope,
            _ => 0.0,
        }
    }

    /// What holds its derivative of some order wherever a number may be.
    pub(crate) fn range(&self, x: Interval, order: usize) -> Interval {
        if !x.is_finite() {
            return Interval::LINE;
        }
        if self.is_polynomial() {
            return self.piece(0, x, order);
        }
        let (first, last) = (self.knots[0], self.knots[self.pieces.len()]);
        let mut found: Option<Interval> = None;
        let mut add = |part: Interval| found = Some(found.map_or(part, |sum| sum.hull(part)));
        for (k, ends) in self.knots.windows(2).enumerate() {
            if x.high >= ends[0] && x.low <= ends[1] {
                add(self.piece(k, Interval::new(x.low.max(ends[0]), x.high.min(ends[1])), order));
            }
        }
        let outside = [(x.low < first, 0, first), (x.high > last, self.pieces.len() - 1, last)];
        for (_, k, end) in outside.into_iter().filter(|(is_there, ..)| *is_there) {
            let at = Interval::from_point(end);
            let slope = self.piece(k, at, 1);
            let beyond =
                if k == 0 { Interval::new(x.low, x.high.min(end)) } else { Interval::new(x.low.max(end), x.high) };
            add(match order {
                0 => self.piece(k, at, 0) + slope * (beyond - at),
                1 => slope,
                _ => Interval::ZERO,
            });
        }
        found.unwrap_or(Interval::LINE)
    }

    /// By the mean value theorem, which loses less than Horner's rule alone.
    fn piece(&self, k: usize, x: Interval, order: usize) -> Interval {
        let s = x - Interval::from_point(self.knots[k]);
        let middle = Interval::from_point(s.middle());
        let by_slope =
            polynomial(&self.pieces[k], middle, order) + polynomial(&self.pieces[k], s, order + 1) * (s - middle);
        let plain = polynomial(&self.pieces[k], s, order);
        plain.common(by_slope).unwrap_or(plain)
    }

    /// Value and slope of a single polynomial, by operations that all numbers have.
    pub(crate) fn of_polynomial<S: Real>(&self, x: S) -> (S, S) {
        let s = x - S::from_f64(self.knots[0]);
        (polynomial(&self.pieces[0], s, 0), polynomial(&self.pieces[0], s, 1))
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
    fn an_interval_holds_what_its_points_give() {
        let curve = three_pieces();
        for (low, high) in [(-3.0, 4.0), (-1.5, -0.5), (0.2, 0.3), (0.9, 1.1), (2.5, 6.0), (1.0, 1.0)] {
            for order in 0..3 {
                let held = curve.range(Interval::new(low, high), order);
                for k in 0..=50 {
                    let x = low + (high - low) * f64::from(k) / 50.0;
                    let (value, slack) = (curve.at(x, order), 1e-12);
                    // The second derivative jumps where the straight parts begin, at the ends of the knots.
                    assert!(held.low - slack <= value && value <= held.high + slack, "{x} {order} {held:?}");
                }
            }
        }
        assert!(curve.range(Interval::new(0.2, 0.21), 0).width() < 0.02);
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
