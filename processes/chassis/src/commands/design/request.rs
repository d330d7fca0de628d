//! From the arguments of `vmerack design` to the axes they mean, each with its judgement. Fails where
//! arguments contradict each other, naming them.

use stability::cascade::Filter;
use stability::{
    Bound, Impedance, Judgement, effective_delay, judge, response_time, stiffness_for_error,
};
use thiserror::Error;

use super::{DesignArgs, quantity};

/// T_s of the printed Figure 6.2, in s.
const FIGURE_6_2_TS: f64 = 0.005;

/// Fraction of the exact bound that ω_n is given when no response time is wanted.
const OF_EXACT_BOUND: f64 = 0.5;

/// Relative disagreement up to which a --zeta that is not needed is let pass as rounding.
const ZETA_TOLERANCE: f64 = 0.01;

/// Arguments that are each right and together are not.
#[derive(Debug, Error, PartialEq)]
pub enum UsageError {
    /// Nothing to choose for.
    #[error(
        "--delay or --filter-hz is needed: the delay round the loop in s, or the cut-off in Hz of the filter \
         that causes it"
    )]
    NoDelay,
    /// m, b, k and ζ are one too many.
    #[error(
        "--zeta {zeta}: --mass, --damping and the stiffness {stiffness} N/m already make it {actual:.4}; \
         leave --zeta or the stiffness out"
    )]
    ZetaOverdetermined {
        zeta: f64,
        stiffness: f64,
        actual: f64,
    },
    /// (6.2.15) needs T_n of the given choice.
    #[error(
        "--rise-time {rise_time}: to rescale --mass and --damping their present response time must be \
         known; give --contact-stiffness, --stiffness or --zeta too"
    )]
    RescaleWithoutStiffness { rise_time: f64 },
}

/// One value or a range, as `--contact-stiffness` takes it, in N/m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lowest value.
    pub low: f64,
    /// Highest value; the same as `low` for a single one.
    pub high: f64,
}

impl Range {
    /// Reads `K` or `LOW..HIGH`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (low, high) = match text.split_once("..") {
            Some((low, high)) => (quantity(low)?, quantity(high)?),
            None => quantity(text).map(|value| (value, value))?,
        };
        if low > high {
            return Err(format!(
                "expected LOW..HIGH with LOW below HIGH, as {high}..{low}"
            ));
        }
        Ok(Self { low, high })
    }
}

/// Where the delay comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DelaySource {
    /// `--delay`.
    Given,
    /// `--filter-hz`, one of the JR3 receiver's.
    Jr3(Filter),
    /// `--filter-hz`, no filter of the receiver's: 1/f_c (6.2.13).
    OneOverCutoff(f64),
    /// Neither: Figure 6.2's.
    Figure,
}

/// What kind of axis a choice is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Position controlled: the stiffness is chosen.
    Impedance,
    /// Force controlled: the stiffness is the contact's.
    Force,
}

/// One axis, chosen or given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Its kind.
    pub kind: Kind,
    /// Its m, b, k under the delay, judged.
    pub judgement: Judgement,
    /// The lowest contact stiffness in N/m, where a range was given.
    pub softest: Option<f64>,
}

/// All that is asked for, computed.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Delay in s without the sampling.
    pub delay: f64,
    /// Where that comes from.
    pub source: DelaySource,
    /// Sampling period in s.
    pub period: Option<f64>,
    /// Delay in s with the hold's: the 2T_s that everything is judged with.
    pub effective_delay: f64,
    /// The axis nearest to its exact bound, with unit mass if no stiffness or mass was named at all.
    pub governing: Judgement,
    /// The impedance axis, if one was asked for.
    pub impedance: Option<Axis>,
    /// The force axis, if one was asked for.
    pub force: Option<Axis>,
    /// The given choice, made faster or slower by (6.2.15) and (6.2.16).
    pub rescaled: Option<Axis>,
    /// Disturbing force in N on the impedance axis.
    pub disturbance: Option<f64>,
    /// What was assumed, a sentence each.
    pub assumptions: Vec<String>,
}

