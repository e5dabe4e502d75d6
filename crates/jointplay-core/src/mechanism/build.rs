//! Building a mechanism from its specification, with every reference checked.

use std::iter;
use std::ops::Range;

use crate::clearance::Set;
use crate::cone::springs::factor;
use crate::math::space::{Component, Space};
use crate::math::vector::{add, norm, scale, sub};
use crate::mechanism::copula::{groups, quantile};
use crate::mechanism::coupling::{Coupling, Pair, Play};
use crate::mechanism::follower::Follower;
use crate::mechanism::frames::Frames;
use crate::mechanism::gap::{Gap, Size};
use crate::mechanism::joint::Joint;
use crate::mechanism::kind::JointKind;
use crate::mechanism::point::{Displacement, Point};
use crate::mechanism::spec::{DisplacementSpec, SourceSpec, Spec, Target};
use crate::mechanism::{Driven, Elastic, Mechanism, Row, Source};
use crate::program::memo::Memo;

/// A mistake in a specification: an index out of range or a set that does not fit its joint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("inconsistent mechanism: {0}")]
pub struct SpecError(String);

/// Sizes of one clearance: hole and pin, or one of its own.
const MOST_SIZES: usize = 2;

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
        let frames = Frames::new(spec);
        let mut points = points(spec, &frames)?;
        if spec.output.point >= points.len() || spec.loads.iter().any(|l| l.point >= points.len()) {
            return fail("the output or a load refers to a point that does not exist");
        }
        if spec.output.relative_to.is_some_and(|body| body >= spec.n_bodies || points[spec.output.point].body.is_none())
        {
            return fail("the output is measured against a body that does not exist, or is on the ground");
        }
        let joints = joints(spec, &points)?;
        check_forces(spec, &points, &joints)?;
        let mut rows: Vec<Row> = Vec::new();
        let mut elastic = Vec::new();
        for (joint, j) in joints.iter().enumerate() {
            let first = rows.len();
            rows.extend(j.locked.iter().map(|&component| {
                let is_coupled = j.coupling.is_some() && component == Component::Along(0);
                Row { is_coupled, ..Row::of(joint, component) }
            }));
            if let Some(compliance) = &spec.joints[joint].compliance {
                elastic.extend(gives_way(&format!("joint {joint}"), joint, first..rows.len(), compliance)?);
            }
        }
        let mut driven_rows = Vec::with_capacity(spec.drives.len());
        let of_joints = rows.len();
        for (d, drive) in spec.drives.iter().enumerate() {
            driven_rows.push(rows.len());
            let first = (drive.joint, drive.component, drive.coefficient);
            let others = drive.also.iter().map(|driven| (driven.joint, driven.component, driven.coefficient));
            for (joint, component, coefficient) in iter::once(first).chain(others) {
                let coordinate =
                    joints.get(joint).and_then(|j| component.map_or(j.coordinate, |named| j.component_of(named)));
                let Some(component) = coordinate else { return fail(format!("drive {d} has no coordinate to drive")) };
                if !coefficient.is_finite() || coefficient == 0.0 {
                    return fail(format!("drive {d} moves a joint by nothing"));
                }
                let command = rows.len() - of_joints;
                rows.push(Row { drive: Some(Driven { drive: d, coefficient, command }), ..Row::of(joint, component) });
            }
            if let Some(compliance) = &drive.compliance {
                elastic.extend(gives_way(&format!("drive {d}"), drive.joint, driven_rows[d]..rows.len(), compliance)?);
            }
        }
        displace(spec, &frames, &mut points)?;
        let (sources, centre) = sources(spec, &mut points, &joints, &mut rows, &driven_rows)?;
        let scores = groups(&spec.correlations, &sources).map_err(SpecError)?;
        let largest_move = |joint: &Joint| joint.coupling.as_ref().map_or(f64::INFINITY, Coupling::largest_move);
        let mut built = Self {
            space: spec.space,
            guess: frames.guess(spec),
            frames,
            length: spec.length,
            singular_value: spec.singular_value,
            points,
            n_drives: spec.drives.len(),
            driven_rows,
            n_sides: if joints.iter().any(|joint| joint.follows.is_some()) { 4 } else { 2 },
            n_driven: rows.len() - of_joints,
            commanded: rows[of_joints..].to_vec(),
            largest_move: joints.iter().map(largest_move).fold(f64::INFINITY, f64::min),
            output: spec.output.point,
            seen_from: spec.output.relative_to,
            loads: spec.loads.clone(),
            springs: spec.springs.clone(),
            torsions: spec.torsions.clone(),
            sources,
            scores,
            elastic,
            centre,
            memo: Memo::default(),
            joints,
            rows,
            left_out: Vec::new(),
        };
        for (number, joint) in spec.joints.iter().enumerate() {
            let pair = built.pair_at_guess(number);
            if let Some(coupling) = &mut built.joints[number].coupling {
                coupling.begin(&pair, joint.coupling.as_ref().and_then(|told| told.marks));
            }
        }
        Ok(built)
    }
}

