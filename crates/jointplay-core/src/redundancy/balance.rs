//! Where displacements are in equilibrium.

use nalgebra::DVector;

use crate::cone::answer::Answer;

/// Where the displacements are, and the forces on them.
#[derive(Clone, Debug)]
pub(crate) struct Balance {
    /// Displacement of every give, clearances and deformations apart from each other.
    pub given: Vec<Vec<f64>>,
    /// Force on every displacement.
    pub forces: DVector<f64>,
    /// Factor on the clearances, where that was asked.
    pub factor: f64,
    /// Relative duality gap of the program; zero where statics sufficed.
    pub gap: f64,
    /// Whether the program was solved to the end.
    pub solved: bool,
    /// What the program answered.
    pub answer: Option<Answer>,
}

impl Balance {
    /// That of displacements which forces alone decide.
    pub const fn free(given: Vec<Vec<f64>>, forces: DVector<f64>) -> Self {
        Self { given, forces, factor: 1.0, gap: 0.0, solved: true, answer: None }
    }
}
