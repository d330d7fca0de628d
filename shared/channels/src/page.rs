//! 32-bit words that all processes of a run share.

use crate::ChannelError;
use memmap2::MmapMut;
use std::fs::OpenOptions;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;

/// A file of words, mapped.
#[derive(Clone, Debug)]
pub(crate) struct Page {
    map: Arc<MmapMut>,
}

impl Page {
    /// Maps the file at `path` with room for `words`, creating it, all zero, where it does not exist.
    pub fn open(path: &Path, words: usize) -> Result<Page, ChannelError> {
        let failed =
            |error: std::io::Error| ChannelError::Page { path: path.display().to_string(), reason: error.to_string() };
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(failed)?;
        file.set_len(4 * words as u64).map_err(failed)?;
        // SAFETY: the file belongs to this run alone, has just been sized and is never shrunk while a process maps it;
        // it is only accessed through atomics.
        #[allow(unsafe_code)]
        let map = unsafe { MmapMut::map_mut(&file) }.map_err(failed)?;
        Ok(Page { map: Arc::new(map) })
    }

    /// A word; there must be that many.
    pub fn word(&self, index: usize) -> &AtomicU32 {
        let bytes = &self.map[4 * index..4 * index + 4];
        // SAFETY: four bytes inside the map, aligned (the map begins at a page), valid for the borrow of `self`, and used
        // by every process as an atomic only.
        #[allow(unsafe_code)]
        unsafe {
            &*bytes.as_ptr().cast::<AtomicU32>()
        }
    }
}
