//! What conditions say of the bodies.

use gluey_geom::{Dim, Space, Wrench};
use gluey_stokes::{Conditions, Given, GivenOf};

use crate::bodies::NearBodies;
use crate::flow::FlowError;

/// # Errors
/// [`FlowError::Count`].
pub(super) fn check_count<const D: usize>(
    conditions: &Conditions<'_, D>,
    bodies: usize,
) -> Result<(), FlowError>
where
    Dim<D>: Space<D>,
{
    let found = match conditions.bodies {
        Given::Wrenches([]) => bodies,
        Given::Wrenches(wrenches) => wrenches.len(),
        Given::Twists(twists) => twists.len(),
        Given::Each(each) => each.len(),
    };
    if found == bodies { Ok(()) } else { Err(FlowError::Count { found, bodies }) }
}

/// What is known of the bodies near a part, for sums over ranks: wrenches of own bodies, motions of all.
pub(super) fn given<const D: usize>(
    conditions: &Conditions<'_, D>,
    bodies: &NearBodies<D>,
    rank: usize,
) -> Vec<GivenOf<D>>
where
    Dim<D>: Space<D>,
{
    let of = |id: u32| match conditions.bodies {
        Given::Wrenches(all) => GivenOf::Wrench(all.get(id as usize).copied().unwrap_or_default()),
        Given::Twists(all) => GivenOf::Twist(all[id as usize]),
        Given::Each(all) => all[id as usize],
    };
    let mut given: Vec<GivenOf<D>> = bodies.ids.iter().map(|&id| of(id)).collect();
    let own = bodies.owned(rank);
    for (given, place) in given.iter_mut().zip(0..) {
        if given.wrench().is_some() && own.binary_search(&place).is_err() {
            *given = GivenOf::Wrench(Wrench::default());
        }
    }
    given
}
