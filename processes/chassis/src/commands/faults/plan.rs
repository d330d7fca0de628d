//! The campaign file: which faults, where, when in the task, how much, and what is expected of the rack.

use scenario::{Document, FaultKind, Problem, Scenario, ScenarioError, Source};
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::{Table, Value};

/// The campaign that is run where no file is given.
const BUILT_IN: &str = include_str!("default.toml");

/// A campaign.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Faults of each kind in each phase.
    pub repeats: usize,
    /// Seeds of the runs; faults of one seed share the fault-free twin.
    #[serde(default = "four")]
    pub twins: usize,
    /// A run goes on for so long after its fault has begun (s), unless the arm is off before.
    pub watch_s: f64,
    /// A kind with fewer faults that have an effect is not shown.
    #[serde(default = "twenty")]
    pub least_effective: usize,
    /// Share of the faults with an effect to be detected within their bound.
    #[serde(default = "nearly_all")]
    pub detected_share: f64,
    /// The contact force after STO may exceed the one at the fault's begin by this (N).
    pub force_growth_n: f64,
    /// By how much a run must differ from its twin.
    #[serde(default)]
    pub effect: Effect,
    /// Runs without a fault.
    #[serde(default)]
    pub null: Null,
    /// Parts of the task, in the order of time.
    #[serde(rename = "phase")]
    pub phases: Vec<Phase>,
    /// What is drawn.
    #[serde(rename = "kind")]
    pub kinds: Vec<Kind>,
}

/// A part of the task in which faults begin.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Phase {
    /// Name.
    pub name: String,
    /// From here …
    pub from_s: f64,
    /// … to here.
    pub until_s: f64,
}

/// Differences from the twin above which a fault has an effect; any of them will do.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Effect {
    /// Measured or true contact force (N).
    pub force_n: f64,
    /// Commanded joint torque (Nm).
    pub torque_nm: f64,
    /// Measured or true joint angle (rad).
    pub angle_rad: f64,
    /// Instant of a job, age of its values (ms); a job that is missing differs by any amount.
    pub time_ms: f64,
    /// Number of transfers over the bus; none: whatever it is.
    pub transfers: Option<f64>,
}

impl Default for Effect {
    fn default() -> Self {
        Effect { force_n: 2.0, torque_nm: 2.0, angle_rad: 1e-3, time_ms: 0.5, transfers: None }
    }
}

/// Runs without a fault beside the twins.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Null {
    /// Simulated time in contact (h).
    pub hours: f64,
    /// Overrides of the scenario, as in a `[[variant]]`.
    pub set: Table,
}

/// Faults of one kind.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kind {
    /// Kind.
    pub kind: FaultKind,
    /// What it befalls, one of them at random.
    pub targets: Vec<String>,
    /// Least and greatest amount.
    #[serde(default)]
    pub amount: [f64; 2],
    /// The amount takes either sign.
    #[serde(default)]
    pub either_sign: bool,
    /// Axes of the force sensor.
    #[serde(default)]
    pub axes: Option<Vec<u8>>,
    /// How long it lasts (s); default: to the end.
    #[serde(default)]
    pub duration_s: Option<f64>,
    /// When in the control period it begins (ms); default: at any time.
    #[serde(default)]
    pub in_period_ms: Option<[f64; 2]>,
    /// Phases in which it begins; default: all.
    #[serde(default)]
    pub phases: Option<Vec<String>>,
    /// Faults in each phase, in place of the campaign's.
    #[serde(default)]
    pub repeats: Option<usize>,
    /// Faults that have been there before.
    #[serde(default)]
    pub before: Vec<Before>,
    /// How soon it must be detected.
    pub detect: Bound,
    /// The same for single targets, in place of it.
    #[serde(default)]
    pub detect_at: BTreeMap<String, Bound>,
    /// Mildest and gravest state that passes.
    pub reaction: [State; 2],
    /// In place of the campaign's.
    #[serde(default)]
    pub effect: Option<Effect>,
    /// In place of the campaign's.
    #[serde(default)]
    pub watch_s: Option<f64>,
    /// In place of the campaign's.
    #[serde(default)]
    pub force_growth_n: Option<f64>,
}

/// A fault that another one presupposes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Before {
    /// Kind.
    pub kind: FaultKind,
    /// What it befalls.
    pub target: String,
    /// Amount.
    #[serde(default)]
    pub amount: f64,
    /// How long before (s).
    pub lead_s: f64,
}

