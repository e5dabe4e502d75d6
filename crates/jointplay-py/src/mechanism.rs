//! A mechanism as Python holds it: arguments checked, the core called without the interpreter's lock.

use std::borrow::Cow;

use jointplay_core::Keep;
use jointplay_core::clearance::Law;
use jointplay_core::closure::EquilibriumTerms;
use jointplay_core::nominal::{DriveRates, Seed};
use jointplay_core::questions::certificate::Attained;
use jointplay_core::questions::random::{Request, Sampling};
use jointplay_core::{Answer, Case, Mechanism as Core, Spec};
use numpy::ndarray::{Array2, Dimension};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Configurations, Table, flat_rows, leading, reshaped, rows};
use crate::work::{short, work, work_in_part};

type Matrix<'py> = Bound<'py, PyArray2<f64>>;

/// A checked, immutable mechanism.
///
/// What takes `partly` gives what is done when Ctrl-C stops it, where that is anything: the first rows, or the samples
/// until then.
#[pyclass(frozen, module = "jointplay._core")]
pub struct Mechanism {
    core: Core,
}

impl Mechanism {
    /// One value per drive.
    fn drive_row(&self, drives: &PyReadonlyArray1<'_, f64>) -> PyResult<Vec<f64>> {
        let drives = drives.as_array().to_vec();
        if drives.len() != self.core.n_drives() {
            return Err(PyValueError::new_err(format!("{} drive values are needed", self.core.n_drives())));
        }
        Ok(drives)
    }

    /// One pose of all bodies.
    fn coordinates(&self, poses: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<f64>> {
        let coordinates = flat_rows(poses, "poses", self.core.n_body_coordinates())?.into_owned();
        if coordinates.len() != self.core.n_coordinates() {
            return Err(PyValueError::new_err(format!("poses of {} bodies are needed", self.core.n_bodies())));
        }
        Ok(self.core.inside(coordinates.into()).into_owned())
    }

    /// Poses of all bodies and the sizes of the dimensions before.
    fn placed<'a, D: Dimension>(
        &self,
        poses: &'a PyReadonlyArray<'_, f64, D>,
    ) -> PyResult<(&'a [usize], Cow<'a, [f64]>)> {
        let (shape, coordinates) = leading(poses, &[self.core.n_bodies(), self.core.n_body_coordinates()], "poses")?;
        Ok((shape, self.core.inside(coordinates)))
    }

    /// An answer with poses as they are drawn.
    fn table<'py>(&self, py: Python<'py>, answer: Answer) -> PyResult<Bound<'py, PyDict>> {
        Table::of(py, self.core.answer_outside(answer))
    }
}

#[pymethods]
impl Mechanism {
    #[new]
    fn new(spec: &str) -> PyResult<Self> {
        let spec: Spec = serde_json::from_str(spec).map_err(|e| PyValueError::new_err(e.to_string()))?;
        Ok(Self { core: short(|| Core::new(&spec))?.map_err(|e| PyValueError::new_err(e.to_string()))? })
    }

    #[getter]
    fn parameters(&self) -> Vec<(usize, &'static str)> {
        self.core.parameters().collect()
    }

