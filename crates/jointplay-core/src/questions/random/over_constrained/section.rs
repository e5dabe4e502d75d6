//! Offsets that keep compatible: the section of the product of the clearances by the equations.
//!
//! Where every clearance has its law, compatible offsets have the conditional one. In own coordinates u of
//! the sets the equations `M u = b` are solved for as many of the coordinates as they have rank, the ones
//! that reach farthest; the others are drawn, and the whole is accepted when every offset is in its set
//! (von Neumann's rejection). Where hardly anything is accepted, a chain of hit-and-run steps does it
//! ([`chain`](super::chain)), started where the clearances are used the least. What is different about flanks of
//! couplings is in [`opened`](super::opened).

use std::ops::Range;
use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use crate::clearance::Set;
use crate::clearance::draw::shapes::Draw as _;
use crate::clearance::law::Law;
use crate::clearance::offset::MAX_SIZE;
use crate::cone::bodies::Form;
use crate::math::lanes::block::{Block, LANES, Mask, bits_if};
use crate::math::lanes::simd::{Kernel, dispatch};
use crate::questions::random::over_constrained::dice::Dice;
use crate::questions::random::over_constrained::lines::Lines;
use crate::questions::random::over_constrained::opened::{Opened, Proposals};

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
    /// What it does to the gaps of the flanks among the members, row-major.
    pub opens: Vec<f64>,
    /// Whether it is a flank itself; gaps are in the order of these.
    pub is_flank: bool,
}

/// Where a chain may start.
#[derive(Clone, Debug)]
pub enum Interior {
    /// Offsets that are compatible by the linearisation at the middle of all flanks.
    Linear(Vec<Vec<f64>>),
    /// Offsets that are so exactly.
    Exact(Vec<Vec<f64>>),
}

/// One own coordinate that moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub member: usize,
    pub k: usize,
    pub precision: f64,
}

impl Interior {
    /// The same for a part of what the offsets add up to.
    pub fn scaled(mut self, part: f64) -> Self {
        let (Self::Linear(offsets) | Self::Exact(offsets)) = &mut self;
        offsets.iter_mut().flatten().for_each(|d| *d *= part);
        self
    }
}

/// The section, for any right side.
#[derive(Clone, Debug)]
pub struct Section {
    pub(crate) members: Vec<Member>,
    pub(crate) places: Vec<Place>,
    /// The places of every member.
    pub(crate) ranges: Vec<Range<usize>>,
    /// The precisions of the places beside flanks.
    pub(crate) precisions: Vec<f64>,
    /// Coefficients of the coordinates, one column each.
    matrix: DMatrix<f64>,
    /// What the middles of the sets are in the equations, and those of the flanks one by one.
    middle: DVector<f64>,
    flank_middles: DMatrix<f64>,
    pub(crate) opened: Opened,
    /// Places that the equations are solved for, and the others.
    bound: Vec<usize>,
    free: Vec<usize>,
    /// The bound coordinates are `from_right b - from_free u_free`.
    from_right: DMatrix<f64>,
    from_free: DMatrix<f64>,
    /// What chains step along, once one is asked for.
    lines: OnceLock<Lines>,
    /// Which members have a bound coordinate.
    is_bound: Vec<bool>,
}

