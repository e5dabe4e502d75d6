//! Couplings: rows that tie what two bodies do to each other, as gears, racks, belts and screws do.
//!
//! A coupling is a joint whose first row is no component of its displacement but a sum of terms
//!
//! ```text
//! R = sum of coefficient x measure - start,    wrapped to its period
//! ```
//!
//! | kind | terms | period | flank opens by |
//! |---|---|---|---|
//! | gear pair | -r1 (bearing on body 1) - r2 (bearing on body 2) | pitch x gcd(z1, z2) | k [rho - b atan(rho / b)], k = sign(r1 + r2) / cos(alpha), b = abs(r1 + r2) cos(alpha) |
//! | belt | the same with -r2 unless it is crossed | the same | the same with k = -1, b = abs(r1 + r2) |
//! | rack | along + side r (roll) | 2 pi r | tan(alpha) (height - r) |
//! | screw | along - lead / 2 pi (roll) | lead | |
//!
//! The bearing is the angle at which a body sees the line of centres c from point 1 to point 2, in the plane of
//! its axes that the joint turns in; `rho^2 = c^2 - b^2`. Gear and belt open by the same function, the involute of
//! the base circles. r2 is negative for a ring around body 1. Angles enter by sine and cosine of their whole
//! multiples, so that R has one value in each pose; which tooth meshes follows from continuity along a path.
//!
//! Both flanks touch at R = 0. Play u between them, of half-width h about a centre, widens by the opening E on
//! each side:
//!
//! ```text
//! R - ratio error - [centre + (u - centre) (1 + E / h)] = 0
//! ```
//!
//! At either end of the play the derivative along the twists is the line of action of the flank that carries,
//! since `d(R -+ E)` is what its force works on.

use crate::closure::{Command, turn_back};
use crate::mechanism::{Mechanism, Row};
use crate::real::Real;
use crate::space::{Component, Pose, Space, Vec3, add, cross, dot, scale, sub};
use crate::spec::{CouplingSpec, JointKind};

/// What a term of a coupling measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Measure {
    /// The angle at which the first body (or the second) sees the line of centres.
    Bearing { second: bool },
    /// The angle of the second body relative to the first.
    Roll,
    /// The displacement along an axis of the joint.
    Along(usize),
}

/// By how much each flank moves away from the other.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Opening {
    /// With the distance of the centres: `factor [rho - base atan(rho / base)]`, less its value at `start`.
    Distance { factor: f64, base: f64, start: f64 },
    /// With the displacement along an axis of the joint: `slope x displacement - start`.
    Height { axis: usize, slope: f64, start: f64 },
}

/// The coupled row of a joint.
#[derive(Clone, Debug)]
pub(crate) struct Coupling {
    /// Measures with their coefficients, lengths for angles.
    pub terms: Vec<(Measure, f64)>,
    /// The length of one radian of phase: the period is a full turn of it.
    pub radian: f64,
    /// A distance of the centres, for bearings to have about unit size.
    pub distance: f64,
    /// Sine and cosine of the phase at the start.
    pub start: (f64, f64),
    /// What play opens by.
    pub opening: Option<Opening>,
}

/// Half-width and centre of the play between two flanks.
#[derive(Clone, Copy, Debug)]
pub struct Play {
    /// Where both flanks are equally far.
    pub centre: f64,
    /// Half of the play.
    pub half: f64,
}

/// The rate of a quantity of two bodies: `linear . (velocity of point 2 - of point 1) + first . w1 + second . w2`.
#[derive(Clone, Copy)]
pub(crate) struct Rate<S> {
    pub linear: Vec3<S>,
    pub first: Vec3<S>,
    pub second: Vec3<S>,
}

impl<S: Real> Rate<S> {
    fn zero() -> Self {
        let zero = [S::from_f64(0.0); 3];
        Self { linear: zero, first: zero, second: zero }
    }

    fn plus(self, factor: S, other: Self) -> Self {
        let sum = |a, b| add(a, scale(b, factor));
        Self {
            linear: sum(self.linear, other.linear),
            first: sum(self.first, other.first),
            second: sum(self.second, other.second),
        }
    }
}

