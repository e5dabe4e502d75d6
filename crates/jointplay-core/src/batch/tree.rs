//! The linear equations of a mechanism with perfect joints, solved along a spanning tree of its bodies.
//!
//! A joint of the tree gives the twist of its outer body as that of the inner one and what the joint's free
//! components do; only the other joints, which close the loops, leave equations, and these for the free
//! components alone (relative coordinates; Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 8). The
//! transposed equations go the other way: forces of the loops first, then those of the tree by sums over
//! branches. With perfect joints on a closed pose the rows of a joint are unit screws, so that nothing else has
//! to be divided by; near one a Newton step by them still converges quadratically.
//!
//! Twists are told by the velocity at the origin of ground axes and the rotation, wrenches by the force and
//! the moment about it.

use super::symbol::Symbol;
use crate::joint::Frame;
use crate::linear::{Elimination, Factors};
use crate::mechanism::Mechanism;
use crate::real::Real;
use crate::solver::Solver;
use crate::space::{Component, Pose, Vec3, add, cross, dot, scale};

/// What solves the linearised closure, `J x = b`, and its transposed.
pub(super) trait Linear<'r> {
    /// Twists of all bodies for a right side per row; overwrites the right side.
    fn solve(&self, right: &mut [Symbol<'r>], twists: &mut [Symbol<'r>]);
    /// Multipliers of the rows for a cost per twist component; overwrites the cost.
    fn solve_transposed(&self, cost: &mut [Symbol<'r>], multipliers: &mut [Symbol<'r>]);
    /// Vanishes and changes sign with the determinant.
    fn pivot_product(&self) -> Symbol<'r>;
    /// An estimate of the smallest singular value of the length-scaled Jacobian from what a probe of the rows
    /// moves.
    fn singular_estimate(&self, m: &Mechanism) -> Symbol<'r>;
}

/// By a recorded elimination of all rows.
pub(super) struct Eliminated<'e, 'r> {
    pub plan: &'e Elimination,
    pub factors: Factors<Symbol<'r>>,
}

impl<'r> Linear<'r> for Eliminated<'_, 'r> {
    fn solve(&self, right: &mut [Symbol<'r>], twists: &mut [Symbol<'r>]) {
        self.plan.solve(&self.factors, right, twists);
    }

    fn solve_transposed(&self, cost: &mut [Symbol<'r>], multipliers: &mut [Symbol<'r>]) {
        self.plan.solve_transposed(&self.factors, cost, multipliers);
    }

    fn pivot_product(&self) -> Symbol<'r> {
        self.plan.pivot_product(&self.factors)
    }

    /// As [`Mechanism::singular_estimate`].
    fn singular_estimate(&self, m: &Mechanism) -> Symbol<'r> {
        let mut right: Vec<Symbol<'r>> = m.probe().map(Symbol::Constant).collect();
        let mut x = vec![Symbol::Constant(0.0); m.n_rows()];
        self.solve(&mut right, &mut x);
        let largest = x.iter().enumerate().fold(Symbol::Constant(0.0), |largest, (j, v)| {
            largest.max(v.abs() * Symbol::Constant(1.0 / m.unit(m.space.components()[j % m.size()])))
        });
        Symbol::Constant(1.0) / largest
    }
}

/// Two vectors: velocity and rotation, or force and moment.
type Screw<S> = [Vec3<S>; 2];

fn nothing<S: Real>() -> Screw<S> {
    [[S::from_f64(0.0); 3]; 2]
}

fn sum<S: Real>(a: Screw<S>, factor: S, b: Screw<S>) -> Screw<S> {
    [add(a[0], scale(b[0], factor)), add(a[1], scale(b[1], factor))]
}

fn power<S: Real>(wrench: Screw<S>, twist: Screw<S>) -> S {
    dot(wrench[0], twist[0]) + dot(wrench[1], twist[1])
}

/// A joint of the tree.
#[derive(Clone, Debug)]
struct Branch {
    joint: usize,
    inner: Option<usize>,
    outer: usize,
    /// 1 where the outer body is the joint's second one, else -1.
    sign: f64,
}

