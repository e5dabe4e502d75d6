//! Rotation matrices and rotation vectors (axis times angle) in space.

use crate::math::real::Real;
use crate::math::vector::{Mat3, Vec3, add, cross, dot, norm, scale};

/// Terms of the power series of a turn, to rounding up to 2.4 rad.
const TERMS: usize = 12;

/// The rotation vector of a rotation, its angle from 0 to pi.
#[must_use]
pub fn rotation_vector(r: &Mat3<f64>) -> Vec3<f64> {
    // Twice the sine of the angle along the axis, and twice its cosine plus one.
    let skew = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
    let trace = r[0][0] + r[1][1] + r[2][2];
    let sine = norm(&skew);
    let angle = sine.atan2(trace - 1.0);
    if sine == 0.0 && trace > 0.0 {
        return [0.0; 3];
    }
    if trace > 0.0 || sine > 1e-2 {
        return scale(skew, angle / sine);
    }
    // Near half a turn the sine vanishes: R + R^T tells the axis, its sign the sine.
    let i = (0..3).fold(0, |best, k| if r[k][k] > r[best][best] { k } else { best });
    let mut axis: Vec3<f64> = std::array::from_fn(|k| r[i][k] + r[k][i]);
    axis[i] += 1.0 - trace;
    let sign = if dot(axis, skew) < 0.0 { -1.0 } else { 1.0 };
    scale(axis, sign * angle / norm(&axis))
}

/// Product of two matrices.
pub fn product<S: Real>(a: &Mat3<S>, b: &Mat3<S>) -> Mat3<S> {
    let columns = transposed(b);
    a.map(|row| columns.map(|column| dot(row, column)))
}

/// A matrix with rows and columns exchanged.
pub fn transposed<S: Real>(a: &Mat3<S>) -> Mat3<S> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// The rotation of a rotation vector (Rodrigues' formula).
#[must_use]
pub fn rotation_of_vector(v: Vec3<f64>) -> Mat3<f64> {
    let square = dot(v, v);
    let angle = square.sqrt();
    // sin(a) / a and (1 - cos(a)) / a^2, without cancellation.
    let (s, c) = if angle < 1e-8 {
        (1.0, 0.5)
    } else {
        let half = (0.5 * angle).sin() / angle;
        (angle.sin() / angle, 2.0 * half * half)
    };
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let (diagonal, skew) = match (3 + j - i) % 3 {
                0 => (1.0 - c * square, 0.0),
                1 => (0.0, -s * v[3 - i - j]),
                _ => (0.0, s * v[3 - i - j]),
            };
            diagonal + skew + c * v[i] * v[j]
        })
    })
}

/// The rotation of a rotation vector v of up to 2.4 rad, by operations that recorded programs have as well:
///
/// ```text
/// R x = x + (sin a / a) v x x + (1 - cos a) / a^2 v x (v x x),    a = |v|
/// J x = x + (1 - cos a) / a^2 v x x + (a - sin a) / a^3 v x (v x x)
/// ```
pub struct Turn<S> {
    vector: Vec3<S>,
    /// `sin a / a`, `(1 - cos a) / a^2` and `(a - sin a) / a^3`.
    factors: [S; 3],
}

impl<S: Real> Turn<S> {
    /// The turn by a rotation vector.
    #[must_use]
    pub fn new(vector: Vec3<S>) -> Self {
        let square = dot(vector, vector);
        // 1 / n! - a^2 / (n + 2)! + a^4 / (n + 4)! - ...
        let series = |n: usize| {
            let first: f64 = (2..=n).map(|k| 1.0 / k as f64).product();
            let mut coefficients = vec![first];
            for k in 1..TERMS {
                let m = (n + 2 * k) as f64;
                coefficients.push(-coefficients[k - 1] / (m * (m - 1.0)));
            }
            coefficients.iter().rev().fold(S::from_f64(0.0), |sum, &c| sum * square + S::from_f64(c))
        };
        let [second, third] = [series(2), series(3)];
        Self { vector, factors: [S::from_f64(1.0) - square * third, second, third] }
    }

    fn sum(&self, x: Vec3<S>, first: S, second: S) -> Vec3<S> {
        let across = cross(self.vector, x);
        add(x, add(scale(across, first), scale(cross(self.vector, across), second)))
    }

    /// A vector turned.
    #[must_use]
    pub fn of(&self, x: Vec3<S>) -> Vec3<S> {
        self.sum(x, self.factors[0], self.factors[1])
    }

    /// The rotation by which the turn grows with a rate of its vector (the left Jacobian of the exponential map).
    #[must_use]
    pub fn rate(&self, x: Vec3<S>) -> Vec3<S> {
        self.sum(x, self.factors[1], self.factors[2])
    }
}

