//! Quantities over time, as curves of few bytes.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use serde_json::{Value, json};
use supple::scene::ConnectionKind;
use supple::simulate::Sample;
use supple::{ContactCurve, MeasurementReport, QuantityCurve, Scratch, Task, TaskEvaluation, TrajectoryReport};
use supple_text::printed_unit;

use crate::evaluate::Evaluated;

/// Points of a curve at most: as many as a panel has pixels.
const MOST_POINTS: usize = 251;

/// A quantity over time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quantity {
    /// Its name in requests: kind and place, such as `state:0`.
    pub key: String,
    /// What kind it is, for people.
    pub group: &'static str,
    /// Its name, for people.
    pub name: String,
    /// Its unit, as it is printed.
    pub unit: String,
}

/// All quantities of a task at a design, the most telling ones of each kind first.
pub fn quantities(task: &Task, phi: &[f64]) -> Vec<Quantity> {
    let channels = task.system.channels();
    let contacts = task.system.contacts();
    let mut list = Vec::new();
    let mut add = |kind: &str, place: usize, group: &'static str, name: &str, unit: &str| {
        list.push(Quantity { key: format!("{kind}:{place}"), group, name: name.to_owned(), unit: printed_unit(unit) });
    };
    for (place, contact) in contacts.iter().enumerate() {
        add("contact", place, "Contacts", &format!("normal force of {}", contact.name), "N");
        add("clearance", place, "Contacts", &format!("clearance of {}", contact.name), "m");
    }
    for (place, number) in task.system.followed(phi).iter().enumerate() {
        add("quantity", place, "Quantities", &format!("{} ({})", number.channel.name, number.of), &number.channel.unit);
    }
    let first = task.first_state(phi);
    let idle = vec![0.0; channels.controls.len()];
    if let Some(seen) = task.system.picture(&first, &idle, phi) {
        for (place, one) in seen.picture.connections.iter().enumerate() {
            add("force", place, "Forces", &format!("size of the force of {}", one.name), "N");
            if one.kind != ConnectionKind::Contact {
                add("torque", place, "Forces", &format!("size of the torque of {}", one.name), "N m");
            }
        }
    }
    for (place, channel) in channels.states.iter().enumerate() {
        add("state", place, "States", &channel.name, &channel.unit);
    }
    for (place, channel) in channels.controls.iter().enumerate() {
        add("control", place, "Controls", &channel.name, &channel.unit);
    }
    for (place, channel) in channels.measurements.iter().enumerate() {
        add("measured", place, "Measurements", &channel.name, &channel.unit);
    }
    add("information", 0, "Information", "information by measurement", "bits");
    add("information", 1, "Information", "information, summed", "bits");
    for (place, channel) in channels.measurements.iter().enumerate() {
        add("sensor", place, "Information by sensor", &format!("information from {}", channel.name), "bits");
    }
    add("cost", 0, "Cost", "cost per step", "");
    add("cost", 1, "Cost", "cost of estimation error per step", "");
    add("cost", 2, "Cost", "cost, summed", "");
    add("value", 0, "Cost", "value of information", "");
    list
}

/// A curve of a quantity: what it is of, with its numbers.
struct Curve {
    role: &'static str,
    values: Vec<f64>,
}

fn curve(role: &'static str, values: Vec<f64>) -> Curve {
    Curve { role, values }
}

/// The curves of the wanted quantities of the task that is shown; nothing where it has no trajectory.
pub fn curves(found: &Evaluated, wanted: &[String]) -> Value {
    let Some((task, at)) = found.shown() else { return Value::Null };
    let Some(trajectory) = &at.trajectory else { return Value::Null };
    let plan = Plan { task, phi: &found.phi, at, trajectory };
    let curves: Vec<Value> = wanted
        .iter()
        .filter_map(|key| {
            let (kind, place) = parsed(key)?;
            let (time, list) = plan.curves(kind, place)?;
            let series: Vec<Value> =
                list.iter().map(|one| json!({ "role": one.role, "y": packed(&one.values) })).collect();
            Some(json!({ "key": key, "x": packed(&time), "series": series }))
        })
        .collect();
    json!({ "end": trajectory.time.last(), "curves": curves, "touching": plan.touching() })
}

