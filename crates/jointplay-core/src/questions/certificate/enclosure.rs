//! Boxes that hold the pose for every value of the parameters.
//!
//! With F(q, u) = 0 the closure, u(x) the parameters of own coordinates x and C near the inverse of F_q, the pose of x
//! lies for every x of a part and every q in a box Q, about any q0 in Q and x0, in
//!
//! ```text
//! K(Q) = q0 - C F(q0, u(x0)) - C F_u(Q, u) (u(x) - u(x0)) + (1 - C F_q(Q, u)) (Q - q0)
//! ```
//!
//! which is Krawczyk's operator with the mean value theorem for poses and parameters together. Where K(Q) lies inside
//! Q, every x has exactly one pose in Q, it depends on x without a jump, and the closure is nowhere singular there:
//! the mechanism can be assembled everywhere and stays on its branch. Afterwards K only makes boxes smaller.

use crate::closure::newton::{Solver, State};
use crate::math::interval::Interval;
use crate::mechanism::Source;
use crate::questions::certificate::blocks::{Part, Product};
use crate::questions::certificate::chart::{Chart, Entries, Equations, Poses};

/// Rounds in which a box is widened until it holds its image.
const WIDENED: usize = 12;
/// How much wider than its image a box is tried.
const WIDER: f64 = 1.05;
/// A box that has grown by this factor is given up.
const LOST: f64 = 64.0;
/// Newton steps to the pose of a point, and the step below which it is close enough: the rest is enclosed.
const STEPS: usize = 60;
const CLOSE: f64 = 1e-15;
/// Rounds of an iteration that bounds the solution of a linear system.
const ROUNDS: usize = 200;
/// A bound is raised by this part, so that rounding does not hide that it holds.
const RAISED: f64 = 1e-9;

/// `1 - C F_q` over a box, row by row.
struct Defect {
    n: usize,
    entries: Vec<Interval>,
}

impl Defect {
    fn of(inverse: &Inverse, along_poses: &Entries) -> Self {
        let n = inverse.n;
        let mut entries = vec![Interval::ZERO; n * n];
        for i in 0..n {
            entries[i * (n + 1)] = Interval::ONE;
        }
        for &(row, column, value) in along_poses {
            for i in 0..n {
                let c = inverse.at(i, row);
                if c != 0.0 {
                    let entry = &mut entries[i * n + column];
                    *entry = *entry - value.scaled(c);
                }
            }
        }
        Self { n, entries }
    }

    fn times(&self, x: &[Interval]) -> Vec<Interval> {
        let row = |row: &[Interval]| row.iter().zip(x).fold(Interval::ZERO, |sum, (e, x)| sum + *e * *x);
        self.entries.chunks_exact(self.n).map(row).collect()
    }

    fn transposed_times(&self, y: &[Interval]) -> Vec<Interval> {
        let mut sum = vec![Interval::ZERO; self.n];
        for (row, y) in self.entries.chunks_exact(self.n).zip(y).filter(|(_, y)| !y.is_zero()) {
            sum.iter_mut().zip(row).for_each(|(sum, e)| *sum = *sum + *e * *y);
        }
        sum
    }
}

/// All solutions of `x = b + A x` for matrices of which one has a spectral radius below one, A given by its product.
///
/// Numbers `m >= |b| + |A| m` bound |x|, which follows from the series of x. Then x is put in its own equation.
fn fixed_point(b: &[Interval], product: impl Fn(&[Interval]) -> Vec<Interval>) -> Option<Vec<Interval>> {
    let own: Vec<f64> = b.iter().map(|b| b.size()).collect();
    let image = |m: &[f64]| -> Vec<f64> {
        let all: Vec<Interval> = m.iter().map(|&m| Interval::of_size(m)).collect();
        product(&all).iter().zip(b).map(|(p, b)| (*p + Interval::of_size(b.size())).size()).collect()
    };
    let mut m = own;
    let mut bounded = false;
    for _ in 0..ROUNDS {
        let next = image(&m);
        if !next.iter().all(|x| x.is_finite()) {
            return None;
        }
        bounded = next.iter().zip(&m).all(|(next, m)| next <= m);
        if bounded {
            break;
        }
        m = next.iter().zip(&m).map(|(next, m)| (next.max(*m)) * (1.0 + RAISED) + f64::MIN_POSITIVE).collect();
    }
    if !bounded {
        return None;
    }
    let mut x: Vec<Interval> = m.iter().map(|&m| Interval::of_size(m)).collect();
    for _ in 0..ROUNDS {
        let images = product(&x);
        let next: Option<Vec<Interval>> =
            images.iter().zip(b).zip(&x).map(|((p, b), x)| (*p + *b).common(*x)).collect();
        let next = next?;
        let still = next.iter().zip(&x).all(|(next, x)| next.width() > 0.99 * x.width());
        x = next;
        if still {
            break;
        }
    }
    Some(x)
}

/// Numbers near the inverse of the closure Jacobian.
struct Inverse {
    n: usize,
    /// Column by column.
    columns: Vec<f64>,
}

