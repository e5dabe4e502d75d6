//! A matrix while its elimination is planned.

use std::collections::BTreeSet;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Update {
    pub(crate) target: usize,
    pub(crate) lower: usize,
    pub(crate) upper: usize,
}

#[derive(Clone, Debug)]
pub(crate) struct Pivot {
    pub(crate) row: usize,
    pub(crate) column: usize,
    pub(crate) slot: usize,
    pub(crate) planned: f64,
    /// Rows below, each with the slot of its multiplier.
    pub(crate) lower: Vec<(usize, usize)>,
    /// Columns to the right, each with its slot.
    pub(crate) upper: Vec<(usize, usize)>,
    pub(crate) updates: Vec<Update>,
}

/// A pivot must be at least this large relative to the largest entry of its row.
const THRESHOLD: f64 = 0.05;
/// Of the entries of least count the first is taken that has at least this part of the largest one's size, so that the
/// order is mostly the same for mechanisms that differ in their numbers only.
const ALIKE: f64 = 0.8;
/// Rows among which a pivot is looked for: all of those of a small mechanism, enough in a large one.
const CANDIDATES: usize = 64;

/// The part of a matrix that is not eliminated yet. All in order, so that the plan is always the same.
pub struct Active {
    /// Column and slot of every non-zero, row by row in ascending order.
    rows: Vec<Vec<(usize, usize)>>,
    /// Rows of the non-zeros, column by column in ascending order.
    columns: Vec<Vec<usize>>,
    /// Rows of the present block by their number of non-zeros.
    by_length: BTreeSet<(usize, usize)>,
    /// How many columns have so many non-zeros.
    heights: Vec<usize>,
    pub values: Vec<f64>,
    largest: f64,
}

impl Active {
    /// The entries within diagonal blocks; the slots of all entries, and for every block the entries of its rows in
    /// columns of earlier ones: row, column, slot.
    #[allow(clippy::type_complexity)] // said in the line above
    pub fn new(
        diagonal: &[Vec<(usize, usize)>],
        entries: &[(usize, usize, f64)],
    ) -> (Self, Vec<usize>, Vec<Vec<(usize, usize, usize)>>) {
        let n = diagonal.iter().map(Vec::len).sum();
        let (mut of_row, mut of_column) = (vec![0; n], vec![0; n]);
        for (number, pairs) in diagonal.iter().enumerate() {
            for &(row, column) in pairs {
                of_row[row] = number;
                of_column[column] = number;
            }
        }
        let mut active = Self {
            rows: vec![Vec::new(); n],
            columns: vec![Vec::new(); n],
            by_length: BTreeSet::new(),
            heights: std::iter::once(n).chain(std::iter::repeat_n(0, n)).collect(),
            values: Vec::new(),
            largest: 0.0,
        };
        let mut before: Vec<Vec<(usize, usize, usize)>> = vec![Vec::new(); diagonal.len()];
        let mut slots = Vec::with_capacity(entries.len());
        for &(i, j, v) in entries {
            let slot = if of_row[i] == of_column[j] {
                active.slot(i, j)
            } else {
                active.values.push(0.0);
                // An entry that is there twice is added twice.
                before[of_row[i]].push((i, j, active.values.len() - 1));
                active.values.len() - 1
            };
            active.values[slot] += v;
            slots.push(slot);
        }
        active.largest = active.values.iter().fold(0.0, |a, v| a.max(v.abs()));
        (active, slots, before)
    }

    /// Begins a block.
    pub fn begin(&mut self, pairs: &[(usize, usize)]) {
        self.by_length.extend(pairs.iter().map(|&(row, _)| (self.rows[row].len(), row)));
    }

    /// The slot of an entry, a new one where there was none.
    fn slot(&mut self, i: usize, j: usize) -> usize {
        match self.rows[i].binary_search_by_key(&j, |&(column, _)| column) {
            Ok(at) => self.rows[i][at].1,
            Err(at) => {
                let slot = self.values.len();
                self.values.push(0.0);
                self.rows[i].insert(at, (j, slot));
                self.change_column(j, |column| column.insert(column.partition_point(|&row| row < i), i));
                slot
            }
        }
    }

    fn change_column(&mut self, j: usize, change: impl FnOnce(&mut Vec<usize>)) {
        let column = &mut self.columns[j];
        self.heights[column.len()] -= 1;
        change(column);
        self.heights[column.len()] += 1;
    }

    /// The entry of least Markowitz count among the large enough ones of the shortest rows.
    pub fn choose(&self) -> Option<(usize, usize)> {
        let (mut least, mut best) = (usize::MAX, Vec::new());
        let shortest = 1 + self.heights[1..].iter().position(|&columns| columns > 0)?;
        for &(length, i) in self.by_length.iter().take(CANDIDATES) {
            // Neither this row nor a longer one has an entry of as little.
            if (length - 1) * (shortest - 1) > least {
                break;
            }
            let size = |slot: usize| self.values[slot].abs();
            let row_largest = self.rows[i].iter().map(|&(_, slot)| size(slot)).fold(0.0, f64::max);
            for &(j, slot) in &self.rows[i] {
                let size = size(slot);
                let cost = (length - 1) * (self.columns[j].len() - 1);
                if cost > least || size < THRESHOLD * row_largest || size <= 1e-13 * self.largest {
                    continue;
                }
                if cost < least {
                    (least, best) = (cost, Vec::new());
                }
                best.push((i, j, size));
            }
        }
        let largest = best.iter().fold(0.0, |largest: f64, &(.., size)| largest.max(size));
        let of = |&(i, j, size): &(usize, usize, f64)| (size >= ALIKE * largest).then_some((i, j));
        best.iter().filter_map(of).min()
    }

    /// Eliminates a column with a row and records how.
    pub fn eliminate(&mut self, p: usize, q: usize) -> Pivot {
        self.by_length.remove(&(self.rows[p].len(), p));
        let mut upper = std::mem::take(&mut self.rows[p]);
        for &(j, _) in &upper {
            self.change_column(j, |column| column.retain(|&row| row != p));
        }
        let at = upper.iter().position(|(j, _)| *j == q).unwrap_or_default();
        let (_, slot) = upper.remove(at);
        let mut pivot = Pivot {
            row: p,
            column: q,
            slot,
            planned: self.values[slot].abs(),
            lower: Vec::new(),
            upper,
            updates: Vec::new(),
        };
        let below = std::mem::take(&mut self.columns[q]);
        self.heights[below.len()] -= 1;
        for i in below {
            self.by_length.remove(&(self.rows[i].len(), i));
            let Ok(at) = self.rows[i].binary_search_by_key(&q, |&(column, _)| column) else { continue };
            let (_, lower) = self.rows[i].remove(at);
            self.values[lower] /= self.values[slot];
            pivot.lower.push((i, lower));
            for &(j, upper) in &pivot.upper {
                let target = self.slot(i, j);
                self.values[target] -= self.values[lower] * self.values[upper];
                pivot.updates.push(Update { target, lower, upper });
            }
            self.by_length.insert((self.rows[i].len(), i));
        }
        pivot
    }
}
