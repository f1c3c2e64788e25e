//! Task files: TOML in, a [`Problem`] out. Every error names the file, the line and the key, says what is valid, and
//! suggests the nearest valid name.
//!
//! The crate builds on `supple`, which does not deal with files, and turns the tables of a file into its values.
//! `supple-study` builds on it: it stores the source texts of a result.
//!
//! | to | call |
//! |---|---|
//! | read a file | [`load`] |
//! | read a text | [`parse`] |
//! | admit models, quantities, couplings and norms of other crates, or choose sensors of a catalogue | [`load_with`], [`parse_with`] with [`ReadOptions`], [`Kinds`] or [`WithSensors`] |
//! | describe task files to editors | [`json_schema`], [`json_schema_of`] |
//! | write the robot of a task for other simulators | [`robot_of`] |
//! | parse TOML of another shape, with the same errors | [`parse_document`] |
//! | show where and why a file is wrong | [`FileError`] |
//!
//! # A task, and an error in it
//!
//! ```
//! let cart = r#"
//!     [model]
//!     kind = "linear"
//!     A = [[1.0, 0.1], [0.0, 0.9]]
//!     B = [[0.0], ["gain"]]
//!     C = [[1.0, 0.0]]
//!
//!     [parameters.gain]
//!     initial = 0.2
//!     bounds = [0.1, 0.5]
//!
//!     [[tasks]]
//!     name = "hold"
//!     steps = 20
//!     time_step = 0.1                 # s
//!     initial_state = [1.0, 0.0]
//!     noise = { initial = [1e-2, 1e-2], process = [0.0, 1e-4], measurement = [1e-3] }
//!     costs = [{ kind = "state", select = ["x1"], weight = 1.0 }, { kind = "control", weight = 0.01 }]
//! "#;
//! let problem = supple_file::parse(cart, "cart.toml")?;
//! assert_eq!((problem.parameters.names(), problem.tasks[0].steps), (vec!["gain".to_owned()], 20));
//!
//! let error = supple_file::parse(&cart.replace("steps", "stepps"), "cart.toml").err().ok_or("an unknown key is an error")?;
//! assert_eq!((error.line, error.key.as_str()), (14, "tasks[0].stepps"));
//! assert_eq!(error.help.as_deref(), Some("did you mean `steps`?"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod angles;
mod candidates;
mod catalogue;
mod csv_table;
mod first_state;
mod followed;
mod parameters;
mod rows;
mod schema;
mod syntax;
mod targets;
mod tasks;
mod varying;

use std::path::Path;
use std::rc::Rc;

use serde::Deserialize;
use serde::de::IgnoredAny;
use supple::Problem;
use supple::settings::{DesignSettings, PlanSettings};
use supple_model::Names;
use supple_model::model::{Kinds, ModelFile, Robot, Source};

pub use candidates::WithSensors;
pub use schema::{json_schema, json_schema_of};
pub use supple_text::{Files, read_text};
pub use syntax::parse_document;

pub use supple_model::document::{Document, FileError, Place, ReadError, Reader};

/// The top of a task file. Sections whose shape depends on a `kind` are read by their own readers.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
struct Top {
    #[serde(default)]
    title: String,
    model: IgnoredAny,
    #[serde(default)]
    parameters: IgnoredAny,
    tasks: IgnoredAny,
    #[serde(default)]
    catalogue: IgnoredAny,
    #[serde(default)]
    planning: PlanSettings,
    #[serde(default)]
    design: DesignSettings,
}

/// How a task file is read.
///
/// Example: [`load_with`].
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// The kinds that it may name; default: those of the library.
    pub kinds: Kinds,
    /// The sensors of its catalogue that the robot has; default: those that the file says are chosen.
    pub sensors: WithSensors,
    /// Where the files that it names are read.
    pub files: Files,
}

impl From<Kinds> for ReadOptions {
    fn from(kinds: Kinds) -> Self {
        Self { kinds, ..Self::default() }
    }
}