/// A spanning tree of a mechanism's bodies, rooted in the ground.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// From the ground outwards.
    branches: Vec<Branch>,
    /// The other joints.
    cuts: Vec<usize>,
    /// For every body the branches that lead to it.
    paths: Vec<Vec<usize>>,
    /// Held components of every joint, with their rows.
    held: Vec<Vec<(usize, Component)>>,
    /// The unknowns: branches with a free component each.
    free: Vec<(usize, Component)>,
}

/// Place and axes of a joint, and the moments of the axes about the origin.
struct Axes<S> {
    at: Vec3<S>,
    along: [Vec3<S>; 3],
    moment: [Vec3<S>; 3],
}

impl<S: Real> Axes<S> {
    fn twist(&self, component: Component) -> Screw<S> {
        match component {
            Component::Along(i) => [self.along[i], [S::from_f64(0.0); 3]],
            Component::About(i) => [self.moment[i], self.along[i]],
        }
    }

    fn wrench(&self, component: Component) -> Screw<S> {
        match component {
            Component::Along(i) => [self.along[i], self.moment[i]],
            Component::About(i) => [[S::from_f64(0.0); 3], self.along[i]],
        }
    }
}

/// An equation of a joint that closes a loop: a sum of rows, each with its weight.
struct LoopRow<S> {
    joint: usize,
    rows: Vec<(usize, S)>,
    wrench: Screw<S>,
}

/// The equations at a pose.
struct Equations<S> {
    axes: Vec<Axes<S>>,
    loops: Vec<LoopRow<S>>,
    /// Non-zeros: loop row, unknown, value.
    entries: Vec<(usize, usize, S)>,
}

impl Tree {
    /// The tree of shortest branches; `None` where a joint does not fit the equations.
    fn new(m: &Mechanism) -> Option<Self> {
        let mut held = vec![Vec::new(); m.n_joints()];
        for (number, row) in m.rows.iter().enumerate() {
            held[row.joint].push((number, row.component));
        }
        let is_free = |joint: usize, c: &Component| held[joint].iter().all(|(_, h)| h != c);
        let ends = |joint: usize| [m.joints[joint].first, m.joints[joint].second].map(|p| m.points[p].body);
        let mut paths: Vec<Option<Vec<usize>>> = vec![None; m.n_bodies()];
        let (mut branches, mut used): (Vec<Branch>, _) = (Vec::new(), vec![false; m.n_joints()]);
        let mut reached = vec![None];
        let mut next = 0;
        while next < reached.len() {
            let inner = reached[next];
            next += 1;
            for joint in 0..m.n_joints() {
                let [first, second] = ends(joint);
                let (outer, sign) = if first == inner { (second, 1.0) } else { (first, -1.0) };
                let Some(outer) = outer.filter(|_| first == inner || second == inner) else { continue };
                // A joint that holds nothing leads nowhere.
                if used[joint] || paths[outer].is_some() || held[joint].is_empty() {
                    continue;
                }
                used[joint] = true;
                let mut path = inner.and_then(|b| paths[b].clone()).unwrap_or_default();
                path.push(branches.len());
                paths[outer] = Some(path);
                branches.push(Branch { joint, inner, outer, sign });
                reached.push(Some(outer));
            }
        }
        // Rows in ground axes are screws only where the joint's two points stay together.
        let apart = |joint: usize| {
            let slides = m.space.components().iter().any(|c| matches!(c, Component::Along(_)) && is_free(joint, c));
            let driven =
                held[joint].iter().any(|&(r, c)| m.rows[r].drive.is_some() && matches!(c, Component::Along(_)));
            m.joints[joint].frame == Frame::Ground && ends(joint)[0].is_some() && (slides || driven)
        };
        if (0..m.n_joints()).any(apart) {
            return None;
        }
        let free = branches.iter().enumerate().flat_map(|(k, branch)| {
            let components = m.space.components().iter().filter(|c| is_free(branch.joint, c));
            components.map(move |c| (k, *c)).collect::<Vec<_>>()
        });
        let free = free.collect();
        let cuts = (0..m.n_joints()).filter(|&j| !used[j] && !held[j].is_empty()).collect();
        Some(Self { free, cuts, paths: paths.into_iter().collect::<Option<_>>()?, branches, held })
    }

    /// Sign of a branch's motion in that of the second body of a joint relative to the first.
    fn sign_in_loop(&self, m: &Mechanism, branch: usize, joint: usize) -> f64 {
        let passes = |point: usize| {
            let body = m.points[point].body;
            f64::from(u8::from(body.is_some_and(|b| self.paths[b].contains(&branch))))
        };
        let joint = &m.joints[joint];
        self.branches[branch].sign * (passes(joint.second) - passes(joint.first))
    }

