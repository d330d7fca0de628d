//! URDFs that are no seven-joint arm: each is refused, and the error names what is wrong.

use arm::{ArmModel, UrdfError};

fn rediestro_with(from: &str, to: &str) -> Result<ArmModel, UrdfError> {
    let urdf = ArmModel::rediestro_urdf();
    assert!(urdf.contains(from), "the file has changed: no {from}");
    ArmModel::from_urdf(&urdf.replacen(from, to, 1), None, "tool")
}

/// The element `<tag …name="name"…>…</tag>` of the built-in URDF.
fn element(tag: &str, name: &str) -> &'static str {
    let urdf = ArmModel::rediestro_urdf();
    let start = urdf.find(&format!("<{tag} name=\"{name}\"")).expect("an element of that name");
    let end = format!("</{tag}>");
    &urdf[start..start + urdf[start..].find(&end).expect("its end") + end.len()]
}

fn says(result: Result<ArmModel, UrdfError>, words: &[&str]) {
    let text = result.expect_err("this must be refused").to_string();
    for word in words {
        assert!(text.contains(word), "'{word}' is not in: {text}");
    }
}

#[test]
fn a_missing_tip_or_base_link_is_named_with_the_links_there_are() {
    says(ArmModel::from_urdf(ArmModel::rediestro_urdf(), None, "gripper"), &["tip", "gripper", "link_7", "tool"]);
    says(ArmModel::from_urdf(ArmModel::rediestro_urdf(), Some("floor"), "tool"), &["base", "floor"]);
    says(ArmModel::from_urdf(ArmModel::rediestro_urdf(), Some("tool"), "link_7"), &["'link_7'", "'tool'", "not hang"]);
}

#[test]
fn a_chain_closed_by_a_second_parent_is_refused_with_both_joints() {
    let strut = r#"<joint name="strut" type="fixed"><parent link="link_2"/><child link="link_6"/></joint></robot>"#;
    says(rediestro_with("</robot>", strut), &["closed chain", "link_6", "joint_6", "strut"]);
}

#[test]
fn a_chain_closed_to_a_ring_is_refused() {
    let strut = r#"<joint name="strut" type="fixed"><parent link="link_6"/><child link="base"/></joint></robot>"#;
    says(rediestro_with("</robot>", strut), &["closed chain", "loop"]);
}

#[test]
fn six_or_eight_joints_are_counted() {
    says(rediestro_with("\"joint_3\" type=\"revolute\"", "\"joint_3\" type=\"fixed\""), &["6 revolute", "exactly 7"]);
    says(
        rediestro_with("\"tool_mount\" type=\"fixed\"", "\"tool_mount\" type=\"continuous\""),
        &["8 revolute", "exactly 7", "tool_mount"],
    );
}

#[test]
fn a_prismatic_joint_in_the_chain_is_refused_with_the_reason() {
    says(
        rediestro_with("\"joint_3\" type=\"revolute\"", "\"joint_3\" type=\"prismatic\""),
        &["joint_3", "prismatic", "only revolute"],
    );
    says(rediestro_with("\"joint_3\" type=\"revolute\"", "\"joint_3\" type=\"helical\""), &["joint_3", "helical"]);
}

#[test]
fn a_missing_inertia_is_refused_with_the_links_name() {
    says(rediestro_with(element("link", "link_5"), "<link name=\"link_5\"/>"), &["link_5", "<inertial>"]);
    let link = element("link", "link_4");
    let start = link.find("<inertia ").expect("an inertia");
    let inertia = &link[start..start + link[start..].find("/>").expect("its end") + 2];
    says(rediestro_with(inertia, ""), &["link 'link_4'", "<inertia>", "line "]);
}

#[test]
fn a_mass_that_is_zero_negative_or_no_number_is_refused() {
    says(rediestro_with("<mass value=\"14.0\"/>", "<mass value=\"0\"/>"), &["link_1", "positive mass"]);
    says(rediestro_with("<mass value=\"14.0\"/>", "<mass value=\"-3\"/>"), &["link_1", "mass"]);
    says(rediestro_with("<mass value=\"14.0\"/>", "<mass value=\"NaN\"/>"), &["link_1", "NaN", "line"]);
    says(rediestro_with("<mass value=\"14.0\"/>", "<mass value=\"heavy\"/>"), &["link_1", "heavy", "value"]);
}

