//! Text that takes a third of its size in the page.

use std::io::{Read, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::GzDecoder;
use flate2::{Compression, GzBuilder};

/// A text as the page carries it: by gzip, in base64. Browsers unpack it themselves.
///
/// # Errors
/// Never, as nothing is written but memory.
pub fn packed(text: &str) -> std::io::Result<String> {
    let mut encoder = GzBuilder::new().mtime(0).write(Vec::new(), Compression::best());
    encoder.write_all(text.as_bytes())?;
    Ok(encoded(&encoder.finish()?))
}

/// Bytes in base64, which cannot end a script.
pub fn encoded(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}

/// A text that was packed when the program was built.
pub fn unpacked(packed: &[u8]) -> String {
    let mut text = String::new();
    // What the build packed is text, and whole.
    GzDecoder::new(packed).read_to_string(&mut text).map_or_else(|_| String::new(), |_| text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_text_comes_back_and_cannot_end_its_script() {
        let text = "</script><b>".repeat(1000);
        let packed = packed(&text).unwrap();
        assert!(
            packed.len() < 200 && packed.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+/=".contains(&byte))
        );
        assert_eq!(unpacked(&STANDARD.decode(packed).unwrap()), text);
    }

    #[test]
    fn the_library_of_plots_is_whole() {
        let text = crate::assets::plotly();
        assert!(text.len() > 4_000_000 && text.contains("plotly.js v3.0.1") && !text.contains("</script"));
    }
}
