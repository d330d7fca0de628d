//! Payloads of the rack as ROS 2 messages. Field order is that of the definitions in `schema/`.

use crate::cdr::Cdr;
use messages::{ControlProbe, Detector, Event, EventKind, JOINTS, MasterUse, Ns, PlantProbe, SensorPath, TransferRecord};

/// Frame of all poses and wrenches: fixed in the world, z into the surface.
pub const TASK_FRAME: &str = "task";

/// A pose: position and unit quaternion (w, x, y, z), as the payloads hold it.
pub type PositionQuaternion<'a> = (&'a [f64; 3], &'a [f64; 4]);

/// `std_msgs/Header`.
pub fn header(cdr: &mut Cdr, t: Ns, frame: &str) {
    stamp(cdr, t);
    cdr.string(frame);
}

fn stamp(cdr: &mut Cdr, t: Ns) {
    cdr.i32((t / 1_000_000_000) as i32);
    cdr.u32((t % 1_000_000_000) as u32);
}

fn pose(cdr: &mut Cdr, (position, [w, x, y, z]): PositionQuaternion) {
    cdr.f64s(position);
    cdr.f64s(&[*x, *y, *z, *w]);
}

/// `sensor_msgs/JointState`.
pub fn joint_state(
    cdr: &mut Cdr,
    t: Ns,
    names: &[String; JOINTS],
    position: &[f64; JOINTS],
    velocity: &[f64; JOINTS],
    effort: &[f64; JOINTS],
) {
    header(cdr, t, "");
    cdr.u32(JOINTS as u32);
    for name in names {
        cdr.string(name);
    }
    cdr.f64_sequence(position);
    cdr.f64_sequence(velocity);
    cdr.f64_sequence(effort);
}

/// `geometry_msgs/PoseStamped` in the task frame.
pub fn pose_stamped(cdr: &mut Cdr, t: Ns, of: PositionQuaternion) {
    header(cdr, t, TASK_FRAME);
    pose(cdr, of);
}

/// `geometry_msgs/WrenchStamped` in the task frame.
pub fn wrench_stamped(cdr: &mut Cdr, t: Ns, wrench: &[f64; 6]) {
    header(cdr, t, TASK_FRAME);
    cdr.f64s(wrench);
}

/// `tf2_msgs/TFMessage`: frames (name, pose) in a parent frame.
pub fn transforms(cdr: &mut Cdr, t: Ns, parent: &str, frames: &[(&str, PositionQuaternion)]) {
    cdr.u32(frames.len() as u32);
    for (name, of) in frames {
        header(cdr, t, parent);
        cdr.string(name);
        pose(cdr, *of);
    }
}

/// `rack_msgs/ControlState`.
pub fn control_state(cdr: &mut Cdr, probe: &ControlProbe) {
    header(cdr, probe.t, TASK_FRAME);
    for number in [probe.job, probe.segment, probe.state, probe.limits] {
        cdr.u32(number);
    }
    cdr.u64(probe.force_age);
    cdr.u64(probe.encoder_age);
    for joints in [&probe.q, &probe.qd, &probe.qdd, &probe.torque] {
        cdr.f64s(joints);
    }
    pose(cdr, (&probe.x, &probe.x_orientation));
    cdr.f64s(&probe.x_dot);
    pose(cdr, (&probe.xt, &probe.xt_orientation));
    cdr.f64s(&probe.xt_dot);
    cdr.f64s(&probe.xt_ddot);
    pose(cdr, (&probe.xd, &probe.xd_orientation));
    cdr.f64s(&probe.xr_ddot);
    cdr.f64s(&probe.fe);
    cdr.f64s(&probe.fd);
}

/// `rack_msgs/PlantState`.
pub fn plant_state(cdr: &mut Cdr, probe: &PlantProbe) {
    header(cdr, probe.t, TASK_FRAME);
    for joints in [
        &probe.q,
        &probe.qd,
        &probe.theta,
        &probe.theta_dot,
        &probe.motor_torque,
        &probe.spring_torque,
        &probe.friction_torque,
    ] {
        cdr.f64s(joints);
    }
    pose(cdr, (&probe.position, &probe.orientation));
    cdr.f64s(&probe.contact);
    cdr.f64(probe.penetration);
    cdr.f64(probe.energy);
    cdr.u32(probe.status);
}

