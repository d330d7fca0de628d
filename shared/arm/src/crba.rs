//! Mass matrix by the composite-rigid-body algorithm.
//!
//! Links beyond a joint are merged into one body about the tip; turning the joint at unit acceleration gives that body a
//! momentum rate, whose component along each earlier axis is an entry of the matrix.

use crate::bodies::Bodies;
use crate::kinematics::{Frames, Screws};
use crate::lanes::{Lanes, PAIRS, Pair, lane, sum_from_tip};
use crate::model::ArmModel;
use crate::small::V3;
use crate::{DOF, JointMatrix, JointVector};

/// Mass matrix M(q) (kg m²), symmetric to the last bit.
pub fn crba(model: &ArmModel, q: &JointVector) -> JointMatrix {
    match &model.slide {
        Some(slide) => slide.crba(),
        None => crba_in(model, &Screws::new(&Frames::new(model, q))),
    }
}

#[inline(always)]
pub(crate) fn crba_in(model: &ArmModel, screws: &Screws) -> JointMatrix {
    let rows = mass_rows(screws, Bodies::new(model, screws));
    JointMatrix::from_fn(|i, j| lane(&rows[i.min(j)], i.max(j)))
}

/// Rows of M from the diagonal on; what stands before the diagonal, or in the tip's lane, means nothing.
#[inline(always)]
pub(crate) fn mass_rows(screws: &Screws, links: Bodies) -> [[Pair; PAIRS]; DOF] {
    let Bodies { mut first, mut second } = links;
    sum_from_tip(&mut first);
    sum_from_tip(&mut second);
    // momentum rates of the composites about the tip, each for its own joint's unit acceleration
    let p: [V3<Pair>; PAIRS] = std::array::from_fn(|k| screws.r[k].z.cross(first[k]));
    let l: [V3<Pair>; PAIRS] = std::array::from_fn(|k| {
        let (s, z, i) = (screws.s[k], screws.r[k].z, second[k]);
        z * i.trace() - i * z + first[k].cross(s)
    });
    let mut rows = [[Pair::default(); PAIRS]; DOF];
    for j in 0..PAIRS {
        let (s, z) = (lane(&screws.s, j), lane(&screws.r, j).z);
        let (s, z) = (V3::pair(s, s), V3::pair(z, z));
        for k in 0..PAIRS {
            rows[j][k] = s.dot(p[k]) + z.dot(l[k]);
        }
    }
    // the last joints among themselves are the high lanes of pairs with pairs
    for j in 0..DOF - PAIRS {
        for k in 0..DOF - PAIRS {
            rows[j + PAIRS][k] = screws.s[j].dot(p[k]) + screws.r[j].z.dot(l[k]);
        }
    }
    rows
}