/// A coupled row at a pose.
pub(crate) struct Coupled<S> {
    pub residual: S,
    /// Its rate at the flank where the play is.
    pub rate: Rate<S>,
    /// What its play is multiplied by.
    pub slope: S,
}

/// Counts what couplings move through on a way, to see whether the same teeth mesh at its end.
pub(crate) struct Mesh<'m> {
    mechanism: &'m Mechanism,
    measures: Vec<f64>,
    moved: Vec<f64>,
    /// Residuals at the beginning.
    from: Vec<f64>,
}

impl<'m> Mesh<'m> {
    pub fn new(mechanism: &'m Mechanism, coordinates: &[f64], parameters: &[f64]) -> Self {
        let measures = mechanism.through(coordinates, parameters);
        Self { mechanism, moved: vec![0.0; measures.len()], measures, from: Vec::new() }
    }

    /// After a move in which no angle changes by as much as half a turn.
    pub fn moves(&mut self, coordinates: &[f64], parameters: &[f64]) {
        let measures = self.mechanism.through(coordinates, parameters);
        let ways = measures.iter().zip(&self.measures).map(|(to, from)| to - from);
        let terms = self.mechanism.coupled_rows().flat_map(|(_, coupling)| &coupling.terms);
        for ((moved, way), (measure, _)) in self.moved.iter_mut().zip(ways).zip(terms) {
            let turn = std::f64::consts::TAU;
            *moved += match measure {
                Measure::Along(_) => way,
                Measure::Bearing { .. } | Measure::Roll => way - turn * (way / turn).round(),
            };
        }
        self.measures = measures;
    }

    /// Whether no tooth has been skipped until the rows have this residual; the first time is the beginning.
    pub fn is_kept(&mut self, residual: &[f64]) -> bool {
        if self.measures.is_empty() {
            return true;
        }
        if self.from.is_empty() {
            self.from = residual.to_vec();
        }
        let mut moved = self.moved.iter();
        self.mechanism.coupled_rows().all(|(row, coupling)| {
            let way: f64 = coupling.terms.iter().zip(&mut moved).map(|(term, moved)| term.1 * moved).sum();
            (way - (residual[row] - self.from[row])).abs() < 0.5 * std::f64::consts::PI * coupling.radian
        })
    }
}

/// Product of two numbers of the unit circle, sine first.
fn turn_on<S: Real>((s, c): (S, S), (sine, cosine): (S, S)) -> (S, S) {
    (s * cosine + c * sine, c * cosine - s * sine)
}

