//! Robots of rigid bodies from URDF, SDF or MJCF files, with compliance where the designer puts it.
//!
//! ```text
//! file.rs: task file + robot file -> Robot        numbers.rs: numbers that are parameters
//! situation.rs: where everything is               compliance/, drive.rs: forces        signals.rs: what can be measured
//! picture.rs: what it looks like
//! ```

use std::path::PathBuf;
use std::sync::Arc;
use supple_kernels::{Ldl, Scalar};
use supple_lqg::Dimensions;
use supple_robot::{JointKind, Tree, inverse_dynamics, mass_matrix, passive_forces_ahead, passive_resistance};

use super::{Channel, Channels, Kinds, Limit, Model, ModelFile, Point, Source};

use crate::Value;
use crate::contacts::{Contact, ContactState};
use crate::document::FileError;
use crate::physics::FileSensor;
use crate::quantity::{Known, Sensor, Unfit};
use crate::scene::Picture;

mod compliance;
mod described;
mod drive;
mod file;
mod insert;
mod integrator;
mod locked;
mod native;
mod numbers;
mod picture;
mod rigid;
mod schema;
mod signals;
mod situation;
mod start;

pub use compliance::Couplings;
pub use compliance::{BesideJoint, Compliance, ComplianceFile, Drawn, Names, Resistance, Rule};
use compliance::{CONTACT_FORCE, Element, Native};
use drive::Drive;
use integrator::{Integrator, widened};
use native::{Part, run};
use numbers::{FrameNumbers, Override};
use situation::Situation;
pub use situation::{Forces, Own};

/// A robot of rigid bodies, its drives, compliance and sensors.
///
/// The state is `[q, s, q', s', c]`: positions of the degrees of freedom (rad or m) and of what compliance adds (such as
/// motors of elastic joints), their velocities, and constants that are not known exactly (such as where a wall is). The
/// controls are torques or forces of the drives, or what the actuators of the file take. A step is
///
/// ```text
/// M(q) a = tau(q, v, u) - h(q, v)      v+ = v + dt a      q+ = q + dt v+
/// ```
///
/// where `tau` of springs, dampers, friction and contacts may be that of the step's end.
#[derive(Clone, Debug)]
pub struct Robot {
    /// The file that it was read from.
    file: PathBuf,
    robot: Arc<supple_robot::Robot>,
    tree: Arc<Tree>,
    gravity: [Value; 3],
    /// Numbers of the file that the task says anew.
    overrides: Vec<Override>,
    frames: Vec<FrameNumbers>,
    drives: Vec<Drive>,
    compliance: Vec<Element>,
    sensors: Vec<Sensor>,
    friction_smoothing: Value,
    /// A speed by which friction of joints sets in later, for planning.
    friction_widening: Option<Value>,
    integrator: Integrator,
    substeps: usize,
    /// Joints that the task has taken out.
    locked: Vec<String>,
    /// Joints that the task has inserted.
    inserted: Vec<String>,
}

impl Robot {
    /// How many positions there are: degrees of freedom, and with what compliance adds.
    fn positions(&self) -> (usize, usize) {
        let dofs = self.tree.dofs();
        (dofs, dofs + self.compliance.iter().map(|element| element.kind.coordinates()).sum::<usize>())
    }

    fn constants(&self) -> usize {
        self.compliance.iter().map(|element| element.kind.constants()).sum()
    }

    /// Whether a degree of freedom is a slide.
    fn slides(&self, dof: usize) -> bool {
        let joint = self.tree.joint_indices().get(dof).map(|&joint| self.robot.joints[joint].kind);
        joint == Some(JointKind::Prismatic)
    }

    /// Names and units of the states; of what compliance adds, the unit is that of its joint and not known here.
    fn state_channels(&self) -> Vec<Channel> {
        let (dofs, positions) = self.positions();
        let unit = |place: usize| {
            let (velocity, own) = (place / positions, place % positions);
            match (velocity, self.slides(own)) {
                (0, true) => "m",
                (1, true) => "m/s",
                (0, false) if own < dofs => "rad",
                (1, false) if own < dofs => "rad/s",
                _ => "",
            }
        };
        let names = self.state_names().into_iter().enumerate();
        names.map(|(place, name)| Channel::new(name, unit(place))).collect()
    }

