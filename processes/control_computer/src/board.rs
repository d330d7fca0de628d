//! The control computer as a board: registers in, one control job, registers out.
//!
//! Everything that depends on the bus is here: which read answers what, when a command has arrived, what the dual-ported
//! RAM shows at which instant. A read that ends in BERR* leaves its word out, as a message that gets lost does; the sensors
//! then hold the last value. A job allocates nothing unless the list of its writes changes.

use crate::clocks::Clocks;
use crate::commands::{self, Refusal};
use crate::findings::Findings;
use crate::frame::quaternion_wxyz;
use crate::handover::Wanted;
use crate::output::Output;
use crate::pipeline::{Job, Mode, Pipeline};
use crate::program::{BusProgram, Part, Rest};
use crate::safety::State;
use crate::second_card::SecondCard;
use crate::sensors::Sensors;
use board::{Board, Inputs, Outputs};
use messages::{BoardId, Command, CommandKind, ControlProbe, Defect, DefectKind, Detector, Event, EventKind, Severity, Telemetry, TransferRecord, limits};
use scenario::Scenario;
use vme::Ns;

/// Commands that can be on their way at once.
const ON_THE_WAY: usize = 64;
/// Segment number before the first.
const NO_SEGMENT: u32 = u32::MAX;

/// Two processor cards: TG, AHIC, ERC, RR, inverse dynamics, safety. One of them runs it all, or they share it.
pub struct ControlComputer {
    task: u16,
    period_ns: Ns,
    limits: scenario::Safety,
    /// Period of the workstation's console, and when it polled last, where it has.
    console: (Ns, Option<Ns>),
    /// Activation number of the last job, and how many in a row began after a lost release.
    last_job: Option<u32>,
    late_jobs: u32,
    /// The task is released by an interrupt.
    interrupted: bool,
    clocks: Clocks,
    /// What was wrong with messages since the last job.
    defects: Vec<Defect>,
    program: BusProgram,
    sensors: Sensors,
    findings: Findings,
    pipeline: Pipeline,
    end: End,
    /// Safety state that the last job saw.
    state: State,
    /// Own clock at the last job.
    last: Option<Ns>,
    /// Commands posted whose write has not been carried out yet.
    on_the_way: Vec<Command>,
    /// Epoch of the last command judged.
    epoch: u32,
    /// No segment with a force axis has begun: the tool touches nothing; the force that the last job measured, N.
    free: bool,
    force_n: f64,
    /// The arm is to be held, and why.
    hold: Option<Detector>,
    acknowledge: bool,
    segment: u32,
    /// The last one that began.
    begun: u32,
    target_limited: u32,
    torque_limited: u32,
    /// State blocks of the last two jobs: the older one shows until the newer is written.
    telemetry: [Telemetry; 2],
}

/// Where the pipeline ends.
enum End {
    /// On the first card: the drives.
    Drives(Output),
    /// On the second one, which drives them. `told`: the hand-over is part of the job's program.
    SecondCard { card: Box<SecondCard>, told: bool },
}

