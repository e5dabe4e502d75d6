//! Vectors of three components and matrices of three rows.

use crate::math::real::Real;

/// A vector in ground axes unless said otherwise.
pub type Vec3<S> = [S; 3];

/// A rotation matrix, row by row.
pub type Mat3<S> = [[S; 3]; 3];

/// Scalar product.
pub fn dot<S: Real>(a: Vec3<S>, b: Vec3<S>) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product.
pub fn cross<S: Real>(a: Vec3<S>, b: Vec3<S>) -> Vec3<S> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Sum of two vectors.
pub fn add<S: Real>(a: Vec3<S>, b: Vec3<S>) -> Vec3<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Difference of two vectors.
pub fn sub<S: Real>(a: Vec3<S>, b: Vec3<S>) -> Vec3<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A vector times a number.
pub fn scale<S: Real>(a: Vec3<S>, s: S) -> Vec3<S> {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// Scalar product of vectors of numbers of any size.
#[must_use]
pub fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Euclidean length of a vector of numbers of any size.
#[must_use]
pub fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
