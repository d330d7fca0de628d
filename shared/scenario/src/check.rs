//! Whether a scenario makes sense: every rule that its types cannot state, each with the key that breaks it.

use crate::error::Problem;
use crate::hardware::nanoseconds;
use crate::model::*;
use arm::DOF;
use messages::BoardId;

type Result = std::result::Result<(), Problem>;

/// Checks everything, in the order in which a reader goes through the file.
pub(crate) fn check(scenario: &Scenario) -> Result {
    plant(scenario)?;
    interfaces(scenario)?;
    controller(&scenario.controller)?;
    segments(scenario)?;
    surfaces(scenario)?;
    holes(scenario)?;
    rack(scenario)?;
    crate::faults::check(scenario)?;
    let safety = &scenario.safety;
    for (key, value, most) in [
        ("max_force_age_ms", safety.max_force_age_ms, 1e4),
        ("max_message_age_ms", safety.max_message_age_ms, 1e4),
        ("max_clock_error_us", safety.max_clock_error_us, 1e6),
        ("max_force_slew_n", safety.max_force_slew_n, 1e6),
        ("max_force_noise_n", safety.max_force_noise_n, 1e6),
        ("max_free_force_n", safety.max_free_force_n, 1e6),
        ("max_count_jump_rad", safety.max_count_jump_rad, 10.0),
        ("max_residual_share", safety.max_residual_share, 100.0),
        ("max_force_residual_n", safety.max_force_residual_n, 1e6),
        ("max_braked_speed_rad_per_s", safety.max_braked_speed_rad_per_s, 100.0),
        ("max_brake_time_ms", safety.max_brake_time_ms, 1e4),
        ("max_command_step_m", safety.max_command_step_m, 100.0),
        ("max_command_speed_m_per_s", safety.max_command_speed_m_per_s, 100.0),
        ("stop_time_ms", safety.stop_time_ms, 1e4),
    ] {
        within(&format!("safety.{key}"), value, 0.0..=most, &format!("0 to {most}"))?;
    }
    if let Some(wait) = safety.acknowledge_s {
        within("safety.acknowledge_s", wait, 0.0..=1e6, "0 to 1 000 000 s")?;
    }
    processes(scenario)?;
    crate::outages::check(scenario)?;
    realtime(scenario)?;
    variants_and_limits(scenario)?;
    reach(scenario)?;
    scenario.stiffness().map(|_| ())
}

fn within(key: impl Into<String>, value: f64, range: std::ops::RangeInclusive<f64>, expected: &str) -> Result {
    if range.contains(&value) { Ok(()) } else { Err(Problem::new(key, format!("is {value}, expected {expected}"))) }
}

fn not_negative(key: impl Into<String>, value: f64) -> Result {
    within(key, value, 0.0..=f64::MAX, "0 or more")
}

fn positive(key: impl Into<String>, value: f64) -> Result {
    within(key, value, f64::MIN_POSITIVE..=f64::MAX, "more than 0")
}

fn all<const N: usize>(key: &str, values: &[f64; N], rule: impl Fn(String, f64) -> Result) -> Result {
    values.iter().enumerate().try_for_each(|(i, &value)| rule(format!("{key}.{i}"), value))
}

fn plant(scenario: &Scenario) -> Result {
    let plant = &scenario.plant;
    within("plant.rate_hz", plant.rate_hz, 1e3..=1e6, "1000 to 1 000 000")?;
    within("plant.frozen_steps", plant.frozen_steps.into(), 1.0..=100.0, "1 to 100")?;
    within("plant.friction_scale", plant.friction_scale, 0.0..=10.0, "0 to 10")?;
    positive("plant.runaway_rad_per_s", plant.runaway_rad_per_s)?;
    positive("arm.slide_mass_kg", scenario.arm.slide_mass_kg)?;
    not_negative("arm.slide_damping_ns_per_m", scenario.arm.slide_damping_ns_per_m)?;
    not_negative("arm.tool.mass_kg", scenario.arm.tool.mass_kg)?;
    if let Some(mismatch) = &plant.mismatch {
        not_negative("plant.mismatch.origin_m", mismatch.origin_m)?;
        not_negative("plant.mismatch.origin_deg", mismatch.origin_deg)?;
        within("plant.mismatch.mass_ratio", mismatch.mass_ratio, 0.0..=0.5, "0 to 0.5")?;
        within("plant.mismatch.inertia_ratio", mismatch.inertia_ratio, 0.0..=0.5, "0 to 0.5")?;
        not_negative("plant.mismatch.gravity_deg", mismatch.gravity_deg)?;
    }
    Ok(())
}

