//! What an error does not exceed, by parts of the sets and of the directions that a maximum can have.
//!
//! A component, or the size of a vector of them, is `n . e(x)` with a direction n that is fixed at the maximum: where
//! |e| is largest, n = e / |e|, and x* makes `n . e` largest, too. With G the derivative of e over a part,
//!
//! ```text
//! value      |e(x*)| <= |e(x0)| + sum over blocks of sup (n . G) (x - x0)
//! optimality each block of x* is where it is farthest along its part of n . G(x*)
//! direction  n = e / |e|
//! ```
//!
//! The second and third line make the part of x and the box of n smaller, over which G is computed again: near a maximum
//! the parts shrink by the share that the gradient changes by over them, and what the first line loses by the square of
//! it. What does not shrink is halved, the part with the largest bound first.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::rc::Rc;

use crate::interrupt;
use crate::math::interval::Interval;
use crate::questions::certificate::blocks::{Part, share};
use crate::questions::certificate::errors::{Errors, Expansion};

/// A part is expanded anew when the spread of what is sought over it has shrunk by this factor.
const SHRUNK: f64 = 0.7;
/// Rounds in which one part is made smaller before it is halved.
const ROUNDS: usize = 12;
/// Directions are halved first while their box is wider than this.
const COARSE: f64 = 0.26;

/// What is bounded: some components of the error, and the directions in which they can be largest.
#[derive(Clone, Debug)]
pub(super) struct Sought {
    pub components: std::ops::Range<usize>,
    pub direction: Vec<Interval>,
}

impl Sought {
    /// One end of a component.
    pub fn end(component: usize, sign: f64) -> Self {
        Self { components: component..component + 1, direction: vec![Interval::from_point(sign)] }
    }

    /// The size of some components.
    pub fn size(components: std::ops::Range<usize>) -> Self {
        let direction = vec![Interval::of_size(1.0); components.len()];
        Self { components, direction }
    }

    fn is_size(&self) -> bool {
        self.components.len() > 1
    }
}

/// A part in which a maximum can be.
#[derive(Clone)]
struct Node {
    part: Part,
    direction: Vec<Interval>,
    /// Of a part around it.
    expansion: Rc<Expansion>,
    bound: f64,
}

impl PartialEq for Node {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Node {}

impl PartialOrd for Node {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Node {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

/// The bound and how many parts were looked at.
pub(super) struct Bounded {
    pub bound: f64,
    pub parts: u64,
}

/// The search for one bound.
pub(super) struct Search<'s, 'm> {
    pub errors: &'s Errors<'m>,
    pub whole: &'s Rc<Expansion>,
    pub sought: Sought,
    /// A bound below this is good enough.
    pub enough: f64,
    /// Parts that may be looked at.
    pub budget: u64,
}

impl Search<'_, '_> {
    /// From the expansion over all of the sets.
    pub fn run(&self) -> Bounded {
        let root = Node {
            part: self.whole.enclosure.part.clone(),
            direction: self.sought.direction.clone(),
            expansion: Rc::clone(self.whole),
            bound: f64::INFINITY,
        };
        let mut open = BinaryHeap::from([root]);
        // Of the parts that were bounded well enough, and of those that could not be looked at.
        let (mut closed, mut parts) = (f64::NEG_INFINITY, 0);
        while let Some(mut node) = open.pop() {
            interrupt::check();
            if node.bound <= self.enough || parts >= self.budget {
                closed = closed.max(node.bound);
                continue;
            }
            parts += 1;
            if !self.shrink(&mut node, &mut parts) {
                continue;
            }
            let halves = if node.bound <= self.enough { Vec::new() } else { self.halves(&node) };
            if halves.is_empty() {
                closed = closed.max(node.bound);
            }
            open.extend(halves);
        }
        Bounded { bound: closed, parts }
    }

    /// The gradient along a box of directions.
    fn gradient(&self, expansion: &Expansion, direction: &[Interval]) -> Vec<Interval> {
        let rows = &expansion.gradient[self.sought.components.clone()];
        let along = |k: usize| {
            rows.iter().zip(direction).fold(Interval::ZERO, |sum, (row, n)| sum + row[k] * *n)
        };
        (0..expansion.x.len()).map(along).collect()
    }

