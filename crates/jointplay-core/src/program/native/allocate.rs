//! Vector registers for the numbers of a program.
//!
//! One pass over the straight line. A number that is needed in memory once is used from there; when the
//! vector registers run out, the number that is needed last makes room (Belady, IBM Syst. J. 5, 1966, 78).

use crate::program::graph::Kind;
use crate::program::native::uses::{NEVER, Uses, magnitude, n_values, operands, sign, uses};
use crate::program::native::{FIRST_COMMON, Line, MAGNITUDE, SIGN};
use crate::program::operation::Op;

/// Where a number stands in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// In the block of a register.
    Block(u32),
    /// In the table of common numbers.
    Common(u32),
    /// Among the temporaries that were put aside.
    Aside(u32),
}

/// What an instruction may read as its last operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    Register(u8),
    Memory(Place),
}

/// Operations of two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    Max,
    /// The larger of two numbers without sign.
    MaxUnsigned,
    /// Exclusive or of the bits.
    Xor,
    /// And of the bits.
    And,
}

/// Which operands of a fused operation are multiplied: `to`, `second` and `third` are 1, 2 and 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    F132,
    F213,
    F231,
}

/// Signs of a fused operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fused {
    MulAdd,
    MulSub,
    NegMulAdd,
}

/// An instruction on vector registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vector {
    Load { to: u8, from: Place },
    Store { from: u8, to: Place },
    Move { to: u8, from: u8 },
    Binary { kind: Binary, to: u8, a: u8, b: Source },
    Fused { kind: Fused, form: Form, to: u8, second: u8, third: Source },
}

/// A number in a vector register.
#[derive(Clone, Copy)]
struct Held {
    value: usize,
    next: usize,
}

struct Allocator<'p> {
    line: &'p Line<'p>,
    code: Vec<Vector>,
    /// What the vector registers hold.
    held: Vec<Option<Held>>,
    /// Vector register of every value; values are the program's registers and the two masks.
    register: Vec<Option<u8>>,
    /// Where a value stands in memory, too.
    stored: Vec<Option<Place>>,
    /// Places aside in use at most, and those of them that are free again.
    n_aside: u32,
    free: Vec<u32>,
}

/// The line on `n_vector` vector registers, 4 at least.
pub fn allocate(line: &Line<'_>, n_vector: usize) -> Vec<Vector> {
    let n_values = n_values(line);
    let (uses, at_end) = uses(line);
    let mut stored = vec![None; n_values];
    for r in 0..line.n_inputs {
        stored[r as usize] = Some(Place::Block(r));
    }
    for r in line.first_common..line.first_temporary {
        stored[r as usize] = Some(Place::Common(FIRST_COMMON + r - line.first_common));
    }
    stored[sign(line)] = Some(Place::Common(SIGN));
    stored[magnitude(line)] = Some(Place::Common(MAGNITUDE));
    let mut allocator = Allocator {
        line,
        code: Vec::with_capacity(2 * line.operations.len()),
        held: vec![None; n_vector],
        register: vec![None; n_values],
        stored,
        n_aside: 0,
        free: Vec::new(),
    };
    for (op, uses) in line.operations.iter().zip(&uses) {
        allocator.operation(*op, uses);
    }
    for (value, input) in at_end {
        allocator.replace(value, input, NEVER);
    }
    allocator.code
}

