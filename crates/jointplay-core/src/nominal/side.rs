//! On which side of its singular poses a mechanism is, and whether a step keeps to it.
//!
//! The determinant of the closure Jacobian J tells sides apart: from one to the other every way leads through a pose
//! where it is zero. With more rows than unknowns there is no such number, but from a pose to another
//!
//! ```text
//! det(J_a^T J_b) / det(J_a^T J_a)          (det J_b / det J_a where J is square)
//! ```
//!
//! changes its sign where J loses rank on the way, whichever of its rows are dependent. A step may cross the singular
//! poses twice; so the same is looked at half-way, and a parabola through the three must stay on the side. Where two
//! branches cross, the one that is left behind the singular pose for the other has the same sign again. From one to the
//! other only a step leads that bends as much as it is near the pose: a step must be short beside the root of that
//! nearness. Near a singular pose, or where a step is long, it has to be divided. A way ends where the smallest singular
//! value falls below the limit.

use nalgebra::DMatrix;

use crate::closure::equations::Inputs;
use crate::closure::newton::{CLEAR, Solver, State};
use crate::math::decomposition::singular_values;
use crate::math::space::Space;
use crate::mechanism::Mechanism;
use crate::mechanism::status::Status;

/// The least part of the smaller determinant at both ends of a step to which it may fall between them.
const LEAST: f64 = 0.3;
/// Over a step in which the determinant changes by a larger factor, three values do not tell its course.
const MOST: f64 = 10.0;
/// The square of a step, times this, is less than the nearness to a singular pose at both ends.
const BENT: f64 = 10.0;
/// A way that is as near to its end as this, in limits, does not go on in shorter and shorter steps.
const AT_END: f64 = 4.0;
/// A step after which this part of the nearness to a singular pose is left has ended at one.
const ENDED: f64 = 0.05;

/// What the Jacobian of one mechanism says at one pose.
#[derive(Clone, Debug)]
enum Look {
    /// As many rows as unknowns: sign and logarithm of the determinant, and an estimate of the smallest singular value.
    Square { negative: bool, log: f64, clear: f64 },
    /// More rows than unknowns: all of the length-scaled matrix, and the logarithm of det(J^T J).
    Tall { matrix: DMatrix<f64>, log: f64 },
    /// Singular to working precision.
    Singular,
}

impl Look {
    /// The determinant at another pose as a part of that at this one; not a number where either is singular.
    fn ratio(&self, there: &Self) -> f64 {
        match (self, there) {
            (Self::Square { negative, log, .. }, Self::Square { negative: other, log: there, .. }) => {
                let size = (there - log).exp();
                if negative == other { size } else { -size }
            }
            (Self::Tall { matrix, log }, Self::Tall { matrix: there, .. }) => {
                let (sign, size) = determinant(matrix.tr_mul(there));
                sign * (size - log).exp()
            }
            _ => f64::NAN,
        }
    }

    /// Nearness to a singular pose.
    fn clear(&self) -> f64 {
        match self {
            Self::Square { clear, .. } => *clear,
            Self::Tall { matrix, .. } => {
                singular_values(matrix.clone(), false, false).map_or(0.0, |svd| svd.singular_values.min())
            }
            Self::Singular => 0.0,
        }
    }
}

/// Sign and logarithm of the size of a determinant.
fn determinant(matrix: DMatrix<f64>) -> (f64, f64) {
    let lu = matrix.lu();
    let swaps: f64 = lu.p().determinant();
    let pivots = lu.u().diagonal();
    (swaps * pivots.iter().map(|pivot| pivot.signum()).product::<f64>(), pivots.iter().map(|p| p.abs().ln()).sum())
}

/// A mechanism whose side is kept; planned once.
struct Watched<'m> {
    mechanism: &'m Mechanism,
    solver: Option<Solver<'m>>,
}

impl Watched<'_> {
    fn look(&self, coordinates: &[f64]) -> Look {
        let m = self.mechanism;
        let Some(solver) = &self.solver else {
            let matrix = m.scaled_jacobian(coordinates, m.length);
            let (_, log) = determinant(matrix.tr_mul(&matrix));
            return if log.is_finite() { Look::Tall { matrix, log } } else { Look::Singular };
        };
        solver.linearise(&at(m, coordinates)).map_or(Look::Singular, |linearised| Look::Square {
            negative: linearised.factors.negative(),
            log: linearised.factors.log_size(),
            clear: m.singular_estimate(&linearised),
        })
    }
}

/// A state that is looked at: what is commanded does not matter for its Jacobian.
fn at(m: &Mechanism, coordinates: &[f64]) -> State {
    let inputs = Inputs::nominal(m, &vec![0.0; m.n_drives()]);
    State { coordinates: coordinates.to_vec(), inputs, negative: false }
}

/// What all mechanisms that are watched say at one pose.
#[derive(Clone, Debug)]
pub(crate) struct Side(Vec<Look>);

/// The mechanisms whose sides are kept on a grid: the one that is brought to its nodes and, where that is
/// another one, the real mechanism with its drives held, which comes last. They have the same bodies.
pub(crate) struct Watch<'m>(Vec<Watched<'m>>);

impl<'m> Watch<'m> {
    /// Planned near the given coordinates.
    pub(crate) fn new(mechanisms: &[&'m Mechanism], coordinates: &[f64]) -> Self {
        let watched = |&mechanism: &&'m Mechanism| {
            let square = mechanism.n_rows() == mechanism.n_unknowns();
            Watched { mechanism, solver: square.then(|| Solver::new(mechanism, coordinates)) }
        };
        Self(mechanisms.iter().map(watched).collect())
    }

