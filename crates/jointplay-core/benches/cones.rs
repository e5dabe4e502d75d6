//! Cone programs eight at a time and one at a time: pins of trusses, and random mechanisms that are over-constrained
//! many times.

#![allow(missing_docs)] // of what criterion's macros make

use std::hint::black_box;
use std::time::Duration;

use cpu_time::ProcessTime;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use jointplay_core::clearance::Set;
use jointplay_core::cone::lanes::Programs;
use jointplay_core::cone::{Block, Kind, Program, Question};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const PROGRAMS: usize = 1024;
const ALONE: usize = 8;
const PINS: usize = 20;

/// Programs of pins and bars, all near one of them, as the configurations of a mechanism are.
fn programs(equations: usize, bars: usize) -> Vec<Program> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(equations as u64);
    let mut numbers =
        |n: usize, size: f64| -> Vec<f64> { (0..n).map(|_| size * rng.random_range(-1.0..1.0)).collect() };
    let sizes = [vec![2; PINS], vec![1; bars]].concat();
    let maps: Vec<Vec<f64>> = sizes.iter().map(|size| numbers(equations * size, 1.0)).collect();
    let forces: Vec<Vec<f64>> = sizes.iter().map(|size| numbers(*size, 100.0)).collect();
    let near = |of: &[f64], by: Vec<f64>| of.iter().zip(by).map(|(a, b)| a + b).collect();
    let program = |_| {
        let mut program = Program { right: numbers(equations, 1e-5), blocks: Vec::new() };
        for (k, size) in sizes.iter().enumerate() {
            let kind = if k < PINS { Kind::Clearance(Set::Disc { radius: 5e-5 }) } else { Kind::Spring(vec![1e-8]) };
            let map = near(&maps[k], numbers(equations * size, 0.2));
            program.blocks.push(Block { kind, map, force: near(&forces[k], numbers(*size, 20.0)) });
        }
        program
    };
    (0..PROGRAMS).map(program).collect()
}

/// Processor time, which other work on the machine hardly changes.
fn timed<T>(times: u64, mut run: impl FnMut() -> T) -> Duration {
    let begin = ProcessTime::now();
    for _ in 0..times {
        black_box(run());
    }
    begin.elapsed()
}

fn cones(c: &mut Criterion) {
    for (name, equations, bars) in [("truss", 3, 9), ("6", 6, 0), ("12", 12, 0), ("30", 30, 0)] {
        let programs = programs(equations, bars);
        let all = Programs::of(&programs);
        let mut group = c.benchmark_group(format!("cones {name}"));
        for question in [Question::Pose, Question::Assembly] {
            let answers = all.solve(question);
            println!("{question:?}: {} of {PROGRAMS} alone, difference {:.1e}", answers.alone, answers.difference);
            group.throughput(Throughput::Elements(PROGRAMS as u64));
            group.bench_function(format!("{question:?} lanes"), |b| {
                b.iter_custom(|times| timed(times, || all.solve(question)));
            });
            group.throughput(Throughput::Elements(ALONE as u64));
            group.bench_function(format!("{question:?} alone"), |b| {
                b.iter_custom(|times| timed(times, || (0..ALONE).map(|k| all.alone(question, k).value).sum::<f64>()));
            });
        }
        group.finish();
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(500));
    targets = cones
}
criterion_main!(benches);
