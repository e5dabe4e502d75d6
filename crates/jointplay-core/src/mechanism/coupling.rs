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
//! | crossed gear pair | k1 (facing on body 1) + k2 (facing on body 2) + lie | pitch x gcd(z1, z2) | lie |
//!
//! The bearing is the angle at which a body sees the line of centres c from point 1 to point 2, in the plane of
//! its axes that the joint turns in; `rho^2 = c^2 - b^2`. Gear and belt open by the same function, the involute of
//! the base circles. r2 is negative for a ring around body 1. Angles enter by sine and cosine of their whole
//! multiples, so that R has one value in each pose; which tooth meshes follows from continuity along a path.
//!
//! Axes a1 and a2 of a crossed gear pair are not parallel. A body faces the other one's axis at an angle in the plane
//! that it turns in. Two turns apart, how two lines with a point each lie to each other is told by the four numbers
//! `a1.d`, `a2.d`, `(a1 x a2).d` and `a1.a2`, where d goes from point 1 to point 2; a lie is linear in them. Both flanks
//! push along a wrench through the pitch point, which k1, k2 and the factors of a lie follow from: R goes by the mean of
//! the two, E by half their difference, with equal moments about each axis.
//!
//! Both flanks touch at R = 0. Play u between them, of half-width h about a centre, widens by the opening E on
//! each side:
//!
//! ```text
//! R - ratio error - [centre + (u - centre) (1 + E / h)] = 0
//! ```
//!
//! An elastic deformation adds to u, and what is beyond the play counts as it is. Where `1 + E / h` is below zero the flanks would pass through each other: the mechanism cannot be assembled. At
//! either end of the play the derivative along the twists is the line of action of the flank that carries,
//! since `d(R -+ E)` is what its force works on.

use crate::math::real::Real;
use crate::math::rotation::{turn_back, turn_on, turn_times};
use crate::math::vector::{Vec3, add, cross, dot, norm, scale, sub};
use crate::mechanism::kind::JointKind;
use crate::mechanism::spec::{ContactSpec, CouplingSpec};

/// What a term of a coupling measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Measure {
    /// The angle at which the first body (or the second) sees the line of centres.
    Bearing { second: bool },
    /// The angle of the second body relative to the first.
    Roll,
    /// The displacement along an axis, as [`Pair`] has them.
    Along(usize),
    /// The angle at which the first body (or the second) sees the other one's axis.
    Facing { second: bool },
    /// How the axes lie to each other.
    Lie(Lie),
}

impl Measure {
    /// Whether it is an angle, known up to full turns.
    pub(crate) const fn turns(self) -> bool {
        matches!(self, Self::Bearing { .. } | Self::Roll | Self::Facing { .. })
    }
}

/// A length that is linear in how two axes a1 and a2 lie to each other, their points apart by d:
/// `along1 (a1.d) + along2 (a2.d) + across (a1 x a2).d + turned (a1.a2) - start`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lie {
    along: [f64; 2],
    across: f64,
    turned: f64,
    start: f64,
}

/// By how much each flank moves away from the other.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Opening {
    /// With the distance of the centres: `factor [rho - base atan(rho / base)]`, less its value at `start`.
    Distance { factor: f64, base: f64, start: f64 },
    /// With the displacement along an axis, as [`Pair`] has them: `slope x displacement - start`.
    Height { axis: usize, slope: f64, start: f64 },
    /// As the axes lie to each other.
    Lie(Lie),
}

/// The coupled row of a joint.
#[derive(Clone, Debug)]
pub(crate) struct Coupling {
    /// What its row holds, by name.
    pub name: &'static str,
    /// Measures with their coefficients, lengths for angles.
    pub terms: Vec<(Measure, f64)>,
    /// The length of one radian of phase: the period is a full turn of it.
    pub radian: f64,
    /// The distance of the centres, which gives bearings about unit size.
    pub distance: f64,
    /// The play on each side must be below this: half of the gap between two teeth, or a quarter of the period.
    pub largest_play: f64,
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

impl Play {
    /// An offset as far on the other side of the centre.
    pub(crate) fn mirrored(&self, offset: f64) -> f64 {
        2.0 * self.centre - offset
    }

