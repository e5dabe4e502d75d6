//! Numbers with derivatives along some directions (dual numbers): what is written for any number gives its
//! derivatives as well, without a step length.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::math::curve::Curve;
use crate::math::real::Real;

/// Directions that are taken at once.
pub const DIRECTIONS: usize = 8;

/// A number with its derivative along every direction.
#[derive(Clone, Copy, Debug)]
pub struct Dual {
    pub value: f64,
    pub slopes: [f64; DIRECTIONS],
}

impl Dual {
    /// A function of two numbers, by its value and its derivatives along both.
    #[inline(always)]
    fn of([a, b]: [Self; 2], value: f64, [along_a, along_b]: [f64; 2]) -> Self {
        let mut slopes = [0.0; DIRECTIONS];
        for k in 0..DIRECTIONS {
            slopes[k] = along_a * a.slopes[k] + along_b * b.slopes[k];
        }
        Self { value, slopes }
    }

    /// A function of this number, by its value and its derivative.
    #[inline(always)]
    fn mapped(mut self, value: f64, slope: f64) -> Self {
        for k in 0..DIRECTIONS {
            self.slopes[k] *= slope;
        }
        Self { value, ..self }
    }
}

impl Add for Dual {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, o: Self) -> Self {
        for k in 0..DIRECTIONS {
            self.slopes[k] += o.slopes[k];
        }
        Self { value: self.value + o.value, ..self }
    }
}

impl Sub for Dual {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, o: Self) -> Self {
        for k in 0..DIRECTIONS {
            self.slopes[k] -= o.slopes[k];
        }
        Self { value: self.value - o.value, ..self }
    }
}

impl Mul for Dual {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self::of([self, o], self.value * o.value, [o.value, self.value])
    }
}

impl Div for Dual {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let value = self.value / o.value;
        Self::of([self, o], value, [1.0 / o.value, -value / o.value])
    }
}

impl Neg for Dual {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.mapped(-self.value, -1.0)
    }
}

impl Real for Dual {
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self { value, slopes: [0.0; DIRECTIONS] }
    }
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.value.sin_cos();
        (self.mapped(s, c), self.mapped(c, -s))
    }
    fn whole_angle(sine: Self, cosine: Self) -> Self {
        let (s, c) = (sine.value, cosine.value);
        let square = s * s + c * c;
        Self::of([sine, cosine], s.atan2(c), [c / square, -s / square])
    }
    // The component of the rotation vector, `sine a / sin a` with the angle a of the whole tilt, as of a plain number.
    fn tilt(sine: Self, cosine: Self) -> Self {
        let c = cosine.value;
        if c > 0.5 {
            return sine;
        }
        let whole = (1.0 - c * c).max(0.0).sqrt();
        let angle = whole.atan2(c);
        if whole < 1e-6 {
            return Self::from_f64(angle);
        }
        let factor = angle / whole;
        let along_cosine = sine.value * (c * factor - 1.0) / (whole * whole);
        Self::of([sine, cosine], sine.value * factor, [factor, along_cosine])
    }
    // f' = (1 / (1 + s) - f / 2) / s, which is -2/3 at zero.
    fn double_arc(square: Self) -> Self {
        let (s, value) = (square.value, f64::double_arc(square.value));
        // Below this the difference is mostly rounding; the series f = 2 - 2 s / 3 + 2 s^2 / 5 serves.
        let slope = if s < 1e-6 { -2.0 / 3.0 + 0.8 * s } else { (1.0 / (1.0 + s) - 0.5 * value) / s };
        square.mapped(value, slope)
    }
    fn within_one(self) -> (Self, Self) {
        let (value, slope) = self.value.within_one();
        (self.mapped(value, slope), Self::from_f64(slope))
    }
    fn reciprocal_root(self, near: f64) -> Self {
        let value = self.value.reciprocal_root(near);
        self.mapped(value, -0.5 * value * value * value)
    }
    fn root(self, near: f64) -> Self {
        let value = Real::root(self.value, near);
        self.mapped(value, if value > 0.0 { 0.5 / value } else { 0.0 })
    }
    fn along(self, curve: &Curve) -> (Self, Self) {
        let [value, slope, bend] = [0, 1, 2].map(|order| curve.at(self.value, order));
        (self.mapped(value, slope), self.mapped(slope, bend))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Function<S> = fn(S, S) -> S;

    /// Every operation, of two numbers between 0.1 and 0.9.
    fn operations<S: Real>() -> Vec<(&'static str, Function<S>)> {
        vec![
            ("sum", |a, b| a + b),
            ("difference", |a, b| a - b),
            ("product", |a, b| a * b),
            ("quotient", |a, b| a / b),
            ("negative", |a, _| -a),
            ("sine", |a, _| a.sin_cos().0),
            ("cosine", |a, _| a.sin_cos().1),
            ("wide sine", |a, _| a.wide_sin_cos().0),
            ("wide cosine", |a, _| a.wide_sin_cos().1),
            ("angle residual", |a, b| S::angle_residual(a, b).0),
            ("small angle", S::small_angle),
            ("wide angle", S::wide_angle),
            ("whole angle", |a, b| S::whole_angle(a, -b)),
            ("tilt", S::tilt),
            ("far tilt", |a, b| S::tilt(a, -b)),
            ("double arc", |a, _| S::double_arc(a)),
            ("within one", |a, b| (a + b).within_one().0),
            ("reciprocal root", |a, _| a.reciprocal_root(0.5)),
            ("root", |a, _| a.root(0.5)),
        ]
    }

    #[test]
    fn slopes_are_differences() {
        let h = 1e-5;
        for ((name, plain), (_, dual)) in operations::<f64>().into_iter().zip(operations::<Dual>()) {
            for i in 0..40 {
                let [a, b] = [0.618_034, 0.324_717].map(|r| 0.1 + 0.8 * (f64::from(i + 1) * r).fract());
                let with = |value: f64, slopes: [f64; 2]| {
                    let mut all = [0.0; DIRECTIONS];
                    all[..2].copy_from_slice(&slopes);
                    Dual { value, slopes: all }
                };
                // Both sides of a kink are not asked for.
                if name == "within one" && (a + b - 1.0).abs() < 2.0 * h || name == "tilt" && (b - 0.5).abs() < 2.0 * h
                {
                    continue;
                }
                let told = dual(with(a, [1.0, 0.3]), with(b, [0.0, -0.7]));
                assert!((told.value - plain(a, b)).abs() < 1e-15, "{name} {a} {b}");
                let along = [[1.0, 0.0], [0.3, -0.7]];
                for (slope, [x, y]) in told.slopes.iter().zip(along) {
                    let difference = (plain(a + h * x, b + h * y) - plain(a - h * x, b - h * y)) / (2.0 * h);
                    assert!(
                        (slope - difference).abs() < 1e-7 * slope.abs().max(1.0),
                        "{name} {a} {b}: {slope} {difference}"
                    );
                }
                assert!(told.slopes[2..].iter().all(|slope| *slope == 0.0), "{name}");
            }
        }
    }

    #[test]
    fn the_double_arc_has_one_slope_on_both_sides_of_where_the_series_ends() {
        let slope = |value: f64| Dual::double_arc(Dual { value, slopes: [1.0; DIRECTIONS] }).slopes[0];
        assert!((slope(0.0) + 2.0 / 3.0).abs() < 1e-15);
        assert!((slope(0.999e-6) - slope(1.001e-6)).abs() < 1e-8);
    }
}
