//! Numbers that a task gives in place of, or beside, those of the robot file.

use crate::Value;

/// Numbers of a link or joint that the task overrides; the others are those of the robot's file.
#[derive(Clone, Debug)]
pub enum Override {
    Link {
        link: usize,
        mass: Option<Value>,
        /// Factor on the moments of inertia.
        inertia_scale: Option<Value>,
        center: Option<[Value; 3]>,
    },
    Joint {
        joint: usize,
        damping: Option<Value>,
        friction: Option<Value>,
        armature: Option<Value>,
        stiffness: Option<Value>,
        rest: Option<Value>,
        /// Offset added to the joint's position in the parent link.
        offset: Option<[Value; 3]>,
        /// Factor on the joint's position in the parent link; it scales that link's length.
        length_scale: Option<Value>,
    },
}

/// A frame that the task defines on a link.
#[derive(Clone, Debug)]
pub struct FrameNumbers {
    pub name: String,
    /// Number of the frame that it is defined in: a link, or another frame of the robot's file.
    pub on: usize,
    pub position: [Value; 3],
    pub rpy: [Value; 3],
}

impl Override {
    /// The keys that were given, with their values, and the minimum of each; `None` if any value is valid.
    pub fn rules(&self) -> Vec<(&'static str, &Value, Option<f64>)> {
        let list = match self {
            Self::Link { mass, inertia_scale, .. } => {
                vec![("mass", mass, Some(0.0)), ("inertia_scale", inertia_scale, Some(0.0))]
            }
            Self::Joint { damping, friction, armature, stiffness, length_scale, .. } => vec![
                ("damping", damping, Some(0.0)),
                ("friction", friction, Some(0.0)),
                ("armature", armature, Some(0.0)),
                ("stiffness", stiffness, Some(0.0)),
                ("length_scale", length_scale, Some(0.0)),
            ],
        };
        list.into_iter().filter_map(|(key, value, least)| Some((key, value.as_ref()?, least))).collect()
    }
}
