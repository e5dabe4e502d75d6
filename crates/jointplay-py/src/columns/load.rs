//! The columns of configurations under load, as arrays.

use jointplay_core::Mechanism as Core;
use jointplay_core::questions::loaded::{Columns, StrainTable, Table as LoadTable};
use jointplay_core::questions::random::SpecimenTable;
use pyo3::prelude::*;

use crate::arrays::Table;

/// What every mechanism tells of configurations under load.
pub fn pushed<'py>(core: &Core, table: Table<'py>, found: LoadTable, keep: Columns) -> PyResult<Table<'py>> {
    let (n, size, sources) = (found.status.len(), core.size(), core.sources().len());
    let mut table = table
        .status(found.status.iter().copied())?
        .array("error", &[n, size], found.error)?
        .array("undetermined", &[n, size], found.undetermined)?
        .array("iterations", &[n], found.steps)?
        .value("fallbacks", found.fallbacks)?;
    if keep.offset {
        table = table.array("offset", &[n, core.n_parameters()], found.offset)?;
    }
    if keep.details {
        table = table
            .array("error_first_order", &[n, size], found.error_first_order)?
            .array("undetermined_contribution", &[n, sources, size], found.open)?
            .array("decided", &[n, sources], found.decided)?
            .array("reaction", &[n, core.n_joints(), size], found.reaction)?
            .array("contribution", &[n, sources, size], found.contribution)?;
    }
    Ok(table)
}

/// What over-constrained and elastic mechanisms tell beside.
pub fn strained<'py>(core: &Core, table: Table<'py>, found: StrainTable, keep: Columns) -> PyResult<Table<'py>> {
    let (n, size) = (found.gap.len(), core.size());
    let table = table
        .array("clearance_factor", &[n], found.clearance_factor)?
        .array("prestress", &[n, core.n_joints(), size], found.prestress)?
        .array("force", &[n, core.n_rows()], found.force)?
        .array("deformation", &[n, core.deformations().count()], found.deformation)?
        .array("contribution_elastic", &[n, core.n_joints(), size], found.elastic)?
        .array("gap", &[n], found.gap)?
        .array("lack_of_fit", &[n], found.lack_of_fit)?;
    pushed(core, table, found.loaded, keep)
}

/// Units with parameters of their own.
pub fn specimens<'py>(core: &Core, table: Table<'py>, found: SpecimenTable) -> PyResult<Table<'py>> {
    let n = found.status.len();
    table
        .array("clearance_factor", &[n], found.clearance_factor)?
        .array("poses", &[n, core.n_bodies(), core.n_body_coordinates()], found.coordinates)?
        .array("force", &[n, core.n_rows()], found.force)?
        .array("reaction", &[n, core.n_joints(), core.size()], found.reaction)?
        .array("offset", &[n, core.n_parameters()], found.offset)?
        .status(found.status.into_iter())
}