    /// All forces but those of inertia: on the degrees of freedom, on what compliance adds, and on links.
    fn forces<S: Native>(&self, now: &Situation<S>) -> Forces<S> {
        let at = now.at;
        let (_, positions) = self.positions();
        let smoothing = self.friction_speed(at);
        let mut forces = Forces {
            generalised: passive_forces_ahead(&self.tree, &now.numbers, (now.q(), now.v()), now.resisted(), smoothing),
            wrenches: Vec::new(),
        };
        forces.generalised.resize(positions, S::zero());
        for (drive, &u) in self.drives.iter().zip(at.u) {
            let place = self.driven(drive);
            let (mut position, mut rate) = (at.x[place], at.x[positions + place]);
            if drive.resistance(at, now.lead()).is_some() {
                rate = now.rates()[place];
                position = now.lead().mul_add(rate, position);
            }
            forces.generalised[place] += drive.force(at, u, position, rate);
        }
        for element in &self.compliance {
            element.kind.over::<S>().apply(&now.seen_by(element), &mut forces);
        }
        forces
    }

    /// The speed over which friction of joints sets in.
    fn friction_speed<S: Scalar>(&self, at: &Point<S>) -> S {
        let own = at.value(self.friction_smoothing);
        self.friction_widening.map_or(own, |speed| widened(at, own, speed))
    }

    /// Whether any joint has friction.
    fn has_friction(&self) -> bool {
        let given =
            |change: &Override| matches!(change, Override::Joint { friction: Some(value), .. } if !value.is_zero());
        self.robot.joints.iter().any(|joint| joint.friction != 0.0) || self.overrides.iter().any(given)
    }

    /// `M`, with the rotors and what compliance adds; in an implicit step with what resists the rates at its end.
    fn inertia<S: Native>(&self, now: &Situation<S>) -> Vec<Vec<S>> {
        let (dofs, positions) = self.positions();
        let mut mass = mass_matrix(&self.tree, &now.numbers, &now.kinematics);
        for row in &mut mass {
            row.resize(positions, S::zero());
        }
        mass.resize(positions, vec![S::zero(); positions]);
        for element in &self.compliance {
            for (i, inertia) in element.kind.over::<S>().inertias(now.at).into_iter().enumerate() {
                let place = dofs + element.coordinate + i;
                mass[place][place] += inertia;
            }
        }
        for (place, rotor) in self.rotors(now.at) {
            mass[place][place] += rotor;
        }
        if self.integrator == Integrator::Implicit {
            self.resist(now, &mut mass);
        }
        mass
    }

    /// Adds how the forces at the end of a step fall with the accelerations (theory, equation R.21).
    fn resist<S: Native>(&self, now: &Situation<S>, mass: &mut [Vec<S>]) {
        let (lead, smoothing) = (now.lead(), self.friction_speed(now.at));
        let (_, positions) = self.positions();
        let joints = passive_resistance(&self.tree, &now.numbers, now.v(), lead, smoothing);
        for (dof, resistance) in joints.into_iter().enumerate() {
            mass[dof][dof] += lead * resistance;
        }
        for drive in &self.drives {
            if let Some(resistance) = drive.resistance(now.at, lead) {
                let place = self.driven(drive);
                mass[place][place] += lead * resistance;
            }
        }
        for element in &self.compliance {
            for Resistance { block, rows } in element.kind.over::<S>().resistance(&now.seen_by(element)) {
                let block: Vec<Vec<S>> =
                    block.iter().map(|row| row.iter().map(|&entry| lead * entry).collect()).collect();
                for i in 0..positions {
                    let dot = |weights: &Vec<S>| {
                        weights.iter().zip(&rows).fold(S::zero(), |sum, (&w, row)| w.mul_add(row[i], sum))
                    };
                    let weighed: Vec<S> = block.iter().map(dot).collect();
                    for j in 0..=i {
                        mass[i][j] =
                            weighed.iter().zip(&rows).fold(mass[i][j], |sum, (&w, row)| w.mul_add(row[j], sum));
                        mass[j][i] = mass[i][j];
                    }
                }
            }
        }
    }

    /// Place among all positions of what a drive acts on: its joint, or the motor of an elastic one.
    fn driven(&self, drive: &Drive) -> usize {
        drive.motor.map_or(drive.dof, |motor| self.positions().0 + motor)
    }

    /// Inertias of rotors, felt at their joints or motors.
    fn rotors<S: Scalar>(&self, at: &Point<S>) -> Vec<(usize, S)> {
        let felt = |drive: &Drive| {
            let place = self.driven(drive);
            (place, at.value(drive.gear).square() * at.value(drive.rotor))
        };
        self.drives.iter().map(felt).collect()
    }

