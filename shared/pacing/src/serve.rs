//! The whole `main` of a process that hosts boards.

use crate::faults::tampering;
use crate::host::{Answer, Factory, Host};
use crate::realtime::{self, Paced};
use crate::remote::{Line, READY};
use crate::{RunError, RunFolder, turns};
use board::BoardId;
use channels::{Bells, Domain, Exchange, sleep_until, wall_ns};
use messages::{BOARDS, Grant, NOBODY, TransferRecord, flags};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// How often an idle process looks whether its run still lives.
const LIFELINE_PERIOD: Duration = Duration::from_millis(100);
/// The same once the run has ended.
const LEAVING_PERIOD: Duration = Duration::from_millis(1);
/// Bell of the chassis; the others follow in the order of the scenario's processes.
pub(crate) const CHASSIS_BELL: usize = 0;

/// Runs the boards of the process that the command line names (`--run FOLDER --process NAME`), until the run ends.
///
/// A user's own board is one line: `fn main() -> ExitCode { pacing::serve(&|_, context| Ok(Box::new(Mine::new(&context.scenario)?))) }`.
pub fn serve(factory: Factory<'_>) -> ExitCode {
    let filter = tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| "warn".into());
    // a second initialisation in one process is harmless
    let _ = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).try_init();
    let mut arguments = std::env::args().skip_while(|argument| argument != "--run");
    let (run, folder, key, name) = (arguments.next(), arguments.next(), arguments.next(), arguments.next());
    let (Some(_), Some(folder), Some("--process"), Some(name)) = (run, folder, key.as_deref(), name) else {
        eprintln!("this program is a board of a rack; `vmerack run` starts it with --run FOLDER --process NAME");
        return ExitCode::from(2);
    };
    match host_until_the_end(PathBuf::from(folder), &name, factory) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{name}: {error}");
            ExitCode::FAILURE
        }
    }
}

