//! The parts of a page: all results of one task file belong together.

use supple::design::DesignStatus;
use supple::{Evaluation, Named};
use supple_study::bound::BoundStudy;
use supple_study::design::DesignReport;
use supple_study::pareto::Pareto;
use supple_study::robustness::Robustness;
use supple_study::sensors::Sensors;
use supple_study::sweep::Sweep;
use supple_study::trace::Trace;
use supple_study::{About, Folder, Source, StudyResult};

/// All results of one task file.
pub struct Part<'a> {
    /// What the task is.
    pub about: &'a About,
    /// The task file, then the robot's file where there is one.
    pub sources: &'a [Source],
    /// The folders, each with a name that no other one has.
    pub folders: Vec<(String, &'a Folder)>,
}

/// A design that is shown with its trajectories.
#[derive(Clone)]
pub struct Shown<'a> {
    /// Its name.
    pub name: String,
    /// The design.
    pub at: &'a Evaluation,
}

/// The parts of a page, in the order of their first folders. Folders of studies are no part by themselves.
pub fn parts(folders: &[Folder]) -> Vec<Part<'_>> {
    let mut parts: Vec<Part> = Vec::new();
    for folder in folders.iter().filter(|folder| !matches!(folder.result, StudyResult::Study(_))) {
        let texts = |sources: &[Source]| sources.iter().map(|source| source.text.clone()).collect::<Vec<_>>();
        let made = &folder.made;
        let index = parts.iter().position(|part| texts(part.sources) == texts(&made.sources));
        let index = index.unwrap_or_else(|| {
            parts.push(Part { about: &made.about, sources: &made.sources, folders: Vec::new() });
            parts.len() - 1
        });
        let part = &mut parts[index];
        let name = unused(&folder_name(folder), |name| part.folders.iter().any(|(other, _)| other == name));
        part.folders.push((name, folder));
    }
    parts
}

/// The name, or the name with a number where it is taken.
fn unused(name: &str, taken: impl Fn(&str) -> bool) -> String {
    let numbered = (2..).map(|number| format!("{name} ({number})"));
    std::iter::once(name.to_owned()).chain(numbered).find(|name| !taken(name)).unwrap_or_default()
}

/// The last part of a folder's path, or what it holds.
fn folder_name(folder: &Folder) -> String {
    let name = folder.path.file_name().map(|name| name.to_string_lossy().into_owned());
    name.unwrap_or_else(|| folder.result.kind().to_owned())
}

impl<'a> Part<'a> {
    /// Its title: that of the task file, or else the name of the file.
    pub fn title(&self) -> String {
        let file = || self.sources.first().map_or("Task", |source| source.path.as_str());
        let name = || file().rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
        if self.about.title.trim().is_empty() { name() } else { self.about.title.clone() }
    }

    /// What design searches found.
    pub fn searches(&self) -> Vec<(&str, &'a DesignReport)> {
        self.results(|result| if let StudyResult::Design(report) = result { Some(&**report) } else { None })
    }

    /// Other designs, which were evaluated only.
    pub fn evaluations(&self) -> Vec<(&str, &'a Evaluation)> {
        self.results(|result| if let StudyResult::Evaluate(report) = result { Some(&report.evaluation) } else { None })
    }

    /// Sweeps.
    pub fn sweeps(&self) -> Vec<(&str, &'a Sweep)> {
        self.results(|result| if let StudyResult::Sweep(sweep) = result { Some(&**sweep) } else { None })
    }

    /// Studies of robustness.
    pub fn robustness(&self) -> Vec<(&str, &'a Robustness)> {
        self.results(|result| if let StudyResult::Robustness(study) = result { Some(&**study) } else { None })
    }

    /// Fronts.
    pub fn fronts(&self) -> Vec<(&str, &'a Pareto)> {
        self.results(|result| if let StudyResult::Pareto(front) = result { Some(&**front) } else { None })
    }

    /// Bounds on information.
    pub fn bounds(&self) -> Vec<(&str, &'a BoundStudy)> {
        self.results(|result| if let StudyResult::Bound(study) = result { Some(&**study) } else { None })
    }

    /// Studies of sensors.
    pub fn sensors(&self) -> Vec<(&str, &'a Sensors)> {
        self.results(|result| if let StudyResult::Sensors(study) = result { Some(&**study) } else { None })
    }

    /// Traces of searches.
    pub fn traces(&self) -> Vec<(&str, &'a Trace)> {
        self.results(|result| if let StudyResult::Trace(trace) = result { Some(&**trace) } else { None })
    }

    fn results<T>(&self, pick: impl Fn(&'a StudyResult) -> Option<T>) -> Vec<(&str, T)> {
        self.folders.iter().filter_map(|(name, folder)| Some((name.as_str(), pick(&folder.result)?))).collect()
    }

    /// All designs with an evaluation: starts and ends of searches, then other designs. A start that several searches share
    /// is there once.
    pub fn designs(&self) -> Vec<Shown<'a>> {
        let searches = self.searches();
        let mut shown: Vec<Shown<'a>> = Vec::new();
        let mut add = |name: String, at: &'a Evaluation, shared: bool| {
            let same = shown.iter_mut().find(|other| other.at.parameters == at.parameters);
            if let Some(other) = same.filter(|other| shared || alike(other.at, at)) {
                if !shared && other.name != name {
                    other.name = format!("{} and {name}", other.name);
                }
                return;
            }
            let name = unused(&name, |name| shown.iter().any(|other| other.name == name));
            shown.push(Shown { name, at });
        };
        let several = searches.len() > 1;
        for (folder, report) in &searches {
            let of = |what: &str| if several { format!("{what} of {folder}") } else { what.to_owned() };
            add(of("start"), &report.start, true);
            add(of(end_name(report.status)), &report.optimum, false);
        }
        for (folder, at) in self.evaluations() {
            add(folder.to_owned(), at, false);
        }
        shown
    }

    /// A design in words: `k1 = 136 N/m, k2 = 171 N/m`, of the parameters that designs change.
    pub fn describe(&self, parameters: &Named) -> Vec<String> {
        let design = self.about.parameters.design();
        let of = |&index: &usize| {
            let parameter = self.about.parameters.get(index);
            let value = parameters.get(&parameter.name)?;
            // Without breaks of lines within.
            let value = crate::numbers::with_unit(value, &parameter.unit).replace(' ', "\u{a0}");
            Some(format!("{}\u{a0}=\u{a0}{value}", parameter.name))
        };
        design.iter().filter_map(of).collect()
    }
}

/// Whether two evaluations of the same parameters show the same plans: their costs agree to rounding.
fn alike(a: &Evaluation, b: &Evaluation) -> bool {
    let near = |(a, b): (&supple::TaskEvaluation, &supple::TaskEvaluation)| {
        let (a_cost, b_cost) = (a.cost.expected, b.cost.expected);
        a.trajectory.is_some() == b.trajectory.is_some() && (a_cost - b_cost).abs() <= 1e-9 * a_cost.abs()
    };
    a.tasks.len() == b.tasks.len() && a.tasks.iter().zip(&b.tasks).all(near)
}

/// What the best design of a search may be called.
pub fn end_name(status: DesignStatus) -> &'static str {
    match status {
        DesignStatus::Converged => "optimum",
        DesignStatus::BoundViolated => "closest design found",
        DesignStatus::NotOptimal | DesignStatus::NotConverged | DesignStatus::Stopped => "best design found",
    }
}
