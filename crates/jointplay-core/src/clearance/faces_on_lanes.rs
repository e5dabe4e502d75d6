//! Faces of admissible sets that the forces of all lanes expose, as [`crate::clearance`] has them of one.
//!
//! Loops over lanes without branches, so that many lanes are judged at once. The formulas are those of
//! [`super::pin::Pin`] and [`super::tapered::Tapered`]; other sets go lane by lane.

use crate::clearance::face::Face;
use crate::clearance::offset::MAX_SIZE;
use crate::clearance::pin::Pin;
use crate::clearance::tapered::Tapered;
use crate::clearance::{Set, Shape};
use crate::math::lanes::block::{Block, LANES};

/// The faces of one set, with the joint in the middle of its play before.
pub(crate) struct Faces {
    /// Of every face the point that is nearest to the middle of the set, component by component.
    pub nearest: [Block; MAX_SIZE],
    /// Not zero where a face is more than a point.
    pub open: Block,
    extent: Extent,
}

#[allow(clippy::large_enum_variant)] // one at a time, on the stack
enum Extent {
    /// The axial play and both ends: 1 where undecided, else 0.
    Pin(Pin, [Block; 3]),
    Tapered(Tapered, TaperedFaces),
    EachLane(Vec<Face>),
}

/// A range of the axis, its sign and those of the diagonals; zero for both signs.
struct TaperedFaces {
    low: Block,
    high: Block,
    side: Block,
    signs: [Block; 4],
}

#[inline(always)]
fn one_if(chosen: bool) -> f64 {
    if chosen { 1.0 } else { 0.0 }
}

/// The sign of a number where chosen, else zero.
#[inline(always)]
fn sign_if(chosen: bool, x: f64) -> f64 {
    if chosen { 1.0_f64.copysign(x) } else { 0.0 }
}

impl Faces {
    /// The faces that forces expose, of a set that is not zero; `tolerance` as for [`Set::face`].
    #[inline(always)]
    pub fn new(set: &Set, forces: &[&Block], tolerance: &Block) -> Self {
        match set.shape() {
            Shape::Pin(pin) => Self::of_pin(pin, forces, tolerance),
            Shape::Tapered(tapered) => Self::of_tapered(tapered, forces, tolerance),
            _ => Self::of_each_lane(set, forces, tolerance),
        }
    }

    #[inline(always)]
    fn of_pin(pin: Pin, forces: &[&Block], tolerance: &Block) -> Self {
        let zero = Block::splat(0.0);
        let (mut nearest, mut open, mut parts) = ([zero; MAX_SIZE], zero, [zero; 3]);
        let across = pin.across();
        let (r, half_turn, axial) = (pin.radius, 0.5 / pin.half_length, pin.axial.unwrap_or(0.0));
        let ends = end_reactions(pin, forces);
        for i in 0..LANES {
            let tolerance = tolerance.0[i];
            let mut at = [[0.0; 2]; 2];
            for e in 0..2 {
                let [x, y] = [ends[e][0].0[i], ends[e][1].0[i]];
                let size = (x * x + y * y).sqrt();
                let decided = size > tolerance;
                let part = if decided { r / size } else { 0.0 };
                at[e] = [part * x, part * y];
                parts[1 + e].0[i] = one_if(!decided && r > 0.0);
            }
            let [first, second] = at;
            nearest[across].0[i] = 0.5 * (first[0] + second[0]);
            nearest[across + 1].0[i] = 0.5 * (first[1] + second[1]);
            nearest[across + 2].0[i] = half_turn * (second[1] - first[1]);
            nearest[across + 3].0[i] = half_turn * (first[0] - second[0]);
            open.0[i] = parts[1].0[i] + parts[2].0[i];
        }
        if across == 1 {
            for i in 0..LANES {
                let decided = forces[0].0[i].abs() > tolerance.0[i];
                nearest[0].0[i] = axial * sign_if(decided, forces[0].0[i]);
                parts[0].0[i] = one_if(!decided && axial > 0.0);
                open.0[i] += parts[0].0[i];
            }
        }
        Self { nearest, open, extent: Extent::Pin(pin, parts) }
    }

