//! The linear equations of a mechanism with perfect joints, set up along a spanning tree of its bodies.
//!
//! A joint of the tree gives the twist of its outer body as that of the inner one and what the joint's free
//! components do; only the other joints, which close the loops, leave equations, and these for the free
//! components alone (relative coordinates; Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 8). The
//! transposed equations go the other way: forces of the loops first, then those of the tree by sums over
//! branches. With perfect joints on a closed pose the rows of a joint are unit screws, so that nothing else has
//! to be divided by; near one a Newton step by them still converges quadratically.
//!
//! Twists are given by the velocity at the origin of ground axes and the rotation, wrenches by the force and
//! the moment about it.

pub(crate) mod on_lanes;

use crate::math::real::Real;
use crate::math::space::{Component, Pose};
use crate::math::vector::{Vec3, add, cross, dot, scale};
use crate::mechanism::Mechanism;
use crate::mechanism::joint::Frame;

/// Two vectors: velocity and rotation, or force and moment.
pub(crate) type Screw<S> = [Vec3<S>; 2];

pub(crate) fn nothing<S: Real>() -> Screw<S> {
    [[S::from_f64(0.0); 3]; 2]
}

pub(crate) fn sum<S: Real>(a: Screw<S>, factor: S, b: Screw<S>) -> Screw<S> {
    [add(a[0], scale(b[0], factor)), add(a[1], scale(b[1], factor))]
}

pub(crate) fn power<S: Real>(wrench: Screw<S>, twist: Screw<S>) -> S {
    dot(wrench[0], twist[0]) + dot(wrench[1], twist[1])
}

/// A joint of the tree.
#[derive(Clone, Debug)]
pub(crate) struct Branch {
    pub joint: usize,
    pub inner: Option<usize>,
    pub outer: usize,
    /// 1 where the outer body is the joint's second one, else -1.
    pub sign: f64,
}

/// A spanning tree of a mechanism's bodies, rooted in the ground.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    /// From the ground outwards.
    pub branches: Vec<Branch>,
    /// The other joints.
    pub cuts: Vec<usize>,
    /// For every body the branches that lead to it.
    paths: Vec<Vec<usize>>,
    /// Held components of every joint, with their rows.
    pub held: Vec<Vec<(usize, Component)>>,
    /// The unknowns: branches with a free component each.
    pub free: Vec<(usize, Component)>,
}

/// Place and axes of a joint, and the moments of the axes about the origin.
pub(crate) struct Axes<S> {
    at: Vec3<S>,
    along: [Vec3<S>; 3],
    moment: [Vec3<S>; 3],
}

impl<S: Real> Axes<S> {
    pub(crate) fn twist(&self, component: Component) -> Screw<S> {
        match component {
            Component::Along(i) => [self.along[i], [S::from_f64(0.0); 3]],
            Component::About(i) => [self.moment[i], self.along[i]],
        }
    }

    pub(crate) fn wrench(&self, component: Component) -> Screw<S> {
        match component {
            Component::Along(i) => [self.along[i], self.moment[i]],
            Component::About(i) => [[S::from_f64(0.0); 3], self.along[i]],
        }
    }
}

/// An equation of a joint that closes a loop: a sum of rows, each with its weight.
pub(crate) struct LoopRow<S> {
    pub joint: usize,
    pub rows: Vec<(usize, S)>,
    pub wrench: Screw<S>,
}

/// The equations at a pose.
pub(crate) struct Equations<S> {
    pub axes: Vec<Axes<S>>,
    pub loops: Vec<LoopRow<S>>,
    /// Non-zeros: loop row, unknown, value.
    pub entries: Vec<(usize, usize, S)>,
}

impl Tree {
    /// The tree of shortest branches; `None` where a joint does not fit the equations.
    pub(crate) fn new(m: &Mechanism) -> Option<Self> {
        // A coupling is no component of its joint, a settled spin none along the joint's axes.
        if m.rows.iter().any(|row| row.is_coupled || m.joints[row.joint].is_apart(row.component)) {
            return None;
        }
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

    pub(crate) fn equations<S: Real>(&self, m: &Mechanism, poses: &[Pose<S>]) -> Equations<S> {
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
            let along = m.axes(number, poses, &zeros);
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
