//! Eight programs at a time against the same programs one at a time.

use jointplay_core::cone::lanes::{Programs, Question};
use jointplay_core::cone::{Outcome, Program, Springs};

mod common;
use common::{random_program, rng};

fn alone(program: &Program, question: Question) -> jointplay_core::cone::Answer {
    match question {
        Question::Pose => program.pose(),
        Question::Assembly => program.assembly(Springs::Rigid),
    }
}

#[test]
fn eight_at_a_time_are_what_each_is_alone() {
    let mut rng = rng(11);
    let mut worst = [0.0_f64; 4];
    for s in [1, 2, 3, 6, 7, 12] {
        for springs in [0, 4] {
            for scale in [1.0, 1e-5] {
                for question in [Question::Pose, Question::Assembly] {
                    let programs: Vec<Program> =
                        (0..21).map(|_| random_program(&mut rng, s, springs, 0.5, scale)).collect();
                    let all = Programs::of(&programs);
                    let answers = all.solve(question);
                    println!(
                        "{s} {springs} {scale} {question:?}: alone {} diff {:.1e} gap {:.1e}",
                        answers.alone,
                        answers.difference,
                        answers.gaps.iter().fold(0.0_f64, |a, b| a.max(*b))
                    );
                    for (k, program) in programs.iter().enumerate() {
                        let one = alone(program, question);
                        assert_eq!(answers.outcomes[k], Outcome::Solved);
                        let unit = (one.value - one.dual_value).abs() / one.gap.max(1e-300);
                        let unit = unit.max(one.value.abs());
                        worst[0] = worst[0].max((one.value - answers.values[k]).abs() / unit);
                        let y = one.multipliers.iter().fold(0.0_f64, |a, y| a.max(y.abs()));
                        for i in 0..s {
                            worst[1] = worst[1].max((one.multipliers[i] - answers.multipliers[k * s + i]).abs() / y);
                        }
                    }
                }
            }
        }
    }
    println!("{worst:?}");
}
