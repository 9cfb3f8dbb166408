//! Settings of a run in words: nobody should have to open a case file to learn it.

use gluey::case::{Boundary, Lubrication, Memory, ParticleVelocity};
use gluey::{Case, Formulation, Strategy};
use serde::Serialize;

/// The settings of a run that a reader of its figure asks for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Formulation of rigidity with its parameters.
    pub flow: String,
    /// Contact law and how its constraint and memory are treated.
    pub contact: String,
    /// Box and boundary condition.
    pub domain: String,
    /// Cell size at the surfaces, `a/h`.
    pub cells_per_radius: f64,
    /// Time step.
    pub time_step: f64,
    /// End of the run.
    pub end: f64,
}

impl Settings {
    /// Those of `case`.
    pub fn of(case: &Case) -> Self {
        Self {
            flow: flow(case),
            contact: contact(case),
            domain: match case.domain.boundary {
                Boundary::Couette => "Couette flow on all sides".to_owned(),
                Boundary::Sheared => "periodic in all directions, images slide".to_owned(),
                Boundary::Periodic => "walls below and above, periodic in x".to_owned(),
            },
            cells_per_radius: case.cells_per_radius(),
            time_step: case.time.step,
            end: case.time.end,
        }
    }

    /// Notes under a figure, one string per line.
    pub fn figure_notes(&self) -> [String; 2] {
        let Self { flow, cells_per_radius, time_step, .. } = self;
        [format!("{flow};"), format!("*a*/*h* = {cells_per_radius}, time step {time_step}.")]
    }

    /// All in one line.
    pub fn line(&self) -> String {
        let Self { flow, contact, domain, cells_per_radius, time_step, end } = self;
        format!("{flow}; {contact}; {domain}; a/h = {cells_per_radius}; time step {time_step}, to t = {end}")
    }
}

fn flow(case: &Case) -> String {
    let flow = &case.flow;
    match flow.formulation {
        Formulation::Unfitted => match case.lubrication() {
            Lubrication::Deficit => "unfitted, lubrication below the cell".to_owned(),
            Lubrication::None => "unfitted, no lubrication below the cell".to_owned(),
        },
        Formulation::Paper => {
            let paper = &flow.paper;
            let velocity = match paper.velocity {
                ParticleVelocity::Mean => "mean over the particle",
                ParticleVelocity::Center => "at the centre",
            };
            format!(
                "paper, r = {}, ramp {} h, {} Uzawa steps with rho = {}, velocity {velocity}",
                paper.viscosity_ratio, paper.ramp, paper.uzawa_steps, paper.rho
            )
        }
    }
}

fn contact(case: &Case) -> String {
    let contact = &case.contact;
    if contact.strategy == Strategy::None {
        return "no contact".to_owned();
    }
    let gap = if contact.exact_gap { "exact gap" } else { "gap to first order" };
    match (contact.strategy, contact.memory) {
        (Strategy::Gluey, Memory::Consistent) => format!("gluey, {gap}, consistent memory"),
        (Strategy::Gluey, Memory::Paper) => format!("gluey, {gap}, memory in whole steps"),
        (strategy, _) => format!("{strategy}, {gap}"),
    }
}
