//! Text files that a user names: read whole, but never one that has no end.

use std::fs::{File, metadata};
use std::io::Read;
use std::path::Path;

/// The text of a regular file of at most `limit` bytes; the message says what is wrong with it.
pub fn read_text(path: impl AsRef<Path>, limit: u64) -> Result<String, String> {
    let path = path.as_ref();
    // a pipe would be waited for, a device never ends
    if !metadata(path).map_err(|error| error.to_string())?.is_file() {
        return Err("it is no regular file".into());
    }
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(limit + 1).read_to_end(&mut bytes));
    if read.map_err(|error| error.to_string())? as u64 > limit {
        return Err(format!("it is longer than the {limit} bytes that a text file of this kind has at most"));
    }
    String::from_utf8(bytes).map_err(|error| format!("byte {} is not UTF-8 text", error.utf8_error().valid_up_to()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_a_folder_and_a_longer_file_are_refused() {
        assert_eq!(read_text("/dev/zero", 100).unwrap_err(), "it is no regular file");
        assert_eq!(read_text("/", 100).unwrap_err(), "it is no regular file");
        let this = concat!(env!("CARGO_MANIFEST_DIR"), "/src/file.rs");
        let text = include_str!("file.rs");
        assert_eq!(read_text(this, text.len() as u64).as_deref(), Ok(text));
        assert!(read_text(this, text.len() as u64 - 1).unwrap_err().starts_with("it is longer than"));
    }
}