impl Mechanism {
    /// The two bodies of a joint where they are guessed to be.
    fn pair_at_guess(&self, joint: usize) -> Pair<f64> {
        let joint = &self.joints[joint];
        let side = |point: usize, axes: &[[f64; 3]; 3]| {
            let Point { body, at, .. } = self.points[point];
            let axes = joint.plane().map(|axis| axes[axis]);
            let pose = body.map(|b| self.space.pose(&self.guess[b]));
            pose.map_or((at, axes), |pose| (add(pose.position, pose.turn(at)), axes.map(|axis| pose.turn(axis))))
        };
        let (first, second) = (side(joint.first, &joint.axes_first), side(joint.second, &joint.axes_second));
        Pair { apart: sub(second.0, first.0), axes: [first.1, second.1] }
    }
}

fn points(spec: &Spec, frames: &Frames) -> Result<Vec<Point>, SpecError> {
    let place = |(i, p): (usize, &crate::mechanism::spec::PointSpec)| {
        let body = match usize::try_from(p.body) {
            Err(_) => None,
            Ok(b) if b < spec.n_bodies => Some(b),
            Ok(b) => return fail(format!("point {i} is on body {b}, which does not exist")),
        };
        Ok(Point { body, at: sub(p.at, frames.of(body)), displaced_by: Vec::new() })
    };
    spec.points.iter().enumerate().map(place).collect()
}

/// Gives every point its displacements, which do nothing yet.
fn displace(spec: &Spec, frames: &Frames, points: &mut [Point]) -> Result<(), SpecError> {
    for (i, displacement) in spec.displacements.iter().enumerate() {
        let mut bodies = displacement.points.iter().map(|&p| points.get(p).map(|point| point.body));
        let first = bodies.next().flatten();
        if first.is_none() || bodies.any(|body| body != first) {
            return fail(format!("displacement {i} needs points of one body"));
        }
        for &p in &displacement.points {
            let centre = sub(displacement.about, frames.of(points[p].body));
            points[p].displaced_by.push(Displacement { number: Some(i), centre, ways: Vec::new() });
        }
    }
    Ok(())
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
    let mut joints: Vec<Joint> = spec.joints.iter().enumerate().map(connect).collect::<Result<_, _>>()?;
    for (i, told) in spec.joints.iter().enumerate() {
        let follows = told.follows.as_ref();
        if (told.kind == JointKind::Follower) != follows.is_some() {
            return fail(format!("joint {i} follows nothing, or is no follower"));
        }
        let Some(follows) = follows else { continue };
        let coordinate = |joint: usize| joints.get(joint).and_then(|joint| joint.coordinate);
        let (Some(own), Some(component)) = (coordinate(follows.of), coordinate(follows.leader)) else {
            return fail(format!("joint {i} follows or leads a joint without a coordinate"));
        };
        if follows.of == follows.leader || !follows.middle.is_finite() {
            return fail(format!("joint {i} follows itself"));
        }
        let (leader, curve, middle) = (follows.leader, follows.curve.clone(), follows.middle);
        joints[i].follow(own, Follower { leader, component, curve, middle });
    }
    Ok(joints)
}

