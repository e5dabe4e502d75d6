//! The first-order error as a control: what the same samples miss of a share that is known makes the quantiles of the exact closure
//! more certain.
//!
//! To first order the error is a sum over independent sources, `L = c + sum G_s x_s`, and the product of their characteristic
//! functions is that of L. The shares below a value follow from it.
//!
//! With F the share of the exact error below its p-quantile, and f of the same samples that of L below a value where it should be g,
//! the quantile of `p + f - g` is taken from the samples: where F and f deviate together, most of the deviation is gone. Of the size of
//! three components the projection on two principal axes serves, of two that hardly leave a line the one on it.

use nalgebra::DMatrix;

use crate::clearance::law::Law;
use crate::math::decomposition::singular_values;
use crate::math::lanes::block::{Block, LANES, bits_if};
use crate::mechanism::Mechanism;
use crate::questions::random::distribution::{Line, Plane, Sum, Threshold};
use crate::questions::random::request::{Request, Sampling};

/// A value of the characteristic function of a source may be taken for so many samples.
const SAMPLES_PER_VALUE: usize = 2;
/// Standard deviations of two principal components that differ by more hardly leave a line.
const LINE: f64 = 6.0;

/// A linear form of the parameters.
#[derive(Clone, Debug)]
struct Form {
    constant: f64,
    /// One for each parameter.
    factors: Vec<f64>,
}

impl Form {
    fn sum(forms: &[Self], weights: &[f64]) -> Self {
        let mut sum = Self { constant: 0.0, factors: vec![0.0; forms[0].factors.len()] };
        for (form, weight) in forms.iter().zip(weights) {
            sum.constant += weight * form.constant;
            sum.factors.iter_mut().zip(&form.factors).for_each(|(sum, g)| *sum += weight * g);
        }
        sum
    }
}

/// What is compared with a threshold: of the components, and after them of the projections on axes.
#[derive(Clone, Copy, Debug)]
enum Measured {
    /// The number itself.
    Value(usize),
    /// Its size.
    Size(usize),
    /// The size of two together.
    Sizes(usize, usize),
}

/// First-order errors whose distributions are known.
#[derive(Clone, Debug, Default)]
pub(crate) struct Control {
    /// Of the components: the constant, and the factors of parameters that are not zero.
    rows: Vec<(f64, Vec<(usize, f64)>)>,
    /// Axes of projections: their first component, and the weights of those from there on.
    axes: Vec<(usize, Vec<f64>)>,
    /// By quantity, where it is known; one threshold for each probability.
    quantities: Vec<Option<(Measured, Vec<Threshold>)>>,
    probabilities: usize,
}

impl Control {
    /// Of the errors `constant + map parameters` with a covariance; empty where the sources are not independent, and for plain samples.
    pub fn of(
        m: &Mechanism,
        map: &DMatrix<f64>,
        constant: &[f64],
        covariance: &DMatrix<f64>,
        request: &Request,
    ) -> Self {
        let probabilities = &request.probabilities;
        let mut control = Self { probabilities: probabilities.len(), ..Self::default() };
        if request.sampling != Sampling::Sobol || probabilities.is_empty() {
            return control;
        }
        let Some(mut laws) = Laws::of(m, request) else { return control };
        let (n, split) = (m.size(), m.n_translations());
        let row = |i: usize| Form { constant: constant[i], factors: map.row(i).iter().copied().collect() };
        let forms: Vec<Form> = (0..n).map(row).collect();
        for (i, form) in forms.iter().enumerate() {
            let factors = form.factors.iter().copied().enumerate().filter(|(_, g)| *g != 0.0);
            control.rows.push((form.constant, factors.collect()));
            let line = laws.line(form, covariance[(i, i)].sqrt());
            control.quantities.push(line.map(|line| (Measured::Value(i), line.thresholds(probabilities))));
        }
        for part in [0..split, split..n] {
            let found = control.size(&mut laws, &forms, part, covariance, probabilities);
            control.quantities.push(found);
        }
        // What nothing is known of is not to be computed for every sample.
        if control.quantities.iter().all(Option::is_none) { Self::default() } else { control }
    }

    /// That of the size of some components.
    fn size(
        &mut self,
        laws: &mut Laws<'_>,
        forms: &[Form],
        part: std::ops::Range<usize>,
        covariance: &DMatrix<f64>,
        probabilities: &[f64],
    ) -> Option<(Measured, Vec<Threshold>)> {
        let block = covariance.view((part.start, part.start), (part.len(), part.len())).into_owned();
        let found = singular_values(block, true, false)?;
        let axes = found.u?;
        let std = |k: usize| found.singular_values.get(k).map_or(0.0, |square: &f64| square.sqrt());
        let mut along = |k: usize| {
            let weights: Vec<f64> = axes.column(k).iter().copied().collect();
            let form = Form::sum(&forms[part.clone()], &weights);
            self.axes.push((part.start, weights));
            (forms.len() + self.axes.len() - 1, form)
        };
        let (first, form) = along(0);
        if std(1) * LINE > std(0) {
            let (second, other) = along(1);
            if let Some(plane) = laws.plane(&[form.clone(), other], [std(0), std(1)]) {
                return Some((Measured::Sizes(first, second), plane.thresholds(probabilities)));
            }
            self.axes.pop();
        }
        let line = laws.line(&form, std(0))?;
        Some((Measured::Size(first), line.thresholds_of_size(probabilities)))
    }

    /// Number of counts.
    pub const fn len(&self) -> usize {
        self.quantities.len() * self.probabilities
    }

