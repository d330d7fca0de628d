//! Rows of injected faults, from made-up events.

mod made_up;

use made_up::{ledger, table_5_3, trace};
use messages::{Detector, Event, EventKind, Severity};
use report::latency::Recorder;
use report::{Ended, VariantResult};

const MS: u64 = 1_000_000;

fn event(ms: u64, kind: EventKind, a: f64, b: f64, cause: Option<Detector>) -> Event {
    Event::new(ms * MS, kind, Severity::Warn, a, b).because(cause)
}

/// The result of a run of 13 s with these events and two faults stated.
fn result(events: &[Event]) -> VariantResult {
    let (variant, mut scenario) = table_5_3().swap_remove(0);
    let faults = "fault=[{ target='force_sensor', kind='dropout', start_s=5.0 }, \
                  { target='joint-2', kind='brake-slip', start_s=6.0 }]";
    scenario.faults = scenario::load("table-5-3", &[faults.into()]).unwrap().scenario().unwrap().faults;
    let mut trace = trace(&scenario, 0.0, 13.0);
    trace.events = events.to_vec();
    VariantResult::new(&scenario, &variant, &trace, &ledger(&scenario), Ended::Completed, 13.0).unwrap()
}

#[test]
fn a_fault_is_credited_to_the_first_detector_in_its_time_and_to_the_gravest_state_that_stood_in_it() {
    let result = result(&[
        event(5000, EventKind::FaultInjected, 0.0, 0.0, None),
        event(5001, EventKind::TorqueLimit, 1.0, 3.0, None),
        event(5018, EventKind::Detected, 3.0, 0.0, Some(Detector::ForceAge)),
        event(5018, EventKind::SafetyState, 0.0, 2.0, Some(Detector::ForceAge)),
        event(5100, EventKind::SafetyState, 2.0, 4.0, Some(Detector::ForceAge)),
        event(6000, EventKind::FaultInjected, 1.0, 0.0, None),
        event(6040, EventKind::Detected, 1.0, 0.0, Some(Detector::BrakeMotion)),
    ]);
    let [age, slip] = &result.faults[..] else { panic!("{:?}", result.faults) };
    assert_eq!((age.detected_by.as_deref(), age.reaction.as_str()), (Some("force-age"), "off (STO)"));
    assert!((age.detected_after_s.unwrap() - 0.018).abs() < 1e-9);
    assert!((age.stopping_after_s.unwrap() - 0.018).abs() < 1e-9);
    // the arm was off already
    assert_eq!((slip.detected_by.as_deref(), slip.reaction.as_str()), (Some("brake-motion"), "off (STO)"));
    assert_eq!(slip.stopping_after_s, None);
    assert!(age.peak_torque_share >= 0.0 && !result.findings.iter().any(|text| text.contains("was injected")));
}

#[test]
fn cards_that_say_what_they_are_need_no_detector_beside_it() {
    for (kind, name) in [(EventKind::WatchdogExpired, "output-watchdog"), (EventKind::AmplifierTrip, "amplifier-trip")]
    {
        let events = [event(5000, EventKind::FaultInjected, 0.0, 0.0, None), event(5020, kind, 0.0, 0.0, None)];
        assert_eq!(result(&events).faults[0].detected_by.as_deref(), Some(name));
    }
}

#[test]
fn a_time_out_that_is_known_ahead_does_not_hide_what_fires_before_it() {
    let result = result(&[
        event(5000, EventKind::FaultInjected, 0.0, 0.0, None),
        event(5020, EventKind::WatchdogExpired, 0.0, 0.0, None),
        event(5003, EventKind::Detected, 0.0, 0.0, Some(Detector::BusError)),
    ]);
    assert_eq!(result.faults[0].detected_by.as_deref(), Some("bus-error"));
    assert!((result.faults[0].detected_after_s.unwrap() - 0.003).abs() < 1e-9);
}

#[test]
fn a_detector_that_fires_before_anything_was_injected_is_a_finding() {
    let trip = |ms, detector| event(ms, EventKind::Detected, 0.0, 0.0, Some(detector));
    let result = result(&[
        trip(1250, Detector::EncoderJump),
        trip(1300, Detector::MessageAge),
        trip(1350, Detector::MessageAge),
        event(5000, EventKind::FaultInjected, 0.0, 0.0, None),
        trip(5001, Detector::Sequence),
    ]);
    let found: Vec<&str> = result.findings.iter().map(String::as_str).filter(|text| text.contains("injected")).collect();
    assert_eq!(
        found,
        [
            "encoder-jump fired at 1.250 s: nothing was injected",
            "message-age fired 2 times, first at 1.300 s: nothing was injected"
        ]
    );
    assert_eq!(result.faults[0].detected_by.as_deref(), Some("sequence"));
}

#[test]
fn in_real_time_a_detector_that_fires_uninjected_stands_beside_what_the_machine_did() {
    let (variant, scenario) = table_5_3().swap_remove(0);
    let mut steps = Recorder::counting_misses("wake-up da_io");
    [20_000, 9_370_000, 30_000].iter().for_each(|late| steps.record(0, *late));
    steps.miss();
    let steps = steps.finish();
    let findings = |events: &[Event]| {
        let mut trace = trace(&scenario, 0.0, 13.0);
        trace.events = events.to_vec();
        trace.measured = vec![steps.clone()];
        let result = VariantResult::new(&scenario, &variant, &trace, &ledger(&scenario), Ended::Completed, 13.0).unwrap();
        result.findings.into_iter().filter(|text| text.contains("this machine")).collect::<Vec<_>>()
    };
    let late = "this machine began 1 of 3 steps more than a stage late, da_io by 9.4 ms: what is late then is late in the rack";
    assert_eq!(findings(&[event(1250, EventKind::Detected, 0.0, 0.0, Some(Detector::MessageAge))]), [late]);
    assert!(findings(&[]).is_empty());
}

#[test]
fn a_card_that_does_not_answer_is_found_by_its_address_and_a_bus_that_is_not_granted_blames_no_card() {
    let (_, scenario) = table_5_3().swap_remove(0);
    let address = f64::from(scenario.card_base("encoder-2").expect("card") + 4);
    let result = result(&[
        event(5000, EventKind::FaultInjected, 0.0, 0.0, None),
        event(5003, EventKind::Detected, address, 0.0, Some(Detector::BusError)),
        event(5003, EventKind::BusError, 17.0, address, Some(Detector::BusError)),
        event(5008, EventKind::BusError, 18.0, address, Some(Detector::BusError)),
        event(6000, EventKind::FaultInjected, 1.0, 0.0, None),
        event(6004, EventKind::Detected, address, 0.0, Some(Detector::AccessTimer)),
        event(6004, EventKind::BusError, 19.0, address, Some(Detector::AccessTimer)),
    ]);
    let cards: Vec<_> = result.faults.iter().map(|row| row.card.as_deref()).collect();
    assert_eq!(cards, [Some("encoder-2"), None]);
    let silent = |text: &&String| text.contains("did not answer") || text.contains("was not granted");
    let found: Vec<_> = result.findings.iter().filter(silent).collect();
    assert_eq!(found, ["card encoder-2 did not answer at 5.0030 s (BERR*)", "the bus was not granted at 6.0040 s (access timer)"]);
}
