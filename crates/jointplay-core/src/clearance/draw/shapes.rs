//! Offsets of a block of samples, set by set.

use crate::clearance::draw::SIGMAS;
use crate::clearance::law::Law;
use crate::clearance::offset::MAX_SIZE;
use crate::clearance::pin::Pin;
use crate::clearance::{Set, Shape, variance};
use crate::math::lanes::block::{Block, LANES};

/// Offsets of every lane, or their own coordinates.
pub type Drawn = [Block; MAX_SIZE];

/// Numbers of a block of samples, and what laws make of them.
pub trait Draw: Sized {
    /// Uniform from 0 to 1, 1 excluded.
    fn unit(&mut self) -> Block;

    /// -1 or 1.
    fn sign(&mut self) -> Block;

    /// A point of the unit circle.
    fn circle(&mut self) -> [Block; 2];

    /// A uniform number from 0 to 1 and a point of the unit circle, independent: the square of the radius of a uniform point of
    /// the unit disc, and its direction.
    fn ring(&mut self) -> (Block, [Block; 2]);

    /// A standard normal number.
    fn normal(&mut self) -> Block;

    /// A centred normal number; the law that truncates keeps it between -1 and 1.
    fn scaled_normal(&mut self, law: Law, sigma: f64) -> Block;

    /// The largest of three uniform numbers.
    fn largest_of_three(&mut self) -> Block;

    /// Independent normal numbers with `SIGMAS` standard deviations to 1. The law that truncates keeps
    /// those whose `gauge` does not exceed 1.
    fn scaled_normals(&mut self, count: usize, law: Law, gauge: impl Fn([f64; MAX_SIZE]) -> f64) -> Drawn;

    /// Uniform from -1 to 1.
    #[inline(always)]
    fn symmetric(&mut self) -> Block {
        self.unit().mul_add(&Block::splat(2.0), &Block::splat(-1.0))
    }

    /// Draws an offset of a set for every lane; `out` has a place for each of its components.
    // Inlined into callers that are compiled for a given width of vector registers, as all of this.
    #[inline(always)]
    fn draw(&mut self, set: &Set, law: Law, out: &mut [Block]) {
        self.draw_shape(set, law, out);
    }

    /// Draws the same in the set's own coordinates ([`Set::to_unit`]).
    #[inline(always)]
    fn draw_own(&mut self, set: &Set, law: Law, out: &mut [Block]) {
        self.draw_unit_shape(set, law, out);
    }
}

/// The laws of all shapes.
trait Laws: Draw {
    #[inline(always)]
    fn draw_shape(&mut self, set: &Set, law: Law, out: &mut [Block]) {
        match set.shape() {
            Shape::Round { radius, size: 2 } => {
                // Component by component: closures are not compiled for the caller's width.
                let [x, y] = self.disc(law);
                out[0] = x.mul(&Block::splat(radius));
                out[1] = y.mul(&Block::splat(radius));
            }
            Shape::Round { radius, .. } => {
                let [x, y, z] = self.ball(law);
                out[0] = x.mul(&Block::splat(radius));
                out[1] = y.mul(&Block::splat(radius));
                out[2] = z.mul(&Block::splat(radius));
            }
            Shape::Diamond { gap, half_length } => {
                let [a, b] = self.diamond(law);
                out[0] = a.mul(&Block::splat(gap));
                out[1] = b.mul(&Block::splat(gap / half_length));
            }
            Shape::Interval { low, high } => {
                let half = Block::splat(0.5 * (high - low));
                out[0] = self.interval(law).mul_add(&half, &Block::splat(0.5 * (low + high)));
            }
            Shape::Pin(pin) => self.pin(&pin, law, out),
            Shape::Tapered(tapered) => {
                let unit = self.tapered(law, &tapered.tapers[..tapered.n]);
                for i in 0..LANES {
                    let offset = tapered.of_unit(&unit.each_ref().map(|b| b.0[i]));
                    for (block, value) in out.iter_mut().zip(offset) {
                        block.0[i] = value;
                    }
                }
            }
        }
    }

