//! `vmerack design` from the command line's words to its answer.

use std::f64::consts::FRAC_1_SQRT_2;

use clap::Parser;
use serde_json::Value;

use super::*;

#[derive(Debug, Parser)]
struct Cli {
    #[command(flatten)]
    design: DesignArgs,
}

fn parse(line: &str) -> Result<DesignArgs, clap::Error> {
    let words = std::iter::once("design").chain(line.split_whitespace());
    Cli::try_parse_from(words).map(|cli| cli.design)
}

fn request(line: &str) -> request::Request {
    request::resolve(&parse(line).unwrap()).unwrap()
}

fn json(line: &str) -> Value {
    json::of(&request(line))
}

fn number(value: &Value, pointer: &str) -> f64 {
    value
        .pointer(pointer)
        .and_then(Value::as_f64)
        .unwrap_or_else(|| panic!("no number at {pointer} in {value:#}"))
}

fn assert_near(value: &Value, pointer: &str, expected: f64, relative: f64) {
    let actual = number(value, pointer);
    assert!(
        (actual / expected - 1.0).abs() <= relative,
        "{pointer}: {actual}, expected {expected}"
    );
}

const KEYS: [&str; 4] = ["published", "pade", "exact", "force_delay_only"];

fn stable(value: &Value) -> [bool; 4] {
    KEYS.map(|key| value["bounds"][key]["stable"].as_bool().unwrap())
}

#[test]
fn the_books_first_force_axis_comes_out_of_its_delay_stiffness_and_response_time() {
    let answer = json("--delay 0.128 --contact-stiffness 10000 --zeta 1 --rise-time 2.5132741");
    assert_near(&answer, "/force_axis/mass_kg", 1600.0, 1e-6);
    assert_near(&answer, "/force_axis/damping_ns_per_m", 8000.0, 1e-6);
    assert_near(&answer, "/omega_n_rad_per_s", 2.5, 1e-6);
    let max = "/bounds/force_delay_only/contact_stiffness_max_n_per_m";
    assert_near(&answer, max, 68.3e3, 1e-3);
    assert_eq!(stable(&answer), [true; 4]);
    assert_eq!(answer["verdict"], "safe");
}

#[test]
fn without_a_response_time_the_text_s_2_5_rad_per_s_is_nearly_met() {
    let answer = json("--delay 0.128 --contact-stiffness 10000");
    assert_near(&answer, "/omega_n_rad_per_s", 2.5, 0.02);
    assert_eq!(answer["verdict"], "safe");
}

#[test]
fn the_bounds_over_zeta_are_those_of_the_table() {
    for (zeta, row) in [
        (0.5, [1.0, 0.3820, 0.3556]),
        (FRAC_1_SQRT_2, [FRAC_1_SQRT_2, 0.4142, 0.3680]),
        (1.0, [0.5, 0.3820, 0.3237]),
        (1.4, [0.3571, 0.3123, 0.2560]),
    ] {
        let answer = json(&format!("--delay 0.01 --zeta {zeta}"));
        for (key, a) in KEYS.iter().zip(row) {
            let pointer = format!("/bounds/{key}/omega_n_max_rad_per_s");
            assert_near(&answer, &pointer, a / 0.005, 2e-4);
        }
    }
}

#[test]
fn the_largest_contact_stiffness_of_a_given_choice_is_that_of_the_table() {
    for (choice, rows) in [
        (
            "--mass 1600 --damping 8000",
            [(0.128, 68.3e3), (0.002, 4.0e6)],
        ),
        (
            "--mass 400 --damping 4000",
            [(0.128, 36.4e3), (0.008, 507e3)],
        ),
        (
            "--mass 5.7 --damping 477",
            [(0.128, 5.4e3), (0.032, 18.9e3)],
        ),
        (
            "--mass 100 --damping 1000",
            [(0.128, 9.1e3), (0.032, 32.8e3)],
        ),
    ] {
        for (delay, stiffness) in rows {
            for spring in ["", "--stiffness 1000", "--contact-stiffness 1000"] {
                let answer = json(&format!("--delay {delay} {choice} {spring}"));
                let max = "/bounds/force_delay_only/contact_stiffness_max_n_per_m";
                assert_near(&answer, max, stiffness, 0.006);
            }
        }
    }
}

#[test]
fn table_5_3_is_unstable_behind_the_delay_of_the_force_filter() {
    let answer = json("--delay 0.128 --mass 100 --damping 1000 --contact-stiffness 10000");
    assert_eq!(answer["bounds"]["force_delay_only"]["stable"], false);
    assert_eq!(answer["verdict"], "unstable");
}

