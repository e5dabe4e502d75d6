//! Poses and assemblability as cone programs, against closed forms, brute force and their own duals.

use crate::clearance::Set;
use crate::cone::{Block, Kind, Outcome, Program, Springs};
use rand::Rng;

use super::{numbers, random_program, rng};

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
    assert!(worst[0] < 1e-9 && worst[1] < 1e-8, "{worst:?}");
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

/// Rows of random combinations of the program's own.
fn with_implied_rows(rng: &mut impl Rng, program: &Program, more: usize, unit: f64) -> Program {
    let mut wider = program.clone();
    for _ in 0..more {
        let factors = numbers(rng, program.n_equations());
        let mix = |row: &dyn Fn(usize) -> f64| unit * factors.iter().enumerate().map(|(i, f)| f * row(i)).sum::<f64>();
        for (block, own) in wider.blocks.iter_mut().zip(&program.blocks) {
            block.map.extend((0..own.size()).map(|k| mix(&|i| own.row(i)[k])).collect::<Vec<_>>());
        }
        wider.right.push(mix(&|i| program.right[i]));
    }
    wider
}

#[test]
fn implied_equations_change_nothing_and_contradictions_are_found() {
    let mut rng = rng(3);
    for _ in 0..20 {
        let program = random_program(&mut rng, 3, 2, 0.5, 1e-4);
        let mut wider = with_implied_rows(&mut rng, &program, 2, 1e3);
        let (a, b) = (program.pose(), wider.pose());
        assert_eq!(b.outcome, Outcome::Solved);
        assert!((a.value - b.value).abs() < 1e-8 * a.value.abs());
        let (a, b) = (program.assembly(Springs::Rigid).factor, wider.assembly(Springs::Rigid).factor);
        assert!((a - b).abs() < 1e-8);
        wider.right[4] += 1e-6;
        assert_eq!(wider.pose().outcome, Outcome::Infeasible);
        assert_eq!(wider.assembly(Springs::Rigid).outcome, Outcome::Infeasible);
        assert!(wider.assembly(Springs::Rigid).factor.is_infinite());
    }
}

#[test]
fn a_rigid_pose_exists_where_the_clearances_need_no_enlarging() {
    let mut rng = rng(4);
    let (mut loose, mut tight) = (0, 0);
    for _ in 0..60 {
        let mut program = random_program(&mut rng, 2, 0, 0.5, 1e-5);
        program.blocks.truncate(6);
        program.right = numbers(&mut rng, 2).iter().map(|b| 3e-5 * b).collect();
        let answer = program.assembly(Springs::Rigid);
        let pose = program.pose();
        if answer.factor > 1.0 {
            assert_eq!(pose.outcome, Outcome::Infeasible, "{}", answer.factor);
            tight += 1;
        } else {
            assert_eq!(pose.outcome, Outcome::Solved, "{}", answer.factor);
            loose += 1;
        }
    }
    assert!(loose > 5 && tight > 5, "{loose} {tight}");
}

#[test]
fn nothing_moves_without_clearance() {
    let zero = Block { kind: Kind::Clearance(Set::Disc { radius: 0.0 }), map: vec![1.0, 2.0], force: vec![3.0, 4.0] };
    let program = Program { right: vec![0.0], blocks: vec![zero.clone()] };
    for answer in [program.pose(), program.assembly(Springs::Rigid)] {
        assert_eq!(answer.outcome, Outcome::Solved);
        assert_eq!((answer.value, answer.displacements), (0.0, vec![vec![0.0; 2]]));
    }
    let misfit = Program { right: vec![1e-6], blocks: vec![zero] };
    assert_eq!(misfit.pose().outcome, Outcome::Infeasible);
    assert!(misfit.assembly(Springs::Rigid).factor.is_infinite());
    // Without any equation and any block there is nothing to be done either.
    assert!(Program::default().pose().value.abs() <= 0.0);
    assert!(Program::default().assembly(Springs::Rigid).factor <= 0.0);
}

/// Without equations the programs are the support functions.
#[test]
fn a_determinate_mechanism_follows_its_load() {
    let mut rng = rng(5);
    for _ in 0..20 {
        let program = random_program(&mut rng, 0, 4, 0.5, 1e-3);
        let answer = program.pose();
        for (block, displacement) in program.blocks.iter().zip(&answer.displacements) {
            let work: f64 = block.force.iter().zip(displacement).map(|(f, d)| f * d).sum();
            match &block.kind {
                Kind::Clearance(set) | Kind::Fixed(set) => assert!((work - set.support(&block.force)).abs() < 1e-15),
                Kind::Spring(f) => {
                    let n = block.size();
                    for i in 0..n {
                        let v: f64 = (0..n).map(|k| f[i * n + k] * block.force[k]).sum();
                        assert!((v - displacement[i]).abs() < 1e-15);
                    }
                }
            }
        }
    }
}

