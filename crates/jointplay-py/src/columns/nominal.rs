//! The columns of the nominal mechanism.

use jointplay_core::Mechanism as Core;
use jointplay_core::closure::State;
use jointplay_core::nominal::{Configuration, Trace};
use pyo3::prelude::*;

use super::flat;
use crate::arrays::Table;

/// Configurations with their nearness to a singular one.
pub fn solved<'py>(core: &Core, table: Table<'py>, found: &[Configuration]) -> PyResult<Table<'py>> {
    let (n, nb, size) = (found.len(), core.n_bodies(), core.size());
    let width = core.n_body_coordinates();
    let of = |pick: &dyn Fn(&State) -> Vec<f64>, width: usize| {
        flat(found.iter().map(|c| c.state.as_ref().map_or_else(|| vec![f64::NAN; width], pick)))
    };
    table
        .array("poses", &[n, nb, width], of(&|s| s.coordinates.clone(), nb * width))?
        .array("output", &[n, size], of(&|s| core.output(&s.coordinates, &s.inputs), size))?
        .array("drives", &[n, core.n_drives()], of(&|s| s.inputs.drives.clone(), core.n_drives()))?
        .array("singular_value", &[n], found.iter().map(|c| c.singular_value).collect())?
        .array("singular_motion", &[n, nb, size], flat(found.iter().map(|c| &c.singular_motion)))?
        .status(found.iter().map(|c| c.status))
}

/// Poses and output alone.
pub fn traced<'py>(core: &Core, table: Table<'py>, found: Trace, output: Vec<f64>) -> PyResult<Table<'py>> {
    let n = found.status.len();
    table
        .status(found.status.into_iter())?
        .array("poses", &[n, core.n_bodies(), core.n_body_coordinates()], found.coordinates)?
        .array("output", &[n, core.size()], output)
}
