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
//! stay open. What is open is a product of faces cut by equations; [`crate::cone::optimal_face`] knows its ends. The equations
//! hold to second order only, so that its middle is approached in rounds. Moments that keep their direction in
//! space have no work, but the same equations.

use nalgebra::DMatrix;

use crate::clearance::face::Face;
use crate::clearance::undecided::{UNDECIDED, Unforced};
use crate::closure::newton::Solver;
use crate::contact::open_faces::Faces;
use crate::contact::state::Contact;
use crate::contact::ties::{Bend, Ties};
use crate::mechanism::{Mechanism, Source};

/// Rounds in which the middle is approached at most; each leaves the part that the play is of the mechanism.
const ROUNDS: usize = 25;
/// The middle is reached where no offset moves by more than this part of its set.
const STILL: f64 = 1e-10;
/// Two places are one where no offset differs by more than this part of its set.
pub(crate) const SAME: f64 = 1e-6;
/// What is left open is observable where it moves the output, to first order, by more than this part of what all play
/// together could: programs know less than [`crate::closure::sensitivity::UNOBSERVABLE`].
const OBSERVABLE: f64 = 1e-7;

/// Where the load leaves a mechanism, in the middle of what it leaves open.
pub(crate) struct Rest {
    pub contact: Contact,
    pub open: Open,
    /// What is left out.
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

impl Mechanism {
    /// The face that the force on a source exposes, `unforced` apart.
    fn exposed(&self, source: &Source, at: &Contact, unforced: Unforced) -> Face {
        let force = source.set.masked_force(&at.gradient.inputs.parameters[source.range()], unforced);
        source.set.face(&force[..source.set.size()], self.tolerance(source, at))
    }

    fn tolerance(&self, source: &Source, at: &Contact) -> f64 {
        source.undecided(UNDECIDED * self.force_scale(&at.gradient))
    }

    /// The open faces of all clearances.
    pub(crate) fn open_faces(&self, at: &Contact, unforced: &[Unforced]) -> Vec<(usize, Face)> {
        let clearances = self.sources.iter().enumerate().filter(|(_, source)| source.is_clearance);
        let faces = clearances.map(|(s, source)| (s, self.exposed(source, at, unforced[s])));
        faces.filter(|(_, face)| !face.is_point()).collect()
    }

    /// What the force on every source does not push at a contact.
    pub(crate) fn quiets(&self, at: &Contact, unforced: &[Unforced]) -> Vec<Unforced> {
        let quiet = |(source, unforced): (&Source, &Unforced)| {
            let force = source.set.masked_force(&at.gradient.inputs.parameters[source.range()], *unforced);
            source.set.unforced(&force[..source.set.size()], self.tolerance(source, at))
        };
        self.sources.iter().zip(unforced).map(quiet).collect()
    }
}

impl Solver<'_> {
    /// Where a contact comes to rest when the load counts where it does not push at the nominal pose: `before`
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
        if !bend.unstable()?.is_empty() {
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

/// What is left open, as it is reported.
pub(crate) struct Left {
    /// Share of every source in the half-width, source by source, per component of the output.
    pub open: Vec<f64>,
    /// Whether every source has one place.
    pub decided: Vec<bool>,
    /// Whether it moves the output.
    pub observable: bool,
}

impl Left {
    pub(crate) fn nothing(m: &Mechanism) -> Self {
        let n = m.sources.len();
        Self { open: vec![0.0; n * m.size()], decided: vec![true; n], observable: false }
    }
}

impl Mechanism {
    /// What a rest leaves open; observable where the output moves to first order both at the nominal pose, by the map
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
                Open::Faces(faces) => faces.sources().iter().map(|(s, _)| *s).zip(faces.shares(self, map, k)).collect(),
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
            for ((s, _), moves) in faces.sources().iter().zip(&faces.moves) {
                decided[*s] &= !moves;
            }
        }
        Left { open, decided, observable }
    }
}
