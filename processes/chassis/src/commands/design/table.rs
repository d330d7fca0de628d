//! The answer of `vmerack design` for people: the delay, then each axis with every bound, its margins and
//! a plain verdict.

use std::fmt::{self, Display, Write};

use stability::cascade::Filter;
use stability::margins::Margins;
use stability::{Bound, Impedance, Judgement, Verdict};

use super::request::{Axis, DelaySource, Kind, Request};

/// Phase margin in rad, 30°, below which a stable loop is not called safe in words.
const LITTLE_PHASE: f64 = std::f64::consts::FRAC_PI_6;

/// The whole answer.
pub fn of(request: &Request) -> String {
    let mut text = String::new();
    // Writing into a String cannot fail.
    let _ = write(&mut text, request);
    text
}

fn write(out: &mut String, request: &Request) -> fmt::Result {
    write_delay(out, request)?;
    let filter = match request.source {
        DelaySource::Jr3(filter) => Some((filter, request.effective_delay - request.delay)),
        _ => None,
    };
    for (title, axis) in [
        ("", &request.force),
        ("", &request.impedance),
        ("Rescaled by (6.2.15), (6.2.16): ", &request.rescaled),
    ] {
        let Some(axis) = axis else { continue };
        let kind = match axis.kind {
            Kind::Impedance => "impedance axis",
            Kind::Force => "force axis",
        };
        writeln!(out, "\n{title}{kind}")?;
        write_axis(out, axis, filter)?;
        if let (Kind::Impedance, Some(force)) = (axis.kind, request.disturbance) {
            let error = axis.judgement.impedance.steady_error(force).abs();
            writeln!(
                out,
                "  steady error {} m under {} N",
                Short(error),
                Short(force)
            )?;
        }
    }
    if request.force.is_none() && request.impedance.is_none() {
        writeln!(out, "\nany axis (no stiffness or mass given)")?;
        write_response(out, &request.governing.impedance)?;
        write_judgement(out, &request.governing, None)?;
    }
    writeln!(
        out,
        "\nDesign by `exact`: no bound here is stricter, so what it allows is stable whichever signals are \
         late.\n`force_delay_only` may be used where, as in the modified AHIC, the damping term is not. \
         `pade` is\noptimistic, `published` necessary but not sufficient: neither is safe."
    )
}

fn write_delay(out: &mut String, request: &Request) -> fmt::Result {
    let delay = Short(request.delay);
    match request.source {
        DelaySource::Given => writeln!(out, "delay         {delay} s")?,
        DelaySource::Figure => writeln!(out, "delay         {delay} s, that of Figure 6.2")?,
        DelaySource::OneOverCutoff(cutoff) => writeln!(
            out,
            "delay         {delay} s, 1/f_c (6.2.13): {} Hz is no filter of the JR3 receiver",
            Short(cutoff)
        )?,
        DelaySource::Jr3(filter) => writeln!(
            out,
            "delay         {delay} s, JR3 filter {} of {} Hz; left out: its output is held, {} s on average",
            filter.stages(),
            filter.cutoff(),
            Short(filter.publication_period() / 2.0)
        )?,
    }
    if let Some(period) = request.period {
        writeln!(
            out,
            "sampling      {} s, of which the hold adds half",
            Short(period)
        )?;
    }
    writeln!(
        out,
        "whole delay   {} s = 2T_s",
        Short(request.effective_delay)
    )?;
    for assumption in &request.assumptions {
        writeln!(out, "assumed       {assumption}")?;
    }
    Ok(())
}

fn write_axis(out: &mut String, axis: &Axis, filter: Option<(Filter, f64)>) -> fmt::Result {
    let impedance = &axis.judgement.impedance;
    writeln!(
        out,
        "  m {} kg, b {} Ns/m, {} {} N/m",
        Short(impedance.mass),
        Short(impedance.damping),
        match axis.kind {
            Kind::Impedance => "k",
            Kind::Force => "against a contact of",
        },
        Short(impedance.stiffness)
    )?;
    write_response(out, impedance)?;
    if let Some(stiffness) = axis.softest {
        let soft = Impedance {
            stiffness,
            ..*impedance
        };
        writeln!(
            out,
            "  at {} N/m: ζ {}, 90 % rise {} s",
            Short(stiffness),
            Short(soft.damping_ratio()),
            Short(soft.rise_time())
        )?;
    }
    let behind_filter = filter.map(|(filter, hold)| {
        filter.contact_stiffness_max(impedance.mass, impedance.damping, hold)
    });
    write_judgement(out, &axis.judgement, Some(behind_filter))
}

