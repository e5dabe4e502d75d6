//! The columns of given deviations and of the first-order maps.

use jointplay_core::Mechanism as Core;
use jointplay_core::questions::given::{Forced, Given, Sensitivity};
use nalgebra::DMatrix;
use pyo3::prelude::*;

use super::flat;
use crate::arrays::Table;

/// What every mechanism tells for given deviations.
pub fn given<'py>(core: &Core, table: Table<'py>, found: &[&Given]) -> PyResult<Table<'py>> {
    let (n, size) = (found.len(), core.size());
    let coordinates = flat(found.iter().map(|r| &r.coordinates));
    table
        .array("error", &[n, size], flat(found.iter().map(|r| &r.error)))?
        .array("error_first_order", &[n, size], flat(found.iter().map(|r| &r.error_first_order)))?
        .array("poses", &[n, core.n_bodies(), core.n_body_coordinates()], coordinates)?
        .status(found.iter().map(|r| r.status))
}

/// What over-constrained and elastic mechanisms tell beside.
pub fn forced<'py>(core: &Core, table: Table<'py>, found: &[Forced]) -> PyResult<Table<'py>> {
    let (n, size) = (found.len(), core.size());
    let table = table
        .array("prestress", &[n, core.n_joints(), size], flat(found.iter().map(|r| &r.prestress)))?
        .array("deformation", &[n, core.deformations().count()], flat(found.iter().map(|r| &r.deformation)))?
        .array("lack_of_fit", &[n], found.iter().map(|r| r.lack_of_fit).collect())?;
    given(core, table, &found.iter().map(|r| &r.given).collect::<Vec<_>>())
}

/// The first-order maps.
pub fn sensitivity<'py>(core: &Core, table: Table<'py>, found: &[Sensitivity]) -> PyResult<Table<'py>> {
    let (n, size) = (found.len(), core.size());
    // nalgebra stores columns, numpy rows.
    let by_rows = |m: &DMatrix<f64>| m.transpose().as_slice().to_vec();
    let sources = flat(found.iter().map(|r| by_rows(&r.output.parameters)));
    let drives = flat(found.iter().map(|r| by_rows(&r.output.drives)));
    table
        .array("source", &[n, size, core.n_parameters()], sources)?
        .array("drive", &[n, size, core.n_drives()], drives)?
        .status(found.iter().map(|r| r.status))
}
