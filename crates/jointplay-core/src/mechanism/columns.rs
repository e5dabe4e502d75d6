//! Answers column by column: arrays with one row per configuration.
//!
//! A question declares its columns once, by [`columns!`]: name, element, the dimensions beside the configuration and, for
//! those that are given on request only, their group in [`crate::mechanism::Keep`]. From that follow rows as they are solved, tables that
//! all cores fill part by part, and the arrays of an [`Answer`].

use crate::math::lanes::block::LANES;
use crate::math::memory::{Fresh, FreshPart, Untouched};
use crate::mechanism::answer::{Answer, Column, Values};
use crate::mechanism::dim::{Declared, Dim, Wanted};
use crate::mechanism::status::Status;

/// What a column can be made of.
pub(crate) trait Element: Untouched + Send + Sync {
    const NAME: &'static str;
    /// Where nothing is known.
    const UNKNOWN: Self;
    fn values(all: Vec<Self>) -> Values;
}

impl Element for f64 {
    const NAME: &'static str = "float64";
    const UNKNOWN: Self = Self::NAN;
    fn values(all: Vec<Self>) -> Values {
        Values::Numbers(all)
    }
}

impl Element for u64 {
    const NAME: &'static str = "uint64";
    const UNKNOWN: Self = 0;
    fn values(all: Vec<Self>) -> Values {
        Values::Counts(all)
    }
}

impl Element for bool {
    const NAME: &'static str = "bool";
    const UNKNOWN: Self = false;
    fn values(all: Vec<Self>) -> Values {
        Values::Flags(all)
    }
}

impl Untouched for Status {
    const UNTOUCHED: Self = Self::Ok;
}

impl Element for Status {
    const NAME: &'static str = "uint8";
    const UNKNOWN: Self = Self::NotAssembled;
    fn values(all: Vec<Self>) -> Values {
        Values::Codes(all.into_iter().map(Self::code).collect())
    }
}

/// The values of a column in one row.
pub(crate) trait Cell<E: Element>: Sized {
    fn unknown(width: usize) -> Self;
    fn values(&self) -> &[E];
}

impl<E: Element> Cell<E> for E {
    fn unknown(_: usize) -> Self {
        Self::UNKNOWN
    }
    fn values(&self) -> &[E] {
        std::slice::from_ref(self)
    }
}

impl<E: Element> Cell<E> for Vec<E> {
    fn unknown(width: usize) -> Self {
        vec![E::UNKNOWN; width]
    }
    fn values(&self) -> &[E] {
        self
    }
}

/// What is found in one configuration.
pub(crate) trait Row: Sized {
    const DECLARED: &'static [Declared];
    type Table: Table<Row = Self>;
    /// A row of which nothing is known.
    fn unknown(of: &Wanted<'_>) -> Self;
}

/// Many rows, column by column.
pub(crate) trait Table: Sized {
    type Row: Row<Table = Self>;
    type Fresh<'t>: FreshRows;
    /// `n` rows, and what came of filling them.
    fn filled<T>(of: &Wanted<'_>, n: usize, fill: impl FnOnce(Self::Fresh<'_>) -> T) -> (Self, T);
    /// Rows one after the other.
    fn of<'r>(of: &Wanted<'_>, rows: impl ExactSizeIterator<Item = &'r Self::Row> + Clone) -> Self
    where
        Self::Row: 'r;
    /// Number of rows.
    fn n(&self) -> usize;
    /// Leaves out the rows after the first ones, if there are any.
    fn keep_first(&mut self, n: usize);
    /// The arrays that are wanted.
    fn columns(self, of: &Wanted<'_>) -> Vec<Column>;
}

/// Rows of a table of which nothing is written yet.
pub(crate) trait FreshRows: Sized {
    type Rows;
    fn n(&self) -> usize;
    fn split_at(self, n: usize) -> (Self, Self);
    /// The rows, to be filled: at first they are untouched.
    fn begin(self) -> Self::Rows;

    /// Runs of up to `n` rows each.
    fn runs(self, n: usize) -> Vec<Self> {
        let (mut runs, mut rest) = (Vec::with_capacity(self.n().div_ceil(n)), self);
        while rest.n() > n {
            let (first, second) = rest.split_at(n);
            runs.push(first);
            rest = second;
        }
        runs.push(rest);
        runs
    }
}

/// Rows of a table, to be filled.
pub(crate) trait Rows {
    type Row;
    /// Puts a row.
    fn put(&mut self, row: usize, of: &Self::Row);
}

/// Some rows of a column; rows of no numbers where it is not kept.
pub(crate) struct Part<'t, T> {
    values: &'t mut [T],
    width: usize,
}

