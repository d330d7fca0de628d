//! D/A converter: offset binary over ±10 V.

/// Output at the ends of the range, V.
const FULL_SCALE: f64 = 10.0;

/// A converter of some resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Converter {
    bits: u8,
}

impl Converter {
    /// A converter with this many bits (1 to 32).
    pub fn new(bits: u8) -> Result<Converter, String> {
        match bits {
            1..=32 => Ok(Converter { bits }),
            _ => Err(format!("da_io.bits = {bits}, expected 1 to 32")),
        }
    }

    /// The code of 0 V.
    pub fn mid_scale(&self) -> u32 {
        1 << (self.bits - 1)
    }

    /// The bits of a register write that reach the converter.
    pub fn latch(&self, value: u32) -> u32 {
        value & (u32::MAX >> (32 - self.bits))
    }

    /// The code whose output is nearest to this one, V.
    pub fn code(&self, volts: f64) -> u32 {
        let half = f64::from(self.mid_scale());
        (volts / FULL_SCALE * half + half).round().clamp(0.0, 2.0 * half - 1.0) as u32
    }

    /// Output, V: the lowest code is −10 V, one code is 20/2^bits V.
    pub fn volts(&self, code: u32) -> f64 {
        let half = f64::from(self.mid_scale());
        (f64::from(code) - half) / half * FULL_SCALE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_offset_binary_over_ten_volts_both_ways() {
        let converter = Converter::new(12).expect("12 bits");
        assert_eq!(converter.volts(0), -10.0);
        assert_eq!(converter.volts(converter.mid_scale()), 0.0);
        assert_eq!(converter.volts(4095), 10.0 - 20.0 / 4096.0);
        assert_eq!(converter.latch(0xFFFF_F801), 0x801);
        for code in [0, 1, 2047, 2048, 4095] {
            assert_eq!(converter.code(converter.volts(code)), code);
        }
        assert_eq!((converter.code(-11.0), converter.code(12.0)), (0, 4095));
        assert_eq!(
            Converter::new(32).expect("32 bits").latch(u32::MAX),
            u32::MAX
        );
        assert!(Converter::new(0).is_err() && Converter::new(33).is_err());
    }
}
