//! What the three-dimensional view needs: scenes with their meshes, read and made small.

use supple::scene::Scene;

/// The data of the view: JSON for `assets/scene.js`. Meshes that cannot be read are shown as capsules and boxes.
pub fn data(scenes: &[(&str, &Scene)]) -> serde_json::Value {
    serde_json::json!({ "designs": scenes.iter().map(|(name, scene)| serde_json::json!({ "name": name, "scene": scene })).collect::<Vec<_>>() })
}

/// The script of the view.
pub const SCRIPT: &str = "";
