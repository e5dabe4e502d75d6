use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::program::native::allocate::{Source, Vector, allocate};
use crate::program::native::encode::Lanes;
use crate::program::native::executable::Executable;
use crate::program::native::*;
use crate::program::symbol::{Recorder, Symbol};
use crate::program::tape::Program;

const INPUTS: usize = 9;
const COMMON: [f64; 2] = [0.3, -2.5];

/// A program of random operations on random earlier results, of which `alive` are kept for the end. Inputs,
/// constants and repeated operands occur, and outputs that are one and the same. Some outputs replace inputs,
/// and every other program stands behind another one.
fn program(rng: &mut Xoshiro256PlusPlus, operations: usize, alive: usize) -> Program {
    let recorder = Recorder::passing(0.1);
    let mut symbols: Vec<Symbol<'_>> = (0..INPUTS).map(|k| recorder.varying(k)).collect();
    symbols.extend((0..COMMON.len()).map(|k| recorder.common(k)));
    symbols.extend([Symbol::Constant(1.7), Symbol::Constant(-0.0)]);
    for _ in 0..operations {
        let recent = |rng: &mut Xoshiro256PlusPlus| {
            let reach = if rng.random_bool(0.2) { symbols.len() } else { symbols.len().min(8) };
            symbols[symbols.len() - 1 - rng.random_range(0..reach)]
        };
        let (a, mut b, mut c) = (recent(rng), recent(rng), recent(rng));
        b = if rng.random_bool(0.1) { a } else { b };
        c = if rng.random_bool(0.1) { a } else { c };
        symbols.push(match rng.random_range(0..11) {
            0 => a + b,
            1 => a - b,
            2 => a * b,
            3 => a / b,
            4 => a.max(b),
            5 => -a,
            6 => a.abs(),
            7 => a * b + c,
            8 => a * b - c,
            9 => (a * a).max(b.abs()),
            _ => c - a * b,
        });
    }
    let outputs: Vec<Symbol<'_>> = (0..alive).map(|k| symbols[symbols.len() - 1 - 3 * k % symbols.len()]).collect();
    let first = Program::new(&recorder, INPUTS, &outputs, 0..0);
    let computed = first.line().outputs.iter().take_while(|&&r| r as usize >= INPUTS).count();
    let replaced = (0..computed.min(INPUTS / 2)).map(|k| 2 * k);
    if alive.is_multiple_of(2) {
        Program::after(&first, &recorder, &outputs, replaced)
    } else {
        Program::new(&recorder, INPUTS, &outputs, replaced)
    }
}

/// Inputs of all sorts, zeros, infinities and what is not a number among them.
fn inputs(rng: &mut Xoshiro256PlusPlus, program: &Program) -> Vec<Block> {
    let special = [0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e-310];
    let mut blocks = program.registers(&COMMON);
    for lane in blocks[..INPUTS].iter_mut().flat_map(|b| &mut b.0) {
        let odd = rng.random_bool(0.1);
        *lane = if odd { special[rng.random_range(0..special.len())] } else { rng.random_range(-2.0..2.0) };
    }
    blocks
}

fn widths() -> impl Iterator<Item = Lanes> {
    let four = std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma");
    let eight = std::is_x86_feature_detected!("avx512f") && std::is_x86_feature_detected!("avx512dq");
    [(Lanes::Four, four), (Lanes::Eight, eight)].into_iter().filter_map(|(lanes, there)| there.then_some(lanes))
}

fn assert_same_outputs(program: &Program, found: &[Block], expected: &[Block], what: &str) {
    for k in 0..program.n_outputs() {
        for (lane, (a, b)) in program.output(found, k).0.iter().zip(program.output(expected, k).0).enumerate() {
            let same = a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
            assert!(same, "{what}, output {k}, lane {lane}: {a:e} instead of {b:e}");
        }
    }
}

#[test]
fn machine_code_gives_the_bits_of_the_interpreter() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    for round in 0..300 {
        let program = program(&mut rng, 1 + 3 * round, 1 + round % 70);
        let blocks = inputs(&mut rng, &program);
        let mut expected = blocks.clone();
        program.interpret(&mut expected);
        for lanes in widths() {
            let layout = Layout::new(&program.line());
            for n_vector in [4, 5, 7, 11, lanes.n_registers()] {
                let code = Executable::new(&program.line(), layout, lanes, n_vector).expect("executable memory");
                let mut found = blocks.clone();
                #[allow(unsafe_code)]
                // SAFETY: only widths that this processor has.
                unsafe {
                    code.run(&mut found);
                }
                assert_same_outputs(&program, &found, &expected, &format!("{lanes:?} on {n_vector}, round {round}"));
                // So are the inputs, for the next run.
                let inputs = found[..INPUTS].iter().zip(&expected).flat_map(|(a, b)| a.0.into_iter().zip(b.0));
                let same = |(a, b): (f64, f64)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
                assert!({ inputs }.all(same), "{lanes:?} on {n_vector}, round {round}");
            }
        }
    }
}

#[test]
fn replays_give_the_same_before_and_after_compiling() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let program = program(&mut rng, 200, 12);
    let blocks = inputs(&mut rng, &program);
    let mut expected = blocks.clone();
    program.interpret(&mut expected);
    for replay in 0..40 {
        let mut found = blocks.clone();
        program.run(&mut found);
        assert_same_outputs(&program, &found, &expected, &format!("replay {replay}"));
    }
}

/// A sum of products: every operand is used once, so none has to be loaded before.
#[test]
fn numbers_used_once_are_read_from_memory() {
    let recorder = Recorder::passing(0.1);
    let mut sum = recorder.varying(0) * recorder.varying(1);
    for k in 1..INPUTS / 2 {
        sum = sum + recorder.varying(2 * k) * recorder.varying(2 * k + 1);
    }
    let program = Program::new(&recorder, INPUTS, &[sum], 0..0);
    let code = allocate(&program.line(), 4);
    let loads = code.iter().filter(|v| matches!(v, Vector::Load { .. })).count();
    let moves = code.iter().filter(|v| matches!(v, Vector::Move { .. })).count();
    let stores = code.iter().filter(|v| matches!(v, Vector::Store { .. })).count();
    let direct = |v: &&Vector| {
        matches!(v, Vector::Binary { b: Source::Memory(_), .. } | Vector::Fused { third: Source::Memory(_), .. })
    };
    assert_eq!((loads, moves, stores), (INPUTS / 2, 0, 1));
    assert_eq!(code.iter().filter(direct).count(), INPUTS / 2);
}
