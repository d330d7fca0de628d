//! What a run shows of itself while somebody watches: `status.json` in its folder, a few times a second.
//!
//! `vmerack top` asks by touching `watched` in the folder; a run that nobody watches writes nothing.

use report::latency::Journal;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// How often it is written.
pub const PERIOD: Duration = Duration::from_millis(500);
/// A request counts for this long.
const ASKED: Duration = Duration::from_secs(3);
const REQUEST: &str = "watched";
const FILE: &str = "status.json";

/// A run under way.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Status {
    /// Process number of the command.
    pub pid: u32,
    /// Scenario's title and variant.
    pub run: String,
    /// How time goes.
    pub pacing: String,
    /// Simulated time reached, s.
    pub simulated_s: f64,
    /// Wall time since the first window, s.
    pub wall_s: f64,
    /// Safety state of the control computer.
    pub state: String,
    /// Events of severity error, with their simulated time, the last ones.
    pub faults: Vec<String>,
    /// Steps, messages and cycles; empty in lock step, where nothing is measured.
    pub rows: Vec<StatusRow>,
}

/// One path.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StatusRow {
    /// Path.
    pub path: String,
    /// How often a second, over the whole run.
    pub per_s: f64,
    /// Median, µs.
    pub p50_us: f64,
    /// 99 of 100 are at most this long, µs.
    pub p99_us: f64,
    /// Greatest, µs.
    pub max_us: f64,
    /// Too late, or not at all.
    pub missed: Option<u64>,
}

/// Rows of what has been measured so far.
pub fn rows(journal: &Journal, wall_s: f64) -> Vec<StatusRow> {
    let micro = |ns: u64| ns as f64 * 1e-3;
    let measured = journal.rows().filter(|row| row.n() > 0);
    measured
        .map(|row| StatusRow {
            path: row.path().to_owned(),
            per_s: row.n() as f64 / wall_s.max(1e-9),
            p50_us: micro(row.quantile(0.5)),
            p99_us: micro(row.quantile(0.99)),
            max_us: micro(row.quantile(1.0)),
            missed: row.missed,
        })
        .collect()
}

/// The run's end: writes where somebody watches.
pub struct Shown {
    folder: PathBuf,
    next: Instant,
}

impl Shown {
    /// In the run's folder.
    pub fn new(folder: &Path) -> Shown {
        Shown { folder: folder.to_owned(), next: Instant::now() }
    }

    /// Whether it is time to write, and somebody watches.
    pub fn due(&mut self) -> bool {
        let now = Instant::now();
        if now < self.next {
            return false;
        }
        self.next = now + PERIOD;
        let asked = std::fs::metadata(self.folder.join(REQUEST)).and_then(|file| file.modified());
        asked.is_ok_and(|at| SystemTime::now().duration_since(at).is_ok_and(|age| age < ASKED))
    }

    /// Writes it; a watcher sees the old one or the new one. Nobody is told where that fails: a run is worth more.
    pub fn write(&self, status: &Status) {
        let new = self.folder.join("status.new");
        if let Ok(text) = serde_json::to_string(status)
            && std::fs::write(&new, text).is_ok()
        {
            let _ = std::fs::rename(&new, self.folder.join(FILE));
        }
    }
}

/// The watcher's end: asks the run in that folder to show itself; `anew`: what it has shown before does not count.
pub fn ask(folder: &Path, anew: bool) -> std::io::Result<()> {
    if anew {
        // there may be none
        let _ = std::fs::remove_file(folder.join(FILE));
    }
    std::fs::write(folder.join(REQUEST), "")
}

/// What the run last showed; `None` where it has not yet.
pub fn read(folder: &Path) -> Option<Status> {
    serde_json::from_str(&std::fs::read_to_string(folder.join(FILE)).ok()?).ok()
}
