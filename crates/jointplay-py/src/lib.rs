//! Python's view of the core: whole arrays in, dictionaries of whole arrays out. SI units, radians.

// PyO3 hands array arguments over by value.
#![allow(clippy::needless_pass_by_value)]

mod arrays;
mod cones;
mod mechanism;
mod work;

use std::collections::BTreeMap;

use jointplay_core::{Declared, Kept, Status, nominal, questions};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Results and rooms are large and come and go with every call: memory is kept, not given back page by page.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// What limits the width of the vector registers from the start, for tests: a name as of [`simd`].
const WIDTH: &str = "JOINTPLAY_WIDTH";

/// The width of the vector registers in use: `plain`, `avx2` or `avx512`. With a name, at most that
/// width is used from now on; results do not depend on it.
#[pyfunction]
#[pyo3(signature = (limit = None))]
fn simd(limit: Option<&str>) -> PyResult<&'static str> {
    use jointplay_core::math::lanes::{Width, limit as limit_width, width};
    match limit {
        None => {}
        Some("plain") => limit_width(Width::Plain),
        Some("avx2") => limit_width(Width::Avx2),
        Some("avx512") => limit_width(Width::Avx512),
        Some(other) => {
            let message = format!("unknown width '{other}': plain, avx2 or avx512 (argument or {WIDTH})");
            return Err(PyValueError::new_err(message));
        }
    }
    Ok(match width() {
        Width::Plain => "plain",
        Width::Avx2 => "avx2",
        Width::Avx512 => "avx512",
    })
}

/// Programs recorded by this process, recordings that it keeps for mechanisms of the same structure, and bytes that
/// these take.
#[pyfunction]
fn recordings() -> (u64, usize, usize) {
    let kept = Kept::now();
    (kept.recorded, kept.traces, kept.bytes)
}

/// The columns that every question can have: their element, and their dimensions beside the configuration.
fn columns() -> BTreeMap<&'static str, BTreeMap<&'static str, (&'static str, Vec<&'static str>)>> {
    let all = nominal::columns::declared().into_iter().chain(questions::columns::declared());
    let told = |column: Declared| (column.name, (column.element, column.dims.iter().map(|dim| dim.name()).collect()));
    all.map(|(question, columns)| (question, columns.into_iter().map(told).collect())).collect()
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    if let Ok(name) = std::env::var(WIDTH) {
        simd(Some(&name))?;
    }
    module.add("STATUSES", Status::ALL.map(Status::name).to_vec())?;
    module.add("COLUMNS", columns())?;
    module.add_function(wrap_pyfunction!(simd, module)?)?;
    module.add_function(wrap_pyfunction!(recordings, module)?)?;
    module.add_function(wrap_pyfunction!(work::share_threads, module)?)?;
    module.add_function(wrap_pyfunction!(cones::cone_programs, module)?)?;
    module.add_class::<mechanism::Mechanism>()
}
