//! Offsets that keep compatible: the section of the product of the clearances by the equations.
//!
//! Where every clearance has its law, compatible offsets have the conditional one. In own coordinates u of
//! the sets the equations `M u = b` are solved for as many of the coordinates as they have rank, the ones
//! that reach farthest; the others are drawn, and the whole is accepted when every offset is in its set
//! (von Neumann's rejection). Where hardly anything is accepted, a chain of hit-and-run steps does it
//! ([`chain`](super::chain)), started where the clearances are used the least.

use nalgebra::{DMatrix, DVector};

use crate::clearance::Set;
use crate::clearance::law::Law;
use crate::clearance::offset::MAX_SIZE;
use crate::math::lanes::block::{Block, LANES};
use crate::questions::random::over_constrained::dice::Dice;

/// Blocks of proposals before a chain is started.
const BLOCKS: usize = 8;
/// A direction of the equations in which the sets reach less than this part of the farthest one is not there.
const REACHES: f64 = 1e-9;

/// A clearance that takes part.
#[derive(Clone, Debug)]
pub struct Member {
    pub set: Set,
    pub law: Law,
    /// Its coefficients in the equations, row-major.
    pub map: Vec<f64>,
}

/// One own coordinate that moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub member: usize,
    pub k: usize,
    pub precision: f64,
}

/// The section, for any right side.
#[derive(Clone, Debug)]
pub struct Section {
    pub(crate) members: Vec<Member>,
    pub(crate) places: Vec<Place>,
    /// Coefficients of the coordinates, one column each.
    matrix: DMatrix<f64>,
    /// What the middles of the sets are in the equations.
    middle: DVector<f64>,
    /// Places that the equations are solved for, and the others.
    bound: Vec<usize>,
    free: Vec<usize>,
    /// The bound coordinates are `from_right b - from_free u_free`.
    from_right: DMatrix<f64>,
    from_free: DMatrix<f64>,
    /// Orthonormal directions within the section, one per column.
    pub(crate) directions: DMatrix<f64>,
    /// Which members have a bound coordinate.
    is_bound: Vec<bool>,
}

impl Section {
    pub fn new(members: Vec<Member>, equations: usize) -> Self {
        let mut places = Vec::new();
        let mut columns: Vec<DVector<f64>> = Vec::new();
        let mut middle = DVector::zeros(equations);
        for (member, Member { set, law, map }) in members.iter().enumerate() {
            let size = set.size();
            let image = |offset: &[f64]| {
                let of = |e: usize| map[e * size..(e + 1) * size].iter().zip(offset).map(|(a, d)| a * d).sum();
                DVector::from_iterator(equations, (0..equations).map(of))
            };
            let precisions = set.precisions(*law);
            let zero = set.of_unit(&[0.0; MAX_SIZE]);
            middle += image(&zero);
            for (k, precision) in precisions.into_iter().enumerate().take(size) {
                let mut at = [0.0; MAX_SIZE];
                at[k] = 1.0;
                let offset: Vec<f64> = set.of_unit(&at).iter().zip(&zero).map(|(a, b)| a - b).collect();
                if offset.iter().any(|d| *d != 0.0) {
                    places.push(Place { member, k, precision });
                    columns.push(image(&offset));
                }
            }
        }
        let n = places.len();
        let matrix = DMatrix::from_fn(equations, n, |i, j| columns[j][i]);
        let mut section = Self {
            is_bound: vec![false; members.len()],
            members,
            places,
            middle,
            bound: Vec::new(),
            free: (0..n).collect(),
            from_right: DMatrix::zeros(0, equations),
            from_free: DMatrix::zeros(0, n),
            directions: DMatrix::zeros(n, 0),
            matrix,
        };
        section.eliminate();
        section
    }

    /// Solves the equations for the coordinates that reach farthest (Gauss and Jordan, complete pivoting).
    fn eliminate(&mut self) {
        let (s, n) = self.matrix.shape();
        let mut rest = self.matrix.clone();
        let mut done = DMatrix::<f64>::identity(s, s);
        // Equations in different units are compared each with what the sets reach in it.
        for i in 0..s {
            let reach: f64 = rest.row(i).iter().map(|a| a.abs()).sum();
            if reach > 0.0 {
                rest.row_mut(i).scale_mut(1.0 / reach);
                done.row_mut(i).scale_mut(1.0 / reach);
            }
        }
        let mut rows: Vec<usize> = (0..s).collect();
        let mut solved = Vec::new();
        let farthest = rest.amax();
        while !rows.is_empty() {
            let pairs = rows.iter().flat_map(|&i| self.free.iter().map(move |&j| (i, j)));
            let Some((i, j)) = pairs.max_by(|a, b| rest[*a].abs().total_cmp(&rest[*b].abs())) else { break };
            let pivot = rest[(i, j)];
            if pivot.abs() <= REACHES * farthest {
                break;
            }
            rest.row_mut(i).scale_mut(1.0 / pivot);
            done.row_mut(i).scale_mut(1.0 / pivot);
            for other in (0..s).filter(|other| *other != i) {
                let factor = rest[(other, j)];
                if factor != 0.0 {
                    let (row, by) = (rest.row(i) * factor, done.row(i) * factor);
                    rest.row_mut(other).iter_mut().zip(row.iter()).for_each(|(a, b)| *a -= b);
                    done.row_mut(other).iter_mut().zip(by.iter()).for_each(|(a, b)| *a -= b);
                }
            }
            rows.retain(|row| *row != i);
            self.free.retain(|column| *column != j);
            self.bound.push(j);
            solved.push(i);
            self.is_bound[self.places[j].member] = true;
        }
        self.from_right = done.select_rows(&solved);
        self.from_free = rest.select_rows(&solved).select_columns(&self.free);
        // Directions within the section: each free coordinate with what the bound ones make of it.
        let mut span = DMatrix::<f64>::zeros(n, self.free.len());
        for (c, &j) in self.free.iter().enumerate() {
            span[(j, c)] = 1.0;
            for (r, &i) in self.bound.iter().enumerate() {
                span[(i, c)] = -self.from_free[(r, c)];
            }
        }
        self.directions = if self.free.is_empty() { span } else { span.qr().q() };
    }

