//! The questions on all bundled mechanisms with drives, every one at the configurations of its file.

#![allow(missing_docs)] // of what criterion's macros make

mod common;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use jointplay_core::Case;
use jointplay_core::Keep;
use jointplay_core::questions::random::Request;

const SAMPLES: usize = 1 << 14;
/// Climbs of the exact worst case, as many as a user gets.
const STARTS: usize = 24;

fn questions(c: &mut Criterion) {
    for subject in common::subjects() {
        let m = &subject.mechanism;
        let rows = subject.drives.len() / m.n_drives();
        let trace = m.trace(rows, &subject.drives);
        let cases: Vec<Case<'_>> = subject
            .drives
            .chunks_exact(m.n_drives())
            .zip(trace.coordinates.chunks_exact(m.n_coordinates()))
            .map(|(drives, coordinates)| Case { drives, coordinates })
            .collect();
        let mut group = c.benchmark_group(&subject.name);
        group.throughput(Throughput::Elements(rows as u64));
        group.bench_function("trace", |b| b.iter(|| black_box(m.trace(rows, &subject.drives))));
        group.bench_function("loaded", |b| b.iter(|| black_box(m.loaded(&cases, true, Keep::ALL))));
        group.bench_function("worst", |b| b.iter(|| black_box(m.worst(&cases, STARTS, true))));
        group.throughput(Throughput::Elements(SAMPLES as u64));
        let request = Request { samples: SAMPLES, probabilities: vec![0.5, 0.99], ..Request::default() };
        group.bench_function("random", |b| b.iter(|| black_box(m.random(&cases[..1], &request))));
        group.finish();
    }
}

criterion_group! {
    name = benches;
    config = common::brief();
    targets = questions
}
criterion_main!(benches);
