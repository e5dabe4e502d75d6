//! Specimens of a determinate mechanism, given row by row: closed on lanes at one configuration, and with other offsets
//! of their clearances.

use rayon::prelude::*;

use crate::closure::equations::Inputs;
use crate::closure::newton::{Solver, State};
use crate::closure::recorded::program::{Bound, Newton};
use crate::interrupt;
use crate::math::lanes::block::{LANES, Mask};
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::mechanism::case::Case;
use crate::mechanism::{Mechanism, Source};

/// Specimens that one task closes.
const CHUNK: usize = 4096;

/// A configuration at which specimens are closed.
#[derive(Clone)]
pub(crate) struct Place<'a> {
    pub solver: &'a Solver<'a>,
    /// The recorded programs; without them every specimen is closed plainly.
    pub bound: Option<Bound<'a>>,
    built: &'a State,
    nominal: &'a State,
}

impl Place<'_> {
    /// The error of one specimen by the plain solver; NaN where it has no pose.
    #[inline(never)]
    pub fn closed_plainly(&self, parameters: Vec<f64>) -> Vec<f64> {
        let Self { solver, built, nominal, .. } = self;
        let inputs = Inputs { drives: built.inputs.drives.clone(), parameters };
        match solver.close(built, &inputs).map_or_else(|| solver.follow(built, &inputs), Ok) {
            Ok(state) if state.negative == built.negative => solver.mechanism.error(&state, nominal),
            _ => vec![f64::NAN; solver.mechanism.size()],
        }
    }
}

/// Specimens, closed lane by lane where the recorded iteration settles, else plainly.
struct Closed<'a> {
    place: Place<'a>,
    specimens: &'a [f64],
}

impl Kernel for Closed<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run(mut self) -> Vec<f64> {
        let m = self.place.solver.mechanism;
        let (width, size) = (m.n_parameters(), m.size());
        let mut errors = Vec::with_capacity(self.specimens.len() / width * size);
        for block in self.specimens.chunks(LANES * width) {
            interrupt::check();
            let lanes = block.len() / width;
            let mut good = Mask::NONE;
            if let Some(bound) = &mut self.place.bound {
                for (p, values) in bound.parameters().iter_mut().enumerate() {
                    for lane in 0..LANES {
                        // Lanes without a specimen repeat the first one.
                        values.0[lane] = block[if lane < lanes { lane * width + p } else { p }];
                    }
                }
                good = bound.solve();
            }
            for (lane, specimen) in block.chunks_exact(width).enumerate() {
                match &self.place.bound {
                    Some(bound) if good.has(lane) => errors.extend((0..size).map(|k| bound.error(k).0[lane])),
                    _ => errors.extend(self.place.closed_plainly(specimen.to_vec())),
                }
            }
        }
        errors
    }
}

impl Mechanism {
    /// What is found of specimens at one configuration; `none` where it has no pose.
    pub(crate) fn at_place<T: Send>(
        &self,
        case: Case<'_>,
        find: impl Fn(&Place<'_>) -> Vec<T> + Sync,
        none: impl Fn() -> Vec<T> + Sync,
    ) -> Vec<T> {
        let solver = self.solver(&[case]);
        let newton = solver.as_ref().and_then(Newton::record);
        let found = self.each(
            solver.as_ref(),
            &[case],
            |solver, _, case, nominal| {
                let Ok(built) = solver.follow(&nominal, &self.built(case.drives)) else { return none() };
                let bound = newton.as_ref().map(|newton| newton.bind(self, &nominal, case.drives));
                find(&Place { solver, bound, built: &built, nominal: &nominal })
            },
            &none,
        );
        found.into_iter().flatten().collect()
    }

    /// The exact error of every specimen at one configuration, specimen after specimen; NaN where it has no pose. The
    /// mechanism has to be determinate.
    #[must_use]
    pub fn errors_of(&self, case: Case<'_>, specimens: &[f64]) -> Vec<f64> {
        let (width, size) = (self.n_parameters(), self.size());
        let find = |place: &Place<'_>| {
            let chunk = |specimens: &[f64]| dispatch(Closed { place: place.clone(), specimens });
            specimens.par_chunks(CHUNK * width).map(chunk).collect::<Vec<_>>().concat()
        };
        self.at_place(case, find, || vec![f64::NAN; specimens.len() / width * size])
    }

    /// Every specimen with the offsets of its clearances where they reach farthest along its weights of the parameters; with
    /// all others as well, but for the sizes of clearances.
    #[must_use]
    pub fn at_supports(&self, specimens: &[f64], weights: &[f64], all: bool) -> Vec<f64> {
        let gaps = self.sources.iter().filter_map(|source| source.gap.as_ref());
        let sizes: Vec<usize> = gaps.flat_map(|gap| gap.sizes.iter().map(|size| size.parameter)).collect();
        let is_put = |source: &Source| source.is_clearance || all && !sizes.contains(&source.first);
        self.with_offsets(specimens, weights, is_put, |source, specimen, weights, values| {
            let face = source.set_at(specimen).face(&weights[source.range()], 0.0);
            source.range().zip(face.centre).for_each(|(p, offset)| values[p] = self.centre[p] + offset);
        })
    }

    /// Every specimen with the offsets of another one, at the same part of the play of its own. Where the other one has
    /// no play there is nothing to take over.
    #[must_use]
    pub fn with_offsets_of(&self, specimens: &[f64], others: &[f64]) -> Vec<f64> {
        let is_clearance = |source: &Source| source.is_clearance;
        self.with_offsets(specimens, others, is_clearance, |source, specimen, other, values| {
            let gaps = source.gap.as_ref().map(|gap| [gap.at(specimen), gap.at(other)]);
            for (k, p) in source.range().enumerate() {
                values[p] = gaps.map_or(other[p], |[own, theirs]| {
                    self.offset_of_gaps(source, k, specimen[p], other[p], own, theirs)
                });
            }
        })
    }

    /// Coordinate `k` of an offset at the same part of the play as another one, by the gaps of both.
    pub(crate) fn offset_of_gaps(&self, source: &Source, k: usize, own: f64, other: f64, gap: f64, theirs: f64) -> f64 {
        if theirs <= 0.0 {
            return own;
        }
        let centre = self.centre[source.range().start + k];
        if source.set.follows_gap(k) { centre + (other - centre) * (gap / theirs) } else { other }
    }

    /// Specimens of which the values of some sources are put in anew, with a row beside each.
    fn with_offsets(
        &self,
        specimens: &[f64],
        beside: &[f64],
        is_put: impl Fn(&Source) -> bool,
        put: impl Fn(&Source, &[f64], &[f64], &mut [f64]) + Sync,
    ) -> Vec<f64> {
        // Of no parameters there are no rows to go through.
        let width = self.n_parameters().max(1);
        let sources: Vec<&Source> = self.sources().iter().filter(|source| is_put(source)).collect();
        let mut found = specimens.to_vec();
        let size = CHUNK * width;
        let chunks = found.par_chunks_mut(size).zip(specimens.par_chunks(size)).zip(beside.par_chunks(size));
        chunks.for_each(|((found, specimens), beside)| {
            interrupt::check();
            let rows = specimens.chunks_exact(width).zip(beside.chunks_exact(width));
            for (values, (specimen, beside)) in found.chunks_exact_mut(width).zip(rows) {
                for source in &sources {
                    put(source, specimen, beside, values);
                }
            }
        });
        found
    }
}