/// The curves of states, controls and measurements of other runs: threads.
pub fn threads(time: &[f64], samples: &[Sample], wanted: &[String]) -> Value {
    let curves = wanted.iter().filter_map(|key| {
        let (kind, place) = parsed(key)?;
        let rows: fn(&Sample) -> &Vec<Vec<f64>> = match kind {
            "state" => |sample| &sample.states,
            "control" => |sample| &sample.controls,
            "measured" => |sample| &sample.measurements,
            _ => return None,
        };
        let count = samples.iter().map(|sample| rows(sample).len()).max()?;
        let list: Vec<String> = samples
            .iter()
            .map(|sample| {
                let mut values = column(rows(sample), place);
                values.resize(count, f64::NAN);
                packed(&values)
            })
            .collect();
        Some(json!({ "key": key, "x": packed(&time[..count.min(time.len())]), "threads": list }))
    });
    Value::Array(curves.collect())
}

fn parsed(key: &str) -> Option<(&str, usize)> {
    let (kind, place) = key.split_once(':')?;
    Some((kind, place.parse().ok()?))
}

fn column(rows: &[Vec<f64>], place: usize) -> Vec<f64> {
    rows.iter().map(|row| row.get(place).copied().unwrap_or(f64::NAN)).collect()
}

fn sums(values: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut add = |value: &f64| {
        sum += value;
        sum
    };
    values.iter().map(&mut add).collect()
}

fn bits(nats: &[f64]) -> Vec<f64> {
    nats.iter().map(|nats| nats / std::f64::consts::LN_2).collect()
}

/// A plan, and what is known along it.
struct Plan<'a> {
    task: &'a Task,
    phi: &'a [f64],
    at: &'a TaskEvaluation,
    trajectory: &'a TrajectoryReport,
}

