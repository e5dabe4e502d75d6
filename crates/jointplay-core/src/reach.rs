//! How far the linearised error reaches, along any direction.
//!
//! The set of first-order errors is a sum of linear images of the admissible sets, so that its reach along
//! a unit vector u is its support function `h(u) = sum_j h_j(A_j^T u)`, and the largest error is the
//! largest reach over all u. The support point E along u leads on: along E / |E| the reach is at least |E|.
//!
//! The search starts from a mesh of directions, and tells how much it can have missed. On a cell of the mesh
//! every u is a combination of the corners v_i with weights that sum to at most `1 / cos(rho)`, rho the
//! radius of the cell's circumscribed circle; h is convex and homogeneous, and therefore
//!
//! ```text
//! h(u) <= max_i h(v_i) / cos(rho)          on the cell
//! ```
//!
//! In space cells that may hide more than the tolerance are divided.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use crate::clearance::MAX_SIZE;
use crate::mechanism::{Mechanism, Source};
use crate::sensitivity::Output;
use crate::space::{Vec3, add, cross, dot, norm, scale, sub};

/// Directions of the plane, besides those where a support point jumps.
const FAN: usize = 360;
/// Divisions of the icosahedron's faces into four, for the directions of space.
const DIVISIONS: usize = 2;
/// Alternations between direction and support point.
const ALTERNATIONS: usize = 60;
/// In space the bound is at most this part above the largest reach found, or the most cells are used.
const TOLERANCE: f64 = 1e-3;
/// Cells that are looked at at most.
const MOST_CELLS: usize = 20_000;

/// The largest reach.
#[derive(Clone, Debug)]
pub struct Farthest {
    /// Directions of local maxima, the largest first.
    pub directions: Vec<Vec3<f64>>,
    /// What the largest reach certainly does not exceed.
    pub bound: f64,
}

/// The linearised error in up to three components of one unit.
pub struct Reach<'m> {
    mechanism: &'m Mechanism,
    /// The image of every parameter.
    columns: Vec<Vec3<f64>>,
    /// The error with every offset at zero.
    base: Vec3<f64>,
    dimensions: usize,
}

impl<'m> Reach<'m> {
    /// Of the output components in a range; `shift` is the error that drive values other than the nominal
    /// ones make.
    #[must_use]
    pub fn new(mechanism: &'m Mechanism, map: &Output, shift: &[f64], range: std::ops::Range<usize>) -> Self {
        let of = |p: usize| {
            let mut column = [0.0; 3];
            column.iter_mut().zip(range.clone()).for_each(|(c, i)| *c = map.parameters[(i, p)]);
            column
        };
        let columns: Vec<Vec3<f64>> = (0..mechanism.n_parameters()).map(of).collect();
        let mut base = [0.0; 3];
        base.iter_mut().zip(range.clone()).for_each(|(b, i)| *b = shift[i]);
        for (column, &centre) in columns.iter().zip(&mechanism.centre) {
            base = add(base, scale(*column, centre));
        }
        Self { mechanism, columns, base, dimensions: range.len() }
    }

    /// What a direction pulls a source's offsets by.
    fn pull(&self, source: &Source, direction: Vec3<f64>) -> [f64; MAX_SIZE] {
        let mut w = [0.0; MAX_SIZE];
        for (w, p) in w.iter_mut().zip(source.range()) {
            *w = dot(self.columns[p], direction);
        }
        w
    }

    /// The farthest error along a direction.
    fn support_point(&self, direction: Vec3<f64>) -> Vec3<f64> {
        let mut error = self.base;
        for source in self.mechanism.sources() {
            let w = self.pull(source, direction);
            let face = source.set.face(&w[..source.set.size()], 0.0);
            for (offset, p) in face.centre.iter().zip(source.range()) {
                error = add(error, scale(self.columns[p], *offset));
            }
        }
        error
    }

    fn reach(&self, direction: Vec3<f64>) -> f64 {
        let sources = self.mechanism.sources().iter();
        sources
            .fold(dot(self.base, direction), |reach, source| reach + source.set.support(&self.pull(source, direction)))
    }

