//! What samples say of the scatter, and the standard errors of what they say.
//!
//! With R independent replicates, each of a share `w_g` of the samples, whose means of some quantity are `m_g`, that of all is
//! `m = sum w_g m_g`, and
//!
//! ```text
//! SE(m)^2 = sum w_g (m_g - m)^2 / (R - 1)
//! ```
//!
//! is an unbiased estimate of its variance, whatever points the replicates consist of. The covariance is estimated without bias by
//! `mean of (x - m)(x - m)' + Cov(m)`. Plain samples are their own replicates: `SE(m)^2 = s^2/n`, and that of a variance is
//! `(m_4 - s^4)/n`. A quantile is as uncertain as the share p of the samples below it: from `Q(p - SE(p))` to `Q(p + SE(p))`. Where a
//! first-order error is a [`Control`] and the replicates differ less with it, p is corrected by what the samples miss of its share.

use crate::questions::columns::Scatter;
use crate::questions::random::control::Control;
use crate::questions::random::request::Request;
use crate::questions::random::tally::{Ranges, Tally};

/// So many times less the replicates have to differ with a control. How much they differ is known within a fifth: to take what is less
/// by chance would make standard errors too small.
const CLEARLY: f64 = 1.5;

/// All samples, and the independent sets that they come from.
pub(crate) struct Replicates<'r> {
    pub total: Tally,
    each: Vec<Tally>,
    ranges: &'r Ranges,
    control: &'r Control,
}

impl<'r> Replicates<'r> {
    pub fn new(mut each: Vec<Tally>, ranges: &'r Ranges, control: &'r Control) -> Self {
        let mut rest = each.iter_mut();
        let mut total = rest.next().expect("there is a replicate").clone();
        for more in rest {
            total.merge(more);
        }
        each.retain(|tally| tally.drawn() > 0);
        for tally in &mut each {
            tally.kept = None;
        }
        Self { total, each, ranges, control }
    }

    /// What is found on the exact closure, beside the rest.
    pub fn scatter(&self, request: &Request, rest: Scatter) -> Scatter {
        let Self { total, ranges, .. } = self;
        let n = total.mean.len();
        let covariance = self.covariance();
        let std: Vec<f64> = (0..n).map(|i| covariance[i * (n + 1)].sqrt()).collect();
        let (outside_quantity, outside) = total.outside(&request.limits);
        let (quantile, quantile_standard_error) = self.quantiles(&request.probabilities);
        Scatter {
            mean: total.mean.clone(),
            mean_standard_error: (0..n).map(|i| self.of_mean(i)).collect(),
            std_standard_error: (0..n).map(|i| self.of_std(i, std[i])).collect(),
            covariance,
            quantile_standard_error,
            quantile,
            quantile_resolution: ranges.resolution(),
            histogram: total.histogram(),
            edges: ranges.edges(),
            outside,
            outside_standard_error: self.of_outside(outside, |tally| tally.outside(&request.limits).1),
            outside_quantity_standard_error: (0..outside_quantity.len())
                .map(|q| self.of_outside(outside_quantity[q], |tally| tally.outside(&request.limits).0[q]))
                .collect(),
            outside_quantity,
            largest: total.largest.clone(),
            failures: total.statuses.to_vec(),
            fallbacks: total.fallbacks,
            interference: total.share_of_interference(),
            ..rest
        }
    }

    /// Whether the replicates differ by what their means miss.
    fn are_several(&self) -> bool {
        self.each.len() > 1
    }

    /// The variance of a mean over all solved samples, by those of the replicates.
    fn variance(&self, mean: f64, of: impl Fn(&Tally) -> f64) -> f64 {
        self.spread(mean, |tally| tally.count, of)
    }

    fn spread(&self, mean: f64, samples: impl Fn(&Tally) -> u64, of: impl Fn(&Tally) -> f64) -> f64 {
        let used = self.each.iter().filter(|tally| samples(tally) > 0);
        let square = |tally: &Tally| samples(tally) as f64 * (of(tally) - mean).powi(2);
        used.map(square).sum::<f64>() / (samples(&self.total) as f64 * (self.each.len() - 1) as f64)
    }

