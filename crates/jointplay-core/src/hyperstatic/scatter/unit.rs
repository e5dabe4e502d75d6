//! One unit: whether it goes together, and where.

use nalgebra::{DMatrix, DVector};

use super::dice::Dice;
use super::section::{Member, Section};
use crate::closure::Inputs;
use crate::cone::Kind;
use crate::hyperstatic::compatibility::{Compatibility, FITS};
use crate::hyperstatic::settle::{Failure, is_apart};
use crate::hyperstatic::system::{Ask, Balance, Give, System};
use crate::hyperstatic::together::{Nominal, Rested};
use crate::mechanism::Mechanism;
use crate::sampling::Request;
use crate::solver::{Solver, State};
use crate::status::Status;

/// A clearance is loose when its force does less than this part of the largest one.
const LOOSE: f64 = 1e-7;
/// Corrections that make linearly compatible displacements exactly so: each leaves a part of the misfit that is
/// of the order of the displacements over the dimensions.
pub const CORRECTIONS: usize = 12;

/// What is elastic takes part in a correction by the square of this, beside clearances.
const DEFORMS: f64 = 1e-3;

/// What all units of one configuration share.
pub struct Job<'a> {
    /// What gives way together: clearances that scatter by themselves are left out, unless the load decides.
    pub system: System<'a>,
    pub solver: &'a Solver<'a>,
    pub request: &'a Request,
    pub nominal: &'a State,
    pub at_nominal: Nominal<'a>,
    /// How far the output moves where that is felt.
    feels: Vec<f64>,
    /// The basis, closed for the known deviations.
    pub built: &'a State,
    /// The linearisation there.
    pub compatibility: &'a Compatibility,
    /// What changes a misfit with the least displacements: length-scaled, of everything that gives way.
    pub correction: DMatrix<f64>,
    /// The clearances that compatibility ties, by the numbers of their gives.
    pub tied: Vec<usize>,
    pub section: Section,
    /// Whether nothing is elastic.
    rigid: bool,
}

/// With how little clearance a unit goes together rigidly.
#[derive(Clone, Debug, PartialEq)]
pub struct Loosest {
    /// The smallest factor on all clearances.
    pub factor: f64,
    /// Offsets of the tied clearances at it, where they are known.
    pub offsets: Option<Vec<Vec<f64>>>,
}

/// How a unit goes together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// Rigidly, within the clearances.
    Loose,
    /// By what is elastic, or where the load pushes it.
    Forced,
    /// Not at all.
    Apart,
}

/// What became of a unit.
pub struct Unit {
    pub status: Status,
    /// The smallest factor on the clearances with which it goes together rigidly.
    pub factor: f64,
    /// Offsets and deviations, corrected to keep the closed mechanism compatible.
    pub parameters: Vec<f64>,
    /// Displacements of the rows and values of the parameters before they are corrected, as the basis takes them.
    pub displacements: Vec<f64>,
    /// Error of the output, where there is one.
    pub error: Option<Vec<f64>>,
    /// Forces on the rows.
    pub forces: DVector<f64>,
}

impl<'a> Job<'a> {
    pub fn new(
        whole: &System<'a>,
        solver: &'a Solver<'a>,
        request: &'a Request,
        nominal: &'a State,
        at_nominal: Nominal<'a>,
        built: &'a State,
        compatibility: &'a Compatibility,
    ) -> Self {
        let takes_part = |give: &&Give| request.loaded || give.source.is_none() || System::is_tied(give, compatibility);
        let gives = whole.gives.iter().filter(takes_part).cloned().collect();
        let system = System { gives, ..whole.clone() };
        let is_tied =
            |g: &usize| system.gives[*g].source.is_some() && System::is_tied(&system.gives[*g], compatibility);
        let tied: Vec<usize> = (0..system.gives.len()).filter(is_tied).collect();
        let section = section(&system, compatibility, &tied, request);
        let correction = least_displacements(&system, compatibility, &tied);
        let rigid = system.gives.iter().all(|give| give.source.is_some());
        Self {
            feels: system.mechanism.feels(at_nominal.compatibility),
            system,
            solver,
            request,
            nominal,
            at_nominal,
            built,
            compatibility,
            correction,
            tied,
            section,
            rigid,
        }
    }

    /// Whether load or misfit decide where units are.
    pub const fn settles(&self) -> bool {
        self.request.loaded || !self.rigid
    }

    const fn mechanism(&self) -> &Mechanism {
        self.system.mechanism
    }