    /// Where twists are taken, in body axes: at the origins of the bodies, or at their first joints where these are far away.
    #[getter]
    fn origins<'py>(&self, py: Python<'py>) -> PyResult<Matrix<'py>> {
        in_matrix(py, self.core.n_bodies(), 3, self.core.origins().concat())
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
        let drives = self.drive_row(&drives)?;
        let assembly = work(py, || self.core.assemble(&drives, true))?;
        Ok(Table::new(py)
            .array(
                "poses",
                &[self.core.n_bodies(), self.core.n_body_coordinates()],
                self.core.outside(assembly.coordinates),
            )?
            .value("residual", assembly.residual)?
            .value("converged", assembly.converged)?
            .finish())
    }

    /// Whether joints and drives decide every pose just once at the given drive values.
    fn regular(&self, py: Python<'_>, drives: PyReadonlyArray1<'_, f64>) -> PyResult<bool> {
        let drives = self.drive_row(&drives)?;
        work(py, || self.core.is_regular(&drives))
    }

    /// Shape (row, unknown), at one pose of all bodies or at each of several.
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        poses: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (shape, coordinates) = self.placed(&poses)?;
        let found = work(py, || self.core.jacobians(&coordinates))?;
        reshaped(py, &[shape, &[self.core.n_rows(), self.core.n_unknowns()]].concat(), found)
    }

    /// What every row is off by where the bodies are, in metres and radians; joints first, then drives. At one pose of
    /// all bodies or at each of several.
    fn gaps<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArrayDyn<'py, f64>,
        poses: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let core = &self.core;
        let (shape, coordinates) = self.placed(&poses)?;
        let (as_many, values) = leading(&drives, &[core.n_drives()], "drives")?;
        if shape != as_many {
            return Err(PyValueError::new_err("one row of drives per pose is needed"));
        }
        let n = shape.iter().product::<usize>();
        let at = |k: usize| {
            let (body, drive) = (core.n_coordinates(), core.n_drives());
            core.gaps(&coordinates[k * body..(k + 1) * body], &values[k * drive..(k + 1) * drive])
        };
        let found = work(py, || (0..n).flat_map(at).collect())?;
        reshaped(py, &[shape, &[core.n_rows()]].concat(), found)
    }

    /// How near configurations are to a singularity with lengths divided by a characteristic one, where these components
    /// of the output's twist count; without `details` the closure alone.
    #[pyo3(signature = (poses, length, components, details = true))]
    fn nearness<'py>(
        &self,
        py: Python<'py>,
        poses: PyReadonlyArray3<'py, f64>,
        length: f64,
        components: Vec<usize>,
        details: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let (_, coordinates) = self.placed(&poses)?;
        let found = work(py, || core.nearness(&coordinates, length, &components, details))?;
        let refused = "as many rows as unknowns and components of the output are needed";
        self.table(py, found.ok_or_else(|| PyValueError::new_err(refused))?)
    }

    /// Nominal poses for drive values given one after the other, on one assembly branch. From the guess or from other poses
    /// of all bodies.
    #[pyo3(signature = (drives, start = None))]
    fn trace<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        start: Option<PyReadonlyArray2<'py, f64>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let (n, rows) = (drives.shape()[0], flat_rows(&drives, "drives", core.n_drives())?);
        let Some(start) = start else { return self.table(py, work(py, || core.traced(core.trace(n, &rows)))?) };
        let start = self.coordinates(&start)?;
        self.table(py, work(py, || core.traced(core.guessed_at(&start).trace(n, &rows)))?)
    }

    /// Poses, output and status on a grid of drive values, reached from seeds: states with a node each, which may lie
    /// beyond singular poses. If it does not spread, nodes without a seed are not reached. The mechanism `real`, with the
    /// same bodies and drives of its own, must not become singular on the way either. And where ways to the next nodes
    /// (node, axis), and from seeds, ended at a singular pose; and up to where a seed leads that does not get to its node.
    #[allow(clippy::too_many_arguments)] // arrays of the grid, arrays of the seeds
    #[pyo3(signature = (shape, drives, seed_nodes, seed_drives, seed_poses, beyond, spread = true, real = None))]
    fn trace_grid<'py>(
        &self,
        py: Python<'py>,
        shape: Vec<usize>,
        drives: PyReadonlyArray2<'py, f64>,
        seed_nodes: Vec<usize>,
        seed_drives: PyReadonlyArray2<'py, f64>,
        seed_poses: PyReadonlyArray3<'py, f64>,
        beyond: Vec<bool>,
        spread: bool,
        real: Option<PyRef<'py, Self>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let rows = flat_rows(&drives, "drives", core.n_drives())?;
        let configurations = Configurations::new(core, &seed_drives, &seed_poses)?;
        let cases = configurations.cases();
        let n = shape.iter().product::<usize>();
        let fits = [seed_nodes.len(), beyond.len()] == [cases.len(); 2] && seed_nodes.iter().all(|node| *node < n);
        if drives.shape()[0] != n || !fits {
            return Err(PyValueError::new_err("a row of drives per node of the grid and a node per seed are needed"));
        }
        let real = real.as_ref().map(|real| &real.core);
        if real.is_some_and(|real| real.n_coordinates() != core.n_coordinates()) {
            return Err(PyValueError::new_err("the real mechanism has other bodies"));
        }
        let seed = |((node, beyond), case)| Seed { node, case, beyond };
        let seeds: Vec<_> = seed_nodes.into_iter().zip(beyond).zip(cases).map(seed).collect();
        let found = work(py, || core.trace_grid(&shape, &rows, &seeds, spread, real))?;
        let table = self.table(py, core.traced(found.trace))?;
        table.set_item("crossing", reshaped(py, &[n, shape.len()], found.crossing)?)?;
        table.set_item("seed_crossing", found.seed_crossing.into_pyarray(py))?;
        table.set_item("seed_end", found.seed_end.into_pyarray(py))?;
        Ok(table)
    }

    /// Drive values of configurations that are solved already, those nearest to given ones over full turns.
    fn drive_values<'py>(
        &self,
        py: Python<'py>,
        poses: PyReadonlyArray3<'py, f64>,
        near: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Matrix<'py>> {
        let (core, n) = (&self.core, poses.shape()[0]);
        let drives = near.as_array().broadcast((n, near.len())).map(|rows| rows.to_owned());
        let drives = drives.unwrap_or_default().into_pyarray(py).readonly();
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        let of = |case: &Case<'_>| core.drive_values(case.coordinates, case.drives);
        let read = short(|| cases.iter().flat_map(of).collect())?;
        let array =
            Array2::from_shape_vec((n, core.n_drives()), read).map_err(|e| PyValueError::new_err(e.to_string()))?;
        Ok(array.into_pyarray(py))
    }

    /// Pose of the output in configurations that are solved already.
    fn output<'py>(&self, py: Python<'py>, poses: PyReadonlyArray3<'py, f64>) -> PyResult<Matrix<'py>> {
        let core = &self.core;
        let (shape, coordinates) = self.placed(&poses)?;
        let found = work(py, || core.outputs_outside(core.outputs(&coordinates)))?;
        let array =
            Array2::from_shape_vec((shape[0], core.size()), found).map_err(|e| PyValueError::new_err(e.to_string()))?;
        Ok(array.into_pyarray(py))
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
        self.table(py, work(py, || self.core.measure(&cases))?)
    }

    /// How all bodies move at their origins (see `origins`) in configurations that are solved already, by the speeds and
    /// accelerations of the drives.
    fn moving<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        speeds: PyReadonlyArray2<'py, f64>,
        accelerations: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        let speeds = rows(&speeds, "speeds", core.n_drives())?;
        let accelerations = rows(&accelerations, "accelerations", core.n_drives())?;
        if [speeds.len(), accelerations.len()] != [cases.len(); 2] {
            return Err(PyValueError::new_err("a row of speeds and of accelerations per configuration is needed"));
        }
        let rates: Vec<DriveRates<'_>> = speeds
            .iter()
            .zip(&accelerations)
            .map(|(speeds, accelerations)| DriveRates { speeds, accelerations })
            .collect();
        self.table(py, work(py, || core.moving(&cases, &rates))?)
    }

    /// What equilibrium is made of at given poses, for parameters, and for the force and moment of every load in its axes.
    fn balance<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        u: PyReadonlyArray2<'py, f64>,
        wrenches: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        let parameters = rows(&u, "u", core.n_parameters())?;
        let wrenches = rows(&wrenches, "wrenches", 6 * core.n_loads())?;
        if [parameters.len(), wrenches.len()] != [cases.len(); 2] {
            return Err(PyValueError::new_err("a row of u and of wrenches per configuration is needed"));
        }
        let (n, found) = (cases.len(), work(py, || core.balances(&cases, &parameters, &wrenches))?);
        let all = |part: fn(&EquilibriumTerms) -> &Vec<f64>| found.iter().flat_map(part).copied().collect::<Vec<f64>>();
        Ok(Table::new(py)
            .array("jacobian", &[n, core.n_rows(), core.n_unknowns()], all(|b| &b.jacobian))?
            .array("loads", &[n, core.n_unknowns()], all(|b| &b.loads))?
            .array("levers", &[n, core.n_joints(), 2, 3], all(|b| &b.levers))?
            .array("axes", &[n, core.n_joints(), 3, 3], all(|b| &b.axes))?
            .finish())
    }

    fn inverse<'py>(
        &self,
        py: Python<'py>,
        targets: PyReadonlyArray2<'py, f64>,
        weights: PyReadonlyArray1<'py, f64>,
        drives0: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut targets = rows(&targets, "targets", self.core.size())?;
        self.core.targets_inside(&mut targets);
        let (weights, start) = (weights.as_array().to_vec(), drives0.as_array().to_vec());
        if weights.len() != self.core.size() || start.len() != self.core.n_drives() {
            return Err(PyValueError::new_err("one weight per component and one start value per drive are needed"));
        }
        self.table(py, work(py, || self.core.reached(&self.core.inverse(&targets, &weights, &start)))?)
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
        self.table(py, work(py, || core.given(&cases, &parameters))?)
    }

    /// The exact errors of specimens of a determinate mechanism, one row of parameters each, at one configuration.
    fn errors_of<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        u: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Matrix<'py>> {
        let errors = self.closed(py, &drives, &poses, &u, Core::errors_of)?;
        in_matrix(py, u.shape()[0], self.core.size(), errors)
    }

    /// Whether specimens whose offsets are drawn anew by pseudo-random numbers keep to the limits.
    #[allow(clippy::too_many_arguments)] // keyword arguments of one Python method
    #[pyo3(signature = (drives, poses, u, seed, limits, law = None))]
    fn within_redrawn<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        u: PyReadonlyArray2<'py, f64>,
        seed: u64,
        limits: PyReadonlyArray2<'py, f64>,
        law: Option<&str>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let (samples, sampling, limits) = (u.shape()[0], Sampling::Plain, self.limits(&limits)?);
        let request = Request { samples, seed, limits, law: named(law)?, sampling, ..Request::default() };
        let within = |core: &Core, case: Case<'_>, specimens: &[f64]| core.within_redrawn(case, specimens, &request);
        Ok(self.closed(py, &drives, &poses, &u, within)?.into_pyarray(py))
    }

    /// Specimens with the offsets of their clearances, or with all but the sizes of these, where they reach farthest along
    /// weights of the parameters.
    #[pyo3(signature = (u, weights, all = false))]
    fn at_supports<'py>(
        &self,
        py: Python<'py>,
        u: PyReadonlyArray2<'py, f64>,
        weights: PyReadonlyArray2<'py, f64>,
        all: bool,
    ) -> PyResult<Matrix<'py>> {
        self.beside(py, &u, &weights, |core, u, weights| core.at_supports(u, weights, all))
    }

    /// Specimens with the offsets of others, at the same part of the play of their own.
    fn with_offsets_of<'py>(
        &self,
        py: Python<'py>,
        u: PyReadonlyArray2<'py, f64>,
        others: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Matrix<'py>> {
        self.beside(py, &u, &others, Core::with_offsets_of)
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
        self.table(py, work(py, || core.sensitivity(&cases))?)
    }

    fn jacobians<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        self.table(py, work(py, || core.output_jacobians(&cases))?)
    }

    /// `offset` and `details` tell whether these columns are wanted beside error, undetermined, iterations, status. With
    /// `loads` every configuration has force and moment of each load of its own, six numbers.
    #[allow(clippy::too_many_arguments, clippy::fn_params_excessive_bools)] // keyword arguments of one Python method
    #[pyo3(signature = (drives, poses, exact = true, offset = true, details = true, partly = false, loads = None))]
    fn loaded<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        exact: bool,
        offset: bool,
        details: bool,
        partly: bool,
        loads: Option<PyReadonlyArray3<'py, f64>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        if loads.as_ref().is_some_and(|loads| *loads.shape() != [cases.len(), core.n_loads(), 6]) {
            return Err(PyValueError::new_err("force and moment of every load are needed per configuration"));
        }
        let wrenches: Option<Vec<f64>> = loads.map(|loads| loads.as_array().iter().copied().collect());
        let keep = Keep { offset, details };
        let loaded = || match &wrenches {
            Some(wrenches) => core.loaded_by(&cases, wrenches, exact, keep),
            None => core.loaded(&cases, exact, keep),
        };
        self.table(py, work_in_part(py, 0, loaded, |found| !partly || found.is_empty())?)
    }

    /// An over-constrained or elastic mechanism in one configuration, for units with parameters of their own.
    fn loaded_specimens<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        u: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let specimens = rows(&u, "u", core.n_parameters())?;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let &[case] = &configurations.cases()[..] else {
            return Err(PyValueError::new_err("one configuration is needed"));
        };
        self.table(py, work(py, || core.loaded_specimens(case, &specimens))?)
    }

    #[pyo3(signature = (drives, poses, starts = 24, lanes = true, partly = false))]
    fn worst<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        starts: usize,
        lanes: bool,
        partly: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        let worst = || core.worst(&cases, starts, lanes);
        self.table(py, work_in_part(py, 0, worst, |found| !partly || found.is_empty())?)
    }

    /// Upper bounds of the worst errors, from what is attained: largest displacement, largest rotation, lowest and highest
    /// error of every component. Each from so many parts of the sets at most.
    #[pyo3(signature = (drives, poses, position, rotation, component, parts, partly = false))]
    #[allow(clippy::too_many_arguments)] // what `worst` found, column by column
    fn certificate<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        position: PyReadonlyArray1<'py, f64>,
        rotation: PyReadonlyArray1<'py, f64>,
        component: PyReadonlyArray3<'py, f64>,
        parts: u64,
        partly: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        let (position, rotation) = (position.as_array().to_vec(), rotation.as_array().to_vec());
        let (_, component) = leading(&component, &[core.size(), 2], "component")?;
        let n = cases.len();
        if position.len() != n || rotation.len() != n || component.len() != n * core.size() * 2 {
            return Err(PyValueError::new_err("one row of attained values per configuration is needed"));
        }
        let attained = |k: usize| Attained {
            position: position[k],
            rotation: rotation[k],
            component: &component[k * core.size() * 2..(k + 1) * core.size() * 2],
        };
        let attained: Vec<Attained<'_>> = (0..n).map(attained).collect();
        let certificate = || core.certificate(&cases, &attained, parts);
        self.table(py, work_in_part(py, 0, certificate, |found| !partly || found.is_empty())?)
    }

    /// The extremes along unit vectors, a row each.
    #[pyo3(signature = (drives, poses, directions, starts = 4))]
    fn region<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
        starts: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let directions: Vec<[f64; 3]> = rows(&directions, "directions", core.n_translations())?
            .iter()
            .map(|row| std::array::from_fn(|k| row.get(k).copied().unwrap_or(0.0)))
            .collect();
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        self.table(py, work(py, || core.region(&cases, &directions, starts))?)
    }

    /// Parameters of random specimens: those that `random` solves with the same seed, law and sampling.
    #[pyo3(signature = (samples, seed, law = None, sampling = "sobol"))]
    fn specimens<'py>(
        &self,
        py: Python<'py>,
        samples: usize,
        seed: u64,
        law: Option<&str>,
        sampling: &str,
    ) -> PyResult<Matrix<'py>> {
        let core = &self.core;
        let (law, sampling) = (named(law)?, points(sampling)?);
        let request = Request { samples, seed, law, sampling, ..Request::default() };
        let specimens = work(py, || core.specimens(&request))?;
        let array = Array2::from_shape_vec((samples, core.n_parameters()), specimens)
            .map_err(|e| PyValueError::new_err(e.to_string()))?;
        Ok(array.into_pyarray(py))
    }

    /// Mean, from the known deviations, and covariance of all parameters as specimens scatter.
    fn parameter_moments<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyArray1<f64>>, Matrix<'py>)> {
        let n = self.core.n_parameters();
        let (mean, covariance) = self.core.parameter_moments();
        Ok((mean.into_pyarray(py), in_matrix(py, n, n, covariance)?))
    }

    /// How many independent standard normal scores make a specimen.
    #[pyo3(signature = (law = None))]
    fn count_scores(&self, law: Option<&str>) -> PyResult<usize> {
        Ok(self.core.count_scores(named(law)?))
    }

    /// Parameters of the specimens of given scores, a row each; NaN where scores are beyond the bounds of their law.
    #[pyo3(signature = (scores, law = None))]
    fn specimens_of_scores<'py>(
        &self,
        py: Python<'py>,
        scores: PyReadonlyArray2<'py, f64>,
        law: Option<&str>,
    ) -> PyResult<Matrix<'py>> {
        let (core, law) = (&self.core, named(law)?);
        let rows = flat_rows(&scores, "scores", core.count_scores(law))?;
        let specimens = work(py, || core.specimens_of_scores(&rows, law))?;
        in_matrix(py, scores.shape()[0], core.n_parameters(), specimens)
    }

    /// The sources of whose random values some are pseudo-random, although Sobol points are asked for.
    #[pyo3(signature = (law = None))]
    fn pseudo_random(&self, law: Option<&str>) -> PyResult<Vec<usize>> {
        Ok(self.core.pseudo_random(&Request { law: named(law)?, ..Request::default() }))
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
        work(py, || self.core.tied(&cases))
    }

    #[allow(clippy::too_many_arguments)] // keyword arguments of one Python method
    #[pyo3(signature = (drives, poses, samples, seed, probabilities, limits = None, law = None, threads = 0, keep = false, loaded = false, partly = false, sampling = "sobol"))]
    fn random<'py>(
        &self,
        py: Python<'py>,
        drives: PyReadonlyArray2<'py, f64>,
        poses: PyReadonlyArray3<'py, f64>,
        samples: usize,
        seed: u64,
        probabilities: PyReadonlyArray1<'py, f64>,
        limits: Option<PyReadonlyArray2<'py, f64>>,
        law: Option<&str>,
        threads: usize,
        keep: bool,
        loaded: bool,
        partly: bool,
        sampling: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.core;
        let (law, sampling) = (named(law)?, points(sampling)?);
        let probabilities = probabilities.as_array().to_vec();
        let limits = limits.map_or(Ok(vec![]), |limits| self.limits(&limits))?;
        let request = Request { samples, seed, sampling, probabilities, limits, law, loaded, keep };
        let configurations = Configurations::new(core, &drives, &poses)?;
        let cases = configurations.cases();
        let random = || core.random(&cases, &request);
        self.table(py, work_in_part(py, threads, random, |found| !partly || found.is_empty())?)
    }
}

