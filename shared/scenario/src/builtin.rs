//! Scenarios that ship inside the command.

/// Name, text of every built-in scenario, in the order in which they are listed.
pub const SCENARIOS: &[(&str, &str)] = &[
    ("table-5-3", include_str!("../../scenarios/table-5-3.toml")),
    ("figure-6-3", include_str!("../../scenarios/figure-6-3.toml")),
    ("figure-6-5", include_str!("../../scenarios/figure-6-5.toml")),
    ("figure-6-6", include_str!("../../scenarios/figure-6-6.toml")),
    ("after-6-6", include_str!("../../scenarios/after-6-6.toml")),
    ("surface-cleaning", include_str!("../../scenarios/surface-cleaning.toml")),
    ("self-motion", include_str!("../../scenarios/self-motion.toml")),
    ("joint-limits", include_str!("../../scenarios/joint-limits.toml")),
    ("friction-compensation", include_str!("../../scenarios/friction-compensation.toml")),
];

/// The text of a built-in scenario.
pub fn text(name: &str) -> Option<&'static str> {
    SCENARIOS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// The rack of Figure 6.1, used where a scenario describes none.
pub fn figure_6_1() -> vme::rack::Rack {
    // the text is part of the program and a test reads it
    toml::from_str(include_str!("../../scenarios/figure-6-1.toml")).unwrap_or_else(|error| panic!("figure-6-1.toml: {error}"))
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
    fn every_built_in_scenario_loads_without_a_warning() {
        for (name, _) in SCENARIOS {
            let document = crate::load(name, &[]).unwrap_or_else(|error| panic!("{name}: {error:?}"));
            for (variant, scenario) in document.variants().unwrap_or_else(|error| panic!("{name}: {error:?}")) {
                assert_eq!(crate::warnings(&scenario), Vec::<String>::new(), "{name}, variant {}", variant.name);
            }
        }
    }
}
