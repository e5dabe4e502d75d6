//! What the load leaves open on the exact closure.
//!
//! Constant forces take the mechanism to where their work W is largest. Of the forces `s = dW/du` along the
//! offsets u the faces are open that s exposes, to first order. On the exact closure s changes along them, and
//! what is left open is only that along which it stays as it is:
//!
//! ```text
//! T' (s + (ds/du) T c) = 0,   G = T' (ds/du) T
//! ```
//!
//! with the directions T in which the faces are open. Where G is negative, W has a strict maximum, which decides.
//! Where it is zero the offsets are open, together if the equations tie them. Where it is positive, W is larger on
//! both sides, and either may hold the mechanism: then the load decides nothing beyond first order, and the faces
//! stay open. What is open is a product of faces cut by equations; [`OptimalFace`] knows its ends. The equations
//! hold to second order only, so that its middle is approached in rounds. Moments that keep their direction in
//! space have no work, but the same equations.

use nalgebra::{DMatrix, DVector};

use crate::clearance::face::{Direction, Face};
use crate::clearance::offset::inner;
use crate::clearance::undecided::{UNDECIDED, Unforced};
use crate::closure::equations::Inputs;
use crate::closure::newton::Solver;
use crate::closure::sensitivity::Gradient;
use crate::cone::answer::Answer;
use crate::cone::optimal_face::OptimalFace;
use crate::cone::{Block, Kind, Program};
use crate::contact::state::Contact;
use crate::math::decomposition::{largest_eigenvalue, singular_values};
use crate::mechanism::{Mechanism, Source};

/// Part of its extent by which an offset is moved for a difference. Forces are known to some units of the last
/// place, so that over all of the extent rounding makes less of them than [`UNDECIDED`].
const DIFFERENCE: f64 = 1e-4;
/// Rounds in which the middle is approached at most; each leaves the part that the play is of the mechanism.
const ROUNDS: usize = 25;
/// The middle is reached where no offset moves by more than this part of its set.
const STILL: f64 = 1e-10;
/// Two places are one where no offset differs by more than this part of its set; what is less than this part of a
/// direction is none of it.
const SAME: f64 = 1e-6;
/// A component of which the equations leave less than this part is held by them: they are known by differences.
const TIED: f64 = 1e-6;
/// What is left open is felt where it moves the output, to first order, by more than this part of what all play
/// together could: programs know less than [`crate::closure::sensitivity::UNOBSERVABLE`].
const OBSERVABLE: f64 = 1e-7;

/// Where the load leaves a mechanism, in the middle of what it leaves open.
pub(crate) struct Rest {
    pub contact: Contact,
    pub open: Open,
    /// What is not listened to.
    pub unforced: Vec<Unforced>,
    /// What the load does not push there, that included.
    pub quiet: Vec<Unforced>,
}

/// What the load leaves open.
pub(crate) enum Open {
    /// Every offset has one place.
    Nothing,
    /// Faces cut by equations.
    Faces(Box<Faces>),
}

/// Open faces, with the equations that tie them.
pub(crate) struct Faces {
    /// The sources, with their faces.
    sources: Vec<(usize, Face)>,
    /// Whether each of them has more than one place.
    moves: Vec<bool>,
    program: Program,
    optimal: OptimalFace,
    /// The middle of what is open.
    middle: Vec<Vec<f64>>,
}

/// How the forces along open directions change along them.
struct Bend {
    ways: Vec<(usize, Direction)>,
    /// Changes over half of the extent, as parts of the largest reaction.
    matrix: DMatrix<f64>,
    /// The forces themselves.
    force: DVector<f64>,
}

/// Independent combinations of open directions along which forces change.
struct Ties {
    rows: DMatrix<f64>,
    /// The step along each of them that makes its force zero.
    steps: DVector<f64>,
}

impl Mechanism {
    /// The face that the force on a source exposes, `unforced` apart.
    fn exposed(&self, source: &Source, at: &Contact, unforced: Unforced) -> Face {
        let force = source.set.masked_force(&at.gradient.inputs.parameters[source.range()], unforced);
        source.set.face(&force[..source.set.size()], self.tolerance(source, at))
    }

    fn tolerance(&self, source: &Source, at: &Contact) -> f64 {
        self.undecided(source, UNDECIDED * self.force_scale(&at.gradient))
    }