fn interfaces(scenario: &Scenario) -> Result {
    let force = &scenario.force_sensor_if;
    match force.filter {
        ForceFilter::Cascade(n) if n > 6 => {
            return Err(Problem::new("force_sensor_if.filter", format!("cascade = {n}, expected 0 to 6")));
        }
        ForceFilter::DelayMs(ms) => within("force_sensor_if.filter", ms, 0.0..=1000.0, "a delay_ms of 0 to 1000")?,
        ForceFilter::Cascade(_) => {}
    }
    positive("force_sensor_if.full_scale_n", force.full_scale_n)?;
    positive("force_sensor_if.full_scale_nm", force.full_scale_nm)?;
    within("force_sensor_if.full_scale_counts", force.full_scale_counts, 1e3..=1e9, "1000 to 1e9")?;
    not_negative("force_sensor_if.noise_n", force.noise_n)?;
    not_negative("force_sensor_if.noise_nm", force.noise_nm)?;
    let encoder = &scenario.encoder_if;
    within("encoder_if.counter_bits", encoder.counter_bits.into(), 12.0..=32.0, "12 to 32")?;
    within("encoder_if.velocity_window_us", encoder.velocity_window_us, 100.0..=20_000.0, "100 to 20000")?;
    within("encoder_if.delay_ms", encoder.delay_ms, 0.0..=1000.0, "0 to 1000")?;
    let da = &scenario.da_io;
    within("da_io.bits", da.bits.into(), 8.0..=32.0, "8 to 32")?;
    within("da_io.watchdog_ms", da.watchdog_ms, 0.0..=10_000.0, "0 (off) to 10000")?;
    within("da_io.brake_delay_ms", da.brake_delay_ms, 0.0..=1000.0, "0 to 1000")
}

fn controller(controller: &Controller) -> Result {
    not_negative("controller.kp", controller.kp)?;
    not_negative("controller.kv", controller.kv)?;
    not_negative("controller.lambda", controller.lambda)?;
    all("controller.task_weight", &controller.task_weight, not_negative)?;
    all("controller.joint_weight", &controller.joint_weight, not_negative)?;
    positive("controller.max_target_error_m", controller.max_target_error_m)?;
    within("controller.max_target_error_deg", controller.max_target_error_deg, 1e-3..=179.0, "above 0 to 179")?;
    within("controller.friction_compensation", controller.friction_compensation, 0.0..=2.0, "0 to 2")?;
    positive("controller.joint_limit.buffer_deg", controller.joint_limit.buffer_deg)?;
    positive("controller.joint_limit.kp", controller.joint_limit.kp)?;
    not_negative("controller.joint_limit.max_weight", controller.joint_limit.max_weight)?;
    not_negative("controller.tare_ms", controller.tare_ms)?;
    not_negative("controller.execution_us", controller.execution_us)?;
    not_negative("controller.entry_us", controller.entry_us)?;
    not_negative("controller.second_card.execution_us", controller.second_card.execution_us)?;
    not_negative("controller.second_card.entry_us", controller.second_card.entry_us)
}

fn segments(scenario: &Scenario) -> Result {
    if scenario.segments.is_empty() {
        return Err(Problem::new("segment", "expected at least one [[segment]]"));
    }
    for (i, segment) in scenario.resolved_segments().iter().enumerate() {
        let key = |name: &str| format!("segment.{i}.{name}");
        if segment.end_s <= segment.start_s {
            return Err(Problem::new(
                key("until_s"),
                format!("segment `{}` ends at {} s, but the one before it ends at {} s: segments overlap; expected a later end", segment.name, segment.end_s, segment.start_s),
            ));
        }
        within(key("move_s"), segment.move_s, 1e-3..=segment.end_s - segment.start_s + 1e-9, "0.001 s to the segment's length")?;
        if scenario.segments[..i].iter().any(|earlier| earlier.name == segment.name) {
            return Err(Problem::new(key("name"), format!("a segment `{}` stands before; names are unique", segment.name)));
        }
        for axis in 0..6 {
            let (block, unit, j) = if axis < 3 { ("", "kg", axis) } else { ("rotational_", "kg_m2", axis - 3) };
            positive(format!("segment.{i}.{block}mass_{unit}.{j}"), segment.mass[axis])?;
            let (b, k) = if axis < 3 {
                ("damping_ns_per_m", "stiffness_n_per_m")
            } else {
                ("rotational_damping_nms_per_rad", "rotational_stiffness_nm_per_rad")
            };
            not_negative(format!("segment.{i}.{b}.{j}"), segment.damping[axis])?;
            not_negative(format!("segment.{i}.{k}.{j}"), segment.stiffness[axis])?;
            if segment.selection[axis] > 1 {
                return Err(Problem::new(
                    format!("segment.{i}.selection.{axis}"),
                    format!("is {}, expected 1 (impedance axis) or 0 (force axis)", segment.selection[axis]),
                ));
            }
        }
    }
    within("duration_s", scenario.duration(), 1e-3..=36_000.0, "0.001 to 36000")
}

