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
use crate::questions::certificate::atlas::Atlas;
use crate::questions::certificate::blocks::Part;
use crate::questions::certificate::directions::Direction;
use crate::questions::certificate::errors::{Errors, Expansion, weighted};
use crate::questions::certificate::fan::fan;

/// A part is expanded anew when the spread of what is sought over it has shrunk by this factor.
const SHRUNK: f64 = 0.7;
/// After so many parts the bound must have come closer by this part of what it lacks, or it is left as it is.
const CHECKED: u64 = 25;
const GAIN: f64 = 0.02;
/// No closer bound along a direction is sought where it is below what is good enough by this part.
const FAR: f64 = 0.1;
/// Rounds in which one part is made smaller before it is halved.
const ROUNDS: usize = 12;
/// Cells of directions that are wider than the first are halved before a part is expanded, such that are wider than the
/// second before it is halved; narrower ones than the last are not.
const BROAD: f64 = 1.1;
const WIDE: f64 = 0.26;
const FINEST: f64 = 1e-9;
/// Parts that are only bounded anew, for each part that may be expanded.
const SEEN: u64 = 50;

/// What is bounded: some components of the error, and the directions in which they can be largest.
#[derive(Clone, Debug)]
pub(super) struct Sought {
    pub components: std::ops::Range<usize>,
    pub directions: Vec<Direction>,
    /// What is known of the components of an error.
    pub within: Vec<Interval>,
}

impl Sought {
    /// One end of a component.
    pub fn end(component: usize, sign: f64) -> Self {
        Self::along(component..component + 1, Direction::of(&[sign]))
    }

    /// The component of some components along a direction.
    pub fn along(components: std::ops::Range<usize>, direction: Direction) -> Self {
        let within = vec![Interval::LINE; components.len()];
        Self { components, directions: vec![direction], within }
    }

    /// The size of some components.
    pub fn size(components: std::ops::Range<usize>) -> Self {
        let (directions, within) = (Direction::all(components.len()), vec![Interval::LINE; components.len()]);
        Self { components, directions, within }
    }
}

/// A part in which a maximum can be.
#[derive(Clone)]
struct Node {
    part: Part,
    direction: Direction,
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

/// The bound and how many parts were expanded.
pub(super) struct Bounded {
    pub bound: f64,
    pub parts: u64,
}

/// The search for one bound.
pub(super) struct Search<'s, 'm> {
    pub errors: &'s Errors<'m>,
    pub atlas: &'s Atlas,
    pub sought: &'s Sought,
    /// A bound below this is good enough; one above this after a quarter of the parts is left as it is.
    pub enough: f64,
    pub poor: f64,
    /// Vectors that are not longer are left out with their directions.
    pub least: f64,
    /// Parts that may be expanded.
    pub budget: u64,
}

impl Search<'_, '_> {
    /// From the expansions over all of the sets.
    pub fn run(&self) -> Bounded {
        let node = |direction: &Direction, cell: &Rc<Expansion>| {
            let (part, expansion) = (cell.enclosure.part.clone(), Rc::clone(cell));
            self.bounded(Node { part, direction: direction.clone(), expansion, bound: f64::INFINITY })
        };
        let cells = |direction| self.atlas.cells.iter().map(move |cell| node(direction, cell));
        let mut open: BinaryHeap<Node> = self.sought.directions.iter().flat_map(cells).collect();
        // Of the parts that were bounded well enough, and of those that could not be looked at.
        let (mut closed, mut parts, mut seen) = (self.least, 0, 0);
        // The largest bound when progress was last looked at, and when it is looked at again.
        let (mut before, mut checked, mut is_stuck) = (f64::INFINITY, CHECKED, false);
        while let Some(mut node) = open.pop() {
            interrupt::check();
            if parts >= checked {
                is_stuck = before - node.bound <= GAIN * (node.bound - self.enough);
                (before, checked) = (node.bound, parts + CHECKED.max(open.len() as u64));
            }
            is_stuck |= 4 * parts >= self.budget && node.bound > self.poor;
            if node.bound <= self.enough || is_stuck || parts >= self.budget || seen >= SEEN * self.budget {
                closed = closed.max(node.bound);
                continue;
            }
            seen += 1;
            if !self.shrink(&mut node, &mut parts) {
                continue;
            }
            let halves = if node.bound <= self.enough { Vec::new() } else { self.halves(&node, &mut parts) };
            if halves.is_empty() {
                closed = closed.max(node.bound);
            }
            open.extend(halves);
        }
        Bounded { bound: closed, parts }
    }

