//! Offsets on lines whose forces vanish within the play, for blocks of configurations.
//!
//! Whole steps take an offset that moves along a line, such as the axial one of a pin, from end to end where the force
//! presses it back at either. It rests between them. Forces s change nearly linearly with the offsets y of such lines, so
//! that contact and reactions agree after a step d where
//!
//! ```text
//! s + J d  presses every line to the end at which y + d is, and vanishes between the ends
//! ```
//!
//! with J from moves of one line at a time. Lines in a row share their play: of the places that agree the one with the most
//! work `s . d + d . J d / 2` is taken. [`crate::contact::semismooth`] has the same condition for all kinds of sets.

use nalgebra::{Matrix3, Vector3};

use crate::clearance::undecided::{UNDECIDED, Unforced};
use crate::math::lanes::block::{Block, LANES};
use crate::mechanism::Mechanism;

/// Lines of one configuration, at most.
const MOST: usize = 3;
/// A whole step that goes on by more than this part of the line leads to the other end.
const OTHER_END: f64 = 0.6;
/// The part of a line by which it moves to tell how forces change.
const MOVED: f64 = 1e-2;
/// Where a force vanishes an offset is known no better than to this part of its set.
pub(crate) const KNOWN: f64 = 1e-8;
/// A force that changes over the whole line by less than this many times what counts as nothing tells no place on it.
const TOLD: f64 = 100.0;
/// A place is within a line up to this part of it.
const WITHIN: f64 = 1e-12;

/// An offset on a line.
#[derive(Clone, Debug)]
struct Rail {
    source: usize,
    parameter: usize,
    middle: f64,
    /// The ends as values of the parameter.
    ends: [f64; 2],
    lever: f64,
}

/// What is known of the lines of one lane that whole steps take from end to end.
#[derive(Clone, Debug, Default)]
struct Balanced {
    /// Their numbers.
    lines: Vec<usize>,
    /// Whether some have come last.
    is_new: bool,
    /// How the force on one line changes by the way of another.
    stiffness: Matrix3<f64>,
}

/// The lines of a mechanism, and what is known of them by lane.
#[derive(Clone, Debug)]
pub(crate) struct Balancing {
    lines: Vec<Rail>,
    by_lane: [Balanced; LANES],
}

impl Balancing {
    pub fn new(m: &Mechanism) -> Self {
        let clearances = m.sources().iter().enumerate().filter(|(_, source)| source.is_clearance);
        let lines = clearances.filter_map(|(number, source)| {
            let (parameter, lever) = (source.first, source.lever);
            let middle = m.centre[parameter];
            let ends = source.set.line()?.map(|end| middle + end);
            Some(Rail { source: number, parameter, middle, ends, lever })
        });
        Self::of(lines.collect())
    }

    fn of(lines: Vec<Rail>) -> Self {
        Self { lines, by_lane: std::array::from_fn(|_| Balanced::default()) }
    }

    /// Forgets all lanes.
    pub fn begin(&mut self) {
        self.by_lane.iter_mut().for_each(|lane| lane.lines.clear());
    }

    /// Takes notice of a whole step from `u` to `pushed`. Gives the most lines of a lane in which some have come to those
    /// that it takes from end to end: what is known of the others does not depend on their neighbours.
    pub fn see(&mut self, u: &[Block], pushed: &[Block]) -> usize {
        self.by_lane.iter_mut().for_each(|lane| lane.is_new = false);
        for (k, line) in self.lines.iter().enumerate() {
            let least = OTHER_END * line.length();
            for (i, lane) in self.by_lane.iter_mut().enumerate() {
                let goes = (pushed[line.parameter].0[i] - u[line.parameter].0[i]).abs() > least;
                if goes && lane.lines.len() < MOST && !lane.lines.contains(&k) {
                    lane.lines.push(k);
                    lane.is_new = true;
                }
            }
        }
        self.by_lane.iter().filter(|lane| lane.is_new).map(|lane| lane.lines.len()).max().unwrap_or(0)
    }

    /// Whether whole steps take no line of a lane from end to end.
    pub fn is_idle(&self, lane: usize) -> bool {
        self.by_lane[lane].lines.is_empty()
    }

