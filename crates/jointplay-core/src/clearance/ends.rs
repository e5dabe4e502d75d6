//! The other ends of a set: where else a load may hold an offset.

use crate::clearance::offset::{MAX_SIZE, padded};
use crate::clearance::{Set, Shape};

/// An offset nearer to a corner than this part of its set is in it: climbs end there up to rounding.
const THERE: f64 = 1e-6;

impl Set {
    /// Points of the boundary far from an offset: the other corners of a polygon, the other end of an interval, else
    /// the opposite of the offset.
    pub(crate) fn elsewhere(&self, offset: &[f64]) -> Vec<[f64; MAX_SIZE]> {
        let corners = match self.shape() {
            Shape::Interval { low, high } => vec![padded([low]), padded([high])],
            Shape::Diamond { gap, half_length } => {
                let tilt = gap / half_length;
                vec![padded([gap, 0.0]), padded([-gap, 0.0]), padded([0.0, tilt]), padded([0.0, -tilt])]
            }
            Shape::Round { .. } | Shape::Pin(_) | Shape::Tapered(_) => {
                let mut opposite = [0.0; MAX_SIZE];
                opposite.iter_mut().zip(offset).for_each(|(o, x)| *o = -x);
                vec![opposite]
            }
        };
        self.away_from(offset, corners)
    }

    /// The points that differ from an offset in one part of the set: what each part does by itself. Parts are the axial play
    /// and both ends of a pin, the axis and the diagonals of tapered squares; of all other sets as [`Self::elsewhere`] has it.
    pub(crate) fn other_ends(&self, offset: &[f64]) -> Vec<[f64; MAX_SIZE]> {
        if self.is_zero() {
            return Vec::new();
        }
        let unit = self.to_unit(offset);
        let n = self.size();
        let with = |change: &dyn Fn(&mut [f64; MAX_SIZE])| {
            let mut other = unit;
            change(&mut other);
            self.project_unit(&mut other[..n]);
            self.of_unit(&other)
        };
        let turned = |k: usize| with(&|other| other[k] = -other[k]);
        let ends = match self.shape() {
            Shape::Interval { .. } | Shape::Diamond { .. } | Shape::Round { .. } => return self.elsewhere(offset),
            Shape::Pin(pin) => {
                let first = pin.across();
                let end = |k: usize| with(&|other| other[k..k + 2].iter_mut().for_each(|x| *x = -*x));
                (0..first).map(turned).chain([end(first), end(first + 2)]).collect()
            }
            Shape::Tapered(tapered) => {
                let at = |axis: f64, signs: usize| {
                    with(&|other| {
                        other[0] = axis;
                        for k in 1..n {
                            let side = if signs >> (k - 1) & 1 == 1 { 1.0 } else { -1.0 };
                            other[k] = side * (1.0 - axis.abs() * tapered.tapers[(k - 1) / 2]);
                        }
                    })
                };
                let corners = 0..1_usize << (n - 1);
                // Beside a corner those in which one diagonal or the axis is at its other end; from an end of the axis all.
                let is_corner = unit[0].abs() < THERE;
                let own = (1..n).filter(|&k| unit[k] > 0.0).fold(0, |signs, k| signs | 1 << (k - 1));
                let near = |signs: &usize| !is_corner || (signs ^ own).is_power_of_two();
                let corners = corners.filter(near).map(|signs| at(0.0, signs));
                // At an end of the axis squares may be open in part.
                let open = (0..if is_corner { 0 } else { n - 1 }).map(|k| at(unit[0].signum(), own ^ 1 << k));
                [1.0, -1.0].into_iter().map(|axis| at(axis, own)).chain(open).chain(corners).collect()
            }
        };
        self.away_from(offset, ends)
    }

    /// Those of some points that are not at an offset.
    fn away_from(&self, offset: &[f64], points: Vec<[f64; MAX_SIZE]>) -> Vec<[f64; MAX_SIZE]> {
        let away = |point: &[f64; MAX_SIZE]| {
            (0..offset.len()).any(|k| (point[k] - offset[k]).abs() > THERE * self.half_width(k))
        };
        points.into_iter().filter(away).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use crate::clearance::samples::KINDS;

    /// From any corner, going on from other end to other end, every force finds where it presses the offset.
    #[test]
    fn other_ends_lead_to_every_corner() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
        for set in KINDS {
            let n = set.size();
            let force = |rng: &mut Xoshiro256PlusPlus| -> Vec<f64> {
                (0..n).map(|k| rng.random_range(-1.0..1.0) / set.half_width(k)).collect()
            };
            for _ in 0..200 {
                let (first, w) = (force(&mut rng), force(&mut rng));
                let work = |offset: &[f64]| -> f64 { w.iter().zip(offset).map(|(w, x)| w * x).sum() };
                let mut at = set.face(&first, 0.0).centre;
                for _ in 0..9 {
                    let ends = set.other_ends(&at[..n]);
                    assert!(!ends.is_empty() && ends.iter().all(|end| set.contains(&end[..n], 1e-9)), "{set:?}");
                    let more =
                        ends.into_iter().filter(|end| work(end) > work(&at)).max_by(|a, b| work(a).total_cmp(&work(b)));
                    let Some(more) = more else { break };
                    at = more;
                }
                // A disc has no corners: its other end is within 90 degrees of where the force presses it.
                let most = set.support(&w);
                let least = if set.flat_sided() == n { most * (1.0 - 1e-9) } else { 0.0 };
                assert!(work(&at) >= least, "{set:?} {} of {most}", work(&at));
            }
        }
    }
}
