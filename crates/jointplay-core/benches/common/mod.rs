//! Mechanisms to measure: the core reads no files of its own, so that `make bench-core` compiles them first.

use std::path::PathBuf;
use std::time::Duration;

use criterion::Criterion;
use jointplay_core::{Mechanism, Spec};
use serde::Deserialize;

/// A mechanism and its drive values, row by row.
#[derive(Deserialize)]
struct File {
    name: String,
    spec: Spec,
    drives: Vec<Vec<f64>>,
}

/// A mechanism at the configurations of its file.
pub struct Subject {
    /// Name of the file.
    pub name: String,
    /// The mechanism.
    pub mechanism: Mechanism,
    /// Drive values of its configurations, one after the other.
    pub drives: Vec<f64>,
}

/// A file that the benchmarks exchange with `benchmarks/`.
pub fn path(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "../../build/benchmarks", name].iter().collect()
}

/// All determinate mechanisms that `benchmarks/specs.py` wrote; the questions measured are theirs.
pub fn subjects() -> Vec<Subject> {
    let text = std::fs::read_to_string(path("specs.json")).expect("no mechanisms to measure: run `make bench-core`");
    let files: Vec<File> = serde_json::from_str(&text).expect("specs.json is not what benchmarks/specs.py writes");
    let made = files.into_iter().map(|file| Subject {
        mechanism: Mechanism::new(&file.spec).expect("a checked mechanism"),
        drives: file.drives.concat(),
        name: file.name,
    });
    made.filter(|s| s.mechanism.n_rows() == s.mechanism.n_unknowns()).collect()
}

/// Measurements short enough for all mechanisms in a few minutes.
pub fn brief() -> Criterion {
    Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
}
