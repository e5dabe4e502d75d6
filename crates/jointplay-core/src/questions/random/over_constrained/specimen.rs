//! One specimen: whether it can be assembled, and where.

use nalgebra::{DMatrix, DVector};

use crate::clearance::offset::MAX_SIZE;
use crate::closure::newton::{Solver, State};
use crate::cone::answer::Outcome;
use crate::cone::bodies::Form;
use crate::cone::lanes::layout::Question;
use crate::cone::scheduler::Rounds;
use crate::cone::{Block, Kind, Program};
use crate::interrupt;
use crate::mechanism::Mechanism;
use crate::mechanism::case::Case;
use crate::mechanism::status::Status;
use crate::questions::columns::Loaded;
use crate::questions::random::decided::Decided;
use crate::questions::random::over_constrained::dice::Dice;
use crate::questions::random::over_constrained::room::{LOOSE, Room, least_displacements, section};
use crate::questions::random::over_constrained::section::{Interior, Section};
use crate::questions::random::request::Request;
use crate::redundancy::balance::Balance;
use crate::redundancy::compatibility::{Compatibility, FITS};
use crate::redundancy::equilibrium::Ask;
use crate::redundancy::openings::Openings;
use crate::redundancy::sequence::is_apart;
use crate::redundancy::specimen_batch::sequence::SpecimenSolution;
use crate::redundancy::specimen_batch::{Nominal, Together};
use crate::redundancy::system::{Element, System, UNDECIDED_TOGETHER};

/// What all specimens of one configuration share.
pub struct Job<'a> {
    /// What gives way together: clearances that scatter by themselves are left out, unless the load decides.
    pub system: System<'a>,
    pub request: &'a Request,
    pub nominal: &'a Nominal<'a>,
    /// Where the basis is closed for the known deviations.
    pub solver: &'a Solver<'a>,
    built: &'a State,
    /// How far the output moves at least where that is observable.
    pub observable: Vec<f64>,
    /// The linearisation where the basis is closed for the known deviations.
    pub compatibility: &'a Compatibility,
    /// What changes a misfit with the least displacements: length-scaled, of everything that gives way.
    pub correction: DMatrix<f64>,
    /// The clearances that scatter together, by the numbers of their elements.
    pub tied: Vec<usize>,
    pub section: Section,
    /// What opens the flanks among them.
    pub openings: Option<Openings>,
    /// How these take up a misfit, without the misfit.
    rigid_program: Program,
    /// Whether nothing is elastic.
    pub rigid: bool,
    pub decided: Decided<'a>,
}

/// With how little clearance a specimen can be assembled rigidly.
#[derive(Clone, Debug)]
pub struct Loosest {
    /// The smallest factor on all clearances.
    pub factor: f64,
    /// Offsets of the tied clearances at it, where they are known.
    pub interior: Option<Interior>,
    /// The factor as a part of the linearised one.
    pub part: f64,
}

impl Loosest {
    /// By the linearisation.
    pub fn new(factor: f64, offsets: Option<Vec<Vec<f64>>>) -> Self {
        Self { factor, interior: offsets.map(Interior::Linear), part: 1.0 }
    }
}

/// How a specimen can be assembled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// Rigidly, within the clearances.
    Loose,
    /// By what is elastic, or where the load pushes it.
    Forced,
    /// Not at all.
    Apart,
}

/// What became of a specimen.
pub struct Specimen {
    /// Among all.
    pub number: u64,
    pub status: Status,
    /// The smallest factor on the clearances with which it can be assembled rigidly.
    pub factor: f64,
    /// Offsets and deviations, corrected to keep the closed mechanism compatible.
    pub parameters: Vec<f64>,
    /// The same before they are corrected, where they are.
    pub before: Option<Vec<f64>>,
    /// Displacements of the rows and values of the parameters before they are corrected, as the basis takes them.
    pub displacements: Vec<f64>,
    /// Error of the output, where there is one.
    pub error: Option<Vec<f64>>,
    /// Whether it took the plain solver.
    pub plainly: bool,
    /// Forces on the rows.
    pub forces: DVector<f64>,
    /// What displacements do to the output where forces hold them.
    pub held: Option<DMatrix<f64>>,
}

impl Specimen {
    /// Where it is put, to be [put back](Self::put_back).
    pub fn placed(&self) -> (Vec<f64>, Vec<f64>, Option<Vec<f64>>) {
        (self.parameters.clone(), self.displacements.clone(), self.error.clone())
    }

