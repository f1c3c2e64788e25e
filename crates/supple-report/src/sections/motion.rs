//! The robot in motion, in three dimensions.

use maud::{Markup, html};
use supple::scene::Scene;

use super::contacts::in_words;
use super::context::Context;
use super::series::{runs, titled};
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
        pieces.push(
            context
                .plots
                .add_scene(&titled(part, "Motion by plan", task), scene::data_of_result(&scenes, part.sources)),
        );
        let touches: Vec<String> = runs.iter().filter_map(|run| in_words(&run.name, &run.task.contacts)).collect();
        if !touches.is_empty() {
            pieces.push(html! { p { (touches.join(" ")) } });
        }
    }
    if pieces.is_empty() { None } else { Some(html! { @for piece in pieces { (piece) } }) }
}