impl<T: Copy> Part<'_, T> {
    /// Whether it is kept.
    #[inline(always)]
    pub const fn is_kept(&self) -> bool {
        self.width > 0
    }

    /// A row.
    #[inline(always)]
    pub fn row(&mut self, row: usize) -> &mut [T] {
        &mut self.values[row * self.width..(row + 1) * self.width]
    }

    /// Puts a row, if it is kept.
    #[inline(always)]
    pub fn put(&mut self, row: usize, values: &[T]) {
        if self.is_kept() {
            self.row(row).copy_from_slice(values);
        }
    }

    /// Puts the rows of the chosen lanes, of which the first one has row `first`, if they are kept: `values` has one value
    /// of all lanes.
    #[inline(always)]
    pub fn put_lanes<'b>(&mut self, first: usize, chosen: &[bool], values: impl Fn(usize) -> &'b [T; LANES])
    where
        T: 'b,
    {
        // Some values at a time: those of a lane are far from one another.
        const AT_ONCE: usize = 8;
        let width = self.width;
        let rows = &mut self.values[first * width..(first + chosen.len()) * width];
        for k in (0..width).step_by(AT_ONCE) {
            let n = AT_ONCE.min(width - k);
            let columns: [&[T; LANES]; AT_ONCE] = std::array::from_fn(|j| values(k + j.min(n - 1)));
            for (lane, row) in rows.chunks_exact_mut(width).enumerate() {
                if chosen[lane] {
                    for (place, column) in row[k..k + n].iter_mut().zip(&columns) {
                        *place = column[lane];
                    }
                }
            }
        }
    }
}

/// Room for a column of `n` rows.
pub(crate) fn room<E: Element>(of: &Wanted<'_>, n: usize, dims: &[Dim], kept: bool) -> Fresh<E> {
    Fresh::new(if kept { n * Dim::width(dims, of) } else { 0 })
}

/// Some rows of a column that are not written yet.
pub(crate) struct FreshCells<'t, T: Untouched> {
    values: FreshPart<'t, T>,
    width: usize,
}

impl<'t, T: Untouched> FreshCells<'t, T> {
    pub fn new(room: &'t mut Fresh<T>, n: usize) -> Self {
        let values = room.part();
        Self { width: values.len() / n.max(1), values }
    }

    pub fn split_at(self, n: usize) -> (Self, Self) {
        let (first, second) = self.values.split_at(n * self.width);
        (Self { values: first, width: self.width }, Self { values: second, width: self.width })
    }

    pub fn begin(self) -> Part<'t, T> {
        Part { values: self.values.untouched(), width: self.width }
    }
}

/// The values of a column row after row.
pub(crate) fn joined<'r, E: Element + 'r>(rows: impl Iterator<Item = &'r [E]>, kept: bool) -> Vec<E> {
    if kept { rows.flatten().copied().collect() } else { Vec::new() }
}

/// A column with its shape.
pub(crate) fn column<E: Element>(name: &'static str, of: &Wanted<'_>, n: usize, dims: &[Dim], all: Vec<E>) -> Column {
    let shape = std::iter::once(n).chain(dims.iter().map(|dim| dim.size(of))).collect();
    Column { name, shape, values: E::values(all) }
}

impl Answer {
    /// The answer that is found column by column.
    pub(crate) fn of(table: impl Table, wanted: &Wanted<'_>) -> Self {
        Self { rows: table.n(), columns: table.columns(wanted), totals: Vec::new() }
    }

    /// The answer that is found row by row.
    pub(crate) fn of_rows<'r, R: Row + 'r>(
        rows: impl ExactSizeIterator<Item = &'r R> + Clone,
        wanted: &Wanted<'_>,
    ) -> Self {
        Self::of(R::Table::of(wanted, rows), wanted)
    }

    /// The answer of which two parts are found row by row.
    pub(crate) fn of_pairs<A: Row, B: Row>(rows: &[(A, B)], wanted: &Wanted<'_>) -> Self {
        let (first, second) = (rows.iter().map(|(row, _)| row), rows.iter().map(|(_, row)| row));
        Self::of_rows(first, wanted).beside(Self::of_rows(second, wanted))
    }
}

/// The value of a column in one row: a number by itself, or as many as its dimensions ask for.
macro_rules! cell {
    ($element:ident []) => { $element };
    ($element:ident [$($dim:ident),+]) => { Vec<$element> };
}