impl Section {
    pub fn new(members: Vec<Member>, equations: usize) -> Self {
        let (mut places, mut ranges) = (Vec::new(), Vec::with_capacity(members.len()));
        let mut columns: Vec<DVector<f64>> = Vec::new();
        let mut middle = DVector::zeros(equations);
        let (mut flanks, mut flank_middles, mut opening) = (Vec::new(), Vec::new(), Vec::new());
        for (member, Member { set, law, map, opens, is_flank }) in members.iter().enumerate() {
            let size = set.size();
            let image = |map: &[f64], offset: &[f64]| {
                let equations = map.len() / size;
                let of = |e: usize| map[e * size..(e + 1) * size].iter().zip(offset).map(|(a, d)| a * d).sum();
                DVector::from_iterator(equations, (0..equations).map(of))
            };
            let precisions = set.precisions(*law);
            let zero = set.of_unit(&[0.0; MAX_SIZE]);
            middle += image(map, &zero);
            if *is_flank {
                let half = set.of_unit(&[1.0; MAX_SIZE])[0] - zero[0];
                flanks.push((places.len(), precisions[0], half));
                flank_middles.push(image(map, &zero));
            }
            let first = places.len();
            for (k, precision) in precisions.into_iter().enumerate().take(size) {
                let mut at = [0.0; MAX_SIZE];
                at[k] = 1.0;
                let offset: Vec<f64> = set.of_unit(&at).iter().zip(&zero).map(|(a, b)| a - b).collect();
                if offset.iter().any(|d| *d != 0.0) {
                    places.push(Place { member, k, precision });
                    columns.push(image(map, &offset));
                    opening.push(image(opens, &offset));
                }
            }
            ranges.push(first..places.len());
        }
        let n = places.len();
        let matrix = DMatrix::from_fn(equations, n, |i, j| columns[j][i]);
        let rates = (0..flanks.len()).map(|f| opening.iter().map(|opens| opens[f]).collect()).collect();
        let beside = || members.iter().filter(|member| !member.is_flank);
        let reach = |member: &Member, f: usize| {
            let size = member.set.size();
            member.set.support(&member.opens[f * size..(f + 1) * size])
        };
        let reach = (0..flanks.len()).map(|f| beside().map(|member| reach(member, f)).sum()).collect();
        let precision = |place: &Place| if members[place.member].is_flank { 0.0 } else { place.precision };
        let mut section = Self {
            is_bound: vec![false; members.len()],
            precisions: places.iter().map(precision).collect(),
            members,
            places,
            ranges,
            middle,
            flank_middles: DMatrix::from_fn(equations, flanks.len(), |i, f| flank_middles[f][i]),
            opened: Opened::default(),
            bound: Vec::new(),
            free: (0..n).collect(),
            from_right: DMatrix::zeros(0, equations),
            from_free: DMatrix::zeros(0, n),
            lines: OnceLock::new(),
            matrix,
        };
        section.eliminate();
        let Self { matrix, bound, free, from_free, .. } = &section;
        section.opened = Opened::new(&flanks, matrix, rates, reach, bound, free, from_free);
        section
    }

    /// Solves the equations for the coordinates that reach farthest (Gauss and Jordan, complete pivoting).
    fn eliminate(&mut self) {
        let s = self.matrix.nrows();
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
    }

    /// What chains step along.
    pub(crate) fn lines(&self) -> &Lines {
        self.lines.get_or_init(|| Lines::new(&self.ranges, &self.matrix, self.free.len()))
    }

    /// Offsets of the members with the conditional law, for what they have to add up to and the gaps of the flanks where
    /// all are in the middle of their sets; `interior` gives offsets well within the sets that do.
    pub fn draw(
        &self,
        right: &DVector<f64>,
        gaps: &[f64],
        dice: &mut Dice,
        interior: impl FnOnce() -> Option<Interior>,
    ) -> Option<Vec<Form>> {
        let constant = &self.from_right * self.beside_the_middle(right, gaps);
        if let Some(proposals) = self.opened.proposals(gaps, &constant) {
            let mut own = vec![Block::splat(0.0); self.places.len()];
            for _ in 0..BLOCKS {
                if let Some(u) = self.reject(&constant, gaps, &proposals, dice, &mut own) {
                    return Some(self.offsets(&u));
                }
            }
        }
        let start = match interior()? {
            Interior::Linear(offsets) => self.own(&offsets),
            Interior::Exact(offsets) => self.opened.opened(gaps, &self.own(&offsets))?,
        };
        self.walk(start, gaps, dice).map(|y| self.offsets(&self.opened.closed(gaps, &y)))
    }

    /// What offsets add up to that are compatible exactly.
    pub fn adds_up_to(&self, offsets: &[Vec<f64>], gaps: &[f64]) -> Option<DVector<f64>> {
        let y = DVector::from_vec(self.opened.opened(gaps, &self.own(offsets))?);
        let zero = DVector::zeros(self.middle.len());
        Some(&self.matrix * y - self.beside_the_middle(&zero, gaps))
    }

    /// What the coordinates have to add up to. A flank in the middle of its play is not displaced by it, whatever its gap.
    fn beside_the_middle(&self, right: &DVector<f64>, gaps: &[f64]) -> DVector<f64> {
        let mut beside = right - &self.middle;
        for (column, gap) in self.flank_middles.column_iter().zip(gaps) {
            beside -= column * (gap - 1.0);
        }
        beside
    }