    /// Goes from a direction to that of its support point, until nothing is gained.
    fn climb(&self, mut direction: Vec3<f64>) -> (Vec3<f64>, f64) {
        let mut reached = self.reach(direction);
        for _ in 0..ALTERNATIONS {
            let error = self.support_point(direction);
            let distance = norm(&error);
            if distance == 0.0 {
                break;
            }
            direction = scale(error, 1.0 / distance);
            let next = self.reach(direction);
            let gain = next - reached;
            reached = next;
            if gain.abs() <= 1e-15 * reached {
                break;
            }
        }
        (direction, reached)
    }

    /// Local maxima of the reach over all directions.
    #[must_use]
    pub fn farthest(&self) -> Farthest {
        let (directions, neighbours) = match self.dimensions {
            1 => (vec![[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], vec![vec![], vec![]]),
            2 => self.fan(),
            _ => {
                let mesh = mesh();
                (mesh.corners.clone(), mesh.neighbours.clone())
            }
        };
        let reach: Vec<f64> = directions.iter().map(|&u| self.reach(u)).collect();
        let mut maxima = Maxima::default();
        for (k, &direction) in directions.iter().enumerate() {
            if neighbours[k].iter().all(|&n| reach[n] <= reach[k]) {
                maxima.insert(self.climb(direction));
            }
        }
        let bound = match self.dimensions {
            1 => maxima.largest(),
            2 => reach.iter().copied().fold(0.0, f64::max) / (0.5 * TAU / FAN as f64).cos(),
            _ => self.bound(&mut maxima, &reach),
        };
        let bound = bound.max(maxima.largest());
        Farthest { directions: maxima.largest_first(), bound }
    }

    /// Directions of the plane by angle, with those on either side of a jump of a support point.
    fn fan(&self) -> (Vec<Vec3<f64>>, Vec<Vec<usize>>) {
        let mut angles: Vec<f64> = (0..FAN).map(|k| TAU * k as f64 / FAN as f64).collect();
        for source in self.mechanism.sources() {
            for form in source.set.break_forms() {
                // form . (A^T u) = g . u vanishes at right angles to g.
                let g = source.range().zip(form).fold([0.0; 3], |g, (p, f)| add(g, scale(self.columns[p], f)));
                let across = g[0].atan2(-g[1]);
                for k in 0..2 {
                    let angle = across + 0.5 * TAU * f64::from(k);
                    angles.extend([angle - 1e-7, angle + 1e-7].map(|a: f64| a.rem_euclid(TAU)));
                }
            }
        }
        angles.sort_by(f64::total_cmp);
        let n = angles.len();
        let neighbours = (0..n).map(|k| vec![(k + n - 1) % n, (k + 1) % n]).collect();
        (angles.into_iter().map(|a| [a.cos(), a.sin(), 0.0]).collect(), neighbours)
    }

    /// What the reach does not exceed anywhere on the sphere, by dividing the cells that may hide more than
    /// the tolerance above the largest maximum. What they do hide joins the maxima.
    fn bound(&self, maxima: &mut Maxima, reach: &[f64]) -> f64 {
        type Corner = (Vec3<f64>, f64);
        let mesh = mesh();
        let corner = |k: usize| (mesh.corners[k], reach[k]);
        let mut cells: Vec<[Corner; 3]> = mesh.cells.iter().map(|cell| cell.map(corner)).collect();
        let (mut bound, mut seen) = (0.0_f64, 0);
        while let Some([a, b, c]) = cells.pop() {
            seen += 1;
            let here = a.1.max(b.1).max(c.1) / cosine_of_radius([a.0, b.0, c.0]);
            if here <= maxima.largest() * (1.0 + TOLERANCE) || seen > MOST_CELLS {
                bound = bound.max(here);
                continue;
            }
            let mut middle = |p: Corner, q: Corner| {
                let u = unit(add(p.0, q.0));
                let reach = self.reach(u);
                if reach > maxima.largest() {
                    maxima.insert(self.climb(u));
                }
                (u, reach)
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            cells.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        bound
    }
}

/// Local maxima, each a direction and its reach.
#[derive(Default)]
struct Maxima(Vec<(Vec3<f64>, f64)>);

impl Maxima {
    fn insert(&mut self, (direction, reach): (Vec3<f64>, f64)) {
        let known = |&(other, value): &(Vec3<f64>, f64)| {
            dot(other, direction) > 1.0 - 1e-9 && (value - reach).abs() <= 1e-9 * reach
        };
        if !self.0.iter().any(known) {
            self.0.push((direction, reach));
        }
    }

    fn largest(&self) -> f64 {
        self.0.iter().fold(0.0, |largest, &(_, reach)| reach.max(largest))
    }

    fn largest_first(mut self) -> Vec<Vec3<f64>> {
        self.0.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        self.0.into_iter().map(|(direction, _)| direction).collect()
    }
}

/// The k-th of n directions spread over the circle or the sphere.
#[must_use]
pub fn spread(dimensions: usize, k: usize, n: usize) -> Vec3<f64> {
    let part = k as f64 / n as f64;
    if dimensions == 2 {
        let (s, c) = (TAU * part).sin_cos();
        return [c, s, 0.0];
    }
    // A spiral from pole to pole that turns by the golden angle.
    let height = 1.0 - 2.0 * (part + 0.5 / n as f64);
    let (s, c) = (TAU * (k as f64 * 0.618_034).fract()).sin_cos();
    let radius = (1.0 - height * height).sqrt();
    [radius * c, radius * s, height]
}

fn unit(v: Vec3<f64>) -> Vec3<f64> {
    scale(v, 1.0 / norm(&v))
}

/// Cosine of the angular radius of the circle through three unit vectors: the distance of their plane.
fn cosine_of_radius([a, b, c]: [Vec3<f64>; 3]) -> f64 {
    dot(unit(cross(sub(b, a), sub(c, a))), a).abs()
}

/// Directions of space with their cells.
struct Mesh {
    corners: Vec<Vec3<f64>>,
    neighbours: Vec<Vec<usize>>,
    cells: Vec<[usize; 3]>,
}

/// The icosahedron, its faces divided.
fn mesh() -> &'static Mesh {
    static MESH: OnceLock<Mesh> = OnceLock::new();
    MESH.get_or_init(|| {
        let golden = f64::midpoint(1.0, 5.0_f64.sqrt());
        let mut corners = Vec::new();
        for (s, t) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            corners.extend([[0.0, s, t], [s, t, 0.0], [t, 0.0, s]].map(unit));
        }
        let near = |a: Vec3<f64>, b: Vec3<f64>| dot(a, b) > 0.4;
        let mut cells = Vec::new();
        for i in 0..12 {
            for j in 0..i {
                for k in 0..j {
                    if near(corners[i], corners[j]) && near(corners[j], corners[k]) && near(corners[k], corners[i]) {
                        cells.push([i, j, k]);
                    }
                }
            }
        }
        for _ in 0..DIVISIONS {
            let mut middles = std::collections::HashMap::new();
            let mut divided = Vec::with_capacity(4 * cells.len());
            for [a, b, c] in cells {
                let mut middle = |p: usize, q: usize| {
                    *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                        corners.push(unit(add(corners[p], corners[q])));
                        corners.len() - 1
                    })
                };
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                divided.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
            }
            cells = divided;
        }
        let mut neighbours = vec![Vec::new(); corners.len()];
        for cell in &cells {
            for k in 0..3 {
                neighbours[cell[k]].extend([cell[(k + 1) % 3], cell[(k + 2) % 3]]);
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        Mesh { corners, neighbours, cells }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mesh_covers_the_sphere() {
        let mesh = mesh();
        assert_eq!((mesh.corners.len(), mesh.cells.len()), (162, 320));
        // Solid angles of all cells add up to the sphere's.
        let solid = |cell: &[usize; 3]| {
            let [a, b, c] = cell.map(|k| mesh.corners[k]);
            let down = 1.0 + dot(a, b) + dot(b, c) + dot(c, a);
            2.0 * dot(a, cross(b, c)).abs().atan2(down)
        };
        let whole: f64 = mesh.cells.iter().map(solid).sum();
        assert!((whole - 2.0 * TAU).abs() < 1e-12);
        assert!(mesh.neighbours.iter().all(|n| n.len() == 5 || n.len() == 6));
    }

    #[test]
    fn no_direction_of_a_cell_lies_beyond_its_circle() {
        for k in 0..500 {
            let u = spread(3, k, 500);
            let mesh = mesh();
            let nearest = mesh.corners.iter().map(|&c| dot(c, u)).fold(-1.0, f64::max);
            let coarsest = mesh.cells.iter().map(|c| cosine_of_radius(c.map(|k| mesh.corners[k]))).fold(1.0, f64::min);
            assert!(nearest >= coarsest, "{u:?}");
        }
    }
}
