//! The channels of a record: topic, ROS 2 type, and how long a late subscriber may wait for it.

/// A channel. The numeric order is the order of the topics' names, which the digest sorts by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Topic {
    /// Everything a control job knew.
    ControlState,
    /// X_d.
    Desired,
    /// What happened.
    Events,
    /// Joints as the control computer knows them.
    JointStates,
    /// True contact wrench.
    PlantContact,
    /// Joints as they are (link side, transmission torque).
    PlantJointStates,
    /// Everything about the arm.
    PlantState,
    /// True pose of the tool.
    PlantTool,
    /// URDF, once.
    RobotDescription,
    /// Xᵗ.
    Target,
    /// Tool, target and desired pose as frames.
    Tf,
    /// Task frame in the base frame, once.
    TfStatic,
    /// X as the control computer knows it.
    Tool,
    /// From sensor to actuator, one message per job.
    Latency,
    /// Use of the bus by each master, every second.
    Masters,
    /// Bus transfers, one message per window.
    Transfers,
    /// F_e as the control computer knows it.
    Wrench,
}

use Topic::*;

/// All channels, in order.
pub const TOPICS: [Topic; 17] = [
    ControlState,
    Desired,
    Events,
    JointStates,
    PlantContact,
    PlantJointStates,
    PlantState,
    PlantTool,
    RobotDescription,
    Target,
    Tf,
    TfStatic,
    Tool,
    Latency,
    Masters,
    Transfers,
    Wrench,
];

/// Channels below hold wall-clock values and are no part of a digest.
pub const WALL: &str = "/wall/";

impl Topic {
    /// Topic name.
    pub const fn name(self) -> &'static str {
        match self {
            ControlState => "/control/state",
            Desired => "/desired",
            Events => "/events",
            JointStates => "/joint_states",
            PlantContact => "/plant/contact",
            PlantJointStates => "/plant/joint_states",
            PlantState => "/plant/state",
            PlantTool => "/plant/tool",
            RobotDescription => "/robot_description",
            Target => "/target",
            Tf => "/tf",
            TfStatic => "/tf_static",
            Tool => "/tool",
            Latency => "/vme/latency",
            Masters => "/vme/masters",
            Transfers => "/vme/transfers",
            Wrench => "/wrench",
        }
    }

    /// ROS 2 type, which is the schema's name.
    pub const fn type_name(self) -> &'static str {
        match self {
            ControlState => "rack_msgs/msg/ControlState",
            PlantState => "rack_msgs/msg/PlantState",
            Latency => "rack_msgs/msg/Latency",
            Masters => "rack_msgs/msg/MasterUse",
            Transfers => "rack_msgs/msg/Transfers",
            Events => "diagnostic_msgs/msg/DiagnosticArray",
            JointStates | PlantJointStates => "sensor_msgs/msg/JointState",
            PlantContact | Wrench => "geometry_msgs/msg/WrenchStamped",
            Desired | PlantTool | Target | Tool => "geometry_msgs/msg/PoseStamped",
            RobotDescription => "std_msgs/msg/String",
            Tf | TfStatic => "tf2_msgs/msg/TFMessage",
        }
    }

    /// Sent once and kept for whoever comes later (transient local).
    pub const fn is_latched(self) -> bool {
        matches!(self, RobotDescription | TfStatic)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_are_numbered_in_the_order_of_their_names() {
        assert!(TOPICS.windows(2).all(|pair| pair[0].name() < pair[1].name() && (pair[0] as u8) + 1 == pair[1] as u8));
        assert_eq!(TOPICS[0] as u8, 0);
    }
}
