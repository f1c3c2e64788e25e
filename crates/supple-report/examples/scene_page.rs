//! Writes a page with the three-dimensional view of the tasks of a task file, at its initial parameters:
//! `cargo run --release -p supple-report --example scene_page -- tasks/iiwa_door.toml page.html [k1=1000 k2=1000]`.
//! With parameters set, the motion with them is shown beside that with the initial ones.

use std::error::Error;
use std::path::Path;

use supple::EvaluateOptions;
use supple::scene::Scene;
use supple_report::scene::{SCRIPT, data};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(task), Some(page)) = (arguments.next(), arguments.next()) else {
        return Err("usage: scene_page TASK_FILE PAGE [NAME=VALUE]...".into());
    };
    let problem = supple_file::load(Path::new(&task))?;
    let initial = problem.parameters.initial();
    let mut set = initial.clone();
    for argument in arguments {
        let (name, value) = argument.split_once('=').ok_or("parameters are set by NAME=VALUE")?;
        problem.parameters.set(&mut set, name, value.parse()?)?;
    }
    let options = EvaluateOptions { trajectories: true, ..EvaluateOptions::default() };
    let mut designs = vec![("initial", initial.clone())];
    if set != initial {
        designs.push(("changed", set));
    }
    let mut views: Vec<(String, Vec<(&str, Scene)>)> =
        problem.tasks.iter().map(|task| (task.name.clone(), Vec::new())).collect();
    for (name, phi) in &designs {
        for (evaluation, (_, scenes)) in problem.evaluate(phi, &options)?.tasks.into_iter().zip(&mut views) {
            scenes.extend(evaluation.trajectory.and_then(|trajectory| trajectory.scene).map(|scene| (*name, scene)));
        }
    }
    std::fs::write(&page, html(&problem.title, &views))?;
    Ok(())
}

fn html(title: &str, views: &[(String, Vec<(&str, Scene)>)]) -> String {
    let mut body = String::new();
    for (index, (task, scenes)) in views.iter().enumerate() {
        let scenes: Vec<(&str, &Scene)> = scenes.iter().map(|(name, scene)| (*name, scene)).collect();
        // `<` could end the script.
        let json = data(&scenes).to_string().replace('<', "\\u003c");
        body += &format!(
            "<h2>{task}</h2><div id=\"scene{index}\"></div>\n<script>SuppleScene.mount(document.getElementById(\"scene{index}\"), {json});</script>\n"
        );
    }
    let style = "body { font: 16px system-ui, sans-serif; margin: 1rem auto; max-width: 70rem; padding: 0 1rem; } \
                 [data-theme=dark] { color: #e6e6e6; background: #16181d; }";
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <title>{title}</title><style>{style}</style><script>{}</script><script>{SCRIPT}</script></head><body><h1>{title}</h1>\n{body}</body></html>",
        supple_report::assets::plotly()
    )
}
