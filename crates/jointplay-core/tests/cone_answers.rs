//! Poses and assemblability as cone programs, against closed forms, brute force and their own duals.

use jointplay_core::clearance::Set;
use jointplay_core::cone::{Block, Kind, Outcome, Program, Springs};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

/// One set of every kind, and some that are points or flat, with sizes near `scale`.
fn sets(rng: &mut impl Rng, scale: f64) -> Vec<Set> {
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

fn numbers(rng: &mut impl Rng, n: usize) -> Vec<f64> {
    (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
}

/// A random compliance, of rank one where asked for.
fn compliance(rng: &mut impl Rng, size: usize, rank: usize, scale: f64) -> Vec<f64> {
    let columns: Vec<Vec<f64>> = (0..rank).map(|_| numbers(rng, size)).collect();
    let entry = |i: usize, j: usize| scale * columns.iter().map(|c| c[i] * c[j]).sum::<f64>();
    (0..size * size).map(|k| entry(k / size, k % size)).collect()
}

fn block(rng: &mut impl Rng, kind: Kind, size: usize, s: usize) -> Block {
    Block { kind, map: numbers(rng, s * size), force: numbers(rng, size) }
}

/// A random offset of a set, as a part of the largest ones.
fn inside(rng: &mut impl Rng, set: &Set, part: f64) -> Vec<f64> {
    let w = numbers(rng, set.size());
    set.face(&w, 0.0).centre[..set.size()].iter().map(|d| part * d).collect()
}

fn displace(program: &Program, displacements: &[Vec<f64>]) -> Vec<f64> {
    let row = |i| {
        let blocks = program.blocks.iter().zip(displacements);
        blocks.map(|(b, d)| b.row(i).iter().zip(d).map(|(a, d)| a * d).sum::<f64>()).sum()
    };
    (0..program.n_equations()).map(row).collect()
}

/// A program of random sets of all kinds and springs, with lack of fit within `part` of the clearances.
fn random_program(rng: &mut impl Rng, s: usize, springs: usize, part: f64, scale: f64) -> Program {
    let mut program = Program { right: vec![0.0; s], blocks: Vec::new() };
    let mut displacements = Vec::new();
    for set in sets(rng, scale) {
        displacements.push(inside(rng, &set, part));
        let kind = if rng.random_bool(0.2) { Kind::Fixed(set) } else { Kind::Clearance(set) };
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

#[test]
fn poses_and_self_stresses_prove_each_other() {
    let mut rng = rng(1);
    let mut worst = [0.0_f64; 2];
    for s in [0, 1, 2, 3, 6, 10] {
        for springs in [0, 5] {
            for scale in [1.0, 1e-5] {
                for _ in 0..4 {
                    let program = random_program(&mut rng, s, springs, 0.6, scale);
                    let answer = program.pose();
                    worst = [worst[0].max(answer.gap), worst[1].max(answer.residual)];
                    assert_eq!(answer.outcome, Outcome::Solved, "{s} {springs} {scale}: {answer:?}");
                    let factor = program.assembly(Springs::Rigid);
                    worst = [worst[0].max(factor.gap), worst[1].max(factor.residual)];
                    assert_eq!(factor.outcome, Outcome::Solved, "{s} {springs} {scale}: {factor:?}");
                    assert!(factor.factor <= 0.6 + 1e-9, "{factor:?}");
                }
            }
        }
    }
    println!("{worst:?}");
}

/// One bar closes a rigid frame, misfit g: `N = k sign(g) max(0, |g| - sum_j r_j |s_j|)`.
#[test]
fn a_redundant_bar_is_free_within_the_play_and_a_spring_beyond_it() {
    let mut rng = rng(2);
    for _ in 0..40 {
        let n = rng.random_range(1..8);
        let mut program = Program { right: vec![1e-4 * rng.random_range(-1.0..1.0)], blocks: Vec::new() };
        let mut play = 0.0;
        for _ in 0..n {
            let radius = 1e-4 * rng.random_range(0.0..0.3);
            let map = numbers(&mut rng, 2);
            play += radius * map[0].hypot(map[1]);
            program.blocks.push(Block { kind: Kind::Clearance(Set::Disc { radius }), map, force: vec![0.0; 2] });
        }
        let stiffness = 10f64.powf(rng.random_range(4.0..9.0));
        program.blocks.push(Block { kind: Kind::Spring(vec![1.0 / stiffness]), map: vec![1.0], force: vec![0.0] });
        let misfit = program.right[0];
        let answer = program.pose();
        let force = stiffness * (misfit.abs() - play).max(0.0).copysign(misfit);
        let unit = stiffness * misfit.abs();
        assert_eq!(answer.outcome, Outcome::Solved);
        assert!((answer.multipliers[0] - force).abs() < 1e-8 * unit, "{} {force} {unit}", answer.multipliers[0]);
        let assembly = program.assembly(Springs::Rigid);
        assert_eq!(assembly.outcome, Outcome::Solved);
        assert!((assembly.factor - misfit.abs() / play).abs() < 1e-9 * assembly.factor);
        assert!(program.assembly(Springs::Free).factor < 1e-12);
    }
}
