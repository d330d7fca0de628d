//! Output watchdog: a heartbeat that stands still for too long expires it, and it stays expired until acknowledged.

use messages::Ns;

/// Supervision of a heartbeat register.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Watchdog {
    /// Longest time between two different values, ns; 0 = off.
    timeout: Ns,
    heartbeat: u32,
    /// When it will expire; none before the first heartbeat.
    deadline: Option<Ns>,
    expired: bool,
}

impl Watchdog {
    /// A watchdog that the first heartbeat arms.
    pub fn new(timeout: Ns) -> Watchdog {
        Watchdog {
            timeout,
            heartbeat: 0,
            deadline: None,
            expired: false,
        }
    }

    /// The heartbeat register is written.
    pub fn beat(&mut self, t: Ns, value: u32) {
        let changed = value != self.heartbeat || self.deadline.is_none();
        self.heartbeat = value;
        if changed && !self.expired && self.timeout > 0 {
            self.deadline = Some(t + self.timeout);
        }
    }

    /// When it expires unless fed.
    pub fn deadline(&self) -> Option<Ns> {
        self.deadline
    }

    /// Its deadline has come.
    pub fn expire(&mut self) {
        self.deadline = None;
        self.expired = true;
    }

    /// Whether it is expired.
    pub fn expired(&self) -> bool {
        self.expired
    }

    /// Value last written.
    pub fn heartbeat(&self) -> u32 {
        self.heartbeat
    }

    /// Clears an expired watchdog; the next heartbeat arms it again.
    pub fn acknowledge(&mut self) {
        self.expired = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_heartbeat_arms_it_and_only_a_new_value_feeds_it() {
        let mut watchdog = Watchdog::new(20);
        assert_eq!(watchdog.deadline(), None);
        watchdog.beat(100, 0);
        assert_eq!(watchdog.deadline(), Some(120));
        watchdog.beat(110, 1);
        watchdog.beat(115, 1);
        assert_eq!(watchdog.deadline(), Some(130));
    }

    #[test]
    fn an_expired_watchdog_stays_so_until_acknowledged() {
        let mut watchdog = Watchdog::new(20);
        watchdog.beat(0, 1);
        watchdog.expire();
        watchdog.beat(30, 2);
        assert!(watchdog.expired() && watchdog.deadline().is_none());
        watchdog.acknowledge();
        watchdog.beat(40, 3);
        assert_eq!((watchdog.expired(), watchdog.deadline()), (false, Some(60)));
    }

    #[test]
    fn a_timeout_of_zero_switches_it_off() {
        let mut watchdog = Watchdog::new(0);
        watchdog.beat(5, 1);
        assert_eq!(watchdog.deadline(), None);
    }
}