#[test]
fn a_choice_inside_the_published_region_only_is_called_so() {
    // ζ = 1, a = 0.45.
    let line = "--delay 0.01 --mass 1 --damping 180 --stiffness 8100";
    let answer = json(line);
    assert_eq!(stable(&answer), [true, false, false, true]);
    assert_eq!(answer["verdict"], "safe_if_only_force_is_delayed");
    assert!(table::of(&request(line)).contains("would let this choice pass"));
}

#[test]
fn the_filter_s_delay_is_its_cascade_s_and_its_response_is_judged_too() {
    for cutoff in ["7.8125", "7.81"] {
        let answer = json(&format!(
            "--filter-hz {cutoff} --mass 5.7 --damping 477 --contact-stiffness 1800"
        ));
        assert_near(&answer, "/delay_s", 0.1275, 1e-12);
        let behind = "/force_axis/behind_filter/contact_stiffness_max_n_per_m";
        assert_near(&answer, behind, 5582.0, 1e-3);
        assert_eq!(answer["force_axis"]["behind_filter"]["stable"], true);
    }
    let other = json("--filter-hz 10");
    assert_eq!(other["delay_source"], "one_over_cutoff");
    assert_near(&other, "/delay_s", 0.1, 1e-12);
}

#[test]
fn the_period_adds_half_of_itself_to_the_delay() {
    let answer = json("--delay 0.128 --period 0.005");
    assert_near(&answer, "/effective_delay_s", 0.1305, 1e-12);
    assert_near(&answer, "/delay_s", 0.128, 1e-12);
    let longer = json("--delay 0.1305");
    assert_eq!(answer["bounds"], longer["bounds"]);
}

#[test]
fn the_impedance_axis_takes_its_stiffness_from_the_steady_error() {
    let answer = json("--delay 0.01 --steady-error 0.02 --disturbance 22 --rise-time 2 --zeta 1");
    assert_near(&answer, "/impedance_axis/stiffness_n_per_m", 1100.0, 1e-12);
    assert_near(&answer, "/impedance_axis/mass_kg", 111.46, 1e-4);
    assert_near(&answer, "/impedance_axis/damping_ns_per_m", 700.28, 1e-4);
    assert_near(&answer, "/steady_error_m", 0.02, 1e-12);
    assert!(answer["force_axis"].is_null());
}

#[test]
fn a_given_choice_is_rescaled_to_half_its_response_time() {
    let answer = json(
        "--delay 0.128 --mass 1600 --damping 8000 --contact-stiffness 10000 --rise-time 1.25663706",
    );
    assert_near(&answer, "/rescaled/mass_kg", 400.0, 1e-6);
    assert_near(&answer, "/rescaled/damping_ns_per_m", 4000.0, 1e-6);
    assert_near(&answer, "/rescaled/zeta", 1.0, 1e-9);
    assert_near(&answer, "/force_axis/mass_kg", 1600.0, 1e-12);
}

#[test]
fn a_choice_just_below_the_exact_bound_is_not_called_safe_in_words() {
    // The second set of the book at 10 kN/m: ω_n 5 rad/s of 5.06, a phase margin of 0.9°.
    let line = "--delay 0.128 --mass 400 --damping 4000 --contact-stiffness 10000";
    let text = table::of(&request(line));
    assert!(
        text.contains("stable by the exact bound, but with little margin"),
        "{text}"
    );
    assert!(!text.contains("SAFE:"), "{text}");
}

#[test]
fn a_range_of_contact_stiffness_is_judged_at_its_stiff_end_and_timed_at_its_soft_one() {
    let line = "--delay 0.128 --mass 1600 --damping 8000 --contact-stiffness 1800..10000";
    let answer = json(line);
    assert_near(&answer, "/force_axis/stiffness_n_per_m", 10_000.0, 1e-12);
    // Figure 6.5's ten seconds.
    assert_near(&answer, "/force_axis/rise_time_90_at_low_s", 10.0, 0.03);
    assert!(table::of(&request(line)).contains("at 1800 N/m"));
}

#[test]
fn of_two_given_axes_the_one_nearer_its_limit_governs() {
    let given = "--delay 0.128 --mass 100 --damping 1000";
    let both = json(&format!(
        "{given} --stiffness 100 --contact-stiffness 10000"
    ));
    let stiff = json(&format!("{given} --contact-stiffness 10000"));
    assert_eq!(both["bounds"], stiff["bounds"]);
    assert_near(&both, "/impedance_axis/stiffness_n_per_m", 100.0, 1e-12);
    assert_near(&both, "/force_axis/stiffness_n_per_m", 10_000.0, 1e-12);
}

#[test]
fn margins_are_those_of_the_exact_bound() {
    let answer = json("--delay 0.128 --contact-stiffness 10000 --rise-time 2.5132741 --zeta 1");
    // The delay that the exact bound still leaves: 2·0.3237/2.5 − 0.128.
    let left = 2.0 * 0.3237 / 2.5 - 0.128;
    assert_near(&answer, "/margins/both_terms_delayed/delay_s", left, 1e-3);
    assert_near(&answer, "/margins/force_delayed/gain", 6.83, 1e-3);
}

