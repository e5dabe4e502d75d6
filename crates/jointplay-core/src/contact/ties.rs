//! The equations that tie what is open: how forces change along the directions in which faces are open.
//!
//! What the load presses to a round bound turns there with its force, and changes the other forces as much as the open
//! directions do themselves: its offset by `r df / f`, times what `f` changes by along the play `r`. An arm on an upright
//! axis with play stands as firmly at every angle: its axis tilts with the arm.

use nalgebra::{DMatrix, DVector};

use crate::clearance::face::{Direction, Face};
use crate::clearance::offset::{MAX_SIZE, inner};
use crate::clearance::undecided::{UNDECIDED, Unforced};
use crate::closure::newton::Solver;
use crate::closure::second_order::Along;
use crate::contact::state::Contact;
use crate::math::decomposition::{largest_eigenpair, singular_values};
use crate::mechanism::{Mechanism, Source};

/// A step along a force that leads to the support point, as a part of the set.
const FAR: f64 = 1e9;
/// Rounds in which forces and what they turn come to agree: each leaves the part that the play is of the mechanism.
const ROUNDS: usize = 8;
/// They agree where forces change by no more than this part of the largest one.
const AGREED: f64 = 1e-2 * UNDECIDED;

/// How the forces along open directions change along them.
pub(crate) struct Bend {
    pub ways: Vec<(usize, Direction)>,
    /// Changes over half of the extent, as parts of the largest reaction.
    matrix: DMatrix<f64>,
    /// The forces themselves.
    force: DVector<f64>,
}

/// Independent combinations of open directions along which forces change.
pub(crate) struct Ties {
    pub rows: DMatrix<f64>,
    /// The step along each of them that makes its force zero.
    pub steps: DVector<f64>,
}

impl Mechanism {
    /// The directions in which faces are open, without those that are left out.
    pub(crate) fn ways(&self, faces: &[(usize, Face)], unforced: &[Unforced]) -> Vec<(usize, Direction)> {
        let of = |(s, face): &(usize, Face)| {
            let (s, set) = (*s, self.sources[*s].set);
            let masked_force = move |way: &Direction| !set.is_unforced(way.coordinate, unforced[s]);
            face.directions(&set).into_iter().filter(masked_force).map(move |way| (s, way))
        };
        faces.iter().flat_map(of).collect()
    }

    /// What turns on the round bounds to which a contact presses it while forces change; `quiet` is what nothing pushes.
    fn turned_by(&self, at: &Contact, quiet: &[Unforced], change: &[f64]) -> Along {
        let clearances = self.sources.iter().enumerate().filter(|(_, source)| source.is_clearance);
        let of = |(s, source): (usize, &Source)| {
            let (set, size) = (&source.set, source.set.size());
            let own = |force: &[f64]| set.unit_gradient(&set.masked_force(&force[source.range()], quiet[s])[..size]);
            let force = own(&at.gradient.inputs.parameters);
            let largest = force.iter().fold(0.0_f64, |largest, f| largest.max(f.abs()));
            let mut turn = [0.0; MAX_SIZE];
            if largest > 0.0 && set.flat_sided() < size {
                let unit = set.to_unit(&self.offset(source, &at.state.inputs));
                let to: [f64; MAX_SIZE] = std::array::from_fn(|k| unit[k] + FAR / largest * force[k]);
                turn = own(change).map(|c| FAR / largest * c);
                turn[..set.flat_sided()].fill(0.0);
                set.project_unit_along(&to[..size], &mut turn[..size]);
            }
            let [turned, middle] = [turn, [0.0; MAX_SIZE]].map(|unit| set.of_unit(&unit[..size]));
            source.range().enumerate().map(move |(k, p)| (p, turned[k] - middle[k])).collect::<Along>()
        };
        clearances.filter(|(_, source)| !source.set.is_zero()).flat_map(of).filter(|(_, part)| *part != 0.0).collect()
    }
}