    /// Whether forces tell where the lines of a lane rest between their ends: they press back from either side, and by
    /// enough.
    pub fn is_told(&self, lane: usize, scale: &Block, u: &[Block]) -> bool {
        let Balanced { lines, stiffness, .. } = &self.by_lane[lane];
        lines.iter().enumerate().all(|(row, &k)| {
            let (line, at) = (&self.lines[k], u[self.lines[k].parameter].0[lane]);
            let is_at_end = line.ends.iter().any(|end| (at - end).abs() <= WITHIN * line.length());
            is_at_end || -stiffness[(row, row)] * line.length() > TOLD * line.nothing(scale.0[lane])
        })
    }

    /// Puts the other lines that nothing pushes at the nominal pose back into their middle: only what went from end to end
    /// may have pushed them.
    pub fn put_back(&self, lane: usize, unforced: &[[Unforced; LANES]], pushed: &mut [Block]) {
        for (k, line) in self.lines.iter().enumerate() {
            if unforced[line.source][lane].has(0) && !self.by_lane[lane].lines.contains(&k) {
                pushed[line.parameter].0[lane] = line.middle;
            }
        }
    }

    /// Moves one of the lines of every lane that has so many, into the play.
    pub fn move_one(&self, number: usize, u: &mut [Block]) {
        for (i, lane) in self.by_lane.iter().enumerate() {
            if let Some(line) = lane.lines.get(number).map(|&k| &self.lines[k]) {
                let at = &mut u[line.parameter].0[i];
                *at += line.step(*at);
            }
        }
    }

    /// Takes notice of how forces have changed since the offsets were `u`, where one line has moved.
    pub fn learn<'b>(&mut self, number: usize, u: &[Block], before: &[Block], gradient: impl Fn(usize) -> &'b Block) {
        for (i, lane) in self.by_lane.iter_mut().enumerate().filter(|(_, lane)| lane.is_new) {
            let Some(moved) = lane.lines.get(number).map(|&k| &self.lines[k]) else { continue };
            let step = moved.step(u[moved.parameter].0[i]);
            for (row, &k) in lane.lines.iter().enumerate() {
                let change = gradient(self.lines[k].parameter).0[i] - before[k].0[i];
                lane.stiffness[(row, number)] = change / step;
            }
        }
    }

    /// The forces on all lines.
    pub fn forces<'b>(&self, gradient: impl Fn(usize) -> &'b Block) -> Vec<Block> {
        self.lines.iter().map(|line| *gradient(line.parameter)).collect()
    }

    /// Replaces whole steps from `u` along lines that they take from end to end. Gives the number of lines that nothing
    /// pushes there.
    pub fn press<'b>(
        &self,
        gradient: impl Fn(usize) -> &'b Block,
        scale: &Block,
        u: &[Block],
        pushed: &mut [Block],
    ) -> Block {
        let mut quiet = Block::splat(0.0);
        for (i, lane) in self.by_lane.iter().enumerate() {
            let lines: Vec<&Rail> = lane.lines.iter().map(|&k| &self.lines[k]).collect();
            if lines.is_empty() {
                continue;
            }
            let force = |line: &Rail| gradient(line.parameter).0[i];
            let is_quiet = |line: &&&Rail| force(line).abs() <= line.nothing(scale.0[i]);
            quiet.0[i] = lines.iter().filter(is_quiet).count() as f64;
            let mut forces = Vector3::zeros();
            let mut steps = [[0.0; 2]; MOST];
            for (k, line) in lines.iter().enumerate() {
                forces[k] = force(line);
                steps[k] = line.ends.map(|end| end - u[line.parameter].0[i]);
            }
            let Some(step) = agreed(&forces, &lane.stiffness, &steps[..lines.len()]) else { continue };
            for (k, line) in lines.iter().enumerate() {
                let to = u[line.parameter].0[i] + step[k];
                pushed[line.parameter].0[i] = to.clamp(line.ends[0], line.ends[1]);
            }
        }
        quiet
    }
}

impl Rail {
    fn length(&self) -> f64 {
        self.ends[1] - self.ends[0]
    }

    /// The largest force along the line that counts as nothing.
    fn nothing(&self, scale: f64) -> f64 {
        scale * UNDECIDED * self.lever
    }

    /// A small step into the line.
    fn step(&self, at: f64) -> f64 {
        let size = MOVED * self.length();
        if at > 0.5 * (self.ends[0] + self.ends[1]) { -size } else { size }
    }
}

