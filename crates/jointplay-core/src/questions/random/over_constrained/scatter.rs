//! Offsets of a specimen, drawn in the room that its clearances have together.

use std::borrow::Cow;

use nalgebra::DVector;

use crate::clearance::offset::MAX_SIZE;
use crate::cone::Kind;
use crate::cone::bodies::Form;
use crate::questions::random::over_constrained::dice::Dice;
use crate::questions::random::over_constrained::room::{Room, least_displacements, section};
use crate::questions::random::over_constrained::section::Interior;
use crate::questions::random::over_constrained::specimen::{Job, Loosest, Specimen};
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::Ties;
use crate::redundancy::openings::Openings;
use crate::redundancy::specimen_batch::Together;

/// An offset that is outside its set by this part of it is there up to the rounding of Newton's method.
const WITHIN: f64 = 1e-10;

impl Job<'_> {
    /// The room that a misfit leaves the tied clearances of a specimen which they take up.
    pub fn room(&self, misfit: &DVector<f64>, loosest: Loosest, specimen: &Specimen) -> Room<'_> {
        // With the part of the misfit that leaves as much room as there is on the exact closure.
        let right = misfit * loosest.part;
        let interior = loosest.interior.map(|interior| interior.scaled(loosest.part));
        let at_rest = vec![Form::default(); self.tied.len()];
        Room {
            section: Cow::Borrowed(&self.section),
            gaps: self.gaps(self.openings.as_ref(), &self.tied, &at_rest, specimen),
            numbers: Cow::Borrowed(&self.tied),
            at_rest,
            right,
            interior,
            correction: Cow::Borrowed(&self.correction),
            openings: self.openings.as_ref().map(Cow::Borrowed),
        }
    }

    /// The gaps of flanks where the clearances of some elements are in the middle of their sets, beside what offsets they
    /// have in the displacements of a specimen.
    fn gaps(&self, openings: Option<&Openings>, numbers: &[usize], has: &[Form], specimen: &Specimen) -> Vec<f64> {
        let Some(openings) = openings else { return Vec::new() };
        let mut displacements = specimen.displacements.clone();
        for (&g, has) in numbers.iter().zip(has) {
            let element = &self.system.elements[g];
            let Kind::Clearance(set) = &element.kind else { continue };
            let middle = set.of_unit(&[0.0; MAX_SIZE]);
            element.columns.iter().zip(middle.iter().zip(has)).for_each(|(&row, (to, from))| {
                displacements[row] += to - from;
            });
        }
        openings.gaps(&displacements)
    }

    /// Draws offsets within a room; whether there are any.
    pub fn draw(&self, room: &Room<'_>, dice: &mut Dice, specimen: &mut Specimen) -> bool {
        let interior = || room.interior.clone().or_else(|| self.loosest(&room.right).interior);
        let drawn = room.section.draw(&room.right, &room.gaps, dice, interior);
        drawn.is_some_and(|offsets| {
            self.put_all(room, offsets.iter().map(Form::as_slice), specimen);
            true
        })
    }

    /// Notes offsets within a room.
    pub fn put_all<'o>(&self, room: &Room<'_>, offsets: impl Iterator<Item = &'o [f64]>, specimen: &mut Specimen) {
        for ((&g, offset), before) in room.numbers.iter().zip(offsets).zip(&room.at_rest) {
            self.put(&self.system.elements[g], offset, specimen);
            for ((&row, d), before) in self.system.elements[g].columns.iter().zip(offset).zip(before) {
                specimen.displacements[row] += d - before;
            }
        }
    }

    /// Whether the offsets within a room are in their sets on the exact closure, too. Where no flank opens they are but
    /// for the square of the play over the dimensions, which is left.
    pub fn is_within(&self, room: &Room<'_>, specimen: &Specimen) -> bool {
        let m = self.mechanism();
        !room.has_flanks()
            || room.numbers.iter().all(|&g| {
                let element = &self.system.elements[g];
                let (Kind::Clearance(set), Some(source)) = (&element.kind, element.source) else { return true };
                let offset: Vec<f64> =
                    m.sources[source].range().map(|p| specimen.parameters[p] - m.centre[p]).collect();
                set.contains(&offset, WITHIN)
            })
    }

    /// The room of clearances that carry nothing where a specimen has settled; the right side is what they add up to.
    pub fn room_of_loose(
        &self,
        together: &Together<'_>,
        c: &Ties,
        mut rest: DVector<f64>,
        (loose, balance): (Vec<usize>, &Balance),
        specimen: &Specimen,
    ) -> Room<'_> {
        let given: Vec<Vec<f64>> = loose.iter().map(|&g| balance.given[g].clone()).collect();
        let openings = self.openings.as_ref().and_then(|_| {
            let state = together.close_plainly(&specimen.displacements).ok()?;
            Openings::at(&self.system, self.solver, &state, &loose)
        });
        let equations = openings.as_ref().map_or(&c.equations, |openings| &openings.equations);
        let section = section(&self.system, equations, openings.as_ref(), &loose, self.request);
        let at_rest = given.iter().map(|given| std::array::from_fn(|k| given.get(k).copied().unwrap_or_default()));
        let at_rest: Vec<Form> = at_rest.collect();
        let gaps = self.gaps(openings.as_ref(), &loose, &at_rest, specimen);
        let interior = if gaps.is_empty() { Interior::Linear(given.clone()) } else { Interior::Exact(given.clone()) };
        if !gaps.is_empty() {
            rest = section.adds_up_to(&given, &gaps).unwrap_or(rest);
        }
        Room {
            section: Cow::Owned(section),
            gaps,
            correction: Cow::Owned(least_displacements(&self.system, equations, &loose)),
            numbers: Cow::Owned(loose),
            at_rest,
            right: rest,
            interior: Some(interior),
            openings: openings.map(Cow::Owned),
        }
    }
}
