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

use std::borrow::Cow;

use crate::math::space::Space;
use crate::math::vector::{Vec3, add, norm, scale, sub};
use crate::mechanism::answer::{Answer, Values};
use crate::mechanism::spec::Spec;
use crate::mechanism::{Body, Mechanism};

/// How many characteristic lengths an origin may be from the nearest joint of its body.
const FAR: f64 = 8.0;

/// Where the origins are, in the axes of the drawing.
#[derive(Clone, Debug)]
pub(crate) struct Frames {
    space: Space,
    ground: Vec3<f64>,
    bodies: Vec<Vec3<f64>>,
}

impl Frames {
    /// Of a mechanism as it is drawn.
    pub fn new(spec: &Spec) -> Self {
        let origin = |body: Body| {
            let is_own =
                |point: &&usize| spec.points.get(**point).is_some_and(|at| usize::try_from(at.body).ok() == body);
            let ends: Vec<usize> = spec.joints.iter().flat_map(|joint| [joint.first, joint.second]).collect();
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
    pub fn of(&self, body: Body) -> Vec3<f64> {
        body.map_or(self.ground, |b| self.bodies[b])
    }

    /// The guess of a drawing as the core has it, body after body.
    pub fn guess(&self, spec: &Spec) -> Vec<Vec<f64>> {
        let mut guess = spec.guess.concat();
        self.shift(&mut guess, false);
        guess.chunks_exact(self.space.n_coordinates()).map(<[f64]>::to_vec).collect()
    }

    /// Whether all of them are where they are drawn.
    fn are_drawn(&self) -> bool {
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

impl Mechanism {
    /// The origin of every body that twists are taken at, in the body's axes as they are drawn.
    #[must_use]
    pub fn origins(&self) -> Vec<Vec3<f64>> {
        self.frames.bodies.clone()
    }

    /// Coordinates of the drawing, one pose of all bodies after the other, as the core has them.
    #[must_use]
    pub fn inside<'a>(&self, mut coordinates: Cow<'a, [f64]>) -> Cow<'a, [f64]> {
        if !self.frames.are_drawn() {
            self.frames.shift(coordinates.to_mut(), false);
        }
        coordinates
    }

    /// Coordinates of the core as they are drawn.
    #[must_use]
    pub fn outside(&self, mut coordinates: Vec<f64>) -> Vec<f64> {
        self.frames.shift(&mut coordinates, true);
        coordinates
    }

    /// What lies between the places of the output here and in the drawing, in the axes in which it is measured.
    fn of_output(&self) -> Vec3<f64> {
        self.frames.of(self.seen_from)
    }

    fn move_outputs(&self, outputs: &mut [f64], by: Vec3<f64>) {
        for output in outputs.chunks_exact_mut(self.size()) {
            output.iter_mut().zip(by).take(self.n_translations()).for_each(|(x, by)| *x += by);
        }
    }

    /// Poses of the output, one after the other, as they are drawn.
    #[must_use]
    pub fn outputs_outside(&self, mut outputs: Vec<f64>) -> Vec<f64> {
        self.move_outputs(&mut outputs, self.of_output());
        outputs
    }

    /// Targets of the output as the core has them.
    pub fn targets_inside(&self, targets: &mut [Vec<f64>]) {
        targets.iter_mut().for_each(|target| self.move_outputs(target, scale(self.of_output(), -1.0)));
    }

    /// An answer with poses and outputs as they are drawn.
    #[must_use]
    pub fn answer_outside(&self, mut answer: Answer) -> Answer {
        for column in &mut answer.columns {
            match (column.name, &mut column.values) {
                ("poses", Values::Numbers(values)) => self.frames.shift(values, true),
                ("output", Values::Numbers(values)) => self.move_outputs(values, self.of_output()),
                _ => {}
            }
        }
        answer
    }
}
