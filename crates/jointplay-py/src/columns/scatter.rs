//! The columns of the scatter from unit to unit.

use jointplay_core::questions::random::{BINS, Request, Scatter, SpecimenScatter};
use jointplay_core::{Mechanism as Core, Status};
use pyo3::prelude::*;

use super::flat;
use crate::arrays::Table;

/// What every mechanism tells.
pub fn scatter<'py>(core: &Core, table: Table<'py>, found: &[&Scatter], request: &Request) -> PyResult<Table<'py>> {
    let (n, size, nq, np) = (found.len(), core.size(), core.n_quantities(), request.probabilities.len());
    let histogram: Vec<u64> = found.iter().flat_map(|r| r.histogram.iter().copied()).collect();
    let failures: Vec<u64> = found.iter().flat_map(|r| r.failures).collect();
    let table = if request.keep { kept(core, table, found)? } else { table };
    table
        .array("mean", &[n, size], flat(found.iter().map(|r| &r.mean)))?
        .array("covariance", &[n, size, size], flat(found.iter().map(|r| &r.covariance)))?
        .array("mean_first_order", &[n, size], flat(found.iter().map(|r| &r.mean_first_order)))?
        .array("covariance_first_order", &[n, size, size], flat(found.iter().map(|r| &r.covariance_first_order)))?
        .array("contribution", &[n, core.sources().len(), size], flat(found.iter().map(|r| &r.contribution)))?
        .array("quantile", &[n, np, nq], flat(found.iter().map(|r| &r.quantile)))?
        .array("quantile_resolution", &[n, nq], flat(found.iter().map(|r| &r.quantile_resolution)))?
        .array("histogram", &[n, nq, BINS], histogram)?
        .array("edges", &[n, nq, BINS + 1], flat(found.iter().map(|r| &r.edges)))?
        .array("outside", &[n], found.iter().map(|r| r.outside).collect())?
        .array("largest", &[n, nq], flat(found.iter().map(|r| &r.largest)))?
        .array("failures", &[n, Status::ALL.len()], failures)?
        .array("fallbacks", &[n], found.iter().map(|r| r.fallbacks).collect())?
        .status(found.iter().map(|r| r.status))
}

/// What over-constrained and elastic mechanisms, and units under load, tell beside.
pub fn specimens<'py>(
    core: &Core,
    table: Table<'py>,
    found: &[SpecimenScatter],
    request: &Request,
) -> PyResult<Table<'py>> {
    let (n, size, np) = (found.len(), core.size(), request.probabilities.len());
    let forces = core.elastic_rows().count();
    let table = table
        .array("clearance_factor", &[n, np], flat(found.iter().map(|r| &r.clearance_factor)))?
        .array("force", &[n, np, forces], flat(found.iter().map(|r| &r.force)))?
        .array("contribution_elastic", &[n, core.n_joints(), size], flat(found.iter().map(|r| &r.elastic)))?;
    scatter(core, table, &found.iter().map(|r| &r.scatter).collect::<Vec<_>>(), request)
}

/// The samples themselves; a configuration that is not assembled has none.
fn kept<'py>(core: &Core, table: Table<'py>, found: &[&Scatter]) -> PyResult<Table<'py>> {
    let kept = || found.iter().filter_map(|r| r.kept.as_ref());
    let statuses: Vec<u8> = kept().flat_map(|k| k.statuses.iter().map(|s| s.code())).collect();
    let count = statuses.len();
    table
        .array("kept_parameters", &[count, core.n_parameters()], flat(kept().map(|k| &k.parameters)))?
        .array("kept_errors", &[count, core.size()], flat(kept().map(|k| &k.errors)))?
        .array("kept_status", &[count], statuses)
}
