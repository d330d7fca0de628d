//! Reads an arm from a URDF: the chain of seven revolute joints between two links, with every inertia that moves with it.
//!
//! Fixed joints are merged into the link they belong to. Joints off the chain (fingers) are held at zero, and
//! [`ArmModel::held_joints`] names them. Anything that cannot be an arm of this kind is refused with an error that names
//! the element, and its line where the text itself is wrong.

mod document;

use crate::chain::Chain;
use crate::inertia::{Inertia, is_physical};
use crate::model::{ArmModel, DEFAULT_GRAVITY, Joint};
use crate::small::{M3, V3};
use crate::{DOF, JointVector};
use document::{Document, Kind, RawJoint};
use nalgebra::Matrix3;

/// Why a URDF is no seven-joint arm.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
pub enum UrdfError {
    /// Not well-formed XML; the text carries line and column.
    #[error("not well-formed XML: {0}")]
    Xml(String),
    /// The document's root is something else.
    #[error("the root element is <{0}>, expected <robot>")]
    NotARobot(String),
    /// An element without one of its parts.
    #[error("line {line}: {element} has no {part}")]
    Missing {
        /// The element, with its name.
        element: String,
        /// Line in the file.
        line: u32,
        /// What it lacks.
        part: &'static str,
    },
    /// An attribute that is not the number or numbers it should be.
    #[error("line {line}: {element}: {attribute}=\"{text}\" is not {expected}")]
    BadNumber {
        /// The element, with its name.
        element: String,
        /// Line in the file.
        line: u32,
        /// The attribute.
        attribute: &'static str,
        /// Its text.
        text: String,
        /// What would be right.
        expected: &'static str,
    },
    /// Two links or two joints of one name.
    #[error("line {line}: a second {kind} is named '{name}'")]
    Duplicate {
        /// "link" or "joint".
        kind: &'static str,
        /// The name.
        name: String,
        /// Line of the second one.
        line: u32,
    },
    /// A joint between links that are not there.
    #[error("joint '{joint}': there is no link '{link}'")]
    UnknownLink {
        /// The joint.
        joint: String,
        /// The link it names.
        link: String,
    },
    /// A joint type that URDF does not have.
    #[error("joint '{joint}': unknown type '{kind}'")]
    UnknownType {
        /// The joint.
        joint: String,
        /// The type it names.
        kind: String,
    },
    /// A link held by two joints.
    #[error("closed chain: link '{link}' is the child of joint '{first}' and of joint '{second}'")]
    TwoParents {
        /// The link.
        link: String,
        /// One joint.
        first: String,
        /// The other.
        second: String,
    },
    /// A link that is its own ancestor.
    #[error("closed chain: link '{link}' hangs on a loop of joints")]
    Loop {
        /// A link on the loop or beyond it.
        link: String,
    },
    /// The base or tip asked for is not in the file.
    #[error("there is no {role} link '{name}'; the links are: {known}")]
    NoSuchLink {
        /// "base" or "tip".
        role: &'static str,
        /// The name asked for.
        name: String,
        /// Names in the file (the first twenty).
        known: String,
    },
    /// The tip does not hang on the base.
    #[error("tip link '{tip}' does not hang on base link '{base}'")]
    NotBelowBase {
        /// The base.
        base: String,
        /// The tip.
        tip: String,
    },
    /// A joint that this model cannot hold.
    #[error("joint '{joint}' is {kind}: {reason}")]
    UnsupportedJoint {
        /// The joint.
        joint: String,
        /// Its type.
        kind: &'static str,
        /// Why it is refused.
        reason: &'static str,
    },
    /// Not seven.
    #[error("{found} revolute joints between '{base}' and '{tip}' ({names}); this arm has exactly 7")]
    JointCount {
        /// How many there are.
        found: usize,
        /// The base.
        base: String,
        /// The tip.
        tip: String,
        /// Their names.
        names: String,
    },
    /// Reversed or negative limits.
    #[error("joint '{joint}': {what}")]
    Limits {
        /// The joint.
        joint: String,
        /// What is wrong, with the values.
        what: String,
    },
    /// An axis of no direction.
    #[error("joint '{joint}': the axis has length zero")]
    ZeroAxis {
        /// The joint.
        joint: String,
    },
    /// A link that joints move but that weighs nothing.
    #[error("link '{link}' is moved by joint '{joint}' but has no <inertial> with a positive mass")]
    MissingInertia {
        /// The link.
        link: String,
        /// The joint that moves it.
        joint: String,
    },
    /// A mass below zero.
    #[error("link '{link}': mass {mass} kg is negative")]
    NegativeMass {
        /// The link.
        link: String,
        /// Its mass.
        mass: f64,
    },
    /// An inertia that no distribution of mass has.
    #[error(
        "link '{link}': no body has the inertia {diagonal:?} kg m² (ixx, iyy, izz; products {products:?}): a principal moment is \
         negative or exceeds the sum of the other two (triangle inequality)"
    )]
    ImpossibleInertia {
        /// The link.
        link: String,
        /// ixx, iyy, izz.
        diagonal: [f64; 3],
        /// ixy, ixz, iyz.
        products: [f64; 3],
    },
}