/// Computes what the arguments ask for.
pub fn resolve(args: &DesignArgs) -> Result<Request, UsageError> {
    let (delay, source) = delay_of(args)?;
    let effective_delay = effective_delay(delay, args.period.unwrap_or(0.0));
    let own_stiffness = args.stiffness.or_else(|| {
        let (error, force) = (args.steady_error?, args.disturbance?);
        Some(stiffness_for_error(force, error))
    });
    let mut assumptions = Vec::new();
    let axis = |kind, impedance: Impedance, softest| Axis {
        kind,
        judgement: judge(&impedance, effective_delay),
        softest,
    };
    // A range of one value has no soft end to show.
    let soft_end = |range: Range| (range.low < range.high).then_some(range.low);

    let mut rescaled = None;
    let (impedance, force, fallback);
    if let (Some(mass), Some(damping)) = (args.mass, args.damping) {
        let given = |stiffness| Impedance {
            mass,
            damping,
            stiffness,
        };
        let contact = match (own_stiffness, args.contact_stiffness) {
            (None, None) => Some(assumed_contact(args, mass, damping, &mut assumptions)?),
            (_, contact) => contact,
        };
        impedance = own_stiffness.map(|k| axis(Kind::Impedance, given(k), None));
        force = contact.map(|range| axis(Kind::Force, given(range.high), soft_end(range)));
        for axis in [&impedance, &force].into_iter().flatten() {
            refuse_other_zeta(args.zeta, &axis.judgement.impedance)?;
        }
        fallback = given(1.0);
        rescaled = args.rise_time.and_then(|wanted| {
            let from = force.or(impedance)?;
            let present = from.judgement.impedance;
            let faster = present.rescaled(wanted / present.response_time());
            Some(axis(from.kind, faster, from.softest))
        });
    } else {
        let zeta = args.zeta.unwrap_or_else(|| {
            assumptions.push("no --zeta: damping ratio 1".to_owned());
            1.0
        });
        let omega_n = args.rise_time.map(response_time).unwrap_or_else(|| {
            assumptions.push("no --rise-time: ω_n is half of the exact bound".to_owned());
            OF_EXACT_BOUND * Bound::Exact.omega_n_max(zeta, effective_delay)
        });
        let made = |stiffness| Impedance::with_response(stiffness, omega_n, zeta);
        impedance = own_stiffness.map(|k| axis(Kind::Impedance, made(k), None));
        force = args
            .contact_stiffness
            .map(|range| axis(Kind::Force, made(range.high), soft_end(range)));
        fallback = made(omega_n * omega_n);
    }
    Ok(Request {
        delay,
        source,
        period: args.period,
        effective_delay,
        governing: governing(force, impedance).unwrap_or_else(|| judge(&fallback, effective_delay)),
        impedance,
        force,
        rescaled,
        disturbance: args.disturbance,
        assumptions,
    })
}

/// Delay in s and its source.
fn delay_of(args: &DesignArgs) -> Result<(f64, DelaySource), UsageError> {
    match (args.delay, args.filter_hz) {
        (Some(delay), _) => Ok((delay, DelaySource::Given)),
        (None, Some(cutoff)) => Ok(match Filter::with_cutoff(cutoff) {
            Some(filter) => (filter.delay(), DelaySource::Jr3(filter)),
            None => (1.0 / cutoff, DelaySource::OneOverCutoff(cutoff)),
        }),
        (None, None) if args.plot.is_some() => Ok((2.0 * FIGURE_6_2_TS, DelaySource::Figure)),
        (None, None) => Err(UsageError::NoDelay),
    }
}

/// The contact stiffness at which a mass and damping without any stiffness have the wanted damping ratio.
fn assumed_contact(
    args: &DesignArgs,
    mass: f64,
    damping: f64,
    assumptions: &mut Vec<String>,
) -> Result<Range, UsageError> {
    if let (None, Some(rise_time)) = (args.zeta, args.rise_time) {
        return Err(UsageError::RescaleWithoutStiffness { rise_time });
    }
    let zeta = args.zeta.unwrap_or(1.0);
    let stiffness = damping * damping / (4.0 * zeta * zeta * mass);
    assumptions.push(format!(
        "no stiffness given: judged on the contact stiffness that makes ζ = {zeta}"
    ));
    Ok(Range {
        low: stiffness,
        high: stiffness,
    })
}

fn refuse_other_zeta(wanted: Option<f64>, impedance: &Impedance) -> Result<(), UsageError> {
    match wanted {
        Some(zeta) if (zeta / impedance.damping_ratio() - 1.0).abs() > ZETA_TOLERANCE => {
            Err(UsageError::ZetaOverdetermined {
                zeta,
                stiffness: impedance.stiffness,
                actual: impedance.damping_ratio(),
            })
        }
        _ => Ok(()),
    }
}

/// The judgement of the axis nearer to its exact bound; the force axis if both are equally near.
fn governing(force: Option<Axis>, impedance: Option<Axis>) -> Option<Judgement> {
    let nearness = |judgement: &Judgement| {
        let impedance = &judgement.impedance;
        let bound =
            Bound::Exact.delay_max(impedance.natural_frequency(), impedance.damping_ratio());
        1.0 / bound
    };
    match (force.map(|a| a.judgement), impedance.map(|a| a.judgement)) {
        // By more than rounding: designed together both have the same ω_n and ζ.
        (Some(force), Some(own)) if nearness(&own) > nearness(&force) * (1.0 + 1e-9) => Some(own),
        (Some(force), _) => Some(force),
        (None, own) => own,
    }
}