    /// Whether two offsets are towards opposite flanks.
    pub(crate) fn parts(&self, a: f64, b: f64) -> bool {
        (a - self.centre) * (b - self.centre) < -0.25 * self.half * self.half
    }
}

/// The rate of a quantity of two bodies: `linear . (velocity of point 2 - of point 1) + first . w1 + second . w2`.
#[derive(Clone, Copy)]
pub(crate) struct Rate<S> {
    pub linear: Vec3<S>,
    pub first: Vec3<S>,
    pub second: Vec3<S>,
}

impl<S: Real> Rate<S> {
    pub(crate) fn zero() -> Self {
        let zero = [S::from_f64(0.0); 3];
        Self { linear: zero, first: zero, second: zero }
    }

    pub(crate) fn plus(self, factor: S, other: Self) -> Self {
        let sum = |a, b| add(a, scale(b, factor));
        Self {
            linear: sum(self.linear, other.linear),
            first: sum(self.first, other.first),
            second: sum(self.second, other.second),
        }
    }
}

/// Two bodies as a coupling sees them, in ground axes.
#[derive(Clone, Copy)]
pub(crate) struct Pair<S> {
    /// From the first point to the second.
    pub apart: Vec3<S>,
    /// The joint's axes as both bodies carry them: the axis of turning after the plane that it turns in.
    pub axes: [[Vec3<S>; 3]; 2],
}

/// A displacement near the one in question, with sine and cosine of its phase.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reference<S> {
    pub value: S,
    pub sine: S,
    pub cosine: S,
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl Coupling {
    /// The coupling of a joint, where its kind is one.
    pub(crate) fn new(kind: JointKind, spec: &CouplingSpec) -> Result<Self, &'static str> {
        let turns = std::f64::consts::TAU;
        let [r1, r2] = spec.radii;
        let right = |r: f64| r.is_finite() && r > 0.0;
        let angled = spec.pressure_angle >= 0.0 && spec.pressure_angle < 0.25 * turns;
        if kind == JointKind::Screw {
            if !spec.lead.is_finite() || spec.lead == 0.0 {
                return Err("needs a lead other than zero");
            }
            return Ok(Self {
                name: "along",
                terms: vec![(Measure::Along(2), 1.0), (Measure::Roll, -spec.lead / turns)],
                radian: spec.lead.abs() / turns,
                distance: 1.0,
                largest_play: 0.25 * spec.lead.abs(),
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
                name: "flank",
                terms: vec![(Measure::Along(0), 1.0), (Measure::Roll, r1)],
                radian: r1,
                distance: 1.0,
                largest_play: 0.25 * turns * r1,
                start: (0.0, 1.0),
                opening: Some(Opening::Height { axis: 1, slope, start: slope * r1 }),
            });
        }
        if kind == JointKind::CrossedGear {
            return Self::crossed(spec);
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
        let common = f64::from(gcd(z1, z2));
        Ok(Self {
            name: if is_belt { "strand" } else { "flank" },
            terms: vec![(Measure::Bearing { second: false }, -r1), (Measure::Bearing { second: true }, -r2)],
            radian: r1 * common / f64::from(z1),
            distance,
            largest_play: 0.25 * turns * r1 / f64::from(z1) * if is_belt { common } else { 1.0 },
            start: (0.0, 1.0),
            opening: Some(Opening::Distance { factor, base, start: (distance * distance - base * base).sqrt() }),
        })
    }

    /// Wheels whose axes are not parallel.
    fn crossed(spec: &CouplingSpec) -> Result<Self, &'static str> {
        let ([z1, z2], Some(contact)) = (spec.teeth, &spec.contact) else {
            return Err("needs how its wheels touch");
        };
        let radius = spec.radii[1];
        if z1 == 0 || z2 == 0 || !(radius.is_finite() && radius > 0.0) {
            return Err("needs tooth counts and the pitch radius of its second wheel");
        }
        let [a, b] = contact.axes;
        let sine = norm(&cross(a, b));
        if (norm(&a) - 1.0).abs() > 1e-9 || (norm(&b) - 1.0).abs() > 1e-9 || sine.is_nan() || sine < 1e-3 {
            return Err("needs axes of unit size that are not parallel");
        }
        let (push, facing) = contact.parts(contact.normal);
        let (opening, of_opening) = contact.parts(contact.opening);
        let common = f64::from(gcd(z1, z2));
        let radian = radius * common / f64::from(z2);
        let near = |moment: f64, z: u32| (moment.abs() - radian * f64::from(z) / common).abs() <= 1e-6 * moment.abs();
        if !near(facing[0], z1) || !near(facing[1], z2) || of_opening.iter().any(|moment| moment.abs() > 1e-6 * radius)
        {
            return Err("has flanks that do not move in the ratio of its tooth counts");
        }
        let exact = |moment: f64, z: u32| moment.signum() * radian * f64::from(z) / common;
        Ok(Self {
            name: "flank",
            terms: vec![
                (Measure::Facing { second: false }, exact(facing[0], z1)),
                (Measure::Facing { second: true }, exact(facing[1], z2)),
                (Measure::Lie(push), 1.0),
            ],
            radian,
            distance: sine,
            largest_play: 0.25 * std::f64::consts::TAU * radius / f64::from(z2),
            start: (0.0, 1.0),
            opening: Some(Opening::Lie(opening)),
        })
    }

