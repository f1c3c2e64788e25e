//! What `supple plot` writes and refuses.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, TWO_MASS};

/// A folder with the task and its evaluation in `out`.
fn evaluated() -> Folder {
    let folder = Folder::with_task(TWO_MASS);
    let run = folder.run(&["evaluate", "task.toml", "--out", "out"]);
    assert_eq!(run.quiet().0, Some(0));
    folder
}

#[test]
fn plot_writes_a_file_of_each_format() {
    let folder = evaluated();
    let starts: [(&str, &[u8]); 3] = [("svg", b"<svg"), ("pdf", b"%PDF-"), ("png", b"\x89PNG")];
    for (format, start) in starts {
        let run = folder.run(&["plot", "out", "--figure", "belief", "--format", format]);
        assert_eq!(run.quiet(), (Some(0), format!("wrote belief.{format}\n").as_str()));
        assert!(std::fs::read(folder.path(&format!("belief.{format}"))).unwrap().starts_with(start));
    }
    let run = folder.run(&["plot", "out", "--figure", "belief", "--out", "by_its_ending.PNG"]);
    assert_eq!(run.quiet().0, Some(0));
    assert!(std::fs::read(folder.path("by_its_ending.PNG")).unwrap().starts_with(b"\x89PNG"));
    let run = folder.run(&["plot", "out", "--figure", "gains", "--width", "page", "--out", "figures/k.svg"]);
    assert_eq!(run.quiet().0, Some(0));
    assert!(std::fs::read_to_string(folder.path("figures/k.svg")).unwrap().contains("width=\"180.000mm\""));
    let run = folder.run(&["plot", "out", "--figure", "motion", "--format", "pdf"]);
    assert_eq!(run.quiet(), (Some(0), "wrote motion.pdf\n"));
}

#[test]
fn plot_refuses_what_it_cannot_draw_and_writes_nothing() {
    let folder = evaluated();
    let error = |arguments: &[&str]| folder.run(&[&["plot"], arguments].concat()).error().to_owned();
    assert!(error(&["out", "--figure", "landscape"]).contains("given: out (of `supple evaluate`)"));
    assert!(error(&["nowhere", "--figure", "belief"]).contains("nowhere"));
    assert!(error(&["out", "--figure", "belief", "--task", "push"]).contains("valid names: press"));
    assert!(error(&["out", "--figure", "belief", "--out", ".."]).contains("is not a file name"));
    // Names that would say another format than the file has.
    let other = error(&["out", "--figure", "belief", "--out", "belief.jpg"]);
    assert!(other.contains("`.jpg` is not the extension of a figure; use .svg, .png or .pdf"), "{other}");
    let other = error(&["out", "--figure", "belief", "--format", "png", "--out", "belief.pdf"]);
    assert!(other.contains("`.pdf` is not the extension of a figure for --format png"), "{other}");
    assert_eq!(folder.names(), ["out", "task.toml"]);
}

#[test]
fn figures_of_several_tasks_say_so() {
    let folder = evaluated();
    std::fs::write(folder.path("other.toml"), format!("{TWO_MASS}\n# edited\n")).unwrap();
    assert_eq!(folder.run(&["evaluate", "other.toml", "--out", "other"]).code, Some(0));
    let run = folder.run(&["plot", "out", "other", "--figure", "gains"]);
    let said = "warning: other was made of another task file than out: the figure draws them as if of one\n";
    assert_eq!((run.code, &*run.stderr), (Some(0), said));
    assert_eq!(folder.run(&["plot", "out", "out", "--figure", "gains"]).quiet().0, Some(0));
}
