//! Cone programs: whole arrays of programs of one structure in, whole arrays of answers out.

use std::borrow::Cow;

use jointplay_core::cone::lanes::{Answers, Programs};
use jointplay_core::cone::{Kind, Outcome, Question};
use numpy::ndarray::{ArrayView, Dimension};
use numpy::{PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::Table;
use crate::work::work;

/// Answers of `programs` that differ in their numbers only.
///
/// `question` is `pose` or `assembly`, `blocks` the blocks that all programs share, in JSON: `{"clearance":
/// set}`, `{"fixed": set}` or `{"spring": compliance}`. `maps` is [program, equation, component], `forces`
/// [program, component], `rights` [program, equation]. With `alone` every program is solved by itself.
#[pyfunction]
#[pyo3(signature = (question, blocks, maps, forces, rights, alone = false))]
pub fn cone_programs<'py>(
    py: Python<'py>,
    question: &str,
    blocks: &str,
    maps: PyReadonlyArray3<'py, f64>,
    forces: PyReadonlyArray2<'py, f64>,
    rights: PyReadonlyArray2<'py, f64>,
    alone: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let question = match question {
        "pose" => Question::Pose,
        "assembly" => Question::Assembly,
        other => return Err(PyValueError::new_err(format!("unknown question '{other}': pose or assembly"))),
    };
    let kinds: Vec<Kind> = serde_json::from_str(blocks).map_err(|e| PyValueError::new_err(e.to_string()))?;
    for set in kinds.iter().filter_map(Kind::set) {
        set.check().map_err(|e| PyValueError::new_err(e.to_string()))?;
    }
    let (maps, forces, rights) = (maps.as_array(), forces.as_array(), rights.as_array());
    let width: usize = kinds.iter().map(Kind::size).sum();
    let (n, s) = (rights.nrows(), rights.ncols());
    if maps.shape() != [n, s, width] || forces.shape() != [n, width] {
        return Err(PyValueError::new_err(format!(
            "maps {:?} and forces {:?} do not fit: {:?} and {:?} are needed",
            maps.shape(),
            forces.shape(),
            [n, s, width],
            [n, width]
        )));
    }
    let programs = Programs {
        n,
        n_equations: s,
        n_blocks: kinds.len(),
        kinds,
        maps: numbers(maps),
        forces: numbers(forces),
        rights: numbers(rights),
    };
    let answers = work(py, || if alone { programs.solve_alone(question) } else { programs.solve(question) })?;
    table(py, answers, [n, s, width])
}

/// The numbers of an array, copied only where they do not lie row by row.
fn numbers<D: Dimension>(array: ArrayView<'_, f64, D>) -> Cow<'_, [f64]> {
    match array.to_slice() {
        Some(slice) => slice.into(),
        None => array.iter().copied().collect(),
    }
}

fn table(py: Python<'_>, answers: Answers, [n, s, width]: [usize; 3]) -> PyResult<Bound<'_, PyDict>> {
    let name = |outcome: &Outcome| match outcome {
        Outcome::Solved => 0,
        Outcome::Infeasible => 1,
        Outcome::Stalled => 2,
    };
    Ok(Table::new(py)
        .array("outcome", &[n], answers.outcomes.iter().map(name).collect::<Vec<u8>>())?
        .array("displacements", &[n, width], answers.displacements)?
        .array("multipliers", &[n, s], answers.multipliers)?
        .array("factor", &[n], answers.factors)?
        .array("value", &[n], answers.values)?
        .array("dual_value", &[n], answers.dual_values)?
        .array("gap", &[n], answers.gaps)?
        .array("alone", &[], vec![answers.alone as u64])?
        .array("compared", &[], vec![answers.compared as u64])?
        .array("difference", &[], vec![answers.difference])?
        .finish())
}
