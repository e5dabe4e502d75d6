//! Where the core has the origins of bodies and of the ground.
//!
//! A mechanism may be drawn anywhere: ground and bodies carry their axes wherever it pleases. A body that turns about a
//! pin far from its origin would move that origin by far more than its joints, and in circles; steps, tolerances and
//! singular values would depend on the drawing. Where an origin lies farther than [`FAR`] characteristic lengths from the
//! first joint of its body, the core takes the place c of that joint in its stead (g on the ground):
//!
//! ```text
//! at -> at - c,    position -> position + R c - g
//! ```
//!
//! Poses, outputs and targets that cross its border are those of the drawing; twists are of the bodies as they are in here.

use crate::math::space::Space;
use crate::math::vector::{Vec3, add, norm, sub};
use crate::mechanism::spec::Spec;

/// How many characteristic lengths an origin may be from the first joint of its body.
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
            let ends = spec.joints.iter().flat_map(|joint| [joint.first, joint.second]);
            let mut own = ends.filter_map(|point| spec.points.get(point));
            let first = own.find(|point| usize::try_from(point.body).ok() == body);
            let at = first.map_or([0.0; 3], |point| point.at);
            let far = norm(&at);
            // What is not finite stays where it is.
            if far.is_finite() && far > FAR * spec.length { at } else { [0.0; 3] }
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
        self.bodies.iter().chain([&self.ground]).flatten().all(|x| *x == 0.0)
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
