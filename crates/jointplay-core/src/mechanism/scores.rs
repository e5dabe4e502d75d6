//! Sources of one number that scatter together: a Gaussian copula.
//!
//! With independent standard normal scores n the scores of a group are `z = L n`, each row of L of length 1, and its
//! values `x_i = Q_i(Phi(z_i))` have their own laws and the correlation of `L L'` between their scores.

/// A group of sources.
#[derive(Clone, Debug)]
pub struct Scores {
    /// The sources.
    pub sources: Vec<usize>,
    /// The rows of L.
    pub factor: Vec<Vec<f64>>,
}

impl Scores {
    /// A source by itself.
    pub(super) fn alone(source: usize) -> Self {
        Self { sources: vec![source], factor: vec![vec![1.0]] }
    }

    /// Number of independent scores.
    pub(crate) fn independent(&self) -> usize {
        self.factor[0].len()
    }

    /// The score of its source `i` from independent ones.
    pub(crate) fn score(&self, i: usize, independent: impl Fn(usize) -> f64) -> f64 {
        self.factor[i].iter().enumerate().map(|(j, part)| part * independent(j)).sum()
    }

    /// The correlation of two scores.
    pub(super) fn correlation(&self, i: usize, j: usize) -> f64 {
        self.score(i, |k| self.factor[j][k]).clamp(-1.0, 1.0)
    }
}
