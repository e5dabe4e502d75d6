//! Building a mechanism from its specification, with every reference checked.

use std::sync::OnceLock;

use crate::cone::springs::factor;
use crate::math::space::{Component, Space};
use crate::math::vector::{norm, scale, sub};
use crate::mechanism::joint::Joint;
use crate::mechanism::spec::{Spec, Target};
use crate::mechanism::{Elastic, Mechanism, Point, Row, Source};

/// A mistake in a specification: an index out of range or a set that does not fit its joint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("inconsistent mechanism: {0}")]
pub struct SpecError(String);

fn fail<T>(message: impl Into<String>) -> Result<T, SpecError> {
    Err(SpecError(message.into()))
}

impl Mechanism {
    /// Builds a mechanism.
    ///
    /// # Errors
    /// An index out of range, a set that does not fit what it belongs to, a degenerate axis.
    pub fn new(spec: &Spec) -> Result<Self, SpecError> {
        if spec.guess.len() != spec.n_bodies || spec.guess.iter().any(|g| g.len() != spec.space.n_coordinates()) {
            return fail("one guess of the right size per body is needed");
        }
        if spec.space == Space::Spatial && spec.guess.iter().any(|g| norm(&g[3..]) < 0.5) {
            return fail("a guess has no attitude: its quaternion must have unit size");
        }
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if !positive(spec.length) || !positive(spec.singular_value) {
            return fail("length and singular_value must be positive");
        }
        let mut points = points(spec)?;
        if spec.output.point >= points.len() || spec.loads.iter().any(|l| l.point >= points.len()) {
            return fail("the output or a load refers to a point that does not exist");
        }
        let joints = joints(spec, &points)?;
        let mut rows: Vec<Row> = Vec::new();
        for (joint, j) in joints.iter().enumerate() {
            rows.extend(j.locked.iter().map(|&component| Row { joint, component, drive: None, parameter: None }));
        }
        let elastic = elastic(spec, &rows)?;
        let mut driven_rows = Vec::with_capacity(spec.drives.len());
        for (d, drive) in spec.drives.iter().enumerate() {
            let coordinate = joints
                .get(drive.joint)
                .and_then(|j| drive.component.map_or(j.coordinate, |coordinate| j.component_of(coordinate)));
            let Some(component) = coordinate else { return fail(format!("drive {d} has no coordinate to drive")) };
            driven_rows.push(rows.len());
            rows.push(Row { joint: drive.joint, component, drive: Some(d), parameter: None });
        }
        let mut sources = Vec::with_capacity(spec.sources.len());
        let mut centre = Vec::new();
        for (i, s) in spec.sources.iter().enumerate() {
            let set = s.set;
            set.check().map_err(|e| SpecError(format!("source {i}: {e}")))?;
            let first = centre.len();
            let components = attach(&s.target, first, &mut points, &joints, &mut rows, &driven_rows)
                .map_err(|e| SpecError(format!("source {i}: {}", e.0)))?;
            if components.len() != set.size() || s.centre.len() != set.size() {
                return fail(format!("source {i}: its set or centre has the wrong size"));
            }
            centre.extend_from_slice(&s.centre);
            let is_clearance = matches!(s.target, Target::Clearance { .. });
            let is_angle = match s.target {
                Target::Angle { .. } => true,
                Target::Drive { drive } => matches!(rows[driven_rows[drive]].component, Component::About(_)),
                Target::Clearance { .. } | Target::Dimension { .. } => false,
            };
            sources.push(Source { set, law: s.law, first, is_clearance, is_angle, components });
        }
        Ok(Self {
            space: spec.space,
            guess: spec.guess.clone(),
            length: spec.length,
            singular_value: spec.singular_value,
            points,
            joints,
            rows,
            n_drives: spec.drives.len(),
            driven_rows,
            output: spec.output.point,
            loads: spec.loads.clone(),
            sources,
            elastic,
            centre,
            chosen: OnceLock::new(),
        })
    }
}

