//! Recordings of this process, kept for the next mechanism of the same structure: a bounded number of them, those
//! used last.

use std::hash::{Hash, Hasher};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use rustc_hash::FxHasher;

use crate::program::code::{Code, Frame};
use crate::program::graph::Node;
use crate::program::patient::lock;

/// Recordings kept at most.
const MOST: usize = 256;
/// Bytes that they take at most, machine code included.
const LARGEST: usize = 64 << 20;

/// Most recently used ones last, each with its key.
type Traces = Vec<(u64, Arc<Trace>)>;

static KEPT: Mutex<Traces> = Mutex::new(Vec::new());
static RECORDED: AtomicU64 = AtomicU64::new(0);

/// A graph, the order in which its nodes were asked for, and the programs that were made of it.
#[derive(Debug, Default)]
pub(crate) struct Trace {
    pub nodes: Vec<Node>,
    pub asked: Vec<u32>,
    pub made: Vec<Made>,
}

/// A program, when it was made and of what.
#[derive(Clone, Debug)]
pub(crate) struct Made {
    /// Nodes asked for until then.
    pub asked: usize,
    pub roots: Vec<u32>,
    pub code: Arc<Code>,
}

/// How far a recording has come along another one.
#[derive(Default)]
pub(crate) struct Reached {
    pub asked: usize,
    pub nodes: usize,
    pub made: usize,
}

impl Made {
    pub fn is(&self, roots: &[u32], frame: &Frame) -> bool {
        self.roots == roots && self.code.frame() == frame
    }
}

impl Trace {
    /// The node asked for next.
    #[inline]
    pub fn asked(&self, reached: &Reached) -> Option<u32> {
        self.asked.get(reached.asked).copied()
    }

    /// The program made next, if it is made now.
    pub fn made(&self, reached: &Reached) -> Option<&Made> {
        self.made.get(reached.made).filter(|made| made.asked == reached.asked)
    }

    pub fn begins_as(&self, other: &Self, reached: &Reached) -> bool {
        let same = |a: &Made, b: &Made| a.asked == b.asked && a.is(&b.roots, b.code.frame());
        self.asked.get(..reached.asked) == other.asked.get(..reached.asked)
            && self.nodes.get(..reached.nodes) == other.nodes.get(..reached.nodes)
            && self.made.len() >= reached.made
            && self.made.iter().zip(&other.made[..reached.made]).all(|(a, b)| same(a, b))
    }

    /// Its beginning.
    pub fn until(&self, reached: &Reached) -> Self {
        Self {
            nodes: self.nodes[..reached.nodes].to_vec(),
            asked: self.asked[..reached.asked].to_vec(),
            made: self.made[..reached.made].to_vec(),
        }
    }

    fn bytes(&self) -> usize {
        let made = self.made.iter().map(|made| size_of_val(&made.roots[..]) + made.code.bytes());
        size_of_val(&self.nodes[..]) + size_of_val(&self.asked[..]) + made.sum::<usize>()
    }
}

/// What is kept, and what was recorded in all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Programs recorded since the process began.
    pub recorded: u64,
    /// Recordings kept.
    pub traces: usize,
    /// What these take of memory, about.
    pub bytes: usize,
}

impl Kept {
    /// As it is now.
    #[must_use]
    pub fn now() -> Self {
        let kept = lock(&KEPT);
        let traces = kept.as_deref().map_or(&[][..], |kept| kept);
        Self {
            recorded: RECORDED.load(Ordering::Relaxed),
            traces: traces.len(),
            bytes: traces.iter().map(|(_, trace)| trace.bytes()).sum(),
        }
    }
}

/// Counts a program.
pub(crate) fn count() {
    RECORDED.fetch_add(1, Ordering::Relaxed);
}

/// A key of what tells structures apart as a rule.
pub(crate) fn key(of: &impl Hash) -> u64 {
    let mut hasher = FxHasher::default();
    of.hash(&mut hasher);
    hasher.finish()
}

/// The recording of a key used last among those that suit.
pub(crate) fn find(key: u64, suits: impl Fn(&Trace) -> bool) -> Option<Arc<Trace>> {
    let mut kept = lock(&KEPT)?;
    let at = kept.iter().rposition(|(of, trace)| *of == key && suits(trace))?;
    kept[at..].rotate_left(1);
    kept.last().map(|(_, trace)| trace.clone())
}

/// Keeps a recording, and forgets those not used for longest.
pub(crate) fn keep(key: u64, trace: Trace) {
    let bytes = trace.bytes();
    if trace.made.is_empty() || bytes > LARGEST {
        return;
    }
    // Their memory is given back after the lock.
    let mut forgotten = Vec::new();
    let Some(mut kept) = lock(&KEPT) else { return };
    kept.push((key, Arc::new(trace)));
    let mut bytes: usize = kept.iter().map(|(_, trace)| trace.bytes()).sum();
    while kept.len() > MOST || bytes > LARGEST {
        let (_, oldest) = kept.remove(0);
        bytes -= oldest.bytes();
        forgotten.push(oldest);
    }
    drop(kept);
}
