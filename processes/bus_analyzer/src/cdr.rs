//! CDR, little-endian: the encoding of ROS 2 messages (OMG DDS-XTypes, XCDR version 1).
//!
//! Every primitive is aligned to its size, counted from behind the four bytes of the encapsulation header.

/// Writes one message after the other into the same memory.
#[derive(Clone, Debug)]
pub struct Cdr {
    buffer: Vec<u8>,
}

const ENCAPSULATION: [u8; 4] = [0x00, 0x01, 0x00, 0x00];

impl Default for Cdr {
    fn default() -> Self {
        let mut buffer = Vec::with_capacity(64 * 1024);
        buffer.extend_from_slice(&ENCAPSULATION);
        Cdr { buffer }
    }
}

macro_rules! primitive {
    ($($name:ident: $type:ty),*) => {$(
        #[doc = concat!("One `", stringify!($type), "`, aligned.")]
        pub fn $name(&mut self, value: $type) {
            self.align(size_of::<$type>());
            self.buffer.extend_from_slice(&value.to_le_bytes());
        }
    )*};
}

impl Cdr {
    /// Begins the next message; the one before is gone.
    pub fn begin(&mut self) {
        self.buffer.truncate(ENCAPSULATION.len());
    }

    /// The message written since [`Cdr::begin`], encapsulation header included.
    pub fn bytes(&self) -> &[u8] {
        &self.buffer
    }

    primitive!(u8: u8, u16: u16, u32: u32, i32: i32, u64: u64, f64: f64);

    /// A fixed-length array, or the elements of a sequence whose length has been written.
    pub fn f64s(&mut self, values: &[f64]) {
        self.align(8);
        for value in values {
            self.buffer.extend_from_slice(&value.to_le_bytes());
        }
    }

    /// A sequence: its length, then its elements. An empty one must not be asked for: readers differ
    /// on whether padding follows its length.
    pub fn f64_sequence(&mut self, values: &[f64]) {
        debug_assert!(!values.is_empty());
        self.u32(values.len() as u32);
        self.f64s(values);
    }

    /// A string: its length with the closing NUL, then its bytes.
    pub fn string(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.buffer.extend_from_slice(text.as_bytes());
        self.buffer.push(0);
    }

    fn align(&mut self, size: usize) {
        let at = self.buffer.len() - ENCAPSULATION.len();
        let padded = at.next_multiple_of(size) + ENCAPSULATION.len();
        if padded != self.buffer.len() {
            self.buffer.resize(padded, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alignment_counts_from_behind_the_encapsulation_header() {
        let mut cdr = Cdr::default();
        cdr.begin();
        cdr.u8(0xAA);
        cdr.f64(1.0);
        cdr.string("hi");
        cdr.u16(0x1234);
        let expected: &[u8] = &[
            0, 1, 0, 0, // header
            0xAA, 0, 0, 0, 0, 0, 0, 0, // byte, padding to 8
            0, 0, 0, 0, 0, 0, 0xF0, 0x3F, // 1.0
            3, 0, 0, 0, b'h', b'i', 0, // string
            0, 0x34, 0x12, // padding to 2, word
        ];
        assert_eq!(cdr.bytes(), expected);
    }

    #[test]
    fn a_new_message_forgets_the_one_before() {
        let mut cdr = Cdr::default();
        cdr.u64(7);
        cdr.begin();
        cdr.i32(-1);
        assert_eq!(cdr.bytes(), &[0, 1, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF]);
    }
}
