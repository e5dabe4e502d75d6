//! The linearised closure of a recorded pose, solved along the spanning tree.

use crate::closure::newton::Solver;
use crate::closure::recorded::elimination::Linear;
use crate::closure::tree::{Branch, Equations, Screw, Tree, nothing, power, sum};
use crate::math::space::{Component, Pose};
use crate::math::sparse::{Elimination, Factors};
use crate::math::vector::{Vec3, add, cross};
use crate::mechanism::Mechanism;
use crate::program::symbol::Symbol;

/// The equations of a pose with their loops eliminated.
pub(crate) struct OnTree<'m, 'r> {
    mechanism: &'m Mechanism,
    tree: Tree,
    equations: Equations<Symbol<'r>>,
    origins: Vec<Vec3<Symbol<'r>>>,
    plan: Elimination,
    factors: Factors<Symbol<'r>>,
}

impl<'m, 'r> OnTree<'m, 'r> {
    /// The equations at the poses of a program, planned where the solver's elimination is; `None` where
    /// the elimination of all rows suits it better.
    pub fn new(solver: &Solver<'m>, poses: &[Pose<Symbol<'r>>]) -> Option<Self> {
        let m = solver.mechanism;
        let tree = Tree::new(m)?;
        let equations = tree.equations(m, poses);
        let example = tree.equations(m, &m.poses(&solver.planned_at));
        let n = equations.loops.len();
        if n != tree.free.len() || equations.entries.len() > solver.picks.len() {
            return None;
        }
        let is_zero = |s: &Symbol<'_>| matches!(s, Symbol::Constant(c) if *c == 0.0);
        let kept: Vec<bool> = equations.entries.iter().map(|(_, _, s)| !is_zero(s)).collect();
        let pattern: Vec<_> = example.entries.iter().zip(&kept).filter(|(_, k)| **k).map(|(e, _)| *e).collect();
        let plan = Elimination::plan(n, &pattern)?;
        let entries = equations.entries.iter().zip(&kept).filter(|(_, k)| **k).map(|((_, _, s), _)| *s);
        let factors = plan.replay(entries, |_, _| true)?;
        let origins = poses.iter().map(|pose| pose.position).collect();
        Some(Self { mechanism: m, tree, equations, origins, plan, factors })
    }

    /// Twists of all bodies by the motions of the tree's joints, from the ground outwards: for every branch
    /// components with their rates.
    fn spread(&self, motions: impl Fn(usize, &Branch) -> Vec<(Component, Symbol<'r>)>) -> Vec<Screw<Symbol<'r>>> {
        let mut twists = vec![nothing(); self.mechanism.n_bodies()];
        for (k, branch) in self.tree.branches.iter().enumerate() {
            let axes = &self.equations.axes[branch.joint];
            let mut twist = branch.inner.map_or_else(nothing, |b| twists[b]);
            for (component, rate) in motions(k, branch) {
                twist = sum(twist, Symbol::Constant(branch.sign) * rate, axes.twist(component));
            }
            twists[branch.outer] = twist;
        }
        twists
    }

    /// The bodies of a joint with the sign of their twist in its rows.
    fn sides(&self, joint: usize) -> impl Iterator<Item = (usize, Symbol<'r>)> + use<'_, 'm, 'r> {
        let joint = &self.mechanism.joints[joint];
        let body = |point: usize, sign: f64| self.mechanism.points[point].body.map(|b| (b, Symbol::Constant(sign)));
        [body(joint.first, -1.0), body(joint.second, 1.0)].into_iter().flatten()
    }
}

impl<'r> Linear<'r> for OnTree<'_, 'r> {
    fn solve(&self, right: &mut [Symbol<'r>], x: &mut [Symbol<'r>]) {
        let zero = Symbol::Constant(0.0);
        let held = |_, branch: &Branch| self.tree.held[branch.joint].iter().map(|&(row, c)| (c, right[row])).collect();
        let carried = self.spread(held);
        let mut of_loops: Vec<Symbol<'r>> = Vec::with_capacity(self.equations.loops.len());
        for row in &self.equations.loops {
            let asked = row.rows.iter().fold(zero, |sum, &(r, weight)| sum + weight * right[r]);
            let done = self.sides(row.joint).fold(nothing(), |done, (b, sign)| sum(done, sign, carried[b]));
            of_loops.push(asked - power(row.wrench, done));
        }
        let mut free = vec![zero; of_loops.len()];
        self.plan.solve(&self.factors, &mut of_loops, &mut free);
        let size = self.mechanism.size();
        let moves = |k, _: &Branch| {
            let of_branch = self.tree.free.iter().zip(&free).filter(|((branch, _), _)| *branch == k);
            of_branch.map(|((_, component), rate)| (*component, *rate)).collect()
        };
        for (b, by_free) in self.spread(moves).into_iter().enumerate() {
            let [velocity, rotation] = sum(carried[b], Symbol::Constant(1.0), by_free);
            let at_origin = add(velocity, cross(rotation, self.origins[b]));
            for (k, component) in self.mechanism.space.components().iter().enumerate() {
                x[b * size + k] = match component {
                    Component::Along(i) => at_origin[*i],
                    Component::About(i) => rotation[*i],
                };
            }
        }
    }

    fn solve_transposed(&self, cost: &mut [Symbol<'r>], multipliers: &mut [Symbol<'r>]) {
        let zero = Symbol::Constant(0.0);
        let m = self.mechanism;
        let mut wrenches: Vec<Screw<Symbol<'r>>> = Vec::with_capacity(m.n_bodies());
        for (cost, origin) in cost.chunks_exact(m.size()).zip(&self.origins) {
            let [mut force, mut moment] = nothing();
            for (component, c) in m.space.components().iter().zip(cost) {
                match component {
                    Component::Along(i) => force[*i] = *c,
                    Component::About(i) => moment[*i] = *c,
                }
            }
            wrenches.push([force, add(moment, cross(*origin, force))]);
        }
        let gathered = self.gather(&wrenches);
        let push = |&(branch, component): &(usize, Component)| {
            let Branch { joint, outer, sign, .. } = self.tree.branches[branch];
            Symbol::Constant(sign) * power(gathered[outer], self.equations.axes[joint].twist(component))
        };
        let mut of_free: Vec<Symbol<'r>> = self.tree.free.iter().map(push).collect();
        let mut of_loops = vec![zero; of_free.len()];
        self.plan.solve_transposed(&self.factors, &mut of_free, &mut of_loops);
        for (row, &l) in self.equations.loops.iter().zip(&of_loops) {
            for &(r, weight) in &row.rows {
                multipliers[r] = multipliers[r] + weight * l;
            }
        }
        // The wrench of all rows of a cut joint at once.
        for &joint in &self.tree.cuts {
            let of_joint = self.equations.loops.iter().zip(&of_loops).filter(|(row, _)| row.joint == joint);
            let wrench = of_joint.fold(nothing(), |wrench, (row, &l)| sum(wrench, l, row.wrench));
            for (b, sign) in self.sides(joint) {
                wrenches[b] = sum(wrenches[b], -sign, wrench);
            }
        }
        let gathered = self.gather(&wrenches);
        for branch in &self.tree.branches {
            let (axes, sign) = (&self.equations.axes[branch.joint], Symbol::Constant(branch.sign));
            for &(row, component) in &self.tree.held[branch.joint] {
                multipliers[row] = sign * power(gathered[branch.outer], axes.twist(component));
            }
        }
    }

    fn eliminated(&self) -> (&Elimination, &Factors<Symbol<'r>>) {
        (&self.plan, &self.factors)
    }

    /// Without loops.
    fn is_regular_everywhere(&self) -> bool {
        self.tree.free.is_empty()
    }
}

impl<'r> OnTree<'_, 'r> {
    /// Wrenches on every body and all that it carries.
    fn gather(&self, wrenches: &[Screw<Symbol<'r>>]) -> Vec<Screw<Symbol<'r>>> {
        let mut gathered = wrenches.to_vec();
        for branch in self.tree.branches.iter().rev() {
            if let Some(inner) = branch.inner {
                gathered[inner] = sum(gathered[inner], Symbol::Constant(1.0), gathered[branch.outer]);
            }
        }
        gathered
    }
}