fn host_until_the_end(path: PathBuf, name: &str, factory: Factory<'_>) -> Result<(), RunError> {
    let folder = RunFolder::join(&path)?;
    let context = folder.read_context()?;
    let processes = &context.scenario.processes;
    let Some(index) = processes.iter().position(|process| process.name == name) else {
        return Err(RunError::Folder {
            path: path.display().to_string(),
            reason: format!("no process `{name}` in this run"),
        });
    };
    let here: Vec<BoardId> = processes[index].boards.iter().filter_map(|board| BoardId::from_name(board)).collect();
    let domain = Domain::join(&folder.path, &folder.prefix, name)?;
    let place = |board| process_of(&context.scenario, board);
    let exchange = Exchange::open(&here, Some(&domain), place, &tampering(&context.scenario))?;
    let mut line = Line::open(&domain, name, context.measure)?;
    let bells = Bells::open(&folder.path.join("bells"), processes.len() + 1)?;
    let mut bell = bells.bell(index + 1);
    // what rang before was for a process that this one replaces
    bell.rung();
    let mut host = Host::new(&here, exchange, &context, factory)?;
    if context.measure {
        host.measure();
    }
    let mut transfers = Vec::with_capacity(64);
    line.reply(here[0], READY, &Answer::default())?;
    bells.ring(CHASSIS_BELL);
    let mut until = 0;
    let mut patience = LIFELINE_PERIOD;
    let mut paced: Option<Paced> = None;
    // a grant whose turn has not come
    let mut waiting: Option<Grant> = None;
    loop {
        while let Some(grant) = next_grant(&mut line, &mut waiting, &mut transfers)? {
            if grant.flags & flags::TURN != 0 {
                let turns_before = grant.turn.wrapping_sub(bells.turn()) as i32;
                if turns_before > 0 {
                    waiting = Some(grant);
                    break;
                }
                if turns_before < 0 {
                    // void
                    continue;
                }
            }
            if grant.flags & flags::START != 0 && grant.from != 0 {
                paced = Some(Paced::new(grant.from, &context.scenario));
                host.run_free();
                here.iter().for_each(|board| host.begins_anywhere(*board));
                continue;
            }
            if grant.flags & flags::START != 0 {
                let refused = realtime::ask_for_rights(&context.scenario.realtime, Some(&processes[index]));
                let own = processes[index].priority.is_some() || !processes[index].cpus.is_empty();
                match refused.is_empty() {
                    false if context.scenario.realtime.strict => {
                        return Err(RunError::Refused { what: refused.join("; ") });
                    }
                    // what all processes are refused is the chassis' to tell, once
                    false if own => eprintln!("{name}: real time without {}; the run goes on", refused.join("; ")),
                    _ => {}
                }
                line.reply(here[0], grant.window, &Answer::default())?;
                bells.ring(CHASSIS_BELL);
                continue;
            }
            if let Some(paced) = &mut paced {
                paced.push(grant, &transfers);
                continue;
            }
            if grant.flags & flags::BOOT != 0 && grant.until > 0 {
                // what came while this process started up was for one that is no more
                host.renew(BOARDS[grant.board as usize % BOARDS.len()])?;
            }
            let answer = host.step(&grant, &transfers)?;
            if let Some(spans) = host.spans() {
                line.tell(spans, true);
            }
            until = grant.until;
            if grant.flags & flags::FINISH != 0 {
                patience = LEAVING_PERIOD;
            }
            let board = BoardId::from_number(grant.board as u8).unwrap_or(BoardId::Chassis);
            match grant.flags & flags::TURN != 0 {
                true if answer == Answer::default() => turns::hand_on(&bells, &grant),
                true => {
                    line.reply(board, grant.window, &answer)?;
                    bells.ring(CHASSIS_BELL);
                }
                false => {
                    line.reply(board, grant.window, &answer)?;
                    if grant.next != NOBODY {
                        bells.ring(grant.next as usize);
                    }
                }
            }
        }
        if let Some(paced) = &mut paced
            && let Some(due) = paced.due()
        {
            sleep_until(due, LIFELINE_PERIOD);
            if wall_ns() < due {
                continue;
            }
            if let Some((grant, answer)) = paced.step(&mut host)? {
                until = grant.until;
                let finish = grant.flags & flags::FINISH != 0;
                if finish {
                    patience = LEAVING_PERIOD;
                    host.count_sent();
                }
                if let Some(spans) = host.spans() {
                    line.tell(spans, finish);
                }
                let board = BoardId::from_number(grant.board as u8).unwrap_or(BoardId::Chassis);
                line.reply(board, grant.window, &answer)?;
                bells.ring(CHASSIS_BELL);
            }
            continue;
        }
        if bell.wait(patience) == 0 && lifeline_cut() {
            if here.contains(&BoardId::BusAnalyzer) {
                // the record up to here is worth keeping
                while let Some(grant) = line.grant(&mut transfers)? {
                    if grant.board == BoardId::BusAnalyzer as u32 {
                        host.step(&grant, &transfers)?;
                        until = grant.until;
                    }
                }
                host.step(&closing_grant(BoardId::BusAnalyzer, until), &[])?;
            }
            return Ok(());
        }
    }
}

/// The grant that waits for its turn, or the next one.
fn next_grant(
    line: &mut Line,
    waiting: &mut Option<Grant>,
    transfers: &mut Vec<TransferRecord>,
) -> Result<Option<Grant>, RunError> {
    match waiting.take() {
        Some(grant) => Ok(Some(grant)),
        None => Ok(line.grant(transfers)?),
    }
}

pub(crate) fn closing_grant(board: BoardId, until: vme::Ns) -> Grant {
    let (board, flags) = (board as u32, flags::FINISH);
    Grant { window: u64::MAX - 1, from: until, until, board, flags, task: 0, job: 0, next: NOBODY, turn: 0 }
}

/// Number of the process that hosts the board; the chassis is 0. Boards of a process named `chassis` live in it.
pub(crate) fn process_of(scenario: &scenario::Scenario, board: BoardId) -> usize {
    scenario
        .processes
        .iter()
        .position(|process| process.name != BOARDS[0].name() && process.boards.iter().any(|name| name == board.name()))
        .map_or(0, |i| i + 1)
}

/// The chassis has closed our standard input, or is gone.
fn lifeline_cut() -> bool {
    let stdin = std::io::stdin();
    let mut poll_fd = [PollFd::new(&stdin, PollFlags::empty())];
    let now = Timespec { tv_sec: 0, tv_nsec: 0 };
    matches!(poll(&mut poll_fd, Some(&now)), Ok(1))
        && poll_fd[0].revents().intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL)
}