impl ControlComputer {
    /// The control computer of this scenario. The message says what is wrong with rack, arm or drives.
    pub fn new(scenario: &Scenario) -> Result<ControlComputer, String> {
        let task =
            scenario.task_of("control_computer").ok_or("the rack has no task of the board `control_computer`")?;
        let nothing = Telemetry {
            t: 0,
            written: 0,
            epoch: 0,
            segment: NO_SEGMENT,
            state: State::Run as u32,
            heartbeat: 0,
            last: NO_SEGMENT,
            reserved: 0,
            last_start: 0,
            position: [0.0; 3],
            wrench: [0.0; 6],
        };
        let (part, end) = match scenario.second_control_task() {
            None => (Part::Whole, End::Drives(Output::new(scenario)?)),
            Some(second) => {
                let card = Box::new(SecondCard::new(scenario, task, second)?);
                (Part::Law, End::SecondCard { card, told: false })
            }
        };
        let program = BusProgram::new(scenario, part)?;
        Ok(ControlComputer {
            task,
            period_ns: scenario.rack.tasks[usize::from(task)].period_ns,
            limits: scenario.safety.clone(),
            console: (
                scenario.task_of("workstation").map_or(0, |task| scenario.rack.tasks[usize::from(task)].period_ns),
                None,
            ),
            last_job: None,
            late_jobs: 0,
            interrupted: matches!(scenario.rack.tasks[usize::from(task)].release, vme::rack::Release::Interrupt(_)),
            clocks: Clocks::new(&scenario.safety),
            defects: Vec::with_capacity(ON_THE_WAY),
            sensors: Sensors::new(scenario, program.sensors())?,
            program,
            findings: Findings::new(),
            pipeline: Pipeline::new(scenario)?,
            end,
            state: State::Run,
            last: None,
            on_the_way: Vec::with_capacity(ON_THE_WAY),
            epoch: 0,
            free: true,
            force_n: 0.0,
            hold: None,
            acknowledge: false,
            segment: NO_SEGMENT,
            begun: NO_SEGMENT,
            target_limited: 0,
            torque_limited: 0,
            telemetry: [nothing; 2],
        })
    }

    /// A transfer made to this board's dual-ported RAM.
    fn served(&mut self, transfer: &TransferRecord, out: &mut Outputs) {
        if let End::SecondCard { card, .. } = &mut self.end {
            card.served(transfer);
        }
        let end = transfer.addr.wrapping_add(transfer.n.wrapping_mul(transfer.access().width.bytes()));
        if transfer.is_read() {
            if transfer.addr == self.program.telemetry && transfer.is_ok() {
                self.console.1 = Some(transfer.data_at);
                let [older, newer] = &self.telemetry;
                let shown = if newer.written <= transfer.data_at { newer } else { older };
                out.mail.telemetry.push(Telemetry { t: transfer.data_at, ..*shown });
            }
        } else if end == self.program.command + size_of::<Command>() as u32 && !self.on_the_way.is_empty() {
            // the last word of a command block; one whose write failed is lost, and its epoch will be missed
            let command = self.on_the_way.remove(0);
            if transfer.is_ok()
                && let Err(refusal) = self.judge(&command)
            {
                let (epoch, reason) = (command.epoch.into(), f64::from(refusal as u32));
                let kind = EventKind::CommandRefused;
                let event = Event::new(transfer.data_at, kind, Severity::Warn, epoch, reason);
                out.mail.events.push(event.because(Some(refusal.detector())));
            }
        }
    }

    /// An access of an own task that ended without data: BERR*, or no grant.
    fn failed(&mut self, transfer: &TransferRecord, out: &mut Outputs) {
        let Some(why) = why_failed(transfer) else { return };
        let (sensors, findings) = match &mut self.end {
            _ if transfer.task == self.task => (&mut self.sensors, &mut self.findings),
            End::SecondCard { card, .. } if transfer.task == card.task() => card.bus_ends(),
            _ => return,
        };
        sensors.failed(transfer.index, why);
        if findings.notice(why, transfer.addr.into(), transfer.data_at, out) {
            let (job, address) = (transfer.job.into(), transfer.addr.into());
            let event = Event::new(transfer.data_at, EventKind::BusError, Severity::Warn, job, address);
            out.mail.events.push(event.because(Some(why)));
        }
    }