    /// A unit with what has been drawn for it, as far as its parts scatter one by one.
    pub fn drawn(&self, drawn: &[f64]) -> Unit {
        let m = self.mechanism();
        let mut parameters = drawn.to_vec();
        for source in self.system.gives.iter().filter_map(|give| give.source) {
            m.sources[source].range().for_each(|p| parameters[p] = m.centre[p]);
        }
        Unit {
            status: Status::Ok,
            factor: f64::NAN,
            displacements: m.displacements(&parameters),
            parameters,
            error: None,
            forces: DVector::zeros(self.compatibility.load.len()),
        }
    }

    /// Solves the unit with the given number, whose parameters have been drawn by their laws one by one.
    pub fn solve(&self, number: u64, drawn: &[f64]) -> Unit {
        let mut unit = self.drawn(drawn);
        let start = match self.close(self.built, unit.displacements.clone()) {
            Ok(start) => start,
            Err(status) => return Unit { status, ..unit },
        };
        let misfit = self.system.basis.misfit(&start);
        let mut dice = Dice::new(self.request.seed, number);
        let found = match self.fit(&misfit, self.factor(&misfit), &mut unit, &mut dice) {
            Fit::Apart => Err(Status::NotAssemblable),
            Fit::Forced => {
                let known = start.inputs.parameters.clone();
                self.settle(start, &known, &mut unit, &mut dice)
            }
            Fit::Loose => self.correct(&start, &mut unit, &self.correction),
        };
        self.put_state(found, &mut unit);
        unit
    }

    /// Notes the error at a unit's last state, or why there is none.
    fn put_state(&self, found: Result<State, Status>, unit: &mut Unit) {
        unit.error = None;
        match found {
            Ok(state) if state.negative == self.built.negative => {
                unit.error = Some(self.system.basis.kept.error(&state, self.nominal));
            }
            Ok(_) => unit.status = Status::Singular,
            Err(status) => unit.status = status,
        }
    }

    /// Notes the offset of a clearance.
    fn put(&self, give: usize, offset: &[f64], unit: &mut Unit) {
        let m = self.mechanism();
        let Some(source) = self.system.gives[give].source else { return };
        m.sources[source].range().zip(offset).for_each(|(p, d)| unit.parameters[p] = m.centre[p] + d);
    }

    fn close(&self, from: &State, parameters: Vec<f64>) -> Result<State, Status> {
        let inputs = Inputs { drives: self.built.inputs.drives.clone(), parameters };
        self.solver.close(from, &inputs).map_or_else(|| self.solver.follow(from, &inputs), Ok)
    }

    /// The smallest factor on the clearances.
    pub fn factor(&self, misfit: &DVector<f64>) -> Loosest {
        let none = |factor| Loosest { factor, offsets: None };
        if self.fits(misfit) {
            return none(0.0);
        }
        let [b] = misfit.as_slice() else { return self.loosest(misfit) };
        // The only self-stress, and what it does on the misfit and in the clearances.
        let support = |&g: &usize| {
            let Give { kind, columns, .. } = &self.system.gives[g];
            let stress: Vec<f64> = columns.iter().map(|&c| b.signum() * self.compatibility.equations[(0, c)]).collect();
            if let Kind::Clearance(set) = kind { set.support(&stress) } else { 0.0 }
        };
        let reach: f64 = self.tied.iter().map(support).sum();
        none(if reach > 0.0 { b.abs() / reach } else { f64::INFINITY })
    }

    /// Whether a misfit is none.
    pub fn fits(&self, misfit: &DVector<f64>) -> bool {
        let basis = self.system.basis;
        misfit.iter().zip(&basis.redundant).all(|(b, &row)| b.abs() <= FITS * basis.unit(row))
    }

    /// The factor by a program, with the offsets at it.
    fn loosest(&self, misfit: &DVector<f64>) -> Loosest {
        let balance = self.system.balance(self.compatibility, misfit, &Ask::Factor);
        balance.map_or(Loosest { factor: f64::INFINITY, offsets: None }, |balance| Loosest {
            factor: balance.factor,
            offsets: Some(self.tied.iter().map(|&g| balance.given[g].clone()).collect()),
        })
    }