    /// Makes a part smaller as far as that goes by itself; false where no maximum is in it.
    fn shrink(&self, node: &mut Node, parts: &mut u64) -> bool {
        let product = &self.errors.encloser.product;
        for _ in 0..ROUNDS {
            let expansion = Rc::clone(&node.expansion);
            if node.direction.width() > 0.0 && !self.leave_directions(node, &expansion) {
                return false;
            }
            let direction = node.direction.components();
            if !product.leave_optima(
                &mut node.part,
                &weighted(&expansion.along_sets[self.sought.components.clone()], &direction),
            ) {
                return false;
            }
            let g = expansion.gradient(&self.sought.components, &direction);
            node.bound = node.bound.min(self.bound(node, &expansion, &g));
            if node.bound > self.enough && node.direction.width() > 0.0 {
                let cell = [node.direction.clone()];
                node.bound = node.bound.min(fan(&cell, self.enough, |n| self.along(node, &expansion, n)));
            }
            if node.bound <= self.enough || *parts >= self.budget || self.is_coarse(node, BROAD) {
                return true;
            }
            let spread = |part: &Part| product.spread(part, &g, &expansion.x).width();
            let is_narrower = |(x, of): (&Interval, &Interval)| x.width() < SHRUNK * of.width();
            let mut slabs = node.part.x.iter().zip(&expansion.enclosure.part.x).skip(product.n);
            if !slabs.any(is_narrower) && !(spread(&node.part) < SHRUNK * spread(&expansion.enclosure.part)) {
                return true;
            }
            *parts += 1;
            let expanded = self.atlas.expanded(self.errors, &node.part, &expansion, &self.sought.components);
            let Some(next) = expanded else { return true };
            node.expansion = Rc::new(next);
        }
        true
    }

    /// A part with its bound by what is known around it.
    fn bounded(&self, mut node: Node) -> Node {
        let g = node.expansion.gradient(&self.sought.components, &node.direction.components());
        node.bound = node.bound.min(self.bound(&node, &node.expansion, &g));
        node
    }

    /// The bound by an expansion over a part around the part.
    fn bound(&self, node: &Node, expansion: &Expansion, g: &[Interval]) -> f64 {
        let error = &expansion.error[self.sought.components.clone()];
        let along = error.iter().zip(node.direction.components()).fold(Interval::ZERO, |sum, (e, n)| sum + *e * n).high;
        let size = error.iter().fold(Interval::ZERO, |sum, e| sum + e.square()).root().high;
        let direct = expansion.gained(&self.errors.encloser.product, &node.part, g, along.min(size));
        let (corners, factor) = node.direction.corners();
        let highest = corners.iter().map(|corner| self.along(node, expansion, corner));
        let by_corners = if corners.len() > 1 {
            factor * highest.fold(0.0, f64::max) * (1.0 + f64::EPSILON)
        } else {
            highest.fold(f64::NEG_INFINITY, f64::max)
        };
        let bound = direct.min(by_corners);
        if bound.is_nan() { f64::INFINITY } else { bound }
    }

    /// The bound along one direction.
    fn along(&self, node: &Node, expansion: &Expansion, direction: &[f64]) -> f64 {
        let (product, room) = (&self.errors.encloser.product, &mut self.errors.room.borrow_mut());
        let enough = self.enough - FAR * self.enough.abs();
        expansion.along(product, &node.part, &self.sought.components, (direction, enough), room)
    }

    /// Whether the cell of directions is to be halved first: where it is wider than this, or where the bound would be good
    /// enough along its middle alone.
    fn is_coarse(&self, node: &Node, wide: f64) -> bool {
        let width = node.direction.width();
        let along_middle = || self.along(node, &node.expansion, &node.direction.middle());
        width > wide || width > FINEST && along_middle() <= self.enough
    }

    /// Leaves of the directions those of the errors on the part that are not left out.
    fn leave_directions(&self, node: &mut Node, expansion: &Expansion) -> bool {
        let product = &self.errors.encloser.product;
        let reached = |(c, within): (usize, &Interval)| {
            let g = expansion.gradient(&(c..c + 1), &[Interval::ONE]);
            within.common(expansion.error[c] + product.spread(&node.part, &g, &expansion.x))
        };
        let vector: Option<Vec<Interval>> =
            self.sought.components.clone().zip(&self.sought.within).map(reached).collect();
        vector.is_some_and(|vector| node.direction.leave(&vector, self.least))
    }

    /// Two parts of a part that has not shrunk enough; to halve what is expanded counts, too.
    fn halves(&self, node: &Node, parts: &mut u64) -> Vec<Node> {
        let (expansion, product) = (&node.expansion, &self.errors.encloser.product);
        if self.is_coarse(node, WIDE) {
            let half = |direction: Direction| self.bounded(Node { direction, ..node.clone() });
            return node.direction.halves().into_iter().map(half).collect();
        }
        let mut second = self.errors.room.borrow_mut();
        second.set_to_sum(&expansion.second[self.sought.components.clone()], &node.direction.middle());
        let costs = second.costs(&node.part);
        drop(second);
        let costly = (0..costs.len()).max_by(|&a, &b| costs[a].total_cmp(&costs[b]));
        let Some(coordinate) = costly.filter(|&k| costs[k] > 0.0) else { return Vec::new() };
        *parts += 1;
        product.halves(&node.part, coordinate).map(|part| self.bounded(Node { part, ..node.clone() })).into()
    }
}