    /// A block of proposals, by what they have in common, made in `own`; the first that is accepted.
    pub(crate) fn reject(
        &self,
        constant: &DVector<f64>,
        gaps: &[f64],
        proposals: &Proposals,
        dice: &mut Dice,
        own: &mut [Block],
    ) -> Option<Vec<f64>> {
        let (near, luck) = dispatch(Propose { section: self, constant, gaps, proposals, dice, own });
        let (mut u, mut closed, mut room) = (vec![0.0; self.places.len()], gaps.to_vec(), Vec::new());
        for lane in (0..LANES).filter(|lane| near.has(*lane)) {
            u.iter_mut().zip(&*own).for_each(|(u, block)| *u = block.0[lane]);
            closed.copy_from_slice(gaps);
            if !self.opened.close(&mut closed, &mut u) || !self.is_inside(&u) {
                continue;
            }
            let weight = self.opened.weight(&closed, &u, &mut room) * self.density(&u);
            debug_assert!(weight <= proposals.largest * (1.0 + 1e-9), "{weight} is above {}", proposals.largest);
            if luck.0[lane] * proposals.largest < weight {
                return Some(u);
            }
        }
        None
    }

    /// Whether the members with bound coordinates are in their sets.
    fn is_inside(&self, u: &[f64]) -> bool {
        let is_inside = |m: usize| {
            let set = &self.members[m].set;
            set.contains_unit(&self.of_member(m, u)[..set.size()])
        };
        (0..self.members.len()).all(|m| !self.is_bound[m] || is_inside(m))
    }

    /// Their density, as a part of the largest one.
    fn density(&self, u: &[f64]) -> f64 {
        let bound = self.places.iter().zip(u).filter(|(place, _)| self.is_bound[place.member]);
        (-0.5 * bound.map(|(place, u)| place.precision * u * u).sum::<f64>()).exp()
    }

    /// Whether all own coordinates of a member move.
    pub(crate) fn moves_whole(&self, m: usize) -> bool {
        self.ranges[m].len() == self.members[m].set.size()
    }

    /// Own coordinates of a member.
    pub(crate) fn of_member(&self, m: usize, u: &[f64]) -> [f64; MAX_SIZE] {
        let mut at = [0.0; MAX_SIZE];
        if self.moves_whole(m) {
            at[..self.ranges[m].len()].copy_from_slice(&u[self.ranges[m].clone()]);
        } else {
            self.ranges[m].clone().for_each(|j| at[self.places[j].k] = u[j]);
        }
        at
    }

    /// Offsets of the members in the coordinates that move.
    fn own(&self, offsets: &[Vec<f64>]) -> Vec<f64> {
        let own: Vec<_> = self.members.iter().zip(offsets).map(|(member, d)| member.set.to_unit(d)).collect();
        self.places.iter().map(|place| own[place.member][place.k]).collect()
    }

    fn offsets(&self, u: &[f64]) -> Vec<Form> {
        let offset = |(m, member): (usize, &Member)| member.set.of_unit(&self.of_member(m, u));
        self.members.iter().enumerate().map(offset).collect()
    }
}

/// A block of proposals: the free coordinates by their laws, and the bound ones; gives where none of these is beyond its
/// set by itself, and what luck each has.
struct Propose<'a> {
    section: &'a Section,
    constant: &'a DVector<f64>,
    gaps: &'a [f64],
    proposals: &'a Proposals,
    dice: &'a mut Dice,
    own: &'a mut [Block],
}

impl Kernel for Propose<'_> {
    type Output = (Mask, Block);

    #[inline(always)]
    fn run(self) -> (Mask, Block) {
        let Self { section, constant, gaps, proposals, dice, own } = self;
        let stream = &mut dice.stream;
        let mut drawn = [Block::splat(0.0); MAX_SIZE];
        for ((member, range), is_bound) in section.members.iter().zip(&section.ranges).zip(&section.is_bound) {
            if *is_bound {
                // Their joint density with the bound coordinates is judged on acceptance.
                for j in range.clone() {
                    own[j] = stream.symmetric();
                }
                continue;
            }
            stream.draw_own(&member.set, member.law, &mut drawn[..member.set.size()]);
            for j in range.clone() {
                own[j] = drawn[section.places[j].k];
            }
        }
        let luck = stream.unit();
        let mut near = section.opened.open_free(proposals, own);
        for (r, &j) in section.bound.iter().enumerate() {
            let mut moved = Block::splat(0.0);
            for (c, &i) in section.free.iter().enumerate() {
                moved = moved.add(&own[i].mul(&Block::splat(section.from_free[(r, c)])));
            }
            own[j] = Block::splat(constant[r]).sub(&moved);
        }
        for &j in &section.bound {
            let most = section.opened.most(j, gaps, own);
            for lane in 0..LANES {
                near.0[lane] &= bits_if(own[j].0[lane].abs() <= most.0[lane]);
            }
        }
        (near, luck)
    }
}

#[cfg(test)]
mod tests;
