//! From a watched run to its row, and from the rows to what a kind and the campaign come to.

use super::draw::Draw;
use super::effect::Difference;
use super::plan::{Kind, Plan, State};
use super::shows;
use super::watch::{Seen, is_braked};
use board::Ns;
use messages::{Event, EventKind};
use report::{DrawRow, DrawVerdict, KindSummary, NullRuns, Totals, Trace, Verdict};
use scenario::Scenario;

/// The row of a drawn fault: its run beside its twin.
pub fn row(plan: &Plan, draw: &Draw, scenario: &Scenario, seen: &Seen, twin: &Seen) -> DrawRow {
    let run = &seen.trace;
    let (kind, fault) = (&plan.kinds[draw.kind], draw.fault());
    let period_ms = control_period_ms(scenario);
    let [mildest, gravest] = kind.reaction;
    let measured = report::fault_rows(scenario, run).into_iter().rfind(|row| row.fault + 1 == draw.faults.len());
    let from = draw.at;
    let mut row = DrawRow {
        kind: fault.kind.name().into(),
        target: fault.target.clone(),
        phase: plan.phases[draw.phase].name.clone(),
        seed: draw.seed,
        amount: fault.amount,
        injected_s: from as f64 * 1e-9,
        effect: false,
        detected_by: None,
        detected_after_ms: None,
        bound_ms: kind.bound(&fault.target).of(fault.amount, period_ms),
        safe_after_ms: None,
        reaction: State::Run.name().into(),
        expected: if mildest == gravest {
            mildest.name().into()
        } else {
            format!("{} to {}", mildest.name(), gravest.name())
        },
        force_before_n: 0.0,
        peak_force_n: 0.0,
        force_growth_n: None,
        peak_torque_share: 0.0,
        distance_mm: 0.0,
        verdict: DrawVerdict::NotInjected,
    };
    let Some(measured) = measured else { return row };
    // some faults begin with the next thing that they can befall
    let begun = nanoseconds_of(measured.injected_s);
    row.injected_s = measured.injected_s;
    row.bound_ms += shows::after_ms(kind.bound(&fault.target), scenario, measured.fault, run, begun);
    row.effect = Difference::of(seen, twin, from).exceeds(&kind.effect.unwrap_or(plan.effect));
    row.detected_by = measured.detected_by;
    row.detected_after_ms = measured.detected_after_s.map(|after| 1e3 * after);
    row.force_before_n = measured.force_before_n;
    row.peak_force_n = measured.peak_force_n;
    row.peak_torque_share = measured.peak_torque_share;
    row.distance_mm = 1e3 * measured.distance_m;
    let reaction = reaction(run, begun);
    row.reaction = reaction.name().into();
    row.safe_after_ms = safe_at(run, begun).map(|t| (t.saturating_sub(begun)) as f64 * 1e-6);
    row.force_growth_n = growth_after_sto(run, begun, row.force_before_n);
    row.verdict = verdict(&row, reaction, kind, kind.force_growth_n.unwrap_or(plan.force_growth_n));
    row
}

fn nanoseconds_of(seconds: f64) -> Ns {
    (seconds * 1e9).round() as Ns
}

/// Period of the first control task, ms.
pub fn control_period_ms(scenario: &Scenario) -> f64 {
    let task = scenario.task_of("control_computer").map(|task| &scenario.rack.tasks[usize::from(task)]);
    task.map_or(0.0, |task| task.period_ns as f64 * 1e-6)
}

fn states(run: &Trace) -> impl Iterator<Item = &Event> {
    run.events.iter().filter(|event| event.kind == EventKind::SafetyState as u32)
}

/// The state that an event of such a change leads to.
fn state(event: &Event) -> State {
    State::from_number(event.b as u32)
}

/// The gravest state from `begun` on; all brakes engaged is STO, whoever did it.
fn reaction(run: &Trace, begun: Ns) -> State {
    let before = states(run).take_while(|event| event.t < begun).last().map(state);
    let after = states(run).filter(|event| event.t >= begun).map(state).max();
    let braked = run.plant.iter().any(|probe| probe.t >= begun && is_braked(probe)).then_some(State::Off);
    [before, after, braked].into_iter().flatten().max().unwrap_or(State::Run)
}

/// When the arm was held or on its brakes, from `begun` on.
fn safe_at(run: &Trace, begun: Ns) -> Option<Ns> {
    let held = states(run).find(|event| event.t >= begun && state(event) == State::Hold).map(|event| event.t);
    let braked = run.plant.iter().find(|probe| probe.t >= begun && is_braked(probe)).map(|probe| probe.t);
    held.into_iter().chain(braked).min()
}