/// The matrix that takes an angular velocity in ground axes to the rate of a rotation vector below a full
/// turn (the inverse of the left Jacobian of the exponential map).
#[must_use]
pub fn inverse_left_jacobian(v: Vec3<f64>) -> Mat3<f64> {
    let square = dot(v, v);
    let angle = square.sqrt();
    // (1 - (a / 2) cot(a / 2)) / a^2, by its series where that cancels.
    let c = if angle < 1e-2 {
        1.0 / 12.0 + square / 720.0 + square * square / 30240.0
    } else {
        (1.0 - 0.5 * angle / (0.5 * angle).tan()) / square
    };
    let across = cross_matrix(v);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let (diagonal, other) = if i == j { (1.0, square) } else { (0.0, 0.0) };
            diagonal - 0.5 * across[i][j] + c * (v[i] * v[j] - other)
        })
    })
}

/// The matrix that multiplies a vector by `v` from the left.
const fn cross_matrix(v: Vec3<f64>) -> Mat3<f64> {
    [[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]]
}

/// Sine and cosine of the difference of two angles.
pub fn turn_back<S: Real>((s, c): (S, S), (sine, cosine): (S, S)) -> (S, S) {
    (s * cosine - c * sine, c * cosine + s * sine)
}

/// Sine and cosine of the sum of two angles.
pub fn turn_on<S: Real>((s, c): (S, S), (sine, cosine): (S, S)) -> (S, S) {
    (s * cosine + c * sine, c * cosine - s * sine)
}

/// Sine and cosine of a whole multiple of an angle, by repeated squaring.
pub fn turn_times<S: Real>((s, c): (S, S), times: i32) -> (S, S) {
    let mut square = if times < 0 { (-s, c) } else { (s, c) };
    let mut left = times.unsigned_abs();
    let mut product = (S::from_f64(0.0), S::from_f64(1.0));
    while left > 0 {
        if left & 1 == 1 {
            product = turn_on(product, square);
        }
        left >>= 1;
        if left > 0 {
            square = turn_on(square, square);
        }
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_vector_comes_back_from_its_rotation() {
        let axis = scale([2.0, -1.0, 2.0], 1.0 / 3.0);
        for angle in [0.0, 1e-12, 1e-6, 0.3, 1.5, 3.0, 3.13, std::f64::consts::PI - 1e-7] {
            let v = scale(axis, angle);
            let back = rotation_vector(&rotation_of_vector(v));
            // Near half a turn the axis is known to the root of rounding at worst.
            let tolerance = if angle > 3.1 { 1e-8 } else { 1e-15 * (1.0 + 4.0 * angle) };
            assert!((0..3).all(|k| (back[k] - v[k]).abs() <= tolerance), "{angle}: {back:?}");
        }
    }

    #[test]
    fn the_rate_of_a_rotation_vector_is_its_difference() {
        for size in [1e-9, 1e-3, 9.9e-3, 0.0101, 0.5, 2.0] {
            let v = scale([0.6, -0.48, 0.64], size);
            let map = inverse_left_jacobian(v);
            for axis in 0..3 {
                let step = 1e-5;
                let ends = [step, -step].map(|h| {
                    let mut turn = [0.0; 3];
                    turn[axis] = h;
                    rotation_vector(&product(&rotation_of_vector(turn), &rotation_of_vector(v)))
                });
                for k in 0..3 {
                    assert!((map[k][axis] - (ends[0][k] - ends[1][k]) / (2.0 * step)).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_turn_and_its_rate_are_those_of_the_rotation_vector() {
        for size in [0.0, 1e-9, 0.01, 0.7, 1.6, 2.4] {
            let v = scale([0.6, -0.48, 0.64], size);
            let (turn, rotation, back) = (Turn::new(v), rotation_of_vector(v), inverse_left_jacobian(v));
            for k in 0..3 {
                let axis = std::array::from_fn(|i| f64::from(u8::from(i == k)));
                let (turned, rate) = (turn.of(axis), turn.rate(axis));
                for i in 0..3 {
                    assert!((turned[i] - rotation[i][k]).abs() < 1e-15, "{size}");
                    assert!((dot(back[i], rate) - axis[i]).abs() < 4e-15, "{size}");
                }
            }
        }
    }

    #[test]
    fn a_rotation_turns_about_its_axis_by_the_right_hand() {
        let quarter = rotation_of_vector([0.0, 0.0, std::f64::consts::FRAC_PI_2]);
        let turned = quarter.map(|row| dot(row, [1.0, 0.0, 0.0]));
        assert!((turned[1] - 1.0).abs() < 1e-15 && turned[0].abs() < 1e-15);
    }
}
