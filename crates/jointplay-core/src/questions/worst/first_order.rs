//! How far the linearised error reaches, along any direction.
//!
//! The set of first-order errors is a sum of linear images of the admissible sets, so that its reach along
//! a unit vector u is its support function `h(u) = sum_j h_j(A_j^T u)`, and the largest error is the
//! largest reach over all u. The support point E along u leads on: along E / |E| the reach is at least |E|.
//!
//! The search starts from a mesh of directions, and tells how much it can have missed. On a cell of the mesh
//! every u is a combination of the corners `v_i` with weights that sum to at most `1 / cos(rho)`, rho the
//! radius of the cell's circumscribed circle; h is convex and homogeneous, and therefore
//!
//! ```text
//! h(u) <= max_i h(v_i) / cos(rho)          on the cell
//! ```
//!
//! In space cells that may hide more than the tolerance are divided.

use std::borrow::Cow;
use std::f64::consts::TAU;
use std::sync::OnceLock;

use crate::clearance::Set;
use crate::clearance::offset::MAX_SIZE;
use crate::closure::sensitivity::Output;
use crate::interrupt;
use crate::math::lanes::block::{Block, LANES};
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::math::mesh::{cosine_of_radius, mesh, unit};
use crate::math::vector::{Vec3, add, dot, norm, scale};
use crate::mechanism::{Mechanism, Source};

/// Directions of the plane, besides those where a support point jumps.
const FAN: usize = 360;
/// Alternations between direction and support point.
const ALTERNATIONS: usize = 60;
/// In space the bound is at most this part above the largest reach found, or the most cells are used.
const TOLERANCE: f64 = 1e-3;
/// Cells that are looked at at most.
const MOST_CELLS: usize = 20_000;

/// The largest reach.
#[derive(Clone, Debug)]
pub struct Farthest {
    /// Directions of local maxima, the largest first.
    pub directions: Vec<Vec3<f64>>,
    /// What the largest reach certainly does not exceed.
    pub bound: f64,
}

/// The linearised error in up to three components of one unit.
pub struct Reach<'m> {
    sources: &'m [Source],
    /// The image of every parameter.
    columns: Vec<Vec3<f64>>,
    /// The error with every offset at zero.
    base: Vec3<f64>,
    dimensions: usize,
}

impl<'m> Reach<'m> {
    /// Of the output components in a range; `shift` is the error that drive values other than the nominal
    /// ones make.
    #[must_use]
    pub fn new(mechanism: &'m Mechanism, map: &Output, shift: &[f64], range: std::ops::Range<usize>) -> Self {
        let of = |p: usize| {
            let mut column = [0.0; 3];
            column.iter_mut().zip(range.clone()).for_each(|(c, i)| *c = map.parameters[(i, p)]);
            column
        };
        let columns: Vec<Vec3<f64>> = (0..mechanism.n_parameters()).map(of).collect();
        let mut base = [0.0; 3];
        base.iter_mut().zip(range.clone()).for_each(|(b, i)| *b = shift[i]);
        for (column, &centre) in columns.iter().zip(&mechanism.centre) {
            base = add(base, scale(*column, centre));
        }
        Self { sources: mechanism.sources(), columns, base, dimensions: range.len() }
    }

    /// What a direction pulls a source's offsets by.
    fn pull(&self, source: &Source, direction: Vec3<f64>) -> [f64; MAX_SIZE] {
        let mut w = [0.0; MAX_SIZE];
        for (w, p) in w.iter_mut().zip(source.range()) {
            *w = dot(self.columns[p], direction);
        }
        w
    }

    /// The farthest error along a direction.
    fn support_point(&self, direction: Vec3<f64>) -> Vec3<f64> {
        let mut error = self.base;
        for source in self.sources {
            let w = self.pull(source, direction);
            let face = source.set.face(&w[..source.set.size()], 0.0);
            for (offset, p) in face.centre.iter().zip(source.range()) {
                error = add(error, scale(self.columns[p], *offset));
            }
        }
        error
    }