/// `rack_msgs/Transfers` of the window [from, until].
pub fn transfers(cdr: &mut Cdr, from: Ns, until: Ns, transfers: &[TransferRecord]) {
    header(cdr, until, "");
    cdr.u64(from);
    cdr.u64(until);
    cdr.u32(transfers.len() as u32);
    for transfer in transfers {
        for time in [transfer.requested, transfer.granted, transfer.data_at, transfer.done] {
            cdr.u64(time);
        }
        for number in [transfer.addr, transfer.n, transfer.job] {
            cdr.u32(number);
        }
        for number in [transfer.task, transfer.index, transfer.slave] {
            cdr.u16(number);
        }
        for number in [transfer.am, transfer.width, transfer.dir, transfer.status] {
            cdr.u8(number);
        }
    }
}

/// `rack_msgs/MasterUse`.
pub fn master_use(cdr: &mut Cdr, used: &MasterUse, name: &str) {
    header(cdr, used.t, "");
    cdr.string(name);
    for number in [used.transfers, used.bus_errors, used.access_timeouts] {
        cdr.u32(number);
    }
    cdr.u64(used.held_ns);
    cdr.f64(used.held_ns as f64 / used.t.max(1) as f64);
    cdr.u64(used.wait_max_ns);
    cdr.u64(used.service_max_ns);
    for count in used.wait.iter().chain(&used.service) {
        cdr.u32(*count);
    }
}

/// `rack_msgs/Latency`.
pub fn latency(cdr: &mut Cdr, path: &SensorPath) {
    header(cdr, path.t, "");
    cdr.u32(path.job);
    cdr.u64(path.t.saturating_sub(path.felt));
    for part in path.parts {
        cdr.u64(part);
    }
}

/// `diagnostic_msgs/DiagnosticArray` with one status.
pub fn event(cdr: &mut Cdr, event: &Event) {
    let kind = EventKind::from_number(event.kind);
    let name = kind.map_or_else(|| format!("event-{}", event.kind), |kind| kind.name().to_owned());
    let [a, b] = kind.map_or(["a", "b"], figures);
    let cause = Detector::from_number(event.cause).map(|detector| ("cause", detector.name().to_owned()));
    let figures = [(a, event.a), (b, event.b)].into_iter().filter(|(key, _)| !key.is_empty());
    let values: Vec<_> = figures.map(|(key, figure)| (key, figure.to_string())).chain(cause).collect();

    header(cdr, event.t, "");
    cdr.u32(1);
    cdr.u8(event.severity as u8);
    cdr.string(&name);
    cdr.string(&values.iter().map(|(key, value)| format!("{key} {value}")).collect::<Vec<_>>().join(", "));
    cdr.string("");
    cdr.u32(values.len() as u32);
    for (key, value) in &values {
        cdr.string(key);
        cdr.string(value);
    }
}

/// What the two figures of an event are; empty: the kind has none there.
const fn figures(kind: EventKind) -> [&'static str; 2] {
    use EventKind::*;
    match kind {
        SegmentStart => ["segment", ""],
        TargetErrorLimit => ["acts", "axis"],
        TorqueLimit => ["acts", "joint"],
        SafetyState => ["from", "to"],
        Tare => ["force_z_n", ""],
        CommandRefused => ["epoch", "reason"],
        WatchdogExpired => ["", ""],
        AmplifierTrip => ["joint", ""],
        Diverged => ["joint", "value"],
        FirstContact => ["speed_m_per_s", ""],
        BusError => ["job", "address"],
        MessageLost => ["sequence", ""],
        ForceSaturated => ["errors", ""],
        RecordLost => ["errno", ""],
        BoardLost | BoardUp => ["board", ""],
        OverrunTrip => ["job", "task"],
        FaultInjected => ["fault", ""],
        Detected => ["figure", ""],
    }
}
