//! The kinds of compliance of the library.

use super::any::Couplings;
use super::bushing::Bushing;
use super::contact::Contact;
use super::elastic_joint::ElasticJoint;
use super::spring::Spring;

impl Default for Couplings {
    /// The kinds of the library.
    fn default() -> Self {
        let mut kinds = Self::none();
        // 6-D spring and damper between two frames.
        kinds.add::<Bushing>();
        // Point or sphere against a wall of uncertain position.
        kinds.add::<Contact>();
        // Spring and damper between a motor and its joint.
        kinds.add::<ElasticJoint>();
        // Spring and damper beside a joint.
        kinds.add::<Spring>();
        kinds
    }
}
