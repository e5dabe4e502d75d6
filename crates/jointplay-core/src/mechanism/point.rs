//! Points of bodies, with the axes of the joints that sit there, and what displaces them.
//!
//! A displacement turns by a rotation vector v about a centre c and shifts by t, both linear in the parameters u:
//!
//! ```text
//! x -> c + R(v) (x - c) + t,    a -> R(v) a,    v = sum u_k about_k,    t = sum u_k along_k
//! dx = w x (R(v) (x - c)) du_k + along_k du_k,    da = w x a du_k,    w = J(v) about_k
//! ```
//!
//! for a point x and an axis a in body axes, with J the left Jacobian of the exponential map. Those of a point follow
//! each other, in the order in which they are listed.

use crate::math::real::Real;
use crate::math::rotation::Turn;
use crate::math::vector::{Vec3, add, cross, dot, scale, sub};

/// What a parameter does in a displacement, per unit of it, in body axes.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// The parameter.
    pub parameter: usize,
    /// Translation.
    pub along: Vec3<f64>,
    /// Rotation vector.
    pub about: Vec3<f64>,
}

impl Way {
    /// Whether it turns.
    pub(crate) fn turns(&self) -> bool {
        self.about.iter().any(|v| *v != 0.0)
    }
}

/// A rigid displacement.
#[derive(Clone, Debug, Default)]
pub struct Displacement {
    /// Which one of the specification it is; that of a dimension is none of these.
    pub number: Option<usize>,
    /// What turns about this point stays there.
    pub centre: Vec3<f64>,
    /// What it consists of.
    pub ways: Vec<Way>,
}

impl Displacement {
    fn turns(&self) -> bool {
        self.ways.iter().any(Way::turns)
    }

    fn turn<S: Real>(&self, parameters: &[S]) -> Turn<S> {
        let turning = self.ways.iter().filter(|way| way.turns());
        Turn::new(
            turning.fold([S::from_f64(0.0); 3], |v, way| add(v, scale(constant(way.about), parameters[way.parameter]))),
        )
    }

    fn shifted<S: Real>(&self, at: Vec3<S>, parameters: &[S]) -> Vec3<S> {
        let shifting = self.ways.iter().filter(|way| way.along.iter().any(|v| *v != 0.0));
        shifting.fold(at, |at, way| add(at, scale(constant(way.along), parameters[way.parameter])))
    }

    /// From the centre to where a point has been turned.
    fn arm<S: Real>(&self, at: Vec3<S>, turn: &Turn<S>) -> Vec3<S> {
        turn.of(sub(at, constant(self.centre)))
    }

    fn of<S: Real>(&self, at: Vec3<S>, parameters: &[S]) -> Vec3<S> {
        let turned = if self.turns() { add(constant(self.centre), self.arm(at, &self.turn(parameters))) } else { at };
        self.shifted(turned, parameters)
    }
}

/// A point fixed to a body, which deviations may displace.
#[derive(Clone, Debug)]
pub struct Point {
    /// The body that carries it.
    pub body: Option<usize>,
    /// Nominal position in body axes.
    pub at: Vec3<f64>,
    /// What displaces it, one after the other.
    pub displaced_by: Vec<Displacement>,
}

/// What a parameter does to a point and to the axes there: velocity and rotation, in body axes.
pub(crate) type Rates<S> = Vec<(usize, [Vec3<S>; 2])>;

pub(crate) fn constant<S: Real>(v: Vec3<f64>) -> Vec3<S> {
    v.map(S::from_f64)
}

impl Point {
    /// Whether any parameter displaces it or turns the axes there.
    pub(crate) fn moves(&self) -> bool {
        self.displaced_by.iter().any(|displacement| !displacement.ways.is_empty())
    }

    /// Whether any parameter turns the axes there.
    pub(crate) fn turns(&self) -> bool {
        self.displaced_by.iter().any(Displacement::turns)
    }

    /// Lets a parameter shift it, after everything that turns it.
    pub(crate) fn shift(&mut self, parameter: usize, along: Vec3<f64>) {
        let way = Way { parameter, along, about: [0.0; 3] };
        match self.displaced_by.last_mut() {
            Some(last) if !last.turns() => last.ways.push(way),
            _ => self.displaced_by.push(Displacement { ways: vec![way], ..Displacement::default() }),
        }
    }

    /// Lets parameters from `first` on take part in a displacement of the specification, by translation and rotation
    /// vector each.
    pub(crate) fn take_part(&mut self, displacement: usize, first: usize, ways: &[[Vec3<f64>; 2]]) {
        for own in self.displaced_by.iter_mut().filter(|own| own.number == Some(displacement)) {
            own.ways.extend((first..).zip(ways).map(|(parameter, &[along, about])| Way { parameter, along, about }));
        }
    }

    /// Where it is, in body axes.
    pub(crate) fn place<S: Real>(&self, parameters: &[S]) -> Vec3<S> {
        self.displaced_by.iter().fold(constant(self.at), |at, displacement| displacement.of(at, parameters))
    }

    /// An axis of a joint that sits there, in body axes.
    pub(crate) fn axis<S: Real>(&self, axis: Vec3<f64>, parameters: &[S]) -> Vec3<S> {
        let turning = self.displaced_by.iter().filter(|displacement| displacement.turns());
        turning.fold(constant(axis), |axis, displacement| displacement.turn(parameters).of(axis))
    }

    /// What every parameter does to it.
    pub(crate) fn rates<S: Real>(&self, parameters: &[S]) -> Rates<S> {
        let none = [S::from_f64(0.0); 3];
        let (mut at, mut rates): (Vec3<S>, Rates<S>) = (constant(self.at), Vec::new());
        for displacement in &self.displaced_by {
            if !displacement.turns() {
                rates.extend(displacement.ways.iter().map(|way| (way.parameter, [constant(way.along), none])));
                at = displacement.shifted(at, parameters);
                continue;
            }
            let turn = displacement.turn(parameters);
            let arm = displacement.arm(at, &turn);
            for (_, rate) in &mut rates {
                *rate = rate.map(|v| turn.of(v));
            }
            rates.extend(displacement.ways.iter().map(|way| {
                let rotation = turn.rate(constant(way.about));
                (way.parameter, [add(constant(way.along), cross(rotation, arm)), rotation])
            }));
            at = displacement.of(at, parameters);
        }
        rates
    }

    /// The angle that a parameter turns the axes there by, per unit of it.
    pub(crate) fn turned_by(&self, parameter: usize) -> f64 {
        let ways = self.displaced_by.iter().flat_map(|displacement| &displacement.ways);
        ways.filter(|way| way.parameter == parameter).map(|way| dot(way.about, way.about).sqrt()).fold(0.0, f64::max)
    }
}
