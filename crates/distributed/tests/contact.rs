//! Contact that ranks share: the pairs, forces, memory and velocities of one rank.

#![allow(clippy::unwrap_used, reason = "a failure here is a failing test")]

use gluey_contact::{
    Contact, ContactError, ContactLaw, ContactModel, ContactParams, ContactReport, Domain, GammaUpdate,
    PairContact, StepGeometry, Wall, WithFixed,
};
use gluey_distributed::{ContactFollower, ContactLoad, SharedContact};
use gluey_geom::{Dim, Space, Twist, Vector};
use gluey_parallel::{Communicator, Threads};
use gluey_testkit::packing::Packing;

const RADIUS: f64 = 0.5;
const SIZES: [usize; 4] = [2, 3, 4, 8];

/// Particles on their way.
#[derive(Clone)]
struct Setting<const D: usize> {
    positions: Vec<Vector<D>>,
    domain: Domain<D>,
    params: ContactParams,
    held: Vec<usize>,
    dt: f64,
    steps: usize,
    /// Shear rate of the images, if they slide.
    rate: f64,
}

/// What became of them.
#[derive(Clone, Debug, PartialEq)]
struct Course<const D: usize>
where
    Dim<D>: Space<D>,
{
    positions: Vec<Vector<D>>,
    /// Of the last step.
    twists: Vec<Twist<D>>,
    contacts: Vec<Contact>,
    reports: Vec<ContactReport>,
    /// Whether there was an error, and which.
    error: Option<ContactError>,
    loads: Vec<ContactLoad>,
}

