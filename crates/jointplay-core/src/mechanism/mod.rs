//! A mechanism: bodies, points, joints as locked components, sources of error. Checked once, then
//! immutable.

pub(crate) mod answer;
mod build;
pub(crate) mod case;
pub(crate) mod columns;
mod copula;
pub(crate) mod coupling;
pub(crate) mod dim;
mod drawing;
pub(crate) mod follower;
pub(crate) mod frames;
pub(crate) mod gap;
pub(crate) mod joint;
mod kind;
pub(crate) mod point;
mod scattered_gap;
pub(crate) mod scores;
mod spec;
pub(crate) mod status;
#[cfg(test)]
pub(crate) mod testing;

pub use answer::{Answer, Column, Values};
pub use build::SpecError;
pub use case::Case;
pub use dim::{Declared, Dim, Keep};
pub use spec::Spec;
pub(crate) use spec::{SpringSpec, TorsionSpec};
pub use status::Status;

use std::sync::Arc;

use crate::clearance::Set;
use crate::clearance::law::Law;
use crate::clearance::quantile::Quantile;
use crate::math::real::Real;
use crate::math::space::{Component, Space};
use crate::math::vector::norm;
use crate::mechanism::coupling::Play;
use crate::mechanism::frames::Frames;
use crate::mechanism::gap::Gap;
use crate::mechanism::joint::Joint;
use crate::mechanism::point::Point;
use crate::mechanism::scores::Scores;
use crate::mechanism::spec::LoadSpec;
use crate::program::memo::Memo;

/// Other places of a load are looked for in mechanisms with so many clearances at most.
const SEARCHED: usize = 64;

/// A body by its index among the moving bodies; `None` is the ground.
pub type Body = Option<usize>;

/// A drive as a row takes it.
#[derive(Clone, Copy, Debug)]
pub struct Driven {
    /// The drive.
    pub drive: usize,
    /// What its value counts.
    pub coefficient: f64,
    /// Its place among the commands of all driven rows.
    pub command: usize,
}

/// One scalar closure equation: a component of a joint's relative displacement, or the residual of its coupling,
/// equals the sum of a drive's value and a parameter.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The joint it belongs to.
    pub joint: usize,
    /// The component, in the joint's axes.
    pub component: Component,
    /// Whether it is the coupling of the joint, given as a displacement along this component.
    pub is_coupled: bool,
    /// The drive that commands it.
    pub drive: Option<Driven>,
    /// The parameter that displaces it.
    pub parameter: Option<usize>,
    /// A parameter that displaces it beside, with what it counts; it may displace other rows, too.
    pub shift: Option<(usize, f64)>,
    /// The play of a coupling whose flanks move apart.
    pub play: Option<Play>,
}

impl Row {
    /// A row that nothing displaces.
    pub(crate) const fn of(joint: usize, component: Component) -> Self {
        Self { joint, component, is_coupled: false, drive: None, parameter: None, shift: None, play: None }
    }

    /// What its own parameter displaces it by.
    pub(crate) fn displaced<S: Real>(&self, parameters: &[S]) -> S {
        self.parameter.map_or(S::from_f64(0.0), |p| parameters[p])
    }

    /// A displacement and what shifts the row beside.
    pub(crate) fn shifted<S: Real>(&self, displacement: S, parameters: &[S]) -> S {
        let by = |(p, coefficient): (usize, f64)| displacement + S::from_f64(coefficient) * parameters[p];
        self.shift.map_or(displacement, by)
    }
}

/// One thing that can be off, and the run of parameters that it owns.
#[derive(Clone, Debug)]
pub struct Source {
    /// Where its offset can be, relative to the centre.
    pub set: Set,
    /// How it scatters.
    pub law: Law,
    /// Of one number that does not scatter by that law alone: its quantile function.
    pub quantile: Option<Arc<Quantile>>,
    /// Of a clearance: what its gap depends on where sizes scatter; the set has the gap of their middles.
    pub gap: Option<Gap>,
    /// Its first parameter; it owns `set.size()` of them.
    pub first: usize,
    /// Whether the load decides where it goes (clearances) or not (tolerances, drive errors).
    pub is_clearance: bool,
    /// How far a unit of its first component moves things, in metres: one of a length, the characteristic length of an
    /// angle.
    pub lever: f64,
    /// The kind of parameter, by name, one per component.
    pub components: Vec<&'static str>,
}

impl Source {
    /// Its run of parameters.
    #[must_use]
    pub fn range(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.set.size()
    }
}

