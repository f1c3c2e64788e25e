//! The robot in motion, in three dimensions.

use maud::{Markup, html};
use supple::scene::Scene;

use super::Context;
use super::series::{runs, titled};
use crate::html::json_text;
use crate::scene;

/// A view by task, of all designs that can be drawn.
pub fn section(context: &mut Context) -> Option<Markup> {
    let part = context.part;
    let mut pieces = Vec::new();
    for task in 0..part.about.tasks.len() {
        let runs = runs(part, task);
        let scenes: Vec<(&str, &Scene)> =
            runs.iter().filter_map(|run| Some((run.name.as_str(), run.trajectory.scene.as_ref()?))).collect();
        if scenes.is_empty() {
            continue;
        }
        // Data that is no JSON cannot be: it was made as JSON.
        let Ok(data) = json_text(&scene::data(&scenes)) else { continue };
        pieces.push(html! {
            figure.scene {
                p.title { (titled(part, "Motion by plan", task)) }
                div.view data-scene {}
                script type="application/json" { (maud::PreEscaped(data)) }
            }
        });
    }
    if pieces.is_empty() { None } else { Some(html! { @for piece in pieces { (piece) } }) }
}
