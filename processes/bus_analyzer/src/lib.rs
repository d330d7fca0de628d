//! bus_analyzer
