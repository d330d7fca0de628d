//! control_computer
