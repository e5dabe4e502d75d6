//! Where the poses of parts of the sets are, proved; and what is linear in it.
//!
//! With F(q, u) = 0 the closure, u(x) the parameters of own coordinates x = x0 + d and C near the inverse of `F_q` at x0, a
//! pose is
//!
//! ```text
//! q(x) = q0 + S d + z        q0 near q(x0),  S near dq / dx there,  z in a box Z
//! ```
//!
//! All that depends on poses and parameters is an affine form in d then, z being a remainder; in slabs in `x - c` and
//! `t - t0`, with c in the middle of the part, from which no x is as far as from x0. Krawczyk's operator on z,
//!
//! ```text
//! K(Z) = -C F(q0 + S d, u(x)) + (1 - C F_q(q0 + S d + Z, u(x))) Z
//! ```
//!
//! holds z where Z does. Where K(Z) lies inside Z, every x of the part has exactly one pose with its z in Z, it depends on
//! x without a jump, and the closure is nowhere singular there: the mechanism can be assembled everywhere in the part
//! and stays on its branch. The box is one of z itself, or of other coordinates of it ([`Modes`]). Of a part of a part the same poses are sought, so that they need to be held only.

mod gradient;
mod straight;

use std::cell::Cell;

use crate::closure::newton::State;
use crate::math::affine::{Form, Forms, Group, Rooms, Unknowns};
use crate::math::interval::Interval;
use crate::math::real::Real;
use crate::math::vector::norm;
use crate::mechanism::{Mechanism, Source};
use crate::questions::certificate::blocks::{Block, Part, Product};
use crate::questions::certificate::chart::{Chart, Equations, Poses};
use crate::questions::certificate::inverse::Inverse;
use crate::questions::certificate::linear::Defect;
use crate::questions::certificate::modes::{Modes, units};
use crate::questions::certificate::slabs::Slabs;

/// Rounds in which a box is widened until it holds its image.
const WIDENED: usize = 12;
/// How much wider than its image a box is tried.
const WIDER: f64 = 1.2;
/// A box that has grown by this factor is given up.
const LOST: f64 = 1e3;
/// Below this a box is rounding; and how much wider than the box of a point, so that it holds those of other points, too.
const ROUNDING: f64 = 1e-15;
const POINTS: f64 = 4.0;
/// Newton steps to the pose of a point at most, and the step below which it is close enough: the rest is enclosed.
const STEPS: usize = 60;
const CLOSE: f64 = 1e-15;
/// Corrections of the first derivative of the pose.
const CORRECTIONS: usize = 3;

/// The pose of one point.
pub(super) struct At {
    pub x: Vec<f64>,
    /// Near the pose.
    near: Vec<f64>,
    /// A box that holds it.
    pub v: Vec<Interval>,
    pub parameters: Vec<Interval>,
}

/// The poses of a part, and of the lines to it from the point that they are expanded about.
pub(super) struct Enclosure {
    pub part: Part,
    /// The point, what is near its pose, and the slopes from there.
    from: Vec<f64>,
    near: Vec<f64>,
    slopes: Vec<f64>,
    /// What poses are off by from that line, in these coordinates.
    modes: Modes,
    z: Vec<Interval>,
    defect: Defect,
}

/// What depends on the poses of an enclosure, as forms.
pub(super) struct Expanded<'f> {
    pub v: Vec<Form<'f>>,
    pub poses: Poses<Form<'f>>,
    pub parameters: Vec<Form<'f>>,
    pub equations: Equations<Form<'f>>,
}

/// Encloses poses of one branch.
pub(super) struct Encloser<'m> {
    pub chart: Chart<'m>,
    pub product: Product,
    sources: &'m [Source],
    /// The parameters that the offsets of the sources add to.
    centre: Vec<f64>,
    /// Whether a box of components did not hold some poses.
    is_soft: Cell<bool>,
    /// Memory of forms that are done with.
    rooms: Rooms,
}

