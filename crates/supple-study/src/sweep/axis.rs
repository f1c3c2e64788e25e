use serde::{Deserialize, Serialize};
use supple::math;
use supple::parameters::{Parameter, Scale};
use supple_text::{digits, nearest};

use crate::{LoadedTask, StudyError};

/// Points that a grid has at most: its table has to fit into memory.
pub const MOST_POINTS: usize = 10_000_000;

/// One axis of a grid.
///
/// Example: the [module](crate::sweep).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// The parameter that changes along it.
    pub parameter: String,
    /// Its unit; empty where it has none.
    pub unit: String,
    /// How its values are spread, for plots.
    pub scale: Scale,
    /// The values, in the order of the rows.
    pub values: Vec<f64>,
}

/// How an axis is written.
const FORMS: &str = "write NAME=FROM:TO:COUNT, NAME=lin:FROM:TO:COUNT, NAME=log:FROM:TO:COUNT or NAME=A,B,..";

impl Axis {
    /// Reads `NAME=SPEC`, where SPEC is `FROM:TO:COUNT` or `lin:FROM:TO:COUNT` (linear), `log:FROM:TO:COUNT`, or
    /// `A,B,C`. With a COUNT of 1 the value is FROM.
    ///
    /// # Errors
    /// Where it is not one of these, the parameter is unknown, or a value is outside its bounds.
    pub fn parse(text: &str, task: &LoadedTask) -> Result<Self, StudyError> {
        Self::parse_as(text, task, Scale::Linear)
    }

    /// The same, with values spread as `spread` says where the text does not.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_as(text: &str, task: &LoadedTask, spread: Scale) -> Result<Self, StudyError> {
        let wrong = |what: String| StudyError::Usage(format!("{text}: {what}"));
        let (name, spec) = text.split_once('=').ok_or_else(|| wrong(FORMS.to_owned()))?;
        let parameter = find(name.trim(), task).map_err(wrong)?;
        let (scale, values) = values(spec, parameter, spread).map_err(wrong)?;
        let axis = Self { parameter: parameter.name.clone(), unit: parameter.unit.clone(), scale, values };
        axis.check(task).map_err(wrong)?;
        Ok(axis)
    }

    /// Values from one to another, both of which are hit exactly.
    pub(crate) fn spread(scale: Scale, [from, to]: [f64; 2], count: usize) -> Result<Vec<f64>, String> {
        if count == 0 {
            return Err("COUNT = 0: the axis would be empty; COUNT is at least 1".to_owned());
        }
        if scale == Scale::Log && !(from > 0.0 && to > 0.0) {
            return Err(format!("a logarithmic axis needs positive ends; found {} and {}", digits(from), digits(to)));
        }
        if count > 1 && from == to {
            return Err(format!("FROM and TO are both {from}, so COUNT must be 1; found {count}"));
        }
        let (least, greatest) = (from.min(to), from.max(to));
        let last = count - 1;
        let value = |i: usize| {
            let share = i as f64 / last as f64;
            let between = match scale {
                Scale::Linear => from + share * (to - from),
                Scale::Log if (to / from).is_normal() => from * math::powf(to / from, share),
                // The ratio is too large or too small for a number.
                Scale::Log => math::powf(from, 1.0 - share) * math::powf(to, share),
            };
            between.clamp(least, greatest)
        };
        Ok((0..count)
            .map(|i| {
                if i == 0 {
                    from
                } else if i == last {
                    to
                } else {
                    value(i)
                }
            })
            .collect())
    }

    /// What is wrong with the axis, and what is valid.
    pub(super) fn check(&self, task: &LoadedTask) -> Result<(), String> {
        let Parameter { name, bounds: [lower, upper], .. } = find(&self.parameter, task)?;
        match self.values.len() {
            0 => return Err("there are no values; an axis has at least one".to_owned()),
            count if count > MOST_POINTS => return Err(too_many(count as f64)),
            _ => {}
        }
        if task.problem.is_set_by_all_tasks(name) {
            return Err(format!("every task sets `{name}` for itself, so that it would change nothing"));
        }
        if let Some(value) = self.values.iter().find(|value| !(lower..=upper).contains(value)) {
            return Err(format!("{value} is outside the bounds of `{name}`, [{lower}, {upper}]"));
        }
        let mut sorted = self.values.clone();
        sorted.sort_by(f64::total_cmp);
        match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(format!("the value {} occurs twice; values must be distinct", pair[0])),
            None => Ok(()),
        }
    }
}

/// A grid of so many points is too large.
pub(super) fn too_many(points: f64) -> String {
    format!("{points} points are too many; a grid has at most {MOST_POINTS}")
}

/// The parameter of a name, or what is wrong with the name.
fn find<'a>(name: &str, task: &'a LoadedTask) -> Result<&'a Parameter, String> {
    let parameters = &task.problem.parameters;
    let index = parameters.index(name).map_err(|error| match nearest(name, &parameters.names()) {
        Some(advice) => format!("{error} ({advice})"),
        None => error.to_string(),
    })?;
    Ok(parameters.get(index))
}

