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
    let mut composite = links;
    sum_from_tip(&mut composite.mass);
    sum_from_tip(&mut composite.first);
    sum_from_tip(&mut composite.second);
    // momentum rates of the composites about the tip, each for its own joint's unit acceleration
    let mut p = [V3::<Pair>::default(); PAIRS];
    let mut l = [V3::<Pair>::default(); PAIRS];
    for k in 0..PAIRS {
        let (s, z) = (screws.s[k], screws.r[k].z);
        let (m, h, i) = (composite.mass[k], composite.first[k], composite.second[k]);
        p[k] = s * m + z.cross(h);
        l[k] = z * i.trace() - i * z + h.cross(s);
    }
    let mut rows = [[Pair::default(); PAIRS]; DOF];
    for j in 0..DOF {
        let (s, z) = (lane(&screws.s, j), lane(&screws.r, j).z);
        let (s, z) = (V3::pair(s, s), V3::pair(z, z));
        for k in 0..PAIRS {
            rows[j][k] = s.dot(p[k]) + z.dot(l[k]);
        }
    }
    rows
}
