//! What sections are made of.

use maud::{Markup, html};

use crate::part::Part;
use crate::plots::Plots;

/// What a section is made of.
pub struct Context<'a, 'p> {
    /// The results.
    pub part: &'a Part<'p>,
    /// Takes the section's plots.
    pub plots: &'a mut Plots,
    /// Level of headings within the section.
    pub level: u8,
    /// Begins all element names of the part.
    pub prefix: &'a str,
}

impl Context<'_, '_> {
    /// What a section has for each task that has it, below a paragraph; `None` if no task has it.
    pub(super) fn by_task(
        &mut self,
        about: &Markup,
        make: fn(&Part, usize, &mut Plots) -> Option<Markup>,
    ) -> Option<Markup> {
        let tasks = 0..self.part.about.tasks.len();
        let shown: Vec<Markup> = tasks.filter_map(|task| make(self.part, task, self.plots)).collect();
        (!shown.is_empty()).then(|| html! { p { (about) } @for one in shown { (one) } })
    }
}
