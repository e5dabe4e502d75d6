//! The columns of the worst case.

use jointplay_core::Mechanism as Core;
use jointplay_core::questions::worst::Worst;
use pyo3::prelude::*;

use super::flat;
use crate::arrays::Table;

/// The largest errors with the offsets that attain them.
pub fn worst<'py>(core: &Core, table: Table<'py>, found: &[Worst]) -> PyResult<Table<'py>> {
    let (n, size, ne) = (found.len(), core.size(), core.n_extremes());
    let turns = found.first().map_or(0, |r| r.rotation_direction.len());
    table
        .array("position", &[n], found.iter().map(|r| r.position).collect())?
        .array("position_first_order", &[n], found.iter().map(|r| r.position_first_order).collect())?
        .array("position_bound", &[n], found.iter().map(|r| r.position_bound).collect())?
        .array("rotation", &[n], found.iter().map(|r| r.rotation).collect())?
        .array("rotation_first_order", &[n], found.iter().map(|r| r.rotation_first_order).collect())?
        .array("rotation_bound", &[n], found.iter().map(|r| r.rotation_bound).collect())?
        .array("fallbacks", &[n], found.iter().map(|r| r.fallbacks).collect())?
        .array("unsettled", &[n], found.iter().map(|r| r.unsettled).collect())?
        .array("component", &[n, size, 2], flat(found.iter().flat_map(|r| &r.component)))?
        .array("component_first_order", &[n, size, 2], flat(found.iter().flat_map(|r| &r.component_first_order)))?
        .array("direction", &[n, core.n_translations()], flat(found.iter().map(|r| &r.direction)))?
        .array("rotation_direction", &[n, turns], flat(found.iter().map(|r| &r.rotation_direction)))?
        .array("offset", &[n, ne, core.n_parameters()], flat(found.iter().flat_map(|r| &r.offset)))?
        .array("contribution", &[n, ne, core.sources().len()], flat(found.iter().flat_map(|r| &r.contribution)))?
        .array("contribution_elastic", &[n, ne, core.n_joints()], flat(found.iter().flat_map(|r| &r.elastic)))?
        .status(found.iter().map(|r| r.status))
}
