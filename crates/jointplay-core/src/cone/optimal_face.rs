//! The ends of the face of optimal displacements.
//!
//! Displacements are optimal where each offset is on the face of its set that the reaction exposes and
//! the equations hold. These faces are sets themselves: the conditions that are tight in the middle of
//! a face are equalities on it, the others remain. So the programs for its ends are exact, while a
//! bound on the value within a tolerance would leave a disc an arc as wide as the tolerance's root.

use crate::clearance::Set;
use crate::clearance::face::Face;
use crate::clearance::offset::{MAX_SIZE, inner};
use crate::cone::answer::{Answer, Extreme, Outcome};
use crate::cone::bodies::{Atom, Form, Own};
use crate::cone::lanes::layout::Question;
use crate::cone::scheduler::Rounds;
use crate::cone::sets::{Region, TIGHT};
use crate::cone::standard::{DEPENDENT, Standard};
use crate::cone::{Block, Kind, Program};

/// The optimal displacements, in coordinates from the middles of the faces that the reactions expose.
pub struct OptimalFace {
    standard: Standard,
    /// The middle of every face, and the deformation of what is elastic.
    centres: Vec<Vec<f64>>,
    /// The same, moved by what keeps the optimal offsets from the points of the faces nearest to them, which hold the
    /// equations.
    shifts: Vec<Vec<f64>>,
    /// The bodies that are open, with the independent equations between them; none where a tapered one is open in part,
    /// whose faces are bodies of no kind.
    bodies: Option<Vec<Body>>,
    right: Vec<f64>,
}

/// An open body.
struct Body {
    /// Which block has it, and what its coordinates displace there.
    owner: usize,
    columns: Vec<Form>,
    set: Set,
    map: Vec<f64>,
}

impl OptimalFace {
    /// The largest value of `sum_j direction_j . displacement_j` over all optimal poses.
    #[must_use]
    pub fn extreme(&self, direction: &[Vec<f64>]) -> Extreme {
        Rounds::alone(async |rounds| self.extreme_in(rounds, direction).await)
    }

    /// The same beside others.
    pub(crate) async fn extreme_in(&self, rounds: &Rounds, direction: &[Vec<f64>]) -> Extreme {
        let value: f64 = direction.iter().zip(&self.centres).map(|(d, centre)| inner(d, centre)).sum();
        let along = self.standard.coefficients(direction.iter().map(Vec::as_slice));
        let reach: f64 = along.iter().map(|c| c.abs()).sum();
        if reach == 0.0 {
            return Extreme { outcome: Outcome::judged(0.0, 0.0), value, gap: 0.0 };
        }
        if let Some(constant) = self.standard.constant(&along, DEPENDENT) {
            return Extreme { outcome: Outcome::judged(0.0, 0.0), value: value + constant, gap: 0.0 };
        }
        let Some(bodies) = &self.bodies else {
            let cost: Vec<f64> = along.iter().map(|c| -c / reach).collect();
            let raw = self.standard.solve(&cost, None);
            let gap = (raw.value - raw.dual_value).abs();
            let outcome = if raw.infeasible { Outcome::Infeasible } else { Outcome::judged(gap, 0.0) };
            return Extreme { outcome, value: value - reach * raw.value, gap };
        };
        let block = |body: &Body| Block {
            kind: Kind::Fixed(body.set),
            map: body.map.clone(),
            force: body.columns.iter().map(|column| inner(column, &direction[body.owner])).collect(),
        };
        let program = Program { right: self.right.clone(), blocks: bodies.iter().map(block).collect() };
        if program.right.is_empty() {
            let alone: f64 =
                program.blocks.iter().zip(bodies).map(|(block, body)| body.set.support(&block.force)).sum();
            return Extreme { outcome: Outcome::judged(0.0, 0.0), value: value + alone, gap: 0.0 };
        }
        let answer = rounds.solve(Question::Pose, &program, Some(&Answer::pushed(&program))).await;
        let gap = (answer.value - answer.dual_value).abs() / reach;
        Extreme { outcome: answer.outcome, value: value - answer.value, gap }
    }

