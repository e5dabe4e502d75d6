//! The columns of the answers to all questions.
//!
//! A new one is declared here and filled where the question is answered; arrays follow, in Python, too.

use crate::mechanism::columns::{Row, columns};
use crate::mechanism::dim::{Declared, Dim, Wanted};
use crate::mechanism::status::Status;

columns! {
    /// The pose for given parameter values.
    Given in GivenTable by GivenRows from FreshGiven:
    /// Error on the exact closure.
    error: f64 [Component];
    /// Its linearisation at the nominal pose.
    error_first_order: f64 [Component];
    /// Coordinates of all bodies.
    poses: f64 [Body, Coordinate];
    /// The largest residual of the closure at this pose, in characteristic lengths and radians.
    residual: f64 [];
    /// Outcome.
    status: Status [];
}

columns! {
    /// What given parameter values strain, where more than statics shares the load.
    Forced in ForcedTable by ForcedRows from FreshForced:
    /// Reactions to the deformations.
    prestress: f64 [Joint, Wrench];
    /// Deformation of every elastic component.
    deformation: f64 [Elastic];
    /// The largest misfit of a redundant row where the basis is closed for the offsets.
    lack_of_fit: f64 [];
}

columns! {
    /// First-order maps; NaN where the nominal state is singular or missing.
    Sensitivity in SensitivityTable by SensitivityRows from FreshSensitivity:
    /// Error of the output per parameter.
    source: f64 [Component, Parameter];
    /// Error of the output per drive value.
    drive: f64 [Component, Drive];
    /// Outcome.
    status: Status [];
}

columns! {
    /// Derivatives of the output's pose where the loads are balanced with every clearance held; NaN where that pose is
    /// singular or missing. A turn is told by its rotation vector from there.
    Jacobians in JacobiansTable by JacobiansRows from FreshJacobians:
    /// Displacement of the output there, by what the loads deform.
    error: f64 [Component];
    /// Per parameter.
    parameter: f64 [Component, Parameter];
    /// Per drive value.
    drive: f64 [Component, Drive];
    /// Per force and moment of every load, in its axes.
    load: f64 [Component, Load, Wrench];
    /// Per force and moment at the output.
    compliance: f64 [Component, Wrench];
    /// Whether something can give way to the parameter, so that its derivative exists.
    defined: bool [Parameter];
    /// Outcome.
    status: Status [];
}

columns! {
    /// The load-determined error.
    Loaded in LoadedTable by LoadedRows from FreshLoaded:
    /// Error on the exact closure.
    error: f64 [Component];
    /// Its linearisation at the nominal pose.
    error_first_order: f64 [Component] if details;
    /// Half-width of what the load does not decide.
    undetermined: f64 [Component];
    /// Share of every source in it.
    undetermined_contribution: f64 [Source, Component] if details;
    /// Whether the load decides where every source is; no load moves what is no clearance.
    decided: bool [Source] if details;
    /// Force and moment on the second body of every joint at its joint point, ground axes.
    reaction: f64 [Joint, Wrench] if details;
    /// Moment or force of every drive on the second bodies of its joints, along its coordinate.
    drive_force: f64 [Drive] if details;
    /// The values of all parameters.
    offset: f64 [Parameter] if offset;
    /// Share of every source in the first-order error.
    contribution: f64 [Source, Component] if details;
    /// Steps until contact and reactions agreed.
    iterations: u64 [];
    /// Places that have been found where the load may hold the mechanism, of which the one with the most work is given.
    equilibria: u64 [];
    /// Outcome.
    status: Status [];
}

columns! {
    /// What the load strains, where more than statics shares it.
    Strain in StrainTable by StrainRows from FreshStrain:
    /// The smallest factor on the clearances with which the rigid mechanism can be assembled.
    clearance_factor: f64 [];
    /// Reactions without any load.
    prestress: f64 [Joint, Wrench];
    /// Force or moment on the displacement of every row, in the joint's axes: what pulls its second body along.
    force: f64 [Row];
    /// Deformation of every elastic component.
    deformation: f64 [Elastic];
    /// Part of every joint's compliance in the first-order error.
    contribution_elastic: f64 [Joint, Component];
    /// Relative duality gap of the last program.
    gap: f64 [];
    /// The largest misfit of a redundant row at the nominal pose; angles at the characteristic length.
    lack_of_fit: f64 [];
}

columns! {
    /// A specimen under load; here a row is a specimen.
    Specimen in SpecimenTable by SpecimenRows from FreshSpecimen:
    /// The smallest factor on the clearances with which the rigid specimen can be assembled.
    clearance_factor: f64 [];
    /// Coordinates of all bodies.
    poses: f64 [Body, Coordinate];
    /// Force on every row.
    force: f64 [Row];
    /// Force and moment on the second body of every joint at its joint point, ground axes.
    reaction: f64 [Joint, Wrench];
    /// The values of all parameters.
    offset: f64 [Parameter];
    /// Outcome.
    status: Status [];
}