impl Solver<'_> {
    /// How forces change along the directions in which faces are open.
    pub(crate) fn bend(&self, at: &Contact, faces: &[(usize, Face)], unforced: &[Unforced]) -> Option<Bend> {
        let m = self.mechanism;
        let ways = m.ways(faces, unforced);
        let n = ways.len();
        let linearised = self.linearise(&at.state)?;
        // Where springs are in balance nothing is transmitted, and they alone say how large a force is.
        let scale = Some(m.force_scale(&at.gradient)).filter(|scale| *scale > 0.0).unwrap_or_else(|| m.spring_scale());
        let forces = |gradient: &[f64]| -> Vec<f64> {
            let of = |(s, way): &(usize, Direction)| {
                let source = &m.sources[*s];
                let size = source.undecided(scale) * way.reach;
                inner(&gradient[source.range()], &way.along) / size
            };
            ways.iter().map(of).collect()
        };
        let along = |(s, way): &(usize, Direction)| m.sources[*s].range().zip(way.along).collect();
        let open: Vec<Along> = ways.iter().map(along).collect();
        let quiet = m.quiets(at, unforced);
        let changes = |along: &[Along]| {
            let changes = self.gradient_along(&linearised, &at.state, &at.gradient, along);
            let columns: Vec<f64> = changes.iter().flat_map(|change| forces(change)).collect();
            let matrix = DMatrix::from_vec(n, n, columns);
            (changes, matrix)
        };
        let (mut change, held) = changes(&open);
        let (mut matrix, mut agree) = (held.clone(), false);
        for _ in 0..ROUNDS {
            let turned: Vec<Along> = change.iter().map(|change| m.turned_by(at, &quiet, change)).collect();
            agree = turned.iter().all(Vec::is_empty);
            if agree {
                break;
            }
            let along: Vec<Along> = open.iter().cloned().zip(turned).map(|(a, b)| [a, b].concat()).collect();
            let before = matrix;
            (change, matrix) = changes(&along);
            agree = (&matrix - before).amax() <= AGREED;
            if agree {
                break;
            }
        }
        // A force that is hardly there turns too fast to be followed.
        let matrix = if agree { matrix } else { held };
        let force = DVector::from_vec(forces(&at.gradient.inputs.parameters));
        Some(Bend { ways, matrix, force })
    }
}

impl Bend {
    pub fn none() -> Self {
        Self { ways: Vec::new(), matrix: DMatrix::zeros(0, 0), force: DVector::zeros(0) }
    }

    /// A change that is none: on the way to the middle the forces that are left change, too, as their lines turn.
    fn least(&self) -> f64 {
        UNDECIDED + self.force.amax()
    }

    /// The direction along which the load's work has a minimum, as parts of all ways, the largest of which is one; empty where
    /// there is none, `None` where a number is not finite.
    pub fn unstable(&self) -> Option<Vec<f64>> {
        let n = self.ways.len();
        if n == 0 {
            return Some(Vec::new());
        }
        let reach = |i: usize| self.ways[i].1.reach;
        let symmetric = DMatrix::from_fn(n, n, |i, j| {
            let [a, b] = [(i, j), (j, i)].map(|(i, j)| self.matrix[(i, j)] * (reach(i) / reach(j)).sqrt());
            0.5 * (a + b)
        });
        let (largest, vector) = largest_eigenpair(symmetric)?;
        if !(largest > self.least()) {
            return Some(Vec::new());
        }
        let parts: Vec<f64> = vector.iter().enumerate().map(|(i, part)| part / reach(i).sqrt()).collect();
        let most = parts.iter().copied().fold(0.0, |most: f64, part| if part.abs() > most.abs() { part } else { most });
        Some(parts.iter().map(|part| part / most).collect())
    }

    /// `None` where the changes have no singular values.
    pub fn ties(&self) -> Option<Ties> {
        let n = self.ways.len();
        if n == 0 {
            return Some(Ties::none());
        }
        let svd = singular_values(self.matrix.clone(), true, true)?;
        let tied: Vec<usize> = (0..n).filter(|&k| svd.singular_values[k] > self.least()).collect();
        let (u, v) = (svd.u?, svd.v_t?);
        Some(Ties {
            rows: DMatrix::from_fn(tied.len(), n, |e, i| v[(tied[e], i)]),
            steps: DVector::from_fn(tied.len(), |e, _| {
                -u.column(tied[e]).dot(&self.force) / svd.singular_values[tied[e]]
            }),
        })
    }
}

impl Ties {
    pub fn none() -> Self {
        Self { rows: DMatrix::zeros(0, 0), steps: DVector::zeros(0) }
    }
}