    fn offset(&self, source: &Source, inputs: &Inputs<f64>) -> Vec<f64> {
        source.range().map(|p| inputs.parameters[p] - self.centre[p]).collect()
    }

    fn put(&self, source: &Source, offset: &[f64], inputs: &mut Inputs<f64>) {
        source.range().zip(offset).for_each(|(p, d)| inputs.parameters[p] = self.centre[p] + d);
    }

    /// The open faces of all clearances.
    fn open_faces(&self, at: &Contact, unforced: &[Unforced]) -> Vec<(usize, Face)> {
        let clearances = self.sources.iter().enumerate().filter(|(_, source)| source.is_clearance);
        let faces = clearances.map(|(s, source)| (s, self.exposed(source, at, unforced[s])));
        faces.filter(|(_, face)| !face.is_point()).collect()
    }

    /// The directions in which faces are open, those left out that are not listened to.
    fn ways(&self, faces: &[(usize, Face)], unforced: &[Unforced]) -> Vec<(usize, Direction)> {
        let of = |(s, face): &(usize, Face)| {
            let (s, set) = (*s, self.sources[*s].set);
            let masked_force = move |way: &Direction| !set.is_unforced(way.coordinate, unforced[s]);
            face.directions(&set).into_iter().filter(masked_force).map(move |way| (s, way))
        };
        faces.iter().flat_map(of).collect()
    }

    /// What the force on every source does not push at a contact.
    fn quiets(&self, at: &Contact, unforced: &[Unforced]) -> Vec<Unforced> {
        let quiet = |(source, unforced): (&Source, &Unforced)| {
            let force = source.set.masked_force(&at.gradient.inputs.parameters[source.range()], *unforced);
            source.set.unforced(&force[..source.set.size()], self.tolerance(source, at))
        };
        self.sources.iter().zip(unforced).map(quiet).collect()
    }
}

