//! Anderson's acceleration of whole steps to the support points, for blocks of configurations.
//!
//! A whole step takes offsets u to the support points g(u) of the forces at their pose. Where a force nearly
//! vanishes its direction changes much with u, and whole steps creep: `f = g(u) - u` shrinks by the same factor
//! again and again. Two differences of f and g along the steps made tell that factor, so that the next offsets are
//! where f, if it were linear, would be smallest (Walker and Ni, SIAM J. Numer. Anal. 49, 2011, 1715):
//!
//! ```text
//! u' = g - A c,  c = argmin |f - D c|
//! ```
//!
//! with the differences D of f and A of g. Offsets at which f vanishes are the same as of whole steps. Where these lead
//! away from such a place, none of it is used.

use crate::math::lanes::block::{Block, LANES, bits_if, select};
use crate::mechanism::Mechanism;

/// Contacts have found their sides where no offset changes by more than this part of its set.
const NEAR: f64 = 0.1;
/// A difference counts where it has at least this part of itself, squared, that the one after it has not.
const INDEPENDENT: f64 = 1e-8;

/// What is known of the steps made.
pub(crate) struct Mixing {
    /// Parameters that the load moves, with the inverse size of their set.
    moving: Vec<(usize, f64)>,
    /// Of every moving parameter, as parts of its set: f and g, and their differences, the last one and the one before.
    last: Vec<[Block; 2]>,
    differences: [Vec<[Block; 2]>; 2],
    /// Whether no step has been made yet.
    is_new: bool,
    /// Norm of f before, squared; infinite where nothing is known.
    size: Block,
    /// Whether a lane has been at offsets other than of whole steps.
    pub mixed: [bool; LANES],
}

/// A whole step that has not been made yet.
pub(crate) struct Wanted {
    /// Largest component of f.
    pub changed: Block,
    /// Norm of f, squared.
    size: Block,
    /// Inner products of the differences a and b of f, the last one and the one before, with one another and with f, and
    /// of a with that of g.
    aa: Block,
    ab: Block,
    bb: Block,
    af: Block,
    bf: Block,
    ag: Block,
}

impl Mixing {
    pub fn new(m: &Mechanism) -> Self {
        let gives_way = m.sources().iter().filter(|source| source.is_clearance && !source.set.is_zero());
        let moving = gives_way.flat_map(|source| {
            let size = |p: usize| source.set.half_width(p - source.first);
            source.range().filter(move |&p| size(p) > 0.0).map(move |p| (p, 1.0 / size(p)))
        });
        Self::of(moving.collect())
    }

    fn of(moving: Vec<(usize, f64)>) -> Self {
        let none = vec![[Block::splat(0.0); 2]; moving.len()];
        Self {
            moving,
            last: none.clone(),
            differences: [none.clone(), none],
            is_new: true,
            size: Block::splat(f64::INFINITY),
            mixed: [false; LANES],
        }
    }

    /// Forgets all steps.
    pub fn begin(&mut self) {
        self.is_new = true;
        self.size = Block::splat(f64::INFINITY);
        self.mixed = [false; LANES];
    }

    /// Takes notice of the whole step from `u` to `g`.
    #[inline(always)]
    pub fn see(&mut self, u: &[Block], g: &[Block]) -> Wanted {
        let zero = Block::splat(0.0);
        let [mut changed, mut size, mut aa, mut ab, mut bb, mut af, mut bf, mut ag] = [zero; 8];
        self.differences.swap(0, 1);
        let [newest, before] = &mut self.differences;
        let is_new = std::mem::replace(&mut self.is_new, false);
        for (k, &(p, part)) in self.moving.iter().enumerate() {
            let (u, g) = (&u[p], &g[p]);
            let ([f_then, g_then], [a, of_g], [b, _]) = (&mut self.last[k], &mut newest[k], &before[k]);
            if is_new {
                for i in 0..LANES {
                    let f = part * (g.0[i] - u.0[i]);
                    let far = f.abs();
                    changed.0[i] = if far > changed.0[i] || far.is_nan() { far } else { changed.0[i] };
                    size.0[i] += f * f;
                    (f_then.0[i], g_then.0[i]) = (f, part * g.0[i]);
                }
                continue;
            }
            for i in 0..LANES {
                let (f, g) = (part * (g.0[i] - u.0[i]), part * g.0[i]);
                let far = f.abs();
                let (d, e, b) = (f - f_then.0[i], g - g_then.0[i], b.0[i]);
                changed.0[i] = if far > changed.0[i] || far.is_nan() { far } else { changed.0[i] };
                size.0[i] += f * f;
                aa.0[i] += d * d;
                ab.0[i] += d * b;
                bb.0[i] += b * b;
                af.0[i] += d * f;
                bf.0[i] += b * f;
                ag.0[i] += d * e;
                (a.0[i], of_g.0[i]) = (d, e);
                (f_then.0[i], g_then.0[i]) = (f, g);
            }
        }
        Wanted { changed, size, aa, ab, bb, af, bf, ag }
    }