/// Chosen. The restitution e of an impact at v is that of 1.5 c v (1 + e) = ln((1 + 1.5 c v)/(1 - 1.5 c v e)): with 10 s/m
/// 0.6 at 7 cm/s and 0.07 at 1 m/s, far beyond metals (0.1 to 0.5 s/m).
const HUNT_CROSSLEY_MAX: f64 = 10.0;
const HUNT_CROSSLEY: &str = "0 to 10";

fn surfaces(scenario: &Scenario) -> Result {
    for (i, surface) in scenario.surfaces.iter().enumerate() {
        let key = |name: &str| format!("surface.{i}.{name}");
        within(key("stiffness_n_per_m"), surface.stiffness_n_per_m, 1.0..=1e6, "1 to 1e6")?;
        within(key("hunt_crossley_s_per_m"), surface.hunt_crossley_s_per_m, 0.0..=HUNT_CROSSLEY_MAX, HUNT_CROSSLEY)?;
        within(key("friction"), surface.friction, 0.0..=2.0, "0 to 2")?;
        all(&key("tilt_deg"), &surface.tilt_deg, |key, tilt| within(key, tilt, -60.0..=60.0, "-60 to 60"))?;
        if let Some(half) = &surface.half_size_m {
            all(&key("half_size_m"), half, positive)?;
        }
    }
    Ok(())
}

fn holes(scenario: &Scenario) -> Result {
    if scenario.holes.len() > 1 {
        return Err(Problem::new("hole.1.name", "a second hole: the tool carries one peg, expected one [[hole]]"));
    }
    for (i, hole) in scenario.holes.iter().enumerate() {
        let key = |name: &str| format!("hole.{i}.{name}");
        all(&key("tilt_deg"), &hole.tilt_deg, |key, tilt| within(key, tilt, -30.0..=30.0, "-30 to 30"))?;
        within(key("bore_radius_m"), hole.bore_radius_m, 1e-3..=1.0, "0.001 to 1")?;
        let widest = hole.bore_radius_m;
        positive(key("peg_radius_m"), hole.peg_radius_m)?;
        within(key("peg_radius_m"), hole.peg_radius_m, 0.0..=widest, &format!("a peg that fits, at most the bore's {widest}"))?;
        positive(key("peg_length_m"), hole.peg_length_m)?;
        not_negative(key("chamfer_m"), hole.chamfer_m)?;
        within(key("depth_m"), hole.depth_m, hole.chamfer_m + 1e-6..=10.0, "a floor below the chamfer, at most 10")?;
        within(key("stiffness_n_per_m"), hole.stiffness_n_per_m, 1.0..=1e6, "1 to 1e6")?;
        within(key("hunt_crossley_s_per_m"), hole.hunt_crossley_s_per_m, 0.0..=HUNT_CROSSLEY_MAX, HUNT_CROSSLEY)?;
        within(key("friction"), hole.friction, 0.0..=2.0, "0 to 2")?;
        let depth = hole.depth_of(scenario.arm.start_position_m);
        let room = hole.peg_radius_m * hole.tilt_deg.iter().map(|tilt| tilt.to_radians().abs()).sum::<f64>();
        within(key("position_m"), -depth, room..=f64::MAX, "the peg's start in front of the hole (its start penetrates it)")?;
    }
    Ok(())
}

/// Longest time that a rack may have: the longest run.
const LONGEST_NS: i64 = 36_000_000_000_000;
/// What a rack does by itself, without a job, does not happen more often.
const SHORTEST_NS: vme::Ns = 100;

