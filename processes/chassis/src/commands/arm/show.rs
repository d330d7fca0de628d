//! `vmerack arm show`: a model's joints, limits, masses and reach, and the built-in arm's drives, as text or JSON.

use std::io::Write;

use arm::ArmModel;
use arm::drives::DriveData;
use serde_json::{Value, json};

use super::Failure;

/// What of the built-in arm is no published figure.
const SURROGATES: &str =
    "masses, centres of mass, inertias, joint, speed and torque limits, all drive data";

pub fn run(
    model: &ArmModel,
    built_in: bool,
    json: bool,
    out: &mut impl Write,
) -> Result<(), Failure> {
    let drives = built_in.then(DriveData::rediestro);
    let written = if json {
        writeln!(out, "{:#}", as_json(model, drives.as_ref()))
    } else {
        write_text(model, drives.as_ref(), out)
    };
    written.map_err(Failure::Output)
}

fn write_text(
    model: &ArmModel,
    drives: Option<&DriveData>,
    out: &mut impl Write,
) -> std::io::Result<()> {
    let surrogate = if drives.is_some() { " (surrogate)" } else { "" };
    writeln!(out, "{}: seven revolute joints", model.name())?;
    writeln!(out, "\nJoints, limits and masses{surrogate}")?;
    writeln!(
        out,
        "  joint             lower deg  upper deg  speed rad/s  torque Nm  link mass kg"
    )?;
    for (i, name) in model.joint_names().iter().enumerate() {
        writeln!(
            out,
            "  {name:<16} {:>10.1} {:>10.1} {:>12.2} {:>10.1} {:>13.3}",
            model.lower_limits()[i].to_degrees(),
            model.upper_limits()[i].to_degrees(),
            model.speed_limits()[i],
            model.effort_limits()[i],
            model.link_masses()[i],
        )?;
    }
    writeln!(
        out,
        "  moving mass {:.3} kg{surrogate}",
        model.link_masses().sum()
    )?;
    let (reach, shoulder) = (model.reach(), model.shoulder());
    writeln!(
        out,
        "  reach {reach:.3} m from ({:.3}, {:.3}, {:.3}), joint limits kept",
        shoulder.x, shoulder.y, shoulder.z
    )?;
    let g = model.gravity();
    writeln!(
        out,
        "  gravity ({}, {}, {}) m/s² in base axes",
        g.x, g.y, g.z
    )?;
    if !model.held_joints().is_empty() {
        writeln!(
            out,
            "  joints off the chain, held at zero: {}",
            model.held_joints().join(", ")
        )?;
    }
    let Some(drives) = drives else { return Ok(()) };
    writeln!(out, "\nDrives, at the output side (all surrogate)")?;
    writeln!(
        out,
        "  joint        N  rotor kg m²  stiffness Nm/rad  Coulomb Nm  viscous Nms/rad  limit Nm  Nm/V  brake Nm"
    )?;
    for d in &drives.joints {
        writeln!(
            out,
            "  {:<9} {:>4} {:>12} {:>17} {:>11} {:>16} {:>9} {:>5} {:>9}",
            d.name,
            d.gear_ratio,
            d.rotor_inertia_at_output_kg_m2,
            d.stiffness_nm_per_rad,
            d.coulomb_nm,
            d.viscous_nms_per_rad,
            d.torque_limit_nm,
            d.amplifier_nm_per_v,
            d.brake_nm,
        )?;
    }
    let d = &drives.joints[0];
    writeln!(
        out,
        "  all: breakaway {} × (Coulomb + {} × load), Stribeck speed {} rad/s, presliding {} rad, spring damping ratio {}, \
         encoder {} lines × 4 on the motor",
        d.breakaway_ratio,
        d.load_part,
        d.stribeck_speed_rad_per_s,
        d.presliding_rad,
        d.damping_ratio,
        d.encoder_lines
    )?;
    writeln!(
        out,
        "\nSurrogates, plausible but not measured: {SURROGATES}."
    )?;
    writeln!(
        out,
        "Published: the Denavit–Hartenberg table (its first offset from memory of the literature)."
    )
}

fn as_json(model: &ArmModel, drives: Option<&DriveData>) -> Value {
    let joints: Vec<Value> = (0..arm::DOF)
        .map(|i| {
            let body = model.link_inertia(i);
            // JSON has no infinity: a continuous joint's limits are null
            json!({
                "name": model.joint_names()[i],
                "lower_rad": model.lower_limits()[i],
                "upper_rad": model.upper_limits()[i],
                "speed_limit_rad_per_s": model.speed_limits()[i],
                "torque_limit_nm": model.effort_limits()[i],
                "link_mass_kg": body.mass,
                "link_com_m": body.com.as_slice(),
            })
        })
        .collect();
    let drives = drives.map(|drives| {
        let drive = |d: &arm::drives::JointDrive| {
            json!({
                "name": d.name,
                "gear_ratio": d.gear_ratio,
                "rotor_inertia_at_output_kg_m2": d.rotor_inertia_at_output_kg_m2,
                "stiffness_nm_per_rad": d.stiffness_nm_per_rad,
                "damping_ratio": d.damping_ratio,
                "coulomb_nm": d.coulomb_nm,
                "viscous_nms_per_rad": d.viscous_nms_per_rad,
                "breakaway_ratio": d.breakaway_ratio,
                "stribeck_speed_rad_per_s": d.stribeck_speed_rad_per_s,
                "load_part": d.load_part,
                "presliding_rad": d.presliding_rad,
                "kinematic_error_rad": d.kinematic_error_rad,
                "torque_limit_nm": d.torque_limit_nm,
                "amplifier_nm_per_v": d.amplifier_nm_per_v,
                "brake_nm": d.brake_nm,
                "encoder_lines": d.encoder_lines,
            })
        };
        drives.joints.iter().map(drive).collect::<Vec<_>>()
    });
    json!({
        "name": model.name(),
        "joints": joints,
        "moving_mass_kg": model.link_masses().sum(),
        "reach_m": model.reach(),
        "reach_from_m": model.shoulder().as_slice(),
        "gravity_m_per_s2": model.gravity().as_slice(),
        "held_joints": model.held_joints(),
        "surrogates": drives.is_some().then_some(SURROGATES),
        "drives": drives,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_arm_is_shown_with_its_surrogates_and_a_users_arm_without_drives() {
        let mut text = Vec::new();
        run(&ArmModel::rediestro(), true, false, &mut text).expect("written");
        let text = String::from_utf8(text).expect("text");
        for word in [
            "joint_7",
            "moving mass 51.000 kg",
            "reach 1.",
            "40000",
            "(surrogate)",
            "Published",
        ] {
            assert!(text.contains(word), "no {word} in\n{text}");
        }
        let shown = as_json(&ArmModel::rediestro(), None);
        assert!(shown["drives"].is_null() && shown["surrogates"].is_null());
        assert_eq!(shown["joints"].as_array().map(Vec::len), Some(7));
    }
}
