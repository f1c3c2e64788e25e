//! What the sensor would measure that needs the least information.

use serde_json::{Value, json};
use supple::Problem;
use supple::bound::BoundOptions;
use supple_text::printed_unit;

use crate::evaluate::alone;

/// The virtual sensor of a task at a cost, or at the design's own: what it measures when, in words.
///
/// # Errors
/// Where the task cannot be planned, or the minimum is not found: why.
pub fn virtual_sensor(problem: &Problem, phi: &[f64], task: usize) -> Result<Value, String> {
    let one = alone(problem, task);
    let said = |error: supple::Error| error.to_string();
    let bounding = one.bounding(phi, &BoundOptions::default()).map_err(said)?;
    let Some(bounding) = bounding.first() else { return Ok(Value::Null) };
    let least = bounding.minimum_cost();
    let bound = one.tasks.first().and_then(|task| task.bound.as_ref()).map(|bound| bound.resolve::<f64>(phi));
    let report = bounding.report(bound.filter(|&bound| bound > least)).map_err(said)?;
    let windows: Vec<Value> = report
        .virtual_sensor
        .windows
        .iter()
        .map(|window| {
            let texts: Vec<Value> = window
                .directions
                .iter()
                .map(|one| json!({ "bits": one.bits, "text": one.text, "deviation": one.deviation, "unit": printed_unit(&one.unit) }))
                .collect();
            json!({ "from": window.from_s, "until": window.until_s, "bits": window.bits, "directions": texts })
        })
        .collect();
    Ok(json!({
        "cost": report.cost,
        "bits": report.minimum_bits,
        "measured": report.virtual_sensor.measured,
        "windows": windows,
    }))
}
