//! Where the quantities of a mechanism stand among the inputs of recorded programs.

use crate::closure::equations::{Command, Inputs};
use crate::closure::newton::State;
use crate::math::lanes::block::{Block, LANES};
use crate::math::lanes::trig::sin_cos;
use crate::math::space::{Component, Space};
use crate::mechanism::Mechanism;
use crate::program::symbol::{Recorder, Symbol};

/// A mechanism whose quantities are symbols.
pub(crate) struct Symbolic<'r> {
    pub numbers: Vec<Symbol<'r>>,
    pub inputs: Inputs<Command<Symbol<'r>>, Symbol<'r>>,
}

/// Where the quantities of a configuration stand, common to its samples or varying after the
/// parameters: pose numbers, then value, sine and cosine of every command, then the numbers that tell what
/// the output's body has turned.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pose: usize,
    drives: usize,
    turns: usize,
}

impl Layout {
    pub fn new(m: &Mechanism) -> Self {
        Self { pose: m.n_bodies() * m.space.n_pose_numbers(), drives: m.n_commands(), turns: m.space.n_turn_numbers() }
    }

    /// Varying quantities after the parameters.
    pub const fn n_varying(&self) -> usize {
        self.pose + 3 * self.drives + self.turns
    }

    /// Varying quantities that a step changes.
    pub const fn n_state(&self) -> usize {
        self.pose + self.turns
    }

    /// Varying quantities of the pose.
    pub const fn n_pose(&self) -> usize {
        self.pose
    }

    /// Where those that a step changes stand.
    pub fn state(&self, m: &Mechanism) -> impl Iterator<Item = usize> {
        let after = |k: usize| if k < self.pose { k } else { k + 3 * self.drives };
        (0..self.n_state()).map(move |k| m.n_parameters() + after(k))
    }

