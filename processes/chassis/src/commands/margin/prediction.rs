//! What theory has to say about a scenario's loop: which closed form applies, and how far away its boundary is.
//!
//! Only one-axis loops (`robot = "slide"`) have one. The impedance is that of the last segment along the report's axis.
//! Delays are those of the scenario and, from sampling to torque, the rack's own: the first jobs are run and measured.

use crate::rack_run::listen;
use board::{Mail, Ns};
use messages::registers::{da, encoder};
use pacing::{Flow, Observer};
use scenario::{ForceFilter, Robot, Scenario, Scheme};
use stability::cascade::Filter;
use stability::{Bound, Impedance, SampledWall, effective_delay};
use vme::Log;

/// Jobs of the control task that are looked at.
const JOBS: u64 = 6;

/// A loop that theory knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loop {
    /// Original AHIC on an impedance axis, position and speed equally late: (6.2.7).
    BothLate {
        /// ω_n, rad/s.
        omega_n: f64,
        /// ζ.
        zeta: f64,
        /// 2T_s: cards' delay, sampling to torque, half a period (s).
        delay: f64,
    },
    /// Modified AHIC on a force axis: only the force is late.
    ForceLate {
        /// m (kg), b (Ns/m), k_e (N/m).
        mass: f64,
        damping: f64,
        stiffness: f64,
        /// The receiver's filter; none: a pure delay.
        filter: Option<Filter>,
        /// What comes to the filter's own delay: hold of its output, half a period; without a filter the whole delay (s).
        delay: f64,
    },
    /// Position feedback alone against the slide's own damping: the sampled spring wall.
    Wall {
        /// Mass, damping, period, t_d.
        wall: SampledWall,
        /// K (N/m).
        stiffness: f64,
    },
}

impl Loop {
    /// The loop of this scenario; none where no closed form applies. The error says why the rack did not start.
    pub fn of(scenario: &Scenario) -> Result<Option<Loop>, String> {
        let axis = scenario.report.force_axis;
        let Some(segment) = scenario.resolved_segments().pop() else { return Ok(None) };
        if scenario.arm.robot != Robot::Slide || axis != 2 {
            return Ok(None);
        }
        let (mass, damping, stiffness) = (segment.mass[axis], segment.damping[axis], segment.stiffness[axis]);
        let bearings = scenario.arm.slide_damping_ns_per_m;
        let period = control_period_s(scenario);
        Ok(match scenario.controller.scheme {
            Scheme::Original if segment.selection[axis] == 1 && stiffness > 0.0 => {
                let delay = scenario.encoder_if.delay_ms * 1e-3 + sampling_to_torque_s(scenario)?;
                if damping > 0.0 && bearings == 0.0 {
                    let impedance = Impedance { mass, damping, stiffness };
                    let (omega_n, zeta) = (impedance.natural_frequency(), impedance.damping_ratio());
                    Some(Loop::BothLate { omega_n, zeta, delay: effective_delay(delay, period) })
                } else if damping == 0.0 && bearings > 0.0 {
                    // inverse dynamics turns accelerations into forces on the slide's own mass
                    let slide = scenario.arm.slide_mass_kg;
                    let wall = SampledWall { mass: slide, damping: bearings, period, delay };
                    Some(Loop::Wall { wall, stiffness: stiffness * slide / mass })
                } else {
                    None
                }
            }
            Scheme::Modified if segment.selection[axis] == 0 => scenario.surfaces.first().and_then(|surface| {
                // X^t moves from job to job; the error reference controller makes X follow it
                let (filter, delay) = match scenario.force_sensor_if.filter {
                    ForceFilter::DelayMs(ms) => (None, effective_delay(ms * 1e-3, period)),
                    ForceFilter::Cascade(0) => (None, effective_delay(0.0, period)),
                    ForceFilter::Cascade(n) => {
                        let filter = Filter::number(n.into())?;
                        (Some(filter), effective_delay(0.5 * filter.publication_period(), period))
                    }
                };
                Some(Loop::ForceLate { mass, damping, stiffness: surface.stiffness_n_per_m, filter, delay })
            }),
            _ => None,
        })
    }

