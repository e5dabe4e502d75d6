//! Parts of the sources in a first-order figure.
//!
//! The error is `E = M d` for displacements that keep compatible, `A d = b`. When a displacement changes by `dd_0` of
//! its own, because its clearance, its deviation or its compliance grows, all others give way to the self-stress dy
//! that this takes ([`crate::cone::way`]):
//!
//! ```text
//! d d = d d_0 + B A^T dy,    A d d = 0        so that        d E = (M - Q A) d d_0,    (M - Q A) B A^T = 0
//! ```
//!
//! A figure of the first order is homogeneous of degree one in sizes, deviations and compliances (those standing for
//! the load), so that by Euler it is the sum of each times the derivative along it. That is the part
//! `(M - Q A)_j d_j` of the displacement itself. Q does not depend on the rows chosen as a basis, and whatever it is
//! the parts add up, for `A d = b` of all of them.
//!
//! Directions of dy to which nothing gives way have no derivative: no unit could be built with another deviation
//! there. Q is then such that the map is least in size (length-scaled), as if everything gave way alike.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::clearance::offset::MAX_SIZE;
use crate::cone::bodies::Form;
use crate::cone::way::{Sides, Way};
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::Compatibility;
use crate::redundancy::system::{Element, System};

/// Directions in which something gives way by less than this part of the most are not held by it.
const HELD: f64 = 1e-9;
/// Pivots of unit rows above this are no matter of rounding.
const CLEARLY: f64 = 1e-6;

/// The displacements of one column of L, and how far each goes.
type Column<'a> = (&'a [usize], Form);

/// A map of the output that is brought to what it is when displacements give way, those first that do most easily.
struct Sharing<'a> {
    equations: &'a DMatrix<f64>,
    map: DMatrix<f64>,
    /// Directions of the self-stresses to which nothing has given way yet.
    free: DMatrix<f64>,
}

impl<'a> Sharing<'a> {
    fn new(system: &System<'_>, equations: &'a DMatrix<f64>, map: &DMatrix<f64>) -> Self {
        let units = system.basis.redundant.iter().map(|&row| 1.0 / system.basis.unit(row));
        let free = DMatrix::from_diagonal(&DVector::from_iterator(equations.nrows(), units));
        Self { equations, map: map.clone(), free }
    }

    /// Lets displacements give way as far as nothing did before; if they only `hold`, the map stays as it is.
    fn give_way(&mut self, columns: &[Column<'_>], hold: bool) {
        let f = self.free.ncols();
        if columns.is_empty() || f == 0 {
            return;
        }
        if self.equations.nrows() == 1 {
            return self.give_way_alone(columns, hold);
        }
        let of = |matrix: &DMatrix<f64>| {
            let mut moved = DMatrix::zeros(matrix.nrows(), columns.len());
            for (mut to, (rows, form)) in moved.column_iter_mut().zip(columns) {
                rows.iter().zip(form).for_each(|(&row, part)| to.axpy(*part, &matrix.column(row), 1.0));
            }
            moved
        };
        // Rows of unit size: directions may be held by what gives way much or little.
        let mut observable = self.free.tr_mul(&of(self.equations));
        let sizes: Vec<f64> = observable.row_iter().map(|row| row.norm()).collect();
        let noise = HELD * sizes.iter().fold(0.0_f64, |most, size| most.max(*size));
        for (k, size) in sizes.iter().enumerate().filter(|(_, size)| **size > noise) {
            observable.row_mut(k).unscale_mut(*size);
            self.free.column_mut(k).unscale_mut(*size);
        }
        let moved = of(&self.map);
        let clear = (&observable * observable.transpose())
            .cholesky()
            .filter(|c| c.l_dirty().diagonal().min().powi(2) > CLEARLY);
        if let Some(factors) = clear {
            if !hold {
                let parts = factors.solve(&(&observable * moved.transpose()));
                self.take((&self.free * parts).transpose());
            }
            self.free = DMatrix::zeros(self.free.nrows(), 0);
            return;
        }
        let (held, left) = split(&observable);
        if !hold && held.ncols() > 0 {
            // The least rest of what is moved, beside what is observable in the directions that are held.
            let factors = observable.tr_mul(&held).qr();
            let mut parts = factors.q().tr_mul(&moved.transpose());
            if factors.r().solve_upper_triangular_mut(&mut parts) {
                self.take(parts.transpose() * held.transpose() * self.free.transpose());
            }
        }
        self.free = &self.free * left;
    }

    /// The same where there is one equation, in which every column counts by how much it does.
    fn give_way_alone(&mut self, columns: &[Column<'_>], hold: bool) {
        let equation = self.equations.as_slice();
        let (mut size, mut moved) = (0.0, DVector::zeros(self.map.nrows()));
        for (rows, form) in columns {
            let along: f64 = rows.iter().zip(form).map(|(&row, part)| part * equation[row]).sum();
            if along != 0.0 {
                size += along * along;
                rows.iter().zip(form).for_each(|(&row, part)| moved.axpy(along * part, &self.map.column(row), 1.0));
            }
        }
        if size > 0.0 {
            if !hold {
                moved.unscale_mut(size);
                self.map.ger(-1.0, &moved, &self.equations.row(0).transpose(), 1.0);
            }
            self.free = DMatrix::zeros(1, 0);
        }
    }

    /// Takes multiples of the equations from the map.
    fn take(&mut self, multiples: DMatrix<f64>) {
        self.map -= multiples * self.equations;
    }

    /// Everything gives way alike where nothing else does.
    fn least(mut self, system: &System<'_>) -> DMatrix<f64> {
        if self.free.ncols() == 0 {
            return self.map;
        }
        let rows: Vec<usize> = (0..system.mechanism.n_rows()).collect();
        let column = |row: &'_ usize| {
            let mut form = Form::default();
            form[0] = system.basis.unit(*row);
            form
        };
        let columns: Vec<Column<'_>> = rows.iter().map(|row| (std::slice::from_ref(row), column(row))).collect();
        self.give_way(&columns, false);
        self.map
    }
}

impl System<'_> {
    /// The derivatives of a map of the output where forces hold the displacements. Offsets are free to move where
    /// forces do less than about the part `least` of what the largest one does.
    pub fn derivatives(&self, c: &Compatibility, map: &DMatrix<f64>, balance: &Balance, least: f64) -> DMatrix<f64> {
        self.derivatives_by(c, map, balance, least, |_| [1.0; MAX_SIZE])
    }

