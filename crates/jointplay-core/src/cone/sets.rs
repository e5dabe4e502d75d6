//! Sets of offsets and their faces, described by conditions on coordinates.
//!
//! Coordinates u displace `offset = unit basis u`, with half spaces and cones of second order as
//! conditions on u. A face of the set is the same around its middle.

use crate::clearance::Set;
use crate::clearance::offset::MAX_SIZE;
use crate::cone::bodies::{Atom, Form, Own};
use crate::math::vector::norm;

/// Tight, or no longer there: to rounding, as a part of one.
pub(super) const TIGHT: f64 = 1e-9;

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

/// The conditions of a body with the given first coordinate.
fn conditions(first: usize, atom: Atom) -> Vec<Condition> {
    let half = |terms: &[(usize, f64)], bound| Condition::Half { form: form(terms), bound };
    match atom {
        Atom::Interval { low, high } => vec![half(&[(first, 1.0)], high), half(&[(first, -1.0)], -low)],
        Atom::Round { size } => {
            let forms = (first..first + size).map(|k| form(&[(k, 1.0)])).collect();
            vec![Condition::Length { forms, shift: vec![0.0; size], bound: 1.0 }]
        }
        Atom::Tapered { arms, tapers } => {
            let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
            let sides = move |arm: usize| {
                signs.map(|[own, axis]| half(&[(first + 1 + arm, own), (first, axis * tapers[arm])], 1.0))
            };
            (0..arms).flat_map(sides).collect()
        }
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
        let own = Own::of(set);
        let mut unit = [0.0; MAX_SIZE];
        (0..set.size()).for_each(|k| unit[k] = set.half_width(k));
        let part = |column: &Form| std::array::from_fn(|k| if unit[k] > 0.0 { column[k] / unit[k] } else { 0.0 });
        let basis = own.columns().iter().map(part).collect();
        let conditions = own.atoms().flat_map(|(first, atom)| conditions(first, atom)).collect();
        Self { unit, basis, conditions }
    }

    /// A face that is a point: nothing moves.
    pub const fn point() -> Self {
        Self { unit: [0.0; MAX_SIZE], basis: Vec::new(), conditions: Vec::new() }
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

    /// The coordinates of an offset of the whole set, whose basis is orthogonal.
    pub fn coordinates(&self, offset: &[f64]) -> Vec<f64> {
        let along = |b: &Form| -> f64 {
            let parts = b.iter().zip(&self.unit).zip(offset);
            parts.map(|((b, unit), d)| if *b == 0.0 { 0.0 } else { b * d / unit }).sum()
        };
        self.basis.iter().map(|b| along(b) / b.iter().map(|b| b * b).sum::<f64>()).collect()
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
