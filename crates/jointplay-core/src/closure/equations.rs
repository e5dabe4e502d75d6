//! Loop closure: residual and Jacobian of all joints at once.
//!
//! The unknowns are the twists of all bodies (ground axes, each at its body's origin). Row k of a
//! joint between points P1 and P2 reads
//!
//! ```text
//! translation:  e . (P2 - P1) - (drive + parameter) = 0
//! roll:         angle from a_j to b_j about a_i - (drive + parameter) = 0     (j after i)
//! tilt:         (a_0 x b_0) . a_i - parameter = 0                               (in space)
//! ```
//!
//! with e an axis of the joint, fixed to the ground or to body 1, and a, b the joint's axes as bodies 1
//! and 2 carry them. The roll is about the joint's axis (in the plane: out of the plane) and seen along
//! it. A tilt is the sine of the angle between the two axes, so that the end of a pin of half length L
//! is off by exactly L times it. With `rho_i = P_i - origin of body i` and `d = P2 - P1` the derivatives
//! along the twists (v1, w1), (v2, w2) are
//!
//! ```text
//! translation:  e.v2 + (rho2 x e).w2 - e.v1 - (rho1 x e).w1 + (e x d).w1      (last term when e is fixed to body 1)
//! roll:         (b_j x (C a_k - S a_j)) / (C^2 + S^2) . (w2 - w1)             S = a_k.b_j, C = a_j.b_j
//! tilt:         (a_2 x b_0) . (w2 - w1)  and  (b_0 x a_1) . (w2 - w1)
//! ```
//!
//! The spin of a ball joint that is settled is its roll where the axes may tilt by any angle but half a turn: what
//! remains of the rotation when its swing from `a_0` to `b_0` is taken away,
//!
//! ```text
//! S = a_2.b_1 - a_1.b_2,  C = a_1.b_1 + a_2.b_2        derivative: (a_0 + b_0) / (1 + a_0.b_0) . (w2 - w1)
//! ```
//!
//! A row that follows another joint (see [`crate::closure::follower`]) has the derivatives along that joint's bodies
//! besides. A row that couples (see [`crate::mechanism::coupling`]) tells its rate as a force on body 2 through P2, the
//! opposite of it on body 1 through P1, and a moment on each. What a drive commands is its value times the row's
//! coefficient.

use std::cell::OnceCell;

use crate::clearance::offset::MAX_SIZE;
use crate::closure::carried::Carried;
use crate::closure::follower::Led;
use crate::math::real::Real;
use crate::math::rotation::turn_back;
use crate::math::space::{Component, Pose, Space};
use crate::math::vector::{Vec3, add, cross, dot, scale, sub};
use crate::mechanism::coupling::{Coupled, Rate};
use crate::mechanism::joint::{Frame, Joint};
use crate::mechanism::point::{Point, Rates};
use crate::mechanism::{Mechanism, Row, Source};

/// What a configuration is asked for: drive values and the values of all parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Inputs<D, P = D> {
    /// One value per drive.
    pub drives: Vec<D>,
    /// One value per parameter: clearance offsets, deviations, drive errors.
    pub parameters: Vec<P>,
}

/// A drive's value with its sine and cosine, whichever its joint asks for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Command<S> {
    pub value: S,
    pub sine: S,
    pub cosine: S,
}

impl<S: Real> Command<S> {
    /// A value that may be any angle.
    fn of(value: S) -> Self {
        let (sine, cosine) = value.wide_sin_cos();
        Self { value, sine, cosine }
    }
}

impl Inputs<f64> {
    /// The inputs as the closure equations take them.
    pub(crate) fn commands(&self, mechanism: &Mechanism) -> Inputs<Command<f64>, f64> {
        mechanism.commands(&self.drives, self.parameters.clone())
    }

    /// Perfect joints and dimensions.
    #[must_use]
    pub fn nominal(mechanism: &Mechanism, drives: &[f64]) -> Self {
        Self { drives: drives.to_vec(), parameters: vec![0.0; mechanism.n_parameters()] }
    }
}

/// A point in ground axes, with its lever arm from the origin of its body.
#[derive(Clone, Copy)]
pub(crate) struct Placed<S> {
    pub position: Vec3<S>,
    pub lever: Vec3<S>,
}

