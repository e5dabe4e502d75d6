//! The forces that decide where a load leaves the offsets.

use crate::clearance::offset::MAX_SIZE;
use crate::clearance::undecided::{UNDECIDED, Unforced};
use crate::closure::sensitivity::UNOBSERVABLE;
use crate::mechanism::{Mechanism, Source};

/// The forces along all parameters at a pose.
pub(crate) struct Pressing<F: Fn(usize) -> f64, M: Fn(usize) -> Unforced> {
    /// The force along a parameter.
    pub force: F,
    /// The size of all forces.
    pub scale: f64,
    /// What of a source the load does not push at the nominal pose.
    pub unforced: M,
}

impl Mechanism {
    /// Widens what every source leaves open in the output, tells which sources the load does not decide, and
    /// whether the output is moved by it.
    ///
    /// What is left open is observable where it moves the output to first order, both at the nominal pose, by the
    /// map `first_order`, and at the pose in question, by `map`, which tells the half-width; where one of
    /// them is zero the output moves in proportion to the square of the play. The maps take a component of
    /// the output and a parameter.
    pub(crate) fn leave_open<F: Fn(usize) -> f64, M: Fn(usize) -> Unforced>(
        &self,
        load: &Pressing<F, M>,
        first_order: impl Fn(usize, usize) -> f64,
        map: impl Fn(usize, usize) -> f64,
        open: &mut [f64],
        decided: &mut [bool],
    ) -> bool {
        let size = self.size();
        let row = |source: &Source, map: &dyn Fn(usize) -> f64| {
            let mut row = [0.0; MAX_SIZE];
            row.iter_mut().zip(source.range()).for_each(|(r, p)| *r = map(p));
            row
        };
        let mut reaches = [0.0; 6];
        for source in self.sources.iter().filter(|s| s.is_clearance) {
            for k in 0..size {
                reaches[k] += source.set.reach(&row(source, &|p| first_order(k, p))[..source.set.size()]);
            }
        }
        let mut observable = false;
        for (s, source) in self.sources.iter().enumerate().filter(|(_, s)| s.is_clearance) {
            let n = source.set.size();
            let force = source.set.masked_force(&row(source, &|p| (load.force)(p))[..n], (load.unforced)(s));
            let face = source.set.face(&force[..n], source.undecided(UNDECIDED * load.scale));
            decided[s] &= face.is_point();
            if face.is_point() {
                continue;
            }
            let width = |map: &dyn Fn(usize) -> f64| face.half_width(&row(source, map)[..n]);
            let widths: [f64; 6] = std::array::from_fn(|k| if k < size { width(&|p| map(k, p)) } else { 0.0 });
            let least = |k: usize| UNOBSERVABLE * reaches[k] + self.rounding_of_output(k);
            let moves = |k: usize| widths[k].min(width(&|p| first_order(k, p))) > least(k);
            for k in (0..size).filter(|&k| moves(k)) {
                observable = true;
                let share = &mut open[s * size + k];
                *share = share.max(widths[k]);
            }
        }
        observable
    }
}
