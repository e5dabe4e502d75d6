//! A graph of operations while it is recorded: anew, or along one that was recorded before.
//!
//! The equations ask for one node after the other. As long as they ask as they did before, for other constants at
//! most, the nodes are those of before, and so are the programs that are made of them: nothing is looked up, put
//! in order or compiled. What they ask tells by itself whether that holds: a constant that folds away, one that has
//! become equal to another, another order of elimination ask for other nodes. Then the recording goes on along
//! another one with the same beginning, or by itself; what is made never depends on what was recorded before.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::program::code::{Code, Frame};
use crate::program::graph::Node;
use crate::program::kept::{Made, Reached, Trace, count, find, keep};

/// Constants closer than so many units of the last place differ by rounding.
const ROUNDING: u64 = 16;
/// Such units in a bucket of constants; more than [`ROUNDING`].
const BUCKET: u64 = 256;

/// A graph while it is recorded.
pub(crate) struct Recording {
    /// What recordings of the same equations have in common; `None` for one that is not kept.
    key: Option<u64>,
    /// The recording that it goes along, and how far.
    guide: Option<Arc<Trace>>,
    reached: Reached,
    /// The recording itself, where it goes along no other.
    own: Trace,
    known: FxHashMap<Node, u32>,
    constants: Vec<f64>,
    /// Their numbers by the beginning of their bits.
    numbers: FxHashMap<u64, Vec<u32>>,
}

impl Recording {
    pub fn new(key: Option<u64>) -> Self {
        Self {
            key,
            guide: key.and_then(|key| find(key, |_| true)),
            reached: Reached::default(),
            own: Trace::default(),
            known: FxHashMap::default(),
            constants: Vec::new(),
            numbers: FxHashMap::default(),
        }
    }

    /// The number of a node.
    pub fn node(&mut self, node: Node) -> u32 {
        while let Some(guide) = &self.guide {
            if let Some(id) = guide.asked(&self.reached).filter(|&id| guide.nodes[id as usize] == node) {
                self.reached.asked += 1;
                self.reached.nodes = self.reached.nodes.max(id as usize + 1);
                return id;
            }
            self.part(|other, reached| other.asked(reached).is_some_and(|id| other.nodes[id as usize] == node));
        }
        let own = &mut self.own;
        let id = *self.known.entry(node).or_insert_with(|| {
            own.nodes.push(node);
            own.nodes.len() as u32 - 1
        });
        own.asked.push(id);
        id
    }

    /// The number of the node of a constant.
    pub fn constant(&mut self, value: f64) -> u32 {
        if let Some(guide) = &self.guide
            && let Some(id) = guide.asked(&self.reached)
            && let Node::Constant(number) = guide.nodes[id as usize]
            && self.constants.get(number as usize).is_some_and(|known| known.to_bits() == value.to_bits())
        {
            self.reached.asked += 1;
            return id;
        }
        let number = self.number(value);
        self.node(Node::Constant(number))
    }

    /// The number of a constant: that of an earlier one from which it differs by rounding. Which constants are equal in
    /// theory is a matter of the structure, which of them are equal to the last bit is luck.
    fn number(&mut self, value: f64) -> u32 {
        let (bits, constants) = (value.to_bits(), &mut self.constants);
        let is = |number: &u32| constants[*number as usize].to_bits().abs_diff(bits) <= ROUNDING;
        let bucket = bits / BUCKET;
        let near = (bucket.saturating_sub(1)..=bucket.saturating_add(1)).filter_map(|k| self.numbers.get(&k));
        if let Some(number) = near.flatten().copied().filter(is).min() {
            return number;
        }
        constants.push(value);
        let number = constants.len() as u32 - 1;
        self.numbers.entry(bucket).or_default().push(number);
        number
    }

    /// The node of a number.
    pub fn at(&self, id: u32) -> Node {
        self.guide.as_ref().map_or(&self.own.nodes, |guide| &guide.nodes)[id as usize]
    }

    /// The operations that compute some nodes, and the constants.
    pub fn code(&mut self, roots: Vec<u32>, frame: Frame) -> (Arc<Code>, Vec<f64>) {
        while let Some(guide) = &self.guide {
            if let Some(made) = guide.made(&self.reached).filter(|made| made.is(&roots, &frame)) {
                self.reached.made += 1;
                return (made.code.clone(), self.constants.clone());
            }
            self.part(|other, reached| other.made(reached).is_some_and(|made| made.is(&roots, &frame)));
        }
        count();
        let code = Arc::new(Code::new(&self.own.nodes, &roots, frame));
        self.own.made.push(Made { asked: self.own.asked.len(), roots, code: code.clone() });
        (code, self.constants.clone())
    }

