//! Scenarios that ship inside the command.

/// Name, text of every built-in scenario, in the order in which they are listed.
pub const SCENARIOS: &[(&str, &str)] = &[
    ("table-5-3", include_str!("../../scenarios/table-5-3.toml")),
    ("figure-6-3", include_str!("../../scenarios/figure-6-3.toml")),
    ("figure-6-5", include_str!("../../scenarios/figure-6-5.toml")),
    ("figure-6-6", include_str!("../../scenarios/figure-6-6.toml")),
    ("after-6-6", include_str!("../../scenarios/after-6-6.toml")),
    ("surface-cleaning", include_str!("../../scenarios/surface-cleaning.toml")),
    ("peg-in-hole", include_str!("../../scenarios/peg-in-hole.toml")),
    ("self-motion", include_str!("../../scenarios/self-motion.toml")),
    ("joint-limits", include_str!("../../scenarios/joint-limits.toml")),
    ("friction-compensation", include_str!("../../scenarios/friction-compensation.toml")),
    ("one-axis-ideal", include_str!("../../scenarios/one-axis-ideal.toml")),
    ("one-axis-delay", include_str!("../../scenarios/one-axis-delay.toml")),
    ("one-axis-force-delay", include_str!("../../scenarios/one-axis-force-delay.toml")),
    ("sampled-wall", include_str!("../../scenarios/sampled-wall.toml")),
    ("failures", include_str!("../../scenarios/failures.toml")),
    ("campaign", include_str!("../../scenarios/campaign.toml")),
    ("bus-stress", include_str!("../../scenarios/bus-stress.toml")),
    ("processor-time", include_str!("../../scenarios/processor-time.toml")),
];

const FIGURE_6_1: &str = include_str!("../../scenarios/figure-6-1.toml");

/// The text of a built-in scenario.
pub fn text(name: &str) -> Option<&'static str> {
    SCENARIOS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// The rack of Figure 6.1 as text has it.
pub(crate) fn figure_6_1_table() -> toml::Table {
    FIGURE_6_1.parse().unwrap_or_else(|error| panic!("figure-6-1.toml: {error}"))
}

/// The rack of Figure 6.1, used where a scenario describes none.
pub fn figure_6_1() -> vme::rack::Rack {
    // the text is part of the program and a test reads it
    toml::from_str(FIGURE_6_1).unwrap_or_else(|error| panic!("figure-6-1.toml: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rack_of_figure_6_1_has_its_cards() {
        let rack = figure_6_1();
        let cards = |board: &str| rack.slaves.iter().filter(|slave| slave.board == board).count();
        assert_eq!((cards("encoder_if"), cards("da_io"), cards("force_sensor_if")), (4, 3, 1));
    }

    #[test]
    fn what_a_scenario_does_not_state_of_its_rack_is_as_in_figure_6_1() {
        let settings = ["rack.tasks.control.period_ns=2000000".to_owned(), "rack.bus.arbiter=RRS".to_owned()];
        let scenario = crate::load("table-5-3", &settings).and_then(|document| document.scenario()).expect("loads");
        let mut expected = figure_6_1();
        expected.tasks[0].period_ns = 2_000_000;
        expected.bus.arbiter = vme::arbiter::Mode::Rrs;
        assert_eq!(scenario.rack, expected);
    }

    #[test]
    fn a_kind_of_processor_gives_the_times_that_are_not_stated() {
        let times = |settings: &[&str]| {
            let settings: Vec<String> = settings.iter().map(|setting| (*setting).to_owned()).collect();
            let scenario = crate::load("table-5-3", &settings).and_then(|document| document.scenario()).expect("loads");
            (scenario.controller.execution_us, scenario.controller.entry_us)
        };
        assert_eq!(times(&[]), (1500.0, 130.0));
        assert_eq!(times(&["controller.processor=68030-generic"]), (7350.0, 130.0));
        assert_eq!(times(&["controller.processor=modern", "controller.execution_us=40.0"]), (40.0, 6.0));
    }

    #[test]
    fn what_the_command_line_sets_or_varies_holds_in_variants_that_set_it_too() {
        let delays = |document: &crate::Document| -> Vec<f64> {
            let variants = document.variants().expect("resolves");
            variants.iter().map(|(_, scenario)| scenario.encoder_if.delay_ms).collect()
        };
        let stated = crate::load("one-axis-delay", &[]).expect("loads");
        assert!(delays(&stated).iter().any(|delay| *delay != 50.0));
        let set = crate::load("one-axis-delay", &["encoder_if.delay_ms=50".into()]).expect("loads");
        assert!(delays(&set).iter().all(|delay| *delay == 50.0));
        let varied = set.with("encoder_if.delay_ms", toml::Value::Float(55.5)).expect("varies");
        assert!(delays(&varied).iter().all(|delay| *delay == 55.5));
    }

    #[test]
    fn every_built_in_scenario_loads_without_a_warning() {
        for (name, _) in SCENARIOS {
            let document = crate::load(name, &[]).unwrap_or_else(|error| panic!("{name}: {error:?}"));
            for (variant, scenario) in document.variants().unwrap_or_else(|error| panic!("{name}: {error:?}")) {
                assert_eq!(crate::warnings(&scenario), Vec::<String>::new(), "{name}, variant {}", variant.name);
            }
        }
    }
}
