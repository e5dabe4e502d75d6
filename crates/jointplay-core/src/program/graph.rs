//! From the graph of recorded operations to the operations that a processor does.

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    Max,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Node {
    /// A constant by its number. Its value may differ from mechanism to mechanism.
    Constant(u32),
    /// A quantity common to all samples.
    Common(u32),
    /// A quantity of its own for every sample.
    Varying(u32),
    Neg(u32),
    Abs(u32),
    Binary(Binary, u32, u32),
}

/// The operations that a processor does at once.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    Add,
    Sub,
    Mul,
    Div,
    Max,
    /// The larger of two numbers known to have no sign.
    MaxUnsigned,
    Neg,
    Abs,
    /// a b + c
    MulAdd,
    /// a b - c
    MulSub,
    /// c - a b
    NegMulAdd,
}

impl Kind {
    /// Number of operands, for machine code.
    #[cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]
    pub const fn arity(self) -> usize {
        match self {
            Self::Neg | Self::Abs => 1,
            Self::Add | Self::Sub | Self::Mul | Self::Div | Self::Max | Self::MaxUnsigned => 2,
            Self::MulAdd | Self::MulSub | Self::NegMulAdd => 3,
        }
    }
}

/// An operation on nodes of the graph: kind, operands, result.
pub(crate) type Operation = (Kind, [u32; 3], u32);

/// The operations on what varies, with products fused into sums.
pub(crate) fn operations(nodes: &[Node], varying: &[bool], order: &[u32], roots: &[u32]) -> Vec<Operation> {
    let mut uses = vec![0_u32; nodes.len()];
    for &id in order {
        for o in operands(nodes[id as usize]) {
            uses[o as usize] += 1;
        }
    }
    for &id in roots {
        // An output is never absorbed into another operation.
        uses[id as usize] += 2;
    }
    let fused = |id: u32| match nodes[id as usize] {
        Node::Binary(Binary::Mul, x, y) if uses[id as usize] == 1 && varying[id as usize] => Some((x, y)),
        _ => None,
    };
    let unsigned = unsigned(nodes);
    let mut work: Vec<Operation> = Vec::new();
    let mut absorbed = vec![false; nodes.len()];
    for &id in order {
        if !varying[id as usize] {
            continue;
        }
        let (kind, operands) = match nodes[id as usize] {
            Node::Neg(a) => (Kind::Neg, [a, a, a]),
            Node::Abs(a) => (Kind::Abs, [a, a, a]),
            Node::Binary(Binary::Add, a, b) => match (fused(a), fused(b)) {
                (Some((x, y)), _) if !absorbed[a as usize] => {
                    absorbed[a as usize] = true;
                    (Kind::MulAdd, [x, y, b])
                }
                (_, Some((x, y))) => {
                    absorbed[b as usize] = true;
                    (Kind::MulAdd, [x, y, a])
                }
                _ => (Kind::Add, [a, b, b]),
            },
            Node::Binary(Binary::Sub, a, b) => match (fused(a), fused(b)) {
                (_, Some((x, y))) => {
                    absorbed[b as usize] = true;
                    (Kind::NegMulAdd, [x, y, a])
                }
                (Some((x, y)), _) => {
                    absorbed[a as usize] = true;
                    (Kind::MulSub, [x, y, b])
                }
                _ => (Kind::Sub, [a, b, b]),
            },
            Node::Binary(Binary::Mul, a, b) => (Kind::Mul, [a, b, b]),
            Node::Binary(Binary::Div, a, b) => (Kind::Div, [a, b, b]),
            Node::Binary(Binary::Max, a, b) if unsigned[a as usize] && unsigned[b as usize] => {
                (Kind::MaxUnsigned, [a, b, b])
            }
            Node::Binary(Binary::Max, a, b) => (Kind::Max, [a, b, b]),
            Node::Constant(_) | Node::Common(_) | Node::Varying(_) => continue,
        };
        work.push((kind, operands, id));
    }
    work.retain(|(_, _, id)| !absorbed[*id as usize]);
    work
}

/// Which nodes are known to have no sign: zero or more, or not a number.
fn unsigned(nodes: &[Node]) -> Vec<bool> {
    let mut unsigned: Vec<bool> = Vec::with_capacity(nodes.len());
    for &node in nodes {
        let of = |o: u32| unsigned[o as usize];
        unsigned.push(match node {
            Node::Abs(_) => true,
            Node::Binary(Binary::Mul, a, b) => a == b || (of(a) && of(b)),
            Node::Binary(Binary::Add | Binary::Div | Binary::Max, a, b) => of(a) && of(b),
            // A constant of the same number may have a sign in another mechanism.
            Node::Constant(_) | Node::Common(_) | Node::Varying(_) | Node::Neg(_) | Node::Binary(Binary::Sub, ..) => {
                false
            }
        });
    }
    unsigned
}

pub(crate) fn operands(node: Node) -> impl Iterator<Item = u32> {
    let (a, b) = match node {
        Node::Constant(_) | Node::Common(_) | Node::Varying(_) => (None, None),
        Node::Neg(a) | Node::Abs(a) => (Some(a), None),
        Node::Binary(_, a, b) => (Some(a), Some(b)),
    };
    a.into_iter().chain(b)
}

/// Which nodes depend on the sample. Operands come before their users.
pub(crate) fn varying(nodes: &[Node]) -> Vec<bool> {
    let mut varying: Vec<bool> = Vec::with_capacity(nodes.len());
    for &node in nodes {
        let depends = matches!(node, Node::Varying(_)) || operands(node).any(|o| varying[o as usize]);
        varying.push(depends);
    }
    varying
}
