//! Plain old data in shared memory.

use iceoryx2::prelude::ZeroCopySend;

/// A payload or header that may lie in shared memory.
#[repr(transparent)]
#[derive(Clone, Copy, Debug)]
pub struct Plain<T>(pub T);

// SAFETY: `bytemuck::Pod` guarantees what the trait asks for: a fixed layout without padding, no pointers, no destructor,
// every bit pattern valid. `Plain` is transparent.
#[allow(unsafe_code)]
unsafe impl<T: bytemuck::Pod> ZeroCopySend for Plain<T> {}

impl<T: bytemuck::Pod> Default for Plain<T> {
    fn default() -> Self {
        Plain(T::zeroed())
    }
}
