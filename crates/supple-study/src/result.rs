use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Serialize};
use supple::bound::TaskBound;
use supple::design::DesignStatus;
use supple::{Evaluation, PlanCheck};

use crate::bound::{BoundStudy, Curve};
use crate::design::DesignReport;
use crate::evaluate::EvaluateReport;
use crate::pareto::{Pareto, ParetoPoint};
use crate::robustness::Robustness;
use crate::sensors::Sensors;
use crate::sweep::Sweep;
use crate::trace::Trace;
use crate::{About, NotFinite, StudyError, not_finite};

/// The result of a study file.
///
/// In the result of a study file:
///
/// ```json
/// { "steps": ["landscape"], "figures": ["figures/landscape.svg"] }
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Steps {
    /// Names of its steps; each has a folder of its name.
    pub steps: Vec<String>,
    /// Files of its figures, as seen from its folder.
    pub figures: Vec<String>,
}

/// A result of any study.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", content = "result", rename_all = "snake_case")]
pub enum StudyResult {
    /// Of `supple design`.
    Design(Box<DesignReport>),
    /// Of `supple evaluate`.
    Evaluate(Box<EvaluateReport>),
    /// Of `supple sweep`.
    Sweep(Box<Sweep>),
    /// Of `supple robustness`.
    Robustness(Box<Robustness>),
    /// Of `supple pareto`.
    Pareto(Box<Pareto>),
    /// Of `supple trace`.
    Trace(Box<Trace>),
    /// Of `supple sensors`.
    Sensors(Box<Sensors>),
    /// Of `supple bound`.
    Bound(Box<BoundStudy>),
    /// Of `supple study`: the folders of its steps.
    Study(Box<Steps>),
}

/// Of which kind the result in a `result.json` is.
#[derive(Deserialize)]
pub(crate) struct Kind {
    pub kind: String,
}

/// The commands that make results.
const KINDS: [&str; 9] = ["design", "evaluate", "sweep", "robustness", "pareto", "trace", "sensors", "bound", "study"];

impl StudyResult {
    /// The result in the text of a `result.json`: of the kind that it names, so that only a result of that kind is read, and
    /// errors name its lines.
    ///
    /// # Errors
    /// Where it is not such a result.
    pub(crate) fn of_file(text: &str) -> serde_json::Result<Self> {
        fn read<R: DeserializeOwned>(text: &str, of: fn(Box<R>) -> StudyResult) -> serde_json::Result<StudyResult> {
            #[derive(Deserialize)]
            struct Of<R> {
                result: R,
            }
            serde_json::from_str::<Of<R>>(text).map(|found| of(Box::new(found.result)))
        }
        let Kind { kind } = serde_json::from_str(text)?;
        match kind.as_str() {
            "design" => read(text, Self::Design),
            "evaluate" => read(text, Self::Evaluate),
            "sweep" => read(text, Self::Sweep),
            "robustness" => read(text, Self::Robustness),
            "pareto" => read(text, Self::Pareto),
            "trace" => read(text, Self::Trace),
            "sensors" => read(text, Self::Sensors),
            "bound" => read(text, Self::Bound),
            "study" => read(text, Self::Study),
            _ => Err(serde_json::Error::unknown_variant(&kind, &KINDS)),
        }
    }

