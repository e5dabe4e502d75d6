//! Poses of rigid bodies in the plane and in space.
//!
//! The plane is embedded in space: a planar body is a spatial one whose twist has only the
//! components (x, y, rotation about z). What differs between the two is therefore data, the list of
//! twist components that a body has and the numbers that describe its pose, and never a second copy
//! of the equations.
//!
//! | | coordinates of a body | pose numbers of a recorded program | twist |
//! |---|---|---|---|
//! | plane | x, y, angle | x, y, cosine, sine | x, y, rotation |
//! | space | x, y, z, unit quaternion | x, y, z, quaternion of any size | 3 translations, 3 rotations |
//!
//! A quaternion moves by half the rotation times itself, which turns by `2 atan(|rotation| / 2)`: exact
//! to second order, and without trigonometry.

use serde::Deserialize;

use crate::math::real::Real;
use crate::math::rotation::{product, rotation_of_vector, rotation_vector, transposed};
use crate::math::vector::{Mat3, Vec3, cross, dot, scale, sub};

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
    /// Translations and rotations along and about x, y, z.
    Spatial,
}

impl Space {
    /// The components of a body's twist, in the order of the unknowns.
    #[must_use]
    pub const fn components(self) -> &'static [Component] {
        use Component::{About, Along};
        match self {
            Self::Planar => &[Along(0), Along(1), About(2)],
            Self::Spatial => &[Along(0), Along(1), Along(2), About(0), About(1), About(2)],
        }
    }

    /// Number of components of a twist or a wrench.
    #[must_use]
    pub const fn size(self) -> usize {
        self.components().len()
    }

    /// Number of coordinates that describe the pose of one body.
    #[must_use]
    pub const fn n_coordinates(self) -> usize {
        match self {
            Self::Planar => 3,
            Self::Spatial => 7,
        }
    }

    /// The pose that the coordinates of one body describe; a quaternion of any size will do.
    #[must_use]
    pub fn pose(self, coordinates: &[f64]) -> Pose<f64> {
        match self {
            Self::Planar => {
                Pose { position: [coordinates[0], coordinates[1], 0.0], rotation: rotation_about_z(coordinates[2]) }
            }
            Self::Spatial => self.pose_of_numbers(coordinates),
        }
    }

    /// How many numbers a recorded program keeps of one body's pose.
    #[must_use]
    pub const fn n_pose_numbers(self) -> usize {
        match self {
            Self::Planar => 4,
            Self::Spatial => 7,
        }
    }

    /// Puts those numbers one by one.
    #[inline(always)]
    pub fn put_pose_numbers(self, coordinates: &[f64], mut put: impl FnMut(f64)) {
        match self {
            Self::Planar => {
                let (sine, cosine) = coordinates[2].sin_cos();
                put(coordinates[0]);
                put(coordinates[1]);
                put(cosine);
                put(sine);
            }
            Self::Spatial => coordinates.iter().for_each(|&c| put(c)),
        }
    }

    /// The coordinates of those numbers, continued from nearby ones: over full turns in the plane, with
    /// the nearer of the two signs of the quaternion in space.
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
            Self::Spatial => {
                let (mut square, mut along) = (0.0, 0.0);
                for k in 3..7 {
                    square += number(k) * number(k);
                    along += number(k) * near[k];
                }
                let scale = (1.0 / square.sqrt()).copysign(along);
                for (k, coordinate) in coordinates.iter_mut().enumerate() {
                    *coordinate = if k < 3 { number(k) } else { scale * number(k) };
                }
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
            Self::Spatial => {
                let (w, v) = (numbers[3], [numbers[4], numbers[5], numbers[6]]);
                let factor = S::from_f64(2.0) / (w * w + dot(v, v));
                let f = scale(v, factor);
                let product = |i: usize, j: usize| f[i] * v[j];
                let turn = |i: usize| f[i] * w;
                let rotation = [
                    [l - (product(1, 1) + product(2, 2)), product(0, 1) - turn(2), product(0, 2) + turn(1)],
                    [product(0, 1) + turn(2), l - (product(0, 0) + product(2, 2)), product(1, 2) - turn(0)],
                    [product(0, 2) - turn(1), product(1, 2) + turn(0), l - (product(0, 0) + product(1, 1))],
                ];
                Pose { position: [numbers[0], numbers[1], numbers[2]], rotation }
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
            Self::Spatial => {
                let half = scale([twist[3], twist[4], twist[5]], S::from_f64(0.5));
                let (w, v) = (numbers[3], [numbers[4], numbers[5], numbers[6]]);
                let across = cross(half, v);
                let mut moved: Vec<S> = (0..3).map(|k| numbers[k] + twist[k]).collect();
                moved.push(w - dot(half, v));
                moved.extend((0..3).map(|k| v[k] + half[k] * w + across[k]));
                moved
            }
        }
    }

    /// How many numbers tell a recorded program what a body has turned since it began: the angle in the
    /// plane, the quaternion that it began with in space.
    #[must_use]
    pub const fn n_turn_numbers(self) -> usize {
        match self {
            Self::Planar => 1,
            Self::Spatial => 4,
        }
    }

    /// Puts those numbers, at the beginning, one by one.
    #[inline(always)]
    pub fn put_turn_numbers(self, coordinates: &[f64], mut put: impl FnMut(f64)) {
        match self {
            // No turn yet.
            Self::Planar => put(0.0),
            Self::Spatial => coordinates[3..].iter().for_each(|&c| put(c)),
        }
    }

    /// Those numbers after a small twist.
    pub fn move_turn_numbers<S: Real>(self, turn: &[S], twist: &[S]) -> Vec<S> {
        match self {
            Self::Planar => vec![turn[0] + twist[2]],
            Self::Spatial => turn.to_vec(),
        }
    }

    /// The rotation components that those numbers and the body's pose numbers stand for.
    pub fn turned<S: Real>(self, turn: &[S], numbers: &[S]) -> Vec<S> {
        match self {
            Self::Planar => turn.to_vec(),
            Self::Spatial => {
                // The quaternion (scalar, vector) of the rotation from the old attitude to the new one.
                let (w0, v0) = (turn[0], [turn[1], turn[2], turn[3]]);
                let (w, v) = (numbers[3], [numbers[4], numbers[5], numbers[6]]);
                let scalar = w * w0 + dot(v, v0);
                let vector = sub(sub(scale(v, w0), scale(v0, w)), cross(v, v0));
                let tangent = scale(vector, S::from_f64(1.0) / scalar);
                scale(tangent, S::double_arc(dot(tangent, tangent))).to_vec()
            }
        }
    }

    /// Velocity and rotation of a twist of one body.
    #[must_use]
    pub fn screw(self, twist: &[f64]) -> [Vec3<f64>; 2] {
        match self {
            Self::Planar => [[twist[0], twist[1], 0.0], [0.0, 0.0, twist[2]]],
            Self::Spatial => [[twist[0], twist[1], twist[2]], [twist[3], twist[4], twist[5]]],
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
            Self::Spatial => {
                let moved = self.move_numbers(coordinates, twist);
                let near = coordinates.to_vec();
                self.coordinates_of_numbers(|k| moved[k], &near, coordinates);
            }
        }
    }

    /// Coordinates, or pose numbers, of a body with its rotation as seen from another body.
    pub fn seen_from<S: Real>(self, from: &[S], own: &[S]) -> Vec<S> {
        let mut seen = own.to_vec();
        match (self, own.len()) {
            (Self::Planar, 3) => seen[2] = own[2] - from[2],
            (Self::Planar, _) => {
                let ((c0, s0), (c, s)) = ((from[2], from[3]), (own[2], own[3]));
                seen[2] = c * c0 + s * s0;
                seen[3] = s * c0 - c * s0;
            }
            (Self::Spatial, _) => {
                // The product of the other quaternion, turned round, and the own one.
                let (w0, v0) = (from[3], [from[4], from[5], from[6]]);
                let (w, v) = (own[3], [own[4], own[5], own[6]]);
                let vector = sub(sub(scale(v, w0), scale(v0, w)), cross(v0, v));
                seen[3] = w * w0 + dot(v, v0);
                seen[4..7].copy_from_slice(&vector);
            }
        }
        seen
    }

    /// The rotation components of a body's attitude: the angle in the plane, a rotation vector in space.
    #[must_use]
    pub fn attitude(self, coordinates: &[f64]) -> Vec<f64> {
        match self {
            Self::Planar => vec![coordinates[2]],
            Self::Spatial => rotation_vector(&self.pose(coordinates).rotation).to_vec(),
        }
    }

    /// What turns one attitude into another, as rotation components.
    #[must_use]
    pub fn turn_between(self, from: &[f64], to: &[f64]) -> Vec<f64> {
        match self {
            Self::Planar => vec![to[0] - from[0]],
            Self::Spatial => {
                let of = |v: &[f64]| rotation_of_vector([v[0], v[1], v[2]]);
                rotation_vector(&product(&of(to), &transposed(&of(from)))).to_vec()
            }
        }
    }

    /// The rotation of a body between two poses, as rotation components.
    #[must_use]
    pub fn turn_of_body(self, from: &[f64], to: &[f64]) -> Vec<f64> {
        match self {
            Self::Planar => vec![to[2] - from[2]],
            Self::Spatial => {
                let rotation = |c: &[f64]| self.pose(c).rotation;
                rotation_vector(&product(&rotation(to), &transposed(&rotation(from)))).to_vec()
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

    /// Turns a vector from ground axes to body axes.
    #[must_use]
    pub fn turn_back(&self, v: Vec3<S>) -> Vec3<S> {
        let r = transposed(&self.rotation);
        [dot(r[0], v), dot(r[1], v), dot(r[2], v)]
    }
}

fn rotation_about_z(angle: f64) -> Mat3<f64> {
    let (s, c) = angle.sin_cos();
    [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vector::norm;

    const BODY: [f64; 7] = [0.1, -0.2, 0.3, 0.5, -0.5, 0.1, std::f64::consts::FRAC_1_SQRT_2];
    const TWIST: [f64; 6] = [0.01, 0.02, -0.03, 0.12, -0.05, 0.08];

    #[test]
    fn a_pose_is_a_rotation_whatever_the_size_of_its_quaternion() {
        let mut large = BODY;
        large[3..].iter_mut().for_each(|q| *q *= 3.0);
        for coordinates in [BODY, large] {
            let r = Space::Spatial.pose(&coordinates).rotation;
            let square = product(&r, &transposed(&r));
            for i in 0..3 {
                for j in 0..3 {
                    assert!((square[i][j] - f64::from(u8::from(i == j))).abs() < 1e-15);
                    let other = Space::Spatial.pose(&BODY).rotation;
                    assert!((r[i][j] - other[i][j]).abs() < 1e-15);
                }
            }
            assert!((dot(cross(r[0], r[1]), r[2]) - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn a_small_twist_turns_by_itself_to_second_order() {
        for size in [1e-1, 1e-2, 1e-3] {
            let twist = TWIST.map(|t| size * t);
            let mut moved = BODY;
            Space::Spatial.retract(&mut moved, &twist);
            assert!((norm(&moved[3..]) - norm(&BODY[3..]) / norm(&BODY[3..])).abs() < 1e-15);
            let turn = Space::Spatial.turn_of_body(&BODY, &moved);
            for k in 0..3 {
                assert!((turn[k] - twist[3 + k]).abs() < 0.1 * norm(&twist[3..]).powi(3));
                assert!((moved[k] - BODY[k] - twist[k]).abs() < 1e-16);
            }
        }
    }

    #[test]
    fn recorded_numbers_tell_the_same_turn_as_the_poses() {
        for space in [Space::Planar, Space::Spatial] {
            let n = space.n_coordinates();
            let before = &BODY[..n];
            let (mut numbers, mut turn) = (Vec::new(), Vec::new());
            space.put_pose_numbers(before, |x| numbers.push(x));
            space.put_turn_numbers(before, |x| turn.push(x));
            let mut after = before.to_vec();
            for _ in 0..3 {
                let twist = &TWIST[..space.size()];
                numbers = space.move_numbers(&numbers, twist);
                turn = space.move_turn_numbers(&turn, twist);
                space.retract(&mut after, twist);
            }
            let direct = space.turn_of_body(before, &after);
            let told = space.turned(&turn, &numbers);
            assert!(direct.iter().zip(&told).all(|(a, b)| (a - b).abs() < 1e-15), "{direct:?} {told:?}");
            let mut restored = before.to_vec();
            space.coordinates_of_numbers(|k| numbers[k], before, &mut restored);
            assert!(restored.iter().zip(&after).all(|(a, b)| (a - b).abs() < 1e-15));
        }
    }
}
