//! Programs without units: coordinates, equations and energies scaled to sizes near one.
//!
//! Offsets are measured in the largest values of their components, equations in what the blocks reach
//! in them, energies in what the load can do within the sets. Equations that others imply, as far as
//! anything can move in them, are left out; they are consistent or the program is infeasible.

use nalgebra::{DMatrix, DVector};

use crate::cone::sets::Region;
use crate::cone::{Block, Kind, Program, Springs, springs};

/// A row whose part that is independent of the rows before is smaller than this is implied by them.
pub(super) const DEPENDENT: f64 = 1e-10;
/// Residual of an implied equation, as a part of its reach, up to which it is consistent.
const CONSISTENT: f64 = 1e-9;
/// Displacement (metres, radians) that rounding leaves when a mechanism is closed.
pub(super) const ROUNDING: f64 = 1e-13;

/// What the coordinates of a block are.
#[derive(Clone, Debug)]
pub(super) enum Body {
    /// Coordinates of a set, and whether the factor on the clearances scales it.
    Offsets { region: Region, scaled: bool },
    /// The deformation that each coordinate gives.
    Deformation(Vec<Vec<f64>>),
}

/// The coordinates of one block and the number of the first.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub body: Body,
    pub first: usize,
}

impl Part {
    pub const fn count(&self) -> usize {
        match &self.body {
            Body::Offsets { region, .. } => region.basis.len(),
            Body::Deformation(columns) => columns.len(),
        }
    }

    /// Coefficients of the coordinates in a linear function of the block's displacements.
    fn coefficients(&self, row: &[f64]) -> Vec<f64> {
        let along = |column: &[f64]| row.iter().zip(column).map(|(a, b)| a * b).sum();
        match &self.body {
            Body::Offsets { region, .. } => region.columns().map(|column| along(&column)).collect(),
            Body::Deformation(columns) => columns.iter().map(|column| along(column)).collect(),
        }
    }

    /// The block's displacements at coordinates of the whole program.
    pub fn displacement(&self, x: &[f64], size: usize) -> Vec<f64> {
        let own = &x[self.first..self.first + self.count()];
        match &self.body {
            Body::Offsets { region, .. } => region.offset(own)[..size].to_vec(),
            Body::Deformation(columns) => {
                (0..size).map(|i| columns.iter().zip(own).map(|(c, x)| c[i] * x).sum()).collect()
            }
        }
    }
}

/// A program without units.
#[derive(Clone, Debug)]
pub(super) struct Standard {
    pub parts: Vec<Part>,
    /// Number of coordinates.
    pub n: usize,
    /// The independent equations: their numbers, coefficients and right sides.
    pub rows: Vec<usize>,
    pub matrix: Vec<Vec<f64>>,
    pub right: Vec<f64>,
    /// What every equation was divided by.
    pub scales: Vec<f64>,
    /// The unit of energy.
    pub energy: f64,
    /// Whether the squares of all coordinates count.
    pub central: bool,
    /// Whether the equations that were left out hold.
    pub consistent: bool,
}

/// What the compliance of a block makes of its forces; nothing where the block is none.
fn columns_of(block: &Block) -> Vec<Vec<f64>> {
    match &block.kind {
        // What is not positive semidefinite has been refused where it came in.
        Kind::Spring(compliance) => springs::factor(compliance, block.size()).unwrap_or_default(),
        Kind::Clearance(_) | Kind::Fixed(_) => Vec::new(),
    }
}

impl Standard {
    /// The program of the pose.
    pub fn pose(program: &Program) -> Self {
        let mut standard = Self::gather(program, columns_of);
        standard.energy = standard.unit_of_energy(program);
        let root = standard.energy.sqrt();
        for part in &mut standard.parts {
            if let Body::Deformation(columns) = &mut part.body {
                columns.iter_mut().flatten().for_each(|c| *c *= root);
            }
        }
        standard.with_equations(program, &program.right)
    }

    /// The program of assemblability.
    pub fn assembly(program: &Program, springs: Springs) -> Self {
        let columns = |block: &Block| if springs == Springs::Free { columns_of(block) } else { Vec::new() };
        Self::gather(program, columns).with_equations(program, &program.right)
    }

    /// A program with the sets of its blocks replaced and what is elastic held as it is.
    pub fn within(program: &Program, mut regions: impl Iterator<Item = Region>, right: &[f64]) -> Self {
        let mut standard = Self::gather(program, |_| Vec::new());
        let mut n = 0;
        for part in &mut standard.parts {
            if let Body::Offsets { region, .. } = &mut part.body
                && let Some(other) = regions.next()
            {
                *region = other;
            }
            part.first = n;
            n += part.count();
        }
        standard.n = n;
        standard.with_equations(program, right)
    }