    /// Offsets of the members with the conditional law, for what they have to add up to; `interior` gives
    /// offsets well within the sets that do.
    pub fn draw(
        &self,
        right: &DVector<f64>,
        dice: &mut Dice,
        interior: impl FnOnce() -> Option<Vec<Vec<f64>>>,
    ) -> Option<Vec<Vec<f64>>> {
        let constant = &self.from_right * (right - &self.middle);
        for _ in 0..BLOCKS {
            if let Some(u) = self.reject(&constant, dice) {
                return Some(self.offsets(&u));
            }
        }
        self.walk(&interior()?, dice).map(|u| self.offsets(&u))
    }

    /// A block of proposals; the first that is accepted.
    pub(crate) fn reject(&self, constant: &DVector<f64>, dice: &mut Dice) -> Option<Vec<f64>> {
        let mut own = vec![Block::splat(0.0); self.places.len()];
        let mut drawn = [Block::splat(0.0); MAX_SIZE];
        let mut next = 0;
        for (m, member) in self.members.iter().enumerate() {
            let places =
                next..self.places[next..].iter().position(|p| p.member != m).map_or(self.places.len(), |p| p + next);
            next = places.end;
            if self.is_bound[m] {
                // Their joint density with the bound coordinates is judged on acceptance.
                places.for_each(|j| own[j] = dice.symmetric());
                continue;
            }
            let size = member.set.size();
            dice.draw(&member.set, member.law, &mut drawn[..size]);
            for lane in 0..LANES {
                let offset: [f64; MAX_SIZE] = std::array::from_fn(|k| drawn[k].0[lane]);
                let at = member.set.to_unit(&offset[..size]);
                places.clone().for_each(|j| own[j].0[lane] = at[self.places[j].k]);
            }
        }
        let luck = dice.uniform();
        let mut u = vec![0.0; self.places.len()];
        for lane in 0..LANES {
            u.iter_mut().zip(&own).for_each(|(u, block)| *u = block.0[lane]);
            for (r, &j) in self.bound.iter().enumerate() {
                let moved: f64 = self.free.iter().enumerate().map(|(c, &i)| self.from_free[(r, c)] * u[i]).sum();
                u[j] = constant[r] - moved;
            }
            let near = |j: &usize| u[*j].abs() <= 1.0;
            if self.bound.iter().all(near) && self.is_inside(&u) && luck.0[lane] < self.density(&u) {
                return Some(u);
            }
        }
        None
    }

    /// Whether the members with bound coordinates are in their sets.
    fn is_inside(&self, u: &[f64]) -> bool {
        self.each_member(u)
            .all(|(m, at)| !self.is_bound[m] || self.members[m].set.contains_unit(&at[..self.members[m].set.size()]))
    }

    /// Their density, as a part of the largest one.
    fn density(&self, u: &[f64]) -> f64 {
        let bound = self.places.iter().zip(u).filter(|(place, _)| self.is_bound[place.member]);
        (-0.5 * bound.map(|(place, u)| place.precision * u * u).sum::<f64>()).exp()
    }

    /// Own coordinates member by member.
    pub(crate) fn each_member<'a>(&'a self, u: &'a [f64]) -> impl Iterator<Item = (usize, [f64; MAX_SIZE])> + 'a {
        let mut next = 0;
        (0..self.members.len()).map(move |m| {
            let mut at = [0.0; MAX_SIZE];
            while let Some(place) = self.places.get(next).filter(|place| place.member == m) {
                at[place.k] = u[next];
                next += 1;
            }
            (m, at)
        })
    }

