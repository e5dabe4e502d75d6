//! Affine forms: numbers that are known to depend on some unknowns linearly but for a remainder.
//!
//! ```text
//! value = centre + sum coefficient_k d_k + remainder,    |d_k| <= size_k,  |remainder| <= rest
//! ```
//!
//! Intervals forget where they come from, so that a sum of what cancels is as wide as one of what does not. Forms cancel:
//! what they lose is of second order. A product keeps what is linear, the rest of it goes to the remainder; a
//! function is its tangent with the mean value theorem, `f(x) = f(c) + f'(X) (x - c)`, f' an interval around the slope.
//!
//! Everything rounded is paid for: the coefficients are numbers like others, and what a sum or product of them may be off
//! by, for unknowns of their sizes, is added to the remainder.

mod unknowns;

use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::rc::Rc;

use crate::math::affine::unknowns::{Finite, Sum};
pub(crate) use crate::math::affine::unknowns::{Group, Unknowns};
use crate::math::curve::Curve;
use crate::math::interval::Interval;
use crate::math::lanes::dispatch;
use crate::math::real::Real;

/// What sums of non-negative numbers are raised by, so that their own rounding is covered.
const RAISED: f64 = 1.0 + 1e-12;
const EPSILON: f64 = 2.0 * f64::EPSILON;
/// Numbers of a form before its coefficients: centre, rest, and what the linear part reaches.
const HEAD: usize = 3;

/// Where forms of one set of unknowns are kept.
pub(crate) struct Forms {
    unknowns: Unknowns,
    numbers: RefCell<Vec<f64>>,
    /// Room for the terms of a sum.
    terms: RefCell<Vec<(f64, usize)>>,
    rooms: Rooms,
}

/// Memory of forms that are done with, for the next ones.
pub(crate) type Rooms = Rc<RefCell<Vec<Vec<f64>>>>;

/// A number: of its own, or by its place among the forms.
#[derive(Clone, Copy)]
pub(crate) enum Form<'f> {
    Constant(Interval),
    Linear(usize, &'f Forms),
}

impl Forms {
    /// Of some unknowns.
    pub fn new(unknowns: Unknowns, rooms: &Rooms) -> Self {
        let numbers = RefCell::new(rooms.borrow_mut().pop().unwrap_or_default());
        Self { unknowns, numbers, terms: RefCell::default(), rooms: Rc::clone(rooms) }
    }

    /// How many numbers are kept.
    pub fn count(&self) -> usize {
        self.numbers.borrow().len()
    }

    /// Forgets the numbers beyond so many, and with them all forms that were made since then.
    pub fn back_to(&self, count: usize) {
        self.numbers.borrow_mut().truncate(count);
    }

    /// How many numbers a form has.
    fn length(&self) -> usize {
        HEAD + self.unknowns.sizes.len()
    }

