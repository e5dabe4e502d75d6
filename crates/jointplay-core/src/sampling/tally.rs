//! Moments, histograms and counts of samples, mergeable without loss.

use crate::status::Status;

/// Bins of the histograms that are handed out.
pub const BINS: usize = 128;
/// Fine bins per handed-out bin; quantiles are read from the fine ones.
const FINE: usize = 32;
/// Room beyond the first-order range, for what the exact closure adds.
const ROOM: f64 = 1.25;

/// The range of every quantity's histogram.
pub struct Ranges {
    low: Vec<f64>,
    width: Vec<f64>,
}

impl Ranges {
    /// From the mean and half-range of every component.
    pub fn new(mean: &[f64], half: &[f64], translations: usize) -> Self {
        // A quantity that cannot vary still needs a bin to fall in.
        let reach: Vec<f64> =
            mean.iter().zip(half).map(|(m, h)| (ROOM * h).max(1e-12 * m.abs()).max(f64::MIN_POSITIVE.sqrt())).collect();
        let mut low: Vec<f64> = mean.iter().zip(&reach).map(|(m, r)| m - r).collect();
        let mut width: Vec<f64> = reach.iter().map(|r| 2.0 * r).collect();
        let size =
            |range: std::ops::Range<usize>| range.map(|i| (mean[i].abs() + reach[i]).powi(2)).sum::<f64>().sqrt();
        low.extend([0.0, 0.0]);
        width.extend([size(0..translations), size(translations..mean.len())]);
        Self { low, width }
    }

    fn len(&self) -> usize {
        self.low.len()
    }

    /// Width of the fine bins.
    pub fn resolution(&self) -> Vec<f64> {
        self.width.iter().map(|w| w / (BINS * FINE) as f64).collect()
    }

    /// Edges of the handed-out bins.
    pub fn edges(&self) -> Vec<f64> {
        let of = |q: usize| (0..=BINS).map(move |b| self.low[q] + self.width[q] * b as f64 / BINS as f64);
        (0..self.len()).flat_map(of).collect()
    }
}

/// What is kept of a set of samples.
pub struct Tally {
    /// Solved samples.
    pub count: u64,
    /// Mean of every component.
    pub mean: Vec<f64>,
    /// Sums of products of deviations from the mean, row by row.
    products: Vec<f64>,
    bins: Vec<u64>,
    /// Largest size of every quantity.
    pub largest: Vec<f64>,
    /// Samples beyond an acceptance limit.
    pub outside: u64,
    /// Samples by status.
    pub statuses: [u64; Status::ALL.len()],
}

impl Tally {
    pub fn new(components: usize, ranges: &Ranges) -> Self {
        Self {
            count: 0,
            mean: vec![0.0; components],
            products: vec![0.0; components * components],
            bins: vec![0; ranges.len() * BINS * FINE],
            largest: vec![0.0; ranges.len()],
            outside: 0,
            statuses: [0; Status::ALL.len()],
        }
    }

    /// Adds a solved sample (Welford's update).
    pub fn add(&mut self, ranges: &Ranges, quantities: &[f64], outside: bool) {
        let n = self.mean.len();
        self.count += 1;
        self.statuses[Status::Ok as usize] += 1;
        self.outside += u64::from(outside);
        let weight = 1.0 / self.count as f64;
        let before: Vec<f64> = (0..n).map(|i| quantities[i] - self.mean[i]).collect();
        for i in 0..n {
            self.mean[i] += before[i] * weight;
        }
        for i in 0..n {
            for j in 0..n {
                self.products[i * n + j] += before[i] * before[j] * (1.0 - weight);
            }
        }
        for (q, &value) in quantities.iter().enumerate() {
            self.largest[q] = self.largest[q].max(value.abs());
            let place = (value - ranges.low[q]) / ranges.width[q] * (BINS * FINE) as f64;
            // Beyond the range the end bins serve; casts saturate.
            let bin = (place.max(0.0) as usize).min(BINS * FINE - 1);
            self.bins[q * BINS * FINE + bin] += 1;
        }
    }

    /// Adds all samples of another tally (Chan's update).
    pub fn merge(&mut self, other: &Self) {
        let n = self.mean.len();
        if other.count > 0 {
            let (a, b) = (self.count as f64, other.count as f64);
            let between: Vec<f64> = (0..n).map(|i| other.mean[i] - self.mean[i]).collect();
            for i in 0..n {
                for j in 0..n {
                    self.products[i * n + j] += other.products[i * n + j] + between[i] * between[j] * (a * b / (a + b));
                }
            }
            for i in 0..n {
                self.mean[i] += between[i] * (b / (a + b));
            }
        }
        self.count += other.count;
        self.outside += other.outside;
        self.bins.iter_mut().zip(&other.bins).for_each(|(a, b)| *a += b);
        self.statuses.iter_mut().zip(&other.statuses).for_each(|(a, b)| *a += b);
        self.largest.iter_mut().zip(&other.largest).for_each(|(a, b)| *a = a.max(*b));
    }

    /// Unbiased covariance.
    pub fn covariance(&self) -> Vec<f64> {
        self.products.iter().map(|p| p / (self.count as f64 - 1.0)).collect()
    }

    /// A quantile of every quantity, interpolated within its fine bin.
    pub fn quantiles(&self, ranges: &Ranges, probability: f64) -> Vec<f64> {
        (0..ranges.len())
            .map(|q| {
                let bins = &self.bins[q * BINS * FINE..(q + 1) * BINS * FINE];
                let rank = probability * self.count as f64;
                let mut below = 0.0;
                for (b, &count) in bins.iter().enumerate() {
                    let here = count as f64;
                    if here > 0.0 && below + here >= rank {
                        let place = b as f64 + ((rank - below) / here).clamp(0.0, 1.0);
                        return ranges.low[q] + ranges.width[q] * place / (BINS * FINE) as f64;
                    }
                    below += here;
                }
                f64::NAN
            })
            .collect()
    }

    /// Counts in the handed-out bins.
    pub fn histogram(&self) -> Vec<u64> {
        self.bins.chunks_exact(FINE).map(|fine| fine.iter().sum()).collect()
    }
}
