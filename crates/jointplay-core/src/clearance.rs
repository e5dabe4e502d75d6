//! Admissible sets of joint offsets: support function, support point, exposed face, moments.
//!
//! | joint | set | support function h(F, M) |
//! |---|---|---|
//! | pin in hole | disc, `|d| <= r` | `r |F|` |
//! | slider in guide | diamond, `|d| + (L/2)|angle| <= c` | `c max(|F|, 2|M|/L)` |
//! | pin in slot, tolerance, drive error | interval | `max(low F, high F)` |
//!
//! The disc is the "clearance link" of Ting, Zhu and Watkins (Mech. Mach. Theory 35, 2000, 391); the
//! diamond is the linearised condition that both corners of the slider stay inside the guide.

use crate::sampling::law;
use crate::spec::{Law, SetSpec};

/// The most components that one set has.
pub const MAX_SIZE: usize = 2;

/// A convex compact set that contains zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Set {
    /// Two translations within a circle.
    Disc {
        /// Radial clearance.
        radius: f64,
    },
    /// A translation and an angle, bounded together.
    Diamond {
        /// Gap on each side.
        gap: f64,
        /// Half of the slider's length.
        half_length: f64,
    },
    /// One number.
    Interval {
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
}

impl From<SetSpec> for Set {
    fn from(spec: SetSpec) -> Self {
        match spec {
            SetSpec::Disc { radius } => Self::Disc { radius },
            SetSpec::Diamond { gap, half_length } => Self::Diamond { gap, half_length },
            SetSpec::Interval { low, high } => Self::Interval { low, high },
        }
    }
}

/// The part of a set where a linear function is largest: a centre and how far it reaches.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// The middle of the face.
    pub centre: [f64; MAX_SIZE],
    extent: Extent,
}

#[derive(Clone, Copy, Debug)]
enum Extent {
    Point,
    Segment([f64; MAX_SIZE]),
    Whole(Set),
}

impl Face {
    /// Whether the linear function decides a single point.
    #[must_use]
    pub const fn is_point(&self) -> bool {
        matches!(self.extent, Extent::Point)
    }

    /// The point of the face nearest to an offset of the set.
    #[must_use]
    pub fn nearest(&self, offset: &[f64]) -> [f64; MAX_SIZE] {
        match self.extent {
            Extent::Point => self.centre,
            Extent::Whole(_) => {
                let mut nearest = [0.0; MAX_SIZE];
                nearest[..offset.len()].copy_from_slice(offset);
                nearest
            }
            Extent::Segment(half) => {
                // Along the segment in its own proportions, since its components differ in unit.
                let along = (0..MAX_SIZE).map(|k| (offset[k] - self.centre[k]) / half[k]).sum::<f64>();
                let t = (0.5 * along).clamp(-1.0, 1.0);
                std::array::from_fn(|k| self.centre[k] + t * half[k])
            }
        }
    }

    /// Half of the range of `direction . offset` over the face.
    #[must_use]
    pub fn half_width(&self, direction: &[f64]) -> f64 {
        match self.extent {
            Extent::Point => 0.0,
            Extent::Segment(half) => inner(direction, &half).abs(),
            Extent::Whole(set) => {
                let opposite: Vec<f64> = direction.iter().map(|x| -x).collect();
                0.5 * (set.support(direction) + set.support(&opposite))
            }
        }
    }
}

impl Set {
    /// Number of components.
    #[must_use]
    pub const fn size(&self) -> usize {
        match self {
            Self::Disc { .. } | Self::Diamond { .. } => 2,
            Self::Interval { .. } => 1,
        }
    }

    /// The largest absolute value of one component.
    #[inline]
    #[must_use]
    pub fn half_width(&self, component: usize) -> f64 {
        match *self {
            Self::Disc { radius } => radius,
            Self::Diamond { gap, half_length } => {
                if component == 0 {
                    gap
                } else {
                    gap / half_length
                }
            }
            Self::Interval { low, high } => high.max(-low),
        }
    }