    pub fn put_back(&mut self, (parameters, displacements, error): &(Vec<f64>, Vec<f64>, Option<Vec<f64>>)) {
        self.parameters.clone_from(parameters);
        self.displacements.clone_from(displacements);
        self.error.clone_from(error);
        self.before = None;
    }
}

impl<'a> Job<'a> {
    pub fn new(
        whole: &System<'a>,
        request: &'a Request,
        nominal: &'a Nominal<'a>,
        built: (&'a Solver<'a>, &'a State),
        compatibility: &'a Compatibility,
    ) -> Self {
        let observable = whole.mechanism.least_observable(nominal.compatibility);
        Self::of(whole, request, nominal, built, compatibility, observable)
    }

    /// That of a specimen, whose sizes are drawn with all other parameters, where it differs from that of others.
    pub fn of_specimen(&self, drawn: &[f64]) -> Option<Box<Self>> {
        let whole = self.system.of_specimen(drawn)?;
        let (built, observable) = ((self.solver, self.built), self.observable.clone());
        Some(Box::new(Self::of(&whole, self.request, self.nominal, built, self.compatibility, observable)))
    }

    fn of(
        whole: &System<'a>,
        request: &'a Request,
        nominal: &'a Nominal<'a>,
        (solver, built): (&'a Solver<'a>, &'a State),
        compatibility: &'a Compatibility,
        observable: Vec<f64>,
    ) -> Self {
        let (together, openings) = whole.scattering(compatibility, solver, built);
        let takes_part = |g: &usize| request.loaded || whole.elements[*g].source.is_none() || together.contains(g);
        let numbers: Vec<usize> = (0..whole.elements.len()).filter(takes_part).collect();
        let elements = numbers.iter().map(|&g| whole.elements[g].clone()).collect();
        let system = System { elements, ..whole.clone() };
        let tied: Vec<usize> = (0..numbers.len()).filter(|&g| together.contains(&numbers[g])).collect();
        let equations = openings.as_ref().map_or(&compatibility.equations, |openings| &openings.equations);
        let section = section(&system, equations, openings.as_ref(), &tied, request);
        let correction = least_displacements(&system, equations, &tied);
        let block = |&g: &usize| {
            let element = &system.elements[g];
            let map = System::map(element, &compatibility.equations);
            Block { kind: element.kind.clone(), map, force: vec![0.0; element.columns.len()] }
        };
        let is_asked_for = |g: &&usize| System::is_tied(&system.elements[**g], compatibility);
        let rigid_program =
            Program { right: Vec::new(), blocks: tied.iter().filter(is_asked_for).map(block).collect() };
        let rigid = system.elements.iter().all(|element| element.source.is_some());
        let case = Case { drives: &built.inputs.drives, coordinates: &nominal.state.coordinates };
        let decided = Decided::new(system.mechanism, case);
        Self {
            system,
            request,
            nominal,
            solver,
            built,
            observable,
            compatibility,
            correction,
            tied,
            section,
            openings,
            rigid_program,
            rigid,
            decided,
        }
    }

    pub const fn mechanism(&self) -> &Mechanism {
        self.system.mechanism
    }

    /// A specimen with what has been drawn for it, as far as its parts scatter one by one.
    pub fn drawn(&self, system: &System<'_>, drawn: &[f64], number: u64) -> Specimen {
        let m = self.mechanism();
        let mut parameters = drawn.to_vec();
        for source in system.elements.iter().filter_map(|element| element.source) {
            m.sources[source].range().for_each(|p| parameters[p] = m.centre[p]);
        }
        Specimen {
            number,
            status: Status::Ok,
            factor: f64::NAN,
            displacements: m.displacements(&parameters),
            parameters,
            before: None,
            error: None,
            plainly: false,
            forces: DVector::zeros(self.compatibility.load.len()),
            held: None,
        }
    }

    /// A rigid specimen where the forces of the load alone decide, as [`Mechanism::loaded`] has it; `None` where that does not
    /// tell its place.
    pub fn loaded(&self, mut specimen: Specimen) -> Option<Specimen> {
        interrupt::check();
        let m = self.mechanism();
        let case = Case { drives: &self.built.inputs.drives, coordinates: &self.nominal.state.coordinates };
        let Loaded { offset, error, status, .. } = m.loaded_specimen(&specimen.parameters, &case)?;
        if !matches!(status, Status::Ok | Status::Undetermined) {
            return None;
        }
        specimen.displacements = m.displacements(&offset);
        (specimen.parameters, specimen.error) = (offset, Some(error));
        (specimen.status, specimen.factor, specimen.plainly) = (status, 0.0, true);
        Some(specimen)
    }

    /// What a specimen draws from. It draws once, whatever becomes of it.
    pub fn dice(&self, specimen: &Specimen) -> Dice {
        Dice::new(self.request.seed, specimen.number)
    }

    /// How far an offset goes that nothing holds, as a multiple of its clearance.
    pub fn spread(&self, element: &Element) -> Form {
        let by_law =
            |source: usize| element.kind.spread(Mechanism::law(&self.mechanism().sources[source], self.request));
        let scatters = !self.request.loaded;
        element.source.filter(|_| scatters).map_or([1.0; MAX_SIZE], by_law)
    }

    /// Notes the offset of a clearance.
    pub fn put(&self, element: &Element, offset: &[f64], specimen: &mut Specimen) {
        let m = self.mechanism();
        let Some(source) = element.source else { return };
        m.sources[source].range().zip(offset).for_each(|(p, d)| specimen.parameters[p] = m.centre[p] + d);
    }

    /// With how little clearance a specimen can be assembled rigidly, by the linearisation.
    pub async fn factor(&self, rounds: &Rounds, misfit: &DVector<f64>) -> Loosest {
        if self.fits(misfit) {
            return Loosest::new(0.0, None);
        }
        let impossible = Loosest::new(f64::INFINITY, None);
        if self.rigid_program.blocks.is_empty() {
            return impossible;
        }
        if let [b] = misfit.as_slice() {
            // The only self-stress, and what it does on the misfit and in the clearances.
            let stress = |row: &[f64]| row.iter().map(|a| b.signum() * a).collect::<Vec<f64>>();
            let support = |block: &Block| block.kind.set().map_or(0.0, |set| set.support(&stress(block.row(0))));
            let reach: f64 = self.rigid_program.blocks.iter().map(support).sum();
            return if reach > 0.0 { Loosest::new(b.abs() / reach, None) } else { impossible };
        }
        let program = Program { right: misfit.as_slice().to_vec(), ..self.rigid_program.clone() };
        let answer = rounds.roughly().ask(Question::Assembly, program).await;
        let possible = answer.outcome != Outcome::Infeasible;
        if possible { Loosest::new(answer.factor, Some(self.beside_others(answer.displacements))) } else { impossible }
    }

    /// Offsets that the equations ask for, with the middles of the clearances that only open flanks.
    fn beside_others(&self, asked_for: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let mut asked_for = asked_for.into_iter();
        let of = |&g: &usize| {
            let element = &self.system.elements[g];
            let found = System::is_tied(element, self.compatibility).then(|| asked_for.next()).flatten();
            found.unwrap_or_else(|| vec![0.0; element.columns.len()])
        };
        self.tied.iter().map(of).collect()
    }

    /// Whether a misfit is none.
    pub fn fits(&self, misfit: &DVector<f64>) -> bool {
        let basis = self.system.basis;
        misfit.iter().zip(&basis.redundant).all(|(b, &row)| b.abs() <= FITS * basis.unit(row))
    }

    /// The factor by a program, with the offsets at it.
    pub fn loosest(&self, misfit: &DVector<f64>) -> Loosest {
        let balance = self.system.balance(self.compatibility, misfit, &Ask::Factor);
        balance.map_or(Loosest::new(f64::INFINITY, None), |balance| {
            Loosest::new(balance.factor, Some(self.offsets_of_tied(&balance)))
        })
    }

    /// Takes the factor on the exact closure; where flanks open, its offsets, too.
    pub fn settle_at(&self, loosest: &mut Loosest, exactly: &Balance) {
        match self.openings {
            None => loosest.part = exactly.factor / loosest.factor,
            Some(_) => loosest.interior = Some(Interior::Exact(self.offsets_of_tied(exactly))),
        }
        loosest.factor = exactly.factor;
    }

    /// By what part of their play the flanks of a specimen may open or close.
    pub fn opens(&self, specimen: &Specimen) -> f64 {
        let Some(openings) = &self.openings else { return 0.0 };
        let opened = |most: f64, gap: f64| most.max((gap - 1.0).abs());
        openings.gaps(&specimen.displacements).into_iter().fold(0.0, opened) + self.section.opened.reach()
    }

    /// Whether the flanks of a specimen have play where all of them are in the middle.
    pub fn is_open(&self, specimen: &Specimen) -> bool {
        let gaps = |openings: &Openings| openings.gaps(&specimen.displacements);
        self.openings.as_ref().map_or_else(Vec::new, gaps).into_iter().all(|gap| gap > 0.0)
    }

    /// The offsets of the tied clearances.
    pub fn offsets_of_tied(&self, balance: &Balance) -> Vec<Vec<f64>> {
        self.tied.iter().map(|&g| balance.given[g].clone()).collect()
    }

    /// How the specimen fits.
    pub fn fit(&self, loosest: &Loosest, specimen: &mut Specimen) -> Fit {
        interrupt::check();
        specimen.factor = loosest.factor;
        let apart = is_apart(loosest.factor);
        if apart && self.rigid {
            Fit::Apart
        } else if apart || self.request.loaded {
            Fit::Forced
        } else {
            Fit::Loose
        }
    }

    /// What decides where specimens are that cannot be assembled by themselves.
    pub const fn ask(&self) -> Ask {
        if self.request.loaded { Ask::Load } else { Ask::Stress }
    }

    /// Notes where a specimen has settled. Clearances that carry nothing are drawn where they scatter: then gives the room
    /// that they have.
    pub fn take(&self, together: &Together<'_>, rested: SpecimenSolution, specimen: &mut Specimen) -> Option<Room<'_>> {
        let known = std::mem::take(&mut specimen.displacements);
        let SpecimenSolution { displacements, error, first, balance, ties, output, still, plainly } = rested;
        specimen.plainly |= plainly;
        specimen.error = Some(error);
        let c = self.nominal.compatibility;
        // Where no equation ties displacements, what they do to the output does not depend on forces.
        if c.equations.nrows() > 0 {
            let forces = first.as_ref().unwrap_or(&balance);
            let spread = |element: &Element| self.spread(element);
            let held = self.system.derivatives_by(c, &c.output.parameters, forces, UNDECIDED_TOGETHER, spread);
            specimen.held = Some(held);
        }
        let given = self.system.elements.iter().zip(&balance.given);
        given.for_each(|(element, given)| self.put(element, given, specimen));
        let right = ties.right(&displacements, &known);
        specimen.displacements = displacements;
        specimen.status = if is_apart(specimen.factor) {
            Status::Strained
        } else if self.request.loaded
            && (!still
                || first.is_some_and(|first| self.is_observable_first(&known, &first))
                || self.system.is_observable(&ties, &output, &right, &balance, &self.observable))
        {
            Status::Undetermined
        } else {
            Status::Ok
        };
        let loose = self.loose(&balance);
        if loose.is_empty() {
            specimen.forces = balance.forces;
            return None;
        }
        specimen.forces.clone_from(&balance.forces);
        let mut rest = right;
        for (g, (element, given)) in self.system.elements.iter().zip(&balance.given).enumerate() {
            if !loose.contains(&g) {
                element.columns.iter().zip(given).for_each(|(&row, d)| rest -= ties.equations.column(row) * *d);
            }
        }
        Some(self.room_of_loose(together, &ties, rest, (loose, &balance), specimen))
    }

    /// Whether what the load leaves open moves the output at the nominal pose: that is so at any size of the
    /// play, even where the exact pose then falls to one side.
    fn is_observable_first(&self, known: &[f64], first: &Balance) -> bool {
        let c = self.nominal.compatibility;
        self.system.is_observable(c, &c.output.parameters, &self.nominal.right_beside(known), first, &self.observable)
    }

    /// The tied clearances that no force holds and that scatter, therefore.
    fn loose(&self, balance: &Balance) -> Vec<usize> {
        if self.request.loaded {
            return Vec::new();
        }
        let reach = |&g: &usize| {
            let element = &self.system.elements[g];
            let force = System::on(element, &balance.forces);
            if let Kind::Clearance(set) = &element.kind { set.reach(&force[..set.size()]) } else { 0.0 }
        };
        let most = self.tied.iter().map(reach).fold(0.0, f64::max);
        self.tied.iter().copied().filter(|g| reach(g) <= LOOSE * most).collect()
    }

    /// Notes a change of the rows' displacements in the offsets of the clearances.
    pub fn move_offsets(&self, specimen: &mut Specimen, change: &DVector<f64>) {
        for element in &self.system.elements {
            let Some(source) = element.source else { continue };
            let places = self.mechanism().sources[source].range().zip(&element.columns);
            places.for_each(|(p, &row)| specimen.parameters[p] += change[row]);
        }
    }
}
