use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Context, Measure, SensorFile, Variance};
use crate::Channel;
use crate::model::robot::Robot;
use crate::model::robot::compliance::{Compliance, Unfit, find};
use crate::model::robot::situation::Situation;

/// Forces and torques in an element of compliance, N and N m: what a force/torque sensor in it measures.
#[derive(Clone, Debug)]
pub(crate) struct CouplingForce {
    element: usize,
    /// Which of its signals.
    selected: Vec<usize>,
}

/// Forces and torques in an element of compliance.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Name of the element.
    coupling: String,
    /// Which of its forces; all where left out.
    select: Option<Vec<String>>,
    /// Variance of the noise, one for all or one each; above 0.
    variance: Variance,
}

impl SensorFile for CouplingForce {
    type File = File;

    fn build(file: File, context: &Context) -> Result<(Self, Variance), Unfit> {
        let names: Vec<String> = context.compliance.iter().map(|element| element.name.clone()).collect();
        let element = find("coupling", "compliance", &file.coupling, &names)?;
        let kind = &context.compliance[element].kind;
        // Forces and torques are measured; how deep a contact is cannot be.
        let signals: Vec<String> =
            kind.signals().into_iter().filter(|name| *name != "penetration").map(str::to_owned).collect();
        let all: Vec<String> = kind.signals().into_iter().map(str::to_owned).collect();
        let select = file.select.unwrap_or_else(|| signals.clone());
        let place = |name: &String| {
            find("select", "measurable force", name, &signals)?;
            find("select", "force", name, &all)
        };
        Ok((Self { element, selected: select.iter().map(place).collect::<Result<_, _>>()? }, file.variance))
    }
}

impl Measure for CouplingForce {
    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, robot: &Robot) -> Vec<Channel> {
        let element = &robot.compliance[self.element];
        let signals = element.kind.signals();
        let channel = |&place: &usize| Channel::new(format!("{}.{}", element.name, signals[place]), "");
        self.selected.iter().map(channel).collect()
    }

    fn measure<S: Scalar>(&self, now: &Situation<S>, out: &mut [S]) {
        let element = &now.robot.compliance[self.element];
        let forces = element.kind.measure(&now.seen_by(element));
        for (out, &place) in out.iter_mut().zip(&self.selected) {
            *out = forces[place];
        }
    }
}