#[test]
fn every_number_in_the_answer_is_finite_over_extreme_arguments() {
    for delay in ["1e-9", "1e12"] {
        for mass in ["1e-9", "1e12"] {
            for damping in ["1e-9", "1e12"] {
                for stiffness in ["1e-9", "1e12"] {
                    let line = format!(
                        "--delay {delay} --mass {mass} --damping {damping} --contact-stiffness {stiffness}"
                    );
                    let text = json(&line).to_string();
                    // serde_json writes what is not finite as null.
                    for key in ["omega_n_rad_per_s", "zeta", "rise_time_90_s", "phase_deg"] {
                        assert!(!text.contains(&format!("\"{key}\":null")), "{line}: {text}");
                    }
                    assert!(!table::of(&request(&line)).contains("NaN"), "{line}");
                }
            }
        }
    }
}

#[test]
fn bad_arguments_are_refused_with_the_flag_s_name() {
    for (line, named) in [
        ("--delay -0.1", "--delay"),
        ("--delay NaN", "--delay"),
        ("--delay inf", "--delay"),
        ("--delay 0", "--delay"),
        ("--delay soon", "--delay"),
        ("--delay 0.1 --filter-hz 7.81", "--filter-hz"),
        ("--delay 0.1 --zeta -1", "--zeta"),
        ("--delay 0.1 --period 1e400", "--period"),
        ("--delay 0.1 --steady-error 0.02", "--disturbance"),
        ("--delay 0.1 --disturbance 20", "--steady-error"),
        ("--delay 0.1 --mass 5", "--damping"),
        ("--delay 0.1 --damping 5", "--mass"),
        (
            "--delay 0.1 --contact-stiffness 9..1",
            "--contact-stiffness",
        ),
        ("--delay 0.1 --contact-stiffness 1..", "--contact-stiffness"),
        (
            "--delay 0.1 --stiffness 9 --steady-error 1 --disturbance 1",
            "--stiffness",
        ),
    ] {
        let error = parse(line).unwrap_err();
        assert_eq!(error.exit_code(), 2, "{line}");
        assert!(error.to_string().contains(named), "{line}: {error}");
    }
}

#[test]
fn arguments_that_miss_or_contradict_each_other_exit_with_2() {
    for (line, named) in [
        ("--json", "--delay or --filter-hz"),
        (
            "--delay 0.1 --mass 1600 --damping 8000 --stiffness 10000 --zeta 0.7",
            "--zeta",
        ),
        (
            "--delay 0.1 --mass 5 --damping 5 --rise-time 2",
            "--rise-time",
        ),
    ] {
        let args = parse(line).unwrap();
        let error = request::resolve(&args).unwrap_err().to_string();
        assert!(error.starts_with(named), "{error}");
        assert_eq!(run(args).unwrap(), 2, "{line}");
    }
    // A ζ that says what the others say already is no contradiction.
    request("--delay 0.1 --mass 1600 --damping 8000 --stiffness 10000 --zeta 1");
}

#[test]
fn the_table_shows_every_bound_with_its_verdict_and_says_which_to_trust() {
    let text = table::of(&request(
        "--filter-hz 7.81 --period 0.005 --mass 5.7 --damping 477 --contact-stiffness 1800..10000",
    ));
    for part in [
        "delay         0.1275 s, JR3 filter 4 of 7.8125 Hz",
        "whole delay   0.13 s = 2T_s",
        "filter cascade",
        "UNSTABLE, even if only the force is delayed",
        "Design by `exact`",
    ] {
        assert!(text.contains(part), "{part:?} is missing in\n{text}");
    }
    for key in KEYS {
        assert!(text.contains(key), "{key} is missing in\n{text}");
    }
}

#[test]
fn the_plot_is_written_with_all_bounds_and_the_choice_and_needs_no_delay() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("figure-6-2.svg");
    let plot = format!("--plot {}", file.display());
    assert_eq!(run(parse(&plot).unwrap()).unwrap(), 0);
    let svg = std::fs::read_to_string(&file).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    for part in [
        "T_s = 0.005 s",
        "published",
        "full Routh",
        "exact",
        "force",
        "choice",
    ] {
        assert!(svg.contains(part), "{part:?} is missing");
    }
    assert!(svg.matches("<polyline").count() >= 4);

    let nowhere = folder.path().join("none/figure.svg");
    let error = run(parse(&format!("--delay 0.1 --plot {}", nowhere.display())).unwrap());
    let message = format!("{:?}", error.unwrap_err());
    assert!(message.contains("--plot"), "{message}");
}
