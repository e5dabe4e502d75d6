//! All deviations together: what a built specimen brings with it, whatever the clearances do.

use crate::clearance::Set;
use crate::cone::Kind;
use crate::mechanism::{Mechanism, Source};

/// Corners that are tried: all of so many deviations.
const EVERY_CORNER: usize = 6;

/// The product of the sets of all sources that are no clearances.
#[derive(Clone, Debug)]
pub(super) struct Deviations<'m> {
    mechanism: &'m Mechanism,
    sources: Vec<&'m Source>,
}

impl<'m> Deviations<'m> {
    pub fn of(mechanism: &'m Mechanism) -> Self {
        let sources = mechanism.sources.iter().filter(|source| !source.is_clearance && !source.set.is_zero());
        Self { mechanism, sources: sources.collect() }
    }

    /// Number of components.
    pub fn len(&self) -> usize {
        self.sources.iter().map(|source| source.set.size()).sum()
    }

    /// Where a basis keeps every component.
    pub fn columns(&self) -> Vec<usize> {
        self.sources.iter().flat_map(|source| source.range()).map(|p| self.mechanism.place_of(p)).collect()
    }

    /// How far every component goes.
    pub fn half_widths(&self) -> Vec<f64> {
        self.sources.iter().flat_map(|source| (0..source.set.size()).map(|k| source.set.half_width(k))).collect()
    }

    /// The values of all parameters of a specimen, clearances in the middle.
    pub fn parameters(&self, specimen: &[f64]) -> Vec<f64> {
        let mut parameters = self.mechanism.centre.clone();
        let own = self.sources.iter().flat_map(|source| source.range());
        own.zip(specimen).for_each(|(p, d)| parameters[p] += d);
        parameters
    }

    /// The farthest specimen along a direction; what that does not move stays where it is.
    pub fn farthest(&self, direction: &[f64], from: &[f64]) -> Vec<f64> {
        let (mut specimen, mut first) = (from.to_vec(), 0);
        for source in &self.sources {
            let own = first..first + source.set.size();
            let nearest = source.set.face(&direction[own.clone()], 0.0).nearest(&from[own.clone()]);
            specimen[own.clone()].iter_mut().zip(nearest).for_each(|(u, n)| *u = n);
            first = own.end;
        }
        specimen
    }

    /// Their sets, and where a basis keeps them.
    pub fn blocks(&self) -> impl Iterator<Item = (Kind, Vec<usize>)> + '_ {
        let columns = |source: &Source| source.range().map(|p| self.mechanism.place_of(p)).collect();
        self.sources.iter().map(move |source| (Kind::Fixed(source.set), columns(source)))
    }

    /// Whether each is within an interval of its own.
    pub fn is_box(&self) -> bool {
        self.sources.iter().all(|source| matches!(source.set, Set::Interval { .. }))
    }

    /// All corners.
    pub fn every_corner(&self) -> impl Iterator<Item = Vec<f64>> + '_ {
        let (n, middle) = (self.len(), vec![0.0; self.len()]);
        (0..1_usize << n).map(move |corner| {
            let high = (0..n).map(|k| if corner >> k & 1 == 1 { 1.0 } else { -1.0 });
            self.farthest(&high.collect::<Vec<f64>>(), &middle)
        })
    }

    /// Corners: all of them where they are few, else as many spread over them, and the farthest along and against
    /// some directions.
    pub fn corners(&self, directions: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let (n, middle) = (self.len(), vec![0.0; self.len()]);
        let mut corners: Vec<Vec<f64>> = if n <= EVERY_CORNER {
            self.every_corner().collect()
        } else {
            // Without a pattern, the same every time.
            let side = |corner: usize, k: usize| (((corner + 1) * (k + 3)) as f64 * 0.618_034).fract() - 0.5;
            let corner = |number| self.farthest(&(0..n).map(|k| side(number, k)).collect::<Vec<f64>>(), &middle);
            (0..1 << EVERY_CORNER).map(corner).collect()
        };
        for direction in directions {
            let against: Vec<f64> = direction.iter().map(|d| -d).collect();
            corners.extend([direction, &against].map(|d| self.farthest(d, &middle)));
        }
        corners.sort_by(|a, b| {
            a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
        });
        corners.dedup();
        corners
    }
}
