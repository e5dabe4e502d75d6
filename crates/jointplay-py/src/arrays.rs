//! Whole arrays across the border: Python's numbers in, labelled arrays out.

use jointplay_core::loaded::Case;
use jointplay_core::{Mechanism, Status};
use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{Element, IntoPyArray, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Rows of a matrix, checked for their length.
pub fn rows(matrix: &PyReadonlyArray2<'_, f64>, name: &str, columns: usize) -> PyResult<Vec<Vec<f64>>> {
    let view = matrix.as_array();
    if view.ncols() != columns {
        return Err(PyValueError::new_err(format!("{name} has {} columns, {columns} are needed", view.ncols())));
    }
    Ok(view.rows().into_iter().map(|row| row.to_vec()).collect())
}

/// Configurations from drive values and nominal poses.
pub fn cases(
    mechanism: &Mechanism,
    drives: &PyReadonlyArray2<'_, f64>,
    poses: &PyReadonlyArray3<'_, f64>,
) -> PyResult<Vec<Case>> {
    let drives = rows(drives, "drives", mechanism.n_drives())?;
    let poses = poses.as_array();
    let shape = [drives.len(), mechanism.n_bodies(), mechanism.size()];
    if poses.shape() != shape {
        return Err(PyValueError::new_err(format!("poses have shape {:?}, {shape:?} is needed", poses.shape())));
    }
    let coordinates = poses.outer_iter().map(|p| p.iter().copied().collect());
    Ok(drives.into_iter().zip(coordinates).map(|(drives, coordinates)| Case { drives, coordinates }).collect())
}

/// A dictionary of arrays under construction.
pub struct Table<'py> {
    py: Python<'py>,
    dict: Bound<'py, PyDict>,
}

impl<'py> Table<'py> {
    pub fn new(py: Python<'py>) -> Self {
        Self { py, dict: PyDict::new(py) }
    }

    /// Adds an array of the given shape.
    pub fn array<T: Element>(self, name: &str, shape: &[usize], values: Vec<T>) -> PyResult<Self> {
        let array =
            ArrayD::from_shape_vec(IxDyn(shape), values).map_err(|e| PyValueError::new_err(format!("{name}: {e}")))?;
        self.dict.set_item(name, array.into_pyarray(self.py))?;
        Ok(self)
    }

    /// Adds the statuses.
    pub fn status(self, statuses: impl Iterator<Item = Status>) -> PyResult<Self> {
        let codes: Vec<u8> = statuses.map(Status::code).collect();
        let n = codes.len();
        self.array("status", &[n], codes)
    }

    /// Adds a single value.
    pub fn value<T: IntoPyObject<'py>>(self, name: &str, value: T) -> PyResult<Self> {
        self.dict.set_item(name, value)?;
        Ok(self)
    }

    pub fn finish(self) -> Bound<'py, PyDict> {
        self.dict
    }
}