    fn judge(&mut self, command: &Command) -> Result<(), Refusal> {
        if command.epoch <= self.epoch {
            // whoever repeats an old command does not know how far the arm has come
            self.hold = Some(Detector::CommandEpoch);
        }
        if command.epoch != self.epoch + 1 {
            return Err(Refusal::Epoch);
        }
        self.epoch = command.epoch;
        match command.kind {
            kind if kind == CommandKind::Segment as u32 => {
                let segment = commands::segment(command)?;
                let trajectory = self.pipeline.trajectory();
                if self.hold.is_some() || self.state > State::Degraded {
                    return Err(Refusal::State);
                }
                // before the first job nobody knows where the tool is
                if self.last.is_some() {
                    commands::check_motion(&segment, &trajectory.last_target(), &self.limits)?;
                }
                if trajectory.last().is_some_and(|last| segment.start < last.start) {
                    return Err(Refusal::Times);
                }
                if !trajectory.has_room() {
                    return Err(Refusal::QueueFull);
                }
                trajectory.push(segment);
            }
            kind if kind == CommandKind::Hold as u32 => self.hold = Some(Detector::Operator),
            kind if kind == CommandKind::Acknowledge as u32 => self.acknowledge = true,
            _ => return Err(Refusal::Kind),
        }
        Ok(())
    }

    /// One job of the (first) control task at its decision, at `t` of simulated time and `now` of this board's clock.
    fn job(&mut self, job: u32, t: Ns, now: Ns, out: &mut Outputs) {
        let since = self.last.map_or(self.period_ns, |last| now.saturating_sub(last).max(1));
        let dt = since as f64 * 1e-9;
        self.sensors.read(job, dt);
        self.findings.begin();
        self.sensors.report(&mut self.findings);
        self.supervise(job, t, now);
        let state = self.decide_state(t, now, out);
        let mode = match state {
            State::Run | State::Degraded => Mode::Law,
            State::Hold => Mode::Hold,
            State::Stop => Mode::Brake,
            State::Off => Mode::Free,
        };
        self.last = Some(now);
        let sensed = self.sensors.sensed();
        let (done, written) = match &mut self.end {
            End::Drives(output) => {
                let done = self.pipeline.step(now, dt, sensed, mode);
                let written = output.write((self.task, job), (t, now), mode, &done.torque, &self.program, out);
                let torque = (mode != Mode::Free && output.carries(now)).then_some(done.torque);
                self.pipeline.inverse().sent(&sensed.qd, torque);
                (done, written)
            }
            End::SecondCard { card, told } => {
                let cut = card.ram().read().torque_limited;
                let done = self.pipeline.law_step(now, dt, sensed, mode, cut);
                let (demand, cause) = self.findings.demanded();
                let wanted = Wanted { demand, cause, acknowledge: self.acknowledge, ..done.wanted() };
                card.ram().post(job, wanted);
                if !std::mem::replace(told, true) {
                    out.rest = Some(self.program.hand_over());
                }
                (Job { torque: *card.torque(), ..done }, t + self.program.execution_ns(Rest::Run))
            }
        };
        (self.hold, self.acknowledge) = (None, false);
        self.free &= self.pipeline.trajectory().impedance().selection.iter().all(|s| *s == 1.0);
        self.force_n = done.contact.fe.fixed_rows::<3>(0).norm();
        self.tell(t, &done, out);
        out.mail.control_probe.push(self.probe(t, job, state, &done));
        let clear = match &mut self.end {
            End::Drives(output) => output.is_clear(),
            End::SecondCard { card, .. } => {
                card.ram().read().clear && self.findings.demanded().0 <= State::Degraded
            }
        };
        let last = self.pipeline.trajectory().last().map(|last| (last.index, last.start));
        let (last, last_start) = last.unwrap_or((NO_SEGMENT, 0));
        self.telemetry = [
            self.telemetry[1],
            Telemetry {
                t,
                written,
                epoch: self.epoch,
                segment: self.begun,
                state: state as u32 | if clear { Telemetry::CLEAR } else { 0 },
                heartbeat: job,
                last,
                reserved: 0,
                last_start,
                position: done.x.p.into(),
                wrench: done.contact.fe.into(),
            },
        ];
    }

