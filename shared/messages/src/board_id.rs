//! Which board of Figure 6.1 speaks.

/// A board of the rack. The numeric order is the order in which boards that act at the same
/// simulated time come one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum BoardId {
    /// Slot-1 system controller.
    Chassis = 0,
    /// Two D/A cards and the parallel I/O card.
    DaIo = 1,
    /// Arm, drives and contact: physics, not a board.
    HwSim = 2,
    /// Force-sensor receiver card.
    ForceSensorIf = 3,
    /// Four encoder cards.
    EncoderIf = 4,
    /// Two processor cards.
    ControlComputer = 5,
    /// Supervisory workstation behind its bus adaptor.
    Workstation = 6,
    /// Bus analyzer card: the recorder.
    BusAnalyzer = 7,
}

/// All boards, in order.
pub const BOARDS: [BoardId; 8] = [
    BoardId::Chassis,
    BoardId::DaIo,
    BoardId::HwSim,
    BoardId::ForceSensorIf,
    BoardId::EncoderIf,
    BoardId::ControlComputer,
    BoardId::Workstation,
    BoardId::BusAnalyzer,
];

impl BoardId {
    /// Name in scenarios, process lists and records.
    pub const fn name(self) -> &'static str {
        match self {
            BoardId::Chassis => "chassis",
            BoardId::DaIo => "da_io",
            BoardId::HwSim => "hw_sim",
            BoardId::ForceSensorIf => "force_sensor_if",
            BoardId::EncoderIf => "encoder_if",
            BoardId::ControlComputer => "control_computer",
            BoardId::Workstation => "workstation",
            BoardId::BusAnalyzer => "bus_analyzer",
        }
    }

    /// The board of that name.
    pub fn from_name(name: &str) -> Option<BoardId> {
        BOARDS.into_iter().find(|board| board.name() == name)
    }

    /// The board of that number.
    pub fn from_number(number: u8) -> Option<BoardId> {
        BOARDS.get(number as usize).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers_lead_back_to_the_board() {
        for board in BOARDS {
            assert_eq!(BoardId::from_name(board.name()), Some(board));
            assert_eq!(BoardId::from_number(board as u8), Some(board));
        }
        assert_eq!(BoardId::from_number(8), None);
    }
}
