//! The built-in board of every role, and the program that hosts it.

use board::{Board, BoardId};
use pacing::Context;
use scenario::Process;
use std::path::PathBuf;

/// Builds the board of that role.
pub fn build(role: BoardId, context: &Context) -> Result<Box<dyn Board>, String> {
    let scenario = &context.scenario;
    Ok(match role {
        BoardId::Chassis => return Err("the chassis is no board".into()),
        BoardId::DaIo => Box::new(da_io::DaIo::new(scenario)?),
        BoardId::HwSim => Box::new(hw_sim::HwSim::new(scenario)?),
        BoardId::ForceSensorIf => Box::new(force_sensor_if::ForceSensorIf::new(scenario)?),
        BoardId::EncoderIf => Box::new(encoder_if::EncoderIf::new(scenario)?),
        BoardId::ControlComputer => Box::new(control_computer::ControlComputer::new(scenario)?),
        BoardId::Workstation => Box::new(workstation::Workstation::new(scenario)?),
        BoardId::BusAnalyzer => {
            let resolved = context.resolved().map_err(|error| error.to_string())?;
            Box::new(bus_analyzer::BusAnalyzer::new(scenario, context.record.as_deref(), &resolved)?)
        }
    })
}

/// The program of a process and its arguments: the user's, the role's own (beside this command), or this command as host
/// of several boards.
pub fn program(process: &Process) -> Vec<String> {
    if !process.command.is_empty() {
        return process.command.clone();
    }
    let this = std::env::current_exe().unwrap_or_else(|_| PathBuf::from("vmerack"));
    match process.boards.as_slice() {
        [only] => vec![this.with_file_name(only).to_string_lossy().into_owned()],
        _ => vec![this.to_string_lossy().into_owned(), "host".into()],
    }
}
