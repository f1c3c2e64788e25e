//! One cheap pass over XML text before parsing: it rejects entity definitions, and sizes that no robot needs.

use std::ops::Range;

/// Greatest depth of nested elements.
pub(super) const DEEPEST: usize = 256;
/// Greatest number of nodes in the parsed file: elements, texts and comments.
pub(super) const MOST_NODES: u32 = 2_000_000;
/// Greatest number of `<` and of `=` characters. The parser reserves memory by their count.
const MOST_SIGNS: usize = 4_000_000;
/// Greatest number of attributes of an element. The parser compares every pair.
const MOST_ATTRIBUTES: usize = 100;
/// Greatest number of namespace declarations in the file.
const MOST_NAMESPACES: usize = 100;

/// What is wrong, and the bytes it is about.
pub(super) struct Refusal {
    /// Bytes of the text that are meant.
    pub(super) span: Range<usize>,
    /// What was found, and what is valid.
    pub(super) message: String,
}

/// Scans the tags of a text. Returns where each element begins that is still open at the end, outermost first.
///
/// Malformed text is left to the parser. In well-formed text, this pass finds the same tags as the
/// parser.
///
/// # Errors
/// If the text defines a document type or entities, or exceeds a limit.
pub(super) fn scan(text: &str) -> Result<Vec<usize>, Refusal> {
    let bytes = text.as_bytes();
    for (sign, name) in [(b'<', "<"), (b'=', "=")] {
        let count = bytes.iter().filter(|&&byte| byte == sign).count();
        if count > MOST_SIGNS {
            let message = format!("a robot file has at most {MOST_SIGNS} characters `{name}`; this one has {count}");
            return Err(Refusal { span: 0..0, message });
        }
    }
    let mut scan = Scan { text, open: Vec::new(), namespaces: 0 };
    let mut at = 0;
    while let Some(start) = text.get(at..).and_then(|rest| rest.find('<')).map(|found| at + found) {
        let rest = &text[start..];
        at = match () {
            () if rest.starts_with("<!--") => after(rest, 4, "-->"),
            () if rest.starts_with("<![CDATA[") => after(rest, 9, "]]>"),
            () if rest.starts_with("<?") => after(rest, 2, "?>"),
            () if rest.starts_with("<!") && rest[2..].starts_with(|next: char| next.is_ascii_alphabetic()) => {
                return Err(definition(rest, start));
            }
            () if rest.starts_with("</") => {
                scan.open.pop();
                after(rest, 2, ">")
            }
            () => scan.tag(start)?,
        }
        .map_or(text.len(), |length| start + length);
    }
    Ok(scan.open)
}

/// Length of the part of `rest` up to and including `end`, searched from byte `from` on.
fn after(rest: &str, from: usize, end: &str) -> Option<usize> {
    rest.get(from..)?.find(end).map(|found| from + found + end.len())
}

/// The refusal of a `<!...`.
fn definition(rest: &str, start: usize) -> Refusal {
    let length = rest.bytes().skip(2).take_while(u8::is_ascii_alphabetic).count() + 2;
    let message = format!(
        "`{}` is not accepted: a robot file may not define a document type or entities, nor refer to other files by them",
        &rest[..length]
    );
    Refusal { span: start..start + length, message }
}

/// The tags so far.
struct Scan<'t> {
    text: &'t str,
    /// Where each element begins that is still open.
    open: Vec<usize>,
    /// Declarations of name spaces.
    namespaces: usize,
}

impl Scan<'_> {
    /// The start tag at byte `start`. Returns its length; `None` if it does not end.
    fn tag(&mut self, start: usize) -> Result<Option<usize>, Refusal> {
        let bytes = &self.text.as_bytes()[start..];
        let mut attributes = 0;
        let mut quote = None;
        for (i, &byte) in bytes.iter().enumerate().skip(1) {
            match (quote, byte) {
                (None, b'>') => {
                    if bytes[i - 1] != b'/' {
                        self.open(start)?;
                    }
                    return Ok(Some(i + 1));
                }
                (None, b'"' | b'\'') => {
                    quote = Some(byte);
                    attributes += 1;
                    if attributes > MOST_ATTRIBUTES {
                        let message = format!("an element has at most {MOST_ATTRIBUTES} attributes");
                        return Err(Refusal { span: start..start + 1, message });
                    }
                }
                (None, b'x') if bytes[i - 1].is_ascii_whitespace() && bytes[i..].starts_with(b"xmlns") => {
                    self.namespaces += 1;
                    if self.namespaces > MOST_NAMESPACES {
                        let message = format!("a robot file declares at most {MOST_NAMESPACES} name spaces");
                        return Err(Refusal { span: start + i..start + i + 5, message });
                    }
                }
                // Malformed: the parser reports it.
                (None, b'<') => return Ok(Some(i)),
                (Some(quoted), _) if byte == quoted => quote = None,
                _ => {}
            }
        }
        Ok(None)
    }

    /// One more element is open.
    fn open(&mut self, start: usize) -> Result<(), Refusal> {
        if self.open.len() >= DEEPEST {
            let message = format!("elements are nested more than {DEEPEST} deep");
            return Err(Refusal { span: start..start + 1, message });
        }
        self.open.push(start);
        Ok(())
    }
}
