//! `vmerack run`: runs every variant of a scenario.

use crate::rack_run::{self, Setting};
use board::Mail;
use clap::Args;
use pacing::{Flow, Observer};
use vme::{Ns, Transfer};

/// Run every variant of a scenario.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// A built-in scenario or a file.
    scenario: String,
    #[arg(long)]
    in_process: bool,
    #[arg(long)]
    variant: Vec<String>,
    /// Override a key of the scenario; may be repeated.
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
}

struct Print {
    next: Ns,
}

impl Observer for Print {
    fn window(&mut self, until: Ns, mail: &Mail, transfers: &[Transfer]) -> Flow {
        for e in &mail.events {
            eprintln!("{:?} {:?}", messages::EventKind::from_number(e.kind), e);
        }
        if let (Some(p), Some(c)) = (mail.plant_probe.last(), mail.control_probe.last()) {
            if until >= self.next {
                self.next += 250 * vme::MILLISECOND;
                eprintln!("{:.3} fz {:.3} fe {:.3} z {:.5} xt {:.5} x {:.5} tau {:?} lim {} tr {} st {:x} e_age {}", until as f64 * 1e-9, p.contact[2], c.fe[2], p.position[2], c.xt[2], c.x[2], c.torque.map(|t| t.round()), c.limits, transfers.len(), p.status, c.encoder_age);
            }
        }
        Flow::Continue
    }
}

/// Runs the command and returns its exit code.
pub fn run(args: RunArgs) -> miette::Result<u8> {
    let document = scenario::load(&args.scenario, &args.set)?;
    for (variant, scenario) in document.variants()? {
        if !args.variant.is_empty() && !args.variant.contains(&variant.name) {
            continue;
        }
        let setting = Setting { variant: variant.name.clone(), in_process: args.in_process, record: None };
        match rack_run::run(&scenario, &setting, &mut Print { next: 0 }) {
            Ok(f) => eprintln!("{} {f:?} x{:.1}", variant.name, f.reached as f64 / f.windows.as_nanos() as f64),
            Err(e) => {
                eprintln!("{e}");
                return Ok(1);
            }
        }
    }
    Ok(0)
}