fn write_response(out: &mut String, impedance: &Impedance) -> fmt::Result {
    writeln!(
        out,
        "  ω_n {} rad/s, ζ {}, T_n {} s, 90 % rise {} s",
        Short(impedance.natural_frequency()),
        Short(impedance.damping_ratio()),
        Short(impedance.response_time()),
        Short(impedance.rise_time())
    )
}

/// `behind_filter`: none without a mass, so that no stiffness is shown; in it, the largest stiffness behind
/// the filter's own response.
fn write_judgement(
    out: &mut String,
    judgement: &Judgement,
    behind_filter: Option<Option<f64>>,
) -> fmt::Result {
    let word = |stable: bool| if stable { "stable" } else { "UNSTABLE" };
    writeln!(
        out,
        "  {:<18}{:>14}{:>14}  {:<10}",
        "bound", "ω_n max rad/s", "k max N/m", "says"
    )?;
    for judged in &judgement.bounds {
        let stiffness = match behind_filter {
            Some(_) => Short(judged.stiffness_max).to_string(),
            None => "–".to_owned(),
        };
        writeln!(
            out,
            "  {:<18}{:>14}{:>14}  {:<10}{}",
            judged.bound.key(),
            Short(judged.omega_n_max).to_string(),
            stiffness,
            word(judged.stable),
            worth(judged.bound)
        )?;
    }
    if let Some(Some(stiffness)) = behind_filter {
        writeln!(
            out,
            "  {:<18}{:>14}{:>14}  {:<10}force behind the filter's own response",
            "filter cascade",
            "–",
            Short(stiffness).to_string(),
            word(judgement.impedance.stiffness < stiffness),
        )?;
    }
    write_margins(out, "both delayed", &judgement.both_terms_delayed)?;
    write_margins(out, "force delayed", &judgement.force_delayed)?;
    let verdict = match judgement.verdict {
        Verdict::Safe if judgement.both_terms_delayed.phase < LITTLE_PHASE => {
            "stable by the exact bound, but with little margin"
        }
        Verdict::Safe => "SAFE: stable by the exact bound",
        Verdict::SafeIfOnlyForceIsDelayed => {
            "stable only while the damping term is not delayed; not safe by the exact bound"
        }
        Verdict::Unstable => "UNSTABLE, even if only the force is delayed",
    };
    writeln!(out, "  verdict: {verdict}")?;
    let optimistic = |bound: Bound| {
        judgement.verdict != Verdict::Safe
            && judgement
                .bounds
                .iter()
                .any(|b| b.bound == bound && b.stable)
    };
    if optimistic(Bound::Published) {
        writeln!(
            out,
            "  the published bound (6.2.9) would let this choice pass"
        )?;
    }
    Ok(())
}

fn write_margins(out: &mut String, loop_name: &str, margins: &Margins) -> fmt::Result {
    writeln!(
        out,
        "  margins, {loop_name}: gain ×{}, phase {:.1}°, delay {} s",
        Short(margins.gain),
        margins.phase.to_degrees(),
        Short(margins.delay)
    )
}

fn worth(bound: Bound) -> &'static str {
    match bound {
        Bound::Published => "(6.2.9): necessary, not sufficient",
        Bound::Pade => "full Routh on the Padé form: optimistic",
        Bound::Exact => "true delay in both terms: safe in every case",
        Bound::ForceDelayOnly => "damping term not delayed, as in the modified AHIC",
    }
}

/// A number with four significant digits, large and small ones with a power of ten.
pub struct Short(pub f64);

impl Display for Short {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let magnitude = self.0.abs();
        if magnitude != 0.0 && !(1e-3..1e6).contains(&magnitude) {
            return write!(out, "{:.3e}", self.0);
        }
        let before_point = if magnitude < 1.0 {
            0
        } else {
            magnitude.log10() as i32 + 1
        };
        let leading_zeros = if magnitude == 0.0 {
            0
        } else {
            (-magnitude.log10()).floor().max(0.0) as i32
        };
        let decimals = (4 - before_point + leading_zeros).max(0) as usize;
        let text = format!("{:.*}", decimals, self.0);
        let text = match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.'),
            false => &text,
        };
        out.write_str(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_four_significant_digits_and_no_trailing_zeros() {
        for (number, text) in [
            (0.0, "0"),
            (0.1275, "0.1275"),
            (0.012_751, "0.01275"),
            (2.5, "2.5"),
            (-0.031_46, "-0.03146"),
            (1600.0, "1600"),
            (68_296.4, "68296"),
            (1e-4, "1.000e-4"),
            (4.0e6, "4.000e6"),
        ] {
            assert_eq!(Short(number).to_string(), text);
        }
    }
}
