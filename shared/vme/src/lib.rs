//! vme
