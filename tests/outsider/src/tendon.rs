use schemars::JsonSchema;
use serde::Deserialize;
use supple::coupling::vector::{dot, scale, sub};
use supple::coupling::{
    Compliance, ComplianceFile, ConnectionKind, Drawn, Forces, Names, Own, Resistance, Rule, Unfit, Wrench,
};
use supple::{Scalar, Value};

/// An elastic tendon between the origins of two frames: it pulls where it is longer than at rest, and is slack elsewhere.
///
/// With its stretch `z`, rounded off over a length about 0, it pulls with
///
/// ```text
/// T = k (z)_+ + d z' step(z)
/// ```
#[derive(Clone, Debug)]
pub struct Tendon {
    a: usize,
    c: usize,
    stiffness: Value,
    damping: Value,
    rest: Value,
    smoothing: Value,
}

/// An elastic tendon between two frames, which pulls and does not push.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the frame or link where it begins.
    frame_a: String,
    /// Name of the frame or link where it ends.
    frame_c: String,
    /// Stiffness, N/m; at least 0.
    stiffness: Value,
    /// Damping, N s/m; at least 0.
    #[serde(default)]
    damping: Value,
    /// Length at rest, m; above 0.
    rest: Value,
    /// Stretch at which it pulls with all of its stiffness, m; above 0.
    smoothing: Value,
}

impl ComplianceFile for Tendon {
    type File = File;

    fn build(file: File, names: &Names) -> Result<Self, Unfit> {
        let (a, c) = (names.frame("frame_a", &file.frame_a)?, names.frame("frame_c", &file.frame_c)?);
        let File { stiffness, damping, rest, smoothing, .. } = file;
        Ok(Self { a, c, stiffness, damping, rest, smoothing })
    }
}

/// How it stands.
struct Standing<S> {
    /// Its direction in the world, from A to C.
    along: [S; 3],
    stretch: S,
    /// With how much it pulls, N.
    pull: S,
    /// By how much that grows with the rate of its length, N s/m.
    resistance: S,
}

impl Tendon {
    fn standing<S: Scalar>(&self, own: &Own<S>) -> Standing<S> {
        let [a, c] = [self.a, self.c].map(|frame| own.pose(frame));
        let apart = sub(c.position, a.position);
        let length = dot(apart, apart).sqrt();
        let along = scale(length.recip(), apart);
        let [moved_a, moved_c] =
            [(self.a, a), (self.c, c)].map(|(frame, pose)| pose.rotate(own.frame_rates(frame).linear));
        let (smoothing, stiffness) = (own.value(&self.smoothing), own.value(&self.stiffness));
        let stretch = length - own.value(&self.rest);
        let taut = stretch.rounded_step(smoothing);
        let resistance = taut * (own.value(&self.damping) + own.lead() * stiffness);
        let pull =
            stiffness * stretch.rounded_positive_part(smoothing) + resistance * dot(along, sub(moved_c, moved_a));
        Standing { along, stretch, pull, resistance }
    }
}

impl Compliance for Tendon {
    const NAME: &'static str = "tendon";

    fn signals(&self) -> Vec<&'static str> {
        vec!["force_x", "force_y", "force_z"]
    }

    /// The force on C in the world.
    fn measure<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        let Standing { along, pull, .. } = self.standing(own);
        scale(-pull, along).to_vec()
    }

    fn deflections(&self) -> Vec<&'static str> {
        vec!["deflection"]
    }

    fn deflect<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        vec![self.standing(own).stretch]
    }

    fn apply<S: Scalar>(&self, own: &Own<S>, forces: &mut Forces<S>) {
        let Standing { along, pull, .. } = self.standing(own);
        for (frame, pull) in [(self.a, pull), (self.c, -pull)] {
            let force = own.pose(frame).unrotate(scale(pull, along));
            forces.on_frame(own, frame, Wrench { torque: [S::zero(); 3], force });
        }
    }

    fn resistance<S: Scalar>(&self, own: &Own<S>) -> Vec<Resistance<S>> {
        let Standing { along, resistance, .. } = self.standing(own);
        let motions = [self.a, self.c].map(|frame| own.point_motions(frame, own.pose(frame).position));
        let [of_a, of_c] = motions;
        let longer: Vec<[S; 1]> = of_a.iter().zip(&of_c).map(|(a, c)| [dot(along, sub(c.linear, a.linear))]).collect();
        vec![own.spread([[resistance]], &longer)]
    }

    fn draw(&self, own: &Own<f64>) -> Drawn {
        let Standing { along, pull, .. } = self.standing(own);
        let [from, to] = [self.a, self.c].map(|frame| own.pose(frame).position);
        Drawn { kind: ConnectionKind::Spring, from, to, force: scale(-pull, along), torque: [0.0; 3] }
    }

    fn frames(&self) -> Vec<usize> {
        vec![self.a, self.c]
    }

    fn rules(&self) -> Vec<Rule<'_>> {
        vec![
            Rule::at_least("stiffness", &self.stiffness, 0.0),
            Rule::at_least("damping", &self.damping, 0.0),
            Rule::above("rest", &self.rest, 0.0),
            Rule::above("smoothing", &self.smoothing, 0.0),
        ]
    }
}