impl Solver<'_> {
    /// Where a contact comes to rest when the load is also heard where it does not push at the nominal pose: `before`
    /// tells what did not take part, `unforced` what still does not. `None` where it may rest in more than one place, or
    /// the closure is singular.
    pub(crate) fn rest(&self, from: &Contact, before: &[Unforced], unforced: &[Unforced]) -> Option<Rest> {
        let m = self.mechanism;
        let at = self.settle(from.state.clone(), unforced)?;
        let goes = m.change(&from.state.inputs, &at.state.inputs) > SAME;
        // What has gone to one side might be held on the other as well.
        let other = if goes {
            let mut inputs = from.state.inputs.clone();
            for (s, _) in m.open_faces(from, before) {
                let source = &m.sources[s];
                let [middle, end] = [from, &at].map(|contact| m.offset(source, &contact.state.inputs));
                let other: Vec<f64> = middle.iter().zip(end).map(|(b, a)| 2.0 * b - a).collect();
                m.put(source, &other, &mut inputs);
            }
            let start = self.follow(&from.state, &inputs).ok()?;
            Some(self.in_the_middle(self.settle(start, unforced)?, unforced)?)
        } else {
            None
        };
        let rest = self.in_the_middle(at, unforced)?;
        let [one, other] = [&rest, other.as_ref().unwrap_or(&rest)].map(|rest| &rest.contact.state.inputs);
        (m.change(one, other) <= SAME).then_some(rest)
    }

    /// How forces change along the directions in which faces are open.
    fn bend(&self, at: &Contact, faces: &[(usize, Face)], unforced: &[Unforced]) -> Option<Bend> {
        let m = self.mechanism;
        let ways = m.ways(faces, unforced);
        let n = ways.len();
        let linearised = self.linearise(&at.state)?;
        let scale = m.force_scale(&at.gradient);
        let forces = |gradient: &Gradient| -> Vec<f64> {
            let of = |(s, way): &(usize, Direction)| {
                let source = &m.sources[*s];
                let size = m.undecided(source, scale) * way.reach;
                inner(&gradient.inputs.parameters[source.range()], &way.along) / size
            };
            ways.iter().map(of).collect()
        };
        let mut matrix = DMatrix::zeros(n, n);
        for (j, (s, way)) in ways.iter().enumerate() {
            let moved = |h: f64| {
                let mut inputs = at.state.inputs.clone();
                let source = &m.sources[*s];
                source.range().zip(way.along).for_each(|(p, along)| inputs.parameters[p] += h * along);
                let state = self.nudged(&linearised, &at.state, inputs);
                Some(forces(&m.load_gradient(&self.linearise(&state)?, &state)))
            };
            let (high, low) = (moved(DIFFERENCE)?, moved(-DIFFERENCE)?);
            (0..n).for_each(|i| matrix[(i, j)] = (high[i] - low[i]) / (2.0 * DIFFERENCE));
        }
        let force = DVector::from_vec(forces(&at.gradient));
        Some(Bend { ways, matrix, force })
    }

    /// Goes to the middle of what is open around a contact.
    fn in_the_middle(&self, mut at: Contact, unforced: &[Unforced]) -> Option<Rest> {
        let m = self.mechanism;
        let mut faces = m.open_faces(&at, unforced);
        let quiet = m.quiets(&at, unforced);
        for round in 0..=ROUNDS {
            let Open::Faces(open) = self.open_around(&at, &mut faces, &quiet, unforced)? else {
                return Some(Rest { contact: at, open: Open::Nothing, unforced: unforced.to_vec(), quiet });
            };
            let inputs = open.placed(m, &at, &quiet, &open.middle);
            let change = m.change(&at.state.inputs, &inputs);
            let next = if change > STILL && round < ROUNDS { self.contact(&at, &inputs) } else { None };
            let Some(next) = next else {
                return Some(Rest { contact: at, open: Open::Faces(open), unforced: unforced.to_vec(), quiet });
            };
            at = next;
        }
        None
    }

    /// What is open around a contact; `None` where the load's work has a minimum along it.
    pub(crate) fn open_around(
        &self,
        at: &Contact,
        faces: &mut [(usize, Face)],
        quiet: &[Unforced],
        unforced: &[Unforced],
    ) -> Option<Open> {
        let m = self.mechanism;
        let bend = self.bend(at, faces, unforced)?;
        if bend.is_unstable()? {
            return None;
        }
        let ties = bend.ties()?;
        if ties.rows.nrows() == bend.ways.len() {
            return Some(Open::Nothing);
        }
        // What is pushed in a face that is open in part turns with its force.
        for (s, face) in faces.iter_mut() {
            if !quiet[*s].is_none() {
                *face = m.exposed(&m.sources[*s], at, quiet[*s]);
            }
        }
        let output = m.output_sensitivity(&self.linearise(&at.state)?, &at.state);
        Some(Open::Faces(Box::new(Faces::new(m, at, faces, &bend, &ties, &output.parameters))))
    }

    /// A contact as it is, with all faces open that the load does not decide there: where the closure may hold it on
    /// more than one side.
    pub(crate) fn as_it_is(&self, contact: Contact, unforced: &[Unforced]) -> Option<Rest> {
        let m = self.mechanism;
        let faces = m.open_faces(&contact, unforced);
        let output = m.output_sensitivity(&self.linearise(&contact.state)?, &contact.state);
        let open = Faces::new(m, &contact, &faces, &Bend::none(), &Ties::none(), &output.parameters);
        let quiet = m.quiets(&contact, unforced);
        Some(Rest { contact, open: Open::Faces(Box::new(open)), unforced: unforced.to_vec(), quiet })
    }
}

impl Bend {
    fn none() -> Self {
        Self { ways: Vec::new(), matrix: DMatrix::zeros(0, 0), force: DVector::zeros(0) }
    }

    /// A change that is none: on the way to the middle the forces that are left change, too, as their lines turn.
    fn least(&self) -> f64 {
        UNDECIDED + self.force.amax()
    }

    /// Whether there is a direction along which the load's work has a minimum; `None` where a number is not finite.
    fn is_unstable(&self) -> Option<bool> {
        let n = self.ways.len();
        if n == 0 {
            return Some(false);
        }
        let reach = |i: usize| self.ways[i].1.reach;
        let symmetric = DMatrix::from_fn(n, n, |i, j| {
            let [a, b] = [(i, j), (j, i)].map(|(i, j)| self.matrix[(i, j)] * (reach(i) / reach(j)).sqrt());
            0.5 * (a + b)
        });
        largest_eigenvalue(symmetric).map(|largest| largest > self.least())
    }

