//! The quadrature counter of one channel: its width, its wrap, and the latch at the index pulse.
//!
//! The counter stands at 0 at the shaft's angle 0 (homing took place before the run) and counts whole quarter-lines,
//! downwards rounded. It wraps at its width; the register is sign-extended to 32 bits.

use crate::history::Point;

/// Content of a counter of `bits` (1 to 32) at a shaft angle of `position` counts.
pub fn register(position: f64, bits: u8) -> i32 {
    let unused = 64 - u32::from(bits);
    (((position.floor() as i64) << unused) >> unused) as i32
}

/// Latches the count at the index mark, once a turn, in both directions.
#[derive(Clone, Copy, Debug)]
pub struct IndexLatch {
    counts_per_turn: f64,
    /// Bounds of the turn that the shaft is in, counts.
    turn: Option<(f64, f64)>,
    /// Position of the last mark passed, counts; 0 before the first.
    latched: f64,
}

impl IndexLatch {
    /// A latch that has seen no index pulse yet.
    pub fn new(counts_per_turn: f64) -> IndexLatch {
        IndexLatch {
            counts_per_turn,
            turn: None,
            latched: 0.0,
        }
    }

    /// Takes in the shaft's next angle, in counts.
    pub fn follow(&mut self, position: f64) {
        match self.turn {
            Some((low, high)) if low <= position && position < high => {}
            None => self.enter(position),
            Some((low, _)) => {
                self.enter(position);
                if let Some((entered, next)) = self.turn {
                    self.latched = if entered > low { entered } else { next };
                }
            }
        }
    }

    /// Position of the last index mark passed, in counts.
    pub fn latched(&self) -> f64 {
        self.latched
    }

    fn enter(&mut self, position: f64) {
        let low = (position / self.counts_per_turn).floor() * self.counts_per_turn;
        self.turn = Some((low, low + self.counts_per_turn));
    }
}

/// An edge of the A or B track: the angle at which the count changes, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Instant, ns.
    pub t: f64,
    /// Angle, a whole number of counts.
    pub line: f64,
}

/// Edge at which a shaft that goes straight between `inside` and `outside` crosses the border of the count's cell
/// [`cell`, `cell` + 1) around `inside`; `None` if it stays in it. Time may run either way between them.
pub fn edge(inside: Point, outside: Point, cell: f64) -> Option<Edge> {
    let line = if outside.x < cell {
        cell
    } else if outside.x >= cell + 1.0 {
        cell + 1.0
    } else {
        return None;
    };
    let share = (line - inside.x) / (outside.x - inside.x);
    Some(Edge {
        t: inside.t + share * (outside.t - inside.t),
        line,
    })
}
