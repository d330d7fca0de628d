//! whole-rack tests live in tests/
