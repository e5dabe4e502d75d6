//! Sets of offsets as products of cones, the one place where they become such.
//!
//! Every component is measured in the largest value it can have, so that the cones have sizes near one
//! whatever the units are; components that cannot move at all are left out. What remains is
//! `offset = unit basis u`, with half spaces and cones of second order as conditions on u. A face of the set
//! is the same around its middle.

use crate::clearance::{MAX_SIZE, Set};
use crate::space::norm;

/// Coefficients of a linear form.
pub(super) type Form = [f64; MAX_SIZE];

/// Tight, or no longer there: to rounding, as a part of one.
const TIGHT: f64 = 1e-9;

/// A condition on the coordinates.
#[derive(Clone, Debug)]
pub(super) enum Condition {
    /// `form . u <= bound`.
    Half { form: Form, bound: f64 },
    /// `|forms u + shift| <= bound`.
    Length { forms: Vec<Form>, shift: Vec<f64>, bound: f64 },
}

/// A set in coordinates u of its own.
#[derive(Clone, Debug)]
pub(super) struct Region {
    /// The largest value of each component.
    pub unit: Form,
    /// What each coordinate moves, in these units.
    pub basis: Vec<Form>,
    /// Conditions on the coordinates.
    pub conditions: Vec<Condition>,
}

/// `sum factor * component`.
fn form(terms: &[(usize, f64)]) -> Form {
    let mut form = [0.0; MAX_SIZE];
    for (k, factor) in terms {
        form[*k] += factor;
    }
    form
}

/// `sum |terms| <= bound`: one half space for every choice of signs.
fn sum(terms: &[(usize, f64)], bound: f64) -> impl Iterator<Item = Condition> {
    (0..1 << terms.len()).map(move |code| {
        let signed = terms.iter().enumerate().map(|(k, (at, f))| (*at, if code >> k & 1 == 0 { *f } else { -f }));
        Condition::Half { form: form(&signed.collect::<Vec<_>>()), bound }
    })
}

/// Both ends of a pin, at `+-half_length` along its axis, in a circle each; its first component across
/// the axis is `at`.
fn ends(at: usize, radius: f64, half_length: f64) -> impl Iterator<Item = Condition> {
    [half_length, -half_length].into_iter().map(move |arm| Condition::Length {
        forms: vec![form(&[(at, 1.0), (at + 3, arm)]), form(&[(at + 1, 1.0), (at + 2, -arm)])],
        shift: vec![0.0; 2],
        bound: radius,
    })
}

/// The set's definition.
fn definition(set: &Set) -> Vec<Condition> {
    match *set {
        Set::Disc { radius } | Set::Ball { radius } => {
            let forms: Vec<Form> = (0..set.size()).map(|k| form(&[(k, 1.0)])).collect();
            vec![Condition::Length { shift: vec![0.0; forms.len()], forms, bound: radius }]
        }
        Set::Diamond { gap, half_length } => sum(&[(0, 1.0), (1, half_length)], gap).collect(),
        Set::Interval { low, high } => vec![
            Condition::Half { form: form(&[(0, 1.0)]), bound: high },
            Condition::Half { form: form(&[(0, -1.0)]), bound: -low },
        ],
        Set::Journal { radius, half_length, axial } => {
            sum(&[(0, 1.0)], axial).chain(ends(1, radius, half_length)).collect()
        }
        Set::Sleeve { radius, half_length } => ends(0, radius, half_length).collect(),
        Set::Guide { gap, half_length, half_width, half_height } => {
            sum(&[(0, 1.0), (4, half_length), (2, half_height)], gap)
                .chain(sum(&[(1, 1.0), (3, half_length), (2, half_width)], gap))
                .collect()
        }
        Set::Plate { gap, half_normal, half_side } => sum(&[(0, 1.0), (1, half_normal), (2, half_side)], gap).collect(),
    }
}

/// Vectors of unit length, at right angles to each other and to the forms, of the first `n` coordinates.
fn complement(forms: &[Form], n: usize) -> Vec<Form> {
    let rest = |mut vector: Form, basis: &[Form]| {
        // Twice, for what rounding leaves the first time.
        for b in basis.iter().chain(basis) {
            let along: f64 = vector.iter().zip(b).map(|(v, b)| v * b).sum();
            vector.iter_mut().zip(b).for_each(|(v, b)| *v -= along * b);
        }
        vector
    };
    let mut basis: Vec<Form> = Vec::new();
    for form in forms {
        let vector = rest(*form, &basis);
        let size = norm(&vector);
        if size > TIGHT * norm(form) {
            basis.push(vector.map(|v| v / size));
        }
    }
    let first = basis.len();
    while basis.len() < n {
        let axes = (0..n).map(|k| rest(self::form(&[(k, 1.0)]), &basis));
        let Some(vector) = axes.max_by(|a, b| norm(a).total_cmp(&norm(b))) else { break };
        let size = norm(&vector);
        basis.push(vector.map(|v| v / size));
    }
    basis.split_off(first)
}

