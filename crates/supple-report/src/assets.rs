//! What pages share: style, colours of light and dark, and plotly.js.

use crate::packed::unpacked;

/// The style of pages.
pub const STYLE: &str = include_str!("../assets/page.css");

/// The script that chooses between light and dark: it defines `SuppleTheme`, and needs a `<select id="theme">`.
pub const THEME: &str = include_str!("../assets/theme.js");

/// The notice that the licence of plotly.js requires, readable although the script is packed.
pub const LICENCE: &str =
    "<!-- plotly.js v3.0.1, copyright 2012-2025, Plotly, Inc., all rights reserved, MIT licence -->";

/// plotly.js, gzipped. A `static`, since a `const` would be embedded once for each use.
pub(crate) static PLOTLY: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/plotly.js.gz"));

/// plotly.js.
#[must_use]
pub fn plotly() -> String {
    unpacked(PLOTLY)
}
