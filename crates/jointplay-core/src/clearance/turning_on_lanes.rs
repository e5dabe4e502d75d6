//! Forces that may turn within the play, for a block of configurations.
//!
//! A load that holds an offset at one end of its set may hold it at another as well, where the force on it points
//! elsewhere. How far forces change over all play is told by how far they have changed over some of it.

use crate::clearance::faces_on_lanes::{end_reactions, own_forces};
use crate::clearance::offset::MAX_SIZE;
use crate::clearance::{Set, Shape};
use crate::math::lanes::block::{Block, LANES};

/// A force may turn if this many times its change so far would turn it: the change from the middle of the play to one place in
/// it is a part of what there is over all of it, and may be small by chance.
const TURNS: f64 = 5.0;

/// Counts the parts of a set on which a force may turn: forces now and at another place of the play; changes up to a
/// tolerance are none.
struct Count<'a> {
    tolerance: &'a Block,
    found: Block,
}

impl Count<'_> {
    /// A part with the components of its force, and of the change.
    #[inline(always)]
    fn part<const N: usize>(&mut self, now: [&Block; N], change: [&Block; N]) {
        for i in 0..LANES {
            let (mut force, mut changed) = (0.0, 0.0);
            for k in 0..N {
                force += now[k].0[i] * now[k].0[i];
                changed += change[k].0[i] * change[k].0[i];
            }
            let tolerance = self.tolerance.0[i];
            let turns = changed > tolerance * tolerance && TURNS * TURNS * changed >= force;
            self.found.0[i] += if turns { 1.0 } else { 0.0 };
        }
    }
}

/// How many parts of a set may be held elsewhere, by the forces now and at another place of the play; none where the latter
/// are not known.
#[inline(always)]
pub(crate) fn may_turn(set: &Set, now: &[&Block], then: &[&Block], tolerance: &Block) -> Block {
    let mut count = Count { tolerance, found: Block::splat(0.0) };
    let n = now.len();
    let mut change = [Block::splat(0.0); MAX_SIZE];
    for k in 0..n {
        change[k] = now[k].sub(then[k]);
    }
    let changes: [&Block; MAX_SIZE] = std::array::from_fn(|k| &change[k.min(n - 1)]);
    match set.shape() {
        Shape::Round { size: 3, .. } => count.part([now[0], now[1], now[2]], [&change[0], &change[1], &change[2]]),
        Shape::Round { .. } => count.part([now[0], now[1]], [&change[0], &change[1]]),
        Shape::Interval { .. } => count.part([now[0]], [&change[0]]),
        Shape::Diamond { half_length, .. } => {
            let lever = Block::splat(1.0 / half_length);
            for sign in [1.0, -1.0] {
                let diagonal = |w: [&Block; 2]| w[0].add(&w[1].mul(&lever).mul(&Block::splat(sign)));
                count.part([&diagonal([now[0], now[1]])], [&diagonal([&change[0], &change[1]])]);
            }
        }
        Shape::Pin(pin) => {
            let (ends, changed) = (end_reactions(pin, now), end_reactions(pin, &changes[..n]));
            for e in 0..2 {
                count.part([&ends[e][0], &ends[e][1]], [&changed[e][0], &changed[e][1]]);
            }
            if pin.across() == 1 {
                count.part([now[0]], [&change[0]]);
            }
        }
        Shape::Tapered(tapered) => {
            let (own, changed) = (own_forces(&tapered, now), own_forces(&tapered, &changes[..n]));
            // Whether the axis or the squares go out, and where these go.
            let (mut across, mut turned) = (own[0].abs(), changed[0].abs());
            for k in 0..2 * tapered.n {
                let taper = Block::splat(tapered.tapers[k / 2]);
                across = across.sub(&own[1 + k].abs().mul(&taper));
                turned = turned.add(&changed[1 + k].abs().mul(&taper));
            }
            count.part([&across], [&turned]);
            // Squares that an axis has closed by going out have no say, nor has the force on an axis that has not.
            for k in 0..2 * tapered.n {
                let before = count.found;
                count.part([&own[1 + k]], [&changed[1 + k]]);
                for i in 0..LANES {
                    let closed = across.0[i] > 0.0 && tapered.tapers[k / 2] >= 1.0;
                    count.found.0[i] = if closed { before.0[i] } else { count.found.0[i] };
                }
            }
            let before = count.found;
            count.part([&own[0]], [&changed[0]]);
            for i in 0..LANES {
                count.found.0[i] = if across.0[i] > 0.0 { count.found.0[i] } else { before.0[i] };
            }
        }
    }
    count.found
}