    /// Leaves the recording that it goes along for another one that goes on suitably, or goes on by itself.
    fn part(&mut self, suits: impl Fn(&Trace, &Reached) -> bool) {
        let (Some(guide), Some(key)) = (self.guide.take(), self.key) else { return };
        let reached = &self.reached;
        self.guide = find(key, |other| suits(other, reached) && other.begins_as(&guide, reached));
        if self.guide.is_none() {
            self.own = guide.until(reached);
            self.known = (0..).zip(&self.own.nodes).map(|(id, &node)| (node, id)).collect();
        }
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        if let (Some(key), None) = (self.key, &self.guide) {
            keep(key, std::mem::take(&mut self.own));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use crate::math::lanes::block::LANES;
    use crate::math::real::Real;
    use crate::program::symbol::{Recorder, Symbol};
    use crate::program::tape::Program;

    const INPUTS: usize = 6;

    /// Two programs of the same operations for all constants, as far as these do not fold away.
    fn record(recorder: &Recorder, structure: u64, constants: &[f64]) -> [Program; 2] {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(structure);
        let mut symbols: Vec<Symbol<'_>> = (0..INPUTS).map(|k| recorder.varying(k)).collect();
        symbols.push(recorder.common(0));
        symbols.extend(constants.iter().map(|&c| Symbol::from_f64(c)));
        let mut programs = Vec::new();
        for _ in 0..2 {
            for _ in 0..rng.random_range(1..60) {
                let [a, b] = [0; 2].map(|_| symbols[rng.random_range(0..symbols.len())]);
                symbols.push(match rng.random_range(0..6) {
                    0 => a + b,
                    1 => a - b,
                    2 => a * b,
                    3 => a.max(b * b),
                    4 => -a,
                    _ => a * b + a,
                });
            }
            // What no input has anything to do with may be any constant.
            let last = symbols[symbols.len() - 3..].iter().map(|&s| s * recorder.varying(0) + recorder.varying(1));
            programs.push(Program::new(recorder, INPUTS, &last.collect::<Vec<_>>(), 0..0));
        }
        programs.try_into().expect("two programs")
    }

    fn bits(program: &Program) -> Vec<u64> {
        let mut registers = program.registers(&[0.7]);
        for (k, lane) in registers[..INPUTS].iter_mut().flat_map(|block| &mut block.0).enumerate() {
            *lane = (k as f64 * 0.618_034).fract() - 0.4;
        }
        program.interpret(&mut registers);
        (0..program.n_outputs()).flat_map(|k| program.output(&registers, k).0.map(f64::to_bits)).collect()
    }

    /// A sweep went over a length that is zero in between, or equal to another one.
    #[test]
    fn what_is_recorded_along_another_recording_is_what_is_recorded_anew() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
        let (mut shared, mut made) = (0, 0);
        for structure in 0..60 {
            let mut before: Vec<Program> = Vec::new();
            for round in 0..12 {
                let mut constants: [f64; 4] = std::array::from_fn(|_| rng.random_range(0.1..2.0));
                if round % 3 == 2 {
                    constants[rng.random_range(0..4)] = [0.0, 1.0, -1.0, -0.3, constants[0]][rng.random_range(0..5)];
                }
                let found = record(&Recorder::new(0.1, &("test", structure)), structure, &constants);
                let anew = record(&Recorder::passing(0.1), structure, &constants);
                for (found, anew) in found.iter().zip(&anew) {
                    let steps = |program: &Program| format!("{:?}", program.line().operations);
                    assert_eq!(steps(found), steps(anew), "structure {structure}, {constants:?}");
                    assert_eq!(bits(found), bits(anew), "structure {structure}, {constants:?}");
                }
                shared += found.iter().filter(|p| before.iter().any(|of| of.shares_code(p))).count();
                made += found.len();
                before.extend(found);
            }
        }
        assert!(shared > made / 2, "{shared} of {made} along others");
    }

    /// At half a turn the tangent of its half has no end, and angles nearby were no better than a hundredth of that.
    #[test]
    fn whole_angles_are_known_up_to_half_a_turn() {
        let recorder = Recorder::new(0.1, &"whole angles");
        let angle = Symbol::whole_angle(recorder.varying(0), recorder.varying(1));
        let program = Program::new(&recorder, 2, &[angle], 0..0);
        let mut registers = program.registers(&[]);
        let near = |lane: usize| 0.1_f64.powf((lane / 4) as f64);
        let angles: [f64; LANES] = std::array::from_fn(|lane| {
            let turned = if lane & 1 == 0 { PI - near(lane) } else { near(lane) };
            if lane & 2 == 0 { turned } else { -turned }
        });
        registers[0].0 = angles.map(|angle| 1.000_1 * angle.sin());
        registers[1].0 = angles.map(|angle| 1.000_1 * angle.cos());
        program.interpret(&mut registers);
        for (found, angle) in program.output(&registers, 0).0.iter().zip(angles) {
            assert!((found - angle).abs() < 4.0 * f64::EPSILON * PI, "{angle}: {}", found - angle);
        }
    }
}
