//! force_sensor_if