    /// A form by centre, coefficients that are not zero, and what it may be off by.
    pub fn linear(&self, centre: f64, coefficients: impl Iterator<Item = (usize, f64)>, rest: f64) -> Form<'_> {
        let mut numbers = self.numbers.borrow_mut();
        let place = numbers.len();
        numbers.resize(place + self.length(), 0.0);
        let form = &mut numbers[place..];
        (form[0], form[1]) = (centre, rest);
        for (k, coefficient) in coefficients {
            form[HEAD + k] = coefficient;
        }
        if self.is_finished(form) { Form::Linear(place, self) } else { Form::Constant(Interval::LINE) }
    }

    /// Finds what the linear part of a form reaches; false where that or another number is none.
    fn is_finished(&self, form: &mut [f64]) -> bool {
        let (head, coefficients) = form.split_at_mut(HEAD);
        head[2] = self.unknowns.reach(coefficients) * RAISED;
        // Written so that what is not a number is none of the finite ones.
        head[0].abs() + head[1] + head[2] < f64::INFINITY
    }

    /// Adds a sum of forms times numbers to the numbers.
    fn add<'f>(&'f self, numbers: &mut Vec<f64>, terms: impl Iterator<Item = (f64, Form<'f>)>) {
        let place = numbers.len();
        numbers.resize(place + self.length(), 0.0);
        let (before, sum) = numbers.split_at_mut(place);
        let mut linear = self.terms.borrow_mut();
        linear.clear();
        let (mut count, mut weight) = (0.0, 0.0);
        for (factor, form) in terms {
            count += 1.0;
            match form {
                Form::Constant(c) => {
                    let (centre, rest) = c.split();
                    sum[0] += factor * centre;
                    sum[1] += factor.abs() * rest;
                    weight += factor.abs() * (centre.abs() + rest);
                }
                Form::Linear(place, _) => {
                    let of = &before[place..place + HEAD];
                    sum[0] += factor * of[0];
                    sum[1] += factor.abs() * of[1];
                    weight += factor.abs() * (of[0].abs() + of[1] + of[2]);
                    linear.push((factor, place + HEAD));
                }
            }
        }
        dispatch(Sum { onto: &mut sum[HEAD..], terms: &linear, numbers: before });
        sum[1] = (sum[1] + EPSILON * (count + 2.0) * weight) * RAISED + f64::MIN_POSITIVE * count;
    }

    /// The sum of forms times numbers.
    pub fn sum<'f>(&'f self, terms: impl Iterator<Item = (f64, Form<'f>)>) -> Form<'f> {
        let mut numbers = self.numbers.borrow_mut();
        let place = numbers.len();
        self.add(&mut numbers, terms);
        if self.is_finished(&mut numbers[place..]) {
            return Form::Linear(place, self);
        }
        numbers.truncate(place);
        Form::Constant(Interval::LINE)
    }

    /// What is made of the numbers of such a sum, which is not kept.
    fn of_sum<'f, T>(&'f self, terms: impl Iterator<Item = (f64, Form<'f>)>, made: impl Fn(&mut [f64]) -> T) -> T {
        let mut numbers = self.numbers.borrow_mut();
        let place = numbers.len();
        self.add(&mut numbers, terms);
        let found = made(&mut numbers[place..]);
        numbers.truncate(place);
        found
    }

    /// Centre, the first coefficients, and the rest, to which the other unknowns belong then.
    fn first(&self, numbers: &[f64], n: usize) -> (f64, Vec<f64>, f64) {
        let (head, coefficients) = numbers.split_at(HEAD);
        let others: f64 = coefficients[n..].iter().zip(&self.unknowns.sizes[n..]).map(|(c, size)| c.abs() * size).sum();
        (head[0], coefficients[..n].to_vec(), (head[1] + others) * RAISED)
    }

    /// All values of such a sum.
    pub fn reached<'f>(&'f self, terms: impl Iterator<Item = (f64, Form<'f>)>) -> Interval {
        self.of_sum(terms, |sum| if self.is_finished(sum) { range(sum) } else { Interval::LINE })
    }

    /// Centre, the first coefficients, and the rest of such a sum, as of a form.
    pub fn parts_of_sum<'f>(&'f self, terms: impl Iterator<Item = (f64, Form<'f>)>, n: usize) -> (f64, Vec<f64>, f64) {
        self.of_sum(terms, |sum| {
            let is_known = dispatch(Finite(sum));
            if is_known { self.first(sum, n) } else { Form::Constant(Interval::LINE).parts(n) }
        })
    }
}

impl Drop for Forms {
    fn drop(&mut self) {
        let mut room = self.numbers.take();
        room.clear();
        self.rooms.borrow_mut().push(room);
    }
}

/// All values of a form by its numbers.
fn range(form: &[f64]) -> Interval {
    Interval::from_point(form[0]) + Interval::of_size((form[1] + form[2]) * RAISED)
}

impl Form<'_> {
    /// All values.
    pub fn range(self) -> Interval {
        match self {
            Self::Constant(c) => c,
            Self::Linear(place, forms) => range(&forms.numbers.borrow()[place..]),
        }
    }

    /// Centre, the coefficients of the first unknowns, and what the form is off by without the others.
    pub fn parts(self, n: usize) -> (f64, Vec<f64>, f64) {
        match self {
            Self::Constant(c) => {
                let (centre, rest) = c.split();
                (centre, vec![0.0; n], rest)
            }
            Self::Linear(place, forms) => {
                let numbers = forms.numbers.borrow();
                forms.first(&numbers[place..place + forms.length()], n)
            }
        }
    }

    pub fn is_zero(self) -> bool {
        matches!(self, Self::Constant(c) if c.is_zero())
    }

    /// `factor * self + other_factor * other` and something of at most this size.
    fn with(self, factor: f64, (other, other_factor): (Self, f64), off: f64) -> Self {
        let ((Self::Linear(_, forms), _) | (_, Self::Linear(_, forms))) = (self, other) else {
            return Self::Constant(Interval::LINE);
        };
        let off = Self::Constant(Interval::of_size(off));
        forms.sum([(factor, self), (other_factor, other), (1.0, off)].into_iter())
    }

    /// A function of it by its values and its slopes.
    fn mapped(self, value: impl Fn(Interval) -> Interval, slope: impl Fn(Interval) -> Interval) -> Self {
        match self {
            Self::Constant(c) => Self::Constant(value(c)),
            Self::Linear(place, forms) => {
                let range = self.range();
                let (centre, far) = {
                    let numbers = forms.numbers.borrow();
                    (numbers[place], (numbers[place + 1] + numbers[place + 2]) * RAISED)
                };
                let (at, slopes) = (value(Interval::from_point(centre)), slope(range));
                if !at.is_finite() || !slopes.is_finite() {
                    return Self::Constant(Interval::LINE);
                }
                let (steepness, bend) = slopes.split();
                // f(c) - f' c, and f' times the form
                let rest = at - Interval::from_point(steepness) * Interval::from_point(centre);
                self.with(steepness, (Self::Constant(rest), 1.0), bend * far * RAISED)
            }
        }
    }

    fn inverse(self) -> Self {
        self.mapped(|x| Interval::ONE / x, |x| -(Interval::ONE / x.square()))
    }
}

