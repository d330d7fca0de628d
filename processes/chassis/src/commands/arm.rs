//! `vmerack arm`: the arm's mathematics from the command line.
//!
//! `eval` evaluates every algorithm of the crate `arm` on states from a file, `show` prints a model and its drives. Exit
//! code 0; 2 for a URDF that is no such arm (the element is named) or a state line that is none (the line is named); an
//! error where the output cannot be written.

mod eval;
mod show;
mod states;

use std::path::PathBuf;

use arm::ArmModel;
use clap::{Args, Subcommand};

/// Evaluate or show an arm: kinematics, dynamics, drives.
#[derive(Debug, Clone, Args)]
pub struct ArmArgs {
    #[command(subcommand)]
    command: ArmCommand,
}

#[derive(Debug, Clone, Subcommand)]
enum ArmCommand {
    /// Evaluate every algorithm on states from a file.
    ///
    /// An input line is {"q":[7],"qd":[7],"qdd":[7],"tau":[7]} in rad, rad/s, rad/s², Nm. The answer to
    /// it holds `pose` (4×4, row-major, tip in base), `jacobian` (6×7, rows linear xyz then angular
    /// xyz, base axes at the tip), `jdot_qd` (6), `mass_matrix` (7×7), `bias` (C q̇ + g, 7), `rnea` (7)
    /// and `fd` (7). Gravity is 9.81 m/s² along −z of the base.
    Eval {
        #[command(flatten)]
        source: Source,
        /// File with one state per line.
        #[arg(long, value_name = "FILE")]
        states: PathBuf,
        /// One JSON object per input line, in place of text.
        #[arg(long)]
        json: bool,
    },
    /// Print a model: joints, limits, masses, reach, drive data, and which figures are surrogates.
    Show {
        #[command(flatten)]
        source: Source,
        /// JSON in place of text.
        #[arg(long)]
        json: bool,
    },
}

/// Which arm: a URDF, or the built-in REDIESTRO.
#[derive(Debug, Clone, Args)]
struct Source {
    /// URDF with a chain of seven revolute joints; the built-in REDIESTRO if not given.
    #[arg(long, value_name = "FILE", requires = "tip")]
    urdf: Option<PathBuf>,
    /// Link whose frame is the tip; `tool` for the built-in arm.
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,
    /// Link that is the base; the root if not given.
    #[arg(long, value_name = "LINK")]
    base: Option<String>,
}

/// Something wrong with what the user gave: exit code 2.
#[derive(Debug, thiserror::Error)]
enum BadInput {
    #[error("cannot read {file}: {error}")]
    Unreadable { file: String, error: String },
    #[error("{file}: {error}")]
    Urdf { file: String, error: arm::UrdfError },
    #[error("{file}: line {line}: {what}")]
    State {
        file: String,
        line: u64,
        what: String,
    },
}

/// What keeps a command from its answer.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(transparent)]
    Input(#[from] BadInput),
    #[error("cannot write the answer: {0}")]
    Output(std::io::Error),
}

/// Runs `vmerack arm`; the value is the exit code.
pub fn run(args: ArmArgs) -> miette::Result<u8> {
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    let done = match &args.command {
        ArmCommand::Eval {
            source,
            states,
            json,
        } => model(source)
            .map_err(Failure::from)
            .and_then(|model| eval::run(&model, states, *json, &mut out)),
        ArmCommand::Show { source, json } => model(source)
            .map_err(Failure::from)
            .and_then(|model| show::run(&model, source.urdf.is_none(), *json, &mut out)),
    };
    let flushed = std::io::Write::flush(&mut out);
    match done.and(flushed.map_err(Failure::Output)) {
        Ok(()) => Ok(0),
        Err(Failure::Input(error)) => {
            eprintln!("error: {error}");
            Ok(2)
        }
        // whoever reads has read enough
        Err(Failure::Output(error)) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(0),
        Err(error) => Err(miette::miette!("{error}")),
    }
}

fn model(source: &Source) -> Result<ArmModel, BadInput> {
    let (file, text) = match &source.urdf {
        Some(path) => {
            let file = path.display().to_string();
            match scenario::read_text(path, scenario::URDF_LIMIT) {
                Ok(text) => (file, text),
                Err(error) => return Err(BadInput::Unreadable { file, error }),
            }
        }
        None => (
            "built-in REDIESTRO".to_owned(),
            ArmModel::rediestro_urdf().to_owned(),
        ),
    };
    let tip = source.tip.as_deref().unwrap_or("tool");
    ArmModel::from_urdf(&text, source.base.as_deref(), tip)
        .map_err(|error| BadInput::Urdf { file, error })
}