#[test]
fn an_inertia_that_breaks_the_triangle_inequality_is_refused_with_its_values() {
    let link = element("link", "link_2");
    let start = link.find("izz=\"").expect("izz");
    let end = start + 5 + link[start + 5..].find('"').expect("its end") + 1;
    says(rediestro_with(&link[start..end], "izz=\"7.5\""), &["link_2", "7.5", "triangle"]);
}

#[test]
fn reversed_and_missing_limits_are_refused_with_the_joints_name() {
    let joint = element("joint", "joint_6");
    let reversed = joint.replace("lower=\"-", "lower=\"").replace("upper=\"", "upper=\"-");
    says(rediestro_with(joint, &reversed), &["joint_6", "reversed"]);
    let start = joint.find("<limit").expect("a limit");
    let limit = &joint[start..start + joint[start..].find("/>").expect("its end") + 2];
    says(rediestro_with(joint, &joint.replace(limit, "")), &["joint_6", "limit"]);
    says(rediestro_with(joint, &joint.replace("velocity=\"2.5\"", "velocity=\"-1\"")), &["joint_6", "negative"]);
}

#[test]
fn numbers_must_be_finite_and_as_many_as_the_attribute_asks_for() {
    let joint = element("joint", "joint_2");
    says(rediestro_with(joint, &joint.replace("xyz=\"0 0 1\"", "xyz=\"0 0 inf\"")), &["joint_2", "three finite"]);
    says(rediestro_with(joint, &joint.replace("xyz=\"0 0 1\"", "xyz=\"0 1\"")), &["joint_2", "three finite"]);
    says(rediestro_with(joint, &joint.replace("xyz=\"0 0 1\"", "xyz=\"0 0 0\"")), &["joint_2", "axis"]);
}

#[test]
fn names_must_be_unique_and_refer_to_something() {
    says(rediestro_with("<link name=\"tool\"/>", "<link name=\"link_7\"/>"), &["second link", "link_7"]);
    says(rediestro_with("name=\"joint_4\"", "name=\"joint_3\""), &["second joint", "joint_3"]);
    says(rediestro_with("<parent link=\"link_3\"/>", "<parent link=\"lost\"/>"), &["joint_4", "lost"]);
}

#[test]
fn what_is_no_urdf_at_all_is_refused() {
    for text in ["", "<", "<robot>", "\u{0}\u{1}\u{2}", "[toml]\nkey = 1", "<robot xmlns:a='x'>"] {
        says(ArmModel::from_urdf(text, None, "tool"), &["XML"]);
    }
    says(ArmModel::from_urdf("<sdf/>", None, "tool"), &["<sdf>", "<robot>"]);
    let nested = format!("<robot>{}{}</robot>", "<a>".repeat(100_000), "</a>".repeat(100_000));
    assert!(ArmModel::from_urdf(&nested, None, "tool").is_err());
}

#[test]
fn any_axis_makes_the_same_arm_when_the_frames_follow() {
    // joint 7 about its own x, between frames turned so that this x is the old z
    let half = std::f64::consts::FRAC_PI_2;
    let joint = element("joint", "joint_7");
    let mount = element("joint", "tool_mount");
    let turned = format!(
        r#"<joint name="pre" type="fixed"><origin xyz="0.13555 0 0.57821" rpy="-1.3171999864801205 0 0"/>
        <parent link="link_6"/><child link="pre"/></joint><link name="pre"/>
        <joint name="joint_7" type="revolute"><origin rpy="0 -{half} 0"/><parent link="pre"/><child link="turn"/>
        <axis xyz="1 0 0"/><limit lower="-3" upper="3" velocity="1" effort="1"/></joint>
        <link name="turn"><inertial><mass value="1e-12"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
        <joint name="post" type="fixed"><origin rpy="0 {half} 0"/><parent link="turn"/><child link="link_7"/></joint>"#
    );
    assert!(joint.contains("-1.3171999864801205") && mount.contains("link_7"), "the file has changed");
    let other = rediestro_with(joint, &turned).expect("the same arm");
    let model = ArmModel::rediestro();
    let q = arm::JointVector::from([0.3, -0.4, 1.0, 0.2, -0.9, 0.5, 1.4]);
    let (a, b) = (arm::forward_kinematics(&model, &q), arm::forward_kinematics(&other, &q));
    assert!((a.p - b.p).amax() < 1e-14 && (a.r - b.r).amax() < 1e-14, "{} {}", a.r, b.r);
    assert!((arm::crba(&model, &q) - arm::crba(&other, &q)).amax() < 1e-9);
}