/// Bound of the time to detect; the parts are added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Bound {
    /// Periods of the control task.
    pub periods: f64,
    /// A time (ms).
    pub ms: f64,
    /// A fault that grows by its amount a second: the time that it takes to come to this.
    pub grows_to: Option<f64>,
    /// A D/A output that stays: the time until a job asks for one so many steps of the converter away.
    pub output_steps: Option<f64>,
    /// Index marks that do not come: the time in which the motor turns so often.
    pub motor_turns: Option<f64>,
}

impl Kind {
    fn check_bound(&self, bound: &Bound) -> Result<(), Problem> {
        let within = |key: &str, value: Option<f64>, most: f64| match value {
            Some(value) if !(0.0..=most).contains(&value) => {
                Err(Problem::new(key, format!("is {value}, expected 0 to {most}")))
            }
            _ => Ok(()),
        };
        within("periods", Some(bound.periods), 1e4)?;
        within("ms", Some(bound.ms), 1e5)?;
        within("output_steps", bound.output_steps, 1e6)?;
        within("motor_turns", bound.motor_turns, 1e6)?;
        let only = |key: &str, stated: bool, fits: bool, what: &str| match stated && !fits {
            true => Err(Problem::new(key, format!("is stated for `{}`, expected {what}", self.kind.name()))),
            false => Ok(()),
        };
        only("grows_to", bound.grows_to.is_some(), self.amount[0] > 0.0, "an amount above 0: the fault is to grow")?;
        only("output_steps", bound.output_steps.is_some(), self.kind == FaultKind::DaStuck, "it for `da-stuck` alone")?;
        only("motor_turns", bound.motor_turns.is_some(), self.kind == FaultKind::IndexLoss, "it for `index-loss` alone")
    }

    /// How soon a fault of this target must be detected.
    pub fn bound(&self, target: &str) -> &Bound {
        self.detect_at.get(target).unwrap_or(&self.detect)
    }
}

impl Bound {
    /// For a fault of that amount that shows at once, ms.
    pub fn of(&self, amount: f64, period_ms: f64) -> f64 {
        self.periods * period_ms + self.ms + self.grows_to.map_or(0.0, |size| 1e3 * size / amount.abs())
    }
}

/// Safety states, from the mildest to the gravest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// The law governs.
    Run,
    /// The law governs on held values.
    Degraded,
    /// SS2.
    Hold,
    /// SS1.
    Stop,
    /// STO.
    Off,
}

impl State {
    /// The state of that number; graver ones than there are count as the gravest.
    pub fn from_number(number: u32) -> State {
        [State::Run, State::Degraded, State::Hold, State::Stop].get(number as usize).copied().unwrap_or(State::Off)
    }

    /// As tables show it.
    pub fn name(self) -> &'static str {
        match self {
            State::Run => "run",
            State::Degraded => "degraded",
            State::Hold => "hold (SS2)",
            State::Stop => "stop (SS1)",
            State::Off => "off (STO)",
        }
    }
}

fn four() -> usize {
    4
}

fn twenty() -> usize {
    20
}

fn nearly_all() -> f64 {
    0.99
}

impl Plan {
    /// Reads the campaign of that file, or the built-in one, for a scenario, and checks all of it.
    pub fn load(file: Option<&str>, document: &Document) -> Result<Plan, ScenarioError> {
        let source = match file {
            Some(file) => Source::read(file)?,
            None => Source::new("built-in campaign", BUILT_IN),
        };
        let plan: Plan = source.parse()?;
        let scenario = document.scenario()?;
        plan.check(&scenario).map_err(|problem| source.error(&problem))?;
        for (i, kind) in plan.kinds.iter().enumerate() {
            plan.check_faults(i, kind, document).map_err(|problem| source.error(&problem))?;
        }
        plan.null_document(document).map_err(|error| source.error(&Problem::new("null.set", error.to_string())))?;
        Ok(plan)
    }

    /// The kinds of these names only; the problem names one that the campaign does not have.
    pub fn keep(&mut self, names: &[String]) -> Result<(), Problem> {
        if let Some(unknown) = names.iter().find(|name| !self.kinds.iter().any(|kind| kind.kind.name() == **name)) {
            let known: Vec<&str> = self.kinds.iter().map(|kind| kind.kind.name()).collect();
            let expected = format!("there is no such kind in the campaign, expected one of {}", known.join(", "));
            return Err(Problem::new(unknown.clone(), expected));
        }
        self.kinds.retain(|kind| names.is_empty() || names.iter().any(|name| name == kind.kind.name()));
        Ok(())
    }

