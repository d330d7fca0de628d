//! What in the rack sees that something is wrong.
//!
//! Whoever computes is watched by a word that it has to keep moving, so that memory which still answers with old data does
//! not pass for life: the control computer by its heartbeat in the I/O card ([`Detector::OutputWatchdog`]), the receiver by its
//! sample counter ([`Detector::ForceAge`]), the first of two processor cards by the number of its hand-over block
//! ([`Detector::HandOver`]), the workstation by its polls ([`Detector::CommandAge`]). Counters of the encoder cards and
//! converters are hardware that needs no processor. A board that hangs takes its bus interface with it in this rack, so
//! that its cards end in BERR* before any of that ([`Detector::BusError`]).

macro_rules! detectors {
    ($($(#[$doc:meta])* $detector:ident = $number:literal $name:literal;)*) => {
        /// A check that fires: the cause of a change of the safety state, and what an injected fault is detected by.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u32)]
        pub enum Detector {
            $($(#[$doc])* $detector = $number,)*
        }

        /// All detectors, in the order of their numbers.
        pub const DETECTORS: &[Detector] = &[$(Detector::$detector,)*];

        impl Detector {
            /// Short name, as records and tables show it.
            pub const fn name(self) -> &'static str {
                match self { $(Detector::$detector => $name,)* }
            }
        }
    };
}

detectors! {
    /// The receiver's error word: sensor changed (cable open), memory, busy, calibration, watchdog.
    ForceErrorWord = 1 "force-error-word";
    /// The receiver's full-scale bits.
    ForceFullScale = 2 "force-full-scale";
    /// Age of the force sample, from the receiver's counter.
    ForceAge = 3 "force-age";
    /// All force words repeat to the bit.
    ForceFrozen = 4 "force-frozen";
    /// The force changes faster than the contact can.
    ForceSlew = 5 "force-slew";
    /// Variance of the force about its mean.
    ForceVariance = 6 "force-variance";
    /// The force is not what motion and torques account for.
    ForceResidual = 7 "force-residual";
    /// A force out of contact.
    ForceZero = 8 "force-zero";
    /// Differential level of an encoder's lines.
    EncoderLevel = 9 "encoder-level";
    /// A and B tracks of an encoder change at once.
    EncoderQuadrature = 10 "encoder-quadrature";
    /// Counts between two index marks.
    EncoderIndex = 11 "encoder-index";
    /// A count jumps further than the joint can move.
    EncoderJump = 12 "encoder-jump";
    /// A D/A output read back is not the one written.
    DaReadBack = 13 "da-read-back";
    /// The joints do not follow the torques.
    TrackingResidual = 14 "tracking-residual";
    /// Amplifier's trip input.
    AmplifierTrip = 15 "amplifier-trip";
    /// A joint moves on its brake, or does not off it.
    BrakeMotion = 16 "brake-motion";
    /// The D/A cards' output watchdog.
    OutputWatchdog = 17 "output-watchdog";
    /// BERR*: the bus timer.
    BusError = 18 "bus-error";
    /// No grant: the access timer.
    AccessTimer = 19 "access-timer";
    /// Sequence number of a message.
    Sequence = 20 "sequence";
    /// CRC-32 of a message.
    Checksum = 21 "crc";
    /// A message later than its time.
    MessageAge = 22 "message-age";
    /// Interrupts that do not come.
    MissedTick = 23 "missed-tick";
    /// Link status of a bus adaptor.
    LinkStatus = 24 "link-status";
    /// The control computer is powered up in the middle of a run: its heartbeat has stood still.
    Heartbeat = 25 "heartbeat";
    /// Execution time over its budget.
    Overrun = 26 "overrun";
    /// Two boards' clocks drift apart.
    ClockSlope = 27 "clock-slope";
    /// The workstation is silent.
    CommandAge = 28 "command-age";
    /// Epoch number of a command.
    CommandEpoch = 29 "command-epoch";
    /// A command's limits and rates.
    CommandCheck = 30 "command-check";
    /// ACFAIL*.
    PowerFail = 31 "acfail";
    /// Emergency-stop chain.
    EmergencyStop = 32 "emergency-stop";
    /// Torques that are no numbers.
    NotFinite = 33 "not-finite";
    /// The hand-over block of the first of two cards is late.
    HandOver = 34 "hand-over";
    /// Somebody at the workstation asks for a stop, or acknowledges one.
    Operator = 35 "operator";
}

impl Detector {
    /// The detector of that number.
    pub fn from_number(number: u32) -> Option<Detector> {
        DETECTORS.get((number as usize).checked_sub(1)?).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lead_back_to_the_detector() {
        for detector in DETECTORS {
            assert_eq!(Detector::from_number(*detector as u32), Some(*detector));
        }
        assert_eq!(Detector::from_number(0), None);
        assert_eq!(Detector::from_number(DETECTORS.len() as u32 + 1), None);
    }
}