    /// How the unit fits; where the clearances take up the misfit, offsets are drawn that do.
    pub fn fit(&self, misfit: &DVector<f64>, loosest: Loosest, unit: &mut Unit, dice: &mut Dice) -> Fit {
        unit.factor = loosest.factor;
        let apart = is_apart(loosest.factor);
        if apart && self.rigid {
            return Fit::Apart;
        }
        if apart || self.request.loaded {
            return Fit::Forced;
        }
        let interior = || loosest.offsets.or_else(|| self.loosest(misfit).offsets);
        let Some(offsets) = self.section.draw(misfit, dice, interior) else { return Fit::Apart };
        for (&g, offset) in self.tied.iter().zip(&offsets) {
            self.put(g, offset, unit);
            self.system.gives[g].columns.iter().zip(offset).for_each(|(&row, d)| unit.displacements[row] += d);
        }
        Fit::Loose
    }

    /// What decides where units are that do not go together by themselves.
    pub const fn ask(&self) -> Ask {
        if self.request.loaded { Ask::Load } else { Ask::Stress }
    }

    /// Where load or misfit strain what is elastic, or push rigid bodies; clearances that carry nothing scatter.
    fn settle(&self, start: State, known: &[f64], unit: &mut Unit, dice: &mut Dice) -> Result<State, Status> {
        let settled = self.system.settle(self.solver, start, known, |_, _| self.ask()).map_err(Failure::status)?;
        self.note(&settled.balance, settled.state.inputs.parameters.clone(), unit);
        if self.request.loaded && unit.status == Status::Ok {
            let (c, balance) = (&settled.compatibility, &settled.balance);
            let right = c.right(&settled.state.inputs.parameters, known);
            let first =
                self.system.balance(self.at_nominal.compatibility, &self.at_nominal.right_beside(known), &Ask::Load);
            let undetermined = !(settled.still && balance.solved)
                || first.is_some_and(|first| self.is_felt_first(known, &first))
                || self.system.is_felt(c, &c.output.parameters, &right, balance, &self.feels);
            if undetermined {
                unit.status = Status::Undetermined;
            }
        }
        let loose = self.loose(&settled.balance);
        if loose.is_empty() {
            return Ok(settled.state);
        }
        self.scatter(&loose, &settled.state, &settled.compatibility, &settled.balance, known, unit, dice)
    }

    /// The same where the unit has settled together with others.
    pub fn take(&self, rested: Rested, unit: &mut Unit, dice: &mut Dice) {
        let known = std::mem::take(&mut unit.displacements);
        let Rested { displacements, error, first, balance, ties, output } = rested;
        self.note(&balance, displacements, unit);
        unit.error = Some(error);
        if self.request.loaded && unit.status == Status::Ok {
            let right = ties.right(&unit.displacements, &known);
            if self.is_felt_first(&known, &first) || self.system.is_felt(&ties, &output, &right, &balance, &self.feels)
            {
                unit.status = Status::Undetermined;
            }
        }
        let loose = self.loose(&balance);
        if loose.is_empty() {
            return;
        }
        let scattered = self.close(self.built, unit.displacements.clone()).and_then(|state| {
            let c = Compatibility::at(self.system.basis, self.solver, &state).ok_or(Status::Singular)?;
            self.scatter(&loose, &state, &c, &balance, &known, unit, dice)
        });
        self.put_state(scattered, unit);
    }

    /// Whether the output feels what the load leaves open at the nominal pose: that is so at any size of the
    /// play, even where the exact pose then falls to one side.
    fn is_felt_first(&self, known: &[f64], first: &Balance) -> bool {
        let c = self.at_nominal.compatibility;
        self.system.is_felt(c, &c.output.parameters, &self.at_nominal.right_beside(known), first, &self.feels)
    }

    /// Notes where a unit has settled.
    fn note(&self, balance: &Balance, displacements: Vec<f64>, unit: &mut Unit) {
        if is_apart(unit.factor) {
            unit.status = Status::Strained;
        }
        unit.forces.clone_from(&balance.forces);
        unit.displacements = displacements;
        balance.given.iter().enumerate().for_each(|(g, given)| self.put(g, given, unit));
    }

