//! Whole arrays across the border: Python's numbers in, labelled arrays out.

use std::borrow::Cow;

use jointplay_core::{Answer, Case, Mechanism, Values};
use numpy::ndarray::{ArrayD, Dimension, IxDyn};
use numpy::{
    Element, IntoPyArray, PyArrayDyn, PyReadonlyArray, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods,
};
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

/// The numbers of an array row after row, copied only where they do not lie so.
fn in_rows<'a, D: Dimension>(array: &'a PyReadonlyArray<'_, f64, D>) -> Cow<'a, [f64]> {
    match array.as_slice() {
        // A slice is there for columns one after the other, too.
        Ok(slice) if array.is_c_contiguous() => Cow::Borrowed(slice),
        _ => Cow::Owned(array.as_array().iter().copied().collect()),
    }
}

/// Rows of a matrix one after the other, checked for their length.
pub fn flat_rows<'a>(matrix: &'a PyReadonlyArray2<'_, f64>, name: &str, columns: usize) -> PyResult<Cow<'a, [f64]>> {
    let found = matrix.shape()[1];
    if found != columns {
        return Err(PyValueError::new_err(format!("{name} has {found} columns, {columns} are needed")));
    }
    Ok(in_rows(matrix))
}

/// The numbers of an array whose last dimensions have these sizes, and the sizes of those before.
pub fn leading<'a, D: Dimension>(
    array: &'a PyReadonlyArray<'_, f64, D>,
    last: &[usize],
    name: &str,
) -> PyResult<(&'a [usize], Cow<'a, [f64]>)> {
    match array.shape().split_at_checked(array.shape().len().saturating_sub(last.len())) {
        Some((first, sizes)) if sizes == last => Ok((first, in_rows(array))),
        _ => Err(PyValueError::new_err(format!("{name} has shape {:?}; it has to end in {last:?}", array.shape()))),
    }
}

/// An array of a shape.
pub fn reshaped<'py>(py: Python<'py>, shape: &[usize], values: Vec<f64>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let array = ArrayD::from_shape_vec(IxDyn(shape), values).map_err(|e| PyValueError::new_err(e.to_string()))?;
    Ok(array.into_pyarray(py))
}

/// Drive values and nominal coordinates of many configurations, in one piece each.
pub struct Configurations<'a> {
    n: usize,
    drives: Cow<'a, [f64]>,
    coordinates: Cow<'a, [f64]>,
}

impl<'a> Configurations<'a> {
    /// Views of the arrays, checked for their shapes.
    pub fn new(
        mechanism: &Mechanism,
        drives: &'a PyReadonlyArray2<'_, f64>,
        poses: &'a PyReadonlyArray3<'_, f64>,
    ) -> PyResult<Self> {
        let n = drives.shape()[0];
        let wanted = [n, mechanism.n_bodies(), mechanism.n_body_coordinates()];
        if drives.shape()[1] != mechanism.n_drives() || poses.shape() != wanted {
            return Err(PyValueError::new_err(format!(
                "drives {:?} and poses {:?} do not fit: {wanted:?} is needed of the poses",
                drives.shape(),
                poses.shape()
            )));
        }
        Ok(Self { n, drives: in_rows(drives), coordinates: mechanism.inside(in_rows(poses)) })
    }

    /// One view per configuration.
    pub fn cases(&self) -> Vec<Case<'_>> {
        let width = |all: &[f64]| all.len() / self.n.max(1);
        let part = |all, i: usize| -> &[f64] {
            let all: &[f64] = all;
            &all[i * width(all)..(i + 1) * width(all)]
        };
        let case = |i| Case { drives: part(&self.drives, i), coordinates: part(&self.coordinates, i) };
        (0..self.n).map(case).collect()
    }
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

    /// Adds a single value.
    pub fn value<T: IntoPyObject<'py>>(self, name: &str, value: T) -> PyResult<Self> {
        self.dict.set_item(name, value)?;
        Ok(self)
    }

    /// All columns and counts of an answer.
    pub fn of(py: Python<'py>, answer: Answer) -> PyResult<Bound<'py, PyDict>> {
        let mut table = Self::new(py);
        for column in answer.columns {
            table = match column.values {
                Values::Numbers(values) => table.array(column.name, &column.shape, values),
                Values::Counts(values) => table.array(column.name, &column.shape, values),
                Values::Flags(values) => table.array(column.name, &column.shape, values),
                Values::Codes(values) => table.array(column.name, &column.shape, values),
            }?;
        }
        for (name, count) in answer.totals {
            table = table.value(name, count)?;
        }
        Ok(table.finish())
    }

    pub fn finish(self) -> Bound<'py, PyDict> {
        self.dict
    }
}
