//! Lines along which a chain steps: of groups of members, as far as the equations leave these alone.
//!
//! Members are taken in a cycle, from each of them on and by several strides, as many as half of whose coordinates are free
//! of the equations.

use std::ops::Range;

use nalgebra::DMatrix;

use crate::questions::random::over_constrained::directions::Directions;
use crate::redundancy::parts::split;

/// Strides between the members of a group.
const STRIDES: usize = 3;
/// Steps of a chain, for every dimension of the section and every direction of its largest group: lines find their
/// way through a group in steps by the square of its directions. For every dimension they are within these bounds.
const STEPS: usize = 6;
const LEAST: usize = 16;
const MOST: usize = 40;
/// All groups together span the section where this part of every direction is in them.
const SPANS: f64 = 1e-2;

/// The lines of a section, group by group.
#[derive(Clone, Debug)]
pub(crate) struct Lines {
    pub groups: Vec<Group>,
    /// Steps of a chain.
    pub steps: usize,
}

/// Members that step together.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    pub members: Vec<usize>,
    /// Their coordinates, one after the other.
    pub places: Vec<usize>,
    pub directions: Directions,
}

impl Group {
    /// With the directions that the equations leave.
    fn new(ranges: &[Range<usize>], equations: &DMatrix<f64>, members: Vec<usize>) -> (Self, DMatrix<f64>) {
        let places: Vec<usize> = members.iter().flat_map(|&m| ranges[m].clone()).collect();
        let free = split(&equations.select_columns(&places).transpose()).1;
        (Self { members, places, directions: Directions::new(&free) }, free)
    }
}

impl Lines {
    /// Of equations, each in a unit of its own.
    pub fn new(ranges: &[Range<usize>], equations: &DMatrix<f64>, dimensions: usize) -> Self {
        let mut equations = equations.clone();
        for mut row in equations.row_iter_mut() {
            let size = row.norm();
            if size > 0.0 {
                row.unscale_mut(size);
            }
        }
        let all: Vec<usize> = (0..ranges.len()).collect();
        let held = split(&equations.transpose()).0;
        let mut spanned = &held * held.transpose();
        let mut groups = Vec::new();
        for stride in 1..=STRIDES.min(all.len().saturating_sub(1)) {
            for first in 0..all.len() {
                let (group, free) = Group::new(ranges, &equations, members(ranges, equations.nrows(), first, stride));
                for direction in free.column_iter() {
                    for (k, &j) in group.places.iter().enumerate() {
                        for (l, &i) in group.places.iter().enumerate() {
                            spanned[(j, i)] += direction[k] * direction[l];
                        }
                    }
                }
                groups.extend((group.directions.dimensions > 0).then_some(group));
            }
        }
        let spans = spanned.cholesky().is_some_and(|factors| factors.l_dirty().diagonal().min().powi(2) > SPANS);
        if !spans || groups.is_empty() {
            groups = vec![Group::new(ranges, &equations, all).0];
        }
        let largest = groups.iter().map(|group| group.directions.dimensions).max().unwrap_or_default();
        Self { groups, steps: (STEPS * largest).clamp(LEAST, MOST) * dimensions }
    }
}

/// As many members as have twice as many coordinates as there are equations, two at least.
fn members(ranges: &[Range<usize>], equations: usize, first: usize, stride: usize) -> Vec<usize> {
    let n = ranges.len();
    let (mut members, mut coordinates, mut next) = (Vec::new(), 0, first);
    while members.len() < n && (members.len() < 2 || coordinates < 2 * equations) {
        while members.contains(&next) {
            next = (next + 1) % n;
        }
        members.push(next);
        coordinates += ranges[next].len();
        next = (next + stride) % n;
    }
    members
}