    /// Optimal displacements where `sum_j direction_j . displacement_j` is largest; `None` where it is
    /// constant, to a part of it that is the tolerance, or its program is not solved.
    #[must_use]
    pub(crate) fn farthest(&self, program: &Program, direction: &[Vec<f64>], tolerance: f64) -> Option<Vec<Vec<f64>>> {
        let along = self.standard.coefficients(direction.iter().map(Vec::as_slice));
        let reach: f64 = along.iter().map(|c| c.abs()).sum();
        if reach == 0.0 || self.standard.constant(&along, tolerance).is_some() {
            return None;
        }
        let cost: Vec<f64> = along.iter().map(|c| -c / reach).collect();
        let raw = self.standard.solve(&cost, None);
        let solved = !raw.infeasible && Outcome::judged((raw.value - raw.dual_value).abs(), 0.0) == Outcome::Solved;
        solved.then(|| {
            let mut displacements = self.standard.displacements(program, &raw.x);
            for (displaced, centre) in displacements.iter_mut().zip(&self.centres) {
                displaced.iter_mut().zip(centre).for_each(|(d, c)| *d += c);
            }
            displacements
        })
    }

    /// The value of `sum_j direction_j . displacement_j` at optimal displacements, moved onto the faces by what
    /// rounding keeps them from.
    #[must_use]
    pub fn value(&self, direction: &[Vec<f64>], displacements: &[Vec<f64>]) -> f64 {
        let mut value = 0.0;
        for (k, along) in direction.iter().enumerate() {
            let moved = displacements[k].iter().zip(&self.shifts[k]).zip(&self.centres[k]);
            value += along.iter().zip(moved).map(|(w, ((at, shift), centre))| w * (at - shift + centre)).sum::<f64>();
        }
        value
    }

    /// The optimal displacements nearest to the middles of the faces, each offset measured in what its set
    /// allows; `None` where the programs' rounding leaves none.
    pub(crate) fn middle(&self, program: &Program) -> Option<Vec<Vec<f64>>> {
        let x = self.standard.nearest_to_middle()?;
        let mut middle = self.standard.displacements(program, &x);
        for (middle, shift) in middle.iter_mut().zip(&self.shifts) {
            // Moved along the face from where the pose is, so that what a reaction decides stays to the last digit.
            middle.iter_mut().zip(shift).for_each(|(m, shift)| *m += shift);
        }
        Some(middle)
    }
}

impl Program {
    /// What the load leaves open at an optimal pose.
    ///
    /// A reaction counts as zero, and two that compete for the same offset as equal, where what they can
    /// do within their set is less than `tolerance` times the most that any reaction can do in its own.
    /// What is elastic has one optimal deformation only.
    #[must_use]
    pub fn optimal_face(&self, pose: &Answer, tolerance: f64) -> OptimalFace {
        let faces = self.faces(pose, tolerance);
        let around = self.around(&faces, pose);
        let rows = &around.standard.rows;
        let mut bodies = Some(Vec::new());
        for (owner, (face, block)) in faces.iter().zip(&self.blocks).enumerate() {
            let Some((set, face)) = face.as_ref().filter(|(_, face)| !face.is_point()) else { continue };
            let open = open_bodies(owner, set, &face.centre[..block.size()]);
            bodies = bodies.zip(open).map(|(mut bodies, mut open)| {
                for body in &mut open {
                    let row = |i| body.columns.iter().map(move |column| inner(column, block.row(i)));
                    body.map = rows.iter().flat_map(|i| row(*i)).collect();
                }
                bodies.extend(open);
                bodies
            });
        }
        let right = rows.iter().map(|i| around.right[*i]).collect();
        OptimalFace { bodies, right, ..around }
    }

