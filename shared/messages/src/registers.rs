//! Register maps of the interface cards: byte offsets from the card's base address.

/// Force-sensor receiver (JR3 class): dual-ported RAM of 16-bit words, byte offset = 2 × word.
pub mod force {
    /// Counts at full scale.
    pub const FULL_SCALE_COUNTS: f64 = 16384.0;
    /// Full scales, six words (N, then Nm × 10): byte offset of the first.
    pub const FULL_SCALE: u32 = 2 * 0x80;
    /// Offsets (tare) in counts, six words, added by the card.
    pub const OFFSET: u32 = 2 * 0x88;
    /// Sample counter of filters 1 to 6: one word each; filter 0 uses the counter at word 0xEF.
    pub const COUNTER: u32 = 2 * 0xE8;
    /// Sample counter of filter 0.
    pub const COUNTER_0: u32 = 2 * 0xEF;
    /// Warning bits 0–5: axis near saturation (80 %).
    pub const WARNINGS: u32 = 2 * 0xF0;
    /// Error bits.
    pub const ERRORS: u32 = 2 * 0xF1;
    /// Command word 0.
    pub const COMMAND: u32 = 2 * 0xE7;
    /// Error bits 0–5: axis saturated.
    pub const ERROR_SATURATED: u16 = 0x3F;
    /// Error: memory.
    pub const ERROR_MEMORY: u16 = 0x0400;
    /// Error: sensor changed.
    pub const ERROR_SENSOR_CHANGE: u16 = 0x0800;
    /// Error: receiver busy.
    pub const ERROR_BUSY: u16 = 0x1000;
    /// Error: calibration CRC.
    pub const ERROR_CRC: u16 = 0x2000;
    /// Error: watchdogs.
    pub const ERROR_WATCHDOG: u16 = 0xC000;

    /// First of the six words (Fx … Mz) of filter `n` (0–6).
    pub const fn filter(n: u32) -> u32 {
        2 * (0x90 + 8 * n)
    }

    /// Sample counter of filter `n`.
    pub const fn counter(n: u32) -> u32 {
        if n == 0 { COUNTER_0 } else { COUNTER + 2 * (n - 1) }
    }
}

/// Encoder cards: two channels a card, joints 1–2 on the first, 3–4 on the second, …
pub mod encoder {
    /// Bytes from one channel to the next.
    pub const CHANNEL: u32 = 0x10;
    /// Quadrature count, signed, wraps at the counter's width.
    pub const COUNT: u32 = 0x00;
    /// Speed, signed, in [`VELOCITY_LSB`] counts/s.
    pub const VELOCITY: u32 = 0x04;
    /// Bits of `STATUS_…`. The latched ones are cleared by writing.
    pub const STATUS: u32 = 0x08;
    /// Count latched at the last index pulse.
    pub const INDEX: u32 = 0x0C;
    /// Status of both channels of a card, the second one's a byte higher; reading clears what is latched.
    pub const CARD_STATUS: u32 = 0x20;
    /// A and B changed at once (latched).
    pub const STATUS_QUADRATURE: u32 = 1;
    /// The lines' differential level is wrong: a wire is open.
    pub const STATUS_LEVEL: u32 = 2;
    /// Counts between two index marks are not those of a turn, or no mark came within one and a quarter (latched).
    pub const STATUS_INDEX: u32 = 4;
    /// Counts per second of one unit of [`VELOCITY`].
    pub const VELOCITY_LSB: f64 = 1.0 / 1024.0;
    /// Channels on one card.
    pub const CHANNELS_PER_CARD: usize = 2;
}

/// D/A cards: four channels a card, joints 1–4 on the first, 5–7 on the second.
pub mod da {
    /// Output code of channel `n`: offset binary, mid-scale = 0 V.
    pub const fn code(n: u32) -> u32 {
        4 * n
    }
    /// Read-back of the output of channel `n`, same code.
    pub const fn read_back(n: u32) -> u32 {
        0x10 + 4 * n
    }
    /// Channels on one card.
    pub const CHANNELS_PER_CARD: usize = 4;
}

/// Parallel I/O card.
pub mod parallel {
    /// Inputs, bits as [`crate::drive_status`] (read, D32).
    pub const INPUT: u32 = 0x00;
    /// Bit i: enable the amplifier of joint i (write).
    pub const ENABLE: u32 = 0x04;
    /// Bit i: release the brake of joint i (write).
    pub const BRAKE: u32 = 0x08;
    /// Heartbeat counter: a new value feeds the output watchdog (write).
    pub const WATCHDOG: u32 = 0x0C;
    /// Watchdog state: bit 0 expired (latched); writing [`ACKNOWLEDGE`] clears it.
    pub const WATCHDOG_STATUS: u32 = 0x10;
    /// Value that acknowledges an expired watchdog.
    pub const ACKNOWLEDGE: u32 = 0x5A5A;
}

/// Dual-ported RAM of the control computer's cards.
pub mod mailbox {
    /// State block, read by the workstation as one block transfer.
    pub const TELEMETRY: u32 = 0x0000;
    /// Command block, written by the workstation.
    pub const COMMAND: u32 = 0x1000;
    /// Hand-over block in the second card's RAM, where the pipeline is split over two: written by the first card.
    pub const HANDOVER: u32 = 0x2000;
    /// State word in the second card's RAM, read by the first: safety state in the low byte, above it a bit for each joint
    /// whose torque was cut, and one for a stop that can be acknowledged.
    pub const STATE: u32 = 0x3000;
}
