//! From the graph of recorded operations to the operations that a processor does.

use super::symbol::{Binary, Node};

/// The operations that a processor does at once.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
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
    /// Number of operands.
    pub const fn arity(self) -> usize {
        match self {
            Self::Neg | Self::Abs => 1,
            Self::Add | Self::Sub | Self::Mul | Self::Div | Self::Max | Self::MaxUnsigned => 2,
            Self::MulAdd | Self::MulSub | Self::NegMulAdd => 3,
        }
    }
}

/// An operation on nodes of the graph: kind, operands, result.
pub(super) type Operation = (Kind, [u32; 3], u32);

/// The operations on what varies, with products fused into sums.
pub(super) fn operations(nodes: &[Node], varying: &[bool], order: &[u32], roots: &[u32]) -> Vec<Operation> {
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
            Node::Constant(bits) => bits >> 63 == 0,
            Node::Abs(_) => true,
            Node::Binary(Binary::Mul, a, b) => a == b || (of(a) && of(b)),
            Node::Binary(Binary::Add | Binary::Div | Binary::Max, a, b) => of(a) && of(b),
            Node::Binary(Binary::Sub, ..) | Node::Neg(_) | Node::Common(_) | Node::Varying(_) => false,
        });
    }
    unsigned
}

fn operands(node: Node) -> impl Iterator<Item = u32> {
    let (a, b) = match node {
        Node::Constant(_) | Node::Common(_) | Node::Varying(_) => (None, None),
        Node::Neg(a) | Node::Abs(a) => (Some(a), None),
        Node::Binary(_, a, b) => (Some(a), Some(b)),
    };
    a.into_iter().chain(b)
}

/// Which nodes depend on the sample. Operands come before their users.
pub(super) fn varying(nodes: &[Node]) -> Vec<bool> {
    let mut varying: Vec<bool> = Vec::with_capacity(nodes.len());
    for &node in nodes {
        let depends = matches!(node, Node::Varying(_)) || operands(node).any(|o| varying[o as usize]);
        varying.push(depends);
    }
    varying
}

/// Roots by the number of operations on the longest way to them: what is known early is computed early, before
/// that on which it depends is left.
pub(super) fn by_depth(nodes: &[Node], varying: &[bool], roots: &[u32]) -> Vec<u32> {
    let mut depth: Vec<u32> = Vec::with_capacity(nodes.len());
    for (&node, &varying) in nodes.iter().zip(varying) {
        let below = operands(node).map(|o| depth[o as usize] + 1).max().unwrap_or(0);
        depth.push(if varying { below } else { 0 });
    }
    let mut roots = roots.to_vec();
    roots.sort_by_key(|&root| depth[root as usize]);
    roots
}

/// The same order, except that an operation which is the last to need a number follows the last of its operands
/// at once: no more numbers are kept, and sums and maxima over all bodies grow while these are at hand.
pub(super) fn hoisted(nodes: &[Node], varying: &[bool], order: &[u32], roots: &[u32]) -> Vec<u32> {
    const NEVER: usize = usize::MAX;
    let is_kept = |o: u32| varying[o as usize] && !matches!(nodes[o as usize], Node::Varying(_));
    let mut last_user = vec![NEVER; nodes.len()];
    for (at, &id) in order.iter().enumerate() {
        operands(nodes[id as usize]).for_each(|o| last_user[o as usize] = at);
    }
    roots.iter().for_each(|&root| last_user[root as usize] = NEVER);
    let mut place = vec![0; nodes.len()];
    for (at, &id) in order.iter().enumerate() {
        let kept = || operands(nodes[id as usize]).filter(|&o| is_kept(o));
        let is_last = kept().any(|o| last_user[o as usize] == at);
        place[id as usize] = kept().map(|o| place[o as usize]).max().filter(|_| is_last).unwrap_or(at);
    }
    let mut order = order.to_vec();
    // Stable: operands stay before what is done in the same place.
    order.sort_by_key(|&id| place[id as usize]);
    order
}

/// What the roots need, operands first, each as late as its first user allows.
pub(super) fn reachable(nodes: &[Node], roots: &[u32]) -> Vec<u32> {
    let mut order = Vec::new();
    let mut seen = vec![false; nodes.len()];
    for &root in roots {
        let mut stack = vec![(root, false)];
        while let Some((id, expanded)) = stack.pop() {
            if expanded {
                order.push(id);
            } else if !seen[id as usize] {
                seen[id as usize] = true;
                stack.push((id, true));
                stack.extend(operands(nodes[id as usize]).filter(|&o| !seen[o as usize]).map(|o| (o, false)));
            }
        }
    }
    order
}
