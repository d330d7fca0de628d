//! From register contents to joint angles, speeds and the sensor's wrench.
//!
//! Counters wrap: they are unwrapped from job to job, starting from the posture that homing has left. A word that does not
//! come (BERR*, a lost message), or force words under an error of the receiver, leave the last value in place; how many
//! jobs in a row a value has been held is counted; what that means is judged in [`judgement`]. A word that comes
//! a job late is better than none: it is used, and counted too.

mod judgement;

use crate::clocks::CARDS as CARDS_THAT_STAMP;
use crate::force_noise::ForceNoise;
use crate::program::{CARDS, COUNTER, COUNTS, ERRORS, FORCES, READS, STATUS, is_wide};
use arm::{JointVector, Spatial};
use messages::registers::{encoder, force};
use messages::{BusWord, Detector, JOINTS};
use scenario::{ForceFilter, Scenario, nanoseconds};
use vme::Ns;

/// Errors of the receiver under which its force words mean nothing. At full scale they mean too little: fed forward, the
/// clipped force of a bridge that has failed would push the tool into its surface.
const FORCE_INVALID: u32 = (force::ERROR_SATURATED
    | force::ERROR_MEMORY
    | force::ERROR_SENSOR_CHANGE
    | force::ERROR_BUSY
    | force::ERROR_CRC
    | force::ERROR_WATCHDOG) as u32;

/// Samples by which the receiver's counter may be ahead of its stamps: their clock may be slow.
const FORCE_AHEAD: u16 = 4096;

/// Bits of the six force words among those that came.
const FORCE_WORDS: u32 = 0x3F << FORCES;

/// What a job knows of the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensed {
    /// Motor-side joint angles θ/N (rad).
    pub q: JointVector,
    /// Motor-side joint speeds (rad/s).
    pub qd: JointVector,
    /// Wrench at the sensor, sensor axes, moment about its origin (N, Nm).
    pub wrench: Spatial,
}

/// Registers of all sensors, as far as the jobs have read them.
#[derive(Clone, Debug)]
pub struct Sensors {
    /// Words of the job under way.
    words: [BusWord; READS],
    /// Register that each access of a job reads.
    registers: Vec<usize>,
    /// Bit i: word i came in this job and is valid.
    came: u32,
    /// Of those that came, the words that cannot be true, and why.
    refused: u32,
    /// Why the words that did not come in the job under way did not: what the bus, and the messages, say of it.
    why: [Option<Detector>; READS],
    lost: Option<Detector>,
    /// The last job's, as far as they are held.
    why_held: [Detector; READS],
    /// Jobs in a row that had to do with words of an earlier one.
    late_jobs: u32,
    /// Jobs in a row in which word i did not come.
    held: [u32; READS],
    /// Unwrapped counts.
    counts: [i64; JOINTS],
    counts_at: [Ns; JOINTS],
    counter_bits: u32,
    counts_per_rad: JointVector,
    sensed: Sensed,
    force_scale: Spatial,
    wide_force: bool,
    force_period_ns: u64,
    force_published: Ns,
    /// What the clocks behind the stamps are known to be behind, ns: encoders, force sensor, D/A and parallel I/O.
    clocks_behind: [i64; CARDS_THAT_STAMP],
    max_force_age: Ns,
    old_force_jobs: u32,
    same_force_jobs: u32,
    status: u32,
    /// Status of the encoder cards in this job; 0 where it did not come.
    cards: [u32; READS - CARDS],
    /// The receiver's error word in this job; 0 where it did not come.
    errors: u32,
    limits: scenario::Safety,
    noise: ForceNoise,
    force_begun: bool,
}