/// What is linear in the closure near the pose of a point.
struct Linear {
    inverse: Inverse,
    /// Near `dq / dx`, row by row.
    slopes: Vec<f64>,
}

fn points(x: &[f64]) -> Vec<Interval> {
    x.iter().map(|&x| Interval::from_point(x)).collect()
}

/// What is linear, with a value at a point, where it is written about another one.
fn from_base(value: f64, coefficients: &[f64], point: &[f64], base: &[f64]) -> Interval {
    let moved = point.iter().zip(base).zip(coefficients);
    moved.fold(Interval::from_point(value), |sum, ((point, base), c)| {
        sum + (Interval::from_point(*base) - Interval::from_point(*point)).scaled(*c)
    })
}

impl Enclosure {
    fn n_own(&self) -> usize {
        self.slopes.len() / self.near.len().max(1)
    }

    /// Whether all poses are known on the line to a point, which may lie beside the sets: it is among those that forms are
    /// for.
    fn reaches(&self, product: &Product, x: &[f64]) -> bool {
        let base = product.base(&self.part, &self.from);
        let off = |block: &Block, from: &[f64]| norm(&block.range().map(|k| x[k] - from[k]).collect::<Vec<_>>());
        let is_near = |block: &Block| {
            off(block, &base) <= block.radius_with(&base, &self.from)
                && off(block, &self.from) <= block.radius(&self.from)
        };
        let between = self.part.around(&self.from);
        between.iter().zip(x).all(|(between, x)| between.contains(*x)) && product.blocks.iter().all(is_near)
    }

    /// Near the pose of a point.
    fn near(&self, x: &[f64]) -> Vec<f64> {
        let rows = self.slopes.chunks_exact(self.n_own().max(1)).zip(&self.near);
        rows.map(|(row, near)| {
            near + row.iter().zip(x.iter().zip(&self.from)).map(|(s, (x, from))| s * (x - from)).sum::<f64>()
        })
        .collect()
    }

    /// Whether the pose of a point is among those that are enclosed.
    pub fn holds(&self, at: &At) -> bool {
        let n = self.n_own();
        let off = |i: usize| {
            let slopes = self.slopes[i * n..(i + 1) * n].iter().zip(at.x.iter().zip(&self.from));
            let moved = slopes.fold(Interval::from_point(self.near[i]), |sum, (s, (x, from))| {
                sum + (Interval::from_point(*x) - Interval::from_point(*from)).scaled(*s)
            });
            at.v[i] - moved
        };
        let z = self.modes.coordinates_of(&(0..at.v.len()).map(off).collect::<Vec<_>>());
        self.z.iter().zip(z).all(|(enclosed, z)| enclosed.surrounds(z))
    }
}

impl<'m> Encloser<'m> {
    /// About a closed state at its drive values, for offsets of some sources from given parameters.
    pub fn new(m: &'m Mechanism, state: &State, sources: &'m [Source], centre: &[f64]) -> Self {
        let chart = Chart::new(m, &state.inputs.drives, &state.coordinates);
        Self {
            chart,
            product: Product::of(sources),
            sources,
            centre: centre.to_vec(),
            is_soft: Cell::new(false),
            rooms: Rooms::default(),
        }
    }

    /// Divides the sets along what moves most, as seen from a point; false where nothing does.
    pub fn divide(&mut self, at: &At) -> bool {
        let (n, units) = (self.product.n, units(self.chart.mechanism));
        let Some(Linear { slopes: mut motions, .. }) = self.linear(&at.x, &at.near) else { return false };
        motions.chunks_exact_mut(n.max(1)).zip(units).for_each(|(row, unit)| row.iter_mut().for_each(|x| *x /= unit));
        let slabs = Slabs::largest(n, &motions, |direction| self.product.reach(direction));
        let Some(slabs) = slabs else { return false };
        self.product.divide(slabs);
        true
    }