    /// The term that is a displacement, whose phase needs a reference in a recorded program.
    pub(crate) fn slides(&self) -> Option<Measure> {
        self.terms.iter().map(|term| term.0).find(|measure| !measure.turns())
    }

    /// Play up to this is none: the rounding of a pose would decide whether the flanks pass through each other.
    pub(crate) fn rounding(&self) -> f64 {
        1e-10 * self.radian
    }

    fn times(&self, coefficient: f64) -> i32 {
        (coefficient / self.radian).round() as i32
    }

    /// The largest move of the bodies (length-scaled; radians) in which no tooth is skipped: what the bearings
    /// bend in it is of second order and stays within an eighth of the period.
    pub(crate) fn largest_move(&self) -> f64 {
        let bends = |&(measure, r): &(Measure, f64)| match measure {
            Measure::Bearing { .. } | Measure::Facing { .. } => r.abs(),
            Measure::Roll | Measure::Along(_) | Measure::Lie(_) => 0.0,
        };
        let radius: f64 = self.terms.iter().map(bends).sum();
        if radius > 0.0 { (std::f64::consts::TAU * self.radian / (8.0 * radius)).sqrt() } else { f64::INFINITY }
    }

    /// Fixes what is taken from the pose that it begins in: the distance of its centres, on which side of its rack a
    /// pinion is, and the phase in which its teeth mesh.
    pub(crate) fn begin(&mut self, pair: &Pair<f64>, marks: Option<[f64; 2]>) {
        let [x, y] = pair.seen(false);
        match &mut self.opening {
            Some(Opening::Distance { base, start, .. }) if self.distance.is_nan() => {
                self.distance = x.hypot(y);
                *start = (self.distance * self.distance - *base * *base).sqrt();
            }
            Some(Opening::Height { slope, .. }) if y < 0.0 => {
                *slope = -*slope;
                self.terms[1].1 = -self.terms[1].1;
            }
            _ => {}
        }
        let marked =
            |marks: [f64; 2]| self.terms.iter().zip(marks).map(|(term, mark)| term.1 * mark / self.radian).sum();
        let phase: f64 = marks.map_or_else(
            || {
                let (sine, cosine) = self.phase(pair, None).0;
                sine.atan2(cosine)
            },
            marked,
        );
        self.start = phase.sin_cos();
    }

    /// Sine and cosine of its phase, and the rate of that as a length.
    pub(crate) fn phase<S: Real>(&self, pair: &Pair<S>, reference: Option<&Reference<S>>) -> ((S, S), Rate<S>) {
        let mut phase = (S::from_f64(-self.start.0), S::from_f64(self.start.1));
        let mut rate = Rate::zero();
        for &(measure, coefficient) in &self.terms {
            let turned = match measure {
                Measure::Bearing { second } => {
                    let unit = S::from_f64(1.0 / self.distance);
                    let [x, y] = pair.seen(second);
                    turn_times((y * unit, x * unit), self.times(coefficient))
                }
                Measure::Roll => turn_times(pair.roll(), self.times(coefficient)),
                Measure::Facing { second } => {
                    let unit = S::from_f64(1.0 / self.distance);
                    let [x, y] = pair.faced(second);
                    turn_times((y * unit, x * unit), self.times(coefficient))
                }
                Measure::Along(_) | Measure::Lie(_) => {
                    let slid = pair.measure(measure);
                    let radian = S::from_f64(self.radian);
                    reference.map_or_else(
                        || (slid / radian).wide_sin_cos(),
                        |r| turn_on(((slid - r.value) / radian).wide_sin_cos(), (r.sine, r.cosine)),
                    )
                }
            };
            phase = turn_on(phase, turned);
            rate = rate.plus(S::from_f64(coefficient), pair.rate(measure));
        }
        (phase, rate)
    }