    fn gather(program: &Program, columns: impl Fn(&Block) -> Vec<Vec<f64>>) -> Self {
        let mut n = 0;
        let parts = program.blocks.iter().map(|block| {
            let body = match &block.kind {
                Kind::Clearance(set) => Body::Offsets { region: Region::of(set), scaled: true },
                Kind::Fixed(set) => Body::Offsets { region: Region::of(set), scaled: false },
                Kind::Spring(_) => Body::Deformation(columns(block)),
            };
            let part = Part { body, first: n };
            n += part.count();
            part
        });
        let parts = parts.collect();
        Self {
            parts,
            n,
            rows: Vec::new(),
            matrix: Vec::new(),
            right: Vec::new(),
            scales: Vec::new(),
            energy: 1.0,
            central: false,
            consistent: true,
        }
    }

    /// What the load can do within the sets and on the springs; where it does little, what the springs
    /// have to store for the equations that clearances alone cannot fulfil.
    fn unit_of_energy(&self, program: &Program) -> f64 {
        let force = |k: usize| program.blocks[k].force.as_slice();
        let work: f64 = (0..self.parts.len())
            .map(|k| {
                let part = &self.parts[k];
                let along = part.coefficients(force(k));
                match part.body {
                    Body::Offsets { .. } => along.iter().fold(0.0, |most: f64, w| most.max(w.abs())),
                    Body::Deformation(_) => along.iter().map(|w| w * w).sum(),
                }
            })
            .fold(0.0, f64::max);
        let stored = |excess: bool| {
            let rows = self.raw_rows(program).zip(&program.right);
            rows.map(|(row, b)| {
                let (mut reach, mut give) = (0.0, 0.0);
                for part in &self.parts {
                    let own = &row[part.first..part.first + part.count()];
                    match part.body {
                        Body::Offsets { .. } => reach += own.iter().map(|a| a.abs()).sum::<f64>(),
                        Body::Deformation(_) => give += own.iter().map(|a| a * a).sum::<f64>(),
                    }
                }
                let left = if excess { (b.abs() - reach).max(0.0) } else { b.abs() };
                if give > 0.0 { left * left / give } else { 0.0 }
            })
            .fold(0.0, f64::max)
        };
        [work.max(stored(true)), stored(false)].into_iter().find(|e| *e > 0.0).unwrap_or(1.0)
    }

    /// Coefficients of the coordinates in the equations.
    fn raw_rows(&self, program: &Program) -> impl Iterator<Item = Vec<f64>> {
        (0..program.n_equations()).map(|i| {
            let parts = self.parts.iter().zip(&program.blocks);
            parts.flat_map(|(part, block)| part.coefficients(block.row(i))).collect()
        })
    }

    /// Scales the equations, puts the independent ones in place and tells whether the others hold.
    fn with_equations(mut self, program: &Program, right: &[f64]) -> Self {
        let mut rows: Vec<Vec<f64>> = self.raw_rows(program).collect();
        let mut right = right.to_vec();
        let mut allowed = Vec::with_capacity(rows.len());
        for (i, (row, b)) in rows.iter_mut().zip(&mut right).enumerate() {
            let size = |row: &[f64]| row.iter().map(|a| a.abs()).sum::<f64>();
            let reach = size(row);
            let all: f64 = program.blocks.iter().map(|block| size(block.row(i))).sum();
            let scale = [reach, all].into_iter().find(|s| *s > 0.0).unwrap_or(1.0);
            for a in row.iter_mut() {
                *a /= scale;
            }
            *b /= scale;
            allowed.push(if reach > 0.0 { CONSISTENT } else { 0.0 } + ROUNDING * all / scale);
            self.scales.push(scale);
        }
        let (independent, left) = independent_rows(&rows, &right);
        self.consistent = left.iter().zip(&allowed).all(|(left, allowed)| left.abs() <= *allowed);
        for i in independent {
            self.rows.push(i);
            self.matrix.push(rows[i].clone());
            self.right.push(right[i]);
        }
        self
    }

