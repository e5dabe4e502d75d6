//! Faces of admissible sets that the forces of all lanes expose, as [`crate::clearance`] has them of one.
//!
//! Loops over lanes without branches, so that many lanes are judged at once: choices are made by masks, because the
//! compiler takes a quotient that only some lanes ask for into a branch, and every lane after it one by one. The formulas
//! are those of [`Set::face`], [`super::pin::Pin`] and [`super::tapered::Tapered`].

use crate::clearance::offset::MAX_SIZE;
use crate::clearance::pin::Pin;
use crate::clearance::tapered::Tapered;
use crate::clearance::undecided::Unforced;
use crate::clearance::{Set, Shape};
use crate::math::lanes::block::{Block, LANES, Mask, bits_if, select};

/// What exposes the faces of a set.
pub(crate) struct Pressed<'a> {
    pub forces: &'a [&'a Block],
    /// As for [`Set::face`].
    pub tolerance: &'a Block,
    /// Offsets before.
    pub before: &'a [Block; MAX_SIZE],
    /// The coordinates where what pushes counts as nothing.
    pub unforced: &'a [Unforced; LANES],
}

impl Pressed<'_> {
    /// A component of the offset before.
    #[inline(always)]
    fn offset(&self, component: usize, lane: usize) -> f64 {
        self.before[component].0[lane]
    }

    /// Where what pushes a coordinate counts.
    #[inline(always)]
    fn counts(&self, coordinate: usize) -> Mask {
        Mask::of(|lane| !self.unforced[lane].has(coordinate))
    }
}

/// The faces of one set.
pub(crate) struct Faces {
    /// Of every face the point that is nearest to the offset before, component by component.
    pub nearest: [Block; MAX_SIZE],
    /// Not zero where a face is more than a point.
    pub open: Block,
    extent: Extent,
}

#[allow(clippy::large_enum_variant)] // one at a time, on the stack
enum Extent {
    /// All of a ball where the face is open.
    Round(f64),
    Diamond(DiamondFaces),
    /// All of an interval of this half-width where the face is open.
    Interval(f64),
    /// The axial play and both ends: 1 where undecided, else 0.
    Pin(Pin, [Block; 3]),
    Tapered(Tapered, TaperedFaces),
}

/// 1 where the face is all of the diamond, and half of an edge where it is one.
struct DiamondFaces {
    gap: f64,
    half_length: f64,
    whole: Block,
    half: [Block; 2],
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
    /// The faces that forces expose, of a set that is not zero.
    #[inline(always)]
    pub fn new(set: &Set, by: &Pressed<'_>) -> Self {
        match set.shape() {
            Shape::Round { radius, .. } => Self::of_round(radius, by),
            Shape::Diamond { gap, half_length } => Self::of_diamond(gap, half_length, by),
            Shape::Interval { low, high } => Self::of_interval(low, high, by),
            Shape::Pin(pin) => Self::of_pin(pin, by),
            Shape::Tapered(tapered) => Self::of_tapered(tapered, by),
        }
    }

    #[inline(always)]
    fn of_round(radius: f64, by: &Pressed<'_>) -> Self {
        let Pressed { forces, tolerance, .. } = *by;
        let zero = Block::splat(0.0);
        let (mut nearest, mut open, mut part) = ([zero; MAX_SIZE], zero, zero);
        let (mut decided, mut square) = (by.counts(0), zero);
        for force in forces {
            square = square.add(&force.mul(force));
        }
        for i in 0..LANES {
            let size = square.0[i].sqrt();
            decided.0[i] &= bits_if(size > tolerance.0[i]);
            part.0[i] = radius / size;
            open.0[i] = select(decided.0[i], 0.0, 1.0);
        }
        for (k, force) in forces.iter().enumerate() {
            for i in 0..LANES {
                nearest[k].0[i] = select(decided.0[i], part.0[i] * force.0[i], by.offset(k, i));
            }
        }
        Self { nearest, open, extent: Extent::Round(radius) }
    }

