//! Hit-and-run: a chain of steps, each along a random line to a random point of what the sets leave of it.
//!
//! Its law is that of the section in the limit of many steps (Smith, Oper. Res. 32, 1984, 1296).

use crate::questions::random::over_constrained::dice::Dice;
use crate::questions::random::over_constrained::section::Section;

/// Steps of a chain, for every dimension of the section.
const STEPS_PER_DIMENSION: usize = 40;

impl Section {
    /// A chain of hit-and-run steps from coordinates within the section.
    pub(crate) fn walk(&self, start: Vec<f64>, gaps: &[f64], dice: &mut Dice) -> Option<Vec<f64>> {
        let mut u = start;
        let dimensions = self.directions.ncols();
        let (mut along, mut moved) = (vec![0.0; u.len()], vec![0.0; u.len()]);
        for _ in 0..STEPS_PER_DIMENSION * dimensions {
            along.fill(0.0);
            for column in self.directions.column_iter() {
                let part = dice.next_normal();
                along.iter_mut().zip(column.iter()).for_each(|(a, d)| *a += part * d);
            }
            let mut chord = self.opened.chord(gaps, &u, &along);
            for ((m, at), (_, by)) in self.each_member(&u).zip(self.each_member(&along)) {
                if self.members[m].is_flank {
                    continue;
                }
                let set = &self.members[m].set;
                let [low, high] = set.chord(&at[..set.size()], &by[..set.size()]);
                chord = [chord[0].max(low), chord[1].min(high)];
            }
            // Rounding may leave a point on the boundary just outside of it.
            let [low, high] = [chord[0].min(0.0), chord[1].max(0.0)];
            if !(high - low).is_finite() {
                return None;
            }
            let step = self.along_chord(&u, &along, low, high, dice);
            for ((moved, u), a) in moved.iter_mut().zip(&u).zip(&along) {
                *moved = u + step * a;
            }
            if self.opened.is_empty() || self.goes(gaps, &u, &moved, dice) {
                std::mem::swap(&mut u, &mut moved);
            }
        }
        Some(u)
    }

    /// Whether a step is taken (Metropolis): the density along the line is that of [`Self::along_chord`] times that of
    /// the flanks.
    fn goes(&self, gaps: &[f64], from: &[f64], to: &[f64], dice: &mut Dice) -> bool {
        let gain = self.opened.log_density(gaps, to) - self.opened.log_density(gaps, from);
        dice.next_uniform() < gain.exp()
    }

    /// How far a step goes: the law's density along the line is normal, or uniform; that of the flanks is left out.
    fn along_chord(&self, u: &[f64], along: &[f64], low: f64, high: f64, dice: &mut Dice) -> f64 {
        let (mut curve, mut slope) = (0.0, 0.0);
        for ((place, u), a) in self.places.iter().zip(u).zip(along) {
            if self.members[place.member].is_flank {
                continue;
            }
            curve += place.precision * a * a;
            slope += place.precision * a * u;
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