    fn reach(&self, direction: Vec3<f64>) -> f64 {
        let sources = self.sources.iter();
        sources
            .fold(dot(self.base, direction), |reach, source| reach + source.set.support(&self.pull(source, direction)))
    }

    /// The reach along many directions.
    fn reaches(&self, directions: &[Vec3<f64>]) -> Vec<f64> {
        dispatch(Reaches { reach: self, directions })
    }

    /// Goes from a direction to that of its support point, until nothing is gained.
    fn climb(&self, mut direction: Vec3<f64>) -> (Vec3<f64>, f64) {
        interrupt::check();
        let mut reached = self.reach(direction);
        for _ in 0..ALTERNATIONS {
            let error = self.support_point(direction);
            let distance = norm(&error);
            if distance == 0.0 {
                break;
            }
            direction = scale(error, 1.0 / distance);
            let next = self.reach(direction);
            let gain = next - reached;
            reached = next;
            if gain.abs() <= 1e-15 * reached {
                break;
            }
        }
        (direction, reached)
    }

    /// Local maxima of the reach over all directions.
    #[must_use]
    pub fn farthest(&self) -> Farthest {
        let directions = match self.dimensions {
            1 => Cow::Owned(vec![[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]),
            2 => Cow::Owned(self.fan()),
            _ => Cow::Borrowed(&mesh().corners[..]),
        };
        let reach = self.reaches(&directions);
        let mut maxima = Maxima::default();
        let n = directions.len();
        for (k, &direction) in directions.iter().enumerate() {
            let highest = |neighbours: &[usize]| neighbours.iter().all(|&other| reach[other] <= reach[k]);
            let is_maximum = match self.dimensions {
                1 => true,
                2 => highest(&[(k + n - 1) % n, (k + 1) % n]),
                _ => highest(&mesh().neighbours[k]),
            };
            if is_maximum {
                maxima.insert(self.climb(direction));
            }
        }
        let bound = match self.dimensions {
            1 => maxima.largest(),
            2 => reach.iter().copied().fold(0.0, f64::max) / (0.5 * TAU / FAN as f64).cos(),
            _ => self.bound(&mut maxima, &reach),
        };
        let bound = bound.max(maxima.largest());
        Farthest { directions: maxima.largest_first(), bound }
    }

    /// Directions of the plane in their order, with those on either side of a jump of a support point.
    fn fan(&self) -> Vec<Vec3<f64>> {
        let mut fan = even_fan().to_vec();
        let planar = |angle: f64| (angle, [angle.cos(), angle.sin(), 0.0]);
        for source in self.sources {
            for form in source.set.break_forms() {
                // form . (A^T u) = g . u vanishes at right angles to g.
                let g = source.range().zip(form).fold([0.0; 3], |g, (p, f)| add(g, scale(self.columns[p], f)));
                let across = g[0].atan2(-g[1]);
                for k in 0..2 {
                    let angle = across + 0.5 * TAU * f64::from(k);
                    fan.extend([angle - 1e-7, angle + 1e-7].map(|a: f64| planar(a.rem_euclid(TAU))));
                }
            }
        }
        fan.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        fan.into_iter().map(|(_, direction)| direction).collect()
    }

    /// What the reach does not exceed anywhere on the sphere, by dividing the cells that may hide more than
    /// the tolerance above the largest maximum. What they do hide joins the maxima.
    fn bound(&self, maxima: &mut Maxima, reach: &[f64]) -> f64 {
        type Corner = (Vec3<f64>, f64);
        let mesh = mesh();
        let corner = |k: usize| (mesh.corners[k], reach[k]);
        let mut cells: Vec<[Corner; 3]> = mesh.cells.iter().map(|cell| cell.map(corner)).collect();
        let (mut bound, mut seen) = (0.0_f64, 0);
        while let Some([a, b, c]) = cells.pop() {
            interrupt::check();
            seen += 1;
            let here = a.1.max(b.1).max(c.1) / cosine_of_radius([a.0, b.0, c.0]);
            if here <= maxima.largest() * (1.0 + TOLERANCE) || seen > MOST_CELLS {
                bound = bound.max(here);
                continue;
            }
            let mut middle = |p: Corner, q: Corner| {
                let u = unit(add(p.0, q.0));
                let reach = self.reach(u);
                if reach > maxima.largest() {
                    maxima.insert(self.climb(u));
                }
                (u, reach)
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            cells.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        bound
    }
}

/// Directions all around the plane, with their angles.
fn even_fan() -> &'static [(f64, Vec3<f64>)] {
    static DIRECTIONS: OnceLock<Vec<(f64, Vec3<f64>)>> = OnceLock::new();
    DIRECTIONS.get_or_init(|| {
        let angles = (0..FAN).map(|k| TAU * k as f64 / FAN as f64);
        angles.map(|a| (a, [a.cos(), a.sin(), 0.0])).collect()
    })
}

/// The reach along many directions, block by block.
struct Reaches<'r, 'm> {
    reach: &'r Reach<'m>,
    directions: &'r [Vec3<f64>],
}

impl Kernel for Reaches<'_, '_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run(self) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.directions.len());
        for directions in self.directions.chunks(LANES) {
            let mut u = [Block::splat(0.0); 3];
            for (lane, direction) in directions.iter().enumerate() {
                (0..3).for_each(|k| u[k].0[lane] = direction[k]);
            }
            let along = |v: &Vec3<f64>| {
                let part = |k: usize| u[k].mul(&Block::splat(v[k]));
                part(0).add(&part(1)).add(&part(2))
            };
            let mut reach = along(&self.reach.base);
            for source in self.reach.sources {
                let mut pull = [Block::splat(0.0); MAX_SIZE];
                for (w, p) in pull.iter_mut().zip(source.range()) {
                    *w = along(&self.reach.columns[p]);
                }
                reach = reach.add(&support(&source.set, &pull));
            }
            all.extend_from_slice(&reach.0[..directions.len()]);
        }
        all
    }
}

