//! What a load leaves open in a block of configurations.

use crate::clearance::Unforced;
use crate::clearance::offset::MAX_SIZE;
use crate::clearance::undecided::UNDECIDED;
use crate::closure::sensitivity::UNOBSERVABLE;
use crate::contact::push_on_lanes::exposed;
use crate::math::lanes::block::{Block, LANES};
use crate::mechanism::Mechanism;

/// The clearances that the load does not push to first order somewhere.
pub(super) fn released(m: &Mechanism, unforced: &[[Unforced; LANES]]) -> Vec<usize> {
    let clearances = m.sources().iter().zip(unforced).enumerate().filter(|(_, (source, _))| source.is_clearance);
    clearances.filter(|(_, (_, lanes))| lanes.iter().any(|unforced| !unforced.is_none())).map(|(s, _)| s).collect()
}

/// The sources that forces leave open, as [`Mechanism::leave_open`] has them.
pub(super) struct Openings {
    /// By source, whether everything about its offset is decided.
    pub decided: Vec<[bool; LANES]>,
    /// Whether what is open moves the output.
    pub observable: [bool; LANES],
}

impl Openings {
    pub fn none(m: &Mechanism) -> Self {
        Self { decided: vec![[true; LANES]; m.sources().len()], observable: [false; LANES] }
    }

    #[inline(always)]
    pub fn add<'b>(
        &mut self,
        m: &Mechanism,
        gradient: impl Fn(usize) -> &'b Block,
        scale: &Block,
        unforced: &[[Unforced; LANES]],
        map: impl Fn(usize, usize) -> &'b Block,
        reaches: &[Block; 6],
    ) {
        let tolerance = scale.mul(&Block::splat(UNDECIDED));
        let middle = [Block::splat(0.0); MAX_SIZE];
        for (s, source) in m.sources().iter().enumerate().filter(|(_, s)| s.is_clearance && !s.set.is_zero()) {
            let n = source.set.size();
            let faces = exposed(source, &gradient, &tolerance, Some((&middle, &unforced[s])));
            let mut any = 0.0;
            for i in 0..LANES {
                self.decided[s][i] &= faces.open.0[i] == 0.0;
                any += faces.open.0[i];
            }
            if any == 0.0 {
                continue;
            }
            for k in 0..m.size() {
                let row: [&Block; MAX_SIZE] = std::array::from_fn(|p| map(k, source.first + p.min(n - 1)));
                let width = faces.half_width(&row[..n]);
                for i in 0..LANES {
                    self.observable[i] |= width.0[i] > UNOBSERVABLE * reaches[k].0[i];
                }
            }
        }
    }
}
