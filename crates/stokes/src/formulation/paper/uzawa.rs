//! Uzawa's iteration for the multiplier of the rigidity, equations 8 to 10 of Verdon et al. 2010.
//!
//! Step `k`, from `lambda^0 = 0`, with the matrix `K(eta)` of `int 2 eta eps(u):eps(v)`:
//!
//! `K(eta) u^k - B^T p^k = -1/2 K(I eta_s) lambda^(k-1)`, `B u^k = 0` (eq. 9),
//! `lambda^k = lambda^(k-1) + rho u^k` (eq. 10).
//!
//! The bilinear form carries `2 eta_s` and the update steps with `eta_s`, so it converges for `0 < rho < 4`
//! to the saddle point of eq. 8. Each prediction starts cold and makes a fixed number of steps: the softness
//! this leaves is part of the formulation. One step alone never uses the multiplier: a penalty method.

use gluey_linalg::vector;

use super::params::PaperParams;
use super::stress::{SolidOperator, SolidStress};
use crate::error::StokesError;
use crate::formulation::problem::{FlowData, LinearSolve, Multiplier, Problem};
use crate::operator::StokesSystem;

/// The steps of a prediction; `x` holds the last velocity and pressure afterwards.
pub fn solve<const D: usize>(
    params: &PaperParams,
    stress: &SolidStress<D>,
    problem: &Problem<D>,
    data: &FlowData<'_>,
    x: &mut [f64],
    solve: &mut LinearSolve<'_>,
) -> Result<Multiplier, StokesError> {
    let (system, reference) = (&problem.system, vector::norm(data.b));
    let mut multiplier = vec![0.0; system.space.full_dim()];
    let mut stress = (params.uzawa_steps > 1).then(|| stress.operator(system.space.nodes()));
    for step in 0..params.uzawa_steps {
        let mut b = data.b.to_vec();
        if let Some(stress) = stress.as_mut().filter(|_| step > 0) {
            subtract_multiplier(system, stress, &multiplier, &mut b);
        }
        let scale = reference / vector::norm(&b).max(f64::MIN_POSITIVE);
        solve(&b, x, scale.min(1.0))?;
        vector::axpy(params.rho, &problem.velocity(data.lift, x), &mut multiplier);
    }
    Ok(multiplier)
}

/// The right-hand side of eq. 9: `b -= int I eta_s eps(lambda):eps(v)`, half of `K(I eta_s) lambda`, which
/// carries `2 eta_s`.
fn subtract_multiplier<const D: usize>(
    system: &StokesSystem<D>,
    stress: &mut SolidOperator<D>,
    multiplier: &[f64],
    b: &mut [f64],
) {
    let mut load = vec![0.0; system.velocity_dim()];
    stress.apply(multiplier, &mut load);
    system.space.reduce(&mut load);
    vector::axpy(-0.5, &load, &mut b[..system.velocity_dim()]);
}
