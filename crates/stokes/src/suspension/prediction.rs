//! What a flow predicts of the particles of a configuration.

use gluey_geom::{Matrix, Twist, Vector, Wrench};
use gluey_motion::{Configuration, ContactLoads, Fields, Film, Holding, MeanStress, PairKey, Prediction};

use super::Suspension;
use crate::film::{self, Lubrication, Partner};
use crate::flow::{Flow, added};

impl<const D: usize> Suspension<D> {
    /// What a flow in a fluid of this viscosity predicts, with the rate that its [`super::Drive`] has; the
    /// statistics are left to the solver.
    pub fn prediction(
        &self,
        configuration: &Configuration<'_, D>,
        viscosity: f64,
        flow: &Flow<D>,
        rate: f64,
    ) -> Prediction<D> {
        Prediction {
            rate,
            stress: self.mean_stress(configuration, viscosity, flow, rate),
            holding: self.holding(configuration, flow),
            ..Prediction::of(self.twists_in_space(configuration, flow))
        }
    }

    fn twists_in_space(&self, configuration: &Configuration<'_, D>, flow: &Flow<D>) -> Vec<Twist<D>> {
        let undisturbed = self.undisturbed(configuration.shear_factor);
        let in_space = |index: usize| match self.is_sheared() {
            true => flow.twists[index] + undisturbed.twist(&configuration.particles[index].pose.position),
            false => flow.twists[index],
        };
        // Those that are given without the rounding of what the flow is relative to.
        let given = |index: usize| self.given_twist(index, configuration.shear_factor);
        (0..flow.twists.len()).map(|index| given(index).unwrap_or_else(|| in_space(index))).collect()
    }

    /// The mean stress, where it is wanted.
    fn mean_stress(
        &self,
        configuration: &Configuration<'_, D>,
        viscosity: f64,
        flow: &Flow<D>,
        rate: f64,
    ) -> Option<MeanStress<D>> {
        let stress = flow.stress.as_ref().filter(|_| configuration.with_stress)?;
        let volume = self.domain.extent().product();
        let power = |wrenches: &[Wrench<D>]| -> f64 {
            wrenches.iter().zip(&flow.twists).map(|(wrench, twist)| wrench.power(twist)).sum()
        };
        let shear = self.shear_rate * configuration.shear_factor;
        let contacts = configuration.contacts;
        let of_contact =
            |loads: &ContactLoads<D>| power(&loads.wrenches) / volume - shear * loads.stress[(0, 1)];
        Some(MeanStress {
            rate: shear,
            viscosity,
            of_bodies: stress.of_bodies(volume),
            of_films: stress.of_films.iter().sum::<Matrix<D>>() / volume,
            of_contacts: contacts.map(|contacts| contacts.stress),
            of_friction: contacts.map(|contacts| contacts.stress_of_friction),
            of_repulsion: configuration.pair_stress / rate,
            dissipation: stress.dissipation / volume,
            work_of_forces: power(&self.wrenches) / volume,
            work_of_contacts: contacts.map_or(0.0, of_contact),
        })
    }

    /// What holds the particles whose motions are given.
    fn holding(&self, configuration: &Configuration<'_, D>, flow: &Flow<D>) -> Option<Holding<D>> {
        let without = self.acting(configuration);
        let in_contact = configuration.contacts.map_or(&[][..], |contacts| &contacts.wrenches);
        let acting = added(&without, in_contact);
        let holds = |index: usize| flow.wrenches[index] - acting.get(index).copied().unwrap_or_default();
        let held = (0..self.given.len()).filter(|&index| self.given[index].is_some());
        Some(Holding {
            mean_velocity: flow.mean_velocity?,
            force_density: flow.mean_force + self.force_density.unwrap_or_else(Vector::zeros),
            wrenches: held.map(|index| (index, holds(index))).collect(),
        })
    }

    /// The films of a configuration that lubrication keeps open, with gaps up to `reach`.
    pub fn films(&self, configuration: &Configuration<'_, D>, reach: f64) -> Vec<Film<D>> {
        if self.lubrication != Lubrication::Deficit {
            return Vec::new();
        }
        let mut films = film::films(&self.balls(configuration), &self.domain, reach);
        films.retain(|film| !film.is_across_flow());
        let is_held = |body: usize| self.given.get(body).is_some_and(Option::is_some);
        let film = |film: film::Film<D>| Film {
            pair: self.pair(configuration, &film),
            branch: film.branch(),
            slide: self.slide(configuration, &film),
            is_held: [0, 1].map(|side| film.side(side).is_some_and(is_held)),
            gap: film.gap,
            curvature_radius: film.curvature_radius(),
        };
        films.into_iter().map(film).collect()
    }

    /// The name of a film. Walls are counted as those of contact: from those across `y` on, through which no
    /// flow goes.
    pub(super) fn pair(&self, configuration: &Configuration<'_, D>, film: &film::Film<D>) -> PairKey {
        let first = film.body as usize;
        match film.partner {
            Partner::Wall { axis, is_upper } => {
                PairKey::wall(first, 2 * (axis as usize - 1) + usize::from(is_upper))
            }
            Partner::Body(second) => {
                let place = |body: usize| configuration.particles[body].pose.position;
                let direct = place(second as usize) - place(first);
                let (_, image) = self.lattice(configuration).nearest(&(direct - film.branch()));
                let image = std::array::from_fn(|d| image.get(d).copied().unwrap_or(0));
                PairKey::across(first, second as usize, image)
            }
        }
    }

    /// Velocity of the image at a film beyond that of its particle.
    fn slide(&self, configuration: &Configuration<'_, D>, film: &film::Film<D>) -> Vector<D> {
        let mut slide = Vector::zeros();
        if let (true, Some(second)) = (self.is_sheared(), film.side(1)) {
            let y = |body: usize| configuration.particles[body].pose.position[1];
            let direct = y(second) - y(film.body as usize);
            slide[0] = self.shear_rate * configuration.shear_factor * (film.branch()[1] - direct);
        }
        slide
    }

    /// Fields on a mesh that is sheared so much, with the undisturbed flow and where they are in space.
    pub fn in_space(&self, mut fields: Fields<D>, shear: f64, shear_factor: f64) -> Fields<D> {
        let undisturbed = self.undisturbed(shear_factor);
        let nodes = fields.points.iter_mut().zip(&mut fields.velocity).filter(|_| self.is_sheared());
        for (point, velocity) in nodes {
            point[0] += shear * (point[1] - self.domain.lower[1]);
            *velocity += undisturbed.velocity(point);
        }
        fields
    }
}
