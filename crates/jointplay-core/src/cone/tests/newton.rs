//! Newton's method on the multipliers, from answers nearby and from anywhere.

use crate::clearance::Set;
use crate::cone::{Answer, Block, Kind, Outcome, Program, Question, Springs};
use nalgebra::{DMatrix, DVector};
use rand::Rng;

use super::{block, compliance, displace, inside, numbers, random_program, rng, sets};

fn alone(program: &Program, question: Question) -> Answer {
    match question {
        Question::Pose => program.pose(),
        Question::Assembly => program.assembly(Springs::Rigid),
    }
}

/// Whether an answer is one: the sets hold every offset, the equations are fulfilled, and the multipliers prove that
/// nothing better is possible, as the support functions of the sets tell.
fn assert_proved(program: &Program, question: Question, answer: &Answer) {
    for (block, offset) in program.blocks.iter().zip(&answer.displacements) {
        let factor = if matches!(block.kind, Kind::Clearance(_)) { answer.factor } else { 1.0 };
        let unscaled: Vec<f64> = offset.iter().map(|d| d / factor).collect();
        assert!(block.kind.set().is_none_or(|set| set.contains(&unscaled, 1e-9)), "{block:?} {offset:?}");
    }
    let reach = |i: usize| program.blocks.iter().flat_map(|b| b.row(i)).map(|a| a.abs()).sum::<f64>();
    for (i, (sum, b)) in displace(program, &answer.displacements).iter().zip(&program.right).enumerate() {
        assert!((sum - b).abs() < 1e-10 * (reach(i) + b.abs()), "{sum} {b}");
    }
    if question == Question::Assembly {
        let (mut fixed, mut scaled) = (0.0, 0.0);
        for block in &program.blocks {
            let support = block.kind.set().map_or(0.0, |set| set.support(&block.stress(&answer.multipliers)));
            *(if matches!(block.kind, Kind::Clearance(_)) { &mut scaled } else { &mut fixed }) += support;
        }
        let work: f64 = program.right.iter().zip(&answer.multipliers).map(|(b, y)| b * y).sum();
        assert!((answer.factor - (work - fixed) / scaled).abs() < 1e-10 * answer.factor.max(1.0));
    }
}

/// A program of round sets and intervals, lack of fit within `part` of what they reach. Tapered sets between corners,
/// which many random programs have, are left to others.
fn smooth_program(rng: &mut impl Rng, s: usize, springs: usize, part: f64) -> Program {
    let is_tapered = |set: &Set| matches!(set, Set::Guide { .. } | Set::Plate { .. } | Set::Diamond { .. });
    let mut program = Program { right: vec![0.0; s], blocks: Vec::new() };
    let mut displacements = Vec::new();
    for (k, set) in sets(rng, 1e-4).into_iter().filter(|set| !is_tapered(set)).enumerate() {
        displacements.push(inside(rng, &set, part));
        let kind = if k % 5 == 4 { Kind::Fixed(set) } else { Kind::Clearance(set) };
        program.blocks.push(block(rng, kind, set.size(), s));
    }
    for k in 0..springs {
        let size = 1 + k % 3;
        displacements.push(vec![0.0; size]);
        let kind = Kind::Spring(compliance(rng, size, size, 1e-4));
        program.blocks.push(block(rng, kind, size, s));
    }
    program.right = displace(&program, &displacements);
    program
}

#[test]
fn an_answer_nearby_leads_to_the_last_digits() {
    let mut rng = rng(11);
    let (mut asked, mut led) = (0, 0);
    for s in [1, 2, 3, 6] {
        for springs in [0, 4] {
            for part in [0.4, 1.5] {
                for question in [Question::Pose, Question::Assembly] {
                    let program = smooth_program(&mut rng, s, springs, part);
                    let solved = alone(&program, question);
                    if solved.outcome != Outcome::Solved {
                        continue;
                    }
                    let mut near = solved.clone();
                    near.multipliers.iter_mut().for_each(|y| *y *= 1.0 + 1e-5 * rng.random_range(-1.0..1.0));
                    near.factor *= 1.0 + 1e-6;
                    asked += 1;
                    let Some(found) = program.answer_near(question, &near) else { continue };
                    led += 1;
                    assert_eq!(found.outcome, Outcome::Solved);
                    assert!(found.gap < 1e-11 && found.residual < 1e-11, "{question:?} {found:?}");
                    assert_proved(&program, question, &found);
                    assert!((found.value - solved.value).abs() < 1e-9 * solved.unit, "{found:?} {solved:?}");
                }
            }
        }
    }
    // Where reactions all but vanish, or more bodies are in corners than the multipliers hold, others decide.
    assert!(asked > 20 && 3 * led > 2 * asked, "{led} of {asked}");
}

#[test]
fn from_anywhere_it_leads_to_the_optimum_or_nowhere() {
    let mut rng = rng(12);
    for _ in 0..60 {
        let program = random_program(&mut rng, 2, 2, 0.5, 1e-4);
        let solved = program.pose();
        let mut start = solved.clone();
        let size = solved.multipliers.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
        start.multipliers = numbers(&mut rng, 2).iter().map(|y| 2.0 * size * y).collect();
        if let Some(found) = program.answer_near(Question::Pose, &start) {
            assert!((found.value - solved.value).abs() < 1e-9 * solved.unit, "{found:?} {solved:?}");
            assert_proved(&program, Question::Pose, &found);
        }
    }
    // Nor is it misled by an answer to another program.
    let (program, other) = (random_program(&mut rng, 2, 2, 0.5, 1e-4), random_program(&mut rng, 3, 2, 0.5, 1e-4));
    assert!(program.answer_near(Question::Pose, &other.pose()).is_none());
}

#[test]
fn springs_alone_are_a_linear_system() {
    let mut rng = rng(13);
    let (s, sizes) = (3, [2, 3, 1, 3]);
    let springs: Vec<Vec<f64>> = sizes.iter().map(|&n| compliance(&mut rng, n, n, 1e-6)).collect();
    let blocks: Vec<Block> =
        sizes.iter().zip(&springs).map(|(&n, f)| block(&mut rng, Kind::Spring(f.clone()), n, s)).collect();
    let program = Program { right: numbers(&mut rng, s).iter().map(|b| 1e-6 * b).collect(), blocks };
    // (A F A') y = b - A F w.
    let (mut matrix, mut right) = (DMatrix::zeros(s, s), DVector::from_column_slice(&program.right));
    for (block, f) in program.blocks.iter().zip(&springs) {
        let n = block.size();
        let (a, f) = (DMatrix::from_row_slice(s, n, &block.map), DMatrix::from_row_slice(n, n, f));
        matrix += &a * &f * a.transpose();
        right -= &a * &f * DVector::from_column_slice(&block.force);
    }
    let multipliers = matrix.lu().solve(&right).unwrap();
    let start = Answer { multipliers: vec![0.0; s], ..program.pose() };
    let found = program.answer_near(Question::Pose, &start).unwrap();
    for (a, b) in found.multipliers.iter().zip(multipliers.iter()) {
        assert!((a - b).abs() < 1e-9 * multipliers.amax(), "{a} {b}");
    }
}