    /// What is wrong beside the sensors' registers.
    fn supervise(&mut self, job: u32, t: Ns, now: Ns) {
        let Self { limits, findings, .. } = self;
        if let Some(cause) = self.hold {
            findings.report(cause, State::Hold, self.epoch.into());
        }
        for defect in self.defects.drain(..) {
            // commands are sent again, and a message that came twice does no harm
            let harmless = defect.from == BoardId::Workstation || defect.kind == DefectKind::Repeated;
            let demand = if harmless { State::Run } else { State::Degraded };
            findings.report(defect.detector(), demand, defect.figure);
        }
        if let Some(ppm) = self.clocks.compare(now, self.sensors.stamps()) {
            findings.report(Detector::ClockSlope, State::Run, ppm);
            self.sensors.set_clocks(self.clocks.behind());
        }
        let (period, polled) = self.console;
        if let Some(polled) = polled
            && limits.max_missed_polls > 0
            && t.saturating_sub(polled) > period * Ns::from(limits.max_missed_polls) + period / 2
        {
            findings.report(Detector::CommandAge, State::Hold, (t - polled) as f64 * 1e-9);
        }
        let lost = self.last_job.map_or(0, |last| job.wrapping_sub(last).saturating_sub(1));
        self.last_job = Some(job);
        self.late_jobs = if lost > 0 { self.late_jobs + 1 } else { 0 };
        if lost > 0 {
            let stop = limits.max_late_jobs > 0 && self.late_jobs > limits.max_late_jobs;
            let detector = if self.interrupted { Detector::MissedTick } else { Detector::Overrun };
            findings.report(detector, if stop { State::Stop } else { State::Degraded }, lost.into());
        }
        if let End::Drives(output) = &self.end {
            self.sensors.report_brakes(now, output.brakes(), findings);
            self.pipeline.inverse().report(limits, findings);
        }
        if limits.max_free_force_n > 0.0 && self.free && self.force_n > limits.max_free_force_n {
            findings.report(Detector::ForceZero, State::Stop, self.force_n);
        }
    }

    /// The safety state: decided here, or as the second card's state word says.
    fn decide_state(&mut self, t: Ns, now: Ns, out: &mut Outputs) -> State {
        let state = match &mut self.end {
            End::Drives(output) => {
                let speed = self.sensors.sensed().qd.amax();
                output.decide(t, now, &mut self.findings, speed, self.acknowledge, out)
            }
            End::SecondCard { card, .. } => {
                self.findings.tell(t, out);
                // what this card finds it need not wait for
                card.ram().read().state.max(self.findings.demanded().0)
            }
        };
        if state != self.state && state == State::Hold {
            self.pipeline.hold(self.sensors.sensed());
        }
        self.state = state;
        state
    }

    /// Events of a job: what began or ceased in it.
    fn tell(&mut self, t: Ns, job: &Job, out: &mut Outputs) {
        let segment = job.law.segment.unwrap_or(NO_SEGMENT);
        if segment != self.segment && segment != NO_SEGMENT {
            let kind = EventKind::SegmentStart;
            out.mail.events.push(Event::new(t, kind, Severity::Ok, segment.into(), 0.0));
            self.begun = segment;
        }
        self.segment = segment;
        if let Some(offset) = job.contact.tared {
            out.mail.events.push(Event::new(t, EventKind::Tare, Severity::Ok, offset[2], 0.0));
        }
        let mut edges = |kind, before: u32, after: u32| {
            for bit in (0..32).filter(|bit| (before ^ after) >> bit & 1 == 1) {
                let begins = after >> bit & 1;
                let severity = if begins == 1 { Severity::Warn } else { Severity::Ok };
                let event = Event::new(t, kind, severity, begins.into(), bit.into());
                out.mail.events.push(event);
            }
        };
        edges(EventKind::TargetErrorLimit, self.target_limited, job.law.target_limited);
        edges(EventKind::TorqueLimit, self.torque_limited, job.torque_limited);
        self.target_limited = job.law.target_limited;
        self.torque_limited = job.torque_limited;
    }