    /// The same where offsets that are free to move do so by `spread` times their sizes, component by component.
    pub fn derivatives_by(
        &self,
        c: &Compatibility,
        map: &DMatrix<f64>,
        balance: &Balance,
        least: f64,
        spread: impl Fn(&Element) -> Form,
    ) -> DMatrix<f64> {
        let mut sharing = Sharing::new(self, &c.equations, map);
        let tied = || self.elements.iter().zip(&balance.given).filter(|(element, _)| Self::is_tied(element, c));
        let pushed: Vec<(&Element, Option<Sides>)> = tied()
            .map(|(element, given)| (element, element.kind.sides(&Self::on(element, &balance.forces), given)))
            .collect();
        let largest = pushed.iter().filter_map(|(_, sides)| Some(sides.as_ref()?.push())).fold(0.0, f64::max);
        let way = |sides: Option<Sides>| sides.map_or_else(Way::default, |sides| sides.way(largest, least));
        let ways: Vec<(&Element, Way)> = pushed.into_iter().map(|(element, sides)| (element, way(sides))).collect();
        let open = ways.iter().filter(|(_, way)| !way.open.is_empty()).flat_map(|(element, way)| {
            let spread = spread(element);
            way.open.iter().map(move |l| (&*element.columns, std::array::from_fn(|k| spread[k] * l[k])))
        });
        sharing.give_way(&open.collect::<Vec<_>>(), false);
        let firm = ways
            .iter()
            .flat_map(|(element, way)| way.firm.iter().chain(&element.deforms).map(|l| (&*element.columns, *l)));
        sharing.give_way(&firm.collect::<Vec<_>>(), false);
        sharing.least(self)
    }

    /// The same where no force holds the clearances.
    pub fn derivatives_loose(&self, c: &Compatibility, spread: impl Fn(&Element) -> Form) -> DMatrix<f64> {
        let given = self.elements.iter().map(|element| vec![0.0; element.columns.len()]).collect();
        let nothing = Balance::free(given, DVector::zeros(c.load.len()));
        self.derivatives_by(c, &c.output.parameters, &nothing, 0.0, spread)
    }

    /// The same where offsets are given: what is elastic gives way, and clearances where nothing is elastic.
    pub fn derivatives_given(&self, c: &Compatibility) -> DMatrix<f64> {
        self.given_way(&c.equations, &c.output.parameters).least(self)
    }