    /// Own coordinates of every shape.
    #[inline(always)]
    fn draw_unit_shape(&mut self, set: &Set, law: Law, out: &mut [Block]) {
        match set.shape() {
            Shape::Round { size: 2, .. } => out.copy_from_slice(&self.disc(law)),
            Shape::Round { .. } => out.copy_from_slice(&self.ball(law)),
            Shape::Diamond { .. } => out.copy_from_slice(&self.square(law)),
            Shape::Interval { .. } => out[0] = self.interval(law),
            Shape::Pin(pin) => {
                let across = pin.across();
                for along in &mut out[..across] {
                    *along = self.interval(law);
                }
                for end in out[across..].chunks_exact_mut(2) {
                    end.copy_from_slice(&self.disc(law));
                }
            }
            Shape::Tapered(tapered) => {
                let unit = self.tapered(law, &tapered.tapers[..tapered.n]);
                out.copy_from_slice(&unit[..out.len()]);
            }
        }
    }

    /// A radius by its inverse distribution, and a direction.
    #[inline(always)]
    fn disc(&mut self, law: Law) -> [Block; 2] {
        if law == Law::Boundary {
            return self.circle();
        }
        let (u, [x, y]) = self.ring();
        let radius = if law == Law::Uniform {
            u.sqrt()
        } else {
            // Rayleigh, truncated at the boundary or nowhere.
            let k = if law == Law::Normal { 0.5 * SIGMAS * SIGMAS } else { f64::INFINITY };
            let inside = u.mul_add(&Block::splat((-k).exp_m1()), &Block::splat(1.0));
            inside.ln().mul(&Block::splat(-2.0 / (SIGMAS * SIGMAS))).sqrt()
        };
        [x.mul(&radius), y.mul(&radius)]
    }

    /// The diamond `|a| + |b| <= 1` is the square `|p|, |q| <= 1` turned: `a = (p+q)/2, b = (p-q)/2`.
    #[inline(always)]
    fn diamond(&mut self, law: Law) -> [Block; 2] {
        let [p, q] = self.square(law);
        let half = Block::splat(0.5);
        [p.add(&q).mul(&half), p.sub(&q).mul(&half)]
    }

    #[inline(always)]
    fn square(&mut self, law: Law) -> [Block; 2] {
        match law {
            Law::Uniform => [self.symmetric(), self.symmetric()],
            Law::Normal | Law::Gauss => {
                let mut pair = [Block::splat(0.0); 2];
                for number in &mut pair {
                    *number = self.scaled_normal(law, std::f64::consts::SQRT_2 / SIGMAS);
                }
                pair
            }
            Law::Boundary => {
                let (side, along, which) = (self.sign(), self.symmetric(), self.sign());
                let (mut p, mut q) = (side, along);
                for i in 0..LANES {
                    if which.0[i] > 0.0 {
                        (p.0[i], q.0[i]) = (along.0[i], side.0[i]);
                    }
                }
                [p, q]
            }
        }
    }

    #[inline(always)]
    fn interval(&mut self, law: Law) -> Block {
        match law {
            Law::Uniform => self.symmetric(),
            Law::Boundary => self.sign(),
            Law::Normal | Law::Gauss => self.scaled_normal(law, 1.0 / SIGMAS),
        }
    }

