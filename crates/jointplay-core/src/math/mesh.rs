//! Directions of the plane and of space.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use crate::math::vector::{Vec3, add, cross, dot, norm, scale, sub};

/// Divisions of the icosahedron's faces into four.
const DIVISIONS: usize = 2;

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

/// A vector of length one.
#[must_use]
pub fn unit(v: Vec3<f64>) -> Vec3<f64> {
    scale(v, 1.0 / norm(&v))
}

/// Cosine of the angular radius of the circle through three unit vectors: the distance of their plane.
#[must_use]
pub fn cosine_of_radius([a, b, c]: [Vec3<f64>; 3]) -> f64 {
    dot(unit(cross(sub(b, a), sub(c, a))), a).abs()
}

/// Directions of space with their cells.
pub struct Mesh {
    /// Unit vectors.
    pub corners: Vec<Vec3<f64>>,
    /// Corners that share an edge with each.
    pub neighbours: Vec<Vec<usize>>,
    /// Triangles of corners.
    pub cells: Vec<[usize; 3]>,
}

/// The icosahedron, its faces divided.
#[must_use]
pub fn mesh() -> &'static Mesh {
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