/// What the rows of a joint have in common.
struct Ends<'e, S> {
    mechanism: &'e Mechanism,
    number: usize,
    joint: &'e Joint,
    poses: &'e [Pose<S>],
    parameters: &'e [S],
    /// Its points.
    places: [Placed<S>; 2],
    /// Its axes, where a row asks for them.
    carried: OnceCell<Carried<'e, S>>,
}

impl<'e, S: Real> Ends<'e, S> {
    fn new(mechanism: &'e Mechanism, number: usize, poses: &'e [Pose<S>], parameters: &'e [S]) -> Self {
        let joint = &mechanism.joints[number];
        let places = [joint.first, joint.second].map(|point| mechanism.place(point, poses, parameters));
        Self { mechanism, number, joint, poses, parameters, places, carried: OnceCell::new() }
    }

    fn carried(&self) -> &Carried<'e, S> {
        self.carried.get_or_init(|| self.mechanism.carried_by_both(self.number, self.poses, self.parameters))
    }

    /// The axes of the displacement.
    fn axes(&self) -> [Vec3<S>; 3] {
        match self.joint.frame {
            Frame::Ground => Pose::<S>::identity().rotation,
            Frame::First => self.carried().first,
        }
    }
}

impl Mechanism {
    /// The inputs at given drive values with every deviation at its known value and no play taken.
    pub(crate) fn built(&self, drives: &[f64]) -> Inputs<f64> {
        Inputs { drives: drives.to_vec(), parameters: self.centre.clone() }
    }

    /// The same with the offsets of some sources in the middle of their sets.
    pub(crate) fn in_the_middle(&self, drives: &[f64], which: impl Fn(&Source) -> bool) -> Inputs<f64> {
        let mut inputs = self.built(drives);
        for source in self.sources.iter().filter(|source| which(source)) {
            let middle = source.set.of_unit(&[0.0; MAX_SIZE]);
            source.range().zip(middle).for_each(|(p, offset)| inputs.parameters[p] += offset);
        }
        inputs
    }

    /// The inputs as the closure equations take them.
    pub(crate) fn commands<S: Real>(&self, drives: &[S], parameters: Vec<S>) -> Inputs<Command<S>, S> {
        let driven = self.driven().map(|(_, by)| Command::of(S::from_f64(by.coefficient) * drives[by.drive]));
        // The phases of what slides are given in full.
        let [zero, one] = [0.0, 1.0].map(S::from_f64);
        let slides = self.sliding().map(|_| Command { value: zero, sine: zero, cosine: one });
        Inputs { drives: driven.chain(slides).collect(), parameters }
    }

    /// Where a point is.
    pub(crate) fn place<S: Real>(&self, point: usize, poses: &[Pose<S>], parameters: &[S]) -> Placed<S> {
        let point = &self.points[point];
        let at = point.place(parameters);
        match point.body {
            None => Placed { position: at, lever: at },
            Some(b) => {
                let lever = poses[b].turn(at);
                Placed { position: add(poses[b].position, lever), lever }
            }
        }
    }

    /// Poses of all bodies from their coordinates.
    pub(crate) fn poses(&self, coordinates: &[f64]) -> Vec<Pose<f64>> {
        coordinates.chunks_exact(self.space.n_coordinates()).map(|c| self.space.pose(c)).collect()
    }

    /// The axes of a joint's displacement in ground axes.
    pub(crate) fn axes<S: Real>(&self, joint: usize, poses: &[Pose<S>], parameters: &[S]) -> [Vec3<S>; 3] {
        match self.joints[joint].frame {
            Frame::Ground => Pose::<S>::identity().rotation,
            Frame::First => self.carried(joint, false, poses, parameters),
        }
    }

    /// The vector whose scalar product with `w2 - w1` is the rate of a rotation component.
    pub(crate) fn rotation_gradient<S: Real>(
        &self,
        joint: usize,
        axis: usize,
        poses: &[Pose<S>],
        parameters: &[S],
    ) -> Vec3<S> {
        self.carried_by_both(joint, poses, parameters).rotation_gradient(axis)
    }

    /// The value of a joint component, angles between -pi and pi.
    pub(crate) fn joint_value(&self, row: usize, poses: &[Pose<f64>], parameters: &[f64]) -> f64 {
        let row = &self.rows[row];
        let joint = &self.joints[row.joint];
        match row.component {
            Component::About(i) => {
                let (s, c) = self.carried_by_both(row.joint, poses, parameters).roll(i);
                s.atan2(c)
            }
            Component::Along(i) => {
                let d = sub(
                    self.place(joint.second, poses, parameters).position,
                    self.place(joint.first, poses, parameters).position,
                );
                dot(self.axes(row.joint, poses, parameters)[i], d)
            }
        }
    }

