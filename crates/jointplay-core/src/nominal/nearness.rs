//! How near a configuration is to a singularity, and in which way it gives.
//!
//! With J the length-scaled closure Jacobian, A its rows of the joints and of what ties the joints of one motor to each
//! other, D a row per drive, N an orthonormal basis of the motions that A allows (its null space), and E the twist of the
//! output:
//!
//! ```text
//! constraint   smallest singular value of A
//! actuation    smallest singular value of D N
//! output       smallest singular value of E N
//! closure      smallest singular value of J, and the sign of its determinant
//! ```

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::interrupt;
use crate::math::decomposition::singular_values;
use crate::math::space::Component;
use crate::math::vector::{Vec3, cross};
use crate::mechanism::Mechanism;
use crate::mechanism::answer::Answer;
use crate::mechanism::columns::Row;
use crate::mechanism::dim::{Keep, Wanted};
use crate::nominal::columns::Nearness;

/// A singular value of A below this part of its largest one is none.
const RANK: f64 = 1e-6;
/// Parts of a motion are equally large that differ by less.
const EQUAL: f64 = 1e-9;

/// What of a configuration is judged by how much.
struct Scale<'s> {
    /// The length that counts as much as a radian.
    length: f64,
    /// The components of the output's twist that count.
    components: &'s [usize],
}

impl Mechanism {
    /// Nearness to singularities of assembled configurations, coordinates given one after the other; without
    /// `details` that of the closure alone. `None` where there are not as many rows as unknowns.
    ///
    /// Where A has lost rank its null space is larger than the number of drives; then all of it counts, because which
    /// part of it was there before is not decided by A. With more drives than components that count, some motion leaves
    /// the output at rest everywhere; then the smallest of the first values, one per component, is taken.
    #[must_use]
    pub fn nearness(&self, coordinates: &[f64], length: f64, components: &[usize], details: bool) -> Option<Answer> {
        if self.n_rows() != self.n_unknowns() || components.iter().any(|c| *c >= self.size()) {
            return None;
        }
        let scale = Scale { length, components };
        let wanted = Wanted { keep: Keep { offset: false, details }, ..Wanted::all(self) };
        let found: Vec<Nearness> = coordinates
            .par_chunks_exact(self.n_coordinates().max(1))
            .map(|at| {
                interrupt::check();
                self.nearness_at(at, &scale, &wanted)
            })
            .collect();
        Some(Answer::of_rows(found.iter(), &wanted))
    }

    fn nearness_at(&self, coordinates: &[f64], scale: &Scale<'_>, wanted: &Wanted<'_>) -> Nearness {
        let jacobian = self.scaled_jacobian(coordinates, scale.length);
        let (closure, sign) = (smallest(&jacobian), sign(&jacobian));
        let unknown = Nearness { closure, sign, ..Nearness::unknown(wanted) };
        if !wanted.keep.details {
            return unknown;
        }
        let (joints, drives) = self.held(jacobian, scale.length);
        let (n, split) = (self.n_unknowns(), self.n_unknowns() - self.n_drives());
        if split == 0 {
            return unknown;
        }
        // With rows of zeros every right vector is there, those of the null space last.
        let Some(svd) = singular_values(joints, false, true) else { return unknown };
        let Some(right) = svd.v_t else { return unknown };
        let held = &svd.singular_values;
        let lost = (0..split).filter(|&k| held[k] <= RANK * held[0]).count();
        let free = right.rows(split - lost, n - split + lost).transpose();
        let output = self.output_twist(coordinates, scale.length);
        let (actuated, by_drives) = least(&drives, &free);
        let (shown, by_output) = least(&output.select_rows(scale.components), &free);
        let motions = [right.row(split - 1).transpose(), by_drives, by_output].map(of_unit_size);
        Nearness {
            values: vec![held[split - 1], actuated, shown],
            twists: motions.iter().flat_map(|motion| (&output * motion).as_slice().to_vec()).collect(),
            motions: motions.iter().flat_map(|motion| motion.as_slice().to_vec()).collect(),
            ..unknown
        }
    }

