//! The size of an error by its components along directions.
//!
//! Along one direction the bound of a part is close ([`Second`](super::second::Second)), and costs little beside the
//! expansion of the part. In a cell of directions nothing is longer than its components along the corners allow
//! ([`Direction::corners`]); neighbouring cells share corners, and the cell with the largest bound is halved first.

use std::collections::HashMap;

use crate::questions::certificate::directions::Direction;

/// Corners closer than this are one: what is between them, as a part of the size, is in this factor.
const SAME: f64 = 1e-9;
const APART: f64 = 1.0 + 1e-8;
/// Cells that are narrower are not halved where a corner by itself is not bounded well enough.
const NARROW: f64 = 0.26;
/// Cells at most.
const CELLS: usize = 2000;

/// What is not exceeded by the size of a vector that has its direction in one of some cells, by what is not exceeded along
/// single directions: below `enough` where these are and cells are not too many.
pub(super) fn fan(cells: &[Direction], enough: f64, along: impl Fn(&[f64]) -> f64) -> f64 {
    let mut known = HashMap::new();
    // The bound of a cell, and the largest one along its corners.
    let mut of = |cell: &Direction| {
        let (corners, factor) = cell.corners();
        let mut highest = 0.0_f64;
        for corner in corners {
            let key: Vec<i64> = corner.iter().map(|x| (x / SAME).round() as i64).collect();
            highest = highest.max(*known.entry(key).or_insert_with(|| along(&corner)));
        }
        (highest * factor * APART, highest)
    };
    let mut cells: Vec<_> = cells.iter().map(|cell| (of(cell), cell.clone())).collect();
    loop {
        let largest = (0..cells.len()).max_by(|&a, &b| cells[a].0.0.total_cmp(&cells[b].0.0)).unwrap_or(0);
        let ((bound, highest), cell) = &cells[largest];
        let is_left = *highest > enough && cell.width() <= NARROW;
        if *bound <= enough || is_left || cells.len() >= CELLS {
            return *bound;
        }
        let ((bound, _), cell) = cells.swap_remove(largest);
        for half in cell.halves() {
            let (found, highest) = of(&half);
            cells.push(((found.min(bound), highest), half));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vector::inner;

    /// Of vectors within an ellipsoid.
    fn ellipsoid(radii: [f64; 3]) -> impl Fn(&[f64]) -> f64 {
        move |n| n.iter().zip(radii).map(|(n, r)| (n * r).powi(2)).sum::<f64>().sqrt()
    }

    #[test]
    fn sizes_are_bounded_as_closely_as_is_enough() {
        for radii in [[1.0, 1.0, 1.0], [0.2, 1.0, 0.9]] {
            let bound = fan(&Direction::all(3), 1.01, ellipsoid(radii));
            assert!((1.0..=1.01).contains(&bound), "{bound}");
        }
    }

    /// Nothing is known but its components along the corners.
    #[test]
    fn no_vector_is_longer_than_its_bound() {
        for vector in [[0.3, -0.8, 0.52], [1.0, 0.0, 0.0], [-0.1, 0.2, 0.97]] {
            let (size, along) = (inner(&vector, &vector).sqrt(), |n: &[f64]| inner(n, &vector));
            for enough in [0.0, 0.9 * size, size, 1.001 * size] {
                let bound = fan(&Direction::all(3), enough, along);
                assert!(bound >= size && bound < 1.03 * size, "{bound} {size}");
            }
        }
    }
}