/// Greatest contact force once all brakes are engaged, less the one before the fault.
fn growth_after_sto(run: &Trace, begun: Ns, before_n: f64) -> Option<f64> {
    let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let braked = run.plant.iter().filter(|probe| probe.t >= begun && is_braked(probe));
    braked.map(|probe| size(&probe.contact[..3])).reduce(f64::max).map(|peak| peak - before_n)
}

fn verdict(row: &DrawRow, reaction: State, kind: &Kind, growth_n: f64) -> DrawVerdict {
    let [mildest, gravest] = kind.reaction;
    let too_much = row.force_growth_n.is_some_and(|growth| growth > growth_n);
    match row.detected_after_ms {
        _ if too_much => DrawVerdict::TooMuchForce,
        None if row.effect => DrawVerdict::Undetected,
        Some(after) if row.effect && after > row.bound_ms => DrawVerdict::Late,
        _ if reaction > gravest || row.effect && reaction < mildest => DrawVerdict::WrongReaction,
        _ if !row.effect => DrawVerdict::NoEffect,
        _ => DrawVerdict::Passed,
    }
}

/// What the rows of one kind come to; `strict`: a kind that is not shown fails.
pub fn kind_summary(plan: &Plan, kind: &Kind, rows: &[DrawRow], strict: bool) -> KindSummary {
    let rows: Vec<&DrawRow> = rows.iter().filter(|row| row.kind == kind.kind.name()).collect();
    let effective: Vec<&&DrawRow> = rows.iter().filter(|row| row.effect).collect();
    let in_bound =
        effective.iter().filter(|row| row.detected_after_ms.is_some_and(|after| after <= row.bound_ms)).count();
    let mut times: Vec<f64> = effective.iter().filter_map(|row| row.detected_after_ms).collect();
    times.sort_by(f64::total_cmp);
    let of = |verdicts: &[DrawVerdict]| rows.iter().filter(|row| verdicts.contains(&row.verdict)).count();
    let undetected = of(&[DrawVerdict::Undetected, DrawVerdict::NotInjected]);
    let (wrong_reaction, too_much_force) = (of(&[DrawVerdict::WrongReaction]), of(&[DrawVerdict::TooMuchForce]));
    let shown = effective.len() >= plan.least_effective;
    let missed = of(&[DrawVerdict::NotInjected]) > 0;
    let in_time = in_bound as f64 >= plan.detected_share * effective.len() as f64;
    let passed = in_time && !missed && wrong_reaction + too_much_force == 0 && (shown || !strict);
    KindSummary {
        kind: kind.kind.name().into(),
        draws: rows.len(),
        effective: effective.len(),
        in_bound,
        median_ms: times.get(times.len() / 2).copied(),
        greatest_ms: times.last().copied(),
        bound_ms: rows.iter().map(|row| row.bound_ms).fold(0.0, f64::max),
        safe_ms: rows.iter().filter_map(|row| row.safe_after_ms).reduce(f64::max),
        undetected,
        late: of(&[DrawVerdict::Late]),
        wrong_reaction,
        too_much_force,
        shown,
        verdict: if passed { Verdict::Passed } else { Verdict::Failed },
    }
}