/// What loads and springs refer to.
fn check_forces(spec: &Spec, points: &[Point], joints: &[Joint]) -> Result<(), SpecError> {
    if spec.loads.iter().any(|load| load.axes.is_some_and(|body| body >= spec.n_bodies)) {
        return fail("a load is in the axes of a body that does not exist");
    }
    for (i, spring) in spec.springs.iter().enumerate() {
        let (Some(first), Some(second)) = (points.get(spring.first), points.get(spring.second)) else {
            return fail(format!("spring {i} refers to a point that does not exist"));
        };
        if first.body == second.body {
            return fail(format!("spring {i} connects a body to itself"));
        }
    }
    for (i, spring) in spec.torsions.iter().enumerate() {
        let turns = |joint: &Joint| matches!(joint.coordinate, Some(Component::About(_)));
        if !joints.get(spring.joint).is_some_and(turns) {
            return fail(format!("torsion spring {i} needs a joint whose coordinate is an angle"));
        }
    }
    Ok(())
}

/// What gives way by a compliance of its rows, if that is not zero; `what` has it.
fn gives_way(what: &str, joint: usize, rows: Range<usize>, compliance: &[f64]) -> Result<Option<Elastic>, SpecError> {
    let size = rows.len();
    if compliance.len() != size * size {
        return fail(format!("{what}: its compliance needs {size} x {size} numbers"));
    }
    let unlike = |i: usize, j: usize| {
        let (a, b) = (compliance[i * size + j], compliance[j * size + i]);
        (a - b).abs() > 1e-9 * a.abs().max(b.abs())
    };
    let symmetric = (0..size).all(|i| (0..i).all(|j| !unlike(i, j)));
    if !symmetric || factor(compliance, size).is_none() {
        return fail(format!("{what}: its compliance is not symmetric and positive semidefinite"));
    }
    let is_rigid = compliance.iter().all(|c| *c == 0.0);
    Ok((!is_rigid).then(|| Elastic { joint, rows, compliance: compliance.to_vec() }))
}

/// The sources with the known deviations of their parameters.
fn sources(
    spec: &Spec,
    points: &mut [Point],
    joints: &[Joint],
    rows: &mut [Row],
    driven_rows: &[usize],
) -> Result<(Vec<Source>, Vec<f64>), SpecError> {
    let mut sources = Vec::with_capacity(spec.sources.len());
    let mut centre = Vec::new();
    let is_of = |joint| move |s: &SourceSpec| matches!(s.target, Target::Clearance { joint: of } if of == joint);
    let has_sizes = |joint: usize| {
        let is_loose = joints.get(joint).is_some_and(|j| j.loosened > 0 && j.coupling.is_none() && j.follows.is_none());
        is_loose && spec.sources.iter().any(is_of(joint))
    };
    for (i, s) in spec.sources.iter().enumerate() {
        let set = if sized(spec, s) { s.set.with_gap(s.set.gap()) } else { s.set };
        set.check().map_err(|e| SpecError(format!("source {i}: {e}")))?;
        let first = centre.len();
        let components = attach(s, &has_sizes, first, &spec.displacements, points, joints, rows)
            .map_err(|e| SpecError(format!("source {i}: {}", e.0)))?;
        if components.len() != set.size() || s.centre.len() != set.size() {
            return fail(format!("source {i}: its set or centre has the wrong size"));
        }
        centre.extend_from_slice(&s.centre);
        let is_clearance = matches!(s.target, Target::Clearance { .. } | Target::Backlash { .. });
        let is_angle = match s.target {
            Target::Angle { .. } => true,
            Target::Clearance { joint } | Target::Ratio { joint } => {
                joints.get(joint).is_some_and(Joint::follows_by_angle)
            }
            Target::Drive { drive } => matches!(rows[driven_rows[drive]].component, Component::About(_)),
            Target::Backlash { drive, joint } => {
                rows_of(rows, drive).any(|row| row.joint == joint && matches!(row.component, Component::About(_)))
            }
            Target::Place { ref ways, .. } => ways.first().is_some_and(|[along, _]| norm(along) == 0.0),
            Target::Dimension { .. } | Target::Size { .. } | Target::Growth { .. } => false,
        };
        let lever = match &s.target {
            // Zero where nothing grows: then nothing is conjugate to it.
            Target::Growth { moves } => moves.iter().fold(0.0, |far: f64, moved| far.max(norm(&moved.rate))),
            _ if is_angle => spec.length,
            _ => 1.0,
        };
        let quantile = quantile(spec, i).map_err(|e| SpecError(format!("source {i}: {e}")))?;
        let law = s.law.plain();
        sources.push(Source { set, law, quantile, gap: None, first, is_clearance, lever, components });
    }
    let gaps: Vec<_> = (0..sources.len()).map(|s| gap(spec, s, &sources, &centre)).collect::<Result<_, _>>()?;
    for (source, gap) in sources.iter_mut().zip(gaps) {
        if let Some(gap) = &gap {
            source.set = source.set.with_gap(gap.at(&centre));
        }
        source.gap = gap;
    }
    Ok((sources, centre))
}

