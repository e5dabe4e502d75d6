//! Offsets of a block of configurations moved to where the forces push them.

use crate::clearance::faces_on_lanes::{Faces, Pressed};
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
    let tolerance = scale.mul(&Block::splat(UNDECIDED));
    let mut unforced = vec![[Unforced::default(); LANES]; m.sources().len()];
    // No closure over the sources: it would not be compiled for the width of the registers.
    for (of, source) in unforced.iter_mut().zip(m.sources()).filter(|(_, source)| !source.set.is_zero()) {
        if let Some(found) = exposed(source, &gradient, &tolerance, None).unforced() {
            *of = found;
            continue;
        }
        for (i, of) in of.iter_mut().enumerate() {
            let mut w = [0.0; MAX_SIZE];
            w.iter_mut().zip(source.range()).for_each(|(w, p)| *w = gradient(p).0[i]);
            *of = source.set.unforced(&w[..source.set.size()], source.undecided(tolerance.0[i]));
        }
    }
    unforced
}

/// Whether a source is moved: by a load, a clearance.
#[inline(always)]
fn gives_way(source: &Source, loaded: bool) -> bool {
    !source.set.is_zero() && (source.is_clearance || !loaded)
}

/// Moves every source that gives way to the support point of its set along the gradient; what a tie or a
/// vanishing force leaves undecided stays where nothing pushes it, as it is among the offsets `from`. Tells how much is.
/// `unforced` is what the load does not push; `None` without a load.
#[inline(always)]
pub(crate) fn push<'b>(
    m: &Mechanism,
    unforced: Option<&[[Unforced; LANES]]>,
    gradient: impl Fn(usize) -> &'b Block,
    scale: &Block,
    from: &[Block],
    pushed: &mut [Block],
) -> Block {
    let mut undecided = Block::splat(0.0);
    let tolerance = scale.mul(&Block::splat(UNDECIDED));
    for (s, source) in m.sources().iter().enumerate().filter(|(_, s)| gives_way(s, unforced.is_some())) {
        let mut before = [Block::splat(0.0); MAX_SIZE];
        for (offset, p) in before.iter_mut().zip(source.range()) {
            *offset = from[p].sub(&Block::splat(m.centre[p]));
        }
        let unforced = unforced.map_or([Unforced::default(); LANES], |unforced| unforced[s]);
        let faces = exposed(source, &gradient, &tolerance, Some((&before, &unforced)));
        for (to, p) in faces.nearest.iter().zip(source.range()) {
            pushed[p] = to.add(&Block::splat(m.centre[p]));
        }
        undecided = undecided.add(&faces.open);
    }
    undecided
}

/// The faces of a source that forces along its parameters expose; from the middle, with all of them, without `before`.
#[inline(always)]
pub(crate) fn exposed<'b>(
    source: &Source,
    gradient: impl Fn(usize) -> &'b Block,
    tolerance: &Block,
    before: Option<(&[Block; MAX_SIZE], &[Unforced; LANES])>,
) -> Faces {
    let n = source.set.size();
    let forces: [&Block; MAX_SIZE] = std::array::from_fn(|k| gradient(source.first + k.min(n - 1)));
    let tolerance = tolerance.mul(&Block::splat(source.lever));
    let (middle, all) = (source.set.of_unit(&[0.0; MAX_SIZE]).map(Block::splat), [Unforced::default(); LANES]);
    let (before, unforced) = before.unwrap_or((&middle, &all));
    Faces::new(&source.set, &Pressed { forces: &forces[..n], tolerance: &tolerance, before, unforced })
}

/// Largest change of an offset that gives way without a load, as a part of its set.
#[inline(always)]
pub(crate) fn change(m: &Mechanism, from: &[Block], to: &[Block]) -> Block {
    let mut largest = Block::splat(0.0);
    for source in m.sources().iter().filter(|s| gives_way(s, false)) {
        for p in source.range() {
            let size = Block::splat(source.set.half_width(p - source.first));
            largest = to[p].sub(&from[p]).abs().div(&size).max(&largest);
        }
    }
    largest
}
