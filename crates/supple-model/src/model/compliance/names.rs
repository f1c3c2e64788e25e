use crate::physics::DependentJoint;
use crate::quantity::Unfit;

/// The names that an element may refer to.
///
/// Example: the [module](crate::model::coupling).
#[derive(Clone, Copy, Debug)]
pub struct Names<'a> {
    /// The degrees of freedom.
    pub(in crate::model) joints: &'a [String],
    /// All frames.
    pub(in crate::model) frames: &'a [String],
    /// Joints that do not move on their own.
    pub(in crate::model) dependent: &'a [DependentJoint],
    /// The robot's file.
    pub(in crate::model) robot: &'a supple_robot::Robot,
}

impl Names<'_> {
    /// The degree of freedom of a joint.
    ///
    /// # Errors
    /// If the robot has no such moving joint; `key` is the key that names it.
    pub fn joint(&self, key: &'static str, name: &str) -> Result<usize, Unfit> {
        if let Some((message, help)) = DependentJoint::message(name, self.dependent) {
            return Err(Unfit { help: Some(help), ..Unfit::new(key, message) });
        }
        find(key, "moving joint", name, self.joints)
    }

    /// The number of a frame.
    ///
    /// # Errors
    /// If the robot has no such link or frame; `key` is the key that names it.
    pub fn frame(&self, key: &'static str, name: &str) -> Result<usize, Unfit> {
        find(key, "link or frame", name, self.frames)
    }
}

/// The index of a name in a list.
pub(in crate::model) fn find(key: &'static str, what: &str, name: &str, list: &[String]) -> Result<usize, Unfit> {
    list.iter()
        .position(|other| other == name)
        .ok_or_else(|| Unfit::unknown(key, &format!("the robot has no {what} `{name}`"), name, list))
}
