//! Sets of offsets in coordinates of their own, as products of a few simple bodies: the one place where
//! the sets become cones.
//!
//! In its own coordinates p (see [`Set::to_unit`]) every set is a product of intervals `low <= p <= high`,
//! unit discs and balls `|p| <= 1`, and intervals along which others taper, `|p_i| + g_i |p_0| <= 1`. All
//! coordinates have sizes near one whatever the units are; those of parts that are points are left out.

use crate::clearance::{MAX_SIZE, Set};

/// Coefficients of a linear form of an offset.
pub(super) type Form = [f64; MAX_SIZE];

/// A simple body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Atom {
    /// One coordinate between bounds.
    Interval { low: f64, high: f64 },
    /// Unit disc or ball.
    Round { size: usize },
    /// An axis from -1 to 1 and arms between +-1, shorter the farther along the axis.
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
