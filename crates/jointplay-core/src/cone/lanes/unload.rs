//! Values, residuals and answers of eight programs, from coordinates without units.

use crate::cone::lanes::group::{Group, positive};
use crate::cone::lanes::layout::{Part, Question};
use crate::cone::lanes::normal::add_transposed;
use crate::cone::lanes::vector::{V, dot};

impl Group<'_> {
    /// Primal and dual value, without units, and the residuals.
    #[inline(always)]
    pub fn judge(&mut self) {
        let memory = &mut *self.memory;
        let (data, state) = (&memory.data, &mut memory.state);
        let (n, s) = (data.n, data.s);
        let mut residual = V::ZERO;
        let mut stored = V::ZERO;
        for i in 0..s {
            let mut left = data.right[i] - dot(&data.e[i * n..(i + 1) * n], &state.p);
            if !data.springs.is_empty() {
                let give = dot(&data.springs[i * s..(i + 1) * s], &state.y);
                left = left - give;
                stored = (V::splat(0.5) * state.y[i]).times_plus(give, stored);
            }
            residual = left.abs().max(residual);
        }
        let work = dot(&data.right, &state.y);
        for (force, cost) in state.force.iter_mut().zip(&data.cost) {
            *force = -*cost;
        }
        add_transposed(&data.e, &state.y, &mut state.force);
        let (mut scaled, mut fixed) = (V::ZERO, V::ZERO);
        for cone in &self.layout.cones {
            let sizes = &data.sizes[cone.size..cone.size + cone.sizes()];
            let support = cone.support(sizes, &state.force[cone.first..cone.first + cone.dimension()]);
            *(if cone.scaled { &mut scaled } else { &mut fixed }) =
                if cone.scaled { scaled + support } else { fixed + support };
        }
        let mut size = V::ONE;
        if self.layout.question == Question::Pose {
            memory.value = dot(&data.cost, &state.p) + stored - memory.rest;
            memory.dual_value = work - fixed - stored - memory.rest;
        } else {
            let bound = (work - fixed).max(V::ZERO);
            let per = V::ONE / positive(scaled, V::ONE);
            memory.value = state.factor;
            memory.dual_value = bound * per;
            for y in &mut state.y {
                *y = *y * per;
            }
            // A factor of zero, where fixed sets take all, is as exact as the lack of fit allows.
            size = V::ONE / memory.unit.max(V::ONE);
        }
        let size = size.max(memory.value.abs()).max(memory.dual_value.abs());
        memory.gap = (memory.value - memory.dual_value).abs() / size;
        memory.residual = residual;
    }

    /// Puts the units back.
    #[inline(always)]
    pub fn unload(&mut self) {
        let (layout, memory) = (self.layout, &mut *self.memory);
        let (data, state) = (&memory.data, &memory.state);
        let width = layout.width;
        memory.multipliers.clear();
        for i in 0..data.s {
            memory.multipliers.push(memory.energy * state.y[i] / memory.scales[i]);
        }
        memory.displacements.clear();
        memory.displacements.resize(width, V::ZERO);
        let mut columns = memory.columns.iter();
        let mut from = 0;
        for place in &layout.places {
            match &place.part {
                Part::Offsets { first, terms } => {
                    for ((coordinate, component), column) in terms.iter().zip(&mut columns) {
                        let at = &mut memory.displacements[place.first + component];
                        *at = (memory.unit * *column).times_plus(state.p[first + coordinate], *at);
                    }
                }
                Part::Spring => {
                    memory.given.resize(place.size, V::ZERO);
                    for (k, reaction) in memory.given.iter_mut().enumerate() {
                        *reaction = memory.forces[place.first + k];
                        for i in 0..data.s {
                            let a = memory.rows[i * width + place.first + k];
                            *reaction = a.times_plus(memory.multipliers[i], *reaction);
                        }
                    }
                    for k in 0..place.size {
                        memory.displacements[place.first + k] =
                            dot(&memory.compliances[from..from + place.size], &memory.given);
                        from += place.size;
                    }
                }
                Part::Rigid => {}
            }
        }
        let unit = if layout.question == Question::Pose { memory.energy } else { memory.unit };
        memory.factor = if layout.question == Question::Pose { V::ONE } else { unit * state.factor };
        memory.value = unit * memory.value;
        memory.dual_value = unit * memory.dual_value;
    }
}