impl Mechanism {
    /// What the core makes of rows of parameters, and of as many others beside them.
    fn closed<'py, T: Send>(
        &self,
        py: Python<'py>,
        drives: &PyReadonlyArray2<'py, f64>,
        poses: &PyReadonlyArray3<'py, f64>,
        u: &PyReadonlyArray2<'py, f64>,
        found: impl Fn(&Core, Case<'_>, &[f64]) -> Vec<T> + Sync + Send,
    ) -> PyResult<Vec<T>> {
        let core = &self.core;
        let specimens = flat_rows(u, "u", core.n_parameters())?;
        let configurations = Configurations::new(core, drives, poses)?;
        let &[case] = &configurations.cases()[..] else {
            return Err(PyValueError::new_err("one configuration is needed"));
        };
        if !core.is_isostatic() {
            return Err(PyValueError::new_err("the mechanism is not determinate"));
        }
        work(py, || found(core, case, &specimens))
    }

    /// Lowest and highest acceptable value of every quantity; none at all is no limit.
    fn limits(&self, limits: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 2]>> {
        let limits: Vec<[f64; 2]> = rows(limits, "limits", 2)?.iter().map(|limit| [limit[0], limit[1]]).collect();
        if !limits.is_empty() && limits.len() != self.core.size() + 2 {
            return Err(PyValueError::new_err("a lowest and a highest value of every quantity are needed"));
        }
        Ok(limits)
    }

