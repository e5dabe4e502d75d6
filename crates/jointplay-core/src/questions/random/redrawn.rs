//! Specimens whose offsets are drawn anew, closed at one configuration and held against the limits. This happens in the blocks
//! in which they are drawn, because only yes or no is kept of each.

use crate::closure::recorded::program::Bound;
use crate::interrupt;
use crate::math::lanes::block::{Block, LANES, Mask};
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::math::vector::norm;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::questions::given::Place;
use crate::questions::random::chunk::put_quantities;
use crate::questions::random::draws::in_order;
use crate::questions::random::parts::Part;
use crate::questions::random::request::Request;

/// A part of the specimens.
struct Redrawn<'a> {
    place: Place<'a>,
    request: &'a Request,
    part: &'a Part,
    specimens: &'a [f64],
}

impl Redrawn<'_> {
    #[inline(never)]
    fn is_within_plainly(&self, parameters: Vec<f64>) -> bool {
        let mut quantities = self.place.closed_plainly(parameters);
        let (translations, rotations) = quantities.split_at(self.place.solver.mechanism.n_translations());
        let sizes = [norm(translations), norm(rotations)];
        quantities.extend(sizes);
        // NaN, of a specimen without a pose, keeps to no limit.
        quantities.iter().zip(&self.request.limits).all(|(&value, &[low, high])| value >= low && value <= high)
    }
}

impl Kernel for Redrawn<'_> {
    type Output = Vec<bool>;

    #[inline(always)]
    fn run(mut self) -> Vec<bool> {
        let m = self.place.solver.mechanism;
        let width = m.n_parameters();
        let mut numbers = self.part.numbers(self.request);
        let mut unsolved = vec![Block::splat(0.0); width];
        let mut quantities = vec![Block::splat(0.0); m.size() + 2];
        let mut within = Vec::with_capacity(self.part.count);
        for block in self.specimens.chunks(LANES * width) {
            interrupt::check();
            let parameters = self.place.bound.as_mut().map_or(&mut unsolved[..], Bound::parameters);
            m.draw(&mut numbers, self.request, parameters);
            m.keep_offsets(block, parameters);
            let (mut good, mut keeps) = (Mask::NONE, Mask::NONE);
            if let Some(bound) = &mut self.place.bound {
                good = bound.solve();
                put_quantities(bound, m.n_translations(), &mut quantities);
                keeps = all_within(&self.request.limits, &quantities);
            }
            for lane in 0..block.len() / width {
                let is_within = if good.has(lane) {
                    keeps.has(lane)
                } else {
                    let parameters = self.place.bound.as_mut().map_or(&mut unsolved[..], Bound::parameters);
                    let specimen = parameters.iter().map(|values| values.0[lane]).collect();
                    self.is_within_plainly(specimen)
                };
                within.push(is_within);
            }
        }
        within
    }
}

/// The lanes in which all quantities keep to their limits.
#[inline(always)]
fn all_within(limits: &[[f64; 2]], quantities: &[Block]) -> Mask {
    let mut within = Mask([u64::MAX; LANES]);
    for (&[low, high], values) in limits.iter().zip(quantities) {
        if low == f64::NEG_INFINITY && high == f64::INFINITY {
            continue;
        }
        let above = Mask::of(|lane| values.0[lane] >= low);
        let below = Mask::of(|lane| values.0[lane] <= high);
        for lane in 0..LANES {
            within.0[lane] &= above.0[lane] & below.0[lane];
        }
    }
    within
}

impl Mechanism {
    /// Whether specimens keep to the limits of the request at one configuration, with offsets drawn anew: those of
    /// [`Mechanism::specimens`], at the same part of the play of their own. One without a pose does not.
    #[must_use]
    pub fn within_redrawn(&self, case: Case<'_>, specimens: &[f64], request: &Request) -> Vec<bool> {
        let width = self.n_parameters();
        let find = |place: &Place<'_>| {
            in_order(request, |part, first| {
                let specimens = &specimens[first * width..(first + part.count) * width];
                dispatch(Redrawn { place: place.clone(), request, part, specimens })
            })
        };
        self.at_place(case, find, || vec![false; request.samples])
    }

    /// Puts specimens, row by row, into lanes that have drawn values, of which their clearances keep the offsets.
    #[inline(never)]
    fn keep_offsets(&self, specimens: &[f64], parameters: &mut [Block]) {
        let rows = || specimens.chunks_exact(self.n_parameters()).enumerate();
        let mut is_offset = vec![false; self.n_parameters()];
        for source in self.sources().iter().filter(|source| source.is_clearance) {
            is_offset[source.range()].fill(true);
            // Offsets of a gap that is always the same are as they are drawn.
            let Some(gap) = &source.gap else { continue };
            for (lane, specimen) in rows() {
                let theirs = gap.with_interference(|p| parameters[p].0[lane]).max(0.0);
                let own = gap.at(specimen);
                for (k, p) in source.range().enumerate() {
                    let drawn = &mut parameters[p].0[lane];
                    *drawn = self.offset_of_gaps(source, k, specimen[p], *drawn, own, theirs);
                }
            }
        }
        for (p, values) in parameters.iter_mut().enumerate().filter(|(p, _)| !is_offset[*p]) {
            rows().for_each(|(lane, specimen)| values.0[lane] = specimen[p]);
        }
    }
}
