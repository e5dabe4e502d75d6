//! The course of a specimen: from what has been drawn for it to what becomes of it.

use nalgebra::DMatrix;

use crate::cone::scheduler::Rounds;
use crate::mechanism::status::Status;
use crate::questions::random::over_constrained::specimen::{Fit, Job, Specimen};
use crate::redundancy::compatibility::FITS;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::specimen_batch::Together;

/// Corrections that make linearly compatible displacements exactly so: each leaves a part of the misfit that is
/// of the order of the displacements over the dimensions.
const CORRECTIONS: usize = 12;

/// A factor that differs from one by less may be on the other side on the exact closure: it changes by the order of the
/// displacements over the dimensions.
const NEAR: f64 = 0.05;

impl Job<'_> {
    /// Solves specimens with what has been drawn for them, of which the first has the given number.
    pub fn solve(&self, together: &Together<'_>, drawn: &[Vec<f64>], first: u64) -> Vec<Specimen> {
        together.each(drawn.iter().zip(0..), async |rounds, (drawn, number)| {
            let own = self.of_specimen(drawn);
            let job = own.as_deref().unwrap_or(self);
            let mut specimen = job.drawn(drawn, first.wrapping_add(number));
            if let Err(status) = job.place(rounds, together, &mut specimen).await {
                (specimen.status, specimen.error) = (status, None);
            }
            specimen
        })
    }

    /// Puts a specimen where it can be assembled.
    async fn place(&self, rounds: &Rounds, together: &Together<'_>, specimen: &mut Specimen) -> Result<(), Status> {
        let closed = together.close(&specimen.displacements).await?;
        specimen.plainly = closed.plainly;
        let mut loosest = self.factor(rounds, &closed.misfit).await;
        // Near one, where it decides, the factor is that of the exact closure. What few specimens go through is boxed:
        // a course is as large as the largest it waits for.
        if (loosest.factor - 1.0).abs() < NEAR
            && let Ok(exactly) =
                Box::pin(together.settle(rounds, &self.system, &specimen.displacements, &Ask::Factor)).await
        {
            loosest.settle_at(exactly.balance.factor);
        }
        match self.fit(&closed.misfit, loosest, specimen) {
            Fit::Apart => Err(Status::NotAssemblable),
            Fit::Loose => self.correct(together, specimen, &self.correction).await,
            // Where load or misfit strain what is elastic, or push rigid bodies.
            Fit::Forced => {
                let settled =
                    Box::pin(together.settle(rounds, &self.system, &specimen.displacements, &self.ask())).await?;
                match self.take(settled, specimen) {
                    Some(correction) => self.correct(together, specimen, &correction).await,
                    None => Ok(()),
                }
            }
        }
    }

    /// Closes the mechanism for displacements that are compatible to first order, changing them by what is left;
    /// `correction` changes a misfit with the least displacements.
    async fn correct(
        &self,
        together: &Together<'_>,
        specimen: &mut Specimen,
        correction: &DMatrix<f64>,
    ) -> Result<(), Status> {
        specimen.before = Some(specimen.parameters.clone());
        let mut displacements = specimen.displacements.clone();
        for _ in 0..CORRECTIONS {
            let closed = together.close(&displacements).await?;
            specimen.plainly |= closed.plainly;
            if self.system.basis.scaled_misfit(&closed.misfit) <= FITS {
                specimen.error = Some(closed.error);
                return Ok(());
            }
            let change = correction * closed.misfit;
            displacements.iter_mut().zip(change.iter()).for_each(|(d, c)| *d += c);
            self.move_offsets(specimen, &change);
        }
        Err(Status::NotAssembled)
    }
}
