//! Symbols that stand for numbers while the equations are run once to be recorded.
//!
//! Constants are folded, equal sub-expressions are shared and multiplications by 0 and 1 vanish, so
//! that the plane costs no more than plane geometry.

use std::cell::RefCell;
use std::hash::Hash;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::Arc;

use crate::math::curve::{Curve, polynomial};
use crate::math::real::Real;
use crate::program::code::{Code, Frame};
use crate::program::graph::{Binary, Node};
use crate::program::kept::key;
use crate::program::recording::Recording;

/// Terms of the power series of the arc tangent.
const ARC_TERMS: usize = 16;
/// Halvings of a wide angle, and how large its part may be, for the power series of small ones.
const HALVINGS: i32 = 8;
const PART: f64 = 0.35;
/// Steps of Heron's method for a square root.
const ROOT_STEPS: usize = 7;
/// The same where the start is as good as unknown: every step halves the ratio, and five finish.
const FAR_ROOT_STEPS: usize = 24;

/// What rounding leaves of constants, as a part of them: it must not decide which operations vanish.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Records operations on symbols.
pub struct Recorder {
    graph: RefCell<Recording>,
    /// Terms of the power series of sine and cosine.
    terms: usize,
}

/// A number of a recorded program.
#[derive(Clone, Copy)]
pub enum Symbol<'r> {
    /// Known while recording.
    Constant(f64),
    /// A node of the graph.
    Node(u32, &'r Recorder),
}

/// Terms of the power series of sine and cosine for angles up to one.
fn terms(largest_angle: f64) -> usize {
    let (mut terms, mut next) = (1, 1.0);
    // The first term left out of the cosine is below half of the last place.
    while next > 1e-17 {
        let n = 2.0 * terms as f64;
        next *= largest_angle * largest_angle / (n * (n - 1.0));
        terms += 1;
    }
    terms - 1
}

impl Recorder {
    /// A recorder whose angles stay below `largest_angle` (rad). What it records is kept for mechanisms that have the
    /// same `structure`, or as good as the same.
    #[must_use]
    pub fn new(largest_angle: f64, structure: &impl Hash) -> Self {
        let terms = terms(largest_angle);
        Self { graph: RefCell::new(Recording::new(Some(key(&(terms, structure))))), terms }
    }

    /// A recorder that keeps nothing.
    #[cfg(test)]
    pub fn passing(largest_angle: f64) -> Self {
        Self { graph: RefCell::new(Recording::new(None)), terms: terms(largest_angle) }
    }

    fn node(&self, node: Node) -> u32 {
        self.graph.borrow_mut().node(node)
    }

    fn at(&self, id: u32) -> Node {
        self.graph.borrow().at(id)
    }

    fn id(&self, symbol: Symbol<'_>) -> u32 {
        match symbol {
            Symbol::Constant(value) => self.graph.borrow_mut().constant(value),
            Symbol::Node(id, _) => id,
        }
    }

    /// A quantity common to all samples of a configuration.
    pub fn common(&self, index: usize) -> Symbol<'_> {
        Symbol::Node(self.node(Node::Common(index as u32)), self)
    }

    /// A quantity of its own for every sample.
    pub fn varying(&self, index: usize) -> Symbol<'_> {
        Symbol::Node(self.node(Node::Varying(index as u32)), self)
    }

    fn binary(&self, kind: Binary, a: Symbol<'_>, b: Symbol<'_>) -> Symbol<'_> {
        let (a, b) = (self.id(a), self.id(b));
        // One order for what commutes, so that equal expressions meet.
        let ordered = matches!(kind, Binary::Add | Binary::Mul | Binary::Max) && a > b;
        let (a, b) = if ordered { (b, a) } else { (a, b) };
        Symbol::Node(self.node(Node::Binary(kind, a, b)), self)
    }

    /// The operations that compute `outputs`, and the constants that they use.
    pub(crate) fn code(&self, outputs: &[Symbol<'_>], frame: Frame) -> (Arc<Code>, Vec<f64>) {
        let roots = outputs.iter().map(|&s| self.id(s)).collect();
        self.graph.borrow_mut().code(roots, frame)
    }
}

impl<'r> Symbol<'r> {
    /// Orders symbols as they became known.
    pub(crate) const fn recorded(self) -> u32 {
        match self {
            Self::Constant(_) => 0,
            Self::Node(id, _) => id,
        }
    }

    /// A constant; one where it is so but for rounding, since multiplications by one vanish.
    fn known(value: f64) -> Self {
        let rounding = (value.abs() - 1.0).abs() <= ROUNDING;
        Self::Constant(if rounding { 1.0_f64.copysign(value) } else { value })
    }

    /// The sum of two constants; nothing where rounding is all that is left of them.
    fn sum(a: f64, b: f64) -> Self {
        let sum = a + b;
        if sum.abs() <= ROUNDING * a.abs().max(b.abs()) { Self::Constant(0.0) } else { Self::known(sum) }
    }

