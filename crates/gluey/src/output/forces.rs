//! What holds or drives particles as comma-separated values, a row per step.
//!
//! Force and torque on each such particle by what holds it, about its centre: together with fluid, films,
//! weight and repulsion they make it move as it is told. Without weight and free particles their sum is minus
//! that of the force density on the box. Before them stand the mean velocity of fluid and particles over the
//! box and the force density.

use gluey_geom::Dim;
use gluey_motion::Holding;

use super::line_of;

const AXES: [&str; 3] = ["x", "y", "z"];

/// The first line, for the particles of these indices.
pub fn header<const D: usize>(particles: impl IntoIterator<Item = usize>) -> String {
    let mut names = vec!["t".to_owned()];
    names.extend(AXES[..D].iter().map(|axis| format!("mean_velocity_{axis}")));
    names.extend(AXES[..D].iter().map(|axis| format!("body_force_{axis}")));
    for number in particles.into_iter().map(|index| index + 1) {
        names.extend(AXES[..D].iter().map(|axis| format!("force{number}{axis}")));
        match D {
            2 => names.push(format!("torque{number}")),
            _ => names.extend(AXES[..D].iter().map(|axis| format!("torque{number}{axis}"))),
        }
    }
    names.join(",")
}

/// A row as text, with its end of line.
pub fn line<const D: usize>(time: f64, holding: &Holding<D>) -> String {
    let of_particles = holding.wrenches.iter().flat_map(|(_, wrench)| {
        wrench.force.iter().chain(Dim::<D>::spin_slice(&wrench.torque)).copied().collect::<Vec<f64>>()
    });
    let of_box = holding.mean_velocity.iter().chain(&holding.force_density).copied();
    line_of([time].into_iter().chain(of_box).chain(of_particles), 16)
}

#[cfg(test)]
mod tests {
    use gluey_geom::{Spin, Vector, Wrench};

    use super::*;

    #[test]
    fn a_row_has_a_number_for_each_name() {
        let wrench = Wrench { force: Vector::<2>::new(1.0, -2.0), torque: Spin::<2>::new(0.5) };
        let (mean_velocity, force_density) = (Vector::<2>::new(0.25, 0.0), Vector::<2>::new(0.0, 7.0));
        let holding = Holding { mean_velocity, force_density, wrenches: vec![(2, wrench)] };
        let names = "t,mean_velocity_x,mean_velocity_y,body_force_x,body_force_y,force3x,force3y,torque3";
        assert_eq!(header::<2>([2]), names);
        let line = line(3.0, &holding);
        let numbers: Vec<f64> = line.trim_end().split(',').map(|x| x.parse().expect("a number")).collect();
        assert_eq!(numbers, [3.0, 0.25, 0.0, 0.0, 7.0, 1.0, -2.0, 0.5]);
        assert_eq!(header::<3>([0, 4]).split(',').count(), 7 + 2 * 6);
    }
}
