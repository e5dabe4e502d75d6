//! Offsets in coordinates of the set's own, in which projections are simple.

use crate::clearance::offset::{MAX_SIZE, padded, padded_with};
use crate::clearance::projection::{onto_ball, onto_ball_along, onto_box_along};
use crate::clearance::{Set, Shape};
use crate::math::real::Real;

impl Set {
    /// The set's own coordinates of an offset.
    ///
    /// The disc and the ball become the unit disc and ball; the interval and the diamond (turned by 45
    /// degrees) the interval and the square from -1 to 1; journal and sleeve the product of the axial
    /// interval with a unit disc for each end of the pin; guide and plate squares that taper along an
    /// interval. The set must not be a point; the coordinates of a part of it that is one are zero.
    #[must_use]
    pub fn to_unit(&self, offset: &[f64]) -> [f64; MAX_SIZE] {
        match self.shape() {
            Shape::Round { radius, size } => std::array::from_fn(|k| if k < size { offset[k] / radius } else { 0.0 }),
            Shape::Diamond { gap, half_length } => {
                let (a, b) = (offset[0] / gap, offset[1] * half_length / gap);
                padded([a + b, a - b])
            }
            Shape::Interval { low, high } => padded([(2.0 * offset[0] - low - high) / (high - low)]),
            Shape::Pin(pin) => pin.to_unit(offset),
            Shape::Tapered(tapered) => tapered.to_unit(offset),
        }
    }

    /// The offset of coordinates of the set's own.
    #[must_use]
    pub fn of_unit(&self, unit: &[f64]) -> [f64; MAX_SIZE] {
        self.of_own(unit)
    }

    /// The same of other numbers.
    pub(crate) fn of_own<S: Real>(&self, unit: &[S]) -> [S; MAX_SIZE] {
        let times = |factor: f64, x: S| S::from_f64(factor) * x;
        match self.shape() {
            Shape::Round { radius, size } => padded_with(size, |k| times(radius, unit[k])),
            Shape::Diamond { gap, half_length } => {
                let shift_and_turn =
                    [times(0.5 * gap, unit[0] + unit[1]), times(0.5 * gap / half_length, unit[0] - unit[1])];
                padded_with(2, |k| shift_and_turn[k])
            }
            Shape::Interval { low, high } => {
                padded_with(1, |_| S::from_f64(0.5 * (low + high)) + times(0.5 * (high - low), unit[0]))
            }
            Shape::Pin(pin) => pin.of_unit(unit),
            Shape::Tapered(tapered) => tapered.of_unit(unit),
        }
    }

    /// A gradient along the offset, along the set's own coordinates.
    #[must_use]
    pub fn unit_gradient(&self, w: &[f64]) -> [f64; MAX_SIZE] {
        self.own_gradient(w)
    }

    /// The same of other numbers.
    pub(crate) fn own_gradient<S: Real>(&self, w: &[S]) -> [S; MAX_SIZE] {
        let times = |factor: f64, x: S| S::from_f64(factor) * x;
        match self.shape() {
            Shape::Round { radius, size } => padded_with(size, |k| times(radius, w[k])),
            Shape::Diamond { gap, half_length } => {
                let (a, b) = (times(gap, w[0]), times(gap / half_length, w[1]));
                let along = [times(0.5, a + b), times(0.5, a - b)];
                padded_with(2, |k| along[k])
            }
            Shape::Interval { low, high } => padded_with(1, |_| times(0.5 * (high - low), w[0])),
            Shape::Pin(pin) => pin.unit_gradient(w),
            Shape::Tapered(tapered) => tapered.unit_gradient(w),
        }
    }

    /// How many of its own coordinates, from the first on, have flat bounds.
    #[must_use]
    pub fn flat_sided(&self) -> usize {
        match self.shape() {
            Shape::Round { .. } => 0,
            Shape::Pin(pin) => usize::from(pin.axial.is_some()),
            _ => self.size(),
        }
    }

    /// The part of a step from a point of the set, in own coordinates, that stays in it; round sets are left
    /// at once by a step along them, which is taken whole.
    #[must_use]
    pub fn part_within(&self, unit: &[f64], step: &[f64]) -> f64 {
        match self.shape() {
            Shape::Tapered(tapered) => tapered.part_within(unit, step),
            _ => 1.0,
        }
    }

    /// How the nearest point of the set moves where the point, in own coordinates, moves along a direction.
    pub fn project_unit_along(&self, unit: &[f64], direction: &mut [f64]) {
        match self.shape() {
            Shape::Round { .. } => onto_ball_along(unit, direction),
            Shape::Diamond { .. } | Shape::Interval { .. } => onto_box_along(unit, direction),
            Shape::Pin(pin) => pin.project_unit_along(unit, direction),
            Shape::Tapered(tapered) => tapered.whole().nearest_unit_along(unit, direction),
        }
    }

    /// The nearest point of the set in its own coordinates.
    pub fn project_unit(&self, unit: &mut [f64]) {
        match self.shape() {
            Shape::Round { .. } => onto_ball(unit),
            Shape::Diamond { .. } | Shape::Interval { .. } => {
                for u in unit {
                    *u = u.clamp(-1.0, 1.0);
                }
            }
            Shape::Pin(pin) => pin.project_unit(unit),
            Shape::Tapered(tapered) => {
                let nearest = tapered.whole().nearest_unit(unit);
                unit.copy_from_slice(&nearest[..unit.len()]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::clearance::samples::KINDS;

    fn within(reach: f64, size: usize, rng: &mut impl Rng) -> Vec<f64> {
        (0..size).map(|_| rng.random_range(-reach..reach)).collect()
    }

    fn projected(set: &Set, unit: &[f64]) -> Vec<f64> {
        let mut point = unit.to_vec();
        set.project_unit(&mut point);
        point
    }

    /// Central differences agree but for the few points that lie beside a kink.
    #[test]
    fn nearest_points_move_as_their_derivative_says() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let h = 1e-6;
        for set in KINDS {
            let n = set.size();
            let mut off = 0;
            for _ in 0..2000 {
                let (unit, along) = (within(2.0, n, &mut rng), within(1.0, n, &mut rng));
                let at = |h: f64| projected(&set, &unit.iter().zip(&along).map(|(u, d)| u + h * d).collect::<Vec<_>>());
                let mut slope = along.clone();
                set.project_unit_along(&unit, &mut slope);
                let differences = at(h).into_iter().zip(at(-h)).map(|(a, b)| (a - b) / (2.0 * h));
                off += usize::from(differences.zip(slope).any(|(d, s)| (d - s).abs() > 1e-6));
            }
            assert!(off <= 2, "{set:?} {off}");
        }
    }

    #[test]
    fn a_step_is_cut_where_it_leaves_the_set() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        for set in KINDS.into_iter().filter(|s| matches!(s.shape(), Shape::Tapered(_))) {
            for _ in 0..2000 {
                let n = set.size();
                let unit: Vec<f64> = projected(&set, &within(1.5, n, &mut rng)).into_iter().map(|u| 0.99 * u).collect();
                let step = within(3.0, n, &mut rng);
                let part = set.part_within(&unit, &step);
                let at = |part: f64| {
                    let moved: Vec<f64> = unit.iter().zip(&step).map(|(u, d)| u + part * d).collect();
                    set.of_unit(&moved)[..n].to_vec()
                };
                assert!(set.contains(&at(part), 1e-12), "{set:?}");
                assert!(part >= 1.0 || !set.contains(&at(part + 1e-6), 1e-12), "{set:?}");
            }
        }
    }
}
