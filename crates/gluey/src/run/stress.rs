//! What the contacts of spheres add to the mean stress.

use std::f64::consts::PI;

use gluey_contact::{ContactError, ContactModel, ContactNetwork};
use gluey_geom::{Dim, Matrix, Particle, Space, Vector};
use gluey_motion::MeanStress;

use super::contacts::Contacts;

/// Minus the mean product of the contact forces with the lines between centres, in spheres that fill the
/// periods of `contact`; nothing in 2D.
///
/// A force is `6 pi eta lambda` with lambda from the projection, in whose metric a sphere feels its own
/// Stokes drag only (Verdon et al. 2010, eq. 29): forces of clusters are as exact as that.
fn of_contacts<const D: usize>(
    contact: &Contacts<'_, D>,
    particles: &[Particle<D>],
    viscosity: f64,
) -> Result<Option<Matrix<D>>, ContactError>
where
    Dim<D>: Space<D>,
{
    if D == 2 {
        return Ok(None);
    }
    let domain = contact.domain();
    let volume: f64 = domain.lattice.periods().iter().flatten().product();
    let centers: Vec<Vector<D>> = particles.iter().map(|particle| particle.pose.position).collect();
    let radii: Vec<f64> = particles.iter().map(|particle| particle.radius).collect();
    let network = ContactNetwork::new(contact.contacts(), &centers, &radii, domain)?;
    Ok(Some(network.stress(volume) * (6.0 * PI * viscosity)))
}

/// The mean stress of tractions and contacts.
///
/// # Errors
/// If the contacts are not those of these particles.
pub(super) fn with_contacts<const D: usize>(
    stress: MeanStress<D>,
    contact: &Contacts<'_, D>,
    particles: &[Particle<D>],
) -> Result<MeanStress<D>, ContactError>
where
    Dim<D>: Space<D>,
{
    Ok(MeanStress { of_contacts: of_contacts(contact, particles, stress.viscosity)?, ..stress })
}