impl Inverse {
    fn at(&self, row: usize, column: usize) -> f64 {
        self.columns[column * self.n + row]
    }

    fn times(&self, residual: &[Interval]) -> Vec<Interval> {
        let mut product = vec![Interval::ZERO; self.n];
        for (column, r) in self.columns.chunks_exact(self.n).zip(residual).filter(|(_, r)| !r.is_zero()) {
            product.iter_mut().zip(column).for_each(|(sum, c)| *sum = *sum + r.scaled(*c));
        }
        product
    }

    fn transposed_times(&self, y: &[Interval]) -> Vec<Interval> {
        let along = |column: &[f64]| column.iter().zip(y).fold(Interval::ZERO, |sum, (c, y)| sum + y.scaled(*c));
        self.columns.chunks_exact(self.n).map(along).collect()
    }
}

/// The poses of a part of the product of sets.
pub(super) struct Enclosure {
    /// Boxes of the coordinates.
    pub v: Vec<Interval>,
    /// The part. The lines to it from the point that it was expanded about belong to what is enclosed.
    pub part: Part,
    pub poses: Poses,
    pub parameters: Vec<Interval>,
    pub equations: Equations,
    defect: Defect,
}

/// The pose of one point.
pub(super) struct At {
    pub x: Vec<f64>,
    /// Near the pose.
    near: Vec<f64>,
    /// A box that holds it.
    pub v: Vec<Interval>,
    pub parameters: Vec<Interval>,
}

/// Encloses poses of one branch.
pub(super) struct Encloser<'m> {
    pub chart: Chart<'m>,
    pub product: Product,
    sources: &'m [Source],
    /// The parameters that the offsets of the sources add to.
    centre: Vec<f64>,
    inverse: Inverse,
}

fn points(x: &[f64]) -> Vec<Interval> {
    x.iter().map(|&x| Interval::from_point(x)).collect()
}

impl<'m> Encloser<'m> {
    /// About a closed state at its drive values, for offsets of some sources from given parameters; `None` where the
    /// closure is singular.
    pub fn new(solver: &Solver<'m>, state: &State, sources: &'m [Source], centre: &[f64]) -> Option<Self> {
        let m = solver.mechanism;
        let factors = solver.linearise(state)?.factors;
        let n = m.n_unknowns();
        let mut columns = vec![0.0; n * n];
        for (k, column) in columns.chunks_exact_mut(n).enumerate() {
            let mut unit = vec![0.0; n];
            unit[k] = 1.0;
            factors.solve(&mut unit, column);
        }
        if columns.iter().any(|c| !c.is_finite()) {
            return None;
        }
        let chart = Chart::new(m, &state.inputs.drives, &state.coordinates);
        let inverse = Inverse { n, columns };
        Some(Self { chart, product: Product::of(sources), sources, centre: centre.to_vec(), inverse })
    }

    /// Parameter values of own coordinates.
    pub fn parameters(&self, x: &[Interval]) -> Vec<Interval> {
        let mut parameters = points(&self.centre);
        for source in self.sources {
            let offset = source.set.of_own(&x[source.range()]);
            parameters[source.range()].iter_mut().zip(offset).for_each(|(p, offset)| *p = *p + offset);
        }
        parameters
    }

    /// What goes along the parameters, along the own coordinates.
    pub fn own_gradient(&self, gradient: &[Interval]) -> Vec<Interval> {
        let of = |source: &Source| source.set.own_gradient(&gradient[source.range()])[..source.set.size()].to_vec();
        self.sources.iter().flat_map(of).collect()
    }

    fn expanded(&self, v: Vec<Interval>, part: &Part, from: &[f64]) -> Enclosure {
        let (poses, parameters) = (self.chart.poses(&v), self.parameters(&part.around(from)));
        let equations = self.chart.equations(&v, &poses, &parameters);
        let defect = Defect::of(&self.inverse, &equations.along_poses);
        Enclosure { v, part: part.clone(), poses, parameters, equations, defect }
    }

    fn residual(&self, v: &[f64], parameters: &[Interval]) -> Vec<Interval> {
        let v = points(v);
        self.chart.residual(&self.chart.poses(&v), parameters)
    }

    /// What the poses are off by while the parameters go through a part, to first order with all that is left out:
    /// `-C F_u (u(x) - u(x0))` for poses and parameters of an enclosure.
    fn spreads(&self, of: &Enclosure, part: &Part, from: &[f64]) -> Vec<Interval> {
        let (n, n_parameters) = (self.inverse.n, self.centre.len());
        let mut rows = vec![Interval::ZERO; n * n_parameters];
        for &(row, p, value) in &of.equations.along_parameters {
            for i in 0..n {
                let c = self.inverse.at(i, row);
                if c != 0.0 {
                    let entry = &mut rows[i * n_parameters + p];
                    *entry = *entry + value.scaled(c);
                }
            }
        }
        let spread = |row: &[Interval]| self.product.spread(part, &self.own_gradient(row), from);
        (0..n).map(|i| spread(&rows[i * n_parameters..(i + 1) * n_parameters])).collect()
    }

