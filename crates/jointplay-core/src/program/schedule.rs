//! The order of a program's operations: few numbers are waiting at any time, and those in use were made a short
//! while ago.
//!
//! Operations follow the longest chain of dependences, each as late as its first user allows. What is not on it is
//! then brought to where it depends on nothing new.

use std::cmp::Reverse;

use crate::program::graph::{Node, operands};

/// What the roots need, operands first.
pub(crate) fn schedule(nodes: &[Node], varying: &[bool], roots: &[u32]) -> Vec<u32> {
    let depth = depths(nodes, varying);
    let mut deepest_first = roots.to_vec();
    deepest_first.sort_by_key(|&root| Reverse(depth[root as usize]));
    let order = reachable(nodes, &depth, &deepest_first);
    let order = with_outputs_early(nodes, varying, &depth, order, deepest_first.first().copied());
    with_last_uses_early(nodes, varying, order, roots)
}

/// Operations on the longest way to every node, of those that are done for every sample.
fn depths(nodes: &[Node], varying: &[bool]) -> Vec<u32> {
    let mut depth: Vec<u32> = Vec::with_capacity(nodes.len());
    for (&node, &varying) in nodes.iter().zip(varying) {
        let below = operands(node).map(|o| depth[o as usize] + 1).max().unwrap_or(0);
        depth.push(if varying { below } else { 0 });
    }
    depth
}

/// Operands before their users, deep ones first, each as late as its first user allows.
fn reachable(nodes: &[Node], depth: &[u32], roots: &[u32]) -> Vec<u32> {
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
                let first = stack.len();
                stack.extend(operands(nodes[id as usize]).filter(|&o| !seen[o as usize]).map(|o| (o, false)));
                stack[first..].sort_by_key(|&(o, _)| depth[o as usize]);
            }
        }
    }
    order
}

/// Whether a node is the result of an operation that is done for every sample.
fn is_computed(nodes: &[Node], varying: &[bool], id: u32) -> bool {
    varying[id as usize] && !matches!(nodes[id as usize], Node::Varying(_))
}

/// What the first root does not need follows the last of its operands at once, where it has any among what that
/// root needs.
fn with_outputs_early(
    nodes: &[Node],
    varying: &[bool],
    depth: &[u32],
    order: Vec<u32>,
    first_root: Option<u32>,
) -> Vec<u32> {
    let Some(end) = order.iter().position(|&id| Some(id) == first_root) else { return order };
    let mut place = vec![None; nodes.len()];
    let mut placed = Vec::with_capacity(order.len());
    for (at, &id) in order.iter().enumerate() {
        let computed = operands(nodes[id as usize]).filter(|&o| is_computed(nodes, varying, o));
        let latest = computed.filter_map(|o| place[o as usize]).max();
        place[id as usize] = if at <= end { Some(at) } else { latest };
        placed.extend(place[id as usize].map(|place| (place, id)));
    }
    // Stable: operands stay before what is done in the same place.
    placed.sort_by_key(|&(place, _)| place);
    let mut wanted: Vec<u32> = placed.into_iter().map(|(_, id)| id).collect();
    wanted.extend(order);
    reachable(nodes, depth, &wanted)
}

/// An operation that is the last to need a number follows the last of its operands at once: no more numbers are
/// waiting, and sums and maxima over all bodies grow while these are at hand.
fn with_last_uses_early(nodes: &[Node], varying: &[bool], mut order: Vec<u32>, roots: &[u32]) -> Vec<u32> {
    const NEVER: usize = usize::MAX;
    let mut last_user = vec![NEVER; nodes.len()];
    for (at, &id) in order.iter().enumerate() {
        operands(nodes[id as usize]).for_each(|o| last_user[o as usize] = at);
    }
    for &root in roots {
        last_user[root as usize] = NEVER;
    }
    let mut place = vec![0; nodes.len()];
    for (at, &id) in order.iter().enumerate() {
        let computed = || operands(nodes[id as usize]).filter(|&o| is_computed(nodes, varying, o));
        let is_last = computed().any(|o| last_user[o as usize] == at);
        place[id as usize] = computed().map(|o| place[o as usize]).max().filter(|_| is_last).unwrap_or(at);
    }
    order.sort_by_key(|&id| place[id as usize]);
    order
}