/// Every time in the rack, whatever it is of, is one that sums of a run can be made of.
fn times(key: &str, value: &toml::Value) -> Result {
    match value {
        toml::Value::Table(table) => table.iter().try_for_each(|(name, value)| times(&format!("{key}.{name}"), value)),
        toml::Value::Array(list) => (0..).zip(list).try_for_each(|(i, value): (usize, _)| times(&format!("{key}.{i}"), value)),
        toml::Value::Integer(ns) if key.ends_with("_ns") && !(0..=LONGEST_NS).contains(ns) => {
            Err(Problem::new(key, format!("is {ns}, expected 0 to {LONGEST_NS}")))
        }
        _ => Ok(()),
    }
}

fn rack(scenario: &Scenario) -> Result {
    let rack = &scenario.rack;
    let tree = toml::Value::try_from(rack).map_err(|error| Problem::new("rack", error.to_string()))?;
    times("rack", &tree)?;
    let often = |key: String, ns: vme::Ns| match ns {
        0..SHORTEST_NS => Err(Problem::new(key, format!("is {ns}, expected {SHORTEST_NS} or more"))),
        _ => Ok(()),
    };
    for (i, traffic) in rack.traffic.iter().enumerate() {
        often(format!("rack.traffic.{i}.period_ns"), traffic.period_ns)?;
    }
    for (i, interrupter) in rack.interrupters.iter().enumerate() {
        interrupter.ticks.map_or(Ok(()), |ticks| often(format!("rack.interrupters.{i}.ticks.period_ns"), ticks.period_ns))?;
    }
    for (i, task) in rack.tasks.iter().enumerate() {
        if let vme::rack::Release::Poll(poll) = &task.release {
            often(format!("rack.tasks.{i}.release.poll.interval_ns"), poll.interval_ns)?;
        }
    }
    for (i, task) in rack.tasks.iter().enumerate() {
        if task.period_ns < vme::MICROSECOND * 10 {
            return Err(Problem::new(format!("rack.tasks.{i}.period_ns"), format!("is {}, expected 10000 or more", task.period_ns)));
        }
        if task.offset_ns > nanoseconds(scenario.duration()) {
            return Err(Problem::new(format!("rack.tasks.{i}.offset_ns"), "the first release lies behind the end of the run"));
        }
        if !["control_computer", "workstation"].contains(&task.board.as_str()) {
            return Err(Problem::new(format!("rack.tasks.{i}.board"), format!("`{}` runs no task, expected control_computer or workstation", task.board)));
        }
    }
    for board in ["control_computer", "workstation"] {
        if scenario.task_of(board).is_none() {
            return Err(Problem::new("rack.tasks", format!("no task for `{board}`")));
        }
    }
    let mut control = rack.tasks.iter().enumerate().filter(|(_, task)| task.board == "control_computer");
    if let (Some((_, first)), Some((i, second))) = (control.next(), control.next()) {
        if first.processor == second.processor {
            let (first, second, card) = (&first.name, &second.name, &first.processor);
            return Err(Problem::new(format!("rack.tasks.{i}.processor"), format!("tasks `{first}` and `{second}` share the pipeline and both run on `{card}`, expected another card for `{second}`")));
        }
        if let Some((j, third)) = control.next() {
            let (first, second, third) = (&first.name, &second.name, &third.name);
            return Err(Problem::new(format!("rack.tasks.{j}"), format!("tasks `{first}` and `{second}` share the pipeline already; there is nothing left for `{third}`")));
        }
    }
    for (i, slave) in rack.slaves.iter().enumerate() {
        let key = |name: &str| format!("rack.slaves.{i}.{name}");
        if BoardId::from_name(&slave.board).is_none() {
            return Err(Problem::new(key("board"), format!("there is no board `{}`, expected one of {}", slave.board, board_names())));
        }
        if !(1..=21).contains(&slave.slot) {
            return Err(Problem::new(key("slot"), format!("is {}, expected 1 to 21", slave.slot)));
        }
        for other in &rack.slaves[..i] {
            let overlap = slave.am == other.am
                && slave.base < other.base.saturating_add(other.size)
                && other.base < slave.base.saturating_add(slave.size);
            if overlap {
                return Err(Problem::new(key("base"), format!("the window of `{}` overlaps the one of `{}`", slave.name, other.name)));
            }
        }
    }
    rack.clone().checked().map_err(|error| Problem::new("rack", error.to_string()))?;
    for card in crate::CARDS {
        if scenario.card_base(card).is_none() {
            return Err(Problem::new("rack.slaves", format!("there is no card `{card}`, and the boards need it")));
        }
    }
    Ok(())
}

fn board_names() -> String {
    messages::BOARDS[1..].iter().map(|board| board.name()).collect::<Vec<_>>().join(", ")
}

