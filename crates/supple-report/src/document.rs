use maud::{DOCTYPE, Markup, PreEscaped, html};
use supple_study::{Folder, StudyResult};
use supple_text::plain;

use crate::ReportError;
use crate::assets::{LICENCE, PLOTLY, STYLE, THEME};
use crate::html::heading;
use crate::packed::{encoded, packed};
use crate::part::{Part, parts};
use crate::plots::Plots;
use crate::sections::{Context, KINDS};
use crate::words::count;

const SCRIPTS: [&str; 3] = [THEME, include_str!("../assets/plots.js"), include_str!("../assets/page.js")];

/// A section of the page that is made.
struct Made {
    id: String,
    title: &'static str,
    body: Markup,
}

/// One HTML page of results: those of one task file together, in the order of the folders.
///
/// The page needs no network and no other file. Whatever files of results or tasks hold is shown as text.
///
/// # Errors
/// Where the folders hold no result to show, or the data of plots cannot be written.
///
/// Example: the [front page](crate).
pub fn page(folders: &[Folder]) -> Result<String, ReportError> {
    let parts = parts(folders);
    if parts.is_empty() {
        return Err(ReportError::Nothing("there is no result to report: the folders hold none".into()));
    }
    let mut plots = Plots::default();
    let several = parts.len() > 1;
    let made: Vec<Vec<Made>> =
        parts.iter().enumerate().map(|(index, part)| sections(part, index, several, &mut plots)).collect();
    let title = title(folders, &parts);
    let has_scenes = plots.has_scenes();
    let data = packed(&serde_json::to_string(&plots.into_json())?)?;
    let library = encoded(PLOTLY);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="generator" content=(concat!("supple ", env!("CARGO_PKG_VERSION")));
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                a.skip href="#content" { "Skip to the content" }
                header { (banner(folders, &title)) }
                div.page {
                    nav aria-label="Contents" { (contents(&parts, &made)) }
                    main id="content" tabindex="-1" { (body(&parts, &made)) }
                }
                script id="data" type="application/gzip" { (PreEscaped(data)) }
                (PreEscaped(LICENCE))
                script id="library" type="application/gzip" { (PreEscaped(library)) }
                @if has_scenes { script { (PreEscaped(crate::scene::SCRIPT)) } }
                @for script in SCRIPTS { script { (PreEscaped(script)) } }
            }
        }
    };
    Ok(plain(&page.into_string()).into_owned())
}

/// What the page may do: run its own scripts and nothing else. It makes no network requests, whatever a script in it
/// tries; images saved from plots are data URLs.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:; \
                      font-src data:; base-uri 'none'; form-action 'none'";

/// The title of the study, or of its one part.
fn title(folders: &[Folder], parts: &[Part]) -> String {
    let study = folders.iter().find_map(|folder| match &folder.result {
        StudyResult::Study(_) => Some(folder.made.about.title.clone()).filter(|title| !title.trim().is_empty()),
        _ => None,
    });
    study.unwrap_or_else(|| match parts {
        [part] => part.title(),
        _ => format!("Report of {}", count(parts.len(), "task file")),
    })
}

fn banner(folders: &[Folder], title: &str) -> Markup {
    let results = folders.iter().filter(|folder| !matches!(folder.result, StudyResult::Study(_))).count();
    html! {
        (heading(1, "top", title))
        p.about { "Report of " (count(results, "result")) " by supple " (env!("CARGO_PKG_VERSION")) }
        div.theme {
            label for="theme" { "Colours" }
            select id="theme" {
                option value="auto" { "as the system" }
                option value="light" { "light" }
                option value="dark" { "dark" }
            }
        }
        noscript { p { "Text and tables are complete without scripts; plots and the animation require them." } }
    }
}

fn contents(parts: &[Part], made: &[Vec<Made>]) -> Markup {
    let links = |sections: &[Made]| {
        html! { ol { @for section in sections { li { a href=(format!("#{}", section.id)) { (section.title) } } } } }
    };
    html! {
        details open {
            summary { "Contents" }
            @if let [sections] = made {
                (links(sections))
            } @else {
                ol.parts {
                    @for (index, (part, sections)) in parts.iter().zip(made).enumerate() {
                        li { a href=(format!("#part-{}", index + 1)) { (part.title()) } (links(sections)) }
                    }
                }
            }
        }
    }
}

fn body(parts: &[Part], made: &[Vec<Made>]) -> Markup {
    let several = parts.len() > 1;
    html! {
        @for (index, (part, sections)) in parts.iter().zip(made).enumerate() {
            @if several { (heading(2, &format!("part-{}", index + 1), &part.title())) }
            @for section in sections {
                section aria-labelledby=(section.id) {
                    (heading(if several { 3 } else { 2 }, &section.id, section.title))
                    (section.body)
                }
            }
        }
    }
}

fn sections(part: &Part, index: usize, several: bool, plots: &mut Plots) -> Vec<Made> {
    let prefix = if several { format!("part-{}-", index + 1) } else { String::new() };
    let mut made = Vec::new();
    for kind in &KINDS {
        let mut context = Context { part, plots, level: if several { 3 } else { 2 }, prefix: &prefix };
        if let Some(body) = (kind.make)(&mut context) {
            made.push(Made { id: format!("{prefix}{}", kind.name), title: kind.title, body });
        }
    }
    made
}
