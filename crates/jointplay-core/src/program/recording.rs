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
    numbers: FxHashMap<u64, u32>,
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
        let constants = &mut self.constants;
        let number = *self.numbers.entry(value.to_bits()).or_insert_with(|| {
            constants.push(value);
            constants.len() as u32 - 1
        });
        self.node(Node::Constant { number, negative: value.is_sign_negative() })
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
