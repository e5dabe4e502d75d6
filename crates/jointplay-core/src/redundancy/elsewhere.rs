//! Other places where the load may hold an over-constrained or elastic mechanism, of which the one with the most work counts.
//!
//! As [`crate::contact`] has it for determinate mechanisms: programs start anew from the other ends of clearances on which
//! the force may turn. What counts is the work of the load from place to place without what is stored in elastic joints.

use nalgebra::DVector;

use crate::clearance::turning_on_lanes::may_turn;
use crate::closure::newton::{Solver, State, between};
use crate::cone::Kind;
use crate::cone::scheduler::Rounds;
use crate::math::boole::WEIGHTS;
use crate::math::lanes::block::Block;
use crate::redundancy::compatibility::Ties;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::sequence::{Rest, step};
use crate::redundancy::system::{Element, System, UNDECIDED_TOGETHER};

/// Times that a better place is looked for from the best one, and places that are looked at, at most.
const ROUNDS: usize = 4;
const PLACES: usize = 12;
/// Two places are one where no offset differs by more than this part of its set.
const SAME: f64 = 1e-3;
/// Work that is less than this part of what the load does within the play is none: programs know no more.
const MORE: f64 = 1e-6;

impl System<'_> {
    /// The place with the most work among those that are found from a place of rest, and how many have been seen; `elsewhere`
    /// are the forces at another place of the play. What nothing pushes may be where the work has a minimum: it leaves that
    /// where the output moves by more than what is `noticed`.
    pub async fn most_work_in(
        &self,
        rounds: &Rounds,
        solver: &Solver<'_>,
        from: Rest,
        elsewhere: &DVector<f64>,
        known: &[f64],
        noticed: Option<Vec<f64>>,
    ) -> (Rest, usize) {
        let from = match noticed {
            Some(noticed) => self.off_balance(rounds, solver, &from, known, &noticed).await.unwrap_or(from),
            None => from,
        };
        let mut seen = vec![from.balance.given.clone()];
        let mut best = from;
        for _ in 0..ROUNDS {
            let mut more: Option<(f64, Rest)> = None;
            let least = MORE * self.work_of_play(&best);
            for target in self.ends_from(&best, elsewhere, known) {
                let Ok((start, 1.0)) = step(solver, &best.state, &target, 1.0) else { continue };
                let Ok(next) = self.rest_in(rounds, solver, start, known, None, Ask::Load).await else { continue };
                if !next.still || seen.iter().any(|seen| self.is_same(seen, &next.balance.given)) {
                    continue;
                }
                seen.push(next.balance.given.clone());
                let Some(gain) = self.work_between(solver, &best, &next) else { continue };
                if gain > more.as_ref().map_or(least, |(most, _)| *most) {
                    more = Some((gain, next));
                }
            }
            match more {
                Some((_, next)) => best = next,
                None => break,
            }
            if seen.len() > PLACES {
                break;
            }
        }
        (best, seen.len())
    }

    /// Where a place goes at which a clearance that nothing pushes is at a minimum of the work; `None` where it stays.
    async fn off_balance(
        &self,
        rounds: &Rounds,
        solver: &Solver<'_>,
        from: &Rest,
        known: &[f64],
        noticed: &[f64],
    ) -> Option<Rest> {
        let at = self.target(known, &from.balance);
        for (element, offset) in self.elements.iter().zip(&from.balance.given) {
            let (Kind::Clearance(set), Some(source)) = (&element.kind, element.source) else { continue };
            let is_pushed = |forces: &DVector<f64>| {
                let tolerance = self.mechanism.sources[source].undecided(UNDECIDED_TOGETHER * self.force_scale(forces));
                !set.face(&Self::on(element, forces)[..set.size()], tolerance).is_whole()
            };
            if is_pushed(&from.balance.forces) {
                continue;
            }
            for end in set.other_ends(offset) {
                let target = moved(&at, element, offset, &end);
                let Ok((start, 1.0)) = step(solver, &from.state, &target, 1.0) else { continue };
                let moved = self.basis.kept.error(&start, &from.state);
                if moved.iter().zip(noticed).all(|(moved, noticed)| moved.abs() <= *noticed) {
                    continue;
                }
                let c = Ties::at(self.basis, solver, &start)?;
                let outwards: f64 = Self::along(element, &c.load).iter().zip(end).map(|(f, d)| f * d).sum();
                if Self::is_tied(element, &c) || !is_pushed(&c.load) || outwards <= 0.0 {
                    continue;
                }
                let next = self.rest_in(rounds, solver, start, known, None, Ask::Load).await.ok()?;
                return (next.still && !self.is_same(&from.balance.given, &next.balance.given)).then_some(next);
            }
        }
        None
    }

    /// Displacements with one clearance at another end.
    fn ends_from(&self, rest: &Rest, elsewhere: &DVector<f64>, known: &[f64]) -> Vec<Vec<f64>> {
        let tolerance = UNDECIDED_TOGETHER * self.force_scale(&rest.balance.forces);
        let at = self.target(known, &rest.balance);
        let mut ends = Vec::new();
        if !self.mechanism.is_searched() {
            return ends;
        }
        for (element, offset) in self.elements.iter().zip(&rest.balance.given) {
            let (Kind::Clearance(set), Some(source)) = (&element.kind, element.source) else { continue };
            let own = |forces: &DVector<f64>| -> Vec<Block> {
                Self::along(element, forces).into_iter().map(Block::splat).collect()
            };
            let [now, then] = [own(&rest.balance.forces), own(elsewhere)];
            let [now, then]: [Vec<&Block>; 2] = [now.iter().collect(), then.iter().collect()];
            let tolerance = self.mechanism.sources[source].undecided(tolerance);
            if may_turn(set, &now, &then, &Block::splat(tolerance)).0[0] == 0.0 {
                continue;
            }
            ends.extend(set.other_ends(offset).into_iter().map(|end| moved(&at, element, offset, &end)));
        }
        ends
    }

    /// Whether no offset differs.
    fn is_same(&self, a: &[Vec<f64>], b: &[Vec<f64>]) -> bool {
        let is_same = |((element, a), b): ((&Element, &Vec<f64>), &Vec<f64>)| match &element.kind {
            Kind::Clearance(set) => (0..a.len()).all(|k| (a[k] - b[k]).abs() <= SAME * set.half_width(k)),
            _ => true,
        };
        self.elements.iter().zip(a).zip(b).all(is_same)
    }

    /// What the forces do within the play.
    fn work_of_play(&self, rest: &Rest) -> f64 {
        let of = |element: &Element| match &element.kind {
            Kind::Clearance(set) => set.support(&Self::along(element, &rest.balance.forces)),
            _ => 0.0,
        };
        self.elements.iter().map(of).sum()
    }

    /// What is stored in elastic joints.
    fn stored(&self, rest: &Rest) -> f64 {
        let of = |(element, given): (&Element, &Vec<f64>)| {
            let forces = Self::along(element, &rest.balance.forces);
            let work: f64 = given.iter().zip(forces).map(|(d, f)| d * f).sum();
            if element.source.is_none() { 0.5 * work } else { 0.0 }
        };
        self.elements.iter().zip(&rest.balance.given).map(of).sum()
    }

    /// What the load does on the straight way from one place to another, without what more is stored there.
    fn work_between(&self, solver: &Solver<'_>, from: &Rest, to: &Rest) -> Option<f64> {
        let ends = [from, to].map(|rest| &rest.state.inputs);
        let way = ends[1].parameters.iter().zip(&ends[0].parameters).map(|(to, from)| to - from);
        let way = DVector::from_iterator(ends[0].parameters.len(), way);
        let mut state = State::clone(&from.state);
        let mut work = 0.0;
        for (k, weight) in WEIGHTS.iter().enumerate() {
            let part = k as f64 / (WEIGHTS.len() - 1) as f64;
            state = solver.follow(&state, &between(ends[0], ends[1], part)).ok()?;
            work += weight * Ties::at(self.basis, solver, &state)?.load.dot(&way);
        }
        Some(work - (self.stored(to) - self.stored(from)))
    }
}

/// Displacements with an element elsewhere.
fn moved(at: &[f64], element: &Element, from: &[f64], to: &[f64]) -> Vec<f64> {
    let mut moved = at.to_vec();
    for ((&column, to), from) in element.columns.iter().zip(to).zip(from) {
        moved[column] += to - from;
    }
    moved
}
