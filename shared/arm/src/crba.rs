//! Mass matrix by the composite-rigid-body algorithm.
//!
//! Links beyond a joint are merged into one body, kept in base axes at the joint's origin; turning the joint at unit
//! acceleration gives that body a momentum rate, whose moment about each earlier axis is an entry of the matrix.

use crate::kinematics::Frames;
use crate::model::ArmModel;
use crate::small::{Sym3, V3};
use crate::{DOF, JointMatrix, JointVector};

/// Mass matrix M(q) (kg m²), symmetric to the last bit.
pub fn crba(model: &ArmModel, q: &JointVector) -> JointMatrix {
    match &model.slide {
        Some(slide) => slide.crba(),
        None => crba_in(model, &Frames::new(model, q)),
    }
}

#[inline(always)]
pub(crate) fn crba_in(model: &ArmModel, frames: &Frames) -> JointMatrix {
    let mut mass_matrix = JointMatrix::zeros();
    let (mut m, mut h, mut inertia) = (0.0, V3::ZERO, Sym3::default());
    for i in (0..DOF).rev() {
        let (r, body) = (&frames.r[i], &model.joints[i].body);
        if i + 1 < DOF {
            let d = frames.o[i + 1] - frames.o[i];
            inertia = inertia + Sym3::shift(d, h + d * (0.5 * m));
            h += d * m;
        }
        inertia = inertia + body.i.rotated(*r);
        h += *r * body.h;
        m += body.m;

        let z = r.z;
        let p = z.cross(h);
        let mut l = inertia * z;
        mass_matrix[(i, i)] = z.dot(l);
        for j in (0..i).rev() {
            l += (frames.o[j + 1] - frames.o[j]).cross(p);
            let entry = frames.r[j].z.dot(l);
            mass_matrix[(i, j)] = entry;
            mass_matrix[(j, i)] = entry;
        }
    }
    mass_matrix
}