/// Sine and cosine of a whole multiple of an angle, by repeated squaring.
fn multiple<S: Real>((s, c): (S, S), times: i32) -> (S, S) {
    let mut square = if times < 0 { (-s, c) } else { (s, c) };
    let mut left = times.unsigned_abs();
    let mut product = (S::from_f64(0.0), S::from_f64(1.0));
    while left > 0 {
        if left & 1 == 1 {
            product = turn_on(product, square);
        }
        left >>= 1;
        if left > 0 {
            square = turn_on(square, square);
        }
    }
    product
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl Coupling {
    /// The coupling of a joint, where its kind is one.
    pub(crate) fn new(space: Space, kind: JointKind, spec: &CouplingSpec) -> Result<Self, &'static str> {
        let turns = std::f64::consts::TAU;
        let [r1, r2] = spec.radii;
        let right = |r: f64| r.is_finite() && r > 0.0;
        let angled = spec.pressure_angle >= 0.0 && spec.pressure_angle < 0.25 * turns;
        let [slides, height] = match space {
            Space::Planar => [0, 1],
            Space::Spatial => [1, 2],
        };
        if kind == JointKind::Screw {
            if !spec.lead.is_finite() || spec.lead == 0.0 {
                return Err("needs a lead other than zero");
            }
            return Ok(Self {
                terms: vec![(Measure::Along(0), 1.0), (Measure::Roll, -spec.lead / turns)],
                radian: spec.lead.abs() / turns,
                distance: 1.0,
                start: (0.0, 1.0),
                opening: None,
            });
        }
        if kind == JointKind::Rack {
            if !right(r1) || !angled {
                return Err("needs a positive pitch radius and a pressure angle from 0 to 90 degrees");
            }
            let slope = spec.pressure_angle.tan();
            return Ok(Self {
                terms: vec![(Measure::Along(slides), 1.0), (Measure::Roll, r1)],
                radian: r1,
                distance: 1.0,
                start: (0.0, 1.0),
                opening: Some(Opening::Height { axis: height, slope, start: slope * r1 }),
            });
        }
        let [z1, z2] = spec.teeth;
        if !right(r1) || !right(r2) || z1 == 0 || z2 == 0 || !angled {
            return Err("needs positive pitch radii, tooth counts and a pressure angle from 0 to 90 degrees");
        }
        if (r1 * f64::from(z2) - r2 * f64::from(z1)).abs() > 1e-9 * r1 * f64::from(z2) {
            return Err("has pitch radii that are not in the ratio of its tooth counts");
        }
        let is_belt = kind == JointKind::Belt;
        let same_way = if is_belt { !spec.crossed } else { spec.internal };
        let r2 = if same_way { -r2 } else { r2 };
        let apart = (r1 + r2).abs();
        if !is_belt && apart <= 1e-9 * r1 {
            return Err("has two wheels of one size inside each other");
        }
        let (factor, base) = if is_belt {
            (-1.0, apart)
        } else {
            ((r1 + r2).signum() / spec.pressure_angle.cos(), apart * spec.pressure_angle.cos())
        };
        // Gears have their pressure angle where the pitch circles touch; a belt its slack at the start.
        let distance = if is_belt { spec.distance.unwrap_or(f64::NAN) } else { apart };
        Ok(Self {
            terms: vec![(Measure::Bearing { second: false }, -r1), (Measure::Bearing { second: true }, -r2)],
            radian: r1 * f64::from(gcd(z1, z2)) / f64::from(z1),
            distance,
            start: (0.0, 1.0),
            opening: Some(Opening::Distance { factor, base, start: (distance * distance - base * base).sqrt() }),
        })
    }

    /// Whether one of its terms is a displacement, whose phase needs a reference in a recorded program.
    pub(crate) fn slides(&self) -> Option<usize> {
        self.terms.iter().find_map(|term| match term.0 {
            Measure::Along(axis) => Some(axis),
            Measure::Bearing { .. } | Measure::Roll => None,
        })
    }

    fn times(&self, coefficient: f64) -> i32 {
        (coefficient / self.radian).round() as i32
    }

    /// The largest move of the bodies (length-scaled; radians) in which no tooth is skipped: what the bearings
    /// bend in it is of second order and stays within an eighth of the period.
    pub(crate) fn largest_move(&self) -> f64 {
        let bends = |&(measure, r): &(Measure, f64)| match measure {
            Measure::Bearing { .. } => r.abs(),
            Measure::Roll | Measure::Along(_) => 0.0,
        };
        let radius: f64 = self.terms.iter().map(bends).sum();
        if radius > 0.0 { (std::f64::consts::TAU * self.radian / (8.0 * radius)).sqrt() } else { f64::INFINITY }
    }
}

impl Mechanism {
    /// The rows that couple.
    fn coupled_rows(&self) -> impl Iterator<Item = (usize, &Coupling)> {
        let coupled = self.rows.iter().enumerate().filter(|(_, row)| row.is_coupled);
        coupled.filter_map(|(k, row)| Some((k, self.joints[row.joint].coupling.as_ref()?)))
    }

    /// The joints whose couplings slide along an axis, in the order of their commands after those of the drives.
    pub(crate) fn sliding(&self) -> impl Iterator<Item = (usize, &Coupling, usize)> {
        let joints = self.joints.iter().enumerate();
        joints.filter_map(|(number, joint)| {
            let coupling = joint.coupling.as_ref()?;
            Some((number, coupling, coupling.slides()?))
        })
    }

    /// How far a joint has slid along an axis that its first body carries.
    pub(crate) fn slid(&self, joint: usize, axis: usize, poses: &[Pose<f64>], parameters: &[f64]) -> f64 {
        dot(self.carried(joint, false, axis, poses), self.between(joint, poses, parameters))
    }