    /// Residual of every row, and the derivatives of each row along the twists of its bodies, as [`Self::row_bodies`] has
    /// them (zeros for none): `n_sides size()` numbers per row.
    pub(crate) fn evaluate<S: Real>(
        &self,
        poses: &[Pose<S>],
        inputs: &Inputs<Command<S>, S>,
        residual: &mut [S],
        derivatives: &mut [S],
    ) {
        let mut rows = residual.iter_mut().zip(derivatives.chunks_exact_mut(self.n_sides * self.size()));
        for of_joint in self.rows.chunk_by(|a, b| a.joint == b.joint) {
            let ends = Ends::new(self, of_joint[0].joint, poses, &inputs.parameters);
            for (row, (residual, derivatives)) in of_joint.iter().zip(&mut rows) {
                let led = self.lead(row, poses, &inputs.parameters);
                let rate;
                (*residual, rate) = self.evaluate_row(row, &ends, inputs, led.as_ref());
                let sides = derivatives.chunks_exact_mut(self.size()).zip([
                    (ends.joint.first, rate.linear.map(|v| -v), rate.first),
                    (ends.joint.second, rate.linear, rate.second),
                ]);
                for (derivatives, (point, linear, angular)) in sides {
                    for (slot, &component) in derivatives.iter_mut().zip(self.space.components()) {
                        *slot = match component {
                            _ if self.points[point].body.is_none() => S::from_f64(0.0),
                            Component::Along(i) => linear[i],
                            Component::About(i) => angular[i],
                        };
                    }
                }
                if let Some(led) = &led {
                    self.put_leader(row, led, poses, &inputs.parameters, derivatives);
                }
            }
        }
    }

    /// Adds the derivatives along the bodies of a leading joint; one that the row's own joint has, too, has them there.
    fn put_leader<S: Real>(&self, row: &Row, led: &Led<S>, poses: &[Pose<S>], parameters: &[S], derivatives: &mut [S]) {
        let (own, leader) = (&self.joints[row.joint], &self.joints[led.joint]);
        let [p1, p2] = [leader.first, leader.second].map(|point| self.place(point, poses, parameters));
        let rate = &led.rate;
        let ends = [
            (leader.first, rate.linear.map(|v| -v), add(rate.first, cross(rate.linear, p1.lever))),
            (leader.second, rate.linear, add(rate.second, cross(p2.lever, rate.linear))),
        ];
        let own = [own.first, own.second].map(|point| self.points[point].body);
        for (k, (point, linear, angular)) in ends.into_iter().enumerate() {
            let Some(body) = self.points[point].body else { continue };
            let side = own.iter().position(|of| *of == Some(body)).unwrap_or(2 + k);
            let derivatives = &mut derivatives[side * self.size()..][..self.size()];
            for (slot, &component) in derivatives.iter_mut().zip(self.space.components()) {
                *slot = *slot
                    + match component {
                        Component::Along(i) => linear[i],
                        Component::About(i) => angular[i],
                    };
            }
        }
    }

    /// The same in memory of its own: residuals and derivatives.
    pub(crate) fn evaluated<S: Real>(&self, poses: &[Pose<S>], inputs: &Inputs<Command<S>, S>) -> (Vec<S>, Vec<S>) {
        let mut residual = vec![S::from_f64(0.0); self.n_rows()];
        let mut derivatives = vec![S::from_f64(0.0); self.n_derivatives()];
        self.evaluate(poses, inputs, &mut residual, &mut derivatives);
        (residual, derivatives)
    }