    /// Makes a part smaller as far as that goes by itself; false where no maximum is in it.
    fn shrink(&self, node: &mut Node, parts: &mut u64) -> bool {
        for _ in 0..ROUNDS {
            let expansion = Rc::clone(&node.expansion);
            if self.sought.is_size() && !self.leave_directions(node, &expansion) {
                return false;
            }
            let g = self.gradient(&expansion, &node.direction);
            node.bound = node.bound.min(self.bound(node, &expansion, &g));
            if node.bound <= self.enough {
                return true;
            }
            let spread = |part: &Part| self.errors.encloser.product.spread(part, &g, &expansion.x).width();
            if !self.errors.encloser.product.leave_optima(&mut node.part, &g) {
                return false;
            }
            node.bound = node.bound.min(self.bound(node, &expansion, &g));
            let before = spread(&expansion.enclosure.part);
            if node.bound <= self.enough || !(spread(&node.part) < SHRUNK * before) || *parts >= self.budget {
                return true;
            }
            *parts += 1;
            let Some(next) = self.errors.expanded(&node.part, &expansion, self.whole, &self.sought.components) else { return true };
            node.expansion = Rc::new(next);
        }
        true
    }

    /// The bound by an expansion over a part around the part.
    fn bound(&self, node: &Node, expansion: &Expansion, g: &[Interval]) -> f64 {
        let error = &expansion.error[self.sought.components.clone()];
        let along = error.iter().zip(&node.direction).fold(Interval::ZERO, |sum, (e, n)| sum + *e * *n).high;
        let size = error.iter().fold(Interval::ZERO, |sum, e| sum + e.square()).root().high;
        let supports = self.errors.encloser.product.supports(&node.part, g, &expansion.x);
        let sum = supports.fold(Interval::from_point(along.min(size)), |sum, s| sum + Interval::from_point(s));
        if sum.high.is_nan() { f64::INFINITY } else { sum.high }
    }

    /// Leaves of the directions those of the errors on the part.
    fn leave_directions(&self, node: &mut Node, expansion: &Expansion) -> bool {
        let spread = |c: usize| {
            let product = &self.errors.encloser.product;
            expansion.error[c] + product.spread(&node.part, &expansion.gradient[c], &expansion.x)
        };
        let error: Vec<Interval> = self.sought.components.clone().map(spread).collect();
        let n = node.direction.clone();
        // n = e / |e|, and n has the length one.
        let on_sphere = |k: usize| {
            let others = (0..n.len()).filter(|&j| j != k).fold(Interval::ZERO, |sum, j| sum + n[j].square());
            let root = (Interval::ONE - others).root();
            let rest = Interval::ONE - others;
            if rest.high < 0.0 {
                return None;
            }
            let left = if n[k].low > 0.0 {
                Some(root)
            } else if n[k].high < 0.0 {
                Some(-root)
            } else {
                Some(root.hull(-root))
            };
            left.and_then(|left| n[k].common(left))
        };
        for k in 0..n.len() {
            let Some(left) = on_sphere(k).and_then(|left| left.common(share(&error, k))) else { return false };
            node.direction[k] = left;
        }
        true
    }

    /// Two parts of a part that has not shrunk enough.
    fn halves(&self, node: &Node) -> Vec<Node> {
        let widest = |n: &[Interval]| {
            (0..n.len()).max_by(|&a, &b| n[a].width().total_cmp(&n[b].width())).unwrap_or_default()
        };
        let k = widest(&node.direction);
        let width = node.direction[k].width();
        let middle: Vec<Interval> = node.direction.iter().map(|n| Interval::from_point(n.middle())).collect();
        let expansion = &node.expansion;
        let total = |direction: &[Interval]| -> Vec<f64> {
            let g = self.gradient(expansion, direction);
            let product = &self.errors.encloser.product;
            let from = product.centre(&node.part);
            product.supports(&node.part, &g, &from).collect()
        };
        let (all, own) = (total(&node.direction), total(&middle));
        let (all_sum, own_sum): (f64, f64) = (all.iter().sum(), own.iter().sum());
        if self.sought.is_size() && (width > COARSE || all_sum > 2.0 * own_sum) && width > 1e-12 {
            let cut = node.direction[k].middle();
            let (mut low, mut high) = (node.clone(), node.clone());
            low.direction[k].high = cut;
            high.direction[k].low = cut;
            return vec![low, high];
        }
        let g = self.gradient(expansion, &node.direction);
        let blocks = &self.errors.encloser.product.blocks;
        let widths = |c: usize| node.part.x[c].width() * g[c].size();
        let costly = (0..blocks.len()).max_by(|&a, &b| own[a].total_cmp(&own[b]));
        let coordinate = costly.and_then(|b| blocks[b].range().max_by(|&a, &b| widths(a).total_cmp(&widths(b))));
        let Some(coordinate) = coordinate else { return Vec::new() };
        node.part.halves(coordinate).map(|part| Node { part, ..node.clone() }).into()
    }
}