    #[inline(always)]
    fn of_diamond(gap: f64, half_length: f64, by: &Pressed<'_>) -> Self {
        let Pressed { forces, tolerance, .. } = *by;
        let zero = Block::splat(0.0);
        let (mut nearest, mut open) = ([zero; MAX_SIZE], zero);
        let mut faces = DiamondFaces { gap, half_length, whole: zero, half: [zero; 2] };
        let counts = by.counts(0);
        for i in 0..LANES {
            let [along, about] = [forces[0].0[i], forces[1].0[i]];
            let (shift, tilt, tolerance) = (along.abs(), about.abs() / half_length, tolerance.0[i]);
            let whole = !((bits_if(shift > tolerance) | bits_if(tilt > tolerance)) & counts.0[i]);
            let edge = !whole & bits_if((shift - tilt).abs() <= tolerance);
            let corners = [gap.copysign(along), (gap / half_length).copysign(about)];
            let half = [0.5 * corners[0], -0.5 * corners[1]];
            // Along an edge in its own proportions, since its components differ in unit.
            let (at, middle) = ([by.offset(0, i), by.offset(1, i)], [half[0], -half[1]]);
            let part = 0.5 * ((at[0] - middle[0]) / half[0] + (at[1] - middle[1]) / half[1]);
            let part = if part < 1.0 { part } else { 1.0 };
            let part = if part > -1.0 { part } else { -1.0 };
            let shifted = bits_if(shift > tilt);
            let decided = [select(shifted, corners[0], 0.0), select(shifted, 0.0, corners[1])];
            for k in 0..2 {
                let pushed = select(edge, middle[k] + part * half[k], decided[k]);
                nearest[k].0[i] = select(whole, at[k], pushed);
                faces.half[k].0[i] = select(edge, half[k], 0.0);
            }
            faces.whole.0[i] = select(whole, 1.0, 0.0);
            open.0[i] = select(whole | edge, 1.0, 0.0);
        }
        Self { nearest, open, extent: Extent::Diamond(faces) }
    }

    #[inline(always)]
    fn of_interval(low: f64, high: f64, by: &Pressed<'_>) -> Self {
        let Pressed { forces, tolerance, .. } = *by;
        let zero = Block::splat(0.0);
        let (mut nearest, mut open) = ([zero; MAX_SIZE], zero);
        let counts = by.counts(0);
        for i in 0..LANES {
            let force = forces[0].0[i];
            let decided = bits_if(force.abs() > tolerance.0[i]) & counts.0[i];
            let end = select(bits_if(force > 0.0), high, low);
            nearest[0].0[i] = select(decided, end, by.offset(0, i));
            open.0[i] = select(decided, 0.0, 1.0);
        }
        Self { nearest, open, extent: Extent::Interval(0.5 * (high - low)) }
    }

    #[inline(always)]
    fn of_pin(pin: Pin, by: &Pressed<'_>) -> Self {
        let Pressed { forces, tolerance, .. } = *by;
        let zero = Block::splat(0.0);
        let (mut nearest, mut open, mut parts) = ([zero; MAX_SIZE], zero, [zero; 3]);
        let (across, l) = (pin.across(), pin.half_length);
        let (r, half_turn, axial) = (pin.radius, 0.5 / l, pin.axial.unwrap_or(0.0));
        let reactions = end_reactions(pin, forces);
        let at = |k: usize| &by.before[across + k];
        let mut ends = [[zero; 2]; 2];
        for (e, side) in [1.0, -1.0].into_iter().enumerate() {
            let (counts, fixed) = (by.counts(1 + e), bits_if(r == 0.0));
            for i in 0..LANES {
                let [x, y] = [reactions[e][0].0[i], reactions[e][1].0[i]];
                let size = (x * x + y * y).sqrt();
                let decided = bits_if(size > tolerance.0[i]) & counts.0[i] | fixed;
                let part = select(bits_if(size > 0.0), r / size, 0.0);
                // Displacements of the ends, as the pin has them.
                let (about_side, about_normal) = (l * at(2).0[i], l * at(3).0[i]);
                let before = [at(0).0[i] + side * about_normal, at(1).0[i] - side * about_side];
                ends[e][0].0[i] = select(decided, part * x, before[0]);
                ends[e][1].0[i] = select(decided, part * y, before[1]);
                parts[1 + e].0[i] = select(decided, 0.0, 1.0);
            }
        }
        let [first, second] = ends;
        for i in 0..LANES {
            nearest[across].0[i] = 0.5 * (first[0].0[i] + second[0].0[i]);
            nearest[across + 1].0[i] = 0.5 * (first[1].0[i] + second[1].0[i]);
            nearest[across + 2].0[i] = half_turn * (second[1].0[i] - first[1].0[i]);
            nearest[across + 3].0[i] = half_turn * (first[0].0[i] - second[0].0[i]);
            open.0[i] = parts[1].0[i] + parts[2].0[i];
        }
        if across == 1 {
            let (counts, loose) = (by.counts(0), bits_if(axial > 0.0));
            for i in 0..LANES {
                let force = forces[0].0[i];
                let decided = bits_if(force.abs() > tolerance.0[i]) & counts.0[i];
                let moves = !decided & loose;
                let side = select(decided, 1.0_f64.copysign(force), 0.0);
                nearest[0].0[i] = select(moves, by.offset(0, i), axial * side);
                parts[0].0[i] = select(moves, 1.0, 0.0);
                open.0[i] += parts[0].0[i];
            }
        }
        Self { nearest, open, extent: Extent::Pin(pin, parts) }
    }