impl Sensors {
    /// Sensors of an arm at its initial posture, read by a task whose accesses go to these registers.
    pub fn new(scenario: &Scenario, registers: &[usize]) -> Result<Sensors, String> {
        let drives = scenario.drives()?;
        let counts_per_rad = drives.each(|drive| drive.counts_per_rad());
        let posture = scenario.initial_posture()?;
        let receiver = &scenario.force_sensor_if;
        let (force_period_ns, force_delay_ns) = match receiver.filter {
            ForceFilter::Cascade(n) => (125_000 << (2 * u32::from(n)), 0),
            ForceFilter::DelayMs(ms) => (125_000, nanoseconds(ms * 1e-3)),
        };
        let full_scale =
            Spatial::from_fn(|axis, _| if axis < 3 { receiver.full_scale_n } else { receiver.full_scale_nm });
        Ok(Sensors {
            words: [BusWord { t: 0, addr: 0, value: 0, job: 0, task: 0, index: 0 }; READS],
            registers: registers.to_vec(),
            came: 0,
            refused: 0,
            why: [None; READS],
            lost: None,
            why_held: [Detector::Sequence; READS],
            late_jobs: 0,
            held: [0; READS],
            counts: std::array::from_fn(|i| (posture[i] * counts_per_rad[i]).floor() as i64),
            counts_at: [0; JOINTS],
            counter_bits: scenario.encoder_if.counter_bits.into(),
            counts_per_rad,
            sensed: Sensed { q: posture, qd: JointVector::zeros(), wrench: Spatial::zeros() },
            force_scale: full_scale / receiver.full_scale_counts,
            wide_force: is_wide(scenario),
            force_period_ns,
            force_published: 0,
            clocks_behind: [0; CARDS_THAT_STAMP],
            max_force_age: force_period_ns + force_delay_ns + nanoseconds(scenario.safety.max_force_age_ms * 1e-3),
            old_force_jobs: 0,
            same_force_jobs: 0,
            status: 0,
            cards: [0; READS - CARDS],
            errors: 0,
            limits: scenario.safety.clone(),
            noise: ForceNoise::new(),
            force_begun: false,
        })
    }

    /// Takes the answer to a read of a job; one of an older job than what is there comes too late.
    pub fn take(&mut self, word: &BusWord) {
        let Some(&index) = self.registers.get(usize::from(word.index)) else { return };
        if self.has(index) && is_older(word.job, self.words[index].job) {
            return;
        }
        self.words[index] = *word;
        self.came |= 1 << index;
    }

    /// The job's access of that number has ended without data; the detector says why.
    pub fn failed(&mut self, access: u16, why: Detector) {
        if let Some(&index) = self.registers.get(usize::from(access)) {
            self.why[index] = Some(why);
        }
    }

    /// A message with words of the job under way was discarded, is known to be missing, or may come late; the first reason
    /// counts.
    pub fn lost(&mut self, why: Detector) {
        self.lost.get_or_insert(why);
    }

    /// When the cards stamped what the last job read afresh: encoders, force sensor, D/A and parallel I/O.
    pub fn stamps(&self) -> [Option<Ns>; CARDS_THAT_STAMP] {
        [COUNTS, FORCES, STATUS].map(|index| (self.held[index] == 0).then_some(self.words[index].t).filter(|t| *t > 0))
    }

    /// The cards' clocks are so much behind from now on, in the order of [`Sensors::stamps`], ns.
    pub fn set_clocks(&mut self, behind: [i64; CARDS_THAT_STAMP]) {
        self.clocks_behind = behind;
    }

    /// Decodes the words of `job`, which begins `period_s` after the one before.
    pub fn read(&mut self, job: u32, period_s: f64) {
        let of = |these: &dyn Fn(u32) -> bool| {
            let such = |index: &&usize| self.has(**index) && these(self.words[**index].job);
            self.registers.iter().filter(such).fold(0, |bits, index| bits | 1 << index)
        };
        let early = of(&|other| is_older(job, other));
        let late = of(&|other| is_older(other, job));
        self.came &= !early;
        count(&mut self.late_jobs, late != 0);
        self.errors = if self.has(ERRORS) { self.words[ERRORS].value } else { 0 };
        if self.errors & FORCE_INVALID != 0 {
            self.came &= !FORCE_WORDS;
        }
        self.refused = 0;
        for joint in 0..JOINTS {
            self.read_encoder(joint, period_s);
        }
        self.read_force();
        if self.has(STATUS) {
            self.status = self.words[STATUS].value;
        }
        for card in CARDS..READS {
            self.cards[card - CARDS] = if self.has(card) { self.words[card].value } else { 0 };
        }
        for &index in &self.registers {
            let taken = (self.came & !self.refused) >> index & 1 == 1;
            self.held[index] = if taken { 0 } else { self.held[index].saturating_add(1) };
            self.why_held[index] = self.why_held(index);
        }
        self.came = early;
        (self.why, self.lost) = ([None; READS], None);
    }

    /// Angles, speeds and wrench after the last [`Sensors::read`].
    pub fn sensed(&self) -> &Sensed {
        &self.sensed
    }