    /// Parameter values of own coordinates.
    fn parameters<S: Real>(&self, x: &[S]) -> Vec<S> {
        let mut parameters: Vec<S> = self.centre.iter().map(|&c| S::from_f64(c)).collect();
        for source in self.sources {
            let offset = source.set.of_own(&x[source.range()]);
            parameters[source.range()].iter_mut().zip(offset).for_each(|(p, offset)| *p = *p + offset);
        }
        parameters
    }

    /// What goes along the parameters, along the own coordinates.
    fn own_gradient<S: Real>(&self, gradient: &[S]) -> Vec<S> {
        let of = |source: &Source| source.set.own_gradient(&gradient[source.range()])[..source.set.size()].to_vec();
        self.sources.iter().flat_map(of).collect()
    }

    /// The unknowns of a part about a point; and, with `off`, one between -1 and 1 for what each pose coordinate is off.
    pub fn forms(&self, part: &Part, from: &[f64], off: bool) -> Forms {
        let base = self.product.base(part, from);
        let far = |(x, base): (&Interval, &f64)| (*x - Interval::from_point(*base)).size();
        let mut sizes: Vec<f64> = part.around(from).iter().zip(&base).map(far).collect();
        let group = |block: &Block| Group { range: block.range(), radius: block.radius_with(&base, from) };
        sizes.resize(sizes.len() + if off { self.chart.mechanism.n_unknowns() } else { 0 }, 1.0);
        Forms::new(Unknowns::new(sizes, self.product.blocks.iter().map(group)), &self.rooms)
    }