    /// From a joint's first point to its second.
    fn between<S: Real>(&self, joint: usize, poses: &[Pose<S>], parameters: &[S]) -> Vec3<S> {
        let joint = &self.joints[joint];
        sub(self.place(joint.second, poses, parameters).position, self.place(joint.first, poses, parameters).position)
    }

    /// The line of centres in the axes of a body, `(x, y)`, and these axes.
    fn seen<S: Real>(&self, joint: usize, second: bool, c: Vec3<S>, poses: &[Pose<S>]) -> ([S; 2], [Vec3<S>; 2]) {
        let axes = match self.space {
            Space::Planar => [0, 1],
            Space::Spatial => [1, 2],
        };
        let axes = axes.map(|axis| self.carried(joint, second, axis, poses));
        (axes.map(|axis| dot(c, axis)), axes)
    }

    /// The coupled row of a joint. The commands of couplings that slide tell a displacement near the pose with sine
    /// and cosine of its phase; they may be left out where the residual is not asked for.
    pub(crate) fn coupled_row<S: Real>(
        &self,
        row: &Row,
        poses: &[Pose<S>],
        parameters: &[S],
        commands: &[Command<S>],
    ) -> Coupled<S> {
        let reference = self.sliding().position(|(joint, ..)| joint == row.joint).map(|k| self.n_driven + k);
        let reference = reference.and_then(|k| commands.get(k));
        match &self.joints[row.joint].coupling {
            Some(coupling) => self.coupled(row, coupling, reference, poses, parameters),
            None => Coupled { residual: S::from_f64(0.0), rate: Rate::zero(), slope: S::from_f64(1.0) },
        }
    }

    fn coupled<S: Real>(
        &self,
        row: &Row,
        coupling: &Coupling,
        reference: Option<&Command<S>>,
        poses: &[Pose<S>],
        parameters: &[S],
    ) -> Coupled<S> {
        let play = row.displaced(parameters);
        let (one, radian) = (S::from_f64(1.0), S::from_f64(coupling.radian));
        let c = self.between(row.joint, poses, parameters);
        let (mut phase, mut rate) = ((S::from_f64(-coupling.start.0), S::from_f64(coupling.start.1)), Rate::zero());
        for &(measure, coefficient) in &coupling.terms {
            let (turned, of_measure) = match measure {
                Measure::Bearing { second } => {
                    let ([x, y], [s, n]) = self.seen(row.joint, second, c, poses);
                    let across = scale(sub(scale(n, x), scale(s, y)), one / (x * x + y * y));
                    let unit = S::from_f64(1.0 / coupling.distance);
                    let mut rate = Rate { linear: across, ..Rate::zero() };
                    let own = cross(across, c);
                    if second {
                        rate.second = own
                    } else {
                        rate.first = own
                    }
                    (multiple((y * unit, x * unit), coupling.times(coefficient)), rate)
                }
                Measure::Roll => {
                    let axis = self.joints[row.joint].turning_axis();
                    let gradient = self.rotation_gradient(row.joint, axis, poses);
                    let rate = Rate { first: gradient.map(|g| -g), second: gradient, ..Rate::zero() };
                    (multiple(self.roll(row.joint, axis, poses), coupling.times(coefficient)), rate)
                }
                Measure::Along(axis) => {
                    let e = self.carried(row.joint, false, axis, poses);
                    let rate = Rate { linear: e, first: cross(e, c), ..Rate::zero() };
                    let slid = dot(e, c);
                    let turned = reference.map_or_else(
                        || (slid / radian).wide_sin_cos(),
                        |r| turn_on(((slid - r.value) / radian).wide_sin_cos(), (r.sine, r.cosine)),
                    );
                    (turned, rate)
                }
            };
            phase = turn_on(phase, turned);
            rate = rate.plus(S::from_f64(coefficient), of_measure);
        }
        let (mut slope, mut taken) = (one, play);
        if let (Some(between), Some(opening)) = (&row.play, &coupling.opening) {
            let centre = S::from_f64(between.centre);
            let side = (play - centre) * S::from_f64(1.0 / between.half);
            let (opened, of_opening) = self.opened(row.joint, opening, c, poses);
            slope = one + opened * S::from_f64(1.0 / between.half);
            taken = centre + (play - centre) * slope;
            rate = rate.plus(-side, of_opening);
        }
        let (sine, cosine) = turn_back(phase, (row.shifted(taken, parameters) / radian).wide_sin_cos());
        Coupled { residual: radian * S::small_angle(sine, cosine), rate, slope }
    }