    /// Why the word that is held was not taken.
    fn why_held(&self, index: usize) -> Detector {
        let invalid = self.errors & FORCE_INVALID;
        if self.refused >> index & 1 == 1 {
            return if index < FORCES { Detector::EncoderJump } else { Detector::ForceSlew };
        }
        match 1 << index & FORCE_WORDS != 0 && invalid != 0 {
            true if invalid & !u32::from(force::ERROR_SATURATED) == 0 => Detector::ForceFullScale,
            true => Detector::ForceErrorWord,
            // without a failed access the cards have answered, and a message is missing
            false => self.why[index].or(self.lost).unwrap_or(Detector::Sequence),
        }
    }

    /// Age of the force sample at `now`: since its filter's output was published. The receiver's counter numbers the
    /// multiples of the filter's period, modulo 2¹⁶; behind a pure delay it numbers the samples that come out.
    pub fn force_age(&self, now: Ns) -> Ns {
        now.saturating_sub(self.force_published)
    }

    /// Age of the oldest count at `now`.
    pub fn encoder_age(&self, now: Ns) -> Ns {
        now.saturating_sub(self.counts_at.into_iter().min().unwrap_or(0))
    }

    fn has(&self, index: usize) -> bool {
        self.came & (1 << index) != 0
    }

    fn read_encoder(&mut self, joint: usize, period_s: f64) {
        let at = COUNTS + 2 * joint;
        if self.has(at + 1) {
            let counts_per_s = f64::from(self.words[at + 1].value as i32) * encoder::VELOCITY_LSB;
            self.sensed.qd[joint] = counts_per_s / self.counts_per_rad[joint];
        }
        if self.has(at) {
            let word = &self.words[at];
            let unused = 32 - self.counter_bits;
            // difference to the last reading, sign-extended from the counter's width
            let turned = (word.value.wrapping_sub(self.counts[joint] as u32) << unused) as i32;
            let turned = i64::from(turned >> unused);
            if self.jumps(joint, turned, period_s) {
                self.refused |= 1 << at;
                return;
            }
            self.counts[joint] += turned;
            self.counts_at[joint] = word.t.saturating_add_signed(self.clocks_behind[0]);
            self.sensed.q[joint] = self.counts[joint] as f64 / self.counts_per_rad[joint];
        }
    }

    /// Whether a joint cannot have turned by so many counts since its last count was taken.
    fn jumps(&self, joint: usize, turned: i64, period_s: f64) -> bool {
        let (limit, at) = (self.limits.max_count_jump_rad, COUNTS + 2 * joint);
        let expected = self.sensed.qd[joint] * period_s * f64::from(self.held[at] + 1);
        // after a card that was silent for long nobody knows how far the joint went while it was stopped
        if self.held[at] > self.limits.max_held_jobs && self.why_held[at] != Detector::EncoderJump {
            return false;
        }
        // where a joint stands when the power comes on is not known so well
        self.counts_at[joint] > 0
            && limit > 0.0
            && (turned as f64 / self.counts_per_rad[joint] - expected).abs() > limit
    }

    fn read_force(&mut self) {
        let before = self.sensed.wrench;
        let mut wrench = before;
        for axis in 0..6 {
            let at = FORCES + axis;
            if self.has(at) {
                let value = self.words[at].value;
                let counts = if self.wide_force { f64::from(value as i32) } else { f64::from(value as u16 as i16) };
                wrench[axis] = counts * self.force_scale[axis];
            }
        }
        self.take_force(wrench);
        if self.has(COUNTER) {
            let word = &self.words[COUNTER];
            let read_at = word.t.saturating_add_signed(self.clocks_behind[1]);
            let newest = read_at / self.force_period_ns;
            let lag = (newest as u16).wrapping_sub(word.value as u16);
            let ahead = lag.wrapping_neg();
            let number =
                if ahead < FORCE_AHEAD { newest + u64::from(ahead) } else { newest.saturating_sub(lag.into()) };
            self.force_published = number.saturating_mul(self.force_period_ns);
            let old = self.force_age(read_at) > self.max_force_age;
            count(&mut self.old_force_jobs, old);
        }
        if self.came & FORCE_WORDS == FORCE_WORDS {
            count(&mut self.same_force_jobs, wrench == before);
        }
    }

