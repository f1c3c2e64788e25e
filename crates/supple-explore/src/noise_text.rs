//! Changed noise as edits of the task file's text: only the numbers are replaced, so that names and comments are kept.

use std::collections::BTreeMap;
use std::ops::Range;

use supple::noise::Covariance;
use supple::{Problem, Value};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::knobs::{Kind, NoiseFactor};

/// A piece of a text, and what takes its place.
pub type Edit = (Range<usize>, String);

/// The edits of a task file after which its noise is the turned one.
///
/// # Errors
/// Where the file gives noise in a way that cannot be edited: which.
pub fn noise_edits(text: &str, problem: &Problem, factors: &[NoiseFactor]) -> Result<Vec<Edit>, String> {
    let mut edits = Edits { text, list: Vec::new() };
    if factors.is_empty() {
        return Ok(edits.list);
    }
    let root = DeTable::parse(text).map_err(|error| error.to_string())?;
    let mut of_sensors: BTreeMap<usize, Vec<&NoiseFactor>> = BTreeMap::new();
    for one in factors {
        let task = task(root.get_ref(), one.task).ok_or_else(|| refused(one, "its task has no table"))?;
        let noise = table(task, "noise").ok_or_else(|| refused(one, "its task has no table `noise`"))?;
        let [variances, deviations] = keys(one.kind);
        let square = one.factor * one.factor;
        match (noise.get(variances), noise.get(deviations)) {
            (Some(value), _) => edits.scale(value, one, square)?,
            (None, Some(value)) => edits.scale(value, one, one.factor)?,
            (None, None) => of_sensors.entry(one.task).or_default().push(one),
        }
    }
    for (index, factors) in of_sensors {
        let task = task(root.get_ref(), index).ok_or_else(|| refused(factors[0], "its task has no table"))?;
        edits.own_measurement(problem, index, task, &factors)?;
    }
    Ok(edits.list)
}

/// A decimal number as files write it.
pub fn plain_number(text: &str) -> Option<f64> {
    text.replace('_', "").parse().ok()
}

fn refused(one: &NoiseFactor, why: &str) -> String {
    format!("`{}` cannot be written to the file: {why}; set it to 1", one.name)
}

/// The keys of `noise` for variances and for standard deviations.
fn keys(kind: Kind) -> [&'static str; 2] {
    match kind {
        Kind::Initial => ["initial", "initial_deviation"],
        Kind::Process => ["process", "process_deviation"],
        Kind::Measurement => ["measurement", "measurement_deviation"],
    }
}

fn task<'a>(root: &'a DeTable<'a>, index: usize) -> Option<&'a DeTable<'a>> {
    let DeValue::Array(tasks) = root.get("tasks")?.get_ref() else { return None };
    let DeValue::Table(task) = tasks.get(index)?.get_ref() else { return None };
    Some(task)
}

fn table<'a>(of: &'a DeTable<'a>, key: &str) -> Option<&'a DeTable<'a>> {
    let DeValue::Table(table) = of.get(key)?.get_ref() else { return None };
    Some(table)
}

/// Edits of a text.
struct Edits<'a> {
    text: &'a str,
    list: Vec<Edit>,
}