    /// The coordinates of least size that fulfil the equations.
    pub fn least(&self) -> Option<Vec<f64>> {
        let (s, n) = (self.matrix.len(), self.n);
        if self.right.iter().all(|b| *b == 0.0) {
            return Some(vec![0.0; n]);
        }
        let matrix = DMatrix::from_fn(s, n, |i, j| self.matrix[i][j]);
        let right = DVector::from_column_slice(&self.right);
        let multipliers = (&matrix * matrix.transpose()).cholesky()?.solve(&right);
        Some(matrix.tr_mul(&multipliers).as_slice().to_vec())
    }

    /// The value of a linear function of the coordinates where the equations leave it only one, to a part of it.
    pub fn constant(&self, along: &[f64], tolerance: f64) -> Option<f64> {
        let (s, n) = (self.matrix.len(), self.n);
        let matrix = DMatrix::from_fn(s, n, |i, j| self.matrix[i][j]);
        let along = DVector::from_column_slice(along);
        let parts = (&matrix * matrix.transpose()).cholesky()?.solve(&(&matrix * &along));
        let rest = &along - matrix.tr_mul(&parts);
        let constant: f64 = parts.iter().zip(&self.right).map(|(part, b)| part * b).sum();
        (rest.amax() <= tolerance * along.amax()).then_some(constant)
    }

    /// Whether coordinates are within all sets.
    pub fn is_within(&self, x: &[f64]) -> bool {
        self.parts.iter().all(|part| match &part.body {
            Body::Offsets { region, .. } => region.violation(&x[part.first..part.first + part.count()], 1.0) == 0.0,
            Body::Deformation(_) => true,
        })
    }

    /// Coefficients of the coordinates in what the load does, as a cost.
    pub fn cost(&self, program: &Program) -> Vec<f64> {
        let forces = program.blocks.iter().map(|block| block.force.as_slice());
        self.coefficients(forces).iter().map(|work| -work / self.energy).collect()
    }

    /// The largest right side: the unit of the factor on the clearances. Where some sets do not take
    /// part in the factor, it is not below what they reach.
    pub fn unit_of_factor(&self) -> f64 {
        let largest = self.right.iter().fold(0.0_f64, |largest, b| largest.max(b.abs()));
        let fixed = self.parts.iter().any(|part| matches!(part.body, Body::Offsets { scaled: false, .. }));
        if fixed && largest > 0.0 { largest.max(1.0) } else { largest }
    }

    /// Displacements of all blocks.
    pub fn displacements(&self, program: &Program, x: &[f64]) -> Vec<Vec<f64>> {
        self.parts.iter().zip(&program.blocks).map(|(part, block)| part.displacement(x, block.size())).collect()
    }

    /// Multipliers of all equations.
    pub fn multipliers(&self, y: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.scales.len()];
        self.rows.iter().zip(y).for_each(|(i, y)| all[*i] = self.energy * y / self.scales[*i]);
        all
    }

    /// Coefficients of the coordinates in a linear function of the displacements.
    pub fn coefficients<'a>(&self, forces: impl Iterator<Item = &'a [f64]>) -> Vec<f64> {
        self.parts.iter().zip(forces).flat_map(|(part, force)| part.coefficients(force)).collect()
    }
}

/// The numbers of independent rows, in ascending order, and what the equations leave of the right sides
/// of the others: the row that is least implied by the chosen ones is chosen next.
fn independent_rows(rows: &[Vec<f64>], right: &[f64]) -> (Vec<usize>, Vec<f64>) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut rest: Vec<Vec<f64>> = rows.to_vec();
    let mut left = right.to_vec();
    let sizes: Vec<f64> = rows.iter().map(|row| dot(row, row).sqrt()).collect();
    let mut chosen = Vec::new();
    let mut open: Vec<usize> = (0..rows.len()).collect();
    loop {
        let part = |i: usize| dot(&rest[i], &rest[i]).sqrt() / sizes[i].max(f64::MIN_POSITIVE);
        let Some(at) = (0..open.len()).max_by(|a, b| part(open[*a]).total_cmp(&part(open[*b]))) else { break };
        if part(open[at]) <= DEPENDENT {
            break;
        }
        let p = open.swap_remove(at);
        let size = dot(&rest[p], &rest[p]).sqrt();
        let unit: Vec<f64> = rest[p].iter().map(|a| a / size).collect();
        let unit_left = left[p] / size;
        for &i in &open {
            let along = dot(&rest[i], &unit);
            rest[i].iter_mut().zip(&unit).for_each(|(r, u)| *r -= along * u);
            left[i] -= along * unit_left;
        }
        left[p] = 0.0;
        chosen.push(p);
    }
    chosen.sort_unstable();
    (chosen, left)
}