    /// The offsets after the whole step to `g` that was seen last; those of settled lanes stay.
    #[inline(always)]
    pub fn step(&mut self, u: &mut [Block], g: &[Block], wanted: &Wanted, settled: &[bool; LANES]) {
        let zero = Block::splat(0.0);
        let Wanted { changed, size, aa, ab, bb, af, bf, ag } = wanted;
        let [newest, before] = &mut self.differences;
        let (mut first, mut second, mut kept) = (zero, zero, zero);
        for i in 0..LANES {
            let near = bits_if(changed.0[i] < NEAR);
            let shrinks = bits_if(size.0[i] < self.size.0[i]) & bits_if(self.size.0[i] < f64::INFINITY);
            // Along the last step g must not change by more than u: whole steps would lead away.
            let used = near & shrinks & bits_if(ag.0[i] < aa.0[i]);
            let rest = bb.0[i] - ab.0[i] * ab.0[i] / aa.0[i];
            let both = used & bits_if(rest > INDEPENDENT * bb.0[i]);
            let c = (bf.0[i] - ab.0[i] * af.0[i] / aa.0[i]) / rest;
            second.0[i] = select(both, c, 0.0);
            first.0[i] = select(used, (af.0[i] - second.0[i] * ab.0[i]) / aa.0[i], 0.0);
            kept.0[i] = select(used, 1.0, 0.0);
            self.size.0[i] = select(near, size.0[i], f64::INFINITY);
        }
        if kept.0.iter().all(|kept| *kept == 0.0) {
            newest.fill([zero; 2]);
            for &(p, _) in &self.moving {
                let (u, g) = (&mut u[p], &g[p]);
                for i in 0..LANES {
                    let (from, to) = (u.0[i], g.0[i]);
                    u.0[i] = if settled[i] { from } else { to };
                }
            }
            return;
        }
        let mut farthest = zero;
        for (newest, before) in newest.iter().zip(&*before) {
            for i in 0..LANES {
                let away = (first.0[i] * newest[1].0[i] + second.0[i] * before[1].0[i]).abs();
                farthest.0[i] = if away > farthest.0[i] { away } else { farthest.0[i] };
            }
        }
        for i in 0..LANES {
            let used = farthest.0[i] < NEAR && kept.0[i] != 0.0;
            self.mixed[i] |= used && !settled[i];
            first.0[i] = if used { first.0[i] } else { 0.0 };
            second.0[i] = if used { second.0[i] } else { 0.0 };
        }
        // What the load does not move is the same in both.
        for ((&(p, part), newest), before) in self.moving.iter().zip(newest).zip(&*before) {
            let (u, g, whole) = (&mut u[p], &g[p], 1.0 / part);
            let ([of_f, of_g], [_, of_g_before]) = (newest, before);
            for i in 0..LANES {
                let away = first.0[i] * of_g.0[i] + second.0[i] * of_g_before.0[i];
                let (from, to) = (u.0[i], g.0[i] - whole * away);
                u.0[i] = if settled[i] { from } else { to };
                // Differences of steps that led away tell nothing of those to come.
                of_f.0[i] *= kept.0[i];
                of_g.0[i] *= kept.0[i];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole steps that change what is left by a factor per lane and coordinate.
    fn whole_step(u: &[Block], factors: &[[f64; LANES]]) -> Vec<Block> {
        let to = |(u, factors): (&Block, &[f64; LANES])| {
            Block::new(std::array::from_fn(|i| 0.5 + factors[i] * (u.0[i] - 0.5)))
        };
        u.iter().zip(factors).map(to).collect()
    }

    fn largest(a: &[Block], b: &[Block]) -> Block {
        a.iter().zip(b).fold(Block::splat(0.0), |largest, (a, b)| largest.max(&a.sub(b).abs()))
    }

    /// Two factors in every lane. What creeps settles, what leads away is left to whole steps.
    #[test]
    fn steps_that_creep_settle_and_steps_that_lead_away_do_not() {
        let leads_away = |i: usize| i % 8 == 7;
        let slow = std::array::from_fn(|i| if leads_away(i) { 1.2 } else { 0.99 - 0.03 * i as f64 });
        let factors = [slow, [-0.4; LANES], [0.01; LANES]];
        let moving = (0..factors.len()).map(|p| (p, 1.0)).collect();
        let mut mixing = Mixing::of(moving);
        let mut u = vec![Block::splat(0.501); factors.len()];
        for _ in 0..12 {
            let g = whole_step(&u, &factors);
            let wanted = mixing.see(&u, &g);
            mixing.step(&mut u, &g, &wanted, &[false; LANES]);
        }
        let left = largest(&u, &vec![Block::splat(0.5); factors.len()]);
        for i in 0..LANES {
            if leads_away(i) {
                assert!(left.0[i] > 1e-3, "lane {i}: {}", left.0[i]);
            } else {
                assert!(left.0[i] < 1e-12, "lane {i}: {}", left.0[i]);
            }
        }
    }

    #[test]
    fn settled_lanes_stay() {
        let mut mixing = Mixing::of(vec![(0, 1.0)]);
        let settled = std::array::from_fn(|i| i == 3);
        let (mut u, g) = (vec![Block::splat(0.5)], vec![Block::splat(0.51)]);
        let wanted = mixing.see(&u, &g);
        mixing.step(&mut u, &g, &wanted, &settled);
        for i in 0..LANES {
            assert_eq!(u[0].0[i].to_bits(), if i == 3 { 0.5_f64 } else { 0.51 }.to_bits());
        }
    }
}