columns! {
    /// The largest errors.
    Worst in WorstTable by WorstRows from FreshWorst:
    /// Largest distance of the output point from nominal.
    position: f64 [];
    /// To first order.
    position_first_order: f64 [];
    /// What the first-order figure certainly does not exceed.
    position_bound: f64 [];
    /// Largest rotation from nominal, absolute.
    rotation: f64 [];
    /// To first order.
    rotation_first_order: f64 [];
    /// What the first-order figure certainly does not exceed.
    rotation_bound: f64 [];
    /// Lowest and highest error of every component.
    component: f64 [Component, Side];
    /// To first order.
    component_first_order: f64 [Component, Side];
    /// Direction of the largest position error.
    direction: f64 [Axis];
    /// Axis of the largest rotation.
    rotation_direction: f64 [Turn];
    /// The parameter values that attain each extreme.
    offset: f64 [Extreme, Parameter];
    /// Share of every source in the first-order figure of each extreme.
    contribution: f64 [Extreme, Source];
    /// Share of every joint's deformation in it.
    contribution_elastic: f64 [Extreme, Joint];
    /// Starts that the batch engine handed to the plain solver.
    fallbacks: u64 [];
    /// Extremes whose climb was ended by its budget of work before it had converged.
    unsettled: u64 [];
    /// Outcome.
    status: Status [];
}

columns! {
    /// What the largest errors certainly do not exceed.
    Certificate in CertificateTable by CertificateRows from FreshCertificate:
    /// Largest distance of the output point from nominal.
    position: f64 [];
    /// Largest rotation from nominal, absolute.
    rotation: f64 [];
    /// Lowest and highest error of every component.
    component: f64 [Component, Side];
    /// Whether the mechanism has exactly one pose near its own for everything that the sets allow.
    assembled: bool [];
    /// Parts of the sets that were looked at.
    parts: u64 [];
    /// Why there is no bound; zero where there is.
    reason: u64 [];
}

columns! {
    /// The region of the output point's error.
    Region in RegionTable by RegionRows from FreshRegion:
    /// How far the point can be displaced along the direction.
    extent: f64 [Direction];
    /// To first order.
    extent_first_order: f64 [Direction];
    /// The error where it is farthest along the direction.
    error: f64 [Direction, Component];
    /// Extremes whose climb was ended by its budget of work before it had converged.
    unsettled: u64 [];
    /// Outcome.
    status: Status [];
}

columns! {
    /// Scatter from specimen to specimen.
    Scatter in ScatterTable by ScatterRows from FreshScatter:
    /// Mean of every component.
    mean: f64 [Component];
    /// Its standard error.
    mean_standard_error: f64 [Component];
    /// Standard error of the standard deviation.
    std_standard_error: f64 [Component];
    /// Covariance of the components.
    covariance: f64 [Component, ComponentOther];
    /// Mean to first order.
    mean_first_order: f64 [Component];
    /// Covariance to first order.
    covariance_first_order: f64 [Component, ComponentOther];
    /// First-order variance of every component by source.
    contribution: f64 [Source, Component];
    /// Quantiles of every quantity.
    quantile: f64 [Probability, Quantity];
    /// Their standard errors.
    quantile_standard_error: f64 [Probability, Quantity];
    /// The width within which every quantity's quantiles are known.
    quantile_resolution: f64 [Quantity];
    /// Histogram of every quantity.
    histogram: u64 [Quantity, Bin];
    /// Edges of its bins.
    edges: f64 [Quantity, BinEdge];
    /// Share of the samples beyond an acceptance limit, or without a pose; NaN without limits.
    outside: f64 [];
    /// Its standard error.
    outside_standard_error: f64 [];
    /// Share of the samples beyond the limits of each quantity, or without a pose; NaN where it has none.
    outside_quantity: f64 [Quantity];
    /// Their standard errors.
    outside_quantity_standard_error: f64 [Quantity];
    /// Largest size of every quantity met.
    largest: f64 [Quantity];
    /// Number of samples by status.
    failures: u64 [Outcome];
    /// Samples that the batch engine handed to the plain solver.
    fallbacks: u64 [];
    /// Share of the samples whose sizes leave an interference instead of a gap, by the clearance.
    interference: f64 [Source];
    /// Outcome of the nominal configuration.
    status: Status [];
}

columns! {
    /// What strains specimens of over-constrained and elastic mechanisms, and those under load.
    StrainScatter in StrainScatterTable by StrainScatterRows from FreshStrainScatter:
    /// Quantiles of the smallest factor on the clearances with which a specimen can be assembled rigidly.
    clearance_factor: f64 [Probability];
    /// Quantiles of the force on every row of the elastic joints.
    force: f64 [Probability, ElasticRow];
    /// Part of every joint's compliance in the first-order variance.
    contribution_elastic: f64 [Joint, Component];
}

columns! {
    /// A random sample, kept only when asked for; here a row is a sample.
    #[allow(clippy::struct_field_names)] // they stand beside those of [`Scatter`]
    Sample in SampleTable by SampleRows from FreshSample:
    /// Parameter values.
    kept_parameters: f64 [Parameter];
    /// Error.
    kept_errors: f64 [Component];
    /// Outcome.
    kept_status: Status [];
}

/// The columns that a question can have.
#[must_use]
pub fn declared() -> [(&'static str, Vec<Declared>); 9] {
    [
        ("given", [Given::DECLARED, Forced::DECLARED].concat()),
        ("sensitivity", Sensitivity::DECLARED.to_vec()),
        ("jacobians", Jacobians::DECLARED.to_vec()),
        ("loaded", [Loaded::DECLARED, Strain::DECLARED].concat()),
        ("loaded_specimens", Specimen::DECLARED.to_vec()),
        ("worst", Worst::DECLARED.to_vec()),
        ("certificate", Certificate::DECLARED.to_vec()),
        ("region", Region::DECLARED.to_vec()),
        ("random", [Scatter::DECLARED, StrainScatter::DECLARED, Sample::DECLARED].concat()),
    ]
}
