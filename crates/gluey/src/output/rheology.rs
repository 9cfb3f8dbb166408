//! The rheology of a sheared suspension as comma-separated values, a row whenever its stress was computed.
//!
//! Viscosities are over that of the fluid, stresses over viscosity and size of the shear rate. `viscosity` is
//! by the stresslets of the particles and by the forces between them, `viscosity_by_dissipation` by the power
//! that fluid and films dissipate, and friction of contacts in the flow, less that of weight and other forces
//! of the case: without repulsion, and without contacts that correct velocities after the flow, the
//! difference is an error of discretisation. It is empty where these forces do more than the shear.
//! `viscosity_of_films`,
//! `viscosity_of_contacts`, `viscosity_of_friction`, and `viscosity_of_repulsion` are the shares of films too
//! thin for the mesh, of contacts, of their tangential forces alone, and of repulsion in the first; those of
//! contacts are there where these act in the flow, and in 3D. `sticking_contacts` and `sliding_contacts` are
//! those of a particle in the mean, where they act in the flow. `particle_pressure` is `-tr S / (D V)`,
//! relative to the mean pressure of the fluid.

use gluey_motion::MeanStress;

use super::line_of;

/// The first line in 3D where contacts act in the flow; elsewhere there is no share of friction, and contacts
/// neither stick nor slide. In 2D there is no `N2`, and forces of contacts have a unit of force in the flow
/// only.
const NAMES: [&str; 14] = [
    "t",
    "strain",
    "viscosity",
    "viscosity_by_dissipation",
    "viscosity_of_films",
    "viscosity_of_contacts",
    "viscosity_of_friction",
    "viscosity_of_repulsion",
    "N1",
    "N2",
    "particle_pressure",
    "sticking_contacts",
    "sliding_contacts",
    "min_gap_over_a",
];

/// A row: the stress, and when it was.
#[derive(Clone, Copy, Debug)]
pub struct Rheology<'a, const D: usize> {
    /// Time.
    pub time: f64,
    /// Shear strain since the beginning, less what was sheared back.
    pub strain: f64,
    /// The stress.
    pub stress: &'a MeanStress<D>,
    /// Contacts of a particle that stick and that slide, in the mean; where they act in the flow.
    pub contacts_per_particle: Option<[f64; 2]>,
    /// Smallest gap in mean radii, if there is any.
    pub smallest_gap_over_a: Option<f64>,
    /// Time and shear rate, where the stress is given and the time above is the strain.
    pub time_and_rate: Option<[f64; 2]>,
}

/// The first line; `t` is the strain and time and shear rate have columns where the stress is given, friction
/// where contacts act in the flow.
pub fn header<const D: usize>(is_at_given_stress: bool, acts_in_flow: bool) -> String {
    let is_there = |name: &&str| match *name {
        "N2" => D == 3,
        "viscosity_of_contacts" => D == 3 || acts_in_flow,
        "viscosity_of_friction" | "sticking_contacts" | "sliding_contacts" => acts_in_flow,
        _ => true,
    };
    let more = if is_at_given_stress { &["time", "shear_rate"][..] } else { &[] };
    let names: Vec<&str> = NAMES.iter().filter(|name| is_there(name)).chain(more).copied().collect();
    names.join(",")
}

/// A row as text, with its end of line.
pub fn line<const D: usize>(row: &Rheology<'_, D>) -> String {
    let stress = row.stress;
    let [n1, n2] = stress.normal_stress_differences();
    let first = [Some(row.time), Some(row.strain), Some(stress.relative_viscosity())];
    let others = [stress.viscosity_by_dissipation(), Some(stress.viscosity_of_films())];
    // What there is in 3D only has no cell in 2D; what has no number has an empty one.
    let contacts = stress.viscosity_of_contacts().map(Some);
    let friction = stress.viscosity_of_friction().map(Some);
    let shares = contacts.into_iter().chain(friction).chain([Some(stress.viscosity_of_repulsion())]);
    let normal = n1.into_iter().chain(n2).chain([stress.particle_pressure()]).map(Some);
    let more = row.time_and_rate.into_iter().flatten().map(Some);
    let contacts = row.contacts_per_particle.into_iter().flatten().map(Some);
    let numbers = first.into_iter().chain(others).chain(shares).chain(normal).chain(contacts);
    line_of(numbers.chain([row.smallest_gap_over_a]).chain(more), 16)
}

#[cfg(test)]
mod tests {
    use gluey_geom::Matrix;

    use super::*;

    /// Of a fluid of viscosity 2 sheared back at the rate 0.5.
    #[test]
    fn a_row_has_a_number_for_each_name() {
        let mut of_bodies = Matrix::<3>::from_diagonal(&[-3.0, -2.0, -4.0].into());
        (of_bodies[(0, 1)], of_bodies[(1, 0)]) = (-1.5, -1.5);
        let stress = MeanStress {
            rate: -0.5,
            viscosity: 2.0,
            of_bodies,
            of_films: of_bodies * 0.1,
            of_contacts: Some(of_bodies * 0.5),
            of_friction: None,
            of_repulsion: of_bodies * 0.5,
            dissipation: 1.75,
            work_of_forces: 0.5,
            work_of_contacts: 0.0,
        };
        let row = Rheology {
            time: 1.0,
            strain: -0.5,
            stress: &stress,
            contacts_per_particle: None,
            smallest_gap_over_a: Some(0.25),
            time_and_rate: None,
        };
        let line = line(&row);
        let numbers: Vec<f64> =
            line.trim_end().split(',').map(|cell| cell.parse().expect("a number")).collect();
        let expected = [1.0, -0.5, 4.0, 2.5, 0.15, 0.75, 0.75, -2.0, 4.0, 6.0, 0.25];
        assert!(numbers.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{numbers:?}");
        assert_eq!(numbers.len(), header::<3>(false, false).split(',').count());
        assert_eq!(header::<2>(false, false).split(',').count(), numbers.len() - 2);
        let rubbing = MeanStress { of_friction: Some(of_bodies * 0.25), work_of_contacts: -0.25, ..stress };
        let line = self::line(&Rheology { stress: &rubbing, contacts_per_particle: Some([0.5, 1.5]), ..row });
        let cells: Vec<&str> = line.trim_end().split(',').collect();
        assert_eq!(cells.len(), header::<3>(false, true).split(',').count());
        let [by_power, of_friction] = [cells[3], cells[6]].map(|cell| cell.parse::<f64>().expect("a number"));
        assert_eq!(cells[11..13], ["5.0000000000000000e-1", "1.5000000000000000e0"], "{line}");
        assert!((by_power - 3.0).abs() + (of_friction - 0.375).abs() < 1e-14, "{line}");
        let stress = MeanStress { work_of_forces: 1.0, ..stress };
        let line = self::line(&Rheology { stress: &stress, ..row });
        assert_eq!(line.split(',').nth(3), Some(""), "forces do more than the shear");
    }
}