    fn recorder(a: Self, b: Self) -> Option<&'r Recorder> {
        match (a, b) {
            (Self::Node(_, r), _) | (_, Self::Node(_, r)) => Some(r),
            _ => None,
        }
    }

    fn same(a: Self, b: Self) -> bool {
        matches!((a, b), (Self::Node(i, _), Self::Node(j, _)) if i == j)
    }

    #[allow(clippy::float_cmp)] // exact: only these very constants fold away; both zeros count as zero
    fn is(self, value: f64) -> bool {
        matches!(self, Self::Constant(c) if c == value)
    }

    /// Absolute value.
    #[must_use]
    pub fn abs(self) -> Self {
        match self {
            Self::Constant(c) => Self::Constant(c.abs()),
            Self::Node(id, r) => Self::Node(r.node(Node::Abs(id)), r),
        }
    }

    /// The square root by Heron's method, in so many steps.
    fn root_from(self, near: f64, steps: usize) -> Self {
        if let Self::Constant(c) = self {
            return Self::Constant(c.sqrt());
        }
        (0..steps).fold(Self::Constant(near), |root, _| Self::Constant(0.5) * (root + self / root))
    }

    /// Sine and cosine by so many terms of their power series.
    fn sin_cos_series(self, terms: usize) -> (Self, Self) {
        let square = self * self;
        let series = |first: usize| {
            // Coefficients of x^first, x^(first+2), ... with alternating signs.
            let mut coefficients = vec![1.0];
            for k in 1..terms {
                let n = (first + 2 * k) as f64;
                coefficients.push(-coefficients[k - 1] / (n * (n - 1.0)));
            }
            let last = Self::Constant(coefficients[terms - 1]);
            coefficients[..terms - 1].iter().rev().fold(last, |sum, &c| sum * square + Self::Constant(c))
        };
        (self * series(1), series(0))
    }

    /// Whether it is plainly a number without sign.
    fn is_unsigned(self) -> bool {
        let Self::Node(id, r) = self else { return false };
        match r.at(id) {
            Node::Abs(_) => true,
            Node::Binary(Binary::Mul, a, b) => a == b,
            _ => false,
        }
    }

    /// The larger of two numbers; not a number when either is not.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        if self.is(0.0) && other.is_unsigned() {
            return other;
        }
        match (Self::recorder(self, other), self, other) {
            (None, Self::Constant(a), Self::Constant(b)) => Self::Constant(a.max(b)),
            (Some(r), ..) => r.binary(Binary::Max, self, other),
            _ => self,
        }
    }
}

impl Add for Symbol<'_> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => Self::sum(a, b),
            _ if self.is(0.0) => other,
            _ if other.is(0.0) => self,
            (Self::Node(_, r), _) | (_, Self::Node(_, r)) => r.binary(Binary::Add, self, other),
        }
    }
}

impl Sub for Symbol<'_> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => Self::sum(a, -b),
            _ if other.is(0.0) => self,
            _ if self.is(0.0) => -other,
            _ if Self::same(self, other) => Self::Constant(0.0),
            (Self::Node(_, r), _) | (_, Self::Node(_, r)) => r.binary(Binary::Sub, self, other),
        }
    }
}

impl Mul for Symbol<'_> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => Self::known(a * b),
            _ if self.is(0.0) || other.is(0.0) => Self::Constant(0.0),
            _ if self.is(1.0) => other,
            _ if other.is(1.0) => self,
            _ if self.is(-1.0) => -other,
            _ if other.is(-1.0) => -self,
            (Self::Node(_, r), _) | (_, Self::Node(_, r)) => r.binary(Binary::Mul, self, other),
        }
    }
}

impl Div for Symbol<'_> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => Self::known(a / b),
            (_, Self::Constant(b)) => self * Self::Constant(1.0 / b),
            _ if self.is(0.0) => Self::Constant(0.0),
            (_, Self::Node(_, r)) => r.binary(Binary::Div, self, other),
        }
    }
}

impl Neg for Symbol<'_> {
    type Output = Self;
    fn neg(self) -> Self {
        match self {
            Self::Constant(c) => Self::Constant(-c),
            Self::Node(id, r) => match r.at(id) {
                Node::Neg(of) => Self::Node(of, r),
                Node::Binary(Binary::Sub, a, b) => Self::Node(r.node(Node::Binary(Binary::Sub, b, a)), r),
                _ => Self::Node(r.node(Node::Neg(id)), r),
            },
        }
    }
}

