//! Results of the core as columns: arrays with a name and a shape, one file per question.

pub mod given;
pub mod load;
pub mod nominal;
pub mod scatter;
pub mod worst;

/// Numbers of many parts in one piece.
fn flat(parts: impl Iterator<Item = impl AsRef<[f64]>>) -> Vec<f64> {
    parts.flat_map(|p| p.as_ref().to_vec()).collect()
}
