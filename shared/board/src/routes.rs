//! The wiring of the rack: a channel is one kind of payload from one board, and these are its readers.

use messages::{BoardId, Kind};

/// One channel and who listens to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Route {
    /// Who sends.
    pub from: BoardId,
    /// What is sent.
    pub kind: Kind,
    /// Who listens.
    pub to: &'static [BoardId],
}

impl Route {
    /// Whether its messages travel over the bus: not on wires, nor to the record.
    pub fn is_bus(&self) -> bool {
        matches!(self.kind, Kind::Words | Kind::Commands | Kind::Telemetry)
    }
}

use BoardId::*;

/// All channels. Wires have no bus latency; register words move at the times that the timing plane gives.
pub const ROUTES: &[Route] = &[
    // wires
    Route { from: DaIo, kind: Kind::Amplifier, to: &[HwSim] },
    // while da_io is down
    Route { from: Chassis, kind: Kind::Amplifier, to: &[HwSim] },
    Route { from: HwSim, kind: Kind::Plant, to: &[DaIo, ForceSensorIf, EncoderIf] },
    // bus
    Route { from: ControlComputer, kind: Kind::Words, to: &[DaIo, ForceSensorIf, EncoderIf] },
    Route { from: DaIo, kind: Kind::Words, to: &[ControlComputer] },
    Route { from: ForceSensorIf, kind: Kind::Words, to: &[ControlComputer] },
    Route { from: EncoderIf, kind: Kind::Words, to: &[ControlComputer] },
    Route { from: Workstation, kind: Kind::Commands, to: &[ControlComputer] },
    Route { from: ControlComputer, kind: Kind::Telemetry, to: &[Workstation] },
    // record: the chassis listens too, for the verdict
    Route { from: HwSim, kind: Kind::PlantProbe, to: &[BusAnalyzer, Chassis] },
    Route { from: ControlComputer, kind: Kind::ControlProbe, to: &[BusAnalyzer, Chassis] },
    Route { from: Chassis, kind: Kind::Transfers, to: &[BusAnalyzer] },
    Route { from: Chassis, kind: Kind::Masters, to: &[BusAnalyzer] },
    Route { from: Chassis, kind: Kind::Paths, to: &[BusAnalyzer] },
    Route { from: Chassis, kind: Kind::Events, to: &[BusAnalyzer, Chassis] },
    Route { from: DaIo, kind: Kind::Events, to: &[BusAnalyzer, Chassis] },
    Route { from: HwSim, kind: Kind::Events, to: &[BusAnalyzer, Chassis] },
    Route { from: ForceSensorIf, kind: Kind::Events, to: &[BusAnalyzer, Chassis] },
    Route { from: EncoderIf, kind: Kind::Events, to: &[BusAnalyzer, Chassis] },
    Route { from: ControlComputer, kind: Kind::Events, to: &[BusAnalyzer, Chassis] },
    Route { from: Workstation, kind: Kind::Events, to: &[BusAnalyzer, Chassis] },
    Route { from: BusAnalyzer, kind: Kind::Events, to: &[Chassis] },
];
