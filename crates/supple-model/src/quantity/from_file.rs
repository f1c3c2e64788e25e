use serde::Deserialize;
use supple_kernels::Scalar;

use super::{FramePoint, FrameTurn, JointPosition, JointTorque, JointVelocity};
use super::{Known, Measurable, Quantity, QuantityFile, Unfit, Vocabulary};
use crate::channels::Channel;
use crate::physics::{Point, Sensed};

/// The quantities that sensors of the robot file measure, in their units.
///
/// As a sensor in a task file:
///
/// ```toml
/// sensors = [{ kind = "file", select = ["elbow_encoder"], variance = 1e-6 }]
/// ```
#[derive(Clone, Debug)]
pub struct FromFile {
    sensors: Vec<Quantity>,
}

/// What sensors of the robot's file measure.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Names of the sensors.
    select: Vec<String>,
}

impl QuantityFile for FromFile {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        if file.select.is_empty() {
            return Err(Unfit::new("select", "name at least one"));
        }
        Ok(Self { sensors: file.select.iter().map(|name| sensor(name, vocabulary)).collect::<Result<_, _>>()? })
    }
}

/// What the sensor of this name measures.
fn sensor(name: &str, vocabulary: &Vocabulary) -> Result<Quantity, Unfit> {
    let all = &vocabulary.file_sensors;
    let supported = all.iter().filter(|sensor| !matches!(sensor.measures, Sensed::Nothing { .. }));
    let names: Vec<&str> = supported.map(|sensor| sensor.name.as_str()).collect();
    let Some(sensor) = all.iter().find(|sensor| sensor.name == name) else {
        let what = format!("the robot file has no sensor `{name}`");
        return Err(Unfit::unknown("select", &what, name, &names));
    };
    let joint = |joint: &String| vocabulary.selected_joints(Some(vec![joint.clone()]));
    Ok(match &sensor.measures {
        Sensed::JointPosition(name) => JointPosition::of(&joint(name)?, vocabulary)?.into(),
        Sensed::JointVelocity(name) => JointVelocity::of(&joint(name)?, vocabulary)?.into(),
        Sensed::JointTorque(name) => JointTorque::of(&joint(name)?, vocabulary)?.into(),
        Sensed::FramePosition { first } => FramePoint::of(*first).into(),
        Sensed::FrameOrientation { first, reference } => FrameTurn::new(*first, *reference).into(),
        Sensed::Nothing { line, why } => {
            let message = format!("sensor `{name}` of the robot's file (line {line}) is not supported: {why}");
            let help = format!("supported sensors: {}", supple_text::owned(&names));
            return Err(Unfit { help: Some(help), ..Unfit::new("select", message) });
        }
    })
}

impl Measurable for FromFile {
    const NAME: &'static str = "file";

    fn len(&self) -> usize {
        self.sensors.iter().map(Quantity::len).sum()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        self.sensors.iter().flat_map(|sensor| sensor.channels(vocabulary)).collect()
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, known: &Known<S>, out: &mut [S]) {
        let mut rest = out;
        for sensor in &self.sensors {
            let (own, others) = rest.split_at_mut(sensor.len());
            sensor.evaluate(at, known, own);
            rest = others;
        }
    }
}
