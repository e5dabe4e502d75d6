//! Hit-and-run: a chain of steps, each along a random line to a random point of what the sets leave of it.
//!
//! Its law is that of the section in the limit of many steps (Smith, Oper. Res. 32, 1984, 1296), whatever the
//! directions are, as long as they span it. A line of few clearances ([`super::lines`]) goes far in each of them; one of
//! all clearances is stopped by the first that is near its boundary, the sooner the more there are.

use crate::clearance::offset::MAX_SIZE;
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::questions::random::over_constrained::dice::Dice;
use crate::questions::random::over_constrained::lines::{Group, Lines};
use crate::questions::random::over_constrained::section::Section;

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
        let Lines { groups, steps } = section.lines();
        let most = |size: fn(&Group) -> usize| vec![0.0; groups.iter().map(size).max().unwrap_or_default()];
        let mut parts = most(|group| group.directions.dimensions);
        let mut along = most(|group| group.directions.coordinates());
        // Where flanks open, what all coordinates do counts.
        let has_flanks = !section.opened.is_empty();
        let mut moved = u.clone();
        let mut all = vec![0.0; if has_flanks { u.len() } else { 0 }];
        for group in groups.iter().cycle().take(*steps) {
            let parts = &mut parts[..group.directions.dimensions];
            for part in parts.iter_mut() {
                *part = 2.0 * dice.next_uniform() - 1.0;
            }
            group.directions.combine(parts, &mut along);
            let mut chord = section.chord(group, &u, &along);
            if has_flanks {
                all.fill(0.0);
                group.places.iter().zip(&along).for_each(|(&j, a)| all[j] = *a);
                let [low, high] = section.opened.chord(gaps, &u, &all);
                chord = [chord[0].max(low), chord[1].min(high)];
            }
            // Rounding may leave a point on the boundary just outside of it.
            let [low, high] = [chord[0].min(0.0), chord[1].max(0.0)];
            if !(high - low).is_finite() {
                return None;
            }
            let step = section.along_chord(group, &u, &along, low, high, dice);
            if has_flanks {
                moved.copy_from_slice(&u);
            }
            let to = if has_flanks { &mut moved } else { &mut u };
            group.places.iter().zip(&along).for_each(|(&j, a)| to[j] += step * a);
            if has_flanks && section.goes(gaps, &u, &moved, dice) {
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

    /// What the sets beside flanks leave of the line `u + t along`.
    #[inline(always)]
    fn chord(&self, group: &Group, u: &[f64], along: &[f64]) -> [f64; 2] {
        let mut chord = [f64::NEG_INFINITY, f64::INFINITY];
        let mut first = 0;
        for &m in &group.members {
            let (member, range) = (&self.members[m], self.ranges[m].clone());
            let along = &along[first..first + range.len()];
            first += range.len();
            if member.is_flank {
                continue;
            }
            let [low, high] = if self.moves_whole(m) {
                member.set.chord(&u[range], along)
            } else {
                let mut own = [0.0; MAX_SIZE];
                range.zip(along).for_each(|(j, a)| own[self.places[j].k] = *a);
                let size = member.set.size();
                member.set.chord(&self.of_member(m, u)[..size], &own[..size])
            };
            chord = [chord[0].max(low), chord[1].min(high)];
        }
        chord
    }

    /// Whether a step is taken (Metropolis): the density along the line is that of [`Self::along_chord`] times that of
    /// the flanks.
    fn goes(&self, gaps: &[f64], from: &[f64], to: &[f64], dice: &mut Dice) -> bool {
        let gain = self.opened.log_density(gaps, to) - self.opened.log_density(gaps, from);
        dice.next_uniform() < gain.exp()
    }

    /// How far a step goes: the law's density along the line is normal, or uniform; that of the flanks is left out.
    #[inline(always)]
    fn along_chord(&self, group: &Group, u: &[f64], along: &[f64], low: f64, high: f64, dice: &mut Dice) -> f64 {
        let (mut curve, mut slope) = (0.0, 0.0);
        for (&j, a) in group.places.iter().zip(along) {
            let push = self.precisions[j] * a;
            curve += push * a;
            slope += push * u[j];
        }
        if curve == 0.0 {
            return low + (high - low) * dice.next_uniform();
        }
        let exponent = |t: f64| -t * (slope + 0.5 * curve * t);
        let top = exponent((-slope / curve).clamp(low, high));
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