impl Real for Symbol<'_> {
    fn from_f64(value: f64) -> Self {
        Self::known(value)
    }

    /// Power series, to rounding for the recorder's largest angle.
    fn sin_cos(self) -> (Self, Self) {
        match self {
            Self::Constant(c) => {
                let (s, c) = c.sin_cos();
                (Self::Constant(s), Self::Constant(c))
            }
            Self::Node(_, r) => self.sin_cos_series(r.terms),
        }
    }

    // Close to the solution the sine serves as well as the angle, without an arc tangent.
    fn angle_residual(sine: Self, cosine: Self) -> (Self, Self) {
        (sine, cosine)
    }

    // Close to the solution the tangent serves as well as the angle.
    fn small_angle(sine: Self, cosine: Self) -> Self {
        sine / cosine
    }

    /// The angle by a quotient of its tangent t, `t (15 + 4 t^2) / (15 + 9 t^2)`, to 0.01 t^7. The tangent vanishes at
    /// half a turn, too, where the cosine is negative: there it is infinite, so that nothing converges.
    fn wide_angle(sine: Self, cosine: Self) -> Self {
        let cosine = cosine.max(Self::Constant(0.0));
        let (s, c) = (sine * sine, Self::Constant(15.0) * cosine * cosine);
        sine * (c + Self::Constant(4.0) * s) / (cosine * (c + Self::Constant(9.0) * s))
    }

    /// Half of the angle has the direction `(r + c, s)`, which vanishes at half a turn, and `(|s|, r - c)` with the sign of s,
    /// which vanishes at none; their sum nowhere. The tangent of half of it is halved until the power series serves.
    fn whole_angle(sine: Self, cosine: Self) -> Self {
        let one = Self::Constant(1.0);
        let size = (sine * sine + cosine * cosine).root_from(1.0, ROOT_STEPS);
        let (side, _) = (sine * Self::Constant(f64::MAX)).within_one();
        let (x, y) = (size + cosine + sine.abs(), sine + (size - cosine) * side);
        let tangent = y / ((x * x + y * y).root_from(2.0, ROOT_STEPS) + x);
        let half = |t: Self| t / (one + (one + t * t).root_from(1.0, ROOT_STEPS));
        let part = half(half(tangent));
        Self::Constant(8.0) * part * Self::double_arc(part * part)
    }

    fn reciprocal_root(self, near: f64) -> Self {
        Self::Constant(1.0) / self.root_from(near, FAR_ROOT_STEPS)
    }

    // Recorded programs start near the solution.
    fn tilt(sine: Self, _: Self) -> Self {
        sine
    }

    /// Power series, to rounding for `square` up to 0.1 (a rotation by 0.6 rad).
    fn double_arc(square: Self) -> Self {
        (0..ARC_TERMS).rev().fold(Self::Constant(0.0), |sum, k| {
            let sign = if k % 2 == 0 { 2.0 } else { -2.0 };
            sum * square + Self::Constant(sign / (2 * k + 1) as f64)
        })
    }

    /// The power series of a part of the angle, doubled again and again.
    fn wide_sin_cos(self) -> (Self, Self) {
        if let Self::Constant(c) = self {
            let (s, c) = c.sin_cos();
            return (Self::Constant(s), Self::Constant(c));
        }
        let part = (self * Self::Constant(0.5_f64.powi(HALVINGS))).sin_cos_series(terms(PART));
        (0..HALVINGS).fold(part, |(s, c), _| {
            let double = s + s;
            (double * c, Self::Constant(1.0) - double * s)
        })
    }

    // What is asked for the slope stays between.
    fn within_one(self) -> (Self, Self) {
        let one = Self::Constant(1.0);
        let below = -(-self).max(-one);
        (below.max(-one), one)
    }

    fn root(self, near: f64) -> Self {
        self.root_from(near, ROOT_STEPS)
    }

    /// Of several pieces, by what each adds with the part of the way that lies in it:
    /// `f(x) = f(x_0) + sum of [f_k(x_k + s_k) - f_k(x_k)]`, `s_k = min(max(x - x_k, 0), x_(k+1) - x_k)`.
    fn along(self, curve: &Curve) -> (Self, Self) {
        let (zero, knots) = (Self::Constant(0.0), curve.knots());
        if curve.is_polynomial() {
            let s = self - Self::known(knots[0]);
            let at = |order: usize| polynomial(curve.piece(0), s, order, Self::known);
            return (at(0), at(1));
        }
        let (first, last) = (knots[0], knots[knots.len() - 1]);
        let [before, beyond] = [(Self::known(first) - self).max(zero), (self - Self::known(last)).max(zero)];
        let [fall, rise] = [first, last].map(|end| Self::known(curve.at(end, 1)));
        let mut value = Self::known(curve.at(first, 0)) - before * fall + beyond * rise;
        let mut slope = fall;
        for (k, ends) in knots.windows(2).enumerate() {
            let s = -(-(self - Self::known(ends[0])).max(zero)).max(Self::known(ends[0] - ends[1]));
            let added: Vec<f64> = curve.piece(k).iter().copied().skip(1).collect();
            let steeper: Vec<f64> = added.iter().enumerate().skip(1).map(|(j, c)| (j + 1) as f64 * c).collect();
            value = value + s * polynomial(&added, s, 0, Self::known);
            slope = slope + s * polynomial(&steeper, s, 0, Self::known);
        }
        (value, slope)
    }
}