    /// The command that makes such results: `design`, `evaluate`...
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Design(_) => "design",
            Self::Evaluate(_) => "evaluate",
            Self::Sweep(_) => "sweep",
            Self::Robustness(_) => "robustness",
            Self::Pareto(_) => "pareto",
            Self::Trace(_) => "trace",
            Self::Sensors(_) => "sensors",
            Self::Bound(_) => "bound",
            Self::Study(_) => "study",
        }
    }

    /// Whether it was told to stop before all of it was found; a journal may keep the parts that were.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        match self {
            // Starts that were not begun are not in the list.
            Self::Design(result) => {
                result.status == DesignStatus::Stopped
                    || result.starts.iter().any(|start| start.status == DesignStatus::Stopped)
            }
            Self::Sweep(result) => !result.complete,
            Self::Robustness(result) => result.stopped,
            Self::Pareto(result) => result.stopped,
            Self::Trace(result) => result.stopped,
            Self::Evaluate(_) | Self::Sensors(_) | Self::Bound(_) | Self::Study(_) => false,
        }
    }

    /// Whether it is less than what was asked for: stopped, not converged, above a limit, with warnings, or contradicted by
    /// roll-outs; `about` is the task. Numbers that are not finite are for [`not_finite`](Self::not_finite) to find.
    #[must_use]
    pub fn falls_short(&self, about: &About) -> bool {
        let as_asked = match self {
            Self::Design(result) => {
                result.status == DesignStatus::Converged
                    && is_trusted(&result.optimum)
                    && !result.unconfirmed(about).is_some_and(|found| found.is_contradicted())
            }
            Self::Evaluate(result) => result.evaluation.feasible && is_trusted(&result.evaluation),
            Self::Sweep(result) => result.untrusted() < result.table.rows.len(),
            Self::Robustness(result) => {
                result.cells.iter().all(|cell| cell.error.is_none() && !cell.is_broken())
                    && result.designs.iter().all(|design| {
                        design.warnings.is_empty()
                            && design.status.is_none_or(|status| status == DesignStatus::Converged)
                    })
            }
            Self::Pareto(result) => {
                let found = |point: &ParetoPoint| {
                    point.status == DesignStatus::Converged && point.warnings.is_empty() && !point.is_broken()
                };
                result.points.iter().all(found)
            }
            Self::Bound(result) => {
                let proved = |task: &TaskBound| task.has_sound_plan() && task.is_certified() && task.is_finite();
                let found = |curve: &Curve| curve.points.iter().all(|point| point.error.is_none());
                result.report.tasks.iter().all(proved) && result.curves.iter().all(found)
            }
            Self::Sensors(result) => result.plans.iter().all(PlanCheck::is_passed),
            // Traces succeed however their searches ended.
            Self::Trace(_) | Self::Study(_) => true,
        };
        !as_asked || self.is_stopped()
    }

    /// All of its numbers that are not finite, but for those that say why.
    #[must_use]
    pub fn not_finite(&self) -> Vec<NotFinite> {
        match self {
            Self::Design(result) => not_finite(result),
            Self::Evaluate(result) => not_finite(&result.evaluation),
            // Table cells are always finite; the column `error` explains missing ones.
            Self::Sweep(_) => Vec::new(),
            Self::Robustness(result) => not_finite(result),
            Self::Pareto(result) => not_finite(result),
            Self::Trace(result) => not_finite(result),
            Self::Sensors(result) => not_finite(result),
            Self::Bound(result) => not_finite(result),
            Self::Study(result) => not_finite(result),
        }
    }

    /// The result as programs read it: one JSON object; of a sweep its table, as lines of JSON.
    ///
    /// # Errors
    /// Where it cannot be told in JSON.
    pub fn json(&self) -> Result<String, StudyError> {
        let text = match self {
            Self::Design(result) => serde_json::to_string_pretty(result),
            Self::Evaluate(result) => serde_json::to_string_pretty(&result.evaluation),
            Self::Sweep(result) => Ok(result.table.to_jsonl()),
            Self::Robustness(result) => serde_json::to_string_pretty(result),
            Self::Pareto(result) => serde_json::to_string_pretty(result),
            Self::Trace(result) => serde_json::to_string_pretty(result),
            Self::Sensors(result) => serde_json::to_string_pretty(result),
            Self::Bound(result) => return result.json(),
            Self::Study(result) => serde_json::to_string_pretty(result),
        };
        text.map_err(|error| StudyError::Usage(error.to_string()))
    }
}

/// Whether nothing speaks against the numbers of a design.
fn is_trusted(at: &Evaluation) -> bool {
    at.warnings().next().is_none() && !at.is_broken()
}
