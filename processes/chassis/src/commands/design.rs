//! `vmerack design`: impedances for a delay, as §6.2.1 chooses them, and what each stability bound says of
//! them.
//!
//! Arguments are here, what they ask for in `request`, the answer's words in `table` and `json`, Figure 6.2
//! in `figure`; the theory is the crate `stability`. The exit code is 0 whatever the verdict, 2 for
//! arguments that make no sense together; a picture that cannot be written is an error.

mod figure;
mod json;
mod request;
mod table;

use std::path::PathBuf;

use clap::Args;
use miette::IntoDiagnostic;

use request::Range;

/// Choose impedances for a delay, or judge given ones (§6.2.1 of the book).
///
/// From the delay round the loop it gives m, b, k for an impedance axis (--steady-error and
/// --disturbance, or --stiffness) and m, b for a force axis (--contact-stiffness), with the damping
/// ratio --zeta and the response time --rise-time. With --mass and --damping it judges that choice
/// instead; --rise-time then also rescales it by (6.2.15) and (6.2.16).
///
/// Every choice is held against four bounds: `published` (6.2.9), necessary but not sufficient; `pade`,
/// the full Routh criterion on the same approximation, optimistic; `exact`, the true delay in
/// position and damping, safe in every case; `force_delay_only`, the loop of the modified AHIC.
#[derive(Debug, Clone, Args)]
pub struct DesignArgs {
    /// Delay round the whole loop, 2T_s in the text's model, in s.
    ///
    /// May be left out with --plot: then Figure 6.2's own T_s = 0.005 s.
    #[arg(long, value_name = "S", value_parser = quantity, allow_negative_numbers = true)]
    #[arg(conflicts_with = "filter_hz")]
    pub delay: Option<f64>,

    /// Cut-off of the force sensor's low-pass filter in Hz, in place of --delay.
    ///
    /// A filter of the JR3 receiver (500, 125, 31.25, 7.8125, 1.953, 0.488) gives the delay of its
    /// cascade; any other is taken to delay by 1/F (6.2.13).
    #[arg(long, value_name = "F", value_parser = quantity, allow_negative_numbers = true)]
    pub filter_hz: Option<f64>,

    /// Sampling period of the controller in s; its hold adds half of it to the delay.
    #[arg(long, value_name = "S", value_parser = quantity, allow_negative_numbers = true)]
    pub period: Option<f64>,

    /// Overall stiffness of the contact in N/m, for a force axis: one value, or LOW..HIGH.
    ///
    /// A range is designed and judged at its high end, as the text advises, and shows the response
    /// at its low end too.
    #[arg(long, value_name = "N_PER_M", value_parser = Range::parse, allow_negative_numbers = true)]
    pub contact_stiffness: Option<Range>,

    /// Wanted damping ratio; 1 if not given and not determined by the rest.
    #[arg(long, value_name = "Z", value_parser = quantity, allow_negative_numbers = true)]
    pub zeta: Option<f64>,

    /// Wanted response time T_n = 2π/ω_n in s.
    ///
    /// Without it ω_n is half of the exact bound, which is what the text's 2.5 rad/s is for 128 ms.
    #[arg(long, value_name = "S", value_parser = quantity, allow_negative_numbers = true)]
    pub rise_time: Option<f64>,

    /// Acceptable steady position error of an impedance axis in m, under --disturbance (6.2.10).
    #[arg(long, value_name = "M", value_parser = quantity, allow_negative_numbers = true)]
    #[arg(requires = "disturbance", conflicts_with = "stiffness")]
    pub steady_error: Option<f64>,

    /// Disturbing force on an impedance axis in N, friction for one.
    #[arg(long, value_name = "N", value_parser = quantity, allow_negative_numbers = true)]
    #[arg(requires = "steady_error")]
    pub disturbance: Option<f64>,

    /// Mass m in kg of a choice to judge.
    #[arg(long, value_name = "KG", value_parser = quantity, allow_negative_numbers = true)]
    #[arg(requires = "damping")]
    pub mass: Option<f64>,

    /// Damping b in Ns/m of a choice to judge.
    #[arg(long, value_name = "NS_PER_M", value_parser = quantity, allow_negative_numbers = true)]
    #[arg(requires = "mass")]
    pub damping: Option<f64>,

    /// Stiffness k in N/m of an impedance axis.
    #[arg(long, value_name = "N_PER_M", value_parser = quantity, allow_negative_numbers = true)]
    pub stiffness: Option<f64>,

    /// Draw Figure 6.2 with all bounds and the choice into this SVG file.
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,

    /// Print JSON and nothing else.
    #[arg(long)]
    pub json: bool,
}

/// Runs the command and returns its exit code.
pub fn run(args: DesignArgs) -> miette::Result<u8> {
    let request = match request::resolve(&args) {
        Ok(request) => request,
        Err(error) => {
            eprintln!("error: {error}");
            return Ok(2);
        }
    };
    if args.json {
        println!("{:#}", json::of(&request));
    } else {
        print!("{}", table::of(&request));
    }
    if let Some(file) = &args.plot {
        std::fs::write(file, figure::of(&request)?)
            .into_diagnostic()
            .map_err(|error| error.wrap_err(format!("--plot: cannot write {}", file.display())))?;
        if !args.json {
            println!("\nFigure 6.2 with all bounds: {}", file.display());
        }
    }
    Ok(0)
}

/// A physical quantity on the command line: positive, and of a size with which no formula here
/// overflows.
fn quantity(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (1e-9..=1e12).contains(&value) => Ok(value),
        _ => Err("expected a positive number from 1e-9 to 1e12".to_owned()),
    }
}

#[cfg(test)]
mod tests;