    /// The set's own coordinates of an offset: the disc becomes the unit disc, the interval and the
    /// diamond (turned by 45 degrees) become the interval and the square from -1 to 1. The set must
    /// not be a point.
    #[must_use]
    pub fn to_unit(&self, offset: &[f64]) -> [f64; MAX_SIZE] {
        match *self {
            Self::Disc { radius } => [offset[0] / radius, offset[1] / radius],
            Self::Diamond { gap, half_length } => {
                let (a, b) = (offset[0] / gap, offset[1] * half_length / gap);
                [a + b, a - b]
            }
            Self::Interval { low, high } => [(2.0 * offset[0] - low - high) / (high - low), 0.0],
        }
    }

    /// The offset of coordinates of the set's own.
    #[must_use]
    pub fn of_unit(&self, unit: &[f64]) -> [f64; MAX_SIZE] {
        match *self {
            Self::Disc { radius } => [radius * unit[0], radius * unit[1]],
            Self::Diamond { gap, half_length } => {
                [0.5 * gap * (unit[0] + unit[1]), 0.5 * gap / half_length * (unit[0] - unit[1])]
            }
            Self::Interval { low, high } => [0.5 * (low + high) + 0.5 * (high - low) * unit[0], 0.0],
        }
    }

    /// A gradient along the offset, along the set's own coordinates.
    #[must_use]
    pub fn unit_gradient(&self, w: &[f64]) -> [f64; MAX_SIZE] {
        match *self {
            Self::Disc { radius } => [radius * w[0], radius * w[1]],
            Self::Diamond { gap, half_length } => {
                let (a, b) = (gap * w[0], gap / half_length * w[1]);
                [0.5 * (a + b), 0.5 * (a - b)]
            }
            Self::Interval { low, high } => [0.5 * (high - low) * w[0], 0.0],
        }
    }

    /// The nearest point of the set in its own coordinates.
    pub fn project_unit(&self, unit: &mut [f64]) {
        match *self {
            Self::Disc { .. } => {
                let size = unit[0].hypot(unit[1]);
                if size > 1.0 {
                    unit[0] /= size;
                    unit[1] /= size;
                }
            }
            Self::Diamond { .. } | Self::Interval { .. } => {
                for u in unit {
                    *u = u.clamp(-1.0, 1.0);
                }
            }
        }
    }

