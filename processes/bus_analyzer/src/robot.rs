//! What a viewer needs to draw the arm: its URDF and the frame that it stands in.

use scenario::{Robot, Scenario};

/// The URDF of the scenario's arm and the name of its base link.
pub struct Description {
    /// URDF text.
    pub urdf: String,
    /// Base link, parent of the task frame.
    pub base_link: String,
}

/// Reads or makes the description. The message names the file and what is wrong with it.
pub fn describe(scenario: &Scenario) -> Result<Description, String> {
    let urdf = match (scenario.arm.robot, &scenario.arm.urdf) {
        (Robot::Rediestro, _) => arm::ArmModel::rediestro_urdf().to_owned(),
        (Robot::Slide, _) => slide_urdf(scenario.controller_arm()?.joint_names()),
        (Robot::Urdf, Some(file)) => {
            scenario::read_text(file, scenario::URDF_LIMIT).map_err(|error| format!("{file}: {error}"))?
        }
        (Robot::Urdf, None) => return Err("robot = \"urdf\" needs the key arm.urdf".into()),
    };
    let base_link = match &scenario.arm.base_link {
        Some(link) => link.clone(),
        None => root_link(&urdf)?,
    };
    Ok(Description { urdf, base_link })
}

/// The link that is no joint's child.
fn root_link(urdf: &str) -> Result<String, String> {
    let document = roxmltree::Document::parse(urdf).map_err(|error| format!("URDF: {error}"))?;
    let children: Vec<_> = document
        .descendants()
        .filter(|node| node.has_tag_name("child"))
        .filter_map(|node| node.attribute("link"))
        .collect();
    let mut links = document
        .root_element()
        .children()
        .filter(|node| node.has_tag_name("link"))
        .filter_map(|node| node.attribute("name"));
    links
        .find(|link| !children.contains(link))
        .map(str::to_owned)
        .ok_or_else(|| "URDF: it has no root link".into())
}

/// One carriage on z; the joints that the slide does not have stand still and carry nothing.
fn slide_urdf(joints: &[String; messages::JOINTS]) -> String {
    let mut urdf = String::from("<robot name=\"slide\">\n  <link name=\"base\"/>\n");
    for (i, joint) in joints.iter().enumerate() {
        let (parent, kind) = if i == 0 {
            ("base", "prismatic")
        } else {
            ("carriage", "continuous")
        };
        let child = if i == 0 {
            "carriage".to_owned()
        } else {
            format!("{joint}_unused")
        };
        let limit = if i == 0 {
            "<limit lower=\"-10\" upper=\"10\" effort=\"1e6\" velocity=\"100\"/>"
        } else {
            ""
        };
        urdf.push_str(&format!(
            "  <link name=\"{child}\"/>\n  <joint name=\"{joint}\" type=\"{kind}\"><parent link=\"{parent}\"/>\
             <child link=\"{child}\"/><axis xyz=\"0 0 1\"/>{limit}</joint>\n"
        ));
    }
    urdf + "</robot>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_base_link_is_the_one_that_no_joint_carries() {
        assert_eq!(
            root_link(arm::ArmModel::rediestro_urdf()).as_deref(),
            Ok("base")
        );
        let slide = slide_urdf(arm::ArmModel::slide(10.0).joint_names());
        assert_eq!(root_link(&slide).as_deref(), Ok("base"));
        assert!(root_link("<robot").is_err());
    }
}