fn points(spec: &Spec) -> Result<Vec<Point>, SpecError> {
    let place = |(i, p): (usize, &crate::mechanism::spec::PointSpec)| {
        let body = match usize::try_from(p.body) {
            Err(_) => None,
            Ok(b) if b < spec.n_bodies => Some(b),
            Ok(b) => return fail(format!("point {i} is on body {b}, which does not exist")),
        };
        Ok(Point { body, at: p.at, moved_by: Vec::new() })
    };
    spec.points.iter().enumerate().map(place).collect()
}

fn joints(spec: &Spec, points: &[Point]) -> Result<Vec<Joint>, SpecError> {
    let connect = |(i, j): (usize, &crate::mechanism::spec::JointSpec)| {
        let (Some(first), Some(second)) = (points.get(j.first), points.get(j.second)) else {
            return fail(format!("joint {i} refers to a point that does not exist"));
        };
        if first.body == second.body {
            return fail(format!("joint {i} connects a body to itself"));
        }
        Joint::new(spec.space, j).map_err(|problem| SpecError(format!("joint {i} {problem}")))
    };
    spec.joints.iter().enumerate().map(connect).collect()
}

/// The joints that give way, with their rows; a compliance of zero is that of a rigid joint.
fn elastic(spec: &Spec, rows: &[Row]) -> Result<Vec<Elastic>, SpecError> {
    let mut elastic = Vec::new();
    for (joint, j) in spec.joints.iter().enumerate() {
        let Some(compliance) = &j.compliance else { continue };
        let first = rows.iter().position(|r| r.joint == joint).unwrap_or_default();
        let size = rows.iter().filter(|r| r.joint == joint).count();
        if compliance.len() != size * size {
            return fail(format!("joint {joint}: its compliance needs {size} x {size} numbers"));
        }
        let unlike = |i: usize, j: usize| {
            let (a, b) = (compliance[i * size + j], compliance[j * size + i]);
            (a - b).abs() > 1e-9 * a.abs().max(b.abs())
        };
        let symmetric = (0..size).all(|i| (0..i).all(|j| !unlike(i, j)));
        if !symmetric || factor(compliance, size).is_none() {
            return fail(format!("joint {joint}: its compliance is not symmetric and positive semidefinite"));
        }
        if compliance.iter().any(|c| *c != 0.0) {
            elastic.push(Elastic { joint, rows: first..first + size, compliance: compliance.clone() });
        }
    }
    Ok(elastic)
}

/// Lets the parameters from `first` on displace what the target names; gives their names.
fn attach(
    target: &Target,
    first: usize,
    points: &mut [Point],
    joints: &[Joint],
    rows: &mut [Row],
    driven_rows: &[usize],
) -> Result<Vec<&'static str>, SpecError> {
    match *target {
        Target::Clearance { joint } => {
            let Some(j) = joints.get(joint) else { return fail("there is no such joint") };
            if j.loosened == 0 {
                return fail("a joint of this kind has no clearance");
            }
            let start = rows.iter().position(|r| r.joint == joint).unwrap_or(0);
            for k in 0..j.loosened {
                rows[start + k].parameter = Some(first + k);
            }
            Ok(j.locked[..j.loosened].iter().map(|&component| j.name_of(component)).collect())
        }
        Target::Angle { joint } => {
            let roll = joints.get(joint).filter(|j| j.coordinate.is_none()).map(Joint::roll);
            let is_angle = |r: &&mut Row| r.joint == joint && Some(r.component) == roll;
            let Some(row) = rows.iter_mut().find(is_angle) else {
                return fail("an angle error needs a fixed joint");
            };
            row.parameter = Some(first);
            Ok(vec!["angle"])
        }
        Target::Dimension { from, to } => {
            let (Some(a), Some(b)) = (points.get(from), points.get(to)) else { return fail("there is no such point") };
            let between = sub(b.at, a.at);
            let distance = norm(&between);
            if a.body != b.body || distance == 0.0 {
                return fail("a dimension needs two points of one body, apart from each other");
            }
            points[to].moved_by.push((first, scale(between, 1.0 / distance)));
            Ok(vec!["length"])
        }
        Target::Drive { drive } => {
            let Some(&row) = driven_rows.get(drive) else { return fail("there is no such drive") };
            rows[row].parameter = Some(first);
            Ok(vec!["value"])
        }
    }
}
