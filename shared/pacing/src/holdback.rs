//! What the recorder and the chassis hear of which window.
//!
//! Nobody waits for them: when they come to a window, mail of later ones may already have arrived, or not. So that what they
//! make of it does not depend on that, they get exactly what happened before the window's end, the chassis that at its end
//! too; the rest stays for the next one. All of that has been sent before they come to the window.

use board::{Mail, Ns};

/// Moves what happened before `until` from `inbox` to `mail`.
pub(crate) fn take_before(until: Ns, inbox: &mut Mail, mail: &mut Mail) {
    take(until, &mut inbox.plant_probe, &mut mail.plant_probe, |probe| probe.t);
    take(until, &mut inbox.control_probe, &mut mail.control_probe, |probe| probe.t);
    take(until, &mut inbox.events, &mut mail.events, |event| event.t);
    take(until, &mut inbox.transfers, &mut mail.transfers, |transfer| transfer.data_at);
    take(until, &mut inbox.masters, &mut mail.masters, |master| master.t);
    take(until, &mut inbox.paths, &mut mail.paths, |path| path.t);
}

/// Moves what happened up to and at `until`.
pub(crate) fn take_until(until: Ns, inbox: &mut Mail, mail: &mut Mail) {
    take_before(until + 1, inbox, mail);
}

fn take<T: Copy>(until: Ns, inbox: &mut Vec<T>, mail: &mut Vec<T>, t: impl Fn(&T) -> Ns) {
    mail.extend(inbox.iter().filter(|item| t(item) < until));
    inbox.retain(|item| t(item) >= until);
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::{Event, EventKind, Severity};

    /// Steps of 10 ns; every event is sent in the window that ends at or after it. Returns what each step gets.
    fn steps(lead: Ns) -> Vec<Vec<Ns>> {
        let event = |t| Event::new(t, EventKind::Tare, Severity::Ok, 0.0, 0.0);
        let (mut inbox, mut sent) = (Mail::default(), 0);
        (1..=4)
            .map(|step| {
                let until = 10 * step;
                // the sender is ahead by `lead`
                while sent < until + lead {
                    sent += 5;
                    inbox.events.push(event(sent));
                }
                let mut mail = Mail::default();
                take_before(until, &mut inbox, &mut mail);
                mail.events.iter().map(|event| event.t).collect()
            })
            .collect()
    }

    #[test]
    fn how_far_the_senders_are_ahead_does_not_show_in_what_a_step_gets() {
        assert_eq!(steps(0), [vec![5], vec![10, 15], vec![20, 25], vec![30, 35]]);
        assert_eq!(steps(15), steps(0));
    }
}
