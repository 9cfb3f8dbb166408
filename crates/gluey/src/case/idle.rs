//! Keys of a case that are set and do nothing, for what other keys say.

use toml::Value;

use super::idle_key::IdleKey;
use super::names::{ArrangementName, OutputKind, Precision, RadiiKind};
use super::{
    Boundary, Case, ContactSpec, FlowSpec, Formulation, Hydrodynamics, Metric, RepulsionSpec, Strategy,
    SuspensionSpec,
};
use crate::number_text::shown;

impl Case {
    /// The keys of a checked case that do nothing. Those with the value that they would have anyway are not
    /// among them.
    pub fn idle_keys(&self) -> Vec<IdleKey> {
        let (own, plain) = (table(&self.filled()), table(&self.plain().filled()));
        let mut idle = self.idle_in_suspension.clone();
        for (key, why) in self.rules() {
            differing(key, at(&own, key), at(&plain, key), &mut |key| {
                idle.push(IdleKey { key, why: why.clone() });
            });
        }
        idle.extend(self.idle_in_output());
        idle
    }

    /// This with its choices, and the defaults of all that hangs on them.
    fn plain(&self) -> Self {
        let mut case = self.clone();
        let FlowSpec { hydrodynamics, formulation, .. } = self.flow;
        let formulation = match hydrodynamics {
            Hydrodynamics::Stokes => formulation,
            Hydrodynamics::PairMobility => Formulation::default(),
        };
        case.flow = FlowSpec { hydrodynamics, formulation, ..FlowSpec::default() };
        let ContactSpec { strategy, metric, .. } = self.contact;
        case.contact = ContactSpec { strategy, metric, ..ContactSpec::default() };
        case.repulsion = RepulsionSpec::default();
        case.domain.boundary = Boundary::default();
        (case.time.reverse_at, case.time.strain_amplitude, case.time.tolerance) = (None, None, None);
        case
    }

    /// Keys and tables that do nothing in this case, and why.
    fn rules(&self) -> Vec<(&'static str, String)> {
        let (flow, mut rules) = (&self.flow, Vec::new());
        let mut add = |keys: &[&'static str], why: String| {
            rules.extend(keys.iter().map(|key| (*key, why.clone())));
        };
        match flow.hydrodynamics {
            Hydrodynamics::PairMobility => add(
                &[
                    "domain.boundary",
                    "flow.formulation",
                    "flow.lubrication",
                    "flow.solver",
                    "flow.tolerance",
                    "flow.mesh",
                    "flow.paper",
                ],
                format!("flow.hydrodynamics = \"{}\"", flow.hydrodynamics),
            ),
            Hydrodynamics::Stokes => {
                add(&["flow.pair-mobility"], format!("flow.hydrodynamics = \"{}\"", flow.hydrodynamics));
                if flow.formulation != Formulation::Paper {
                    add(&["flow.paper"], format!("flow.formulation = \"{}\"", flow.formulation));
                }
            }
        }
        if self.is_penalty() {
            add(&["flow.paper.rho"], "flow.paper.uzawa_steps = 1".to_owned());
        }
        if self.contact.metric() == Metric::Drag {
            add(&["contact.flow_tolerance"], format!("contact.metric = \"{}\"", Metric::Drag));
        }
        add(&idle_of_contact(&self.contact), format!("contact.strategy = \"{}\"", self.contact.strategy));
        if self.time.halvings == 0 {
            add(&["time.tolerance"], "time.halvings = 0".to_owned());
        }
        if self.repulsion.force == 0.0 {
            add(&["repulsion.range"], "repulsion.force = 0".to_owned());
        }
        if self.turns_round() && self.reversed_steps(self.step_count() + 1) == 0 {
            let why = format!("time.end = {}, before the shear turns round", shown(self.time.end));
            add(&["time.reverse_at", "time.strain_amplitude"], why);
        }
        rules
    }

    fn idle_in_output(&self) -> Vec<IdleKey> {
        let of_frames = self.output.iter().enumerate().filter(|(_, output)| output.kind == OutputKind::Xyz);
        let keys = of_frames.flat_map(|(index, output)| {
            let keys = [("fields", !output.fields), ("precision", output.precision != Precision::default())];
            keys.into_iter().filter(|(_, is_set)| *is_set).map(move |(name, _)| IdleKey {
                key: format!("output[{index}].{name}"),
                why: format!("kind = \"{}\"", OutputKind::Xyz.name()),
            })
        });
        keys.collect()
    }
}