    fn equations<S: Real>(&self, m: &Mechanism, poses: &[Pose<S>]) -> Equations<S> {
        let zeros = vec![S::from_f64(0.0); m.n_parameters()];
        let axes = (0..m.n_joints()).map(|number| {
            let joint = &m.joints[number];
            // A point of the ground is a constant; a joint that slides passes through its second one.
            let together = self.held[number]
                .iter()
                .filter(|(row, c)| matches!(c, Component::Along(_)) && m.rows[*row].drive.is_none());
            let stays = together.count() == m.n_translations();
            let on_ground = stays && m.points[joint.first].body.is_none();
            let at = m.place(if on_ground { joint.first } else { joint.second }, poses, &zeros).position;
            let along = m.axes(number, poses);
            Axes { at, along, moment: along.map(|axis| cross(at, axis)) }
        });
        let axes: Vec<Axes<S>> = axes.collect();
        let mut loops = Vec::new();
        for &joint in &self.cuts {
            loops.extend(self.loop_rows(m, joint, &axes[joint]));
        }
        let mut entries = Vec::new();
        for (k, row) in loops.iter().enumerate() {
            for (f, &(branch, component)) in self.free.iter().enumerate() {
                let sign = self.sign_in_loop(m, branch, row.joint);
                if sign != 0.0 {
                    let rate = power(row.wrench, axes[self.branches[branch].joint].twist(component));
                    entries.push((k, f, S::from_f64(sign) * rate));
                }
            }
        }
        Equations { axes, loops, entries }
    }

    /// The equations of a joint: where all translations or all rotations are held, along ground axes.
    fn loop_rows<S: Real>(&self, m: &Mechanism, joint: usize, axes: &Axes<S>) -> Vec<LoopRow<S>> {
        let (zero, one) = (S::from_f64(0.0), S::from_f64(1.0));
        let mut rows = Vec::new();
        for is_along in [true, false] {
            let of_kind = |c: &Component| matches!(c, Component::Along(_)) == is_along;
            let all = m.space.components().iter().filter(|c| of_kind(c)).count();
            let held: Vec<_> = self.held[joint].iter().filter(|(_, c)| of_kind(c)).copied().collect();
            if held.len() < all || all == 1 {
                let single =
                    |&(row, c): &(usize, Component)| LoopRow { joint, rows: vec![(row, one)], wrench: axes.wrench(c) };
                rows.extend(held.iter().map(single));
                continue;
            }
            for k in 0..all {
                let mut unit = [zero; 3];
                unit[k] = one;
                let weight = |&(row, c): &(usize, Component)| match c {
                    Component::Along(i) | Component::About(i) => (row, axes.along[i][k]),
                };
                let wrench = if is_along { [unit, cross(axes.at, unit)] } else { [[zero; 3], unit] };
                rows.push(LoopRow { joint, rows: held.iter().map(weight).collect(), wrench });
            }
        }
        rows
    }
}

/// The equations of a pose with their loops eliminated.
pub(super) struct OnTree<'m, 'r> {
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

    fn pivot_product(&self) -> Symbol<'r> {
        self.plan.pivot_product(&self.factors)
    }

    /// A singular pose is one of the loops: they are probed, and no body moves by more than all free components
    /// together.
    fn singular_estimate(&self, m: &Mechanism) -> Symbol<'r> {
        let probe: Vec<f64> = m.probe().collect();
        let of_row = |row: &LoopRow<Symbol<'r>>| Symbol::Constant(probe[row.rows[0].0]);
        let mut right: Vec<Symbol<'r>> = self.equations.loops.iter().map(of_row).collect();
        let mut free = vec![Symbol::Constant(0.0); right.len()];
        self.plan.solve(&self.factors, &mut right, &mut free);
        let moves = self.tree.free.iter().zip(&free);
        let all = moves.fold(Symbol::Constant(0.0), |all, ((_, component), v)| {
            all + v.abs() * Symbol::Constant(1.0 / m.unit(*component))
        });
        // A mechanism without loops is regular everywhere.
        if free.is_empty() { Symbol::Constant(1.0) } else { Symbol::Constant(1.0) / all }
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
