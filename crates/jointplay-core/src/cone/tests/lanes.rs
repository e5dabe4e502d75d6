//! Eight programs at a time against the same programs one at a time.

use crate::cone::lanes::{Answers, Programs};
use crate::cone::{Outcome, Program, Question};
use crate::math::lanes::{Width, limit};

use super::{random_program, rng};

const QUESTIONS: [Question; 2] = [Question::Pose, Question::Assembly];

/// Programs of all kinds of sets, in no multiple of eight.
fn some(seed: u64, s: usize, springs: usize, scale: f64) -> Programs<'static> {
    let mut rng = rng(seed);
    let programs: Vec<Program> = (0..21).map(|_| random_program(&mut rng, s, springs, 0.5, scale)).collect();
    Programs::of(&programs)
}

#[test]
fn eight_at_a_time_are_what_each_is_alone() {
    let (mut solved, mut alone) = (0, 0);
    for s in [1, 2, 3, 6, 7, 12] {
        for springs in [0, 4] {
            for scale in [1.0, 1e-5] {
                let all = some(s as u64, s, springs, scale);
                for question in QUESTIONS {
                    let answers = all.solve(question);
                    assert!(answers.compared == 1 && answers.difference < 1e-8);
                    solved += all.n;
                    alone += answers.alone;
                    for k in 0..all.n {
                        let one = all.alone(question, k);
                        assert_eq!(answers.outcomes[k], Outcome::Solved);
                        // Nothing is left of a difference between zeros.
                        let difference = (one.value - answers.values[k]).abs() / one.unit.max(1e-300);
                        assert!(difference < 1e-8, "{s} {springs} {scale} {question:?} {difference}");
                        if question == Question::Pose {
                            same_reactions(&all, &answers, k, &one.multipliers);
                        }
                    }
                }
            }
        }
    }
    assert!(alone * 50 < solved, "{alone} of {solved} alone");
}

/// Reactions as parts of the largest one of all blocks of the same number of components.
fn same_reactions(all: &Programs<'_>, answers: &Answers, number: usize, multipliers: &[f64]) {
    let program = all.program(number);
    let s = all.n_equations;
    let found = &answers.multipliers[number * s..(number + 1) * s];
    let of = |y: &[f64]| -> Vec<f64> { program.blocks.iter().flat_map(|b| b.reaction(y)).collect() };
    let (a, b) = (of(found), of(multipliers));
    let largest = b.iter().fold(0.0_f64, |most, w| most.max(w.abs()));
    let difference = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // Where a value is right to 1e-11, round sets leave the reactions its root in the worst case.
    assert!(difference < 3e-6 * largest, "{difference} {largest}");
}

#[test]
fn the_width_of_the_registers_changes_nothing() {
    let all = some(5, 5, 3, 1e-4);
    for question in QUESTIONS {
        let found = [Width::Plain, Width::Avx2, Width::Avx512].map(|width| {
            limit(width);
            let answers = all.solve(question);
            [answers.values, answers.displacements, answers.multipliers, answers.dual_values]
        });
        assert_eq!(found[0], found[1]);
        assert_eq!(found[0], found[2]);
    }
}
