//! When the numbers of a line are needed.

use crate::program::graph::Kind;
use crate::program::native::Line;
use crate::program::operation::Op;

/// A number that is never needed again.
pub const NEVER: usize = usize::MAX;

/// When the operands of an instruction and its result are needed next.
pub struct Uses {
    pub operands: [usize; 3],
    pub result: usize,
    /// Blocks that get the result at once.
    pub stores: Vec<u32>,
    /// What replaces inputs after the instruction, which was the last to read them.
    pub replacements: Vec<Replacement>,
}

/// A value that replaces an input some time after it has been computed.
pub struct Replacement {
    pub value: usize,
    pub input: u32,
    /// When the value is needed next.
    pub next: usize,
}

/// The value with the sign bit alone; values are the registers of the line and the two masks.
pub const fn sign(line: &Line<'_>) -> usize {
    line.n_registers as usize
}

/// The value with all bits but the sign's.
pub const fn magnitude(line: &Line<'_>) -> usize {
    line.n_registers as usize + 1
}

/// Number of values.
pub const fn n_values(line: &Line<'_>) -> usize {
    line.n_registers as usize + 2
}

/// Values that an instruction reads, and how many.
pub fn operands(line: &Line<'_>, op: &Op) -> ([usize; 3], usize) {
    let [a, b, c] = [op.a, op.b, op.c].map(|r| r as usize);
    match op.kind {
        Kind::Neg => ([a, sign(line), a], 2),
        Kind::Abs => ([a, magnitude(line), a], 2),
        kind => ([a, b, c], kind.arity()),
    }
}

/// The uses of every operation's numbers, and the common values that replace inputs at the end.
pub fn uses(line: &Line<'_>) -> (Vec<Uses>, Vec<(usize, u32)>) {
    let n_values = n_values(line);
    let mut last_read = vec![0; n_values];
    let mut written = vec![0; n_values];
    for (at, op) in line.operations.iter().enumerate() {
        let (values, n) = operands(line, op);
        for &v in &values[..n] {
            last_read[v] = at;
        }
        written[op.target as usize] = at;
    }
    let mut stores: Vec<Vec<u32>> = vec![Vec::new(); n_values];
    let mut replaced: Vec<Vec<(usize, u32)>> = vec![Vec::new(); line.operations.len()];
    let mut at_end = Vec::new();
    for (k, &output) in line.outputs.iter().enumerate() {
        let value = output as usize;
        match line.replaced.get(k) {
            Some(&input) if input == output => {}
            Some(&input) if output < line.first_temporary => at_end.push((value, input)),
            Some(&input) if last_read[input as usize] > written[value] => {
                replaced[last_read[input as usize]].push((value, input));
            }
            Some(&input) => stores[value].push(input),
            None if output >= line.first_temporary && !stores[value].contains(&output) => stores[value].push(output),
            None => {}
        }
    }
    let mut next = vec![NEVER; n_values];
    let mut uses = Vec::with_capacity(line.operations.len());
    for (at, op) in line.operations.iter().enumerate().rev() {
        let last_first = replaced[at].iter().rev();
        let put = |&(value, input): &(usize, u32)| Replacement {
            value,
            input,
            next: std::mem::replace(&mut next[value], at),
        };
        let mut replacements: Vec<Replacement> = last_first.map(put).collect();
        replacements.reverse();
        let target = op.target as usize;
        let result = std::mem::replace(&mut next[target], NEVER);
        // Numbers that had the register before are not the output.
        let stores = std::mem::take(&mut stores[target]);
        let (values, n) = operands(line, op);
        uses.push(Uses { operands: values.map(|v| next[v]), result, stores, replacements });
        for &v in &values[..n] {
            next[v] = at;
        }
    }
    uses.reverse();
    (uses, at_end)
}
