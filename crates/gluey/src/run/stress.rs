//! What the contacts of spheres add to the mean stress.

use std::f64::consts::PI;

use gluey_contact::ContactError;
use gluey_geom::Particle;
use gluey_motion::MeanStress;

use super::contacts::Surrounded;

/// The mean stress of tractions, and of contacts: minus the mean product of the contact forces with the lines
/// between centres, in spheres that fill the periods of `contact`; nothing in 2D. Where contacts act in the
/// flow it has theirs already.
///
/// A force is `6 pi eta lambda` with lambda from the projection, in whose metric a sphere feels its own
/// Stokes drag only (Verdon et al. 2010, eq. 29): forces of clusters are as exact as that.
///
/// # Errors
/// If the contacts are not those of these particles.
pub(super) fn with_contacts<const D: usize>(
    stress: MeanStress<D>,
    contact: &impl Surrounded<D>,
    particles: &[Particle<D>],
) -> Result<MeanStress<D>, ContactError> {
    if stress.of_contacts.is_some() {
        return Ok(stress);
    }
    if D == 2 {
        return Ok(MeanStress { of_contacts: None, ..stress });
    }
    let volume: f64 = contact.domain().lattice.periods().iter().flatten().product();
    let of_network = contact.of_network(particles, |network| network.stress(volume))?;
    Ok(MeanStress { of_contacts: Some(of_network * (6.0 * PI * stress.viscosity)), ..stress })
}
