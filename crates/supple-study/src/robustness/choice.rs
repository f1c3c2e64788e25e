use supple_text::nearest;

use super::report::DesignChoice;
use crate::{LoadedTask, StudyError};

/// How designs are written.
pub(super) const FORMS: &str =
    "write designs as `start`, `optimum` and NAME=PARAMETER:VALUE,PARAMETER:VALUE,.., separated by commas";

impl DesignChoice {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Start => "start",
            Self::Optimum => "optimum",
            Self::Named(name, _) => name,
        }
    }

    /// Reads designs separated by commas: `start`, `optimum`, and `NAME=PARAMETER:VALUE`, to which each
    /// `PARAMETER:VALUE` that follows belongs.
    ///
    /// # Errors
    /// Where it is none of these, a name or parameter occurs twice, a parameter is unknown, or a value is no number
    /// or out of bounds.
    pub fn parse_list(text: &str, task: &LoadedTask) -> Result<Vec<Self>, StudyError> {
        let mut designs: Vec<Self> = Vec::new();
        for word in text.split(',').map(str::trim) {
            let wrong = |what: String| StudyError::Usage(format!("`{word}`: {what}"));
            match (word.split_once('='), word.contains(':')) {
                (Some((name, first)), _) => {
                    let name = check_name(name.trim()).map_err(wrong)?;
                    let first = setting(first, &[], task).map_err(wrong)?;
                    designs.push(Self::Named(name, vec![first]));
                }
                (None, true) => match designs.last_mut() {
                    Some(Self::Named(_, values)) => {
                        let next = setting(word, values, task).map_err(wrong)?;
                        values.push(next);
                    }
                    _ => return Err(wrong(format!("it does not belong to a named design; {FORMS}"))),
                },
                (None, false) => designs.push(match word {
                    "start" => Self::Start,
                    "optimum" => Self::Optimum,
                    "" => return Err(StudyError::Usage(format!("a design is empty in `{text}`; {FORMS}"))),
                    _ => return Err(wrong(format!("it is not a design; {FORMS}"))),
                }),
            }
        }
        for (i, design) in designs.iter().enumerate() {
            if designs[..i].iter().any(|other| other.name() == design.name()) {
                return Err(StudyError::Usage(format!(
                    "there are two designs `{}`; name each one once",
                    design.name()
                )));
            }
        }
        Ok(designs)
    }
}

fn check_name(name: &str) -> Result<String, String> {
    match name {
        "" => Err(format!("the design has no name; {FORMS}")),
        "start" | "optimum" => Err(format!("`{name}` is a reserved name; choose another")),
        _ => Ok(name.to_owned()),
    }
}

/// Reads `PARAMETER:VALUE` of a design with `others` set already.
fn setting(text: &str, others: &[(String, f64)], task: &LoadedTask) -> Result<(String, f64), String> {
    let (name, value) = text.split_once(':').ok_or_else(|| FORMS.to_owned())?;
    let (name, value) = (name.trim(), value.trim());
    let value = value.parse().map_err(|_| format!("the value `{value}` is not a number"))?;
    let parameters = &task.problem.parameters;
    parameters.set(&mut task.phi.clone(), name, value).map_err(|error| {
        let advice = parameters.index(name).err().and_then(|_| nearest(name, &parameters.names()));
        advice.map_or_else(|| error.to_string(), |advice| format!("{error} ({advice})"))
    })?;
    match others.iter().any(|(other, _)| other == name) {
        true => Err(format!("the design sets `{name}` twice")),
        false => Ok((name.to_owned(), value)),
    }
}