    /// `None` where the changes have no singular values.
    fn ties(&self) -> Option<Ties> {
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
    fn none() -> Self {
        Self { rows: DMatrix::zeros(0, 0), steps: DVector::zeros(0) }
    }
}

impl Faces {
    fn new(m: &Mechanism, at: &Contact, faces: &[(usize, Face)], bend: &Bend, ties: &Ties, map: &DMatrix<f64>) -> Self {
        let step = ties.rows.transpose() * &ties.steps;
        let (mut blocks, mut displacements, mut moves) = (Vec::new(), Vec::new(), Vec::new());
        for (s, face) in faces {
            let set = m.sources[*s].set;
            let size = set.size();
            let mut displacement = m.offset(&m.sources[*s], &at.state.inputs);
            let mut rows = vec![0.0; ties.rows.nrows() * size];
            let mut listened = 0;
            let mut moving = false;
            for (i, (_, way)) in bend.ways.iter().enumerate().filter(|(_, (owner, _))| owner == s) {
                displacement.iter_mut().zip(way.along).for_each(|(d, along)| *d += step[i] * along);
                for (row, part) in rows.chunks_exact_mut(size).zip(ties.rows.column(i).iter()) {
                    row.iter_mut().zip(way.dual).for_each(|(r, dual)| *r += part * dual);
                }
                moving |= 1.0 - ties.rows.column(i).norm_squared() > SAME;
                listened += 1;
            }
            moves.push(moving || listened < face.directions(&set).len());
            blocks.push(Block { kind: Kind::Clearance(set), map: rows, force: vec![0.0; size] });
            displacements.push(displacement);
        }
        let program = Program { right: vec![0.0; ties.rows.nrows()], blocks };
        let answer = Answer::at(displacements);
        let of = |(block, (_, face)): (&Block, &(usize, Face))| Some((*block.kind.set()?, *face));
        let exposed: Vec<_> = program.blocks.iter().zip(faces).map(of).collect();
        let optimal = program.around(&exposed, &answer);
        let middle = optimal.middle(&program).unwrap_or_else(|| answer.displacements.clone());
        let mut open = Self { sources: faces.to_vec(), moves, program, optimal, middle };
        open.put_between_ends(m, map);
        open
    }

    /// What the offsets of every source do to a component of the output.
    fn rows(&self, m: &Mechanism, map: &DMatrix<f64>, k: usize, sign: f64) -> Vec<Vec<f64>> {
        let row = |(s, _): &(usize, Face)| m.sources[*s].range().map(|p| sign * map[(k, p)]).collect();
        self.sources.iter().map(row).collect()
    }

    /// Moves the middle to the mean of the ends of all components.
    fn put_between_ends(&mut self, m: &Mechanism, map: &DMatrix<f64>) {
        if !self.is_tied() {
            return;
        }
        let ends: Vec<Vec<Vec<f64>>> = (0..m.size())
            .filter_map(|k| Some([self.farthest(m, map, k, 1.0)?, self.farthest(m, map, k, -1.0)?]))
            .flatten()
            .collect();
        if !ends.is_empty() {
            let part = 1.0 / ends.len() as f64;
            for (s, middle) in self.middle.iter_mut().enumerate() {
                for (k, x) in middle.iter_mut().enumerate() {
                    *x = ends.iter().map(|end| part * end[s][k]).sum();
                }
            }
        }
    }

    /// The sources that are open, with their faces.
    pub(crate) fn sources(&self) -> &[(usize, Face)] {
        &self.sources
    }

    /// Whether equations tie them.
    pub(crate) const fn is_tied(&self) -> bool {
        !self.program.right.is_empty()
    }

    /// The offsets at which a component of the output, by its map by parameters, is largest in one direction; `None`
    /// where they do not move it.
    pub(crate) fn farthest(&self, m: &Mechanism, map: &DMatrix<f64>, k: usize, sign: f64) -> Option<Vec<Vec<f64>>> {
        let rows = self.rows(m, map, k, sign);
        if self.is_tied() {
            return self.optimal.farthest(&self.program, &rows, TIED);
        }
        let widths: Vec<f64> = self.sources.iter().zip(&rows).map(|((_, face), row)| face.half_width(row)).collect();
        let least = TIED * widths.iter().sum::<f64>();
        // What does not move the output stays: rounding must not send it to where another part of the mechanism is
        // singular.
        let end = |s: usize| {
            let moves = widths[s] > least;
            if moves { self.sources[s].1.farthest(&rows[s])[..rows[s].len()].to_vec() } else { self.middle[s].clone() }
        };
        Some((0..rows.len()).map(end).collect())
    }

