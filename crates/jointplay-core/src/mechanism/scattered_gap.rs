//! Clearances whose gaps scatter with the sizes of their parts.
//!
//! With the gap g and an offset g v, v of the set with the gap 1,
//!
//! ```text
//! Var(g v) = E[g^2] Var v = (E[g]^2 + Var g) Var v
//! ```
//!
//! of which the second part is what the sizes contribute. Where a load presses the offset to the same v whatever the gap
//! is, only g scatters, and all of `Var(g v) = v^2 Var g` is theirs.

use std::ops::Deref;
use std::sync::Arc;

use crate::clearance::Set;
use crate::clearance::law::Law;
use crate::clearance::quantile::{Quantile, scores};
use crate::mechanism::gap::{Gap, Size};
use crate::mechanism::{Mechanism, Source};

/// What rounding makes of a bound.
const ROUNDING: f64 = 1e-9;
/// Scores of a mean over the sizes of a pair, per standard deviation.
const DENSE: f64 = 24.0;

/// A mechanism that may have other gaps.
pub(crate) enum Varied<'a> {
    Same(&'a Mechanism),
    Other(Arc<Mechanism>),
}

impl Deref for Varied<'_> {
    type Target = Mechanism;

    fn deref(&self) -> &Mechanism {
        match self {
            Self::Same(m) => m,
            Self::Other(m) => m,
        }
    }
}

/// Mean and variance of the gap, and the parts of the sizes in the variance.
struct Moments {
    mean: f64,
    variance: f64,
    parts: Vec<f64>,
}

impl Gap {
    fn moments(&self, m: &Mechanism) -> Moments {
        let (mut mean, mut least) = (self.base, self.base);
        let mut variances = Vec::new();
        for size in &self.sizes {
            let (source, centre) = (&m.sources[size.source], m.centre[size.parameter]);
            let (middle, variance) = source.moments(source.law);
            mean += size.factor * (centre + middle[0]);
            variances.push(size.factor * size.factor * variance[0]);
            least += match (source.set, source.is_within_limits()) {
                (Set::Interval { low, high }, true) => {
                    size.factor * centre + (size.factor * low).min(size.factor * high)
                }
                _ => f64::NEG_INFINITY,
            };
        }
        let correlation = match &self.sizes[..] {
            [first, second] => m.correlation_of_scores(first.source, second.source),
            _ => 0.0,
        };
        // Tables of laws take as long as thousands of samples: only where they are needed.
        let tables = || self.sizes.iter().map(|size| Part::of(m, size)).collect::<Vec<Part>>();
        // Every part varies with the whole.
        let mut parts = variances;
        if correlation != 0.0
            && let [first, second] = &tables()[..]
        {
            let together = first.factor * second.factor * first.quantile.covariance(&second.quantile, correlation);
            for part in &mut parts {
                *part += together;
            }
        }
        let variance: f64 = parts.iter().sum();
        if least.is_finite() && self.largest <= 0.0 {
            return Moments { mean: 0.0, variance: 0.0, parts: vec![0.0; parts.len()] };
        }
        if least >= 0.0 {
            return Moments { mean, variance, parts };
        }
        // What lies below zero is no play.
        let [lack, square] = shortfall(self.base, &tables(), correlation);
        let played = (mean + lack).max(0.0);
        let with_play = (mean * mean + variance - square - played * played).max(0.0);
        let scale = if variance > 0.0 { with_play / variance } else { 0.0 };
        Moments { mean: played, variance: with_play, parts: parts.iter().map(|part| part * scale).collect() }
    }
}

/// What a size adds to a gap, by the law of the size.
struct Part {
    factor: f64,
    centre: f64,
    quantile: Arc<Quantile>,
}

impl Part {
    fn of(m: &Mechanism, size: &Size) -> Self {
        let source = &m.sources[size.source];
        let of_law = || match source.set {
            Set::Interval { low, high } => Arc::new(Quantile::of(source.law, low, high)),
            _ => unreachable!("a size is one number"),
        };
        let quantile = source.quantile.clone().unwrap_or_else(of_law);
        Self { factor: size.factor, centre: m.centre[size.parameter], quantile }
    }

    fn at(&self, z: f64) -> f64 {
        self.factor * (self.centre + self.quantile.at(z))
    }
}

/// Means of what a gap of one or two parts lacks to zero, and of its square; their scores have a correlation.
fn shortfall(base: f64, parts: &[Part], correlation: f64) -> [f64; 2] {
    let beside = (1.0 - correlation * correlation).max(0.0).sqrt();
    let mut means = [0.0; 2];
    let mut add = |gap: f64, weight: f64| {
        let lack = (-gap).max(0.0);
        means[0] += weight * lack;
        means[1] += weight * lack * lack;
    };
    for (z, weight) in scores(DENSE) {
        match parts {
            [first, second] => {
                let gap = base + first.at(z);
                scores(DENSE).for_each(|(y, part)| add(gap + second.at(correlation * z + beside * y), weight * part));
            }
            parts => add(parts.iter().fold(base, |gap, part| gap + part.at(z)), weight),
        }
    }
    means
}

impl Source {
    /// Whether its values stay within its set.
    pub(crate) fn is_within_limits(&self) -> bool {
        match (&self.quantile, self.set) {
            (Some(quantile), Set::Interval { low, high }) => quantile.reach(low, high) <= 1.0 + ROUNDING,
            _ => self.law != Law::Gauss,
        }
    }

