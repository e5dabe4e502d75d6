//! Load-determined errors of many configurations, column by column.

use crate::math::memory::filled;
use crate::mechanism::Mechanism;
use crate::mechanism::status::Status;

/// The load-determined error of one configuration.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Error on the exact closure, per component.
    pub error: Vec<f64>,
    /// Its linearisation at the nominal pose.
    pub error_first_order: Vec<f64>,
    /// Half-width of what the load does not decide, per component.
    pub undetermined: Vec<f64>,
    /// Share of every source in it, source by source, per component.
    pub open: Vec<f64>,
    /// Whether the load decides where every source is; no load moves what is no clearance.
    pub decided: Vec<bool>,
    /// Force and moment on the second body of every joint at its joint point, ground axes.
    pub reaction: Vec<f64>,
    /// The values of all parameters.
    pub offset: Vec<f64>,
    /// Share of every source in the first-order error, source by source, per component.
    pub contribution: Vec<f64>,
    /// Steps until contact and reactions agreed.
    pub steps: usize,
    /// Outcome.
    pub status: Status,
}

/// Which columns are wanted beside error, what is undetermined, steps and status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Columns {
    /// The values of all parameters.
    pub offset: bool,
    /// Everything else.
    pub details: bool,
}

impl Columns {
    /// All columns.
    pub const ALL: Self = Self { offset: true, details: true };
}

/// Columns row after row; empty where they are not kept.
#[derive(Clone, Debug, Default)]
#[allow(missing_docs)] // the columns are the fields of [`Loaded`]
pub struct Table {
    pub error: Vec<f64>,
    pub error_first_order: Vec<f64>,
    pub undetermined: Vec<f64>,
    pub open: Vec<f64>,
    pub decided: Vec<bool>,
    pub reaction: Vec<f64>,
    pub offset: Vec<f64>,
    pub contribution: Vec<f64>,
    pub steps: Vec<u64>,
    pub status: Vec<Status>,
    /// Configurations that the batch engine handed to the plain solver; of over-constrained mechanisms, cone programs
    /// that were solved by themselves.
    pub fallbacks: u64,
}

impl Table {
    /// Room for `n` rows.
    pub(crate) fn sized(m: &Mechanism, n: usize, keep: Columns) -> Self {
        let detailed = if keep.details { n } else { 0 };
        let (size, sources) = (m.size(), m.sources().len());
        Self {
            error: filled(n * size, 0.0),
            error_first_order: filled(detailed * size, 0.0),
            undetermined: filled(n * size, 0.0),
            open: filled(detailed * sources * size, 0.0),
            decided: filled(detailed * sources, true),
            reaction: filled(detailed * m.n_joints() * size, 0.0),
            offset: filled(if keep.offset { n * m.n_parameters() } else { 0 }, 0.0),
            contribution: filled(detailed * sources * size, 0.0),
            steps: filled(n, 0),
            status: filled(n, Status::Ok),
            fallbacks: 0,
        }
    }

    /// The rows, to be filled.
    pub(crate) fn rows(&mut self) -> Rows<'_> {
        let n = self.status.len();
        Rows {
            n,
            error: Column::new(&mut self.error, n),
            error_first_order: Column::new(&mut self.error_first_order, n),
            undetermined: Column::new(&mut self.undetermined, n),
            open: Column::new(&mut self.open, n),
            decided: Column::new(&mut self.decided, n),
            reaction: Column::new(&mut self.reaction, n),
            offset: Column::new(&mut self.offset, n),
            contribution: Column::new(&mut self.contribution, n),
            steps: Column::new(&mut self.steps, n),
            status: Column::new(&mut self.status, n),
        }
    }

    /// Leaves out the rows after the first ones, if there are any.
    pub(crate) fn keep_first(&mut self, rows: usize) {
        let n = self.status.len();
        if rows >= n {
            return;
        }
        let numbers = [
            &mut self.error,
            &mut self.error_first_order,
            &mut self.undetermined,
            &mut self.open,
            &mut self.reaction,
            &mut self.offset,
            &mut self.contribution,
        ];
        for column in numbers {
            column.truncate(column.len() / n * rows);
        }
        self.decided.truncate(self.decided.len() / n * rows);
        self.steps.truncate(rows);
        self.status.truncate(rows);
    }

    pub(crate) fn push(&mut self, row: Loaded) {
        self.error.extend(row.error);
        self.error_first_order.extend(row.error_first_order);
        self.undetermined.extend(row.undetermined);
        self.open.extend(row.open);
        self.decided.extend(row.decided);
        self.reaction.extend(row.reaction);
        self.offset.extend(row.offset);
        self.contribution.extend(row.contribution);
        self.steps.push(row.steps as u64);
        self.status.push(row.status);
    }
}