/// Support function of a set on every lane.
#[inline(always)]
fn support(set: &Set, w: &[Block; MAX_SIZE]) -> Block {
    match *set {
        Set::Disc { radius } => w[0].mul(&w[0]).add(&w[1].mul(&w[1])).sqrt().mul(&Block::splat(radius)),
        Set::Interval { low, high } => w[0].mul(&Block::splat(low)).max(&w[0].mul(&Block::splat(high))),
        _ => Block::new(std::array::from_fn(|i| {
            let w: [f64; MAX_SIZE] = std::array::from_fn(|k| w[k].0[i]);
            set.support(&w[..set.size()])
        })),
    }
}

/// Local maxima, each a direction and its reach.
#[derive(Default)]
struct Maxima(Vec<(Vec3<f64>, f64)>);

impl Maxima {
    fn insert(&mut self, (direction, reach): (Vec3<f64>, f64)) {
        let known = |&(other, value): &(Vec3<f64>, f64)| {
            dot(other, direction) > 1.0 - 1e-9 && (value - reach).abs() <= 1e-9 * reach
        };
        if !self.0.iter().any(known) {
            self.0.push((direction, reach));
        }
    }

    fn largest(&self) -> f64 {
        self.0.iter().fold(0.0, |largest, &(_, reach)| reach.max(largest))
    }

