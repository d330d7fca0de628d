//! A bad scenario gets exit code 2 and an error that shows file, line, key and what was expected. The snapshots are what
//! the user sees.

use rack_tests::{Bench, workspace};

/// A small scenario that is sound.
const SOUND: &str = r#"title = "two segments"

[plant]
rate_hz = 10000.0

[[surface]]
name = "board"
position_m = [0.0, 0.0, 0.005]
stiffness_n_per_m = 10000.0

[[segment]]
name = "approach"
until_s = 1.0

[[segment]]
name = "press"
until_s = 2.0
force_n = [0.0, 0.0, 60.0]
"#;

/// What `vmerack run` says of this file; it must refuse it, and `scenario check` must say the same.
fn refusal(bench: &Bench, content: impl AsRef<[u8]>) -> String {
    bench.write("bad.toml", content);
    let outcome = bench.run(&["run", "bad.toml", "--out", "out"]).expect_code(2).expect_nothing_left();
    assert_eq!(outcome.stdout, "", "results of a run that cannot be");
    assert_eq!(bench.run(&["scenario", "check", "bad.toml"]).expect_code(2).stderr, outcome.stderr);
    outcome.stderr
}

/// What `vmerack run` says of the sound scenario with `from` replaced by `to`.
fn refusal_of(from: &str, to: &str) -> String {
    assert!(SOUND.contains(from), "{from}");
    refusal(&Bench::new(), SOUND.replacen(from, to, 1))
}

#[test]
fn the_sound_scenario_is_accepted_and_so_is_what_show_prints_of_it() {
    let bench = Bench::new();
    bench.write("sound.toml", SOUND);
    bench.run(&["scenario", "check", "sound.toml"]).expect_code(0);
    let shown = bench.run(&["scenario", "show", "sound.toml"]).expect_code(0).stdout;
    bench.write("shown.toml", &shown);
    bench.run(&["scenario", "check", "shown.toml"]).expect_code(0);
    assert_eq!(bench.run(&["scenario", "show", "shown.toml"]).expect_code(0).stdout, shown);
}

#[test]
fn check_and_show_take_the_keys_that_a_run_would_be_given() {
    let bench = Bench::new();
    bench.write("sound.toml", SOUND);
    let shown = bench.run(&["scenario", "show", "sound.toml", "--set", "segment.press.until_s=3.5"]).expect_code(0);
    assert!(shown.stdout.contains("until_s = 3.5"), "{}", shown.stdout);
    bench.run(&["scenario", "check", "sound.toml", "--set", "segment.press.until_s=3.5"]).expect_code(0);
    let bad = ["--set", "segment.press.until_s=0.5"];
    let refused = bench.run(&[&["run", "sound.toml", "--out", "out"], &bad[..]].concat()).expect_code(2);
    let checked = bench.run(&[&["scenario", "check", "sound.toml"], &bad[..]].concat()).expect_code(2);
    assert_eq!(checked.stderr, refused.stderr);
}

#[test]
fn an_unknown_key_is_refused() {
    insta::assert_snapshot!(refusal_of("rate_hz = 10000.0", "rate_herz = 10000.0"));
}

#[test]
fn a_wrong_type_is_refused() {
    insta::assert_snapshot!(refusal_of("until_s = 2.0", "until_s = \"two\""));
}

#[test]
fn a_value_that_is_no_number_is_refused() {
    insta::assert_snapshot!(refusal_of("60.0", "nan"));
}

#[test]
fn a_negative_mass_is_refused() {
    insta::assert_snapshot!(refusal_of("until_s = 1.0", "until_s = 1.0\nmass_kg = [257.0, 257.0, -1.0]"));
}

#[test]
fn a_surface_out_of_reach_is_refused() {
    insta::assert_snapshot!(refusal_of("0.005", "2.5"));
}

#[test]
fn an_unreachable_pose_is_refused() {
    insta::assert_snapshot!(refusal_of("name = \"press\"", "name = \"press\"\nposition_m = [3.0, 0.0, 0.0]"));
}

#[test]
fn overlapping_segments_are_refused() {
    insta::assert_snapshot!(refusal_of("until_s = 2.0", "until_s = 0.5"));
}