    fn probe(&self, t: Ns, job: u32, state: State, done: &Job) -> ControlProbe {
        let sensed = self.sensors.sensed();
        let Job { x, x_dot, law, .. } = done;
        let bit = |acted: bool, bit: u32| if acted { bit } else { 0 };
        ControlProbe {
            t,
            job,
            segment: self.segment,
            state: state as u32,
            limits: bit(law.target_limited != 0, limits::TARGET_ERROR)
                | bit(done.torque_limited != 0, limits::TORQUE)
                | bit(law.near_joint_limit, limits::JOINT_LIMIT),
            force_age: self.sensors.force_age(t),
            encoder_age: self.sensors.encoder_age(t),
            q: sensed.q.into(),
            qd: sensed.qd.into(),
            qdd: law.qdd.into(),
            torque: done.torque.into(),
            x: x.p.into(),
            x_orientation: quaternion_wxyz(&x.r),
            x_dot: (*x_dot).into(),
            xt: law.xt.pose.p.into(),
            xt_orientation: quaternion_wxyz(&law.xt.pose.r),
            xt_dot: law.xt.twist.into(),
            xt_ddot: law.xt.acceleration.into(),
            xd: law.xd.pose.p.into(),
            xd_orientation: quaternion_wxyz(&law.xd.pose.r),
            xr_ddot: law.xr_ddot.into(),
            fe: done.contact.fe.into(),
            fd: law.fd.into(),
        }
    }
}

/// What sees that a transfer has failed, where it has.
fn why_failed(transfer: &TransferRecord) -> Option<Detector> {
    match transfer.status {
        0 => None,
        1 => Some(Detector::BusError),
        _ => Some(Detector::AccessTimer),
    }
}

impl Board for ControlComputer {
    fn step(&mut self, now: Ns, inputs: &Inputs, out: &mut Outputs) {
        if inputs.boot && inputs.until > 0 {
            // powered up again in the middle of a run: the tool may touch
            self.pipeline.skip_tare();
            self.free = false;
            match &mut self.end {
                End::Drives(output) => output.latch(inputs.until, out),
                End::SecondCard { card, .. } => card.latch(inputs.until, out),
            }
        }
        if inputs.boot {
            out.programs.push((self.task, self.program.until_decision()));
            if let End::SecondCard { card, .. } = &self.end {
                out.programs.push((card.task(), card.program()));
            }
        }
        let now = self.clocks.corrected(now);
        for defect in &inputs.defects {
            if defect.from != BoardId::Workstation {
                self.sensors.lost(defect.detector());
            }
            if self.defects.len() < ON_THE_WAY {
                self.defects.push(*defect);
            }
        }
        if inputs.free_running && inputs.decision.is_some() {
            // no number says that what is missing is lost
            self.sensors.lost(Detector::MessageAge);
            if let End::SecondCard { card, .. } = &mut self.end {
                card.lost(Detector::MessageAge);
            }
        }
        for word in &inputs.mail.words {
            match &mut self.end {
                _ if word.task == self.task => self.sensors.take(word),
                End::SecondCard { card, .. } if word.task == card.task() => card.take(word),
                _ => {}
            }
        }
        for command in &inputs.mail.commands {
            if self.on_the_way.len() == ON_THE_WAY {
                // its write never came: the workstation stopped half-way
                self.on_the_way.remove(0);
            }
            self.on_the_way.push(*command);
        }
        for transfer in &inputs.transfers {
            self.failed(transfer, out);
            self.served(transfer, out);
        }
        if let Some(decision) = inputs.decision {
            match &mut self.end {
                _ if decision.task == self.task => self.job(decision.job, inputs.until, now, out),
                End::SecondCard { card, .. } if decision.task == card.task() => {
                    card.job(decision.job, inputs.until, now, out);
                }
                _ => {}
            }
        }
    }
}