/// A joint that gives way elastically in what it locks, or a drive in what it commands.
#[derive(Clone, Debug)]
pub struct Elastic {
    /// The joint; of a drive that moves several the first.
    pub joint: usize,
    /// Its rows.
    pub rows: std::ops::Range<usize>,
    /// Displacement of these per force and moment on them, row-major.
    pub compliance: Vec<f64>,
}

impl Elastic {
    /// The rows that are not rigid.
    pub(crate) fn yielding(&self) -> impl Iterator<Item = usize> + '_ {
        let size = self.rows.len();
        (0..size).filter(move |k| self.compliance[k * (size + 1)] > 0.0).map(|k| self.rows.start + k)
    }
}

/// A mechanism of any graph.
#[derive(Clone, Debug)]
pub struct Mechanism {
    pub(crate) space: Space,
    /// Where the origins of its bodies and of the ground are in the drawing.
    pub(crate) frames: Frames,
    pub(crate) guess: Vec<Vec<f64>>,
    pub(crate) length: f64,
    pub(crate) singular_value: f64,
    pub(crate) points: Vec<Point>,
    pub(crate) joints: Vec<Joint>,
    pub(crate) rows: Vec<Row>,
    /// Rows of the whole mechanism that a basis leaves out. They do not hold it, but their flanks must not pass through
    /// each other either.
    pub(crate) left_out: Vec<Row>,
    pub(crate) n_drives: usize,
    /// The row of each drive, the first where it commands several.
    pub(crate) driven_rows: Vec<usize>,
    /// Bodies of a row: those of its joint, and of the joint that one follows.
    pub(crate) n_sides: usize,
    /// Number of rows that drives command, the last ones.
    pub(crate) n_driven: usize,
    /// The rows that drives command, in the order of their commands; those of a basis are those of the whole mechanism,
    /// also where it leaves one out that others decide.
    pub(crate) commanded: Vec<Row>,
    /// The largest move of the bodies (length-scaled; radians) in which no tooth of a coupling is skipped.
    pub(crate) largest_move: f64,
    pub(crate) output: usize,
    /// The body that the output is measured against; the ground if none.
    pub(crate) seen_from: Body,
    pub(crate) loads: Vec<LoadSpec>,
    pub(crate) springs: Vec<SpringSpec>,
    pub(crate) torsions: Vec<TorsionSpec>,
    pub(crate) sources: Vec<Source>,
    /// The sources with quantile functions, in groups whose scores are drawn together.
    pub(crate) scores: Vec<Scores>,
    pub(crate) elastic: Vec<Elastic>,
    pub(crate) centre: Vec<f64>,
    /// What has been derived of it: a basis, recorded programs.
    pub(crate) memo: Memo,
}

impl Mechanism {
    /// Where a basis keeps a parameter.
    pub(crate) fn place_of(&self, parameter: usize) -> usize {
        let row = self.rows.iter().position(|row| row.parameter == Some(parameter));
        row.unwrap_or(self.n_rows() + parameter)
    }

    /// Number of components of a position.
    #[must_use]
    pub fn n_translations(&self) -> usize {
        self.space.components().iter().filter(|c| matches!(c, Component::Along(_))).count()
    }

    /// Number of moving bodies.
    #[must_use]
    pub const fn n_bodies(&self) -> usize {
        self.guess.len()
    }

    /// Number of components of a twist.
    #[must_use]
    pub const fn size(&self) -> usize {
        self.space.size()
    }

    /// Number of unknowns: the twist components of all bodies.
    #[must_use]
    pub const fn n_unknowns(&self) -> usize {
        self.n_bodies() * self.size()
    }

    /// Number of coordinates of all bodies.
    #[must_use]
    pub const fn n_coordinates(&self) -> usize {
        self.n_bodies() * self.space.n_coordinates()
    }

    /// Number of coordinates of one body.
    #[must_use]
    pub const fn n_body_coordinates(&self) -> usize {
        self.space.n_coordinates()
    }

    /// Number of closure rows, drive rows (the last ones) included.
    #[must_use]
    pub const fn n_rows(&self) -> usize {
        self.rows.len()
    }

    /// Number of joints.
    #[must_use]
    pub const fn n_joints(&self) -> usize {
        self.joints.len()
    }

