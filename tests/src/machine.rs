//! What runs and lies on the machine, seen through `/proc` and the file system.

use rustix::process::{Pid, kill_process};
use std::fs;
use std::path::Path;

pub use rustix::process::Signal;

/// A process of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Process {
    /// Name in the scenario's process list; `vmerack` for the command itself.
    pub name: String,
    /// Its number.
    pub pid: u32,
}

/// Sends a signal; a process that is gone already needs none.
pub fn signal(pid: u32, signal: Signal) {
    if let Some(pid) = Pid::from_raw(pid as i32) {
        let _ = kill_process(pid, signal);
    }
}

/// Living processes that were started with this `TMPDIR`; zombies have no environment and do not count.
pub(crate) fn processes_with(tmpdir: &Path) -> Vec<Process> {
    let wanted = format!("TMPDIR={}", tmpdir.display());
    let Ok(entries) = fs::read_dir("/proc") else { return Vec::new() };
    entries
        .flatten()
        .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
        .filter(|pid: &u32| {
            let environment = fs::read(format!("/proc/{pid}/environ")).unwrap_or_default();
            environment.split(|byte| *byte == 0).any(|variable| variable == wanted.as_bytes())
        })
        .map(|pid| Process { name: name_of(pid), pid })
        .collect()
}

/// The name behind `--process`, where there is one.
fn name_of(pid: u32) -> String {
    let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    let words: Vec<String> =
        line.split(|byte| *byte == 0).map(|word| String::from_utf8_lossy(word).into_owned()).collect();
    let name = words.iter().position(|word| word == "--process").and_then(|i| words.get(i + 1));
    name.cloned().unwrap_or_else(|| "vmerack".into())
}

/// Entries of the folder, sorted; empty where there is none.
pub(crate) fn entries(folder: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut names: Vec<String> =
        entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