#[test]
fn a_board_in_two_places_is_refused() {
    let processes = "[[process]]\nname = \"a\"\nboards = [\"hw_sim\", \"da_io\", \"force_sensor_if\", \"encoder_if\"]\n\n\
                     [[process]]\nname = \"b\"\nboards = [\"control_computer\", \"workstation\", \"bus_analyzer\", \"hw_sim\"]\n";
    insta::assert_snapshot!(refusal(&Bench::new(), format!("{SOUND}\n{processes}")));
}

#[test]
fn a_board_in_no_place_is_refused() {
    let process = "[[process]]\nname = \"a\"\nboards = [\"hw_sim\", \"da_io\", \"force_sensor_if\", \"encoder_if\", \"workstation\", \"bus_analyzer\"]\n";
    insta::assert_snapshot!(refusal(&Bench::new(), format!("{SOUND}\n{process}")));
}

#[test]
fn a_file_that_is_no_toml_is_refused() {
    insta::assert_snapshot!(refusal_of("title = \"two segments\"", "Dear Sir or Madam,"));
}

#[test]
fn a_file_that_is_no_text_is_refused() {
    insta::assert_snapshot!(refusal(&Bench::new(), [0x7F, b'E', b'L', b'F', 0xFF, 0xFE, 0]));
}

#[test]
fn a_hundred_megabytes_of_noise_are_refused() {
    // any bytes will do that do not repeat
    let mut state = 1_u64;
    let noise: Vec<u8> = std::iter::repeat_with(|| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 56) as u8
    })
    .take(100 << 20)
    .collect();
    insta::assert_snapshot!(refusal(&Bench::new(), noise));
}

#[test]
fn a_missing_file_is_refused() {
    let outcome = Bench::new().run(&["run", "absent.toml"]).expect_code(2);
    insta::assert_snapshot!(outcome.stderr);
}

#[test]
fn a_bad_override_is_refused() {
    let outcome = Bench::new().run(&["run", "table-5-3", "--set", "plant.rate_hz=fast"]).expect_code(2);
    outcome.expect_message("plant.rate_hz: invalid type: string \"fast\", expected f64");
}

#[test]
fn times_of_the_rack_that_no_run_can_add_up_or_step_through_are_refused() {
    for (set, message) in [
        ("rack.tasks.control.period_ns=9000000000000000000", "is 9000000000000000000, expected 0 to 36000000000000"),
        ("rack.slaves.da-1.write_ns=9223372036854775807", "is 9223372036854775807, expected 0 to 36000000000000"),
        ("rack.interrupters.force-sample.ticks={ period_ns = 1 }", "is 1, expected 100 or more"),
    ] {
        let outcome = Bench::new().run(&["run", "bus-stress", "--out", "out", "--set", set]).expect_code(2);
        outcome.expect_message(message);
    }
}

#[test]
fn an_inertia_that_no_body_has_is_refused() {
    let bench = Bench::new();
    let urdf =
        std::fs::read_to_string(workspace().join("shared/arm/src/robots/rediestro.urdf")).expect("the built-in arm");
    // the last body's moment about x is negative
    let place = urdf.rfind("ixx=\"").expect("inertia") + "ixx=\"".len();
    let (before, after) = urdf.split_at(place);
    bench.write("arm.urdf", format!("{before}-{after}"));
    let arm = "[arm]\nrobot = \"urdf\"\nurdf = \"arm.urdf\"\ntip_link = \"tool\"\n\n[plant]";
    let refusal = refusal(&bench, SOUND.replacen("[plant]", arm, 1));
    // the bench's path differs from run to run
    insta::assert_snapshot!(refusal.replace(bench.path("").to_str().expect("path"), ""));
}

#[test]
fn a_bus_program_that_cannot_fit_its_period_is_refused_unless_the_task_states_what_an_overrun_does() {
    let bench = Bench::new();
    let generic = SOUND.replacen("[plant]", "[controller]\nprocessor = \"68030-generic\"\n\n[plant]", 1);
    insta::assert_snapshot!(refusal(&bench, &generic));
    bench.run(&["bus", "show", "bad.toml"]).expect_code(2).expect_message("program of task `control` needs");

    let stated = ["--set", "rack.tasks.control.overrun=skip", "--no-record", "--duration", "0.3", "--out", "out"];
    let outcome = bench.run(&[&["run", "bad.toml"], &stated[..]].concat());
    assert!([0, 4].contains(&outcome.status.code().unwrap_or(-1)), "{}", outcome.stderr);
    assert!(!outcome.stderr.contains("error"), "{}", outcome.stderr);
    bench.run(&["scenario", "check", "processor-time"]).expect_code(0);
}
