//! What a run leaves on the machine while it lives, and how all of it goes away.
//!
//! Every process of a run holds a shared lock on the folder's lock file. Whoever leaves last gets it exclusively and
//! removes the folder and everything of the run in shared memory, so even SIGKILL of the chassis leaves nothing.

use crate::RunError;
use rustix::fs::{FlockOperation, flock};
use scenario::Scenario;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// Everything that the processes of a run share.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Context {
    /// Prefix of everything of this run in shared memory.
    pub prefix: String,
    /// Name of the variant.
    pub variant: String,
    /// Record to write; none = recording off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub record: Option<PathBuf>,
    /// What the boards do is measured.
    #[serde(default)]
    pub measure: bool,
    /// Every board is in the chassis, wherever the scenario places it.
    #[serde(default)]
    pub in_process: bool,
    /// The scenario with the variant's overrides.
    pub scenario: Scenario,
}

/// The record's file from its `number`-th beginning on (1 = the first): a recorder that is started again does not touch
/// what is there.
pub fn part_of(record: &Path, number: u32) -> PathBuf {
    match number {
        0 | 1 => record.to_path_buf(),
        _ => record.with_extension(format!("part{number}.mcap")),
    }
}

impl Context {
    /// The scenario as TOML text, every default stated: what the record carries.
    pub fn resolved(&self) -> Result<String, RunError> {
        toml::to_string(&self.scenario)
            .map_err(|error| RunError::Folder { path: "resolved scenario".into(), reason: error.to_string() })
    }
}

/// Names that are tried for a new folder.
const ATTEMPTS: u64 = 100;

/// A run's folder, held by one process of it.
#[derive(Debug)]
pub struct RunFolder {
    /// Its path; short, since sockets lie in it.
    pub path: PathBuf,
    /// Prefix of everything of this run in shared memory.
    pub prefix: String,
    lock: File,
}

/// Folder of all runs of this user.
fn base() -> PathBuf {
    std::env::temp_dir().join(format!("vmerack-{}", rustix::process::getuid().as_raw()))
}

fn failed(path: &Path) -> impl Fn(std::io::Error) -> RunError + '_ {
    |error| RunError::Folder { path: path.display().to_string(), reason: error.to_string() }
}

impl RunFolder {
    /// Makes a new one, after removing those that nobody holds any more.
    pub fn create() -> Result<RunFolder, RunError> {
        let base = base();
        clean_stale();
        let time = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_nanos() as u64);
        for attempt in 0..ATTEMPTS {
            // unique together with the folder's creation: a taken name is tried again
            let id = base36(
                time.wrapping_mul(31).wrapping_add(u64::from(std::process::id())).wrapping_add(attempt) % 36_u64.pow(7),
            );
            let path = base.join(&id);
            // another run that leaves may remove the folder of all runs at any moment, and one that starts may take a new
            // folder without a lock on it for one that nobody holds
            let made = std::fs::create_dir_all(&base).and_then(|()| std::fs::create_dir(&path));
            match made.map_err(failed(&path)).and_then(|()| RunFolder::join(&path)) {
                Ok(folder) if path.join("lock").exists() => return Ok(folder),
                Err(error) if attempt == ATTEMPTS - 1 => return Err(error),
                _ => {}
            }
        }
        Err(RunError::Folder { path: base.display().to_string(), reason: "no free name for a run folder".into() })
    }

    /// Takes part in the run of that folder.
    pub fn join(path: &Path) -> Result<RunFolder, RunError> {
        let lock_path = path.join("lock");
        let lock = File::options().create(true).append(true).open(&lock_path).map_err(failed(&lock_path))?;
        flock(&lock, FlockOperation::LockShared).map_err(|error| failed(&lock_path)(error.into()))?;
        let id = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(RunFolder { path: path.to_path_buf(), prefix: format!("vr{id}_"), lock })
    }

    /// Writes what all processes of the run need to know.
    pub fn write_context(&self, context: &Context) -> Result<(), RunError> {
        let path = self.path.join("context.toml");
        let text = toml::to_string(context)
            .map_err(|error| RunError::Folder { path: path.display().to_string(), reason: error.to_string() })?;
        std::fs::write(&path, text).map_err(failed(&path))
    }

    /// Reads it.
    pub fn read_context(&self) -> Result<Context, RunError> {
        let path = self.path.join("context.toml");
        let text = std::fs::read_to_string(&path).map_err(failed(&path))?;
        toml::from_str(&text)
            .map_err(|error| RunError::Folder { path: path.display().to_string(), reason: error.to_string() })
    }
}

impl Drop for RunFolder {
    /// The last one out removes everything.
    fn drop(&mut self) {
        if flock(&self.lock, FlockOperation::NonBlockingLockExclusive).is_ok() {
            remove(&self.path, &self.prefix);
        }
    }
}

fn remove(path: &Path, prefix: &str) {
    for left in channels::remove_leftovers(prefix) {
        tracing::warn!("cannot remove {}", left.display());
    }
    if let Err(error) = std::fs::remove_dir_all(path) {
        tracing::warn!("cannot remove {}: {error}", path.display());
    }
    // the folder of all runs goes when it is empty
    let _ = std::fs::remove_dir(base());
}

/// Folders of this user's runs that somebody holds.
pub fn live_runs() -> Vec<PathBuf> {
    runs(false)
}

/// Folders of this user's runs that nobody holds any more.
pub fn stale_runs() -> Vec<PathBuf> {
    runs(true)
}

fn runs(stale: bool) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(base()) else { return Vec::new() };
    let is_wanted = |path: &PathBuf| {
        // a folder without a lock file is one that is just being made
        let Ok(lock) = File::options().append(true).open(path.join("lock")) else { return false };
        flock(&lock, FlockOperation::NonBlockingLockExclusive).is_ok() == stale
    };
    let mut found: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_wanted).collect();
    found.sort();
    found
}

/// Removes the folders of runs that nobody holds any more; returns their paths.
pub fn clean_stale() -> Vec<PathBuf> {
    let stale = stale_runs();
    for path in &stale {
        // whoever takes the lock removes; somebody else may have done so meanwhile
        let Ok(lock) = File::options().append(true).open(path.join("lock")) else { continue };
        if flock(&lock, FlockOperation::NonBlockingLockExclusive).is_ok() {
            let id = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            remove(path, &format!("vr{id}_"));
        }
    }
    stale
}

fn base36(mut number: u64) -> String {
    let mut digits = Vec::new();
    loop {
        digits.push(char::from_digit((number % 36) as u32, 36).unwrap_or('0'));
        number /= 36;
        if number == 0 {
            return digits.into_iter().rev().collect();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_one_out_removes_the_folder() {
        let first = RunFolder::create().expect("folder");
        let second = RunFolder::join(&first.path).expect("join");
        let path = first.path.clone();
        drop(first);
        assert!(path.exists(), "somebody still holds it");
        drop(second);
        assert!(!path.exists());
    }

    #[test]
    fn folders_are_made_whole_while_other_runs_come_and_go() {
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..200 {
                        let folder = RunFolder::create().expect("folder");
                        std::fs::write(folder.path.join("bells"), "").expect("it is there");
                    }
                });
            }
        });
    }

    #[test]
    fn a_folder_in_use_is_not_stale() {
        let folder = RunFolder::create().expect("folder");
        assert!(!clean_stale().contains(&folder.path));
        assert!(folder.path.exists());
    }
}
