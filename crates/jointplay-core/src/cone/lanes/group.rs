//! Eight programs from the arrays of the caller into coordinates without units, and their answers back.

use crate::clearance::Set;
use crate::cone::Kind;
use crate::cone::bodies::Own;
use crate::cone::lanes::cones::{n_sizes, size_of};
use crate::cone::lanes::kernel::Solve;
use crate::cone::lanes::layout::{Layout, Part, Question};
use crate::cone::lanes::programs::Programs;
use crate::cone::lanes::state::{Data, State};
use crate::cone::lanes::vector::{LANES, V, dot};
use crate::math::lanes::simd::Kernel;

/// Memory for eight programs, and what they have become.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    pub data: Data,
    pub state: State,
    /// What the coordinates displace, term by term.
    pub columns: Vec<V>,
    /// Coefficients of all components, one independent equation after the other.
    pub rows: Vec<V>,
    pub forces: Vec<V>,
    /// The springs' coefficients and what their compliances make of them; and of the forces.
    pub elastic: Vec<V>,
    pub yielding: Vec<V>,
    pub given: Vec<V>,
    pub compliances: Vec<V>,
    pub scales: Vec<V>,
    pub energy: V,
    /// Unit of the factor on the clearances.
    pub unit: V,
    /// Work of the load on the springs alone, without units.
    pub rest: V,
    /// Multipliers of the independent equations.
    pub multipliers: Vec<V>,
    /// Displacements of all components.
    pub displacements: Vec<V>,
    pub factor: V,
    pub value: V,
    pub dual_value: V,
    pub gap: V,
    /// The largest residual of an independent equation, as a part of its reach.
    pub residual: V,
}

/// Eight programs to solve, which fit the layout.
pub(super) struct Group<'a> {
    pub layout: &'a Layout,
    pub programs: &'a Programs<'a>,
    /// Their numbers.
    pub numbers: [usize; LANES],
    pub memory: &'a mut Memory,
}

/// One number of each program.
#[inline(always)]
fn take(numbers: &[usize; LANES], array: &[f64], stride: usize, at: usize) -> V {
    let mut out = [0.0; LANES];
    for (out, number) in out.iter_mut().zip(numbers) {
        *out = array[number * stride + at];
    }
    V(out)
}

/// `a` where it is above zero, else `b`.
#[inline(always)]
pub(super) fn positive(a: V, b: V) -> V {
    a.where_else(V::ZERO.below(a), b)
}

impl Kernel for Group<'_> {
    type Output = usize;

    #[inline(always)]
    fn run(mut self) -> usize {
        self.load_sets();
        self.load_rows();
        if self.layout.question == Question::Pose {
            self.load_springs();
        }
        self.scale();
        let Memory { data, state, .. } = &mut *self.memory;
        let variable = self.layout.question == Question::Assembly;
        let iterations = Solve { cones: &self.layout.cones, data, state, variable }.run();
        self.judge();
        self.unload();
        iterations
    }
}