/// Reads the arm between `base` (default: the root above the tip) and `tip`.
pub(crate) fn read(xml: &str, base: Option<&str>, tip: &str) -> Result<ArmModel, UrdfError> {
    let doc = Document::parse(xml)?;
    let tip = find(&doc, "tip", tip)?;
    let (base, chain) = chain(&doc, base, tip)?;
    let moving: Vec<usize> = chain.iter().copied().filter(|&j| doc.joints[j].kind != Kind::Fixed).collect();
    for &j in &moving {
        check_chain_joint(&doc.joints[j])?;
    }
    let names: Vec<String> = moving.iter().map(|&j| doc.joints[j].name.clone()).collect();
    let Ok(joint_names) = <[String; DOF]>::try_from(names) else {
        return Err(UrdfError::JointCount {
            found: moving.len(),
            base: doc.links[base].name.clone(),
            tip: doc.links[tip].name.clone(),
            names: moving.iter().map(|&j| doc.joints[j].name.as_str()).collect::<Vec<_>>().join(", "),
        });
    };
    let mut model = ArmModel {
        name: doc.name.clone(),
        joint_names,
        joints: std::array::from_fn(|_| Joint { r: M3::IDENTITY, p: V3::ZERO, body: Inertia::default() }),
        tip_r: M3::IDENTITY,
        tip_p: V3::ZERO,
        gravity: DEFAULT_GRAVITY,
        lower: limit(&doc, &moving, |j| j.limit.lower),
        upper: limit(&doc, &moving, |j| j.limit.upper),
        speed: limit(&doc, &moving, |j| j.limit.velocity),
        effort: limit(&doc, &moving, |j| j.limit.effort),
        held: Vec::new(),
        slide: None,
        chain: Chain::default(),
    };
    assemble(&doc, base, tip, &moving, &mut model)?;
    Ok(model.settled())
}

fn limit(doc: &Document, moving: &[usize], of: impl Fn(&RawJoint) -> f64) -> JointVector {
    JointVector::from_fn(|i, _| of(&doc.joints[moving[i]]))
}

fn find(doc: &Document, role: &'static str, name: &str) -> Result<usize, UrdfError> {
    doc.link(name).ok_or_else(|| {
        let mut known: Vec<&str> = doc.links.iter().take(20).map(|l| l.name.as_str()).collect();
        if doc.links.len() > known.len() {
            known.push("…");
        }
        UrdfError::NoSuchLink { role, name: name.into(), known: known.join(", ") }
    })
}

/// The base link and the joints from it to `tip`, base first. The document has no loops.
fn chain(doc: &Document, base: Option<&str>, tip: usize) -> Result<(usize, Vec<usize>), UrdfError> {
    let wanted = base.map(|b| find(doc, "base", b)).transpose()?;
    let (mut link, mut chain) = (tip, Vec::new());
    while Some(link) != wanted {
        match doc.links[link].parent_joint {
            Some(j) => {
                chain.push(j);
                link = doc.joints[j].parent;
            }
            None => break,
        }
    }
    match wanted {
        Some(b) if b != link => {
            Err(UrdfError::NotBelowBase { base: doc.links[b].name.clone(), tip: doc.links[tip].name.clone() })
        }
        _ => {
            chain.reverse();
            Ok((link, chain))
        }
    }
}

fn check_chain_joint(joint: &RawJoint) -> Result<(), UrdfError> {
    let refuse =
        |reason| Err(UrdfError::UnsupportedJoint { joint: joint.name.clone(), kind: joint.kind.name(), reason });
    match joint.kind {
        Kind::Revolute | Kind::Continuous if joint.mimic => {
            refuse("it mimics another joint, but every joint of the arm has its own drive")
        }
        Kind::Revolute | Kind::Continuous | Kind::Fixed => Ok(()),
        _ => refuse("only revolute, continuous and fixed joints may lie between base and tip"),
    }?;
    let limit = &joint.limit;
    let wrong = |what: String| Err(UrdfError::Limits { joint: joint.name.clone(), what });
    if limit.lower > limit.upper {
        return wrong(format!("limits are reversed: lower {} rad > upper {} rad", limit.lower, limit.upper));
    }
    if limit.velocity < 0.0 || limit.effort < 0.0 {
        return wrong(format!("negative limit: velocity {} rad/s, effort {} Nm", limit.velocity, limit.effort));
    }
    Ok(())
}

