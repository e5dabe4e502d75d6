//! The largest error of strained specimens: over all deviations, each specimen where its energy is least.
//!
//! The error is a piecewise smooth function of the deviations, neither convex nor concave. It is climbed from the best
//! of many corners: towards the corner that the slope points to, as far as is gained on the way (Frank and Wolfe).

use crate::questions::worst::ascent::Measure;
use crate::questions::worst::over_constrained::model::{Model, Strained, Tried};

/// Corners from which an extreme is climbed.
const CLIMBS: usize = 8;
/// Steps of a climb.
const MOST_STEPS: usize = 20;
/// Differences that tell the slope, as parts of the half widths.
const DIFFERENCE: f64 = 1e-3;
/// Parts of the way that are tried.
const PARTS: [f64; 7] = [1.0, 0.7, 0.5, 0.25, 0.1, 0.03, 0.005];
/// A climb is over when it gains less than this part: more would be the load of the direction.
const GAIN: f64 = 1e-6;

/// Where a climb is.
#[derive(Clone, Debug)]
pub(super) struct Climb {
    pub measure: Measure,
    pub specimen: Vec<f64>,
    pub strained: Strained,
    pub value: f64,
    over: bool,
}

impl Model<'_> {
    pub fn value(&self, measure: Measure, strained: &Strained) -> f64 {
        measure.value(&strained.error, self.system.mechanism.n_translations())
    }

    /// The weights of the output's components in a measure.
    pub fn weights(&self, measure: Measure, error: &[f64]) -> Vec<f64> {
        self.system.mechanism.weights(measure, error)
    }

    /// The best climbs of every measure, from corners; the highest first.
    pub fn begin(&self, measures: &[Measure], corners: &[Vec<f64>]) -> Vec<Vec<Climb>> {
        let still: Vec<Tried> = corners.iter().map(|specimen| self.unpulled(specimen.clone())).collect();
        let free = self.poses(&still);
        let of = |&measure: &Measure| {
            let asks = corners.iter().zip(&free).filter_map(|(specimen, strained)| {
                let weights = self.weights(measure, &strained.as_ref()?.error);
                Some(Tried { specimen: specimen.clone(), weights })
            });
            let asks: Vec<Tried> = asks.collect();
            let found = self.poses(&asks).into_iter().zip(asks).filter_map(|(strained, ask)| {
                let strained = strained?;
                let value = self.value(measure, &strained);
                Some(Climb { measure, specimen: ask.specimen, strained, value, over: false })
            });
            let mut found: Vec<Climb> = found.collect();
            found.sort_by(|a, b| b.value.total_cmp(&a.value));
            found.truncate(CLIMBS);
            found
        };
        measures.iter().map(of).collect()
    }

    /// Climbs, all of them side by side.
    pub fn climb(&self, climbs: &mut [Climb]) {
        let n = self.deviations.len();
        for _ in 0..MOST_STEPS {
            let mut open: Vec<&mut Climb> = climbs.iter_mut().filter(|climb| !climb.over).collect();
            if open.is_empty() || n == 0 {
                break;
            }
            let slopes = self.slopes(&open);
            let mut asks = Vec::new();
            for (climb, (weights, slope)) in open.iter().zip(&slopes) {
                let target = self.deviations.farthest(slope, &climb.specimen);
                asks.push(Tried { specimen: climb.specimen.clone(), weights: weights.clone() });
                asks.extend(PARTS.map(|part| {
                    let specimen = climb.specimen.iter().zip(&target).map(|(a, b)| a + part * (b - a)).collect();
                    Tried { specimen, weights: weights.clone() }
                }));
            }
            let mut found = self.poses(&asks).into_iter().zip(asks);
            for climb in &mut open {
                let before = climb.value;
                for (strained, ask) in found.by_ref().take(PARTS.len() + 1) {
                    let Some(strained) = strained else { continue };
                    let value = self.value(climb.measure, &strained);
                    if value > climb.value {
                        (climb.value, climb.specimen, climb.strained) = (value, ask.specimen, strained);
                    }
                }
                climb.over = climb.value - before <= GAIN * climb.value.abs();
            }
        }
    }

    /// The weights of every climb's measure where it is, and its slope along the deviations.
    fn slopes(&self, climbs: &[&mut Climb]) -> Vec<(Vec<f64>, Vec<f64>)> {
        let widths = self.deviations.half_widths();
        let n = widths.len();
        let mut asks = Vec::new();
        // Inwards, where that is possible.
        let step = |climb: &Climb, k: usize| if climb.specimen[k] > 0.0 { -DIFFERENCE } else { DIFFERENCE } * widths[k];
        for climb in climbs {
            let weights = self.weights(climb.measure, &climb.strained.error);
            for k in 0..=n {
                let mut specimen = climb.specimen.clone();
                if k < n {
                    specimen[k] += step(climb, k);
                }
                asks.push(Tried { specimen, weights: weights.clone() });
            }
        }
        let poses = self.poses(&asks);
        let along = |(ask, pose): (&Tried, &Option<Strained>)| -> Option<f64> {
            Some(ask.weights.iter().zip(&pose.as_ref()?.error).map(|(w, e)| w * e).sum())
        };
        let reached: Vec<Option<f64>> = asks.iter().zip(&poses).map(along).collect();
        let slope = |(number, climb): (usize, &&mut Climb)| {
            let own = &reached[number * (n + 1)..(number + 1) * (n + 1)];
            let rise = |k: usize| Some((own[k]? - own[n]?) / step(climb, k));
            (asks[number * (n + 1)].weights.clone(), (0..n).map(|k| rise(k).unwrap_or(0.0)).collect())
        };
        climbs.iter().enumerate().map(slope).collect()
    }
}