    /// The scenario of the runs without a fault.
    pub fn null_document(&self, document: &Document) -> Result<Document, ScenarioError> {
        self.null.set.iter().try_fold(document.clone(), |document, (key, value)| document.with(key, value.clone()))
    }

    fn check(&self, scenario: &Scenario) -> Result<(), Problem> {
        let positive = |key: &str, value: usize| match value {
            1..=10_000 => Ok(()),
            _ => Err(Problem::new(key, format!("is {value}, expected 1 to 10 000"))),
        };
        let within = |key: String, value: f64, least: f64, most: f64| match (least..=most).contains(&value) {
            true => Ok(()),
            false => Err(Problem::new(key, format!("is {value}, expected {least} to {most}"))),
        };
        positive("repeats", self.repeats)?;
        positive("twins", self.twins)?;
        within("watch_s".into(), self.watch_s, 1e-3, 100.0)?;
        within("detected_share".into(), self.detected_share, 0.0, 1.0)?;
        within("force_growth_n".into(), self.force_growth_n, 0.0, 1e6)?;
        within("null.hours".into(), self.null.hours, 0.0, 1000.0)?;
        if self.phases.is_empty() {
            return Err(Problem::new("phase", "is empty, expected one phase or more"));
        }
        let end = scenario.duration();
        for (i, phase) in self.phases.iter().enumerate() {
            within(format!("phase.{i}.from_s"), phase.from_s, 0.0, end)?;
            within(format!("phase.{i}.until_s"), phase.until_s, phase.from_s, end)?;
        }
        for (i, kind) in self.kinds.iter().enumerate() {
            let key = |name: &str| format!("kind.{i}.{name}");
            if self.kinds[..i].iter().any(|other| other.kind == kind.kind) {
                return Err(Problem::new(key("kind"), format!("`{}` has been stated before", kind.kind.name())));
            }
            if kind.targets.is_empty() {
                return Err(Problem::new(key("targets"), "is empty, expected one target or more"));
            }
            if kind.amount[0] > kind.amount[1] {
                return Err(Problem::new(key("amount"), "expected the least and the greatest amount, in this order"));
            }
            let unknown = |name: &&String| !self.phases.iter().any(|phase| phase.name == **name);
            if let Some(name) = kind.phases.iter().flatten().find(unknown) {
                let names: Vec<&str> = self.phases.iter().map(|phase| phase.name.as_str()).collect();
                let expected = format!("has `{name}`, expected one of {}", names.join(", "));
                return Err(Problem::new(key("phases"), expected));
            }
            if let Some(repeats) = kind.repeats {
                positive(&key("repeats"), repeats)?;
            }
            if let Some(watch) = kind.watch_s {
                within(key("watch_s"), watch, 1e-3, 100.0)?;
            }
            if let Some(unknown) = kind.detect_at.keys().find(|target| !kind.targets.contains(target)) {
                let expected = format!("expected one of {}", kind.targets.join(", "));
                return Err(Problem::new(key(&format!("detect_at.{unknown}")), expected));
            }
            let stated = kind.detect_at.iter().map(|(target, bound)| (format!("detect_at.{target}"), bound));
            for (name, bound) in stated.chain([("detect".to_owned(), &kind.detect)]) {
                kind.check_bound(bound)
                    .map_err(|problem| Problem::new(key(&format!("{name}.{}", problem.key)), problem.message))?;
            }
            if let Some([least, most]) = kind.in_period_ms {
                within(key("in_period_ms.0"), least, 0.0, most)?;
                within(key("in_period_ms.1"), most, least, super::judge::control_period_ms(scenario))?;
            }
            if kind.reaction[0] > kind.reaction[1] {
                return Err(Problem::new(key("reaction"), "expected the mildest and the gravest state, in this order"));
            }
            for (j, before) in kind.before.iter().enumerate() {
                let earliest = self.phases.iter().map(|phase| phase.from_s).fold(f64::MAX, f64::min);
                within(format!("kind.{i}.before.{j}.lead_s"), before.lead_s, 1e-6, earliest)?;
            }
        }
        Ok(())
    }