    /// All that depends on poses `q0 + S d + z` and on their parameters, for z with its coordinates in a box, if any.
    fn expand<'f>(
        &self,
        forms: &'f Forms,
        (part, at): (&Part, &At),
        slopes: &[f64],
        z: Option<(&Modes, &[Interval])>,
    ) -> Expanded<'f> {
        let (n, known) = (self.product.n, at.x.len());
        let base = self.product.base(part, &at.x);
        let unknown = |k: usize, size: f64| forms.linear(0.0, [(k, size)].into_iter(), 0.0);
        let coordinate = |(j, z): (usize, &Interval)| {
            let (middle, size) = z.split();
            unknown(known + j, size) + Form::from_f64(middle)
        };
        let coordinates: Vec<Form<'_>> = z.map_or(&[][..], |(_, z)| z).iter().enumerate().map(coordinate).collect();
        let v = |i: usize| {
            let row = &slopes[i * n..(i + 1) * n];
            let split = self.product.slabs.split(row);
            let rounding = self.product.slabs.rounding(row, &split);
            let (near, off) = from_base(at.near[i], &split, &at.x, &base).split();
            let line = forms.linear(near, split.into_iter().enumerate(), rounding + off);
            let motion = z.map_or(&[][..], |(modes, _)| modes.motion(i));
            let moved = motion.iter().copied().zip(coordinates.iter().copied()).filter(|(c, _)| *c != 0.0);
            forms.sum([(1.0, line)].into_iter().chain(moved))
        };
        let v: Vec<Form<'_>> = (0..at.near.len()).map(v).collect();
        let x = |k: usize| unknown(k, 1.0) + Form::from_f64(base[k]);
        let parameters = self.parameters(&(0..n).map(x).collect::<Vec<_>>());
        let poses = self.chart.poses(&v);
        let equations = self.chart.equations(&v, &poses, &parameters, Form::is_zero);
        Expanded { v, poses, parameters, equations }
    }

    /// The closure near the pose of a point: with C the inverse, `dq / dx = C F_u`, corrected by what C is not the inverse.
    fn linear(&self, x: &[f64], near: &[f64]) -> Option<Linear> {
        let (v, parameters) = (points(near), self.parameters(&points(x)));
        let equations = self.chart.equations(&v, &self.chart.poses(&v), &parameters, Interval::is_zero);
        let (n, rows) = (self.product.n, near.len());
        let inverse = Inverse::of(rows, &equations.along_poses)?;
        let mut right = vec![Interval::ZERO; rows * self.centre.len()];
        for &(row, p, value) in &equations.along_parameters {
            right[row * self.centre.len() + p] = value;
        }
        let right = right.chunks_exact(self.centre.len().max(1)).flat_map(|row| self.own_gradient(row));
        let right: Vec<f64> = right.map(Interval::middle).collect();
        let mut slopes = inverse.times_rows(&right, n);
        for _ in 0..CORRECTIONS {
            let mut left = right.clone();
            for &(row, column, value) in &equations.along_poses {
                let value = value.middle();
                for k in 0..n {
                    left[row * n + k] -= value * slopes[column * n + k];
                }
            }
            let more = inverse.times_rows(&left, n);
            slopes.iter_mut().zip(more).for_each(|(s, more)| *s += more);
        }
        Some(Linear { inverse, slopes })
    }

    /// All values of a form on a part and on the lines to it.
    pub fn ranged(&self, part: &Part, x: &[f64], form: Form<'_>) -> Interval {
        let (centre, coefficients, rest) = form.parts(x.len());
        let base = self.product.base(part, x);
        let spread = self.product.spread(part, &points(&coefficients), &base);
        let point = -from_base(0.0, &coefficients, x, &base);
        let range = Interval::from_point(centre) + spread.hull(point);
        (range + Interval::of_size(rest)).common(form.range()).unwrap_or(Interval::LINE)
    }

    /// The poses of a part about a point.
    pub fn enclose<'f>(&self, forms: &'f Forms, part: &Part, at: &At) -> Option<(Enclosure, Expanded<'f>)> {
        let Linear { inverse, slopes } = self.linear(&at.x, &at.near)?;
        let straight = self.forms(part, &at.x, false);
        let derivatives = self.derivatives(&straight, (part, at), &slopes);
        let enclosed = |modes: Modes| {
            let bent = self.bent(&modes, part, at, &straight, &derivatives);
            self.enclosed(forms, part, at, (&slopes, modes, &bent))
        };
        let components = || enclosed(Modes::components(&inverse));
        let soft = || enclosed(Modes::soft(self.chart.mechanism, &inverse)?);
        let found = if self.is_soft.get() {
            soft().or_else(components)
        } else {
            components().or_else(|| soft().inspect(|_| self.is_soft.set(true)))
        };
        found.or_else(|| enclosed(Modes::singular(self.chart.mechanism, &inverse)?))
    }

    /// The same in given coordinates.
    fn enclosed<'f>(
        &self,
        forms: &'f Forms,
        part: &Part,
        at: &At,
        (slopes, modes, bent): (&[f64], Modes, &[Interval]),
    ) -> Option<(Enclosure, Expanded<'f>)> {
        let point: Vec<Interval> =
            at.v.iter().zip(&at.near).map(|(v, near)| *v - Interval::from_point(*near)).collect();
        let point = modes.coordinates_of(&point);
        let wider = |(image, point): (&Interval, &Interval)| {
            let more = 0.1 * image.size() + POINTS * point.size() + ROUNDING;
            image.hull(Interval::ZERO).scaled(WIDER) + Interval::of_size(more)
        };
        let mut z: Vec<Interval> = bent.iter().zip(&point).map(wider).collect();
        let largest = |z: &[Interval]| z.iter().fold(ROUNDING, |largest, z| largest.max(z.size()));
        for _ in 0..WIDENED {
            if !z.iter().all(|z| z.is_finite()) || largest(&z) > LOST * largest(bent) {
                return None;
            }
            let before = forms.count();
            let expanded = self.expand(forms, (part, at), slopes, Some((&modes, &z)));
            let after = forms.count();
            let defect = Defect::of(&modes, forms, &expanded.equations.along_poses);
            forms.back_to(after);
            let image: Vec<Interval> = defect.times(&z).iter().zip(bent).map(|(e, bent)| *bent + *e).collect();
            if z.iter().zip(&image).all(|(z, image)| z.surrounds(*image)) {
                let (from, near, slopes) = (at.x.clone(), at.near.clone(), slopes.to_vec());
                let found = Enclosure { part: part.clone(), from, near, slopes, modes, z, defect };
                // The pose of the point is one of those that are enclosed, and with it all poses of its branch.
                return found.holds(at).then_some((found, expanded));
            }
            z = image.iter().zip(&point).map(wider).collect();
            forms.back_to(before);
        }
        None
    }

    /// The pose that the chart begins at, for the middle of the whole product.
    pub fn middle(&self) -> Option<At> {
        self.closed(self.product.centre(&self.product.whole()), vec![0.0; self.chart.mechanism.n_unknowns()])
    }

    /// The pose of a point of an enclosure.
    pub fn at(&self, x: Vec<f64>, within: &Enclosure) -> Option<At> {
        self.beside(x, within).filter(|at| within.holds(at))
    }

    /// A pose of a point that may be beside an enclosure, near where this has it.
    pub fn beside(&self, x: Vec<f64>, enclosure: &Enclosure) -> Option<At> {
        let near = enclosure.near(&x);
        self.closed(x, near)
    }

    /// Whether two enclosures that hold the poses of a point have the same one for it.
    pub fn is_one_branch(&self, x: Vec<f64>, both: [&Enclosure; 2]) -> bool {
        let reach = |enclosure: &Enclosure| enclosure.reaches(&self.product, &x);
        let reached = both.iter().all(|enclosure| reach(enclosure));
        reached && self.beside(x, both[0]).is_some_and(|at| both.iter().all(|enclosure| enclosure.holds(&at)))
    }

    /// The pose of a point, near given coordinates.
    fn closed(&self, x: Vec<f64>, mut near: Vec<f64>) -> Option<At> {
        let parameters = self.parameters(&points(&x));
        let v = points(&near);
        let equations = self.chart.equations(&v, &self.chart.poses(&v), &parameters, Interval::is_zero);
        let inverse = Inverse::of(near.len(), &equations.along_poses)?;
        let newton_step = |near: &[f64]| {
            let v = points(near);
            inverse.times(&self.chart.residual(&self.chart.poses(&v), &parameters))
        };
        let mut newton = newton_step(&near);
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let largest = newton.iter().fold(0.0, |largest: f64, step| largest.max(step.middle().abs()));
            if largest <= CLOSE || !(largest < last) {
                break;
            }
            last = largest;
            near.iter_mut().zip(&newton).for_each(|(near, step)| *near -= step.middle());
            newton = newton_step(&near);
        }
        // Krawczyk's operator on a box a few times as wide as the last step and its rounding.
        let mut off: Vec<Interval> = newton.iter().map(|step| Interval::of_size(step.size())).collect();
        for _ in 0..WIDENED {
            let wider = off.iter().map(|off| Interval::of_size(2.0 * off.size() + ROUNDING)).collect::<Vec<_>>();
            let v: Vec<Interval> =
                wider.iter().zip(&near).map(|(off, near)| *off + Interval::from_point(*near)).collect();
            let equations = self.chart.equations(&v, &self.chart.poses(&v), &parameters, Interval::is_zero);
            let defect = Defect::of_intervals(&inverse, &equations.along_poses);
            off = defect.times(&wider).iter().zip(&newton).map(|(e, step)| *e - *step).collect();
            if wider.iter().zip(&off).all(|(wider, off)| wider.surrounds(*off)) {
                let v = off.iter().zip(&near).map(|(off, near)| *off + Interval::from_point(*near)).collect();
                return Some(At { x, near, v, parameters });
            }
        }
        None
    }
}
