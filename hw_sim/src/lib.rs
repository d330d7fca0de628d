//! hw_sim