impl Group<'_> {
    /// The set of a block in each program.
    #[inline(always)]
    fn own(&self, block: usize) -> [Own; LANES] {
        let own = |number: usize| match &self.programs.kinds(number)[block] {
            Kind::Clearance(set) | Kind::Fixed(set) => Own::of(set),
            Kind::Spring(_) => Own::of(&Set::Interval { low: 0.0, high: 0.0 }),
        };
        if self.programs.share_kinds() { [own(0); LANES] } else { self.numbers.map(own) }
    }

    #[inline(always)]
    fn load_sets(&mut self) {
        let layout = self.layout;
        self.memory.columns.clear();
        self.memory.data.sizes.clear();
        for (block, place) in layout.places.iter().enumerate() {
            let Part::Offsets { terms, .. } = &place.part else { continue };
            let owns = self.own(block);
            for (coordinate, component) in terms {
                let column = V(std::array::from_fn(|lane| owns[lane].columns()[*coordinate][*component]));
                self.memory.columns.push(column);
            }
            for k in 0..3 {
                let Some(atom) = owns[0].atom(k) else { break };
                for at in 0..n_sizes(atom) {
                    let sizes = owns.map(|own| own.atom(k).map_or(1.0, |atom| size_of(atom, at)));
                    self.memory.data.sizes.push(V(sizes));
                }
            }
        }
    }

    /// Coefficients, right sides and forces.
    #[inline(always)]
    fn load_rows(&mut self) {
        let (layout, programs, memory) = (self.layout, self.programs, &mut *self.memory);
        let (width, s) = (layout.width, programs.n_equations);
        let data = &mut memory.data;
        (data.s, data.n) = (layout.rows.len(), layout.n);
        memory.rows.clear();
        data.right.clear();
        for &i in &layout.rows {
            for c in 0..width {
                memory.rows.push(take(&self.numbers, &programs.maps, s * width, i * width + c));
            }
            data.right.push(take(&self.numbers, &programs.rights, s, i));
        }
        memory.forces.clear();
        for c in 0..width {
            memory.forces.push(take(&self.numbers, &programs.forces, width, c));
        }
        data.e.clear();
        data.e.resize(data.s * data.n, V::ZERO);
        data.cost.clear();
        data.cost.resize(data.n, V::ZERO);
        let mut columns = memory.columns.iter();
        for place in &layout.places {
            let Part::Offsets { first, terms } = &place.part else { continue };
            for ((coordinate, component), column) in terms.iter().zip(&mut columns) {
                let (k, c) = (first + coordinate, place.first + component);
                for i in 0..data.s {
                    data.e[i * data.n + k] = memory.rows[i * width + c].times_plus(*column, data.e[i * data.n + k]);
                }
                data.cost[k] = memory.forces[c].times_from(*column, data.cost[k]);
            }
        }
    }

    /// What the springs add to the normal equations, and what the load makes of them alone.
    #[inline(always)]
    fn load_springs(&mut self) {
        let (layout, programs, numbers) = (self.layout, self.programs, self.numbers);
        let memory = &mut *self.memory;
        let (s, width) = (memory.data.s, layout.width);
        for array in [&mut memory.elastic, &mut memory.yielding, &mut memory.given, &mut memory.compliances] {
            array.clear();
        }
        let springs = || layout.places.iter().enumerate().filter(|(_, place)| matches!(place.part, Part::Spring));
        memory.rest = V::ZERO;
        for (block, place) in springs() {
            let from = memory.compliances.len();
            for k in 0..place.size * place.size {
                let mut one = [0.0; LANES];
                for (one, number) in one.iter_mut().zip(numbers) {
                    if let Kind::Spring(compliance) = &programs.kinds(number)[block] {
                        *one = compliance[k];
                    }
                }
                memory.compliances.push(V(one));
            }
            let force = &memory.forces[place.first..place.first + place.size];
            for k in 0..place.size {
                let row = &memory.compliances[from + k * place.size..from + (k + 1) * place.size];
                let given = dot(row, force);
                memory.rest = (V::splat(0.5) * given).times_plus(force[k], memory.rest);
                memory.given.push(given);
            }
        }
        for i in 0..s {
            let mut from = 0;
            for (_, place) in springs() {
                let row = &memory.rows[i * width + place.first..i * width + place.first + place.size];
                memory.elastic.extend_from_slice(row);
                for _ in 0..place.size {
                    memory.yielding.push(dot(&memory.compliances[from..from + place.size], row));
                    from += place.size;
                }
            }
        }
        let n = memory.given.len();
        memory.data.springs.clear();
        if n == 0 {
            return;
        }
        for i in 0..s {
            let (own, yielding) = (&memory.elastic[i * n..(i + 1) * n], &memory.yielding[i * n..(i + 1) * n]);
            memory.data.right[i] = memory.data.right[i] - dot(own, &memory.given);
            for j in 0..s {
                memory.data.springs.push(dot(yielding, &memory.elastic[j * n..(j + 1) * n]));
            }
        }
    }

    /// Takes the units out, as `standard` does.
    #[inline(always)]
    fn scale(&mut self) {
        let memory = &mut *self.memory;
        let data = &mut memory.data;
        let (s, n) = (data.s, data.n);
        let reach = |row: &[V]| {
            let mut sum = V::ZERO;
            for e in row {
                sum = sum + e.abs();
            }
            sum
        };
        let pose = self.layout.question == Question::Pose;
        memory.energy = V::ONE;
        if pose {
            let mut work = memory.rest + memory.rest;
            let (mut excess, mut all) = (V::ZERO, V::ZERO);
            for cost in &data.cost {
                work = cost.abs().max(work);
            }
            if !data.springs.is_empty() {
                for i in 0..s {
                    let right = data.right[i].abs();
                    let give = data.springs[i * s + i];
                    let left = (right - reach(&data.e[i * n..(i + 1) * n])).max(V::ZERO);
                    let stored = |left: V| V::ZERO.where_else(give.below(V::splat(1e-300)), left * left / give);
                    excess = stored(left).max(excess);
                    all = stored(right).max(all);
                }
            }
            memory.energy = positive(work.max(excess), positive(all, V::ONE));
        }
        let (energy, per_energy) = (memory.energy, V::ONE / memory.energy);
        memory.scales.clear();
        for i in 0..s {
            let mut scale = reach(&data.e[i * n..(i + 1) * n]);
            if !data.springs.is_empty() {
                scale = scale + (data.springs[i * s + i] * energy).sqrt();
            }
            let scale = positive(scale, V::ONE);
            let per = V::ONE / scale;
            for e in &mut data.e[i * n..(i + 1) * n] {
                *e = *e * per;
            }
            data.right[i] = data.right[i] * per;
            memory.scales.push(scale);
        }
        if !data.springs.is_empty() {
            for i in 0..s {
                for j in 0..s {
                    let scales = memory.scales[i] * memory.scales[j];
                    data.springs[i * s + j] = data.springs[i * s + j] * energy / scales;
                }
            }
        }
        for cost in &mut data.cost {
            *cost = *cost * per_energy;
        }
        memory.rest = memory.rest * per_energy;
        memory.unit = V::ONE;
        if !pose {
            data.springs.clear();
            let mut largest = V::ZERO;
            for right in &data.right {
                largest = right.abs().max(largest);
            }
            let fixed = self.layout.cones.iter().any(|cone| !cone.scaled);
            memory.unit = positive(if fixed { largest.max(V::ONE) } else { largest }, V::ONE);
            let per = V::ONE / memory.unit;
            for right in &mut data.right {
                *right = *right * per;
            }
            for cone in self.layout.cones.iter().filter(|cone| !cone.scaled) {
                for at in cone.size..cone.size + cone.lengths() {
                    data.sizes[at] = data.sizes[at] * per;
                }
            }
            data.cost.fill(V::ZERO);
        }
    }
}