    /// What the terms of all coupled rows measure, one after the other; angles up to full turns.
    fn through(&self, coordinates: &[f64], parameters: &[f64]) -> Vec<f64> {
        if self.coupled_rows().next().is_none() {
            return Vec::new();
        }
        let poses = self.poses(coordinates);
        let of = |joint: usize, measure: Measure| match measure {
            Measure::Bearing { second } => {
                let ([x, y], _) = self.seen(joint, second, self.between(joint, &poses, parameters), &poses);
                y.atan2(x)
            }
            Measure::Roll => {
                let (sine, cosine) = self.roll(joint, self.joints[joint].turning_axis(), &poses);
                sine.atan2(cosine)
            }
            Measure::Along(axis) => self.slid(joint, axis, &poses, parameters),
        };
        let coupled = self.coupled_rows().map(|(row, coupling)| (self.rows[row].joint, coupling));
        coupled.flat_map(|(joint, coupling)| coupling.terms.iter().map(move |term| of(joint, term.0))).collect()
    }

    /// By how much each flank has moved away from the other.
    fn opened<S: Real>(&self, joint: usize, opening: &Opening, c: Vec3<S>, poses: &[Pose<S>]) -> (S, Rate<S>) {
        match *opening {
            Opening::Height { axis, slope, start } => {
                let e = self.carried(joint, false, axis, poses);
                let (slope, linear) = (S::from_f64(slope), Rate { linear: e, first: cross(e, c), ..Rate::zero() });
                (slope * dot(e, c) - S::from_f64(start), Rate::zero().plus(slope, linear))
            }
            Opening::Distance { factor, base, start } => {
                let ([x, y], [s, n]) = self.seen(joint, false, c, poses);
                let (base, begun) = (S::from_f64(base), S::from_f64(start));
                let square = x * x + y * y;
                let rho = (square - base * base).root(start);
                let tangent = base * (rho - begun) / (base * base + rho * begun);
                let arc = S::from_f64(0.5) * tangent * S::double_arc(tangent * tangent);
                let factor = S::from_f64(factor);
                // Along the line of centres, times its length.
                let radial = add(scale(s, x), scale(n, y));
                let rate = Rate { linear: radial, first: cross(radial, c), ..Rate::zero() };
                (factor * (rho - begun - base * arc), Rate::zero().plus(factor * rho / square, rate))
            }
        }
    }

    /// Fixes what a coupling takes from the pose that it begins in: the distance of its centres, on which side of
    /// its rack a pinion is, and the phase in which its teeth mesh.
    pub(crate) fn begin(&mut self, joint: usize, marks: Option<[f64; 2]>) {
        let Some(mut coupling) = self.joints[joint].coupling.take() else { return };
        let poses = self.poses(&self.guess());
        let parameters = vec![0.0; self.n_parameters()];
        let c = self.between(joint, &poses, &parameters);
        let ([x, y], _) = self.seen(joint, false, c, &poses);
        match &mut coupling.opening {
            Some(Opening::Distance { base, start, .. }) if coupling.distance.is_nan() => {
                coupling.distance = x.hypot(y);
                *start = (coupling.distance * coupling.distance - *base * *base).sqrt();
            }
            Some(Opening::Height { slope, .. }) if y < 0.0 => {
                *slope = -*slope;
                coupling.terms[1].1 = -coupling.terms[1].1;
            }
            _ => {}
        }
        let phase = match marks {
            Some(marks) => coupling.terms.iter().zip(marks).map(|(term, mark)| term.1 * mark).sum::<f64>(),
            None => {
                let row = Row::of(joint, Component::Along(0));
                self.coupled(&row, &coupling, None, &poses, &parameters).residual
            }
        };
        coupling.start = (phase / coupling.radian).sin_cos();
        self.joints[joint].coupling = Some(coupling);
    }
}

#[cfg(test)]
mod tests;
