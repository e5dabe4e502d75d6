//! What no specimen exceeds, strained or not, to first order.
//!
//! No specimen stores more energy than E, the most that any corner of the deviations does (the energy is convex in
//! them). Offsets, deviations and deformations that store at most E are a convex set. It holds all specimens where they
//! can be, and for every `k > 0` it reaches along a direction u at most
//!
//! ```text
//! most over all of them of   u . error  +  k (E - 1/2 v^T F^-1 v)
//! ```
//!
//! which is the value of a program under a load. k is improved until the energy there is E.

use nalgebra::DVector;

use crate::clearance::offset::inner;
use crate::cone::Kind;
use crate::cone::scheduler::{CHUNK, Rounds};
use crate::questions::worst::over_constrained::linear::{covered, directions};
use crate::questions::worst::over_constrained::model::{Model, Tried};
use crate::redundancy::balance::Balance;
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::system::{Element, System};

/// Deviations of which every corner is tried.
const EVERY_CORNER: usize = 10;
/// How often k is improved.
const ROUNDS: usize = 4;
/// Programs that are solved together are good to this part.
const ROUNDING: f64 = 1e-8;

impl Model<'_> {
    /// What the size of some components of the error does not exceed; nan where there are too many deviations to
    /// tell the most energy.
    pub fn bound(&self, range: &std::ops::Range<usize>) -> f64 {
        let Some(most) = self.most_energy() else { return f64::NAN };
        let fixed = |(kind, columns)| Element::new(kind, columns, None);
        let mut elements = self.system.elements.clone();
        elements.extend(self.deviations.blocks().map(fixed));
        let system = System { elements, ..self.system.clone() };
        let weights: Vec<Vec<f64>> = directions(range.len())
            .iter()
            .map(|u| {
                let mut weights = vec![0.0; self.base.len()];
                weights[range.clone()].iter_mut().zip(u).for_each(|(w, u)| *w = *u);
                weights
            })
            .collect();
        let c = self.compatibility;
        let bounds = Rounds::each_in_chunks(&weights, CHUNK, async |rounds, weights| {
            let (mut factor, mut least) = (1.0 / self.strength(weights, 1.0), f64::INFINITY);
            let forces = Ask::Along(weights.clone()).forces(c, &c.output.parameters);
            for _ in 0..ROUNDS {
                let balance = system.pushed(rounds, c, &self.right, &(&forces / factor)).await?;
                let stored = stored(&system, &balance);
                let moved = &c.output.parameters * DVector::from_vec(system.displacements(&balance));
                let error: Vec<f64> = self.base.iter().zip(&moved).map(|(a, b)| a + b).collect();
                let bound = inner(weights, &error) + factor * (most - stored);
                least = least.min(bound + ROUNDING * bound.abs());
                if stored > 0.0 {
                    factor *= (stored / most).sqrt();
                }
            }
            Some(least)
        });
        let bounds: Option<Vec<f64>> = bounds.into_iter().collect();
        bounds.map_or(f64::NAN, |bounds| covered(range.len(), &|k| bounds[k]))
    }

    /// The most energy that deviations store; `None` where there are too many to try all corners, or some do not go
    /// together at all.
    fn most_energy(&self) -> Option<f64> {
        let n = self.deviations.len();
        if n > EVERY_CORNER || !self.deviations.is_box() {
            return None;
        }
        let asks: Vec<Tried> = self.deviations.every_corner().map(|specimen| self.unpulled(specimen)).collect();
        let stored = |strained: Option<crate::questions::worst::over_constrained::model::Strained>| {
            strained.map(|s| stored(self.system, &s.balance))
        };
        let energies: Option<Vec<f64>> = self.poses(&asks).into_iter().map(stored).collect();
        Some(energies?.into_iter().fold(0.0, f64::max) * (1.0 + ROUNDING))
    }
}

/// The energy that is stored.
fn stored(system: &System<'_>, balance: &Balance) -> f64 {
    let of = |(element, given): (&Element, &Vec<f64>)| match element.kind {
        Kind::Spring(_) => 0.5 * element.columns.iter().zip(given).map(|(&c, v)| balance.forces[c] * v).sum::<f64>(),
        Kind::Clearance(_) | Kind::Fixed(_) => 0.0,
    };
    system.elements.iter().zip(&balance.given).map(of).sum()
}
