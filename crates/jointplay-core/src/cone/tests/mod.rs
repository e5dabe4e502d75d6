//! Random cone programs of all kinds of sets.

mod answers;
mod lanes;
mod newton;
mod programs;

use crate::clearance::Set;
use crate::cone::{Block, Kind, Program};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

pub fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

/// One set of every kind, and some that are points or flat, with sizes near `scale`.
pub fn sets(rng: &mut impl Rng, scale: f64) -> Vec<Set> {
    let mut size = || rng.random_range(0.2..2.0);
    let (radius, gap, axial) = (scale * size(), scale * size(), scale * size());
    let (half_length, half_width, half_height) = (size(), size(), size());
    vec![
        Set::Disc { radius },
        Set::Diamond { gap, half_length },
        Set::Interval { low: -gap, high: axial },
        Set::Interval { low: 0.0, high: gap },
        Set::Ball { radius },
        Set::Journal { radius, half_length, axial },
        Set::Journal { radius, half_length, axial: 0.0 },
        Set::Journal { radius: 0.0, half_length, axial },
        Set::Sleeve { radius, half_length },
        Set::Guide { gap, half_length, half_width, half_height },
        Set::Guide { gap, half_length, half_width: 0.0, half_height },
        Set::Plate { gap, half_normal: half_width, half_side: half_height },
        Set::Disc { radius: 0.0 },
        Set::Interval { low: 0.0, high: 0.0 },
    ]
}

pub fn numbers(rng: &mut impl Rng, n: usize) -> Vec<f64> {
    (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
}

/// A random compliance, of rank one where asked for.
pub fn compliance(rng: &mut impl Rng, size: usize, rank: usize, scale: f64) -> Vec<f64> {
    let columns: Vec<Vec<f64>> = (0..rank).map(|_| numbers(rng, size)).collect();
    let entry = |i: usize, j: usize| scale * columns.iter().map(|c| c[i] * c[j]).sum::<f64>();
    (0..size * size).map(|k| entry(k / size, k % size)).collect()
}

pub fn block(rng: &mut impl Rng, kind: Kind, size: usize, s: usize) -> Block {
    Block { kind, map: numbers(rng, s * size), force: numbers(rng, size) }
}

/// A random offset of a set, as a part of the largest ones.
pub fn inside(rng: &mut impl Rng, set: &Set, part: f64) -> Vec<f64> {
    let w = numbers(rng, set.size());
    set.face(&w, 0.0).centre[..set.size()].iter().map(|d| part * d).collect()
}

pub fn displace(program: &Program, displacements: &[Vec<f64>]) -> Vec<f64> {
    let row = |i| {
        let blocks = program.blocks.iter().zip(displacements);
        blocks.map(|(b, d)| b.row(i).iter().zip(d).map(|(a, d)| a * d).sum::<f64>()).sum()
    };
    (0..program.n_equations()).map(row).collect()
}

/// A program of random sets of all kinds and springs, with lack of fit within `part` of the clearances.
pub fn random_program(rng: &mut impl Rng, s: usize, springs: usize, part: f64, scale: f64) -> Program {
    let mut program = Program { right: vec![0.0; s], blocks: Vec::new() };
    let mut displacements = Vec::new();
    for set in sets(rng, scale) {
        displacements.push(inside(rng, &set, part));
        let kind = if displacements.len() % 5 == 4 { Kind::Fixed(set) } else { Kind::Clearance(set) };
        program.blocks.push(block(rng, kind, set.size(), s));
    }
    for k in 0..springs {
        let size = 1 + k % 3;
        let rank = if k % 2 == 0 { size } else { 1 };
        let kind = Kind::Spring(compliance(rng, size, rank, scale));
        program.blocks.push(block(rng, kind, size, s));
        displacements.push(vec![0.0; size]);
    }
    program.right = displace(&program, &displacements);
    program
}
