//! Python's view of the core: whole arrays in, dictionaries of whole arrays out. SI units, radians.

// PyO3 hands array arguments over by value.
#![allow(clippy::needless_pass_by_value)]

mod arrays;
mod columns;
mod cones;

use jointplay_core::sampling::{BINS, Request};
use jointplay_core::spec::Law;
use jointplay_core::table::Keep;
use jointplay_core::{Mechanism as Core, Spec, Status};
use numpy::{PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use arrays::{Configurations, Table, flat_rows, rows};
use columns::{pushed, strained};

/// A checked, immutable mechanism.
#[pyclass(frozen, module = "jointplay._core")]
struct Mechanism {
    core: Core,
}

fn flat(parts: impl Iterator<Item = impl AsRef<[f64]>>) -> Vec<f64> {
    parts.flat_map(|p| p.as_ref().to_vec()).collect()
}

impl Mechanism {
    fn solved<'py>(
        &self,
        py: Python<'py>,
        configurations: &[jointplay_core::path::Configuration],
    ) -> PyResult<Table<'py>> {
        let core = &self.core;
        let (n, nb, size) = (configurations.len(), core.n_bodies(), core.size());
        let width = core.n_body_coordinates();
        let nan = |n: usize| vec![f64::NAN; n];
        let of = |pick: &dyn Fn(&jointplay_core::solver::State) -> Vec<f64>, width: usize| {
            flat(configurations.iter().map(|c| c.state.as_ref().map_or_else(|| nan(width), pick)))
        };
        Table::new(py)
            .array("poses", &[n, nb, width], of(&|s| s.coordinates.clone(), nb * width))?
            .array("output", &[n, size], of(&|s| core.output(&s.coordinates, &s.inputs), size))?
            .array("drives", &[n, core.n_drives()], of(&|s| s.inputs.drives.clone(), core.n_drives()))?
            .array("singular_value", &[n], configurations.iter().map(|c| c.singular_value).collect())?
            .array("singular_motion", &[n, nb, size], flat(configurations.iter().map(|c| &c.singular_motion)))?
            .status(configurations.iter().map(|c| c.status))
    }
}

#[pymethods]
impl Mechanism {
    #[new]
    fn new(spec: &str) -> PyResult<Self> {
        let spec: Spec = serde_json::from_str(spec).map_err(|e| PyValueError::new_err(e.to_string()))?;
        Ok(Self { core: Core::new(&spec).map_err(|e| PyValueError::new_err(e.to_string()))? })
    }

    #[getter]
    fn parameters(&self) -> Vec<(usize, &'static str)> {
        self.core.parameters().collect()
    }

    #[getter]
    fn rows(&self) -> Vec<(usize, &'static str)> {
        self.core.row_names().collect()
    }

    /// Joint and component of everything that gives way elastically.
    #[getter]
    fn deformations(&self) -> Vec<(usize, &'static str)> {
        self.core.deformations().collect()
    }

    /// Joint and component of every row of the elastic joints.
    #[getter]
    fn elastic_rows(&self) -> Vec<(usize, &'static str)> {
        let names: Vec<_> = self.core.row_names().collect();
        self.core.elastic_rows().map(|row| names[row]).collect()
    }

    /// Whether statics and closure decide everything: no row is redundant and no joint elastic.
    #[getter]
    fn isostatic(&self) -> bool {
        self.core.is_isostatic()
    }

    fn assemble<'py>(&self, py: Python<'py>, drives: PyReadonlyArray1<'py, f64>) -> PyResult<Bound<'py, PyDict>> {
        let drives = drives.as_array().to_vec();
        if drives.len() != self.core.n_drives() {
            return Err(PyValueError::new_err(format!("{} drive values are needed", self.core.n_drives())));
        }
        let assembly = py.detach(|| self.core.assemble(&drives, true));
        Ok(Table::new(py)
            .array("poses", &[self.core.n_bodies(), self.core.n_body_coordinates()], assembly.coordinates)?
            .value("residual", assembly.residual)?
            .value("converged", assembly.converged)?
            .finish())
    }