/// Some rows of a column; rows of no numbers where it is not kept.
pub(crate) struct Column<'t, T> {
    values: &'t mut [T],
    width: usize,
}

impl<'t, T: Copy> Column<'t, T> {
    fn new(values: &'t mut [T], n: usize) -> Self {
        let width = values.len() / n.max(1);
        Self { values, width }
    }

    /// Whether it is kept.
    pub fn is_kept(&self) -> bool {
        self.width > 0
    }

    /// A row.
    #[inline(always)]
    pub fn row(&mut self, row: usize) -> &mut [T] {
        &mut self.values[row * self.width..(row + 1) * self.width]
    }

    fn put(&mut self, row: usize, values: &[T]) {
        if self.is_kept() {
            self.row(row).copy_from_slice(values);
        }
    }

    fn put_all(&mut self, values: &[T]) {
        if self.is_kept() {
            self.values.copy_from_slice(values);
        }
    }

    fn split_at(self, n: usize) -> (Self, Self) {
        let (first, second) = self.values.split_at_mut(n * self.width);
        (Self { values: first, width: self.width }, Self { values: second, width: self.width })
    }
}

/// Rows of a table, to be filled.
pub(crate) struct Rows<'t> {
    pub n: usize,
    pub error: Column<'t, f64>,
    pub error_first_order: Column<'t, f64>,
    pub undetermined: Column<'t, f64>,
    pub open: Column<'t, f64>,
    pub decided: Column<'t, bool>,
    pub reaction: Column<'t, f64>,
    pub offset: Column<'t, f64>,
    pub contribution: Column<'t, f64>,
    pub steps: Column<'t, u64>,
    pub status: Column<'t, Status>,
}

impl Rows<'_> {
    /// Runs of up to `n` rows each.
    pub fn runs(self, n: usize) -> Vec<Self> {
        let (mut runs, mut rest) = (Vec::with_capacity(self.n.div_ceil(n)), self);
        while rest.n > n {
            let (first, second) = rest.split_at(n);
            runs.push(first);
            rest = second;
        }
        runs.push(rest);
        runs
    }

    fn split_at(self, n: usize) -> (Self, Self) {
        let (error, error_2) = self.error.split_at(n);
        let (error_first_order, error_first_order_2) = self.error_first_order.split_at(n);
        let (undetermined, undetermined_2) = self.undetermined.split_at(n);
        let (open, open_2) = self.open.split_at(n);
        let (decided, decided_2) = self.decided.split_at(n);
        let (reaction, reaction_2) = self.reaction.split_at(n);
        let (offset, offset_2) = self.offset.split_at(n);
        let (contribution, contribution_2) = self.contribution.split_at(n);
        let (steps, steps_2) = self.steps.split_at(n);
        let (status, status_2) = self.status.split_at(n);
        let first = Self {
            n,
            error,
            error_first_order,
            undetermined,
            open,
            decided,
            reaction,
            offset,
            contribution,
            steps,
            status,
        };
        let second = Self {
            n: self.n - n,
            error: error_2,
            error_first_order: error_first_order_2,
            undetermined: undetermined_2,
            open: open_2,
            decided: decided_2,
            reaction: reaction_2,
            offset: offset_2,
            contribution: contribution_2,
            steps: steps_2,
            status: status_2,
        };
        (first, second)
    }

    /// Puts all rows from a table with all columns.
    pub fn put_table(&mut self, table: &Table) {
        self.error.put_all(&table.error);
        self.error_first_order.put_all(&table.error_first_order);
        self.undetermined.put_all(&table.undetermined);
        self.open.put_all(&table.open);
        self.decided.put_all(&table.decided);
        self.reaction.put_all(&table.reaction);
        self.offset.put_all(&table.offset);
        self.contribution.put_all(&table.contribution);
        self.steps.put_all(&table.steps);
        self.status.put_all(&table.status);
    }

    /// Puts a row.
    pub fn put(&mut self, row: usize, of: &Loaded) {
        self.error.put(row, &of.error);
        self.error_first_order.put(row, &of.error_first_order);
        self.undetermined.put(row, &of.undetermined);
        self.open.put(row, &of.open);
        self.decided.put(row, &of.decided);
        self.reaction.put(row, &of.reaction);
        self.offset.put(row, &of.offset);
        self.contribution.put(row, &of.contribution);
        self.steps.put(row, &[of.steps as u64]);
        self.status.put(row, &[of.status]);
    }
}