    /// Krawczyk's operator for a part, about a point of it, the box being that of an enclosure.
    fn image(&self, of: &Enclosure, part: &Part, at: &At) -> Vec<Interval> {
        let from = points(&at.near);
        let off: Vec<Interval> = of.v.iter().zip(&from).map(|(v, from)| *v - *from).collect();
        let bent = of.defect.times(&off);
        let spreads = self.spreads(of, part, &at.x);
        let newton = self.inverse.times(&self.residual(&at.near, &at.parameters));
        (0..off.len()).map(|k| from[k] - newton[k] + spreads[k] + bent[k]).collect()
    }

    /// A box around poses that holds its image for a whole part: the poses of the part.
    pub fn prove(&self, part: &Part) -> Option<Enclosure> {
        let x = self.product.centre(part);
        let parameters = self.parameters(&points(&x));
        let at = At { near: vec![0.0; self.inverse.n], v: Vec::new(), parameters, x };
        let mut image = self.image(&self.expanded(points(&at.near), part, &at.x), part, &at);
        let sizes: Vec<f64> = image.iter().map(|v| v.size()).collect();
        for _ in 0..WIDENED {
            let wider = |v: &Interval, size: &f64| {
                v.hull(Interval::ZERO).scaled(WIDER) + Interval::of_size(1e-3 * size + f64::EPSILON)
            };
            let v: Vec<Interval> = image.iter().zip(&sizes).map(|(v, size)| wider(v, size)).collect();
            if !v.iter().zip(&sizes).all(|(v, size)| v.size() <= LOST * (size + 1e3 * f64::EPSILON)) {
                return None;
            }
            let tried = self.expanded(v, part, &at.x);
            image = self.image(&tried, part, &at);
            if tried.v.iter().zip(&image).all(|(v, image)| v.surrounds(*image)) {
                return self.smaller(&tried, part, &at).and_then(|found| self.smaller(&found, part, &at));
            }
        }
        None
    }

    /// The poses of a part that belongs to an enclosure, by one more image.
    fn smaller(&self, of: &Enclosure, part: &Part, at: &At) -> Option<Enclosure> {
        let image = self.image(of, part, at);
        let common = image.iter().zip(&of.v).zip(&at.near);
        let v = common.map(|((image, v), near)| Some(image.common(*v)?.hull(Interval::from_point(*near))));
        Some(self.expanded(v.collect::<Option<_>>()?, part, &at.x))
    }

    /// The pose of a point of the product, within an enclosure that holds it.
    pub fn at(&self, x: Vec<f64>, within: &Enclosure) -> Option<At> {
        let parameters = self.parameters(&points(&x));
        let mut near: Vec<f64> = within.v.iter().map(|v| v.middle()).collect();
        let newton_step = |near: &[f64]| self.inverse.times(&self.residual(near, &parameters));
        let mut newton = newton_step(&near);
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let largest = newton.iter().fold(0.0, |largest: f64, step| largest.max(step.middle().abs()));
            if largest <= CLOSE || largest >= last {
                break;
            }
            last = largest;
            for ((near, step), v) in near.iter_mut().zip(&newton).zip(&within.v) {
                *near = (*near - step.middle()).clamp(v.low, v.high);
            }
            newton = newton_step(&near);
        }
        // q - q0 = -C F(q0) + (1 - C F_q) (q - q0)
        let off: Vec<Interval> = newton.iter().map(|step| -*step).collect();
        let off = fixed_point(&off, |x| within.defect.times(x))?;
        let v = off.iter().zip(&near).zip(&within.v);
        let v = v.map(|((off, near), v)| (*off + Interval::from_point(*near)).common(*v)).collect::<Option<_>>()?;
        Some(At { x, near, v, parameters })
    }

    /// The poses of a part, about a point, both of which belong to an enclosure.
    pub fn within(&self, enclosure: &Enclosure, part: &Part, at: &At) -> Option<Enclosure> {
        self.smaller(enclosure, part, at).and_then(|found| self.smaller(&found, part, at))
    }

    /// The gradient along the own coordinates, over an enclosure, of a cost given by its gradients along poses and
    /// parameters: with `J^T l = c_q` it is `c_u - F_u^T l`.
    pub fn gradient(&self, of: &Enclosure, twists: &[Interval], parameters: &[Interval]) -> Option<Vec<Interval>> {
        let size = self.chart.mechanism.size();
        let bodies = twists.chunks_exact(size).zip(of.v.chunks_exact(size));
        let along: Vec<Interval> = bodies.flat_map(|(twist, v)| self.chart.along_body(twist, v)).collect();
        // l' = c_q' F_q^-1 = c_q' (1 - defect)^-1 C
        let weights = fixed_point(&along, |y| of.defect.transposed_times(y))?;
        let multipliers = self.inverse.transposed_times(&weights);
        let mut gradient = parameters.to_vec();
        for &(row, p, value) in &of.equations.along_parameters {
            gradient[p] = gradient[p] + value * multipliers[row];
        }
        Some(self.own_gradient(&gradient))
    }
}