    #[inline(always)]
    fn of_tapered(tapered: Tapered, forces: &[&Block], tolerance: &Block) -> Self {
        let zero = Block::splat(0.0);
        let (mut nearest, mut open) = ([zero; MAX_SIZE], zero);
        let mut f = TaperedFaces { low: zero, high: zero, side: zero, signs: [zero; 4] };
        let mut unit = [zero; MAX_SIZE];
        let own = own_forces(&tapered, forces);
        let (n, tapers) = (tapered.n, tapered.tapers);
        for i in 0..LANES {
            let tolerance = tolerance.0[i];
            let mut across = 0.0;
            for s in 0..n {
                let (p, q) = (own[1 + 2 * s].0[i], own[2 + 2 * s].0[i]);
                let larger = p.abs() + q.abs();
                across += tapers[s] * larger;
                f.signs[2 * s].0[i] = sign_if(larger > tolerance && 2.0 * p.abs() > tolerance, p);
                f.signs[2 * s + 1].0[i] = sign_if(larger > tolerance && 2.0 * q.abs() > tolerance, q);
            }
            let along = own[0].0[i].abs();
            f.side.0[i] = sign_if(along > tolerance, own[0].0[i]);
            let out = along - across > tolerance;
            f.low.0[i] = one_if(out);
            f.high.0[i] = one_if(out || !(across - along > tolerance));
        }
        for i in 0..LANES {
            let (low, high, side) = (f.low.0[i], f.high.0[i], f.side.0[i]);
            // The size of the axis' coordinate is where the squared distance from the middle is smallest.
            let (mut slope, mut bend, mut undecided) = (high, 1.0, 0.0);
            for k in 0..2 * n {
                let (g, held) = (tapers[k / 2], f.signs[k].0[i].abs());
                slope += held * g * (g * high - 1.0);
                bend += held * g * g;
                undecided += one_if(held == 0.0 && g * low < 1.0);
            }
            let size = if slope > 0.0 { (high - slope / bend).max(low) } else { high };
            let axis_decided = high == 0.0 || low >= 1.0 && side != 0.0;
            undecided += one_if(!axis_decided);
            open.0[i] = undecided;
            unit[0].0[i] = size * if side == 0.0 { 1.0 } else { side };
            for k in 0..2 * n {
                unit[1 + k].0[i] = f.signs[k].0[i] * (1.0 - tapers[k / 2] * size);
            }
        }
        let (axis, arm) = tapered.axis;
        nearest[axis] = unit[0].mul(&Block::splat(tapered.gap * arm));
        for (s, [(a, arm_a), (b, arm_b)]) in tapered.squares.into_iter().enumerate().take(n) {
            let (p, q) = (&unit[1 + 2 * s], &unit[2 + 2 * s]);
            nearest[a] = p.add(q).mul(&Block::splat(0.5 * tapered.gap * arm_a));
            nearest[b] = p.sub(q).mul(&Block::splat(0.5 * tapered.gap * arm_b));
        }
        Self { nearest, open, extent: Extent::Tapered(tapered, f) }
    }

    #[inline(always)]
    fn of_each_lane(set: &Set, forces: &[&Block], tolerance: &Block) -> Self {
        let zero = Block::splat(0.0);
        let (mut nearest, mut open) = ([zero; MAX_SIZE], zero);
        let mut faces = Vec::with_capacity(LANES);
        for i in 0..LANES {
            let mut w = [0.0; MAX_SIZE];
            w.iter_mut().zip(forces).for_each(|(w, force)| *w = force.0[i]);
            let face = set.face(&w[..forces.len()], tolerance.0[i]);
            let point = face.nearest(&[0.0; MAX_SIZE][..forces.len()]);
            nearest.iter_mut().zip(point).for_each(|(block, x)| block.0[i] = x);
            open.0[i] = one_if(!face.is_point());
            faces.push(face);
        }
        Self { nearest, open, extent: Extent::EachLane(faces) }
    }

    /// Half of the range of `direction . offset` over every face.
    #[inline(always)]
    pub fn half_width(&self, direction: &[&Block]) -> Block {
        let mut width = Block::splat(0.0);
        match &self.extent {
            Extent::Pin(pin, parts) => {
                let ends = end_reactions(*pin, direction);
                for i in 0..LANES {
                    for e in 0..2 {
                        let [x, y] = [ends[e][0].0[i], ends[e][1].0[i]];
                        width.0[i] += parts[1 + e].0[i] * pin.radius * (x * x + y * y).sqrt();
                    }
                }
                if let Some(axial) = pin.axial {
                    for i in 0..LANES {
                        width.0[i] += parts[0].0[i] * axial * direction[0].0[i].abs();
                    }
                }
            }
            Extent::Tapered(tapered, f) => {
                let own = own_forces(tapered, direction);
                let (n, tapers) = (tapered.n, tapered.tapers);
                for i in 0..LANES {
                    let side = f.side.0[i];
                    let mut width_at = [0.0; 2];
                    for turned in [1.0, -1.0] {
                        let along = turned * own[0].0[i];
                        let along = if side == 0.0 { along.abs() } else { side * along };
                        let mut top = [f.low.0[i] * along, f.high.0[i] * along];
                        for k in 0..2 * n {
                            let (sign, force) = (f.signs[k].0[i], turned * own[1 + k].0[i]);
                            let across = if sign == 0.0 { force.abs() } else { sign * force };
                            top[0] += (1.0 - tapers[k / 2] * f.low.0[i]) * across;
                            top[1] += (1.0 - tapers[k / 2] * f.high.0[i]) * across;
                        }
                        width_at[usize::from(turned < 0.0)] = if top[0] > top[1] { top[0] } else { top[1] };
                    }
                    width.0[i] = 0.5 * tapered.gap * (width_at[0] + width_at[1]);
                }
            }
            Extent::EachLane(faces) => {
                for (i, face) in faces.iter().enumerate() {
                    let mut d = [0.0; MAX_SIZE];
                    d.iter_mut().zip(direction).for_each(|(d, block)| *d = block.0[i]);
                    width.0[i] = face.half_width(&d[..direction.len()]);
                }
            }
        }
        width
    }
}

