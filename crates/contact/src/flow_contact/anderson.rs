//! Anderson's acceleration of iterations (Anderson 1965, 10.1145/321296.321305; Walker and Ni 2011,
//! 10.1137/10078356X).

use gluey_geom::{Dim, Twist, Vector};

/// The last steps of an iteration `x -> T(x)`.
#[derive(Clone, Debug)]
pub struct Anderson {
    window: usize,
    /// Images `T(x)` and residuals `T(x) - x`, weighted as their sizes are to be measured; the newest last.
    images: Vec<Vec<f64>>,
    residuals: Vec<Vec<f64>>,
}

/// A direction of which less than this share is new is no new one.
const DEPENDENT: f64 = 1e-8;

impl Anderson {
    /// Of the last `window` steps at most.
    pub fn new(window: usize) -> Self {
        Self { window, images: Vec::new(), residuals: Vec::new() }
    }

    /// Forgets all steps.
    pub fn restart(&mut self) {
        self.images.clear();
        self.residuals.clear();
    }

    /// The same for motions.
    pub fn next_twists<const D: usize>(&mut self, twists: &mut [Twist<D>], residual: Vec<f64>) {
        let numbers = |twist: &Twist<D>| {
            let spin = Dim::<D>::spin_slice(&twist.spin).to_vec();
            twist.velocity.iter().copied().chain(spin).collect::<Vec<f64>>()
        };
        let next = self.next(twists.iter().flat_map(numbers).collect(), residual);
        let rigid = Dim::<D>::RIGID;
        for (twist, numbers) in twists.iter_mut().zip(next.chunks_exact(rigid)) {
            twist.velocity = Vector::from_column_slice(&numbers[..D]);
            (D..rigid).for_each(|k| twist.spin[k - D] = numbers[k]);
        }
    }

    /// Where to go on: the combination of the images whose combined residual is the smallest, with weights
    /// whose sum is one.
    pub fn next(&mut self, image: Vec<f64>, residual: Vec<f64>) -> Vec<f64> {
        self.images.push(image);
        self.residuals.push(residual);
        if self.images.len() > self.window {
            self.images.remove(0);
            self.residuals.remove(0);
        }
        let last = self.images.len() - 1;
        let mut next = self.images[last].clone();
        let mut left = self.residuals[last].clone();
        // Orthogonal differences to the newest residual, from the newest on, each with its difference of
        // images.
        let mut basis: Vec<[Vec<f64>; 2]> = Vec::with_capacity(last);
        for k in (0..last).rev() {
            let mut step = minus(&self.residuals[last], &self.residuals[k]);
            let mut move_of = minus(&self.images[last], &self.images[k]);
            let size = dot(&step, &step);
            for [other, its_move] in &basis {
                let share = dot(&step, other) / dot(other, other);
                subtract(share, other, &mut step);
                subtract(share, its_move, &mut move_of);
            }
            let square = dot(&step, &step);
            if square <= DEPENDENT * DEPENDENT * size || square == 0.0 {
                continue;
            }
            let share = dot(&left, &step) / square;
            subtract(share, &step, &mut left);
            subtract(share, &move_of, &mut next);
            basis.push([step, move_of]);
        }
        next
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// `y -= factor x`.
fn subtract(factor: f64, x: &[f64], y: &mut [f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y -= factor * x);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear iteration in so many dimensions ends after so many steps and one, where it would not end by
    /// itself.
    #[test]
    fn linear_iterations_end() {
        let factors = [0.9, -1.5, 3.0];
        let mut anderson = Anderson::new(5);
        let mut x = vec![1.0; 3];
        for _ in 0..4 {
            let image: Vec<f64> = x.iter().zip(factors).map(|(x, q)| q * x + 1.0 - q).collect();
            let image: Vec<f64> = image.iter().map(|y| y + 1.0).collect();
            let residual = minus(&image, &x);
            x = anderson.next(image, residual);
        }
        for (x, q) in x.iter().zip(factors) {
            assert!((x - (2.0 - q) / (1.0 - q)).abs() < 1e-9, "{x} {q}");
        }
    }
}