impl Allocator<'_> {
    /// Puts a value in the place of an input.
    fn replace(&mut self, value: usize, input: u32, next: usize) {
        self.load(value, next, &[]);
        let from = self.in_register(value);
        self.code.push(Vector::Store { from, to: Place::Block(input) });
        self.held[from as usize] = Some(Held { value, next });
        if next == NEVER {
            self.release(value);
        }
    }

    fn operation(&mut self, op: Op, uses: &Uses) {
        let (mut values, n) = operands(self.line, &op);
        let mut nexts = uses.operands;
        let commutes = matches!(op.kind, Kind::Add | Kind::Mul | Kind::MaxUnsigned | Kind::Neg | Kind::Abs);
        if commutes && self.register[values[0]].is_none() && self.register[values[1]].is_some() {
            values.swap(0, 1);
            nexts.swap(0, 1);
        }
        let from_memory = self.left_in_memory(&values[..n], &nexts);
        for p in 0..n {
            if Some(p) != from_memory {
                self.load(values[p], nexts[p], &values[..n]);
            }
        }
        for p in 0..n {
            if let Some(r) = self.register[values[p]] {
                self.held[r as usize] = Some(Held { value: values[p], next: nexts[p] });
            }
        }
        let to = if n == 2 { self.binary(op.kind, &values) } else { self.fused(op.kind, values, from_memory) };
        for p in 0..n {
            if nexts[p] == NEVER {
                self.release(values[p]);
            }
        }
        let target = op.target as usize;
        self.stored[target] = None;
        for &block in &uses.stores {
            let place = Place::Block(block);
            self.code.push(Vector::Store { from: to, to: place });
            self.stored[target] = Some(place);
        }
        if uses.result != NEVER {
            self.held[to as usize] = Some(Held { value: target, next: uses.result });
            self.register[target] = Some(to);
        }
        for replacement in &uses.replacements {
            self.replace(replacement.value, replacement.input, replacement.next);
        }
    }

    /// Which operand is read from memory: one that is not in a register, stands where the instruction
    /// can read it and appears once; the one needed last among several.
    fn left_in_memory(&self, values: &[usize], nexts: &[usize; 3]) -> Option<usize> {
        let first = usize::from(values.len() == 2);
        (first..values.len())
            .filter(|&p| self.register[values[p]].is_none())
            .filter(|&p| values.iter().filter(|&&v| v == values[p]).count() == 1)
            .max_by_key(|&p| nexts[p])
    }

    fn load(&mut self, value: usize, next: usize, operands: &[usize]) {
        if self.register[value].is_some() {
            return;
        }
        let to = self.take(operands);
        let from = self.stored[value].expect("a value is in a register or stored");
        self.code.push(Vector::Load { to, from });
        self.register[value] = Some(to);
        self.held[to as usize] = Some(Held { value, next });
    }

    /// A vector register that holds none of the operands.
    fn take(&mut self, operands: &[usize]) -> u8 {
        if let Some(free) = self.held.iter().position(Option::is_none) {
            return free as u8;
        }
        let candidates = self.held.iter().enumerate().filter_map(|(r, held)| held.map(|h| (r, h)));
        let (r, victim) = candidates
            .filter(|(_, h)| !operands.contains(&h.value))
            // Among equals one that is in memory already.
            .max_by_key(|(_, h)| (h.next, self.stored[h.value].is_some()))
            .expect("more vector registers than operands");
        self.store(r as u8, victim.value);
        self.register[victim.value] = None;
        self.held[r] = None;
        r as u8
    }

    /// Puts a value where it is found when it is needed again, unless it stands there.
    fn store(&mut self, from: u8, value: usize) {
        if self.stored[value].is_some() {
            return;
        }
        let to = Place::Aside(self.free.pop().unwrap_or_else(|| {
            self.n_aside += 1;
            self.n_aside - 1
        }));
        self.code.push(Vector::Store { from, to });
        self.stored[value] = Some(to);
    }

    /// Forgets a value that is not needed again.
    fn release(&mut self, value: usize) {
        if let Some(r) = self.register[value].take() {
            self.held[r as usize] = None;
        }
        if let Some(Place::Aside(k)) = self.stored[value] {
            self.stored[value] = None;
            self.free.push(k);
        }
    }

    fn source(&self, value: usize) -> Source {
        match self.register[value] {
            Some(r) => Source::Register(r),
            None => Source::Memory(self.stored[value].expect("a value is in a register or stored")),
        }
    }

    fn in_register(&self, value: usize) -> u8 {
        self.register[value].expect("loaded before")
    }

    /// A vector register whose number is not needed after this instruction.
    fn dying(&self, value: usize) -> Option<u8> {
        self.register[value].filter(|&r| self.held[r as usize].is_some_and(|h| h.next == NEVER))
    }

    fn binary(&mut self, kind: Kind, values: &[usize; 3]) -> u8 {
        let kind = match kind {
            Kind::Add => Binary::Add,
            Kind::Sub => Binary::Sub,
            Kind::Mul => Binary::Mul,
            Kind::Div => Binary::Div,
            Kind::Neg => Binary::Xor,
            Kind::Abs => Binary::And,
            Kind::MaxUnsigned => Binary::MaxUnsigned,
            _ => Binary::Max,
        };
        let (a, b) = (self.in_register(values[0]), self.source(values[1]));
        // A maximum reads its first operand once more after it has written.
        let is_max = matches!(kind, Binary::Max | Binary::MaxUnsigned);
        let over_a = self.dying(values[0]).filter(|_| !is_max);
        let over_b = self.dying(values[1]).filter(|&r| !is_max || r != a);
        let to = over_a.or(over_b).unwrap_or_else(|| self.take(&values[..2]));
        self.code.push(Vector::Binary { kind, to, a, b });
        to
    }

    fn fused(&mut self, kind: Kind, values: [usize; 3], from_memory: Option<usize>) -> u8 {
        let kind = match kind {
            Kind::MulSub => Fused::MulSub,
            Kind::NegMulAdd => Fused::NegMulAdd,
            _ => Fused::MulAdd,
        };
        let [mut x, mut y, z] = values;
        if from_memory == Some(0) || (from_memory.is_none() && self.dying(x).is_none()) {
            (x, y) = (y, x);
        }
        // Now x is in a register, and y may be in memory, or z.
        let (form, over) = if from_memory == Some(2) {
            if self.dying(x).is_none() && self.dying(y).is_some() {
                (x, y) = (y, x);
            }
            (Form::F213, x)
        } else if self.dying(z).is_some() || self.dying(x).is_none() {
            (Form::F231, z)
        } else if from_memory.is_some() {
            (Form::F132, x)
        } else {
            (Form::F213, x)
        };
        let to = self.dying(over).unwrap_or_else(|| {
            let to = self.take(&values);
            self.code.push(Vector::Move { to, from: self.in_register(over) });
            to
        });
        let (second, third) = match form {
            Form::F132 => (z, y),
            Form::F213 => (y, z),
            Form::F231 => (x, y),
        };
        self.code.push(Vector::Fused { kind, form, to, second: self.in_register(second), third: self.source(third) });
        to
    }
}