/// A model of contact, alone or shared.
trait Model<const D: usize>: ContactModel<D>
where
    Dim<D>: Space<D>,
{
    fn step(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError>;

    fn load(&self) -> ContactLoad;
}

impl<const D: usize> Model<D> for PairContact<D, WithFixed>
where
    Dim<D>: Space<D>,
{
    fn step(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        self.correct(step, twists)
    }

    fn load(&self) -> ContactLoad {
        ContactLoad::default()
    }
}

impl<const D: usize> Model<D> for SharedContact<'_, D>
where
    Dim<D>: Space<D>,
{
    fn step(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        self.correct(step, twists)
    }

    fn load(&self) -> ContactLoad {
        self.load()
    }
}

impl<const D: usize> Setting<D>
where
    Dim<D>: Space<D>,
{
    fn alone(&self) -> PairContact<D, WithFixed> {
        PairContact::with_mobility(self.params.clone(), WithFixed::new(self.held.iter().copied()))
            .within(self.domain.clone())
    }

    /// Velocities of a shear with something of a vortex in it.
    fn twists(&self, positions: &[Vector<D>]) -> Vec<Twist<D>> {
        let flow = |(k, x): (usize, &Vector<D>)| {
            let mut u = Vector::<D>::zeros();
            u[0] = self.rate * x[1];
            u[1] = 0.3 * (0.7 * x[0]).sin() - 0.1 * (k as f64).sin();
            u[D - 1] += 0.2 * (0.9 * x[1] + 0.3 * x[0]).cos();
            u
        };
        positions.iter().enumerate().map(|of| Twist { velocity: flow(of), ..Twist::default() }).collect()
    }

    fn run(&self, model: &mut impl Model<D>) -> Course<D> {
        let mut positions = self.positions.clone();
        let radii: Vec<f64> = (0..positions.len()).map(|k| RADIUS * [1.0, 0.9, 0.97][k % 3]).collect();
        let mut course = Course {
            positions: Vec::new(),
            twists: Vec::new(),
            contacts: Vec::new(),
            reports: Vec::new(),
            error: None,
            loads: Vec::new(),
        };
        let height = self.domain.lattice.periods().get(1).copied().flatten().unwrap_or(0.0);
        let mut drift = vec![Vector::zeros(); positions.len()];
        for n in 0..self.steps {
            let tilt_step = self.rate * height * self.dt;
            model.set_sliding(n as f64 * tilt_step, tilt_step);
            let mut twists = self.twists(&positions);
            // As in a scheme of two steps.
            let velocity_weight = if n == 0 { self.dt } else { 1.5 * self.dt };
            let step = StepGeometry {
                positions: &positions,
                radii: &radii,
                drift: &drift,
                velocity_weight,
                dt: self.dt,
            };
            match model.step(&step, &mut twists) {
                Ok(report) => course.reports.push(report),
                Err(error) => {
                    course.error = Some(error);
                    break;
                }
            }
            course.loads.push(model.load());
            for ((x, twist), drift) in positions.iter_mut().zip(&twists).zip(&mut drift) {
                *x += twist.velocity * velocity_weight + *drift;
                *drift = twist.velocity * (-0.5 * self.dt);
            }
            course.twists = twists;
        }
        course.positions = positions;
        course.contacts = model.contacts().to_vec();
        course
    }

    /// On so many ranks; the courses of rank zero, and what the others heard of the end.
    fn on(&self, size: usize) -> (Course<D>, Vec<Option<String>>) {
        let ends = Threads::run(size, |ranks| {
            if ranks.rank() == 0 {
                return (Some(self.run(&mut SharedContact::new(self.alone(), ranks))), None);
            }
            let mut follower = ContactFollower::default();
            let failure = (0..self.steps).find_map(|_| follower.step(ranks).err());
            (None, failure.map(|failure| failure.to_string()))
        })
        .unwrap();
        let heard = ends.iter().skip(1).map(|end| end.1.clone()).collect();
        (ends.into_iter().next().unwrap().0.unwrap(), heard)
    }
}

fn compare<const D: usize>(what: &str, setting: &Setting<D>, sizes: &[usize])
where
    Dim<D>: Space<D>,
{
    let serial = setting.run(&mut setting.alone());
    for &size in sizes {
        let start = std::time::Instant::now();
        let (shared, _) = setting.on(size);
        assert_eq!(shared.error, serial.error, "{what}");
        let most = |values: Vec<f64>| values.into_iter().fold(0.0, f64::max);
        let places =
            most(serial.positions.iter().zip(&shared.positions).map(|(a, b)| (a - b).norm()).collect());
        let twists = most(
            serial.twists.iter().zip(&shared.twists).map(|(a, b)| (a.velocity - b.velocity).norm()).collect(),
        );
        let names =
            |course: &Course<D>| course.contacts.iter().map(|contact| contact.pair).collect::<Vec<_>>();
        let same = names(&serial) == names(&shared);
        let of = |f: fn(&Contact) -> f64| {
            most(serial.contacts.iter().zip(&shared.contacts).map(|(a, b)| (f(a) - f(b)).abs()).collect())
        };
        let last = serial.reports.last();
        println!(
            "{what}, {size} ranks: places {places:.1e}, velocities {twists:.1e}, same pairs {same} of {} {}, lambda {:.1e}, gamma {:.1e}, load {:?}, iterations {:?} {:?}, pairs {:?} {:?} {:.1?}",
            serial.contacts.len(),
            shared.contacts.len(),
            of(|c| c.lambda),
            of(|c| c.gamma),
            shared.loads.last(),
            last.map(|r| (r.iterations, r.passes)),
            shared.reports.last().map(|r| (r.iterations, r.passes)),
            last.map(|r| r.pair_count),
            shared.reports.last().map(|r| r.pair_count),
            start.elapsed(),
        );
    }
}

fn params() -> ContactParams {
    ContactParams { gamma_update: GammaUpdate::Consistent, ..ContactParams::default() }
}

#[test]
fn suspensions() {
    let packing = Packing::<3>::fluid(300, 0.4, 1);
    let open = Setting {
        positions: packing.positions.clone(),
        domain: Domain::default(),
        params: params(),
        held: vec![],
        dt: 0.05,
        steps: 4,
        rate: 1.0,
    };
    compare("open", &open, &SIZES);
    let domain = Domain::periodic(&Vector::repeat(packing.side));
    compare("sheared", &Setting { domain, ..open }, &SIZES);
}