fn processes(scenario: &Scenario) -> Result {
    let mut placed: Vec<(&str, usize)> = Vec::new();
    for (i, process) in scenario.processes.iter().enumerate() {
        if scenario.processes[..i].iter().any(|earlier| earlier.name == process.name) {
            return Err(Problem::new(format!("process.{i}.name"), format!("a process `{}` stands before; names are unique", process.name)));
        }
        if process.boards.is_empty() {
            return Err(Problem::new(format!("process.{i}.boards"), "expected at least one board"));
        }
        for (j, board) in process.boards.iter().enumerate() {
            let key = format!("process.{i}.boards.{j}");
            if !matches!(BoardId::from_name(board), Some(id) if id != BoardId::Chassis) {
                return Err(Problem::new(key, format!("there is no board `{board}`, expected one of {}", board_names())));
            }
            if let Some((_, earlier)) = placed.iter().find(|(name, _)| name == board) {
                let earlier = &scenario.processes[*earlier].name;
                return Err(Problem::new(key, format!("board `{board}` is placed twice, in `{earlier}` and in `{}`", process.name)));
            }
            placed.push((board, i));
        }
    }
    for board in &messages::BOARDS[1..] {
        if !placed.iter().any(|(name, _)| *name == board.name()) {
            return Err(Problem::new("process", format!("board `{}` is placed nowhere; every board needs a process", board.name())));
        }
    }
    Ok(())
}

fn realtime(scenario: &Scenario) -> Result {
    let priority = |key: String, priority: u8| match priority {
        0..=99 => Ok(()),
        _ => Err(Problem::new(key, format!("is {priority}, expected 1 to 99, or 0 for time sharing"))),
    };
    priority("realtime.priority".into(), scenario.realtime.priority)?;
    for (i, process) in scenario.processes.iter().enumerate() {
        process.priority.map_or(Ok(()), |own| priority(format!("process.{i}.priority"), own))?;
    }
    for (i, limit) in scenario.realtime.limits.iter().enumerate() {
        within(format!("realtime.limit.{i}.quantile"), limit.quantile, 0.0..=1.0, "0 to 1")?;
        positive(format!("realtime.limit.{i}.max_us"), limit.max_us)?;
    }
    Ok(())
}

fn variants_and_limits(scenario: &Scenario) -> Result {
    for (i, variant) in scenario.variants.iter().enumerate() {
        let plain = !variant.name.is_empty() && variant.name.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c));
        if !plain || variant.name.starts_with('.') {
            return Err(Problem::new(format!("variant.{i}.name"), format!("is `{}`, expected letters, digits, - and _: files carry it", variant.name)));
        }
        if scenario.variants[..i].iter().any(|earlier| earlier.name == variant.name) {
            return Err(Problem::new(format!("variant.{i}.name"), format!("a variant `{}` stands before; names are unique", variant.name)));
        }
    }
    let known = |name: &String| scenario.variants.iter().any(|variant| variant.name == *name) || (scenario.variants.is_empty() && name == "nominal");
    for (i, limit) in scenario.limits.iter().enumerate() {
        if let Some(name) = limit.variants.iter().find(|name| !known(name)) {
            return Err(Problem::new(format!("limit.{i}.variants"), format!("there is no variant `{name}`")));
        }
        if let Some(name) = limit.relative_to.iter().find(|name| !known(name)) {
            return Err(Problem::new(format!("limit.{i}.relative_to"), format!("there is no variant `{name}`")));
        }
        if let Some(name) = limit.segments.iter().find(|name| !scenario.segments.iter().any(|segment| segment.name == **name)) {
            return Err(Problem::new(format!("limit.{i}.segments"), format!("there is no segment `{name}`")));
        }
        if limit.min.is_none() && limit.max.is_none() {
            return Err(Problem::new(format!("limit.{i}"), "expected min, max or both"));
        }
    }
    for (i, sweep) in scenario.report.sweeps.iter().enumerate() {
        if let Some(name) = sweep.variants.iter().find(|name| !known(name)) {
            return Err(Problem::new(format!("report.sweep.{i}.variants"), format!("there is no variant `{name}`")));
        }
    }
    within("report.force_axis", scenario.report.force_axis as f64, 0.0..=2.0, "0 (x), 1 (y) or 2 (z)")
}

