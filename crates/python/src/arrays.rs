//! Arrays of numpy as vectors, spins and matrices, and back. All are contiguous and of `float64`: the package
//! sees to that.

use gluey_geom::{Dim, Matrix, Spin, Vector};
use numpy::{PyArray, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A matrix of numbers as Python holds it.
pub type Numbers<'py> = PyReadonlyArray2<'py, f64>;
/// A row of numbers as Python holds it.
pub type FloatArray<'py> = PyReadonlyArray1<'py, f64>;

/// The rows of an `(N, D)` array.
pub fn vectors<const D: usize>(array: &Numbers<'_>) -> PyResult<Vec<Vector<D>>> {
    let numbers = array.as_slice()?;
    let (rows, columns) = shape(array);
    if columns != D {
        return Err(PyValueError::new_err(format!(
            "an array of shape ({rows}, {columns}); expected ({rows}, {D})"
        )));
    }
    Ok(numbers.chunks_exact(D).map(Vector::<D>::from_column_slice).collect())
}

/// The rows of an `(N, 1)` array in 2D, `(N, 3)` in 3D.
pub fn spins<const D: usize>(array: &Numbers<'_>) -> PyResult<Vec<Spin<D>>> {
    let numbers = array.as_slice()?;
    let ((rows, columns), rotations) = (shape(array), Dim::<D>::ROT);
    if columns != rotations {
        let wanted = format!("expected ({rows}, {rotations})");
        return Err(PyValueError::new_err(format!("an array of shape ({rows}, {columns}); {wanted}")));
    }
    let spin = |numbers: &[f64]| {
        let mut spin = Dim::<D>::zero_spin();
        numbers.iter().enumerate().for_each(|(k, number)| spin[k] = *number);
        spin
    };
    Ok(numbers.chunks_exact(rotations).map(spin).collect())
}

/// Rows and columns.
pub fn shape(array: &Numbers<'_>) -> (usize, usize) {
    let shape = array.as_array().raw_dim();
    (shape[0], shape[1])
}

/// Numbers as an array of this shape; their count fits it.
pub fn array<'py, T: numpy::Element, const K: usize>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: [usize; K],
) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray::from_vec(py, numbers).reshape(shape.to_vec())?.into_any())
}

/// An `(N, D)` array of these rows.
pub fn of_vectors<'py, const D: usize>(
    py: Python<'py>,
    vectors: impl IntoIterator<Item = Vector<D>>,
) -> PyResult<Bound<'py, PyAny>> {
    let numbers: Vec<f64> = vectors.into_iter().flat_map(|x| x.iter().copied().collect::<Vec<_>>()).collect();
    let rows = numbers.len() / D;
    array(py, numbers, [rows, D])
}

/// An `(N, 1)` array in 2D, `(N, 3)` in 3D.
pub fn of_spins<'py, const D: usize>(
    py: Python<'py>,
    spins: impl IntoIterator<Item = Spin<D>>,
) -> PyResult<Bound<'py, PyAny>> {
    let numbers: Vec<f64> = spins.into_iter().flat_map(|spin| Dim::<D>::spin_slice(&spin).to_vec()).collect();
    let rows = numbers.len() / Dim::<D>::ROT;
    array(py, numbers, [rows, Dim::<D>::ROT])
}

/// An `(N, D, D)` array.
pub fn of_matrices<'py, const D: usize>(
    py: Python<'py>,
    matrices: &[Matrix<D>],
) -> PyResult<Bound<'py, PyAny>> {
    let entries = |matrix: &Matrix<D>| matrix.transpose().iter().copied().collect::<Vec<_>>();
    array(py, matrices.iter().flat_map(entries).collect(), [matrices.len(), D, D])
}
