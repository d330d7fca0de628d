//! The workstation at work: its console task against a control computer that accepts every command at once, or loses some.

use board::{Board, BoardId, Inputs, Outputs};
use messages::registers::mailbox;
use messages::{Command, EventKind, Telemetry};
use scenario::Scenario;
use vme::{Access, Direction, Ns, Op, Width};
use workstation::Workstation;

const PERIOD: Ns = 100_000_000;

fn table_5_3() -> Scenario {
    scenario::load("table-5-3", &[])
        .unwrap()
        .scenario()
        .unwrap()
}

/// What came out of one job.
struct Job {
    t: Ns,
    commands: Vec<Command>,
    /// Accesses after the decision.
    rest: Vec<Op>,
    /// Events: kind and first figure.
    events: Vec<(u32, f64)>,
}

/// Runs the console task for the length of the scenario; `accepts` sees every command and says if it arrives.
fn run(scenario: &Scenario, mut accepts: impl FnMut(&Command) -> bool) -> Vec<Job> {
    let mut board = Workstation::new(scenario).unwrap();
    let task = scenario.task_of(BoardId::Workstation.name()).unwrap();
    let (mut inputs, mut out) = (Inputs::default(), Outputs::default());
    let (mut epoch, mut rest) = (0, Vec::new());
    (0..scenario.duration_ns() / PERIOD)
        .map(|job| {
            inputs.until = job * PERIOD + 5_000;
            inputs.decision = Some(board::Decision {
                task,
                job: job as u32,
            });
            inputs.mail.telemetry.clear();
            inputs.mail.telemetry.push(Telemetry {
                epoch,
                ..bytemuck::Zeroable::zeroed()
            });
            out.clear();
            board.step(inputs.until, &inputs, &mut out);
            rest = out.rest.take().unwrap_or(std::mem::take(&mut rest));
            for command in &out.mail.commands {
                if command.epoch == epoch + 1 && accepts(command) {
                    epoch += 1;
                }
            }
            Job {
                t: inputs.until,
                commands: out.mail.commands.clone(),
                rest: rest.clone(),
                events: out
                    .mail
                    .events
                    .iter()
                    .map(|event| (event.kind, event.a))
                    .collect(),
            }
        })
        .collect()
}

#[test]
fn at_boot_the_program_reads_the_state_block_and_decides() {
    let scenario = table_5_3();
    let mut board = Workstation::new(&scenario).unwrap();
    let mut out = Outputs::default();
    board.step(
        0,
        &Inputs {
            boot: true,
            ..Inputs::default()
        },
        &mut out,
    );
    let base = scenario.card_base("cpu-1-dpram").unwrap();
    let read = Access {
        am: 0x3D,
        addr: base + mailbox::TELEMETRY,
        width: Width::D32,
        dir: Direction::Read,
        n: 30,
    };
    assert_eq!(size_of::<Telemetry>(), 4 * 30);
    let task = scenario.task_of("workstation").unwrap();
    assert_eq!(
        out.programs,
        [(task, vec![Op::Access(read), Op::Decide])]
    );
    assert_eq!(out.rest, None);
}

#[test]
fn all_segments_are_sent_in_order_each_once_and_before_they_start() {
    let scenario = table_5_3();
    let jobs = run(&scenario, |_| true);
    let sent: Vec<_> = jobs
        .iter()
        .flat_map(|job| job.commands.iter().map(|c| (job.t, *c)))
        .collect();
    let epochs: Vec<u32> = sent.iter().map(|(_, command)| command.epoch).collect();
    assert_eq!(
        epochs,
        (1..=scenario.segments.len() as u32).collect::<Vec<_>>()
    );
    assert_eq!(sent[0].0, 5_000, "the first goes out with the first job");
    for (t, command) in &sent[1..] {
        let ahead = command.start.saturating_sub(*t);
        assert!(
            ahead == 0 && command.start == 0 || (PERIOD..=3 * PERIOD).contains(&ahead),
            "{ahead}"
        );
    }
    assert!(jobs.iter().all(|job| job.events.is_empty()));
}

#[test]
fn each_command_has_one_block_write_of_its_own() {
    let scenario = table_5_3();
    let base = scenario.card_base("cpu-1-dpram").unwrap();
    for job in run(&scenario, |_| true) {
        assert_eq!(job.rest.len(), job.commands.len());
        for op in job.rest {
            let n = size_of::<Command>() as u32 / 4;
            let addr = base + mailbox::COMMAND;
            assert_eq!(
                op,
                Op::Access(Access {
                    am: 0x3D,
                    addr,
                    width: Width::D32,
                    dir: Direction::Write,
                    n
                })
            );
        }
    }
}

