use schemars::JsonSchema;
use serde::Deserialize;
use supple::quantity::{Known, Measurable, QuantityFile, Unfit, Vocabulary};
use supple::{Channel, Point, Scalar, Value};

/// The angle at which a camera sees a frame, rad: in the vertical plane through x, from the x axis upwards.
#[derive(Clone, Debug)]
pub struct Bearing {
    /// The place of the frame's first signal; its x, y and z are the first three.
    frame: usize,
    camera: [Value; 2],
}

/// The angle at which a camera sees a frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the frame or link.
    frame: String,
    /// Where the camera is: x and z in the world, m.
    camera: [Value; 2],
}

impl QuantityFile for Bearing {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        Ok(Self { frame: vocabulary.frame("frame", &file.frame)?, camera: file.camera })
    }
}

impl Measurable for Bearing {
    const NAME: &'static str = "bearing";

    fn len(&self) -> usize {
        1
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        vec![Channel::new(format!("bearing of {}", vocabulary.frame_of(self.frame)), "rad")]
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, known: &Known<S>, out: &mut [S]) {
        let [x, z] = self.camera.each_ref().map(|place| at.value(place));
        let (ahead, above) = (known.signals[self.frame] - x, known.signals[self.frame + 2] - z);
        out[0] = above.atan2(ahead);
    }
}