    /// The scenario takes the fault, at every target and with both amounts.
    fn check_faults(&self, i: usize, kind: &Kind, document: &Document) -> Result<(), Problem> {
        let fault = |kind: FaultKind, target: &str, amount: f64, axes: Option<&Vec<u8>>| {
            let mut fault = Table::new();
            fault.insert("kind".into(), Value::String(kind.name().into()));
            fault.insert("target".into(), Value::String(target.into()));
            fault.insert("start_s".into(), Value::Float(0.0));
            fault.insert("amount".into(), Value::Float(amount));
            if let Some(axes) = axes {
                fault.insert(
                    "axes".into(),
                    Value::Array(axes.iter().map(|axis| Value::Integer((*axis).into())).collect()),
                );
            }
            if let Some(duration) = self.kinds[i].duration_s {
                fault.insert("duration_s".into(), Value::Float(duration));
            }
            Value::Table(fault)
        };
        let mut faults: Vec<(String, Value)> = Vec::new();
        for (j, target) in kind.targets.iter().enumerate() {
            for amount in kind.amount {
                faults.push((format!("kind.{i}.targets.{j}"), fault(kind.kind, target, amount, kind.axes.as_ref())));
            }
        }
        for (j, before) in kind.before.iter().enumerate() {
            faults.push((format!("kind.{i}.before.{j}"), fault(before.kind, &before.target, before.amount, None)));
        }
        for (key, fault) in faults {
            let tried = document.with("fault", Value::Array(vec![fault])).and_then(|document| document.scenario());
            if let Err(
                ScenarioError::Override { key: of, message, .. } | ScenarioError::Text { key: of, message, .. },
            ) = tried
            {
                // `fault.0.amount` is this kind's `amount`
                let stated = match of.strip_prefix("fault.0.") {
                    Some("target") | None => key,
                    Some(_) if key.contains(".before.") => key,
                    Some(name) => format!("kind.{i}.{name}"),
                };
                return Err(Problem::new(stated, message));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn campaign() -> Document {
        scenario::load("campaign", &[]).expect("built-in scenario")
    }

    #[test]
    fn the_built_in_campaign_has_every_kind_of_fault() {
        let plan = Plan::load(None, &campaign()).unwrap_or_else(|error| panic!("{error:?}"));
        for kind in FaultKind::ALL {
            assert!(plan.kinds.iter().any(|entry| entry.kind == *kind), "{} is missing", kind.name());
        }
        let base = campaign().scenario().expect("built-in scenario");
        let draws = super::super::draw::draws(&plan, &base, 1);
        assert!(draws.len() >= 500, "{}", draws.len());
        for (i, kind) in plan.kinds.iter().enumerate() {
            let count = draws.iter().filter(|draw| draw.kind == i).count();
            assert!(count >= plan.least_effective, "{} can never be shown", kind.kind.name());
        }
    }

    #[test]
    fn a_bound_adds_periods_time_and_the_time_in_which_a_drift_grows() {
        let bound = Bound { periods: 3.0, ms: 100.0, grows_to: Some(30.0), ..Bound::default() };
        assert_eq!(bound.of(-60.0, 5.0), 15.0 + 100.0 + 500.0);
        assert_eq!(Bound { periods: 1.0, ..Bound::default() }.of(0.0, 5.0), 5.0);
    }

    #[test]
    fn what_is_wrong_with_a_campaign_is_shown_with_its_line_and_key() {
        let head = "repeats = 1\nwatch_s = 0.5\nforce_growth_n = 5.0\n\
                    [[phase]]\nname = \"free\"\nfrom_s = 0.1\nuntil_s = 0.5\n\
                    [[kind]]\nkind = \"stuck\"\nreaction = [\"hold\", \"off\"]\ndetect = { periods = 11.0 }\n";
        let file = tempfile::NamedTempFile::new().unwrap();
        let path = file.path().to_str().unwrap();
        for (rest, line, key, expected) in [
            ("targets = [\"force_sensor\"]\namout = 3\n", 13, "kind.0.amout", "unknown field"),
            ("targets = [\"joint-1\"]\n", 12, "kind.0.targets.0", "expected"),
            ("targets = []\n", 12, "kind.0.targets", "one target or more"),
            ("targets = [\"force_sensor\"]\nphases = [\"slow\"]\n", 13, "kind.0.phases", "expected one of free"),
            ("targets = [\"force_sensor\"]\namount = [2.0, 1.0]\n", 13, "kind.0.amount", "in this order"),
        ] {
            std::fs::write(path, format!("{head}{rest}")).unwrap();
            match Plan::load(Some(path), &campaign()) {
                Err(ScenarioError::Text { line: at, key: of, message, .. }) => {
                    assert_eq!((at, of.as_str()), (line, key), "{message}");
                    assert!(message.contains(expected), "{message}");
                }
                other => panic!("{other:?}"),
            }
        }
    }
}
