//! Sets of offsets in coordinates of their own, as products of a few simple bodies: the one place where
//! the sets become cones.
//!
//! In its own coordinates p (see [`Set::to_unit`]) every set is a product of intervals `low <= p <= high`,
//! unit discs and balls `|p| <= 1`, and intervals along which others taper, `|p_i| + g_i |p_0| <= 1`. All
//! coordinates have sizes near one whatever the units are; those of parts that are points are left out.

use crate::clearance::Set;
use crate::clearance::offset::MAX_SIZE;
use crate::math::vector::norm;

/// Coefficients of a linear form of an offset.
pub(crate) type Form = [f64; MAX_SIZE];

/// A simple body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Atom {
    /// One coordinate between bounds.
    Interval { low: f64, high: f64 },
    /// Unit disc or ball.
    Round { size: usize },
    /// An axis and arms between +-1, shorter the farther along the axis: at least one of them shrinks to nothing at the
    /// end of the axis, which alone bounds it.
    Tapered { arms: usize, tapers: [f64; 4] },
}

impl Atom {
    /// Number of coordinates.
    pub const fn size(&self) -> usize {
        match self {
            Self::Interval { .. } => 1,
            Self::Round { size } => *size,
            Self::Tapered { arms, .. } => 1 + *arms,
        }
    }

    /// How far the nearest side is from the coordinates, as a part of the body.
    pub fn slack(&self, p: &[f64]) -> f64 {
        match self {
            Self::Interval { low, high } => (high - p[0]).min(p[0] - low) / (0.5 * (high - low)),
            Self::Round { .. } => 1.0 - norm(p),
            Self::Tapered { arms, tapers } => {
                let arm = |k: usize| 1.0 - p[1 + k].abs() - tapers[k] * p[0].abs();
                (0..*arms).map(arm).fold(1.0 - p[0].abs(), f64::min)
            }
        }
    }

    /// What the farthest point reaches along a force.
    pub fn support(&self, force: &[f64]) -> f64 {
        let mut point = [0.0; MAX_SIZE];
        self.support_point(force, &mut point);
        force.iter().zip(&point).map(|(f, p)| f * p).sum()
    }

    /// The farthest point along a force.
    pub fn support_point(&self, force: &[f64], point: &mut [f64]) {
        match self {
            Self::Interval { low, high } => point[0] = if force[0] > 0.0 { *high } else { *low },
            Self::Round { .. } => {
                let size = norm(force);
                let per = if size > 0.0 { 1.0 / size } else { 0.0 };
                point.iter_mut().zip(force).for_each(|(p, f)| *p = per * f);
            }
            Self::Tapered { arms, tapers } => {
                let lost: f64 = (0..*arms).map(|k| tapers[k] * force[1 + k].abs()).sum();
                point[0] = if force[0].abs() > lost { force[0].signum() } else { 0.0 };
                let along = point[0].abs();
                (0..*arms).for_each(|k| point[1 + k] = force[1 + k].signum() * (1.0 - tapers[k] * along));
            }
        }
    }

    /// How the farthest point turns with its force: by this number times what the force changes across this unit
    /// vector. Corners do not.
    pub fn bend(&self, force: &[f64], point: &[f64]) -> Option<(f64, [f64; 3])> {
        let Self::Round { size } = self else { return None };
        let mut normal = [0.0; 3];
        normal[..*size].copy_from_slice(point);
        Some((1.0 / norm(force), normal))
    }
}

/// A set in its own coordinates: what each of them displaces, and the bodies, one coordinate after the
/// other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Own {
    columns: [Form; MAX_SIZE],
    n: usize,
    atoms: [Option<Atom>; 3],
}

impl Own {
    pub fn of(set: &Set) -> Self {
        let mut columns = [[0.0; MAX_SIZE]; MAX_SIZE];
        for k in 0..set.size() {
            let mut one = [0.0; MAX_SIZE];
            one[k] = 1.0;
            let gradient = set.unit_gradient(&one[..set.size()]);
            columns.iter_mut().zip(gradient).for_each(|(column, g)| column[k] = g);
        }
        let centred = Atom::Interval { low: -1.0, high: 1.0 };
        let disc = Atom::Round { size: 2 };
        let atoms = match *set {
            Set::Disc { .. } => [Some(disc), None, None],
            Set::Ball { .. } => [Some(Atom::Round { size: 3 }), None, None],
            Set::Interval { low, high } => {
                // From zero, since the factor on the clearances scales it from there.
                let half = set.half_width(0);
                columns[0][0] = half;
                [Some(Atom::Interval { low: low / half, high: high / half }), None, None]
            }
            Set::Diamond { .. } => [Some(centred), Some(centred), None],
            Set::Journal { .. } => [Some(centred), Some(disc), Some(disc)],
            Set::Sleeve { .. } => [Some(disc), Some(disc), None],
            Set::Guide { half_width, half_height, .. } => {
                let lever = half_width.max(half_height);
                let (first, second) = (half_height / lever, half_width / lever);
                [Some(Atom::Tapered { arms: 4, tapers: [first, first, second, second] }), None, None]
            }
            Set::Plate { .. } => [Some(Atom::Tapered { arms: 2, tapers: [1.0, 1.0, 0.0, 0.0] }), None, None],
        };
        let mut own = Self { columns, n: 0, atoms: [None; 3] };
        let (mut from, mut kept) = (0, 0);
        for atom in atoms.into_iter().flatten() {
            // The parts of a body are points together.
            if columns[from].iter().any(|c| *c != 0.0) {
                for k in from..from + atom.size() {
                    own.columns[own.n] = columns[k];
                    own.n += 1;
                }
                own.atoms[kept] = Some(atom);
                kept += 1;
            }
            from += atom.size();
        }
        own
    }

    /// What each coordinate displaces.
    pub fn columns(&self) -> &[Form] {
        &self.columns[..self.n]
    }

    /// The offset at coordinates.
    pub fn offset(&self, p: &[f64]) -> Form {
        std::array::from_fn(|k| self.columns().iter().zip(p).map(|(column, p)| column[k] * p).sum())
    }

    /// The coordinates of an offset of the set: their columns are orthogonal in the largest values of the components.
    pub fn coordinates<'a>(&'a self, set: &'a Set, offset: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.columns().iter().map(|column| {
            let (mut along, mut size) = (0.0, 0.0);
            for (k, d) in offset.iter().enumerate().filter(|(k, _)| column[*k] != 0.0) {
                let per = 1.0 / set.half_width(k);
                along += column[k] * per * d * per;
                size += (column[k] * per).powi(2);
            }
            along / size
        })
    }

    /// One of the bodies, of which there are three at most.
    pub const fn atom(&self, k: usize) -> Option<Atom> {
        self.atoms[k]
    }

    /// The bodies, each with its first coordinate.
    pub fn atoms(&self) -> impl Iterator<Item = (usize, Atom)> {
        let mut next = 0;
        self.atoms.into_iter().flatten().map(move |atom| {
            let first = next;
            next += atom.size();
            (first, atom)
        })
    }
}