    /// Residual of a row, and its derivatives along the twists of both bodies: along the linear velocity of the second
    /// one (the opposite of that along the first one's) and along both angular velocities.
    fn evaluate_row<S: Real>(
        &self,
        row: &Row,
        ends: &Ends<'_, S>,
        inputs: &Inputs<Command<S>, S>,
        led: Option<&Led<S>>,
    ) -> (S, Rate<S>) {
        let driven = row.drive.map(|by| &inputs.drives[by.command]);
        let parameter = row.shifted(row.displaced(&inputs.parameters), &inputs.parameters);
        let none = [S::from_f64(0.0); 3];
        let turning = |angular: Vec3<S>| Rate { linear: none, first: angular.map(|v| -v), second: angular };
        let [p1, p2] = &ends.places;
        match row.component {
            _ if row.is_coupled => {
                let Coupled { residual, rate, .. } =
                    self.coupled_row(row, ends.poses, &inputs.parameters, &inputs.drives);
                let first = add(rate.first, cross(rate.linear, p1.lever));
                (residual, Rate { first, second: add(rate.second, cross(p2.lever, rate.linear)), ..rate })
            }
            Component::Along(i) => {
                let (e, d) = (ends.axes()[i], sub(p2.position, p1.position));
                let command = driven.map(|command| command.value).or_else(|| led.map(|led| led.value));
                let command = command.unwrap_or_else(|| S::from_f64(0.0));
                let mut first = cross(e, p1.lever);
                if ends.joint.frame == Frame::First {
                    first = add(first, cross(e, d));
                }
                (dot(e, d) - (command + parameter), Rate { linear: e, first, second: cross(p2.lever, e) })
            }
            Component::About(i) if row.component == ends.joint.roll() => {
                let mut left = ends.carried().roll(i);
                let turned = driven.map(|command| (command.sine, command.cosine));
                if let Some(turned) = turned.or_else(|| led.map(|led| led.value.wide_sin_cos())) {
                    left = turn_back(left, turned);
                }
                let (sine, cosine) = turn_back(left, parameter.sin_cos());
                let gradient = ends.carried().rotation_gradient(i);
                match self.space {
                    // Without tilt sine and cosine are exact, and spare a division.
                    Space::Planar => {
                        let (residual, slope) = S::angle_residual(sine, cosine);
                        (residual, turning(scale(gradient, slope)))
                    }
                    Space::Spatial => (S::small_angle(sine, cosine), turning(gradient)),
                }
            }
            Component::About(i) => (ends.carried().tilt(i) - parameter, turning(ends.carried().rotation_gradient(i))),
        }
    }

    /// Force and moment on the second body at its joint point, in ground axes, that the unit multiplier of a row
    /// stands for.
    pub(crate) fn row_wrench<S: Real>(&self, row: &Row, poses: &[Pose<S>], parameters: &[S]) -> [Option<Vec3<S>>; 2] {
        match row.component {
            _ if row.is_coupled => {
                let rate = self.coupled_row(row, poses, parameters, &[]).rate;
                [Some(rate.linear), Some(rate.second)]
            }
            Component::Along(i) => [Some(self.axes(row.joint, poses, parameters)[i]), None],
            Component::About(i) => [None, Some(self.rotation_gradient(row.joint, i, poses, parameters))],
        }
    }

    /// What the own parameter of a row counts: more or less than one where the flanks of a coupling have moved.
    pub(crate) fn slope<S: Real>(&self, row: &Row, poses: &[Pose<S>], parameters: &[S]) -> S {
        match row.play {
            Some(_) => self.coupled_row(row, poses, parameters, &[]).slope,
            None => S::from_f64(1.0),
        }
    }

    /// The bodies of a row: those of its joint, and of the joint that it follows where they are others.
    pub(crate) fn row_bodies(&self, row: usize) -> [Option<usize>; 4] {
        let bodies = |joint: &Joint| [joint.first, joint.second].map(|point| self.points[point].body);
        let joint = &self.joints[self.rows[row].joint];
        let own = bodies(joint);
        let others = joint.follows.as_ref().map_or([None; 2], |follower| bodies(&self.joints[follower.leader]));
        let [third, fourth] = others.map(|body| body.filter(|_| !own.contains(&body)));
        [own[0], own[1], third, fourth]
    }

    /// Derivatives of all rows.
    pub(crate) fn n_derivatives(&self) -> usize {
        self.n_sides * self.size() * self.n_rows()
    }

    /// The place of a body of a row among those of all rows.
    pub(crate) const fn side(&self, row: usize, side: usize) -> usize {
        self.n_sides * row + side
    }

    /// Adds `-(d residual / d inputs)^T multipliers` to the gradient along drives and parameters.
    ///
    /// With `J^T multipliers = d cost / d x` this is the gradient of the cost along the inputs on the
    /// closed mechanism.
    pub(crate) fn pull_back<S: Real>(
        &self,
        poses: &[Pose<S>],
        parameters: &[S],
        multipliers: &[S],
        gradient: &mut Inputs<S>,
    ) {
        for (row, &l) in self.rows.iter().zip(multipliers) {
            self.pull_row_back(row, poses, parameters, l, gradient);
        }
    }