    /// `M a - forces`: 0 at the accelerations.
    fn unbalanced<S: Native>(&self, now: &Situation<S>, a: &[S]) -> Vec<S> {
        let (dofs, positions) = self.positions();
        let forces = self.forces(now);
        let mut needed = inverse_dynamics(&self.tree, &now.numbers, &now.kinematics, &a[..dofs], &forces.wrenches);
        needed.resize(positions, S::zero());
        for element in &self.compliance {
            for (i, inertia) in element.kind.over::<S>().inertias(now.at).into_iter().enumerate() {
                let place = dofs + element.coordinate + i;
                needed[place] += inertia * a[place];
            }
        }
        for (place, rotor) in self.rotors(now.at) {
            needed[place] += rotor * a[place];
        }
        needed.iter().zip(&forces.generalised).map(|(&needed, &given)| needed - given).collect()
    }

    /// The next state after all sub-steps, each with accelerations of its own.
    fn substep<S: Native>(&self, at: &Point<S>, next: &mut [S]) {
        let dt = at.time_step / self.substeps as f64;
        let mut x = at.x.to_vec();
        for _ in 0..self.substeps {
            let at = Point { x: &x, time_step: dt, ..*at };
            let zero = vec![S::zero(); self.positions().1];
            let now = Situation::stepping(self, &at, &zero);
            let a = Ldl::new(&self.inertia(&now)).solve(self.unbalanced(&now, &zero));
            let a: Vec<S> = a.into_iter().map(|a| -a).collect();
            self.integrate(&x, &a, dt, next);
            x.copy_from_slice(next);
        }
    }

    /// One step of Euler over `dt` from the state `x`, given the accelerations.
    fn integrate<S: Scalar>(&self, x: &[S], a: &[S], dt: S, next: &mut [S]) {
        let count = a.len();
        for i in 0..count {
            let velocity = x[count + i] + dt * a[i];
            next[count + i] = velocity;
            next[i] = x[i] + dt * velocity;
        }
        next[2 * count..].copy_from_slice(&x[2 * count..]);
    }
}

impl Model for Robot {
    fn dimensions(&self) -> Dimensions {
        Dimensions {
            states: 2 * self.positions().1 + self.constants(),
            controls: self.drives.len(),
            measurements: self.sensors.iter().map(|sensor| sensor.quantity.len()).sum(),
        }
    }

    fn unknowns(&self) -> usize {
        // Sub-steps have accelerations of their own, which are solved for on the way.
        if self.substeps == 1 { self.positions().1 } else { 0 }
    }

    fn balance<S: Scalar>(&self, at: &Point<S>, residual: &mut [S]) {
        if !residual.is_empty() {
            run(self, Part::Balance, at, residual);
        }
    }