    fn offsets(&self, u: &[f64]) -> Vec<Vec<f64>> {
        let offset = |(m, at): (usize, [f64; MAX_SIZE])| {
            let set = &self.members[m].set;
            set.of_unit(&at)[..set.size()].to_vec()
        };
        self.each_member(u).map(offset).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clearance::samples::KINDS;

    /// Coefficients without a pattern.
    fn map(set: &Set, equations: usize, seed: usize) -> Vec<f64> {
        (0..equations * set.size()).map(|k| ((k + 7 * seed) as f64 * 0.618_034 + 0.3).fract() - 0.5).collect()
    }

    fn section(set: Set, law: Law, equations: usize) -> Section {
        let member = |(seed, set): (usize, Set)| Member { map: map(&set, equations, seed), set, law };
        Section::new([set, Set::Disc { radius: 0.6 }].into_iter().enumerate().map(member).collect(), equations)
    }

    /// Mean and variance of a direction of no meaning, and of the squared length.
    fn moments(samples: &[Vec<f64>]) -> [f64; 4] {
        let numbers: Vec<[f64; 2]> = samples
            .iter()
            .map(|u| {
                let along = u.iter().enumerate().map(|(k, u)| u * (k as f64 * 0.9).cos()).sum();
                [along, u.iter().map(|u| u * u).sum()]
            })
            .collect();
        let n = numbers.len() as f64;
        let mean = |q: usize| numbers.iter().map(|x| x[q]).sum::<f64>() / n;
        let spread = |q: usize| (numbers.iter().map(|x| (x[q] - mean(q)).powi(2)).sum::<f64>() / n).sqrt();
        [mean(0), spread(0), mean(1), spread(1)]
    }

    #[test]
    fn a_chain_has_the_law_of_rejection() {
        let count = 1500;
        for set in KINDS {
            for (law, equations) in [(Law::Uniform, 1), (Law::Normal, 1), (Law::Uniform, 2)] {
                let section = section(set, law, equations);
                let inside: Vec<f64> = section.places.iter().map(|p| 0.25 * (p.k as f64 + 1.3).sin()).collect();
                let right = &section.matrix * DVector::from_vec(inside.clone()) + &section.middle;
                let constant = &section.from_right * (&right - &section.middle);
                let start = section.offsets(&inside);
                let (mut rejected, mut walked) = (Vec::new(), Vec::new());
                for specimen in 0..count {
                    let mut dice = Dice::new(1, specimen);
                    rejected.push(
                        std::iter::repeat_with(|| section.reject(&constant, &mut dice)).flatten().next().unwrap(),
                    );
                    walked.push(section.walk(&start, &mut Dice::new(2, specimen)).unwrap());
                }
                for u in rejected.iter().chain(&walked) {
                    let left = &section.matrix * DVector::from_vec(u.clone()) + &section.middle - &right;
                    assert!(left.amax() < 1e-12, "{set:?}");
                    for (m, at) in section.each_member(u) {
                        let set = &section.members[m].set;
                        assert!(set.contains(&set.of_unit(&at)[..set.size()], 1e-9), "{set:?} {law:?}");
                    }
                }
                let (a, b) = (moments(&rejected), moments(&walked));
                for q in [0, 2] {
                    // Five standard errors of the difference of two means; spreads have about half of that.
                    let error = 5.0 * a[q + 1] * (2.0 / count as f64).sqrt();
                    assert!((a[q] - b[q]).abs() < error, "{set:?} {law:?} {equations} {a:?} {b:?}");
                    assert!((a[q + 1] - b[q + 1]).abs() < error, "{set:?} {law:?} {equations} {a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn offsets_between_two_discs_are_uniform_in_the_lens() {
        // Two pins and a bar along x that is b too long: x_2 - x_1 = b. For x_1 the two heights are free.
        let member = |sign: f64| Member { set: Set::Disc { radius: 1.0 }, law: Law::Uniform, map: vec![sign, 0.0] };
        let section = Section::new(vec![member(-1.0), member(1.0)], 1);
        let b = 0.8;
        let right = DVector::from_element(1, b);
        // The density of x_1 is proportional to the product of both chords.
        let density = |x: f64| ((1.0 - x * x).max(0.0) * (1.0 - (x + b).powi(2)).max(0.0)).sqrt();
        let at = |k: i32| -1.0 + f64::from(k) / 10_000.0;
        let all: f64 = (0..20_000).map(|k| density(at(k))).sum();
        let mean: f64 = (0..20_000).map(|k| at(k) * density(at(k))).sum::<f64>() / all;
        let square: f64 = (0..20_000).map(|k| at(k).powi(2) * density(at(k))).sum::<f64>() / all;
        let count = 20_000;
        let drawn: Vec<f64> = (0..count)
            .map(|specimen| section.draw(&right, &mut Dice::new(5, specimen), || None).unwrap()[0][0])
            .collect();
        let n = count as f64;
        let error = 5.0 * (square - mean * mean).sqrt() / n.sqrt();
        assert!((drawn.iter().sum::<f64>() / n - mean).abs() < error);
        assert!((drawn.iter().map(|x| x * x).sum::<f64>() / n - square).abs() < error);
    }
}
