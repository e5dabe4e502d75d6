//! Streaming covariances by Welford's update, merged by that of Chan, Golub and
//! `LeVeque` (Amer. Statist. 37, 1983, 242).

use std::ops::Range;

/// Means of numbers, the covariances of the first few of them, and those of every other with one of these: they take
/// turns.
#[derive(Clone, Debug)]
pub struct Moments {
    count: u64,
    mean: Vec<f64>,
    /// Sums of products of deviations: of the first `leading` numbers with each other, row by row, then of every other
    /// with its leading one.
    products: Vec<f64>,
    leading: usize,
    /// Deviations of the leading numbers.
    deviations: Vec<f64>,
}

impl Moments {
    pub fn new(numbers: usize, leading: usize) -> Self {
        let products = vec![0.0; leading * leading + numbers - leading];
        Self { count: 0, mean: vec![0.0; numbers], products, leading, deviations: vec![0.0; leading] }
    }

    /// Adds one set of numbers.
    pub fn add(&mut self, values: &[f64]) {
        self.count += 1;
        let weight = 1.0 / self.count as f64;
        self.deviate(values.iter().copied(), |_, d, other| (1.0 - weight) * d * other, |d| weight * d);
    }

    /// Adds what another has seen.
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        let (a, b) = (self.count as f64, other.count as f64);
        let between = |place: usize, d: f64, also: f64| other.products[place] + d * also * (a * b / (a + b));
        self.deviate(other.mean.iter().copied(), between, |d| d * (b / (a + b)));
        self.count += other.count;
    }

    /// Adds to products and means what follows from the deviations of values from the means; to products by their places.
    #[inline]
    fn deviate(
        &mut self,
        mut values: impl Iterator<Item = f64>,
        product: impl Fn(usize, f64, f64) -> f64,
        mean: impl Fn(f64) -> f64,
    ) {
        let Self { mean: means, products, leading, deviations, .. } = self;
        let (first, others) = means.split_at_mut(*leading);
        for ((deviation, at), value) in deviations.iter_mut().zip(&mut *first).zip(values.by_ref()) {
            *deviation = value - *at;
            *at += mean(*deviation);
        }
        let (together, apart) = products.split_at_mut(*leading * *leading);
        let pairs = deviations.iter().flat_map(|d| deviations.iter().map(move |other| (d, other)));
        for (place, (sum, (d, other))) in together.iter_mut().zip(pairs).enumerate() {
            *sum += product(place, *d, *other);
        }
        let mut place = together.len();
        for (at, apart) in others.chunks_mut(*leading).zip(apart.chunks_mut(*leading)) {
            for (((at, sum), other), value) in at.iter_mut().zip(apart).zip(&*deviations).zip(values.by_ref()) {
                let d = value - *at;
                *sum += product(place, d, *other);
                *at += mean(d);
                place += 1;
            }
        }
    }

    /// Means; NaN of nothing.
    pub fn mean(&self) -> Vec<f64> {
        self.mean.iter().map(|m| if self.count > 0 { *m } else { f64::NAN }).collect()
    }

    /// Unbiased covariances of a leading number with all of them.
    pub fn covariance(&self, k: usize) -> Vec<f64> {
        let row = &self.products[k * self.leading..(k + 1) * self.leading];
        row.iter().map(|p| p / (self.count as f64 - 1.0)).collect()
    }

    /// Unbiased covariances of other numbers each with its leading one.
    pub fn with_leading(&self, numbers: Range<usize>) -> impl Iterator<Item = f64> {
        let place = |k: usize| self.leading * self.leading + k - self.leading;
        let own = &self.products[place(numbers.start)..place(numbers.end)];
        own.iter().map(|p| p / (self.count as f64 - 1.0))
    }
}
