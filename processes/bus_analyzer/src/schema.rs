//! Message definitions in the `ros2msg` form: a type's own text, then those of all types that it uses.

/// Text of a definition by `package/Name`, from `schema/`.
const DEFINITIONS: &[(&str, &str)] = &[
    ("builtin_interfaces/Time", include_str!("schema/builtin_interfaces_Time.msg")),
    ("diagnostic_msgs/DiagnosticArray", include_str!("schema/diagnostic_msgs_DiagnosticArray.msg")),
    ("diagnostic_msgs/DiagnosticStatus", include_str!("schema/diagnostic_msgs_DiagnosticStatus.msg")),
    ("diagnostic_msgs/KeyValue", include_str!("schema/diagnostic_msgs_KeyValue.msg")),
    ("geometry_msgs/Accel", include_str!("schema/geometry_msgs_Accel.msg")),
    ("geometry_msgs/Point", include_str!("schema/geometry_msgs_Point.msg")),
    ("geometry_msgs/Pose", include_str!("schema/geometry_msgs_Pose.msg")),
    ("geometry_msgs/PoseStamped", include_str!("schema/geometry_msgs_PoseStamped.msg")),
    ("geometry_msgs/Quaternion", include_str!("schema/geometry_msgs_Quaternion.msg")),
    ("geometry_msgs/Transform", include_str!("schema/geometry_msgs_Transform.msg")),
    ("geometry_msgs/TransformStamped", include_str!("schema/geometry_msgs_TransformStamped.msg")),
    ("geometry_msgs/Twist", include_str!("schema/geometry_msgs_Twist.msg")),
    ("geometry_msgs/Vector3", include_str!("schema/geometry_msgs_Vector3.msg")),
    ("geometry_msgs/Wrench", include_str!("schema/geometry_msgs_Wrench.msg")),
    ("geometry_msgs/WrenchStamped", include_str!("schema/geometry_msgs_WrenchStamped.msg")),
    ("rack_msgs/ControlState", include_str!("schema/rack_msgs_ControlState.msg")),
    ("rack_msgs/Latency", include_str!("schema/rack_msgs_Latency.msg")),
    ("rack_msgs/MasterUse", include_str!("schema/rack_msgs_MasterUse.msg")),
    ("rack_msgs/PlantState", include_str!("schema/rack_msgs_PlantState.msg")),
    ("rack_msgs/Transfer", include_str!("schema/rack_msgs_Transfer.msg")),
    ("rack_msgs/Transfers", include_str!("schema/rack_msgs_Transfers.msg")),
    ("sensor_msgs/JointState", include_str!("schema/sensor_msgs_JointState.msg")),
    ("std_msgs/Header", include_str!("schema/std_msgs_Header.msg")),
    ("std_msgs/String", include_str!("schema/std_msgs_String.msg")),
    ("tf2_msgs/TFMessage", include_str!("schema/tf2_msgs_TFMessage.msg")),
];

/// The definition of a type (`package/msg/Name`) with all that it needs; `None` where it is not known.
pub fn definition(type_name: &str) -> Option<String> {
    let name = type_name.replacen("/msg/", "/", 1);
    let mut needed = vec![find(&name)?];
    let mut next = 0;
    while next < needed.len() {
        for used in uses(needed[next].1) {
            if !needed.iter().any(|(known, _)| *known == used) {
                needed.push(find(used)?);
            }
        }
        next += 1;
    }
    let mut text = needed[0].1.to_owned();
    for (name, definition) in &needed[1..] {
        text.push_str(&format!("{}\nMSG: {name}\n{definition}", "=".repeat(80)));
    }
    Some(text)
}

fn find(name: &str) -> Option<(&'static str, &'static str)> {
    DEFINITIONS.iter().copied().find(|(known, _)| *known == name)
}

/// Types of other packages that a definition's fields have.
fn uses(definition: &str) -> impl Iterator<Item = &str> {
    definition
        .lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| line.split_whitespace().next())
        .map(|field| field.split('[').next().unwrap_or(field))
        .filter(|field| field.contains('/'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topics::TOPICS;

    #[test]
    fn every_channel_has_a_schema_with_all_that_it_needs() {
        for topic in TOPICS {
            let text = definition(topic.type_name()).unwrap_or_else(|| panic!("{}", topic.name()));
            for used in uses(&text) {
                assert!(text.contains(&format!("MSG: {used}\n")), "{}: {used}", topic.name());
            }
        }
        assert_eq!(definition("std_msgs/msg/Colour"), None);
    }
}