/// The values of a specification and how they are spread, or what is wrong with it.
fn values(spec: &str, parameter: &Parameter, spread: Scale) -> Result<(Scale, Vec<f64>), String> {
    let (given, rest) = match spec.split_once(':') {
        Some((word, rest)) if word.trim() == "log" => (Some(Scale::Log), rest),
        Some((word, rest)) if word.trim() == "lin" => (Some(Scale::Linear), rest),
        _ => (None, spec),
    };
    let scale = given.unwrap_or(spread);
    match rest.split(':').map(str::trim).collect::<Vec<_>>()[..] {
        [list] if given.is_none() => {
            let values = list.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
            let logarithmic = spread == Scale::Log || parameter.scale == Scale::Log;
            let positive = values.iter().all(|&value| value > 0.0);
            Ok((if logarithmic && positive { Scale::Log } else { Scale::Linear }, values))
        }
        [from, to, count] => {
            let (from, to) = (number(from)?, number(to)?);
            let most = MOST_POINTS;
            let count: u64 = count.parse().map_err(|_| format!("COUNT = `{count}` is not an integer; {FORMS}"))?;
            match usize::try_from(count).ok().filter(|&count| count <= most) {
                Some(count) => Ok((scale, Axis::spread(scale, [from, to], count)?)),
                None => Err(too_many(count as f64)),
            }
        }
        _ => Err(FORMS.to_owned()),
    }
}

fn number(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let number = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| format!("`{text}` is not a number; {FORMS}"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::sweep::tests::task;

    fn parsed(text: &str) -> (Scale, Vec<f64>) {
        let axis = Axis::parse(text, &task()).unwrap();
        (axis.scale, axis.values)
    }

    #[test]
    fn axes_are_read_in_every_form() {
        assert_eq!(parsed("k1=50:600:3"), (Scale::Linear, vec![50.0, 325.0, 600.0]));
        assert_eq!(parsed(" k1 = lin: 600 : 50 : 3 "), (Scale::Linear, vec![600.0, 325.0, 50.0]));
        assert_eq!(parsed("k1=75:600:1"), (Scale::Linear, vec![75.0]));
        assert_eq!(parsed("k1=75:75:1"), (Scale::Linear, vec![75.0]));
        let wide = Axis::spread(Scale::Log, [1e-200, 1e200], 5).unwrap();
        assert!(
            wide.iter()
                .zip([1e-200, 1e-100, 1.0, 1e100, 1e200])
                .all(|(value, right)| (value / right - 1.0).abs() < 1e-12)
        );
        assert_eq!(parsed("k1=60,50,1e2"), (Scale::Log, vec![60.0, 50.0, 100.0]));
        assert_eq!(parsed("wall_variance=2e-4"), (Scale::Log, vec![2e-4]));
        let (scale, values) = parsed("wall_variance=log:1e-8:1:9");
        assert_eq!((scale, values[0], values[8], values.len()), (Scale::Log, 1e-8, 1.0, 9));
        assert!(values.windows(2).all(|pair| (pair[1] / pair[0] - 10.0).abs() < 1e-12), "{values:?}");
        let axis = Axis::parse_as("k1=100:400:3", &task(), Scale::Log).unwrap();
        assert_eq!((axis.scale, axis.unit.as_str(), axis.values[0], axis.values[2]), (Scale::Log, "N/m", 100.0, 400.0));
        assert!((axis.values[1] - 200.0).abs() < 1e-12);
        assert_eq!(Axis::parse_as("k1=lin:100:400:3", &task(), Scale::Log).unwrap().values, [100.0, 250.0, 400.0]);
    }

    #[test]
    fn ends_are_exact_and_values_within_them() {
        for count in [2, 3, 7, 1000] {
            for text in ["k2=log:100:600", "k2=100:600", "k2=log:600:100", "drive_variance=log:1e-8:1"] {
                let (_, values) = parsed(&format!("{text}:{count}"));
                let ends: Vec<f64> =
                    text.rsplit(':').take(2).map(|end| end.rsplit('=').next().unwrap().parse().unwrap()).collect();
                assert_eq!([values[count - 1], values[0]], ends[..]);
            }
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_what_is_valid() {
        let forms = "write NAME=FROM:TO:COUNT";
        for (text, said) in [
            ("", forms),
            ("k1", forms),
            ("k1=", "`` is not a number"),
            ("k1=a", "`a` is not a number"),
            ("k1=1:2", forms),
            ("k1=1:2:3:4", forms),
            ("k1=log:1,2", forms),
            ("k1=log:", forms),
            ("k1=:2:3", "`` is not a number"),
            ("k1=50:nan:3", "`nan` is not a number"),
            ("k1=50:inf:3", "`inf` is not a number"),
            ("k1=50,,60", "`` is not a number"),
            ("k1=50:60:x", "COUNT = `x` is not an integer"),
            ("k1=50:60:-1", "COUNT = `-1` is not an integer"),
            ("k1=50:60:2.5", "COUNT = `2.5` is not an integer"),
            ("k1=50:60:0", "COUNT is at least 1"),
            ("k1=50:60:10000001", "a grid has at most 10000000"),
            ("k1=50:60:99999999999999999999", "is not an integer"),
            ("k1=50:50:2", "so COUNT must be 1; found 2"),
            ("k1=log:0:60:3", "a logarithmic axis needs positive ends; found 0 and 60"),
            ("k1=log:50:-60:3", "a logarithmic axis needs positive ends; found 50 and -60"),
            ("k1=40:60:3", "40 is outside the bounds of `k1`, [50, 600]"),
            ("k1=50:601:3", "601 is outside the bounds of `k1`, [50, 600]"),
            ("k1=50,60,50", "the value 50 occurs twice"),
            (
                "K1=50:60:3",
                "no parameter `K1`; valid: `k1`, `k2`, `wall_variance`, `drive_variance` (did you mean `k1`?)",
            ),
            ("wall_varience=1e-3", "(did you mean `wall_variance`?)"),
            ("=50:60:3", "no parameter ``"),
        ] {
            let error = Axis::parse(text, &task()).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{text}: ")) && error.contains(said), "{text}: {error}");
        }
    }
}