/// Sums over all kinds.
pub fn totals(kinds: &[KindSummary], null: &NullRuns) -> Totals {
    let sum = |of: fn(&KindSummary) -> usize| kinds.iter().map(of).sum();
    Totals {
        draws: sum(|kind| kind.draws),
        effective: sum(|kind| kind.effective),
        undetected: sum(|kind| kind.undetected),
        late: sum(|kind| kind.late),
        wrong_reaction: sum(|kind| kind.wrong_reaction),
        too_much_force: sum(|kind| kind.too_much_force),
        not_shown: kinds.iter().filter(|kind| !kind.shown).count(),
        false_trips: null.false_trips.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use messages::{PlantProbe, Severity};

    fn plan(least_effective: usize) -> Plan {
        let text = format!(
            "repeats = 1\nwatch_s = 0.5\nforce_growth_n = 5.0\nleast_effective = {least_effective}\n\
             [[phase]]\nname = \"free\"\nfrom_s = 0.1\nuntil_s = 0.5\n\
             [[kind]]\nkind = \"stuck\"\ntargets = [\"force_sensor\"]\nreaction = [\"hold\", \"stop\"]\n\
             detect = {{ periods = 4.0 }}\n"
        );
        scenario::Source::new("made up", &text).parse().expect("a campaign")
    }

    fn row(effect: bool, detected_after_ms: Option<f64>, growth: Option<f64>) -> DrawRow {
        DrawRow {
            kind: "stuck".into(),
            target: "force_sensor".into(),
            phase: "free".into(),
            seed: 1,
            amount: 0.0,
            injected_s: 0.2,
            effect,
            detected_by: None,
            detected_after_ms,
            bound_ms: 20.0,
            safe_after_ms: None,
            reaction: String::new(),
            expected: String::new(),
            force_before_n: 0.0,
            peak_force_n: 0.0,
            force_growth_n: growth,
            peak_torque_share: 0.0,
            distance_mm: 0.0,
            verdict: DrawVerdict::Passed,
        }
    }

    #[test]
    fn a_fault_passes_where_it_is_seen_in_time_with_the_reaction_and_force_that_are_allowed() {
        let plan = plan(1);
        let judged = |row: &DrawRow, reaction| verdict(row, reaction, &plan.kinds[0], plan.force_growth_n);
        let seen = row(true, Some(20.0), Some(5.0));
        assert_eq!(judged(&seen, State::Hold), DrawVerdict::Passed);
        assert_eq!(judged(&seen, State::Stop), DrawVerdict::Passed);
        assert_eq!(judged(&seen, State::Degraded), DrawVerdict::WrongReaction);
        assert_eq!(judged(&seen, State::Off), DrawVerdict::WrongReaction);
        assert_eq!(judged(&row(true, Some(20.1), None), State::Hold), DrawVerdict::Late);
        assert_eq!(judged(&row(true, None, None), State::Run), DrawVerdict::Undetected);
        assert_eq!(judged(&row(true, Some(1.0), Some(5.1)), State::Hold), DrawVerdict::TooMuchForce);
    }

    #[test]
    fn a_fault_without_effect_needs_no_reaction_but_must_not_stop_the_arm_beyond_what_is_allowed() {
        let plan = plan(1);
        let judged = |reaction| verdict(&row(false, None, None), reaction, &plan.kinds[0], plan.force_growth_n);
        assert_eq!(judged(State::Run), DrawVerdict::NoEffect);
        assert_eq!(judged(State::Off), DrawVerdict::WrongReaction);
    }

    #[test]
    fn a_kind_passes_with_99_of_100_in_time_and_needs_enough_faults_with_an_effect() {
        let summary = |rows: &[DrawRow], least, strict| {
            let plan = plan(least);
            kind_summary(&plan, &plan.kinds[0], rows, strict)
        };
        let mut rows = vec![row(true, Some(10.0), None); 99];
        rows.push(DrawRow { verdict: DrawVerdict::Late, ..row(true, Some(30.0), None) });
        let of = summary(&rows, 20, true);
        assert_eq!((of.effective, of.in_bound, of.late, of.verdict), (100, 99, 1, Verdict::Passed));
        assert_eq!((of.median_ms, of.greatest_ms), (Some(10.0), Some(30.0)));
        rows.push(DrawRow { verdict: DrawVerdict::Undetected, ..row(true, None, None) });
        assert_eq!(summary(&rows, 20, true).verdict, Verdict::Failed);
        let few = [row(true, Some(10.0), None), row(false, None, None)];
        let of = summary(&few, 20, true);
        assert_eq!((of.shown, of.verdict), (false, Verdict::Failed));
        assert_eq!(summary(&few, 20, false).verdict, Verdict::Passed);
        assert_eq!(summary(&few, 1, true).verdict, Verdict::Passed);
    }

    #[test]
    fn all_brakes_engaged_is_sto_and_safe_whoever_engaged_them() {
        let mut run = Trace::default();
        for t in 0..10 {
            let mut probe = PlantProbe { t, ..PlantProbe::zeroed() };
            probe.contact[2] = 10.0 + t as f64;
            probe.status = if t >= 6 { messages::drive_status::BRAKE_ENGAGED } else { 0 };
            run.plant.push(probe);
        }
        assert_eq!((reaction(&run, 2), safe_at(&run, 2)), (State::Off, Some(6)));
        assert_eq!(growth_after_sto(&run, 2, 12.0), Some(7.0));
        run.events.push(Event::new(4, EventKind::SafetyState, Severity::Warn, 0.0, 2.0));
        assert_eq!(safe_at(&run, 2), Some(4), "held before");
        run.plant.truncate(6);
        assert_eq!((reaction(&run, 2), growth_after_sto(&run, 2, 12.0)), (State::Hold, None));
        assert_eq!(reaction(&run, 5), State::Hold, "it lasts");
    }
}