    /// The parameters that are plays between flanks.
    pub(crate) fn plays(&self) -> impl Iterator<Item = usize> + '_ {
        self.rows.iter().filter(|row| row.play.is_some()).filter_map(|row| row.parameter)
    }

    /// The rows that drives command, each with the drive.
    pub(crate) fn driven(&self) -> impl Iterator<Item = (&Row, Driven)> {
        self.commanded.iter().filter_map(|row| Some((row, row.drive?)))
    }

    /// The rows of drives among those that hold the mechanism, by number; a basis may leave some out.
    pub(crate) fn rows_of_drives(&self) -> impl Iterator<Item = (usize, &Row, Driven)> {
        self.rows.iter().enumerate().filter_map(|(k, row)| Some((k, row, row.drive?)))
    }

    /// The unit by which a component is compared with others: the characteristic length, or a radian.
    pub(crate) const fn unit(&self, component: Component) -> f64 {
        match component {
            Component::Along(_) => self.length,
            Component::About(_) => 1.0,
        }
    }

    /// Size of a twist of all bodies: translations in characteristic lengths, rotations in radians.
    pub(crate) fn scaled_size(&self, twists: &[f64]) -> f64 {
        let components = self.space.components();
        twists.chunks_exact(components.len()).fold(0.0, |largest, twist| {
            components.iter().zip(twist).fold(largest, |largest: f64, (component, v)| {
                let size = v.abs() / self.unit(*component);
                // `max` would lose a NaN.
                if size > largest || size.is_nan() { size } else { largest }
            })
        })
    }

    /// Number of drives.
    #[must_use]
    pub const fn n_drives(&self) -> usize {
        self.n_drives
    }

    /// How many loads it has.
    #[must_use]
    pub const fn n_loads(&self) -> usize {
        self.loads.len()
    }

    /// The sources of error.
    #[must_use]
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// Number of parameters: the components of all sources.
    #[must_use]
    pub const fn n_parameters(&self) -> usize {
        self.centre.len()
    }

    /// Source and component name of every parameter.
    pub fn parameters(&self) -> impl Iterator<Item = (usize, &'static str)> + '_ {
        self.sources.iter().enumerate().flat_map(|(s, source)| source.components.iter().map(move |&c| (s, c)))
    }

    /// Joint and component name of every row.
    pub fn row_names(&self) -> impl Iterator<Item = (usize, &'static str)> + '_ {
        self.rows.iter().map(|r| (r.joint, self.joints[r.joint].name_of(r.component)))
    }

    /// Joint and component name of every component that gives way elastically, joint after joint.
    pub fn deformations(&self) -> impl Iterator<Item = (usize, &'static str)> + '_ {
        self.elastic.iter().flat_map(Elastic::yielding).map(|k| {
            let row = &self.rows[k];
            (row.joint, self.joints[row.joint].name_of(row.component))
        })
    }

    /// The rows of all elastic joints.
    pub fn elastic_rows(&self) -> impl Iterator<Item = usize> + '_ {
        self.elastic.iter().flat_map(|e| e.rows.clone())
    }

    /// Whether bodies turn about more than one axis. In the plane the largest rotation is one end or the
    /// other of the angle's range.
    pub(crate) fn turns_freely(&self) -> bool {
        self.size() - self.n_translations() > 1
    }

    /// Whether other places at which a load may hold it are looked for. From each of many ends the whole mechanism is
    /// settled anew, so that the work would grow with the square of its size.
    pub(crate) fn is_searched(&self) -> bool {
        self.sources.iter().filter(|source| source.is_clearance && !source.set.is_zero()).count() <= SEARCHED
    }

    /// The largest angle among the parameters, twice the sets' own to leave room for untruncated laws.
    pub(crate) fn largest_angle(&self) -> f64 {
        let turning = self.rows.iter().filter(|row| matches!(row.component, Component::About(_)));
        let by = |row: &Row| row.parameter.map(|p| (p, 1.0)).into_iter().chain(row.shift);
        let of_points = self.points.iter().flat_map(|point| &point.displaced_by).flat_map(|d| &d.ways);
        let of_points = of_points.map(|way| (way.parameter, norm(&way.about)));
        turning.flat_map(by).chain(of_points).fold(0.0, |largest: f64, (p, coefficient)| {
            let source = self.sources.iter().find(|s| s.range().contains(&p));
            let half_width = source.map_or(0.0, |s| s.largest_set().half_width(p - s.first));
            largest.max(coefficient.abs() * (self.centre[p].abs() + 2.0 * half_width))
        })
    }

    /// The same mechanism, guessed to be elsewhere.
    #[must_use]
    pub fn guessed_at(&self, coordinates: &[f64]) -> Self {
        let guess = coordinates.chunks_exact(self.n_body_coordinates()).map(<[f64]>::to_vec).collect();
        Self { guess, ..self.clone() }
    }

    /// Coordinates of all bodies at the guess.
    #[must_use]
    pub fn guess(&self) -> Vec<f64> {
        self.guess.concat()
    }
}