    /// The part of one row in it.
    pub(crate) fn pull_row_back<S: Real>(
        &self,
        row: &Row,
        poses: &[Pose<S>],
        parameters: &[S],
        l: S,
        gradient: &mut Inputs<S>,
    ) {
        if let Some(p) = row.parameter {
            gradient.parameters[p] = gradient.parameters[p] + self.slope(row, poses, parameters) * l;
        }
        if let Some((p, coefficient)) = row.shift {
            gradient.parameters[p] = gradient.parameters[p] + S::from_f64(coefficient) * l;
        }
        if let Some(by) = row.drive {
            gradient.drives[by.drive] = gradient.drives[by.drive] + S::from_f64(by.coefficient) * l;
        }
        let is_moved = |point: &Point, component| match component {
            Component::About(_) => point.turns(),
            Component::Along(_) => point.moves(),
        };
        let moves = |joint: usize, component| {
            let joint = &self.joints[joint];
            [joint.first, joint.second].iter().any(|&point| is_moved(&self.points[point], component))
        };
        if moves(row.joint, row.component) {
            let rate = self.row_rate(row, poses, parameters);
            self.pull_rate_back(row.joint, &rate, poses, parameters, l, gradient);
        }
        if let Some(follower) = &self.joints[row.joint].follows
            && moves(follower.leader, follower.component)
            && let Some(led) = self.lead(row, poses, parameters)
        {
            self.pull_rate_back(led.joint, &led.rate, poses, parameters, l, gradient);
        }
    }

    /// The part of a row that is gained while the points and axes of a joint move.
    fn pull_rate_back<S: Real>(
        &self,
        joint: usize,
        rate: &Rate<S>,
        poses: &[Pose<S>],
        parameters: &[S],
        l: S,
        gradient: &mut Inputs<S>,
    ) {
        let joint = &self.joints[joint];
        for (point, is_first) in [(joint.first, true), (joint.second, false)] {
            let (away, turning) =
                if is_first { (rate.linear, rate.first) } else { (rate.linear.map(|v| -v), rate.second) };
            for (parameter, [velocity, rotation]) in self.ground_rates(point, poses, parameters) {
                let slot = &mut gradient.parameters[parameter];
                *slot = *slot + l * (dot(away, velocity) - dot(turning, rotation));
            }
        }
    }

    /// What a row gains while the points of its joint and the axes that each body carries there move.
    fn row_rate<S: Real>(&self, row: &Row, poses: &[Pose<S>], parameters: &[S]) -> Rate<S> {
        if row.is_coupled {
            return self.coupled_row(row, poses, parameters, &[]).rate;
        }
        // Rows of perfect directions ask for less.
        if let Component::Along(i) = row.component
            && !self.points[self.joints[row.joint].first].turns()
        {
            return Rate { linear: self.axes(row.joint, poses, parameters)[i], ..Rate::zero() };
        }
        self.component_rate(row.joint, row.component, poses, parameters)
    }

    /// The same of a component of a joint's displacement.
    pub(crate) fn component_rate<S: Real>(
        &self,
        number: usize,
        component: Component,
        poses: &[Pose<S>],
        parameters: &[S],
    ) -> Rate<S> {
        let joint = &self.joints[number];
        match component {
            Component::Along(i) => {
                let linear = self.axes(number, poses, parameters)[i];
                if joint.frame == Frame::Ground {
                    return Rate { linear, ..Rate::zero() };
                }
                let place = |point| self.place(point, poses, parameters).position;
                Rate { linear, first: cross(linear, sub(place(joint.second), place(joint.first))), ..Rate::zero() }
            }
            Component::About(i) => {
                let second = self.rotation_gradient(number, i, poses, parameters);
                Rate { first: second.map(|v| -v), second, ..Rate::zero() }
            }
        }
    }

    /// What every parameter does to a point and to the axes there: velocity and rotation, in ground axes.
    pub(crate) fn ground_rates<S: Real>(&self, point: usize, poses: &[Pose<S>], parameters: &[S]) -> Rates<S> {
        let point = &self.points[point];
        let mut rates = point.rates(parameters);
        if let Some(b) = point.body {
            for (_, rate) in &mut rates {
                *rate = rate.map(|v| poses[b].turn(v));
            }
        }
        rates
    }
}