    #[inline(always)]
    fn of_tapered(tapered: Tapered, by: &Pressed<'_>) -> Self {
        let Pressed { forces, tolerance, .. } = *by;
        let zero = Block::splat(0.0);
        let mut f = TaperedFaces { low: zero, high: zero, side: zero, signs: [zero; 4] };
        let (mut own, unit) = (own_forces(&tapered, forces), own_coordinates(&tapered, by));
        let (n, tapers) = (tapered.n, tapered.tapers);
        for (k, force) in own.iter_mut().enumerate() {
            let counts = by.counts(k);
            for i in 0..LANES {
                force.0[i] = select(counts.0[i], force.0[i], 0.0);
            }
        }
        let mut across = zero;
        for s in 0..n {
            for i in 0..LANES {
                let (p, q, tolerance) = (own[1 + 2 * s].0[i], own[2 + 2 * s].0[i], tolerance.0[i]);
                let larger = p.abs() + q.abs();
                across.0[i] += tapers[s] * larger;
                f.signs[2 * s].0[i] = sign_if(larger > tolerance && 2.0 * p.abs() > tolerance, p);
                f.signs[2 * s + 1].0[i] = sign_if(larger > tolerance && 2.0 * q.abs() > tolerance, q);
            }
        }
        let (mut side, mut along, mut tied) = (zero, zero, 0.0);
        for i in 0..LANES {
            let (force, across, tolerance) = (own[0].0[i].abs(), across.0[i], tolerance.0[i]);
            f.side.0[i] = sign_if(force > tolerance, own[0].0[i]);
            let out = force - across > tolerance;
            f.low.0[i] = one_if(out);
            f.high.0[i] = one_if(out || !(across - force > tolerance));
            tied += f.high.0[i] - f.low.0[i];
            let to = if f.side.0[i] == 0.0 { unit[0].0[i] } else { f.side.0[i] };
            side.0[i] = 1.0_f64.copysign(to);
            along.0[i] = side.0[i] * unit[0].0[i];
        }
        // The size of the axis' coordinate is where the squared distance is smallest: Newton's method from above, as in
        // `nearest_unit` of one face.
        let mut size = f.high;
        for _ in 0..if tied > 0.0 { 2 * n + 1 } else { 0 } {
            let (mut slope, mut bend) = (size.sub(&along), Block::splat(1.0));
            for k in 0..2 * n {
                let g = tapers[k / 2];
                for i in 0..LANES {
                    let (sign, x) = (f.signs[k].0[i], unit[1 + k].0[i]);
                    let beyond = if sign == 0.0 { x.abs() } else { sign * x } - 1.0 + g * size.0[i];
                    let counts = one_if(sign != 0.0 || beyond > 0.0);
                    slope.0[i] += counts * g * beyond;
                    bend.0[i] += counts * g * g;
                }
            }
            for i in 0..LANES {
                let next = size.0[i] - slope.0[i] / bend.0[i];
                let next = if next > f.low.0[i] { next } else { f.low.0[i] };
                let stays = bits_if(slope.0[i] <= 0.0) | bits_if(size.0[i] <= f.low.0[i]);
                size.0[i] = select(stays, size.0[i], next);
            }
        }
        let (mut there, mut moves, mut open) = ([zero; MAX_SIZE], [zero; MAX_SIZE], zero);
        for i in 0..LANES {
            let decided = f.high.0[i] == 0.0 || f.low.0[i] >= 1.0 && f.side.0[i] != 0.0;
            open.0[i] = one_if(!decided);
            there[0].0[i] = side.0[i] * size.0[i];
            moves[0].0[i] = there[0].0[i] - unit[0].0[i];
        }
        for k in 0..2 * n {
            let g = tapers[k / 2];
            for i in 0..LANES {
                let (sign, x) = (f.signs[k].0[i], unit[1 + k].0[i]);
                let reach = 1.0 - g * size.0[i];
                let inside = if x < reach { x } else { reach };
                let inside = if inside > -reach { inside } else { -reach };
                open.0[i] += one_if(sign == 0.0 && g * f.low.0[i] < 1.0);
                there[1 + k].0[i] = if sign == 0.0 { inside } else { sign * reach };
                moves[1 + k].0[i] = there[1 + k].0[i] - x;
            }
        }
        // Of a face that is open, what does not move keeps its value to the last bit.
        let (mut nearest, moved) = (of_own(&tapered, &there), of_own(&tapered, &moves));
        for k in 0..MAX_SIZE {
            for i in 0..LANES {
                let to = by.offset(k, i) + moved[k].0[i];
                nearest[k].0[i] = if open.0[i] == 0.0 { nearest[k].0[i] } else { to };
            }
        }
        Self { nearest, open, extent: Extent::Tapered(tapered, f) }
    }