/// Every pose named must be in reach, and so must every surface that is to be touched.
fn reach(scenario: &Scenario) -> Result {
    let arm = scenario.controller_arm().map_err(|message| Problem::new("arm", message))?;
    scenario.drives().map_err(|message| Problem::new("arm.drives", message))?;
    let mut q = scenario.initial_posture().map_err(|message| Problem::new("arm.start_position_m", message))?;
    if arm.is_slide() {
        return Ok(());
    }
    for i in 0..DOF {
        let (lower, upper) = (arm.lower_limits()[i], arm.upper_limits()[i]);
        within(format!("arm.posture_deg.{i}"), q[i], lower..=upper, &format!("a posture within the joint's limits of {lower:.3} to {upper:.3} rad"))?;
    }
    for (i, segment) in scenario.resolved_segments().iter().enumerate() {
        let pose = scenario.base_pose(segment.position_m, segment.rpy_deg);
        q = crate::inverse_kinematics(&arm, &pose, &q).map_err(|error| Problem::new(format!("segment.{i}.position_m"), error.to_string()))?;
    }
    for (i, hole) in scenario.holes.iter().enumerate() {
        let at = scenario.base_pose(hole.position_m, [0.0; 3]).p.norm();
        within(format!("hole.{i}.position_m"), at, 0.0..=arm.reach_bound(), &format!("a hole within {:.3} m of the base", arm.reach_bound()))?;
    }
    let frame = scenario.task_frame();
    let shoulder = nalgebra::Vector3::zeros();
    for (i, surface) in scenario.surfaces.iter().enumerate() {
        // the closest point of the plane must lie within the arm's stretched length
        let normal = frame.r * surface.normal();
        let point = frame.p + frame.r * nalgebra::Vector3::from(surface.position_m);
        let distance = normal.dot(&(shoulder - point)).abs();
        within(format!("surface.{i}.position_m"), distance, 0.0..=arm.reach_bound(), &format!("a surface within {:.3} m of the base", arm.reach_bound()))?;
        if let Some(&[x, y]) = surface.half_size_m.as_ref() {
            let centre = (point - shoulder).norm() - x.hypot(y);
            within(format!("surface.{i}.position_m"), centre, f64::MIN..=arm.reach_bound(), &format!("a patch within {:.3} m of the base", arm.reach_bound()))?;
        }
        let start = scenario.base_pose(scenario.arm.start_position_m, scenario.arm.start_rpy_deg).p;
        let gap = normal.dot(&(start - point));
        within(format!("surface.{i}.position_m"), gap, 0.0..=f64::MAX, "the tool's start on the free side of the surface (its start penetrates it)")?;
        // the point of the surface that lies straight ahead of the tool must be in reach
        let ahead = arm::Pose { p: start - normal * gap, r: scenario.base_pose([0.0; 3], scenario.arm.start_rpy_deg).r };
        let posture = scenario.initial_posture().map_err(|message| Problem::new("arm.start_position_m", message))?;
        if surface.half_size_m.is_none() {
            crate::inverse_kinematics(&arm, &ahead, &posture)
                .map_err(|error| Problem::new(format!("surface.{i}.position_m"), format!("the surface is out of reach: {error}")))?;
        }
    }
    Ok(())
}

/// What a scenario may do but probably should not.
pub fn warnings(scenario: &Scenario) -> Vec<String> {
    let mut warnings = Vec::new();
    if let Some(gain) = inner_loop_gain(scenario).filter(|gain| *gain > 1.0) {
        warnings.push(format!(
            "controller.kv: the inner loop is probably unstable: (M_ii + N²J_m)/(N²J_m) · K_v · T is {gain:.2} on its worst joint, and should not exceed 1"
        ));
    }
    warnings
}

/// Largest (M_ii + N²J_m)/(N²J_m) · K_v · T over the joints at the start posture. With flexible joints the motor alone
/// answers at high frequency, so motor-side inverse dynamics multiplies the gain by this (a heuristic).
fn inner_loop_gain(scenario: &Scenario) -> Option<f64> {
    let arm = scenario.controller_arm().ok()?;
    if arm.is_slide() || scenario.plant.joints == Joints::Rigid || scenario.controller.scheme == Scheme::Original {
        return None;
    }
    let drives = scenario.drives().ok()?;
    let mass = arm::crba(&arm, &scenario.initial_posture().ok()?);
    let period = scenario.rack.tasks[usize::from(scenario.task_of("control_computer")?)].period_ns as f64 * 1e-9;
    (0..DOF)
        .map(|i| {
            let rotor = drives.joints[i].rotor_inertia_at_output_kg_m2;
            (mass[(i, i)] + rotor) / rotor * scenario.controller.kv * period
        })
        .max_by(f64::total_cmp)
}
