//! The board: turns what it hears into messages, for the record and for the digest.

use crate::cdr::Cdr;
use crate::digest::Digest;
use crate::encode;
use crate::record::{Lost, Record};
use crate::robot;
use crate::topics::{TOPICS, Topic};
use arm::rotation;
use board::{Board, Inputs, Ns, Outputs};
use messages::{ControlProbe, Event, EventKind, JOINTS, PlantProbe, Severity};
use scenario::Scenario;
use std::collections::BTreeMap;
use std::path::Path;

/// Bus analyzer card: records everything that is said in simulated time.
///
/// It writes a file, computes the digest, both, or neither, in which case a step costs nothing. A file
/// that cannot be written any more (disk full) is given up: see [`BusAnalyzer::lost`].
pub struct BusAnalyzer {
    record: Option<Record>,
    lost: Option<Lost>,
    digest: Option<Digest>,
    cdr: Cdr,
    sequence: [u32; TOPICS.len()],
    events: Vec<Event>,
    joints: [String; JOINTS],
    masters: Vec<String>,
    urdf: String,
    base_link: String,
    task_position: [f64; 3],
    task_orientation: [f64; 4],
}

impl BusAnalyzer {
    /// A recorder that writes to `path`, where given. `resolved_toml` is attached to the record. The
    /// error says which file and why.
    pub fn new(scenario: &Scenario, path: Option<&Path>, resolved_toml: &str) -> Result<BusAnalyzer, String> {
        let description = robot::describe(scenario)?;
        let frame = scenario.task_frame();
        let record = match path {
            Some(path) => Some(
                Record::create(path, resolved_toml, metadata(scenario))
                    .map_err(|error| format!("record {}: {}", path.display(), reason(&error)))?,
            ),
            None => None,
        };
        Ok(BusAnalyzer {
            record,
            lost: None,
            digest: None,
            cdr: Cdr::default(),
            sequence: [0; TOPICS.len()],
            events: Vec::with_capacity(64),
            joints: scenario.controller_arm()?.joint_names().clone(),
            masters: masters(scenario),
            urdf: description.urdf,
            base_link: description.base_link,
            task_position: frame.p.into(),
            task_orientation: rotation::quaternion(&frame.r).into(),
        })
    }

    /// The same, which also computes the digest on the way.
    pub fn with_digest(mut self) -> BusAnalyzer {
        self.digest = Some(Digest::default());
        self
    }

    /// Digest of everything heard so far, equal to that of the file; `None` where it was not asked for,
    /// or where a message came a whole window late and can no longer be put in order.
    pub fn digest(&self) -> Option<String> {
        self.digest.as_ref().and_then(Digest::finish)
    }

    /// Why the record ended before the run; `None` while all is well.
    pub fn lost(&self) -> Option<&Lost> {
        self.lost.as_ref()
    }

    fn describe(&mut self, t: Ns) {
        self.cdr.begin();
        self.cdr.string(&self.urdf);
        self.emit(Topic::RobotDescription, t);
        self.cdr.begin();
        let task = (&self.task_position, &self.task_orientation);
        encode::transforms(&mut self.cdr, t, &self.base_link, &[(encode::TASK_FRAME, task)]);
        self.emit(Topic::TfStatic, t);
    }

    fn plant(&mut self, probe: &PlantProbe) {
        let t = probe.t;
        self.cdr.begin();
        encode::joint_state(&mut self.cdr, t, &self.joints, &probe.q, &probe.qd, &probe.spring_torque);
        self.emit(Topic::PlantJointStates, t);
        self.cdr.begin();
        encode::wrench_stamped(&mut self.cdr, t, &probe.contact);
        self.emit(Topic::PlantContact, t);
        self.cdr.begin();
        encode::pose_stamped(&mut self.cdr, t, (&probe.position, &probe.orientation));
        self.emit(Topic::PlantTool, t);
        self.cdr.begin();
        encode::plant_state(&mut self.cdr, probe);
        self.emit(Topic::PlantState, t);
    }

    fn control(&mut self, probe: &ControlProbe) {
        let t = probe.t;
        let tool = (&probe.x, &probe.x_orientation);
        let target = (&probe.xt, &probe.xt_orientation);
        let desired = (&probe.xd, &probe.xd_orientation);
        self.cdr.begin();
        encode::joint_state(&mut self.cdr, t, &self.joints, &probe.q, &probe.qd, &probe.torque);
        self.emit(Topic::JointStates, t);
        self.cdr.begin();
        encode::wrench_stamped(&mut self.cdr, t, &probe.fe);
        self.emit(Topic::Wrench, t);
        for (topic, pose) in [(Topic::Tool, tool), (Topic::Target, target), (Topic::Desired, desired)] {
            self.cdr.begin();
            encode::pose_stamped(&mut self.cdr, t, pose);
            self.emit(topic, t);
        }
        self.cdr.begin();
        let frames = [("tool", tool), ("target", target), ("desired", desired)];
        encode::transforms(&mut self.cdr, t, encode::TASK_FRAME, &frames);
        self.emit(Topic::Tf, t);
        self.cdr.begin();
        encode::control_state(&mut self.cdr, probe);
        self.emit(Topic::ControlState, t);
    }

