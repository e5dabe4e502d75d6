//! Which sources have quantile functions, which of them scatter together, and what that makes of their moments.

use std::sync::Arc;

use crate::clearance::Set;
use crate::clearance::law::Law;
use crate::clearance::quantile::Quantile;
use crate::mechanism::scores::Scores;
use crate::mechanism::spec::{CorrelationSpec, LawSpec, SourceSpec, Spec};
use crate::mechanism::{Mechanism, Source};

/// Rows of a factor may be longer or shorter than 1 by this.
const LENGTH: f64 = 1e-9;

/// The quantile function of a source that needs one.
pub(super) fn quantile(spec: &Spec, number: usize) -> Result<Option<Arc<Quantile>>, String> {
    let SourceSpec { set, law, .. } = &spec.sources[number];
    let correlated = spec.correlations.iter().any(|group| group.sources.contains(&number));
    let scalar = |low: f64, high: f64| match law {
        LawSpec::Plain(law) => Some(Quantile::of(*law, low, high)),
        LawSpec::Scalar(law) => Quantile::of_scalar(law, low, high),
    };
    match (law, set) {
        (LawSpec::Plain(_), _) if !correlated => Ok(None),
        (_, Set::Interval { low, high }) => {
            scalar(*low, *high).map(Arc::new).map(Some).ok_or_else(|| "its law has numbers that make none".into())
        }
        _ => Err("only a source of one number has such a law or a correlation".into()),
    }
}

/// The groups of all sources that have quantile functions.
pub(super) fn groups(spec: &[CorrelationSpec], sources: &[Source]) -> Result<Vec<Scores>, String> {
    let mut grouped = vec![false; sources.len()];
    let mut groups = Vec::new();
    for CorrelationSpec { sources: members, factor } in spec {
        for &member in members {
            let free = sources.get(member).is_some_and(|source| source.quantile.is_some() && !source.is_clearance);
            if !free || std::mem::replace(&mut grouped[member], true) {
                return Err(format!("source {member} does not exist, is no single number, or is correlated twice"));
            }
        }
        let is_unit = |row: &Vec<f64>| {
            row.len() == factor[0].len() && (row.iter().map(|a| a * a).sum::<f64>() - 1.0).abs() <= LENGTH
        };
        if members.is_empty() || factor.len() != members.len() || !factor.iter().all(is_unit) {
            return Err("a correlation needs a factor with a row of length 1 for every source".into());
        }
        groups.push(Scores { sources: members.clone(), factor: factor.clone() });
    }
    let alone = (0..sources.len()).filter(|&s| sources[s].quantile.is_some() && !grouped[s]);
    groups.extend(alone.map(Scores::alone));
    Ok(groups)
}

impl LawSpec {
    /// The law by its name; that of a quantile function is its own.
    pub(super) const fn plain(&self) -> Law {
        match self {
            Self::Plain(law) => *law,
            Self::Scalar(_) => Law::Uniform,
        }
    }
}

impl Source {
    /// Mean and variance of its values, one for each component.
    pub(crate) fn moments(&self, law: Law) -> (Vec<f64>, Vec<f64>) {
        if let Some(quantile) = &self.quantile {
            let (mean, variance) = quantile.moments();
            return (vec![mean], vec![variance]);
        }
        let (mean, variance) = self.set.moments(law);
        (mean.to_vec(), variance.to_vec())
    }
}

impl Mechanism {
    /// Mean and covariance of all parameters as specimens scatter, row by row; the mean counts from the known deviations.
    #[must_use]
    pub fn parameter_moments(&self) -> (Vec<f64>, Vec<f64>) {
        let n = self.n_parameters();
        let (mut mean, mut covariance) = (vec![0.0; n], vec![0.0; n * n]);
        for source in &self.sources {
            let (means, variances) = source.moments(source.law);
            for (k, p) in source.range().enumerate() {
                mean[p] = means[k];
                covariance[p * n + p] = variances[k];
            }
        }
        for (a, b, together) in self.covariances() {
            let [a, b] = [a, b].map(|s| self.sources[s].first);
            covariance[a * n + b] = together;
            covariance[b * n + a] = together;
        }
        (mean, covariance)
    }

    /// The covariances of two sources that scatter together, each pair once.
    pub(crate) fn covariances(&self) -> Vec<(usize, usize, f64)> {
        let mut all = Vec::new();
        for group in &self.scores {
            for (i, &a) in group.sources.iter().enumerate() {
                for (j, &b) in group.sources.iter().enumerate().take(i) {
                    let correlation = group.correlation(i, j);
                    if let (Some(first), Some(second)) = (&self.sources[a].quantile, &self.sources[b].quantile)
                        && correlation != 0.0
                    {
                        all.push((a, b, first.covariance(second, correlation)));
                    }
                }
            }
        }
        all
    }

    /// The correlation of the scores of two sources.
    pub(crate) fn correlation_of_scores(&self, a: usize, b: usize) -> f64 {
        let both = |group: &Scores| {
            let place = |source: usize| group.sources.iter().position(|s| *s == source);
            Some(group.correlation(place(a)?, place(b)?))
        };
        self.scores.iter().find_map(both).unwrap_or(0.0)
    }
}
