//! Poses near a base pose, by as many coordinates as there are unknowns, and the closure equations in them.
//!
//! A body's coordinates v are the translation of its origin and, in the plane, its turn; in space the vector of the
//! quaternion `(1, v / 2)` by which it turns. The twist that goes with a rate of v is then
//!
//! ```text
//! w = (v' + v x v' / 2) / (1 + v . v / 4)
//! ```
//!
//! The equations and their derivatives are those of [`crate::closure::equations`], run on intervals and on affine forms.

use crate::closure::equations::Inputs;
use crate::math::affine::Form;
use crate::math::interval::Interval;
use crate::math::real::Real;
use crate::math::space::{Pose, Space};
use crate::math::vector::{Vec3, add, cross, dot, scale};
use crate::mechanism::Mechanism;

/// Poses about a base.
pub(super) struct Chart<'m> {
    pub mechanism: &'m Mechanism,
    pub drives: Vec<f64>,
    base: Vec<f64>,
}

/// A matrix by its entries: row, column, value.
pub(super) type Entries<S> = Vec<(usize, usize, S)>;

/// The poses of coordinates.
pub(super) struct Poses<S> {
    /// What [`Space::pose_of_numbers`] takes, body by body.
    pub numbers: Vec<Vec<S>>,
    /// In the plane the angle of every body.
    pub angles: Vec<S>,
    pub bodies: Vec<Pose<S>>,
}

impl<S: Real> Poses<S> {
    /// The same as other numbers.
    pub fn map<T: Real>(&self, of: impl Fn(S) -> T + Copy) -> Poses<T> {
        let pose =
            |pose: &Pose<S>| Pose { position: pose.position.map(of), rotation: pose.rotation.map(|row| row.map(of)) };
        Poses {
            numbers: self.numbers.iter().map(|numbers| numbers.iter().map(|&x| of(x)).collect()).collect(),
            angles: self.angles.iter().map(|&x| of(x)).collect(),
            bodies: self.bodies.iter().map(pose).collect(),
        }
    }
}

/// Derivatives of the closure equations at poses and parameters.
pub(super) struct Equations<S> {
    /// Derivatives along the coordinates of the bodies.
    pub along_poses: Entries<S>,
    /// Derivatives along the parameters, with the opposite sign.
    pub along_parameters: Entries<S>,
}

impl<'m> Chart<'m> {
    /// About the poses of given coordinates.
    pub fn new(mechanism: &'m Mechanism, drives: &[f64], base: &[f64]) -> Self {
        Self { mechanism, drives: drives.to_vec(), base: base.to_vec() }
    }

    pub fn poses<S: Real>(&self, v: &[S]) -> Poses<S> {
        let m = self.mechanism;
        let bodies = self.base.chunks_exact(m.n_body_coordinates()).zip(v.chunks_exact(m.size()));
        let (mut numbers, mut angles) = (Vec::new(), Vec::new());
        for (base, v) in bodies {
            let base: Vec<S> = base.iter().map(|&x| S::from_f64(x)).collect();
            match m.space {
                // One angle has one sine and cosine; those of the base, rounded, would not be a rotation.
                Space::Planar => {
                    let angle = base[2] + v[2];
                    let (sine, cosine) = angle.sin_cos();
                    numbers.push(vec![base[0] + v[0], base[1] + v[1], cosine, sine]);
                    angles.push(angle);
                }
                Space::Spatial => numbers.push(m.space.move_numbers(&base, v)),
            }
        }
        let bodies = numbers.iter().map(|numbers| m.space.pose_of_numbers(numbers)).collect();
        Poses { numbers, angles, bodies }
    }

    /// Residuals and derivatives of the rows along the twists of their bodies.
    fn rows<S: Real>(&self, poses: &Poses<S>, parameters: &[S]) -> [Vec<S>; 2] {
        let m = self.mechanism;
        let zero = S::from_f64(0.0);
        let mut residual = vec![zero; m.n_rows()];
        let mut derivatives = vec![zero; m.n_derivatives()];
        let drives: Vec<S> = self.drives.iter().map(|&q| S::from_f64(q)).collect();
        let inputs = m.commands(&drives, parameters.to_vec());
        m.evaluate(&poses.bodies, &inputs, &mut residual, &mut derivatives);
        [residual, derivatives]
    }

