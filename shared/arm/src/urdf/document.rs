//! The parts of a URDF file that matter to an arm's dynamics, as written: links with inertia, joints with placement.
//!
//! Numbers must be finite; names unique; joints must refer to links that exist; and no link may have two parents or be
//! its own ancestor. Everything else (visuals, collisions, transmissions, extensions) is skipped.

use super::UrdfError;
use crate::small::{M3, Sym3, V3, v3};
use roxmltree::Node;
use std::collections::BTreeMap;

pub(super) struct Document {
    pub name: String,
    pub links: Vec<RawLink>,
    pub joints: Vec<RawJoint>,
    by_name: BTreeMap<String, usize>,
}

pub(super) struct RawLink {
    pub name: String,
    /// None without `<inertial>`.
    pub mass: Option<f64>,
    /// Placement of the inertial frame in the link's.
    pub com_r: M3,
    pub com_p: V3,
    /// Tensor about the centre of mass, axes of the inertial frame.
    pub tensor: Sym3,
    pub parent_joint: Option<usize>,
    pub child_joints: Vec<usize>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Revolute,
    Continuous,
    Prismatic,
    Fixed,
    Floating,
    Planar,
}

impl Kind {
    const ALL: [Kind; 6] =
        [Kind::Revolute, Kind::Continuous, Kind::Prismatic, Kind::Fixed, Kind::Floating, Kind::Planar];

    pub fn name(self) -> &'static str {
        match self {
            Kind::Revolute => "revolute",
            Kind::Continuous => "continuous",
            Kind::Prismatic => "prismatic",
            Kind::Fixed => "fixed",
            Kind::Floating => "floating",
            Kind::Planar => "planar",
        }
    }
}

pub(super) struct RawJoint {
    pub name: String,
    pub kind: Kind,
    pub parent: usize,
    pub child: usize,
    /// Placement of the child link in the parent link at zero.
    pub r: M3,
    pub p: V3,
    pub axis: V3,
    pub limit: Limit,
    pub mimic: bool,
}

#[derive(Clone, Copy)]
pub(super) struct Limit {
    pub lower: f64,
    pub upper: f64,
    pub velocity: f64,
    pub effort: f64,
}

impl Document {
    pub fn parse(xml: &str) -> Result<Document, UrdfError> {
        let tree = roxmltree::Document::parse(xml).map_err(|e| UrdfError::Xml(e.to_string()))?;
        let robot = tree.root_element();
        if robot.tag_name().name() != "robot" {
            return Err(UrdfError::NotARobot(robot.tag_name().name().into()));
        }
        let name = robot.attribute("name").unwrap_or("unnamed").into();
        let mut doc = Document { name, links: Vec::new(), joints: Vec::new(), by_name: BTreeMap::new() };
        for node in children(robot, "link") {
            let link = link(node)?;
            if doc.by_name.insert(link.name.clone(), doc.links.len()).is_some() {
                return Err(UrdfError::Duplicate { kind: "link", name: link.name, line: line(node) });
            }
            doc.links.push(link);
        }
        let mut names = BTreeMap::new();
        for node in children(robot, "joint") {
            let joint = doc.joint(node)?;
            if names.insert(joint.name.clone(), ()).is_some() {
                return Err(UrdfError::Duplicate { kind: "joint", name: joint.name, line: line(node) });
            }
            let index = doc.joints.len();
            let child = &mut doc.links[joint.child];
            if let Some(first) = child.parent_joint.replace(index) {
                return Err(UrdfError::TwoParents {
                    link: child.name.clone(),
                    first: doc.joints[first].name.clone(),
                    second: joint.name,
                });
            }
            doc.links[joint.parent].child_joints.push(index);
            doc.joints.push(joint);
        }
        doc.check_no_loop()?;
        Ok(doc)
    }

