//! Faces that the load leaves open, cut by the equations that tie them.

use nalgebra::DMatrix;

use crate::clearance::face::Face;
use crate::clearance::offset::inner;
use crate::clearance::undecided::Unforced;
use crate::closure::equations::Inputs;
use crate::cone::answer::Answer;
use crate::cone::optimal_face::OptimalFace;
use crate::cone::{Block, Kind, Program};
use crate::contact::state::Contact;
use crate::contact::ties::{Bend, Ties};
use crate::mechanism::{Mechanism, Source};

/// What is less than this part of a direction is none of it.
const SAME: f64 = 1e-6;
/// A component of which the equations leave less than this part is held by them: they hold to second order only.
const TIED: f64 = 1e-6;

/// Open faces, with the equations that tie them.
pub(crate) struct Faces {
    /// The sources, with their faces.
    sources: Vec<(usize, Face)>,
    /// Whether each of them has more than one place.
    pub(crate) moves: Vec<bool>,
    program: Program,
    optimal: OptimalFace,
    /// The middle of what is open.
    pub(crate) middle: Vec<Vec<f64>>,
}

impl Mechanism {
    pub(crate) fn offset(&self, source: &Source, inputs: &Inputs<f64>) -> Vec<f64> {
        source.range().map(|p| inputs.parameters[p] - self.centre[p]).collect()
    }

    pub(crate) fn put(&self, source: &Source, offset: &[f64], inputs: &mut Inputs<f64>) {
        source.range().zip(offset).for_each(|(p, d)| inputs.parameters[p] = self.centre[p] + d);
    }
}

impl Faces {
    pub(crate) fn new(
        m: &Mechanism,
        at: &Contact,
        faces: &[(usize, Face)],
        bend: &Bend,
        ties: &Ties,
        map: &DMatrix<f64>,
    ) -> Self {
        let step = ties.rows.transpose() * &ties.steps;
        let (mut blocks, mut displacements, mut moves) = (Vec::new(), Vec::new(), Vec::new());
        for (s, face) in faces {
            let set = m.sources[*s].set;
            let size = set.size();
            let mut displacement = m.offset(&m.sources[*s], &at.state.inputs);
            let mut rows = vec![0.0; ties.rows.nrows() * size];
            let mut counted = 0;
            let mut moving = false;
            for (i, (_, way)) in bend.ways.iter().enumerate().filter(|(_, (owner, _))| owner == s) {
                displacement.iter_mut().zip(way.along).for_each(|(d, along)| *d += step[i] * along);
                for (row, part) in rows.chunks_exact_mut(size).zip(ties.rows.column(i).iter()) {
                    row.iter_mut().zip(way.dual).for_each(|(r, dual)| *r += part * dual);
                }
                moving |= 1.0 - ties.rows.column(i).norm_squared() > SAME;
                counted += 1;
            }
            moves.push(moving || counted < face.directions(&set).len());
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
    pub(crate) fn shares(&self, m: &Mechanism, map: &DMatrix<f64>, k: usize) -> Vec<f64> {
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
