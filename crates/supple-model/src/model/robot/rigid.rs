//! Detects elements of compliance without effect, because nothing can move where they act.

use super::Robot;
use crate::model::compliance::Element;

impl Robot {
    /// The error for an element between frames that cannot move relative to each other, or on a frame that
    /// cannot move: the key, what is wrong, and advice.
    pub(super) fn rigid(&self, element: &Element) -> Option<(&'static str, String, String)> {
        let names = self.bodies.frame_names();
        let body = |frame: usize| self.bodies.tree.body_of(self.bodies.link_of(frame));
        match element.kind.frames()[..] {
            [a, c] if body(a) == body(c) => {
                let message = format!(
                    "frames `{}` and `{}` cannot move relative to each other: no moving joint lies between them",
                    names[a], names[c]
                );
                Some(("frame_c", message, "choose frames on opposite sides of a joint".to_owned()))
            }
            [frame] if body(frame).is_none() => {
                let message = format!("frame `{}` cannot move: it is fixed to the world", names[frame]);
                Some(("frame", message, "name a frame that a joint moves".to_owned()))
            }
            _ => None,
        }
    }
}
