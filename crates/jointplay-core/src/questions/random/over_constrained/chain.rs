//! Hit-and-run: a chain of steps, each along a random line to a random point of what the sets leave of it.
//!
//! Its law is that of the section in the limit of many steps (Smith, Oper. Res. 32, 1984, 1296).

use crate::math::lanes::simd::{Kernel, dispatch};
use crate::questions::random::over_constrained::dice::Dice;
use crate::questions::random::over_constrained::section::Section;

/// Steps of a chain, for every dimension of the section.
const STEPS_PER_DIMENSION: usize = 40;

/// A chain, compiled for every width of registers.
struct Chain<'a> {
    section: &'a Section,
    start: Vec<f64>,
    gaps: &'a [f64],
    dice: &'a mut Dice,
}

impl Kernel for Chain<'_> {
    type Output = Option<Vec<f64>>;

    #[inline(always)]
    fn run(self) -> Option<Vec<f64>> {
        let Self { section, start: mut u, gaps, dice } = self;
        let directions = &section.directions;
        let mut parts = vec![0.0; directions.dimensions];
        let mut along = vec![0.0; directions.coordinates()];
        let mut moved = u.clone();
        for _ in 0..STEPS_PER_DIMENSION * directions.dimensions {
            dice.normals(&mut parts);
            directions.combine(&parts, &mut along);
            let along = &along[..u.len()];
            let [low, high] = section.chord(gaps, &u, along);
            if !(high - low).is_finite() {
                return None;
            }
            let step = section.along_chord(&u, along, low, high, dice);
            for ((moved, u), a) in moved.iter_mut().zip(&u).zip(along) {
                *moved = u + step * a;
            }
            if section.opened.is_empty() || section.goes(gaps, &u, &moved, dice) {
                std::mem::swap(&mut u, &mut moved);
            }
        }
        Some(u)
    }
}

impl Section {
    /// A chain of hit-and-run steps from coordinates within the section.
    pub(crate) fn walk(&self, start: Vec<f64>, gaps: &[f64], dice: &mut Dice) -> Option<Vec<f64>> {
        dispatch(Chain { section: self, start, gaps, dice })
    }

    /// What the sets leave of the line `u + t along`.
    #[inline(always)]
    fn chord(&self, gaps: &[f64], u: &[f64], along: &[f64]) -> [f64; 2] {
        let mut chord = self.opened.chord(gaps, u, along);
        for (m, member) in self.members.iter().enumerate() {
            if member.is_flank {
                continue;
            }
            let [low, high] = if self.moves_whole(m) {
                let range = self.ranges[m].clone();
                member.set.chord(&u[range.clone()], &along[range])
            } else {
                let size = member.set.size();
                member.set.chord(&self.of_member(m, u)[..size], &self.of_member(m, along)[..size])
            };
            chord = [chord[0].max(low), chord[1].min(high)];
        }
        // Rounding may leave a point on the boundary just outside of it.
        [chord[0].min(0.0), chord[1].max(0.0)]
    }

    /// Whether a step is taken (Metropolis): the density along the line is that of [`Self::along_chord`] times that of
    /// the flanks.
    fn goes(&self, gaps: &[f64], from: &[f64], to: &[f64], dice: &mut Dice) -> bool {
        let gain = self.opened.log_density(gaps, to) - self.opened.log_density(gaps, from);
        dice.next_uniform() < gain.exp()
    }

    /// How far a step goes: the law's density along the line is normal, or uniform; that of the flanks is left out.
    #[inline(always)]
    fn along_chord(&self, u: &[f64], along: &[f64], low: f64, high: f64, dice: &mut Dice) -> f64 {
        let (mut curve, mut slope) = (0.0, 0.0);
        for ((precision, u), a) in self.precisions.iter().zip(u).zip(along) {
            curve += precision * a * a;
            slope += precision * a * u;
        }
        let exponent = |t: f64| -t * (slope + 0.5 * curve * t);
        let top = exponent(if curve > 0.0 { (-slope / curve).clamp(low, high) } else { 0.0 });
        loop {
            let step = low + (high - low) * dice.next_uniform();
            // Within the sets the exponent varies by a few dozen at most, and most chords are short.
            // Written so that NaN ends it.
            if !(dice.next_uniform() >= (exponent(step) - top).exp()) {
                return step;
            }
        }
    }
}
