//! Quantiles of a quantity whose range is not known beforehand, to a relative accuracy: counts in bins
//! whose edges grow geometrically (Masson, Rim and Lee, Proc. VLDB Endow. 12, 2019, 2195). Sketches merge
//! without loss, and their size grows with the logarithm of the range only.

use std::collections::BTreeMap;

/// Relative accuracy of the quantiles.
pub const ACCURACY: f64 = 1e-3;

/// Counts by size and sign.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sketch {
    /// By bin; negative numbers are counted apart, by their size.
    positive: BTreeMap<i32, u64>,
    negative: BTreeMap<i32, u64>,
    zeros: u64,
    infinite: u64,
    count: u64,
}

/// Ratio of one edge to the last.
fn growth() -> f64 {
    ((1.0 + ACCURACY) / (1.0 - ACCURACY)).ln()
}

impl Sketch {
    /// Counts a number; positive infinity is one.
    pub fn add(&mut self, value: f64) {
        self.count += 1;
        if value == f64::INFINITY {
            self.infinite += 1;
        } else if value == 0.0 {
            self.zeros += 1;
        } else {
            // Below 1e-300 or so numbers share a bin.
            let bin = (value.abs().max(f64::MIN_POSITIVE).ln() / growth()).ceil() as i32;
            let bins = if value > 0.0 { &mut self.positive } else { &mut self.negative };
            *bins.entry(bin).or_default() += 1;
        }
    }

    /// Adds all numbers of another sketch.
    pub fn merge(&mut self, other: &Self) {
        for (bins, more) in [(&mut self.positive, &other.positive), (&mut self.negative, &other.negative)] {
            for (bin, count) in more {
                *bins.entry(*bin).or_default() += count;
            }
        }
        self.zeros += other.zeros;
        self.infinite += other.infinite;
        self.count += other.count;
    }

    /// A quantile: within [`ACCURACY`] of a number with that rank; NaN of nothing.
    #[must_use]
    pub fn quantile(&self, probability: f64) -> f64 {
        if self.count == 0 {
            return f64::NAN;
        }
        let rank = probability * self.count as f64;
        // The middle of a bin, in the sense of relative accuracy.
        let middle = |bin: i32| (f64::from(bin) * growth()).exp() * (1.0 - ACCURACY);
        let negative = self.negative.iter().rev().map(|(bin, n)| (-middle(*bin), *n));
        let positive = self.positive.iter().map(|(bin, n)| (middle(*bin), *n));
        let rest = [(f64::INFINITY, self.infinite)];
        let mut below = 0;
        negative
            .chain([(0.0, self.zeros)])
            .chain(positive)
            .chain(rest)
            .filter(|(_, n)| *n > 0)
            .find(|(_, n)| {
                below += n;
                below as f64 >= rank
            })
            .map_or(f64::NAN, |(value, _)| value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_within_the_accuracy_over_many_decades() {
        let values: Vec<f64> =
            (-4000..=4000).map(|k| f64::from(k).signum() * (f64::from(k).abs() / 100.0).exp()).collect();
        let (mut all, mut other) = (Sketch::default(), Sketch::default());
        for (k, value) in values.iter().enumerate() {
            if k % 3 == 0 { other.add(*value) } else { all.add(*value) }
        }
        all.merge(&other);
        for p in [0.001, 0.1, 0.3, 0.5, 0.8, 0.999] {
            let exact = values[((p * values.len() as f64).ceil() as usize).max(1) - 1];
            assert!((all.quantile(p) - exact).abs() <= 1.001 * ACCURACY * exact.abs(), "{p}");
        }
        all.add(f64::INFINITY);
        assert!(all.quantile(1.0).is_infinite() && all.quantile(0.999).is_finite());
        assert!(Sketch::default().quantile(0.5).is_nan());
    }
}