    pub fn link(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// Every link has one parent at most, so those that no root reaches hang on a loop.
    fn check_no_loop(&self) -> Result<(), UrdfError> {
        let mut reached = vec![false; self.links.len()];
        let mut open: Vec<usize> = (0..self.links.len()).filter(|&l| self.links[l].parent_joint.is_none()).collect();
        while let Some(l) = open.pop() {
            reached[l] = true;
            open.extend(self.links[l].child_joints.iter().map(|&j| self.joints[j].child));
        }
        match reached.iter().position(|r| !r) {
            Some(l) => Err(UrdfError::Loop { link: self.links[l].name.clone() }),
            None => Ok(()),
        }
    }

    fn joint(&self, node: Node) -> Result<RawJoint, UrdfError> {
        let name = name(node)?;
        let text = node.attribute("type").ok_or_else(|| missing(node, "type"))?;
        let kind = Kind::ALL
            .into_iter()
            .find(|k| k.name() == text)
            .ok_or_else(|| UrdfError::UnknownType { joint: name.clone(), kind: text.into() })?;
        let end = |tag: &'static str, part: &'static str| {
            let link = child(node, tag).and_then(|n| n.attribute("link")).ok_or_else(|| missing(node, part))?;
            self.link(link).ok_or_else(|| UrdfError::UnknownLink { joint: name.clone(), link: link.into() })
        };
        let parent = end("parent", "<parent link=…>")?;
        let child_link = end("child", "<child link=…>")?;
        let (r, p) = origin(node)?;
        let axis = match child(node, "axis") {
            Some(axis) => triple(axis, "xyz")?.ok_or_else(|| missing(axis, "xyz"))?,
            None => v3(1.0, 0.0, 0.0),
        };
        let limit = limit(node, kind)?;
        Ok(RawJoint { name, kind, parent, child: child_link, r, p, axis, limit, mimic: child(node, "mimic").is_some() })
    }
}

fn limit(joint: Node, kind: Kind) -> Result<Limit, UrdfError> {
    let node = child(joint, "limit");
    let number_or = |attribute, default| node.map_or(Ok(None), |n| number(n, attribute)).map(|v| v.unwrap_or(default));
    if kind == Kind::Revolute {
        let node = node.ok_or_else(|| missing(joint, "<limit>, which a revolute joint needs"))?;
        for attribute in ["velocity", "effort"] {
            if node.attribute(attribute).is_none() {
                return Err(missing(node, attribute));
            }
        }
    }
    let bounded = matches!(kind, Kind::Revolute | Kind::Prismatic);
    Ok(Limit {
        lower: if bounded { number_or("lower", 0.0)? } else { f64::NEG_INFINITY },
        upper: if bounded { number_or("upper", 0.0)? } else { f64::INFINITY },
        velocity: number_or("velocity", f64::INFINITY)?,
        effort: number_or("effort", f64::INFINITY)?,
    })
}

fn link(node: Node) -> Result<RawLink, UrdfError> {
    let mut link = RawLink {
        name: name(node)?,
        mass: None,
        com_r: M3::IDENTITY,
        com_p: V3::ZERO,
        tensor: Sym3::default(),
        parent_joint: None,
        child_joints: Vec::new(),
    };
    let Some(inertial) = child(node, "inertial") else {
        return Ok(link);
    };
    (link.com_r, link.com_p) = origin(inertial)?;
    let mass = child(inertial, "mass").ok_or_else(|| missing(inertial, "<mass>"))?;
    link.mass = Some(required(mass, "value")?);
    let inertia = child(inertial, "inertia").ok_or_else(|| missing(inertial, "<inertia>"))?;
    link.tensor = Sym3 {
        xx: required(inertia, "ixx")?,
        xy: required(inertia, "ixy")?,
        xz: required(inertia, "ixz")?,
        yy: required(inertia, "iyy")?,
        yz: required(inertia, "iyz")?,
        zz: required(inertia, "izz")?,
    };
    Ok(link)
}

/// `<origin xyz rpy>`: fixed-axis roll, pitch, yaw.
fn origin(node: Node) -> Result<(M3, V3), UrdfError> {
    let Some(origin) = child(node, "origin") else {
        return Ok((M3::IDENTITY, V3::ZERO));
    };
    let p = triple(origin, "xyz")?.unwrap_or(V3::ZERO);
    let rpy = triple(origin, "rpy")?.unwrap_or(V3::ZERO);
    Ok((crate::rotation::from_rpy(rpy.x, rpy.y, rpy.z).into(), p))
}

fn children<'a, 'i>(node: Node<'a, 'i>, tag: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |n| n.has_tag_name(tag))
}

fn child<'a, 'i>(node: Node<'a, 'i>, tag: &'static str) -> Option<Node<'a, 'i>> {
    children(node, tag).next()
}

fn name(node: Node) -> Result<String, UrdfError> {
    node.attribute("name").map(String::from).ok_or_else(|| missing(node, "name"))
}

fn required(node: Node, attribute: &'static str) -> Result<f64, UrdfError> {
    number(node, attribute)?.ok_or_else(|| missing(node, attribute))
}

fn number(node: Node, attribute: &'static str) -> Result<Option<f64>, UrdfError> {
    let Some(text) = node.attribute(attribute) else {
        return Ok(None);
    };
    finite(text).map(Some).ok_or_else(|| bad_number(node, attribute, "a finite number"))
}

fn triple(node: Node, attribute: &'static str) -> Result<Option<V3>, UrdfError> {
    let Some(text) = node.attribute(attribute) else {
        return Ok(None);
    };
    let mut words = text.split_ascii_whitespace().map(finite);
    match (words.next(), words.next(), words.next(), words.next()) {
        (Some(Some(x)), Some(Some(y)), Some(Some(z)), None) => Ok(Some(v3(x, y, z))),
        _ => Err(bad_number(node, attribute, "three finite numbers")),
    }
}

fn finite(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|v: &f64| v.is_finite())
}

fn line(node: Node) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

/// "joint 'a'", or "<mass> of link 'b'" for an element that has no name.
fn described(node: Node) -> String {
    let tag = node.tag_name().name();
    match node.attribute("name") {
        Some(name) => format!("{tag} '{name}'"),
        None => match node.ancestors().skip(1).find(|n| n.attribute("name").is_some()) {
            Some(owner) => format!("<{tag}> of {}", described(owner)),
            None => format!("<{tag}>"),
        },
    }
}

fn missing(node: Node, part: &'static str) -> UrdfError {
    UrdfError::Missing { element: described(node), line: line(node), part }
}

fn bad_number(node: Node, attribute: &'static str, expected: &'static str) -> UrdfError {
    let mut text: String = node.attribute(attribute).unwrap_or_default().chars().take(60).collect();
    if text.is_empty() {
        text = "(empty)".into();
    }
    UrdfError::BadNumber { element: described(node), line: line(node), attribute, text, expected }
}
