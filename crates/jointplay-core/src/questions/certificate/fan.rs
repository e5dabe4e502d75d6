//! The size of an error by its components along directions.
//!
//! The bound of a component along one direction is often close where those of many directions together are not: each
//! offset is where that direction has it. In a cell of directions nothing is longer than its components along the corners
//! allow ([`Direction::corners`]), and the cell with the largest bound is halved first.

use std::collections::HashMap;

use crate::questions::certificate::atlas::Atlas;
use crate::questions::certificate::directions::Direction;
use crate::questions::certificate::errors::Errors;
use crate::questions::certificate::search::{Bounded, Search, Sought};

/// Corners closer than this are one: what is between them, as a part of the size, is in this factor.
const SAME: f64 = 1e-9;
const APART: f64 = 1.0 + 1e-8;
/// Cells at most.
const CELLS: usize = 1000;

/// The search for the bound of a size.
pub(super) struct Fan<'s, 'm> {
    pub errors: &'s Errors<'m>,
    pub atlas: &'s Atlas,
    pub components: std::ops::Range<usize>,
    /// What is attained; a bound along a direction need not be below it.
    pub attained: f64,
    /// A bound below this is good enough.
    pub enough: f64,
    /// Parts that may be expanded.
    pub budget: u64,
}

impl Fan<'_, '_> {
    pub fn run(&self) -> Bounded {
        let mut known = HashMap::new();
        let mut parts = 0;
        let mut cells: Vec<(f64, Direction)> = Vec::new();
        for cell in Direction::all(self.components.len()) {
            cells.push((self.bound(&cell, &mut known, &mut parts), cell));
        }
        let largest = |cells: &[(f64, Direction)]| (0..cells.len()).max_by(|&a, &b| cells[a].0.total_cmp(&cells[b].0));
        while let Some(k) = largest(&cells) {
            if cells[k].0 <= self.enough || parts >= self.budget || cells.len() >= CELLS {
                return Bounded { bound: cells[k].0, parts };
            }
            let (bound, cell) = cells.swap_remove(k);
            for half in cell.halves() {
                let found = self.bound(&half, &mut known, &mut parts);
                cells.push((found.min(bound), half));
            }
        }
        Bounded { bound: f64::INFINITY, parts }
    }

    /// Of what has its direction in a cell.
    fn bound(&self, cell: &Direction, known: &mut HashMap<Vec<i64>, f64>, parts: &mut u64) -> f64 {
        let (corners, factor) = cell.corners();
        let mut largest = 0.0_f64;
        for corner in corners {
            let key = corner.iter().map(|x| (x / SAME).round() as i64).collect();
            largest = largest.max(*known.entry(key).or_insert_with(|| {
                let found = self.along(&corner, self.budget.saturating_sub(*parts));
                *parts += found.parts;
                found.bound
            }));
        }
        largest * factor * APART
    }

    /// Along one direction.
    fn along(&self, direction: &[f64], budget: u64) -> Bounded {
        let sought = Sought::along(self.components.clone(), Direction::of(direction));
        Search { errors: self.errors, atlas: self.atlas, sought, enough: self.attained, poor: f64::INFINITY, budget }
            .run()
    }
}
