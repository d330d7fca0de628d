//! What a run comes to: measures, verdict, tables, `report.json` and `report.html`.
//!
//! A host collects a [`Trace`] and a [`Ledger`] while a variant runs and makes a [`VariantResult`] of
//! them; [`RunReport`] puts the variants and sweeps together. Rendering is apart from measuring:
//! [`text`] for the terminal, [`RunReport::write`] for the files. A figure that does not exist (a force
//! that never rose, a segment never reached) is `None` and shown as `–`, never a made-up number.

mod accounting;
mod bus_rows;
mod campaign;
mod chart;
mod compare;
mod envelope;
mod faults;
mod html;
mod ideal;
pub mod latency;
mod ledger;
mod measures;
mod path;
mod region;
mod result;
mod segments;
mod series;
mod stretches;
mod svg;
pub mod text;
mod trace;
mod verdict;

pub use accounting::{Accounting, BusAccount, MasterAccount, PartAccount, Spread, TaskAccount, WaterfallAccount};
pub use campaign::{CampaignReport, DrawRow, DrawVerdict, FalseTrip, KindSummary, NullRuns, Totals};
pub use compare::{CompareError, ComparedFigure, Comparison, StoredRun};
pub use faults::{FaultRow, rows as fault_rows};
pub use ledger::{Ledger, PathLatency};
pub use measures::RunMeasures;
pub use result::{RunReport, SCHEMA_VERSION, Sweep, SweepPoint, VariantResult, WriteError};
pub use segments::SegmentRow;
pub use stretches::Course;
pub use trace::{Ended, Trace};
pub use verdict::{Check, Verdict, segments_with};
