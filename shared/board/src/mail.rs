//! One buffer per kind of payload.

use messages::*;

/// Payloads on their way into or out of a board, each kind in the order of sending.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mail {
    /// D/A and parallel I/O outputs.
    pub amplifier: Vec<AmplifierCommand>,
    /// Signals of the arm, one per plant step, the first at the window's start, the last at its end.
    pub plant: Vec<PlantSample>,
    /// Register contents of bus transfers.
    pub words: Vec<BusWord>,
    /// Commands of the workstation.
    pub commands: Vec<Command>,
    /// State blocks for the workstation.
    pub telemetry: Vec<Telemetry>,
    /// True states of the arm.
    pub plant_probe: Vec<PlantProbe>,
    /// Internals of control jobs.
    pub control_probe: Vec<ControlProbe>,
    /// Events.
    pub events: Vec<Event>,
    /// Bus transfers.
    pub transfers: Vec<TransferRecord>,
    /// Use of the bus by its masters.
    pub masters: Vec<MasterUse>,
    /// Ways from sensor to actuator.
    pub paths: Vec<SensorPath>,
}

impl Mail {
    /// Empties every buffer and keeps the memory.
    pub fn clear(&mut self) {
        self.amplifier.clear();
        self.plant.clear();
        self.words.clear();
        self.commands.clear();
        self.telemetry.clear();
        self.plant_probe.clear();
        self.control_probe.clear();
        self.events.clear();
        self.transfers.clear();
        self.masters.clear();
        self.paths.clear();
    }
}