    /// In a ball the radius is distributed like the largest of three uniform numbers, and the height of a
    /// point of the sphere is uniform (Archimedes).
    #[inline(always)]
    fn ball(&mut self, law: Law) -> [Block; 3] {
        let radius = match law {
            Law::Boundary => Block::splat(1.0),
            Law::Uniform => self.largest_of_three(),
            Law::Normal | Law::Gauss => {
                let [x, y, z, ..] = self.scaled_normals(3, law, |p| p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
                return [x, y, z];
            }
        };
        let (u, [x, y]) = self.ring();
        let height = u.mul_add(&Block::splat(2.0), &Block::splat(-1.0));
        let across = height.neg_mul_add(&height, &Block::splat(1.0)).sqrt().mul(&radius);
        [x.mul(&across), y.mul(&across), height.mul(&radius)]
    }

    /// The ends each within their own disc.
    #[inline(always)]
    fn pin(&mut self, pin: &Pin, law: Law, out: &mut [Block]) {
        let across = if let Some(axial) = pin.axial {
            out[0] = self.interval(law).mul(&Block::splat(axial));
            &mut out[1..]
        } else {
            out
        };
        let shift = Block::splat(0.5 * pin.radius);
        let tilt = Block::splat(0.5 * pin.radius / pin.half_length);
        across.fill(Block::splat(0.0));
        for arm in [tilt, tilt.neg()] {
            let [side, normal] = self.disc(law);
            across[0] = side.mul_add(&shift, &across[0]);
            across[1] = normal.mul_add(&shift, &across[1]);
            across[2] = normal.neg_mul_add(&arm, &across[2]);
            across[3] = side.mul_add(&arm, &across[3]);
        }
    }

    /// Own coordinates of tapered squares.
    #[inline(always)]
    fn tapered(&mut self, law: Law, tapers: &[f64]) -> Drawn {
        let n = 1 + 2 * tapers.len();
        match law {
            Law::Uniform => self.uniform_tapered(tapers),
            Law::Boundary => {
                let mut drawn = self.uniform_tapered(tapers);
                let mut gauge = Block::splat(0.0);
                for (s, taper) in tapers.iter().enumerate() {
                    let side = drawn[1 + 2 * s].abs().max(&drawn[2 + 2 * s].abs());
                    gauge = gauge.max(&drawn[0].abs().mul_add(&Block::splat(*taper), &side));
                }
                for block in &mut drawn {
                    *block = block.div(&gauge);
                }
                drawn
            }
            // Along the diagonals of the squares, where the components are: turned by 45 degrees, normal
            // numbers stay independent.
            Law::Normal | Law::Gauss => turned(self.scaled_normals(n, law, |p| {
                let shrunk = |(s, taper): (usize, &f64)| p[1 + 2 * s].abs() + p[2 + 2 * s].abs() + taper * p[0].abs();
                tapers.iter().enumerate().map(shrunk).fold(0.0, f64::max)
            })),
        }
    }

    /// The distance from the end of the axis is distributed like the largest of three, four or five
    /// uniform numbers, in proportions that the tapers give; it is never 1, so that no point is the
    /// middle.
    #[inline(always)]
    fn uniform_tapered(&mut self, tapers: &[f64]) -> Drawn {
        let [_, four, five] = variance::tapered_orders(tapers);
        let mut distance = self.largest_of_three();
        if tapers.len() > 1 {
            let (choice, fourth, fifth) = (self.unit(), self.unit(), self.unit());
            for i in 0..LANES {
                let with_fourth = if choice.0[i] < four + five { fourth.0[i] } else { 0.0 };
                let with_fifth = if choice.0[i] < five { fifth.0[i] } else { 0.0 };
                distance.0[i] = distance.0[i].max(with_fourth).max(with_fifth);
            }
        }
        let size = Block::splat(1.0).sub(&distance);
        let mut drawn = [Block::splat(0.0); MAX_SIZE];
        drawn[0] = size.mul(&self.sign());
        for (s, taper) in tapers.iter().enumerate() {
            let side = size.neg_mul_add(&Block::splat(*taper), &Block::splat(1.0));
            for k in [1 + 2 * s, 2 + 2 * s] {
                drawn[k] = self.symmetric().mul(&side);
            }
        }
        drawn
    }
}

impl<D: Draw> Laws for D {}

/// Own coordinates of points along the diagonals of the squares.
#[inline(always)]
fn turned(mut drawn: Drawn) -> Drawn {
    for s in [1, 3] {
        let (a, b) = (drawn[s], drawn[s + 1]);
        drawn[s] = a.add(&b);
        drawn[s + 1] = a.sub(&b);
    }
    drawn
}