/// Declares the columns of a question: its row, its table, and the rows of the table.
///
/// Each is `name: element [dimensions] if group;` with the dimensions of [`Dim`] and, of those that are given on request
/// only, the group of [`crate::mechanism::Keep`].
macro_rules! columns {
    (
        $(#[$doc:meta])* $Row:ident in $Table:ident by $Rows:ident from $Fresh:ident:
        $($(#[$about:meta])* $name:ident: $element:ident [$($dim:ident),*] $(if $group:ident)?;)+
    ) => {
        $(#[$doc])*
        #[derive(Clone, Debug)]
        pub(crate) struct $Row {
            $($(#[$about])* pub $name: $crate::mechanism::columns::cell!($element [$($dim),*]),)+
        }

        /// Many of them, column by column.
        pub(crate) struct $Table {
            n: usize,
            $($(#[$about])* pub $name: Vec<$element>,)+
        }

        /// Rows of the table, to be filled.
        #[allow(clippy::struct_field_names)] // the names are those of the row
        pub(crate) struct $Rows<'t> {
            $($(#[$about])* pub $name: $crate::mechanism::columns::Part<'t, $element>,)+
        }

        /// Rows of the table of which nothing is written yet.
        pub(crate) struct $Fresh<'t> {
            n: usize,
            $($name: $crate::mechanism::columns::FreshCells<'t, $element>,)+
        }

        impl $crate::mechanism::columns::Row for $Row {
            const DECLARED: &'static [Declared] = &[$(Declared {
                name: stringify!($name),
                element: <$element as $crate::mechanism::columns::Element>::NAME,
                dims: &[$(Dim::$dim),*],
            }),+];
            type Table = $Table;

            fn unknown(of: &Wanted<'_>) -> Self {
                Self { $($name: $crate::mechanism::columns::Cell::unknown(Dim::width(&[$(Dim::$dim),*], of)),)+ }
            }
        }

        impl $crate::mechanism::columns::Table for $Table {
            type Row = $Row;
            type Fresh<'t> = $Fresh<'t>;

            fn filled<T>(of: &Wanted<'_>, n: usize, fill: impl FnOnce($Fresh<'_>) -> T) -> (Self, T) {
                $(let mut $name =
                    $crate::mechanism::columns::room(of, n, &[$(Dim::$dim),*], true $(&& of.keep.$group)?);)+
                let found = fill($Fresh {
                    n,
                    $($name: $crate::mechanism::columns::FreshCells::new(&mut $name, n),)+
                });
                let n = [n, $($name.whole_rows(n)),+].into_iter().fold(n, usize::min);
                (Self { n, $($name: $name.into_vec(),)+ }, found)
            }

            #[allow(unused_variables)] // no column has a group
            fn of<'r>(of: &Wanted<'_>, rows: impl ExactSizeIterator<Item = &'r $Row> + Clone) -> Self {
                Self {
                    n: rows.len(),
                    $($name: $crate::mechanism::columns::joined(
                        rows.clone().map(|row| $crate::mechanism::columns::Cell::values(&row.$name)),
                        true $(&& of.keep.$group)?,
                    ),)+
                }
            }

            fn n(&self) -> usize {
                self.n
            }

            fn keep_first(&mut self, n: usize) {
                if n < self.n {
                    $(self.$name.truncate(self.$name.len() / self.n * n);)+
                    self.n = n;
                }
            }

            fn columns(self, of: &Wanted<'_>) -> Vec<$crate::mechanism::answer::Column> {
                let mut columns = Vec::new();
                $(if true $(&& of.keep.$group)? {
                    columns.push($crate::mechanism::columns::column(
                        stringify!($name), of, self.n, &[$(Dim::$dim),*], self.$name,
                    ));
                })+
                columns
            }
        }

        impl<'t> $crate::mechanism::columns::FreshRows for $Fresh<'t> {
            type Rows = $Rows<'t>;

            fn n(&self) -> usize {
                self.n
            }

            fn split_at(self, n: usize) -> (Self, Self) {
                $(let $name = self.$name.split_at(n);)+
                (
                    Self { n, $($name: $name.0,)+ },
                    Self { n: self.n - n, $($name: $name.1,)+ },
                )
            }

            fn begin(self) -> $Rows<'t> {
                $Rows { $($name: self.$name.begin(),)+ }
            }
        }

        impl $crate::mechanism::columns::Rows for $Rows<'_> {
            type Row = $Row;

            fn put(&mut self, row: usize, of: &$Row) {
                $(self.$name.put(row, $crate::mechanism::columns::Cell::values(&of.$name));)+
            }
        }
    };
}

pub(crate) use {cell, columns};
