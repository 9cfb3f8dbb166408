//! Hard discs and spheres in equilibrium: their correlations are those of the equations of state.

use gluey_geom::Vector;
use gluey_suspension::Container;
use gluey_suspension::packing::{Amount, Arrangement, Packing, PackingParams};
use gluey_suspension::statistics::Estimate;
use gluey_suspension::structure::{
    GapStatistics, ProximityNetwork, RadialDistribution, StructureFactor, compressibility, contact_value,
};

/// Contact values of independent arrangements, and their structure factor at small wave numbers.
fn measure<const D: usize>(fraction: f64, count: usize, samples: u64) -> (Estimate, f64) {
    let container = Container::<D>::periodic(&Vector::repeat(1.0));
    let arrangement = Arrangement::Equilibrium { sweep_count: 3000 };
    let params = PackingParams { arrangement, ..PackingParams::new(Amount::Count { fraction, count }) };
    let step = std::f64::consts::TAU;
    let mut factor = StructureFactor::new(1.6 * step, 1.6 * step);
    let values: Vec<f64> = (1..=samples)
        .map(|seed| {
            let fluid = Packing::new(&container, &PackingParams { seed, ..params }).expect("room");
            factor.add(&container, &fluid.positions);
            let a = fluid.radii[0];
            // Bins begin at contact.
            let mut radial = RadialDistribution::new(&container, 4.0 * a, 80);
            radial.add(&container, &fluid.positions, a);
            radial.at_contact(2.0 * a).expect("bins")
        })
        .collect();
    (Estimate::of(&values).expect("values"), factor.bins()[0].s)
}

fn check<const D: usize>(fraction: f64) {
    let (contact, factor) = measure::<D>(fraction, 500, 10);
    let (exact, limit) = (contact_value::<D>(fraction), compressibility::<D>(fraction));
    println!("{D}D {fraction}: g(2a) = {:.3} +- {:.3}, exact {exact:.3}", contact.mean, contact.half_width);
    println!("    S = {factor:.4}, {limit:.4} at k = 0");
    assert!((contact.mean - exact).abs() < 1.5 * contact.half_width + 0.02 * exact, "{contact:?} {exact}");
    assert!((0.6..1.6).contains(&(factor / limit)), "{factor} {limit}");
}

#[test]
fn discs_correlate_as_hard_discs() {
    check::<2>(0.3);
    check::<2>(0.6);
}

#[test]
fn spheres_correlate_as_hard_spheres() {
    check::<3>(0.3);
    check::<3>(0.5);
}

/// Torquato's nearest gaps are positive, and near pairs are as many as the contact value says.
#[test]
fn near_pairs_are_as_many_as_the_contact_value_says() {
    let container = Container::<3>::periodic(&Vector::repeat(1.0));
    let phi = 0.4;
    let params = PackingParams::new(Amount::Count { fraction: phi, count: 1000 });
    let fluid = Packing::new(&container, &params).expect("room");
    let reach = 0.05 * fluid.radii[0];
    let network = ProximityNetwork::new(&container, &fluid.positions, &fluid.radii, reach);
    // 8 phi ((1 + s)^3 - 1) g, with s the reach over the diameter; g falls off within it.
    let most = 8.0 * phi * (1.025f64.powi(3) - 1.0) * contact_value::<3>(phi);
    let found = network.coordination().expect("known").mean;
    assert!((0.8 * most..1.1 * most).contains(&found), "{found} {most}");
    let fabric = network.fabric().expect("pairs");
    assert!((0..3).all(|d| (fabric[(d, d)] - 1.0 / 3.0).abs() < 0.06), "{fabric}");
    let gaps = GapStatistics::of(&container, &fluid.positions, &fluid.radii).expect("neighbours");
    assert!(0.0 <= gaps.smallest && gaps.smallest < gaps.percentile && gaps.percentile < gaps.median);
}