impl Edits<'_> {
    /// Multiplies all numbers of a value, or one entry of a list.
    fn scale(&mut self, value: &Spanned<DeValue>, one: &NoiseFactor, factor: f64) -> Result<(), String> {
        let value = match (one.one, value.get_ref()) {
            (None, _) => value,
            (Some(entry), DeValue::Array(list)) if entry < list.len() => &list[entry],
            _ => return Err(refused(one, "it is given together with other measurements")),
        };
        match value.get_ref() {
            DeValue::Array(list) => {
                list.iter().try_for_each(|value| self.scale(value, &NoiseFactor { one: None, ..*one }, factor))
            }
            DeValue::Table(table) => {
                table.iter().try_for_each(|(_, value)| self.scale(value, &NoiseFactor { one: None, ..*one }, factor))
            }
            DeValue::Integer(_) | DeValue::Float(_) => {
                let span = value.span();
                let written = self.text.get(span.clone()).unwrap_or_default();
                let number = plain_number(written)
                    .ok_or_else(|| refused(one, &format!("`{written}` is not a decimal number")))?;
                self.list.push((span, format!("{:?}", number * factor)));
                Ok(())
            }
            // Names and expressions of parameters, which have their own sliders.
            _ => Ok(()),
        }
    }

    /// Adds `measurement` to the noise of a task whose measurements have the noise of the model's sensors.
    fn own_measurement(
        &mut self,
        problem: &Problem,
        index: usize,
        task: &DeTable,
        factors: &[&NoiseFactor],
    ) -> Result<(), String> {
        let first = factors[0];
        let of = &problem.tasks[index];
        let Covariance::Diagonal(variances) = &of.noise.measurement else {
            return Err(refused(first, "the noise of its sensors is not independent"));
        };
        // What is given per second was divided by the time step.
        let per_second = matches!(task.get("per").map(Spanned::get_ref), Some(DeValue::String(per)) if per == "second");
        let time_step = match (per_second, &of.time_step) {
            (false, _) => 1.0,
            (true, Value::Number(time_step)) => *time_step,
            _ => return Err(refused(first, "it is given per second, and the time step is a parameter")),
        };
        let written = |(entry, variance): (usize, &Value)| match variance {
            Value::Number(number) => {
                let wanted = factors.iter().filter(|one| one.one.is_none_or(|one| one == entry));
                let number = wanted.fold(*number, |number, one| number * (one.factor * one.factor));
                Ok(format!("{:?}", number * time_step))
            }
            Value::Parameter(parameter) if !per_second => {
                Ok(toml::Value::String(problem.parameters.get(parameter.index()).name.clone()).to_string())
            }
            _ => Err(refused(first, "the noise of another sensor is an expression")),
        };
        let list = variances.iter().enumerate().map(written).collect::<Result<Vec<_>, _>>()?.join(", ");
        let noise = table(task, "noise").ok_or_else(|| refused(first, "its task has no table `noise`"))?;
        let key = noise.iter().map(|(key, _)| key.span().start).min();
        let key = key.ok_or_else(|| refused(first, "the table `noise` of its task is empty"))?;
        let line = self.text[..key].rfind('\n').map_or(0, |end| end + 1);
        let before = &self.text[line..key];
        // `noise = { initial = ..`, or a line for itself: `initial = ..`, `noise.initial = ..`.
        let edit = match before.contains('{') {
            true => (key..key, format!("measurement = [{list}], ")),
            false => (line..line, format!("{before}measurement = [{list}]\n")),
        };
        self.list.push(edit);
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use supple::ParameterHandle;

    use super::*;

    const FILE: &str = r#"
title = "two tasks"
[model]
kind = "linear"
A = [[1.0]]
B = [[1.0]]
C = [[1.0], [2.0]]
[parameters.v]
initial = 0.5
bounds = [0.1, 1.0]
[[tasks]]
name = "one"
steps = 3
time_step = 0.1
per = "second"
initial_state = [1.0]
[tasks.noise]              # variances
initial = [1_0.0]          # of x
process_deviation = [3]    # stays
measurement = [2.0, "v"]   # of y1, y2
[[tasks.costs]]
kind = "control"
weight = 1.0
[[tasks]]
name = "two"
steps = 3
time_step = 0.1
initial_state = [1.0]
noise = { initial = [[4.0]], process = [0.0], measurement_deviation = [1.0, 2.0] }
[[tasks.costs]]
kind = "control"
weight = 1.0
"#;

    fn edited(factors: &[NoiseFactor]) -> Result<String, String> {
        let problem = supple_file::parse(FILE, "task.toml").unwrap();
        let mut edits = noise_edits(FILE, &problem, factors)?;
        edits.sort_by_key(|edit| std::cmp::Reverse(edit.0.start));
        let mut text = FILE.to_owned();
        edits.into_iter().for_each(|(span, new)| text.replace_range(span, &new));
        Ok(text)
    }

    fn factor(task: usize, kind: Kind, one: Option<usize>, factor: f64) -> NoiseFactor<'static> {
        NoiseFactor { name: "noise", task, kind, one, factor }
    }

    #[test]
    fn numbers_change_where_they_stand_and_comments_stay() {
        let text = edited(&[
            factor(0, Kind::Initial, None, 2.0),
            factor(0, Kind::Process, None, 0.5),
            factor(0, Kind::Measurement, Some(0), 3.0),
            factor(1, Kind::Initial, None, 2.0),
            factor(1, Kind::Measurement, Some(1), 4.0),
        ]);
        let expected = FILE
            .replace("[1_0.0] ", "[40.0] ")
            .replace("process_deviation = [3]", "process_deviation = [1.5]")
            .replace("[2.0, \"v\"]", "[18.0, \"v\"]")
            .replace("[[4.0]]", "[[16.0]]")
            .replace("measurement_deviation = [1.0, 2.0]", "measurement_deviation = [1.0, 8.0]");
        assert_eq!(text.unwrap(), expected);
    }

    #[test]
    fn noise_of_sensors_is_written_to_the_task() {
        for (before, after) in [
            ("[tasks.noise]\n  initial = [1.0]", "[tasks.noise]\n  measurement = [9.0, \"v\"]\n  initial = [1.0]"),
            ("noise = { initial = [1.0] }", "noise = { measurement = [9.0, \"v\"], initial = [1.0] }"),
            ("noise.initial = [1.0]", "noise.measurement = [9.0, \"v\"]\nnoise.initial = [1.0]"),
        ] {
            let mut problem = supple_file::parse(FILE, "task.toml").unwrap();
            problem.tasks[0].noise.measurement =
                Covariance::diagonal([Value::from(1.0), ParameterHandle::at(0).into()]);
            let text = format!("[[tasks]]\n{before}\n");
            let edits = noise_edits(&text, &problem, &[factor(0, Kind::Measurement, Some(0), 3.0)]).unwrap();
            let [(span, new)] = &edits[..] else { panic!("{edits:?}") };
            let mut text = text;
            text.replace_range(span.clone(), new);
            assert_eq!(text, format!("[[tasks]]\n{after}\n"));
        }
    }

    #[test]
    fn what_cannot_be_written_is_told() {
        let text = "[[tasks]]\nnoise = { initial = [0x10], measurement = [[1.0]] }\n";
        let problem = supple_file::parse(FILE, "task.toml").unwrap();
        let try_it = |one| noise_edits(text, &problem, &[one]).unwrap_err();
        assert!(try_it(factor(0, Kind::Initial, None, 2.0)).contains("`0x10` is not a decimal number"));
        assert!(try_it(factor(0, Kind::Measurement, Some(3), 2.0)).contains("together with other measurements"));
        assert!(try_it(factor(4, Kind::Initial, None, 2.0)).contains("has no table"));
    }
}