    /// The coupled row for a play and what shifts it beside.
    pub(crate) fn row<S: Real>(
        &self,
        pair: &Pair<S>,
        reference: Option<&Reference<S>>,
        between: Option<Play>,
        play: S,
        shifted: impl Fn(S) -> S,
    ) -> Coupled<S> {
        let radian = S::from_f64(self.radian);
        let (phase, mut rate) = self.phase(pair, reference);
        let (mut slope, mut gap, mut taken) = (S::from_f64(1.0), S::from_f64(1.0), play);
        let mut opening_rate = Rate::zero();
        if let (Some(between), Some(opening)) = (between, &self.opening) {
            let (centre, part) = (S::from_f64(between.centre), S::from_f64(1.0 / between.half));
            let (opened, of_opening) = opening.at(pair);
            // What gives way elastically beyond the play is on the flank.
            let (side, inside) = ((play - centre) * part).within_one();
            gap = slope + opened * part;
            slope = slope + inside * opened * part;
            taken = play + side * opened;
            rate = rate.plus(-side, of_opening);
            opening_rate = of_opening;
        }
        let (sine, cosine) = turn_back(phase, (shifted(taken) / radian).wide_sin_cos());
        Coupled { residual: radian * S::wide_angle(sine, cosine), rate, opening_rate, slope, gap }
    }
}

/// A coupled row at a pose.
pub(crate) struct Coupled<S> {
    pub residual: S,
    /// Its rate at the flank where the play is.
    pub rate: Rate<S>,
    /// The rate at which each flank moves away from the other.
    pub opening_rate: Rate<S>,
    /// What its own parameter counts.
    pub slope: S,
    /// The play as a part of what it is between wheels in their places; below zero they cannot be there.
    pub gap: S,
}

impl<S: Real> Pair<S> {
    /// The line of centres in the plane of the axes of the first body (or the second).
    pub(crate) fn seen(&self, second: bool) -> [S; 2] {
        let [x, y, _] = self.axes[usize::from(second)];
        [dot(self.apart, x), dot(self.apart, y)]
    }

    /// The other body's axis in the plane of the axes of the first body (or the second).
    fn faced(&self, second: bool) -> [S; 2] {
        let ([x, y, _], [.., axis]) = (self.axes[usize::from(second)], self.axes[usize::from(!second)]);
        [dot(axis, x), dot(axis, y)]
    }

    /// Sine and cosine (times one positive number) of the roll.
    fn roll(&self) -> (S, S) {
        let [[x, y, _], [turned, ..]] = self.axes;
        (dot(y, turned), dot(x, turned))
    }

    /// The displacement along an axis, by its place here.
    pub(crate) fn slid(&self, axis: usize) -> S {
        dot(self.axes[0][axis], self.apart)
    }

    /// What a term measures, angles up to full turns.
    pub(crate) fn measure(&self, measure: Measure) -> S {
        let angle = |(sine, cosine)| S::small_angle(sine, cosine);
        match measure {
            Measure::Bearing { second } => {
                let [x, y] = self.seen(second);
                angle((y, x))
            }
            Measure::Roll => angle(self.roll()),
            Measure::Along(axis) => self.slid(axis),
            Measure::Facing { second } => {
                let [x, y] = self.faced(second);
                angle((y, x))
            }
            Measure::Lie(lie) => lie.of(self),
        }
    }

    /// The rate of what a term measures.
    pub(crate) fn rate(&self, measure: Measure) -> Rate<S> {
        let one = S::from_f64(1.0);
        match measure {
            Measure::Bearing { second } => {
                let ([x, y], [s, n, _]) = (self.seen(second), self.axes[usize::from(second)]);
                let across = scale(sub(scale(n, x), scale(s, y)), one / (x * x + y * y));
                let (own, other) = (cross(across, self.apart), Rate::<S>::zero().first);
                let [first, second] = if second { [other, own] } else { [own, other] };
                Rate { linear: across, first, second }
            }
            Measure::Roll => {
                let ((sine, cosine), [[x, y, _], [turned, ..]]) = (self.roll(), self.axes);
                let across = sub(scale(y, cosine), scale(x, sine));
                let gradient = scale(cross(turned, across), one / (cosine * cosine + sine * sine));
                Rate { first: gradient.map(|g| -g), second: gradient, ..Rate::zero() }
            }
            Measure::Along(axis) => self.sliding(self.axes[0][axis]),
            Measure::Facing { second } => {
                let ([x, y], [s, n, _]) = (self.faced(second), self.axes[usize::from(second)]);
                let across = scale(sub(scale(n, x), scale(s, y)), one / (x * x + y * y));
                let own = cross(across, self.axes[usize::from(!second)][2]);
                let other = own.map(|v| -v);
                let [first, second] = if second { [other, own] } else { [own, other] };
                Rate { first, second, ..Rate::zero() }
            }
            Measure::Lie(lie) => lie.rate(self),
        }
    }