    /// What a component of the output gains, by its map, on the way from inputs to offsets of the open sources.
    pub(crate) fn gain(
        &self,
        m: &Mechanism,
        map: &DMatrix<f64>,
        k: usize,
        sign: f64,
        offsets: &[Vec<f64>],
        from: &Inputs<f64>,
    ) -> f64 {
        let rows = self.rows(m, map, k, sign);
        let of = |((row, to), from): ((&Vec<f64>, &Vec<f64>), &Vec<f64>)| inner(row, to) - inner(row, from);
        rows.iter().zip(offsets).zip(&self.offsets(m, from)).map(of).sum()
    }

    /// The inputs at given offsets of the open sources, the others where the load at a contact presses them.
    pub(crate) fn placed(&self, m: &Mechanism, at: &Contact, quiet: &[Unforced], offsets: &[Vec<f64>]) -> Inputs<f64> {
        let mut inputs = m.support_update_loaded(&at.gradient, &at.state.inputs, quiet);
        for ((s, _), offset) in self.sources.iter().zip(offsets) {
            m.put(&m.sources[*s], offset, &mut inputs);
        }
        inputs
    }

    /// The offsets of the open sources among inputs.
    pub(crate) fn offsets(&self, m: &Mechanism, inputs: &Inputs<f64>) -> Vec<Vec<f64>> {
        self.sources.iter().map(|(s, _)| m.offset(&m.sources[*s], inputs)).collect()
    }

    /// How far a component of the output goes from the middle, by sources; `map` is the output by parameters.
    fn shares(&self, m: &Mechanism, map: &DMatrix<f64>, k: usize) -> Vec<f64> {
        let rows = self.rows(m, map, k, 1.0);
        if !self.is_tied() {
            return self.sources.iter().zip(&rows).map(|((_, face), row)| face.half_width(row)).collect();
        }
        let to = |sign: f64| -> Vec<f64> {
            let Some(end) = self.farthest(m, map, k, sign) else { return vec![0.0; rows.len()] };
            let moved = |s: usize| end[s].iter().zip(&self.middle[s]).map(|(e, m)| e - m);
            let part = |s: usize| rows[s].iter().zip(moved(s)).map(|(a, moved)| sign * a * moved).sum();
            (0..rows.len()).map(part).collect()
        };
        let (high, low) = (to(1.0), to(-1.0));
        if high.iter().sum::<f64>() >= low.iter().sum::<f64>() { high } else { low }
    }
}

/// What is left open, told.
pub(crate) struct Left {
    /// Share of every source in the half-width, source by source, per component of the output.
    pub open: Vec<f64>,
    /// Whether every source has one place.
    pub decided: Vec<bool>,
    /// Whether the output feels it.
    pub observable: bool,
}

impl Mechanism {
    /// What a rest leaves open; felt where the output moves to first order both at the nominal pose, by the map
    /// `first_order`, and at the rest, by `map`.
    pub(crate) fn left_open(
        &self,
        rest: &Rest,
        unforced: &[Unforced],
        first_order: &DMatrix<f64>,
        map: &DMatrix<f64>,
    ) -> Left {
        let size = self.size();
        let mut open = vec![0.0; self.sources.len() * size];
        let mut decided: Vec<bool> = unforced.iter().map(|unforced| unforced.is_none()).collect();
        let mut observable = false;
        let shares = |map: &DMatrix<f64>, k: usize| -> Vec<(usize, f64)> {
            match &rest.open {
                Open::Nothing => Vec::new(),
                Open::Faces(faces) => faces.sources.iter().map(|(s, _)| *s).zip(faces.shares(self, map, k)).collect(),
            }
        };
        let total = |shares: &[(usize, f64)]| shares.iter().map(|(_, share)| share).sum::<f64>();
        for k in 0..size {
            let (here, there) = (shares(map, k), shares(first_order, k));
            let clearances = self.sources.iter().filter(|source| source.is_clearance);
            let reach =
                |source: &Source| source.set.reach(&source.range().map(|p| first_order[(k, p)]).collect::<Vec<f64>>());
            let least = OBSERVABLE * clearances.map(reach).sum::<f64>();
            if total(&here).min(total(&there)) > least {
                observable = true;
                for (s, share) in here {
                    open[s * size + k] = share;
                }
            }
        }
        if let Open::Faces(faces) = &rest.open {
            for ((s, _), moves) in faces.sources.iter().zip(&faces.moves) {
                decided[*s] &= !moves;
            }
        }
        Left { open, decided, observable }
    }
}
