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

/// The program on the faces that the reactions expose, in coordinates from their middles.
struct OnFaces {
    standard: Standard,
    /// The middle of every face, and the deformation of what is elastic.
    centres: Vec<Vec<f64>>,
    /// The points of the faces nearest to the optimal offsets: they hold the equations.
    nearest: Vec<Vec<f64>>,
}

impl Program {
    /// The largest value of `sum_j direction_j . displacement_j` over all optimal poses.
    ///
    /// A reaction counts as zero, and two that compete for the same offset as equal, where what they can
    /// do within their set is less than `tolerance` times the most that any reaction can do in its own.
    /// What is elastic has one optimal deformation only.
    #[must_use]
    pub fn extreme(&self, pose: &Answer, direction: &[Vec<f64>], tolerance: f64) -> Extreme {
        let OnFaces { standard, centres, .. } = self.on_faces(pose, tolerance);
        let value: f64 = direction.iter().zip(&centres).map(|(d, centre)| inner(d, centre)).sum();
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

    /// The optimal displacements nearest to the middles of the faces, each offset measured in what its set
    /// allows; `None` where the programs' rounding leaves none.
    #[must_use]
    pub fn middle(&self, pose: &Answer, tolerance: f64) -> Option<Vec<Vec<f64>>> {
        let OnFaces { mut standard, centres, nearest } = self.on_faces(pose, tolerance);
        if standard.n == 0 {
            return Some(pose.displacements.clone());
        }
        // Where no condition binds, they are least squares.
        let least = standard.least().filter(|x| standard.violation(x) == 0.0);
        let x = least.or_else(|| {
            standard.central = true;
            let raw = standard.solve(&vec![0.0; standard.n], None);
            let gap = (raw.value - raw.dual_value).abs();
            (!raw.infeasible && Outcome::judged(gap, 0.0) == Outcome::Solved).then_some(raw.x)
        })?;
        let mut middle = standard.displacements(self, &x);
        for (k, middle) in middle.iter_mut().enumerate() {
            for (i, m) in middle.iter_mut().enumerate() {
                // Moved along the face from where the pose is, so that what a reaction decides stays to the last digit.
                *m += pose.displacements[k][i] + centres[k][i] - nearest[k][i];
            }
        }
        Some(middle)
    }

    fn on_faces(&self, pose: &Answer, tolerance: f64) -> OnFaces {
        let mut right = vec![0.0; self.n_equations()];
        let (mut regions, mut centres, mut all_nearest) = (Vec::new(), Vec::new(), Vec::new());
        for ((face, block), at) in self.faces(pose, tolerance).iter().zip(&self.blocks).zip(&pose.displacements) {
            let Some((set, face)) = face else {
                centres.push(at.clone());
                all_nearest.push(at.clone());
                continue;
            };
            let nearest = face.nearest(at);
            let from_centre: Vec<f64> = nearest.iter().zip(&face.centre).map(|(a, c)| a - c).collect();
            (0..right.len()).for_each(|i| right[i] += inner(block.row(i), &from_centre));
            regions.push(Region::of(set).face(&face.centre));
            centres.push(face.centre[..at.len()].to_vec());
            all_nearest.push(nearest[..at.len()].to_vec());
        }
        let standard = Standard::within(self, regions.into_iter(), &right);
        OnFaces { standard, centres, nearest: all_nearest }
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