    fn beside<'py>(
        &self,
        py: Python<'py>,
        u: &PyReadonlyArray2<'py, f64>,
        others: &PyReadonlyArray2<'py, f64>,
        made: impl Fn(&Core, &[f64], &[f64]) -> Vec<f64> + Sync,
    ) -> PyResult<Matrix<'py>> {
        let core = &self.core;
        let (own, beside) =
            (flat_rows(u, "u", core.n_parameters())?, flat_rows(others, "others", core.n_parameters())?);
        if own.len() != beside.len() {
            return Err(PyValueError::new_err("as many rows of both are needed"));
        }
        let values = work(py, || made(core, &own, &beside))?;
        in_matrix(py, u.shape()[0], core.n_parameters(), values)
    }
}

fn in_matrix(py: Python<'_>, rows: usize, columns: usize, values: Vec<f64>) -> PyResult<Matrix<'_>> {
    let array = Array2::from_shape_vec((rows, columns), values).map_err(|e| PyValueError::new_err(e.to_string()))?;
    Ok(array.into_pyarray(py))
}

/// The points of a name.
fn points(sampling: &str) -> PyResult<Sampling> {
    match sampling {
        "plain" => Ok(Sampling::Plain),
        "sobol" => Ok(Sampling::Sobol),
        other => Err(PyValueError::new_err(format!("unknown sampling '{other}'"))),
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
