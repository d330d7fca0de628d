//! Whether the chassis itself was stopped by a signal, as Ctrl-Z does, and told to go on.
//!
//! While it is stopped nobody tells the boards their windows: within the horizon they have nothing more to do, and the arm
//! stands where it is with them. What the wall clock has shown meanwhile cannot be made up for.

use signal_hook::SigId;
use signal_hook::consts::SIGCONT;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Hears SIGCONT for as long as it lives.
pub(super) struct Stops {
    continued: Arc<AtomicBool>,
    signal: SigId,
    /// When somebody last asked.
    asked: Instant,
}

impl Stops {
    /// Listens from now on.
    pub fn new() -> std::io::Result<Stops> {
        let continued = Arc::default();
        let signal = signal_hook::flag::register(SIGCONT, Arc::clone(&continued))?;
        Ok(Stops { continued, signal, asked: Instant::now() })
    }

    /// Wall time since the last call, where SIGCONT has come meanwhile: longer than the stop, if there was one.
    pub fn was_stopped(&mut self) -> Option<Duration> {
        let away = std::mem::replace(&mut self.asked, Instant::now()).elapsed();
        self.continued.swap(false, Ordering::Relaxed).then_some(away)
    }
}

impl Drop for Stops {
    fn drop(&mut self) {
        signal_hook::low_level::unregister(self.signal);
    }
}