    /// Draws the offsets of clearances that are loose where the others are held, and closes the mechanism.
    #[allow(clippy::too_many_arguments)] // what a settled unit is
    fn scatter(
        &self,
        loose: &[usize],
        state: &State,
        c: &Compatibility,
        balance: &Balance,
        known: &[f64],
        unit: &mut Unit,
        dice: &mut Dice,
    ) -> Result<State, Status> {
        let mut rest = c.right(&state.inputs.parameters, known);
        for (g, (give, given)) in self.system.gives.iter().zip(&balance.given).enumerate() {
            if !loose.contains(&g) {
                give.columns.iter().zip(given).for_each(|(&row, d)| rest -= c.equations.column(row) * *d);
            }
        }
        let section = section(&self.system, c, loose, self.request);
        let interior = || Some(loose.iter().map(|&g| balance.given[g].clone()).collect());
        let Some(offsets) = section.draw(&rest, dice, interior) else { return Ok(state.clone()) };
        for (&g, offset) in loose.iter().zip(&offsets) {
            let give = &self.system.gives[g];
            self.put(g, offset, unit);
            for ((&row, d), before) in give.columns.iter().zip(offset).zip(&balance.given[g]) {
                unit.displacements[row] += d - before;
            }
        }
        let correction = least_displacements(&self.system, c, loose);
        self.correct(state, unit, &correction)
    }

    /// The tied clearances that no force holds and that scatter, therefore.
    fn loose(&self, balance: &Balance) -> Vec<usize> {
        if self.request.loaded {
            return Vec::new();
        }
        let reach = |&g: &usize| {
            let give = &self.system.gives[g];
            let force: Vec<f64> = give.columns.iter().map(|&row| balance.forces[row]).collect();
            if let Kind::Clearance(set) = &give.kind { set.reach(&force) } else { 0.0 }
        };
        let most = self.tied.iter().map(reach).fold(0.0, f64::max);
        self.tied.iter().copied().filter(|g| reach(g) <= LOOSE * most).collect()
    }

    /// Closes the mechanism for displacements that are compatible to first order, changing them by what is left.
    fn correct(&self, from: &State, unit: &mut Unit, correction: &DMatrix<f64>) -> Result<State, Status> {
        let basis = self.system.basis;
        let mut parameters = unit.displacements.clone();
        let mut state = self.close(from, parameters.clone())?;
        for _ in 0..CORRECTIONS {
            let left = basis.misfit(&state);
            if basis.scaled_misfit(&left) <= FITS {
                return Ok(state);
            }
            let change = correction * left;
            parameters.iter_mut().zip(change.iter()).for_each(|(p, d)| *p += d);
            self.move_offsets(unit, &change);
            state = self.close(&state, parameters.clone())?;
        }
        Err(Status::NotAssembled)
    }

    /// Notes a change of the rows' displacements in the offsets of the clearances.
    pub fn move_offsets(&self, unit: &mut Unit, change: &DVector<f64>) {
        for give in &self.system.gives {
            let Some(source) = give.source else { continue };
            let places = self.mechanism().sources[source].range().zip(&give.columns);
            places.for_each(|(p, &row)| unit.parameters[p] += change[row]);
        }
    }
}

/// The section of some clearances.
fn section(system: &System<'_>, c: &Compatibility, numbers: &[usize], request: &Request) -> Section {
    let member = |&g: &usize| {
        let give = &system.gives[g];
        let (Kind::Clearance(set), Some(source)) = (&give.kind, give.source) else { return None };
        let law = Mechanism::law(&system.mechanism.sources[source], request);
        Some(Member { set: *set, law, map: System::map(give, c) })
    };
    Section::new(numbers.iter().filter_map(member).collect(), c.equations.nrows())
}

/// Displacements of all rows, of least length-scaled size, that make up for a misfit: offsets of the given
/// clearances, and deformations where these cannot.
pub fn least_displacements(system: &System<'_>, c: &Compatibility, clearances: &[usize]) -> DMatrix<f64> {
    let rows = system.mechanism.n_rows();
    if c.equations.nrows() == 0 {
        return DMatrix::zeros(rows, 0);
    }
    let mut weights = vec![0.0; rows];
    for (g, give) in system.gives.iter().enumerate() {
        for (k, &row) in give.columns.iter().enumerate() {
            let (moves, weight) = match &give.kind {
                Kind::Clearance(set) | Kind::Fixed(set) => (clearances.contains(&g) && set.half_width(k) > 0.0, 1.0),
                Kind::Spring(compliance) => (compliance[k * (give.columns.len() + 1)] > 0.0, DEFORMS),
            };
            if moves {
                weights[row] = weight * system.basis.unit(row);
            }
        }
    }
    let mut scaled = c.equations.columns(0, rows).into_owned();
    for (row, weight) in weights.iter().enumerate() {
        scaled.column_mut(row).scale_mut(*weight);
    }
    let mut inverse = scaled.clone().pseudo_inverse(LOOSE * scaled.norm()).unwrap_or_else(|_| scaled.transpose());
    for row in 0..rows {
        inverse.row_mut(row).scale_mut(weights[row]);
    }
    inverse
}