impl Plan<'_> {
    /// When each contact touches: its name, with the first and last time of every interval.
    fn touching(&self) -> Value {
        let intervals = |contact: &ContactCurve| {
            let mut found: Vec<[f64; 2]> = Vec::new();
            let mut open = false;
            for (&touches, &time) in contact.touches.iter().zip(&self.trajectory.time) {
                match found.last_mut().filter(|_| open && touches) {
                    Some(last) => last[1] = time,
                    None if touches => found.push([time, time]),
                    None => {}
                }
                open = touches;
            }
            found
        };
        let contacts = self.trajectory.contacts.iter();
        contacts.map(|contact| json!({ "name": contact.name, "intervals": intervals(contact) })).collect()
    }

    /// Times and curves of a quantity; `None` if there is none of this name.
    fn curves(&self, kind: &str, place: usize) -> Option<(Vec<f64>, Vec<Curve>)> {
        let Self { at, trajectory, .. } = *self;
        let list = match kind {
            "contact" => vec![curve("plan", trajectory.contacts.get(place)?.force.clone())],
            "clearance" => vec![curve("plan", trajectory.contacts.get(place)?.clearance_m.clone())],
            "state" if place < trajectory.state_names.len() => self.state(place),
            "control" if place < trajectory.control_names.len() => vec![
                curve("plan", column(&trajectory.controls, place)),
                curve("truth", column(&trajectory.sample.controls, place)),
            ],
            "quantity" => quantity(trajectory.quantities.get(place)?),
            "measured" => vec![curve("truth", column(&trajectory.sample.measurements, place))],
            "force" | "torque" => return self.connection(kind, place),
            "information" => self.information(place),
            "sensor" => sensor(trajectory.measurements.get(place)?),
            "cost" => self.cost(place),
            "value" => vec![curve("plan", at.cost.value_of_information_per_step.clone())],
            _ => return None,
        };
        let count = list.iter().map(|one| one.values.len()).max().filter(|&count| count > 0)?;
        Some((trajectory.time[..count.min(trajectory.time.len())].to_vec(), list))
    }

    fn state(&self, place: usize) -> Vec<Curve> {
        let TrajectoryReport { states, deviations, sample, .. } = self.trajectory;
        let (plan, deviation) = (column(states, place), column(deviations, place));
        let band = |factor: f64| plan.iter().zip(&deviation).map(|(x, d)| x + factor * d).collect();
        vec![
            curve("low", band(-2.0)),
            curve("high", band(2.0)),
            curve("plan", plan.clone()),
            curve("truth", column(&sample.states, place)),
            curve("estimate", column(&sample.estimates, place)),
        ]
    }

    fn connection(&self, kind: &str, place: usize) -> Option<(Vec<f64>, Vec<Curve>)> {
        let scene = self.trajectory.scene.as_ref()?;
        let one = scene.connections.get(place)?;
        let track = if kind == "force" { &one.force } else { &one.torque };
        let size = |row: &[f64; 3]| row.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
        let time: Vec<f64> = scene.time.0.iter().map(|row| row[0]).collect();
        let values = (0..time.len()).map(|frame| track.at(frame).map_or(f64::NAN, size)).collect();
        Some((time, vec![curve("plan", values)]))
    }

    fn information(&self, place: usize) -> Vec<Curve> {
        let measured = bits(&self.at.information.per_step_nats);
        let used = self.at.information.used.as_ref().map(|used| bits(&used.per_step_nats));
        let shown = |values: Vec<f64>| if place == 0 { values } else { sums(&values) };
        let mut list = vec![curve("measured", shown(measured))];
        list.extend(used.map(|used| curve("used", shown(used))));
        list
    }

    fn cost(&self, place: usize) -> Vec<Curve> {
        let Self { task, phi, at, trajectory } = *self;
        let belief = at.cost.belief_per_step.clone();
        if place == 1 {
            return vec![curve("plan", belief)];
        }
        let mut scratch = Scratch::default();
        let points = trajectory.states.iter().zip(&trajectory.controls).enumerate();
        let stage = points.map(|(t, (x, u))| task.system.stage_cost(t, x, u, phi, &mut scratch));
        let mut stage: Vec<f64> = stage.collect();
        if place == 0 {
            return vec![curve("plan", stage)];
        }
        // Sums go up to the end of each step, the last with the final cost.
        if let (Some(last), Some(end)) = (stage.last_mut(), trajectory.states.last()) {
            *last += task.system.final_cost(end, phi, &mut scratch);
        }
        vec![curve("plan", sums(&stage)), curve("belief", sums(&belief))]
    }
}

/// A quantity, with its target and limits as level lines.
fn quantity(one: &QuantityCurve) -> Vec<Curve> {
    let levels = [("target", one.target), ("limit", one.lower), ("limit", one.upper)];
    let levels = levels.into_iter().filter_map(|(role, level)| Some(curve(role, vec![level?; one.values.len()])));
    [curve("plan", one.values.clone()), curve("truth", one.run_values.clone())].into_iter().chain(levels).collect()
}

fn sensor(one: &MeasurementReport) -> Vec<Curve> {
    vec![curve("beyond", bits(&one.beyond_others_nats)), curve("alone", bits(&one.alone_nats))]
}

/// Numbers in single precision, little-endian, in base64; of long lists evenly spread ones, and the last.
pub fn packed(values: &[f64]) -> String {
    let count = values.len().min(MOST_POINTS);
    let place =
        |index: usize| if values.len() <= MOST_POINTS { index } else { index * (values.len() - 1) / (count - 1) };
    let bytes: Vec<u8> = (0..count).flat_map(|index| (values[place(index)] as f32).to_le_bytes()).collect();
    STANDARD.encode(bytes)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn long_lists_are_thinned_and_keep_their_ends() {
        let values: Vec<f64> = (0..10_001).map(f64::from).collect();
        let bytes = STANDARD.decode(packed(&values)).unwrap();
        let number = |at: usize| f32::from_le_bytes(bytes[4 * at..4 * at + 4].try_into().unwrap());
        assert_eq!((bytes.len(), number(0), number(250)), (4 * 251, 0.0, 10_000.0));
        assert_eq!(STANDARD.decode(packed(&values[..3])).unwrap().len(), 12);
        assert_eq!(packed(&[]), "");
    }
}
