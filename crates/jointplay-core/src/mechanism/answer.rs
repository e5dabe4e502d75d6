//! Answers to questions: arrays by name.

use crate::mechanism::status::Status;

/// An array with a name.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its name.
    pub name: &'static str,
    /// Its shape, configurations first.
    pub shape: Vec<usize>,
    /// Its values, the last dimension running fastest.
    pub values: Values,
}

/// The values of a column.
#[derive(Clone, Debug)]
#[allow(missing_docs)] // their types say it
pub enum Values {
    Numbers(Vec<f64>),
    Counts(Vec<u64>),
    Flags(Vec<bool>),
    /// Of statuses.
    Codes(Vec<u8>),
}

/// The answer to a question: arrays by name.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Number of configurations.
    pub rows: usize,
    /// The columns.
    pub columns: Vec<Column>,
    /// Counts over all configurations, by name.
    pub totals: Vec<(&'static str, u64)>,
}

impl Answer {
    /// With the columns of another one beside.
    #[must_use]
    pub(crate) fn beside(mut self, other: Self) -> Self {
        self.columns.extend(other.columns);
        self.totals.extend(other.totals);
        self
    }

    /// The rows of several answers to the same question, one after the other, with their counts together.
    #[must_use]
    pub(crate) fn joined(answers: Vec<Self>) -> Option<Self> {
        let mut answers = answers.into_iter();
        let mut whole = answers.next()?;
        for answer in answers {
            whole.rows += answer.rows;
            for (column, more) in whole.columns.iter_mut().zip(answer.columns) {
                column.shape[0] += more.shape[0];
                match (&mut column.values, more.values) {
                    (Values::Numbers(all), Values::Numbers(more)) => all.extend(more),
                    (Values::Counts(all), Values::Counts(more)) => all.extend(more),
                    (Values::Flags(all), Values::Flags(more)) => all.extend(more),
                    (Values::Codes(all), Values::Codes(more)) => all.extend(more),
                    _ => unreachable!("a column has one kind of values"),
                }
            }
            for ((_, all), (_, more)) in whole.totals.iter_mut().zip(answer.totals) {
                *all += more;
            }
        }
        Some(whole)
    }

    /// With a count over all configurations.
    #[must_use]
    pub(crate) fn total(mut self, name: &'static str, count: u64) -> Self {
        self.totals.push((name, count));
        self
    }

    /// Whether there is no configuration in it.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.rows == 0
    }

    /// The numbers of a column; none where it is not there, or is none of numbers.
    #[must_use]
    pub fn numbers(&self, name: &str) -> &[f64] {
        match self.columns.iter().find(|column| column.name == name) {
            Some(Column { values: Values::Numbers(numbers), .. }) => numbers,
            _ => &[],
        }
    }

    /// The outcomes.
    #[must_use]
    pub fn status(&self) -> Vec<Status> {
        match self.columns.iter().find(|column| column.name == "status") {
            Some(Column { values: Values::Codes(codes), .. }) => {
                codes.iter().map(|code| Status::ALL[usize::from(*code)]).collect()
            }
            _ => Vec::new(),
        }
    }
}