    /// Counts the lanes in which a quantity is below its threshold, quantity by quantity.
    #[inline(always)]
    pub fn count(&self, parameters: &[Block], lanes: usize, values: &mut [Block], counts: &mut [u64]) {
        // Component by component: closures are not compiled for the caller's width.
        let (components, projections) = values.split_at_mut(self.rows.len());
        for ((constant, factors), value) in self.rows.iter().zip(components.iter_mut()) {
            let mut sum = Block::splat(*constant);
            for &(p, factor) in factors {
                sum = parameters[p].mul_add(&Block::splat(factor), &sum);
            }
            *value = sum;
        }
        for ((start, weights), value) in self.axes.iter().zip(projections) {
            let mut sum = Block::splat(0.0);
            for (component, &weight) in components[*start..].iter().zip(weights) {
                sum = component.mul_add(&Block::splat(weight), &sum);
            }
            *value = sum;
        }
        for (known, counts) in self.quantities.iter().zip(counts.chunks_exact_mut(self.probabilities.max(1))) {
            let Some((measured, thresholds)) = known else { continue };
            let value = match *measured {
                Measured::Value(i) => values[i],
                Measured::Size(i) => values[i].abs(),
                Measured::Sizes(i, j) => values[i].mul_add(&values[i], &values[j].mul(&values[j])).sqrt(),
            };
            for (threshold, count) in thresholds.iter().zip(counts) {
                let mut inside = 0;
                let mut i = 0;
                while i < LANES {
                    inside += bits_if(value.0[i] < threshold.value && i < lanes) & 1;
                    i += 1;
                }
                *count += inside;
            }
        }
    }

    /// Number of probabilities, each with a count for every quantity.
    pub const fn probabilities(&self) -> usize {
        self.probabilities
    }

    /// Scratch for [`Control::count`].
    pub fn scratch(&self) -> Vec<Block> {
        vec![Block::splat(0.0); self.rows.len() + self.axes.len()]
    }

    /// The share of all specimens below the threshold of a quantity at a probability, where it is known.
    pub fn share(&self, quantity: usize, probability: usize) -> Option<f64> {
        let (_, thresholds) = self.quantities.get(quantity)?.as_ref()?;
        Some(thresholds[probability].share)
    }
}

/// Distributions of linear forms, while there is time for them.
struct Laws<'m> {
    m: &'m Mechanism,
    of_source: Vec<Law>,
    /// Of sources of one number with laws of their own: values about the mean, with weights.
    values: Vec<Option<Vec<(f64, f64)>>>,
    /// Mean of every parameter.
    mean: Vec<f64>,
    /// How many more values of characteristic functions are cheap beside the samples.
    budget: usize,
}

impl<'m> Laws<'m> {
    /// `None` where sources are not independent.
    fn of(m: &'m Mechanism, request: &Request) -> Option<Self> {
        if m.scores.iter().any(|group| group.sources.len() > 1) || m.sources.iter().any(|source| source.gap.is_some()) {
            return None;
        }
        let laws: Vec<Law> = m.sources.iter().map(|source| Mechanism::law(source, request)).collect();
        let (mut mean, mut values) = (m.centre.clone(), Vec::new());
        for (source, law) in m.sources.iter().zip(&laws) {
            let (about, _) = source.moments(*law);
            mean[source.range()].iter_mut().zip(&about).for_each(|(sum, x)| *sum += x);
            values.push(source.quantile.as_ref().map(|quantile| quantile.weighted(about[0])));
        }
        Some(Self { m, of_source: laws, values, mean, budget: request.samples / SAMPLES_PER_VALUE })
    }

    fn sum(&self, factors: &[f64]) -> Option<Sum<'_>> {
        let mut sum = Sum::default();
        for ((source, &law), values) in self.m.sources.iter().zip(&self.of_source).zip(&self.values) {
            let own = &factors[source.range()];
            if own.iter().all(|g| *g == 0.0) {
                continue;
            }
            if let Some(values) = values {
                sum.numbers.push((own[0], values));
                sum.reach += own[0].abs() * values.iter().fold(0.0, |far: f64, (x, _)| far.max(x.abs()));
            } else if law == Law::Gauss {
                let (_, variance) = source.moments(law);
                sum.variance += own.iter().zip(variance).map(|(g, v)| g * g * v).sum::<f64>();
                sum.reach = f64::INFINITY;
            } else {
                let units = source.set.factors(law, own)?;
                sum.units.extend(units.into_iter().map(|(unit, s)| (unit, law, s)));
                let opposite: Vec<f64> = own.iter().map(|g| -g).collect();
                sum.reach += 0.5 * (source.set.support(own) + source.set.support(&opposite));
            }
        }
        Some(sum)
    }

    fn mean(&self, form: &Form) -> f64 {
        form.constant + form.factors.iter().zip(&self.mean).map(|(g, x)| g * x).sum::<f64>()
    }

    /// The distribution of a form with a standard deviation.
    fn line(&mut self, form: &Form, std: f64) -> Option<Line> {
        if !(std > 0.0) {
            return None;
        }
        let mut budget = self.budget;
        let line = Line::of(self.mean(form), std, &self.sum(&form.factors)?, &mut budget)?;
        self.budget = budget;
        Some(line)
    }

    /// The distribution of the size of two forms with standard deviations, along principal axes.
    fn plane(&mut self, forms: &[Form; 2], std: [f64; 2]) -> Option<Plane> {
        let mut budget = self.budget;
        let plane = Plane::of(std, &mut budget, |cos, sin| {
            let along = Form::sum(forms, &[cos, sin]);
            Some((self.mean(&along), self.sum(&along.factors)?))
        })?;
        self.budget = budget;
        Some(plane)
    }
}
