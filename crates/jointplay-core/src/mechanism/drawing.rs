//! What crosses the border of the core: poses, outputs and targets as they are drawn, and as the core has them.
//!
//! See [`crate::mechanism::frames`].

use std::borrow::Cow;

use crate::math::vector::{Vec3, scale};
use crate::mechanism::Mechanism;
use crate::mechanism::answer::{Answer, Values};

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
        for target in targets {
            self.move_outputs(target, scale(self.of_output(), -1.0));
        }
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
