//! A sealed message: header and payload as they lie in memory, and the CRC-32 over both.
//!
//! The CRC runs over the payload, then time and number of the header; the CRC itself comes last, as it does in the header
//! behind them. So a burst of up to 32 bits in memory is one in the code word too, wherever it lies, and is found for sure.
//! `wall_ns` is no part of it.

use bytemuck::{NoUninit, bytes_of};
use messages::Header;

/// Bits of a frame that the CRC covers begin here in the payload; before it lie time, number and CRC.
pub const COVERED_HEADER_BITS: usize = 128;

/// One message.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Its header.
    pub header: Header,
    /// Its elements, byte for byte.
    pub payload: Vec<u8>,
}

impl Frame {
    /// A message with its checksum.
    pub fn sealed<T: NoUninit>(header: Header, elements: &[T]) -> Frame {
        let payload: &[u8] = bytemuck::cast_slice(elements);
        Frame { header: Header { crc: checksum(&header, payload), ..header }, payload: payload.to_vec() }
    }

    /// Whether header and payload are what was sealed.
    pub fn is_sound(&self) -> bool {
        checksum(&self.header, &self.payload) == self.header.crc
    }

    /// Bits that the CRC covers, itself included.
    pub fn bits(&self) -> usize {
        COVERED_HEADER_BITS + 8 * self.payload.len()
    }

    /// Flips one of the covered bits: time, number and CRC first, then the payload, the low bit of each byte first.
    pub fn flip(&mut self, bit: usize) {
        let byte = match bit.checked_sub(COVERED_HEADER_BITS) {
            None => &mut bytemuck::bytes_of_mut(&mut self.header)[bit / 8],
            Some(bit) => &mut self.payload[bit / 8],
        };
        *byte ^= 1 << (bit % 8);
    }
}

fn checksum(header: &Header, payload: &[u8]) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    crc.update(payload);
    crc.update(bytes_of(&header.t));
    crc.update(bytes_of(&header.seq));
    crc.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_usual_crc_32() {
        // the check value of CRC-32/ISO-HDLC, whose message ends in what the header holds
        let header = Header { t: u64::from_le_bytes(*b"12345678"), seq: 0, crc: 0, wall_ns: 0 };
        let mut reference = crc32fast::Hasher::new();
        reference.update(b"12345678\0\0\0\0");
        assert_eq!(Frame::sealed::<u8>(header, &[]).header.crc, reference.finalize());
        assert_eq!(crc32fast::hash(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn the_wall_clock_is_no_part_of_a_sealed_message_and_every_other_bit_is() {
        let header = Header { t: 5_000_000, seq: 7, crc: 0, wall_ns: 3 };
        let mut frame = Frame::sealed(header, &[1u32, 2, 3]);
        frame.header.wall_ns = 4;
        assert!(frame.is_sound());
        for bit in 0..frame.bits() {
            frame.flip(bit);
            assert!(!frame.is_sound(), "bit {bit}");
            frame.flip(bit);
        }
        assert!(frame.is_sound());
    }
}
