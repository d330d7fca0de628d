//! The JSON of `vmerack design`. Units are in the keys; margins of an unstable loop are negative, a gain
//! margin below 1. A maximum that does not apply is null.

use serde_json::{Value, json};
use stability::cascade::Filter;
use stability::margins::Margins;
use stability::{Bound, Judgement, Verdict};

use super::request::{Axis, DelaySource, Kind, Request};

/// The whole answer.
pub fn of(request: &Request) -> Value {
    let filter = match request.source {
        DelaySource::Jr3(filter) => Some(filter),
        _ => None,
    };
    let hold = request.effective_delay - request.delay;
    let axis = |axis: &Option<Axis>| axis.as_ref().map(|axis| axis_json(axis, filter, hold));
    let governing = &request.governing;
    // Without an axis there is no mass, so no stiffness either: ω_n and ζ are all there is.
    let has_axis = request.force.is_some() || request.impedance.is_some();
    json!({
        "delay_s": request.delay,
        "delay_source": match request.source {
            DelaySource::Given => "delay",
            DelaySource::Jr3(_) => "jr3_filter",
            DelaySource::OneOverCutoff(_) => "one_over_cutoff",
            DelaySource::Figure => "figure_6_2",
        },
        "filter": match request.source {
            DelaySource::Jr3(filter) => json!({
                "number": filter.stages(),
                "cutoff_hz": filter.cutoff(),
                "publication_hold_s": filter.publication_period() / 2.0,
            }),
            DelaySource::OneOverCutoff(cutoff) => json!({ "cutoff_hz": cutoff }),
            _ => Value::Null,
        },
        "period_s": request.period,
        "effective_delay_s": request.effective_delay,
        "ts_s": request.effective_delay / 2.0,
        "omega_n_rad_per_s": governing.impedance.natural_frequency(),
        "zeta": governing.impedance.damping_ratio(),
        "response_time_s": governing.impedance.response_time(),
        "rise_time_90_s": governing.impedance.rise_time(),
        "bounds": bounds(governing, has_axis),
        "margins": margins(governing),
        "safe_bound": Bound::Exact.key(),
        "verdict": verdict(governing),
        "impedance_axis": axis(&request.impedance),
        "steady_error_m": request.disturbance.zip(request.impedance.as_ref())
            .map(|(force, axis)| axis.judgement.impedance.steady_error(force).abs()),
        "force_axis": axis(&request.force),
        "rescaled": axis(&request.rescaled),
        "assumptions": request.assumptions,
    })
}

fn axis_json(axis: &Axis, filter: Option<Filter>, hold: f64) -> Value {
    let judgement = &axis.judgement;
    let impedance = &judgement.impedance;
    let at_low = axis.softest.map(|stiffness| stability::Impedance {
        stiffness,
        ..*impedance
    });
    json!({
        "kind": match axis.kind { Kind::Impedance => "impedance", Kind::Force => "force" },
        "mass_kg": impedance.mass,
        "damping_ns_per_m": impedance.damping,
        "stiffness_n_per_m": impedance.stiffness,
        "stiffness_low_n_per_m": axis.softest,
        "omega_n_rad_per_s": impedance.natural_frequency(),
        "zeta": impedance.damping_ratio(),
        "response_time_s": impedance.response_time(),
        "rise_time_90_s": impedance.rise_time(),
        "rise_time_90_at_low_s": at_low.map(|soft| soft.rise_time()),
        "bounds": bounds(judgement, true),
        "behind_filter": filter.map(|filter| {
            let max = filter.contact_stiffness_max(impedance.mass, impedance.damping, hold);
            json!({
                "contact_stiffness_max_n_per_m": max,
                "stable": impedance.stiffness < max,
            })
        }),
        "margins": margins(judgement),
        "verdict": verdict(judgement),
    })
}

fn bounds(judgement: &Judgement, has_mass: bool) -> Value {
    judgement
        .bounds
        .iter()
        .map(|judged| {
            let value = json!({
                "omega_n_max_rad_per_s": judged.omega_n_max,
                "contact_stiffness_max_n_per_m": has_mass.then_some(judged.stiffness_max),
                "stable": judged.stable,
            });
            (judged.bound.key().to_owned(), value)
        })
        .collect::<serde_json::Map<_, _>>()
        .into()
}

fn margins(judgement: &Judgement) -> Value {
    let of = |margins: &Margins| {
        json!({
            "gain": margins.gain,
            "gain_db": (margins.gain > 0.0).then(|| 20.0 * margins.gain.log10()),
            "phase_deg": margins.phase.to_degrees(),
            "delay_s": margins.delay,
            "crossover_rad_per_s": margins.crossover,
        })
    };
    json!({
        "both_terms_delayed": of(&judgement.both_terms_delayed),
        "force_delayed": of(&judgement.force_delayed),
    })
}

fn verdict(judgement: &Judgement) -> &'static str {
    match judgement.verdict {
        Verdict::Safe => "safe",
        Verdict::SafeIfOnlyForceIsDelayed => "safe_if_only_force_is_delayed",
        Verdict::Unstable => "unstable",
    }
}
