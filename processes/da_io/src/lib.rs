//! da_io