impl Add for Form<'_> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => Self::Constant(a + b),
            _ if self.is_zero() => other,
            _ if other.is_zero() => self,
            _ => self.with(1.0, (other, 1.0), 0.0),
        }
    }
}

impl Sub for Form<'_> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => Self::Constant(a - b),
            _ if other.is_zero() => self,
            _ => self.with(1.0, (other, -1.0), 0.0),
        }
    }
}

impl Mul for Form<'_> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => Self::Constant(a * b),
            _ if self.is_zero() || other.is_zero() => Self::Constant(Interval::ZERO),
            (Self::Constant(c), form) | (form, Self::Constant(c)) => {
                if c == Interval::ONE {
                    return form;
                }
                if !c.is_finite() {
                    return Self::Constant(Interval::LINE);
                }
                let (factor, rest) = c.split();
                form.with(factor, (Self::Constant(Interval::ZERO), 1.0), rest * form.range().size() * RAISED)
            }
            (Self::Linear(a, forms), Self::Linear(b, _)) => {
                let [[a, rest_a, reach_a], [b, rest_b, reach_b]] = {
                    let numbers = forms.numbers.borrow();
                    [a, b].map(|place| [numbers[place], numbers[place + 1], numbers[place + 2]])
                };
                // (a + A)(b + B) = b (a + A) + a (b + B) - a b + A B, what is left out being in A and B
                let both = (rest_a + reach_a) * (rest_b + reach_b) * RAISED;
                let product = Interval::from_point(a) * Interval::from_point(b);
                let (centre, rounding) = product.split();
                let once = Self::Constant(Interval::from_point(-centre));
                forms.sum(
                    [
                        (b, self),
                        (a, other),
                        (1.0, once),
                        (1.0, Self::Constant(Interval::of_size((both + rounding) * RAISED))),
                    ]
                    .into_iter(),
                )
            }
        }
    }
}

impl Div for Form<'_> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        match (self, other) {
            (Self::Constant(a), Self::Constant(b)) => Self::Constant(a / b),
            _ => self * other.inverse(),
        }
    }
}

impl Neg for Form<'_> {
    type Output = Self;
    fn neg(self) -> Self {
        match self {
            Self::Constant(c) => Self::Constant(-c),
            Self::Linear(..) => self.with(-1.0, (Self::Constant(Interval::ZERO), 1.0), 0.0),
        }
    }
}

impl Real for Form<'_> {
    fn from_f64(value: f64) -> Self {
        Self::Constant(Interval::from_f64(value))
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sine, cosine) = (|x: Interval| x.sin_cos().0, |x: Interval| x.sin_cos().1);
        (self.mapped(sine, cosine), self.mapped(cosine, |x| -sine(x)))
    }
    fn whole_angle(sine: Self, cosine: Self) -> Self {
        if let (Self::Constant(sine), Self::Constant(cosine)) = (sine, cosine) {
            return Self::Constant(Interval::whole_angle(sine, cosine));
        }
        if !(cosine.range().low > 0.0) {
            return Self::Constant(Interval::LINE);
        }
        let arc = |x| Interval::whole_angle(x, Interval::ONE);
        (sine / cosine).mapped(arc, |x| Interval::ONE / (Interval::ONE + x.square()))
    }
    fn tilt(sine: Self, cosine: Self) -> Self {
        if cosine.range().low > 0.5 { sine } else { Self::Constant(Interval::LINE) }
    }
    // f' = (1 / (1 + s) - f / 2) / s, which is from -2/3 to 0.
    fn double_arc(square: Self) -> Self {
        let slope = |s: Interval| {
            let far = (Interval::ONE / (Interval::ONE + s) - Interval::double_arc(s).scaled(0.5)) / s;
            far.common(Interval::new(-0.67, 0.0)).unwrap_or(Interval::LINE)
        };
        square.mapped(Interval::double_arc, slope)
    }
    // An offset is within its set.
    fn within_one(self) -> (Self, Self) {
        (self, Self::from_f64(1.0))
    }
    fn reciprocal_root(self, near: f64) -> Self {
        Real::root(self, near).inverse()
    }
    fn root(self, _: f64) -> Self {
        self.mapped(Interval::root, |x| Interval::from_f64(0.5) / Interval::root(x))
    }
    fn along(self, curve: &Curve) -> (Self, Self) {
        let of = |order| self.mapped(|x| x.of_curve(curve, order), |x| x.of_curve(curve, order + 1));
        (of(0), of(1))
    }
}

#[cfg(test)]
mod tests;