    /// Takes a wrench that a contact can have caused. After more refused ones than may be held it is the new truth, and the
    /// arm is held by then.
    fn take_force(&mut self, wrench: Spatial) {
        let slew = self.limits.max_force_slew_n;
        let change = wrench - self.sensed.wrench;
        let leaps = (0..6).any(|axis| change[axis].abs() > if axis < 3 { slew } else { 0.1 * slew });
        if slew > 0.0 && self.force_begun && leaps && self.held[FORCES] <= self.limits.max_held_jobs {
            self.refused |= self.came & FORCE_WORDS;
            return;
        }
        if self.came & FORCE_WORDS == FORCE_WORDS {
            self.force_begun = true;
            self.noise.push(&wrench);
        }
        self.sensed.wrench = wrench;
    }
}

/// Whether job `a` comes before job `b`.
fn is_older(a: u32, b: u32) -> bool {
    (a.wrapping_sub(b) as i32) < 0
}

/// Counts how often in a row something was so.
fn count(times: &mut u32, again: bool) {
    *times = if again { times.saturating_add(1) } else { 0 };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::findings::Findings;
    use crate::safety::State;

    /// Sensors of a task that reads every register.
    pub(super) fn all(scenario: &Scenario) -> Sensors {
        Sensors::new(scenario, &(0..READS).collect::<Vec<_>>()).unwrap()
    }

    pub(super) fn scenario(overrides: &[&str]) -> Scenario {
        let overrides: Vec<String> = overrides.iter().map(|o| o.to_string()).collect();
        scenario::load("table-5-3", &overrides).unwrap().scenario().unwrap()
    }

    /// What the sensors demand, and because of what.
    pub(super) fn demanded(sensors: &Sensors) -> (State, Option<Detector>) {
        let mut findings = Findings::new();
        sensors.report(&mut findings);
        findings.demanded()
    }

    pub(super) fn word(job: u32, index: usize, value: u32, t: Ns) -> BusWord {
        BusWord { t, addr: 0, value, job, task: 0, index: index as u16 }
    }

    /// All words of a job: these counts, zero elsewhere.
    pub(super) fn give(sensors: &mut Sensors, job: u32, counts: [i64; JOINTS], t: Ns) {
        for index in 0..READS {
            let value = match index {
                i if i < FORCES && i % 2 == 0 => {
                    // sign-extended from 24 bits, as the card shows it
                    ((counts[i / 2] as i32) << 8 >> 8) as u32
                }
                _ => 0,
            };
            sensors.take(&word(job, index, value, t));
        }
    }

    #[test]
    fn counters_are_unwrapped_both_ways_from_the_posture_that_homing_left() {
        let scenario = scenario(&["safety.max_count_jump_rad=0.0"]);
        let mut sensors = all(&scenario);
        let mut counts = sensors.counts;
        // 24 bits wrap every 2²⁴ counts: go round twice forwards, then back
        for job in 0..100 {
            let way = if job < 50 { 700_000 } else { -1_400_000 };
            counts = counts.map(|count| count + way);
            give(&mut sensors, job, counts, 1000);
            sensors.read(job, 5e-3);
            for (joint, &count) in counts.iter().enumerate() {
                let q = count as f64 / sensors.counts_per_rad[joint];
                assert_eq!(sensors.sensed().q[joint], q);
            }
        }
        assert!(counts[0] < -(1 << 24));
    }

    #[test]
    fn speeds_and_forces_are_scaled_and_keep_their_sign() {
        let scenario = scenario(&[]);
        let mut sensors = all(&scenario);
        let counts = sensors.counts;
        give(&mut sensors, 0, counts, 0);
        sensors.take(&word(0, COUNTS + 3, (-2048i32) as u32, 0));
        sensors.take(&word(0, FORCES + 2, u32::from((-8192i16) as u16), 0));
        sensors.take(&word(0, FORCES + 5, 4096, 0));
        sensors.read(0, 5e-3);
        let sensed = sensors.sensed();
        assert_eq!(sensed.qd[1], -2.0 / sensors.counts_per_rad[1]);
        // full scales 400 N and 40 Nm at 16384 counts
        assert_eq!((sensed.wrench[2], sensed.wrench[5]), (-200.0, 10.0));
    }

    #[test]
    fn a_word_that_does_not_come_leaves_the_last_value_and_is_counted() {
        let mut sensors = all(&scenario(&[]));
        let counts = sensors.counts;
        give(&mut sensors, 0, counts.map(|c| c + 10), 0);
        sensors.read(0, 5e-3);
        assert_eq!(demanded(&sensors).0, State::Run);
        let before = *sensors.sensed();
        for job in 1..=3 {
            for index in (0..READS).filter(|&index| index != COUNTS + 4) {
                let is_count = index < FORCES && index % 2 == 0;
                let value = if is_count { (counts[index / 2] + 10) as u32 } else { 0 };
                sensors.take(&word(job, index, value, 0));
            }
            sensors.read(job, 5e-3);
            assert_eq!(demanded(&sensors), (State::Degraded, Some(Detector::Sequence)));
            assert_eq!(sensors.sensed().q[2], before.q[2]);
        }
        give(&mut sensors, 5, counts, 0);
        sensors.read(4, 5e-3);
        assert_eq!(demanded(&sensors).0, State::Stop, "nothing came in job 4");
        sensors.read(5, 5e-3);
        assert_eq!(demanded(&sensors).0, State::Run, "they were early");
    }

    #[test]
    fn without_an_answer_or_a_grant_the_arm_is_stopped_at_once() {
        for why in [Detector::BusError, Detector::AccessTimer] {
            let mut sensors = all(&scenario(&[]));
            let counts = sensors.counts;
            for (job, sound, demand) in [(0, true, State::Run), (1, false, State::Stop), (2, true, State::Run)] {
                give(&mut sensors, job, counts, 0);
                if !sound {
                    sensors.came &= !(1 << STATUS);
                    sensors.failed(STATUS as u16, why);
                }
                sensors.read(job, 5e-3);
                assert_eq!(demanded(&sensors), (demand, (!sound).then_some(why)), "{job}");
            }
        }
    }

    #[test]
    fn words_that_come_a_job_late_are_used_and_hold_the_arm_when_it_goes_on() {
        let mut sensors = all(&scenario(&[]));
        let counts = sensors.counts;
        for job in 0..6 {
            // those of the job before, and one of the job before that
            give(&mut sensors, job, counts.map(|count| count + i64::from(job)), 0);
            sensors.take(&word(job.wrapping_sub(1), COUNTS, 0, 0));
            sensors.read(job + 1, 5e-3);
            let state = if job < 3 { State::Degraded } else { State::Hold };
            assert_eq!(demanded(&sensors), (state, Some(Detector::MessageAge)), "{job}");
            assert_eq!(sensors.counts, counts.map(|count| count + i64::from(job)));
        }
        give(&mut sensors, 7, counts, 0);
        sensors.read(7, 5e-3);
        assert_eq!(demanded(&sensors).0, State::Run);
    }

    #[test]
    fn under_a_receiver_error_or_saturation_the_force_is_held() {
        let mut sensors = all(&scenario(&["safety.max_force_slew_n=0.0"]));
        let counts = sensors.counts;
        let why = |detector| (State::Degraded, Some(detector));
        for (job, errors, force, expected) in [
            (0, 0, 100.0, (State::Run, None)),
            (1, u32::from(force::ERROR_CRC), 100.0, why(Detector::ForceErrorWord)),
            (2, u32::from(force::ERROR_CRC), 100.0, why(Detector::ForceErrorWord)),
            (3, 1 << 2, 100.0, why(Detector::ForceFullScale)),
            (4, 0, 100.0 + 800.0 / 3.0, (State::Run, None)),
        ] {
            give(&mut sensors, job, counts, 0);
            let newtons = f64::from(job) * 100.0 / 3.0 * 2.0 + 100.0;
            sensors.take(&word(job, FORCES, (newtons / 400.0 * 16384.0) as u32, 0));
            sensors.take(&word(job, ERRORS, errors, 0));
            sensors.read(job, 5e-3);
            assert!((sensors.sensed().wrench[0] - force).abs() < 0.05, "{job}");
            assert_eq!(demanded(&sensors), expected);
        }
    }

    #[test]
    fn the_age_of_a_force_sample_follows_from_its_counter_across_its_wrap() {
        // filter 4 publishes every 32 ms; its counter wraps after 2097 s
        let mut sensors = all(&scenario(&["force_sensor_if.filter={ cascade = 4 }"]));
        let counts = sensors.counts;
        for (job, (t, published)) in
            [(70_000_000, 64_000_000), (2_097_200_000_000, 2_097_184_000_000)].into_iter().enumerate()
        {
            give(&mut sensors, job as u32, counts, t);
            let counter = (published / 32_000_000) as u16;
            sensors.take(&word(job as u32, COUNTER, counter.into(), t));
            sensors.read(job as u32, 5e-3);
            assert_eq!(sensors.force_age(t + 1000), t + 1000 - published);
            assert_eq!(sensors.encoder_age(t + 1000), 1000);
        }
    }

    #[test]
    fn a_receiver_whose_clock_is_slow_or_fast_shows_no_old_samples() {
        let mut sensors = all(&scenario(&[]));
        let counts = sensors.counts;
        for (job, stamp, behind) in
            [(0, 99_999_000, 0), (1, 97_000_000, 0), (2, 97_000_000, 3_000_000), (3, 103_000_000, 0)]
        {
            sensors.set_clocks([0, behind, 0]);
            give(&mut sensors, job, counts, stamp);
            sensors.take(&word(job, COUNTER, 100_000_000 / 125_000, stamp));
            sensors.read(job, 5e-3);
            assert_eq!(demanded(&sensors).0, State::Run, "{job}");
            assert_eq!(sensors.force_age(100_001_000), 1_000, "{job}");
        }
        // 20 ms fast and not set, then set
        for (job, behind, state) in [(4, 0, State::Hold), (5, -20_000_000, State::Run)] {
            sensors.set_clocks([0, behind, 0]);
            give(&mut sensors, job, counts, 120_000_000);
            sensors.take(&word(job, COUNTER, 100_000_000 / 125_000, 120_000_000));
            sensors.read(job, 5e-3);
            assert_eq!(demanded(&sensors).0, state, "{job}");
        }
    }

    #[test]
    fn a_count_that_jumps_further_than_the_joint_can_turn_is_refused_until_the_arm_is_stopped() {
        let mut sensors = all(&scenario(&[]));
        let counts = sensors.counts;
        give(&mut sensors, 0, counts, 1_000);
        sensors.read(0, 5e-3);
        let before = sensors.sensed().q[2];
        // 3 mrad where the joint stands still
        let mut jumped = counts;
        jumped[2] += (3e-3 * sensors.counts_per_rad[2]) as i64;
        for job in 1..=4 {
            give(&mut sensors, job, jumped, 1_000);
            sensors.read(job, 5e-3);
            let state = if job == 4 { State::Stop } else { State::Degraded };
            assert_eq!(demanded(&sensors), (state, Some(Detector::EncoderJump)), "{job}");
            assert_eq!(sensors.sensed().q[2], before);
        }
    }

    #[test]
    fn a_count_that_comes_after_a_long_silence_is_taken_as_it_is_and_one_refused_before_never() {
        let silent_for = |jobs: u32, refused: bool| {
            let mut sensors = all(&scenario(&[]));
            let counts = sensors.counts;
            give(&mut sensors, 0, counts, 1_000);
            sensors.read(0, 5e-3);
            let mut jumped = counts;
            jumped[2] += (3e-3 * sensors.counts_per_rad[2]) as i64;
            for job in 1..=jobs {
                if refused {
                    give(&mut sensors, job, jumped, 1_000);
                }
                sensors.read(job, 5e-3);
            }
            give(&mut sensors, jobs + 1, jumped, 1_000);
            sensors.read(jobs + 1, 5e-3);
            demanded(&sensors).0
        };
        // the arm stops after 3 jobs without a count
        assert_eq!(silent_for(3, false), State::Stop);
        assert_eq!(silent_for(4, false), State::Run);
        assert_eq!(silent_for(40, true), State::Stop, "the joint's zero is lost");
    }

    #[test]
    fn a_force_that_changes_faster_than_a_contact_is_refused_then_holds_the_arm_and_is_taken() {
        let mut sensors = all(&scenario(&[]));
        let counts = sensors.counts;
        let feed = |sensors: &mut Sensors, job: u32, newtons: f64| {
            give(sensors, job, counts, 0);
            sensors.take(&word(job, FORCES + 2, (newtons / 400.0 * 16384.0) as u32, 0));
            sensors.read(job, 5e-3);
            (sensors.sensed().wrench[2].round(), demanded(sensors))
        };
        assert_eq!(feed(&mut sensors, 0, 20.0), (20.0, (State::Run, None)));
        let refused = |state| (state, Some(Detector::ForceSlew));
        assert_eq!(feed(&mut sensors, 1, 150.0), (20.0, refused(State::Degraded)));
        assert_eq!(feed(&mut sensors, 2, 30.0), (30.0, (State::Run, None)), "one spike");
        for job in 3..=5 {
            assert_eq!(feed(&mut sensors, job, 150.0), (30.0, refused(State::Degraded)));
        }
        assert_eq!(feed(&mut sensors, 6, 150.0), (30.0, refused(State::Hold)));
        assert_eq!(feed(&mut sensors, 7, 150.0).0, 150.0);
    }
}