    /// The rows of the joints with what ties the joints of one motor to each other, filled up to a square matrix; and
    /// the motion of every motor.
    fn held(&self, mut jacobian: DMatrix<f64>, length: f64) -> (DMatrix<f64>, DMatrix<f64>) {
        let unit = |component: Component| if matches!(component, Component::About(_)) { 1.0 } else { length };
        let own = self.n_rows() - self.n_driven;
        let mut drives = DMatrix::zeros(self.n_drives(), self.n_unknowns());
        let (mut ties, mut units) = (own, vec![f64::NAN; self.n_drives()]);
        for (k, (row, by)) in self.driven().enumerate() {
            let first = units[by.drive].is_nan();
            if first {
                units[by.drive] = unit(row.component);
            }
            let rate = jacobian.row(own + k) * (unit(row.component) / (by.coefficient * units[by.drive]));
            if first {
                drives.set_row(by.drive, &rate);
            } else {
                // Behind the rows that have been read.
                jacobian.set_row(ties, &(rate - drives.row(by.drive)));
                ties += 1;
            }
        }
        jacobian.rows_mut(ties, self.n_rows() - ties).fill(0.0);
        (jacobian, drives)
    }

    /// From the scaled twists of all bodies to that of the output.
    fn output_twist(&self, coordinates: &[f64], length: f64) -> DMatrix<f64> {
        let (size, point) = (self.size(), &self.points[self.output]);
        let mut map = DMatrix::zeros(size, self.n_unknowns());
        let Some(body) = point.body else { return map };
        if self.seen_from.is_some() {
            let unit = |of: Component| if matches!(of, Component::About(_)) { 1.0 } else { length };
            let (poses, parameters) = (self.poses(coordinates), vec![0.0; self.n_parameters()]);
            for (i, to) in self.space.components().iter().enumerate() {
                let twists = self.component_cost(i, &poses, &parameters).twists;
                for (j, along) in twists.into_iter().enumerate() {
                    map[(i, j)] = along * unit(self.space.components()[j % size]) / unit(*to);
                }
            }
            return map;
        }
        let lever = self.poses(coordinates)[body].turn(point.at).map(|x| x / length);
        for (j, of) in self.space.components().iter().enumerate() {
            let velocity: Vec3<f64> = match of {
                Component::Along(axis) => std::array::from_fn(|i| f64::from(u8::from(i == *axis))),
                Component::About(axis) => cross(std::array::from_fn(|i| f64::from(u8::from(i == *axis))), lever),
            };
            for (i, to) in self.space.components().iter().enumerate() {
                map[(i, body * size + j)] = match to {
                    Component::Along(axis) => velocity[*axis],
                    Component::About(_) => f64::from(u8::from(i == j)),
                };
            }
        }
        map
    }
}

/// The smallest singular value.
fn smallest(matrix: &DMatrix<f64>) -> f64 {
    singular_values(matrix.clone(), false, false).map_or(f64::NAN, |svd| svd.singular_values.min())
}

/// The sign of the determinant, which itself may be too small for a number.
fn sign(matrix: &DMatrix<f64>) -> f64 {
    let lu = matrix.clone().lu();
    let swaps: f64 = lu.p().determinant();
    let pivot = |x: &f64| if *x == 0.0 { 0.0 } else { x.signum() };
    swaps * lu.u().diagonal().iter().map(pivot).product::<f64>()
}

/// The free motion that shows least in some rates: the singular value, and the motion of all bodies.
fn least(rates: &DMatrix<f64>, free: &DMatrix<f64>) -> (f64, DVector<f64>) {
    let unknown = || (f64::NAN, DVector::from_element(free.nrows(), f64::NAN));
    let mapped = rates * free;
    if mapped.is_empty() {
        return unknown();
    }
    let last = mapped.nrows().min(mapped.ncols()) - 1;
    let Some(svd) = singular_values(mapped, false, true) else { return unknown() };
    let Some(right) = svd.v_t else { return unknown() };
    (svd.singular_values[last], free * right.row(last).transpose())
}

/// The motion whose largest part is one characteristic length or one radian, and positive; of parts that rounding alone
/// tells apart the first.
fn of_unit_size(motion: DVector<f64>) -> DVector<f64> {
    let largest = motion.amax();
    let place = motion.iter().position(|part| part.abs() >= (1.0 - EQUAL) * largest);
    let part = place.map_or(f64::NAN, |k| motion[k]);
    motion / part
}