    /// Events of several boards come in no particular order: their content orders them.
    fn happened(&mut self, events: &[Event]) {
        let mut sorted = std::mem::take(&mut self.events);
        sorted.clear();
        sorted.extend_from_slice(events);
        sorted
            .sort_unstable_by_key(|e| (e.t, e.kind, e.severity, e.cause, e.a.to_bits(), e.b.to_bits()));
        for event in &sorted {
            self.cdr.begin();
            encode::event(&mut self.cdr, event);
            self.emit(Topic::Events, event.t);
        }
        self.events = sorted;
    }

    fn emit(&mut self, topic: Topic, t: Ns) {
        let sequence = self.sequence[topic as usize];
        self.sequence[topic as usize] += 1;
        let cdr = self.cdr.bytes();
        if let Some(digest) = &mut self.digest {
            digest.push(topic, t, sequence, cdr);
        }
        if let Some(record) = &mut self.record
            && let Err(error) = record.write(topic, t, sequence, cdr)
        {
            self.give_up(t, &error);
        }
    }

    fn give_up(&mut self, at: Ns, error: &mcap::McapError) {
        self.record = None;
        self.lost = Some(Lost { at, reason: reason(error), errno: errno(error) });
    }
}

impl Board for BusAnalyzer {
    fn step(&mut self, _now: Ns, inputs: &Inputs, out: &mut Outputs) {
        if self.record.is_none() && self.digest.is_none() {
            return;
        }
        let recorded = self.record.is_some();
        if let Some(digest) = &mut self.digest {
            digest.advance(inputs.from);
        }
        if inputs.boot {
            self.describe(inputs.until);
        }
        let mail = &inputs.mail;
        for probe in &mail.plant_probe {
            self.plant(probe);
        }
        for probe in &mail.control_probe {
            self.control(probe);
        }
        self.happened(&mail.events);
        for used in &mail.masters {
            let name = self.masters.get(used.master as usize).map_or("", String::as_str);
            self.cdr.begin();
            encode::master_use(&mut self.cdr, used, name);
            self.emit(Topic::Masters, used.t);
        }
        for path in &mail.paths {
            self.cdr.begin();
            encode::latency(&mut self.cdr, path);
            self.emit(Topic::Latency, path.t);
        }
        self.cdr.begin();
        encode::transfers(&mut self.cdr, inputs.from, inputs.until, &mail.transfers);
        self.emit(Topic::Transfers, inputs.until);
        if inputs.finish
            && let Some(record) = self.record.take()
            && let Err(error) = record.finish()
        {
            self.give_up(inputs.until, &error);
        }
        if recorded && let Some(lost) = &self.lost {
            let errno = f64::from(lost.errno);
            out.mail.events.push(Event::new(lost.at, EventKind::RecordLost, Severity::Error, errno, 0.0));
        }
    }
}

/// Masters on the bus, as the timing plane numbers them.
fn masters(scenario: &Scenario) -> Vec<String> {
    let timing = vme::Timing::new(scenario.rack.clone());
    let name = |timing: &vme::Timing| (0..).map_while(|i| timing.master_name(i).map(str::to_owned)).collect();
    timing.as_ref().map(name).unwrap_or_default()
}

fn metadata(scenario: &Scenario) -> BTreeMap<String, String> {
    let cards: Vec<_> = scenario.rack.slaves.iter().map(|slave| slave.name.as_str()).collect();
    let tasks: Vec<_> = scenario.rack.tasks.iter().map(|task| task.name.as_str()).collect();
    BTreeMap::from([
        ("title".into(), scenario.title.clone()),
        ("seed".into(), scenario.seed.to_string()),
        ("duration_ns".into(), scenario.duration_ns().to_string()),
        ("vmerack".into(), env!("CARGO_PKG_VERSION").into()),
        ("cards".into(), cards.join(",")),
        ("tasks".into(), tasks.join(",")),
    ])
}

/// The operating system's number for it; 0 where the error does not come from there.
fn errno(error: &mcap::McapError) -> i32 {
    match error {
        mcap::McapError::Io(error) => error.raw_os_error().unwrap_or(0),
        _ => 0,
    }
}

/// The operating system's own words, where the error comes from there.
fn reason(error: &mcap::McapError) -> String {
    match error {
        mcap::McapError::Io(error) => error.to_string(),
        error => error.to_string(),
    }
}
