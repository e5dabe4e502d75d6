//! Streaming covariances by Welford's update, merged by that of Chan, Golub and
//! `LeVeque` (Amer. Statist. 37, 1983, 242).

/// Means of numbers, and their covariances with the first few of them.
#[derive(Clone, Debug)]
pub struct Moments {
    count: u64,
    mean: Vec<f64>,
    /// Sums of products of deviations: every number with each of the first `leading`.
    products: Vec<f64>,
    leading: usize,
}

impl Moments {
    pub fn new(numbers: usize, leading: usize) -> Self {
        Self { count: 0, mean: vec![0.0; numbers], products: vec![0.0; numbers * leading], leading }
    }

    /// Adds one set of numbers.
    pub fn add(&mut self, values: &[f64]) {
        self.count += 1;
        let weight = 1.0 / self.count as f64;
        let before: Vec<f64> = values.iter().zip(&self.mean).map(|(v, m)| v - m).collect();
        self.mean.iter_mut().zip(&before).for_each(|(m, d)| *m += weight * d);
        for (row, d) in self.products.chunks_exact_mut(self.leading).zip(&before) {
            for (product, other) in row.iter_mut().zip(&before) {
                *product += (1.0 - weight) * d * other;
            }
        }
    }

    /// Adds what another has seen.
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        let (a, b) = (self.count as f64, other.count as f64);
        let between: Vec<f64> = other.mean.iter().zip(&self.mean).map(|(o, m)| o - m).collect();
        let rows = self.products.chunks_exact_mut(self.leading).zip(other.products.chunks_exact(self.leading));
        for ((row, more), d) in rows.zip(&between) {
            for ((product, more), other) in row.iter_mut().zip(more).zip(&between) {
                *product += more + d * other * (a * b / (a + b));
            }
        }
        self.mean.iter_mut().zip(&between).for_each(|(m, d)| *m += d * (b / (a + b)));
        self.count += other.count;
    }

    /// Means; NaN of nothing.
    pub fn mean(&self) -> Vec<f64> {
        self.mean.iter().map(|m| if self.count > 0 { *m } else { f64::NAN }).collect()
    }

    /// Unbiased covariances of number k with the leading ones.
    pub fn covariance(&self, k: usize) -> Vec<f64> {
        let row = &self.products[k * self.leading..(k + 1) * self.leading];
        row.iter().map(|p| p / (self.count as f64 - 1.0)).collect()
    }
}