    fn largest_first(mut self) -> Vec<Vec3<f64>> {
        // Maxima that only rounding tells apart keep the order of their directions: otherwise a mirrored one would
        // take the place of its twin with the units of the file.
        let largest = self.0.iter().map(|(_, value)| *value).fold(f64::MIN_POSITIVE, f64::max);
        let order = |value: f64| (value / largest * 1e9).round();
        self.0.sort_by(|(_, a), (_, b)| order(*b).total_cmp(&order(*a)));
        self.0.into_iter().map(|(direction, _)| direction).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::clearance::law::Law;
    use crate::math::mesh::spread;

    fn sources(sets: &[Set]) -> Vec<Source> {
        let mut first = 0;
        let source = |&set: &Set| {
            first += set.size();
            Source {
                set,
                law: Law::Uniform,
                quantile: None,
                gap: None,
                first: first - set.size(),
                is_clearance: true,
                lever: 1.0,
                components: Vec::new(),
            }
        };
        sets.iter().map(source).collect()
    }

    /// Columns of random size and direction, about one common direction where `needle` is small.
    fn columns(n: usize, needle: f64, rng: &mut Xoshiro256PlusPlus) -> Vec<Vec3<f64>> {
        let mut vector = || -> Vec3<f64> { std::array::from_fn(|_| rng.random_range(-1.0..1.0)) };
        let common = vector();
        (0..n).map(|_| add(scale(vector(), needle), scale(common, vector()[0]))).collect()
    }

    #[test]
    fn the_farthest_corner_of_a_zonotope_lies_between_value_and_bound() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        for trial in 0..60 {
            let sets: Vec<Set> = (0..9)
                .map(|_| Set::Interval { low: -rng.random_range(0.0..1.0), high: rng.random_range(0.0..1.0) })
                .collect();
            let sources = sources(&sets);
            let columns = columns(sets.len(), [1.0, 0.1, 1e-3][trial % 3], &mut rng);
            let base = [0.1, -0.2, 0.05];
            let reach = Reach { sources: &sources, columns: columns.clone(), base, dimensions: 3 };
            let farthest = (0..1_u32 << sets.len()).fold(0.0, |farthest: f64, corner| {
                let error = sets.iter().zip(&columns).enumerate().fold(base, |sum, (k, (set, column))| {
                    let Set::Interval { low, high } = *set else { unreachable!() };
                    add(sum, scale(*column, if corner >> k & 1 == 1 { high } else { low }))
                });
                farthest.max(norm(&error))
            });
            let found = reach.farthest();
            let value = reach.reach(found.directions[0]);
            assert!(value <= farthest * (1.0 + 1e-14) && farthest <= found.bound, "{value} {farthest} {}", found.bound);
            assert!(found.bound <= value * (1.0 + TOLERANCE), "{value} {}", found.bound);
        }
    }

    #[test]
    fn no_sampled_direction_reaches_beyond_the_bound() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
        let sets = [
            Set::Journal { radius: 1.0, half_length: 0.5, axial: 0.3 },
            Set::Ball { radius: 0.5 },
            Set::Disc { radius: 0.4 },
            Set::Guide { gap: 0.4, half_length: 1.0, half_width: 0.2, half_height: 0.3 },
            Set::Interval { low: -0.2, high: 0.7 },
        ];
        let sources = sources(&sets);
        for trial in 0..12 {
            let n = sets.iter().map(Set::size).sum();
            let columns = columns(n, [1.0, 0.1, 1e-3][trial % 3], &mut rng);
            let reach = Reach { sources: &sources, columns, base: [0.0; 3], dimensions: 3 };
            let found = reach.farthest();
            let value = reach.reach(found.directions[0]);
            let sampled = (0..20_000).map(|k| reach.reach(spread(3, k, 20_000))).fold(0.0, f64::max);
            assert!(sampled <= found.bound && found.bound <= value * (1.0 + TOLERANCE), "{sampled} {value}");
            // Support points are attained: no value is claimed that no offset makes.
            assert!((norm(&reach.support_point(found.directions[0])) - value).abs() < 1e-9 * value);
        }
    }

    #[test]
    fn in_the_plane_the_bound_is_as_near_as_the_fan_is_dense() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let sources = sources(&[
            Set::Diamond { gap: 0.3, half_length: 2.0 },
            Set::Disc { radius: 0.5 },
            Set::Interval { low: -1.0, high: 0.5 },
        ]);
        for _ in 0..20 {
            let mut columns = columns(5, 0.3, &mut rng);
            for column in &mut columns {
                column[2] = 0.0;
            }
            let reach = Reach { sources: &sources, columns, base: [0.1, 0.0, 0.0], dimensions: 2 };
            let found = reach.farthest();
            let value = reach.reach(found.directions[0]);
            let sampled = (0..100_000).map(|k| reach.reach(spread(2, k, 100_000))).fold(0.0, f64::max);
            assert!(sampled <= value * (1.0 + 1e-9), "{sampled} {value}");
            assert!(value <= found.bound && found.bound <= value * (1.0 + 1e-4));
        }
    }
}
