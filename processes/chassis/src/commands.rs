//! One file per subcommand: arguments there, work in the libraries, rendering apart from both.

pub mod arm;
pub mod bus;
pub mod compare;
pub mod design;
pub mod doctor;
pub mod faults;
pub mod latency;
pub mod log;
pub mod margin;
pub mod run;
pub mod scenario;
pub mod scenarios;
pub mod sweep;
pub mod top;
