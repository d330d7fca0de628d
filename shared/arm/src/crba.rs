//! Mass matrix by the composite-rigid-body algorithm.
//!
//! Links beyond a joint are merged into one body about the tip; turning the joint at unit acceleration gives that body a
//! momentum rate, whose component along each earlier axis is an entry of the matrix.

use crate::bodies::{Bodies, Wrench, bodies};
use crate::kinematics::{Screws, frames, screws};
use crate::lanes::{Lanes, PAIRS, Pair, from_tip, lane};
use crate::model::ArmModel;
use crate::rnea::along;
use crate::small::V3;
use crate::{DOF, JointMatrix, JointVector};

/// Mass matrix M(q) (kg m²), symmetric to the last bit.
pub fn crba(model: &ArmModel, q: &JointVector) -> JointMatrix {
    match &model.slide {
        Some(slide) => slide.crba(),
        None => {
            let screws = screws(&frames(model, q));
            crba_in(&screws, &bodies(model, &screws))
        }
    }
}

#[inline(always)]
pub(crate) fn crba_in(screws: &Screws, links: &Bodies) -> JointMatrix {
    let composites = from_tip(links);
    // momentum rates of the composites about the tip, each for its own joint's unit acceleration
    let rates: [Wrench<Pair>; PAIRS] = std::array::from_fn(|k| {
        let (s, z, body) = (screws[k].s, screws[k].r.z, &composites[k]);
        Wrench { f: z.cross(body.first), n: body.second.momentum(z) + body.first.cross(s) }
    });
    // rows from the diagonal on; what stands before it, or in the tip's lane, means nothing
    let mut rows = [[Pair::default(); PAIRS]; DOF];
    for j in 0..PAIRS {
        // the first joints, each with all
        let (s, z) = (screws[j].s.low(), screws[j].r.z.low());
        let (s, z) = (V3::pair(s, s), V3::pair(z, z));
        rows[j] = std::array::from_fn(|k| s.dot(rates[k].f) + z.dot(rates[k].n));
    }
    for j in 0..DOF - PAIRS {
        // the last joints among themselves are the high lanes of pairs with pairs
        for k in j..DOF - PAIRS {
            rows[j + PAIRS][k] = along(&screws[j], &rates[k]);
        }
    }
    JointMatrix::from_fn(|i, j| lane(&rows[i.min(j)], i.max(j)))
}
