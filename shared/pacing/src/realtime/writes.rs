//! Writes made to a board whose values may come after their time.
//!
//! A write takes effect at max(arrival, modelled time): while its value is missing it waits, and is made as soon as the
//! value is there. One whose value never comes is given up after [`PATIENCE`].

use board::{Mail, Ns};
use messages::{Grant, TransferRecord};

/// Simulated time after which a value is taken never to come.
const PATIENCE: Ns = 100 * vme::MILLISECOND;
/// Values that may be ahead of their writes; older ones have lost theirs.
const AHEAD: usize = 256;

/// The writes of one board.
pub(crate) struct Writes {
    /// Task, job and index of the values that are there.
    came: Vec<(u16, u32, u16)>,
    /// Command blocks that are there.
    commands: usize,
    waiting: Vec<TransferRecord>,
    /// Transfers to make in this step, in the order of their instants.
    pub ready: Vec<TransferRecord>,
    /// Of these, how many are made after their modelled time.
    pub late: u32,
}

impl Default for Writes {
    fn default() -> Self {
        Writes {
            came: Vec::with_capacity(AHEAD),
            commands: 0,
            waiting: Vec::new(),
            ready: Vec::with_capacity(64),
            late: 0,
        }
    }
}

impl Writes {
    /// Sorts the transfers of a window out, knowing the mail that has arrived.
    pub fn sort_out(&mut self, grant: &Grant, transfers: &[TransferRecord], mail: &Mail) {
        self.came.extend(mail.words.iter().map(|word| (word.task, word.job, word.index)));
        self.came.drain(..self.came.len().saturating_sub(AHEAD));
        self.commands += mail.commands.len();
        self.ready.clear();
        self.late = 0;
        // what waits has been looked for in all that came before
        let any = !mail.words.is_empty() || self.commands > 0;
        for i in 0..if any { self.waiting.len() } else { 0 } {
            let transfer = self.waiting[i];
            if self.has_come(&transfer) {
                self.late += 1;
                self.ready.push(transfer);
                // marks it as made
                self.waiting[i].status = u8::MAX;
            }
        }
        self.waiting.retain(|transfer| transfer.status != u8::MAX && transfer.data_at + PATIENCE > grant.until);
        for transfer in transfers {
            if transfer.is_read() || !transfer.is_ok() || self.has_come(transfer) {
                self.ready.push(*transfer);
            } else {
                self.waiting.push(*transfer);
            }
        }
        for transfer in &mut self.ready {
            transfer.data_at = transfer.data_at.max(grant.from);
        }
        self.ready.sort_unstable_by_key(|transfer| (transfer.data_at, transfer.task, transfer.job, transfer.index));
    }

    fn has_come(&mut self, transfer: &TransferRecord) -> bool {
        let key = (transfer.task, transfer.job, transfer.index);
        if let Some(i) = self.came.iter().position(|came| *came == key) {
            self.came.swap_remove(i);
            return true;
        }
        // a block of the mailbox carries a command, not register words
        let command = self.commands > 0;
        self.commands -= usize::from(command);
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use messages::BusWord;

    fn write(job: u32, data_at: Ns) -> TransferRecord {
        TransferRecord { job, data_at, done: data_at, dir: 1, ..Zeroable::zeroed() }
    }

    fn window(from: Ns, until: Ns) -> Grant {
        Grant { from, until, ..Zeroable::zeroed() }
    }

    fn value(job: u32) -> Mail {
        Mail { words: vec![BusWord { job, ..Zeroable::zeroed() }], ..Mail::default() }
    }

    #[test]
    fn a_write_whose_value_is_there_is_made_at_its_modelled_time() {
        let mut writes = Writes::default();
        writes.sort_out(&window(0, 10), &[], &value(3));
        writes.sort_out(&window(10, 20), &[write(3, 12)], &Mail::default());
        assert_eq!((writes.ready[0].data_at, writes.ready.len(), writes.late), (12, 1, 0));
    }

    #[test]
    fn a_write_whose_value_comes_late_is_made_on_its_arrival_and_counted() {
        let mut writes = Writes::default();
        writes.sort_out(&window(10, 20), &[write(3, 12)], &Mail::default());
        assert!(writes.ready.is_empty());
        writes.sort_out(&window(20, 30), &[], &value(3));
        assert_eq!((writes.ready[0].data_at, writes.ready.len(), writes.late), (20, 1, 1));
        writes.sort_out(&window(30, 40), &[], &Mail::default());
        assert!(writes.ready.is_empty(), "made once");
    }

    #[test]
    fn a_write_whose_value_never_comes_is_given_up() {
        let mut writes = Writes::default();
        writes.sort_out(&window(10, 20), &[write(3, 12)], &Mail::default());
        writes.sort_out(&window(20, 30 + PATIENCE), &[], &Mail::default());
        writes.sort_out(&window(30 + PATIENCE, 40 + PATIENCE), &[], &value(3));
        assert!(writes.ready.is_empty());
    }
}
