//! One step of Newton's iteration, recorded.

use crate::closure::newton::Solver;
use crate::closure::recorded::elimination::{Eliminated, Linear};
use crate::closure::recorded::layout::Symbolic;
use crate::math::space::{Component, Pose};
use crate::mechanism::{Mechanism, Row};
use crate::program::symbol::Symbol;

/// What one recorded step gives.
pub(crate) struct Step<'e, 'r> {
    pub numbers: Vec<Symbol<'r>>,
    /// How far the output's body has turned.
    pub turn: Vec<Symbol<'r>>,
    /// Square of the largest component of the step, length-scaled.
    pub size: Symbol<'r>,
    /// The step of all bodies.
    pub twists: Vec<Symbol<'r>>,
    pub pivots: Symbol<'r>,
    pub residual: Vec<Symbol<'r>>,
    pub linear: Eliminated<'e, 'r>,
}

/// Residual and derivatives.
pub(crate) fn evaluate<'r>(m: &Mechanism, symbolic: &Symbolic<'r>) -> [Vec<Symbol<'r>>; 2] {
    let zero = Symbol::Constant(0.0);
    let numbers = symbolic.numbers.chunks_exact(m.space.n_pose_numbers());
    let poses: Vec<Pose<Symbol<'r>>> = numbers.map(|n| m.space.pose_of_numbers(n)).collect();
    let mut residual = vec![zero; m.n_rows()];
    let mut derivatives = vec![zero; m.n_derivatives()];
    m.evaluate(&poses, &symbolic.inputs, &mut residual, &mut derivatives);
    [residual, derivatives]
}

pub(crate) fn record_step<'e, 'r>(
    solver: &'e Solver<'_>,
    symbolic: &Symbolic<'r>,
    turn: &[Symbol<'r>],
) -> Option<Step<'e, 'r>> {
    let evaluated = evaluate(solver.mechanism, symbolic);
    record_step_by(solver, symbolic, evaluated, turn)
}

/// A step by a residual and derivatives, which may be those of nearby parameters.
pub(crate) fn record_step_by<'e, 'r>(
    solver: &'e Solver<'_>,
    symbolic: &Symbolic<'r>,
    [residual, derivatives]: [Vec<Symbol<'r>>; 2],
    turn: &[Symbol<'r>],
) -> Option<Step<'e, 'r>> {
    let m = solver.mechanism;
    if !m.is_recordable() {
        return None;
    }
    let plan = solver.plan.as_ref()?;
    let factors = plan.replay(solver.picks.iter().map(|&p| derivatives[p]), |_, _| true)?;
    let linear = Eliminated { plan, factors };
    let Moved { numbers, turn, size, twists } = step_by(m, symbolic, &residual, &linear, turn);
    Some(Step { numbers, turn, size, twists, pivots: linear.pivot_product(), residual, linear })
}

/// Numbers that are zero, or none where the flanks of a coupling would pass through each other.
fn jams<'r>(m: &Mechanism, symbolic: &Symbolic<'r>) -> Vec<Symbol<'r>> {
    let numbers = symbolic.numbers.chunks_exact(m.space.n_pose_numbers());
    let poses: Vec<Pose<Symbol<'r>>> = numbers.map(|n| m.space.pose_of_numbers(n)).collect();
    let parameters = &symbolic.inputs.parameters;
    let taken = m.flanks().filter(|row| matches!(row.displaced(parameters), Symbol::Node(..)));
    let jam = |row: &Row| {
        let gap = m.coupled_row(row, &poses, parameters, &[]).gap;
        let size = gap.abs();
        (gap + size) / (size + gap) - Symbol::Constant(1.0)
    };
    taken.map(jam).collect()
}

/// A pose after a Newton step.
pub(crate) struct Moved<'r> {
    pub numbers: Vec<Symbol<'r>>,
    /// What the output's body has turned.
    pub turn: Vec<Symbol<'r>>,
    /// Square of the step's largest component, length-scaled.
    pub size: Symbol<'r>,
    /// The step of all bodies.
    pub twists: Vec<Symbol<'r>>,
}

pub(crate) fn step_by<'r>(
    m: &Mechanism,
    symbolic: &Symbolic<'r>,
    residual: &[Symbol<'r>],
    linear: &impl Linear<'r>,
    turn: &[Symbol<'r>],
) -> Moved<'r> {
    let zero = Symbol::Constant(0.0);
    let width = m.space.n_pose_numbers();
    let mut right: Vec<Symbol<'r>> = residual.iter().map(|&r| -r).collect();
    let mut step = vec![zero; m.n_unknowns()];
    linear.solve(&mut right, &mut step);

    // The largest, not the sum: a step is small or large however many bodies take part in it.
    let (mut moved, mut turned) = (zero, zero);
    let mut known: Vec<(usize, &Symbol<'r>)> = step.iter().enumerate().collect();
    known.sort_by_key(|(_, s)| s.recorded());
    for (j, s) in known {
        match m.space.components()[j % m.size()] {
            Component::Along(_) => moved = moved.max(*s * *s),
            Component::About(_) => turned = turned.max(*s * *s),
        }
    }
    let size = turned.max((moved * Symbol::Constant(1.0 / (m.length * m.length))).abs());
    let size = jams(m, symbolic).into_iter().fold(size, |size, jam| size + jam);
    let bodies = symbolic.numbers.chunks_exact(width).zip(step.chunks_exact(m.size()));
    let numbers = bodies.flat_map(|(n, s)| m.space.move_numbers(n, s)).collect();
    Moved { numbers, turn: m.move_turn_numbers(turn, &step), size, twists: step }
}