    /// The rate of the displacement along a direction that the first body carries.
    fn sliding(&self, direction: Vec3<S>) -> Rate<S> {
        Rate { linear: direction, first: cross(direction, self.apart), ..Rate::zero() }
    }
}

impl Lie {
    fn of<S: Real>(&self, pair: &Pair<S>) -> S {
        let ([[.., a], [.., b]], apart) = (pair.axes, pair.apart);
        let along: [S; 2] = [0, 1].map(|k| S::from_f64(self.along[k]) * dot(pair.axes[k][2], apart));
        let across = S::from_f64(self.across) * dot(cross(a, b), apart);
        along[0] + along[1] + across + (S::from_f64(self.turned) * dot(a, b) - S::from_f64(self.start))
    }

    fn rate<S: Real>(&self, pair: &Pair<S>) -> Rate<S> {
        let ([[.., a], [.., b]], apart) = (pair.axes, pair.apart);
        let [along, of_second, across, turned] =
            [self.along[0], self.along[1], self.across, self.turned].map(S::from_f64);
        let normal = cross(a, b);
        Rate {
            linear: add(add(scale(a, along), scale(b, of_second)), scale(normal, across)),
            first: add(
                scale(cross(a, apart), along),
                add(scale(cross(a, cross(b, apart)), across), scale(normal, turned)),
            ),
            second: add(
                scale(cross(b, apart), of_second),
                sub(scale(cross(b, cross(apart, a)), across), scale(normal, turned)),
            ),
        }
    }
}

impl ContactSpec {
    /// A force on the second wheel at the pitch point, and its opposite on the first, as the change of a lie and of the
    /// angles at which the wheels face each other:
    ///
    /// ```text
    /// n = f1 a1 + f2 a2 + g m,     m = a1 x a2,   f1 = [a1 - (a1.a2) a2].n / m.m, ...,   g = m.n / m.m
    /// (C - P2) x n - f2 a2 x d - g a2 x (d x a1) = k1 (a2 x m) / m.m + k2 (a1 x m) / m.m - h m
    /// ```
    fn parts(&self, n: [f64; 3]) -> (Lie, [f64; 2]) {
        let ([a, b], d) = (self.axes, self.apart);
        let (m, cosine) = (cross(a, b), dot(a, b));
        let square = dot(m, m);
        let along = [dot(sub(a, scale(b, cosine)), n) / square, dot(sub(b, scale(a, cosine)), n) / square];
        let across = dot(m, n) / square;
        let moment = cross(sub(self.at, d), n);
        let left = sub(moment, add(scale(cross(b, d), along[1]), scale(cross(b, cross(d, a)), across)));
        let turned = -dot(m, left) / square;
        let start = along[0] * dot(a, d) + along[1] * dot(b, d) + across * dot(m, d) + turned * cosine;
        (Lie { along, across, turned, start }, [dot(a, left), -dot(b, left)])
    }
}

impl Opening {
    /// By how much each flank has moved away from the other.
    fn at<S: Real>(&self, pair: &Pair<S>) -> (S, Rate<S>) {
        match *self {
            Self::Lie(lie) => (lie.of(pair), lie.rate(pair)),
            Self::Height { axis, slope, start } => {
                let slope = S::from_f64(slope);
                let opened = slope * pair.slid(axis) - S::from_f64(start);
                (opened, Rate::zero().plus(slope, pair.sliding(pair.axes[0][axis])))
            }
            Self::Distance { factor, base, start } => {
                let ([x, y], [s, n, _]) = (pair.seen(false), pair.axes[0]);
                let (base, begun) = (S::from_f64(base), S::from_f64(start));
                let square = x * x + y * y;
                let rho = (square - base * base).root(start);
                let tangent = base * (rho - begun) / (base * base + rho * begun);
                let arc = S::from_f64(0.5) * tangent * S::double_arc(tangent * tangent);
                let factor = S::from_f64(factor);
                // Along the line of centres, times its length.
                let radial = pair.sliding(add(scale(s, x), scale(n, y)));
                (factor * (rho - begun - base * arc), Rate::zero().plus(factor * rho / square, radial))
            }
        }
    }
}