/// The step with the most work after which forces press where the steps have led, each between two ends.
fn agreed(forces: &Vector3<f64>, stiffness: &Matrix3<f64>, ends: &[[f64; 2]]) -> Option<Vector3<f64>> {
    let n = ends.len();
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for pattern in 0..3_usize.pow(n as u32) {
        // Of every line the number of its end, 2 between them.
        let place: [usize; MOST] = std::array::from_fn(|k| pattern / 3_usize.pow(k as u32) % 3);
        let mut matrix = Matrix3::identity();
        let mut right = Vector3::zeros();
        for k in 0..n {
            if place[k] < 2 {
                right[k] = ends[k][place[k]];
            } else {
                matrix.row_mut(k).fill(0.0);
                (0..n).for_each(|l| matrix[(k, l)] = stiffness[(k, l)]);
                right[k] = -forces[k];
            }
        }
        let Some(step) = matrix.lu().solve(&right) else { continue };
        let agrees = (0..n).all(|k| {
            let [low, high] = ends[k];
            let slack = WITHIN * (high - low);
            let then = forces[k] + (0..n).map(|l| stiffness[(k, l)] * step[l]).sum::<f64>();
            match place[k] {
                0 => then <= 0.0,
                1 => then >= 0.0,
                _ => step[k] >= low - slack && step[k] <= high + slack,
            }
        });
        if !agrees {
            continue;
        }
        let change: f64 =
            (0..n).flat_map(|k| (0..n).map(move |l| (k, l))).map(|(k, l)| step[k] * stiffness[(k, l)] * step[l]).sum();
        let work = forces.dot(&step) + 0.5 * change;
        if best.is_none_or(|(most, _)| work > most) {
            best = Some((work, step));
        }
    }
    best.map(|(_, step)| step)
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Lines in a row whose forces are nearly one, in every lane others: where they rest no force presses but at ends.
    #[test]
    fn lines_in_a_row_rest_where_no_force_presses_them_on() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut rested = 0.0;
        for n in 1..=MOST {
            let lines = (0..n).map(|parameter| Rail {
                source: parameter,
                parameter,
                middle: 1.0,
                ends: [-1.0, 3.0],
                lever: 1.0,
            });
            let mut balance = Balancing::of(lines.collect());
            let own: [Vec<f64>; LANES] =
                std::array::from_fn(|_| (0..n).map(|_| rng.random_range(-1e-3..1e-3)).collect());
            let middle: [f64; LANES] = std::array::from_fn(|_| rng.random_range(-4.0..8.0));
            let forces = |u: &[Block]| -> Vec<Block> {
                let force = |k: usize, i: usize| {
                    let sum: f64 = (0..n).map(|l| u[l].0[i]).sum();
                    (middle[i] - sum) * (1.0 + 0.01 * sum) + own[i][k] - 1e-4 * u[k].0[i]
                };
                (0..n).map(|k| Block::new(std::array::from_fn(|i| force(k, i)))).collect()
            };
            let scale = Block::splat(1.0);
            let mut u = vec![Block::splat(-1.0); n];
            for _ in 0..30 {
                let at = forces(&u);
                let whole = |f: &Block| Block::new(f.0.map(|f| if f > 0.0 { 3.0 } else { -1.0 }));
                let mut pushed: Vec<Block> = at.iter().map(whole).collect();
                let before = balance.forces(|p| &at[p]);
                for number in 0..balance.see(&u, &pushed) {
                    let mut moved = u.clone();
                    balance.move_one(number, &mut moved);
                    let then = forces(&moved);
                    balance.learn(number, &u, &before, |p| &then[p]);
                }
                rested = balance.press(|p| &at[p], &scale, &u, &mut pushed).0.iter().sum();
                u = pushed;
            }
            let at = forces(&u);
            for i in 0..LANES {
                for k in 0..n {
                    let (u, force) = (u[k].0[i], at[k].0[i]);
                    let agrees = if u >= 3.0 {
                        force >= 0.0
                    } else if u <= -1.0 {
                        force <= 0.0
                    } else {
                        force.abs() < 1e-11
                    };
                    assert!(agrees, "{n} lines, lane {i}, line {k} at {u}: {force}");
                }
            }
        }
        assert!(rested > 0.0);
    }
}