    /// Its set with the largest gap that sizes within their limits leave.
    pub(crate) fn largest_set(&self) -> Set {
        self.gap.as_ref().map_or(self.set, |gap| self.set.with_gap(gap.largest))
    }

    /// Its set for parameter values.
    pub(crate) fn set_at(&self, parameters: &[f64]) -> Set {
        self.gap.as_ref().map_or(self.set, |gap| self.set.with_gap(gap.at(parameters)))
    }

    /// Splits what its component `k` does between it and the sizes of its gap.
    pub(crate) fn split(&self, own: usize, k: usize, part: f64, mut add: impl FnMut(usize, f64)) {
        let Some(gap) = self.gap.as_ref().filter(|_| self.set.follows_gap(k)) else { return add(own, part) };
        let mut left = part;
        for size in &gap.sizes {
            add(size.source, size.share * part);
            left -= size.share * part;
        }
        add(own, left);
    }
}

impl Mechanism {
    /// Splits the value of component `k` of a source between it and the sizes of its gap where a load presses it to its
    /// boundary: it keeps its place in the gap that the known sizes leave, and every size does what it adds to the gap. Of a
    /// specimen without a gap that place is the one among the offsets `pressed`, of the known sizes.
    pub(crate) fn split_pressed(
        &self,
        own: usize,
        k: usize,
        value: f64,
        pressed: &[f64],
        parameters: &[f64],
        mut add: impl FnMut(usize, f64),
    ) {
        let source = &self.sources[own];
        let Some(gap) = source.gap.as_ref().filter(|_| source.set.follows_gap(k)) else { return add(own, value) };
        let centre = self.centre[source.first + k];
        let (known, drawn) = (gap.at(&self.centre), gap.at(parameters));
        let (offset, of) = if drawn > 0.0 { (value, drawn) } else { (pressed[source.first + k], known) };
        let place = if of > 0.0 { (offset - centre) / of } else { 0.0 };
        add(own, centre + place * known);
        let grown = |size: &Size| size.factor * (parameters[size.parameter] - self.centre[size.parameter]);
        let all: f64 = gap.sizes.iter().map(grown).sum();
        // What lies below zero is no play.
        let counts = if all == 0.0 { 0.0 } else { (drawn - known) / all };
        gap.sizes.iter().for_each(|size| add(size.source, place * counts * grown(size)));
    }

    /// Whether sizes of clearances scatter.
    pub(crate) fn has_sizes(&self) -> bool {
        self.sources.iter().any(|source| source.gap.is_some())
    }

    /// The mechanism with every gap the largest that there is, and the sizes that make it so.
    pub(crate) fn with_largest_gaps(&self) -> Varied<'_> {
        self.varied("largest gaps", Self::largest)
    }

    fn largest(&self) -> Self {
        let mut largest = self.clone();
        for source in &self.sources {
            for size in source.gap.iter().flat_map(|gap| &gap.sizes) {
                let own = &mut largest.sources[size.source];
                if let Set::Interval { low, high } = own.set {
                    largest.centre[size.parameter] += if size.factor > 0.0 { high } else { low };
                    own.set = Set::Interval { low: 0.0, high: 0.0 };
                }
            }
        }
        let centre = &largest.centre;
        let at = |gap: &Gap| {
            let all = gap.at(centre);
            let more = gap
                .sizes
                .iter()
                .map(|size| (size.factor * (centre[size.parameter] - self.centre[size.parameter])).max(0.0));
            let more: Vec<f64> = more.collect();
            let (sum, added) = (more.iter().sum::<f64>(), all - gap.at(&self.centre));
            let share = |more: &f64| if sum > 0.0 && all > 0.0 { more / sum * (added / all) } else { 0.0 };
            (all, more.iter().map(share).collect())
        };
        let gaps: Vec<Option<(f64, Vec<f64>)>> = self.sources.iter().map(|s| s.gap.as_ref().map(at)).collect();
        largest.with_gaps(gaps)
    }

    /// The mechanism with every gap the root of its mean square, by which its offsets scatter on the whole.
    pub(crate) fn with_scattered_gaps(&self) -> Varied<'_> {
        self.varied("scattered gaps", Self::scattered)
    }

    /// The mechanism with other gaps where sizes of clearances scatter, made once, so that it keeps what is recorded of it.
    fn varied(&self, what: &'static str, make: impl FnOnce(&Self) -> Self) -> Varied<'_> {
        if self.has_sizes() { Varied::Other(self.memo.get(what, || Arc::new(make(self)))) } else { Varied::Same(self) }
    }

    fn scattered(&self) -> Self {
        let at = |gap: &Gap| {
            let Moments { mean, variance, parts } = gap.moments(self);
            let square = mean * mean + variance;
            let share = |part: &f64| if square > 0.0 { part / square } else { 0.0 };
            (square.sqrt(), parts.iter().map(share).collect())
        };
        let gaps: Vec<Option<(f64, Vec<f64>)>> = self.sources.iter().map(|s| s.gap.as_ref().map(at)).collect();
        self.clone().with_gaps(gaps)
    }

    /// With other gaps, and the parts of their sizes in them.
    fn with_gaps(mut self, gaps: Vec<Option<(f64, Vec<f64>)>>) -> Self {
        for (source, gap) in self.sources.iter_mut().zip(gaps) {
            if let (Some(own), Some((gap, shares))) = (&mut source.gap, gap) {
                own.sizes.iter_mut().zip(shares).for_each(|(size, share)| size.share = share);
                source.set = source.set.with_gap(gap);
            }
        }
        self
    }
}
