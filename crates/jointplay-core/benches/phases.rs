//! Where the time of a Monte Carlo goes: drawing, and drawing and solving. What is left of `random` is counting.

#![allow(missing_docs)] // of what criterion's macros make

mod common;

use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::Duration;

use cpu_time::ProcessTime;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use jointplay_core::Mechanism;
use jointplay_core::clearance::draw::{Draw as _, Stream};
use jointplay_core::closure::{Bound, Newton, Solver};
use jointplay_core::math::lanes::{Block, Kernel, LANES, dispatch};

const SAMPLES: usize = 1 << 13;

/// Draws samples and, with programs, solves them.
struct Draw<'d, 'n> {
    mechanism: &'d Mechanism,
    stream: &'d mut Stream,
    bound: Option<&'d mut Bound<'n>>,
    parameters: &'d mut [Block],
}

impl Kernel for Draw<'_, '_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let mut sum = 0.0;
        let Self { mechanism, stream, mut bound, parameters } = self;
        for _ in 0..SAMPLES / LANES {
            for source in mechanism.sources() {
                stream.draw(&source.set, source.law, &mut parameters[source.range()]);
            }
            if let Some(bound) = &mut bound {
                bound.parameters().copy_from_slice(parameters);
                let solved = bound.solve();
                sum += bound.error(0).0[0] * f64::from(u8::from(solved.has(0)));
            } else {
                sum += parameters[0].0[0];
            }
        }
        sum
    }
}

/// Processor time, which other work on the machine hardly changes.
fn timed(times: u64, mut run: impl FnMut() -> f64) -> Duration {
    let begin = ProcessTime::now();
    for _ in 0..times {
        black_box(run());
    }
    begin.elapsed()
}

fn phases(c: &mut Criterion) {
    let mut group = c.benchmark_group("phases");
    let mut operations = BTreeMap::new();
    group.throughput(Throughput::Elements(SAMPLES as u64));
    for subject in common::subjects().iter().filter(|s| s.name.starts_with('W')) {
        let m = &subject.mechanism;
        let drives = &subject.drives[..m.n_drives()];
        let trace = m.trace(1, drives);
        let solver = Solver::new(m, &trace.coordinates);
        let nominal = m.restore(&solver, &trace.coordinates, drives).expect("an assembled mechanism");
        let newton = Newton::record(&solver).expect("a mechanism with a plan");
        operations.insert(subject.name.clone(), newton.n_operations());
        let mut bound = newton.bind(m, &nominal, drives);
        let mut parameters = vec![Block::splat(0.0); m.n_parameters()];
        let mut stream = Stream::new(1, 0);
        group.bench_function(format!("{} draw", subject.name), |b| {
            b.iter_custom(|times| {
                timed(times, || {
                    let bound = None;
                    dispatch(Draw { mechanism: m, stream: &mut stream, bound, parameters: &mut parameters })
                })
            });
        });
        group.bench_function(format!("{} draw and solve", subject.name), |b| {
            b.iter_custom(|times| {
                timed(times, || {
                    let bound = Some(&mut bound);
                    dispatch(Draw { mechanism: m, stream: &mut stream, bound, parameters: &mut parameters })
                })
            });
        });
    }
    group.finish();
    let text = serde_json::to_string(&operations).expect("numbers by name");
    std::fs::write(common::path("operations.json"), text).expect("the directory of specs.json");
}

criterion_group! {
    name = benches;
    config = common::brief();
    targets = phases
}
criterion_main!(benches);