    /// How far the output's body has turned, as varying quantities.
    pub fn turn<'r>(&self, m: &Mechanism, recorder: &'r Recorder) -> Vec<Symbol<'r>> {
        let first = m.n_parameters() + self.pose + 3 * self.drives;
        (first..first + self.turns).map(|k| recorder.varying(k)).collect()
    }

    /// A mechanism with everything varying.
    pub fn varying<'r>(&self, m: &Mechanism, recorder: &'r Recorder) -> Symbolic<'r> {
        let at = |k: usize| recorder.varying(m.n_parameters() + k);
        let command = |d: usize| {
            let first = self.pose + 3 * d;
            Command { value: at(first), sine: at(first + 1), cosine: at(first + 2) }
        };
        Symbolic {
            numbers: (0..self.pose).map(at).collect(),
            inputs: Inputs {
                drives: (0..self.drives).map(command).collect(),
                parameters: (0..m.n_parameters()).map(|p| recorder.varying(p)).collect(),
            },
        }
    }

    /// Puts a pose and drive values into the varying inputs of one lane.
    #[inline(always)]
    pub fn load(m: &Mechanism, coordinates: &[f64], drives: &[f64], registers: &mut [Block], lane: usize) {
        let mut inputs = registers[m.n_parameters()..].iter_mut();
        let mut put = |value: f64| {
            if let Some(block) = inputs.next() {
                block.0[lane] = value;
            }
        };
        for coordinates in coordinates.chunks_exact(m.n_body_coordinates()) {
            m.space.put_pose_numbers(coordinates, &mut put);
        }
        for (row, by) in m.driven() {
            let q = by.coefficient * drives[by.drive];
            // Sine and cosine of a length are not asked for.
            let (sine, cosine) = match row.component {
                Component::Along(_) => (0.0, 1.0),
                Component::About(_) => q.sin_cos(),
            };
            put(q);
            put(sine);
            put(cosine);
        }
        for Command { value, sine, cosine } in m.references(coordinates) {
            put(value);
            put(sine);
            put(cosine);
        }
        m.put_turn_numbers(coordinates, put);
    }

    /// The same for all lanes.
    #[inline(always)]
    pub fn load_all<'a>(&self, m: &Mechanism, of: impl Fn(usize) -> (&'a [f64], &'a [f64]), registers: &mut [Block]) {
        let given: [(&[f64], &[f64]); LANES] = std::array::from_fn(of);
        let (poses, rest) = registers[m.n_parameters()..][..self.n_varying()].split_at_mut(self.pose);
        m.space.load_poses(|lane| given[lane].0, poses);
        let (commands, turns) = rest.split_at_mut(3 * self.drives);
        let (driven, references) = commands.split_at_mut(3 * m.commanded.len());
        for ((row, by), command) in m.driven().zip(driven.chunks_exact_mut(3)) {
            let values = std::array::from_fn(|i| by.coefficient * given[i].1[by.drive]);
            let [sines, cosines] = match row.component {
                Component::Along(_) => [[0.0; LANES], [1.0; LANES]],
                Component::About(_) => sin_cos(&values),
            };
            for (block, numbers) in command.iter_mut().zip([values, sines, cosines]) {
                block.0 = numbers;
            }
        }
        for (lane, (coordinates, _)) in given.iter().enumerate() {
            if !references.is_empty() {
                let found = m.references(coordinates);
                let numbers = found.iter().flat_map(|command| [command.value, command.sine, command.cosine]);
                references.iter_mut().zip(numbers).for_each(|(block, number)| block.0[lane] = number);
            }
            let mut turns = turns.iter_mut();
            m.put_turn_numbers(coordinates, |number| {
                if let Some(block) = turns.next() {
                    block.0[lane] = number;
                }
            });
        }
    }

    fn command<'r>(&self, recorder: &'r Recorder, drive: usize) -> Command<Symbol<'r>> {
        let at = |k: usize| recorder.common(self.pose + 3 * drive + k);
        Command { value: at(0), sine: at(1), cosine: at(2) }
    }

    pub fn inputs<'r>(&self, m: &Mechanism, recorder: &'r Recorder) -> Inputs<Command<Symbol<'r>>, Symbol<'r>> {
        Inputs {
            drives: (0..self.drives).map(|d| self.command(recorder, d)).collect(),
            parameters: (0..m.n_parameters()).map(|p| recorder.varying(p)).collect(),
        }
    }

    pub fn reference<'r>(&self, recorder: &'r Recorder, component: usize) -> Symbol<'r> {
        recorder.common(self.pose + 3 * self.drives + component)
    }

    /// How far the output's body has turned, at the nominal pose.
    pub fn nominal_turn<'r>(&self, m: &Mechanism, recorder: &'r Recorder) -> Vec<Symbol<'r>> {
        (0..self.turns).map(|k| self.reference(recorder, m.size() + k)).collect()
    }

    /// The common quantities of a nominal state and drive values near its own.
    pub fn values(m: &Mechanism, nominal: &State, drives: &[f64]) -> Vec<f64> {
        let mut values = Vec::new();
        for coordinates in nominal.coordinates.chunks_exact(m.n_body_coordinates()) {
            m.space.put_pose_numbers(coordinates, |number| values.push(number));
        }
        let mut commands = Inputs::nominal(m, drives).commands(m).drives;
        commands.truncate(m.commanded.len());
        commands.extend(m.references(&nominal.coordinates));
        for command in commands {
            values.extend([command.value, command.sine, command.cosine]);
        }
        values.extend(m.output(&nominal.coordinates, &nominal.inputs));
        m.put_turn_numbers(&nominal.coordinates, |number| values.push(number));
        values
    }
}

impl Space {
    /// Puts the pose numbers of all bodies in all lanes, some lanes at a time: their numbers lie together in the memory
    /// of a block, and far from the next block's.
    #[inline(always)]
    fn load_poses<'a>(self, coordinates: impl Fn(usize) -> &'a [f64], numbers: &mut [Block]) {
        const AT_ONCE: usize = 8;
        let (width, n_coordinates) = (self.n_pose_numbers(), self.n_coordinates());
        for first in (0..LANES).step_by(AT_ONCE) {
            let rows: [&[f64]; AT_ONCE] = std::array::from_fn(|k| coordinates(first + k));
            for (body, numbers) in numbers.chunks_exact_mut(width).enumerate() {
                for (k, block) in numbers[..n_coordinates].iter_mut().enumerate() {
                    for i in 0..AT_ONCE {
                        block.0[first + i] = rows[i][body * n_coordinates + k];
                    }
                }
            }
        }
        if self == Self::Planar {
            for numbers in numbers.chunks_exact_mut(width) {
                let [sines, cosines] = sin_cos(&numbers[2].0);
                (numbers[2].0, numbers[3].0) = (cosines, sines);
            }
        }
    }
}
