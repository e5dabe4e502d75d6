//! Compliances as products `F = L L'`: deformations `v = L z` store the energy `1/2 z . z`.

/// What rounding may leave of a pivot that is zero, as a part of its diagonal element.
const ROUNDING: f64 = 1e-12;

/// Columns of L, as many as the compliance has rank; `None` where it is not positive semidefinite.
///
/// Components of different units are compared each with its own compliance.
#[must_use]
pub fn factor(compliance: &[f64], size: usize) -> Option<Vec<Vec<f64>>> {
    let unit: Vec<f64> = (0..size).map(|k| compliance[k * size + k].abs().sqrt()).collect();
    let scaled = |i: usize, j: usize| {
        let both = unit[i] * unit[j];
        if both > 0.0 { 0.5 * (compliance[i * size + j] + compliance[j * size + i]) / both } else { 0.0 }
    };
    let loose = |i: usize, j: usize| unit[i] * unit[j] == 0.0 && compliance[i * size + j] != 0.0;
    if (0..size).any(|i| (0..size).any(|j| loose(i, j))) || compliance.iter().any(|f| !f.is_finite()) {
        return None;
    }
    let mut rest: Vec<Vec<f64>> = (0..size).map(|i| (0..size).map(|j| scaled(i, j)).collect()).collect();
    let mut columns = Vec::new();
    while let Some(p) = (0..size).max_by(|a, b| rest[*a][*a].total_cmp(&rest[*b][*b])) {
        if rest[p][p] <= ROUNDING {
            break;
        }
        let root = rest[p][p].sqrt();
        let column: Vec<f64> = (0..size).map(|i| rest[i][p] / root).collect();
        for i in 0..size {
            for j in 0..size {
                rest[i][j] -= column[i] * column[j];
            }
        }
        columns.push(column.iter().zip(&unit).map(|(c, unit)| c * unit).collect());
    }
    let left = rest.iter().flatten().fold(0.0_f64, |left, r| left.max(r.abs()));
    // Elements off the diagonal are bounded by the roots of those on it.
    (left <= ROUNDING.sqrt()).then_some(columns)
}