/// Keys of contact and the strategies that ask for them.
const KEYS_OF_CONTACT: [(&str, &[Strategy]); 9] = [
    ("contact.exact_gap", &[Strategy::Inelastic, Strategy::Gluey]),
    ("contact.memory", &[Strategy::Gluey]),
    ("contact.gamma_min", &[Strategy::Gluey]),
    ("contact.threshold", &[Strategy::VelocityCorrection]),
    ("contact.solver", &[Strategy::Inelastic, Strategy::Gluey]),
    ("contact.tolerance", &[Strategy::VelocityCorrection, Strategy::Inelastic, Strategy::Gluey]),
    ("contact.roughness", &[Strategy::Rough]),
    ("contact.friction", &[Strategy::Rough]),
    ("contact.friction_load", &[Strategy::Rough]),
];

/// What a contact law does not ask for.
fn idle_of_contact(contact: &ContactSpec) -> Vec<&'static str> {
    let asks = |strategies: &[Strategy]| strategies.contains(&contact.strategy);
    KEYS_OF_CONTACT.iter().filter(|key| !asks(key.1)).map(|key| key.0).collect()
}

/// The keys that do nothing where particles are generated.
pub(super) fn idle_in_suspension(suspension: &SuspensionSpec) -> Vec<IdleKey> {
    let SuspensionSpec { arrangement, sweeps, seed, jitter, radii, .. } = suspension;
    let is_random = matches!(arrangement, ArrangementName::Equilibrium | ArrangementName::Random);
    let is_exact = !is_random && *jitter == 0.0 && radii.kind == RadiiKind::Equal;
    let keys = [
        ("sweeps", sweeps.is_some() && *arrangement != ArrangementName::Equilibrium),
        ("jitter", *jitter != 0.0 && is_random),
        ("seed", *seed != SuspensionSpec::default().seed && is_exact),
    ];
    let why = format!("suspension.arrangement = \"{}\"", arrangement.name());
    let idle = keys.into_iter().filter(|(_, is)| *is);
    idle.map(|(name, _)| IdleKey { key: format!("suspension.{name}"), why: why.clone() }).collect()
}

/// A case as its file states it; nothing where it has no such form, which no checked case is.
fn table(case: &Case) -> Value {
    Value::try_from(case).unwrap_or(Value::Table(toml::Table::new()))
}

fn at<'a>(table: &'a Value, key: &str) -> Option<&'a Value> {
    key.split('.').try_fold(table, |table, part| table.get(part))
}

