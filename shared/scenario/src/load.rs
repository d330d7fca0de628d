//! From a name or path to a checked scenario: read, find every key's place, apply overrides, check.

use crate::error::{Problem, ScenarioError};
use crate::model::{Scenario, Variant};
use crate::source::{Source, read_as};
use crate::{builtin, check, overrides};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// A scenario file that has been read, with the overrides of the command line applied.
#[derive(Clone, Debug)]
pub struct Document {
    /// Name without folder and extension, for titles and folders.
    pub name: String,
    source: Source,
    folder: PathBuf,
    tree: Table,
    /// What the command line has set: holds in every variant, whatever it sets itself.
    set: Vec<Setting>,
}

/// A key that the command line has set.
#[derive(Clone, Debug)]
struct Setting {
    /// Key path, elements numbered.
    key: String,
    value: Value,
    /// The words that set it.
    origin: String,
}

/// Reads the scenario of that name or path and applies `overrides` (`key.path=value`). The whole of it,
/// every variant included, has been checked when this returns.
pub fn load(name_or_path: &str, overrides: &[String]) -> Result<Document, ScenarioError> {
    let document = Document::read(name_or_path, overrides)?;
    document.variants()?;
    Ok(document)
}

impl Document {
    fn read(name_or_path: &str, settings: &[String]) -> Result<Document, ScenarioError> {
        let (source, folder) = match builtin::text(name_or_path) {
            Some(text) => (Source::new(name_or_path, text), PathBuf::new()),
            None => (Source::read(name_or_path)?, folder_of(name_or_path)),
        };
        let stem = Path::new(name_or_path).file_stem();
        let name = stem.map_or_else(|| "scenario".into(), |stem| stem.to_string_lossy().into_owned());
        let mut document = Document { name, tree: source.tree()?, source, folder, set: Vec::new() };
        complete_rack(&mut document.tree);
        for setting in settings {
            let origin = format!("--set {setting}");
            let (key, value) = overrides::parse(setting)
                .and_then(|(key, value)| Ok((overrides::set(&mut document.tree, &key, value.clone())?, value)))
                .map_err(|problem| from_override(&origin, problem))?;
            document.set.push(Setting { key, value, origin });
        }
        Ok(document)
    }

    /// The scenario without any variant's overrides.
    pub fn scenario(&self) -> Result<Scenario, ScenarioError> {
        self.resolve(&self.tree, None)
    }

    /// Every variant with its scenario; one named `nominal` where the file names none.
    pub fn variants(&self) -> Result<Vec<(Variant, Scenario)>, ScenarioError> {
        let base = self.scenario()?;
        if base.variants.is_empty() {
            let nominal =
                Variant { name: "nominal".into(), set: Table::new(), may_miss_surface: false, may_diverge: false };
            return Ok(vec![(nominal, base)]);
        }
        let mut resolved = Vec::new();
        for variant in &base.variants {
            let mut tree = self.tree.clone();
            for (key, value) in overrides::flatten(&variant.set) {
                overrides::set(&mut tree, &key, value)
                    .map_err(|problem| from_override(&format!("variant {}", variant.name), problem))?;
            }
            for Setting { key, value, origin } in &self.set {
                overrides::vary(&mut tree, key, value.clone()).map_err(|problem| from_override(origin, problem))?;
            }
            resolved.push((variant.clone(), self.resolve(&tree, Some(&variant.name))?));
        }
        Ok(resolved)
    }

    /// This scenario with one more override, which holds in every variant, even where the variant sets that key.
    pub fn with(&self, key: &str, value: Value) -> Result<Document, ScenarioError> {
        let mut document = self.clone();
        let origin = format!("{key}={value}");
        let key =
            overrides::vary(&mut document.tree, key, value.clone()).map_err(|problem| from_override(&origin, problem))?;
        document.set.push(Setting { key, value, origin });
        Ok(document)
    }