    /// Whether the set is the single point zero.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        match *self {
            Self::Disc { radius } => radius == 0.0,
            Self::Diamond { gap, .. } => gap == 0.0,
            Self::Interval { low, high } => low == 0.0 && high == 0.0,
        }
    }

    /// Support function: the largest `w . offset` over the set.
    #[must_use]
    pub fn support(&self, w: &[f64]) -> f64 {
        match *self {
            Self::Disc { radius } => radius * w[0].hypot(w[1]),
            Self::Diamond { gap, half_length } => gap * w[0].abs().max(w[1].abs() / half_length),
            Self::Interval { low, high } => (w[0] * low).max(w[0] * high),
        }
    }

    /// The face of the set where `w . offset` is largest.
    ///
    /// `tolerance` (in the units of `w[0]`) is the size below which a component of `w`, or the
    /// difference between two competing ones, counts as zero, so that rounding noise decides nothing.
    #[inline]
    #[must_use]
    pub fn face(&self, w: &[f64], tolerance: f64) -> Face {
        let point = |centre| Face { centre, extent: Extent::Point };
        let whole = |centre| Face { centre, extent: Extent::Whole(*self) };
        if self.is_zero() {
            return point([0.0; MAX_SIZE]);
        }
        match *self {
            Self::Disc { radius } => {
                let size = w[0].hypot(w[1]);
                if size <= tolerance {
                    return whole([0.0; MAX_SIZE]);
                }
                point([radius * w[0] / size, radius * w[1] / size])
            }
            Self::Diamond { gap, half_length } => {
                let (shift, tilt) = (w[0].abs(), w[1].abs() / half_length);
                if shift.max(tilt) <= tolerance {
                    return whole([0.0; MAX_SIZE]);
                }
                let corners = [gap.copysign(w[0]), (gap / half_length).copysign(w[1])];
                if (shift - tilt).abs() <= tolerance {
                    let half = [0.5 * corners[0], -0.5 * corners[1]];
                    return Face { centre: [0.5 * corners[0], 0.5 * corners[1]], extent: Extent::Segment(half) };
                }
                point(if shift > tilt { [corners[0], 0.0] } else { [0.0, corners[1]] })
            }
            Self::Interval { low, high } => {
                if w[0].abs() <= tolerance {
                    return whole([0.5 * (low + high), 0.0]);
                }
                point([if w[0] > 0.0 { high } else { low }, 0.0])
            }
        }
    }

    /// Directions (angles of `w` in the plane of two rows of a linear map) at which the support
    /// point of a polyhedral set jumps are where these linear forms of `w` vanish.
    #[must_use]
    pub fn break_forms(&self) -> Vec<[f64; MAX_SIZE]> {
        match *self {
            Self::Disc { .. } => Vec::new(),
            Self::Diamond { half_length, .. } => {
                let l = 1.0 / half_length;
                vec![[1.0, l], [1.0, -l], [1.0, 0.0], [0.0, 1.0]]
            }
            Self::Interval { .. } => vec![[1.0, 0.0]],
        }
    }

    /// Whether the offset is admissible, to a relative `tolerance`.
    #[must_use]
    pub fn contains(&self, offset: &[f64], tolerance: f64) -> bool {
        let slack = 1.0 + tolerance;
        match *self {
            Self::Disc { radius } => offset[0].hypot(offset[1]) <= radius * slack,
            Self::Diamond { gap, half_length } => offset[0].abs() + half_length * offset[1].abs() <= gap * slack,
            Self::Interval { low, high } => {
                let margin = tolerance * (high - low);
                low - margin <= offset[0] && offset[0] <= high + margin
            }
        }
    }

    /// Mean and variance of each component under a law; the components are uncorrelated.
    #[must_use]
    pub fn moments(&self, law: Law) -> ([f64; MAX_SIZE], [f64; MAX_SIZE]) {
        match *self {
            Self::Disc { radius } => {
                let variance = radius * radius * law::disc_variance(law);
                ([0.0; 2], [variance; 2])
            }
            Self::Diamond { gap, half_length } => {
                let variance = gap * gap * law::diamond_variance(law);
                ([0.0; 2], [variance, variance / (half_length * half_length)])
            }
            Self::Interval { low, high } => {
                let half = 0.5 * (high - low);
                ([0.5 * (low + high), 0.0], [half * half * law::interval_variance(law), 0.0])
            }
        }
    }
}

