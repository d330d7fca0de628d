//! How long an output watchdog holds out on a channel that loses messages: heartbeats through the real channel into the
//! real cards.

use board::{Board, BoardId, Inputs, Mail, Outputs};
use channels::{Exchange, Inboxes, Tamper, TamperKind, Tampering};
use da_io::DaIo;
use messages::registers::parallel;
use messages::{BusWord, EventKind, TransferRecord};

/// Time between two heartbeats, ns.
const PERIOD: u64 = 5_000_000;

/// Mean number of heartbeats up to the one whose loss lets the watchdog expire, which takes `n` in a row, each lost with
/// `probability`; of so many trips.
fn mean_to_trip(n: u64, probability: f64, trips: u64) -> f64 {
    let timeout = format!("da_io.watchdog_ms={}", (n * PERIOD) as f64 * 1e-6);
    let scenario = scenario::load("table-5-3", &[timeout]).expect("document").scenario().expect("scenario");
    let addr = scenario.card_base("parallel-io").expect("card") + parallel::WATCHDOG;
    let kind = TamperKind::Drop(probability);
    let loss = Tamper { number: 0, from: BoardId::ControlComputer, kind, holds: vec![(1, u64::MAX)] };
    let tampering = Tampering { seed: 1, max_age: PERIOD, faults: vec![loss] };
    let mut channel = Exchange::open(&[BoardId::ControlComputer, BoardId::DaIo], None, |_| 0, &tampering).expect("channel");
    let (mut inboxes, mut defects) = (Inboxes::default(), Vec::new());
    let (mut inputs, mut out, mut mail) = (Inputs::default(), Outputs::default(), Mail::default());
    let (mut heartbeats, mut cards) = (0, DaIo::new(&scenario).expect("cards"));
    let mut job = 0_u32;
    for _ in 0..trips {
        // the first heartbeat arms the watchdog: it is not lost
        let mut first = true;
        loop {
            let t = PERIOD * u64::from(job + 1);
            mail.clear();
            mail.words.push(BusWord { t: 0, addr, value: job, job, task: 0, index: 0 });
            channel.deliver(BoardId::ControlComputer, if first { 0 } else { t }, &mail, &mut inboxes).expect("deliver");
            channel.check(BoardId::DaIo, t, &mut inboxes, &mut defects);
            std::mem::swap(&mut inputs.mail, &mut inboxes[BoardId::DaIo as usize]);
            let write = TransferRecord { data_at: t, addr, n: 1, job, width: 2, dir: 1, ..bytemuck::Zeroable::zeroed() };
            inputs.transfers.push(write);
            (inputs.from, inputs.until) = (t - PERIOD / 2, t + PERIOD / 2);
            cards.step(inputs.until, &inputs, &mut out);
            inputs.mail.clear();
            inputs.transfers.clear();
            job += 1;
            heartbeats += u64::from(!std::mem::take(&mut first));
            let expired = out.mail.events.iter().any(|event| event.kind == EventKind::WatchdogExpired as u32);
            out.clear();
            if expired {
                break;
            }
        }
        cards = DaIo::new(&scenario).expect("cards");
    }
    heartbeats as f64 / trips as f64
}

#[test]
fn an_output_watchdog_trips_after_as_many_lossy_heartbeats_as_the_closed_form_says() {
    // the spread of a trip is about its mean: 2.2 % of it for 2000 trips
    for (n, p) in [(3, 0.1), (5, 0.3)] {
        let mean = mean_to_trip(n, p, 2000);
        let p_n = f64::powi(p, n as i32);
        let expected = (1.0 - p_n) / ((1.0 - p) * p_n);
        println!("{n} losses in a row at {p}: {mean:.1} heartbeats, closed form {expected:.1}");
        assert!((mean / expected - 1.0).abs() < 0.05, "{n} losses at {p}: {mean}, expected {expected}");
    }
}
