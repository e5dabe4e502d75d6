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
        let mut stream = Stream::new(1, 2, 3);
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
