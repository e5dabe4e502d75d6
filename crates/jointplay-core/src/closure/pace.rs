//! The rules of a continuation, plainly and on lanes: which Newton steps converge on the branch that they come from, and in
//! which parts a way is gone.

/// Newton steps per solve.
pub(crate) const NEWTON_STEPS: usize = 14;
/// A Newton step (length-scaled) below this is the last: the next would be its square.
const LAST_STEP: f64 = 1e-9;
/// The largest move (length-scaled; radians) taken at once, so that the branch is not left.
const LARGEST_MOVE: f64 = 0.35;
/// Continuation gives up when a step of this part of the way, or of a radian of a drive that turns farther, fails.
const SMALLEST_PART: f64 = 1e-6;

/// Sizes of the steps of one Newton solve.
#[derive(Clone, Debug, Default)]
pub(crate) struct Moves {
    n: usize,
    first: f64,
    last: f64,
    /// Sum of all but the first.
    later: f64,
}

impl Moves {
    /// Takes notice of a step; tells whether it is the last one. `None` where the steps do not converge.
    pub fn add(&mut self, size: f64) -> Option<bool> {
        let grows = self.n > 0 && size > 2.0 * self.last && size > LAST_STEP;
        // Written so that NaN fails, too.
        if !(size <= LARGEST_MOVE) || grows {
            return None;
        }
        if self.n == 0 {
            self.first = size;
        } else {
            self.later += size;
        }
        self.n += 1;
        self.last = size;
        let converged = size < LAST_STEP;
        (converged || self.n < NEWTON_STEPS).then_some(converged)
    }

    /// Whether steps that have converged stay on the branch; `crossed` where the determinant has changed its sign.
    pub fn keep_branch(&self, crossed: bool) -> bool {
        let calm = self.later <= 0.5 * self.first + LAST_STEP;
        // A singular state may be crossed where the branch goes straight on (a change point), which
        // shows in corrections that are small beside the move.
        let straight = self.later <= 0.02 * self.first;
        calm && (!crossed || straight)
    }
}

/// The parts of a way: halved where one fails, doubled where it does not.
#[derive(Clone, Debug)]
pub(crate) struct Parts {
    most: f64,
    /// What has been gone.
    pub done: f64,
    part: f64,
}

impl Parts {
    /// Of a way that may be gone in parts up to this.
    pub const fn new(most: f64) -> Self {
        Self { most, done: 0.0, part: most }
    }

    /// Where the next part ends; `None` where the way does.
    pub fn next(&self) -> Option<f64> {
        let at = self.done + self.part;
        (at < 1.0).then_some(at)
    }

    /// The part has been gone.
    pub fn reached(&mut self) {
        self.done += self.part;
        self.part = (2.0 * self.part).min(self.most);
    }

    /// The part cannot be gone; tells whether a smaller one is left to try.
    pub fn failed(&mut self) -> bool {
        self.part *= 0.5;
        self.part >= SMALLEST_PART * self.most
    }
}