impl From<WithSensors> for ReadOptions {
    fn from(sensors: WithSensors) -> Self {
        Self { sensors, ..Self::default() }
    }
}

/// Reads a problem from a task file.
///
/// # Errors
/// Where the file cannot be read, or anything in it is wrong.
///
/// ```
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
/// let problem = supple_file::load(file)?;
/// assert_eq!(problem.parameters.names()[0], "k1");
/// # Ok::<(), supple_file::FileError>(())
/// ```
pub fn load(path: impl AsRef<Path>) -> Result<Problem, FileError> {
    load_with(path, ReadOptions::default())
}

/// The same with more kinds, or other sensors of the catalogue.
///
/// # Errors
/// Where the file cannot be read, or anything in it is wrong.
///
/// ```
/// use supple_file::WithSensors;
///
/// // A task with a catalogue of sensors, with all of them; `load` takes those that the file says are chosen.
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/wiping_arm_sensors.toml");
/// let problem = supple_file::load_with(file, WithSensors::All)?;
/// let sensors = problem.catalogue.ok_or("the file has a catalogue")?;
/// assert!(sensors.iter().all(|sensor| !sensor.rows.is_empty()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn load_with(path: impl AsRef<Path>, options: impl Into<ReadOptions>) -> Result<Problem, FileError> {
    let path = path.as_ref();
    parse_with(&read_text(path)?, &path.display().to_string(), options)
}

/// Reads a problem from the text of a task file; `name` stands for the file in errors.
///
/// # Errors
/// Where anything in it is wrong.
///
/// Example: the [front page](crate).
pub fn parse(source: &str, name: &str) -> Result<Problem, FileError> {
    parse_with(source, name, ReadOptions::default())
}