    /// The coordinates that nothing pushes, as [`Set::unforced`] has them; `None` for tapered squares, whose forces tell
    /// it, not their faces.
    #[inline(always)]
    pub fn unforced(&self) -> Option<[Unforced; LANES]> {
        let of = |parts: [&Block; 3]| std::array::from_fn(|i| Unforced::of(parts.map(|part| part.0[i] != 0.0)));
        let none = Block::splat(0.0);
        match &self.extent {
            Extent::Round(_) | Extent::Interval(_) => Some(of([&self.open, &none, &none])),
            Extent::Diamond(faces) => Some(of([&faces.whole, &none, &none])),
            Extent::Pin(_, parts) => Some(of([&parts[0], &parts[1], &parts[2]])),
            Extent::Tapered(..) => None,
        }
    }

    /// Half of the range of `direction . offset` over every face.
    #[inline(always)]
    pub fn half_width(&self, direction: &[&Block]) -> Block {
        let mut width = Block::splat(0.0);
        match &self.extent {
            Extent::Round(radius) => {
                let square = direction.iter().fold(width, |square, d| square.add(&d.mul(d)));
                for i in 0..LANES {
                    width.0[i] = one_if(self.open.0[i] != 0.0) * radius * square.0[i].sqrt();
                }
            }
            Extent::Diamond(faces) => {
                for i in 0..LANES {
                    let (along, about) = (direction[0].0[i], direction[1].0[i]);
                    let (shift, tilt) = (along.abs(), about.abs() / faces.half_length);
                    let reach = faces.gap * if shift > tilt { shift } else { tilt };
                    let edge = (along * faces.half[0].0[i] + about * faces.half[1].0[i]).abs();
                    width.0[i] = faces.whole.0[i] * reach + edge;
                }
            }
            Extent::Interval(half) => {
                for i in 0..LANES {
                    width.0[i] = one_if(self.open.0[i] != 0.0) * half * direction[0].0[i].abs();
                }
            }
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
                for turned in [1.0, -1.0] {
                    // With the axis' coordinate at either end of its range.
                    let (mut low, mut high) = (Block::splat(0.0), Block::splat(0.0));
                    for i in 0..LANES {
                        let (side, along) = (f.side.0[i], turned * own[0].0[i]);
                        let along = if side == 0.0 { along.abs() } else { side * along };
                        low.0[i] = f.low.0[i] * along;
                        high.0[i] = f.high.0[i] * along;
                    }
                    for k in 0..2 * n {
                        let g = tapers[k / 2];
                        for i in 0..LANES {
                            let (sign, force) = (f.signs[k].0[i], turned * own[1 + k].0[i]);
                            let across = if sign == 0.0 { force.abs() } else { sign * force };
                            low.0[i] += (1.0 - g * f.low.0[i]) * across;
                            high.0[i] += (1.0 - g * f.high.0[i]) * across;
                        }
                    }
                    for i in 0..LANES {
                        let top = if low.0[i] > high.0[i] { low.0[i] } else { high.0[i] };
                        width.0[i] += 0.5 * tapered.gap * top;
                    }
                }
            }
        }
        width
    }
}

