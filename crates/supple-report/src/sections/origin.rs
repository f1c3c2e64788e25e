//! What made the results.

use maud::{Markup, html};
use supple_study::OWN_MODEL;
use supple_study::study::Study;

use super::context::Context;
use crate::html::{table, words};

/// Bytes of a file up to which its text is in the page.
const LONGEST: usize = 100_000;

/// Commands, versions, seeds and files.
pub fn section(context: &mut Context) -> Option<Markup> {
    let part = context.part;
    let head = words(["folder", "command", "version", "seed"]);
    let rows: Vec<Vec<String>> = part
        .folders
        .iter()
        .filter_map(|(name, folder)| {
            let study = folder.made.study.as_ref()?;
            Some(vec![name.clone(), command(study), folder.made.supple.clone(), study.work.seed().to_string()])
        })
        .collect();
    Some(html! {
        (table("Commands", &head, &rows))
        @for source in part.sources {
            details {
                summary { (source.path) }
                @if source.text.len() <= LONGEST {
                    pre tabindex="0" { (source.text) }
                } @else {
                    p { "The file has " (source.text.len()) " bytes and is omitted here; the result folders contain it." }
                }
            }
        }
    })
}

/// The command line that asks for a result; what Python was asked where there is no task file.
fn command(study: &Study) -> String {
    if study.task == OWN_MODEL { format!("{} in Python", study.work.command()) } else { study.to_string() }
}