    fn mass<S: Scalar>(&self, at: &Point<S>, matrix: &mut [S]) {
        if !matrix.is_empty() {
            run(self, Part::Mass, at, matrix);
        }
    }

    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        if self.substeps == 1 {
            return self.integrate(at.x, at.w, at.time_step, next);
        }
        run(self, Part::Substeps, at, next);
    }

    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        let needed = self.sensors.iter().any(|sensor| sensor.quantity.needs_signals());
        let mut signals = Vec::new();
        if needed {
            signals.resize(self.signal_names().len(), S::zero());
            self.signal(at, &mut signals);
        }
        let known = Known { signals: &signals, next: &[] };
        let mut rest = y;
        for sensor in &self.sensors {
            let (own, others) = rest.split_at_mut(sensor.quantity.len());
            sensor.quantity.evaluate(at, &known, own);
            rest = others;
        }
    }

    fn signals(&self) -> Vec<String> {
        self.signal_names()
    }

    fn signal<S: Scalar>(&self, at: &Point<S>, out: &mut [S]) {
        run(self, Part::Signals, at, out);
    }

    fn frame_names(&self) -> Vec<String> {
        self.frame_names().into_iter().map(str::to_owned).collect()
    }

    fn motors(&self) -> Vec<(String, String)> {
        self.elastic_joints()
    }

    fn drive_names(&self) -> Vec<String> {
        self.drives.iter().map(|drive| self.drive_name(drive)).collect()
    }

    fn file_sensors(&self) -> Vec<FileSensor> {
        self.sensors_of_file()
    }

    fn joint_names(&self) -> Vec<String> {
        self.tree.joints().to_vec()
    }

    fn locked_joints(&self) -> Vec<String> {
        self.locked.clone()
    }

    fn coupling_names(&self) -> Vec<String> {
        self.compliance.iter().map(|element| element.name.clone()).collect()
    }

    fn state_names(&self) -> Vec<String> {
        let own = |prefix: &'static str| {
            self.compliance.iter().flat_map(move |element| {
                let count = element.kind.coordinates();
                (0..count).map(move |_| format!("{prefix}.{}", element.name))
            })
        };
        let joints = |prefix: &'static str| self.tree.joints().iter().map(move |joint| format!("{prefix}.{joint}"));
        let constants = self
            .compliance
            .iter()
            .flat_map(|element| (0..element.kind.constants()).map(move |_| format!("c.{}", element.name)));
        joints("q").chain(own("q")).chain(joints("v")).chain(own("v")).chain(constants).collect()
    }

    fn channels(&self) -> Channels {
        Channels {
            states: self.state_channels(),
            controls: self.drives.iter().map(|drive| self.control_channel(drive)).collect(),
            measurements: self.sensors.iter().flat_map(|sensor| sensor.channels.clone()).collect(),
        }
    }

    fn limits(&self) -> Vec<Limit> {
        let (_, positions) = self.positions();
        let mut limits = Vec::new();
        for (dof, &joint) in self.tree.joint_indices().iter().enumerate() {
            let joint = &self.robot.joints[joint];
            let [lower, upper] = [joint.limits.lower, joint.limits.upper];
            limits.push(Limit::state(format!("position of joint `{}`", joint.name), dof, lower, upper));
            let most = joint.limits.velocity;
            limits.push(Limit::state(format!("velocity of joint `{}`", joint.name), positions + dof, -most, most));
        }
        for (control, drive) in self.drives.iter().enumerate() {
            limits.extend(self.control_limits(control, drive));
        }
        limits.retain(|limit| limit.lower.is_finite() || limit.upper.is_finite());
        limits
    }

    fn contacts(&self) -> Vec<Contact> {
        let signals = Model::signals(self);
        let place = |name: &str| signals.iter().position(|signal| *signal == format!("{name}.{CONTACT_FORCE}"));
        let touching = self.compliance.iter().filter(|element| element.kind.is_contact());
        touching.map(|element| Contact { name: element.name.clone(), force_signal: place(&element.name) }).collect()
    }

    fn contact_states(&self, at: &Point<f64>) -> Vec<ContactState> {
        let now = Situation::of(self, at);
        self.compliance.iter().filter_map(|element| element.kind.contact_state(&now.seen_by(element))).collect()
    }

    fn substeps(&self) -> Option<usize> {
        Some(self.substeps)
    }

    fn widened(&self, length: Value, speed: Value) -> Option<Self> {
        let mut wide = Self { friction_widening: Some(speed), ..self.clone() };
        let mut any = self.has_friction();
        for element in &mut wide.compliance {
            if let Some(kind) = element.kind.widened(length, speed) {
                element.kind = kind;
                any = true;
            }
        }
        any.then_some(wide)
    }

    fn picture(&self, at: &Point<f64>) -> Option<Picture> {
        Some(self.draw(at))
    }

    fn landmarks<S: Scalar>(&self, at: &Point<S>) -> Vec<[S; 3]> {
        let mut entries = vec![S::zero(); 3 * self.landmark_count()];
        run(self, Part::Landmarks, at, &mut entries);
        entries.chunks_exact(3).map(|place| [place[0], place[1], place[2]]).collect()
    }
}

impl ModelFile for Robot {
    const NAME: &'static str = "robot";

    type File = file::File;

    fn read(source: &Source) -> Result<Self, FileError> {
        file::read(source)
    }

    fn variances(&self) -> Option<Vec<Value>> {
        Some(self.sensors.iter().flat_map(|sensor| sensor.variances.clone()).collect())
    }

    fn files(&self) -> Vec<PathBuf> {
        std::iter::once(&self.file).chain(&self.robot.included).cloned().collect()
    }

    fn warnings(&self) -> Vec<String> {
        self.robot.warnings.clone()
    }

    fn every_warning(&self) -> Vec<String> {
        self.robot.every_warning.clone()
    }

    fn starts_by_itself(&self) -> bool {
        true
    }

    fn first_state(&self, start: &super::Start) -> Result<Vec<f64>, Unfit> {
        Robot::first_state(self, start)
    }

    fn followers(&self) -> Vec<(usize, usize)> {
        self.motor_states()
    }

    fn complete_schema(schema: &mut serde_json::Value, generator: &mut schemars::SchemaGenerator, kinds: &Kinds) {
        schema::complete(schema, generator, kinds);
    }
}
