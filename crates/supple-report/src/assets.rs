//! What pages share: style, colours of light and dark, and plotly.js.

/// The style of pages.
pub const STYLE: &str = include_str!("../assets/page.css");

/// The script that chooses between light and dark: it defines `SuppleTheme`, and needs a `<select id="theme">`.
pub const THEME: &str = include_str!("../assets/theme.js");

/// What the licence of plotly.js asks for, readable where the packed script is not.
pub const LICENCE: &str =
    "<!-- plotly.js v3.0.1, copyright 2012-2025, Plotly, Inc., all rights reserved, MIT licence -->";

/// plotly.js as the crate carries it, without the formula renderer that follows it there.
pub fn plotly() -> String {
    let all = plotly::Plot::offline_js_sources();
    let inner = all.split_once('>').map_or("", |(_, rest)| rest);
    inner.split_once("</script>").map_or(inner, |(script, _)| script).to_owned()
}