/// The same with more kinds, or other sensors of the catalogue.
///
/// # Errors
/// Where anything in it is wrong.
///
/// ```
/// use supple_model::Scalar;
/// use supple_model::cost::{NoKeys, NormFile, NormKind};
/// use supple_model::model::Kinds;
///
/// /// `cosh(r) - 1`
/// #[derive(Debug)]
/// struct Cosh;
///
/// impl NormKind for Cosh {
///     const NAME: &'static str = "cosh";
///     fn value<S: Scalar>(&self, r: S, _: &[S]) -> S {
///         (r.exp() + (-r).exp()) * 0.5 - 1.0
///     }
/// }
///
/// impl NormFile for Cosh {
///     type File = NoKeys;
///     fn build(_: NoKeys) -> Self {
///         Self
///     }
/// }
///
/// let task = r#"
///     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
///     [[tasks]]
///     name = "hold"
///     steps = 20
///     time_step = 0.1
///     initial_state = [1.0]
///     noise = { initial = [1e-2], process = [1e-3], measurement = [1e-3] }
///     costs = [
///         { kind = "state", select = ["x1"], norm = "cosh", weight = 1.0 },
///         { kind = "control", weight = 1.0 },
///     ]
/// "#;
/// assert!(supple_file::parse(task, "hold.toml").is_err(), "the library has no such norm");
/// let problem = supple_file::parse_with(task, "hold.toml", Kinds::default().with_norm::<Cosh>())?;
/// assert_eq!(problem.tasks[0].name, "hold");
/// # Ok::<(), supple_file::FileError>(())
/// ```
pub fn parse_with(source: &str, name: &str, options: impl Into<ReadOptions>) -> Result<Problem, FileError> {
    let ReadOptions { kinds, sensors, files } = options.into();
    let document = parse_document(source, name)?.reading(files);
    let top: Top = document.read(&[])?;
    top.planning.check().map_err(|unfit| unfit.at(&document, &["planning".into()]))?;
    top.design.check().map_err(|unfit| unfit.at(&document, &["design".into()]))?;
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let mut catalogues = Vec::new();
    let parameters = parameters::read(&document, folder, &mut catalogues)?;
    if (top.design.budget.is_some() || top.design.price_weight > 0.0) && !parameters.have_prices() {
        let key = if top.design.budget.is_some() { "budget" } else { "price_weight" };
        let message = "needs a parameter with a price: [parameters.NAME] price = { inverse = 1.0 }";
        return Err(document.error(&["design".into(), key.into()], message));
    }
    let names = Rc::new(Names::new(parameters.names()).starting_at(parameters.initial()));
    let document = document.naming(names.clone());
    let read_model = |document: &Document| {
        let source = Source { document, parameters: &parameters, folder, kinds: &kinds };
        candidates::equip(&source, source.read()?, sensors)
    };
    let (model, (catalogue, tables)) = read_model(&document)?;
    // Tasks that set parameters have models of their own, in which these are numbers.
    let mut variants = Vec::new();
    for set in tasks::sets(&document, &parameters)? {
        variants.push(match set.is_empty() {
            true => None,
            false => {
                let numbers = parameters.iter().map(|parameter| set.get(&parameter.name)).collect();
                let document = parse_document(source, name)?.reading(document.files().clone());
                let document = document.naming(Rc::new(names.setting(numbers)));
                let (model, _) = read_model(&document).map_err(|error| tasks::of_set(error, &set))?;
                Some(tasks::Variant { document, model, set })
            }
        });
    }
    let (tasks, of_tasks) = tasks::read((&document, &*model), &variants, &parameters, &kinds)?;
    tasks::check_enforced(&document, top.planning.plan)?;
    let files = model.files().into_iter().chain(tables).chain(catalogues).collect();
    let of_file = [angles::in_degrees(&document), of_tasks].concat();
    let warnings = [model.warnings(), of_file.clone()].concat();
    let every_warning = [model.every_warning(), of_file].concat();
    if let Some(name) = names.unused().first() {
        let place = ["parameters".into(), Place::Key(name)];
        let message = format!("parameter `{name}` is declared but never used");
        return Err(document
            .error_at_key(&place, message)
            .with_help("write its name in place of a number, or delete its table"));
    }
    let Top { title, planning, design, .. } = top;
    let problem = Problem::new(title, parameters, tasks).with_planning(planning).with_design(design);
    Ok(Problem { files, catalogue, warnings, every_warning, ..problem })
}

/// The robot of a task file as a robot file would describe it, at the initial values of the parameters: with joints that
/// the task inserts or locks, numbers that it overrides, its frames and the springs beside joints. Other compliance is
/// among [`omitted`](supple_robot::Robot::omitted).
///
/// # Errors
/// Where the file is wrong, or its model is of another kind.
///
/// ```
/// use supple_file::{read_text, robot_of};
///
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/wiping_arm.toml");
/// let robot = robot_of(&read_text(file)?, file)?;
/// let wrist = robot.joint("wrist").map(|joint| &robot.joints[joint]);
/// assert!(wrist.is_some_and(|wrist| wrist.stiffness > 0.0), "the task has a spring beside it");
/// # Ok::<(), supple_file::FileError>(())
/// ```
pub fn robot_of(source: &str, name: &str) -> Result<supple_robot::Robot, FileError> {
    let document = parse_document(source, name)?;
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let kinds = Kinds::default();
    let (kind, _) = document.table_with_kind(&["model".into()], &kinds.models())?;
    if kind != "robot" {
        let message = format!("must be `robot` here; found `{kind}`");
        return Err(document.error(&["model".into(), "kind".into()], message));
    }
    let parameters = parameters::read(&document, folder, &mut Vec::new())?;
    let document = document.naming(Rc::new(Names::new(parameters.names()).starting_at(parameters.initial())));
    let source = Source { document: &document, parameters: &parameters, folder, kinds: &kinds };
    let robot = <Robot as ModelFile>::read(&source)?;
    Ok(robot.described(&parameters.initial()))
}

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