/// Reactions of both ends of a pin.
#[inline(always)]
pub(super) fn end_reactions(pin: Pin, forces: &[&Block]) -> [[Block; 2]; 2] {
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
pub(super) fn own_forces(tapered: &Tapered, forces: &[&Block]) -> [Block; MAX_SIZE] {
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

/// Own coordinates of tapered squares.
#[inline(always)]
fn own_coordinates(tapered: &Tapered, by: &Pressed<'_>) -> [Block; MAX_SIZE] {
    let mut unit = [Block::splat(0.0); MAX_SIZE];
    let part = |(k, arm): (usize, f64)| by.before[k].div(&Block::splat(tapered.gap * arm));
    let axis = tapered.axis;
    unit[0] = part(axis);
    for s in 0..tapered.n {
        let [a, b] = tapered.squares[s].map(part);
        unit[1 + 2 * s] = a.add(&b);
        unit[2 + 2 * s] = a.sub(&b);
    }
    unit
}

/// An offset by own coordinates of tapered squares.
#[inline(always)]
fn of_own(tapered: &Tapered, unit: &[Block; MAX_SIZE]) -> [Block; MAX_SIZE] {
    let mut offset = [Block::splat(0.0); MAX_SIZE];
    let (axis, arm) = tapered.axis;
    offset[axis] = unit[0].mul(&Block::splat(tapered.gap * arm));
    for (s, [(a, arm_a), (b, arm_b)]) in tapered.squares.into_iter().enumerate().take(tapered.n) {
        let (p, q) = (&unit[1 + 2 * s], &unit[2 + 2 * s]);
        offset[a] = p.add(q).mul(&Block::splat(0.5 * tapered.gap * arm_a));
        offset[b] = p.sub(q).mul(&Block::splat(0.5 * tapered.gap * arm_b));
    }
    offset
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
            for round in 0..100 {
                let n = set.size();
                let (w, direction) = (forces(&mut rng, &set), forces(&mut rng, &set));
                let (w, direction): (Vec<_>, Vec<_>) = (w.iter().collect(), direction.iter().collect());
                // From the middle, and from anywhere with coordinates that are not pushed.
                let (mut before, mut unforced) = ([Block::splat(0.0); MAX_SIZE], [Unforced::default(); LANES]);
                for lane in (0..LANES).filter(|_| round % 2 == 1) {
                    let nothing = forces(&mut rng, &set);
                    unforced[lane] = set.unforced(&nothing.iter().map(|b| b.0[lane]).collect::<Vec<_>>(), TOLERANCE);
                    let mut unit = [0.0; MAX_SIZE];
                    unit[..n].fill_with(|| rng.random_range(-1.0..1.0));
                    set.project_unit(&mut unit[..n]);
                    let offset = set.of_unit(&unit);
                    before.iter_mut().zip(offset).for_each(|(b, x)| b.0[lane] = x);
                }
                let faces = Faces::new(
                    &set,
                    &Pressed { forces: &w, tolerance: &Block::splat(TOLERANCE), before: &before, unforced: &unforced },
                );
                let width = faces.half_width(&direction);
                let not_pushed = faces.unforced().filter(|_| round % 2 == 0);
                for lane in 0..LANES {
                    let of = |blocks: &[&Block]| blocks.iter().map(|b| b.0[lane]).collect::<Vec<f64>>();
                    if let Some(not_pushed) = not_pushed {
                        assert_eq!(not_pushed[lane], set.unforced(&of(&w), TOLERANCE), "{set:?} {:?}", of(&w));
                    }
                    let masked = set.masked_force(&of(&w), unforced[lane]);
                    let face = set.face(&masked[..n], TOLERANCE);
                    assert_eq!(faces.open.0[lane] == 0.0, face.is_point(), "{set:?} {:?}", of(&w));
                    let nearest = face.nearest(&before.iter().map(|b| b.0[lane]).collect::<Vec<_>>()[..n]);
                    for k in 0..n {
                        assert!((faces.nearest[k].0[lane] - nearest[k]).abs() < 1e-14, "{set:?} {:?}", of(&w));
                    }
                    assert!((width.0[lane] - face.half_width(&of(&direction))).abs() < 1e-14, "{set:?} {:?}", of(&w));
                }
            }
        }
    }
}
