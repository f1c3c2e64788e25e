//! Packs plotly.js once, as pages carry it, so that programs hold a third of it and none of what comes with it.

use std::error::Error;
use std::path::PathBuf;
use std::{env, fs, io::Write};

use flate2::{Compression, GzBuilder};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    // Two scripts in their tags: plotly.js, and a renderer of formulas that no page needs.
    let all = plotly::Plot::offline_js_sources();
    let (script, _) = all
        .split_once('>')
        .and_then(|(_, rest)| rest.split_once("</script>"))
        .ok_or("the crate plotly no longer begins with the script plotly.js")?;
    let mut encoder = GzBuilder::new().mtime(0).write(Vec::new(), Compression::best());
    encoder.write_all(script.as_bytes())?;
    let file = PathBuf::from(env::var("OUT_DIR")?).join("plotly.js.gz");
    Ok(fs::write(file, encoder.finish()?)?)
}
