//! Wheels and shafts that turn in bearings of their own, and the first step of a way on which they turn fast.
//!
//! Newton's first step moves every body by a small twist, which holds for a part of a turn only, and teeth repeat. Here the
//! bodies move joint by joint along a spanning tree: each goes with the body inside and, beyond that, along the screw of its
//! own twist relative to it,
//!
//! ```text
//! D(outer) = D(inner) exp(twist of outer - twist of inner)
//! ```
//!
//! with the displacements D in ground axes and twists taken at their origin (Murray, Li, Sastry, A Mathematical Introduction
//! to Robotic Manipulation, 1994, chapter 2). A wheel in its bearing so turns any number of times on its axis; and since
//! teeth tie angles linearly where axes keep their places, a train of them is closed by that step.

use crate::math::space::{Component, Space};
use crate::math::vector::{Vec3, add, cross, dot, scale, sub};
use crate::mechanism::{Mechanism, Row};

/// The bodies of a mechanism with couplings that turn.
#[derive(Clone, Debug)]
pub(crate) struct Train {
    /// Bodies from the ground outwards, each with the one inside.
    tree: Vec<(usize, Option<usize>)>,
    /// Bodies that do nothing but turn in one bearing, and mesh.
    spins: Vec<bool>,
}

/// A displacement of a body in ground axes: a quaternion and where the origin goes.
#[derive(Clone, Copy)]
struct Displacement {
    scalar: f64,
    vector: Vec3<f64>,
    shift: Vec3<f64>,
}

impl Displacement {
    const NONE: Self = Self { scalar: 1.0, vector: [0.0; 3], shift: [0.0; 3] };

    /// Along a screw, with the velocity at the origin.
    fn along(velocity: Vec3<f64>, rotation: Vec3<f64>) -> Self {
        let angle = dot(rotation, rotation).sqrt();
        let (sine, cosine) = (0.5 * angle).sin_cos();
        let (half, bend, lag) = if angle > 1e-4 {
            (sine / angle, (1.0 - angle.cos()) / (angle * angle), (angle - angle.sin()) / angle.powi(3))
        } else {
            (0.5, 0.5, 1.0 / 6.0)
        };
        let across = cross(rotation, velocity);
        let shift = add(velocity, add(scale(across, bend), scale(cross(rotation, across), lag)));
        Self { scalar: cosine, vector: scale(rotation, half), shift }
    }

    fn turn(&self, v: Vec3<f64>) -> Vec3<f64> {
        let across = scale(cross(self.vector, v), 2.0);
        add(v, add(scale(across, self.scalar), cross(self.vector, across)))
    }

    /// Scalar and vector of the product of its quaternion and another one.
    fn times(&self, scalar: f64, vector: Vec3<f64>) -> (f64, Vec3<f64>) {
        let sum = add(scale(vector, self.scalar), scale(self.vector, scalar));
        (self.scalar * scalar - dot(self.vector, vector), add(sum, cross(self.vector, vector)))
    }

    /// This one after another one.
    fn after(&self, first: &Self) -> Self {
        let (scalar, vector) = self.times(first.scalar, first.vector);
        Self { scalar, vector, shift: add(self.turn(first.shift), self.shift) }
    }
}

impl Train {
    /// `None` where nothing spins.
    pub fn new(m: &Mechanism) -> Option<Self> {
        if !m.rows.iter().any(|row| row.is_coupled) {
            return None;
        }
        let ends = |joint: usize| [m.joints[joint].first, m.joints[joint].second].map(|p| m.points[p].body);
        let held = |joint: usize| m.rows.iter().filter(move |row| row.joint == joint && !row.is_coupled);
        let joints: Vec<usize> = (0..m.n_joints()).filter(|&j| held(j).next().is_some()).collect();
        let is_bearing = |joint: usize| {
            let components = m.space.components();
            let mut free =
                components.iter().filter(|c| !held(joint).any(|row| row.drive.is_none() && row.component == **c));
            matches!((free.next(), free.next()), (Some(Component::About(_)), None))
        };
        let spins = |b: usize| {
            let mut of = joints.iter().filter(|&&j| ends(j).contains(&Some(b)));
            matches!((of.next(), of.next()), (Some(&joint), None) if is_bearing(joint))
        };
        let spins: Vec<bool> = (0..m.n_bodies()).map(spins).collect();
        if !spins.contains(&true) {
            return None;
        }
        let (mut tree, mut reached, mut next) = (Vec::new(), vec![None], 0);
        while next < reached.len() {
            let inner: Option<usize> = reached[next];
            next += 1;
            for &joint in &joints {
                let [first, second] = ends(joint);
                for outer in
                    [(first, second), (second, first)].into_iter().filter(|ends| ends.0 == inner).filter_map(|e| e.1)
                {
                    if !reached.contains(&Some(outer)) {
                        reached.push(Some(outer));
                        tree.push((outer, inner));
                    }
                }
            }
        }
        (tree.len() == m.n_bodies()).then_some(Self { tree, spins })
    }

    /// Whether the joint of a row is the bearing of a body that spins.
    pub fn is_bearing(&self, m: &Mechanism, row: &Row) -> bool {
        let joint = &m.joints[row.joint];
        [joint.first, joint.second].iter().any(|&p| m.points[p].body.is_some_and(|b| self.spins[b]))
    }

    /// Size of a twist of all bodies that do more than spin.
    pub fn size(&self, m: &Mechanism, twists: &[f64]) -> f64 {
        let bodies = twists.chunks_exact(m.size()).zip(&self.spins).filter(|(_, spins)| !**spins);
        m.scaled_size(&bodies.flat_map(|(twist, _)| twist).copied().collect::<Vec<f64>>())
    }

    /// The coordinates of all bodies after their twists.
    pub fn moved(&self, m: &Mechanism, coordinates: &[f64], twists: &[f64]) -> Vec<f64> {
        let width = m.space.n_coordinates();
        let position = |b: usize| match m.space {
            Space::Planar => [coordinates[b * width], coordinates[b * width + 1], 0.0],
            Space::Spatial => [0, 1, 2].map(|k| coordinates[b * width + k]),
        };
        let screw = |body: Option<usize>| {
            let Some(b) = body else { return [[0.0; 3]; 2] };
            let [velocity, rotation] = m.space.screw(&twists[b * m.size()..(b + 1) * m.size()]);
            [sub(velocity, cross(rotation, position(b))), rotation]
        };
        let mut moved = coordinates.to_vec();
        let mut displacements = vec![Displacement::NONE; m.n_bodies()];
        for &(outer, inner) in &self.tree {
            let ([velocity, rotation], [v, w]) = (screw(Some(outer)), screw(inner));
            let own = Displacement::along(sub(velocity, v), sub(rotation, w));
            let whole = inner.map_or(own, |inner| displacements[inner].after(&own));
            displacements[outer] = whole;
            let to = &mut moved[outer * width..(outer + 1) * width];
            let at = add(whole.turn(position(outer)), whole.shift);
            match m.space {
                Space::Planar => {
                    to[..2].copy_from_slice(&at[..2]);
                    to[2] += rotation[2];
                }
                Space::Spatial => {
                    let (scalar, vector) = whole.times(to[3], [to[4], to[5], to[6]]);
                    to[..3].copy_from_slice(&at);
                    to[3] = scalar;
                    to[4..].copy_from_slice(&vector);
                }
            }
        }
        moved
    }
}