/// Rigid placement: axes and origin.
#[derive(Clone, Copy)]
struct Placement {
    r: M3,
    p: V3,
}

impl Placement {
    fn then(self, r: M3, p: V3) -> Placement {
        Placement { r: self.r * r, p: self.p + self.r * p }
    }
}

/// Walks the tree below `base`, and gives every joint of the arm its placement and every link's inertia to the joint
/// that moves it.
fn assemble(doc: &Document, base: usize, tip: usize, moving: &[usize], model: &mut ArmModel) -> Result<(), UrdfError> {
    // a link, the joint of the arm that moves it, and the link's placement in that joint's frame
    let mut open = vec![(base, None::<usize>, Placement { r: M3::IDENTITY, p: V3::ZERO })];
    while let Some((link, mover, at)) = open.pop() {
        if let Some(i) = mover {
            model.joints[i].body = model.joints[i].body.plus(&checked_inertia(doc, link)?.moved(at.r, at.p));
            if link == tip {
                (model.tip_r, model.tip_p) = (at.r, at.p);
            }
        }
        for &j in doc.links[link].child_joints.iter().rev() {
            let joint = &doc.joints[j];
            let next = at.then(joint.r, joint.p);
            if let Some(i) = moving.iter().position(|&m| m == j) {
                let align = z_to(joint)?;
                let placed = next.then(align, V3::ZERO);
                (model.joints[i].r, model.joints[i].p) = (placed.r, placed.p);
                if doc.links[joint.child].mass.is_none_or(|m| m <= 0.0) {
                    let link = doc.links[joint.child].name.clone();
                    return Err(UrdfError::MissingInertia { link, joint: joint.name.clone() });
                }
                open.push((joint.child, Some(i), Placement { r: align.transpose(), p: V3::ZERO }));
            } else {
                match joint.kind {
                    Kind::Fixed => {}
                    Kind::Revolute | Kind::Continuous | Kind::Prismatic => model.held.push(joint.name.clone()),
                    Kind::Floating | Kind::Planar => {
                        return Err(UrdfError::UnsupportedJoint {
                            joint: joint.name.clone(),
                            kind: joint.kind.name(),
                            reason: "a joint off the chain must be one that can be held at zero",
                        });
                    }
                }
                open.push((joint.child, mover, next));
            }
        }
    }
    Ok(())
}

/// A link's inertia in its own frame; zero for a link without mass.
fn checked_inertia(doc: &Document, link: usize) -> Result<Inertia, UrdfError> {
    let link = &doc.links[link];
    let Some(mass) = link.mass else {
        return Ok(Inertia::default());
    };
    if mass < 0.0 {
        return Err(UrdfError::NegativeMass { link: link.name.clone(), mass });
    }
    let t = link.tensor;
    if !is_physical(&Matrix3::from(t)) {
        return Err(UrdfError::ImpossibleInertia {
            link: link.name.clone(),
            diagonal: [t.xx, t.yy, t.zz],
            products: [t.xy, t.xz, t.yz],
        });
    }
    Ok(Inertia::at_com(mass, V3::ZERO, t).moved(link.com_r, link.com_p))
}

/// A rotation that takes z to the joint's axis; the identity where the axis is z.
fn z_to(joint: &RawJoint) -> Result<M3, UrdfError> {
    let length = joint.axis.dot(joint.axis).sqrt();
    if length <= 1e-9 || length.is_infinite() {
        return Err(UrdfError::ZeroAxis { joint: joint.name.clone() });
    }
    let z = joint.axis * (1.0 / length);
    if z == M3::IDENTITY.z {
        return Ok(M3::IDENTITY);
    }
    let near = [(z.x.abs(), M3::IDENTITY.x), (z.y.abs(), M3::IDENTITY.y), (z.z.abs(), M3::IDENTITY.z)];
    let mut least = near[0];
    for candidate in near {
        if candidate.0 < least.0 {
            least = candidate;
        }
    }
    let x = least.1.cross(z);
    let x = x * (1.0 / x.dot(x).sqrt());
    Ok(M3 { x, y: z.cross(x), z })
}
