//! The record after its run: made whole where it was cut, its parts joined, its digest, and what it lacks.

use std::path::{Path, PathBuf};

/// A window is no longer than this, and nothing is recorded within one, s.
const WINDOW_S: f64 = 0.02;

/// A whole record.
pub struct Settled {
    /// Its digest.
    pub digest: String,
    /// Stretches of simulated time that it lacks, s.
    pub unrecorded: Vec<(f64, f64)>,
}

/// The files of a record: one, and another for each time that the recorder was started again.
pub fn parts(record: &Path) -> impl Iterator<Item = PathBuf> {
    let first = record.to_path_buf();
    let more = (2..).map({
        let record = record.to_path_buf();
        move |number| pacing::part_of(&record, number)
    });
    std::iter::once(first).chain(more.take_while(|file| file.exists()))
}

/// Settles the record of a run that reached `reached_s`; one that is not `broken` needs its digest alone. The message says
/// which file cannot be read or written, and why.
pub fn settle(record: &Path, broken: bool, reached_s: f64) -> Result<Settled, String> {
    let digest = |record: &Path| bus_analyzer::digest_file(record).map_err(|error| error.to_string());
    if !broken {
        return Ok(Settled { digest: digest(record)?, unrecorded: Vec::new() });
    }
    let mut whole = Vec::new();
    for part in parts(record) {
        match make_whole(&part) {
            Ok(()) => whole.push(part),
            Err(reason) if whole.is_empty() => return Err(reason),
            // a recorder that was lost again before it had written anything
            Err(reason) => eprintln!("warning: {reason}"),
        }
    }
    let joined_file = record.with_extension("mcap.part");
    let joined = bus_analyzer::join(&whole, &joined_file).map_err(|error| error.to_string())?;
    std::fs::rename(&joined_file, record).map_err(|error| format!("{}: {error}", record.display()))?;
    for part in parts(record).skip(1).collect::<Vec<_>>() {
        std::fs::remove_file(&part).map_err(|error| format!("{}: {error}", part.display()))?;
    }
    let s = |ns: vme::Ns| ns as f64 * 1e-9;
    let mut unrecorded: Vec<(f64, f64)> = joined.gaps.iter().map(|(from, to)| (s(*from), s(*to))).collect();
    if reached_s - s(joined.last) > WINDOW_S {
        unrecorded.push((s(joined.last), reached_s));
    }
    Ok(Settled { digest: digest(record)?, unrecorded })
}

/// Makes a record that was cut short whole, in its place.
fn make_whole(record: &Path) -> Result<(), String> {
    if bus_analyzer::digest_file(record).is_ok() {
        return Ok(());
    }
    let whole = record.with_extension("mcap.whole");
    let recovered = bus_analyzer::recover(record, &whole).map_err(|error| {
        // half a file is of no use; there may be none
        let _ = std::fs::remove_file(&whole);
        format!("{}: {error}", record.display())
    })?;
    std::fs::rename(&whole, record).map_err(|error| format!("{}: {error}", record.display()))?;
    eprintln!("record made whole: {recovered}");
    Ok(())
}
