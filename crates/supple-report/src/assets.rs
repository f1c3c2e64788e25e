//! What pages share: style, colours of light and dark, and plotly.js.
//!
//! # A custom page
//!
//! ```
//! use supple_report::assets::{LICENCE, STYLE, THEME, plotly};
//!
//! let library = plotly();
//! let head = format!("<style>{STYLE}</style>{LICENCE}<script>{library}</script>");
//! let page = format!(r#"<!doctype html>{head}<select id="theme"></select><script>{THEME}</script>"#);
//! assert!(page.contains("Plotly") && page.contains("SuppleTheme"));
//! ```

use crate::packed::unpacked;

/// The style of pages.
///
/// Example: the [module](crate::assets).
pub const STYLE: &str = include_str!("../assets/page.css");

/// The script that chooses between light and dark: it defines `SuppleTheme`, and needs a `<select id="theme">`.
///
/// Example: the [module](crate::assets).
pub const THEME: &str = include_str!("../assets/theme.js");

/// The notice that the licence of plotly.js requires, readable although the script is packed.
///
/// Example: the [module](crate::assets).
pub const LICENCE: &str =
    "<!-- plotly.js v3.0.1, copyright 2012-2025, Plotly, Inc., all rights reserved, MIT licence -->";

/// plotly.js, gzipped. A `static`, since a `const` would be embedded once for each use.
pub(crate) static PLOTLY: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/plotly.js.gz"));

/// plotly.js.
///
/// Example: the [module](crate::assets).
#[must_use]
pub fn plotly() -> String {
    unpacked(PLOTLY)
}