/// Reactions of both ends of a pin.
#[inline(always)]
fn end_reactions(pin: Pin, forces: &[&Block]) -> [[Block; 2]; 2] {
    let zero = Block::splat(0.0);
    let mut ends = [[zero; 2]; 2];
    let (w, per_lever) = (&forces[pin.across()..], 1.0 / pin.half_length);
    for i in 0..LANES {
        let (about_side, about_normal) = (per_lever * w[2].0[i], per_lever * w[3].0[i]);
        ends[0][0].0[i] = 0.5 * (w[0].0[i] + about_normal);
        ends[0][1].0[i] = 0.5 * (w[1].0[i] - about_side);
        ends[1][0].0[i] = 0.5 * (w[0].0[i] - about_normal);
        ends[1][1].0[i] = 0.5 * (w[1].0[i] + about_side);
    }
    ends
}

/// Forces along the own coordinates of tapered squares.
#[inline(always)]
fn own_forces(tapered: &Tapered, forces: &[&Block]) -> [Block; MAX_SIZE] {
    let mut own = [Block::splat(0.0); MAX_SIZE];
    let force = |(k, arm): (usize, f64)| forces[k].mul(&Block::splat(arm));
    let axis = tapered.axis;
    own[0] = force(axis);
    for s in 0..tapered.n {
        let [a, b] = tapered.squares[s].map(force);
        let half = Block::splat(0.5);
        own[1 + 2 * s] = half.mul(&a.add(&b));
        own[2 + 2 * s] = half.mul(&a.sub(&b));
    }
    own
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::clearance::samples::{DEGENERATE, KINDS};

    const TOLERANCE: f64 = 1e-9;

    /// Forces of every kind: generic ones, and ones with components or differences that vanish.
    fn forces(rng: &mut Xoshiro256PlusPlus, set: &Set) -> Vec<Block> {
        let mut blocks = vec![Block::splat(0.0); set.size()];
        for lane in 0..LANES {
            for (k, block) in blocks.iter_mut().enumerate() {
                let x: f64 = if rng.random_bool(0.4) { 0.0 } else { rng.random_range(-1.0..1.0) };
                // Whole parts of the set's own levers make ties.
                block.0[lane] = if rng.random_bool(0.3) { x.signum() * set.half_width(k) } else { x };
            }
        }
        blocks
    }

    #[test]
    fn faces_of_all_lanes_are_those_of_each() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        for set in KINDS.into_iter().chain(DEGENERATE).filter(|s| !s.is_zero()) {
            for _ in 0..50 {
                let n = set.size();
                let (w, direction) = (forces(&mut rng, &set), forces(&mut rng, &set));
                let (w, direction): (Vec<_>, Vec<_>) = (w.iter().collect(), direction.iter().collect());
                let faces = Faces::new(&set, &w, &Block::splat(TOLERANCE));
                let width = faces.half_width(&direction);
                for lane in 0..LANES {
                    let of = |blocks: &[&Block]| blocks.iter().map(|b| b.0[lane]).collect::<Vec<f64>>();
                    let face = set.face(&of(&w), TOLERANCE);
                    assert_eq!(faces.open.0[lane] == 0.0, face.is_point(), "{set:?} {:?}", of(&w));
                    let nearest = face.nearest(&[0.0; MAX_SIZE][..n]);
                    for k in 0..n {
                        assert!((faces.nearest[k].0[lane] - nearest[k]).abs() < 1e-14, "{set:?} {:?}", of(&w));
                    }
                    assert!((width.0[lane] - face.half_width(&of(&direction))).abs() < 1e-14, "{set:?} {:?}", of(&w));
                }
            }
        }
    }
}