#[test]
fn a_command_lost_once_is_sent_again_and_nothing_is_missing() {
    let scenario = table_5_3();
    let (mut lost, mut accepted) = (false, Vec::new());
    let jobs = run(&scenario, |command| {
        if command.epoch == 2 && !lost {
            lost = true;
            return false;
        }
        accepted.push(command.epoch);
        true
    });
    assert_eq!(
        accepted,
        (1..=scenario.segments.len() as u32).collect::<Vec<_>>()
    );
    assert!(jobs.iter().all(|job| job.events.is_empty()));
}

#[test]
fn a_command_never_accepted_is_given_up_with_an_event() {
    let scenario = table_5_3();
    let jobs = run(&scenario, |command| command.epoch < 2);
    let events: Vec<_> = jobs.iter().flat_map(|job| job.events.clone()).collect();
    assert_eq!(events.first(), Some(&(EventKind::MessageLost as u32, 2.0)));
    let sendings = jobs
        .iter()
        .flat_map(|job| &job.commands)
        .filter(|command| command.epoch == 2)
        .count();
    assert_eq!(sendings, workstation::sender::SENDINGS as usize);
}

#[test]
fn a_rack_without_a_console_task_or_a_mailbox_is_refused() {
    let mut scenario = table_5_3();
    scenario
        .rack
        .slaves
        .retain(|slave| slave.name != "cpu-1-dpram");
    assert!(Workstation::new(&scenario).is_err_and(|message| message.contains("cpu-1-dpram")));
    let mut scenario = table_5_3();
    scenario
        .rack
        .tasks
        .retain(|task| task.board != "workstation");
    assert!(Workstation::new(&scenario).is_err_and(|message| message.contains("workstation")));
}

/// Table 5-3 with a fault of the workstation from 1.55 s on.
fn faulty(kind: &str, more: &str) -> Scenario {
    let fault = format!("fault=[{{ target='workstation', kind='{kind}', start_s=1.55, {more} }}]");
    scenario::load("table-5-3", &[fault]).unwrap().scenario().unwrap()
}

/// When each fault is told to have begun.
fn injected(jobs: &[Job]) -> Vec<Ns> {
    let told = |job: &&Job| job.events.contains(&(EventKind::FaultInjected as u32, 0.0));
    jobs.iter().filter(told).map(|job| job.t).collect()
}

#[test]
fn a_program_that_ends_polls_and_sends_no_more_until_it_runs_again() {
    let scenario = faulty("gone", "duration_s=5.0");
    let mut board = Workstation::new(&scenario).unwrap();
    let task = scenario.task_of("workstation").unwrap();
    let (mut inputs, mut out) = (Inputs::default(), Outputs::default());
    let mut programs = Vec::new();
    for job in 0..80 {
        inputs.until = u64::from(job) * PERIOD + 5_000;
        inputs.decision = Some(board::Decision { task, job });
        out.clear();
        board.step(inputs.until, &inputs, &mut out);
        let gone = (16..66).contains(&job);
        assert!(!gone || out.mail.commands.is_empty());
        programs.extend(out.programs.iter().map(|(_, program)| (job, program.len())));
    }
    // a decision without a read, then both again
    assert_eq!(programs, [(16, 1), (66, 2)]);
}

#[test]
fn a_stale_command_repeats_the_newest_one_under_its_old_epoch() {
    let jobs = run(&faulty("stale-command", ""), |_| true);
    assert_eq!(injected(&jobs), [16 * PERIOD + 5_000]);
    let before = jobs[..16].iter().flat_map(|job| &job.commands).next_back().unwrap();
    assert_eq!(jobs[16].commands, [*before]);
    assert_eq!(jobs[16].rest.len(), 1, "with a block write of its own");
}

#[test]
fn a_wrong_command_asks_for_a_jump_under_the_next_epoch_and_the_others_count_on() {
    let scenario = faulty("wrong-command", "amount=0.5");
    let jobs = run(&scenario, |_| true);
    let sent: Vec<&Command> = jobs.iter().flat_map(|job| &job.commands).collect();
    let epochs: Vec<u32> = sent.iter().map(|command| command.epoch).collect();
    assert_eq!(epochs, (1..=scenario.segments.len() as u32 + 1).collect::<Vec<_>>());
    let wrong = jobs[16].commands[0];
    let model = sent[wrong.epoch as usize - 2];
    assert_eq!(wrong.position[2] - model.position[2], 0.5);
    assert_eq!((wrong.start, wrong.move_time), (16 * PERIOD + 5_000, 0));
}