    fn resolve(&self, tree: &Table, variant: Option<&str>) -> Result<Scenario, ScenarioError> {
        let problem = |problem: Problem| self.locate(problem, variant);
        let mut scenario: Scenario = read_as(tree).map_err(problem)?;
        for file in [&mut scenario.arm.urdf, &mut scenario.arm.drives].into_iter().flatten() {
            *file = self.folder.join(&*file).to_string_lossy().into_owned();
        }
        preset_times(&mut scenario, tree);
        widen_receiver(&mut scenario);
        check::check(&scenario).map_err(problem)?;
        Ok(scenario)
    }

    /// An error with the line of its key, or of the closest key above it that stands in the text.
    fn locate(&self, problem: Problem, variant: Option<&str>) -> ScenarioError {
        let concerned = |set: &&Setting| is_within(&problem.key, &set.key) || is_within(&set.key, &problem.key);
        if let Some(set) = self.set.iter().rev().find(concerned) {
            return from_override(&set.origin, problem);
        }
        match variant {
            Some(variant) if !self.source.states(&problem.key) => {
                from_override(&format!("{}: variant {variant}", self.source.file()), problem)
            }
            _ => self.source.error(&problem),
        }
    }

}

/// A receiver of more than 16 bits, for comparison with theory, has words of 32 in the same window.
fn widen_receiver(scenario: &mut Scenario) {
    if scenario.force_sensor_if.full_scale_counts > 32768.0 {
        let cards = scenario.rack.slaves.iter_mut().filter(|slave| slave.name == "force-sensor");
        cards.for_each(|card| card.width = vme::Width::D32);
    }
}

/// The processor cards' times, where the text states none of its own.
fn preset_times(scenario: &mut Scenario, tree: &Table) {
    let split = scenario.second_control_task().is_some();
    let controller = &mut scenario.controller;
    let table = tree.get("controller").and_then(Value::as_table);
    let set = |table: Option<&Table>, key: &str, time: &mut f64, ns: vme::Ns| {
        if !table.is_some_and(|table| table.contains_key(key)) {
            *time = ns as f64 * 1e-3;
        }
    };
    if let Some(times) = controller.processor.map(|processor| processor.times()) {
        let execution = if split { times.law_ns() } else { times.pipeline_ns() };
        set(table, "execution_us", &mut controller.execution_us, execution);
        set(table, "entry_us", &mut controller.entry_us, times.entry_ns());
    }
    if let Some(times) = controller.second_card.processor.or(controller.processor).map(|processor| processor.times()) {
        let table = table.and_then(|table| table.get("second_card")).and_then(Value::as_table);
        set(table, "execution_us", &mut controller.second_card.execution_us, times.torque_ns());
        set(table, "entry_us", &mut controller.second_card.entry_us, times.entry_ns());
    }
}

/// What a scenario does not state of its rack is as in Figure 6.1.
fn complete_rack(tree: &mut Table) {
    let Value::Table(rack) = tree.entry("rack").or_insert_with(|| Value::Table(Table::new())) else {
        return;
    };
    for (key, value) in builtin::figure_6_1_table() {
        match (rack.get_mut(&key), value) {
            (Some(Value::Table(stated)), Value::Table(whole)) => {
                for (key, value) in whole {
                    stated.entry(key).or_insert(value);
                }
            }
            (Some(_), _) => {}
            (None, value) => {
                rack.insert(key, value);
            }
        }
    }
}

/// Whether `key` is `table` or lies in it.
fn is_within(key: &str, table: &str) -> bool {
    key.strip_prefix(table).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// Folder of a file, absolute.
fn folder_of(path: &str) -> PathBuf {
    let folder = Path::new(path).parent().map(Path::to_path_buf).unwrap_or_default();
    std::path::absolute(&folder).unwrap_or(folder)
}

fn from_override(origin: &str, problem: Problem) -> ScenarioError {
    ScenarioError::Override { origin: origin.to_owned(), key: problem.key, message: problem.message }
}