    /// Whether joints and drives decide every pose just once at the given drive values.
    fn regular(&self, py: Python<'_>, drives: PyReadonlyArray1<'_, f64>) -> PyResult<bool> {
        let drives = drives.as_array().to_vec();
        if drives.len() != self.core.n_drives() {
            return Err(PyValueError::new_err(format!("{} drive values are needed", self.core.n_drives())));
        }
        Ok(py.detach(|| self.core.is_regular(&drives)))
    }

    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        poses: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
        let coordinates = rows(&poses, "poses", self.core.n_body_coordinates())?.concat();
        if coordinates.len() != self.core.n_coordinates() {
            return Err(PyValueError::new_err(format!("poses of {} bodies are needed", self.core.n_bodies())));
        }
        let matrix = self.core.jacobian(&coordinates);
        let array = numpy::ndarray::Array2::from_shape_fn(matrix.shape(), |at| matrix[at]);
        Ok(numpy::IntoPyArray::into_pyarray(array, py))
    }

    fn solve<'py>(&self, py: Python<'py>, drives: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyDict>> {
        let (n, rows) = (drives.shape()[0], flat_rows(&drives, "drives", self.core.n_drives())?);
        let configurations = py.detach(|| self.core.solve(n, &rows));
        Ok(self.solved(py, &configurations)?.finish())
    }

    /// Poses, output and status only: no singular values, for maps of many configurations.
    fn trace<'py>(&self, py: Python<'py>, drives: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let (n, rows) = (drives.shape()[0], flat_rows(&drives, "drives", core.n_drives())?);
        let (trace, output) = py.detach(|| {
            let trace = core.trace(n, &rows);
            let output = core.outputs(&trace.coordinates);
            (trace, output)
        });
        Ok(Table::new(py)
            .status(trace.status.iter().copied())?
            .array("poses", &[n, core.n_bodies(), core.n_body_coordinates()], trace.coordinates)?
            .array("output", &[n, core.size()], output)?
            .finish())
    }

    /// Poses, output and status on a grid of drive values, reached from seeds: states with a node each. If it
    /// does not spread, nodes without a seed are not reached.
    #[allow(clippy::too_many_arguments)] // arrays of the grid, arrays of the seeds
    #[pyo3(signature = (shape, drives, seed_nodes, seed_drives, seed_poses, spread = true))]
    fn flood<'py>(
        &self,
        py: Python<'py>,
        shape: Vec<usize>,
        drives: PyReadonlyArray2<'py, f64>,
        seed_nodes: Vec<usize>,
        seed_drives: PyReadonlyArray2<'py, f64>,
        seed_poses: PyReadonlyArray3<'py, f64>,
        spread: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let rows = flat_rows(&drives, "drives", core.n_drives())?;
        let configurations = Configurations::new(core, &seed_drives, &seed_poses)?;
        let seeds: Vec<_> = seed_nodes.into_iter().zip(configurations.cases()).collect();
        let n = shape.iter().product::<usize>();
        if drives.shape()[0] != n || seeds.len() != configurations.cases().len() || seeds.iter().any(|seed| seed.0 >= n)
        {
            return Err(PyValueError::new_err("a row of drives per node of the grid and a node per seed are needed"));
        }
        let (trace, output) = py.detach(|| {
            let trace = core.flood(&shape, &rows, &seeds, spread);
            let output = core.outputs(&trace.coordinates);
            (trace, output)
        });
        Ok(Table::new(py)
            .status(trace.status.iter().copied())?
            .array("poses", &[n, core.n_bodies(), core.n_body_coordinates()], trace.coordinates)?
            .array("output", &[n, core.size()], output)?
            .finish())
    }

    /// Drive values of configurations that are solved already, those nearest to given ones over full turns.
    fn drive_values<'py>(
        &self,
        py: Python<'py>,
        poses: PyReadonlyArray3<'py, f64>,
        near: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
        let (core, n) = (&self.core, poses.shape()[0]);
        let drives = near.as_array().broadcast((n, near.len())).map(|rows| rows.to_owned());
        let drives = numpy::IntoPyArray::into_pyarray(drives.unwrap_or_default(), py).readonly();
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        let read = cases.iter().flat_map(|case| core.drive_values(case.coordinates, case.drives)).collect();
        let array = numpy::ndarray::Array2::from_shape_vec((n, core.n_drives()), read)
            .map_err(|e| PyValueError::new_err(e.to_string()))?;
        Ok(numpy::IntoPyArray::into_pyarray(array, py))
    }

    /// How near configurations that are solved already are to a singular one.
    fn measure<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let configurations = Configurations::new(&self.core, &drives, &poses)?;
        let cases = configurations.cases();
        let measured = py.detach(|| self.core.measure(&cases));
        Ok(self.solved(py, &measured)?.finish())
    }

    fn inverse<'py>(
        &self,
        py: Python<'py>,
        targets: PyReadonlyArray2<'py, f64>,
        weights: PyReadonlyArray1<'py, f64>,
        drives0: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let targets = rows(&targets, "targets", self.core.size())?;
        let (weights, start) = (weights.as_array().to_vec(), drives0.as_array().to_vec());
        if weights.len() != self.core.size() || start.len() != self.core.n_drives() {
            return Err(PyValueError::new_err("one weight per component and one start value per drive are needed"));
        }
        let configurations = py.detach(|| self.core.inverse(&targets, &weights, &start));
        let mismatch = configurations.iter().map(|c| c.mismatch).collect();
        Ok(self.solved(py, &configurations)?.array("mismatch", &[configurations.len()], mismatch)?.finish())
    }

    fn given<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        u: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let parameters = rows(&u, "u", core.n_parameters())?;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        if parameters.len() != cases.len() {
            return Err(PyValueError::new_err("one row of u per configuration is needed"));
        }
        let (n, size) = (cases.len(), core.size());
        let mut table = Table::new(py);
        let results = if core.is_isostatic() {
            py.detach(|| core.given(&cases, &parameters))
        } else {
            let found = py.detach(|| core.forced(&cases, &parameters));
            table = table
                .array("prestress", &[n, core.n_joints(), size], flat(found.iter().map(|r| &r.prestress)))?
                .array("deformation", &[n, core.deformations().count()], flat(found.iter().map(|r| &r.deformation)))?
                .array("lack_of_fit", &[n], found.iter().map(|r| r.lack_of_fit).collect())?;
            found.into_iter().map(|r| r.given).collect()
        };
        Ok(table
            .array("error", &[n, size], flat(results.iter().map(|r| &r.error)))?
            .array("error_first_order", &[n, size], flat(results.iter().map(|r| &r.error_first_order)))?
            .array(
                "poses",
                &[n, core.n_bodies(), core.n_body_coordinates()],
                flat(results.iter().map(|r| &r.coordinates)),
            )?
            .status(results.iter().map(|r| r.status))?
            .finish())
    }

    fn sensitivity<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        let results =
            py.detach(
                || {
                    if core.is_isostatic() { core.sensitivities(&cases) } else { core.shared_sensitivities(&cases) }
                },
            );
        let (n, size) = (cases.len(), core.size());
        // nalgebra stores columns, numpy rows.
        let by_rows = |m: &nalgebra::DMatrix<f64>| m.transpose().as_slice().to_vec();
        Ok(Table::new(py)
            .array(
                "source",
                &[n, size, core.n_parameters()],
                flat(results.iter().map(|r| by_rows(&r.output.parameters))),
            )?
            .array("drive", &[n, size, core.n_drives()], flat(results.iter().map(|r| by_rows(&r.output.drives))))?
            .status(results.iter().map(|r| r.status))?
            .finish())
    }

    /// `offset` and `details` tell whether these columns are wanted beside error, undetermined, iterations, status.
    #[pyo3(signature = (drives, poses, exact = true, offset = true, details = true))]
    fn loaded<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        exact: bool,
        offset: bool,
        details: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        let keep = Keep { offset, details };
        if core.is_isostatic() {
            let found = py.detach(|| core.loaded(&cases, exact, keep));
            return Ok(pushed(core, Table::new(py), found, keep)?.finish());
        }
        let found = py.detach(|| core.strained(&cases, exact));
        Ok(strained(core, Table::new(py), found, keep)?.finish())
    }

    /// The same for drive values alone, in one go, each row on the assembly branch of those before it.
    #[pyo3(signature = (drives, exact = true, offset = true, details = true))]
    fn loaded_along<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        exact: bool,
        offset: bool,
        details: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let (n, rows) = (drives.shape()[0], flat_rows(&drives, "drives", core.n_drives())?);
        if !core.is_isostatic() {
            return Err(PyValueError::new_err("loads are distributed by the play of this mechanism: trace it first"));
        }
        let keep = Keep { offset, details };
        let found = py.detach(|| core.loaded_along(n, &rows, exact, keep));
        Ok(pushed(core, Table::new(py), found, keep)?.finish())
    }

    /// An over-constrained or elastic mechanism in one configuration, for units with parameters of their own.
    fn loaded_units<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        u: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let units = rows(&u, "u", core.n_parameters())?;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let [case] = configurations.cases()[..] else {
            return Err(PyValueError::new_err("one configuration is needed"));
        };
        let (n, size) = (units.len(), core.size());
        let found = py.detach(|| core.strained_units(case, &units));
        Ok(Table::new(py)
            .array("clearance_factor", &[n], found.clearance_factor)?
            .array("poses", &[n, core.n_bodies(), core.n_body_coordinates()], found.coordinates)?
            .array("force", &[n, core.n_rows()], found.force)?
            .array("reaction", &[n, core.n_joints(), size], found.reaction)?
            .array("offset", &[n, core.n_parameters()], found.offset)?
            .status(found.status.into_iter())?
            .finish())
    }

    #[pyo3(signature = (drives, poses, starts = 24, lanes = true))]
    fn worst<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        starts: usize,
        lanes: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        let results = py.detach(|| match (core.is_isostatic(), lanes) {
            (false, _) => core.worst_together(&cases, starts),
            (true, true) => core.worst(&cases, starts),
            (true, false) => core.worst_plainly(&cases, starts),
        });
        let (n, size, ne) = (cases.len(), core.size(), core.n_extremes());
        Ok(Table::new(py)
            .array("position", &[n], results.iter().map(|r| r.position).collect())?
            .array("position_first_order", &[n], results.iter().map(|r| r.position_first_order).collect())?
            .array("position_bound", &[n], results.iter().map(|r| r.position_bound).collect())?
            .array("rotation", &[n], results.iter().map(|r| r.rotation).collect())?
            .array("rotation_first_order", &[n], results.iter().map(|r| r.rotation_first_order).collect())?
            .array("rotation_bound", &[n], results.iter().map(|r| r.rotation_bound).collect())?
            .array("fallbacks", &[n], results.iter().map(|r| r.fallbacks).collect())?
            .array("component", &[n, size, 2], flat(results.iter().flat_map(|r| &r.component)))?
            .array("component_first_order", &[n, size, 2], flat(results.iter().flat_map(|r| &r.component_first_order)))?
            .array("direction", &[n, core.n_translations()], flat(results.iter().map(|r| &r.direction)))?
            .array(
                "rotation_direction",
                &[n, results.first().map_or(0, |r| r.rotation_direction.len())],
                flat(results.iter().map(|r| &r.rotation_direction)),
            )?
            .array("offset", &[n, ne, core.n_parameters()], flat(results.iter().flat_map(|r| &r.offset)))?
            .array("contribution", &[n, ne, core.sources().len()], flat(results.iter().flat_map(|r| &r.contribution)))?
            .status(results.iter().map(|r| r.status))?
            .finish())
    }

    /// Parameters of random units: those that `random` solves with the same seed and law.
    #[pyo3(signature = (samples, seed, law = None))]
    fn units<'py>(
        &self,
        py: Python<'py>,
        samples: usize,
        seed: u64,
        law: Option<&str>,
    ) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
        let core = &self.core;
        let (limit_position, limit_rotation) = (f64::NAN, f64::NAN);
        let law = named(law)?;
        let request = Request {
            samples,
            seed,
            probabilities: vec![],
            limit_position,
            limit_rotation,
            law,
            loaded: false,
            keep: false,
        };
        let units = py.detach(|| core.units(&request));
        let array = numpy::ndarray::Array2::from_shape_vec((samples, core.n_parameters()), units)
            .map_err(|e| PyValueError::new_err(e.to_string()))?;
        Ok(numpy::IntoPyArray::into_pyarray(array, py))
    }

    /// The clearances that compatibility ties to others in any of the configurations.
    fn tied(
        &self,
        py: Python<'_>,
        drives: PyReadonlyArray2<'_, f64>,
        poses: PyReadonlyArray3<'_, f64>,
    ) -> PyResult<Vec<usize>> {
        let configurations = Configurations::new(&self.core, &drives, &poses)?;
        let cases = configurations.cases();
        Ok(py.detach(|| self.core.tied(&cases)))
    }

    #[allow(clippy::too_many_arguments)] // keyword arguments of one Python method
    #[pyo3(signature = (drives, poses, samples, seed, probabilities, limit_position, limit_rotation, law = None, threads = 0, keep = false, loaded = false))]
    fn random<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        samples: usize,
        seed: u64,
        probabilities: PyReadonlyArray1<'py, f64>,
        limit_position: f64,
        limit_rotation: f64,
        law: Option<&str>,
        threads: usize,
        keep: bool,
        loaded: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let law = named(law)?;
        let probabilities = probabilities.as_array().to_vec();
        let np = probabilities.len();
        let request = Request { samples, seed, probabilities, limit_position, limit_rotation, law, loaded, keep };
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
        let (n, size, nq) = (cases.len(), core.size(), core.n_quantities());
        let mut table = Table::new(py);
        // Without load and redundant rows nothing is elastically deformed.
        let results = if core.n_rows() == core.n_unknowns() && !loaded {
            py.detach(|| pool.install(|| core.random(&cases, &request)))
        } else {
            let found = py.detach(|| pool.install(|| core.random_units(&cases, &request)));
            let forces = core.elastic_rows().count();
            table = table
                .array("clearance_factor", &[n, np], flat(found.iter().map(|r| &r.clearance_factor)))?
                .array("force", &[n, np, forces], flat(found.iter().map(|r| &r.force)))?
                .array("contribution_elastic", &[n, core.n_joints(), size], flat(found.iter().map(|r| &r.elastic)))?;
            found.into_iter().map(|r| r.scatter).collect()
        };
        if keep {
            let kept = || results.iter().filter_map(|r| r.kept.as_ref());
            // A configuration that is not assembled has no samples.
            let count = kept().map(|k| k.statuses.len()).sum();
            table = table
                .array("kept_parameters", &[count, core.n_parameters()], flat(kept().map(|k| &k.parameters)))?
                .array("kept_errors", &[count, size], flat(kept().map(|k| &k.errors)))?
                .array(
                    "kept_status",
                    &[count],
                    kept().flat_map(|k| k.statuses.iter().map(|s| s.code())).collect::<Vec<u8>>(),
                )?;
        }
        Ok(table
            .array("mean", &[n, size], flat(results.iter().map(|r| &r.mean)))?
            .array("covariance", &[n, size, size], flat(results.iter().map(|r| &r.covariance)))?
            .array("mean_first_order", &[n, size], flat(results.iter().map(|r| &r.mean_first_order)))?
            .array("covariance_first_order", &[n, size, size], flat(results.iter().map(|r| &r.covariance_first_order)))?
            .array("contribution", &[n, core.sources().len(), size], flat(results.iter().map(|r| &r.contribution)))?
            .array("quantile", &[n, np, nq], flat(results.iter().map(|r| &r.quantile)))?
            .array("quantile_resolution", &[n, nq], flat(results.iter().map(|r| &r.quantile_resolution)))?
            .array(
                "histogram",
                &[n, nq, BINS],
                results.iter().flat_map(|r| r.histogram.iter().copied()).collect::<Vec<u64>>(),
            )?
            .array("edges", &[n, nq, BINS + 1], flat(results.iter().map(|r| &r.edges)))?
            .array("outside", &[n], results.iter().map(|r| r.outside).collect())?
            .array("largest", &[n, nq], flat(results.iter().map(|r| &r.largest)))?
            .array("failures", &[n, Status::ALL.len()], results.iter().flat_map(|r| r.failures).collect::<Vec<u64>>())?
            .array("fallbacks", &[n], results.iter().map(|r| r.fallbacks).collect())?
            .status(results.iter().map(|r| r.status))?
            .finish())
    }
}