    /// What the closed form is called.
    pub fn name(&self) -> &'static str {
        match self {
            Loop::BothLate { .. } => "both terms late, exact",
            Loop::ForceLate { filter: None, .. } => "force late",
            Loop::ForceLate { filter: Some(_), .. } => "force behind the filter cascade",
            Loop::Wall { .. } => "sampled wall",
        }
    }

    /// Distance to the boundary: the largest delay, or stiffness, over the scenario's. 1 at the boundary, more inside.
    pub fn reserve(&self) -> f64 {
        match *self {
            Loop::BothLate { omega_n, zeta, delay } => Bound::Exact.delay_max(omega_n, zeta) / delay,
            Loop::ForceLate { mass, damping, stiffness, filter: None, delay } => {
                Bound::ForceDelayOnly.stiffness_max(mass, damping, delay) / stiffness
            }
            Loop::ForceLate { mass, damping, stiffness, filter: Some(filter), delay } => {
                filter.contact_stiffness_max(mass, damping, delay) / stiffness
            }
            Loop::Wall { wall, stiffness } => wall.stiffness_max() / stiffness,
        }
    }

    /// The loop's figures, and what other bounds would have said.
    pub fn figures(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Loop::BothLate { omega_n, zeta, delay } => vec![
                ("delay 2T_s, s", delay),
                ("ω_n T_s", 0.5 * omega_n * delay),
                ("exact", Bound::Exact.a_max(zeta)),
                ("Padé, full Routh", Bound::Pade.a_max(zeta)),
                ("published", Bound::Published.a_max(zeta)),
            ],
            Loop::ForceLate { mass, damping, stiffness, filter, delay } => {
                let whole = delay + filter.map_or(0.0, Filter::delay);
                let mut figures = vec![
                    ("delay, s", whole),
                    ("k_e, N/m", stiffness),
                    ("pure delay, N/m", Bound::ForceDelayOnly.stiffness_max(mass, damping, whole)),
                ];
                if let Some(filter) = filter {
                    let alone = filter.contact_stiffness_max(mass, damping, 0.0);
                    figures.push(("cascade with hold, N/m", filter.contact_stiffness_max(mass, damping, delay)));
                    figures.push(("cascade alone, N/m", alone));
                    figures.push(("shift by hold and sampling", stiffness / alone - 1.0));
                }
                figures
            }
            Loop::Wall { wall, stiffness } => vec![
                ("t_d, s", wall.delay),
                ("K, N/m", stiffness),
                ("exact, N/m", wall.stiffness_max()),
                ("rule b/(T/2 + t_d), N/m", wall.stiffness_rule(0.0)),
            ],
        }
    }
}

fn control_period_s(scenario: &Scenario) -> f64 {
    let task = scenario.task_of("control_computer").map(usize::from);
    task.and_then(|task| scenario.rack.tasks.get(task)).map_or(0.0, |task| task.period_ns as f64 * 1e-9)
}

/// From the instant at which joint 1's count is sampled to the one at which its D/A output changes, s: the last of the
/// first few jobs that went through.
fn sampling_to_torque_s(scenario: &Scenario) -> Result<f64, String> {
    let task = scenario.task_of("control_computer").ok_or("the rack has no control task")?;
    let address = |card: &str, register: u32| scenario.card_base(card).map(|base| base + register);
    let mut observer = Way {
        task,
        count: address("encoder-1", encoder::COUNT),
        code: address("da-1", da::code(0)),
        sampled: None,
        way: None,
    };
    let end = JOBS * (control_period_s(scenario) * 1e9) as Ns;
    listen(scenario, end, &mut observer).map_err(|error| error.to_string())?;
    observer.way.map(|way| way as f64 * 1e-9).ok_or_else(|| "no control job reached the D/A".into())
}

/// Listens for one count's way to one output.
struct Way {
    task: u16,
    count: Option<u32>,
    code: Option<u32>,
    sampled: Option<(u32, Ns)>,
    way: Option<Ns>,
}

impl Observer for Way {
    fn window(&mut self, _until: Ns, _mail: &Mail, log: &Log) -> Flow {
        for transfer in log.transfers.iter().filter(|transfer| transfer.task == self.task) {
            if Some(transfer.access.addr) == self.count {
                self.sampled = Some((transfer.job, transfer.data_at));
            } else if Some(transfer.access.addr) == self.code
                && let Some((job, at)) = self.sampled
                && job == transfer.job
            {
                self.way = Some(transfer.data_at - at);
            }
        }
        Flow::Continue
    }
}
