//! Where the quantities of a mechanism stand among the inputs of recorded programs.

use crate::closure::equations::{Command, Inputs};
use crate::closure::newton::State;
use crate::math::lanes::block::{Block, LANES};
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
        let mut inputs =
            vec![0.0; m.n_bodies() * m.space.n_pose_numbers() + 3 * m.n_commands() + m.space.n_turn_numbers()];
        Self::put_inputs(m, coordinates, drives, 0, &mut inputs);
        for (block, input) in registers[m.n_parameters()..].iter_mut().zip(inputs) {
            block.0[lane] = input;
        }
    }

    /// The same for all lanes, some at a time: their numbers lie together in the memory of a block, and far from
    /// the next block's.
    #[inline(always)]
    pub fn load_all<'a>(&self, m: &Mechanism, of: impl Fn(usize) -> (&'a [f64], &'a [f64]), registers: &mut [Block]) {
        const AT_ONCE: usize = 8;
        // Pose numbers in space are the coordinates.
        let n = self.n_varying();
        let same = if m.space == Space::Spatial { self.pose } else { 0 };
        let mut rows = vec![0.0; AT_ONCE * n];
        let inputs = &mut registers[m.n_parameters()..][..n];
        for first in (0..LANES).step_by(AT_ONCE) {
            let given: [_; AT_ONCE] = std::array::from_fn(|k| of(first + k));
            let poses = given.map(|(coordinates, _)| &coordinates[..same]);
            for (row, (coordinates, drives)) in rows.chunks_exact_mut(n).zip(given) {
                Self::put_inputs(m, coordinates, drives, same, row);
            }
            for (k, block) in inputs[..same].iter_mut().enumerate() {
                for i in 0..AT_ONCE {
                    block.0[first + i] = poses[i][k];
                }
            }
            for (k, block) in inputs.iter_mut().enumerate().skip(same) {
                for i in 0..AT_ONCE {
                    block.0[first + i] = rows[i * n + k];
                }
            }
        }
    }

    /// Puts the inputs of one configuration, the first ones left out.
    #[inline(always)]
    fn put_inputs(m: &Mechanism, coordinates: &[f64], drives: &[f64], skipped: usize, inputs: &mut [f64]) {
        let mut k = skipped;
        let mut put = |value: f64| {
            inputs[k] = value;
            k += 1;
        };
        if skipped == 0 {
            for coordinates in coordinates.chunks_exact(m.n_body_coordinates()) {
                m.space.put_pose_numbers(coordinates, &mut put);
            }
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
        commands.truncate(m.n_driven);
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
    /// The coordinates of one body in some lanes from its pose numbers, row by row `n` numbers apart. Those of
    /// a lane have moved from nearby ones by steps, in which a quaternion keeps its sign.
    #[inline(always)]
    pub(crate) fn put_coordinates<'s>(
        self,
        numbers: &mut [Block],
        lanes: impl Iterator<Item = usize>,
        near: impl Fn(usize) -> &'s [f64],
        coordinates: &mut [f64],
        n: usize,
    ) {
        if self == Self::Spatial {
            let square = |b: &Block| b.mul(b);
            let sum = numbers[4..].iter().fold(square(&numbers[3]), |sum, b| sum.add(&square(b)));
            let scale = Block::splat(1.0).div(&sum.sqrt());
            for number in &mut numbers[3..] {
                *number = number.mul(&scale);
            }
        }
        let size = self.n_coordinates();
        for lane in lanes {
            let coordinates = &mut coordinates[lane * n..lane * n + size];
            match self {
                Self::Planar => self.coordinates_of_numbers(|k| numbers[k].0[lane], near(lane), coordinates),
                Self::Spatial => coordinates.iter_mut().zip(&*numbers).for_each(|(c, number)| *c = number.0[lane]),
            }
        }
    }
}
