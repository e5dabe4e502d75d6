//! Where the core has the origins of bodies and of the ground.
//!
//! A mechanism may be drawn anywhere: ground and bodies carry their axes wherever it pleases. A body that turns about a
//! pin far from its origin would move that origin by far more than its joints, and in circles; steps, tolerances and
//! singular values would depend on the drawing. Where an origin lies farther than [`FAR`] characteristic lengths from all
//! joints of its body, the core takes their middle c in its place (g on the ground):
//!
//! ```text
//! at -> at - c,    position -> position + R c - g
//! ```
//!
//! Poses, outputs and targets that cross its border are those of the drawing; twists are of the bodies as they are in here.

use crate::math::space::Space;
use crate::math::vector::{Vec3, add, norm, scale, sub};
use crate::mechanism::kind::JointKind as Kind;
use crate::mechanism::spec::Spec;

/// How many characteristic lengths an origin may be from the nearest joint of its body.
const FAR: f64 = 8.0;

/// Where the origins are, in the axes of the drawing.
#[derive(Clone, Debug)]
pub(crate) struct Frames {
    space: Space,
    ground: Vec3<f64>,
    pub bodies: Vec<Vec3<f64>>,
}

impl Frames {
    /// Of a mechanism as it is drawn.
    pub fn new(spec: &Spec) -> Self {
        let origin = |body: Option<usize>| {
            let is_own =
                |point: &&usize| spec.points.get(**point).is_some_and(|at| usize::try_from(at.body).ok() == body);
            // What commands the output of a map is no joint of the machine, whose bodies must have the same origins.
            let joints = spec.joints.iter().filter(|joint| !matches!(joint.kind, Kind::Target | Kind::Orientation));
            let ends: Vec<usize> = joints.flat_map(|joint| [joint.first, joint.second]).collect();
            let places: Vec<Vec3<f64>> = ends.iter().filter(is_own).map(|&point| spec.points[point].at).collect();
            let nearest = places.iter().fold(f64::INFINITY, |least, at| least.min(norm(at)));
            // Written so that what is not finite stays where it is.
            if nearest > FAR * spec.length && nearest.is_finite() {
                let sum = places.iter().fold([0.0; 3], |sum, at| add(sum, *at));
                scale(sum, 1.0 / places.len() as f64)
            } else {
                [0.0; 3]
            }
        };
        Self { space: spec.space, ground: origin(None), bodies: (0..spec.n_bodies).map(|b| origin(Some(b))).collect() }
    }

    /// The origin of a body, or of the ground.
    pub fn of(&self, body: Option<usize>) -> Vec3<f64> {
        body.map_or(self.ground, |b| self.bodies[b])
    }

    /// The guess of a drawing as the core has it, body after body.
    pub fn guess(&self, spec: &Spec) -> Vec<Vec<f64>> {
        let mut guess = spec.guess.concat();
        self.shift(&mut guess, false);
        guess.chunks_exact(self.space.n_coordinates()).map(<[f64]>::to_vec).collect()
    }

    /// Whether all of them are where they are drawn.
    pub fn are_drawn(&self) -> bool {
        self.bodies.iter().chain([&self.ground]).all(|origin| *origin == [0.0; 3])
    }

    /// Coordinates of all bodies, one pose after the other, with their origins moved there, or back.
    pub fn shift(&self, coordinates: &mut [f64], back: bool) {
        let width = self.space.n_coordinates();
        if self.are_drawn() || self.bodies.is_empty() {
            return;
        }
        let n = if self.space == Space::Planar { 2 } else { 3 };
        for coordinates in coordinates.chunks_exact_mut(self.bodies.len() * width) {
            for (own, origin) in coordinates.chunks_exact_mut(width).zip(&self.bodies) {
                let pose = self.space.pose(own);
                let arm = pose.turn(*origin);
                let moved = if back {
                    add(pose.position, sub(self.ground, arm))
                } else {
                    add(sub(pose.position, self.ground), arm)
                };
                own[..n].copy_from_slice(&moved[..n]);
            }
        }
    }
}