/// The law of a name.
fn named(law: Option<&str>) -> PyResult<Option<Law>> {
    match law {
        None => Ok(None),
        Some("uniform") => Ok(Some(Law::Uniform)),
        Some("boundary") => Ok(Some(Law::Boundary)),
        Some("normal") => Ok(Some(Law::Normal)),
        Some(other) => Err(PyValueError::new_err(format!("unknown law '{other}'"))),
    }
}

/// The width of the vector registers in use: `plain`, `avx2` or `avx512`. With a name, at most that
/// width is used from now on; results do not depend on it.
#[pyfunction]
#[pyo3(signature = (limit = None))]
fn simd(limit: Option<&str>) -> PyResult<&'static str> {
    use jointplay_core::batch::simd::{Width, limit as limit_width, width};
    match limit {
        None => {}
        Some("plain") => limit_width(Width::Plain),
        Some("avx2") => limit_width(Width::Avx2),
        Some("avx512") => limit_width(Width::Avx512),
        Some(other) => return Err(PyValueError::new_err(format!("unknown width '{other}'"))),
    }
    Ok(match width() {
        Width::Plain => "plain",
        Width::Avx2 => "avx2",
        Width::Avx512 => "avx512",
    })
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("STATUSES", Status::ALL.map(Status::name).to_vec())?;
    module.add_function(wrap_pyfunction!(simd, module)?)?;
    module.add_function(wrap_pyfunction!(cones::cone_programs, module)?)?;
    module.add_class::<Mechanism>()
}