/// How much the gap of a joint grows with a source.
fn factor_of(source: &SourceSpec, joint: usize) -> Option<f64> {
    let Target::Size { joint: first, factor, also } = &source.target else { return None };
    let others = also.iter().map(|other| (other.joint, other.factor));
    iter::once((*first, *factor)).chain(others).find(|(of, _)| *of == joint).map(|(_, factor)| factor)
}

/// Whether sizes of a clearance scatter.
fn sized(spec: &Spec, source: &SourceSpec) -> bool {
    let Target::Clearance { joint } = source.target else { return false };
    spec.sources.iter().any(|s| factor_of(s, joint).is_some())
}

/// What the gap of a clearance depends on where sizes of its joint scatter.
fn gap(spec: &Spec, number: usize, sources: &[Source], centre: &[f64]) -> Result<Option<Gap>, SpecError> {
    let Target::Clearance { joint } = spec.sources[number].target else { return Ok(None) };
    if !sized(spec, &spec.sources[number]) {
        return Ok(None);
    }
    let set = spec.sources[number].set;
    let base = set.gap();
    #[allow(clippy::float_cmp)] // exact: both ends are written from one gap
    let lopsided = matches!(set, Set::Interval { low, high } if low != -high);
    if !base.is_finite() || lopsided {
        return fail(format!("source {number}: the gap that sizes depend on must be finite, and equal on both sides"));
    }
    let mut gap = Gap { base, sizes: Vec::new(), largest: base };
    for (source, s) in spec.sources.iter().enumerate() {
        let (Some(factor), Set::Interval { low, high }) = (factor_of(s, joint), s.set) else { continue };
        let parameter = sources[source].first;
        gap.largest += factor * centre[parameter] + (factor * low).max(factor * high);
        gap.sizes.push(Size { source, parameter, factor, share: 0.0 });
    }
    if gap.sizes.len() > MOST_SIZES {
        return fail(format!("source {number}: a gap depends on at most {MOST_SIZES} sizes"));
    }
    Ok(Some(gap))
}

/// The rows that a drive commands.
fn rows_of(rows: &mut [Row], drive: usize) -> impl Iterator<Item = &mut Row> {
    rows.iter_mut().filter(move |row| row.drive.is_some_and(|by| by.drive == drive))
}