    /// The same of any map, and which displacements something gives way to, or nothing has to.
    pub fn derivatives_of(&self, equations: &DMatrix<f64>, map: &DMatrix<f64>) -> (DMatrix<f64>, Vec<bool>) {
        let sharing = self.given_way(equations, map);
        let asked = sharing.free.tr_mul(equations);
        let size = |k: usize| asked.column(k).norm() * self.basis.unit(k);
        let rows = self.mechanism.n_rows();
        let least = CLEARLY * (0..rows).map(size).fold(0.0, f64::max);
        let defined = (0..equations.ncols()).map(|k| size(k) <= least).collect();
        (sharing.least(self), defined)
    }

    fn given_way<'a>(&self, equations: &'a DMatrix<f64>, map: &DMatrix<f64>) -> Sharing<'a> {
        let mut sharing = Sharing::new(self, equations, map);
        for columns in [|element: &Element| element.deforms.clone(), |element: &Element| element.kind.play()] {
            let columns =
                self.elements.iter().flat_map(|element| columns(element).into_iter().map(|l| (&*element.columns, l)));
            sharing.give_way(&columns.collect::<Vec<_>>(), false);
        }
        sharing
    }

    /// Forces under which nothing is left open but what no element is sensitive to: there they are least in size.
    pub fn least_forces(&self, c: &Compatibility, forces: &DVector<f64>) -> DVector<f64> {
        let map = DMatrix::from_row_slice(1, forces.len(), forces.as_slice());
        let mut sharing = Sharing::new(self, &c.equations, &map);
        let way = |element: &Element| {
            element.kind.play().into_iter().chain(element.deforms.iter().copied()).collect::<Vec<Form>>()
        };
        let columns = self.elements.iter().flat_map(|element| way(element).into_iter().map(|l| (&*element.columns, l)));
        sharing.give_way(&columns.collect::<Vec<_>>(), true);
        sharing.least(self).row(0).transpose()
    }

    /// Parts of the sources, and of the joints' deformations, in every row of a map.
    pub fn parts(&self, map: &DMatrix<f64>, parameters: &[f64], balance: &Balance) -> (Vec<f64>, Vec<f64>) {
        let (m, size) = (self.mechanism, map.nrows());
        let mut of_sources = vec![0.0; m.sources.len() * size];
        let mut of_joints = vec![0.0; m.n_joints() * size];
        let add = |parts: &mut [f64], column: usize, d: f64| {
            parts.iter_mut().zip(map.column(column).iter()).for_each(|(part, slope)| *part += slope * d);
        };
        let own = |k: usize| -> Range<usize> { k * size..(k + 1) * size };
        for (s, source) in m.sources.iter().enumerate() {
            source.range().for_each(|p| add(&mut of_sources[own(s)], m.place_of(p), parameters[p]));
        }
        for (element, given) in self.elements.iter().zip(&balance.given) {
            let moved = element.columns.iter().zip(given);
            if let Some(s) = element.source {
                for (k, (&column, d)) in moved.enumerate() {
                    m.sources[s].split(s, k, *d, |s, d| add(&mut of_sources[own(s)], column, d));
                }
            } else {
                let parts = &mut of_joints[own(m.rows[element.columns[0]].joint)];
                moved.for_each(|(&column, d)| add(parts, column, *d));
            }
        }
        (of_sources, of_joints)
    }
}

/// Orthonormal directions that the columns of a matrix span, clearly, and those at right angles to them.
pub(crate) fn split(matrix: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let f = matrix.nrows();
    let mut directions = DMatrix::zeros(f, f);
    let largest = matrix.column_iter().map(|column| column.norm()).fold(0.0, f64::max);
    let spanned = span(&mut directions, 0, matrix.clone(), HELD * largest);
    span(&mut directions, spanned, DMatrix::identity(f, f), HELD);
    (directions.columns(0, spanned).into_owned(), directions.columns(spanned, f - spanned).into_owned())
}

/// Adds directions that columns span beyond those before, the clearest first, as far as they are above a size; gives
/// how many there are.
fn span(directions: &mut DMatrix<f64>, before: usize, mut rest: DMatrix<f64>, least: f64) -> usize {
    let mut n = before;
    // Twice is enough: the second pass takes away what rounding left.
    let without = |rest: &mut DMatrix<f64>, directions: &DMatrix<f64>, n: usize| {
        let known = directions.columns(0, n);
        (0..2).for_each(|_| *rest -= known * known.tr_mul(rest));
    };
    while n < directions.ncols() {
        without(&mut rest, directions, n);
        let sizes = rest.column_iter().map(|column| column.norm());
        let Some((k, size)) = sizes.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        if size <= least {
            break;
        }
        directions.set_column(n, &(rest.column(k) / size));
        n += 1;
    }
    n
}
