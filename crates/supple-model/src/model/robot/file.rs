//! How robots are read from task files.

use std::path::PathBuf;

#[cfg(feature = "schema")]
use super::schema;
use super::{Robot, build, keys};
use crate::Value;
use crate::document::FileError;
use crate::model::file::ModelFile;
#[cfg(feature = "schema")]
use crate::model::kinds::Kinds;
use crate::model::kinds::Source;
use crate::model::start::Start;
use crate::quantity::{Sensor, Unfit};

impl ModelFile for Robot {
    const NAME: &'static str = "robot";

    type File = keys::File;

    fn read(source: &Source) -> Result<Self, FileError> {
        build::read(source)
    }

    fn variances(&self) -> Option<Vec<Value>> {
        Some(self.sensors.iter().flat_map(|sensor| sensor.variances.clone()).collect())
    }

    fn recalling(&self) -> &[Sensor] {
        &self.recalling
    }

    fn files(&self) -> Vec<PathBuf> {
        std::iter::once(&self.file).chain(&self.bodies.robot.included).cloned().collect()
    }

    fn warnings(&self) -> Vec<String> {
        self.bodies.robot.warnings.clone()
    }

    fn every_warning(&self) -> Vec<String> {
        self.bodies.robot.every_warning.clone()
    }

    fn doubts(&self) -> Vec<String> {
        let left_out = self.bodies.robot.left_out_forces.iter();
        left_out.map(|part| format!("the robot moves differently than its file says: {part}")).collect()
    }

    fn starts_by_itself(&self) -> bool {
        true
    }

    fn first_state(&self, start: &Start) -> Result<Vec<f64>, Unfit> {
        Robot::first_state(self, start)
    }

    fn followers(&self) -> Vec<(usize, usize)> {
        self.motor_states()
    }

    #[cfg(feature = "schema")]
    fn complete_schema(schema: &mut serde_json::Value, generator: &mut schemars::SchemaGenerator, kinds: &Kinds) {
        schema::complete(schema, generator, kinds);
    }
}
