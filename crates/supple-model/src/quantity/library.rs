//! The kinds of quantities of the library.

use super::center_of_mass::CenterOfMass;
use super::clearance::Clearance;
use super::contact_force::ContactForce;
use super::control::Control;
use super::coupling_deflection::CouplingDeflection;
use super::coupling_force::CouplingForce;
use super::drive_effort::DriveEffort;
use super::frame_point::FramePoint;
use super::frame_pose::FramePose;
use super::frame_turn::FrameTurn;
use super::frame_velocity::FrameVelocity;
use super::from_file::FromFile;
use super::joint_acceleration::JointAcceleration;
use super::joint_position::JointPosition;
use super::joint_torque::JointTorque;
use super::joint_velocity::JointVelocity;
use super::kinds::Kinds;
use super::penetration::Penetration;
use super::power::Power;
use super::signal::Signal;
use super::state::State;
use super::state_and_control::StateAndControl;

impl Default for Kinds {
    /// The kinds of the library.
    fn default() -> Self {
        let mut kinds = Self::none();
        kinds.add::<CenterOfMass>();
        kinds.add::<Clearance>();
        kinds.add::<ContactForce>();
        kinds.add::<Control>();
        kinds.add::<CouplingDeflection>();
        kinds.add::<CouplingForce>();
        kinds.add::<DriveEffort>();
        kinds.add::<FromFile>();
        kinds.add::<FramePoint>();
        kinds.add::<FramePose>();
        kinds.add::<FrameTurn>();
        kinds.add::<FrameVelocity>();
        kinds.add::<JointAcceleration>();
        kinds.add::<JointPosition>();
        kinds.add::<JointTorque>();
        kinds.add::<JointVelocity>();
        kinds.add::<Penetration>();
        kinds.add::<Power>();
        kinds.add::<Signal>();
        kinds.add::<State>();
        kinds.add::<StateAndControl>();
        kinds
    }
}
