//! Poses of rigid bodies in the plane and in space.
//!
//! The plane is embedded in space: a planar body is a spatial one whose twist has only the
//! components (x, y, rotation about z). What differs between the two is therefore data, the list of
//! twist components that a body has, and never a second copy of the code.

use serde::Deserialize;

use crate::real::Real;

/// A vector in ground axes unless said otherwise.
pub type Vec3<S> = [S; 3];
/// A rotation matrix, row by row.
pub type Mat3<S> = [[S; 3]; 3];

/// One component of a small displacement: along or about one of three axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// Translation along axis 0, 1 or 2.
    Along(usize),
    /// Rotation about axis 0, 1 or 2.
    About(usize),
}

/// The space that a mechanism lives in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Space {
    /// Translations x, y and the rotation about z.
    Planar,
}

impl Space {
    /// The components of a body's twist, in the order of the unknowns.
    #[must_use]
    pub const fn components(self) -> &'static [Component] {
        match self {
            Self::Planar => &[Component::Along(0), Component::Along(1), Component::About(2)],
        }
    }

    /// Number of components of a twist or a wrench.
    #[must_use]
    pub const fn size(self) -> usize {
        self.components().len()
    }

    /// The pose that the coordinates of one body describe (planar: x, y, angle).
    #[must_use]
    pub fn pose(self, coordinates: &[f64]) -> Pose<f64> {
        match self {
            Self::Planar => {
                Pose { position: [coordinates[0], coordinates[1], 0.0], rotation: rotation_about_z(coordinates[2]) }
            }
        }
    }

    /// How many numbers a recorded program keeps of one body's pose.
    #[must_use]
    pub const fn n_pose_numbers(self) -> usize {
        match self {
            Self::Planar => 4,
        }
    }

    /// Puts those numbers (planar: x, y, cosine, sine) one by one.
    pub fn put_pose_numbers(self, coordinates: &[f64], mut put: impl FnMut(f64)) {
        match self {
            Self::Planar => {
                let (sine, cosine) = coordinates[2].sin_cos();
                put(coordinates[0]);
                put(coordinates[1]);
                put(cosine);
                put(sine);
            }
        }
    }

    /// The coordinates of those numbers, continued from nearby ones over full turns.
    #[inline]
    pub fn coordinates_of_numbers(self, number: impl Fn(usize) -> f64, near: &[f64], coordinates: &mut [f64]) {
        match self {
            Self::Planar => {
                let (sine, cosine) = near[2].sin_cos();
                let (c, s) = (number(2), number(3));
                coordinates[0] = number(0);
                coordinates[1] = number(1);
                coordinates[2] = near[2] + (s * cosine - c * sine).atan2(c * cosine + s * sine);
            }
        }
    }

    /// The pose of those numbers.
    pub fn pose_of_numbers<S: Real>(self, numbers: &[S]) -> Pose<S> {
        let (o, l) = (S::from_f64(0.0), S::from_f64(1.0));
        match self {
            Self::Planar => {
                let (c, s) = (numbers[2], numbers[3]);
                Pose { position: [numbers[0], numbers[1], o], rotation: [[c, -s, o], [s, c, o], [o, o, l]] }
            }
        }
    }

    /// Those numbers after a small twist.
    pub fn move_numbers<S: Real>(self, numbers: &[S], twist: &[S]) -> Vec<S> {
        match self {
            Self::Planar => {
                let (s, c) = twist[2].sin_cos();
                let (c0, s0) = (numbers[2], numbers[3]);
                vec![numbers[0] + twist[0], numbers[1] + twist[1], c0 * c - s0 * s, s0 * c + c0 * s]
            }
        }
    }

    /// Moves one body's coordinates by a small twist taken at the body's origin, in ground axes.
    pub fn retract(self, coordinates: &mut [f64], twist: &[f64]) {
        match self {
            Self::Planar => {
                for (c, t) in coordinates.iter_mut().zip(twist) {
                    *c += t;
                }
            }
        }
    }
}

/// Where a body is: the position of its origin and the rotation from body axes to ground axes.
#[derive(Clone, Copy, Debug)]
pub struct Pose<S> {
    /// Position of the body's origin.
    pub position: Vec3<S>,
    /// Columns are the body's axes in ground axes.
    pub rotation: Mat3<S>,
}

impl<S: Real> Pose<S> {
    /// The ground itself.
    #[must_use]
    pub fn identity() -> Self {
        let (o, l) = (S::from_f64(0.0), S::from_f64(1.0));
        Self { position: [o; 3], rotation: [[l, o, o], [o, l, o], [o, o, l]] }
    }

    /// Turns a vector from body axes to ground axes.
    #[must_use]
    pub fn turn(&self, v: Vec3<S>) -> Vec3<S> {
        let r = &self.rotation;
        [dot(r[0], v), dot(r[1], v), dot(r[2], v)]
    }
}

fn rotation_about_z(angle: f64) -> Mat3<f64> {
    let (s, c) = angle.sin_cos();
    [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
}

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

/// Euclidean length of a vector of numbers of any size.
#[must_use]
pub fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
