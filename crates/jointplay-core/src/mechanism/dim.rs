//! Dimensions of the columns of answers, and which columns are wanted.

use crate::mechanism::Mechanism;
use crate::mechanism::status::Status;

/// Bins of the histograms that are handed out.
pub const BINS: usize = 128;

/// A dimension of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // their names say what they count
pub enum Dim {
    Component,
    ComponentOther,
    Wrench,
    /// The components, the size of the position error, the size of the rotation.
    Quantity,
    /// The largest position error, the largest rotation, both ends of every component.
    Extreme,
    Side,
    /// Components of a position.
    Axis,
    /// Components of a rotation about any axis; none in the plane.
    Turn,
    Parameter,
    Drive,
    Load,
    Source,
    Joint,
    Body,
    /// Of one body.
    Coordinate,
    Row,
    /// Rows of the elastic joints.
    ElasticRow,
    /// Components that give way elastically.
    Elastic,
    /// Of the constraints, of the drives, of the output.
    Singularity,
    Probability,
    /// Directions that were asked for.
    Direction,
    Bin,
    BinEdge,
    Outcome,
}

impl Dim {
    /// The name that results carry.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Component => "component",
            Self::ComponentOther => "component_other",
            Self::Wrench => "wrench",
            Self::Quantity => "quantity",
            Self::Extreme => "extreme",
            Self::Side => "side",
            Self::Axis => "axis",
            Self::Turn => "turn",
            Self::Parameter => "parameter",
            Self::Drive => "drive",
            Self::Load => "load",
            Self::Source => "source",
            Self::Joint => "joint",
            Self::Body => "body",
            Self::Coordinate => "coordinate",
            Self::Row => "row",
            Self::ElasticRow => "elastic_row",
            Self::Elastic => "elastic",
            Self::Singularity => "singularity",
            Self::Probability => "probability",
            Self::Direction => "direction",
            Self::Bin => "bin",
            Self::BinEdge => "bin_edge",
            Self::Outcome => "outcome",
        }
    }

    /// Its size.
    pub(crate) fn size(self, of: &Wanted<'_>) -> usize {
        let m = of.mechanism;
        match self {
            Self::Component | Self::ComponentOther | Self::Wrench => m.size(),
            Self::Quantity => m.size() + 2,
            Self::Extreme => 2 + 2 * m.size(),
            Self::Side => 2,
            Self::Axis => m.n_translations(),
            Self::Turn if m.turns_freely() => m.size() - m.n_translations(),
            Self::Turn => 0,
            Self::Parameter => m.n_parameters(),
            Self::Drive => m.n_drives(),
            Self::Load => m.loads.len(),
            Self::Source => m.sources().len(),
            Self::Joint => m.n_joints(),
            Self::Body => m.n_bodies(),
            Self::Coordinate => m.n_body_coordinates(),
            Self::Row => m.n_rows(),
            Self::ElasticRow => m.elastic_rows().count(),
            Self::Elastic => m.deformations().count(),
            Self::Singularity => 3,
            Self::Probability => of.probabilities,
            Self::Direction => of.directions,
            Self::Bin => BINS,
            Self::BinEdge => BINS + 1,
            Self::Outcome => Status::ALL.len(),
        }
    }

    /// The number of values in a row of these dimensions.
    pub(crate) fn width(dims: &[Self], of: &Wanted<'_>) -> usize {
        dims.iter().map(|dim| dim.size(of)).product()
    }
}

/// A column as it is declared.
#[derive(Clone, Copy, Debug)]
pub struct Declared {
    /// Its name.
    pub name: &'static str,
    /// What it is made of.
    pub element: &'static str,
    /// Its dimensions beside the configuration.
    pub dims: &'static [Dim],
}

/// Which columns are wanted beside those that are always given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Keep {
    /// The values of all parameters.
    pub offset: bool,
    /// All columns that are declared `if details`.
    pub details: bool,
}

impl Keep {
    /// All columns.
    pub const ALL: Self = Self { offset: true, details: true };
}

/// What a table is made for.
#[derive(Clone, Copy)]
pub(crate) struct Wanted<'m> {
    pub mechanism: &'m Mechanism,
    pub keep: Keep,
    /// Quantiles asked for.
    pub probabilities: usize,
    /// Directions asked for.
    pub directions: usize,
}

impl<'m> Wanted<'m> {
    /// All columns, no quantiles.
    pub const fn all(mechanism: &'m Mechanism) -> Self {
        Self { mechanism, keep: Keep::ALL, probabilities: 0, directions: 0 }
    }
}
