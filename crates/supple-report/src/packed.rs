//! Text that takes a third of its size in the page.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::{Compression, GzBuilder};

/// A text as the page carries it: by gzip, in base64. Browsers unpack it themselves.
///
/// # Errors
/// Never, as nothing is written but memory.
pub fn packed(text: &str) -> std::io::Result<String> {
    let mut encoder = GzBuilder::new().mtime(0).write(Vec::new(), Compression::best());
    encoder.write_all(text.as_bytes())?;
    Ok(STANDARD.encode(encoder.finish()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn packed_text_comes_back_and_cannot_end_its_script() {
        let text = "</script><b>".repeat(1000);
        let packed = packed(&text).unwrap();
        assert!(
            packed.len() < 200 && packed.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+/=".contains(&byte))
        );
        let mut back = String::new();
        flate2::read::GzDecoder::new(&STANDARD.decode(packed).unwrap()[..]).read_to_string(&mut back).unwrap();
        assert_eq!(back, text);
    }
}
