//! The ends of the face of optimal displacements.
//!
//! Displacements are optimal where each offset is on the face of its set that the reaction exposes and
//! the equations hold. These faces are sets themselves: the conditions that are tight in the middle of
//! a face are equalities on it, the others remain. So the programs for its ends are exact, while a
//! bound on the value within a tolerance would leave a disc an arc as wide as the tolerance's root.

use super::sets::Region;
use super::standard::Standard;
use super::{Answer, Extreme, Kind, Outcome, Program};
use crate::clearance::{Face, Set, inner};

impl Program {
    /// The largest value of `sum_j direction_j . displacement_j` over all optimal poses.
    ///
    /// A reaction counts as zero, and two that compete for the same offset as equal, where what they can
    /// do within their set is less than `tolerance` times the most that any reaction can do in its own.
    /// What is elastic has one optimal deformation only.
    #[must_use]
    pub fn extreme(&self, pose: &Answer, direction: &[Vec<f64>], tolerance: f64) -> Extreme {
        let faces = self.faces(pose, tolerance);
        // The optimal offsets as points of the faces, so that these are not empty for the equations.
        let mut value = 0.0;
        let mut right = vec![0.0; self.n_equations()];
        let mut nearest = faces.iter().zip(&pose.displacements).map(|(face, at)| match face {
            Some((_, face)) => face.nearest(at)[..at.len()].to_vec(),
            None => at.clone(),
        });
        let mut regions = Vec::new();
        for (k, block) in self.blocks.iter().enumerate() {
            let at = nearest.next().unwrap_or_default();
            if let Some((set, face)) = &faces[k] {
                let region = Region::of(set).face(&face.centre);
                let from_centre: Vec<f64> = at.iter().zip(&face.centre).map(|(a, c)| a - c).collect();
                value += inner(&direction[k], &face.centre);
                (0..right.len()).for_each(|i| right[i] += inner(block.row(i), &from_centre));
                regions.push(region);
            } else {
                value += inner(&direction[k], &at);
            }
        }
        let standard = Standard::within(self, regions.into_iter(), &right);
        let cost: Vec<f64> = standard.coefficients(direction.iter().map(Vec::as_slice)).iter().map(|c| -c).collect();
        let reach: f64 = cost.iter().map(|c| c.abs()).sum();
        if reach == 0.0 {
            return Extreme { outcome: Outcome::judged(0.0, 0.0), value, gap: 0.0 };
        }
        let scaled: Vec<f64> = cost.iter().map(|c| c / reach).collect();
        let raw = standard.solve(&scaled, None);
        let gap = (raw.value - raw.dual_value).abs();
        let outcome = if raw.infeasible { Outcome::Infeasible } else { Outcome::judged(gap, 0.0) };
        Extreme { outcome, value: value - reach * raw.value, gap }
    }

    /// The faces that the reactions expose.
    fn faces(&self, pose: &Answer, tolerance: f64) -> Vec<Option<(Set, Face)>> {
        let sets = self.blocks.iter().map(|block| match &block.kind {
            Kind::Clearance(set) | Kind::Fixed(set) => Some((*set, block.reaction(&pose.multipliers))),
            Kind::Spring(_) => None,
        });
        let sets: Vec<Option<(Set, Vec<f64>)>> = sets.collect();
        let work = sets.iter().flatten().map(|(set, w)| set.reach(w)).fold(0.0, f64::max);
        let face = |(set, w): (Set, Vec<f64>)| {
            // The force that does as much in the set's gap.
            let gap = match set {
                Set::Journal { radius, axial, .. } => radius.max(axial),
                _ => set.half_width(0),
            };
            let force = if gap > 0.0 { tolerance * work / gap } else { 0.0 };
            (set, set.face(&w, force))
        };
        sets.into_iter().map(|set| set.map(face)).collect()
    }
}