/// The keys, at `key` and below it, whose values differ.
fn differing(key: &str, own: Option<&Value>, plain: Option<&Value>, tell: &mut dyn FnMut(String)) {
    match (own, plain) {
        (Some(Value::Table(own)), plain) => own.iter().for_each(|(name, value)| {
            differing(&format!("{key}.{name}"), Some(value), plain.and_then(|plain| plain.get(name)), tell);
        }),
        (Some(own), plain) if plain != Some(own) => tell(key.to_owned()),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is idle in a case with these lines beside its particles.
    fn idle(dimension: usize, lines: &str) -> Vec<String> {
        let particles = if lines.contains("suspension") {
            String::new()
        } else {
            let at = |x: f64| format!("[{x}, 0.5{}]", if dimension == 3 { ", 0.5" } else { "" });
            format!(
                "particles = [{{ position = {}, radius = 0.05 }}, {{ position = {}, radius = 0.05 }}]\n",
                at(0.3),
                at(0.7)
            )
        };
        let time = if lines.contains("time") { "" } else { "time = { step = 0.1, end = 1.0 }\n" };
        let text = format!("name = \"x\"\ndimension = {dimension}\n{particles}{time}{lines}\n");
        let case = Case::parse(&text, "x.toml").unwrap_or_else(|error| panic!("{error}"));
        // What is written down and read back says the same.
        let written = Case::parse(&case.to_toml().expect("text"), "written.toml");
        let again = written.unwrap_or_else(|error| panic!("{error}")).idle_keys();
        let keys = case.idle_keys();
        assert!(again.iter().all(|key| keys.contains(key)), "{again:?}");
        keys.into_iter().map(|IdleKey { key, why }| format!("{key}: {why}")).collect()
    }

    #[test]
    fn nothing_is_idle_in_a_case_that_sets_nothing() {
        for lines in ["", "contact = { strategy = \"none\" }", "flow = { formulation = \"paper\" }"] {
            assert!(idle(2, lines).is_empty() && idle(3, lines).is_empty(), "{:?}", idle(2, lines));
        }
        assert!(idle(3, "flow = { hydrodynamics = \"pair-mobility\" }").is_empty());
    }

    /// Every key that hangs on another one, set where it does nothing and where it does.
    #[test]
    fn every_key_that_hangs_on_another_is_told() {
        let strategy = |name: &str, key: &str| format!("contact = {{ strategy = \"{name}\", {key} }}");
        let keys = [
            ("exact_gap = false", "exact_gap", &["none", "velocity-correction"][..]),
            ("memory = \"paper\"", "memory", &["none", "velocity-correction", "inelastic"]),
            ("gamma_min = -1.0", "gamma_min", &["none", "velocity-correction", "inelastic"]),
            ("threshold = 0.1", "threshold", &["none", "inelastic", "gluey"]),
            ("solver = \"uzawa\"", "solver", &["none", "velocity-correction"]),
            ("tolerance = 1e-6", "tolerance", &["none"]),
        ];
        for (line, key, in_vain) in keys {
            for name in ["none", "velocity-correction", "inelastic", "gluey"] {
                let expected = format!("contact.{key}: contact.strategy = \"{name}\"");
                let found = idle(2, &strategy(name, line));
                let is_idle = in_vain.contains(&name);
                assert_eq!(found, if is_idle { vec![expected] } else { vec![] }, "{name}, {line}");
            }
        }
    }

    #[test]
    fn parameters_of_another_flow_are_told() {
        let flow =
            |formulation: &str, key: &str| format!("flow = {{ formulation = \"{formulation}\", {key} }}");
        let paper = "flow.paper.ramp: flow.formulation = \"unfitted\"";
        assert_eq!(idle(2, &flow("unfitted", "paper = { ramp = 2.0 }")), [paper]);
        let gap = "flow.pair-mobility.gap_offset: flow.hydrodynamics = \"stokes\"";
        assert_eq!(idle(3, &flow("unfitted", "pair-mobility = { gap_offset = 0.1 }")), [gap]);
        let rho = "flow.paper.rho: flow.paper.uzawa_steps = 1";
        assert_eq!(idle(2, &flow("paper", "paper = { uzawa_steps = 1, rho = 2.0 }")), [rho]);
        assert!(idle(2, &flow("paper", "paper = { rho = 2.0 }")).is_empty());
        let mobility = "flow = { hydrodynamics = \"pair-mobility\", formulation = \"paper\", solver = \"direct\", \
                        tolerance = 1e-8, mesh = { band = 3.0, cells_per_radius = 6.0 } }\n\
                        domain = { boundary = \"periodic\" }";
        let keys = ["domain.boundary", "flow.formulation", "flow.solver", "flow.tolerance"];
        let of_mesh = ["flow.mesh.band", "flow.mesh.cells_per_radius"];
        let expected = keys.into_iter().chain(of_mesh);
        let expected: Vec<String> =
            expected.map(|key| format!("{key}: flow.hydrodynamics = \"pair-mobility\"")).collect();
        assert_eq!(idle(3, mobility), expected);
    }

    #[test]
    fn what_never_comes_and_what_is_not_asked_for_is_told() {
        assert_eq!(idle(2, "repulsion = { range = 0.1 }"), ["repulsion.range: repulsion.force = 0"]);
        assert!(idle(2, "repulsion = { force = 1.0, range = 0.1 }").is_empty());
        let late = "time = { step = 0.1, end = 1.0, reverse_at = 2.0 }";
        assert_eq!(idle(2, late), ["time.reverse_at: time.end = 1, before the shear turns round"]);
        assert!(idle(2, "time = { step = 0.1, end = 1.0, reverse_at = 0.5 }").is_empty());
        let whole = "time = { step = 0.1, end = 1.0, halvings = 0, tolerance = 1e-3 }";
        assert_eq!(idle(2, whole), ["time.tolerance: time.halvings = 0"]);
        let wide = "time = { step = 0.1, end = 1.0, strain_amplitude = 2.0 }";
        assert_eq!(idle(2, wide), ["time.strain_amplitude: time.end = 1, before the shear turns round"]);
        let frames = "output = [{ kind = \"xyz\", every = 1, fields = false, precision = \"f32\" }]";
        assert_eq!(
            idle(2, frames),
            ["output[0].fields: kind = \"xyz\"", "output[0].precision: kind = \"xyz\""]
        );
        let lattice =
            "suspension = { count = 4, radius = 0.05, arrangement = \"square\", seed = 2, sweeps = 10 }";
        let why = "suspension.arrangement = \"square\"";
        assert_eq!(
            idle(2, lattice),
            [format!("suspension.sweeps: {why}"), format!("suspension.seed: {why}")]
        );
        let random = "suspension = { count = 4, radius = 0.05, arrangement = \"random\", jitter = 0.5 }";
        assert_eq!(idle(2, random), ["suspension.jitter: suspension.arrangement = \"random\""]);
    }
}
