//! Lock-step windows a second with all processes, empty boards and their data over iceoryx2:
//! `VMERACK_BELL=yield|block|spin cargo run --release -p pacing --example windows [SECONDS]`.

use board::{Board, BoardId, Inputs, Mail, Ns, Op, Outputs};
use bytemuck::Zeroable;
use messages::{AmplifierCommand, BusWord, ControlProbe, PlantProbe, PlantSample};
use pacing::{Context, Flow, Lockstep, Observer};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use vme::Log;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// One decision, so one window, every 100 µs of simulated time.
const PERIOD: Ns = 100_000;

/// Sends what the real board sends in a window, and computes nothing.
struct Empty {
    role: BoardId,
}

impl Board for Empty {
    fn step(&mut self, now: Ns, inputs: &Inputs, out: &mut Outputs) {
        let mail = &mut out.mail;
        match self.role {
            BoardId::DaIo => mail.amplifier.push(AmplifierCommand { t: now, ..Zeroable::zeroed() }),
            BoardId::HwSim => {
                mail.plant.extend([inputs.from, now].map(|t| PlantSample { t, ..Zeroable::zeroed() }));
                mail.plant_probe.push(PlantProbe { t: now, ..Zeroable::zeroed() });
            }
            BoardId::ForceSensorIf => mail.words.extend([BusWord::zeroed(); 8]),
            BoardId::EncoderIf => mail.words.extend([BusWord::zeroed(); 14]),
            BoardId::ControlComputer => {
                mail.words.extend([BusWord::zeroed(); 8]);
                mail.control_probe.push(ControlProbe { t: now, ..Zeroable::zeroed() });
                if inputs.boot {
                    out.programs.push((0, vec![Op::Exec(1000), Op::Decide]));
                }
            }
            _ => {}
        }
    }
}

/// Ends the run when its time is up.
struct Watch {
    windows: u64,
    end: Instant,
}

impl Observer for Watch {
    fn window(&mut self, _until: Ns, _mail: &Mail, _log: &Log) -> Flow {
        self.windows += 1;
        if self.windows.is_multiple_of(64) && Instant::now() > self.end { Flow::Stop } else { Flow::Continue }
    }
}

fn main() -> ExitCode {
    let factory = |role, _: &Context| Ok(Box::new(Empty { role }) as Box<dyn Board>);
    if std::env::args().any(|argument| argument == "--run") {
        return pacing::serve(&factory);
    }
    match count(&factory) {
        Ok(per_s) => {
            let bell = std::env::var("VMERACK_BELL").unwrap_or_else(|_| "yield".into());
            println!("{bell:8} {per_s:>10.0} windows a second");
            ExitCode::SUCCESS
        }
        Err(reason) => {
            eprintln!("{reason}");
            ExitCode::FAILURE
        }
    }
}

fn count(factory: pacing::Factory<'_>) -> Result<f64, Box<dyn std::error::Error>> {
    let seconds = std::env::args().nth(1).map_or(Ok(2.0), |text| text.parse())?;
    // no traffic but the windows themselves: no interrupters, no console
    let settings = [format!("rack.tasks.control.period_ns={PERIOD}"), "rack.interrupters=[]".into()];
    let mut scenario = scenario::load("table-5-3", &settings)?.scenario()?;
    scenario.processes.retain(|process| process.name != "chassis");
    let this = std::env::current_exe()?.to_string_lossy().into_owned();
    let context = Context { prefix: String::new(), variant: String::new(), record: None, measure: false, in_process: false, scenario };
    let mut rack = Lockstep::power_up(context, factory, &|_| vec![this.clone()], &INTERRUPTED)?;
    let begun = Instant::now();
    let mut watch = Watch { windows: 0, end: begun + Duration::from_secs_f64(seconds) };
    rack.run(Ns::MAX, &mut watch)?;
    let per_s = watch.windows as f64 / begun.elapsed().as_secs_f64();
    rack.finish()?;
    Ok(per_s)
}