    /// What the rows are off by.
    pub fn residual<S: Real>(&self, poses: &Poses<S>, parameters: &[S]) -> Vec<S> {
        let [residual, _] = self.rows(poses, parameters);
        residual
    }

    /// The derivatives, in which `is_zero` tells what is left out.
    pub fn equations<S: Real>(
        &self,
        v: &[S],
        poses: &Poses<S>,
        parameters: &[S],
        is_zero: impl Fn(S) -> bool,
    ) -> Equations<S> {
        let m = self.mechanism;
        let (size, zero) = (m.size(), S::from_f64(0.0));
        let [_, derivatives] = self.rows(poses, parameters);
        let mut along_poses = Vec::new();
        for (side, part) in derivatives.chunks_exact(size).enumerate() {
            let (row, side) = (side / m.n_sides, side % m.n_sides);
            let Some(body) = m.row_bodies(row)[side] else { continue };
            let entries = self.along_body(part, &v[body * size..(body + 1) * size]);
            let entries = entries.into_iter().enumerate().filter(|(_, entry)| !is_zero(*entry));
            along_poses.extend(entries.map(|(c, entry)| (row, body * size + c, entry)));
        }
        let mut along_parameters = Vec::new();
        let mut gradient = Inputs { drives: vec![zero; m.n_drives()], parameters: vec![zero; m.n_parameters()] };
        for (k, row) in m.rows.iter().enumerate() {
            m.pull_row_back(row, &poses.bodies, parameters, S::from_f64(1.0), &mut gradient);
            for (p, slot) in gradient.parameters.iter_mut().enumerate().filter(|(_, slot)| !is_zero(**slot)) {
                along_parameters.push((k, p, std::mem::replace(slot, zero)));
            }
        }
        Equations { along_poses, along_parameters }
    }

    /// What is given along the twist of a body, along its coordinates.
    pub fn along_body<S: Real>(&self, twist: &[S], v: &[S]) -> Vec<S> {
        match self.mechanism.space {
            Space::Planar => twist.to_vec(),
            Space::Spatial => {
                let [w, v]: [Vec3<S>; 2] = [twist, v].map(|part| [part[3], part[4], part[5]]);
                let [one, half, quarter] = [1.0, 0.5, 0.25].map(S::from_f64);
                let factor = one / (one + quarter * dot(v, v));
                let turned = scale(add(w, scale(cross(w, v), half)), factor);
                [&twist[..3], &turned].concat()
            }
        }
    }

    /// Position of the output's point.
    pub fn place<S: Real>(&self, poses: &Poses<S>, parameters: &[S]) -> Vec3<S> {
        self.mechanism.output_place(&poses.bodies, parameters)
    }

    /// What the output's body has turned from other poses, in the coordinates of rotations.
    pub fn turned<S: Real>(&self, from: &Poses<S>, to: &Poses<S>) -> Vec<S> {
        let m = self.mechanism;
        let still = vec![S::from_f64(0.0); m.size() - m.n_translations()];
        let Some(body) = m.points[m.output].body else { return still };
        match m.space {
            Space::Planar => {
                let angle = |poses: &Poses<S>| {
                    m.seen_from.map_or(poses.angles[body], |other| poses.angles[body] - poses.angles[other])
                };
                vec![angle(to) - angle(from)]
            }
            Space::Spatial => {
                let attitude = |poses: &Poses<S>| {
                    let own = &poses.numbers[body];
                    m.seen_from.map_or_else(|| own.clone(), |other| m.space.seen_from(&poses.numbers[other], own))
                };
                m.space.turned(&attitude(from)[3..], &attitude(to))
            }
        }
    }
}

/// The rates of a rotation vector v for angular velocities w: the inverse of the left Jacobian of the exponential map,
/// `w - v x w / 2 + c v x (v x w)` with `c = (1 - (a / 2) cot(a / 2)) / a^2`, a = |v|. It grows from 1 / 12 to 0.0848 at
/// one radian.
pub(super) fn rate_of_vector<'f>(v: Vec3<Form<'f>>, w: Vec3<Form<'f>>) -> Vec3<Form<'f>> {
    let square = v.iter().fold(Interval::ZERO, |sum, x| sum + x.range().square());
    let c = if square.high <= 1.0 { Interval::new(0.0833, 0.0848) } else { Interval::LINE };
    let across = cross(v, w);
    let [half, c] = [Interval::from_f64(-0.5), c].map(Form::Constant);
    add(add(w, scale(across, half)), scale(cross(v, across), c))
}