pub(crate) fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::draw::Stream;
    use crate::batch::lanes::LANES;

    const SETS: [Set; 4] = [
        Set::Disc { radius: 0.7 },
        Set::Diamond { gap: 0.3, half_length: 2.5 },
        Set::Interval { low: -0.2, high: 0.5 },
        Set::Interval { low: 0.0, high: 0.0 },
    ];

    fn samples(set: &Set, law: Law, blocks: usize) -> Vec<Vec<f64>> {
        let mut stream = Stream::new(1, 2);
        let mut samples = Vec::with_capacity(blocks * LANES);
        for _ in 0..blocks {
            let drawn = stream.draw(set, law);
            samples.extend((0..LANES).map(|i| drawn.iter().take(set.size()).map(|b| b.0[i]).collect()));
        }
        samples
    }

    #[test]
    fn support_is_attained_on_the_face_and_never_exceeded_by_samples() {
        for set in SETS {
            for law in [Law::Uniform, Law::Boundary, Law::Normal] {
                for (k, offset) in samples(&set, law, 500).into_iter().enumerate() {
                    let angle = k as f64;
                    let w = [angle.cos(), angle.sin()];
                    let face = set.face(&w[..set.size()], 0.0);
                    assert!((inner(&w[..set.size()], &face.centre) - set.support(&w)).abs() < 1e-15);
                    assert!(set.contains(&face.centre[..set.size()], 1e-14));
                    assert!(set.contains(&offset, 1e-14), "{set:?} {law:?} {offset:?}");
                    assert!(inner(&w, &offset) <= set.support(&w) + 1e-15);
                }
            }
        }
    }

    #[test]
    fn own_coordinates_keep_offsets_gradients_and_membership() {
        for set in &SETS[..3] {
            let n = set.size();
            for offset in samples(set, Law::Uniform, 20) {
                let unit = set.to_unit(&offset);
                let back = set.of_unit(&unit);
                assert!((0..n).all(|k| (back[k] - offset[k]).abs() < 1e-15));
                let mut projected = unit;
                set.project_unit(&mut projected[..n]);
                assert!((0..n).all(|k| (projected[k] - unit[k]).abs() < 1e-15), "inside stays");
                // w . d offset = gradient . d unit
                let (w, step) = ([0.3, -0.8], [0.01, -0.02]);
                let moved: Vec<f64> = (0..n).map(|k| unit[k] + step[k]).collect();
                let moved = set.of_unit(&[moved[0], moved.get(1).copied().unwrap_or(0.0)]);
                let work: f64 = (0..n).map(|k| w[k] * (moved[k] - back[k])).sum();
                assert!((work - inner(&set.unit_gradient(&w)[..n], &step)).abs() < 1e-15);
                let mut outside: Vec<f64> = unit[..n].iter().map(|u| 5.0 * u).collect();
                set.project_unit(&mut outside);
                let onto = set.of_unit(&[outside[0], outside.get(1).copied().unwrap_or(0.0)]);
                assert!(set.contains(&onto[..n], 1e-12));
            }
        }
    }

    #[test]
    fn moments_agree_with_samples() {
        for set in SETS {
            for law in [Law::Uniform, Law::Boundary, Law::Normal, Law::Gauss] {
                let (mean, variance) = set.moments(law);
                let samples = samples(&set, law, 20_000);
                let n = samples.len() as f64;
                for i in 0..set.size() {
                    let sum: f64 = samples.iter().map(|s| s[i]).sum();
                    let squares: f64 = samples.iter().map(|s| (s[i] - mean[i]).powi(2)).sum();
                    // Five standard errors of the mean; the variance's is below 1 % for every law here.
                    assert!((sum / n - mean[i]).abs() <= 5.0 * (variance[i] / n).sqrt() + 1e-15);
                    assert!((squares / n - variance[i]).abs() <= 0.02 * variance[i], "{set:?} {law:?}");
                    if set.size() == 2 {
                        let other = 1 - i;
                        let mixed: f64 = samples.iter().map(|s| s[i] * s[other]).sum();
                        assert!((mixed / n).abs() <= 5.0 * (variance[0] * variance[1] / n).sqrt());
                    }
                }
            }
        }
    }

    #[test]
    fn a_tie_exposes_an_edge_and_no_load_exposes_all() {
        let set = Set::Diamond { gap: 1.0, half_length: 2.0 };
        let edge = set.face(&[1.0, 2.0], 1e-12);
        assert!(!edge.is_point());
        assert!((edge.half_width(&[1.0, 0.0]) - 0.5).abs() < 1e-15);
        assert!(edge.half_width(&[1.0, 2.0]).abs() < 1e-15);
        let whole = set.face(&[0.0, 0.0], 1e-12);
        assert!((whole.half_width(&[0.0, 1.0]) - 0.5).abs() < 1e-15);
        assert!(set.face(&[1.0, 0.0], 1e-12).is_point());
    }
}