/// Two springs share a load across a gap in one of them: closed form.
#[test]
fn springs_share_a_load_once_the_gap_is_closed() {
    let (k1, k2, gap) = (2e5, 7e5, 1e-4);
    let spring = |k: f64, sign: f64, force: f64| Block {
        kind: Kind::Spring(vec![1.0 / k]),
        map: vec![sign],
        force: vec![force],
    };
    for (load, stop) in [(10.0, false), (50.0, true), (-50.0, true)] {
        let play =
            Block { kind: Kind::Clearance(Set::Interval { low: -gap, high: gap }), map: vec![-1.0], force: vec![0.0] };
        let program = Program { right: vec![0.0], blocks: vec![spring(k1, 1.0, load), spring(k2, -1.0, 0.0), play] };
        let answer = program.pose();
        assert_eq!(answer.outcome, Outcome::Solved);
        let shift = if stop { (load + k2 * gap * f64::signum(load)) / (k1 + k2) } else { load / k1 };
        assert!((answer.displacements[0][0] - shift).abs() < 1e-9 * shift.abs());
        let reaction = program.blocks[1].reaction(&answer.multipliers)[0];
        assert!((reaction - (load - k1 * shift)).abs() < 1e-8 * load.abs(), "{reaction}");
    }
}

/// What the load leaves open has ends that a grid over the open offsets finds, too.
#[test]
fn the_face_of_optimal_poses_is_searched_to_its_ends() {
    // A disc is pushed along x and coupled by its y to an interval and a disc that carry nothing:
    // y = 0 at the optimum, so u + a p = 0 with |u| <= c, |(p, q)| <= r, q free.
    let (r, c, a) = (1e-4, 0.3e-4, 0.6);
    let blocks = vec![
        Block { kind: Kind::Clearance(Set::Disc { radius: 2e-4 }), map: vec![0.0, 1.0], force: vec![5.0, 0.0] },
        Block { kind: Kind::Clearance(Set::Interval { low: -c, high: c }), map: vec![1.0], force: vec![0.0] },
        Block { kind: Kind::Clearance(Set::Disc { radius: r }), map: vec![a, 0.0], force: vec![0.0, 0.0] },
    ];
    let program = Program { right: vec![0.0], blocks };
    let pose = program.pose();
    assert_eq!(pose.outcome, Outcome::Solved);
    let (alpha, beta) = (0.8, 1.3);
    for sign in [1.0, -1.0] {
        let direction = vec![vec![1.0, 0.0], vec![0.0], vec![sign * alpha, sign * beta]];
        let extreme = program.optimal_face(&pose, 1e-6).extreme(&direction);
        assert_eq!(extreme.outcome, Outcome::Solved);
        let mut best = f64::MIN;
        for i in 0..=200_000 {
            let p = (c / a) * (f64::from(i) / 100_000.0 - 1.0);
            best = best.max(alpha * p + beta * (r * r - p * p).sqrt());
        }
        assert!((extreme.value - (2e-4 + best)).abs() < 1e-8 * best, "{} {best}", extreme.value);
    }
    // What the load decides has one value.
    for sign in [1.0, -1.0] {
        let direction = vec![vec![sign, sign], vec![0.0], vec![0.0; 2]];
        let extreme = program.optimal_face(&pose, 1e-6).extreme(&direction);
        assert!((extreme.value - sign * 2e-4).abs() < 1e-12);
    }
}

/// The ends of a face of random programs whose loads leave some joints without a reaction: no other
/// optimal pose goes beyond them, and they are optimal themselves.
#[test]
fn no_optimal_pose_goes_beyond_the_ends_of_the_face() {
    let mut rng = rng(6);
    let mut wide = 0;
    for _ in 0..15 {
        let mut program = random_program(&mut rng, 2, 2, 0.4, 1e-3);
        // Only the first five blocks and the springs are loaded and coupled.
        for (k, block) in program.blocks.iter_mut().enumerate() {
            if (5..14).contains(&k) {
                block.map.fill(0.0);
                if k % 2 == 0 {
                    block.force.fill(0.0);
                }
            }
        }
        program.right = vec![0.0; 2];
        let pose = program.pose();
        assert_eq!(pose.outcome, Outcome::Solved);
        let mut expected = 0.0;
        let direction: Vec<Vec<f64>> = program.blocks.iter().map(|b| numbers(&mut rng, b.size())).collect();
        for (k, (block, c)) in program.blocks.iter().zip(&direction).enumerate() {
            let at = &pose.displacements[k];
            let (Kind::Clearance(set) | Kind::Fixed(set)) = &block.kind else {
                expected += at.iter().zip(c).map(|(a, c)| a * c).sum::<f64>();
                continue;
            };
            let free = (5..14).contains(&k) && k % 2 == 0;
            wide += usize::from(free);
            let decided = set.face(&block.reaction(&pose.multipliers), 1e-9).centre;
            // The equations may hold a coupled offset between two corners of its set.
            let one = if k < 5 { at } else { &decided[..at.len()] };
            expected += if free { set.support(c) } else { one.iter().zip(c).map(|(a, c)| a * c).sum::<f64>() };
        }
        let extreme = program.optimal_face(&pose, 1e-7).extreme(&direction);
        assert_eq!(extreme.outcome, Outcome::Solved);
        // A gap of 1e-11 leaves offsets on round sets an arc of its root.
        assert!((extreme.value - expected).abs() < 1e-6 * expected.abs().max(1e-3), "{} {expected}", extreme.value);
    }
    assert!(wide > 30);
}