    /// Unbiased.
    fn covariance(&self) -> Vec<f64> {
        let mut covariance = self.total.covariance();
        if !self.are_several() {
            return covariance;
        }
        let (n, count) = (self.total.mean.len(), self.total.count as f64);
        let off = |tally: &Tally, i: usize| tally.mean[i] - self.total.mean[i];
        for (k, value) in covariance.iter_mut().enumerate() {
            let product = |tally: &Tally| tally.count as f64 * off(tally, k / n) * off(tally, k % n);
            let of_mean = self.each.iter().map(product).sum::<f64>() / (count * (self.each.len() - 1) as f64);
            *value = *value * (count - 1.0) / count + of_mean;
        }
        covariance
    }

    fn of_mean(&self, i: usize) -> f64 {
        let mean = self.total.mean[i];
        if self.are_several() {
            return self.variance(mean, |tally| tally.mean[i]).sqrt();
        }
        (self.total.variance_about(i, mean) / (self.total.count as f64 - 1.0)).sqrt()
    }

    fn of_std(&self, i: usize, std: f64) -> f64 {
        let mean = self.total.mean[i];
        let square = self.total.variance_about(i, mean);
        let variance = if self.are_several() {
            self.variance(square, |tally| tally.variance_about(i, mean))
        } else {
            (self.total.fourth_moment(self.ranges, i) - square * square).max(0.0) / self.total.count as f64
        };
        // What does not vary has no error, either.
        if std > 0.0 { variance.sqrt() / (2.0 * std) } else { 0.0 * std }
    }

    /// Quantiles of all quantities, probability by probability, and their standard errors.
    fn quantiles(&self, probabilities: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let quantities = self.total.largest.len();
        let mut found = vec![[f64::NAN; 2]; probabilities.len() * quantities];
        let mut rising: Vec<usize> = (0..probabilities.len()).collect();
        rising.sort_by(|&a, &b| probabilities[a].total_cmp(&probabilities[b]));
        for q in 0..quantities {
            // Corrections are not to turn the order of quantiles.
            let mut least = f64::NEG_INFINITY;
            for &k in &rising {
                let (rank, part) = self.rank(q, k, probabilities[k]);
                let value = self.total.quantile(self.ranges, q, rank);
                let value = if value < least { least } else { value };
                least = value;
                found[k * quantities + q] = [value, self.of_quantile(q, rank, part)];
            }
        }
        found.into_iter().map(<[f64; 2]>::into).unzip()
    }

    /// The share of the samples below a quantile, and what it misses: with or without the control, as the replicates differ less.
    fn rank(&self, q: usize, k: usize, probability: f64) -> (f64, f64) {
        let plainly = self.total.quantile(self.ranges, q, probability);
        let below = |tally: &Tally, value: f64| tally.below(self.ranges, q, value);
        let part = self.of_share(probability, |tally| tally.count, |tally| below(tally, plainly));
        let Some(share) = self.control.share(q, k).filter(|_| self.are_several()) else { return (probability, part) };
        let place = q * self.control.probabilities() + k;
        let missed = |tally: &Tally| tally.below[place] as f64 / tally.compared as f64 - share;
        let rank = probability + missed(&self.total);
        if !(rank > 0.0 && rank < 1.0) {
            return (probability, part);
        }
        let value = self.total.quantile(self.ranges, q, rank);
        let with = self.of_share(probability, |tally| tally.count, |tally| below(tally, value) - missed(tally));
        // Between two samples nothing is known of the law.
        let with = with.hypot(1.0 / self.total.count as f64);
        if with * CLEARLY < part { (rank, with) } else { (probability, part) }
    }

    /// Half of the way between the quantiles of a share less and more what it misses.
    fn of_quantile(&self, q: usize, share: f64, part: f64) -> f64 {
        let at = |p: f64| self.total.quantile(self.ranges, q, p);
        let (below, above) = (share - part, share + part);
        // At the ends of the law one side is all that there is.
        match (below > 0.0, above < 1.0) {
            (true, true) => 0.5 * (at(above) - at(below)),
            (true, false) => at(share) - at(below),
            (false, true) => at(above) - at(share),
            (false, false) => f64::NAN,
        }
    }

    /// That of a share of all samples that were drawn, solved or not.
    fn of_outside(&self, share: f64, of: impl Fn(&Tally) -> f64) -> f64 {
        self.of_share(share, Tally::drawn, of)
    }

    fn of_share(&self, share: f64, samples: impl Fn(&Tally) -> u64, of: impl Fn(&Tally) -> f64) -> f64 {
        let plainly = || share * (1.0 - share) / samples(&self.total) as f64;
        if self.are_several() { self.spread(share, samples, of).sqrt() } else { plainly().sqrt() }
    }
}
