//! Offsets of a block of configurations moved to where the forces push them.

use crate::clearance::Set;
use crate::clearance::offset::MAX_SIZE;
use crate::clearance::undecided::{UNDECIDED, Unforced};
use crate::math::lanes::block::{Block, LANES};
use crate::mechanism::{Mechanism, Source};

/// What of every source the load does not push at the nominal pose.
#[inline(always)]
pub(crate) fn unforced_of<'b>(
    m: &Mechanism,
    gradient: impl Fn(usize) -> &'b Block,
    scale: &Block,
) -> Vec<[Unforced; LANES]> {
    let unforced = |source: &Source| {
        std::array::from_fn(|i| {
            let mut w = [0.0; MAX_SIZE];
            w.iter_mut().zip(source.range()).for_each(|(w, p)| *w = gradient(p).0[i]);
            source.set.unforced(&w[..source.set.size()], source.undecided(UNDECIDED * scale.0[i]))
        })
    };
    m.sources().iter().map(unforced).collect()
}

/// Whether a source is moved: by a load, a clearance.
#[inline(always)]
fn gives_way(source: &Source, loaded: bool) -> bool {
    !source.set.is_zero() && (source.is_clearance || !loaded)
}

/// Moves every source that gives way to the support point of its set along the gradient; what a tie or a
/// vanishing force leaves undecided stays where nothing pushes it. Tells the lanes where something is; the
/// result of lanes that do not ask is undefined. `unforced` is what the load does not push; `None` without a load.
#[inline(always)]
pub(crate) fn push<'b>(
    m: &Mechanism,
    unforced: Option<&[[Unforced; LANES]]>,
    asking: &[bool; LANES],
    gradient: impl Fn(usize) -> &'b Block,
    scale: &Block,
    pushed: &mut [Block],
) -> [bool; LANES] {
    let mut undecided = [false; LANES];
    for (s, source) in m.sources().iter().enumerate().filter(|(_, s)| gives_way(s, unforced.is_some())) {
        let unforced = |i: usize| unforced.map_or_else(Unforced::default, |unforced| unforced[s][i]);
        let p = source.first;
        if let Set::Disc { radius } = source.set {
            let (x, y) = (gradient(p), gradient(p + 1));
            let size = x.mul(x).add(&y.mul(y)).sqrt();
            let mut decided = [false; LANES];
            for i in 0..LANES {
                decided[i] = size.0[i] > UNDECIDED * scale.0[i] && unforced(i).is_none();
                undecided[i] |= !decided[i];
            }
            let part = Block::splat(radius).div(&size);
            for (p, w) in [(p, x), (p + 1, y)] {
                pushed[p] = Block::splat(m.centre[p]).add(&part.mul(w)).where_else(&decided, &pushed[p]);
            }
            continue;
        }
        let n = source.set.size();
        for i in (0..LANES).filter(|&i| asking[i]) {
            let mut w = [0.0; MAX_SIZE];
            let mut offset = [0.0; MAX_SIZE];
            for k in 0..n {
                w[k] = gradient(p + k).0[i];
                offset[k] = pushed[p + k].0[i] - m.centre[p + k];
            }
            let w = source.set.masked_force(&w[..n], unforced(i));
            let face = source.set.face(&w[..n], source.undecided(UNDECIDED * scale.0[i]));
            let to = if face.is_point() { face.centre } else { face.nearest(&offset[..n]) };
            undecided[i] |= !face.is_point();
            for k in 0..n {
                pushed[p + k].0[i] = m.centre[p + k] + to[k];
            }
        }
    }
    undecided
}

/// Largest change of an offset, as a part of its set.
#[inline(always)]
pub(crate) fn change(m: &Mechanism, loaded: bool, from: &[Block], to: &[Block]) -> Block {
    let mut largest = Block::splat(0.0);
    for source in m.sources().iter().filter(|s| gives_way(s, loaded)) {
        for p in source.range() {
            let size = Block::splat(source.set.half_width(p - source.first));
            largest = to[p].sub(&from[p]).abs().div(&size).max(&largest);
        }
    }
    largest
}