    /// The side of a pose.
    pub(crate) fn side(&self, coordinates: &[f64]) -> Side {
        Side(self.0.iter().map(|watched| watched.look(coordinates)).collect())
    }

    /// Whether a step from some coordinates to others keeps to the side, all the way.
    pub(crate) fn keeps(&self, from: (&[f64], &Side), to: (&[f64], &Side)) -> bool {
        // Coordinates are continued along a step: angles over full turns, and quaternions may have any size.
        let middle = |(a, b): (&f64, &f64)| 0.5 * (a + b);
        let size = self.0.first().map_or(0.0, |watched| moved(watched.mechanism, from.0, to.0));
        let between: Vec<f64> = from.0.iter().zip(to.0).map(middle).collect();
        self.0.iter().zip(&from.1.0).zip(&to.1.0).all(|((watched, from), to)| {
            let end = from.ratio(to);
            // Written so that NaN fails, too.
            let near = from.clear().min(to.clear());
            let is_short = near >= watched.mechanism.singular_value && near >= BENT * size * size;
            is_short && end > 1.0 / MOST && end < MOST && {
                let middle = from.ratio(&watched.look(&between));
                middle > 0.0 && least(middle, end) >= LEAST * end.min(1.0)
            }
        })
    }

    /// Whether a way that cannot go on has come so near to a singular pose that it ends there.
    pub(crate) fn is_at_end(&self, side: &Side) -> bool {
        self.0.iter().zip(&side.0).any(|(watched, look)| look.clear() < AT_END * watched.mechanism.singular_value)
    }

    /// The determinant of the real mechanism at another pose as a part of that at one.
    pub(crate) fn ratio(from: &Side, to: &Side) -> f64 {
        from.0.last().zip(to.0.last()).map_or(f64::NAN, |(from, to)| from.ratio(to))
    }

    /// Whether a mechanism is too near a singular pose: the real one, or any where they are not known to be regular.
    pub(crate) fn is_singular(&self, coordinates: &[f64], side: &Side, is_regular: bool) -> bool {
        let known = if is_regular { self.0.len().saturating_sub(1) } else { 0 };
        self.0.iter().zip(&side.0).skip(known).any(|(watched, look)| {
            let m = watched.mechanism;
            // The estimate is not for matrices with more rows than columns, and too dear for them.
            let plainly = matches!(look, Look::Square { clear, .. } if *clear >= CLEAR * m.singular_value);
            !plainly && m.nominal_status(&at(m, coordinates)) == Status::Singular
        })
    }

    /// Whether a way that was given up at some coordinates has ended at a singular pose of the real mechanism.
    pub(crate) fn has_ended(&self, from: &Side, coordinates: &[f64]) -> bool {
        let (Some(watched), Some(from)) = (self.0.last(), from.0.last()) else { return false };
        watched.look(coordinates).clear() <= (ENDED * from.clear()).max(CLEAR * watched.mechanism.singular_value)
    }
}

/// The largest move of a body, in characteristic lengths and radians.
fn moved(m: &Mechanism, from: &[f64], to: &[f64]) -> f64 {
    let (width, lengths) = (m.n_body_coordinates(), m.n_translations());
    let turn = if m.space == Space::Spatial { 2.0 } else { 1.0 };
    let size = |(k, (a, b)): (usize, (&f64, &f64))| {
        let unit = if k % width < lengths { m.length.recip() } else { turn };
        (a - b).abs() * unit
    };
    from.iter().zip(to).enumerate().map(size).fold(0.0, f64::max)
}

/// The least value from 0 to 1 of the parabola through 1 at 0, a value in the middle and one at 1.
fn least(middle: f64, end: f64) -> f64 {
    // 1 + slope t + bend t^2
    let bend = 2.0 * (1.0 + end - 2.0 * middle);
    let slope = end - 1.0 - bend;
    let lowest = -slope / (2.0 * bend);
    let ends = end.min(1.0);
    if bend > 0.0 && lowest > 0.0 && lowest < 1.0 { ends.min(1.0 - slope * slope / (4.0 * bend)) } else { ends }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_value_of_a_parabola_is_found_between_its_ends() {
        for (middle, end) in [(0.5, 1.0), (0.9, 0.1), (0.3025, 0.01), (0.5, 4.0), (1.2, 1.1), (2.0, 1.0), (0.5, 100.0)]
        {
            let bend = 2.0 * (1.0 + end - 2.0 * middle);
            let slope = end - 1.0 - bend;
            let value = |k: i32| {
                let t = f64::from(k) / 1e5;
                1.0 + slope * t + bend * t * t
            };
            let brute = (0..=100_000).map(value).fold(f64::INFINITY, f64::min);
            assert!((least(middle, end) - brute).abs() < 1e-6, "{middle} {end}");
        }
    }

    #[test]
    fn of_rows_that_depend_on_each_other_none_decides_alone() {
        // A turning row, twice: each of them is zero somewhere, both together never.
        let matrix = |t: f64| DMatrix::from_row_slice(3, 2, &[t.cos(), 0.0, t.sin(), 0.0, 0.0, 1.0]);
        let look = |matrix: DMatrix<f64>| {
            let (_, log) = determinant(matrix.tr_mul(&matrix));
            Look::Tall { matrix, log }
        };
        assert!((look(matrix(0.0)).ratio(&look(matrix(0.5))) - 0.5_f64.cos()).abs() < 1e-12);
        // Behind a pose where a column vanishes.
        let mut behind = matrix(0.1);
        behind.column_mut(1).neg_mut();
        assert!(look(matrix(0.0)).ratio(&look(behind)) < 0.0);
    }
}
