//! encoder_if
