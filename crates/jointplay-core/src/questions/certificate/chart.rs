//! Poses near a base pose, by as many coordinates as there are unknowns, and the closure equations in them.
//!
//! A body's coordinates v are the translation of its origin and, in the plane, its turn; in space the vector of the
//! quaternion `(1, v / 2)` by which it turns. The twist that goes with a rate of v is then
//!
//! ```text
//! w = (v' + v x v' / 2) / (1 + v . v / 4)
//! ```
//!
//! The equations and their derivatives are those of [`crate::closure::equations`], run on intervals.

use crate::closure::equations::Inputs;
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

/// A matrix by its entries (row, column, value) other than zero.
pub(super) type Entries = Vec<(usize, usize, Interval)>;

/// The poses of a box of coordinates.
pub(super) struct Poses {
    /// What [`Space::pose_of_numbers`] takes, body by body.
    pub numbers: Vec<Vec<Interval>>,
    /// In the plane the angle of every body.
    pub angles: Vec<Interval>,
    pub poses: Vec<Pose<Interval>>,
}

/// Derivatives of the closure equations over a box of poses and of parameters.
pub(super) struct Equations {
    /// Along the coordinates of the bodies.
    pub along_poses: Entries,
    /// Along the parameters, with the opposite sign.
    pub along_parameters: Entries,
}

impl<'m> Chart<'m> {
    /// About the poses of given coordinates.
    pub fn new(mechanism: &'m Mechanism, drives: &[f64], base: &[f64]) -> Self {
        Self { mechanism, drives: drives.to_vec(), base: base.to_vec() }
    }

    pub fn poses(&self, v: &[Interval]) -> Poses {
        let m = self.mechanism;
        let bodies = self.base.chunks_exact(m.n_body_coordinates()).zip(v.chunks_exact(m.size()));
        let (mut numbers, mut angles) = (Vec::new(), Vec::new());
        for (base, v) in bodies {
            let base: Vec<Interval> = base.iter().map(|&x| Interval::from_f64(x)).collect();
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
        let poses = numbers.iter().map(|numbers| m.space.pose_of_numbers(numbers)).collect();
        Poses { numbers, angles, poses }
    }

    /// Residuals and derivatives of the rows along the twists of their bodies.
    fn rows(&self, poses: &Poses, parameters: &[Interval]) -> [Vec<Interval>; 2] {
        let m = self.mechanism;
        let mut residual = vec![Interval::ZERO; m.n_rows()];
        let mut derivatives = vec![Interval::ZERO; 2 * m.size() * m.n_rows()];
        let drives: Vec<Interval> = self.drives.iter().map(|&q| Interval::from_f64(q)).collect();
        let inputs = m.commands(&drives, parameters.to_vec());
        m.evaluate(&poses.poses, &inputs, &mut residual, &mut derivatives);
        [residual, derivatives]
    }

    /// What the rows are off by.
    pub fn residual(&self, poses: &Poses, parameters: &[Interval]) -> Vec<Interval> {
        let [residual, _] = self.rows(poses, parameters);
        residual
    }

    /// The equations at all poses and parameters of a box.
    pub fn equations(&self, v: &[Interval], poses: &Poses, parameters: &[Interval]) -> Equations {
        let m = self.mechanism;
        let size = m.size();
        let [_, derivatives] = self.rows(poses, parameters);
        let mut along_poses = Vec::new();
        for (side, part) in derivatives.chunks_exact(size).enumerate() {
            let Some(body) = m.row_bodies(side / 2)[side % 2] else { continue };
            let entries = self.along_body(part, &v[body * size..(body + 1) * size]);
            let entries = entries.into_iter().enumerate().filter(|(_, entry)| !entry.is_zero());
            along_poses.extend(entries.map(|(c, entry)| (side / 2, body * size + c, entry)));
        }
        let mut along_parameters = Vec::new();
        let mut gradient = Inputs {
            drives: vec![Interval::ZERO; m.n_drives()],
            parameters: vec![Interval::ZERO; m.n_parameters()],
        };
        for (k, row) in m.rows.iter().enumerate() {
            m.pull_row_back(row, &poses.poses, parameters, Interval::ONE, &mut gradient);
            for (p, slot) in gradient.parameters.iter_mut().enumerate().filter(|(_, slot)| !slot.is_zero()) {
                along_parameters.push((k, p, std::mem::replace(slot, Interval::ZERO)));
            }
        }
        Equations { along_poses, along_parameters }
    }

    /// What is given along the twist of a body, along its coordinates.
    pub fn along_body(&self, twist: &[Interval], v: &[Interval]) -> Vec<Interval> {
        match self.mechanism.space {
            Space::Planar => twist.to_vec(),
            Space::Spatial => {
                let [w, v]: [Vec3<Interval>; 2] = [twist, v].map(|part| [part[3], part[4], part[5]]);
                let factor = Interval::ONE / (Interval::ONE + square(v).scaled(0.25));
                let turned = scale(add(w, scale(cross(w, v), Interval::from_f64(0.5))), factor);
                [&twist[..3], &turned].concat()
            }
        }
    }

    /// Position of the output's point.
    pub fn place(&self, poses: &Poses, parameters: &[Interval]) -> Vec3<Interval> {
        self.mechanism.output_place(&poses.poses, parameters)
    }

    /// What the output's body has turned from other poses, in the coordinates of rotations.
    pub fn turned(&self, from: &Poses, to: &Poses) -> Vec<Interval> {
        let m = self.mechanism;
        let still = vec![Interval::ZERO; m.size() - m.n_translations()];
        let Some(body) = m.points[m.output].body else { return still };
        match m.space {
            Space::Planar => {
                let angle = |poses: &Poses| {
                    m.seen_from.map_or(poses.angles[body], |other| poses.angles[body] - poses.angles[other])
                };
                vec![angle(to) - angle(from)]
            }
            Space::Spatial => {
                let attitude = |poses: &Poses| {
                    let own = &poses.numbers[body];
                    m.seen_from.map_or_else(|| own.clone(), |other| m.space.seen_from(&poses.numbers[other], own))
                };
                m.space.turned(&attitude(from)[3..], &attitude(to))
            }
        }
    }
}

/// The square of a vector's length.
pub(super) fn square(v: Vec3<Interval>) -> Interval {
    v.iter().fold(Interval::ZERO, |sum, x| sum + x.square())
}

/// The rates of a rotation vector in a box for angular velocities: the inverse of the left Jacobian of the exponential
/// map, `w - v x w / 2 + c v x (v x w)` with `c = (1 - (a / 2) cot(a / 2)) / a^2`, a = |v|. It grows from 1 / 12 to
/// 0.0848 at one radian.
pub(super) fn rate_of_vector(v: Vec3<Interval>, w: Vec3<Interval>) -> Vec3<Interval> {
    let c = if square(v).high <= 1.0 { Interval::new(0.0833, 0.0848) } else { Interval::LINE };
    let across = cross(v, w);
    // v x (v x w) = v (v . w) - w (v . v)
    let twice = add(scale(v, dot(v, w)), scale(w, -square(v)));
    add(add(w, scale(across, Interval::from_f64(-0.5))), scale(twice, c))
}
