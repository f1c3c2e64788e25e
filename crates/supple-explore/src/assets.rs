//! The page and all that it loads: part of the program, nothing is fetched.

use supple_report::assets::{LICENCE, STYLE, THEME, plotly};
use supple_report::scene;

const PAGE: &str = include_str!("../assets/explore.html");
const UPLOT: &str = concat!(include_str!("../assets/uplot/uPlot.iife.min.js"), "\n//");

/// A file that the page loads.
pub struct Asset {
    /// Its kind.
    pub kind: &'static str,
    /// Its text.
    pub text: String,
}

/// The page, with the token that its own requests show.
pub fn page(token: &str) -> String {
    PAGE.replace("{{token}}", token).replace("{{licence}}", LICENCE)
}

/// A file by its name; `None` if there is none.
pub fn asset(name: &str) -> Option<Asset> {
    let script = |text: &str| Some(Asset { kind: "text/javascript; charset=utf-8", text: text.to_owned() });
    let style = |text: String| Some(Asset { kind: "text/css; charset=utf-8", text });
    match name {
        "page.css" => style(STYLE.to_owned()),
        "explore.css" => {
            let curves = include_str!("../assets/uplot/uPlot.min.css");
            style(format!("{curves}\n{}", include_str!("../assets/explore.css")))
        }
        "theme.js" => script(THEME),
        "plotly.js" => script(&plotly()),
        "uplot.js" => script(UPLOT),
        "scene.js" => script(scene::SCRIPT),
        "link.js" => script(include_str!("../assets/link.js")),
        "design.js" => script(include_str!("../assets/design.js")),
        "sliders.js" => script(include_str!("../assets/sliders.js")),
        "numbers.js" => script(include_str!("../assets/numbers.js")),
        "curves.js" => script(include_str!("../assets/curves.js")),
        "motion.js" => script(include_str!("../assets/motion.js")),
        "map.js" => script(include_str!("../assets/map.js")),
        "tools.js" => script(include_str!("../assets/tools.js")),
        "main.js" => script(include_str!("../assets/main.js")),
        _ => None,
    }
}
