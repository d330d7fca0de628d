//! Speed from counts and the times of edges (M/T method), as a card with a timer per channel measures it.
//!
//! Between the first and the last edge within the window before the access, v = counts/time: exact at constant
//! speed, late by about half the window otherwise. With one edge in the window, the interval from the edge before
//! it counts; with none, the last interval, bounded by one count over the time since the last edge, for the shaft
//! has not gone further since. The timer reaches back [`TIMER_NS`]: fewer than two edges in that time read as standstill.
//! A shaft that dithers over one edge reads as 0: edges are places, not pulses.

use crate::counter::{Edge, edge};
use crate::history::{History, Point};
use vme::Ns;

/// The edge timer overflows after this long: 20 ms, 50 counts/s.
pub const TIMER_NS: Ns = 20_000_000;

/// Two sightings of an edge closer than this are one, ns.
const SAME_EDGE: f64 = 1.0;

/// Speed of a shaft as known at `t`, counts/s. `window` in ns, at most [`TIMER_NS`].
pub fn edge_time(history: &History, joint: usize, t: f64, window: f64) -> f64 {
    let mut past = Past::before(history, joint, t, t - TIMER_NS as f64);
    let Some(last) = past.edge() else { return 0.0 };
    let in_window = (last.t > t - window)
        .then(|| first_edge(history, joint, t - window))
        .flatten();
    let first = match in_window {
        Some(first) if last.t - first.t > SAME_EDGE => first,
        _ => match past.edge() {
            Some(before) => before,
            None => return 0.0,
        },
    };
    let speed = (last.line - first.line) / (last.t - first.t);
    let bound = 1.0 / (t - last.t);
    // angles that are no numbers have no order, and give no speed
    speed.max(-bound).min(bound) * 1e9
}

/// First edge after `t`.
fn first_edge(history: &History, joint: usize, t: f64) -> Option<Edge> {
    let mut from = Point {
        t,
        x: history.position(joint, t),
    };
    let cell = from.x.floor();
    for i in history.until(t).. {
        let to = history.point(joint, i)?;
        if let Some(edge) = edge(from, to, cell) {
            return Some(edge);
        }
        from = to;
    }
    None
}

/// Looks back along one shaft's way, edge by edge.
struct Past<'a> {
    history: &'a History,
    joint: usize,
    /// Looks back no further than this, ns.
    limit: f64,
    /// Where it has come to; the count's cell is [`cell`, `cell` + 1) just before.
    at: Point,
    cell: f64,
    /// Number of samples before `at`.
    samples: usize,
}

impl<'a> Past<'a> {
    fn before(history: &'a History, joint: usize, t: f64, limit: f64) -> Past<'a> {
        let x = history.position(joint, t);
        Past {
            history,
            joint,
            limit,
            at: Point { t, x },
            cell: x.floor(),
            samples: history.until(t),
        }
    }

    /// The next older edge.
    fn edge(&mut self) -> Option<Edge> {
        let outside = self.history.last_outside(self.joint, self.cell, self.samples)?;
        if outside + 1 < self.samples {
            self.at = self.history.point(self.joint, outside + 1)?;
            self.samples = outside + 1;
        }
        if self.at.t < self.limit {
            return None;
        }
        let edge = edge(self.at, self.history.point(self.joint, outside)?, self.cell)?;
        self.at = Point {
            t: edge.t,
            x: edge.line,
        };
        // before the edge the shaft was on its other side
        self.cell = if edge.line == self.cell {
            self.cell - 1.0
        } else {
            edge.line
        };
        (edge.t >= self.limit).then_some(edge)
    }
}
