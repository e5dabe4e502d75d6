//! The course of a specimen: from what has been drawn for it to what becomes of it.

use std::borrow::Cow;

use nalgebra::DVector;

use crate::cone::scheduler::Rounds;
use crate::mechanism::status::Status;
use crate::questions::random::over_constrained::room::Room;
use crate::questions::random::over_constrained::specimen::{Fit, Job, Specimen};
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::FITS;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::sequence::is_apart;
use crate::redundancy::specimen_batch::Together;
use crate::redundancy::specimen_batch::pressed::PressedSpecimen;
use crate::redundancy::system::System;

/// Corrections that make linearly compatible displacements exactly so: each leaves a part of the misfit that is
/// of the order of the displacements over the dimensions.
const CORRECTIONS: usize = 12;

/// A factor that differs from one by less may be on the other side on the exact closure: it changes by the order of the
/// displacements over the dimensions.
const NEAR: f64 = 0.05;

/// Times that offsets are drawn which the exact closure may take outside their sets.
const DRAWS: usize = 8;
/// Of specimens that are solved side by side and that a load leaves open, how many are solved by themselves at least.
const ASKED: usize = 2;

impl Job<'_> {
    /// Solves specimens with what has been drawn for them, of which the first has the given number.
    pub fn solve(&self, together: &Together<'_>, drawn: &[Vec<f64>], first: u64) -> Vec<Specimen> {
        let numbered = || drawn.iter().zip((0..).map(|k| first.wrapping_add(k)));
        let pressed = self.pressed(together, numbered());
        let left = numbered().zip(&pressed).filter(|(_, pressed)| pressed.is_none()).map(|(one, _)| one);
        let mut settled = together
            .each(left, async |rounds, (drawn, number)| {
                let own = self.of_specimen(drawn);
                let job = own.as_deref().unwrap_or(self);
                let mut specimen = job.drawn(&job.system, drawn, number);
                if let Err(status) = job.place(rounds, together, &mut specimen).await {
                    (specimen.status, specimen.error) = (status, None);
                }
                // Steps do not settle, or leave open, what balances within the play.
                if specimen.status == Status::Undetermined && self.is_pressed() {
                    specimen = job.loaded(job.drawn(&job.system, drawn, number)).unwrap_or(specimen);
                }
                specimen
            })
            .into_iter();
        pressed.into_iter().filter_map(|pressed| pressed.or_else(|| settled.next())).collect()
    }

    /// Whether the forces of the load alone decide.
    fn is_pressed(&self) -> bool {
        self.request.loaded && self.rigid && self.nominal.compatibility.equations.nrows() == 0
    }

    /// Specimens that the forces of the load alone decide, side by side without courses. What these leave open is solved by
    /// itself: mostly it stays open, and in all specimens, so that some are asked first.
    fn pressed<'d>(
        &self,
        together: &Together<'_>,
        drawn: impl Iterator<Item = (&'d Vec<f64>, u64)>,
    ) -> Vec<Option<Specimen>> {
        let c = self.nominal.compatibility;
        if !self.is_pressed() {
            return drawn.map(|_| None).collect();
        }
        let (systems, specimens): (Vec<_>, Vec<Specimen>) = drawn
            .map(|(drawn, number)| {
                let system = self.system.of_specimen(drawn).map_or(Cow::Borrowed(&self.system), Cow::Owned);
                let specimen = self.drawn(&system, drawn, number);
                (system, specimen)
            })
            .unzip();
        let displacements = specimens.iter().map(|specimen| specimen.displacements.as_slice());
        let known: Vec<(&System<'_>, &[f64])> = systems.iter().map(Cow::as_ref).zip(displacements).collect();
        let pressed = together.press(&known, &self.observable);
        // What is open to first order at the nominal pose is so for all specimens of the same sets.
        let first = |system: &System<'_>| {
            let balance = Balance::free(Vec::new(), c.load.clone());
            let nothing = DVector::zeros(0);
            system.is_observable(c, &c.output.parameters, &nothing, &balance, &self.observable)
        };
        let of_all = first(&self.system);
        let (mut asked, mut is_decided) = (0, false);
        let take = |(system, (mut specimen, pressed)): (&Cow<'_, System<'_>>, (Specimen, Option<PressedSpecimen>))| {
            let pressed = pressed?;
            if self.decided.any(&pressed.open) {
                return self.loaded(specimen);
            }
            let is_open = pressed.observable || if let Cow::Owned(system) = system { first(system) } else { of_all };
            if is_open && (is_decided || asked < ASKED) {
                asked += 1;
                let found = self.loaded(specimen);
                is_decided |= found.as_ref().is_some_and(|found| found.status == Status::Ok);
                return found;
            }
            let PressedSpecimen { displacements, offsets, error, .. } = pressed;
            let offsets = system.elements.iter().zip(&offsets);
            offsets.for_each(|(element, offset)| self.put(element, offset, &mut specimen));
            (specimen.displacements, specimen.error, specimen.factor) = (displacements, Some(error), 0.0);
            specimen.status = if is_open { Status::Undetermined } else { Status::Ok };
            Some(specimen)
        };
        systems.iter().zip(specimens.into_iter().zip(pressed)).map(take).collect()
    }

    /// Puts a specimen where it can be assembled.
    async fn place(&self, rounds: &Rounds, together: &Together<'_>, specimen: &mut Specimen) -> Result<(), Status> {
        let closed = together.close(&specimen.displacements).await?;
        specimen.plainly = closed.plainly;
        let mut loosest = self.factor(rounds, &closed.misfit).await;
        // Near one, where it decides, the factor is that of the exact closure. What few specimens go through is boxed:
        // a course is as large as the largest it waits for.
        if (loosest.factor - 1.0).abs() < NEAR + self.opens(specimen)
            && (loosest.factor > 0.0 || !self.is_open(specimen))
            && let Ok(exactly) =
                Box::pin(together.settle(rounds, &self.system, &specimen.displacements, &Ask::Factor)).await
        {
            self.settle_at(&mut loosest, &exactly.balance);
        }
        match self.fit(&loosest, specimen) {
            Fit::Apart => Err(Status::NotAssemblable),
            Fit::Loose => {
                let room = self.room(&closed.misfit, loosest, specimen);
                if self.scatter(together, &room, specimen).await? {
                    return Ok(());
                }
                Box::pin(self.use_the_least(rounds, together, &room, specimen)).await
            }
            // Where load or misfit strain what is elastic, or push rigid bodies.
            Fit::Forced => {
                let settled =
                    Box::pin(together.settle(rounds, &self.system, &specimen.displacements, &self.ask())).await?;
                match self.take(together, settled, specimen) {
                    Some(room) => self.scatter(together, &room, specimen).await.map(|_| ()),
                    None => Ok(()),
                }
            }
        }
    }

    /// Draws offsets that have room in a specimen by their laws; whether there are any. Those that the exact closure takes
    /// outside their sets are drawn again.
    async fn scatter(&self, together: &Together<'_>, room: &Room<'_>, specimen: &mut Specimen) -> Result<bool, Status> {
        let before = room.has_flanks().then(|| specimen.placed());
        let mut dice = self.dice(specimen);
        for _ in 0..DRAWS {
            if !self.draw(room, &mut dice, specimen) {
                break;
            }
            let corrected = self.correct(together, specimen, room).await;
            match &before {
                Some(before) if corrected.is_err() || !self.is_within(room, specimen) => specimen.put_back(before),
                _ => return corrected.map(|()| true),
            }
        }
        Ok(false)
    }

    /// Puts a specimen where it can be assembled with the least clearance.
    async fn use_the_least(
        &self,
        rounds: &Rounds,
        together: &Together<'_>,
        room: &Room<'_>,
        specimen: &mut Specimen,
    ) -> Result<(), Status> {
        let settled = together.settle(rounds, &self.system, &specimen.displacements, &Ask::Factor).await?;
        if is_apart(settled.balance.factor) {
            return Err(Status::NotAssemblable);
        }
        self.put_all(room, self.tied.iter().map(|&g| settled.balance.given[g].as_slice()), specimen);
        self.correct(together, specimen, room).await
    }

    /// Closes the mechanism for displacements that are compatible to first order, changing them by what is left.
    async fn correct(&self, together: &Together<'_>, specimen: &mut Specimen, room: &Room<'_>) -> Result<(), Status> {
        specimen.before = Some(specimen.parameters.clone());
        let mut displacements = specimen.displacements.clone();
        for _ in 0..CORRECTIONS {
            let closed = together.close(&displacements).await?;
            specimen.plainly |= closed.plainly;
            if self.system.basis.scaled_misfit(&closed.misfit) <= FITS {
                specimen.error = Some(closed.error);
                return Ok(());
            }
            let change = room.correct(closed.misfit, &displacements);
            displacements.iter_mut().zip(change.iter()).for_each(|(d, c)| *d += c);
            self.move_offsets(specimen, &change);
        }
        Err(Status::NotAssembled)
    }
}
