//! Contacts between round particles: the gluey model and its relatives, without a fluid.
//!
//! A step of an explicit scheme moves particles by `x^{n+1} = x^n + c u^n + drift`. [`PairContact`] replaces
//! the predicted velocities `u*` by the nearest ones that keep particles apart,
//!
//! ```text
//! minimise 1/2 |v - u*|_M^2   subject to   D + (drift_j - drift_i).e + c (v_j - v_i).e  >= 0   (gamma = 0)
//!                                                                                       = 0    (gamma < 0)
//! ```
//!
//! and remembers in `gamma <= 0` how long a pair was pressed together: `d gamma / dt = -lambda` (Verdon et
//! al. 2010, DOI 10.3166/REMN.16.365-383; Maury 2007; Lefebvre 2009, DOI 10.1051/m2an/2008042). A pair that
//! is pulled apart stays closed until the pull has made up for the push, as the lubrication film between
//! smooth particles does; that is what keeps suspensions reversible.
//!
//! ```
//! use gluey_contact::{ContactModel, ContactParams, PairContact, StepGeometry};
//! use gluey_geom::{Spin, Twist, Vector};
//!
//! let (positions, radii) = ([Vector::<2>::new(0.0, 0.0), Vector::<2>::new(2.1, 0.0)], [1.0, 1.0]);
//! let (drift, dt) = ([Vector::zeros(); 2], 0.1);
//! let step = StepGeometry { positions: &positions, radii: &radii, drift: &drift, velocity_weight: dt, dt };
//! let run = |x| Twist { velocity: Vector::<2>::new(x, 0.0), spin: Spin::<2>::new(0.0) };
//! let mut twists = [run(1.0), run(-1.0)];
//!
//! let mut contact = PairContact::new(ContactParams::default());
//! contact.correct(&step, &mut twists)?;
//! // The discs would overlap by 0.1; they touch instead, and the contact has a memory.
//! assert!((twists[0].velocity.x - 0.5).abs() < 1e-12);
//! assert!(contact.contacts()[0].gamma < 0.0);
//! # Ok::<(), gluey_contact::ContactError>(())
//! ```
//!
//! Conventions. `lambda > 0` pushes apart. `e` points from the first to the second particle of a pair.
//! `lambda` is the contact force over `6 pi eta` (length^2/time), `M (u - u*) = B^T lambda` with
//! `M = diag(a_i)`; `gamma` is its time integral (length^2). The paper's multipliers are
//! `delta = lambda / c`, its gamma ours over `c`: only the unit differs (its text around eq. 24 has the
//! factor in `M`), and the duration of contacts does not depend on it.
//!
//! Where lubrication acts, [`FilmMemory`] keeps films open before contact is corrected for.
//!
//! [`FlowContact`] is for contacts whose forces act in a flow, with roughness and friction.
//!
//! Not for particles that are soft on the scale of the gaps.

pub mod broadphase;
mod delassus;
mod domain;
mod error;
mod films;
mod flow_contact;
mod gaps;
mod grid;
mod island_projection;
mod islands;
mod key;
mod memory;
mod mobility;
mod model;
mod neighbours;
mod network;
mod pair_contact;
mod parallel;
mod params;
pub mod part;
mod projection;
mod push_apart;
mod record;
mod repulsion;
mod rows;
#[cfg(any(feature = "dim2", feature = "dim3"))]
pub mod shape;
pub mod solver;

/// Vectors and twists of the interface.
pub use gluey_geom as geom;

pub use domain::{Domain, Wall};
pub use error::ContactError;
pub use films::{Film, FilmError, FilmMemory, FilmReport, Floor, GapReport, film_reach};
pub use flow_contact::{FlowContact, FlowContactParams, Friction, NormalLaw};
pub use gaps::{GapError, StepFilms, correct_gaps};
pub use key::{PairKey, Partner};
pub use memory::{ContactState, ForceState, MemoryError, PairState};
pub use mobility::{LoneDrag, Mobility, StokesDrag, TwistMobility, WithFixed};
pub use model::{
    BodyStep, Contact, ContactForce, ContactModel, ContactReport, FlowContactReport, FlowForces, StandingGap,
    StepGeometry, WorstPair,
};
pub use network::{Cluster, Clusters, ContactArm, ContactNetwork, Coordination};
pub use pair_contact::PairContact;
pub use params::{ContactLaw, ContactParams, GammaUpdate, SolverKind, UnknownName};
pub use repulsion::Repulsion;

/// The examples of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// The page of the book on contact in another program.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/tutorial/contact-elsewhere.md")]
struct Tutorial;
