//! What belongs to bodies as numbers, for sums over ranks.

use gluey_geom::{Dim, Matrix, Spin, Twist, Vector, Wrench};

/// A quantity of a body in numbers of which ranks know how many there are.
pub trait BodyNumbers {
    /// How many.
    const COUNT: usize;

    /// Writes them.
    fn write(&self, numbers: &mut [f64]);

    /// The quantity that they stand for.
    fn read(numbers: &[f64]) -> Self;
}

impl<const D: usize> BodyNumbers for Twist<D> {
    const COUNT: usize = Dim::<D>::RIGID;

    fn write(&self, numbers: &mut [f64]) {
        write_pair(&self.velocity, &self.spin, numbers);
    }

    fn read(numbers: &[f64]) -> Self {
        let (velocity, spin) = read_pair(numbers);
        Self { velocity, spin }
    }
}

impl<const D: usize> BodyNumbers for Wrench<D> {
    const COUNT: usize = Dim::<D>::RIGID;

    fn write(&self, numbers: &mut [f64]) {
        write_pair(&self.force, &self.torque, numbers);
    }

    fn read(numbers: &[f64]) -> Self {
        let (force, torque) = read_pair(numbers);
        Self { force, torque }
    }
}

impl<const D: usize> BodyNumbers for Matrix<D> {
    const COUNT: usize = D * D;

    fn write(&self, numbers: &mut [f64]) {
        numbers.copy_from_slice(self.as_slice());
    }

    fn read(numbers: &[f64]) -> Self {
        Self::from_column_slice(numbers)
    }
}

fn write_pair<const D: usize>(vector: &Vector<D>, spin: &Spin<D>, numbers: &mut [f64]) {
    numbers[..D].copy_from_slice(vector.as_slice());
    numbers[D..].copy_from_slice(Dim::<D>::spin_slice(spin));
}

fn read_pair<const D: usize>(numbers: &[f64]) -> (Vector<D>, Spin<D>) {
    let mut spin = Dim::<D>::zero_spin();
    (0..Dim::<D>::ROT).for_each(|k| spin[k] = numbers[D + k]);
    (Vector::from_column_slice(&numbers[..D]), spin)
}