/// Lets the parameters from `first` on displace what the target names; gives their names.
fn attach(
    source: &SourceSpec,
    has_sizes: &dyn Fn(usize) -> bool,
    first: usize,
    displacements: &[DisplacementSpec],
    points: &mut [Point],
    joints: &[Joint],
    rows: &mut [Row],
) -> Result<Vec<&'static str>, SpecError> {
    match source.target {
        Target::Place { displacement, ref components, ref ways } => {
            let Some(of) = displacements.get(displacement) else { return fail("there is no such displacement") };
            if components.len() != ways.len() || ways.iter().flatten().flatten().any(|v| !v.is_finite()) {
                return fail("a displacement needs finite numbers and a name for each component");
            }
            for &p in &of.points {
                points[p].take_part(displacement, first, ways);
            }
            Ok(components.iter().map(|component| component.name()).collect())
        }
        Target::Growth { ref moves } => {
            for moved in moves {
                let Some(point) = points.get_mut(moved.point) else { return fail("there is no such point") };
                point.shift(first, moved.rate);
            }
            Ok(vec!["growth"])
        }
        Target::Clearance { joint } => {
            let Some(j) = joints.get(joint) else { return fail("there is no such joint") };
            if j.loosened == 0 {
                return fail("a joint of this kind has no clearance");
            }
            let start = rows.iter().position(|r| r.joint == joint).unwrap_or(0);
            for k in 0..j.loosened {
                rows[start + k].parameter = Some(first + k);
            }
            if let (Some(coupling), Set::Interval { low, high }) = (&j.coupling, source.set) {
                let centre = source.centre.first().copied().unwrap_or_default() + 0.5 * (low + high);
                let half = 0.5 * (high - low);
                if half >= coupling.largest_play {
                    return fail("its play is as wide as the gap between two teeth");
                }
                let opens = half > coupling.rounding();
                rows[start].play = opens.then_some(Play { centre, half });
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
        Target::Dimension { from, to, ref together } => {
            let (Some(a), Some(b)) = (points.get(from), points.get(to)) else { return fail("there is no such point") };
            let (body, between) = (b.body, sub(b.at, a.at));
            let distance = norm(&between);
            if a.body != body || distance == 0.0 {
                return fail("a dimension needs two points of one body, apart from each other");
            }
            for &p in iter::once(&to).chain(together) {
                let Some(point) = points.get_mut(p).filter(|point| point.body == body) else {
                    return fail("a dimension moves points of one body");
                };
                point.shift(first, scale(between, 1.0 / distance));
            }
            Ok(vec!["length"])
        }
        Target::Size { joint, factor, ref also } => {
            let is_part = |by: f64| by.is_finite() && by * factor > 0.0;
            if !matches!(source.set, Set::Interval { .. })
                || !is_part(factor)
                || !also.iter().all(|o| is_part(o.factor))
            {
                return fail("a size is one number, of which every gap is a part, with one sign");
            }
            if !iter::once(joint).chain(also.iter().map(|other| other.joint)).all(has_sizes) {
                return fail("a joint of this kind has no clearance with sizes");
            }
            Ok(vec!["size"])
        }
        Target::Drive { drive } => attach_error(rows, drive, first),
        Target::Backlash { drive, joint } => attach_backlash(rows, drive, joint, first),
        Target::Ratio { joint } => {
            let follows = joints.get(joint).is_some_and(|joint| joint.follows.is_some());
            let Some(row) = rows.iter_mut().find(|row| row.joint == joint && (row.is_coupled || follows)) else {
                return fail("only a coupling has a ratio error");
            };
            row.shift = Some((first, 1.0));
            Ok(vec![if joints[joint].follows_by_angle() { "angle" } else { "length" }])
        }
    }
}

/// Lets a parameter displace what a drive commands.
fn attach_error(rows: &mut [Row], drive: usize, parameter: usize) -> Result<Vec<&'static str>, SpecError> {
    let mut driven: Vec<&mut Row> = rows_of(rows, drive).collect();
    #[allow(clippy::float_cmp)] // exact: the coefficient that is left out
    let is_plain = |row: &Row| row.drive.is_some_and(|by| by.coefficient == 1.0);
    match driven.as_mut_slice() {
        [] => return fail("there is no such drive"),
        [row] if is_plain(row) && row.parameter.is_none() => row.parameter = Some(parameter),
        _ => driven.iter_mut().for_each(|row| row.shift = row.drive.map(|by| (parameter, by.coefficient))),
    }
    Ok(vec!["value"])
}

/// Lets a parameter be the lost motion of a drive at a joint: what gives way in a row is its own parameter, and an
/// error of the drive shifts it beside.
fn attach_backlash(
    rows: &mut [Row],
    drive: usize,
    joint: usize,
    parameter: usize,
) -> Result<Vec<&'static str>, SpecError> {
    let Some(row) = rows_of(rows, drive).find(|row| row.joint == joint) else {
        return fail("there is no such drive, or it does not move this joint");
    };
    row.shift = row.parameter.replace(parameter).map(|error| (error, 1.0)).or(row.shift);
    Ok(vec!["value"])
}