impl Region {
    /// The whole set.
    pub fn of(set: &Set) -> Self {
        let mut unit = [0.0; MAX_SIZE];
        (0..set.size()).for_each(|k| unit[k] = set.half_width(k));
        let basis: Vec<Form> = (0..set.size()).filter(|k| unit[*k] > 0.0).map(|k| form(&[(k, 1.0)])).collect();
        // In coordinates of the moving components; conditions that bind none of them are met by zero.
        let own = |f: &Form| {
            let mut own = [0.0; MAX_SIZE];
            own.iter_mut().zip(&basis).for_each(|(o, b)| {
                *o = f.iter().zip(b).zip(&unit).map(|((f, b), unit)| f * b * unit).sum();
            });
            own
        };
        let binds = |f: &Form| f.iter().any(|f| *f != 0.0);
        let conditions = definition(set)
            .into_iter()
            .filter_map(|condition| match condition {
                Condition::Half { form, bound } => {
                    let form = own(&form);
                    let size = form.iter().fold(0.0_f64, |size, f| size.max(f.abs()));
                    binds(&form).then(|| Condition::Half { form: form.map(|f| f / size), bound: bound / size })
                }
                Condition::Length { forms, shift, bound } => {
                    let forms: Vec<Form> = forms.iter().map(&own).collect();
                    forms.iter().any(binds).then(|| Condition::Length {
                        forms: forms.iter().map(|form| form.map(|f| f / bound)).collect(),
                        shift,
                        bound: 1.0,
                    })
                }
            })
            .collect();
        Self { unit, basis, conditions }
    }

    /// The face around an offset in its middle: conditions that are tight there are equalities.
    pub fn face(&self, middle: &[f64]) -> Self {
        let at = self.coordinates(middle);
        let value = |f: &Form| f.iter().zip(&at).map(|(f, u)| f * u).sum::<f64>();
        let mut equalities: Vec<Form> = Vec::new();
        let mut open = Vec::new();
        for condition in &self.conditions {
            match condition {
                Condition::Half { form, bound } => {
                    let slack = bound - value(form);
                    if slack <= TIGHT {
                        equalities.push(*form);
                    } else {
                        open.push(Condition::Half { form: *form, bound: slack });
                    }
                }
                Condition::Length { forms, shift, bound } => {
                    let shift: Vec<f64> = forms.iter().zip(shift).map(|(f, s)| value(f) + s).collect();
                    if bound - norm(&shift) <= TIGHT {
                        equalities.extend(forms);
                    } else {
                        open.push(Condition::Length { forms: forms.clone(), shift, bound: *bound });
                    }
                }
            }
        }
        let free = complement(&equalities, self.basis.len());
        let along = |f: &Form| {
            let mut along = [0.0; MAX_SIZE];
            along.iter_mut().zip(&free).for_each(|(a, n)| *a = f.iter().zip(n).map(|(f, n)| f * n).sum());
            along
        };
        let binds = |f: &Form| f.iter().any(|f| f.abs() > TIGHT);
        let conditions = open.into_iter().filter_map(|condition| match condition {
            Condition::Half { form, bound } => {
                let form = along(&form);
                binds(&form).then_some(Condition::Half { form, bound })
            }
            Condition::Length { forms, shift, bound } => {
                let forms: Vec<Form> = forms.iter().map(along).collect();
                forms.iter().any(binds).then_some(Condition::Length { forms, shift, bound })
            }
        });
        let basis = free.iter().map(|n| std::array::from_fn(|k| self.basis.iter().zip(n).map(|(b, n)| b[k] * n).sum()));
        Self { unit: self.unit, basis: basis.collect(), conditions: conditions.collect() }
    }

    /// What each coordinate displaces.
    pub fn columns(&self) -> impl Iterator<Item = Form> {
        self.basis.iter().map(|b| std::array::from_fn(|k| self.unit[k] * b[k]))
    }

    /// The offset at the coordinates.
    pub fn offset(&self, u: &[f64]) -> Form {
        std::array::from_fn(|k| self.unit[k] * self.basis.iter().zip(u).map(|(b, u)| b[k] * u).sum::<f64>())
    }

    /// The coordinates of an offset of the set, of which every coordinate is a component.
    pub fn coordinates(&self, offset: &[f64]) -> Vec<f64> {
        self.basis
            .iter()
            .map(|b| (0..MAX_SIZE).map(|k| if b[k] == 0.0 { 0.0 } else { offset[k] / self.unit[k] }).sum())
            .collect()
    }

    /// How far the coordinates are outside of `t` times the set, as a part of it.
    pub fn violation(&self, u: &[f64], t: f64) -> f64 {
        let at = |f: &Form| f.iter().zip(u).map(|(f, u)| f * u).sum::<f64>();
        let outside = self.conditions.iter().map(|condition| match condition {
            Condition::Half { form, bound } => at(form) - t * bound,
            Condition::Length { forms, shift, bound } => {
                forms.iter().zip(shift).map(|(f, s)| (at(f) + s).powi(2)).sum::<f64>().sqrt() - t * bound
            }
        });
        outside.fold(0.0, f64::max)
    }
}