    /// Its middle only.
    #[must_use]
    pub fn middle(&self, pose: &Answer, tolerance: f64) -> Option<Vec<Vec<f64>>> {
        self.around(&self.faces(pose, tolerance), pose).middle(self)
    }

    /// The optimal face as a program on the faces of the sets, its bodies left out.
    pub(crate) fn around(&self, faces: &[Option<(Set, Face)>], pose: &Answer) -> OptimalFace {
        let mut right = vec![0.0; self.n_equations()];
        let (mut regions, mut centres, mut shifts) = (Vec::new(), Vec::new(), Vec::new());
        for (face, (block, at)) in faces.iter().zip(self.blocks.iter().zip(&pose.displacements)) {
            let Some((set, face)) = face else {
                centres.push(at.clone());
                shifts.push(at.clone());
                continue;
            };
            let nearest = face.nearest(at);
            let from_centre: Vec<f64> = nearest.iter().zip(&face.centre).map(|(a, c)| a - c).collect();
            (0..right.len()).for_each(|i| right[i] += inner(block.row(i), &from_centre));
            regions.push(if face.is_point() { Region::point() } else { Region::of(set).face(&face.centre) });
            centres.push(face.centre[..at.len()].to_vec());
            shifts.push(at.iter().zip(&from_centre).map(|(a, d)| a - d).collect());
        }
        let standard = Standard::within(self, regions.into_iter(), &right);
        OptimalFace { standard, centres, shifts, bodies: None, right }
    }

    /// The faces that the reactions expose.
    fn faces(&self, pose: &Answer, tolerance: f64) -> Vec<Option<(Set, Face)>> {
        let sets = self.blocks.iter().map(|block| match &block.kind {
            Kind::Clearance(set) | Kind::Fixed(set) => Some((*set, block.reaction(&pose.multipliers))),
            Kind::Spring(_) => None,
        });
        let sets: Vec<Option<(Set, Vec<f64>)>> = sets.collect();
        let work = sets.iter().flatten().map(|(set, w)| set.reach(w)).fold(0.0, f64::max);
        let face = |(set, w): (Set, Vec<f64>)| {
            // The force that does as much in the set's gap.
            let gap = match set {
                Set::Journal { radius, axial, .. } => radius.max(axial),
                _ => set.half_width(0),
            };
            let force = if gap > 0.0 { tolerance * work / gap } else { 0.0 };
            (set, set.face(&w, force))
        };
        sets.into_iter().map(|set| set.map(face)).collect()
    }
}

/// The bodies of a block's set that are open around the middle of a face; none where one is open in part.
fn open_bodies(owner: usize, set: &Set, middle: &[f64]) -> Option<Vec<Body>> {
    let own = Own::of(set);
    let at: Vec<f64> = own.coordinates(set, middle).collect();
    let mut open = Vec::new();
    for (first, atom) in own.atoms() {
        let range = first..first + atom.size();
        let slack = atom.slack(&at[range.clone()]);
        if slack <= TIGHT && !matches!(atom, Atom::Tapered { .. }) {
            continue;
        }
        let (columns, free) = match atom {
            Atom::Interval { low, high } => {
                (own.columns()[range.clone()].to_vec(), Set::Interval { low: low - at[first], high: high - at[first] })
            }
            Atom::Round { size } => {
                let set = if size == 2 { Set::Disc { radius: 1.0 } } else { Set::Ball { radius: 1.0 } };
                (own.columns()[range.clone()].to_vec(), set)
            }
            Atom::Tapered { .. } => ((0..set.size()).map(unit_form).collect(), *set),
        };
        if !matches!(atom, Atom::Interval { .. }) && slack < 1.0 - TIGHT {
            return None;
        }
        open.push(Body { owner, columns, set: free, map: Vec::new() });
    }
    Some(open)
}

fn unit_form(k: usize) -> Form {
    let mut form = [0.0; MAX_SIZE];
    form[k] = 1.0;
    form
}
