//! Plots: what plotly.js draws, and the controls beside them.

use maud::{Markup, html};
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::arrays::Arrays;
use crate::legend;

/// A plot. Its traces are those of plotly.js, except that arrays are written as `{"a": index}` (or as
/// `{"a": index, "add": index, "times": number}`: one plus a multiple of another), and colours as `@1` to `@7`, `@ink`,
/// `@faint` or `@1/0.2`, the last with an opacity: the page's script substitutes the colours of the theme. Texts
/// are plain: the script escapes what plotly.js would interpret as markup, and breaks lines at `\n`.
pub struct Plot {
    /// What it shows, in a few words.
    pub title: String,
    /// What it shows, with its most important numbers, for those who do not see it.
    pub alternative: String,
    /// How to read it, beneath it.
    pub caption: String,
    /// Height, pixels.
    pub height: usize,
    /// Traces, as those of plotly.js.
    pub traces: Vec<Value>,
    /// Layout, as that of plotly.js.
    pub layout: Value,
    /// Which of several views is shown; `None` if there is one.
    pub choice: Option<Choice>,
}

/// A choice between views of one plot.
pub struct Choice {
    /// What is chosen, such as "State".
    pub label: String,
    /// The views; the first one is shown first.
    pub views: Vec<View>,
}

/// A view of a plot.
#[derive(Clone, Debug, Default, Serialize)]
pub struct View {
    /// Its name.
    pub name: String,
    /// Which traces it shows.
    pub traces: Vec<usize>,
    /// Their `y`, where these differ between views; otherwise empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub y: Vec<Value>,
    /// What it changes of the layout, by path, such as `yaxis.title.text`.
    #[serde(skip_serializing_if = "Map::is_empty")]
    pub layout: Map<String, Value>,
    /// What it shows, with its most important numbers.
    pub alternative: String,
}

/// All plots of a page.
#[derive(Default)]
pub struct Plots {
    /// Their numbers.
    pub arrays: Arrays,
    plots: Vec<Value>,
    scenes: Vec<Value>,
}

impl Plots {
    /// Takes a plot, and gives the place where it will be drawn.
    pub fn add(&mut self, plot: Plot) -> Markup {
        let index = self.plots.len();
        let Plot { title, alternative, mut caption, height, mut traces, layout, choice } = plot;
        let views = choice.as_ref().map(|choice| &choice.views);
        let all = || vec![(0..traces.len()).collect()];
        let shown = views.map_or_else(all, |views| views.iter().map(|view| view.traces.clone()).collect());
        let others = legend::group(&mut traces, &shown);
        if others > 0 {
            let named = legend::MOST_ENTRIES - 1;
            caption = format!(
                "{caption} The legend lists {named}; the {others} other lines are grey and labelled when you hover."
            );
        }
        self.plots.push(json!({
            "title": title, "height": height, "traces": traces, "layout": layout, "views": views,
        }));
        let (select, about) = (format!("choice-{index}"), format!("caption-{index}"));
        html! {
            figure.plot data-plot=(index) {
                div.controls {
                    p.title { (title) }
                    @if let Some(choice) = choice.filter(|choice| choice.views.len() > 1) {
                        span.choice {
                            label for=(select) { (choice.label) }
                            select id=(select) {
                                @for (view, choice) in choice.views.iter().enumerate() { option value=(view) { (choice.name) } }
                            }
                        }
                    }
                }
                div.canvas role="img" aria-label=(alternative) aria-describedby=(about) style=(format!("height:{height}px")) {}
                figcaption id=(about) { (caption) }
                div.save {
                    button type="button" data-save="svg" aria-label=(format!("Save picture: {title}")) { "Save picture" }
                    button type="button" data-save="csv" aria-label=(format!("Save data: {title}")) { "Save data" }
                }
            }
        }
    }

    /// Takes the data of a three-dimensional view, and gives the place where it will be drawn.
    pub fn add_scene(&mut self, title: &str, data: Value) -> Markup {
        self.scenes.push(data);
        html! {
            figure.scene {
                p.title { (title) }
                div.view data-scene=(self.scenes.len() - 1) {}
            }
        }
    }

    /// Whether there is any three-dimensional view.
    pub fn has_scenes(&self) -> bool {
        !self.scenes.is_empty()
    }

    /// What the page's script draws.
    pub fn into_json(self) -> Value {
        json!({ "arrays": self.arrays.into_json(), "plots": self.plots, "scenes": self.scenes })
    }
}

/// The colour of the design with this index.
pub fn colour(index: usize) -> String {
    format!("@{}", index % 7 + 1)
}

/// The dashes of the design with this index, so that designs differ by more than colour.
pub fn dash(index: usize) -> &'static str {
    ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"][index % 6]
}

/// A line of a design.
pub fn line(index: usize) -> Value {
    json!({ "color": colour(index), "dash": dash(index), "width": 2 })
}

/// The layout of panels above one another that share the horizontal axis, each below its title, and the same vertical
/// axis.
pub fn panels(titles: &[String], horizontal: &str, vertical: &str) -> Value {
    let count = titles.len().max(1) as f64;
    // Room for a line of text above each of several panels, which are about 200 pixels high.
    let gap = if titles.len() > 1 { 22.0 / (200.0 * count) } else { 0.0 };
    let height = 1.0 / count - gap;
    let mut layout = Map::new();
    let mut notes = Vec::new();
    for (index, title) in titles.iter().enumerate() {
        let top = 1.0 - gap - index as f64 * (height + gap);
        let mut axis = json!({ "domain": [(top - height).max(0.0), top], "title": { "text": vertical } });
        if index > 0 {
            axis["matches"] = "y".into();
        }
        layout.insert(axis_key("yaxis", index), axis);
        if titles.len() > 1 {
            notes.push(json!({
                "text": title, "x": 0.0, "y": top, "xref": "paper", "yref": "paper", "xanchor": "left",
                "yanchor": "bottom", "showarrow": false,
            }));
        }
    }
    let last = axis_key("y", titles.len().saturating_sub(1));
    layout.insert("xaxis".into(), json!({ "title": { "text": horizontal }, "anchor": last }));
    layout.insert("annotations".into(), notes.into());
    layout.into()
}

/// The name of an axis as plotly.js counts: `yaxis`, `yaxis2`, ..
pub fn axis_key(name: &str, index: usize) -> String {
    if index == 0 { name.to_owned() } else { format!("{name}{}", index + 1) }
}
